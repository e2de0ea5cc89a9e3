"""A derivation that is read as a text: each line says what is derived, and proves it.

A chapter is a function that shows its lines on a `Proof` for a given model. Entries of the ledger
name the lines they rest on by using their values.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache, cached_property
from typing import Any

from derivations.judges import vanishes
from derivations.model import MODEL, Model
from derivations.notation import Expression

VERDICTS = ("exact", "approximation", "misprint", "inconsistent", "convention")
"""Follows from the model; leading term of what follows; slip of the pen; contradicts the model or
the paper's own law; a definition or a choice."""

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
class Proof:
    """The lines of a chapter under one model; a named line's value is an attribute.

    Attributes
    ----------
    title : str
    assumptions : tuple of str
    model : Model
    lines : list of Line
    named : dict of str to Line
    starts : list of int
        Where parts begin that do not rest on the lines before them.
    """

    title: str
    assumptions: tuple[str, ...]
    model: Model
    lines: list[Line] = field(default_factory=list)
    named: dict[str, Line] = field(default_factory=dict)
    starts: list[int] = field(default_factory=lambda: [0])

    def part(self) -> None:
        """Begin a part that does not rest on the lines before it."""
        self.starts.append(len(self.lines))

    def _add(self, line: Line, name: str) -> None:
        self.lines.append(line)
        if name:
            self.named[name] = line

    def show(
        self,
        text: str,
        derived: Expression,
        equals: Expression = None,
        name: str = "",
        why: str = "",
    ) -> Expression:
        """Add what was derived, and the form in which a reader knows it, which is proved.

        Returns what was derived.
        """
        standing = "" if equals is None else "proved"

        def decide() -> bool:
            return equals is None or vanishes(derived - equals)

        self._add(Line(text, derived, equals, standing, why, decide), name)
        return derived

    def proved(self, text: str, holds: Callable[[], object], why: str, name: str = "") -> None:
        """Add a claim that algebra decides for all N or all parameters."""
        self._add(Line(text, standing="proved", why=why, decide=holds), name)

    def checked(self, text: str, holds: Callable[[], object], cases: str, name: str = "") -> None:
        """Add a claim that was checked in the cases that are named."""
        self._add(Line(text, standing="checked", why=cases, decide=holds), name)

    def argued(self, text: str, why: str, name: str = "") -> None:
        """Add what follows in words from the lines before it."""
        self._add(Line(text, standing="argued", why=why), name)

    def __getattr__(self, name: str) -> Any:
        try:
            return self.__dict__["named"][name].value
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
                fault = f"{trouble!r}"
                proof.proved("the derivation comes to its end", lambda: False, fault)
            return proof

        return lambda model=MODEL: derived(model)

    return made
