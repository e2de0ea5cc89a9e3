"""Read the columns of a temperature record: times, exact temperatures, and what is wrong with them.

Entries that cannot be taken are faults. All faults of a table are refused together, each kind with
its first rows, their number, and the option that would mend it.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Sequence
from fractions import Fraction
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from exactcreep.model.numbers import InputError, exact_number, nearest_float

if TYPE_CHECKING:
    from pandas import Series

DATES = {
    "iso": "2024-01-31T13:00",
    "day first": "31.01.2024 13:00",
    "month first": "01/31/2024 13:00",
}
ABSOLUTE_ZERO = {"C": Fraction(-27315, 100), "K": Fraction(0)}
GAP = 1.5
"""A step longer than so many usual ones is a gap."""
_EXAMPLES = 3  # rows that a message names; it gives the number of the others
_FEWEST_REGULAR = 10  # readings from which on there is a usual step
_DECIMAL = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d{1,4})?")
_DATE = r"^(\d{1,2})([./-])(\d{1,2})\2(\d{4})(?:(?:T| +)(\d{1,2})(:.*))?$"
_ZONE = r"[T ].*(?:Z|[+-]\d\d(?::?\d\d)?)$"
_MISSING = ("", "-", "--", "na", "n/a", "nan", "nat", "null", "none", "missing", "<na>")


class Faults:
    """What is wrong with the entries of a table, whose index numbers the rows."""

    def __init__(self) -> None:
        self.kinds: list[tuple[Series, str, str]] = []

    def add(self, entries: Series, allowed: str, mend: str = "") -> None:
        """Remember faulty entries, what they must be, and the option that would mend them."""
        if len(entries):
            self.kinds.append((entries, allowed, mend))

    def refuse(self, counted: str, file: str) -> None:
        """Raise one `InputError` with all faults in the order of their rows, if there are any."""
        errors = []
        for entries, allowed, mend in sorted(self.kinds, key=lambda kind: kind[0].index[0]):
            rows = ", ".join(map(str, entries.index[:_EXAMPLES]))
            more = f" and {len(entries) - _EXAMPLES} more" if len(entries) > _EXAMPLES else ""
            text = f"{allowed} in {counted} {rows}{more}" + (f" ({mend})" if mend else "")
            errors.append(InputError(str(entries.name), entries.iloc[0], text))
        if errors:
            first, *others = errors
            allowed = "; ".join([first.allowed, *map(str, others)])
            raise InputError(first.field, first.value, f"{allowed}; of {file}")


def is_missing(entries: Series) -> Series:
    return entries.astype(str).str.strip().str.lower().isin(_MISSING)


def with_point(entries: Series, decimal: str) -> Series:
    """Return entries without blanks, and numbers with a decimal point."""

    def plain(entry: Any) -> Any:
        if not isinstance(entry, str):
            return entry
        text = entry.strip()
        swapped = text if decimal == "." or "." in text else text.replace(",", ".", 1)
        return swapped if _DECIMAL.fullmatch(swapped) else text

    return entries.map(plain).astype(object)


def is_number(entries: Series) -> Series:
    """Return which entries are finite numbers, or texts of decimal ones."""

    def finite(entry: Any) -> bool:
        if isinstance(entry, str):
            return bool(_DECIMAL.fullmatch(entry))
        return isinstance(entry, int | float | Fraction) and -math.inf < entry < math.inf

    return entries.map(finite).astype(bool)


def dates_of(entries: Series, order: str) -> Series:
    """Return dates written in that order, in UTC; NaT for what is no date of 1700 to 2200."""
    texts = entries.astype(str)
    if order != "iso":
        first, _, second, year, hour, rest = (part for _, part in texts.str.extract(_DATE).items())
        day, month = (first, second) if order == "day first" else (second, first)
        clock = ("T" + hour.str.zfill(2) + rest).fillna("")
        texts = year + "-" + month.str.zfill(2) + "-" + day.str.zfill(2) + clock
    pandas = import_module("pandas")
    dates = pandas.to_datetime(texts, format="ISO8601", utc=True, errors="coerce")
    return dates.where(dates.dt.year.between(1700, 2200))


def times_of(entries: Series, order: str, decimal: str, faults: Faults) -> Series:
    """Return times without the faulty: floats, or dates, in UTC if they name a time zone."""
    gone, texts = is_missing(entries), with_point(entries, decimal)
    faults.add(entries[gone], "is missing", 'missing = "drop" leaves such rows out')
    numeric, dates = is_number(texts) & ~gone, dates_of(texts, order)
    wrong = entries[~numeric & ~gone & dates.isna()]
    others = [name for name in DATES if name != order and dates_of(wrong, name).notna().any()]
    mend = " or ".join(f'date_order = "{name}"' for name in others)
    allowed = f"must be a number or a date of the years 1700 to 2200 such as {DATES[order]}"
    faults.add(wrong, allowed, f"{mend} reads such dates" if others else "")
    zoned = texts.astype(str).str.contains(_ZONE)
    kinds = zoned.astype(int).where(~numeric, 2).drop(wrong.index)[~gone]
    other = kinds != kinds.iloc[0] if len(kinds) else kinds.astype(bool)
    faults.add(entries[kinds.index[other]], "must be of the same kind as before")
    kept = kinds.index[~other]
    if len(kept) and kinds[kept[0]] < 2:
        return dates[kept] if zoned[kept[0]] else dates[kept].dt.tz_localize(None)
    numbers = texts[kept].map(lambda entry: nearest_float(exact_number(entry, "time")))
    endless = np.isinf(numbers.astype(float))
    faults.add(entries[kept][endless], "must be below the largest float, 1.8e308,")
    return numbers[~endless]


def temperatures_of(
    entries: Series, missing: str, unit: str, scale: Fraction, decimal: str, faults: Faults
) -> Series:
    """Return temperatures exactly, without the faulty; nan is what is missing."""
    gone, texts = is_missing(entries), with_point(entries, decimal)
    if missing == "refuse":
        mend = 'missing = "drop" leaves such readings out, "interpolate" is linear in time'
        faults.add(entries[gone], "is missing", mend)
    numeric = is_number(texts) & ~gone
    comma = ~numeric & is_number(with_point(entries, ","))
    allowed = f"must be a number with a decimal {'point' if decimal == '.' else 'comma'}"
    faults.add(entries[~numeric & ~gone & ~comma], allowed)
    faults.add(entries[comma & ~gone], allowed, 'decimal = "," reads decimal commas')
    exact = {text: exact_number(text, "temperature") * scale for text in set(texts[numeric])}
    values = texts[numeric].map(exact)
    cold = values.astype(object) < ABSOLUTE_ZERO[unit]
    faults.add(entries[values.index[cold]], "must not be below absolute zero")
    values = values[~cold].astype(object)
    return values.reindex(entries.index[gone | numeric]) if missing == "interpolate" else values


def one_of(values: Series, which: str) -> Any:
    """Return one temperature of several at a time: the "first", the "last" or the "mean"."""
    known = values.dropna().tolist()
    if known and which == "mean":
        return sum(known, Fraction(0)) / len(known)
    return known[-1 if which == "last" else 0] if known else math.nan


def gaps_in(times: Sequence[float]) -> tuple[float, list[int]]:
    """Return the longest usual step, and the readings that follow a longer one, a gap.

    Usual is what at least one step in ten is as long as: uneven hours are no gaps.
    """
    if len(times) < _FEWEST_REGULAR:
        return math.inf, []
    steps = np.diff(times)
    usual = float(np.quantile(steps, 0.9, method="lower"))
    return usual, (np.flatnonzero(steps > GAP * usual) + 1).tolist()


def filled(values: Series, times: Sequence[float]) -> list[Fraction]:
    """Return temperatures, those that are missing linear in time between their neighbours."""
    whole: list[Fraction] = values.tolist()
    known = np.flatnonzero(values.notna()).tolist()
    for a, b in itertools.pairwise(known):
        for k in range(a + 1, b):
            begin = Fraction(times[a])
            share = (Fraction(times[k]) - begin) / (Fraction(times[b]) - begin)
            whole[k] = whole[a] + (whole[b] - whole[a]) * share
    return whole
