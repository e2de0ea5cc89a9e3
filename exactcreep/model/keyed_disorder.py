"""Keyed disorder: every random number is a function of its seed and its purpose.

The k-th static coefficient of slider n and the q-th random dilation are words of the counter-based
generator Philox 4x64-10 (Salmon et al. 2011; NumPy's words), turned into a normal deviate by the
inverse distribution function. All solvers, precisions and machines draw the same disorder, in any
order, since only +, -, *, / and the square root are used.
"""

from __future__ import annotations

from fractions import Fraction
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.chain import Chain
from exactcreep.model.numbers import InputError, nearest_float, refusing, whole_number

STREAM_COEFFICIENT = 1
STREAM_DILATION = 2
STREAM_TENSION = 3
LARGEST_DEVIATE = 9
"""Bound of all normal deviates; the largest from 53 bits is 8.3."""


def deviates(
    seed: int, stream: int, n: int, first: int, count: int, rows: int = 1
) -> NDArray[np.float64]:
    """Return normal deviates `first`, ... of a stream, a row for each slider from `n` on."""
    out = np.empty((rows, count))
    # imported late, so that a run without draws needs no compiler
    made: Any = import_module("exactcreep.model.deviates")
    made.deviates(np.uint64(seed), np.uint64(stream), np.int64(n), np.int64(first), out)
    return out


def valid_seed(seed: Any) -> int:
    if seed is None:
        raise InputError("seed", None, "must be a whole number: no run is random; default 0")
    return whole_number(seed, "seed", least=0, most=2**64 - 1)


def first_coefficients(chain: Chain, seed: int) -> NDArray[np.float64]:
    """Return the initial static coefficients of the sliders (draw k = 0), shape (n,)."""
    mean = chain.floats("mu_s")
    if chain.sigma_mu == 0:
        return mean
    drawn = deviates(seed, STREAM_COEFFICIENT, 1, 0, 1, rows=chain.n)[:, 0]
    return drawn * nearest_float(chain.sigma_mu) + mean


def _mean(chain: Chain, n: int) -> Fraction:
    mean: Fraction = chain.mu_s[n - 1] if isinstance(chain.mu_s, tuple) else chain.mu_s
    return mean


@refusing
def static_coefficients(
    chain: Chain, seed: int, n: int, first: int, count: int
) -> NDArray[np.float64]:
    """Return draws `first` .. `first + count - 1` of slider `n` as float64, shape (count,).

    Parameters
    ----------
    chain : Chain
        Provides `mu_s` and `sigma_mu`.
    seed : int
        Seed of the disorder.
    n : int
        The slider, from 1.
    first, count : int
        The first draw, from 0, and the number of draws.

    Returns
    -------
    ndarray, shape (count,)
        As drawn: below `mu_d` they act as `mu_d`.

    Examples
    --------
    >>> chain = Chain(3, 1000, "0.5", "0.6", "0.01", tan_alpha="0.25")
    >>> static_coefficients(chain, seed=1, n=2, first=0, count=2).round(4)
    array([0.6039, 0.5999])
    """
    mean = nearest_float(_mean(chain, n))
    if chain.sigma_mu == 0:
        return np.full(count, mean)
    width = nearest_float(chain.sigma_mu)
    return np.asarray(mean + width * deviates(seed, STREAM_COEFFICIENT, n, first, count)[0])


@refusing
def static_coefficient(chain: Chain, seed: int, n: int, k: int) -> float | Fraction:
    """Return the k-th static friction coefficient of slider `n` (k = 0: the initial one).

    The drawn float64 is the exact value; below `mu_d` it acts as `mu_d`. With ``sigma_mu = 0`` it
    is the rational `mu_s` of the slider. Source: Eq. 11.

    Parameters
    ----------
    chain : Chain
        Provides `mu_s` and `sigma_mu`.
    seed : int
        Seed of the disorder.
    n : int
        The slider, from 1.
    k : int
        The draw, from 0.

    Returns
    -------
    float or Fraction
        The coefficient as drawn.

    Raises
    ------
    InputError
        If a number is out of range.

    Examples
    --------
    >>> chain = Chain(3, 1000, "0.5", "0.6", "0.01", tan_alpha="0.25")
    >>> round(static_coefficient(chain, seed=1, n=2, k=0), 4)
    0.6039
    """
    n = whole_number(n, "n", least=1, most=chain.n)
    k = whole_number(k, "k", least=0, most=2**62)
    seed = valid_seed(seed)
    if chain.sigma_mu == 0:
        return _mean(chain, n)
    return float(static_coefficients(chain, seed, n, k, 1)[0])


@refusing
def uniform_tensions(seed: int, count: int) -> NDArray[np.float64]:
    """Return `count` numbers uniform in (-1, 1), for random initial tensions.

    Parameters
    ----------
    seed : int
        Seed of the start.
    count : int
        How many.

    Returns
    -------
    ndarray, shape (count,)
        To be multiplied by a size.

    Examples
    --------
    >>> uniform_tensions(seed=1, count=2).round(4)
    array([0.273 , 0.2389])
    """
    key = np.array([seed, STREAM_TENSION], dtype=np.uint64)
    word = np.random.Philox(key=key, counter=[0, 0, 0, 0]).random_raw(count)
    return (word >> np.uint64(11)).astype(np.float64) * 2.0**-52 + (2.0**-53 - 1.0)
