"""The ledger: every statement of the paper with its verdict, and the subjects that back it."""

from __future__ import annotations

import re
from types import ModuleType

from derivations import (
    continuum,
    gaussian,
    modes,
    pivots,
    plateaus,
    procedure,
    runaway,
    scaling,
    shakedown,
    sliding_limit,
    slip,
    thresholds,
    two_sliders,
)
from derivations.proof import VERDICTS, Entry, Verification

SUBJECTS: dict[str, ModuleType] = {
    "scaling": scaling,
    "procedure": procedure,
    "modes": modes,
    "slip": slip,
    "two_sliders": two_sliders,
    "pivots": pivots,
    "plateaus": plateaus,
    "thresholds": thresholds,
    "gaussian": gaussian,
    "sliding_limit": sliding_limit,
    "continuum": continuum,
    "runaway": runaway,
    "shakedown": shakedown,
}
"""The modules, each with ``derive()``, ``check(v, results)`` and its entries."""

_SECTIONS = (
    "Sec. II A",
    "Sec. II B",
    "Sec. II C",
    "Sec. III A",
    "Sec. III B",
    "Sec. IV",
    "Sec. V",
    "Fig.",
)


def verified(subject: str) -> Verification:
    """Return what the check of a subject establishes under the assumptions of its derivation."""
    derived = SUBJECTS[subject].derive()
    verification = Verification(subject, derived.assumptions)
    SUBJECTS[subject].check(verification, derived.results)
    return verification


def subject_of(entry: Entry) -> str:
    """Return the name of the subject whose module holds an entry."""
    return next(name for name, module in SUBJECTS.items() if entry in module.ENTRIES)


def _section(entry: Entry) -> int:
    return next(k for k, name in enumerate(_SECTIONS) if entry.place.startswith(name))


def entries() -> tuple[Entry, ...]:
    """Return all entries, by section of the paper and then by subject."""
    found = tuple(entry for module in SUBJECTS.values() for entry in module.ENTRIES)
    names = [entry.name for entry in found]
    labels = [entry.label for entry in found if entry.label is not None]
    for kind in (names, labels):
        twice = {name for name in kind if kind.count(name) > 1}
        if twice:
            raise ValueError(f"more than one entry: {sorted(twice)}")
    wrong = [entry.name for entry in found if entry.verdict not in VERDICTS]
    if wrong:
        raise ValueError(f"unknown verdict: {wrong}")
    return tuple(sorted(found, key=_section))


def _without_space(text: str) -> str:
    return "".join(text.split())


def disagreements(source: str) -> list[str]:
    """Return what in the ledger does not match a source of the paper (empty: it is complete and
    verbatim).

    Parameters
    ----------
    source : str
        The LaTeX source.

    Returns
    -------
    list of str
        Entries that are not in the source but for white space, labelled equations without an entry,
        labels that the source does not have.
    """
    text = re.sub(r"(?<!\\)%.*", "", source)
    compact = _without_space(text)
    problems = [
        f"{entry.name}: not in the source: {entry.printed}"
        for entry in entries()
        if _without_space(entry.printed) not in compact
    ]
    environments = re.findall(
        r"\\begin\{(equation|eqnarray)\}(.*?)\\end\{\1\}|\\be\b(.*?)\\ee\b", text, re.DOTALL
    )
    labels = {
        label
        for _, long, short in environments
        for label in re.findall(r"\\label\{([^}]*)\}", long or short)
    }
    known = {entry.label for entry in entries() if entry.label is not None}
    problems += [f"no entry for the equation {label}" for label in sorted(labels - known)]
    problems += [f"the source has no equation {label}" for label in sorted(known - labels)]
    return problems
