"""The sliding limit: the chain without inertia and without the static excess (mu_s -> mu_d).

Every slider that reaches its threshold slides on continuously with theta, at the friction
``b_j = mu_d,j c``. With ``g_j``, its weight and the force at an end, ``|F_j| <= b_j``, summed from
either end, bounds tensions, ``D_n <= T_n <= C_n``:

    D_n = -min(sum of b_j + g_j for j <= n, sum of b_j - g_j for j > n),
    C_n = min(sum of b_j - g_j for j <= n, sum of b_j + g_j for j > n),

and a ramp takes *each spring independently* to its bound: a dilation by ``u = l0 d(theta)`` to
``max(T_n - u, D_n)``, a contraction to ``min(T_n + u, C_n)``. (The maximum and the minimum of two
sequences with bounded steps have bounded steps.) The extension ``e_n = T_n + l0 theta`` is the play
operator of ``l0 theta``: pushed up by ``l0 theta + D_n``, down by ``l0 theta + C_n``, at rest in
between; it cannot drift.

The springs at their bound form two fronts that grow inwards and meet at the *pivot*, which rests
during a dilation; another pivot rests during contractions (`exactcreep.laws.pivot_sliders`; for
equal sliders i and N + 1 - i, with ``0 < i - z < 1``, ``z = N (1 - tan_alpha/mu_d)/2``).
Displacements are the sums of extensions outwards from the pivot: O(N) per half-cycle. If either of
two neighbours may be the pivot, the balance of forces does not fix their shares of the extension
between them. If weight and end forces exceed all friction, the chain is not held; if they are
equal, it is held at any place, and there is no limit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import accumulate
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exactcreep.compiling import njit
from exactcreep.laws import PivotSliders, pivot_sliders
from exactcreep.model.chain import Chain, surplus
from exactcreep.model.drive import Drive
from exactcreep.model.numbers import InputError, nearest_float
from exactcreep.model.state import State
from exactcreep.model.uniform import END_FORCES, FRICTION
from exactcreep.solvers.interface import (
    Rearrangement,
    Simulation,
    Solver,
    Start,
    Stretch,
    Tally,
    require_like,
)
from exactcreep.solvers.tables import TargetRows
from exactcreep.watch.limits import NO_LIMITS, Limits, Stop

_PAUSE = 10**7  # sliders times half-cycles between two looks at a clock: some ten milliseconds
_SHARE = 0.5
"""Share of the extension for each of two equally possible pivots."""


def _require_held(chain: Chain) -> None:
    """Raise `InputError` unless friction holds the chain; a single slider may be at its limit."""
    excess = max(surplus(chain, 1), surplus(chain, -1))
    if excess > 0 or (excess == 0 and chain.n > 1):
        field = END_FORCES if END_FORCES in chain.unlike else "tan_alpha"
        allowed = (
            "must be less in size: without a static excess, friction has to exceed weight and end"
            ' forces; solver="exact" follows a chain that it does not hold'
        )
        raise InputError(field, getattr(chain, field), allowed)


def _resting(chain: Chain) -> PivotSliders:
    """Return the sliders that rest in dilations and in contractions, from 1."""
    if chain.n == 1:
        return PivotSliders((1,), (1,))
    return pivot_sliders(chain.each("mu_d"), chain.tan_alpha, chain.end_forces)


def _reaches(chain: Chain) -> tuple[list[float], list[float]]:
    """Return how far the tension may fall, and rise, from one side of each slider to the other."""

    def reach(way: int) -> list[float]:
        slope = way * chain.tan_alpha
        each: list[float] = chain.each("mu_d", lambda mu: chain.times_cosine(mu + slope))
        for slider in {0, chain.n - 1}:
            each[slider] += nearest_float(way * chain.pull(slider))
        return each

    return reach(1), reach(-1)


def _partial_sums(steps: Sequence[float]) -> NDArray[np.float64]:
    """Return the sums of the first 1, 2, ... numbers, rounded once from exact sums."""
    return np.array([float(total) for total in accumulate(map(Fraction, steps))])


def _bounds(uphill: Sequence[float], downhill: Sequence[float]) -> NDArray[np.float64]:
    """Return the least and the largest tension of each spring."""
    falls, rises = (
        np.minimum(_partial_sums(reach)[:-1], _partial_sums(other[::-1])[-2::-1])
        for reach, other in ((uphill, downhill), (downhill, uphill))
    )
    return np.array([-falls, rises])


def _nearest_at_rest(
    tensions: Sequence[float], uphill: Sequence[float], downhill: Sequence[float]
) -> list[float]:
    """Return the nearest tensions with ``-uphill_n <= T_n - T_(n-1) <= downhill_n``.

    Nearest means the least elastic energy ``sum (T_n - given_n)^2 / 2``, with T_0 = T_N = 0. This
    is dynamic programming over the springs. The least energy up to spring n is a convex function of
    T_n on a finite range, and its derivative is piecewise linear: `slopes` at `places`. From spring
    to spring its two halves, left and right of the root, move apart by the two bounds. Takes N^2
    steps.
    """
    places = slopes = np.zeros(1)
    best = [places[0]]
    for tension, fall, rise in zip(tensions, uphill, downhill, strict=False):
        k = int((slopes < 0).sum())
        middle = [best[-1] - fall, best[-1] + rise]
        places = np.concatenate([places[:k] - fall, middle, places[k:] + rise])
        slopes = np.concatenate([slopes[:k], [0, 0], slopes[k:]]) + (places - tension)
        k = int((slopes < 0).sum())
        root = places[min(k, len(places) - 1)]
        if 0 < k < len(places):
            step = (root - places[k - 1]) / (slopes[k] - slopes[k - 1])
            root = root - slopes[k] * step
        best.append(root)
    after, nearest = best[0], []
    for value, fall, rise in zip(best[:0:-1], uphill[:0:-1], downhill[:0:-1], strict=True):
        after = min(max(value, after - rise), after + fall)
        nearest.append(after)
    return nearest[::-1]


def _brought_to_rest(
    tensions: NDArray[np.float64], uphill: Sequence[float], downhill: Sequence[float]
) -> tuple[NDArray[np.float64], NDArray[np.float64], bool]:
    """Return the tensions at which friction holds the chain, and the displacements to them.

    `uphill` is ``b + s`` and `downhill` ``b - s`` of each slider, with its sliding friction b and
    its weight s including an end force: the most that the tension may fall or rise from spring to
    spring. If every slider moves (those at -b uphill, those at +b downhill), the balance of forces
    does not fix the place of the whole chain, which ends `_SHARE` of the range further up. The
    third result is whether there is such a range.
    """
    nearest = np.array(_nearest_at_rest(tensions.tolist(), uphill, downhill))
    x = np.append(0.0, np.cumsum(nearest - tensions))
    steps = np.diff(nearest, prepend=0.0, append=0.0)
    falls, rises = steps + uphill, downhill - steps
    margins = np.minimum(falls, rises)
    anchor, room = x[margins.argmax()], 0.0  # a slider inside its limits rests
    if not margins.max() > 0:
        fell = falls > rises
        room = x[fell].min() - x[~fell].max()
        anchor = x[~fell].max() + room * _SHARE
    return nearest, x - anchor, bool(room)


class _Configuration(NamedTuple):
    """Everything that changes: springs, sliders, and counts."""

    extension: NDArray[np.float64]
    x: NDArray[np.float64]
    carry: NDArray[np.float64]  # rounding error of x
    sliding: NDArray[np.bool_]
    slips: NDArray[np.int64]  # in this half-cycle
    counts: NDArray[np.int64]  # half-cycles that extend a shared spring, starts, stops
    way: NDArray[np.int64]  # of the last ramp, shape (1,)
    theta: NDArray[np.float64]  # shape (1,)


@njit(cache=True, nogil=True, error_model="numpy")
def _follow(thetas, l0, bounds, pivots, chain, rows):
    """Push every spring to its bound, target by target, and move the sliders outwards.

    A spring above the pivot moves the sliders above it, a spring below the pivot moves the sliders
    below it. Two pivots share the extension of the spring between them. The first row of `bounds`
    (shape (2, n - 1), the least and the largest tensions) and of `pivots` (shape (2, 2), the
    sliders between which the limit is open, from 0) is for dilations.
    """
    n = chain.x.size
    for q in range(thetas.size):
        chain.slips[:] = 0
        way, place = int(np.sign(l0 * thetas[q] - l0 * chain.theta[0])), l0 * thetas[q]
        chain.theta[0] = thetas[q]
        if way == -chain.way[0]:
            chain.counts[2] += chain.sliding.sum()
            chain.sliding[:] = False
        if way != 0:
            chain.way[0] = way
            row = 0 if way > 0 else 1
            above, below = pivots[row]
            pushed = bounds[row] + place
            change = way * np.maximum(way * (pushed - chain.extension), 0.0)
            chain.extension[:] = np.where(change != 0, pushed, chain.extension)
            shift = np.zeros(n)
            shift[below + 1 :] = np.cumsum(change[below:])
            shift[:above] = -np.cumsum(change[:above][::-1])[::-1]
            if below > above:
                shift[below:] += _SHARE * change[above]
                shift[: above + 1] -= _SHARE * change[above]
                chain.counts[0] += change[above] != 0
            total = chain.x + shift
            chain.carry[:] += (chain.x - total) + shift
            chain.x[:] = total
            starts = (shift != 0) & ~chain.sliding
            chain.sliding[starts] = True
            chain.slips[starts] += 1
            chain.counts[1] += starts.sum()
        rows.x_G[q] = (chain.x.sum() + chain.carry.sum()) / n
        if len(rows.x) > 0:
            rows.x[q] = chain.x + chain.carry
        if len(rows.tension) > 0:
            rows.tension[q] = chain.extension - place
        if len(rows.slips) > 0:
            rows.slips[q, :] = chain.slips


class SlidingSimulation(Simulation):
    def __init__(self, start: Start, record: tuple[str, ...]) -> None:
        chain, state = start.chain, start.state
        self.chain, self.seed, self.record = chain, start.seed, record
        self._l0 = nearest_float(chain.l0)
        self._start = state
        _require_held(chain)
        n, self._resting = chain.n, _resting(chain)
        uphill, downhill = _reaches(chain)
        self._bounds = _bounds(uphill, downhill)
        self._pivots = np.array([[rests[0] - 1, rests[-1] - 1] for rests in self._resting])
        tensions, x = state.tensions.astype(float), state.displacements.astype(float)
        forces, left_open = np.diff(tensions, prepend=0.0, append=0.0), False
        slack = 4 * np.spacing(max([*abs(tensions), *uphill, *downhill]))
        self._relaxed = bool(np.any(np.maximum(forces - downhill, -forces - uphill) > slack))
        if self._relaxed:
            tensions, shift, left_open = _brought_to_rest(tensions, uphill, downhill)
            x = x + shift
        self._chain = _Configuration(
            extension=tensions + self._l0 * float(state.theta),
            x=x,
            carry=np.zeros(n),
            sliding=np.zeros(n, dtype=np.bool_),
            slips=np.zeros(n, dtype=np.int64),
            counts=np.array([left_open, 0, 0], dtype=np.int64),
            way=np.zeros(1, dtype=np.int64),
            theta=np.array([float(state.theta)]),
        )
        if start.unrounded is not None:
            self.restore(start.unrounded)
            self._chain.slips[:] = self._chain.counts[:] = 0

    @property
    def tally(self) -> Tally:  # type: ignore[override]
        gave_way, starts, stops = self._chain.counts.tolist()
        return Tally(events=starts + stops, slips=starts, undecided=gave_way)

    def follow(self, drive: Drive, first: int, count: int, limits: Limits = NO_LIMITS) -> Stretch:
        n, before = self.chain.n, self.tally.events
        rows, done = TargetRows.empty(self.record, count, n), 0
        stop: Stop | None = None
        while stop is None:
            used = self.tally.events - before
            # no slider starts or stops more than once in a half-cycle
            most = max(1, min(_PAUSE // n, (limits.events_left - used) // (2 * n)))
            until = min(done + most, count)
            theta, own = (
                drive.targets(first + done, until - done, self.seed),
                rows.part(done, until),
            )
            _follow(theta, self._l0, self._bounds, self._pivots, self._chain, own)
            done = until
            stop = Stop.DONE if done == count else limits.stop(self.tally.events - before)
        return Stretch(done, rows.recorded(self.record, done), stop, limits.reason(stop))

    def state(self) -> State:
        theta = float(self._chain.theta[0])
        return replace(
            self._start,
            tensions=self._chain.extension - self._l0 * theta,
            displacements=self._chain.x + self._chain.carry,
            theta=theta,
        )

    @property
    def at_rest(self) -> bool:
        return True

    def unrounded(self) -> dict[str, Any]:
        return self.snapshot()

    def snapshot(self) -> dict[str, Any]:
        return {name: values.copy() for name, values in self._chain._asdict().items()}

    def restore(self, snapshot: Mapping[str, Any]) -> None:
        require_like(self.snapshot(), snapshot)
        for name, values in self._chain._asdict().items():
            values[:] = snapshot[name]

    def report(self) -> dict[str, Any]:
        """Return the pivots, and whether the limit is unique."""
        chain = self.chain
        return {
            "arithmetic": "float64",
            "static_excess_left_out": chain.mu_s != chain.mu_d or chain.sigma_mu > 0,
            "start_relaxed": self._relaxed,
            "pivots": list(self._resting.dilation),
            "unique": self.tally.undecided == 0,
        }


@dataclass(frozen=True)
class Sliding(Solver):
    """The sliding limit: no inertia, no static excess; `mu_s` and `sigma_mu` have no effect.

    A start that friction cannot hold first goes to the rest state nearest in elastic energy. A slip
    is the uninterrupted sliding of one slider. Its start, and its stop where theta turns, count as
    events, but there are no rearrangements, and events cannot be recorded. Each extension is the
    rounded exact one, without drift. If two neighbours may be the pivot (decided in rationals), the
    limit is not unique: they take equal shares, and such half-cycles count as undecided.
    """

    needs_slips: ClassVar[bool] = False
    takes: ClassVar[frozenset[str]] = frozenset({FRICTION, END_FORCES})
    records: ClassVar[tuple[str, ...]] = ("x_G", "x", "tension", "slips")
    no_more: ClassVar[str] = ": without inertia there are no events; solver 'exact' has them"
    name: ClassVar[str] = "sliding"
    summary: ClassVar[str] = "no inertia, no static excess: piecewise linear in theta"

    def rearrange_from(self, start: Start, direction: int, limits: Limits) -> Rearrangement:
        allowed = "has no rearrangements (sliders slide continuously with theta); use 'exact'"
        raise InputError("solver", self.name, allowed)

    def simulation_from(self, start: Start, record: tuple[str, ...]) -> Simulation:
        return SlidingSimulation(start, record)
