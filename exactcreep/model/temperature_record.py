"""Temperature records: times and temperatures, of a CSV file or of arrays, turned into a drive."""

from __future__ import annotations

import hashlib
import itertools
import os
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from fractions import Fraction
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from exactcreep.model.drive import Listed
from exactcreep.model.numbers import (
    InputError,
    Number,
    exact_number,
    nearest_float,
    number_from_zero,
    positive_number,
)
from exactcreep.model.readings import ABSOLUTE_ZERO, DATES, gaps_in, is_date, read, rows_of

LIKE_KELVIN = (180, 400)
"""Weather and roofs lie between these in kelvin, and below the first in degrees Celsius."""
COLDEST = Fraction(-90)
"""No weather was colder in degrees Celsius; -99.9 marks what is missing in many a file."""
CHOICES = {
    "unit": ("C", "K"),
    "decimal": (".", ","),
    "date_order": tuple(DATES),
    "missing": ("refuse", "drop", "interpolate"),
    "duplicates": ("refuse", "first", "last", "mean"),
    "gaps": ("refuse", "interpolate"),
}
_COLUMNS = ("time_column", "temperature_column", "minimum_column", "maximum_column")
_TEXTS = {*_COLUMNS, "delimiter", *CHOICES}


class RecordWarning(UserWarning):
    """A temperature record that can be read, but probably does not mean what it says.

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

    Parameters
    ----------
    file : str or path
        A CSV file in UTF-8 of at most 64 MiB and a million rows, or such a file packed by gzip
        (.gz). Its first row names the columns. See `of` for arrays and pandas.
    kappa : number
        Thermal expansion coefficient, unit 1/K; positive.
    T0 : number
        Temperature at which the chain is prepared (theta = 0), in `unit`.
    time_column, temperature_column : str
        Names of the columns. Times increase from row to row: numbers, or dates, all of one kind.
    minimum_column, maximum_column : str
        Instead of `temperature_column`: the columns of a day's minimum and maximum, the commonest
        kind of an old record. They are taken as they stand, at `minimum_hour` and `maximum_hour`.
    minimum_hour, maximum_hour : number
        When, in hours after the date of the row.
    scale : number
        What the numbers are multiplied by: 0.1 for tenths of a degree.
    unit : {"C", "K"}
        Of the temperatures.
    delimiter : str
        What separates the columns, one character.
    decimal : {".", ","}
        What stands before the decimals of a number.
    date_order : {"iso", "day first", "month first"}
        How dates are written: ``2024-01-31T13:00`` (ISO 8601), ``31.01.2024 13:00``, or
        ``01/31/2024 13:00``. Nothing is guessed.
    missing : {"refuse", "drop", "interpolate"}
        What becomes of a row without a temperature: it is left out (of the times, too, which may
        leave a gap), or takes the temperature linear in time between its neighbours. A row without
        a time can only be dropped.
    duplicates : {"refuse", "first", "last", "mean"}
        What of several rows of the same time counts.
    gaps : {"refuse", "interpolate"}
        What becomes of a step longer than 1.5 usual ones (what at least one in ten is as long as,
        from ten readings on; uneven hours make no gap): "interpolate" takes the temperature to be
        monotone there, the least that it can have done; `parts` makes records of what lies between
        the gaps.
    theta, times, sha256, origin : optional
        Only together, as `parameters` returned them: the file, which may be gone, is not read.
        `origin` may be left out.

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

    Raises
    ------
    InputError
        If the file cannot be read, or rows cannot be what is said of them. The message has every
        kind of fault with its first lines, their number, and the option that would mend it.

    Warns
    -----
    RecordWarning
        If temperatures said to be in degrees Celsius look like kelvin, or the other way round, or
        one is so low that it must mark a missing reading.

    Notes
    -----
    Between two rows theta ramps monotonically; rows in the middle of a monotone stretch change
    nothing. A velocity is a displacement per unit of `times` (per second for dates), gaps counted;
    the chain is taken from T0 to the first row at the time of that row.

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
    date_order: str
    missing: str
    duplicates: str
    gaps: str
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
        date_order: str = "iso",
        missing: str = "refuse",
        duplicates: str = "refuse",
        gaps: str = "refuse",
        theta: Iterable[Number] | None = None,
        times: Iterable[Number] | None = None,
        sha256: str | None = None,
        origin: str | None = None,
    ) -> None:
        own = {name: value for name, value in vars().items() if name in _TEXTS}
        _check_options(own)
        if not isinstance(file, (str, os.PathLike)):
            raise InputError("file", file, "must be the path of a CSV file")
        vars(self).update(
            own,
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
            if not (theta is None and times is None and sha256 is None and origin is None):
                raise InputError("theta", theta, "must come with times and sha256, or not at all")
            rows, content = rows_of(self)
            self._take(*read(rows, self, "line"), content)
            return
        theta = tuple(exact_number(value, f"theta[{i}]") for i, value in enumerate(theta))
        seconds = [exact_number(value, f"times[{i}]") for i, value in enumerate(times)]
        if not theta or len(seconds) != len(theta):
            raise InputError("times", len(seconds), "must be as many as theta, at least one")
        if origin and not is_date(origin):
            raise InputError("origin", origin, "must be a date such as 2024-01-31T13:00")
        moments = tuple(map(nearest_float, seconds))
        vars(self).update(theta=theta, times=moments, sha256=sha256, origin=origin or "")

    @classmethod
    def of(
        cls,
        temperatures: ArrayLike,
        kappa: Number,
        T0: Number,
        *,
        times: ArrayLike | None = None,
        **options: Any,
    ) -> TemperatureRecord:
        """Return the record of an array or pandas Series of temperatures.

        Parameters
        ----------
        temperatures : array of numbers, shape (rows,) or (rows, 2)
            None and nan are missing. Floats are taken for the binary numbers that they are. Two
            columns are minimum and maximum of a day.
        kappa, T0 : number
        times : array, shape (rows,), optional
            Numbers, `datetime.datetime`, `numpy.datetime64` or texts. Default: the index of a
            Series or DataFrame.
        **options
            All that does not say where a file has what.

        Raises
        ------
        InputError
            As for a file; rows count from 1.
        """
        index = getattr(temperatures, "index", None) if times is None else times
        if index is None or callable(index):
            raise InputError("times", None, "must be given, unless temperatures have an index")
        for name in options:
            if name in ("decimal", "delimiter") or name.endswith("_column"):
                raise InputError(name, options[name], "is not an option of arrays")
        values, moments = np.asarray(temperatures), np.asarray(index)
        if values.ndim == 2 and values.shape[1] == 2:
            options |= {"minimum_column": "minimum", "maximum_column": "maximum"}
        elif values.ndim != 1:
            raise InputError("temperatures", values.shape, "must have one dimension, or (rows, 2)")
        if moments.shape != values.shape[:1]:
            allowed = f"must be as many as temperatures, {len(values)}"
            raise InputError("times", len(moments), allowed)
        if moments.dtype.kind == "M":
            moments = moments.astype("datetime64[us]")
        blank = cls("", kappa, T0, theta=[0], times=[0], sha256="", **options)
        columns = [moments.tolist(), *values.reshape(len(values), -1).T.tolist()]
        rows = [*zip(range(1, len(values) + 1), *columns, strict=True)]
        text = "\n".join(",".join(map(str, row[1:])) for row in rows)
        blank._take(*read(rows, blank, "row"), text.encode())
        return blank

    @property
    def columns(self) -> dict[str, str]:
        """Names of the columns that are read, by option: of times, and of temperatures."""
        names = _COLUMNS[2:] if self.minimum_column else _COLUMNS[1:2]
        return {name: getattr(self, name).strip() for name in ("time_column", *names)}

    @property
    def hours(self) -> tuple[Fraction, ...]:
        """When a row's temperatures are those of, in hours after its date."""
        return (self.minimum_hour, self.maximum_hour) if self.minimum_column else (Fraction(0),)

    def _take(
        self, times: list[float], temperatures: list[Fraction], origin: str, content: bytes
    ) -> None:
        """Keep what `read` returned, and the digest of what it was read from."""
        _doubt(temperatures, self.unit, self.file or "(arrays)")
        dilation = {value: self.kappa * (value - self.T0) for value in set(temperatures)}
        vars(self).update(
            theta=tuple(dilation[value] for value in temperatures),
            times=tuple(times),
            sha256=hashlib.sha256(content).hexdigest(),
            origin=origin,
        )

    @cached_property
    def dates(self) -> NDArray[np.datetime64] | None:
        """The date of each row, in UTC if the record names a time zone; None if times are numbers.

        Shape (rows,), in nanoseconds as pandas and xarray take them.
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
        """The temperature of each row in `unit`, shape (rows,)."""
        return np.array([nearest_float(theta / self.kappa + self.T0) for theta in self.theta])

    def parts(self) -> tuple[TemperatureRecord, ...]:
        """Return the stretches between the gaps (see `gaps`), each a record that begins at T0."""
        about = self.parameters()
        del about["kind"]
        ends = [0, *gaps_in(self.times)[1], len(self.times)]
        return tuple(
            TemperatureRecord(**about | {"theta": self.theta[a:b], "times": self.times[a:b]})
            for a, b in itertools.pairwise(ends)
        )

    @cached_property
    def _clock(self) -> NDArray[np.float64]:
        return np.array((self.times[0], *self.times))

    def clock(self, targets: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return when targets are reached, in units of `times`; the start has the first row's."""
        return self._clock[targets]

    def _facts(self) -> dict[str, Any]:
        names = ("file", "kappa", "T0", "unit", "origin", "theta")
        return {name: getattr(self, name) for name in names}

    def parameters(self) -> dict[str, Any]:
        """Return what makes the drive again, without the file."""
        kept = super().parameters()
        if not self.origin:
            del kept["origin"]
        return kept


