"""The state of a chain at rest in Q(c), and the slips that stay in this field.

Ramps and lone slips change forces, displacements and theta within Q(c) (see `cosine_field`). Until
anything else happens, ties and grazes are decided.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cache
from itertools import accumulate, pairwise
from typing import Self

from exactcreep.model.chain import Chain
from exactcreep.model.numbers import exact_number
from exactcreep.model.state import State
from exactcreep.motion.cosine_field import EXACTLY, CosineField, Quadratic
from exactcreep.motion.first_event import FirstEvent
from exactcreep.motion.modes import Flow


@dataclass
class ExactState:
    """Forces, displacements and theta at rest."""

    chain: Chain
    field: CosineField
    forces: list[Quadratic]
    displacements: list[Quadratic]
    theta: Quadratic

    @classmethod
    def of(cls, chain: Chain, field: CosineField, state: State) -> Self | None:
        """Return a state; None if its numbers are balls or mpmath numbers of a calculation."""
        exact, rational = cache(exact_number), cache(field.rational)  # most numbers are equal
        try:
            tensions = [exact(x, "tension") for x in state.tensions.tolist()]
            places = [rational(exact(x, "x")) for x in state.displacements.tolist()]
            theta = rational(exact_number(state.theta, "theta"))
        except ValueError:
            return None
        weight, around = field.times_cosine(chain.tan_alpha), [Fraction(0), *tensions, Fraction(0)]
        pulls = (b - a + chain.pull(n) for n, (a, b) in enumerate(pairwise(around)))
        return cls(chain, field, [rational(pull) + weight for pull in pulls], places, theta)

    @property
    def bits(self) -> int:
        """Size of the largest number, by its last displacements and theta."""
        return max(self.theta.bits, *(x.bits for x in self.displacements))

    @property
    def tensions(self) -> Iterable[Quadratic]:
        """The tensions."""
        weight, forces = self.field.times_cosine(self.chain.tan_alpha), self.forces.copy()
        forces[0] = forces[0] - self.field.rational(self.chain.end_forces[0])
        return accumulate(force - weight for force in forces[:-1])

    def copy(self) -> Self:
        """Return an independent copy."""
        return replace(self, forces=self.forces.copy(), displacements=self.displacements.copy())

    def touching(
        self, flow: Flow, moving: list[int], acting: Callable[[int], Fraction]
    ) -> set[tuple[int, int]]:
        """Return the sliders beside moving ones that rest exactly at threshold, and the side."""
        beside = {m for n in moving for m in (n - 1, n + 1) if 0 <= m < self.chain.n}
        held = {n: self.field.times_cosine(acting(n)) for n in beside if flow.signs[n] == 0}
        both = ((n, side) for n in held for side in (1, -1))
        return {(n, side) for n, side in both if held[n] == side * self.forces[n]}

    def slip(
        self, flow: Flow, moving: list[int], acting: Callable[[int], Fraction], *, symmetric: bool
    ) -> FirstEvent | None:
        """Return the common stop of sliders that each move alone, if Q(c) decides it; go there.

        They start together from rest, have equally many neighbours, all at rest, and none of the
        neighbours starts: forces change monotonically, so the stop is the worst case. The two
        middle sliders of a mirrored chain move alone together, since their spring's middle rests.
        """
        n_sliders, number = self.chain.n, flow.arithmetic.number
        frictions = self.chain.each("mu_d", self.field.times_cosine)
        pulls = {n: int(flow.signs[n]) * self.forces[n] - frictions[n] for n in moving}
        beside = {n: [m for m in (n - 1, n + 1) if 0 <= m < n_sliders] for n in moving}
        stiffnesses = {n: len(neighbours) for n, neighbours in beside.items()}
        middle = (n_sliders // 2 - 1, n_sliders // 2)
        if symmetric and n_sliders % 2 == 0 and middle[0] in beside:
            for n, image in (middle, middle[::-1]):
                beside[n].remove(image)
                stiffnesses[n] += 1
        if any(flow.signs[m] for n in moving for m in beside[n]) or n_sliders == 1:
            return None
        zero = number(0)
        idle = [n for n in moving if EXACTLY.leaves(pulls[n], True, 0)[0]]
        if idle:
            return FirstEvent(zero, tuple(idle), (), ())
        w2 = stiffnesses[moving[0]]
        if any(stiffnesses[n] != w2 for n in moving):
            return None
        ways = {n: Fraction(2 * int(flow.signs[n]), w2) * pulls[n] for n in moving}
        forces = dict(enumerate(self.forces))
        for n in moving:
            for m in beside[n]:
                forces[m] = forces[m] + ways[n]
        for m in {m for n in moving for m in beside[n]}:
            threshold = self.field.times_cosine(acting(m))
            if EXACTLY.start_direction(forces[m], threshold, 0)[0]:
                return None
        for n in moving:
            self.displacements[n] = self.displacements[n] + ways[n]
            forces[n] = forces[n] - w2 * ways[n]
        self.forces = list(forces.values())
        time = flow.arithmetic.pi() / flow.arithmetic.sqrt(number(w2))
        shifts = tuple((n, [ways[n].ball()], [zero]) for n in moving)
        return FirstEvent(time, tuple(moving), (), shifts, exact=True)
