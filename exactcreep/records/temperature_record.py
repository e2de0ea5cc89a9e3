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

from exactcreep.model.names import one_of
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
from exactcreep.records.dates import moments_of
from exactcreep.records.readings import ABSOLUTE_ZERO, Readings, RecordWarning, kelvin_in
from exactcreep.records.table import CellError, table_of
from exactcreep.records.times import Times, newest_first, times_of

_TEXTS = ("time_column", "temperature_column", "minimum_column", "maximum_column", "unit",
          "delimiter", "decimal", "date_format", "encoding")  # fmt: skip
_OPTIONS = dict.fromkeys(_TEXTS, "") | {"minimum_hour": 5, "maximum_hour": 15, "scale": ""}
"""How a table is read, with defaults."""


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
        given = {name: value for name, value in vars().items() if name in _OPTIONS}
        if not isinstance(file, (str, os.PathLike)):
            raise InputError("file", file, "must be the path of a CSV file")
        vars(self).update(
            _checked(given),
            file=os.fspath(file),
            kappa=positive_number(kappa, "kappa"),
            T0=exact_number(T0, "T0"),
        )
        if theta is None or times is None or sha256 is None:
            if not theta is times is sha256 is origin is None:
                raise InputError("theta", theta, "must come with times and sha256, or not at all")
            self._keep(*_read(self.file, vars(self)), T0)
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
        hours = record.minimum_hour, record.maximum_hour
        record._keep(Readings(_times_of(moments), found, hours), content, T0)
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
    @refusing
    def readings(cls, file: str | os.PathLike[str], **options: Any) -> Readings:
        """Return the readings of a file with these options, including faulty ones.

        Parameters
        ----------
        file : str or path
            As for a record.
        **options
            As for a record, without kappa and T0.

        Returns
        -------
        Readings
            They list their faults; `series` is a pandas Series.

        Raises
        ------
        InputError
            If the file is not a table, or its times cannot be read.
        """
        for name in options.keys() - _OPTIONS.keys():
            raise InputError("option", name, one_of(name, _OPTIONS))
        return _read(os.fspath(file), _checked({**_OPTIONS, **options}))[0]

    def _check_unit(self, T0: Number) -> None:
        if ABSOLUTE_ZERO[self.unit] > self.T0:
            raise InputError("T0", T0, "must not be below absolute zero")

    def _keep(self, readings: Readings, content: bytes, T0: Number) -> None:
        """Store the readings, or refuse the first faulty one."""
        vars(self).update(readings.options)
        self._check_unit(T0)
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


def _read(file: str, given: Mapping[str, Any]) -> tuple[Readings, bytes]:
    """Return the readings of a file, and its content."""
    table, content = table_of(Path(file), given["delimiter"], given["encoding"])
    names = (
        [given["time_column"]] if isinstance(given["time_column"], str) else given["time_column"]
    )
    times = times_of(table, [name for name in names if name], given["date_format"])
    if newest_first(times.values):
        table = replace(table, rows=table.rows[::-1])
        times = times._replace(values=times.values[::-1], written=times.written[::-1])
    hours = given["minimum_hour"], given["maximum_hour"]
    readings = Readings(times, temperatures_of(table, times, given), hours, file, table)
    if not (given["unit"] or given["scale"]) and (impossible := readings.impossible()):
        raise impossible
    return readings, content


def _times_of(moments: NDArray[Any]) -> Times:
    """Return the times of an array: dates, ISO 8601 texts or numbers."""
    dated = moments.dtype.kind == "M"
    texts = map(str, moments.astype("datetime64[us]") if dated else moments.tolist())
    written = [text.removesuffix(".000000") for text in texts]
    seconds = moments_of(written, "")
    allowed = "must be a date such as 2024-01-31T13:00, all with a time zone or none"
    if np.isnan(seconds[0]) and not dated:
        allowed = "must be a number, or a date such as 2024-01-31T13:00"
        seconds = np.array([_float(moment) for moment in moments])
    if not np.isfinite(seconds).all():
        k = int(np.argmin(np.isfinite(seconds)))
        raise CellError("time", written[k], f"{allowed} (row {k + 1})", k + 1)
    return Times(("time",), "", seconds, "zone" in allowed, written)


def _float(moment: Any) -> float:
    try:
        return nearest_float(exact_number(moment, "time"))
    except InputError:
        return math.nan


def _checked(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options that say how a table is read, or raise `InputError`."""
    found, seen = {name: given[name] for name in _OPTIONS}, dict[str, str]()
    for name, value in found.items():
        several = name == "time_column" and isinstance(value, (list, tuple))
        if several and {*map(type, value)} == {str}:
            found[name] = tuple(value)
        elif name in _TEXTS and not isinstance(value, str):
            allowed = ", or a list such as date, hour" if name == "time_column" else ""
            raise InputError(name, value, f"must be text{allowed}")
        elif name.endswith("_column"):
            if (column := value.strip()) in seen:
                raise InputError(name, value, f"must not be {seen[column]}")
            seen |= {column: name} if column else {}
    daily = found["minimum_column"].strip(), found["maximum_column"].strip()
    for name in ("minimum_hour", "maximum_hour"):
        found[name] = number_from_zero(found[name], name)
    found["scale"] = None if found["scale"] == "" else positive_number(found["scale"], "scale")
    low, high = found["minimum_hour"], found["maximum_hour"]
    rules = [
        ("temperature_column", not (any(daily) and found["temperature_column"]),
         "must be left out beside minimum_column"),
        ("minimum_column", daily[0] or not any(daily), "must be the name of a column"),
        ("maximum_column", daily[1] or not any(daily), "must be the name of a column"),
        ("maximum_hour", 24 > high != low < 24, "must be below 24, and not minimum_hour"),
        ("maximum_hour", any(daily) or low == 5 == high - 10, "belongs to minimum_column"),
        ("unit", found["unit"] in ("C", "K", "F", ""), 'must be "C", "K" or "F"'),
        ("decimal", found["decimal"] in (".", ",", ""), 'must be "." or ","'),
        ("delimiter", re.fullmatch(r'[^"\r\n]?', found["delimiter"]), "must be one character: ;"),
        ("date_format", "%" in (found["date_format"] or "%"), "must hold codes: %d.%m.%Y"),
    ]  # fmt: skip
    for name, kept, allowed in rules:
        if not kept:
            raise InputError(name, given[name], allowed)
    return found
