"""A rearrangement as a value: unchangeable, equal to its copies, and the same from a pickle."""

from __future__ import annotations

import copy
import pickle
import random
from dataclasses import FrozenInstanceError, replace
from typing import Any

import pytest

from exactcreep import Outcome, rearrange
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
    for t in (result.sol.t_min, result.sol.ts[1], result.sol.t_max):
        for here, there in zip(loaded.sol(t), result.sol(t), strict=True):
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
