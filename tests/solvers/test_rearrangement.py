"""A rearrangement as a value: its events one by one, what is made when asked for, `==`, pickles."""

from __future__ import annotations

import copy
import pickle
import random
from dataclasses import FrozenInstanceError, replace
from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np
import pytest

from exactcreep import (
    Chain,
    EventKind,
    Outcome,
    State,
    rearrange,
)
from exactcreep.model.enclosure import same, same_numbers
from exactcreep.motion.arithmetic import balls_of, digits_of
from exactcreep.solvers.rearrangement import Rearrangement
from tests.paper import unstable_chain

SOLVERS: list[dict[str, Any]] = [
    {"solver": "exact"},
    {"solver": "reference"},
    {"solver": "mpmath"},
    {"solver": "verlet"},
    {"solver": "verlet", "locate": True},
    {"solver": "certified"},
]
every_solver = pytest.mark.parametrize(
    "solver", SOLVERS, ids=lambda options: "-".join(map(str, options.values()))
)


def random_start(seed: int) -> tuple[Chain, State]:
    return unstable_chain(random.Random(seed))


@cache
def moved(seed: int, **options: Any) -> Rearrangement:
    """Return a random rearrangement."""
    chain, state = random_start(seed)
    return rearrange(chain, state, direction=0, seed=3, max_events=200, **options)


@pytest.mark.parametrize(
    ("options", "bound"),
    [
        ({"solver": "exact"}, 1e-13),
        ({"solver": "reference"}, 1e-13),
        ({"solver": "mpmath"}, 1e-40),
        ({"solver": "certified"}, 1e-10),
        ({"solver": "verlet", "locate": True}, 1e-4),
    ],
    ids=str,
)
def test_the_closed_form_between_events_comes_to_the_next_as_nearly_as_its_solver(
    options: dict[str, Any], bound: float
) -> None:
    for seed in (0, 1, 4):
        result = moved(seed, **options)
        with result.arithmetic.active():
            for residual in result.replay().residuals():
                assert abs(residual) < bound
                if options["solver"] == "certified":
                    assert residual.contains(0)
        late = moved(seed, solver="verlet")
        stops = [event.kind is EventKind.STOP for event in late.events]
        assert max(np.array(late.replay().residuals())[stops]) > 1e-3


# -- made when asked for ---------------------------------------------------------------------------


def test_a_rearrangement_cannot_be_changed_and_keeps_what_was_made() -> None:
    result = moved(4)
    for name in ("outcome", "events", "sol", "evidence", "anything"):
        with pytest.raises(FrozenInstanceError):
            setattr(result, name, None)
    assert not result.state.tensions.flags.writeable
    assert all(getattr(result, name) is getattr(result, name) for name in ("sol", "events"))


# -- equality, copies, pickles ---------------------------------------------------------------------


@every_solver
def test_a_pickle_is_the_rearrangement_again(solver: dict[str, Any]) -> None:
    for seed, made in ((0, True), (1, False)):
        chain, state = random_start(seed)
        result = rearrange(chain, state, direction=0, seed=3, **solver)
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


def test_rearrangements_that_differ_in_anything_computed_are_unequal() -> None:
    result = moved(4)
    later = (replace(result.events[0], time=1.0), *result.events[1:])
    further = replace(result.state, displacements=result.state.displacements + 1e-16)
    for changed in (
        replace(result, events=result.events[1:]),
        replace(result, events=later),
        replace(result, state=further),
        replace(result, initial=further),
        replace(result, outcome=Outcome.LIMIT),
        replace(result, seed=result.seed + 1),
        replace(result, solver="another"),
        replace(result, undecided=result.undecided + 1),
        replace(result, velocities=result.velocities + 1.0),
        replace(result, chain=result.chain.mirrored()),
    ):
        assert changed != result
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
