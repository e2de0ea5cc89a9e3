"""The standard error of velocities covers what it claims to, or is unknown."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from exactcreep import Chain, Cycles, GaussianSteps, creep
from exactcreep.solvers.statistics import (
    _MOST_GROWTH,
    FEWEST_STEPS,
    rests_for_long,
    standard_error,
)


def chain_of(n: int, tan_alpha: str) -> Chain:
    return Chain(n, 1000, "0.5", "0.6", "0.01", tan_alpha=tan_alpha)


def walk(seed: int, steps: int, memory: float) -> NDArray[np.float64]:
    """Return the sums of steps of mean 1 that keep this part of the one before (AR(1))."""
    noise = np.random.default_rng(seed).standard_normal(steps)
    last, moves = 0.0, []
    for one in noise.tolist():
        last = memory * last + one
        moves.append(1 + last)
    return np.concatenate([[0.0], np.cumsum(moves)])


def missed(runs: list[NDArray[np.float64]], truth: float) -> tuple[int, int]:
    """Return how often the error is known, and the interval of 95 % then does not hold `truth`."""
    known = wrong = 0
    for positions in runs:
        clock = np.arange(positions.size, dtype=float)
        error = standard_error(positions, clock)
        if not math.isnan(error):
            known += 1
            wrong += abs(positions[-1] / clock[-1] - truth) > 1.96 * error
    return known, wrong


@pytest.mark.parametrize(("memory", "steps"), [(0.0, 64), (0.0, 1000), (0.5, 300), (0.9, 2000)])
def test_the_interval_covers_the_mean_of_a_series_long_beside_its_memory(
    memory: float, steps: int
) -> None:
    known, wrong = missed([walk(seed, steps, memory) for seed in range(200)], 1.0)
    assert known >= 110
    assert wrong <= 21


def test_a_series_short_beside_its_memory_has_no_known_error() -> None:
    known, wrong = missed([walk(seed, 256, 0.98) for seed in range(200)], 1.0)
    assert known <= 30
    assert wrong <= 21


def test_few_steps_say_nothing_and_none_that_moves_says_what_it_is_told_to() -> None:
    clock = np.arange(FEWEST_STEPS + 1.0)
    assert math.isnan(standard_error(clock[1:], clock[1:]))
    assert standard_error(clock, clock) == 0
    assert standard_error(0 * clock, clock) == 0
    assert math.isnan(standard_error(0 * clock, clock, silent=math.nan))


@pytest.mark.parametrize("period", [2, 3, 5, 7, 64])
def test_bounded_noise_on_a_steady_advance_has_a_known_error(period: int) -> None:
    clock = np.arange(541.0)
    error = standard_error(clock + (clock % period == 0), clock)
    assert 0 <= error < 0.1


def test_a_series_in_time_does_not_care_how_its_steps_are_counted() -> None:
    positions = walk(3, 2048, 0.3)
    clock = np.cumsum(np.random.default_rng(1).uniform(1, 3, 2049))
    error = standard_error(positions, clock)
    assert standard_error(positions, 7 * clock) == pytest.approx(error / 7, rel=1e-12, abs=0)
    steady = standard_error(clock.copy(), clock)  # an advance in step with the clock
    assert steady < 1e-12


REGIMES = {
    "two sliders, a small slope": (chain_of(2, "0.005"), GaussianSteps("0.01", 3000)),
    "two sliders, a smaller slope": (chain_of(2, "0.003"), GaussianSteps("0.01", 3000)),
    "thirty sliders near threshold": (chain_of(30, "0.25"), Cycles("0.0037", 300)),
    "six sliders far from it": (chain_of(6, "0.2"), Cycles("0.005", 300)),
    "two sliders on a stair": (chain_of(2, "0.25"), Cycles("0.00045", 600)),
    "six sliders, random dilations": (chain_of(6, "0.2"), GaussianSteps("0.005", 2000)),
}


@pytest.mark.slow
@pytest.mark.parametrize("regime", REGIMES)
def test_of_200_seeds_179_velocities_lie_within_their_interval_or_have_none(regime: str) -> None:
    chain, drive = REGIMES[regime]
    results = [creep(chain, drive, seed=seed, record=()) for seed in range(200)]
    velocities = np.array([result.velocity for result in results])
    errors = np.array([result.velocity_error for result in results])
    known = ~np.isnan(errors)
    wrong = np.abs(velocities - velocities.mean())[known] > 1.96 * errors[known]
    print(f"{regime}: known {known.sum()}, not covered {wrong.sum()}")
    # 179 of 200, and of the known ones not fewer
    assert wrong.sum() <= stats.binom.ppf(0.999, known.sum(), 0.05)
    assert wrong.sum() <= 21


@pytest.mark.parametrize("tan_alpha", ["0.005", "0.003"])
def test_rests_without_a_finite_variance_leave_no_known_error(tan_alpha: str) -> None:
    result = creep(chain_of(2, tan_alpha), GaussianSteps("0.01", 3000), record=())
    assert math.isnan(result.velocity_error)
    assert "too few for a standard error beside the time" in result.velocity_reason


def test_rests_of_two_sliders_end_where_the_slope_is_large_beside_the_disorder() -> None:
    for tan_alpha, spoiled in (("0", True), ("0.005", True), ("-0.005", True), ("0.0075", False)):
        assert rests_for_long(chain_of(2, tan_alpha), 3000) is spoiled
    assert not rests_for_long(chain_of(2, "0.005"), 10**8)
    assert not rests_for_long(chain_of(4, "0"), 3000)
    assert not rests_for_long(Chain(2, 1000, "0.5", "0.6", tan_alpha="0.003"), 3000)
    results = [
        creep(chain_of(2, "0.0075"), GaussianSteps("0.01", 1000), seed=seed, record=())
        for seed in range(20)
    ]
    assert sum(not math.isnan(result.velocity_error) for result in results) >= 8


def test_the_growth_that_chance_allows_is_a_quantile_of_fisher_s_ratio() -> None:
    for blocks, most in _MOST_GROWTH.items():
        assert most == pytest.approx(stats.f.ppf(0.99, blocks - 1, FEWEST_STEPS - 1), rel=1e-12)
