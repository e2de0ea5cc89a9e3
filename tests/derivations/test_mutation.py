"""A changed sign, coefficient, index, relation or number in any formula is noticed."""

from __future__ import annotations

import pytest

from derivations.ledger import Entry, entries
from tests.derivations import mutants as mutation

AS_GOOD = {
    ("column_temperature", "2"): "1.5 K is of the order of 2 K as well as of 1 K",
    ("one_percent", "101"): "about 100",
}
"""Mutants that are other roundings of the same order of magnitude."""

FORMULAS = [
    pytest.param(entry, kind, text, id=f"{entry.name}-{kind}")
    for entry in entries()
    for kind, text in (("printed", entry.formula), ("corrected", entry.corrected_formula))
    if text is not None
]


@pytest.mark.parametrize(("entry", "kind", "text"), FORMULAS)
def test_no_mutant_of_a_formula_passes_its_check(entry: Entry, kind: str, text: str) -> None:
    accepts = entry.accepts_printed if kind == "printed" else entry.accepts_corrected
    assert accepts(text)
    made = list(mutation.mutants(text))
    accepted = [(what, mutant) for what, mutant in made if accepts(mutant)]
    assert len(accepted) < len(made)
    for what, mutant in accepted:
        as_good = mutation.equivalent(text, mutant) or (entry.name, mutant) in AS_GOOD
        assert as_good, f"{what}: {mutant}"


def test_mutants_change_signs_coefficients_indices_relations_and_numbers() -> None:
    made = [what for formula in FORMULAS for what, _ in mutation.mutants(formula.values[2])]
    assert len(made) >= 700
    assert {what.split(" at ")[0] for what in made} == {
        "sign", "sign of the right-hand side", "sign of the whole", "coefficient", "index n",
        "index i", "index j", "index N", "relation", "number",
    }  # fmt: skip
