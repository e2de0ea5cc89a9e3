"""Prove in float64 which event comes first in all states of a set, and enclose it in balls.

The speeds of moving sliders and the distances of their neighbours from the threshold are
polynomials of `taylor_flow`, with a bound of the differences between states. Balls enclose the
event by one evaluation of the modes nearby and a Taylor series from there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import accumulate, pairwise
from operator import mul
from typing import Any

import flint
import numpy as np

from exactcreep.compiling import njit
from exactcreep.motion.modes import Flow, Run
from exactcreep.motion.taylor_flow import (
    ORDER,
    OUTWARD,
    ROUNDING,
    STEP,
    carry,
    expand,
    size_of,
)

MOST_STEPS = 64
"""Most steps of one search; a set without event within 32 tau_dyn is left to other methods."""
MOST_EVALUATIONS = 60
"""Most evaluations of one function in one step."""
NEAREST = 2.0**-8
"""Largest half width of a bracket for which balls use a Taylor series; in a wider bracket the
series has too many terms."""


@njit(cache=True, error_model="numpy")
def first_event_of_set(
    springs: Any, signs: Any, fresh: Any, numbers: Any, thresholds: Any, unsure: float, last: int
) -> tuple[int, int, float, float]:
    """Return slider, side, time and largest error of the event that is proved to be first.

    `springs`, `signs` (ndarray of int, shape (n,)): number of springs and direction of motion of
    each slider; `fresh` (ndarray of bool, shape (n,)): sliders that have just started, with
    velocity exactly zero; `numbers` (ndarray, shape (3, n)): velocities and accelerations, both
    zero at rest, and forces; `thresholds` (ndarray, shape (n,)): of resting sliders; `unsure`:
    largest difference of any of these numbers between states of the set; `last`: sliders from here
    on mirror others, and are not watched. The side is 0 for a stop, else the direction of a start.
    The slider is -1 if float64 does not prove which event is first.
    """
    n = len(signs)
    v, a, pull = numbers[0].copy().reshape(n, 1), numbers[1].copy().reshape(n, 1), numbers[2].copy()
    series, poly = np.empty((ORDER + 1, n, 1)), np.zeros(ORDER + 2)
    nothing = (-1, 0, 0.0, 0.0)
    root = math.sqrt(np.count_nonzero(signs))
    away, time = root * unsure, 0.0
    for step in range(MOST_STEPS):
        rounding = ROUNDING * size_of(v[:, 0], a[:, 0])
        error = 8 * (away * (1 + time + STEP) ** 2 + rounding) + 2 * unsure
        expand(series, springs, signs, v, a)
        slider, side, low, high = -1, 0, math.inf, math.inf
        for i in range(last):
            for way in (0, 1, -1):
                if not _event_function(poly, series, signs, i, way, thresholds[i] - way * pull[i]):
                    continue
                started = way == 0 and step == 0 and fresh[i]
                begin, end = _root(poly, error, min(STEP, high), started)
                if begin < 0:
                    return nothing
                if end < low:
                    slider, side, low, high = i, way, begin, end
                elif begin < math.inf and not begin > high:
                    return nothing
        if slider >= 0:
            half = (high - low) / 2 * (1 + OUTWARD) + 2.0**-50 * (1 + time)
            return slider, side, time + (low + high) / 2, half
        x = carry(series, v, a, STEP)
        for i in range(n):
            if signs[i] == 0:
                if i > 0:
                    pull[i] += x[i - 1, 0]
                if i < n - 1:
                    pull[i] += x[i + 1, 0]
        away += 2 * root * rounding
        time += STEP
    return nothing


@njit(cache=True)
def _event_function(poly: Any, series: Any, signs: Any, i: int, way: int, room: float) -> bool:
    """Fill in a function that is positive until slider i acts; return whether it can act.

    It is the speed (`way` 0), or the distance to a start in the direction `way`, now `room`.
    """
    before, after = i > 0 and signs[i - 1] != 0, i < len(signs) - 1 and signs[i + 1] != 0
    if (way == 0) != (signs[i] != 0) or (way != 0 and not (before or after)):
        return False
    if way == 0:
        for k in range(ORDER + 1):
            poly[k] = signs[i] * series[k, i, 0]
        poly[ORDER + 1] = 0.0
        return True
    poly[0] = room
    for k in range(ORDER + 1):
        rate = 0.0
        if before:
            rate += series[k, i - 1, 0]
        if after:
            rate += series[k, i + 1, 0]
        poly[k + 1] = -way * rate / (k + 1)
    return True


@njit(cache=True)
def _value(poly: Any, t: float) -> tuple[float, float]:
    value, slope = 0.0, 0.0
    for k in range(ORDER + 1, -1, -1):
        slope = slope * t + value
        value = value * t + poly[k]
    return value, slope


@njit(cache=True, error_model="numpy")
def _root(poly: Any, error: float, limit: float, fresh: bool) -> Any:
    """Return an interval that contains the first root.

    ``(inf, inf)``: no root up to `limit`; ``(-1, 0)``: not proved. Value, slope and second
    derivative of every state's function are within `error` of the polynomial's.
    """
    bound, power = error, 1.0
    for k in range(2, ORDER + 2):
        bound += k * (k - 1) * abs(poly[k]) * power
        power *= STEP
    bound *= 1 + OUTWARD
    t = 0.0
    if fresh:  # value zero, slope at least this: positive until 2 slope / bound
        slope = poly[1] - error
        if not slope > 0:
            return -1.0, 0.0
        t = 2 * slope / bound * (1 - OUTWARD)
    for _ in range(MOST_EVALUATIONS):
        if t > limit:
            return math.inf, math.inf
        value, slope = _value(poly, t)
        steep, most = slope + error, value + error
        if steep < 0 and 4 * most * bound * (1 + OUTWARD) <= steep * steep:
            if most < 0:
                return -1.0, 0.0
            far = t - 2 * most / steep * (1 + OUTWARD)
            if far <= STEP:  # the only root lies before, and the slope is at most steep / 2 there
                return _narrowed(poly, error, t, far, steep)
        least, slope = value - error, slope - error
        if not least > 0:
            return -1.0, 0.0
        reach = math.sqrt(slope * slope + 2 * least * bound)
        step = 2 * least / (reach - slope) if slope < 0 else (slope + reach) / bound
        t += step * (1 - OUTWARD)
    return -1.0, 0.0


@njit(cache=True)
def _narrowed(poly: Any, error: float, begin: float, end: float, steep: float) -> Any:
    t = begin
    for _ in range(6):
        value, slope = _value(poly, t)
        if not slope < 0:
            break
        t = min(max(t - value / slope, begin), end)
    value, _ = _value(poly, t)
    away = 2 * (abs(value) + error) / -steep * (1 + OUTWARD)
    return max(begin, t - away), min(end, t + away)


def enclosed_event(
    runs: Sequence[Run], acting: tuple[int, int], room: Any, time: float, radius: float
) -> tuple[Any, list[tuple[int, list[Any], list[Any]]]] | None:
    """Return the time of an event, and first slider, displacements, velocities of every run then.

    The result is in balls; None if the slope is not separated from zero. Derivatives v^(k) have a
    norm of at most ``2^k (|v| + |a| / 2)`` with v and a of the same time; at a distance d in time,
    these two are at most ``|v| + d |a|`` and ``|a| + 2 |v|``, with the present v and a. This bounds
    the remainder of the Taylor series.

    `acting`: the slider (from 0), and 0 for a stop or the direction of its start; `room`: initial
    distance of a starting slider from its threshold; `time`, `radius`: the event's function must
    have exactly one root between ``time - radius`` and ``time + radius`` (else `AssertionError`).
    """
    if not radius < NEAREST:
        return None
    slider, side = acting
    bits = runs[0].arithmetic.bits
    order = math.ceil(bits / -math.log2(2 * radius)) + 1
    at = flint.arb(time)
    series = [(run, _derivatives(run, at, order)) for run in runs]
    # within the radius |v| + |a| / 2 at most doubles
    size = sum(float(abs(x)) for _, rows in series for row in rows[1:3] for x in row)
    # remainder after v^(order), in displacements and velocities, and in accelerations
    bound = flint.arb(4 * (1 + size)) * (2 * flint.arb(radius)) ** order
    rest = flint.arb(0, bound / math.factorial(order))
    function = [room if side else flint.arb(0)] + [flint.arb(0)] * order
    for run, rows in series:
        if side == 0 and slider in run.sliders:
            function = [row[slider - run.first] for row in rows[1:]]
        for n in (slider - 1, slider + 1):
            if side and n in run.sliders:
                i = n - run.first
                function = [f - side * row[i] for f, row in zip(function, rows, strict=False)]
    factorials = accumulate(range(1, order + 1), mul, initial=1)
    poly = flint.arb_poly([x / k for x, k in zip(function, factorials, strict=True)])
    rate = poly.derivative()
    between = flint.arb(0, radius)
    slope = rate(between) + rest * order / flint.arb(radius)
    if slope.contains(0):
        return None
    near = _newton(poly, rate, bits, radius)
    root = near - (poly(near) + rest) / slope
    if not root.overlaps(between):
        raise AssertionError("the enclosure of an event does not hold a state of the set")
    powers = [flint.arb(1)]
    for k in range(1, order + 1):
        powers.append(powers[-1] * root / k)
    across = flint.arb_mat(1, order + 1, powers)
    shifts = []
    for run, rows in series:
        p = run.p
        both = flint.arb_mat([now + after for now, after in pairwise(rows)])
        moved = [x + rest for x in (across * both).entries()]
        shifts.append((run.first, moved[:p], moved[p:]))
    return at + root, shifts


def lone_event(
    flow: Flow, n: int, acting: tuple[int, int], room: Any
) -> tuple[Any, list[tuple[int, list[Any], list[Any]]]]:
    """Return what `enclosed_event` returns, by the energy of slider `n` (from 0) that moves alone.

    After a displacement x its squared speed is ``v^2 + 2 a x - w^2 x^2``.
    """
    arithmetic, way, (_, side) = flow.arithmetic, int(flow.signs[n]), acting
    speed, pull = way * flow.velocities[n], way * flow.forces[n] - flow.friction[n]
    w2 = sum(0 <= m < len(flow.signs) for m in (n - 1, n + 1))
    root = pull if speed == 0 else arithmetic.sqrt(pull * pull + w2 * speed * speed)
    ahead, behind, w = (pull + root) / w2, (pull - root) / w2, flint.arb(w2).sqrt()
    moved, left, phase = ahead, flint.arb(0), flint.arb.pi()
    if side:
        moved, left = room, arithmetic.sqrt(w2 * (ahead - room) * (room - behind))
        phase = flint.arb.atan2(left * w, arithmetic.number(pull - w2 * room))
    time = (phase - flint.arb.atan2(speed * w, arithmetic.number(pull))) / w
    return time, [(n, [way * moved], [way * left])]


def _newton(poly: Any, rate: Any, bits: int, radius: float) -> Any:
    """Return the root of a polynomial within `radius` of zero, except for its last bits.

    The interval Newton step that follows, with the slope over the whole radius, gains
    ``-log2(radius)`` bits.
    """
    near, sure = flint.arb(0), -math.log2(radius)  # bits
    most = bits - sure + 16
    while sure < most:
        sure *= 2
        flint.ctx.prec = min(bits, math.ceil(sure) + 64)
        near = (near - poly(near) / rate(near)).mid()
    flint.ctx.prec = bits
    return near


def _derivatives(run: Run, at: Any, order: int) -> list[list[Any]]:
    """Return displacements at a time, velocities, and their derivatives up to that order."""
    moved, speeds = (x.tolist() for x in run.moved(at))
    pulls = zip(run.accelerations.tolist(), run.bent(moved), strict=True)
    rows = [moved, speeds, [a + b for a, b in pulls]]
    while len(rows) < order + 2:
        rows.append(run.bent(rows[-2]))
    return rows
