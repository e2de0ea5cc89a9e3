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
from collections import namedtuple

import numpy as np

from exactcreep.compiling import njit
from exactcreep.model.deviates import normal_deviate, philox
from exactcreep.model.keyed_disorder import STREAM_COEFFICIENT

UNTESTED, AT_REST, MOVING = range(3)
"""Phases: a start that may not be at rest, a chain at rest, a rearrangement."""
_ROUNDING = 2.0**-48  # of a force, relative to its parts
_BISECTED = 2.0**-40  # of a step
_PAUSE = 1 << 20  # steps, each counted for every slider in the window, between looks from outside

# Nothing here allocates. Without `_nrt=False` every array argument would be counted atomically.
_compiled = njit(cache=True, nogil=True, error_model="numpy", _nrt=False)


COUNTS = ("rearrangements", "events", "slips", "draws_below_mu_d")
_WHOLE = "n locate one_by_one phase movers low high target way number written"
NOW = np.dtype(
    [(name, np.float64) for name in ("l0", "cosine", "sigma", "dt", "theta", "time")]
    + [(name, np.int64) for name in (*COUNTS, *_WHOLE.split())]
    + [("seed", np.uint64)]
)
"""The chain and its present state. `one_by_one`: return after every rearrangement and every target;
`low`, `high`: the ends of the window; `way`: the direction of the last ramp; `number`: the events
of the rearrangement; `written`: the logged rows."""
AT_REST_NOW = (*COUNTS, "theta")
AT_REST_ROWS = ("tension", "coefficient", "place", "draws", "slips")
"""From these parts of `NOW` and `Sliders` a chain at rest goes on."""
Sliders = namedtuple("Sliders", "tension expansion load pull coefficient threshold slack friction"
    " mu_d mu_s springs draws slips sign ceiling place x w b last_x last_v last_b")  # fmt: skip
"""Arrays of sliders 1 .. n, with a ghost at either end. `tension` and `expansion` are those of the
spring below; `tension`, `place` and `pull` (F) those of the last rest; `x` is the displacement
since then, `sign` is S of a slider that moves, else 0, `springs` counts the springs, a force above
`ceiling` is a start, `last_` means the end of a step, `slips` those since the last target."""
COLUMNS = 11
"""Logged for each slider of an event: those of `EventRow`, the displacement since the last rest,
the present coefficient, and the direction of the ramp."""


@_compiled
def _write(s, now, log, kind, i):
    """Log one slider of an event, if events are logged."""
    if len(log) > 0:
        row = log[now.written]
        row[0], row[1], row[2], row[3] = now.target, now.rearrangements - 1, now.number, now.theta
        row[4], row[5], row[6], row[7] = now.time, kind, i, s.sign[i]
        row[8], row[9], row[10] = s.x[i], s.coefficient[i], now.way
        now.written += 1


@_compiled
def _push(s, i, square):
    """Find the force on slider i and its `b`, with ``square = dt**2``; return the force."""
    force = s.pull[i] + ((s.x[i - 1] + s.x[i + 1]) - s.springs[i] * s.x[i])
    s.b[i] = square * s.sign[i] * (s.sign[i] * force - s.friction[i])
    return force


@_compiled
def _start(s, now, log, i, force):
    """Set slider i in motion from velocity zero."""
    s.sign[i], s.ceiling[i] = math.copysign(1.0, force), np.inf
    _push(s, i, now.dt * now.dt)
    s.w[i] = -0.5 * s.b[i]
    now.movers += 1
    _write(s, now, log, 0, i)


