"""A rearrangement as a value: unchangeable, equal to its copies, and the same from a pickle."""

from __future__ import annotations

import copy
import math
import pickle
import random
from dataclasses import FrozenInstanceError, replace
from typing import Any

import pytest

from exactcreep import InputError, Outcome, rearrange
from exactcreep.model.enclosure import same, same_numbers
from exactcreep.motion.arithmetic import balls_of
from exactcreep.solvers.rearrangement import Rearrangement
from tests.paper import unstable_chain

SOLVERS = [{"solver": name} for name in ("exact", "verlet", "certified")]


def moved(seed: int, **options: Any) -> Rearrangement:
    """Return a random rearrangement."""
    chain, state = unstable_chain(random.Random(seed))
    return rearrange(chain, state, direction=0, seed=3, **options)


@pytest.mark.parametrize("options", [*SOLVERS, {"solver": "verlet", "locate": True}], ids=str)
def test_a_copy_or_a_pickle_is_the_rearrangement_again(options: dict[str, Any]) -> None:
    result = moved(0, **options)
    with balls_of(30).active():  # a pickle is read in any precision
        loaded = pickle.loads(pickle.dumps(result))
    for again in (loaded, copy.deepcopy(result), replace(result)):
        assert (again, hash(again)) == (result, hash(result))
        assert again.evidence is result.evidence
        assert same(again.error, result.error)
        assert not again.state.tensions.flags.writeable
    drawn = pickle.loads(pickle.dumps(result.sol))
    for t in (result.sol.t_min, result.sol.ts[1], result.sol.t_max):
        for here, there in zip([*loaded.sol(t), *drawn(t)], [*result.sol(t)] * 2, strict=True):
            assert same_numbers(here, there)


def test_rearrangements_cannot_be_changed_and_are_unequal_if_anything_computed_differs() -> None:
    result = moved(4)
    with pytest.raises(FrozenInstanceError):
        result.outcome = None  # type: ignore[misc,assignment]
    later = replace(result.events[0], time=1.0)
    further = replace(result.state, displacements=result.state.displacements + 1e-16)
    changed: dict[str, Any] = {
        "events": (later, *result.events[1:]), "state": further, "initial": further,
        "outcome": Outcome.LIMIT, "seed": result.seed + 1, "solver": "another",
        "undecided": result.undecided + 1, "velocities": result.velocities + 1.0,
        "chain": result.chain.mirrored(),
    }  # fmt: skip
    for name, value in changed.items():
        assert replace(result, **{name: value}) != result
    assert result != "a rearrangement"


def test_a_solution_says_what_it_is_and_refuses_times_outside() -> None:
    sol = moved(1).sol
    assert repr(sol).startswith(f"Solution(the motion from t = 0 to {float(sol.t_max):g} tau_dyn")
    for outside in (-0.1, float(sol.t_max) + 0.1, math.nan):
        with pytest.raises(InputError, match=r"t = .*must lie between 0.0 and"):
            sol(outside)


@pytest.mark.parametrize(("word", "sign"), [("up", 1), ("down", -1)])
def test_a_direction_in_words_is_that_of_theta(word: str, sign: int) -> None:
    chain, state = unstable_chain(random.Random(2))
    assert same(rearrange(chain, state, direction=word), rearrange(chain, state, direction=sign))
    with pytest.raises(InputError, match="direction = 'left'"):
        rearrange(chain, state, direction="left")
