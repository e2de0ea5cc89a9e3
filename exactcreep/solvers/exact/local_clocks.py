"""Asynchronous events: each part of a long cluster keeps the Taylor series of its own last change.

An event changes one slider. It alters the margin (see `taylor`) of a slider at a distance d by at
most ``J t**(2 d) / (2 d)!`` after a time t, where J is the jump of its acceleration: a change
spreads by one slider every two orders. So a long window is expanded as a whole only once in an
*epoch* of `EPOCH` tau_dyn. At an event the sliders up to seven away are expanded anew from their
state at that time, and all others keep their series.

With the remaining time r of the epoch, the neglected effect of an event eight sliders away is
``J r**16 / 16!``, at most 4.8e-18 J (at nine 5e-21 J). A new series follows the sliders up to
fifteen away as if those beyond did not move: a velocity v at sixteen changes the stored margins by
at most ``v r**17 / 17!``, less than the jump does. With ``w = max(2 |v|, |v'|)`` over all movers
``|w'| <= 2 w``, because ``|2 v'| <= 2 w`` and ``|v''| = |K v| <= 4 |v| <= 2 w``: J and v stay below
``exp(2 EPOCH)`` times the largest w seen. The sum over the events of an epoch is kept below
`_BUDGET` friction forces, a quarter of the smallest rounding bound of a margin at rest; the effect
on a velocity is smaller by the factor t/17. Once half of it is spent, or a window is wilder than
`_CALM`, all sliders are expanded anew.

Each slider has a *key*: the time until which its margin is certified to stay in its range, or the
time of its located event. Keys come from the Taylor polynomial of degree three in Bernstein form,
eight sliders at a time; the slider with the first key is examined alone. A located event is taken
if no other key is near. Everything else (ties, grazes, sliders that start without force) is left to
`taylor.step`, with all sliders at the time of the last event.

The treatment of a slider depends only on its distance from an event, so that the mirror image of a
chain moves as its mirror image, bit for bit.

Source: Eqs. 5-10; derivations/modes.py.
"""

from __future__ import annotations

import math

