"""An avalanche moves in its animation as it does in its run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from PIL import Image

from exactcreep import Cycles, Experiment, InputError, creep
from exactcreep.figures.animation import draw_avalanche, find_avalanche
from exactcreep.figures.style import INKS
from exactcreep.results import Progress
from tests.paper import paper_chain

CHAIN = paper_chain(6)
EXPERIMENT = Experiment(CHAIN, Cycles("0.004", 6), seed=3)


def test_an_avalanche_is_found_with_its_events_and_times() -> None:
    run = creep(CHAIN, EXPERIMENT.drive, seed=3, record=("events", "rearrangements"))
    counts = run.recorded["rearrangement_events"]
    for number in (None, 0, 57, counts.size - 1):
        found = find_avalanche(EXPERIMENT, number)
        assert found.number == (counts.argmax() if number is None else number)
        there = run.recorded["event_rearrangement"] == found.number
        assert found.half_cycle == run.recorded["event_half_cycle"][there][0]
        shown = [float(e.time) for e in found.rearrangement.events for _ in e.sliders]
        logged = run.recorded["event_time"][there]
        assert np.abs(np.array(shown) - logged).max() <= 1e-10 * max(1.0, logged[-1])
    with pytest.raises(InputError, match=f"must be one of the run's {counts.size}, from 0"):
        find_avalanche(EXPERIMENT, counts.size)
    with pytest.raises(InputError, match="nothing moves in 6 half-cycles"):
        find_avalanche(Experiment(CHAIN, Cycles("1e-6", 3)))


def test_the_animation_has_frames_in_which_as_many_sliders_are_coloured_as_move(
    tmp_path: Path,
) -> None:
    told: list[Progress] = []
    found = find_avalanche(EXPERIMENT)
    draw_avalanche(found, tmp_path / "a.gif", frames=8, progress=told.append)
    assert {(each.phase, each.total, each.counted) for each in told} == {("drawing", 8, "pictures")}
    assert [each.done for each in told] == sorted(each.done for each in told)
    with Image.open(tmp_path / "a.gif") as moving:
        assert moving.n_frames == 8
        frames = [moving.seek(k) or np.asarray(moving.convert("RGB"), int) for k in range(8)]
    motion = found.rearrangement
    velocities = motion.sol(np.linspace(0, motion.duration, 8)).velocities.round(9)
    for ink, sign in ((INKS[1], 1), (INKS[0], -1)):
        near = np.abs(np.stack(frames) - 255 * np.array(to_rgb(ink))).max(axis=3) < 9
        coloured, count = near.sum(axis=(1, 2)), (np.sign(velocities) == sign).sum(axis=0)
        assert np.ptp(count) == 0 or np.corrcoef(coloured, count)[0, 1] > 0.95
    assert not velocities[:, -1].any()
    assert velocities.any()
