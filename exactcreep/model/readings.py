"""The readings of a temperature record: what is wrong with them, and how it is mended."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import timedelta
from fractions import Fraction
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.numbers import InputError, exact_number, nearest_float

if TYPE_CHECKING:
    from pandas import DataFrame, Series

LIKE_KELVIN = (180, 400)
"""Weather and roofs lie between these in kelvin, and below the first in degrees Celsius."""
ABSOLUTE_ZERO = {"C": Fraction(-27315, 100), "K": Fraction(0)}
COLDEST, HOTTEST = -90, 60
"""No weather was colder in degrees Celsius, and no day's maximum above the second."""
ROOFS = 120
"""No roof is hotter in degrees Celsius."""
GAP = 1.5
"""A step longer than so many usual ones is a gap."""
FAR, OFTEN_FAR = 15, 5
"""A reading is far from its neighbours if it is off their median by 15 K, and by 5 times as much as
nine readings in ten."""
_FEWEST = 10  # readings from which on there is a usual step, and a usual distance
_MOST_SAID = 20  # readings
_FEWEST_SWAPPED = 100  # one day of so many may have its minimum above its maximum
_FIRST_YEAR, _LAST_YEAR = 1700, 2200  # nanoseconds count no more
_ZONE = r"[T ].*(?:Z|[+-]\d\d(?::?\d\d)?)$"


class RecordWarning(UserWarning):
    """A temperature record that probably does not mean what it says.

    Examples
    --------
    >>> import warnings
    >>> from exactcreep import TemperatureRecord
    >>> with warnings.catch_warnings(record=True, action="always") as caught:
    ...     kelvin = TemperatureRecord.of([283, 304, 285], kappa="29e-6", T0=283, times=[0, 1, 2])
    >>> caught[0].category.__name__
    'RecordWarning'
    """


