"""Choose the columns of temperatures by their names; find their unit, scale and decimal sign."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from exactcreep.model.numbers import InputError
from exactcreep.records.dates import DAY
from exactcreep.records.table import MISSING, RECIPE, CellError, Table, kind
from exactcreep.records.times import Times, listed
from exactcreep.records.words import (
    is_less,
    is_neutral,
    is_temperature,
    scale_of,
    statistic_of,
    told_above,
    unit_of,
)

_SUFFIX = re.compile(r"(.*?)\s*(°\s?[CFK]?|℃|℉|º\s?[CF]|deg\s?[CF]|[CFKs])$", re.I)
"""A unit behind a number, or the s by which a service marks a suspect one."""
_ISD = re.compile(r"[+-]\d{4},[0-9A-Z]")
_TENTHS_OF = ({"staid", "souid"}, {"stn", "yyyymmdd"})
"""Columns of services that write temperatures in tenths: ECA&D, KNMI."""
_AMERICAN = re.compile(r"TMAX|TMIN|TAVG|TOBS|\w*DryBulbTemperature", re.I)
_WHOLE = re.compile(r"[+-]?\d+[a-z]?|M|T|\*|", re.I)
_US_UNITS = re.compile(
    r"in\s?hg|[(\[]\s*in(ch(es)?)?\.?\s*[)\]]|inches|imperial|english units", re.I
)


class Temperatures(NamedTuple):
    """The columns of temperatures, how their cells are read, and the cells."""

    options: dict[str, str]
    unit: str
    scale: Fraction
    decimal: str
    cells: list[list[str]]


def temperatures_of(table: Table, times: Times, given: Mapping[str, Any]) -> Temperatures:
    """Return the temperatures of a table; what is not given is found, or refused by its option."""
    if given["minimum_column"] or given["maximum_column"]:
        columns = {name: given[name] for name in ("minimum_column", "maximum_column")}
    elif given["temperature_column"]:
        columns = {"temperature_column": given["temperature_column"]}
    else:
        columns = _chosen(table, times)
    places = {name: table.column(column, name) for name, column in columns.items()}
    options = {name: table.names[k] for name, k in places.items()}
    cells = table.cells([*places.values()])
    unit, scale = _unit(table, places, cells, given)
    if any(each and all(_ISD.fullmatch(cell) for cell in each if cell) for each in cells):
        cells = [["" if cell[1:5] == "9999" else cell[:5] for cell in each] for each in cells]
        scale = given["scale"] or Fraction(1, 10)
    cells = [[_bare(cell) for cell in each] for each in cells]
    for k in places.values():
        _check_decimals(table, k)
    decimal = given["decimal"] or _decimal(cells)
    return Temperatures(options, unit, scale, decimal, cells)


def _bare(cell: str) -> str:
    """Return a cell without its unit, and with a plain minus sign."""
    if cell and not (cell[-1].isdigit() or cell[-1] == ".") and (found := _SUFFIX.fullmatch(cell)):
        cell = found[1]
    return "" if MISSING.fullmatch(cell) else cell.replace("−", "-").replace("–", "-")


def _check_decimals(table: Table, k: int) -> None:
    """Refuse whole numbers beside a column without a name that may hold their decimals."""
    beside = table.sample[k + 1] if k + 1 < len(table.names) else []
    if table.named and beside and table.names[k + 1] == str(k + 2):
        digits = all(re.fullmatch(r"\d{0,3}", cell) for cell in beside) and any(beside)
        if digits and not any("." in cell for cell in table.sample[k]):
            row, allowed = table.rows[0] + 1, f"does not read {table.shown}: the column after"
            allowed += f" {table.names[k]} may hold its decimals (from line {row} on); name another"
            raise CellError("delimiter", table.delimiter, allowed, row, k + 1)


def _decimal(cells: Sequence[Sequence[str]]) -> str:
    commas = sum("," in cell for each in cells for cell in each)
    points = sum("." in cell for each in cells for cell in each)
    return "," if commas > points else "."


# --- which columns -------------------------------------------------------------------------------


def _chosen(table: Table, times: Times) -> dict[str, str]:
    """Return the columns of temperatures by option."""
    others = [k for k, name in enumerate(table.names) if name not in times.columns]
    numbers = [k for k in others if _measured(table.sample[k])]
    if not numbers:
        where = [k for k in others if is_temperature(_titled(table, k))] or others
        raise _unsure(table, where, "no column has numbers", "temperature_column")
    if not table.named:
        if len(numbers) == 1 and len(table.names) == 1 + len(times.columns):
            return {"temperature_column": table.names[numbers[0]]}
        raise _unsure(table, numbers, "the file names no columns", "temperature_column")
    found = [k for k in numbers if is_temperature(_titled(table, k))]
    alone = [table.names[k] for k in others if not _unit_in(table, k)]
    if not found and len(numbers) == len(alone) == 1 and is_neutral(alone[0]):
        return {"temperature_column": alone[0]}
    found = [k for k in found if not is_less(_titled(table, k))]
    if not found:
        why, hours = "no name is that of a temperature", len(numbers) in (12, 24)
        why += f"; hours or months side by side: {RECIPE}" if hours else ""
        raise _unsure(table, others, why, "temperature_column")
    kinds = {k: statistic_of(table.names[k]) for k in found}
    plain = [k for k in found if not kinds[k][0]]
    lows = [k for k in found if kinds[k][0] == "min"]
    highs = [k for k in found if kinds[k][0] == "max"]
    if _daily(times):
        pairs = [(a, b) for a in lows for b in highs if kinds[a][1] == kinds[b][1]]
        if len(pairs) == 1:
            low, high = pairs[0]
            return {"minimum_column": table.names[low], "maximum_column": table.names[high]}
        if pairs:
            raise _unsure(table, found, "several pairs may be the day's", "minimum_column")
    if len(single := _same(table, plain or found)) > 1:
        raise _unsure(table, single, "several may be the temperature", "temperature_column")
    return {"temperature_column": table.names[single[0]]}


def _titled(table: Table, k: int) -> str:
    """Return the name of a column with its units, also those in its cells."""
    unit = _unit_after(next((cell for cell in table.sample[k] if cell), ""))
    beside = _unit_in(table, k + 1) if k + 1 < len(table.names) else ""
    return " ".join([table.about[k], *(f"({each})" for each in (unit, beside) if each)])


def _measured(cells: Sequence[str]) -> bool:
    """Return whether a column has numbers in more than half of its cells that are not missing."""
    kinds = [kind(cell) for cell in dict.fromkeys(cells) if cell]
    known = [each for each in kinds if each]
    isd = sum(bool(_ISD.fullmatch(cell)) for cell in cells[:99])
    return 0 < len(known) <= 2 * known.count("n") or isd > 50


def _daily(times: Times) -> bool:
    """Return whether there is one row a day."""
    steps = np.diff(times.values)
    return times.dated and (not len(steps) or abs(float(np.median(steps)) - DAY) < DAY / 10)


def _unit_after(cell: str) -> str:
    """Return the unit behind a number in a cell."""
    found = _SUFFIX.fullmatch(cell) if kind(cell) == "n" else None
    return unit_of(f"({found[2]})") if found else ""


def _unit_in(table: Table, k: int) -> str:
    """Return the unit that every cell of a column names, "CF" if they differ; "" if it has none."""
    named = re.search("unit|einheit|unidad", table.names[k], re.I)
    found = {
        unit_of(f"({cell})" if named else cell) if kind(cell) == "t" else ""
        for cell in {*table.sample[k]}
    }
    return "" if "" in found else max(found) if len(found) == 1 else "CF"


def _same(table: Table, places: Sequence[int]) -> list[int]:
    """Return one of two columns that have the same temperatures, one in each unit."""
    by_unit = {unit_of(_titled(table, k)): k for k in places}
    if len(places) == 2 and {*by_unit} == {"C", "F"}:
        low, high = ([_number(cell) for cell in table.sample[by_unit[unit]]] for unit in "CF")
        off = np.abs(np.array(low) * 1.8 + 32 - np.array(high))
        if len(off) and np.nanmax(off) < 1.2:
            return [by_unit["C"]]
    return [*places]


def _number(cell: str) -> float:
    try:
        return float(_bare(cell).replace(",", "."))
    except ValueError:
        return float("nan")


def _unsure(table: Table, columns: Sequence[int], why: str, option: str) -> InputError:
    row = table.rows[0] + 1
    allowed = f"is missing: {why} (in {table.shown}); name one of the columns (from line {row} on)"
    kinds = {statistic_of(table.names[k])[0] for k in columns}
    beside = " (or as minimum_column and maximum_column):" if {"min", "max"} <= kinds else ":"
    return CellError(option, None, f"{allowed}{beside} {listed(table, columns)}", row)


# --- unit and scale ------------------------------------------------------------------------------


def _unit(
    table: Table,
    places: Mapping[str, int],
    cells: Sequence[Sequence[str]],
    given: Mapping[str, Any],
) -> tuple[str, Fraction]:
    """Return the unit and the scale that words say: in the table, above it, or of a service."""
    said = [f"{table.about[k]}" for k in places.values()]
    inside = {_unit_after(cell) for each in cells for cell in {*each}} - {""}
    beside = {k: unit for k in range(len(table.names)) if (unit := _unit_in(table, k))}
    inside |= {*([beside[k + 1] for k in places.values() if k + 1 in beside] or beside.values())}
    units = {unit_of(text) for text in said} | inside
    units = units - {""} if inside else units
    scales = {scale_of(text) for text in said}
    above = [told_above(table.notes, table.names[k]) for k in places.values()]
    if units == {""}:
        units = {unit_of(text) for text in above}
    if scales == {None}:
        scales = {scale_of(text) for text in above}
    names = {name.lower() for name in table.names}
    if "timestamp_start" in names:  # FLUXNET, whose _F is a value that was filled in
        units = {"C"}
    if scales == {None} and any(each <= names for each in _TENTHS_OF) and _whole(cells):
        scales = {Fraction(1, 10)}
    told = " ".join((*said, *above))
    factor = re.search(r"[x×*]\s*10\b|scale|factor|multipl", told, re.I)
    unsure = ""
    if len(units - {""}) > 1 or any(len(unit) > 1 for unit in units):
        unsure = "the units differ or are several"
    elif len(scales) > 1 or (factor and scales != {None}):
        unsure = "a scale is mentioned"
    elif units == {""} and scales == {None} and not inside:
        american = any(_AMERICAN.fullmatch(table.names[k]) for k in places.values())
        if american and {"STATION", "DATE"} <= {*table.names} and _whole(cells):
            unsure = "this service writes °F, °C or tenths of °C"
        elif any(_US_UNITS.search(text) for text in (*table.about, *table.notes)) or any(
            _inches_of_mercury(name, column)
            for name, column in zip(table.names, table.sample, strict=True)
        ):
            unsure = "other columns are in inches"
    if unsure and not (given["unit"] or given["scale"]):
        allowed = f"is missing: {unsure} (in {table.shown}); unit is C, F or K, and scale = 0.1"
        allowed += " reads tenths;"
        column = listed(table, [*places.values()])
        allowed += f" say one of them for column {column}"
        row = table.rows[0] + 1
        raise CellError("unit", None, f"{allowed}, from line {row} on", row)
    unit = given["unit"] or max(units - {""}, default="")
    scale = given["scale"] or max((each for each in scales if each), default=None)
    kelvin = not unit and any(re.fullmatch(r"t2m|2t", table.names[k]) for k in places.values())
    if kelvin and all(150 < _number(cell) < 400 for cell in {*cells[0][:999]} if cell):
        unit = "K"  # as ERA5 names it; no air is so hot in degrees Celsius
    return unit[:1] or "C", scale or Fraction(1)


def _inches_of_mercury(name: str, cells: Sequence[str]) -> bool:
    """Return whether a column is a pressure in inches: the file is in units of the USA."""
    known = [_number(cell) for cell in cells if cell]
    inches = bool(known) and all(25 < number < 32 for number in known)
    return inches and re.search(r"press|baro?\b|barom|slp|altim", name, re.I) is not None


def _whole(cells: Sequence[Sequence[str]]) -> bool:
    return all(_WHOLE.fullmatch(cell) for each in cells for cell in {*each})
