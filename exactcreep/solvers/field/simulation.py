"""A simulation by `solvers.field.integrator`, and a rearrangement."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from copy import copy
from dataclasses import replace
from fractions import Fraction
from functools import partial
from typing import Any, ClassVar

import numpy as np

from exactcreep.model.contacts import Event
from exactcreep.model.drive import Drive
from exactcreep.model.numbers import InputError, exact_number
from exactcreep.model.state import State
from exactcreep.motion.arithmetic import Balls, Disturbance, certain_sign
from exactcreep.motion.cosine_field import sign_of
from exactcreep.motion.first_event import SearchLimit
from exactcreep.motion.runaway import NEVER_STOPS
from exactcreep.solvers.avalanche_table import AvalancheLog
from exactcreep.solvers.field.integrator import ChainIntegrator
from exactcreep.solvers.interface import (
    Ending,
    Rearrangement,
    Simulation,
    Start,
    Stretch,
    Tally,
)
from exactcreep.solvers.tables import LOGS, record_arrays, rows_of
from exactcreep.watch.limits import NO_LIMITS, Limits, OutOfTime, Stop


def completed(
    mechanics: ChainIntegrator, direction: int, solver: str, limits: Limits
) -> Rearrangement:
    """Return the rearrangement that follows a ramp in `direction`."""
    mechanics.limits = limits
    mechanics.steadily(partial(mechanics.ramp, direction, None))
    initial = mechanics.state()
    events: list[Event] = []
    ended = Ending(Stop.DONE)
    try:
        for event in mechanics.rearrangement():
            if event is not None:
                events.append(event)
            elif mechanics.flow is None or mechanics.runaway:
                continue
            elif (stop := limits.stop(len(events))) is not None:
                ended = Ending(stop, limits.reason(stop))
                break
    except (SearchLimit, OutOfTime, Disturbance) as limit:
        ended = Ending(Stop.LIMIT, str(limit))
    if mechanics.runaway:
        ended = Ending(Stop.RUNAWAY, NEVER_STOPS)
    return Rearrangement.of(
        mechanics,
        solver,
        ended,
        initial=initial,
        events=tuple(events),
        arithmetic=mechanics.arithmetic,
        report=mechanics_report(mechanics),
    )


def mechanics_report(mechanics: ChainIntegrator) -> dict[str, Any]:
    """Return precision and work counts."""
    report: dict[str, Any] = {
        "precision_bits": mechanics.arithmetic.bits,
        "root_evaluations": mechanics.rest.evaluations,
    }
    if mechanics.runaway:
        report["runaway_time"] = mechanics.time
    return report


class FieldSimulation(Simulation):
    """A simulation by `ChainIntegrator`.

    Rows of events are delivered when a target is reached, because an arithmetic with an undecided
    comparison begins again with more digits.
    """

    kind: ClassVar[type[ChainIntegrator]] = ChainIntegrator

    def __init__(self, start: Start, record: tuple[str, ...], arithmetic: Balls) -> None:
        self.start = start
        self.begin: Any = start.state.theta  # exactly, where springs have their own dilations
        self.record = record
        with arithmetic.active():
            self.mechanics = self.kind(start, arithmetic)
        self.tally = self.mechanics.tally
        self._begin_log()
        self.undecided = 0  # up to the end of the last rearrangement
        self.theta_target: Fraction | None = None
        with suppress(InputError):
            given = 0 if self.mechanics.rest.leg else start.state.theta
            self.theta_target = exact_number(given, "theta")

    def follow(self, drive: Drive, first: int, count: int, limits: Limits = NO_LIMITS) -> Stretch:
        before = self.tally.events
        rows, doubts = self._rows(), []

        def early() -> Stop | None:
            return limits.stop(self.tally.events - before)

        ended, done = Ending(Stop.DONE), 0
        while done < count:
            try:
                stop = self._to_target(drive, first + done, limits, early)
            except (SearchLimit, Disturbance) as limit:
                ended = Ending(Stop.LIMIT, str(limit))
                break
            if stop is None:
                done += 1
                doubts.append(self.tally.undecided)
                for name, values in self._made().items():
                    rows[name] += values
                self._forget_rows()
                stop = early() if done < count else None
            if stop is not None:
                runaway = stop is Stop.RUNAWAY
                ended = Ending(stop, NEVER_STOPS if runaway else limits.reason(stop))
                break
        n = self.start.chain.n
        logged = {name: values for name, values in self._made().items() if name in LOGS and values}
        return Stretch(
            done, record_arrays(rows, n), *ended, record_arrays(logged, n),
            np.array(doubts, dtype=np.int64),
        )  # fmt: skip

    def _rows(self) -> dict[str, list[Any]]:
        """Return an empty list for every recorded quantity; see `record_arrays`."""
        return {name: [] for name in ("x_G", *self.record)}

    def _begin_log(self) -> None:
        self.log = AvalancheLog(self.start.chain, self.record, self.mechanics.arithmetic)
        self.under_way = self._rows()

    def _forget_rows(self) -> None:
        """Begin the rows on the way to the next target."""
        self.under_way = self._rows()
        self.log.forget()

    def _made(self) -> dict[str, list[Any]]:
        """Return the rows on the way to the next target, with one ledger of all its avalanches."""
        with self.mechanics.arithmetic.active():
            return self.under_way | self.log.tables()

    def _to_target(
        self, drive: Drive, q: int, limits: Limits, early: Callable[[], Stop | None]
    ) -> Stop | None:
        """Take the chain to target q; return why it was not reached, or None."""
        mechanics = self.mechanics
        mechanics.limits = limits
        with mechanics.arithmetic.active():
            target = self._target(drive, q)
            while True:
                try:
                    for event in mechanics.rearrangement():
                        if event is not None:
                            self._log(event, q)
                        if mechanics.flow is None:
                            self._log_rest()
                        if event is None and (stop := early()) is not None:
                            return stop
                except OutOfTime:
                    return Stop.DEADLINE
                if mechanics.runaway:
                    return Stop.RUNAWAY
                ramp = partial(
                    mechanics.ramp, mechanics.steadily(partial(self._way, target)), target
                )
                if not mechanics.steadily(ramp):
                    break
            self._arrive(target)
        return None

    def _target(self, drive: Drive, q: int) -> Fraction:
        """Return theta at target q; on a leg it goes from 0 to 1."""
        leg = drive.leg(q, self.begin)
        if leg is None:
            return drive.exact_target(q, self.start.seed)
        if self.theta_target is not None:  # the leg begins here
            self.mechanics.turn(leg)
            self.theta_target = Fraction(0)
        return Fraction(1)

    def _way(self, target: Fraction) -> int:
        """Return the direction of the ramp, which does not change on the way."""
        mechanics = self.mechanics
        if self.theta_target is not None:
            mechanics.way = sign_of(target - self.theta_target)
            self.theta_target = None
        elif mechanics.way == 0:
            ahead = mechanics.arithmetic.number(target) - mechanics.known_theta()
            mechanics.way = certain_sign(ahead)
        return mechanics.way

    def _arrive(self, target: Fraction) -> None:
        mechanics = self.mechanics
        mechanics.way = 0
        self.theta_target = target
        state = mechanics.state()
        reached = {
            "x_G": sum(state.displacements.tolist()) / self.start.chain.n,
            "x": state.displacements,
            "tension": state.tensions,
            "slips": mechanics.rest.slips,
        }
        for name, value in reached.items():
            if name in self.under_way:
                self.under_way[name].append(copy(value))
        mechanics.rest.slips[:] = 0

    def _log(self, event: Event, q: int) -> None:
        rows = self.under_way
        if rows.keys().isdisjoint(LOGS):
            return
        mechanics = self.mechanics
        number, theta = mechanics.tally.rearrangements - 1, mechanics.known_theta()
        logged = rows_of(event, q, number, mechanics.event_number - 1, theta)
        rows.get("events", []).extend(logged)
        if self.log.wanted:
            moved, drawn = mechanics.known_moves(), mechanics.rest.coefficients
            way = mechanics.way if mechanics.ramped else 0
            for row, k in ((row, row.slider - 1) for row in logged):
                self.log.take(row, lambda: mechanics.state().tensions, moved[k], drawn[k], way)

    def _log_rest(self) -> None:
        before, self.undecided = self.undecided, self.mechanics.tally.undecided
        self.log.rest(self.undecided - before)

    def state(self) -> State:
        with self.mechanics.arithmetic.active():
            return self.mechanics.state()

    @property
    def at_rest(self) -> bool:
        """Whether the chain is at a target."""
        return self.mechanics.flow is None and self.theta_target is not None

    def unrounded(self) -> dict[str, Any]:
        rest = replace(self.mechanics.rest.copy(), tally=Tally(), evaluations=0)
        bits = self.mechanics.arithmetic.bits
        return {"rest": rest, "theta_target": self.theta_target, "bits": bits}

    def snapshot(self) -> dict[str, Any]:
        return {
            "theta_target": self.theta_target,
            "rest": self.mechanics.rest.copy(),
            "undecided": self.undecided,
        }

    def restore(self, snapshot: Mapping[str, Any]) -> None:
        with self.mechanics.arithmetic.active():
            self.mechanics.go_on_from(snapshot["rest"].copy())
        self.theta_target, self.undecided = snapshot["theta_target"], snapshot["undecided"]
        self.tally = self.mechanics.tally

    def report(self) -> dict[str, Any]:
        return mechanics_report(self.mechanics)
