"""The closed form of a rearrangement meets the conditions of its events, and loses no energy."""

from __future__ import annotations

import random
from fractions import Fraction

import numpy as np
import pytest

from exactcreep import Chain, State, rearrange
from exactcreep.model.contacts import Contacts
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
def test_a_slider_stops_without_speed_and_starts_at_its_threshold(
    solver: str, arithmetic: Arithmetic, rounding: float
) -> None:
    result = avalanche(1, 4, solver=solver)
    contacts, draws = Contacts(result.chain, 7), result.initial.draws.tolist()
    stopped: dict[int, object] = {}
    with arithmetic.active():
        held = contacts.thresholds(result.initial.coefficients, arithmetic)
        ends = [piece(piece.t_max) for piece in result.sol.pieces]
        for event in result.events:
            k = [same(p.t_max, arithmetic.number(event.time)) for p in result.sol.pieces].index
            for n in (slider - 1 for slider in event.sliders):
                if event.kind is EventKind.STOP:
                    assert abs(ends[k(True)].velocities[n]) <= rounding
                    drawn = contacts.coefficient(n + 1, draws[n])
                    held[n] = contacts.holds(n, drawn, arithmetic)
                    draws[n] += 1
                    stopped[n] = event.time
                elif event.time > 0 and not same(stopped.get(n, -1), event.time):
                    assert abs(abs(ends[k(True)].forces[n]) - held[n]) <= rounding
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
