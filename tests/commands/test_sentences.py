"""What questions and sweeps print first: one sentence, or one table, with errors to two digits."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from fractions import Fraction

import pytest

from exactcreep import Evidence, Outcome, State
from exactcreep.studies.fates.escape import Rate
from exactcreep.studies.fates.fate_result import Fate
from exactcreep.studies.fates.survival import StartRecord, Survival
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
    ("changed", "said"),
    [
        ({}, "creeping downhill, settled after 30 cycles (proved)"),
        ({"advance": -0.1, "period": 4, "evidence": Evidence.COMPUTED},
         "creeping uphill, settled after 30 cycles (computed)"),
        ({"outcome": Outcome.CYCLING, "advance": 0.0}, "cycling, settled after 30 cycles (pro"),
        ({"outcome": Outcome.AT_REST, "settled_after": 1}, "at rest, settled after 1 cycle (pro"),
        ({"outcome": Outcome.RUNAWAY, "settled_after": None, "reason": "as it is steep"},
         "runaway downhill (proved): as it is steep"),
        ({"outcome": Outcome.LIMIT, "settled_after": None, "reason": "time"},
         "limit, not settled in 50 cycles (proved): time"),
    ],
)  # fmt: skip
def test_a_fate_is_said_in_one_sentence(changed: dict[str, object], said: str) -> None:
    assert said in replace(FATE, **changed).sentence  # type: ignore[arg-type]


def test_an_edge_is_said_with_both_ends_or_why_it_is_not_known() -> None:
    assert EDGE.sentence == ("creep for ever begins between A = 0.00045 and 0.00046 (proved)")
    after = replace(EDGE, criterion="horizon", cycles=3, evidence=Evidence.UNDECIDED)
    assert after.sentence.startswith("an advance in cycle 3 begins between")
    unknown = replace(EDGE, upper=None, reason="its time is over").sentence
    assert unknown == "it is not known where creep for ever begins: its time is over"


def lives(rate: Rate, *outcomes: Outcome, reason: str = "") -> Survival:
    """Return a survival whose starts came to these outcomes, with a rate of its own."""
    records = tuple(
        StartRecord(number, outcome.value, "computed", 100, 10, 10, -1, 0, -1, *[False] * 3)
        for number, outcome in enumerate(outcomes, 1)
    )
    made = Survival(CHAIN, Fraction(1), Fraction(1), 9, 100, 0, 500, records, reason)
    vars(made)["rate"] = rate
    return made


def test_lives_are_said_as_one_in_so_many_cycles() -> None:
    locked = lives(Rate(1 / 745, 1 / 1220, 1 / 480), *[Outcome.CYCLING] * 3, Outcome.AT_REST)
    assert locked.sentence == (
        "creep ends once in 745 cycles (95 %: 480 to 1220); starts: 3 locked, 1 at rest"
    )
    unsure = lives(Rate(0.01, 0.0, 0.1), Outcome.CYCLING)
    assert "(95 %: 10 to any number); starts: 1 locked" in unsure.sentence
    nothing = lives(Rate(math.nan, math.nan, math.nan, reason="too few"), reason="time")
    assert nothing.sentence == (
        "it is not known how soon creep ends (too few); no start was followed: time"
    )


def test_a_sweep_prints_a_velocity_with_its_error_at_every_point(command: Command) -> None:
    line = "sweep six-sliders-cycles --set drive.cycles=80 --seeds 4 --out cells"
    rows = command(*line.split(), "--set", "vary.drive.amplitude=[0.00001,0.01]").out.splitlines()
    assert rows[1].split() == ["amplitude", "velocity", "outcome"]
    assert re.fullmatch(r" 1e-05 +0.* +4 (at_rest|cycling)", rows[2])
    assert re.fullmatch(r" 0\.01 +2\d\.\d+ ± 0\.\d+ +4 creeping downhill", rows[3])
    assert rows[4].startswith("2 points, 4 seeds each: means and their standard errors: 4 ")
