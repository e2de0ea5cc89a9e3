"""A solid in SI units and its dimensionless chain say the same thing."""

from __future__ import annotations

import json
import math
from fractions import Fraction

import numpy as np
import pytest

from exactcreep.cli import status
from exactcreep.laws import prediction, threshold_amplitude
from exactcreep.model.drive import Cycles
from exactcreep.model.numbers import InputError
from exactcreep.model.temperature_record import TemperatureRecord
from exactcreep.scene import Scene, load_scene
from exactcreep.solid import Descent, physical

DAY = 86400
LEAD = {
    "length": 3,
    "youngs_modulus": "16e9",
    "density": 11340,
    "section": "0.003",
    "kappa": "29e-6",
    "contacts": 20,
    "mu_d": "0.5",
    "mu_s": "0.6",
    "tan_alpha": "0.25",
}
SLOPE = math.atan(0.25)


def printed_velocity(amplitude_kelvin, period):
    """Eq. (vitessecontinue) as it stands in the paper, in mm/day."""
    length, modulus, density, kappa, mu_d, g = 3.0, 16e9, 11340.0, 29e-6, 0.5, 9.80665
    bracket = kappa * amplitude_kelvin - g * density * length / (2 * modulus) * (
        mu_d * math.cos(SLOPE) - math.sin(SLOPE)
    )
    per_half_cycle = length * math.tan(SLOPE) / mu_d * bracket
    return per_half_cycle / (period / 2) * DAY * 1000


def test_the_dimensionless_law_in_millimetres_per_day_is_the_printed_one_in_si_units():
    solid = physical(**LEAD)
    for amplitude in (0.01, 1.0, 10.0):
        for period in (3600, DAY):
            assert solid.continuum_velocity(amplitude, period) == pytest.approx(
                printed_velocity(amplitude, period), rel=1e-13, abs=0
            )


def test_the_critical_temperature_change_is_the_printed_formula():
    solid = physical(**LEAD)
    margin = 0.5 * math.cos(SLOPE) - math.sin(SLOPE)
    printed = 9.80665 * 11340 * 3 / (2 * 16e9 * 29e-6) * margin
    assert solid.critical_temperature_change == pytest.approx(printed, rel=1e-14, abs=0)
    law = threshold_amplitude(n=20, l0=solid.chain.l0, mu_d=0.5, tan_alpha=0.25)
    assert solid.dilation(solid.critical_temperature_change) == pytest.approx(law, rel=1e-14, abs=0)


def test_the_papers_estimate_of_the_least_dilation_is_ten_times_its_own_formula():
    # L = 1 cm, Y = 100 GPa, rho = 10^4 kg/m^3 are said to give "about 10^-8"
    solid = physical(**LEAD | {"length": "0.01", "youngs_modulus": "1e11", "density": 10**4})
    amplitude = float(solid.dilation(solid.critical_temperature_change))
    formula = 9.80665 * 1e4 * 0.01 / (2 * 1e11) * (0.5 - 0.25) * math.cos(SLOPE)
    assert amplitude == pytest.approx(formula, rel=1e-12, abs=0)
    assert 1.1e-9 < amplitude < 1.3e-9


def test_units_follow_from_mass_and_stiffness_exactly():
    solid = physical(**LEAD)
    mass = Fraction(11340) * Fraction(3, 1000) * 3 / 20
    stiffness = 20 * Fraction(16 * 10**9) * Fraction(3, 1000) / 3
    g = Fraction("9.80665")
    assert (solid.mass, solid.stiffness) == (mass, stiffness)
    assert solid.length_unit == g * mass / stiffness
    assert solid.force_unit == mass * g
    assert solid.tau_dyn == pytest.approx(math.sqrt(mass / stiffness), rel=1e-15, abs=0)
    assert solid.seconds(2.0) == 2 * solid.tau_dyn
    # the natural length of a spring is one piece of the solid
    assert solid.chain.l0 * solid.length_unit == Fraction(3, 20)
    assert solid.metres(solid.chain.l0) == Fraction(3, 20)
    # one kelvin makes the force kappa Y S in a piece that is held
    held = solid.newtons(solid.chain.l0 * solid.dilation(1))
    assert held == Fraction("29e-6") * 16 * 10**9 * Fraction(3, 1000)


