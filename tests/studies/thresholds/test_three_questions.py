"""Three questions about a threshold: what each finds, and which other one it names."""

import inspect
import json
import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

from exactcreep import (
    Chain,
    Evidence,
    HalfLife,
    InputError,
    Intercept,
    Outcome,
    State,
    fate,
    half_life,
    intercept,
    survival,
    threshold,
)
from exactcreep.limits import Limits
from exactcreep.studies.thresholds import amplitudes
from exactcreep.studies.thresholds import threshold as search
from exactcreep.studies.thresholds.intercept import _fitted
from exactcreep.studies.thresholds.lasting import Lasting
from exactcreep.studies.thresholds.threshold import Threshold
from tests.conftest import Command
from tests.paper import captions

QUESTIONS = ("horizon", "lasting", "survival", "intercept")


def of(question: str, chain: Chain, **given: Any) -> Any:
    """Ask one question, shortly."""
    if question == "survival":
        return half_life(chain, **{"starts": 12, "cycles": 40} | given)
    if question == "intercept":
        return intercept(chain, **{"cycles": 100, "points": 8} | given)
    after = {"after": 20} if question == "horizon" else {}
    return threshold(chain, **{"solver": "exact", "digits": 6, "points": 60} | after | given)


@pytest.mark.parametrize(
    ("question", "chain", "named"),
    [
        ("lasting", captions(6), "half_life"),
        ("lasting", captions(6, "0.01"), "intercept"),
        ("horizon", captions(3, "0.01"), "intercept"),
        ("survival", captions(3, "0.01"), "intercept"),
        ("survival", captions(6, mu_s="0.5"), "threshold"),
        ("intercept", captions(6, mu_s="0.5"), "threshold"),
    ],
)
def test_a_question_without_sense_for_a_chain_names_the_right_one(
    question: str, chain: Chain, named: str
) -> None:
    with pytest.raises(InputError) as told:
        of(question, chain)
    assert f"`{named}`" in told.value.allowed
    right = {"half_life": "survival", "intercept": "intercept", "threshold": "lasting"}[named]
    assert of(right, chain, max_seconds=0).criterion == right


def test_each_question_returns_one_type_and_says_so() -> None:
    for function, kind in ((threshold, "Threshold"), (half_life, "HalfLife"),
                           (intercept, "Intercept")):  # fmt: skip
        assert inspect.signature(function).return_annotation == kind
        assert kind in (function.__doc__ or "")


def test_a_half_life_tells_how_much_of_it_is_done() -> None:
    heard: list[Any] = []
    found = half_life(captions(2), starts=12, cycles=10, progress=heard.append)
    shares = [progress.done / progress.total for progress in heard]
    assert shares == sorted(shares)
    assert 0 < shares[-1] <= 1
    assert heard[-1].total >= len(found.shares)


# --- what each finds ------------------------------------------------------------------------------


@pytest.mark.parametrize("question", ["horizon", "lasting"])
def test_one_slider_rests_and_without_slips_the_law_is_exact(question: str) -> None:
    alone = of(question, captions(1))
    assert (alone.lower, alone.outcome_at_lower) == (None, Outcome.AT_REST)
    assert alone.evidence is Evidence.PROVED
    found = of(question, Chain(6, 1000, "0.5", "0.5", tan_alpha="5/12"))
    assert float(found.lower) == pytest.approx(6 / 13 / 2000, rel=1e-6)
    assert "Eq. (seuil)" in found.compare


@pytest.mark.parametrize("question", QUESTIONS)
def test_beyond_mu_d_a_chain_runs_away_from_its_first_slip_on(question: str) -> None:
    chain = captions(2, tan_alpha="0.55")
    if question == "intercept":
        with pytest.raises(InputError, match="mu_d"):
            of(question, chain)
        return
    found = of(question, chain)
    first = (0.6 - 0.55) / math.hypot(1, 0.55) / 1000
    if question == "survival":
        size = 1e-3 / 1000  # of the tensions at the start
        assert first - 2 * size < found.low < found.amplitude < found.high < first + 2 * size
    else:
        assert float(found.lower) <= first <= float(found.upper)


