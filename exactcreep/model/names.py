"""Compare names: suggest a known name for an unknown one, and find the name that differs."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from difflib import get_close_matches
from typing import Any

from exactcreep.model.numbers import shown

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


def did_you_mean(name: object, known: Iterable[str]) -> str:
    """Return the end of a sentence that suggests a known name, or "" if none is near."""
    near = meant(name, known)
    return f" (did you mean {near}?)" if near else ""


def difference(
    known: Mapping[str, Any], wanted: Mapping[str, Any], text: Callable[[Any], str]
) -> str:
    """Say the first dotted key whose values differ in their texts; "" if there is none."""
    there, here = dict(_leaves(known)), dict(_leaves(wanted))
    for key in {**here, **there}:
        if text(there.get(key)) != text(here.get(key)):
            return f"{key} is {shown(there.get(key))} there, and {shown(here.get(key))} here"
    return ""


def _leaves(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from _leaves(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value
