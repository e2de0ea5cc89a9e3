"""The dynamical threshold after so many cycles: its edges, the laws beside it, and its end."""

from __future__ import annotations

import json
import math
import operator
import time
from fractions import Fraction
from typing import Any

import pytest

from exactcreep.limits import Limits
from exactcreep.model.chain import Chain
from exactcreep.model.numbers import InputError
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.model.state import State
from exactcreep.studies.thresholds import answer
from exactcreep.studies.thresholds.amplitudes import Span
from exactcreep.studies.thresholds.horizon import Observation, Question, transient
from exactcreep.studies.thresholds.search import Edge, EdgeSearch
from exactcreep.studies.thresholds.threshold import Threshold, threshold
from tests.conftest import Command
from tests.paper import captions

PAIR = captions(2, tan_alpha="5/12")  # cos = 12/13, sin = 5/13
ONSET = Fraction(11, 65) / 1000  # (mu_s c - s)/l0 = (36/65 - 25/65)/l0
WIDE = {"low": "1e-6", "high": "1e-3"}


def after(chain: Chain, cycles: int = 20, **given: Any) -> Threshold:
    return threshold(chain, **{"solver": "exact", "digits": 9, "after": cycles} | given)


def bounds(found: Threshold | Edge) -> tuple[Fraction, Fraction]:
    return Fraction(found.lower or "nan"), Fraction(found.upper or "nan")


@pytest.fixture(scope="module")
def three() -> Threshold:
    return after(captions(3), windows=True, refine=2)


# --- two sliders, whose threshold is known ----------------------------------------------------


