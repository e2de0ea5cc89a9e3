"""That a sentence is no stronger than its check: numbers, signs and premises are held, too."""

from __future__ import annotations

from hashlib import sha256

import pytest
import sympy as sp

from derivations import beyond, gaussian, modes, shakedown, sliding_limit, slip, two_sliders
from derivations.judges import both
from derivations.ledger import CHAPTERS, entries, entry_of
from derivations.model import MODEL, Model, T
from derivations.notation import N, mu_d, read, symbol
from derivations.proof import Line
from tests.derivations.statements import DERIVATIONS, literals_of, survivors

NAMED = {entry.name: entry for entry in entries()}
AS_GOOD = {("column_temperature", "2"), ("one_percent", "101")}
"""Other roundings of the same order of magnitude, as in test_mutation."""


def test_a_hundred_changed_statements_are_noticed() -> None:
    total, left = survivors(38)
    assert total > 600
    assert [(m.owner, m.became) for m in left if not _as_good(m.owner, m.became)] == []


def _as_good(owner: str, became: str) -> bool:
    return any(owner == name and f"«{other}»" in became for name, other in AS_GOOD)


@pytest.mark.parametrize("name", CHAPTERS)
def test_a_line_that_is_proved_or_checked_computes_the_numbers_of_its_sentence(name: str) -> None:
    assert list(literals_of(DERIVATIONS / f"{name}.py")) == []


def test_quotations_are_those_that_were_held_against_the_paper() -> None:
    """After a quotation has changed: hold it against the source with `--paper`, and renew this."""
    quoted = "\n".join("".join(entry.printed.split()) for entry in entries())
    assert sha256(quoted.encode()).hexdigest()[:16] == "02375437d7d1ca0c"


@pytest.mark.parametrize(
    ("key", "text", "fault"),
    [
        ("error", "relative 1/N", "nothing judges"),
        ("error", "relative {nothing_computes_this}", "cannot be decided"),
        ("why", "twice m, 2 m", "nothing judges"),
        ("if", ["continuous slidings"], "nothing is known as the premise"),
        ("corrected", "«\\tan \\alpha_{N,i}^* = \\mu_\\mathrm{d}»", "does not follow"),
        ("by", "", "go together"),
    ],
)
def test_a_text_that_nothing_carries_refutes_its_entry(key: str, text: object, fault: str) -> None:
    entry = NAMED["critical_angle"]
    assert entry.faults() == []
    changed = entry_of(entry.key, dict(entry.raw) | {key: text}, entry.place)
    assert any(fault in found for found in changed.faults())


def test_all_corrected_formulas_are_judged_each_by_its_own_judge() -> None:
    entry = NAMED["vitesse_random"]
    for wrong, right in (("(N + 4", "(N + 3"), ("{3 \\tilde", "{2 \\tilde")):
        text = entry.raw["corrected"]
        assert right in text
        changed = entry_of(
            entry.key, dict(entry.raw) | {"corrected": text.replace(right, wrong)}, ""
        )
        assert changed.faults() != []


# --- checks that must refuse ----------------------------------------------------------------------


def test_a_speed_that_changes_sign_or_shape_is_not_positive_until_its_end() -> None:
    sine = sp.sin(slip.w * slip.t)
    assert slip.positive_until_its_end(slip.a0 * sine)
    for wrong in (-slip.a0 * sine, slip.a0 * sp.sin(2 * slip.w * slip.t), slip.t * sine):
        assert not slip.positive_until_its_end(wrong)


def test_a_front_that_does_not_turn_push_into_pull_is_refused() -> None:
    proof = sliding_limit.derive()
    push, pull = proof.outer, proof.behind
    assert sliding_limit.pulls(push, pull)
    for before, behind in ((pull, pull), (push, push), (pull, push), (push, 0 * pull)):
        assert not sliding_limit.pulls(before, behind)


def test_a_leading_term_has_to_be_both_the_plateau_and_the_limit_of_the_law() -> None:
    held, refused = (lambda formula: True), (lambda formula: False)
    formula = read("x = 1")
    assert both(held, held)(formula)
    assert not any(both(*judges)(formula) for judges in ((held, refused), (refused, held)))
    entry = NAMED["vitesse"]
    assert entry.accepts_printed(entry.formula or "")
    same_limit = f"{entry.formula} + \\frac{{\\tilde{{l}}_0}}{{2}}"
    assert not entry.accepts_printed(same_limit)


