"""How far rounding takes a rearrangement: small errors, carried through its phases and events.

Errors x of the displacements and v of the velocities obey the equation of motion without its
constant forces, ``x'' = -K x`` for the movers, so that the error of the force on a slider is
``dF = -(K x)`` of the whole chain. An event that the errors shift by a time dt changes them by the
jump of the derivatives times -dt:

- a slider that starts, with the acceleration a and the force growing at the rate F', starts
  ``dt = -dF / F'`` late, and has the velocity error ``a dF / F'`` from then on;
- one that stops, with the acceleration a, stops ``dt = -v / a`` late. Its velocity error is gone,
  and its place changes in second order only, by ``-v**2 / (2 a)``;
- one that stops with a and starts the other way at once, with a', keeps ``v a' / a``;
- all others go on with the errors they have: their accelerations are continuous.

A lone slip from rest is a start, a phase and a stop: its length changes by ``2 dF / omega**2``.

The estimate carries `PROBES` sets of errors. Every mover's displacement and velocity receive
at each step of the motion what the kernel's rounding is seen to make there, with signs that
a generator of fixed seed chooses; the constants of the model are off by their own rounding. What
comes out at the end is a sample of what rounding does. Beside it goes the motion itself: where a
comparison was decided by less than the errors have become, no number can be given.

Source: Eqs. (dynamic_eq1)-(static_eqN); the rules are checked in tests/motion/test_condition.py.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from exactcreep.model.chain import Chain
from exactcreep.model.contact import Event, EventKind
from exactcreep.model.contacts import Contacts
from exactcreep.model.state import State
from exactcreep.motion.arithmetic import FLOAT64
from exactcreep.motion.modes import forces_of

PROMISE = 1e-12
"""What float64 promises for one rearrangement: the largest error, in units ``m g``.

Where forces are larger than that it is held relative to the largest."""
PROBES = 15
"""Sets of errors; their root mean square is good to a fifth."""
_COLUMNS = PROBES + 1  # column 0 is the motion itself
ROUNDING = 2.0**-54
"""Error of a displacement or velocity from one step, over the largest force or displacement so far.

Measured from event to event against 50 digits: median over movers 0.1 of 2**-52, at most 0.4 of it
in nine of ten steps."""
BIAS = 2.0**-55
"""Relative error of every step of every mover that has the same sign all the time.

