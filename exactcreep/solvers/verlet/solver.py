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
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.drive import Drive, Leg
from exactcreep.model.numbers import InputError, exact_number, nearest_float
from exactcreep.model.outcome import Evidence
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
from exactcreep.watch.limits import NO_LIMITS, Limits, Stop

_MOST_STEPS = 10**9
_TOO_LONG = f"a rearrangement did not end within {_MOST_STEPS:.0e} steps; change dt"
_INFINITE = "the motion grew beyond the largest float; dt is too large (above 1 it is unstable)"
_NO_ROWS = TargetRows.empty((), 0, 1)


class VerletSimulation(Simulation):
    """A chain that follows a drive in time steps."""

    def __init__(self, start: Start, record: tuple[str, ...], dt: float, locate: bool) -> None:
        chain, state = start.chain, start.state
        self.chain, self.seed, self.record = chain, start.seed, record
        n, cosine, (first, last) = chain.n, chain.cos_alpha, chain.end_forces
        self.all = steps.Sliders(
            *np.zeros((len(steps.REALS), n + 2)), *np.zeros((2, n + 2), np.int64)
        )
        self.inner = {name: array[1:-1] for name, array in self.all._asdict().items()}
        self.now, mine = np.zeros(1, steps.NOW), self.inner
        rows = 2 * n + 4096 if any(name in record for name in LOGS) else 0
        self.log = np.zeros((rows, len(steps.ROW)))
        self.leg: Leg | None = None  # if each spring has its own dilation
        self._given = state.theta
        self._avalanche: Avalanche | None = None
        constants = {
            "n": n, "l0": nearest_float(chain.l0), "cosine": cosine, "seed": start.seed,
            "sigma": nearest_float(chain.sigma_mu), "dt": dt, "locate": locate,
            "one_by_one": any(name != "x_G" for name in record),
            "theta": 0.0 if state.springs else float(state.theta),
        }  # fmt: skip
        for name, value in constants.items():
            self.now[name] = value
        mine["springs"][:], mine["load"][:] = 2.0, chain.sin_alpha
        for end, force in ((0, first), (-1, last)):
            mine["springs"][end] -= 1.0
            mine["load"][end] += nearest_float(force)
        for name in ("mu_d", "mu_s", "expansion"):
            mine[name][: n - (name == "expansion")] = chain.floats(name)
        mine["tension"][:-1], mine["place"][:] = state.tensions, state.displacements
        mine["coefficient"][:], mine["draws"][:] = state.coefficients, state.draws
        mine["friction"][:] = mine["mu_d"] * cosine
        self._begin()

    def _begin(self) -> None:
        """Begin at rest, with the present coefficients and tensions."""
        mine = self.inner
        mine["threshold"][:] = np.maximum(mine["coefficient"], mine["mu_d"]) * self.chain.cos_alpha
        steps.rest(self.all, self.now[0], 0.0)

    @property
    def tally(self) -> Tally:  # type: ignore[override]
        counts = {name: int(self.now[name][0]) for name in steps.COUNTS}
        counts["rearrangements"] += int(self.now["phase"][0] == steps.MOVING)
        return Tally(**counts)

    @property
    def evidence(self) -> Evidence:
        return Evidence.UNDECIDED  # what a step misses is not known

    def follow(self, drive: Drive, first: int, count: int, limits: Limits = NO_LIMITS) -> Stretch:
        rows = TargetRows.empty(self.record, count, self.chain.n)
        done, logs, ended = self.step_on(limits, drive, first, count, rows)
        return Stretch(done, rows.recorded(self.record, done) | logs, *ended)

    def step_on(
        self, limits: Limits, drive: Drive | None = None, first: int = 1, count: int = 0,
        rows: TargetRows = _NO_ROWS,
    ) -> tuple[int, dict[str, NDArray[Any]], Ending]:  # fmt: skip
        """Step to the targets; without targets, until the present rearrangement ends.

        Returns how many were reached, the logged columns, and why it ended.
        """
        before, logs, done = self.tally.events, list[dict[str, NDArray[Any]]](), 0
        targets = np.empty(0) if drive is None else drive.targets(first, count, self.seed)
        last = before + limits.events_left
        while True:
            ahead = targets[done:]
            if done < count and drive and (leg := drive.leg(first + done, self._given)):
                self._take(leg)
                ahead = np.ones(1)
            reached = steps.follow(
                self.all, self.now, self.log, ahead, first + done, last, rows.x_G[done:]
            )
            logs.append(self._tables())
            if reached and self.now["one_by_one"][0]:
                for name, of in (("x", "place"), ("tension", "tension"), ("slips", "slips")):
                    row = getattr(rows, name)[done : done + 1]
                    row[:] = self.inner[of][: row.shape[1]]
                self.inner["slips"][:] = 0
            done += reached
            ended = self._ending(limits, self.tally.events - before)
            if done == count and self.at_rest:
                ended = Ending(Stop.DONE)
            if ended is not None:
                return done, joined(logs), ended

    def _ending(self, limits: Limits, events: int) -> Ending | None:
        """Return why the chain does not reach another target, or None."""
        tensions, _, velocities = self._motion()
        if not (np.isfinite(tensions).all() and np.isfinite(velocities).all()):
            return Ending(Stop.LIMIT, _INFINITE)
        if self.now["steps"][0] - self.now["begun"][0] >= _MOST_STEPS:
            return Ending(Stop.LIMIT, _TOO_LONG)
        # all sliders move down, and the internal motion has not the energy to stop any of them
        n, way = self.chain.n, self.chain.heading
        mean = velocities.mean()
        energy = ((velocities - mean) ** 2).sum() + (tensions**2).sum()
        forever = self.chain.may_run_away and (way * velocities > 0).all()
        if forever and way * mean > math.sqrt((1 - 1 / n) * energy):
            return Ending(Stop.RUNAWAY, NEVER_STOPS)
        stop = limits.stop(events)
        return None if stop is None else Ending(stop, limits.reason(stop))

    def _take(self, leg: Leg) -> None:
        """Set out on a leg, unless it is under way: theta is the part of it that is done."""
        if self.leg is not None and self.now["theta"][0] != 1.0:
            return
        begin = tuple(Fraction(nearest_float(theta)) for theta in leg.begin)  # as in a state
        self.now["theta"] = 0.0
        self._set_out(replace(leg, begin=begin))

    def _set_out(self, leg: Leg | None) -> None:
        self.leg = leg
        if leg is not None:
            self.inner["expansion"][:-1] = [*map(nearest_float, leg.expansion(self.chain))]

    def come_to_rest(self, limits: Limits) -> dict[str, NDArray[Any]]:
        return {} if self.at_rest else self.step_on(limits)[1]

    def _tables(self) -> dict[str, NDArray[Any]]:
        """Return the rows of tables since the last call."""
        columns = self.log[: self.now["written"][0]].T.copy()
        self.now["written"] = 0
        rows = dict(zip(steps.ROW, columns, strict=True))
        tables = EVENT_TABLE.arrays(rows) if "events" in self.record else {}
        if {"rearrangements", "slip_table"}.isdisjoint(self.record):
            return tables
        slips, rests, k = list[tuple[Any, ...]](), list[tuple[Any, ...]](), 0
        moved, drawn = np.zeros((2, self.chain.n))
        for row, event in logged_events(EVENT_TABLE.arrays(rows)):
            if row.number == 0:
                way = rows["way"][k]
                ramp = {"half_cycle": row.half_cycle, "theta": row.theta, "direction": way}
                tensions = self.inner["tension"][:-1].copy()
                self._avalanche = Avalanche(self.chain, FLOAT64, ramp, tensions)
            assert self._avalanche is not None
            of_event = slice(k, k + len(event.sliders))
            sliders = rows["slider"][of_event].astype(int) - 1
            moved[sliders], drawn[sliders] = rows["moved"][of_event], rows["coefficient"][of_event]
            slips += self._avalanche.take(event, row.rearrangement, moved, drawn.__getitem__)
            k = of_event.stop
        if self._avalanche is not None and not self.now["movers"][0]:
            rests, self._avalanche = rearrangement_rows([(self._avalanche, 0)]), None
        for name, made in (("rearrangements", rests), ("slip_table", slips)):
            tables |= LOGS[name].from_rows(made) if name in self.record else {}
        return tables

    def _motion(self) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
        """Return tensions, displacements and velocities; not finite if dt was too large."""
        s = self.inner
        with np.errstate(invalid="ignore", over="ignore"):
            velocities = (s["w"] + 0.5 * s["b"]) / self.now["dt"][0]
            return s["tension"][:-1] + np.diff(s["x"]), s["place"] + s["x"], velocities

    def state(self) -> State:
        tensions, places, _ = self._motion()
        theta: Any = float(self.now["theta"][0])
        if self.leg is not None:
            theta = np.array(self.leg.at(theta, nearest_float))
        elif isinstance(self._given, np.ndarray):
            theta = self._given
        return State(tensions, places, self.inner["coefficient"], self.inner["draws"], theta)

    def velocities(self) -> NDArray[np.float64]:
        """Return the present velocities."""
        return self._motion()[2]

    @property
    def at_rest(self) -> bool:
        return bool(self.now["phase"][0] == steps.AT_REST)

    def snapshot(self) -> dict[str, Any]:
        numbers = {name: self.inner[name].copy() for name in steps.AT_REST_ROWS}
        now = {name: self.now[name].item() for name in steps.AT_REST_NOW}
        return {"now": now, "leg": Leg.kept(self.leg)} | numbers

    def restore(self, snapshot: Mapping[str, Any]) -> None:
        require_like(self.snapshot(), snapshot)
        self._set_out(Leg.restored(snapshot["leg"], self.chain))
        for name in steps.AT_REST_ROWS:
            self.inner[name][:] = snapshot[name]
        self.inner["tension"][-1] = 0.0
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
        kernel = simulation.all, simulation.now[0], simulation.log
        steps.release(*kernel)
        if simulation.at_rest and direction != 0:
            steps.ramp(*kernel, float(direction), math.inf)
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
            decided=simulation.evidence,
        )
