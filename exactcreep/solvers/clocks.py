"""Many movers far apart: each part of a long cluster keeps the series of its own last change.

An event changes one slider. That alters the margin (see `cluster`) of another, d sliders away, by
at most ``J t**(2 d) / (2 d)!`` after a time t, where J is the jump of its acceleration: every two
orders a change reaches one slider further. So a long window is expanded as a whole only once in
an *epoch* of `EPOCH` tau_dyn. At an event the sliders up to seven away are expanded anew from
their state at that time, and all others keep their series.

What is left out, in an epoch, of an event eight sliders away: ``J EPOCH**16 / 16!`` = 7.3e-19 J
(at nine 6e-22 J). A new series follows the sliders up to fourteen away and takes the velocities
at fifteen as constant: accelerations A there contribute as much as jumps. With
``w = max(2 |v|, |v'|)`` over all movers ``|w'| <= 2 w``, for K has the norm 4: expansions with w
up to `_CALM` times the friction F stay below ``e _CALM F`` = 44 F for the epoch, and so do J and
A. With at most `_MOST_EVENTS` in an epoch that is 2.1e-15 F in all, and the rounding bound of a
margin at rest is 16 ulp of 2 F at least, 7e-15 F. A velocity gains one more order, ``t / 17`` of
that.

Each slider has a *key*: the time until which its margin is certified to stay in its range, or
that of its located event. Keys come from the Taylor polynomial of degree five in Bernstein form,
eight sliders at a time; the slider with the first key is looked at alone. A located event is
taken if no other key is near. Whatever is not plain (ties, grazes, sliders that start without
force) is handed to `cluster.step`, with all sliders at the time of the last event.

What is done to a slider depends on its distance to an event and on nothing else: the mirror image
of a chain moves as its mirror image, bit for bit.

Source: Eqs. (dynamic_eq1)-(static_eqN); derivations/modes.py.
"""

from __future__ import annotations

import math

from exactcreep.solvers.cluster import (
    STEP_FACTORS,
    is_clear,
    margin,
    refined,
    rounding,
    rows_of_eight,
)
from exactcreep.solvers.lanes import (
    below,
    choose,
    everywhere,
    from_left,
    from_right,
    fused,
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
)
from exactcreep.solvers.layout import (
    BASE,
    BLOCK,
    CENTRE,
    CLOCK,
    DRIVE,
    EPOCH,
    EPOCH_EVENTS,
    EVENT,
    EXCESS,
    FIRST,
    FRESH,
    FRICTION,
    GUESS,
    HOLD,
    KEY,
    KNOWN,
    LAST,
    LEFT,
    LOCAL,
    MOVE,
    NEVER,
    NOW_SPEED,
    NOW_X,
    REST,
    RIGHT,
    ROOT,
    ROOTS,
    SIDE,
    SPEED,
    STEPS,
    STIFFNESS,
    TESTS,
    ULP,
    WORK,
    X,
    compiled,
    inlined,
)

_CALM = 16.0
_MOST_EVENTS = 64
_GAP = 2.0**-20
"""Events closer than that are looked at together."""
_WEIGHTS = rows_of_eight([EPOCH**k / math.factorial(k) for k in range(KNOWN)])
_PIECES = 8
_EVENT_WORK = 120
_STRIP_WORK = 20
_EARLY = 0.9
"""A key lies so far on the way to where the event is guessed."""


@inlined
def _at(clock, cell, column, time):
    """Return margins and displacements since their base times of eight columns."""
    zero = spread(0.0)
    tau = larger(smaller(spread(time) - load(clock, BASE, column), spread(EPOCH)), zero)
    u = tau * tau
    even = odd = even_sum = odd_sum = zero
    after = u * everywhere(STEP_FACTORS, 0, KNOWN + 1)
    for k in range(KNOWN - 2, -1, -2):
        term = load(clock, k + 1, column)
        step = u * everywhere(STEP_FACTORS, 0, k + 2)
        odd = fused(odd, step, term)
        odd_sum = fused(odd_sum, after, term)
        term = load(clock, k, column)
        after = u * everywhere(STEP_FACTORS, 0, k + 1)
        even = fused(even, after, term)
        even_sum = fused(even_sum, step, term)
    side = load(cell, SIDE, column)
    moved = (side * side) * (tau * fused(tau * spread(0.5), odd_sum, even_sum))
    return fused(tau, odd, even), moved