@pytest.mark.parametrize("question", QUESTIONS)
def test_the_mirror_image_has_the_same_threshold(question: str) -> None:
    one, other = (of(question, captions(3, tan_alpha=slope)) for slope in ("0.23", "-0.23"))
    if question == "survival":  # the starts are not mirrored
        assert one.low < other.high
        assert other.low < one.high
    elif question == "intercept":
        off = math.hypot(one.systematic, other.systematic) + one.intercept / 20
        assert one.intercept == pytest.approx(other.intercept, abs=off)
        assert one.slope == pytest.approx(other.slope, rel=0.1)
        assert other.velocities.min() > 0
    else:
        assert (one.lower, one.upper) == (other.lower, other.upper)


def test_a_start_that_is_not_at_rest_is_first_rearranged() -> None:
    for question in ("horizon", "lasting"):
        found = of(question, captions(2), start_tension="1.5")
        assert 0 < float(found.lower) < float(found.upper) < 0.35e-3
    found = of("survival", captions(2), size=2)
    assert found.low < found.amplitude < found.high


@pytest.mark.parametrize("question", ["horizon", "lasting", "survival"])
def test_amplitudes_from_nothing_to_beyond_one_are_scanned(question: str) -> None:
    """A very soft chain: springs of natural length 1/10 g tau_dyn**2 creep from A = 3.4 on."""
    chain = Chain(2, "0.1", "0.5", "0.6", tan_alpha="0.25")
    edge = 0.35 * 4 / math.sqrt(17) / 0.1
    found = of(question, chain, low=0, high=8)
    low, high = (found.low, found.high) if question == "survival" else (found.lower, found.upper)
    assert float(low) <= edge * 1.01
    assert float(high) >= edge * 0.99
    with pytest.raises(InputError, match="negative"):
        of(question, chain, low=-1)


# --- lasting -------------------------------------------------------------------------------------


def test_windows_of_lasting_creep_are_edges_of_the_fate() -> None:
    chain = captions(3)
    found = threshold(chain, low="0.00045", high="0.00049", points=20,
                      windows=True, refine=1, digits=20)  # fmt: skip
    assert isinstance(found, Threshold)
    assert found.windows is not None
    assert [edge.begins for edge in found.windows] == [True, False, True]
    assert found.windows[0].evidence is Evidence.PROVED
    assert (found.windows[0].lower, found.windows[0].upper) == (found.lower, found.upper)
    for edge in found.windows:
        solver = "certified" if edge.evidence is Evidence.PROVED else "exact"
        sides = [fate(chain, side, solver=solver).outcome for side in (edge.lower, edge.upper)]
        assert [side is Outcome.CREEPING for side in sides] == [not edge.begins, edge.begins]
    assert [one["creep"] for one in found.summary()["windows"]] == ["begins", "ends", "begins"]


def test_where_starts_a_hair_apart_part_the_certified_fate_counts() -> None:
    chain, amplitude = captions(4), Fraction("0.00065")
    question = Lasting(chain, 10_000, State.relaxed(chain))
    assert question.float_fate(amplitude).outcome is Outcome.CREEPING
    assert not question.creeps(amplitude)
    assert (question.certified, question.sensitive) == ({amplitude: False}, {})


def test_where_no_certified_run_tells_either_an_amplitude_is_called_sensitive() -> None:
    chain, amplitude = captions(6), Fraction("0.00098")
    question = Lasting(chain, 10_000, State.relaxed(chain))
    assert question.creeps(amplitude) == (
        question.float_fate(amplitude).outcome is not Outcome.CYCLING
    )
    assert (question.certified, list(question.sensitive)) == ({}, [amplitude])


