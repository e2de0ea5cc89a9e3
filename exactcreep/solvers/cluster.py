"""Several movers at once: their motion as Taylor series, and their first event, certified.

A cluster moves by ``v'' = -K v``, so the Taylor coefficients of the velocities obey
``w[k+2] = -K w[k] / ((k+1) (k+2))``. All frequencies are at most 2: within the `HORIZON` the terms
beyond `ORDERS` are below 2e-17 of the largest force.

Each slider of the window has a *margin* that must stay in its range until its event: a mover its
velocity along the motion (above 0), a resting neighbour its force (between its thresholds). On
``[0, t]`` a margin is the cubic through its value and slope at both ends plus at most
``M s**2 (t - s)**2 / 24``, where M bounds its fourth derivative. Written with Bernstein
polynomials of degree four it stays in range if five numbers do. They are computed for eight
sliders at a time; only a slider that fails is looked at alone.

Source: Eqs. (dynamic_eq1)-(static_eqN); derivations/modes.py.
"""

from __future__ import annotations

import math

import numpy as np

from exactcreep.solvers.lanes import WIDTH as EIGHT
from exactcreep.solvers.lanes import (
    below,
    choose,
    from_left,
    from_right,
    fused,
    fused_scalar,
    larger,
    largest,
    least,
    load,
    lowest_bit,
    magnitude,
    not_above,
    smaller,
    spread,
    square_root,
    store,
    turned_left,
    turned_right,
)
from exactcreep.solvers.layout import (
    BEND,
    BENT,
    CROSSING,
    DOUBTED,
    DRIVE,
    EVENT,
    EXCESS,
    FRESH,
    FRICTION,
    HORIZON,
    MOVED,
    NEVER,
    ORDERS,
    PULL,
    PUSH,
    REARRANGEMENTS,
    REST,
    ROOTS,
    RUNNING,
    SIDE,
    SPEED,
    STEPS,
    STIFFNESS,
    SWING,
    TESTS,
    ULP,
    UNDECIDED,
    X,
    compiled,
    inlined,
)

_INVERSE = np.array([1.0 / (k + 1.0) for k in range(ORDERS)])
_FACTORIAL = np.array([1.0 / math.factorial(k) for k in range(ORDERS)])  # reciprocal

_THIRD = np.array([k * (k - 1.0) * (k - 2.0) for k in range(ORDERS)])

# Derivatives 12 and 13 bound all later ones: two more orders multiply by at most 4, the norm of K.
# Each sum below is its first term times less than 1 / (1 - 4 / (12 * 13)).
_REST = 1.03
_BEND_EVEN = _REST * 4.0 / math.factorial(11)
_BEND_ODD = _REST * 4.0 / math.factorial(12)
_SWING_EVEN = _REST * 16.0 / math.factorial(12)
_SWING_ODD = _REST * 4.0 / math.factorial(11)


# Bisection halves a piece of length 1 down to an ulp in 53 steps; nothing needs many times that.
_MOST_PIECES = 500
_POLISH = 4
"""Newton steps, at most, after the estimate of a candidate has converged."""


@inlined
def _next_order(moving, minus_held, y):  # type: ignore[no-untyped-def]
    """Return -K y on the movers of one strip, whose first and last lanes are at rest."""
    return fused(moving, turned_right(y) + turned_left(y), minus_held * y)


@inlined
def _differentiate_one(cell, series, first):  # type: ignore[no-untyped-def]
    """Fill the coefficients from order 2 on of a window of eight sliders."""
    zero = spread(0.0)
    side = load(cell, SIDE, first)
    moving = side * side
    minus_held = zero - moving * load(cell, STIFFNESS, first)
    y = load(series, 0, EIGHT)
    after = load(series, 1, EIGHT)
    for k in range(2, 7):
        new = _next_order(moving, minus_held, y)
        store(series, k, EIGHT, new * spread(_FACTORIAL[k]))
        y = after
        after = new
    bend = magnitude(after) * spread(_FACTORIAL[3])
    swing = zero
    for k in range(7, 14):
        new = _next_order(moving, minus_held, y)
        store(series, k, EIGHT, new * spread(_FACTORIAL[k]))
        size = magnitude(new)
        bend = fused(size, spread(_FACTORIAL[k - 3]), bend)
        swing = fused(size, spread(_FACTORIAL[k - 4]), swing)
        y = after
        after = new
    even = largest(magnitude(y))
    odd = largest(magnitude(after))
    swing = fused(magnitude(_next_order(moving, minus_held, y)), spread(_FACTORIAL[10]), swing)
    for k in range(14, ORDERS):
        new = _next_order(moving, minus_held, y)
        store(series, k, EIGHT, new * spread(_FACTORIAL[k]))
        y = after
        after = new
    store(series, BEND, EIGHT, bend + spread(_BEND_EVEN * even + _BEND_ODD * odd))
    store(series, SWING, EIGHT, swing + spread(_SWING_EVEN * even + _SWING_ODD * odd))


