"""The solver called "exact": float64, compiled, from event to event; see `loop` for its loop."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from exactcreep.limits import NO_LIMITS, Limits, Stop
from exactcreep.model.chain import Chain
from exactcreep.model.contacts import Contacts, Event
from exactcreep.model.drive import Cycles, Drive, Path
from exactcreep.model.numbers import InputError, nearest_float
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.model.state import State
from exactcreep.motion.arithmetic import FLOAT64
from exactcreep.motion.runaway import NEVER_RESTS, NEVER_STOPS, never_rests
from exactcreep.solvers import tables
from exactcreep.solvers.exact import layout, local_clocks, loop
from exactcreep.solvers.exact.layout import PAD
from exactcreep.solvers.exact.perturbed import RoundingError, rounding_error
from exactcreep.solvers.exact.rest import Origin, Workspace, dilation, placed, rational, roomier
from exactcreep.solvers.exact.two_floats import split, split_ratio, two_product
from exactcreep.solvers.field.certified import Certified
from exactcreep.solvers.solver import Rearrangement, Simulation, Solver, Start, Stretch, Tally
from exactcreep.solvers.warm_up import compiled

_MOST_WORK = 2**22  # of one call of the compiled loop: some hundredths of a second
_NUDGE = 2.0**-50  # of a twin: four roundings, as rounding goes on along the run
_GOES_ON = (layout.BUDGET, layout.LOG_FULL)
_USED: dict[int, list[Workspace]] = {}
"""By lengths of short chains: arrays of rearrangements that are over, as many as ran at once."""
_LOGS = {
    "events": layout.LOGS_EVENTS,
    "rearrangements": layout.LOGS_REARRANGEMENTS,
    "slip_table": layout.LOGS_SLIPS,
}
_ENDLESS = (
    f"an avalanche has neither ended nor been proved to run away after {layout.LONGEST_AVALANCHE}"
    " events; at tan_alpha = mu_d it may go round for ever"
)


class ExactSimulation(Simulation):
    """A chain on its way along a drive, event by event; see `Exact`."""

    def __init__(
        self,
        chain: Chain,
        state: State,
        seed: int,
        record: tuple[str, ...] = ("x_G",),
        used: Workspace | None = None,
    ) -> None:
        self.chain = chain
        self.record = record
        self.origin = Origin.of(chain, state)
        self._pace = 2**14  # work of one call of the compiled loop
        self.work = placed(chain, self.origin, seed, _logging(record), used)

    @property
    def _present(self) -> Workspace:
        """The arrays with all sliders at the present time."""
        work = self.work
        if work.clock is None or not work.now["local"][0]:
            return work
        present = work._replace(cell=work.cell.copy(), now=work.now.copy())
        local_clocks.at_once(present.cell, work.clock.copy(), present.now[0])
        return present

    def cell(self, row: int) -> NDArray[np.float64]:
        """Return a row of `layout`'s cells at the present time, shape (n,)."""
        return self._present.cell[row, PAD : PAD + self.chain.n]

    @property
    def tally(self) -> Tally:  # type: ignore[override]
        """Counts since the start."""
        now = self.work.now
        return Tally(
            rearrangements=now["rearrangements"].item(),
            events=now["events"].item(),
            slips=now["slips"].item(),
            draws_below_mu_d=now["below"].item(),
            undecided=now["undecided"].item(),
            long_rearrangements=now["long"].item(),
        )

    @property
    def seed(self) -> int:
        """The seed of its random numbers."""
        return int(self.work.now["seed"].view(np.uint64)[0])

    @property
    def events(self) -> int:
        """The events since the start."""
        return int(self.work.now["events"].item())

    def targets(
        self, drive: Drive, first: int, count: int, seed: int = 0
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return ``l0 theta`` of the targets as two arrays of floats."""
        if isinstance(drive, Cycles):
            high, low = split(self.chain.l0 * drive.amplitude)
            way = np.where(np.arange(first, first + count) % 2 == 1, 1.0, -1.0)
            return way * high, way * low
        if isinstance(drive, Path):  # the bits of Cycles with the same targets
            top, bottom = self.chain.l0.as_integer_ratio()
            listed = drive.theta[first - 1 : first - 1 + count]
            pairs = [split_ratio(top * one.numerator, bottom * one.denominator) for one in listed]
            highs, lows = np.array(pairs).reshape(-1, 2).T.copy()
            return highs, lows
        theta = drive.targets(first, count, seed)
        l0, l0_low = split(self.chain.l0)
        product, error = two_product(l0, theta)
        return product, error + l0_low * theta

    def follow(self, drive: Drive, first: int, count: int, limits: Limits = NO_LIMITS) -> Stretch:
        """Take the chain to targets `first` .. `first + count - 1`; see `Simulation.follow`."""
        high, low = self.targets(drive, first, count, self.seed)
        self.work.now["target"] = first
        travel = np.empty(count)
        rows: dict[str, list[Any]] = {
            name: [] for name in ("x", "tension", "slips") if name in self.record
        }
        logs = [tables.record_arrays({name: ()}, 1) for name in self.record if name in _LOGS]
        begun = events = self.events
        done, reason = 0, layout.DONE
        stop: Stop | None = None
        while stop is None:
            here = slice(done, done + 1 if rows else count)
            left = begun + limits.events_left - events
            reason, reached = self._advance(high[here], low[here], travel[here], left)
            done += reached
            logs.append(self._drain_tables())
            if rows and reached:
                tensions, displacements, *_ = self.origin.read(self._present)
                slips = self.work.tally[layout.SLIPS, PAD : PAD + self.chain.n].copy()
                known = {"x": displacements, "tension": tensions, "slips": slips}
                for name, values in rows.items():
                    values.append(known[name])
                self.work.tally[layout.SLIPS] = 0
            events = self.events
            if reason in (layout.RUNAWAY, layout.ENDLESS):
                break
            stop = Stop.DONE if done == count else limits.stop(events - begun)
        recorded: dict[str, NDArray[Any]] = {"x_G": travel[:done] / self.chain.n}
        recorded |= tables.record_arrays(rows, self.chain.n) | tables.joined(logs)
        if stop is not None:
            return Stretch(done, recorded, stop, limits.reason(stop))
        return Stretch(done, recorded, *self.ending(reason))

    def ending(self, reason: int, told: str = _ENDLESS) -> tuple[Stop, str]:
        """Return why the chain goes no further, and a sentence: `told` if nothing is proved."""
        if reason == layout.RUNAWAY:
            return Stop.RUNAWAY, NEVER_STOPS
        if self._never_rests():
            return Stop.RUNAWAY, NEVER_RESTS
        return Stop.LIMIT, told

    def _advance(self, *targets: NDArray[np.float64] | int, single: bool = False) -> Any:
        """Run the compiled loop for a moment: the arguments of `loop.follow` up to `max_events`.

        `layout.BUDGET` comes back after these, or what takes some hundredths of a second.
        """
        return self.paced(lambda work, pace: loop.follow(*work, *targets, pace, single))

    def paced(self, run: Callable[[Workspace, int], Any]) -> Any:
        """Return what `run` does with as much work as takes some hundredths of a second."""
        if self.work.series is None and self.work.now["stage"][0] == layout.CLUSTER:
            self.make_room()
        begin = time.perf_counter()
        result = run(self.work, self._pace)
        seconds = time.perf_counter() - begin
        if seconds > 0.1:
            self._pace = max(self._pace // 2, 1)
        elif seconds < 0.01 and self._pace < _MOST_WORK:
            self._pace *= 2
        return result

    def single(self, direction: int, most: int, at_once: int = _MOST_WORK) -> Iterator[int]:
        """Rearrange as the chain stands, else where theta makes it; yield why the loop came back.

        That is soon after `most` events or, each time, `at_once`; to ask for more lets it go on.
        `layout.ONE_DONE`, or `layout.DONE` without a rearrangement, says that it has ended.
        """
        high, low = self.load()
        if direction != 0 and self.chain.n > 1:
            high, low = np.inf * direction, 0.0
        target = np.array([high]), np.array([low]), np.empty(1)
        reason = layout.BUDGET
        while reason in _GOES_ON:
            left = min(most - self.events, at_once)
            reason, _ = self._advance(*target, left, single=True)
            yield reason

    def make_room(self) -> None:
        """Be ready for several sliders that move together."""
        if self.work.series is None:
            self.work = roomier(self.work)

    def _never_rests(self) -> bool:
        """Return whether it is proved that the chain in motion never comes to rest."""
        chain, signs = self.chain, self.cell(layout.SIDE)
        velocities = self.cell(layout.SPEED) * signs
        tensions = self.state().tensions
        largest = Contacts(chain).acting(self.cell(layout.COEFFICIENT).max())
        # every event adds a few roundings of the largest force
        size = chain.friction + float(abs(tensions).max(initial=0.0) + abs(velocities).max())
        slack = 16 * 2.0**-53 * int(self.work.now["number"][0]) * size
        return never_rests(FLOAT64, chain, tensions, velocities, signs, largest, slack)

    def drain(self) -> NDArray[Any]:
        """Return the rows of the event log, and empty it."""
        count = int(self.work.now["logged"].item())
        self.work.now["logged"] = 0
        rows = self.work.log.events[:count]
        return rows.view(np.uint8).copy().view(rows.dtype)  # field by field it takes longer

    def _drain_tables(self) -> dict[str, NDArray[Any]]:
        """Return the columns of all that is logged, and empty the logs."""
        l0 = nearest_float(self.chain.l0)
        found: dict[str, NDArray[Any]] = {}
        if len(events := self.drain()):
            events["theta"] = (events["theta"] + events["theta_low"]) / l0
            found |= tables.EVENT_TABLE.arrays(events)
        logs = self.work.log.tables
        if logs is not None:
            rearrangements, slips = logs.rearrangements[: logs.used[0]], logs.slips[: logs.used[1]]
            logs.used[:] = 0
            rearrangements["theta"] /= l0
            if len(rearrangements):
                found |= tables.REARRANGEMENT_TABLE.arrays(rearrangements)
            if len(slips):
                found |= tables.SLIP_TABLE.arrays(slips)
        return found

    def load(self) -> tuple[float, float]:
        """Return ``l0 theta`` at present, as two floats."""
        now = self.work.now
        return now["theta"].item(), now["theta_low"].item()

    def state(self) -> State:
        """Return the present state."""
        theta = dilation(self.chain, self.load())
        return State.owning(*self.origin.read(self._present), theta)

    def _kept(self) -> dict[str, NDArray[Any]]:
        """Return the arrays that decide how it goes on, as plain numbers, by name."""
        work = self.work
        kept: dict[str, NDArray[Any]] = {
            "cell": work.cell,
            "tally": work.tally,
            "real": work.now.view(np.float64)[: layout.REALS],
            "whole": work.now.view(np.int64)[layout.REALS :],
        }
        if work.log.tables is not None:
            kept |= {"track": work.log.tables.track, "sums": work.log.tables.sums.view(np.float64)}
        return kept

    def capture(self) -> dict[str, Any]:
        """Return everything needed to go on bit for bit."""
        captured = {name: array.copy() for name, array in self._kept().items()}
        # in the middle of a long avalanche sliders stand where they were at different times
        if self.work.clock is not None and self.work.now["local"][0]:
            captured["clock"] = self.work.clock.copy()
        tension, tension_low, place, place_low, *_ = self.origin.numbers.copy()
        captured |= {
            "start_tension": tension[:-1],
            "start_tension_low": tension_low[:-1],
            "start_displacement": place,
            "start_displacement_low": place_low,
            "start_theta": np.array(split(rational(self.origin.state.theta))),
        }
        return captured

    def restore(self, captured: Mapping[str, Any]) -> None:
        """Take over what `capture` returned."""
        for name, array in self._kept().items():
            array[...] = captured[name]
        work = self.work
        work.now["logging"] = _logging(self.record)
        if work.clock is not None:
            layout.forget(work.clock, self.chain.n)
            work.clock[...] = captured.get("clock", work.clock)
        loop.prepare(work.cell, work.tally, work.deviate, work.now)

        def whole(name: str) -> NDArray[Any]:
            high, low = captured[name], captured[name + "_low"]
            if not np.any(low):
                return np.array(high, dtype=np.float64)
            pairs = zip(high.tolist(), low.tolist(), strict=True)
            return np.array([Fraction(one) + Fraction(other) for one, other in pairs])

        begun = replace(
            self.origin.state,
            tensions=whole("start_tension"),
            displacements=whole("start_displacement"),
            theta=sum(Fraction(float(part)) for part in captured["start_theta"]),
        )
        self.origin = Origin.of(self.chain, begun)

    def logged(self) -> ExactSimulation:
        """Return a simulation that goes on from here bit for bit, and records events."""
        twin = ExactSimulation(self.chain, self.origin.state, 0, ("events",))
        twin.restore(self.capture())
        return twin

    def twin(self) -> ExactSimulation | None:
        """Return a simulation whose tensions at the start are `_NUDGE` off, to either side.

        What mirrors itself goes on doing so.
        """
        n, begun = self.chain.n, self.origin.state
        if n == 1:
            return None
        largest = nearest_float(self.chain.mu_s + abs(self.chain.tan_alpha))
        off = [_NUDGE * largest * (-1) ** min(i, n - 2 - i) for i in range(n - 1)]
        given = zip(begun.tensions.tolist(), off, strict=True)
        tensions = np.array([rational(t) + Fraction(d) for t, d in given])
        return ExactSimulation(self.chain, replace(begun, tensions=tensions), self.seed, ())

    @property
    def evidence(self) -> Evidence:
        """Undecided if a comparison is, or once an avalanche is too long for the promise."""
        now = self.work.now[0]
        moving = now["stage"] != layout.AT_REST
        if now["long"] or (moving and now["number"] > layout.PROMISED_EVENTS):
            return Evidence.UNDECIDED
        return super().evidence

    def report(self) -> dict[str, Any]:
        """Return the work done: cluster steps, margins tested, polynomial evaluations."""
        return _work_done(self.work.now)


def _work_done(now: NDArray[Any]) -> dict[str, Any]:
    return {
        "cluster_steps": now["steps"].item(),
        "windows_certified": now["tests"].item(),
        "root_evaluations": now["roots"].item(),
    }


@dataclass(frozen=True, eq=False, repr=False, init=False)
class Estimated(Rearrangement):
    """A rearrangement by `Exact`: events, initial state and error are made when asked for.

    Attributes
    ----------
    begun : Origin
        The state from which theta was ramped.
    load : tuple of float
        ``l0 theta_c``, as two floats.
    log : ndarray of layout.LOGGED_EVENT
        A row for each slider of each event.
    direction : int
        Of the ramp; 0: as the chain stood.
    """

    begun: Origin
    load: tuple[float, float]
    log: NDArray[Any]
    direction: int

    @cached_property  # type: ignore[misc] # a field that is made when asked for
    def events(self) -> tuple[Event, ...]:
        """The events, in order of time."""
        return tuple(_events(self.log))

    @cached_property  # type: ignore[misc] # a field that is made when asked for
    def initial(self) -> State:
        """The state at theta_c."""
        given = self.begun.state
        return State.owning(
            self.begun.ramped(self.load),
            given.displacements,
            given.coefficients,
            given.draws,
            dilation(self.chain, self.load) if len(self.log) else given.theta,
            given.past,
        )

    @cached_property
    def condition(self) -> RoundingError:
        """What rounding does to the rearrangement, as far as it can be estimated."""
        return rounding_error(self.chain, self.begun, self.seed, self.direction, self.log)

    @property
    def evidence(self) -> Evidence:
        """Undecided if a comparison is, or if rounding may have grown beyond the promise."""
        return self.decided if self.condition.holds else Evidence.UNDECIDED

    @property
    def error(self) -> float:
        """The estimate of the largest error; see `Rearrangement`."""
        return self.condition.error

    @property
    def doubt(self) -> str:
        """Why `error` breaks the promise of 1e-12, if it does."""
        return self.condition.sentence()


@dataclass(frozen=True)
class Exact(Solver):
    """The event-driven solver in float64, compiled.

    Parameters
    ----------
    escalate : bool
        Whether `rearrange` does a rearrangement again with `certified` if float64 leaves it
        undecided. Not for runs.

    Guarantee: every event is located to a few ulp of its time, and none is missed: an event is
    accepted only after all sliders were certified to have none before (see `taylor`). Each
    event adds rounding of a few 1e-16 of the largest force, which the events that follow amplify.
    The promise is 1e-12 in the tensions after one rearrangement: `rearrange` estimates the error
    (see `rounding_error`), and where the estimate is larger the evidence is `UNDECIDED`.
    Comparisons within the rounding bound of their own evaluation are settled by the model's rules
    and counted as undecided.
    """

    escalate: bool = False
    name: ClassVar[str] = "exact"
    summary: ClassVar[str] = "event by event in closed form, float64, compiled"

    def __post_init__(self) -> None:
        if not isinstance(self.escalate, bool):
            raise InputError("escalate", self.escalate, "must be true or false")

    def compiles(self, n: int) -> tuple[int, ...]:
        """Return lengths of chains with which all is compiled that one of `n` sliders may need."""
        if n > layout.LONGEST_SHORT:
            return (layout.LONGEST_SHORT + 1,)
        return (3,) if n > 2 else (2, 3)

    def rearrange_from(self, start: Start, direction: int, limits: Limits) -> Rearrangement:
        """Rearrange by the compiled loop, in arrays of a rearrangement that is over."""
        chain = start.chain
        if limits.at < math.inf:
            limits = limits.later(compiled(self, self.compiles(chain.n)))
        try:
            used = _USED[chain.n].pop()
        except (KeyError, IndexError):
            used = None
        simulation = ExactSimulation(chain, start.state, start.seed, ("events",), used)
        logs: list[NDArray[Any]] = []
        outcome, told = Outcome.AT_REST, ""
        late = limits.at < math.inf and limits.passed()  # then there is one event all the same
        at_once = 1 if late else _MOST_WORK
        for reason in simulation.single(direction, limits.events_left, at_once):
            logs.append(simulation.drain())
            stop = limits.stop(simulation.events) if reason in _GOES_ON else None
            if stop is not None or reason in (layout.RUNAWAY, layout.ENDLESS):
                told = limits.reason(stop) if stop else _ENDLESS
                ended, told = simulation.ending(reason, told)
                outcome = Outcome.RUNAWAY if ended is Stop.RUNAWAY else Outcome.LIMIT
                break
        now = simulation.work.now
        undecided = now["undecided"].item()
        velocities = np.zeros(chain.n)
        if outcome is not Outcome.AT_REST:
            velocities = simulation.cell(layout.SPEED) * simulation.cell(layout.SIDE)
        result = Estimated(
            chain=chain,
            begun=simulation.origin,
            load=simulation.load(),
            log=logs[0] if len(logs) == 1 else np.concatenate(logs),
            direction=direction,
            outcome=outcome,
            decided=Evidence.of(undecided, Evidence.COMPUTED),
            state=simulation.state(),
            velocities=velocities,
            undecided=undecided,
            draws_below_mu_d=now["below"].item(),
            solver=self.name,
            seed=start.seed,
            report=_work_done(now) | {"time": now["time"].item()},
            reason=told,
        )
        if chain.n <= layout.LONGEST_SHORT:
            _USED.setdefault(chain.n, []).append(simulation.work)
        if not self.escalate or outcome is Outcome.LIMIT:
            return result
        if result.evidence is not Evidence.UNDECIDED:
            return result
        certified = Certified().rearrange_from(start, direction, limits)
        why = result.doubt or f"{undecided} comparisons were undecided"
        return replace(certified, report={**certified.report, "escalated": why})

    def events_from(self, start: Start, direction: int) -> Iterator[Event]:
        """Yield the events one by one."""
        self._refuse_to_escalate("events that were handed out cannot be taken back")
        simulation = ExactSimulation(start.chain, start.state, start.seed, ("events",))
        for _ in simulation.single(direction, NO_LIMITS.events_left, 1):
            yield from _events(simulation.drain())

    def simulation_from(self, start: Start, record: tuple[str, ...]) -> Simulation:
        """Return a simulation by the compiled loop."""
        self._refuse_to_escalate('is for one rearrangement; for a run use solver="certified"')
        return ExactSimulation(start.chain, start.state, start.seed, record)

    def _refuse_to_escalate(self, why: str) -> None:
        if self.escalate:
            raise InputError("escalate", True, why)


def _logging(record: tuple[str, ...]) -> int:
    """Return what the compiled loop logs, see `layout.NOW`."""
    return sum(flag for name, flag in _LOGS.items() if name in record)


def _events(log: NDArray[Any]) -> Iterator[Event]:
    """Yield the events of rows of the event log, with their residuals."""
    rows = log.tolist()
    pairs = tables.events_of(
        [tables.EventRow._make(row[:8]) for row in rows], [row[-1] for row in rows]
    )
    return (event for _, event in pairs)
