"""A rearrangement as a value: unchangeable, equal to its copies, and the same from a pickle."""

from __future__ import annotations

import copy
import pickle
import random
from dataclasses import FrozenInstanceError, replace
from fractions import Fraction
from typing import Any

import pytest

from exactcreep import Outcome, rearrange
from exactcreep.model.enclosure import same, same_numbers
from exactcreep.motion.arithmetic import balls_of, digits_of
from exactcreep.solvers.rearrangement import Rearrangement
from tests.paper import unstable_chain

SOLVERS = [{"solver": name} for name in ("exact", "reference", "mpmath", "verlet", "certified")]


def moved(seed: int, **options: Any) -> Rearrangement:
    """Return a random rearrangement."""
    chain, state = unstable_chain(random.Random(seed))
    return rearrange(chain, state, direction=0, seed=3, **options)


@pytest.mark.parametrize("options", [*SOLVERS, {"solver": "verlet", "locate": True}], ids=str)
def test_a_copy_or_a_pickle_is_the_rearrangement_again(options: dict[str, Any]) -> None:
    for seed, made in ((0, True), (1, False)):
        result = moved(seed, **options)
        if made:
            assert result.sol.pieces
        written = pickle.dumps(result)
        assert ("sol" in vars(pickle.loads(written))) == ("sol" in vars(result))
        copies = pickle.loads(written), copy.copy(result), copy.deepcopy(result), replace(result)
        for again in copies:
            assert again == result
            assert hash(again) == hash(result)
            assert again.evidence is result.evidence
            assert same(again.error, result.error)
            assert not again.state.tensions.flags.writeable
        for t in (result.sol.t_min, result.sol.ts[1], result.sol.t_max):
            for here, there in zip(copies[0].sol(t), result.sol(t), strict=True):
                assert same_numbers(here, there)


def test_rearrangements_cannot_be_changed_and_are_unequal_if_anything_computed_differs() -> None:
    result = moved(4)
    for name in ("outcome", "events", "sol", "evidence", "anything"):
        with pytest.raises(FrozenInstanceError):
            setattr(result, name, None)
    assert all(getattr(result, name) is getattr(result, name) for name in ("sol", "events"))
    further = replace(result.state, displacements=result.state.displacements + 1e-16)
    changed: list[dict[str, Any]] = [
        {"events": result.events[1:]},
        {"events": (replace(result.events[0], time=1.0), *result.events[1:])},
        {"state": further},
        {"initial": further},
        {"outcome": Outcome.LIMIT},
        {"seed": result.seed + 1},
        {"solver": "another"},
        {"undecided": result.undecided + 1},
        {"velocities": result.velocities + 1.0},
        {"chain": result.chain.mirrored()},
    ]
    for change in changed:
        assert replace(result, **change) != result
    assert result != moved(0)
    assert result != "a rearrangement"


@pytest.mark.parametrize("of", [digits_of, balls_of])
def test_numbers_survive_a_pickle_that_is_read_in_another_precision(of: Any) -> None:
    arithmetic = of(200)
    with arithmetic.active():
        numbers = [arithmetic.number(Fraction(k, 7)) for k in range(-3, 4)]
        numbers += [arithmetic.sqrt(arithmetic.number(2)) ** 999]
    written = pickle.dumps((numbers, arithmetic))
    with balls_of(30).active():
        again, field = pickle.loads(written)
    assert field is arithmetic
    assert all(same(a, b) for a, b in zip(numbers, again, strict=True))
