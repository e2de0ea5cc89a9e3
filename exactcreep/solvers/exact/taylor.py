"""Several movers at once: their motion as Taylor series, and their first event, certified.

Each slider of the window has a *margin* that must stay in its range until its event: a mover its
velocity (on its side of 0), a resting neighbour its force (between its thresholds). A cluster moves
by ``v'' = -K v``: the derivatives of its velocities are ``-K`` times the derivatives two orders
lower, and the derivatives of a force at rest are sums of its neighbours' velocities one order
lower. So all margins grow derivative by derivative in one table, a column for each slider, in
strips of eight. All frequencies are at most 2: within the `HORIZON` the terms beyond `ORDERS` are
below 3e-17 of the largest; for an earlier event fewer terms suffice.

On ``[0, t]`` a margin is the cubic through its value and slope at both ends plus at most
``M s**2 (t - s)**2 / 24``, where M bounds its fourth derivative. In Bernstein form of degree four
it stays in range if five numbers do. They are computed for eight sliders at a time; only a slider
that fails is examined alone.

The *candidate* is the slider whose margin seems to end first, its *rivals* are all others. A
*suspect* is a rival whose five numbers do not prove its margin. A *fresh* slider has just started,
with velocity zero; without any force beyond friction it is *forceless*.

Source: Eqs. 5-10; derivations/modes.py.
"""

from __future__ import annotations

import math

import numpy as np

from exactcreep.compiling import apart, inlined
from exactcreep.model.rules import FLOATS
from exactcreep.solvers.exact import layout, margins
from exactcreep.solvers.exact.layout import HORIZON, LADDER, ORDERS, SERIES, ULP
from exactcreep.solvers.exact.margins import ends_first, falls, is_clear
from exactcreep.solvers.exact.simd import (
    WIDTH,
    element,
    from_left,
    from_right,
    fused,
    largest,
    least,
    load,
    lowest_bit,
    put,
    spread,
    store,
    take,
)

_order, _leaves = FLOATS.order, FLOATS.leaves

_NEGLECTED = (2.0 * HORIZON) ** ORDERS / math.factorial(ORDERS)
_REACH = np.array(
    [0.0]
    + [0.5 * (_NEGLECTED * math.factorial(p)) ** (1.0 / p) for p in range(1, ORDERS)]
    + [HORIZON]
)
"""Time for which the terms before order p suffice: the first neglected one is `_NEGLECTED`."""
_SHORTEST = 12
_LONGER = 4
"""A series has 12, 16, 20 or 24 terms, by the expected time of its event."""

_LANEWISE = 10
"""Derivatives 4 .. 9 bound the fourth lane by lane; 10 and 11 of all lanes bound higher orders.

Two more orders multiply the largest derivative of a mover by at most 4, the norm of K; a force at
rest has at most twice its neighbours' of the order before. If E and O are the largest of the orders
10 and 11, the following are at most ``4 E + 2 O``, ``8 E + 4 O``, ``16 E + 8 O``, .., and the rest
of the fourth derivative's series up to t <= 1 is bounded as follows.
"""
_EVEN_TAIL = 1.1 / math.factorial(6)  # E (1/6! + 4/8! + 8/9! + 16/10! + ..) is 1.0911 E / 6!
_ODD_TAIL = 1.4 / math.factorial(7)  # O (1/7! + 2/8! + 4/9! + 8/10! + ..) is 1.3191 O / 7!

# bisection halves a piece of length 1 down to an ulp in 53 steps; this is many times more
_MOST_PIECES = 500
_POLISH = 4
"""Most Newton steps after the estimate of a candidate has converged."""


@inlined
def _expand(cell, series, first, strips):
    """Fill value and first derivative of the window that begins in column `first` of `cell`.

    Returns whether a slider has started without any force beyond friction.
    """
    forceless = 0
    for s in range(strips):
        row, i = SERIES * s, first + WIDTH * s
        forceless |= margins.expand(cell, series, row, layout.MOVES, i)
    return forceless != 0


