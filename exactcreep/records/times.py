"""Find the columns of times, and read them: dates in one or several columns, or plain numbers."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.numbers import InputError
from exactcreep.records.dates import (
    FIRST_YEAR,
    LAST_YEAR,
    Moments,
    clock_formats_of,
    formats_of,
    moments_of,
)
from exactcreep.records.table import RECIPE, SAMPLE, CellError, Table, printable
from exactcreep.records.words import EPOCH, is_temperature, is_time, part_of

GAP = 1.5
"""A step longer than this many usual steps is a gap."""
FEWEST = 10  # readings for a usual step
_PROBES = 40  # cells whose formats are looked for
_LIKE = "e.g. 2024-01-31T13:00; date_format says how it is written, e.g. %d.%m.%Y %H:%M"
_LIKE += f"; a clock without a date, or days and seconds of a program: {RECIPE}"


class Times(NamedTuple):
    """The time of each row: dates (in UTC if they have a time zone), or floats.

    `columns`, `date_format`: options that read them; `written`: as written.
    """

    columns: tuple[str, ...]
    date_format: str
    values: NDArray[np.float64]
    dated: bool
    written: list[str]


def newest_first(values: NDArray[np.float64]) -> bool:
    """Return whether times decrease from row to row."""
    return len(values) > 1 and bool((np.diff(values) < 0).all())


def usual_step(steps: NDArray[np.float64]) -> float:
    """Return the step that nine in ten do not exceed; inf if there are few readings."""
    steps = steps[np.isfinite(steps)]
    few = len(steps) < FEWEST - 1
    return np.inf if few else float(np.quantile(steps, 0.9, method="lower"))


def _even(seconds: NDArray[np.float64]) -> bool:
    """Return whether times increase, or decrease, without a gap."""
    steps = np.diff(seconds if seconds[-1] > seconds[0] else seconds[::-1])
    return bool(len(steps) >= FEWEST - 1 and steps.min() > 0
                and steps.max() <= GAP * usual_step(steps))  # fmt: skip


def times_of(table: Table, given: Sequence[str], date_format: str) -> Times:
    """Return the times of a table; columns and format are found if they are not given."""
    if len(given) == 1 and "," in given[0] and printable(given[0]) not in table.names:
        given = given[0].split(",")
    if given:
        places = [table.column(name, "time_column") for name in given]
    else:
        places = _columns_of(table, date_format)
    cells, names = table.cells(places), [table.names[k] for k in places]
    written = [" ".join(row) for row in zip(*cells, strict=True)] if len(cells) > 1 else cells[0]
    if len(places) == 1:
        return _single(table, names, cells[0], date_format)
    values, found = _joined(table, names, cells, date_format)
    return Times(tuple(names), found, values, True, written)


# --- which columns -------------------------------------------------------------------------------


def _probes(cells: Sequence[str]) -> list[str]:
    """Return cells from both ends and from between."""
    known = [cell for cell in cells if cell]
    step = max(1, len(known) // _PROBES)
    return [*dict.fromkeys([*known[:9], *known[::step], *known[-9:]])]


def _formats(
    cells: Sequence[str], *, digits: bool, of: Callable[..., Iterator[str]] = formats_of
) -> list[str]:
    """Return the formats of dates, or of times of day, that fit every probed cell."""
    first, *others = _probes(cells) or [""]
    found = list(dict.fromkeys(of(first, digits=digits)))
    return [each for each in found if np.isfinite(moments_of([first, *others], each).seconds).all()]


def _clock_formats(cells: Sequence[str], *, digits: bool) -> list[str]:
    return _formats(cells, digits=digits, of=clock_formats_of)


def _numbers(cells: Sequence[str]) -> NDArray[np.float64]:
    """Return the numbers in cells, nan where there is none."""
    out = np.full(len(cells), np.nan)
    for k, cell in enumerate(cells):
        if re.fullmatch(r"[+-]?\d{1,20}([.,]\d{1,20})?([eE][+-]?\d{1,3})?", cell):
            out[k] = float(cell.replace(",", "."))
    return out


def _columns_of(table: Table, date_format: str) -> list[int]:
    """Return the columns of times, or refuse with the name of the option that is needed."""
    cells, names = table.sample, table.names
    titled = [f"{a} {b}" if table.named else "" for a, b in zip(names, table.about, strict=True)]
    dates = {}
    for k, column in enumerate(cells):
        digits = is_time(titled[k]) or not table.named
        formats = _formats(column, digits=digits)
        if not table.named and _probes(column)[:1] and column[0].isdigit() and len(column[0]) < 8:
            formats = []
        if formats and (not is_temperature(names[k]) or is_time(titled[k])):
            dates[k] = formats
    if date_format:
        for k, column in enumerate(cells):
            probes = _probes(column)
            if probes and np.isfinite(moments_of(probes, date_format).seconds).mean() > 0.5:
                dates[k] = [date_format]
    said = [k for k in dates if is_time(titled[k])] or [k for k in dates if table.named is False]
    said = said or ([*dates] if len(dates) == 1 else [])
    if len(dates) > 1 and not said:
        raise _unfound(table, "several columns hold dates")
    whole = [k for k in said if _has_clock(table.sample[k], dates[k])]
    if whole:
        universal = [k for k in whole if re.search(r"utc|gmt", names[k], re.I)]
        return [(universal or whole)[0]]
    if said:
        return [said[0], *_clock_columns(table, said[0])]
    parts = [k for code in "Ymdj" for k in range(len(names)) if part_of(names[k], code)
             and np.isfinite(_numbers(_probes(cells[k]))).all()]  # fmt: skip
    if parts and part_of(names[parts[0]], "Y"):
        return _calendar(table)
    for k, name in enumerate(names):
        if EPOCH.match("_".join(name.lower().split())) and _epoch(_numbers(_probes(cells[k]))):
            return [k]
    numbered = [k for k, name in enumerate(names) if is_time(name) and table.named
                and not (is_temperature(name) and len(names) == 2 and k)
                and any(newest_first(sign * _numbers(cells[k])) for sign in (1, -1))]  # fmt: skip
    if numbered:
        return numbered[:1]
    nearly = [k for k, name in enumerate(names) if table.named and is_time(name)]
    if not nearly:
        raise _unfound(table, "no column has dates" if table.named else "the file names no columns")
    return nearly[:1]


def _has_clock(cells: Sequence[str], formats: Sequence[str]) -> bool:
    """Return whether dates have a time of day."""
    if formats == [""]:
        return any(":" in cell for cell in _probes(cells))
    return any(code in written for written in formats for code in ("%H", "%I", "%s"))


def _epoch(numbers: NDArray[np.float64]) -> bool:
    """Return whether numbers may be seconds or milliseconds since 1970."""
    low, high = 1e8, 2.6e9  # to the year 2052
    inside = [((numbers > k * low) & (numbers < k * high)).all() for k in (1, 1000)]
    return len(numbers) > 0 and any(inside)


def _clock_columns(table: Table, date: int) -> list[int]:
    """Return the columns of the time of day beside a column of dates."""
    places = _places(table, "HMS", date)
    return [*places.values()] if "H" in places else []


def _places(table: Table, codes: str, date: int = -1) -> dict[str, int]:
    """Return the columns of parts of a date by their names; without names, a clock by its signs."""
    places: dict[str, int] = {}
    for code in codes:
        for k, name in enumerate(table.names):
            probes = _probes(table.sample[k])
            if k == date or k in places.values() or not probes:
                continue
            if not (part_of(name, code) if table.named else code == "H" and ":" in probes[0]):
                continue
            if code in "HMS" and (is_temperature(name) or (code != "H" and len(name.split()) > 1)):
                continue
            clock, numbers = code == "H" and _clock_formats(probes, digits=False), _numbers(probes)
            if clock or (np.isfinite(numbers).all() and _in_range(code, numbers)):
                places[code] = k
                break
    return places


def _calendar(table: Table) -> list[int]:
    """Return the columns of year, month, day, hour, ... by their names."""
    places = _places(table, "YmdjHMS")
    if "m" not in places and "j" not in places:  # the day of a year may be called day
        days = [k for k, name in enumerate(table.names) if part_of(name, "d")
                and _in_range("j", _numbers(_probes(table.sample[k])))]  # fmt: skip
        places |= {"d": days[0]} if days else {}
    if not {"m", "j", "d"} & places.keys():
        raise _unfound(table, f"there is a year without a month; months side by side: {RECIPE}")
    if "m" in places and "j" in places:
        del places["j"]
    if "j" in places and "d" in places:
        del places["d"]
    return [*places.values()]


_MOST = {"Y": LAST_YEAR, "m": 12, "d": 31, "j": 366, "H": 2400, "M": 60, "S": 60}


def _in_range(code: str, numbers: NDArray[np.float64]) -> bool:
    least = {"Y": FIRST_YEAR, "m": 1, "d": 1, "j": 1}.get(code, 0)
    return bool((numbers >= least).all() and (numbers <= _MOST[code]).all())


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


def _single(table: Table, names: list[str], cells: list[str], date_format: str) -> Times:
    """Return the times of one column."""
    (name,) = names
    for k, cell in enumerate(cells):
        if not cell:
            raise table.refused(name, cell, k, "is missing; leave such rows out")
    numbers = _numbers(cells[:_PROBES])
    digits = is_time(name) or not table.named
    epoch = EPOCH.match("_".join(name.lower().split())) is not None and _epoch(numbers)
    formats = [date_format] if date_format else []
    if not formats:
        formats = _formats(cells, digits=digits) or (["%s"] if epoch else [])
    if not formats and np.isfinite(numbers).mean() > 0.5:
        if _epoch(numbers):
            allowed = (
                f'in column {name} may be seconds since 1970: then date_format = "%s" reads them'
            )
            allowed += f" (from line {table.rows[0] + 1} of {table.shown} on)"
            raise CellError("date_format", cells[0], allowed, table.rows[0] + 1)
        if re.match(r"(date|dat|day|tag|datum|datetime|yyyy)", name, re.I):
            raise table.refused(name, cells[0], 0, f"must be a date, {_LIKE}")
        return Times((name,), "", _plain_numbers(table, name, cells), False, cells)
    moments, found = _read(table, name, cells, formats, given=bool(date_format))
    return Times((name,), found, moments.seconds, True, cells)


def _plain_numbers(table: Table, name: str, cells: list[str]) -> NDArray[np.float64]:
    values = _numbers(cells)
    if not np.isfinite(values).all():
        k = int(np.argmin(np.isfinite(values)))
        raise table.refused(name, cells[k], k, "must be a number as above, or a date")
    return values


def _read(
    table: Table, name: str, cells: Sequence[str], formats: Sequence[str], *, given: bool
) -> tuple[Moments, str]:
    """Return the times by the only format that reads all of them, or refuse."""
    if not formats:
        best = [form for probe in _probes(cells)[:9] for form in formats_of(probe, digits=True)]
        formats = [max(best, key=best.count)] if best else ["%Y-%m-%d"]
        if not best:
            raise table.refused(name, cells[0], 0, f"must be a date, {_LIKE}")
    read = {written: moments_of(cells, written) for written in formats}
    whole = {written: found for written, found in read.items() if np.isfinite(found.seconds).all()}
    if not whole:
        written, found = max(read.items(), key=lambda pair: int(np.isfinite(pair[1].seconds).sum()))
        k = int(np.argmin(np.isfinite(found.seconds)))
        like = (
            f"as date_format = {written!r} says"
            if given
            else f"as the others, {written or 'ISO 8601, all with a time zone or none'}"
        )
        allowed = f"must be a date of the years {FIRST_YEAR} to {LAST_YEAR} {like}"
        raise table.refused(name, cells[k], k, allowed)
    different: dict[bytes, str] = {}
    for written, found in whole.items():
        different.setdefault(found.seconds.tobytes(), written)
    if len(different) > 1:
        even = [written for written in different.values() if _even(whole[written].seconds)]
        about = table.about[table.names.index(name)]
        for way, order in (("%d", r"\bdd?\W?mm?\b"), ("%m", r"\bmm?\W?dd?\b")):
            if re.search(order, about, re.I):
                even = [written for written in different.values() if written.startswith(way)]
        if len(even) != 1:
            either = " or ".join(
                f'"{each}" ({_day(whole[each].seconds[0])} to {_day(whole[each].seconds[-1])})'
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


def _joined(
    table: Table, names: list[str], cells: list[list[str]], date_format: str
) -> tuple[NDArray[np.float64], str]:
    """Return the times of several columns: their cells are one text, and their formats one."""
    cells, formats = [_plain(column) for column in cells], [date_format] if date_format else []
    if not re.search("%[HIM]", date_format):
        days = [] if _is_year(cells[0]) else _formats(cells[0], digits=True)
        if days or date_format:
            parts = [[date_format] if date_format else [each or "%Y-%m-%d" for each in days]]
            codes = ["", "H", "M", "S"]
        else:
            parts, codes = [], _codes(table, names, cells)
        for column, name, code in [*zip(cells, names, codes, strict=False)][len(parts) :]:
            fits = _clock_formats(column, digits=True) if code == "H" else [f"%{code}"]
            if not (fits or date_format):
                raise table.refused(name, column[0], 0, "must be a time of day, e.g. 13:00")
            parts.append(fits)
        formats += [" ".join(each) for each in product(*parts)]
    texts = [" ".join(row) for row in zip(*cells, strict=True)]
    moments, written = _read(table, names[0], texts, formats, given=bool(date_format))
    return moments.seconds, written


def _plain(cells: Sequence[str]) -> list[str]:
    """Return numbers without .0, and hours with minutes in four digits: 30 is 0030."""
    whole = {cell: cell.removesuffix(".0") for cell in {*cells}}
    digits = [cell for cell in whole.values() if cell.isdigit()]
    if len(digits) == len(whole) and 366 < max(map(int, digits)) <= 2400:
        whole = {cell: text.zfill(4) for cell, text in whole.items()}
    return [whole[cell] for cell in cells]


def _is_year(cells: Sequence[str]) -> bool:
    return all(re.fullmatch(r"\d{4}", cell) for cell in _probes(cells))


def _codes(table: Table, names: Sequence[str], cells: Sequence[Sequence[str]]) -> list[str]:
    """Return which part of a date each column is, by its name, else in the order of the list."""
    codes = []
    for name in names:
        found = [code for code in "YmdjHMS" if part_of(name, code) and code not in codes]
        codes.append(found[0] if found and table.named else "")
    if "m" not in codes and "j" not in codes:
        codes = ["j" if code == "d" else code for code in codes]
    if not all(codes) or codes[0] != "Y":
        plain = "YmdHMS"
        if len(names) > 1 and _numbers(_probes(cells[1])).max(initial=0) > 12:
            plain = "YjHMS"
        codes = [*plain[: len(names)]]
    return codes
