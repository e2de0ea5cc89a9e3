"""The rows of a temperature record: what they say, and what is wrong with them."""

from __future__ import annotations

import csv
import datetime
import gzip
import io
import itertools
import math
import re
import zlib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np

from exactcreep.model.numbers import InputError, exact_number, nearest_float
from exactcreep.model.reading import text_of

if TYPE_CHECKING:
    from exactcreep.model.temperature_record import TemperatureRecord

MOST_BYTES = 64 * 2**20
"""Size of a file of records, unpacked; more is another kind of file."""
MOST_ROWS = 1_000_000
"""A century of hours."""
ABSOLUTE_ZERO = {"C": Fraction(-27315, 100), "K": Fraction(0)}
DATES = {
    "iso": "2024-01-31T13:00",
    "day first": "31.01.2024 13:00",
    "month first": "01/31/2024 13:00",
}
_MOST_FAULTS = 20  # of a file that a message lists; it gives the number of the others
_FEWEST_REGULAR = 10  # rows from which on there is a usual step
_GAP = 1.5  # a step longer than this many usual ones (their median) is a gap
_DECIMAL = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d{1,4})?")
_DATE = re.compile(r"(\d{1,2})([./-])(\d{1,2})\2(\d{4})(?:(?:T| +)(\d{1,2})(:.*))?")
_MISSING = frozenset({"", "-", "--", "na", "n/a", "nan", "nat", "null", "none", "missing", "<na>"})


@dataclass
class RecordRow:
    """A row of a record: its entries as written, its time, and all temperatures at this time."""

    where: str
    time: Any
    temperature: Any
    moment: Any = None
    """A `Fraction` or a `datetime.datetime`."""
    values: list[Fraction | None] = field(default_factory=list)


def rows_of_arrays(moments: Sequence[Any], temperatures: Sequence[Any]) -> Iterator[RecordRow]:
    """Yield the rows of two arrays of the same length."""
    for k, pair in enumerate(zip(moments, temperatures, strict=True), start=1):
        yield RecordRow(f"row {k}", *pair)


def rows_of_file(content: bytes, record: TemperatureRecord) -> Iterator[RecordRow | InputError]:
    """Yield what every row of a CSV file says, or what is wrong with it."""
    file = record.file
    lines = _lines_of(content, file, record.delimiter)
    header = next(lines, (0, []))[1]
    if not header:
        raise InputError("file", file, "must begin with a row that names the columns")
    places = []
    for name in ("time_column", "temperature_column"):
        wanted = getattr(record, name).strip()
        if header.count(wanted) != 1:
            which = "one of" if wanted not in header else "named once among"
            allowed = f"must be {which} the columns of {file}: {', '.join(header[:12])}"
            raise InputError(name, wanted, allowed)
        places.append(header.index(wanted))
    for row, (line, entries) in enumerate(lines, start=1):
        where = f"row {row} (line {line})"
        if len(entries) == len(header):
            time, temperature = (entries[place] for place in places)
            yield RecordRow(f"{where} of {file}", time, temperature)
        else:
            allowed = f"{where} must have {len(header)} columns, not {len(entries)}"
            yield InputError("file", file, allowed)