@inlined
def _differentiate(series, strips, begin, end):
    """Complete the derivatives begin + 1 .. end - 1 of all margins.

    Row `begin` is complete: it holds the derivative of the movers' velocity and, one order behind,
    the derivative of the force on the sliders at rest. The row after the last complete row holds
    only the movers' part.
    """
    if strips > 2:
        # one more than requested: `begin` is odd if it is not the first
        for k in range(begin + begin % 2, end, 2):
            margins.two_orders(series, 0, SERIES, layout.MOVES, strips, k)
    elif strips == 2:
        _differentiate_two(series, begin, end)
    else:
        _differentiate_one(series, begin, end)


@inlined
def _differentiate_one(series, begin, end):
    """Do the same in registers, for one strip; its outermost lanes rest."""
    moves, rests = take(series, layout.MOVES), take(series, layout.RESTS)
    holds = take(series, layout.HOLDS)
    y = moves * take(series, begin)
    after = take(series, begin + 1)
    for k in range(begin + 1, end):
        around = from_left(y, y) + from_right(y, y)
        put(series, k, fused(rests, around, after))
        y, after = after, fused(moves, around, holds * y)
    put(series, end, after)


@inlined
def _differentiate_two(series, begin, end):
    """Do the same in registers, for two strips."""
    moves, rests = take(series, layout.MOVES), take(series, layout.RESTS)
    holds = take(series, layout.HOLDS)
    moves_2, rests_2 = take(series, SERIES + layout.MOVES), take(series, SERIES + layout.RESTS)
    holds_2 = take(series, SERIES + layout.HOLDS)
    y, y_2 = moves * take(series, begin), moves_2 * take(series, SERIES + begin)
    after, after_2 = take(series, begin + 1), take(series, SERIES + begin + 1)
    for k in range(begin + 1, end):
        around = from_left(y_2, y) + from_right(y, y_2)
        around_2 = from_left(y, y_2) + from_right(y_2, y)
        put(series, k, fused(rests, around, after))
        put(series, SERIES + k, fused(rests_2, around_2, after_2))
        y, after = after, fused(moves, around, holds * y)
        y_2, after_2 = after_2, fused(moves_2, around_2, holds_2 * y_2)
    put(series, end, after)
    put(series, SERIES + end, after_2)


@inlined
def _largest_late(series, strips):
    """Return the largest derivatives of the orders 10 and 11 in the window."""
    even = abs(take(series, _LANEWISE))
    odd = abs(take(series, _LANEWISE + 1))
    for s in range(1, strips):
        even = max(even, abs(take(series, SERIES * s + _LANEWISE)))
        odd = max(odd, abs(take(series, SERIES * s + _LANEWISE + 1)))
    return largest(even), largest(odd)


@inlined
def _candidate(cell, series, first, strips):
    """Return the lane whose margin seems to end first, and when, from three derivatives each.

    A wrong guess only costs time. Lane -1: none within the `HORIZON`.
    """
    best = HORIZON
    lane = -1
    for s in range(strips):
        i = first + WIDTH * s
        row = SERIES * s
        p0, p1, p2 = margins.approach(cell, series, row, i)
        square = p1 * p1 - 4.0 * p2 * p0
        # most strips have no zero before the earliest found so far
        then = fused(fused(p2, best, p1), best, p0)
        rises = fused(p2, 2.0 * best, p1) > 0.0
        if (then <= 0.0) | (rises & (p1 < 0.0) & (square >= 0.0)) == 0:
            continue
        guess = margins.first_zero(p0, p1, p2)
        soonest = least(guess)
        if soonest < best:
            best = soonest
            lane = WIDTH * s + lowest_bit(guess <= soonest)
    return lane, best


@inlined
def _at_both_ends(series, row, lane):
    """Return value and slope of one margin at the beginning and the end of the step."""
    return (
        element(series, row, lane),
        element(series, row + 1, lane),
        element(series, row + layout.AT_END, lane),
        element(series, row + layout.SLOPE_AT_END, lane),
    )


