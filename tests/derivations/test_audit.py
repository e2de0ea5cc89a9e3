"""The audit as a referee runs it: every subject's proofs, the ledger, the command."""

from __future__ import annotations

import ast
import json
from pathlib import Path

import pytest

from derivations.__main__ import main
from derivations.entry import Entry
from derivations.ledger import CHAPTERS, disagreements, entries, premises, proof_of, value
from derivations.model import PREMISES
from derivations.notation import NotationError, read

ROOT = Path(__file__).parents[2]

LABELLED_EQUATIONS = {
    "spring_force", "static_friction", "dynamical_friction",
    "dynamic_eq1", "dynamic_eq", "dynamic_eqN",
    "static_eq1", "static_eq", "static_eqN",
    "dist_mud", "dist_theta",
    "velocity_th_2_cycle", "velocity_th_2_gaussian",
    "velocity_th_2_cycle_corrected", "threshold_th_2_cycle_corrected",
    "velocity_th_2_gaussienne_corrected", "threshold_th_2_gaussienne_corrected",
    "critical_angle", "vitesse", "forcestatique", "seuil", "vitesse_seuil",
    "vitesse_seuil_random", "vitessecontinue",
}  # fmt: skip

MISPRINTS = {
    "pivot_stability": "one friction coefficient of the wrong kind",
    "contraction_needed": "one inequality with the wrong sign",
    "position_decreases": "one direction of motion reversed",
    "critical_dilation": "one comparison of absolute values that does not hold in general",
    "first_critical_angle": "one limiting angle that is not what the text says",
    "continuum_source": "one reference to the wrong equation",
    "critical_velocity": "a critical velocity that is an amplitude",
}
INCONSISTENT = {
    "reversal_step": "mu_s where the mean over slips has mu_d",
    "velocity_th_2_cycle_corrected": "contradicts the general law at N = 2",
    "velocity_th_2_gaussienne_corrected": "contradicts the general random law at N = 2",
    "threshold_th_2_gaussienne_corrected": "the same, where its asymptote vanishes",
    "solid_dilation": "an order of magnitude that the formula above it does not give",
    "solid_temperature": "another one",
    "dilation_rate": "no rate makes a slider slide continuously",
    "column_threshold": "negative for the vertical column that it is meant for",
    "dilation_jumps": "a jump of theta where the method has a ramp",
    "compression_wave": "a contraction pulls",
}


@pytest.mark.parametrize("name", CHAPTERS)
def test_every_line_of_a_chapter_holds(name: str) -> None:
    proof = proof_of(name)
    assert len(proof.lines) >= 3
    assert proof.assumptions
    assert [line.text for line in proof.lines if line.fault] == []
    assert all(line.why for line in proof.lines if line.standing in ("checked", "argued"))


@pytest.mark.parametrize("entry", entries(), ids=lambda entry: entry.name)
def test_every_entry_earns_its_verdict(entry: Entry) -> None:
    entry.check()


def test_every_labelled_equation_has_an_entry() -> None:
    assert {entry.label for entry in entries()} - {None} == LABELLED_EQUATIONS


def test_exactly_the_known_misprints_are_accused() -> None:
    found = {
        kind: {entry.name for entry in entries() if entry.verdict == kind}
        for kind in ("misprint", "inconsistent")
    }
    assert found == {"misprint": set(MISPRINTS), "inconsistent": set(INCONSISTENT)}


def test_an_accused_statement_names_its_error_and_its_correction() -> None:
    for entry in entries():
        if entry.verdict in ("misprint", "inconsistent"):
            assert entry.corrected, entry.name
            assert entry.error, entry.name


def test_an_approximation_says_its_error() -> None:
    assert [e.name for e in entries() if e.verdict == "approximation" and not e.error] == []


def test_definitions_and_words_are_not_called_proved() -> None:
    by_name = {entry.name: entry for entry in entries()}
    assert not any(entry.proved for entry in by_name.values() if entry.verdict == "convention")
    assert by_name["critical_angle"].proved


