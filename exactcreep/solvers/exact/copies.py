"""Perturbed copies of a run, followed beside it until one of them differs.

Each copy begins with slightly different tensions. At every target it is rounded once more, by about
the rounding error of the events since the last target. Two close chains separate at the same rate
as the run separates from the truth; an error of the start alone may be forgotten at the next stop.

A start with tensions may be next to a margin that rounding has crossed, but no copy. So pairs that
are further off, to either side, go to the first target. If they slip differently, the order of
events is undecided (unless a tie has made it undecided before). There are three pairs, because a
copy may be on the same side by chance if events amplify later roundings more than the start's.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exactcreep.compiling import compiled
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Drive, Leg
from exactcreep.model.numbers import nearest_float
from exactcreep.model.state import symmetric
from exactcreep.solvers.exact import layout
from exactcreep.solvers.exact.double_double import add, plus, two_sum
from exactcreep.solvers.exact.layout import MOST_WORK, PAD
from exactcreep.solvers.exact.loop import follow, prepare
from exactcreep.solvers.exact.pack import (
    Origin,
    place,
    restore,
    series_of,
    side_by_side,
    snapshot,
    turn,
)
from exactcreep.solvers.exact.rows import TENSION, TENSION_LOW, AtTargets
from exactcreep.solvers.interface import PerturbedCopies, Stretch, require_like
from exactcreep.watch.limits import Limits

COPIES = 2
"""Number of copies; the first that differs counts."""
_NUDGE = 2.0**-50
"""Initial error of the tensions of a copy, relative to the largest force."""
_FAR = 16.0
"""Factor of the initial error of the pairs that go to the first target."""
_BLOCKS = (1, 2, 3)
"""For each pair: number of springs after which the sign of its error changes."""
_ROUNDING = 2.0**-52
"""Rounding of displacements at a target, relative to the largest force, per root of events."""
_NO_LOG = layout.Log(np.empty(0, dtype=layout.LOGGED_EVENT), None)

Targets = Callable[[Drive, int, int, int], tuple[NDArray[np.float64], NDArray[np.float64]]]
"""Returns ``l0 theta`` of targets of a drive, from the first, as two arrays of floats."""


class ExactCopies(PerturbedCopies):
    """Copies of a simulation of `Exact`; their arrays hold one copy after the other.

    `origin` is the start of the simulation; `targets` is `ExactSimulation.targets`. The chain has
    at least two sliders, and copies of a mirror-symmetric chain stay symmetric.
    """

    def __init__(self, chain: Chain, origin: Origin, seed: int, targets: Targets) -> None:
        self._targets, self._seed, self._chain = targets, seed, chain
        pull = max(map(abs, chain.end_forces))
        largest = nearest_float(chain.largest_mu_s + abs(chain.tan_alpha) + pull)
        self._size, self._symmetric = _ROUNDING * largest, symmetric(chain, origin.state)
        self._origin, self._nudge = origin, _NUDGE * largest
        self._at_target = AtTargets.of(1, ("tension", "slips"), origin.began)
        work = side_by_side(chain, origin, seed, COPIES)
        self._cell, self._whole, self._deviate, self._series, self._now = work
        self._numbers = np.empty((COPIES, *origin.numbers.shape))
        self._begin(self._nudge, (1, 2))

    def _begin(self, size: float, blocks: tuple[int, int]) -> None:
        """Let the copies begin with an error `size` of the tensions.

        Its sign changes after as many springs as the copy's block; the second copy begins with the
        opposite sign.
        """
        self._numbers[:] = self._origin.numbers
        begin_copies(
            self._cell, self._whole, self._deviate, self._now, self._numbers,
            self._origin.of_chain, self._origin.state.draws, size, blocks,
        )  # fmt: skip
        self._deviate[1:] = self._deviate[0]  # all copies have the same draws ahead

    def follow(
        self, drive: Drive, first: int, stretch: Stretch, apart: float, limits: Limits
    ) -> tuple[NDArray[np.float64], bool]:
        """Compare the copies with a run; see `PerturbedCopies.follow`."""
        high, low = self._targets(drive, first, stretch.completed, self._seed)
        tensions, slips = stretch.recorded["tension"], stretch.recorded["slips"]
        passed = high, low, tensions, slips
        start, count = self._origin.state.theta, len(high) if drive.springs else 0
        ways = (drive.leg(first + k, start) for k in range(count))
        legs = [leg for leg in ways if leg is not None]
        at_first = np.zeros(0)
        settled_by_rules = stretch.doubts is not None and bool((stretch.doubts[:1] > 0).any())
        tense = self._origin.numbers[TENSION : TENSION_LOW + 1].any()
        # a comparison settled by the rules makes later targets undecided anyway
        if first == 1 and tense and not settled_by_rules:
            at_first = self._near_start([rows[:1] for rows in passed], legs[:1], limits.events_left)
        distance, whole = self._pass(passed, legs, limits.events_left, apart)
        both = min(distance.size, at_first.size)
        distance[:both] = np.maximum(distance[:both], at_first[:both])
        return distance, whole

    def _near_start(
        self, passed: Sequence[NDArray[np.float64]], legs: Sequence[Leg], most_events: int
    ) -> NDArray[np.float64]:
        """Return the distance of a run at its first target from the far copies, over `_FAR`."""
        now, distance = self._now.view(np.int64), np.zeros(0)  # by fields it takes longer
        at_start = now.copy()
        for block in _BLOCKS:
            self._begin(_FAR * self._nudge, (block, block))
            away, _ = self._pass(passed, legs, most_events, np.inf)
            distance = np.maximum(away / _FAR, distance) if distance.size else away / _FAR
            now[:] = at_start
        self._begin(self._nudge, (1, 2))
        return distance

    def _pass(
        self, passed: Sequence[NDArray[np.float64]], legs: Sequence[Leg], most_events: int,
        apart: float,
    ) -> tuple[NDArray[np.float64], bool]:  # fmt: skip
        """Pass targets, given ``l0 theta`` in two parts, and tensions and slips of the run.

        If each spring has its own dilation, the targets are passed one by one along `legs`.
        """
        distances, whole = [np.zeros(0)], True
        for q, leg in enumerate(legs):
            turn(self._chain, leg, self._cell, self._now)
            origin = self._origin._replace(numbers=self._numbers).at_leg(self._chain, leg)
            target = self._at_target._replace(began=(origin.numbers[0], *origin.began[1:]))
            alone = [rows[q : q + 1] for rows in passed]
            away, whole = self._pass_at_once(
                alone, most_events, apart, origin.numbers, target, symmetric=False
            )
            distances.append(away)
            if not whole or away[0] > apart:
                return np.concatenate(distances), whole and q + 1 == len(legs)
        if not legs:
            own = self._numbers, self._at_target
            return self._pass_at_once(passed, most_events, apart, *own, symmetric=self._symmetric)
        return np.concatenate(distances), whole

    def _pass_at_once(
        self, passed: Sequence[NDArray[np.float64]], most_events: int, apart: float,
        numbers: NDArray[np.float64], target: AtTargets, *, symmetric: bool,
    ) -> tuple[NDArray[np.float64], bool]:  # fmt: skip
        """Pass targets; the copies' tensions follow from `numbers` and `target`."""
        most = len(passed[0])
        distance, reached = np.zeros(most), np.zeros(COPIES, dtype=np.int64)
        ends = np.array([most])
        goes_on = most > 0
        while goes_on:
            goes_on = follow_copies(
                self._cell, self._whole, self._deviate, self._series, self._now,
                _NO_LOG, numbers, target, *passed, distance, reached, ends, apart,
                most_events, MOST_WORK, self._size, symmetric,
            )  # fmt: skip
            if self._series is None and goes_on:
                self._series = series_of(self._numbers.shape[2])
        return distance[: reached.max()], bool((reached == most).all())

    def snapshot(self) -> dict[str, Any]:
        """Return how far the copies are, at a target."""
        return snapshot(self._cell, self._whole, self._now, self._numbers.shape[2])

    def restore(self, snapshot: Mapping[str, Any]) -> None:
        """Go on from a snapshot, or raise `ValueError` if it is of another kind."""
        require_like(self.snapshot(), snapshot)
        restore(snapshot, self._cell, self._whole, self._now)
        for copy in range(COPIES):
            now = self._now[copy : copy + 1]
            prepare(self._cell[copy], self._whole[copy], self._deviate[copy], now)


