"""The audit as a referee runs it: every subject's proofs, the ledger, the command."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from derivations import pivots, sliding_limit, thresholds
from derivations.__main__ import main
from derivations.ledger import (
    CHAPTERS,
    EQUATIONS,
    Entry,
    disagreements,
    entries,
    premises,
    proof_of,
    value,
)
from derivations.model import MODEL, PREMISES, Model
from derivations.notation import l0, theta
from derivations.proof import STANDINGS

ROOT = Path(__file__).parents[2]
NAMED = {entry.name: entry for entry in entries()}

ACCUSED = {
    "misprint": """pivot_stability contraction_needed position_decreases critical_dilation
    first_critical_angle continuum_source critical_velocity units_of_force
    caption_of_plateaus""",
    "inconsistent": """reversal_step velocity_th_2_cycle_corrected
    velocity_th_2_gaussienne_corrected threshold_th_2_gaussienne_corrected solid_dilation
    solid_temperature dilation_rate column_threshold dilation_jumps compression_wave divergence
    divergence_of_chains""",
}


@pytest.mark.parametrize("name", CHAPTERS)
def test_every_line_of_a_chapter_holds(name: str) -> None:
    proof = proof_of(name)
    assert len(proof.lines) >= 3
    assert proof.assumptions
    assert [line.text for line in proof.lines if line.fault] == []
    assert all(line.why for line in proof.lines if line.standing in ("checked", "argued"))
    assert set(proof.decisions) == {e.name for e in entries() if e.chapter == name}


def test_the_page_on_claims_counts_the_statements_of_the_ledger() -> None:
    page = (ROOT / "notebooks/explanation/claims.md").read_text(encoding="utf-8")
    said = page.partition("`python -m derivations`")[2]
    standings = [entry.standing for entry in entries()]
    counts = [standings.count(word) for word in ("", *STANDINGS)]
    beyond = sum(entry.place.startswith("Beyond") for entry in entries())
    others = len(standings) - counts[0]
    expected = [len(standings), beyond, counts[0], others, *counts[1:]]
    assert [*map(int, re.findall(r"\b\d+", said))] == expected


@pytest.mark.parametrize("entry", entries(), ids=lambda entry: entry.name)
def test_every_entry_earns_its_verdict_and_says_why(entry: Entry) -> None:
    assert entry.faults() == []
    if entry.verdict in ACCUSED:
        assert entry.corrected
    if entry.verdict in (*ACCUSED, "approximation"):
        assert entry.error
    if entry.verdict == "convention":
        assert not entry.proved
    parts = [(entry.formula or "", entry.printed)]
    parts += [(formula, entry.corrected or "") for formula in entry.corrected_formulas]
    for part, whole in parts:
        assert "".join(part.split()) in "".join(whole.split())


def test_exactly_the_known_misprints_are_accused() -> None:
    for verdict, known in ACCUSED.items():
        assert {entry.name for entry in entries() if entry.verdict == verdict} == {*known.split()}


def test_derivations_import_nothing_from_the_package() -> None:
    for path in (ROOT / "derivations").glob("*.py"):
        text = path.read_text(encoding="utf-8")
        assert not re.search(r"^\s*(from|import) exactcreep", text, re.MULTILINE), path.name


def test_an_equation_is_found_by_its_number_and_what_does_not_exist_is_named(
    capsys: pytest.CaptureFixture[str],
) -> None:
    said = [(main(["--only", name]), capsys.readouterr().out) for name in ("seuil", "22", "Eq. 22")]
    assert {code for code, _ in said} == {0}
    assert len({out.partition("lines:")[0] for _, out in said}) == 1
    assert main(["--only", "vitess"]) == 2
    assert "vitess" in capsys.readouterr().err


def _source() -> str:
    """Return a source that holds every statement, labelled ones in equations."""
    form = "\\begin{{eqnarray}}{}{}\\end{{eqnarray}}"
    numbered = sorted((e for e in entries() if e.number), key=lambda e: e.number or 0)
    named = [form.format(e.printed, f"\\label{{{e.label}}}" * bool(e.label)) for e in numbered]
    return "\n\n".join([*(e.printed for e in entries() if not e.number), *named])


def test_a_source_is_accepted_unless_an_equation_is_changed_missing_or_new() -> None:
    assert disagreements(_source()) == []
    assert disagreements(_source().replace(" ", "\n  ")) == []
    changed = _source().replace("\\frac{\\Delta\\mu}{N}", "\\frac{\\Delta\\mu}{2N}")
    assert any(problem.startswith("critical_angle") for problem in disagreements(changed))
    unlabelled = _source().replace("\\label{seuil}", "")
    assert disagreements(unlabelled) == ["the source has no equation seuil"]
    more = _source() + "\\be a = b \\label{another} \\ee"
    assert disagreements(more) == [
        f"Eq. ({EQUATIONS + 1}) has 0 entries: \\bea=b\\label{{another}}\\ee",
        "no entry for the equation another",
    ]


@pytest.mark.slow
def test_the_table_of_premises_that_the_book_keeps_is_the_one_that_is_computed() -> None:
    kept = json.loads((ROOT / "notebooks/reference/premises.json").read_text(encoding="utf-8"))
    assert kept["refuted without"] == premises()


def test_a_changed_premise_refutes_what_depends_on_it_alone(
    capsys: pytest.CaptureFixture[str],
) -> None:
    seventh = ["--premise", "gravity x 7"]
    for name in ("turning_points", "threshold_of_size", "hertz_stiffness", "contraction_partner"):
        assert main(["--only", name, *seventh]) == 0
    capsys.readouterr()
    assert main(["--only", "critical_angle", *seventh]) == 1
    said = capsys.readouterr()
    assert "proved" not in said.out
    assert said.err.count("refuted: ") >= 5
    assert "critical_angle: the printed formula does not earn its verdict" in said.err


TWICE = replace(MODEL, natural=(l0 * (1 + 2 * theta),) * 2)
"""Springs that expand twice as much: they push by another rate, in the same directions."""
FORCE = "equation of motion of slider n"
FRICTION = "... and friction, if it moves"
FOLLOWS = "one that slides continuously and without inertia"


@pytest.mark.parametrize(
    ("chapter", "model", "first", "refuted"),
    [
        (pivots, PREMISES["gravity x 7"], FORCE, 19),
        (pivots, PREMISES["friction x 2"], FRICTION, 20),
        (pivots, PREMISES["springs that push"], FORCE, 20),
        (pivots, PREMISES["ends that pull"], "the i - 1 sliders above slider i slide uphill", 14),
        (pivots, PREMISES["theta at one end"], FORCE, 21),
        (pivots, PREMISES["mu_s in motion"], FRICTION, 20),
        (pivots, PREMISES["slips without overshoot"], FOLLOWS, 16),
        (pivots, PREMISES["sliders that stick and slip"], FOLLOWS, 18),
        (pivots, TWICE, "", 0),
        (thresholds, TWICE, "the pivot and slider i rest meanwhile, and theta changes", 7),
        (sliding_limit, TWICE, "slider n moves by rise and fall", 4),
    ],
)
def test_a_changed_premise_refutes_first_the_line_that_states_it(
    chapter: Any, model: Model, first: str, refuted: int
) -> None:
    fallen = [line.text for line in chapter.derive(model).lines if line.fault]
    assert len(fallen) == refuted
    assert "".join(fallen[:1]).startswith(first)


def test_the_printed_and_the_corrected_formula_differ_by_the_numbers_that_the_book_shows() -> None:
    for name, printed, corrected in (
        ("seuil", 0.0036380, 0.0036865),
        ("pivot_stability", 0.48507, 0.58209),
        ("contraction_needed", -7.3731, 7.3731),
        ("velocity_th_2_cycle_corrected", 4.66045, 4.75746),
        ("small_difference", 1 / 300, 4 / 300),
        ("vitesse", 75, 20.4295),
    ):
        assert value(NAMED[name]) == pytest.approx(printed, rel=1e-4)
        assert value(NAMED[name], corrected=True) == pytest.approx(corrected, rel=1e-4)
    assert value(NAMED["first_critical_angle"], corrected=True) == pytest.approx(151 / 300)
    assert value(NAMED["vitesse_seuil"]) == pytest.approx(20.4295, rel=1e-4)
