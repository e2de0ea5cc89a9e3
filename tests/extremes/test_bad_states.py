"""States and drives that no chain can have, and how each is refused before anything runs."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from exactcreep import (
    Chain,
    Cycles,
    GaussianSteps,
    InputError,
    Outcome,
    Path,
    State,
    creep,
    rearrange,
)
from exactcreep.model.drive import Drive
from exactcreep.solvers.registry import SOLVERS

CHAIN = Chain(3, 1000, "0.5", "0.6", "0.01", tan_alpha="0.25")
REST = State.relaxed(CHAIN)


def state(**changes: Any) -> State:
    names = ("tensions", "displacements", "coefficients", "draws", "theta")
    return State(**{name: getattr(REST, name) for name in names} | changes)


@pytest.mark.parametrize("wild", [math.nan, -math.inf])
@pytest.mark.parametrize("field", ["tensions", "displacements", "coefficients", "theta"])
def test_a_state_that_is_not_finite_starts_no_run(field: str, wild: float) -> None:
    given: Any = getattr(REST, field)
    value = wild if field == "theta" else np.array([wild, *given[1:]])
    for bad in (state(**{field: value}), state(**{field: np.array(value, dtype=object)[()]})):
        for solver in SOLVERS:
            with pytest.raises(InputError, match=rf"^state\.{field} = "):
                creep(CHAIN, Cycles("0.001", 1), start=bad, solver=solver)
        with pytest.raises(InputError, match=rf"^state\.{field} = "):
            rearrange(CHAIN, bad, direction=1)


def test_a_state_takes_whole_and_short_numbers_for_what_they_are() -> None:
    short = np.array([0.25, 0.5], dtype=np.float32)
    assert state(tensions=short).tensions.dtype == np.float64
    assert state(tensions=[1, 0]).tensions.tolist() == [1.0, 0.0]
    assert state(draws=[1, 2, 3]).draws.dtype == np.int64
    exact = np.array([Fraction(1, 3), Fraction(0)], dtype=object)
    assert state(tensions=exact).tensions[0] == Fraction(1, 3)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize(
    "drive",
    [
        Cycles("1e306", 2), GaussianSteps("1e400", 2), GaussianSteps("2e304", 2),
        Path(["0.001", "-1e400"]),
    ],
    ids=repr,
)  # fmt: skip
def test_a_drive_beyond_the_largest_float_is_refused(drive: Drive, solver: str) -> None:
    with pytest.raises(InputError, match="largest float"):
        creep(CHAIN, drive, solver=solver)


def test_springs_as_long_as_floats_reach_take_what_dilation_leaves_room_for() -> None:
    huge = Chain(3, "1e308", "0.5", "0.6", tan_alpha="0.25")
    assert creep(huge, Cycles(0, 1)).outcome is Outcome.AT_REST
    moved, usual = (
        creep(Chain(3, l0, "0.5", "0.6", tan_alpha="0.25"), Cycles(Fraction(2) / Fraction(l0), 2))
        for l0 in ("1e300", 1000)
    )
    assert moved.event_count == usual.event_count > 50
    theta = State.prepared(huge, ["0", "0"], theta="1e10")
    with pytest.raises(InputError, match=r"^start\.theta = "):
        creep(huge, Cycles(0, 1), start=theta)
