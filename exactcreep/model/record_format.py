"""Guess how a file of temperatures is written: what separates, what is a date, which columns."""

from __future__ import annotations

import csv
import io
import itertools
import re
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from exactcreep.model.numbers import InputError
from exactcreep.model.temperature_record import HOTTEST, LIKE_KELVIN, MOST_BYTES
from exactcreep.model.user_files import content_of, unpacked

if TYPE_CHECKING:
    from pandas import DataFrame, Series

_DELIMITERS = (";", "\t", "|", ",")
_SAMPLE = 50  # lines by which the delimiter is told
_NUMBER = {".": r"[+-]?(\d+(\.\d*)?|\.\d+)", ",": r"[+-]?(\d+(,\d*)?|,\d+)"}
_MISSING = ("", "-", "nan", "na", "n/a", "null")
_NUMBERED_DATES = {8: "%Y%m%d", 10: "%Y%m%d%H", 12: "%Y%m%d%H%M"}
_LOW, _HIGH = r"min|low|tief|(^|_)tn", r"max|high|hoch|(^|_)tx"
_TEMPERATURE = r"temp|^t$|(^|_)t[am]|celsius|deg"
_MOST_SWAPPED = 0.01  # of days


class RecordFormat(NamedTuple):
    """How a file is written.

    Attributes
    ----------
    options : dict
        Arguments of `TemperatureRecord` that are not its defaults.
    doubts : dict of str to str
        Of some of these: what else they might be.
    """

    options: dict[str, Any]
    doubts: dict[str, str]


def guessed(path: Path) -> RecordFormat:
    """Return how a CSV file of temperatures is probably written.

    Raises
    ------
    InputError
        If it cannot be read, or has no column of times, or none of temperatures; the sentence names
        the option that has to say it.
    """
    doubts = dict[str, str]()
    content = unpacked(content_of(path, "file", MOST_BYTES), "file", str(path), MOST_BYTES)
    text, encoding = _decoded(content)
    delimiter = _delimiter(text, path)
    pandas = import_module("pandas")
    try:
        table = pandas.read_csv(
            io.StringIO(text), sep=delimiter, dtype=str, index_col=False, skipinitialspace=True,
            keep_default_na=False,
        )  # fmt: skip
    except pandas.errors.ParserError as error:
        raise InputError("file", str(path), f"must be a table: {error}") from None
    table = table.apply(lambda column: column.fillna("").str.strip())
    table.columns = table.columns.str.strip()
    if not len(table):
        raise InputError("file", str(path), "must have at least one row below the names of columns")
    decimal, numeric = _numeric(table)
    time, written = _times(table, numeric, doubts)
    columns = [name for name in numeric if name != time]
    if not columns:
        among = f"numbers with decimal = {decimal!r} in one of {', '.join(table.columns)}"
        raise InputError("temperature_column", None, f"is not found: there are no {among}")
    values = table[columns].replace(list(_MISSING), "nan").apply(
        lambda column: column.str.replace(",", ".").astype(float)
    )  # fmt: skip
    guesses = {"delimiter": delimiter, "decimal": decimal, "date_format": written}
    guesses |= {"encoding": encoding, "time_column": time} | _temperatures(values, doubts)
    usual = {"delimiter": ",", "decimal": ".", "date_format": "", "encoding": "utf-8",
             "time_column": "time", "temperature_column": "temperature"}  # fmt: skip
    options = {name: value for name, value in guesses.items() if usual.get(name) != value}
    return RecordFormat(options, {name: said for name, said in doubts.items() if name in options})


def _decoded(content: bytes) -> tuple[str, str]:
    """Return the text of a file, and its encoding."""
    if content.startswith(b"\xef\xbb\xbf"):
        return content.decode("utf-8-sig"), "utf-8-sig"
    try:
        return content.decode("utf-8"), "utf-8"
    except UnicodeDecodeError:
        return content.decode("latin-1"), "latin-1"


def _delimiter(text: str, path: Path) -> str:
    """Return what separates as many columns in every one of the first lines."""
    lines = [line for line in text.splitlines()[:_SAMPLE] if line.strip()]
    for delimiter in _DELIMITERS:
        rows = csv.reader(lines, delimiter=delimiter, skipinitialspace=True)
        try:
            widths = {len(row) for row in rows}
        except csv.Error:  # a field without end: no text
            continue
        if len(widths) == 1 and widths.pop() > 1:
            return delimiter
    allowed = "is not found: no character separates as many columns in every line, from the first"
    raise InputError("delimiter", str(path), allowed)


