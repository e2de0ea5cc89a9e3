"""The readings of a temperature record: find their faults, and mend them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import timedelta
from fractions import Fraction
from functools import cached_property
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.numbers import InputError, exact_number, nearest_float, number_of_floats

if TYPE_CHECKING:
    from pandas import DataFrame, Series

LIKE_KELVIN = (180, 400)
"""Weather and roofs are between these in kelvin, and below the first in degrees Celsius."""
ABSOLUTE_ZERO = {"C": Fraction(-27315, 100), "K": Fraction(0)}
COLDEST, HOTTEST, ROOFS = -90, 60, 120
"""Limits of weather, and of the temperature of roofs, in degrees Celsius."""
GAP = 1.5
"""A step longer than this many usual steps is a gap."""
FAR, OFTEN_FAR = 15, 5
"""A reading is far from its neighbours if it differs from their median by 15 K, and by 5 times the
distance that nine readings in ten do not exceed."""
_FEWEST = 10  # readings for a usual step and a usual distance
_MOST_SAID = 20  # readings that are listed
_FEWEST_SWAPPED = 100  # one day in so many may have its minimum above its maximum
_FIRST_YEAR, _LAST_YEAR = 1700, 2200  # the range of dates counted in nanoseconds
_ZONE = r"[T ].*(?:Z|[+-]\d\d(?::?\d\d)?)$"
_UNITS = {"C": "degrees Celsius", "K": "kelvin"}
_NONE = np.array([], np.intp)
_DAY = 86400  # seconds


class RecordWarning(UserWarning):
    """A temperature record is probably not meant as written.

    Examples
    --------
    >>> import warnings
    >>> with warnings.catch_warnings(record=True, action="always") as caught:
    ...     kelvin = TemperatureRecord.of([283, 304, 285], kappa="29e-6", T0=283, times=[0, 1, 2])
    >>> print(caught[0].message)  # doctest: +ELLIPSIS
    the temperatures of (arrays), from 283 to 304, are said to be in degrees Celsius...
    """


@dataclass(frozen=True, eq=False)
class Readings:
    """Every reading of a table, in the order of its rows, including faulty ones.

    `file`, `unit`, `decimal`: as in the record; `file` is "" for arrays; `names`, `maximum`: the
    columns of temperatures by hour of the day, and which of them is the maximum; `times`: dates (in
    UTC if a time zone is given) or floats; `written`: times as written; `entries`, `exact`: the
    text in the table, and the temperature that it means, or None.
    """

    file: str
    unit: str
    decimal: str
    names: Sequence[str]
    maximum: int | None
    times: NDArray[Any]
    written: Sequence[str]
    entries: Sequence[Any]
    exact: Sequence[Fraction | None]

    @classmethod
    def of(
        cls, table: DataFrame, hours: Sequence[Fraction], *, file: str, unit: str, scale: Fraction,
        decimal: str, date_format: str,
    ) -> Readings:  # fmt: skip
        """Return the readings of a table: times, and temperatures at `hours` after them."""
        rows, names, maximum = table.iloc[:, 0], [str(name) for name in table.columns[1:]], None
        times = _times_of(rows, date_format)
        if len(names) == 2:
            if times.dtype.kind != "M":
                allowed = "must be a date, where a row has the minimum and the maximum of a day"
                raise InputError(str(rows.name), str(rows.iloc[0]), allowed)
            order = sorted((0, 1), key=lambda k: hours[k])
            maximum, names = order.index(1), [names[k] for k in order]
            after = [timedelta(hours=float(hours[k])) for k in order]
            times = (times[:, None] + np.array(after, "timedelta64[us]")).ravel()
        entries = table[names].to_numpy(dtype=object).ravel().tolist()
        exact = {entry: _temperature(entry, decimal, scale) for entry in set(entries)}
        written = [str(text) for text in rows for _ in names]
        found = [exact[entry] for entry in entries]
        return cls(file, unit, decimal, names, maximum, times, written, entries, found)

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
        return self.values - (273.15 if self.unit == "K" else 0.0)

    @property
    def temperatures(self) -> NDArray[np.float64]:
        """The known temperatures in the unit, without those far from their neighbours."""
        values = np.delete(self.values, self.faults().get("far", _NONE))
        return np.asarray(values[np.isfinite(values)])

    # --- faults ----------------------------------------------------------------------------------

    @cached_property
    def _steps(self) -> NDArray[np.float64]:
        """The time since the previous reading; nan for the first."""
        return np.diff(self.seconds, prepend=np.nan)

    @property
    def _usual(self) -> float:
        """The usual step: nine in ten are not longer; inf if there are few readings."""
        few = len(self.times) < _FEWEST
        return np.inf if few else float(np.nanquantile(self._steps, 0.9, method="lower"))

    def faults(self) -> dict[str, NDArray[np.intp]]:
        """Return the faulty readings by kind of fault, most important first.

        ``missing``; ``late``: not after the previous reading; ``gap``: after a gap; ``far``: far
        from its neighbours, or impossible weather; ``swapped``: a day's second reading, on too many
        days.
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
        """Readings that differ much from the two before and the two after, if most do not."""
        values, pandas = self.celsius, import_module("pandas")
        table = pandas.DataFrame(values.reshape(-1, len(self.names)))
        off = table.apply(_distance).reindex(table.index)
        limit = np.maximum(FAR, OFTEN_FAR * off.quantile(0.9, interpolation="lower"))
        far = (off > limit).to_numpy(copy=True).ravel()
        extreme = (values < COLDEST) | (values > ROOFS)
        usual = COLDEST < pandas.Series(values).median() < ROOFS
        if usual and extreme.sum() <= max(1, len(values) // 50):
            far |= extreme
        return np.asarray(far | (values < float(ABSOLUTE_ZERO["C"]) - 1e-9))

    @property
    def _swapped(self) -> NDArray[np.bool_]:
        wrong = np.zeros(len(self.times), bool)
        if self.maximum is not None:
            wrong[1::2] = self.celsius[1 - self.maximum :: 2] > self.celsius[self.maximum :: 2]
        return wrong

    def refusal(self, kind: str, places: NDArray[np.intp]) -> InputError:
        """Return the error that refuses the first reading with a fault."""
        k, width = int(places[0]), len(self.names)
        name, entry, at = self.names[k % width], self.entries[k], self._at(k)
        many = f", and {len(places) - 1} more" if len(places) > 1 else ""
        if kind == "swapped":
            low, high = self.names[1 - (self.maximum or 0)], self.names[self.maximum or 0]
            said = f"is above {high} {self._days(places)}: the columns may be swapped"
            return InputError("minimum_column", low, f"{said} (in {self.file})")
        if kind in ("late", "gap"):
            name, entry = "time", self.written[k]
        if kind == "late":
            said = f"must be later than {self.written[k - 1]} before it{many}"
        elif kind == "gap":
            unit, size = (" hours", 3600) if self._usual < _DAY else (" days", _DAY)
            unit, size = (unit, size) if self.dated else ("", 1)
            step, usual = self._steps[k] / size, self._usual / size
            after = self._at(k - 1).partition(" ")[2]
            said = f"is {step:.4g}{unit} after {after}, where {usual:.4g} is usual, a gap{many}"
        elif kind == "missing":
            said = f"is missing, or no number with decimal = {self.decimal!r}, {at}{many}"
        else:
            beside = [*self.entries[k - width : k : width], *self.entries[k + width :: width][:1]]
            near = "its neighbours, " + " and ".join(map(str, beside)) if beside else "any weather"
            said = f"is far from {near}, {at}{many}"
        mend = "pandas mends it (sort_index, dropna, resample, interpolate)"
        if self.file and self.dated:
            mend = f"exactcreep record {self.file} --mend OUT.csv mends a copy"
        return InputError(name, entry, f"{said}; {mend}")

    def _days(self, places: NDArray[np.intp]) -> str:
        days, first = len(self.times) // 2, self.written[places[0]]
        return f"on {len(places)} of {days} days, first on {first}"

    def _at(self, k: int) -> str:
        """Return the time of a reading in words: on 10 April 2024."""
        if not self.dated:
            return f"at {self.written[k]}"
        date = self.times[k].astype("datetime64[us]").item()
        return f"on {date.day} {date:%B} {date.year}"

    def doubts(self) -> Iterator[str]:
        """Yield reasons to doubt the unit of temperatures, or the order of the columns."""
        file, celsius = self.file or "(arrays)", self.unit == "C"
        if (places := np.flatnonzero(self._swapped)).size:
            yield f"in {file} the minimum is above the maximum {self._days(places)}"
        (least, most), (low, high) = (
            np.nanquantile(known, (0.01, 0.99), method="nearest")
            for known in (self.celsius, self.values)
        )
        if (LIKE_KELVIN[0] < low and high < LIKE_KELVIN[1]) if celsius else high < LIKE_KELVIN[0]:
            yield (
                f"the temperatures of {file}, from {low:g} to {high:g}, are said to be in"
                f' {_UNITS[self.unit]} (unit = "{self.unit}") and look like {_UNITS["CK"[celsius]]}'
            )
        elif most > HOTTEST:
            yield (
                f"{file} holds temperatures of up to {high:g} {self.unit}: they look like degrees"
                " Fahrenheit ((F - 32) * 5/9 are Celsius), or like tenths (scale = 0.1)"
            )
        elif least < COLDEST:
            told = f"{file} holds {low:g} {self.unit}, colder than any weather"
            yield f"{told}: tenths (scale = 0.1)?"

    # --- mending ---------------------------------------------------------------------------------

    def mended(self) -> tuple[DataFrame, list[str]]:
        """Return the readings in rows without faults, and a list of the changes.

        Gaps are filled between the readings of the same hour on nearby days. Raises `InputError` if
        times are not dates, or there are more rows to fill in than rows.
        """
        pandas, faults, width = import_module("pandas"), self.faults(), len(self.names)
        if not self.dated:
            raise InputError("file", self.file, "must have dates: gaps are filled by the hour")
        values, done = self.values.copy(), list[str]()
        for kind, what in (("missing", "no temperature"), ("far", "far from its neighbours")):
            places = faults.get(kind, _NONE)
            values[places] = np.nan
            for k in places[:_MOST_SAID].tolist():
                entry = f"{self.names[k % width]} = {self.entries[k]}"
                done.append(f"{self.written[k]}: {entry}, {what}: interpolated")
            if (more := len(places) - _MOST_SAID) > 0:
                done.append(f"{more} more readings, {what}: interpolated")
        days = ["minimum", "maximum"] if self.maximum else ["maximum", "minimum"]
        columns = days if width == 2 else ["temperature"]
        table = pandas.DataFrame(values.reshape(-1, width), self.times[::width], columns)
        if not table.index.is_monotonic_increasing:
            table = table.sort_index(kind="stable")
            done.append("the rows were sorted by time")
        if twice := int(table.index.duplicated().sum()):
            table = table.groupby(level=0).mean()
            done.append(f"{twice} rows with the time of another row: the mean of both was taken")
        lacking, said = self._lacking(table.index)
        table = table.reindex(table.index.union(lacking))
        # each hour of the day separately, because a line through a gap would have no days
        of_hour = table.groupby(table.index - table.index.normalize(), group_keys=False)
        table = of_hour.transform(lambda column: column.interpolate(limit_direction="both"))
        return table.interpolate("time", limit_direction="both").round(6), done + said

    def _lacking(self, index: Any) -> tuple[NDArray[Any], list[str]]:
        """Return the times missing in gaps, at the hours at which most days have a reading."""
        pandas, times = import_module("pandas"), index.to_numpy()
        steps = pandas.Series(np.diff(times))
        gaps = steps > GAP * (usual := steps.quantile(0.9, "lower"))
        if len(times) < _FEWEST or not gaps.any():
            return times[:0], []
        if steps[gaps].sum() > len(times) * usual:
            raise InputError("file", self.file, "lacks more rows than it has: take a part of it")
        hours = pandas.Series(index - index.normalize()).value_counts()
        days = pandas.date_range(index[0].normalize(), index[-1].normalize()).to_numpy()
        grid = np.sort((days[:, None] + hours.index[2 * hours > hours.max()].to_numpy()).ravel())
        grid = grid[(grid > times[0]) & (grid < times[-1])]
        at = np.searchsorted(times, grid)  # the reading after each
        near = np.minimum(times[at] - grid, grid - times[at - 1]) <= usual / 2
        lacking, after = grid[gaps[at - 1] & ~near], times[at - 1][gaps[at - 1] & ~near]
        begins, counts = np.unique(after.astype("datetime64[m]"), return_counts=True)
        return lacking, [
            f"{count} rows after {begin} were missing: interpolated"
            for begin, count in zip(begins, counts, strict=True)
        ]


def _distance(column: Series) -> Series:
    known = column.dropna()
    off = (known - known.rolling(5, center=True, min_periods=1).median()).abs()
    return off if len(known) >= _FEWEST else off.iloc[:0]


def _temperature(entry: Any, decimal: str, scale: Fraction) -> Fraction | None:
    """Return the temperature of a text or a number; None if it has none."""
    if isinstance(entry, str) and decimal == ",":
        entry = entry.replace(".", " ").replace(",", ".")  # no dots between thousands
    try:
        return exact_number(entry, "temperature") * scale
    except InputError:
        return None


def _times_of(entries: Series, date_format: str) -> NDArray[Any]:
    """Return times as floats, or as dates, in UTC if they have a time zone."""
    name, texts = str(entries.name), entries.astype(str).str.strip()

    def refuse(wrong: Any, allowed: str) -> None:
        if np.any(wrong):
            k = int(np.argmax(wrong))
            raise InputError(name, texts.iloc[k], f"{allowed} (row {k + 1})")

    refuse(entries.isna(), "is missing; leave such rows out")
    if not date_format and _temperature(entries.iloc[0], ".", Fraction(1)) is not None:
        return np.array([nearest_float(number_of_floats(entry, name)) for entry in entries])
    zoned = texts.str.contains(_ZONE)
    refuse(not date_format and zoned != zoned.iloc[0], "must name a time zone as others do, or not")
    dates = import_module("pandas").to_datetime(
        texts, format=date_format or "ISO8601", utc=True, errors="coerce"
    ).dt.tz_localize(None)  # fmt: skip
    like = "such as 2024-01-31T13:00, or date_format must say how it is written"
    if date_format:
        like = f"as date_format = {date_format!r} says"
    allowed = f"must be a number, or a date of the years {_FIRST_YEAR} to {_LAST_YEAR} {like}"
    refuse(~dates.dt.year.between(_FIRST_YEAR, _LAST_YEAR), allowed)
    return np.asarray(dates.to_numpy("datetime64[us]"))
