"""The measured trade: what it compares is compared rightly, and it says what it did not measure."""

from __future__ import annotations

import json
import math
import time
from dataclasses import replace
from itertools import count, islice

import numpy as np
import pytest
from scipy import stats

from exactcreep.cli import status
from exactcreep.figures.comparison import draw_tradeoff
from exactcreep.laws import prediction
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles
from exactcreep.model.numbers import InputError
from exactcreep.progress import Progress
from exactcreep.quasistatic.creep import creep
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.studies.contest import Contestant, mean_velocity, rests_between
from exactcreep.studies.tradeoff import _rests_in_turn, ladder, tradeoff

pytestmark = pytest.mark.xdist_group("tradeoff")  # they share `measured`


def experiment_of(n=3, mu_s="0.6", sigma_mu="0.01", tan_alpha="0.23", cycles=100):
    chain = Chain(n, 100, "0.5", mu_s, sigma_mu, tan_alpha=tan_alpha)
    return Experiment.of(chain, Cycles("0.05", cycles))


FIELD = (
    Contestant("exact"),
    Contestant("sliding"),
    Contestant("verlet", {"dt": "0.5"}),
    Contestant("verlet", {"dt": "0.1"}),
    Contestant("verlet", {"dt": "0.01"}),
    Contestant("verlet", {"dt": "0.01", "locate": True}),
    Contestant("certified", {"digits": 20}),
)


TICK = 1e-3
"""Seconds between two looks at the clock."""


def let_tick(patch, tick=TICK):
    """Let the clock go on when somebody looks at it: every machine measures the same, and as much.

    What a timing comes to is not asked here; it would depend on what else the machine does.
    """
    ticks = count()
    patch.setattr(time, "perf_counter", lambda: tick * next(ticks))


@pytest.fixture(autouse=True)
def _ticking(monkeypatch):
    let_tick(monkeypatch)


def measure(told, tick=TICK):
    with pytest.MonkeyPatch.context() as patch:
        let_tick(patch, tick)
        return tradeoff(
            experiment_of(),
            budget=5,  # 5000 looks at the clock
            contestants=FIELD,
            progress=told.append,
        )


@pytest.fixture(scope="module")
def measured():
    told: list[Progress] = []
    return measure(told), told


def of(found, label):
    (one,) = [score for score in found.scores if score.contestant.label == label]
    return one


def test_single_rearrangements_are_exact_to_rounding_and_verlet_is_not(measured):
    found, _ = measured
    exact, certified = of(found, "exact"), of(found, "certified, 20 digits")
    crude, fine = of(found, "verlet, dt = 0.1"), of(found, "verlet, dt = 0.01")
    located = of(found, "verlet, dt = 0.01, located")
    assert exact.compared >= 20
    assert exact.different == 0
    assert exact.error_high < 1e-12
    assert certified.error_high < 1e-20
    assert crude.error > 3 * fine.error
    assert fine.error > 3 * located.error
    assert located.error > exact.error
    assert crude.different >= fine.different >= located.different
    crudest = of(found, "verlet, dt = 0.5")
    assert 0 < crudest.different < crudest.compared
    assert crudest.wrong == crudest.different / crudest.compared
    assert found.summary()["truth"] == {"solver": "certified", "options": {"digits": 50}}


def test_events_from_the_start_agree_with_the_certified_ones(measured):
    found, _ = measured
    assert found.events_compared >= 10
    for label in ("exact", "certified, 20 digits"):
        score = of(found, label)
        assert score.agreed_all
        assert score.agreed > 0
    assert of(found, "verlet, dt = 0.1").agreed <= of(found, "exact").agreed


def test_the_bias_is_that_of_two_whole_runs(measured):
    found, _ = measured
    sliding = of(found, "sliding")
    assert sliding.bias_half_cycles == of(found, "exact").bias_half_cycles == 200
    experiment = experiment_of()
    (law,) = prediction(experiment.chain, experiment.drive).sliding
    assert found.velocity + sliding.bias == pytest.approx(law, rel=1e-12, abs=0)
    whole = creep(experiment.chain, experiment.drive, burn_in=40)
    assert abs(whole.velocity - found.velocity) < 3 * found.velocity_error
    assert math.isnan(of(found, "certified, 20 digits").bias)


def test_times_are_positive_and_relative_to_exact(measured):
    found, _ = measured
    exact, certified = of(found, "exact"), of(found, "certified, 20 digits")
    for score in found.scores:
        assert 0 < score.seconds_low <= score.seconds <= score.seconds_high
        assert score.ratio > 0
        assert score.memory > 0
    assert exact.ratio == 1
    assert certified.ratio == certified.seconds / exact.seconds
    assert of(found, "sliding").notes == ["the sliding limit has no rearrangements"]
    assert "times events" in certified.notes[0]


def test_the_measurement_keeps_to_its_budget_and_says_how_far_it_is(measured):
    found, told = measured
    assert found.seconds < 4
    fractions = [progress.done for progress in told]
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1.0
    assert len({progress.text for progress in told}) > 10


def test_a_slower_machine_measures_less_and_concludes_nothing_else(measured):
    (found, _), slow = measured, measure([], 4 * TICK)
    assert 0 < slow.events_compared < found.events_compared
    for less, more in zip(slow.scores, found.scores, strict=True):
        solver = less.contestant.solver
        assert 0 < less.compared < more.compared or solver == "sliding"
        assert less.agreed <= more.agreed
        assert less.agreed_all or less.agreed == more.agreed
        if solver in ("exact", "certified"):
            assert less.different == more.different == 0
            assert less.agreed_all
            assert more.agreed_all
        assert less.bias_half_cycles == more.bias_half_cycles
        assert less.bias == more.bias or solver == "certified"


