"""The exact rational chain, and what the audit proves of it, with every slip and slide followed."""

from __future__ import annotations

from fractions import Fraction as F
from itertools import pairwise
from random import Random

import pytest

from derivations.chain import Avalanche, RationalChain


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
