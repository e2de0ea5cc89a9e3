"""The compiled event loop of the exact solver: from target to target, float64, event by event.

**Decompose** the moving sliders into a lone mover or a cluster; find the **first event** (a lone
mover's by energy, a cluster's from Taylor jets and one certificate for all sliders); **advance**
to it; **resolve** it by the contact law; repeat until rest. Around it: ramp to theta_c,
rearrange, repeat until the target.

What is stored
--------------
Forces at rest and displacements are sums of two floats, so that nothing is lost however far the
chain travels. Sliders 1 and N alone feel theta: their stored force leaves it out, and
``l0 theta`` (also two floats) is added when it is needed. A ramp therefore costs the same for any
length of the chain, and theta_c does not depend on where the ramp began: a dummy breakpoint
changes no bit.

Why no event is missed
----------------------
A cluster moves by ``x'' = -K x + f``; its Taylor coefficients obey a three-term recursion, and
since all frequencies are at most 2 the terms beyond `ORDERS` are below ``2**-54`` of the
largest force within the `HORIZON`. On ``[0, t]`` each margin (velocity of a mover, distance of a
resting neighbour's force from its thresholds) is the Hermite cubic through value and slope at both
ends minus at most ``M4 s**2 (t - s)**2 / 24``, where M4 bounds the fourth derivative. Written
with Bernstein coefficients of degree four this is positive if five numbers are; they are
computed for all sliders at once, and an event is accepted only if every slider passes.

Source: Eqs. (dynamic_eq1)-(static_eqN), section "Numerical method"; derivations/modes.py and
derivations/slip.py.
"""

from __future__ import annotations

import math
import numpy as np
from numba import njit

from exactcreep.model.disorder import STREAM_COEFFICIENT, normal_deviate, philox

ORDERS = 24
"""Taylor coefficients 0 .. ORDERS of a displacement are kept."""
HORIZON = 1.0
"""Longest step in units of tau_dyn."""
PAD = 2
"""Slider n stands at index n - 1 + PAD of every array; the cells outside the chain never move."""

ULP = 2.0**-52

# cells of `real`, float64
(
    THETA, THETA_LOW, TIME, TOTAL, TOTAL_LOW, FRICTION, MU_D, MU_D_LOW, COSINE, MEAN, WIDTH,
    MEAN_EXCESS, RESIDUAL, SINE,
) = range(14)  # fmt: skip
REALS = 14

# cells of `whole`, int64
(
    N, STAGE, FIRST, LAST, TOUCHED_FIRST, TOUCHED_LAST, MOVING, DOWNHILL, REARRANGEMENTS, EVENTS,
    SLIP_TOTAL, BELOW, UNDECIDED, LOGGING, LOGGED, NUMBER, CONSTANT, TARGET, ROOTS, STEPS, TESTS,
    SEED,
) = range(22)  # fmt: skip
WHOLES = 22

# stages
AT_REST, LONE, CLUSTER, UNSTABLE = 0, 1, 2, 3
# why the loop returned
DONE, BUDGET, RUNAWAY, LOG_FULL, ONE_DONE = 0, 1, 2, 3, 4

START, STOP = 0, 1


