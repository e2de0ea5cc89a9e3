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
from numba.extending import register_jitable
from numpy.typing import NDArray

from exactcreep.compiling import njit
from exactcreep.laws import PivotSliders, pivot_sliders, pivots
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
    if chain.unlike:
        return pivot_sliders(chain.each("mu_d"), chain.tan_alpha, chain.end_forces)
    found = [i - 1 for i in pivots(chain.n, chain.tan_alpha, chain.mu_d)]
    return PivotSliders(tuple(found), tuple(chain.n + 1 - i for i in reversed(found)))


def _reaches(chain: Chain, coefficient: str = "mu_d") -> tuple[list[float], list[float]]:
    """Return how far the tension may fall, and rise, from one side of each slider to the other."""

    def reach(way: int) -> list[float]:
        each: list[float] = chain.each(
            coefficient, lambda mu: chain.times_cosine(mu + way * chain.tan_alpha)
        )
        for slider, force in zip((0, -1), chain.end_forces, strict=True):
            if force:
                each[slider] += nearest_float(way * force)
        return each

    return reach(1), reach(-1)


def _partial_sums(steps: Sequence[float]) -> list[float]:
    """Return the sums of the first 1, 2, ... numbers, rounded once from exact sums."""
    if min(steps) == max(steps):
        return [count * steps[0] for count in range(1, len(steps) + 1)]
    return [float(total) for total in accumulate(map(Fraction, steps))]


def _bounds(uphill: Sequence[float], downhill: Sequence[float]) -> list[list[float]]:
    """Return the least and the largest tension of each spring."""
    bounds = []
    for way, reach, other in ((-1, uphill, downhill), (1, downhill, uphill)):
        above, below = _partial_sums(reach)[:-1], _partial_sums(other[::-1])[-2::-1]
        bounds.append([way * min(sums) for sums in zip(above, below, strict=True)])
    return bounds


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


def tension_bounds(chain: Chain, coefficient: str = "mu_d") -> NDArray[np.float64]:
    """Return the least and the largest tension of each spring that `mu_d` or `mu_s` allows."""
    return np.array(_bounds(*_reaches(chain, coefficient)))


class _Ways(NamedTuple):
    """The effect of a ramp on springs; the first row of each array is for dilations."""

    bounds: NDArray[np.float64]  # shape (2, n - 1): the least (dilation) or largest tension
    pivots: NDArray[np.int64]  # shape (2, 2): the sliders between which the limit is open, from 0


class _Configuration(NamedTuple):
    """Everything that changes: springs, sliders, and counts."""

    extension: NDArray[np.float64]
    x: NDArray[np.float64]
    carry: NDArray[np.float64]  # rounding error of x
    sliding: NDArray[np.int8]
    slips: NDArray[np.int64]  # in this half-cycle
    counts: NDArray[np.int64]  # half-cycles that extend a shared spring, starts, stops


@register_jitable
def _ramp(way, place, ways, chain):
    """Push every spring to its bound at ``place = l0 theta``, and move the sliders outwards.

    A spring above the pivot moves the sliders above it, a spring below the pivot moves the sliders
    below it. Two pivots share the extension of the spring between them.
    """
    row = 0 if way > 0 else 1
    above, below = ways.pivots[row, 0], ways.pivots[row, 1]
    pushed = ways.bounds[row] + place
    change = way * np.maximum(way * (pushed - chain.extension), 0.0)
    chain.extension[:] = np.where(change != 0, pushed, chain.extension)
    shift = np.zeros(chain.x.size)
    shift[below + 1 :] = np.cumsum(change[below:])
    shift[:above] = -np.cumsum(change[:above][::-1])[::-1]
    if below > above:
        shift[below:] += _SHARE * change[above]
        shift[: above + 1] -= _SHARE * change[above]
        chain.counts[0] += change[above] != 0
    total = chain.x + shift
    chain.carry[:] += (chain.x - total) + shift
    chain.x[:] = total
    starts = (shift != 0) & (chain.sliding == 0)
    chain.sliding[starts] = 1
    chain.slips[starts] += 1
    chain.counts[1] += starts.sum()


