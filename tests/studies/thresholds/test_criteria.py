"""Four meanings of a threshold: which argument each takes, what it finds, and what it refuses."""

import inspect
import json
import math
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from exactcreep import (
    Chain,
    Evidence,
    HalfLife,
    InputError,
    Intercept,
    Outcome,
    State,
    fate,
    survival,
    threshold,
)
from exactcreep.limits import Limits
from exactcreep.studies.thresholds import edges
from exactcreep.studies.thresholds.criteria import CRITERIA
from exactcreep.studies.thresholds.intercept import _fitted
from exactcreep.studies.thresholds.lasting import Lasting
from exactcreep.studies.thresholds.results import Threshold
from tests.conftest import Command
from tests.paper import captions

GIVEN = {
    "cycles": 20, "digits": 3, "low": "0.0001", "high": "0.01", "points": 9,
    "bracket": ("0.0001", "0.01"), "windows": True, "refine": 1, "start_tension": "0.01",
    "seeds": 1, "solver": "exact", "starts": 20, "size": "1e-3", "seed": 1, "fit": ("1.3", "2"),
    "workers": 1,
}  # fmt: skip
ACCEPTED = {"criterion", "progress", "max_seconds", "chain"}


# --- which criterion, and which arguments --------------------------------------------------------


@pytest.mark.parametrize(
    ("chain", "given", "criterion"),
    [
        (captions(2), {"cycles": 20}, "horizon"),
        (captions(6), {"cycles": 20}, "horizon"),
        (captions(2), {}, "lasting"),
        (captions(5), {}, "lasting"),
        (captions(6), {}, "survival"),
        (captions(9, mu_s="0.5"), {}, "lasting"),
        (captions(2, "0.01"), {}, "intercept"),
        (captions(6, "0.01"), {}, "intercept"),
    ],
)
def test_the_criterion_is_the_one_that_suits_the_chain(
    chain: Chain, given: dict[str, int], criterion: str
) -> None:
    found = threshold(chain, max_seconds=0, **given)
    assert found.criterion == criterion == found.summary()["criterion"]


def test_every_argument_is_used_by_a_criterion_and_tried_here() -> None:
    taken = set(inspect.signature(threshold).parameters) - ACCEPTED
    assert taken == set(GIVEN) == set().union(*CRITERIA.values())


@pytest.mark.parametrize("name", GIVEN)
@pytest.mark.parametrize("criterion", CRITERIA)
def test_an_argument_that_a_criterion_does_not_use_is_refused(criterion: str, name: str) -> None:
    if name in CRITERIA[criterion]:
        return
    chain = captions(3, "0.01" if criterion == "intercept" else "0")
    with pytest.raises(InputError, match=f"criterion {criterion}") as told:
        threshold(chain, criterion=criterion, **{name: GIVEN[name]})  # type: ignore[arg-type]
    assert told.value.field == {"low": "from", "high": "to"}.get(name, name)


@pytest.mark.parametrize("criterion", CRITERIA)
def test_the_help_names_the_criteria_that_use_an_argument(criterion: str, command: Command) -> None:
    text = " ".join(inspect.getdoc(threshold).split())  # type: ignore[union-attr]
    for name in CRITERIA[criterion]:
        line = text[text.index(f" {name} :") if f" {name} :" in text else text.index(f"{name}, ") :]
        said = line[: line.index(" : ", line.index(" : ") + 3)]
        both = "all but ``intercept``" in said and criterion != "intercept"
        assert f"``{criterion}``" in said or both, name


def test_cycles_given_with_what_horizon_does_not_use_say_why_it_is_horizon() -> None:
    with pytest.raises(InputError, match="name the criterion"):
        threshold(captions(6), cycles=500, starts=20)


def test_a_criterion_has_a_name_that_is_known() -> None:
    for name in ("forever", 3, []):
        with pytest.raises(InputError, match="horizon, lasting, survival, intercept"):
            threshold(captions(3), criterion=name)  # type: ignore[arg-type]


# --- bad input, by every criterion ---------------------------------------------------------------

