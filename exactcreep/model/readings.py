"""The readings of a temperature record: entries of a table as exact numbers, or one refusal.

Everything that is wrong with a table is collected and refused at once, each kind of fault with its
first lines, their number, and the option that would mend it.
"""

from __future__ import annotations

import gzip
import io
import itertools
import math
import re
import zlib
from collections.abc import Iterable, Sequence
from datetime import datetime, timedelta
from fractions import Fraction
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from exactcreep.model.numbers import InputError, exact_number, nearest_float
from exactcreep.model.reading import content_of, text_of

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
_EXAMPLES = 3  # lines that a message names; it gives the number of the others
_FEWEST_REGULAR = 10  # readings from which on there is a usual step
_GAP = 1.5  # a step longer than so many usual ones is a gap
_DECIMAL = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d{1,4})?")
_DATE = re.compile(r"(\d{1,2})([./-])(\d{1,2})\2(\d{4})(?:(?:T| +)(\d{1,2})(:.*))?")
_MISSING = frozenset({"", "-", "--", "na", "n/a", "nan", "nat", "null", "none", "missing", "<na>"})


def rows_of(record: TemperatureRecord) -> tuple[Iterable[tuple[Any, ...]], bytes]:
    """Return the rows of a record's CSV file for `read`, and the bytes of the file."""
    file = record.file
    content = packed = content_of(Path(file), "file", MOST_BYTES)
    if file.lower().endswith(".gz"):
        try:
            with gzip.open(io.BytesIO(packed)) as stream:
                content = stream.read(MOST_BYTES + 1)
        except (OSError, EOFError, zlib.error):
            raise InputError("file", file, "must be packed by gzip, as its name says") from None
        if len(content) > MOST_BYTES:
            allowed = f"must have at most {MOST_BYTES // 2**20} MiB when it is unpacked"
            raise InputError("file", file, allowed)
    text = text_of(content, "file", file)
    try:
        table = import_module("pandas").read_csv(
            io.StringIO(text), sep=record.delimiter, header=None, dtype=str,
            keep_default_na=False, skip_blank_lines=False, skipinitialspace=True,
        )  # fmt: skip
    except ValueError as error:
        empty = type(error).__name__ == "EmptyDataError"
        why = "it must begin with a row that names the columns" if empty else str(error).strip()
        raise InputError("file", file, f"must be a CSV file: {why}") from None
    header = [name.strip() for name in table.iloc[0].tolist()]
    places = []
    for field, name in record.columns.items():
        if header.count(name) != 1:
            which = "named once among" if name in header else "one of"
            allowed = f"must be {which} the columns of {file}: {', '.join(header[:12])}"
            line = record.delimiter.join(header)
            signs = [s for s in ";,\t|" if name in (part.strip() for part in line.split(s))]
            allowed += "".join(f'; delimiter = "{s}" separates them' for s in signs[:1])
            raise InputError(field, name, allowed)
        places.append(header.index(name))
    kept = table.iloc[1:][(table.iloc[1:] != "").any(axis="columns")]
    columns = (kept.iloc[:, place].tolist() for place in places)
    return zip((kept.index + 1).tolist(), *columns, strict=True), packed


class _Faults(dict[tuple[str, str, str], list[tuple[Any, int]]]):
    """What is wrong with entries: by column, by what it must be, and by what would mend it."""

    def add(self, column: str, entry: Any, row: int, allowed: str, mend: str = "") -> None:
        """Remember an entry."""
        self.setdefault((column, allowed, mend), []).append((entry, row))

    def refuse(self, counted: str, file: str) -> None:
        """Raise one `InputError` with all of it, if there is anything."""
        said = []
        for (column, allowed, mend), places in self.items():
            rows = ", ".join(str(row) for _, row in places[:_EXAMPLES])
            more = f" and {len(places) - _EXAMPLES} more" if len(places) > _EXAMPLES else ""
            text = f"{allowed} in {counted} {rows}{more}" + (f" ({mend})" if mend else "")
            said.append(InputError(column, places[0][0], text))
        if said:
            allowed = "; ".join([said[0].allowed, *map(str, said[1:])])
            raise InputError(said[0].field, said[0].value, f"{allowed}; of {file}")


