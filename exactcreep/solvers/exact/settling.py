"""Follow cycles in the compiled loop of `exact`, until the chain returns to an earlier state.

Without disorder the state at the end of a cycle determines everything that follows. A ring stores
forces (sums of two floats) and thresholds at the ends of the last cycles. States with the same hash
are chained, and compared number by number. So the first return gives the period exactly, and the
cycle from which on the chain is periodic.

An avalanche rounds the forces, and a cycle with avalanches may return them only to within rounding.
So cycles with the same slips of every slider are chained, too. If the forces return to within
`NEAR` for `PATIENCE` successive cycles and at least two periods, they are assumed to continue so.
This is not an exact recurrence of the floats, and is reported separately.

With disorder a contact never gets back its threshold. Then the search is for a cycle without any
event, which ends all motion, and for the time since an inner slider last slipped.

The search examines every cycle, which may take less than a microsecond. In NumPy, on blocks of
cycles, a short fate took 1.2 to 1.9 times as long, and with disorder up to 4.7 times.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exactcreep.compiling import compiled, inlined
from exactcreep.model.chain import Chain, no_advance, rounding_of
from exactcreep.model.drive import Cycles
from exactcreep.model.numbers import nearest_float
from exactcreep.model.state import State
from exactcreep.solvers.exact import layout, loop
from exactcreep.solvers.exact.copies import NEAR_COPIES, perturbed
from exactcreep.solvers.exact.layout import MOST_WORK
from exactcreep.solvers.exact.rows import AtTargets
from exactcreep.solvers.exact.solver import ExactSimulation
from exactcreep.solvers.return_map import (
    LONGEST_PERIOD,
    PATIENCE,
    Approach,
    LimitCycle,
    approach,
    nearness,
    repeats_since,
    returns,
)
from exactcreep.watch import interrupts
from exactcreep.watch.limits import NO_LIMITS, Limits, Stop

_TRIES = 64  # earlier cycles with the same slips that are compared
_SLOTS = 2048  # of hashes
_MOST_BYTES = 2**28  # of the ring

SEARCH = np.dtype(
    [
        ("rounding", np.float64),  # largest rounding error of a displacement in one slip, times n
        ("still", np.float64),  # largest change of their sum in a cycle without an advance
        ("close", np.float64),  # largest distance of forces that have nearly returned
        ("calm", np.int64),  # cycles without a slip of an inner slider: dormant
        ("reached", np.int64),  # half-cycles of the present cycle
        ("cycles", np.int64),  # whole cycles so far
        ("events", np.int64),  # up to the end of the last whole cycle
        ("total", np.float64),  # of all displacements there
        ("total_low", np.float64),
        ("advanced_until", np.int64),  # cycle (up to `since` once settled) with one of x_G, 0: none
        ("lowest", np.float64),  # least and largest sum of displacements
        ("highest", np.float64),
        ("furthest", np.int64),  # the last cycle with a new extreme of x_G
        ("heading", np.int64),  # its direction: +1 or -1 along x; 0: none
        ("stirred", np.int64),  # the last cycle in which an inner slider slipped, 0: none
        ("dormant_after", np.int64),  # cycles after which it was first dormant, -1: never
        ("mark", np.uint64),  # hash of the events and slips of the last cycle
        ("alike", np.int64),  # cycles in a row with the same mark
        ("advanced_before", np.int64),  # the last advance before these
        ("near", np.int64),  # the period with which the forces nearly return, 0: none
        ("streak", np.int64),  # number of successive cycles with such a return
        ("advanced_near", np.int64),  # the last advance up to a period before these
        ("since", np.int64),  # cycles after which it is periodic, -1: not yet
        ("period", np.int64),
        ("apart", np.float64),  # how nearly the forces have returned, 0: bit for bit
    ]
)
"""The progress of a chain through its cycles, and the parameters of the search."""


class Memory(NamedTuple):
    """The past cycles that `settle` remembers; cycle c is in row c % rows."""

    ring: NDArray[np.float64]  # (rows, 3, n): the states at their ends
    advanced: NDArray[np.int64]  # (rows,): the last cycle that had advanced
    # (rows + slots,): the previous cycle with the same hash, and the last cycle of each hash
    same_state: NDArray[np.int64]
    same_slips: NDArray[np.int64]
    slips: NDArray[np.int64]  # (n,): of every slider up to the end of the last whole cycle

    @classmethod
    def of(cls, chain: Chain) -> Memory:
        """Return room for the longest period that is searched; less for very long chains."""
        most = _MOST_BYTES // (24 * chain.n)
        rows = 1 if chain.sigma_mu != 0 else max(min(LONGEST_PERIOD, most), 2) + 1
        lengths = rows, rows + _SLOTS, rows + _SLOTS, chain.n
        return cls(np.empty((rows, 3, chain.n)), *(np.zeros(m, dtype=np.int64) for m in lengths))


@inlined
def _mixed(state, word):
    state = (state ^ word) * np.uint64(0x9E3779B97F4A7C15)
    return state ^ (state >> np.uint64(29))


@inlined
def _chained(chain, rows, state, cycle):
    """Put a cycle first in the chain of its hash; return the previous first, or 0."""
    slot = rows + np.int64(state % np.uint64(_SLOTS))
    before = chain[slot]
    chain[cycle % rows] = before
    chain[slot] = cycle
    return before


@inlined
def _apart(ring, cycle, earlier):
    """Return the largest difference of a number at the ends of two cycles; 0: bit for bit."""
    rows = ring.shape[0]
    largest = 0.0
    for k in range(ring.shape[1]):
        for i in range(ring.shape[2]):
            largest = max(largest, abs(ring[cycle % rows, k, i] - ring[earlier % rows, k, i]))
    return largest


@compiled
def _returned(cell, now, search, memory):
    """Store the present state, and settle if an earlier cycle ended in the same state."""
    ring = memory.ring
    rows = ring.shape[0]
    cycle = search.cycles
    here = cycle % rows
    bits = cell.view(np.uint64)
    state = np.uint64(14695981039346656037)
    for k, kind in enumerate((layout.FORCE, layout.FORCE_LOW, layout.EXCESS)):
        for i in range(now.chain.n):
            ring[here, k, i] = cell[kind, layout.PAD + i]
            if k < 2:  # ignore the sign of the number, and of zero
                state = _mixed(state, bits[kind, layout.PAD + i] << np.uint64(1))
    memory.advanced[here] = search.advanced_until
    earlier = _chained(memory.same_state, rows, state, cycle)
    while earlier > 0 and cycle - earlier < rows:
        if _apart(ring, cycle, earlier) == 0.0:
            search.since = earlier
            search.period = cycle - earlier
            search.apart = 0.0
            search.advanced_until = memory.advanced[earlier % rows]
            return
        earlier = memory.same_state[earlier % rows]


@compiled
def _nearly_returned(search, memory):
    """Test whether the forces have nearly returned, and settle if this lasts long enough."""
    ring = memory.ring
    rows = ring.shape[0]
    cycle = search.cycles
    earlier = _chained(memory.same_slips, rows, search.mark, cycle)
    search.apart = 0.0
    if search.near > 0:
        search.apart = _apart(ring, cycle, cycle - search.near)
        search.streak += 1
        if search.apart > search.close:
            search.near = 0
    tries = 0
    while search.near == 0 and earlier > 0 and cycle - earlier < rows and tries < _TRIES:
        search.apart = _apart(ring, cycle, earlier)
        if search.apart <= search.close:
            search.near = cycle - earlier
            search.streak = 1
            search.advanced_near = memory.advanced[earlier % rows]
        earlier = memory.same_slips[earlier % rows]
        tries += 1
    if search.near > 0 and search.streak >= max(PATIENCE, 2 * search.near):
        search.period = search.near
        search.since = cycle - search.streak + 1 - search.near
        search.advanced_until = search.advanced_near


@inlined
def _note(whole, now, search, memory):
    """Note the slips of the cycle that has just ended, and its x_G."""
    cycle, slips, inner = search.cycles, 0, 0
    mark = np.uint64(now.counts.events - search.events)
    for i in range(now.chain.n):
        made = whole[layout.SLIPS, layout.PAD + i] - memory.slips[i]
        memory.slips[i] += made
        mark = _mixed(mark, np.uint64(made))
        slips += made
        inner += made * (0 < i < now.chain.n - 1)
    if mark != search.mark:
        search.mark = mark
        search.alike = 0
        search.advanced_before = search.advanced_until
    search.alike += 1
    if inner > 0:
        search.stirred = cycle
    elif now.chain.n > 2 and search.dormant_after < 0 and cycle - search.stirred >= search.calm:
        search.dormant_after = search.stirred
    moved = (now.total - search.total) + (now.total_low - search.total_low)
    search.total = now.total
    search.total_low = now.total_low
    rounded = search.rounding * slips
    if abs(moved) > max(rounded, search.still):
        search.advanced_until = cycle
    if now.total > search.highest + rounded:
        search.highest = now.total
        search.furthest = cycle
        search.heading = 1
    elif now.total < search.lowest - rounded:
        search.lowest = now.total
        search.furthest = cycle
        search.heading = -1


@compiled
def settle(work, high, low, targets, searches, memory, most_cycles, most_work):
    """Follow cycles until the chain has settled, has had its cycles, or the work is done.

    `high` and `low`: ``l0 theta`` at the ends of both half-cycles, as two floats. Returns the same
    as `loop.follow`; `layout.DONE` also if the chain has settled.
    """
    cell, whole, deviate, clock, series, scalars, log = work
    now, search = scalars[0], searches[0]
    worked, happened = now.counts.work, now.counts.events
    while search.since < 0 and search.cycles < most_cycles:
        left = most_work - max(now.counts.work - worked, now.counts.events - happened)
        if left <= 0:
            return layout.BUDGET
        half = search.reached
        reason, reached = loop.follow(
            cell, whole, deviate, clock, series, scalars, log, high[half:], low[half:], targets,
            left, left,
        )  # fmt: skip
        search.reached += reached
        if reason != layout.DONE:
            return reason
        search.reached = 0
        search.cycles += 1
        _note(whole, now, search, memory)
        if now.counts.events == search.events:
            search.since = search.cycles - 1
            search.period = 1
            search.apart = 0.0
        elif now.chain.constant == 1:
            _returned(cell, now, search, memory)
            if search.since < 0:
                _nearly_returned(search, memory)
        search.events = now.counts.events
    return layout.DONE


class SettlingSearch:
    """The search for the cycle to which temperature cycles of one amplitude take a chain.

    Parameters
    ----------
    chain : Chain
    drive : Cycles
        Its cycles are the most that the chain may take.
    start : State
    seed : int
    dormant : int
        Cycles without a slip of an inner slider after which the chain is called dormant.

    Attributes
    ----------
    simulation : ExactSimulation
        The present chain.
    cycles, advanced_until, furthest, heading, dormant_after, alike, advanced_before, since, period
        Notes about its cycles; see `SEARCH`.
    """

    def __init__(
        self, chain: Chain, drive: Cycles, start: State, seed: int = 0, dormant: int = 2**62
    ) -> None:
        self.simulation = ExactSimulation(chain, start, seed, ())
        self.simulation.make_room()  # otherwise `settle` might be compiled twice
        self.drive = drive
        self._memory = Memory.of(chain)
        self._targets = (
            *self.simulation.targets(drive, 1, 2),
            AtTargets.of(2, (), self.simulation.origin.began),
        )
        self._searches = np.zeros(1, dtype=SEARCH)
        search = self._searches[0]
        total, low = self.simulation.work.now[["total", "total_low"]][0].item()
        search["rounding"] = chain.n * nearest_float(rounding_of(chain))
        search["still"] = chain.n * nearest_float(no_advance(chain))
        search["close"] = nearness(chain)
        search["calm"] = dormant
        search["since"] = search["dormant_after"] = -1
        search["total"], search["total_low"] = total, low
        search["lowest"] = search["highest"] = total

    @classmethod
    def compile(cls) -> None:
        """Compile or load the search; a signal ends the wait for the compiler."""
        if not settle.signatures:
            pair = Chain(2, 1000, "1/2", "3/5", tan_alpha=0)
            interrupts.prepare(lambda: cls(pair, Cycles("1/10", 1), State.relaxed(pair)).follow())

    def __getattr__(self, name: str) -> int:
        """Return what `settle` notes under a name in `SEARCH`."""
        if name in (SEARCH.names or ()):
            return int(self._searches[name][0])
        raise AttributeError(name)

    def copies(self) -> list[SettlingSearch]:
        """Return searches from two starts that differ by a few rounding errors."""
        chain, start = self.simulation.chain, self.simulation.start.state
        return [SettlingSearch(chain, self.drive, perturbed(chain, start, *of)[1])
                for of in NEAR_COPIES]  # fmt: skip

    def recording(self) -> ExactSimulation:
        """Return a simulation that goes on from the present end of a cycle, and records events."""
        of = self.simulation
        return ExactSimulation(of.chain, of.state(), of.seed, ("events",), unrounded=of.unrounded())

    @property
    def settled(self) -> LimitCycle | None:
        """The limit cycle, exact if `apart` is 0, else to within this distance; or None."""
        if self.since < 0:
            return None
        return LimitCycle(self.period, self.since, float(self._searches["apart"][0]), None)

    def approaching(self) -> Approach | None:
        """Return how the forces approach a limit like 1/k; None if they do not."""
        if self.simulation.chain.sigma_mu != 0:
            return None
        return approach(self._forces(self._kept), self.alike)

    @property
    def _kept(self) -> NDArray[np.int64]:
        """The cycles whose ends are stored, in order."""
        return np.arange(max(self.cycles - len(self._memory.ring) + 1, 1), self.cycles + 1)

    def _forces(self, cycles: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the forces at the ends of cycles, a row for each."""
        forces: NDArray[np.float64] = self._memory.ring[cycles % len(self._memory.ring), 0]
        return forces

    def _shorten(self) -> None:
        """Switch to the shortest period with which the forces nearly return.

        A trajectory that approaches its cycle alternately from both sides first recurs after two
        periods.
        """
        search, kept, long = self._searches[0], self._kept, self.period
        ends, close = self._forces(kept), float(search["close"])
        shorter = [p for p in returns(ends, long - 1, close).tolist() if long % p == 0]
        if shorter:
            since = kept[repeats_since(ends, shorter[0], close)]
            search["period"], search["since"] = shorter[0], since
            search["advanced_until"] = self._memory.advanced[since % len(self._memory.ring)]

    @property
    def dormant(self) -> bool:
        """Whether no inner slider has slipped for `dormant` cycles."""
        return self.simulation.chain.n > 2 and self.cycles - self.stirred >= self.calm

    def follow(self, limits: Limits = NO_LIMITS) -> tuple[Stop, str]:
        """Continue until the chain has settled, has had its cycles, or a limit is reached.

        Returns `Stop.DONE` in the first two cases, otherwise why it ended, with a sentence.
        """
        simulation, targets, most = self.simulation, self._targets, self.drive.cycles
        before = simulation.events
        while True:
            reason = settle(
                simulation.work, *targets, self._searches, self._memory, most, MOST_WORK
            )
            if reason == layout.DONE:
                if self.period > 1 and self._searches["apart"][0] > 0.0:
                    self._shorten()
                return Stop.DONE, ""
            if reason != layout.BUDGET:
                return simulation.ending(reason)
            stop = limits.stop(simulation.events - before)
            if stop is not None:
                return stop, limits.reason(stop)
