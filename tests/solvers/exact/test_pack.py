"""A state placed in the arrays of the compiled loop, and read back from them."""

from __future__ import annotations

import random
from fractions import Fraction
from itertools import pairwise

import pytest

from exactcreep import Chain, Outcome, State, rearrange
from exactcreep.solvers.exact import layout
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
def test_what_was_computed_before_in_the_same_arrays_changes_no_bit(n: int) -> None:
    rng, states = random.Random(n), []
    for seed in range(20):
        for chain in (
            paper_chain(n, tan_alpha="0.499"),
            Chain(n, 10, "0.3", "0.6", tan_alpha="0.1"),
        ):
            tensions = [rng.uniform(-2, 2) for _ in range(n - 1)]
            states.append((chain, State.prepared(chain, tensions, seed=seed)))
    known = [rearrange(chain, state, direction=1) for chain, state in states]
    for k in rng.sample(range(len(states)), len(states)):
        chain, state = states[k]
        given_up = rearrange(*states[0], direction=1, max_events=2)
        assert n == 1 or given_up.outcome is Outcome.LIMIT  # sliders have not come to rest
        assert rearrange(chain, state, direction=1) == known[k]