@_compiled
def _stop(s, now, log, i):
    """Bring slider i to rest and draw its next static coefficient."""
    s.coefficient[i] = s.mu_s[i]
    draw = int(s.draws[i])
    words = philox(now.seed, STREAM_COEFFICIENT, i, draw // 4)
    s.coefficient[i] += now.sigma * normal_deviate(words[draw % 4])
    now.draws_below_mu_d += s.coefficient[i] < s.mu_d[i]
    s.threshold[i] = max(s.coefficient[i], s.mu_d[i]) * now.cosine
    s.draws[i] += 1
    s.slips[i] += 1
    now.slips += 1
    now.movers -= 1
    _write(s, now, log, 1, i)
    s.w[i] = s.b[i] = s.sign[i] = 0.0
    s.ceiling[i] = s.threshold[i] + s.slack[i]


@_compiled
def _close(s, now, happened):
    """Count an event, and find the window: the movers and a neighbour on either side."""
    now.events += happened
    now.number += happened
    now.low, now.high = now.n, 1
    for i in range(1, now.n + 1):
        if s.sign[i] != 0.0:
            now.low, now.high = min(now.low, max(i - 1, 1)), max(now.high, min(i + 1, now.n))


@_compiled
def _resolve(s, now, log):
    """Stop, draw and start the sliders of an event, in this order."""
    low, high, before = now.low, now.high, now.slips
    for i in range(low, high + 1):
        if s.sign[i] != 0.0 and s.sign[i] * (s.w[i] + 0.5 * s.b[i]) <= 0.0:
            _stop(s, now, log, i)
    _close(s, now, now.slips > before)
    before = now.movers
    for i in range(low, high + 1):
        force = _push(s, i, now.dt * now.dt)
        if s.sign[i] == 0.0 and abs(force) > s.ceiling[i]:  # it may just have stopped
            _start(s, now, log, i, force)
    _close(s, now, now.movers > before)


@_compiled
def rest(s, now, change):
    """Make the present places of the sliders their last rest, and change l0 theta."""
    for i in range(1, now.n + 1):
        s.place[i] += s.x[i]
        s.tension[i] += (s.x[i + 1] - s.x[i]) * (i < now.n) - s.expansion[i] * change
        s.x[i] = 0.0
        s.pull[i] = (s.tension[i] - s.tension[i - 1]) + s.load[i]
        parts = abs(s.tension[i]) + abs(s.tension[i - 1]) + abs(s.load[i]) + s.threshold[i]
        s.slack[i] = _ROUNDING * parts
        s.ceiling[i] = s.threshold[i] + s.slack[i]


@_compiled
def ramp(s, now, log, way, most):
    """Ramp l0 theta in direction `way` until a slider starts, by less than `most`; return whether.

    The force changes in proportion to theta, so that theta_c is explicit.
    """
    nearest = np.inf
    for i in range(1, now.n + 1):
        rate = way * (s.expansion[i - 1] - s.expansion[i])
        if rate != 0.0:
            room = s.ceiling[i] - math.copysign(1.0, rate) * s.pull[i]
            nearest = min(nearest, max(room, 0.0) / abs(rate))
    if not nearest < most:
        return False
    rest(s, now, way * nearest)
    now.theta += way * nearest / now.l0
    now.way, now.phase, now.rearrangements = int(way), MOVING, now.rearrangements + 1
    for i in range(1, now.n + 1):
        rises = way * (s.expansion[i - 1] - s.expansion[i]) * s.pull[i] > 0.0
        if rises and abs(s.pull[i]) >= s.threshold[i]:
            _start(s, now, log, i, s.pull[i])
    _close(s, now, True)
    return True


@_compiled
def _steps(s, low, high, square, most):
    """Step the window until a slider is hit; return the steps, at most `most`, and whether."""
    x, w, b, pull = s.x[low - 1 :], s.w[low - 1 :], s.b[low - 1 :], s.pull[low - 1 :]
    springs, sign = s.springs[low - 1 :], s.sign[low - 1 :]
    friction, ceiling = s.friction[low - 1 :], s.ceiling[low - 1 :]
    steps, hit, inside = 0, False, high - low + 2
    while steps < most and not hit:
        steps += 1
        for i in range(1, inside):
            w[i] += b[i]
            x[i] += w[i]
        for i in range(1, inside):
            force = pull[i] + ((x[i - 1] + x[i + 1]) - springs[i] * x[i])
            b[i] = square * sign[i] * (sign[i] * force - friction[i])
            velocity = w[i] + 0.5 * b[i]
            hit |= (sign[i] != 0.0) & (sign[i] * velocity <= 0.0) | (abs(force) > ceiling[i])
    return steps, hit


@_compiled
def _back(s, now, way):
    """Go from the end of a step to a part `way` of it (-1 to 0); return whether a slider is hit."""
    for i in range(now.low, now.high + 1):
        s.x[i] = s.last_x[i] + way * (s.last_v[i] + 0.5 * way * s.last_b[i])
    hit = False
    for i in range(now.low, now.high + 1):
        force = _push(s, i, now.dt * now.dt)
        velocity = s.last_v[i] + 0.5 * way * (s.last_b[i] + s.b[i])
        s.w[i] = velocity - 0.5 * s.b[i]
        hit |= (s.sign[i] != 0.0) & (s.sign[i] * velocity <= 0.0) | (abs(force) > s.ceiling[i])
    return hit


@_compiled
def _locate(s, now):
    """Go back to the first event inside the last step; return the way, a part of the step."""
    for i in range(now.low, now.high + 1):
        s.last_x[i], s.last_v[i], s.last_b[i] = s.x[i], s.w[i] + 0.5 * s.b[i], s.b[i]
    before, after = -1.0, 0.0
    while after - before > _BISECTED:
        middle = 0.5 * (before + after)
        before, after = (before, middle) if _back(s, now, middle) else (middle, after)
    after += _BISECTED  # an event at the same instant is included
    _back(s, now, after)
    return after


@_compiled
def release(s, now, log, way):
    """Start every slider that exceeds its threshold; if none does, ramp in direction `way`."""
    now.low, now.high, now.phase, now.rearrangements = 1, now.n, MOVING, now.rearrangements + 1
    _resolve(s, now, log)
    if now.movers == 0:
        now.phase, now.rearrangements = AT_REST, now.rearrangements - 1
        ramp(s, now, log, way, np.inf)


@_compiled
def follow(s, nows, log, targets, first, last_event, x_G):
    """Take the chain to the targets; without targets, until the present rearrangement ends.

    Returns how many were reached. It also returns after `last_event` events, to let its log be
    read, and every so often; calling again changes no bit.
    """
    now, reached, spent = nows[0], 0, 0
    while spent < _PAUSE and (reached < len(targets) or now.phase != AT_REST):
        full = len(log) > 0 and now.written + 2 * now.n > len(log)
        if full or now.events >= last_event:
            break
        now.target = first + reached if len(targets) > 0 else now.target
        if now.phase == UNTESTED:
            release(s, now, log, 0.0)
        elif now.phase == AT_REST:
            left = now.l0 * (targets[reached] - now.theta)
            if left == 0.0 or not ramp(s, now, log, math.copysign(1.0, left), abs(left)):
                rest(s, now, left)
                now.theta, total = targets[reached], 0.0
                for i in range(1, now.n + 1):  # in pairs: 0 in a mirror-symmetric chain
                    total += s.place[i] + s.place[now.n + 1 - i]
                x_G[reached] = 0.5 * total / now.n
                reached += 1
                if now.one_by_one:
                    break
        elif now.movers > 0:
            steps, hit = _steps(s, now.low, now.high, now.dt * now.dt, _PAUSE // now.n + 1)
            spent += steps * (now.high - now.low + 1)
            now.time += steps * now.dt
            if hit and now.locate:
                now.time += _locate(s, now) * now.dt
            if hit:
                _resolve(s, now, log)
        elif now.one_by_one and now.written > 0:
            break
        else:
            rest(s, now, 0.0)
            now.phase, now.time, now.number, now.way = AT_REST, 0.0, 0, 0
    return reached
