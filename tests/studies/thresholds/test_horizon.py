"""The dynamical threshold after so many cycles: its edges, the laws beside it, and its end."""

from __future__ import annotations

import itertools
import math
from fractions import Fraction
from typing import Any

import pytest

from exactcreep.figures.threshold import draw_threshold
from exactcreep.model.chain import Chain
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.studies.thresholds import beside_laws
from exactcreep.studies.thresholds.search import Edge
from exactcreep.studies.thresholds.threshold import Threshold, threshold
from exactcreep.watch.limits import Limits
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
    return after(captions(3), windows=True)


# --- two sliders, whose threshold is known ----------------------------------------------------


def test_two_sliders_creep_above_their_first_slip(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(beside_laws, "laws_beside", None)  # the search does not use the laws
    for drawn in ({}, WIDE):
        found = after(PAIR, **drawn)
        assert bounds(found)[0] <= ONSET <= bounds(found)[1]
        assert f"lower='{found.lower}'" in repr(found)
        assert found.outcome_at_lower is Outcome.AT_REST


# --- more sliders -----------------------------------------------------------------------------


def test_three_sliders_have_a_window_of_creep_below_the_lasting_one(three: Threshold) -> None:
    windows, seuil = three.windows, Fraction(str(three.law_seuil))
    assert [edge.begins for edge in windows] == [True, False, True]
    # read off a scan in steps of 1e-4 of Eq. 22
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
    assert sides.at_upper.half_cycle < sides.at_lower.half_cycle
    assert [4 - n for n in sides.at_upper.event.sliders] == list(other.at_upper.event.sliders)


def test_below_the_edge_of_four_sliders_the_ends_slip_for_ever() -> None:
    found = after(captions(4))
    assert found.outcome_at_lower is Outcome.CYCLING
    root = after(captions(4), digits=60, solver="certified")
    assert root.report["deciding_runs"] <= 4  # it is a root, and not bisected for
    assert bounds(found)[0] <= Fraction(root.lower or 0) <= bounds(found)[1]


def test_edges_that_float64_does_not_tell_apart_are_told_apart_by_their_conditions(
    three: Threshold,
) -> None:
    # between the second edge and the third two itineraries change within 5e-12 of each other
    _, _, third = three.windows
    around = ("0.0004771", "0.0004772")
    found = threshold(captions(3), bracket=around, digits=40, after=20)
    low, high = bounds(found)
    assert found.evidence is Evidence.PROVED
    assert high - low < high / 10**40
    assert abs(float(low) - float(third.middle)) < 1e-12
    assert found.report["deciding_runs"] < 20


# --- searches that are not completed ----------------------------------------------------------


def test_a_search_out_of_time_keeps_the_bracket_it_has(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(most: float) -> Threshold:
        """Return what is known after so many questions, the same moment on any machine."""
        asked = itertools.count()
        limits = Limits(interrupted=lambda: next(asked) >= most)
        monkeypatch.setattr(Limits, "of", lambda max_seconds: limits)
        return threshold(captions(3), digits=20, points=100, after=20, max_seconds=1)

    whole = interrupted(math.inf)
    assert whole.reason == ""
    lower, upper = bounds(whole)
    known = [interrupted(most) for most in (0, *range(40, 180, 20), 400)]
    known = [found for found in known if found.reason]
    assert {found.reason for found in known} == {"interrupted"}
    bare = [found for found in known if found.lower is None]
    assert bare == known[: len(bare)] != []
    brackets = [bounds(found) for found in known[len(bare) :]]
    assert all(low <= lower < upper <= high for low, high in brackets)
    widths = [high - low for low, high in brackets]
    assert len(set(widths)) > 2
    assert widths == sorted(widths, reverse=True)


@pytest.mark.parametrize("horizon", [{}, {"after": 4}])
def test_a_search_asks_before_each_run_for_the_time(horizon: dict[str, int]) -> None:
    found = threshold(captions(2), max_seconds=0, **horizon)
    assert (found.lower, found.reason) == (None, "max_seconds = 0 was reached")
    (axes,) = draw_threshold(found).axes  # its laws
    assert axes.get_xlim()[1] < 0.001
