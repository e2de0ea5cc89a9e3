"""Estimate the rounding error of a rearrangement: errors are carried along through its events.

Small errors follow the chain's own motion without friction and weight (the tangent map). An event
changes them (saltation). If the force on a resting slider is off by e, the slider starts ``e / F'``
too early, where F' is the rate of the force; with its initial acceleration A this gives a velocity
error ``A e / F'``. Next to a graze F' almost vanishes, and digits are lost that no comparison sees.
A stop removes the error of the velocity, and turns the error of the stopping distance into an error
of the place. A few random directions are followed. Their roundings are normally distributed,
because two roundings of one size and opposite signs would cancel.

The estimate holds while the events and their order do. A *margin*, the speed of a moving slider or
the distance of a resting slider from its threshold, must stay larger than its error: at the events
of other sliders, at a stop, and where the margin turns. Where it vanishes, at an event, it must not
turn within its error. Otherwise the order of events is in doubt from there on.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from exactcreep.compiling import njit
from exactcreep.model.chain import Chain
from exactcreep.model.contacts import Contacts, Event, EventKind
from exactcreep.model.state import State
from exactcreep.motion.arithmetic import FLOAT64
from exactcreep.motion.modes import forces_of, frictions_of, loads_of
from exactcreep.motion.taylor_flow import ORDER, STEP, carry, expand

DIRECTIONS = 4
"""Number of random errors that are followed, the same every time."""
MARGIN = 2.0
"""Ratio of the estimate and the largest error followed (or one rounding per event)."""
LOST = 1e-3
"""An error of this share of the largest force is not small: nothing is known from there on."""
_RANDOM = np.random.default_rng(20110603).standard_normal(4099)
_ROUNDOFF = 2.0**-53
_HALVINGS = 40
_TIME, _SLIDER, _SIGN, _HELD, _NUMBER = range(5)
"""Columns of events, a row for each slider: the number of the event, and the threshold after a
stop, -1 at a start."""


def amplified_error(
    chain: Chain, initial: State, events: Iterable[Event], contacts: Contacts
) -> tuple[float, int]:
    """Return an estimate of the largest error, and the number of the first event in doubt.

    `initial` is at rest at theta_c; `contacts`: the coefficients drawn at stops. The error is of a
    displacement or a tension at the last event; inf if the order of events is in doubt. The number,
    from 0, is -1 if none is in doubt.
    """
    draws, rows = initial.draws.tolist(), []
    for number, event in enumerate(events):
        for slider, sign in zip(event.sliders, event.signs, strict=True):
            held = -1.0
            if event.kind is EventKind.STOP:
                drawn = contacts.coefficient(slider, draws[slider - 1])
                held = float(contacts.holds(slider - 1, drawn, FLOAT64))
                draws[slider - 1] += 1
            rows.append((float(event.time), slider - 1, sign, held, number))
    if not rows:
        return 0.0, -1
    forces = forces_of(FLOAT64, initial.tensions.astype(float), loads_of(FLOAT64, chain))
    springs = np.full(chain.n, 2.0)
    springs[0] -= 1.0
    springs[-1] -= 1.0
    limits = contacts.thresholds(initial.coefficients.astype(float), FLOAT64)
    friction = frictions_of(FLOAT64, chain)
    error, number = _carried(np.array(rows), forces, springs, limits, friction, _RANDOM)
    return float(error), int(number)


@njit(cache=True)
def _carried(rows, forces, springs, held, friction, random):
    """Carry the chain (column 0) and its errors (other columns) from event to event."""
    n, columns = forces.size, DIRECTIONS + 1
    f, v, x = np.zeros((n, columns)), np.zeros((n, columns)), np.zeros((n, columns))
    late, signs = np.zeros((n, columns)), np.zeros(n, dtype=np.int64)
    f[:, 0] = forces
    size, word, now, row = np.abs(forces).max(), 0, 0.0, 0
    for i in rows[:, _SLIDER]:  # the friction on other sliders is not felt
        size = max(size, np.abs(forces).max() + friction[int(i)])
    for i in range(n):
        word = _round(f, i, 2.0 * _ROUNDOFF * size, random, word)
    while row < len(rows):
        number, time, end = int(rows[row, _NUMBER]), rows[row, _TIME], row
        while end < len(rows) and rows[end, _TIME] == time:
            end += 1
        if time > now:
            if not _pass(f, v, x, springs, signs, held, friction, time - now):
                return np.inf, number
            moving = np.flatnonzero(signs)
            for m in moving:
                size = max(size, abs(f[m, 0]), abs(v[m, 0]), abs(x[m, 0]))
            for m in moving:
                off = np.zeros((1, columns))
                word = _round(off, 0, 2.0 * _ROUNDOFF * size, random, word)
                _move(f, x, springs, m, off[0])
                word = _round(v, m, 2.0 * _ROUNDOFF * size, random, word)
            now = time
            if not _decided(f, v, springs, signs, held, friction, rows[row:end], late):
                return np.inf, number
        if not _happen(f, v, x, springs, signs, held, friction, rows[row:end], late):
            return np.inf, number
        if max(_largest(x), _largest(v)) >= LOST * max(size, 1.0):
            return np.inf, number
        row = end
    return MARGIN * max(_largest(x), _ROUNDOFF * size * len(rows)), -1


@njit(cache=True)
def _round(table, i, size, random, word):
    """Add a rounding of this size to the errors of slider i; return the next random number."""
    for c in range(1, table.shape[1]):
        table[i, c] += size * random[word % random.size]
        word += 1
    return word


@njit(cache=True)
def _move(f, x, springs, i, way):
    """Displace slider i, and change the forces that its springs exert."""
    for c in range(way.size):
        x[i, c] += way[c]
        f[i, c] -= springs[i] * way[c]
        if i > 0:
            f[i - 1, c] += way[c]
        if i < len(f) - 1:
            f[i + 1, c] += way[c]


@njit(cache=True)
def _largest(x):
    """Return the largest error of a displacement or a tension; inf if it is lost."""
    largest = 0.0
    for c in range(1, x.shape[1]):
        for i in range(len(x)):
            largest = max(largest, abs(x[i, c]), abs(x[i, c] - x[max(i - 1, 0), c]))
    return largest


@njit(cache=True)
def _beside(table, i, c):
    left = table[i - 1, c] if i > 0 else 0.0
    return left + table[i + 1, c] if i < len(table) - 1 else left


@njit(cache=True)
def _pass(f, v, x, springs, signs, held, friction, span):
    """Let a time pass; return whether margins that turn meanwhile are larger than their errors."""
    moving = np.flatnonzero(signs)
    if moving.size == 0:
        return True
    low, high = int(max(moving[0] - 1, 0)), int(min(moving[-1] + 2, len(f)))
    series = np.empty((ORDER + 1, high - low, v.shape[1]))
    steps = int(np.ceil(span / STEP))
    for _ in range(steps):
        a = _accelerations(f, signs, friction, low, high)
        part = v[low:high]
        expand(series, springs[low:high], signs[low:high], part, a)
        way = carry(series, part, a, span / steps)
        for i in range(low, high):
            if _turns(series, part, a, i - low, signs[i]):
                power = _margin(series, i - low, signs[i], f[i])
                if not _clear(power, signs[i], held[i], span / steps):
                    return False
        for m in moving:
            _move(f, x, springs, m, way[m - low])
    return True


@njit(cache=True)
def _accelerations(f, signs, friction, low, high):
    """Return the accelerations of sliders `low` .. `high` - 1, zero at rest."""
    a = np.zeros((high - low, f.shape[1]))
    for i in range(low, high):
        if signs[i] != 0:
            for c in range(f.shape[1]):
                a[i - low, c] = f[i, c]
            a[i - low, 0] -= signs[i] * friction[i]
    return a


@njit(cache=True)
def _turns(series, v, a, i, sign):
    """Return whether the margin of a slider falls at first, and rises at the end of a step."""
    if sign != 0:  # the speed of a slider that has just started rises, despite rounding
        return sign * series[0, i, 0] > 0.0 > sign * series[1, i, 0] and sign * a[i, 0] > 0.0
    return _beside(series[0], i, 0) * _beside(v, i, 0) < 0.0


@njit(cache=True)
def _margin(series, i, sign, force):
    """Return the speed of a mover, or the force on a slider at rest, as a power series."""
    power = np.zeros((ORDER + 2, force.size))
    for c in range(force.size):
        if sign == 0:
            power[0, c] = force[c]
        for k in range(ORDER + 1):
            if sign != 0:
                power[k, c] = series[k, i, c]
            else:
                power[k + 1, c] = _beside(series[k], i, c) / (k + 1)
    return power


@njit(cache=True)
def _clear(power, sign, threshold, step):
    """Return whether a margin is larger than its error where it turns."""
    way = 1.0 if _rate(power, 0.0) > 0.0 else -1.0
    low, high = 0.0, step
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if way * _rate(power, middle) > 0.0:
            low = middle
        else:
            high = middle
    at = np.zeros(power.shape[1])
    for k in range(ORDER + 1, -1, -1):
        for c in range(at.size):
            at[c] = at[c] * low + power[k, c]
    room = sign * at[0] if sign != 0 else threshold - way * at[0]
    return abs(room) > _reach(at, 0.0, at)


@njit(cache=True)
def _rate(power, t):
    rate = 0.0
    for k in range(ORDER + 1, 0, -1):
        rate = rate * t + k * power[k, 0]
    return rate


@njit(cache=True)
def _reach(errors, rate, late):
    """Return the error of a margin with this rate at an event whose time is off by `late`."""
    largest = 0.0
    for c in range(1, errors.size):
        largest = max(largest, abs(errors[c] + rate * late[c]))
    return largest


@njit(cache=True)
def _decided(f, v, springs, signs, held, friction, rows, late):
    """Note the time errors of simultaneous events; return whether their order is certain.

    A solver may have found the time only to within more than one rounding: then the speed of a
    slider that stops is not zero, or a force is not at its threshold. The events of one instant
    must lie together to within four times the errors of their times.
    """
    a = _accelerations(f, signs, friction, 0, len(f))
    here, early = np.zeros(len(f), dtype=np.bool_), np.zeros(len(f))
    first = int(rows[0, _SLIDER])
    for row in range(len(rows)):
        i = int(rows[row, _SLIDER])
        if here[i]:
            continue
        here[i] = True
        if signs[i] != 0:
            off, rate, bend = v[i], a[i, 0], _beside(v, i, 0) - springs[i] * v[i, 0]
            missed = v[i, 0]
        else:
            off, rate, bend = f[i], _beside(v, i, 0), _beside(a, i, 0)
            missed = f[i, 0] - rows[row, _SIGN] * held[i]
        if rate * bend < 0.0 and rate * rate <= 2.0 * abs(bend) * _reach(off, 0.0, off):
            return False  # it may have turned before
        early[i] = missed / rate
        for c in range(1, off.size):
            late[i, c] = -off[c] / rate
        apart = late[i] - late[first]
        if abs(early[i] - early[first]) > 4.0 * _reach(apart, 0.0, apart):
            return False  # the solver has merged them
    for k in np.flatnonzero(here):
        for c in range(1, late.shape[1]):
            late[k, c] -= early[k]
    for i in range(len(f)):
        if here[i]:
            continue
        if signs[i] != 0:
            off, rate, room = v[i], a[i, 0], signs[i] * v[i, 0]
        else:
            off, rate = f[i], _beside(v, i, 0)
            if rate == 0.0:
                continue
            room = held[i] - (f[i, 0] if rate > 0.0 else -f[i, 0])
        for row in range(len(rows)):
            if abs(room) <= _reach(off, rate, late[int(rows[row, _SLIDER])]):
                return False
    return True


@njit(cache=True)
def _happen(f, v, x, springs, signs, held, friction, rows, late):
    """Apply simultaneous events; return whether no slider is nearly reversed by its stop."""
    for row in range(len(rows)):
        i, sign = int(rows[row, _SLIDER]), int(rows[row, _SIGN])
        if rows[row, _HELD] < 0.0:
            signs[i] = sign
            for c in range(1, v.shape[1]):
                v[i, c] = -(f[i, 0] - sign * friction[i]) * late[i, c]
        else:
            left = np.zeros(v.shape[1])
            speed = v[i, 0]
            if speed != 0.0:  # a slow slider may be stopped at once
                left[1:] = sign * speed**2 / (2.0 * abs(f[i, 0] - sign * friction[i]))
                _move(f, x, springs, i, left)
            v[i], signs[i], held[i] = 0.0, 0, rows[row, _HELD]
    for row in range(len(rows)):
        i, sign = int(rows[row, _SLIDER]), rows[row, _SIGN]
        if rows[row, _HELD] >= 0.0 and sign * f[i, 0] < 0.0:  # does it reverse?
            room = held[i] - abs(f[i, 0])
            if abs(room) <= _reach(f[i], _beside(v, i, 0), late[i]):
                return False
    return True
