"""Temperature records: times and temperatures, of a CSV file or of arrays, turned into a drive."""

from __future__ import annotations

import datetime
import hashlib
import itertools
import os
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from exactcreep.model.drive import Listed
from exactcreep.model.numbers import (
    InputError,
    Number,
    exact_number,
    nearest_float,
    positive_number,
)
from exactcreep.model.reading import content_of
from exactcreep.model.record_rows import (
    ABSOLUTE_ZERO,
    DATES,
    MOST_BYTES,
    RecordRow,
    RowReader,
    gaps_in,
    moment_of,
    rows_of_arrays,
    rows_of_file,
)

LIKE_KELVIN = (180, 400)
"""Weather and roofs lie between these in kelvin, and below the first in degrees Celsius."""
CHOICES = {
    "unit": ("C", "K"),
    "decimal": (".", ","),
    "date_order": tuple(DATES),
    "missing": ("refuse", "drop", "interpolate"),
    "duplicates": ("refuse", "first", "last", "mean"),
    "gaps": ("refuse", "interpolate"),
}


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
        What becomes of a step longer than 1.5 times the usual one (the median, from ten rows on):
        "interpolate" takes the temperature to be monotone there, the least that it can have done;
        `parts` makes records of what lies between the gaps.
    theta, times, sha256, origin : optional
        Only together, as `parameters` returned them: the file, which may be gone, is not read.
        `origin` may be left out.

    Attributes
    ----------
    theta : tuple of Fraction
        One dilation per row, exact: decimal texts are kept as the rationals that they denote.
    times : tuple of float
        Of each row: in seconds since `origin` for dates, as written otherwise.
    origin : str
        Date of the first row in ISO 8601, "" if times are numbers.
    sha256 : str
        Digest of the file, or of the arrays.

    Raises
    ------
    InputError
        If the file cannot be read, or rows cannot be what is said of them. The message names all
        such rows (1 is the first after the header) and their lines, beyond 20 their number.

    Warns
    -----
    RecordWarning
        If temperatures said to be in degrees Celsius look like kelvin, or the other way round.

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
        if not isinstance(file, (str, os.PathLike)):
            raise InputError("file", file, "must be the path of a CSV file")
        columns = {"time_column": time_column, "temperature_column": temperature_column}
        options = {
            "unit": unit,
            "decimal": decimal,
            "date_order": date_order,
            "missing": missing,
            "duplicates": duplicates,
            "gaps": gaps,
        }
        _check_options(columns, options, delimiter)
        expansion = positive_number(kappa, "kappa")
        reference = exact_number(T0, "T0")
        if reference < ABSOLUTE_ZERO[unit]:
            raise InputError("T0", T0, "must not be below absolute zero")
        vars(self).update(columns, file=os.fspath(file), kappa=expansion, T0=reference)
        vars(self).update(options, delimiter=delimiter)
        if theta is None or times is None or sha256 is None:
            if not (theta is None and times is None and sha256 is None and origin is None):
                raise InputError("theta", theta, "must come with times and sha256, or not at all")
            content = content_of(Path(file), "file", MOST_BYTES)
            self._take(rows_of_file(content, self), self.file, content)
            return
        dilations = tuple(exact_number(value, f"theta[{i}]") for i, value in enumerate(theta))
        moments = tuple(
            nearest_float(exact_number(value, f"times[{i}]")) for i, value in enumerate(times)
        )
        if not dilations or len(moments) != len(dilations):
            raise InputError("times", len(moments), "must be as many as theta, at least one")
        if origin and not isinstance(moment_of(origin, "iso"), datetime.datetime):
            raise InputError("origin", origin, "must be a date such as 2024-01-31T13:00")
        vars(self).update(theta=dilations, times=moments, sha256=sha256, origin=origin or "")

    @classmethod
    def of(
        cls,
        temperatures: ArrayLike,
        kappa: Number,
        T0: Number,
        *,
        times: ArrayLike | None = None,
        **options: str,
    ) -> TemperatureRecord:
        """Return the record of an array or pandas Series of temperatures.

        Parameters
        ----------
        temperatures : array of numbers, shape (rows,)
            None and nan are missing. Floats are taken for the binary numbers that they are.
        kappa, T0 : number
        times : array, shape (rows,), optional
            Numbers, `datetime.datetime`, `numpy.datetime64` or texts. Default: the index of a
            Series.
        **options
            ``unit``, ``date_order``, ``missing``, ``duplicates`` and ``gaps``.

        Raises
        ------
        InputError
            As for a file; rows count from 1.
        """
        index = getattr(temperatures, "index", None) if times is None else times
        if index is None or callable(index):
            raise InputError("times", None, "must be given, unless temperatures have an index")
        for name in options:
            if name not in CHOICES or name == "decimal":
                raise InputError(name, options[name], "is not an option of arrays")
        given, moments = _listed(temperatures, "temperatures"), _listed(index, "times")
        if len(moments) != len(given):
            raise InputError(
                "times", len(moments), f"must be as many as temperatures, {len(given)}"
            )
        blank = cls("", kappa, T0, theta=[0], times=[0], sha256="", **options)
        text = "\n".join(f"{moment},{value}" for moment, value in zip(moments, given, strict=True))
        blank._take(rows_of_arrays(moments, given), "(arrays)", text.encode())
        return blank

    def _take(self, rows: Iterable[RecordRow | InputError], shown: str, content: bytes) -> None:
        """Keep what rows say, or raise one `InputError` with all that is wrong with them."""
        times, temperatures, origin = RowReader(self).read(rows, shown)
        _doubt(temperatures, self.unit, shown)
        dilations = tuple(self.kappa * (value - self.T0) for value in temperatures)
        digest = hashlib.sha256(content).hexdigest()
        vars(self).update(theta=dilations, times=times, sha256=digest, origin=origin)

    @cached_property
    def dates(self) -> NDArray[np.datetime64] | None:
        """The date of each row, in UTC if the record names a time zone; None if times are numbers.

        Shape (rows,), in nanoseconds as pandas and xarray take them.
        """
        if not self.origin:
            return None
        origin = datetime.datetime.fromisoformat(self.origin)
        if origin.tzinfo is not None:
            origin = origin.astimezone(datetime.UTC).replace(tzinfo=None)
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


