"""The readable event solver in float64 ("reference") and in mpmath numbers ("mpmath").

What they do from event to event is `solvers.reference`; here it becomes a solver and a simulation.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Mapping
from contextlib import suppress
from copy import copy
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, ClassVar

import numpy as np

from exactcreep.limits import NO_LIMITS, Limits, OutOfTime, Stop
from exactcreep.model.contacts import Event
from exactcreep.model.drive import Drive
from exactcreep.model.enclosure import enclosure, is_finite
from exactcreep.model.numbers import InputError, exact_number, whole_number
from exactcreep.model.state import State
from exactcreep.motion.arithmetic import BITS_PER_DIGIT, FLOAT64, Arithmetic, digits_of
from exactcreep.motion.cosine_field import Quadratic, sign_of
from exactcreep.motion.first_event import SearchLimit
from exactcreep.motion.state_set import StateSet
from exactcreep.solvers.avalanche_table import Avalanche
from exactcreep.solvers.field.at_rest import ExactState
from exactcreep.solvers.reference import ChainIntegrator
from exactcreep.solvers.solver import (
    Ending,
    Rearrangement,
    Simulation,
    Solver,
    Start,
    Stretch,
    Tally,
    require,
    require_like,
)
from exactcreep.solvers.tables import LOGS, record_arrays, rows_of


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

    def simulation_from(self, start: Start, record: tuple[str, ...]) -> Simulation:
        return FieldSimulation(start, record, self.arithmetic())


def completed(
    mechanics: ChainIntegrator, direction: int, solver: str, limits: Limits
) -> Rearrangement:
    """Return the rearrangement that follows a ramp in `direction`."""
    mechanics.limits = limits
    mechanics.ramp(direction, None)
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
    except (SearchLimit, OutOfTime) as limit:
        ended = Ending(Stop.LIMIT, str(limit))
    if ended.stop is not Stop.DONE:
        mechanics.look_for_an_end()
    if mechanics.runaway:
        ended = Ending(Stop.RUNAWAY, mechanics.proof)
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
        "root_evaluations": mechanics.evaluations,
    }
    if mechanics.runaway:
        report["runaway_time"] = mechanics.time
    return report


class FieldSimulation(Simulation):
    """A simulation by `ChainIntegrator`.

    Rows of events on the way to a target are handed over once it is reached: an arithmetic that
    does not decide a comparison begins again with more digits.
    """

    kind: ClassVar[type[ChainIntegrator]] = ChainIntegrator

    def __init__(self, start: Start, record: tuple[str, ...], arithmetic: Arithmetic) -> None:
        self.start = start
        self.record = record
        with arithmetic.active():
            self.mechanics = self.kind(start, arithmetic)
        self.tally = self.mechanics.tally
        self.begun = self._rows()  # rows on the way to the next target
        self.avalanche: Avalanche | None = None
        self.undecided = 0  # up to the end of the last rearrangement
        self.theta_target: Fraction | None = None
        with suppress(InputError):
            self.theta_target = exact_number(start.state.theta, "theta")

    def follow(self, drive: Drive, first: int, count: int, limits: Limits = NO_LIMITS) -> Stretch:
        before = self.tally.events
        rows, doubts = self._rows(), []

        def early() -> Stop | None:
            return limits.stop(self.tally.events - before)

        ended, done = Ending(Stop.DONE), 0
        while done < count:
            try:
                stop = self._to_target(drive, first + done, limits, early)
            except SearchLimit as limit:
                ended = Ending(Stop.LIMIT, str(limit))
                break
            if stop is None:
                done += 1
                doubts.append(self.tally.undecided)
                for name, values in self.begun.items():
                    rows[name] += values
                self.begun = self._rows()
                stop = early() if done < count else None
            if stop is not None:
                proof = self.mechanics.proof if stop is Stop.RUNAWAY else ""
                ended = Ending(stop, proof or limits.reason(stop))
                break
        n = self.start.chain.n
        logged = {name: values for name, values in self.begun.items() if name in LOGS and values}
        return Stretch(
            done, record_arrays(rows, n), *ended, record_arrays(logged, n),
            np.array(doubts, dtype=np.int64),
        )  # fmt: skip

    def _rows(self) -> dict[str, list[Any]]:
        """Return an empty list for everything that is recorded; see `record_arrays`."""
        return {name: [] for name in ("x_G", *self.record)}

    def _to_target(
        self, drive: Drive, q: int, limits: Limits, early: Callable[[], Stop | None]
    ) -> Stop | None:
        """Take the chain to target q, and return why it was not reached; None: it was."""
        mechanics = self.mechanics
        mechanics.limits = limits
        with mechanics.arithmetic.active():
            target = drive.exact_target(q, self.start.seed)
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
                if not mechanics.ramp(self._way(target), target):
                    break
            self._arrive(target)
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

    def _arrive(self, target: Fraction) -> None:
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
            if name in self.begun:
                self.begun[name].append(copy(value))
        mechanics.slips[:] = 0

    def _log(self, event: Event, q: int) -> None:
        rows = self.begun
        if rows.keys().isdisjoint(LOGS):
            return
        mechanics, arithmetic = self.mechanics, self.mechanics.arithmetic
        number, theta = mechanics.tally.rearrangements - 1, mechanics.known_theta()
        if "events" in rows:
            rows["events"] += rows_of(event, q, number, mechanics.event_number - 1, theta)
        if "rearrangements" not in rows and "slip_table" not in rows:
            return
        if mechanics.event_number == 1:
            way = mechanics.way if mechanics.crossed else 0
            known = {"half_cycle": q, "theta": theta, "direction": way}
            self.avalanche = Avalanche(
                mechanics.chain, arithmetic, known, mechanics.state().tensions
            )
        assert self.avalanche is not None
        coefficient = mechanics.coefficients.__getitem__
        slips = self.avalanche.take(event, number, mechanics.known_moves(), coefficient)
        rows.get("slip_table", []).extend(slips)

    def _log_rest(self) -> None:
        before, self.undecided = self.undecided, self.mechanics.tally.undecided
        if self.avalanche is not None and "rearrangements" in self.begun:
            self.begun["rearrangements"].append(self.avalanche.row(self.undecided - before))
        self.avalanche = None

    def state(self) -> State:
        with self.mechanics.arithmetic.active():
            return self.mechanics.state()

    @property
    def at_rest(self) -> bool:
        """Whether it stands at a target."""
        return self.mechanics.flow is None and self.theta_target is not None

    def snapshot(self) -> dict[str, Any]:
        with self.mechanics.arithmetic.active():
            return {
                "bits": self.mechanics.arithmetic.bits,
                "theta_target": self.theta_target,
                "mechanics": plain(self.mechanics.captured()),
                "undecided": self.undecided,
            }

    def restore(self, snapshot: Mapping[str, Any]) -> None:
        require(self.snapshot().keys() == snapshot.keys(), "the snapshot lacks a name")
        arithmetic = self.mechanics.arithmetic
        require(snapshot["bits"] == arithmetic.bits, "it is of another precision")
        require(isinstance(snapshot["theta_target"], Fraction), "it does not stand at a target")
        require(type(snapshot["undecided"]) is int, "a count is not")
        with arithmetic.active():
            self.mechanics.take_over(captured_of(self.mechanics, snapshot["mechanics"]))
        self.theta_target, self.undecided = snapshot["theta_target"], snapshot["undecided"]
        self.tally = self.mechanics.tally

    def report(self) -> dict[str, Any]:
        return mechanics_report(self.mechanics)


def plain(value: Any) -> Any:
    """Return what was captured as a file holds it: rationals and enclosures, lists and mappings."""
    if isinstance(value, (ExactState, StateSet, Tally)):
        value = vars(value)
    if isinstance(value, Mapping):
        return {str(name): plain(part) for name, part in value.items()}
    if isinstance(value, Quadratic):
        return list(value.rationals())
    if isinstance(value, list) or (isinstance(value, np.ndarray) and value.dtype == object):
        return [plain(part) for part in value]
    if value is None or isinstance(value, (bool, int, float, Fraction, np.ndarray)):
        return value
    return enclosure(value)


def captured_of(mechanics: ChainIntegrator, given: Any) -> dict[str, Any]:
    """Return what `plain` was made of, for a chain that has not moved.

    Raises
    ------
    ValueError
        If names, types or shapes are not those of such a chain.
    """
    like = mechanics.captured()
    require(isinstance(given, Mapping) and like.keys() == given.keys(), "a name is missing")
    try:
        return {name: _taken(mechanics, name, like[name], given[name]) for name in like}
    except (TypeError, AttributeError, LookupError, ArithmeticError) as wrong:
        raise ValueError(f"it is of another kind: {wrong}") from wrong


def _taken(mechanics: ChainIntegrator, name: str, like: Any, given: Any) -> Any:
    """Return one part of what was captured."""
    arithmetic, n = mechanics.arithmetic, mechanics.chain.n
    if name == "tally":
        require_like(vars(like), given, name)
        return Tally(**given)
    if given is None and name in ("exact", "set"):
        return None
    if name == "pinned":
        require(all(type(x) is Fraction for x in given.values()), "a number is not exact")
        return {range(n)[int(slider)]: x for slider, x in given.items()}
    if name == "exact":
        rows = [*given["forces"], *given["displacements"], given["theta"]]
        require(all([*map(type, row)] == [Fraction] * 2 for row in rows), "a number is not exact")
        require(len(given["forces"]) == len(given["displacements"]) == n, "a number is missing")
        exact = [mechanics.field.number(*row) for row in rows]
        return ExactState(exact[:n], exact[n:-1], exact[-1])
    if name == "set":
        fresh = StateSet.spanned(np.zeros((n + 1, len(given["theta"]))))
        require_like(vars(fresh) | {"exponent": None}, given, name)
        fits = type(given["exponent"]) is int and abs(given["exponent"]) < _MOST_EXPONENT
        require(fits, "a number is without measure")
        return StateSet.restored(given)
    if isinstance(like, np.ndarray) and like.dtype == object:
        require(len(given) == len(like) and all(map(is_finite, given)), f"{name} has other numbers")
        return arithmetic.vector([arithmetic.number(x) for x in given])
    if name in ("theta", "force_slack", "theta_slack"):
        require(is_finite(given), f"{name} is not finite")
        return given if type(given) is int else arithmetic.number(given)
    require_like(like, given, name)
    require(name != "draws" or bool((given >= 1).all()), "draws are not")
    return given


_MOST_EXPONENT = 2**20
"""Of a number in a snapshot: far beyond what a chain can come to."""


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
