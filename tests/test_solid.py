"""A solid in SI units and its dimensionless chain say the same thing."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from exactcreep import Cycles, InputError, TemperatureRecord, load_scene, physical, pipeline
from exactcreep.laws import prediction, threshold_amplitude
from exactcreep.results import Solid, Walk
from exactcreep.scene import Scene
from tests.conftest import Command

DAY = 86400
LEAD = {
    "length": 3, "youngs_modulus": "16e9", "density": 11340, "section": "0.003", "kappa": "29e-6",
    "contacts": 20, "mu_d": "0.5", "mu_s": "0.6", "tan_alpha": "0.25",
}  # fmt: skip
SLOPE = math.atan(0.25)


def lead(**changed: Any) -> Solid:
    return physical(**LEAD | changed)


@pytest.mark.parametrize(("amplitude", "period"), [(0.01, DAY), (10.0, 3600)])
def test_the_dimensionless_laws_are_the_printed_ones_in_si_units(
    amplitude: float, period: float
) -> None:
    """Eqs. 25 and 26 as they stand in the paper, in mm/day and K."""
    solid, up = lead(), lead(tan_alpha="-0.25")  # a negative slope is the mirror image
    least = 9.80665 * 11340 * 3 / (2 * 16e9) * (0.5 * math.cos(SLOPE) - math.sin(SLOPE))
    per_half_cycle = 3 * math.tan(SLOPE) / 0.5 * (29e-6 * amplitude - least)
    printed = per_half_cycle / (period / 2) * DAY * 1000
    assert solid.continuum_velocity(amplitude, period) == pytest.approx(printed, rel=1e-13, abs=0)
    assert up.continuum_velocity(amplitude, period) == -solid.continuum_velocity(amplitude, period)
    change = solid.critical_temperature_change
    assert change == pytest.approx(least / 29e-6, rel=1e-14, abs=0)
    assert up.critical_temperature_change == change
    law = threshold_amplitude(n=20, l0=solid.chain.l0, mu_d=0.5, tan_alpha=0.25)
    assert solid.dilation(change) == pytest.approx(law, rel=1e-14, abs=0)


HALF_DAYS = [f"2024-06-{1 + k // 2:02}T{12 * (k % 2):02}:00" for k in range(60)]
SWING = [10 + 15 * (-1) ** k for k in range(60)]


def month(solid: Solid, temperatures: Any = SWING, times: Any = HALF_DAYS) -> TemperatureRecord:
    return TemperatureRecord.of(temperatures, solid.kappa, 10, times=times)


def yearly(solid: Solid, swing: Any, period: float) -> float:
    """Return the mm/year of the law of the sliding limit under cycles of so many kelvin."""
    found = prediction(solid.chain, Cycles(solid.dilation(swing), 1))
    assert found is not None
    return 365.25 * solid.millimetres_per_day(found.sliding[0], period)


def test_a_month_of_equal_days_comes_down_at_the_rate_of_the_cycles_law() -> None:
    solid = lead(tan_alpha="0.23")  # one pivot alone
    descent = solid.creep(month(solid))
    moved = descent.millimetres
    assert moved[-1] - moved[3] == pytest.approx(28 * yearly(solid, 15, DAY) / 365.25, rel=1e-9)
    assert descent.millimetres_per_year == pytest.approx(moved[-1] / 29.5 * 365.25, rel=1e-12)
    assert "not for a year" in repr(descent)
    said = descent.summary()
    assert said["weather"] is None  # of one month
    n, many = descent.contacts
    assert n == said["contacts"] == 20
    for rate in said["rates"]:
        assert rate["mu_d"] == pytest.approx(rate["friction_factor"] * 0.5)
    finer = solid.altered(contacts=many).creep(month(solid))
    assert finer.contacts == (many, 2 * many)
    artefact = descent.millimetres_per_year / finer.millimetres_per_year - 1
    assert said["artefact_of_contacts"] == pytest.approx(artefact)
    numbered = month(solid, times=[0.5 * k for k in range(60)])  # without dates
    counted = solid.creep(numbered, time_unit=DAY)
    assert counted.millimetres_per_year == pytest.approx(descent.millimetres_per_year, rel=1e-12)
    assert counted.elapsed.tolist() == descent.elapsed.tolist()


def test_weather_is_told_by_how_much_blocks_of_ten_days_differ() -> None:
    solid, days = lead(tan_alpha="0.23"), 80
    warm = [10 + (11 + 4 * (k // 20 % 2)) * (-1) ** k for k in range(2 * days)]
    times = [0.5 * k for k in range(2 * days)]
    descent = solid.creep(month(solid, warm, times), time_unit=DAY)
    apart = 10 / 365.25 * (yearly(solid, 15, DAY) - yearly(solid, 11, DAY))
    expected = math.sqrt(365.25 / 10 * apart**2 / 2)
    assert descent.summary()["weather"] == pytest.approx(expected, rel=0.05)


ONE_DAY = "ignore:in .*hadcet.* the minimum is above the maximum on 1 of 52503 days"


@pytest.mark.filterwarnings(ONE_DAY)
def test_the_roof_of_bristol_is_three_lines_of_python() -> None:
    (member,) = load_scene("bristol-roof").members()
    record = member.experiment.drive
    descent = member.body.creep(record)
    assert member.body.chain == member.experiment.chain
    assert "220.1 mm/year; measured: 228.6 mm/year" in repr(descent)
    assert 10 < descent.summary()["weather"] < 16
    # 52,503 days, the first and the last, and the one whose minimum is above its maximum
    assert (record.target_count, record.origin) == (2 * 52_503, "1878-01-01T05:00:00")
    (strange,) = np.flatnonzero(record.temperatures[::2] > record.temperatures[1::2])
    assert str(record.dates[2 * strange])[:10] == "1884-12-23"


IN_KELVIN = """
drive = { kind = "cycles", temperature_amplitude = 15, cycles = 20 }
run = { solver = "sliding", record = ["x_G"] }
physical.time_unit = 43200
""" + "\n".join(
    f"physical.{name} = {value}" for name, value in {**LEAD, "tan_alpha": "0.23"}.items()
)


def test_cycles_in_kelvin_come_down_at_the_rate_of_the_law_in_si_units(command: Command) -> None:
    Path("sheet.toml").write_text(IN_KELVIN)
    (member,) = load_scene("sheet.toml").members()
    assert member.experiment.drive == Cycles(Fraction(15) * member.body.kappa, 20)
    told = command("run", "sheet.toml", "--json").json["descent"]
    law = yearly(member.body, 15, DAY)
    assert told["millimetres_per_year"] == pytest.approx(law, rel=1e-12)
    assert told["days"] == 20
    descent = member.body.creep(member.experiment.drive, time_unit=DAY // 2)
    assert told == descent.summary()
    assert descent.temperatures[:2] == pytest.approx([15, -15], rel=1e-14)


SHAPE = {"length": 3, "section": "0.003", "mu_s": "0.55", "tan_alpha": "0.3"}


def test_friction_between_two_ends_makes_a_rate_between_two_ends() -> None:
    between = physical(**SHAPE, mu_d=["0.4", "0.5"], material="lead")
    assert between.chain.mu_d == Fraction(9, 20)
    drive = Cycles(between.dilation(10), cycles=20)
    descent = between.creep(drive, time_unit=43200)
    assert "rates" not in vars(descent)  # six runs wait until they are asked for
    least, most = descent.interval
    n = descent.contacts[1]
    for mu, rate in (("0.4", most), ("0.5", least)):
        alone = physical(**SHAPE, mu_d=mu, material="lead", contacts=n)
        found = alone.creep(drive, time_unit=43200)
        assert rate == pytest.approx(found.millimetres_per_year, rel=1e-9)
    assert f"{least:.4g} to {most:.4g} mm/year for mu_d from 0.5 to 0.4" in repr(descent)
    mirrored = physical(**SHAPE | {"tan_alpha": "-0.3"}, mu_d=["0.4", "0.5"], material="lead")
    said = f"-{least:.4g} to -{most:.4g} mm/year for mu_d from 0.5 to 0.4"
    assert said in repr(mirrored.creep(drive, time_unit=43200))


def test_a_solid_that_does_not_move_has_a_rate_of_zero() -> None:
    still = lead(tan_alpha=0).creep(Cycles("0.001", 20), time_unit=DAY)
    assert repr(still).startswith("descent: 0 to 0 mm/year")
    assert still.summary()["artefact_of_contacts"] is None


def scene_of(text: str = IN_KELVIN, **changed: Any) -> list[Any]:
    settings = {f"physical.{name}": value for name, value in changed.items()}
    return list(Scene.from_text(text).with_settings(settings).members())


@pytest.mark.parametrize(
    ("refused", "sentence"),
    [
        (lambda: lead(length=0), "length = 0: must be positive"),
        (lambda: lead(material="tin"), "material = 'tin': must be one of lead, copper, zinc, st"),
        (lambda: lead().millimetres_per_day(1.0, 0), "period = 0: must be positive"),
        (lambda: lead().creep(month(lead()), time_unit=60), "time_unit = 60: must be left out"),
        (lambda: lead().creep(Cycles("0.001", 3)), "time_unit = None: must be given: seconds"),
        (lambda: lead(kappa="1e-5").creep(month(lead())), "kappa = "),
        (lambda: Walk(lead(contacts=7), lead().creep(month(lead())).run, 1.0), "run = "),
        (lambda: scene_of(IN_KELVIN.replace("cycles = 20", "cycles = 20, amplitude = 0.1")),
         "drive.temperature_amplitude = 15: must"),
        (lambda: scene_of(IN_KELVIN + "\nchain.n = 3"), "chain.n = 3: must not be given beside"),
        (lambda: scene_of(mu_s="0.1"), "physical.mu_s = '0.1': must be at least mu_d"),
    ],
)  # fmt: skip
@pytest.mark.filterwarnings(ONE_DAY)
def test_what_makes_no_sense_is_refused_by_field_with_a_remedy(
    refused: Callable[[], Any], sentence: str
) -> None:
    with pytest.raises(InputError) as told:
        refused()
    assert str(told.value).startswith(sentence)


def test_the_walks_of_a_roof_and_of_a_pipe_are_one_table_that_a_file_keeps(tmp_path: Path) -> None:
    roof, pipe = lead(contacts=7), pipeline(length=1000, axial_stiffness="2e9",
        submerged_weight=400, friction="0.5", kappa="1e-5", contacts=9)  # fmt: skip
    record = ("x_G", "x", "tension")
    heated = Cycles(roof.dilation(10), 3)
    for walk in (
        roof.creep(heated, time_unit=DAY // 2, record=record),
        pipe.walk(60, cycles=3),
    ):
        table, n = walk.dataset, walk.body.chain.n
        assert {name: value.dims for name, value in table.items()}.items() >= {
            "millimetres": ("target",), "displacement": ("target", "slider"),
            "temperatures": ("target",), "axial_force": ("target", "place"),
        }.items()  # fmt: skip
        assert (table.axial_force.shape, walk.per_cycle.shape) == ((6, n + 1), (3,))
        assert table.displacement.mean("slider").values == pytest.approx(walk.millimetres)
        assert walk.per_cycle.sum() == pytest.approx(walk.total)
        table.to_netcdf(tmp_path / "walk.nc", engine="h5netcdf")
        assert xr.load_dataset(tmp_path / "walk.nc", engine="h5netcdf").equals(table)
        assert repr(walk).count("\n") == len(walk.lines()) - 1
        assert walk == replace(walk)
    with pytest.raises(InputError, match="must be a solid, for a rate per year"):
        walk.rates  # noqa: B018
