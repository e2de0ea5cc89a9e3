"""The solver called "verlet": the paper's own method, a fixed time step, kept independent.

Velocity Verlet on the moving sliders; at the end of every step the velocities are tested for
stops and the resting neighbours for starts. It shares the model of the chain with the exact
solver, and nothing else. An event is seen at the end of the step in which it happens, an error of
first order in `dt`; with ``locate=True`` it is found inside the step by bisection, which restores
the second order.

Only moving sliders and their neighbours are touched, in contiguous windows; a slider that moves
alone is carried in registers. Between two events, with ``y`` the advance per step (half a step
out of phase), ``b = dt**2 a`` and ``F`` the non-frictional force, a step is::

    y += b;  x += y;  F = pull + (x_left + x_right) - 2 x;  b = dt**2 (F - mu_d c S)

with the velocity at the end of the step, ``(y + b/2) / dt``, tested against zero. This is the
leapfrog form of velocity Verlet: the same points with fewer operations.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from exactcreep.model.chain import Chain
from exactcreep.model.contact import Event, EventKind
from exactcreep.model.disorder import STREAM_COEFFICIENT, normal_deviate, philox
from exactcreep.model.drive import Drive
from exactcreep.model.numbers import InputError, exact_number, nearest_float
from exactcreep.model.state import State
from exactcreep.model.verdict import Evidence, Outcome
from exactcreep.motion.deadline import NEVER, Deadline
from exactcreep.motion.endless import NEVER_STOPS
from exactcreep.motion.solution import Motion, Solution
from exactcreep.solvers.solver import (
    MOST_EVENTS,
    Rearrangement,
    Simulation,
    Solver,
    Stretch,
    Tally,
    refuse_no_slips,
    refuse_records,
)

MOST_STEPS = 10**9
"""Steps of one rearrangement after which it is given up."""

_EPS = 2.0**-52
_SMALLEST = 5e-324  # v < _SMALLEST is v <= 0
_GAP = 20  # movers at most so far apart share a window: cheaper than a window of their own
_BISECTED = 2.0**-53  # of a step
_LOOK = 1 << 8  # steps between two looks at a whole chain in motion that may run away
_SURVEY = 1 << 14  # steps between two looks at whether the motion is finite
_PAUSE = 1 << 24  # steps, each counted once for every moving slider, between two looks at a clock

# Nothing here allocates. Without `_nrt=False` every array that is handed over would be counted,
# atomically, which costs more than the events themselves.
_compiled = njit(cache=True, nogil=True, error_model="numpy", _nrt=False)

# What `_advance` and `_follow` return
_REST, _EVENTS, _ROWS, _RUNAWAY, _STEPS, _INFINITE, _PAUSED = range(7)
_REASONS = {
    _STEPS: f"a rearrangement did not end within {MOST_STEPS:.0e} steps; dt may be too large",
    _RUNAWAY: NEVER_STOPS,
    _INFINITE: "the motion grew beyond the largest float; dt is too large (above 1 it is unstable)",
}
_OUTCOMES = {_RUNAWAY: Outcome.RUNAWAY, _STEPS: Outcome.LIMIT, _INFINITE: Outcome.LIMIT}
_UNTESTED, _AT_REST, _MOVING = 0, 1, 2
_START, _STOP = np.int8(0), np.int8(1)


class _Laws(NamedTuple):
    """The constants of one simulation."""

    n: int
    l0: float
    origin: float  # l0 theta at the start
    weight: float  # sin(alpha)
    friction: float  # mu_d cos(alpha)
    cosine: float
    mu_d: float
    mu_s: float
    sigma: float
    seed: np.uint64
    random: bool
    runs_away: bool
    dt: float
    locate: bool


_SLIDER = np.dtype(
    [
        ("base", np.float64),  # T_n + shift of the spring below; the first and the last: shift
        ("displacement", np.float64),  # at the last rest
        ("coefficient", np.float64),
        ("threshold", np.float64),  # max(coefficient, mu_d) cos(alpha)
        ("draws", np.int64),
        ("slips", np.int64),  # in this half-cycle
    ]
)
_NOW = np.dtype(
    [
        ("shift", np.float64),  # l0 (theta - theta at the start)
        ("theta", np.float64),
        ("origin", np.float64),  # the time of step 0
        ("step", np.int64),
        ("steps_here", np.int64),  # in this rearrangement
        ("steps", np.int64),
        ("phase", np.int64),
        ("movers", np.int64),
        ("low", np.int64),  # the sliders that have moved in this rearrangement
        ("high", np.int64),
        ("rearrangements", np.int64),
        ("events", np.int64),
        ("slips", np.int64),
        ("below", np.int64),
        ("undecided", np.int64),
        ("number", np.int64),  # of the event in its rearrangement
        ("target", np.int64),
    ]
)
_ROW = np.dtype(
    [
        ("half_cycle", np.int64),
        ("rearrangement", np.int64),
        ("number", np.int64),
        ("theta", np.float64),
        ("time", np.float64),
        ("kind", np.int8),
        ("slider", np.int64),
        ("sign", np.int8),
        ("residual", np.float64),
    ]
)


class _Work(NamedTuple):
    """Everything that changes. Sliders stand at 1 .. n, with a ghost at either end."""

    sliders: NDArray[Any]  # of _SLIDER
    lanes: NDArray[np.float64]  # shape (13, n + 2): the motion, see below
    movers: NDArray[np.int64]  # ascending
    now: NDArray[Any]  # one _NOW
    windows: NDArray[np.int64]  # first and last slider of every window
    hit: NDArray[np.int8]  # 1: the slider stops or starts; 2: it has just stopped
    rows: NDArray[Any]  # of _ROW: one for every slider of an event, if events are kept
    written: NDArray[np.int64]  # how many rows
    spent: NDArray[np.int64]  # steps since the last look at a clock, see `_PAUSE`


_X, _Y, _B, _PULL, _MASS, _DRAG, _SIGN, _FLOOR, _CEILING, _SPRINGS = range(10)
# displacement since the last rest; y and b of the module's docstring; F at x = 0 (set when the
# slider or a neighbour starts); dt**2 (0 at rest); dt**2 mu_d c S; S (0 at rest); S v below the
# floor is a stop; |F| above the ceiling is a start; number of springs
_OLD_X, _OLD_W, _OLD_B = 10, 11, 12  # at the beginning of the step in which an event is located


@_compiled
def _draw(laws, now, slider, i):  # type: ignore[no-untyped-def]
    """Draw the next static coefficient of slider i."""
    k = slider.draws
    slider.draws = k + 1
    now.slips += 1
    slider.slips += 1
    if laws.random:
        words = philox(laws.seed, STREAM_COEFFICIENT, i, k // 4)
        mu = laws.mu_s + laws.sigma * normal_deviate(words[k % 4])
        slider.coefficient = mu
        if mu < laws.mu_d:
            now.below += 1
            slider.threshold = laws.friction
        else:
            slider.threshold = mu * laws.cosine


@_compiled
def _pull(laws, sliders, i):  # type: ignore[no-untyped-def]
    """Return F_i as it was when the chain was last at rest."""
    return (sliders[i].base - sliders[i - 1].base) + laws.weight


@_compiled
def _at(lanes, i):  # type: ignore[no-untyped-def]
    """Return F_i of a moving slider or a neighbour of one."""
    inner = (lanes[_X, i - 1] + lanes[_X, i + 1]) - lanes[_SPRINGS, i] * lanes[_X, i]
    return lanes[_PULL, i] + inner


@_compiled
def _rounding(work, laws, i):  # type: ignore[no-untyped-def]
    """Return a bound for the rounding errors of F_i and of its threshold."""
    sliders, lanes = work.sliders, work.lanes
    size = abs(sliders[i].base) + abs(sliders[i - 1].base) + abs(laws.weight)
    size += abs(lanes[_X, i - 1]) + abs(lanes[_X, i + 1]) + 2.0 * abs(lanes[_X, i])
    return 4.0 * _EPS * (size + sliders[i].threshold)


@_compiled
def _start(laws, work, i, sign):  # type: ignore[no-untyped-def]
    """Set slider i in motion from velocity zero."""
    now = work.now[0]
    lanes = work.lanes
    square = laws.dt * laws.dt
    for k in range(max(i - 1, 1), min(i + 1, laws.n) + 1):
        lanes[_PULL, k] = _pull(laws, work.sliders, k)
    lanes[_SIGN, i] = sign
    lanes[_MASS, i] = square
    lanes[_DRAG, i] = square * laws.friction * sign
    lanes[_FLOOR, i] = _SMALLEST
    lanes[_CEILING, i] = np.inf
    lanes[_B, i] = square * _at(lanes, i) - lanes[_DRAG, i]
    lanes[_Y, i] = -0.5 * lanes[_B, i]
    k = now.movers
    while k > 0 and work.movers[k - 1] > i:
        work.movers[k] = work.movers[k - 1]
        k -= 1
    work.movers[k] = i
    now.movers += 1
    now.low = min(now.low, i)
    now.high = max(now.high, i)


@_compiled
def _stop(laws, work, i):  # type: ignore[no-untyped-def]
    """Bring slider i to rest and draw its next static coefficient; `_discharge` must follow."""
    lanes = work.lanes
    _draw(laws, work.now[0], work.sliders[i], i)
    for row in (_Y, _B, _MASS, _DRAG, _SIGN, _FLOOR):
        lanes[row, i] = 0.0
    lanes[_CEILING, i] = work.sliders[i].threshold


@_compiled
def _discharge(work):  # type: ignore[no-untyped-def]
    """Strike the sliders that rest off the list of movers."""
    now = work.now[0]
    kept = 0
    for k in range(now.movers):
        i = work.movers[k]
        if work.lanes[_SIGN, i] != 0.0:
            work.movers[kept] = i
            kept += 1
    now.movers = kept


@_compiled
def _write(work, time, kind, i, sign, residual):  # type: ignore[no-untyped-def]
    """Keep one slider of an event, if events are kept."""
    if work.rows.size == 0:
        return
    now = work.now[0]
    row = work.rows[work.written[0]]
    row.half_cycle = now.target
    row.rearrangement = now.rearrangements - 1
    row.number = now.number
    row.theta = now.theta
    row.time = time
    row.kind = kind
    row.slider = i
    row.sign = np.int8(sign)
    row.residual = residual
    work.written[0] += 1


@_compiled
def _close_event(now):  # type: ignore[no-untyped-def]
    now.events += 1
    now.number += 1


@_compiled
def _begin(laws, now):  # type: ignore[no-untyped-def]
    """Begin a rearrangement."""
    now.rearrangements += 1
    now.number = 0
    now.origin = 0.0
    now.step = 0
    now.steps_here = 0
    now.phase = _MOVING
    now.low = laws.n + 1
    now.high = 0


@_compiled
def _release(laws, work):  # type: ignore[no-untyped-def]
    """Start every slider that exceeds its threshold as the chain stands; return how many."""
    now = work.now[0]
    started = 0
    for i in range(1, laws.n + 1):
        force = _pull(laws, work.sliders, i)
        excess = abs(force) - work.sliders[i].threshold
        if abs(excess) <= _rounding(work, laws, i):
            now.undecided += 1
        if excess > 0.0:
            if started == 0:
                _begin(laws, now)
            started += 1
            sign = math.copysign(1.0, force)
            _start(laws, work, i, sign)
            _write(work, 0.0, _START, i, sign, excess)
    if started > 0:
        _close_event(now)
    return started


@_compiled
def _ramp(laws, work, way, room):  # type: ignore[no-untyped-def]
    """Ramp theta until an end slider starts, by less than `room` = l0 |d theta|; return whether.

    theta enters the forces on sliders 1 and n only, so theta_c is explicit.
    """
    n = laws.n
    if n == 1:
        return False
    now = work.now[0]
    sliders = work.sliders
    gaps = (np.inf, np.inf)
    slack = 0.0
    for i in (1, n):
        sign = way if i == n else -way  # of the start that the ramp brings about
        gap = max(sliders[i].threshold - sign * _pull(laws, sliders, i), 0.0)
        gaps = (gaps[1], gap)
        slack += _rounding(work, laws, i)
    ramp = min(gaps[0], gaps[1])
    if abs(ramp - room) <= slack:
        now.undecided += 1
    if not ramp < room:
        return False
    tie = abs(gaps[0] - gaps[1]) <= slack
    if tie:
        now.undecided += 1
    now.shift += way * ramp
    now.theta = (laws.origin + now.shift) / laws.l0
    sliders[0].base = now.shift
    sliders[n].base = now.shift
    _begin(laws, now)
    for i in (1, n):
        if tie or ramp == (gaps[1] if i == n else gaps[0]):
            sign = way if i == n else -way
            _start(laws, work, i, sign)
            residual = abs(abs(_pull(laws, sliders, i)) - sliders[i].threshold)
            _write(work, 0.0, _START, i, sign, residual)
    _close_event(now)
    # where mu_s acts as mu_d the slip has no length: it stops where it starts, and draws anew
    stopped = 0
    for i in (1, n):
        sign = work.lanes[_SIGN, i]
        if sign != 0.0 and sliders[i].threshold <= laws.friction:
            _write(work, 0.0, _STOP, i, sign, 0.0)
            _stop(laws, work, i)
            stopped += 1
    if stopped > 0:
        _close_event(now)
        _discharge(work)
    return True


@_compiled
def _lay_out(laws, work):  # type: ignore[no-untyped-def]
    """Lay windows around the movers, a neighbour at either side; return how many."""
    movers = work.now[0].movers
    windows = 0
    k = 0
    while k < movers:
        low = work.movers[k]
        high = low
        while k + 1 < movers and work.movers[k + 1] - high <= _GAP:
            k += 1
            high = work.movers[k]
        k += 1
        work.windows[2 * windows] = max(low - 1, 1)
        work.windows[2 * windows + 1] = min(high + 1, laws.n)
        windows += 1
    return windows


@_compiled
def _alone(laws, work, most):  # type: ignore[no-untyped-def]
    """Step a slider that moves alone until it stops or starts a neighbour.

    Returns the number of steps, at most `most`, and whether there is an event.
    """
    lanes = work.lanes
    i = work.movers[0]
    sign = lanes[_SIGN, i]
    rate = lanes[_SPRINGS, i] * laws.dt * laws.dt
    # the room of the neighbours: their forces grow as the slider advances
    left = np.inf
    right = np.inf
    if i > 1:
        left = lanes[_CEILING, i - 1] - sign * _at(lanes, i - 1)
    if i < laws.n:
        right = lanes[_CEILING, i + 1] - sign * _at(lanes, i + 1)
    room = min(left, right)
    y = sign * lanes[_Y, i]
    b = sign * lanes[_B, i]
    x = 0.0
    steps = 0
    while steps < most:
        y += b
        x += y
        b -= rate * y
        steps += 1
        if x > room or y + 0.5 * b <= 0.0:
            break
    lanes[_X, i] += sign * x
    lanes[_Y, i] = sign * y
    lanes[_B, i] = sign * b
    stops = y + 0.5 * b <= 0.0
    work.hit[i - 1] = x > left
    work.hit[i] = stops
    work.hit[i + 1] = x > right
    return steps, stops or x > room


@_compiled
def _together(work, windows, most):  # type: ignore[no-untyped-def]
    """Step all windows until a slider stops or starts; returns as `_alone`.

    One sweep over a window does a step: every slider advances just before the force on its left
    neighbour is needed.
    """
    lanes = work.lanes
    steps = 0
    found = False
    while steps < most and not found:
        steps += 1
        for k in range(windows):
            low, high = work.windows[2 * k], work.windows[2 * k + 1]
            x, y, b = lanes[_X, low:], lanes[_Y, low:], lanes[_B, low:]
            pull, mass, drag = lanes[_PULL, low:], lanes[_MASS, low:], lanes[_DRAG, low:]
            springs, sign = lanes[_SPRINGS, low:], lanes[_SIGN, low:]
            floor, ceiling = lanes[_FLOOR, low:], lanes[_CEILING, low:]
            beyond = lanes[_X, low - 1]
            while True:
                left = beyond
                advance = y[0] + b[0]
                here = x[0] + advance
                x[0] = here
                for i in range(high - low + 1):
                    # the last one ahead is a resting slider, or the ghost: it does not advance
                    ahead = y[i + 1] + b[i + 1]
                    right = x[i + 1] + ahead
                    x[i + 1] = right
                    force = pull[i] + ((left + right) - springs[i] * here)
                    push = mass[i] * force - drag[i]
                    b[i] = push
                    y[i] = advance
                    late = sign[i] * (advance + 0.5 * push) < floor[i]
                    found |= late | (abs(force) > ceiling[i])
                    left = here
                    here = right
                    advance = ahead
                if windows > 1 or found or steps >= most:
                    break
                steps += 1  # the only window goes on without being laid out again
    if found:
        for k in range(windows):
            for i in range(work.windows[2 * k], work.windows[2 * k + 1] + 1):
                late = lanes[_SIGN, i] * (lanes[_Y, i] + 0.5 * lanes[_B, i]) < lanes[_FLOOR, i]
                work.hit[i] = late | (abs(_at(lanes, i)) > lanes[_CEILING, i])
    return steps, found


@_compiled
def _within(work, windows, part):  # type: ignore[no-untyped-def]
    """Take the windows to the fraction `part` of a step; return whether a slider is hit.

    Within the step the motion is the velocity Verlet step of a shorter length.
    """
    lanes = work.lanes
    half = 0.5 * part
    for k in range(windows):
        for i in range(work.windows[2 * k], work.windows[2 * k + 1] + 1):
            advance = part * (lanes[_OLD_W, i] + half * lanes[_OLD_B, i])
            lanes[_X, i] = lanes[_OLD_X, i] + advance
    found = False
    for k in range(windows):
        for i in range(work.windows[2 * k], work.windows[2 * k + 1] + 1):
            force = _at(lanes, i)
            b = lanes[_MASS, i] * force - lanes[_DRAG, i]
            w = lanes[_OLD_W, i] + half * (lanes[_OLD_B, i] + b)
            lanes[_B, i] = b
            lanes[_Y, i] = w - 0.5 * b
            hit = (lanes[_SIGN, i] * w < lanes[_FLOOR, i]) | (abs(force) > lanes[_CEILING, i])
            work.hit[i] = hit
            found |= hit
    return found


@_compiled
def _locate(work, windows):  # type: ignore[no-untyped-def]
    """Go back to the first event inside the last step.

    Returns the fraction of the step, and whether there is an event.
    """
    lanes = work.lanes
    for k in range(windows):
        for i in range(work.windows[2 * k], work.windows[2 * k + 1] + 1):
            lanes[_X, i] -= lanes[_Y, i]
            lanes[_OLD_X, i] = lanes[_X, i]
    for k in range(windows):
        for i in range(work.windows[2 * k], work.windows[2 * k + 1] + 1):
            lanes[_OLD_B, i] = lanes[_MASS, i] * _at(lanes, i) - lanes[_DRAG, i]
            lanes[_OLD_W, i] = lanes[_Y, i] - 0.5 * lanes[_OLD_B, i]
    low = 0.0
    high = 1.0
    if not _within(work, windows, high):
        return high, False  # only a rounding error hit this step: the next one will be hit
    while high - low > _BISECTED:
        middle = 0.5 * (low + high)
        if _within(work, windows, middle):
            high = middle
        else:
            low = middle
    return high, _within(work, windows, high)


@_compiled
def _ties(laws, work, windows):  # type: ignore[no-untyped-def]
    """Let what cannot be told apart from an event at this instant take part in it."""
    now = work.now[0]
    lanes = work.lanes
    for k in range(windows):
        for i in range(work.windows[2 * k], work.windows[2 * k + 1] + 1):
            if work.hit[i] != 0:
                continue
            sign = lanes[_SIGN, i]
            if sign != 0.0:
                if laws.locate:
                    w = lanes[_Y, i] + 0.5 * lanes[_B, i]
                    size = abs(lanes[_OLD_W, i]) + abs(lanes[_OLD_B, i])
                    if sign * w <= 4.0 * _EPS * size:
                        now.undecided += 1
                        work.hit[i] = 1
                continue
            force = _at(lanes, i)
            if lanes[_CEILING, i] - abs(force) <= _rounding(work, laws, i):
                # together with the event if the force is on the rise; else at threshold: it stays
                now.undecided += 1
                pace = lanes[_Y, i - 1] + 0.5 * lanes[_B, i - 1]
                pace += lanes[_Y, i + 1] + 0.5 * lanes[_B, i + 1]
                if pace * force > 0.0:
                    work.hit[i] = 1


@_compiled
def _resolve(laws, work, windows):  # type: ignore[no-untyped-def]
    """Stop, draw and start what the event asks for, in this order."""
    now = work.now[0]
    lanes = work.lanes
    time = now.origin + now.step * laws.dt
    _ties(laws, work, windows)
    stopped = 0
    for k in range(windows):
        for i in range(work.windows[2 * k], work.windows[2 * k + 1] + 1):
            if work.hit[i] == 1 and lanes[_SIGN, i] != 0.0:
                speed = abs(lanes[_Y, i] + 0.5 * lanes[_B, i]) / laws.dt
                _write(work, time, _STOP, i, lanes[_SIGN, i], speed)
                _stop(laws, work, i)
                work.hit[i] = 2
                stopped += 1
    if stopped > 0:
        _close_event(now)
        _discharge(work)
    started = 0
    for k in range(windows):
        for i in range(work.windows[2 * k], work.windows[2 * k + 1] + 1):
            if lanes[_SIGN, i] != 0.0:
                continue
            force = _at(lanes, i)
            excess = abs(force) - lanes[_CEILING, i]
            if work.hit[i] == 2 and abs(excess) <= _rounding(work, laws, i):
                now.undecided += 1
            if work.hit[i] == 1 or excess > 0.0:
                started += 1
                sign = math.copysign(1.0, force)
                _start(laws, work, i, sign)
                _write(work, time, _START, i, sign, abs(excess))
    if started > 0:
        _close_event(now)


@_compiled
def _finite(work):  # type: ignore[no-untyped-def]
    total = 0.0
    for k in range(work.now[0].movers):
        i = work.movers[k]
        total += abs(work.lanes[_X, i]) + abs(work.lanes[_Y, i]) + abs(work.lanes[_B, i])
    return total < np.inf


@_compiled
def _never_stops(laws, work):  # type: ignore[no-untyped-def]
    """Return whether the whole chain provably slides for ever (the runaway certificate).

    All sliders move down; with the mean velocity V and the conserved energy J of the internal
    motion, V > sqrt((1 - 1/N) 2 J) leaves every velocity positive for ever.
    """
    n = laws.n
    if not laws.runs_away or work.now[0].movers < n:
        return False
    sliders, lanes = work.sliders, work.lanes
    sign = lanes[_SIGN, 1]
    if sign * laws.weight < 0.0:
        return False
    mean = 0.0
    for i in range(1, n + 1):
        if lanes[_SIGN, i] != sign:
            return False
        mean += lanes[_Y, i] + 0.5 * lanes[_B, i]
    mean /= n * laws.dt
    twice = 0.0
    for i in range(1, n + 1):
        twice += ((lanes[_Y, i] + 0.5 * lanes[_B, i]) / laws.dt - mean) ** 2
    for i in range(1, n):
        tension = sliders[i].base - work.now[0].shift + (lanes[_X, i + 1] - lanes[_X, i])
        twice += tension**2
    return sign * mean > math.sqrt((1.0 - 1.0 / n) * twice)


@_compiled
def _come_to_rest(laws, work):  # type: ignore[no-untyped-def]
    """End the rearrangement."""
    now = work.now[0]
    lanes = work.lanes
    now.phase = _AT_REST
    for i in range(now.low, now.high + 1):
        work.sliders[i].displacement += lanes[_X, i]
    for i in range(max(now.low - 1, 1), min(now.high + 1, laws.n)):
        work.sliders[i].base += lanes[_X, i + 1] - lanes[_X, i]
    for i in range(now.low, now.high + 1):
        lanes[_X, i] = 0.0


@_compiled
def _advance(laws, work, last_event):  # type: ignore[no-untyped-def]
    """Move the chain until it rests, or `last_event` events have happened, or it never will rest.

    Returns only where going on later changes no bit.
    """
    now = work.now[0]
    while now.movers > 0:
        if not _finite(work):
            return _INFINITE
        if _never_stops(laws, work):
            return _RUNAWAY
        if now.steps_here >= MOST_STEPS:
            return _STEPS
        if now.events >= last_event:
            return _EVENTS
        if work.spent[0] >= _PAUSE:
            return _PAUSED
        if work.rows.size > 0 and work.written[0] + 2 * laws.n + 2 > work.rows.size:
            return _ROWS
        windows = _lay_out(laws, work)
        most = _LOOK if laws.runs_away and now.movers == laws.n else _SURVEY
        most = min(most, _PAUSE // (4 * now.movers) + 1)
        movers = now.movers
        if movers == 1:
            steps, found = _alone(laws, work, most)
        else:
            steps, found = _together(work, windows, most)
        work.spent[0] += steps * movers
        now.steps += steps
        now.steps_here += steps
        now.step += steps
        if found and laws.locate:
            part, found = _locate(work, windows)
            now.origin += (now.step - 1 + part) * laws.dt
            now.step = 0
        if found:
            _resolve(laws, work, windows)
    _come_to_rest(laws, work)
    return _REST


@_compiled
def _follow(laws, work, targets, first, budget, x_G, x, tension, slips, wanted):  # type: ignore[no-untyped-def]
    """Take the chain to the targets; return why it returns and how many were reached."""
    n = laws.n
    now = work.now[0]
    sliders = work.sliders
    last_event = now.events + budget
    done = 0
    while done < targets.size:
        now.target = first + done
        if work.rows.size > 0 and work.written[0] + 2 * n + 2 > work.rows.size:
            return _ROWS, done
        if now.phase == _UNTESTED:
            now.phase = _AT_REST
            _release(laws, work)
        if now.phase == _MOVING:
            code = _advance(laws, work, last_event)
            if code != _REST:
                return code, done
        if now.events >= last_event:
            return _EVENTS, done
        goal = laws.l0 * targets[done] - laws.origin
        climb = goal - now.shift
        if climb != 0.0 and _ramp(laws, work, math.copysign(1.0, climb), abs(climb)):
            continue
        now.shift = goal
        now.theta = targets[done]
        sliders[0].base = goal
        sliders[n].base = goal
        total = sliders[(n + 1) // 2].displacement if n % 2 == 1 else 0.0
        for i in range(1, n // 2 + 1):  # in pairs: exactly 0 for a mirror-symmetric chain
            total += sliders[i].displacement + sliders[n + 1 - i].displacement
        x_G[done] = total / n
        if wanted[0]:
            for i in range(1, n + 1):
                x[done, i - 1] = sliders[i].displacement
        if wanted[1]:
            for i in range(1, n):
                tension[done, i - 1] = sliders[i].base - goal
        if wanted[2]:
            for i in range(1, n + 1):
                slips[done, i - 1] = sliders[i].slips
                sliders[i].slips = 0
        done += 1
    return _REST, done


@_compiled
def _trace(laws, sign, pull, low, b, xs, ws):  # type: ignore[no-untyped-def]
    """Repeat the steps of the sliders low .. low + size - 1, from the first rows of `xs`, `ws`.

    The entries before and after are their neighbours, which do not move; `b` holds zeros.
    """
    size = pull.size
    steps = len(xs) - 1
    for step in range(steps + 1):
        for j in range(1, size + 1):
            i = low + j - 1
            left = xs[step, j - 1] if i > 1 else xs[step, j]
            right = xs[step, j + 1] if i < laws.n else xs[step, j]
            before = b[j]
            if sign[j] != 0.0:
                force = pull[j - 1] + ((left + right) - 2.0 * xs[step, j])
                b[j] = laws.dt * laws.dt * (force - laws.friction * sign[j])
            if step > 0:
                ws[step, j] = ws[step - 1, j] + 0.5 * (before + b[j])
        if step < steps:
            for j in range(size + 2):
                xs[step + 1, j] = xs[step, j] + (ws[step, j] + 0.5 * b[j])


def _laws(chain: Chain, state: State, seed: int, dt: float, locate: bool) -> _Laws:
    l0 = nearest_float(chain.l0)
    return _Laws(
        n=chain.n,
        l0=l0,
        origin=l0 * float(state.theta),
        weight=chain.sin_alpha,
        friction=chain.friction,
        cosine=chain.cos_alpha,
        mu_d=nearest_float(chain.mu_d),
        mu_s=nearest_float(chain.mu_s),
        sigma=nearest_float(chain.sigma_mu),
        seed=np.uint64(seed),
        random=chain.sigma_mu != 0,
        runs_away=chain.may_run_away,
        dt=dt,
        locate=locate,
    )


def _work(chain: Chain, state: State, laws: _Laws, keep_events: bool) -> _Work:
    n = chain.n
    sliders = np.zeros(n + 2, dtype=_SLIDER)
    inner = sliders[1 : n + 1]
    sliders["base"][1:n] = state.tensions.astype(np.float64)
    inner["displacement"] = state.displacements.astype(np.float64)
    inner["coefficient"] = state.coefficients.astype(np.float64)
    inner["draws"] = state.draws
    if laws.random:
        coefficients = inner["coefficient"]
        below = coefficients < laws.mu_d
        inner["threshold"] = np.where(below, laws.friction, coefficients * laws.cosine)
    else:
        inner["threshold"] = chain.times_cosine(chain.mu_s)
    now = np.zeros(1, dtype=_NOW)
    now["theta"] = float(state.theta)
    lanes = np.zeros((_OLD_B + 1, n + 2))
    lanes[_CEILING] = math.inf
    lanes[_CEILING, 1 : n + 1] = inner["threshold"]
    lanes[_SPRINGS, 1 : n + 1] = 2.0
    lanes[_SPRINGS, 1] -= 1.0
    lanes[_SPRINGS, n] -= 1.0
    return _Work(
        sliders=sliders,
        lanes=lanes,
        movers=np.zeros(n + 1, dtype=np.int64),
        now=now,
        windows=np.zeros(n + 2, dtype=np.int64),
        hit=np.zeros(n + 2, dtype=np.int8),
        rows=np.zeros(2 * n + 4096 if keep_events else 0, dtype=_ROW),
        written=np.zeros(1, dtype=np.int64),
        spent=np.zeros(1, dtype=np.int64),
    )


def _state(laws: _Laws, work: _Work) -> State:
    n = laws.n
    inner = work.sliders[1 : n + 1]
    x = work.lanes[_X, 1 : n + 1]
    with np.errstate(invalid="ignore"):  # not finite where dt was too large
        stretch = np.diff(x)
    return State(
        tensions=inner["base"][: n - 1] - work.now["shift"][0] + stretch,
        displacements=inner["displacement"] + x,
        coefficients=inner["coefficient"].copy(),
        draws=inner["draws"].copy(),
        theta=float(work.now["theta"][0]),
    )


def _scaled_velocities(work: _Work) -> NDArray[np.float64]:
    """Return the velocities times dt, shape (n + 2,)."""
    with np.errstate(invalid="ignore"):  # not finite where dt was too large
        velocities: NDArray[np.float64] = work.lanes[_Y] + 0.5 * work.lanes[_B]
    return velocities


def _forces(laws: _Laws, base: NDArray[np.float64], x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return F_n, shape (n,), of all sliders; `x` has a ghost at either end."""
    pull: NDArray[np.float64] = np.diff(base) + laws.weight
    full = x.copy()
    full[0], full[-1] = full[1], full[-2]
    return pull + ((full[:-2] + full[2:]) - 2.0 * full[1:-1])


