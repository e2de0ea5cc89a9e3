"""What is said of a file of temperatures: what was read, and nothing that it should not say."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from exactcreep import InputError, Scene, TemperatureRecord
from tests.conftest import Command

TEXT = """
chain = { n = 3, l0 = 1000, mu_d = 0.5, mu_s = 0.6, tan_alpha = 0.1 }
drive = { kind = "record", file = "%s", kappa = 1e-5, T0 = 10 }
"""
SECRET = "s3cret"
PRIVATE = {
    "words": f"root:{SECRET}:0:0\n" * 20,
    "names": f"{SECRET},{SECRET}x\n2024-01-01,1\n2024-01-02,2\n",
    "a cell of times": f"time,temp\n2024-01-01,1\n{SECRET},2\n2024-01-03,2\n",
    "a cell of temperatures": f"time,temp\n2024-01-01,1\n2024-01-02,{SECRET}\n2024-01-03,2\n",
    "an ambiguous day": f"time,temp,{SECRET}\n01/02/2024,1,2\n02/02/2024,2,3\n",
    "no temperature": f"time,{SECRET}\n2024-01-01,1\n2024-01-02,1\n",
    "too few names": f"time,{SECRET}\n2024-01-01,1,2\n2024-01-02,1,2\n",
}


@pytest.mark.parametrize("name", PRIVATE)
def test_a_scene_quotes_no_cell_of_a_file_outside_its_folder(name: str, tmp_path: Path) -> None:
    scenes = tmp_path / "scenes"
    scenes.mkdir()
    (tmp_path / "other.csv").write_text(PRIVATE[name])
    scene = Scene.from_text(TEXT % "../other.csv", folder=scenes)
    with pytest.raises(InputError) as refused:
        scene.experiment()
    assert SECRET not in str(refused.value)
    assert "other.csv" in str(refused.value)
    assert name != "a cell of temperatures" or "line 3, column 2" in str(refused.value)
    inside = Scene.from_text(TEXT % "other.csv", folder=tmp_path)
    with pytest.raises(InputError):
        inside.experiment()


@pytest.mark.parametrize("where", ["name", "cell", "date", "above"])
def test_nothing_of_a_file_reaches_the_terminal_unescaped(where: str, command: Command) -> None:
    evil = "\x1b[2J\u202e\x9b31m"
    texts = {
        "name": f"time,temp {evil},{evil}\n2024-01-01,1,2\n2024-01-02,2,3\n",
        "cell": f"time,temp\n2024-01-01,1\n2024-01-02,{evil}\n2024-01-03,3\n",
        "date": f"time,temp\n2024-01-01,1\n{evil},2\n2024-01-03,3\n",
        "above": f"{evil};{evil}\ntime,temp {evil}\n2024-01-01,1\n2024-01-02,2\n",
    }
    Path("evil.csv").write_text(texts[where], encoding="utf-8")
    for more in ((), ("--json",)):
        told = command("record", "evil.csv", *more)
        assert (told.out + told.err).replace("\n", "").isprintable()


def test_options_of_the_command_line_read_what_the_file_does_not_say(command: Command) -> None:
    rows = [f"{k // 24 + 1:02}/06/2024,{k % 24},{50 + k % 24},{k % 7}\n" for k in range(48)]
    Path("odd.csv").write_text("day,h,s1,s2\n" + "".join(rows))
    assert "temperature_column" in command("record", "odd.csv").sentence
    words = ("--temperature-column", "s1", "--unit", "F", "--time-column", "day,h")
    told = command("record", "odd.csv", *words, "--json").json
    assert told.items() >= {
        "readings": 48, "first": "2024-06-01T00:00:00", "last": "2024-06-02T23:00:00",
        "lowest": 50.0, "highest": 73.0, "unit": "F", "time_column": ["day", "h"], "missing": 0,
    }.items()  # fmt: skip
    lines = command("record", "odd.csv", *words).out
    assert lines.startswith(f"# {told['read']}\n# the record covers 1.96 days: seasons are missing")
    Path("odd.toml").write_text(
        "chain = { n = 3, l0 = 1000, mu_d = 0.5, mu_s = 0.6, tan_alpha = 0.1 }\n" + lines
        + 'kappa = 1e-5\n[run]\nsolver = "sliding"\n'
    )  # fmt: skip
    assert command("run", "odd.toml").code == 0


def test_one_reading_a_day_is_said_to_have_no_day_and_night(command: Command) -> None:
    rows = [f"2024-{k // 28 + 1:02}-{k % 28 + 1:02},{k % 9}.5\n" for k in range(28)]
    Path("days.csv").write_text("date,tavg\n" + "".join(rows))
    told = command("record", "days.csv", "--json").json
    assert "one reading a day: day and night are missing" in told["doubts"]["sampling"]
    roof = command("roof", "days.csv", "--length", "3", "--slope-degrees", "15").out
    for said in ("day and night are missing", f"weather file {told['read']}", "E = 16e9 Pa"):
        assert said in " ".join(roof.split())


def test_floats_are_the_decimals_that_they_print() -> None:
    for values in ([-3.2, 0.1], np.array([-3.2, 0.1], "f4")):
        record = TemperatureRecord.of(values, kappa=1, T0=0, times=[0, 1])
        assert record.theta == (Fraction(-16, 5), Fraction(1, 10))
