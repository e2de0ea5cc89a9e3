"""The distance of sliders from their next event, from the derivatives of their margins.

A *margin* must stay in its range until a slider's event: the velocity of a mover, or the force on a
slider at rest; see `taylor`. Tables hold the derivatives of eight margins in a row.

**When a margin within its rounding bound certainly leaves its range.** Let g be the distance of the
true margin from the end of its range. The computed margin is off by at most e, and is within e of
zero at the time t, so that ``|g(t)| <= 2 e``. Let s be the rate at which it falls, and let c bound
``|g''|`` around t. Then the parabolas ``-2 e + s u - c u**2 / 2 <= g(t - u)`` and
``g(t + u) <= 2 e - s u + c u**2 / 2`` pass through zero if and only if ``s**2 >= 4 c e``, at
``u = 4 e / (s + sqrt(s**2 - 4 c e))``. A slope that is steep compared with e is not enough: near a
double root the margin turns within its bound, however fast it falls before. `falls` requires
``s >= 64 e`` and ``s**2 >= 8 c e``, twice the necessary value, which allows for the rounding of s
and the growth of c on the way. The root is less than ``3 e / s`` from t; this uncertainty of the
time is its `blur`.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from exactcreep.compiling import inlined
from exactcreep.solvers.exact import layout
from exactcreep.solvers.exact.layout import HORIZON, NEVER, ORDERS, ULP
from exactcreep.solvers.exact.simd import (
    WIDTH,
    choose,
    element,
    from_left,
    from_right,
    fused,
    load,
    put,
    spread,
    take,
)


def rows_of_eight(values: list[float]) -> NDArray[np.float64]:
    """Return the values in rows of eight."""
    rows = np.zeros((-(-len(values) // WIDTH), WIDTH))
    rows.reshape(-1)[: len(values)] = values
    return rows


STEP_FACTORS = rows_of_eight([0.0] + [1.0 / (k * (k + 1.0)) for k in range(1, ORDERS + 2)])
"""t**2 times entry k leads from the weight of derivative k - 1 in a Taylor series to k + 1."""
_STRIDE = rows_of_eight(
    [0.0] + [1.0 / (k * (k + 1.0) * (k + 2.0) * (k + 3.0)) for k in range(1, ORDERS + 1)]
)
"""The same for t**4, from k - 1 to k + 3."""

_MISS = 0.25 * ULP
"""A root is left to the next evaluation if its relative error would be smaller."""


@inlined
def expand(cell, table, row, flags, i):
    """Do `expand_at` with the present places and velocities."""
    around = load(cell, layout.X, i - 1) + load(cell, layout.X, i + 1)
    x, speed = load(cell, layout.X, i), load(cell, layout.SPEED, i)
    fresh = load(cell, layout.FRESH, i) > 0.0
    return expand_at(cell, table, row, flags, i, around, x, speed, fresh, 1.0)


@inlined
def expand_at(cell, table, row, flags, i, around, x, speed, fresh, here):
    """Fill in two derivatives of eight columns and, from row `flags` on, which of them move.

    `around`: the displacements of both neighbours together; `fresh`: the mask of the sliders that
    have just started; `here` is 0.0 where neither a motion nor a margin counts. Returns the mask of
    the movers that have started with no more than friction.
    """
    side = load(cell, layout.SIDE, i)
    stiffness = load(cell, layout.STIFFNESS, i)
    moves = side * side * here
    pull = load(cell, layout.REST, i) + (around - stiffness * x)
    push = side * pull - load(cell, layout.FRICTION, i)
    push = choose(fresh, load(cell, layout.DRIVE, i), push)
    put(table, row + flags, moves)
    put(table, row + flags + 1, here - moves)
    put(table, row + flags + 2, 0.0 - moves * stiffness)
    put(table, row, fused(1.0 - moves, pull, side * speed))
    put(table, row + 1, side * push * here)
    return fresh & (push <= 0.0)


@inlined
def two_orders(table, row, stride, flags, strips, k):
    """Complete the derivatives k + 1 and k + 2 of so many strips and begin k + 3.

    A row that has begun holds only the movers' part.
    """
    before = spread(0.0)
    before_2 = before
    y = take(table, row + flags) * take(table, row + k)
    y_2 = take(table, row + k + 1)
    for s in range(strips):
        following = spread(0.0)
        following_2 = following
        if s + 1 < strips:
            following = take(table, row + stride + flags) * take(table, row + stride + k)
            following_2 = take(table, row + stride + k + 1)
        around = from_left(before, y) + from_right(y, following)
        around_2 = from_left(before_2, y_2) + from_right(y_2, following_2)
        moves = take(table, row + flags)
        rests = take(table, row + flags + 1)
        holds = take(table, row + flags + 2)
        put(table, row + k + 1, fused(rests, around, y_2))
        after = fused(moves, around, holds * y)
        put(table, row + k + 2, fused(rests, around_2, after))
        put(table, row + k + 3, fused(moves, around_2, holds * y_2))
        before, before_2, y, y_2 = y, y_2, following, following_2
        row += stride


@inlined
def summed(table, row, orders, factors, first, square, t):
    """Return for eight lanes the margins at t, and their integrals from 0, of `orders` derivatives.

    `square` times entry k from row `first` of `factors` on is ``t**2 / (k (k + 1))``.
    """
    even = odd = even_sum = odd_sum = spread(0.0)
    for k in range(orders - 2, -1, -2):
        term = take(table, row + k + 1)
        step = square * element(factors, first, k + 2)
        odd = fused(odd, step, term)
        odd_sum = fused(odd_sum, square * element(factors, first, k + 3), term)
        term = take(table, row + k)
        even = fused(even, square * element(factors, first, k + 1), term)
        even_sum = fused(even_sum, step, term)
    return fused(t, odd, even), t * fused(t * 0.5, odd_sum, even_sum)


@inlined
def watched(cell, i):
    """Return the mask of the lanes that move or have a moving neighbour."""
    beside = abs(load(cell, layout.SIDE, i - 1)) + abs(load(cell, layout.SIDE, i + 1))
    return abs(load(cell, layout.SIDE, i)) + beside > 0.0


@inlined
def leaving(cell, i, at_0, low, high, scale, t):
    """Return the masks of the lanes that may leave their range downwards, and upwards.

    Their margin is between `low` and `high` on (0, t], and `at_0` at 0; some ulp of the `scale` of
    its terms may be rounding errors.
    """
    side = load(cell, layout.SIDE, i)
    resting = abs(side) <= 0.0
    fresh = load(cell, layout.FRESH, i) > 0.0
    low = min(low, choose(fresh, low, at_0))
    high = max(high, choose(fresh, high, at_0))
    friction = load(cell, layout.FRICTION, i)
    threshold = load(cell, layout.EXCESS, i) + friction
    bound = (16.0 * ULP) * (scale + choose(resting, threshold + friction, t * friction))
    never = spread(NEVER)
    floor = choose(resting, threshold, choose(side < 0.0, never, 0.0))
    ceiling = choose(resting, threshold, choose(side > 0.0, never, 0.0))
    return low + floor <= bound, ceiling - high <= bound


@inlined
def approach(cell, table, row, i):
    """Return for eight lanes the parabola of the distance of a margin from the end of its range.

    For a slider that has just started, whose distance is zero, it is the distance over the time.
    """
    side = load(cell, layout.SIDE, i)
    resting = abs(side) <= 0.0
    c1 = take(table, row + 1)
    c2 = take(table, row + 2)
    heading = choose(c1 + c2 * 0.5 < 0.0, spread(-1.0), 1.0)
    way = choose(resting, heading, 0.0 - side)
    friction = load(cell, layout.FRICTION, i)
    edge = choose(resting, load(cell, layout.EXCESS, i) + friction, 0.0)
    p0 = max(edge - way * take(table, row), 0.0)
    p1 = 0.0 - way * c1
    p2 = 0.0 - way * (c2 * 0.5)
    fresh = load(cell, layout.FRESH, i) > 0.0
    p0 = choose(fresh, p1, p0)
    p1 = choose(fresh, p2, p1)
    p2 = choose(fresh, 0.0 - way * (take(table, row + 3) * (1.0 / 6.0)), p2)
    return p0, p1, p2


@inlined
def first_zero(p0, p1, p2):
    """Return for eight lanes the first zero of parabolas, 2 if there is none."""
    square = p1 * p1 - 4.0 * p2 * p0
    low = math.sqrt(max(square, 0.0)) - p1
    guess = (p0 + p0) / max(low, 1e-300)
    missed = (square < 0.0) | (low <= 0.0)
    return choose(missed, 2.0, guess)


@inlined
def at_time(series, row, lane, orders, t):
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
        p2 = fused(p2, after, c2)
        d3 = fused(d3, after, c3)
        p3 = fused(p3, v * element(_STRIDE, 0, k + 4), c3)
        after = v * element(_STRIDE, 0, k + 2)
        p1 = fused(p1, after, c1)
        d2 = fused(d2, after, c2)
        after = v * element(_STRIDE, 0, k + 1)
        p0 = fused(p0, after, c0)
        d1 = fused(d1, after, c1)
        d0 = fused(d0, v * element(_STRIDE, 0, k), c0)
    c1 = element(series, row + 1, lane)
    c2 = element(series, row + 2, lane)
    c3 = element(series, row + 3, lane)
    p0 = fused(p0, v * element(_STRIDE, 0, 1), element(series, row, lane))
    p1 = fused(p1, v * element(_STRIDE, 0, 2), c1)
    p2 = fused(p2, v * element(_STRIDE, 0, 3), c2)
    p3 = fused(p3, v * element(_STRIDE, 0, 4), c3)
    d1 = fused(d1, v * element(_STRIDE, 0, 1), c1)
    d2 = fused(d2, v * element(_STRIDE, 0, 2), c2)
    d3 = fused(d3, v * element(_STRIDE, 0, 3), c3)
    second = 0.5 * u
    third = u * (1.0 / 6.0)
    value = fused(t, fused(third, p3, p1), fused(second, p2, p0))
    slope = fused(t, fused(third, d0, d2), fused(second, d3, d1))
    return value, slope


@inlined
def is_clear(at_0, slope_0, at_1, slope_1, bend, t, bound, begins, ends):
    """Return whether a margin (as a distance from the end of its range) is positive on (0, t).

    Its error is at most `bound`. `begins`: it leaves zero upwards at 0; `ends`: it vanishes at t.
    In the second case it may be within its bound from ``8 bound / |slope_1|`` before t on: that is
    the same crossing, if it `falls`.
    """
    b1 = at_0 + t * slope_0 / 3.0
    b2 = at_1 - t * slope_1 / 3.0
    q1 = 0.25 * (at_0 + 3.0 * b1)
    q2 = 0.5 * (b1 + b2) - bend * (t * t) * (t * t) / 144.0
    q3 = 0.25 * (3.0 * b2 + at_1)
    if ends and -t * slope_1 <= 8.0 * bound:
        return q1 >= 0.0 and q2 >= 0.0 and q3 >= 0.0 and at_0 >= -bound
    if begins:
        if q1 < 0.0 or q2 <= bound:
            return False
    elif at_0 <= bound or q1 <= bound or q2 <= bound:
        return False
    return q3 > bound and (ends or at_1 > bound)


@inlined
def curved(table, row, lane, bend, t):
    """Return a bound of the second derivative of one margin on [0, t]; `bend` bounds the fourth."""
    third = abs(element(table, row + 3, lane)) + 0.5 * t * bend
    return fused(t, third, abs(element(table, row + 2, lane)))


@inlined
def falls(slope, bound, curve):
    """Return whether a margin within `bound` of the end of its range certainly leaves it there.

    `curve` bounds its second derivative. If not, it is a graze: undecided. Derived above.
    """
    return -slope >= 64.0 * bound and slope * slope >= 8.0 * curve * bound


@inlined
def ends_first(at_0, slope_0, limit, outward, slope_1, bend, t, bound, fresh):
    """Return whether a margin stays in its range until t, where it is at the end `limit`."""
    room = limit - outward * at_0
    inside = fresh or room > bound
    return inside and is_clear(
        room, -outward * slope_0, 0.0, -outward * slope_1, bend, t, bound, fresh, True
    )


@inlined
def blur(slope, bound):
    """Return the uncertainty of the time of an event whose margin `falls`."""
    return 3.0 * bound / abs(slope)


@inlined
def soon_after(cell, table, row, inherited, i, late, t):
    """Return the mask of the lanes that seem to leave their range within `late` after t.

    The order of these crossings and of any event up to `late` later is undecided. `inherited` is
    the error of the state from earlier roundings.
    """
    side = load(cell, layout.SIDE, i)
    resting = abs(side) <= 0.0
    at = take(table, row + layout.AT_END)
    slope = take(table, row + layout.SLOPE_AT_END)
    way = choose(resting, choose(slope < 0.0, spread(-1.0), 1.0), 0.0 - side)
    friction = load(cell, layout.FRICTION, i)
    edge = choose(resting, load(cell, layout.EXCESS, i) + friction, 0.0)
    out = way * slope
    room = edge - way * at
    bound = (16.0 * ULP) * (abs(at) + edge + t * (out + friction)) + inherited
    return (room <= fused(out, late, bound)) & (out > 0.0)


@inlined
def rounding(cell, now, i, at_0, slope_0, at_1, slope_1, t):
    """Return a bound of the rounding error of one margin on [0, t]."""
    scale = abs(at_0) + abs(at_1) + t * (abs(slope_0) + abs(slope_1))
    friction = max(now.chain.friction, cell[layout.FRICTION, i])
    if cell[layout.SIDE, i] != 0.0:
        return 16.0 * ULP * (scale + t * friction)
    return 16.0 * ULP * (scale + 2.0 * friction + cell[layout.EXCESS, i])


@inlined
def end_of_range(cell, i):
    """Return the end of a margin's range, on the side of its next event."""
    return 0.0 if cell[layout.SIDE, i] != 0.0 else cell[layout.FRICTION, i] + cell[layout.EXCESS, i]


