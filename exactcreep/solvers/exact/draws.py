"""Static coefficients in batches for the compiled solver, with the same bits as `disorder`."""

from __future__ import annotations

import math

import numpy as np

from exactcreep.compiling import apart, inlined
from exactcreep.model import deviates
from exactcreep.model.keyed_disorder import STREAM_COEFFICIENT
from exactcreep.solvers.exact import layout
from exactcreep.solvers.exact.layout import PAD
from exactcreep.solvers.exact.simd import (
    WIDTH,
    choose,
    exponent,
    lane_of,
    lowest_bit,
    mantissa,
    store,
    upper_bits,
)

BATCH = WIDTH
"""Deviates made at a time."""
KEPT = 2 * BATCH
"""Deviates stored for every slider: draw k in column k % KEPT."""


@inlined
def _logarithm(x):
    m = mantissa(x)
    e = exponent(x)
    small = m < deviates.ROOT_HALF
    return deviates.logarithm_of(choose(small, 2.0 * m, m), choose(small, e - 1.0, e))


@inlined
def write_deviates(q, deviate, row, column):
    """Write the normal deviates of the eight probabilities 1/2 + q to deviate[row, column ..].

    No operation is fused or reordered, so that every lane has the bits of
    `disorder.normal_deviate`, which also computes far tails (three draws in 10**11).
    """
    top, low = deviates.fraction(
        deviates.NUMERATOR, deviates.DENOMINATOR, deviates.CENTRAL_SQUARE - q * q
    )
    central = q * top / low
    tails = (abs(q) <= deviates.CENTRAL) ^ 255
    r = math.sqrt(0.0 - _logarithm(0.5 - abs(q)))
    far = tails & ~(r <= deviates.NEAR_TAIL)
    top, low = deviates.fraction(
        deviates.NEAR_NUMERATOR, deviates.NEAR_DENOMINATOR, r - deviates.NEAR_CENTRE
    )
    tail = top / low
    tail = choose(q < 0.0, 0.0 - tail, tail)
    store(deviate, row, column, choose(tails, tail, central))
    while far != 0:
        j = lowest_bit(far)
        far &= far - 1
        deviate[row, column + j] = deviates.normal_tail(lane_of(q, j))


@apart
def fill(deviate, row, seed, slider, batch):
    """Write draws 8 batch .. 8 batch + 7 of a slider to their columns of deviate[row]."""
    a, b, c, d = deviates.philox(seed, STREAM_COEFFICIENT, slider, 2 * batch)
    e, f, g, h = deviates.philox(seed, STREAM_COEFFICIENT, slider, 2 * batch + 1)
    q = upper_bits(a, b, c, d, e, f, g, h) * deviates.CELL + deviates.CENTRE
    write_deviates(q, deviate, row, BATCH * batch % KEPT)


@inlined
def distribution(cell, now, i):
    """Return the numbers with which `coefficient` turns deviates into coefficients of slider i."""
    return now.chain.width, cell[layout.MEAN, i], cell[layout.MU_D, i], cell[layout.MU_D_LOW, i]


@inlined
def coefficient(of, deviate):
    """Return the static coefficient of a deviate, and its distance above mu_d."""
    width, mean, mu_d, mu_d_low = of
    mu = mean + width * deviate
    return mu, (mu - mu_d) - mu_d_low


@inlined
def excess_of(now, above):
    """Return the excess of a coefficient at this distance above mu_d, or 0 if it is below."""
    return max(above, 0.0) * now.chain.cosine


@inlined
def renew(cell, now, i, deviate):
    """Give slider i the static coefficient of a deviate."""
    mu, above = coefficient(distribution(cell, now, i), deviate)
    cell[layout.COEFFICIENT, i] = mu
    now.counts.below += above < 0.0
    cell[layout.EXCESS, i] = excess_of(now, above)


@inlined
def draw_ahead(deviate, now, i, k):
    """Make the batch after the batch of draw k.

    Nothing depends on it yet, so the processor computes it in parallel with other work.
    """
    fill(deviate, i, np.uint64(now.chain.seed), i + 1 - PAD, k // BATCH + 1)


@inlined
def draw(cell, whole, deviate, now, i):
    """Give slider i its next static coefficient."""
    k = whole[layout.DRAWS, i]
    whole[layout.DRAWS, i] = k + 1
    if now.chain.constant == 1:
        cell[layout.EXCESS, i] = cell[layout.MEAN_EXCESS, i]
        return
    if k % BATCH == 0:
        draw_ahead(deviate, now, i, k)
    renew(cell, now, i, deviate[i, k % KEPT])
