"""A quasi-static chain in exact rational arithmetic, as an independent witness.

Forces are measured in units of ``m g cos(alpha)`` and lengths in units of ``g tau_dyn**2
cos(alpha)``, so that friction coefficients, the slope tan(alpha), tensions and ``y = l0 theta /
cos(alpha)`` are all rational. Two models: two sliders that slip (the slips of an end slider move it
by 2 (mu_s - mu_d)), and a chain in the sliding limit, where moving sliders carry exactly the
friction mu_d (the play operator).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction

Q = Fraction
_ZERO = Q(0)


class NotUnique(Exception):
    """Two neighbours reach their thresholds together and either may stay."""


class BothStart(Exception):
    """Slider 1 and 2 start together, or one's slip sets the other in motion."""


@dataclass
class TwoSliders:
    """Two sliders with slips, sigma_mu = 0.

    Attributes
    ----------
    slope, mu_d, mu_s : Fraction
    r : Fraction
        x_2 - x_1 - l0.
    y : Fraction
        l0 theta.
    x : list of Fraction
        Displacements.
    slips : int
    """

    slope: Q
    mu_d: Q
    mu_s: Q
    r: Q = _ZERO
    y: Q = _ZERO
    x: list[Q] = field(default_factory=lambda: [Q(0), Q(0)])
    slips: int = 0

    def forces(self) -> tuple[Q, Q]:
        """Return the non-frictional forces on the two sliders."""
        tension = self.r - self.y
        return tension + self.slope, -tension + self.slope

    def ramp(self, target: Q) -> None:
        """Bring y to the target through every slip on the way (at threshold a slider stays)."""
        while self.y != target:
            up = 1 if target > self.y else -1
            f1, f2 = self.forces()
            # raising y by 1 lowers the force on slider 1 and raises the force on slider 2 by 1
            rooms = [(self.mu_s + up * f1, 0, -up), (self.mu_s - up * f2, 1, up)]
            rooms.sort()
            room, slider, direction = rooms[0]
            if room >= abs(target - self.y):
                self.y = target
                return
            if rooms[1][0] == room:
                raise BothStart
            self.y += up * room
            step = direction * 2 * (self.mu_s - self.mu_d)
            self.x[slider] += step
            self.r += step if slider else -step
            self.slips += 1
            if max(abs(force) for force in self.forces()) > self.mu_s:
                raise BothStart


@dataclass
class SlidingChain:
    """A chain of n sliders in the sliding limit mu_s -> mu_d, without inertia.

    Attributes
    ----------
    n : int
    slope, mu_d : Fraction
    tension : list of Fraction
        T_0 .. T_n, zero at both ends.
    x : list of Fraction
        Displacements of sliders 1 .. n (from index 0).
    pivot : int
        The slider that rested alone at the end of the last ramp; 0 if more than one did.
    tie : str
        Which of the last two starts if both are at their thresholds: the one that moves
        ``downhill`` or ``uphill``, the ``upper`` or the ``lower`` one; empty: `NotUnique`.
    """

    n: int
    slope: Q
    mu_d: Q
    tension: list[Q] = field(default_factory=list)
    x: list[Q] = field(default_factory=list)
    pivot: int = 0
    tie: str = ""

    def __post_init__(self) -> None:
        self.tension = self.tension or [Q(0)] * (self.n + 1)
        self.x = self.x or [Q(0)] * self.n

    def force(self, slider: int) -> Q:
        """Return the non-frictional force on a slider."""
        return self.tension[slider] - self.tension[slider - 1] + self.slope

    def ramp(self, change: Q) -> None:
        """Change y by `change`; two fronts of sliding sliders grow from the ends inwards."""
        if self.n == 1 or change == 0:
            return
        up = 1 if change > 0 else -1
        left, above, below = abs(change), 0, self.n + 1  # 1..above and below..n slide
        self.pivot = 0
        while left > 0:
            resting = below - 1 - above
            if resting == 1:
                self.pivot = above + 1
                self._slide(up, left, above, below)
                return
            # the two groups of sliders, from above and from below, that are at their thresholds
            first, last = above, below
            while first + 1 < below and self.mu_d + up * self.force(first + 1) == 0:
                first += 1
            while last - 1 > above and self.mu_d - up * self.force(last - 1) == 0:
                last -= 1
            if first + 1 < last:
                if (first, last) == (above, below):
                    upper = self.mu_d + up * self.force(above + 1)
                    lower = self.mu_d - up * self.force(below - 1)
                    step = min(upper, lower, left)
                    self._slide(up, step, above, below)
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

    def _slide(self, up: int, step: Q, above: int, below: int) -> None:
        for slider in range(above + 1, below - 1):
            self.tension[slider] -= up * step
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
        if target - value > width / 2:
            rise += target - width / 2 - value
            value = target - width / 2
        elif value - target > width / 2:
            fall += value - target - width / 2
            value = target + width / 2
        output.append(value)
    return output, rise, fall
