"""Temperature records: what a file says is kept exactly, what it cannot mean is refused by row."""

from __future__ import annotations

import gzip
from fractions import Fraction

import numpy as np
import pandas as pd
import pytest

from exactcreep.model import temperature_record
from exactcreep.model.chain import Chain
from exactcreep.model.numbers import InputError
from exactcreep.model.temperature_record import RecordWarning, TemperatureRecord
from exactcreep.quasistatic.creep import creep
from exactcreep.quasistatic.result import Creep

KAPPA = "29e-6"


@pytest.fixture
def write(tmp_path):
    def writer(content, name="station.csv"):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return writer


def record(path, *, T0=0, **options):
    return TemperatureRecord(path, KAPPA, T0, **options)


def kelvins(drive):
    return [float(theta / drive.kappa) for theta in drive.theta]


HEAD = "time,temperature\n"


def test_decimal_texts_are_kept_as_the_rationals_they_denote(write):
    drive = record(write(HEAD + "0,10.1\n1,9.95\n2.5,-3e-1\n"), T0="10")
    kappa = Fraction(29, 10**6)
    assert drive.theta == (kappa / 10, -kappa / 20, kappa * Fraction(-103, 10))
    assert drive.exact_target(2) == -kappa / 20
    assert (drive.half_cycles, drive.random, drive.cyclic) == (3, False, False)
    assert drive.times == (0.0, 1.0, 2.5)
    assert drive.targets(2, 2).tolist() == [float(drive.theta[1]), float(drive.theta[2])]


def test_dates_become_seconds_columns_are_found_by_name_and_kelvin_is_celsius(write):
    text = '\ufeffstation; air ;when\r\n"a;b";1.5;2024-02-28T23:00\r\n\r\nx;2.5;2024-03-01 00:30:00'
    columns = {"time_column": "when", "temperature_column": "air", "delimiter": ";"}
    drive = record(write(text), **columns)
    assert drive.times == (0.0, 25.5 * 3600)
    assert drive.theta == (Fraction(KAPPA) * Fraction(3, 2), Fraction(KAPPA) * Fraction(5, 2))
    kelvin = write(text.replace("1.5", "274.65").replace("2.5", "275.65"), "kelvin.csv")
    assert record(kelvin, T0="273.15", unit="K", **columns).theta == drive.theta


DAYS = {"minimum_column": "low", "maximum_column": "high", "time_column": "day", "scale": "0.1"}
DAY = "day,high,low\n1878-01-01,66,14\n"


@pytest.mark.parametrize(
    ("rows", "sentence"),
    [
        ("0,1\n1,\n2\n3,NaN\n", "temperature = '': is missing in line 3, 4, 5"),
        ("0,1\n,2\n", "time = '': is missing in line 3"),
        ("0,1\n\n1,warm\n", "temperature = 'warm': must be .* with a decimal point in line 4"),
        ("0,1\n1,3/5\n2,1_0\n3,inf\n", "'3/5': must be .* a decimal point in line 3, 4, 5"),
        ("0,1\n1,2\n1,3\n", "time = '1': must be later than before in line 4"),
        ("0,1\nnoon,2\n", "time = 'noon': must be .* 2024-01-31T13:00 in line 3"),
        ("2024-01-01T00:00,1\n2024-01-01T01:00+00:00,2\n", "of the same kind .* in line 3"),
        ("0,20\n1e4000,21\n", "time = '1e4000': must be below the largest float"),
        ("0,-273.16\n", "temperature = .*: must not be below absolute zero in line 2"),
        ("0,1\n1,2,3\n", "Expected 2 fields in line 3, saw 3"),
        ("", "file = .*must hold at least one row of data"),
        ('0,"1\n', "file = .*must be a CSV file"),
    ],
)
def test_bad_rows_are_refused_by_line(write, rows, sentence):
    with pytest.raises(InputError, match=sentence):
        record(write(HEAD + rows))


