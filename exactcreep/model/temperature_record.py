"""Temperature records: times and temperatures, of a CSV file or of arrays, turned into a drive."""

from __future__ import annotations

import hashlib
import io
import itertools
import os
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from fractions import Fraction
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from exactcreep.model.drive import Listed
from exactcreep.model.inputs import keep
from exactcreep.model.numbers import (
    InputError,
    Number,
    exact_number,
    nearest_float,
    number_from_zero,
    positive_number,
)
from exactcreep.model.user_files import content_of, unpacked

if TYPE_CHECKING:
    from pandas import DataFrame, Series

MOST_BYTES = 64 * 2**20
"""Size of a file of records; more is another kind of file."""
MOST_ROWS = 1_000_000
"""A century of hours."""
LIKE_KELVIN = (180, 400)
"""Weather and roofs lie between these in kelvin, and below the first in degrees Celsius."""
COLDEST = -90
"""No weather was colder in degrees Celsius; -99.9 marks what is missing in many a file."""
ABSOLUTE_ZERO = {"C": Fraction(-27315, 100), "K": Fraction(0)}
HOTTEST = 60
"""No day's maximum was above this, or below its negative, in degrees Celsius."""
GAP = 1.5
"""A step longer than so many usual ones is a gap."""
_FEWEST_SWAPPED = 100  # one day of so many may have its minimum above its maximum
_FEWEST_REGULAR = 10  # readings from which on there is a usual step
_FIRST_YEAR, _LAST_YEAR = 1700, 2200  # nanoseconds count no more
_CHOICES = {"unit": ("C", "K"), "decimal": (".", ",")}
_SINGLE = ("time_column", "temperature_column")
_DAILY = ("time_column", "minimum_column", "maximum_column")
_TEXTS = {*_SINGLE, *_DAILY, *_CHOICES, "delimiter", "date_format", "encoding"}
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


