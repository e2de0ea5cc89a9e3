"""Theorems beyond the paper: amplitudes of dilation cycles between the fates of a chain.

Derivation: ``derivations/shakedown.py``. Amplitudes are dimensionless, slopes of either sign.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise

from exactcreep.laws.number_types import (
    Number,
    coerced,
    cosine,
    each,
    positive_part,
    rational,
    real,
    require,
)
from exactcreep.laws.paper import law, law_values
from exactcreep.model.chain import Chain
from exactcreep.model.numbers import refusing


@refusing
def at_rest_amplitude(
    l0: Number,
    tan_alpha: Number,
    coefficients: Sequence[Number],
    end_forces: Sequence[Number] = (0, 0),
    expansion: Sequence[Number] = (),
) -> Number:
    """Return the largest amplitude at which some state of a chain stays at rest through cycles.

    The amplitude is ``min(w_1, w_N, (w_1 + ... + w_N - |G|)/2)/l0`` with
    ``w_n = coefficients[n - 1] cos(alpha)`` and G the sum of weights and end forces. Where springs
    expand differently, ``w_n`` is divided by ``|r_n|``, the change of the force on slider n per
    ``l0 theta``, and 2 is the sum of the ``|r_n|``. Source: beyond the paper,
    ``derivations/shakedown.py``.

    Parameters
    ----------
    l0, tan_alpha : number
        See `exactcreep.laws`.
    coefficients : sequence of number
        Static coefficients of sliders 1..N, two or more.
    end_forces : pair of numbers, optional
        Forces on slider 1 and on slider N.
    expansion : sequence of number, optional
        Weights of springs 1..N - 1.

    Returns
    -------
    number
        Amplitude of the dilation.

    Raises
    ------
    ValueError
        If there are fewer than two, no state is at rest even without cycles, or no spring expands.

    Examples
    --------
    >>> round(at_rest_amplitude(1000, 0.25, [0.6] * 3), 8)
    0.00050932
    """
    require(len(coefficients) >= 2, "coefficients must belong to two sliders or more")
    named = {str(k): mu for k, mu in enumerate(coefficients)}
    named |= {f"end_forces[{k}]": force for k, force in enumerate(end_forces)}
    named |= {f"expansion[{k}]": weight for k, weight in enumerate(expansion)}
    numbers = coerced({"l0": l0, "tan_alpha": tan_alpha} | named).values()
    count = len(coefficients)
    length, slope, *values = numbers
    held, (upper, lower), weights = values[:count], values[count:][:2], values[count + 2 :]
    around = [0, *(weights or [1] * (count - 1)), 0]
    rates = [abs(before - after) for before, after in pairwise(around)]
    require(any(rates), "expansion must not be 0 for every spring")
    require(length > 0, "l0 must be positive")
    pull = len(held) * slope + (upper + lower) / cosine(slope)
    sum_bound = (sum(held) - abs(pull)) / sum(rates)
    too_small = f"no state is at rest at tan_alpha = {tan_alpha}: friction is too small"
    require(sum_bound >= 0, too_small)
    bounds = [mu if rate == 1 else mu / rate for mu, rate in zip(held, rates, strict=True) if rate]
    return min(*bounds, sum_bound) * cosine(slope) / length


@law
def no_lasting_creep_amplitude(*, n, l0, mu_d, tan_alpha):
    """Return ``min(mu_d c, N (mu_d c - |s|)/2)/l0``, not below 0.

    Below it no state creeps for ever, whatever the static coefficients >= mu_d of its contacts.
    ``c = cos(alpha)``, ``s = sin(alpha)``. Source: beyond the paper, ``derivations/shakedown.py``.

    Parameters
    ----------
    n : int
        Number of sliders N.
    l0, mu_d, tan_alpha : number
        See `exactcreep.laws`.

    Returns
    -------
    number
        Amplitude of the dilation.

    Raises
    ------
    ValueError
        Unless n is a whole number from 2 on, and l0 positive.

    Examples
    --------
    >>> round(no_lasting_creep_amplitude(n=3, l0=1000, mu_d=0.5, tan_alpha=0.25), 8)
    0.0003638
    """
    least = min(mu_d, _several(n) * (mu_d - abs(tan_alpha)) / 2)
    return positive_part(least * cosine(tan_alpha) / l0)


@law
def locked_ends_amplitude(*, n, l0, mu_d, mu_s, tan_alpha):
    """Return ``min(N (mu_s c - |s|)/2, mu_s c + D floor(mu_s/(mu_s - mu_d)))/l0``.

    Up to and at this amplitude there are locked cycles in which only sliders 1 and n slip; above it
    there are none, but other locked cycles may exist. Only for sigma_mu = 0. ``c = cos(alpha)``,
    ``s = sin(alpha)``. Source: beyond the paper, ``derivations/shakedown.py``.

    Parameters
    ----------
    n : int
        Number of sliders N.
    l0, mu_d, mu_s, tan_alpha : number
        See `exactcreep.laws`.

    Returns
    -------
    number
        Amplitude of the dilation. 0: no amplitude has locked cycles. Infinite, for n = 3: every
        amplitude from mu_s c/l0 on has them.

    Raises
    ------
    ValueError
        If mu_s < mu_d; unless n is a whole number from 2 on, and l0 positive.

    Examples
    --------
    >>> chain = {"n": 6, "l0": 1000, "mu_d": 0.5, "mu_s": 0.6, "tan_alpha": 0.25}
    >>> round(locked_ends_amplitude(**chain), 8)
    0.00101865
    """
    count = _several(n)
    slope, friction, static = abs(rational(tan_alpha)), rational(mu_d), rational(mu_s)
    require(static >= friction, f"mu_s must not be below mu_d, not {mu_s} below {mu_d}")
    if count == 3 and 3 * slope <= static:
        return math.inf
    if count <= 3 or count * (static - slope) <= 2 * static:
        return l0 * 0
    swings = static // (static - friction) if static > friction else None
    turning = 2 * mu_s if swings is None else mu_s + swings * (mu_s - mu_d)
    return min(n * (mu_s - abs(tan_alpha)) / 2, turning) * cosine(tan_alpha) / l0


def _several(n: Number) -> int:
    count = int(real(n, "n"))
    require(count == n and count >= 2, f"n must be a whole number from 2 on, not {n}")
    return count


@refusing
def edges(chain: Chain) -> dict[str, float]:
    """Return the amplitudes between the fates of a chain, by the names of the theorems.

    Parameters
    ----------
    chain : Chain
        A chain of any slope. Three theorems hold without disorder, one with disorder. If the chain
        is not uniform, `locked_ends` is left out.

    Returns
    -------
    dict of str to float
        Results of `at_rest_amplitude`, `no_lasting_creep_amplitude`, `locked_ends_amplitude`.

    Examples
    --------
    >>> chain = Chain(6, 1000, "0.5", "0.6", tan_alpha="0.25")
    >>> {name: round(amplitude, 8) for name, amplitude in edges(chain).items()}
    {'at_rest': 0.00058209, 'no_lasting_creep': 0.00048507, 'locked_ends': 0.00101865}
    """
    parameters, clean = chain.parameters(), chain.sigma_mu == 0
    if chain.n < 2:
        return {}
    at_rest, least = (rest_edge(parameters, name) for name in ("mu_s", "mu_d"))
    amplitudes = {"at_rest": at_rest} if clean and not math.isnan(at_rest) else {}
    # Melan's bound is that of rest, with mu_d
    amplitudes["no_lasting_creep"] = 0.0 if math.isnan(least) else least
    if clean and not chain.unlike:
        (amplitudes["locked_ends"],) = law_values(locked_ends_amplitude, parameters)
    return amplitudes


def rest_edge(parameters: Mapping[str, Number], name: str) -> float:
    """Return `at_rest_amplitude` of a chain with the coefficients `name`; nan: it never rests."""
    shared = ("l0", "tan_alpha", "end_forces", "expansion")
    given = {key: parameters[key] for key in shared if key in parameters}
    try:
        return float(at_rest_amplitude(coefficients=each(parameters, name), **given))
    except ValueError:
        return math.nan
