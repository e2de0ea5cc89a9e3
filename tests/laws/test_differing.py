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
    (law,) = laws.differing_velocity(l0=1, sigma_theta=2, **chain)
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
