"""The ledger: every statement of the paper with its verdict, and the chapters that back it."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path

import sympy as sp

from derivations.judges import Judge
from derivations.model import MODEL, PREMISES, Model
from derivations.notation import CAPTIONS, SOLID, N, NotationError, i, read
from derivations.proof import STANDINGS, Decision, Proof

NAMES = (
    "scaling procedure modes slip two_sliders pivots plateaus thresholds sliding_limit gaussian "
    "continuum runaway shakedown beyond"
)
CHAPTERS = {name: import_module(f"derivations.{name}") for name in NAMES.split()}
"""The modules, each with ``derive(model)``."""


def proof_of(chapter: str, model: Model = MODEL) -> Proof:
    """Return a chapter's lines under a model."""
    proof: Proof = CHAPTERS[chapter].derive(model)
    return proof


@dataclass(frozen=True)
class Entry:
    """What the audit says of one statement of the paper.

    Attributes
    ----------
    name : str
        A name of its own (the label, where the paper has one).
    chapter : str
        The module that backs it.
    verdict : str
        ``exact``: follows from the model; ``approximation``: leading term of what follows;
        ``misprint``; ``inconsistent``: contradicts the model or the paper's own law;
        ``convention``: a definition or a choice.
    place, printed, label, number, corrected, error, assumptions, why
        As the ledger has them.
    formula, corrected_formula : str or None
        The parts of `printed` and `corrected` that are judged.
    repair : tuple of str
        What must be replaced by what in `formula` (and what appended) to make it follow.
    law : mapping
        The functions of the package that say it: ``printed``, ``corrected`` and ``exact``.
    """

    name: str
    chapter: str
    place: str
    printed: str
    verdict: str
    label: str | None
    number: int | None
    corrected: str | None
    error: str | None
    assumptions: tuple[str, ...]
    why: str
    formula: str | None
    corrected_formula: str | None
    repair: tuple[str, ...]
    law: Mapping[str, str]

    def decision(self, model: Model = MODEL) -> Decision:
        """Return what decides the entry under a model."""
        missed = Decision(None, None, False, [], [])  # the derivation did not reach it
        return proof_of(self.chapter, model).decisions.get(self.name, missed)

    def accepts_printed(self, text: str, model: Model = MODEL) -> bool:
        """Return whether `text` in the place of the printed formula would earn the same verdict."""
        judge = self.decision(model).printed
        if not self.repair:
            return _accepts(judge, text)
        wrong, right, *appended = self.repair
        repaired = text.replace(wrong, right) + "".join(appended)
        once = text.count(wrong) == 1
        return once and not _accepts(judge, text) and _accepts(judge, repaired)

    def accepts_corrected(self, text: str, model: Model = MODEL) -> bool:
        """Return whether `text` in the place of the corrected formula follows."""
        decision = self.decision(model)
        return _accepts(decision.corrected or decision.printed, text)

    def _doubts(self, model: Model) -> Iterator[str]:
        decision = self.decision(model)
        if decision.printed and self.formula and not self.accepts_printed(self.formula, model):
            yield "the printed formula does not earn its verdict"
        if self.corrected_formula and not self.accepts_corrected(self.corrected_formula, model):
            yield "the corrected formula does not follow"
        if not (decision.holds() if callable(decision.holds) else decision.holds):
            yield "the evidence does not bear out the verdict"
        for line in decision.lines:
            if line.fault:
                yield f"it rests on: {line.text}"

    def faults(self, model: Model = MODEL) -> list[str]:
        """Return why the verdict does not hold under a model (empty: it does)."""
        try:
            return [f"{self.name}: {doubt}" for doubt in self._doubts(model)]
        except Exception as trouble:  # a changed premise may leave nothing to compare
            return [f"{self.name}: cannot be decided: {trouble!r}"]

    @property
    def standing(self) -> str:
        """The weakest standing of what it rests on; empty for a definition or a choice."""
        if self.verdict == "convention":
            return ""
        used = {line.standing for line in self.decision().lines}
        return next((word for word in reversed(STANDINGS) if word in used), "proved")

    @property
    def proved(self) -> bool:
        return self.standing == "proved"

    @property
    def how(self) -> str:
        """The chapter, and the argument or the line that the entry rests on."""
        last = "".join(line.text.rstrip(" =:") for line in self.decision().lines[-1:])
        return f"{self.chapter}: {self.why or last}"

    def as_json(self) -> dict[str, object]:
        """Return the entry as a JSON object."""
        keys = "label name place verdict printed corrected error proved how"
        said = {key: getattr(self, key) for key in keys.split()}
        return said | {"assumptions": list(self.assumptions)}


