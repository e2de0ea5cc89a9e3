"""Cycle after cycle in the compiled loop of `exact`, until the chain comes back to a state.

Without disorder the state at the end of a cycle decides all that follows. The forces, sums of two
floats, and the thresholds at the ends of the last `MOST_PERIOD` cycles are kept in a ring; those
with the same hash are chained, and compared number by number. The first return therefore tells the
period, and the cycle from which on the chain is periodic, exactly.

An avalanche rounds the forces, and a cycle with avalanches may return them only to within that. So
cycles with the same slips of every slider are chained, too: if the forces come back to within
`RETURN` `PATIENCE` cycles in a row, and two periods at least, they are taken to go on like this.
That is no recurrence of the floats, and reported apart.

With disorder a contact never gets back its threshold: what is found is a cycle without any event,
which ends all motion, and how long no inner slider has slipped.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exactcreep.limits import NO_LIMITS, Limits, Stop
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles
from exactcreep.model.numbers import nearest_float
from exactcreep.model.outcome import NO_ADVANCE
from exactcreep.model.state import State
from exactcreep.solvers.exact import layout as at
from exactcreep.solvers.exact import loop
from exactcreep.solvers.exact.layout import compiled, inlined
from exactcreep.solvers.exact.solver import MOST_WORK, ExactSimulation

MOST_PERIOD = 1000
"""Cycles: a longer period is not found."""
RETURN = 2.0**-40
"""How close the forces come back, in units of the largest at rest, that have returned nearly."""
PATIENCE = 100
"""Cycles in a row."""
_TRIES = 64  # earlier cycles with the same slips that are looked at
_SLOTS = 2048  # of hashes
_MOST_BYTES = 2**28  # of the ring

SEARCH = np.dtype(
    [
        ("most_cycles", np.int64),
        ("rounding", np.float64),  # the most it adds to a displacement in one slip, times n
        ("close", np.float64),  # how far apart forces may be that have nearly returned
        ("calm", np.int64),  # cycles without a slip of an inner slider: dormant
        ("reached", np.int64),  # half-cycles of the present cycle
        ("cycle", np.int64),  # whole cycles
        ("advanced", np.int64),  # the last cycle in which x_G advanced, 0: none
        ("settled", np.int64),  # cycles after which it is periodic, -1: not yet
        ("period", np.int64),
        ("before", np.int64),  # events up to the end of the last whole cycle
        ("slipped", np.int64),  # slips up to there
        ("inner", np.int64),  # slips of inner sliders up to there
        ("stirred", np.int64),  # the last cycle in which an inner slider slipped, 0: none
        ("dormant", np.int64),  # the cycle after which it was first dormant, -1: never
        ("near", np.int64),  # the period with which the forces nearly return, 0: none
        ("streak", np.int64),  # how many cycles in a row they have
        ("near_advanced", np.int64),  # the last cycle that had advanced before these
        ("exactly", np.int64),  # 1 if the state has returned bit for bit
        ("furthest", np.int64),  # the last cycle that took x_G further than ever, either way
        ("heading", np.int64),  # which way that was: +1 or -1 along x; 0: none
        ("total", np.float64),  # of all displacements at the end of the last whole cycle
        ("total_low", np.float64),
        ("apart", np.float64),  # how nearly the forces have returned
        ("mark", np.uint64),  # hash of the events and slips of the last cycle
        ("alike", np.int64),  # cycles in a row with the same mark
        ("alike_advanced", np.int64),  # the last cycle that had advanced before these
        ("lowest", np.float64),  # least and largest sum of displacements
        ("highest", np.float64),
    ]
)
"""How far a chain has come on its way through cycles, and what is asked of it."""


class Memory(NamedTuple):
    """What `settle` remembers of past cycles; cycle c in row c % rows."""

    ring: NDArray[np.float64]  # (rows, 3, n): the states at their ends
    advanced: NDArray[np.int64]  # (rows,): the last cycle that had advanced
    # (rows + slots,): the cycle before of the same hash, and the last cycle of each hash
    same_state: NDArray[np.int64]
    same_slips: NDArray[np.int64]
    slips: NDArray[np.int64]  # (n,): of every slider up to the end of the last whole cycle

    @classmethod
    def of(cls, chain: Chain) -> Memory:
        """Return room for the longest period that is looked for, less for very long chains."""
        most = _MOST_BYTES // (24 * chain.n)
        rows = 1 if chain.sigma_mu != 0 else max(min(MOST_PERIOD, most), 2) + 1
        lengths = rows, rows + _SLOTS, rows + _SLOTS, chain.n
        return cls(np.empty((rows, 3, chain.n)), *(np.zeros(m, dtype=np.int64) for m in lengths))


@inlined
def _mixed(state, word):
    state = (state ^ word) * np.uint64(0x9E3779B97F4A7C15)
    return state ^ (state >> np.uint64(29))


@inlined
def _chained(chain, rows, state, cycle):
    """Put a cycle before the others of its hash; return the last of these, 0 if there is none."""
    slot = rows + np.int64(state % np.uint64(_SLOTS))
    before = chain[slot]
    chain[cycle % rows] = before
    chain[slot] = cycle
    return before


@inlined
def _apart(ring, one, other):
    """Return the largest difference of a force at the ends of two cycles of the ring."""
    rows = ring.shape[0]
    largest = 0.0
    for i in range(ring.shape[2]):
        largest = max(largest, abs(ring[one % rows, 0, i] - ring[other % rows, 0, i]))
    return largest


@inlined
def _the_same(ring, one, other):
    """Return whether the states at the ends of two cycles of the ring are the same."""
    for k in range(3):
        for i in range(ring.shape[2]):
            if ring[one, k, i] != ring[other, k, i]:
                return False
    return True


@compiled
def _returned(cell, now, search, memory):
    """Keep the present state, and settle if it is that at the end of an earlier cycle."""
    ring = memory.ring
    rows = ring.shape[0]
    cycle = search.cycle
    here = cycle % rows
    bits = cell.view(np.uint64)
    state = np.uint64(14695981039346656037)
    for k, kind in enumerate((at.FORCE, at.FORCE_LOW, at.EXCESS)):
        for i in range(now.chain.n):
            ring[here, k, i] = cell[kind, at.PAD + i]
            if k < 2:  # the sign of a number does not count, nor of a zero
                state = _mixed(state, bits[kind, at.PAD + i] << np.uint64(1))
    memory.advanced[here] = search.advanced
    earlier = _chained(memory.same_state, rows, state, cycle)
    while earlier > 0 and cycle - earlier < rows:
        if _the_same(ring, here, earlier % rows):
            search.settled = earlier
            search.period = cycle - earlier
            search.advanced = memory.advanced[earlier % rows]
            search.exactly = 1
            return
        earlier = memory.same_state[earlier % rows]


@compiled
def _nearly_returned(count, now, search, memory):
    """Look whether the forces have come back nearly, and settle if they have for long enough."""
    ring, slips = memory.ring, memory.slips
    rows = ring.shape[0]
    cycle = search.cycle
    mark = np.uint64(now.counts.events - search.before)
    for i in range(now.chain.n):
        made = count[at.SLIPS, at.PAD + i]
        mark = _mixed(mark, np.uint64(made - slips[i]))
        slips[i] = made
    if mark != search.mark:
        search.mark = mark
        search.alike = 0
        search.alike_advanced = memory.advanced[(cycle - 1) % rows]
    search.alike += 1
    earlier = _chained(memory.same_slips, rows, mark, cycle)
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
            search.near_advanced = memory.advanced[earlier % rows]
        earlier = memory.same_slips[earlier % rows]
        tries += 1
    if search.near > 0 and search.streak >= max(PATIENCE, 2 * search.near):
        _shortest(search, memory)


@compiled
def _shortest(search, memory):
    """Settle with the shortest period with which the forces nearly return.

    What comes to its cycle in turns from either side returns after two cycles first.
    """
    ring, close = memory.ring, search.close
    now = search.cycle
    long = search.near
    settled = now - search.streak + 1 - long
    search.advanced = search.near_advanced
    period = 1
    while long % period != 0 or _apart(ring, now, now - period) > close:
        period += 1
    if period < long:
        settled = now - period
        oldest = max(now - ring.shape[0] + 1, 1)
        while settled > oldest and _apart(ring, settled - 1, settled - 1 + period) <= close:
            settled -= 1
        search.advanced = memory.advanced[settled % ring.shape[0]]
    search.settled = settled
    search.period = period


@inlined
def _count(count, now, search):
    """Note what the cycle that has just ended has come to: advances, and slips of inner sliders."""
    moved = (now.total - search.total) + (now.total_low - search.total_low)
    search.total = now.total
    search.total_low = now.total_low
    rounded = search.rounding * (now.counts.slips - search.slipped)
    search.slipped = now.counts.slips
    if abs(moved) > max(rounded, now.chain.n * NO_ADVANCE):
        search.advanced = search.cycle
    if now.total > search.highest + rounded:
        search.highest = now.total
        search.furthest = search.cycle
        search.heading = 1
    elif now.total < search.lowest - rounded:
        search.lowest = now.total
        search.furthest = search.cycle
        search.heading = -1
    inner = 0
    for i in range(at.PAD + 1, at.PAD + now.chain.n - 1):
        inner += count[at.SLIPS, i]
    if inner != search.inner:
        search.inner = inner
        search.stirred = search.cycle
    elif now.chain.n > 2 and search.dormant < 0 and search.cycle - search.stirred >= search.calm:
        search.dormant = search.stirred


@compiled
def settle(work, high, low, targets, searches, memory, most_work):
    """Follow cycles until the chain has settled, has had its cycles, or the work is done.

    `high` and `low`: ``l0 theta`` at the ends of both half-cycles, as two floats. Returns as
    `loop.follow`; `layout.DONE` also if it has settled.
    """
    cell, count, deviate, clock, series, scalars, log = work
    now, search = scalars[0], searches[0]
    begun = now.counts.work, now.counts.events
    while search.settled < 0 and search.cycle < search.most_cycles:
        left = most_work - max(now.counts.work - begun[0], now.counts.events - begun[1])
        if left <= 0:
            return at.BUDGET
        half = search.reached
        reason, reached = loop.follow(
            cell, count, deviate, clock, series, scalars, log, high[half:], low[half:], targets,
            left, left, False,
        )  # fmt: skip
        search.reached += reached
        if reason != at.DONE:
            return reason
        search.reached = 0
        search.cycle += 1
        _count(count, now, search)
        if now.counts.events == search.before:
            search.settled = search.cycle - 1
            search.period = 1
            search.exactly = 1
        elif now.chain.constant == 1:
            _returned(cell, now, search, memory)
            if search.settled < 0:
                _nearly_returned(count, now, search, memory)
        search.before = now.counts.events
    return at.DONE


class Recurrence:
    """A chain on its way through temperature cycles of one amplitude, until it has settled.

    Parameters
    ----------
    chain : Chain
    drive : Cycles
        The most cycles that it may take.
    start : State
    seed : int
    dormant : int
        Cycles without a slip of an inner slider after which the chain is called dormant.

    Attributes
    ----------
    simulation : ExactSimulation
        Where the chain is.
    """

    def __init__(
        self, chain: Chain, drive: Cycles, start: State, seed: int = 0, dormant: int = 2**62
    ) -> None:
        self.simulation = ExactSimulation(chain, start, seed, ())
        self.simulation.make_room()  # else `settle` might have to be compiled twice
        self.drive = drive
        self._memory = Memory.of(chain)
        self._targets = *self.simulation.targets(drive, 1, 2), self.simulation.at_targets(2, ())
        self._searches = np.zeros(1, dtype=SEARCH)
        search = self._search = self._searches[0]
        total, low = self.simulation.work.now[["total", "total_low"]][0].item()
        search["most_cycles"] = drive.cycles
        search["rounding"] = chain.n * nearest_float(chain.rounding)
        search["close"] = RETURN * (chain.friction + chain.excess + abs(chain.sin_alpha))
        search["calm"] = dormant
        search["settled"] = search["dormant"] = -1
        search["total"], search["total_low"] = total, low
        search["lowest"] = search["highest"] = total

    @property
    def cycles(self) -> int:
        """Whole cycles so far."""
        return int(self._search["cycle"])

    @property
    def settled_after(self) -> int | None:
        """Cycles after which it is periodic; None: not settled."""
        return self._known("settled")

    @property
    def period(self) -> int | None:
        """Cycles after which the state returns; None: not settled."""
        return None if self.settled_after is None else int(self._search["period"])

    @property
    def distance(self) -> float:
        """How nearly the forces come back after a period; 0: bit for bit. Unit m g."""
        return 0.0 if self._search["exactly"] else float(self._search["apart"])

    @property
    def last_advance(self) -> int:
        """The last cycle, up to `settled_after` if that is known, in which x_G advanced; 0: none.

        Down or up the incline, by more than rounding can make, and than `NO_ADVANCE`.
        """
        return int(self._search["advanced"])

    @property
    def alike(self) -> tuple[int, int]:
        """How many cycles in a row have had equal slips, and the last advance before these."""
        return int(self._search["alike"]), int(self._search["alike_advanced"])

    def steps(self, count: int) -> NDArray[np.float64]:
        """Return the largest change of a force in each of the last cycles, at most `count`.

        The last one last, shape (at most count,), unit m g.
        """
        ring, last = self._memory.ring, self.cycles
        kept = np.arange(max(last - min(count, ring.shape[0] - 1), 1), last + 1)
        changes = np.abs(np.diff(ring[kept % ring.shape[0], 0], axis=0))
        return np.asarray(changes.max(axis=1), dtype=np.float64)

    @property
    def furthest(self) -> int:
        """The last cycle that took x_G further than ever, down or up; 0: none."""
        return int(self._search["furthest"])

    @property
    def heading(self) -> int:
        """Which way that was: +1 or -1 along x; 0: none."""
        return int(self._search["heading"])

    @property
    def dormant_after(self) -> int | None:
        """Cycles after which it was first dormant; None: it never was."""
        return self._known("dormant")

    @property
    def dormant_now(self) -> bool:
        """Whether no inner slider has slipped for as many cycles as make the chain dormant."""
        still = self._search["cycle"] - self._search["stirred"]
        return self.simulation.chain.n > 2 and bool(still >= self._search["calm"])

    def _known(self, name: str) -> int | None:
        value = int(self._search[name])
        return None if value < 0 else value

    def follow(self, limits: Limits = NO_LIMITS) -> tuple[Stop, str]:
        """Go on until the chain has settled, has had its cycles, or a limit is reached.

        `Stop.DONE` comes back in the first two cases, otherwise why it ended, with a sentence.
        """
        simulation = self.simulation
        begun = simulation.tally.events
        while True:
            reason = settle(
                simulation.work, *self._targets, self._searches, self._memory, MOST_WORK
            )
            if reason == at.DONE:
                return Stop.DONE, ""
            if reason != at.BUDGET:
                return simulation.ending(reason)
            stop = limits.stop(simulation.tally.events - begun)
            if stop is not None:
                return stop, limits.reason(stop)
