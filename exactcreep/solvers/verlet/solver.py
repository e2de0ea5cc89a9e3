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
from exactcreep.model.contacts import Contacts, Event
from exactcreep.model.drive import Drive
from exactcreep.model.numbers import InputError, exact_number, nearest_float
from exactcreep.model.outcome import Outcome
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
    require,
    same_kind,
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
from exactcreep.solvers.verlet.steps import NOW, SLIDER, Arrays, B, Constants, X, Y
from exactcreep.solvers.warm_up import compiled

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
_REALS = ("base", "displacement", "coefficient", "threshold")
_COUNTS = ("steps", "rearrangements", "events", "slips", "below", "undecided", "target")


def _constants(start: Start, dt: float, locate: bool) -> Constants:
    chain = start.chain
    l0 = nearest_float(chain.l0)
    return Constants(
        n=chain.n,
        l0=l0,
        origin=l0 * float(start.state.theta),
        weight=chain.sin_alpha,
        friction=chain.friction,
        cosine=chain.cos_alpha,
        mu_d=nearest_float(chain.mu_d),
        mu_s=nearest_float(chain.mu_s),
        held=chain.times_cosine(chain.mu_s),
        sigma=nearest_float(chain.sigma_mu),
        seed=np.uint64(start.seed),
        random=chain.sigma_mu != 0,
        runs_away=chain.may_run_away,
        dt=dt,
        locate=locate,
    )


def _arrays(start: Start, fixed: Constants, keep_events: bool) -> Arrays:
    n, state = fixed.n, start.state
    sliders = np.zeros(n + 2, dtype=SLIDER)
    inner = sliders[1 : n + 1]
    sliders["base"][1:n] = state.tensions.astype(np.float64)
    inner["displacement"] = state.displacements.astype(np.float64)
    inner["coefficient"] = coefficients = state.coefficients.astype(np.float64)
    inner["draws"] = state.draws
    held = Contacts(start.chain).thresholds(coefficients, FLOAT64)
    # the compiled steps give a contact that acts as mu_d the friction force, rounded once
    inner["threshold"] = np.where(coefficients < fixed.mu_d, fixed.friction, held)
    now = np.zeros(1, dtype=NOW)
    now["theta"] = float(state.theta)
    lanes = np.zeros((steps.OLD_B + 1, n + 2))
    lanes[steps.CEILING] = math.inf
    lanes[steps.CEILING, 1 : n + 1] = inner["threshold"]
    lanes[steps.SPRINGS, 1 : n + 1] = 2.0
    lanes[steps.SPRINGS, 1] -= 1.0
    lanes[steps.SPRINGS, n] -= 1.0
    return Arrays(
        sliders=sliders,
        lanes=lanes,
        movers=np.zeros(n + 1, dtype=np.int64),
        now=now,
        clusters=np.zeros(n + 2, dtype=np.int64),
        near=np.zeros(n + 2, dtype=np.int64),
        hit=np.zeros(n + 2, dtype=np.int8),
        rows=np.zeros(2 * n + 4096 if keep_events else 0, dtype=steps.ROW),
    )


def _state(fixed: Constants, arrays: Arrays) -> State:
    inner = arrays.sliders[1 : fixed.n + 1]
    x = arrays.lanes[X, 1 : fixed.n + 1]
    with np.errstate(invalid="ignore"):  # not finite where dt was too large
        stretch = np.diff(x)
    return State(
        tensions=inner["base"][:-1] - arrays.now["shift"][0] + stretch,
        displacements=inner["displacement"] + x,
        coefficients=inner["coefficient"].copy(),
        draws=inner["draws"].copy(),
        theta=float(arrays.now["theta"][0]),
    )


def _velocities(fixed: Constants, arrays: Arrays) -> NDArray[np.float64]:
    inner = arrays.lanes[:, 1 : fixed.n + 1]
    with np.errstate(invalid="ignore"):  # not finite where dt was too large
        velocities: NDArray[np.float64] = (inner[Y] + 0.5 * inner[B]) / fixed.dt
    return velocities


