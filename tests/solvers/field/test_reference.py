"""One readable solver in three arithmetics, and the compiled one: the same claims for all."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest

from exactcreep import Cycles, Evidence, Outcome, Path, State, rearrange
from exactcreep.solvers.interface import Stretch
from exactcreep.solvers.registry import solver_named
from exactcreep.watch.limits import NO_LIMITS, Limits
from tests.paper import captions, event_rows, paper_chain

SOLVERS = [
    pytest.param(("exact", {}), id="exact"),
    pytest.param(("reference", {}), id="float64"),
    pytest.param(("mpmath", {"digits": 30}), id="mpmath"),
    pytest.param(("certified", {"digits": 20}), id="balls"),
]
every_solver = pytest.mark.parametrize("solver", SOLVERS)


def rearranged(chain, state, solver, direction=1, seed=0):
    name, options = solver
    return rearrange(chain, state, direction=direction, seed=seed, solver=name, **options)


def fresh(chain, solver, seed=0, record=("x", "events")):
    start = State.relaxed(chain, seed)
    return solver_named(*solver).simulation(chain, start, seed, record)


def followed(chain, drive, solver, seed=0, limits=NO_LIMITS):
    simulation = fresh(chain, solver, seed)
    return simulation, simulation.follow(drive, 1, drive.half_cycles, limits)


def floats(values):
    return np.array(values, dtype=object).astype(float)


@every_solver
def test_at_threshold_a_slider_stays_and_two_ends_start_together(solver):
    chain = captions(3, tan_alpha="1/5")
    simulation, stretch = followed(chain, Cycles("0.001", 1), solver)
    lone = [(0, 0, 3, 1), (1, 1, 3, 1)]
    starts, stops = [(0, 0, 1, -1), (0, 0, 3, 1)], [(1, 1, 1, -1), (1, 1, 3, 1)]
    both = starts + stops
    assert event_rows(stretch)[:8] == lone + lone + both
    if solver[0] == "certified":
        assert simulation.evidence is Evidence.PROVED
        assert simulation.tally.undecided == 0
    else:
        assert simulation.evidence is Evidence.UNDECIDED
        assert simulation.tally.undecided > 0


@every_solver
@pytest.mark.parametrize("n", [2, 5])
def test_identical_motions_are_one_event_and_stay_identical(n, solver):
    chain = captions(n, tan_alpha=0)
    simulation, stretch = followed(chain, Cycles(Fraction(n, 500), 1), solver)
    x = floats(stretch.recorded["x"])
    assert (x == -x[:, ::-1]).all()
    assert abs(x).max() > 1
    counted = np.bincount(stretch.recorded["event_slider"], minlength=n + 1)
    assert counted[1] == counted[n] > 0
    if solver[0] == "certified":
        assert simulation.evidence is Evidence.PROVED


@every_solver
def test_the_runaway_state_satisfies_its_certificate(solver):
    chain = captions(3, tan_alpha="0.55")
    result = rearranged(chain, State.relaxed(chain), solver)
    v = floats(result.velocities)
    forces = result.state.forces(chain)
    mean, a = v.mean(), forces - chain.friction
    stiffness = np.array([[1.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    inner, pull = v - mean, a - a.mean()
    energy = inner @ inner + pull @ np.linalg.pinv(stiffness) @ pull
    assert result.outcome is Outcome.RUNAWAY
    assert mean >= math.sqrt(2 / 3 * energy) * (1 - 1e-12)


@every_solver
@pytest.mark.parametrize("k", [3, 6, 12])
def test_every_grazing_crossing_is_found_with_bounded_work(k, solver):
    chain = captions(2, tan_alpha=Fraction(1, 2) + Fraction(1, 10**k))
    simulation, stretch = followed(chain, Path(["0.01"]), solver, limits=Limits(12))
    first, second, *_ = event_rows(Stretch(0, stretch.whole))
    assert first == (0, 0, 2, 1)
    assert second == (1, 0, 1, 1)
    gap = math.pi - float(stretch.whole["event_time"][1])
    assert gap > 0
    assert gap == pytest.approx(2 * math.sqrt(10 * 10.0**-k), rel=0.1)
    assert simulation.report()["root_evaluations"] <= 40 * simulation.tally.events
    assert (simulation.evidence is Evidence.PROVED) == (solver[0] == "certified")


def test_all_solvers_tell_the_same_story():
    chain = paper_chain(6)
    drive = Cycles("0.003", 1)
    told, *others = (followed(chain, drive, p.values[0], seed=7)[1] for p in SOLVERS)
    assert len(event_rows(told)) > 300
    for other in others:
        assert event_rows(told) == event_rows(other)
        off = floats(told.recorded["x"]) - floats(other.recorded["x"])
        assert abs(off).max() < 1e-11
