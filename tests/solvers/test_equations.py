"""Rearrangements and runs of every solver against the equations of motion, integrated apart.

The chains differ in friction, at their ends and in their dilations.
"""

from __future__ import annotations

import contextlib
import random
from collections.abc import Iterable, Mapping
from dataclasses import replace
from fractions import Fraction as F
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from exactcreep import (
    Chain,
    Creep,
    Cycles,
    Drive,
    Evidence,
    GaussianSteps,
    Outcome,
    State,
    Targets,
    creep,
    rearrange,
)
from exactcreep.model.enclosure import enclosure
from exactcreep.solvers.registry import solver_named
from exactcreep.solvers.tables import rearrangements
from tests.oracle.rearrangement import MP, Motion, Undecided, follow, integrate
from tests.paper import captions, paper_chain, unlike_chain

pytestmark = pytest.mark.filterwarnings("ignore:a static coefficient was drawn below")
SOLVERS: dict[str, tuple[dict[str, Any], float]] = {
    "exact": ({}, 1e-10),
    "certified": ({}, 1e-10),
    "verlet": ({"dt": 2e-4, "locate": True}, 1e-5),
}
"""Options, and how far a tension may be off."""


@cache
def known() -> list[tuple[Chain, State, int, int, Motion]]:
    """Return chains, states, ways (0: stretched, not at rest), seeds, and what happens next."""
    rng, found = random.Random(1907), []
    for seed in range(36):
        chain, way = unlike_chain(rng, 40 if seed < 20 else 10), rng.choice((1, -1))
        if seed < 20:
            run = creep(chain, Cycles("0.003", 2), seed=seed)
            if run.outcome is Outcome.RUNAWAY:
                continue
            tensions = run.state.tensions.astype(float)
            state = replace(run.state, tensions=tensions, displacements=np.zeros(chain.n))
        else:
            way, tensions = 0, [F(rng.randint(-120, 120), 100) for _ in range(chain.n - 1)]
            state = State.prepared(chain, tensions, seed=seed)
        with contextlib.suppress(Undecided):
            truth = integrate(chain, state.tensions, state.draws, way, seed)
            found.append((chain, state, way, seed, truth))
    assert len(found) > 25
    return found


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_rearrangement_follows_the_equations_of_motion(solver: str) -> None:
    options, bound = SOLVERS[solver]
    for chain, state, way, seed, truth in known():
        events = tuple(signature for _, signature in truth.log())
        if solver == "verlet" and any(len(who) > 1 for _, who, _ in events):
            continue  # it sees no ties
        found = rearrange(chain, state, direction=way, seed=seed, solver=solver, **options)
        assert found.itinerary == events
        assert found.state.draws.tolist() == truth.draws.tolist()
        tensions = np.array([float(x) for x in found.state.tensions])
        assert tensions == pytest.approx(truth.present_tensions(), abs=bound)
        ramp = float(chain.l0) * (float(found.state.theta) - float(state.theta))
        assert ramp == pytest.approx(float(truth.load), abs=bound)
        if solver == "certified":
            balls = [*(event.time for event in found.events), *found.state.displacements]
            assert_enclosed(balls, [*(time for time, *_ in truth.events), *truth.place])


def assert_enclosed(balls: Iterable[Any], truths: Iterable[Any], known: F = F(1, 10**40)) -> None:
    """Require that every ball is small, and holds a number that is known so well."""
    for ball, truth in zip(balls, truths, strict=True):
        proved, exact = enclosure(ball), F(int(MP.nint(truth * 2**150)), 2**150)
        assert abs(exact - proved.middle) <= proved.radius + known
        assert proved.radius < F(1, 10**12)


LEVEL, STRETCHED = captions(4, tan_alpha=0), captions(4)
SYMMETRIC = {"start": State.prepared(LEVEL, ["0.31", "-0.2", "0.31"])}
UNSTABLE = State.prepared(STRETCHED, ["0.9", "-0.8", "0.3"])
OWN = replace(State.relaxed(captions(3)), coefficients=np.array([0.8, 0.7, 0.9]))
MIRRORED = captions(4, tan_alpha=0, mu_d=["0.5", "0.4", "0.4", "0.5"], mu_s=["0.6"] * 4)
LOW = Chain(3, 100, "1/2", "1/2", "1/20", tan_alpha="1/5")
VERLET = {"solver": "verlet", "dt": "0.001", "locate": True}
RUNS: dict[str, tuple[Chain, Drive, dict[str, Any], float]] = {
    "disorder": (paper_chain(5), Cycles("0.0008", 1), {"seed": 5}, 1e-10),
    "by verlet": (paper_chain(3), Cycles("0.0008", 1), {"seed": 2, **VERLET}, 1e-4),
    "random steps": (paper_chain(3), GaussianSteps("0.0008", 4), {"seed": 2}, 1e-10),
    "unstable": (STRETCHED, Cycles("0.0006", 1), {"start": UNSTABLE}, 1e-10),
    "ties": (LEVEL, Cycles("0.0014", 1), SYMMETRIC, 1e-10),
    "proved ties": (MIRRORED, Cycles("0.0015", 1), SYMMETRIC | {"solver": "certified"}, 1e-10),
    "own coefficients": (captions(3), Targets(["0.002"]), {"start": OWN}, 1e-12),
    "draws below mu_d": (LOW, Targets(["0.012"]), {}, 1e-10),
}  # fmt: skip


