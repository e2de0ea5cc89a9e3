"""A rearrangement replayed from its events: positions, residuals, contacts and energies."""

from __future__ import annotations

import random
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from exactcreep import Chain, State, rearrange
from exactcreep.model.contacts import Contacts
from exactcreep.motion.arithmetic import FLOAT64, Arithmetic, balls_of
from exactcreep.motion.replay import Replay
from exactcreep.results import Event, EventKind
from exactcreep.solvers.rearrangement import Rearrangement


def avalanche(seed: int, n: int = 6, least: int = 10, **options: object) -> Rearrangement:
    """Return an avalanche of more than so many events from a seeded stretched state."""
    rng = random.Random(seed)
    while True:
        slope = Fraction(rng.randint(-8, 8), 100)
        chain = Chain(n, 1, "0.1", "0.3", "0.05", tan_alpha=slope, end_forces=("0.01", "-0.02"))
        tensions = [Fraction(rng.randint(-50, 50), 100) for _ in range(n - 1)]
        state = State.prepared(chain, tensions, seed=7)
        result = rearrange(chain, state, direction=0, seed=7, **options)
        if len(result.events) > least:
            return result


def replayed(result: Rearrangement, arithmetic: Arithmetic = FLOAT64) -> Replay:
    """Return the replay of a rearrangement that was drawn with seed 7."""
    contacts = Contacts(result.chain, 7)
    return Replay(result.chain, result.initial, result.events, arithmetic, contacts)


@pytest.mark.parametrize("seed", [0, 1])
def test_each_event_that_is_moved_by_1e_9_has_a_residual_that_says_so(seed: int) -> None:
    result = avalanche(seed)
    assert max(replayed(result).residuals()) < 1e-13
    for number, event in enumerate(result.events):
        before, after = result.events[:number], result.events[number + 1 :]
        if any(other.time == event.time for other in (*before, *after)):
            continue  # its partner of the same instant would have to move with it
        moved = (*before, replace(event, time=event.time + 1e-9), *after)
        flow = replayed(replace(result, events=(*before, event)))
        for phase in flow:
            phase.arrive()
            if phase.events[0] is event:
                rate = abs(rate_of(flow, event))
        residual = replayed(replace(result, events=moved)).residuals()[number]
        assert residual == pytest.approx(rate * 1e-9, rel=1e-3)


def rate_of(replay: Replay, event: Event) -> float:
    """Return how fast the condition of a lone slider's event changes just before it."""
    flow, n = replay.flow, event.sliders[0] - 1
    if event.kind is EventKind.STOP:
        return float(flow.forces[n] - flow.friction[n] * flow.signs[n])
    beside = [m for m in (n - 1, n + 1) if 0 <= m < replay.chain.n]
    return float(sum(flow.velocities[m] for m in beside))


@pytest.mark.parametrize(
    ("solver", "arithmetic", "rounding"),
    [("exact", FLOAT64, 1e-13), ("certified", balls_of(300), 1e-25)],
    ids=["float64", "balls"],
)
def test_energies_close_in_every_phase_and_the_end_is_the_solver_s(
    solver: str, arithmetic: Arithmetic, rounding: float
) -> None:
    result, phases = avalanche(1, 4, solver=solver), 0
    with arithmetic.active():
        replay = replayed(result, arithmetic)
        for phase in replay:
            phase.arrive()
            energies = replay.energies()
            assert energies.friction >= 0
            assert energies.kinetic >= -rounding
            assert abs(energies.left) <= rounding
            for event in phase.events[:1]:  # the others of an instant happen with the next phase
                phase.happen(event)
            phases += 1
        assert phases > 5
        assert abs(energies.end_forces) > 1e-3
        assert abs(replay.energies().kinetic) <= rounding
        end, known = replay.state(), result.state
        for name in ("tensions", "displacements"):
            assert max(abs(getattr(end, name) - getattr(known, name))) <= rounding
        if solver == "certified":
            assert all(
                residual.contains(0) for residual in replayed(result, arithmetic).residuals()
            )
    assert np.array_equal(end.coefficients, known.coefficients)
    assert np.array_equal(end.draws, known.draws)
    assert end.theta == result.theta
    assert not replay.flow.signs.any()
