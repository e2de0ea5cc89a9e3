"""The exact rational chains, and the sweeps that the audit runs over a part of their range."""

from __future__ import annotations

from fractions import Fraction
from itertools import combinations, pairwise
from random import Random

import pytest

from derivations import sliding_limit, two_sliders
from derivations.play import NotUnique, SlidingChain, TwoSliders, play_variation

F = Fraction


def test_two_sliders_slip_by_twice_the_static_excess_and_keep_r0() -> None:
    pair = TwoSliders(F(1, 4), F(1, 2), F(3, 5))
    pair.ramp(F(2))
    assert pair.slips == 9
    assert pair.x == [0, F(9, 5)]
    pair.ramp(F(-2))
    assert pair.r % F(1, 5) == 0
    assert pair.x[1] == F(9, 5)
    assert pair.x[0] > 0


def test_a_slider_exactly_at_its_threshold_stays() -> None:
    pair = TwoSliders(F(1, 4), F(1, 2), F(3, 5))
    pair.ramp(F(3, 5) - F(1, 4))
    assert pair.slips == 0
    pair.ramp(pair.y + F(1, 10**40))
    assert pair.slips == 1


def test_a_sliding_chain_never_exceeds_mu_d_and_its_tensions_match_its_positions() -> None:
    random = Random(2)
    for n in range(1, 10):
        chain = SlidingChain(n, F(random.randint(1, 98), 200), F(1, 2))
        total = F(0)
        for _ in range(30):
            change = F(random.randint(-500, 500), 100)
            try:
                chain.ramp(change)
            except NotUnique:
                break
            total += change
            for slider in range(1, n + 1):
                assert abs(chain.force(slider)) <= chain.mu_d
            for k in range(1, n):
                assert chain.tension[k] == chain.x[k] - chain.x[k - 1] - total


def test_a_dummy_breakpoint_changes_nothing() -> None:
    random = Random(3)
    for n in range(2, 9):
        one, other = (SlidingChain(n, F(13, 100), F(1, 2)) for _ in range(2))
        for _ in range(10):
            change = F(random.randint(-500, 500), 100)
            part = change * F(random.randint(1, 9), 10)
            one.ramp(change)
            other.ramp(part)
            other.ramp(change - part)
        assert one.x == other.x


def test_the_mirror_image_of_a_sliding_chain_moves_the_other_way() -> None:
    random = Random(4)
    for n in range(2, 9):
        one, other = SlidingChain(n, F(13, 100), F(1, 2)), SlidingChain(n, F(-13, 100), F(1, 2))
        for _ in range(10):
            change = F(random.randint(-500, 500), 100)
            one.ramp(change)
            other.ramp(change)
        assert one.x == [-x for x in reversed(other.x)]


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
    for slope, low, high, reach, start in two_sliders.cases(2000, 1000 + seed):
        pair = TwoSliders(slope, low, high, r=start)
        pair.ramp(reach)
        pair.ramp(-reach)
        before = sum(pair.x)
        pair.ramp(reach)
        pair.ramp(-reach)
        velocity = (sum(pair.x) - before) / 4
        assert velocity == two_sliders.staircase(slope, low, high, reach, start)


@pytest.mark.slow
@pytest.mark.parametrize("n", range(2, 31))
def test_the_play_operator_moves_chains_of_up_to_thirty(n: int) -> None:
    random = Random(n)
    assert all(sliding_limit.path_agrees(random, n, 60) for _ in range(10))
