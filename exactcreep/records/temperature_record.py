"""Temperature records: times and temperatures, from a file or arrays, turned into a drive."""

from __future__ import annotations

import hashlib
import itertools
import math
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from fractions import Fraction
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from exactcreep.model.numbers import (
    InputError,
    Number,
    exact_number,
    nearest_float,
    number_from_zero,
    positive_number,
    refusing,
    whole_number,
)
from exactcreep.model.remarks import warn
from exactcreep.model.targets import Listed, targets_of
from exactcreep.records.columns import Temperatures, temperatures_of
from exactcreep.records.dates import formats_of, moments_of
from exactcreep.records.readings import ABSOLUTE_ZERO, Readings, RecordWarning, kelvin_in
from exactcreep.records.table import CellError, table_of
from exactcreep.records.times import Times, newest_first, times_of

_SINGLE = ("time_column", "temperature_column")
_DAILY = ("time_column", "minimum_column", "maximum_column")
_TEXTS = {*_SINGLE, *_DAILY, "unit", "delimiter", "decimal", "date_format", "encoding"}


@dataclass(frozen=True, repr=False)
class TemperatureRecord(Listed):
    """The dilations ``theta_q = kappa (T_q - T0)`` of a recorded series of temperatures.

    Each reading is a target: a row has one reading, or two if it has a minimum and a maximum. The
    ramp from T0 to the first reading takes no time.
    A velocity is a displacement per unit of `times`: per second for dates. What the options do not
    say is found by the words in the file, never by the sizes of its numbers; afterwards the
    attributes hold it. A `RecordWarning` warns of a doubtful unit. ``exactcreep record FILE``
    says what is read.

    Parameters
    ----------
    file : str or path
        A table of text of at most 64 MiB and a million rows, also packed by gzip (.gz) or zip
        (.zip, one file). Columns without names are called 1, 2, ... See `of` for arrays.
    kappa : number
        Thermal expansion coefficient, unit 1/K; positive.
    T0 : number
        Temperature at which the chain is prepared (theta = 0), in `unit`.
    time_column : str or list of str
        Name of the column of times, or of several columns: date and hour, or year, month, day, ...
        Times are numbers or dates of one format, and increase (or decrease) from row to row.
    temperature_column : str
        Name of the column of temperatures, or its number from 1.
    minimum_column, maximum_column : str
        Instead of `temperature_column`: a day's minimum and maximum.
    minimum_hour, maximum_hour : number
        Hours after the date of the row at which the minimum and the maximum are read.
    scale : number
        Factor on the numbers: 0.1 for tenths of a degree.
    unit : {"C", "K", "F"}
        Unit of the temperatures and of `T0`. Default: as words in the file say, else "C".
    delimiter, decimal : str
        Character between columns (a blank for any number of blanks), and decimal sign ``.`` or
        ``,``.
    date_format : str
        Format of dates, e.g. ``%d.%m.%Y %H:%M``; ``%s`` for seconds or milliseconds since 1970.
    encoding : str
        Encoding of the file, e.g. ``latin-1``.
    theta, times, sha256, origin : optional
        For stored records, all four as returned by `parameters`: the file is then not read.

    Raises
    ------
    InputError
        If an option is out of range, or what it says cannot be found in the file; if a reading is
        missing, is not later than the previous one, follows a gap, or is an outlier; or if the
        minimum is above the maximum on more than one day in a hundred. Nine steps in ten do not
        exceed the usual step; a gap is longer than 1.5 usual steps. An outlier differs by more than
        15 K from the median of five readings (itself and two on each side, where equal readings in
        a row count once), and by more than 5 times what nine readings in ten do not exceed; numbers
        such as 99.9 or -9999 that are 15 K from all other readings are outliers, too.

    Attributes
    ----------
    theta : tuple of Fraction
        One dilation for each reading; decimals are exact.
    times : tuple of float
        Time of each reading: in seconds since `origin` for dates, as written otherwise.
    origin : str
        Date of the first reading in ISO 8601, "" if times are numbers.
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
    time_column: str | tuple[str, ...]
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
        time_column: str | Sequence[str] = "",
        temperature_column: str = "",
        minimum_column: str = "",
        maximum_column: str = "",
        minimum_hour: Number = 5,
        maximum_hour: Number = 15,
        scale: Number = "",
        unit: str = "",
        delimiter: str = "",
        decimal: str = "",
        date_format: str = "",
        encoding: str = "",
        theta: Iterable[Any] | None = None,
        times: Iterable[Number] | None = None,
        sha256: str | None = None,
        origin: str | None = None,
    ) -> None:
        texts = {name: value for name, value in vars().items() if name in _TEXTS}
        if not isinstance(time_column, str):
            texts["time_column"] = _several(time_column)
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
            scale=None if scale == "" else positive_number(scale, "scale"),
        )
        if not 24 > self.maximum_hour != self.minimum_hour < 24:
            allowed = "must be another hour of the day than minimum_hour, below 24"
            raise InputError("maximum_hour", maximum_hour, allowed)
        if theta is None or times is None or sha256 is None:
            if not theta is times is sha256 is origin is None:
                raise InputError("theta", theta, "must come with times and sha256, or not at all")
            readings, content = self._read()
            self._check_unit(T0)
            self._keep(readings, content)
            return
        vars(self).update(unit=unit or "C", scale=self.scale or Fraction(1))
        self._check_unit(T0)
        dilations = targets_of(theta)
        moments = [exact_number(value, f"times[{i}]") for i, value in enumerate(times)]
        if len(moments) != len(dilations):
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

        Use pandas to read other files (``read_csv``, ``read_excel``), to sort (``sort_index``), to
        remove readings (``groupby(level=0).mean()``, ``dropna``) and to fill (``interpolate``).

        Parameters
        ----------
        temperatures : array of numbers, shape (rows,) or (rows, 2)
            Floats are read as their shortest decimals. Two columns are a day's minimum and maximum.
        kappa, T0 : number
            As for a file.
        times : array, shape (rows,), optional
            Numbers, `datetime.datetime`, `numpy.datetime64` or ISO 8601 texts. Default: the index
            of a Series or DataFrame.
        minimum_hour, maximum_hour, scale, unit : optional
            As for a file.

        Returns
        -------
        TemperatureRecord
            A drive with one target for each temperature.

        Raises
        ------
        InputError
            As for a file; if shapes do not fit, or there are no times.
        """
        index = getattr(temperatures, "index", None) if times is None else times
        if index is None or callable(index):
            raise InputError("times", None, "must be given, unless temperatures have an index")
        options: dict[str, str] = {"temperature_column": "temperature"}
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
            maximum_hour=maximum_hour, scale=scale, unit=unit, time_column="time", **options,
        )  # fmt: skip
        columns = [list(column) for column in values.reshape(len(values), -1).T]
        found = Temperatures(options, unit, record.scale, ".", columns)
        named = dict(zip(("time", *options.values()), [moments, *columns], strict=True))
        content = import_module("pandas").DataFrame(named).to_csv(index=False).encode()
        record._keep(Readings.of(_times_of(moments), found, record._hours), content)
        return record

    @classmethod
    @refusing
    def along(
        cls, records: Sequence[TemperatureRecord], springs: int | None = None
    ) -> TemperatureRecord:
        """Return the record of a chain whose springs have temperatures of their own.

        Parameters
        ----------
        records : sequence of TemperatureRecord
            Of places along the chain, with the same times, `kappa`, `T0` and `unit`. The first one
            is that of the upper spring, the last one that of the lowest, the others are at equal
            distances between them.
        springs : int, optional
            Number of springs; those between two places are interpolated linearly. Default: a
            record for each spring.

        Returns
        -------
        TemperatureRecord
            A drive whose targets are a dilation for each spring.

        Raises
        ------
        InputError
            If there are none, or they do not fit together.
        """
        if not records:
            raise InputError("records", [], "must hold at least one record")
        count = whole_number(springs or len(records), "springs", least=1, most=10**6)
        if len(records) > count:
            raise InputError("records", len(records), f"must be at most {count}, one a spring")
        first = records[0]
        for k, one in enumerate(records):
            for name in ("times", "origin", "kappa", "T0", "unit"):
                if getattr(one, name) != getattr(first, name):
                    raise InputError(f"records[{k}].{name}", "another", "must be that of the first")
        digest = hashlib.sha256("".join(one.sha256 for one in records).encode()).hexdigest()
        return cls(
            first.file, first.kappa, first.T0, unit=first.unit, times=first.times,
            theta=[_between(row, count) for row in zip(*(r.theta for r in records), strict=True)],
            sha256=digest, origin=first.origin,
        )  # fmt: skip

    @classmethod
    def readings(cls, file: str | os.PathLike[str], **options: Any) -> Readings:
        """Return the readings of a file with these options, including faulty ones.

        Parameters
        ----------
        file : str or path
            As for a record.
        **options
            As for a record; kappa and T0 may be left out.

        Returns
        -------
        Readings
            They list their faults; `series` is a pandas Series.

        Raises
        ------
        InputError
            If the file is not a table, or its times cannot be read.
        """
        about = {"kappa": 1, "T0": 300, **options, "theta": [0], "times": [0], "sha256": ""}
        record = cls(file, **about)
        scale = record.scale if options.get("scale") else None
        vars(record).update(unit=options.get("unit", ""), scale=scale)
        return record._read()[0]

    def _read(self) -> tuple[Readings, bytes]:
        """Return the readings of the file, and keep the options that were found."""
        table, content = table_of(Path(self.file), delimiter=self.delimiter, encoding=self.encoding)
        given = (self.time_column,) if isinstance(self.time_column, str) else self.time_column
        times = times_of(table, [name for name in given if name], self.date_format)
        if newest_first(times.values):
            table = replace(table, rows=table.rows[::-1])
            values, written = times.values[::-1], times.written[::-1]
            times = times._replace(values=values, written=written)
        found = temperatures_of(table, times, vars(self))
        readings = Readings.of(times, found, self._hours, file=self.file, table=table)
        if not (self.unit or self.scale) and (impossible := readings.impossible()):
            raise impossible
        vars(self).update(readings.options)
        return readings, content

    @property
    def _hours(self) -> tuple[Fraction, Fraction]:
        return self.minimum_hour, self.maximum_hour

    def _check_unit(self, T0: Number) -> None:
        if ABSOLUTE_ZERO[self.unit] > self.T0:
            raise InputError("T0", T0, "must not be below absolute zero")
        if not self.minimum_column and not self.minimum_hour == 5 == self.maximum_hour - 10:
            raise InputError("maximum_hour", self.maximum_hour, "belongs to minimum_column")

    def _keep(self, readings: Readings, content: bytes) -> None:
        """Store the readings, or refuse the first faulty one."""
        for kind, places in readings.faults().items():
            raise readings.refusal(kind, places)
        for told in readings.doubts():
            warn(told, RecordWarning)
        found = [value for value in readings.exact if value is not None]
        each = self.kappa * kelvin_in(self.unit)
        dilation = {value: each * (value - self.T0) for value in {*found}}
        origin = readings.times[0].astype("datetime64[us]").item() if readings.dated else None
        vars(self).update(
            theta=tuple(dilation[value] for value in found),
            times=tuple(readings.seconds.tolist()),
            sha256=hashlib.sha256(content).hexdigest(),
            origin="" if origin is None else origin.isoformat(),
        )

    @cached_property
    def dates(self) -> NDArray[np.datetime64] | None:
        """The date of each row, in UTC if the record has a time zone; None if it has numbers."""
        if not self.origin:
            return None
        origin = datetime.fromisoformat(self.origin)
        if origin.tzinfo is not None:
            origin = origin.astimezone(UTC).replace(tzinfo=None)
        since = np.round(np.array(self.times) * 1e6).astype("timedelta64[us]")
        return (np.datetime64(origin, "us") + since).astype("datetime64[ns]")

    @property
    def temperatures(self) -> NDArray[np.float64]:
        """The temperature of each row in `unit`, shape (rows,), or (rows, springs)."""
        each = self.kappa * kelvin_in(self.unit)
        exact = np.array(self.theta, dtype=object) / each + self.T0
        return np.asarray(np.frompyfunc(nearest_float, 1, 1)(exact).astype(np.float64))

    @cached_property
    def _clock(self) -> NDArray[np.float64]:
        return np.array((self.times[0], *self.times))

    def clock(self, targets: NDArray[np.int64]) -> NDArray[np.float64]:
        return self._clock[targets]

    def _facts(self) -> dict[str, Any]:
        names = ("file", "kappa", "T0", "unit", "origin", "theta")
        return {name: getattr(self, name) for name in names}


