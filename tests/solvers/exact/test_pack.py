"""A state placed in the arrays of the compiled loop, and read back from them."""

from __future__ import annotations

import random
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest

from exactcreep import Chain, Outcome, State, rearrange
from exactcreep.solvers.exact import layout
from exactcreep.solvers.exact import solver as exact
from exactcreep.solvers.exact.pack import Origin, dilation, placed

THIRDS = [Fraction(k, 3) for k in (1, -2, 4, -5)]


def chain_of(n: int) -> Chain:
    return Chain(n, Fraction(2, 7), "0.5", "0.6", tan_alpha="0.3")


@pytest.mark.parametrize("n", [1, 2, 3, 5])
@pytest.mark.parametrize("theta", [Fraction(0), Fraction(1, 11)])
def test_forces_are_placed_to_twice_the_digits_of_a_float(n: int, theta: Fraction) -> None:
    chain = chain_of(n)
    tensions = THIRDS[: n - 1]
    origin = Origin.of(chain, State.prepared(chain, tensions, theta=theta))
    cell = placed(chain, origin, 0, 0).cell[:, layout.PAD : layout.PAD + n]
    load = chain.l0 * theta if n > 1 else Fraction(0)
    bare = [0, *(tension + load for tension in tensions), 0]  # theta is added to the ends apart
    for k, (before, after) in enumerate(pairwise(bare)):
        placed_force = Fraction(cell[layout.FORCE, k]) + Fraction(cell[layout.FORCE_LOW, k])
        true = after - before + Fraction(chain.sin_alpha)
        assert abs(placed_force - true) < Fraction(1, 2**100)
        assert cell[layout.REST, k] == cell[layout.FORCE, k]


@pytest.mark.parametrize("theta", [Fraction(0), Fraction(1, 11)])
def test_tensions_are_read_back_rounded_once(theta: Fraction) -> None:
    chain = chain_of(5)
    origin = Origin.of(chain, State.prepared(chain, THIRDS, theta=theta))
    work = placed(chain, origin, 0, 0)
    assert origin.read(work)[0].tolist() == [float(t) for t in THIRDS]
    here = placed(chain, origin, 0, 0)
    here.cell[layout.TRAVEL, layout.PAD + 1] += 0.7
    here.cell[layout.X, layout.PAD + 1] = 1e-17
    here.now["theta"][0] += 0.1
    more = Fraction(0.7) + Fraction(1e-17)
    less = Fraction(here.now["theta"][0]) - Fraction(work.now["theta"][0])
    moved = [THIRDS[0] + more, THIRDS[1] - more, *THIRDS[2:]]
    assert origin.read(here)[0].tolist() == [float(t - less) for t in moved]
    load = float(here.now["theta"][0]), float(here.now["theta_low"][0])
    assert origin.ramped(load).tolist() == [float(t - less) for t in THIRDS]


def test_theta_is_the_float_nearest_to_the_load_over_the_length() -> None:
    chain = chain_of(3)
    for theta in (Fraction(1, 11), Fraction(-2, 3), Fraction(10) ** -30, Fraction(0)):
        origin = Origin.of(chain, State.prepared(chain, theta=theta))
        assert dilation(chain, origin.load) == float(theta)


def test_every_table_begins_at_a_multiple_of_64_bytes() -> None:
    for n in (3, 7, 30):
        chain = chain_of(n)
        work = placed(chain, Origin.of(chain, State.relaxed(chain)), 0, layout.LOGS_EVENTS)
        for table in (work.cell, work.deviate, work.series):
            assert table.ctypes.data % 64 == 0
            assert table.flags.c_contiguous


def test_balls_are_taken_at_their_midpoints() -> None:
    chain = chain_of(3)
    proved = rearrange(chain, State.relaxed(chain), direction=1, solver="certified").state
    tensions = proved.tensions.astype(float)
    origin = Origin.of(chain, proved)
    assert origin.read(placed(chain, origin, 0, 0))[0].tolist() == tensions.tolist()
    assert dilation(chain, origin.load) == float(proved.theta)


@pytest.mark.parametrize("n", [1, 2, 6])
def test_a_rearrangement_in_arrays_used_before_has_the_bits_of_one_in_new_arrays(n: int) -> None:
    steep = Chain(n, 1000, "0.5", "0.6", "0.01", tan_alpha="0.499")
    level = Chain(n, 10, "0.3", "0.6", tan_alpha="0.1")
    rng = random.Random(n)
    states = [
        (chain, State.prepared(chain, [rng.uniform(-2, 2) for _ in range(n - 1)], seed=seed))
        for seed in range(20)
        for chain in (steep, level)
    ]
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
