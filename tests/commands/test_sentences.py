"""What questions and sweeps print first: one sentence, or one table, with errors to two digits."""

from __future__ import annotations

import re
from dataclasses import replace
from fractions import Fraction
from typing import Any

import pytest

from exactcreep import Evidence, Outcome, State
from exactcreep.studies.fates.fate_result import Fate
from exactcreep.studies.thresholds.threshold import Threshold
from tests.conftest import Command
from tests.paper import paper_chain

CHAIN = paper_chain(3)
FATE = Fate(
    CHAIN, Fraction(1, 1000), State.relaxed(CHAIN), "exact", Outcome.CREEPING, Evidence.PROVED,
    cycles=50, settled_after=30, period=1, advance=0.70517,
)  # fmt: skip
EDGE = Threshold(CHAIN, "lasting", 100, 6, "certified", "", "0.00045", "0.00046", Evidence.PROVED)


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        (FATE, "creeping downhill, settled after 30 cycles (proved)"),
        (replace(FATE, advance=-0.1, settled_after=1), "creeping uphill, settled after 1 cycle ("),
        (replace(FATE, outcome=Outcome.RUNAWAY, settled_after=None, reason="steep"),
         "runaway downhill (proved): steep"),
        (replace(FATE, outcome=Outcome.LIMIT, settled_after=None, reason="time"),
         "limit, not settled in 50 cycles (proved): time"),
        (EDGE, "creep for ever begins between A = 0.00045 and 0.00046 (proved)"),
        (replace(EDGE, criterion="horizon", cycles=3), "an advance in cycle 3 begins between"),
        (replace(EDGE, upper=None, reason="time"), "it is not known where creep for ever"),
    ],
)  # fmt: skip
def test_an_answer_is_a_sentence_with_its_numbers_or_why_they_are_not_known(
    answer: Any, said: str
) -> None:
    assert answer.sentence.startswith(said)


def test_a_sweep_prints_a_velocity_with_its_error_at_every_point(command: Command) -> None:
    line = "sweep six-sliders-cycles --set drive.cycles=80 --seeds 4 --out cells"
    rows = command(*line.split(), "--set", "vary.drive.amplitude=[0.00001,0.01]").out.splitlines()
    assert rows[1].split() == ["amplitude", "velocity", "outcome"]
    assert re.fullmatch(r" 1e-05 +0.* +4 (at_rest|cycling)", rows[2])
    assert re.fullmatch(r" 0\.01 +2\d\.\d+ ± 0\.\d+ +4 creeping downhill", rows[3])
    assert rows[4].startswith("2 points, 4 seeds each: means and their standard errors: 4 ")
