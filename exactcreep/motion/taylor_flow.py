"""Move sliders by a Taylor series in float64 with a proved bound of its error.

The same propagator moves the middle of a set of states, its rows, and the rows of a derivative:
columns of an array, ``v^(k+2) = -K v^(k)``, in steps of at most `STEP`, with only sums and
products. Three facts about K, whose norm is at most 4, bound everything: over a time t the
propagators of x'' = -K x have norms

    |cos(sqrt(K) t)| <= 1,    |sin(sqrt(K) t) / sqrt(K)| <= t,    |sqrt(K) sin(sqrt(K) t)| <= 2.

With ``S = |v| + |a| / 2`` (Euclidean) and ``t <= 1/2`` the k-th term of the series is at most
``S / k!``: the remainder beyond `ORDER` is below ``2^-60 S``, and the roundings of recurrence
and sum stay below ``128 units of roundoff = 2^-46 S``; a factor of 4 is added (`ROUNDING`). A state
that differs by W at the beginning (Euclidean) differs by at most ``W (1 + t)`` in its velocities,
``3 W`` in its accelerations, ``W (t + t^2 / 2)`` in its places.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from exactcreep.compiling import njit

STEP = 0.5
ORDER = 20
ROUNDING = 2.0**-44
OUTWARD = 1e-9
"""Relative; far more than the rounding of the few operations that follow a bound."""


@njit(cache=True)
def size_of(v: Any, a: Any) -> float:
    """Return ``S = |v| + |a| / 2`` of a column, rounded up."""
    speed, force = 0.0, 0.0
    for i in range(len(v)):
        speed += v[i] * v[i]
        force += a[i] * a[i]
    return (math.sqrt(speed) + math.sqrt(force) / 2) * (1 + OUTWARD)


@njit(cache=True)
def expand(series: Any, springs: Any, signs: Any, v: Any, a: Any) -> None:
    """Fill in the coefficients of the velocities, ``series[k, slider, column] t^k``; 0 at rest."""
    n, columns = v.shape
    for i in range(n):
        for c in range(columns):  # whole rows at once would take four seconds longer to compile
            series[0, i, c], series[1, i, c] = v[i, c], a[i, c]
    for k in range(ORDER - 1):
        factor = -1.0 / ((k + 1) * (k + 2))
        for i in range(n):
            if signs[i] == 0:
                series[k + 2, i] = 0.0
                continue
            for c in range(columns):
                bent = springs[i] * series[k, i, c]
                if i > 0:
                    bent -= series[k, i - 1, c]
                if i < n - 1:
                    bent -= series[k, i + 1, c]
                series[k + 2, i, c] = bent * factor


@njit(cache=True)
def carry(series: Any, v: Any, a: Any, t: float) -> Any:
    """Take velocities and accelerations to `t`, and return the displacements."""
    x = np.zeros_like(v)
    v[:], a[:] = 0.0, 0.0
    for k in range(ORDER, -1, -1):
        share = 1.0 / (k + 1)
        for i in range(v.shape[0]):
            for c in range(v.shape[1]):
                x[i, c] = x[i, c] * t + series[k, i, c] * share
                a[i, c] = a[i, c] * t + v[i, c]
                v[i, c] = v[i, c] * t + series[k, i, c]
    return x * t


@njit(cache=True)
def flow(springs: Any, signs: Any, v: Any, a: Any, time: float) -> Any:
    """Let a time pass; return displacements, size at the beginning, and a bound of the rounding.

    Of velocities and accelerations, shape (sliders, columns), which are taken along. Both numbers
    are summed over the columns.
    """
    n, columns = v.shape
    series, way = np.empty((ORDER + 1, n, columns)), np.zeros_like(v)
    steps = max(1, math.ceil(time / STEP))
    rounding, first = 0.0, 0.0
    for step in range(steps):
        size = 0.0
        for c in range(columns):
            size += size_of(v[:, c], a[:, c])
        if step == 0:
            first = size
        rounding += ROUNDING * size * math.sqrt(np.count_nonzero(signs))
        expand(series, springs, signs, v, a)
        way += carry(series, v, a, time / steps)
    return way, first, rounding
