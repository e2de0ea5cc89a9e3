"""The rows of a temperature record: their entries, times and gaps, and what is wrong with them."""

from __future__ import annotations

import csv
import datetime
import gzip
import io
import itertools
import math
import re
import zlib
from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from exactcreep.model.numbers import InputError, exact_number
from exactcreep.model.reading import text_of

MOST_FAULTS = 20
"""Faults of a file that a message lists; it gives the number of the others."""
FEWEST_REGULAR = 10
"""Rows from which on there is a usual step."""
GAP = 1.5
"""A step longer than this many usual ones (their median) is a gap."""
DECIMAL = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d{1,4})?")
_DATE = re.compile(r"(\d{1,2})([./-])(\d{1,2})\2(\d{4})(?:(?:T| +)(\d{1,2})(:.*))?")
_MISSING = frozenset({"", "-", "--", "na", "n/a", "nan", "nat", "null", "none", "missing", "<na>"})


class Row(NamedTuple):
    """A row of a record, as written."""

    where: str
    time: Any
    temperature: Any


class Reading(NamedTuple):
    """A time, the row that has it first, and the temperatures that rows have at it."""

    row: Row
    moment: Fraction | datetime.datetime
    values: list[Fraction | None]


def lines_of(
    content: bytes, file: str, delimiter: str, most: int
) -> Iterator[tuple[int, list[str]]]:
    """Yield the line number and the fields of every row that is not blank, the header first.

    What is packed may have `most` bytes when it is unpacked.
    """
    if file.lower().endswith(".gz"):
        try:
            with gzip.open(io.BytesIO(content)) as stream:
                content = stream.read(most + 1)
        except (OSError, EOFError, zlib.error):
            raise InputError("file", file, "must be packed by gzip, as its name says") from None
        if len(content) > most:
            allowed = f"must have at most {most // 2**20} MiB when it is unpacked"
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


def listed(values: Any, name: str) -> list[Any]:
    """Return the entries of an array, dates as `datetime.datetime`."""
    array = np.asarray(values)
    if array.ndim != 1:
        raise InputError(name, array.shape, "must have one dimension")
    if array.dtype.kind == "M":
        array = array.astype("datetime64[us]")
    listed: list[Any] = array.tolist()
    return listed


def is_missing(entry: Any) -> bool:
    """Return whether an entry stands for no value."""
    return str(entry).strip().lower() in _MISSING


def moment_of(entry: Any, order: str) -> Fraction | datetime.datetime:
    """Return a time: a number exactly, or a date; raise `ValueError` for anything else."""
    if isinstance(entry, datetime.datetime):
        return entry
    if not isinstance(entry, str) or DECIMAL.fullmatch(entry):
        return exact_number(entry, "time")
    if order == "iso":
        return datetime.datetime.fromisoformat(entry)
    parts = _DATE.fullmatch(entry)
    if parts is None:
        raise ValueError("no such date")
    day, month = (parts[1], parts[3]) if order == "day first" else (parts[3], parts[1])
    clock = "" if parts[5] is None else f"T{parts[5]:0>2}{parts[6]}"
    return datetime.datetime.fromisoformat(f"{parts[4]}-{month:0>2}-{day:0>2}{clock}")


def kind_of_time(moment: Fraction | datetime.datetime) -> str:
    """Return which times can be compared with this one."""
    if isinstance(moment, Fraction):
        return "number"
    return "date" if moment.tzinfo is None else "date of a zone"


def one_of(values: list[Fraction | None], policy: str) -> Fraction | None:
    """Return the temperature of a time from those of its rows, as `duplicates` says."""
    known = [value for value in values if value is not None]
    if not known:
        return None
    if policy == "mean":
        return sum(known, Fraction(0)) / len(known)
    return known[-1] if policy == "last" else known[0]


def gaps_in(times: Sequence[float]) -> tuple[float, list[int]]:
    """Return the usual step, and the rows that follow a gap."""
    if len(times) < FEWEST_REGULAR:
        return math.inf, []
    steps = np.diff(times)
    usual = float(np.median(steps))
    return usual, (np.flatnonzero(steps > GAP * usual) + 1).tolist()


def filled(values: Sequence[Fraction | None], times: Sequence[float]) -> list[Fraction]:
    """Return temperatures, those that are missing linear in time between their neighbours."""
    known = [k for k, value in enumerate(values) if value is not None]
    whole = [Fraction(0) if value is None else value for value in values]
    for a, b in itertools.pairwise(known):
        for k in range(a + 1, b):
            share = (Fraction(times[k]) - Fraction(times[a])) / (
                Fraction(times[b]) - Fraction(times[a])
            )
            whole[k] = whole[a] + share * (whole[b] - whole[a])
    return whole


def refuse(faults: Sequence[InputError]) -> None:
    """Raise one `InputError` that lists all faults; beyond `MOST_FAULTS`, their number."""
    if not faults:
        return
    first, *others = faults
    told = "".join(f"; {fault}" for fault in others[: MOST_FAULTS - 1])
    more = len(faults) - MOST_FAULTS
    rest = f"; and {more} more" if more > 0 else ""
    raise InputError(first.field, first.value, f"{first.allowed}{told}{rest}")
