"""The solver called "verlet": the paper's own method, a fixed time step, kept independent.

Velocity Verlet on the moving sliders; at the end of every step the velocities are tested for
stops and the resting neighbours for starts. It shares the model of the chain with the exact
solver, and nothing else. An event is seen at the end of the step in which it happens, an error of
first order in `dt`; with ``locate=True`` it is found inside the step by bisection, which restores
the second order. See `steps` for the steps themselves.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from exactcreep.limits import NO_LIMITS, Limits, Stop
from exactcreep.model.chain import Chain
from exactcreep.model.contacts import Contacts, Event
from exactcreep.model.drive import Drive
from exactcreep.model.numbers import InputError, exact_number, nearest_float
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.model.state import State
from exactcreep.motion.arithmetic import FLOAT64
from exactcreep.motion.runaway import NEVER_STOPS
from exactcreep.motion.solution import Motion, Solution
from exactcreep.solvers.rows import Avalanche
from exactcreep.solvers.solver import (
    Rearrangement,
    Simulation,
    Solver,
    Start,
    Stretch,
    Tally,
    compiled,
    refuse_records,
)
from exactcreep.solvers.tables import (
    EVENT_TABLE,
    LOGS,
    EventRow,
    RearrangementRow,
    SlipRow,
    TargetRows,
    joined,
    logged_events,
    record_arrays,
)
from exactcreep.solvers.verlet import steps
from exactcreep.solvers.verlet.steps import NOW, SLIDER, B, Laws, Work, X, Y

_TOO_LONG = f"a rearrangement did not end within {steps.MOST_STEPS:.0e} steps; dt may be too large"
_INFINITE = "the motion grew beyond the largest float; dt is too large (above 1 it is unstable)"
_ENDINGS = {
    steps.REST: (Stop.DONE, ""),
    steps.EVENTS: (Stop.BUDGET, ""),
    steps.RUNAWAY: (Stop.RUNAWAY, NEVER_STOPS),
    steps.STEPS: (Stop.LIMIT, _TOO_LONG),
    steps.INFINITE: (Stop.LIMIT, _INFINITE),
}
"""Why the compiled steps return for good; else they want to be called again."""


def _laws(chain: Chain, state: State, seed: int, dt: float, locate: bool) -> Laws:
    l0 = nearest_float(chain.l0)
    return Laws(
        n=chain.n,
        l0=l0,
        origin=l0 * float(state.theta),
        weight=chain.sin_alpha,
        friction=chain.friction,
        cosine=chain.cos_alpha,
        mu_d=nearest_float(chain.mu_d),
        mu_s=nearest_float(chain.mu_s),
        held=chain.times_cosine(chain.mu_s),
        sigma=nearest_float(chain.sigma_mu),
        seed=np.uint64(seed),
        random=chain.sigma_mu != 0,
        runs_away=chain.may_run_away,
        dt=dt,
        locate=locate,
    )


def _work(chain: Chain, state: State, laws: Laws, keep_events: bool) -> Work:
    n = chain.n
    sliders = np.zeros(n + 2, dtype=SLIDER)
    inner = sliders[1 : n + 1]
    sliders["base"][1:n] = state.tensions.astype(np.float64)
    inner["displacement"] = state.displacements.astype(np.float64)
    inner["coefficient"] = state.coefficients.astype(np.float64)
    inner["draws"] = state.draws
    coefficients = inner["coefficient"]
    held = Contacts(chain).thresholds(coefficients, FLOAT64)
    # the compiled steps give a contact that acts as mu_d the friction force, rounded once
    inner["threshold"] = np.where(coefficients < laws.mu_d, laws.friction, held)
    now = np.zeros(1, dtype=NOW)
    now["theta"] = float(state.theta)
    lanes = np.zeros((steps.OLD_B + 1, n + 2))
    lanes[steps.CEILING] = math.inf
    lanes[steps.CEILING, 1 : n + 1] = inner["threshold"]
    lanes[steps.SPRINGS, 1 : n + 1] = 2.0
    lanes[steps.SPRINGS, 1] -= 1.0
    lanes[steps.SPRINGS, n] -= 1.0
    return Work(
        sliders=sliders,
        lanes=lanes,
        movers=np.zeros(n + 1, dtype=np.int64),
        now=now,
        windows=np.zeros(n + 2, dtype=np.int64),
        near=np.zeros(n + 2, dtype=np.int64),
        near_count=np.zeros(1, dtype=np.int64),
        hit=np.zeros(n + 2, dtype=np.int8),
        rows=np.zeros(2 * n + 4096 if keep_events else 0, dtype=steps.ROW),
        written=np.zeros(1, dtype=np.int64),
        spent=np.zeros(1, dtype=np.int64),
    )


def _state(laws: Laws, work: Work) -> State:
    n = laws.n
    inner = work.sliders[1 : n + 1]
    x = work.lanes[X, 1 : n + 1]
    with np.errstate(invalid="ignore"):  # not finite where dt was too large
        stretch = np.diff(x)
    return State(
        tensions=inner["base"][: n - 1] - work.now["shift"][0] + stretch,
        displacements=inner["displacement"] + x,
        coefficients=inner["coefficient"].copy(),
        draws=inner["draws"].copy(),
        theta=float(work.now["theta"][0]),
    )


def _velocities(laws: Laws, work: Work) -> NDArray[np.float64]:
    inner = work.lanes[:, 1 : laws.n + 1]
    with np.errstate(invalid="ignore"):  # not finite where dt was too large
        velocities: NDArray[np.float64] = (inner[Y] + 0.5 * inner[B]) / laws.dt
    return velocities


class _Course:
    """The motion between two events: the steps, taken again when somebody asks.

    Between two steps it is the velocity Verlet step of a shorter length.
    """

    def __init__(self, chain: Chain, laws: Laws, work: Work, rest: NDArray[Any], t: float) -> None:
        self.t_min = self.t_max = t
        self._chain, self._laws = chain, laws
        self._moved = slice(int(work.now["low"][0]) - 1, int(work.now["high"][0]) + 2)
        self._lanes = work.lanes[:, self._moved].copy()
        self._work = work._replace(
            sliders=rest,
            lanes=work.lanes[:, :0],
            movers=work.movers[: int(work.now["movers"][0])].copy(),
            now=work.now.copy(),
            rows=work.rows[:0],
        )

    def __call__(self, t: Any) -> Motion:
        """Return the motion at the time `t`."""
        lanes = np.zeros((len(self._lanes), self._chain.n + 2))
        lanes[:, self._moved] = self._lanes
        work = self._work._replace(lanes=lanes)
        steps.glide(self._laws, work, (float(t) - self.t_min) / self._laws.dt)
        state = _state(self._laws, work)
        velocities = _velocities(self._laws, work)
        return Motion(state.displacements, velocities, state.forces(self._chain))


def _new_events(work: Work) -> list[Event]:
    """Return the events that have been written down, and make room for others."""
    rows = work.rows[: int(work.written[0])]
    columns = EVENT_TABLE.arrays(rows)
    work.written[0] = 0
    return [event for _, event in logged_events(columns, rows["residual"])]


def _report(laws: Laws, work: Work) -> dict[str, Any]:
    return {"dt": laws.dt, "locate": laws.locate, "steps": int(work.now["steps"][0])}


class _Tables:
    """The tables of rearrangements and slips, made of the rows of events."""

    def __init__(self, chain: Chain, state: State, seed: int) -> None:
        self._chain = chain
        self._contacts = Contacts(chain, seed)
        self._draws = state.draws.copy()
        self._theta = float(state.theta)
        self._tensions = state.tensions.astype(np.float64)  # with theta at rest
        self._undecided = [0, 0]  # at the end of the last rearrangement, and at the last event
        self._avalanche: Avalanche | None = None

    def take(self, rows: NDArray[Any], *, moves: bool) -> dict[str, NDArray[Any]]:
        """Return the rows that these rows of events complete; `moves` says if the chain does."""
        done: list[RearrangementRow] = []
        slips: list[SlipRow] = []
        moved = np.zeros(self._chain.n)
        place = 0
        for first, event in logged_events(EVENT_TABLE.arrays(rows)):
            here = rows[place : place + len(event.sliders)]
            place += len(here)
            if first.number == 0:
                done += self._ended()
                self._begin(first, int(here["way"][0]))
            assert self._avalanche is not None
            moved[here["slider"] - 1] = here["moved"]
            slips += self._avalanche.take(event, moved, self._drawn, FLOAT64)
            self._undecided[1] = int(here["undecided"].max())
        if not moves:
            done += self._ended()
        return record_arrays({"rearrangements": done, "slip_table": slips}, self._chain.n)

    def _begin(self, first: EventRow, way: int) -> None:
        self._tensions -= nearest_float(self._chain.l0) * (first.theta - self._theta)
        self._theta = first.theta
        self._avalanche = Avalanche(
            first.rearrangement,
            first.half_cycle,
            first.theta,
            way,
            self._tensions.copy(),
            np.zeros(self._chain.n),
            self._undecided[0],
        )

    def _drawn(self, n: int) -> Any:
        self._draws[n] += 1
        return self._contacts.coefficient(n + 1, int(self._draws[n]) - 1)

    def _ended(self) -> list[RearrangementRow]:
        avalanche, self._avalanche = self._avalanche, None
        if avalanche is None:
            return []
        self._tensions += np.diff(avalanche.moved)
        self._undecided[0] = self._undecided[1]
        return [avalanche.row(self._chain, FLOAT64, self._undecided[1])]

    def captured(self) -> dict[str, Any]:
        """Return everything needed to go on bit for bit."""
        return {
            "draws": self._draws.copy(),
            "theta": self._theta,
            "tensions": self._tensions.copy(),
            "undecided": list(self._undecided),
            "avalanche": self._avalanche and self._avalanche.captured(FLOAT64.plain),
        }

    def restore(self, captured: Mapping[str, Any]) -> None:
        """Take over what `captured` returned."""
        self._draws[:] = captured["draws"]
        self._theta = float(captured["theta"])
        self._tensions[:] = captured["tensions"]
        self._undecided = list(captured["undecided"])
        known = captured["avalanche"]
        self._avalanche = known and Avalanche.restored(known, FLOAT64.from_plain)


class VerletSimulation(Simulation):
    """A chain on its way along a drive, stepped in time."""

    def __init__(self, start: Start, record: tuple[str, ...], dt: float, locate: bool) -> None:
        refuse_records(record)
        chain, state, seed = start.chain, start.state, start.seed
        self._chain = chain
        self._seed = seed
        self._record = record
        self._laws = _laws(chain, state, seed, dt, locate)
        self._work = _work(chain, state, self._laws, any(name in record for name in LOGS))
        self._count()
        self._tables = _Tables(chain, state, seed)

    def _count(self) -> None:
        now = self._work.now[0]
        self.tally = Tally(
            rearrangements=int(now["rearrangements"]),
            events=int(now["events"]),
            slips=int(now["slips"]),
            draws_below_mu_d=int(now["below"]),
            undecided=int(now["undecided"]),
        )

    def follow(self, drive: Drive, first: int, count: int, limits: Limits = NO_LIMITS) -> Stretch:
        """Take the chain to targets `first` .. `first + count - 1` of the drive."""
        work, record = self._work, self._record
        targets = drive.targets(first, count, self._seed)
        rows = TargetRows.empty(record, count, self._chain.n)
        logs: list[dict[str, NDArray[Any]]] = []
        tables = [name for name in ("rearrangements", "slip_table") if name in record]
        kept = [name for table in tables for name in LOGS[table].columns]
        done = 0
        begun = events = int(work.now["events"][0])
        stop: Stop | None = None
        while stop is None:
            work.spent[0] = 0
            budget = begun + limits.events_left - events
            own = rows.part(done)
            code, more = steps.follow(self._laws, work, targets[done:], first + done, budget, own)
            done += more
            written = work.rows[: int(work.written[0])]
            if "events" in record:
                logs.append(EVENT_TABLE.arrays(written))
            if tables:
                found = self._tables.take(written, moves=work.now["phase"][0] == steps.MOVING)
                logs.append({name: found[name] for name in kept})
            work.written[0] = 0
            events = int(work.now["events"][0])
            stop, reason = _ENDINGS.get(code, (None, ""))
            stop = stop or limits.stop(events - begun)
        self._count()
        recorded = rows.recorded(record, done) | joined(logs)
        return Stretch(done, recorded, stop, reason or limits.reason(stop))

    def state(self) -> State:
        """Return the present state."""
        return _state(self._laws, self._work)

    def capture(self) -> dict[str, Any]:
        """Return everything needed to go on bit for bit."""
        work = self._work
        return {
            "origin": self._laws.origin,
            "tables": self._tables.captured(),
            "movers": work.movers.copy(),
            "lanes": work.lanes.copy(),
            **{"slider_" + name: work.sliders[name].copy() for name in SLIDER.names or ()},
            **{"now_" + name: work.now[name][0].item() for name in NOW.names or ()},
        }

    def restore(self, captured: Mapping[str, Any]) -> None:
        """Take over what `capture` returned."""
        work = self._work
        self._laws = self._laws._replace(origin=float(captured["origin"]))
        work.movers[:] = captured["movers"]
        work.lanes[:] = captured["lanes"]
        for name in SLIDER.names or ():
            work.sliders[name] = captured["slider_" + name]
        for name in NOW.names or ():
            work.now[name] = captured["now_" + name]
        work.written[0] = 0
        self._tables.restore(captured["tables"])
        self._count()

    def report(self) -> dict[str, Any]:
        """Return the time step, how events are found, and the number of steps."""
        return _report(self._laws, self._work)


@dataclass(frozen=True)
class Verlet(Solver):
    """Velocity Verlet with a fixed time step.

    Parameters
    ----------
    dt : number
        The time step, unit tau_dyn; positive. Beyond 1 it is unstable.
    locate : bool
        Find events inside the step by bisection, not at its end.

    Raises
    ------
    InputError
        If an option is out of range.

    Notes
    -----
    Source: section Numerical method. Guarantee: none; the error of a rearrangement is O(dt)
    across events (O(dt**2) with `locate`) as long as the itinerary is right.
    """

    dt: Any = field(default=0.01)
    locate: bool = False
    name: ClassVar[str] = "verlet"
    summary: ClassVar[str] = "velocity Verlet with a fixed time step dt, the paper's own method"

    def __post_init__(self) -> None:
        dt = nearest_float(exact_number(self.dt, "dt"))
        if not (dt > 0.0 and dt * dt > 0.0 and math.isfinite(dt * dt)):
            allowed = "must be a positive time step, unit tau_dyn, whose square is a float64"
            raise InputError("dt", self.dt, allowed)
        object.__setattr__(self, "dt", dt)
        if not isinstance(self.locate, (bool, np.bool_)):
            raise InputError("locate", self.locate, "must be true or false")

    def simulation_from(self, start: Start, record: tuple[str, ...]) -> VerletSimulation:
        """Return a simulation that steps in time."""
        return VerletSimulation(start, record, self.dt, bool(self.locate))

    def rearrange_from(self, start: Start, direction: int, limits: Limits) -> Rearrangement:
        """Rearrange by steps in time, noting where each motion between two events begins."""
        chain, state = start.chain, start.state
        if limits.at < math.inf:
            limits = limits.later(compiled(self, self.compiles(chain.n)))
        simulation = self.simulation_from(start, ("events",))
        laws, work = simulation._laws, simulation._work
        if steps.release(laws, work) == 0 and direction != 0:
            steps.ramp(laws, work, float(direction), math.inf)
        initial = replace(
            _state(laws, work),
            displacements=state.displacements,
            coefficients=state.coefficients,
            draws=state.draws,
        )
        rest = work.sliders.copy()
        events = _new_events(work)
        courses = [_Course(chain, laws, work, rest, 0.0) for _ in events]
        stop, reason = None, ""
        while work.now["phase"][0] == steps.MOVING and stop is None:
            stop = limits.stop(len(events))
            if stop is not None:
                reason = limits.reason(stop)
                break
            work.spent[0] = 0
            code = steps.advance(laws, work, work.now["events"][0] + 1)
            new = _new_events(work)
            events += new
            if code != steps.REST:
                courses += [_Course(chain, laws, work, rest, float(event.time)) for event in new]
            if code in (steps.RUNAWAY, steps.STEPS, steps.INFINITE):
                stop, reason = _ENDINGS[code]
        ends = [float(event.time) for event in events[1:]]
        if stop is not None:
            ends.append(float(work.now["origin"][0] + work.now["step"][0] * laws.dt))
        for course, end in zip(courses, ends, strict=False):
            course.t_max = end
        outcome = Outcome.AT_REST if stop is None else Outcome.LIMIT
        undecided = int(work.now["undecided"][0])
        return Rearrangement(
            chain=chain,
            initial=initial,
            events=tuple(events),
            outcome=Outcome.RUNAWAY if stop is Stop.RUNAWAY else outcome,
            decided=Evidence.of(undecided, Evidence.COMPUTED),
            state=_state(laws, work),
            velocities=_velocities(laws, work),
            motion=Solution(
                courses[: len(ends)],
                Motion(initial.displacements, np.zeros(chain.n), initial.forces(chain)),
            ),
            undecided=undecided,
            draws_below_mu_d=int(work.now["below"][0]),
            solver=self.name,
            seed=start.seed,
            report=_report(laws, work),
            reason=reason,
        )