@dataclass(frozen=True, eq=False)
class _Rest:
    """Where the chain rested before the rearrangement; shared by its pieces."""

    laws: _Laws
    base: NDArray[np.float64]
    displacement: NDArray[np.float64]


class _Course:
    """The motion between two events: the steps, repeated when somebody asks, and joined smoothly.

    Between two steps it is the velocity Verlet step of a shorter length.
    """

    def __init__(self, rest: _Rest, work: _Work, t_min: float) -> None:
        self.t_min = t_min
        self.t_max = t_min
        self._rest = rest
        self._low, self._high = int(work.now["low"][0]), int(work.now["high"][0])
        moved = slice(self._low - 1, self._high + 2)
        self._x = work.lanes[_X, moved].copy()
        self._w = _scaled_velocities(work)[moved]
        self._sign = work.lanes[_SIGN, moved].copy()
        self._pull = np.diff(rest.base)[self._low - 1 : self._high] + rest.laws.weight
        self._kept: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None

    def _steps(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        if self._kept is None:
            laws = self._rest.laws
            count = math.floor((self.t_max - self.t_min) / laws.dt)
            xs = np.zeros((count + 1, self._x.size))
            ws = np.zeros((count + 1, self._x.size))
            xs[0], ws[0] = self._x, self._w
            b = np.zeros(self._x.size)
            _trace(laws, self._sign, self._pull, self._low, b, xs, ws)
            self._kept = xs, ws
        return self._kept

    def _push(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return dt**2 times the acceleration of the sliders of this piece, 0 at rest."""
        laws = self._rest.laws
        full = x.copy()
        if self._low == 1:
            full[0] = full[1]
        if self._high == laws.n:
            full[-1] = full[-2]
        force = self._pull + ((full[:-2] + full[2:]) - 2.0 * full[1:-1])
        sign = self._sign[1:-1]
        b = np.zeros_like(x)
        b[1:-1] = np.where(sign != 0.0, laws.dt**2 * (force - laws.friction * sign), 0.0)
        return b

    def __call__(self, t: Any) -> Motion:
        """Return the motion at the time `t`."""
        rest, laws = self._rest, self._rest.laws
        xs, ws = self._steps()
        passed = (float(t) - self.t_min) / laws.dt
        step = min(math.floor(passed), len(xs) - 1)
        part = passed - step
        b = self._push(xs[step])
        local = xs[step] + part * (ws[step] + 0.5 * part * b)
        speed = (ws[step] + 0.5 * part * (b + self._push(local))) / laws.dt
        x = np.zeros(laws.n + 2)
        velocities = np.zeros(laws.n + 2)
        x[self._low - 1 : self._high + 2] = local
        velocities[self._low - 1 : self._high + 2] = speed
        return Motion(rest.displacement + x[1:-1], velocities[1:-1], _forces(laws, rest.base, x))


def _new_events(work: _Work) -> list[Event]:
    """Return the events whose rows have been written, and clear the rows."""
    rows = work.rows[: int(work.written[0])]
    events: list[Event] = []
    for number in np.unique(rows["number"]):
        part = rows[rows["number"] == number]
        events.append(
            Event(
                time=float(part["time"][0]),
                kind=EventKind.STOP if part["kind"][0] else EventKind.START,
                sliders=tuple(part["slider"].tolist()),
                signs=tuple(part["sign"].tolist()),
                residual=float(part["residual"].max()),
            )
        )
    work.written[0] = 0
    return events


def _report(laws: _Laws, work: _Work) -> dict[str, Any]:
    return {"dt": laws.dt, "locate": laws.locate, "steps": int(work.now["steps"][0])}


class VerletSimulation(Simulation):
    """A chain on its way along a drive, stepped in time."""

    def __init__(
        self,
        chain: Chain,
        state: State,
        seed: int,
        record: tuple[str, ...],
        dt: float,
        locate: bool,
    ) -> None:
        refuse_no_slips(chain)
        refuse_records(record)
        self._chain = chain
        self._seed = seed
        self._record = record
        self._laws = _laws(chain, state, seed, dt, locate)
        self._work = _work(chain, state, self._laws, "events" in record)
        self._count()

    def _count(self) -> None:
        now = self._work.now[0]
        self.tally = Tally(
            rearrangements=int(now["rearrangements"]),
            events=int(now["events"]),
            slips=int(now["slips"]),
            draws_below_mu_d=int(now["below"]),
            undecided=int(now["undecided"]),
        )

    def follow(
        self,
        drive: Drive,
        first: int,
        count: int,
        *,
        max_events: int,
        deadline: Deadline = NEVER,
    ) -> Stretch:
        """Take the chain to targets `first` .. `first + count - 1` of the drive."""
        work, n = self._work, self._chain.n
        targets = drive.targets(first, count, self._seed)
        wanted = np.array([name in self._record for name in ("x", "tension", "slips")])
        x_G = np.empty(count)
        x = np.empty((count if wanted[0] else 0, n))
        tension = np.empty((count if wanted[1] else 0, n - 1))
        slips = np.empty((count if wanted[2] else 0, n), dtype=np.int64)
        rows = []
        done, code = 0, _ROWS
        last_event = int(work.now["events"][0]) + max_events
        while code in (_ROWS, _PAUSED):
            work.spent[0] = 0
            code, more = _follow(
                self._laws,
                work,
                targets[done:],
                first + done,
                last_event - int(work.now["events"][0]),
                x_G[done:],
                x[done:],
                tension[done:],
                slips[done:],
                wanted,
            )
            done += more
            rows.append(work.rows[: int(work.written[0])].copy())
            work.written[0] = 0
            if deadline.passed():
                break
        self._count()
        recorded: dict[str, NDArray[Any]] = {"x_G": x_G[:done]}
        for name, values, asked in zip(
            ("x", "tension", "slips"), (x, tension, slips), wanted, strict=True
        ):
            if asked:
                recorded[name] = values[:done]
        if "events" in self._record:
            kept = np.concatenate(rows)
            for name in _ROW.names or ():
                if name != "residual":
                    recorded["event_" + name] = kept[name].copy()
        return Stretch(done, recorded, _OUTCOMES.get(code), _REASONS.get(code, ""))

    def state(self) -> State:
        """Return the present state."""
        return _state(self._laws, self._work)

    def capture(self) -> dict[str, Any]:
        """Return everything needed to go on bit for bit."""
        work = self._work
        return {
            "origin": self._laws.origin,
            "movers": work.movers.copy(),
            "lanes": work.lanes.copy(),
            **{"slider_" + name: work.sliders[name].copy() for name in _SLIDER.names or ()},
            **{"now_" + name: work.now[name][0].item() for name in _NOW.names or ()},
        }

    def restore(self, captured: Mapping[str, Any]) -> None:
        """Take over what `capture` returned."""
        work = self._work
        self._laws = self._laws._replace(origin=float(captured["origin"]))
        work.movers[:] = captured["movers"]
        work.lanes[:] = captured["lanes"]
        for name in _SLIDER.names or ():
            work.sliders[name] = captured["slider_" + name]
        for name in _NOW.names or ():
            work.now[name] = captured["now_" + name]
        work.written[0] = 0
        self._count()

    def report(self) -> dict[str, Any]:
        """Return the time step, how events are found, and the number of steps."""
        return _report(self._laws, self._work)


@dataclass(frozen=True)
class Verlet(Solver):
    """Velocity Verlet with a fixed time step.

    Parameters
    ----------
    dt : number
        The time step, unit tau_dyn; positive. Beyond 1 it is unstable.
    locate : bool
        Find events inside the step by bisection, not at its end.

    Raises
    ------
    InputError
        If an option is out of range.

    Notes
    -----
    Source: section Numerical method. Guarantee: none; the error of a rearrangement is O(dt)
    across events (O(dt**2) with `locate`) as long as the itinerary is right.
    """

    dt: Any = field(default=0.01)
    locate: bool = False
    name: ClassVar[str] = "verlet"
    summary: ClassVar[str] = "velocity Verlet with a fixed time step dt, the paper's own method"

    def __post_init__(self) -> None:
        dt = nearest_float(exact_number(self.dt, "dt"))
        if not (dt > 0.0 and dt * dt > 0.0 and math.isfinite(dt * dt)):
            raise InputError("dt", self.dt, "must be a positive time step, unit tau_dyn")
        object.__setattr__(self, "dt", dt)
        if not isinstance(self.locate, (bool, np.bool_)):
            raise InputError("locate", self.locate, "must be true or false")

    def simulation(
        self, chain: Chain, state: State, seed: int, record: tuple[str, ...]
    ) -> VerletSimulation:
        """Return a simulation that starts from `state`."""
        return VerletSimulation(chain, state, seed, record, self.dt, bool(self.locate))

    def _start(
        self, chain: Chain, state: State, direction: int, seed: int
    ) -> tuple[_Laws, _Work]:
        """Return the chain at theta_c with the first sliders set in motion (if any ever are)."""
        simulation = self.simulation(chain, state, seed, ("events",))
        laws, work = simulation._laws, simulation._work
        if _release(laws, work) == 0 and direction != 0:
            _ramp(laws, work, float(direction), math.inf)
        return laws, work

    def rearrange(
        self,
        chain: Chain,
        state: State,
        direction: int,
        seed: int,
        *,
        max_events: int = MOST_EVENTS,
        deadline: Deadline = NEVER,
    ) -> Rearrangement:
        """Ramp theta in `direction` (+1, -1; 0: as it stands) to theta_c, and rearrange."""
        laws, work = self._start(chain, state, direction, seed)
        n = chain.n
        base = work.sliders["base"][: n + 1].copy()
        rest = _Rest(laws, base, work.sliders["displacement"][1 : n + 1].copy())
        tensions = base[1:n] - work.now["shift"][0]
        initial = State(
            tensions=tensions,
            displacements=state.displacements,
            coefficients=state.coefficients,
            draws=state.draws,
            theta=float(work.now["theta"][0]),
        )
        events = _new_events(work)
        courses = [_Course(rest, work, 0.0) for _ in events]
        code = _REST
        limit = ""
        while work.now["phase"][0] == _MOVING and code not in _OUTCOMES:
            if len(events) >= max_events:
                limit = f"max_events = {max_events} was reached"
            elif deadline.passed():
                limit = deadline.reason
            if limit:
                break
            work.spent[0] = 0
            code = _advance(laws, work, work.now["events"][0] + 1)
            new = _new_events(work)
            events += new
            if code != _REST:
                courses += [_Course(rest, work, event.time) for event in new]
        ends = [event.time for event in events[1:]]
        ended = work.now["phase"][0] != _MOVING
        if not ended:
            ends.append(float(work.now["origin"][0] + work.now["step"][0] * laws.dt))
        for course, end in zip(courses, ends, strict=False):
            course.t_max = end
        undecided = int(work.now["undecided"][0])
        return Rearrangement(
            chain=chain,
            initial=initial,
            events=tuple(events),
            outcome=Outcome.AT_REST if ended else _OUTCOMES.get(code, Outcome.LIMIT),
            evidence=Evidence.UNDECIDED if undecided else Evidence.COMPUTED,
            state=_state(laws, work),
            velocities=_scaled_velocities(work)[1 : n + 1] / laws.dt,
            sol=Solution(
                courses[: len(ends)],
                Motion(initial.displacements, np.zeros(n), initial.forces(chain)),
            ),
            undecided=undecided,
            draws_below_mu_d=int(work.now["below"][0]),
            solver=self.name,
            report=_report(laws, work),
            reason=limit or ("" if ended else _REASONS[code]),
        )

    def iterate(self, chain: Chain, state: State, direction: int, seed: int) -> Iterator[Event]:
        """Yield the events of `rearrange` one by one, each when it happens."""
        laws, work = self._start(chain, state, direction, seed)
        yield from _new_events(work)
        code = _REST
        while work.now["phase"][0] == _MOVING and code not in _OUTCOMES:
            work.spent[0] = 0
            code = _advance(laws, work, work.now["events"][0] + 1)
            yield from _new_events(work)