class _SteppedPiece:
    """The motion between two events: the steps, taken again when somebody asks.

    Between two steps it is the velocity Verlet step of a shorter length.
    """

    def __init__(self, simulation: VerletSimulation, rest: NDArray[Any], t: float) -> None:
        self.t_min = self.t_max = t
        self._chain, self._constants, arrays = simulation.chain, simulation.fixed, simulation.arrays
        now = arrays.now[0]
        self._moved = slice(int(now["low"]) - 1, int(now["high"]) + 2)
        self._lanes = arrays.lanes[:, self._moved].copy()
        self._arrays = arrays._replace(
            sliders=rest,
            lanes=arrays.lanes[:, :0],
            movers=arrays.movers[: int(now["movers"])].copy(),
            now=arrays.now.copy(),
            rows=arrays.rows[:0],
        )

    def __call__(self, t: Any) -> Motion:
        """Return the motion at the time `t`."""
        lanes = np.zeros((len(self._lanes), self._chain.n + 2))
        lanes[:, self._moved] = self._lanes
        arrays = self._arrays._replace(lanes=lanes)
        steps.glide(self._constants, arrays, (float(t) - self.t_min) / self._constants.dt)
        state = _state(self._constants, arrays)
        velocities = _velocities(self._constants, arrays)
        return Motion(state.displacements, velocities, state.forces(self._chain))


class _Ledger:
    """The tables of rearrangements and slips, made of the rows of events."""

    def __init__(self, start: Start) -> None:
        self._chain = start.chain
        self._theta = float(start.state.theta)
        self._tensions = start.state.tensions.astype(np.float64)  # with theta at rest
        self._undecided = [0, 0]  # at the end of the last rearrangement, and at the last event
        self._avalanche: Avalanche | None = None

    def take(self, rows: NDArray[Any], *, moves: bool) -> dict[str, NDArray[Any]]:
        """Return the rows that these rows of events complete; `moves` says if the chain does."""
        done: list[RearrangementRow] = []
        slips: list[SlipRow] = []
        moved, drawn = np.zeros((2, self._chain.n))
        place = 0
        for first, event in logged_events(EVENT_TABLE.arrays(rows)):
            here = rows[place : place + len(event.sliders)]
            place += len(here)
            if first.number == 0:
                done += self._ended()
                self._begin(first, int(here["way"][0]))
            assert self._avalanche is not None
            moved[here["slider"] - 1] = here["moved"]
            drawn[here["slider"] - 1] = here["coefficient"]
            slips += self._avalanche.take(event, moved, drawn.__getitem__, FLOAT64)
            self._undecided[1] = int(here["undecided"].max())
        if not moves:
            done += self._ended()
        return record_arrays({"rearrangements": done, "slip_table": slips}, self._chain.n)

    def _begin(self, first: EventRow, way: int) -> None:
        self._tensions -= nearest_float(self._chain.l0) * (first.theta - self._theta)
        self._theta = first.theta
        self._avalanche = Avalanche(
            first.rearrangement, first.half_cycle, first.theta, way, self._tensions.copy(),
            np.zeros(self._chain.n), self._undecided[0],
        )  # fmt: skip

    def _ended(self) -> list[RearrangementRow]:
        avalanche, self._avalanche = self._avalanche, None
        if avalanche is None:
            return []
        self._tensions += np.diff(avalanche.moved)
        self._undecided[0] = self._undecided[1]
        return [avalanche.row(self._chain, FLOAT64, self._undecided[1])]

    def snapshot(self) -> dict[str, Any]:
        """Return what is known at rest."""
        theta, undecided = np.array([self._theta]), np.array(self._undecided)
        return {"theta": theta, "tensions": self._tensions.copy(), "undecided": undecided}

    def restore(self, snapshot: Mapping[str, Any]) -> None:
        """Take over what `snapshot` returned."""
        self._theta, self._tensions[:] = float(snapshot["theta"][0]), snapshot["tensions"]
        self._undecided = snapshot["undecided"].tolist()


