"""The first event of the moving chain, by steps that are guaranteed to be free of events.

Every slider that may act next has an *event function* of time, positive until its event: the speed
of a moving slider, or the distance of a resting slider from its threshold. B bounds its second
derivative for ever. With value g and slope d at time t there is no root before
``t + (d + sqrt(d^2 + 2 g B)) / B``; and if ``d < 0`` and ``4 g B <= d^2`` there is exactly one root
in ``[t, t + 2 g / |d|]``. Only the function that may be next is evaluated. The first function whose
bracket ends before all others may vanish is the event; interval Newton refines it. Just after an
event the trivial root is removed by the first derivative that is not zero, never by an epsilon.
Lone slips need no search.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Any, NamedTuple

import flint
from numpy.typing import NDArray

from exactcreep.model.rules import Rules, rules
from exactcreep.motion.arithmetic import Undecided, certain_sign
from exactcreep.motion.cosine_field import sign_of
from exactcreep.motion.modes import Flow, Run
from exactcreep.watch.limits import NO_LIMITS, Limits

MOST_EVALUATIONS = 20_000
"""Most evaluations of one search; a motion that needs more is given up, and reported."""
ORDERS = 6
"""Derivatives that show how a slider leaves a trivial root."""
EARLY_REFINEMENTS = 2
"""Newton steps of the leading root before other functions are examined."""
EXACTLY = rules(lambda x, slack: (sign_of(x), False))
"""The rules of the model over rationals and numbers of Q(cos(alpha))."""


Ask = Callable[..., Any]
"""Asks a rule, with the numbers of the rule."""


class SearchLimit(ArithmeticError):
    """No event was found or excluded within `MOST_EVALUATIONS`."""


Shifts = tuple[tuple[int, list[Any], list[Any]], ...]


class FirstEvent(NamedTuple):
    """The first event, and its time.

    ``time``: since the last event; it encloses the only root, and no event comes before.
    ``stops``: sliders (from 0) that come to rest; ``starts``: sliders that cross their threshold,
    with directions. ``shifts``, if known: the first slider of each run, and the displacements and
    velocities of its sliders at the event. ``alike``: they are the same in all states of a set.
    """

    time: Any
    stops: tuple[int, ...]
    starts: tuple[tuple[int, int], ...]
    shifts: Shifts | None = None
    alike: bool = False


@dataclass(eq=False)
class EventFunction:
    """A function of time that is positive until a slider acts.

    ``side`` is 0 for a moving slider (the function is its speed), else the direction in which the
    resting slider would start (the function is its distance to the threshold). ``terms``: the
    movers whose velocity, or displacement, times ``sign`` it contains. ``safe``: no root before
    this time; ``last``: the only root is not after this time (None: not isolated).
    """

    slider: int
    side: int
    sign: int
    terms: Sequence[tuple[Run, int]]
    value: Any
    slope: Any
    bound: Any
    safe: Any = 0
    last: Any = None
    steepness: Any = None
    grazes: int = 0
    refinements: int = 0

    def __call__(self, t: Any) -> tuple[Any, Any]:
        """Return value and slope at `t`."""
        if self.side == 0:
            run, i = self.terms[0]
            _, v, a = run.slider(i, t)
            return self.sign * v, self.sign * a
        value, slope = self.value, 0
        for run, i in self.terms:
            u, v, _ = run.slider(i, t)
            value = value + self.sign * u
            slope = slope + self.sign * v
        return value, slope


class Search:
    """The search for the first event of a flow and its runs.

    `thresholds` (ndarray, shape (n,)): ``mu_s cos(alpha)`` as it acts; `assume`: whether the rules
    settle undecided comparisons, which are counted; `half`: whether the lower half of the chain
    mirrors the upper half and is not watched; `limits`: their time ends the search.
    """

    def __init__(
        self,
        flow: Flow,
        runs: Sequence[Run],
        thresholds: NDArray[Any],
        *,
        assume: bool = False,
        half: bool = False,
        limits: Limits = NO_LIMITS,
    ) -> None:
        self.flow = flow
        self.limits = limits
        self.arithmetic = flow.arithmetic
        self.thresholds = thresholds
        self.assume = assume
        self.evaluations = 0
        self.undecided = 0
        last = len(flow.forces) // 2 if half else len(flow.forces)
        every = [*self._stops(runs), *self._starts(runs)]
        self.functions = [function for function in every if function.slider < last]

    def first(self, horizon: Any = None) -> list[EventFunction]:
        """Return the functions that act first and enclose the time; several act together.

        Empty if nothing ever happens, or nothing before `horizon`. Raises `SearchLimit`, and
        `Undecided` if a graze or the order of two events is undecided.
        """
        for function in self.functions:
            self._begin(function)
        while self.functions:
            leader = min(self.functions, key=attrgetter("safe"))
            if leader.safe == math.inf or (horizon is not None and leader.safe > horizon):
                return []
            if leader.last is None:
                self._evaluate(leader)
                continue
            rivals = [w for w in self.functions if w is not leader and not w.safe > leader.last]
            if not rivals:
                return [leader]
            if leader.refinements < EARLY_REFINEMENTS and self.refine(leader):
                continue
            loose = [w for w in rivals if w.last is None]
            if loose:
                self._evaluate(loose[0])
                continue
            if sum(self.refine(w) for w in [leader, *rivals]):
                continue
            if leader.last == 0:  # at once, together with all others that begin at time 0
                return [leader, *(w for w in rivals if w.last == 0)]
            if not self.assume:
                raise Undecided("two events are too close to be told apart")
            self.undecided += len(rivals)
            return [leader, *rivals]
        return []

    def refine(self, function: EventFunction) -> bool:
        """Narrow the bracket of an isolated root by an interval Newton step; say if it helped."""
        width = function.last - function.safe
        if function.steepness is None or not width > 0:
            return False
        self._count()
        function.refinements += 1
        middle = ((function.safe + function.last) / 2).mid()
        value, slope = function(middle)
        spread = function.bound * width / 2
        root = middle - value / (slope + (-spread).union(spread))
        low, high = root.lower(), root.upper()
        low = low if low > function.safe else function.safe
        high = high if high < function.last else function.last
        if not high - low < 0.75 * width:
            return False
        function.safe, function.last = low, high
        return True

    # -- who may act ---------------------------------------------------------------------------

    def _stops(self, runs: Sequence[Run]) -> list[EventFunction]:
        flow, out = self.flow, []
        for run in runs:
            for i, n in enumerate(run.sliders):
                sign = int(flow.signs[n])
                bound = run.bound(i, 2).upper()
                speed, slope = sign * flow.velocities[n], sign * run.accelerations[i]
                out.append(EventFunction(n, 0, sign, [(run, i)], speed, slope, bound))
        return out

    def _starts(self, runs: Sequence[Run]) -> list[EventFunction]:
        flow, out = self.flow, []
        neighbours: dict[int, list[tuple[Run, int]]] = {}
        for run in runs:
            for n, i in ((run.first - 1, 0), (run.first + run.p, run.p - 1)):
                if 0 <= n < len(flow.forces):
                    neighbours.setdefault(n, []).append((run, i))
        for n, terms in neighbours.items():
            bound = sum(run.bound(i, 1) for run, i in terms).upper()
            rate = sum(run.velocities[i] for run, i in terms)
            for side in (1, -1):
                room = self.thresholds[n] - side * flow.forces[n]
                out.append(EventFunction(n, side, -side, terms, room, -side * rate, bound))
        return out

    # -- one candidate -------------------------------------------------------------------------

    def _begin(self, function: EventFunction) -> None:
        """Take the first step of a candidate, from its values at time 0."""
        trivial = function.side == 0 and bool(self.flow.velocities[function.slider] == 0)
        if trivial or self._sign(function.value) == 0:
            self._depart(function)
        else:
            self._step(function, self.arithmetic.number(0), function.value, function.slope)

    def _sign(self, x: Any) -> int:
        try:
            return certain_sign(x)
        except Undecided:
            if not self.assume:
                raise
            return 0

    def _depart(self, function: EventFunction) -> None:
        """Leave the trivial root at time 0 by the first derivative that is not zero."""
        zero = self.arithmetic.number(0)
        exactly = function.side == 0 or bool(function.value == 0)
        lead = k = 0
        for derivative in self._derivatives(function):
            lead, k = self._sign(derivative), k + 1
            if lead:
                break
            exactly = exactly and bool(derivative == 0)
        self.undecided += not exactly
        function.safe, function.last = math.inf, None
        if EXACTLY.leaves(lead, function.side == 0, 0)[0]:
            function.safe = function.last = zero
        elif lead:
            # g(t) >= d_k t^k / k! - B_(k+1) t^(k+1) / (k+1)!
            order = k + 1 if function.side == 0 else k
            total = sum(run.bound(i, order) for run, i in function.terms)
            bound = total.upper()
            if not bool(bound == 0):
                function.safe = ((k + 1) * derivative / bound).lower()

    def _derivatives(self, function: EventFunction) -> list[Any]:
        """Return derivatives 1 .. ORDERS of the candidate's function at time 0."""
        out: list[Any] = [self.arithmetic.number(0)] * ORDERS
        for run, i in function.terms:
            # v, a, -K v, -K a, K^2 v, ... are the derivatives of v from the 0th on
            even, odd = run.velocities.tolist(), run.accelerations.tolist()
            series = [even[i], odd[i]]
            while len(series) < ORDERS + 1:
                even, odd = run.bent(even), run.bent(odd)
                series += [even[i], odd[i]]
            if function.side == 0:
                del series[0]
            out = [x + function.sign * y for x, y in zip(out, series, strict=False)]
        return out

    def _step(self, function: EventFunction, t: Any, value: Any, slope: Any) -> None:
        """Step the candidate from `t`: isolate its root, or pass a time without roots."""
        sign, reach = self._sign(value), abs(value)
        if slope < 0 and 4 * reach * function.bound <= slope * slope:
            function.safe = t
            function.last = (t + 2 * reach / -slope).upper()
            function.steepness = slope
            return
        if sign < 0 and function.grazes:  # it is not a graze after all
            function.safe = function.last = t
            return
        if sign <= 0:
            self._graze(function, t)
            return
        if bool(function.bound == 0):
            function.safe = math.inf  # the slope is constant, and not negative
            return
        root = self.arithmetic.sqrt(slope * slope + 2 * value * function.bound)
        step = 2 * value / (root - slope) if slope < 0 else (slope + root) / function.bound
        function.safe = (t + step).lower()

    def _graze(self, function: EventFunction, t: Any) -> None:
        """Settle a root that is not simple at this precision: a mover stops, a rest stays."""
        if not self.assume:
            raise Undecided("a grazing root is not decided")
        self.undecided += function.grazes == 0
        function.grazes += 1
        if EXACTLY.leaves(0, function.side == 0, 0)[0]:
            function.safe = function.last = t
            return
        slack = abs(function(t)[0]).upper()
        # by then the function has left the undecided band, or its bound is used again
        function.safe = (t + 2 * self.arithmetic.sqrt(slack / function.bound)).upper()

    def _evaluate(self, function: EventFunction) -> None:
        self._count()
        before = function.safe
        self._step(function, before, *function(before))
        if function.last is None and not function.safe > before:
            self._graze(function, before)

    def _count(self) -> None:
        self.evaluations += 1
        self.limits.require()
        if self.evaluations > MOST_EVALUATIONS:
            raise SearchLimit(f"no event found within {MOST_EVALUATIONS} evaluations")