@apart
def _doubt(cell, now, i):
    """Count a slider as undecided, once in a rearrangement."""
    if cell[layout.DOUBTED, i] != now.counts.rearrangements:
        cell[layout.DOUBTED, i] = now.counts.rearrangements
        now.counts.undecided += 1


@apart
def _first_crossing(cell, series, now, i, row, lane, orders, upper, t):
    """Return the first time in [0, t] at which one margin leaves its range, inf if it never does.

    The series' rows at the end of the step hold the values at t. The search uses Newton steps and
    bisection, with a certificate for every piece left behind. A piece as short as a rounding error
    that is neither clear nor crossed is a graze: undecided; a mover stops there, a resting slider
    stays.
    """
    moving = cell[layout.SIDE, i] != 0.0
    side = -1.0 if upper else 1.0
    threshold = margins.end_of_range(cell, i)
    at_a, slope_a, at_b, slope_b = _at_both_ends(series, row, lane)
    bend = series[row + layout.BENT, lane]
    curve = margins.curved(series, row, lane, bend, t)
    bound = margins.rounding(cell, now, i, at_a, slope_a, at_b, slope_b, t)
    at_t = at_b
    slope_t = slope_b
    at_a = threshold + side * at_a
    slope_a = side * slope_a
    begins = cell[layout.FRESH, i] != 0.0
    if not begins and abs(at_a) <= bound:
        # at the end of its range
        _doubt(cell, now, i)
        lead = slope_a
        for k in range(2, 4):
            if lead == 0.0 and not moving:
                lead = side * series[row + k, lane]
        at_once, _ = _leaves(lead, moving, 0.0)
        if at_once:
            return 0.0
        begins = True
    a = 0.0
    b = t
    far = t
    crossed = False
    for _ in range(_MOST_PIECES):
        if b != t:
            at_b, slope_b = margins.at_time(series, row, lane, orders, b)
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
            (crossed and slope_b < 0.0) or falls(slope_b, bound, curve)
        ) and is_clear(at_a, slope_a, 0.0, slope_b, bend, b - a, bound, begins, True):  # fmt: skip
            if falls(slope_b, bound, curve):
                return min(max(b - at_b / slope_b, a), far)
            _doubt(cell, now, i)  # it is beyond at `far`, but may have turned back before
            return b
        else:
            clear = at_b > bound and is_clear(
                at_a, slope_a, at_b, slope_b, bend, b - a, bound, begins, False
            )
            graze = not clear and is_clear(
                at_a + 2.0 * bound, slope_a, at_b + 2.0 * bound, slope_b, bend, b - a,
                0.0, True, False,
            )  # fmt: skip
            if graze:
                # it may touch the end of its range within rounding: a slider at rest stays,
                _doubt(cell, now, i)
                stops, _ = _leaves(0.0, moving, 0.0)
                if stops and slope_a < 0.0 and slope_b > 0.0:
                    # and a mover stops, where it is slowest
                    least = a - (b - a) * slope_a / (slope_b - slope_a)
                    at_least, _ = margins.at_time(series, row, lane, orders, least)
                    if side * at_least <= 2.0 * bound:
                        return least
                    b = least
                    continue
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
    _doubt(cell, now, i)
    return far if crossed else np.inf


