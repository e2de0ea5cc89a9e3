"""Judges of formulas: whether what a text of the paper says follows from what was derived."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import pairwise
from typing import Any

import sympy as sp

from derivations.notation import Expression, Formula


class Refuted(AssertionError):
    """A statement that does not follow."""


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
