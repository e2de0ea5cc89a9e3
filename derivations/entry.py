"""Entries of the ledger: a statement of the paper, its verdict, and the lines it rests on."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from derivations.judges import Judge, Refuted
from derivations.model import MODEL, Model
from derivations.notation import Expression, NotationError, read
from derivations.proof import STANDINGS, Derive, Line, Proof


class Lines:
    """The lines of a proof as an entry uses them: it rests on those whose values it takes."""

    def __init__(self, proof: Proof) -> None:
        self.proof, self.model = proof, proof.model
        self.used: list[Line] = []

    def __getattr__(self, name: str) -> Any:
        value = self.alone(name)
        self.used.append(self.proof.named[name])
        return value

    def alone(self, name: str) -> Any:
        """Return a value of which an entry needs a property only: it does not rest on the line."""
        if name not in self.proof.named:
            raise Refuted(f"{self.proof.title}: the line {name} was not reached")
        return self.proof.named[name].value


def stands(*_: Expression) -> bool:
    """Return True: an entry that takes the values of lines rests on them, and on nothing else."""
    return True


@dataclass(frozen=True)
class Backing:
    """What decides an entry: judges of its printed and corrected formulas, and further evidence."""

    holds: Judge | None = None
    exactly: Judge | None = None
    evidence: object = True


Backed = Callable[[Lines], Any]
"""Returns the `Backing` of an entry, or one of its parts: a judge, or evidence."""


@dataclass(frozen=True)
class Entry:
    """What the audit says of one statement of the paper.

    Attributes
    ----------
    name : str
        A name of its own (the label, where the paper has one).
    chapter : str
        The module that backs it.
    derive : callable
        The chapter's derivation.
    backed : callable or None
        What decides it, from the chapter's lines.
    place, printed, verdict, label, number, corrected, error, assumptions, why
        As the ledger has them.
    formula, corrected_formula : str or None
        The parts of `printed` and `corrected` that are judged.
    repair : tuple of str
        What must be replaced by what in `formula` (and what appended) to make it follow.
    """

    name: str
    chapter: str
    derive: Derive
    backed: Backed | None
    place: str
    printed: str
    verdict: str
    label: str | None = None
    number: int | None = None
    corrected: str | None = None
    error: str | None = None
    assumptions: tuple[str, ...] = ()
    why: str = ""
    formula: str | None = None
    corrected_formula: str | None = None
    repair: tuple[str, ...] = ()

    def backing(self, model: Model = MODEL) -> tuple[Backing, list[Line]]:
        """Return what decides the entry, and the lines it rests on."""
        return _backing(self, model)

    def judges(self, text: str, corrected: bool = False, model: Model = MODEL) -> bool:
        """Return whether a formula in the place of the printed or corrected one follows."""
        backing, _ = self.backing(model)
        judge = (backing.exactly if corrected else None) or backing.holds
        if judge is None:
            raise ValueError(f"{self.name} has no formula")
        try:
            return bool(judge(read(text)))
        except NotationError:
            return False

    def accepts_printed(self, text: str, model: Model = MODEL) -> bool:
        """Return whether `text` in the place of the printed formula would earn the same verdict."""
        if not self.repair:
            return self.judges(text, model=model)
        wrong, right, *appended = self.repair
        repaired = text.replace(wrong, right) + "".join(appended)
        return (
            text.count(wrong) == 1
            and not self.judges(text, model=model)
            and self.judges(repaired, model=model)
        )

    def accepts_corrected(self, text: str, model: Model = MODEL) -> bool:
        """Return whether `text` in the place of the corrected formula follows."""
        return self.judges(text, corrected=True, model=model)

    def faults(self, model: Model = MODEL) -> list[str]:
        """Return why the verdict does not hold under a model (empty: it does)."""
        if self.backed is None:
            return []
        try:
            backing, used = self.backing(model)
            evidence = backing.evidence() if callable(backing.evidence) else backing.evidence
            said = [
                (
                    "the printed formula does not earn its verdict",
                    backing.holds is None
                    or self.formula is None
                    or self.accepts_printed(self.formula, model),
                ),
                (
                    "the corrected formula does not follow",
                    self.corrected_formula is None
                    or self.accepts_corrected(self.corrected_formula, model),
                ),
                ("the evidence does not bear out the verdict", evidence),
            ]
        except Refuted as trouble:
            return [f"{self.name}: {trouble}"]
        except Exception as trouble:
            return [f"{self.name}: cannot be decided: {trouble!r}"]
        said += [(f"it rests on: {line.text}", not line.fault) for line in used]
        return [f"{self.name}: {fault}" for fault, fine in said if not bool(fine)]

    def check(self) -> None:
        """Raise `Refuted` unless the verdict holds for what is printed and what is corrected."""
        if faults := self.faults():
            raise Refuted("; ".join(faults))

    @property
    def standing(self) -> str:
        """The weakest standing of what it rests on; empty for a definition or a choice."""
        if self.verdict == "convention":
            return ""
        if self.backed is None:
            return "argued"
        used = {line.standing for line in self.backing()[1]}
        return next((word for word in reversed(STANDINGS) if word in used), "proved")

    @property
    def proved(self) -> bool:
        return self.standing == "proved"

    @property
    def how(self) -> str:
        """The chapter, and the argument or the line that the entry rests on."""
        if self.why or self.backed is None:
            return f"{self.chapter}: {self.why}"
        return f"{self.chapter}: " + "; ".join(
            line.text.rstrip(" =:") for line in self.backing()[1][-1:]
        )

    def as_json(self) -> dict[str, object]:
        """Return the entry as a JSON object."""
        return {
            "label": self.label,
            "name": self.name,
            "place": self.place,
            "verdict": self.verdict,
            "printed": self.printed,
            "corrected": self.corrected,
            "assumptions": list(self.assumptions),
            "error": self.error,
            "proved": self.proved,
            "how": self.how,
        }


@cache
def _backing(entry: Entry, model: Model) -> tuple[Backing, list[Line]]:
    lines = Lines(entry.derive(model))
    assert entry.backed is not None
    said = entry.backed(lines)
    if not isinstance(said, Backing):
        said = Backing(holds=said) if callable(said) else Backing(evidence=said)
    return said, lines.used


LEDGER = tomllib.loads((Path(__file__).parent / "ledger.toml").read_text(encoding="utf-8"))


def _marked(text: str | None) -> tuple[str | None, str | None]:
    """Return a text without its marks, and the part between them."""
    if text is None or "«" not in text:
        return text, None
    return text.replace("«", "").replace("»", ""), text.partition("«")[2].partition("»")[0]


def entries_of(chapter: str, derive: Derive, backed: dict[str, Backed | None]) -> tuple[Entry, ...]:
    """Return the entries of a chapter: what the ledger says, with what decides it."""
    made = []
    for name, decided in backed.items():
        said = LEDGER[name]
        printed, formula = _marked(said.get("printed"))
        if printed is None:
            printed, formula = said["formula"], said["formula"].strip("$")
        corrected, corrected_formula = _marked(said.get("corrected"))
        made.append(
            Entry(
                name,
                chapter,
                derive,
                decided,
                said["place"],
                printed,
                said["verdict"],
                name if said.get("equation") and said.get("label", True) else None,
                said.get("equation"),
                corrected,
                said.get("error"),
                tuple(said.get("if", ())),
                said.get("why", ""),
                formula,
                corrected_formula,
                tuple(said.get("repair", ())),
            )
        )
    return tuple(made)
