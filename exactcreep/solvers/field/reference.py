"""The readable event solver in float64 ("reference") and in mpmath numbers ("mpmath").

What they do from event to event is `solvers.reference`; here it becomes a solver and a simulation.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterator, Mapping
from contextlib import suppress
from copy import copy
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, ClassVar

from exactcreep.limits import NO_LIMITS, Limits, OutOfTime, Stop
from exactcreep.model.contacts import Event
from exactcreep.model.drive import Drive
from exactcreep.model.numbers import InputError, exact_number, whole_number
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.model.state import State
from exactcreep.motion.arithmetic import BITS_PER_DIGIT, FLOAT64, Arithmetic, digits_of
from exactcreep.motion.cosine_field import sign_of
from exactcreep.motion.first_event import SearchLimit
from exactcreep.solvers.reference import ChainIntegrator
from exactcreep.solvers.rows import Avalanche
from exactcreep.solvers.solver import (
    Rearrangement,
    Simulation,
    Solver,
    Start,
    Stretch,
)
from exactcreep.solvers.tables import record_arrays, rows_of


class FieldSolver(Solver):
    """A solver that is `ChainIntegrator` in one arithmetic."""

    @abstractmethod
    def arithmetic(self) -> Arithmetic:
        """Return the arithmetic to begin with."""

    def rearrange_from(self, start: Start, direction: int, limits: Limits) -> Rearrangement:
        arithmetic = self.arithmetic()
        with arithmetic.active():
            mechanics = ChainIntegrator(start, arithmetic, residuals=True)
            return completed(mechanics, direction, self.name, limits)

    def events_from(self, start: Start, direction: int) -> Iterator[Event]:
        arithmetic = self.arithmetic()
        with arithmetic.active():
            mechanics = ChainIntegrator(start, arithmetic, residuals=True)
        return one_by_one(mechanics, direction)

    def simulation_from(self, start: Start, record: tuple[str, ...]) -> Simulation:
        return FieldSimulation(start, record, self.arithmetic())


def one_by_one(mechanics: ChainIntegrator, direction: int) -> Iterator[Event]:
    """Yield the events that follow a ramp in `direction`, the arithmetic active only meanwhile."""
    with mechanics.arithmetic.active():
        mechanics.ramp(direction, None)
    events = filter(None, mechanics.rearrangement())
    while True:
        with mechanics.arithmetic.active():
            event = next(events, None)
        if event is None:
            return
        yield event


def completed(
    mechanics: ChainIntegrator, direction: int, solver: str, limits: Limits
) -> Rearrangement:
    """Return the rearrangement that follows a ramp in `direction`."""
    mechanics.limits = limits
    mechanics.ramp(direction, None)
    initial = mechanics.state()
    events: list[Event] = []
    outcome, reason = Outcome.AT_REST, ""
    try:
        for event in mechanics.rearrangement():
            if event is not None:
                events.append(event)
            elif mechanics.flow is None or mechanics.runaway:
                continue
            elif (stop := limits.stop(len(events))) is not None:
                outcome, reason = Outcome.LIMIT, limits.reason(stop)
                break
    except (SearchLimit, OutOfTime) as limit:
        outcome, reason = Outcome.LIMIT, str(limit)
    if outcome is Outcome.LIMIT:
        mechanics.look_for_an_end()
    if mechanics.runaway:
        outcome, reason = Outcome.RUNAWAY, mechanics.proof
    tally = mechanics.tally
    return Rearrangement(
        chain=mechanics.chain,
        initial=initial,
        events=tuple(events),
        outcome=outcome,
        decided=Evidence.of(tally.undecided, Evidence.COMPUTED),
        state=mechanics.state(),
        velocities=mechanics.velocities(),
        undecided=tally.undecided,
        draws_below_mu_d=tally.draws_below_mu_d,
        solver=solver,
        seed=mechanics.seed,
        arithmetic=mechanics.arithmetic,
        report=mechanics_report(mechanics),
        reason=reason,
    )


def mechanics_report(mechanics: ChainIntegrator) -> dict[str, Any]:
    """Return precision and work counts."""
    report: dict[str, Any] = {
        "precision_bits": mechanics.arithmetic.bits,
        "root_evaluations": mechanics.evaluations,
    }
    if mechanics.runaway:
        report["runaway_time"] = mechanics.time
    return report


class FieldSimulation(Simulation):
    """A simulation by `ChainIntegrator`."""

    kind: ClassVar[type[ChainIntegrator]] = ChainIntegrator

    def __init__(self, start: Start, record: tuple[str, ...], arithmetic: Arithmetic) -> None:
        self.start = start
        self.record = record
        with arithmetic.active():
            self.mechanics = self.kind(start, arithmetic)
        self.tally = self.mechanics.tally
        self.avalanche: Avalanche | None = None
        self.undecided = 0  # up to the end of the last rearrangement
        self.theta_target: Fraction | None = None
        with suppress(InputError):
            self.theta_target = exact_number(start.state.theta, "theta")

    def follow(self, drive: Drive, first: int, count: int, limits: Limits = NO_LIMITS) -> Stretch:
        self.limits = limits
        self.begun = self.tally.events
        rows = self._rows()
        done, reason = 0, ""
        stop: Stop | None = None
        while stop is None:
            try:
                stop = self._to_target(drive, first + done, rows)
            except SearchLimit as limit:
                stop, reason = Stop.LIMIT, str(limit)
            if stop is None:
                done += 1
                stop = Stop.DONE if done == count else self._early()
        if stop is Stop.RUNAWAY:
            reason = self.mechanics.proof
        recorded = record_arrays(rows, self.start.chain.n)
        return Stretch(done, recorded, stop, reason or limits.reason(stop))

    def _early(self) -> Stop | None:
        """Return why `follow` has to come back; None: it need not."""
        return self.limits.stop(self.tally.events - self.begun)

    def _rows(self) -> dict[str, list[Any]]:
        """Return an empty list for everything that is recorded; see `record_arrays`."""
        return {name: [] for name in ("x_G", *self.record)}

    def _to_target(self, drive: Drive, q: int, rows: dict[str, list[Any]]) -> Stop | None:
        """Take the chain to target q, and return why it was not reached; None: it was."""
        mechanics = self.mechanics
        mechanics.limits = self.limits
        with mechanics.arithmetic.active():
            target = drive.exact_target(q, self.start.seed)
            while True:
                try:
                    for event in mechanics.rearrangement():
                        if event is not None:
                            self._log(event, q, rows)
                        if mechanics.flow is None:
                            self._log_rest(rows)
                        if event is None and (stop := self._early()) is not None:
                            return stop
                except OutOfTime:
                    return Stop.DEADLINE
                if mechanics.runaway:
                    return Stop.RUNAWAY
                if not mechanics.ramp(self._way(target), target):
                    break
            self._arrive(target, rows)
        return None

    def _way(self, target: Fraction) -> int:
        """Return the direction of the ramp; once under way it does not change."""
        mechanics = self.mechanics
        if self.theta_target is not None:
            mechanics.way = sign_of(target - self.theta_target)
            self.theta_target = None
        elif mechanics.way == 0:
            ahead = mechanics.arithmetic.number(target) - mechanics.known_theta()
            mechanics.way = mechanics.arithmetic.sign(ahead)
        return mechanics.way

    def _arrive(self, target: Fraction, rows: dict[str, list[Any]]) -> None:
        mechanics = self.mechanics
        mechanics.way = 0
        self.theta_target = target
        state = mechanics.state()
        reached = {
            "x_G": sum(state.displacements.tolist()) / self.start.chain.n,
            "x": state.displacements,
            "tension": state.tensions,
            "slips": mechanics.slips,
        }
        for name, value in reached.items():
            if name in rows:
                rows[name].append(copy(value))
        mechanics.slips[:] = 0

    def _log(self, event: Event, q: int, rows: dict[str, list[Any]]) -> None:
        if rows.keys().isdisjoint(("events", "rearrangements", "slip_table")):
            return
        mechanics, arithmetic = self.mechanics, self.mechanics.arithmetic
        number, theta = mechanics.tally.rearrangements - 1, mechanics.known_theta()
        if "events" in rows:
            rows["events"] += rows_of(event, q, number, mechanics.event_number - 1, theta)
        if "rearrangements" not in rows and "slip_table" not in rows:
            return
        if mechanics.event_number == 1:
            way = mechanics.way if mechanics.crossed else 0
            tensions, still = mechanics.state().tensions, arithmetic.zeros(self.start.chain.n)
            self.avalanche = Avalanche(number, q, theta, way, tensions, still, self.undecided)
        assert self.avalanche is not None
        coefficient = mechanics.coefficients.__getitem__
        slips = self.avalanche.take(event, mechanics.known_moves(), coefficient, arithmetic)
        rows.get("slip_table", []).extend(slips)

    def _log_rest(self, rows: dict[str, list[Any]]) -> None:
        mechanics, undecided = self.mechanics, self.mechanics.tally.undecided
        if self.avalanche is not None and "rearrangements" in rows:
            row = self.avalanche.row(mechanics.chain, mechanics.arithmetic, undecided)
            rows["rearrangements"].append(row)
        self.avalanche, self.undecided = None, undecided

    def state(self) -> State:
        with self.mechanics.arithmetic.active():
            return self.mechanics.state()

    def capture(self) -> dict[str, Any]:
        arithmetic, avalanche = self.mechanics.arithmetic, self.avalanche
        with arithmetic.active():
            return {
                "bits": arithmetic.bits,
                "theta_target": self.theta_target,
                "mechanics": self.mechanics.captured(),
                "avalanche": avalanche and avalanche.captured(arithmetic.plain),
                "undecided": self.undecided,
            }

    def restore(self, captured: Mapping[str, Any]) -> None:
        self.theta_target = captured["theta_target"]
        known, number = captured["avalanche"], self.mechanics.arithmetic.from_plain
        with self.mechanics.arithmetic.active():
            self.mechanics.take_over(captured["mechanics"])
            self.avalanche = known and Avalanche.restored(known, number)
        self.undecided = int(captured["undecided"])
        self.tally = self.mechanics.tally

    def report(self) -> dict[str, Any]:
        return mechanics_report(self.mechanics)


@dataclass(frozen=True)
class Reference(FieldSolver):
    """The readable solver in float64."""

    name: ClassVar[str] = "reference"
    summary: ClassVar[str] = "readable event solver, float64, with rounding bounds"

    def arithmetic(self) -> Arithmetic:
        return FLOAT64


@dataclass(frozen=True)
class Mpmath(FieldSolver):
    """The readable solver in mpmath numbers of `digits` significant digits.

    Parameters
    ----------
    digits : int
        At least 1; 15 more are carried along.
    """

    digits: int = 30
    name: ClassVar[str] = "mpmath"
    summary: ClassVar[str] = "readable event solver, mpmath at any number of digits"

    def __post_init__(self) -> None:
        digits = whole_number(self.digits, "digits", least=1, most=100_000)
        object.__setattr__(self, "digits", digits)

    def arithmetic(self) -> Arithmetic:
        """Return mpmath with 15 digits more than asked for."""
        return digits_of(math.ceil((self.digits + 15) * BITS_PER_DIGIT))
