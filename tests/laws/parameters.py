"""Chains and drives at which laws are compared, and the arithmetic to compare them in."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from random import Random
from typing import Any

from mpmath.ctx_mp import MPContext

from exactcreep import laws

F = Fraction
SLOPES = [F(slope) for slope in ("3/4", "5/12", "8/15", "7/24", "20/21", "9/40")]
"""Slopes with a rational cosine."""


def context(digits: int) -> MPContext:
    fresh = MPContext()
    fresh.dps = digits
    return fresh


CONTEXT = context(60)


def random_parameters(random: Random) -> dict[str, Fraction | int]:
    """Return a random chain and drive, all rational; i is an index of its plateau."""
    n = random.randint(2, 40)
    mu_d = F(random.randint(1, 300), 200)
    tan = mu_d * F(random.randint(1, 996), 997)
    return {
        "n": n,
        "i": laws.pivot(n, tan, mu_d),
        "l0": F(random.randint(1, 10**6), random.randint(1, 999)),
        "mu_d": mu_d,
        "mu_s": mu_d + F(random.randint(1, 300), 700),
        "sigma_mu": F(random.randint(0, 100), 1001),
        "tan_alpha": tan,
        "amplitude": F(random.randint(1, 10**4), 10**6),
        "sigma_theta": F(random.randint(1, 10**4), 10**6),
    }


def in_context(p: Mapping[str, Fraction | int]) -> dict[str, Any]:
    return {
        name: value if name in ("n", "i") else CONTEXT.mpf(value.numerator) / value.denominator
        for name, value in p.items()
    }


def floats(p: Mapping[str, Fraction | int]) -> dict[str, Any]:
    return {name: value if name in ("n", "i") else float(value) for name, value in p.items()}
