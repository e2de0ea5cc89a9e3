"""The first event, and how nearby states part until then, in float64 with proved bounds.

Everything is a Taylor series of the moving sliders, ``v^(k+2) = -K v^(k)``, in steps of at most
`STEP`: sums and products alone, no library function. All of it is bounded by three facts about K,
whose norm is at most 4: over a time t the propagators of x'' = -K x have norms

    |cos(sqrt(K) t)| <= 1,    |sin(sqrt(K) t) / sqrt(K)| <= t,    |sqrt(K) sin(sqrt(K) t)| <= 2.

With ``S = |v| + |a| / 2`` (Euclidean) and ``t <= 1/2`` the k-th term of the series is at most
``S / k!``: what is left out beyond `ORDER` is below ``2^-60 S``, and the roundings of recurrence
and sum stay below ``128 units of roundoff = 2^-46 S``; a factor of 4 is added (`ROUNDING`).
A state of the set differs by some uncertainty W at the beginning (Euclidean), and by at most
``W (1 + t)`` in its velocities, ``3 W`` in its accelerations, ``W (t + t^2 / 2)`` in its places.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from exactcreep.compiling import njit

STEP = 0.5
ORDER = 20
ROUNDING = 2.0**-44
MOST_STEPS = 64
"""Of one search: what has no event within 32 tau_dyn is left to others."""
MOST_LOOKS = 60
"""Of one watch in one step."""
HURRY = 8.0
"""Bound of how fast forces and velocities change, for each unit of pace and of (1 + time)."""
WARY = 1e-9
"""Relative; far more than the rounding of the few operations that follow a bound."""


@njit(cache=True, error_model="numpy")
def first_event(
    springs: Any,
    signs: Any,
    fresh: Any,
    velocities: Any,
    accelerations: Any,
    forces: Any,
    thresholds: Any,
    unsure: float,
    last: int,
) -> tuple[int, int, float, float]:
    """Return slider, side, time and largest error of what is proved to happen first.

    Parameters
    ----------
    springs : ndarray of int, shape (n,)
        How many springs each slider has.
    signs : ndarray of int, shape (n,)
    fresh : ndarray of bool, shape (n,)
        Which moving sliders have just started: their velocity is zero, exactly.
    velocities, accelerations : ndarray, shape (n,)
        Zero at rest.
    forces, thresholds : ndarray, shape (n,)
        Of resting sliders.
    unsure : float
        How far any of these numbers is from that of any state of the set.
    last : int
        The sliders from here on mirror others, and are not watched.

    Returns
    -------
    tuple of (int, int, float, float)
        The side is 0 for a stop, else the direction of a start. The slider is -1 where float64
        does not prove which event is first.

    Guarantee: in every state of the set the event is the first, its root the only one of its
    function up to the end of the bracket, and simple.
    """
    n = len(signs)
    v, a = velocities.copy(), accelerations.copy()
    pull = forces.copy()
    series = np.zeros((ORDER + 1, n))
    poly = np.zeros(ORDER + 2)
    nothing = (-1, 0, 0.0, 0.0)
    root = 0.0
    for i in range(n):
        root += signs[i] != 0
    root = math.sqrt(root)
    away = root * unsure
    time = 0.0
    for step in range(MOST_STEPS):
        size = _sizes(v, a)
        rounding = ROUNDING * size
        error = 8 * (away * (1 + time + STEP) ** 2 + rounding) + 2 * unsure
        _fill(series, springs, signs, v, a)
        slider, side, low, high = -1, 0, math.inf, math.inf
        for i in range(last):
            beside = (i > 0 and signs[i - 1] != 0) or (i < n - 1 and signs[i + 1] != 0)
            if signs[i] == 0 and not beside:
                continue
            for way in (0, 0) if signs[i] != 0 else (1, -1):
                if way == 0:
                    for k in range(ORDER + 1):
                        poly[k] = signs[i] * series[k, i]
                    poly[ORDER + 1] = 0.0
                else:
                    poly[0] = thresholds[i] - way * pull[i]
                    for k in range(ORDER + 1):
                        rate = 0.0
                        if i > 0:
                            rate += series[k, i - 1]
                        if i < n - 1:
                            rate += series[k, i + 1]
                        poly[k + 1] = -way * rate / (k + 1)
                begin, end = _root(
                    poly, error, min(STEP, high), way == 0 and step == 0 and fresh[i]
                )
                if begin < 0:
                    return nothing
                if begin == math.inf:
                    pass
                elif end < low:
                    slider, side, low, high = i, way, begin, end
                elif not begin > high:
                    return nothing
                if way == 0:
                    break
        if slider >= 0:
            half = (high - low) / 2
            return slider, side, time + (low + high) / 2, half * (1 + WARY) + 2.0**-50 * (1 + time)
        x = _advanced(series, v, a, STEP)
        for i in range(n):
            if signs[i] == 0:
                if i > 0:
                    pull[i] += x[i - 1]
                if i < n - 1:
                    pull[i] += x[i + 1]
        away += 2 * root * rounding
        time += STEP
    return nothing


@njit(cache=True)
def _sizes(v: Any, a: Any) -> float:
    speed, force = 0.0, 0.0
    for i in range(len(v)):
        speed += v[i] * v[i]
        force += a[i] * a[i]
    return (math.sqrt(speed) + math.sqrt(force) / 2) * (1 + WARY)


@njit(cache=True)
def _fill(series: Any, springs: Any, signs: Any, v: Any, a: Any) -> None:
    """Fill in the coefficients of the velocities, ``series[k, n] t^k``; zero at rest."""
    n = len(v)
    for i in range(n):
        series[0, i], series[1, i] = v[i], a[i]
    for k in range(ORDER - 1):
        factor = 1.0 / ((k + 1) * (k + 2))
        for i in range(n):
            if signs[i] != 0:
                bent = springs[i] * series[k, i]
                if i > 0:
                    bent -= series[k, i - 1]
                if i < n - 1:
                    bent -= series[k, i + 1]
                series[k + 2, i] = -bent * factor


@njit(cache=True)
def _advanced(series: Any, v: Any, a: Any, t: float) -> Any:
    """Take velocities and accelerations to `t`, and return the displacements."""
    n = len(v)
    x = np.zeros(n)
    for i in range(n):
        place, speed, slope = 0.0, 0.0, 0.0
        for k in range(ORDER, -1, -1):
            place = place * t + series[k, i] / (k + 1)
            slope = slope * t + speed
            speed = speed * t + series[k, i]
        x[i], v[i], a[i] = place * t, speed, slope
    return x


@njit(cache=True)
def _value(poly: Any, t: float) -> tuple[float, float]:
    value, slope = 0.0, 0.0
    for k in range(ORDER + 1, -1, -1):
        slope = slope * t + value
        value = value * t + poly[k]
    return value, slope


@njit(cache=True, error_model="numpy")
def _root(poly: Any, error: float, limit: float, fresh: bool) -> Any:
    """Return between what times the first root lies.

    ``(inf, inf)``: not before or at `limit`; ``(-1, 0)``: it is not proved. Value, slope and second
    derivative of every state's function are within `error` of those of the polynomial.
    """
    bound, power = error, 1.0
    for k in range(2, ORDER + 2):
        bound += k * (k - 1) * abs(poly[k]) * power
        power *= STEP
    bound *= 1 + WARY
    t = 0.0
    if fresh:  # value zero, slope at least this: positive until 2 slope / bound
        slope = poly[1] - error
        if not slope > 0:
            return -1.0, 0.0
        t = 2 * slope / bound * (1 - WARY)
    for _ in range(MOST_LOOKS):
        if t > limit:
            return math.inf, math.inf
        value, slope = _value(poly, t)
        steep, most = slope + error, value + error
        if steep < 0 and 4 * most * bound * (1 + WARY) <= steep * steep:
            if most < 0:
                return -1.0, 0.0
            far = t - 2 * most / steep * (1 + WARY)
            if far <= STEP:  # the only root lies before, and the slope is at most steep / 2 there
                return _narrowed(poly, error, t, far, steep)
        least, slope = value - error, slope - error
        if not least > 0:
            return -1.0, 0.0
        reach = math.sqrt(slope * slope + 2 * least * bound)
        step = 2 * least / (reach - slope) if slope < 0 else (slope + reach) / bound
        t += step * (1 - WARY)
    return -1.0, 0.0


@njit(cache=True)
def _narrowed(
    poly: Any, error: float, begin: float, end: float, steep: float
) -> Any:
    t = begin
    for _ in range(6):
        value, slope = _value(poly, t)
        if not slope < 0:
            break
        t = min(max(t - value / slope, begin), end)
    value, _ = _value(poly, t)
    away = 2 * (abs(value) + error) / -steep * (1 + WARY)
    return max(begin, t - away), min(end, t + away)


@njit(cache=True, error_model="numpy")
def pass_through(
    springs: Any,
    signs: Any,
    velocities: Any,
    accelerations: Any,
    time: float,
    late: float,
    unsure: float,
    pace: float,
    slider: int,
    side: int,
    image: int,
    forces: Any,
    speeds: Any,
    moved: Any,
    errors: Any,
    unit: float,
    own: bool,
) -> tuple[float, float]:
    """Take the rows of a set through a motion, and to its event; return how its time spreads.

    Parameters
    ----------
    springs, signs : ndarray of int, shape (n,)
        The signs are those before the event.
    velocities, accelerations : ndarray, shape (n,)
        At the event, before it is resolved; zero at rest.
    time : float
        Of the motion.
    late : float
        How far the time of any state of the set is from `time`.
    unsure : float
        How far velocities and accelerations at one time are from those of any state of the set.
    pace : float
        Norms of all velocities and of all accelerations at the beginning, added up.
    slider, side, image : int
        Whose speed (side 0), or whose distance to the threshold on that side, reaches zero; its
        mirror image does the same (-1: there is none).
    forces, speeds, moved : ndarray, shape (n, k)
        A state is the middle plus these rows times ``[-1, 1]**k``; changed in place.
    errors : ndarray, shape (3, n)
        By how much the rows of forces, speeds, moved may fail to say where a state is; in place.
    unit : float
        Of the rows.
    own : bool
        Whether the rows are those of the set, and say how late its states are; other rows, which
        say how states part, are taken along.

    Returns
    -------
    tuple of (float, float)
        How far the times lie from that of the middle, in units of the rows; nan: the event's slope
        is not separated from zero, and nothing was done. And `late`, as the rows have it.
    """
    n, k = forces.shape
    rate = accelerations[slider]  # of what the event brings to zero
    if side != 0:
        rate = 0.0
        for m in (slider - 1, slider + 1):
            if 0 <= m < n:
                rate += velocities[m]
    hurry = HURRY * pace * (1 + time)
    vague = 2 * (unsure + late * hurry) + 2.0**-50 * abs(rate)
    if not abs(rate) > 2 * vague:
        return math.nan, late
    moving = np.flatnonzero(signs)
    p = len(moving)
    root = math.sqrt(p)
    of_force, of_speed = 0.0, 0.0
    for one in moving:
        of_force += errors[0, one] ** 2
        of_speed += errors[1, one] ** 2
    of_force, of_speed = math.sqrt(of_force), math.sqrt(of_speed)
    steps = max(1, math.ceil(time / STEP))
    h = time / steps
    at = np.full(n, -1)
    for j in range(p):
        at[moving[j]] = j
    f, u, way = np.empty((p, k)), np.empty((p, k)), np.zeros((p, k))
    for j in range(p):
        f[j], u[j] = forces[moving[j]], speeds[moving[j]]
    even, odd, x = np.empty((p, k)), np.empty((p, k)), np.empty((p, k))
    rounding, first = 0.0, 0.0
    for step in range(steps):
        size = 0.0
        for c in range(k):
            size += _sizes(u[:, c], f[:, c])
        if step == 0:
            first = size
        rounding += ROUNDING * size * root
        for j in range(p):
            for c in range(k):
                even[j, c], odd[j, c] = u[j, c], f[j, c] * h
                u[j, c] = even[j, c] + odd[j, c]
                x[j, c] = even[j, c] + odd[j, c] / 2
        left = 2 * h
        for order in range(2, ORDER + 1):
            left *= 2 * h / order
            if left < 2.0**-70:
                break
            terms = even if order % 2 == 0 else odd
            factor = h * h / (order * (order - 1))
            _bend(terms, moving, at, springs, factor)
            for j in range(p):
                for c in range(k):
                    u[j, c] += terms[j, c]
                    x[j, c] += terms[j, c] / (order + 1)
        for j in range(p):
            for c in range(k):
                x[j, c] *= h
                way[j, c] += x[j, c]
        _bend(x, moving, at, springs, 1.0)  # a(t) = a(0) - K x(t)
        for j in range(p):
            for c in range(k):
                f[j, c] += x[j, c]
    # the events of all states lie much closer together than it took to find them: by the slope,
    # as far as the rows say at one time; that time has been rounded
    scale = 8 * (first + of_force + of_speed) * (1 + time)
    lag = 2.0**-52 * (1 + time) * scale
    e_force = of_force + 2 * of_speed + 3 * rounding + lag
    e_speed = of_speed + time * of_force + (1 + time) * rounding + lag
    e_way = (time + time * time / 2) * (of_speed + of_force) + (1 + time) ** 2 * rounding + lag
    apart = _apart(forces, errors, way, u, signs, at, e_speed, e_way, slider, side)
    if own:
        by = unit * apart / (abs(rate) - vague) * (1 + WARY)
        late = min(late, by + 2.0**-50 * (1 + time))
    vague = 2 * (unsure + late * hurry) + 2.0**-50 * abs(rate)
    lag = late * scale
    e_force, e_speed, e_way = e_force + lag, e_speed + lag, e_way + lag
    for j in range(p):
        i = moving[j]
        forces[i], speeds[i] = f[j], u[j]
        errors[0, i], errors[1, i] = e_force, e_speed
        errors[2, i] += e_way
        for c in range(k):
            moved[i, c] += way[j, c]
        for m in (i - 1, i + 1):
            if 0 <= m < n and signs[m] == 0:
                errors[0, m] += e_way
                for c in range(k):
                    forces[m, c] += way[j, c]
    # the event is later or earlier, state by state
    row, e_row = speeds[slider].copy(), errors[1, slider]
    if side != 0:
        row, e_row = forces[slider].copy(), errors[0, slider]
    spread = 0.0
    for c in range(k):
        row[c] = -row[c] / rate
        spread += abs(row[c])
    e_spread = (e_row + spread * vague) / (abs(rate) - vague) * (1 + WARY) + 2.0**-50 * spread
    for i in range(max(moving[0] - 1, 0), min(moving[-1] + 2, n)):
        if signs[i] != 0:
            for c in range(k):
                speeds[i, c] += accelerations[i] * row[c]
                moved[i, c] += velocities[i] * row[c]
            errors[1, i] += _off(accelerations[i], vague / 2, spread, e_spread)
            errors[2, i] += _off(velocities[i], vague / 2, spread, e_spread)
        pull, e_pull = 0.0, 0.0
        if signs[i] != 0:
            pull -= springs[i] * velocities[i]
            e_pull += 2 * _off(velocities[i], vague / 2, spread, e_spread)
        for m in (i - 1, i + 1):
            if 0 <= m < n and signs[m] != 0:
                pull += velocities[m]
                e_pull += _off(velocities[m], vague / 2, spread, e_spread)
        errors[0, i] += e_pull
        for c in range(k):
            forces[i, c] += pull * row[c]
        for c in range(k):  # sums of a few terms
            errors[0, i] += 2.0**-49 * abs(forces[i, c])
            errors[1, i] += 2.0**-49 * abs(speeds[i, c])
            errors[2, i] += 2.0**-49 * abs(moved[i, c])
    # what is constant at the event, whatever the state was
    for m in (slider, image):
        if m >= 0:
            constant = speeds if side == 0 else forces
            constant[m] = 0.0
            errors[1 if side == 0 else 0, m] = 0.0
    return (spread + e_spread) * (1 + WARY), late


@njit(cache=True)
def _apart(
    forces: Any,
    errors: Any,
    way: Any,
    speeds: Any,
    signs: Any,
    at: Any,
    e_speed: float,
    e_way: float,
    slider: int,
    side: int,
) -> Any:
    """Return how far what the event brings to zero may be from zero, at the middle's event."""
    k = way.shape[1]
    total = e_speed
    if side == 0:
        for c in range(k):
            total += abs(speeds[at[slider], c])
        return total
    total = errors[0, slider] + 2 * e_way
    for c in range(k):
        value = forces[slider, c]
        for m in (slider - 1, slider + 1):
            if 0 <= m < len(signs) and signs[m] != 0:
                value += way[at[m], c]
        total += abs(value)
    return total


