"""Rows of the tables of rearrangements and slips, as the loop of `loop` makes them.

Elastic energy is known without tensions. A ramp by d of ``l0 theta`` lowers every tension by d: the
energy falls by d times the mean, before and after, of their sum. In a rearrangement it is a
quadratic function of the displacements whose gradient is minus the elastic forces: it changes by
minus the sum of displacements times the mean of these forces before and after. Friction takes
``mu_d cos(alpha)`` times the path of every slip, gravity gives ``sin(alpha)`` times every
displacement: that both add up to the change of elastic energy shows that each slip ended at rest.
"""

from __future__ import annotations

import math

from exactcreep.solvers.exact.layout import (
    AT_LOAD,
    AT_LOAD_LOW,
    COEFFICIENT,
    CONSTANT,
    ELASTIC,
    FORCE,
    FORCE_LOW,
    FRICTION,
    LARGEST,
    LEFT_FOR,
    LOGGING,
    LOGS_REARRANGEMENTS,
    LOGS_SLIPS,
    MEAN,
    MOVERS,
    NUMBER,
    PAD,
    PATH,
    R_AFTER,
    R_BEFORE,
    R_BEGAN,
    R_BEGAN_FIRST,
    R_BEGAN_LAST,
    R_DIRECTION,
    R_DISPLACEMENT,
    R_DISSIPATION,
    R_DURATION,
    R_EVENTS,
    R_FIRST,
    R_GRAVITY,
    R_HALF_CYCLE,
    R_LARGEST,
    R_LAST,
    R_LOAD,
    R_SLIDERS,
    R_SLIPS,
    R_UNDECIDED,
    REARRANGEMENTS,
    REST,
    S_COEFFICIENT,
    S_DISPLACEMENT,
    S_REARRANGEMENT,
    S_SLIDER,
    S_START,
    S_STOP,
    SINE,
    SLIP_TOTAL,
    SLIPS_BEFORE,
    STARTED,
    STARTED_FIRST,
    STARTED_LAST,
    STIFFNESS,
    T_REARRANGEMENT,
    T_TIME,
    T_X,
    TARGET,
    TENSIONS,
    THETA,
    THETA_LOW,
    TIME,
    TOUCHED_FIRST,
    TOUCHED_LAST,
    UNDECIDED,
    UNDECIDED_BEFORE,
    WAY,
    N,
    X,
    inlined,
)
from exactcreep.solvers.exact.two_floats import plus

_BOUNDLESS = 2**60
_LEAST_FRESH = 64
"""Rearrangements, at least, until the elastic energy is summed anew: its rounding grows no more."""


@inlined
def room(tables):
    """Return how many more rearrangements, or slips, can be written."""
    if tables is None:  # here and below: known when this is compiled
        return _BOUNDLESS
    left = tables.rearrangements.shape[1] - tables.used[0]
    return min(left, tables.slips.shape[1] - tables.used[1])


@inlined
def at_theta(cell, real, whole, tables):
    """Take the elastic energy and the sum of the tensions to the present theta, at rest."""
    if tables is None:
        return
    sums = tables.sums
    n = whole[N]
    if sums[LEFT_FOR] > 0.0:
        sums[LEFT_FOR] -= 1.0
        step = (real[THETA] - sums[AT_LOAD]) + (real[THETA_LOW] - sums[AT_LOAD_LOW])
        tensions = sums[TENSIONS] - (n - 1) * step
        sums[ELASTIC] -= 0.5 * step * (sums[TENSIONS] + tensions)
        sums[TENSIONS] = tensions
    else:
        sums[LEFT_FOR] = max(_LEAST_FRESH, n)
        energy = 0.0
        tensions = 0.0
        high, low = -real[THETA], -real[THETA_LOW]
        for i in range(PAD, PAD + n - 1):
            high, low = plus(high, low + cell[FORCE_LOW, i], cell[FORCE, i])
            high, low = plus(high, low, -real[SINE])
            tensions += high
            energy += 0.5 * high * high
        sums[ELASTIC] = energy
        sums[TENSIONS] = tensions
    sums[AT_LOAD] = real[THETA]
    sums[AT_LOAD_LOW] = real[THETA_LOW]


@inlined
def begin(cell, real, whole, tables, way):
    """Begin a rearrangement after a ramp in direction `way`, 0 if there was none."""
    if tables is None:
        return
    sums = tables.sums
    at_theta(cell, real, whole, tables)
    sums[WAY] = way
    sums[STARTED] = 0.0
    sums[STARTED_FIRST] = math.inf
    sums[STARTED_LAST] = 0.0
    sums[MOVERS] = 0.0
    sums[PATH] = 0.0
    sums[LARGEST] = 0.0


@inlined
def start(cell, real, whole, tables, i):
    """Begin a slip of the slider in column i."""
    if tables is None:
        return
    track, sums = tables.track, tables.sums
    track[T_TIME, i] = real[TIME]
    track[T_X, i] = cell[X, i]
    if track[T_REARRANGEMENT, i] != whole[REARRANGEMENTS]:
        track[T_REARRANGEMENT, i] = whole[REARRANGEMENTS]
        sums[MOVERS] += 1.0
    if whole[NUMBER] == 0:
        slider = i + 1 - PAD
        sums[STARTED] += 1.0
        sums[STARTED_FIRST] = min(sums[STARTED_FIRST], slider)
        sums[STARTED_LAST] = max(sums[STARTED_LAST], slider)


