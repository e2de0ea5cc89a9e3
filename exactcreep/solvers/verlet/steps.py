"""Velocity Verlet on a chain: the compiled loop behind the solver `verlet`.

It follows the section Numerical method of the paper. A ramp takes the chain at rest to the dilation
theta_c at which the next slider starts (`_ramp`). Then time steps move the sliders (`_steps`) in
one window, from the neighbour above the first mover to the neighbour below the last. With ``w`` the
advance per step (half a step late), ``b = dt**2 a`` and ``F`` the force without friction, a step
is::

    w += b;  x += w;  F = pull + (x_above + x_below) - 2 x;  b = dt**2 (F - mu_d cos(alpha) S)

and the velocity at its end is ``(w + b / 2) / dt``. After a step in which a slider stops or starts,
`_resolve` stops sliders, draws their coefficients, and starts sliders, in this order.

A slider at rest starts when the force exceeds its threshold by more than rounding can (`slack`).
The sliders that a ramp takes to their thresholds start together.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from exactcreep.compiling import njit
from exactcreep.model.deviates import normal_deviate, philox
from exactcreep.model.keyed_disorder import STREAM_COEFFICIENT
from exactcreep.solvers.tables import EVENT_TABLE

UNTESTED, AT_REST, MOVING = range(3)
"""Phases: a start that may not be at rest, a chain at rest, a rearrangement."""
_ROUNDING = 2.0**-48  # of a force, relative to its parts
_BISECTED = 2.0**-40  # of a step
_PAUSE = 1 << 24  # steps, each counted for every slider in the window, between looks at a clock
_WATCHED = 1 << 8  # steps between looks at a chain that may run away, while all its sliders move

# Nothing here allocates. Without `_nrt=False` every array argument would be counted atomically.
_compiled = njit(cache=True, nogil=True, error_model="numpy", _nrt=False)


class Constants(NamedTuple):
    """The constants of one simulation."""

    n: int
    l0: float
    cosine: float
    sigma: float
    seed: np.uint64
    runs_away: bool
    dt: float
    locate: bool
    one_by_one: bool  # return after every rearrangement and every target


COUNTS = ("rearrangements", "events", "slips", "draws_below_mu_d")
NOW = np.dtype(
    [(name, np.float64) for name in ("theta", "time")]
    + [(name, np.int64) for name in (*COUNTS, "steps", "phase", "movers", "low", "high")]
    + [(name, np.int64) for name in ("target", "way", "begun", "number", "written")]
)
"""The present state of the chain: `low` and `high` are the ends of the window, `way` is the
direction of the last ramp, `begun` counts the steps before this rearrangement, `number` its
events, and `written` the logged rows."""
SLIDER = np.dtype(
    # of the spring below; then forces; x, w and b as above; at the end of a step
    [(name, np.float64) for name in ("tension", "expansion", "pull", "load", "slack")]
    + [(name, np.float64) for name in ("coefficient", "threshold", "friction", "mu_d", "mu_s")]
    + [(name, np.float64) for name in ("springs", "sign", "place", "x", "w", "b")]
    + [(name, np.float64) for name in ("ceiling", "last_x", "last_v", "last_b")]
    + [(name, np.int64) for name in ("draws", "slips")]
)
"""A slider. `tension` (of the spring below), `place` and `pull` (F) are those of the last rest, `x`
is the displacement since then, `sign` is S of a slider that moves, else 0, `springs` counts
the springs, a force above `ceiling` is a start, and `last_` means the
end of a step. Sliders are at 1 .. n of
an array with a ghost at either end."""
ROW = (*EVENT_TABLE.fields, "moved", "coefficient", "way")
"""Logged columns of each slider of an event; `moved` since the last rest, `way` of the ramp."""


@_compiled
def _write(s, now, log, kind, i):
    """Log one slider of an event, if events are logged."""
    if len(log) > 0:
        row = log[now.written]
        row[0], row[1], row[2], row[3] = now.target, now.rearrangements, now.number, now.theta
        row[4], row[5], row[6], row[7] = now.time, kind, i, s[i].sign
        row[8], row[9], row[10] = s[i].x, s[i].coefficient, now.way
        now.written += 1


@_compiled
def _push(c, s, i):
    """Find the force on slider i and its `b`; return the force."""
    one = s[i]
    force = one.pull + ((s[i - 1].x + s[i + 1].x) - one.springs * one.x)
    one.b = c.dt * c.dt * one.sign * (one.sign * force - one.friction)
    return force


@_compiled
def _hit(one, force, velocity):
    """Return whether a slider stops or starts; branches would double the time at N = 30."""
    return (abs(force) > one.ceiling) | ((one.sign != 0.0) & (one.sign * velocity <= 0.0))


@_compiled
def _start(c, s, now, log, i, force):
    """Set slider i in motion from velocity zero."""
    s[i].sign, s[i].ceiling = math.copysign(1.0, force), np.inf
    _push(c, s, i)
    s[i].w = -0.5 * s[i].b
    now.movers += 1
    _write(s, now, log, 0, i)


@_compiled
def _stop(c, s, now, log, i):
    """Bring slider i to rest and draw its next static coefficient."""
    one = s[i]
    one.coefficient = one.mu_s
    if c.sigma > 0.0:
        words = philox(c.seed, STREAM_COEFFICIENT, i, one.draws // 4)
        one.coefficient += c.sigma * normal_deviate(words[one.draws % 4])
    now.draws_below_mu_d += one.coefficient < one.mu_d
    one.threshold = max(one.coefficient, one.mu_d) * c.cosine
    one.draws += 1
    one.slips += 1
    now.slips += 1
    now.movers -= 1
    _write(s, now, log, 1, i)
    one.w = one.b = one.sign = 0.0
    one.ceiling = one.threshold + one.slack


@_compiled
def _close(c, s, now):
    """Count an event, and find the window: the movers and a neighbour on either side."""
    now.events += 1
    now.number += 1
    now.low, now.high = c.n, 1
    for i in range(1, c.n + 1):
        if s[i].sign != 0.0:
            now.low, now.high = min(now.low, max(i - 1, 1)), max(now.high, min(i + 1, c.n))


@_compiled
def _resolve(c, s, now, log):
    """Stop, draw and start the sliders of an event, in this order."""
    low, high, before = now.low, now.high, now.slips
    for i in range(low, high + 1):
        if s[i].sign != 0.0 and _hit(s[i], 0.0, s[i].w + 0.5 * s[i].b):
            _stop(c, s, now, log, i)
    if now.slips > before:
        _close(c, s, now)
    before = now.movers
    for i in range(low, high + 1):
        force = _push(c, s, i)
        if s[i].sign == 0.0 and _hit(s[i], force, 0.0):  # it may just have stopped
            _start(c, s, now, log, i, force)
    if now.movers > before:
        _close(c, s, now)


@_compiled
def rest(c, s, change):
    """Make the present places of the sliders their last rest, and change l0 theta."""
    for i in range(1, c.n + 1):
        one = s[i]
        one.place += one.x
        one.tension += (s[i + 1].x - one.x) * (i < c.n) - one.expansion * change
        one.x = 0.0
        one.pull = (one.tension - s[i - 1].tension) + one.load
        parts = abs(one.tension) + abs(s[i - 1].tension) + abs(one.load) + one.threshold
        one.slack = _ROUNDING * parts
        one.ceiling = one.threshold + one.slack


@_compiled
def ramp(c, s, now, log, way, most):
    """Ramp l0 theta in direction `way` until a slider starts, by less than `most`; return whether.

    The force changes in proportion to theta, so that theta_c is explicit.
    """
    nearest = np.inf
    for i in range(1, c.n + 1):
        rate = way * (s[i - 1].expansion - s[i].expansion)
        if rate != 0.0:
            room = s[i].ceiling - math.copysign(1.0, rate) * s[i].pull
            nearest = min(nearest, max(room, 0.0) / abs(rate))
    if not nearest < most:
        return False
    rest(c, s, way * nearest)
    now.theta += way * nearest / c.l0
    now.way, now.phase = int(way), MOVING
    for i in range(1, c.n + 1):
        rises = way * (s[i - 1].expansion - s[i].expansion) * s[i].pull > 0.0
        if rises and abs(s[i].pull) >= s[i].threshold:
            _start(c, s, now, log, i, s[i].pull)
    _close(c, s, now)
    return True


@_compiled
def _steps(c, s, low, high, most):
    """Step the window until a slider is hit; return the steps, at most `most`, and whether."""
    window = s[low - 1 : high + 2]
    steps, hit = 0, False
    while steps < most and not hit:
        steps += 1
        window[1].w += window[1].b
        window[1].x += window[1].w
        for i in range(1, high - low + 2):
            one, below = window[i], window[i + 1]
            below.w += below.b  # before it pulls; zero below the window
            below.x += below.w
            force = _push(c, window, i)
            hit |= _hit(one, force, one.w + 0.5 * one.b)
    return steps, hit


@_compiled
def _back(c, s, now, way):
    """Go from the end of a step to a part `way` of it, at most 0; return whether a slider is hit."""
    for i in range(now.low, now.high + 1):
        s[i].x = s[i].last_x + way * (s[i].last_v + 0.5 * way * s[i].last_b)
    hit = False
    for i in range(now.low, now.high + 1):
        force = _push(c, s, i)
        velocity = s[i].last_v + 0.5 * way * (s[i].last_b + s[i].b)
        s[i].w = velocity - 0.5 * s[i].b
        hit |= _hit(s[i], force, velocity)
    return hit


@_compiled
def _locate(c, s, now):
    """Go back to the first event inside the last step; return the way, a part of the step."""
    for i in range(now.low, now.high + 1):
        one = s[i]
        one.last_x, one.last_v, one.last_b = one.x, one.w + 0.5 * one.b, one.b
    before, after = -1.0, 0.0
    while after - before > _BISECTED:
        middle = 0.5 * (before + after)
        if _back(c, s, now, middle):
            after = middle
        else:
            before = middle
    after += _BISECTED  # an event at the same instant is included
    _back(c, s, now, after)
    return after


@_compiled
def _centre(c, s):
    """Return x_G; added in pairs, so that it is 0 in a mirror-symmetric chain."""
    total = 0.0
    for i in range(1, c.n + 1):
        total += s[i].place + s[c.n + 1 - i].place
    return 0.5 * total / c.n


@_compiled
def release(c, s, now, log):
    """Start every slider that exceeds its threshold at the present theta."""
    now.low, now.high = 1, c.n
    _resolve(c, s, now, log)
    now.phase = MOVING if now.movers > 0 else AT_REST


@_compiled
def follow(c, s, nows, log, targets, first, last_event, x_G):
    """Take the chain to the targets; without targets, until the present rearrangement ends.

    Returns how many were reached. It also returns after `last_event` events, to let its log be
    read, and every so often; calling again changes no bit.
    """
    now, reached, spent = nows[0], 0, 0
    while reached < len(targets) or now.phase != AT_REST:
        full = len(log) > 0 and now.written + 2 * c.n > len(log)
        if full or now.events >= last_event:
            break
        now.target = first + reached
        if now.phase == UNTESTED:
            release(c, s, now, log)
        elif now.phase == AT_REST:
            left = c.l0 * (targets[reached] - now.theta)
            if left == 0.0 or not ramp(c, s, now, log, math.copysign(1.0, left), abs(left)):
                rest(c, s, left)
                now.theta, x_G[reached] = targets[reached], _centre(c, s)
                reached += 1
                if c.one_by_one:
                    break
        elif now.movers > 0:
            watched = c.runs_away and now.movers == c.n
            if spent >= (_WATCHED if watched else _PAUSE):
                break
            width = now.high - now.low + 1
            most = _WATCHED if watched else _PAUSE // (4 * width) + 1
            steps, hit = _steps(c, s, now.low, now.high, most)
            spent += steps * width
            now.steps += steps
            now.time += steps * c.dt
            if hit and c.locate:
                now.time += _locate(c, s, now) * c.dt
            if hit:
                _resolve(c, s, now, log)
        elif c.one_by_one and now.written > 0:
            break
        else:
            rest(c, s, 0.0)
            now.phase, now.time, now.number, now.way = AT_REST, 0.0, 0, 0
            now.rearrangements += 1
            now.begun = now.steps
    return reached