ONE = {"lasting": {}, "horizon": {}, "survival": {"starts": 12, "cycles": 40},
       "intercept": {"cycles": 100, "points": 8}}  # fmt: skip


def of(criterion: str, chain: Chain, **given: object) -> Threshold | HalfLife | Intercept:
    about = {"solver": "exact", "digits": 6, "points": 60} if criterion in (
        "horizon", "lasting"
    ) else {}  # fmt: skip
    return threshold(chain, criterion=criterion, **about | ONE[criterion] | given)  # type: ignore


@pytest.mark.parametrize("criterion", CRITERIA)
def test_one_slider_rests_or_has_no_such_threshold(criterion: str) -> None:
    if criterion in ("horizon", "lasting"):
        found = of(criterion, captions(1))
        assert (found.lower, found.outcome_at_lower) == (None, Outcome.AT_REST)
        assert found.evidence is Evidence.PROVED
    else:
        with pytest.raises(InputError, match="one slider has no spring"):
            of(criterion, captions(1))


@pytest.mark.parametrize("criterion", CRITERIA)
def test_without_slips_the_law_is_exact_or_the_reason_is_said(criterion: str) -> None:
    chain = Chain(6, 1000, "0.5", "0.5", tan_alpha="5/12")
    if criterion in ("horizon", "lasting"):
        found = of(criterion, chain)
        assert float(found.lower) == pytest.approx(6 / 13 / 2000, rel=1e-6)
        assert "Eq. (seuil)" in found.compare
    else:
        with pytest.raises(InputError, match="sliding") as told:
            of(criterion, chain)
        assert told.value.field == "mu_s"


@pytest.mark.parametrize("criterion", CRITERIA)
@pytest.mark.parametrize("slope", ["0", "0.6", "0.9", "-0.6"])
def test_a_level_chain_and_one_that_slides_are_refused(criterion: str, slope: str) -> None:
    with pytest.raises(InputError) as told:
        of(criterion, captions(3, tan_alpha=slope))
    assert told.value.field == "tan_alpha"


@pytest.mark.parametrize("criterion", CRITERIA)
def test_beyond_mu_d_a_chain_runs_away_from_its_first_slip_on(criterion: str) -> None:
    chain = captions(2, tan_alpha="0.55")
    if criterion == "intercept":
        with pytest.raises(InputError, match="mu_d"):
            of(criterion, chain)
        return
    found = of(criterion, chain)
    first = (0.6 - 0.55) / math.hypot(1, 0.55) / 1000
    if criterion == "survival":
        size = 1e-3 / 1000  # of the tensions at the start
        assert first - 2 * size < found.low < found.amplitude < found.high < first + 2 * size
    else:
        assert float(found.lower) <= first <= float(found.upper)


@pytest.mark.parametrize("criterion", CRITERIA)
def test_the_mirror_image_has_the_same_threshold(criterion: str) -> None:
    one, other = (of(criterion, captions(3, tan_alpha=slope)) for slope in ("0.23", "-0.23"))
    if criterion == "survival":  # the starts are not mirrored
        assert one.low < other.high
        assert other.low < one.high
    elif criterion == "intercept":
        off = math.hypot(one.systematic, other.systematic) + one.intercept / 20
        assert one.intercept == pytest.approx(other.intercept, abs=off)
        assert one.slope == pytest.approx(other.slope, rel=0.1)
        assert other.velocities.min() > 0
    else:
        assert (one.lower, one.upper) == (other.lower, other.upper)


def test_a_start_that_is_not_at_rest_is_first_rearranged() -> None:
    for criterion in ("horizon", "lasting"):
        found = of(criterion, captions(2), start_tension="1.5")
        assert 0 < float(found.lower) < float(found.upper) < 0.35e-3
    found = of("survival", captions(2), size=2)
    assert found.low < found.amplitude < found.high


