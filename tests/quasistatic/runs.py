"""Chains whose runs several files look at, and what refuses a file."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from exactcreep import Chain, InputError


def incline(n: int, sigma_mu: str = "0.01", **changed: Any) -> Chain:
    """Return a chain on the incline of the tests."""
    given = {"l0": 1000, "mu_d": "0.5", "mu_s": "0.6", "tan_alpha": "0.25"} | changed
    return Chain(n, sigma_mu=sigma_mu, **given)


TWO, THREE, SIX, THIRTY = (incline(n) for n in (2, 3, 6, 30))
TWO_SURE = incline(2, "0")
RECORDS = ("x_G", "x", "tension", "slips", "events")


def told(read: Callable[[], Any]) -> str:
    """Return the sentence that refuses a file; "" if it was read."""
    try:
        read()
    except InputError as error:
        return str(error)
    return ""
