"""Exact numbers: every input of the model is stored as an exact rational."""

from __future__ import annotations

import functools
import inspect
import math
import numbers
import re
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from decimal import Decimal
from enum import Enum
from fractions import Fraction
from html import escape
from typing import Any, ClassVar, ParamSpec, TypeVar

import numpy as np

P = ParamSpec("P")
T = TypeVar("T")
Number = int | float | str | Fraction | Decimal
"""Types of numbers that a user may give; see `exact_number`."""


Scalar = Any
"""A number that a solver computes with: a float, a `Fraction`, an mpmath number, a ball."""
_DECIMAL = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?")
_RATIO = re.compile(r"[+-]?\d+/\d+")
_INTEGERS = re.compile(r"-?\d+(/\d+)?")
_LONGEST = 10_000  # characters of a user's number; more is a mistake or an attack
_LONGEST_RATIO = 250_000  # characters of a solver's number, of 100 000 digits at most
_WIDEST = 5_000  # largest decimal exponent


_OF_NUMBERS = TypeError, ValueError, AttributeError, ArithmeticError
"""Errors of a number in the wrong place; any other is a defect if all arguments are numbers."""


class InputError(ValueError):
    """Bad input: the message names the quantity, the value and the allowed values.

    Parameters
    ----------
    name : str
        Its name for the user.
    value : object
        The value given.
    allowed : str
        The allowed values, as the end of a sentence.

    Examples
    --------
    >>> try:
    ...     Cycles(amplitude="0.01", cycles="many")
    ... except InputError as error:
    ...     print(error)
    cycles = 'many': must be a whole number, at least 1 and at most 1000000000000
    """

    def __init__(self, name: str, value: Any, allowed: str) -> None:
        self.name, self.value, self.allowed = name, value, allowed
        super().__init__(name, value, allowed)

    def __str__(self) -> str:
        if self.value is None and self.allowed.startswith("is missing"):
            return f"{self.name} {self.allowed}"
        text = shown(self.value)
        if len(text) > 80:
            text = f"{text[:20]}…{text[-50:]} ({len(text)} characters)"
        return f"{self.name} = {text}: {self.allowed}"


def refusing(function: Callable[P, T]) -> Callable[P, T]:
    """Let a function that cannot use its arguments raise `InputError`, whatever they are.

    Of a wrong number of arguments, Python's own TypeError remains; and so does a defect that shows
    although all arguments are plain numbers.
    """

    @functools.wraps(function)
    def careful(*args: P.args, **words: P.kwargs) -> T:
        try:
            return function(*args, **words)
        except (InputError, Warning, OSError):
            raise
        except Exception as error:
            given = inspect.signature(function).bind(*args, **words).arguments
            plain = all(isinstance(value, int | float | Fraction) for value in given.values())
            if plain and not isinstance(error, _OF_NUMBERS):
                raise
            usable = {name: value for name, value in given.items() if name != "cls"}
            said = " ".join(str(error).split()) if type(error) is ValueError else ""
            named = (name for name in usable if re.search(rf"\b{name}\b", said))
            name = next(named, next(iter(usable)))
            allowed = said[:200] or "is not of a type that can be used"
            raise InputError(name, usable[name], allowed) from error

    return careful


def shown(value: Any) -> str:
    """Return any value in short: a rational in full, of a long list both ends."""
    try:
        return _shown(value)
    except Exception:  # an endless integer, endless nesting, an object without a text
        return f"a {type(value).__name__} too large or too odd to be shown"


def _shown(value: Any) -> str:
    if isinstance(value, Fraction):
        if value.denominator == 1 and abs(value) < 10**15:
            return str(value.numerator)
        near = nearest_float(value)
        if math.isfinite(near) and value in (Fraction(near), Fraction(repr(near))):
            return repr(near) if Fraction(near) == value else repr(repr(near))
        text = ratio_text(value)
        return repr(text) if len(text) <= 60 else f"{near!r}..."
    if isinstance(value, np.ndarray):
        part = value if value.size <= 1000 else value[:4]
        value = list(part) if value.dtype.kind == "f" and value.ndim == 1 else part.tolist()
    if isinstance(value, np.floating):
        return f"{float(value):.6g}"
    if isinstance(value, (list, tuple)):
        few = value if len(value) <= 6 else (*value[:3], *value[-3:])
        parts = [_shown(part) for part in few]
        if len(value) > 6:
            parts.insert(3, f"... {len(value)} values ...")
        return f"[{', '.join(parts)}]"
    return repr(value.value if isinstance(value, Enum) else value)


