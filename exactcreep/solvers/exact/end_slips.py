"""Rearrangements that are one slip of an end slider, one after the other and without a loop.

Sliders 1 and N alone feel theta. Between two avalanches one of them slips, again and again, by
twice its excess each time, and nobody else moves: where the next slip begins and how far it goes
follows from the thresholds alone. With two sliders nearly all motion is of this kind.

Everything that is not plainly so, comparisons within their bounds included, is left to `loop`,
which does the same with the same bits.

Source: Eqs. 5, 7, 8, 10; derivations/slip.py.
"""

from __future__ import annotations

import numpy as np

from exactcreep.compiling import compiled, inlined
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
"""Friction forces: a slip from an excess below that ends with a force that friction holds.

It ends with friction minus the excess, in the direction in which it went. From two friction forces
on the slider would go back; the tenth is far more than rounding.
"""
_SLACK = 64.0 * ULP
"""Of the sum of all forces that enter: how close to a comparison is not plain any more.

The bounds of the comparisons in `ramps` and `loop` are below 10 ulp of that sum, and what
is compared here instead is rounded by less than 8.
"""


@inlined
def _plus_in_lanes(high, low, term):
    """Return in every lane the two floats of `plus`."""
    total = high + term
    # the rounding error is exact either way; from the larger term it is known sooner
    grew = abs(high) < abs(term)
    error = choose(grew, high - (total - term), term - (total - high)) + low
    result = total + error
    return result, error - (result - total)


@inlined
def _same_end_slips(cell, whole, deviate, now, target, target_low, stop_at):
    """Let the end that starts first slip, again and again, as long as that is plain.

    Each slip adds the same length to four sums of two floats: they stay in registers, in four
    lanes of a vector. That the same end starts next, before the target and with nobody else, is
    read off rounded forces; what comes closer than `slack`, which exceeds their rounding and the
    bounds of all comparisons in `ramps` and `loop`, is left to these. Both ways give
    the same bits.
    """
    chain = now.chain
    n = chain.n
    constant = chain.constant == 1
    up = 1.0 if (target - now.theta) + (target_low - now.theta_low) > 0.0 else -1.0
    i = PAD
    other = PAD + n - 1
    neighbour = PAD + 1
    way = 1.0
    # up times the critical l0 theta of both ends
    first = cell[layout.FRICTION, i] + cell[layout.EXCESS, i] + up * cell[layout.FORCE, i]
    second = cell[layout.FRICTION, other] + cell[layout.EXCESS, other]
    second -= up * cell[layout.FORCE, other]
    if second < first:
        first, second = second, first
        i, other = other, i
        neighbour = i - 1
        way = -1.0
    side = -up * way
    friction = cell[layout.FRICTION, i]
    beside = cell[layout.FRICTION, neighbour]
    excess = cell[layout.EXCESS, i]
    spare = cell[layout.EXCESS, neighbour]
    between = side * (
        cell[layout.FORCE, i] + cell[layout.FORCE, neighbour]
    )  # a slip does not change it
    scale = abs(target) + abs(now.theta) + 8.0 * chain.friction + cell[layout.EXCESS, other] + spare
    scale += (
        abs(cell[layout.FORCE, i])
        + abs(cell[layout.FORCE, other])
        + abs(cell[layout.FORCE, neighbour])
    )
    slack = _SLACK * scale
    if first <= up * now.theta + slack:
        return
    reach = up * target - slack
    most = _PLAIN * friction
    # the neighbour starts where theta_c and the excess come to this
    wall = friction + beside + spare - between
    if n == 2:
        # it is the other end and feels theta itself: what counts is the excess alone
        most = min(most, spare + between + (beside - friction), wall)
        wall = np.inf
    else:
        reach = min(reach, second - slack)
        wall -= slack
    most -= slack
    high = together(
        cell[layout.FORCE, i], cell[layout.FORCE, neighbour], cell[layout.TRAVEL, i], now.total
    )
    low = together(
        cell[layout.FORCE_LOW, i],
        cell[layout.FORCE_LOW, neighbour],
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
        if not (slack < excess < most and theta < reach and theta + excess < wall):
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
    cell[layout.FORCE, neighbour] = lane_of(high, 1)
    cell[layout.FORCE_LOW, neighbour] = lane_of(low, 1)
    cell[layout.REST, neighbour] = lane_of(high, 1)
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


@compiled
def end_slips(cell, whole, deviate, now, target, target_low, stop_at):
    """Ramp towards the target through rearrangements that are one slip of slider 1 or N.

    Does what `loop` does in a ramp, a lone slip and at rest, without what such a slip can skip.
    """
    before = -1
    while before < now.counts.events < stop_at:
        before = now.counts.events
        _same_end_slips(cell, whole, deviate, now, target, target_low, stop_at)
