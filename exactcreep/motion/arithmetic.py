"""Arithmetics as values: float64, and balls at any number of digits.

The motion between events runs in both. Only balls compare: an undecided comparison raises
`Undecided`.
"""

from __future__ import annotations

import copyreg
import math
import sys
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from fractions import Fraction
from functools import lru_cache
from typing import Any, ClassVar

import flint
import numpy as np
from numpy.typing import NDArray

from exactcreep.model.chain import Chain
from exactcreep.model.enclosure import Enclosure, enclosure
from exactcreep.model.numbers import nearest_float
from exactcreep.motion.cosine_field import Quadratic

BITS_PER_DIGIT = math.log2(10)
_FLINT = threading.RLock()  # python-flint has one working precision for the whole process
_NESTED: list[int] = []  # the precisions that the package has set, the last one outside `active`
_ATTEMPTS = 40
_LOSS = 2.0**24
"""Growth of a radius in one step that is taken for another thread's precision, until repeated."""
DISTURBED = "another thread changes the precision of python-flint within every attempt at a step"


class Undecided(ArithmeticError):
    """A comparison of two balls that overlap: it needs more precision."""


class Disturbance(ArithmeticError):
    """A step that could not be computed at the precision asked for."""


class Arithmetic(ABC):
    """A number field: how to make its numbers, and take roots and sines.

    Vectors are NumPy arrays (float64, or of objects); matrices are arguments of `product`.
    `encloses`: whether a number is a proved enclosure; `bits`: working precision.
    """

    name: ClassVar[str]
    encloses: ClassVar[bool] = False
    bits: int

    def active(self) -> AbstractContextManager[None]:
        """Return a context in which this arithmetic can compute."""
        return nullcontext()

    @abstractmethod
    def number(self, value: Any) -> Any:
        """Return the number nearest to (or the ball around) an int, float, Fraction or number."""

    @abstractmethod
    def vector(self, values: Iterable[Any]) -> NDArray[Any]:
        """Return numbers of this arithmetic as a vector."""

    def zeros(self, size: int) -> NDArray[Any]:
        """Return a vector of zeros."""
        return self.vector([self.number(0)] * size)

    def matrix(self, rows: NDArray[Any]) -> Any:
        """Return a two-dimensional array of numbers as a matrix for `product`."""
        return rows

    @abstractmethod
    def product(self, matrix: Any, vector: NDArray[Any]) -> NDArray[Any]:
        """Return matrix times vector."""

    def dot(self, x: NDArray[Any], y: NDArray[Any]) -> Any:
        """Return the scalar product."""
        return (x * y).sum() if x.size else self.number(0)

    @abstractmethod
    def sqrt(self, x: Any) -> Any:
        """Return the square root."""

    @abstractmethod
    def sin_cos(self, angles: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
        """Return sines and cosines of a vector."""

    @abstractmethod
    def sin_pi(self, numerators: NDArray[np.int64], denominator: int) -> NDArray[Any]:
        """Return ``sin(pi * numerators / denominator)``, each as accurate as a single operation."""

    def larger(self, x: Any, y: Any) -> Any:
        """Return the larger of two numbers."""
        return max(x, y)

    def times_cosine(self, chain: Chain, value: Fraction) -> Any:
        """Return ``value cos(alpha)``: weights and friction forces, unit ``m g``."""
        tangent = chain.tan_alpha
        cosine = 1 / self.sqrt(self.number(1 + tangent * tangent))
        return cosine if value == 1 else self.number(value) * cosine  # a product widens a ball


class Float64(Arithmetic):
    """IEEE double precision, by NumPy."""

    name = "float64"
    bits = 53

    def __reduce__(self) -> str:
        return "FLOAT64"

    def number(self, value: Any) -> float:
        if type(value) is float:
            return value
        return nearest_float(value) if isinstance(value, Fraction) else float(value)

    def vector(self, values: Iterable[Any]) -> NDArray[np.float64]:
        if isinstance(values, np.ndarray) and values.dtype == np.float64:
            return values.copy()
        return np.array([self.number(v) for v in values], dtype=np.float64)

    def zeros(self, size: int) -> NDArray[np.float64]:
        return np.zeros(size)

    def product(self, matrix: Any, vector: NDArray[Any]) -> NDArray[np.float64]:
        return np.asarray(matrix @ vector)

    def times_cosine(self, chain: Chain, value: Fraction) -> float:
        return chain.times_cosine(value)

    def sqrt(self, x: Any) -> float:
        return math.sqrt(x)

    def sin_cos(self, angles: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
        return np.sin(angles), np.cos(angles)

    def sin_pi(self, numerators: NDArray[np.int64], denominator: int) -> NDArray[np.float64]:
        """Return sines of rational multiples of pi, reduced exactly to an eighth of a turn."""
        turn = np.mod(numerators, 2 * denominator)
        sign = np.where(turn >= denominator, -1.0, 1.0)
        half = np.mod(turn, denominator)
        quarter = np.minimum(half, denominator - half)
        near = 4 * quarter <= denominator
        from_zero = np.sin(quarter * (np.pi / denominator))
        from_right = np.cos((denominator - 2 * quarter) * (np.pi / (2 * denominator)))
        return np.asarray(sign * np.where(near, from_zero, from_right))


FLOAT64 = Float64()


def ball_of(known: Enclosure) -> Any:
    """Return the ball with this middle and radius, which are binary fractions, exactly."""
    middle, radius = map(_binary, known)
    if radius[0] == 0:
        return flint.arb(middle)
    # python-flint raises a given radius by one unit of its 30 bits, so we give one unit less
    mantissa, exponent = radius
    spare = 30 - mantissa.bit_length()
    top, low = mantissa << spare, exponent - spare
    for given in ((top - 1, low), (2 * top - 1, low - 1)):
        ball = flint.arb(middle, given)
        if ball.rad() == flint.arb(radius):
            return ball
    return flint.arb(middle, radius)


def _binary(value: Fraction) -> tuple[int, int]:
    """Return mantissa, odd or zero, and exponent."""
    zeros = (value.numerator & -value.numerator).bit_length() - 1 if value else 0
    return value.numerator >> zeros, zeros + 1 - value.denominator.bit_length()


class Balls(Arithmetic):
    """python-flint's real balls: every number is a proved enclosure.

    python-flint has one working precision for the whole process. `active` sets it, restores it, and
    makes other threads of the package wait in the meantime.
    """

    name = "balls"
    encloses = True

    def __init__(self, bits: int) -> None:
        self.bits = bits

    def __reduce__(self) -> tuple[Any, tuple[int]]:
        return balls_of, (self.bits,)

    @contextmanager
    def active(self) -> Iterator[None]:
        with _FLINT:
            before = _NESTED[-1] if _NESTED else flint.ctx.prec
            _NESTED.append(self.bits)
            flint.ctx.prec = self.bits
            try:
                yield
            finally:
                _NESTED.pop()
                flint.ctx.prec = before

    def steadily(
        self,
        compute: Callable[[], Any],
        snapshot: Callable[[], Callable[[], None]],
        measure: Callable[[], tuple[float, int]],
    ) -> Any:
        """Return what a step computes, at this precision even if other threads change it.

        A lower precision only widens balls. So a step beside other threads is repeated until the
        precision was right before and after, and either nothing looks widened or two attempts
        agree. `snapshot` returns a function that undoes the step; `measure` returns the largest
        radius and the number of undecided comparisons that rules have settled. Raises
        `Disturbance` if no attempt succeeds.
        """
        flint.ctx.prec = self.bits
        if len(sys._current_frames()) == 1:
            return compute()
        undo, (radius, settled) = snapshot(), measure()
        usual = _LOSS * max(radius, 2.0**-self.bits)
        before: Any = None
        for _ in range(_ATTEMPTS):
            flint.ctx.prec = self.bits
            doubt, answer = None, None
            try:
                answer = compute()
            except Undecided as undecided:
                doubt = undecided
            held = flint.ctx.prec == self.bits
            flint.ctx.prec = self.bits
            radius, now = measure()
            sharp = radius <= usual and now == settled and doubt is None
            acting = [getattr(answer, name, None) for name in ("stops", "starts")]
            said = doubt is not None, now, math.frexp(radius)[1] // 4, acting
            if held and (sharp or said == before):
                if doubt is not None:
                    raise doubt
                return answer
            before = said if held else None
            undo()
        raise Disturbance(DISTURBED)

    def number(self, value: Any) -> Any:
        """Return a ball around `value` (exact for floats and ints)."""
        kind = type(value)
        if kind is flint.arb:
            return value
        if kind is Quadratic:
            return value.ball()
        if kind is float or kind is int:
            return flint.arb(value)
        if isinstance(value, Enclosure):
            return ball_of(value)
        if isinstance(value, Fraction):
            return flint.arb(flint.fmpq(value.numerator, value.denominator))
        return flint.arb(value.item() if isinstance(value, np.generic) else value)

    def vector(self, values: Iterable[Any]) -> NDArray[Any]:
        return objects([v if type(v) is flint.arb else self.number(v) for v in values])

    def matrix(self, rows: NDArray[Any]) -> Any:
        return flint.arb_mat(rows.tolist())

    def product(self, matrix: Any, vector: NDArray[Any]) -> NDArray[Any]:
        return objects((matrix * flint.arb_mat(len(vector), 1, vector.tolist())).entries())

    def dot(self, x: NDArray[Any], y: NDArray[Any]) -> Any:
        n = len(x)
        if n == 0:
            return flint.arb(0)
        return (flint.arb_mat(1, n, x.tolist()) * flint.arb_mat(n, 1, y.tolist()))[0, 0]

    def larger(self, x: Any, y: Any) -> Any:
        return self.number(x).max(self.number(y))

    def sqrt(self, x: Any) -> Any:
        """Return the square root of a ball, without any part below zero."""
        x = self.number(x)
        if x.lower() >= 0:
            return x.sqrt()
        return flint.arb(0).union(flint.arb.max(x.upper(), flint.arb(0)).sqrt())

    def sin_cos(self, angles: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
        pairs = [angle.sin_cos() for angle in angles.tolist()]
        return objects([p[0] for p in pairs]), objects([p[1] for p in pairs])

    def sin_pi(self, numerators: NDArray[np.int64], denominator: int) -> NDArray[Any]:
        turned = np.mod(numerators, 2 * denominator)
        distinct, places = np.unique(turned, return_inverse=True)
        sines = [flint.arb.sin_pi_fmpq(flint.fmpq(k, denominator)) for k in distinct.tolist()]
        return objects(sines)[places.reshape(turned.shape)]


def certain_sign(x: Any, slack: Any = 0) -> int:
    """Return the sign of a ball whose midpoint may be off by `slack`, or raise `Undecided`."""
    if x > slack:
        return 1
    if x < -slack:
        return -1
    if x == 0 and slack == 0:
        return 0
    raise Undecided(f"the sign of {x} is not decided at {flint.ctx.prec} bits")


@lru_cache(maxsize=64)
def balls_of(bits: int) -> Balls:
    """Return the ball arithmetic of `bits` bits (it stores its tables of modes)."""
    return Balls(bits)


def objects(values: Iterable[Any]) -> NDArray[Any]:
    """Return numbers as an array of objects."""
    listed = list(values)
    out = np.empty(len(listed), dtype=object)
    out[:] = listed
    return out


# python-flint's balls cannot be pickled by themselves
copyreg.pickle(flint.arb, lambda ball: (ball_of, (enclosure(ball),)))
