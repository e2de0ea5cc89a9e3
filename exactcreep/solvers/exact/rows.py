"""What the loop writes at targets."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exactcreep.compiling import inlined
from exactcreep.solvers.exact import layout
from exactcreep.solvers.exact.double_double import times, two_sum
from exactcreep.solvers.exact.layout import PAD
from exactcreep.solvers.exact.simd import fused
from exactcreep.solvers.tables import TargetRows

TENSION, TENSION_LOW, PLACE, PLACE_LOW, HELD, HELD_LOW = range(6)
"""Rows of the start of a simulation; the tensions leave the last column free."""


class AtTargets(NamedTuple):
    """What the loop writes at every target; an array without rows is not written."""

    rows: TargetRows
    doubts: NDArray[np.int64]  # undecided comparisons so far
    x_G_low: NDArray[np.float64]  # x_G minus its rounded value
    began: tuple[Any, ...]  # see `Origin.began`

    @classmethod
    def of(cls, count: int, record: tuple[str, ...], began: tuple[Any, ...]) -> AtTargets:
        """Return room for `record` at `count` targets."""
        rows = TargetRows.empty(record, count, began[0].shape[1])
        return cls(rows, np.empty(count, np.int64), np.empty(count), began)


NOTHING = AtTargets.of(1, (), (np.empty((6, 1)), np.empty((2, 0)), 0.0, 0.0))
"""A place for data that nobody requests."""


@inlined
def increased(sums, value, low):
    """Add two floats to a sum, and the rounding error and their own low part to its error."""
    total, rounded = two_sum(sums[0], value)
    return total, sums[1] + (rounded + low)


@inlined
def displacement(cell, i):
    """Return the displacement of the slider in column i since the start of the simulation."""
    return cell[layout.TRAVEL, i] + (cell[layout.TRAVEL_LOW, i] + cell[layout.X, i])


@inlined
def of_theta(cell, now, i):
    """Return the effect of theta on the force on the slider in column i, as two floats."""
    return times(cell[layout.RATE, i], cell[layout.RATE_LOW, i], now.theta, now.theta_low)


@inlined
def tension(cell, now, began, k):
    """Return the tension below slider k, from its initial value, displacements and theta."""
    i = k + PAD
    right, left = cell[layout.TRAVEL, i + 1], -cell[layout.TRAVEL, i]
    right_low = cell[layout.TRAVEL_LOW, i + 1] + cell[layout.X, i + 1]
    left_low = -(cell[layout.TRAVEL_LOW, i] + cell[layout.X, i])
    origin, expansion, load, load_low = began
    sums = origin[TENSION, k], origin[TENSION_LOW, k]
    sums = increased(sums, right, right_low)
    sums = increased(sums, left, left_low)
    sums = increased(sums, -origin[PLACE, k + 1], -origin[PLACE_LOW, k + 1])
    sums = increased(sums, origin[PLACE, k], origin[PLACE_LOW, k])
    share, low = expansion[0, k], expansion[1, k]
    theta, theta_low = times(share, low, now.theta, now.theta_low)
    load, load_low = times(share, low, load, load_low)
    sums = increased(sums, -theta, -theta_low)
    total, error = increased(sums, load, load_low)
    return total + error


@inlined
def at_target(cell, whole, now, targets, q):
    """Write the requested data at a target."""
    rows, n = targets.rows, now.chain.n
    x_G = (now.total + now.total_low) / n
    rows.x_G[q] = x_G
    targets.x_G_low[q] = (now.total_low - fused(x_G, float(n), -now.total)) / n
    targets.doubts[q] = now.counts.undecided
    if rows.x.shape[0] > 0:
        for k in range(n):
            rows.x[q, k] = displacement(cell, k + PAD)
    if rows.tension.shape[0] > 0:
        for k in range(n - 1):
            rows.tension[q, k] = tension(cell, now, targets.began, k)
    if rows.slips.shape[0] > 0:
        for k in range(n):
            rows.slips[q, k] = whole[layout.SLIPS, k + PAD]
            whole[layout.SLIPS, k + PAD] = 0
