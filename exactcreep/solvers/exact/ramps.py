"""Find the sliders that start next on a ramp of theta, and the critical ``l0 theta``.

Source: Eqs. 5-8; derivations/chain.py.
"""

from __future__ import annotations

import numpy as np

from exactcreep.compiling import inlined
from exactcreep.model.rules import FLOATS
from exactcreep.solvers.exact import layout
from exactcreep.solvers.exact.double_double import plus, times
from exactcreep.solvers.exact.layout import ULP

_is_before, _order, _driven = FLOATS.is_before, FLOATS.order, FLOATS.driven


@inlined
def _start_of(cell, now, up, i):
    """Return how far ``l0 theta`` can go in direction `up` until a slider starts.

    Also returns the error of this distance, and the critical ``l0 theta`` as two floats.
    """
    rate = cell[layout.RATE, i]
    room = cell[layout.FRICTION, i] + cell[layout.EXCESS, i]
    sign, _ = _driven(rate, up)
    high, low = plus(-cell[layout.FORCE, i], -cell[layout.FORCE_LOW, i], sign * room)
    theta, theta_low = rate * high, rate * low
    if abs(rate) != 1.0:  # else this is the quotient, without a division
        theta = high / rate
        reached, error = times(rate, cell[layout.RATE_LOW, i], theta, 0.0)
        theta_low = ((high - reached) + (low - error)) / rate
    ahead = max(up * ((theta - now.theta) + (theta_low - now.theta_low)), 0.0)
    if not ahead < np.inf:  # the rate is almost zero
        ahead = np.inf
    return ahead, 4.0 * ULP * (room + abs(high)) / abs(rate), theta, theta_low


@inlined
def next_start(cell, whole, now, target, target_low):
    """Return the next start before the target of the sliders that theta drives.

    Returns the number of sliders that start together (their columns are in ``whole[EVENT]``), the
    critical ``l0 theta`` as two floats (the target if no slider starts), and whether a comparison
    was within its rounding bound.
    """
    far = (target - now.theta) + (target_low - now.theta_low)
    up = 1.0 if far > 0.0 else -1.0
    far *= up
    nearest = np.inf
    bound = 0.0
    first = 0
    theta, theta_low = target, target_low
    for k in range(now.chain.driven):
        ahead, off, high, low = _start_of(cell, now, up, whole[layout.DRIVEN, k])
        if ahead < nearest:
            nearest, bound, theta, theta_low = ahead, off, high, low
            first = k
    before, close = _is_before(nearest, far, bound)
    if far == 0.0 or not before:
        return 0, target, target_low, close and far > 0.0
    if nearest == 0.0:
        theta, theta_low = now.theta, now.theta_low
    starts = 0
    for k in range(now.chain.driven):
        i = whole[layout.DRIVEN, k]
        order = 0
        if k != first:
            ahead, off, _, _ = _start_of(cell, now, up, i)
            order, _ = _order(nearest, ahead, bound + off)
        if order >= 0:
            whole[layout.EVENT, starts] = i
            starts += 1
    return starts, theta, theta_low, starts > 1