@inlined
def _evaluate(series, strips, orders, even_tail, odd_tail, t):
    """Fill displacements, margins and slopes at t, and bounds of fourth derivatives until then.

    `even_tail`, `odd_tail` are the largest derivatives of the orders 10 and 11; see `_LANEWISE`.
    """
    u = t * t
    ladder = series.shape[0] - LADDER
    for k in range(LADDER):
        put(series, ladder + k, u * take(margins.STEP_FACTORS, k))
    zero = spread(0.0)
    tail = spread(u * u * u * (even_tail * _EVEN_TAIL + t * odd_tail * _ODD_TAIL))
    # movers' displacements and velocities of the previous strip and of the present one
    before = moved = zero
    running_before = running = zero
    for s in range(strips + 1):
        following = zero
        running_following = zero
        if s < strips:
            row = SERIES * s
            value, moved_on = margins.summed(series, row, orders, series, ladder, 1.0, t)
            moves = take(series, row + layout.MOVES)
            following = moves * moved_on
            running_following = moves * value
            put(series, row + layout.AT_END, value)
            put(series, row + layout.MOVED, following)
            bent = abs(take(series, row + 9))
            bent = fused(bent, t * (1.0 / 5.0), abs(take(series, row + 8)))
            bent = fused(bent, t * (1.0 / 4.0), abs(take(series, row + 7)))
            bent = fused(bent, t * (1.0 / 3.0), abs(take(series, row + 6)))
            bent = fused(bent, t * (1.0 / 2.0), abs(take(series, row + 5)))
            bent = fused(bent, t, abs(take(series, row + 4)))
            put(series, row + layout.BENT, bent + tail)
        if s > 0:
            row = SERIES * (s - 1)
            around = from_left(before, moved) + from_right(moved, following)
            flow = from_left(running_before, running) + from_right(running, running_following)
            moves = take(series, row + layout.MOVES)
            held = take(series, row + layout.HOLDS) * moved
            push = fused(moves, around + take(series, row + 1), held)
            slope = fused(take(series, row + layout.RESTS), flow, push)
            put(series, row + layout.SLOPE_AT_END, slope)
        before = moved
        moved = following
        running_before = running
        running = running_following


@inlined
def _suspects(cell, series, first, s, t):
    """Return the masks of the lanes of one strip not proved to stay in range on (0, t].

    The first mask is for the lower end of the range, the second for the upper.
    """
    i = first + WIDTH * s
    row = SERIES * s
    third = t * (1.0 / 3.0)
    g0 = take(series, row)
    slope0 = take(series, row + 1)
    g1 = take(series, row + layout.AT_END)
    slope1 = take(series, row + layout.SLOPE_AT_END)
    rest = take(series, row + layout.BENT) * (t * t * t * t * (1.0 / 144.0))
    b1 = fused(third, slope0, g0)
    b2 = g1 - third * slope1
    q1 = 0.25 * fused(3.0, b1, g0)
    q2 = 0.5 * (b1 + b2)
    q3 = 0.25 * fused(3.0, b2, g1)
    low = min(q1, q2 - rest, q3, g1)
    high = max(q1, q2 + rest, q3, g1)
    scale = abs(g0) + abs(g1) + t * (abs(slope0) + abs(slope1))
    lower, upper = margins.leaving(cell, i, g0, low, high, scale, t)
    here = margins.watched(cell, i)
    return lower & here, upper & here


