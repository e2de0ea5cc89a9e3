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
    survivors = [
        f"{what}: {mutant}"
        for what, mutant in mutation.mutants(text)
        if accepts(mutant)
        and not mutation.equivalent(text, mutant)
        and (entry.name, mutant) not in AS_GOOD
    ]
    assert survivors == []


def test_mutants_change_signs_coefficients_indices_relations_and_numbers() -> None:
    kinds = {
        what.split(" at ")[0]
        for _, _, text in (parameter.values for parameter in FORMULAS)
        for what, _ in mutation.mutants(text)
    }
    assert kinds == {
        "sign",
        "sign of the right-hand side",
        "sign of the whole",
        "coefficient",
        "index n",
        "index i",
        "index j",
        "index N",
        "relation",
        "number",
    }


def test_few_mutants_are_equivalent_and_every_formula_has_one_that_is_not() -> None:
    total = same = 0
    for parameter in FORMULAS:
        entry, _, text = parameter.values
        verdicts = [mutation.equivalent(text, mutant) for _, mutant in mutation.mutants(text)]
        assert not all(verdicts), entry.name
        total, same = total + len(verdicts), same + sum(verdicts)
    assert total >= 700
    assert same <= 0.03 * total