@inlined
def _slip(cell, real, whole, tables, i, number, began, ended, displacement):
    """Write a slip of rearrangement `number`, after which the slider has drawn anew."""
    if whole[LOGGING] & LOGS_SLIPS != 0:
        table, row = tables.slips, tables.used[1]
        table[S_SLIDER, row] = i + 1 - PAD
        table[S_REARRANGEMENT, row] = number
        table[S_START, row] = began
        table[S_STOP, row] = ended
        table[S_DISPLACEMENT, row] = displacement
        table[S_COEFFICIENT, row] = real[MEAN] if whole[CONSTANT] == 1 else cell[COEFFICIENT, i]
        tables.used[1] = row + 1


@inlined
def stop(cell, real, whole, tables, i):
    """End the slip of the slider in column i, which has drawn anew."""
    if tables is None:
        return
    track, sums = tables.track, tables.sums
    displacement = cell[X, i] - track[T_X, i]
    length = abs(displacement)
    sums[PATH] += length
    sums[LARGEST] = max(sums[LARGEST], length)
    number = whole[REARRANGEMENTS] - 1
    _slip(cell, real, whole, tables, i, number, track[T_TIME, i], real[TIME], displacement)


@inlined
def _row(real, whole, tables, slips, events, duration, first, last, moved, gained):
    """Write the rearrangement under way, of the sliders in columns `first` .. `last`."""
    sums = tables.sums
    before = sums[ELASTIC]
    sums[ELASTIC] = before + gained
    if whole[LOGGING] & LOGS_REARRANGEMENTS != 0:
        table, row = tables.rearrangements, tables.used[0]
        table[R_HALF_CYCLE, row] = whole[TARGET]
        table[R_LOAD, row] = real[THETA] + real[THETA_LOW]
        table[R_DIRECTION, row] = sums[WAY]
        table[R_BEGAN, row] = sums[STARTED]
        table[R_BEGAN_FIRST, row] = sums[STARTED_FIRST]
        table[R_BEGAN_LAST, row] = sums[STARTED_LAST]
        table[R_DURATION, row] = duration
        table[R_EVENTS, row] = events
        table[R_SLIPS, row] = slips
        table[R_SLIDERS, row] = sums[MOVERS]
        table[R_FIRST, row] = first + 1 - PAD
        table[R_LAST, row] = last + 1 - PAD
        table[R_DISPLACEMENT, row] = moved / whole[N]
        table[R_LARGEST, row] = sums[LARGEST]
        table[R_BEFORE, row] = before
        table[R_AFTER, row] = sums[ELASTIC]
        table[R_GRAVITY, row] = real[SINE] * moved
        table[R_DISSIPATION, row] = real[FRICTION] * sums[PATH]
        table[R_UNDECIDED, row] = whole[UNDECIDED] - sums[UNDECIDED_BEFORE]
        tables.used[0] = row + 1
    sums[UNDECIDED_BEFORE] = whole[UNDECIDED]


@inlined
def end(cell, real, whole, tables):
    """End a rearrangement whose displacements have not become forces at rest yet."""
    if tables is None:
        return
    sums = tables.sums
    first, last = whole[TOUCHED_FIRST], whole[TOUCHED_LAST]
    moved = 0.0
    gained = 0.0
    for i in range(first, last + 1):
        x = cell[X, i]
        around = cell[X, i - 1] + cell[X, i + 1]
        elastic = cell[REST, i] - real[SINE]
        gained -= x * (elastic + 0.5 * (around - cell[STIFFNESS, i] * x))
        moved += x
    sums[TENSIONS] += cell[X, PAD + whole[N] - 1] - cell[X, PAD]
    slips = whole[SLIP_TOTAL] - sums[SLIPS_BEFORE]
    sums[SLIPS_BEFORE] = whole[SLIP_TOTAL]
    _row(real, whole, tables, slips, whole[NUMBER], real[TIME], first, last, moved, gained)


@inlined
def end_slip(cell, real, whole, tables, i, way, moved):
    """Write a rearrangement that is one slip, by `moved`, of the end slider in column i.

    It is not counted yet, and its slider has drawn anew.
    """
    if tables is None:
        return
    sums = tables.sums
    length = abs(moved)
    sums[WAY] = way
    sums[STARTED] = 1.0
    sums[STARTED_FIRST] = sums[STARTED_LAST] = i + 1 - PAD
    sums[MOVERS] = 1.0
    sums[PATH] = sums[LARGEST] = length
    sums[SLIPS_BEFORE] += 1.0
    sums[TENSIONS] += moved if i > PAD else -moved
    # from its threshold against friction, by twice the excess: what friction and gravity leave
    gained = real[SINE] * moved - real[FRICTION] * length
    duration = math.pi if length > 0.0 else 0.0
    _slip(cell, real, whole, tables, i, whole[REARRANGEMENTS], 0.0, duration, moved)
    _row(real, whole, tables, 1, 2, duration, i, i, moved, gained)