@inlined
def _guessed(cell, clock, friction, column):
    """Return for eight columns how soon their margins seem to end."""
    zero = spread(0.0)
    half = spread(0.5)
    side = load(cell, SIDE, column)
    resting = not_above(magnitude(side), zero)
    c1 = load(clock, 1, column)
    c2 = load(clock, 2, column)
    heading = choose(below(c1 + c2 * half, zero), spread(-1.0), spread(1.0))
    way = choose(resting, heading, zero - side)
    edge = choose(resting, load(cell, EXCESS, column) + spread(friction), zero)
    p0 = larger(edge - way * load(clock, 0, column), zero)
    p1 = zero - way * c1
    p2 = zero - way * (c2 * half)
    fresh = below(zero, load(cell, FRESH, column))
    p0 = choose(fresh, p1, p0)
    p1 = choose(fresh, p2, p1)
    p2 = choose(fresh, zero - way * (load(clock, 3, column) * spread(1.0 / 6.0)), p2)
    square = p1 * p1 - spread(4.0) * p2 * p0
    low = square_root(larger(square, zero)) - p1
    guess = (p0 + p0) / larger(low, spread(1e-300))
    missed = below(square, zero) | not_above(low, zero)
    return choose(missed, spread(2.0), guess)


@inlined
def _inside(cell, clock, friction, column, bent, tau):
    """Return which of eight margins are certified to stay in range for `tau` after their base."""
    zero = spread(0.0)
    side = load(cell, SIDE, column)
    resting = not_above(magnitude(side), zero)
    fresh = below(zero, load(cell, FRESH, column))
    share = tau * spread(1.0 / EPOCH)
    share = share * share * share
    bend = bent * share * share
    a0 = load(clock, 0, column)
    a1 = tau * load(clock, 1, column)
    power = tau * tau
    a2 = power * load(clock, 2, column) * spread(1.0 / 2.0)
    power = power * tau
    a3 = power * load(clock, 3, column) * spread(1.0 / 6.0)
    power = power * tau
    a4 = power * load(clock, 4, column) * spread(1.0 / 24.0)
    power = power * tau
    a5 = power * load(clock, 5, column) * spread(1.0 / 120.0)
    b1 = fused(a1, spread(0.2), a0)
    b2 = fused(a2, spread(0.1), fused(a1, spread(0.4), a0))
    b3 = fused(a3 + spread(3.0) * a2, spread(0.1), fused(a1, spread(0.6), a0))
    b4 = fused(a4, spread(0.2), fused(a3, spread(0.4), fused(a2, spread(0.6), a0)))
    b4 = fused(a1, spread(0.8), b4)
    b5 = a0 + a1 + a2 + a3 + a4 + a5
    low = smaller(smaller(smaller(b1, b2), smaller(b3, b4)), b5 - bend)
    high = larger(larger(larger(b1, b2), larger(b3, b4)), b5 + bend)
    low = smaller(low, choose(fresh, low, a0))
    high = larger(high, choose(fresh, high, a0))
    threshold = load(cell, EXCESS, column) + spread(friction)
    scale = magnitude(a0) + magnitude(a1) + magnitude(a2) + magnitude(a3)
    scale = scale + magnitude(a4) + magnitude(a5) + bend
    scale = scale + choose(resting, threshold + spread(friction), tau * spread(friction))
    bound = spread(16.0 * ULP) * scale
    never = spread(NEVER)
    floor = choose(resting, threshold, choose(below(side, zero), never, zero))
    ceiling = choose(resting, threshold, choose(below(zero, side), never, zero))
    return below(bound, low + floor) & below(bound, ceiling - high)


