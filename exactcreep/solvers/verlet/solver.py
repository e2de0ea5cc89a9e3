"""The solver called "verlet": the paper's own method with a fixed time step, as a witness.

Velocity Verlet moves the sliders. At the end of every step the velocities are tested for stops, and
the resting neighbours for starts. It shares only the chain's parameters and the draws with the
other solvers, and has its own rules for starts, stops and ties. An event is noticed at the end of
its step, an error of first order in `dt`; with ``locate=True`` bisection finds it inside the step,
which restores the second order. The steps are in `steps`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.contacts import Contacts
from exactcreep.model.drive import Drive, Leg
from exactcreep.model.numbers import InputError, exact_number, nearest_float
from exactcreep.model.remarks import remark
from exactcreep.model.state import State
from exactcreep.model.uniform import EVERYTHING
from exactcreep.motion.arithmetic import FLOAT64
from exactcreep.motion.runaway import NEVER_STOPS
from exactcreep.solvers.avalanche_table import Avalanche, rearrangement_rows
from exactcreep.solvers.interface import (
    Ending,
    Rearrangement,
    Simulation,
    Solver,
    Start,
    Stretch,
    Tally,
    require_like,
)
from exactcreep.solvers.tables import EVENT_TABLE, LOGS, TargetRows, joined, logged_events
from exactcreep.solvers.verlet import steps
from exactcreep.solvers.verlet.steps import AT_REST_ROWS, COUNTS, Arrays, B, Constants, X, Y
from exactcreep.watch.limits import NO_LIMITS, Limits, Stop

_TOO_LONG = f"a rearrangement did not end within {steps.MOST_STEPS:.0e} steps; change dt"
_INFINITE = "the motion grew beyond the largest float; dt is too large (above 1 it is unstable)"
_ENDINGS = {
    steps.REST: Ending(Stop.DONE),
    steps.EVENTS: Ending(Stop.BUDGET),
    steps.RUNAWAY: Ending(Stop.RUNAWAY, NEVER_STOPS),
    steps.STEPS: Ending(Stop.LIMIT, _TOO_LONG),
    steps.INFINITE: Ending(Stop.LIMIT, _INFINITE),
}
"""Final reasons of the compiled steps to return; after any other they are called again."""
_NOWHERE, _NO_ROWS = np.empty(0), TargetRows.empty((), 0, 1)


def _arrays(start: Start, fixed: Constants, keep_events: bool) -> Arrays:
    n, state, chain = fixed.n, start.state, start.chain
    lanes, drawn = np.zeros((steps.HELD + 1, n + 2)), np.zeros((2, n + 2), dtype=np.int64)
    inner = lanes[:, 1 : n + 1]
    inner[steps.LOAD] = chain.sin_alpha
    for end, force in zip((0, -1), chain.end_forces, strict=True):
        inner[steps.LOAD, end] += nearest_float(force)
    inner[steps.FRICTION] = chain.each("mu_d", chain.times_cosine)
    inner[steps.MU_D], inner[steps.MU_S] = chain.floats("mu_d"), chain.floats("mu_s")
    inner[steps.HELD] = chain.each("mu_s", chain.times_cosine)
    inner[steps.BASE, : n - 1] = state.tensions.astype(np.float64)
    inner[steps.PLACE] = state.displacements.astype(np.float64)
    inner[steps.COEFFICIENT] = coefficients = state.coefficients.astype(np.float64)
    drawn[0, 1 : n + 1] = state.draws
    held = Contacts(chain).thresholds(coefficients, FLOAT64)
    # a contact that acts as mu_d has the friction force as threshold, rounded once
    inner[steps.THRESHOLD] = np.where(coefficients < inner[steps.MU_D], inner[steps.FRICTION], held)
    lanes[steps.CEILING] = math.inf
    inner[steps.CEILING] = inner[steps.THRESHOLD]
    inner[steps.SPRINGS] = 2.0
    inner[steps.SPRINGS, 0] -= 1.0
    inner[steps.SPRINGS, -1] -= 1.0
    now = np.zeros(1, dtype=steps.NOW)
    now["theta"] = _dilation(state)
    return Arrays(
        lanes=lanes,
        drawn=drawn,
        driven=_driven(lanes, chain.rates, chain.floats("expansion")),
        movers=np.zeros(n + 1, dtype=np.int64),
        now=now,
        clusters=np.zeros(n + 2, dtype=np.int64),
        near=np.zeros(n + 2, dtype=np.int64),
        hit=np.zeros(n + 2, dtype=np.int8),
        rows=np.zeros((2 * n + 4096 if keep_events else 0, len(steps.ROW))),
    )


def _dilation(state: State) -> float:
    """Return the dilation of a state; 0 at the beginning of a leg, if springs have their own."""
    return 0.0 if state.springs else float(state.theta)


def _driven(
    lanes: NDArray[np.float64], rates: Mapping[int, Fraction], expansion: NDArray[np.float64]
) -> NDArray[np.int64]:
    """Let theta drive sliders at these rates, and springs; return the sliders that it drives."""
    lanes[[steps.RATE, steps.EXPANSION]] = 0.0
    driven = 1 + np.array(sorted(rates), dtype=np.int64)
    lanes[steps.RATE, driven] = [nearest_float(rates[i - 1]) for i in driven.tolist()]
    lanes[steps.EXPANSION, 1 : 1 + expansion.size] = expansion
    return driven


def _motion(fixed: Constants, arrays: Arrays) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Return tensions, displacements and velocities; not finite if dt was too large."""
    inner, shift = arrays.lanes[:, 1 : fixed.n + 1], arrays.now["shift"][0]
    with np.errstate(invalid="ignore"):
        tensions = inner[steps.BASE] - inner[steps.EXPANSION] * shift
        tensions = tensions[:-1] + np.diff(inner[X])
        return tensions, inner[steps.PLACE] + inner[X], (inner[Y] + 0.5 * inner[B]) / fixed.dt


