"""A quasi-static chain in exact rational arithmetic, as an independent witness.

Forces are measured in units of ``m g cos(alpha)`` and lengths in units of ``g tau_dyn**2
cos(alpha)``, so that friction coefficients, the slope tan(alpha), forces and ``y = l0 theta /
cos(alpha)`` are all rational. The numbers of weight, friction and slips are the model's.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cache
from itertools import pairwise
from typing import Any

import sympy as sp

from derivations import slip
from derivations.model import MODEL
from derivations.notation import c, mu_d, mu_s, s, tan

Q = Fraction
_ZERO = Q(0)


class NotUnique(Exception):
    """Two neighbours reach their thresholds together, and either may stay."""


class Avalanche(Exception):
    """A slip sets another slider in motion."""


@cache
def _numbers() -> Callable[..., Any]:
    """Return weight, sliding and static friction, and an end's slip, of slope, mu_d and mu_s."""
    weight = MODEL.scaled(MODEL.weight)
    parts = [weight, -MODEL.friction(1), MODEL.threshold(), slip.derive().last]
    numbers = [sp.expand(part.subs(s, tan * c) / c) for part in parts]
    made: Callable[..., Any] = sp.lambdify((tan, mu_d, mu_s), numbers, modules=[{}])
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
    tie : str
        Which of the last two sliders slides if both are at their thresholds: the one that moves
        ``downhill`` or ``uphill``; empty: `NotUnique`.
    x : list of Fraction
        Displacements.
    y : Fraction
        l0 theta.
    slips : int
    """

    n: int
    slope: Q
    mu_d: Q
    mu_s: Q | None = None
    forces: list[Q] = field(default_factory=list)
    tie: str = ""
    x: list[Q] = field(default_factory=list)
    y: Q = _ZERO
    slips: int = 0

    def __post_init__(self) -> None:
        static = self.mu_d if self.mu_s is None else self.mu_s
        numbers = _numbers()(self.slope, self.mu_d, static)
        weight, self.slides, self.holds, self.move = map(Q, numbers)
        self.forces = self.forces or [weight] * self.n
        self.x = self.x or [Q(0)] * self.n

    def ramp(self, change: Q) -> None:
        """Change y by `change`, through every slip on the way (at threshold a slider stays)."""
        if self.n > 1 and change:
            follow = self._slide if self.mu_s is None else self._slip
            follow(abs(change), 1 if change > 0 else -1)
        self.y += change

    def to(self, target: Q) -> None:
        """Bring y to a target."""
        self.ramp(target - self.y)

    def _slip(self, left: Q, up: int) -> None:
        if self.move <= 0:
            raise ValueError("a slip must lead somewhere: mu_s > mu_d")
        ends = ((0, -up), (-1, up))  # +1: an end is driven downhill
        while True:
            gaps = [self.holds - way * self.forces[end] for end, way in ends]
            gap = min(*gaps, left)
            for end, way in ends:
                self.forces[end] += way * gap
            left -= gap
            if left == 0:
                return
            starting = [driven for driven, room in zip(ends, gaps, strict=True) if room == gap]
            if len(starting) == self.n:
                raise Avalanche
            for end, way in starting:
                step = way * self.move
                self.x[end] += step
                self.forces[end] -= step
                self.forces[1 if end == 0 else -2] += step
            self.slips += len(starting)
            if max(map(abs, self.forces)) > self.holds:
                raise Avalanche

    def _slide(self, left: Q, up: int) -> None:
        """Move the sliders 1..above and below..n: two fronts that grow from the ends inwards."""
        above, below = 0, self.n + 1
        while left > 0:
            if below - 1 - above == 1:
                self._slid(up, left, above, below)
                return
            # the two groups of sliders, from above and from below, that are at their thresholds
            first, last = above, below
            while first + 1 < below and self.forces[first] == -up * self.slides:
                first += 1
            while last - 1 > above and self.forces[last - 2] == up * self.slides:
                last -= 1
            if first + 1 < last:
                if (first, last) == (above, below):
                    to_upper = self.slides + up * self.forces[above]
                    to_lower = self.slides - up * self.forces[below - 2]
                    step = min(left, to_upper, to_lower)
                    self._slid(up, step, above, below)
                    left -= step
                above, below = first, last
            elif first == above:  # the front from below would reach all resting sliders: one stays
                below = above + 2
            elif last == below:
                above = below - 2
            elif not self.tie:
                raise NotUnique
            elif (self.tie == "downhill") == (up == 1):
                above, below = first - 1, last
            else:
                above, below = first, last + 1

    def _slid(self, up: int, step: Q, above: int, below: int) -> None:
        self.forces[above] -= up * step
        self.forces[below - 2] += up * step
        for slider in range(1, above + 1):
            self.x[slider - 1] -= up * (above + 1 - slider) * step
        for slider in range(below, self.n + 1):
            self.x[slider - 1] += up * (slider - below + 1) * step


def play_variation(path: list[Q], width: Q, start: Q) -> tuple[list[Q], Q, Q]:
    """Return the play operator's output for a path, and its total rise and total fall.

    The output stays within width/2 of the input and moves only when it must; rise plus fall is the
    input's truncated variation at level `width`.
    """
    output, rise, fall, value = [], Q(0), Q(0), start
    for target in path:
        moved = max(target - width / 2, min(value, target + width / 2))
        rise += max(moved - value, Q(0))
        fall += max(value - moved, Q(0))
        value = moved
        output.append(value)
    return output, rise, fall


@dataclass
class SweptChain:
    """A chain in the sliding limit whose friction, pulls and dilations differ from place to place.

    It knows the law of friction alone: a slider moves only against its whole friction, and keeps
    it while it moves. At each moment it tries all sets of sliders that may move.

    Attributes
    ----------
    friction : list of Fraction
        Of each slider, above zero.
    pulls : list of Fraction
        Weight and end force on each slider. They sum up to less than the friction.
    weights : list of Fraction
        What a spring dilates by, per y.
    forces : list of Fraction
        Non-frictional forces (default: each slider carries the same share of its friction).
    x : list of Fraction
        Displacements.
    y : Fraction
        l0 theta.
    """

    friction: list[Q]
    pulls: list[Q]
    weights: list[Q]
    forces: list[Q] = field(default_factory=list)
    x: list[Q] = field(default_factory=list)
    y: Q = _ZERO

    def __post_init__(self) -> None:
        share = sum(self.pulls, _ZERO) / sum(self.friction, _ZERO)
        self.forces = self.forces or [share * held for held in self.friction]
        self.x = self.x or [_ZERO] * len(self.friction)

    def to(self, target: Q) -> None:
        """Bring y to a target, through all starts and stops on the way."""
        left, up = abs(target - self.y), 1 if target > self.y else -1
        while left > 0:
            speeds, rates = self._moving(up)
            rooms = [
                (held - force if rate > 0 else held + force) / abs(rate)
                for held, force, rate in zip(self.friction, self.forces, rates, strict=True)
                if rate
            ]
            step = min([left, *rooms])
            self.x = [x + speed * step for x, speed in zip(self.x, speeds, strict=True)]
            self.forces = [f + rate * step for f, rate in zip(self.forces, rates, strict=True)]
            left -= step
        self.y = target

    def _moving(self, up: int) -> tuple[list[Q], list[Q]]:
        """Return speeds of sliders and rates of their forces that obey the law of friction."""
        pairs = list(zip(self.forces, self.friction, strict=True))
        ready = [k for k, (force, held) in enumerate(pairs) if abs(force) == held]
        for moving in range(2 ** len(ready)):
            movers = [k for place, k in enumerate(ready) if moving >> place & 1]
            if len(movers) == len(pairs):
                continue  # the whole chain: the forces do not fix its place
            speeds = self._balanced(movers, up)
            rates = self._rates(speeds, up)
            outward = [rates[k] * self.forces[k] for k in ready]
            if all(speeds[k] * self.forces[k] > 0 for k in movers) and max([_ZERO, *outward]) == 0:
                return speeds, rates
        raise NotUnique

    def _balanced(self, movers: list[int], up: int) -> list[Q]:
        """Return the speeds for which the forces on all movers stay constant."""
        speeds = [_ZERO] * len(self.forces)
        driven = self._rates(speeds, up)
        rows: list[tuple[int, Q, Q]] = []  # slider, its speed over the next slider's, and beside
        for k in movers:
            springs = Q((k > 0) + (k + 1 < len(speeds)))
            joined = bool(rows) and rows[-1][0] == k - 1
            own = springs - (rows[-1][1] if joined else 0)
            rows.append((k, 1 / own, (driven[k] + (rows[-1][2] if joined else 0)) / own))
        for k, of_next, alone in reversed(rows):
            speeds[k] = alone + (of_next * speeds[k + 1] if k + 1 < len(speeds) else 0)
        return speeds

    def _rates(self, speeds: list[Q], up: int) -> list[Q]:
        """Return the rates of the forces, per step of y."""
        pairs = zip(speeds, speeds[1:], self.weights, strict=False)
        tensions = [_ZERO, *(after - before - up * w for before, after, w in pairs), _ZERO]
        return [after - before for before, after in pairwise(tensions)]
