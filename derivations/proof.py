"""A derivation that reads as a text: each line states a result and proves it.

A chapter is a function that shows its lines on a `Proof` for a given model, and says below a line
which entry of the ledger it decides.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache, cached_property
from typing import Any

import sympy as sp

from derivations.judges import Judge, equals, follows, standing_of, vanishes
from derivations.model import MODEL, Model
from derivations.notation import Expression, brief

STANDINGS = ("proved", "judged", "checked", "argued")
"""For all N or all parameters, by algebra, line by line; a formula that its judge accepts, with no
line shown; in exact cases that are named, or in floating point; in words."""


@dataclass
class Line:
    """One line of a derivation.

    Attributes
    ----------
    text : str
        The result or claim in words.
    value : Expression
        What was derived.
    form : Expression
        The same in the form in which one reads it; None: as it was derived.
    standing : str
        One of :data:`STANDINGS`; empty for a step that claims nothing.
    why : str
        Why it holds, or in which cases it was checked.
    decide : callable
        Whether it holds; asked once, when somebody wants to know.
    """

    text: str
    value: Expression = None
    form: Expression = None
    standing: str = ""
    why: str = ""
    decide: Callable[[], object] = lambda: True

    @cached_property
    def fault(self) -> str:
        """The fault of the line (empty: none)."""
        try:
            return "" if bool(self.decide()) else "does not hold"
        except Exception as trouble:  # a changed premise may leave nothing to compare
            return f"cannot be decided: {trouble!r}"


def worded(value: Any, form: str = "") -> str:
    """Return what a text says of a value: a number in a format, or an expression in m, a and D."""
    if form and getattr(value, "is_number", True):
        return format(float(value), form)
    return value if isinstance(value, str) else str(brief(value))


@dataclass
class Decision:
    """The evidence for an entry: judges of its formulas, facts, and the lines it rests on.

    Attributes
    ----------
    printed : callable or None
        The judge of the printed formula.
    corrected : tuple of (callable or None)
        The judges of the corrected formulas, in their order; None: the judge of the printed one.
    holds : bool or callable
        Evidence beside the formulas.
    lines, shown : list of Line
        What it rests on; what leads to it.
    said : mapping
        What the texts of the entry may name: values that the derivation knows.
    """

    printed: Judge | None
    corrected: tuple[Judge | None, ...]
    holds: object
    lines: list[Line]
    shown: list[Line]
    said: Mapping[str, Any]

    @property
    def judges(self) -> list[Judge]:
        """All judges of its formulas."""
        return [judge for judge in (self.printed, *self.corrected) if judge is not None]

    @property
    def standing(self) -> str:
        """The weakest standing of what decides it."""
        used = {line.standing for line in self.lines} | set(map(standing_of, self.judges))
        if not any(line.standing for line in self.lines):
            used.add("judged" if self.judges else "argued")
        return next(word for word in reversed(STANDINGS) if word in used)


def _judge(said: Any) -> Judge | None:
    if isinstance(said, Mapping):
        return follows(said)
    return equals(said) if isinstance(said, sp.Basic) else said


@dataclass
class Proof:
    """The lines of a chapter under one model; the value of a named line is an attribute."""

    title: str
    assumptions: tuple[str, ...]
    model: Model
    lines: list[Line] = field(default_factory=list)
    named: dict[str, Expression] = field(default_factory=dict)
    decisions: dict[str, Decision] = field(default_factory=dict)

    def show(
        self, text: str, derived: Expression, equals: Expression = None, name: str = ""
    ) -> Expression:
        """Add what was derived, and the form in which a reader knows it, which is proved.

        Returns what was derived, which the chapters after this one know by its name.
        """
        standing = "" if equals is None else "proved"
        self.lines.append(
            Line(
                text,
                derived,
                equals,
                standing,
                "",
                lambda: not standing or vanishes(derived - equals),
            )
        )
        self.named[name] = derived
        return derived

    def proved(self, text: str, holds: Callable[[], object], why: str) -> None:
        """Add a claim that algebra decides for all N or all parameters."""
        self.lines.append(Line(text, standing="proved", why=why, decide=holds))

    def checked(self, text: str, holds: Callable[[], object], cases: str) -> None:
        """Add a claim that was checked in the named cases."""
        self.lines.append(Line(text, standing="checked", why=cases, decide=holds))

    def argued(self, text: str, why: str) -> None:
        """Add a consequence, in words, of the lines before it."""
        self.lines.append(Line(text, standing="argued", why=why))

    def entry(
        self,
        name: str,
        printed: Any = None,
        corrected: Any = None,
        holds: Any = True,
        lines: int = 1,
        **said: Any,
    ) -> None:
        """Decide an entry of the ledger, which rests on the last so many lines.

        Parameters
        ----------
        name : str
            As the ledger has it.
        printed, corrected : mapping, Expression or callable
            What stands for the symbols of the formula; what a bare expression must be; a judge.
            A tuple: of each corrected formula.
        holds : bool or callable
            Evidence beside the formulas.
        lines : int
            How many.
        **said
            What the texts of the entry name in braces.
        """
        rested = self.lines[len(self.lines) - lines :]
        shown = self.lines[-max(8, lines) :] if lines else []
        of_each = corrected if isinstance(corrected, tuple) else (corrected,)
        judges = tuple(map(_judge, of_each))
        self.decisions[name] = Decision(_judge(printed), judges, holds, rested, shown, said)

    def alone(
        self, name: str, printed: Any = None, corrected: Any = None, holds: Any = True, **said: Any
    ) -> None:
        """Decide an entry that rests on no line: a definition, or what its formula settles."""
        self.entry(name, printed, corrected, holds, lines=0, **said)

    def __getattr__(self, name: str) -> Any:
        try:
            return self.__dict__["named"][name]
        except KeyError:
            raise AttributeError(f"{name}: no such line") from None


Derive = Callable[..., Proof]


def chapter(title: str, *assumptions: str) -> Callable[[Callable[[Proof, Model], None]], Derive]:
    """Make a derivation, done once for each model, of a function that shows its lines."""

    def made(write: Callable[[Proof, Model], None]) -> Derive:
        @cache
        def derived(model: Model) -> Proof:
            proof = Proof(title, assumptions, model)
            try:
                write(proof, model)
            except Exception as trouble:
                reason = repr(trouble)
                proof.proved("the derivation comes to its end", lambda: False, reason)
            return proof

        return lambda model=MODEL: derived(model)

    return made
