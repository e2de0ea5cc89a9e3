"""That a sentence is no stronger than its check: numbers, signs and premises are held, too."""

from __future__ import annotations

from collections.abc import Callable
from hashlib import sha256
from typing import Any

import pytest
import sympy as sp

from derivations import beyond, gaussian, modes, shakedown, sliding_limit, slip, two_sliders, unlike
from derivations.ledger import Entry, entries, entry_of
from derivations.notation import N, symbol
from derivations.proof import Line
from tests.derivations import mutants as mutation
from tests.derivations.statements import survivors

NAMED = {entry.name: entry for entry in entries()}


def test_a_hundred_changed_statements_are_noticed() -> None:
    total, left = survivors(38)
    assert total > 600
    as_good = [(name, text) for name, text in left for owner, other in AS_GOOD
               if name == owner and f"«{other}»" in text]  # fmt: skip
    assert left == as_good


def test_equations_and_quotations_are_those_that_were_held_against_the_paper() -> None:
    """After one has changed: hold it against the source with `--paper`, and renew this."""
    quoted = "\n".join("".join(f"{e.label}{e.number}{e.printed}".split()) for e in entries())
    assert sha256(quoted.encode()).hexdigest()[:16] == "68ed46edcdd24ede"


@pytest.mark.parametrize(
    ("key", "text", "fault"),
    [
        ("error", "relative 1/N", "nothing judges"),
        ("error", "relative {nothing_computes_this}", "cannot be decided"),
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


# --- checks that must refuse ----------------------------------------------------------------------

SINE, MOVE = sp.sin(slip.w * slip.t), slip.derive().last
FIXED, FREE, EDGE = modes.KINDS[0], modes.KINDS[1], modes.SINE
LEFT, RIGHT = EDGE.subs(modes.n, 0), EDGE.subs(modes.n, modes.p + 1)
TOTAL = modes.p / 2 - (sp.sin((2 * modes.p + 1) * modes.phi) - sp.sin(modes.phi)) / (
    4 * sp.sin(modes.phi)
)
PERIOD, NEAR, FAR = 2 * modes.p + 2, sp.Integer(2), 2 * modes.p
FRONT, PAIR = sliding_limit.derive(), two_sliders.derive()
PUSH, PULL, PASSED, BACK = FRONT.outer, FRONT.behind, PAIR.passed, PAIR.back
A, B = gaussian.A, gaussian.B
ROOM = [shakedown.first - shakedown.L, shakedown.inner, shakedown.last - shakedown.L]
WHOLE = [shakedown.first, shakedown.inner, shakedown.last]
FORCE = N * symbol("s")
SHARED = [FORCE / sum(ROOM) * part for part in ROOM]
HOLDS, BROKEN = Line("holds"), Line("does not", decide=lambda: False)
WORK = beyond.speed * beyond.gap


@pytest.mark.parametrize(
    ("check", "held", "refused"),
    [
        (slip.positive_until_its_end, (slip.a0 * SINE,),
         [(-slip.a0 * SINE,), (slip.a0 * sp.sin(2 * slip.w * slip.t),), (slip.t * SINE,)]),
        (sliding_limit.pulls, (PUSH, PULL),
         [(PULL, PULL), (PUSH, PUSH), (PULL, PUSH), (PUSH, 0 * PULL)]),
        (modes.different, (FIXED.angle, FIXED.first),
         [(FIXED.angle, -1), (-FIXED.angle, 1), (2 * FIXED.angle, 1)]),
        (modes.ends_match, (LEFT, RIGHT, FIXED.turn),
         [(LEFT, RIGHT, FREE.turn), (EDGE.subs(modes.n, 1), RIGHT, FIXED.turn)]),
        (modes.sums_up, (TOTAL, EDGE, FIXED.turn, FIXED.square),
         [(TOTAL, EDGE, FIXED.turn, 2 * FIXED.square), (2 * TOTAL, EDGE, FIXED.turn,
         2 * FIXED.square), (TOTAL + 1, EDGE, FIXED.turn, FIXED.square + 1)]),
        (modes.images, (1, PERIOD, NEAR, FAR),
         [(-1, PERIOD, NEAR, FAR), (1, PERIOD, sp.Integer(0), FAR), (1, PERIOD, NEAR, FAR + 2),
          (1, PERIOD + 1, NEAR, FAR)]),
        (gaussian.rising, (A * B / (A + B),), [(-A * B,), (A / B,), (B / A,), (A - B,)]),
        (two_sliders.staircase, (PASSED, BACK, MOVE),
         [(PASSED, BACK + 3 * MOVE, MOVE), (BACK, PASSED, MOVE), (PASSED - 3 * MOVE, BACK, MOVE)]),
        (shakedown.at_rest, (SHARED, ROOM, FORCE),
         [([FORCE / sum(WHOLE) * part for part in WHOLE], ROOM, FORCE),
          (SHARED, ROOM, 2 * FORCE)]),
        (unlike.within_steps, (sp.Max,),
         [(sp.Add,), (lambda *both: 2 * sp.Max(*both),), (lambda one, other: one - other,)]),
        (beyond.in_the_normal_cone, ([HOLDS], WORK),
         [([HOLDS, BROKEN], WORK), ([HOLDS], -WORK)]),
    ],
    ids=lambda part: getattr(part, "__name__", ""),
)  # fmt: skip
def test_a_check_holds_what_is_right_and_refuses_what_is_nearly_right(
    check: Callable[..., bool], held: tuple[Any, ...], refused: list[tuple[Any, ...]]
) -> None:
    assert check(*held)
    assert not any(check(*wrong) for wrong in refused)


AS_GOOD = {
    ("column_temperature", "2"): "1.5 K is of the order of 2 K as well as of 1 K",
    (
        "column_dilation",
        "A_\\theta^* \\sim 6\\,10^{-6}",
    ): "4.6e-6 is, by the rule of estimates, either",
    ("one_percent", "101"): "about 100",
}
"""Mutants that are other roundings of the same order of magnitude."""

FORMULAS = [
    pytest.param(entry, place, text, id=f"{entry.name}-{place}")
    for entry in entries()
    for place, text in [(None, entry.formula), *enumerate(entry.corrected_formulas)]
    if text is not None
]
"""Printed formulas, and corrected ones by their place."""


@pytest.mark.parametrize(("entry", "place", "text"), FORMULAS)
def test_no_mutant_of_a_formula_passes_its_check(
    entry: Entry, place: int | None, text: str
) -> None:
    def accepts(formula: str) -> bool:
        if place is None:
            return entry.accepts_printed(formula)
        return entry.accepts_corrected(formula, place=place)

    assert accepts(text)
    made = list(mutation.mutants(text))
    accepted = [(what, mutant) for what, mutant in made if accepts(mutant)]
    assert len(accepted) < len(made)
    for what, mutant in accepted:
        as_good = mutation.equivalent(text, mutant) or (entry.name, mutant) in AS_GOOD
        assert as_good, f"{what}: {mutant}"
