"""The solver called "exact": float64, compiled, from event to event; see `loop` for its loop."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles, Drive, Leg
from exactcreep.model.numbers import nearest_float
from exactcreep.model.outcome import Evidence
from exactcreep.model.state import State, owning
from exactcreep.model.targets import Targets
from exactcreep.model.uniform import EVERYTHING
from exactcreep.motion.runaway import NEVER_STOPS
from exactcreep.solvers import tables
from exactcreep.solvers.avalanche_table import rearrangements_of, slips_of
from exactcreep.solvers.exact import layout, local_clocks, loop
from exactcreep.solvers.exact.double_double import split, two_product
from exactcreep.solvers.exact.estimated import Estimated
from exactcreep.solvers.exact.layout import MOST_WORK, PAD
from exactcreep.solvers.exact.pack import (
    Origin,
    Workspace,
    at_rest,
    dilation,
    go_on,
    placed,
    series_of,
    turn,
)
from exactcreep.solvers.exact.rows import NOTHING, AtTargets
from exactcreep.solvers.interface import (
    LONGEST_AVALANCHE,
    Simulation,
    Solver,
    Start,
    Stretch,
    Tally,
    require_at_rest,
    require_like,
)
from exactcreep.solvers.rearrangement import Ending, Rearrangement
from exactcreep.watch.limits import NO_LIMITS, Limits, Stop

_GOES_ON = (layout.BUDGET, layout.LOG_FULL)
_USED: dict[int, list[Workspace]] = {}
"""Reusable arrays by length of short chains, as many as were used at the same time."""
_ENDLESS = (
    f"an avalanche has neither ended nor been proved to run away after {LONGEST_AVALANCHE}"
    " events, or steps without one; at tan_alpha = mu_d it may go on for ever"
)
_ENDINGS = {
    layout.RUNAWAY: Ending(Stop.RUNAWAY, NEVER_STOPS),
    layout.ENDLESS: Ending(Stop.LIMIT, _ENDLESS),
}


class ExactSimulation(Simulation):
    """A chain that follows a drive event by event; see `Exact`."""

    def __init__(
        self,
        chain: Chain,
        state: State,
        seed: int,
        record: tuple[str, ...] = ("x_G",),
        used: Workspace | None = None,
        unrounded: Mapping[str, Any] | None = None,
    ) -> None:
        self.chain = chain
        self.record = record
        self.seed = seed
        self.origin = self.start = Origin.of(chain, state)
        self.leg: Leg | None = None  # if each spring has a dilation of its own
        self.work = placed(
            chain, self.origin, seed, not tables.LOGS.keys().isdisjoint(record), used
        )
        if unrounded is not None:
            self._go_on(unrounded)
            self.work.cell[layout.DOUBTED] = self.work.whole[layout.SLIPS] = 0
        self._under_way = self.work.log[:0]  # rows of the present rearrangement
        self._undecided = 0  # comparisons up to the last rest

    @property
    def _present(self) -> Workspace:
        """The arrays with all sliders at the present time."""
        work = self.work
        if work.clock is None or not work.now["epoch"]["on"][0]:
            return work
        present = work._replace(cell=work.cell.copy(), now=work.now.copy())
        local_clocks.at_once(present.cell, work.clock.copy(), present.now[0])
        return present

    def cell(self, row: int) -> NDArray[np.float64]:
        """Return a row of `layout`'s cells at the present time, shape (n,)."""
        return self._present.cell[row, self._own]

    @property
    def _own(self) -> slice:
        return slice(PAD, PAD + self.chain.n)

    @property
    def tally(self) -> Tally:  # type: ignore[override]
        """Counts since the start."""
        return Tally(*self.work.now["counts"][0].item()[: len(layout.TALLY)])

    @property
    def events(self) -> int:
        """The events since the start."""
        return int(self.work.now["counts"]["events"][0])

    def targets(
        self, drive: Drive, first: int, count: int, seed: int = 0
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return ``l0 theta`` of the targets as two arrays of floats."""
        if isinstance(drive, Cycles):
            high, low = split(self.chain.l0 * drive.amplitude)
            way = np.ones(count)
            way[first % 2 :: 2] = -1.0  # odd targets are warm
            return way * high, way * low
        if drive.springs:  # to the end of each leg
            full = np.tile(split(self.chain.l0), (count, 1))
            return full[:, 0], full[:, 1]
        if isinstance(drive, Targets):  # the bits of Cycles with the same targets
            listed = drive.theta[first - 1 : first - 1 + count]
            highs, lows = np.array([split(self.chain.l0 * theta) for theta in listed]).T.copy()
            return highs, lows
        theta = drive.targets(first, count, seed)
        l0, l0_low = split(self.chain.l0)
        product, error = two_product(l0, theta)
        return product, error + l0_low * theta

    def follow(self, drive: Drive, first: int, count: int, limits: Limits = NO_LIMITS) -> Stretch:
        """Take the chain to targets `first` .. `first + count - 1`; see `Simulation.follow`."""
        high, low = self.targets(drive, first, count, self.seed)
        self.work.now["counts"]["target"], self.work.now["single"] = first, 0
        targets = AtTargets.of(count, self.record, self.origin.began)
        logs = [tables.record_arrays({name: ()}, 1) for name in self.record if name in tables.LOGS]
        before = self.events
        done, ended = 0, Ending(Stop.DONE)
        while done < count:
            left = before + limits.events_left - self.events
            self._room_for_more()
            until = count
            begin = self.start.state.theta if self.leg is None else np.array(self.leg.end)
            leg = drive.leg(first + done, begin)
            if leg is not None:
                self._take(leg)
                until, targets = done + 1, targets._replace(began=self.origin.began)
            reason, reached = loop.follow(
                *self.work, high[done:until], low[done:until], targets, done, left, MOST_WORK
            )
            done += reached
            if logs:
                logs.append(self._drain_tables())
            if reason in _ENDINGS:
                ended = _ENDINGS[reason]
                break
            if done < count and (stop := limits.stop(self.events - before)) is not None:
                ended = Ending(stop, limits.reason(stop))
                break
        recorded = targets.rows.recorded(self.record, done) | tables.joined(logs)
        doubts, low = targets.doubts[:done], targets.x_G_low[:done]
        return Stretch(done, recorded, *ended, doubts=doubts, x_G_low=low)

    def _take(self, leg: Leg) -> None:
        """Set out on a leg, unless it has already begun."""
        if self.leg is None or self.load() == split(self.chain.l0):
            turn(self.chain, leg, self.work)
            self.leg, self.origin = leg, self.start.at_leg(self.chain, leg)

    def _room_for_more(self) -> None:
        """Prepare for several sliders that move together, if they do."""
        if self.work.series is None and self.work.now["stage"][0] == layout.CLUSTER:
            self.work = self.work._replace(series=series_of(self.chain.n))

    def single(
        self, direction: int, limits: Limits, drain: Callable[[], Any]
    ) -> tuple[list[Any], Ending]:
        """Rearrange at the present theta, else after a ramp.

        Returns what `drain` has taken from the log, part by part, and why the chain stopped.
        """
        high, low = self.load()
        if direction != 0 and self.chain.rates:  # else no force depends on theta
            high, low = np.inf * direction, 0.0
        target = np.array([high]), np.array([low]), NOTHING
        before, parts = self.events, list[Any]()
        while True:
            self._room_for_more()
            self.work.now["single"] = 1
            left = before + limits.events_left - self.events
            reason, _ = loop.follow(*self.work, *target, 0, left, MOST_WORK)
            parts.append(drain())
            if reason not in _GOES_ON:
                return parts, _ENDINGS.get(reason, Ending(Stop.DONE))
            if (stop := limits.stop(self.events - before)) is not None:
                return parts, Ending(stop, limits.reason(stop))

    def drain(self) -> NDArray[Any]:
        """Return the rows of the log, and empty it."""
        count = int(self.work.now["logged"].item())
        self.work.now["logged"] = 0
        return _stacked([self.work.log[:count]])

    def _drain_tables(self) -> dict[str, NDArray[Any]]:
        """Return all logged columns, and empty the log."""
        logged, columns = self.drain(), dict[str, NDArray[Any]]()
        if len(logged) and "events" in self.record:
            columns |= tables.EVENT_TABLE.arrays(self._events(logged))
        if {"rearrangements", "slip_table"}.isdisjoint(self.record):
            return columns
        told = int((self._under_way["kind"] == layout.STOP).sum())
        rows = _stacked([self._under_way, logged])
        rests = np.flatnonzero(rows["kind"] == layout.REST_ROW)
        self._under_way = rows[rests[-1] + 1 :] if rests.size else rows
        if "slip_table" in self.record:
            slips = slips_of(self._events(rows))
            columns |= tables.SLIP_TABLE.arrays({name: slips[name][told:] for name in slips})
        if rests.size and "rearrangements" in self.record:
            undecided = rows["undecided"][rests]
            about = {
                "elastic_before": rows["elastic"][rests - 1],
                "elastic_after": rows["elastic"][rests],
                "undecided": np.diff(undecided, prepend=self._undecided),
            }
            self._undecided = int(undecided[-1])
            made = rearrangements_of(self._events(rows[: rests[-1]]), about, self.chain)
            columns |= tables.REARRANGEMENT_TABLE.arrays(made)
        return columns

    def _events(self, rows: NDArray[Any]) -> NDArray[Any]:
        """Return the events of some rows, with theta."""
        events: NDArray[Any] = rows[rows["kind"] != layout.REST_ROW]
        events["theta"] = (events["theta"] + events["theta_low"]) / nearest_float(self.chain.l0)
        return events

    def load(self) -> tuple[float, float]:
        """Return ``l0 theta`` at present, as two floats."""
        now = self.work.now
        return now["theta"].item(), now["theta_low"].item()

    def state(self) -> State:
        """Return the present state."""
        theta: Any = dilation(self.chain, self.load())
        if self.leg is not None:
            theta = np.array(self.leg.at(theta, nearest_float))
        return owning(theta, *self.origin.read(self._present))

    def velocities(self) -> NDArray[np.float64]:
        """Return the present velocities."""
        if self.at_rest:
            return np.zeros(self.chain.n)
        return self.cell(layout.SPEED) * self.cell(layout.SIDE)

    @property
    def at_rest(self) -> bool:
        """Whether no slider moves or is about to start."""
        return bool(self.work.now["stage"][0] == layout.AT_REST)

    def come_to_rest(self, limits: Limits) -> dict[str, NDArray[Any]]:
        """Let the present rearrangement end, if the limits allow it; return its log."""
        if self.at_rest:
            return {}
        return tables.joined(self.single(0, limits, self._drain_tables)[0])

    def unrounded(self) -> dict[str, Any] | None:
        """Return both floats of every sum; see `Simulation.unrounded`.

        A displacement counts from the first start, which is part of these numbers. On a leg there
        are none before its end, where another drive would begin another leg.
        """
        if self.leg is not None and self.load() != split(self.chain.l0):
            return None
        return self._unrounded()

    def _unrounded(self) -> dict[str, Any]:
        return {"rest": at_rest(self.work), "origin": self.start.kept(), "leg": Leg.kept(self.leg)}

    def _go_on(self, kept: Mapping[str, Any]) -> None:
        """Go on at rest from unrounded numbers."""
        require_like(self._unrounded(), kept)
        leg = Leg.restored(kept["leg"], self.chain)
        go_on(self.work, kept["rest"])
        self._under_way = self.work.log[:0]
        self.origin = self.start = self.start.went_on(kept["origin"])
        if leg is not None:
            self.work.now["chain"]["even"] = 0
            self.leg, self.origin = leg, self.start.at_leg(self.chain, leg)

    def snapshot(self) -> dict[str, Any]:
        """Return a snapshot at rest; see `Simulation.snapshot`."""
        counts = self.work.now["counts"].view(np.int64).copy()
        return {"unrounded": self._unrounded(), "counts": counts, "undecided": self._undecided}

    def restore(self, snapshot: Mapping[str, Any]) -> None:
        """Continue from a snapshot; see `Simulation.restore`."""
        require_like(self.snapshot(), snapshot)
        self._go_on(snapshot["unrounded"])
        self.work.now["counts"].view(np.int64)[:] = snapshot["counts"]
        self._undecided = snapshot["undecided"]
        cell = self.work.cell[:, self._own]
        held = cell[layout.FRICTION] + cell[layout.EXCESS]
        rate = cell[layout.RATE] + cell[layout.RATE_LOW]
        require_at_rest(cell[layout.FORCE] + self.load()[0] * rate, held)
        for sum_of in (cell[layout.FORCE] - cell[layout.WEIGHT], rate):  # springs pull both ways
            require_at_rest(sum_of.sum(), 0.0 * held)

    @property
    def evidence(self) -> Evidence:
        """Undecided if a comparison is, or once an avalanche that has not ended is too long."""
        now = self.work.now[0]
        endless = now["stage"] != layout.AT_REST and now["number"] > layout.PROMISED_EVENTS
        return Evidence.UNDECIDED if endless else super().evidence


@dataclass(frozen=True)
class Exact(Solver):
    """The event-driven solver in float64 with certified events, compiled.

    Guarantee: every event is located to a few ulp of its time, and none is missed: an event is
    accepted only after all sliders were certified to have none before (see `taylor`). Each event
    adds a rounding error of a few 1e-16 of the largest force, which later events amplify. The
    promise is 1e-12 for the tensions after one rearrangement: `rearrange` estimates the error (see
    `motion.amplified`), and the evidence is `UNDECIDED` if the estimate is larger. Comparisons
    within their own rounding bound are settled by the model's rules and counted as undecided.
    """

    perturbs: ClassVar[bool] = True
    takes = EVERYTHING
    name: ClassVar[str] = "exact"
    summary: ClassVar[str] = "event by event in closed form, float64, compiled"

    def compiles(self, n: int) -> int:
        """Return a number of sliders for which the same compiled code is used as for `n`."""
        return min(max(n, 2), 3) if n <= layout.LONGEST_SHORT else layout.LONGEST_SHORT + 1

    def rearrange_from(self, start: Start, direction: int, limits: Limits) -> Rearrangement:
        """Rearrange by the compiled loop, reusing the arrays of a finished rearrangement."""
        chain = start.chain
        try:
            used = _USED[chain.n].pop()
        except (KeyError, IndexError):
            used = None
        simulation = ExactSimulation(chain, start.state, start.seed, ("events",), used)
        parts, ended = simulation.single(direction, limits, simulation.drain)
        logged = np.concatenate(parts)
        result = Estimated.of(
            simulation,
            self.name,
            ended,
            _origin=simulation.origin,
            _load=simulation.load(),
            _log=logged[logged["kind"] != layout.REST_ROW],
        )
        if chain.n <= layout.LONGEST_SHORT:
            _USED.setdefault(chain.n, []).append(simulation.work)
        return result

    def simulation_from(self, start: Start, record: tuple[str, ...]) -> Simulation:
        """Return a simulation by the compiled loop."""
        of = start.chain, start.state, start.seed, record
        return ExactSimulation(*of, unrounded=start.unrounded)


def _stacked(parts: Sequence[NDArray[Any]]) -> NDArray[Any]:
    """Return rows one after the other, a copy; by fields it would take longer."""
    return np.concatenate([rows.view(np.uint8) for rows in parts]).view(parts[0].dtype)
