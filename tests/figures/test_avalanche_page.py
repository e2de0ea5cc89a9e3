"""The page of one avalanche holds its run and its motion, and nothing that could run by itself."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from exactcreep import Cycles, creep
from exactcreep.figures import avalanche_page
from exactcreep.figures.animation import find_avalanche
from exactcreep.quasistatic.experiment import Experiment
from tests.paper import paper_chain

CHAIN, DRIVE = paper_chain(6), Cycles("0.0012", 5)
NUMBER = 17


@pytest.fixture(scope="module")
def experiment() -> Experiment:
    return Experiment(CHAIN, DRIVE, seed=2)


def unpacked(packed: dict[str, str]) -> np.ndarray[Any, Any]:
    return np.frombuffer(base64.b64decode(packed["f4"]), "<f4")


def test_the_run_of_the_page_is_that_of_creep(experiment: Experiment) -> None:
    shown = avalanche_page.run_data(avalanche_page.run_to_draw(experiment))
    record = ["x_G", "rearrangements", "slip_table"]
    run = creep(CHAIN, DRIVE, seed=2, record=record)
    assert f"mean velocity {run.velocity:.6g}" in shown["sentence"]
    assert f"{run.slip_count} slips" in shown["sentence"]
    half_cycle, moved = run.recorded["rearrangement_half_cycle"], unpacked(shown["displacement"])
    at_ends = [moved[half_cycle <= q].sum() for q in range(1, run.half_cycles + 1)]
    assert_allclose(at_ends, run.recorded["x_G"], atol=2e-6)
    assert_array_equal(np.ceil(unpacked(shown["when"])), half_cycle)
    assert_array_equal(unpacked(shown["slip"]["slider"]), run.recorded["slip_slider"])


def test_a_rearrangement_is_in_the_page_as_its_closed_form(experiment: Experiment) -> None:
    avalanche = find_avalanche(experiment, NUMBER)
    sent, motion = avalanche_page.motion_data(avalanche), avalanche.rearrangement
    assert sent["number"] == NUMBER
    times = unpacked(sent["times"])
    for event in motion.events:
        assert np.float32(event.time) in times
    there = motion.sol(times.astype(float)[3])
    moved = there.positions - motion.initial.displacements
    for name, values in (("moved", moved), ("velocity", there.velocities)):
        assert_allclose(unpacked(sent[name]).reshape(-1, 6)[3], values, atol=1e-6)
    assert_allclose(unpacked(sent["tension"]), motion.initial.tensions, atol=1e-6)
    assert sent["tan_alpha"] == float(CHAIN.tan_alpha)
    run = creep(CHAIN, DRIVE, seed=2, record=["rearrangements"])
    assert sent["half_cycle"] == run.recorded["rearrangement_half_cycle"][NUMBER]
    assert sent["events"] == run.recorded["rearrangement_events"][NUMBER]
