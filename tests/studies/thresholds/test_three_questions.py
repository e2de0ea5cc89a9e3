"""Three questions about a threshold: what each finds, and which other one it names."""

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
from tests.conftest import Command
from tests.paper import captions

SEARCHES = ("horizon", "lasting")
QUESTIONS = (*SEARCHES, "survival", "intercept")


def of(question: str, chain: Chain, **given: Any) -> Any:
    """Ask one question, shortly."""
    if question == "survival":
        return half_life(chain, **{"starts": 8, "cycles": 40} | given)
    if question == "intercept":
        return intercept(chain, **{"cycles": 100, "points": 8} | given)
    after = {"after": 20} if question == "horizon" else {}
    return threshold(chain, **{"solver": "exact", "digits": 6, "points": 60} | after | given)


def ends(found: Any) -> tuple[float, float]:
    """Return the bracket, or the interval of a half-life."""
    if isinstance(found, HalfLife):
        assert found.low < found.amplitude < found.high
        return found.low, found.high
    return float(found.lower), float(found.upper)


@pytest.mark.parametrize(
    ("question", "chain", "named", "right"),
    [
        ("lasting", captions(6), "half_life", "survival"),
        ("lasting", captions(6, "0.01"), "intercept", "intercept"),
        ("horizon", captions(3, "0.01"), "intercept", "intercept"),
        ("survival", captions(3, "0.01"), "intercept", "intercept"),
        ("survival", captions(6, mu_s="0.5"), "threshold", "lasting"),
        ("intercept", captions(6, mu_s="0.5"), "threshold", "lasting"),
    ],
)
def test_a_question_without_sense_for_a_chain_names_the_right_one(
    question: str, chain: Chain, named: str, right: str
) -> None:
    with pytest.raises(InputError) as told:
        of(question, chain)
    assert f"`{named}`" in told.value.allowed
    assert of(right, chain, max_seconds=0).criterion == right


# --- what each finds --------------------------------------------------------------------------


@pytest.mark.parametrize("question", SEARCHES)
def test_one_slider_rests_and_without_slips_the_law_is_exact(question: str) -> None:
    alone = of(question, captions(1))
    assert (alone.lower, alone.upper, alone.outcome_at_lower) == (None, None, Outcome.AT_REST)
    assert alone.evidence is Evidence.PROVED
    found = of(question, captions(6, mu_s="0.5", tan_alpha="5/12"))
    assert float(found.lower) == pytest.approx(6 / 13 / 2000, rel=1e-6)
    assert "Eq. (seuil)" in found.compare


@pytest.mark.parametrize("question", QUESTIONS)
def test_beyond_mu_d_a_chain_runs_away_from_its_first_slip_on(question: str) -> None:
    chain = captions(2, tan_alpha="0.55")
    if question == "intercept":
        with pytest.raises(InputError, match="mu_d"):
            of(question, chain)
        return
    low, high = ends(of(question, chain))
    first = (0.6 - 0.55) / math.hypot(1, 0.55) / 1000
    if question == "survival":  # of starts with tensions up to 1e-3
        assert first - 2e-6 < low < high < first + 2e-6
    else:
        assert low <= first <= high


@pytest.mark.parametrize("question", QUESTIONS)
def test_the_mirror_image_has_the_same_threshold(question: str) -> None:
    one, other = (of(question, captions(3, tan_alpha=slope)) for slope in ("0.23", "-0.23"))
    if question == "intercept":
        off = math.hypot(one.systematic, other.systematic) + one.intercept / 20
        assert one.intercept == pytest.approx(other.intercept, abs=off)
        assert one.slope == pytest.approx(other.slope, rel=0.1)
        assert other.velocities.min() > 0
    elif question == "survival":  # the starts are not mirrored
        assert one.low < other.high
        assert other.low < one.high
    else:
        assert ends(one) == ends(other)


@pytest.mark.parametrize("question", QUESTIONS[:3])
def test_a_start_that_is_not_at_rest_is_first_rearranged(question: str) -> None:
    given = {"size": 2} if question == "survival" else {"start_tension": "1.5"}
    low, high = ends(of(question, captions(2), **given))
    assert 0 < low < high
    assert high < 0.35e-3 or question == "survival"


