"""An avalanche moves in its animation as it does in its run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from PIL import Image

from exactcreep import Creep, Cycles, Experiment, InputError, creep
from exactcreep.figures.animation import (
    RunAvalanche,
    draw_avalanche,
    find_avalanche,
    largest_avalanche,
    moments_of,
)
from exactcreep.results import Progress
from tests.paper import paper_chain

CHAIN = paper_chain(6)
EXPERIMENT = Experiment(CHAIN, Cycles("0.004", 6), seed=3)
NUMBER = 57


@pytest.fixture(scope="module")
def run() -> Creep:
    record = ("x_G", "events", "rearrangements", "slip_table")
    return creep(CHAIN, EXPERIMENT.drive, seed=3, record=record)


@pytest.fixture(scope="module")
def avalanche() -> RunAvalanche:
    return find_avalanche(EXPERIMENT, NUMBER)


def test_an_avalanche_is_found_with_its_events_and_times(run: Creep) -> None:
    counts = run.recorded["rearrangement_events"]
    largest = largest_avalanche(EXPERIMENT)
    assert counts[largest] == counts.max()
    for number in (0, NUMBER, largest, counts.size - 1):
        found = find_avalanche(EXPERIMENT, number)
        there = run.recorded["event_rearrangement"] == number
        assert found.half_cycle == run.recorded["event_half_cycle"][there][0]
        shown = [float(e.time) for e in found.rearrangement.events for _ in e.sliders]
        logged = run.recorded["event_time"][there]
        assert np.abs(np.array(shown) - logged).max() <= 1e-10 * max(1.0, logged[-1])
    with pytest.raises(InputError, match=f"must be one of the run's {counts.size}, from 0"):
        find_avalanche(EXPERIMENT, counts.size)
    with pytest.raises(InputError, match="nothing moves in 6 half-cycles"):
        largest_avalanche(Experiment(CHAIN, Cycles("1e-6", 3)))


def test_sliders_are_drawn_as_moving_exactly_while_they_move() -> None:
    motion = find_avalanche(EXPERIMENT, largest_avalanche(EXPERIMENT)).rearrangement
    ends = motion.sol.ts
    times = (ends[:-1] + np.diff(ends) / 2)[np.diff(ends) > 1e-6]
    shown = moments_of(motion, np.append(times, motion.duration))
    assert_array_equal(shown.moving[:, :-1], motion.sol(times).velocities != 0)
    assert not shown.moving[:, -1].any()
    assert_array_equal(shown.held[:, -1], motion.state.coefficients * CHAIN.cos_alpha)


def test_the_animation_has_the_frames_that_were_asked_for(
    avalanche: RunAvalanche, tmp_path: Path
) -> None:
    told: list[Progress] = []
    draw_avalanche(avalanche, tmp_path / "a.gif", frames=4, progress=told.append)
    assert {(each.phase, each.total, each.counted) for each in told} == {("drawing", 4, "pictures")}
    assert [each.done for each in told] == sorted(each.done for each in told)
    with Image.open(tmp_path / "a.gif") as moving:
        assert moving.n_frames == 4
        first = np.asarray(moving.convert("RGB"))
        moving.seek(3)
        assert (first != np.asarray(moving.convert("RGB"))).any()
