"""Velocities: what is averaged over what, how well it is known, and why it may not be."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from exactcreep import Chain, Cycles, GaussianSteps, Targets, TemperatureRecord, creep
from exactcreep.model.drive import Drive
from exactcreep.quasistatic.creep import AccuracyWarning
from exactcreep.quasistatic.velocity import FIRST_LOOK, next_look
from tests.paper import paper_chain
from tests.quasistatic.runs import SIX, TWO, TWO_SURE

WEAK = paper_chain(2, tan_alpha="0.005")
PULLED = paper_chain(8, "0.02", tan_alpha="0.2", end_forces=("0.3", "-0.1"))
BRIEF = Cycles("0.01", 5)


@pytest.mark.parametrize(
    ("drive", "asked", "left_out"),
    [
        (Cycles("0.01", 50), None, 10),
        (Cycles("0.01", 5), None, 2),
        (Cycles("0.01", 55), None, 12),  # a tenth, at least two and even for cycles
        (Cycles("0.01", 50), 7, 8),
        (Targets(["0.01", "-0.01"] * 30), None, 0),
        (Targets(["0.01", "-0.01"] * 30), 4, 4),
    ],
)
def test_the_velocity_is_the_displacement_after_the_burn_in_over_the_targets(
    drive: Drive, asked: int | None, left_out: int
) -> None:
    result = creep(TWO, drive, seed=3, burn_in=asked)
    x = np.append(0, result.recorded["x_G"])
    assert result.burn_in == left_out
    assert result.half_cycles == drive.target_count
    mean = (x[-1] - x[left_out]) / (drive.target_count - left_out)
    assert result.velocity == pytest.approx(mean, rel=1e-13, abs=0)
    named = "half-cycle" if drive.cyclic else "target"
    assert result.velocity_units.endswith(named)
    assert f"{named}s {left_out + 1} to {drive.target_count}" in result.finding


def record_at(hours: list[float]) -> TemperatureRecord:
    """Return a record of two-day cycles of 10 degrees, sampled at these hours."""
    degrees = [round(10 * math.sin(2 * math.pi * hour / 48), 12) for hour in hours]
    return TemperatureRecord.of(degrees, "0.001", 0, times=hours)


def test_the_velocity_of_a_record_is_per_unit_of_time_however_it_is_sampled() -> None:
    extremes = [float(hour) for hour in range(12, 12 + 24 * 80, 24)]
    fine = [12 + 6.0 * k for k in range(4 * 79 + 1)]
    results = [creep(TWO_SURE, record_at(hours)) for hours in (extremes, fine)]
    for result in results:
        assert result.burn_in == 0
        assert result.velocity_units == "g tau_dyn^2 per unit of time"
        assert result.velocity == pytest.approx(result.x_G / (24 * 79), rel=1e-14, abs=0)
        assert result.velocity == pytest.approx(results[0].velocity, rel=1e-9, abs=0)
    assert results[0].velocity > 0
    single = creep(TWO_SURE, record_at([12.0]))
    assert math.isnan(single.velocity)
    assert single.velocity_reason == "one row of a record lasts no time"


@pytest.mark.parametrize(
    ("n", "above", "cycles", "least"),
    [(3, "1.4", 100, 0), (6, "1.1", 100, 0), (6, "1.15", 600, 10), (6, "1.5", 100, 25)],
)
def test_an_error_near_the_threshold_covers_the_long_run_mean_or_is_unknown(
    n: int, above: str, cycles: int, least: int
) -> None:
    """A short run may see creep alone, or rest alone, of a chain that alternates between them."""
    chain = paper_chain(n)
    amplitude = float(above) * n * (chain.friction - chain.sin_alpha) / 2000
    late = [creep(chain, Cycles(amplitude, 4000), seed=seed, burn_in=4000) for seed in (30, 31, 32)]
    mean = np.mean([run.velocity for run in late])
    runs = [creep(chain, Cycles(amplitude, cycles), seed=seed) for seed in range(30)]
    errors = np.array([run.velocity_error for run in runs])
    known = ~np.isnan(errors)
    apart = np.abs(np.array([run.velocity for run in runs]) - mean)
    assert known.sum() >= least
    assert (apart > 1.96 * errors)[known].sum() <= 0.1 * known.sum()


@pytest.mark.parametrize(
    ("chain", "drive", "given", "reason"),
    [
        (TWO, BRIEF, {"burn_in": 10}, "no whole cycle"),
        (TWO, Targets(["0.01"]), {"burn_in": 1}, "no target"),
        (paper_chain(3, "0", l0=10, tan_alpha="0.7"), BRIEF, {}, "the chain runs away"),
        (TWO, BRIEF, {}, "8 half-cycles"),
        (WEAK, GaussianSteps("0.01", 1000), {}, "900 targets"),
        (SIX, Cycles("0.0008", 100), {}, "180 half-cycles"),
        (PULLED, Cycles("0.00115", 200), {}, "360 half-cycles"),
        (TWO, GaussianSteps("1e-6", 100), {}, "nothing happened in 90 targets"),
        (TWO, GaussianSteps("0.01", 9000), {"burn_in": 8990}, "10 targets"),
    ],
)
def test_a_velocity_that_is_not_known_says_why(
    chain: Chain, drive: Drive, given: dict[str, int], reason: str
) -> None:
    result = creep(chain, drive, **given)
    assert math.isnan(result.velocity_error)
    assert math.isnan(result.velocity) is reason.startswith("no ")
    assert result.velocity_reason.startswith(reason)
    assert result.summary()["velocity_reason"] == result.velocity_reason


def test_a_run_ends_at_the_first_look_at_which_its_velocity_is_known_well_enough() -> None:
    drive, looks = Cycles("0.002", 20_000), [FIRST_LOOK]
    run = creep(SIX, drive, seed=1, accuracy="0.02")
    while looks[-1] < run.half_cycles:
        looks.append(next_look(looks[-1]))
    assert run.half_cycles == looks[-1] < drive.target_count
    assert run.report["accuracy_reached"]
    assert run.report["relative_error"] == 1.96 * run.velocity_error / run.velocity <= 0.02
    for look in looks[:-1]:
        with pytest.warns(AccuracyWarning, match="not 0.02"):
            shorter = creep(SIX, Cycles("0.002", look // 2), seed=1, accuracy="0.02")
        assert shorter.half_cycles == look
        assert shorter.report["accuracy_reached"] is False
        assert not shorter.report["relative_error"] <= 0.02  # or it is not known
    # how often it is looked at changes no bit of the way, and not what is averaged
    same = Cycles("0.002", run.half_cycles // 2)
    plain = creep(SIX, same, seed=1, burn_in=run.burn_in)
    assert (run.state, run.velocity) == (plain.state, plain.velocity)
    assert 2 <= run.burn_in <= run.half_cycles // 10 + 2


ROUGHER = [f"{0.4 + 0.03 * k:.2f}" for k in (3, 0, 5, 1, 6, 2, 4, 3)]


@pytest.mark.filterwarnings("ignore::exactcreep.results.PhysicsWarning")  # a draw below mu_d
@pytest.mark.parametrize(
    "kind",
    [
        {"mu_d": ROUGHER, "mu_s": [f"{float(mu) + 0.1:.2f}" for mu in ROUGHER]},
        {"mu_s": ["0.58", "0.62"] * 4},
        {"mu_d": ["0.6"] * 4 + ["0.4"] * 4, "mu_s": ["0.7"] * 4 + ["0.5"] * 4},
        {"mu_d": ["0.5"] * 3 + ["1.1"] + ["0.5"] * 4, "mu_s": ["0.6"] * 3 + ["1.2"] + ["0.6"] * 4},
        {"end_forces": ["0.3", "-0.1"]},
    ],
    ids=["scattered friction", "scattered excess", "two halves", "one rough", "end forces"],
)
def test_the_error_of_a_chain_that_differs_is_the_scatter_over_twenty_seeds(
    kind: dict[str, Any],
) -> None:
    about = {"n": 8, "l0": 1000, "mu_d": "0.5", "mu_s": "0.6", "sigma_mu": "0.02"}
    chain = Chain(**about | {"tan_alpha": "0.2"} | kind)
    runs = [creep(chain, Cycles("0.004", 200), seed=seed, record=()) for seed in range(20)]
    scatter = np.std([run.velocity for run in runs], ddof=1)
    errors = np.array([run.velocity_error for run in runs])
    assert np.isnan(errors).sum() <= 6
    # 20 seeds give their scatter to 16 %; the error is the largest of three estimates, times 1.2
    assert 0.45 < scatter / np.sqrt(np.nanmean(errors**2)) < 1.3
