"""A simulation by `solvers.field.set_integrator`, and a rearrangement."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from copy import copy
from dataclasses import replace
from fractions import Fraction
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from exactcreep.model.contacts import Event
from exactcreep.model.drive import Drive
from exactcreep.model.numbers import InputError, exact_number
from exactcreep.model.outcome import Evidence
from exactcreep.model.state import State
from exactcreep.motion.arithmetic import Disturbance, Undecided, balls_of, certain_sign, objects
from exactcreep.motion.cosine_field import sign_of
from exactcreep.motion.first_event import SearchLimit
from exactcreep.motion.runaway import NEVER_STOPS
from exactcreep.solvers.avalanche_table import AvalancheLog
from exactcreep.solvers.field.integrator import ChainIntegrator
from exactcreep.solvers.field.set_integrator import SetIntegrator
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

if TYPE_CHECKING:
    from exactcreep.solvers.field.certified import Certified


_KEPT = ("theta_target", "undecided", "anchor", "anchor_target", "settles", "restarts")
"""Attributes of a simulation that a snapshot holds, beside the chain at rest."""


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


def require_digits(mechanics: ChainIntegrator, digits: int) -> None:
    """Raise `Undecided` if a displacement is known to fewer digits."""
    allowed = mechanics.arithmetic.number(10) ** -digits
    for x in mechanics.state().displacements.tolist():
        if not x.rad() <= allowed * (1 + abs(x)):
            raise Undecided(f"fewer than {digits} digits are left")


def certificate(mechanics: ChainIntegrator) -> dict[str, Any]:
    """Return the radius and the digits of a calculation in balls, and whether it is exact."""
    places = mechanics.state().displacements.tolist()
    radii = [0.0 if x.is_exact() else math.nextafter(float(x.rad()), math.inf) for x in places]
    relative = max(r / (1 + abs(float(x.mid()))) for r, x in zip(radii, places, strict=True))
    return {
        "largest_radius": max(radii),
        "digits_left": math.floor(-math.log10(relative)) if relative > 0 else None,
        "exact_in_q_c": mechanics.rest.exact,
    }


class CertifiedSimulation(Simulation):
    """A simulation in balls, which goes back to its anchor when a comparison is undecided.

    Rows of events are delivered when a target is reached, because they may come again.
    """

    kind: ClassVar[type[SetIntegrator]] = SetIntegrator
    leap: ClassVar[int] = 2
    """Factor by which the precision grows."""

    def __init__(self, start: Start, record: tuple[str, ...], solver: Certified) -> None:
        self.start, self.record, self.solver = start, record, solver
        self.begin: Any = start.state.theta  # exactly, where springs have their own dilations
        self.restarts = 0
        self.settles = False  # at the precision limit
        self.ahead: int | None = None  # the next target of the chain; None: any
        self.reached: tuple[int, State, Tally] | None = None  # the last target, state and counts
        kept = start.unrounded
        self._begin(kept["bits"] if kept else solver.arithmetic().bits)
        self.theta_target: Fraction | None = None
        with suppress(InputError):
            given = 0 if self.mechanics.rest.leg else start.state.theta
            self.theta_target = exact_number(given, "theta")
        if kept is not None:
            self._go_on_from(kept["rest"].copy())
            self.theta_target = kept["theta_target"]
            if (leg := kept["rest"].leg) is not None:
                self.begin = objects(leg.end)
        self._drop_anchor(None)

    def _begin(self, bits: int) -> None:
        arithmetic = balls_of(bits)
        with arithmetic.active():
            self.mechanics = self.kind(self.start, arithmetic, assume=self.settles)
        self.tally = self.mechanics.tally
        self.log = AvalancheLog(self.start.chain, self.record, arithmetic)
        self._forget_rows()
        self.way = 0  # of the present ramp
        self.undecided = 0  # comparisons up to the end of the last rearrangement

    def _go_on_from(self, rest: Any) -> None:
        with self.mechanics.arithmetic.active():
            self.mechanics.go_on_from(rest)
        self.tally, self.undecided = self.mechanics.tally, self.mechanics.tally.undecided

    def _drop_anchor(self, target: int | None) -> None:
        """Make the present state, which is known exactly, the state to go back to."""
        self.anchor = self.mechanics.rest.copy()
        self.anchor_target: list[Any] = [target, self.theta_target]

    def _go_back(self) -> None:
        """Start again from the anchor with more bits."""
        self.restarts += 1
        bits, most = self.mechanics.arithmetic.bits, self.solver.most_bits
        self.settles = bits >= most
        self._begin(min(self.leap * bits, most))
        self._go_on_from(self.anchor.copy())
        target, self.theta_target = self.anchor_target
        self.ahead = target + 1

    @property
    def behind(self) -> bool:
        """Whether the last target has to be reached again."""
        return self.reached is not None and self.ahead is not None and self.ahead <= self.reached[0]

    def follow(self, drive: Drive, first: int, count: int, limits: Limits = NO_LIMITS) -> Stretch:
        self.tally = self.mechanics.tally
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
        if self.behind and self.reached is not None:
            self.tally = self.reached[2]
        n = self.start.chain.n
        logged = {name: values for name, values in self._made().items() if name in LOGS and values}
        return Stretch(
            done, record_arrays(rows, n), *ended, record_arrays(logged, n),
            np.array(doubts, dtype=np.int64),
        )  # fmt: skip

    def _rows(self) -> dict[str, list[Any]]:
        """Return an empty list for every recorded quantity; see `record_arrays`."""
        return {name: [] for name in ("x_G", *self.record)}

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
        if self.ahead is None:
            self.ahead = q
        if self.anchor_target[0] is None:
            self.anchor_target[0] = q - 1
        while self.ahead <= q:
            try:
                stop = self._towards(drive, self.ahead, limits, early)
            except Undecided:
                self._go_back()
                continue
            if self.ahead < q:
                self._forget_rows()
            if stop is not None:
                return stop
            self.ahead += 1
        with self.mechanics.arithmetic.active():
            self.reached = q, self.mechanics.state(), replace(self.tally)
        if self.mechanics.rest.exact:
            self._drop_anchor(q)
        return None

    def _towards(
        self, drive: Drive, q: int, limits: Limits, early: Callable[[], Stop | None]
    ) -> Stop | None:
        """Take the chain to target q at this precision."""
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
            self.way = sign_of(target - self.theta_target)
            self.theta_target = None
        elif self.way == 0:
            ahead = mechanics.arithmetic.number(target) - mechanics.known_theta()
            self.way = certain_sign(ahead)
        return self.way

    def _arrive(self, target: Fraction) -> None:
        mechanics = self.mechanics
        if not self.settles:
            mechanics.steadily(partial(require_digits, mechanics, self.solver.digits))
        self.way = 0
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
            way = self.way if mechanics.ramped else 0
            for row, k in ((row, row.slider - 1) for row in logged):
                self.log.take(row, lambda: mechanics.state().tensions, moved[k], drawn[k], way)

    def _log_rest(self) -> None:
        before, self.undecided = self.undecided, self.mechanics.tally.undecided
        self.log.rest(lambda: self.mechanics.state().tensions, self.undecided - before)

    def state(self) -> State:
        """Return the present state, or the last target's if that has to be reached again."""
        if self.behind and self.reached is not None:
            return self.reached[1]
        with self.mechanics.arithmetic.active():
            return self.mechanics.state()

    @property
    def evidence(self) -> Evidence:
        """Proved, unless a tie had to be assumed at the precision limit."""
        return Evidence.of(self.tally.undecided, Evidence.PROVED)

    @property
    def at_rest(self) -> bool:
        """Whether the chain is at a target."""
        return not self.behind and self.mechanics.flow is None and self.theta_target is not None

    def unrounded(self) -> dict[str, Any]:
        rest = replace(self.mechanics.rest.copy(), tally=Tally(), evaluations=0)
        bits = self.mechanics.arithmetic.bits
        return {"rest": rest, "theta_target": self.theta_target, "bits": bits}

    def snapshot(self) -> dict[str, Any]:
        kept = {name: getattr(self, name) for name in _KEPT}
        return kept | {"rest": self.mechanics.rest.copy(), "bits": self.mechanics.arithmetic.bits}

    def restore(self, snapshot: Mapping[str, Any]) -> None:
        self.settles = snapshot["settles"]
        self._begin(snapshot["bits"])
        self._go_on_from(snapshot["rest"].copy())
        vars(self).update({name: snapshot[name] for name in _KEPT})

    def report(self) -> dict[str, Any]:
        """Return precision, enclosure radius, digits left and work counts."""
        with self.mechanics.arithmetic.active():
            certified = certificate(self.mechanics)
        return mechanics_report(self.mechanics) | certified | {"restarts": self.restarts}
