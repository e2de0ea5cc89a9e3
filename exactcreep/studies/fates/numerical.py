"""The fate that float64 finds: a course is followed until its forces come back."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from exactcreep.limits import NO_LIMITS, Limits, Stop
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles
from exactcreep.model.numbers import InputError, nearest_float
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.model.state import State
from exactcreep.solvers.exact.recurrence import MOST_PERIOD, Recurrence
from exactcreep.studies.eventlog import rearrangements
from exactcreep.studies.fates.result import Fate, Period

_SAYING = 0.1  # seconds between two reports of progress


def refuse_sliding(chain: Chain) -> None:
    """Raise `InputError` for a chain that slides with theta without slips."""
    if chain.slides:
        allowed = (
            "must exceed mu_d: without slips the sliders follow theta, in every cycle alike;"
            ' creep(solver="sliding") tells how'
        )
        raise InputError("mu_s", chain.mu_s, allowed)


def numerical_fate(
    course: Recurrence,
    start: State,
    limits: Limits = NO_LIMITS,
    say: Callable[..., None] | None = None,
) -> tuple[Fate, Stop]:
    """Follow a course from `start` to its end; return its fate, and what ended it."""
    while True:
        pause = limits if say is None else replace(limits, pause=time.perf_counter() + _SAYING)
        stop, reason = course.follow(pause)
        if say is not None:
            say("cycles", course.cycles, course.drive.cycles, "cycles")
        if stop is not Stop.BUDGET:
            break
    simulation, drive = course.simulation, course.drive
    evidence, outcome = simulation.evidence, Outcome.LIMIT
    known: dict[str, Any] = {}
    if course.period is not None:
        moved, itinerary = _one_period(course, course.period)
        noise = nearest_float(simulation.chain.rounding) * sum(len(one) for _, one in itinerary)
        advance = moved if abs(moved) > noise else 0.0
        known = {"period": course.period, "advance": advance, "itinerary": itinerary}
        outcome = Outcome.CREEPING if advance else Outcome.CYCLING
        if not itinerary:
            outcome = Outcome.AT_REST
        if course.distance:
            evidence = Evidence.UNDECIDED
            reason = f"the forces return to within {course.distance:.1e} m g, not bit for bit"
    elif stop is Stop.RUNAWAY:
        outcome = Outcome.RUNAWAY
    elif not reason:
        reason = f"not settled with a period up to {MOST_PERIOD} within {drive.cycles} cycles"
    found = Fate(
        chain=simulation.chain,
        amplitude=drive.amplitude,
        start=start,
        solver="exact",
        outcome=outcome,
        evidence=evidence,
        cycles=course.cycles,
        settled_after=course.settled_after,
        last_advance=course.last_advance,
        reason=reason,
        report={"events": simulation.tally.events, "undecided": simulation.tally.undecided},
        **known,
    )
    return found, stop


def _one_period(course: Recurrence, period: int) -> tuple[float, Period]:
    """Return by how much x_G moves in the period that follows, and its rearrangements."""
    simulation = course.simulation.logged()
    before = simulation.state().displacements
    first = 2 * course.cycles + 1
    events = simulation.follow(Cycles(course.drive.amplitude, period), first, 2 * period).recorded
    moved = (simulation.state().displacements - before).mean()
    return float(moved), tuple(
        (one.half_cycle - first + 1, one.itinerary) for one in rearrangements(events)
    )
