"""The paper's notation: its symbols in SymPy, and a reader for its formulas.

A ledger entry carries the formula as the paper prints it, in LaTeX. :func:`read` reads
this text for the check: nothing is transcribed by hand, and a changed sign, coefficient or index
in the text is a changed formula in the check.

Conventions of the reader: a tilde is dropped (the modules say which quantities are dimensionless);
a bar makes ``mean_mu_s``, which is mu_s unless a module says otherwise, and ``Delta_mu`` is
mu_s - mu_d; a subscript that holds an
index becomes an argument (``x_{n+1}`` is ``x(n + 1)``, ``f_{i \\to i-1}`` is ``f(i, i - 1)``,
``\\mu_{\\mathrm{s},2}`` is ``mu_s(2)``); what stands behind a slash up to the end of the product is
the denominator; ``<v_G>`` is the symbol ``v_G``.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import sympy as sp

Expression = Any
"""A SymPy expression."""

_POSITIVE = (
    "l_0 mu_d mu_s sigma_mu sigma_theta A_theta m g k M L Y rho kappa tau_dyn tau_th c_s R "
    "delta D P Delta_mu c"
)
_INTEGER = "N n i j p q"


def symbol(name: str) -> Expression:
    """Return the symbol of a name, with the assumptions that hold for it throughout."""
    if name in _INTEGER.split():
        return sp.Symbol(name, integer=True, positive=True)
    if name in _POSITIVE.split():
        return sp.Symbol(name, positive=True)
    return sp.Symbol(name, real=True)


N, n, i, j = (symbol(name) for name in ["N", "n", "i", "j"])
l0, mu_d, mu_s, sigma_mu = (symbol(name) for name in ["l_0", "mu_d", "mu_s", "sigma_mu"])
amplitude, sigma_theta = symbol("A_theta"), symbol("sigma_theta")
alpha, theta = symbol("alpha"), symbol("theta")
L, Y, rho, kappa = (symbol(name) for name in ["L", "Y", "rho", "kappa"])
tau_th, tan, star = symbol("tau_th"), symbol("t"), symbol("A_theta_star")
c, s = symbol("c"), symbol("s")
"""Cosine and sine of alpha, as independent symbols: everything is a polynomial in them."""

slope_margin = mu_d * c - s
"""m, by which dynamical friction exceeds the weight's component along the incline."""
static_margin = mu_s * c - s
"""a, the same for static friction."""
excess = (mu_s - mu_d) * c
"""D, the driving force of a slip that starts from the static threshold."""

_SHORT = sp.symbols("m a D")


@cache
def brief(expression: Expression) -> Expression:
    """Return an expression in m, a and D, if that makes it shorter."""
    expression = sp.sympify(expression)
    if not expression.free_symbols & {mu_s, s}:
        return expression
    margin, static, jump = _SHORT
    ways = (
        {mu_s: mu_d + jump / c, s: mu_d * c - margin},
        {mu_d: mu_s - jump / c, s: mu_s * c - static},
        {mu_s: mu_d + jump / c},
    )
    forms = [expression, sp.factor(expression)]
    for way in ways:
        shorter = expression
        for name, value in way.items():
            shorter = shorter.subs(name, value)
        forms.append(sp.factor(sp.cancel(sp.expand(shorter))))
    return min(forms, key=lambda form: len(str(form)))


_CAPTIONS = {
    "N": 30, "i": 9, "l_0": 1000, "mu_d": "1/2", "mu_s": "3/5", "sigma_mu": "1/100",
    "A_theta": "1/200", "sigma_theta": "1/100", "Delta_theta": "1/100", "tau_th": 1, "m": 1,
    "g": 1, "kappa": "1/100000",
}  # fmt: skip
_SOLID = {"g": "9.81", "rho": 10**4, "L": "0.01", "Y": 10**11}
CAPTIONS, SOLID = (
    {symbol(name): sp.Rational(number) for name, number in given.items()}
    for given in (_CAPTIONS, _SOLID)
)
"""The captions' parameters, with m = g = tau_th = 1; the paper's solid, in SI units."""
CAPTIONS |= {c: 4 / sp.sqrt(17), s: 1 / sp.sqrt(17)}

x, f, S = sp.Function("x"), sp.Function("f"), sp.Function("S")


ceil, floor, positive_part, least = map(sp.Function, ("ceil", "floor_", "positive_part", "least"))
"""The least whole number that is not below, and the largest that is not above; the number itself,
or zero if that is larger; the lesser of two."""


def evaluated(expression: Expression) -> Expression:
    """Return an expression with these functions as SymPy has them."""
    known = {ceil: sp.ceiling, floor: sp.floor, least: sp.Min}
    for function, meaning in known.items():
        expression = expression.replace(function, meaning)
    return expression.replace(positive_part, lambda of: sp.Max(0, of))


class NotationError(ValueError):
    """A text that is no formula in the paper's notation."""


