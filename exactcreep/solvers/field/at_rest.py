"""A chain at rest and on a ramp: numbers in Q(c) while they are known exactly, then balls.

Ramps and lone slips stay in this field (see `cosine_field`), so that ties and grazes are decided.
A number that anything else has changed is a ball.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any, Self

import flint
import numpy as np
from numpy.typing import NDArray

from exactcreep.model.contacts import Contacts
from exactcreep.model.drive import Leg
from exactcreep.model.enclosure import enclosure, exact_value
from exactcreep.model.numbers import nearest_float
from exactcreep.model.rules import rules
from exactcreep.model.state import State, symmetric
from exactcreep.motion.arithmetic import Balls, Undecided, certain_sign, objects
from exactcreep.motion.cosine_field import MOST_BITS, CosineField, Quadratic, fmpq, sign_of
from exactcreep.motion.first_event import EXACTLY
from exactcreep.motion.state_set import StateSet
from exactcreep.solvers.interface import Start, Tally


@dataclass
class Rest:
    """A chain at rest: its numbers, and counts.

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
    leg: Leg | None = None  # if each spring has its own dilation
    fresh: bool = True  # whether this is the start, which may not be at rest
    set: StateSet | None = None  # of which this is the middle; None: balls hold every state
    since: int = 0  # events since the set was made
    evaluations: int = 0  # of event functions
    tally: Tally = field(default_factory=Tally)

    @property
    def exact(self) -> bool:
        """Whether all numbers are known exactly."""
        return all(type(x) is Quadratic for x in (self.theta, *self.forces, *self.displacements))

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
    """

    def __init__(self, start: Start, arithmetic: Balls, *, assume: bool = False) -> None:
        self.chain, self.seed, state = start.chain, start.seed, start.state
        self.arithmetic = arithmetic
        self.assume = assume
        self.contacts = Contacts(self.chain, self.seed)
        self.rules = rules(self._sign)
        self.stretch: float = 1  # uncertainty of a number relative to a force
        self.field = CosineField(self.chain.tan_alpha)
        times_cosine, rational = self.field.times_cosine, self.field.rational
        weight = times_cosine(self.chain.tan_alpha)
        self.loads = objects(weight + rational(self.chain.pull(n)) for n in range(self.chain.n))
        self.frictions = objects(self.chain.each("mu_d", times_cosine))
        self.l0 = fmpq(self.chain.l0)
        self.rest = self._at_start(state)
        self._take_rates()
        self.thresholds = self._thresholds()

    def _at_start(self, state: State) -> Rest:
        leg, theta = None, state.theta
        if state.springs:
            leg = Leg(*2 * (tuple(exact_value(theta) for theta in theta.tolist()),))
            theta = 0
        known = self._known
        tensions = objects(map(known, state.tensions.tolist()))
        return Rest(
            tensions,
            objects(map(known, state.displacements.tolist())),
            self.loads + np.diff(tensions, prepend=0, append=0),
            known(theta),
            state.coefficients.astype(np.float64),
            state.draws.astype(np.int64),
            slips=np.zeros(self.chain.n, dtype=np.int64),
            symmetric=symmetric(self.chain, state),
            leg=leg,
        )

    def _known(self, value: Any) -> Any:
        """Return a number of a state exactly, or as a ball if it has a radius."""
        known = enclosure(value)
        return self.arithmetic.number(value) if known.radius else self.field.rational(known.middle)

    def _thresholds(self) -> NDArray[Any]:
        return objects(self.held(n) for n in range(self.chain.n))

    def held(self, n: int) -> Quadratic:
        """Return the force that the present contact of slider `n` (from 0) holds, exactly."""
        return self.field.times_cosine(self.contacts.acting(n, self.rest.coefficients[n]))

    def turn(self, leg: Leg) -> None:
        """Start a leg: theta becomes the finished part of the way; the chain is at rest."""
        rest = self.rest
        rest.leg, rest.theta = leg, self.field.rational(Fraction(0))
        rest.symmetric = rest.symmetric and leg.mirrors(self.chain)
        self._take_rates()

    def _take_rates(self) -> None:
        """Set the effect of theta on springs and sliders, by the chain or the present leg."""
        leg, chain, number = self.rest.leg, self.chain, nearest_float
        self.rates = chain.rates if leg is None else leg.rates(chain)
        self.speeds = {n: fmpq(rate) for n, rate in self.rates.items()}
        self.near_rates = {n: number(rate) for n, rate in self.rates.items()}
        shares = chain.expansion if leg is None else leg.expansion(chain)
        self.expansion: Any = objects(map(fmpq, shares)) if shares else 1  # of each spring
        sizes = {n: abs(rate) for n, rate in self.rates.items()}
        self.stretches = {
            n: 1 if size == 1 else math.nextafter(number(1 / size), math.inf)
            for n, size in sizes.items()
        }

    @property
    def tally(self) -> Tally:
        """Counts so far."""
        return self.rest.tally

    def _sign(self, x: Any, slack: Any) -> tuple[int, bool]:
        """Return a sign, and whether it is in doubt; see `rules`."""
        if type(x) is not flint.arb:
            return sign_of(x), False
        try:
            sign = certain_sign(x, slack)
        except Undecided:
            if not self.assume:
                raise
            return 0, True
        return sign, False

    def ask(self, told: Callable[..., tuple[Any, bool]], *of: Any, stretch: float = 1) -> Any:
        """Return the answer of a rule, and count it if it is in doubt.

        `stretch` is the uncertainty of the numbers relative to forces.
        """
        self.stretch = stretch
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
            near = [n for n, room in enumerate(lacking) if not room > 0]
            told = self.rules.start_direction
            ways = [(n, self.ask(told, rest.forces[n], self.thresholds[n], 0)) for n in near]
            starts = [(n, way) for n, way in ways if way]
            if starts:
                self._set_off(starts, ramped=False)
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
        self._set_off(starts, ramped=True)
        return True

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
                stretch = max(self.stretches[n], self.stretches[starts[0][0]])
                order = self.ask(self.rules.order, room, nearest, 0, stretch=stretch)
            if order < 0:
                nearest, starts = room, []
            if order <= 0:
                starts.append((n, sign))
        if self.rest.symmetric:
            starts += [(last - n, -sign) for n, sign in starts[::-1]]
        return nearest, starts

    def room(self, n: int, sign: int) -> Any:
        """Return how far ``l0 theta`` can go until a slider (from 0) starts with `sign`."""
        return (self.thresholds[n] - sign * self.rest.forces[n]) / abs(self.speeds[n])

    def _reach(self, way: int, target: Fraction) -> Any:
        """Return the change of ``l0 theta`` to `target`."""
        return way * self.l0 * (self.field.rational(target) - self.rest.theta)

    def _before(self, way: int, room: Any, target: Fraction, starts: list[tuple[int, int]]) -> bool:
        """Whether sliders that lack `room` start before `target`."""
        stretch = max(self.stretches[n] for n, _ in starts)
        told, reach = self.rules.is_before, self._reach(way, target)
        return bool(self.ask(told, room, reach, 0, stretch=stretch))

    def _move_theta(self, way: int, room: Any, target: Fraction | None) -> None:
        """Change ``l0 theta`` by `room` in direction `way`, to `target` if that is given."""
        rest, by = self.rest, way * room
        rest.theta = rest.theta + by / self.l0 if target is None else self.field.rational(target)
        if self.chain.n > 1 and not bool(room == 0):
            rest.tensions = rest.tensions - self.expansion * by
            for n, rate in self.speeds.items():
                rest.forces[n] = rest.forces[n] + rate * by

    @abstractmethod
    def _set_off(self, starts: list[tuple[int, int]], *, ramped: bool) -> None:
        """Begin a rearrangement; `ramped`: theta has taken `starts` to their threshold."""

    # -- the present state ---------------------------------------------------------------------

    def state(self) -> State:
        """Return the present state, in balls."""
        rest, vector = self.rest, self.arithmetic.vector
        tensions, displacements = map(vector, self._shape())
        theta = self.dilation(self.arithmetic.number(rest.theta))
        return State(tensions, displacements, rest.coefficients, rest.draws, theta)

    def dilation(self, theta: Any) -> Any:
        """Return the dilation at `theta`; of each spring where they differ."""
        leg, arithmetic = self.rest.leg, self.arithmetic
        return theta if leg is None else arithmetic.vector(leg.at(theta, arithmetic.number))

    def _shape(self) -> tuple[NDArray[Any], NDArray[Any]]:
        return self.rest.tensions, self.rest.displacements

    def known_theta(self) -> Any:
        """Return theta, as precisely as it is known."""
        return self.arithmetic.number(self.rest.theta)

    # -- to continue later ---------------------------------------------------------------------

    def go_on_from(self, rest: Rest) -> None:
        """Continue from this rest, of the same chain and seed."""
        self.rest = rest
        self._take_rates()
        self.thresholds = self._thresholds()

    def shorten(self) -> None:
        """Replace numbers that have become too long by balls."""
        rest, number = self.rest, self.arithmetic.number
        if rest.exact and max(x.bits for x in (rest.theta, *rest.displacements)) > MOST_BITS:
            rest.theta = number(rest.theta)
            for numbers in (rest.tensions, rest.displacements, rest.forces):
                numbers[:] = [number(x) for x in numbers.tolist()]
