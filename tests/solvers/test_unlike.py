"""Chains whose friction, ends and dilations differ: solvers against the equations of motion."""

from __future__ import annotations

import contextlib
import random
from fractions import Fraction as F
from functools import cache
from typing import Any

import numpy as np
import pytest

from exactcreep import (
    Chain,
    Creep,
    Cycles,
    Evidence,
    Outcome,
    Path,
    State,
    creep,
    rearrange,
    resume,
)
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


def vectors(rng: random.Random, springs: int, targets: int) -> Path:
    """Return a path on which each spring has a dilation of its own."""
    return Path([[F(rng.randint(-20, 20), 10**4) for _ in range(springs)] for _ in range(targets)])


@cache
def proved() -> list[Creep]:
    """Return runs along vectors that are proved."""
    rng, runs = random.Random(81), []
    for seed in range(8):
        chain = unlike(rng)
        drive = vectors(rng, chain.n - 1, 4)
        runs.append(creep(chain, drive, seed=seed, solver="certified"))
    return [run for run in runs if run.evidence is Evidence.PROVED]


@pytest.mark.parametrize("solver", SOLVERS)
def test_runs_along_vectors_agree_with_proved_ones(solver: str) -> None:
    options, bound = SOLVERS[solver]
    assert len(proved()) >= 7
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


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_level_chain_walks_under_a_front_and_not_under_a_profile(solver: str) -> None:
    chain, options = Chain(5, 1000, "0.5", "0.55", "0.005", tan_alpha=0), SOLVERS[solver][0]

    def advances(rows: list[list[F]]) -> np.ndarray:
        run = creep(chain, Path(rows * 3), solver=solver, seed=2, **options)
        return np.diff(run.recorded["x_G"].astype(float)[len(rows) - 1 :: len(rows)])

    # springs get warm one after the other, and cold together
    front = [[F(spring <= k, 300) for spring in range(4)] for k in range(4)] + [[F(0)] * 4]
    assert advances(front) == pytest.approx(2.1, abs=0.1)
    assert advances([row[::-1] for row in front]) == pytest.approx(-2.1, abs=0.1)
    profile = [[F(4 - spring, 400) for spring in range(4)], [F(0)] * 4]
    assert advances(profile) == pytest.approx(0, abs=0.1)


@pytest.mark.parametrize("solver", SOLVERS)
def test_vectors_along_one_profile_are_the_cycles_of_a_chain_that_has_it(solver: str) -> None:
    rng, (options, bound) = random.Random(12), SOLVERS[solver]
    for seed in range(4):
        shares = [F(rng.randint(30, 150), 100) for _ in range(3)]
        alike = {"n": 4, "l0": 1000, "mu_d": "0.5", "mu_s": "0.6", "sigma_mu": "0.01",
                 "tan_alpha": F(seed, 20)}  # fmt: skip
        targets = [F(rng.randint(-30, 30), 10**4) for _ in range(3)]
        about: dict[str, Any] = {"solver": solver, "seed": seed, "record": ["slips", "tension"]}
        one = creep(Chain(**alike, expansion=shares), Path(targets), **about, **options)
        # the way is cut in two: a target on it changes nothing
        halves = [(a + b) / 2 for a, b in zip([F(0), *targets], targets, strict=False)]
        both = [theta for pair in zip(halves, targets, strict=True) for theta in pair]
        own = Path([[share * theta for share in shares] for theta in both])
        other = creep(Chain(**alike), own, **about, **options)
        slips = other.recorded["slips"]
        assert (slips[::2] + slips[1::2] == one.recorded["slips"]).all()
        tensions = (run.recorded["tension"].astype(float) for run in (one, other))
        assert next(tensions) == pytest.approx(next(tensions)[1::2], abs=10 * bound)
        assert other.state.theta.astype(float) == pytest.approx(own.targets(6, 1)[0], rel=1e-12)


@pytest.mark.parametrize("solver", ["exact", "verlet"])
def test_a_run_along_vectors_goes_on_from_checkpoints_files_and_states(
    solver: str, tmp_path: Any
) -> None:
    rng = random.Random(3)
    chain = unlike(rng)
    drive = vectors(rng, chain.n - 1, 12)
    about: dict[str, Any] = {"solver": solver, "seed": 5, "record": ["x", "tension", "slip_table"]}
    whole = creep(chain, drive, **about)
    for most in (10, 57, 200):
        creep(chain, drive, checkpoint=tmp_path / "run", force=True, max_events=most, **about)
        again = resume(tmp_path / "run")
        assert again.state == whole.state
        assert all((again.recorded[k] == v).all() for k, v in whole.recorded.items())
    whole.save(tmp_path / "run.nc")
    kept = Creep.load(tmp_path / "run.nc")
    assert (kept.drive, kept.state) == (drive, whole.state)
    assert kept.dataset.theta.to_numpy().tolist() == drive.targets(1, 12).tolist()
    assert kept.state_at(7).displacements.tolist() == whole.recorded["x"][6].tolist()
    rest = creep(chain, Path(drive.theta[7:]), start=kept.state_at(7), **about)
    assert rest.state.displacements == pytest.approx(whole.state.displacements, abs=1e-8)
    rest.save(tmp_path / "rest.nc")
    begun = Creep.load(tmp_path / "rest.nc").experiment.start
    assert begun == kept.state_at(7)