def _listed(values: Any, name: str) -> list[Any]:
    """Return the entries of an array, dates as `datetime.datetime`."""
    array = np.asarray(values)
    if array.ndim != 1:
        raise InputError(name, array.shape, "must have one dimension")
    if array.dtype.kind == "M":
        array = array.astype("datetime64[us]")
    listed: list[Any] = array.tolist()
    return listed


def _check_options(columns: dict[str, str], options: dict[str, str], delimiter: str) -> None:
    """Raise `InputError` unless a record can be read as these options say."""
    for name, text in columns.items():
        if not isinstance(text, str) or not text.strip():
            raise InputError(name, text, "must be the name of a column")
    if len({text.strip() for text in columns.values()}) == 1:
        text = columns["temperature_column"]
        raise InputError("temperature_column", text, "must not be time_column")
    for name, text in options.items():
        if not isinstance(text, str) or text not in CHOICES[name]:
            *most, last = (f'"{choice}"' for choice in CHOICES[name])
            raise InputError(name, text, f"must be {', '.join(most)} or {last}")
    if not isinstance(delimiter, str) or len(delimiter) != 1 or delimiter in '"\r\n':
        raise InputError("delimiter", delimiter, 'must be one character, e.g. "," or ";"')
    if options["decimal"] == delimiter:
        raise InputError("decimal", delimiter, "must not be the delimiter as well")


def _doubt(temperatures: Sequence[Fraction], unit: str, shown: str) -> None:
    """Warn if all temperatures look like those of another unit."""
    low, high = LIKE_KELVIN
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
