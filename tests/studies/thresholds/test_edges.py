"""Thresholds after so many cycles: their edges, held against laws, each other and mirror images."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import pytest

from exactcreep import Chain, Evidence, InputError, Outcome, State, threshold
from exactcreep.results import Fate, Threshold
from exactcreep.studies.thresholds.amplitudes import Span
from exactcreep.studies.thresholds.questions import Observation, Question
from exactcreep.studies.thresholds.search import Edge, first_edge
from tests.conftest import OutOfTime
from tests.oracle import rearrangement as oracle
from tests.paper import captions

PAIR = captions(2, tan_alpha="5/12")  # cos = 12/13, sin = 5/13
ONSET = Fraction(11, 65) / 1000  # (mu_s c - s)/l0 = (36/65 - 25/65)/l0


def after(chain: Chain, cycles: int = 20, **given: Any) -> Threshold:
    return threshold(chain, **{"solver": "exact", "digits": 9, "after": cycles} | given)


def bounds(found: Threshold | Edge) -> tuple[Fraction, Fraction]:
    return Fraction(found.lower or "nan"), Fraction(found.upper or "nan")


@pytest.fixture(scope="module")
def three() -> Threshold:
    return after(captions(3), edges=True)


# --- edges that are known beforehand ----------------------------------------------------------


@pytest.mark.parametrize(
    ("chain", "square", "digits", "given"),
    [
        (PAIR, ONSET**2, 9, {"solver": "exact"}),
        (PAIR, ONSET**2, 9, {"solver": "exact", "low": "1e-6", "high": "1e-3"}),
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
    assert upper - lower <= lower / 10**digits * (1 if not given else 10)
    assert found.outcome_at_lower is Outcome.AT_REST
    assert float(found.law_two_sliders) == pytest.approx(float(lower), rel=2e-9)
    assert f"lower='{found.lower}'" in repr(found)
    if not given:
        assert found.evidence is found.outcome_evidence is Evidence.PROVED


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


@pytest.mark.parametrize(
    ("n", "digits", "below"),
    [
        (3, 40, Outcome.AT_REST),
        (4, 60, Outcome.CYCLING),  # its ends slip for ever
        pytest.param(6, 40, None, marks=pytest.mark.slow),
        pytest.param(8, 40, None, marks=pytest.mark.slow),
    ],
)
def test_two_arithmetics_agree_on_an_edge_that_balls_prove(
    n: int, digits: int, below: Outcome | None
) -> None:
    floats = after(captions(n), digits=12)
    found = threshold(captions(n), after=20, digits=digits)
    (low, high), (lower, upper) = bounds(floats), bounds(found)
    assert low <= lower < upper <= high
    assert math.log10(low / (high - low)) > 8
    assert upper - lower <= lower / 10**digits
    assert found.evidence is Evidence.PROVED
    if below:
        assert found.outcome_at_lower is floats.outcome_at_lower is below
        assert found.outcome_evidence is Evidence.PROVED


def test_the_deciding_event_is_a_start_on_one_side_only_and_that_of_the_mirror_image(
    three: Threshold,
) -> None:
    image = after(captions(3, tan_alpha="-0.25"))
    assert bounds(image) == bounds(three)
    sides, other = three.deciding_event, image.deciding_event
    assert sides.at_upper.half_cycle < sides.at_lower.half_cycle
    assert [4 - n for n in sides.at_upper.event.sliders] == list(other.at_upper.event.sliders)


def test_edges_that_float64_does_not_tell_apart_are_told_apart_by_their_conditions(
    three: Threshold,
) -> None:
    # between the second edge and the third two itineraries change within 5e-12 of each other
    _, _, third = three.edges
    found = threshold(captions(3), bracket=("0.0004771", "0.0004772"), digits=40, after=20)
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
    assert {found.reason for found in known} == {"max_seconds = 1 was reached"}
    bare = [found for found in known if found.lower is None]
    assert bare == known[: len(bare)] != []
    brackets = [bounds(found) for found in known[len(bare) :]]
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

    The solver is undecided at the edge itself. A run to so many digits is cut short, and taken to
    creep, between `cut` and the edge.
    """

    edge: Fraction = EDGE
    floats: Fraction = EDGE
    from_edge: bool = False
    cut: Fraction = EDGE

    def creeps(self, amplitude: Fraction) -> bool:
        return amplitude > self.floats

    def tried(self, amplitude: Fraction, solver: str, options: dict[str, Any]) -> Observation:
        proved, at_rest = Evidence.PROVED, Outcome.AT_REST
        if solver == "exact":
            return Observation(self.creeps(amplitude), Evidence.COMPUTED, [], at_rest, proved)
        if self.cut < amplitude < self.edge and "digits" in options:
            undecided = Evidence.UNDECIDED
            fate = Fate(self.chain, amplitude, self.start, solver, Outcome.LIMIT, undecided, 1)
            return Observation(True, undecided, [], Outcome.LIMIT, undecided, fate=fate)
        creeps = amplitude > self.edge or (self.from_edge and amplitude == self.edge)
        evidence = Evidence.UNDECIDED if amplitude == self.edge else proved
        return Observation(creeps, evidence, [], at_rest, proved)


def searched(**step: Any) -> Edge:
    question = Step(CHAIN, 1, State.relaxed(CHAIN), **step)
    return first_edge(question, Span(BRACKET, [], free=False, points=1), 5)


ON = Fraction("0.0004567890")
"""The decimal below the edge; an end that lies on an edge is undecided, and moves out."""


@pytest.mark.parametrize(
    ("step", "below"),
    [
        *(({"floats": EDGE + Fraction(off)}, ON) for off in ("0", "1e-9", "-1e-9", "1e-4")),
        ({"floats": EDGE - Fraction("1e-4")}, ON),
        ({"cut": EDGE - 3 * UNIT}, ON),  # a run that was cut short decides no edge
        *(({"edge": ON, "cut": ON, "from_edge": each}, ON - UNIT) for each in (False, True)),
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
    [(Fraction(-1), "must not creep at its lower end"), (Fraction(1), "must creep at its upper")],
)
def test_a_bracket_without_an_edge_for_the_solver_is_refused(edge: Fraction, allowed: str) -> None:
    with pytest.raises(InputError, match=allowed) as refused:
        searched(edge=edge, cut=edge)
    assert refused.value.field == "bracket"
