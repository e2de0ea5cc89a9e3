"""A rearrangement replayed from its events: positions, residuals, contacts and energies."""

from __future__ import annotations

import random
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from exactcreep import Chain, Event, EventKind, State, rearrange
from exactcreep.model.contacts import Contacts
from exactcreep.motion.arithmetic import FLOAT64, Arithmetic, balls_of, digits_of
from exactcreep.motion.replay import Replay
from exactcreep.solvers.rearrangement import Rearrangement


def avalanche(seed: int, n: int = 6, sigma: str = "0.05") -> Rearrangement:
    """Return an avalanche of more than ten events from a seeded stretched state."""
    rng = random.Random(seed)
    while True:
        slope = Fraction(rng.randint(-8, 8), 100)
        chain = Chain(n, 1, "0.1", "0.3", sigma, tan_alpha=slope)
        tensions = [rng.uniform(-0.5, 0.5) for _ in range(n - 1)]
        state = State.prepared(chain, tensions, seed=7)
        result = rearrange(chain, state, direction=0, seed=7)
        if len(result.events) > 10:
            return result


def replayed(result: Rearrangement, arithmetic: Arithmetic = FLOAT64) -> Replay:
    """Return the replay of a rearrangement that was drawn with seed 7."""
    contacts = Contacts(result.chain, 7)
    return Replay(result.chain, result.initial, result.events, arithmetic, contacts)


@pytest.mark.parametrize("seed", [0, 1])
def test_each_event_that_is_moved_by_1e_9_has_a_residual_that_says_so(seed: int) -> None:
    result = avalanche(seed)
    honest = replayed(result).residuals()
    assert max(honest) < 1e-13
    for number, event in enumerate(result.events):
        before, after = result.events[:number], result.events[number + 1 :]
        alone = all(other.time != event.time for other in (*before, *after))
        if not alone:
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


@pytest.mark.parametrize(("seed", "sigma"), [(0, "0"), (3, "0.05")])
def test_a_replay_ends_in_the_state_that_the_solver_reached(seed: int, sigma: str) -> None:
    result = avalanche(seed, sigma=sigma)
    replay = replayed(result)
    for _ in replay:
        pass
    end, known = replay.state(), result.state
    assert np.abs(end.tensions - known.tensions).max() < 1e-13
    assert np.abs(end.displacements - known.displacements).max() < 1e-13
    assert np.array_equal(end.coefficients, known.coefficients)
    assert np.array_equal(end.draws, known.draws)
    assert end.theta == result.theta
    assert not replay.flow.signs.any()


@pytest.mark.parametrize("arithmetic", [FLOAT64, digits_of(200)], ids=lambda a: a.name)
def test_the_energies_of_every_phase_close(arithmetic: Arithmetic) -> None:
    result = avalanche(1)
    replay = replayed(result, arithmetic)
    phases = 0
    for phase in replay:
        phase.arrive()
        energies = replay.energies()
        assert energies.friction >= 0
        assert energies.kinetic >= 0
        rounding = 1e-14 if arithmetic is FLOAT64 else 1e-50
        assert abs(energies.left) <= rounding
        phases += 1
    assert phases > 5
    assert replay.energies().kinetic == 0


def test_in_balls_a_replay_encloses_the_certified_end() -> None:
    chain = Chain(3, 1, "0.1", "0.3", "0.05", tan_alpha="0.02")
    state = State.prepared(chain, ["0.3", "-0.2"], seed=7)
    result = rearrange(chain, state, direction=0, seed=7, solver="certified")
    arithmetic = balls_of(result.report["precision_bits"])
    with arithmetic.active():
        replay = replayed(result, arithmetic)
        assert all(residual.contains(0) for residual in replay.residuals())
        for ours, theirs in zip(
            replay.state().displacements, result.state.displacements, strict=True
        ):
            assert ours.overlaps(theirs)
            assert ours.rad() < 1e-25
