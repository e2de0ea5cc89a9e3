"""Numbers a + b c with rational a, b and c = cos(alpha): where ramps and lone slips stay.

As ``c^2 = 1 / (1 + tan^2(alpha))`` is rational, the sign of such a number is decided by squaring.
"""

from __future__ import annotations

from fractions import Fraction
from math import isqrt
from typing import Any, NamedTuple

import flint

MOST_BITS = 20_000
"""Size of a numerator or denominator at which the exact value is given up."""


class Quadratic(NamedTuple):
    """The number ``a + b cos(alpha)`` of a field."""

    field: CosineField
    a: Any
    b: Any

    def __add__(self, other: Quadratic) -> Quadratic:  # type: ignore[override]
        return Quadratic(self.field, self.a + other.a, self.b + other.b)

    def __sub__(self, other: Quadratic) -> Quadratic:
        return Quadratic(self.field, self.a - other.a, self.b - other.b)

    def __neg__(self) -> Quadratic:
        return Quadratic(self.field, -self.a, -self.b)

    def times(self, factor: Any) -> Quadratic:
        """Return the number times a rational (``fmpq``) or an int."""
        return Quadratic(self.field, self.a * factor, self.b * factor)

    def sign(self) -> int:
        """Return the sign, exactly."""
        a, b = _sign(self.a), _sign(self.b)
        if a == b or b == 0:
            return a
        if a == 0:
            return b
        # opposite signs: the larger of a^2 and b^2 c^2; equal they cannot be, c is irrational
        return a if self.a * self.a > self.b * self.b * self.field.square else b

    def ball(self) -> Any:
        """Return the number as a ball, at python-flint's present precision."""
        if self.b == 0:
            return flint.arb(self.a)
        return flint.arb(self.a) + flint.arb(self.b) * flint.arb(self.field.square).sqrt()

    def rationals(self) -> tuple[Fraction, Fraction]:
        """Return a and b."""
        return _fraction(self.a), _fraction(self.b)

    @property
    def bits(self) -> int:
        """Size of the largest numerator or denominator."""
        parts = (self.a.p, self.a.q, self.b.p, self.b.q)
        return max(int(part).bit_length() for part in parts)


class CosineField:
    """The field of numbers a + b cos(alpha) for a rational ``tan(alpha)``."""

    def __init__(self, tan_alpha: Fraction) -> None:
        square = 1 / (1 + tan_alpha * tan_alpha)
        self.square = flint.fmpq(square.numerator, square.denominator)
        top, low = isqrt(square.numerator), isqrt(square.denominator)
        exact = top * top == square.numerator and low * low == square.denominator
        self.cosine = flint.fmpq(top, low) if exact else None

    def number(self, a: Fraction, b: Fraction) -> Quadratic:
        """Return ``a + b cos(alpha)``."""
        return self.rational(a) + self.times_cosine(b)

    def rational(self, value: Fraction) -> Quadratic:
        """Return a rational as a number of the field."""
        return Quadratic(self, flint.fmpq(value.numerator, value.denominator), flint.fmpq(0))

    def times_cosine(self, value: Fraction) -> Quadratic:
        """Return ``value cos(alpha)``."""
        factor = flint.fmpq(value.numerator, value.denominator)
        if self.cosine is not None:
            return Quadratic(self, factor * self.cosine, flint.fmpq(0))
        return Quadratic(self, flint.fmpq(0), factor)


def _sign(x: Any) -> int:
    return int(x > 0) - int(x < 0)


def _fraction(x: Any) -> Fraction:
    return Fraction(int(x.p), int(x.q))
