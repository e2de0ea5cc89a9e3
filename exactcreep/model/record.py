"""Temperature records: a CSV file of times and temperatures turned into a drive."""

from __future__ import annotations

import csv
import datetime
import hashlib
import io
import math
import os
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.drive import Listed
from exactcreep.model.numbers import InputError, exact_number, nearest_float

MOST_BYTES = 64 * 2**20
"""Size of a file of records; more is another kind of file."""
MOST_ROWS = 1_000_000
"""A century of hours."""
ABSOLUTE_ZERO = {"C": Fraction(-27315, 100), "K": Fraction(0)}
_DECIMAL = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d{1,4})?")
_MISSING = frozenset({"", "-", "--", "na", "n/a", "nan", "null", "none", "missing"})


@dataclass(frozen=True)
class TemperatureRecord(Listed):
    """The dilations ``theta_q = kappa (T_q - T0)`` of a recorded series of temperatures.

    Parameters
    ----------
    file : str or path
        A CSV file in UTF-8 of at most 64 MiB and a million rows. Its first row names the columns.
    kappa : number
        Thermal expansion coefficient, unit 1/K; positive.
    T0 : number
        Temperature at which the chain is prepared (theta = 0), in `unit`.
    time_column, temperature_column : str
        Names of the columns. Times must increase from row to row; they are numbers, or dates in
        ISO 8601 (``2024-01-31T13:00``), all of one kind.
    unit : {"C", "K"}
        Unit of the temperatures.
    delimiter : str
        What separates the columns, one character.
    theta, times, sha256 : optional
        Only together, as `parameters` returned them: the file, which may be gone, is not read.

    Attributes
    ----------
    theta : tuple of Fraction
        One dilation per row, exact: decimal texts are kept as the rationals that they denote.
    times : tuple of float
        Of each row: in seconds since the first row for dates, as written otherwise.
    sha256 : str
        Digest of the file.

    Raises
    ------
    InputError
        If the file cannot be read, or a row lacks a value, holds something else than a number, a
        temperature below absolute zero, or a time not after the one before; the message
        names the row (1 is the first after the header) and the line of the file.

    Notes
    -----
    Between two rows theta ramps monotonically: where the temperature was not recorded, the record
    is taken to be monotone. Rows in the middle of a monotone stretch change nothing. A velocity is
    a displacement per unit of `times` (per second for dates), gaps counted; the chain is taken
    from T0 to the first row at the time of that row.
    """

    file: str
    kappa: Fraction
    T0: Fraction
    time_column: str
    temperature_column: str
    unit: str
    delimiter: str
    sha256: str
    theta: tuple[Fraction, ...] = field(repr=False)
    times: tuple[float, ...] = field(repr=False)
    kind: ClassVar[str] = "record"
    per: ClassVar[str] = "unit of time"

    def __init__(
        self,
        file: str | os.PathLike[str],
        kappa: Any,
        T0: Any,
        *,
        time_column: str = "time",
        temperature_column: str = "temperature",
        unit: str = "C",
        delimiter: str = ",",
        theta: Iterable[Any] | None = None,
        times: Iterable[Any] | None = None,
        sha256: str | None = None,
    ) -> None:
        if not isinstance(file, (str, os.PathLike)):
            raise InputError("file", file, "must be the path of a CSV file")
        columns = {"time_column": time_column, "temperature_column": temperature_column}
        for name, text in columns.items():
            if not isinstance(text, str) or not text.strip():
                raise InputError(name, text, "must be the name of a column")
        if time_column.strip() == temperature_column.strip():
            raise InputError("temperature_column", temperature_column, "must not be time_column")
        if not isinstance(unit, str) or unit not in ABSOLUTE_ZERO:
            raise InputError("unit", unit, 'must be "C" or "K"')
        if not isinstance(delimiter, str) or len(delimiter) != 1 or delimiter in '"\r\n':
            raise InputError("delimiter", delimiter, 'must be one character, e.g. "," or ";"')
        expansion = exact_number(kappa, "kappa")
        if expansion <= 0:
            raise InputError("kappa", kappa, "must be positive")
        reference = exact_number(T0, "T0")
        if reference < ABSOLUTE_ZERO[unit]:
            raise InputError("T0", T0, "must not be below absolute zero")
        if theta is None or times is None or sha256 is None:
            if not (theta is None and times is None and sha256 is None):
                raise InputError("theta", theta, "must come with times and sha256, or not at all")
            content = _bytes_of(Path(file))
            sha256 = hashlib.sha256(content).hexdigest()
            moments, temperatures = _columns(
                _rows_of(content, file, delimiter),
                file,
                time_column.strip(),
                temperature_column.strip(),
                ABSOLUTE_ZERO[unit],
            )
            dilations = [expansion * (value - reference) for value in temperatures]
        else:
            dilations = [exact_number(value, f"theta[{i}]") for i, value in enumerate(theta)]
            moments = [
                nearest_float(exact_number(value, f"times[{i}]")) for i, value in enumerate(times)
            ]
            if not dilations or len(moments) != len(dilations):
                raise InputError("times", len(moments), "must be as many as theta, at least one")
        for name, value in (
            ("file", os.fspath(file)),
            ("kappa", expansion),
            ("T0", reference),
            ("time_column", time_column),
            ("temperature_column", temperature_column),
            ("unit", unit),
            ("delimiter", delimiter),
            ("sha256", sha256),
            ("theta", tuple(dilations)),
            ("times", tuple(moments)),
        ):
            object.__setattr__(self, name, value)

    @cached_property
    def _clock(self) -> NDArray[np.float64]:
        return np.array((self.times[0], *self.times))

    def clock(self, targets: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return when targets are reached, in units of `times`; the start has the first row's."""
        return self._clock[targets]

    def parameters(self) -> dict[str, Any]:
        """Return what a scene names, and theta, times and the digest of the file.

        They make the drive again without the file.
        """
        return {
            "kind": self.kind,
            "file": self.file,
            "time_column": self.time_column,
            "temperature_column": self.temperature_column,
            "unit": self.unit,
            "kappa": self.kappa,
            "T0": self.T0,
            "delimiter": self.delimiter,
            "sha256": self.sha256,
            "theta": list(self.theta),
            "times": list(self.times),
        }


def _bytes_of(path: Path) -> bytes:
    """Return the content of a regular file of at most `MOST_BYTES`."""
    shown = os.fspath(path)
    try:
        if path.is_dir():
            raise InputError("file", shown, "must be a CSV file, not a directory")
        if not path.exists():
            raise InputError("file", shown, "must be an existing CSV file")
        if not path.is_file():
            raise InputError("file", shown, "must be a regular file")
        with path.open("rb") as stream:
            content = stream.read(MOST_BYTES + 1)
    except InputError:
        raise
    except OSError as error:
        reason = error.strerror or type(error).__name__
        raise InputError("file", shown, f"must be readable: {reason}") from None
    except ValueError:  # a null character in the path
        raise InputError("file", shown, "must be the path of a CSV file") from None
    if len(content) > MOST_BYTES:
        raise InputError("file", shown, f"must have at most {MOST_BYTES // 2**20} MiB")
    return content


def _rows_of(content: bytes, file: Any, delimiter: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the line number and the fields of every row that is not blank, the header first."""
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise InputError(
            "file", os.fspath(file), f"must be UTF-8 text; line {line} holds another byte"
        ) from None
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True)
    try:
        for fields in reader:
            if any(entry.strip() for entry in fields):
                yield reader.line_num, [entry.strip() for entry in fields]
    except csv.Error as error:
        raise InputError(
            "file", os.fspath(file), f"must be a CSV file; line {reader.line_num}: {error}"
        ) from None


def _columns(
    rows: Iterator[tuple[int, list[str]]], file: Any, time: str, temperature: str, least: Fraction
) -> tuple[list[float], list[Fraction]]:
    """Return the times as floats and the temperatures exactly."""
    shown = os.fspath(file)
    header = next(rows, (0, []))[1]
    if not header:
        raise InputError("file", shown, "must begin with a row that names the columns")
    places = []
    for name, wanted in (("time_column", time), ("temperature_column", temperature)):
        if header.count(wanted) != 1:
            found = ", ".join(header[:12])
            which = "one of" if wanted not in header else "named once among"
            raise InputError(name, wanted, f"must be {which} the columns of {shown}: {found}")
        places.append(header.index(wanted))
    times: list[float] = []
    temperatures: list[Fraction] = []
    before: Any = None
    origin: Any = None
    for row, (line, fields) in enumerate(rows, start=1):
        where = f"row {row} (line {line}) of {shown}"
        if row > MOST_ROWS:
            raise InputError("file", shown, f"must have at most {MOST_ROWS} rows")
        if len(fields) != len(header):
            raise InputError(
                "file",
                shown,
                f"row {row} (line {line}) must have {len(header)} columns, not {len(fields)}",
            )
        moment = _moment(fields[places[0]], time, where)
        value = _temperature(fields[places[1]], temperature, where)
        if value < least:
            raise InputError(
                temperature, fields[places[1]], f"must not be below absolute zero in {where}"
            )
        if before is None:
            origin = moment
        elif isinstance(moment, Fraction) is not isinstance(before, Fraction) or (
            not isinstance(moment, Fraction) and (moment.tzinfo is None) != (before.tzinfo is None)
        ):
            raise InputError(
                time, fields[places[0]], f"must be of the same kind as the rows before in {where}"
            )
        elif not moment > before:
            raise InputError(
                time, fields[places[0]], f"must be later than in the row before in {where}"
            )
        before = moment
        seconds = (
            nearest_float(moment)
            if isinstance(moment, Fraction)
            else (moment - origin).total_seconds()
        )
        if not math.isfinite(seconds):
            raise InputError(
                time, fields[places[0]], f"must be below the largest float, 1.8e308, in {where}"
            )
        times.append(seconds)
        temperatures.append(value)
    if not temperatures:
        raise InputError("file", shown, "must hold at least one row of data")
    return times, temperatures


def _moment(text: str, column: str, where: str) -> Fraction | datetime.datetime:
    """Return a time: a number exactly, or a date."""
    if text.lower() in _MISSING:
        raise InputError(column, text, f"missing in {where}")
    if _DECIMAL.fullmatch(text):
        return exact_number(text, column)
    try:
        return datetime.datetime.fromisoformat(text)
    except ValueError:
        raise InputError(
            column, text, f"must be a number or a date such as 2024-01-31T13:00 in {where}"
        ) from None


def _temperature(text: str, column: str, where: str) -> Fraction:
    if text.lower() in _MISSING:
        raise InputError(column, text, f"missing in {where}")
    if not _DECIMAL.fullmatch(text):
        raise InputError(column, text, f"must be a number with a decimal point in {where}")
    return exact_number(text, column)
