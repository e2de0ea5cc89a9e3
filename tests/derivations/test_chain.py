"""The exact rational chain, and the sweeps that the audit runs over a part of their range."""

from __future__ import annotations

from fractions import Fraction as F
from itertools import combinations, pairwise
from random import Random

import pytest

from derivations import sliding_limit, two_sliders
from derivations.chain import Avalanche, NotUnique, RationalChain, play_variation


def test_two_sliders_slip_by_twice_the_static_excess_and_keep_r0() -> None:
    pair = RationalChain(2, F(1, 4), F(1, 2), F(3, 5))
    pair.to(F(2))
    assert pair.slips == 9
    assert pair.x == [0, F(9, 5)]
    pair.to(F(-2))
    assert (pair.x[1] - pair.x[0]) % F(1, 5) == 0
    assert pair.x[1] == F(9, 5)
    assert pair.x[0] > 0


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


def test_a_sliding_chain_never_exceeds_mu_d_and_its_forces_match_its_positions() -> None:
    random = Random(2)
    for n in range(2, 10):
        chain = RationalChain(n, F(random.randint(1, 98), 200), F(1, 2))
        for _ in range(30):
            try:
                chain.ramp(F(random.randint(-500, 500), 100))
            except NotUnique:
                break
            x = chain.x
            tension = [F(0), *(b - a - chain.y for a, b in pairwise(x)), F(0)]
            assert chain.forces == [b - a + chain.slope for a, b in pairwise(tension)]
            assert max(map(abs, chain.forces)) <= chain.mu_d


def test_a_dummy_breakpoint_changes_nothing() -> None:
    random = Random(3)
    for n in range(2, 9):
        whole, parts = (RationalChain(n, F(13, 100), F(1, 2)) for _ in range(2))
        for _ in range(10):
            change = F(random.randint(-500, 500), 100)
            part = change * F(random.randint(1, 9), 10)
            whole.ramp(change)
            parts.ramp(part)
            parts.ramp(change - part)
        assert whole.x == parts.x


def test_the_mirror_image_of_a_sliding_chain_moves_the_other_way() -> None:
    random = Random(4)
    for n in range(2, 9):
        chain, mirror = (RationalChain(n, F(way * 13, 100), F(1, 2)) for way in (1, -1))
        for _ in range(10):
            change = F(random.randint(-500, 500), 100)
            chain.ramp(change)
            mirror.ramp(change)
        assert chain.x == [-x for x in reversed(mirror.x)]


def test_the_play_operator_rises_and_falls_by_the_truncated_variation() -> None:
    output, rise, fall = play_variation([F(3), F(1), F(5), F(-4)], F(2), F(0))
    assert output == [2, 2, 4, -3]
    assert (rise, fall) == (4, 7)


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


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(10))
def test_the_staircase_holds_on_many_more_chains(seed: int) -> None:
    random = Random(1000 + seed)
    assert all(two_sliders.velocity_agrees(random) for _ in range(2000))


@pytest.mark.slow
@pytest.mark.parametrize("n", range(2, 31))
def test_the_play_operator_moves_chains_of_up_to_thirty(n: int) -> None:
    random = Random(n)
    assert all(sliding_limit.path_agrees(random, n, 60) for _ in range(10))
