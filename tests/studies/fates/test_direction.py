"""Which way a chain creeps, in the same word whoever is asked."""

from pathlib import Path

import pytest

from exactcreep import (
    Creep,
    Cycles,
    Outcome,
    State,
    creep,
    fate,
    survival,
    sweep,
    threshold,
)
from exactcreep.model.outcome import direction_of
from tests.conftest import Command
from tests.paper import captions

SHALLOW = captions(4, mu_s="0.612", tan_alpha="0.0058")
UPHILL = "0.002701"
"""An amplitude at which the shallow chain creeps against its slope."""
LEVEL = captions(4, tan_alpha=0)
SKEWED = State.prepared(LEVEL, ["0.1", "-0.05", "0.02"])


def test_a_direction_is_that_of_the_slope_and_on_the_level_that_of_the_axis() -> None:
    assert [direction_of(0.1, tan) for tan in (0.3, 0, -0.3)] == ["downhill", "+x", "uphill"]
    assert [direction_of(-0.1, tan) for tan in (0.3, 0, -0.3)] == ["uphill", "-x", "downhill"]
    assert [direction_of(nothing, 0.3) for nothing in (0, 0.0, float("nan"))] == ["none"] * 3


def test_a_run_says_which_way_it_creeps(tmp_path: Path) -> None:
    found = creep(SHALLOW, Cycles(UPHILL, 200))
    assert found.velocity == pytest.approx(-0.8193322457795766 / 2, rel=1e-12)
    assert found.direction == found.summary()["direction"] == "uphill"
    found.save(tmp_path / "up.nc")
    assert Creep.load(tmp_path / "up.nc").direction == "uphill"
    image = creep(captions(4, mu_s="0.612", tan_alpha="-0.0058"), Cycles(UPHILL, 200))
    assert image.velocity > 0
    assert image.direction == "uphill"


@pytest.mark.parametrize(
    ("n", "tan_alpha", "amplitude", "cycles", "direction"),
    [
        (3, "0.25", "0.001", 50, "downhill"),
        (3, "0.25", "0.001", 1, "downhill"),  # too short for a velocity
        (3, "0.25", "0.0001", 50, "none"),
        (5, "0.25", "0.0008", 200, "none"),  # locked
        (3, "-0.7", "0.001", 3, "downhill"),  # a runaway
        (4, "0", "0.004", 50, "none"),  # slips for ever in avalanches, as its mirror image does
    ],
)
def test_creep_downhill_rest_and_locked_chains_say_so(
    n: int, tan_alpha: str, amplitude: str, cycles: int, direction: str
) -> None:
    found = creep(captions(n, tan_alpha=tan_alpha), Cycles(amplitude, cycles))
    assert found.direction == direction


def test_tables_of_members_say_it(command: Command) -> None:
    text = "[chain]\nn = 4\nl0 = 1000\nmu_d = 0.5\nmu_s = 0.612\nsigma_mu = 0\n"
    text += f'[drive]\nkind = "cycles"\namplitude = {UPHILL}\ncycles = 100\n'
    Path("two.toml").write_text(text + "[vary]\nchain.tan_alpha = [0.0058, 0.25]\n")
    printed = command("run", "two.toml").out
    assert printed.count("creeping uphill") == printed.count("creeping downhill") == 2
    assert sweep("two.toml")["direction"].values.tolist() == ["uphill", "downhill"]
    assert "1 creeping uphill" in command("sweep", "two.toml").out


@pytest.mark.parametrize("solver", ["certified", "exact"])
def test_a_fate_says_which_way_it_creeps_for_ever(solver: str) -> None:
    found = fate(SHALLOW, UPHILL, solver=solver)
    assert found.advance == pytest.approx(-0.8193322457795766, rel=1e-12)
    assert (found.outcome, found.direction) == (Outcome.CREEPING, "uphill")
    assert found.last_advance == found.settled_after  # it has advanced all along, and goes on
    assert "direction='uphill'" in repr(found)
    assert fate(SHALLOW, "0.0001", solver=solver).direction == "none"


def test_on_the_level_a_skewed_start_creeps_along_the_axis() -> None:
    level = fate(LEVEL, "0.0015", start=SKEWED, solver="exact")
    assert level.advance == pytest.approx(-6.362498559751911e-05, rel=1e-9)
    assert level.direction == "-x"


def test_a_survival_counts_creep_either_way() -> None:
    found = survival(SHALLOW, UPHILL, starts=12, cycles=300)
    ways = found.directions
    assert sum(one.starts for one in ways.values()) == found.creeping.starts
    uphill = [record for record in found.records if record.direction == "uphill"]
    assert {record.outcome for record in uphill} == {"creeping"}
    assert found.summary()["directions"]["uphill"]["starts"] == ways["uphill"].starts
    assert len(uphill) == ways["uphill"].starts
    unsettled = survival(captions(6, tan_alpha="-0.02"), "0.002", starts=4, cycles=200)
    assert set(unsettled.directions) == {"downhill"}
    assert unsettled.creeping.starts == 4


def test_a_threshold_says_which_creep_begins_there() -> None:
    chain = captions(4, tan_alpha="0.015")
    up = threshold(chain, bracket=("0.00132", "0.00144"), digits=3, solver="exact")
    assert fate(chain, up.upper, solver="exact").direction == up.direction == "uphill"
    assert up.summary()["direction"] == "uphill"
    down = threshold(captions(3), points=50, digits=6)
    assert down.direction == "downhill"
    assert down.summary()["fate_at_upper"]["direction"] == "downhill"


def test_a_threshold_after_so_many_cycles_means_creep_downhill() -> None:
    """Relaxing from the start eight sliders move up, by less and less: no creep."""
    chain = captions(8)
    edge = threshold(chain, after=20, bracket=("0.0010751", "0.0010753"), digits=5, solver="exact")
    below, above = (
        creep(chain, Cycles(side, 20)).recorded["x_G"] for side in (edge.lower, edge.upper)
    )
    assert below[-1] < below[-3] - 1e-6
    assert above[-1] > above[-3] + 1e-6
    assert edge.direction == "downhill"
