"""Which way a chain creeps is the same word whoever is asked."""

from pathlib import Path

import pytest

from exactcreep import Creep, Cycles, State, creep, fate, survival, sweep, threshold
from exactcreep.model.outcome import direction_of
from tests.paper import captions

SHALLOW = captions(4, mu_s="0.612", tan_alpha="0.0058")
UPHILL = "0.002701"
"""An amplitude at which the shallow chain creeps against its slope."""
ADVANCE = pytest.approx(-0.8193322457795766, rel=1e-12)


def test_a_direction_is_that_of_the_slope_and_on_the_level_that_of_the_axis() -> None:
    assert [direction_of(0.1, tan) for tan in (0.3, 0, -0.3)] == ["downhill", "+x", "uphill"]
    assert [direction_of(-0.1, tan) for tan in (0.3, 0, -0.3)] == ["uphill", "-x", "downhill"]
    assert [direction_of(nothing, 0.3) for nothing in (0, 0.0, float("nan"))] == ["none"] * 3


def test_runs_files_sweeps_and_fates_say_which_way_they_creep(tmp_path: Path) -> None:
    found = creep(SHALLOW, Cycles(UPHILL, 200))
    assert 2 * found.velocity == ADVANCE
    found.save(tmp_path / "up.nc")
    assert found.direction == Creep.load(tmp_path / "up.nc").direction == "uphill"
    image = creep(SHALLOW.mirrored(), Cycles(UPHILL, 200))
    assert (image.velocity, image.direction) == (-found.velocity, "uphill")
    for solver in ("certified", "exact"):
        known = fate(SHALLOW, UPHILL, solver=solver)
        assert known.advance == ADVANCE
        assert known.direction == "uphill"
        assert known.last_advance == known.settled_after
    text = "[chain]\nn = 4\nl0 = 1000\nmu_d = 0.5\nmu_s = 0.612\nsigma_mu = 0\n"
    text += f'[drive]\nkind = "cycles"\namplitude = {UPHILL}\ncycles = 100\n'
    (tmp_path / "two.toml").write_text(text + "[vary]\nchain.tan_alpha = [0.0058, 0.25]\n")
    grid = sweep(tmp_path / "two.toml")
    assert grid["direction"].values.tolist() == ["uphill", "downhill"]


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


def test_on_the_level_a_skewed_start_creeps_along_the_axis() -> None:
    chain = captions(4, tan_alpha=0)
    skewed = State.prepared(chain, ["0.1", "-0.05", "0.02"])
    level = fate(chain, "0.0015", start=skewed, solver="exact")
    assert level.advance == pytest.approx(-6.362498559751911e-05, rel=1e-9)
    assert level.direction == "-x"


def test_a_survival_counts_creep_either_way() -> None:
    found = survival(SHALLOW, UPHILL, starts=12, cycles=300)
    ways = found.directions
    assert sum(one.starts for one in ways.values()) == found.creeping.starts
    uphill = [record for record in found.records if record.direction == "uphill"]
    assert {record.outcome for record in uphill} == {"creeping"}
    assert len(uphill) == ways["uphill"].starts == found.summary()["directions"]["uphill"]["starts"]
    unsettled = survival(captions(6, tan_alpha="-0.02"), "0.002", starts=4, cycles=200)
    assert set(unsettled.directions) == {"downhill"}
    assert unsettled.creeping.starts == 4


def test_a_threshold_says_which_creep_begins_there() -> None:
    chain = captions(4, tan_alpha="0.015")
    up = threshold(chain, bracket=("0.00132", "0.00144"), digits=3, solver="exact")
    assert fate(chain, up.upper, solver="exact").direction == up.direction == "uphill"
    chain = captions(8)  # relaxing from the start it moves up, by less and less: no creep
    edge = threshold(chain, after=20, bracket=("0.0010751", "0.0010753"), digits=5, solver="exact")
    sides = (edge.lower, edge.upper)
    below, above = (creep(chain, Cycles(side, 20)).recorded["x_G"] for side in sides)
    assert below[-1] < below[-3] - 1e-6
    assert above[-1] > above[-3] + 1e-6
    assert edge.direction == "downhill"
