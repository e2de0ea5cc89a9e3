"""Suggest a known name that is similar to an unknown one."""

from __future__ import annotations

import re
from collections.abc import Iterable
from difflib import get_close_matches

_BETWEEN = re.compile(r"[.\s_-]")  # the parts of a name
_NEAR = 0.61  # fraction of the letters that must agree


def meant(name: object, known: Iterable[str]) -> str:
    """Return the known name that is most similar to `name`; "" if none is near.

    A name is near if it is a part of a known name, or if more than six tenths of its letters agree.

    >>> meant("verlett", ["exact", "verlet"]), meant("xyzzy", ["exact", "verlet"])
    ('verlet', '')
    """
    if not isinstance(name, str):
        return ""
    word, bare = name.lower().lstrip("-"), {each.lstrip("-"): each for each in known}
    parts = [each for each in bare if word in _BETWEEN.split(each)]
    near = get_close_matches(word, parts or bare, 1, 0.0 if parts else _NEAR)
    return bare[near[0]] if near else ""


def one_of(name: object, known: Iterable[str], otherwise: str = "") -> str:
    """Return that a name must be one of the known names, the most similar first."""
    names = list(known)
    near = meant(name, names)
    asked = f"did you mean {near}? It " if near else ""
    return f"{asked}must be {otherwise}one of {', '.join(names)}"


def did_you_mean(name: object, known: Iterable[str]) -> str:
    """Return the end of a sentence that suggests a known name, or "" if none is near."""
    near = meant(name, known)
    return f" (did you mean {near}?)" if near else ""