def with_error(value: float, error: float, sign: str = "") -> str:
    """Return a value with its standard error, both to two digits of the error.

    If the error is nan, the value stands alone. `sign` is "+" for values that always have a sign.

    >>> with_error(61.786543, 0.0421), with_error(5.49, 53.2, "+"), with_error(2 / 3, math.nan)
    ('61.787 ± 0.042', '+5 ± 53', '0.666667')
    >>> with_error(7.26232839e-4, 6.4537e-6), with_error(-8.50438e-5, 1.5e-9)
    ('0.0007262 ± 0.0000065', '-8.50438e-05 ± 1.5e-09')
    """
    if math.isnan(error):
        return f"{value:{sign}.6g}"
    if not 1e-9 * abs(value) < error < math.inf:
        return f"{value:{sign}.6g} ± {error:.2g}"
    places = 1 - math.floor(math.log10(error))
    if places > 7:
        digits = max(2, 1 + places + math.floor(math.log10(abs(value)))) if value else 1
        return f"{value:{sign}.{digits}g} ± {error:.2g}"
    places = max(0, places)
    return f"{value:{sign}.{places}f} ± {error:.{places}f}"


class Shown:
    """An object that prints in one line: its class, and its fields or chosen facts."""

    _shown_as: ClassVar[str] = ""
    """A name to print instead of the class name of a subclass."""
    _units_in_line: ClassVar[bool] = False
    """Whether the line has units; without units it is a Python expression of the object."""

    def _facts(self) -> Mapping[str, Any]:
        """Return the facts to show, by name, without None and ""."""
        return vars(self)

    def _units(self) -> Mapping[str, str]:
        """Return the units of the facts, by name, if there are any."""
        return {}

    def _caption(self) -> str:
        """Return the title of its table in a notebook."""
        return self._shown_as or type(self).__name__

    def __repr__(self) -> str:
        units = self._units() if self._units_in_line else {}
        known = (
            f"{name}={f'{in_words(value)} {units[name]}' if name in units else shown(value)}"
            for name, value in self._facts().items()
            if not is_missing(value)
        )
        return f"{self._shown_as or type(self).__name__}({', '.join(known)})"

    def _repr_html_(self) -> str:
        units = self._units()
        rows = [
            f"<tr><th style='text-align:left'>{escape(name)}</th>"
            f"<td>{escape(in_words(value))} {escape(units.get(name, ''))}</td></tr>"
            for name, value in self._facts().items()
            if not is_missing(value)
        ]
        return f"<table><caption>{escape(self._caption())}</caption>{''.join(rows)}</table>"


def in_words(value: Any) -> str:
    """Return a value for people: text unchanged, a rational (also as text) as a decimal.

    >>> in_words("3/5"), in_words(Fraction(0.6)), in_words("relaxed")
    ('0.6', '0.6', 'relaxed')
    """
    if isinstance(value, str) and _RATIO.fullmatch(value):
        with suppress(ValueError):  # a text such as "1/0"
            value = ratio_of(value)
    text = value if isinstance(value, str) else shown(value)
    return text.strip("'") if isinstance(value, Fraction) else text


def in_full(value: float, digits: int = 3, sign: str = "") -> str:
    """Return a number to some digits, without a power of ten up to a million million.

    >>> in_full(1812.4), in_full(133.2, 2, "+"), in_full(3e15)
    ('1810', '+130', '3e+15')
    """
    return f"{float(f'{value:.{digits}g}'):{sign}.12g}"


def in_short(value: Any) -> str:
    """Return one value of a setting for a table or a legend; of a long list its ends.

    >>> in_short("1/4"), in_short([0.4, 0.5, 0.4]), in_short({"size": "1e-6", "seed": 1})
    ('1/4', '0.4 to 0.5', 'size 1e-06, seed 1')
    """
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {in_short(part)}" for key, part in value.items())
    try:
        known = [float(part) for part in value] if isinstance(value, list) else [float(value)]
        ends, between = ((min(known), max(known)), " to ") if len(known) > 2 else (known, " and ")
        return between.join(f"{end:.6g}" for end in ends)
    except (TypeError, ValueError):
        return re.sub(r'[{}\[\]":]', "", str(value))[:40]


def is_missing(value: Any) -> bool:
    """Return whether a value is missing: None, or an empty text."""
    return value is None or (isinstance(value, str) and value == "")


def listed(value: Any) -> list[Any] | None:
    """Return the values of a list, an array or an iterator; None for any other value, and text."""
    if isinstance(value, (str, bytes, set, dict)) or not isinstance(value, Iterable):
        return None
    try:
        return list(value)
    except TypeError:  # an array without dimensions
        return None


def exact_number(value: Any, name: str) -> Fraction:
    """Return `value` as an exact rational, or raise `InputError` about `name`.

    A float is its exact binary value; a string is a decimal (``"1e-3"``) or a ratio (``"3/5"``).
    """
    if isinstance(value, Fraction):
        return value
    if isinstance(value, (bool, np.bool_)):
        raise InputError(name, value, "must be a number, not a truth value")
    if isinstance(value, numbers.Integral) and hasattr(value, "__index__"):
        return Fraction(int(value))
    if isinstance(value, np.floating):
        value = float(value)
    if isinstance(value, (float, Decimal)):
        if not (value.is_finite() if isinstance(value, Decimal) else math.isfinite(value)):
            raise InputError(name, value, "must be a finite number")
        return Fraction(value) if isinstance(value, float) else _from_text(str(value), value, name)
    if isinstance(value, str):
        return _from_text(value.strip().replace("_", ""), value, name)
    raise InputError(
        name, value, "must be a number (an integer, a float, a Fraction or a decimal string)"
    )


