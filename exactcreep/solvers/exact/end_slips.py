"""Rearrangements of two sliders that are a single slip, one after the other, without a loop.

Nearly all motion of two sliders is of this kind: one of them slips repeatedly, each time by twice
its excess, and the thresholds alone determine where the next slip begins and how long it is. From
three sliders on this would gain nothing (measured).

Everything else, including comparisons within their bounds, is left to `loop`, which gives the same
bits.

Source: Eqs. 5, 7, 8, 10; derivations/slip.py.
"""

from __future__ import annotations

from exactcreep.compiling import apart, inlined
from exactcreep.solvers.exact import layout
from exactcreep.solvers.exact.double_double import plus
from exactcreep.solvers.exact.draws import (
    BATCH,
    KEPT,
    coefficient,
    distribution,
    draw_ahead,
    excess_of,
    renew,
)  # fmt: skip
from exactcreep.solvers.exact.layout import PAD, ULP
from exactcreep.solvers.exact.simd import choose, lane_of, together

_PLAIN = 1.9
"""A slip from an excess below this many friction forces ends with a force that friction holds.

It ends with friction minus the excess, in the direction of the slip. From two friction forces on,
the slider would go back; the margin of 0.1 is far more than rounding.
"""
_SLACK = 64.0 * ULP
"""Distance, relative to the sum of all forces, within which a comparison is left to `loop`.

The bounds of the comparisons in `ramps` and `loop` are below 10 ulp of that sum, and the numbers
compared here are rounded by less than 8.
"""


@inlined
def _plus_in_lanes(high, low, term):
    """Return in every lane the two floats of `plus`."""
    total = high + term
    # the rounding error is exact in both cases; starting from the larger term is faster
    grew = abs(high) < abs(term)
    error = choose(grew, high - (total - term), term - (total - high)) + low
    result = total + error
    return result, error - (result - total)


@inlined
def _same_end_slips(cell, whole, deviate, now, target, target_low, stop_at):
    """Let the slider that starts first slip repeatedly, while no comparison is close.

    Each slip adds the same length to four sums of two floats, which stay in registers as four lanes
    of a vector. Rounded forces show that the same slider starts next, alone, before the target. A
    comparison within `slack`, which exceeds all bounds in `ramps` and `loop`, is left to them; both
    ways give the same bits.
    """
    chain = now.chain
    constant = chain.constant == 1
    up = 1.0 if (target - now.theta) + (target_low - now.theta_low) > 0.0 else -1.0
    i = PAD
    other = PAD + 1
    way = 1.0
    # up times the critical l0 theta of both
    first = cell[layout.FRICTION, i] + cell[layout.EXCESS, i] + up * cell[layout.FORCE, i]
    second = cell[layout.FRICTION, other] + cell[layout.EXCESS, other]
    second -= up * cell[layout.FORCE, other]
    if second < first:
        first = second
        i, other = other, i
        way = -1.0
    side = -up * way
    friction = cell[layout.FRICTION, i]
    beside = cell[layout.FRICTION, other]
    excess = cell[layout.EXCESS, i]
    spare = cell[layout.EXCESS, other]
    # a slip does not change this sum
    between = side * (cell[layout.FORCE, i] + cell[layout.FORCE, other])
    scale = abs(target) + abs(now.theta) + 4.0 * (friction + beside) + 2.0 * spare
    scale += abs(cell[layout.FORCE, i]) + 2.0 * abs(cell[layout.FORCE, other])
    slack = _SLACK * scale
    if first <= up * now.theta + slack:
        return
    reach = up * target - slack
    # the other slider feels theta, too: whether it starts depends on the excess alone
    most = min(spare + between + (beside - friction), friction + beside + spare - between)
    most = min(_PLAIN * friction, most) - slack
    high = together(
        cell[layout.FORCE, i], cell[layout.FORCE, other], cell[layout.TRAVEL, i], now.total
    )
    low = together(
        cell[layout.FORCE_LOW, i],
        cell[layout.FORCE_LOW, other],
        cell[layout.TRAVEL_LOW, i],
        now.total_low,
    )
    ways = together(-side, side, side, side)
    high_before = high
    low_before = low
    excess_before = excess
    of, mean_excess = distribution(cell, now, i), cell[layout.MEAN_EXCESS, i]
    k = whole[layout.DRAWS, i]
    slips = 0
    allowed = (stop_at - now.counts.events + 1) // 2
    while slips < allowed:
        theta = (friction + excess) - side * lane_of(high, 0)
        if not (slack < excess < most and theta < reach):
            break
        high_before = high
        low_before = low
        excess_before = excess
        high, low = _plus_in_lanes(high, low, ways * (2.0 * excess))
        slips += 1
        if not constant:
            if k % BATCH == 0:
                draw_ahead(deviate, now, i, k)
            _, above = coefficient(of, deviate[i, k % KEPT])
            excess = excess_of(now, above)
        else:
            excess = mean_excess
        k += 1
    if slips == 0:
        return
    cell[layout.FORCE, i] = lane_of(high, 0)
    cell[layout.FORCE_LOW, i] = lane_of(low, 0)
    cell[layout.FORCE, other] = lane_of(high, 1)
    cell[layout.FORCE_LOW, other] = lane_of(low, 1)
    cell[layout.REST, other] = lane_of(high, 1)
    cell[layout.TRAVEL, i] = lane_of(high, 2)
    cell[layout.TRAVEL_LOW, i] = lane_of(low, 2)
    now.total = lane_of(high, 3)
    now.total_low = lane_of(low, 3)
    now.theta, now.theta_low = plus(
        way * lane_of(high_before, 0), way * lane_of(low_before, 0), up * (friction + excess_before)
    )
    whole[layout.DRAWS, i] = k
    if constant:
        cell[layout.EXCESS, i] = mean_excess
    else:
        renew(cell, now, i, deviate[i, (k - 1) % KEPT])
    whole[layout.SLIPS, i] += slips
    now.counts.slips += slips
    now.counts.rearrangements += slips
    now.counts.events += 2 * slips


@apart
def end_slips(cell, whole, deviate, now, target, target_low, stop_at):
    """Ramp towards the target through rearrangements that are one slip of slider 1 or 2.

    Equivalent to a ramp, a lone slip and a rest in `loop`, without steps that such a slip can skip.
    """
    before = -1
    while before < now.counts.events < stop_at:
        before = now.counts.events
        _same_end_slips(cell, whole, deviate, now, target, target_low, stop_at)
