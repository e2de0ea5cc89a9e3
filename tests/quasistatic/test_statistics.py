"""The standard error of velocities covers what it claims to, or is unknown."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from exactcreep.quasistatic.statistics import (
    FEWEST_STEPS,
    mean_over_seeds,
    standard_error,
)


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
