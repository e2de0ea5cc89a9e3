"""What a derivation returns, what a check proves, and what the ledger says of a statement."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import sympy as sp

from derivations.notation import Expression, Formula, NotationError, read

VERDICTS = ("exact", "approximation", "misprint", "inconsistent", "convention")
"""Follows from the model; leading term of what follows; slip of the pen; contradicts the model or
the paper's own law; a definition or a choice."""

STANDINGS = ("proved", "verified", "argued")
"""Decided by algebra for every case; checked in the cases that are named; concluded in words from
claims that are proved, by steps that no program has checked."""


Results = Mapping[str, Any]
"""Derived expressions by name."""


class Refuted(AssertionError):
    """A statement that does not follow."""


@dataclass(frozen=True)
class Step:
    """One step of a derivation: what is done, and the expression it leads to."""

    text: str
    expression: Expression = None


@dataclass(frozen=True)
class Derivation:
    """The steps of a subject and the expressions they end in.

    Attributes
    ----------
    title : str
    steps : tuple of Step
    results : mapping
        Expressions by name; forces in m g, lengths in g tau_dyn**2 unless a step says otherwise.
    assumptions : tuple of str
    """

    title: str
    steps: tuple[Step, ...]
    results: Results
    assumptions: tuple[str, ...] = ()


@dataclass(frozen=True)
class Claim:
    """A statement of a subject, and what it rests on.

    Attributes
    ----------
    text : str
    standing : str
        One of :data:`STANDINGS`.
    how : str
        The argument, or the range of cases.
    """

    text: str
    standing: str
    how: str

    @property
    def proved(self) -> bool:
        return self.standing == "proved"


@dataclass
class Verification:
    """Everything that one subject's check has established."""

    subject: str
    assumptions: tuple[str, ...] = ()
    claims: list[Claim] = field(default_factory=list)

    def identity(self, text: str, expression: Expression, how: str = "identity") -> None:
        """Record that an expression vanishes identically; raise `Refuted` if it does not."""
        if not vanishes(expression):
            raise Refuted(f"{self.subject}: {text}: {sp.simplify(expression)} is not zero")
        self.claims.append(Claim(text, "proved", how))

    def proved(self, text: str, truth: bool, how: str) -> None:
        """Record a statement decided symbolically or by exact arithmetic on a complete set."""
        self._decided(truth, Claim(text, "proved", how))

    def verified(self, text: str, truth: bool, how: str) -> None:
        """Record a statement checked over the range of cases that `how` names."""
        self._decided(truth, Claim(text, "verified", how))

    def _decided(self, truth: bool, claim: Claim) -> None:
        if not bool(truth):
            raise Refuted(f"{self.subject}: {claim.text}")
        self.claims.append(claim)

    def argued(self, text: str, how: str) -> None:
        """Record what follows in words from claims that stand before it, named in `how`."""
        self.claims.append(Claim(text, "argued", how))


def vanishes(expression: Expression) -> bool:
    """Return whether an expression is identically zero (False: it is not, or not seen to be)."""
    expression = sp.sympify(expression)
    if expression == 0:
        return True
    reduced = sp.cancel(sp.together(sp.expand(expression)))
    if reduced == 0:
        return True
    if reduced.has(sp.Function, sp.Pow, sp.Piecewise):
        return bool(sp.simplify(reduced) == 0)
    return False


Judge = Callable[[Formula], bool]
"""Says whether a formula follows from the derivation."""


def follows(bindings: Mapping[Any, Any], relation: str = "=~") -> Judge:
    """Return a judge: all sides of the formula agree once the derived expressions are put in."""

    def judge(formula: Formula) -> bool:
        if not formula.relations or any(r not in relation for r in formula.relations):
            return False
        sides = formula.bound(bindings).sides
        return all(vanishes(a - b) for a, b in pairwise(sides))

    return judge


def equals(value: Expression) -> Judge:
    """Return a judge of a bare expression: it is `value`."""

    def judge(formula: Formula) -> bool:
        return not formula.relations and vanishes(formula.bound({}).left - value)

    return judge


def proportional(bindings: Mapping[Any, Any], relation: str = "~") -> Judge:
    """Return a judge of an order of magnitude: the sides' ratio is a positive number."""

    def judge(formula: Formula) -> bool:
        if formula.relations != (relation,):
            return False
        left, right = formula.bound(bindings).sides
        ratio = sp.powsimp(sp.simplify(left / right), force=True)
        return bool(ratio.is_number and ratio.is_positive)

    return judge