@pytest.mark.parametrize(
    ("content", "options", "sentence"),
    [
        (HEAD + "0,\n1,1\n2,\n", {"missing": "interpolate"}, "time = .* at an end in line 2, 4"),
        (HEAD + "28.02.1901,1\n", {}, 'date_order = "day first"'),
        ("time;temperature\n0;1,5\n", {"delimiter": ";"}, 'decimal = ","'),
        (HEAD + "0,1\n0,2\n", {}, 'duplicates = .*"mean"'),
        ("", {}, "file = .*must begin with a row that names the columns"),
        (b"time,temperature\n0,1\n1,\xff\n", {}, "file = .*UTF-8 text; line 3"),
        (b"not packed", {"file": "not.csv.gz"}, "file = .*packed by gzip"),
        ("time,time,temperature\n", {}, "time_column = .*named once among"),
        (DAY, DAYS | {"maximum_column": ""}, "maximum_column = .*with minimum_column"),
        (DAY, DAYS | {"temperature_column": "air"}, "temperature_column = .*left out beside"),
        (DAY, DAYS | {"minimum_column": "day"}, "minimum_column = .*not be time_column"),
        (DAY, DAYS | {"maximum_hour": 24}, "maximum_hour = 24: must be another hour"),
        (DAY, DAYS | {"minimum_hour": -1}, "minimum_hour = -1: must not be negative"),
        (DAY, DAYS | {"scale": 0}, "scale = 0: must be positive"),
        (DAY, {"time_column": "day", "temperature_column": "low", "maximum_hour": 3},
         "maximum_hour = 3: belongs to minimum_column"),
        *((HEAD + "0,1\n", {sentence.split(" = ")[0]: value}, sentence) for value, sentence in (
            (0, "kappa = 0: must be positive"),
            ("-273.2", "T0 = '-273.2': must not be below absolute zero"),
            ("F", "unit = 'F': must be \"C\" or \"K\""),
            ("when", "time_column = 'when': must be one of the columns"),
            ("time", "temperature_column = 'time': must not be time_column"),
            (", ", "delimiter = ', ': must be one character"),
            (["1"], "theta = .*must come with times and sha256"),
            (7, "file = 7: must be the path of a CSV file"),
            (".", "file = '.': is a directory"),
        )),
    ],
)  # fmt: skip
def test_a_bad_file_or_option_is_refused_by_name(write, content, options, sentence, monkeypatch):
    path = write(content, options.get("file", "") if content == b"not packed" else "station.csv")
    monkeypatch.chdir(path.parent)
    given = {"file": path, "kappa": KAPPA, "T0": 0}
    with pytest.raises(InputError, match=sentence):
        TemperatureRecord(**given | options)


def test_files_of_too_many_rows_or_bytes_are_refused(write, monkeypatch):
    monkeypatch.setattr(temperature_record, "MOST_ROWS", 2)
    with pytest.raises(InputError, match="at most 2 rows"):
        record(write(HEAD + "0,1\n1,2\n2,3\n"))
    monkeypatch.setattr(temperature_record, "MOST_BYTES", 2**20)
    large = HEAD.encode() + b"\n" * 2**20
    with pytest.raises(InputError, match=r"at most 1 MiB$"):
        record(write(large))
    with pytest.raises(InputError, match=r"at most 1 MiB when it is unpacked$"):
        record(write(gzip.compress(large), "large.csv.gz"))


def test_parameters_make_the_drive_again_without_the_file(write):
    path = write(HEAD + "0,1.25\n1,-7\n")
    drive = record(path, T0="0.5")
    parameters = drive.parameters()
    assert parameters.pop("kind") == "record"
    path.unlink()
    assert TemperatureRecord(**parameters) == drive
    with pytest.raises(InputError, match="must be as many as theta, at least one"):
        TemperatureRecord(**parameters | {"times": [0]})


@pytest.mark.parametrize(
    ("values", "about", "sentence"),
    [
        ([[1, 2, 3]], {"times": [0]}, "must have one dimension"),
        ([1, 2], {"times": ["2024-01-01", "2424-01-01"]}, "years 1700 to 2200 .* in row 2"),
        (np.zeros((3, 2)), {"times": [0, 1, 2]}, "must be a date, where a row has the minimum"),
        ([1], {"times": [0], "decimal": ","}, "decimal = ',': is not an option of arrays"),
    ],
)
def test_arrays_that_are_no_record_are_refused(values, about, sentence):
    with pytest.raises(InputError, match=sentence):
        TemperatureRecord.of(values, KAPPA, 0, **about)