def _numeric(table: DataFrame) -> tuple[str, list[str]]:
    """Return what stands before decimals, and the columns that have numbers alone."""
    by_decimal = {}
    for decimal, pattern in _NUMBER.items():
        by_decimal[decimal] = [
            name for name in table.columns
            for known in [table[name][~table[name].str.lower().isin(_MISSING)]]
            if len(known) and known.str.fullmatch(pattern).all()
        ]  # fmt: skip
    decimal = max(_NUMBER, key=lambda sign: len(by_decimal[sign]))
    return decimal, by_decimal[decimal]


def _times(table: DataFrame, numeric: Sequence[str], doubts: dict[str, str]) -> tuple[str, str]:
    """Return the first column of dates, else of numbers that increase, and how it is written."""
    for name in table.columns:
        formats = _date_formats(table[name], number=name in numeric)
        if formats:
            if len(formats) > 1:
                doubts["date_format"] = f"or {formats[1]}: both fit every row"
            return str(name), formats[0]
    for name in numeric:
        if (np.diff(table[name].str.replace(",", ".").astype(float)) > 0).all():
            return str(name), ""
    allowed = "is not found: no column has dates, or numbers that increase"
    raise InputError("time_column", None, allowed)


def _date_formats(texts: Series, *, number: bool) -> list[str]:
    """Return how the dates of a column may be written, the most regular first; "" is ISO 8601."""
    pandas, first = import_module("pandas"), str(texts.iloc[0])
    if number:
        formats = [_NUMBERED_DATES.get(len(first), "")]
        if not formats[0]:
            return []
    else:
        guess = import_module("pandas.tseries.api").guess_datetime_format
        formats = ["ISO8601", *(guess(first, dayfirst=way) for way in (True, False))]
    steps = {}
    for written in dict.fromkeys(filter(None, formats)):
        dates = pandas.to_datetime(texts, format=written, errors="coerce", utc=True)
        if dates.notna().all():
            apart = dates.diff().dt.total_seconds().to_numpy()[1:]
            if not len(apart) or (apart > 0).mean() > 1 - _MOST_SWAPPED:
                steps[written] = len({*apart.tolist()})
    if "ISO8601" in steps:
        return [""]
    return sorted(steps, key=lambda written: steps[written])[: 1 + _tied(steps)]


def _tied(steps: dict[str, int]) -> int:
    """Return whether the two most regular are equally regular."""
    least = sorted(steps.values())
    return int(len(least) > 1 and least[0] == least[1])


def _temperatures(values: DataFrame, doubts: dict[str, str]) -> dict[str, Any]:
    """Return the columns of temperatures, their unit and scale."""
    names = [str(name) for name in values.columns]
    low, high = ([n for n in names if re.search(p, n.lower())] for p in (_LOW, _HIGH))
    pair = (low[0], high[0]) if low and high else None
    named = [name for name in names if re.search(_TEMPERATURE, name.lower())]
    if pair is None and len(names) == 2 and not named:
        for first, second in itertools.permutations(names):
            if (values[first] > values[second]).mean() <= _MOST_SWAPPED:
                pair = first, second
                doubts["minimum_column"] = f"as it is hardly ever above {second}"
    options: dict[str, Any]
    if pair is not None:
        options = {"minimum_column": pair[0], "maximum_column": pair[1]}
        temperatures = values[list(pair)].to_numpy()
    else:
        first, *others = named or names
        options = {"temperature_column": first}
        temperatures = values[[first]].to_numpy()
        if others:
            doubts["temperature_column"] = f"or {', '.join(others)}"
    finite = temperatures[np.isfinite(temperatures)]
    if finite.size and LIKE_KELVIN[0] < finite.min() and finite.max() < LIKE_KELVIN[1]:
        options["unit"] = "K"
    elif finite.size and np.quantile(finite, 0.99) > HOTTEST and (finite == finite.round()).all():
        options["scale"] = 0.1
        doubts["scale"] = f"whole numbers up to {finite.max():g} are taken for tenths"
    return options
