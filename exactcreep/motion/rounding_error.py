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

Source: Eqs. (dynamic_eq1)-(static_eqN); the rules are checked in
tests/motion/test_rounding_error.py.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exactcreep.compiling import njit
from exactcreep.model.chain import Chain
from exactcreep.model.contacts import Contacts, Event, EventKind
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


class RoundingError(NamedTuple):
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


def rounding_error(
    chain: Chain, initial: State, events: Sequence[Event], *, seed: int = 0
) -> RoundingError:
    """Return an estimate of what rounding in float64 has done to a rearrangement.

    Parameters
    ----------
    chain : Chain
    initial : State
        At rest, at theta_c.
    events : sequence of Event
    seed : int
        Keys the coefficients that were drawn at stops.

    Guarantee: none but the same bits for the same arguments; an estimate to first order in the
    errors, with the rounding that was measured, not bounded.
    """
    if not events:
        return RoundingError(0.0, "")
    none = np.zeros((chain.n, PROBES))
    rounding = (ROUNDING, BIAS, _CONSTANTS)
    errors, doubt = propagated(chain, initial, events, seed, none, rounding)
    if doubt:
        return RoundingError(math.inf, doubt)
    spread = np.sqrt(np.mean(errors**2, axis=1))
    stretched = np.sqrt(np.mean(np.diff(errors, axis=0) ** 2, axis=1))
    return RoundingError(MARGIN * float(max(spread.max(), stretched.max(initial=0.0))), "")