# --- what real files are like --------------------------------------------------------------------

HOURS = [f"2024-01-31T{hour:02}:00" for hour in range(24)]


def test_a_packed_file_and_arrays_say_what_the_file_says(write):
    text = HEAD + "".join(f"{hour},{k}.5\n" for k, hour in enumerate(HOURS))
    plain = record(write(text), T0=10)
    packed = TemperatureRecord(write(gzip.compress(text.encode()), "r.csv.gz"), KAPPA, 10)
    values = np.arange(24) + 0.5
    series = pd.Series(values, index=pd.to_datetime(HOURS))
    others = [
        packed,
        TemperatureRecord.of(series, KAPPA, 10),
        TemperatureRecord.of(series.tz_localize("UTC"), KAPPA, 10),
        TemperatureRecord.of(values.tolist(), KAPPA, 10, times=HOURS),
    ]
    for other in others:
        assert other.theta == plain.theta
        assert other.times == plain.times == tuple(3600.0 * hour for hour in range(24))
        assert (other.dates == np.array(HOURS, dtype="datetime64[ns]")).all()
    assert TemperatureRecord.of(values, KAPPA, 10, times=np.arange(24)).dates is None


@pytest.mark.parametrize(
    ("order", "dates"),
    [
        ("day first", ("01.02.2024 9:30", "02.02.2024 00:00:30")),
        ("month first", ("2/1/2024 09:30", "02/02/2024 00:00:30")),
    ],
)
def test_decimal_commas_and_the_order_of_day_and_month_are_what_is_said(write, order, dates):
    path = write(f"time;temperature\n{dates[0]};-1,5\n{dates[1]};2\n")
    options = {"delimiter": ";", "decimal": ",", "date_order": order}
    drive = record(path, **options)
    assert drive.theta == (Fraction(KAPPA) * Fraction(-3, 2), Fraction(KAPPA) * 2)
    days = np.array(["2024-02-01T09:30:00", "2024-02-02T00:00:30"], dtype="datetime64[ns]")
    assert (drive.dates == days).all()


def test_all_faults_of_a_file_are_refused_at_once_by_examples_and_with_what_mends_them(write):
    path = write(HEAD + "0,1\n1,\n1,2\n2,warm\n3\n4,-300\n,5\n6,7\n5,8\n7,9\n")
    with pytest.raises(InputError) as caught:
        record(path)
    assert str(caught.value).replace(str(path), "FILE") == (
        "temperature = '': is missing in line 3, 6"
        ' (missing = "drop" leaves such readings out, "interpolate" is linear in time);'
        " temperature = 'warm': must be a number with a decimal point in line 5;"
        " temperature = '-300': must not be below absolute zero in line 7;"
        " time = '': is missing in line 8 (missing = \"drop\" leaves such rows out);"
        " time = '5': must be later than before in line 10; of FILE"
    )
    many = write(HEAD + "".join(f"{k},\n" for k in range(50)))
    with pytest.raises(InputError, match="in line 2, 3, 4 and 47 more"):
        TemperatureRecord(many, KAPPA, 0)


def test_a_minimum_and_a_maximum_a_day_are_readings_at_their_hours(write):
    path = write("day,high,low\n1878-01-01,66,14\n1878-01-02,-5,-74\n1878-01-03,2,9\n")
    drive = record(path, **DAYS)
    assert [theta / drive.kappa for theta in drive.theta] == [
        Fraction(tenths, 10) for tenths in (14, 66, -74, -5, 9, 2)
    ]
    assert [time / 3600 for time in drive.times] == [0, 10, 24, 34, 48, 58]
    late = record(path, **DAYS, minimum_hour="23.5", maximum_hour=14)
    assert late.dates[1] == np.datetime64("1878-01-01T23:30")
    table = pd.DataFrame({"low": [14, -74, 9], "high": [66, -5, 2]}, index=pd.to_datetime(
        ["1878-01-01", "1878-01-02", "1878-01-03"]))  # fmt: skip
    assert TemperatureRecord.of(table, KAPPA, 0, scale="0.1").theta == drive.theta
    half = write(path.read_text().replace(",14", ","), "half.csv")
    with pytest.raises(InputError, match="low = '': is missing in line 2"):
        record(half, **DAYS)
    assert len(record(half, **DAYS, missing="drop").theta) == 5


