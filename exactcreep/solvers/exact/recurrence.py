"""Cycle after cycle in the compiled loop of `exact`, until the chain comes back to a state.

Without disorder the state at the end of a cycle decides all that follows. The forces, sums of two
floats, and the thresholds at the ends of the last `MOST_PERIOD` cycles are kept in a ring; those
with the same hash are chained, and compared number by number. The first return therefore tells the
period, and the cycle from which on the chain is periodic, exactly.

An avalanche rounds the forces, and a cycle with avalanches may return them only to within that. So
cycles with the same slips of every slider are chained, too: if the forces come back to within
`RETURN` `PATIENCE` cycles in a row, and two periods at least, they are taken to go on like this.
That is no recurrence of the floats, and reported apart.

With disorder a contact never
gets back its threshold: what is found is a cycle without any event, which ends all motion, and
how long no inner slider has slipped.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exactcreep.limits import NO_LIMITS, Limits, Stop
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles
from exactcreep.model.numbers import nearest_float
from exactcreep.model.state import State
from exactcreep.solvers.exact import layout
from exactcreep.solvers.exact import loop as kernel
from exactcreep.solvers.exact.layout import (
    BUDGET,
    CONSTANT,
    DONE,
    EVENTS,
    EXCESS,
    FORCE,
    FORCE_LOW,
    PAD,
    SLIP_TOTAL,
    SLIPS,
    TOTAL,
    TOTAL_LOW,
    WORK,
    N,
    compiled,
    inlined,
)
from exactcreep.solvers.exact.solver import ExactSimulation

MOST_PERIOD = 1000
"""Cycles: a longer period is not found."""
RETURN = 2.0**-40
"""How close the forces come back, in units of the largest at rest, that have returned nearly."""
PATIENCE = 100
"""Cycles in a row."""
_TRIES = 64  # earlier cycles with the same slips that are looked at
_SLOTS = 2048  # of hashes
_MOST_BYTES = 2**28  # of the ring

# cells of `course`, int64
(
    REACHED,  # half-cycles of the present cycle
    CYCLE,  # whole cycles
    ADVANCED,  # the last cycle in which x_G advanced, 0: none
    SETTLED,  # cycles after which it is periodic, -1: not yet
    PERIOD,
    BEFORE,  # events up to the end of the last whole cycle
    SLIPPED,  # slips up to there
    INNER,  # slips of inner sliders up to there
    STIRRED,  # the last cycle in which an inner slider slipped, 0: none
    DORMANT,  # the cycle after which it was first dormant, -1: never
    NEAR,  # the period with which the forces nearly return, 0: none
    STREAK,  # how many cycles in a row they have
    NEAR_ADVANCED,  # the last cycle that had advanced before these
    EXACTLY,  # 1 if the state has returned bit for bit
    FURTHEST,  # the last cycle that took x_G further down than ever
) = range(15)
CELLS = 15


@compiled
def _slot(bits, first, last):
    """Return the hash of the present forces; the sign of a number does not count, nor of a zero."""
    state = np.uint64(14695981039346656037)
    for row in (FORCE, FORCE_LOW):
        for i in range(first, last):
            state = (state ^ (bits[row, i] << np.uint64(1))) * np.uint64(0x9E3779B97F4A7C15)
            state ^= state >> np.uint64(29)
    return np.int64(state % np.uint64(_SLOTS))


@compiled
def _returned(cell, bits, whole, course, ring, link, advanced, head):
    """Keep the present state; return how many cycles ago it was the same, 0 if it was not.

    Also the last cycle that had advanced then.
    """
    first = PAD
    last = PAD + whole[N]
    rows = ring.shape[0]
    now = course[CYCLE]
    slot = _slot(bits, first, last)
    row = head[slot]  # holds cycle numbers, from the newest back
    while row > 0 and now - row <= rows - 1:
        there = row % rows
        same = True
        for k, kind in enumerate((FORCE, FORCE_LOW, EXCESS)):
            for i in range(first, last):
                if ring[there, k, i - first] != cell[kind, i]:
                    same = False
                    break
            if not same:
                break
        if same:
            return now - row, advanced[there]
        row = link[there]
    there = now % rows
    for k, kind in enumerate((FORCE, FORCE_LOW, EXCESS)):
        for i in range(first, last):
            ring[there, k, i - first] = cell[kind, i]
    link[there] = head[slot]
    advanced[there] = course[ADVANCED]
    head[slot] = now
    return 0, 0


@inlined
def _apart(cell, whole, state):
    """Return the largest difference of a force from those of `state`."""
    largest = 0.0
    for i in range(whole[N]):
        largest = max(largest, abs(cell[FORCE, PAD + i] - state[0, i]))
    return largest


@compiled
def _nearly_returned(cell, count, whole, course, ring, same_slips, advanced, slips, close):
    """Look whether the forces have come back nearly; keep the slips of this cycle.

    Returns
    -------
    float
        How nearly, where they have.
    """
    rows = ring.shape[0]
    now = course[CYCLE]
    mark = np.uint64(whole[EVENTS] - course[BEFORE])
    for i in range(whole[N]):
        made = count[SLIPS, PAD + i]
        mark = (mark ^ np.uint64(made - slips[i])) * np.uint64(0x9E3779B97F4A7C15)
        mark ^= mark >> np.uint64(29)
        slips[i] = made
    slot = rows + np.int64(mark % np.uint64(_SLOTS))
    apart = 0.0
    if course[NEAR] > 0:
        apart = _apart(cell, whole, ring[(now - course[NEAR]) % rows])
        course[STREAK] += 1
        if apart > close:
            course[NEAR] = 0
    if course[NEAR] == 0:
        row = same_slips[slot]
        tries = 0
        while row > 0 and now - row < rows and tries < _TRIES:
            apart = _apart(cell, whole, ring[row % rows])
            if apart <= close:
                course[NEAR] = now - row
                course[STREAK] = 1
                course[NEAR_ADVANCED] = advanced[row % rows]
                break
            row = same_slips[row % rows]
            tries += 1
    same_slips[now % rows] = same_slips[slot]
    same_slips[slot] = now
    return apart


@inlined
def _rows_apart(ring, one, other):
    """Return the largest difference of a force at the ends of two cycles of the ring."""
    rows = ring.shape[0]
    largest = 0.0
    for i in range(ring.shape[2]):
        difference = ring[one % rows, 0, i] - ring[other % rows, 0, i]
        largest = max(largest, abs(difference))
    return largest


@compiled
def _shortest(course, ring, advanced, close):
    """Settle with the shortest period with which the forces nearly return.

    What comes to its cycle in turns from either side returns after two cycles first.
    """
    now = course[CYCLE]
    long = course[NEAR]
    settled = now - course[STREAK] + 1 - long
    course[ADVANCED] = course[NEAR_ADVANCED]
    period = 1
    while long % period != 0 or _rows_apart(ring, now, now - period) > close:
        period += 1
    if period < long:
        settled = now - period
        oldest = max(now - ring.shape[0] + 1, 1)
        while settled > oldest and _rows_apart(ring, settled - 1, settled - 1 + period) <= close:
            settled -= 1
        course[ADVANCED] = advanced[settled % ring.shape[0]]
    course[SETTLED] = settled
    course[PERIOD] = period


@compiled
def settle(
    cell, count, deviate, clock, series, real, whole, log, bits, high, low, travel, course, begun,
    ring, link, advanced, head, same_slips, slips, most_cycles, most_work, downhill, rounding,
    close, dormant,
):  # fmt: skip
    """Follow cycles until the chain has settled, `most_cycles` are over, or the work is done.

    Parameters
    ----------
    cell, count, deviate, clock, series, real, whole, log : ndarray
        See `layout`.
    bits : ndarray of uint64
        The memory of `cell`.
    high, low : ndarray, shape (2,)
        ``l0 theta`` at the ends of both half-cycles, as two floats.
    travel : ndarray, shape (2,)
        Room for `kernel.follow`.
    course : ndarray of int64
        How far it has come; see the cells above.
    begun : ndarray, shape (4,)
        The sum of all displacements at the end of the last whole cycle, as two floats; how nearly
        the forces have returned; the largest sum of displacements down the incline.
    ring : ndarray, shape (rows, 3, n)
        The states at the ends of the last cycles.
    link, advanced : ndarray of int64, shape (rows,)
        The cycle before of the same hash, and the last that had advanced.
    head : ndarray of int64, shape (slots,)
        The last cycle of each hash.
    same_slips : ndarray of int64, shape (rows + slots,)
        The cycle before of the same slips, and the last cycle of each hash of these.
    slips : ndarray of int64, shape (n,)
        Of every slider up to the end of the last whole cycle.
    most_cycles, most_work : int
    downhill : int
        +1 or -1: which way counts as an advance; 0: both.
    rounding : float
        The most that rounding adds to a displacement in one slip, times n.
    close : float
        How far from each other forces may be that have nearly returned.
    dormant : int
        Cycles without a slip of an inner slider.

    Returns
    -------
    int
        As of `kernel.follow`; `layout.DONE` also if it has settled.
    """
    n = whole[N]
    work = whole[WORK]
    events = whole[EVENTS]
    while course[SETTLED] < 0 and course[CYCLE] < most_cycles:
        left = most_work - max(whole[WORK] - work, whole[EVENTS] - events)
        if left <= 0:
            return BUDGET
        at = course[REACHED]
        reason, reached = kernel.follow(
            cell, count, deviate, clock, series, real, whole, log, high[at:], low[at:], travel,
            left, left, False,
        )  # fmt: skip
        course[REACHED] += reached
        if reason != DONE:
            return reason
        course[REACHED] = 0
        course[CYCLE] += 1
        moved = (real[TOTAL] - begun[0]) + (real[TOTAL_LOW] - begun[1])
        begun[0] = real[TOTAL]
        begun[1] = real[TOTAL_LOW]
        if downhill != 0:
            moved *= downhill
        else:
            moved = abs(moved)
        rounded = rounding * (whole[SLIP_TOTAL] - course[SLIPPED])
        if moved > rounded:
            course[ADVANCED] = course[CYCLE]
        down = real[TOTAL] * downhill if downhill != 0 else abs(real[TOTAL])
        if down > begun[3] + rounded:
            begun[3] = down
            course[FURTHEST] = course[CYCLE]
        course[SLIPPED] = whole[SLIP_TOTAL]
        inner = 0
        for i in range(PAD + 1, PAD + n - 1):
            inner += count[SLIPS, i]
        if inner != course[INNER]:
            course[INNER] = inner
            course[STIRRED] = course[CYCLE]
        elif n > 2 and course[DORMANT] < 0 and course[CYCLE] - course[STIRRED] >= dormant:
            course[DORMANT] = course[STIRRED]
        if whole[EVENTS] == course[BEFORE]:
            course[SETTLED] = course[CYCLE] - 1
            course[PERIOD] = 1
            course[EXACTLY] = 1
        elif whole[CONSTANT] == 1:
            # before the present state takes the oldest row of the ring
            begun[2] = _nearly_returned(
                cell, count, whole, course, ring, same_slips, advanced, slips, close
            )
            ago, last = _returned(cell, bits, whole, course, ring, link, advanced, head)
            if ago > 0:
                course[SETTLED] = course[CYCLE] - ago
                course[PERIOD] = ago
                course[ADVANCED] = last
                course[EXACTLY] = 1
            elif course[NEAR] > 0 and course[STREAK] >= max(PATIENCE, 2 * course[NEAR]):
                _shortest(course, ring, advanced, close)
        course[BEFORE] = whole[EVENTS]
    return DONE


class Memory(NamedTuple):
    """What `settle` remembers of past cycles; see there."""

    ring: NDArray[np.float64]
    link: NDArray[np.int64]
    advanced: NDArray[np.int64]
    head: NDArray[np.int64]
    same_slips: NDArray[np.int64]
    slips: NDArray[np.int64]

    @classmethod
    def of(cls, chain: Chain) -> Memory:
        """Return room for the longest period that is looked for, less for very long chains."""
        most = _MOST_BYTES // (24 * chain.n)
        rows = 1 if chain.sigma_mu != 0 else max(min(MOST_PERIOD, most), 2) + 1
        return cls(
            np.empty((rows, 3, chain.n)),
            np.zeros(rows, dtype=np.int64),
            np.zeros(rows, dtype=np.int64),
            np.zeros(_SLOTS, dtype=np.int64),
            np.zeros(rows + _SLOTS, dtype=np.int64),
            np.zeros(chain.n, dtype=np.int64),
        )


class Course:
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
        self.memory = Memory.of(chain)
        self.dormant = dormant
        self._targets = self.simulation.targets(drive, 1, 2)
        self._travel = np.empty(2)
        real = self.simulation.work.real
        total = float(real[layout.TOTAL])
        self._downhill = (chain.tan_alpha > 0) - (chain.tan_alpha < 0)
        furthest = total * self._downhill if self._downhill else abs(total)
        self._begun = np.array([total, real[layout.TOTAL_LOW], 0.0, furthest])
        self._cells = np.zeros(CELLS, dtype=np.int64)
        self._cells[[SETTLED, DORMANT]] = -1

    @property
    def cycles(self) -> int:
        """Whole cycles so far."""
        return int(self._cells[CYCLE])

    @property
    def settled_after(self) -> int | None:
        """Cycles after which it is periodic; None: not settled."""
        return self._known(SETTLED)

    @property
    def period(self) -> int | None:
        """Cycles after which the state returns; None: not settled."""
        return None if self.settled_after is None else int(self._cells[PERIOD])

    @property
    def distance(self) -> float:
        """How nearly the forces come back after a period; 0: bit for bit. Unit m g."""
        return 0.0 if self._cells[EXACTLY] else float(self._begun[2])

    @property
    def last_advance(self) -> int:
        """The last cycle, up to `settled_after` if that is known, in which x_G advanced; 0: none.

        An advance is one down the incline, by more than rounding can make; on the level, either
        way.
        """
        return int(self._cells[ADVANCED])

    @property
    def furthest(self) -> int:
        """The last cycle that took x_G further down (on the level: away) than ever; 0: none."""
        return int(self._cells[FURTHEST])

    @property
    def dormant_after(self) -> int | None:
        """Cycles after which it was first dormant; None: it never was."""
        return self._known(DORMANT)

    @property
    def dormant_now(self) -> bool:
        """Whether no inner slider has slipped for as many cycles as make the chain dormant."""
        cells = self._cells
        return self.simulation.chain.n > 2 and bool(cells[CYCLE] - cells[STIRRED] >= self.dormant)

    def _known(self, cell: int) -> int | None:
        value = int(self._cells[cell])
        return None if value < 0 else value

    def follow(self, limits: Limits = NO_LIMITS) -> tuple[Stop, str]:
        """Go on until the chain has settled, has had its cycles, or a limit is reached.

        `Stop.DONE` comes back in the first two cases, otherwise why it ended, with a sentence.
        """
        simulation, chain = self.simulation, self.simulation.chain
        work, cells = simulation.work, self._cells
        rounding = chain.n * nearest_float(chain.rounding)
        close = RETURN * (chain.friction + chain.excess + abs(chain.sin_alpha))
        begun = int(work.whole[layout.EVENTS])
        while True:
            reason = simulation.paced(
                lambda work, most: settle(
                    *work,
                    work.cell.view(np.uint64),
                    *self._targets,
                    self._travel,
                    cells,
                    self._begun,
                    *self.memory,
                    self.drive.cycles,
                    most,
                    self._downhill,
                    rounding,
                    close,
                    self.dormant,
                )
            )
            if reason == layout.DONE:
                return Stop.DONE, ""
            if reason != layout.BUDGET:
                return simulation.ending(reason)
            stop = limits.stop(int(work.whole[layout.EVENTS]) - begun)
            if stop is not None:
                return stop, limits.reason(stop)
