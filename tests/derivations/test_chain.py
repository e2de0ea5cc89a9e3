"""The exact rational chain, and what the audit proves of it, with every slip and slide followed."""

from __future__ import annotations

from fractions import Fraction as F
from itertools import combinations, pairwise
from random import Random

import pytest

from derivations.chain import Avalanche, RationalChain, play_variation


def test_a_slider_exactly_at_its_threshold_stays() -> None:
    pair = RationalChain(2, F(1, 4), F(1, 2), F(3, 5))
    pair.to(F(3, 5) - F(1, 4))
    assert pair.slips == 0
    pair.to(pair.y + F(1, 10**40))
    assert pair.slips == 1


def test_a_slip_that_sets_another_slider_in_motion_is_refused() -> None:
    with pytest.raises(Avalanche):
        RationalChain(2, F(0), F(1, 2), F(3, 5)).to(F(1))  # both start together
    with pytest.raises(Avalanche):
        RationalChain(3, F(1, 4), F(1, 2), F(3, 5)).to(F(5))


def test_a_slider_that_a_slip_brings_to_its_threshold_stays() -> None:
    """Two lone slips of slider 3 bring slider 2 there exactly, where floats pass it."""
    chain = RationalChain(3, F(1, 5), F(1, 2), F(3, 5))
    chain.to(F(4, 5) - F(1, 10**6))
    assert (chain.slips, chain.forces[1]) == (2, chain.holds)


@pytest.mark.parametrize("static", [None, F(3, 5)], ids=["slides", "slips"])
def test_forces_are_those_of_the_places_whatever_the_path(static: F | None) -> None:
    """Tensions of the displacements; friction; and slides that spend the ramp to its end."""
    random, sizes = Random(5), range(2, 9) if static is None else (2,)
    for size in sizes:
        chain = RationalChain(size, F(random.randint(31, 40), 100), F(1, 2), static)
        for _ in range(12):
            chain.to(F(random.randint(-90, 90), 17))
            x, y = chain.x, chain.y
            inner = [below - above - y for above, below in pairwise(x)]
            tensions = [F(0), *inner, F(0)]
            assert chain.forces == [b - a + chain.slope for a, b in pairwise(tensions)]
            assert max(map(abs, chain.forces)) <= chain.holds


def test_the_truncated_variation_is_that_of_the_best_subsequence() -> None:
    """From a start that the first value does not push, and fixed by the first that does."""
    random = Random(7)
    for _ in range(60):
        values = [F(random.randint(0, 12)) for _ in range(9)]
        level = F(random.randint(0, 8), 2)
        best = max(
            sum((max(abs(b - a) - level, F(0)) for a, b in pairwise(chosen)), F(0))
            for size in range(1, 10)
            for chosen in combinations(values, size)
        )
        least = min(
            sum(play_variation(values, level, start)[1:], F(0))
            for start in (values[0] - level / 2 + F(k, 2) for k in range(int(2 * level) + 1))
        )
        assert least == best


def test_at_the_slope_of_its_friction_all_of_a_chain_slides_down_but_one_end() -> None:
    """All are at their threshold: dilated, the uppermost stays, and contracted, the lowermost."""
    for size in range(2, 6):
        chain = RationalChain(size, F(1, 2), F(1, 2))
        chain.to(F(3))
        assert chain.x == [3 * k for k in range(size)]
        chain.to(F(0))
        assert chain.x == [3 * (size - 1)] * size
        assert chain.forces == [F(1, 2)] * size
        uphill = RationalChain(size, F(-1, 2), F(1, 2))
        uphill.to(F(3))
        assert uphill.x == [-3 * k for k in reversed(range(size))]