def _from_text(text: str, value: Any, name: str) -> Fraction:
    if len(text) > _LONGEST:
        raise InputError(name, value, f"must have at most {_LONGEST} characters")
    if _RATIO.fullmatch(text):
        numerator, denominator = text.split("/")
        if _long(denominator) == 0:
            raise InputError(name, value, "must not be divided by zero")
        return _long(numerator) / _long(denominator)
    if not _DECIMAL.fullmatch(text):
        raise InputError(name, value, 'must be a finite number, e.g. 0.25, "1/4" or 2.5e-3')
    exponent = re.split("[eE]", text)[1] if re.search("[eE]", text) else "0"
    if len(exponent) > 6 or abs(int(exponent)) > _WIDEST:
        raise InputError(name, value, f"must have an exponent between -{_WIDEST} and {_WIDEST}")
    return _long(text)


def _long(text: str) -> Fraction:
    """Return a decimal exactly; it may have more digits than Python's integers allow."""
    return Fraction(Decimal(text))


def ratio_text(value: Fraction) -> str:
    """Return ``p/q``, or ``p``, with any number of digits; `ratio_of` reads it."""
    numerator, denominator = (f"{Decimal(part):f}" for part in value.as_integer_ratio())
    return numerator if value.denominator == 1 else f"{numerator}/{denominator}"


def ratio_of(text: str) -> Fraction:
    """Return the rational that `ratio_text` wrote, or raise `ValueError`."""
    numerator, slash, denominator = text.partition("/")
    if len(text) > _LONGEST_RATIO or not _INTEGERS.fullmatch(text):
        raise ValueError(f"not a ratio of integers: {text[:60]!r}")
    try:
        return _long(numerator) / (_long(denominator) if slash else 1)
    except (ArithmeticError, OverflowError):
        raise ValueError(f"not a ratio of integers: {text[:60]!r}") from None


def positive_number(value: Any, name: str) -> Fraction:
    """Return `value` as a rational, or raise `InputError` unless it is positive."""
    number = exact_number(value, name)
    if number <= 0:
        raise InputError(name, value, "must be positive")
    return number


def number_from_zero(value: Any, name: str) -> Fraction:
    """Return `value` as a rational, or raise `InputError` if it is negative."""
    number = exact_number(value, name)
    if number < 0:
        raise InputError(name, value, "must not be negative")
    return number


def number_of_floats(value: Any, name: str) -> Fraction:
    """Return `value` as a rational, or raise `InputError` if no float is so large."""
    number = exact_number(value, name)
    if not math.isfinite(nearest_float(number)):
        raise InputError(name, value, "must be smaller than the largest float, 1.8e308")
    return number


def sign_of_surd(rational: Fraction, surd: Fraction | int, radicand: Fraction) -> int:
    """Return the sign of ``rational + surd sqrt(radicand)``, exactly; `radicand` is positive."""
    signs = [(value > 0) - (value < 0) for value in (rational, surd)]
    if signs[0] * signs[1] >= 0:
        return signs[0] or signs[1]
    more = rational**2 - surd**2 * radicand
    return signs[0] * ((more > 0) - (more < 0))


def whole_number(value: Any, name: str, *, least: int, most: int | None = None) -> int:
    """Return `value` as an int between `least` and `most` (inclusive), or raise `InputError`."""
    if type(value) is int and least <= value and (most is None or value <= most):
        return value
    allowed = f"must be a whole number, at least {least}"
    if most is not None:
        allowed += f" and at most {most}"
    try:
        number = exact_number(value, name)
    except InputError:
        raise InputError(name, value, allowed) from None
    if number.denominator != 1:
        raise InputError(name, value, allowed)
    if number < least or (most is not None and number > most):
        raise InputError(name, int(number), allowed)
    return int(number)


def nearest_float(value: Fraction) -> float:
    """Return the float64 nearest to `value`, +-inf beyond its range."""
    try:
        return value.numerator / value.denominator
    except OverflowError:
        return math.inf if value > 0 else -math.inf


def plain_data(about: Mapping[str, Any]) -> dict[str, Any]:
    """Return a mapping that JSON can hold: numbers that are not finite become None."""
    return {str(key): _plain(value) for key, value in about.items()}


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return plain_data(value)
    if isinstance(value, (list, tuple, np.ndarray)):
        return [_plain(part) for part in value]
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, Enum):
        return _plain(value.value)
    if hasattr(value, "summary"):
        return value.summary()
    if isinstance(value, Fraction):
        return ratio_text(value)
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value if isinstance(value, (str, int, float)) or value is None else str(value)
