"""A state placed in the arrays of the compiled loop, and read back from them."""

from __future__ import annotations

import ast
import inspect
import random
from collections import Counter
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest

from exactcreep import Chain, Outcome, State, rearrange
from exactcreep.solvers.exact import layout
from exactcreep.solvers.exact import solver as exact
from exactcreep.solvers.exact.pack import Origin, dilation, placed
from tests.paper import paper_chain

THIRDS = [Fraction(k, 3) for k in (1, -2, 4, -5)]


@pytest.mark.parametrize("theta", [Fraction(0), Fraction(-2, 3)])
@pytest.mark.parametrize("n", [1, 2, 5])
def test_forces_are_placed_to_twice_the_digits_of_a_float_and_read_back(n: int, theta: Fraction):
    chain = Chain(n, Fraction(2, 7), "0.5", "0.6", tan_alpha="0.3")
    tensions = THIRDS[: n - 1]
    origin = Origin.of(chain, State.prepared(chain, tensions, theta=theta))
    work = placed(chain, origin, 0, layout.LOGS_EVENTS)
    cell = work.cell[:, layout.PAD : layout.PAD + n]
    load = chain.l0 * theta if n > 1 else Fraction(0)
    bare = [0, *(tension + load for tension in tensions), 0]  # theta is added apart
    for k, (before, after) in enumerate(pairwise(bare)):
        placed_force = Fraction(cell[layout.FORCE, k]) + Fraction(cell[layout.FORCE_LOW, k])
        true = after - before + Fraction(chain.sin_alpha)
        assert abs(placed_force - true) < Fraction(1, 2**100)
        assert cell[layout.REST, k] == cell[layout.FORCE, k]
    assert origin.read(work)[0].tolist() == [float(t) for t in tensions]
    assert dilation(chain, origin.load) == float(theta)


@pytest.mark.parametrize("n", [1, 2, 6])
def test_a_rearrangement_in_arrays_used_before_has_the_bits_of_one_in_new_arrays(n: int) -> None:
    steep = paper_chain(n, tan_alpha="0.499")
    level = Chain(n, 10, "0.3", "0.6", tan_alpha="0.1")
    rng = random.Random(n)
    states = []
    for seed in range(20):
        for chain in (steep, level):
            tensions = [rng.uniform(-2, 2) for _ in range(n - 1)]
            states.append((chain, State.prepared(chain, tensions, seed=seed)))
    new = []
    for chain, state in states:
        exact._USED.clear()
        new.append(rearrange(chain, state, direction=1))
    for (chain, state), known in zip(states, new, strict=True):
        given_up = rearrange(steep, states[0][1], direction=1, max_events=2)
        assert n == 1 or given_up.outcome is Outcome.LIMIT  # sliders have not come to rest
        again = rearrange(chain, state, direction=1)
        assert again == known
        assert np.array_equal(again.log, known.log)
        assert again.initial == known.initial
    assert len(exact._USED[n]) == 1


def test_a_slider_of_a_long_chain_takes_less_than_a_kilobyte() -> None:
    chain = paper_chain(10_000)
    work = placed(chain, Origin.of(chain, State.relaxed(chain)), 0, 0)
    arrays = (work.cell, work.whole, work.deviate, work.series)
    assert sum(array.nbytes for array in arrays if array is not None) < 1000 * chain.n


@pytest.mark.parametrize("n", [2, 3, 80, 81, 1000])
def test_what_is_compiled_before_a_run_is_what_its_chain_runs_through(n: int) -> None:
    first = exact.Exact().compiles(n)
    rooms = []
    for length in (n, first):
        chain = paper_chain(length)
        work = placed(chain, Origin.of(chain, State.relaxed(chain)), 0, 0)
        rooms.append(work.series is None)
    assert rooms[0] == rooms[1]


def test_no_name_of_the_layout_is_bound_twice() -> None:
    """A row named like another one would be written over it."""
    statements = ast.parse(inspect.getsource(layout)).body
    targets = [part for each in statements if isinstance(each, ast.Assign) for part in each.targets]
    names = [node for part in targets for node in ast.walk(part) if isinstance(node, ast.Name)]
    bound = Counter(node.id for node in names)
    assert bound["FORCE"] == bound["MOVED"] == bound["CHAIN"] == 1
    assert [name for name, count in bound.items() if count > 1] == []
