"""Velocity Verlet on a chain: the compiled steps, stops and starts behind the solver `verlet`.

Only moving sliders and their neighbours are computed, in contiguous clusters; a slider that moves
alone stays in registers. Between two events, with ``y`` the advance per step (half a step out of
phase), ``b = dt**2 a`` and ``F`` the non-frictional force, a step is::

    y += b;  x += y;  F = pull + (x_left + x_right) - 2 x;  b = dt**2 (F - mu_d c S)

and the velocity at the end of the step, ``(y + b/2) / dt``, is compared with zero. This is the
leapfrog form of velocity Verlet: the same points with fewer operations.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exactcreep.compiling import njit
from exactcreep.model.deviates import normal_deviate, philox
from exactcreep.model.keyed_disorder import STREAM_COEFFICIENT
from exactcreep.solvers.tables import EVENT_TABLE

MOST_STEPS = 10**9
"""Most steps of one rearrangement."""

_EPS = 2.0**-52
_SMALLEST = 5e-324  # v < _SMALLEST is v <= 0
_GAP = 20  # movers with at most this gap share a cluster, which is cheaper than two clusters
_BISECTED = 2.0**-53  # of a step
_RUNAWAY_CHECK = 1 << 8  # steps between two tests whether a whole moving chain runs away
_FINITE_CHECK = 1 << 14  # steps between two tests whether the motion is finite
_PAUSE = 1 << 24  # steps, each counted for every moving slider, between two looks at a clock

# Nothing here allocates. Without `_nrt=False` every array argument would be counted atomically,
# which costs more than the events themselves.
_compiled = njit(cache=True, nogil=True, error_model="numpy", _nrt=False)

# What `follow` returns
REST, EVENTS, ROWS, RUNAWAY, STEPS, INFINITE, PAUSED = range(7)
UNTESTED, AT_REST, MOVING = 0, 1, 2


class Constants(NamedTuple):
    """The constants of one simulation."""

    n: int
    l0: float
    origin: float  # l0 theta at the start
    drive: float  # weight and end forces of the whole chain
    cosine: float
    sigma: float
    seed: np.uint64
    random: bool
    runs_away: bool
    dt: float
    locate: bool


_REALS = (
    "shift",  # l0 (theta - theta at the start)
    "theta",
    "origin",  # the time of step 0
)
COUNTS = ("steps", "rearrangements", "events", "slips", "below", "undecided", "target")
_WHOLE = (
    *COUNTS,
    "step",
    "steps_here",  # in this rearrangement
    "phase",
    "movers",
    "low",  # the sliders that have moved in this rearrangement
    "high",
    "number",  # of the event in its rearrangement
    "way",  # of the ramp to this rearrangement, 0 if there was none
    "near",  # sliders in clusters
    "written",  # rows of stored events
    "spent",  # steps since the last look at a clock, see `_PAUSE`
)
NOW = np.dtype([(name, np.float64) for name in _REALS] + [(name, np.int64) for name in _WHOLE])
ROW = (*EVENT_TABLE.fields, "moved", "coefficient", "undecided", "way")
"""Stored columns of each slider of an event: `moved` since the last rest, counts so far."""


class Arrays(NamedTuple):
    """Everything that changes. Sliders are at 1 .. n, with a ghost at either end."""

    lanes: NDArray[np.float64]  # shape (24, n + 2): see below
    drawn: NDArray[np.int64]  # shape (2, n + 2): coefficients drawn; slips in this half-cycle
    driven: NDArray[np.int64]  # the sliders whose force changes with theta
    movers: NDArray[np.int64]  # ascending
    now: NDArray[Any]  # one NOW
    clusters: NDArray[np.int64]  # first and last slider of every cluster
    near: NDArray[np.int64]  # the sliders in clusters: movers and their neighbours, ascending
    hit: NDArray[np.int8]  # 1: the slider stops or starts; 2: it has just stopped
    rows: NDArray[np.float64]  # shape (rows, len(ROW)): no rows if events are not stored


X, Y, B, PULL, MASS, DRAG, SIGN, FLOOR, CEILING, SPRINGS = range(10)
# displacement since the last rest; y and b of the module's docstring; F at x = 0 (set when a
# slider near by starts); dt**2 (0 at rest); dt**2 mu_d c S; S (0 at rest); S v below the
# floor is a stop; |F| above the ceiling is a start; number of springs
OLD_X, OLD_W, OLD_B = 10, 11, 12  # at the beginning of the step in which an event is located
AT_REST_ROWS = BASE, PLACE, COEFFICIENT, THRESHOLD = 13, 14, 15, 16
# T_n + EXPANSION shift of the spring below; displacement at the last rest; mu_s;
# max(mu_s, mu_d) cos(alpha)
LOAD, RATE, EXPANSION, FRICTION, MU_D, MU_S, HELD = range(17, 24)
# weight and end forces; F by shift; what the spring below expands by; mu_d cos(alpha); mu_d; the
# mean of mu_s; that times cos(alpha)


@_compiled
def _pull(arrays, i):
    """Return F_i at the last rest."""
    lanes = arrays.lanes
    elastic = (lanes[BASE, i] - lanes[BASE, i - 1]) + lanes[RATE, i] * arrays.now[0].shift
    return elastic + lanes[LOAD, i]


@_compiled
def _at(lanes, i):
    """Return F_i of a moving slider or its neighbour."""
    inner = (lanes[X, i - 1] + lanes[X, i + 1]) - lanes[SPRINGS, i] * lanes[X, i]
    return lanes[PULL, i] + inner


@_compiled
def _velocity(lanes, i):
    """Return the velocity of slider i at the end of the step, times dt."""
    return lanes[Y, i] + 0.5 * lanes[B, i]


@_compiled
def _rounding(arrays, i):
    """Return a bound for the rounding errors of F_i and of its threshold."""
    lanes = arrays.lanes
    size = abs(lanes[BASE, i]) + abs(lanes[BASE, i - 1])
    size += abs(lanes[RATE, i] * arrays.now[0].shift)
    size += abs(lanes[LOAD, i])
    size += abs(lanes[X, i - 1]) + abs(lanes[X, i + 1]) + 2.0 * abs(lanes[X, i])
    return 4.0 * _EPS * (size + lanes[THRESHOLD, i])


@_compiled
def _full(fixed, arrays):
    """Return whether the rows of another event may not fit."""
    rows = len(arrays.rows)
    return rows > 0 and arrays.now[0].written + 2 * fixed.n + 2 > rows


@_compiled
def _write(arrays, time, kind, i, sign):
    """Store one slider of an event, if events are stored."""
    if len(arrays.rows) == 0:
        return
    now, lanes = arrays.now[0], arrays.lanes
    row = arrays.rows[now.written]
    row[0], row[1], row[2] = now.target, now.rearrangements - 1, now.number
    row[3], row[4], row[5], row[6], row[7] = now.theta, time, kind, i, sign
    row[8], row[9] = lanes[X, i], lanes[COEFFICIENT, i]
    row[10], row[11] = now.undecided, now.way
    now.written += 1


@_compiled
def _start(fixed, arrays, i, sign, time):
    """Set slider i in motion from velocity zero."""
    now, lanes = arrays.now[0], arrays.lanes
    square = fixed.dt * fixed.dt
    # of all that may share its cluster: those between two movers are looked at, too
    for k in range(max(i - _GAP, 1), min(i + _GAP, fixed.n) + 1):
        lanes[PULL, k] = _pull(arrays, k)
    lanes[SIGN, i] = sign
    lanes[MASS, i] = square
    lanes[DRAG, i] = square * lanes[FRICTION, i] * sign
    lanes[FLOOR, i] = _SMALLEST
    lanes[CEILING, i] = np.inf
    lanes[B, i] = square * _at(lanes, i) - lanes[DRAG, i]
    lanes[Y, i] = -0.5 * lanes[B, i]
    k = now.movers
    while k > 0 and arrays.movers[k - 1] > i:
        arrays.movers[k] = arrays.movers[k - 1]
        k -= 1
    arrays.movers[k] = i
    now.movers += 1
    now.low = min(now.low, i)
    now.high = max(now.high, i)
    _write(arrays, time, 0, i, sign)


@_compiled
def _stop(fixed, arrays, i, time):
    """Bring slider i to rest and draw its next static coefficient; `_close_event` must follow."""
    now, lanes, drawn = arrays.now[0], arrays.lanes, arrays.drawn
    k = drawn[0, i]
    drawn[0, i] += 1
    drawn[1, i] += 1
    now.slips += 1
    mu, threshold = lanes[MU_S, i], lanes[HELD, i]
    if fixed.random:
        words = philox(fixed.seed, STREAM_COEFFICIENT, i, k // 4)
        mu += fixed.sigma * normal_deviate(words[k % 4])
        threshold = lanes[FRICTION, i] if mu < lanes[MU_D, i] else mu * fixed.cosine
        now.below += mu < lanes[MU_D, i]
    lanes[COEFFICIENT, i] = mu
    _write(arrays, time, 1, i, lanes[SIGN, i])
    for row in (Y, B, MASS, DRAG, SIGN, FLOOR):
        lanes[row, i] = 0.0
    lanes[THRESHOLD, i] = lanes[CEILING, i] = threshold


@_compiled
def _close_event(arrays):
    """Count an event, and remove resting sliders from the list of movers."""
    now = arrays.now[0]
    now.events += 1
    now.number += 1
    kept = 0
    for k in range(now.movers):
        i = arrays.movers[k]
        arrays.movers[kept] = i
        kept += arrays.lanes[SIGN, i] != 0.0
    now.movers = kept


@_compiled
def _begin(fixed, now, way):
    """Begin a rearrangement."""
    now.rearrangements += 1
    now.number = 0
    now.way = way
    now.origin = 0.0
    now.step = 0
    now.steps_here = 0
    now.phase = MOVING
    now.low = fixed.n + 1
    now.high = 0


@_compiled
def release(fixed, arrays):
    """Start every slider that exceeds its threshold at the present theta."""
    now, lanes = arrays.now[0], arrays.lanes
    now.phase = AT_REST
    for i in range(1, fixed.n + 1):
        force = _pull(arrays, i)
        excess = abs(force) - lanes[THRESHOLD, i]
        now.undecided += abs(excess) <= _rounding(arrays, i)
        if excess > 0.0:
            if now.phase == AT_REST:
                _begin(fixed, now, 0)
            _start(fixed, arrays, i, math.copysign(1.0, force), 0.0)
    if now.phase == MOVING:
        _close_event(arrays)


@_compiled
def _room(arrays, i, way):
    """Return the change of l0 theta in direction `way` until slider i starts, and its error."""
    lanes = arrays.lanes
    rate = way * lanes[RATE, i]
    room = max(lanes[THRESHOLD, i] - math.copysign(1.0, rate) * _pull(arrays, i), 0.0)
    return room / abs(rate), _rounding(arrays, i) / abs(rate)


@_compiled
def ramp(fixed, arrays, way, most):
    """Ramp theta until a slider starts, by less than `most` = l0 |d theta|; return whether.

    The force on a slider changes by its rate, so that theta_c is explicit.
    """
    now, lanes = arrays.now[0], arrays.lanes
    nearest = np.inf
    slack = 0.0
    for i in arrays.driven:
        room, rounding = _room(arrays, i, way)
        if room < nearest:
            nearest, slack = room, rounding
    if nearest == np.inf:
        return False
    now.undecided += abs(nearest - most) <= slack
    if not nearest < most:
        return False
    ready = 0
    for i in arrays.driven:
        room, rounding = _room(arrays, i, way)
        arrays.hit[i] = room - nearest <= slack + rounding
        ready += arrays.hit[i]
    now.undecided += ready > 1
    now.shift += way * nearest
    now.theta = (fixed.origin + now.shift) / fixed.l0
    _begin(fixed, now, int(way))
    for i in arrays.driven:
        if arrays.hit[i] != 0:
            _start(fixed, arrays, i, math.copysign(1.0, way * lanes[RATE, i]), 0.0)
            arrays.hit[i] = 0
    _close_event(arrays)
    # if mu_s acts as mu_d the slip has zero length: it stops at once, and draws anew
    before = now.slips
    for i in arrays.driven:
        if lanes[SIGN, i] != 0.0 and lanes[THRESHOLD, i] <= lanes[FRICTION, i]:
            _stop(fixed, arrays, i, 0.0)
    if now.slips > before:
        _close_event(arrays)
    return True


@_compiled
def _lay_out(fixed, arrays):
    """Make clusters of movers with a neighbour at either side; return their number."""
    now = arrays.now[0]
    clusters = 0
    now.near = 0
    k = 0
    while k < now.movers:
        low = arrays.movers[k]
        high = low
        while k + 1 < now.movers and arrays.movers[k + 1] - high <= _GAP:
            k += 1
            high = arrays.movers[k]
        k += 1
        low, high = max(low - 1, 1), min(high + 1, fixed.n)
        arrays.clusters[2 * clusters] = low
        arrays.clusters[2 * clusters + 1] = high
        clusters += 1
        for i in range(low, high + 1):
            arrays.near[now.near] = i
            now.near += 1
    return clusters


@_compiled
def _alone(fixed, arrays, most):
    """Step a slider that moves alone until it stops or starts a neighbour.

    Returns the number of steps, at most `most`, and whether there is an event.
    """
    lanes = arrays.lanes
    i = arrays.movers[0]
    sign = lanes[SIGN, i]
    rate = lanes[SPRINGS, i] * fixed.dt * fixed.dt
    # how far the slider may advance until the force on a neighbour reaches its threshold
    left = np.inf
    right = np.inf
    if i > 1:
        left = lanes[CEILING, i - 1] - sign * _at(lanes, i - 1)
    if i < fixed.n:
        right = lanes[CEILING, i + 1] - sign * _at(lanes, i + 1)
    gap = min(left, right)
    y = sign * lanes[Y, i]
    b = sign * lanes[B, i]
    x = 0.0
    steps = 0
    while steps < most:
        y += b
        x += y
        b -= rate * y
        steps += 1
        if x > gap or y + 0.5 * b <= 0.0:
            break
    lanes[X, i] += sign * x
    lanes[Y, i] = sign * y
    lanes[B, i] = sign * b
    stops = y + 0.5 * b <= 0.0
    arrays.hit[i - 1] = x > left
    arrays.hit[i] = stops
    arrays.hit[i + 1] = x > right
    return steps, stops or x > gap


@_compiled
def _together(arrays, clusters, most):
    """Step all clusters until a slider stops or starts; return the same as `_alone`.

    One sweep over a cluster does a step: every slider advances just before the force on its left
    neighbour is needed.
    """
    lanes = arrays.lanes
    steps = 0
    hit = False
    while steps < most and not hit:
        steps += 1
        for k in range(clusters):
            low, high = arrays.clusters[2 * k], arrays.clusters[2 * k + 1]
            x, y, b = lanes[X, low:], lanes[Y, low:], lanes[B, low:]
            pull, mass, drag = lanes[PULL, low:], lanes[MASS, low:], lanes[DRAG, low:]
            springs, sign = lanes[SPRINGS, low:], lanes[SIGN, low:]
            floor, ceiling = lanes[FLOOR, low:], lanes[CEILING, low:]
            beyond = lanes[X, low - 1]
            while True:
                left = beyond
                advance = y[0] + b[0]
                here = x[0] + advance
                x[0] = here
                for i in range(high - low + 1):
                    # the last slider ahead is at rest, or the ghost: it does not advance
                    ahead = y[i + 1] + b[i + 1]
                    right = x[i + 1] + ahead
                    x[i + 1] = right
                    force = pull[i] + ((left + right) - springs[i] * here)
                    push = mass[i] * force - drag[i]
                    b[i] = push
                    y[i] = advance
                    late = sign[i] * (advance + 0.5 * push) < floor[i]
                    hit |= late | (abs(force) > ceiling[i])
                    left = here
                    here = right
                    advance = ahead
                if clusters > 1 or hit or steps >= most:
                    break
                steps += 1  # the only cluster continues without a new layout
    if hit:
        for i in arrays.near[: arrays.now[0].near]:
            late = lanes[SIGN, i] * _velocity(lanes, i) < lanes[FLOOR, i]
            arrays.hit[i] = late | (abs(_at(lanes, i)) > lanes[CEILING, i])
    return steps, hit


@_compiled
def _go_back(arrays):
    """Undo the last step, and store its beginning."""
    lanes = arrays.lanes
    near = arrays.near[: arrays.now[0].near]
    for i in near:
        lanes[X, i] -= lanes[Y, i]
        lanes[OLD_X, i] = lanes[X, i]
    for i in near:
        lanes[OLD_B, i] = lanes[MASS, i] * _at(lanes, i) - lanes[DRAG, i]
        lanes[OLD_W, i] = lanes[Y, i] - 0.5 * lanes[OLD_B, i]


@_compiled
def _within(arrays, part):
    """Move to the fraction `part` of the step that was undone; return whether a slider is hit.

    Within the step the motion is a velocity Verlet step of shorter length.
    """
    lanes = arrays.lanes
    near = arrays.near[: arrays.now[0].near]
    half = 0.5 * part
    for i in near:
        lanes[X, i] = lanes[OLD_X, i] + part * (lanes[OLD_W, i] + half * lanes[OLD_B, i])
    any_hit = False
    for i in near:
        force = _at(lanes, i)
        b = lanes[MASS, i] * force - lanes[DRAG, i]
        w = lanes[OLD_W, i] + half * (lanes[OLD_B, i] + b)
        lanes[B, i] = b
        lanes[Y, i] = w - 0.5 * b
        hit = (lanes[SIGN, i] * w < lanes[FLOOR, i]) | (abs(force) > lanes[CEILING, i])
        arrays.hit[i] = hit
        any_hit |= hit
    return any_hit


@_compiled
def _locate(arrays):
    """Go back to the first event inside the last step.

    Returns the fraction of the step, and whether there is an event.
    """
    _go_back(arrays)
    low = 0.0
    high = 1.0
    if not _within(arrays, high):
        return high, False  # only a rounding error hit this step; the next step will be hit
    while high - low > _BISECTED:
        middle = 0.5 * (low + high)
        if _within(arrays, middle):
            high = middle
        else:
            low = middle
    return high, _within(arrays, high)


@_compiled
def _ties(fixed, arrays):
    """Include every start or stop that cannot be distinguished from an event at this instant."""
    now, lanes = arrays.now[0], arrays.lanes
    for i in arrays.near[: now.near]:
        sign = lanes[SIGN, i]
        if arrays.hit[i] != 0:
            continue
        if sign != 0.0:
            size = abs(lanes[OLD_W, i]) + abs(lanes[OLD_B, i])
            if fixed.locate and sign * _velocity(lanes, i) <= 4.0 * _EPS * size:
                now.undecided += 1
                arrays.hit[i] = 1
            continue
        force = _at(lanes, i)
        if lanes[CEILING, i] - abs(force) <= _rounding(arrays, i):
            # together with the event if the force rises; else it is at threshold, and stays
            now.undecided += 1
            arrays.hit[i] = (_velocity(lanes, i - 1) + _velocity(lanes, i + 1)) * force > 0.0


@_compiled
def _resolve(fixed, arrays):
    """Stop, draw and start the sliders of an event, in this order."""
    now, lanes = arrays.now[0], arrays.lanes
    time = now.origin + now.step * fixed.dt
    near = arrays.near[: now.near]
    _ties(fixed, arrays)
    before = now.slips
    for i in near:
        if arrays.hit[i] == 1 and lanes[SIGN, i] != 0.0:
            _stop(fixed, arrays, i, time)
            arrays.hit[i] = 2
    if now.slips > before:
        _close_event(arrays)
    before = now.movers
    for i in near:
        if lanes[SIGN, i] != 0.0:
            continue
        force = _at(lanes, i)
        excess = abs(force) - lanes[CEILING, i]
        if arrays.hit[i] == 2 and abs(excess) <= _rounding(arrays, i):
            now.undecided += 1
        if arrays.hit[i] == 1 or excess > 0.0:
            # a slider that has just stopped may exceed its threshold
            _start(fixed, arrays, i, math.copysign(1.0, force), time)
    if now.movers > before:
        _close_event(arrays)


@_compiled
def _never_stops(fixed, arrays):
    """Return whether the whole chain provably slides for ever (the runaway certificate).

    All sliders move down; with the mean velocity V and the conserved energy J of the internal
    motion, V > sqrt((1 - 1/N) 2 J) leaves every velocity positive for ever.
    """
    n = fixed.n
    if not fixed.runs_away or arrays.now[0].movers < n:
        return False
    lanes = arrays.lanes
    sign = lanes[SIGN, 1]
    mean = 0.0
    for i in range(1, n + 1):
        if lanes[SIGN, i] != sign or sign * fixed.drive < 0.0:
            return False
        mean += _velocity(lanes, i)
    mean /= n * fixed.dt
    twice = 0.0
    for i in range(1, n + 1):
        twice += (_velocity(lanes, i) / fixed.dt - mean) ** 2
    for i in range(1, n):
        tension = lanes[BASE, i] - lanes[EXPANSION, i] * arrays.now[0].shift
        tension += lanes[X, i + 1] - lanes[X, i]
        twice += tension**2
    return sign * mean > math.sqrt((1.0 - 1.0 / n) * twice)


@_compiled
def _unfinished(fixed, arrays, last_event):
    """Return why the moving chain must not be stepped now; REST if it may."""
    now = arrays.now[0]
    total = 0.0
    for i in arrays.movers[: now.movers]:
        total += abs(arrays.lanes[X, i]) + abs(arrays.lanes[Y, i]) + abs(arrays.lanes[B, i])
    if not total < np.inf:
        return INFINITE
    if _never_stops(fixed, arrays):
        return RUNAWAY
    if now.steps_here >= MOST_STEPS:
        return STEPS
    if now.events >= last_event:
        return EVENTS
    if now.spent >= _PAUSE:
        return PAUSED
    return ROWS if _full(fixed, arrays) else REST


@_compiled
def _advance(fixed, arrays, last_event):
    """Move the chain until it rests, or `last_event` events have happened, or it never will rest.

    It returns only where continuing later changes no bit.
    """
    now = arrays.now[0]
    while now.movers > 0:
        reason = _unfinished(fixed, arrays, last_event)
        if reason != REST:
            return reason
        most = _RUNAWAY_CHECK if fixed.runs_away and now.movers == fixed.n else _FINITE_CHECK
        most = min(most, _PAUSE // (4 * now.movers) + 1)
        clusters = _lay_out(fixed, arrays)
        if now.movers == 1:
            steps, hit = _alone(fixed, arrays, most)
        else:
            steps, hit = _together(arrays, clusters, most)
        now.spent += steps * now.movers
        now.steps += steps
        now.steps_here += steps
        now.step += steps
        if hit and fixed.locate:
            part, hit = _locate(arrays)
            now.origin += (now.step - 1 + part) * fixed.dt
            now.step = 0
        if hit:
            _resolve(fixed, arrays)
    lanes = arrays.lanes
    now.phase = AT_REST
    for i in range(now.low, now.high + 1):
        lanes[PLACE, i] += lanes[X, i]
    for i in range(max(now.low - 1, 1), min(now.high + 1, fixed.n)):
        lanes[BASE, i] += lanes[X, i + 1] - lanes[X, i]
    lanes[X, now.low : now.high + 1] = 0.0
    return REST


@_compiled
def follow(fixed, arrays, targets, first, budget, rows):
    """Take the chain to the targets; return why it returned and how many were reached.

    Without a target, the present rearrangement continues.
    """
    n = fixed.n
    now, base, place = arrays.now[0], arrays.lanes[BASE], arrays.lanes[PLACE]
    now.spent = 0
    last_event = now.events + budget
    done = 0
    while done < targets.size or now.phase == MOVING:
        if done < targets.size:
            now.target = first + done
        if _full(fixed, arrays):
            return ROWS, done
        if now.phase == UNTESTED:
            release(fixed, arrays)
        if now.phase == MOVING:
            code = _advance(fixed, arrays, last_event)
            if code != REST or done == targets.size:
                return code, done
        if now.events >= last_event:
            return EVENTS, done
        goal = fixed.l0 * targets[done] - fixed.origin
        climb = goal - now.shift
        if climb != 0.0 and ramp(fixed, arrays, math.copysign(1.0, climb), abs(climb)):
            continue
        now.shift = goal
        now.theta = targets[done]
        total = place[(n + 1) // 2] if n % 2 == 1 else 0.0
        for i in range(1, n // 2 + 1):  # in pairs: exactly 0 for a mirror-symmetric chain
            total += place[i] + place[n + 1 - i]
        rows.x_G[done] = total / n
        for i in range(1, n + 1):
            if len(rows.x) > 0:
                rows.x[done, i - 1] = place[i]
            if len(rows.tension) > 0 and i < n:
                rows.tension[done, i - 1] = base[i] - arrays.lanes[EXPANSION, i] * goal
            if len(rows.slips) > 0:
                rows.slips[done, i - 1] = arrays.drawn[1, i]
                arrays.drawn[1, i] = 0
        done += 1
    return REST, done
