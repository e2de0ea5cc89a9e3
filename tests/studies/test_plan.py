"""Plans: what a scene needs, what each solver would cost, and which of them runs."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from exactcreep.cli import status
from exactcreep.limits import Limits
from exactcreep.model.drive import Cycles, GaussianSteps
from exactcreep.model.numbers import InputError
from exactcreep.quasistatic.creep import AccuracyWarning, creep
from exactcreep.scene import Scene
from exactcreep.studies.plan import plan, plan_scene
from tests.paper import PAPER, paper_chain

SIX = paper_chain(6, tan_alpha="0.23")
SCENE = {
    "chain": PAPER | {"n": 6, "sigma_mu": "0.01", "tan_alpha": "0.23"},
    "drive": {"kind": "cycles", "amplitude": "0.01", "cycles": 100},
}


def test_a_mean_velocity_is_never_said_to_be_known_to_the_digits_of_a_trajectory(capsys):
    drive = Cycles("0.003", 12)
    chain = paper_chain(10)
    with pytest.warns(AccuracyWarning, match="not known to be reached"):
        auto = creep(chain, drive, seed=3, solver="auto", accuracy="1e-6")
    assert math.isnan(auto.velocity_error)  # twelve cycles, but the pilot has more
    long = creep(chain, Cycles("0.003", 1500), seed=3, record=())
    off = abs(auto.velocity - long.velocity) / abs(auto.velocity)
    assert 1e-3 < off < auto.report["relative_error"] < 1
    assert auto.report["known_by"] == "measured"
    told = plan(chain, drive, seed=3, accuracy="1e-6").summary()
    exact = told["candidates"][2]
    assert exact["statistical_error"] > 1e-3
    assert exact["half_cycles_needed"] > 24e6
    assert not told["accuracy_reached"]
    assert "e-12" not in json.dumps([told["candidates"], told["reason"], auto.report])
    words = ["plan", "six-sliders-cycles", "--accuracy", "1e-6", "--set", "drive.cycles=100"]
    assert status(words) == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "e-12" not in text
    assert "200 half-cycles do not reach the accuracy" in text


@pytest.mark.parametrize("accuracy", [0, 1, -1, "2", "nan", "wide", None, True])
def test_an_accuracy_outside_0_to_1_is_refused(accuracy):
    with pytest.raises(InputError, match="accuracy"):
        creep(SIX, Cycles("0.01", 2), solver="auto", accuracy=accuracy)
    with pytest.raises(InputError, match="accuracy"):
        plan(SIX, Cycles("0.01", 2), accuracy=accuracy)


def test_a_plan_says_what_is_needed_and_what_it_costs():
    small = plan(paper_chain(6, "0", tan_alpha="0.23", mu_s="0.5"), GaussianSteps("0.01", 1000))
    needs = {need.name: need.needed for need in small.needs}
    assert needs == {
        "disorder": False,
        "random dilations": True,
        "inertia": False,
        "trajectories": False,
        "digits": False,
    }
    large = plan(SIX, Cycles("0.01", 1000), accuracy="1e-6", record=("x",))
    needs = {need.name: need.needed for need in large.needs}
    assert needs == {
        "disorder": True,
        "random dilations": False,
        "inertia": True,
        "trajectories": True,
        "digits": False,
    }
    costs = plan(SIX, Cycles("0.01", 1000)).costs
    assert costs["law"] > 0
    assert "solver='exact'" in repr(large)
    assert "seconds_of_exact" in repr(large)
    assert 0 < costs["sliding"] < costs["exact"]
    json.dumps(large.summary(), allow_nan=False)


def test_an_explicit_solver_is_never_overridden():
    scene = Scene.from_mapping(SCENE | {"run": {"solver": "verlet", "dt": "0.01"}})
    ((_, one),) = plan_scene(scene, accuracy="0.05")
    assert (one.explicit, one.solver, one.choice.name) == ("verlet", "verlet", "law")
    ((_, free),) = plan_scene(Scene.from_mapping(SCENE), accuracy="0.05")
    assert (free.explicit, free.solver) == (None, "law")
    auto = Scene.from_mapping(SCENE | {"run": {"solver": "auto", "accuracy": "1e-6"}})
    ((_, strict),) = plan_scene(auto)
    assert (strict.accuracy, strict.solver) == (1e-6, "exact")


def test_every_member_of_a_scene_has_its_plan():
    scene = Scene.from_mapping(SCENE | {"vary": {"chain.n": [2, 6], "run.record": [["x"], []]}})
    plans = plan_scene(scene, accuracy="0.05")
    assert [settings["chain.n"] for settings, _ in plans] == [2, 2, 6, 6]
    assert [one.solver for _, one in plans] == ["exact", "law", "exact", "law"]


def test_a_plan_whose_time_is_over_keeps_the_members_before(monkeypatch):
    chain = SCENE["chain"] | {"n": 2, "sigma_mu": 0}
    vary = {"chain.tan_alpha": ["0.1", "0.2", "0.3"]}
    scene = Scene.from_mapping(SCENE | {"chain": chain, "vary": vary})
    assert plan_scene(scene, max_seconds=0) == []
    over, told = [], []

    def show(progress):
        told.append((progress.done, progress.total, progress.counted))
        over.append(progress.done == 2)

    monkeypatch.setattr(Limits, "passed", lambda limits: over[-1])
    plans = plan_scene(scene, accuracy="0.05", max_seconds=10**6, progress=show)
    assert [settings["chain.tan_alpha"] for settings, _ in plans] == ["0.1", "0.2"]
    assert told == [(0, 3, "members"), (1, 3, "members"), (2, 3, "members")]


def test_the_command_plans_many_members_in_a_line_for_what_is_equal(capsys):
    vary = "vary.drive.amplitude=[0.01,0.02,0.03,0.04,0.05,0.06,0.07,0.08,0.09]"
    words = ["plan", "two-sliders-cycles", "--set", "chain.sigma_mu=0", "--set", vary]
    assert status(words) == 0
    heading, line = capsys.readouterr().out.splitlines()
    assert "two-sliders-cycles" in heading
    assert line.startswith(
        "drive.amplitude = 0.01 … 0.09 (9 members): law, accurate enough: error none, "
    )
    assert status([*words, "--max-seconds", "0"]) == 3
    assert "0 of 9 members are planned" in capsys.readouterr().err


def test_the_command_prints_a_plan(capsys):
    words = ["plan", "two-sliders-cycles", "--set", "chain.sigma_mu=0"]
    assert status([*words, "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["solver"] == "law"
    assert printed["scene"] == "two-sliders-cycles"
    assert [entry["solver"] for entry in printed["candidates"]] == [
        "law",
        "sliding",
        "exact",
        "certified",
    ]
    assert status([*words, "--set", "run.solver=exact"]) == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "the scene names exact, and that is what runs" in text
    assert status(["plan", "two-sliders-cycles", "--accuracy", "7"]) == 2


def test_a_plan_counts_the_seeds_that_reach_the_accuracy_and_they_do():
    chain, drive = paper_chain(2, tan_alpha="0.23"), Cycles("0.0008", 100)
    found = plan(chain, drive, accuracy="0.003")
    (exact,) = [one for one in found.choice.candidates if one.name == "exact"]
    assert not found.accuracy_reached
    needed = found.seeds(exact)
    assert 2 <= needed == math.ceil((exact.statistical / 0.003) ** 2)
    true = np.mean([creep(chain, drive, seed=1000 + s, record=()).velocity for s in range(120)])
    seeds = range(int(needed))
    mean = np.mean([creep(chain, drive, seed=seed, record=()).velocity for seed in seeds])
    assert abs(mean - true) <= 0.003 * true
    assert found.seconds(exact) == pytest.approx(needed * found.costs["exact"], rel=1e-12)


@pytest.mark.parametrize("question", ["speed", None, 3])
def test_another_question_is_refused(question):
    with pytest.raises(InputError, match="question"):
        creep(SIX, Cycles("0.01", 2), solver="auto", question=question)
    with pytest.raises(InputError, match="question"):
        plan(SIX, Cycles("0.01", 2), question=question)
