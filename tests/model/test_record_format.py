"""How a file of temperatures is written is guessed from what is in it, and doubts are told."""

from __future__ import annotations

import gzip
from collections.abc import Callable
from datetime import date, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exactcreep import InputError, TemperatureRecord
from exactcreep.model.record_format import guessed
from tests.conftest import Command

DAYS = [date(2024, 4, 1) + timedelta(days=k) for k in range(40)]
GERMAN = {"delimiter": ";", "decimal": ",", "date_format": "%d.%m.%Y", "time_column": "Datum",
          "minimum_column": "TN", "maximum_column": "TX"}  # fmt: skip


def german(days: list[date]) -> str:
    rows = (f"{day:%d.%m.%Y};{k % 7 - 1},5;{k % 7 + 8},25\n" for k, day in enumerate(days))
    return "Datum;TN;TX\n" + "".join(rows)


def columns(head: str, row: Callable[[int, date], str]) -> str:
    return head + "\n" + "".join(f"{row(k, day)}\n" for k, day in enumerate(DAYS))


@pytest.mark.parametrize(
    ("text", "options", "doubted"),
    [
        (german(DAYS), GERMAN, ""),
        (columns("time\ttemp\train", lambda k, day: f"{day:%m/%d/%Y} 12:00\t{k}\t{k % 3}"),
         {"delimiter": "\t", "date_format": "%m/%d/%Y %H:%M", "temperature_column": "temp"}, ""),
        (columns("time,temperature", lambda k, day: f"{day:%m/%d/%Y} {(12, 6)[k % 2]}:00 AM,{k}.5"),
         {"date_format": "%m/%d/%Y %I:%M %p"}, ""),
        (columns("# station 12\n\ntime,temperature", lambda k, day: f"{day},{k}.5"), {}, ""),
        (columns("day,a,b", lambda k, day: f"{day},{k + 3}.5,{k}"),
         {"time_column": "day", "temperature_column": "a"}, "temperature_column"),
        (columns("2024-03-31,1.5", lambda k, day: f"{day},{k}.5"),
         {"time_column": "1", "temperature_column": "2"}, ""),
        (columns("31.03.2024 12:00;1,5;50,5", lambda k, d: f"{d:%d.%m.%Y} 12:00;{k},5;5{k % 9},5"),
         {"delimiter": ";", "decimal": ",", "date_format": "%d.%m.%Y %H:%M", "time_column": "1",
          "temperature_column": "2"}, "temperature_column"),
        (columns("day,min,max", lambda k, day: f"{day},{k},{3 * k}"),
         {"time_column": "day", "minimum_column": "min", "maximum_column": "max", "scale": 0.1},
         "scale"),
        (columns("time,temperature", lambda k, day: f"{k},{280 + k % 9}.5"), {"unit": "K"}, ""),
        ("time,temperature\n01/02/2024,3.5\n", {"date_format": "%d/%m/%Y"}, "date_format"),
    ],
)  # fmt: skip
def test_what_is_guessed_is_what_reads_the_file(
    text: str, options: dict[str, Any], doubted: str, tmp_path: Path
) -> None:
    path = tmp_path / "days.csv"
    path.write_text(text, encoding="utf-8")
    found = guessed(path)
    assert found.options == options
    assert "".join(found.doubts) == doubted
    assert TemperatureRecord(path, kappa=1, T0=0, **found.options).half_cycles >= 1


def test_bytes_that_are_no_utf_8_and_packed_files_are_read(tmp_path: Path) -> None:
    text = german(DAYS).replace("Datum", "Tag des Märzes")
    tmp_path.joinpath("a.csv").write_bytes(text.encode("latin-1"))
    tmp_path.joinpath("b.csv.gz").write_bytes(gzip.compress(text.encode("utf-8-sig")))
    for name, encoding in (("a.csv", {"encoding": "latin-1"}), ("b.csv.gz", {})):
        found = guessed(tmp_path / name).options
        assert found == GERMAN | {"time_column": "Tag des Märzes"} | encoding
        record = TemperatureRecord(tmp_path / name, kappa=1, T0=0, **found)
        assert record.temperatures[:4].tolist() == [-1.5, 8.25, 0.5, 9.25]
        assert record.half_cycles == 80
        assert record.dates[2].astype("datetime64[D]") == np.datetime64(DAYS[1])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("no_table_at_all\n", "delimiter = .*: is not found"),
        ("a,b\n1,2\n1,2\n", "time_column = .*: is not found: no column has dates"),
        ("time,sky\n2024-01-01,blue\n2024-01-02,grey\n", "temperature_column = .*: is not found"),
        ("Station 9\ntime;t\n" + "2024-01-01;1\n" * 40, "delete the lines above it"),
        ("date,time,t\n" + "2024-01-01,12:00,1\n" * 9, "write date and time of day in one column"),
    ],
)
def test_what_cannot_be_guessed_is_named(text: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "days.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=said):
        guessed(path)


@pytest.mark.parametrize(("unit", "freezing"), [("C", 0), ("K", 273.15)])
def test_a_mended_copy_has_what_was_right_and_the_hours_of_the_days_around(
    command: Command, unit: str, freezing: float
) -> None:
    hours = [datetime(2024, 4, 1) + timedelta(hours=k) for k in range(240)]
    right = {hour: f"{freezing + 8 * np.sin(hour.hour / 24 * 6.283):.1f}" for hour in hours}
    rows = [f"{hour},{right[hour]}" for hour in hours]
    rows[7], rows[100] = f"{hours[7]},", f"{hours[100]},999"
    rows[130:160] = reversed(rows[170:200])
    Path("days.csv").write_text("\n".join(["time,temperature", *rows]))
    told = command("record", "days.csv", "--mend", "mended.csv")
    assert told.code == 0
    for said in ("04-01 07:00:00: temperature = nan", "04-05 04:00:00: temperature = 999",
                 "30 rows after 2024-04-06T09:00 were", "the rows were sorted"):  # fmt: skip
        assert said in told.out
    mended = TemperatureRecord("mended.csv", kappa=1, T0=0, unit=unit)
    assert mended.temperatures.tolist() == [float(right[hour]) for hour in hours]
    assert command("record", "days.csv", "--mend", "days.csv", "--force").code == 2
    assert command("record", "mended.csv").code == 0