def test_what_has_no_truth_is_counted_and_held_against_no_one(monkeypatch):
    monkeypatch.setattr("exactcreep.studies.tradeoff.settled", lambda found: False)
    found = measure([], 4 * TICK)
    assert found.no_truth == found.summary()["rearrangements_without_truth"] > 10
    for score in found.scores:
        assert (score.compared, score.different) == (0, 0)
        assert math.isnan(score.wrong)
        assert math.isnan(score.error)


def test_seeds_are_taken_in_turn_and_their_velocities_are_independent(measured):
    alone, _ = measured
    experiment = experiment_of()
    found = tradeoff(experiment, budget=5, seeds=4, contestants=FIELD[:2])
    assert found.seeds == tuple(found.summary()["seeds"]) == (0, 1, 2, 3)
    sliding = of(found, "sliding")
    x_G = [creep(experiment.chain, experiment.drive, seed=k).recorded["x_G"] for k in range(4)]
    each = [mean_velocity(x, experiment) for x in x_G]
    assert found.velocity == np.mean(each)
    sem = stats.sem(each)
    assert found.velocity_error == pytest.approx(stats.t.ppf(0.975, 3) * sem / 1.96, rel=1e-9)
    law = alone.velocity + of(alone, "sliding").bias
    assert sliding.bias == pytest.approx(law - found.velocity, rel=1e-9)
    assert sliding.bias_half_cycles == 800
    exact = of(found, "exact")
    low, high = exact.wrong_interval
    assert exact.different == low == 0
    assert high == pytest.approx(1.96**2 / (exact.compared + 1.96**2), rel=1e-3)
    rests = list(islice(_rests_in_turn([experiment, replace(experiment, seed=9)]), 6))
    assert [seed for seed, _ in rests] == [0, 9, 0, 9, 0, 9]
    assert [rest.state.theta for _, rest in rests[::2]] == [
        rest.state.theta for rest in islice(rests_between(experiment), 3)
    ]


def test_a_run_too_short_for_the_error_of_its_bias_says_so():
    found = tradeoff(experiment_of(cycles=20), budget=5, contestants=FIELD[:2])
    sliding = of(found, "sliding")
    assert math.isnan(sliding.bias_error)
    assert not math.isnan(sliding.bias)
    assert any("take more seeds" in note for note in sliding.notes)
    assert "nan" not in found.advice


def test_the_advice_is_one_sentence_that_names_what_was_measured(measured):
    found, _ = measured
    assert found.advice.startswith("Take exact: ")
    assert found.advice.count(". ") == 0
    assert "Verlet at dt = 0.01" in found.advice
    assert "sliding costs" in found.advice


def test_the_picture_and_the_summary_hold_every_contestant(measured, tmp_path):
    found, _ = measured
    target = tmp_path / "trade.png"
    draw_tradeoff(found, target, title="three sliders")
    assert target.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    summary = json.loads(json.dumps(found.summary(), allow_nan=False))
    assert [one["label"] for one in summary["scores"]] == [one.label for one in FIELD]
    with pytest.raises(InputError):
        draw_tradeoff(found, tmp_path / "trade.txt")


def test_without_an_excess_the_sliding_limit_is_alone():
    experiment = experiment_of(mu_s="0.5", sigma_mu=0)
    assert ladder(experiment.chain) == [Contestant("sliding")]
    found = tradeoff(experiment, budget=1)
    (score,) = found.scores
    assert score.seconds > 0
    assert math.isnan(score.error)
    assert found.advice.startswith("Take sliding")


def test_a_chain_at_rest_is_told_to_be_at_rest():
    chain = Chain(3, 100, "0.5", "0.6", tan_alpha="0.23")
    few = (Contestant("exact"), Contestant("sliding"), Contestant("verlet", {"dt": "0.1"}))
    found = tradeoff(Experiment.of(chain, Cycles("1e-6", 100)), budget=1, contestants=few)
    assert found.velocity == 0
    assert found.advice == "Take exact, or no run at all: nothing moves here."
    assert of(found, "sliding").bias == 0


@pytest.mark.parametrize(("budget", "field"), [("0.5", "budget"), ("inf", "budget")])
def test_a_budget_that_is_none_is_refused(budget, field):
    with pytest.raises(InputError) as caught:
        tradeoff(experiment_of(), budget=budget)
    assert caught.value.field == field


def test_a_chain_that_may_run_away_has_no_trade():
    with pytest.raises(InputError, match="tan_alpha"):
        tradeoff(experiment_of(tan_alpha="0.5"), budget=2)


def test_the_command_prints_the_trade(capsys, tmp_path):
    picture = tmp_path / "trade.png"
    words = [
        "tradeoff",
        "two-sliders-cycles",
        "--set",
        "chain.mu_s=0.5",
        "--set",
        "chain.sigma_mu=0",
        "--budget",
        "1",
    ]
    assert status([*words, "--json", "--plot", str(picture)]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert [one["solver"] for one in printed["scores"]] == ["sliding"]
    assert picture.exists()
    assert status([*words, "--plot", str(picture)]) == 2
    assert status(words) == 0
    assert "Take sliding" in capsys.readouterr().out
