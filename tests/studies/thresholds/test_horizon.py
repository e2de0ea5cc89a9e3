"""The dynamical threshold: the laws it is told apart from, its edges, and how it is refused."""

from __future__ import annotations

import json
import math
import time
from fractions import Fraction

import pytest

from exactcreep import cli
from exactcreep.limits import Limits
from exactcreep.model.chain import Chain
from exactcreep.model.numbers import InputError
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.studies.thresholds import answer
from exactcreep.studies.thresholds.horizon import transient
from exactcreep.studies.thresholds.search import Edge
from exactcreep.studies.thresholds.threshold import Threshold, threshold
from tests.paper import captions

FLOAT = {"solver": "exact", "digits": 9, "after": 20}


def pythagorean() -> Chain:
    return Chain(2, 1000, "0.5", "0.6", tan_alpha="5/12")  # cos = 12/13, sin = 5/13


def encloses(found: Threshold | Edge, value: Fraction) -> bool:
    assert found.lower is not None
    assert found.upper is not None
    return Fraction(found.lower) <= value <= Fraction(found.upper)


class TestTwoSliders:
    def test_the_relaxed_chain_creeps_above_its_first_slip(self) -> None:
        found = threshold(pythagorean(), **FLOAT)
        assert encloses(found, Fraction(11, 65) / 1000)  # mu_s c - s = 36/65 - 25/65
        assert f"lower='{found.lower}'" in repr(found)
        assert found.outcome_at_lower is Outcome.AT_REST

    @pytest.mark.parametrize("r0", ["0.01", "-0.03", "0.09", "-0.09"])
    def test_a_start_tension_lowers_the_threshold_by_its_size(self, r0: str) -> None:
        found = threshold(pythagorean(), start_tension=r0, low="1e-6", high="1e-3", **FLOAT)
        assert encloses(found, (Fraction(11, 65) - abs(Fraction(r0))) / 1000)

    def test_the_default_scan_finds_the_threshold_from_any_start_tension(self) -> None:
        for r0 in ("0.05", "0.16"):
            chain = Chain(2, 1000, "0.3", "0.6", tan_alpha="5/12")
            found = threshold(chain, start_tension=r0, **FLOAT)
            assert encloses(found, (Fraction(11, 65) - Fraction(r0)) / 1000)

    def test_a_seeded_start_that_creeps_already_below_the_scan_has_no_edge_in_it(self) -> None:
        edge = Fraction(11, 65) / 1000
        near = {"low": edge - Fraction(1, 10**12), "high": 2 * edge}
        found = threshold(pythagorean(), seeds=2, **FLOAT | near)
        assert encloses(found, edge)
        assert found.preparations == {1: None, 2: None}

    def test_a_start_tension_counts_modulo_two_slips(self) -> None:
        # 0.1 exceeds D = 6/65, and stands for 0.1 - 2 D
        found = threshold(pythagorean(), start_tension="0.1", low="1e-6", high="1e-3", **FLOAT)
        reduced = Fraction(12, 65) - Fraction(1, 10)
        assert encloses(found, (Fraction(11, 65) - reduced) / 1000)

    def test_the_search_does_not_use_the_laws(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(answer, "laws_beside", None)
        found = threshold(pythagorean(), **FLOAT)
        assert encloses(found, Fraction(11, 65) / 1000)

    def test_the_laws_are_told_apart(self) -> None:
        found = threshold(captions(2), **FLOAT)
        cosine = 4 / math.sqrt(17)
        assert found.law_seuil is not None
        assert found.law_corrected is not None
        assert found.law_two_sliders is not None
        assert float(found.law_seuil) == pytest.approx(0.25 * cosine / 1000, rel=1e-8, abs=0)
        assert float(found.law_corrected) == pytest.approx(0.3 * cosine / 1000, rel=1e-8, abs=0)
        assert float(found.law_two_sliders) == pytest.approx(0.35 * cosine / 1000, rel=1e-8, abs=0)


class TestMoreSliders:
    def test_three_sliders_have_a_window_of_creep_below_the_lasting_one(self) -> None:
        found = threshold(captions(3), windows=True, **FLOAT)
        assert found.windows is not None
        assert [edge.begins for edge in found.windows] == [True, False, True]
        seuil = Fraction(str(found.law_seuil))
        measured = [round(float(edge.middle / seuil), 4) for edge in found.windows]
        # read off a scan in steps of 1e-4 of Eq. (seuil)
        assert measured == [1.2586, 1.2825, 1.3115]

    def test_the_first_refined_window_is_the_threshold(self) -> None:
        found = threshold(captions(3), windows=True, refine=2, **FLOAT)
        assert found.windows is not None
        assert (found.windows[0].lower, found.windows[0].upper) == (found.lower, found.upper)

    def test_below_the_threshold_of_four_sliders_the_ends_slip_for_ever(self) -> None:
        assert threshold(captions(4), **FLOAT).outcome_at_lower is Outcome.CYCLING

    def test_a_transient_that_dies_later_is_followed_to_its_end(self) -> None:
        """Eleven cycles do not return this chain; they come closer by a fifth each time."""
        chain = Chain(4, "1/7", "0.9", "1.05", tan_alpha="0.045")
        found = threshold(chain, points=200, **FLOAT | {"after": 11})
        assert found.outcome_at_lower is Outcome.CYCLING
        assert found.outcome_evidence is Evidence.COMPUTED

    def test_a_bracket_skips_the_scan_and_finds_the_same_edge(self) -> None:
        scanned = threshold(captions(3), **FLOAT)
        bracketed = threshold(captions(3), bracket=("0.0004570", "0.0004584"), **FLOAT)
        assert (bracketed.lower, bracketed.upper) == (scanned.lower, scanned.upper)

    def test_the_mirror_image_has_the_same_threshold(self) -> None:
        mirror = Chain(3, 1000, "0.5", "0.6", tan_alpha="-0.25")
        found, image = threshold(captions(3), **FLOAT), threshold(mirror, **FLOAT)
        assert (found.lower, found.upper) == (image.lower, image.upper)
        assert found.deciding_event is not None
        assert image.deciding_event is not None
        event, mirrored = found.deciding_event.at_upper, image.deciding_event.at_upper
        assert event is not None
        assert mirrored is not None
        assert [4 - n for n in event.event.sliders] == list(mirrored.event.sliders)

    def test_the_deciding_event_is_a_start_that_happens_on_one_side_only(self) -> None:
        found = threshold(captions(3), **FLOAT)
        sides = found.deciding_event
        assert sides is not None
        assert sides.at_upper is not None
        assert sides.at_lower is not None
        assert sides.at_upper.half_cycle < sides.at_lower.half_cycle

    def test_digits_that_a_longer_drive_would_change_are_not_called_stable(self) -> None:
        # from 20 to 40 cycles the creep of five sliders dies at the first edge
        assert threshold(captions(5), **FLOAT).stable_digits == 2
        assert threshold(captions(4), **FLOAT).stable_digits == 9

    def test_the_root_of_the_condition_that_decides_lies_where_float64_has_put_the_edge(
        self,
    ) -> None:
        root = threshold(captions(4), digits=60, solver="mpmath", after=20)
        assert root.report["deciding_runs"] <= 4  # it is a root, and not bisected for
        assert encloses(threshold(captions(4), **FLOAT), Fraction(root.lower or 0))


class TestWithoutSearch:
    def test_one_slider_rests_at_any_amplitude(self) -> None:
        found = threshold(captions(1), **FLOAT)
        assert (found.lower, found.upper) == (None, None)
        assert found.outcome_at_lower is Outcome.AT_REST
        assert found.evidence is Evidence.PROVED

    @pytest.mark.parametrize("n", [2, 3, 8])
    def test_without_static_excess_the_paper_s_law_is_exact(self, n: int) -> None:
        chain = Chain(n, 1000, "0.5", "0.5", tan_alpha="5/12")
        found = threshold(chain, solver="exact", digits=12)
        assert found.lower is not None
        assert found.upper is not None
        exact = n * Fraction(1, 13) / 2000  # m = 6/13 - 5/13
        assert Fraction(found.lower) <= exact < Fraction(found.upper)
        assert Fraction(found.upper) - Fraction(found.lower) < exact / 10**13

    def test_a_decimal_threshold_is_its_own_lower_bound(self) -> None:
        chain = Chain(2, 1000, "0.8", "0.8", tan_alpha="3/4")  # m = 0.64 - 0.6
        assert Fraction(str(threshold(chain, **FLOAT).lower)) == Fraction("0.00004")


class TestRefusals:

    def test_what_is_no_chain_has_no_threshold(self) -> None:
        with pytest.raises(InputError, match="chain = 3: must be a Chain"):
            threshold(3)  # type: ignore[arg-type]


def test_the_command_prints_one_object_with_every_key(
    capsys: pytest.CaptureFixture[str],
) -> None:
    words = "threshold --n 2 --cycles 20 --solver exact --digits 9 --json --seeds 1"
    assert cli.status(words.split()) == 0
    found = json.loads(capsys.readouterr().out)
    assert {
        "law_seuil", "law_corrected", "law_two_sliders", "lower", "upper", "outcome_at_lower",
        "evidence", "cycles", "stable_digits", "deciding_event",
    } <= set(found)  # fmt: skip
    assert isinstance(found["lower"], str)
    assert isinstance(found["upper"], str)
    assert found["cycles"] == 20
    (start,) = found["preparations"]
    assert start["seed"] == 1
    assert Fraction(start["upper"]) < Fraction(found["upper"])


# A search that is not completed says so, and shows what it has


def test_edges_that_float64_does_not_tell_apart_are_told_apart_by_their_conditions() -> None:
    # the third edge: two itineraries change within 5e-12 of each other, creep at the second
    found = threshold(captions(3), windows=True, refine=3, points=100, digits=40, after=20)
    assert found.windows is not None
    third = found.windows[2]
    assert third.evidence is Evidence.PROVED
    assert Fraction(third.upper) - Fraction(third.lower) < Fraction(third.upper) / 10**40
    assert found.report["deciding_runs"] < 20


class Hurry:
    """Passes after so many questions: the same moment on any machine."""

    def __init__(self, asked: int) -> None:
        self.left = asked

    def __call__(self) -> bool:
        self.left -= 1
        return self.left < 0


def interrupted(monkeypatch: pytest.MonkeyPatch, asked: int) -> Threshold:
    limits = Limits(interrupted=Hurry(asked))
    monkeypatch.setattr(Limits, "of", lambda max_seconds: limits)
    return threshold(captions(3), digits=20, points=100, after=20, max_seconds=1)


def test_a_search_out_of_time_keeps_the_bracket_it_has(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = threshold(captions(3), digits=20, points=100, after=20)
    assert whole.reason == ""
    widths: list[Fraction] = []
    complete = False
    for asked in (0, *range(20, 80, 6), 400, 12800):
        found = interrupted(monkeypatch, asked)
        if not found.reason:
            complete = True
            assert found.lower == whole.lower
            continue
        assert not complete
        assert found.reason == "interrupted"
        assert found.summary()["reason"] == "interrupted"
        assert found.stable_digits is None
        if found.lower is None:
            assert found.upper is None
            assert not widths
            continue
        lower, upper = Fraction(found.lower), Fraction(found.upper or 0)
        assert lower <= Fraction(whole.lower or 0) < Fraction(whole.upper or 0) <= upper
        widths.append(upper - lower)
    assert complete
    assert len(set(widths)) > 2
    assert widths == sorted(widths, reverse=True)


def test_a_search_of_many_cycles_comes_back_in_time() -> None:
    begin = time.process_time()
    found = threshold(captions(8), max_seconds=1, **FLOAT | {"after": 2000})
    assert found.reason == "max_seconds = 1 was reached"
    assert time.process_time() - begin < 5


def test_the_command_shows_what_a_search_out_of_time_has(
    capsys: pytest.CaptureFixture[str],
) -> None:
    words = "threshold --n 8 --cycles 2000 --solver exact --digits 9 --max-seconds 0"
    assert cli.status([*words.split(), "--json"]) == 3
    assert json.loads(capsys.readouterr().out)["reason"] == "max_seconds = 0 was reached"
    assert cli.status(words.split()) == 3
    shown = capsys.readouterr().out
    assert "max_seconds = 0 was reached" in shown
    assert "the edge" not in shown


def test_a_transient_without_end_is_told_by_how_its_changes_fall() -> None:
    found = threshold(captions(8), low="1.0751e-3", high="1.0753e-3", points=2, **FLOAT)
    assert found.outcome_at_lower is None
    known = found.report["transient"]
    assert known["cycles"] == 64 * found.cycles
    assert 0 < known["change"] < 1e-6
    assert -2.2 < known["power"] < -1.9


def test_changes_that_follow_no_power_are_not_said_to() -> None:
    # asked in private: a search whose changes follow no power for long takes hours
    falling = [(k, 3.0 / k**2) for k in (80, 320, 1280)]
    assert transient(falling) == {
        "cycles": 1280,
        "change": falling[-1][1],
        "power": -2.0,
    }
    for changes in (falling[1:], [(80, 1e-3), (320, 1e-4), (1280, 1e-7)], [(80, 1e-3)] * 3):
        assert "power" not in transient(
            [(80 * 4**j, change) for j, (_, change) in enumerate(changes)]
        )
