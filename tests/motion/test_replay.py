"""The closed form of a rearrangement meets the conditions of its events, and loses no energy."""

from __future__ import annotations

import random
from fractions import Fraction

import numpy as np
import pytest

from exactcreep import Chain, State, rearrange
from exactcreep.model.enclosure import same
from exactcreep.motion.arithmetic import FLOAT64, Arithmetic, balls_of
from exactcreep.results import EventKind
from exactcreep.solvers.rearrangement import Rearrangement


def avalanche(seed: int, n: int = 6, **options: object) -> Rearrangement:
    """Return an avalanche of more than ten events from a seeded stretched state."""
    rng = random.Random(seed)
    while True:
        slope = Fraction(rng.randint(-8, 8), 100)
        chain = Chain(n, 1, "0.1", "0.3", "0.05", tan_alpha=slope, end_forces=("0.01", "-0.02"))
        tensions = [Fraction(rng.randint(-50, 50), 100) for _ in range(n - 1)]
        state = State.prepared(chain, tensions, seed=7)
        result = rearrange(chain, state, direction=0, seed=7, **options)
        if len(result.events) > 10:
            return result


@pytest.mark.parametrize(
    ("solver", "arithmetic", "rounding"),
    [("exact", FLOAT64, 1e-13), ("certified", balls_of(300), 1e-25)],
    ids=["float64", "balls"],
)
def test_sliders_stop_without_speed_at_their_events_and_rest_where_the_state_says(
    solver: str, arithmetic: Arithmetic, rounding: float
) -> None:
    result, stopped = avalanche(1, 4, solver=solver), set()
    with arithmetic.active():
        for event in result.events:
            if event.kind is EventKind.STOP:
                time, stopping = arithmetic.number(event.time), [n - 1 for n in event.sliders]
                before = next(p for p in result.sol.pieces if same(p.t_max, time))
                assert max(abs(before(before.t_max).velocities[stopping])) <= rounding
                stopped.update(stopping)
        off = result.sol(result.duration).positions - result.state.displacements
        assert max(abs(off)) <= rounding
    assert len(stopped) > 1


def test_friction_dissipates_along_the_way_what_springs_and_weights_give() -> None:
    result = avalanche(0)
    times = np.linspace(0, float(result.duration), 20_000)
    speeds = abs(result.sol(times).velocities)
    friction = result.chain.friction * speeds.sum(axis=0)
    found = result.energy(times).dissipated
    steps = np.diff(times) * (friction[1:] + friction[:-1]) / 2
    assert found == pytest.approx(np.append(0, np.cumsum(steps)), abs=1e-6)
    assert found[-1] > 0.01
