"""Mutants of a formula: one sign, coefficient, index, relation or number changed."""

from __future__ import annotations

import re
from collections.abc import Iterator

import sympy as sp

from derivations.judges import at_a_point
from derivations.notation import NotationError, read

_INDEX = re.compile(r"(?<![A-Za-z\\])([nijN])(?![A-Za-z])")
_COEFFICIENT = re.compile(
    r"(?:\\overline\{\\mu\}|\\mu)_(?:\\mathrm\{([sd])\}|\{\\mathrm\{([sd])\}(?:,[^}]*)?\}|([sd]))"
)
_NUMBER = re.compile(r"\d+(?:\.\d+)?")
_RELATION = re.compile(
    r"<(?!\\tilde\{v\})|(?<!v\}_G)>|\\gg|\\ll|\\equiv|\\simeq|\\approx|\\sim(?![a-z])|="
)


def _in_mathrm(text: str, at: int) -> bool:
    """Return whether a letter is the head of a subscript such as N,i (a name, no index)."""
    return text[at] == "N" and text[at + 1 : at + 2] == ","


def _with(text: str, match: re.Match[str], other: str) -> str:
    return text[: match.start()] + other + text[match.end() :]


def mutants(text: str) -> Iterator[tuple[str, str]]:
    """Yield (what was done, mutated text)."""
    for at, char in enumerate(text):
        if char in "+-" and text[at - 1 : at] != "^":
            other = "-" if char == "+" else "+"
            yield f"sign at {at}", text[:at] + other + text[at + 1 :]
    relations = list(_RELATION.finditer(text))
    if not relations:
        yield "sign of the whole", f"-[{text}]"
    else:
        cut = relations[-1].end()
        cut += len(text[cut:]) - len(text[cut:].lstrip("& "))
        yield "sign of the right-hand side", f"{text[:cut]} -[{text[cut:]}]"
    for match in _COEFFICIENT.finditer(text):
        kind = next(group for group in match.groups() if group)
        other = "d" if kind == "s" else "s"
        yield f"coefficient at {match.start()}", _with(text, match, f"\\mu_\\mathrm{{{other}}}")
    for match in _INDEX.finditer(text):
        letter, at = match.group(), match.start()
        if _in_mathrm(text, at):
            continue
        if text[:at].endswith("_"):
            shifted = f"{{{letter}+1}}"
        elif text[:at].endswith("_\\mathrm{") or re.search(
            r"(_\{[^{}]*|\\to ?|_\\mathrm\{N,)$", text[:at]
        ):
            shifted = f"{letter}+1"
        else:
            shifted = f"({letter}+1)"
        yield f"index {letter} at {at}", _with(text, match, shifted)
    for match in _RELATION.finditer(text):
        other = {"<": ">", ">": "<", "\\gg": "\\ll", "\\ll": "\\gg"}.get(match.group())
        if other:
            yield f"relation at {match.start()}", _with(text, match, f" {other} ")
    for match in _NUMBER.finditer(text):
        before = text[: match.start()]
        if before.endswith(("l}_", "_")) and match.group() == "0":
            continue  # the name l_0
        number = match.group()
        changed = str(int(number) + 1 if number.isdigit() else 2 * float(number))
        yield f"number at {match.start()}", _with(text, match, changed)


def equivalent(one: str, other: str) -> bool:
    """Return whether two texts say the same thing by algebra alone."""
    try:
        a, b = read(one), read(other)
    except NotationError:
        return False
    if a.relations != b.relations:
        return False
    if not set(a.relations) <= {"=", "~"} or not a.relations:
        return all(_same(p, q) for p, q in zip(a.sides, b.sides, strict=True))
    # an equation is the same if the difference of its sides is, up to a number
    for k in range(len(a.relations)):
        first, second = a.sides[k] - a.sides[k + 1], b.sides[k] - b.sides[k + 1]
        at_one_point = at_a_point(first), at_a_point(second)
        if (at_one_point[0] == 0) != (at_one_point[1] == 0):
            return False
        if at_one_point[0] != 0 and not _same(first, at_one_point[0] / at_one_point[1] * second):
            return False
    return True


def _same(one: sp.Expr, other: sp.Expr) -> bool:
    """Return whether two expressions agree; most differ at the first point already."""
    difference = sp.sympify(one) - sp.sympify(other)
    return all(abs(at_a_point(difference, shift)) < 1e-9 for shift in (0, 1, 5))
