"""The ledger: every statement of the paper with its verdict, and the chapters that back it."""

from __future__ import annotations

import re
import tomllib
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import sympy as sp

from derivations.judges import Judge
from derivations.model import ASSUMED, MODEL, PREMISES, Model
from derivations.notation import (
    CAPTIONS,
    SOLID,
    N,
    NotationError,
    evaluated,
    i,
    read,
)
from derivations.proof import Decision, Proof, worded

NAMES = (
    "scaling procedure modes slip two_sliders pivots plateaus thresholds sliding_limit gaussian "
    "continuum runaway shakedown beyond unlike level"
)
EQUATIONS = 26
"""How many numbered equations the paper has."""
FIGURES = (
    "sketch position2sliders velocity2sliders velocity2sliders_theta velocityNsliders "
    "velocityNslidersbis cloche jumps"
)
"""Labels of the paper's figures, in their order."""
CHAPTERS = {name: import_module(f"derivations.{name}") for name in NAMES.split()}
"""The modules, each with ``derive(model)``."""


def proof_of(chapter: str, model: Model = MODEL) -> Proof:
    """Return a chapter's lines under a model."""
    proof: Proof = CHAPTERS[chapter].derive(model)
    return proof


@dataclass(frozen=True)
class Entry:
    """The verdict of the audit on one statement of the paper.

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
    place, printed, label, number
        As the ledger has them.
    texts : mapping
        What else it says: `corrected`, `error`, `why` and `measured`. They hold no number and no
        sign of their own: what stands between «marks» is judged, what stands in {braces} is what
        the derivation found. Only `measured` has numbers, from the test that `by` names.
    formula : str or None
        The part of `printed` that is judged.
    corrected_formulas : tuple of str
        The parts of `corrected` that are judged.
    assumptions : tuple of str
        Keys of `ASSUMED`.
    by : str
        The test that measures the numbers of `measured`.
    repair : tuple of str
        What must be replaced by what in `formula` (and what appended) to make it follow.
    law : mapping
        The functions of the package that say it: ``printed``, ``corrected`` and ``exact``.
    key, raw
        Its table in the ledger.
    """

    name: str
    chapter: str
    place: str
    printed: str
    verdict: str
    label: str | None
    number: int | None
    texts: Mapping[str, str]
    assumptions: tuple[str, ...]
    formula: str | None
    corrected_formulas: tuple[str, ...]
    repair: tuple[str, ...]
    law: Mapping[str, str]
    by: str
    key: str
    raw: Mapping[str, Any]

    def decision(self, model: Model = MODEL) -> Decision:
        """Return the judges and lines that decide the entry under a model."""
        missed = Decision(None, (), False, [], [], {})  # the derivation did not reach it
        return proof_of(self.chapter, model).decisions.get(self.name, missed)

    def text(self, name: str, model: Model = MODEL) -> str | None:
        """Return one of its texts, with what the derivation found in the place of {braces}.

        It names equations by the paper's numbers, the ledger by their labels.
        """
        text = self.texts.get(name)
        said = self.decision(model).said
        parts = re.split("(«.*?»)", text or "")
        for k in range(0, len(parts), 2):
            parts[k] = _BRACES.sub(lambda at: worded(said[at[1]], at[2] or ""), parts[k])
            parts[k] = by_number(parts[k])
        return None if text is None else "".join(parts)

    @property
    def corrected(self) -> str | None:
        """The correct statement instead."""
        text = self.text("corrected")
        return text and text.replace("«", "").replace("»", "")

    @property
    def error(self) -> str | None:
        """The size of the error of the printed statement."""
        return self.text("error")

    @property
    def measured(self) -> str | None:
        """Measured facts that are not proved."""
        return self.text("measured")

    @property
    def corrected_formula(self) -> str | None:
        """The first of the corrected formulas."""
        return next(iter(self.corrected_formulas), None)

    def accepts_printed(self, text: str, model: Model = MODEL) -> bool:
        """Return whether `text` in the place of the printed formula would earn the same verdict."""
        judge = self.decision(model).printed
        if not self.repair:
            return _accepts(judge, text)
        wrong, right, *appended = self.repair
        repaired = text.replace(wrong, right) + "".join(appended)
        once = text.count(wrong) == 1
        return once and not _accepts(judge, text) and _accepts(judge, repaired)

    def accepts_corrected(self, text: str, model: Model = MODEL, place: int = 0) -> bool:
        """Return whether `text` in the place of a corrected formula follows."""
        decision = self.decision(model)
        return _accepts(decision.corrected[place] or decision.printed, text)

    def _doubts(self, model: Model) -> Iterator[str]:
        decision = self.decision(model)
        if decision.printed and self.formula and not self.accepts_printed(self.formula, model):
            yield "the printed formula does not earn its verdict"
        if self.corrected_formulas and len(decision.corrected) != len(self.corrected_formulas):
            yield "its corrected formulas are not judged one by one"
        for place, formula in enumerate(self.corrected_formulas):
            if not self.accepts_corrected(formula, model, place):
                yield "the corrected formula does not follow"
        for name, text in self.texts.items():
            self.text(name, model)
            if name != "measured" and (unjudged := literals(text)):
                yield f"nothing judges {' '.join(unjudged)} in its {name}"
        if bool(self.texts.get("measured")) != bool(self.by):
            yield "`measured` and its test `by` go together"
        for assumption in self.assumptions:
            if assumption not in ASSUMED:
                yield f"nothing is known as the premise: {assumption}"
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
        """The weakest standing among its evidence; empty for a definition or a choice."""
        return "" if self.verdict == "convention" else self.decision().standing

    @property
    def judged(self) -> bool:
        """Whether a formula is judged; otherwise the entry is a sentence with its reasons."""
        return bool(self.decision().judges)

    @property
    def proved(self) -> bool:
        return self.standing == "proved"

    @property
    def how(self) -> str:
        """The chapter, and the argument or the line that the entry rests on."""
        last = "".join(line.text.rstrip(" =:") for line in self.decision().lines[-1:])
        return f"{self.chapter}: {self.text('why') or by_number(last)}"

    def as_json(self) -> dict[str, object]:
        """Return the entry as a JSON object."""
        keys = "label name place number verdict printed corrected error measured standing judged"
        said = {key: getattr(self, key) for key in [*keys.split(), "proved", "how"]}
        return said | {"assumptions": list(self.assumptions)}