@inlined
def _keep(cell, clock, friction, column, now, bent, lanes):
    """Give eight columns the keys of their new series; `lanes` masks those that have one."""
    never = spread(NEVER)
    moving = magnitude(load(cell, SIDE, column)) + magnitude(load(cell, SIDE, column - 1))
    moving = moving + magnitude(load(cell, SIDE, column + 1))
    watched = below(spread(0.0), moving)
    left = spread(EPOCH - now)
    key = never
    ends = watched & ~_inside(cell, clock, friction, column, bent, left)
    if ends != 0:
        guess = _guessed(cell, clock, friction, column)
        tau = smaller(guess * spread(_EARLY), left)
        inside = _inside(cell, clock, friction, column, bent, tau)
        key = choose(ends, choose(inside, spread(now) + tau, spread(now)), never)
        guess = spread(now) + guess
        store(clock, GUESS, column, choose(lanes, guess, load(clock, GUESS, column)))
    store(clock, KEY, column, choose(lanes, key, load(clock, KEY, column)))
    store(clock, ROOT, column, choose(lanes, never, load(clock, ROOT, column)))


@inlined
def _mark(clock, block):
    """Bring up to date the first key of eight columns."""
    clock[BLOCK, block] = least(load(clock, KEY, 8 * block))


@inlined
def _begin_epoch(cell, clock, real, whole):
    """Expand the whole window; return whether it is calm enough, and no slider is forceless."""
    zero = spread(0.0)
    friction = real[FRICTION]
    first = (whole[FIRST] - 1) // 8 * 8  # whole cache lines
    strips = (whole[LAST] - first + 9) // 8
    whole[WORK] += _STRIP_WORK * strips
    wildest = zero
    forceless = 0
    for s in range(strips):
        i = first + 8 * s
        side = load(cell, SIDE, i)
        stiffness = load(cell, STIFFNESS, i)
        moves = side * side
        around = load(cell, X, i - 1) + load(cell, X, i + 1)
        pull = load(cell, REST, i) + (around - stiffness * load(cell, X, i))
        push = side * pull - spread(friction)
        fresh = below(zero, load(cell, FRESH, i))
        push = choose(fresh, load(cell, DRIVE, i), push)
        forceless |= fresh & not_above(push, zero)
        speed = load(cell, SPEED, i)
        store(clock, MOVE, i, moves)
        store(clock, HOLD, i, zero - stiffness)
        store(clock, 0, i, fused(spread(1.0) - moves, pull, side * speed))
        store(clock, 1, i, side * push)
        store(clock, BASE, i, zero)
        wildest = larger(wildest, larger(speed + speed, moves * magnitude(push)))
    if forceless != 0 or largest(wildest) > _CALM * friction:
        return False
    for k in range(0, KNOWN, 2):
        before = before_2 = zero
        y = load(clock, MOVE, first) * load(clock, k, first)
        y_2 = load(clock, k + 1, first)
        for s in range(strips):
            i = first + 8 * s
            following = following_2 = zero
            if s + 1 < strips:
                following = load(clock, MOVE, i + 8) * load(clock, k, i + 8)
                following_2 = load(clock, k + 1, i + 8)
            around = from_left(before, y) + from_right(y, following)
            around_2 = from_left(before_2, y_2) + from_right(y_2, following_2)
            moving = below(zero, load(clock, MOVE, i))
            holds = load(clock, HOLD, i)
            store(clock, k + 1, i, choose(moving, y_2, around))
            after = fused(holds, y, around)
            store(clock, k + 2, i, choose(moving, after, around_2))
            store(clock, k + 3, i, choose(moving, fused(holds, y_2, around_2), zero))
            before = y
            before_2 = y_2
            y = following
            y_2 = following_2
    for s in range(strips):
        i = first + 8 * s
        bent = zero
        for k in range(6, KNOWN):
            bent = fused(magnitude(load(clock, k, i)), everywhere(_WEIGHTS, 0, k), bent)
        _keep(cell, clock, friction, i, 0.0, bent, 255)
    whole[TESTS] += strips
    for b in range(first // 8, first // 8 + strips):
        _mark(clock, b)
    whole[LEFT] = first // 8
    whole[RIGHT] = first // 8 + strips - 1
    real[CLOCK] = 0.0
    whole[EPOCH_EVENTS] = 0
    whole[CENTRE] = 0
    whole[LOCAL] = 1
    return True


@inlined
def _arrive(cell, clock, i, time):
    """Take the sliders around i to the time of its event."""
    zero = spread(0.0)
    for q in range(4):
        column = i - 15 + 8 * q
        margin, moved = _at(clock, cell, column, time)
        x = load(cell, X, column) + moved
        speed = larger(load(cell, SIDE, column) * margin, zero)
        store(clock, NOW_X, column, x)
        store(clock, NOW_SPEED, column, speed)
    for q in range(2):
        column = i - 7 + 8 * q
        lanes = 255 if q == 0 else 127
        store(cell, X, column, choose(lanes, load(clock, NOW_X, column), load(cell, X, column)))
        speed = choose(lanes, load(clock, NOW_SPEED, column), load(cell, SPEED, column))
        store(cell, SPEED, column, speed)
        store(cell, FRESH, column, choose(lanes, zero, load(cell, FRESH, column)))
        store(clock, BASE, column, choose(lanes, spread(time), load(clock, BASE, column)))


@inlined
def _expanded(cell, clock, friction, column):
    """Return moves, rests, holds, value, first derivative of eight columns, and their size."""
    side = load(cell, SIDE, column)
    stiffness = load(cell, STIFFNESS, column)
    moves = side * side
    rests = spread(1.0) - moves
    x = load(clock, NOW_X, column)
    around = load(clock, NOW_X, column - 1) + load(clock, NOW_X, column + 1)
    pull = load(cell, REST, column) + (around - stiffness * x)
    speed = load(clock, NOW_SPEED, column)
    value = fused(rests, pull, side * speed)
    slope = side * (side * pull - spread(friction))
    size = larger(speed + speed, moves * magnitude(slope))
    return below(spread(0.0), moves), spread(0.0) - stiffness, value, slope, size


@inlined
def _renew(cell, clock, real, whole):
    """Expand the sliders around the last event anew; return whether they are calm enough."""
    zero = spread(0.0)
    friction = real[FRICTION]
    i = whole[CENTRE]
    now = real[CLOCK]
    fresh = cell[FRESH, i] > 0.0
    if fresh and cell[DRIVE, i] <= 0.0:
        return False
    clock[NOW_SPEED, i] = cell[SPEED, i]
    a = i - 15
    b = i - 7
    c = i + 1
    d = i + 9
    moves_a, holds_a, y_a, after_a, size_a = _expanded(cell, clock, friction, a)
    moves_b, holds_b, y_b, after_b, size_b = _expanded(cell, clock, friction, b)
    moves_c, holds_c, y_c, after_c, size_c = _expanded(cell, clock, friction, c)
    moves_d, holds_d, y_d, after_d, size_d = _expanded(cell, clock, friction, d)
    # the outermost give their velocities alone: what pulls them is not known
    size_a = choose(254, size_a, zero)
    size_d = choose(63, size_d, zero)
    if largest(larger(larger(size_a, size_b), larger(size_c, size_d))) > _CALM * friction:
        return False
    if fresh:
        after_b = choose(127, after_b, spread(cell[SIDE, i] * cell[DRIVE, i]))
    old = load(clock, 0, c)
    store(clock, 0, b, y_b)
    store(clock, 0, c, choose(127, y_c, old))
    y_a = choose(moves_a, y_a, zero)
    y_b = choose(moves_b, y_b, zero)
    y_c = choose(moves_c, y_c, zero)
    y_d = choose(moves_d, y_d, zero)
    moves_a &= 254
    after_a = choose(254, after_a, zero)
    moves_d &= 63
    after_d = choose(63, after_d, zero)
    bent_b = bent_c = zero
    for k in range(1, KNOWN):
        around_a = from_left(zero, y_a) + from_right(y_a, y_b)
        around_b = from_left(y_a, y_b) + from_right(y_b, y_c)
        around_c = from_left(y_b, y_c) + from_right(y_c, y_d)
        around_d = from_left(y_c, y_d) + from_right(y_d, zero)
        row_b = choose(moves_b, after_b, around_b)
        row_c = choose(moves_c, after_c, around_c)
        store(clock, k, b, row_b)
        store(clock, k, c, choose(127, row_c, load(clock, k, c)))
        if k > 5:
            weight = everywhere(_WEIGHTS, 0, k)
            bent_b = fused(magnitude(row_b), weight, bent_b)
            bent_c = fused(magnitude(row_c), weight, bent_c)
        new = choose(moves_a, fused(holds_a, y_a, around_a), zero)
        y_a = after_a
        after_a = new
        new = choose(moves_b, fused(holds_b, y_b, around_b), zero)
        y_b = after_b
        after_b = new
        new = choose(moves_c, fused(holds_c, y_c, around_c), zero)
        y_c = after_c
        after_c = new
        new = choose(moves_d, fused(holds_d, y_d, around_d), zero)
        y_d = after_d
        after_d = new
    _keep(cell, clock, friction, b, now, bent_b, 255)
    _keep(cell, clock, friction, c, now, bent_c, 127)
    whole[TESTS] += 2
    for block in range(b // 8, (c + 7) // 8 + 1):
        _mark(clock, block)
    whole[LEFT] = min(whole[LEFT], b // 8)
    whole[RIGHT] = max(whole[RIGHT], (c + 7) // 8)
    whole[CENTRE] = 0
    return True


@inlined
def _soonest(clock, whole):
    """Return the column with the first key."""
    first = (whole[FIRST] - 1) // 64
    last = (whole[LAST] + 1) // 64
    keys = load(clock, BLOCK, 8 * first)
    for b in range(first + 1, last + 1):
        keys = smaller(keys, load(clock, BLOCK, 8 * b))
    key = least(keys)
    if key >= NEVER:
        return -1
    while True:
        found = not_above(load(clock, BLOCK, 8 * first), spread(key))
        if found != 0:
            break
        first += 1
    block = 8 * first + lowest_bit(found)
    return 8 * block + lowest_bit(not_above(load(clock, KEY, 8 * block), spread(key)))


@inlined
def _alone(clock, whole, time):
    """Return whether only one key is at most `time`."""
    block = -1
    for b in range((whole[FIRST] - 1) // 64, (whole[LAST] + 1) // 64 + 1):
        found = not_above(load(clock, BLOCK, 8 * b), spread(time))
        if found != 0:
            if block >= 0 or found & (found - 1) != 0:
                return False
            block = 8 * b + lowest_bit(found)
    found = not_above(load(clock, KEY, 8 * block), spread(time))
    return found & (found - 1) == 0


@compiled
def _look(cell, clock, series, real, whole, i):
    """Carry the key of one slider on; return whether that was plain."""
    base = clock[BASE, i]
    for k in range(KNOWN):
        series[k, 0] = clock[k, i]
    side = cell[SIDE, i]
    limit = 0.0 if side != 0.0 else real[FRICTION] + cell[EXCESS, i]
    a = clock[KEY, i] - base
    end = EPOCH - base
    fresh = cell[FRESH, i] != 0.0
    target = clock[GUESS, i] - base
    located = False
    if a < target < 1.0:
        target = refined(cell, series, real, whole, i, 0, 0, KNOWN, target)
        if a < target <= end:
            target = (base + target) - base
            located = True
    at_a = series[0, 0]
    slope_a = series[1, 0]
    b = target if located else end
    for _ in range(_PIECES):
        if b - a < _GAP:
            return False
        at_b, slope_b = margin(series, 0, 0, KNOWN, b)
        whole[ROOTS] += 1
        bend = 0.0
        for k in range(KNOWN - 1, 3, -1):
            bend = abs(series[k, 0]) + bend * (b / (k - 3))
        bound = rounding(cell, real, i, at_a, slope_a, at_b, slope_b, b)
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
                clock[KEY, i] = base + b
                clock[ROOT, i] = base + b
                clock[GUESS, i] = off
                _mark(clock, i // 8)
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
                clock[KEY, i] = base + b if b < end else NEVER
                _mark(clock, i // 8)
                return True
        located = False
        b = a + 0.5 * (b - a)
    return False


@compiled
def at_once(cell, clock, real, whole):
    """Take all sliders to the present time; the epoch is over."""
    now = real[CLOCK]
    zero = spread(0.0)
    never = spread(NEVER)
    for b in range(whole[LEFT], whole[RIGHT] + 1):
        i = 8 * b
        clock[BLOCK, b] = NEVER
        store(clock, KEY, i, never)
        margin_, moved = _at(clock, cell, i, now)
        side = load(cell, SIDE, i)
        kept = not_above(spread(now), load(clock, BASE, i))
        store(cell, X, i, load(cell, X, i) + moved)
        speed = choose(kept, load(cell, SPEED, i), larger(side * margin_, zero))
        store(cell, SPEED, i, speed)
        store(cell, FRESH, i, choose(kept, load(cell, FRESH, i), zero))
        store(clock, BASE, i, spread(now))
    whole[LOCAL] = 0


@compiled
def present(cell, clock, real, out):
    """Write displacements and speeds at the present time to the copy `out` of `cell`."""
    for b in range(cell.shape[1] // 8):
        i = 8 * b
        margin_, moved = _at(clock, cell, i, real[CLOCK])
        kept = not_above(spread(real[CLOCK]), load(clock, BASE, i))
        now = larger(load(cell, SIDE, i) * margin_, spread(0.0))
        store(out, X, i, load(cell, X, i) + moved)
        store(out, SPEED, i, choose(kept, load(cell, SPEED, i), now))


@compiled
def advance(cell, count, clock, series, real, whole):
    """Advance a long cluster to its first event, or to the end of the epoch.

    Returns
    -------
    t, events, residual
        As `cluster.step`; `events` is -1 if it must do it.
    """
    whole[STEPS] += 1
    whole[WORK] += _EVENT_WORK
    if whole[LOCAL] == 0:
        if not _begin_epoch(cell, clock, real, whole):
            return 0.0, -1, 0.0
    elif whole[CENTRE] != 0 and not _renew(cell, clock, real, whole):
        at_once(cell, clock, real, whole)
        return 0.0, -1, 0.0
    now = real[CLOCK]
    while True:
        i = _soonest(clock, whole)
        if i < 0 or whole[EPOCH_EVENTS] >= _MOST_EVENTS:
            if i < 0:
                real[CLOCK] = EPOCH
            at_once(cell, clock, real, whole)
            return real[CLOCK] - now, 0, 0.0
        time = clock[ROOT, i]
        if time < NEVER:
            if time - now < _GAP:
                break
            if _alone(clock, whole, time + _GAP):
                residual = abs(clock[GUESS, i])
                _arrive(cell, clock, i, time)
                real[CLOCK] = time
                whole[CENTRE] = i
                whole[EPOCH_EVENTS] += 1
                count[EVENT, 0] = i
                return time - now, 1, residual
            clock[KEY, i] = NEVER
            _mark(clock, i // 8)
            j = _soonest(clock, whole)
            if clock[ROOT, j] < NEVER:
                break
            clock[KEY, i] = time
            _mark(clock, i // 8)
            i = j
        if not _look(cell, clock, series, real, whole, i):
            break
    at_once(cell, clock, real, whole)
    return 0.0, -1, 0.0
