"""A run that goes on until its velocity is known, held against runs thirty times as long."""

from __future__ import annotations

import pytest

from exactcreep import Cycles, creep
from exactcreep.quasistatic.creep import AccuracyWarning
from exactcreep.quasistatic.velocity import FIRST_LOOK, next_look
from tests.quasistatic.runs import SIX


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
        assert shorter.half_cycles == look
        assert shorter.report["accuracy_reached"] is False
        assert not shorter.report["relative_error"] <= 0.02  # or it is not known
    # how often it is looked at changes no bit of the way, and not what is averaged
    same = Cycles("0.002", run.half_cycles // 2)
    plain = creep(SIX, same, seed=1, burn_in=run.burn_in)
    assert (run.state, run.velocity) == (plain.state, plain.velocity)
    assert 2 <= run.burn_in <= run.half_cycles // 10 + 2
