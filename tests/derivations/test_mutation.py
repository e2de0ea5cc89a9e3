"""A changed sign, coefficient, index, relation or number in any formula is noticed."""

from __future__ import annotations

import pytest

from derivations.ledger import Entry, entries
from tests.derivations import mutants as mutation

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