@pytest.mark.parametrize("question", QUESTIONS[:3])
def test_amplitudes_from_nothing_to_beyond_one_are_scanned(question: str) -> None:
    """A very soft chain: springs of natural length 1/10 g tau_dyn**2 creep from A = 3.4 on."""
    chain = captions(2, l0="0.1")
    edge = 0.35 * 4 / math.sqrt(17) / 0.1
    low, high = ends(of(question, chain, low=0, high=8))
    assert low / 1.01 <= edge <= high / 0.99
    with pytest.raises(InputError, match="negative"):
        of(question, chain, low=-1)


# --- lasting ----------------------------------------------------------------------------------


def test_windows_of_lasting_creep_are_edges_of_the_fate() -> None:
    chain = captions(3)
    found = threshold(chain, low="0.00045", high="0.00049", points=20,
                      windows=True, refine=1, digits=20)  # fmt: skip
    assert [edge.begins for edge in found.windows] == [True, False, True]
    assert found.windows[0].evidence is Evidence.PROVED
    assert (found.windows[0].lower, found.windows[0].upper) == (found.lower, found.upper)
    for edge in found.windows:
        solver = "certified" if edge.evidence is Evidence.PROVED else "exact"
        sides = [fate(chain, side, solver=solver).outcome for side in (edge.lower, edge.upper)]
        assert [side is Outcome.CREEPING for side in sides] == [not edge.begins, edge.begins]
    assert [one["creep"] for one in found.summary()["windows"]] == ["begins", "ends", "begins"]


@pytest.mark.parametrize(("n", "amplitude"), [(4, Fraction("0.00065")), (6, Fraction("0.00098"))])
def test_where_starts_a_hair_apart_part_the_certified_fate_counts_or_it_is_called_sensitive(
    n: int, amplitude: Fraction
) -> None:
    chain = captions(n)
    question = Lasting(chain, 10_000, State.relaxed(chain))
    floats = question.float_fate(amplitude).outcome
    assert question.creeps(amplitude) == (n == 6 and floats is not Outcome.CYCLING)
    assert n == 6 or floats is Outcome.CREEPING  # and the certified one is not
    assert question.certified == ({amplitude: False} if n == 4 else {})
    assert list(question.sensitive) == ([amplitude] if n == 6 else [])


