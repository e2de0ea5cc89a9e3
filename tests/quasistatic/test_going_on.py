"""A run goes on from the state of another with the same bits, as if there had been one drive."""

from __future__ import annotations

import pickle
import random
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exactcreep import Chain, Cycles, State, Targets, creep
from exactcreep.model.enclosure import same_numbers
from exactcreep.quasistatic.checkpoint import CheckpointWarning
from tests.paper import paper_chain, unlike_chain

RECORD = ("x_G", "x", "tension", "slips")
SOLVERS = ("exact", "exact", "exact", "certified", "sliding", "verlet")

pytestmark = pytest.mark.filterwarnings("ignore::exactcreep.results.PhysicsWarning")


def some_run(rng: random.Random) -> tuple[dict[str, Any], Any, Any, Any]:
    """Return a run without its drive, a drive, and its two parts."""
    solver, differs = rng.choice(SOLVERS), rng.random() < 0.5
    chain = unlike_chain(rng) if differs else paper_chain(rng.randint(2, 8))
    if solver == "sliding":
        chain = Chain(**chain.parameters() | {"expansion": ()})
    n = chain.n
    widest = n * 0.25 / 2000 * rng.uniform(1.05, 2)
    run = {"chain": chain, "seed": rng.randrange(10**6), "solver": solver, "record": RECORD}
    if solver == "verlet":
        run["dt"] = "0.05"
    if rng.random() < 0.4:
        cut, amplitude = rng.randint(1, 4), f"{widest:.7f}"
        return run, *(Cycles(amplitude, cycles) for cycles in (cut + 2, cut, 2))
    each = solver != "sliding" and rng.random() < 0.5  # a dilation of each spring

    def target() -> Any:
        dilations = [f"{rng.uniform(-widest, widest):.7f}" for _ in range(n - 1)]
        return dilations if each else dilations[0]

    targets = [target() for _ in range(9)]
    cut = rng.randint(1, 8)
    return run, Targets(targets), Targets(targets[:cut]), Targets(targets[cut:])


@pytest.mark.parametrize("number", range(24))
def test_two_runs_in_turn_are_one_run_bit_for_bit(number: int) -> None:
    run, drive, first, second = some_run(random.Random(number))
    whole, one = creep(**run, drive=drive), creep(**run, drive=first)
    begin = one.half_cycles
    kept = pickle.loads(pickle.dumps(one.state))
    for start in (one.state, whole.state_at(begin), kept):
        other = creep(**run, drive=second, start=start)
        assert other.state == whole.state
        for name in RECORD:
            pair = whole.recorded[name][begin:], other.recorded[name]
            assert same_numbers(*map(np.array, pair))
    assert other.state_at(1) == whole.state_at(begin + 1)


def test_a_run_that_went_on_from_another_goes_on_from_its_checkpoint(tmp_path: Path) -> None:
    chain, cycles, file = paper_chain(6), Cycles("0.01", 10), tmp_path / "run.ckpt"
    start = creep(chain, cycles, seed=3).state
    whole = creep(chain, cycles, seed=3, start=start)
    creep(chain, cycles, seed=3, start=start, checkpoint=file, max_events=500)
    with pytest.warns(CheckpointWarning, match="the run goes on"):
        gone_on = creep(chain, cycles, seed=3, start=start, checkpoint=file)
    assert gone_on.state == whole.state == creep(chain, Cycles("0.01", 20), seed=3).state


def test_a_state_that_is_changed_or_of_another_chain_is_taken_as_it_is_shown() -> None:
    chain, cycles = paper_chain(6), Cycles("0.01", 4)
    start = creep(chain, cycles, seed=3).state
    rounded = State(**{name: value for name, value in vars(start).items() if name != "unrounded"})
    assert start.unrounded is not None
    assert rounded == start
    assert replace(start, theta=start.theta).unrounded is None
    steeper: Chain = replace(chain, tan_alpha="0.26")
    alone = [creep(steeper, cycles, seed=3, start=state).state for state in (start, rounded)]
    assert alone[0] == alone[1]