def test_readings_at_uneven_hours_have_no_gap_every_night():
    hours = [24 * day + hour for day in range(30) for hour in (7, 14, 21)]
    assert TemperatureRecord.of(np.zeros(90), KAPPA, 0, times=hours).half_cycles == 90


@pytest.mark.parametrize(
    ("missing", "temperatures", "times"),
    [("drop", [1, 3, 7], [0, 2, 6]), ("interpolate", [1, 2, 3, 4, 6, 7], [0, 1, 2, 3, 5, 6])],
)
def test_missing_temperatures_are_left_out_or_linear_in_time(write, missing, temperatures, times):
    path = write(HEAD + "0,1\n1,\n2,3\n3,nan\n5,NA\n6,7\n")
    drive = record(path, missing=missing)
    assert kelvins(drive) == temperatures
    assert list(drive.times) == times


@pytest.mark.parametrize(("which", "second"), [("first", 3), ("last", 8), ("mean", 5)])
def test_of_several_rows_of_one_time_the_one_that_is_asked_for_counts(write, which, second):
    path = write(HEAD + "0,1\n1,3\n1,4\n1,8\n2,9\n")
    assert kelvins(record(path, duplicates=which)) == [1, second, 9]
    backwards = write(HEAD + "1,1\n0,3\n")
    with pytest.raises(InputError, match="later than before"):
        record(backwards, duplicates=which)


def test_gaps_are_refused_bridged_or_part_the_record(write):
    hours = [*range(6), *range(8, 14), *range(100, 103)]
    path = write(HEAD + "".join(f"{hour},{hour}\n" for hour in hours))
    with pytest.raises(InputError, match=r"time = '8': comes more than 1\.5 .*in line 8, 14 "):
        record(path)
    bridged = record(path, gaps="interpolate")
    assert kelvins(bridged) == hours
    parts = bridged.parts()
    assert [len(part.theta) for part in parts] == [6, 6, 3]
    regular = TemperatureRecord.of(np.arange(30), KAPPA, 0, times=np.arange(30))
    assert regular.parts() == (regular,)


def test_temperatures_that_look_like_those_of_another_unit_are_doubted(write):
    kelvin = write(HEAD + "0,283.15\n1,301\n")
    with pytest.warns(RecordWarning, match='unit = "C".* look like kelvin'):
        record(kelvin, T0=10)
    record(kelvin, T0=283, unit="K")  # warnings are errors here
    with pytest.warns(RecordWarning, match='unit = "K".* look like degrees Celsius'):
        record(write(HEAD + "0,10\n1,12\n"), T0=283, unit="K")


def test_a_mark_of_missing_readings_that_is_a_number_is_doubted(write):
    marked = write(HEAD + "0,12\n1,-999\n2,13\n")
    with pytest.warns(RecordWarning, match=r"-99\.9 C, colder than any weather: a mark of missing"):
        record(marked, T0=10, scale="0.1")


def test_a_result_has_the_dates_of_its_record_and_keeps_them(write, tmp_path):
    zoned = [f"{hour}+01:00" for hour in HOURS]
    rows = "".join(f"{hour},{10 * (k % 3)}\n" for k, hour in enumerate(zoned))
    drive = TemperatureRecord(write(HEAD + rows), "1e-3", 0)
    run = creep(Chain(2, 100, "0.5", "0.6", tan_alpha="0.25"), drive, solver="sliding")
    utc = np.array(HOURS, dtype="datetime64[ns]") - np.timedelta64(1, "h")
    assert (run.dataset.date.values == utc).all()
    assert run.dataset.x_G.swap_dims(half_cycle="date").resample(date="12h").last().size == 3
    run.save(tmp_path / "run.nc")
    again = Creep.load(tmp_path / "run.nc")
    assert again.drive == drive
    assert again.dataset.identical(run.dataset)