def test_creep_that_does_not_settle_has_an_interval_and_no_edge(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(search, "MOST_CYCLES", 1000)
    monkeypatch.setattr(amplitudes, "SHORT", 6)
    chain = captions(6)
    found = threshold(chain, low="0.00096", high="0.00104", points=8)
    assert isinstance(found, Threshold)
    assert found.evidence is Evidence.UNDECIDED
    assert "does not settle within 1000 cycles" in found.reason
    step = Fraction("0.00001")
    below = round(Fraction(found.lower or 0) / step) * step
    above = round(Fraction(found.upper or 0) / step) * step
    assert above - below == step
    settled = [fate(chain, a, cycles=1000, solver="exact").outcome for a in (below, above)]
    assert settled == [Outcome.CYCLING, Outcome.LIMIT]
    assert found.outcome_at_lower is Outcome.CYCLING
    for k in range(96, int(below / step)):
        assert fate(chain, k * step, cycles=1000, solver="exact").outcome is not Outcome.LIMIT
    assert found.stable_digits is None
    assert found.deciding_event is None


# --- survival ------------------------------------------------------------------------------------


def test_half_of_the_starts_of_two_sliders_live_half_the_size_below_their_edge() -> None:
    """Of tensions uniform in (-size, size), 1 - (a - l0 A)/size creep; a is the limit's."""
    edge = (0.6 - 0.25) * 4 / math.sqrt(17) - 1e-3 / 2
    found = half_life(captions(2), starts=60, cycles=20, digits=4)
    assert isinstance(found, HalfLife)
    assert found.low < edge / 1000 < found.high
    assert found.low < found.amplitude < found.high
    assert found.high - found.low < 6e-7
    assert (found.evidence, found.reason) == (Evidence.COMPUTED, "")
    given = half_life(captions(2), starts=60, cycles=20, digits=4,
                      bracket=(found.low, found.high))  # fmt: skip
    assert given.amplitude == pytest.approx(found.amplitude, rel=3e-4)
    for amplitude in (found.low, found.high):
        lives = survival(captions(2), amplitude, starts=60, cycles=20)
        assert found.shares[amplitude] == lives.creeping


def test_chaos_without_an_advance_is_no_creep_that_lives() -> None:
    """Thirty sliders, 6 % below Eq. (seuil), neither lock nor advance."""
    chain = captions(30)
    lives = survival(chain, Fraction("0.00342"), starts=4, cycles=200, seed=2)
    assert lives.moving.starts == 4
    assert lives.creeping.starts < 4
    creeping = lives.fractions["creeping"].starts + lives.fractions["runaway"].starts
    assert lives.creeping.starts == creeping


# --- intercept -----------------------------------------------------------------------------------


def test_the_error_of_an_intercept_is_its_scatter_over_measurements() -> None:
    random, x = np.random.default_rng(5), np.linspace(0.004, 0.007, 12)
    errors = random.uniform(0.05, 0.5, 12)
    fits = [
        _fitted(x, 15_000 * (x - 0.0036) + errors * random.standard_normal(12), errors.copy())
        for _ in range(300)
    ]
    off = np.array([(fit["intercept"] - 0.0036) / fit["error"] for fit in fits])
    assert abs(off.mean()) < 0.2
    assert 0.9 < off.std() < 1.1
    steep = np.array([(fit["slope"] - 15_000) / fit["slope_error"] for fit in fits])
    assert 0.9 < steep.std() < 1.1
    assert np.mean([fit["chi2"] for fit in fits]) == pytest.approx(10, abs=1)


def test_thirty_sliders_with_disorder_have_the_intercept_and_the_slope_of_the_laws() -> None:
    found = intercept(captions(30, "0.01"), cycles=100)
    assert isinstance(found, Intercept)
    off = abs(found.intercept - found.law_seuil)
    assert off < 3 * math.hypot(found.error, found.systematic)
    assert off < 0.02 * found.law_seuil
    assert found.slope == pytest.approx(found.law_slope, rel=0.02)
    assert found.law_slope == 15000
    assert found.evidence is Evidence.COMPUTED
    assert found.amplitudes[[0, -1]] == pytest.approx(np.array([1.2, 2]) * found.law_seuil)
    assert float(found.summary()["law_seuil"]) == pytest.approx(found.law_seuil, rel=1e-11)


def test_between_two_plateaus_no_law_has_a_slope() -> None:
    found = of("intercept", captions(4, "0.01"))
    assert math.isnan(found.law_slope)
    assert found.summary()["law_slope"] is None
    assert found.slope > 0


def test_stairs_are_no_straight_line_and_leave_the_threshold_undecided() -> None:
    stairs = intercept(captions(2), cycles=60)
    assert stairs.evidence is Evidence.UNDECIDED
    assert "steps" in stairs.reason
    assert stairs.systematic == math.inf  # the upper half lies on one step
    assert stairs.summary()["systematic"] is None
    bent = intercept(captions(6, "0.01"), fit=("0.5", "3"), cycles=150)
    assert bent.evidence is Evidence.UNDECIDED
    assert "chi2" in bent.reason
    assert bent.chi2_probability < 0.01


# --- out of time, and what is shown and kept -----------------------------------------------------


@pytest.mark.parametrize("question", QUESTIONS)
def test_no_time_gives_nothing_but_says_so(question: str) -> None:
    found = of(question, captions(5), max_seconds=0)
    assert found.reason == "max_seconds = 0 was reached"
    assert found.evidence is Evidence.UNDECIDED or question == "lasting"  # a short chain is quick
    assert json.loads(json.dumps(found.summary()))["reason"] == found.reason


def told_until(
    monkeypatch: pytest.MonkeyPatch, calls: int, ask: Any, chain: Chain, **given: Any
) -> Any:
    """Return what a threshold knows that is interrupted after so many reports of progress."""
    told: list[object] = []
    limits = Limits(interrupted=lambda: len(told) > calls)
    with monkeypatch.context() as patch:
        patch.setattr(Limits, "of", lambda *_, **__: limits)
        return ask(chain, progress=told.append, **given)


def test_a_half_life_out_of_time_keeps_the_sides_that_are_known(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def half(calls: int) -> HalfLife:
        return told_until(monkeypatch, calls, half_life, captions(2), starts=12, cycles=10)

    whole = half(10**9)
    assert whole.reason == ""
    known = 0
    for calls in range(0, 4 * len(whole.shares), 3):
        found = half(calls)
        if not found.reason:
            break
        assert found.reason == "interrupted"
        assert found.evidence is Evidence.UNDECIDED
        assert len(found.shares) <= calls + 1
        assert found.shares.items() <= whole.shares.items()
        for end, sure in ((found.low, lambda s: s.high < 0.5), (found.high, lambda s: s.low > 0.5)):
            if end is not None:
                assert sure(found.shares[end])
                known += 1
    assert known > 3


def test_an_intercept_out_of_time_keeps_its_velocities_and_a_line_through_eight(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    given = {"cycles": 100}
    whole = intercept(captions(6, "0.01"), **given)
    for calls in (2, 9):
        found = told_until(monkeypatch, calls, intercept, captions(6, "0.01"), **given)
        assert isinstance(found, Intercept)
        assert (found.reason, found.evidence) == ("interrupted", Evidence.UNDECIDED)
        assert set(zip(found.amplitudes, found.velocities, strict=True)) < set(
            zip(whole.amplitudes, whole.velocities, strict=True)
        )
        assert math.isnan(found.intercept) == (found.amplitudes.size < 8)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("threshold --n 2 --cycles 20 --solver exact --digits 9", "criterion horizon"),
        ("threshold --n 2 --solver exact --digits 9", "criterion lasting"),
        ("half-life --n 2 --cycles 20 --starts 12", "criterion survival"),
        ("intercept --n 6 --sigma-mu 0.01 --cycles 100 --fit 1.3 2", "criterion intercept"),
    ],
)
def test_the_command_prints_draws_and_writes_what_the_function_returns(
    words: str, says: str, command: Command, drawn: list[Figure]
) -> None:
    told = command(*words.split(), "--json", "--plot", "a.png", "--out", "a.nc")
    assert told.code == 0, told
    assert {"criterion", "law_seuil", "law_corrected", "theorems", "compare"} <= set(told.json)
    assert len(drawn) == 1
    assert told.json.get("sensitive", []) == []
    assert ("sensitive" in told.json) == (says == "criterion lasting")
    with xr.open_dataset("a.nc") as kept:
        assert kept.attrs["criterion"] == told.json["criterion"]
        assert kept.attrs["mu_s"] == "3/5"
        for name in ("lower", "low", "intercept"):
            if name in told.json:
                assert kept.attrs[name] == told.json[name]
    shown = command(*words.split()).out
    assert says in " ".join(shown.split())
    if "--cycles 20 --solver" in words:
        assert " creep at" not in shown
    refused = command(*words.split(), "--plot", "a.png").sentence
    assert "exists" in refused