@pytest.mark.parametrize(
    ("chain", "given", "edge"),
    [
        (PAIR, {}, ONSET),
        # a tension r0 lowers it by |r0|, counted modulo 2 D = 12/65
        (PAIR, {"start_tension": "0.01"} | WIDE, ONSET - Fraction(1, 10**5)),
        (PAIR, {"start_tension": "-0.09"} | WIDE, ONSET - Fraction(9, 10**5)),
        (PAIR, {"start_tension": "0.1"} | WIDE, Fraction(11 - 12, 65 * 1000) + Fraction(1, 10**4)),
        (captions(2, mu_d="0.3", tan_alpha="5/12"), {"start_tension": "0.05"},
         ONSET - Fraction(5, 10**5)),
        (captions(2, mu_d="0.3", tan_alpha="5/12"), {"start_tension": "0.16"},
         ONSET - Fraction(16, 10**5)),
    ],
)  # fmt: skip
def test_two_sliders_creep_above_their_first_slip(
    chain: Chain, given: dict[str, Any], edge: Fraction, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(answer, "laws_beside", None)  # the search does not use the laws
    found = after(chain, **given)
    assert bounds(found)[0] <= edge <= bounds(found)[1]
    assert f"lower='{found.lower}'" in repr(found)
    assert given or found.outcome_at_lower is Outcome.AT_REST


def test_a_seeded_start_that_creeps_already_below_the_scan_has_no_edge_in_it() -> None:
    found = after(PAIR, seeds=2, low=ONSET - Fraction(1, 10**12), high=2 * ONSET)
    assert bounds(found)[0] <= ONSET <= bounds(found)[1]
    assert found.preparations == {1: None, 2: None}


def test_the_laws_are_told_apart() -> None:
    found = after(captions(2))
    laws = found.law_seuil, found.law_corrected, found.law_two_sliders
    forces = [float(law or 0) * 1000 * math.sqrt(17) / 4 for law in laws]
    assert forces == pytest.approx([0.25, 0.3, 0.35], rel=1e-8, abs=0)


# --- more sliders -----------------------------------------------------------------------------


def test_three_sliders_have_a_window_of_creep_below_the_lasting_one(three: Threshold) -> None:
    windows, seuil = three.windows or (), Fraction(str(three.law_seuil))
    assert [edge.begins for edge in windows] == [True, False, True]
    # read off a scan in steps of 1e-4 of Eq. (seuil)
    assert [round(float(edge.middle / seuil), 4) for edge in windows] == [1.2586, 1.2825, 1.3115]
    assert (windows[0].lower, windows[0].upper) == (three.lower, three.upper)


def test_a_bracket_skips_the_scan_and_finds_the_same_edge(three: Threshold) -> None:
    assert bounds(after(captions(3), bracket=("0.0004570", "0.0004584"))) == bounds(three)


def test_the_deciding_event_is_a_start_on_one_side_only_and_that_of_the_mirror_image(
    three: Threshold,
) -> None:
    image = after(captions(3, tan_alpha="-0.25"))
    assert bounds(image) == bounds(three)
    sides, other = three.deciding_event, image.deciding_event
    assert sides is not None
    assert sides.at_upper.half_cycle < sides.at_lower.half_cycle
    assert [4 - n for n in sides.at_upper.event.sliders] == list(other.at_upper.event.sliders)


@pytest.mark.parametrize(("n", "digits"), [(4, 9), (5, 2)])
def test_digits_that_a_longer_drive_would_change_are_not_called_stable(n: int, digits: int) -> None:
    """From 20 to 40 cycles the creep of five sliders dies at the first edge."""
    found = after(captions(n))
    assert found.stable_digits == digits
    if n == 4:  # below it the ends slip for ever
        assert found.outcome_at_lower is Outcome.CYCLING
        root = after(captions(4), digits=60, solver="mpmath")
        assert root.report["deciding_runs"] <= 4  # it is a root, and not bisected for
        assert bounds(found)[0] <= Fraction(root.lower or 0) <= bounds(found)[1]


def test_a_transient_that_dies_later_is_followed_to_its_end() -> None:
    """Eleven cycles do not return this chain; they come closer by a fifth each time."""
    found = after(Chain(4, "1/7", "0.9", "1.05", tan_alpha="0.045"), 11, points=200)
    assert found.outcome_at_lower is Outcome.CYCLING
    assert found.outcome_evidence is Evidence.COMPUTED


def test_a_transient_without_end_is_told_by_how_its_changes_fall() -> None:
    found = after(captions(8), low="1.0751e-3", high="1.0753e-3", points=2)
    assert found.outcome_at_lower is None
    known = found.report["transient"]
    assert known["cycles"] == 64 * found.cycles
    assert 0 < known["change"] < 1e-6
    assert -2.2 < known["power"] < -1.9


def test_changes_that_follow_no_power_are_not_said_to() -> None:
    # asked in private: a search whose changes follow no power for long takes hours
    falling = [(k, 3.0 / k**2) for k in (80, 320, 1280)]
    assert transient(falling) == {"cycles": 1280, "change": falling[-1][1], "power": -2.0}
    for changes in (falling[1:], [(80, 1e-3), (320, 1e-4), (1280, 1e-7)], [(80, 1e-3)] * 3):
        numbered = [(80 * 4**j, change) for j, (_, change) in enumerate(changes)]
        assert "power" not in transient(numbered)


def test_edges_that_float64_does_not_tell_apart_are_told_apart_by_their_conditions() -> None:
    # the third edge: two itineraries change within 5e-12 of each other, creep at the second
    found = threshold(captions(3), windows=True, refine=3, points=100, digits=40, after=20)
    third = (found.windows or ())[2]
    low, high = bounds(third)
    assert third.evidence is Evidence.PROVED
    assert high - low < high / 10**40
    assert found.report["deciding_runs"] < 20


@pytest.mark.parametrize("creeps", [operator.gt, operator.ge])
def test_an_end_on_the_edge_that_is_undecided_lies_one_unit_further_out(creeps: Any) -> None:
    edge = Fraction("0.001")

    class Tie(Question):
        def float_fails(self, low: Fraction, high: Fraction) -> bool:
            return True

        def tried(self, amplitude: Fraction, solver: str, options: Any) -> Observation:
            known = Evidence.UNDECIDED if amplitude == edge else Evidence.PROVED
            return Observation(creeps(amplitude, edge), known, [], None, known)

    question = Tie(PAIR, 1, State.relaxed(PAIR))
    search = EdgeSearch(question, Span.of(PAIR, 0, 1, None), 1, "certified", 3, lambda *_: None)
    found = search.refined(edge * 9 / 10, edge * 11 / 10).edge
    assert bounds(found) == (Fraction("0.0009999"), Fraction("0.0010001"))
    assert found.evidence is Evidence.PROVED


# --- without a search -------------------------------------------------------------------------


@pytest.mark.parametrize("n", [2, 3, 8])
def test_without_static_excess_the_paper_s_law_is_exact(n: int) -> None:
    found = threshold(captions(n, mu_s="0.5", tan_alpha="5/12"), solver="exact", digits=12)
    exact = n * Fraction(1, 13) / 2000  # m = 6/13 - 5/13
    low, high = bounds(found)
    assert low <= exact < high
    assert high - low < exact / 10**13


def test_a_decimal_threshold_is_its_own_lower_bound() -> None:
    chain = Chain(2, 1000, "0.8", "0.8", tan_alpha="3/4")  # m = 0.64 - 0.6
    assert bounds(after(chain))[0] == Fraction("0.00004")


def test_what_is_no_chain_has_no_threshold() -> None:
    with pytest.raises(InputError, match="chain = 3: must be a Chain"):
        threshold(3)  # type: ignore[arg-type]


# --- the command, and searches that are not completed -----------------------------------------


def test_the_command_prints_one_object_with_every_key(command: Command) -> None:
    words = "threshold --n 2 --cycles 20 --solver exact --digits 9 --json --seeds 1"
    found = command(*words.split()).json
    assert {
        "law_seuil", "law_corrected", "law_two_sliders", "lower", "upper", "outcome_at_lower",
        "evidence", "cycles", "stable_digits", "deciding_event",
    } <= set(found)  # fmt: skip
    assert found["cycles"] == 20
    (start,) = found["preparations"]
    assert start["seed"] == 1
    assert Fraction(start["upper"]) < Fraction(found["upper"])


def test_the_command_shows_what_a_search_out_of_time_has(command: Command) -> None:
    words = ("threshold", "--n", "8", "--cycles", "2000", "--solver", "exact", "--digits", "9")
    late = *words, "--max-seconds", "0"
    told, shown = command(*late, "--json"), command(*late)
    assert (told.code, shown.code) == (3, 3)
    assert told.json["reason"] == "max_seconds = 0 was reached"
    assert "max_seconds = 0 was reached" in shown.out
    assert "the edge" not in shown.out


def test_a_search_out_of_time_keeps_the_bracket_it_has(monkeypatch: pytest.MonkeyPatch) -> None:
    def search(limits: Limits) -> Threshold:
        with monkeypatch.context() as patch:
            patch.setattr(Limits, "of", lambda max_seconds: limits)
            return threshold(captions(3), digits=20, points=100, after=20, max_seconds=1)

    def interrupted(asked: int) -> Threshold:
        """Return what is known after so many questions, the same moment on any machine."""
        left = iter(range(asked))
        return search(Limits(interrupted=lambda: next(left, None) is None))

    whole = search(Limits())
    widths: list[Fraction] = []
    known = [interrupted(asked) for asked in (0, *range(20, 80, 12), 400, 12800)]
    assert known[0].lower is None
    assert known[-1].lower == whole.lower
    assert known[-1].reason == whole.reason == ""
    for found in known:
        if not found.reason:
            continue
        assert found.reason == found.summary()["reason"] == "interrupted"
        assert found.stable_digits is None
        if found.lower is None:
            assert found.upper is None
            assert not widths
            continue
        (low, high), (lower, upper) = bounds(found), bounds(whole)
        assert low <= lower < upper <= high
        widths.append(high - low)
    assert len(set(widths)) > 2
    assert widths == sorted(widths, reverse=True)


def test_a_search_of_many_cycles_comes_back_in_time() -> None:
    begin = time.process_time()
    found = after(captions(8), 2000, max_seconds=1)
    assert found.reason == "max_seconds = 1 was reached"
    assert time.process_time() - begin < 5
    json.dumps(found.summary(), allow_nan=False)
