"""The solver called "verlet": the paper's own method with a fixed time step, as a witness.

Velocity Verlet moves the sliders. At the end of every step the velocities are tested for stops, and
the resting neighbours for starts. It shares only the chain's parameters and the draws with the
other solvers, and has its own rules for starts, stops and ties. An event is noticed at the end of
its step, an error of first order in `dt`; with ``locate=True`` bisection finds it inside the step,
which restores the second order. The steps are in `steps`. It never judges itself: its evidence is
undecided from the start.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.drive import Leg
from exactcreep.model.numbers import InputError, exact_number, nearest_float
from exactcreep.model.outcome import Evidence
from exactcreep.model.remarks import remark
from exactcreep.model.state import State
from exactcreep.model.uniform import EVERYTHING
from exactcreep.motion.runaway import NEVER_STOPS
from exactcreep.solvers import tables
from exactcreep.solvers.avalanche_table import AvalancheLog
from exactcreep.solvers.interface import Simulation, Solver, Start, Stretch, Tally, require_like
from exactcreep.solvers.rearrangement import Ending, Rearrangement
from exactcreep.solvers.verlet import steps
from exactcreep.watch.limits import NO_LIMITS, Limits, Stop

_TOO_LONG = "a rearrangement did not end within 1e9 steps; change dt"
_INFINITE = "the motion grew beyond the largest float; dt is too large (above 1 it is unstable)"


class VerletSimulation(Simulation):
    """A chain that follows a drive in time steps."""

    evidence = Evidence.UNDECIDED  # nothing tells what a step misses

    def __init__(self, start: Start, record: tuple[str, ...], dt: float, locate: bool) -> None:
        chain, state = start.chain, start.state
        self.chain, self.seed, self.record = chain, start.seed, record
        self.numbers = np.zeros((len(steps.Sliders._fields), chain.n + 2))
        self.all, mine = steps.Sliders(*self.numbers), steps.Sliders(*self.numbers[:, 1:-1])
        self.inner, self.now = mine, np.zeros(1, steps.NOW)
        rows = 2 * chain.n + 4096 if any(name in record for name in tables.LOGS) else 0
        self.log = np.zeros((rows, steps.COLUMNS))
        self.leg: Leg | None = None  # if each spring has its own dilation
        self._given, self.avalanches = state.theta, AvalancheLog(chain, record)
        now = self.now[0]
        now["n"], now["l0"], now["cosine"] = chain.n, nearest_float(chain.l0), chain.cos_alpha
        now["sigma"], now["seed"] = nearest_float(chain.sigma_mu), start.seed
        now["dt"], now["locate"], now["one_by_one"] = dt, locate, {*record} - {"x_G"} != set()
        now["theta"] = 0.0 if state.springs else float(state.theta)
        mine.springs[1:] += 1.0  # above
        mine.springs[:-1] += 1.0  # below
        mine.load[:] = State.relaxed(chain).forces(chain)
        mine.mu_d[:], mine.mu_s[:] = chain.floats("mu_d"), chain.floats("mu_s")
        mine.expansion[:-1], mine.tension[:-1] = chain.floats("expansion"), state.tensions
        mine.place[:], mine.draws[:] = state.displacements, state.draws
        mine.coefficient[:], mine.friction[:] = state.coefficients, mine.mu_d * chain.cos_alpha
        self._begin()

    def _begin(self) -> None:
        """Begin at rest, with the present coefficients and tensions."""
        mine = self.inner
        mine.threshold[:] = np.maximum(mine.coefficient, mine.mu_d) * self.chain.cos_alpha
        steps.rest(self.all, self.now[0], 0.0)

    @property
    def tally(self) -> Tally:  # type: ignore[override]
        return Tally(**{name: int(self.now[name][0]) for name in steps.COUNTS})

    def follow(self, drive: Any, first: int, count: int, limits: Limits = NO_LIMITS) -> Stretch:
        """Step to the targets; without a drive, until the present rearrangement ends."""
        before, done, logs = self.tally.events, 0, list[dict[str, NDArray[Any]]]()
        rows = tables.TargetRows.empty(self.record, count, self.chain.n)
        targets = np.empty(0) if drive is None else drive.targets(first, count, self.seed)
        ended: Ending | None = None
        while ended is None:
            ahead = targets[done:]
            if done < count and drive and (leg := drive.leg(first + done, self._given)):
                self._take(leg)
                ahead = np.ones(1)
            last, x_G = before + limits.events_left, rows.x_G[done:]
            reached = steps.follow(self.all, self.now, self.log, ahead, first + done, last, x_G)
            logs.append(self._tables())
            if reached and self.now["one_by_one"][0]:
                now = self.inner.place, self.inner.tension, self.inner.slips
                for table, values in zip(rows[1:], now, strict=True):
                    table[done : done + 1] = values[: table.shape[1]]
                self.inner.slips[:] = 0
            done += reached
            arrived = done == count and self.at_rest
            ended = Ending(Stop.DONE) if arrived else self._ending(limits, before)
        return Stretch(done, rows.recorded(self.record, done) | tables.joined(logs), *ended)

    def _ending(self, limits: Limits, before: int) -> Ending | None:
        """Return why the chain does not reach another target, or None."""
        tensions, _, velocities = self._motion()
        if not (np.isfinite(tensions).all() and np.isfinite(velocities).all()):
            return Ending(Stop.LIMIT, _INFINITE)
        if self.now["time"][0] >= 1e9 * self.now["dt"][0]:
            return Ending(Stop.LIMIT, _TOO_LONG)
        # all sliders move down, and the internal motion has not the energy to stop any of them
        n, way = self.chain.n, self.chain.heading
        mean = velocities.mean()
        energy = ((velocities - mean) ** 2).sum() + (tensions**2).sum()
        forever = self.chain.may_run_away and (way * velocities > 0).all()
        if forever and way * mean > math.sqrt((1 - 1 / n) * energy):
            return Ending(Stop.RUNAWAY, NEVER_STOPS)
        stop = limits.stop(self.tally.events - before)
        return None if stop is None else Ending(stop, limits.reason(stop))

    def _take(self, leg: Leg) -> None:
        """Set out on a leg, unless it is under way: theta is the part of it that is done."""
        if self.leg is None or self.now["theta"][0] == 1.0:
            begin = tuple(Fraction(nearest_float(theta)) for theta in leg.begin)  # as in a state
            self.now["theta"] = 0.0
            self._set_out(replace(leg, begin=begin))

    def _set_out(self, leg: Leg | None) -> None:
        self.leg = leg
        if leg is not None:
            self.inner.expansion[:-1] = [*map(nearest_float, leg.expansion(self.chain))]

    def come_to_rest(self, limits: Limits) -> Mapping[str, NDArray[Any]]:
        return {} if self.at_rest else self.follow(None, 1, 0, limits).recorded

    def _tables(self) -> dict[str, NDArray[Any]]:
        """Return the rows of tables since the last call."""
        logged = self.log[: self.now["written"][0]].tolist()
        self.now["written"], events = 0, [tables.EventRow._make(row[:8]) for row in logged]
        for event, row in zip(events, logged, strict=True):
            self.avalanches.take(event, self.inner.tension[:-1].copy, *row[8:])
        if not self.now["movers"][0]:
            self.avalanches.rest(lambda: self._motion()[0], 0)
        made = {"events": events} | self.avalanches.tables()
        self.avalanches.forget()
        kept = {name: made[name] for name in tables.LOGS if name in self.record}
        return tables.record_arrays(kept, 1)

    def _motion(self) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
        """Return tensions, displacements and velocities; not finite if dt was too large."""
        s = self.inner
        with np.errstate(invalid="ignore", over="ignore"):
            velocities = (s.w + 0.5 * s.b) / self.now["dt"][0]
            return s.tension[:-1] + np.diff(s.x), s.place + s.x, velocities

    def state(self) -> State:
        tensions, places, _ = self._motion()
        theta = self._given if isinstance(self._given, np.ndarray) else self.now["theta"].item()
        if self.leg is not None:
            theta = np.array(self.leg.at(self.now["theta"].item(), nearest_float))
        return State(tensions, places, self.inner.coefficient, self.inner.draws, theta)

    def velocities(self) -> NDArray[np.float64]:
        """Return the present velocities."""
        return self._motion()[2]

    @property
    def at_rest(self) -> bool:
        return bool(self.now["phase"][0] == steps.AT_REST)

    def snapshot(self) -> dict[str, Any]:
        rows = {name: getattr(self.inner, name).copy() for name in steps.AT_REST_ROWS}
        now = {name: self.now[name].item() for name in steps.AT_REST_NOW}
        return {"now": now, "leg": Leg.kept(self.leg)} | rows

    def restore(self, snapshot: Mapping[str, Any]) -> None:
        require_like(self.snapshot(), snapshot)
        self._set_out(Leg.restored(snapshot["leg"], self.chain))
        for name in steps.AT_REST_ROWS:
            getattr(self.inner, name)[:] = snapshot[name]
        self.inner.tension[-1] = 0.0
        for name, value in snapshot["now"].items():
            self.now[name] = value
        self.now["phase"] = steps.AT_REST
        self._begin()

    def report(self) -> dict[str, Any]:
        """Return the time step, how events are found, and the number of steps."""
        dt, locate, taken = self.now[["dt", "locate", "steps"]][0].item()
        return {"dt": dt, "locate": bool(locate), "steps": taken}


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
    step misses: its evidence is `undecided`, and its trajectory is known up to no target. Where
    chains amplify errors, a displacement of a few units may be off by one. `compare` measures it.
    """

    dt: Any = 0.01
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
        steps.release(simulation.all, simulation.now[0], simulation.log, float(direction))
        present = simulation.state()
        initial = replace(start.state, tensions=present.tensions, theta=present.theta)
        moved = simulation.follow(None, 1, 0, limits.after(simulation.tally.events))
        events = tuple(event for _, event in tables.logged_events(moved.recorded))
        about = {"initial": initial, "events": events, "report": simulation.report()}
        ended, decided = Ending(moved.stop, moved.reason), simulation.evidence
        return Rearrangement.of(simulation, self.name, ended, decided=decided, **about)
