"""Plans: by which rule a solver is named, what it costs, and how far to trust it."""

from __future__ import annotations

import json
import math
from fractions import Fraction

import pytest

from exactcreep import Chain, Cycles, Drive, GaussianSteps, Scene, State, creep, load_scene, plan
from exactcreep.studies.plan import plan_scene
from tests.paper import PAPER, captions, paper_chain

SIX, CYCLES, PAIR = paper_chain(6, tan_alpha="0.23"), Cycles("0.01", 100), captions(2)
STEEP = captions(2, tan_alpha="0.55")
ONSET = Fraction(float(PAIR.mu_s - PAIR.tan_alpha) * PAIR.cos_alpha) / PAIR.l0
BELOW = Cycles(ONSET * Fraction(99, 100), 60)


@pytest.mark.parametrize(
    ("chain", "drive", "given", "solver", "words"),
    [
        (captions(1), CYCLES, {}, "law", "no spring"),
        (captions(1, tan_alpha="0.55"), CYCLES, {}, "law", "no spring"),
        (paper_chain(1, tan_alpha="0.55"), CYCLES, {}, "exact", "every event"),  # its draw decides
        (captions(2, tan_alpha="0.5"), CYCLES, {}, "exact", "an avalanche may never end"),
        (captions(6, mu_s="0.5"), CYCLES, {}, "sliding", "no slips"),
        (PAIR, BELOW, {}, "law", "ever starts"),
        (paper_chain(2, "0.05"), BELOW, {}, "exact", "every event"),  # a draw may start earlier
        (PAIR, CYCLES, {}, "law", "staircase"),
        (STEEP, CYCLES, {}, "exact", "every event"),
        (PAIR, CYCLES, {"record": ("x",)}, "exact", "every event"),
        (PAIR, CYCLES, {"start": State.prepared(PAIR, ["0.1"])}, "exact", "every event"),
        (PAIR, CYCLES, {"digits": 16}, "certified", "more than 15 digits"),
        (PAIR, GaussianSteps("0.01", 9), {}, "exact", "every event"),
    ],
)
def test_a_rule_names_the_solver_and_says_why(
    chain: Chain, drive: Drive, given: dict[str, object], solver: str, words: str
) -> None:
    found = plan(chain, drive, **given)
    assert found.solver == solver
    assert words in found.reason
    below = abs(chain.tan_alpha) < chain.mu_d
    assert bool(found.law) == (below or solver == "law")


@pytest.mark.parametrize("over", [Fraction(99, 100), Fraction(7)])
def test_a_law_that_needs_no_run_is_what_the_run_gives(over: Fraction) -> None:
    found = plan(PAIR, Cycles(ONSET * over, 60))
    run = creep(PAIR, Cycles(ONSET * over, 60), record=())
    assert found.solver == "law"
    assert found.law[0] == pytest.approx(run.velocity, rel=1e-12, abs=0)
    assert (run.event_count == 0) == (over < 1)


@pytest.mark.parametrize(
    ("changed", "solver"),
    [
        ({}, "sliding"),
        ({"physical.contacts": 60}, "exact"),  # the next pivot is worth more
        ({"run.record": ["x"]}, "exact"),
        ({"physical.tan_alpha": "0.55"}, "exact"),
    ],
)
def test_the_descent_of_a_solid_over_many_slips_needs_no_inertia(
    changed: dict[str, object], solver: str
) -> None:
    roof = dict(load_scene("bristol-roof").tables["physical"])
    roof |= {"mu_d": "0.5", "mu_s": "0.577", "sigma_mu": "0.01"}
    daily = {"kind": "cycles", "temperature_amplitude": "3.5", "cycles": 2}
    about = {"physical": roof, "drive": daily, "run": {"record": ["x_G"]}}
    scene = Scene.from_mapping(about).with_settings(changed)
    ((_, planned),) = plan_scene(scene)
    assert planned.solver == solver
    assert ("measured" in planned.reason) == (solver == "sliding")


def test_the_cost_comes_from_the_first_half_cycles() -> None:
    small = plan(SIX, CYCLES).summary()
    run = creep(SIX, CYCLES, record=(), max_events=20_000)
    assert small["events"] == pytest.approx(creep(SIX, CYCLES, record=()).event_count, rel=0.2)
    assert small["known_until"] == run.known_until
    large = plan(SIX, CYCLES, digits=20, record=("x",))
    needed = [need.name for need in large.needs if need.needed]
    assert needed == ["disorder", "inertia", "trajectories", "digits"]
    assert large.events == small["events"]
    json.dumps(large.summary(), allow_nan=False)
    steep = plan(STEEP, Cycles("0.01", 9))
    assert math.isnan(steep.seconds)
    assert steep.summary()["seconds"] is None


def test_every_member_of_a_scene_has_its_plan_and_an_explicit_solver_is_kept() -> None:
    drive = {"kind": "cycles", "amplitude": "0.01", "cycles": 100}
    scene = {"chain": PAPER | {"n": 6, "sigma_mu": "0.01", "tan_alpha": "0.23"}, "drive": drive}
    vary = {"chain.sigma_mu": [0, "0.01"], "chain.n": [2, 6]}
    plans = plan_scene(Scene.from_mapping(scene | {"vary": vary}))
    assert [one.solver for _, one in plans] == ["law", "exact", "exact", "exact"]
    named = Scene.from_mapping(scene | {"run": {"solver": "verlet", "dt": "0.01"}})
    ((_, one),) = plan_scene(named)
    assert (one.explicit, one.solver, one.reason) == ("verlet", "verlet", "the scene names it")
    assert one.seconds > 0
