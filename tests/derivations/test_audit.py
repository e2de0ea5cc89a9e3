"""The audit as a referee runs it: every subject's proofs, the ledger, the command."""

from __future__ import annotations

import ast
import json
from pathlib import Path

import pytest

from derivations.__main__ import main
from derivations.ledger import CHAPTERS, Entry, disagreements, entries, premises, proof_of, value
from derivations.model import PREMISES
from derivations.notation import NotationError, read

ROOT = Path(__file__).parents[2]
NAMED = {entry.name: entry for entry in entries()}

LABELLED_EQUATIONS = """
spring_force static_friction dynamical_friction dynamic_eq1 dynamic_eq dynamic_eqN static_eq1
static_eq static_eqN dist_mud dist_theta velocity_th_2_cycle velocity_th_2_gaussian
velocity_th_2_cycle_corrected threshold_th_2_cycle_corrected velocity_th_2_gaussienne_corrected
threshold_th_2_gaussienne_corrected critical_angle vitesse forcestatique seuil vitesse_seuil
vitesse_seuil_random vitessecontinue
"""
ACCUSED = {
    "misprint": """pivot_stability contraction_needed position_decreases critical_dilation
    first_critical_angle continuum_source critical_velocity""",
    "inconsistent": """reversal_step velocity_th_2_cycle_corrected
    velocity_th_2_gaussienne_corrected threshold_th_2_gaussienne_corrected solid_dilation
    solid_temperature dilation_rate column_threshold dilation_jumps compression_wave""",
}


@pytest.mark.parametrize("name", CHAPTERS)
def test_every_line_of_a_chapter_holds(name: str) -> None:
    proof = proof_of(name)
    assert len(proof.lines) >= 3
    assert proof.assumptions
    assert [line.text for line in proof.lines if line.fault] == []
    assert all(line.why for line in proof.lines if line.standing in ("checked", "argued"))
    assert set(proof.decisions) == {e.name for e in entries() if e.chapter == name}


@pytest.mark.parametrize("entry", entries(), ids=lambda entry: entry.name)
def test_every_entry_earns_its_verdict_and_says_why(entry: Entry) -> None:
    assert entry.faults() == []
    if entry.verdict in ACCUSED:
        assert entry.corrected
    if entry.verdict in (*ACCUSED, "approximation"):
        assert entry.error
    if entry.verdict == "convention":
        assert not entry.proved
    for part, whole in ((entry.formula, entry.printed), (entry.corrected_formula, entry.corrected)):
        assert "".join((part or "").split()) in "".join((whole or "").split())


def test_exactly_the_known_misprints_are_accused_and_every_equation_has_an_entry() -> None:
    assert {entry.label for entry in entries()} - {None} == set(LABELLED_EQUATIONS.split())
    for verdict, known in ACCUSED.items():
        assert {entry.name for entry in entries() if entry.verdict == verdict} == {*known.split()}


def test_what_rests_on_words_or_on_cases_is_not_called_proved() -> None:
    assert {e.name: e.standing for e in entries() if e.standing not in ("", "proved")} == {
        "horizontal": "argued",
        "level_chains": "argued",
        "drawn_below_dynamic": "checked",
        "insensitive_to_disorder": "checked",
        "one_percent": "checked",
    }


def test_derivations_import_nothing_from_the_package() -> None:
    for path in (ROOT / "derivations").glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom):
                names = [node.module or ""]
            assert not any(name.split(".")[0] == "exactcreep" for name in names), path.name


def test_json_is_a_list_of_objects_with_the_promised_fields(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["--json", "--only", "critical_angle"]) == 0
    (found,) = json.loads(capsys.readouterr().out)
    assert found["label"] == "critical_angle"
    assert found["verdict"] == "exact"
    assert found["proved"] is True
    promised = "label name verdict printed corrected assumptions error proved how place"
    assert set(found) == set(promised.split())


