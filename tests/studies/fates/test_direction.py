"""Which way a chain creeps, in the same word whoever is asked."""

from pathlib import Path

import numpy as np
import pytest

from exactcreep import Chain, Creep, InputError, Outcome, State, sweep
from exactcreep.model.outcome import direction_of
from tests.conftest import Command
from tests.questions import creep, fate, half_life, survival, threshold

UPHILL = Chain(4, 1000, "0.5", "0.612", tan_alpha="0.0058"), "0.002701"
DOWNHILL = Chain(3, 1000, "0.5", "0.6", tan_alpha="0.25"), "0.001"


def test_a_direction_is_that_of_the_slope_and_on_the_level_that_of_the_axis() -> None:
    assert [direction_of(0.1, tan) for tan in (0.3, 0, -0.3)] == ["downhill", "+x", "uphill"]
    assert [direction_of(-0.1, tan) for tan in (0.3, 0, -0.3)] == ["uphill", "-x", "downhill"]
    assert [direction_of(nothing, 0.3) for nothing in (0, 0.0, float("nan"))] == ["none"] * 3


def test_a_run_says_which_way_it_creeps(tmp_path: Path) -> None:
    chain, amplitude = UPHILL
    found = creep(chain, amplitude, 200)
    assert found.velocity == pytest.approx(-0.8193322457795766 / 2, rel=1e-12)
    assert (found.outcome, found.direction) == (Outcome.CREEPING, "uphill")
    assert "direction='uphill'" in repr(found)
    assert found.summary()["direction"] == found.dataset.attrs["direction"] == "uphill"
    found.save(tmp_path / "up.nc")
    assert Creep.load(tmp_path / "up.nc").direction == "uphill"


def test_the_mirror_image_creeps_the_same_way_along_its_slope() -> None:
    _, amplitude = UPHILL
    other = Chain(4, 1000, "0.5", "0.612", tan_alpha="-0.0058")
    found = creep(other, amplitude, 200)
    assert found.velocity > 0
    assert found.direction == "uphill"


def test_creep_downhill_rest_and_locked_chains_say_so() -> None:
    chain, amplitude = DOWNHILL
    assert creep(chain, amplitude, 50).direction == "downhill"
    assert creep(chain, amplitude, 1).direction == "downhill"  # too short for a velocity
    assert creep(chain, "0.0001", 50).direction == "none"
    assert creep(Chain(5, 1000, "0.5", "0.6", tan_alpha="0.25"), "0.00080", 200).direction == "none"
    steep = Chain(3, 1000, "0.5", "0.6", tan_alpha="-0.7")
    assert creep(steep, "0.001", 3).direction == "downhill"


def test_on_the_level_a_chain_without_symmetry_creeps_along_the_axis() -> None:
    level = Chain(4, 1000, "0.5", "0.6", tan_alpha=0)
    start = State.prepared(level, ["0.1", "-0.05", "0.02"])
    found = creep(level, "0.0015", 1000, start=start)
    assert found.velocity == pytest.approx(-6.362498559751911e-05 / 2, rel=1e-6)
    assert found.direction == "-x"
    assert creep(level, "0.0015", 200).direction == "none"


def test_tables_of_members_say_it(command: Command, tmp_path: Path) -> None:
    text = """
[chain]
n = 4
l0 = 1000
mu_d = 0.5
mu_s = 0.612
sigma_mu = 0

[drive]
kind = "cycles"
amplitude = 0.002701
cycles = 100

[vary]
chain.tan_alpha = [0.0058, 0.25]
"""
    (tmp_path / "two.toml").write_text(text)
    printed = command("run", "two.toml").out
    assert printed.count("creeping uphill") == printed.count("creeping downhill") == 2
    assert "1 creeping downhill" in printed
    single = text.split("[vary]")[0].replace("[drive]", "tan_alpha = 0.0058\n[drive]")
    (tmp_path / "one.toml").write_text(single)
    assert "creeping uphill since cycle" in command("run", "one.toml").out
    grid = sweep(tmp_path / "two.toml")
    assert grid["direction"].to_numpy().tolist() == ["uphill", "downhill"]
    assert "1 creeping uphill" in command("sweep", "two.toml").out


