"""Temperature records: what a file says is kept exactly, what it cannot mean is refused by row."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from exactcreep.model import record as record_module
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Path
from exactcreep.model.numbers import InputError
from exactcreep.model.record import TemperatureRecord
from exactcreep.model.state import State
from exactcreep.scene import load_scene
from exactcreep.solvers.sliding import Sliding

KAPPA = "29e-6"


@pytest.fixture
def write(tmp_path):
    def writer(content, name="station.csv"):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return writer


def test_decimal_texts_are_kept_as_the_rationals_they_denote(write):
    path = write("time,temperature\n0,10.1\n1,9.95\n2.5,-3e-1\n")
    drive = TemperatureRecord(path, KAPPA, "10")
    kappa = Fraction(29, 10**6)
    assert drive.theta == (kappa / 10, -kappa / 20, kappa * Fraction(-103, 10))
    assert drive.exact_target(2) == -kappa / 20
    assert drive.half_cycles == 3
    assert drive.times == (0.0, 1.0, 2.5)
    assert drive.targets(2, 2).tolist() == [float(drive.theta[1]), float(drive.theta[2])]
    assert not drive.random
    assert not drive.cyclic


def test_kelvin_and_celsius_give_the_same_dilations(write):
    celsius = write("t,T\n0,20\n1,-5.5\n", "c.csv")
    kelvin = write("t,T\n0,293.15\n1,267.65\n", "k.csv")
    columns = {"time_column": "t", "temperature_column": "T"}
    one = TemperatureRecord(celsius, KAPPA, 15, unit="C", **columns)
    other = TemperatureRecord(kelvin, KAPPA, "288.15", unit="K", **columns)
    assert one.theta == other.theta


def test_dates_become_seconds_and_columns_are_found_by_name(write):
    path = write(
        '\ufeffstation; air ;when\r\n"a;b";1.5;2024-02-28T23:00\r\n'
        "\r\nx;2.5;2024-03-01 00:30:00\r\n"
    )
    drive = TemperatureRecord(
        path, KAPPA, 0, time_column="when", temperature_column="air", delimiter=";"
    )
    assert drive.times == (0.0, 25.5 * 3600)
    assert drive.theta == (Fraction(KAPPA) * Fraction(3, 2), Fraction(KAPPA) * Fraction(5, 2))


@pytest.mark.parametrize(
    ("rows", "column", "says"),
    [
        ("0,1\n1,\n", "temperature", "missing in row 2 (line 3)"),
        ("0,1\n1,NaN\n", "temperature", "missing in row 2 (line 3)"),
        ("0,1\n,2\n", "time", "missing in row 2 (line 3)"),
        ("0,1\n\n1,warm\n", "temperature", "with a decimal point in row 2 (line 4)"),
        ("0,1\n1,3/5\n", "temperature", "must be a number with a decimal point in row 2 (line 3)"),
        ("0,1\n1,1_0\n", "temperature", "must be a number with a decimal point in row 2 (line 3)"),
        ("0,1\n1,inf\n", "temperature", "must be a number with a decimal point in row 2 (line 3)"),
        ("0,1\n1,2\n1,3\n", "time", "must be later than in the row before in row 3 (line 4)"),
        ("0,1\n1,2\n0.5,3\n", "time", "must be later than in the row before in row 3 (line 4)"),
        ("0,1\nnoon,2\n", "time", "2024-01-31T13:00 in row 2 (line 3)"),
        ("0,1\n2024-01-01,2\n", "time", "of the same kind as the rows before in row 2 (line 3)"),
        (
            "2024-01-01T00:00,1\n2024-01-01T01:00+00:00,2\n",
            "time",
            "of the same kind as the rows before in row 2 (line 3)",
        ),
        ("0,-273.16\n", "temperature", "must not be below absolute zero in row 1 (line 2)"),
        ("0,1\n1,2,3\n", "file", "row 2 (line 3) must have 2 columns, not 3"),
        ("0,1\n1\n", "file", "row 2 (line 3) must have 2 columns, not 1"),
        ("", "file", "must hold at least one row of data"),
        ('0,"1\n', "file", "must be a CSV file; line 2"),
    ],
)
def test_a_bad_row_is_refused_with_its_number(write, rows, column, says):
    path = write("time,temperature\n" + rows)
    with pytest.raises(InputError) as caught:
        TemperatureRecord(path, KAPPA, 0)
    assert caught.value.field == column
    assert says in str(caught.value)


@pytest.mark.parametrize(
    ("arguments", "field", "says"),
    [
        ({"kappa": 0}, "kappa", "must be positive"),
        ({"kappa": "nan"}, "kappa", "finite number"),
        ({"T0": "-273.2"}, "T0", "absolute zero"),
        ({"unit": "F"}, "unit", 'must be "C" or "K"'),
        ({"time_column": "when"}, "time_column", "must be one of the columns"),
        ({"temperature_column": "time"}, "temperature_column", "must not be time_column"),
        ({"temperature_column": 3}, "temperature_column", "must be the name of a column"),
        ({"delimiter": ", "}, "delimiter", "must be one character"),
        ({"theta": ["1"]}, "theta", "must come with times and sha256"),
        ({"file": 7}, "file", "must be the path of a CSV file"),
        ({"file": "nowhere.csv"}, "file", "must be an existing CSV file"),
        ({"file": "a\0b"}, "file", "must be"),
    ],
)
def test_a_bad_parameter_is_refused_by_name(write, arguments, field, says):
    path = write("time,temperature\n0,1\n")
    with pytest.raises(InputError) as caught:
        TemperatureRecord(**{"file": path, "kappa": KAPPA, "T0": 0} | arguments)
    assert caught.value.field == field
    assert says in str(caught.value)


def test_directories_bytes_and_sizes_are_refused_in_one_sentence(write, tmp_path, monkeypatch):
    cases = [
        (tmp_path, "not a directory"),
        (write(b"time,temperature\n0,1\n1,\xff\n", "latin.csv"), "UTF-8 text; line 3"),
        (write("", "empty.csv"), "must begin with a row that names the columns"),
        (write("time,time,temperature\n", "twice.csv"), "named once among"),
    ]
    for path, says in cases:
        with pytest.raises(InputError, match=says):
            TemperatureRecord(path, KAPPA, 0)
    path = write("time,temperature\n0,1\n1,2\n2,3\n")
    monkeypatch.setattr(record_module, "MOST_ROWS", 2)
    with pytest.raises(InputError, match="at most 2 rows"):
        TemperatureRecord(path, KAPPA, 0)
    monkeypatch.setattr(record_module, "MOST_BYTES", 2**20)
    large = write(b"time,temperature\n" + b"0," + b"1" * 2**20)
    with pytest.raises(InputError, match="at most 1 MiB"):
        TemperatureRecord(large, KAPPA, 0)


def test_parameters_make_the_drive_again_without_the_file(write):
    path = write("time,temperature\n0,1.25\n1,-7\n")
    drive = TemperatureRecord(path, KAPPA, "0.5")
    parameters = drive.parameters()
    assert parameters.pop("kind") == "record"
    path.unlink()
    assert TemperatureRecord(**parameters) == drive


def test_rows_within_a_monotone_stretch_change_nothing(write):
    temperatures = np.random.default_rng(5).integers(-200, 300, 60).cumsum()
    rows = "".join(f"{k},{t}e-2\n" for k, t in enumerate(temperatures.tolist()))
    drive = TemperatureRecord(write("time,temperature\n" + rows), "1e-3", 0)
    turns = [
        drive.theta[k]
        for k in range(60)
        if k == 59
        or k == 0
        or (drive.theta[k + 1] - drive.theta[k]) * (drive.theta[k] - drive.theta[k - 1]) < 0
    ]
    assert len(turns) < 50
    chain = Chain(4, 100, "0.5", "0.6", tan_alpha="0.2")
    ends = []
    for path in (drive, Path(turns)):
        simulation = Sliding(exact=True).simulation(chain, State.relaxed(chain), 0, ("x_G",))
        simulation.follow(path, 1, path.half_cycles)
        ends.append(simulation.state().displacements.tolist())
        assert simulation.tally.slips > 0
    assert ends[0] == ends[1]


SCENE = """
[chain]
n = 4
l0 = 1000
mu_d = 0.5
mu_s = 0.6
tan_alpha = 0.25

[drive]
kind = "record"
file = "station.csv"
time_column = "hour"
temperature_column = "air"
unit = "C"
kappa = 29e-6
T0 = 10
"""


def test_a_scene_finds_its_record_beside_it(write):
    write("hour,air\n0,10\n12,35\n24,8.5\n")
    (member,) = load_scene(write(SCENE, "roof.toml")).members()
    drive = member.experiment.drive
    assert drive.theta == (0, Fraction(KAPPA) * 25, -Fraction(KAPPA) * Fraction(3, 2))


@pytest.mark.parametrize(
    ("change", "field"),
    [
        (("kappa = 29e-6\n", ""), "drive.kappa"),
        (('unit = "C"', 'unit = "F"'), "drive.unit"),
        (("station.csv", "elsewhere.csv"), "drive.file"),
        (('file = "station.csv"', "file = 3"), "drive.file"),
        (("T0 = 10", "T0 = 10\ntheta = [1]"), "drive.theta"),
    ],
)
def test_a_scene_with_a_bad_record_is_refused_by_key(write, change, field):
    write("hour,air\n0,10\n12,35\n")
    with pytest.raises(InputError) as caught:
        load_scene(write(SCENE.replace(*change), "roof.toml")).members()
    assert caught.value.field == field