@dataclass(frozen=True)
class Formula:
    """A formula read from its text.

    Attributes
    ----------
    sides : tuple of Expression
        The sides of a chain of relations (one side: a bare expression).
    relations : tuple of str
        The relations between them: ``=``, ``~`` (any sign for approximately equal), ``<``, ``>``,
        ``<<``, ``>>``.
    """

    sides: tuple[Expression, ...]
    relations: tuple[str, ...]

    @property
    def left(self) -> Expression:
        return self.sides[0]

    @property
    def right(self) -> Expression:
        return self.sides[-1]

    def bound(self, bindings: Mapping[Any, Any]) -> Formula:
        """Return the formula with derived expressions for symbols and indexed quantities."""
        return Formula(tuple(bind(side, bindings) for side in self.sides), self.relations)


def at(values: Mapping[Any, Expression]) -> Callable[..., Expression]:
    """Return an indexed quantity: what it is at some indices, and something unknown elsewhere."""
    known = {str(sp.sympify(index)): value for index, value in values.items()}

    def quantity(*indices: Expression) -> Expression:
        index = str(indices if len(indices) > 1 else indices[0])
        return known.get(index, sp.Symbol(f"unknown_{index}"))

    return quantity


def bind(expression: Expression, bindings: Mapping[Any, Any]) -> Expression:
    """Return an expression in c and s, with symbols and functions replaced.

    Parameters
    ----------
    expression : Expression
        As read.
    bindings : mapping
        From symbols or applied functions to expressions, or from function names to callables that
        take the arguments and return an expression.
    """
    expression = sp.sympify(expression)
    for key, value in bindings.items():
        if isinstance(key, str):
            expression = expression.replace(sp.Function(key), value)
    plain = {key: value for key, value in bindings.items() if not isinstance(key, str)}
    expression = expression.subs(plain, simultaneous=True)
    expression = expression.subs({symbol("mean_mu_s"): mu_s, symbol("Delta_mu"): mu_s - mu_d})
    expression = expression.subs({sp.cos(alpha): c, sp.sin(alpha): s, sp.tan(alpha): s / c})
    for function in (ceil, floor, positive_part):  # what they are of, in one form
        expression = expression.replace(function, lambda of, at=function: at(sp.factor(of)))
    return expression.replace(least, lambda *of: least(*sorted(map(sp.factor, of), key=str)))


def creeps(advance: Expression) -> dict[Any, Any]:
    """Return the velocities v_G and v_N_star (plateau i) of an advance per half-cycle."""
    velocity = advance / tau_th
    return {symbol("v_G"): velocity, "v_N_star": lambda index: velocity.subs(i, index)}


_RELATIONS = {
    "=": "=",
    "<": "<",
    ">": ">",
    "\\equiv": "=",
    "\\simeq": "~",
    "\\approx": "~",
    "\\sim": "~",
    "\\gg": ">>",
    "\\ll": "<<",
}
_FUNCTIONS: dict[str, Callable[[Expression], Expression]] = {
    "\\sin": sp.sin,
    "\\cos": sp.cos,
    "\\tan": sp.tan,
    "\\exp": sp.exp,
    "\\arctan": sp.atan,
}
_ACCENTS = {"\\tilde": "", "\\overline": "mean_", "\\dot": "dot_", "\\ddot": "ddot_"}
_GREEK = ["alpha", "mu", "sigma", "theta", "kappa", "tau", "rho", "delta", "phi", "psi"]
_IGNORED = r"\\(?:nonumber|left|right|Bigl|Bigr|bigl|bigr|quad)(?![A-Za-z])|\\\\|\\[,;:! ]|[&~$\s]"
_TOKEN = re.compile(r"\\[A-Za-z]+|\d+(?:\.\d+)?|[A-Za-z]|[-+*/^_{}()\[\]|=<>,.]")
_CALLED = ("S", "p", "l", "psi", "I")
_INDEXED = ("x", "dot_x", "ddot_x", "Delta_x")
_ENDS = ("+", "-", ")", "]", "}", ",", "\\rceil", "\\rfloor")
_ROUNDED = {"\\lceil": ceil, "\\lfloor": floor}
_CLOSING = {"(": ")", "[": "]", "{": "}"}


def _tokens(text: str) -> list[str]:
    text = re.sub(r"<\s*\\tilde\{v\}_G\s*>", " v_G ", text)
    tokens: list[str] = []
    position = 0
    for gap in re.finditer(_IGNORED + r"|$", text):
        piece = text[position : gap.start()]
        position = gap.end()
        end = 0
        for token in _TOKEN.finditer(piece):
            if token.start() != end:
                raise NotationError(f"no formula: {piece[end:]!r}")
            tokens.append(token.group())
            end = token.end()
        if end != len(piece):
            raise NotationError(f"no formula: {piece[end:]!r}")
    return tokens