def test_velocities_go_there_and_back():
    solid = physical(**LEAD)
    velocity = Fraction(17, 3)
    there = solid.millimetres_per_day(velocity, DAY)
    assert solid.per_year(velocity, DAY / 2) == pytest.approx(365.25 * float(there), rel=1e-14)
    # one unit of length per half a day is two units a day
    assert solid.millimetres_per_day(Fraction(1), DAY) == 2000 * solid.length_unit
    assert solid.temperature_change(solid.dilation("0.1")) == Fraction(1, 10)


def test_many_contacts_creep_like_the_continuous_solid():
    gaps = []
    for contacts in (50, 200, 800):
        solid = physical(**LEAD | {"contacts": contacts, "tan_alpha": "0.23"})
        found = prediction(solid.chain, Cycles(solid.dilation(10), 1))
        velocity = sum(found.sliding) / len(found.sliding)
        measured = solid.millimetres_per_day(velocity, DAY)
        gaps.append(abs(measured / solid.continuum_velocity(10, DAY) - 1))
    # plateaus of height 2 in N + 3 - 2i: the deviation is at most one of N tan(alpha)/mu_d
    assert all(gap <= 1 / (n * 0.46) + 1e-12 for gap, n in zip(gaps, (50, 200, 800), strict=True))


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"length": 0}, "length"),
        ({"youngs_modulus": -1}, "youngs_modulus"),
        ({"density": "heavy"}, "density"),
        ({"section": 0}, "section"),
        ({"kappa": 0}, "kappa"),
        ({"gravity": "inf"}, "gravity"),
        ({"contacts": -1}, "contacts"),
        ({"mu_s": "0.4"}, "mu_s"),
    ],
)
def test_bad_quantities_are_refused_by_name(change, field):
    with pytest.raises(InputError) as caught:
        physical(**LEAD | change)
    assert caught.value.field == field


def test_a_negative_slope_is_the_mirror_image():
    down, up = physical(**LEAD), physical(**LEAD | {"tan_alpha": "-0.25"})
    assert up.critical_temperature_change == down.critical_temperature_change
    assert up.continuum_velocity(10, DAY) == -down.continuum_velocity(10, DAY)


def test_a_period_must_be_positive():
    with pytest.raises(InputError, match="period"):
        physical(**LEAD).millimetres_per_day(1.0, 0)


# --- under recorded temperatures ------------------------------------------------------------------

HALF_DAYS = [f"2024-06-{1 + k // 2:02}T{12 * (k % 2):02}:00" for k in range(60)]
SWING = [10 + 15 * (-1) ** k for k in range(60)]


def month(solid, temperatures=SWING, times=HALF_DAYS):
    return TemperatureRecord.of(temperatures, solid.kappa, 10, times=times)


def test_a_month_of_equal_days_comes_down_at_the_rate_of_the_cycles_law():
    solid = physical(**LEAD | {"tan_alpha": "0.23"})  # one pivot alone
    descent = solid.creep(month(solid))
    found = prediction(solid.chain, Cycles(solid.dilation(15), 1))
    daily = solid.millimetres_per_day(found.sliding[0], DAY)
    moved = descent.millimetres
    assert moved[-1] - moved[3] == pytest.approx(28 * daily, rel=1e-9)
    assert descent.total == pytest.approx(moved[-1], rel=1e-14)
    assert descent.days == 29.5
    assert descent.millimetres_per_year == pytest.approx(moved[-1] / 29.5 * 365.25, rel=1e-12)
    assert "no year's" in repr(descent)


