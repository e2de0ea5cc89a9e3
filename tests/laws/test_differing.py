"""Laws of chains that differ, against incremental minimisation and the laws of equal sliders."""

from __future__ import annotations

import math
from collections.abc import Iterator
from fractions import Fraction as F
from itertools import product
from random import Random
from typing import Any

import mpmath
import numpy as np
import pytest

from exactcreep import laws
from exactcreep.laws.number_types import rational
from tests.laws import differing_chains
from tests.laws.kept import rows
from tests.oracle.incremental import follow


def chains(count: int, seed: int) -> Iterator[dict[str, Any]]:
    """Yield friction, slope and end forces of chains that friction holds."""
    random = Random(seed)
    while count:
        chain = {
            "mu_d": [F(random.randint(20, 90), 100) for _ in range(random.randint(2, 12))],
            "tan_alpha": F(random.randint(-24, 24), 100),
            "end_forces": (F(random.randint(-9, 9), 13), F(random.randint(-9, 9), 17)),
        }
        if laws.differing_intercept(**chain) > 0:
            count -= 1
            yield chain


def forces(chain: dict[str, Any]) -> tuple[list[float], list[float]]:
    """Return sliding friction, and weights with end forces, in m g."""
    c, (upper, lower) = float(laws.cosine(chain["tan_alpha"])), chain["end_forces"]
    pulls = np.full(len(chain["mu_d"]), float(chain["tan_alpha"]) * c)
    pulls[[0, -1]] += float(upper), float(lower)
    return [float(mu) * c for mu in chain["mu_d"]], pulls.tolist()


def advance(chain: dict[str, Any], reach: float, *expansion: float) -> float:
    """Return the advance of the centre of mass per half-cycle, beyond the transient."""
    friction, pulls = forces(chain)
    transient = int(4 * sum(friction) / reach) + 3
    x, _ = follow(friction, pulls, [reach, -reach] * (2 + transient), expansion)
    per_cycle = x[-1] - x[-3]
    assert per_cycle == pytest.approx([per_cycle.mean()] * len(friction), abs=1e-9)
    return float(per_cycle.mean()) / 2


def test_forty_chains_creep_as_the_law_says() -> None:
    """Of both directions, below and above the threshold; and by weights, as its slope."""
    random, found = Random(2), []
    for k, chain in enumerate(chains(40, seed=5)):
        reach = float(laws.differing_intercept(**chain)) * (0.9, 1.2, 2, 5)[k % 4]
        (law,) = laws.differing_velocity(l0=1, amplitude=reach, **chain)
        assert advance(chain, reach) == pytest.approx(law, rel=1e-8, abs=1e-9)
        found.append(np.sign(law))
        if k % 4 == 0:
            weights = [F(random.randint(2, 20), 10) for _ in chain["mu_d"][1:]]
            (law,) = laws.differing_slope(expansion=weights, **chain)
            reach = 6 * sum(forces(chain)[0]) / float(min(weights))
            low, high = (advance(chain, k * reach, *map(float, weights)) for k in (1, 2))
            assert (high - low) / reach == pytest.approx(float(law), rel=1e-8, abs=1e-9)
    assert min(found.count(sign) for sign in (-1, 0, 1)) >= 3


@pytest.mark.parametrize("n", range(2, 9))
def test_with_equal_sliders_they_are_the_laws_of_equal_sliders(n: int) -> None:
    """At edges, too: two velocities."""
    for slope, amplitude in product((F(1, 4), F(-23, 100), F(3, 10)), (F(9), F(1, 20))):
        known = {"l0": F(10), "mu_d": F(1, 2), "tan_alpha": abs(slope), "amplitude": amplitude}
        both = laws.law_values(laws.sliding_velocity, known | {"n": n})
        found = laws.differing_velocity(**known | {"mu_d": [F(1, 2)] * n, "tan_alpha": slope})
        assert found == pytest.approx(sorted(math.copysign(1, slope) * value for value in both))
        resting = laws.pivot_sliders([F(1, 2)] * n, slope)
        pivots = laws.pivots(n, slope, F(1, 2))
        assert resting.dilation == tuple(i - 1 for i in pivots)
        assert resting.contraction == tuple(n + 2 - i for i in reversed(pivots))


def test_random_dilations_are_followed_by_the_play() -> None:
    chain = {"mu_d": [F(1, 2), F(1, 5), F(1, 2), F(1, 3)], "tan_alpha": F(1, 10),
             "end_forces": (F(0), F(3, 10))}  # fmt: skip
    places = np.random.default_rng(4).normal(0, 2, 6000)
    x, _ = follow(*forces(chain), places, steps=1)
    (law,) = laws.differing_velocity_random(l0=1, sigma_theta=2, **chain)
    assert x[-1].mean() / len(places) == pytest.approx(float(law), rel=0.03)


def test_pivots_are_decided_exactly_where_the_cosine_is_irrational() -> None:
    """Next to an edge, where an end force takes 1/3 cos(alpha), but for a part in 10^40."""
    friction, slope = [F(1, 3), F(2, 3)], F(1, 3)
    digits = mpmath.mp.clone()
    digits.dps = 60
    edge = rational(laws.cosine(digits.mpf(1) / 3))
    for off, pivot in ((F(-1, 10**40), 2), (F(1, 10**40), 1)):
        found = laws.pivot_sliders(friction, slope, (-edge / 3 + off, F(0)))
        assert found.dilation == (pivot,)
    assert laws.pivot_sliders(friction, F(0), (F(1, 3), 0)).dilation == (1, 2)


def test_the_deviation_is_that_of_random_chains_that_stick_and_slip() -> None:
    ratio = []
    for row in rows(differing_chains.FILE):
        chain, drive = differing_chains.case(int(row["number"]))
        found = laws.prediction(chain, drive)
        assert found is not None
        assert found.values[0] == pytest.approx(float(row["law"]), rel=1e-6, abs=1e-6)
        assert (found.deviation > 0) == (chain.n >= 8) == found.law.endswith("measured")
        if found.deviation > 0:
            ratio.append(abs(float(row["velocity"]) - float(row["law"])) / found.deviation)
    assert len(ratio) == 80
    assert np.sqrt(np.square(ratio).mean()) == pytest.approx(1, abs=0.03)
    assert [round(float(np.less(ratio, k).mean()), 2) for k in (1, 2)] == [0.72, 0.96]


def test_beyond_the_chains_that_were_measured_no_deviation_is_stated() -> None:
    about = {"l0": 1000, "tan_alpha": 0.1, "amplitude": 0.003, "sigma_mu": 0}
    chain = {"mu_d": [0.4, 0.6] * 4, "mu_s": [0.5, 0.7] * 4}
    assert laws.differing_deviation(**chain, **about) > 0
    assert laws.differing_deviation(**about | {"mu_d": [0.5] * 3, "mu_s": [0.5] * 3}) == 0
    for changed in (
        {"amplitude": 0.0008}, {"sigma_mu": 0.09}, {"mu_s": [1] * 8},
        {"mu_d": [0.4, 0.5, 0.6], "mu_s": [0.5, 0.6, 0.7]},
    ):  # fmt: skip
        assert np.isnan(laws.differing_deviation(**about | chain | changed))


@pytest.mark.slow
def test_the_chains_that_were_measured_are_run_again() -> None:
    kept = rows(differing_chains.FILE)
    for number in (1, 8, 53):
        again = differing_chains.measured(number)
        off = math.hypot(again["error"], float(kept[number]["error"]))
        off += 1e-6 * abs(again["velocity"])
        assert abs(again["velocity"] - float(kept[number]["velocity"])) <= 4 * off
