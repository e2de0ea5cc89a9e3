"""The corpus of hard cases: near-grazes, near-ties and long avalanches, against what was proved."""

from __future__ import annotations

import json
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from exactcreep import Chain, Evidence, Outcome, State, rearrange
from exactcreep.solvers.rearrangement import Rearrangement

FILE = Path(__file__).parents[1] / "data" / "hard_cases.json"
CASES = {case["label"]: case for case in json.loads(FILE.read_text("utf-8"))}


@cache
def found_by(solver: str, label: str) -> Rearrangement:
    case: dict[str, Any] = CASES[label]
    chain = Chain(**case["chain"])
    state = State.prepared(chain, case["start"], seed=case["seed"])
    return rearrange(chain, state, direction=case["direction"], seed=case["seed"], solver=solver)


@pytest.mark.parametrize("solver", ["exact", "reference"])
@pytest.mark.parametrize("label", CASES)
def test_float64_finds_what_was_proved_or_says_that_it_cannot_decide(
    label: str, solver: str
) -> None:
    found, case = found_by(solver, label), CASES[label]
    proved = tuple((kind, tuple(who), tuple(how)) for kind, who, how in case["itinerary"])
    undecided = found.evidence is Evidence.UNDECIDED
    own = found.itinerary
    if case["outcome"] == Outcome.RUNAWAY.value:  # the moment of the proof is the solver's own
        shared = min(len(own), len(proved))
        assert shared > 100 or len(own) == len(proved)
        own, proved = own[:shared], proved[:shared]
    if undecided and own != proved:
        return
    assert own == proved
    assert found.outcome.value == case["outcome"]
    ends = zip(found.state.displacements, case["displacements"], strict=bool(case["displacements"]))
    assert undecided or all(abs(Fraction(float(x)) - Fraction(true)) < 1e-12 for x, true in ends)


@pytest.mark.parametrize("solver", ["exact", "reference"])
def test_float64_decides_all_of_them_but_two(solver: str) -> None:
    evidence = [found_by(solver, label).evidence for label in CASES]
    assert len(evidence) > 40
    assert evidence.count(Evidence.UNDECIDED) <= 2