def test_times_without_dates_need_their_unit_and_then_say_the_same():
    solid = physical(**LEAD)
    numbered = month(solid, times=[0.5 * k for k in range(60)])
    with pytest.raises(InputError, match="time_unit = None: must be given"):
        solid.creep(numbered)
    with pytest.raises(InputError, match="time_unit = 60: must be left out"):
        solid.creep(month(solid), time_unit=60)
    counted, dated = solid.creep(numbered, time_unit=DAY), solid.creep(month(solid))
    assert counted.millimetres_per_year == pytest.approx(dated.millimetres_per_year, rel=1e-12)
    assert counted.elapsed.tolist() == dated.elapsed.tolist() == [0.5 * k for k in range(60)]


def test_what_few_contacts_do_is_told_from_what_friction_does():
    solid = physical(**LEAD | {"contacts": 14, "mu_d": "0.45", "tan_alpha": "0.3"})
    descent = solid.creep(month(solid))
    rates = descent.rates
    assert descent.contacts == (14, 150)  # the next pivot is worth 2/100 of N tan_alpha/mu_d = 100
    # 14 * 0.3/0.45 = 9.3: the pivot stays up to mu_d = 0.525, and moves on below 0.42
    assert rates[14, Fraction(11, 10)] == pytest.approx(rates[14, 1], rel=0.03)
    jump = rates[14, Fraction(9, 10)] / rates[14, 1] - 1
    assert jump == pytest.approx(descent.pivot_step, abs=0.03)
    for n, allowed in ((14, 0.15), (150, 0.02)):
        for factor in (Fraction(9, 10), Fraction(11, 10)):
            gap = rates[n, factor] / rates[n, 1] * float(factor) - 1
            assert abs(gap) < allowed
    assert descent.artefact == pytest.approx(rates[14, 1] / rates[150, 1] - 1, rel=1e-12)
    many = physical(**LEAD | {"contacts": 0, "mu_d": "0.45", "tan_alpha": "0.3"})
    assert many.chain.n == 150
    found = many.creep(month(many))
    assert found.millimetres_per_year == pytest.approx(rates[150, 1], rel=1e-12)
    assert found.contacts == (150, 300)
    assert abs(found.artefact) < 0.01
    assert "N = 150 is enough" in repr(descent)


def test_an_altered_solid_is_the_one_that_is_made_so():
    solid = physical(**LEAD | {"sigma_mu": "0.02"})
    rougher = {"mu_d": "0.55", "mu_s": "0.66", "sigma_mu": "0.022"}
    assert solid.altered(contacts=7) == physical(**LEAD | {"contacts": 7, "sigma_mu": "0.02"})
    assert solid.altered(friction="1.1") == physical(**LEAD | rougher)
    with pytest.raises(InputError, match="friction = 0: must be positive"):
        solid.altered(friction=0)


def test_a_solid_that_less_friction_does_not_hold_has_no_rate_there():
    solid = physical(**LEAD | {"mu_d": "0.26"})
    descent = solid.creep(month(solid))
    assert descent.rates[20, Fraction(9, 10)] == math.inf
    assert math.isfinite(descent.millimetres_per_year)
    assert "without bound where it is 10 % less" in str(descent)


def test_the_exact_solver_answers_in_millimetres_too():
    solid = physical(**LEAD | {"contacts": 6, "sigma_mu": "0.01"})
    record = month(solid, SWING[:12], HALF_DAYS[:12])
    exact = solid.creep(record, solver="exact", seed=3)
    assert exact.result.solver == "exact"
    assert exact.total == pytest.approx(solid.creep(record).total, rel=0.05)
    assert "one seed alone" in repr(exact)
    several = solid.creep(record, solver="exact", seed=3, seeds=2)
    rates = [solid.creep(record, solver="exact", seed=k).millimetres_per_year for k in (3, 4, 5)]
    assert several.disorder == pytest.approx(np.std(rates, ddof=1), rel=1e-12)
    assert "between 3 seeds" in repr(several)