@inlined
def _differentiate(cell, series, first, strips):  # type: ignore[no-untyped-def]
    """Fill the coefficients from order 2 on, strip by strip."""
    zero = spread(0.0)
    for k in range(2, ORDERS):
        ratio = spread(1.0 / (k * (k - 1.0)))
        before = zero
        w = load(series, k - 2, EIGHT)
        for s in range(strips):
            i = first + EIGHT * s
            j = EIGHT + EIGHT * s
            following = zero
            if s + 1 < strips:
                following = load(series, k - 2, j + EIGHT)
            around = from_left(before, w) + from_right(w, following)
            side = load(cell, SIDE, i)
            held = load(cell, STIFFNESS, i) * w
            store(series, k, j, (around - held) * (side * side * ratio))
            before = w
            w = following
    even = 0.0
    odd = 0.0
    for s in range(strips):
        j = EIGHT + EIGHT * s
        even = max(even, largest(magnitude(load(series, 12, j))))
        odd = max(odd, largest(magnitude(load(series, 13, j))))
    even /= _FACTORIAL[12]
    odd /= _FACTORIAL[13]
    for s in range(strips):
        j = EIGHT + EIGHT * s
        bend = spread(_BEND_EVEN * even + _BEND_ODD * odd)
        swing = spread(_SWING_EVEN * even + _SWING_ODD * odd)
        for k in range(6, 14):
            bend = fused(magnitude(load(series, k, j)), spread(k * (k - 1.0) * (k - 2.0)), bend)
            after = magnitude(load(series, k + 1, j))
            swing = fused(after, spread((k + 1.0) * k * (k - 1.0) * (k - 2.0)), swing)
        store(series, BEND, j, bend)
        store(series, SWING, j, swing)


@inlined
def _expand(cell, series, friction, first, strips):  # type: ignore[no-untyped-def]
    """Fill the series of the window that begins in column `first` of `cell`.

    Returns whether a slider has started without any force beyond friction.
    """
    zero = spread(0.0)
    forceless = 0
    for s in range(strips):
        i = first + EIGHT * s
        j = EIGHT + EIGHT * s
        side = load(cell, SIDE, i)
        around = load(cell, X, i - 1) + load(cell, X, i + 1)
        held = load(cell, STIFFNESS, i) * load(cell, X, i)
        pull = load(cell, REST, i) + (around - held)
        push = side * pull - spread(friction)
        fresh = below(zero, load(cell, FRESH, i))
        push = choose(fresh, load(cell, DRIVE, i), push)
        forceless |= fresh & not_above(push, zero)
        store(series, PULL, j, pull)
        store(series, PUSH, j, push)
        store(series, 0, j, side * load(cell, SPEED, i))
        store(series, 1, j, side * push)
    if strips == 1:
        _differentiate_one(cell, series, first)
    else:
        _differentiate(cell, series, first, strips)
    return forceless != 0


@inlined
def _neighbours(series, row, j, s, strips):  # type: ignore[no-untyped-def]
    """Return a row of the window seen from the left and from the right neighbour's place."""
    zero = spread(0.0)
    here = load(series, row, j)
    before = zero
    if s > 0:
        before = load(series, row, j - EIGHT)
    following = zero
    if s + 1 < strips:
        following = load(series, row, j + EIGHT)
    return from_left(before, here), from_right(here, following)


