"""An avalanche moves in its animation and on its page as it does in its run."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from PIL import Image

from exactcreep import Creep, Cycles, Experiment, InputError, creep
from exactcreep.figures import avalanche_page
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


def unpacked(packed: dict[str, str]) -> np.ndarray[Any, Any]:
    return np.frombuffer(base64.b64decode(packed["f4"]), "<f4")


def test_the_run_of_the_page_is_that_of_creep(run: Creep) -> None:
    shown = avalanche_page.run_data(avalanche_page.run_to_draw(EXPERIMENT))
    assert f"mean velocity {run.velocity:.6g}" in shown["sentence"]
    assert f"{run.slip_count} slips" in shown["sentence"]
    half_cycle, moved = run.recorded["rearrangement_half_cycle"], unpacked(shown["displacement"])
    at_ends = [moved[half_cycle <= q].sum() for q in range(1, run.half_cycles + 1)]
    assert_allclose(at_ends, run.recorded["x_G"], atol=2e-6)
    assert_array_equal(np.ceil(unpacked(shown["when"])), half_cycle)
    assert_array_equal(unpacked(shown["slip"]["slider"]), run.recorded["slip_slider"])


def test_a_rearrangement_is_in_the_page_as_its_closed_form(
    run: Creep, avalanche: RunAvalanche
) -> None:
    sent, motion = avalanche_page.motion_data(avalanche), avalanche.rearrangement
    times = unpacked(sent["times"])
    assert {np.float32(event.time) for event in motion.events} <= {*times}
    there = motion.sol(times.astype(float)[3])
    moved = there.positions - motion.initial.displacements
    for name, values in (("moved", moved), ("velocity", there.velocities)):
        assert_allclose(unpacked(sent[name]).reshape(-1, 6)[3], values, atol=1e-6)
    assert_allclose(unpacked(sent["tension"]), motion.initial.tensions, atol=1e-6)
    assert (sent["number"], sent["tan_alpha"]) == (NUMBER, float(CHAIN.tan_alpha))
    for name in ("half_cycle", "events"):
        assert sent[name] == run.recorded[f"rearrangement_{name}"][NUMBER]
