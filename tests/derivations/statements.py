"""Mutants of statements: a number or sign of a text changed, and whether anything notices."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from random import Random

from derivations.ledger import Entry, entries, entry_of

DERIVATIONS = Path(__file__).parents[2] / "derivations"
NUMBER = re.compile(r"(?<![A-Za-z_\\])\d+(?:\.\d+)?|\.\d+")
SIGN = re.compile(r"(?<=[\s(\[«{=$])[-+](?=[\s\\\w(«{])|[<>](?!=)|(?<=\s)[-+](?=\s)")
_WORDS = (
    r"\b[lrT]_?0\b|\.\.\.|(?<=[A-Za-z)])-(?=[A-Za-z])|->|\balpha\*|\b(?:A|sigma|theta)\*"
    r"|\bEq\. \d+"
)
"""Names with a digit or an asterisk in them, equations by number, hyphens, arrows, dots."""
_NAMED = re.compile(_WORDS)
_LITERAL = re.compile(r"\d+|[-+*/^<>]")


def changed(text: str) -> Iterator[str]:
    """Yield a text with one of its numbers or signs changed; how many digits it prints is none."""
    braces = [range(*found.span()) for found in re.finditer(r"\{\w+:[^{}]*\}", text)]
    for match in NUMBER.finditer(text):
        if any(match.start() in inside for inside in braces):
            continue
        number = match.group()
        other = str(int(number) + 1) if number.isdigit() else f"{2 * float(number):g}"
        yield text[: match.start()] + other + text[match.end() :]
    for match in SIGN.finditer(text):
        other = {"-": "+", "+": "-", "<": ">", ">": "<"}[match.group()]
        yield text[: match.start()] + other + text[match.end() :]


def of_ledger() -> Iterator[tuple[Entry, str, str]]:
    """Yield entries, the key of one of their texts, and that text changed."""
    for entry in entries():
        for key, value in entry.raw.items():
            for text in value if isinstance(value, list) else [value]:
                if key in ("law", "by", "place", "equation", "label", "repair"):
                    continue
                for other in changed(str(text)):
                    yield entry, key, other


def noticed(entry: Entry, key: str, other: str) -> bool:
    """Return whether the audit refutes an entry with one of its texts changed.

    Quotations are held against the paper: by `--paper`, and in the tests by their digest.
    """
    if key == "printed" and other.replace("«", "").replace("»", "") != entry.printed:
        inside = re.findall("«(.*?)»", other)
        if not inside or inside[0] == entry.formula:
            return True
    raw = dict(entry.raw)
    raw[key] = [other] if isinstance(raw[key], list) else other
    made = entry_of(entry.key, raw, entry.place)
    return bool(replace(made, number=entry.number).faults())


def literals_of(path: Path) -> Iterator[tuple[int, str]]:
    """Yield the numbers and signs that texts of a chapter state of themselves, and their lines.

    Texts of `show`, `proved` and `checked`: what stands in their literal parts, and what is
    computed in their placeholders. What is argued stands in words, and is called so.
    """
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Attribute):
            continue
        if node.func.attr not in ("show", "proved", "checked"):
            continue
        given = [node.args[0]] + (node.args[2:3] if node.func.attr != "show" else [])
        for text in given:
            parts = text.values if isinstance(text, ast.JoinedStr) else [text]
            for part in parts:
                if isinstance(part, ast.Constant):
                    for found in _LITERAL.findall(_NAMED.sub(" ", str(part.value))):
                        yield node.lineno, found
                if isinstance(part, ast.FormattedValue):
                    for inner in ast.walk(part.value):
                        if isinstance(inner, ast.BinOp | ast.UnaryOp):
                            yield node.lineno, ast.unparse(part.value)


def survivors(seed: int, count: int = 100) -> tuple[int, list[tuple[str, str]]]:
    """Return how many mutants there are to draw from, and those drawn that nothing notices.

    Each is the name of its entry, and what its text became.
    """
    sites = [*of_ledger()]
    left = []
    for entry, key, other in Random(seed).sample(sites, count):
        if key == "measured":
            continue  # test_measured.py takes its numbers from this text
        if not noticed(entry, key, other):
            left.append((entry.name, other))
    return len(sites), left
