"""The audit as a referee runs it: every subject's proofs, the ledger, the command."""

from __future__ import annotations

import ast
import json
import re
from pathlib import Path

import pytest

from derivations import ledger
from derivations.__main__ import main
from derivations.ledger import (
    CHAPTERS,
    EQUATIONS,
    Entry,
    by_number,
    disagreements,
    entries,
    gaps,
    premises,
    proof_of,
    value,
)
from derivations.model import ASSUMED, PREMISES
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
    first_critical_angle continuum_source critical_velocity units_of_force
    caption_of_plateaus""",
    "inconsistent": """reversal_step velocity_th_2_cycle_corrected
    velocity_th_2_gaussienne_corrected threshold_th_2_gaussienne_corrected solid_dilation
    solid_temperature dilation_rate column_threshold dilation_jumps compression_wave divergence
    divergence_of_chains""",
}


STANDING = {
    "judged": """total_length spring_force free_end_upper free_end_lower dynamical_time transit_time
    lower_slider_starts upper_slider_stays slip_starts upper_slider_after_slip pivot_stability
    critical_range cycle_jumps contraction_amplitude solid_stiffness chain_length""",
    "checked": """dynamical_time_value dynamical_time_upper drawn_below_dynamic divergence
    two_slider_threshold_value one_percent insensitive_to_disorder solid_dilation
    solid_temperature threshold_value glass_expansion column_dilation column_temperature
    experimental_temperature""",
    "argued": """horizontal excellent_agreement level_chains locked_ends""",
}
"""The entries that are not proved line by line."""
IN_WORDS = """
macroscopic_models dilation_jumps angle_independent mild_increase rest_below_threshold
no_random_threshold number_of_plateaus dilation_rate decreasing_angle compression_wave
threshold_of_size excellent_agreement insensitive_to_disorder croll_differs
independent_of_contacts stability_of_size growth_with_size always_random_creep
position_decreases independent_of_grains critical_velocity sweeping_process level_chains
"""
"""Those without a formula that is judged: sentences, and the lines that they rest on."""


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
    parts = [(entry.formula or "", entry.printed)]
    parts += [(formula, entry.corrected or "") for formula in entry.corrected_formulas]
    for part, whole in parts:
        assert "".join(part.split()) in "".join(whole.split())


def test_exactly_the_known_misprints_are_accused_and_every_equation_has_an_entry() -> None:
    assert {entry.label for entry in entries()} - {None} == set(LABELLED_EQUATIONS.split())
    for verdict, known in ACCUSED.items():
        assert {entry.name for entry in entries() if entry.verdict == verdict} == {*known.split()}


def test_what_rests_on_words_or_on_cases_is_not_called_proved() -> None:
    found: dict[str, set[str]] = {}
    for entry in entries():
        if entry.standing not in ("", "proved"):
            found.setdefault(entry.standing, set()).add(entry.name)
            assert not entry.proved
    assert found == {standing: set(names.split()) for standing, names in STANDING.items()}
    words = {e.name for e in entries() if not e.judged and e.verdict != "convention"}
    assert words == set(IN_WORDS.split())


def test_what_is_read_names_equations_by_the_paper_s_numbers() -> None:
    numbers = {entry.name: entry.number for entry in entries() if entry.number}
    assert by_number("as Eq. (seuil), Eq. (no_label)") == "as Eq. 22, Eq. (no_label)"
    for entry in entries():
        for said in (entry.corrected, entry.error, entry.measured, entry.how):
            named = re.findall(r"Eq\. \((\w+)\)", said or "")
            assert [label for label in named if label in numbers] == []


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
    assert found["verdict"] == "approximation"
    assert found["proved"] is True
    promised = """label name number verdict printed corrected assumptions error measured standing
        judged proved how place"""
    assert set(found) == set(promised.split())
    assert main(["--json", "--only", "solid_dilation"]) == 0
    (found,) = json.loads(capsys.readouterr().out)
    assert (found["standing"], found["proved"]) == ("checked", False)


def test_show_prints_the_steps_of_one_subject(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--show", "--only", "pivots"]) == 0
    printed = capsys.readouterr().out
    assert "Pivots and critical angles" in printed
    assert "it starts downhill, its force above c*mu_s" in printed
    assert "mu_d*(1 - 2*(i - 1)/N) + (-mu_d + mu_s)/N [proved]   Eq. 19" in printed
    assert main(["--only", "no_random_threshold"]) == 0
    reason = "[proved: the integrand is positive and grows with A and with B, which fall with h]"
    assert reason in " ".join(capsys.readouterr().out.split())


def test_the_whole_audit_is_short_and_holds(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 0
    printed = capsys.readouterr().out
    assert len(printed.splitlines()) < 500
    assert f"{len(entries())} statements: 43 approximation, 19 convention, 60 exact" in printed


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


def test_every_numbered_equation_is_asked_for_whether_it_has_a_label_or_not(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert gaps() == []
    source = _source()
    for lost in ("delta_T_star", "thermal_expansion", "seuil"):
        left = tuple(entry for entry in entries() if entry.name != lost)
        monkeypatch.setattr(ledger, "entries", lambda left=left: left)
        number = NAMED[lost].number
        assert gaps() == [f"Eq. ({number}) has 0 entries"]
        problems = disagreements(source)
        assert any(problem.startswith(f"Eq. ({number}) has 0 entries") for problem in problems)
        monkeypatch.undo()


WORDS = "gravity friction springs ends theta kept static overshoot stick accelerate"
WITHOUT = {
    "gravity friction springs ends theta static overshoot stick accelerate": """
    macroscopic_models velocity_th_2_gaussian two_slider_threshold_value one_percent
    velocity_th_2_gaussienne_corrected threshold_th_2_gaussienne_corrected caption_of_plateaus
    balance_above balance_below critical_angle balance_above_contraction
    balance_below_contraction vitesse first_critical_angle vitesse_random compression_wave
    forcestatique units_of_force pull_above pull_below chain_starts contraction_needed seuil
    small_difference vitesse_seuil sigma_theta_star vitesse_seuil_random croll_differs
    continuum_source vitessecontinue delta_T_star solid_dilation solid_temperature
    threshold_value growth_with_size largest_chain moseley croll pipeline_walking level_chains""",
    "": """
    slider_mass total_length friction_order dynamical_time transit_time dynamical_time_value
    dynamical_time_upper dilation time_unit length_unit natural_length_unit dist_mud
    drawn_below_dynamic random_dilation_width timesteps dist_theta end_of_targets centre_of_mass
    two_slider_asymptote turning_points no_random_threshold friction_difference cycle_jumps
    gaussian_amplitude contraction_amplitude equivalent_width solid_stiffness chain_length
    always_random_creep hertz_stiffness janssen_pressure grain_force grain_stiffness
    grain_number independent_of_grains glass_expansion column_dilation column_temperature
    experimental_temperature critical_velocity""",
    "theta": """
    thermal_expansion critical_dilation number_of_plateaus divergence_of_chains
    contraction_partner dilation_displacement contraction_displacement cycle_displacement
    plateau_range position_decreases""",
    "springs": """
    spring_force integration_step""",
    "gravity": """
    static_friction alpha_c_minus pivot_stability""",
    "ends": """
    free_end_upper free_end_lower""",
    "friction static": """
    dynamical_friction""",
    "gravity friction springs ends static": """
    dynamic_eq1""",
    "gravity friction springs theta static": """
    dynamic_eq""",
    "gravity friction springs ends theta static": """
    dynamic_eqN sweeping_process no_lasting_creep""",
    "gravity springs ends": """
    static_eq1 at_rest""",
    "gravity springs theta": """
    static_eq""",
    "gravity springs ends theta": """
    static_eqN""",
    "kept": """
    redraw insensitive_to_disorder""",
    "friction static overshoot": """
    dilation_jumps continuous_sliding""",
    "gravity friction ends theta static": """
    alpha_c accelerates_above""",
    "gravity friction ends theta static overshoot": """
    divergence stability_after_slip alpha_c_plus""",
    "ends theta": """
    horizontal""",
    "gravity friction springs ends theta static overshoot": """
    dilation_step contraction_step step angle_independent half_cycle_step velocity_th_2_cycle
    reversal_step velocity_th_2_cycle_corrected threshold_th_2_cycle_corrected
    rest_below_threshold""",
    "gravity ends": """
    lower_slider_starts upper_slider_stays slip_starts upper_slider_after_slip""",
    "gravity ends theta": """
    ordering""",
    "friction springs static overshoot": """
    force_drop""",
    "gravity friction springs static overshoot": """
    mild_increase""",
    "friction springs theta static overshoot": """
    dilation_rate""",
    "gravity friction springs theta static overshoot stick accelerate": """
    decreasing_angle""",
    "springs stick accelerate": """
    critical_range""",
    "springs ends theta overshoot stick accelerate": """
    threshold_of_size independent_of_contacts stability_of_size""",
    "springs theta overshoot stick accelerate": """
    excellent_agreement""",
    "gravity ends theta accelerate": """
    column_threshold""",
    "gravity friction springs ends static overshoot": """
    locked_ends""",
}
"""What each set of premises carries, by a word of each in the order of `PREMISES`."""


@pytest.fixture(scope="module")
def refuting() -> dict[str, list[str]]:
    return premises()


@pytest.mark.slow
def test_every_premise_refutes_what_depends_on_it_and_nothing_else(
    refuting: dict[str, list[str]],
) -> None:
    """Every cell of the table: all entries under all changed premises."""
    named = dict(zip(PREMISES, WORDS.split(), strict=True))
    found: dict[str, set[str]] = {}
    for name, refuted in refuting.items():
        found.setdefault(" ".join(named[premise] for premise in refuted), set()).add(name)
    assert found == {carried: set(names.split()) for carried, names in WITHOUT.items()}


@pytest.mark.slow
def test_an_entry_says_that_sliding_is_continuous_and_without_inertia_iff_it_needs_it(
    refuting: dict[str, list[str]],
) -> None:
    tied = set(ASSUMED.values()) - {""}
    assert tied == {"sliders that stick and slip", "fronts that accelerate"}
    for entry in entries():
        assumed = {ASSUMED[assumption] for assumption in entry.assumptions} - {""}
        assert assumed == tied & set(refuting[entry.name]), entry.name


@pytest.mark.slow
def test_the_table_of_premises_that_the_book_keeps_is_the_one_that_is_computed(
    refuting: dict[str, list[str]],
) -> None:
    kept = json.loads((ROOT / "notebooks/reference/premises.json").read_text(encoding="utf-8"))
    assert kept["refuted without"] == refuting


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
