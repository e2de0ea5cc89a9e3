"""Enclosures: a number of any arithmetic as an exact middle with a radius.

Floats, rationals, numbers of mpmath, balls and elements of Q(cos(alpha)) all become an `Enclosure`.
A file holds the nearest float, with its decimals and its radius.
"""

from __future__ import annotations

import math
from decimal import Context, Decimal
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.numbers import nearest_float


class Enclosure(NamedTuple):
    """A number within `radius` of `middle`; both are exact rationals.

    Parameters
    ----------
    middle, radius : Fraction
        The radius is not negative.

    Examples
    --------
    >>> creep(pair, Cycles("0.001", 3), solver="certified").velocity_enclosure.text(20)
    '0.77611400011626551526'
    """

    middle: Fraction
    radius: Fraction

    def text(self, digits: int) -> str:
        """Return at most `digits` significant decimal digits, none smaller than the radius.

        Parameters
        ----------
        digits : int
            Largest number of digits.

        Returns
        -------
        str
            A decimal number.
        """
        known = digits
        if self.radius and self.middle:
            # one unit of the last digit shown is at least the radius
            known = magnitude(self.middle) - magnitude(self.radius)
            known = max(1, min(digits, known))
        return _decimal(self.middle, known)

    def radius_text(self) -> str:
        """Return the radius as a decimal of three digits, rounded up.

        Returns
        -------
        str
            A decimal number.
        """
        return _decimal(self.radius, 3, rounding="ROUND_CEILING")

    def __float__(self) -> float:
        return nearest_float(self.middle)

    def apart(self, other: Enclosure) -> float:
        """Return the distance of the middles, 0 if the numbers may be equal.

        Parameters
        ----------
        other : Enclosure
            Another number.

        Returns
        -------
        float
            Not negative.
        """
        distance = abs(self.middle - other.middle)
        return nearest_float(distance) if distance > self.radius + other.radius else 0.0

    def rate(self, begin: Enclosure, span: Fraction | int) -> Enclosure:
        """Return the mean rate of a quantity that changed from `begin` to this within `span`.

        Parameters
        ----------
        begin : Enclosure
            The earlier value.
        span : Fraction or int
            Time since then.

        Returns
        -------
        Enclosure
            The change divided by the span.
        """
        middle = (self.middle - begin.middle) / span
        return Enclosure(middle, (self.radius + begin.radius) / span)


def magnitude(value: Fraction) -> int:
    """Return the exponent of the leading decimal digit of `value` != 0."""
    return _rounded(abs(value), 20, "ROUND_FLOOR").adjusted()


def _rounded(value: Fraction, digits: int, rounding: str) -> Decimal:
    context = Context(prec=max(digits, 1), rounding=rounding, Emax=10**9, Emin=-(10**9))
    return context.divide(Decimal(value.numerator), Decimal(value.denominator))


def _decimal(value: Fraction, digits: int, rounding: str = "ROUND_HALF_EVEN") -> str:
    return str(_rounded(value, digits, rounding)) if value else "0"


def enclosure(value: Any) -> Enclosure:
    """Return the exact middle and radius of a float, a rational, an mpmath number or a ball.

    A number without an error bound has the radius zero. Raises ValueError or OverflowError if it is
    not finite, TypeError if it is not a number.
    """
    if isinstance(value, Enclosure):
        return value
    if isinstance(value, (float, np.floating, int, np.integer, Fraction)):
        own = value.item() if isinstance(value, np.generic) else value
        return Enclosure(Fraction(own), Fraction(0))
    if hasattr(value, "mid") and hasattr(value, "rad"):  # a ball of python-flint
        return Enclosure(_dyadic(*value.mid().man_exp()), _dyadic(*value.rad().man_exp()))
    if hasattr(value, "bracket"):  # a rational plus a multiple of cos(alpha), exactly
        return Enclosure(*value.bracket())
    if hasattr(value, "man_exp"):  # an mpmath number; its mantissa has no sign
        if value - value != 0:
            raise ValueError("not finite")
        size = _dyadic(*value.man_exp)
        return Enclosure(-size if value < 0 else size, Fraction(0))
    raise TypeError(f"a {type(value).__name__} has no exact value")


def _dyadic(mantissa: Any, exponent: Any) -> Fraction:
    m, e = int(mantissa), int(exponent)
    return Fraction(m << e) if e >= 0 else Fraction(m, 1 << -e)


enclosures = np.frompyfunc(enclosure, 1, 1)
"""`enclosure` of every element of an array, as an array of objects."""


def exact_value(value: Any) -> Fraction:
    """Return a number as an exact rational; for an enclosure its middle."""
    return enclosure(value).middle


def is_finite(value: Any) -> bool:
    """Return whether a number is neither infinite nor undefined."""
    try:
        enclosure(value)
    except (ValueError, OverflowError):
        return False
    return True


def as_float(value: Any) -> float:
    return nearest_float(exact_value(value))


def floats(array: NDArray[Any]) -> NDArray[np.float64]:
    if array.dtype != object:
        return array.astype(np.float64, copy=False)
    near = [as_float(value) for value in array.ravel().tolist()]
    return np.array(near, dtype=np.float64).reshape(array.shape)


def same(a: Any, b: Any) -> bool:
    """Return whether two numbers are equal, both nan, or balls with equal midpoint and radius."""
    if a is b:
        return True
    if hasattr(a, "rad") and hasattr(b, "rad"):
        return bool(a.mid() == b.mid()) and bool(a.rad() == b.rad())
    return bool(a == b) or bool(a != a and b != b)


def same_numbers(a: NDArray[Any], b: NDArray[Any]) -> bool:
    if a.dtype != object and b.dtype != object:
        return np.array_equal(a, b, equal_nan=True)
    pairs = zip(a.ravel().tolist(), b.ravel().tolist(), strict=False)
    return a.shape == b.shape and all(same(x, y) for x, y in pairs)


def as_written(name: str, values: NDArray[Any], digits: int | None) -> dict[str, NDArray[Any]]:
    """Return `values` by their names in files: floats, with decimals and radii if needed."""
    if values.dtype != object:
        return {name: values}
    texts, radii = [], []
    for middle, radius in map(enclosure, values.ravel().tolist()):
        radii.append(_float_above(radius))
        texts.append(Enclosure(middle, Fraction(radii[-1])).text(digits or 17))
    written = {
        name: floats(values),
        f"{name}_decimal": np.array(texts, dtype=str),
        f"{name}_radius": np.array(radii, dtype=float),
    }
    return {part: known.reshape(values.shape) for part, known in written.items()}


def quantity(name: str) -> str:
    """Return the name of a quantity; `name` may be the name of its decimals or radii in a file."""
    for companion in ("_decimal", "_radius"):
        name = name.removesuffix(companion)
    return name


def _float_above(value: Fraction) -> float:
    near = nearest_float(value)
    return near if Fraction(near) >= value else math.nextafter(near, math.inf)
