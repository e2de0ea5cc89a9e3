"""How a file of temperatures is written is guessed from what is in it, and doubts are told."""

from __future__ import annotations

import gzip
import tomllib
from collections.abc import Callable
from datetime import date, timedelta
from pathlib import Path
from typing import Any

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
        (columns("time,temperature", lambda k, day: f"{day},{k}.5"), {}, ""),
        (columns("time\ttemp\train", lambda k, day: f"{day:%m/%d/%Y} 12:00\t{k}\t{k % 3}"),
         {"delimiter": "\t", "date_format": "%m/%d/%Y %H:%M", "temperature_column": "temp"}, ""),
        (columns("id,when,TXK,TNK", lambda k, day: f"44,{day:%Y%m%d},{k}.0,-{k}.0"),
         {"date_format": "%Y%m%d", "time_column": "when", "minimum_column": "TNK",
          "maximum_column": "TXK"}, ""),
        (columns("day,a,b", lambda k, day: f"{day},{k + 3}.5,{k}"),
         {"time_column": "day", "minimum_column": "b", "maximum_column": "a"}, "minimum_column"),
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
    for name, encoding in (("a.csv", "latin-1"), ("b.csv.gz", "utf-8-sig")):
        found = guessed(tmp_path / name).options
        assert (found["encoding"], found["time_column"]) == (encoding, "Tag des Märzes")
        assert TemperatureRecord(tmp_path / name, kappa=1, T0=0, **found).half_cycles == 80


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("no table at all\n", "delimiter = .*: is not found"),
        ("a,b\n1,2\n1,2\n", "time_column = None: is not found: no column has dates"),
        ("time,sky\n2024-01-01,blue\n2024-01-02,grey\n", "temperature_column = None: is not found"),
        ("time,temperature\n", "must have at least one row"),
        (f"a;{'0' * 140_000}\n1;2\n", "delimiter = .*: is not found"),
        ("time,sky\n" + "2024-01-01,1\n" * 99 + "1,2,3,4\n", "must be a table: .*line 101"),
    ],
)
def test_what_cannot_be_guessed_is_named(text: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "days.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=said):
        guessed(path)


def test_the_lines_of_a_record_are_those_of_a_scene(command: Command) -> None:
    Path("days.csv").write_text(german(DAYS))
    told = command("record", "days.csv")
    assert told.out.startswith("# 80 readings from 2024-04-01T05:00:00 to 2024-05-10T15:00:00")
    drive = tomllib.loads(told.out)["drive"]
    assert drive == {"kind": "record", "file": "days.csv", **GERMAN, "T0": 6.7}
    assert command("record", "days.csv", "--json").json["doubts"] == {}


def test_a_gap_is_told_below_the_lines_in_days_and_dates(command: Command) -> None:
    Path("days.csv").write_text(german([*DAYS[:11], *DAYS[14:]]))
    told = command("record", "days.csv", "--plot", "days.png")
    assert told.code == 2
    assert 'minimum_column = "TN"' in told.out
    assert "is 3.583 days after 11 April 2024, where 0.5833 is usual, a gap" in told.err
    assert not Path("days.png").exists()