def _between(values: tuple[Fraction, ...], count: int) -> list[Fraction]:
    """Return `count` values from the first to the last, interpolated linearly."""
    steps = [b - a for a, b in itertools.pairwise(values)] + [Fraction(0)]
    places = [Fraction(k * (len(values) - 1), max(count - 1, 1)) for k in range(count)]
    return [values[int(p)] + steps[int(p)] * (p - int(p)) for p in places]


def _several(names: Any) -> tuple[str, ...]:
    """Return the columns of a list, or raise `InputError`."""
    if not isinstance(names, (list, tuple)) or not names or {*map(type, names)} != {str}:
        allowed = "must be the name of a column, or a list such as date, hour"
        raise InputError("time_column", names, allowed)
    return tuple(names)


def _times_of(moments: NDArray[Any]) -> Times:
    """Return the times of an array: dates, ISO 8601 texts or numbers."""
    written = [str(moment) for moment in moments.tolist()]
    if moments.dtype.kind == "M":
        micro = moments.astype("datetime64[us]")
        return Times(("time",), "", micro.astype(np.int64) / 1e6, True, [*map(str, micro)])
    if moments.dtype.kind in "fiu":
        return Times(("time",), "", moments.astype(np.float64), False, written)
    if next(formats_of(written[0], digits=False), None) == "":
        seconds = moments_of(written, "")
        allowed = "must be a date such as 2024-01-31T13:00, all with a time zone or none"
    else:
        seconds = np.array([_float(moment) for moment in moments])
        allowed = "must be a number, or a date such as 2024-01-31T13:00"
    if not np.isfinite(seconds).all():
        k = int(np.argmin(np.isfinite(seconds)))
        raise CellError("time", written[k], f"{allowed} (row {k + 1})", k + 1)
    return Times(("time",), "", seconds, "zone" in allowed, written)


