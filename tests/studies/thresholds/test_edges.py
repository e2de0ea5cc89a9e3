"""Thresholds after so many cycles: their edges, held against laws, each other and mirror images."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import pytest

from exactcreep import Chain, Evidence, InputError, threshold
from exactcreep.results import Threshold
from exactcreep.studies.thresholds.questions import Answer, Question
from exactcreep.studies.thresholds.search import Edge, Search, Span
from tests.conftest import OutOfTime
from tests.oracle import rearrangement as oracle
from tests.paper import captions

PAIR = captions(2, tan_alpha="5/12")  # cos = 12/13, sin = 5/13
ONSET = Fraction(11, 65) / 1000  # (mu_s c - s)/l0 = (36/65 - 25/65)/l0


def after(chain: Chain, cycles: int = 20, **given: Any) -> Threshold:
    return threshold(chain, **{"digits": 9, "after": cycles} | given)


def bounds(found: Threshold | Edge) -> tuple[Fraction, Fraction]:
    return Fraction(found.lower or "nan"), Fraction(found.upper or "nan")


# --- edges that are known beforehand ----------------------------------------------------------


@pytest.mark.parametrize(
    ("chain", "square", "digits", "given"),
    [
        (PAIR, ONSET**2, 9, {"low": "1e-6", "high": "1e-3"}),
        # (mu_s - tan) cos / l0 = 0.35 * 4 / sqrt(17) / 1000
        (captions(2), Fraction(35 * 4, 100 * 1000) ** 2 / 17, 1000, {}),
        # without slips, for ever: (mu_d - tan) cos / l0
        (captions(2, mu_s="0.5"), Fraction(25 * 4, 100 * 1000) ** 2 / 17, 9, {"after": None}),
        # mu_s c - s = 0.64 - 0.6: at a decimal the slider stays, and that is known in Q(c)
        (Chain(2, 1000, "0.775", "0.8", tan_alpha="3/4"), Fraction("0.00004") ** 2, 12, {}),
    ],
)
def test_two_sliders_creep_above_their_first_slip_alone(
    chain: Chain, square: Fraction, digits: int, given: dict[str, Any]
) -> None:
    found = threshold(chain, **{"after": 20, "digits": digits} | given)
    lower, upper = bounds(found)
    assert lower**2 <= square < upper**2
    assert upper - lower <= lower / 10**digits
    assert float(found.law_two_sliders) == pytest.approx(float(lower), rel=2e-9)
    assert f"lower='{found.lower}'" in repr(found)
    assert found.evidence is Evidence.PROVED


@pytest.mark.parametrize(
    ("n", "slope", "cycles"),
    [
        (2, "1/4", 12),
        (3, "1/4", 12),
        pytest.param(4, "0.35", 12, marks=pytest.mark.slow),  # 20 seconds
        pytest.param(4, "0.3", 24, marks=pytest.mark.slow),  # it comes to rest after 12 cycles
    ],
)
def test_the_threshold_is_where_the_equations_of_motion_first_creep_to_thirty_digits(
    n: int, slope: str, cycles: int
) -> None:
    chain = captions(n, tan_alpha=slope)
    found = threshold(chain, digits=30)
    lower, upper = bounds(found)
    truth = oracle.threshold(chain, lower * Fraction(999, 1000), cycles)
    assert found.evidence is Evidence.PROVED
    assert upper - lower <= lower / 10**30
    assert lower <= Fraction(str(truth)) <= upper


def test_edges_that_float64_does_not_tell_apart_are_told_apart_by_their_conditions() -> None:
    three, image = (after(captions(3, tan_alpha=s), edges=True) for s in ("0.25", "-0.25"))
    assert bounds(image) == bounds(three)
    # between the second edge and the third two itineraries change within 5e-12 of each other
    _, _, third = three.edges
    found = threshold(captions(3), low="0.0004771", high="0.0004772", points=1, digits=40, after=20)
    low, high = bounds(found)
    assert found.evidence is Evidence.PROVED
    assert high - low < high / 10**40
    assert abs(float(low) - float(third.middle)) < 1e-12


# --- searches that are not completed ----------------------------------------------------------


def test_a_search_out_of_time_keeps_the_bracket_it_has(out_of_time: OutOfTime) -> None:
    def stopped(most: int) -> Threshold:
        """Return what is known after so many looks at the clock."""
        out_of_time(most)
        return threshold(captions(3), digits=20, points=100, after=20, max_seconds=1)

    whole = stopped(10**9)
    assert whole.reason == ""
    lower, upper = bounds(whole)
    known = [found for most in (2, *range(40, 400, 60)) if (found := stopped(most)).reason]
    said = [found.reason.rpartition("; ") for found in known]
    assert {limit for _, _, limit in said} == {"max_seconds = 1 was reached"}
    assert {bool(nothing) for nothing, _, _ in said} == {True, False}
    assert all(
        nothing.startswith("no advance in cycle 20 up to A") for nothing, _, _ in said if nothing
    )
    brackets = [bounds(found) for found in known if found.lower is not None]
    assert len(brackets) < len(known)
    assert all(low <= lower < upper <= high for low, high in brackets)
    widths = [high - low for low, high in brackets]
    assert len(set(widths)) > 2
    assert widths == sorted(widths, reverse=True)


CHAIN = captions(2)
EDGE = Fraction("0.00045678904")
UNIT = Fraction("0.0000000001")  # of five digits and two spare ones
BRACKET = Fraction("0.0001"), Fraction("0.0009")


@dataclass(eq=False)
class Step(Question):
    """The chain creeps above `edge`, or from it on; float64 has it creep above `floats`.

    The solver is undecided at the edge itself.
    """

    edge: Fraction = EDGE
    floats: Fraction = EDGE
    from_edge: bool = False
    what = "creep"

    def creeps(self, amplitude: Fraction) -> bool:
        return amplitude > self.floats

    def certified(self, amplitude: Fraction, digits: int) -> Answer:
        creeps = amplitude > self.edge or (self.from_edge and amplitude == self.edge)
        evidence = Evidence.UNDECIDED if amplitude == self.edge else Evidence.PROVED
        return Answer(creeps, evidence)


def searched(**step: Any) -> Edge:
    search = Search(Step(CHAIN, 1, **step), 5)
    search.find(Span([BRACKET], free=False, points=1))
    return search.edges[0]


ON = Fraction("0.0004567890")
"""The decimal below the edge; an end that lies on an edge is undecided, and moves out."""


@pytest.mark.parametrize(
    ("step", "below"),
    [
        *(({"floats": EDGE + Fraction(off)}, ON) for off in ("0", "1e-9", "-1e-9", "1e-4")),
        ({"floats": EDGE - Fraction("1e-4")}, ON),
        *(({"edge": ON, "from_edge": each}, ON - UNIT) for each in (False, True)),
    ],
)
def test_an_edge_is_found_where_the_solver_has_it_wherever_float64_has_it(
    step: dict[str, Any], below: Fraction
) -> None:
    edge = searched(**step)
    assert bounds(edge) == (below, ON + UNIT)
    assert edge.evidence is Evidence.PROVED


@pytest.mark.parametrize(
    ("edge", "allowed"),
    [(Fraction(-1), "must be lower: .* at any A"), (Fraction(1), "must be higher: .* certified")],
)
def test_a_scan_without_an_edge_for_the_solver_is_refused(edge: Fraction, allowed: str) -> None:
    with pytest.raises(InputError, match=allowed):
        searched(edge=edge)