@inlined
def _watched(cell, i):  # type: ignore[no-untyped-def]
    """Return the mask of the lanes that move or have a moving neighbour."""
    moving = magnitude(load(cell, SIDE, i))
    moving = moving + magnitude(load(cell, SIDE, i - 1)) + magnitude(load(cell, SIDE, i + 1))
    return below(spread(0.0), moving)


@inlined
def _candidate(cell, series, friction, first, strips):  # type: ignore[no-untyped-def]
    """Return the lane whose margin seems to end first and when, from three coefficients each.

    A guess that only costs time if it is wrong. Lane -1: none within the `HORIZON`.
    """
    zero = spread(0.0)
    best = HORIZON
    lane = -1
    for s in range(strips):
        i = first + EIGHT * s
        j = EIGHT + EIGHT * s
        side = load(cell, SIDE, i)
        resting = not_above(magnitude(side), zero)
        left, right = _neighbours(series, 0, j, s, strips)
        flow = left + right
        left, right = _neighbours(series, 1, j, s, strips)
        surge = (left + right) * spread(0.5)
        # which threshold a resting slider is heading for
        way = choose(below(flow + surge * spread(0.5), zero), spread(-1.0), spread(1.0))
        threshold = load(cell, EXCESS, i) + spread(friction)
        p0 = choose(resting, threshold - way * load(series, PULL, j), load(cell, SPEED, i))
        p1 = choose(resting, zero - way * flow, load(series, PUSH, j))
        p2 = choose(resting, zero - way * surge, side * load(series, 2, j))
        fresh = below(zero, load(cell, FRESH, i))
        p0 = choose(fresh, p1, p0)
        p1 = choose(fresh, p2, p1)
        p2 = choose(fresh, side * load(series, 3, j), p2)
        p0 = larger(p0, zero)
        square = p1 * p1 - spread(4.0) * p2 * p0
        low = square_root(larger(square, zero)) - p1
        guess = (p0 + p0) / larger(low, spread(1e-300))
        far = spread(2.0 * HORIZON)
        guess = choose(below(square, zero), far, guess)
        guess = choose(not_above(low, zero), far, guess)
        guess = choose(_watched(cell, i), guess, far)
        soonest = least(guess)
        if soonest < best:
            best = soonest
            lane = EIGHT * s + lowest_bit(not_above(guess, spread(soonest)))
    return lane, best


@inlined
def _margin(cell, series, i, j, t):  # type: ignore[no-untyped-def]
    """Return value and slope at t of the margin of one slider: column i of cell, j of series."""
    side = cell[SIDE, i]
    u = t * t
    v = u * u
    if side != 0.0:
        # the orders 4 m + 0, 1, 2, 3 apart: four short chains of operations instead of a long one
        p0 = p1 = p2 = p3 = 0.0
        d0 = d1 = d2 = d3 = 0.0
        for k in range(ORDERS - 4, -1, -4):
            d0 = fused_scalar(d0, v, p0)
            d1 = fused_scalar(d1, v, p1)
            d2 = fused_scalar(d2, v, p2)
            d3 = fused_scalar(d3, v, p3)
            p0 = fused_scalar(p0, v, series[k, j])
            p1 = fused_scalar(p1, v, series[k + 1, j])
            p2 = fused_scalar(p2, v, series[k + 2, j])
            p3 = fused_scalar(p3, v, series[k + 3, j])
        even = fused_scalar(u, p2, p0)
        odd = fused_scalar(u, p3, p1)
        value = fused_scalar(t, odd, even)
        within = fused_scalar(t, fused_scalar(u, d3, d1), fused_scalar(u, d2, d0))
        slope = fused_scalar(4.0 * u * t, within, fused_scalar(2.0 * t, p2, p1))
        slope = fused_scalar(3.0 * u, p3, slope)
        return side * value, side * slope
    # its own column is zero: it stands in for a neighbour that does not move
    left = j - 1 if cell[SIDE, i - 1] != 0.0 else j
    right = j + 1 if cell[SIDE, i + 1] != 0.0 else j
    p0 = p1 = p2 = p3 = 0.0
    s0 = s1 = s2 = s3 = 0.0
    for k in range(ORDERS - 4, -1, -4):
        term = series[k, left] + series[k, right]
        p0 = fused_scalar(p0, v, term)
        s0 = fused_scalar(s0, v, term * _INVERSE[k])
        term = series[k + 1, left] + series[k + 1, right]
        p1 = fused_scalar(p1, v, term)
        s1 = fused_scalar(s1, v, term * _INVERSE[k + 1])
        term = series[k + 2, left] + series[k + 2, right]
        p2 = fused_scalar(p2, v, term)
        s2 = fused_scalar(s2, v, term * _INVERSE[k + 2])
        term = series[k + 3, left] + series[k + 3, right]
        p3 = fused_scalar(p3, v, term)
        s3 = fused_scalar(s3, v, term * _INVERSE[k + 3])
    slope = fused_scalar(t, fused_scalar(u, p3, p1), fused_scalar(u, p2, p0))
    moved = t * fused_scalar(t, fused_scalar(u, s3, s1), fused_scalar(u, s2, s0))
    return series[PULL, j] + moved, slope


