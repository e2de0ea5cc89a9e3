"""Plans: by which rule a solver is named, what it costs, and how far to trust it."""

from __future__ import annotations

import json
import math
from fractions import Fraction

import pytest

from exactcreep import Chain, Cycles, GaussianSteps, State, creep, plan
from exactcreep.cli import status
from exactcreep.limits import Limits
from exactcreep.model.drive import Drive
from exactcreep.scene import Scene
from exactcreep.studies.plan import RULES, plan_scene
from tests.paper import PAPER, paper_chain

SIX, CYCLES = paper_chain(6, tan_alpha="0.23"), Cycles("0.01", 100)
PAIR = Chain(2, 1000, "0.5", "0.6", tan_alpha="0.25")
SCENE = {
    "chain": PAPER | {"n": 6, "sigma_mu": "0.01", "tan_alpha": "0.23"},
    "drive": {"kind": "cycles", "amplitude": "0.01", "cycles": 100},
}
ONSET = Fraction(float(PAIR.mu_s - PAIR.tan_alpha) * PAIR.cos_alpha) / PAIR.l0


@pytest.mark.parametrize(
    ("chain", "drive", "given", "solver", "words"),
    [
        (Chain(1, 1000, "0.5", "0.6", tan_alpha="0.25"), CYCLES, {}, "law", "no spring"),
        (Chain(6, 1000, "0.5", "0.5", tan_alpha="0.25"), CYCLES, {}, "sliding", "no slips"),
        (PAIR, Cycles(ONSET * Fraction(99, 100), 9), {}, "law", "ever starts"),
        (PAIR, CYCLES, {}, "law", "staircase"),
        (PAIR, CYCLES, {"record": ("x",)}, "exact", "every event"),
        (PAIR, CYCLES, {"start": State.prepared(PAIR, ["0.1"])}, "exact", "every event"),
        (PAIR, CYCLES, {"digits": 16}, "certified", "more than 15 digits"),
        (PAIR, GaussianSteps("0.01", 9), {}, "exact", "every event"),
        (SIX, CYCLES, {}, "exact", "every event"),
    ],
)
def test_a_rule_names_the_solver_and_says_why(
    chain: Chain, drive: Drive, given: dict[str, object], solver: str, words: str
) -> None:
    found = plan(chain, drive, **given)
    assert found.solver == solver
    assert words in found.reason
    assert found.reason in {rule.reason for rule in RULES}


@pytest.mark.parametrize("over", [Fraction(99, 100), Fraction(101, 100), Fraction(2), Fraction(7)])
def test_a_law_that_needs_no_run_is_what_the_run_gives(over: Fraction) -> None:
    found = plan(PAIR, Cycles(ONSET * over, 60))
    run = creep(PAIR, Cycles(ONSET * over, 60), record=())
    assert found.solver == "law"
    assert found.law[0] == pytest.approx(run.velocity, rel=1e-12, abs=0)
    assert (run.event_count == 0) == (over < 1)


def test_no_law_is_the_answer_where_it_is_only_near() -> None:
    """With disorder a slider may start earlier; the paper's law is shown beside, and no answer."""
    drawn = Chain(2, 1000, "0.5", "0.6", "0.05", tan_alpha="0.25")
    found = plan(drawn, Cycles(ONSET * Fraction(99, 100), 60))
    assert found.solver == "exact"
    assert len(found.law) == 1
    steep = Chain(2, 1000, "0.5", "0.6", tan_alpha="0.55")
    assert plan(steep, Cycles("0.001", 9)).solver == "exact"


def test_the_cost_is_counted_and_not_measured() -> None:
    one, other = (plan(SIX, CYCLES).summary() for _ in range(2))
    assert one == other
    run = creep(SIX, CYCLES, record=())
    assert one["events"] == pytest.approx(run.event_count, rel=0.2)
    assert one["seconds"] == pytest.approx(224e-9 * one["events"], rel=1e-12)
    assert plan(SIX, CYCLES, digits=30).seconds > 100 * one["seconds"]
    steep = plan(Chain(2, 1000, "0.5", "0.6", tan_alpha="0.55"), Cycles("0.01", 9))
    assert math.isnan(steep.seconds)
    assert steep.summary()["seconds"] is None


def test_the_trust_is_that_of_a_run() -> None:
    found, run = plan(SIX, CYCLES), creep(SIX, CYCLES, record=(), max_events=20_000)
    assert found.course == run.course != ""
    assert found.trusted_half_cycles == run.trusted_half_cycles


def test_a_plan_says_what_is_needed() -> None:
    slides = plan(paper_chain(6, "0", tan_alpha="0.23", mu_s="0.5"), GaussianSteps("0.01", 1000))
    assert [need.name for need in slides.needs if need.needed] == ["random dilations"]
    large = plan(SIX, CYCLES, digits=20, record=("x",))
    needed = ["disorder", "inertia", "trajectories", "digits"]
    assert [need.name for need in large.needs if need.needed] == needed
    assert "solver='certified'" in repr(large)
    json.dumps(large.summary(), allow_nan=False)


def test_every_member_of_a_scene_has_its_plan_and_an_explicit_solver_is_kept() -> None:
    scene = Scene.from_mapping(
        SCENE | {"vary": {"chain.sigma_mu": [0, "0.01"], "chain.n": [2, 6]}}
    )
    assert [one.solver for _, one in plan_scene(scene)] == ["law", "exact", "exact", "exact"]
    named = Scene.from_mapping(SCENE | {"run": {"solver": "verlet", "dt": "0.01"}})
    ((_, one),) = plan_scene(named)
    assert (one.explicit, one.solver, one.reason) == ("verlet", "verlet", "the scene names it")


def test_a_plan_whose_time_is_over_keeps_the_members_before(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    chain = SCENE["chain"] | {"n": 2, "sigma_mu": 0}
    vary = {"chain.tan_alpha": ["0.1", "0.2", "0.3"]}
    scene = Scene.from_mapping(SCENE | {"chain": chain, "vary": vary})
    assert plan_scene(scene, max_seconds=0) == []
    heard: list[float] = []
    monkeypatch.setattr(Limits, "passed", lambda limits: heard[-1:] == [2])
    plans = plan_scene(scene, max_seconds=10**6, progress=lambda told: heard.append(told.done))
    assert [settings["chain.tan_alpha"] for settings, _ in plans] == ["0.1", "0.2"]
    assert heard == [0, 1, 2]


def test_the_command_prints_a_plan_and_many_members_in_a_line(
    capsys: pytest.CaptureFixture[str],
) -> None:
    words = ["plan", "two-sliders-cycles", "--set", "chain.sigma_mu=0"]
    assert status([*words, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["solver"], told["scene"]) == ("law", "two-sliders-cycles")
    assert status([*words, "--set", "chain.sigma_mu=0.01"]) == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "exact: every event counts" in text
    assert "cost: about" in text
    vary = "vary.drive.amplitude=[0.01,0.02,0.03,0.04,0.05,0.06,0.07,0.08,0.09]"
    assert status([*words, "--set", vary]) == 0
    _, line = capsys.readouterr().out.splitlines()
    assert line.startswith("drive.amplitude = 0.01 … 0.09 (9 members): law: two relaxed sliders")
    assert status([*words, "--set", vary, "--max-seconds", "0"]) == 3
    assert "0 of 9 members are planned" in capsys.readouterr().err