@njit(cache=True)
def _off(x: float, unsure: float, spread: float, e_spread: float) -> Any:
    return (abs(x) + unsure) * e_spread + (unsure + 2.0**-49 * abs(x)) * spread


@njit(cache=True)
def _bend(rows: Any, moving: Any, at: Any, springs: Any, factor: float) -> None:
    """Replace rows by ``-factor K`` times them."""
    p, k = rows.shape
    before = np.zeros(k)
    for j in range(p):
        i = moving[j]
        after = i + 1 < len(at) and at[i + 1] >= 0
        if i == 0 or at[i - 1] < 0:
            before[:] = 0.0
        for c in range(k):
            own = rows[j, c]
            bent = springs[i] * own - before[c]
            if after:
                bent -= rows[j + 1, c]
            before[c] = own
            rows[j, c] = -factor * bent


@njit(cache=True)
def spans(
    forces: Any, speeds: Any, errors: Any, theta: Any, theta_error: float
) -> tuple[float, float]:
    """Return the farthest that any force, velocity or l0 theta may lie from the middle's.

    And the share of the errors in it, where that is largest.
    """
    widest, share = 0.0, 0.0
    for c in range(len(theta)):
        widest += abs(theta[c])
    widest = (widest + theta_error) * (1 + WARY)
    for way, rows in enumerate((forces, speeds)):
        total, error = 0.0, 0.0
        for i in range(len(rows)):
            size = 0.0
            for c in range(rows.shape[1]):
                size += abs(rows[i, c])
            total, error = max(total, size), max(error, errors[way, i])
            widest = max(widest, (size + errors[way, i]) * (1 + WARY))
        if error > share * total:
            share = error / total if total > 0 else 1.0
    return widest, share
