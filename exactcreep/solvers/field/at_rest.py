"""A chain at rest and on a ramp in one arithmetic, with exact numbers where that is possible.

A chain in balls also keeps exact numbers (`exact_state`) for as long as it can.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.contacts import Contacts
from exactcreep.model.drive import Leg
from exactcreep.model.enclosure import exact_value
from exactcreep.model.numbers import nearest_float
from exactcreep.model.rules import rules
from exactcreep.model.state import State, symmetric
from exactcreep.motion.arithmetic import Arithmetic, Undecided
from exactcreep.motion.cosine_field import EXACTLY, CosineField, Quadratic, sign_of
from exactcreep.motion.modes import forces_of, frictions_of, loads_of
from exactcreep.solvers.field.exact_state import ExactState
from exactcreep.solvers.interface import Start, Tally


@dataclass
class Rest:
    """A chain at rest: its numbers, bounds of their rounding errors, and counts.

    Tensions, displacements and forces belong to the last rest; draws at stops and counts change at
    once.
    """

    tensions: NDArray[Any]
    displacements: NDArray[Any]
    forces: NDArray[Any]
    theta: Any  # along a `Leg`: the finished part of the way
    coefficients: NDArray[np.float64]  # as in `State`
    draws: NDArray[np.int64]
    slips: NDArray[np.int64]  # of each slider, since the last target
    symmetric: bool  # whether the chain is, and therefore stays, the mirror image of itself
    exact: ExactState | None  # as long as all of it lies in Q(c)
    force_slack: Any = 0  # how far rounding may have taken forces, and l0 theta
    theta_slack: Any = 0
    # F_n / c of the sliders (from 0) that have just reached their threshold
    pinned: dict[int, Fraction] = field(default_factory=dict)
    leg: Leg | None = None  # if each spring has its own dilation
    fresh: bool = True  # whether this is the start, which may not be at rest
    evaluations: int = 0  # of event functions
    tally: Tally = field(default_factory=Tally)

    def copy(self) -> Self:
        """Return an independent copy."""
        own = {name: x.copy() for name, x in vars(self).items() if hasattr(x, "copy")}
        return replace(self, **own, tally=replace(self.tally))


class ChainAtRest(ABC):
    """A chain at rest, and on ramps, in one arithmetic; use it inside ``arithmetic.active()``.

    `assume`: whether balls settle undecided comparisons by the model's rules, and count them.

    Attributes
    ----------
    rates : dict of int to Fraction
        Change of forces per ``l0 theta``, for sliders (from 0) on which it is not zero.
    stretches : dict of int to float
        Uncertainty of their rooms relative to forces: 1/|rate|, rounded up.
    rules : Rules
        Over the numbers of this chain.
    asked : tuple of int
        The slider in question, and the slider that it is compared with.
    """

    def __init__(self, start: Start, arithmetic: Arithmetic, *, assume: bool = False) -> None:
        self.chain, self.seed, state = start.chain, start.seed, start.state
        self.arithmetic = arithmetic
        self.assume = assume or not arithmetic.encloses
        self.contacts = Contacts(self.chain, self.seed)
        self.rules = rules(self._sign)
        self.asked: tuple[int, ...] = ()
        self.stretch: float = 1  # uncertainty of a number relative to a force
        self.cosine = arithmetic.times_cosine(self.chain, Fraction(1))
        self.loads = loads_of(arithmetic, self.chain)
        self.frictions = frictions_of(arithmetic, self.chain)
        self.l0 = arithmetic.number(self.chain.l0)
        self.field = CosineField(self.chain.tan_alpha)
        self.rest = self._at_start(state)
        self._take_rates()
        self.thresholds = self.contacts.thresholds(self.rest.coefficients, arithmetic)
        largest = max(abs(self.rest.forces)) + max(self.thresholds)
        self.rest.force_slack = 4 * arithmetic.roundoff * largest

    def _at_start(self, state: State) -> Rest:
        vector = self.arithmetic.vector
        tensions, exact, leg = vector(state.tensions), None, None
        if state.springs:
            leg = Leg(*2 * (tuple(exact_value(theta) for theta in state.theta.tolist()),))
            state = replace(state, theta=0)
        if self.arithmetic.encloses:
            exact = ExactState.of(self.chain, self.field, state)
        return Rest(
            tensions,
            vector(state.displacements.tolist()),
            forces_of(self.arithmetic, tensions, self.loads),
            self.arithmetic.number(state.theta),
            state.coefficients.astype(np.float64),
            state.draws.astype(np.int64),
            slips=np.zeros(self.chain.n, dtype=np.int64),
            symmetric=symmetric(self.chain, state),
            exact=exact,
            leg=leg,
        )

    def turn(self, leg: Leg) -> None:
        """Start a leg: theta becomes the finished part of the way; the chain is at rest."""
        rest = self.rest
        rest.leg, rest.theta, rest.theta_slack = leg, self.arithmetic.number(0), 0
        rest.symmetric = rest.symmetric and leg.mirrors(self.chain)
        if rest.exact is not None:
            rest.exact.theta = self.field.rational(Fraction(0))
        self._take_rates()

    def _take_rates(self) -> None:
        """Set the effect of theta on springs and sliders, by the chain or the present leg."""
        leg, chain, number = self.rest.leg, self.chain, nearest_float
        self.rates = chain.rates if leg is None else leg.rates(chain)
        shares = chain.expansion if leg is None else leg.expansion(chain)
        self.expansion: Any = self.arithmetic.vector(shares) if shares else 1  # of each spring
        sizes = {n: abs(rate) for n, rate in self.rates.items()}
        self.stretches = {
            n: 1 if size == 1 else math.nextafter(number(1 / size), math.inf)
            for n, size in sizes.items()
        }

    @property
    def tally(self) -> Tally:
        """Counts so far."""
        return self.rest.tally

    # -- exact numbers -------------------------------------------------------------------------

    def acting(self, n: int) -> Fraction:
        """Return the static coefficient that acts at slider `n` (from 0), exactly."""
        return self.contacts.acting(n, self.rest.coefficients[n])

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
        # a rounded zero may not be zero
        return sign, sign == 0 and (bool(slack > 0) or not bool(x == 0))

    def ask(
        self, asked: tuple[int, ...], told: Callable[..., tuple[Any, bool]], *of: Any,
        stretch: float = 1,
    ) -> Any:  # fmt: skip
        """Return the answer of a rule, and count it if it is in doubt.

        `stretch` is the uncertainty of the numbers relative to forces.
        """
        self.asked, self.stretch = asked, stretch
        answer, doubt = told(*of)
        self.rest.tally.undecided += doubt
        return answer

    # -- from rest to the first start ----------------------------------------------------------

    def ramp(self, way: int, target: Fraction | None) -> bool:
        """Ramp theta in direction `way` until a slider starts, or to `target`; say if one does.

        A start that is not at rest begins to move at its own theta.
        """
        rest = self.rest
        if rest.fresh:
            rest.fresh = False
            lacking = (self.thresholds - abs(rest.forces)).tolist()
            near = [n for n, room in enumerate(lacking) if not room > rest.force_slack]
            told, slack = self.rules.start_direction, rest.force_slack
            ways = [(n, self.ask((n,), told, *self.standing(n, rest.forces), slack)) for n in near]
            starts = [(n, way) for n, way in ways if way]
            if starts:
                self._set_off(starts, crossing=False)
                return True
        if way == 0:
            return False
        room, starts = self._first_starts(way)
        if not starts or (target is not None and not self._before(way, room, target, starts)):
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

    def standing(self, n: int, forces: NDArray[Any]) -> tuple[Any, Any]:
        """Return the force on a resting slider (from 0) and its threshold, as precisely as known.

        Both are in Q(c), rationals in units of c, or numbers of the arithmetic.
        """
        rest = self.rest
        if rest.exact is not None:
            return rest.exact.forces[n], self.field.times_cosine(self.acting(n))
        if n in rest.pinned:
            return rest.pinned[n], self.acting(n)
        return forces[n], self.thresholds[n]

    def _first_starts(self, way: int) -> tuple[Any, list[tuple[int, int]]]:
        """Return how far ``l0 theta`` can go before a slider starts, and who starts."""
        nearest: Any = None
        starts: list[tuple[int, int]] = []
        last = self.chain.n - 1
        for n, rate in self.rates.items():
            if self.rest.symmetric and n > last - n:
                continue  # it starts with its image
            sign, order = EXACTLY.driven(rate, way)[0], -1
            room = self.room(n, sign)
            if starts:
                pair = n, starts[0][0]
                stretch = max(self.stretches[k] for k in pair)
                slack = 2 * self.rest.force_slack * stretch
                order = self.ask(pair, self.rules.order, room, nearest, slack, stretch=stretch)
            if order < 0:
                nearest, starts = room, []
            if order <= 0:
                starts.append((n, sign))
        if self.rest.symmetric:
            starts += [(last - n, -sign) for n, sign in starts[::-1]]
        return nearest, starts

    def room(self, n: int, sign: int) -> Any:
        """Return how far ``l0 theta`` can go until a slider (from 0) starts with `sign`."""
        lacking, rate = self.lacking(n, sign), self.rates[n]
        if rate in (1, -1):
            return lacking
        return lacking / abs(rate if self.rest.exact is not None else self.arithmetic.number(rate))

    def lacking(self, n: int, sign: int) -> Any:
        """Return the distance of a resting slider (from 0) from a start with `sign`."""
        force, threshold = self.standing(n, self.rest.forces)
        left = threshold - sign * force
        return self.arithmetic.number(left) * self.cosine if isinstance(left, Fraction) else left

    def _reach(self, way: int, target: Fraction) -> Any:
        """Return the change of ``l0 theta`` to `target`."""
        if self.rest.exact is not None:
            return way * self.chain.l0 * (self.field.rational(target) - self.rest.exact.theta)
        return way * self.l0 * (self.arithmetic.number(target) - self.rest.theta)

    def _before(self, way: int, room: Any, target: Fraction, starts: list[tuple[int, int]]) -> bool:
        """Whether sliders that lack `room` start before `target`."""
        stretch = max(self.stretches[n] for n, _ in starts)
        slack = self.rest.force_slack * stretch + self.rest.theta_slack
        slack = slack + self._theta_rounding(room)
        told, reach = self.rules.is_before, self._reach(way, target)
        return bool(self.ask((), told, room, reach, slack, stretch=stretch))

    def _theta_rounding(self, room: Any) -> Any:
        if not self.arithmetic.roundoff:
            return 0
        return 8 * self.arithmetic.roundoff * (abs(self.l0 * self.rest.theta) + abs(room))

    def _move_theta(self, way: int, room: Any, target: Fraction | None) -> None:
        """Change ``l0 theta`` by `room` in direction `way`, to `target` if that is given."""
        rest, exact = self.rest, self.rest.exact
        if exact is not None:
            by = way * room
            exact.theta = exact.theta + by / self.chain.l0
            for n, rate in self.rates.items():
                exact.forces[n] = exact.forces[n] + _at_rate(by, rate)
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
            rest.tensions = rest.tensions - self.expansion * by
            for n, rate in self.rates.items():
                rest.forces[n] = rest.forces[n] + _at_rate(by, rate, self.arithmetic.number)
            rest.pinned.clear()
        if exact is not None:
            for n in self.rates:
                rest.forces[n] = exact.forces[n].ball()

    @abstractmethod
    def _set_off(self, starts: list[tuple[int, int]], *, crossing: bool) -> None:
        """Begin a rearrangement; `crossing`: theta has taken `starts` to their threshold."""

    # -- the present state ---------------------------------------------------------------------

    def state(self) -> State:
        """Return the present state."""
        rest = self.rest
        return State(*self._shape(), rest.coefficients, rest.draws, self.dilation(rest.theta))

    def dilation(self, theta: Any) -> Any:
        """Return the dilation at `theta`; of each spring where they differ."""
        leg, arithmetic = self.rest.leg, self.arithmetic
        return theta if leg is None else arithmetic.vector(leg.at(theta, arithmetic.number))

    def _shape(self) -> tuple[NDArray[Any], NDArray[Any]]:
        return self.rest.tensions, self.rest.displacements

    def known_theta(self) -> Any:
        """Return theta, as precisely as it is known."""
        return self.rest.theta

    # -- to continue later ---------------------------------------------------------------------

    def go_on_from(self, rest: Rest) -> None:
        """Continue from this rest, of the same chain and seed."""
        self.rest = rest
        self._take_rates()
        self.thresholds = self.contacts.thresholds(rest.coefficients, self.arithmetic)

    def renew(self) -> None:
        """Compute every number at rest from its exact value, at the present precision."""
        rest, exact = self.rest, self.rest.exact
        assert exact is not None
        vector = self.arithmetic.vector
        rest.forces = vector([x.ball() for x in exact.forces])
        rest.displacements = vector([x.ball() for x in exact.displacements])
        rest.theta = exact.theta.ball()
        rest.tensions = vector([x.ball() for x in exact.tensions])


def _at_rate(by: Any, rate: Fraction, number: Callable[[Fraction], Any] = Fraction) -> Any:
    """Return ``rate by``, without a product if the rate is 1 or -1."""
    if rate == 1:
        return by
    return -by if rate == -1 else number(rate) * by