@cache
def _number_of() -> dict[str, int]:
    return {entry.name: entry.number for entry in entries() if entry.number}


def by_number(text: str) -> str:
    """Return a text that names the paper's equations and figures by numbers instead of labels."""
    number_of = _number_of()
    text = re.sub(
        r"Eq\. \((\w+)\)",
        lambda match: f"Eq. {number_of[match[1]]}" if match[1] in number_of else match[0],
        text,
    )
    for number, label in enumerate(FIGURES.split(), 1):
        text = re.sub(rf"Fig\. {label}\b", f"Fig. {number}", text)
    return text


def _accepts(judge: Judge | None, text: str) -> bool:
    if judge is None:
        raise ValueError("there is no formula to judge")
    try:
        return bool(judge(read(text)))
    except NotationError:
        return False


_BRACES = re.compile(r"(?<!\\ref)\{(\w+)(?::([^{}]*))?\}")
_NAMES = re.compile(r"\\ref\{\w+\}|Eq\. (?:\(\w+\)|\d+)|\b[lr]0\b|->|(?<=[A-Za-z])-(?=[A-Za-z])")
_LITERAL = re.compile(r"\d+(?:\.\d+)?|[-+*/^=<>]+")


def literals(text: str) -> list[str]:
    """Return the numbers and signs of a text that are neither judged nor derived."""
    for apart in (re.compile("«.*?»"), _BRACES, _NAMES):
        text = apart.sub(" ", text)
    return _LITERAL.findall(text)


_MARKED = re.compile("«(.*?)»")
_TEXTS = ("corrected", "error", "measured", "why")


