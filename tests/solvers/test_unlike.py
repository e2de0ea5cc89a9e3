"""Chains whose friction, ends and dilations differ: solvers against the equations of motion."""

from __future__ import annotations

import contextlib
import random
from fractions import Fraction as F
from functools import cache
from typing import Any

import numpy as np
import pytest

from exactcreep import Chain, Cycles, Evidence, Outcome, State, creep, rearrange
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


def unlike(rng: random.Random) -> Chain:
    """Return a chain that differs in friction, at its ends, in its dilations, or in all of them."""
    n, kinds = rng.randint(2, 7), rng.randint(1, 7)
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


@cache
def known() -> list[tuple[Chain, State, int, int, Trajectory]]:
    """Return chains, states at rest under way, directions, seeds, and what happens next."""
    rng, found = random.Random(1907), []
    for seed in range(20):
        chain, way = unlike(rng), rng.choice((1, -1))
        run = creep(chain, Cycles("0.003", 2), seed=seed, solver="reference")
        if run.outcome is Outcome.RUNAWAY:
            continue
        with contextlib.suppress(Undecided):
            tensions, draws = run.state.tensions.astype(float), run.state.draws
            found.append(
                (chain, run.state, way, seed, integrate(chain, tensions, draws, way, seed))
            )
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