@compiled
def _bend_between(cell, series, i, j, t):  # type: ignore[no-untyped-def]
    """Return a bound of the fourth derivative on [0, t] of the force on a resting slider.

    Its neighbours are added before the bound is taken: opposite motions cancel.
    """
    left = j - 1 if cell[SIDE, i - 1] != 0.0 else j
    right = j + 1 if cell[SIDE, i + 1] != 0.0 else j
    # orders beyond the series: less than 0.01 of its last two terms, each slider for itself
    bend = 0.0
    for k in range(ORDERS - 2, ORDERS):
        bend += 0.02 * _THIRD[k] * (abs(series[k, left]) + abs(series[k, right]))
    for k in range(ORDERS - 1, 2, -1):
        bend = bend * t + _THIRD[k] * abs(series[k, left] + series[k, right])
    return bend


@inlined
def _swing_of(series, j, t):  # type: ignore[no-untyped-def]
    """Return a bound of the fourth derivative of the velocity in column j on [0, t]."""
    tail = 360.0 * abs(series[6, j]) + t * series[SWING, j]
    return 24.0 * abs(series[4, j]) + t * (120.0 * abs(series[5, j]) + t * tail)


@inlined
def _clear(at_0, slope_0, at_1, slope_1, bend, t, bound, begins, ends):  # type: ignore[no-untyped-def]
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
def _at_both_ends(cell, series, i, j):  # type: ignore[no-untyped-def]
    """Return value and slope of one margin at the beginning and the end of the step."""
    side = cell[SIDE, i]
    # a column at rest is zero: it stands in for a neighbour outside the window
    left = j - 1 if side != 0.0 or cell[SIDE, i - 1] != 0.0 else j
    right = j + 1 if side != 0.0 or cell[SIDE, i + 1] != 0.0 else j
    around = series[MOVED, left] + series[MOVED, right]
    if side != 0.0:
        push = series[PUSH, j]
        turned = push + side * (around - cell[STIFFNESS, i] * series[MOVED, j])
        return cell[SPEED, i], push, side * series[RUNNING, j], turned
    pull = series[PULL, j]
    flow = series[0, left] + series[0, right]
    return pull, flow, pull + around, series[RUNNING, left] + series[RUNNING, right]


@inlined
def _rounding(cell, real, i, at_0, slope_0, at_1, slope_1, t):  # type: ignore[no-untyped-def]
    """Return a bound of the rounding error of one margin on [0, t]."""
    scale = abs(at_0) + abs(at_1) + t * (abs(slope_0) + abs(slope_1))
    if cell[SIDE, i] != 0.0:
        return 16.0 * ULP * (scale + t * real[FRICTION])
    return 16.0 * ULP * (scale + 2.0 * real[FRICTION] + cell[EXCESS, i])


@inlined
def _falls(slope, bound):  # type: ignore[no-untyped-def]
    """Return whether a margin at the end of its range is sure to leave it there.

    Its slope must take it through its rounding bound within 1/64 tau_dyn. If value and slope both
    vanish it is a graze.
    """
    return -slope >= 64.0 * bound