def test_show_prints_the_steps_of_one_subject(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--show", "--only", "pivots"]) == 0
    printed = capsys.readouterr().out
    assert "Pivots and critical angles" in printed
    assert "it starts downhill, F_i > mu_s c" in printed
    assert "mu_d*(1 - 2*(i - 1)/N) + (-mu_d + mu_s)/N" in printed
    assert main(["--only", "no_random_threshold"]) == 0
    reason = "[proved: the integrand is positive, and A and B fall with h]"
    assert reason in " ".join(capsys.readouterr().out.split())


def test_the_whole_audit_is_short_and_holds(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 0
    printed = capsys.readouterr().out
    assert len(printed.splitlines()) < 500
    assert f"{len(entries())} statements: 35 approximation, 19 convention, 55 exact" in printed


@pytest.mark.parametrize(
    ("arguments", "named"),
    [(["--only", "vitess"], "vitess"), (["--only", "seuil", "--paper", "none.tex"], "none.tex")],
)
def test_what_does_not_exist_is_refused(
    arguments: list[str], named: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == 2
    assert named in capsys.readouterr().err


def _source() -> str:
    """Return a source that holds every statement, labelled ones in equations."""
    form = "\\begin{{equation}}{}\\label{{{}}}\\end{{equation}}"
    return "\n\n".join(
        e.printed if e.label is None else form.format(e.printed, e.label) for e in entries()
    )


def test_a_source_is_accepted_unless_an_equation_is_changed_missing_or_new() -> None:
    assert disagreements(_source()) == []
    assert disagreements(_source().replace(" ", "\n  ")) == []
    changed = _source().replace("\\frac{\\Delta\\mu}{N}", "\\frac{\\Delta\\mu}{2N}")
    assert any(problem.startswith("critical_angle") for problem in disagreements(changed))
    unlabelled = _source().replace("\\label{seuil}", "")
    assert disagreements(unlabelled) == ["the source has no equation seuil"]
    more = _source() + "\\be a = b \\label{another} \\ee"
    assert disagreements(more) == ["no entry for the equation another"]


WITHOUT = {
    "t": """macroscopic_models thermal_expansion contraction_partner dilation_displacement
    contraction_displacement cycle_displacement plateau_range growth_with_size
    position_decreases""",
    "": """slider_mass total_length friction_order dynamical_time transit_time dynamical_time_value
    dilation time_unit length_unit natural_length_unit dist_mud drawn_below_dynamic
    random_dilation_width timesteps dist_theta dilation_jumps critical_dilation end_of_targets
    centre_of_mass two_slider_asymptote two_slider_threshold_value turning_points
    no_random_threshold friction_difference cycle_jumps gaussian_amplitude
    contraction_amplitude equivalent_width solid_stiffness chain_length
    always_random_creep hertz_stiffness janssen_pressure grain_force grain_stiffness
    grain_number column_dilation column_temperature critical_velocity""",
    "s": "spring_force integration_step critical_range",
    "g": "static_friction alpha_c_minus pivot_stability",
    "e": "free_end_upper free_end_lower",
    "fm": "dynamical_friction",
    "gfsem": "dynamic_eq1",
    "gfstm": "dynamic_eq",
    "gfsetm": """dynamic_eqN dilation_step contraction_step step half_cycle_step velocity_th_2_cycle
    velocity_th_2_gaussian one_percent reversal_step velocity_th_2_cycle_corrected
    velocity_th_2_gaussienne_corrected threshold_th_2_gaussienne_corrected balance_above
    balance_below critical_angle balance_above_contraction balance_below_contraction vitesse
    first_critical_angle vitesse_random forcestatique pull_above pull_below chain_starts
    contraction_needed seuil small_difference vitesse_seuil sigma_theta_star
    vitesse_seuil_random continuum_source vitessecontinue delta_T_star solid_dilation
    solid_temperature threshold_value largest_chain moseley croll croll_differs pipeline_walking
    sweeping_process level_chains""",
    "gse": "static_eq1",
    "gst": "static_eq",
    "gset": "static_eqN threshold_th_2_cycle_corrected rest_below_threshold",
    "c": "redraw insensitive_to_disorder",
    "gfetm": "alpha_c divergence accelerates_above stability_after_slip alpha_c_plus",
    "et": "horizontal",
    "ge": "lower_slider_starts upper_slider_stays slip_starts upper_slider_after_slip",
    "get": "ordering compression_wave column_threshold",
    "fsm": "force_drop",
    "fstm": "dilation_rate",
    "set": "threshold_of_size independent_of_contacts",
}
"""What each set of premises carries, by their initials in the order of `PREMISES`."""


def test_every_premise_refutes_what_depends_on_it_and_nothing_else() -> None:
    """Every cell of the table: all entries under all changed premises."""
    initials = dict(zip(PREMISES, "gfsetcm", strict=True))
    found: dict[str, set[str]] = {}
    for name, refuted in premises().items():
        found.setdefault("".join(initials[premise] for premise in refuted), set()).add(name)
    assert found == {carried: set(names.split()) for carried, names in WITHOUT.items()}


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


@pytest.mark.parametrize(
    "text", ["a +", "\\frac{1}{2", "\\unknown x", "(a", "a = = b", "\\sqrt 2", "a ]", "|a", "?"]
)
def test_text_that_is_no_formula_is_refused(text: str) -> None:
    with pytest.raises(NotationError):
        read(text)