def test_what_has_no_effect_in_the_sliding_limit_is_refused_or_said():
    solid = physical(**LEAD | {"sigma_mu": "0.02"})
    for name in ("seed", "seeds"):
        with pytest.raises(InputError, match=f"{name} = 3: has no effect in the sliding limit"):
            solid.creep(month(solid), **{name: 3})
    assert "mu_s = '0.6', sigma_mu = '0.02' and the seed have no effect" in repr(
        solid.creep(month(solid))
    )
    assert "no effect" not in repr(
        (smooth := physical(**LEAD | {"mu_s": "0.5"})).creep(month(smooth))
    )


def test_how_much_years_differ_is_that_of_the_years_or_of_blocks_of_days():
    solid = physical(**LEAD)
    rng = np.random.default_rng(3)
    days = np.arange(8 * 366)
    swing = rng.normal(10, 3, days.size)
    times = np.array("2001-01-01", dtype="datetime64[h]") + np.repeat(24 * days, 2)
    times[1::2] += np.timedelta64(12, "h")
    values = 10 + np.repeat(swing, 2) * np.tile([-1, 1], days.size)
    descent = solid.creep(TemperatureRecord.of(values, solid.kappa, 10, times=times))
    yearly = descent.stretches("365.25")
    assert yearly.size == 8
    assert descent.weather == pytest.approx(yearly.std(ddof=1), rel=1e-12)
    # independent days that differ by 3 K: years differ by the root of their days
    expected = 3 * descent.total / swing.sum() * math.sqrt(365.25)
    assert descent.weather == pytest.approx(expected, rel=0.6)  # of 8 years
    part = solid.creep(TemperatureRecord.of(values[:1400], solid.kappa, 10, times=times[:1400]))
    assert part.weather == pytest.approx(expected, rel=0.25)  # of 70 blocks
    assert "from the 10-day blocks" in repr(part)
    assert math.isnan(solid.creep(month(solid)).weather)


def test_a_record_of_another_material_is_refused():
    solid = physical(**LEAD)
    with pytest.raises(InputError, match=r"kappa = .*must be the solid's"):
        solid.creep(TemperatureRecord.of([10, 20], "1e-5", 10, times=HALF_DAYS[:2]))
    with pytest.raises(InputError, match="must be a TemperatureRecord"):
        solid.creep([10, 20])
    with pytest.raises(InputError, match="must be a run of the solid's chain"):
        Descent.of(solid.altered(contacts=7), solid.creep(month(solid)).result)
    with pytest.raises(InputError, match="time_unit = None: must be given: seconds per half-cycle"):
        solid.creep(Cycles("0.001", 3))
    with pytest.raises(InputError, match="must hold x_G"):
        _ = solid.creep(month(solid), record=()).millimetres


# --- scenes in SI units ---------------------------------------------------------------------------