@compiled
def _doubt(cell, whole, i):  # type: ignore[no-untyped-def]
    """Count a slider as undecided, once in a rearrangement however many steps look at it."""
    if cell[DOUBTED, i] != whole[REARRANGEMENTS]:
        cell[DOUBTED, i] = whole[REARRANGEMENTS]
        whole[UNDECIDED] += 1


@compiled
def _first_crossing(cell, series, real, whole, i, j, upper, t, evaluated):  # type: ignore[no-untyped-def]
    """Return the first time in [0, t] at which one margin leaves its range, inf if it never does.

    `evaluated`: the series' rows at the end of the step hold the values at t. Newton steps and
    bisection, with a certificate for every piece left behind. What is neither
    clear nor crossed when it is as short as a rounding error is a graze: undecided, no crossing.
    """
    moving = cell[SIDE, i] != 0.0
    side = -1.0 if upper else 1.0
    threshold = 0.0 if moving else real[FRICTION] + cell[EXCESS, i]
    bend = _swing_of(series, j, t) if moving else _bend_between(cell, series, i, j, t)
    at_a, slope_a, at_b, slope_b = _at_both_ends(cell, series, i, j)
    if not evaluated:
        at_b, slope_b = _margin(cell, series, i, j, t)
        whole[ROOTS] += 1
    bound = _rounding(cell, real, i, at_a, slope_a, at_b, slope_b, t)
    at_t = at_b
    slope_t = slope_b
    at_a = threshold + side * at_a
    slope_a = side * slope_a
    begins = cell[FRESH, i] != 0.0
    if not begins and abs(at_a) <= bound:
        # exactly at its threshold: it starts at once if it is pushed outwards
        _doubt(cell, whole, i)
        lead = slope_a
        for k in range(1, 3):
            if lead == 0.0 and not moving:
                lead = side * (series[k, j - 1] + series[k, j + 1])
        if lead < 0.0:
            return 0.0
        begins = True
    a = 0.0
    b = t
    far = t
    crossed = False
    for _ in range(_MOST_PIECES):
        if b != t:
            at_b, slope_b = _margin(cell, series, i, j, b)
            whole[ROOTS] += 1
        else:
            at_b = at_t
            slope_b = slope_t
        at_b = threshold + side * at_b
        slope_b = side * slope_b
        if begins and at_a < 0.0:
            at_a = 0.0
        if at_b < -bound:
            crossed = True
            far = b
            middle = 0.5 * (a + b)
            if slope_b < 0.0:
                b -= at_b / slope_b
            if not (b > a and b < far):
                b = middle
        elif at_b <= bound and (
            (crossed and slope_b < 0.0) or _falls(slope_b, bound)
        ) and _clear(at_a, slope_a, 0.0, slope_b, bend, b - a, bound, begins, True):  # fmt: skip
            return min(max(b - at_b / slope_b, a), far) if _falls(slope_b, bound) else b
        else:
            clear = at_b > bound and _clear(
                at_a, slope_a, at_b, slope_b, bend, b - a, bound, begins, False
            )
            graze = not clear and _clear(
                at_a + 2.0 * bound, slope_a, at_b + 2.0 * bound, slope_b, bend, b - a,
                0.0, True, False,
            )  # fmt: skip
            if graze:
                # within rounding of its threshold all along: there it stays
                _doubt(cell, whole, i)
            if clear or graze:
                if b >= far:
                    return far if crossed else np.inf
                a = b
                at_a = max(at_b, 0.0)
                slope_a = slope_b
                begins = False
                b = a - at_a / slope_a if slope_a < 0.0 else far
                if not (b > a and b < far):
                    b = 0.5 * (a + far) if crossed else far
            else:
                b = 0.5 * (a + b)
        if b - a <= 4.0 * ULP * t:
            if crossed and far - a <= 64.0 * ULP * t:
                return far
            b = 0.5 * (a + far)
    _doubt(cell, whole, i)
    return far if crossed else np.inf