def test_formulas_are_parts_of_what_is_printed() -> None:
    for entry in entries():
        if entry.formula is not None:
            assert "".join(entry.formula.split()) in "".join(entry.printed.split()), entry.name
        if entry.corrected_formula is not None:
            assert "".join(entry.corrected_formula.split()) in "".join(
                (entry.corrected or "").split()
            ), entry.name


def test_derivations_import_nothing_from_the_package() -> None:
    for path in (ROOT / "derivations").glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = (
                [alias.name for alias in node.names]
                if isinstance(node, ast.Import)
                else [node.module or ""]
                if isinstance(node, ast.ImportFrom)
                else []
            )
            assert not any(name.split(".")[0] == "exactcreep" for name in names), path.name


def test_the_package_never_imports_the_derivations() -> None:
    for path in (ROOT / "exactcreep").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                assert all(alias.name.split(".")[0] != "derivations" for alias in node.names)
            if isinstance(node, ast.ImportFrom):
                assert (node.module or "").split(".")[0] != "derivations"


def test_json_is_a_list_of_objects_with_the_promised_fields(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["--json", "--only", "critical_angle"]) == 0
    (found,) = json.loads(capsys.readouterr().out)
    assert found["label"] == "critical_angle"
    assert found["verdict"] == "exact"
    assert found["proved"] is True
    assert set(found) >= {
        "label", "verdict", "printed", "corrected", "assumptions", "error", "proved", "how"
    }  # fmt: skip


