"""Exact numbers a + b cos(alpha), a and b rational: tensions after ramps and lone slips.

Ramps, lone slips and the sliding limit add, compare and take rational multiples of such numbers.
Together with a ball they make a ball.
As ``c^2 = 1 / (1 + tan^2(alpha))`` is rational, squaring decides the sign of such a number.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import flint

from exactcreep.model.numbers import nearest_float

MOST_BITS = 20_000
"""Size of a numerator or denominator at which the event solver gives up exact values."""


class Quadratic:
    """The number ``a + b cos(alpha)`` of a `CosineField`, exactly.

    Sums, comparisons and multiples by rationals (int, `Fraction`, ``fmpq``) are exact. a and b are
    python-flint's rationals; b = 0 if cos(alpha) is rational.
    """

    __slots__ = ("a", "b", "field", "known")

    def __init__(self, field: CosineField, a: Any, b: Any) -> None:
        self.field, self.a, self.b = field, a, b
        self.known: Any = (0, None)  # precision, and the ball

    def _parts(self, other: Any) -> tuple[Any, Any] | None:
        """Return `other` in this field, None if it is not a number of the field."""
        if type(other) is Quadratic:
            alike = other.field is self.field or other.field.square == self.field.square
            return (other.a, other.b) if alike else None
        factor = fmpq(other)
        return None if factor is None else (factor, _ZERO)

    def __add__(self, other: Any) -> Any:
        if type(other) is flint.arb:
            return self.ball() + other
        parts = self._parts(other)
        if parts is None:
            return NotImplemented
        return Quadratic(self.field, self.a + parts[0], self.b + parts[1])

    __radd__ = __add__

    def __sub__(self, other: Any) -> Any:
        if type(other) is flint.arb:
            return self.ball() - other
        parts = self._parts(other)
        if parts is None:
            return NotImplemented
        return Quadratic(self.field, self.a - parts[0], self.b - parts[1])

    def __rsub__(self, other: Any) -> Any:
        return other - self.ball() if type(other) is flint.arb else -self + other

    def __neg__(self) -> Quadratic:
        out, (precision, ball) = Quadratic(self.field, -self.a, -self.b), self.known
        if ball is not None:
            out.known = precision, -ball
        return out

    def __abs__(self) -> Quadratic:
        return -self if self.sign() < 0 else self

    def __mul__(self, other: Any) -> Any:
        if type(other) is int and other in (1, -1):
            return self if other == 1 else -self
        if isinstance(other, (Quadratic, flint.arb)):
            return self.ball() * (other.ball() if isinstance(other, Quadratic) else other)
        factor = fmpq(other)
        if factor is None:
            return NotImplemented
        return Quadratic(self.field, self.a * factor, self.b * factor)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Any:
        factor = fmpq(other)
        return self * (1 / (other if factor is None else factor))

    def __rtruediv__(self, other: Any) -> Any:
        return other / self.ball()

    def __eq__(self, other: object) -> bool:
        parts = self._parts(other)
        return parts is not None and self.a == parts[0] and self.b == parts[1]

    def __lt__(self, other: Any) -> bool:
        return bool(_comparable(self - other) < 0)  # with a ball: certainly

    def __le__(self, other: Any) -> bool:
        return bool(_comparable(self - other) <= 0)

    def __gt__(self, other: Any) -> bool:
        return bool(_comparable(self - other) > 0)

    def __ge__(self, other: Any) -> bool:
        return bool(_comparable(self - other) >= 0)

    def __hash__(self) -> int:
        a, b = self.rationals()
        return hash((a, b)) if b else hash(a)

    def sign(self) -> int:
        """Return -1, 0 or +1, exactly."""
        a, b = sign_of(self.a), sign_of(self.b)
        if a == b or b == 0:
            return a
        if a == 0:
            return b
        # opposite signs: compare a^2 and b^2 c^2; they cannot be equal, because c is irrational
        return a if self.a * self.a > self.b * self.b * self.field.square else b

    def ball(self) -> Any:
        """Return the number as a ball, at python-flint's present precision."""
        precision, ball = self.known
        if precision != flint.ctx.prec:
            precision, ball = flint.ctx.prec, flint.arb(self.a)
            if self.b != 0:
                root = self.field.root
                if root[0] != precision:
                    root = precision, flint.arb(self.field.square).sqrt()
                    self.field.root = kept_if_sharp(*root)
                ball = ball + flint.arb(self.b) * root[1]
            self.known = kept_if_sharp(precision, ball)
        return ball

    def bracket(self, bits: int = 128) -> tuple[Fraction, Fraction]:
        """Return a rational and its largest error, at most ``2**-bits`` of the value."""
        a, b = self.rationals()
        if b == 0:
            return a, b
        square = _fraction(self.field.square)
        used = bits + 8
        while True:  # if a and b c cancel, c needs more digits
            scaled = (square.numerator << (2 * used)) // square.denominator
            value = a + b * Fraction(math.isqrt(scaled), 1 << used)
            error = abs(b) / (1 << used)
            if error * 2 ** (bits + 1) <= abs(value):
                return value, error
            used *= 2

    def __float__(self) -> float:
        return nearest_float(self.bracket()[0])

    def rationals(self) -> tuple[Fraction, Fraction]:
        """Return a and b."""
        return _fraction(self.a), _fraction(self.b)

    def __repr__(self) -> str:
        return f"{self.a} + {self.b} sqrt({self.field.square})"

    @property
    def bits(self) -> int:
        """Size of the largest numerator or denominator."""
        parts = (self.a.p, self.a.q, self.b.p, self.b.q)
        return max(int(part).bit_length() for part in parts)


