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
from exactcreep.motion.solution import Motion, Solution
from exactcreep.solvers.solver import (
    RECORDS,
    Rearrangement,
    Simulation,
    Solver,
    Stretch,
    Tally,
)

MOST_STEPS = 10**9
"""Steps of one rearrangement after which it is given up."""

_SMALLEST = 5e-324  # v < _SMALLEST is v <= 0
_EPS = 2.0**-52
_GAP = 4  # movers closer than this share a window
_BISECTED = 2.0**-53  # of a step
_LOOK = 1 << 8  # steps between two looks of a whole chain in motion that may run away
_SURVEY = 1 << 14  # steps between two looks at whether the motion is finite, or runs away

# What `_advance` and `_follow` return
_REST, _EVENTS, _ROWS, _RUNAWAY, _STEPS, _INFINITE = 0, 1, 2, 3, 4, 5
_REASONS = {
    _STEPS: f"a rearrangement did not end within {MOST_STEPS:.0e} steps; dt may be too large",
    _INFINITE: "the motion grew beyond the largest float; dt is too large (above 1 it is unstable)",
}
_OUTCOMES = {_RUNAWAY: Outcome.RUNAWAY, _STEPS: Outcome.LIMIT, _INFINITE: Outcome.LIMIT}
_UNTESTED, _AT_REST, _MOVING = 0, 1, 2

# Places in `_Work.number`
_PHASE, _MOVERS, _LOW, _HIGH, _STEP, _STEPS_HERE = 0, 1, 2, 3, 4, 5
_REARRANGEMENTS, _EVENT_COUNT, _SLIPS, _BELOW, _UNDECIDED, _NUMBER = 6, 7, 8, 9, 10, 11
_ROW, _TARGET, _KEEP, _STEPS_ALL = 12, 13, 14, 15
# Places in `_Work.clock`: l0 (theta - theta at the start), theta, time of step 0
_SHIFT, _THETA, _ORIGIN = 0, 1, 2


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


class _Work(NamedTuple):
    """Everything that changes, sliders at 1 .. n with a ghost at either end."""

    base: NDArray[np.float64]  # base[n] = T_n + shift; base[0] = base[n] = shift
    displacement: NDArray[np.float64]  # at the last rest
    coefficient: NDArray[np.float64]
    threshold: NDArray[np.float64]  # max(coefficient, mu_d) cos(alpha)
    draws: NDArray[np.int64]
    x: NDArray[np.float64]  # displacement since the last rest
    w: NDArray[np.float64]  # velocity times dt
    sign: NDArray[np.float64]  # S_n, 0 at rest
    movers: NDArray[np.int64]  # ascending
    number: NDArray[np.int64]
    clock: NDArray[np.float64]
    slips: NDArray[np.int64]  # of each slider in this half-cycle
    # prepared anew after every event, in the windows only
    y: NDArray[np.float64]
    b: NDArray[np.float64]
    pull: NDArray[np.float64]
    mass: NDArray[np.float64]  # dt**2, 0 at rest
    drag: NDArray[np.float64]  # dt**2 mu_d c S_n
    floor: NDArray[np.float64]  # S v below this is a stop
    ceiling: NDArray[np.float64]  # |F| above this is a start
    hit: NDArray[np.int8]  # 1: a stop or a start; 2: has just stopped
    old_x: NDArray[np.float64]  # at the beginning of the step in which an event is located
    old_w: NDArray[np.float64]
    old_b: NDArray[np.float64]
    windows: NDArray[np.int64]
    # one row for every slider of an event
    row_half_cycle: NDArray[np.int64]
    row_rearrangement: NDArray[np.int64]
    row_number: NDArray[np.int64]
    row_theta: NDArray[np.float64]
    row_time: NDArray[np.float64]
    row_kind: NDArray[np.int8]
    row_slider: NDArray[np.int64]
    row_sign: NDArray[np.int8]
    row_residual: NDArray[np.float64]


_KEPT = _Work._fields[:12]  # what capture() must hold