@inlined
def _refine(cell, series, real, whole, i, j, t):  # type: ignore[no-untyped-def]
    """Return the root near t of one margin by Newton's method, inf if it strays."""
    moving = cell[SIDE, i] != 0.0
    threshold = 0.0 if moving else real[FRICTION] + cell[EXCESS, i]
    before = 0.0
    step = 0.0
    for turn in range(12):
        value, slope = _margin(cell, series, i, j, t)
        whole[ROOTS] += 1
        if not moving:
            if slope >= 0.0:
                value = threshold - value
                slope = -slope
            else:
                value = threshold + value
        if slope >= 0.0:
            return np.inf
        # this step misses by step**2 times half the curvature, which the last two slopes give, over
        # the slope; all divisions are multiplied out
        turned = abs(slope - before)
        before = slope
        last = abs(step)
        step = value / slope
        t -= step
        if not (t > 0.0 and t <= HORIZON):
            return np.inf
        small = 0.25 * ULP * t
        square = step * step
        if square <= small * t and (
            (turn > 0 and square * turned <= small * last * abs(slope)) or square <= 4.0 * small**2
        ):
            return t
    return np.inf


@inlined
def _evaluate(series, strips, t):  # type: ignore[no-untyped-def]
    """Fill displacements and velocities of the window at t."""
    u = spread(t * t)
    at = spread(t)
    for s in range(strips):
        j = EIGHT + EIGHT * s
        even = load(series, ORDERS - 2, j)
        odd = load(series, ORDERS - 1, j)
        even_sum = even * spread(_INVERSE[ORDERS - 2])
        odd_sum = odd * spread(_INVERSE[ORDERS - 1])
        for k in range(ORDERS - 4, -1, -2):
            term = load(series, k, j)
            even = fused(even, u, term)
            even_sum = fused(even_sum, u, term * spread(_INVERSE[k]))
            term = load(series, k + 1, j)
            odd = fused(odd, u, term)
            odd_sum = fused(odd_sum, u, term * spread(_INVERSE[k + 1]))
        store(series, RUNNING, j, fused(at, odd, even))
        store(series, MOVED, j, at * fused(at, odd_sum, even_sum))
        tail = spread(60.0) * magnitude(load(series, 5, j)) + at * load(series, BEND, j)
        tail = spread(24.0) * magnitude(load(series, 4, j)) + at * tail
        store(series, BENT, j, spread(6.0) * magnitude(load(series, 3, j)) + at * tail)


@inlined
def _suspects(cell, series, friction, first, s, strips, t):  # type: ignore[no-untyped-def]
    """Return the masks of the lanes of one strip not proved to stay in range on (0, t].

    The first mask is for the lower end of the range, the second for the upper.
    """
    zero = spread(0.0)
    i = first + EIGHT * s
    j = EIGHT + EIGHT * s
    side = load(cell, SIDE, i)
    resting = not_above(magnitude(side), zero)
    flow_left, flow_right = _neighbours(series, 0, j, s, strips)
    run_left, run_right = _neighbours(series, RUNNING, j, s, strips)
    left, right = _neighbours(series, MOVED, j, s, strips)
    bent_left, bent_right = _neighbours(series, BENT, j, s, strips)
    around = left + right
    pull = load(series, PULL, j)
    push = load(series, PUSH, j)
    moved = load(series, MOVED, j)
    at = spread(t)
    third = spread(t / 3.0)
    g0 = choose(resting, pull, load(cell, SPEED, i))
    slope0 = choose(resting, flow_left + flow_right, push)
    g1 = choose(resting, pull + around, side * load(series, RUNNING, j))
    slope1 = choose(
        resting,
        run_left + run_right,
        push + side * (around - load(cell, STIFFNESS, i) * moved),
    )
    tail = spread(360.0) * magnitude(load(series, 6, j)) + at * load(series, SWING, j)
    tail = spread(120.0) * magnitude(load(series, 5, j)) + at * tail
    swing = spread(24.0) * magnitude(load(series, 4, j)) + at * tail
    rest = choose(resting, bent_left + bent_right, swing) * spread(t * t * t * t / 144.0)
    b1 = g0 + third * slope0
    b2 = g1 - third * slope1
    quarter = spread(0.25)
    three = spread(3.0)
    q1 = quarter * (g0 + three * b1)
    q2 = spread(0.5) * (b1 + b2)
    q3 = quarter * (three * b2 + g1)
    low = smaller(smaller(q1, q2 - rest), smaller(q3, g1))
    high = larger(larger(q1, q2 + rest), larger(q3, g1))
    fresh = below(zero, load(cell, FRESH, i))
    low = smaller(low, choose(fresh, low, g0))
    high = larger(high, g0)
    threshold = load(cell, EXCESS, i) + spread(friction)
    scale = magnitude(g0) + magnitude(g1) + at * (magnitude(slope0) + magnitude(slope1))
    scale = scale + choose(resting, threshold + spread(friction), spread(t * friction))
    bound = spread(16.0 * ULP) * scale
    floor = choose(resting, threshold, zero)
    ceiling = choose(resting, threshold, spread(NEVER))
    watched = _watched(cell, i)
    lower = not_above(low + floor, bound) & watched
    upper = not_above(ceiling - high, bound) & watched
    return lower, upper