def entry_of(key: str, said: dict[str, Any], place: str) -> Entry:
    """Return the entry that a table of the ledger describes."""
    verdict, chapter, name = re.split(r": |\.", key)
    number = said.get("equation")
    printed = said.get("printed")
    if printed is None:
        printed, formula = said["formula"], said["formula"].strip("$")
    else:
        formula = next(iter(_MARKED.findall(printed)), None)
    return Entry(
        name=name,
        chapter=chapter,
        place=place,
        printed=printed.replace("«", "").replace("»", ""),
        verdict=verdict,
        label=name if number and said.get("label", True) else None,
        number=number,
        texts={text: said[text] for text in _TEXTS if text in said},
        assumptions=tuple(said.get("if", ())),
        formula=formula,
        corrected_formulas=tuple(_MARKED.findall(said.get("corrected", ""))),
        repair=tuple(said.get("repair", ())),
        law=said.get("law", {}),
        by=said.get("by", ""),
        key=key,
        raw=said,
    )


@cache
def entries() -> tuple[Entry, ...]:
    """Return all entries, in the order of the paper."""
    ledger = tomllib.loads((Path(__file__).parent / "ledger.toml").read_text(encoding="utf-8"))
    place, made = "", []
    for key, said in ledger.items():
        place = said.get("place", place)  # default: the place of the entry before
        made.append(entry_of(key, said, place))
    return tuple(made)


def gaps() -> list[str]:
    """Return which of the paper's numbered equations have not exactly one entry."""
    known = Counter(entry.number for entry in entries() if entry.number)
    wanted = set(range(1, EQUATIONS + 1))
    return [
        f"Eq. ({k}) has {known[k]} entries"
        for k in sorted(wanted | set(known))
        if known[k] != (k in wanted)
    ]


def premises() -> dict[str, list[str]]:
    """Return, for every entry, the premises without which it is refuted."""
    return {
        entry.name: [name for name, model in PREMISES.items() if entry.faults(model)]
        for entry in entries()
    }


def value(entry: Entry, corrected: bool = False) -> float | None:
    """Return the value of a formula at the captions' parameters; None if it has no number."""
    text = entry.corrected_formula if corrected else entry.formula
    if text is None:
        return None
    given = dict(CAPTIONS)
    if entry.place.startswith("Sec. III A"):
        given |= {N: 2, i: 2}
    if entry.chapter == "continuum":
        given |= SOLID
    for side in read(text).bound({}).sides:
        number = sp.N(evaluated(side).subs(given))
        if number.is_number:
            return float(number)
    return None


def _without_space(text: str) -> str:
    return "".join(text.split())


def _numbered(equation: str) -> Iterator[str]:
    """Yield the lines of an equation that have a number, without white space."""
    lines, begun = re.split(r"\\\\", equation), ""
    for line in lines if "eqnarray" in equation else [equation]:
        begun += line if line is equation else line + r"\\"
        if r"\nonumber" not in line:
            yield _without_space(begun)
            begun = ""


def disagreements(source: str) -> list[str]:
    """Return what in the ledger does not match a LaTeX source of the paper.

    Entries that are not in the source but for white space, numbered or labelled equations without
    an entry, and labels that the source does not have; empty: the ledger is complete and verbatim.
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
    body = text.partition(r"\begin{document}")[2] or text
    equations = [match[0] for match in re.finditer(environment, body, re.DOTALL)]
    numbered = [line for equation in equations for line in _numbered(equation)]
    for k, line in enumerate(numbered, 1):
        named = [e for e in paper if e.number == k and _without_space(e.printed) in line]
        if len(named) != 1:
            problems.append(f"Eq. ({k}) has {len(named)} entries: {line[:60]}")
    labels = set(re.findall(r"\\label\{([^}]*)\}", "".join(equations)))
    labelled = {entry.label for entry in paper if entry.label is not None}
    problems += [f"no entry for the equation {label}" for label in sorted(labels - labelled)]
    problems += [f"the source has no equation {label}" for label in sorted(labelled - labels)]
    return problems
