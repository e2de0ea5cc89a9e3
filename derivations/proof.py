"""A derivation that is read as a text: each line says what is derived, and proves it.

A chapter is a function that shows its lines on a `Proof` for a given model, and says below a line
which entry of the ledger it decides.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache, cached_property
from typing import Any

import sympy as sp

from derivations.judges import Judge, equals, follows, vanishes
from derivations.model import MODEL, Model
from derivations.notation import Expression

STANDINGS = ("proved", "checked", "argued")
"""For all N or all parameters, by algebra; in exact cases that are named; in words."""


@dataclass
class Line:
    """One line of a derivation.

    Attributes
    ----------
    text : str
        What is derived, or claimed.
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
        """What is wrong with the line (empty: nothing)."""
        try:
            return "" if bool(self.decide()) else "does not hold"
        except Exception as trouble:  # a changed premise may leave nothing to compare
            return f"cannot be decided: {trouble!r}"


@dataclass
class Decision:
    """What decides an entry: judges of its formulas, evidence, and the lines it rests on."""

    printed: Judge | None
    corrected: Judge | None
    holds: object
    lines: list[Line]
    shown: list[Line]
    """The lines that lead to it."""


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
        """Add a claim that was checked in the cases that are named."""
        self.lines.append(Line(text, standing="checked", why=cases, decide=holds))

    def argued(self, text: str, why: str) -> None:
        """Add what follows in words from the lines before it."""
        self.lines.append(Line(text, standing="argued", why=why))

    def entry(
        self,
        name: str,
        printed: Any = None,
        corrected: Any = None,
        holds: Any = True,
        lines: int = 1,
    ) -> None:
        """Decide an entry of the ledger, which rests on the last so many lines.

        Parameters
        ----------
        name : str
            As the ledger has it.
        printed, corrected : mapping, Expression or callable
            What stands for the symbols of the formula; what a bare expression must be; a judge.
        holds : bool or callable
            Evidence beside the formulas.
        lines : int
            How many.
        """
        rested = self.lines[len(self.lines) - lines :]
        shown = self.lines[-max(8, lines) :] if lines else []
        self.decisions[name] = Decision(_judge(printed), _judge(corrected), holds, rested, shown)

    def alone(
        self, name: str, printed: Any = None, corrected: Any = None, holds: Any = True
    ) -> None:
        """Decide an entry that rests on no line: a definition, or what its formula settles."""
        self.entry(name, printed, corrected, holds, lines=0)

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