class _Reader:
    """Recursive descent over the tokens of one formula."""

    def __init__(self, tokens: list[str]) -> None:
        self.tokens = tokens
        self.position = 0
        self.bars = 0

    def peek(self, ahead: int = 0) -> str:
        place = self.position + ahead
        return self.tokens[place] if place < len(self.tokens) else ""

    def take(self, expected: str | None = None) -> str:
        token = self.peek()
        if not token or (expected is not None and token != expected):
            raise NotationError(f"expected {expected or 'more'}, found {token or 'the end'}")
        self.position += 1
        return token

    def formula(self) -> Formula:
        sides = [self.sum()]
        relations: list[str] = []
        while self.peek() in _RELATIONS:
            relations.append(_RELATIONS[self.take()])
            sides.append(self.sum())
        if self.peek():
            raise NotationError(f"left over: {' '.join(self.tokens[self.position :])}")
        return Formula(tuple(sides), tuple(relations))

    def sum(self) -> Expression:
        sign = -1 if self.peek() == "-" else 1
        if self.peek() in ("+", "-"):
            self.take()
        total = sign * self.product()
        while self.peek() in ("+", "-"):
            sign = -1 if self.take() == "-" else 1
            total += sign * self.product()
        return total

    def product(self) -> Expression:
        value = self.power()
        while True:
            token = self.peek()
            if token == "/":
                self.take()
                return value / self.product()
            if not token or token in _ENDS or token in _RELATIONS:
                return value
            if token == "|" and self.bars:
                return value
            value = value * self.power()

    def power(self) -> Expression:
        base = self.atom()
        if self.peek() == "^":
            self.take()
            return base ** self.exponent()
        return base

    def exponent(self) -> Expression:
        if self.peek() == "{":
            return self.enclosed()
        return self.atom()

    def enclosed(self) -> Expression:
        opening = self.take()
        if opening not in _CLOSING:
            raise NotationError(f"expected a bracket, found {opening}")
        closing = _CLOSING[opening]
        value = self.sum()
        self.take(closing)
        return value

    def atom(self) -> Expression:
        token = self.peek()
        if token[:1].isdigit():
            return sp.Rational(self.take())
        if token in _CLOSING:
            return self.enclosed()
        if token == "|":
            self.take()
            self.bars += 1
            value = self.sum()
            self.take("|")
            self.bars -= 1
            return sp.Abs(value)
        if token == "\\frac":
            self.take()
            return self.enclosed() / self.enclosed()
        if token in _ROUNDED:
            self.take()
            value = self.sum()
            self.take(token.replace("\\l", "\\r"))
            return _ROUNDED[token](value)
        if token in ("\\min", "\\max"):
            self.take()
            self.take("(")
            first = self.sum()
            self.take(",")
            second = self.sum()
            self.take(")")
            if token == "\\max" and first != 0:
                raise NotationError("only a part that is positive, max(0, ...), is known")
            return least(first, second) if token == "\\min" else positive_part(second)
        if token == "\\sqrt":
            self.take()
            return sp.sqrt(self.enclosed())
        if token in _FUNCTIONS:
            self.take()
            return _FUNCTIONS[token](self.atom())
        if token == "\\pi":
            self.take()
            return sp.pi
        return self.quantity()

    def base(self) -> str:
        token = self.take()
        if token == "\\Delta":
            return "Delta_" + self.base()
        if token in _ACCENTS:
            if self.peek() == "{":
                self.take("{")
                inner = self.base()
                self.take("}")
            else:
                inner = self.base()
            return _ACCENTS[token] + inner
        if token.startswith("\\") and token[1:] in _GREEK:
            return token[1:]
        if token.isalpha() and len(token) == 1:
            return token
        raise NotationError(f"unknown symbol {token}")

    def quantity(self) -> Expression:
        name = self.base()
        subscript = self.subscript() if self.peek() == "_" else []
        mark = ""
        if self.peek() == "^" and self.peek(1) in ("*", "+", "-"):
            self.take()
            mark = {"*": "_star", "+": "_plus", "-": "_minus"}[self.take()]
        if name in _CALLED and not subscript and self.peek() == "(":
            return sp.Function(name)(self.enclosed())
        if name in ("f", "Delta_f") and "\\to" in subscript:
            cut = subscript.index("\\to")
            return sp.Function(name)(_index(subscript[:cut]), _index(subscript[cut + 1 :]))
        if "," in subscript:
            cut = subscript.index(",")
            head = "".join(subscript[:cut])
            return sp.Function(f"{name}_{head}{mark}")(_index(subscript[cut + 1 :]))
        if name in _INDEXED and subscript and subscript != ["G"]:
            return sp.Function(name + mark)(_index(subscript))
        return symbol(name + ("_" + "".join(subscript).lstrip("\\") if subscript else "") + mark)

    def subscript(self) -> list[str]:
        self.take("_")
        if self.peek() == "\\mathrm":
            self.take()
        if self.peek() != "{":
            return [self.take()]
        depth = 0
        found: list[str] = []
        while True:
            token = self.take()
            if token == "{":
                depth += 1
            elif token == "}":
                depth -= 1
                if depth == 0:
                    return found
            elif token != "\\mathrm":
                found.append(token)


def _index(tokens: list[str]) -> Expression:
    reader = _Reader(list(tokens))
    value = reader.sum()
    if reader.peek():
        raise NotationError(f"no index: {' '.join(tokens)}")
    return value


def read(text: str) -> Formula:
    """Return the formula that a piece of the paper's LaTeX says.

    Raises
    ------
    NotationError
        If the text is no formula in the paper's notation.
    """
    return _Reader(_tokens(text)).formula()
