"""The ledger: every statement of the paper with its verdict, and the chapters that back it."""

from __future__ import annotations

import re
from types import ModuleType

import sympy as sp

from derivations import (
    beyond,
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
from derivations.entry import LEDGER, Entry
from derivations.model import MODEL, PREMISES, Model
from derivations.notation import c, mu_d, mu_s, read, s, symbol
from derivations.proof import VERDICTS, Proof

CHAPTERS: dict[str, ModuleType] = {
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
    "beyond": beyond,
}
"""The modules, each with ``derive(model)`` and its entries."""


def proof_of(chapter: str, model: Model = MODEL) -> Proof:
    """Return a chapter's lines under a model."""
    proof: Proof = CHAPTERS[chapter].derive(model)
    return proof


def entries() -> tuple[Entry, ...]:
    """Return all entries, in the order of the paper."""
    found = {entry.name: entry for module in CHAPTERS.values() for entry in module.ENTRIES}
    if set(found) != set(LEDGER):
        raise ValueError(f"in the ledger or in a chapter only: {sorted(set(found) ^ set(LEDGER))}")
    wrong = [entry.name for entry in found.values() if entry.verdict not in VERDICTS]
    if wrong:
        raise ValueError(f"unknown verdict: {wrong}")
    return tuple(found[name] for name in LEDGER)


def premises() -> dict[str, list[str]]:
    """Return, for every entry, the premises without which it is refuted."""
    return {
        entry.name: [name for name, model in PREMISES.items() if entry.faults(model)]
        for entry in entries()
    }


CAPTIONS = {
    "N": 30,
    "i": 9,
    "l_0": 1000,
    "mu_d": "1/2",
    "mu_s": "3/5",
    "sigma_mu": "1/100",
    "A_theta": "1/200",
    "sigma_theta": "1/100",
    "Delta_theta": "1/100",
    "tau_th": 1,
    "m": 1,
    "g": 1,
    "kappa": "1/100000",
}
"""The captions' parameters (tan(alpha) = 1/4), with m = g = tau_th = 1."""
SOLID = {"g": "9.81", "rho": 10**4, "L": "0.01", "Y": 10**11}
"""The paper's solid, in SI units."""


def value(entry: Entry, corrected: bool = False) -> float | None:
    """Return what a formula says at the captions' parameters; None: it says no number."""
    text = entry.corrected_formula if corrected else entry.formula
    if text is None:
        return None
    cosine = 1 / sp.sqrt(1 + sp.Rational(1, 16))
    few = {"N": 2, "i": 2} if entry.place.startswith("Sec. III A") else {}
    numbers = CAPTIONS | few | (SOLID if entry.chapter == "continuum" else {})
    given = {symbol(name): sp.Rational(number) for name, number in numbers.items()}
    for side in read(text).bound({symbol("Delta_mu"): mu_s - mu_d}).sides:
        number = sp.N(side.subs(given).subs({c: cosine, s: cosine / 4}))
        if number.is_number:
            return float(number)
    return None


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
        if not entry.place.startswith("Beyond") and _without_space(entry.printed) not in compact
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