def _float(moment: Any) -> float:
    try:
        return nearest_float(exact_number(moment, "time"))
    except InputError:
        return math.nan


def _check_options(given: Mapping[str, Any]) -> None:
    for name, value in given.items():
        if not isinstance(value, str) and name != "time_column":
            raise InputError(name, value, "must be text")
    daily = given["minimum_column"] or given["maximum_column"]
    columns = [name for name in (_DAILY if daily else _SINGLE) if isinstance(given[name], str)]
    for name in ("minimum_column", "maximum_column") if daily else ():
        if not given[name].strip():
            raise InputError(name, given[name], "must be the name of a column")
    if daily and given["temperature_column"]:
        allowed = "must be left out beside minimum_column"
        raise InputError("temperature_column", given["temperature_column"], allowed)
    for first, second in itertools.combinations(columns, 2):
        if given[first] and given[first].strip() == given[second].strip():
            raise InputError(second, given[second], f"must not be {first}")
    delimiter, written = given["delimiter"], given["date_format"]
    rules = [
        ("unit", given["unit"] in ("C", "K", "F", ""), 'must be "C", "K" or "F"'),
        ("decimal", given["decimal"] in (".", ",", ""), 'must be "." or ","'),
        ("delimiter", re.fullmatch(r'[^"\r\n]?', delimiter), "must be one character, e.g. ;"),
        ("date_format", "%" in written or not written, "must hold codes: %d.%m.%Y"),
    ]
    for name, kept, allowed in rules:
        if not kept:
            raise InputError(name, given[name], allowed)
