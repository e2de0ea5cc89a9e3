"""A run that goes on until its velocity is known, held against runs thirty times as long."""

from __future__ import annotations

import math

import pytest

from exactcreep import Cycles, InputError, Outcome, creep
from exactcreep.quasistatic.creep import AccuracyWarning
from exactcreep.quasistatic.velocity import FIRST_LOOK, next_look
from exactcreep.scene import Scene
from tests.quasistatic.runs import SIX, TWO_SURE


def test_a_run_ends_at_the_first_look_at_which_its_velocity_is_known_well_enough() -> None:
    drive, looks = Cycles("0.002", 20_000), [FIRST_LOOK]
    run = creep(SIX, drive, seed=1, accuracy="0.02")
    while looks[-1] < run.half_cycles:
        looks.append(next_look(looks[-1]))
    assert run.half_cycles == looks[-1] < drive.half_cycles
    assert run.report["accuracy_reached"]
    assert run.report["relative_error"] == 1.96 * run.velocity_error / run.velocity <= 0.02
    for look in looks[:-1]:
        with pytest.warns(AccuracyWarning, match="not 0.02"):
            shorter = creep(SIX, Cycles("0.002", look // 2), seed=1, accuracy="0.02")
        assert shorter.report["relative_error"] > 0.02 or math.isnan(
            shorter.report["relative_error"]
        )
    # how often it is looked at changes no bit of the way, and not what is averaged
    same = Cycles("0.002", run.half_cycles // 2)
    plain = creep(SIX, same, seed=1, burn_in=run.burn_in)
    assert (run.state, run.velocity) == (plain.state, plain.velocity)
    assert 2 <= run.burn_in <= run.half_cycles // 10 + 2


def test_a_chain_that_settles_needs_no_longer_run() -> None:
    run = creep(TWO_SURE, Cycles("0.001", 10**6), accuracy="1e-9")
    assert (run.half_cycles, run.velocity_error) == (FIRST_LOOK, 0.0)
    assert run.report["relative_error"] == 0.0
    rest = creep(TWO_SURE, Cycles("0.00001", 10**6), accuracy="0.5")
    assert (rest.outcome, rest.velocity) == (Outcome.AT_REST, 0.0)
    assert rest.half_cycles == FIRST_LOOK


def test_a_run_too_short_says_what_it_reached() -> None:
    with pytest.warns(AccuracyWarning, match="relative error at 95 % is not known, not 0.001"):
        run = creep(SIX, Cycles("0.002", 20), accuracy="0.001")
    assert run.half_cycles == 40
    assert run.report["accuracy_reached"] is False


def test_a_scene_may_ask_for_an_accuracy_and_auto_names_what_replaces_it() -> None:
    chain = {"n": 2, "l0": 1000, "mu_d": "0.5", "mu_s": "0.6", "tan_alpha": "0.25"}
    scene = {"chain": chain, "drive": {"kind": "cycles", "amplitude": "0.001", "cycles": 900}}
    asked = Scene.from_mapping(scene | {"run": {"accuracy": "0.01"}}).experiment()
    assert asked.accuracy == 0.01
    for replacement in ("exactcreep plan", "accuracy = X"):
        with pytest.raises(InputError, match=replacement):
            Scene.from_mapping(scene | {"run": {"solver": "auto"}}).experiment()