class CosineField:
    """The field of numbers a + b cos(alpha) for a rational ``tan(alpha)``.

    `square` is ``cos(alpha)**2``; `cosine` is cos(alpha) if that is rational (for Pythagorean
    slopes such as 3/4 and 5/12), else None.
    """

    def __init__(self, tan_alpha: Fraction) -> None:
        square = 1 / (1 + tan_alpha * tan_alpha)
        self.square = flint.fmpq(square.numerator, square.denominator)
        top, low = math.isqrt(square.numerator), math.isqrt(square.denominator)
        self.root: tuple[int, Any] = (0, None)  # precision, and cos(alpha) as a ball
        exact = top * top == square.numerator and low * low == square.denominator
        self.cosine = flint.fmpq(top, low) if exact else None

    def number(self, a: Fraction, b: Fraction) -> Quadratic:
        """Return ``a + b cos(alpha)``."""
        total: Quadratic = self.rational(a) + self.times_cosine(b)
        return total

    def rational(self, value: Fraction) -> Quadratic:
        """Return a rational as a number of the field."""
        return Quadratic(self, fmpq(value), _ZERO)

    def times_cosine(self, value: Fraction) -> Quadratic:
        """Return ``value cos(alpha)``."""
        factor = fmpq(value)
        if self.cosine is not None:
            return Quadratic(self, factor * self.cosine, _ZERO)
        return Quadratic(self, _ZERO, factor)


_ZERO = flint.fmpq(0)


def kept_if_sharp(precision: int, ball: Any) -> tuple[int, Any]:
    """Return precision and ball to be kept, or nothing to keep if the ball is too wide.

    Another thread may have changed python-flint's precision in the meantime.
    """
    sharp = ball.is_exact() or ball.rel_accuracy_bits() >= precision - 8
    return (precision, ball) if sharp else (0, None)


def _comparable(difference: Any) -> Any:
    return difference.sign() if isinstance(difference, Quadratic) else difference


def fmpq(value: Any) -> Any:
    """Return a rational as python-flint's type, None if it is not rational."""
    if type(value) is flint.fmpq:
        return value
    if isinstance(value, int):
        return flint.fmpq(value)
    if type(value) is Fraction:
        return flint.fmpq(value.numerator, value.denominator)
    return None


def _fraction(x: Any) -> Fraction:
    return Fraction(int(x.p), int(x.q))


def sign_of(x: Any) -> int:
    """Return the sign of a rational, or of a number of the field."""
    if isinstance(x, Quadratic):
        return x.sign()
    whole = x.numerator if type(x) is Fraction else x  # compared without a common denominator
    return int(whole > 0) - int(whole < 0)
