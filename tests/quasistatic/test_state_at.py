"""The state of a run after any half-cycle, long after the run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import pytest

from exactcreep import Chain, Creep, Cycles, GaussianSteps, InputError, creep, resume
from tests.quasistatic.runs import SIX, TWO


@pytest.mark.parametrize(
    ("chain", "drive", "solver", "options"),
    [
        (SIX, Cycles("0.004", 60), "exact", {"record": ("events", "x")}),
        (SIX, GaussianSteps("0.002", 120), "sliding", {}),
        (TWO, GaussianSteps("0.001", 9), "certified", {}),
        (TWO, Cycles("0.001", 5), "verlet", {"dt": "1/32"}),
    ],
)
def test_the_state_after_any_half_cycle_is_that_of_a_run_that_ends_there(
    chain: Chain, drive: Any, solver: str, options: Mapping[str, Any]
) -> None:
    run = creep(chain, drive, seed=3, solver=solver, **options)
    experiment = run.experiment
    simulation = experiment.algorithm.simulation(chain, experiment.initial, run.seed, ())
    for half_cycle in range(1, run.half_cycles + 1):
        simulation.follow(drive, half_cycle, 1)
        if half_cycle in (1, 2, run.half_cycles // 2, run.half_cycles):
            assert run.state_at(half_cycle) == simulation.state()


def test_a_result_saves_few_states_one_of_them_of_its_later_half() -> None:
    run = creep(SIX, Cycles("0.004", 3000), record=())
    assert len(run.saved) < 40
    assert run.half_cycles / 2 <= max(run.saved) <= run.half_cycles
    late = max(target for target in run.saved if target < run.half_cycles) + 1
    assert run.state_at(late) == replace(run, saved={}).state_at(late)


def test_a_run_that_was_given_up_or_resumed_or_loaded_knows_its_states(tmp_path: Any) -> None:
    drive, kept = Cycles("0.004", 40), tmp_path / "run.ckpt"
    whole = creep(SIX, drive)
    part = creep(SIX, drive, max_events=whole.event_count // 2, checkpoint=kept)
    assert part.half_cycles < whole.half_cycles
    gone_on = resume(kept)
    gone_on.save(tmp_path / "run.nc")
    loaded = Creep.load(tmp_path / "run.nc")
    for half_cycle in (0, 5, part.half_cycles):
        state = whole.state_at(half_cycle)
        assert all(run.state_at(half_cycle) == state for run in (part, gone_on, loaded))
    with pytest.raises(InputError, match="half_cycle"):
        part.state_at(part.half_cycles + 1)
