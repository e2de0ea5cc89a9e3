"""Many movers far apart: each part of a long cluster keeps the series of its own last change.

An event changes one slider. That alters the margin (see `taylor`) of another, d sliders away, by
at most ``J t**(2 d) / (2 d)!`` after a time t, where J is the jump of its acceleration: every two
orders a change reaches one slider further. So a long window is expanded as a whole only once in
an *epoch* of `EPOCH` tau_dyn. At an event the sliders up to seven away are expanded anew from
their state at that time, and all others keep their series.

What is left out of an event eight sliders away, with the time r that is left of the epoch, is
``J r**16 / 16!``, at most 4.8e-18 J (at nine 5e-21 J). A new series follows the sliders up to
fourteen away and takes the velocities at fifteen as constant: accelerations A there contribute as
much as jumps. With ``w = max(2 |v|, |v'|)`` over all movers ``|w'| <= 2 w``, for K has the norm 4:
J and A stay below ``exp(2 EPOCH)`` times the largest w that was seen. The sum over the events of
an epoch is kept below `_BUDGET` friction forces, a quarter of the smallest rounding bound of a
margin at rest; a velocity gains one more order, ``t / 17`` of that. Once half of it is spent, or
a window is wilder than `_CALM`, all sliders are expanded anew.

Each slider has a *key*: the time until which its margin is certified to stay in its range, or
that of its located event. Keys come from the Taylor polynomial of degree three in Bernstein form,
eight sliders at a time; the slider with the first key is looked at alone. A located event is
taken if no other key is near. Whatever is not plain (ties, grazes, sliders that start without
force) is handed to `taylor.step`, with all sliders at the time of the last event.

What is done to a slider depends on its distance to an event and on nothing else: the mirror image
of a chain moves as its mirror image, bit for bit.

Source: Eqs. (dynamic_eq1)-(static_eqN); derivations/modes.py.
"""

from __future__ import annotations

import math

from exactcreep.solvers.exact import layout as at
from exactcreep.solvers.exact import margins
from exactcreep.solvers.exact.layout import compiled, inlined
from exactcreep.solvers.exact.margins import is_clear
from exactcreep.solvers.exact.simd import (
    across,
    choose,
    element,
    from_left,
    from_right,
    fused,
    inner,
    largest,
    least,
    load,
    lowest_bit,
    put,
    put_across,
    spread,
    store,
    strips,
    take,
)

_CALM = 16.0
_LEFT_OUT = 2.0 * math.exp(2 * at.EPOCH) / math.factorial(16)
"""By jump and by acceleration, in units of w r**16."""
_BUDGET = 8.0 * at.ULP
"""What an epoch may leave out of a margin, in units of friction."""
_GAP = 2.0**-20
"""Events closer than that are looked at together."""
_SIXTH, _SEVENTH = (at.EPOCH**k / math.factorial(k) for k in (6, 7))
_TAIL = sum(2.0 ** (k - 8) * at.EPOCH**k / math.factorial(k) for k in range(8, 40))
"""Of all orders from 8 on, in units of the largest derivative of the orders 8 and 9: two more
orders multiply a mover's by at most 4, and a force at rest has twice its neighbours' before."""
_PIECES = 8
_EVENT_WORK = 120
_STRIP_WORK = 20
_EARLY = 0.9
"""A key lies so far on the way to where the event is guessed."""


