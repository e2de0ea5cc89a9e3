"""Double-double numbers: sums of two floats, good to about 2**-106."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exactcreep.compiling import inlined
from exactcreep.solvers.exact.simd import fused


def split(value: Fraction) -> tuple[float, float]:
    """Return `value` as two floats."""
    numerator, denominator = value.as_integer_ratio()
    high = numerator / denominator  # Python rounds it correctly
    top, bottom = high.as_integer_ratio()  # Fraction(high) would divide by common factors
    return high, (numerator * bottom - top * denominator) / (denominator * bottom)


@inlined
def two_sum(a, b):
    """Return the rounded sum of two floats and its exact rounding error (barring overflow)."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


def two_product(a: Any, b: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
    """Return the rounded products of floats and their exact errors (Dekker; barring overflow)."""
    product = a * b
    (a_high, a_low), (b_high, b_low) = _halves(a), _halves(b)
    return product, ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low


def _halves(value: Any) -> Any:
    shifted = value * 134217729.0
    high = shifted - (shifted - value)
    return high, value - high


@inlined
def plus(high, low, term):
    """Return ``(high + low) + term`` as two floats."""
    total, error = two_sum(high, term)
    error += low
    result = total + error
    return result, error - (result - total)


@inlined
def times(high, low, factor, factor_low):
    """Return the product of two sums of two floats as two floats."""
    product = high * factor
    return product, fused(high, factor, -product) + (high * factor_low + low * factor)


@inlined
def add(table, row, row_low, i, term):
    """Add a term to the number that two rows of a table hold in column i."""
    table[row, i], table[row_low, i] = plus(table[row, i], table[row_low, i], term)
