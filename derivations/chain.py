"""A quasi-static chain in exact rational arithmetic, as an independent witness.

Forces are measured in units of ``m g cos(alpha)`` and lengths in units of ``g tau_dyn**2
cos(alpha)``, so that friction coefficients, the slope tan(alpha), forces and ``y = l0 theta /
cos(alpha)`` are all rational. The numbers of weight, friction and springs are the model's.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cache
from typing import Any

import sympy as sp

from derivations import slip
from derivations.model import MODEL, Model, T
from derivations.notation import c, mu_d, mu_s, n, s, symbol, theta

Q = Fraction
_ZERO = Q(0)
_ZERO = Q(0)


class NotUnique(Exception):
    """Two neighbours reach their thresholds together and either may stay."""


class Avalanche(Exception):
    """A slip sets another slider in motion."""


@cache
def _numbers(model: Model) -> Callable[[Q, Q, Q], tuple[Any, ...]]:
    """Return weight, sliding and static friction, an end's slip, and what acts at the ends."""
    weight = model.force(n).subs({T(n): 0, T(n - 1): 0, theta: 0})
    parts = [weight, -model.friction(1), model.threshold(), slip.derive(model).end_move]
    numbers = [sp.expand(part.subs(s, symbol("t") * c) / c) for part in parts]
    numbers += [-model.end(0), model.end(1), model.push("first"), model.push("last")]
    numbers[-2:] = [sp.Integer(0) if push.free_symbols else push for push in numbers[-2:]]
    made: Callable[[Q, Q, Q], tuple[Any, ...]] = sp.lambdify(
        (symbol("t"), mu_d, mu_s), numbers, modules=[{}]
    )
    return made


@dataclass
class RationalChain:
    """A chain of n sliders that slips (mu_s > mu_d), or slides, in the limit mu_s -> mu_d.

    A slip from the threshold moves an end slider by 2 (mu_s - mu_d), all others at rest. A slider
    that slides carries the friction mu_d.

    Attributes
    ----------
    n : int
    slope, mu_d : Fraction
    mu_s : Fraction or None
        None: the sliding limit.
    forces : list of Fraction
        Non-frictional forces on sliders 1 .. n (from index 0).
    x : list of Fraction
        Displacements.
    y : Fraction
        l0 theta.
    slips : int
    pivot : int
        The slider that rested alone at the end of the last ramp; 0 if more than one did.
    tie : str
        Which of the last two slides if both are at their thresholds: the one that moves
        ``downhill`` or ``uphill``, the ``upper`` or the ``lower`` one; empty: `NotUnique`.
    model : Model
    """

    n: int
    slope: Q
    mu_d: Q
    mu_s: Q | None = None
    forces: list[Q] = field(default_factory=list)
    tie: str = ""
    model: Model = MODEL
    x: list[Q] = field(default_factory=list)
    y: Q = _ZERO
    slips: int = 0
    pivot: int = 0

    def __post_init__(self) -> None:
        static = self.mu_d if self.mu_s is None else self.mu_s
        weight, self.slides, self.holds, self.move, first, last, *self.push = map(
            Q, _numbers(self.model)(self.slope, self.mu_d, static)
        )
        if not self.forces:
            self.forces = [weight] * self.n
            self.forces[0] += first
            self.forces[-1] += last
        self.x = self.x or [Q(0)] * self.n

    def ramp(self, change: Q) -> None:
        """Change y by `change`, through every slip on the way (at threshold a slider stays)."""
        if self.push != [-1, 1] or (self.mu_s is not None and self.move <= 0):
            raise ValueError("theta must drive both ends outwards, and a slip lead somewhere")
        if self.n > 1 and change:
            (self._slide if self.mu_s is None else self._slip)(abs(change), 1 if change > 0 else -1)
        self.y += change

    def to(self, target: Q) -> None:
        """Bring y to a target."""
        self.ramp(target - self.y)

    def _slip(self, left: Q, up: int) -> None:
        ways = [int(up * push) for push in self.push]  # +1: an end is driven downhill
        while True:
            gaps = [
                self.holds - way * self.forces[end] if way else left
                for end, way in zip((0, -1), ways, strict=True)
            ]
            gap = min(*gaps, left)
            for end, way in zip((0, -1), ways, strict=True):
                self.forces[end] += way * gap
            left -= gap
            if left == 0:
                return
            starting = [end for end in (0, -1) if gaps[end] == gap]
            if len(starting) == self.n:
                raise Avalanche
            for end in starting:
                step = ways[end] * self.move
                self.x[end] += step
                self.forces[end] -= step
                self.forces[1 if end == 0 else -2] += step
            self.slips += len(starting)
            if max(map(abs, self.forces)) > self.holds:
                raise Avalanche

    def _slide(self, left: Q, up: int) -> None:
        """Two fronts of sliding sliders grow from the ends inwards: 1..above and below..n slide."""
        ways = [int(up * push) for push in self.push]
        above, below, self.pivot = 0, self.n + 1, 0
        while left > 0:
            if below - 1 - above == 1:
                self.pivot = above + 1
                self._slid(ways, left, above, below)
                return
            # the two groups of sliders, from above and from below, that are at their thresholds
            first, last = above, below
            while first + 1 < below and self.forces[first] == ways[0] * self.slides:
                first += 1
            while last - 1 > above and self.forces[last - 2] == ways[1] * self.slides:
                last -= 1
            if first + 1 < last:
                if (first, last) == (above, below):
                    step = min(
                        left,
                        self.slides - ways[0] * self.forces[above],
                        self.slides - ways[1] * self.forces[below - 2],
                    )
                    self._slid(ways, step, above, below)
                    left -= step
                above, below = first, last
                continue
            # all that rest are at their thresholds, but one must stay
            if first == above or last == below:
                above, below = (below - 2, below) if first > above else (above, above + 2)
                continue
            if not self.tie:
                raise NotUnique
            starts = self.tie
            if starts in ("downhill", "uphill"):
                starts = "lower" if (starts == "downhill") == (up == 1) else "upper"
            above, below = (first, last + 1) if starts == "upper" else (first - 1, last)

    def _slid(self, ways: list[int], step: Q, above: int, below: int) -> None:
        self.forces[above] += ways[0] * step
        self.forces[below - 2] += ways[1] * step
        for slider in range(1, above + 1):
            self.x[slider - 1] += ways[0] * (above + 1 - slider) * step
        for slider in range(below, self.n + 1):
            self.x[slider - 1] += ways[1] * (slider - below + 1) * step


def play_variation(path: list[Q], width: Q, start: Q) -> tuple[list[Q], Q, Q]:
    """Return the play operator's output for a path, and its total rise and total fall.

    The output stays within width/2 of the input and moves only when it must; rise plus fall is the
    input's truncated variation at level `width`.
    """
    output, rise, fall, value = [], Q(0), Q(0), start
    for target in path:
        if target - value > width / 2:
            rise += target - width / 2 - value
            value = target - width / 2
        elif value - target > width / 2:
            fall += value - target - width / 2
            value = target + width / 2
        output.append(value)
    return output, rise, fall
