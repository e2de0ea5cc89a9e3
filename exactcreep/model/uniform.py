"""Refuse chains whose sliders or springs differ, for functions that need them alike."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

from exactcreep.model.numbers import InputError

FRICTION, END_FORCES, EXPANSION = "friction", "end_forces", "expansion"
EVERYTHING = frozenset({FRICTION, END_FORCES, EXPANSION})
"""Respects in which sliders and springs may differ."""
_SHOULD = {
    FRICTION: "must be the same for every slider",
    END_FORCES: "must be zero",
    EXPANSION: "must be left out: every spring expands alike",
}


def unlike(parameters: Mapping[str, Any]) -> frozenset[str]:
    """Return the respects in which a chain differs: "friction", "end_forces", "expansion"."""
    several = any(isinstance(parameters.get(name), list | tuple) for name in ("mu_d", "mu_s"))
    pulled = any(parameters.get(END_FORCES, ()))
    uneven = any(weight != 1 for weight in parameters.get(EXPANSION, ()))
    found = {FRICTION: several, END_FORCES: pulled, EXPANSION: uneven}
    return frozenset(name for name, differs in found.items() if differs)


def require_uniform(parameters: Mapping[str, Any], what: str, takes: Collection[str] = ()) -> None:
    """Raise `InputError`, about `what`, if a chain differs in a respect that is not in `takes`."""
    differs = unlike(parameters)
    for name in (FRICTION, END_FORCES, EXPANSION):
        if name in differs and name not in takes:
            listed = isinstance(parameters.get("mu_d"), list | tuple)
            field = ("mu_d" if listed else "mu_s") if name == FRICTION else name
            raise InputError(field, parameters[field], f"{_SHOULD[name]} for {what}")