def _accepts(judge: Judge | None, text: str) -> bool:
    if judge is None:
        raise ValueError("there is no formula to judge")
    try:
        return bool(judge(read(text)))
    except NotationError:
        return False


def _marked(text: str | None) -> tuple[str | None, str | None]:
    """Return a text without its marks, and the part between them."""
    if text is None or "«" not in text:
        return text, None
    before, _, rest = text.partition("«")
    formula, _, after = rest.partition("»")
    return before + formula + after, formula


@cache
def entries() -> tuple[Entry, ...]:
    """Return all entries, in the order of the paper."""
    ledger = tomllib.loads((Path(__file__).parent / "ledger.toml").read_text(encoding="utf-8"))
    place, made = "", []
    for key, said in ledger.items():
        verdict, chapter, name = re.split(r": |\.", key)
        place = said.get("place", place)  # that of the entry before, unless it is said
        number = said.get("equation")
        printed, formula = _marked(said.get("printed"))
        if printed is None:
            printed, formula = said["formula"], said["formula"].strip("$")
        corrected, corrected_formula = _marked(said.get("corrected"))
        entry = Entry(
            name=name,
            chapter=chapter,
            place=place,
            printed=printed,
            verdict=verdict,
            label=name if number and said.get("label", True) else None,
            number=number,
            corrected=corrected,
            error=said.get("error"),
            assumptions=tuple(said.get("if", ())),
            why=said.get("why", ""),
            formula=formula,
            corrected_formula=corrected_formula,
            repair=tuple(said.get("repair", ())),
            law=said.get("law", {}),
        )
        made.append(entry)
    return tuple(made)


def premises() -> dict[str, list[str]]:
    """Return, for every entry, the premises without which it is refuted."""
    return {
        entry.name: [name for name, model in PREMISES.items() if entry.faults(model)]
        for entry in entries()
    }


def value(entry: Entry, corrected: bool = False) -> float | None:
    """Return what a formula says at the captions' parameters; None: it says no number."""
    text = entry.corrected_formula if corrected else entry.formula
    if text is None:
        return None
    given = dict(CAPTIONS)
    if entry.place.startswith("Sec. III A"):
        given |= {N: 2, i: 2}
    if entry.chapter == "continuum":
        given |= SOLID
    for side in read(text).bound({}).sides:
        number = sp.N(side.subs(given))
        if number.is_number:
            return float(number)
    return None


def _without_space(text: str) -> str:
    return "".join(text.split())


def disagreements(source: str) -> list[str]:
    """Return what in the ledger does not match a LaTeX source of the paper.

    Entries that are not in the source but for white space, labelled equations without an entry,
    and labels that the source does not have; empty: the ledger is complete and verbatim.
    """
    text = re.sub(r"(?<!\\)%.*", "", source)
    compact = _without_space(text)
    paper = [entry for entry in entries() if not entry.place.startswith("Beyond")]
    problems = [
        f"{entry.name}: not in the source: {entry.printed}"
        for entry in paper
        if _without_space(entry.printed) not in compact
    ]
    environment = r"\\begin\{(equation|eqnarray)\}(.*?)\\end\{\1\}|\\be\b(.*?)\\ee\b"
    equations = [found[0] for found in re.finditer(environment, text, re.DOTALL)]
    labels = set(re.findall(r"\\label\{([^}]*)\}", "".join(equations)))
    known = {entry.label for entry in paper if entry.label is not None}
    problems += [f"no entry for the equation {label}" for label in sorted(labels - known)]
    problems += [f"the source has no equation {label}" for label in sorted(known - labels)]
    return problems
