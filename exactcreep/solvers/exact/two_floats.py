"""Numbers kept as the sum of two floats, good to about 2**-106, and sums that round only there."""

from __future__ import annotations

from fractions import Fraction

from exactcreep.solvers.exact.layout import inlined


def split(value: Fraction) -> tuple[float, float]:
    """Return `value` as two floats."""
    return split_ratio(value.numerator, value.denominator)


def split_ratio(numerator: int, denominator: int) -> tuple[float, float]:
    """Return a ratio of whole numbers as two floats."""
    high = numerator / denominator  # Python rounds it correctly
    top, bottom = high.as_integer_ratio()
    return high, (numerator * bottom - top * denominator) / (denominator * bottom)


@inlined
def two_sum(a, b):
    """Return the rounded sum of two floats, and what rounding took from it, exactly.

    Guarantee: barring overflow, the two results add up to ``a + b``.
    """
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


@inlined
def plus(high, low, term):
    """Return ``(high + low) + term`` as two floats."""
    total, error = two_sum(high, term)
    error += low
    result = total + error
    return result, error - (result - total)


@inlined
def add(table, row, row_low, i, term):
    """Add a term to the number that two rows of a table hold in column i."""
    table[row, i], table[row_low, i] = plus(table[row, i], table[row_low, i], term)
