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
from exactcreep.solvers.exact import layout, loop
from exactcreep.solvers.exact import layout as at
from exactcreep.solvers.exact.layout import compiled, inlined
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

COURSE = np.dtype(
    [
        ("most_cycles", np.int64),
        ("downhill", np.int64),  # +1 or -1: which way counts as an advance; 0: both
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
        ("furthest", np.int64),  # the last cycle that took x_G further down than ever
        ("total", np.float64),  # of all displacements at the end of the last whole cycle
        ("total_low", np.float64),
        ("apart", np.float64),  # how nearly the forces have returned
        ("deepest", np.float64),  # largest sum of displacements down the incline
    ]
)
"""How far a chain has come on its way through cycles, and what it is asked."""


class Memory(NamedTuple):
    """What `settle` remembers of past cycles."""

    ring: NDArray[np.float64]  # (rows, 3, n): the states at the ends of the last cycles
    link: NDArray[np.int64]  # (rows,): the cycle before of the same hash
    advanced: NDArray[np.int64]  # (rows,): the last cycle that had advanced
    head: NDArray[np.int64]  # (slots,): the last cycle of each hash
    # (rows + slots,): the cycle before of the same slips, the last cycle of each hash of these
    same_slips: NDArray[np.int64]
    slips: NDArray[np.int64]  # (n,): of every slider up to the end of the last whole cycle

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


@compiled
def _slot(bits, first, last):
    """Return the hash of the present forces; the sign of a number does not count, nor of a zero."""
    state = np.uint64(14695981039346656037)
    for row in (at.FORCE, at.FORCE_LOW):
        for i in range(first, last):
            state = (state ^ (bits[row, i] << np.uint64(1))) * np.uint64(0x9E3779B97F4A7C15)
            state ^= state >> np.uint64(29)
    return np.int64(state % np.uint64(_SLOTS))


@compiled
def _returned(cell, bits, now, course, memory):
    """Keep the present state; return how many cycles ago it was the same, 0 if it was not.

    Also the last cycle that had advanced then.
    """
    ring, link, head = memory.ring, memory.link, memory.head
    first = at.PAD
    last = at.PAD + now.n
    rows = ring.shape[0]
    cycle = course.cycle
    slot = _slot(bits, first, last)
    row = head[slot]  # holds cycle numbers, from the newest back
    while row > 0 and cycle - row <= rows - 1:
        there = row % rows
        same = True
        for k, kind in enumerate((at.FORCE, at.FORCE_LOW, at.EXCESS)):
            for i in range(first, last):
                if ring[there, k, i - first] != cell[kind, i]:
                    same = False
                    break
            if not same:
                break
        if same:
            return cycle - row, memory.advanced[there]
        row = link[there]
    there = cycle % rows
    for k, kind in enumerate((at.FORCE, at.FORCE_LOW, at.EXCESS)):
        for i in range(first, last):
            ring[there, k, i - first] = cell[kind, i]
    link[there] = head[slot]
    memory.advanced[there] = course.advanced
    head[slot] = cycle
    return 0, 0


@inlined
def _apart(cell, now, state):
    """Return the largest difference of a force from those of `state`."""
    largest = 0.0
    for i in range(now.n):
        largest = max(largest, abs(cell[at.FORCE, at.PAD + i] - state[0, i]))
    return largest


@compiled
def _nearly_returned(cell, count, now, course, memory):
    """Look whether the forces have come back nearly; keep the slips of this cycle.

    Returns
    -------
    float
        How nearly, where they have.
    """
    ring, same_slips, slips = memory.ring, memory.same_slips, memory.slips
    rows = ring.shape[0]
    cycle = course.cycle
    close = course.close
    mark = np.uint64(now.events - course.before)
    for i in range(now.n):
        made = count[at.SLIPS, at.PAD + i]
        mark = (mark ^ np.uint64(made - slips[i])) * np.uint64(0x9E3779B97F4A7C15)
        mark ^= mark >> np.uint64(29)
        slips[i] = made
    slot = rows + np.int64(mark % np.uint64(_SLOTS))
    apart = 0.0
    if course.near > 0:
        apart = _apart(cell, now, ring[(cycle - course.near) % rows])
        course.streak += 1
        if apart > close:
            course.near = 0
    if course.near == 0:
        row = same_slips[slot]
        tries = 0
        while row > 0 and cycle - row < rows and tries < _TRIES:
            apart = _apart(cell, now, ring[row % rows])
            if apart <= close:
                course.near = cycle - row
                course.streak = 1
                course.near_advanced = memory.advanced[row % rows]
                break
            row = same_slips[row % rows]
            tries += 1
    same_slips[cycle % rows] = same_slips[slot]
    same_slips[slot] = cycle
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
def _shortest(course, memory):
    """Settle with the shortest period with which the forces nearly return.

    What comes to its cycle in turns from either side returns after two cycles first.
    """
    ring, close = memory.ring, course.close
    now = course.cycle
    long = course.near
    settled = now - course.streak + 1 - long
    course.advanced = course.near_advanced
    period = 1
    while long % period != 0 or _rows_apart(ring, now, now - period) > close:
        period += 1
    if period < long:
        settled = now - period
        oldest = max(now - ring.shape[0] + 1, 1)
        while settled > oldest and _rows_apart(ring, settled - 1, settled - 1 + period) <= close:
            settled -= 1
        course.advanced = memory.advanced[settled % ring.shape[0]]
    course.settled = settled
    course.period = period


