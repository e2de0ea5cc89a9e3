"""The rules of the model: every solver that takes them from `model.rules` obeys each of them."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from exactcreep import Chain, Evidence, Path, State, creep, rearrange
from exactcreep.model.contacts import Itinerary

LEVEL = Chain(3, 1, "0.5", "0.75", tan_alpha=0)
HELD = 10.0
"""A static coefficient that nothing overcomes here."""

pytestmark = pytest.mark.parametrize("solver", ["exact", "reference", "certified"])


def state(tensions: tuple[Any, Any], *coefficients: float) -> State:
    """Return a level chain; forces are T_1, T_2 - T_1, -T_2 and thresholds the coefficients."""
    given = np.array([Fraction(tension) for tension in tensions], dtype=object)
    return State(given, np.zeros(3), np.array(coefficients), np.ones(3, dtype=int), 0.0)


def itinerary(solver: str, start: State, direction: int = 0) -> Itinerary:
    return rearrange(LEVEL, start, direction=direction, solver=solver).itinerary


@pytest.mark.parametrize(("pull", "sign"), [("0.76", 1), ("-0.76", -1), ("3/4", 0), ("-3/4", 0)])
def test_a_slider_starts_beyond_its_threshold_the_way_it_is_pulled(
    solver: str, pull: str, sign: int
) -> None:
    done = rearrange(LEVEL, state((pull, 0), 0.75, HELD, HELD), direction=0, solver=solver)
    assert done.itinerary[:1] == ((("start", (1,), (sign,)),) if sign else ())
    if solver == "exact":  # others decide an equality by arithmetic
        assert done.evidence is (Evidence.COMPUTED if sign else Evidence.UNDECIDED)


@pytest.mark.parametrize(("pull", "turns"), [("1.74", False), ("7/4", False), ("1.76", True)])
@pytest.mark.parametrize("sign", [1, -1])
def test_what_follows_a_stop_is_a_reversal_beyond_the_new_threshold(
    solver: str, pull: str, turns: bool, sign: int
) -> None:
    slip = ("start", (1,), (sign,)), ("stop", (1,), (sign,))  # from the force F to 1 - F
    back = ("start", (1,), (-sign,)), ("stop", (1,), (-sign,))
    told = itinerary(solver, state((sign * Fraction(pull), 0), 0.75, HELD, HELD))
    assert told == (slip + back if turns else slip)


@pytest.mark.parametrize(("end", "slips"), [("0.74", 0), ("3/4", 0), ("0.76", 1)])
@pytest.mark.parametrize("way", [1, -1])
def test_a_slider_that_reaches_its_threshold_at_the_end_of_a_ramp_stays(
    solver: str, end: str, slips: int, way: int
) -> None:
    start, drive = state((0, 0), 0.75, HELD, HELD), Path([way * Fraction(end)])
    run = creep(LEVEL, drive, start=start, solver=solver, record=["events"])
    assert run.event_count == 2 * slips


@pytest.mark.parametrize(("held", "next_kind"), [(0.88, "stop"), (0.875, "stop"), (0.87, "start")])
def test_a_neighbour_that_reaches_its_threshold_as_a_slip_ends_stays(
    solver: str, held: float, next_kind: str
) -> None:
    start = state((1, "7/8"), 0.75, held, HELD)  # the force on slider 2 goes from -1/8 to 7/8
    first, then = itinerary(solver, start)[:2]
    assert (first, then[0]) == (("start", (1,), (1,)), next_kind)


@pytest.mark.parametrize(("tension", "first"), [("0.12", (1,)), ("1/8", (1, 3)), ("0.13", (3,))])
def test_the_first_start_on_a_ramp_comes_first_and_equal_ones_together(
    solver: str, tension: str, first: tuple[int, ...]
) -> None:
    told = itinerary(solver, state((tension, 0), 0.75, HELD, 0.875), direction=1)
    assert told[0] == ("start", first, tuple(-1 if n == 1 else 1 for n in first))


@pytest.mark.parametrize("ends", [(1,), (1, 3)])
def test_a_slip_that_nothing_drives_has_length_zero_and_draws(
    solver: str, ends: tuple[int, ...]
) -> None:
    lower = 0.5 if 3 in ends else HELD
    start = state((0, 0), 0.5, HELD, lower)
    done = rearrange(LEVEL, start, direction=1, solver=solver)
    signs = tuple(-1 if n == 1 else 1 for n in ends)
    assert done.itinerary == (("start", ends, signs), ("stop", ends, signs))
    assert float(done.events[-1].time) == 0
    assert not done.state.displacements.astype(float).any()
    assert done.state.coefficients[[n - 1 for n in ends]].tolist() == [0.75] * len(ends)


def test_a_slider_that_starts_without_drive_is_carried_along(solver: str) -> None:
    first, then, after = itinerary(solver, state((1, "7/8"), 0.75, 0.5, HELD))[:3]
    assert (first, then) == (("start", (1,), (1,)), ("start", (2,), (1,)))
    assert after[:2] == ("stop", (1,))


@pytest.mark.parametrize(("tensions", "then"), [((1, "7/4"), "start"), ((-1, "-1/4"), "stop")])
def test_a_slider_at_its_threshold_starts_if_it_is_pushed_on(
    solver: str, tensions: tuple[Any, Any], then: str
) -> None:
    told = itinerary(solver, state(tensions, 0.75, 0.75, HELD))
    assert told[0][1] == (1,)
    assert told[1][0] == then


def test_a_slider_at_its_threshold_stays_if_its_neighbours_balance(solver: str) -> None:
    chain = Chain(3, 1, "0.5", "0.75", tan_alpha="5/12")  # weights are 5/13, so that F_2 is 15/13
    start = state(("8/13", "18/13"), 0.75, 1.25, 0.75)  # F_1 = 1 = -F_3
    done = rearrange(chain, start, direction=0, solver=solver)
    assert done.itinerary[0] == ("start", (1, 3), (1, -1))
    assert done.itinerary[1] == ("stop", (1, 3), (1, -1))


def test_all_that_stop_draw_before_any_of_them_is_tested(solver: str) -> None:
    start = state(("1.8", "1.8"), 0.9, HELD, 0.9)  # to forces of 0.8, which 0.9 would hold
    told = itinerary(solver, start)
    kinds = [(kind, sliders) for kind, sliders, _ in told]
    assert kinds == [("start", (1, 3)), ("stop", (1, 3))] * 2