class VerletSimulation(Simulation):
    """A chain on its way along a drive, stepped in time."""

    def __init__(self, start: Start, record: tuple[str, ...], dt: float, locate: bool) -> None:
        self.chain, self.seed, self.record = start.chain, start.seed, record
        self.fixed = _constants(start, dt, locate)
        self.arrays = _arrays(start, self.fixed, any(name in record for name in LOGS))
        self._ledger = _Ledger(start)

    @property
    def tally(self) -> Tally:  # type: ignore[override]
        now = self.arrays.now[0]
        names = ("rearrangements", "events", "slips", "below", "undecided")
        return Tally(*(int(now[name]) for name in names))

    def follow(self, drive: Drive, first: int, count: int, limits: Limits = NO_LIMITS) -> Stretch:
        arrays, record = self.arrays, self.record
        targets = drive.targets(first, count, self.seed)
        rows = TargetRows.empty(record, count, self.chain.n)
        logs: list[dict[str, NDArray[Any]]] = []
        now = arrays.now[0]
        done = 0
        begun = events = int(now["events"])
        stop: Stop | None = None
        while stop is None:
            now["spent"] = 0
            budget = begun + limits.events_left - events
            own = rows.part(done)
            code, more = steps.follow(self.fixed, arrays, targets[done:], first + done, budget, own)
            done += more
            logs.append(self._tables())
            events = int(now["events"])
            stop, reason = _ENDINGS.get(code, (None, ""))
            stop = stop or limits.stop(events - begun)
        recorded = rows.recorded(record, done) | joined(logs)
        return Stretch(done, recorded, stop, reason or limits.reason(stop))

    def _tables(self) -> dict[str, NDArray[Any]]:
        """Return the rows of tables that are complete, and make room for others."""
        written, record = self._written(), self.record
        rows = EVENT_TABLE.arrays(written) if "events" in record else {}
        tables = [name for name in ("rearrangements", "slip_table") if name in record]
        if tables:
            moves = self.arrays.now["phase"][0] == steps.MOVING
            found = self._ledger.take(written, moves=moves)
            rows |= {name: found[name] for table in tables for name in LOGS[table].columns}
        return rows

    def _written(self) -> NDArray[Any]:
        """Return the rows of events that have been written down, and make room for others."""
        now = self.arrays.now[0]
        rows, now["written"] = self.arrays.rows[: int(now["written"])], 0
        return rows

    def new_events(self) -> list[Event]:
        """Return the events that have been written down, and make room for others."""
        rows = self._written()
        return [event for _, event in logged_events(EVENT_TABLE.arrays(rows), rows["residual"])]

    def state(self) -> State:
        return _state(self.fixed, self.arrays)

    def velocities(self) -> NDArray[np.float64]:
        """Return the present velocities."""
        return _velocities(self.fixed, self.arrays)

    @property
    def at_rest(self) -> bool:
        return bool(self.arrays.now["phase"][0] == steps.AT_REST)

    def come_to_rest(self, limits: Limits) -> dict[str, NDArray[Any]]:
        arrays, logs = self.arrays, []
        now = arrays.now[0]
        begun, code = int(now["events"]), steps.PAUSED
        while not self.at_rest and _ENDINGS.get(code) is None and not limits.passed():
            now["spent"] = 0
            code = steps.advance(self.fixed, arrays, begun + limits.events_left)
            logs.append(self._tables())
        return joined(logs)

    def snapshot(self) -> dict[str, Any]:
        sliders, now = self.arrays.sliders, self.arrays.now[0]
        return {
            "sliders": np.array([sliders[name] for name in _REALS]),
            "whole": np.array([sliders["draws"], sliders["slips"]]),
            "place": np.array([now["shift"], now["theta"]]),
            "counts": np.array([now[name] for name in _COUNTS]),
            "tables": self._ledger.snapshot(),
        }

    def restore(self, snapshot: Mapping[str, Any]) -> None:
        taken, arrays, fixed = same_kind(self.snapshot(), snapshot), self.arrays, self.fixed
        counts = [taken["counts"], taken["whole"], taken["tables"]["undecided"]]
        require(all((each >= 0).all() for each in counts), "a count is negative")
        require(all((each < 2**60).all() for each in counts), "a count is too large")
        numbers = [
            taken["sliders"],
            taken["place"],
            *map(taken["tables"].get, ("theta", "tensions")),
        ]
        require(all(np.isfinite(each).all() for each in numbers), "a number is not finite")
        sliders, now = arrays.sliders, arrays.now[0]
        for names, rows in ((_REALS, taken["sliders"]), (("draws", "slips"), taken["whole"])):
            for name, row in zip(names, rows, strict=True):
                sliders[name] = row
        now["shift"], now["theta"] = taken["place"]
        for name, count in zip(_COUNTS, taken["counts"], strict=True):
            now[name] = count
        now["phase"] = steps.AT_REST
        held = sliders["threshold"][1 : fixed.n + 1]
        arrays.lanes[steps.CEILING, 1 : fixed.n + 1] = held
        self._ledger.restore(taken["tables"])
        drawn = sliders["coefficient"][1 : fixed.n + 1]
        close = 2.0**-40 * (1.0 + abs(taken["sliders"]).max() + abs(fixed.origin))
        apart = held - np.maximum(drawn, fixed.mu_d) * fixed.cosine
        require((abs(apart) <= close).all(), "thresholds are not the coefficients'")
        shift = fixed.l0 * now["theta"] - fixed.origin
        ends = np.array([now["shift"], sliders["base"][0], sliders["base"][fixed.n]]) - shift
        require((abs(ends) <= close + 2.0**-40 * abs(shift)).all(), "theta is not the ends'")

    def report(self) -> dict[str, Any]:
        """Return the time step, how events are found, and the number of steps."""
        steps_taken = int(self.arrays.now["steps"][0])
        return {"dt": self.fixed.dt, "locate": self.fixed.locate, "steps": steps_taken}


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
        fixed, arrays = simulation.fixed, simulation.arrays
        now = arrays.now[0]
        if steps.release(fixed, arrays) == 0 and direction != 0:
            steps.ramp(fixed, arrays, float(direction), math.inf)
        begun = simulation.state()
        initial = replace(state, tensions=begun.tensions, theta=begun.theta, past=None)
        rest = arrays.sliders.copy()
        events = simulation.new_events()
        pieces = [_SteppedPiece(simulation, rest, 0.0) for _ in events]
        stop: Stop | None = None
        reason = ""
        while now["phase"] == steps.MOVING and stop is None:
            if (stop := limits.stop(len(events))) is not None:
                reason = limits.reason(stop)
                break
            now["spent"] = 0
            code = steps.advance(fixed, arrays, now["events"] + 1)
            new = simulation.new_events()
            events += new
            if code != steps.REST:
                pieces += [_SteppedPiece(simulation, rest, float(event.time)) for event in new]
            if code in (steps.RUNAWAY, steps.STEPS, steps.INFINITE):
                stop, reason = _ENDINGS[code]
        ends = [float(event.time) for event in events[1:]]
        outcome = Outcome.AT_REST
        if stop is not None:
            ends.append(float(now["origin"] + now["step"] * fixed.dt))
            outcome = Outcome.RUNAWAY if stop is Stop.RUNAWAY else Outcome.LIMIT
        for piece, end in zip(pieces, ends, strict=False):
            piece.t_max = end
        still = Motion(initial.displacements, np.zeros(chain.n), initial.forces(chain))
        tally = simulation.tally
        return Rearrangement(
            chain=chain,
            initial=initial,
            events=tuple(events),
            outcome=outcome,
            decided=simulation.evidence,
            state=simulation.state(),
            velocities=simulation.velocities(),
            motion=Solution(pieces[: len(ends)], still),
            undecided=tally.undecided,
            draws_below_mu_d=tally.draws_below_mu_d,
            solver=self.name,
            seed=start.seed,
            report=simulation.report(),
            reason=reason,
        )