@pytest.mark.parametrize("name", RUNS)
def test_a_run_follows_the_equations_of_motion(name: str) -> None:
    chain, drive, given, bound = RUNS[name]
    run = creep(chain, drive, record=("x", "events"), **given)
    assert run.event_count >= 20
    require_followed(run, bound)


def require_followed(run: Creep, bound: float) -> None:
    """Require that the events of a run, their times, and the places at targets are true."""
    found, known = both_ways(run.chain, run.drive, run.experiment.initial, run.seed, run.recorded)
    assert found.astype(float) == pytest.approx(known.astype(float), abs=bound)


def both_ways(
    chain: Chain, drive: Drive, start: State, seed: int, recorded: Mapping[str, NDArray[Any]]
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return times of events and places at targets, as recorded and as they are."""
    targets = [drive.exact_target(q, seed) for q in range(1, drive.target_count + 1)]
    log, places = follow(chain, start, targets, seed)
    events = [event for each in rearrangements(recorded) for event in each.events]
    assert [event.signature for event in events] == [signature for _, signature in log]
    times = [[event.time for event in events], [time for time, _ in log]]
    found, known = (np.array(each, dtype=object) for each in times)
    return np.append(found, recorded["x"].ravel()), np.append(known, np.ravel(places))


@pytest.mark.parametrize("seed", range(20))
def test_several_cycles_of_certified_enclose_the_equations_of_motion(seed: int) -> None:
    """Every event, its time and the places at targets, to 35 digits."""
    rng, events = random.Random(seed), 0
    while not 12 <= events <= 200:
        chain = unlike_chain(rng) if seed % 4 else paper_chain(rng.randint(2, 5))
        drive, start = (
            Cycles(F(rng.randint(15, 25) * chain.n, 10**5), 3),
            State.relaxed(chain, seed),
        )
        simulation = solver_named("certified", {}).simulation(chain, start, seed, ("x", "events"))
        recorded = simulation.follow(drive, 1, drive.target_count).recorded
        events = simulation.tally.events
    assert simulation.evidence is Evidence.PROVED
    assert_enclosed(*both_ways(chain, drive, start, seed, recorded), F(1, 10**35))


def vectors(rng: random.Random, springs: int, targets: int) -> Targets:
    """Return a path on which each spring has a dilation of its own."""
    return Targets(
        [[F(rng.randint(-20, 20), 10**4) for _ in range(springs)] for _ in range(targets)]
    )


ALIKE: dict[str, Any] = {"n": 4, "l0": 1000, "mu_d": "0.5", "mu_s": "0.6", "tan_alpha": 0}


@cache
def proved() -> list[Creep]:
    """Return runs along vectors that are proved."""
    rng, runs = random.Random(81), []
    for seed in range(11):
        chain = unlike_chain(rng)
        drive = vectors(rng, chain.n - 1, 4)
        runs.append(creep(chain, drive, seed=seed, solver="certified"))
    return [run for run in runs if run.evidence is Evidence.PROVED]


@pytest.mark.parametrize("solver", SOLVERS)
def test_runs_along_vectors_are_the_proved_ones(solver: str) -> None:
    options, bound = SOLVERS[solver]
    assert len(proved()) >= 10
    for run in proved():
        found = creep(run.chain, run.drive, seed=run.seed, solver=solver, **options)
        assert (found.slip_count, found.event_count) == (run.slip_count, run.event_count)
        reached = [[float(x) for x in each.state.displacements] for each in (found, run)]
        assert reached[0] == pytest.approx(reached[1], abs=10 * bound)


@pytest.mark.parametrize("solver", SOLVERS)
def test_vectors_along_one_profile_are_the_cycles_of_a_chain_that_has_it(solver: str) -> None:
    rng, (options, bound) = random.Random(12), SOLVERS[solver]
    for seed in range(4):
        shares = [F(rng.randint(30, 150), 100) for _ in range(3)]
        alike = ALIKE | {"sigma_mu": "0.01", "tan_alpha": F(seed, 20)}
        targets = [F(rng.randint(-30, 30), 10**4) for _ in range(3)]
        about: dict[str, Any] = {"solver": solver, "seed": seed, "record": ["slips", "tension"]}
        one = creep(Chain(**alike, expansion=shares), Targets(targets), **about, **options)
        # the way is cut in two: a target on it changes nothing
        halves = [(a + b) / 2 for a, b in zip([F(0), *targets], targets, strict=False)]
        both = [theta for pair in zip(halves, targets, strict=True) for theta in pair]
        own = Targets([[share * theta for share in shares] for theta in both])
        other = creep(Chain(**alike), own, **about, **options)
        slips = other.recorded["slips"]
        assert (slips[::2] + slips[1::2] == one.recorded["slips"]).all()
        tensions = (run.recorded["tension"].astype(float) for run in (one, other))
        assert next(tensions) == pytest.approx(next(tensions)[1::2], abs=10 * bound)
        assert other.dataset.theta.to_numpy().tolist() == own.targets(1, 6).tolist()
        assert other.state.theta.astype(float) == pytest.approx(own.targets(6, 1)[0], rel=1e-12)
