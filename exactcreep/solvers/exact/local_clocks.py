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
force) is handed to `cluster.step`, with all sliders at the time of the last event.

What is done to a slider depends on its distance to an event and on nothing else: the mirror image
of a chain moves as its mirror image, bit for bit.

Source: Eqs. (dynamic_eq1)-(static_eqN); derivations/modes.py.
"""

from __future__ import annotations

import math

from exactcreep.solvers.exact.layout import (
    BASE,
    CLOCKS,
    DRIVE,
    EPOCH,
    EVENT,
    EXCESS,
    FRESH,
    GUESS,
    HOLD,
    KEY,
    KNOWN,
    NEVER,
    NOW_SPEED,
    NOW_X,
    REST,
    ROOT,
    SIDE,
    SPEED,
    STIFFNESS,
    ULP,
    X,
    compiled,
    inlined,
)
from exactcreep.solvers.exact.margins import (
    STEP_FACTORS,
    approach,
    first_zero,
    forces,
    is_clear,
    its_range,
    margin,
    refined,
    rounding,
)
from exactcreep.solvers.exact.simd import (
    below,
    choose,
    element,
    everywhere,
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
    put,
    smaller,
    spread,
    store,
    take,
)

_CALM = 16.0
_LEFT_OUT = 2.0 * math.exp(2 * EPOCH) / math.factorial(16)
"""By jump and by acceleration, in units of w r**16."""
_BUDGET = 8.0 * ULP
"""What an epoch may leave out of a margin, in units of friction."""
_GAP = 2.0**-20
"""Events closer than that are looked at together."""
_SIXTH, _SEVENTH = (EPOCH**k / math.factorial(k) for k in (6, 7))
_TAIL = sum(2.0 ** (k - 8) * EPOCH**k / math.factorial(k) for k in range(8, 40))
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
    return CLOCKS * (cell.shape[1] // 8)


@inlined
def _at(clock, cell, strip, time):
    """Return margins and displacements since their base times of eight columns."""
    zero = spread(0.0)
    row = CLOCKS * strip
    tau = larger(smaller(spread(time) - take(clock, row + BASE), spread(EPOCH)), zero)
    u = tau * tau
    even = odd = even_sum = odd_sum = zero
    after = u * everywhere(STEP_FACTORS, 0, KNOWN + 1)
    for k in range(KNOWN - 2, -1, -2):
        term = take(clock, row + k + 1)
        step = u * everywhere(STEP_FACTORS, 0, k + 2)
        odd = fused(odd, step, term)
        odd_sum = fused(odd_sum, after, term)
        term = take(clock, row + k)
        after = u * everywhere(STEP_FACTORS, 0, k + 1)
        even = fused(even, after, term)
        even_sum = fused(even_sum, step, term)
    side = load(cell, SIDE, 8 * strip)
    moved = (side * side) * (tau * fused(tau * spread(0.5), odd_sum, even_sum))
    return fused(tau, odd, even), moved


@inlined
def _inside(cell, clock, friction, strip, bent, tau):
    """Return which of eight margins are certified to stay in range for `tau` after their base."""
    column = 8 * strip
    row = CLOCKS * strip
    zero = spread(0.0)
    side = load(cell, SIDE, column)
    resting = not_above(magnitude(side), zero)
    fresh = below(zero, load(cell, FRESH, column))
    share = tau * spread(1.0 / EPOCH)
    share = share * share * share
    square = tau * tau
    a0 = take(clock, row)
    a1 = tau * take(clock, row + 1)
    a2 = square * take(clock, row + 2) * spread(1.0 / 2.0)
    a3 = square * tau * take(clock, row + 3) * spread(1.0 / 6.0)
    bend = magnitude(take(clock, row + 4)) * spread(1.0 / 24.0)
    bend = fused(magnitude(take(clock, row + 5)) * spread(1.0 / 120.0), tau, bend)
    bend = fused(square * square, bend, bent * share * share)
    b1 = fused(a1, spread(1.0 / 3.0), a0)
    b2 = fused(a1 + a1 + a2, spread(1.0 / 3.0), a0)
    b3 = (a0 + a1) + (a2 + a3)
    low = smaller(smaller(b1, b2), b3 - bend)
    high = larger(larger(b1, b2), b3 + bend)
    low = smaller(low, choose(fresh, low, a0))
    high = larger(high, choose(fresh, high, a0))
    threshold = load(cell, EXCESS, column) + spread(friction)
    scale = (magnitude(a0) + magnitude(a1)) + (magnitude(a2) + magnitude(a3)) + bend
    scale = scale + choose(resting, threshold + spread(friction), tau * spread(friction))
    bound = spread(16.0 * ULP) * scale
    floor, ceiling = its_range(cell, friction, column)
    return below(bound, low + floor) & below(bound, ceiling - high)


@inlined
def _keep(cell, clock, friction, strip, begin, bent, lanes):
    """Give eight columns the keys of their new series; `simd` masks those that have one."""
    never = spread(NEVER)
    column = 8 * strip
    row = CLOCKS * strip
    moving = magnitude(load(cell, SIDE, column)) + magnitude(load(cell, SIDE, column - 1))
    moving = moving + magnitude(load(cell, SIDE, column + 1))
    watched = below(spread(0.0), moving) & lanes
    left = spread(EPOCH - begin)
    key = choose(lanes, never, take(clock, row + KEY))
    ends = watched & ~_inside(cell, clock, friction, strip, bent, left)
    if ends != 0:
        guess = first_zero(*approach(cell, clock, row, friction, column))
        tau = smaller(guess * spread(_EARLY), left)
        inside = _inside(cell, clock, friction, strip, bent, tau)
        key = choose(ends, choose(inside, spread(begin) + tau, spread(begin)), key)
        put(clock, row + GUESS, choose(ends, spread(begin) + guess, take(clock, row + GUESS)))
    put(clock, row + KEY, key)
    put(clock, row + ROOT, choose(lanes, never, take(clock, row + ROOT)))
    clock[_blocks(cell) + strip // 8, strip % 8] = least(key)


@inlined
def _mark(cell, clock, strip):
    """Bring up to date the first key of eight columns."""
    keys = take(clock, CLOCKS * strip + KEY)
    clock[_blocks(cell) + strip // 8, strip % 8] = least(keys)


@inlined
def _sweep(clock, first, strips, k):
    """Complete the derivatives k + 1 .. k + 4 of all strips, and begin k + 5.

    The first two of a strip need its neighbours' k and k + 1; the others follow one strip behind,
    while what they need is still at hand.
    """
    zero = spread(0.0)
    before = before_2 = zero
    last = last_2 = zero  # derivatives k + 2 and k + 3 of the strip two behind
    this = this_2 = zero  # and of the strip behind
    holds_behind = zero
    row = CLOCKS * first
    holds = take(clock, row + HOLD)
    moving = below(holds, zero)
    moving_behind = moving
    y = choose(moving, take(clock, row + k), zero)
    y_2 = choose(moving, take(clock, row + k + 1), zero)
    for s in range(strips + 1):
        following = following_2 = following_holds = next_ = next_2 = zero
        following_moving = moving
        if s < strips:
            if s + 1 < strips:
                following_holds = take(clock, row + CLOCKS + HOLD)
                following_moving = below(following_holds, zero)
                following = choose(following_moving, take(clock, row + CLOCKS + k), zero)
                following_2 = choose(following_moving, take(clock, row + CLOCKS + k + 1), zero)
            around = from_left(before, y) + from_right(y, following)
            around_2 = from_left(before_2, y_2) + from_right(y_2, following_2)
            next_ = choose(moving, fused(holds, y, around), zero)
            next_2 = choose(moving, fused(holds, y_2, around_2), zero)
            put(clock, row + k + 1, choose(moving, y_2, around))
            put(clock, row + k + 2, choose(moving, next_, around_2))
        if s > 0:
            around = from_left(last, this) + from_right(this, next_)
            around_2 = from_left(last_2, this_2) + from_right(this_2, next_2)
            after = fused(holds_behind, this, around)
            after_2 = fused(holds_behind, this_2, around_2)
            behind = row - CLOCKS
            put(clock, behind + k + 3, choose(moving_behind, this_2, around))
            put(clock, behind + k + 4, choose(moving_behind, after, around_2))
            put(clock, behind + k + 5, after_2)
        last = this
        last_2 = this_2
        this = next_
        this_2 = next_2
        holds_behind = holds
        moving_behind = moving
        before = y
        before_2 = y_2
        y = following
        y_2 = following_2
        holds = following_holds
        moving = following_moving
        row += CLOCKS


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
        row = CLOCKS * s
        side = load(cell, SIDE, i)
        stiffness = load(cell, STIFFNESS, i)
        moves = side * side
        pull, push, idle = forces(cell, friction, i)
        forceless |= idle
        speed = load(cell, SPEED, i)
        put(clock, row + HOLD, zero - moves * stiffness)
        put(clock, row, fused(spread(1.0) - moves, pull, side * speed))
        put(clock, row + 1, side * push)
        put(clock, row + BASE, zero)
        wildest = larger(wildest, larger(speed + speed, moves * magnitude(push)))
    wild = largest(wildest)
    if forceless != 0 or wild > _CALM * friction:
        return False
    for k in range(0, KNOWN, 4):
        _sweep(clock, first, strips, k)
    late = zero
    for s in range(first, first + strips):
        row = CLOCKS * s
        late = larger(late, magnitude(take(clock, row + 8)))
        late = larger(late, magnitude(take(clock, row + 9)))
    tail = spread(_TAIL * largest(late))
    for s in range(first, first + strips):
        row = CLOCKS * s
        bent = fused(magnitude(take(clock, row + 6)), spread(_SIXTH), tail)
        bent = fused(magnitude(take(clock, row + 7)), spread(_SEVENTH), bent)
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
def _arrive(cell, clock, i, time):
    """Take the sliders around i to the time of its event."""
    zero = spread(0.0)
    a = (i - 15) // 8
    nearby = ((1 << 15) - 1) << (i - 7 - 8 * a)
    for q in range(5):
        strip = a + q
        row = CLOCKS * strip
        column = 8 * strip
        margin, moved = _at(clock, cell, strip, time)
        x = load(cell, X, column) + moved
        speed = larger(load(cell, SIDE, column) * margin, zero)
        put(clock, row + NOW_X, x)
        put(clock, row + NOW_SPEED, speed)
        if 0 < q < 4:
            lanes = nearby >> (8 * q)
            store(cell, X, column, choose(lanes, x, load(cell, X, column)))
            store(cell, SPEED, column, choose(lanes, speed, load(cell, SPEED, column)))
            store(cell, FRESH, column, choose(lanes, zero, load(cell, FRESH, column)))
            put(clock, row + BASE, choose(lanes, spread(time), take(clock, row + BASE)))


@inlined
def _expanded(cell, clock, friction, strip, left, x, right, window):
    """Return what moves, holds, the value, the first derivative and the size of eight columns."""
    zero = spread(0.0)
    column = 8 * strip
    side = load(cell, SIDE, column)
    stiffness = load(cell, STIFFNESS, column)
    moves = side * side
    around = from_left(left, x) + from_right(x, right)
    pull = load(cell, REST, column) + (around - stiffness * x)
    speed = take(clock, CLOCKS * strip + NOW_SPEED)
    value = fused(spread(1.0) - moves, pull, side * speed)
    slope = side * (side * pull - spread(friction))
    size = larger(speed + speed, moves * magnitude(slope))
    moving = below(zero, moves) & window
    return moving, zero - stiffness, value, slope, choose(moving, size, zero)


@inlined
def _kept(clock, strip, k, lanes, row):
    """Set derivative k of the lanes of a strip."""
    place = CLOCKS * strip + k
    put(clock, place, choose(lanes, row, take(clock, place)))


@inlined
def _next_order(moves, holds, y, after, around):
    """Return two derivatives of eight velocities in a row, from the two one order before."""
    return after, choose(moves, fused(holds, y, around), spread(0.0))


@inlined
def _velocities(cell, strip, lanes, y):
    """Return the velocities of the movers among these lanes of eight columns, else zero."""
    side = load(cell, SIDE, 8 * strip)
    return choose(lanes & below(spread(0.0), side * side), y, spread(0.0))


@inlined
def _renew(cell, clock, now):
    """Expand the sliders around the last event anew; return whether they are calm enough."""
    zero = spread(0.0)
    friction = now.friction
    i = now.centre
    begin = now.clock
    fresh = cell[FRESH, i] > 0.0
    if fresh and cell[DRIVE, i] <= 0.0:
        return False
    clock[CLOCKS * (i // 8) + NOW_SPEED, i % 8] = cell[SPEED, i]
    a = (i - 15) // 8
    b = a + 1
    c = a + 2
    d = a + 3
    e = a + 4
    x_a = take(clock, CLOCKS * a + NOW_X)
    x_b = take(clock, CLOCKS * b + NOW_X)
    x_c = take(clock, CLOCKS * c + NOW_X)
    x_d = take(clock, CLOCKS * d + NOW_X)
    x_e = take(clock, CLOCKS * e + NOW_X)
    # fourteen sliders to either side, and the velocities alone of the next: what pulls them is
    # not known
    shift = i - 15 - 8 * a
    window = ((1 << 29) - 1) << (shift + 1)
    outer = ((1 << 31) - 1) << shift
    nearby = ((1 << 15) - 1) << (shift + 8)
    in_b = nearby >> 8
    in_c = nearby >> 16
    in_d = nearby >> 24
    moves_a, holds_a, y_a, after_a, size_a = _expanded(
        cell, clock, friction, a, zero, x_a, x_b, window
    )
    moves_b, holds_b, y_b, after_b, size_b = _expanded(
        cell, clock, friction, b, x_a, x_b, x_c, window >> 8
    )
    moves_c, holds_c, y_c, after_c, size_c = _expanded(
        cell, clock, friction, c, x_b, x_c, x_d, window >> 16
    )
    moves_d, holds_d, y_d, after_d, size_d = _expanded(
        cell, clock, friction, d, x_c, x_d, x_e, window >> 24
    )
    moves_e, holds_e, y_e, after_e, size_e = _expanded(
        cell, clock, friction, e, x_d, x_e, zero, window >> 32
    )
    wild = largest(larger(larger(larger(size_a, size_b), larger(size_c, size_d)), size_e))
    rest = (EPOCH - begin) * (EPOCH - begin)
    rest *= rest
    rest *= rest
    rest *= rest
    now.wild = max(now.wild, wild)
    now.spent += rest * _LEFT_OUT
    if wild > _CALM * friction or now.spent * now.wild > _BUDGET * friction:
        return False
    if fresh:
        begun = spread(cell[SIDE, i] * cell[DRIVE, i])
        lane = (1 << 15) << shift
        after_b = choose(lane >> 8, begun, after_b)
        after_c = choose(lane >> 16, begun, after_c)
    _kept(clock, b, 0, in_b, y_b)
    _kept(clock, c, 0, in_c, y_c)
    _kept(clock, d, 0, in_d, y_d)
    y_a = _velocities(cell, a, outer, y_a)
    y_b = choose(moves_b, y_b, zero)
    y_c = choose(moves_c, y_c, zero)
    y_d = _velocities(cell, d, outer >> 24, y_d)
    y_e = _velocities(cell, e, outer >> 32, y_e)
    after_a = choose(moves_a, after_a, zero)
    after_b = choose(moves_b, after_b, zero)
    after_c = choose(moves_c, after_c, zero)
    after_d = choose(moves_d, after_d, zero)
    after_e = choose(moves_e, after_e, zero)
    bent_b = bent_c = bent_d = late = zero
    for k in range(1, KNOWN):
        around_a = from_left(zero, y_a) + from_right(y_a, y_b)
        around_b = from_left(y_a, y_b) + from_right(y_b, y_c)
        around_c = from_left(y_b, y_c) + from_right(y_c, y_d)
        around_d = from_left(y_c, y_d) + from_right(y_d, y_e)
        around_e = from_left(y_d, y_e) + from_right(y_e, zero)
        row_b = choose(moves_b, after_b, around_b)
        row_c = choose(moves_c, after_c, around_c)
        row_d = choose(moves_d, after_d, around_d)
        _kept(clock, b, k, in_b, row_b)
        _kept(clock, c, k, in_c, row_c)
        _kept(clock, d, k, in_d, row_d)
        if k == 6 or k == 7:
            weight = spread(_SIXTH if k == 6 else _SEVENTH)
            bent_b = fused(magnitude(row_b), weight, bent_b)
            bent_c = fused(magnitude(row_c), weight, bent_c)
            bent_d = fused(magnitude(row_d), weight, bent_d)
        elif k == 8 or k == 9:
            late = larger(late, larger(magnitude(after_a), magnitude(after_e)))
            late = larger(late, larger(magnitude(after_b), magnitude(after_d)))
            late = larger(late, magnitude(after_c))
            late = larger(late, choose(in_b, magnitude(row_b), zero))
            late = larger(late, choose(in_c, magnitude(row_c), zero))
            late = larger(late, choose(in_d, magnitude(row_d), zero))
        y_a, after_a = _next_order(moves_a, holds_a, y_a, after_a, around_a)
        y_b, after_b = _next_order(moves_b, holds_b, y_b, after_b, around_b)
        y_c, after_c = _next_order(moves_c, holds_c, y_c, after_c, around_c)
        y_d, after_d = _next_order(moves_d, holds_d, y_d, after_d, around_d)
        y_e, after_e = _next_order(moves_e, holds_e, y_e, after_e, around_e)
    tail = spread(_TAIL * largest(late))
    _keep(cell, clock, friction, b, begin, bent_b + tail, in_b)
    _keep(cell, clock, friction, c, begin, bent_c + tail, in_c)
    _keep(cell, clock, friction, d, begin, bent_d + tail, in_d)
    now.tests += 2
    now.left = min(now.left, b)
    now.right = max(now.right, d)
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
        keys = smaller(keys, take(clock, b))
    key = least(keys)
    if key >= NEVER:
        return -1
    while True:
        found = not_above(take(clock, first), spread(key))
        if found != 0:
            break
        first += 1
    strip = 8 * (first - blocks) + lowest_bit(found)
    return 8 * strip + lowest_bit(not_above(take(clock, CLOCKS * strip + KEY), spread(key)))


@inlined
def _alone(cell, clock, now, time):
    """Return whether only one key is at most `time`."""
    blocks = _blocks(cell)
    strip = -1
    for b in range(blocks + now.left // 8, blocks + now.right // 8 + 1):
        found = not_above(take(clock, b), spread(time))
        if found != 0:
            if strip >= 0 or found & (found - 1) != 0:
                return False
            strip = 8 * (b - blocks) + lowest_bit(found)
    found = not_above(take(clock, CLOCKS * strip + KEY), spread(time))
    return found & (found - 1) == 0


@compiled
def _look(cell, clock, now, i):
    """Carry the key of one slider on; return whether that was plain."""
    row = CLOCKS * (i // 8)
    lane = i % 8
    base = element(clock, row + BASE, lane)
    side = cell[SIDE, i]
    limit = 0.0 if side != 0.0 else now.friction + cell[EXCESS, i]
    a = element(clock, row + KEY, lane) - base
    end = EPOCH - base
    fresh = cell[FRESH, i] != 0.0
    target = element(clock, row + GUESS, lane) - base
    located = False
    if a < target < 1.0:
        target = refined(cell, clock, now, i, row, lane, KNOWN, target)
        if a < target <= end:
            target = (base + target) - base
            located = True
    at_a = element(clock, row, lane)
    slope_a = element(clock, row + 1, lane)
    b = target if located else end
    for _ in range(_PIECES):
        if b - a < _GAP:
            return False
        at_b, slope_b = margin(clock, row, lane, KNOWN, b)
        now.roots += 1
        bend = bend_odd = 0.0
        for k in range(KNOWN - 2, 3, -2):
            after = b * b * element(STEP_FACTORS, 0, k - 3)
            bend = fused_scalar(bend, after, abs(element(clock, row + k, lane)))
            after = b * b * element(STEP_FACTORS, 0, k - 2)
            bend_odd = fused_scalar(bend_odd, after, abs(element(clock, row + k + 1, lane)))
        bend = fused_scalar(b, bend_odd, bend)
        bound = rounding(cell, now, i, at_a, slope_a, at_b, slope_b, b)
        if located:
            outward = -side
            if side == 0.0:
                outward = 1.0 if slope_b >= 0.0 else -1.0
            off = at_b - outward * limit
            steep = outward * slope_b
            plain = abs(off) <= bound + 2.0 * ULP * steep and steep * _GAP > 8.0 * bound
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
                clock[row + KEY, lane] = base + b
                clock[row + ROOT, lane] = base + b
                clock[row + GUESS, lane] = off
                _mark(cell, clock, i // 8)
                return True
        else:
            plain = True
            if side >= 0.0:
                plain = is_clear(
                    limit + at_a, slope_a, limit + at_b, slope_b, bend, b, bound, fresh, False
                )
            if side <= 0.0 and plain:
                plain = is_clear(
                    limit - at_a, -slope_a, limit - at_b, -slope_b, bend, b, bound, fresh,
                    False,
                )  # fmt: skip
            if plain:
                clock[row + KEY, lane] = base + b if b < end else NEVER
                _mark(cell, clock, i // 8)
                return True
        located = False
        b = a + 0.5 * (b - a)
    return False


@compiled
def at_once(cell, clock, now):
    """Take all sliders to the present time; the epoch is over."""
    time = now.clock
    zero = spread(0.0)
    never = spread(NEVER)
    for b in range(now.left, now.right + 1):
        i = 8 * b
        row = CLOCKS * b
        clock[_blocks(cell) + b // 8, b % 8] = NEVER
        put(clock, row + KEY, never)
        margin_, moved = _at(clock, cell, b, time)
        side = load(cell, SIDE, i)
        kept = not_above(spread(time), take(clock, row + BASE))
        store(cell, X, i, load(cell, X, i) + moved)
        speed = choose(kept, load(cell, SPEED, i), larger(side * margin_, zero))
        store(cell, SPEED, i, speed)
        store(cell, FRESH, i, choose(kept, load(cell, FRESH, i), zero))
        put(clock, row + BASE, spread(time))
    now.local = 0


@compiled
def present(cell, clock, scalars, out):
    """Write displacements and speeds at the present time to the copy `out` of `cell`."""
    now = scalars[0]
    for b in range(cell.shape[1] // 8):
        i = 8 * b
        margin_, moved = _at(clock, cell, b, now.clock)
        kept = not_above(spread(now.clock), take(clock, CLOCKS * b + BASE))
        speed = larger(load(cell, SIDE, i) * margin_, spread(0.0))
        store(out, X, i, load(cell, X, i) + moved)
        store(out, SPEED, i, choose(kept, load(cell, SPEED, i), speed))


@compiled
def advance(cell, count, clock, now):
    """Advance a long cluster to its first event, or to the end of the epoch.

    Returns
    -------
    t, events, residual
        As `cluster.step`; `events` is -1 if it must do it.
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
            now.clock = EPOCH
            at_once(cell, clock, now)
            return now.clock - before, 0, 0.0
        row = CLOCKS * (i // 8)
        time = element(clock, row + ROOT, i % 8)
        if time < NEVER:
            if time - before < _GAP:
                break
            if _alone(cell, clock, now, time + _GAP):
                residual = abs(element(clock, row + GUESS, i % 8))
                _arrive(cell, clock, i, time)
                now.clock = time
                now.centre = i
                count[EVENT, 0] = i
                return time - before, 1, residual
            clock[row + KEY, i % 8] = NEVER
            _mark(cell, clock, i // 8)
            j = _soonest(cell, clock, now)
            if clock[CLOCKS * (j // 8) + ROOT, j % 8] < NEVER:
                break
            clock[row + KEY, i % 8] = time
            _mark(cell, clock, i // 8)
            i = j
        if not _look(cell, clock, now, i):
            break
    at_once(cell, clock, now)
    return 0.0, -1, 0.0