def test_the_roof_of_bristol_is_one_command_and_three_lines_of_python(tmp_path, capsys):
    picture = tmp_path / "roof.png"
    assert status(["run", "bristol-roof", "--plot", str(picture), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert picture.read_bytes().startswith(b"\x89PNG")
    (member,) = load_scene("bristol-roof").members()
    assert member.solid.chain == member.experiment.chain
    record = member.experiment.drive
    descent = member.solid.creep(record)
    assert told["descent"] == descent.summary()
    assert told["descent"]["millimetres_per_year"] == pytest.approx(220.1, abs=0.05)
    assert told["descent"]["measured_millimetres_per_year"] == 228.6
    assert 10 < descent.weather < 16
    said = repr(descent)
    assert "220.1 mm/year; measured: 228.6 mm/year" in said
    assert "13 mm (standard deviation, from the years of this record)" in said
    # 52,503 days, the first and the last, and the one whose minimum is above its maximum
    assert (record.half_cycles, record.origin) == (2 * 52_503, "1878-01-01T05:00:00")
    assert record.temperatures[[0, 1, -2, -1]].tolist() == [1.4, 6.6, 6.0, 16.0]
    (strange,) = np.flatnonzero(record.temperatures[::2] > record.temperatures[1::2])
    assert str(record.dates[2 * strange])[:10] == "1884-12-23"


IN_KELVIN = """
[physical]
length = 3
youngs_modulus = 16e9
density = 11340
section = 0.003
kappa = 29e-6
contacts = 20
mu_d = 0.5
mu_s = 0.6
tan_alpha = 0.23
time_unit = 43200

[drive]
kind = "cycles"
temperature_amplitude = 15
cycles = 20

[run]
solver = "sliding"
record = ["x_G"]
"""


def test_cycles_in_kelvin_come_down_at_the_rate_of_the_law_in_si_units(tmp_path, capsys):
    (tmp_path / "sheet.toml").write_text(IN_KELVIN)
    (member,) = load_scene(tmp_path / "sheet.toml").members()
    assert member.experiment.drive == Cycles(Fraction(15) * member.solid.kappa, 20)
    assert status(["run", str(tmp_path / "sheet.toml"), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)["descent"]
    found = prediction(member.solid.chain, member.experiment.drive)
    daily = member.solid.millimetres_per_day(found.sliding[0], DAY)
    assert told["millimetres_per_year"] == pytest.approx(365.25 * daily, rel=1e-12)
    assert told["days"] == 20
    descent = member.solid.creep(member.experiment.drive, time_unit=DAY // 2)
    assert told == descent.summary()
    assert descent.temperatures[:2] == pytest.approx([15, -15], rel=1e-14)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (("[drive]", "[drive]\namplitude = 0.1"), "drive.temperature_amplitude = 15: must"),
        (("= 15", '= "warm"'), "temperature_amplitude = 'warm': must be a finite number"),
        (("= 43200", "= 0"), "physical.time_unit = 0: must be positive"),
        (("temperature_amplitude", "sigma_temperature"), "drive.sigma_temperature"),
    ],
)
def test_temperatures_of_a_scene_are_refused_by_key(change, told):
    with pytest.raises(InputError) as caught:
        Scene.from_text(IN_KELVIN.replace(*change)).members()
    assert told in str(caught.value)


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        ({"physical.time_unit": 60}, "physical.time_unit = 60: must be left out"),
        ({"chain.n": 3}, "chain.n = 3: must not be given beside [physical]"),
        ({"vary.chain.n": [3]}, "chain.n = [3]: must not be given beside [physical]"),
        ({"physical.contact": 3}, "did you mean physical.contacts?"),
        ({"physical.mu_s": "0.1"}, "physical.mu_s = '0.1': must be at least mu_d"),
        ({"physical.length": 0}, "physical.length = 0: must be positive"),
        ({"drive.kappa": "1e-5"}, "drive.kappa = '1e-5': must be physical.kappa"),
    ],
)
def test_a_scene_in_si_units_is_refused_by_key(settings, told):
    with pytest.raises(InputError) as caught:
        load_scene("bristol-roof").with_settings(settings).members()
    assert told in str(caught.value)


def test_a_scene_in_si_units_varies_its_contacts(tmp_path):
    (tmp_path / "sheet.toml").write_text(IN_KELVIN)
    scene = load_scene(tmp_path / "sheet.toml").with_settings({"vary.physical.contacts": [4, 14]})
    chains = [member.solid.chain for member in scene.members()]
    assert [chain.n for chain in chains] == [4, 14]
    assert chains[0].l0 / 4 == chains[1].l0 / 14
    grid, picture = str(tmp_path / "grid"), tmp_path / "grid.png"
    words = ["--set", "vary.physical.contacts=[4,14]", "--out", grid, "--plot", str(picture)]
    assert status(["sweep", str(tmp_path / "sheet.toml"), *words]) == 0
    assert picture.read_bytes().startswith(b"\x89PNG")