def read(
    rows: Iterable[tuple[Any, ...]], record: TemperatureRecord, counted: str
) -> tuple[list[float], list[Fraction], str]:
    """Return times, temperatures, and the date of the first reading ("" if times are numbers).

    Parameters
    ----------
    rows : iterable of tuples
        Number of the row, time, and one temperature, or minimum and maximum, as written.
    record : TemperatureRecord
        With the options.
    counted : {"line", "row"}
        What the numbers count.

    Raises
    ------
    InputError
        With all that is wrong.
    """
    file, faults = record.file or "(arrays)", _Faults()
    time_column, *names = record.columns.values()
    hours = sorted(enumerate(record.hours), key=lambda hour: hour[1])
    moments: list[Any] = []
    given: list[list[Fraction | None]] = []  # temperatures of each moment
    places: list[tuple[Any, int]] = []  # time as written and number of the row of each moment
    for count, (row, time, *entries) in enumerate(rows, start=1):
        if count > MOST_ROWS:
            raise InputError("file", file, f"must have at most {MOST_ROWS} rows")
        try:
            begin = _moment(time, record)
            if begin is None:
                continue
            if moments and _kind(begin) != _kind(moments[0]):
                raise _Fault("must be of the same kind as before")
        except _Fault as fault:
            faults.add(time_column, time, row, *fault.args)
            continue
        for k, hour in hours:
            try:
                value = _temperature(entries[k], record)
            except _Fault as fault:
                faults.add(names[k], entries[k], row, *fault.args)
                continue
            if value is None and record.missing == "drop":
                continue
            at = begin + timedelta(hours=float(hour)) if hour else begin
            if moments and at == moments[-1] and record.duplicates != "refuse":
                given[-1].append(value)
            elif moments and not at > moments[-1]:
                mend = 'duplicates = "first", "last" or "mean" takes one of several'
                mend = mend if at == moments[-1] else ""
                faults.add(time_column, time, row, "must be later than before", mend)
            else:
                moments.append(at)
                given.append([value])
                places.append((time, row))
    if not moments and not faults:
        raise InputError("file", file, "must hold at least one row of data")
    dated = bool(moments) and isinstance(moments[0], datetime)
    seconds = [(at - moments[0]).total_seconds() if dated else nearest_float(at) for at in moments]
    for place, second in zip(places, seconds, strict=True):
        if math.isinf(second):
            faults.add(time_column, *place, "must be below the largest float, 1.8e308,")
    values = [_one_of(several, record.duplicates) for several in given]
    usual, after_gaps = gaps_in(seconds)
    for k in after_gaps if record.gaps == "refuse" else ():
        mend = 'gaps = "interpolate" takes the temperature to be monotone there'
        allowed = f"comes more than {_GAP} usual steps of {usual:g} after the reading before"
        faults.add(time_column, *places[k], allowed, mend)
    for k in {0, len(values) - 1} if values and record.missing == "interpolate" else ():
        if values[k] is None:
            allowed = "of a missing temperature leaves nothing to interpolate between at an end"
            faults.add(time_column, *places[k], allowed)
    faults.refuse(counted, file)
    return seconds, _filled(values, seconds), moments[0].isoformat() if dated else ""


class _Fault(ValueError):
    """An entry that cannot be taken: what it must be, and what would mend that."""


def _is_missing(entry: Any) -> bool:
    return str(entry).strip().lower() in _MISSING


def _moment(entry: Any, record: TemperatureRecord) -> Any:
    """Return a time: a number exactly, or a date; None if it is missing and that is allowed."""
    if _is_missing(entry):
        if record.missing == "drop":
            return None
        raise _Fault("is missing", 'missing = "drop" leaves such rows out')
    entry = _with_point(entry, record.decimal)
    try:
        moment = moment_of(entry, record.date_order)
    except ValueError:
        others = [name for name in DATES if name != record.date_order and is_date(entry, name)]
        mend = " or ".join(f'date_order = "{name}"' for name in others)
        allowed = f"must be a number or a date such as {DATES[record.date_order]}"
        raise _Fault(allowed, f"{mend} reads such dates" if others else "") from None
    dated = isinstance(moment, datetime)
    if not dated and any(record.hours):
        raise _Fault("must be a date, where a row has the minimum and the maximum of a day")
    if dated and not 1700 <= moment.year <= 2200:
        raise _Fault("must be a date of the years 1700 to 2200")
    return moment


