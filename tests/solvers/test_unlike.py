"""Chains whose friction, ends and dilations differ: solvers against the equations of motion."""

from __future__ import annotations

import random
from collections.abc import Iterator
from fractions import Fraction as F
from functools import cache
from typing import Any

import numpy as np
import pytest

from exactcreep import Chain, Creep, Cycles, Evidence, Outcome, State, creep, rearrange
from tests.oracle.rearrangement import Trajectory, Undecided, integrate

pytestmark = pytest.mark.filterwarnings("ignore:a static coefficient was drawn below")
SOLVERS: dict[str, tuple[dict[str, Any], float]] = {
    "exact": ({}, 1e-10),
    "reference": ({}, 1e-10),
    "mpmath": ({}, 1e-10),
    "certified": ({}, 1e-10),
    "verlet": ({"dt": 2e-4, "locate": True}, 1e-5),
}
"""Options, and how far a tension may be off the oracle, which integrates to some 1e-11."""


def unlike(rng: random.Random, most: int = 7) -> Chain:
    """Return a chain that differs in friction, at its ends, in its dilations, or in all of them."""
    n, kinds = rng.randint(2, most), rng.randint(1, 7)
    friction = [F(rng.randint(40, 60), 100) for _ in range(n)]
    return Chain(
        n, 1000,
        mu_d=friction if kinds & 1 else F(1, 2),
        mu_s=[mu + F(rng.randint(2, 15), 100) for mu in friction] if kinds & 1 else F(3, 5),
        sigma_mu=F(rng.choice((0, 5, 10)), 1000),
        tan_alpha=F(rng.randint(-20, 25), 100),
        end_forces=[F(rng.randint(-12, 12), 100) for _ in "12"] if kinds & 2 else (0, 0),
        expansion=[F(rng.randint(30, 150), 100) for _ in range(n - 1)] if kinds & 4 else (),
    )  # fmt: skip


def cases() -> Iterator[tuple[Chain, State, int, int]]:
    """Yield chains, states at rest under way, directions of the ramp and seeds."""
    rng = random.Random(1907)
    for seed in range(20):
        chain = unlike(rng)
        result = creep(chain, Cycles("0.003", 2), seed=seed, solver="reference")
        if result.outcome is not Outcome.RUNAWAY:
            yield chain, result.state, rng.choice((1, -1)), seed


@cache
def known() -> list[tuple[Chain, State, int, int, Trajectory]]:
    """Return those of which the equations of motion tell what happens."""
    found = []
    for chain, state, way, seed in cases():
        try:
            tensions, draws = state.tensions.astype(float), state.draws
            found.append((chain, state, way, seed, integrate(chain, tensions, draws, way, seed)))
        except Undecided:
            continue
    assert len(found) > 12
    return found


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_rearrangement_of_an_unlike_chain_follows_the_equations_of_motion(solver: str) -> None:
    options, bound = SOLVERS[solver]
    for chain, state, way, seed, truth in known():
        found = rearrange(chain, state, direction=way, seed=seed, solver=solver, **options)
        assert found.itinerary == tuple(truth.itinerary)
        tensions = np.array([float(x) for x in found.state.tensions])
        assert tensions == pytest.approx(truth.tensions, abs=bound)
        ramp = float(chain.l0) * (float(found.state.theta) - float(state.theta))
        assert ramp == pytest.approx(truth.ramp, abs=bound)


@cache
def proved() -> list[Creep]:
    """Return runs that are proved."""
    rng, runs = random.Random(81), []
    for seed in range(12):
        run = creep(unlike(rng, most=5), Cycles("0.002", 1), seed=seed, solver="certified")
        if run.evidence is Evidence.PROVED:
            runs.append(run)
    assert len(runs) >= 11  # one assumes a tie, and says so
    return runs


@pytest.mark.parametrize("solver", SOLVERS)
def test_runs_of_unlike_chains_agree_with_proved_ones(solver: str) -> None:
    options, bound = SOLVERS[solver]
    for run in proved():
        found = creep(run.chain, run.drive, seed=run.seed, solver=solver, **options)
        assert found.slip_count == run.slip_count
        reached = [[float(x) for x in each.state.displacements] for each in (found, run)]
        assert reached[0] == pytest.approx(reached[1], abs=10 * bound)


@pytest.mark.parametrize("solver", sorted(SOLVERS.keys() - {"verlet"}))  # which sees no ties
@pytest.mark.parametrize(
    "differs",
    [
        {"expansion": [1, "0.5", 1]},
        {"end_forces": ("0.1", "-0.1")},
        {"mu_d": ["0.5", "0.4", "0.4", "0.5"], "mu_s": ["0.6"] * 4},
    ],
)
def test_sliders_of_a_mirror_symmetric_chain_start_together(
    solver: str, differs: dict[str, Any]
) -> None:
    chain = Chain(**{"n": 4, "l0": 1000, "mu_d": "0.5", "mu_s": "0.6", "tan_alpha": 0} | differs)
    proved = creep(chain, Cycles("0.0015", 2), solver="certified", record=["slips"])
    found = creep(chain, Cycles("0.0015", 2), solver=solver, record=["slips"], **SOLVERS[solver][0])
    assert proved.evidence is Evidence.PROVED
    assert found.slip_count >= found.event_count  # two sliders at each start and stop
    assert (found.recorded["slips"] == proved.recorded["slips"]).all()
    assert found.event_count == proved.event_count
    tensions = [[float(x) for x in run.state.tensions] for run in (found, proved)]
    assert tensions[0] == pytest.approx(tensions[1], abs=1e-12)