# rows of `cell`, float64, one column for each slider; two-row quantities are sums of two floats
(
    FORCE,  # at rest, at sliders 1 and N without theta
    FORCE_LOW,
    EXCESS,  # effective (mu_s,n - mu_d) cos(alpha), never negative
    STIFFNESS,  # springs that hold the slider: 2, at an end 1, alone 0
    TRAVEL,  # displacement since the start of the simulation
    TRAVEL_LOW,
    X,  # displacement since the start of the rearrangement
    VELOCITY,  # speed in the direction of the sign
    PULL,  # force at the present time, kept where it is needed
    COEFFICIENT,
    BEND,  # bounds the tail of the fourth derivative of the margin
    DEVIATE,  # four rows: the block of deviates that holds the next draw
) = range(12)
CELLS = DEVIATE + 4
# rows of `count`, int64, one column for each slider
SIGN, FRESH, DRAWS, SLIPS, EVENT = range(5)
COUNTS = 5
# rows of `series`: displacement jets, then margin jets
MARGIN = ORDERS + 1
SERIES = MARGIN + ORDERS
# columns of `log`
LOG_COLUMNS = 10


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False, forceinline=True)
def _two_sum(a, b):  # type: ignore[no-untyped-def]
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False, forceinline=True)
def _plus(high, low, term):  # type: ignore[no-untyped-def]
    """Return (high + low) + term as two floats."""
    total, error = _two_sum(high, term)
    error += low
    result = total + error
    return result, error - (result - total)


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False, forceinline=True)
def _log(cell, count, series, real, whole, log, kind, i, sign, residual):  # type: ignore[no-untyped-def]
    if whole[LOGGING] == 0:
        return
    row = whole[LOGGED]
    log[row, 0] = real[TIME]
    log[row, 1] = residual
    log[row, 2] = real[THETA]
    log[row, 3] = real[THETA_LOW]
    log[row, 4] = whole[TARGET]
    log[row, 5] = whole[REARRANGEMENTS] - 1
    log[row, 6] = whole[NUMBER]
    log[row, 7] = kind
    log[row, 8] = i + 1 - PAD
    log[row, 9] = sign
    whole[LOGGED] = row + 1


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False, forceinline=True)
def _fill_deviates(cell, count, series, real, whole, log, i, block):  # type: ignore[no-untyped-def]
    words = philox(np.uint64(whole[SEED]), STREAM_COEFFICIENT, i + 1 - PAD, block)
    for j in range(4):
        cell[DEVIATE + j, i] = normal_deviate(words[j])


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False, forceinline=True)
def _draw(cell, count, series, real, whole, log, i):  # type: ignore[no-untyped-def]
    """Give slider i its next static coefficient."""
    k = count[DRAWS, i]
    count[DRAWS, i] = k + 1
    if whole[CONSTANT] == 1:
        cell[EXCESS, i] = real[MEAN_EXCESS]
        return
    if k & 3 == 0:
        _fill_deviates(cell, count, series, real, whole, log, i, k >> 2)
    mu = real[MEAN] + real[WIDTH] * cell[DEVIATE + (k & 3), i]
    cell[COEFFICIENT, i] = mu
    above = (mu - real[MU_D]) - real[MU_D_LOW]
    if above < 0.0:
        whole[BELOW] += 1
        above = 0.0
    cell[EXCESS, i] = above * real[COSINE]


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False, forceinline=True)
def _rest_force(cell, count, series, real, whole, log, i):  # type: ignore[no-untyped-def]
    """Return the force on slider i before this rearrangement moved anything."""
    high = cell[FORCE, i]
    n = whole[N]
    if n > 1:
        if i == PAD:
            high, low = _plus(high, cell[FORCE_LOW, i] - real[THETA_LOW], -real[THETA])
        elif i == n - 1 + PAD:
            high, low = _plus(high, cell[FORCE_LOW, i] + real[THETA_LOW], real[THETA])
    return high


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False, forceinline=True)
def _present_force(cell, count, series, real, whole, log, i):  # type: ignore[no-untyped-def]
    return _rest_force(cell, count, series, real, whole, log, i) + ((cell[X, i - 1] + cell[X, i + 1]) - cell[STIFFNESS, i] * cell[X, i])


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False, forceinline=True)
def _inside(cell, count, series, real, whole, log, i):  # type: ignore[no-untyped-def]
    return PAD <= i < PAD + whole[N]


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False, forceinline=True)
def _touch(cell, count, series, real, whole, log, i):  # type: ignore[no-untyped-def]
    whole[TOUCHED_FIRST] = min(whole[TOUCHED_FIRST], i)
    whole[TOUCHED_LAST] = max(whole[TOUCHED_LAST], i)


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False, forceinline=True)
def _start(cell, count, series, real, whole, log, i, sign, residual):  # type: ignore[no-untyped-def]
    count[SIGN, i] = sign
    cell[VELOCITY, i] = 0.0
    count[FRESH, i] = 1
    whole[MOVING] += 1
    _touch(cell, count, series, real, whole, log, i)
    if whole[MOVING] == 1:
        whole[FIRST] = i
        whole[LAST] = i
    else:
        whole[FIRST] = min(whole[FIRST], i)
        whole[LAST] = max(whole[LAST], i)
    _log(cell, count, series, real, whole, log, START, i, sign, residual)


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False, forceinline=True)
def _stop(cell, count, series, real, whole, log, i, residual):  # type: ignore[no-untyped-def]
    _log(cell, count, series, real, whole, log, STOP, i, count[SIGN, i], residual)
    count[SIGN, i] = 0
    cell[VELOCITY, i] = 0.0
    count[FRESH, i] = 0
    whole[MOVING] -= 1
    whole[SLIP_TOTAL] += 1
    count[SLIPS, i] += 1
    _draw(cell, count, series, real, whole, log, i)


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False, forceinline=True)
def _begin(cell, count, series, real, whole, log):  # type: ignore[no-untyped-def]
    whole[REARRANGEMENTS] += 1
    whole[NUMBER] = 0
    whole[TOUCHED_FIRST] = cell.shape[1]
    whole[TOUCHED_LAST] = 0
    real[TIME] = 0.0


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False, forceinline=True)
def _settle(cell, count, series, real, whole, log):  # type: ignore[no-untyped-def]
    """Turn the displacements of the rearrangement into forces at rest."""
    first = whole[TOUCHED_FIRST]
    last = whole[TOUCHED_LAST]
    for i in range(max(first - 1, PAD), min(last + 2, PAD + whole[N])):
        # the neighbours' sum first: the mirror image adds the same two numbers
        total, error = _two_sum(cell[X, i - 1], cell[X, i + 1])
        high, low = _plus(cell[FORCE, i], cell[FORCE_LOW, i] + error, total)
        cell[FORCE, i], cell[FORCE_LOW, i] = _plus(high, low, -cell[STIFFNESS, i] * cell[X, i])
    for i in range(first, last + 1):
        step = cell[X, i]
        if step != 0.0:
            cell[TRAVEL, i], cell[TRAVEL_LOW, i] = _plus(cell[TRAVEL, i], cell[TRAVEL_LOW, i], step)
            real[TOTAL], real[TOTAL_LOW] = _plus(
                real[TOTAL], real[TOTAL_LOW], step
            )
            cell[X, i] = 0.0
    whole[STAGE] = AT_REST


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False, forceinline=True)
def _after_event(cell, count, series, real, whole, log):  # type: ignore[no-untyped-def]
    """Choose the stage that goes on from the present set of movers."""
    whole[EVENTS] += 1
    if whole[MOVING] == 0:
        _settle(cell, count, series, real, whole, log)
        return
    first = whole[FIRST]
    last = whole[LAST]
    while count[SIGN, first] == 0:
        first += 1
    while count[SIGN, last] == 0:
        last -= 1
    whole[FIRST] = first
    whole[LAST] = last
    whole[STAGE] = LONE if first == last else CLUSTER


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False, forceinline=True)
def _stopped_exceeds(cell, count, series, real, whole, log, i, pull):  # type: ignore[no-untyped-def]
    """Test a slider that has just stopped; return the sign of its start, 0 if it stays."""
    threshold = real[FRICTION] + cell[EXCESS, i]
    beyond = abs(pull) - threshold
    bound = 8.0 * ULP * (abs(pull) + threshold)
    if beyond > bound:
        return 1 if pull > 0.0 else -1
    if beyond > -bound:
        whole[UNDECIDED] += 1
    return 0


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False, forceinline=True)
def _ramp(cell, count, series, real, whole, log, target, target_low):  # type: ignore[no-untyped-def]
    """Move theta towards the target; return whether a slider has started before it."""
    n = whole[N]
    way = target - real[THETA]
    if way == 0.0:
        way = target_low - real[THETA_LOW]
    if n == 1 or way == 0.0:
        real[THETA] = target
        real[THETA_LOW] = target_low
        return False
    up = 1.0 if way > 0.0 else -1.0
    top = PAD
    end = PAD + n - 1
    room_top = real[FRICTION] + cell[EXCESS, top]
    room_end = real[FRICTION] + cell[EXCESS, end]
    # slider 1 starts with sign -up at l0 theta = f_1 + up * room, slider N with +up at up * room - f_N
    top_high, top_low = _plus(cell[FORCE, top], cell[FORCE_LOW, top], up * room_top)
    end_high, end_low = _plus(-cell[FORCE, end], -cell[FORCE_LOW, end], up * room_end)
    far_top = up * ((top_high - real[THETA]) + (top_low - real[THETA_LOW]))
    far_end = up * ((end_high - real[THETA]) + (end_low - real[THETA_LOW]))
    far = up * ((target - real[THETA]) + (target_low - real[THETA_LOW]))
    # room, and what the slips since the last change of theta's direction rounded away
    bound = 2.0 * ULP * (room_top + room_end + abs(top_high) + abs(end_high))
    nearest = max(min(far_top, far_end), 0.0)
    if nearest >= far - bound:
        if nearest <= far + bound:
            whole[UNDECIDED] += 1
        real[THETA] = target
        real[THETA_LOW] = target_low
        return False
    _begin(cell, count, series, real, whole, log)
    if far_top <= far_end:
        if far_top > 0.0:
            real[THETA] = top_high
            real[THETA_LOW] = top_low
    elif far_end > 0.0:
        real[THETA] = end_high
        real[THETA_LOW] = end_low
    together = abs(max(far_top, 0.0) - max(far_end, 0.0)) <= bound
    if together:
        whole[UNDECIDED] += 1
    if together or far_top < far_end:
        _start(cell, count, series, real, whole, log, top, np.int8(-up), 0.0)
        cell[PULL, top] = -up * room_top
    if together or far_end < far_top:
        _start(cell, count, series, real, whole, log, end, np.int8(up), 0.0)
        cell[PULL, end] = up * room_end
    whole[NUMBER] += 1
    _after_event(cell, count, series, real, whole, log)
    return True


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False, forceinline=True)
def _unstable(cell, count, series, real, whole, log):  # type: ignore[no-untyped-def]
    """Start every slider that exceeds its threshold as the chain stands."""
    n = whole[N]
    began = False
    for i in range(PAD, PAD + n):
        pull = _rest_force(cell, count, series, real, whole, log, i)
        threshold = real[FRICTION] + cell[EXCESS, i]
        beyond = abs(pull) - threshold
        bound = 8.0 * ULP * (abs(pull) + threshold)
        if n > 1 and (i == PAD or i == PAD + n - 1):
            bound += 2.0 * ULP * abs(real[THETA])
        if beyond > bound:
            if not began:
                _begin(cell, count, series, real, whole, log)
                began = True
            cell[PULL, i] = pull
            _start(cell, count, series, real, whole, log, i, np.int8(1 if pull > 0.0 else -1), 0.0)
        elif beyond > -bound and beyond != 0.0:
            whole[UNDECIDED] += 1
    whole[STAGE] = AT_REST
    if began:
        whole[NUMBER] += 1
        _after_event(cell, count, series, real, whole, log)
    return began


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False, forceinline=True)
def _lone(cell, count, series, real, whole, log):  # type: ignore[no-untyped-def]
    """Advance a lone mover to its stop or to the start of a neighbour, by energy."""
    i = whole[FIRST]
    sign = count[SIGN, i]
    side = np.float64(sign)
    stiff = cell[STIFFNESS, i]
    speed = cell[VELOCITY, i]
    friction = real[FRICTION]
    if count[FRESH, i] == 1:
        pull = cell[PULL, i]  # exactly what made it start
    else:
        pull = _present_force(cell, count, series, real, whole, log, i)
    if count[FRESH, i] == 1 and abs(pull) == friction + cell[EXCESS, i]:
        drive = cell[EXCESS, i]
    else:
        drive = side * pull - friction
    swing = 0.0
    left = 0.0
    right = 0.0
    if stiff == 0.0:
        if drive >= 0.0:
            return True
        length = speed * speed / (-2.0 * drive)
    elif speed == 0.0:
        length = 2.0 * drive / stiff
    else:
        swing = math.sqrt(drive * drive + stiff * speed * speed)
        if drive >= 0.0:
            length = (drive + swing) / stiff
        else:
            length = speed * speed / (swing - drive)
    room_left = np.inf
    room_right = np.inf
    if stiff > 0.0:
        if _inside(cell, count, series, real, whole, log, i - 1):
            left_pull = _present_force(cell, count, series, real, whole, log, i - 1)
            left = friction + cell[EXCESS, i - 1]
            room_left = max(left - side * left_pull, 0.0)
        if _inside(cell, count, series, real, whole, log, i + 1):
            right_pull = _present_force(cell, count, series, real, whole, log, i + 1)
            right = friction + cell[EXCESS, i + 1]
            room_right = max(right - side * right_pull, 0.0)
    room = min(room_left, room_right)
    bound = 8.0 * ULP * (2.0 * friction + cell[EXCESS, i] + length + abs(pull))
    count[FRESH, i] = 0
    if room >= length - bound:
        if room <= length + bound:
            whole[UNDECIDED] += 1
        if whole[LOGGING] == 1:
            if stiff == 0.0:
                real[TIME] += speed / -drive
            elif length > 0.0:
                real[TIME] += math.atan2(math.sqrt(stiff) * speed, -drive) / math.sqrt(stiff)
        cell[X, i] += side * length
        if speed == 0.0 and stiff > 0.0:
            pull = side * (friction - drive)
        elif stiff > 0.0:
            pull = side * (friction - swing)
        _stop(cell, count, series, real, whole, log, i, 0.0)
        whole[NUMBER] += 1
        turn = _stopped_exceeds(cell, count, series, real, whole, log, i, pull)
        if turn != 0:
            cell[PULL, i] = pull
            _start(cell, count, series, real, whole, log, i, np.int8(turn), 0.0)
            whole[EVENTS] += 1
            whole[NUMBER] += 1
        _after_event(cell, count, series, real, whole, log)
        return False
    # a neighbour starts at once with everything else unchanged
    faster = math.sqrt(max(speed * speed + room * (2.0 * drive - stiff * room), 0.0))
    if whole[LOGGING] == 1:
        later = drive - stiff * room
        omega = math.sqrt(stiff)
        turned = math.atan2(
            omega * (faster * drive - speed * later),
            drive * later + stiff * speed * faster,
        )
        if turned > 0.0:
            real[TIME] += turned / omega
    cell[X, i] += side * room
    cell[VELOCITY, i] = faster
    both = abs(room_left - room_right) <= bound
    if both:
        whole[UNDECIDED] += 1
    if both or room_left < room_right:
        cell[PULL, i - 1] = side * left
        _start(cell, count, series, real, whole, log, i - 1, sign, 0.0)
    if both or room_right < room_left:
        cell[PULL, i + 1] = side * right
        _start(cell, count, series, real, whole, log, i + 1, sign, 0.0)
    if faster == 0.0:
        count[FRESH, i] = 1  # it has not moved yet: its velocity still starts from zero
        cell[PULL, i] = pull
    whole[NUMBER] += 1
    _after_event(cell, count, series, real, whole, log)
    return False


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False, forceinline=True)
def _never_stops(cell, count, series, real, whole, log):  # type: ignore[no-untyped-def]
    """Return whether it is proved that no slider of the moving whole chain ever stops."""
    n = whole[N]
    down = whole[DOWNHILL]
    if down == 0 or whole[MOVING] != n:
        return False
    total = 0.0
    for i in range(PAD, PAD + n):
        if count[SIGN, i] != down:
            return False
        total += cell[VELOCITY, i]
    mean = total / n
    energy = 0.0
    tension = 0.0
    scale = 0.0
    for i in range(PAD, PAD + n):
        energy += (cell[VELOCITY, i] - mean) ** 2
        tension += _present_force(cell, count, series, real, whole, log, i) - real[SINE]
        if i < PAD + n - 1:
            energy += tension * tension
        scale += abs(tension) + cell[VELOCITY, i]
    # outward: the sums above are good to n ulp of their largest term
    energy = energy * (1.0 + 8.0 * n * ULP) + (8.0 * n * ULP * scale) ** 2
    return mean * (1.0 - 4.0 * n * ULP) > math.sqrt((1.0 - 1.0 / n) * energy)


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False, forceinline=True)
def _value(series, row, i, orders, t):  # type: ignore[no-untyped-def]
    """Return value and slope at t of the polynomial with coefficients series[row : row + orders, i]."""
    value = series[row + orders - 1, i]
    slope = 0.0
    for k in range(orders - 2, -1, -1):
        slope = slope * t + value
        value = value * t + series[row + k, i]
    return value, slope


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False, forceinline=True)
def _bend(cell, count, series, real, whole, log, i, t):  # type: ignore[no-untyped-def]
    """Return a bound of the fourth derivative of margin i on [0, t]."""
    return (
        24.0 * abs(series[MARGIN + 4, i]) + t * (120.0 * abs(series[MARGIN + 5, i]) + t * (360.0 * abs(series[MARGIN + 6, i]) + t * cell[BEND, i]))
    )


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False, forceinline=True)
def _clear(at_0, slope_0, at_1, slope_1, bend, t, bound, begins, ends):  # type: ignore[no-untyped-def]
    """Return whether a margin is proved positive on (0, t).

    `begins`: it is known to leave zero upwards at 0; `ends`: it is known to vanish at t.
    """
    b1 = at_0 + t * slope_0 / 3.0
    b2 = at_1 - t * slope_1 / 3.0
    q1 = 0.25 * (at_0 + 3.0 * b1)
    q2 = 0.5 * (b1 + b2) - bend * (t * t) * (t * t) / 144.0
    q3 = 0.25 * (3.0 * b2 + at_1)
    if ends:
        # a dip within the bound before t would be the same crossing, found as well as can be
        return q1 >= 0.0 and q2 >= 0.0 and q3 >= 0.0 and at_0 >= -bound
    if begins:
        if q1 < 0.0 or q2 < 0.0:
            return False
    elif at_0 <= bound or q1 <= bound or q2 <= bound:
        return False
    return q3 > bound and at_1 > bound


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False, forceinline=True)
def _quadratic_root(p0, p1, p2):  # type: ignore[no-untyped-def]
    """Return the first positive root of p0 + p1 t + p2 t^2 with p0 >= 0, inf if there is none."""
    square = p1 * p1 - 4.0 * p2 * p0
    if square < 0.0:
        return np.inf
    low = math.sqrt(square) - p1
    if low <= 0.0:
        return np.inf
    return 2.0 * p0 / low


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False, forceinline=True)
def _expand(cell, count, series, real, whole, log, first, last):  # type: ignore[no-untyped-def]
    """Fill jets and margins of the cells first .. last at the present time."""
    for i in range(first - 1, last + 2):
        series[0, i] = 0.0
        if count[SIGN, i] != 0:
            side = np.float64(count[SIGN, i])
            if count[FRESH, i] == 0:
                cell[PULL, i] = _present_force(cell, count, series, real, whole, log, i)
            drive = side * cell[PULL, i] - real[FRICTION]
            if count[FRESH, i] == 1 and abs(cell[PULL, i]) == real[FRICTION] + cell[EXCESS, i]:
                drive = cell[EXCESS, i]
            series[1, i] = side * cell[VELOCITY, i]
            series[2, i] = side * 0.5 * drive
        else:
            series[1, i] = 0.0
            series[2, i] = 0.0
            if _inside(cell, count, series, real, whole, log, i) and (count[SIGN, i - 1] != 0 or count[SIGN, i + 1] != 0):
                cell[PULL, i] = _present_force(cell, count, series, real, whole, log, i)
        cell[BEND, i] = 0.0
    for k in range(1, ORDERS - 1):
        scale = 1.0 / ((k + 1.0) * (k + 2.0))
        weight = 0.0
        if k >= 7:
            weight = k * (k - 1.0) * (k - 2.0) * (k - 3.0)
        for i in range(first, last + 1):
            around = series[k, i - 1] + series[k, i + 1]
            if count[SIGN, i] != 0:
                series[k + 2, i] = (around - cell[STIFFNESS, i] * series[k, i]) * scale
                series[MARGIN + k, i] = count[SIGN, i] * (k + 1.0) * series[k + 1, i]
            else:
                series[k + 2, i] = 0.0
                series[MARGIN + k, i] = around
            cell[BEND, i] += weight * abs(series[MARGIN + k, i])
        series[k + 2, first - 1] = 0.0
        series[k + 2, last + 1] = 0.0
    for i in range(first, last + 1):
        k = ORDERS - 1
        if count[SIGN, i] != 0:
            series[MARGIN + 0, i] = cell[VELOCITY, i]
            series[MARGIN + k, i] = count[SIGN, i] * (k + 1.0) * series[k + 1, i]
        else:
            series[MARGIN + 0, i] = cell[PULL, i]
            series[MARGIN + k, i] = series[k, i - 1] + series[k, i + 1]
        cell[BEND, i] += k * (k - 1.0) * (k - 2.0) * (k - 3.0) * abs(series[MARGIN + k, i])


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False, forceinline=True)
def _bound(cell, count, series, real, whole, log, i, t):  # type: ignore[no-untyped-def]
    """Return a bound of the rounding error of margin i at t."""
    size = abs(series[MARGIN + 0, i]) + t * (abs(series[MARGIN + 1, i]) + t * (abs(series[MARGIN + 2, i]) + t * abs(series[MARGIN + 3, i])))
    if count[SIGN, i] != 0:
        return 16.0 * ULP * (size + t * real[FRICTION])
    return 16.0 * ULP * (size + real[FRICTION] + cell[EXCESS, i])


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False, forceinline=True)
def _first_crossing(cell, count, series, real, whole, log, i, upper, t):  # type: ignore[no-untyped-def]
    """Return the first time in (0, t] at which margin i leaves its range, inf if it never does.

    Bisection with a certificate for every piece it leaves behind; a piece that is neither clear nor
    crossed when it is as short as a rounding error is a graze: undecided, no crossing.
    """
    threshold = real[FRICTION] + cell[EXCESS, i]
    moving = count[SIGN, i] != 0
    side = -1.0 if upper else 1.0
    shift = 0.0 if moving else threshold
    bend = _bend(cell, count, series, real, whole, log, i, t)
    bound = _bound(cell, count, series, real, whole, log, i, t)
    a = 0.0
    at_a, slope_a = _value(series, MARGIN, i, ORDERS, 0.0)
    at_a = shift + side * at_a
    slope_a = side * slope_a
    fresh = count[FRESH, i] == 1
    if not fresh and abs(at_a) <= bound:
        # exactly at its threshold: it starts at once if it is pushed outwards
        lead = slope_a
        if lead == 0.0:
            lead = side * series[MARGIN + 2, i]
        if lead == 0.0:
            lead = side * series[MARGIN + 3, i]
        whole[UNDECIDED] += 1
        if lead < 0.0:
            return 0.0
        fresh = True
    b = t
    far = t
    crossed = False
    while True:
        at_b, slope_b = _value(series, MARGIN, i, ORDERS, b)
        at_b = shift + side * at_b
        slope_b = side * slope_b
        whole[ROOTS] += 1
        begins = fresh and a == 0.0
        if begins and at_a < 0.0:
            at_a = 0.0
        if at_b > bound:
            if _clear(at_a, slope_a, at_b, slope_b, bend, b - a, bound, begins, False):
                if b >= far:
                    return np.inf
                a = b
                at_a = at_b
                slope_a = slope_b
                b = a - at_a / slope_a if slope_a < 0.0 else far
                if not (b > a and b < far):
                    b = 0.5 * (a + far) if crossed else far
            else:
                b = 0.5 * (a + b)
        elif at_b >= -bound:
            if slope_b < 0.0 and _clear(
                at_a, slope_a, 0.0, slope_b, bend, b - a, bound, begins, True
            ):
                return b
            b = 0.5 * (a + b)
        else:
            crossed = True
            far = b
            middle = 0.5 * (a + b)
            if slope_b < 0.0:
                b -= at_b / slope_b
            if not (b > a and b < far):
                b = middle
        if b - a <= 4.0 * ULP * t:
            whole[UNDECIDED] += 1
            if crossed and far - a <= 8.0 * ULP * t:
                return far
            # a graze: at its threshold it stays
            a = b
            at_a, slope_a = _value(series, MARGIN, i, ORDERS, a)
            at_a = max(shift + side * at_a, 2.0 * bound)
            slope_a = max(side * slope_a, 0.0)
            fresh = False
            b = far
            if b <= a:
                return np.inf


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False, forceinline=True)
def _refine(cell, count, series, real, whole, log, i, upper, t):  # type: ignore[no-untyped-def]
    """Return the root near t of margin i by Newton's method, inf if it strays."""
    shift = 0.0 if count[SIGN, i] != 0 else real[FRICTION] + cell[EXCESS, i]
    side = -1.0 if upper else 1.0
    for _ in range(12):
        value, slope = _value(series, MARGIN, i, ORDERS, t)
        value = shift + side * value
        slope = side * slope
        whole[ROOTS] += 1
        if slope >= 0.0:
            return np.inf
        step = value / slope
        t -= step
        if not (t > 0.0 and t <= HORIZON):
            return np.inf
        if abs(step) <= 2.0 * ULP * t or abs(value) <= 2.0 * ULP * abs(shift):
            return t
        if abs(step) < 1e-5 * t:
            # the next step would be of the order of step**2 / t: one more evaluation settles it
            value, slope = _value(series, MARGIN, i, ORDERS, t)
            whole[ROOTS] += 1
            if slope * side < 0.0:
                t -= (shift + side * value) / (side * slope)
            return t
    return np.inf


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False, forceinline=True)
def _cluster(cell, count, series, real, whole, log):  # type: ignore[no-untyped-def]
    """Advance several movers to their first event and resolve it; return True for a runaway."""
    if whole[MOVING] == whole[N] and _never_stops(cell, count, series, real, whole, log):
        return True
    first = whole[FIRST] - 1
    last = whole[LAST] + 1
    _expand(cell, count, series, real, whole, log, first, last)
    friction = real[FRICTION]
    whole[STEPS] += 1
    # candidates from the first three coefficients
    t = HORIZON
    lane = -1
    lane_upper = False
    for i in range(first, last + 1):
        count[EVENT, i] = 0
        if count[SIGN, i] != 0:
            if count[FRESH, i] == 1:
                guess = _quadratic_root(max(series[MARGIN + 1, i], 0.0), series[MARGIN + 2, i], series[MARGIN + 3, i])
            else:
                guess = _quadratic_root(series[MARGIN + 0, i], series[MARGIN + 1, i], series[MARGIN + 2, i])
            upper = False
        elif _inside(cell, count, series, real, whole, log, i) and (count[SIGN, i - 1] != 0 or count[SIGN, i + 1] != 0):
            threshold = friction + cell[EXCESS, i]
            guess = _quadratic_root(max(threshold - series[MARGIN + 0, i], 0.0), -series[MARGIN + 1, i], -series[MARGIN + 2, i])
            upper = True
            other = _quadratic_root(max(threshold + series[MARGIN + 0, i], 0.0), series[MARGIN + 1, i], series[MARGIN + 2, i])
            if other < guess:
                guess = other
                upper = False
        else:
            continue
        if guess < t:
            t = guess
            lane = i
            lane_upper = upper
    root = False
    if lane >= 0:
        exact = _refine(cell, count, series, real, whole, log, lane, lane_upper, t) if t > 0.0 else np.inf
        if exact < HORIZON:
            t = exact
            root = True
        else:
            lane = -1
            t = HORIZON
    # certify every slider on (0, t]; one that fails brings t down to its own first event, and
    # what was clear up to a later time stays clear
    for i in range(first, last + 1):
        moving = count[SIGN, i] != 0
        if not moving and not (
            _inside(cell, count, series, real, whole, log, i) and (count[SIGN, i - 1] != 0 or count[SIGN, i + 1] != 0)
        ):
            continue
        whole[TESTS] += 1
        bound = _bound(cell, count, series, real, whole, log, i, t)
        threshold = 0.0 if moving else friction + cell[EXCESS, i]
        for upper in (False, True):
            if moving and upper:
                continue
            value, slope = _value(series, MARGIN, i, ORDERS, t)
            bend = _bend(cell, count, series, real, whole, log, i, t)
            side = -1.0 if upper else 1.0
            ends = root and i == lane and upper == lane_upper
            clear = _clear(
                threshold + side * series[MARGIN + 0, i],
                side * series[MARGIN + 1, i],
                0.0 if ends else threshold + side * value,
                side * slope,
                bend,
                t,
                bound,
                count[FRESH, i] == 1,
                ends,
            )
            if not clear:
                crossing = _first_crossing(cell, count, series, real, whole, log, i, upper, t)
                if crossing < t or (crossing == t and not root):
                    t = crossing
                    root = True
                    lane = i
                    lane_upper = upper
    # advance
    for i in range(first, last + 1):
        count[EVENT, i] = 0
        value, slope = _value(series, MARGIN, i, ORDERS, t)
        bound = _bound(cell, count, series, real, whole, log, i, t)
        if count[SIGN, i] != 0:
            if root and (i == lane or value <= bound):
                count[EVENT, i] = 1
                if i != lane:
                    whole[UNDECIDED] += 1
            shifted, speed = _value(series, 0, i, ORDERS + 1, t)
            cell[X, i] += shifted
            cell[VELOCITY, i] = max(value, 0.0)
            if i == lane:
                real[RESIDUAL] = abs(value)
        elif root and _inside(cell, count, series, real, whole, log, i) and (count[SIGN, i - 1] != 0 or count[SIGN, i + 1] != 0):
            threshold = friction + cell[EXCESS, i]
            if i == lane:
                count[EVENT, i] = 1 if lane_upper else -1
                real[RESIDUAL] = abs(abs(value) - threshold)
            elif abs(value) - threshold >= -bound and slope * value > 0.0:
                count[EVENT, i] = 1 if value > 0.0 else -1
                whole[UNDECIDED] += 1
    real[TIME] += t
    if t > 0.0:
        for i in range(first, last + 1):
            count[FRESH, i] = 0
    if not root:
        return False
    # resolve: all that stop are frozen and draw in ascending order, then all are tested
    stopped = False
    for i in range(first, last + 1):
        if count[EVENT, i] != 0 and count[SIGN, i] != 0:
            _stop(cell, count, series, real, whole, log, i, real[RESIDUAL])
            count[EVENT, i] = 2
            stopped = True
    if stopped:
        whole[NUMBER] += 1
    began = False
    for i in range(first, last + 1):
        if count[EVENT, i] == 2:
            pull = _present_force(cell, count, series, real, whole, log, i)
            turn = _stopped_exceeds(cell, count, series, real, whole, log, i, pull)
            if turn != 0:
                cell[PULL, i] = pull
                _start(cell, count, series, real, whole, log, i, np.int8(turn), 0.0)
                began = True
        elif count[EVENT, i] != 0:
            cell[PULL, i] = count[EVENT, i] * (friction + cell[EXCESS, i])
            _start(cell, count, series, real, whole, log, i, np.int8(count[EVENT, i]), real[RESIDUAL])
            began = True
    if began:
        whole[NUMBER] += 1
        if stopped:
            whole[EVENTS] += 1
    _after_event(cell, count, series, real, whole, log)
    return False


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False, forceinline=True)
def prepare(cell, count, series, real, whole, log):  # type: ignore[no-untyped-def]
    """Fill the blocks of deviates that hold the next draws."""
    if whole[CONSTANT] == 0:
        for i in range(PAD, PAD + whole[N]):
            if count[DRAWS, i] & 3 != 0:
                _fill_deviates(cell, count, series, real, whole, log, i, count[DRAWS, i] >> 2)


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False)
def follow(cell, count, series, real, whole, log, theta, theta_low, travel, max_events, single):  # type: ignore[no-untyped-def]
    """Take the chain along the targets; return why it came back, and how many it reached.

    Parameters
    ----------
    w : Work
    theta, theta_low : ndarray, shape (m,)
        The targets, ``l0 theta`` as two floats.
    travel : ndarray, shape (m,)
        Filled with the sum of all displacements at each target reached.
    max_events : int
        Return soon after so many further events.
    single : bool
        Return after the first rearrangement.
    """
    stop_at = whole[EVENTS] + max_events
    reached = 0
    room = log.shape[0] - 2 * whole[N] - 4
    while reached < theta.size:
        stage = whole[STAGE]
        if whole[EVENTS] >= stop_at:
            return BUDGET, reached
        if whole[LOGGING] == 1 and whole[LOGGED] > room:
            return LOG_FULL, reached
        if stage == AT_REST:
            if not _ramp(cell, count, series, real, whole, log, theta[reached], theta_low[reached]):
                travel[reached] = real[TOTAL] + real[TOTAL_LOW]
                reached += 1
                whole[TARGET] += 1
        elif stage == LONE:
            if _lone(cell, count, series, real, whole, log):
                return RUNAWAY, reached
        elif stage == CLUSTER:
            if _cluster(cell, count, series, real, whole, log):
                return RUNAWAY, reached
        else:
            _unstable(cell, count, series, real, whole, log)
        if single and whole[STAGE] == AT_REST:
            return ONE_DONE, reached
    return DONE, reached