@njit(cache=True, nogil=True, error_model="numpy")
def _draw(laws, work, i):  # type: ignore[no-untyped-def]
    """Draw the next static coefficient of slider i."""
    k = work.draws[i]
    work.draws[i] = k + 1
    if laws.random:
        words = philox(laws.seed, STREAM_COEFFICIENT, i, k // 4)
        mu = laws.mu_s + laws.sigma * normal_deviate(words[k % 4])
        work.coefficient[i] = mu
        if mu < laws.mu_d:
            work.number[_BELOW] += 1
            work.threshold[i] = laws.friction
        else:
            work.threshold[i] = mu * laws.cosine


@njit(cache=True, nogil=True, error_model="numpy")
def _force(work, laws, i):  # type: ignore[no-untyped-def]
    pull = (work.base[i] - work.base[i - 1]) + laws.weight
    return pull + ((work.x[i - 1] + work.x[i + 1]) - 2.0 * work.x[i])


@njit(cache=True, nogil=True, error_model="numpy")
def _rounding(work, laws, i):  # type: ignore[no-untyped-def]
    """Return a bound for the rounding error of `_force` and of the threshold."""
    size = abs(work.base[i]) + abs(work.base[i - 1]) + abs(laws.weight) + work.threshold[i]
    size += abs(work.x[i - 1]) + abs(work.x[i + 1]) + 2.0 * abs(work.x[i])
    return 4.0 * _EPS * size


@njit(cache=True, nogil=True, error_model="numpy")
def _ghosts(work, laws):  # type: ignore[no-untyped-def]
    work.x[0] = work.x[1]
    work.x[laws.n + 1] = work.x[laws.n]


@njit(cache=True, nogil=True, error_model="numpy")
def _enlist(work, i, sign):  # type: ignore[no-untyped-def]
    """Set slider i in motion."""
    work.sign[i] = sign
    k = work.number[_MOVERS]
    while k > 0 and work.movers[k - 1] > i:
        work.movers[k] = work.movers[k - 1]
        k -= 1
    work.movers[k] = i
    work.number[_MOVERS] += 1
    work.number[_LOW] = min(work.number[_LOW], i)
    work.number[_HIGH] = max(work.number[_HIGH], i)


@njit(cache=True, nogil=True, error_model="numpy")
def _discharge(work):  # type: ignore[no-untyped-def]
    """Strike the sliders that rest off the list of movers."""
    kept = 0
    for k in range(work.number[_MOVERS]):
        i = work.movers[k]
        if work.sign[i] != 0.0:
            work.movers[kept] = i
            kept += 1
    work.number[_MOVERS] = kept


@njit(cache=True, nogil=True, error_model="numpy")
def _write(work, time, kind, i, sign, residual):  # type: ignore[no-untyped-def]
    row = work.number[_ROW]
    work.row_half_cycle[row] = work.number[_TARGET]
    work.row_rearrangement[row] = work.number[_REARRANGEMENTS] - 1
    work.row_number[row] = work.number[_NUMBER]
    work.row_theta[row] = work.clock[_THETA]
    work.row_time[row] = time
    work.row_kind[row] = kind
    work.row_slider[row] = i
    work.row_sign[row] = np.int8(sign)
    work.row_residual[row] = residual
    work.number[_ROW] = row + 1


@njit(cache=True, nogil=True, error_model="numpy")
def _close_event(work):  # type: ignore[no-untyped-def]
    work.number[_EVENT_COUNT] += 1
    work.number[_NUMBER] += 1


@njit(cache=True, nogil=True, error_model="numpy")
def _begin(work):  # type: ignore[no-untyped-def]
    work.number[_REARRANGEMENTS] += 1
    work.number[_NUMBER] = 0
    work.number[_STEP] = 0
    work.number[_STEPS_HERE] = 0
    work.number[_PHASE] = _MOVING
    work.number[_LOW] = work.base.size
    work.number[_HIGH] = 0
    work.clock[_ORIGIN] = 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def _release(laws, work):  # type: ignore[no-untyped-def]
    """Start every slider that exceeds its threshold as the chain stands; return how many."""
    started = 0
    for i in range(1, laws.n + 1):
        force = _force(work, laws, i)
        excess = abs(force) - work.threshold[i]
        if abs(excess) <= _rounding(work, laws, i) and excess != 0.0:
            work.number[_UNDECIDED] += 1
        if excess > 0.0:
            if started == 0:
                _begin(work)
            started += 1
            _enlist(work, i, math.copysign(1.0, force))
            _write(work, 0.0, 0, i, work.sign[i], excess)
    if started > 0:
        _close_event(work)
    return started


@njit(cache=True, nogil=True, error_model="numpy")
def _ramp(laws, work, way, room):  # type: ignore[no-untyped-def]
    """Ramp theta until an end slider starts, by less than `room` = l0 |d theta|; return whether.

    theta enters the forces on sliders 1 and n only, so theta_c is explicit.
    """
    n = laws.n
    if n == 1:
        return False
    first = max(work.threshold[1] + way * _force(work, laws, 1), 0.0)
    last = max(work.threshold[n] - way * _force(work, laws, n), 0.0)
    ramp = min(first, last)
    slack = _rounding(work, laws, 1) + _rounding(work, laws, n)
    if room - ramp <= slack and ramp - room <= slack and room != 0.0 and ramp != room:
        work.number[_UNDECIDED] += 1
    if not ramp < room:
        return False
    tie = abs(first - last) <= slack
    if tie:
        work.number[_UNDECIDED] += 1
    shift = work.clock[_SHIFT] + way * ramp
    work.clock[_SHIFT] = shift
    work.clock[_THETA] = (laws.origin + shift) / laws.l0
    work.base[0] = shift
    work.base[n] = shift
    _begin(work)
    if first <= last or tie:
        _enlist(work, 1, -way)
        _write(work, 0.0, 0, 1, -way, abs(abs(_force(work, laws, 1)) - work.threshold[1]))
    if last <= first or tie:
        _enlist(work, n, way)
        _write(work, 0.0, 0, n, way, abs(abs(_force(work, laws, n)) - work.threshold[n]))
    _close_event(work)
    # with mu_s = mu_d the slip has no length: it stops where it starts, and draws anew
    stopped = 0
    for i in (1, n):
        if work.sign[i] != 0.0 and work.threshold[i] <= laws.friction:
            _write(work, 0.0, 1, i, work.sign[i], 0.0)
            work.sign[i] = 0.0
            _draw(laws, work, i)
            work.number[_SLIPS] += 1
            work.slips[i] += 1
            stopped += 1
    if stopped > 0:
        _close_event(work)
        _discharge(work)
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def _prepare(laws, work):  # type: ignore[no-untyped-def]
    """Lay out the windows and what a step needs in them; return how many windows."""
    n = laws.n
    count = work.number[_MOVERS]
    square = laws.dt * laws.dt
    windows = 0
    k = 0
    while k < count:
        low = work.movers[k]
        high = low
        while k + 1 < count and work.movers[k + 1] - high < _GAP:
            k += 1
            high = work.movers[k]
        k += 1
        low = max(low - 1, 1)
        high = min(high + 1, n)
        work.windows[2 * windows] = low
        work.windows[2 * windows + 1] = high
        windows += 1
        for i in range(low, high + 1):
            work.pull[i] = (work.base[i] - work.base[i - 1]) + laws.weight
            if work.sign[i] != 0.0:
                work.mass[i] = square
                work.drag[i] = square * laws.friction * work.sign[i]
                work.floor[i] = _SMALLEST
                work.ceiling[i] = np.inf
            else:
                work.mass[i] = 0.0
                work.drag[i] = 0.0
                work.floor[i] = 0.0
                work.ceiling[i] = work.threshold[i]
            work.b[i] = work.mass[i] * _force(work, laws, i) - work.drag[i]
            work.y[i] = work.w[i] - 0.5 * work.b[i]
            work.hit[i] = 0
    return windows


@njit(cache=True, nogil=True, error_model="numpy")
def _alone(laws, work, most):  # type: ignore[no-untyped-def]
    """Step a slider that moves alone until it stops or starts a neighbour.

    Returns the number of steps, at most `most`, and whether there is an event.
    """
    i = work.movers[0]
    n = laws.n
    sign = work.sign[i]
    springs = (1 if i > 1 else 0) + (1 if i < n else 0)
    rate = springs * laws.dt * laws.dt
    # the room of the neighbours: their forces grow as the slider advances
    room = np.inf
    left = np.inf
    right = np.inf
    if i > 1:
        left = work.ceiling[i - 1] - sign * _force(work, laws, i - 1)
        room = left
    if i < n:
        right = work.ceiling[i + 1] - sign * _force(work, laws, i + 1)
        room = min(room, right)
    y = sign * work.y[i]
    b = sign * work.b[i]
    x = 0.0
    steps = 0
    while steps < most:
        y += b
        x += y
        b -= rate * y
        steps += 1
        if x > room or y + 0.5 * b <= 0.0:
            break
    work.x[i] += sign * x
    work.y[i] = sign * y
    work.b[i] = sign * b
    found = False
    if y + 0.5 * b <= 0.0:
        work.hit[i] = 1
        found = True
    if x > left:
        work.hit[i - 1] = 1
        found = True
    if x > right:
        work.hit[i + 1] = 1
        found = True
    _ghosts(work, laws)
    return steps, found


@njit(cache=True, nogil=True, error_model="numpy")
def _together(laws, work, windows, most):  # type: ignore[no-untyped-def]
    """Step the windows until a slider stops or starts; returns as `_alone`."""
    n = laws.n
    x, y, b = work.x, work.y, work.b
    steps = 0
    found = False
    while steps < most and not found:
        steps += 1
        for k in range(windows):
            for i in range(work.windows[2 * k], work.windows[2 * k + 1] + 1):
                y[i] += b[i]
                x[i] += y[i]
        x[0] = x[1]
        x[n + 1] = x[n]
        for k in range(windows):
            for i in range(work.windows[2 * k], work.windows[2 * k + 1] + 1):
                force = work.pull[i] + ((x[i - 1] + x[i + 1]) - 2.0 * x[i])
                b[i] = work.mass[i] * force - work.drag[i]
                late = work.sign[i] * (y[i] + 0.5 * b[i]) < work.floor[i]
                found |= late | (abs(force) > work.ceiling[i])
    if found:
        for k in range(windows):
            for i in range(work.windows[2 * k], work.windows[2 * k + 1] + 1):
                force = work.pull[i] + ((x[i - 1] + x[i + 1]) - 2.0 * x[i])
                late = work.sign[i] * (y[i] + 0.5 * b[i]) < work.floor[i]
                work.hit[i] = late | (abs(force) > work.ceiling[i])
    return steps, found


@njit(cache=True, nogil=True, error_model="numpy")
def _within(laws, work, windows, part):  # type: ignore[no-untyped-def]
    """Take the windows to the fraction `part` of the step; return whether a slider is hit."""
    half = 0.5 * part
    for k in range(windows):
        for i in range(work.windows[2 * k], work.windows[2 * k + 1] + 1):
            work.x[i] = work.old_x[i] + part * (work.old_w[i] + half * work.old_b[i])
    _ghosts(work, laws)
    found = False
    for k in range(windows):
        for i in range(work.windows[2 * k], work.windows[2 * k + 1] + 1):
            force = work.pull[i] + ((work.x[i - 1] + work.x[i + 1]) - 2.0 * work.x[i])
            b = work.mass[i] * force - work.drag[i]
            work.w[i] = work.old_w[i] + half * (work.old_b[i] + b)
            late = work.sign[i] * work.w[i] < work.floor[i]
            work.hit[i] = late | (abs(force) > work.ceiling[i])
            found |= late | (abs(force) > work.ceiling[i])
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def _locate(laws, work, windows):  # type: ignore[no-untyped-def]
    """Go back to the first event inside the last step; return the fraction of the step.

    Within the step the motion is the velocity Verlet step of a shorter length.
    """
    for k in range(windows):
        for i in range(work.windows[2 * k], work.windows[2 * k + 1] + 1):
            work.x[i] -= work.y[i]
            work.old_x[i] = work.x[i]
    _ghosts(work, laws)
    for k in range(windows):
        for i in range(work.windows[2 * k], work.windows[2 * k + 1] + 1):
            work.old_b[i] = work.mass[i] * _force(work, laws, i) - work.drag[i]
            work.old_w[i] = work.y[i] - 0.5 * work.old_b[i]
    low = 0.0
    high = 1.0
    if not _within(laws, work, windows, high):
        return high, False  # the step was hit by a rounding error: the next one will be
    while high - low > _BISECTED:
        middle = 0.5 * (low + high)
        if _within(laws, work, windows, middle):
            high = middle
        else:
            low = middle
    return high, _within(laws, work, windows, high)


@njit(cache=True, nogil=True, error_model="numpy")
def _ties(laws, work, windows):  # type: ignore[no-untyped-def]
    """Let what cannot be told apart from an event at this instant take part in it."""
    for k in range(windows):
        for i in range(work.windows[2 * k], work.windows[2 * k + 1] + 1):
            if work.hit[i] != 0:
                continue
            if work.sign[i] != 0.0:
                if laws.locate and work.sign[i] * work.w[i] <= 4.0 * _EPS * (
                    abs(work.old_w[i]) + abs(work.old_b[i])
                ):
                    work.number[_UNDECIDED] += 1
                    work.hit[i] = 1
                continue
            force = _force(work, laws, i)
            if work.threshold[i] - abs(force) <= _rounding(work, laws, i):
                # together with the event if the force is on the rise; else at threshold: it stays
                work.number[_UNDECIDED] += 1
                pace = work.w[i - 1] * (i > 1) + work.w[i + 1] * (i < laws.n)
                if math.copysign(pace, pace * force) > 0.0:
                    work.hit[i] = 1


@njit(cache=True, nogil=True, error_model="numpy")
def _resolve(laws, work, windows):  # type: ignore[no-untyped-def]
    """Stop, draw and start what the event asks for, in this order."""
    time = work.clock[_ORIGIN] + work.number[_STEP] * laws.dt
    _ties(laws, work, windows)
    stopped = 0
    for k in range(windows):
        for i in range(work.windows[2 * k], work.windows[2 * k + 1] + 1):
            if work.sign[i] != 0.0 and work.hit[i] != 0:
                _write(work, time, 1, i, work.sign[i], abs(work.w[i]) / laws.dt)
                work.w[i] = 0.0
                work.sign[i] = 0.0
                work.hit[i] = 2
                _draw(laws, work, i)
                work.number[_SLIPS] += 1
                work.slips[i] += 1
                stopped += 1
    if stopped > 0:
        _close_event(work)
        _discharge(work)
    started = 0
    for k in range(windows):
        for i in range(work.windows[2 * k], work.windows[2 * k + 1] + 1):
            if work.sign[i] == 0.0:
                force = _force(work, laws, i)
                excess = abs(force) - work.threshold[i]
                if work.hit[i] == 2 and abs(excess) <= _rounding(work, laws, i):
                    work.number[_UNDECIDED] += 1
                if work.hit[i] == 1 or excess > 0.0:
                    started += 1
                    _enlist(work, i, math.copysign(1.0, force))
                    _write(work, time, 0, i, work.sign[i], abs(excess))
    if started > 0:
        _close_event(work)


@njit(cache=True, nogil=True, error_model="numpy")
def _finite(work):  # type: ignore[no-untyped-def]
    total = 0.0
    for k in range(work.number[_MOVERS]):
        i = work.movers[k]
        total += abs(work.x[i]) + abs(work.w[i])
    return total < np.inf


@njit(cache=True, nogil=True, error_model="numpy")
def _never_stops(laws, work):  # type: ignore[no-untyped-def]
    """Return whether the whole chain provably slides for ever (the runaway certificate).

    All sliders move down; with the mean velocity V and the conserved energy J of the internal
    motion, V > sqrt((1 - 1/N) 2 J) leaves every velocity positive for ever.
    """
    n = laws.n
    if not laws.runs_away or work.number[_MOVERS] < n:
        return False
    sign = work.sign[1]
    mean = 0.0
    for i in range(1, n + 1):
        if work.sign[i] != sign:
            return False
        mean += work.w[i]
    if sign * laws.weight < 0.0:
        return False
    mean /= n * laws.dt
    twice = 0.0
    for i in range(1, n + 1):
        twice += (work.w[i] / laws.dt - mean) ** 2
    for i in range(1, n):
        twice += (work.base[i] - work.clock[_SHIFT] + (work.x[i + 1] - work.x[i])) ** 2
    return sign * mean > math.sqrt((1.0 - 1.0 / n) * twice)


@njit(cache=True, nogil=True, error_model="numpy")
def _make_room(laws, work):  # type: ignore[no-untyped-def]
    """Return whether the rows of one more event fit."""
    if work.number[_ROW] + 2 * laws.n + 2 <= work.row_time.size:
        return True
    if work.number[_KEEP] == 0:
        work.number[_ROW] = 0
        return True
    return False


@njit(cache=True, nogil=True, error_model="numpy")
def _advance(laws, work, last_event):  # type: ignore[no-untyped-def]
    """Move the chain until it rests, or `last_event` events have happened, or it never will rest.

    Returns only at events (or with the chain given up), with the velocities in `work.w`, so
    that going on later changes no bit.
    """
    while work.number[_MOVERS] > 0:
        if not _finite(work):
            return _INFINITE
        if _never_stops(laws, work):
            return _RUNAWAY
        if work.number[_STEPS_HERE] >= MOST_STEPS:
            return _STEPS
        if work.number[_EVENT_COUNT] >= last_event:
            return _EVENTS
        if not _make_room(laws, work):
            return _ROWS
        windows = _prepare(laws, work)
        most = _LOOK if laws.runs_away and work.number[_MOVERS] == laws.n else _SURVEY
        if work.number[_MOVERS] == 1:
            steps, found = _alone(laws, work, most)
        else:
            steps, found = _together(laws, work, windows, most)
        work.number[_STEPS_HERE] += steps
        work.number[_STEPS_ALL] += steps
        if found and laws.locate:
            part, found = _locate(laws, work, windows)
            work.clock[_ORIGIN] += (work.number[_STEP] + steps - 1 + part) * laws.dt
            work.number[_STEP] = 0
        else:
            work.number[_STEP] += steps
            for k in range(windows):
                for i in range(work.windows[2 * k], work.windows[2 * k + 1] + 1):
                    work.w[i] = work.y[i] + 0.5 * work.b[i]
        if found:
            _resolve(laws, work, windows)
    for i in range(work.number[_LOW], work.number[_HIGH] + 1):
        work.displacement[i] += work.x[i]
    for i in range(max(work.number[_LOW] - 1, 1), min(work.number[_HIGH] + 1, laws.n)):
        work.base[i] += work.x[i + 1] - work.x[i]
    for i in range(work.number[_LOW] - 1, work.number[_HIGH] + 2):
        work.x[i] = 0.0
    work.number[_PHASE] = _AT_REST
    return _REST


@njit(cache=True, nogil=True, error_model="numpy")
def _follow(laws, work, targets, first, budget, x_G, x, tension, slips, wanted):  # type: ignore[no-untyped-def]
    """Take the chain to the targets; return why it returns and how many were reached."""
    n = laws.n
    last_event = work.number[_EVENT_COUNT] + budget
    done = 0
    while done < targets.size:
        work.number[_TARGET] = first + done
        if not _make_room(laws, work):
            return _ROWS, done
        if work.number[_PHASE] == _UNTESTED:
            work.number[_PHASE] = _AT_REST
            _release(laws, work)
        if work.number[_PHASE] == _MOVING:
            code = _advance(laws, work, last_event)
            if code != _REST:
                return code, done
        if work.number[_EVENT_COUNT] >= last_event:
            return _EVENTS, done
        goal = laws.l0 * targets[done] - laws.origin
        climb = goal - work.clock[_SHIFT]
        if climb != 0.0 and _ramp(laws, work, math.copysign(1.0, climb), abs(climb)):
            continue
        work.clock[_SHIFT] = goal
        work.clock[_THETA] = targets[done]
        work.base[0] = goal
        work.base[n] = goal
        total = 0.0
        for i in range(1, n + 1):
            total += work.displacement[i]
        x_G[done] = total / n
        if wanted[0]:
            x[done, :] = work.displacement[1 : n + 1]
        if wanted[1]:
            for i in range(1, n):
                tension[done, i - 1] = work.base[i] - goal
        if wanted[2]:
            slips[done, :] = work.slips[1 : n + 1]
            work.slips[:] = 0
        done += 1
    return _REST, done


@njit(cache=True, nogil=True, error_model="numpy")
def _trace(laws, x, w, sign, pull, low, steps, xs, ws):  # type: ignore[no-untyped-def]
    """Repeat `steps` steps of the sliders low .. low + size - 1, every one kept in `xs`, `ws`.

    The entries before and after are their neighbours, which do not move.
    """
    size = pull.size
    xs[0] = x
    ws[0] = w
    b = np.zeros(size + 2)
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


def _work(chain: Chain, state: State, laws: _Laws) -> _Work:
    n = chain.n

    def sliders(values: Any = 0.0, kind: Any = np.float64) -> NDArray[Any]:
        array = np.zeros(n + 2, dtype=kind)
        array[1 : n + 1] = values
        return array

    base = np.zeros(n + 1)
    base[1:n] = state.tensions.astype(np.float64)
    coefficients = state.coefficients.astype(np.float64)
    if laws.random:
        below = coefficients < laws.mu_d
        thresholds = np.where(below, laws.friction, coefficients * laws.cosine)
    else:
        thresholds = np.full(n, chain.times_cosine(chain.mu_s))
    rows = 2 * n + 4096
    return _Work(
        base=base,
        displacement=sliders(state.displacements.astype(np.float64)),
        coefficient=sliders(coefficients),
        threshold=sliders(thresholds),
        draws=sliders(state.draws, np.int64),
        x=sliders(),
        w=sliders(),
        sign=sliders(),
        movers=np.zeros(n + 1, dtype=np.int64),
        number=np.zeros(16, dtype=np.int64),
        clock=np.array([0.0, float(state.theta), 0.0]),
        slips=sliders(0, np.int64),
        y=sliders(),
        b=sliders(),
        pull=sliders(),
        mass=sliders(),
        drag=sliders(),
        floor=sliders(),
        ceiling=sliders(),
        hit=sliders(0, np.int8),
        old_x=sliders(),
        old_w=sliders(),
        old_b=sliders(),
        windows=np.zeros(2 * n + 2, dtype=np.int64),
        row_half_cycle=np.zeros(rows, dtype=np.int64),
        row_rearrangement=np.zeros(rows, dtype=np.int64),
        row_number=np.zeros(rows, dtype=np.int64),
        row_theta=np.zeros(rows),
        row_time=np.zeros(rows),
        row_kind=np.zeros(rows, dtype=np.int8),
        row_slider=np.zeros(rows, dtype=np.int64),
        row_sign=np.zeros(rows, dtype=np.int8),
        row_residual=np.zeros(rows),
    )


def _state(laws: _Laws, work: _Work) -> State:
    n = laws.n
    return State(
        tensions=work.base[1:n] - work.clock[_SHIFT] + np.diff(work.x[1 : n + 1]),
        displacements=work.displacement[1 : n + 1] + work.x[1 : n + 1],
        coefficients=work.coefficient[1 : n + 1].copy(),
        draws=work.draws[1 : n + 1].copy(),
        theta=float(work.clock[_THETA]),
    )


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
        low, high = int(work.number[_LOW]), int(work.number[_HIGH])
        self._rest = rest
        self._low, self._high = low, high
        self._x = work.x[low - 1 : high + 2].copy()
        self._w = work.w[low - 1 : high + 2].copy()
        self._sign = work.sign[low - 1 : high + 2].copy()
        self._pull = np.diff(rest.base)[low - 1 : high] + rest.laws.weight
        self._kept: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None

    def _steps(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        if self._kept is None:
            count = math.floor((self.t_max - self.t_min) / self._rest.laws.dt)
            xs = np.zeros((count + 1, self._x.size))
            ws = np.zeros((count + 1, self._x.size))
            _trace(
                self._rest.laws, self._x, self._w, self._sign, self._pull, self._low, count, xs, ws
            )
            self._kept = xs, ws
        return self._kept

    def _twice_force(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return dt**2 times the acceleration of the sliders of this piece, 0 at rest."""
        laws = self._rest.laws
        full = x.copy()
        if self._low == 1:
            full[0] = full[1]
        if self._high == laws.n:
            full[-1] = full[-2]
        force = self._pull + ((full[:-2] + full[2:]) - 2.0 * full[1:-1])
        b = np.zeros_like(x)
        sign = self._sign[1:-1]
        b[1:-1] = np.where(sign != 0.0, laws.dt**2 * (force - laws.friction * sign), 0.0)
        return b

    def __call__(self, t: Any) -> Motion:
        """Return the motion at the time `t`."""
        rest, laws = self._rest, self._rest.laws
        xs, ws = self._steps()
        passed = (float(t) - self.t_min) / laws.dt
        step = min(math.floor(passed), len(xs) - 1)
        part = passed - step
        b = self._twice_force(xs[step])
        local = xs[step] + part * (ws[step] + 0.5 * part * b)
        speed = (ws[step] + 0.5 * part * (b + self._twice_force(local))) / laws.dt
        x = np.zeros(laws.n + 2)
        x[self._low - 1 : self._high + 2] = local
        velocities = np.zeros(laws.n + 2)
        velocities[self._low - 1 : self._high + 2] = speed
        velocities = velocities[1:-1]
        return Motion(rest.displacement + x[1:-1], velocities, _forces(laws, rest.base, x))


def _new_events(work: _Work) -> list[Event]:
    """Return the events whose rows have been written, and clear the rows."""
    events: list[Event] = []
    rows = int(work.number[_ROW])
    row = 0
    while row < rows:
        number = work.row_number[row]
        end = row
        while end < rows and work.row_number[end] == number:
            end += 1
        events.append(
            Event(
                time=float(work.row_time[row]),
                kind=EventKind.STOP if work.row_kind[row] else EventKind.START,
                sliders=tuple(work.row_slider[row:end].tolist()),
                signs=tuple(work.row_sign[row:end].tolist()),
                residual=float(work.row_residual[row:end].max()),
            )
        )
        row = end
    work.number[_ROW] = 0
    return events


def _report(laws: _Laws, work: _Work, code: int) -> dict[str, Any]:
    steps = int(work.number[_STEPS_ALL])
    report: dict[str, Any] = {"dt": laws.dt, "locate": laws.locate, "steps": steps}
    if code in _REASONS:
        report["reason"] = _REASONS[code]
    return report


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
        for name in record:
            if name not in RECORDS:
                raise InputError("record", name, "must be one of " + ", ".join(RECORDS))
        self._chain = chain
        self._seed = seed
        self._record = record
        self._laws = _laws(chain, state, seed, dt, locate)
        self._work = _work(chain, state, self._laws)
        self._work.number[_KEEP] = "events" in record
        self._count()

    def _count(self) -> None:
        count = self._work.number
        self.tally = Tally(
            rearrangements=int(count[_REARRANGEMENTS]),
            events=int(count[_EVENT_COUNT]),
            slips=int(count[_SLIPS]),
            draws_below_mu_d=int(count[_BELOW]),
            undecided=int(count[_UNDECIDED]),
        )

    def follow(self, drive: Drive, first: int, count: int, *, max_events: int) -> Stretch:
        """Take the chain to targets `first` .. `first + count - 1` of the drive."""
        work, n = self._work, self._chain.n
        targets = drive.targets(first, count, self._seed)
        wanted = np.array([name in self._record for name in ("x", "tension", "slips")])
        x_G = np.empty(count)
        x = np.empty((count if wanted[0] else 0, n))
        tension = np.empty((count if wanted[1] else 0, n - 1))
        slips = np.empty((count if wanted[2] else 0, n), dtype=np.int64)
        columns: dict[str, list[NDArray[Any]]] = {name: [] for name in _COLUMNS}
        done, code, spent = 0, _ROWS, 0
        before = int(work.number[_EVENT_COUNT])
        while code == _ROWS:
            spent = int(work.number[_EVENT_COUNT]) - before
            code, more = _follow(
                self._laws,
                work,
                targets[done:],
                first + done,
                max_events - spent,
                x_G[done:],
                x[done:],
                tension[done:],
                slips[done:],
                wanted,
            )
            done += more
            if "events" in self._record:
                rows = int(work.number[_ROW])
                for name, pieces in columns.items():
                    pieces.append(getattr(work, "row_" + name)[:rows].copy())
                work.number[_ROW] = 0
        recorded: dict[str, NDArray[Any]] = {"x_G": x_G[:done]}
        if wanted[0]:
            recorded["x"] = x[:done]
        if wanted[1]:
            recorded["tension"] = tension[:done]
        if wanted[2]:
            recorded["slips"] = slips[:done]
        if "events" in self._record:
            recorded |= {f"event_{name}": np.concatenate(parts) for name, parts in columns.items()}
        self._count()
        return Stretch(done, recorded, _OUTCOMES.get(code), _REASONS.get(code, ""))

    def state(self) -> State:
        """Return the present state."""
        return _state(self._laws, self._work)

    def capture(self) -> dict[str, Any]:
        """Return everything needed to go on bit for bit."""
        kept: dict[str, Any] = {name: getattr(self._work, name).copy() for name in _KEPT}
        kept["origin"] = self._laws.origin
        return kept

    def restore(self, captured: Mapping[str, Any]) -> None:
        """Take over what `capture` returned."""
        for name in _KEPT:
            getattr(self._work, name)[:] = captured[name]
        self._laws = self._laws._replace(origin=float(captured["origin"]))
        self._work.number[_ROW] = 0
        self._work.number[_KEEP] = "events" in self._record
        self._count()

    def report(self) -> dict[str, Any]:
        """Return the time step, how events are found, and the number of steps."""
        return _report(self._laws, self._work, _REST)


_COLUMNS = (
    "half_cycle", "rearrangement", "number", "theta", "time", "kind", "slider", "sign",
)  # fmt: skip


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
        """Return a simulation that starts from `state`.

        Raises
        ------
        InputError
            If ``mu_s = mu_d`` and ``sigma_mu = 0``: such a chain slides without slips.
        """
        if chain.mu_s == chain.mu_d and chain.sigma_mu == 0:
            raise InputError(
                "solver",
                self.name,
                "needs mu_s > mu_d or sigma_mu > 0 (the chain slides without slips: use the"
                " solver 'sliding')",
            )
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

    def rearrange(self, chain: Chain, state: State, direction: int, seed: int) -> Rearrangement:
        """Ramp theta in `direction` (+1, -1; 0: as it stands) to theta_c, and rearrange."""
        laws, work = self._start(chain, state, direction, seed)
        n = chain.n
        rest = _Rest(laws, work.base.copy(), work.displacement[1 : n + 1].copy())
        tensions = work.base[1:n] - work.clock[_SHIFT]
        initial = State(
            tensions=tensions,
            displacements=state.displacements,
            coefficients=state.coefficients,
            draws=state.draws,
            theta=float(work.clock[_THETA]),
        )
        events = _new_events(work)
        courses = [_Course(rest, work, 0.0) for _ in events]
        code = _REST
        while work.number[_PHASE] == _MOVING and code not in _OUTCOMES:
            code = _advance(laws, work, work.number[_EVENT_COUNT] + 1)
            new = _new_events(work)
            events += new
            if code != _REST:
                courses += [_Course(rest, work, event.time) for event in new]
        ends = [event.time for event in events[1:]]
        if code in _OUTCOMES:
            ends.append(float(work.clock[_ORIGIN] + work.number[_STEP] * laws.dt))
        for course, end in zip(courses, ends, strict=False):
            course.t_max = end
        undecided = int(work.number[_UNDECIDED])
        return Rearrangement(
            chain=chain,
            initial=initial,
            events=tuple(events),
            outcome=_OUTCOMES.get(code, Outcome.AT_REST),
            evidence=Evidence.UNDECIDED if undecided else Evidence.COMPUTED,
            state=_state(laws, work),
            velocities=work.w[1 : n + 1] / laws.dt,
            sol=Solution(
                courses[: len(ends)],
                Motion(initial.displacements, np.zeros(n), initial.forces(chain)),
            ),
            undecided=undecided,
            draws_below_mu_d=int(work.number[_BELOW]),
            solver=self.name,
            report=_report(laws, work, code),
        )

    def iterate(self, chain: Chain, state: State, direction: int, seed: int) -> Iterator[Event]:
        """Yield the events of `rearrange` one by one, each when it happens."""
        laws, work = self._start(chain, state, direction, seed)
        yield from _new_events(work)
        code = _REST
        while work.number[_PHASE] == _MOVING and code not in _OUTCOMES:
            code = _advance(laws, work, work.number[_EVENT_COUNT] + 1)
            yield from _new_events(work)
