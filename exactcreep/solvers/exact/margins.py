"""How far sliders are from their next event, from the derivatives of their margins.

A *margin* must stay in its range until a slider's event: the velocity of a mover, the force on a
slider at rest; see `taylor`. Tables hold the derivatives of eight margins in a row.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from exactcreep.solvers.exact.layout import (
    DRIVE,
    EXCESS,
    FRESH,
    HORIZON,
    NEVER,
    ORDERS,
    REST,
    SIDE,
    STIFFNESS,
    ULP,
    X,
    inlined,
)
from exactcreep.solvers.exact.simd import WIDTH as EIGHT
from exactcreep.solvers.exact.simd import (
    below,
    choose,
    element,
    fused_scalar,
    larger,
    load,
    magnitude,
    not_above,
    spread,
    square_root,
    take,
)


def rows_of_eight(values: list[float]) -> NDArray[np.float64]:
    """Return the values in rows of eight."""
    rows = np.zeros((-(-len(values) // EIGHT), EIGHT))
    rows.reshape(-1)[: len(values)] = values
    return rows


STEP_FACTORS = rows_of_eight([0.0] + [1.0 / (k * (k + 1.0)) for k in range(1, ORDERS + 2)])
"""t**2 times entry k leads from the weight of derivative k - 1 in a Taylor series to k + 1."""
_STRIDE = rows_of_eight(
    [0.0] + [1.0 / (k * (k + 1.0) * (k + 2.0) * (k + 3.0)) for k in range(1, ORDERS + 1)]
)
"""The same for t**4, from k - 1 to k + 3."""

_MISS = 0.25 * ULP
"""A root is left to the next evaluation if it should be off by less, relatively."""


@inlined
def forces(cell, friction, i):
    """Return of eight columns what pulls them, what pushes movers on, and which have no force.

    A mover that has started with no more than friction has none.
    """
    zero = spread(0.0)
    around = load(cell, X, i - 1) + load(cell, X, i + 1)
    pull = load(cell, REST, i) + (around - load(cell, STIFFNESS, i) * load(cell, X, i))
    push = load(cell, SIDE, i) * pull - spread(friction)
    fresh = below(zero, load(cell, FRESH, i))
    push = choose(fresh, load(cell, DRIVE, i), push)
    return pull, push, fresh & not_above(push, zero)


@inlined
def its_range(cell, friction, i):
    """Return in eight lanes how far a margin may go down and up from zero."""
    side = load(cell, SIDE, i)
    zero = spread(0.0)
    never = spread(NEVER)
    threshold = load(cell, EXCESS, i) + spread(friction)
    resting = not_above(magnitude(side), zero)
    floor = choose(resting, threshold, choose(below(side, zero), never, zero))
    ceiling = choose(resting, threshold, choose(below(zero, side), never, zero))
    return floor, ceiling


@inlined
def approach(cell, table, row, friction, i):
    """Return in eight lanes the parabola that a margin follows to the end of its range.

    Its coefficients, of the distance from the end that it is heading for; of a slider that has just
    started, whose distance is zero, of the distance over the time.
    """
    zero = spread(0.0)
    half = spread(0.5)
    side = load(cell, SIDE, i)
    resting = not_above(magnitude(side), zero)
    c1 = take(table, row + 1)
    c2 = take(table, row + 2)
    heading = choose(below(c1 + c2 * half, zero), spread(-1.0), spread(1.0))
    way = choose(resting, heading, zero - side)
    edge = choose(resting, load(cell, EXCESS, i) + spread(friction), zero)
    p0 = larger(edge - way * take(table, row), zero)
    p1 = zero - way * c1
    p2 = zero - way * (c2 * half)
    fresh = below(zero, load(cell, FRESH, i))
    p0 = choose(fresh, p1, p0)
    p1 = choose(fresh, p2, p1)
    p2 = choose(fresh, zero - way * (take(table, row + 3) * spread(1.0 / 6.0)), p2)
    return p0, p1, p2


@inlined
def first_zero(p0, p1, p2):
    """Return in eight lanes where parabolas have their first zero, 2 where they have none."""
    zero = spread(0.0)
    square = p1 * p1 - spread(4.0) * p2 * p0
    low = square_root(larger(square, zero)) - p1
    guess = (p0 + p0) / larger(low, spread(1e-300))
    missed = below(square, zero) | not_above(low, zero)
    return choose(missed, spread(2.0), guess)


@inlined
def margin(series, row, lane, orders, t):
    """Return value and slope at t of the series of one slider."""
    u = t * t
    v = u * u
    # the orders 4 m + 0, 1, 2, 3 apart: four short chains of operations instead of a long one
    p0 = p1 = p2 = p3 = 0.0
    d0 = d1 = d2 = d3 = 0.0
    for k in range(orders - 4, 3, -4):
        c0 = element(series, row + k, lane)
        c1 = element(series, row + k + 1, lane)
        c2 = element(series, row + k + 2, lane)
        c3 = element(series, row + k + 3, lane)
        after = v * element(_STRIDE, 0, k + 3)
        p2 = fused_scalar(p2, after, c2)
        d3 = fused_scalar(d3, after, c3)
        p3 = fused_scalar(p3, v * element(_STRIDE, 0, k + 4), c3)
        after = v * element(_STRIDE, 0, k + 2)
        p1 = fused_scalar(p1, after, c1)
        d2 = fused_scalar(d2, after, c2)
        after = v * element(_STRIDE, 0, k + 1)
        p0 = fused_scalar(p0, after, c0)
        d1 = fused_scalar(d1, after, c1)
        d0 = fused_scalar(d0, v * element(_STRIDE, 0, k), c0)
    c1 = element(series, row + 1, lane)
    c2 = element(series, row + 2, lane)
    c3 = element(series, row + 3, lane)
    p0 = fused_scalar(p0, v * element(_STRIDE, 0, 1), element(series, row, lane))
    p1 = fused_scalar(p1, v * element(_STRIDE, 0, 2), c1)
    p2 = fused_scalar(p2, v * element(_STRIDE, 0, 3), c2)
    p3 = fused_scalar(p3, v * element(_STRIDE, 0, 4), c3)
    d1 = fused_scalar(d1, v * element(_STRIDE, 0, 1), c1)
    d2 = fused_scalar(d2, v * element(_STRIDE, 0, 2), c2)
    d3 = fused_scalar(d3, v * element(_STRIDE, 0, 3), c3)
    second = 0.5 * u
    third = u * (1.0 / 6.0)
    value = fused_scalar(t, fused_scalar(third, p3, p1), fused_scalar(second, p2, p0))
    slope = fused_scalar(t, fused_scalar(third, d0, d2), fused_scalar(second, d3, d1))
    return value, slope


@inlined
def is_clear(at_0, slope_0, at_1, slope_1, bend, t, bound, begins, ends):
    """Return whether a margin (as a distance from the end of its range) is positive on (0, t).

    `begins`: it is known to leave zero upwards at 0; `ends`: it is known to vanish at t.
    """
    b1 = at_0 + t * slope_0 / 3.0
    b2 = at_1 - t * slope_1 / 3.0
    q1 = 0.25 * (at_0 + 3.0 * b1)
    q2 = 0.5 * (b1 + b2) - bend * (t * t) * (t * t) / 144.0
    q3 = 0.25 * (3.0 * b2 + at_1)
    if ends:
        # a dip within the bound just before t would be the same crossing
        return q1 >= 0.0 and q2 >= 0.0 and q3 >= 0.0 and at_0 >= -bound
    if begins:
        if q1 < 0.0 or q2 < 0.0:
            return False
    elif at_0 <= bound or q1 <= bound or q2 <= bound:
        return False
    return q3 > bound and at_1 > bound


@inlined
def rounding(cell, now, i, at_0, slope_0, at_1, slope_1, t):
    """Return a bound of the rounding error of one margin on [0, t]."""
    scale = abs(at_0) + abs(at_1) + t * (abs(slope_0) + abs(slope_1))
    if cell[SIDE, i] != 0.0:
        return 16.0 * ULP * (scale + t * now.friction)
    return 16.0 * ULP * (scale + 2.0 * now.friction + cell[EXCESS, i])


@inlined
def refined(cell, series, now, i, row, lane, orders, t):
    """Return the root near t of one margin by Halley's method, inf if it strays."""
    side = cell[SIDE, i]
    threshold = 0.0 if side != 0.0 else now.friction + cell[EXCESS, i]
    at_0 = element(series, row, lane)
    slope_0 = element(series, row + 1, lane)
    curve_0 = element(series, row + 2, lane)
    for _ in range(12):
        value, slope = margin(series, row, lane, orders, t)
        now.roots += 1
        # the polynomial of degree four through the values, slopes and the curvature at 0
        turned = t * (slope - slope_0 - t * curve_0)
        bowed = value - at_0 - t * (slope_0 + 0.5 * t * curve_0)
        curve = curve_0 * (t * t) + 6.0 * (turned - 2.0 * bowed)  # times t**2
        # the distance from the end of the range that it is heading for
        inward = side
        if side == 0.0:
            inward = -1.0 if slope >= 0.0 else 1.0
        value = fused_scalar(inward, value, threshold)
        slope *= inward * t
        curve *= inward
        if slope >= 0.0:
            return np.inf
        # in units of t; all divisions are multiplied out
        lever = slope * slope - 0.5 * value * curve
        if lever <= 0.0:
            return np.inf
        step = value * slope / lever
        t -= t * step
        if not (t > 0.0 and t <= HORIZON):
            return np.inf
        # what it misses by is of the third order in the step
        if abs(step * step * step) * (curve * curve + slope * slope) <= _MISS * (slope * slope):
            return t
    return np.inf