@inlined
def outwards(side, slope):
    """Return the direction, +1.0 or -1.0, in which a margin of that slope leaves its range."""
    outward = -side
    if side == 0.0:
        outward = 1.0 if slope >= 0.0 else -1.0
    return outward


@inlined
def refined(cell, series, i, row, lane, orders, t):
    """Return the root near t of one margin by Halley's method, inf if it strays."""
    side = cell[layout.SIDE, i]
    limit = end_of_range(cell, i)
    at_0 = element(series, row, lane)
    slope_0 = element(series, row + 1, lane)
    curve_0 = element(series, row + 2, lane)
    for _ in range(12):
        value, slope = at_time(series, row, lane, orders, t)
        # the polynomial of degree four through the values, slopes and the curvature at 0
        turned = t * (slope - slope_0 - t * curve_0)
        bowed = value - at_0 - t * (slope_0 + 0.5 * t * curve_0)
        curve = curve_0 * (t * t) + 6.0 * (turned - 2.0 * bowed)  # times t**2
        # the distance from the end of the range
        inward = -outwards(side, slope)
        value = fused(inward, value, limit)
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
        # the remaining error is of third order in the step
        if abs(step * step * step) * (curve * curve + slope * slope) <= _MISS * (slope * slope):
            return t
    return np.inf
