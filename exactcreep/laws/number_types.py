"""The arithmetic of the laws: int, Fraction, float, array or mpmath in, the same type out."""

from __future__ import annotations

import math
import numbers
from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import Any

import numpy as np
from mpmath import libmp

from exactcreep.model.numbers import refusing

Number = Any
"""int, Fraction, float, numpy array or mpmath number."""


def is_mpf(value: object) -> bool:
    """Return whether a value is an mpmath number of any context."""
    return hasattr(value, "_mpf_") and hasattr(value, "context")


def rational(value: Number) -> Fraction:
    if is_mpf(value) and value.context.isfinite(value):
        numerator, denominator = libmp.to_rational(value._mpf_)
        return Fraction(int(numerator), int(denominator))
    if not isinstance(value, int | Fraction) and not math.isfinite(value):
        raise ValueError(f"{value} is not a finite number")
    return Fraction(value)


def real(value: Number, name: str) -> Number:
    """Return a real number; raise `ValueError` with its name for anything else."""
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        raise ValueError(f"{name} must be a real number, not {value!r}")
    return int(value) if isinstance(value, numbers.Integral) else value


def coerced(given: Mapping[str, Number]) -> dict[str, Number]:
    """Convert numbers to one common type; rationals stay rational among themselves."""
    values = {name: real(value, name) for name, value in given.items()}
    convert: Callable[[Number], Number] = Fraction
    if contexts := [value.context for value in values.values() if is_mpf(value)]:
        convert = contexts[-1].convert
    elif any(isinstance(value, float | np.floating) for value in values.values()):
        convert = float
    return {name: convert(value) for name, value in values.items()}


def each(parameters: Mapping[str, Number], name: str) -> list[Number]:
    """Return a coefficient of every slider."""
    value, n = parameters[name], int(parameters["n"])
    listed = list(value) if isinstance(value, list | tuple) else [value] * n
    require(len(listed) == n, f"{name} must hold {n} coefficients")
    return listed


def require(condition: bool, sentence: str) -> None:
    """Raise `ValueError` unless a condition holds."""
    if not condition:
        raise ValueError(sentence)


def square_root(value: Number) -> Number:
    if is_mpf(value):
        return value.context.sqrt(value)
    if isinstance(value, Fraction | int):
        exact = Fraction(*map(math.isqrt, value.as_integer_ratio()))
        return exact if exact * exact == value else math.sqrt(value)
    root = np.sqrt(value)
    return root if isinstance(value, np.ndarray) else float(root)


def root_of_pi(like: Number) -> Number:
    return square_root(+like.context.pi) if is_mpf(like) else math.sqrt(math.pi)


def positive_part(value: Number) -> Number:
    return value if value > 0 else value * 0


@refusing
def cosine(tan_alpha: Number) -> Number:
    """Return cos(alpha), rational for Pythagorean slopes. Source: ``derivations/scaling.py``.

    Parameters
    ----------
    tan_alpha : number
        Slope.

    Returns
    -------
    number
        cos(alpha), in the arithmetic of the slope.

    Examples
    --------
    >>> cosine(Fraction(3, 4))
    Fraction(4, 5)
    """
    return 1 / square_root(1 + tan_alpha * tan_alpha)


def floor_of_surd(surd: Fraction, radicand: Fraction, rational: Fraction) -> int:
    """Return floor(surd * sqrt(radicand) + rational), exactly."""
    scale = surd.denominator * rational.denominator  # makes both products below whole
    square = (surd * scale) ** 2 * radicand
    root = math.isqrt(math.floor(square)) if surd >= 0 else -1 - math.isqrt(math.ceil(square) - 1)
    return (root + int(rational * scale)) // scale
