"""Temperature records: what a file says is kept exactly, what it cannot mean is refused by row."""

from __future__ import annotations

import gzip
from fractions import Fraction

import numpy as np
import pandas as pd
import pytest

from exactcreep import Chain, InputError, Targets, TemperatureRecord, creep
from exactcreep.quasistatic.creep_result import Creep
from exactcreep.records.temperature_record import RecordWarning

KAPPA = "29e-6"


@pytest.fixture
def write(tmp_path):
    def writer(content, name="station.csv"):
        (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
        return tmp_path / name

    return writer


def record(path, *, T0=0, **options):
    return TemperatureRecord(path, KAPPA, T0, **options)


HEAD = "time,temperature\n"
TWICE = HEAD + "".join(f"2024-10-27T{k:02}:00,{k}\n" for k in (0, 1, 2, *range(2, 20)))


def test_decimal_texts_are_kept_as_the_rationals_they_denote(write):
    drive = record(write(HEAD + "0,10.1\n1,9.95\n2.5,-3e-1\n"), T0="10")
    kappa = Fraction(29, 10**6)
    assert drive.theta == (kappa / 10, -kappa / 20, kappa * Fraction(-103, 10))
    assert drive.exact_target(2) == -kappa / 20
    assert (drive.target_count, drive.random, drive.cyclic) == (3, False, False)
    assert drive.times == (0.0, 1.0, 2.5)
    assert drive.targets(2, 2).tolist() == [float(drive.theta[1]), float(drive.theta[2])]


DAYS = {"minimum_column": "low", "maximum_column": "high", "time_column": "day", "scale": "0.1"}
DAY = "day,high,low\n1878-01-01,66,14\n"
ONE = HEAD + "0,1\n"
ARRAYS = [
    ([[1, 2, 3]], {"times": [0]}, "must have one dimension"),
    (np.zeros((3, 2)), {"times": [0, 1, 2]}, "must be a date, where a row has the minimum"),
    ([1, 2], {"times": [[0, 1]]}, "times = 2: must be as many as temperatures, 2"),
    ([1, None], {"times": [0, 1]}, "temperature is missing, or .* at 1"),
]
FILES = [
    (HEAD + "0,1\n1,\n2\n3,NaN\n", {}, r"temperature = '': .*at 1, and 2 more \(line 3 .*pandas"),
    (HEAD + "0,1\n,2\n", {}, r"time = '': is missing.* \(line 3 of"),
    (HEAD + "0,1\n1,warm\n2,\n", {}, "temperature = 'warm': .*at 1, and 1"),
    (HEAD + "0,1\n1,2\n1,3\n", {}, "time = '1': .*later than 1 .*pandas"),
    (TWICE, {}, r"later than .*\); mend it with pandas.* summer time"),
    ("time,t1,t2\n" + "0,1,2\n" * 3001, {}, "^temperature_column is missing: .*first 3000 lines$"),
    (HEAD + "noon,2\n", {}, r"time = 'noon': must be a date, .*date_format .*\(line 2 of"),
    (
        HEAD + "2024-01-01T00:00,1\n2024-01-01T01:00+00:00,2\n",
        {},
        r"a time zone or none \(line 3 of",
    ),
    (HEAD + "0,-273.16\n", {}, "temperature = '-273.16': .*at 0"),
    (HEAD, {}, "delimiter = .*there is no row of data"),
    (ONE, {"date_format": "day first"}, "'day first': .*codes"),
    ("time;temperature\n0;1,5\n", {"decimal": "."}, "'1,5': .*decimal = '.', at 0"),
    ("time;temperature\n0;1\n", {"delimiter": ","}, "delimiter = .*is not found"),
    (b"time,temperature\n0,1\n1,\xff\n", {"encoding": "utf-8"}, "encoding = 'utf-8': .*0xff"),
    (b"\x1f\x8bnot packed", {}, "file = .*gzip"),
    (DAY, DAYS | {"temperature_column": "air"}, "temperature_column = .*left out"),
    (DAY, DAYS | {"maximum_hour": 24}, "maximum_hour = 24: "),
    (DAY, DAYS | {"scale": 0}, "scale = 0: .*positive"),
    (ONE, {"T0": "-273.2"}, "T0 = '-273.2': .*absolute zero"),
    (ONE, {"unit": "R"}, 'unit = \'R\': .*"C", "K" or "F"'),
    (ONE, {"theta": ["1"]}, "theta = .*times and sha256"),
]


@pytest.mark.parametrize(("content", "options", "said"), FILES + ARRAYS)
def test_a_bad_row_file_array_or_option_is_refused_by_its_name_and_value(
    write, content, options, said
):
    file = isinstance(content, str | bytes)
    given = {"file": write(content)} if file else {"temperatures": content}
    make = TemperatureRecord if file else TemperatureRecord.of
    with pytest.raises(InputError, match=said):
        make(**given | {"kappa": KAPPA, "T0": 0} | options)


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


def test_a_minimum_and_a_maximum_a_day_are_readings_at_their_hours(write):
    path = write("day,high,low\n1878-01-01,66,14\n1878-01-02,-5,-74\n1878-01-03,9,2\n")
    drive = record(path, **DAYS)
    assert [theta / drive.kappa for theta in drive.theta] == [
        Fraction(tenths, 10) for tenths in (14, 66, -74, -5, 2, 9)
    ]
    assert [time / 3600 for time in drive.times] == [0, 10, 24, 34, 48, 58]
    late = record(path, **DAYS, minimum_hour="23.5", maximum_hour=14)
    assert late.dates[1] == np.datetime64("1878-01-01T23:30")
    half = write(path.read_text().replace(",14", ","), "half.csv")
    with pytest.raises(InputError, match=r"low = '': is missing, or .* 1878-01-01 \(line 2"):
        record(half, **DAYS)


def test_a_minimum_above_its_maximum_is_a_warning_and_on_many_days_an_error(write):
    def swapped(count, of):
        days = np.datetime64("1990-01-01") + np.arange(of)
        rows = (
            f"{day},{high},{-high}"
            for day, high in zip(days, [-5] * count + [5] * of, strict=False)
        )
        return record(write("\n".join(["day,high,low", *rows])), **DAYS)

    with pytest.warns(RecordWarning, match="on 1 of 100 days, first on 1990-01-01"):
        assert swapped(1, 100).target_count == 200
    with pytest.raises(InputError, match=r"low': is above high on 2 of 199 days, .* be swapped"):
        swapped(2, 199)


@pytest.mark.parametrize(
    ("readings", "said"),
    [
        ((41.0, 77.0), "41 to 77 is no weather in degrees Celsius: another unit .* for tenths"),
        ((-20.0, 300.5), "-20 to 300.5 is no weather"),
        ((181.0, 399.0), "181 to 399 is no weather"),
        ((-95.0, -94.0), "-95 to -94 is no weather"),
    ],
)
def test_temperatures_of_another_unit_are_doubted(readings, said):
    with pytest.warns(RecordWarning, match=said):
        TemperatureRecord.of(readings, KAPPA, 0, times=[0, 1])
    hot_and_cold = TemperatureRecord.of((60.0, -59.0), KAPPA, 0, times=[0, 1])
    assert hot_and_cold.target_count == 2


def test_a_gap_is_refused_by_its_first_row_and_filled_by_pandas(write):
    hours = [*range(6), *range(8, 14), *range(100, 103)]
    path = write(HEAD + "".join(f"{hour},{hour}\n" for hour in hours))
    with pytest.raises(InputError, match="time = '8': is 3 after 5, where 1 is usual, a gap"):
        record(path)
    days = pd.to_datetime("2024-04-01") + pd.to_timedelta(hours, "D")
    series = pd.Series(np.array(hours) / 10, days)
    with pytest.raises(InputError, match="is 3 days after 2024-04-06T00:00:00, where 1 is"):
        TemperatureRecord.of(series, KAPPA, 0)
    whole = TemperatureRecord.of(series.resample("D").interpolate("time"), KAPPA, 0)
    assert whole.temperatures == pytest.approx(np.arange(103) / 10, abs=1e-12)


def test_a_single_value_far_from_its_neighbours_is_refused_with_its_date(write):
    marked = write(HEAD + "0,12\n1,-999\n2,13\n")
    with pytest.raises(InputError, match=r"'-999': is far from .* 13, or a code .*at 1 \(line 3"):
        record(marked, T0=10, scale="0.1")
    for wrong in ("61", "-40"):
        rows = [f"2024-04-{k:02},{12 + k % 3}" for k in range(1, 29)]
        rows[9] = f"2024-04-10,{wrong}"
        with pytest.raises(InputError, match=rf"'{wrong}': is far .* 2024-04-10 \(line 11"):
            record(write(HEAD + "\n".join(rows)))


@pytest.mark.parametrize(("swing", "clouds"), [(0, 0), (8, 0), (30, 0), (0, 25)])
def test_weather_that_changes_is_no_mistake(swing, clouds):
    rng = np.random.default_rng(1)
    fronts = np.cumsum(rng.normal(0, 3, 400) * (rng.random(400) < 0.2))
    hours = np.arange(400)
    values = 10 + fronts / 3 + swing * np.sin(hours / 24 * 2 * np.pi) + 12 * (hours > 200)
    values += clouds * rng.uniform(-1, 1, 400)
    assert TemperatureRecord.of(values, KAPPA, 0, times=hours).target_count == 400


def test_one_hot_reading_is_no_code_for_missing_and_two_are():
    values = np.random.default_rng(1).uniform(20, 60, 400).round(1)
    values[7] = 85
    assert TemperatureRecord.of(values, KAPPA, 0, times=np.arange(400)).target_count == 400
    values[21] = 85
    with pytest.raises(InputError, match=r"temperature = 85: is far .*, and 1 more"):
        TemperatureRecord.of(values, KAPPA, 0, times=np.arange(400))


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


def test_records_of_springs_are_one_drive_that_files_keep(tmp_path):
    hours = ["2024-06-01T04:00", "2024-06-01T16:00", "2024-06-02T04:00"]
    each = [[10, 31, 12], [8, 22, 9]]
    records = [TemperatureRecord.of(values, KAPPA, 10, times=hours) for values in each]
    drive = TemperatureRecord.along(records)
    assert drive.temperatures.tolist() == np.transpose(each).tolist()
    assert drive.targets(2, 1).tolist() == [[float(one.theta[1]) for one in records]]
    finer = TemperatureRecord.along(records, 5)
    assert (finer.temperatures == np.linspace(*each, 5, axis=1)).all()
    chain = Chain(3, 5000, "0.5", "0.6", "0.01", tan_alpha="0.1")
    run = creep(chain, drive)
    assert run.x_G == creep(chain, Targets(drive.theta)).x_G != 0
    run.save(tmp_path / "roof.nc")
    assert Creep.load(tmp_path / "roof.nc").drive == drive
    late = TemperatureRecord.of(each[0], KAPPA, 10, times=[0, 1, 2])
    for wrong in (([],), ([records[0], late],), (records, 1)):
        with pytest.raises(InputError, match="records"):
            TemperatureRecord.along(*wrong)
