"""What the loop writes at targets, and logs: slips, rests and their elastic energy.

Elastic energy is computed without tensions. A ramp by d of ``l0 theta`` lowers every tension by d,
and the energy by d times the mean of their sum before and after. In a rearrangement the energy is a
quadratic function of the displacements whose gradient is minus the elastic forces: it changes by
minus the displacements times the mean of these forces before and after. Friction dissipates
``mu_d cos(alpha)`` times the path of every slip, and gravity does work ``sin(alpha)`` times every
displacement. If both add up to the change of elastic energy, each slip ended at rest.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exactcreep.compiling import apart, inlined
from exactcreep.solvers.exact import layout
from exactcreep.solvers.exact.double_double import plus, times, two_sum
from exactcreep.solvers.exact.layout import PAD
from exactcreep.solvers.exact.simd import fused
from exactcreep.solvers.tables import TargetRows

_LEAST_FRESH = 64
"""Least rearrangements until the elastic energy is summed anew, which limits its rounding."""

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

    def part(self, first: int) -> AtTargets:
        """Return the rows from `first` on."""
        doubts, low = self.doubts[first:], self.x_G_low[first:]
        return self._replace(rows=self.rows.part(first), doubts=doubts, x_G_low=low)


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


@inlined
def room(tables):
    """Return how many more rearrangements, or slips, can be written."""
    left = tables.rests.size - tables.used[0]
    return min(left, tables.slips.size - tables.used[1])


@inlined
def at_theta(cell, now, tables):
    """Update the elastic energy and the sum of the tensions to the present theta, at rest."""
    sums = tables.sums[0]
    n = now.chain.n
    if sums.left_for > 0.0 and now.chain.even == 1:
        sums.left_for -= 1.0
        step = (now.theta - sums.at_load) + (now.theta_low - sums.at_load_low)
        tensions = sums.tensions - (n - 1) * step
        sums.elastic -= 0.5 * step * (sums.tensions + tensions)
        sums.tensions = tensions
    else:
        sums.left_for = max(_LEAST_FRESH, n)
        energy = 0.0
        tensions = 0.0
        high, low = -now.theta, -now.theta_low
        if now.chain.even == 0:
            high, low = 0.0, 0.0
        for i in range(PAD, PAD + n - 1):
            if now.chain.even == 0:
                by, by_low = of_theta(cell, now, i)
                high, low = plus(high, low + by_low, by)
            high, low = plus(high, low + cell[layout.FORCE_LOW, i], cell[layout.FORCE, i])
            high, low = plus(high, low, -cell[layout.WEIGHT, i])
            tensions += high
            energy += 0.5 * high * high
        sums.elastic = energy
        sums.tensions = tensions
    sums.at_load = now.theta
    sums.at_load_low = now.theta_low


@apart
def begin(cell, now, tables, way):
    """Begin a rearrangement after a ramp in direction `way`, 0 if there was none."""
    at_theta(cell, now, tables)
    sums = tables.sums[0]
    sums.way = way
    sums.began = 0.0
    sums.began_first = now.chain.n + 1.0
    sums.began_last = 0.0
    sums.sliders = 0.0


@apart
def start(cell, now, tables, i):
    """Begin a slip of the slider in column i."""
    tables.track[layout.T_TIME, i] = now.time
    tables.track[layout.T_X, i] = cell[layout.X, i]
    if now.number == 0:
        sums, slider = tables.sums[0], i + 1 - PAD
        sums.began += 1.0
        sums.began_first = min(sums.began_first, slider)
        sums.began_last = max(sums.began_last, slider)


@apart
def stop(cell, now, tables, i):
    """Log the slip of the slider in column i, which has drawn a new coefficient."""
    row = tables.slips[tables.used[1]]
    row.slider = i + 1 - PAD
    row.rearrangement = now.counts.rearrangements - 1
    row.start = tables.track[layout.T_TIME, i]
    row.stop = now.time
    row.displacement = cell[layout.X, i] - tables.track[layout.T_X, i]
    row.coefficient = cell[layout.MEAN if now.chain.constant == 1 else layout.COEFFICIENT, i]
    tables.used[1] += 1
    if tables.track[layout.T_SLIPPED, i] != now.counts.rearrangements:
        tables.track[layout.T_SLIPPED, i] = now.counts.rearrangements
        tables.sums[0].sliders += 1.0


@apart
def end(cell, now, tables):
    """Log a rest; the displacements of the rearrangement are not yet forces at rest."""
    moved = 0.0
    gained = 0.0
    for i in range(now.touched_first, now.touched_last + 1):
        x = cell[layout.X, i]
        around = cell[layout.X, i - 1] + cell[layout.X, i + 1]
        elastic = cell[layout.REST, i] - cell[layout.WEIGHT, i]
        gained -= x * (elastic + 0.5 * (around - cell[layout.STIFFNESS, i] * x))
        moved += x
    sums, row = tables.sums[0], tables.rests[tables.used[0]]
    row.half_cycle = now.counts.target
    row.theta = now.theta + now.theta_low
    row.direction = sums.way
    row.began = sums.began
    row.began_first = sums.began_first
    row.began_last = sums.began_last
    row.events = now.number
    row.sliders = sums.sliders
    row.moved = moved
    row.elastic_before = sums.elastic
    row.elastic_after = sums.elastic + gained
    row.undecided = now.counts.undecided - sums.undecided_before
    tables.used[0] += 1
    sums.elastic += gained
    sums.tensions += cell[layout.X, PAD + now.chain.n - 1] - cell[layout.X, PAD]
    sums.undecided_before = now.counts.undecided