@pytest.mark.parametrize("criterion", ["horizon", "lasting", "survival"])
def test_amplitudes_from_nothing_to_beyond_one_are_scanned(criterion: str) -> None:
    """A very soft chain: springs of natural length 1/10 g tau_dyn**2 creep from A = 3.4 on."""
    chain = Chain(2, "0.1", "0.5", "0.6", tan_alpha="0.25")
    edge = 0.35 * 4 / math.sqrt(17) / 0.1
    found = of(criterion, chain, low=0, high=8)
    low, high = (found.low, found.high) if criterion == "survival" else (found.lower, found.upper)
    assert float(low) <= edge * 1.01
    assert float(high) >= edge * 0.99
    with pytest.raises(InputError, match="negative"):
        of(criterion, chain, low=-1)


# --- lasting -------------------------------------------------------------------------------------


def test_windows_of_lasting_creep_are_edges_of_the_fate() -> None:
    chain = captions(3)
    found = threshold(chain, criterion="lasting", low="0.00045", high="0.00049", points=20,
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
    monkeypatch.setattr(edges, "MOST_CYCLES", 1000)
    chain = captions(6)
    found = threshold(chain, criterion="lasting", low="0.00096", high="0.00104", points=8)
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
    found = threshold(captions(2), criterion="survival", starts=60, cycles=20, digits=4)
    assert isinstance(found, HalfLife)
    assert found.low < edge / 1000 < found.high
    assert found.low < found.amplitude < found.high
    assert found.high - found.low < 6e-7
    assert (found.evidence, found.reason) == (Evidence.COMPUTED, "")
    given = threshold(captions(2), criterion="survival", starts=60, cycles=20, digits=4,
                      bracket=(found.low, found.high))  # fmt: skip
    assert given.amplitude == pytest.approx(found.amplitude, rel=3e-4)
    for amplitude in (found.low, found.high):
        lives = survival(captions(2), amplitude, starts=60, cycles=20)
        assert found.shares[amplitude] == lives.creeping


def test_chaos_without_an_advance_is_no_creep_that_lives() -> None:
    """Thirty sliders, 6 % below Eq. (seuil), neither lock nor advance."""
    chain = captions(30)
    lives = survival(chain, Fraction("0.00342"), starts=4, cycles=200, seed=2)
    assert lives.alive.starts == 4
    assert lives.creeping.starts < 4
    creeping = lives.fractions["creeping"].starts + lives.fractions["runaway"].starts
    assert lives.creeping.starts == creeping


@pytest.mark.parametrize(
    ("given", "field"),
    [
        ({"bracket": ("0.0001", "0.0002")}, "bracket"),
        ({"low": "0.0004", "high": "0.0005"}, "from"),
        ({"low": "0.0001", "high": "0.0002"}, "to"),
        ({"digits": 0}, "digits"),
        ({"size": -1}, "size"),
        ({"starts": 0}, "starts"),
        ({"workers": 0}, "workers"),
    ],
)
def test_a_survival_that_cannot_be_half_is_refused(given: dict[str, object], field: str) -> None:
    with pytest.raises(InputError) as told:
        threshold(captions(2), **{"criterion": "survival", "starts": 12, "cycles": 5} | given)  # type: ignore
    assert told.value.field == field


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
    found = threshold(captions(30, "0.01"), criterion="intercept", cycles=100)
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
    stairs = threshold(captions(2), criterion="intercept", cycles=60)
    assert stairs.evidence is Evidence.UNDECIDED
    assert "steps" in stairs.reason
    assert stairs.systematic == math.inf  # the upper half lies on one step
    assert stairs.summary()["systematic"] is None
    bent = threshold(captions(6, "0.01"), criterion="intercept", fit=("0.5", "3"), cycles=150)
    assert bent.evidence is Evidence.UNDECIDED
    assert "chi2" in bent.reason
    assert bent.chi2_probability < 0.01


@pytest.mark.parametrize(
    ("given", "field"),
    [
        ({"fit": ("2", "1.2")}, "fit"),
        ({"fit": "1.2"}, "fit"),
        ({"points": 7}, "points"),
        ({"cycles": 3}, "cycles"),
        ({"size": -1}, "size"),
        ({"seed": 2**32}, "seed"),
    ],
)
def test_a_line_that_cannot_be_drawn_is_refused(given: dict[str, object], field: str) -> None:
    with pytest.raises(InputError) as told:
        threshold(captions(6, "0.01"), **{"criterion": "intercept"} | given)  # type: ignore
    assert told.value.field == field


# --- out of time, and what is shown and kept -----------------------------------------------------


@pytest.mark.parametrize("criterion", CRITERIA)
def test_no_time_gives_nothing_but_says_so(criterion: str) -> None:
    found = of(criterion, captions(6), max_seconds=0)
    assert found.reason == "max_seconds = 0 was reached"
    assert found.evidence is Evidence.UNDECIDED
    assert json.loads(json.dumps(found.summary()))["reason"] == found.reason


def told_until(
    monkeypatch: pytest.MonkeyPatch, calls: int, chain: Chain, **given: object
) -> Threshold | HalfLife | Intercept:
    """Return what a threshold knows that is interrupted after so many reports of progress."""
    told: list[object] = []
    limits = Limits(interrupted=lambda: len(told) > calls)
    with monkeypatch.context() as patch:
        patch.setattr(Limits, "of", lambda *_, **__: limits)
        return threshold(chain, progress=told.append, **given)  # type: ignore[arg-type]


def test_a_half_life_out_of_time_keeps_the_sides_that_are_known(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def half(calls: int) -> HalfLife:
        return told_until(monkeypatch, calls, captions(2), criterion="survival", starts=12,
                          cycles=10, digits=3)  # type: ignore[return-value]  # fmt: skip

    whole = half(10**9)
    assert whole.reason == ""
    known = 0
    for calls in range(0, len(whole.shares), 2):
        found = half(calls)
        assert found.reason == "interrupted"
        assert found.evidence is Evidence.UNDECIDED
        assert len(found.shares) == calls + 1
        assert found.shares.items() <= whole.shares.items()
        for end, sure in ((found.low, lambda s: s.high < 0.5), (found.high, lambda s: s.low > 0.5)):
            if end is not None:
                assert sure(found.shares[end])
                known += 1
    assert known > 3


def test_an_intercept_out_of_time_keeps_its_velocities_and_a_line_through_eight(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    given = {"criterion": "intercept", "cycles": 100}
    whole = threshold(captions(6, "0.01"), **given)  # type: ignore[arg-type]
    for calls in (2, 9):
        found = told_until(monkeypatch, calls, captions(6, "0.01"), **given)
        assert isinstance(found, Intercept)
        assert (found.reason, found.evidence) == ("interrupted", Evidence.UNDECIDED)
        assert set(zip(found.amplitudes, found.velocities, strict=True)) < set(
            zip(whole.amplitudes, whole.velocities, strict=True)
        )
        assert math.isnan(found.intercept) == (found.amplitudes.size < 8)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("--n 2 --cycles 20 --solver exact --digits 9", "criterion horizon"),
        ("--n 2 --solver exact --digits 9", "criterion lasting"),
        ("--n 2 --criterion survival --cycles 20 --starts 12", "criterion survival"),
        ("--n 6 --sigma-mu 0.01 --cycles 100 --fit 1.3 2", "criterion intercept"),
    ],
)
def test_the_command_prints_draws_and_writes_what_the_function_returns(
    words: str, says: str, command: Command
) -> None:
    told = command("threshold", *words.split(), "--json", "--plot", "a.png", "--out", "a.nc")
    assert told.code == 0, told
    assert {"criterion", "law_seuil", "law_corrected", "theorems", "compare"} <= set(told.json)
    assert Path("a.png").stat().st_size > 10_000
    with xr.open_dataset("a.nc") as kept:
        assert kept.attrs["criterion"] == told.json["criterion"]
        assert kept.attrs["mu_s"] == "3/5"
        for name in ("lower", "low", "intercept"):
            if name in told.json:
                assert kept.attrs[name] == told.json[name]
    shown = command("threshold", *words.split()).out
    assert says in " ".join(shown.split())
    if "--cycles 20 --solver" in words:
        assert " creep at" not in shown
    refused = command("threshold", *words.split(), "--plot", "a.png").sentence
    assert "exists" in refused