The constants of the kernel's series are rounded, too: it grows with the number of events, not with
its root. Measured over 1600 swings of two sliders against 90 digits: 2**-57."""
_CONSTANTS = 2.0**-54
MARGIN = 4.0
"""The estimate over the root mean square of the probes."""
_ORDERS = 28
_LONGEST = 1.0  # step, in tau_dyn; frequencies are at most 2
_SMALL = 1e-18

# what a comparison that was decided by less than the errors was about
_NONE, _START, _STOP, _REVERSAL, _MISSED_START, _MISSED_STOP, _ORDER = range(7)
_DOUBTS = {
    _START: "slider {} only just exceeds its threshold",
    _STOP: "slider {} stops with next to no deceleration",
    _REVERSAL: "slider {} stops next to its threshold",
    _MISSED_START: "slider {} comes next to its threshold",
    _MISSED_STOP: "slider {} all but stops",
    _ORDER: "the event of slider {} comes next to the one before",
}


class Condition(NamedTuple):
    """How well float64 holds a rearrangement.

    Attributes
    ----------
    error : float
        Estimate of the largest error of a tension (unit ``m g``) or of a displacement since the
        start of the rearrangement (unit ``g tau_dyn**2``) at the last event; inf if the order of
        events itself is in doubt.
    doubt : str
        For inf: which comparison was decided by less than the errors; else empty.
    """

    error: float
    doubt: str

    @property
    def holds(self) -> bool:
        """Whether the estimate keeps the `PROMISE`."""
        return self.error <= PROMISE

    def sentence(self) -> str:
        """Return why the promise may not be kept; empty if it is."""
        if self.holds:
            return ""
        if self.doubt:
            return f"rounding may have changed the order of events: {self.doubt}"
        return f"rounding may have grown to {self.error:.2g}, beyond {PROMISE:g}"


def condition(chain: Chain, initial: State, events: Sequence[Event], *, seed: int = 0) -> Condition:
    """Return an estimate of what rounding in float64 has done to a rearrangement.

    Parameters
    ----------
    chain : Chain
    initial : State
        At rest, at theta_c.
    events : sequence of Event
    seed : int
        Keys the coefficients that were drawn at stops.

    Guarantee
    ---------
    None: an estimate to first order in the errors, with the rounding that was measured, not
    bounded. Deterministic: the same arguments give the same bits.
    """
    if not events:
        return Condition(0.0, "")
    errors, doubt = _after(chain, initial, events, seed, None, (ROUNDING, BIAS, _CONSTANTS))
    if doubt:
        return Condition(math.inf, doubt)
    spread = np.sqrt(np.mean(errors**2, axis=1))
    stretched = np.sqrt(np.mean(np.diff(errors, axis=0) ** 2, axis=1))
    return Condition(MARGIN * float(max(spread.max(), stretched.max(initial=0.0))), "")


def carried(
    chain: Chain, initial: State, events: Sequence[Event], errors: NDArray[np.float64],
    *, seed: int = 0,
) -> NDArray[np.float64]:
    """Return what small errors of the displacements have become at the last event.

    Parameters
    ----------
    chain, initial, events, seed
        As in `condition`.
    errors : ndarray, shape (n, m), m at most PROBES
        Errors of the displacements before the first event, in the units of the model. The sliders
        of the first event start nevertheless when they do.

    Returns
    -------
    ndarray, shape (n, m)

    Raises
    ------
    ArithmeticError
        If the errors are so large that the order of events is in doubt.

    Guarantee
    ---------
    The tangent map of the rearrangement with this order of events, to about 1e-13 relative.
    """
    columns = np.zeros((chain.n, PROBES))
    columns[:, : errors.shape[1]] = errors
    after, doubt = _after(chain, initial, events, seed, columns, (0.0, 0.0, 0.0))
    if doubt:
        raise ArithmeticError(doubt)
    return after[:, : errors.shape[1]]


def _after(
    chain: Chain,
    initial: State,
    events: Sequence[Event],
    seed: int,
    errors: NDArray[np.float64] | None,
    rounding: tuple[float, float, float],
) -> tuple[NDArray[np.float64], str]:
    """Return the errors at the last event, and which comparison is in doubt.

    Only the sliders of the events and their neighbours take part; without `errors` at the start
    only their rows are returned.
    """
    touched = [n - 1 for event in events for n in event.sliders]
    first, last = max(min(touched) - 1, 0), min(max(touched) + 1, chain.n - 1)
    window = slice(first, last + 1)
    stiffness = np.full(last - first + 1, 2.0)
    stiffness[0] -= first == 0
    stiffness[-1] -= last == chain.n - 1
    start = np.zeros((last - first + 1, PROBES)) if errors is None else errors[window]
    contacts = Contacts(chain, seed)
    coefficients = initial.coefficients[window].astype(np.float64)
    moved, doubt, slider = _carried(
        _rows(contacts, initial, events, first),
        forces_of(FLOAT64, initial.tensions.astype(np.float64), chain.sin_alpha)[window],
        chain.friction + contacts.excesses(coefficients),
        stiffness, chain.friction, abs(chain.sin_alpha), start, rounding,
    )  # fmt: skip
    told = _DOUBTS[doubt].format(slider + first + 1) if doubt != _NONE else ""
    if errors is None:
        return moved, told
    after = errors.copy()
    after[window] = moved
    return after, told


def _rows(
    contacts: Contacts, initial: State, events: Sequence[Event], first: int
) -> NDArray[np.float64]:
    """Return (time, stops, slider, sign, threshold after a stop, event), a row for each slider."""
    rows = np.array(
        [
            (float(event.time), event.kind is EventKind.STOP, n - 1 - first, sign, 0.0, number)
            for number, event in enumerate(events)
            for n, sign in zip(event.sliders, event.signs, strict=True)
        ],
        dtype=np.float64,
    )
    stops = rows[:, 1] != 0.0
    for slider in np.unique(rows[stops, 2]):
        own = np.flatnonzero(stops & (rows[:, 2] == slider))
        n = first + int(slider) + 1
        drawn = contacts.coefficients(n, int(initial.draws[n - 1]), own.size)
        rows[own, 4] = contacts.chain.friction + contacts.excesses(drawn)
    return rows


@njit(cache=True, nogil=True)
def _turned(word):
    """Return the next word of the generator of signs (Marsaglia's xorshift)."""
    word ^= word << np.uint64(13)
    word ^= word >> np.uint64(7)
    return word ^ (word << np.uint64(17))


@njit(cache=True, nogil=True)
def _sign(word, p):
    return 1.0 if (word >> np.uint64(p)) & np.uint64(1) else -1.0


@njit(cache=True, nogil=True)
def _spread(errors, i):
    """Return `MARGIN` times the root mean square of one slider's errors."""
    total = 0.0
    for p in range(1, _COLUMNS):
        total += errors[i, p] * errors[i, p]
    return MARGIN * math.sqrt(total / PROBES)


@njit(cache=True, nogil=True)
def _move(x, f, stiffness, i, p, length):
    """Move slider i in column p, and change the forces accordingly."""
    x[i, p] += length
    f[i - 1, p] += length
    f[i, p] -= stiffness[i] * length
    f[i + 1, p] += length


@njit(cache=True, nogil=True, error_model="numpy")
def _expand(series, x, v, f, push, bias, side, stiffness, window, step):
    """Let `step` pass without rounding; return how many orders of the motion `series` holds."""
    first, last = window
    shape = (last - first + 3, _COLUMNS)
    now = np.zeros(shape)
    after = np.zeros(shape)
    third = np.zeros(shape)
    length = np.zeros(shape)
    for i in range(first, last + 1):
        j = i - first + 1
        if side[i] != 0.0:
            for p in range(_COLUMNS):
                now[j, p] = v[i, p]
                after[j, p] = (f[i, p] - push[p] * side[i]) * step
                v[i, p] += after[j, p]
                length[j, p] = now[j, p] + 0.5 * after[j, p]
        series[0, i] = now[j, 0]
        series[1, i] = after[j, 0]
    size = 2.0 * step
    orders = 2
    while orders < _ORDERS and size > _SMALL:
        k = orders
        size *= 2.0 * step / k
        ratio = step * step / (k * (k - 1.0))
        for i in range(first, last + 1):
            j = i - first + 1
            if side[i] != 0.0:
                for p in range(_COLUMNS):
                    turned = now[j - 1, p] + now[j + 1, p] - stiffness[i] * now[j, p]
                    third[j, p] = ratio * turned
                    v[i, p] += third[j, p]
                    length[j, p] += third[j, p] / (k + 1.0)
            series[k, i] = third[j, 0]
        now, after, third = after, third, now
        orders += 1
    for i in range(first, last + 1):
        if side[i] != 0.0:
            j = i - first + 1
            for p in range(_COLUMNS):
                v[i, p] += bias[0, p] * v[i, 0]
                _move(x, f, stiffness, i, p, step * (length[j, p] + bias[1, p] * length[j, 0]))
    return orders


@njit(cache=True, nogil=True)
def _extremum(slope, orders, at_0):
    """Return the value of a function where its slope changes its sign in (0, 1), nan if nowhere.

    `slope` holds the coefficients of its derivative, `at_0` is its value at 0.
    """
    end = 0.0
    for k in range(orders):
        end += slope[k]
    if not slope[0] * end < 0.0:
        return math.nan
    low = 0.0
    high = 1.0
    for _ in range(40):  # an error of 2**-40 in the place changes the value by its square
        middle = 0.5 * (low + high)
        value = 0.0
        for k in range(orders - 1, -1, -1):
            value = value * middle + slope[k]
        if value * slope[0] > 0.0:
            low = middle
        else:
            high = middle
    value = 0.0
    for k in range(orders - 1, -1, -1):
        value = (value + slope[k] / (k + 1.0)) * low
    return at_0 + value


@njit(cache=True, nogil=True, error_model="numpy")
def _missed(series, slope, side, v, f, thresholds, off, own, window, orders, step):
    """Return what came within its error of an event inside a step, and the slider.

    A margin has an extremum inside a step where a mover's acceleration changes its sign, or where
    the velocities of the two neighbours of a resting slider cancel.
    """
    for i in range(window[0], window[1] + 1):
        if side[i] != 0.0:
            for k in range(orders - 1):
                slope[k] = (k + 1.0) * series[k + 1, i]
            if not side[i] * slope[0] < 0.0:
                continue
            lowest = side[i] * _extremum(slope, orders - 1, series[0, i])
            if lowest <= own + _spread(v, i):
                return _MISSED_STOP, i
        elif side[i - 1] != 0.0 and side[i + 1] != 0.0:
            begin = f[i, 0]
            for k in range(orders):
                slope[k] = step * (series[k, i - 1] + series[k, i + 1])
                begin -= slope[k] / (k + 1.0)
            way = 1.0 if slope[0] > 0.0 else -1.0
            room = thresholds[i] - way * _extremum(slope, orders, begin)
            if room <= own + _spread(f, i) + _spread(off, i):
                return _MISSED_START, i
    return _NONE, 0


@njit(cache=True, nogil=True)
def _close(gap, shift, before, own):
    """Return whether two events are closer to each other than their errors, but not one."""
    total = 0.0
    for p in range(1, _COLUMNS):
        total += (shift[p] - before[p]) ** 2
    return gap <= own + MARGIN * math.sqrt(total / PROBES)


@njit(cache=True, nogil=True)
def _slope(v, i):
    """Return how fast the force on a resting slider grows."""
    return v[i - 1, 0] + v[i + 1, 0]


@njit(cache=True, nogil=True)
def _acceleration(f, side, push, i):
    return f[i, 0] - push[0] * side[i] if side[i] != 0.0 else 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def _carried(rows, force, threshold, stiff, friction, weight, errors, rounding):
    """Carry `errors` of the displacements at the start through the events.

    `rounding` holds what is added on the way: `ROUNDING`, `BIAS` and `_CONSTANTS`, or zeros.

    Returns
    -------
    errors : ndarray, shape (n, PROBES)
        Of the displacements at the last event.
    doubt, slider : int
        Which comparison was decided by less than the errors, if any, and of which slider.
    """
    n = force.size
    step_error, drift, constants = rounding
    shape = (n + 2, _COLUMNS)  # a slider beyond each end that never moves
    x = np.zeros(shape)
    v = np.zeros(shape)
    f = np.zeros(shape)
    off = np.zeros(shape)  # errors of the thresholds
    late = np.zeros(shape)  # by how much the last stop of each slider is shifted
    side = np.zeros(n + 2)
    stiffness = np.zeros(n + 2)
    thresholds = np.zeros(n + 2)
    started = np.full(n + 2, -1.0)
    stopped = np.full(n + 2, -1.0)
    before = np.zeros(_COLUMNS)  # by how much the last event is shifted
    shift = np.zeros(_COLUMNS)
    push = np.zeros(_COLUMNS)
    series = np.zeros((_ORDERS, n + 2))
    slope = np.zeros(_ORDERS)
    word = np.uint64(0x9E3779B97F4A7C15)
    scale = friction
    push[0] = friction
    incline = np.zeros(_COLUMNS)
    cosine = np.zeros(_COLUMNS)
    bias = np.zeros((2, _COLUMNS))
    for p in range(1, _COLUMNS):
        word = _turned(word)
        push[p] = constants * friction * _sign(word, 0)
        incline[p] = constants * weight * _sign(word, 1)
        cosine[p] = constants * _sign(word, 2)
        bias[0, p] = drift * _sign(word, 3)
        bias[1, p] = drift * _sign(word, 4)
    for i in range(1, n + 1):
        f[i, 0] = force[i - 1]
        stiffness[i] = stiff[i - 1]
        thresholds[i] = threshold[i - 1]
        scale = max(scale, abs(f[i, 0]) + friction)
        word = _turned(word)
        for p in range(1, _COLUMNS):
            f[i, p] = incline[p] + constants * abs(f[i, 0]) * _sign(word, p)
            off[i, p] = push[p] + cosine[p] * (thresholds[i] - friction)
            off[i, p] += constants * thresholds[i] * _sign(word, p + 16)
    for i in range(1, n + 1):
        for p in range(1, _COLUMNS):
            _move(x, f, stiffness, i, p, errors[i - 1, p - 1])
    time = rows[0, 0]
    begin = 0
    while begin < rows.shape[0]:
        remaining = rows[begin, 0] - time
        gap = remaining
        time = rows[begin, 0]
        while remaining > 0.0:
            step = min(remaining, _LONGEST)
            remaining -= step
            first = 1
            while first <= n and side[first] == 0.0:
                first += 1
            last = n
            while last >= 1 and side[last] == 0.0:
                last -= 1
            if last < first:
                break
            window = (first, last)
            orders = _expand(series, x, v, f, push, bias, side, stiffness, window, step)
            for i in range(first - 1, last + 2):
                scale = max(scale, abs(f[i, 0]) + friction, abs(x[i, 0]), abs(v[i, 0]))
            own = 4.0 * step_error * scale  # of the comparisons themselves
            doubt, slider = _missed(
                series, slope, side, v, f, thresholds, off, own, window, orders, step
            )
            if doubt != _NONE:
                return x[1 : n + 1, 1:], doubt, slider - 1
            for i in range(first, last + 1):
                if side[i] != 0.0:
                    word = _turned(word)
                    for p in range(1, _COLUMNS):
                        v[i, p] += step_error * scale * _sign(word, p)
                        _move(x, f, stiffness, i, p, step_error * scale * _sign(word, p + 16))
        own = 4.0 * step_error * scale
        # the stops of this instant
        end = begin
        while end < rows.shape[0] and rows[end, 5] == rows[begin, 5] and rows[end, 1] != 0.0:
            i = int(rows[end, 2]) + 1
            slows = -side[i] * _acceleration(f, side, push, i)
            if started[i] != time:  # not a slip of length zero
                width = own + _spread(v, i)
                if slows <= 0.0 or slows * slows <= 4.0 * abs(_slope(v, i)) * width:
                    return x[1 : n + 1, 1:], _STOP, i - 1
                for p in range(1, _COLUMNS):
                    late[i, p] = side[i] * v[i, p] / slows
                    shift[p] = late[i, p]
                if _close(gap, shift, before, own / slows + 4.0 * step_error * time):
                    return x[1 : n + 1, 1:], _ORDER, i - 1
                for p in range(1, _COLUMNS):
                    _move(x, f, stiffness, i, p, 0.5 * v[i, p] * late[i, p])
            for p in range(_COLUMNS):
                v[i, p] = 0.0
            side[i] = 0.0
            stopped[i] = time
            thresholds[i] = rows[end, 4]
            word = _turned(word)
            for p in range(1, _COLUMNS):
                off[i, p] = push[p] + cosine[p] * (thresholds[i] - friction)
                off[i, p] += constants * thresholds[i] * _sign(word, p)
            end += 1
        for row in range(begin, end):
            i = int(rows[row, 2]) + 1
            way = rows[row, 3]
            # it starts the other way if it exceeds its threshold at the instant it stops
            for p in range(1, _COLUMNS):
                slope[p] = f[i, p] + _slope(v, i) * late[i, p]
            width = 0.0
            for p in range(1, _COLUMNS):
                width += slope[p] * slope[p]
            width = own + MARGIN * math.sqrt(width / PROBES) + _spread(off, i)
            if abs(-way * f[i, 0] - thresholds[i]) <= width:
                return x[1 : n + 1, 1:], _REVERSAL, i - 1
            # a neighbour that it no longer pulls on has come as close as it will
            for k in (i - 1, i + 1):
                if 1 <= k <= n and side[k] == 0.0 and way * _slope(v, k) <= 0.0:
                    width = own + _spread(f, k) + _spread(off, k)
                    if thresholds[k] - way * f[k, 0] <= width:
                        return x[1 : n + 1, 1:], _MISSED_START, k - 1
        # the starts of this instant
        starts = end
        while end < rows.shape[0] and rows[end, 0] == time and rows[end, 1] == 0.0:
            if rows[end, 5] > rows[begin, 5] + (starts > begin):
                break  # another event
            end += 1
        for row in range(starts, end):
            i = int(rows[row, 2]) + 1
            way = rows[row, 3]
            again = begin > 0 and stopped[i] == time
            # at its threshold by definition; an excess of zero must not become a negative one
            if (begin > 0 and not again) or abs(way * f[i, 0] - thresholds[i]) <= own:
                f[i, 0] = way * thresholds[i]
            gain = way * f[i, 0] - friction
            if again:
                for p in range(1, _COLUMNS):
                    v[i, p] = -way * gain * late[i, p]
            elif begin > 0:
                rate = way * _slope(v, i)
                bend = _acceleration(f, side, push, i - 1) + _acceleration(f, side, push, i + 1)
                width = own + _spread(f, i) + _spread(off, i)
                if rate <= 0.0 or rate * rate <= 4.0 * abs(bend) * width:
                    return x[1 : n + 1, 1:], _START, i - 1
                word = _turned(word)
                for p in range(1, _COLUMNS):
                    beyond = way * f[i, p] - off[i, p] + 2.0 * step_error * scale * _sign(word, p)
                    shift[p] = -beyond / rate
                    v[i, p] = -way * gain * shift[p]
                if _close(gap, shift, before, own / rate + 4.0 * step_error * time):
                    return x[1 : n + 1, 1:], _ORDER, i - 1
            side[i] = way
            started[i] = time
        before[:] = shift
        begin = end
    return x[1 : n + 1, 1:], _NONE, 0
