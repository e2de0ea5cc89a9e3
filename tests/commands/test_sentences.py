"""What questions and sweeps print first: one sentence, or one table, with errors to two digits."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from exactcreep import Chain, Cycles, Evidence, Outcome, State, creep, load_scene
from exactcreep.studies.fates.escape import Rate
from exactcreep.studies.fates.fate_result import Fate
from exactcreep.studies.fates.survival import StartRecord, Survival
from exactcreep.studies.thresholds.intercept import Intercept
from exactcreep.studies.thresholds.threshold import Threshold
from tests.conftest import Command
from tests.paper import paper_chain

CHAIN = paper_chain(3)
FATE = Fate(
    CHAIN, Fraction(1, 1000), State.relaxed(CHAIN), "exact", Outcome.CREEPING, Evidence.PROVED,
    cycles=50, settled_after=30, period=1, advance=0.70517,
)  # fmt: skip
EDGE = Threshold(CHAIN, "lasting", 100, 6, "certified", "", "0.00045", "0.00046", Evidence.PROVED)
NONE = np.zeros(0)
LINE = Intercept(
    chain=CHAIN, cycles=100, seed=0, size=Fraction(1), reason="", fit=(1.2, 2.0), law_seuil=7.27e-4,
    law_slope=3000.0, intercept=7.262e-4, error=6.4e-6, systematic=1.4e-5,
    amplitudes=NONE, velocities=NONE, errors=NONE,
)  # fmt: skip


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


def test_an_intercept_is_said_with_its_error() -> None:
    assert LINE.sentence == (
        "the straight part of v(A) meets zero at A = 0.0007262 ± 0.0000064 (computed); half of"
        " the range moves it by up to 1.4e-05; Eq. 22 says 0.000727"
    )
    assert "is not known where" in replace(LINE, intercept=math.nan).sentence


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


def test_a_question_prints_its_sentence_first_and_no_zeros(command: Command) -> None:
    first, *rows = command("fate", "--n", "2", "--amplitude", "0.001").out.splitlines()
    assert first == "Creeping downhill, settled after 1 cycle (proved)"
    assert not any(re.search(r"  (0|no)$", row) for row in rows)
    assert any(row.startswith("advance enclosure") for row in rows)


def test_a_sweep_prints_a_velocity_with_its_error_at_every_point(command: Command) -> None:
    line = "sweep six-sliders-cycles --set drive.cycles=80 --seeds 4 --out cells"
    rows = command(*line.split(), "--set", "vary.drive.amplitude=[0.00001,0.01]").out.splitlines()
    assert rows[1].split() == ["amplitude", "velocity", "outcome"]
    assert re.fullmatch(r" 1e-05 +0.* +4 (at_rest|cycling)", rows[2])
    assert re.fullmatch(r" 0\.01 +2\d\.\d+ ± 0\.\d+ +4 creeping downhill", rows[3])
    assert rows[4].startswith("2 points, 4 seeds each: means and their standard errors: 4 ")


def test_a_sweep_says_why_errors_are_not_known(command: Command) -> None:
    line = "sweep two-sliders-cycles --set drive.cycles=5 --seeds 2 --out cells"
    *_, reason = command(*line.split()).out.splitlines()
    run = creep(paper_chain(2), Cycles("0.005", 5))
    assert reason.startswith(f"no standard error in 2 runs: {run.velocity_reason[:12]}")


def test_what_is_simulated_has_a_table_of_its_own_in_a_notebook() -> None:
    chain = Chain(2, 1000, 0.5, 0.6, tan_alpha="1/3")
    table = chain._repr_html_()
    assert "<td>0.6 </td>" in table  # not 5404319552844595/9007199254740992
    assert "<td>1/3 </td>" in table
    assert "<td>1000 g tau_dyn^2</td>" in table
    assert "<caption>Cycles</caption>" in Cycles("0.01", 5)._repr_html_()
    assert " m g</td>" in State.relaxed(chain)._repr_html_()
    scene = load_scene("chain-jumps")._repr_html_()
    assert "<th style='text-align:left'>chain.mu_s</th><td>0.6 </td>" in scene
    assert "vary.drive.amplitude" in scene


def test_a_run_says_the_unit_of_its_velocity_and_why_its_error_is_not_known() -> None:
    run = creep(paper_chain(2), Cycles("0.005", 5))
    assert math.isnan(run.velocity_error)
    assert run.velocity_reason
    assert run.velocity_reason in repr(run)
    assert run.velocity_reason in run._repr_html_()
    assert f"{run.velocity:.6g} {run.velocity_units}</td>" in run._repr_html_()
