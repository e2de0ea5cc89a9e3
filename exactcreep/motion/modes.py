"""The exact motion of a run of sliders, and of the whole chain between two events.

Inside a run ``x'' = -K x + f`` with constant f. With the velocities v and accelerations a at the
beginning, and the eigenvectors and frequencies of K in closed form for every length,

    displacement(t) = sum over modes of  (a_q 2 sin^2(w t/2) / w^2 + v_q sin(w t) / w)  e_q

This avoids differences of large numbers. The zero mode of a run with two free ends is uniformly
accelerated.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, lru_cache, partial
from typing import Any, NamedTuple

import flint
import numpy as np
from numpy.typing import NDArray

from exactcreep.model.chain import Chain
from exactcreep.motion.arithmetic import Arithmetic


class Ends(NamedTuple):
    """The two ends of a run: the end of the chain (free) or a resting slider."""

    left_free: bool
    right_free: bool


@dataclass(frozen=True, eq=False)
class Modes:
    """Frequencies and orthonormal eigenvectors of a run.

    `frequencies` (ndarray, shape (p,)): ``2 sin(theta_q / 2)``, a zero mode first; `vectors`
    (ndarray, shape (p, p)): ``vectors[n, q]``: slider n of mode q; `forward`, `backward`: the
    transpose and the matrix itself, for `Arithmetic.product`.
    """

    frequencies: NDArray[Any]
    vectors: NDArray[Any]
    forward: Any
    backward: Any


_MOST_KEPT = 512  # tables
_KEPT: dict[tuple[Arithmetic, int, Ends], Modes] = {}


def modes(arithmetic: Arithmetic, p: int, ends: Ends) -> Modes:
    """Return the modes of a run of length `p`, from their closed forms.

    Guarantee: in float64 every entry is within a few ulp for any p; in balls it is enclosed. Balls
    that another thread's precision has widened are not kept.
    """
    key = arithmetic, p, ends
    if key in _KEPT:
        return _KEPT[key]
    made = _modes(arithmetic, p, ends)
    if arithmetic.encloses:
        numbers = (*made.frequencies, *made.forward.entries(), *made.backward.entries())
        unit = flint.arb((1, arithmetic.bits - 8))
        if not all(x.rad() * unit <= 1 for x in numbers):
            return made
    if len(_KEPT) >= _MOST_KEPT:
        _KEPT.clear()
    _KEPT[key] = made
    return made


def _modes(arithmetic: Arithmetic, p: int, ends: Ends) -> Modes:
    n = np.arange(1, p + 1, dtype=np.int64)[:, None]
    q = np.arange(1, p + 1, dtype=np.int64)[None, :]
    left, right = ends
    if not left and not right:
        whole, norm = 2 * (p + 1), Fraction(2, p + 1)
        angle, shape = 2 * n * q, q[0]
    elif left and right:
        whole, norm = 2 * p, Fraction(2, p)
        q = q - 1
        angle, shape = p + (2 * n - 1) * q, q[0]
    else:
        whole, norm = 2 * (2 * p + 1), Fraction(4, 2 * p + 1)
        shape = 2 * q[0] - 1
        # cos x = sin(x + pi/2): the quarter turn is whole / 2 = 2p + 1
        angle = (2 * p + 1) + (2 * n - 1) * shape if left else 2 * n * shape
    frequencies = 2 * arithmetic.sin_pi(shape, whole)
    vectors = arithmetic.sin_pi(angle, whole) * arithmetic.sqrt(arithmetic.number(norm))
    if left and right:
        frequencies[0] = arithmetic.number(0)
        vectors[:, 0] = 1 / arithmetic.sqrt(arithmetic.number(p))
    forward = arithmetic.matrix(np.ascontiguousarray(vectors.T))
    return Modes(frequencies, vectors, forward, arithmetic.matrix(vectors))


class Run:
    """The motion of one run from velocities and accelerations at time 0, each of shape (p,).

    `first` is its first slider, counted from 0.
    """

    def __init__(
        self,
        arithmetic: Arithmetic,
        ends: Ends,
        velocities: NDArray[Any],
        accelerations: NDArray[Any],
        first: int = 0,
    ) -> None:
        self.arithmetic, self.ends, self.first = arithmetic, ends, first
        self.velocities, self.accelerations = velocities, accelerations
        self.p = len(velocities)
        self.sliders = range(first, first + self.p)

    def __reduce__(self) -> tuple[Any, tuple[Any, ...]]:
        parts = self.arithmetic, self.ends, self.velocities, self.accelerations, self.first
        return Run, parts

    @cached_property
    def modes(self) -> Modes:
        """The modes of a run of this length."""
        return modes(self.arithmetic, self.p, self.ends)

    @cached_property
    def modal(self) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
        """Frequencies, and velocities and accelerations at time 0, by mode."""
        product, forward = self.arithmetic.product, self.modes.forward
        v, a = product(forward, self.velocities), product(forward, self.accelerations)
        return self.modes.frequencies, v, a

    @cached_property
    def swinging(self) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
        """The same without a mode of frequency zero."""
        w, v, a = self.modal
        return (w[1:], v[1:], a[1:]) if self.ends == (True, True) else (w, v, a)

    @cached_property
    def energy(self) -> Any:
        """2J: ``|v|^2 + a^T K^-1 a`` without the mean motion; conserved."""
        w, v, a = self.swinging
        ratio = a / w
        return self.arithmetic.dot(v, v) + self.arithmetic.dot(ratio, ratio)

    def _modal(self, t: Any, rows: int = 3) -> list[NDArray[Any]]:
        """Return, by mode, the first `rows` of displacements, gains of velocities and of pulls."""
        w, v, a = self.swinging
        sin, cos = self.arithmetic.sin_cos(w * (t / 2))
        stretched = sin / w
        out = [2 * stretched * (a * stretched + v * cos), 2 * sin * (a * cos / w - v * sin)]
        if rows == 3:
            out.append(-2 * sin * (a * sin + w * v * cos))
        if len(w) < self.p:  # add the mean motion, uniformly accelerated
            speed, pull = self.modal[1][0], self.modal[2][0]
            means = ((speed + pull * (t / 2)) * t, pull * t, self.arithmetic.number(0))
            out = [
                np.concatenate([np.array([mean], v.dtype), swing])
                for mean, swing in zip(means, out, strict=False)
            ]
        return out

    def moved(self, t: Any) -> tuple[NDArray[Any], NDArray[Any]]:
        """Return displacements since time 0 and velocities at `t`, each of shape (p,).

        Guarantee: in float64 the error is a few ulp of the largest change; in balls it is enclosed.
        """
        if self.arithmetic.encloses:
            return self._moved_balls(t)
        product, back = self.arithmetic.product, self.modes.backward
        ways, gains = self._modal(t, 2)
        return product(back, ways), self.velocities + product(back, gains)

    def _moved_balls(self, t: Any) -> tuple[NDArray[Any], NDArray[Any]]:
        """Implement `moved` for balls; lists, and products with two columns, are fastest."""
        speeds, pulls = self.velocities.tolist(), self.accelerations.tolist()
        pairs = zip(speeds, pulls, strict=True)
        modal = (self.modes.forward * flint.arb_mat(list(pairs))).tolist()
        half, ways = t / 2, []
        for w, (v, a) in zip(self.modes.frequencies.tolist(), modal, strict=True):
            if w == 0:
                ways.append([(v + a * half) * t, a * t])
                continue
            sin, cos = (w * half).sin_cos()
            stretched = sin / w
            way = 2 * stretched * (a * stretched + v * cos)
            ways.append([way, 2 * sin * (a * cos / w - v * sin)])
        moved = (self.modes.backward * flint.arb_mat(ways)).tolist()
        vector = self.arithmetic.vector
        gained = [v + gain for v, (_, gain) in zip(speeds, moved, strict=True)]
        return vector([x for x, _ in moved]), vector(gained)

    def slider(self, n: int, t: Any) -> tuple[Any, Any, Any]:
        """Return displacement, velocity and acceleration of slider `n` (from 0) of the run."""
        way, gain, turn = (self.arithmetic.dot(self.modes.vectors[n], x) for x in self._modal(t))
        return way, self.velocities[n] + gain, self.accelerations[n] + turn

    def bent(self, x: list[Any]) -> list[Any]:
        """Return -K x."""
        own = [-2] * self.p
        own[0] += self.ends.left_free
        own[-1] += self.ends.right_free
        around = zip(own, [0, *x[:-1]], x, [*x[1:], 0], strict=True)
        return [k * y + before + after for k, before, y, after in around]

    def bound(self, n: int, k: int) -> Any:
        """Return ``sqrt((K^k)_nn 2J)``, which bounds ``|v_n^(k)|`` for ever (free-free: k >= 2)."""
        power = _diagonal_of_power(self.p, self.ends, n, k)
        return self.arithmetic.sqrt(self.energy * power)


@lru_cache(maxsize=4096)
def _diagonal_of_power(p: int, ends: Ends, n: int, k: int) -> int:
    """Return ``(K^k)_nn``, exactly; it depends only on sliders within k of n."""
    low, high = max(0, n - k), min(p, n + k + 1)
    size = high - low
    beside = np.eye(size, k=1, dtype=int)
    matrix = 2 * np.eye(size, dtype=int) - beside - beside.T
    matrix[0, 0] -= low == 0 and ends.left_free
    matrix[-1, -1] -= high == p and ends.right_free
    return int(np.linalg.matrix_power(matrix, k)[n - low, n - low])


class Flow:
    """The moving chain at one instant: forces, velocities, directions, and displacements.

    Parameters
    ----------
    arithmetic : Arithmetic
    forces : ndarray, shape (n,)
        Non-frictional forces at rest, at the start.
    friction : ndarray, shape (n,)
        ``mu_d cos(alpha)`` of each slider.

    Attributes
    ----------
    signs : ndarray of int, shape (n,)
        Direction of motion of each slider, 0 at rest.
    moved : ndarray, shape (n,)
        Displacement since the start.
    """

    def __init__(
        self,
        arithmetic: Arithmetic,
        forces: NDArray[Any],
        friction: Any,
    ) -> None:
        n = len(forces)
        self.arithmetic = arithmetic
        self.forces = forces.copy()
        self.friction: NDArray[Any] = friction
        self.velocities = arithmetic.zeros(n)
        self.moved = arithmetic.zeros(n)
        self.signs = np.zeros(n, dtype=np.int64)
        self.touched: set[int] = set()

    @property
    def moving(self) -> list[int]:
        """The sliders (from 0) that move."""
        moving: list[int] = self.signs.nonzero()[0].tolist()
        return moving

    def start(self, sliders: Iterable[int], signs: Iterable[int]) -> None:
        """Set sliders (from 0) in motion, from rest."""
        for n, sign in zip(sliders, signs, strict=True):
            self.signs[n] = sign
            self.touched.add(n)

    def stop(self, sliders: Iterable[int]) -> None:
        """Bring sliders (from 0) to rest."""
        for n in sliders:
            self.signs[n] = 0
            self.velocities[n] = self.arithmetic.number(0)

    def runs(self) -> list[Run]:
        """Return the motion of every run from this instant on."""
        out, n = [], len(self.forces)
        moving = self.moving
        for place, first in enumerate(moving):
            if place and moving[place - 1] == first - 1:
                continue
            after = first + 1
            while after < n and self.signs[after]:
                after += 1
            # a friction in Q(c) keeps its ball, its negative would make another
            run = slice(first, after)
            of = (values[run].tolist() for values in (self.signs, self.forces, self.friction))
            pulls = []
            for sign, force, drag in zip(*of, strict=True):
                drag = self.arithmetic.number(drag) if type(force) is flint.arb else drag
                pulls.append(force - drag if sign > 0 else force + drag)
            accelerations, velocities = self.arithmetic.vector(pulls), self.velocities[run].copy()
            ends = Ends(first == 0, after == n)
            out.append(Run(self.arithmetic, ends, velocities, accelerations, first))
        return out

    def move(self, runs: Sequence[Run], t: Any) -> None:
        """Let time `t` pass."""
        for run in runs:
            displacements, velocities = run.moved(t)
            self.shift(run.first, displacements)
            self.velocities[run.first : run.first + run.p] = velocities

    def shift(self, first: int, displacements: NDArray[Any]) -> None:
        """Move the sliders of a run beginning at `first`, and change forces accordingly."""
        p, n = len(displacements), len(self.forces)
        self.moved[first : first + p] = self.moved[first : first + p] + displacements
        stretched = displacements[1:] - displacements[:-1]  # of the springs inside the run
        self.forces[first : first + p - 1] = self.forces[first : first + p - 1] + stretched
        self.forces[first + 1 : first + p] = self.forces[first + 1 : first + p] - stretched
        if first > 0:
            self.forces[first - 1] = self.forces[first - 1] + displacements[0]
            self.forces[first] = self.forces[first] - displacements[0]
        if first + p < n:
            self.forces[first + p] = self.forces[first + p] + displacements[-1]
            self.forces[first + p - 1] = self.forces[first + p - 1] - displacements[-1]

    def mirror(self) -> None:
        """Make the lower half of the chain the mirror image of the upper one."""
        n = len(self.forces)
        for values in (self.forces, self.velocities, self.moved):
            values[n - n // 2 :] = -values[: n // 2][::-1]
            if n % 2:
                values[n // 2] = 0 * values[n // 2]


def loads_of(arithmetic: Arithmetic, chain: Chain) -> NDArray[Any]:
    """Return the weight of each slider along the incline, plus the end forces."""
    weight, number = arithmetic.times_cosine(chain, chain.tan_alpha), arithmetic.number
    return arithmetic.vector(weight + number(chain.pull(n)) for n in range(chain.n))


def frictions_of(arithmetic: Arithmetic, chain: Chain) -> NDArray[Any]:
    """Return ``mu_d cos(alpha)`` of each slider."""
    return arithmetic.vector(chain.each("mu_d", partial(arithmetic.times_cosine, chain)))


def forces_of(
    arithmetic: Arithmetic, tensions: NDArray[Any], loads: NDArray[Any] | float
) -> NDArray[Any]:
    """Return ``F_n = T_n - T_(n-1)`` plus the loads, from tensions of shape (n - 1,)."""
    forces: NDArray[Any] = arithmetic.zeros(len(tensions) + 1) + loads
    forces[:-1] = forces[:-1] + tensions
    forces[1:] = forces[1:] - tensions
    return forces
