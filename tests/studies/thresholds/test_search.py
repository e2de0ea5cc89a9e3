"""The search for an edge, held against questions whose answers are known beforehand."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import pytest

from exactcreep.model.numbers import InputError
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.model.state import State
from exactcreep.studies.fates.fate_result import Fate
from exactcreep.studies.thresholds.amplitudes import Span
from exactcreep.studies.thresholds.questions import Observation, Question
from exactcreep.studies.thresholds.search import Edge, first_edge
from tests.paper import captions

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


def ends(edge: Edge) -> tuple[Fraction, Fraction]:
    return Fraction(edge.lower or "nan"), Fraction(edge.upper or "nan")


@pytest.mark.parametrize("off", ["0", "1e-9", "-1e-9", "1e-4", "-1e-4"])
def test_an_edge_is_found_where_the_solver_has_it_wherever_float64_has_it(off: str) -> None:
    edge = searched(floats=EDGE + Fraction(off))
    lower, upper = ends(edge)
    assert lower < EDGE < upper == lower + UNIT
    assert edge.evidence is Evidence.PROVED


@pytest.mark.parametrize("from_edge", [False, True])
def test_an_end_that_is_undecided_as_it_lies_on_the_edge_moves_out_by_one_unit(
    from_edge: bool,
) -> None:
    on_a_decimal = Fraction("0.0004567890")
    edge = searched(edge=on_a_decimal, cut=on_a_decimal, from_edge=from_edge)
    assert ends(edge) == (on_a_decimal - UNIT, on_a_decimal + UNIT)
    assert edge.evidence is Evidence.PROVED


def test_a_run_that_was_cut_short_decides_no_edge() -> None:
    lower, upper = ends(searched(cut=EDGE - 3 * UNIT))
    assert lower < EDGE < upper == lower + UNIT


@pytest.mark.parametrize(
    ("edge", "allowed"),
    [(Fraction(-1), "must not creep at its lower end"), (Fraction(1), "must creep at its upper")],
)
def test_a_bracket_without_an_edge_for_the_solver_is_refused(edge: Fraction, allowed: str) -> None:
    with pytest.raises(InputError, match=allowed) as refused:
        searched(edge=edge, cut=edge)
    assert refused.value.field == "bracket"