@njit(cache=True, nogil=True, error_model="numpy")
def _follow(places, start, way, ways, chain, rows):
    """Follow ``places = l0 theta`` from `start`; return the direction of the last ramp."""
    n = chain.x.size
    place = start
    for q in range(places.size):
        chain.slips[:] = 0
        turn = int(np.sign(places[q] - place))
        place = places[q]
        if turn != 0:
            if turn != way:
                chain.counts[2] += chain.sliding.sum()
                chain.sliding[:] = 0
            way = turn
            _ramp(way, place, ways, chain)
        rows.x_G[q] = (chain.x.sum() + chain.carry.sum()) / n
        if len(rows.x) > 0:
            rows.x[q] = chain.x + chain.carry
        if len(rows.tension) > 0:
            rows.tension[q] = chain.extension - place
        if len(rows.slips) > 0:
            rows.slips[q, :] = chain.slips
    return way


class SlidingSimulation(Simulation):
    def __init__(self, start: Start, record: tuple[str, ...]) -> None:
        chain, state = start.chain, start.state
        self.chain, self.seed, self.record = chain, start.seed, record
        self._l0 = nearest_float(chain.l0)
        self._start = state
        self._relaxed = False
        self._way = 0
        self._theta = float(state.theta)
        _require_held(chain)
        n, resting = chain.n, _resting(chain)
        uphill, downhill = _reaches(chain)
        self._ways = _Ways(
            tension_bounds(chain),
            np.array([[sliders[0] - 1, sliders[-1] - 1] for sliders in resting]),
        )
        tensions, x = state.tensions.astype(float), state.displacements.astype(float)
        left_open = False
        forces = np.diff(tensions, prepend=0.0, append=0.0)
        slack = 4 * np.spacing(max([*abs(tensions), *uphill, *downhill]))
        if np.any(forces > np.add(downhill, slack)) or np.any(forces < -np.add(uphill, slack)):
            tensions, shift, left_open = _brought_to_rest(tensions, uphill, downhill)
            x = x + shift
            self._relaxed = True
        self._chain = _Configuration(
            extension=tensions + self._l0 * self._theta,
            x=x,
            carry=np.zeros(n),
            sliding=np.zeros(n, dtype=np.int8),
            slips=np.zeros(n, dtype=np.int64),
            counts=np.array([left_open, 0, 0], dtype=np.int64),
        )
        if start.unrounded is not None:
            self._go_on(start.unrounded)
            self._chain.slips[:] = self._chain.counts[:] = 0

    @property
    def tally(self) -> Tally:  # type: ignore[override]
        gave_way, starts, stops = self._chain.counts.tolist()
        return Tally(events=starts + stops, slips=starts, undecided=gave_way)

    def follow(self, drive: Drive, first: int, count: int, limits: Limits = NO_LIMITS) -> Stretch:
        n, before = self.chain.n, self.tally.events
        rows = TargetRows.empty(self.record, count, n)
        done = 0
        stop: Stop | None = None
        while stop is None:
            used = self.tally.events - before
            # no slider starts or stops more than once in a half-cycle
            most = max(1, min(_PAUSE // n, (limits.events_left - used) // (2 * n)))
            until = min(done + most, count)
            theta = drive.targets(first + done, until - done, self.seed)
            places, start = self._l0 * theta, self._l0 * self._theta
            own = rows.part(done, until)
            self._way = int(_follow(places, start, self._way, self._ways, self._chain, own))
            self._theta = float(theta[-1])
            done = until
            stop = Stop.DONE if done == count else limits.stop(self.tally.events - before)
        return Stretch(done, rows.recorded(self.record, done), stop, limits.reason(stop))

    def state(self) -> State:
        return replace(
            self._start,
            tensions=self._chain.extension - self._l0 * self._theta,
            displacements=self._chain.x + self._chain.carry,
            theta=self._theta,
        )

    @property
    def at_rest(self) -> bool:
        return True

    def unrounded(self) -> dict[str, Any]:
        taken = {name: values.copy() for name, values in self._chain._asdict().items()}
        return taken | {"way": self._way, "theta": self._theta}

    def _go_on(self, kept: Mapping[str, Any]) -> None:
        require_like(self.unrounded(), kept)
        self._way, self._theta = kept["way"], kept["theta"]
        for name, values in self._chain._asdict().items():
            values[:] = kept[name]

    def snapshot(self) -> dict[str, Any]:
        return {"unrounded": self.unrounded()}

    def restore(self, snapshot: Mapping[str, Any]) -> None:
        require_like(self.snapshot(), snapshot)
        self._go_on(snapshot["unrounded"])

    def report(self) -> dict[str, Any]:
        """Return the pivots, and whether the limit is unique."""
        chain = self.chain
        return {
            "arithmetic": "float64",
            "static_excess_left_out": chain.mu_s != chain.mu_d or chain.sigma_mu > 0,
            "start_relaxed": self._relaxed,
            "pivots": list(_resting(chain).dilation),
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