@compiled
def _tangential(cell, count, series, first, last):  # type: ignore[no-untyped-def]
    """Find the sliders that have started but do not get away, return how many.

    Velocity and acceleration are zero: the first derivative that is not decides, and if it points
    back, or there is none, the slip has length zero.
    """
    events = 0
    for i in range(first, last + 1):
        if cell[SIDE, i] == 0.0 or cell[FRESH, i] == 0.0 or cell[DRIVE, i] > 0.0:
            continue
        lead = 0.0
        for k in range(2, ORDERS):
            if lead == 0.0:
                lead = series[k, EIGHT + i - first]
        if lead * cell[SIDE, i] <= 0.0:
            count[EVENT, events] = i
            events += 1
    return events


@inlined
def _together(cell, count, series, real, whole, first, contenders, t):  # type: ignore[no-untyped-def]
    """Keep the sliders whose event is at t, within its rounding bound; return how many.

    All contenders are looked at again, once t is known: which slider was found first must not
    matter.
    """
    missed = 0.0  # by how much the margins that give t its value miss the end of their range
    for turn in range(2):
        events = 0
        for k in range(contenders):
            i = count[EVENT, k]
            j = EIGHT + i - first
            at_0, slope_0, at_1, slope_1 = _at_both_ends(cell, series, i, j)
            off = abs(at_1)
            leaves = slope_1 < 0.0
            if cell[SIDE, i] == 0.0:
                off = abs(off - (real[FRICTION] + cell[EXCESS, i]))
                leaves = slope_1 * at_1 > 0.0
            if turn == 0:
                if series[CROSSING, j] == t:
                    missed = max(missed, off)
                continue
            bound = _rounding(cell, real, i, at_0, slope_0, at_1, slope_1, t)
            near = off <= max(missed, bound)
            leaves = leaves and _falls(-abs(slope_1), bound)
            known = not (leaves or series[CROSSING, j] == t)
            for earlier in range(events):
                known = known or count[EVENT, earlier] == i
            if near and not known:
                count[EVENT, events] = i
                events += 1
    whole[UNDECIDED] += max(events - 1, 0)
    return events


@inlined
def _own_root(cell, series, real, i, lane, strips, t):  # type: ignore[no-untyped-def]
    """Polish the root of the candidate, and certify its own margin before it.

    Returns
    -------
    t, residual : float
    outward : float
        +1 if the margin leaves its range upwards, -1 downwards.
    holds : bool
        Whether the margin is at the end of its range at t, within its rounding bound. If not, the
        root lies beyond the horizon or the estimate went astray: there is no candidate.
    proved : bool
        Whether the margin stays in its range until t, and leaves it there.
    """
    j = EIGHT + lane
    moving = cell[SIDE, i] != 0.0
    limit = 0.0 if moving else real[FRICTION] + cell[EXCESS, i]
    for turn in range(_POLISH + 1):
        at_0, slope_0, at_1, slope_1 = _at_both_ends(cell, series, i, j)
        bound = _rounding(cell, real, i, at_0, slope_0, at_1, slope_1, t)
        outward = -1.0 if moving or slope_1 < 0.0 else 1.0
        off = at_1 - outward * limit
        # the root must hold within its rounding bound, or a tie with it would go unseen
        if abs(off) <= 0.5 * bound or slope_1 == 0.0 or turn == _POLISH:
            break
        t = min(max(t - off / slope_1, 0.0), HORIZON)
        _evaluate(series, strips, t)
    if moving:
        bend = _swing_of(series, j, t)
    else:
        bend = series[BENT, j - 1] * abs(cell[SIDE, i - 1])
        bend += series[BENT, j + 1] * abs(cell[SIDE, i + 1])
    fresh = cell[FRESH, i] != 0.0
    room = limit - outward * at_0
    holds = abs(off) <= bound and _falls(-outward * slope_1, bound)
    proved = (
        holds
        and (fresh or room > bound)
        and _clear(room, -outward * slope_0, 0.0, -outward * slope_1, bend, t, 0.0, fresh, True)
    )
    return t, abs(off), outward, holds, proved