def leading(bindings: Mapping[Any, Any], large: Expression) -> Judge:
    """Return a judge of an approximation: the sides' ratio tends to 1 when `large` grows."""

    def judge(formula: Formula) -> bool:
        if not formula.relations or any(r not in "=~" for r in formula.relations):
            return False
        sides = [sp.sympify(side) for side in formula.bound(bindings).sides]
        if any(side == 0 for side in sides):
            return False
        return all(sp.limit(sp.cancel(a / b), large, sp.oo) == 1 for a, b in pairwise(sides))

    return judge


def within(value: float, factor: float) -> Judge:
    """Return a judge of a number: what is stated is `value` to within `factor`."""

    def judge(formula: Formula) -> bool:
        stated = formula.right
        return bool(
            formula.relations in (("~",), ("=",), ())
            and stated.is_number
            and stated > 0
            and value / factor <= float(stated) <= value * factor
        )

    return judge


def inequality(bindings: Mapping[Any, Any], margin: Expression) -> Judge:
    """Return a judge: the formula says that `margin` is positive, up to a positive factor.

    The factor must be free of everything but symbols known to be positive.
    """

    def judge(formula: Formula) -> bool:
        if len(formula.relations) != 1 or formula.relations[0] not in ("<", ">"):
            return False
        left, right = formula.bound(bindings).sides
        difference = left - right if formula.relations[0] == ">" else right - left
        ratio = sp.cancel(sp.together(sp.expand(difference) / sp.expand(margin)))
        return ratio.is_positive is True

    return judge


@dataclass(frozen=True)
class Entry:
    """What the audit says of one statement of the paper.

    Attributes
    ----------
    name : str
        A name of its own (the label, where the paper has one).
    label : str or None
        The paper's label.
    place : str
        Where it stands.
    printed : str
        The statement, verbatim but for white space.
    verdict : str
        One of :data:`VERDICTS`.
    how : str
        Module and argument that back the verdict.
    proved : bool
        Whether the verdict rests on a proof (False: on a verification over stated cases).
    assumptions : tuple of str
    corrected : str or None
        The corrected or exact form, in LaTeX or in words.
    error : str or None
        Leading error of an approximation and the condition under which it is small; what a misprint
        gets wrong.
    formula : str or None
        The part of `printed` that is a formula; where there is a judge, by default all of it.
    corrected_formula : str or None
        The part of `corrected` that is one.
    holds : Judge or None
        Whether a formula says what the derivation says: exactly, or (approximations) to leading
        order.
    holds_exactly : Judge or None
        The judge of the corrected form; `holds` where it is the same.
    repair : tuple of str or None
        What must be replaced by what in `formula` (and what appended) to make it follow (misprints
        and inconsistencies).
    evidence : callable or None
        Decides a verdict that is no formula's.
    """

    name: str
    place: str
    printed: str
    verdict: str
    how: str
    proved: bool = True
    label: str | None = None
    assumptions: tuple[str, ...] = ()
    corrected: str | None = None
    error: str | None = None
    formula: str | None = None
    corrected_formula: str | None = None
    holds: Judge | None = None
    holds_exactly: Judge | None = None
    repair: tuple[str, ...] | None = None
    evidence: Callable[[], bool] | None = None

    def __post_init__(self) -> None:
        if self.formula is None and self.holds is not None:
            object.__setattr__(self, "formula", self.printed.strip("$"))

    def accepts_printed(self, text: str) -> bool:
        """Return whether `text` in the place of the printed formula would earn the same verdict."""
        if self.holds is None:
            raise ValueError(f"{self.name} has no formula")
        try:
            if self.repair is None:
                return self.holds(read(text))
            wrong, right, *appended = self.repair
            if text.count(wrong) != 1:
                return False
            repaired = text.replace(wrong, right) + "".join(appended)
            return not self.holds(read(text)) and self.holds(read(repaired))
        except NotationError:
            return False

    def accepts_corrected(self, text: str) -> bool:
        """Return whether `text` in the place of the corrected formula follows."""
        judge = self.holds_exactly or self.holds
        if judge is None:
            raise ValueError(f"{self.name} has no formula")
        try:
            return judge(read(text))
        except NotationError:
            return False

    def check(self) -> None:
        """Raise `Refuted` unless the verdict holds for what is printed and what is corrected."""
        if self.formula is not None and not self.accepts_printed(self.formula):
            raise Refuted(f"{self.name}: the printed formula does not earn its verdict")
        if self.corrected_formula is not None and not self.accepts_corrected(
            self.corrected_formula
        ):
            raise Refuted(f"{self.name}: the corrected formula does not follow")
        if self.evidence is not None and not self.evidence():
            raise Refuted(f"{self.name}: the evidence does not bear out the verdict")

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
