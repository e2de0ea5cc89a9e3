"""Ranges and decimals of amplitudes."""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction
from itertools import pairwise
from typing import Any, NamedTuple

from exactcreep.model.chain import Chain, first_start, mean_mu_d, require_dilation
from exactcreep.model.enclosure import magnitude
from exactcreep.model.numbers import InputError, Number, exact_number, nearest_float, whole_number

Bracket = tuple[Fraction, Fraction]


class Span(NamedTuple):
    """The range of a search for a threshold: a bracket, or scans one after the other."""

    bracket: Bracket | None
    scans: list[Bracket]
    free: bool  # whether the first scan may begin lower
    points: int  # equal steps of each scan

    @classmethod
    def of(
        cls, chain: Chain, low: Number | None, high: Number | None, bracket: Any, points: Any = 1
    ) -> Span:
        """Return the span for these arguments; the defaults do not affect the edge found."""
        between = None
        if bracket is not None:
            if low is not None or high is not None:
                allowed = "must not be given together with the ends of a scan"
                raise InputError("bracket", bracket, allowed)
            between = two_numbers(bracket, "bracket")
        cosine = Fraction(chain.cos_alpha)
        driven = abs(chain.n * chain.tan_alpha * cosine + sum(chain.end_forces))
        swing = sum(map(abs, chain.rates.values())) * chain.l0
        law = (chain.n * mean_mu_d(chain) * cosine - driven) / swing if swing else Fraction(0)
        first_slip = first_start(chain) / chain.l0
        begin = (law if law > 0 else first_slip) / 2 if low is None else exact_number(low, "from")
        if begin < 0:
            raise InputError("from", low, "must not be negative")
        usual = [end for end in sorted([2 * law, chain.n * first_slip]) if end > begin]
        ends = usual or [2 * begin] if high is None else [exact_number(high, "to")]
        if high is not None and begin >= ends[0]:
            raise InputError("to", high, f"must exceed from = {nearest_float(begin)}")
        largest = max(between or (begin, *ends))
        require_dilation(chain, largest, *(("bracket", bracket) if between else ("to", high)))
        steps = whole_number(points, "points", least=1, most=10**7)
        free = low is None and between is None
        return cls(between, list(pairwise([begin, *ends])), free, steps)


def two_numbers(given: Any, field: str, *, positive: bool = False) -> Bracket:
    """Return two ascending numbers, none negative (or all `positive`)."""
    try:
        first, second = given
    except (TypeError, ValueError):
        raise InputError(field, given, "must be two numbers") from None
    low, high = exact_number(first, field), exact_number(second, field)
    if not 0 <= low < high or (positive and low == 0):
        allowed = f"must be two numbers, 0 {'<' if positive else '<='} LO < HI"
        raise InputError(field, f"{first} {second}", allowed)
    return low, high


def unit_of(value: Fraction, digits: int) -> Fraction:
    """Return one unit of the last of `digits` significant decimal digits of `value` > 0."""
    return Fraction(10) ** (magnitude(value) + 1 - digits)


def text_of(count: int, unit: Fraction) -> str:
    """Return ``count * unit`` as a decimal; `unit` is a power of ten."""
    exponent = Decimal(unit.numerator).adjusted() - Decimal(unit.denominator).adjusted()
    sign, digits, _ = Decimal(count).as_tuple()
    return str(Decimal((sign, digits, exponent)))