def is_date(entry: str, order: str = "iso") -> bool:
    """Return whether a text is a date, written in that order."""
    try:
        return isinstance(moment_of(entry, order), datetime)
    except ValueError:
        return False


def moment_of(entry: Any, order: str) -> Any:
    """Return a time: a number exactly, or a date; raise `ValueError` for anything else."""
    if isinstance(entry, datetime):
        return entry
    if not isinstance(entry, str) or _DECIMAL.fullmatch(entry):
        return exact_number(entry, "time")
    if order == "iso":
        return datetime.fromisoformat(entry)
    parts = _DATE.fullmatch(entry)
    if parts is None:
        raise ValueError("no such date")
    day, month = (parts[1], parts[3]) if order == "day first" else (parts[3], parts[1])
    clock = "" if parts[5] is None else f"T{parts[5]:0>2}{parts[6]}"
    return datetime.fromisoformat(f"{parts[4]}-{month:0>2}-{day:0>2}{clock}")


def _kind(moment: Any) -> tuple[bool, bool]:
    """Return which times can be compared: numbers, dates, and dates of a time zone."""
    return isinstance(moment, datetime), getattr(moment, "tzinfo", None) is None


def _temperature(entry: Any, record: TemperatureRecord) -> Fraction | None:
    """Return a temperature exactly; None if it is missing and that is allowed."""
    if _is_missing(entry):
        if record.missing == "refuse":
            mend = 'missing = "drop" leaves such readings out, "interpolate" is linear in time'
            raise _Fault("is missing", mend)
        return None
    entry = _with_point(entry, record.decimal)
    if isinstance(entry, str) and not _DECIMAL.fullmatch(entry):
        comma = record.decimal == "." and _with_point(entry, ",") != entry
        allowed = f"must be a number with a decimal {'point' if record.decimal == '.' else 'comma'}"
        raise _Fault(allowed, 'decimal = "," reads decimal commas' if comma else "")
    value = _scaled(entry, record.scale)
    if value < ABSOLUTE_ZERO[record.unit]:
        raise _Fault("must not be below absolute zero")
    return value


@lru_cache(maxsize=4096)
def _scaled(entry: Any, scale: Fraction) -> Fraction:
    return exact_number(entry, "temperature") * scale


def _with_point(entry: Any, decimal: str) -> Any:
    """Return a text without blanks and with a decimal point, if it is a number."""
    if not isinstance(entry, str):
        return entry
    text = entry.strip()
    swapped = text if decimal == "." or "." in text else text.replace(",", ".", 1)
    return swapped if _DECIMAL.fullmatch(swapped) else text


def _one_of(values: list[Fraction | None], which: str) -> Fraction | None:
    """Return the temperature of a time from those of its rows, as `duplicates` says."""
    known = [value for value in values if value is not None]
    if known and which == "mean":
        return sum(known, Fraction(0)) / len(known)
    return known[-1 if which == "last" else 0] if known else None


def gaps_in(times: Sequence[float]) -> tuple[float, list[int]]:
    """Return the longest usual step, and the readings that follow a longer one, a gap.

    Usual is what at least one step in ten is as long as, so that readings at uneven hours (at 7,
    14 and 21 o'clock, or of the minimum and the maximum of a day) have no gap every night.
    """
    if len(times) < _FEWEST_REGULAR:
        return math.inf, []
    steps = np.diff(times)
    usual = float(np.quantile(steps, 0.9, method="lower"))
    return usual, (np.flatnonzero(steps > _GAP * usual) + 1).tolist()


def _filled(values: Sequence[Fraction | None], times: Sequence[float]) -> list[Fraction]:
    """Return temperatures, those that are missing linear in time between their neighbours."""
    known = [k for k, value in enumerate(values) if value is not None]
    whole = [value for value in values if value is not None]
    if len(whole) == len(values):
        return whole
    exact = [Fraction(time) for time in times]
    for a, b in itertools.pairwise(known):
        low, high = (Fraction(values[k]) for k in (a, b))  # type: ignore[arg-type]
        slope = (high - low) / (exact[b] - exact[a])
        whole[a + 1 : a + 1] = [low + slope * (exact[k] - exact[a]) for k in range(a + 1, b)]
    return whole
