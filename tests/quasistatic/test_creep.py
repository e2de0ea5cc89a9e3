"""The quasi-static loop: what it measures, what it claims, and that stopping changes nothing."""

from __future__ import annotations

import math
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import exactcreep as ec
from exactcreep import (
    Creep,
    Cycles,
    Drive,
    Evidence,
    GaussianSteps,
    InputError,
    Outcome,
    State,
    creep,
)
from exactcreep.quasistatic.creep import PhysicsWarning, run_alone
from tests.paper import paper_chain
from tests.quasistatic.runs import RECORDS, SIX, THREE, TWO_SURE, VECTORS

SHORT = Cycles("0.01", 5)


def shortened(drive: Drive, targets: int) -> Drive:
    """Return a drive of the first targets, at least one (for cycles: one whole cycle)."""
    targets = min(max(targets, 1), drive.target_count)
    if isinstance(drive, Cycles):
        return Cycles(drive.amplitude, max(targets // 2, 1))
    if isinstance(drive, GaussianSteps):
        return GaussianSteps(drive.sigma_theta, targets)
    return ec.Targets([drive.exact_target(q) for q in range(1, targets + 1)])


@pytest.mark.parametrize(
    ("chain", "drive", "outcome", "velocity", "direction"),
    [
        (TWO_SURE, Cycles("0.0003", 10), Outcome.AT_REST, 0, "none"),
        (paper_chain(1, "0", l0=1), Cycles("0.01", 3), Outcome.AT_REST, 0, "none"),
        (paper_chain(5, "0"), Cycles("0.0008", 200), Outcome.CYCLING, 0, "none"),
        # avalanches for ever, as in the mirror image
        (paper_chain(4, "0", tan_alpha=0), Cycles("0.004", 50), Outcome.CYCLING, None, "none"),
        (paper_chain(3, "0", tan_alpha=0), Cycles("0.001", 1), Outcome.CYCLING, math.nan, "none"),
        (paper_chain(3, "0"), Cycles("0.001", 50), Outcome.CREEPING, None, "downhill"),
        (paper_chain(3, "0"), Cycles("0.001", 1), Outcome.CREEPING, math.nan, "downhill"),
        (paper_chain(4, tan_alpha="0.55"), SHORT, Outcome.RUNAWAY, math.inf, "downhill"),
        (paper_chain(4, tan_alpha="-0.55"), SHORT, Outcome.RUNAWAY, -math.inf, "downhill"),
    ],
)
def test_an_outcome_says_what_the_chain_does(
    chain: Any, drive: Cycles, outcome: Outcome, velocity: float | None, direction: str
) -> None:
    result = creep(chain, drive)
    assert (result.outcome, result.direction) == (outcome, direction)
    assert (result.slip_count > 0) == (outcome not in (Outcome.AT_REST, Outcome.RUNAWAY))
    assert (result.event_count > 0) == (outcome is not Outcome.AT_REST)
    if velocity is not None:
        assert np.array_equal(result.velocity, velocity, equal_nan=True)
        told = result.summary()["velocity"]
        assert told == velocity if math.isfinite(velocity) else told is None
    assert result.dataset.sizes["spring"] == chain.n - 1
    assert (result.half_cycles < drive.target_count) == (outcome is Outcome.RUNAWAY)
    if outcome in (Outcome.CREEPING, Outcome.CYCLING):
        known = result.known_until == result.half_cycles
        assert known == (outcome is Outcome.CREEPING) == (result.evidence is Evidence.COMPUTED)
    if outcome in (Outcome.RUNAWAY, Outcome.AT_REST):
        assert result.outcome_evidence is Evidence.COMPUTED


def test_a_chain_that_returns_to_its_tensions_cycles_for_ever_whatever_it_did_before() -> None:
    six = paper_chain(6, "0", tan_alpha="0.2")
    result = creep(six, Cycles("0.001", 50))
    x = result.recorded["x_G"]
    assert result.outcome is Outcome.CYCLING
    assert x[result.burn_in - 1] < x[-1]
    assert (result.velocity, result.velocity_error) == (0, 0)
    assert "transient" in result.reason
    at_ends = x[1::2]
    assert (at_ends[result.since - 1 :] == x[-1]).all()
    assert at_ends[result.since - 2] < x[-1]
    assert creep(six, Cycles("0.001", 500)).x_G == x[-1]


LARGEST = 2**64 - 1
SAVED: dict[str, dict[str, Any]] = {
    "verlet": {
        "chain": SIX, "drive": ec.Targets(["0.01", "-1/300", 0.002, 0.01]), "seed": LARGEST,
        "start": State.prepared(SIX, [Fraction(1, 3), 0, "0.1", 0, 0], theta="0.001", seed=LARGEST),
        "record": RECORDS, "solver": "verlet", "dt": "1/20",
    },
    "accuracy": {"chain": SIX, "drive": Cycles("0.002", 20), "accuracy": "0.001"},
    "certified": {"chain": THREE, "drive": Cycles("0.0015", 2), "solver": "certified",
                  "record": RECORDS},
    "exact": {"chain": SIX, "drive": Cycles("0.004", 60), "seed": 3, "record": ("events", "x")},
    "sliding": {"chain": SIX, "drive": GaussianSteps("0.002", 120), "solver": "sliding"},
    "vectors": {"chain": THREE, "drive": VECTORS, "record": RECORDS},
}  # fmt: skip


@pytest.mark.filterwarnings("ignore::exactcreep.results.AccuracyWarning")
@pytest.mark.parametrize("run", SAVED)
def test_a_result_survives_its_file_and_knows_the_states_on_its_way(
    run: str, tmp_path: Path
) -> None:
    given = SAVED[run]
    result = creep(**given)
    result.save(tmp_path / "a.nc")
    with pytest.raises(InputError, match="exists"):
        result.save(tmp_path / "a.nc")
    result.save(tmp_path / "a.nc", force=True)
    loaded = Creep.load(tmp_path / "a.nc")
    assert loaded == result
    assert loaded != replace(result, slip_count=1)
    assert loaded.dataset.identical(result.dataset)
    assert loaded.summary() == result.summary()
    assert (
        xr.load_dataset(tmp_path / "a.nc", engine="h5netcdf")
        .drop_vars("run")
        .identical(result.dataset)
    )
    known = loaded.experiment
    assert run_alone(known) == result
    for targets in (0, 1, 2, result.half_cycles // 2, result.half_cycles):
        short = replace(known, drive=shortened(known.drive, targets), accuracy=None)
        assert short.drive.target_count in (targets, targets + 1, 2)
        assert result.state_at(short.drive.target_count) == run_alone(short).state
    if "start" in given:
        assert known.initial.tensions[0] == Fraction(1, 3)


def test_physics_out_of_range_is_warned_of_once_and_counted() -> None:
    with pytest.warns(PhysicsWarning, match="drawn below mu_d") as caught:
        result = creep(paper_chain(3, "0.3"), SHORT)
    assert [warning.filename for warning in caught] == [__file__]  # where the caller stands
    assert result.warnings == {"draws_below_mu_d": result.draws_below_mu_d}
    close = paper_chain(3, "0", l0="0.5")
    pressed = State.prepared(close, ["-0.55", "-0.3"])
    with pytest.warns(PhysicsWarning, match="crossed"):
        crossed = creep(close, Cycles("0.001", 5), start=pressed, record=())
    assert crossed.warnings["crossings"] == 10


def test_a_state_on_the_way_beyond_what_a_run_reached_or_its_file_says_is_refused() -> None:
    part = creep(SIX, Cycles("0.004", 80), record=(), max_events=500)
    assert part.state_at(part.half_cycles) == creep(SIX, part.drive).state_at(part.half_cycles)
    with pytest.raises(InputError, match="half_cycle"):
        part.state_at(part.half_cycles + 1)
    with pytest.raises(InputError, match="not reached: max_events = 10 was"):
        replace(part, event_count=9).state_at(part.half_cycles)