@apart
def _tangential(cell, whole, series, first, last):
    """Find the sliders that have started but do not move away, and return their number.

    Velocity and acceleration are zero: the first derivative that is not zero decides.
    """
    events = 0
    for i in range(first, last + 1):
        if cell[layout.SIDE, i] == 0.0 or cell[layout.FRESH, i] == 0.0:
            continue
        if cell[layout.DRIVE, i] > 0.0:
            continue
        row = SERIES * ((i - first) // WIDTH)
        lead = 0.0
        for k in range(2, ORDERS):
            if lead == 0.0:
                lead = series[row + k, (i - first) % WIDTH]
        stops, _ = _leaves(lead * cell[layout.SIDE, i], True, 0.0)
        if stops:
            whole[layout.EVENT, events] = i
            events += 1
    return events


@inlined
def _together(cell, whole, series, now, first, contenders, t):
    """Keep the sliders whose event is at t, within its rounding bound.

    Returns their number, and the blur of t. All contenders are examined again once t is known,
    because the order of finding them must not matter: the first turn finds how far
    t is off, the second keeps the sliders within it.
    """
    missed = 0.0  # distance from the end of their range of the margins that determine t
    blur = 0.0
    for turn in range(2):
        events = 0
        for k in range(contenders):
            i = whole[layout.EVENT, k]
            row = SERIES * ((i - first) // WIDTH)
            lane = (i - first) % WIDTH
            at_0, slope_0, at_1, slope_1 = _at_both_ends(series, row, lane)
            off = abs(abs(at_1) - margins.end_of_range(cell, i))
            outward = -cell[layout.SIDE, i] * slope_1
            if cell[layout.SIDE, i] == 0.0:
                outward = slope_1 if at_1 > 0.0 else -slope_1
            crosses = series[row + layout.CROSSING, lane] == t
            bound = margins.rounding(cell, now, i, at_0, slope_0, at_1, slope_1, t)
            if turn == 0:
                if crosses:
                    missed = max(missed, off)
                    blur = max(blur, margins.blur(slope_1, bound))
                continue
            curve = margins.curved(series, row, lane, series[row + layout.BENT, lane], t)
            order, _ = _order(off, max(missed, bound), 0.0)
            excluded = not (crosses or falls(-outward, bound, curve))
            for earlier in range(events):
                excluded = excluded or whole[layout.EVENT, earlier] == i
            if order <= 0 and not excluded:
                whole[layout.EVENT, events] = i
                events += 1
    now.counts.undecided += max(events - 1, 0)
    return events, blur


@inlined
def _own_root(cell, series, now, i, lane, strips, orders, even_tail, odd_tail, t):
    """Polish the root of the candidate, and certify its own margin before it.

    Returns t, blur, outward (+1 if the margin leaves its range upwards, -1 downwards), holds
    (whether the margin is at the end of its range at t, within its rounding bound; if not, the root
    is beyond the horizon or the estimate failed, and there is no candidate), and proved (whether
    the margin stays in its range until t, and leaves it there).
    """
    row = SERIES * (lane // WIDTH)
    j = lane % WIDTH
    limit = margins.end_of_range(cell, i)
    for polished in range(_POLISH + 1):
        at_0, slope_0, at_1, slope_1 = _at_both_ends(series, row, j)
        bound = margins.rounding(cell, now, i, at_0, slope_0, at_1, slope_1, t)
        outward = margins.outwards(cell[layout.SIDE, i], slope_1)
        off = at_1 - outward * limit
        # the root must hold within its rounding bound, or a tie with it would be missed
        if abs(off) <= 0.5 * bound or slope_1 == 0.0 or polished == _POLISH:
            break
        t = min(max(t - off / slope_1, 0.0), _REACH[orders])
        _evaluate(series, strips, orders, even_tail, odd_tail, t)
    fresh = cell[layout.FRESH, i] != 0.0
    bend = series[row + layout.BENT, j]
    curve = margins.curved(series, row, j, bend, t)
    holds = abs(off) <= bound and falls(-outward * slope_1, bound, curve)
    proved = holds and ends_first(at_0, slope_0, limit, outward, slope_1, bend, t, bound, fresh)
    return t, margins.blur(slope_1, bound), outward, holds, proved


@inlined
def _located(cell, series, first, strips, orders):
    """Return the lane of the candidate, the time of its event, and the necessary orders.

    The lane is -1, and the time the `HORIZON`, if there is no event until then.
    """
    lane, t = _candidate(cell, series, first, strips)
    while True:
        wanted = orders
        while t > _REACH[wanted]:
            wanted += _LONGER
        if wanted > orders:
            _differentiate(series, strips, orders - 1, wanted)
            orders = wanted
        if lane < 0:
            return lane, t, orders
        row = SERIES * (lane // WIDTH)
        t = margins.refined(cell, series, first + lane, row, lane % WIDTH, orders, t)
        if t > HORIZON:
            lane = -1
            t = HORIZON
        elif t <= _REACH[orders]:
            return lane, t, orders


@inlined
def _rivals(cell, whole, series, now, first, strips, orders, spared, outward, events, t):
    """Examine all sliders alone that are not certified to stay in range until t.

    For lane `spared` (-1: none) the end of the range in direction `outward` is certified. Returns
    how many sliders were examined; the number of sliders of the first events (their columns are in
    ``whole[EVENT]``, and their times in their rows CROSSING); and the first time, inf if none.
    """
    looked = 0
    soonest = np.inf
    for s in range(strips):
        lower, upper = _suspects(cell, series, first, s, t)
        if spared >= 0 and spared // WIDTH == s:
            own = np.int64(1) << (spared % WIDTH)
            if outward > 0.0:
                upper &= ~own
            else:
                lower &= ~own
        suspects = lower | upper
        row = SERIES * s
        while suspects != 0:
            lane = lowest_bit(suspects)
            suspects &= suspects - 1
            i = first + WIDTH * s + lane
            looked += 1
            for side in range(2):
                if ((upper if side == 1 else lower) >> lane) & 1 == 0:
                    continue
                crossing = _first_crossing(cell, series, now, i, row, lane, orders, side == 1, t)
                if events == 0 or whole[layout.EVENT, events - 1] != i:
                    whole[layout.EVENT, events] = i
                    events += 1
                    series[row + layout.CROSSING, lane] = np.inf
                if crossing <= min(soonest, t):
                    series[row + layout.CROSSING, lane] = crossing
                    soonest = crossing
    return looked, events, soonest


@inlined
def _count_possible_ties(cell, whole, series, now, first, strips, events, blur, t):
    """Count the sliders whose event may come before the events at t, which are known to `blur`."""
    for s in range(strips):
        i = first + WIDTH * s
        mask = margins.soon_after(cell, series, SERIES * s, now.inherited, i, blur, t)
        for k in range(events):
            lane = whole[layout.EVENT, k] - i
            if 0 <= lane < WIDTH:
                mask &= ~(np.int64(1) << lane)
        while mask != 0:
            _doubt(cell, now, i + lowest_bit(mask))
            mask &= mask - 1


@inlined
def step(cell, whole, series, now, first, last):
    """Take the movers of columns first + 1 .. last - 1 to their first event.

    Returns the time t advanced, at most `HORIZON`; the number of sliders of the event, whose
    columns are in ``whole[EVENT]`` (0: no event within the horizon); and the uncertainty of t.
    """
    strips = (last - first + WIDTH) // WIDTH
    forceless = _expand(cell, series, first, strips)
    orders = ORDERS if forceless else _SHORTEST
    _differentiate(series, strips, np.int64(0), orders)
    if forceless:
        events = _tangential(cell, whole, series, first, last)
        if events > 0:
            return 0.0, events, 0.0
    lane, t, orders = _located(cell, series, first, strips, orders)
    even_tail, odd_tail = _largest_late(series, strips)
    _evaluate(series, strips, orders, even_tail, odd_tail, t)
    events = 0
    blur = 0.0
    spared = -1
    outward = 1.0
    if lane >= 0:
        t, blur, outward, holds, proved = _own_root(
            cell, series, now, first + lane, lane, strips, orders, even_tail, odd_tail, t
        )
        if holds:
            events = 1
            whole[layout.EVENT, 0] = first + lane
            series[SERIES * (lane // WIDTH) + layout.CROSSING, lane % WIDTH] = t
        if proved:
            spared = lane
    own_event = events > 0
    # all search for their crossing until t, so that their order does not matter
    looked, contenders, soonest = _rivals(
        cell, whole, series, now, first, strips, orders, spared, outward, events, t
    )
    if soonest < t:
        t = soonest
        _evaluate(series, strips, orders, even_tail, odd_tail, t)
    if looked > 0:
        events = 0
        if own_event or soonest <= t:
            events, blur = _together(cell, whole, series, now, first, contenders, t)
    if events > 0:
        _count_possible_ties(cell, whole, series, now, first, strips, events, blur, t)
    for s in range(strips):
        i = first + WIDTH * s
        row = SERIES * s
        side = load(cell, layout.SIDE, i)
        store(cell, layout.X, i, load(cell, layout.X, i) + take(series, row + layout.MOVED))
        store(cell, layout.SPEED, i, max(side * take(series, row + layout.AT_END), 0.0))
        if t > 0.0:
            store(cell, layout.FRESH, i, 0.0)
    return t, events, blur
