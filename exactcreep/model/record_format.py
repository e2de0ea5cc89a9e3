"""Read a file of temperatures as a table of text, and guess its format."""

from __future__ import annotations

import csv
import io
import re
import warnings
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from exactcreep.model.numbers import InputError
from exactcreep.model.readings import HOTTEST, LIKE_KELVIN
from exactcreep.model.user_files import content_of, refused, unpacked

if TYPE_CHECKING:
    from pandas import DataFrame, Series

MOST_BYTES = 64 * 2**20
"""Largest size of a record, unpacked."""
MOST_ROWS = 1_000_000
"""Most rows of a record: a century of hours."""
_MOST_CELLS, _MOST_COLUMNS, _LONGEST_ROW = 20_000_000, 200, 20_000
_SAMPLE, _LOOKED_AT = 10_000, 8000  # rows that identify columns, characters for the delimiter
_GUESSED = 24  # dates that are looked at for their format; midnight alone may not tell it
_ENOUGH = 0.9  # fraction of numbers in a column of numbers
_NUMBERED_DATES = {8: "%Y%m%d", 10: "%Y%m%d%H", 12: "%Y%m%d%H%M"}
_REMARKS = re.compile(r"\A\ufeff?(#.*\n|\s*\n)*")
"""What may stand above a table: a mark of its encoding, and lines that begin with #."""
_LOW, _HIGH = r"min|low|tief|(^|_)tn", r"max|high|hoch|(^|_)tx"
_TEMPERATURE = r"temp|^t$|(^|_)t[amt]|celsius|deg"
_USUAL = {
    "delimiter": ",", "decimal": ".", "date_format": "", "encoding": "utf-8",
    "time_column": "time", "temperature_column": "temperature",
}  # fmt: skip


def table_of(
    path: Path, *, delimiter: str, encoding: str, rows: int | None = None
) -> tuple[DataFrame, bytes]:
    """Return a CSV file as a table of text, and its content.

    If the first row has a number, the columns are called 1, 2, ... Raises `InputError` if the file
    is too large, or not a table.
    """
    shown, pandas = str(path), import_module("pandas")
    content = content_of(path, "file", MOST_BYTES)
    try:
        text = _REMARKS.sub("", unpacked(content, "file", shown, MOST_BYTES).decode(encoding))
    except (LookupError, TypeError, UnicodeError) as error:
        allowed = f"does not read {shown}: {error}; many a file is latin-1"
        raise InputError("encoding", encoding, allowed) from None
    with refused("file", shown, f"must be a CSV file with delimiter = {delimiter!r}"):
        begin = next(filter(str.strip, text[:_LONGEST_ROW].splitlines()), "")
        (first,) = csv.reader([begin], delimiter=delimiter, skipinitialspace=True)
        if len(first) > _MOST_COLUMNS or len(begin) == _LONGEST_ROW:
            raise ValueError(f"its first row has more than {_MOST_COLUMNS} columns, or no end")
        if text.count(delimiter) > _MOST_CELLS:
            raise ValueError(f"it must have at most {_MOST_CELLS} entries")
        named = not any(re.fullmatch(r"\s*[+-]?(\d+[.,]?\d*|[.,]\d+)\s*", cell) for cell in first)
        names = [cell.strip() if named else str(k) for k, cell in enumerate(first, 1)]
        with warnings.catch_warnings(action="error", category=pandas.errors.ParserWarning):
            try:
                table = pandas.read_csv(
                    io.StringIO(text), sep=delimiter, dtype=str, header=0 if named else None,
                    names=names, index_col=False, nrows=rows or MOST_ROWS + 1,
                    skipinitialspace=True,
                )  # fmt: skip
            except (pandas.errors.ParserWarning, pandas.errors.ParserError) as error:
                told = "a row has more entries than the first one, which must name the columns"
                raise ValueError(f"{told}: delete the lines above it") from error
        if not 1 <= len(table) <= MOST_ROWS:
            raise ValueError(f"it must have at least one row of data, and at most {MOST_ROWS}")
    return table, content


class RecordFormat(NamedTuple):
    """A file's format: arguments of `TemperatureRecord`, and doubts about some of them."""

    options: dict[str, Any]
    doubts: dict[str, str]