@inlined
def _blocks(cell):
    """Return the first of the rows with the first keys of all strips."""
    return at.CLOCKS * (cell.shape[1] // 8)


@inlined
def _at(clock, cell, strip, time):
    """Return margins and displacements since their base times of eight columns."""
    zero = spread(0.0)
    row = at.CLOCKS * strip
    tau = max(min(time - take(clock, row + at.BASE), at.EPOCH), 0.0)
    u = tau * tau
    even = odd = even_sum = odd_sum = zero
    after = u * element(margins.STEP_FACTORS, 0, at.KNOWN + 1)
    for k in range(at.KNOWN - 2, -1, -2):
        term = take(clock, row + k + 1)
        step = u * element(margins.STEP_FACTORS, 0, k + 2)
        odd = fused(odd, step, term)
        odd_sum = fused(odd_sum, after, term)
        term = take(clock, row + k)
        after = u * element(margins.STEP_FACTORS, 0, k + 1)
        even = fused(even, after, term)
        even_sum = fused(even_sum, step, term)
    side = load(cell, at.SIDE, 8 * strip)
    moved = (side * side) * (tau * fused(tau * 0.5, odd_sum, even_sum))
    return fused(tau, odd, even), moved


@inlined
def _mark(cell, clock, strip):
    """Bring up to date the first key of eight columns."""
    keys = take(clock, at.CLOCKS * strip + at.KEY)
    clock[_blocks(cell) + strip // 8, strip % 8] = least(keys)


@inlined
def _inside(cell, clock, friction, strip, bent, tau):
    """Return which of eight margins are certified to stay in range for `tau` after their base."""
    row = at.CLOCKS * strip
    share = tau * (1.0 / at.EPOCH)
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
    lower, upper = margins.leaving(cell, friction, 8 * strip, a0, low, high, scale, tau)
    return ~(lower | upper)


@inlined
def _keep(cell, clock, friction, strip, begin, bent, mask):
    """Give those of eight columns in the mask the keys of their new series."""
    column = 8 * strip
    row = at.CLOCKS * strip
    left = spread(at.EPOCH - begin)
    key = choose(mask, at.NEVER, take(clock, row + at.KEY))
    ends = margins.watched(cell, column) & mask & ~_inside(cell, clock, friction, strip, bent, left)
    if ends != 0:
        guess = margins.first_zero(*margins.approach(cell, clock, row, friction, column))
        tau = min(guess * _EARLY, left)
        inside = _inside(cell, clock, friction, strip, bent, tau)
        key = choose(ends, choose(inside, begin + tau, begin), key)
        put(clock, row + at.GUESS, choose(ends, begin + guess, take(clock, row + at.GUESS)))
    put(clock, row + at.KEY, key)
    put(clock, row + at.ROOT, choose(mask, at.NEVER, take(clock, row + at.ROOT)))
    _mark(cell, clock, strip)


@inlined
def _sweep(clock, first, strips, k):
    """Complete the derivatives k + 1 and k + 2 of all strips, and begin k + 3."""
    before = before_2 = spread(0.0)
    row = at.CLOCKS * first
    holds = take(clock, row + at.HOLD)
    y = choose(holds < 0.0, take(clock, row + k), 0.0)
    y_2 = choose(holds < 0.0, take(clock, row + k + 1), 0.0)
    for s in range(strips):
        moving = holds < 0.0
        following = following_2 = following_holds = spread(0.0)
        if s + 1 < strips:
            following_holds = take(clock, row + at.CLOCKS + at.HOLD)
            moves = following_holds < 0.0
            following = choose(moves, take(clock, row + at.CLOCKS + k), 0.0)
            following_2 = choose(moves, take(clock, row + at.CLOCKS + k + 1), 0.0)
        around = from_left(before, y) + from_right(y, following)
        around_2 = from_left(before_2, y_2) + from_right(y_2, following_2)
        put(clock, row + k + 1, choose(moving, y_2, around))
        put(clock, row + k + 2, choose(moving, fused(holds, y, around), around_2))
        put(clock, row + k + 3, fused(holds, y_2, around_2))
        before, before_2, y, y_2 = y, y_2, following, following_2
        holds = following_holds
        row += at.CLOCKS


@inlined
def _begin_epoch(cell, clock, now):
    """Expand the whole window; return whether it is calm enough, and no slider is forceless."""
    zero = spread(0.0)
    friction = now.friction
    first = (now.first - 1) // 8
    strips = (now.last + 9) // 8 - first
    now.work += _STRIP_WORK * strips
    wildest = zero
    forceless = 0
    for s in range(first, first + strips):
        i = 8 * s
        row = at.CLOCKS * s
        side = load(cell, at.SIDE, i)
        stiffness = load(cell, at.STIFFNESS, i)
        moves = side * side
        pull, push, idle = margins.forces(cell, friction, i)
        forceless |= idle
        speed = load(cell, at.SPEED, i)
        put(clock, row + at.HOLD, 0.0 - moves * stiffness)
        put(clock, row, fused(1.0 - moves, pull, side * speed))
        put(clock, row + 1, side * push)
        put(clock, row + at.BASE, 0.0)
        wildest = max(wildest, speed + speed, moves * abs(push))
    wild = largest(wildest)
    if forceless != 0 or wild > _CALM * friction:
        return False
    for k in range(0, at.KNOWN, 2):
        _sweep(clock, first, strips, k)
    late = zero
    for s in range(first, first + strips):
        row = at.CLOCKS * s
        late = max(late, abs(take(clock, row + 8)))
        late = max(late, abs(take(clock, row + 9)))
    tail = spread(_TAIL * largest(late))
    for s in range(first, first + strips):
        row = at.CLOCKS * s
        bent = fused(abs(take(clock, row + 6)), _SIXTH, tail)
        bent = fused(abs(take(clock, row + 7)), _SEVENTH, bent)
        _keep(cell, clock, friction, s, 0.0, bent, 255)
    now.tests += strips
    now.left = first
    now.right = first + strips - 1
    now.clock = 0.0
    now.wild = max(wild, friction)
    now.spent = 0.0
    now.centre = 0
    now.local = 1
    return True


@inlined
def _bring(cell, clock, strip, time, mask):
    """Take those of eight columns in the mask to a time; return where and how fast all are then."""
    row = at.CLOCKS * strip
    column = 8 * strip
    margin, moved = _at(clock, cell, strip, time)
    x = load(cell, at.X, column) + moved
    speed = max(load(cell, at.SIDE, column) * margin, 0.0)
    store(cell, at.X, column, choose(mask, x, load(cell, at.X, column)))
    store(cell, at.SPEED, column, choose(mask, speed, load(cell, at.SPEED, column)))
    store(cell, at.FRESH, column, choose(mask, 0.0, load(cell, at.FRESH, column)))
    put(clock, row + at.BASE, choose(mask, time, take(clock, row + at.BASE)))
    return x, speed


@inlined
def _arrive(cell, clock, i, time):
    """Take the sliders around i to the time of its event."""
    first = (i - 15) // 8
    nearby = ((1 << 15) - 1) << (i - 7 - 8 * first)
    for q in range(5):
        x, speed = _bring(cell, clock, first + q, time, nearby >> (8 * q))
        put(clock, at.CLOCKS * (first + q) + at.NOW_X, x)
        put(clock, at.CLOCKS * (first + q) + at.NOW_SPEED, speed)


@inlined
def _put_nearby(clock, row, nearby, vector):
    """Set the lanes `nearby` of five strips, of which the outermost have none."""
    new = inner(vector)
    row += at.CLOCKS
    put_across(clock, row, at.CLOCKS, choose(nearby >> 8, new, across(clock, row, at.CLOCKS, new)))


@inlined
def _renew(cell, clock, now):
    """Expand the sliders around the last event anew; return whether they are calm enough.

    Five strips side by side: fourteen sliders to either side move and are moved, of the next the
    velocities alone are known. Seven to either side keep what is found.
    """
    i = now.centre
    begin = now.clock
    fresh = cell[at.FRESH, i] > 0.0
    if fresh and cell[at.DRIVE, i] <= 0.0:
        return False
    clock[at.CLOCKS * (i // 8) + at.NOW_SPEED, i % 8] = cell[at.SPEED, i]
    first = (i - 15) // 8
    lane = i - 8 * first
    window = ((1 << 29) - 1) << (lane - 14)
    outer = ((1 << 31) - 1) << (lane - 15)
    nearby = ((1 << 15) - 1) << (lane - 7)
    blocks = cell.shape[1] // 8
    row = at.CLOCKS * first
    zero = spread(0.0, 0.0, 0.0, 0.0, 0.0)
    side = across(cell, at.SIDE * blocks + first, 1, zero)
    stiffness = across(cell, at.STIFFNESS * blocks + first, 1, zero)
    x = across(clock, row + at.NOW_X, at.CLOCKS, zero)
    around = from_left(0.0, x) + from_right(x, 0.0)
    pull = across(cell, at.REST * blocks + first, 1, zero) + (around - stiffness * x)
    speed = across(clock, row + at.NOW_SPEED, at.CLOCKS, zero)
    moves = side * side
    moving = (moves > 0.0) & window
    y = fused(1.0 - moves, pull, side * speed)
    after = side * (side * pull - now.friction)
    wild = largest(choose(moving, max(speed + speed, moves * abs(after)), 0.0))
    rest = (at.EPOCH - begin) * (at.EPOCH - begin)
    rest *= rest
    rest *= rest
    rest *= rest
    now.wild = max(now.wild, wild)
    now.spent += rest * _LEFT_OUT
    if wild > _CALM * now.friction or now.spent * now.wild > _BUDGET * now.friction:
        return False
    if fresh:
        after = choose(1 << lane, cell[at.SIDE, i] * cell[at.DRIVE, i], after)
    _put_nearby(clock, row, nearby, y)
    y = choose((moves > 0.0) & outer, y, 0.0)
    after = choose(moving, after, 0.0)
    holds = 0.0 - stiffness
    bent = inner(zero)
    late = zero
    for k in range(1, at.KNOWN):
        around = from_left(0.0, y) + from_right(y, 0.0)
        new = choose(moving, after, around)
        _put_nearby(clock, row + k, nearby, new)
        if k == 6 or k == 7:
            bent = fused(abs(inner(new)), _SIXTH if k == 6 else _SEVENTH, bent)
        elif k == 8 or k == 9:
            late = max(late, abs(after), choose(nearby, abs(new), 0.0))
        y, after = after, choose(moving, fused(holds, y, around), 0.0)
    bent_b, bent_c, bent_d = strips(bent + _TAIL * largest(late))
    _keep(cell, clock, now.friction, first + 1, begin, bent_b, nearby >> 8)
    _keep(cell, clock, now.friction, first + 2, begin, bent_c, nearby >> 16)
    _keep(cell, clock, now.friction, first + 3, begin, bent_d, nearby >> 24)
    now.tests += 2
    now.left = min(now.left, first + 1)
    now.right = max(now.right, first + 3)
    now.centre = 0
    return True


@inlined
def _soonest(cell, clock, now):
    """Return the column with the first key."""
    blocks = _blocks(cell)
    first = blocks + now.left // 8
    last = blocks + now.right // 8
    keys = take(clock, first)
    for b in range(first + 1, last + 1):
        keys = min(keys, take(clock, b))
    key = least(keys)
    if key >= at.NEVER:
        return -1
    while True:
        found = take(clock, first) <= key
        if found != 0:
            break
        first += 1
    strip = 8 * (first - blocks) + lowest_bit(found)
    return 8 * strip + lowest_bit(take(clock, at.CLOCKS * strip + at.KEY) <= key)


@inlined
def _alone(cell, clock, now, time):
    """Return whether only one key is at most `time`."""
    blocks = _blocks(cell)
    strip = -1
    for b in range(blocks + now.left // 8, blocks + now.right // 8 + 1):
        found = take(clock, b) <= time
        if found != 0:
            if strip >= 0 or found & (found - 1) != 0:
                return False
            strip = 8 * (b - blocks) + lowest_bit(found)
    found = take(clock, at.CLOCKS * strip + at.KEY) <= time
    return found & (found - 1) == 0


@compiled
def _look(cell, clock, now, i):
    """Carry the key of one slider on; return whether that was plain."""
    row = at.CLOCKS * (i // 8)
    lane = i % 8
    base = element(clock, row + at.BASE, lane)
    side = cell[at.SIDE, i]
    limit = margins.end_of_range(cell, now, i)
    a = element(clock, row + at.KEY, lane) - base
    end = at.EPOCH - base
    fresh = cell[at.FRESH, i] != 0.0
    target = element(clock, row + at.GUESS, lane) - base
    located = False
    if a < target < 1.0:
        target = margins.refined(cell, clock, now, i, row, lane, at.KNOWN, target)
        if a < target <= end:
            target = (base + target) - base
            located = True
    at_a = element(clock, row, lane)
    slope_a = element(clock, row + 1, lane)
    b = target if located else end
    for _ in range(_PIECES):
        if b - a < _GAP:
            return False
        at_b, slope_b = margins.at_time(clock, row, lane, at.KNOWN, b)
        now.roots += 1
        bend = bend_odd = 0.0
        for k in range(at.KNOWN - 2, 3, -2):
            after = b * b * element(margins.STEP_FACTORS, 0, k - 3)
            bend = fused(bend, after, abs(element(clock, row + k, lane)))
            after = b * b * element(margins.STEP_FACTORS, 0, k - 2)
            bend_odd = fused(bend_odd, after, abs(element(clock, row + k + 1, lane)))
        bend = fused(b, bend_odd, bend)
        bound = margins.rounding(cell, now, i, at_a, slope_a, at_b, slope_b, b)
        if located:
            outward = margins.outwards(side, slope_b)
            off = at_b - outward * limit
            steep = outward * slope_b
            plain = abs(off) <= bound + 2.0 * at.ULP * steep and steep * _GAP > 8.0 * bound
            room = limit - outward * at_a
            plain = plain and (fresh or room > bound)
            plain = plain and is_clear(
                room, -outward * slope_a, 0.0, -steep, bend, b, bound, fresh, True
            )
            if plain and side == 0.0:
                plain = is_clear(
                    limit + outward * at_a, outward * slope_a, limit + outward * at_b, steep,
                    bend, b, bound, False, False,
                )  # fmt: skip
            if plain:
                clock[row + at.KEY, lane] = base + b
                clock[row + at.ROOT, lane] = base + b
                clock[row + at.GUESS, lane] = off
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
                clock[row + at.KEY, lane] = base + b if b < end else at.NEVER
                _mark(cell, clock, i // 8)
                return True
        located = False
        b = a + 0.5 * (b - a)
    return False


@compiled
def at_once(cell, clock, now):
    """Take all sliders to the present time; the epoch is over."""
    for b in range(now.left, now.right + 1):
        clock[_blocks(cell) + b // 8, b % 8] = at.NEVER
        put(clock, at.CLOCKS * b + at.KEY, spread(at.NEVER))
        _bring(cell, clock, b, now.clock, take(clock, at.CLOCKS * b + at.BASE) < now.clock)
    now.local = 0


@compiled
def advance(cell, count, clock, now):
    """Advance a long cluster to its first event, or to the end of the epoch.

    Returns
    -------
    t, events, residual
        As `taylor.step`; `events` is -1 if it must do it.
    """
    now.steps += 1
    now.work += _EVENT_WORK
    if now.local == 1 and now.spent * now.wild > 0.5 * _BUDGET * now.friction:
        at_once(cell, clock, now)
    if now.local == 0:
        if not _begin_epoch(cell, clock, now):
            return 0.0, -1, 0.0
    elif now.centre != 0 and not _renew(cell, clock, now):
        at_once(cell, clock, now)
        return 0.0, -1, 0.0
    before = now.clock
    while True:
        i = _soonest(cell, clock, now)
        if i < 0:
            now.clock = at.EPOCH
            at_once(cell, clock, now)
            return now.clock - before, 0, 0.0
        row = at.CLOCKS * (i // 8)
        time = element(clock, row + at.ROOT, i % 8)
        if time < at.NEVER:
            if time - before < _GAP:
                break
            if _alone(cell, clock, now, time + _GAP):
                residual = abs(element(clock, row + at.GUESS, i % 8))
                _arrive(cell, clock, i, time)
                now.clock = time
                now.centre = i
                count[at.EVENT, 0] = i
                return time - before, 1, residual
            clock[row + at.KEY, i % 8] = at.NEVER
            _mark(cell, clock, i // 8)
            j = _soonest(cell, clock, now)
            if clock[at.CLOCKS * (j // 8) + at.ROOT, j % 8] < at.NEVER:
                break
            clock[row + at.KEY, i % 8] = time
            _mark(cell, clock, i // 8)
            i = j
        if not _look(cell, clock, now, i):
            break
    at_once(cell, clock, now)
    return 0.0, -1, 0.0