@dataclass(frozen=True, repr=False)
class TemperatureRecord(Listed):
    """The dilations ``theta_q = kappa (T_q - T0)`` of a recorded series of temperatures.

    Between two rows theta ramps monotonically; rows in the middle of a monotone stretch change
    nothing. A velocity is a displacement per unit of `times` (per second for dates); the chain is
    taken from T0 to the first row at the time of that row. What a record lacks, or has twice, is
    refused with the name of the first row that is concerned, and mended with pandas; see `of`.

    Warns with `RecordWarning` if temperatures look like those of the other unit, like degrees
    Fahrenheit or tenths of a degree, or one must mark a missing reading; and if the minimum of a
    day is above its maximum, which is refused on more than one day in a hundred.

    Parameters
    ----------
    file : str or path
        A CSV file of at most 64 MiB and a million rows, also packed by gzip (.gz). Its first row
        names the columns. See `of` for arrays and pandas.
    kappa : number
        Thermal expansion coefficient, unit 1/K; positive.
    T0 : number
        Temperature at which the chain is prepared (theta = 0), in `unit`.
    time_column, temperature_column : str
        Names of the columns. Times increase from row to row: numbers, or dates, all of one kind.
    minimum_column, maximum_column : str
        Instead of `temperature_column`: a day's minimum and maximum, the commonest old record.
    minimum_hour, maximum_hour : number
        When they are read, in hours after the date of the row.
    scale : number
        What the numbers are multiplied by: 0.1 for tenths of a degree.
    unit : {"C", "K"}
        Of the temperatures and of `T0`.
    delimiter, decimal : str
        One character between columns, and ``.`` or ``,`` before the decimals.
    date_format : str
        How dates are written, ``%d.%m.%Y %H:%M``; default ISO 8601, ``2024-01-31T13:00``.
    encoding : str
        Of the file, ``latin-1``; default UTF-8.
    theta, times, sha256, origin : optional
        Only together, as `parameters` returned them: the file, which may be gone, is not read.

    Raises
    ------
    InputError
        If an option is not what it must be, a row has no temperature, times do not
        increase, or there is a gap: a step longer than 1.5 usual ones (at least one step in
        ten is as long as the usual one, so that uneven hours are no gaps).

    Attributes
    ----------
    theta : tuple of Fraction
        One dilation per reading, exact: decimal texts are kept as the rationals that they denote.
    times : tuple of float
        Of each row: in seconds since `origin` for dates, as written otherwise.
    origin : str
        Date of the first row in ISO 8601, "" if times are numbers.
    sha256 : str
        Digest of the file, or of the arrays.

    Examples
    --------
    >>> days = ["2024-06-01T04:00", "2024-06-01T16:00", "2024-06-02T04:00"]
    >>> record = TemperatureRecord.of([10, 31, 12.5], kappa="29e-6", T0=10, times=days)
    >>> record.theta[1], record.temperatures
    (Fraction(609, 1000000), array([10. , 31. , 12.5]))
    """

    file: str
    time_column: str
    temperature_column: str
    minimum_column: str
    maximum_column: str
    minimum_hour: Fraction
    maximum_hour: Fraction
    scale: Fraction
    unit: str
    kappa: Fraction
    T0: Fraction
    delimiter: str
    decimal: str
    date_format: str
    encoding: str
    sha256: str
    origin: str
    theta: tuple[Fraction, ...]
    times: tuple[float, ...]
    kind: ClassVar[str] = "record"
    per: ClassVar[str] = "unit of time"

    def __init__(
        self,
        file: str | os.PathLike[str],
        kappa: Number,
        T0: Number,
        *,
        time_column: str = "time",
        temperature_column: str = "temperature",
        minimum_column: str = "",
        maximum_column: str = "",
        minimum_hour: Number = 5,
        maximum_hour: Number = 15,
        scale: Number = 1,
        unit: str = "C",
        delimiter: str = ",",
        decimal: str = ".",
        date_format: str = "",
        encoding: str = "utf-8",
        theta: Iterable[Number] | None = None,
        times: Iterable[Number] | None = None,
        sha256: str | None = None,
        origin: str | None = None,
    ) -> None:
        texts = {name: value for name, value in vars().items() if name in _TEXTS}
        _check_options(texts)
        if not isinstance(file, (str, os.PathLike)):
            raise InputError("file", file, "must be the path of a CSV file")
        vars(self).update(
            texts,
            file=os.fspath(file),
            kappa=positive_number(kappa, "kappa"),
            T0=exact_number(T0, "T0"),
            minimum_hour=number_from_zero(minimum_hour, "minimum_hour"),
            maximum_hour=number_from_zero(maximum_hour, "maximum_hour"),
            scale=positive_number(scale, "scale"),
        )
        if ABSOLUTE_ZERO[unit] > self.T0:
            raise InputError("T0", T0, "must not be below absolute zero")
        if not self.minimum_column and not self.minimum_hour == 5 == self.maximum_hour - 10:
            raise InputError("maximum_hour", maximum_hour, "belongs to minimum_column")
        if not 24 > self.maximum_hour != self.minimum_hour < 24:
            allowed = "must be another hour of the day than minimum_hour, below 24"
            raise InputError("maximum_hour", maximum_hour, allowed)
        if theta is None or times is None or sha256 is None:
            if not theta is times is sha256 is origin is None:
                raise InputError("theta", theta, "must come with times and sha256, or not at all")
            self._keep(*self._table())
            return
        dilations = tuple(exact_number(value, f"theta[{i}]") for i, value in enumerate(theta))
        moments = [exact_number(value, f"times[{i}]") for i, value in enumerate(times)]
        if not dilations or len(moments) != len(dilations):
            raise InputError("times", len(moments), "must be as many as theta, at least one")
        try:
            datetime.fromisoformat(origin or "2024-01-31")
        except ValueError:
            allowed = "must be a date such as 2024-01-31T13:00"
            raise InputError("origin", origin, allowed) from None
        seconds = tuple(map(nearest_float, moments))
        vars(self).update(theta=dilations, times=seconds, sha256=sha256, origin=origin or "")

    @classmethod
    def of(
        cls,
        temperatures: ArrayLike,
        kappa: Number,
        T0: Number,
        *,
        times: ArrayLike | None = None,
        minimum_hour: Number = 5,
        maximum_hour: Number = 15,
        scale: Number = 1,
        unit: str = "C",
    ) -> TemperatureRecord:
        """Return the record of an array or pandas Series of temperatures.

        What a file has in another form, pandas reads (``pandas.read_csv``, ``read_excel``), sorts
        (``sort_index``), thins (``groupby(level=0).mean()``, ``dropna``) and fills
        (``interpolate``).

        Parameters
        ----------
        temperatures : array of numbers, shape (rows,) or (rows, 2)
            Floats are taken for the binary numbers that they are. Two columns are minimum and
            maximum of a day.
        kappa : number
            Thermal expansion coefficient, unit 1/K; positive.
        T0 : number
            Temperature at which the chain is prepared (theta = 0), in `unit`.
        times : array, shape (rows,), optional
            Numbers, `datetime.datetime`, `numpy.datetime64` or ISO 8601 texts. Default: the index
            of a Series or DataFrame.
        minimum_hour, maximum_hour, scale, unit : optional
            As of a file.

        Returns
        -------
        TemperatureRecord
            A drive with one target for each temperature; dilations are kappa (T - T0), exactly.

        Raises
        ------
        InputError
            As for a file; if shapes do not fit, or there are no times.

        Examples
        --------
        >>> record = TemperatureRecord.of([10, 31, 12.5], kappa="29e-6", T0=10, times=[0, 12, 24])
        >>> record.theta[2]
        Fraction(29, 400000)
        """
        index = getattr(temperatures, "index", None) if times is None else times
        if index is None or callable(index):
            raise InputError("times", None, "must be given, unless temperatures have an index")
        pandas, options = import_module("pandas"), dict[str, str]()
        values, moments = np.asarray(temperatures), np.asarray(index)
        if values.ndim == 2 and values.shape[1] == 2:
            options = {"minimum_column": "minimum", "maximum_column": "maximum"}
        elif values.ndim != 1:
            raise InputError("temperatures", values.shape, "must have one dimension, or (rows, 2)")
        if moments.shape != values.shape[:1]:
            allowed = f"must be as many as temperatures, {len(values)}"
            raise InputError("times", moments.size, allowed)
        record = cls(
            "", kappa, T0, theta=[0], times=[0], sha256="", minimum_hour=minimum_hour,
            maximum_hour=maximum_hour, scale=scale, unit=unit, **options,
        )  # fmt: skip
        columns = [moments, *values.reshape(len(values), -1).T.tolist()]
        table = pandas.DataFrame(dict(zip(record.columns.values(), columns, strict=True)))
        record._keep(table, table.to_csv(index=False).encode())
        return record

    @property
    def columns(self) -> dict[str, str]:
        """Names of the columns that are read, by option: of times, and of temperatures.

        Examples
        --------
        >>> record = TemperatureRecord.of([10, 31, 12.5], kappa="29e-6", T0=10, times=[0, 12, 24])
        >>> record.columns["time_column"]
        'time'
        """
        names = _DAILY if self.minimum_column else _SINGLE
        return {name: getattr(self, name).strip() for name in names}

    def _table(self) -> tuple[DataFrame, bytes]:
        """Return the columns of the file that are read, all as text, and its content."""
        pandas, content = import_module("pandas"), content_of(Path(self.file), "file", MOST_BYTES)
        data = unpacked(content, "file", self.file, MOST_BYTES)
        keep(self.file)
        cut_off = pandas.errors.ParserWarning
        try:
            with warnings.catch_warnings(action="error", category=cut_off):
                table = pandas.read_csv(
                    io.BytesIO(data), sep=self.delimiter, dtype=str, encoding=self.encoding,
                    index_col=False, skipinitialspace=True, nrows=MOST_ROWS + 1,
                )  # fmt: skip
        except (LookupError, UnicodeError) as error:
            allowed = f"does not read it: {error}; many a file is latin-1"
            raise InputError("encoding", self.encoding, allowed) from None
        except (ValueError, cut_off, OSError) as error:
            allowed = f"must be a CSV file with delimiter = {self.delimiter!r}: {error}".strip()
            raise InputError("file", self.file, allowed) from None
        table.columns = table.columns.str.strip()
        for field, name in self.columns.items():
            if name not in table.columns:
                among = f"one of the columns of {self.file}: {', '.join(table.columns[:12])}"
                allowed = f"must be {among} (delimiter = {self.delimiter!r} separates them)"
                raise InputError(field, name, allowed)
        return table[[*self.columns.values()]], content

    def _keep(self, table: DataFrame, content: bytes) -> None:
        """Keep the readings of a table: its first column has the times, others temperatures."""
        if not 1 <= len(table) <= MOST_ROWS:
            allowed = f"must have at least one row of data, and at most {MOST_ROWS}"
            raise InputError("file", self.file or "(arrays)", allowed)
        written, names = table.iloc[:, 0], [str(name) for name in table.columns[1:]]
        moments = _moments(written, self.date_format)
        dated = moments.dtype.kind == "M"
        if self.minimum_column:
            if not dated:
                allowed = "must be a date, where a row has the minimum and the maximum of a day"
                raise InputError(str(written.name), str(written.iloc[0]), allowed)
            hours = dict(zip(names, (self.minimum_hour, self.maximum_hour), strict=True))
            names.sort(key=lambda name: hours[name])
            after = [timedelta(hours=float(hours[name])) for name in names]
            moments = (moments[:, None] + np.array(after, "timedelta64[us]")).ravel()
        texts = [str(text) for text in written for _ in names]  # the time of every reading
        temperatures = self._exactly(table[names], texts)
        seconds = (moments - moments[0]) / np.timedelta64(1, "s") if dated else moments
        said = [_in_words(moment) for moment in moments] if dated else texts
        _check_steps(seconds, texts, said, str(written.name), dated)
        highest: Sequence[Fraction] = temperatures
        if self.minimum_column:
            place = names.index(self.columns["maximum_column"])
            highest = temperatures[place::2]
            self._compare(temperatures[1 - place :: 2], highest, texts[::2])
        self._doubt(temperatures, highest)
        dilation = {value: self.kappa * (value - self.T0) for value in set(temperatures)}
        vars(self).update(
            theta=tuple(dilation[value] for value in temperatures),
            times=tuple(seconds.tolist()),
            sha256=hashlib.sha256(content).hexdigest(),
            origin=moments[0].astype("datetime64[us]").item().isoformat() if dated else "",
        )

    def _exactly(self, table: DataFrame, times: Sequence[str]) -> list[Fraction]:
        """Return the temperatures of a table, row by row, as the rationals that they denote."""
        entries = table.to_numpy(dtype=object).ravel().tolist()
        if (gone := table.isna().to_numpy().ravel()).any():
            k = int(np.argmax(gone))
            name = str(table.columns[k % table.shape[1]])
            allowed = f"is missing at {times[k]}; pandas leaves such rows out (Series.dropna()) or"
            raise InputError(name, entries[k], f'{allowed} fills them in (interpolate("time"))')
        exact: dict[Any, Fraction] = {}
        for k, entry in enumerate(entries):
            if entry in exact:
                continue
            name, point = str(table.columns[k % table.shape[1]]), entry
            if isinstance(entry, str) and self.decimal == ",":
                point = entry.replace(".", " ").replace(",", ".")  # no dots between thousands
            try:
                exact[entry] = exact_number(point, name) * self.scale
            except InputError:
                allowed = f"must be a number with decimal = {self.decimal!r}, at {times[k]}"
                raise InputError(name, entry, allowed) from None
            if exact[entry] < ABSOLUTE_ZERO[self.unit]:
                raise InputError(name, entry, f"must not be below absolute zero, at {times[k]}")
        return [exact[entry] for entry in entries]

    def _compare(
        self, minima: Sequence[Fraction], maxima: Sequence[Fraction], days: Sequence[str]
    ) -> None:
        """Warn of minima above their maxima; refuse them if they are more than one in a hundred."""
        above = [k for k, pair in enumerate(zip(minima, maxima, strict=True)) if pair[0] > pair[1]]
        if not above:
            return
        first = f"on {len(above)} of {len(days)} days, first on {days[above[0]]}"
        if len(above) * _FEWEST_SWAPPED > len(days):
            allowed = f"is above {self.maximum_column} {first}: the columns may be swapped"
            raise InputError("minimum_column", self.minimum_column, allowed)
        told = f"in {self.file or '(arrays)'} the minimum is above the maximum {first}"
        warnings.warn(told, RecordWarning, stacklevel=5)

    def _doubt(self, temperatures: Sequence[Fraction], highest: Sequence[Fraction]) -> None:
        """Warn if temperatures look like those of another unit, or like no temperatures.

        `highest` are the maxima of days, where a record has them, else all temperatures.
        """
        zero = 273.15 if self.unit == "K" else 0.0
        least, most = float(min(temperatures)), float(max(temperatures))
        coldest = float(min(highest)) if self.minimum_column else most
        names, file = {"C": "degrees Celsius", "K": "kelvin"}, self.file or "(arrays)"
        low, high = LIKE_KELVIN
        if (low < least and most < high) if self.unit == "C" else most < low:
            said = f'said to be in {names.pop(self.unit)} (unit = "{self.unit}")'
            told = f"the temperatures of {file}, from {least:g} to {most:g}, are {said}"
            told += f" and look like {names.popitem()[1]}"
        elif most - zero > HOTTEST:
            of_days = "maxima of days" if self.minimum_column else "temperatures"
            told = f"{file} holds {of_days} of up to {most:g} {self.unit}: they look like degrees"
            told += " Fahrenheit ((F - 32) * 5/9 are Celsius), or like tenths (scale = 0.1)"
        elif least < COLDEST + zero:
            cold = f"{file} holds {least:g} {self.unit}, colder than any weather"
            told = f"{cold}: a mark of missing readings, or tenths (scale = 0.1)?"
        elif coldest - zero < -HOTTEST:
            told = f"{file} holds no more than {coldest:g} {self.unit} on a day, colder than any:"
            told += " tenths (scale = 0.1)?"
        else:
            return
        warnings.warn(told, RecordWarning, stacklevel=4)

    @cached_property
    def dates(self) -> NDArray[np.datetime64] | None:
        """The date of each row, in UTC if the record names a time zone; None if it has numbers.

        Examples
        --------
        >>> record = TemperatureRecord.of([10, 31, 12.5], kappa="29e-6", T0=10, times=[0, 12, 24])
        >>> record.dates is None
        True
        """
        if not self.origin:
            return None
        origin = datetime.fromisoformat(self.origin)
        if origin.tzinfo is not None:
            origin = origin.astimezone(UTC).replace(tzinfo=None)
        since = np.round(np.array(self.times) * 1e6).astype("timedelta64[us]")
        return (np.datetime64(origin, "us") + since).astype("datetime64[ns]")

    @property
    def temperatures(self) -> NDArray[np.float64]:
        """The temperature of each row in `unit`, shape (rows,).

        Examples
        --------
        >>> record = TemperatureRecord.of([10, 31, 12.5], kappa="29e-6", T0=10, times=[0, 12, 24])
        >>> record.temperatures
        array([10. , 31. , 12.5])
        """
        return np.array([nearest_float(theta / self.kappa + self.T0) for theta in self.theta])

    @cached_property
    def _clock(self) -> NDArray[np.float64]:
        return np.array((self.times[0], *self.times))

    def clock(self, targets: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return when targets are reached, in units of `times`; the start has the first row's.

        Parameters
        ----------
        targets : ndarray of int
            Numbers of targets.

        Returns
        -------
        ndarray
            Of the same shape.

        Examples
        --------
        >>> record = TemperatureRecord.of([10, 31, 12.5], kappa="29e-6", T0=10, times=[0, 12, 24])
        >>> record.clock(np.arange(4))
        array([ 0.,  0., 12., 24.])
        """
        return self._clock[targets]

    def _facts(self) -> dict[str, Any]:
        names = ("file", "kappa", "T0", "unit", "origin", "theta")
        return {name: getattr(self, name) for name in names}

    def parameters(self) -> dict[str, Any]:
        kept = super().parameters()
        if not self.origin:
            del kept["origin"]
        return kept


def _check_options(options: Mapping[str, Any]) -> None:
    for name, choices in _CHOICES.items():
        if not isinstance(options[name], str) or options[name] not in choices:
            *most, last = (f'"{choice}"' for choice in choices)
            raise InputError(name, options[name], f"must be {', '.join(most)} or {last}")
    for name in {*_SINGLE, *_DAILY}:
        text = options[name]
        if not isinstance(text, str) or not (text.strip() or name in _DAILY[1:]):
            raise InputError(name, text, "must be the name of a column")
    _, low, high = (options[name].strip() for name in _DAILY)
    if bool(low) != bool(high):
        raise InputError("maximum_column", high, "must be given with minimum_column")
    single = options["temperature_column"]
    if low and single != "temperature":
        raise InputError("temperature_column", single, "must be left out beside minimum_column")
    for first, second in itertools.combinations(_DAILY if low else _SINGLE, 2):
        if options[first].strip() == options[second].strip():
            raise InputError(second, options[second], f"must not be {first}")
    delimiter = options["delimiter"]
    if not isinstance(delimiter, str) or len(delimiter) != 1 or delimiter in '"\r\n':
        raise InputError("delimiter", delimiter, 'must be one character, e.g. "," or ";"')
    if options["decimal"] == delimiter:
        raise InputError("decimal", delimiter, "must not be the delimiter as well")
    written = options["date_format"]
    if not isinstance(written, str) or (written and "%" not in written):
        allowed = "must say how dates are written, e.g. %d.%m.%Y %H:%M"
        raise InputError("date_format", written, allowed)
    if not isinstance(options["encoding"], str):
        raise InputError("encoding", options["encoding"], "must be a name, e.g. latin-1")


def _moments(entries: Series, date_format: str) -> NDArray[Any]:
    """Return times as floats, or as dates, in UTC where they name a time zone."""
    name, texts = str(entries.name), entries.astype(str).str.strip()

    def refuse(wrong: Any, allowed: str) -> None:
        if np.any(wrong):
            k = int(np.argmax(wrong))
            raise InputError(name, texts.iloc[k], f"{allowed} (row {k + 1})")

    refuse(entries.isna(), "is missing; pandas leaves such rows out (Series.dropna())")
    if not date_format and _is_number(entries.iloc[0]):
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


def _is_number(entry: Any) -> bool:
    try:
        exact_number(entry, "time")
    except InputError:
        return False
    return True


def _in_words(moment: np.datetime64) -> str:
    """Return a date for the eye: 10 April 2024."""
    date = moment.astype("datetime64[us]").item()
    return f"{date.day} {date:%B} {date.year}"


def _check_steps(
    times: NDArray[np.float64], texts: Sequence[str], said: Sequence[str], name: str, dated: bool
) -> None:
    """Raise `InputError` unless times increase, without a step much longer than the usual one."""
    steps = np.diff(times)
    if (wrong := steps <= 0).any():
        k = int(np.argmax(wrong))
        allowed = f"must be later than {texts[k]} before it; pandas sorts times (sort_index()), and"
        raise InputError(name, texts[k + 1], f"{allowed} makes one of several (groupby().mean())")
    if len(times) < _FEWEST_REGULAR:
        return
    usual = float(np.quantile(steps, 0.9, method="lower"))
    if (wrong := steps > GAP * usual).any():
        k, day, unit = int(np.argmax(wrong)), 86400 if dated else 1, " days" if dated else ""
        lengths = f"{steps[k] / day:.4g}{unit} after {said[k]}, where {usual / day:.4g} is usual"
        mend = 'resample().interpolate("time") fills it in, or Series[first:last] ends before it'
        raise InputError(name, texts[k + 1], f"is {lengths}, a gap; pandas: {mend}")
