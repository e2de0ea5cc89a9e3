"""Find the columns of times, and read them: dates in one or several columns, or plain numbers."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.numbers import InputError
from exactcreep.records.dates import (
    CLOCKS,
    FIRST_YEAR,
    LAST_YEAR,
    formats_of,
    moments_of,
)
from exactcreep.records.table import RECIPE, SAMPLE, CellError, Table, printable
from exactcreep.records.words import EPOCH, is_temperature, is_time, part_of

GAP = 1.5
"""A step longer than this many usual steps is a gap."""
FEWEST = 10  # readings for a usual step
_PROBES = 40  # cells whose formats are looked for
_RANGES = {"Y": (FIRST_YEAR, LAST_YEAR), "m": (1, 12), "d": (1, 31), "j": (1, 366), "H": (0, 2400),
           "M": (0, 59), "S": (0, 59)}  # fmt: skip
_LIKE = "e.g. 2024-01-31T13:00; date_format says how it is written, e.g. %d.%m.%Y %H:%M"
_LIKE += f"; a clock without a date, or days and seconds of a program: {RECIPE}"
Floats = NDArray[np.float64]


class Times(NamedTuple):
    """The time of each row: dates (in UTC if they have a time zone), or floats.

    `columns`, `date_format`: options that read them; `written`: as written.
    """

    columns: tuple[str, ...]
    date_format: str
    values: Floats
    dated: bool
    written: list[str]


def newest_first(values: Floats) -> bool:
    """Return whether times decrease from row to row."""
    return len(values) > 1 and bool((np.diff(values) < 0).all())


def usual_step(steps: Floats) -> float:
    """Return the step that nine in ten do not exceed; inf if there are few readings."""
    steps = steps[np.isfinite(steps)]
    few = len(steps) < FEWEST - 1
    return np.inf if few else float(np.quantile(steps, 0.9, method="lower"))


def _even(seconds: Floats) -> bool:
    """Return whether times increase, or decrease, without a gap."""
    steps = np.diff(seconds if seconds[-1] > seconds[0] else seconds[::-1])
    return bool(len(steps) >= FEWEST - 1 and steps.min() > 0
                and steps.max() <= GAP * usual_step(steps))  # fmt: skip


def times_of(table: Table, given: Sequence[str], date_format: str) -> Times:
    """Return the times of a table; columns and format are found if they are not given."""
    if len(given) == 1 and "," in given[0] and printable(given[0]) not in table.names:
        given = given[0].split(",")
    places = [table.column(name, "time_column") for name in given]
    places = places or _columns_of(table, date_format)
    cells, names = table.cells(places), tuple(table.names[k] for k in places)
    written = [" ".join(row) for row in zip(*cells, strict=True)]
    for k, cell in enumerate(cells[0]):
        if not cell:
            raise table.refused(names[0], cell, k, "is missing; leave such rows out")
    formats = [date_format]
    if not date_format or (len(names) > 1 and not _has_clock([], formats)):
        formats = _formats_of(table, names, written, date_format)
    if not formats and len(names) == 1 and np.isfinite(_numbers(cells[0][:_PROBES])).mean() > 0.5:
        return Times(names, "", _plain_numbers(table, names[0], cells[0]), False, written)
    values, found = _read(table, names[0], written, formats, given=bool(date_format))
    return Times(names, found, values, True, written)


# --- formats -------------------------------------------------------------------------------------


def _probes(cells: Sequence[str]) -> list[str]:
    """Return cells from both ends and from between."""
    known = [cell for cell in cells if cell]
    step = max(1, len(known) // _PROBES)
    return [*dict.fromkeys([*known[:9], *known[::step], *known[-9:]])]


def _formats(cells: Sequence[str], *, digits: bool, day: str = "", code: str = "m") -> list[str]:
    """Return the formats that fit every probed cell; those that begin with `day` and a blank.

    `code`: "j" if days of the year are preferred to months.
    """
    first, *others = _probes(cells) or [""]
    found = [f"{day} {clock}" for clock in CLOCKS] if day else formats_of(first, digits=digits)
    fits = [each for each in dict.fromkeys(found)
            if np.isfinite(moments_of([first, *others], each)).all()]  # fmt: skip
    return [each for each in fits if ("%j" in each) == (code == "j")] or fits


def _formats_of(table: Table, names: Sequence[str], written: list[str], day: str) -> list[str]:
    """Return the formats that may read these columns, their cells joined by blanks.

    `day`: the format of the first column, if it is given.
    """
    if len(names) > 1:
        said = [code for code in "mj" for name in names if part_of(name, code)]
        return _formats(written, digits=True, day=day, code=said[0] if said else "m")
    found = _formats(written, digits=is_time(names[0]) or not table.named)
    return found or (["%s"] if _epoch(names[0], written) else [])


def _numbers(cells: Sequence[str]) -> Floats:
    """Return the numbers in cells, nan where there is none."""
    out = np.full(len(cells), np.nan)
    for k, cell in enumerate(cells):
        if re.fullmatch(r"[+-]?\d{1,20}([.,]\d{1,20})?([eE][+-]?\d{1,3})?", cell):
            out[k] = float(cell.replace(",", "."))
    return out


def _epoch(name: str, cells: Sequence[str]) -> bool:
    """Return whether a name and numbers may be of seconds or milliseconds since 1970."""
    named = not name or EPOCH.match("_".join(name.lower().split()))
    numbers, (low, high) = _numbers(_probes(cells)), (1e8, 2.6e9)  # to the year 2052
    inside = [((numbers > k * low) & (numbers < k * high)).all() for k in (1, 1000)]
    return bool(named) and len(numbers) > 0 and any(inside)


# --- which columns -------------------------------------------------------------------------------


def _columns_of(table: Table, date_format: str) -> list[int]:
    """Return the columns of times, or refuse with the name of the option that is needed."""
    names, places = table.names, range(len(table.names))
    titled = [f"{a} {b}" if table.named else "" for a, b in zip(names, table.about, strict=True)]
    dates = {k: formats for k in places if (formats := _dates(table, k, titled[k], date_format))}
    said = [k for k in dates if is_time(titled[k]) or not table.named]
    said = said or ([*dates] if len(dates) == 1 else [])
    if len(dates) > 1 and not said:
        raise _unfound(table, "several columns hold dates")
    whole = [k for k in said if _has_clock(table.sample[k], dates[k])]
    if whole:
        universal = [k for k in whole if re.search(r"utc|gmt", names[k], re.I)]
        return [(universal or whole)[0]]
    if said:
        clock = _parts(table, "HMS", said[0])
        return [said[0], *(clock.values() if "H" in clock else ())]
    year = _parts(table, "YmdHMS")
    if "Y" in year:
        year = year if "m" in year else _parts(table, "YjHMS")
        if not {"m", "j"} & {*year}:
            raise _unfound(table, f"there is a year without a month; months side by side: {RECIPE}")
        return [*year.values()]
    timed = [k for k in places if table.named and is_time(names[k])]
    epochs = [k for k in places if _epoch(names[k], table.sample[k])]
    if not (found := [*epochs, *timed]):
        raise _unfound(table, "no column has dates" if table.named else "the file names no columns")
    return found[:1]


def _dates(table: Table, k: int, titled: str, date_format: str) -> list[str]:
    """Return the formats that read a column as dates; [] if it has none."""
    probes = _probes(table.sample[k])
    if date_format and probes and np.isfinite(moments_of(probes, date_format)).mean() > 0.5:
        return [date_format]
    number = not table.named and probes and probes[0].isdigit() and len(probes[0]) < 8
    if number or (is_temperature(table.names[k]) and not is_time(titled)):
        return []
    return _formats(probes, digits=is_time(titled) or not table.named)


def _has_clock(cells: Sequence[str], formats: Sequence[str]) -> bool:
    """Return whether dates have a time of day."""
    if formats == [""]:
        return any(":" in cell for cell in _probes(cells))
    return any(code in written for written in formats for code in ("%H", "%I", "%s"))


def _parts(table: Table, codes: str, date: int = -1) -> dict[str, int]:
    """Return the columns of parts of a date by their names; without names, a clock by its signs."""
    places: dict[str, int] = {}
    for code in codes:
        for k, name in enumerate(table.names):
            probes = _probes(table.sample[k])
            if k == date or k in places.values() or not probes or is_temperature(name):
                continue
            if not (part_of(name, code) if table.named else code == "H" and ":" in probes[0]):
                continue
            numbers, (low, high) = _numbers(probes), _RANGES[code]
            clock = code == "H" and [*formats_of(f"2000-01-01 {probes[0]}", digits=True)]
            if clock or ((numbers >= low) & (numbers <= high)).all():
                places[code] = k
                break
    return places


def listed(table: Table, columns: Sequence[int] = ()) -> str:
    """Return columns with the ranges of their numbers, or their first cells, in one line."""
    told = []
    for k in (columns or range(len(table.names)))[:24]:
        cells = _probes(table.sample[k])
        numbers = _numbers([cell.replace("−", "-") for cell in table.sample[k] if cell])
        known = numbers[np.isfinite(numbers)]
        about = printable(cells[0])[:24] if cells else "empty"
        if len(known) > len(numbers) / 2:
            about = f"{known.min():.10g} to {known.max():.10g}"
        told.append(f"{table.names[k]} ({about})")
    part = len(table.rows) > SAMPLE
    return ", ".join(told) + f"; numbers of the first {SAMPLE} lines" * part


def _unfound(table: Table, why: str) -> InputError:
    also = "" if table.named else " (and temperature_column)"
    allowed = f"is missing: {why} (in {table.shown}); name the column{also}, or a list such as"
    allowed += f" date,hour or year,month,day,hour; line {table.rows[0] + 1} begins the table,"
    allowed += f" and its columns are {listed(table)}"
    return CellError("time_column", None, allowed, table.rows[0] + 1)


# --- reading -------------------------------------------------------------------------------------


def _plain_numbers(table: Table, name: str, cells: list[str]) -> Floats:
    """Return times that are numbers, unless they may be dates."""
    row = table.rows[0] + 1
    if _epoch("", cells[:_PROBES]):
        allowed = f'in column {name} may be seconds since 1970: then date_format = "%s" reads them'
        raise CellError("date_format", cells[0], f"{allowed} (from line {row} of {table.shown} on)",
                        row)  # fmt: skip
    if re.match(r"(date|dat|day|tag|datum|datetime|yyyy)", name, re.I):
        raise table.refused(name, cells[0], 0, f"must be a date, {_LIKE}")
    values = _numbers(cells)
    if not np.isfinite(values).all():
        k = int(np.argmin(np.isfinite(values)))
        raise table.refused(name, cells[k], k, "must be a number as above, or a date")
    return values


def _read(
    table: Table, name: str, cells: Sequence[str], formats: Sequence[str], *, given: bool
) -> tuple[Floats, str]:
    """Return the times by the only format that reads all of them, or refuse."""
    if not formats:
        best = [form for probe in _probes(cells)[:9] for form in formats_of(probe, digits=True)]
        if not best:
            raise table.refused(name, cells[0], 0, f"must be a date, {_LIKE}")
        formats = [max(best, key=best.count)]
    read = {written: moments_of(cells, written) for written in formats}
    whole = {written: found for written, found in read.items() if np.isfinite(found).all()}
    if not whole:
        written, found = max(read.items(), key=lambda pair: int(np.isfinite(pair[1]).sum()))
        k = int(np.argmin(np.isfinite(found)))
        others = f"the others, {written or 'ISO 8601, all with a time zone or none'}"
        like = f"as date_format = {written!r} says" if given else f"as {others}"
        allowed = f"must be a date of the years {FIRST_YEAR} to {LAST_YEAR} {like}"
        raise table.refused(name, cells[k], k, allowed)
    different: dict[bytes, str] = {}
    for written, found in whole.items():
        different.setdefault(found.tobytes(), written)
    if len(different) > 1:
        even = [written for written in different.values() if _even(whole[written])]
        if len(even) != 1:
            either = " or ".join(
                f'"{each}" ({_day(whole[each][0])} to {_day(whole[each][-1])})'
                for each in (even or [*different.values()])[:3]
            )
            row, column = table.rows[0] + 1, table.names.index(name) + 1
            allowed = f"may be {either}: every row of column {name} fits; name one of them (from"
            allowed += f" line {row} of {table.shown} on)"
            raise CellError("date_format", cells[0], allowed, row, column)
        return whole[even[0]], even[0]
    (written,) = different.values()
    return whole[written], written


def _day(seconds: float) -> str:
    return str(np.datetime64(int(seconds), "s"))[:10]
