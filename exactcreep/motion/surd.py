"""Numbers a + b r, r a square root of a rational, that behave as numbers: + - < and multiples.

Where cos(alpha) is irrational, everything that slides without inertia is such a number with
r = cos(alpha), and arrays of them can be computed with as they stand. (`quadratic` has the same
field for the event solver, on python-flint's rationals and with its balls.)
"""

from __future__ import annotations

import math
from fractions import Fraction
from functools import total_ordering
from typing import Any

from exactcreep.model.numbers import nearest_float


@total_ordering
class Surd:
    """An exact number ``a + b r`` with rational a, b and the root r > 0 of a rational `square`.

    Sums, multiples by rationals and comparisons are exact: the sign follows from squares.

    Parameters
    ----------
    a, b, square : Fraction
        `square` must not be the square of a rational.
    """

    __slots__ = ("a", "b", "square")

    def __init__(self, a: Fraction, b: Fraction, square: Fraction) -> None:
        self.a, self.b, self.square = a, b, square

    def _parts(self, other: Any) -> tuple[Fraction, Fraction] | None:
        if isinstance(other, Surd):
            return (other.a, other.b)
        return (Fraction(other), Fraction(0)) if isinstance(other, (int, Fraction)) else None

    def sign(self) -> int:
        """Return -1, 0 or +1."""
        if self.a >= 0 and self.b >= 0:
            return 1 if self.a > 0 or self.b > 0 else 0
        if self.a <= 0 and self.b <= 0:
            return -1
        larger = self.a * self.a > self.b * self.b * self.square
        return (1 if self.a > 0 else -1) if larger else (1 if self.b > 0 else -1)

    def __add__(self, other: Any) -> Surd:
        parts = self._parts(other)
        if parts is None:
            return NotImplemented
        return Surd(self.a + parts[0], self.b + parts[1], self.square)

    __radd__ = __add__

    def __neg__(self) -> Surd:
        return Surd(-self.a, -self.b, self.square)

    def __sub__(self, other: Any) -> Surd:
        parts = self._parts(other)
        if parts is None:
            return NotImplemented
        return Surd(self.a - parts[0], self.b - parts[1], self.square)

    def __rsub__(self, other: Any) -> Surd:
        return (-self).__add__(other)

    def __mul__(self, other: Any) -> Surd:
        if not isinstance(other, (int, Fraction)):
            return NotImplemented
        return Surd(self.a * other, self.b * other, self.square)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Surd:
        if not isinstance(other, (int, Fraction)):
            return NotImplemented
        return Surd(self.a / other, self.b / other, self.square)

    def __abs__(self) -> Surd:
        return -self if self.sign() < 0 else self

    def __eq__(self, other: object) -> bool:
        parts = self._parts(other)
        return parts is not None and (self.a, self.b) == parts

    def __lt__(self, other: Any) -> bool:
        parts = self._parts(other)
        if parts is None:
            return NotImplemented
        return Surd(self.a - parts[0], self.b - parts[1], self.square).sign() < 0

    def __hash__(self) -> int:
        return hash((self.a, self.b, self.square))

    def bracket(self, bits: int = 128) -> tuple[Fraction, Fraction]:
        """Return a rational and its largest error, at most ``2**-bits`` of the value."""
        if self.sign() == 0:
            return Fraction(0), Fraction(0)
        p, q = self.square.numerator, self.square.denominator
        used = bits + 8
        while True:  # what cancels between a and b r is made up for by more digits of r
            root = Fraction(math.isqrt((p << (2 * used)) // q), 1 << used)
            value, error = self.a + self.b * root, abs(self.b) / (1 << used)
            if error * 2 ** (bits + 1) <= abs(value):
                return value, error
            used *= 2

    def __float__(self) -> float:
        return nearest_float(self.bracket()[0])

    def __repr__(self) -> str:
        return f"{self.a} + {self.b} sqrt({self.square})"
