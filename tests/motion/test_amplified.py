"""Errors that are carried along: as the chain moves, later at events, forgotten at stops."""

from __future__ import annotations

import numpy as np
import pytest

from exactcreep.motion.amplified import AmplifiedErrors
from exactcreep.motion.arithmetic import FLOAT64
from exactcreep.motion.modes import Flow


def moving(offset: float) -> Flow:
    """Return a flow of two runs whose velocities and forces are a little off."""
    rng = np.random.default_rng(5)
    flow = Flow(FLOAT64, rng.normal(size=6) + offset * rng.normal(size=6), 0.1)
    flow.start([0, 1, 3, 4], [1, 1, -1, -1])
    flow.velocities[[0, 1, 3, 4]] = np.array([1, 1, -1, -1]) + offset * rng.normal(size=4)
    return flow


def test_errors_move_as_two_chains_part_that_begin_a_little_apart() -> None:
    offset, time = 1e-6, 0.7
    here, there = moving(0.0), moving(offset)
    errors = AmplifiedErrors(6, 0.0, 1.0)
    errors.forces[:, 0] = there.forces - here.forces
    errors.velocities[:, 0] = there.velocities - here.velocities
    errors.advance(here.signs, time, 1.0)
    for flow in (here, there):
        flow.advance(flow.runs(), time)
    for name in ("forces", "velocities", "moved"):
        apart = getattr(there, name) - getattr(here, name)
        assert getattr(errors, name)[:, 0] == pytest.approx(apart, abs=1e-8 * offset + 1e-15)
        assert not getattr(errors, name)[:, 1:].any()


def test_what_starts_too_late_lags_behind_and_what_stops_forgets_its_speed() -> None:
    errors = AmplifiedErrors(3, 0.0, 1.0)
    errors.forces[1] = -1e-10  # the force rises at .01: it reaches its threshold late by 1e-8
    late = errors.late(1, 0, 0.01)
    assert late == pytest.approx(1e-8)
    errors.start(1, 0.5, late)
    assert errors.velocities[1] == pytest.approx(-5e-9)
    assert errors.late(1, 1, -0.25) == pytest.approx(-2e-8)  # it is slower, and stops early
    errors.stop([1])
    assert not errors.velocities.any()
    assert errors.late(0, 0, 0.0).max() == np.inf  # a graze to first order


def test_the_roundings_of_one_step_are_in_the_error_whatever_cancels() -> None:
    errors = AmplifiedErrors(3, 2.0**-53, 1.0)
    assert errors.largest >= 2.0**-52
