"""Find the sliders that start next on a ramp of theta, and the critical ``l0 theta``.

Source: Eqs. 5-8; derivations/chain.py.
"""

from __future__ import annotations

import numpy as np

from exactcreep.compiling import compiled, inlined
from exactcreep.model.rules import FLOATS
from exactcreep.solvers.exact import layout
from exactcreep.solvers.exact.double_double import plus, times
from exactcreep.solvers.exact.layout import PAD, ULP

_is_before, _order, _driven = FLOATS.is_before, FLOATS.order, FLOATS.driven


@inlined
def next_start(cell, whole, now, target, target_low):
    """Return the next start before the target if only sliders 1 and N feel theta.

    Returns the number of sliders that start together (their columns are in ``whole[EVENT]``), the
    critical ``l0 theta`` as two floats (the target if no slider starts), and whether a comparison
    was within its rounding bound.
    """
    top = PAD
    end = PAD + now.chain.n - 1
    theta = now.theta
    theta_low = now.theta_low
    far = (target - theta) + (target_low - theta_low)
    up = 1.0 if far > 0.0 else -1.0
    room_top = cell[layout.FRICTION, top] + cell[layout.EXCESS, top]
    room_end = cell[layout.FRICTION, end] + cell[layout.EXCESS, end]
    # slider 1 starts with sign -up at f_1 + up room, slider N with sign up at up room - f_N
    top_high, top_low = plus(cell[layout.FORCE, top], cell[layout.FORCE_LOW, top], up * room_top)
    end_high, end_low = plus(-cell[layout.FORCE, end], -cell[layout.FORCE_LOW, end], up * room_end)
    far_top = max(up * ((top_high - theta) + (top_low - theta_low)), 0.0)
    far_end = max(up * ((end_high - theta) + (end_low - theta_low)), 0.0)
    far *= up
    # the rooms, and possible rounding errors of the slips since the last change of direction
    bound = 2.0 * ULP * (room_top + room_end + abs(top_high) + abs(end_high))
    nearest = min(far_top, far_end)
    starts, close = _is_before(nearest, far, bound)
    if now.chain.n == 1 or far == 0.0 or not starts:
        return 0, target, target_low, close and now.chain.n > 1 and far > 0.0
    order, close = _order(far_top, far_end, bound)
    if nearest > 0.0:
        theta, theta_low = (top_high, top_low) if far_top <= far_end else (end_high, end_low)
    whole[layout.EVENT, 0] = top if order <= 0 else end
    whole[layout.EVENT, 1] = end
    return (2 if order == 0 else 1), theta, theta_low, close


@inlined
def _start_of(cell, now, up, i):
    """Return how far ``l0 theta`` can go in direction `up` until a slider starts.

    Also returns the error of this distance, and the critical ``l0 theta`` as two floats.
    """
    rate = cell[layout.RATE, i]
    room = cell[layout.FRICTION, i] + cell[layout.EXCESS, i]
    sign, _ = _driven(rate, up)
    high, low = plus(-cell[layout.FORCE, i], -cell[layout.FORCE_LOW, i], sign * room)
    theta = high / rate
    reached, error = times(rate, cell[layout.RATE_LOW, i], theta, 0.0)
    theta_low = ((high - reached) + (low - error)) / rate
    ahead = max(up * ((theta - now.theta) + (theta_low - now.theta_low)), 0.0)
    if not ahead < np.inf:  # the rate is almost zero
        ahead = np.inf
    return ahead, 4.0 * ULP * (room + abs(high)) / abs(rate), theta, theta_low


@compiled
def next_uneven_start(cell, whole, now, target, target_low):
    """Return the same as `next_start` if theta drives any slider, each at its own rate."""
    far = (target - now.theta) + (target_low - now.theta_low)
    up = 1.0 if far > 0.0 else -1.0
    far *= up
    nearest = np.inf
    bound = 0.0
    theta, theta_low = target, target_low
    for i in range(PAD, PAD + now.chain.n):
        if cell[layout.RATE, i] != 0.0:
            ahead, off, high, low = _start_of(cell, now, up, i)
            if ahead < nearest:
                nearest, bound, theta, theta_low = ahead, off, high, low
    before, close = _is_before(nearest, far, bound)
    if far == 0.0 or not before:
        return 0, target, target_low, close and far > 0.0
    if nearest == 0.0:
        theta, theta_low = now.theta, now.theta_low
    starts = 0
    for i in range(PAD, PAD + now.chain.n):
        if cell[layout.RATE, i] != 0.0:
            ahead, off, high, low = _start_of(cell, now, up, i)
            order, _ = _order(nearest, ahead, bound + off)
            if order >= 0:
                whole[layout.EVENT, starts] = i
                starts += 1
    return starts, theta, theta_low, starts > 1
