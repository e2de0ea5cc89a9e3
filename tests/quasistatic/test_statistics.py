"""The standard error of velocities covers what it claims to, or is unknown."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from exactcreep import GaussianSteps, creep
from exactcreep.quasistatic.statistics import (
    FEWEST_STEPS,
    mean_over_seeds,
    rests_for_long,
    standard_error,
)
from exactcreep.solvers.return_map import approach
from tests.paper import paper_chain


def walk(seed: int, steps: int, memory: float) -> NDArray[np.float64]:
    """Return the sums of steps of mean 1 that keep this part of the one before (AR(1))."""
    noise = np.random.default_rng(seed).standard_normal(steps)
    last, moves = 0.0, []
    for one in noise.tolist():
        last = memory * last + one
        moves.append(1 + last)
    return np.concatenate([[0.0], np.cumsum(moves)])


@pytest.mark.parametrize(
    ("memory", "steps", "least", "most"),
    [(0.0, 64, 110, 200), (0.5, 300, 110, 200), (0.9, 2000, 110, 200), (0.98, 256, 0, 30)],
)
def test_the_error_covers_the_mean_of_a_series_or_is_unknown_if_it_is_short_beside_its_memory(
    memory: float, steps: int, least: int, most: int
) -> None:
    """An interval of 95 % holds the mean of 200 series in nine of ten or more."""
    known = wrong = 0
    clock = np.arange(steps + 1.0)
    for seed in range(200):
        positions = walk(seed, steps, memory)
        error = standard_error(positions, clock)
        if not math.isnan(error):
            known += 1
            wrong += abs(positions[-1] / steps - 1) > 1.96 * error
    assert least <= known <= most
    assert wrong <= 21


def test_a_steady_advance_has_no_error_and_few_steps_no_known_one() -> None:
    clock = np.arange(FEWEST_STEPS + 1.0)
    assert math.isnan(standard_error(clock[1:], clock[1:]))
    assert standard_error(clock, clock) == standard_error(0 * clock, clock) == 0
    assert math.isnan(standard_error(0 * clock, clock, silent=math.nan))
    long = np.arange(541.0)
    for period in (2, 5, 64):  # bounded noise on it is no doubt
        assert 0 <= standard_error(long + (long % period == 0), long) < 0.1


def test_a_series_in_time_does_not_care_how_its_steps_are_counted() -> None:
    positions = walk(3, 2048, 0.3)
    clock = np.cumsum(np.random.default_rng(1).uniform(1, 3, 2049))
    error = standard_error(positions, clock)
    assert standard_error(positions, 7 * clock) == pytest.approx(error / 7, rel=1e-12, abs=0)
    assert standard_error(clock.copy(), clock) < 1e-12  # an advance in step with the clock


def test_rests_without_a_finite_variance_leave_no_known_error() -> None:
    for n, tan_alpha, spoiled in (
        (2, "0", True), (2, "-0.005", True), (2, "0.0075", False), (4, "0", False),
    ):  # fmt: skip
        assert rests_for_long(paper_chain(n, tan_alpha=tan_alpha), 3000) is spoiled
    result = creep(paper_chain(2, tan_alpha="0.005"), GaussianSteps("0.01", 3000), record=())
    assert math.isnan(result.velocity_error)
    assert "too few for a standard error beside the time" in result.velocity_reason


def test_steps_that_fall_as_fast_as_inverse_squares_are_told_from_others() -> None:
    number = np.arange(1.0, 66.0)
    for power, told in ((1, False), (1.5, False), (2, True), (3, True)):
        ends = np.cumsum(number**-power)[:, np.newaxis]
        found = approach(ends, 128)
        assert (found is not None) is told
        assert found is None or found.change == pytest.approx(65.0**-power, rel=1e-9)
    assert approach(np.append(ends, ends[-1:], axis=0), 128) is None  # it has come to rest
    assert approach(ends, 63) is None


@pytest.mark.parametrize("place", [0, 3, 4, 10, 899])
def test_a_single_jump_is_no_drift_wherever_it_lies(place: int) -> None:
    """Its velocity is the jump over the time, and so is about its error."""
    for steps in (900, 901, 911):  # no number of blocks divides them
        moves = 0.01 * np.random.default_rng(1).standard_normal(steps)
        moves[place] += 5
        positions = np.concatenate([[0.0], np.cumsum(moves)])
        error = standard_error(positions, np.arange(steps + 1.0), least=True)
        assert positions[-1] / steps == pytest.approx(0.75 * error, rel=0.05)


NAN = math.nan


@pytest.mark.parametrize(
    ("velocities", "errors", "mean", "error"),
    [
        ([1, 2, 3, 6], [0.3, 0.4, NAN, 0.1], 3, math.sqrt(14 / 3 / 4)),  # the scatter
        ([1, 2, 3, 6], [0.3, 0.4, 0, 0], 3, 0.125),  # their own errors
        ([1, 3, NAN, NAN], [0.3, 0.4, NAN, NAN], 2, 0.25),  # two were interrupted
        ([1, 2, 6, NAN], [0.3, NAN, NAN, NAN], 3, math.sqrt(14 / 2 / 3)),
        ([1, 3, NAN, NAN], [0.3, NAN, NAN, NAN], 2, NAN),  # two scatter by chance
        ([2, 2, 2], [NAN, NAN, NAN], 2, NAN),  # no scatter is no error of 0
        ([NAN, NAN], [NAN, NAN], NAN, NAN),
    ],
)
def test_seeds_that_finished_are_averaged_and_their_scatter_stands_in_for_a_missing_error(
    velocities: list[float], errors: list[float], mean: float, error: float
) -> None:
    found = mean_over_seeds(np.array([velocities] * 2, float), np.array([errors] * 2, float))
    np.testing.assert_allclose(found, [[mean] * 2, [error] * 2], rtol=1e-14)