def test_show_prints_the_steps_of_one_subject(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--show", "--only", "pivots"]) == 0
    printed = capsys.readouterr().out
    assert "Pivots and critical angles" in printed
    assert "it starts downhill, F_i > mu_s c" in printed
    assert "mu_d*(1 - 2*(i - 1)/N) + (-mu_d + mu_s)/N" in printed


def test_an_unknown_label_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--only", "vitess"]) == 2
    assert "vitess" in capsys.readouterr().err


def test_a_missing_source_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--only", "seuil", "--paper", str(tmp_path / "none.tex")]) == 2
    assert "none.tex" in capsys.readouterr().err


def _source() -> str:
    """Return a source that holds every statement, labelled ones in equations."""
    parts = []
    for entry in entries():
        if entry.label is None:
            parts.append(entry.printed)
        else:
            label = f"\\label{{{entry.label}}}"
            parts.append(f"\\begin{{equation}}{entry.printed}{label}\\end{{equation}}")
    return "\n\n".join(parts)


def test_a_source_with_every_statement_is_accepted_whatever_its_white_space() -> None:
    assert disagreements(_source()) == []
    assert disagreements(_source().replace(" ", "\n  ")) == []


def test_a_changed_missing_or_additional_equation_is_reported() -> None:
    changed = _source().replace("\\frac{\\Delta\\mu}{N}", "\\frac{\\Delta\\mu}{2N}")
    assert any(problem.startswith("critical_angle") for problem in disagreements(changed))
    unlabelled = _source().replace("\\label{seuil}", "")
    assert disagreements(unlabelled) == ["the source has no equation seuil"]
    more = _source() + "\\be a = b \\label{another} \\ee"
    assert disagreements(more) == ["no entry for the equation another"]


CARRIED = {
    "gravity x 7": {
        "static_eq", "dynamic_eq", "critical_angle", "pivot_stability", "seuil", "vitesse_seuil",
        "velocity_th_2_cycle_corrected", "vitesse_seuil_random", "vitessecontinue", "alpha_c",
        "pipeline_walking",
    },
    "friction x 2": {
        "dynamical_friction", "dynamic_eq", "critical_angle", "force_drop", "seuil",
        "vitesse_seuil", "velocity_th_2_cycle_corrected", "vitessecontinue", "alpha_c",
    },
    "springs that push": {
        "spring_force", "dynamic_eq", "critical_angle", "force_drop", "seuil", "vitesse_seuil",
        "integration_step",
    },
    "ends that pull": {
        "free_end_upper", "free_end_lower", "dynamic_eqN", "critical_angle", "vitesse_seuil",
        "horizontal",
    },
    "theta at one end": {
        "static_eqN", "critical_angle", "dilation_rate", "dilation_displacement", "vitesse_seuil",
    },
    "coefficients kept": {"redraw", "insensitive_to_disorder"},
    "mu_s in motion": {
        "dynamical_friction", "dynamic_eq", "critical_angle", "force_drop", "seuil",
        "vitesse_seuil", "velocity_th_2_cycle_corrected", "vitessecontinue",
    },
}  # fmt: skip
"""Some of what each premise carries."""

CARRIED_BY_NONE = {
    "slider_mass", "total_length", "dynamical_time", "dist_mud", "dist_theta", "turning_points",
    "gaussian_amplitude", "no_random_threshold", "chain_length", "hertz_stiffness",
    "friction_difference", "dilation_jumps",
}  # fmt: skip


def test_every_premise_refutes_what_depends_on_it_and_nothing_else() -> None:
    table = premises()
    assert set(table) == {entry.name for entry in entries()}
    for premise, names in CARRIED.items():
        assert names - {name for name, refuted in table.items() if premise in refuted} == set()
    assert {name for name in CARRIED_BY_NONE if table[name]} == set()
    assert table["free_end_upper"] == ["ends that pull"]
    assert table["threshold_th_2_cycle_corrected"].count("friction x 2") == 0
    assert "coefficients kept" not in table["critical_angle"]


def test_what_does_not_depend_on_a_premise_is_not_refuted_with_it() -> None:
    for name in ("turning_points", "threshold_of_size", "hertz_stiffness", "dist_mud"):
        assert main(["--only", name, "--premise", "gravity x 7"]) == 0


@pytest.mark.parametrize("name", ["pivots", "shakedown", "slip", "runaway", "modes"])
def test_a_chapter_falls_with_the_premises_it_takes(name: str) -> None:
    fallen = {
        premise
        for premise, model in PREMISES.items()
        if any(line.fault for line in proof_of(name, model).lines if line.standing == "proved")
    }
    assert fallen == {
        "pivots": set(PREMISES) - {"coefficients kept"},
        "shakedown": set(PREMISES) - {"coefficients kept"},
        "slip": {"friction x 2", "springs that push", "theta at one end", "mu_s in motion"},
        "runaway": set(PREMISES) - {"coefficients kept"},
        "modes": {"springs that push"},
    }[name]


def test_the_printed_and_the_corrected_formula_differ_by_the_numbers_that_the_book_shows() -> None:
    known = {entry.name: entry for entry in entries()}
    for name, printed, corrected in (
        ("seuil", 0.0036380, 0.0036865),
        ("pivot_stability", 0.48507, 0.58209),
        ("contraction_needed", -7.3731, 7.3731),
        ("velocity_th_2_cycle_corrected", 4.66045, 4.75746),
        ("small_difference", 1 / 300, 4 / 300),
        ("vitesse", 75, 20.4295),
    ):
        assert value(known[name]) == pytest.approx(printed, rel=1e-4)
        assert value(known[name], corrected=True) == pytest.approx(corrected, rel=1e-4)
    assert value(known["first_critical_angle"], corrected=True) == pytest.approx(151 / 300)
    assert value(known["vitesse_seuil"]) == pytest.approx(20.4295, rel=1e-4)


def test_a_changed_premise_lists_all_that_it_refutes(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--only", "critical_angle", "--premise", "gravity x 7"]) == 1
    said = capsys.readouterr()
    assert "proved" not in said.out
    assert said.err.count("refuted: ") >= 5
    assert "critical_angle: the printed formula does not earn its verdict" in said.err


@pytest.mark.parametrize(
    "text", ["a +", "\\frac{1}{2", "\\unknown x", "(a", "a = = b", "\\sqrt 2", "a ]", "|a", "?"]
)
def test_text_that_is_no_formula_is_refused(text: str) -> None:
    with pytest.raises(NotationError):
        read(text)