def test_angles_and_shapes_of_other_ends_are_refused() -> None:
    fixed, free = modes.KINDS[0], modes.KINDS[1]
    assert modes.different(fixed.angle, fixed.first)
    assert not modes.different(fixed.angle, -1)  # the lowest is below zero
    assert not modes.different(-fixed.angle, 1)
    assert not modes.different(2 * fixed.angle, 1)  # the highest is above pi
    edge = modes.SINE
    left, right = edge.subs(modes.n, 0), edge.subs(modes.n, modes.p + 1)
    assert modes.ends_match(left, right, fixed.turn)
    assert not modes.ends_match(left, right, free.turn)
    assert not modes.ends_match(edge.subs(modes.n, 1), right, fixed.turn)
    total = modes.p / 2 - (sp.sin((2 * modes.p + 1) * modes.phi) - sp.sin(modes.phi)) / (
        4 * sp.sin(modes.phi)
    )
    assert modes.sums_up(total, edge, fixed.turn, fixed.square)
    assert not modes.sums_up(total, edge, fixed.turn, 2 * fixed.square)
    assert not modes.sums_up(total + 1, edge, fixed.turn, fixed.square + 1)
    assert not modes.sums_up(2 * total, edge, fixed.turn, 2 * fixed.square)


def test_images_that_add_or_are_farther_are_refused() -> None:
    period, near, far = 2 * modes.p + 2, sp.Integer(2), 2 * modes.p
    assert modes.images(1, period, near, far)
    assert not modes.images(-1, period, near, far)
    assert not modes.images(1, period, sp.Integer(0), far)
    assert not modes.images(1, period, near, far + 2)
    assert not modes.images(1, period + 1, near, far)


def test_an_integrand_that_falls_or_is_negative_is_refused() -> None:
    A, B = gaussian.A, gaussian.B
    assert gaussian.rising(A * B / (A + B))
    for wrong in (-A * B, A / B, B / A, A - B):
        assert not gaussian.rising(wrong)


def test_a_staircase_with_other_steps_is_refused() -> None:
    proof = two_sliders.derive()
    passed, back = proof.passed, proof.back
    move = slip.derive().last
    assert two_sliders.staircase(passed, back, move)
    assert not two_sliders.staircase(passed, back + 3 * move, move)
    assert not two_sliders.staircase(back, passed, move)
    assert not two_sliders.staircase(passed - 3 * move, back, move)


def test_forces_that_leave_no_room_for_the_ramp_are_refused() -> None:
    first, inner, last, L = shakedown.first, shakedown.inner, shakedown.last, shakedown.L
    total = N * symbol("s")
    room = [first - L, inner, last - L]
    share = total / sum(room)
    assert shakedown.at_rest([share * part for part in room], room, total)
    whole = [first, inner, last]
    other = total / sum(whole)  # L taken out of the share
    assert not shakedown.at_rest([other * part for part in whole], room, total)
    assert not shakedown.at_rest([share * part for part in room], room, 2 * total)


def test_the_nested_ranges_and_the_normal_cone_need_each_of_their_conditions(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert sliding_limit.nested()
    for wrong in (
        lambda value, least, most: sp.Min(value, most),
        lambda value, least, most: sp.Max(value, least),
        lambda value, least, most: value,
    ):
        monkeypatch.setattr(sliding_limit, "clamped", wrong)
        assert not sliding_limit.nested()
    work = beyond.speed * beyond.gap
    held, broken = Line("holds"), Line("does not", decide=lambda: False)
    assert beyond.in_the_normal_cone([held], work)
    assert not beyond.in_the_normal_cone([held, broken], work)
    assert not beyond.in_the_normal_cone([held], -work)


def test_a_tension_that_changes_by_different_steps_is_refused() -> None:
    class Uneven(Model):
        def force(self, slider: sp.Expr) -> sp.Expr:
            return slider * mu_d + T(slider) - T(slider - 1)

    with pytest.raises(ValueError, match="different steps"):
        Uneven().tension(N, 0, 1)
    assert not MODEL.tension(N, 0, 1).has(T)