from exactcreep.compiling import apart, compiled, inlined
from exactcreep.solvers.exact import layout, margins
from exactcreep.solvers.exact.layout import CLOCKS, EPOCH, KNOWN, NEVER, SERIES, ULP
from exactcreep.solvers.exact.margins import ends_first, falls, is_clear
from exactcreep.solvers.exact.simd import (
    choose,
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

_CALM = 16.0
_LEFT_OUT = 2.0 * math.exp(2 * EPOCH) / math.factorial(16)
"""Neglected effect of the jump and of distant velocities, in units of w r**16."""
_BUDGET = 8.0 * ULP
"""Largest neglected part of a margin in an epoch, in units of friction."""
_GAP = 2.0**-20
"""Events closer than this are examined together."""
_SIXTH, _SEVENTH = (EPOCH**k / math.factorial(k) for k in (6, 7))
_TAIL = sum(2.0 ** (k - 8) * EPOCH**k / math.factorial(k) for k in range(8, 40))
"""Sum of all orders from 8 on, in units of the largest derivative of the orders 8 and 9: two more
orders multiply a mover's by at most 4, and a force at rest has twice its neighbours' before."""
_PIECES = 8  # most intervals in which one look examines a margin
# work of an event and of a strip that begins an epoch, in units of about 5 ns
_EVENT_WORK = 120
_STRIP_WORK = 20
_EARLY = 0.9
"""Fraction of the way to the guessed event at which a key is set."""


@inlined
def _blocks(cell):
    """Return the first of the rows with the first keys of all strips."""
    return CLOCKS * (cell.shape[1] // 8)


@inlined
def _at(clock, cell, strip, time):
    """Return margins and displacements of eight columns since their base times."""
    row = CLOCKS * strip
    tau = max(min(time - take(clock, row + layout.BASE), EPOCH), 0.0)
    margin, moved = margins.summed(clock, row, KNOWN, margins.STEP_FACTORS, 0, tau * tau, tau)
    side = load(cell, layout.SIDE, 8 * strip)
    return margin, (side * side) * moved


@inlined
def _mark(cell, clock, strip):
    """Update the first key of eight columns."""
    keys = take(clock, CLOCKS * strip + layout.KEY)
    clock[_blocks(cell) + strip // 8, strip % 8] = least(keys)


@inlined
def _inside(cell, clock, strip, bent, tau):
    """Return which of eight margins are certified to stay in range for `tau` after their base."""
    row = CLOCKS * strip
    share = tau * (1.0 / EPOCH)
    share = share * share * share
    square = tau * tau
    a0 = take(clock, row)
    a1 = tau * take(clock, row + 1)
    a2 = square * take(clock, row + 2) * (1.0 / 2.0)
    a3 = square * tau * take(clock, row + 3) * (1.0 / 6.0)
    bend = abs(take(clock, row + 4)) * (1.0 / 24.0)
    bend = fused(abs(take(clock, row + 5)) * (1.0 / 120.0), tau, bend)
    bend = fused(square * square, bend, bent * share * share)
    b1 = fused(a1, 1.0 / 3.0, a0)
    b2 = fused(a1 + a1 + a2, 1.0 / 3.0, a0)
    b3 = (a0 + a1) + (a2 + a3)
    low = min(b1, b2, b3 - bend)
    high = max(b1, b2, b3 + bend)
    scale = (abs(a0) + abs(a1)) + (abs(a2) + abs(a3)) + bend
    lower, upper = margins.leaving(cell, 8 * strip, a0, low, high, scale, tau)
    return ~(lower | upper)


@inlined
def _keep(cell, clock, strip, begin, bent, mask):
    """Give the columns in the mask the keys of their new series."""
    column = 8 * strip
    row = CLOCKS * strip
    left = spread(EPOCH - begin)
    key = choose(mask, NEVER, take(clock, row + layout.KEY))
    ends = margins.watched(cell, column) & mask & ~_inside(cell, clock, strip, bent, left)
    if ends != 0:
        guess = margins.first_zero(*margins.approach(cell, clock, row, column))
        tau = min(guess * _EARLY, left)
        inside = _inside(cell, clock, strip, bent, tau)
        key = choose(ends, choose(inside, begin + tau, begin), key)
        put(clock, row + layout.GUESS, choose(ends, begin + guess, take(clock, row + layout.GUESS)))
    put(clock, row + layout.KEY, key)
    put(clock, row + layout.ROOT, choose(mask, NEVER, take(clock, row + layout.ROOT)))
    _mark(cell, clock, strip)


@inlined
def _begin_epoch(cell, clock, now):
    """Expand the whole window; return whether it is calm enough, and no slider is forceless."""
    zero = spread(0.0)
    friction = now.chain.least_friction
    first = (now.first - 1) // 8
    strips = (now.last + 9) // 8 - first
    now.counts.work += _STRIP_WORK * strips
    forceless = 0
    wildest = zero
    for s in range(first, first + strips):
        row, i = CLOCKS * s, 8 * s
        forceless |= margins.expand(cell, clock, row, layout.MOVED_THEN, i)
        put(clock, row + layout.BASE, 0.0)
        moves = take(clock, row + layout.MOVED_THEN)
        speed = load(cell, layout.SPEED, i)
        wildest = max(wildest, speed + speed, moves * abs(take(clock, row + 1)))
    wild = largest(wildest)
    if forceless != 0 or wild > _CALM * friction:
        return False
    for k in range(0, KNOWN, 2):
        margins.two_orders(clock, CLOCKS * first, CLOCKS, layout.MOVED_THEN, strips, k)
    late = zero
    for s in range(first, first + strips):
        row = CLOCKS * s
        late = max(late, abs(take(clock, row + 8)))
        late = max(late, abs(take(clock, row + 9)))
    tail = spread(_TAIL * largest(late))
    for s in range(first, first + strips):
        row = CLOCKS * s
        bent = fused(abs(take(clock, row + 6)), _SIXTH, tail)
        bent = fused(abs(take(clock, row + 7)), _SEVENTH, bent)
        _keep(cell, clock, s, 0.0, bent, 255)
    now.epoch.left = first
    now.epoch.right = first + strips - 1
    now.epoch.time = 0.0
    now.epoch.wild = max(wild, friction)
    now.epoch.spent = 0.0
    now.epoch.centre = 0
    now.epoch.on = 1
    return True


@inlined
def _bring(cell, clock, strip, time, mask):
    """Take the columns in the mask to a time; return the places and velocities of all eight."""
    row = CLOCKS * strip
    column = 8 * strip
    margin, moved = _at(clock, cell, strip, time)
    x = load(cell, layout.X, column) + moved
    speed = max(load(cell, layout.SIDE, column) * margin, 0.0)
    store(cell, layout.X, column, choose(mask, x, load(cell, layout.X, column)))
    store(cell, layout.SPEED, column, choose(mask, speed, load(cell, layout.SPEED, column)))
    store(cell, layout.FRESH, column, choose(mask, 0.0, load(cell, layout.FRESH, column)))
    put(clock, row + layout.BASE, choose(mask, time, take(clock, row + layout.BASE)))
    return x, speed


@inlined
def _around(i):
    """Return the first of five strips that hold column i and sixteen to either side.

    Also returns the mask of the lanes, from that strip on, that are up to seven away.
    """
    first = (i - 16) // 8
    return first, ((1 << 15) - 1) << (i - 7 - 8 * first)


@inlined
def _arrive(cell, clock, i, time):
    """Take the sliders around i to the time of its event."""
    first, nearby = _around(i)
    for q in range(5):
        x, speed = _bring(cell, clock, first + q, time, nearby >> (8 * q))
        put(clock, CLOCKS * (first + q) + layout.NOW_X, x)
        put(clock, CLOCKS * (first + q) + layout.NOW_SPEED, speed)


@inlined
def _renew(cell, clock, series, now):
    """Expand the sliders around the last event anew; return whether they are calm enough.

    In five strips of `series`, fifteen sliders to either side move; seven to either side keep the
    result.
    """
    i = now.epoch.centre
    begin = now.epoch.time
    fresh = cell[layout.FRESH, i] > 0.0
    if fresh and cell[layout.DRIVE, i] <= 0.0:
        return False
    clock[CLOCKS * (i // 8) + layout.NOW_SPEED, i % 8] = cell[layout.SPEED, i]
    first, nearby = _around(i)
    window = ((1 << 31) - 1) << (i - 15 - 8 * first)
    centre = i - 8 * first
    zero = spread(0.0)
    wildest = zero
    before, x = zero, take(clock, CLOCKS * first + layout.NOW_X)
    for q in range(5):
        row, then, column = SERIES * q, CLOCKS * (first + q), 8 * (first + q)
        following = take(clock, then + CLOCKS + layout.NOW_X) if q < 4 else zero
        around = from_left(before, x) + from_right(x, following)
        speed = take(clock, then + layout.NOW_SPEED)
        here = choose(window >> (8 * q), 1.0, zero)
        alone = ((1 << centre) >> (8 * q)) * fresh
        margins.expand_at(cell, series, row, layout.MOVES, column, around, x, speed, alone, here)
        moves = take(series, row + layout.MOVES)
        wildest = max(wildest, moves * (speed + speed), abs(take(series, row + 1)))
        before, x = x, following
    wild = largest(wildest)
    remaining = (EPOCH - begin) * (EPOCH - begin)
    remaining *= remaining
    remaining *= remaining
    remaining *= remaining
    now.epoch.wild = max(now.epoch.wild, wild)
    now.epoch.spent += remaining * _LEFT_OUT
    if (
        wild > _CALM * now.chain.least_friction
        or now.epoch.spent * now.epoch.wild > _BUDGET * now.chain.least_friction
    ):
        return False
    for k in range(0, KNOWN, 2):
        margins.two_orders(series, 0, SERIES, layout.MOVES, 5, k)
    late = zero
    for q in range(5):
        row = SERIES * q
        late = max(late, abs(take(series, row + 8)), abs(take(series, row + 9)))
    tail = _TAIL * largest(late)
    for q in range(1, 4):
        row, then, mask = SERIES * q, CLOCKS * (first + q), nearby >> (8 * q)
        for k in range(KNOWN):
            put(clock, then + k, choose(mask, take(series, row + k), take(clock, then + k)))
        bent = fused(abs(take(series, row + 6)), _SIXTH, tail)
        bent = fused(abs(take(series, row + 7)), _SEVENTH, bent)
        _keep(cell, clock, first + q, begin, bent, mask)
    now.epoch.left = min(now.epoch.left, first + 1)
    now.epoch.right = max(now.epoch.right, first + 3)
    now.epoch.centre = 0
    return True


@inlined
def _soonest(cell, clock, now):
    """Return the column with the first key; -1 if there is none."""
    blocks = _blocks(cell)
    first = blocks + now.epoch.left // 8
    last = blocks + now.epoch.right // 8
    keys = take(clock, first)
    for b in range(first + 1, last + 1):
        keys = min(keys, take(clock, b))
    key = least(keys)
    if key >= NEVER:
        return -1
    while True:
        due = take(clock, first) <= key
        if due != 0:
            break
        first += 1
    strip = 8 * (first - blocks) + lowest_bit(due)
    return 8 * strip + lowest_bit(take(clock, CLOCKS * strip + layout.KEY) <= key)


@inlined
def _alone(cell, clock, now, time):
    """Return whether only one slider has a key up to a time."""
    blocks = _blocks(cell)
    strip = -1
    for b in range(blocks + now.epoch.left // 8, blocks + now.epoch.right // 8 + 1):
        due = take(clock, b) <= time
        if due != 0:
            if strip >= 0 or due & (due - 1) != 0:
                return False
            strip = 8 * (b - blocks) + lowest_bit(due)
    due = take(clock, CLOCKS * strip + layout.KEY) <= time
    return due & (due - 1) == 0


@apart
def _look(cell, clock, now, i):
    """Advance the key of one slider; return whether no comparison was close."""
    row = CLOCKS * (i // 8)
    lane = i % 8
    base = element(clock, row + layout.BASE, lane)
    side = cell[layout.SIDE, i]
    limit = margins.end_of_range(cell, i)
    a = element(clock, row + layout.KEY, lane) - base
    end = EPOCH - base
    fresh = cell[layout.FRESH, i] != 0.0
    target = element(clock, row + layout.GUESS, lane) - base
    located = False
    if a < target < 1.0:
        target = margins.refined(cell, clock, i, row, lane, KNOWN, target)
        if a < target <= end:
            target = (base + target) - base
            located = True
    at_a = element(clock, row, lane)
    slope_a = element(clock, row + 1, lane)
    b = target if located else end
    for _ in range(_PIECES):
        if b - a < _GAP:
            return False
        at_b, slope_b = margins.at_time(clock, row, lane, KNOWN, b)
        bend = bend_odd = 0.0
        for k in range(KNOWN - 2, 3, -2):
            factor = b * b * element(margins.STEP_FACTORS, 0, k - 3)
            bend = fused(bend, factor, abs(element(clock, row + k, lane)))
            factor = b * b * element(margins.STEP_FACTORS, 0, k - 2)
            bend_odd = fused(bend_odd, factor, abs(element(clock, row + k + 1, lane)))
        bend = fused(b, bend_odd, bend)
        bound = margins.rounding(cell, now, i, at_a, slope_a, at_b, slope_b, b)
        if located:
            outward = margins.outwards(side, slope_b)
            off = at_b - outward * limit
            steep = outward * slope_b
            curve = margins.curved(clock, row, lane, bend, b)
            plain = abs(off) <= bound + 2.0 * ULP * steep and steep * _GAP > 8.0 * bound
            plain = plain and falls(-steep, bound, curve)
            plain = plain and ends_first(
                at_a, slope_a, limit, outward, slope_b, bend, b, bound, fresh
            )
            if plain and side == 0.0:
                plain = is_clear(
                    limit + outward * at_a, outward * slope_a, limit + outward * at_b, steep,
                    bend, b, bound, False, False,
                )  # fmt: skip
            if plain:
                clock[row + layout.KEY, lane] = base + b
                clock[row + layout.ROOT, lane] = base + b
                clock[row + layout.BLUR, lane] = margins.blur(steep, bound)
                _mark(cell, clock, i // 8)
                return True
        else:
            plain = True
            for way in (1.0, -1.0):
                if side * way >= 0.0:
                    plain = plain and is_clear(
                        limit + way * at_a, way * slope_a, limit + way * at_b, way * slope_b,
                        bend, b, bound, fresh, False,
                    )  # fmt: skip
            if plain:
                clock[row + layout.KEY, lane] = base + b if b < end else NEVER
                _mark(cell, clock, i // 8)
                return True
        located = False
        b = a + 0.5 * (b - a)
    return False


@compiled
def at_once(cell, clock, now):
    """Take all sliders to the present time; the epoch is over."""
    for b in range(now.epoch.left, now.epoch.right + 1):
        clock[_blocks(cell) + b // 8, b % 8] = NEVER
        put(clock, CLOCKS * b + layout.KEY, spread(NEVER))
        _bring(
            cell, clock, b, now.epoch.time, take(clock, CLOCKS * b + layout.BASE) < now.epoch.time
        )
    now.epoch.on = 0


@apart
def cluster_step(cell, whole, clock, series, now):
    """Take a long cluster to its first event, or to the end of the epoch.

    Returns t, events and blur like `taylor.step`; `events` is -1 if that function has to do it.
    """
    now.counts.work += _EVENT_WORK
    left = 0.5 * _BUDGET * now.chain.least_friction
    if now.epoch.on == 1 and now.epoch.spent * now.epoch.wild > left:
        at_once(cell, clock, now)
    if now.epoch.on == 0:
        if not _begin_epoch(cell, clock, now):
            return 0.0, -1, 0.0
    elif now.epoch.centre != 0 and not _renew(cell, clock, series, now):
        at_once(cell, clock, now)
        return 0.0, -1, 0.0
    before = now.epoch.time
    while True:
        i = _soonest(cell, clock, now)
        if i < 0:
            now.epoch.time = EPOCH
            at_once(cell, clock, now)
            return now.epoch.time - before, 0, 0.0
        row = CLOCKS * (i // 8)
        time = element(clock, row + layout.ROOT, i % 8)
        if time < NEVER:
            if time - before < _GAP:
                break
            if _alone(cell, clock, now, time + _GAP):
                blur = element(clock, row + layout.BLUR, i % 8)
                _arrive(cell, clock, i, time)
                now.epoch.time = time
                now.epoch.centre = i
                whole[layout.EVENT, 0] = i
                return time - before, 1, blur
            clock[row + layout.KEY, i % 8] = NEVER
            _mark(cell, clock, i // 8)
            j = _soonest(cell, clock, now)
            if clock[CLOCKS * (j // 8) + layout.ROOT, j % 8] < NEVER:
                break
            clock[row + layout.KEY, i % 8] = time
            _mark(cell, clock, i // 8)
            i = j
        if not _look(cell, clock, now, i):
            break
    at_once(cell, clock, now)
    return 0.0, -1, 0.0
