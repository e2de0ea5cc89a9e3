"""Theorems beyond the paper: amplitudes of dilation cycles between the fates of a chain."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from exactcreep.laws.forms import Form, law_values
from exactcreep.laws.operands import (
    Number,
    coerced,
    cosine,
    elementwise,
    positive_part,
    rational,
)
from exactcreep.model.chain import Chain


def at_rest_amplitude(l0: Number, tan_alpha: Number, coefficients: Sequence[Number]) -> Number:
    """Return the largest amplitude at which some state of a chain stays at rest through cycles.

    Parameters
    ----------
    l0, tan_alpha : number
        Natural length, slope (either sign).
    coefficients : sequence of number
        Effective static coefficients of sliders 1..N, N >= 2, kept since no slider slips.

    Returns
    -------
    number
        ``min(w_1, w_N, (w_1 + ... + w_N - N |s|)/2)/l0`` with ``w_n = coefficients[n - 1] c``;
        dimensionless.

    Raises
    ------
    ValueError
        If there are fewer than two sliders, or no state is at rest even without cycles.

    Notes
    -----
    Guarantee: exact; at this amplitude itself such a state exists.
    Derivation: ``derivations/shakedown.py``, at rest.
    """
    if len(coefficients) < 2:
        raise ValueError("coefficients must be those of two sliders or more: one has no spring")
    p = coerced(
        {"l0": l0, "tan_alpha": tan_alpha} | {str(k): mu for k, mu in enumerate(coefficients)}
    )
    length, slope, *held = p.values()
    sum_bound = (sum(held) - len(held) * abs(slope)) / 2
    if sum_bound < 0:
        raise ValueError(f"no state is at rest at tan_alpha = {tan_alpha}: friction is too small")
    return min(held[0], held[-1], sum_bound) * cosine(slope) / length


def _several(n: Number) -> int:
    count = int(n)
    if count != n or count < 2:
        raise ValueError(f"n must be a whole number from 2 on, not {n}")
    return count


@elementwise
def _at_rest(n: Number, l0: Number, mu_s: Number, tan_alpha: Number) -> Number:
    return at_rest_amplitude(l0, tan_alpha, [mu_s] * _several(n))


@elementwise
def _no_lasting_creep(n: Number, l0: Number, mu_d: Number, tan_alpha: Number) -> Number:
    margin = _several(n) * (mu_d - abs(tan_alpha)) / 2
    return positive_part(min(mu_d, margin) * cosine(tan_alpha) / l0)


@elementwise
def _locked_ends(n: Number, l0: Number, mu_d: Number, mu_s: Number, tan_alpha: Number) -> Number:
    count = _several(n)
    slope, friction, static = abs(rational(tan_alpha)), rational(mu_d), rational(mu_s)
    if static < friction:
        raise ValueError(f"mu_s must not be below mu_d, not {mu_s} below {mu_d}")
    if count == 3 and 3 * slope <= static:
        return math.inf
    if count <= 3 or count * (static - slope) <= 2 * static:
        return l0 * 0
    swings = static // (static - friction) if static > friction else None
    turning = 2 * mu_s if swings is None else mu_s + swings * (mu_s - mu_d)
    return min(n * (mu_s - abs(tan_alpha)) / 2, turning) * cosine(tan_alpha) / l0


@dataclass(frozen=True)
class Theorem:
    """An amplitude of dilation cycles between fates of a chain; a theorem beyond the paper.

    Attributes
    ----------
    label : str
    statement : str
        What holds below, above or at the amplitude, and for which chains.
    derivation : str
        File and part in ``derivations/``.
    form : Form
        The amplitude, dimensionless.
    """

    label: str
    statement: str
    derivation: str
    form: Form


_ALL = (
    Theorem(
        "at_rest",
        "Up to this amplitude, and at it, some state stays at rest through all cycles; "
        "above it none does (sigma_mu = 0, n >= 2)",
        "derivations/shakedown.py, at rest",
        Form("min(mu_s c, N (mu_s c - |s|)/2)/l0", _at_rest, {"sigma_mu": 0}),
    ),
    Theorem(
        "no_lasting_creep",
        "Below this amplitude no state creeps for ever, whatever the static coefficients "
        ">= mu_d of its contacts (any sigma_mu, n >= 2)",
        "derivations/shakedown.py, no lasting creep",
        Form("min(mu_d c, N (mu_d c - |s|)/2)/l0, not below 0", _no_lasting_creep),
    ),
    Theorem(
        "locked_ends",
        "Up to this amplitude, and at it, there are locked cycles in which only sliders 1 "
        "and n slip; above it there are none (sigma_mu = 0; 0: none at any amplitude, "
        "infinite: at every amplitude from mu_s c/l0 on, n = 3). Other locked cycles may "
        "exist above it",
        "derivations/shakedown.py, ends",
        Form(
            "min(N (mu_s c - |s|)/2, mu_s c + D floor(mu_s/(mu_s - mu_d)))/l0",
            _locked_ends,
            {"sigma_mu": 0},
        ),
    ),
)
EDGES: Mapping[str, Theorem] = MappingProxyType({edge.label: edge for edge in _ALL})
"""Theorems on the fate of a chain under cycles, by label."""


def edges(chain: Chain) -> dict[str, float]:
    """Return the amplitudes of `EDGES` of a chain, by label, without those that do not hold for it.

    Parameters
    ----------
    chain : Chain

    Returns
    -------
    dict of str to float
        Dimensionless amplitudes; under disorder `no_lasting_creep` alone, nothing for n = 1.
    """
    found = {}
    for label, edge in EDGES.items():
        try:
            (found[label],) = law_values(edge.form, chain.parameters())
        except ValueError:
            continue
    return found