def _check_options(options: Mapping[str, Any]) -> None:
    """Raise `InputError` unless a record can be read as these texts say."""
    for name, text in options.items():
        either = name.startswith("m") and name.endswith("_column")
        if name.endswith("_column") and not (isinstance(text, str) and (text.strip() or either)):
            raise InputError(name, text, "must be the name of a column")
        if name in CHOICES and (not isinstance(text, str) or text not in CHOICES[name]):
            *most, last = (f'"{choice}"' for choice in CHOICES[name])
            raise InputError(name, text, f"must be {', '.join(most)} or {last}")
    low, high, single = (options[f"{n}_column"] for n in ("minimum", "maximum", "temperature"))
    if bool(low.strip()) != bool(high.strip()):
        raise InputError("maximum_column", high, "must be given with minimum_column")
    if low and single != "temperature":
        raise InputError("temperature_column", single, "must be left out beside minimum_column")
    for name in ("minimum_column", "maximum_column") if low else ("temperature_column",):
        if options[name].strip() == options["time_column"].strip():
            raise InputError(name, options[name], "must not be time_column")
    if low and low.strip() == high.strip():
        raise InputError("maximum_column", high, "must not be minimum_column")
    delimiter = options["delimiter"]
    if not isinstance(delimiter, str) or len(delimiter) != 1 or delimiter in '"\r\n':
        raise InputError("delimiter", delimiter, 'must be one character, e.g. "," or ";"')
    if options["decimal"] == delimiter:
        raise InputError("decimal", delimiter, "must not be the delimiter as well")


def _doubt(temperatures: Sequence[Fraction], unit: str, shown: str) -> None:
    """Warn if temperatures look like those of another unit, or like no temperatures."""
    low, high = LIKE_KELVIN
    coldest = float(COLDEST - ABSOLUTE_ZERO["C"] + ABSOLUTE_ZERO[unit])
    least, most = float(min(temperatures)), float(max(temperatures))
    other = {"C": "kelvin", "K": "degrees Celsius"}[unit]
    if (low < least and most < high) if unit == "C" else most < low:
        said = {"C": "degrees Celsius", "K": "kelvin"}[unit]
        warnings.warn(
            f"the temperatures of {shown}, from {least:g} to {most:g}, are said to be in {said}"
            f' (unit = "{unit}") and look like {other}',
            RecordWarning,
            stacklevel=4,
        )
    elif least < coldest:
        warnings.warn(
            f"{shown} holds {least:g} {unit}, colder than any weather: a mark of missing readings?",
            RecordWarning,
            stacklevel=4,
        )