class VerletSimulation(Simulation):
    """A chain that follows a drive in time steps."""

    def __init__(self, start: Start, record: tuple[str, ...], dt: float, locate: bool) -> None:
        chain, self.start, self.record = start.chain, start.state, record
        self.chain, l0 = chain, nearest_float(chain.l0)
        self.fixed = Constants(
            n=chain.n,
            l0=l0,
            origin=l0 * _dilation(start.state),
            drive=chain.n * chain.sin_alpha + nearest_float(sum(chain.end_forces, Fraction(0))),
            cosine=chain.cos_alpha,
            sigma=nearest_float(chain.sigma_mu),
            seed=np.uint64(start.seed),
            random=chain.sigma_mu != 0,
            runs_away=chain.may_run_away,
            dt=dt,
            locate=locate,
        )
        self.seed = start.seed
        self.arrays = _arrays(start, self.fixed, any(name in record for name in LOGS))
        # for the tables: values at the end of the last rearrangement
        self._theta, self._undecided = _dilation(start.state), 0
        self.leg: Leg | None = None  # if each spring has its own dilation
        self._tensions = start.state.tensions.astype(np.float64)
        self._expansion = chain.floats("expansion")
        self._avalanche: Avalanche | None = None
        if start.unrounded is not None:
            self._go_on(start.unrounded)
            self.arrays.drawn[1] = 0  # slips since the last target

    @property
    def tally(self) -> Tally:  # type: ignore[override]
        return Tally(*(int(self.arrays.now[name][0]) for name in COUNTS[1:6]))

    def follow(self, drive: Drive, first: int, count: int, limits: Limits = NO_LIMITS) -> Stretch:
        targets = drive.targets(first, count, self.seed)
        rows, logs = TargetRows.empty(self.record, count, self.chain.n), list[dict[str, Any]]()
        done, before, ended = 0, self.tally.events, Ending(Stop.DONE)
        while done < count and ended.stop is Stop.DONE:
            begin = self.start.theta if self.leg is None else np.array(self.leg.end)
            if (leg := drive.leg(first + done, begin)) is not None:
                self._take(leg)
                targets = np.ones(1)
            left, ahead = limits.after(self.tally.events - before), rows.part(done)
            reached, logged, ended = self.step_on(left, targets, first + done, ahead)
            done += reached
            logs.append(logged)
            if done < count and ended.stop is Stop.DONE:  # there is another leg
                stop = limits.stop(self.tally.events - before) or Stop.DONE
                ended = Ending(stop, limits.reason(stop))
        return Stretch(done, rows.recorded(self.record, done) | joined(logs), *ended)

    def step_on(
        self, limits: Limits, targets: NDArray[Any] = _NOWHERE, first: int = 0,
        rows: TargetRows = _NO_ROWS,
    ) -> tuple[int, dict[str, NDArray[Any]], Ending]:  # fmt: skip
        """Step to the targets; without targets, until the present rearrangement ends.

        Returns how many were reached, the logged columns, and why it ended.
        """
        done, before, logs = 0, self.tally.events, list[dict[str, NDArray[Any]]]()
        stop: Stop | None = None
        while stop is None:
            budget = before + limits.events_left - self.tally.events
            code, reached = steps.follow(
                self.fixed, self.arrays, targets[done:], first + done, budget, rows.part(done)
            )
            done += reached
            logs.append(self._tables())
            stop, reason = _ENDINGS.get(code, (None, ""))
            stop = stop or limits.stop(self.tally.events - before)
        return done, joined(logs), Ending(stop, reason or limits.reason(stop))

    def _take(self, leg: Leg) -> None:
        """Set out on a leg, unless it is under way: theta is the part of it that is done."""
        now, lanes = self.arrays.now[0], self.arrays.lanes
        if self.leg is not None and now["theta"] != 1.0:
            return
        lanes[steps.BASE] -= lanes[steps.EXPANSION] * now["shift"]
        self._tensions -= self.fixed.l0 * (now["theta"] - self._theta) * self._expansion
        self._set_out(leg)
        now["shift"] = now["theta"] = self._theta = 0.0

    def _set_out(self, leg: Leg) -> None:
        self.leg, self.fixed = leg, self.fixed._replace(origin=0.0)
        self._expansion = np.array([nearest_float(share) for share in leg.expansion(self.chain)])
        driven = _driven(self.arrays.lanes, leg.rates(self.chain), self._expansion)
        self.arrays = self.arrays._replace(driven=driven)

    def come_to_rest(self, limits: Limits) -> dict[str, NDArray[Any]]:
        return {} if self.at_rest else self.step_on(limits)[1]

    def _written(self) -> dict[str, NDArray[Any]]:
        """Return the columns of stored events, and make space for others."""
        now = self.arrays.now[0]
        columns = self.arrays.rows[: now["written"]].T.copy()
        now["written"] = 0
        return dict(zip(steps.ROW, columns, strict=True))

    def _tables(self) -> dict[str, NDArray[Any]]:
        """Return the complete rows of tables, and make space for others."""
        rows = self._written()
        columns = EVENT_TABLE.arrays(rows) if "events" in self.record else {}
        if {"rearrangements", "slip_table"}.isdisjoint(self.record):
            return columns
        slips: list[tuple[Any, ...]] = []
        ended: list[tuple[Avalanche, int]] = []
        moved, drawn = np.zeros((2, self.chain.n))
        k = 0
        for row, event in logged_events(EVENT_TABLE.arrays(rows)):
            if row.number == 0:
                self._end(ended)
                self._tensions -= self.fixed.l0 * (row.theta - self._theta) * self._expansion
                self._theta, way = row.theta, rows["way"][k]
                ramp = {"half_cycle": row.half_cycle, "theta": row.theta, "direction": way}
                self._avalanche = Avalanche(self.chain, FLOAT64, ramp, self._tensions.copy())
            assert self._avalanche is not None
            of_event = slice(k, k + len(event.sliders))
            sliders = rows["slider"][of_event].astype(int) - 1
            moved[sliders], drawn[sliders] = rows["moved"][of_event], rows["coefficient"][of_event]
            slips += self._avalanche.take(event, row.rearrangement, moved, drawn.__getitem__)
            self._settled = int(rows["undecided"][of_event].max())
            k = of_event.stop
        if self.arrays.now["phase"][0] != steps.MOVING:
            self._end(ended)
        made = {"rearrangements": rearrangement_rows(ended), "slip_table": slips}
        asked = (name for name in made if name in self.record)
        return columns | joined([LOGS[name].from_rows(made[name]) for name in asked])

    def _end(self, ended: list[tuple[Avalanche, int]]) -> None:
        """Add the present rearrangement, if it has ended, with its number of undecided."""
        if self._avalanche is not None:
            self._tensions += np.diff(self._avalanche.moved)
            ended.append((self._avalanche, self._settled - self._undecided))
            self._undecided, self._avalanche = self._settled, None

    def state(self) -> State:
        tensions, places, _ = _motion(self.fixed, self.arrays)
        inner = slice(1, self.fixed.n + 1)
        coefficients = self.arrays.lanes[steps.COEFFICIENT, inner].copy()
        theta: Any = float(self.arrays.now["theta"][0])
        if self.leg is not None:
            theta = np.array(self.leg.at(theta, nearest_float))
        return State(tensions, places, coefficients, self.arrays.drawn[0, inner].copy(), theta)

    def velocities(self) -> NDArray[np.float64]:
        """Return the present velocities."""
        return _motion(self.fixed, self.arrays)[2]

    @property
    def at_rest(self) -> bool:
        return bool(self.arrays.now["phase"][0] == steps.AT_REST)

    def unrounded(self) -> dict[str, Any] | None:
        under_way = self.leg is not None and self.arrays.now["theta"][0] != 1.0
        return None if under_way else self._unrounded()

    def _unrounded(self) -> dict[str, Any]:
        now = self.arrays.now[0]
        return {
            "numbers": self.arrays.lanes[list(AT_REST_ROWS)],  # a copy
            "drawn": self.arrays.drawn.copy(),
            "theta": np.array([now["shift"], now["theta"], self._theta, self.fixed.origin]),
            "tensions": self._tensions.copy(),
            "leg": Leg.kept(self.leg),
        }

    def snapshot(self) -> dict[str, Any]:
        counts = np.array([*self.arrays.now[0][list(COUNTS)].item(), self._undecided])
        return {"unrounded": self._unrounded(), "counts": counts}

    def restore(self, snapshot: Mapping[str, Any]) -> None:
        require_like(self.snapshot(), snapshot)
        self._go_on(snapshot["unrounded"])
        *counts, self._undecided = snapshot["counts"].tolist()
        for name, count in zip(COUNTS, counts, strict=True):
            self.arrays.now[0][name] = count

    def _go_on(self, taken: Mapping[str, Any]) -> None:
        require_like(self._unrounded(), taken)
        leg = Leg.restored(taken["leg"], self.chain)
        if leg is not None:
            self._set_out(leg)
        lanes, now = self.arrays.lanes, self.arrays.now
        lanes[list(AT_REST_ROWS)], self.arrays.drawn[:] = taken["numbers"], taken["drawn"]
        now["shift"], now["theta"], self._theta, origin = taken["theta"]
        self.fixed = self.fixed._replace(origin=float(origin))
        now["phase"] = steps.AT_REST
        self._tensions = taken["tensions"].copy()
        inner = lanes[:, 1 : self.fixed.n + 1]
        inner[steps.CEILING] = inner[steps.THRESHOLD]

    def report(self) -> dict[str, Any]:
        """Return the time step, how events are found, and the number of steps."""
        taken = int(self.arrays.now["steps"][0])
        return {"dt": self.fixed.dt, "locate": self.fixed.locate, "steps": taken}


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
    Source: section Numerical method. Guarantee: none. As long as the itinerary is right, the error
    of a rearrangement is O(dt) across events (O(dt**2) with `locate`). It never judges what its
    step misses: `computed` says only that no comparison was undecided at this step. Where chains
    amplify errors, a displacement of a few units may be off by one. A run with a smaller `dt`, or
    `exact`, tells.
    """

    dt: Any = field(default=0.01)
    locate: bool = False
    takes: ClassVar[frozenset[str]] = EVERYTHING
    name: ClassVar[str] = "verlet"
    summary: ClassVar[str] = "velocity Verlet with a fixed time step dt, the paper's own method"

    def __post_init__(self) -> None:
        dt = nearest_float(exact_number(self.dt, "dt"))
        if not (dt > 0.0 and dt * dt > 0.0 and math.isfinite(dt * dt)):
            allowed = "must be a positive time step, unit tau_dyn, whose square is a float64"
            raise InputError("dt", self.dt, allowed)
        remark("steps", 1 / dt)
        object.__setattr__(self, "dt", dt)
        if not isinstance(self.locate, (bool, np.bool_)):
            raise InputError("locate", self.locate, "must be true or false")

    def simulation_from(self, start: Start, record: tuple[str, ...]) -> VerletSimulation:
        """Return a simulation that steps in time."""
        return VerletSimulation(start, record, self.dt, bool(self.locate))

    def rearrange_from(self, start: Start, direction: int, limits: Limits) -> Rearrangement:
        """Rearrange in time steps; `Replay` gives the motion between the events."""
        simulation = self.simulation_from(start, ("events",))
        fixed, arrays = simulation.fixed, simulation.arrays
        now = arrays.now[0]
        steps.release(fixed, arrays)
        if now["phase"] == steps.AT_REST and direction != 0:
            steps.ramp(fixed, arrays, float(direction), math.inf)
        present = simulation.state()
        initial = replace(start.state, tensions=present.tensions, theta=present.theta)
        _, logged, ended = simulation.step_on(limits.after(simulation.tally.events))
        return Rearrangement.of(
            simulation,
            self.name,
            ended,
            initial=initial,
            events=tuple(event for _, event in logged_events(logged)),
            report=simulation.report(),
        )
