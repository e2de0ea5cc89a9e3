"""Temperature records: times and temperatures, of a CSV file or of arrays, turned into a drive."""

from __future__ import annotations

import gzip
import hashlib
import io
import itertools
import os
import warnings
import zlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from fractions import Fraction
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from exactcreep.model import readings
from exactcreep.model.drive import Listed
from exactcreep.model.numbers import (
    InputError,
    Number,
    exact_number,
    nearest_float,
    number_from_zero,
    positive_number,
)
from exactcreep.model.reading import content_of, text_of

if TYPE_CHECKING:
    from pandas import DataFrame

MOST_BYTES = 64 * 2**20
"""Size of a file of records, unpacked; more is another kind of file."""
MOST_ROWS = 1_000_000
"""A century of hours."""
LIKE_KELVIN = (180, 400)
"""Weather and roofs lie between these in kelvin, and below the first in degrees Celsius."""
COLDEST = -90
"""No weather was colder in degrees Celsius; -99.9 marks what is missing in many a file."""
CHOICES = {
    "unit": ("C", "K"),
    "decimal": (".", ","),
    "date_order": tuple(readings.DATES),
    "missing": ("refuse", "drop", "interpolate"),
    "duplicates": ("refuse", "first", "last", "mean"),
    "gaps": ("refuse", "interpolate"),
}
_SINGLE = ("time_column", "temperature_column")
_DAILY = ("time_column", "minimum_column", "maximum_column")
_TEXTS = {*_SINGLE, *_DAILY, "delimiter", *CHOICES}


