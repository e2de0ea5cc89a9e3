"""Mutants of statements: a number or sign of a text changed, and whether anything notices."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from random import Random

from derivations.ledger import Entry, entries, entry_of

NUMBER = re.compile(r"(?<![A-Za-z_\\])\d+(?:\.\d+)?|\.\d+")
SIGN = re.compile(r"(?<=[\s(\[«{=$])[-+](?=[\s\\\w(«{])|[<>](?!=)|(?<=\s)[-+](?=\s)")


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