def _lines_of(content: bytes, file: str, delimiter: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the line number and the fields of every row that is not blank, the header first."""
    if file.lower().endswith(".gz"):
        try:
            with gzip.open(io.BytesIO(content)) as stream:
                content = stream.read(MOST_BYTES + 1)
        except (OSError, EOFError, zlib.error):
            raise InputError("file", file, "must be packed by gzip, as its name says") from None
        if len(content) > MOST_BYTES:
            allowed = f"must have at most {MOST_BYTES // 2**20} MiB when it is unpacked"
            raise InputError("file", file, allowed)
    text = text_of(content, "file", file)
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True)
    try:
        for entries in reader:
            if any(entry.strip() for entry in entries):
                yield reader.line_num, [entry.strip() for entry in entries]
    except csv.Error as error:
        allowed = f"must be a CSV file; line {reader.line_num}: {error}"
        raise InputError("file", file, allowed) from None


class RowReader:
    """Turns rows into times and temperatures as the options of `record` say.

    What is wrong with them is collected, and refused at once.
    """

    def __init__(self, record: TemperatureRecord) -> None:
        self.record = record
        self.kept: list[RecordRow] = []
        self.faults: list[InputError] = []

    def read(
        self, rows: Iterable[RecordRow | InputError], shown: str
    ) -> tuple[tuple[float, ...], list[Fraction], str]:
        """Return times, temperatures, and the date of the first row, "" if times are numbers."""
        for number, row in enumerate(rows, start=1):
            if number > MOST_ROWS:
                raise InputError("file", shown, f"must have at most {MOST_ROWS} rows")
            try:
                if isinstance(row, InputError):
                    raise row
                self._add(row)
            except InputError as error:
                self.faults.append(error)
        if not self.kept and not self.faults:
            raise InputError("file", shown, "must hold at least one row of data")
        start: Any = self.kept[0].moment if self.kept else Fraction(0)
        dated = not isinstance(start, Fraction)
        times = tuple(
            (row.moment - start).total_seconds() if dated else nearest_float(row.moment)
            for row in self.kept
        )
        values = [self._one_of(row.values) for row in self.kept]
        self._look_at_times(times)
        if self.record.missing == "interpolate" and not self.faults:
            why = ": nothing to interpolate between at the ends"
            ends = [self.kept[k] for k in (0, -1) if values[k] is None]
            self.faults += [self._fault(row, "temperature", "missing", why) for row in ends]
        if self.faults:
            first, *others = self.faults
            further = "".join(f"; {fault}" for fault in others[: _MOST_FAULTS - 1])
            if len(self.faults) > _MOST_FAULTS:
                further += f"; and {len(self.faults) - _MOST_FAULTS} more"
            raise InputError(first.field, first.value, first.allowed + further)
        return times, _filled(values, times), start.isoformat() if dated else ""

    def _add(self, row: RecordRow) -> None:
        """Keep a row, or raise `InputError`."""
        row.moment, value = self._time(row), self._temperature(row)
        row.values.append(value)
        missing, before = self.record.missing, self.kept[-1] if self.kept else None
        if (row.moment is None or value is None) and missing == "drop":
            return
        if row.moment is None:
            raise self._fault(row, "time", "missing")
        if value is None and missing == "refuse":
            self.faults.append(self._fault(row, "temperature", "missing"))
        if before is not None:
            if _kind(row.moment) != _kind(before.moment):
                raise self._fault(row, "time", "must be of the same kind as the rows before")
            if row.moment == before.moment and self.record.duplicates != "refuse":
                before.values.append(value)
                return
            if not row.moment > before.moment:
                raise self._fault(row, "time", "must be later than in the row before")
        self.kept.append(row)

    def _look_at_times(self, times: Sequence[float]) -> None:
        """Find what is wrong with times that increase: infinite ones, and gaps."""
        infinite = [row for row, when in zip(self.kept, times, strict=True) if math.isinf(when)]
        allowed = "must be below the largest float, 1.8e308,"
        self.faults += [self._fault(row, "time", allowed) for row in infinite]
        if self.record.gaps == "refuse" and not infinite:
            usual, places = gaps_in(times)
            further = (
                f', more than {_GAP} times the usual {usual:g} (gaps = "interpolate" takes the'
                " temperature to be monotone there)"
            )
            for k in places:
                allowed = f"is {times[k] - times[k - 1]:g} after the row before"
                self.faults.append(self._fault(self.kept[k], "time", allowed, further))

    def _fault(self, row: RecordRow, what: str, allowed: str, further: str = "") -> InputError:
        """Return what is wrong with the entry of a row in the column of times or temperatures."""
        column, entry = getattr(self.record, f"{what}_column").strip(), getattr(row, what)
        return InputError(column, entry, f"{allowed} in {row.where}{further}")

    def _time(self, row: RecordRow) -> Any:
        """Return a time: a number exactly, or a date; None where it is missing."""
        if _is_missing(row.time):
            return None
        order = self.record.date_order
        try:
            moment = moment_of(self._with_point(row.time), order)
        except ValueError:
            allowed = f"must be a number or a date such as {DATES[order]}"
            raise self._fault(row, "time", allowed) from None
        if not isinstance(moment, Fraction) and not 1700 <= moment.year <= 2200:
            raise self._fault(row, "time", "must be a date of the years 1700 to 2200")
        return moment

    def _temperature(self, row: RecordRow) -> Fraction | None:
        """Return a temperature exactly, None where it is missing."""
        if _is_missing(row.temperature):
            return None
        decimal, entry = self.record.decimal, self._with_point(row.temperature)
        if isinstance(entry, str) and not _DECIMAL.fullmatch(entry):
            allowed = f"must be a number with a decimal {'point' if decimal == '.' else 'comma'}"
            commas = decimal == "." and _DECIMAL.fullmatch(entry.replace(",", ".", 1))
            further = '; decimal = "," reads decimal commas' if commas else ""
            raise self._fault(row, "temperature", allowed, further)
        value = exact_number(entry, f"{self.record.temperature_column.strip()} in {row.where}")
        if value < ABSOLUTE_ZERO[self.record.unit]:
            raise self._fault(row, "temperature", "must not be below absolute zero")
        return value

    def _with_point(self, entry: Any) -> Any:
        """Return a text with a decimal point, if it has what the option `decimal` says."""
        if self.record.decimal == "." or not isinstance(entry, str) or "." in entry:
            return entry
        swapped = entry.replace(",", ".", 1)
        return swapped if _DECIMAL.fullmatch(swapped) else entry

    def _one_of(self, values: list[Fraction | None]) -> Fraction | None:
        """Return the temperature of a time from those of its rows, as `duplicates` says."""
        known = [value for value in values if value is not None]
        if known and self.record.duplicates == "mean":
            return sum(known, Fraction(0)) / len(known)
        return known[-1 if self.record.duplicates == "last" else 0] if known else None


def _is_missing(entry: Any) -> bool:
    return str(entry).strip().lower() in _MISSING


def moment_of(entry: Any, order: str) -> Fraction | datetime.datetime:
    """Return a time: a number exactly, or a date; raise `ValueError` for anything else."""
    if isinstance(entry, datetime.datetime):
        return entry
    if not isinstance(entry, str) or _DECIMAL.fullmatch(entry):
        return exact_number(entry, "time")
    if order == "iso":
        return datetime.datetime.fromisoformat(entry)
    parts = _DATE.fullmatch(entry)
    if parts is None:
        raise ValueError("no such date")
    day, month = (parts[1], parts[3]) if order == "day first" else (parts[3], parts[1])
    clock = "" if parts[5] is None else f"T{parts[5]:0>2}{parts[6]}"
    return datetime.datetime.fromisoformat(f"{parts[4]}-{month:0>2}-{day:0>2}{clock}")


def _kind(moment: Any) -> tuple[bool, bool]:
    """Return which times can be compared: numbers, dates, and dates of a time zone."""
    return isinstance(moment, Fraction), getattr(moment, "tzinfo", None) is None


def gaps_in(times: Sequence[float]) -> tuple[float, list[int]]:
    """Return the usual step, and the rows that follow a gap."""
    if len(times) < _FEWEST_REGULAR:
        return math.inf, []
    steps = np.diff(times)
    usual = float(np.median(steps))
    return usual, (np.flatnonzero(steps > _GAP * usual) + 1).tolist()


def _filled(values: Sequence[Fraction | None], times: Sequence[float]) -> list[Fraction]:
    """Return temperatures, those that are missing linear in time between their neighbours."""
    known = [(k, Fraction(times[k]), value) for k, value in enumerate(values) if value is not None]
    whole = [value for _, _, value in known[:1]]
    for (a, begin, low), (b, end, high) in itertools.pairwise(known):
        slope = (high - low) / (end - begin)
        whole += [low + slope * (Fraction(times[k]) - begin) for k in range(a + 1, b)]
        whole.append(high)
    return whole