@pytest.mark.parametrize("solver", ["certified", "exact"])
def test_a_fate_says_which_way_it_creeps_for_ever(solver: str) -> None:
    chain, amplitude = UPHILL
    found = fate(chain, amplitude, solver=solver)
    assert found.advance == pytest.approx(-0.8193322457795766, rel=1e-12)
    assert (found.outcome, found.direction) == (Outcome.CREEPING, "uphill")
    assert found.last_advance == found.settled_after  # it has advanced all along, and goes on
    assert found.summary()["direction"] == "uphill"
    assert "direction='uphill'" in repr(found)
    assert fate(chain, "0.0001", solver=solver).direction == "none"
    level = Chain(4, 1000, "0.5", "0.6", tan_alpha=0)
    start = State.prepared(level, ["0.1", "-0.05", "0.02"])
    found = fate(level, "0.0015", start=start, solver=solver)
    assert found.advance == pytest.approx(-6.362498559751911e-05, rel=1e-9)
    assert found.direction == "-x"


def test_the_last_advance_of_what_locks_on_its_way_up_is_counted() -> None:
    chain = Chain(4, 1000, "0.5", "0.612", tan_alpha="0.0058")
    found = fate(chain, "0.0026", solver="exact")
    run = creep(chain, "0.0026", found.cycles, record="x_G")
    moves = np.abs(np.diff(run.recorded["x_G"][1::2], prepend=0.0))[: found.settled_after]
    assert found.last_advance == np.flatnonzero(moves > 1e-12)[-1] + 1


def test_a_survival_counts_creep_either_way(command: Command) -> None:
    chain, amplitude = UPHILL
    found = survival(chain, amplitude, starts=12, cycles=300)
    ways = found.directions
    assert sum(one.starts for one in ways.values()) == found.creeping.starts
    assert ways["uphill"].starts > 0
    told = found.summary()["directions"]
    assert told["uphill"]["starts"] == ways["uphill"].starts
    one = next(each for each in found.records if each.direction == "uphill")
    assert one.outcome == "creeping"
    assert "uphill" in found.dataset["direction"].values
    words = "survival --n 4 --mu-s 0.612 --tan-alpha 0.0058 --starts 12 --cycles 300"
    assert "uphill" in command(*words.split(), "--amplitude", amplitude).out


def test_creep_uphill_that_has_not_settled_is_alive() -> None:
    level = Chain(6, 1000, "0.5", "0.6", tan_alpha="-0.02")
    found = survival(level, "0.002", starts=4, cycles=200)
    assert set(found.directions) == {"downhill"}
    assert found.creeping.starts == 4


def test_a_threshold_says_which_creep_begins_there() -> None:
    chain = Chain(4, 1000, "0.5", "0.6", tan_alpha="0.015")
    up = threshold(chain, bracket=("0.00132", "0.00144"), digits=3, solver="exact")
    assert fate(chain, up.upper, solver="exact").direction == up.direction == "uphill"
    assert up.summary()["direction"] == "uphill"
    assert "direction='uphill'" in repr(up)
    down = threshold(Chain(3, 1000, "0.5", "0.6", tan_alpha="0.25"), points=50, digits=12)
    assert down.direction == "downhill"
    assert down.summary()["fate_at_upper"]["direction"] == "downhill"


def test_a_threshold_after_so_many_cycles_means_creep_downhill() -> None:
    """Relaxing from the start eight sliders move up, by less and less: no creep."""
    chain = Chain(8, 1000, "0.5", "0.6", tan_alpha="0.25")
    edge = threshold(chain, cycles=20, bracket=("0.0010751", "0.0010753"), digits=5, solver="exact")
    ends = edge.lower, edge.upper
    below, above = (creep(chain, x, 20, record="x_G").recorded["x_G"] for x in ends)
    assert below[-1] < below[-3] - 1e-6
    assert above[-1] > above[-3] + 1e-6
    assert edge.direction == "downhill"


def test_on_the_level_starts_without_symmetry_have_a_half_life() -> None:
    level = Chain(6, 1000, "0.5", "0.6", tan_alpha=0)
    for options in ({}, {"cycles": 20}):
        with pytest.raises(InputError, match="starts symmetric"):
            threshold(level, **options)
    half = half_life(level, 50, starts=16, bracket=("0.0005", "0.002"), digits=1)
    ways = half.directions[max(half.shares)]
    assert set(ways) <= {"+x", "-x"}
    assert sum(ways.values()) == half.shares[max(half.shares)].starts > 0


def test_what_starts_symmetric_on_the_level_stays() -> None:
    """At N = 4 the relaxed chain slips for ever in avalanches, and x_G never moves."""
    found = creep(Chain(4, 1000, "0.5", "0.6", tan_alpha=0), "0.004", 50)
    assert found.slip_count > 0
    assert abs(found.x_G) < 1e-12