@dataclass(frozen=True, eq=False)
class Readings:
    """Every reading of a table in the order of its rows, whatever is wrong with it.

    `times` are dates (in UTC where they name a zone) or floats, `said` the texts of them, `names`
    the columns of a row in turn, `entries` what stands there, `exact` the temperatures that this
    means, None where it means none.
    """

    shown: str
    unit: str
    decimal: str
    times: NDArray[Any]
    said: Sequence[str]
    names: Sequence[str]
    maximum: int | None
    entries: Sequence[Any]
    exact: Sequence[Fraction | None]

    @classmethod
    def of(
        cls, table: DataFrame, hours: Sequence[Fraction], *, shown: str, unit: str, scale: Fraction,
        decimal: str, date_format: str,
    ) -> Readings:  # fmt: skip
        """Return the readings of a table: its first column has the times, others temperatures.

        `hours` are those of the columns after a date, if there are two: minimum and maximum.
        """
        written, names = table.iloc[:, 0], [str(name) for name in table.columns[1:]]
        moments, maximum = _moments(written, date_format), None
        if len(names) == 2:
            if moments.dtype.kind != "M":
                allowed = "must be a date, where a row has the minimum and the maximum of a day"
                raise InputError(str(written.name), str(written.iloc[0]), allowed)
            order = sorted((0, 1), key=lambda k: hours[k])
            maximum, names = order.index(1), [names[k] for k in order]
            after = [timedelta(hours=float(hours[k])) for k in order]
            moments = (moments[:, None] + np.array(after, "timedelta64[us]")).ravel()
        entries = table[names].to_numpy(dtype=object).ravel().tolist()
        exact = {entry: _temperature(entry, decimal, scale) for entry in set(entries)}
        said = [str(text) for text in written for _ in names]
        found = [exact[entry] for entry in entries]
        return cls(shown, unit, decimal, moments, said, names, maximum, entries, found)

    @property
    def dated(self) -> bool:
        return self.times.dtype.kind == "M"

    @property
    def seconds(self) -> NDArray[np.float64]:
        """Times since the first of dates in seconds; numbers as they are written."""
        if not self.dated:
            return self.times
        return np.asarray((self.times - self.times[0]) / np.timedelta64(1, "s"))

    @property
    def known(self) -> Sequence[Fraction]:
        """The temperatures, where all are known."""
        return [value for value in self.exact if value is not None]

    @property
    def _zero(self) -> float:
        """0 degrees Celsius in the unit."""
        return 273.15 if self.unit == "K" else 0.0

    @property
    def celsius(self) -> NDArray[np.float64]:
        """Temperatures in degrees Celsius, nan where there are none."""
        known = {value: nearest_float(value) for value in {*self.exact} if value is not None}
        values = [np.nan if value is None else known[value] for value in self.exact]
        return np.array(values) - self._zero

    @property
    def temperatures(self) -> NDArray[np.float64]:
        """The temperatures in the unit that are known, and not far from their neighbours."""
        values = self.celsius + self._zero
        values[self.faults().get("far", np.array([], np.intp))] = np.nan
        return np.asarray(values[np.isfinite(values)])

    # --- what is wrong ---------------------------------------------------------------------------

    def faults(self) -> dict[str, NDArray[np.intp]]:
        """Return which readings are wrong, by the kind of fault, in the order in which they count.

        ``missing``; ``late`` (not after the one before); ``gap`` (after one); ``far`` from its
        neighbours, or no temperature of weather; ``swapped`` (a day's second, on too many days).
        """
        steps, values = np.diff(self.seconds), self.celsius
        longest = np.inf
        if len(values) >= _FEWEST:
            longest = GAP * float(np.quantile(steps, 0.9, method="lower"))
        found = {
            "missing": np.isnan(values),
            "late": np.append(False, steps <= 0),
            "gap": np.append(False, steps > max(longest, 0.0)),
            "far": self._far(values),
            "swapped": self._swapped(values),
        }
        if found["swapped"].sum() * _FEWEST_SWAPPED <= len(values) // 2:
            del found["swapped"]
        return {kind: np.flatnonzero(wrong) for kind, wrong in found.items() if wrong.any()}

    def _far(self, values: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which readings differ much from the two before and the two after, if others do."""
        pandas, far = import_module("pandas"), np.zeros(len(values), bool)
        known = values[~np.isnan(values)]
        if not known.size:
            return far
        for k in range(len(self.names)):
            column = pandas.Series(values[k :: len(self.names)]).dropna()
            if len(column) >= _FEWEST:
                off = (column - column.rolling(5, center=True, min_periods=1).median()).abs()
                limit = max(FAR, OFTEN_FAR * off.quantile(0.9, "lower"))
                far[off.index[off > limit] * len(self.names) + k] = True
        mark = (values < COLDEST) | (values > ROOFS)
        if mark.sum() <= max(1, len(values) // 50) and COLDEST < np.median(known) < ROOFS:
            far |= mark
        return far | (values < float(ABSOLUTE_ZERO["C"]) - 1e-9)

    def _swapped(self, values: NDArray[np.float64]) -> NDArray[np.bool_]:
        wrong = np.zeros(len(values), bool)
        if self.maximum is not None:
            first, second = values[::2], values[1::2]
            wrong[1::2] = first > second if self.maximum else first < second
        return wrong

    def refusal(self, kind: str, places: NDArray[np.intp]) -> InputError:
        """Return the sentence that refuses the first reading of a fault."""
        k = int(places[0])
        name, entry, at = self.names[k % len(self.names)], self.entries[k], self.at(k)
        time, more = self.said[k], len(places) - 1
        many = f", and {more} more" if more else ""
        if kind == "missing":
            what = "is missing" if entry is None or entry != entry or not str(entry).strip() else (
                f"must be a number with decimal = {self.decimal!r}")  # fmt: skip
            said = f"{what} {at}{many}"
        elif kind == "late":
            name, entry, said = "time", time, f"must be later than {self.said[k - 1]} before it"
        elif kind == "gap":
            unit, size = (" days", 86400) if self.dated else ("", 1)
            steps = np.diff(self.seconds) / size
            usual = float(np.quantile(steps, 0.9, method="lower"))
            lengths = (
                f"{steps[k - 1]:.4g}{unit} after {self.at(k - 1)[3:]}, where {usual:.4g} is usual"
            )
            name, entry = "time", time
            said = f"is {lengths}, a gap{f' ({more} more)' if more else ''}"
        elif kind == "swapped":
            first = f"on {len(places)} of {len(self.entries) // 2} days, first on {time}"
            low = self.names[1 - (self.maximum or 0)]
            high = self.names[self.maximum or 0]
            said = f"is above {high} {first}: the columns may be swapped"
            return InputError("minimum_column", low, f"{said} (in {self.shown})")
        else:
            near = [str(self.entries[j]) for j in (k - len(self.names), k + len(self.names))
                    if 0 <= j < len(self.entries)]  # fmt: skip
            said = (
                f"is no temperature of weather, {at}"
                if not near
                else f"is far from its neighbours, {' and '.join(near)}, {at}{many}"
            )
        mend = f"exactcreep record {self.shown} --mend OUT.csv mends a copy"
        if not self.shown:  # arrays
            mend = "pandas mends it (sort_index, dropna, resample, interpolate)"
        return InputError(name, entry, f"{said}; {mend}")

    def at(self, k: int) -> str:
        """Return the time of a reading for the eye: on 10 April 2024."""
        if not self.dated:
            return f"at {self.said[k]}"
        date = self.times[k].astype("datetime64[us]").item()
        return f"on {date.day} {date:%B} {date.year}"

    def doubts(self) -> Iterator[str]:
        """Yield why the temperatures look like those of another unit, or the columns swapped."""
        values, zero = self.celsius, self._zero
        days, file = self.maximum is not None, self.shown or "(arrays)"
        if days and (wrong := np.flatnonzero(self._swapped(values))).size:
            first = f"on {wrong.size} of {values.size // 2} days, first on {self.said[wrong[0]]}"
            yield f"in {file} the minimum is above the maximum {first}"
        least, most = np.nanquantile(values, (0.01, 0.99), method="nearest") + zero
        coldest = most - zero
        if days:
            coldest = float(np.nanquantile(values[self.maximum :: 2], 0.01, method="nearest"))
        low, high = LIKE_KELVIN
        names = {"C": "degrees Celsius", "K": "kelvin"}
        if (low < least and most < high) if self.unit == "C" else most < low:
            said = f'said to be in {names.pop(self.unit)} (unit = "{self.unit}")'
            told = f"the temperatures of {file}, from {least:g} to {most:g}, are {said}"
            yield f"{told} and look like {names.popitem()[1]}"
        elif most - zero > HOTTEST:
            of_days = "maxima of days" if days else "temperatures"
            told = f"{file} holds {of_days} of up to {most:g} {self.unit}: they look like degrees"
            yield f"{told} Fahrenheit ((F - 32) * 5/9 are Celsius), or like tenths (scale = 0.1)"
        elif least - zero < COLDEST or coldest < -HOTTEST:
            told = f"{file} holds {least:g} {self.unit}, colder than any weather: tenths"
            yield f"{told} (scale = 0.1)?"

    # --- and how it is mended --------------------------------------------------------------------

    def mended(self) -> tuple[DataFrame, list[str]]:
        """Return the readings in rows without faults, and what was done to them.

        Gaps are filled between the readings of the same hour on the days around them.

        Raises
        ------
        InputError
            If there are more rows to fill in than rows.
        """
        pandas, faults, width = import_module("pandas"), self.faults(), len(self.names)
        values, said = self.celsius + self._zero, list[str]()
        for kind, what in (("missing", "no temperature"), ("far", "far from its neighbours")):
            places = faults.get(kind, np.array([], np.intp))
            values[places] = np.nan
            for k in places[:_MOST_SAID].tolist():
                entry = f"{self.names[k % width]} = {self.entries[k]}"
                said.append(f"{self.said[k]}: {entry}, {what}: interpolated")
            if (more := len(places) - _MOST_SAID) > 0:
                said.append(f"{more} more readings, {what}: interpolated")
        table = pandas.DataFrame(values.reshape(-1, width), self.times[::width])
        table.columns = ["minimum", "maximum"][:: 1 if self.maximum else -1] if width == 2 else [
            "temperature"]  # fmt: skip
        if not table.index.is_monotonic_increasing:
            table = table.sort_index(kind="stable")
            said.append("the rows were sorted by time")
        if twice := int(table.index.duplicated().sum()):
            table = table.groupby(level=0).mean()
            said.append(f"{twice} rows with the time of another row: the mean of both was taken")
        for begin, new in self._filling(table.index):
            said.append(f"{len(new)} rows after {begin} were missing: interpolated")
            table = table.reindex(table.index.append(pandas.Index(new)).sort_values())
        if self.dated:  # every hour of the day by itself: a line through a gap has no days
            of_hour = table.groupby(table.index - table.index.normalize(), group_keys=False)
            table = of_hour.transform(lambda column: column.interpolate(limit_direction="both"))
        method = "time" if self.dated else "index"
        table = table.interpolate(method, limit_direction="both")
        digits = next(
            (
                k
                for k in range(1, 6)
                if all(value is None or (value * 10**k).denominator == 1 for value in {*self.exact})
            ),
            6,
        )
        return table.round(digits), said

    def _filling(self, index: Any) -> Iterator[tuple[Any, NDArray[Any]]]:
        """Yield the last time before each gap, and the times that are missing in it."""
        pandas, times = import_module("pandas"), index.to_numpy()
        steps = np.diff(times)
        if len(times) < _FEWEST:
            return
        usual = np.sort(steps)[int(0.9 * (len(steps) - 1))]
        if sum(np.round(steps[steps > GAP * usual] / usual)) > len(times):
            raise InputError("file", self.shown, "lacks more rows than it has: take a part of it")
        hours: Any = pandas.Series(index - index.normalize()).value_counts() if self.dated else []
        daily = usual <= np.timedelta64(1, "D") if self.dated else False
        for k in np.flatnonzero(steps > GAP * usual).tolist():
            new = times[k] + np.arange(1, round(float(steps[k] / usual))) * usual
            if daily:  # at the hours at which most days have a reading
                days = pandas.date_range(index[k].normalize(), index[k + 1].normalize())
                often = hours.index[2 * hours > hours.max()].to_numpy()
                new = np.sort((days.to_numpy()[:, None] + often).ravel())
                new = new[(new > times[k] + usual / 2) & (new < times[k + 1] - usual / 2)]
            yield self._text(times[k]), new

    def _text(self, time: Any) -> str:
        return str(time.astype("datetime64[m]")) if self.dated else str(time)


def _temperature(entry: Any, decimal: str, scale: Fraction) -> Fraction | None:
    """Return the temperature that a text or a number means; None if it means none."""
    if isinstance(entry, str) and decimal == ",":
        entry = entry.replace(".", " ").replace(",", ".")  # no dots between thousands
    try:
        return exact_number(entry, "temperature") * scale
    except InputError:
        return None


def _moments(entries: Series, date_format: str) -> NDArray[Any]:
    """Return times as floats, or as dates, in UTC where they name a time zone."""
    name, texts = str(entries.name), entries.astype(str).str.strip()

    def refuse(wrong: Any, allowed: str) -> None:
        if np.any(wrong):
            k = int(np.argmax(wrong))
            raise InputError(name, texts.iloc[k], f"{allowed} (row {k + 1})")

    refuse(entries.isna(), "is missing; leave such rows out")
    if not date_format and _temperature(entries.iloc[0], ".", Fraction(1)) is not None:
        numbers = np.array([nearest_float(exact_number(entry, name)) for entry in entries])
        refuse(np.isinf(numbers), "must be below the largest float, 1.8e308")
        return numbers
    zoned = texts.str.contains(_ZONE)
    refuse(not date_format and zoned != zoned.iloc[0], "must name a time zone as others do, or not")
    to_datetime, written = import_module("pandas").to_datetime, date_format or "ISO8601"
    dates = to_datetime(texts, format=written, utc=True, errors="coerce").dt.tz_localize(None)
    like = f"as date_format = {date_format!r} says" if date_format else "such as 2024-01-31T13:00"
    mend = "" if date_format else ", or date_format must say how it is written"
    allowed = f"must be a number, or a date of the years {_FIRST_YEAR} to {_LAST_YEAR} {like}{mend}"
    refuse(~dates.dt.year.between(_FIRST_YEAR, _LAST_YEAR), allowed)
    return np.asarray(dates.to_numpy("datetime64[us]"))
