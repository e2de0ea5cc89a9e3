"""The state of a chain at rest and on a ramp in one arithmetic, exactly where that is possible.

Beside the numbers of an arithmetic, a chain in balls keeps exact ones of Q(c) (`cosine_field`) as
long as ramps and lone slips are all that happens; with these, ties and grazes can be decided.
`solvers.reference` takes it through rearrangements.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cache
from itertools import pairwise
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.contacts import Contacts
from exactcreep.model.numbers import exact_number
from exactcreep.model.rules import rules
from exactcreep.model.state import State, mirrored
from exactcreep.motion.amplified import AmplifiedErrors
from exactcreep.motion.arithmetic import Arithmetic, Undecided
from exactcreep.motion.cosine_field import EXACTLY, CosineField, Quadratic, sign_of
from exactcreep.motion.first_event import FirstEvent
from exactcreep.motion.modes import Flow, Run, forces_of
from exactcreep.solvers.interface import Start, Tally
from exactcreep.watch.limits import NO_LIMITS


@dataclass
class ExactState:
    """The state at rest in Q(c), as long as it lies there."""

    forces: list[Quadratic]
    displacements: list[Quadratic]
    theta: Quadratic

    @property
    def bits(self) -> int:
        """Size of the largest number, by its last displacements and theta."""
        return max(self.theta.bits, *(x.bits for x in self.displacements))

    def copy(self) -> ExactState:
        """Return the same numbers in lists of their own."""
        return ExactState(self.forces.copy(), self.displacements.copy(), self.theta)


@dataclass
class Rest:
    """A chain at rest: its numbers, how far rounding may have taken them, and counts up to here.

    Tensions, displacements and forces are those of the last rest; what a stop draws and what is
    counted changes at once.

    Attributes
    ----------
    tensions, displacements, forces : ndarray
        As in `State`, and ``F_n = T_n - T_(n-1) + s``.
    theta : number
    coefficients, draws : ndarray, shape (n,)
        As in `State`.
    slips : ndarray of int, shape (n,)
        Of each slider, since the last target.
    force_slack, theta_slack : number
        How far rounding may have taken the forces, and ``l0 theta``.
    mirrored : bool
        Whether the chain is, and therefore stays, the mirror image of itself.
    exact : ExactState or None
        Exact knowledge, as long as there is any.
    pinned : dict
        ``F_n / c`` of the sliders (from 0) that have just reached their threshold.
    fresh : bool
        Whether this is the start, which may not be at rest.
    evaluations : int
        Of event functions.
    tally : Tally
    """

    tensions: NDArray[Any]
    displacements: NDArray[Any]
    forces: NDArray[Any]
    theta: Any
    coefficients: NDArray[np.float64]
    draws: NDArray[np.int64]
    slips: NDArray[np.int64]
    mirrored: bool
    exact: ExactState | None
    force_slack: Any = 0
    theta_slack: Any = 0
    pinned: dict[int, Fraction] = field(default_factory=dict)
    fresh: bool = True
    evaluations: int = 0
    tally: Tally = field(default_factory=Tally)

    def copy(self) -> Self:
        """Return the same rest, which changes no more with this one."""
        return replace(
            self,
            tensions=self.tensions.copy(),
            displacements=self.displacements.copy(),
            forces=self.forces.copy(),
            coefficients=self.coefficients.copy(),
            draws=self.draws.copy(),
            slips=self.slips.copy(),
            exact=self.exact and self.exact.copy(),
            pinned=self.pinned.copy(),
            tally=replace(self.tally),
        )


class ChainAtRest:
    """A chain that is taken from rest to rest in one arithmetic.

    Parameters
    ----------
    start : Start
    arithmetic : Arithmetic
    assume : bool
        Whether balls settle what they cannot decide by the model's rules, and count it.
    amplifies : bool
        Whether it is followed what rounding grows to in a rearrangement; of no use to balls.

    Attributes
    ----------
    rates : dict of int
        By how much forces change with ``l0 theta``, of the sliders (from 0) of which they do.
    rules : Rules
        Over the numbers that it has.
    asked : tuple of int
        The slider that a rule is asked about, and the one that it is compared with.

    Notes
    -----
    All calls are made inside ``arithmetic.active()``.
    """

    def __init__(
        self,
        start: Start,
        arithmetic: Arithmetic,
        *,
        assume: bool = False,
        amplifies: bool = False,
    ) -> None:
        self.chain, self.seed, state = start.chain, start.seed, start.state
        self.arithmetic = arithmetic
        self.assume = assume or not arithmetic.encloses
        self.amplifies = amplifies
        self.contacts = Contacts(self.chain, self.seed)
        self.rates = {0: -1, self.chain.n - 1: 1} if self.chain.n > 1 else {}
        self.rules, self.asked = rules(self._sign), (0,)
        self.cosine = arithmetic.times_cosine(self.chain, Fraction(1))
        self.weight = arithmetic.times_cosine(self.chain, self.chain.tan_alpha)
        self.friction = arithmetic.times_cosine(self.chain, self.chain.mu_d)
        self.l0 = arithmetic.number(self.chain.l0)
        self.field = CosineField(self.chain.tan_alpha)
        self.rest = self._at_start(state)
        self.thresholds = self.contacts.thresholds(self.rest.coefficients, arithmetic)
        largest = max(abs(self.rest.forces)) + max(self.thresholds)
        self.rest.force_slack = 4 * arithmetic.roundoff * largest
        # the rearrangement under way
        self.way = 0
        self.flow: Flow | None = None
        self.amplified: AmplifiedErrors | None = None  # what rounding has grown to in it
        self._runs: list[Run] | None = None
        self.time: Any = arithmetic.number(0)
        self.crossed: dict[int, Fraction] = {}  # sliders that have just crossed their threshold
        self.announced = True
        self.event_number = 0
        self.runaway = False
        self.limits = NO_LIMITS

    def _at_start(self, state: State) -> Rest:
        vector = self.arithmetic.vector
        tensions = vector(state.tensions)
        return Rest(
            tensions,
            vector(state.displacements.tolist()),
            forces_of(self.arithmetic, tensions, self.weight),
            self.arithmetic.number(state.theta),
            state.coefficients.astype(np.float64),
            state.draws.astype(np.int64),
            slips=np.zeros(self.chain.n, dtype=np.int64),
            mirrored=mirrored(self.chain, state),
            exact=self._exactly(state) if self.arithmetic.encloses else None,
        )

    @property
    def tally(self) -> Tally:
        """Counts up to here."""
        return self.rest.tally

    # -- what is known exactly -----------------------------------------------------------------

    def acting(self, n: int) -> Fraction:
        """Return the static coefficient that acts at slider `n` (from 0), exactly."""
        return self.contacts.acting(self.rest.coefficients[n])

    def _exactly(self, state: State) -> ExactState | None:
        exact, rational = cache(exact_number), cache(self.field.rational)  # most of them are alike
        try:
            tensions = [exact(x, "tension") for x in state.tensions.tolist()]
            places = [rational(exact(x, "x")) for x in state.displacements.tolist()]
            theta = rational(exact_number(state.theta, "theta"))
        except ValueError:  # balls or mpmath numbers that came out of another calculation
            return None
        weight = self.field.times_cosine(self.chain.tan_alpha)
        pairs = pairwise([Fraction(0), *tensions, Fraction(0)])
        return ExactState([rational(b - a) + weight for a, b in pairs], places, theta)

    def _sign(self, x: Any, slack: Any) -> tuple[int, bool]:
        """Return a sign, and whether it is in doubt; see `rules`."""
        if isinstance(x, (Quadratic, Fraction)):
            return sign_of(x), False
        try:
            sign = self.arithmetic.sign(x, slack)
        except Undecided:
            if not self.assume:
                raise
            return 0, True
        # a zero that was rounded may be none
        return sign, sign == 0 and (bool(slack > 0) or not bool(x == 0))

    def ask(self, asked: tuple[int, ...], told: Callable[..., tuple[Any, bool]], *of: Any) -> Any:
        """Return what a rule says, and count it if that is in doubt."""
        self.asked = asked
        answer, doubt = told(*of)
        self.rest.tally.undecided += doubt
        return answer

    # -- from rest to the first start ----------------------------------------------------------

    def ramp(self, way: int, target: Fraction | None) -> bool:
        """Ramp theta in direction `way` until a slider starts, or to `target`; say if one does.

        A start that is not at rest is set in motion at its own theta.
        """
        rest = self.rest
        if rest.fresh:
            rest.fresh = False
            lacking = (self.thresholds - abs(rest.forces)).tolist()
            near = [n for n, room in enumerate(lacking) if not room > rest.force_slack]
            told, slack = self.rules.start_direction, rest.force_slack
            ways = [(n, self.ask((n,), told, *self._standing(n), slack)) for n in near]
            starts = [(n, way) for n, way in ways if way]
            if starts:
                self._set_off(starts, crossing=False)
                return True
        if way == 0:
            return False
        room, starts = self._first_starts(way)
        if not starts or (target is not None and not self._before(way, room, target)):
            if target is not None:
                self._move_theta(way, self._reach(way, target), target)
            return False
        self._move_theta(way, room, None)
        for n, sign in starts:
            rest.forces[n] = sign * self.thresholds[n]
            rest.pinned[n] = sign * self.acting(n)
            if rest.exact is not None:
                rest.exact.forces[n] = self.field.times_cosine(rest.pinned[n])
        self._set_off(starts, crossing=True)
        return True

    def _standing(self, n: int) -> tuple[Any, Any]:
        """Return the force on a resting slider (from 0) and its threshold, as well as known.

        In Q(c), as rationals in units of c, or as numbers of the arithmetic.
        """
        rest = self.rest
        if rest.exact is not None:
            return rest.exact.forces[n], self.field.times_cosine(self.acting(n))
        if n in rest.pinned:
            return rest.pinned[n], self.acting(n)
        return (self.flow or rest).forces[n], self.thresholds[n]

    def _first_starts(self, way: int) -> tuple[Any, list[tuple[int, int]]]:
        """Return how far ``l0 theta`` can go before a slider starts, and which start then."""
        nearest, starts = None, []
        for n, rate in self.rates.items():
            room, order = self.lacking(n, way * rate), -1
            if starts and self.rest.mirrored:
                order = 0
            elif starts:
                pair, slack = (n, starts[0][0]), 2 * self.rest.force_slack
                order = self.ask(pair, self.rules.order, room, nearest, slack)
            if order < 0:
                nearest, starts = room, []
            if order <= 0:
                starts.append((n, way * rate))
        return nearest, starts

    def lacking(self, n: int, sign: int) -> Any:
        """Return what a slider (from 0) of the chain at rest lacks to start with `sign`."""
        force, threshold = self._standing(n)
        left = threshold - sign * force
        return self.arithmetic.number(left) * self.cosine if isinstance(left, Fraction) else left

    def _reach(self, way: int, target: Fraction) -> Any:
        """Return how far ``l0 theta`` goes to `target`."""
        if self.rest.exact is not None:
            return way * self.chain.l0 * (self.field.rational(target) - self.rest.exact.theta)
        return way * self.l0 * (self.arithmetic.number(target) - self.rest.theta)

    def _before(self, way: int, room: Any, target: Fraction) -> bool:
        """Whether a slider that lacks `room` starts before `target`."""
        slack = self.rest.force_slack + self.rest.theta_slack + self._theta_rounding(room)
        told = self.rules.is_before
        return bool(self.ask((), told, room, self._reach(way, target), slack))

    def _theta_rounding(self, room: Any) -> Any:
        if not self.arithmetic.roundoff:
            return 0
        return 8 * self.arithmetic.roundoff * (abs(self.l0 * self.rest.theta) + abs(room))

    def _move_theta(self, way: int, room: Any, target: Fraction | None) -> None:
        """Let ``l0 theta`` go by `room` in direction `way`, to `target` if that is given."""
        rest, exact = self.rest, self.rest.exact
        if exact is not None:
            by = way * room
            exact.theta = exact.theta + by / self.chain.l0
            for n, rate in self.rates.items():
                exact.forces[n] = exact.forces[n] + (by if rate > 0 else -by)
            room = room.ball()
        by = way * room
        if target is None:
            rest.theta_slack = rest.theta_slack + self._theta_rounding(room)
            rest.theta = rest.theta + by / self.l0
        else:
            rest.theta_slack, rest.theta = 0, self.arithmetic.number(target)
        if self.chain.n == 1:
            return
        if not bool(room == 0):
            rest.tensions = rest.tensions - by
            for n, rate in self.rates.items():
                rest.forces[n] = rest.forces[n] + (by if rate > 0 else -by)
            rest.pinned.clear()
        if exact is not None:
            for n in self.rates:
                rest.forces[n] = exact.forces[n].ball()

    def _set_off(self, starts: list[tuple[int, int]], *, crossing: bool) -> None:
        """Begin a rearrangement."""
        self.time = self.arithmetic.number(0)
        self.flow = Flow(self.arithmetic, self.rest.forces, self.friction, self.rest.force_slack)
        self.announced = False
        self.event_number = 0
        self.rest.tally.rearrangements += 1
        self._start(self.flow, starts, [n for n, _ in starts] if crossing else [])
        if self.amplifies and self.chain.n > 1:
            largest = float(max(abs(self.rest.forces)) + self.friction)
            self.amplified = AmplifiedErrors(self.chain.n, self.arithmetic.roundoff, largest)
            if crossing:  # theta takes them to their threshold, whatever they are off by
                self.amplified.forces[[n for n, _ in starts]] = 0.0

    def _start(self, flow: Flow, starts: list[tuple[int, int]], crossing: list[int]) -> None:
        """Set sliders in motion, of which those of `crossing` are just at their threshold."""
        flow.start([n for n, _ in starts], [sign for _, sign in starts])
        for n in crossing:
            self.crossed[n] = self.acting(n) - self.chain.mu_d

    # -- what Q(c) decides of the sliders in motion --------------------------------------------

    def touching(self, flow: Flow, moving: list[int]) -> set[tuple[int, int]]:
        """Return the resting sliders that are known to be exactly at threshold, and the side."""
        if self.rest.exact is None:
            return set()
        beside = {m for n in moving for m in (n - 1, n + 1) if 0 <= m < self.chain.n}
        resting = [(n, *self._standing(n)) for n in beside if flow.signs[n] == 0]
        return {
            (n, side)
            for n, force, threshold in resting
            for side in (1, -1)
            if threshold == side * force
        }

    def exact_slips(self, exact: ExactState, flow: Flow, moving: list[int]) -> FirstEvent | None:
        """Return the common stop of sliders that each move alone, if Q(c) decides it.

        They start from rest together, have equally many neighbours, all at rest, and none of these
        starts: forces change monotonically, so the stop is the worst case.
        The two in the middle of a mirrored chain move alone together: their spring's middle rests.
        """
        n_sliders = self.chain.n
        friction = self.field.times_cosine(self.chain.mu_d)
        pulls = {n: int(flow.signs[n]) * exact.forces[n] - friction for n in moving}
        beside = {n: [m for m in (n - 1, n + 1) if 0 <= m < n_sliders] for n in moving}
        stiffnesses = {n: len(neighbours) for n, neighbours in beside.items()}
        middle = (n_sliders // 2 - 1, n_sliders // 2)
        if self.rest.mirrored and n_sliders % 2 == 0 and middle[0] in beside:
            for n, image in (middle, middle[::-1]):
                beside[n].remove(image)
                stiffnesses[n] += 1
        if any(flow.signs[m] for n in moving for m in beside[n]) or n_sliders == 1:
            return None
        zero = self.arithmetic.number(0)
        idle = [n for n in moving if EXACTLY.leaves(pulls[n], True, 0)[0]]
        if idle:
            return FirstEvent(zero, tuple(idle), (), ())
        w2 = stiffnesses[moving[0]]
        if any(stiffnesses[n] != w2 for n in moving):
            return None
        ways = {n: Fraction(2 * int(flow.signs[n]), w2) * pulls[n] for n in moving}
        forces = dict(enumerate(exact.forces))
        for n in moving:
            for m in beside[n]:
                forces[m] = forces[m] + ways[n]
        for m in {m for n in moving for m in beside[n]}:
            threshold = self.field.times_cosine(self.acting(m))
            if EXACTLY.start_direction(forces[m], threshold, 0)[0]:
                return None
        for n in moving:
            exact.displacements[n] = exact.displacements[n] + ways[n]
            forces[n] = forces[n] - w2 * ways[n]
        exact.forces = list(forces.values())
        time = self.arithmetic.pi() / self.arithmetic.sqrt(self.arithmetic.number(w2))
        shifts = tuple((n, [ways[n].ball()], [zero]) for n in moving)
        return FirstEvent(time, tuple(moving), (), shifts, exact=True)

    # -- the present state ---------------------------------------------------------------------

    def _shape(self, flow: Flow) -> tuple[NDArray[Any], NDArray[Any]]:
        """Return tensions and displacements at present."""
        first, last = max(min(flow.touched) - 1, 0), max(flow.touched) + 1
        tensions = self.rest.tensions.copy()
        change = np.diff(flow.moved[first : last + 1])
        tensions[first:last] = tensions[first:last] + change
        return tensions, self._displaced(flow)

    def _displaced(self, flow: Flow) -> NDArray[Any]:
        displacements = self.rest.displacements.copy()
        for n in flow.touched:
            displacements[n] = displacements[n] + flow.moved[n]
        return displacements

    def state(self) -> State:
        """Return the present state."""
        rest = self.rest
        shape = (rest.tensions, rest.displacements)
        if self.flow is not None:
            shape = self._shape(self.flow)
        return State(*shape, rest.coefficients, rest.draws, rest.theta)

    def velocities(self) -> NDArray[Any]:
        """Return the present velocities."""
        if self.flow is None:
            return self.arithmetic.zeros(self.chain.n)
        return self.flow.velocities.copy()

    def known_theta(self) -> Any:
        """Return theta, as well as it is known."""
        return self.rest.theta

    def known_moves(self) -> NDArray[Any]:
        """Return how far sliders have come in the rearrangement, as well as it is known."""
        assert self.flow is not None
        return self.flow.moved

    # -- to go on later ------------------------------------------------------------------------

    def go_on_from(self, rest: Rest) -> None:
        """Be at this rest, of the same chain and seed."""
        self.rest, self.flow = rest, None
        self.thresholds = self.contacts.thresholds(rest.coefficients, self.arithmetic)

    def renew(self) -> None:
        """Take every number at rest from its exact value, as this precision encloses it."""
        rest, exact = self.rest, self.rest.exact
        assert exact is not None
        vector = self.arithmetic.vector
        rest.forces = vector([x.ball() for x in exact.forces])
        rest.displacements = vector([x.ball() for x in exact.displacements])
        rest.theta = exact.theta.ball()
        weight = self.field.times_cosine(self.chain.tan_alpha)
        tension, tensions = self.field.rational(Fraction(0)), []
        for force in exact.forces[:-1]:
            tension = tension + force - weight
            tensions.append(tension.ball())
        rest.tensions = vector(tensions)