class RecordWarning(UserWarning):
    """A temperature record that probably does not mean what it says.

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
    nothing. A velocity is a displacement per unit of `times` (per second for dates), gaps counted;
    the chain is taken from T0 to the first row at the time of that row.

    Raises `InputError` if a row cannot be what is said of it. The message has every kind of fault
    with its first lines, their number, and the option that would mend it.

    Warns with `RecordWarning` if temperatures look like those of the other unit, or one must mark a
    missing reading.

    >>> days = ["2024-06-01T04:00", "2024-06-01T16:00", "2024-06-02T04:00"]
    >>> record = TemperatureRecord.of([10, 31, 12.5], kappa="29e-6", T0=10, times=days)
    >>> record.theta[1], record.temperatures
    (Fraction(609, 1000000), array([10. , 31. , 12.5]))

    Parameters
    ----------
    file : str or path
        A CSV file in UTF-8 of at most 64 MiB and a million rows, also packed by gzip (.gz). Its
        first row names the columns. See `of` for arrays and pandas.
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
    delimiter, decimal : str
        One character between columns, and ``.`` or ``,`` before the decimals.
    date_order : {"iso", "day first", "month first"}
        How dates are written: ``2024-01-31T13:00`` (ISO 8601), ``31.01.2024 13:00``, or
        ``01/31/2024 13:00``. Nothing is guessed.
    missing : {"refuse", "drop", "interpolate"}
        What becomes of a row without a temperature: it is left out (which may leave a gap), or
        linear in time between its neighbours. A row without a time can only be dropped.
    duplicates : {"refuse", "first", "last", "mean"}
        What of several rows of the same time counts.
    gaps : {"refuse", "interpolate"}
        What becomes of a step longer than 1.5 usual ones (at least one in ten is as long):
        "interpolate" takes the temperature to be monotone there; `parts` cuts the record there.
    theta, times, sha256, origin : optional
        Only together, as `parameters` returned them: the file, which may be gone, is not read.

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
        if readings.ABSOLUTE_ZERO[unit] > self.T0:
            raise InputError("T0", T0, "must not be below absolute zero")
        if not self.minimum_column and not self.minimum_hour == 5 == self.maximum_hour - 10:
            raise InputError("maximum_hour", maximum_hour, "belongs to minimum_column")
        if not 24 > self.maximum_hour != self.minimum_hour < 24:
            allowed = "must be another hour of the day than minimum_hour, below 24"
            raise InputError("maximum_hour", maximum_hour, allowed)
        if theta is None or times is None or sha256 is None:
            if not theta is times is sha256 is origin is None:
                raise InputError("theta", theta, "must come with times and sha256, or not at all")
            self._read(*self._table(), "line")
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
        **options: Any,
    ) -> TemperatureRecord:
        """Return the record of an array or pandas Series of temperatures.

        Raises `InputError`: as for a file; rows count from 1.

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
        record = cls("", kappa, T0, theta=[0], times=[0], sha256="", **options)
        columns = [moments.tolist(), *values.reshape(len(values), -1).T.tolist()]
        text = "\n".join(",".join(map(str, row)) for row in zip(*columns, strict=True))
        table = import_module("pandas").DataFrame(
            dict(zip(record.columns.values(), columns, strict=True)),
            index=range(1, len(values) + 1), dtype=object,
        )  # fmt: skip
        record._read(table, text.encode(), "row")
        return record

    @property
    def columns(self) -> dict[str, str]:
        """Names of the columns that are read, by option: of times, and of temperatures."""
        names = _DAILY if self.minimum_column else _SINGLE
        return {name: getattr(self, name).strip() for name in names}

    def _table(self) -> tuple[DataFrame, bytes]:
        content = packed = content_of(Path(self.file), "file", MOST_BYTES)
        if self.file.lower().endswith(".gz"):
            try:
                with gzip.open(io.BytesIO(packed)) as stream:
                    content = stream.read(MOST_BYTES + 1)
            except (OSError, EOFError, zlib.error):
                allowed = "must be packed by gzip, as its name says"
                raise InputError("file", self.file, allowed) from None
            if len(content) > MOST_BYTES:
                allowed = f"must have at most {MOST_BYTES // 2**20} MiB when it is unpacked"
                raise InputError("file", self.file, allowed)
        text = text_of(content, "file", self.file)
        try:
            table = import_module("pandas").read_csv(
                io.StringIO(text), sep=self.delimiter, header=None, dtype=str,
                keep_default_na=False, skip_blank_lines=False, skipinitialspace=True,
            )  # fmt: skip
        except ValueError as error:
            empty = type(error).__name__ == "EmptyDataError"
            why = "it must begin with a row that names the columns" if empty else str(error).strip()
            raise InputError("file", self.file, f"must be a CSV file: {why}") from None
        header, rows = table.iloc[0].str.strip().tolist(), table.iloc[1:]
        for field, name in self.columns.items():
            if header.count(name) != 1:
                which = "named once among" if name in header else "one of"
                allowed = f"must be {which} the columns of {self.file}: {', '.join(header[:12])}"
                line = self.delimiter.join(header)
                signs = [s for s in ";,\t|" if name in map(str.strip, line.split(s))]
                allowed += "".join(f'; delimiter = "{s}" separates them' for s in signs[:1])
                raise InputError(field, name, allowed)
        rows = rows[(rows != "").any(axis="columns")].set_axis(header, axis="columns")
        return rows[[*self.columns.values()]].set_axis(rows.index + 1), packed

    def _read(self, table: DataFrame, content: bytes, counted: str) -> None:
        """Keep the readings of a table, whose index numbers the rows, called `counted`."""
        pandas = import_module("pandas")
        file, faults = self.file or "(arrays)", readings.Faults()
        if len(table) > MOST_ROWS:
            raise InputError("file", file, f"must have at most {MOST_ROWS} rows")
        time_column, *names = table.columns
        if self.missing == "drop":
            table = table[~readings.is_missing(table[time_column])]
        written = table[time_column]
        times = readings.times_of(written, self.date_order, self.decimal, faults)
        dated = times.dtype.kind == "M"
        if self.minimum_column and not dated:
            allowed = "must be a date, where a row has the minimum and the maximum of a day"
            faults.add(written[times.index], allowed)
        hours = (self.minimum_hour, self.maximum_hour) if self.minimum_column else (Fraction(0),)
        parts = []
        how = self.missing, self.unit, self.scale, self.decimal, faults
        for hour, name in sorted(zip(hours, names, strict=True)):
            at = times + pandas.Timedelta(hours=float(hour)) if hour and dated else times
            values = readings.temperatures_of(table[name], *how)
            parts.append(at.to_frame("at").join(values.rename("value"), how="inner"))
        taken = pandas.concat(parts).sort_index(kind="stable")
        last = taken["at"].cummax().shift()
        again, early = taken["at"] == last, taken["at"] < last
        faults.add(written[taken.index[early]], "must be later than before")
        if self.duplicates == "refuse":
            mend = 'duplicates = "first", "last" or "mean" takes one of several'
            faults.add(written[taken.index[again]], "must be later than before", mend)
        taken = taken[~early]
        if again.any():
            each = taken.groupby("at")["value"]
            values = [readings.one_of(group, self.duplicates) for _, group in each]
            taken = taken.drop_duplicates("at").assign(value=values)
        if taken.empty:
            faults.refuse(counted, file)
            raise InputError("file", file, "must hold at least one row of data")
        begin, written = taken["at"].iloc[0], written[taken.index]
        since = (taken["at"] - begin).dt.total_seconds() if dated else taken["at"]
        seconds = since.tolist()
        usual, after_gaps = readings.gaps_in(seconds)
        if self.gaps == "refuse":
            mend = 'gaps = "interpolate" takes the temperature to be monotone there'
            steps = f"{readings.GAP} usual steps of {usual:g}"
            allowed = f"comes more than {steps} after the one before"
            faults.add(written.iloc[after_gaps], allowed, mend)
        ends = written[taken["value"].isna() & taken.index.isin(written.index[[0, -1]])]
        faults.add(ends, "of a missing temperature leaves nothing to interpolate between at an end")
        faults.refuse(counted, file)
        temperatures = readings.filled(taken["value"], seconds)
        self._doubt(temperatures)
        dilation = {value: self.kappa * (value - self.T0) for value in set(temperatures)}
        vars(self).update(
            theta=tuple(dilation[value] for value in temperatures),
            times=tuple(seconds),
            sha256=hashlib.sha256(content).hexdigest(),
            origin=begin.isoformat() if dated else "",
        )

    def _doubt(self, temperatures: Sequence[Fraction]) -> None:
        """Warn if temperatures look like those of another unit, or like no temperatures."""
        least, most = float(min(temperatures)), float(max(temperatures))
        names, file = {"C": "degrees Celsius", "K": "kelvin"}, self.file or "(arrays)"
        low, high = LIKE_KELVIN
        if (low < least and most < high) if self.unit == "C" else most < low:
            said = f'said to be in {names.pop(self.unit)} (unit = "{self.unit}")'
            told = f"the temperatures of {file}, from {least:g} to {most:g}, are {said}"
            told += f" and look like {names.popitem()[1]}"
        elif least < COLDEST + (273.15 if self.unit == "K" else 0):
            cold = f"{file} holds {least:g} {self.unit}, colder than any weather"
            told = f"{cold}: a mark of missing readings?"
        else:
            return
        warnings.warn(told, RecordWarning, stacklevel=4)

    @cached_property
    def dates(self) -> NDArray[np.datetime64] | None:
        """The date of each row, in UTC if the record names a time zone; None if it has numbers."""
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
        ends = [0, *readings.gaps_in(self.times)[1], len(self.times)]
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
        kept = super().parameters()
        if not self.origin:
            del kept["origin"]
        return kept


def _check_options(options: Mapping[str, Any]) -> None:
    for name, choices in CHOICES.items():
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
