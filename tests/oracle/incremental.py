"""Follow a chain in the sliding limit by minimising energy and dissipation, step by step.

At each step of the drive the sliders go to where the elastic energy, less the work of weights and
end forces, plus the dissipation of the step is least. Nothing is known here of pivots, bounds of
tensions or plays. The displacements of one slider at a time are minimised until none moves.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numba import njit
from numpy.typing import NDArray

_SMALLEST = 1e-14  # of the largest friction: a move that no longer counts


@njit(cache=True)
def _minimise(x, tension, friction, pulls, tolerance):
    """Move sliders one by one, each to its own minimum, until none moves by `tolerance`."""
    n = x.size
    before = x.copy()
    most = tolerance
    while most >= tolerance:
        most = 0.0
        for j in range(n):
            above = tension[j - 1] if j > 0 else 0.0
            below = tension[j] if j < n - 1 else 0.0
            springs = (j > 0) + (j < n - 1)
            # the derivative of the energy at the place where the step began
            force = below - above + pulls[j] + springs * (x[j] - before[j])
            place = before[j]
            if force > friction[j]:
                place += (force - friction[j]) / springs
            elif force < -friction[j]:
                place += (force + friction[j]) / springs
            moved = place - x[j]
            x[j] = place
            if j > 0:
                tension[j - 1] += moved
            if j < n - 1:
                tension[j] -= moved
            most = max(most, abs(moved))


def follow(
    friction: Sequence[float],
    pulls: Sequence[float],
    places: Sequence[float],
    expansion: Sequence[float] = (),
    tensions: Sequence[float] = (),
    steps: int = 8,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return displacements and tensions at each of the places of ``l0 theta``.

    Parameters
    ----------
    friction : sequence of float
        Sliding friction of each slider, m g.
    pulls : sequence of float
        Weight and end force on each slider, m g.
    places : sequence of float
        The targets of ``l0 theta``, which begins at 0.
    expansion : sequence of float
        Weights of springs (default: all 1).
    tensions : sequence of float
        At the start (default: relaxed).
    steps : int
        Into which each ramp is divided.

    Returns
    -------
    x : ndarray, shape (targets, n)
    tension : ndarray, shape (targets, n - 1)
    """
    n = len(friction)
    held, pull = np.array(friction, dtype=float), np.array(pulls, dtype=float)
    weights = np.array(expansion, dtype=float) if len(expansion) else np.ones(n - 1)
    tension = np.array(tensions, dtype=float) if len(tensions) else np.zeros(n - 1)
    x, at, rows = np.zeros(n), 0.0, []
    for place in places:
        for _ in range(steps):
            tension -= weights * (place - at) / steps
            _minimise(x, tension, held, pull, _SMALLEST * held.max())
        at = place
        rows.append((x.copy(), tension.copy()))
    return np.array([row[0] for row in rows]), np.array([row[1] for row in rows])
