"""Laws of chains that differ, against incremental minimisation and the laws of equal sliders."""

from __future__ import annotations

import math
from collections.abc import Iterator
from fractions import Fraction as F
from itertools import product
from random import Random

import numpy as np
import pytest

from exactcreep import laws
from exactcreep.laws.number_types import rational
from tests.laws import differing_chains
from tests.laws.kept import rows
from tests.laws.parameters import CONTEXT
from tests.oracle.incremental import follow


def differing(random: Random) -> tuple[list[F], F, tuple[F, F]]:
    """Return friction, slope and end forces of a chain that friction holds."""
    friction = [F(random.randint(20, 90), 100) for _ in range(random.randint(2, 12))]
    slope = F(random.randint(-24, 24), 100)
    ends = F(random.randint(-9, 9), 13), F(random.randint(-9, 9), 17)
    try:
        laws.pivot_sliders(friction, slope, ends)
    except ValueError:
        return differing(random)
    return friction, slope, ends


def chains(count: int, seed: int) -> Iterator[tuple[list[F], F, tuple[F, F]]]:
    random = Random(seed)
    for _ in range(count):
        yield differing(random)


def forces(friction: list[F], slope: F, ends: tuple[F, F]) -> tuple[list[float], list[float]]:
    """Return sliding friction, and weights with end forces, in m g."""
    c = float(laws.cosine(slope))
    pulls = [float(slope) * c] * len(friction)
    pulls[0] += float(ends[0])
    pulls[-1] += float(ends[1])
    return [float(mu) * c for mu in friction], pulls


def advance(friction: list[float], pulls: list[float], reach: float, *expansion: float) -> float:
    """Return the advance of the centre of mass per half-cycle, beyond the transient."""
    n = len(friction)
    transient = int(4 * sum(friction) / reach) + 3 if reach else 0
    places = [reach, -reach] * (2 + transient)
    x, _ = follow(friction, pulls, places, expansion)
    per_cycle = x[-1] - x[-3]
    assert per_cycle == pytest.approx([per_cycle.mean()] * n, abs=1e-9)
    return float(per_cycle.mean()) / 2


def test_forty_chains_creep_as_the_law_says() -> None:
    """Of both directions, below and above the threshold."""
    found = []
    for k, (friction, slope, ends) in enumerate(chains(40, seed=5)):
        held, pulls = forces(friction, slope, ends)
        reach = float(laws.differing_intercept(friction, slope, ends)) * (0.9, 1.2, 2, 5)[k % 4]
        (law,) = laws.differing_velocity(
            l0=1, mu_d=friction, tan_alpha=slope, amplitude=reach, end_forces=ends
        )
        assert advance(held, pulls, reach) == pytest.approx(law, rel=1e-8, abs=1e-9)
        found.append(np.sign(law))
    assert min(found.count(sign) for sign in (-1, 0, 1)) >= 3


def test_the_slope_of_chains_whose_springs_expand_by_weights() -> None:
    random = Random(2)
    for friction, slope, ends in chains(12, seed=8):
        held, pulls = forces(friction, slope, ends)
        weights = [F(random.randint(2, 20), 10) for _ in friction[1:]]
        (law,) = laws.differing_slope(friction, slope, weights, ends)
        reach = 6 * sum(held) / float(min(weights))
        low, high = (advance(held, pulls, k * reach, *map(float, weights)) for k in (1, 2))
        assert (high - low) / reach == pytest.approx(float(law), rel=1e-8, abs=1e-9)


@pytest.mark.parametrize("n", range(2, 9))
def test_with_equal_sliders_they_are_the_laws_of_equal_sliders(n: int) -> None:
    """Below and above the threshold, and at edges, too: two velocities."""
    slopes = (F(1, 4), F(23, 100), F(-1, 10), F(3, 10))
    for slope, amplitude in product(slopes, (F(9), F(1, 7), F(1, 20))):
        known = {"l0": F(10), "tan_alpha": abs(slope), "amplitude": amplitude}
        both = laws.law_values(laws.sliding_velocity, known | {"n": n, "mu_d": F(1, 2)})
        known["tan_alpha"] = slope
        found = laws.differing_velocity(mu_d=[F(1, 2)] * n, **known)
        sign = -1 if slope < 0 else 1
        assert found == pytest.approx(sorted(sign * value for value in both))
        half = laws.differing_intercept([F(1, 2)] * n, slope)
        assert half == pytest.approx(n * (0.5 - abs(slope)) * laws.cosine(slope) / 2)
        pivots = laws.pivots(n, slope, F(1, 2))
        resting = laws.pivot_sliders([F(1, 2)] * n, slope)
        assert resting.dilation == tuple(i - 1 for i in pivots)
        assert resting.contraction == tuple(n + 2 - i for i in reversed(pivots))


def test_random_dilations_are_followed_by_the_play() -> None:
    friction, slope, ends = [F(1, 2), F(1, 5), F(1, 2), F(1, 3)], F(1, 10), (F(0), F(3, 10))
    places = np.random.default_rng(4).normal(0, 2, 6000)
    x, _ = follow(*forces(friction, slope, ends), places, steps=1)
    (law,) = laws.differing_velocity_random(
        l0=1, mu_d=friction, tan_alpha=slope, sigma_theta=2, end_forces=ends
    )
    assert x[-1].mean() / len(places) == pytest.approx(float(law), rel=0.03)


def test_pivots_are_decided_exactly_where_the_cosine_is_irrational() -> None:
    """Next to an edge, where an end force takes 1/3 cos(alpha), but for a part in 10^40."""
    friction, slope = [F(1, 3), F(2, 3)], F(1, 3)
    edge = rational(laws.cosine(CONTEXT.mpf(1) / 3))
    for off, pivot in ((F(-1, 10**40), 2), (F(1, 10**40), 1)):
        found = laws.pivot_sliders(friction, slope, (-edge / 3 + off, F(0)))
        assert found.dilation == (pivot,)
    assert laws.pivot_sliders(friction, F(0), (F(1, 3), 0)).dilation == (1, 2)


def test_chains_that_friction_does_not_hold_are_refused() -> None:
    half = F(1, 2)
    for friction, slope, pull in ([half] * 3, half, 0), ([half] * 3, 0, F(3, 2)), ([], 0, 0):
        with pytest.raises(ValueError, match=r"^(friction|mu_d) must hold"):
            laws.pivot_sliders(friction, slope, (pull, 0))
    with pytest.raises(ValueError, match="2 positive weights"):
        laws.differing_slope([half] * 3, F(1, 10), [1])


def test_the_deviation_is_that_of_random_chains_that_stick_and_slip() -> None:
    off, stated = [], []
    for kept in rows(differing_chains.FILE):
        row = {name: float(value) for name, value in kept.items()}
        chain, drive = differing_chains.case(int(row["number"]))
        found = laws.prediction(chain, drive)
        assert found is not None
        assert found.values[0] == pytest.approx(row["law"], rel=1e-6, abs=1e-6)
        assert (found.deviation > 0) == (chain.n >= 8)
        off.append(row["velocity"] - row["law"])
        stated.append(found.deviation)
    ratio = np.abs(np.array(off) / stated)
    assert len(ratio) == differing_chains.COUNT
    ratio = ratio[~np.isnan(ratio)]
    assert len(ratio) == 80
    assert np.sqrt(np.square(ratio).mean()) == pytest.approx(1, abs=0.03)
    assert [round(float((ratio < k).mean()), 2) for k in (1, 2)] == [0.72, 0.96]


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
