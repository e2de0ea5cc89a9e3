"""The readings of a temperature record: find their faults, and say what was read."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from datetime import timedelta
from fractions import Fraction
from functools import cached_property
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.numbers import InputError, exact_number, nearest_float
from exactcreep.records.columns import Temperatures
from exactcreep.records.dates import DAY
from exactcreep.records.table import CellError, Table
from exactcreep.records.times import GAP, Times, usual_step

if TYPE_CHECKING:
    from pandas import Series

ABSOLUTE_ZERO = {"C": Fraction(-27315, 100), "K": Fraction(0), "F": Fraction(-45967, 100)}
COLDEST, HOTTEST, ROOFS = -90, 60, 120
"""Limits of weather, and of the temperature of roofs, in degrees Celsius."""
FAR, OFTEN_FAR = 15, 5
"""A reading is far from its neighbours if it differs from their median by 15 K, and by 5 times the
distance that nine readings in ten do not exceed."""
CODES = frozenset(
    sign * number
    for number in (
        99.9, 99.99, 99, 999, 999.9, 999.99, 9999, 9999.9, 99999, 88.8, 888.8, 777.7, 7777, 6999,
        127, 3276.7, 3276.8, 32767, 32768, 327.67, 327.68, 998, 9998, 666, 99.8,
    )
    for sign in (1, -1)
) | {85.0}  # fmt: skip
"""Numbers that stand for a missing reading, if no reading is near them."""
_FEW_EMPTY = 10  # one row in so many may lack a temperature at the ends, as loggers end
_FEWEST_SWAPPED = 100  # one day in so many may have its minimum above its maximum
_UNITS = {"C": "degrees Celsius", "K": "kelvin", "F": "degrees Fahrenheit"}
SHORT_UNITS = {"C": "°C", "K": "K", "F": "°F"}
_NONE = np.array([], np.intp)
_YEAR = 360  # days in which every season is met


class RecordWarning(UserWarning):
    """A temperature record is probably not meant as written.

    Examples
    --------
    >>> import warnings
    >>> with warnings.catch_warnings(record=True, action="always") as caught:
    ...     kelvin = TemperatureRecord.of([283, 304, 285], kappa="29e-6", T0=283, times=[0, 1, 2])
    >>> print(caught[0].message)  # doctest: +ELLIPSIS
    the temperatures of (arrays): 283 to 304 is no weather in degrees Celsius...
    """


def kelvin_in(unit: str) -> Fraction:
    """Return the kelvins in one degree of a unit."""
    return Fraction(5, 9) if unit == "F" else Fraction(1)


class Readings:
    """Every reading of a table, in the order of its rows, including faulty ones.

    `file`: "" for arrays; `names`, `maximum`: the columns of temperatures by hour of the day, and
    which of them is the maximum; `times`: dates (in UTC if a time zone is given) or floats;
    `written`: times as written; `entries`, `exact`: the text in the table, and the temperature that
    it means, or None; `lines`, `numbers`: of lines and columns in the file; `below`, `empty`: how
    many lines below the table, and rows without a temperature at its ends, are left out; `options`:
    the arguments of `TemperatureRecord` that read the file so.
    """

    def __init__(
        self, times: Times, found: Temperatures, hours: Sequence[Fraction], file: str = "",
        table: Table | None = None,
    ) -> None:  # fmt: skip
        """Two temperatures of a row are at `hours` after its date."""
        names, moments = [*found.options.values()], times.values
        daily = len(names) == 2
        if daily and not times.dated:
            allowed = "must be a date, where a row has the minimum and the maximum of a day"
            raise CellError(times.columns[0], times.written[0], allowed, 1)
        order = sorted((0, 1), key=lambda k: hours[k]) if daily else [0]
        if times.dated:
            moments = np.round(moments * 1e6).astype("datetime64[us]")
        if daily:
            after = [timedelta(hours=float(hours[k])) for k in order]
            moments = moments[:, None] + np.array(after, "timedelta64[us]")
        begin, end = _ends(found.cells) if table else (0, len(moments))
        self.file, self.unit, self.scale = file, found.unit, found.scale
        self.names = [names[k] for k in order]
        self.maximum = order.index(1) if daily else None
        self.times: NDArray[Any] = moments[begin:end].ravel()
        self.written = [text for text in times.written[begin:end] for _ in order]
        self.entries = [found.cells[place][k] for k in range(begin, end) for place in order]
        meant = {
            entry: _temperature(entry, found.decimal, found.scale) for entry in {*self.entries}
        }
        self.exact = [meant[entry] for entry in self.entries]
        rows = table.rows[begin:end] if table else range(end)
        self.lines = [row + 1 for row in rows for _ in order]
        self.numbers = {name: k for k, name in enumerate(table.names if table else (), 1)}
        self.below, self.empty = table.below if table else 0, len(times.written) - end + begin
        several = times.columns if len(times.columns) > 1 else times.columns[0]
        self.options = found.options | {
            "time_column": several, "date_format": times.date_format, "unit": found.unit,
            "scale": found.scale, "decimal": found.decimal,
        }  # fmt: skip
        if table:
            self.options |= {"delimiter": table.delimiter, "encoding": table.encoding}

    @property
    def dated(self) -> bool:
        return self.times.dtype.kind == "M"

    @property
    def seconds(self) -> NDArray[np.float64]:
        """Seconds since the first date; numbers as they are written."""
        if not self.dated:
            return self.times
        return np.asarray((self.times - self.times[0]) / np.timedelta64(1, "s"))

    @cached_property
    def values(self) -> NDArray[np.float64]:
        """Temperatures in the unit, nan if missing."""
        known = {None: np.nan} | {value: nearest_float(value) for value in self.exact if value}
        return np.array([known.get(value, 0.0) for value in self.exact])

    @property
    def celsius(self) -> NDArray[np.float64]:
        """The same in degrees Celsius."""
        if self.unit == "F":
            return (self.values - 32) * 5 / 9
        return self.values - (273.15 if self.unit == "K" else 0.0)

    @property
    def temperatures(self) -> NDArray[np.float64]:
        """The known temperatures in the unit, without those far from their neighbours."""
        values = np.delete(self.values, self.faults().get("far", _NONE))
        return np.asarray(values[np.isfinite(values)])

    @property
    def missing(self) -> int:
        """How many readings are missing, a code for missing, or far from their neighbours."""
        found = self.faults()
        return sum(found[kind].size for kind in ("missing", "far") if kind in found)

    @property
    def series(self) -> Series:
        """A pandas Series of the temperatures by time, nan where they are missing or suspect."""
        values = self.values.copy()
        values[self.faults().get("far", _NONE)] = np.nan
        return import_module("pandas").Series(values, self.times, name="temperature")

    # --- faults ----------------------------------------------------------------------------------

    @cached_property
    def _steps(self) -> NDArray[np.float64]:
        """The time since the previous reading; nan for the first."""
        return np.diff(self.seconds, prepend=np.nan)

    @cached_property
    def _usual(self) -> float:
        return usual_step(self._steps)

    def faults(self) -> dict[str, NDArray[np.intp]]:
        """Return the faulty readings by kind of fault, most important first.

        ``missing``; ``late``: not after the previous reading; ``gap``: after a gap; ``far``: far
        from its neighbours, a code for missing, or impossible weather; ``swapped``: a day's second
        reading, on too many days.
        """
        found = {
            "missing": np.isnan(self.celsius),
            "late": self._steps <= 0,
            "gap": self._steps > max(GAP * self._usual, 0.0),
            "far": self._far,
            "swapped": self._swapped,
        }
        if found["swapped"].sum() * _FEWEST_SWAPPED <= len(self.times) // 2:
            del found["swapped"]
        return {kind: np.flatnonzero(wrong) for kind, wrong in found.items() if wrong.any()}

    @cached_property
    def _far(self) -> NDArray[np.bool_]:
        """Readings that differ much from those around, if most do not; equal ones count once."""
        values = self.celsius
        known = values[np.isfinite(values)]
        if not known.size:
            return np.zeros(len(values), bool)
        columns = values.reshape(-1, len(self.names))
        off = np.stack([_distance(column) for column in columns.T], axis=1)
        limit = np.maximum(FAR, OFTEN_FAR * np.nanquantile(off, 0.9, axis=0, method="lower"))
        far = (off > limit).ravel()
        if COLDEST < np.median(known) < ROOFS:
            far |= (values < 2 * COLDEST) | (values > 2 * ROOFS)
        codes = {value for value in {*self.exact} if value and float(value / self.scale) in CODES}
        coded = np.array([value in codes for value in self.exact], bool)
        others = values[~coded & np.isfinite(values)]
        if others.size and coded.any():  # a number for missing, 15 K beyond all others
            apart = 2 * FAR if coded.sum() == 1 or len(others) < 3 else FAR
            far |= coded & ((values < others.min() - apart) | (values > others.max() + apart))
        return np.asarray(far | (values < float(ABSOLUTE_ZERO["C"]) - 1e-9))

    @property
    def _swapped(self) -> NDArray[np.bool_]:
        wrong = np.zeros(len(self.times), bool)
        if self.maximum is not None:
            known = np.where(self._far, np.nan, self.celsius)
            wrong[1::2] = known[1 - self.maximum :: 2] > known[self.maximum :: 2]
        return wrong

    def refusal(self, kind: str, places: NDArray[np.intp]) -> InputError:
        """Return the error that refuses the first reading with a fault."""
        k, width = int(places[0]), len(self.names)
        name, entry, at = self.names[k % width], self.entries[k], self._at(k)
        many = f", and {len(places) - 1} more" if len(places) > 1 else ""
        if kind == "swapped":
            low, high = self.names[1 - (self.maximum or 0)], self.names[self.maximum or 0]
            said = f"is above {high} {self._days(places)}: the columns may be swapped"
            return CellError("minimum_column", low, f"{said} (in {self.file})", self.lines[k])
        if kind in ("late", "gap"):
            name, entry = "time", self.written[k]
        if kind == "late":
            said = f"must be later than {self.written[k - 1]} before it{many}"
            if (places.size > len(self.times) // 4) and self.file:
                said += "; name the column of the hour too (time_column = date,hour), or take the"
                said += " rows of one station and one quantity"
        elif kind == "gap":
            unit, size = (" hours", 3600) if self._usual < DAY else (" days", DAY)
            unit, size = (unit, size) if self.dated else ("", 1)
            step, usual = self._steps[k] / size, self._usual / size
            after = self._at(k - 1).partition(" ")[2]
            said = f"is {step:.4g}{unit} after {after}, where {usual:.4g} is usual, a gap{many}"
        elif kind == "missing":
            said = (
                f"is missing, or no number with decimal = {self.options['decimal']!r}, {at}{many}"
            )
        else:
            beside = [*self.entries[k - width : k : width], *self.entries[k + width :: width][:1]]
            near = "its neighbours, " + " and ".join(map(str, beside)) if beside else "any weather"
            said = f"is far from {near}, or a code for missing, {at}{many}"
        where = f" (line {self.lines[k]} of {self.file})" if self.file else ""
        mend = 'mend it with pandas, as the page "Use my own temperature record" shows'
        if kind in ("late", "gap") and self.dated:
            mend += ", also for summer time"
        column = self.numbers.get(self.names[k % width], 0)
        return CellError(name, entry, f"{said}{where}; {mend}", self.lines[k], column)

    def _days(self, places: NDArray[np.intp]) -> str:
        days, first = len(self.times) // 2, self.written[places[0]]
        return f"on {len(places)} of {days} days, first on {first}"

    def _at(self, k: int) -> str:
        """Return the time of a reading in words: on 10 April 2024."""
        if not self.dated:
            return f"at {self.written[k]}"
        date = self.times[k].astype("datetime64[us]").item()
        return f"on {date.day} {date:%B} {date.year}"

    def impossible(self) -> InputError | None:
        """Return the error that refuses temperatures without a unit that no weather has."""
        said = self._unlikely(ROOFS, 0.95)
        if not said:
            return None
        where = f"(column {self.names[0]}, from line {self.lines[0]} of {self.file} on)"
        return CellError("unit", None, f"is missing, and {said} {where}", self.lines[0])

    def doubts(self) -> Iterator[str]:
        """Yield reasons to doubt the unit of temperatures, or the order of the columns."""
        file = self.file or "(arrays)"
        if (places := np.flatnonzero(self._swapped)).size:
            yield f"in {file} the minimum is above the maximum {self._days(places)}"
        if said := self._unlikely(HOTTEST, 0.99):
            yield f"the temperatures of {file}: {said}"

    def _unlikely(self, hottest: float, share: float) -> str:
        """Return the sentence that temperatures are no weather in their unit; "" if they may be.

        All are, but for a share of either end.
        """
        there = ~self._far & np.isfinite(self.celsius)
        if not there.any():
            return ""
        low, high = np.quantile(self.celsius[there], (1 - share, share), method="nearest")
        if low >= COLDEST and high <= hottest:
            return ""
        known = self.values[there]
        return (
            f"{known.min():.6g} to {known.max():.6g} is no weather in {_UNITS[self.unit]}: another"
            " unit (C, K or F), or scale = 0.1 for tenths (0.001 for thousandths), may read it"
        )

    # --- what was read ---------------------------------------------------------------------------

    @property
    def ends(self) -> list[str]:
        """The first and the last time."""
        return [str(self.times[k]).removesuffix(".000000") for k in (0, -1)]

    def told(self) -> str:
        """Return what was read, in one line."""
        known = self.temperatures
        many = f"{len(self.times)} reading{'s' * (len(self.times) > 1)}"
        many += f" ({self.missing} missing or suspect)" if self.missing else ""
        first, last = (end[: 10 if self.dated else None] for end in self.ends)
        degrees = SHORT_UNITS[self.unit]
        said = f"read {' and '.join(self.names)}, {degrees}, {many}, {first} to {last}"
        if known.size:
            said += f", {known.min():.6g} to {known.max():.6g} {degrees}"
        for count, what in ((self.below, "line{} below the table"),
                            (self.empty, "row{} at the ends without a temperature")):  # fmt: skip
            said += f"; {count} {what.format('s' * (count > 1))} left out" if count else ""
        return said

    def lacking(self) -> list[str]:
        """Return which changes of temperature the record does not hold: of the day, of the year."""
        if not self.dated or len(self.times) < 2:
            return []
        said, days = list[str](), float(self.seconds[-1]) / DAY
        usual = float(np.median(self._steps[1:])) / DAY
        if usual > 0.8:
            often = "one reading a day" if usual < 2 else f"one reading in {usual:.4g} days"
            said.append(f"{often}: day and night are missing, and most of the creep with them (a"
                        " tenth of it may remain); use hourly temperatures, or the minimum and the"
                        " maximum of each day")  # fmt: skip
        if days < _YEAR:
            said.append(f"the record covers {days:.3g} days: seasons are missing, and a rate per"
                        " year holds for such days alone")  # fmt: skip
        return said


def _ends(entries: Sequence[Sequence[str]]) -> tuple[int, int]:
    """Return the rows from the first to the last with a temperature, if nearly all are between."""
    rows = len(entries[0])
    known = [k for k, row in enumerate(zip(*entries, strict=True)) if any(row)]
    few = known and rows - (known[-1] + 1 - known[0]) <= rows // _FEW_EMPTY
    return (known[0], known[-1] + 1) if few else (0, rows)


def _distance(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the distance to the median of five readings around, where equal ones count once."""
    places = np.flatnonzero(np.isfinite(values))
    known = values[places]
    if len(known) < 10:
        return np.zeros(len(values))
    begins = np.append(True, np.diff(known) != 0)
    once = known[begins]
    around = np.lib.stride_tricks.sliding_window_view(np.pad(once, 2, mode="reflect"), 5)
    out = np.full(len(values), np.nan)
    out[places] = np.abs(once - np.median(around, axis=1))[np.cumsum(begins) - 1]
    return out


def _temperature(entry: Any, decimal: str, scale: Fraction) -> Fraction | None:
    """Return the temperature of a text or a number; None if it has none."""
    if isinstance(entry, str) and decimal == ",":
        entry = entry.replace(".", " ").replace(",", ".")  # no dots between thousands
    if isinstance(entry, (float, np.floating)):
        entry = str(entry)  # the shortest decimal, as it was read or rounded
    try:
        return exact_number(entry, "temperature") * scale
    except InputError:
        return None
