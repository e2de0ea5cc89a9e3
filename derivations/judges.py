"""Judges of formulas: does a formula of the paper follow from the derivation?"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import Any

import sympy as sp
from sympy.core.function import AppliedUndef

from derivations.notation import Expression, Formula, symbol

Judge = Callable[[Formula], object]
"""Says whether a formula follows from the derivation."""


def at_a_point(expression: Expression, shift: int = 0) -> Expression:
    """Return the value of an expression at a fixed point of its symbols and functions."""
    functions = sorted(expression.atoms(AppliedUndef), key=lambda at: -len(str(at)))
    for k, function in enumerate(functions):  # functions of functions first
        expression = expression.subs(function, sp.Rational(7 + 2 * k + shift, 5 + k))
    symbols = sorted(expression.free_symbols, key=str)
    point = {
        name: sp.Rational(11 + 3 * k + shift, 1 if name.is_integer else 7 + k)
        for k, name in enumerate(symbols)
    }
    return sp.N(expression.subs(point), 20)


@cache
def vanishes(expression: Expression) -> bool:
    """Return whether an expression is identically zero (False also if this is not seen)."""
    value = at_a_point(sp.sympify(expression))
    if not value.is_finite or abs(value) > 1e-12:
        return False
    reduced = sp.cancel(sp.together(sp.expand(expression)))
    return reduced == 0 or bool(sp.simplify(reduced) == 0)


@cache
def positive(expression: Expression) -> bool:
    """Return whether an expression is positive for all values of its symbols, as far as seen."""
    return sp.cancel(sp.together(sp.expand(expression))).is_positive is True


def follows(bindings: Mapping[Any, Any]) -> Judge:
    """Return a judge: all sides of the formula agree with the derived expressions inserted."""
    return compared(bindings, lambda left, right: vanishes(left - right))


def compared(bindings: Mapping[Any, Any], holds: Callable[..., object]) -> Judge:
    """Return a judge of an equation, given the condition on its neighbouring sides."""

    def judge(formula: Formula) -> bool:
        if not formula.relations or not set(formula.relations) <= {"=", "~"}:
            return False
        return all(holds(left, right) for left, right in pairwise(formula.bound(bindings).sides))

    return judge


def equals(value: Expression) -> Judge:
    """Return a judge of a bare expression: it is `value`."""
    return lambda formula: not formula.relations and vanishes(formula.bound({}).left - value)


def ratio(bindings: Mapping[Any, Any], holds: Callable[[Expression], object]) -> Judge:
    """Return a judge of an approximate law, given the ratio of its two sides."""
    return compared(bindings, lambda left, right: left * right != 0 and holds(left / right))


def proportional(bindings: Mapping[Any, Any]) -> Judge:
    """Return a judge of an order of magnitude: the sides' ratio is a positive number."""

    def number(quotient: Expression) -> bool:
        reduced = sp.powsimp(sp.simplify(quotient), force=True)
        return bool(reduced.is_number and reduced.is_positive)

    return ratio(bindings, number)


def leading(bindings: Mapping[Any, Any], large: Expression) -> Judge:
    """Return a judge of a leading term: the sides' ratio tends to 1 when `large` grows."""
    return ratio(bindings, lambda quotient: sp.limit(sp.cancel(quotient), large, sp.oo) == 1)


def both(first: Judge, second: Judge) -> Judge:
    """Return a judge that accepts what two judges accept."""
    return lambda formula: first(formula) and second(formula)


@dataclass(frozen=True)
class Within:
    """A judge of a number: the stated number (of `name`) is `value` to within `factor`.

    Its arithmetic is floating point: a number that it accepts is checked, not proved.
    """

    value: float
    factor: float
    name: str = ""

    def __call__(self, formula: Formula) -> bool:
        """Return whether the formula states such a number."""
        stated = formula.right
        if self.name and formula.left != symbol(self.name):
            return False
        if formula.relations not in (("~",), ("=",), ()) or not stated.is_number:
            return False
        return bool(self.value / self.factor <= stated <= self.value * self.factor)


def standing_of(judge: Judge) -> str:
    """Return the standing of a judge's verdict: by algebra, or in floating point."""
    return "checked" if isinstance(judge, Within) else "proved"


def inequality(bindings: Mapping[Any, Any], margin: Expression) -> Judge:
    """Return a judge: the formula says that `margin` is positive, up to a positive factor."""

    def judge(formula: Formula) -> bool:
        if formula.relations not in (("<",), (">",)):
            return False
        left, right = formula.bound(bindings).sides
        difference = left - right if formula.relations == (">",) else right - left
        return positive(sp.expand(difference) / sp.expand(margin))

    return judge


def small(bindings: Mapping[Any, Any], left: Expression, right: Expression) -> Judge:
    """Return a judge: the formula says that `left` is much smaller than `right`."""

    def judge(formula: Formula) -> bool:
        lesser, greater = formula.bound(bindings).sides
        return formula.relations == ("<<",) and vanishes(lesser / greater - left / right)

    return judge
