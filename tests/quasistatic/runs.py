"""Chains whose runs several files look at, and when two of these are the same."""

from __future__ import annotations

from exactcreep import Chain, Creep

TWO = Chain(2, 1000, "0.5", "0.6", "0.01", tan_alpha="0.25")
TWO_SURE = Chain(2, 1000, "0.5", "0.6", tan_alpha="0.25")
THREE = Chain(3, 1000, "0.5", "0.6", "0.01", tan_alpha="0.25")
SIX = Chain(6, 1000, "0.5", "0.6", "0.01", tan_alpha="0.25")
RECORDS = ("x_G", "x", "tension", "slips", "events")


def same(first: Creep, second: Creep) -> bool:
    """Whether two results are the same, bit for bit, apart from the time they took."""
    a, b = first.dataset.drop_attrs(deep=False), second.dataset.drop_attrs(deep=False)
    about_a, about_b = (
        {name: repr(value) for name, value in result.dataset.attrs.items() if name != "seconds"}
        for result in (first, second)
    )
    assert about_a == about_b
    return a.identical(b)