def guessed(path: Path) -> RecordFormat:
    """Return the probable format of a CSV file; `InputError` names the option that is needed."""
    shown, doubts = str(path), dict[str, str]()
    data = unpacked(content_of(path, "file", MOST_BYTES), "file", shown, MOST_BYTES)
    try:
        text, encoding = data.decode(), "utf-8"
    except UnicodeDecodeError:
        text, encoding = data.decode("latin-1"), "latin-1"
    text = _REMARKS.sub("", text)
    if "\0" in text[:_LOOKED_AT] or not text.strip():
        raise InputError("file", shown, "must hold a table as text: save a spreadsheet as CSV")
    begin = text[:_LOOKED_AT].rpartition("\n")[0] or text[:_LOOKED_AT]  # of whole rows
    sniffer = csv.Sniffer()
    sniffer.preferred = [";", "\t", "|", ",", " "]
    try:
        delimiter = sniffer.sniff(begin, "".join(sniffer.preferred)).delimiter
    except csv.Error:
        allowed = "is not found: nothing separates the columns of every row in the same way"
        raise InputError("delimiter", shown, allowed) from None
    table, _ = table_of(path, delimiter=delimiter, encoding=encoding, rows=_SAMPLE)
    readable = {decimal: _numbers(table, decimal) for decimal in (".", ",") if decimal != delimiter}
    decimal = max(readable, key=lambda sign: len(readable[sign].columns))
    values = readable[decimal]
    time, written = _times(table, values, shown, doubts)
    values = values.drop(columns=time, errors="ignore")
    values = values.loc[:, values.nunique() > min(1, len(table) - 1)]  # not the number of a station
    if values.empty:
        among = f"numbers with decimal = {decimal!r} in one of {', '.join(table.columns)}"
        raise InputError("temperature_column", shown, f"is not found: there are no {among}")
    guesses = {"delimiter": delimiter, "decimal": decimal, "date_format": written}
    guesses |= {"encoding": encoding, "time_column": time} | _temperatures(values, doubts)
    options = {name: value for name, value in guesses.items() if _USUAL.get(name) != value}
    return RecordFormat(options, {name: doubts[name] for name in doubts if name in options})


def _numbers(table: DataFrame, decimal: str) -> DataFrame:
    """Return the columns of numbers with a decimal sign; other entries are nan."""
    pandas, known = import_module("pandas"), table
    if decimal == ",":  # no dots between thousands
        known = table.apply(lambda column: column.str.replace(".", " ").str.replace(",", "."))
    values = known.apply(pandas.to_numeric, errors="coerce")
    return values.loc[:, values.notna().sum() >= np.maximum(_ENOUGH * table.notna().sum(), 1)]


def _times(
    table: DataFrame, values: DataFrame, shown: str, doubts: dict[str, str]
) -> tuple[str, str]:
    """Return the first column of dates, else of increasing numbers, and its format."""
    for name in table:
        if formats := _date_formats(table[name], number=name in values):
            if table[name].duplicated().mean() > 0.5:
                allowed = "has every date several times: write date and time of day in one column"
                raise InputError(str(name), table[name].iloc[0], f"{allowed} (in {shown})")
            if len(formats) > 1:
                doubts["date_format"] = f"or {formats[1]}: both fit every row"
            return str(name), formats[0]
    for name in values:
        if values[name].is_monotonic_increasing and values[name].is_unique:
            return str(name), ""
    allowed = "is not found: no column has dates, or numbers that increase"
    raise InputError("time_column", shown, f"{allowed}; the first row must name the columns")


def _date_formats(texts: Series, *, number: bool) -> list[str]:
    """Return possible formats of dates, the one with the most even steps first; "" is ISO 8601."""
    pandas, first, steps = import_module("pandas"), str(texts.iloc[0]), dict[str, int]()
    guess = import_module("pandas.tseries.api").guess_datetime_format
    with warnings.catch_warnings(action="ignore"):  # both ways are tried
        some = texts.dropna().iloc[:_GUESSED]
        found = [guess(text, dayfirst=way) for text in some for way in (True, False)]
    formats = dict.fromkeys([_NUMBERED_DATES.get(len(first))] if number else ["ISO8601", *found])
    for written in filter(None, formats):
        dates = pandas.to_datetime(texts, format=written, errors="coerce", utc=True)
        if dates.notna().all():
            steps["" if written == "ISO8601" else written] = dates.diff().nunique()
    least = min(steps.values(), default=0)
    return [""] if "" in steps else [written for written in steps if steps[written] == least]


def _temperatures(values: DataFrame, doubts: dict[str, str]) -> dict[str, Any]:
    """Return the columns of temperatures, their unit and scale."""
    low, high, named = (
        [str(name) for name in values if re.search(pattern, str(name).lower())]
        for pattern in (_LOW, _HIGH, _TEMPERATURE)
    )
    first, *others = named or map(str, values)
    options: dict[str, Any] = {"temperature_column": first}
    if low and high:
        options = {"minimum_column": low[0], "maximum_column": high[0]}
    elif others:
        doubts["temperature_column"] = f"or {', '.join(others)}"
    known = values[[*options.values()]].to_numpy()
    least, most = np.nanquantile(known, (0.01, 0.99))
    if LIKE_KELVIN[0] < least and most < LIKE_KELVIN[1]:
        options["unit"] = "K"
    elif most > HOTTEST and (known == known.round())[np.isfinite(known)].all():
        options["scale"] = 0.1
        doubts["scale"] = f"whole numbers up to {np.nanmax(known):g} are taken for tenths"
    return options