def test_creep_that_does_not_settle_has_an_interval_and_no_edge(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(search, "MOST_CYCLES", 1000)
    monkeypatch.setattr(amplitudes, "SHORT", 6)
    chain, step = captions(6), Fraction("0.00001")
    found = threshold(chain, low="0.00096", high="0.00104", points=8)
    assert found.evidence is Evidence.UNDECIDED
    assert "does not settle within 1000 cycles" in found.reason
    below, above = (round(Fraction(end or 0) / step) for end in (found.lower, found.upper))
    assert above - below == 1
    known = [fate(chain, k * step, cycles=1000, solver="exact") for k in range(96, above + 1)]
    settled = [one.outcome is not Outcome.LIMIT for one in known]
    assert settled == [True] * (len(known) - 1) + [False]
    assert known[-2].outcome is found.outcome_at_lower is Outcome.CYCLING
    assert (found.stable_digits, found.deciding_event) == (None, None)


# --- survival ---------------------------------------------------------------------------------


def test_half_of_the_starts_of_two_sliders_live_half_the_size_below_their_edge() -> None:
    """Of tensions uniform in (-size, size), 1 - (a - l0 A)/size creep; a is the limit's."""
    edge = (0.6 - 0.25) * 4 / math.sqrt(17) - 1e-3 / 2
    asked = {"starts": 60, "cycles": 20, "digits": 4}
    heard: list[float] = []
    found = half_life(captions(2), **asked, progress=lambda p: heard.append(p.done / p.total))
    low, high = ends(found)
    assert low < edge / 1000 < high < low + 6e-7
    assert (found.evidence, found.reason) == (Evidence.COMPUTED, "")
    assert heard == sorted(heard)
    assert 0 < heard[-1] <= 1
    given = half_life(captions(2), **asked, bracket=(low, high))
    assert given.amplitude == pytest.approx(found.amplitude, rel=3e-4)
    for amplitude in (low, high):
        lives = survival(captions(2), amplitude, starts=60, cycles=20)
        assert found.shares[amplitude] == lives.creeping


def test_chaos_without_an_advance_is_no_creep_that_lives() -> None:
    """Thirty sliders, 6 % below Eq. (seuil), neither lock nor advance."""
    lives = survival(captions(30), Fraction("0.00342"), starts=4, cycles=200, seed=2)
    assert lives.moving.starts == 4
    assert lives.creeping.starts < 4
    creeping = lives.fractions["creeping"].starts + lives.fractions["runaway"].starts
    assert lives.creeping.starts == creeping


# --- intercept --------------------------------------------------------------------------------


def test_the_error_of_an_intercept_is_its_scatter_over_measurements() -> None:
    random, x = np.random.default_rng(5), np.linspace(0.004, 0.007, 12)
    errors = random.uniform(0.05, 0.5, 12)
    fits = [
        _fitted(x, 15_000 * (x - 0.0036) + errors * random.standard_normal(12), errors.copy())
        for _ in range(300)
    ]
    off = np.array([(fit["intercept"] - 0.0036) / fit["error"] for fit in fits])
    steep = np.array([(fit["slope"] - 15_000) / fit["slope_error"] for fit in fits])
    assert abs(off.mean()) < 0.2
    assert 0.9 < min(off.std(), steep.std()) <= max(off.std(), steep.std()) < 1.1
    assert np.mean([fit["chi2"] for fit in fits]) == pytest.approx(10, abs=1)


def test_thirty_sliders_with_disorder_have_the_intercept_and_the_slope_of_the_laws() -> None:
    found = intercept(captions(30, "0.01"), cycles=100)
    off = abs(found.intercept - found.law_seuil)
    assert off < min(3 * math.hypot(found.error, found.systematic), 0.02 * found.law_seuil)
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
    assert "steps" in stairs.reason
    assert stairs.systematic == math.inf  # the upper half lies on one step
    assert stairs.summary()["systematic"] is None
    bent = intercept(captions(6, "0.01"), fit=("0.5", "3"), cycles=150)
    assert "chi2" in bent.reason
    assert bent.chi2_probability < 0.01
    assert {stairs.evidence, bent.evidence} == {Evidence.UNDECIDED}


# --- out of time, and what is shown and kept --------------------------------------------------


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
    for calls in range(0, 4 * len(whole.shares), 8):
        found = half(calls)
        if not found.reason:
            break
        assert (found.reason, found.evidence) == ("interrupted", Evidence.UNDECIDED)
        assert len(found.shares) <= calls + 1
        assert found.shares.items() <= whole.shares.items()
        for end, sure in ((found.low, lambda s: s.high < 0.5), (found.high, lambda s: s.low > 0.5)):
            if end is not None:
                assert sure(found.shares[end])
                known += 1
    assert known > 3


@pytest.mark.parametrize("calls", [2, 9])
def test_an_intercept_out_of_time_keeps_its_velocities_and_a_line_through_eight(
    monkeypatch: pytest.MonkeyPatch, calls: int
) -> None:
    whole = intercept(captions(6, "0.01"), cycles=100)
    found = told_until(monkeypatch, calls, intercept, captions(6, "0.01"), cycles=100)
    assert (found.reason, found.evidence) == ("interrupted", Evidence.UNDECIDED)
    few, all_ = ({*zip(one.amplitudes, one.velocities, strict=True)} for one in (found, whole))
    assert few < all_
    assert math.isnan(found.intercept) == (found.amplitudes.size < 8)


@pytest.mark.parametrize(
    ("words", "criterion"),
    [
        ("threshold --n 2 --cycles 20 --solver exact --digits 9", "horizon"),
        ("threshold --n 2 --solver exact --digits 9", "lasting"),
        ("half-life --n 2 --cycles 20 --starts 8", "survival"),
        ("intercept --n 6 --sigma-mu 0.01 --cycles 100 --fit 1.3 2", "intercept"),
    ],
)
def test_the_command_prints_draws_and_writes_what_the_function_returns(
    words: str, criterion: str, command: Command, drawn: list[Figure]
) -> None:
    told = command(*words.split(), "--json", "--plot", "a.png", "--out", "a.nc").json
    assert {"law_seuil", "law_corrected", "theorems", "compare"} <= set(told)
    assert (told["criterion"], len(drawn)) == (criterion, 1)
    assert told.get("sensitive") == ([] if criterion == "lasting" else None)
    with xr.open_dataset("a.nc") as kept:
        assert (kept.attrs["criterion"], kept.attrs["mu_s"]) == (criterion, "3/5")
        for name in told.keys() & {"lower", "low", "intercept"}:
            assert kept.attrs[name] == told[name]
    shown = command(*words.split()).out
    assert f"criterion {criterion}" in " ".join(shown.split())
    assert criterion != "horizon" or " creep at" not in shown
    assert "exists" in command(*words.split(), "--plot", "a.png").sentence