@inlined
def step(cell, count, series, real, whole, first, last):  # type: ignore[no-untyped-def]
    """Advance the movers of columns first + 1 .. last - 1 to their first event.

    Returns
    -------
    t : float
        The time advanced, at most `HORIZON`.
    events : int
        Number of sliders whose event it is, their columns in ``count[EVENT]``; 0 if there is none
        within the horizon.
    residual : float
        How far the margins are from the end of their ranges.
    """
    friction = real[FRICTION]
    strips = (last - first + EIGHT) // EIGHT
    whole[STEPS] += 1
    if _expand(cell, series, friction, first, strips):
        events = _tangential(cell, count, series, first, last)
        if events > 0:
            return 0.0, events, 0.0
    lane, t = _candidate(cell, series, friction, first, strips)
    if lane >= 0:
        t = _refine(cell, series, real, whole, first + lane, EIGHT + lane, t)
        if t > HORIZON:
            lane = -1
            t = HORIZON
    _evaluate(series, strips, t)
    events = 0
    residual = 0.0
    proved = False
    outward = 1.0
    if lane >= 0:
        t, residual, outward, holds, proved = _own_root(
            cell, series, real, first + lane, lane, strips, t
        )
        if holds:
            events = 1
            count[EVENT, 0] = first + lane
            series[CROSSING, EIGHT + lane] = t
    evaluated = t
    found = events > 0
    rivals = 0
    for s in range(strips):
        whole[TESTS] += 1
        lower, upper = _suspects(cell, series, friction, first, s, strips, evaluated)
        if proved and lane // EIGHT == s:
            own = np.int64(1) << (lane % EIGHT)
            if outward > 0.0:
                upper &= ~own
            else:
                lower &= ~own
        suspects = lower | upper
        while suspects != 0:
            bit = lowest_bit(suspects)
            suspects &= suspects - 1
            i = first + EIGHT * s + bit
            j = EIGHT + EIGHT * s + bit
            rivals += 1
            for side in range(2):
                if ((upper if side == 1 else lower) >> bit) & 1 == 0:
                    continue
                crossing = _first_crossing(
                    cell, series, real, whole, i, j, side == 1, t, t == evaluated
                )
                if events == 0 or count[EVENT, events - 1] != i:
                    count[EVENT, events] = i
                    events += 1
                    series[CROSSING, j] = np.inf
                if crossing <= t:
                    series[CROSSING, j] = crossing
                    found = True
                    t = crossing
    if t != evaluated:
        _evaluate(series, strips, t)
    if rivals > 0:
        events = _together(cell, count, series, real, whole, first, events, t) if found else 0
        residual = 0.0
        for k in range(events):
            i = count[EVENT, k]
            _, _, value, _ = _at_both_ends(cell, series, i, EIGHT + i - first)
            if cell[SIDE, i] == 0.0:
                value = abs(value) - (friction + cell[EXCESS, i])
            residual = max(residual, abs(value))
    for s in range(strips):
        i = first + EIGHT * s
        j = EIGHT + EIGHT * s
        side = load(cell, SIDE, i)
        store(cell, X, i, load(cell, X, i) + load(series, MOVED, j))
        store(cell, SPEED, i, larger(side * load(series, RUNNING, j), spread(0.0)))
        if t > 0.0:
            store(cell, FRESH, i, spread(0.0))
    return t, events, residual