@compiled
def settle(
    cell, count, deviate, clock, series, scalars, log, bits, high, low, travel, courses, memory,
    most_work,
):  # fmt: skip
    """Follow cycles until the chain has settled, has had its cycles, or the work is done.

    Parameters
    ----------
    cell, count, deviate, clock, series, scalars, log : ndarray
        See `layout`.
    bits : ndarray of uint64
        The memory of `cell`.
    high, low : ndarray, shape (2,)
        ``l0 theta`` at the ends of both half-cycles, as two floats.
    travel : ndarray, shape (2,)
        Room for `loop.follow`.
    courses : ndarray
        One `COURSE`.
    memory : Memory
    most_work : int

    Returns
    -------
    int
        As of `loop.follow`; `layout.DONE` also if it has settled.
    """
    now = scalars[0]
    course = courses[0]
    downhill = course.downhill
    n = now.n
    work = now.work
    events = now.events
    while course.settled < 0 and course.cycle < course.most_cycles:
        left = most_work - max(now.work - work, now.events - events)
        if left <= 0:
            return at.BUDGET
        begun = course.reached
        reason, reached = loop.follow(
            cell, count, deviate, clock, series, scalars, log, high[begun:], low[begun:], travel,
            left, left, False,
        )  # fmt: skip
        course.reached += reached
        if reason != at.DONE:
            return reason
        course.reached = 0
        course.cycle += 1
        moved = (now.total - course.total) + (now.total_low - course.total_low)
        course.total = now.total
        course.total_low = now.total_low
        if downhill != 0:
            moved *= downhill
        else:
            moved = abs(moved)
        rounded = course.rounding * (now.slips - course.slipped)
        if moved > rounded:
            course.advanced = course.cycle
        down = now.total * downhill if downhill != 0 else abs(now.total)
        if down > course.deepest + rounded:
            course.deepest = down
            course.furthest = course.cycle
        course.slipped = now.slips
        inner = 0
        for i in range(at.PAD + 1, at.PAD + n - 1):
            inner += count[at.SLIPS, i]
        if inner != course.inner:
            course.inner = inner
            course.stirred = course.cycle
        elif n > 2 and course.dormant < 0 and course.cycle - course.stirred >= course.calm:
            course.dormant = course.stirred
        if now.events == course.before:
            course.settled = course.cycle - 1
            course.period = 1
            course.exactly = 1
        elif now.constant == 1:
            # before the present state takes the oldest row of the ring
            course.apart = _nearly_returned(cell, count, now, course, memory)
            ago, last = _returned(cell, bits, now, course, memory)
            if ago > 0:
                course.settled = course.cycle - ago
                course.period = ago
                course.advanced = last
                course.exactly = 1
            elif course.near > 0 and course.streak >= max(PATIENCE, 2 * course.near):
                _shortest(course, memory)
        course.before = now.events
    return at.DONE


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
        self._targets = self.simulation.targets(drive, 1, 2)
        self._travel = np.empty(2)
        total, low = self.simulation.work.now[["total", "total_low"]][0].item()
        downhill = (chain.tan_alpha > 0) - (chain.tan_alpha < 0)
        self._courses = np.zeros(1, dtype=COURSE)
        course = self._courses[0]
        course["most_cycles"] = drive.cycles
        course["downhill"] = downhill
        course["rounding"] = chain.n * nearest_float(chain.rounding)
        course["close"] = RETURN * (chain.friction + chain.excess + abs(chain.sin_alpha))
        course["calm"] = dormant
        course["settled"] = course["dormant"] = -1
        course["total"], course["total_low"] = total, low
        course["deepest"] = total * downhill if downhill else abs(total)

    @property
    def cycles(self) -> int:
        """Whole cycles so far."""
        return int(self._courses["cycle"][0])

    @property
    def settled_after(self) -> int | None:
        """Cycles after which it is periodic; None: not settled."""
        return self._known("settled")

    @property
    def period(self) -> int | None:
        """Cycles after which the state returns; None: not settled."""
        return None if self.settled_after is None else int(self._courses["period"][0])

    @property
    def distance(self) -> float:
        """How nearly the forces come back after a period; 0: bit for bit. Unit m g."""
        course = self._courses[0]
        return 0.0 if course["exactly"] else float(course["apart"])

    @property
    def last_advance(self) -> int:
        """The last cycle, up to `settled_after` if that is known, in which x_G advanced; 0: none.

        An advance is one down the incline, by more than rounding can make; on the level, either
        way.
        """
        return int(self._courses["advanced"][0])

    @property
    def furthest(self) -> int:
        """The last cycle that took x_G further down (on the level: away) than ever; 0: none."""
        return int(self._courses["furthest"][0])

    @property
    def dormant_after(self) -> int | None:
        """Cycles after which it was first dormant; None: it never was."""
        return self._known("dormant")

    @property
    def dormant_now(self) -> bool:
        """Whether no inner slider has slipped for as many cycles as make the chain dormant."""
        course = self._courses[0]
        return self.simulation.chain.n > 2 and bool(
            course["cycle"] - course["stirred"] >= course["calm"]
        )

    def _known(self, name: str) -> int | None:
        value = int(self._courses[name][0])
        return None if value < 0 else value

    def follow(self, limits: Limits = NO_LIMITS) -> tuple[Stop, str]:
        """Go on until the chain has settled, has had its cycles, or a limit is reached.

        `Stop.DONE` comes back in the first two cases, otherwise why it ended, with a sentence.
        """
        simulation = self.simulation
        begun = simulation.tally.events
        while True:
            reason = simulation.paced(
                lambda work, most: settle(
                    *work, work.cell.view(np.uint64), *self._targets, self._travel, self._courses,
                    self.memory, most,
                )
            )  # fmt: skip
            if reason == layout.DONE:
                return Stop.DONE, ""
            if reason != layout.BUDGET:
                return simulation.ending(reason)
            stop = limits.stop(simulation.tally.events - begun)
            if stop is not None:
                return stop, limits.reason(stop)