@compiled
def begin_copies(cell, whole, deviate, scalars, numbers, of_chain, draws, size, blocks):
    """Change the tensions of copies, and place their sliders; only the first prepares draws."""
    springs = numbers.shape[2] - 1
    for copy in range(scalars.size):
        for k in range(springs):
            odd = (min(k, springs - 1 - k) // blocks[copy] + copy) % 2
            off = -size if odd == 1 else size
            tension, error = two_sum(numbers[copy, TENSION, k], off)
            numbers[copy, TENSION, k] = tension
            numbers[copy, TENSION_LOW, k] += error
        place(cell[copy], whole[copy], scalars[copy : copy + 1], numbers[copy], of_chain, draws)
    prepare(cell[0], whole[0], deviate[0], scalars[:1])


@compiled
def follow_copies(
    cell, whole, deviate, series, scalars, log, numbers, at_target, theta, theta_low,
    tensions, slips, distance, reached, ends, apart, most_events, max_work, size, symmetric,
):  # fmt: skip
    """Take each copy along the targets of a run, until one differs by `apart`.

    Each copy has passed `reached` targets, and all go up to ``ends[0]``. Draws and roundings depend
    only on the numbers of copy and target, so that calls may end anywhere: soon after `max_work`,
    or when several sliders move and there are no `series`. Returns whether there is more to do.
    """
    single = max_work < 0  # never; the constant would make `follow` compile again
    for number in range(scalars.size):
        now = scalars[number]
        work_limit = now.counts.work + now.counts.events + max_work
        began = (numbers[number],) + at_target.began[1:]  # noqa: RUF005, numba
        target = AtTargets(at_target.rows, at_target.doubts, began)
        while reached[number] < ends[0] and now.counts.events < most_events:
            work = work_limit - now.counts.work - now.counts.events
            if work <= 0:
                return True
            q = reached[number]
            reason, passed = follow(
                cell[number], whole[number], deviate[number], None, series,
                scalars[number : number + 1], log, theta[q : q + 1], theta_low[q : q + 1], target,
                most_events - now.counts.events, work, single,
            )  # fmt: skip
            away = 0.0
            if passed == 1:
                away = _distance(target.rows, tensions[q], slips[q])
                _round(cell[number], now, target.rows.slips[0], number, size, symmetric)
            elif reason != layout.BUDGET:  # the copy runs away, the run did not
                away = np.inf
            elif series is None and now.stage == layout.CLUSTER:
                return True
            if passed == 1 or away > 0.0:
                distance[q] = max(distance[q], away)
                reached[number] += 1
            if away > apart:
                ends[0] = q + 1
        ends[0] = min(ends[0], reached[number])  # if one stops here, the others need go no further
    return False


@compiled
def _distance(copy, tension, slips):
    """Return the distance of a copy from the run, over its largest tension; inf: other slips."""
    largest, away = 1.0, 0.0
    for k in range(tension.size):
        largest = max(largest, abs(tension[k]))
        away = max(away, abs(tension[k] - copy.tension[0, k]))
    for k in range(slips.size):
        if slips[k] != copy.slips[0, k]:
            return np.inf
    return away / largest


@compiled
def _round(cell, now, slips, number, size, symmetric):
    """Move each slider that has slipped, up or down, by `size` times the root of the events."""
    n = now.chain.n
    word = np.uint64(now.counts.rearrangements) * np.uint64(0x9E3779B97F4A7C15)
    word ^= np.uint64(number + 1) * np.uint64(0xD1B54A32D192ED03)
    for _ in range(2):  # Marsaglia's xorshift
        word ^= word << np.uint64(13)
        word ^= word >> np.uint64(7)
        word ^= word << np.uint64(17)
    size *= math.sqrt(2.0 * slips.sum())
    for slider in range(n):
        k, way = slider, 1.0
        if symmetric and 2 * k >= n - 1:
            k, way = n - 1 - k, -1.0 if 2 * k > n - 1 else 0.0
        if slips[slider] == 0 or way == 0.0:
            continue
        moved = way * size
        if (word >> np.uint64(k % 64)) & np.uint64(1):
            moved = -moved
        i = slider + PAD
        add(cell, layout.TRAVEL, layout.TRAVEL_LOW, i, moved)
        now.total, now.total_low = plus(now.total, now.total_low, moved)
        add(cell, layout.FORCE, layout.FORCE_LOW, i, -cell[layout.STIFFNESS, i] * moved)
        cell[layout.REST, i] = cell[layout.FORCE, i]
        for j in (i - 1, i + 1):
            if PAD <= j < PAD + n:
                add(cell, layout.FORCE, layout.FORCE_LOW, j, moved)
                cell[layout.REST, j] = cell[layout.FORCE, j]
