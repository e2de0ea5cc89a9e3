"""A portrait of a run is the run: it repeats it and lies within its laws."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from exactcreep import Chain, Cycles, GaussianSteps, creep
from exactcreep.figures.run_view import draw_portrait, portrait
from exactcreep.model.numbers import InputError
from tests.conftest import Command

CHAIN = Chain(6, 1000, "0.5", "0.6", "0.01", tan_alpha="0.25")
DRIVE = Cycles("0.004", 20)


@pytest.fixture(scope="module")
def run():
    return creep(CHAIN, DRIVE, seed=3, record=("x_G",))


@pytest.fixture(scope="module")
def full():
    return creep(CHAIN, DRIVE, seed=3, record=("x_G", "x", "tension", "slips"))


@pytest.mark.parametrize("half_cycle", [0, 1, 7, 30, 40])
def test_a_portrait_shows_what_a_full_record_holds(run, full, half_cycle: int) -> None:
    seen = portrait(run, half_cycle, window=10)
    there = slice(seen.first - 1, seen.first - 1 + 10)
    assert seen.slips.shape == (10, 6)
    assert seen.first - 1 <= half_cycle <= seen.first + 9
    assert np.array_equal(seen.slips, full.recorded["slips"][there])
    assert np.array_equal(seen.x_G[1:], full.recorded["x_G"][there])
    before = np.vstack([np.zeros(6), full.recorded["x"]])[seen.first - 1]
    assert seen.x_G[0] == before.mean()
    if half_cycle:
        assert np.array_equal(seen.state.tensions, full.recorded["tension"][half_cycle - 1])
        assert np.array_equal(seen.theta[1:], DRIVE.targets(seen.first, 10))


def test_every_resting_slider_is_shown_within_its_limit(run) -> None:
    for half_cycle in range(0, 41, 5):
        seen = portrait(run, half_cycle, window=5)
        assert (np.abs(seen.forces) <= seen.limits).all()


def test_tensions_are_shown_within_the_bounds_of_friction() -> None:
    chain = Chain(7, 1000, "0.5", "0.6", 0, tan_alpha="0.2")
    result = creep(chain, GaussianSteps("0.005", 30), seed=1)
    for half_cycle in range(0, 31, 3):
        seen = portrait(result, half_cycle)
        low, high = seen.bounds(chain.mu_s)
        # where all forces of one side stand at their limit, only the sum's rounding is left
        rounding = 2**-50 * chain.n
        assert (seen.state.tensions >= low - rounding).all()
        assert (seen.state.tensions <= high + rounding).all()
        narrow = seen.bounds(chain.mu_d)
        assert (narrow[0] > low).all()
        assert (narrow[1] < high).all()


def test_a_run_that_does_not_repeat_itself_is_refused(run) -> None:
    changed = run.recorded["x_G"].copy()
    changed[11] = np.nextafter(changed[11], 1e9)
    other = dataclasses.replace(run, recorded={"x_G": changed})
    with pytest.raises(InputError, match="at half-cycle 12 when the run was saved"):
        portrait(other, 20)


def test_a_half_cycle_that_the_run_does_not_have_is_refused(run) -> None:
    with pytest.raises(InputError, match=r"half_cycle = 41.*at most 40"):
        portrait(run, 41)


@pytest.mark.parametrize("n", [1, 2, 90])
def test_a_portrait_of_any_chain_can_be_drawn(n: int) -> None:
    chain = Chain(n, 1000, "0.5", "0.6", "0.01", tan_alpha="0.25")
    figure = draw_portrait(portrait(creep(chain, Cycles("0.002", 2))))
    figure.canvas.draw()
    assert figure.axes[0].get_ylabel()


def test_the_command_show_writes_a_picture_and_keeps_files(command: Command) -> None:
    words = ["run", "six-sliders-cycles", "--set", "drive.cycles=5"]
    assert command(*words, "--out", "run.nc").code == 0
    assert command("show", "run.nc", "--half-cycle", "4").code == 0
    with Image.open("run.png") as shown:
        assert min(shown.size) > 500
    assert "exists" in command("show", "run.nc").sentence  # run.png does
    late = command("show", "run.nc", "--half-cycle", "11", "--out", "b.png")
    assert "at most 10" in late.sentence
    assert "member = " in command("show", "run.nc", "--member", "2", "--out", "b.png").sentence
    assert not Path("b.png").exists()
    assert "missing.nc" in command("show", "missing.nc").sentence