def root_time(search: Search, function: EventFunction) -> Any:
    """Return an enclosure of the time of an isolated root."""
    while search.refine(function):
        pass
    return function.safe.union(function.last)


def lone_slips(
    flow: Flow, thresholds: NDArray[Any], rules: Rules, ask: Ask, *, symmetric: bool
) -> FirstEvent | None:
    """Return the common stop of sliders that each move alone, None if there is none.

    They have just started, have equally many neighbours, all at rest, and none of the neighbours
    starts: forces change monotonically, so the stop is the worst case. The two middle sliders of a
    mirrored chain move alone together, since their spring's middle rests.
    """
    n_sliders, moving, number = len(flow.forces), flow.moving, flow.arithmetic.number
    beside = {n: [m for m in (n - 1, n + 1) if 0 <= m < n_sliders] for n in moving}
    stiffnesses = {n: len(neighbours) for n, neighbours in beside.items()}
    middle = (n_sliders // 2 - 1, n_sliders // 2)
    if symmetric and n_sliders % 2 == 0 and middle[0] in beside:
        for n, image in (middle, middle[::-1]):
            beside[n].remove(image)
            stiffnesses[n] += 1
    fresh = all(bool(flow.velocities[n] == 0) for n in moving)
    neighbours = [m for n in moving for m in beside[n]]
    if not (fresh and all(stiffnesses.values())) or flow.signs[neighbours].any():
        return None
    pulls = {n: int(flow.signs[n]) * flow.forces[n] - flow.friction[n] for n in moving}
    zero = number(0)
    idle = [n for n in moving if ask(rules.leaves, pulls[n], True, 0)]
    if idle:
        return FirstEvent(zero, tuple(idle), (), ())
    w2 = stiffnesses[moving[0]]
    if any(stiffnesses[n] != w2 for n in moving):
        return None
    ways = {n: 2 * int(flow.signs[n]) * pulls[n] / w2 for n in moving}
    pushes: dict[int, Any] = {}
    for n in moving:
        for m in beside[n]:
            pushes[m] = pushes.get(m, 0) + ways[n]
    for m, push in pushes.items():
        if ask(rules.start_direction, flow.forces[m] + push, thresholds[m], 0):
            return None
    time = flint.arb.pi() / flow.arithmetic.sqrt(number(w2))
    shifts = tuple((n, [ways[n]], [zero]) for n in moving)
    return FirstEvent(time, tuple(moving), (), shifts)