def propagated(
    chain: Chain,
    initial: State,
    events: Sequence[Event],
    seed: int,
    errors: NDArray[np.float64],
    rounding: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> tuple[NDArray[np.float64], str]:
    """Return what errors of the displacements have become, and which comparison is in doubt.

    Parameters
    ----------
    chain, initial, events, seed
        As in `rounding_error`.
    errors : ndarray, shape (n, PROBES)
        Before the first event, in the units of the model. The sliders of the first event start
        nevertheless when they do.
    rounding : tuple of float
        What is added on the way: `ROUNDING`, `BIAS` and `_CONSTANTS`, or nothing.

    Guarantee: without rounding the tangent map of the rearrangement with this order of events, to
    about 1e-13 relative.
    """
    # only the sliders of the events and their neighbours take part
    touched = [n - 1 for event in events for n in event.sliders]
    first, last = max(min(touched) - 1, 0), min(max(touched) + 1, chain.n - 1)
    window = slice(first, last + 1)
    stiffness = np.full(last - first + 1, 2.0)
    stiffness[0] -= first == 0
    stiffness[-1] -= last == chain.n - 1
    contacts = Contacts(chain, seed)
    coefficients = initial.coefficients[window].astype(np.float64)
    after = errors.copy()
    after[window], doubt, slider = _propagate(
        _rows(contacts, initial, events, first),
        forces_of(FLOAT64, initial.tensions.astype(np.float64), chain.sin_alpha)[window],
        chain.friction + contacts.excesses(coefficients),
        stiffness, chain.friction, abs(chain.sin_alpha), errors[window], rounding,
    )  # fmt: skip
    return after, _DOUBTS[doubt].format(slider + first + 1) if doubt != _NONE else ""


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


class _Motion(NamedTuple):
    """The motion (column 0) and the errors beside it; a slider stands beyond each end at rest."""

    x: NDArray[np.float64]  # displacements, velocities and forces, shape (n + 2, _COLUMNS)
    v: NDArray[np.float64]
    f: NDArray[np.float64]
    off: NDArray[np.float64]  # errors of the thresholds
    late: NDArray[np.float64]  # by how much the last stop of each slider is shifted
    side: NDArray[np.float64]  # direction of motion, 0 at rest, shape (n + 2,)
    stiffness: NDArray[np.float64]
    thresholds: NDArray[np.float64]
    started: NDArray[np.float64]  # when each slider last did
    stopped: NDArray[np.float64]
    push: NDArray[np.float64]  # dynamical friction and cos(alpha), shape (_COLUMNS,)
    cosine: NDArray[np.float64]
    before: NDArray[np.float64]  # by how much the last event is shifted
    shift: NDArray[np.float64]
    bias: NDArray[np.float64]  # of every step, for velocities and displacements
    series: NDArray[np.float64]  # of the velocities in the present step
    slope: NDArray[np.float64]  # room for one slider's
    scale: NDArray[np.float64]  # one number: the largest force or displacement so far
    word: NDArray[np.uint64]  # one number: the generator of signs


@njit(cache=True, nogil=True)
def _turn(m):
    """Return the next word of the generator of signs (Marsaglia's xorshift)."""
    word = m.word[0]
    word ^= word << np.uint64(13)
    word ^= word >> np.uint64(7)
    word ^= word << np.uint64(17)
    m.word[0] = word
    return word


@njit(cache=True, nogil=True)
def _sign(word, p):
    return 1.0 if (word >> np.uint64(p)) & np.uint64(1) else -1.0


@njit(cache=True, nogil=True)
def _signs(word, first):
    """Return a sign for each set of errors, and 0 for the motion itself."""
    signs = np.zeros(_COLUMNS)
    for p in range(1, _COLUMNS):
        signs[p] = _sign(word, p + first)
    return signs


@njit(cache=True, nogil=True)
def _spread(errors):
    """Return `MARGIN` times the root mean square of errors."""
    total = 0.0
    for p in range(1, _COLUMNS):
        total += errors[p] * errors[p]
    return MARGIN * math.sqrt(total / PROBES)


@njit(cache=True, nogil=True)
def _move(m, i, lengths):
    """Move slider i, and change the forces accordingly."""
    for p in range(_COLUMNS):
        m.x[i, p] += lengths[p]
        m.f[i - 1, p] += lengths[p]
        m.f[i, p] -= m.stiffness[i] * lengths[p]
        m.f[i + 1, p] += lengths[p]


@njit(cache=True, nogil=True)
def _yield_at(m, i, threshold, constants, word, first):
    """Give slider i a threshold, which is off by the rounding of the constants."""
    m.thresholds[i] = threshold
    off = m.push + m.cosine * (threshold - m.push[0])
    m.off[i, 1:] = (off + constants * threshold * _signs(word, first))[1:]


@njit(cache=True, nogil=True, error_model="numpy")
def _expand(m, first, last, step):
    """Let `step` pass without rounding; return how many orders the series has."""
    series, v, f, push, side = m.series, m.v, m.f, m.push, m.side
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
                    turned = now[j - 1, p] + now[j + 1, p] - m.stiffness[i] * now[j, p]
                    third[j, p] = ratio * turned
                    v[i, p] += third[j, p]
                    length[j, p] += third[j, p] / (k + 1.0)
            series[k, i] = third[j, 0]
        now, after, third = after, third, now
        orders += 1
    for i in range(first, last + 1):
        if side[i] != 0.0:
            j = i - first + 1
            v[i] += m.bias[0] * v[i, 0]
            _move(m, i, step * (length[j] + m.bias[1] * length[j, 0]))
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
def _missed(m, own, first, last, orders, step):
    """Return what came within its error of an event inside a step, and the slider.

    A margin has an extremum inside a step where a mover's acceleration changes its sign, or where
    the velocities of the two neighbours of a resting slider cancel.
    """
    series, slope, side = m.series, m.slope, m.side
    for i in range(first, last + 1):
        if side[i] != 0.0:
            for k in range(orders - 1):
                slope[k] = (k + 1.0) * series[k + 1, i]
            if not side[i] * slope[0] < 0.0:
                continue
            lowest = side[i] * _extremum(slope, orders - 1, series[0, i])
            if lowest <= own + _spread(m.v[i]):
                return _MISSED_STOP, i
        elif side[i - 1] != 0.0 and side[i + 1] != 0.0:
            begin = m.f[i, 0]
            for k in range(orders):
                slope[k] = step * (series[k, i - 1] + series[k, i + 1])
                begin -= slope[k] / (k + 1.0)
            way = 1.0 if slope[0] > 0.0 else -1.0
            room = m.thresholds[i] - way * _extremum(slope, orders, begin)
            if room <= own + _spread(m.f[i]) + _spread(m.off[i]):
                return _MISSED_START, i
    return _NONE, 0


@njit(cache=True, nogil=True)
def _close(m, gap, own):
    """Return whether two events are closer to each other than their errors, but not one."""
    return gap <= own + _spread(m.shift - m.before)


@njit(cache=True, nogil=True)
def _slope(m, i):
    """Return how fast the force on a resting slider grows."""
    return m.v[i - 1, 0] + m.v[i + 1, 0]


@njit(cache=True, nogil=True)
def _acceleration(m, i):
    return m.f[i, 0] - m.push[0] * m.side[i] if m.side[i] != 0.0 else 0.0


@njit(cache=True, nogil=True)
def _begin(force, threshold, stiff, friction, weight, errors, rounding):
    """Return the chain at rest, its displacements and the constants of the model being off."""
    n = force.size
    _, drift, constants = rounding
    shape = (n + 2, _COLUMNS)
    m = _Motion(
        np.zeros(shape), np.zeros(shape), np.zeros(shape), np.zeros(shape), np.zeros(shape),
        np.zeros(n + 2), np.zeros(n + 2), np.zeros(n + 2), np.full(n + 2, -1.0),
        np.full(n + 2, -1.0), np.zeros(_COLUMNS), np.zeros(_COLUMNS), np.zeros(_COLUMNS),
        np.zeros(_COLUMNS), np.zeros((2, _COLUMNS)), np.zeros((_ORDERS, n + 2)),
        np.zeros(_ORDERS), np.full(1, friction), np.full(1, np.uint64(0x9E3779B97F4A7C15)),
    )  # fmt: skip
    incline = np.zeros(_COLUMNS)
    m.push[0] = friction
    for p in range(1, _COLUMNS):
        word = _turn(m)
        m.push[p] = constants * friction * _sign(word, 0)
        incline[p] = constants * weight * _sign(word, 1)
        m.cosine[p] = constants * _sign(word, 2)
        m.bias[0, p] = drift * _sign(word, 3)
        m.bias[1, p] = drift * _sign(word, 4)
    for i in range(1, n + 1):
        m.f[i, 0] = force[i - 1]
        m.stiffness[i] = stiff[i - 1]
        m.scale[0] = max(m.scale[0], abs(m.f[i, 0]) + friction)
        word = _turn(m)
        m.f[i] += incline + constants * abs(m.f[i, 0]) * _signs(word, 0)
        _yield_at(m, i, threshold[i - 1], constants, word, 16)
    lengths = np.zeros(_COLUMNS)
    for i in range(1, n + 1):
        lengths[1:] = errors[i - 1]
        _move(m, i, lengths)
    return m


@njit(cache=True, nogil=True, error_model="numpy")
def _pass(m, remaining, step_error):
    """Let time pass until the next event; return what came within its error of one before."""
    n = m.side.size - 2
    while remaining > 0.0:
        step = min(remaining, _LONGEST)
        remaining -= step
        first = 1
        while first <= n and m.side[first] == 0.0:
            first += 1
        last = n
        while last >= 1 and m.side[last] == 0.0:
            last -= 1
        if last < first:
            break
        orders = _expand(m, first, last, step)
        scale = m.scale[0]
        for i in range(first - 1, last + 2):
            scale = max(scale, abs(m.f[i, 0]) + m.push[0], abs(m.x[i, 0]), abs(m.v[i, 0]))
        m.scale[0] = scale
        own = 4.0 * step_error * scale  # of the comparisons themselves
        doubt, i = _missed(m, own, first, last, orders, step)
        if doubt != _NONE:
            return doubt, i
        for i in range(first, last + 1):
            if m.side[i] != 0.0:
                word = _turn(m)
                m.v[i] += step_error * scale * _signs(word, 0)
                _move(m, i, step_error * scale * _signs(word, 16))
    return _NONE, 0


@njit(cache=True, nogil=True, error_model="numpy")
def _stop(m, i, time, gap, threshold, own, rounding):
    """Bring slider i to rest, and give it its next threshold; return what is in doubt."""
    slows = -m.side[i] * _acceleration(m, i)
    if m.started[i] != time:  # not a slip of length zero
        width = own + _spread(m.v[i])
        if slows <= 0.0 or slows * slows <= 4.0 * abs(_slope(m, i)) * width:
            return _STOP
        m.late[i, 1:] = m.side[i] * m.v[i, 1:] / slows
        m.shift[:] = m.late[i]
        if _close(m, gap, own / slows + 4.0 * rounding[0] * time):
            return _ORDER
        _move(m, i, 0.5 * m.v[i] * m.late[i])
    m.v[i] = 0.0
    m.side[i] = 0.0
    m.stopped[i] = time
    _yield_at(m, i, threshold, rounding[2], _turn(m), 0)
    return _NONE


@njit(cache=True, nogil=True)
def _beside(m, i, way, own):
    """Return what is in doubt about the rest of slider i, which has stopped, and its neighbours."""
    # it starts the other way if it exceeds its threshold at the instant it stops
    width = own + _spread(m.f[i] + _slope(m, i) * m.late[i]) + _spread(m.off[i])
    if abs(-way * m.f[i, 0] - m.thresholds[i]) <= width:
        return _REVERSAL, i
    # a neighbour that it no longer pulls on has come as close as it will
    for k in (i - 1, i + 1):
        if 1 <= k <= m.side.size - 2 and m.side[k] == 0.0 and way * _slope(m, k) <= 0.0:
            width = own + _spread(m.f[k]) + _spread(m.off[k])
            if m.thresholds[k] - way * m.f[k, 0] <= width:
                return _MISSED_START, k
    return _NONE, 0


@njit(cache=True, nogil=True, error_model="numpy")
def _start(m, i, way, time, gap, own, step_error, begins):
    """Set slider i in motion; return what is in doubt. `begins`: nothing has moved before."""
    again = not begins and m.stopped[i] == time
    # at its threshold by definition; an excess of zero must not become a negative one
    at_threshold = not begins and not again
    if at_threshold or abs(way * m.f[i, 0] - m.thresholds[i]) <= own:
        m.f[i, 0] = way * m.thresholds[i]
    gain = way * m.f[i, 0] - m.push[0]
    if again:
        m.v[i, 1:] = -way * gain * m.late[i, 1:]
    elif not begins:
        rate = way * _slope(m, i)
        bend = _acceleration(m, i - 1) + _acceleration(m, i + 1)
        width = own + _spread(m.f[i]) + _spread(m.off[i])
        if rate <= 0.0 or rate * rate <= 4.0 * abs(bend) * width:
            return _START
        word = _turn(m)
        beyond = way * m.f[i] - m.off[i]
        beyond += 2.0 * step_error * m.scale[0] * _signs(word, 0)
        m.shift[1:] = -beyond[1:] / rate
        m.v[i, 1:] = -way * gain * m.shift[1:]
        if _close(m, gap, own / rate + 4.0 * step_error * time):
            return _ORDER
    m.side[i] = way
    m.started[i] = time
    return _NONE


@njit(cache=True, nogil=True, error_model="numpy")
def _happen(m, rows, begin, gap, rounding):
    """Let the stops and starts of an instant happen; return what is in doubt, and the next row."""
    time, count = rows[begin, 0], rows.shape[0]
    own = 4.0 * rounding[0] * m.scale[0]
    end = begin
    while end < count and rows[end, 5] == rows[begin, 5] and rows[end, 1] != 0.0:
        i = int(rows[end, 2]) + 1
        doubt = _stop(m, i, time, gap, rows[end, 4], own, rounding)
        if doubt != _NONE:
            return doubt, i, end
        end += 1
    for row in range(begin, end):
        doubt, i = _beside(m, int(rows[row, 2]) + 1, rows[row, 3], own)
        if doubt != _NONE:
            return doubt, i, end
    starts = end
    while end < count and rows[end, 0] == time and rows[end, 1] == 0.0:
        if rows[end, 5] > rows[begin, 5] + (starts > begin):
            break  # another event
        end += 1
    for row in range(starts, end):
        i = int(rows[row, 2]) + 1
        doubt = _start(m, i, rows[row, 3], time, gap, own, rounding[0], begin == 0)
        if doubt != _NONE:
            return doubt, i, end
    m.before[:] = m.shift
    return _NONE, 0, end


@njit(cache=True, nogil=True)
def _propagate(rows, force, threshold, stiff, friction, weight, errors, rounding):
    """Carry `errors` of the displacements at the start through the events; see `propagated`.

    Returns
    -------
    errors : ndarray, shape (n, PROBES)
        Of the displacements at the last event.
    doubt, slider : int
        Which comparison was decided by less than the errors, if any, and of which slider.
    """
    m = _begin(force, threshold, stiff, friction, weight, errors, rounding)
    time = rows[0, 0]
    begin, doubt, i = 0, _NONE, 0
    while begin < rows.shape[0] and doubt == _NONE:
        gap = rows[begin, 0] - time
        time = rows[begin, 0]
        doubt, i = _pass(m, gap, rounding[0])
        if doubt == _NONE:
            doubt, i, begin = _happen(m, rows, begin, gap, rounding)
    return m.x[1:-1, 1:], doubt, i - 1
