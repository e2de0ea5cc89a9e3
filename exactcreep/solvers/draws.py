"""Static coefficients in batches for the compiled solver: the same bits as `model.disorder`."""

from __future__ import annotations

from exactcreep.model.disorder import (
    CENTRAL,
    CENTRAL_SQUARE,
    DENOMINATOR,
    NUMERATOR,
    STREAM_COEFFICIENT,
    centred,
    normal_tail,
    philox,
)
from exactcreep.solvers.lanes import (
    WIDTH,
    choose,
    load,
    lowest_bit,
    magnitude,
    not_above,
    spread,
    store,
)
from exactcreep.solvers.layout import inlined

BATCH = WIDTH
"""Deviates made at a time."""


@inlined
def fill(deviate, row, seed, slider, batch):  # type: ignore[no-untyped-def]
    """Fill deviate[row] with draws 8 batch .. 8 batch + 7 of a slider.

    The central formula is evaluated for all eight; the tails (15 %) one by one. No operation is
    fused, so that every lane has the bits of `disorder.normal_deviate`.
    """
    for half in range(2):
        words = philox(seed, STREAM_COEFFICIENT, slider, 2 * batch + half)
        for j in range(4):
            deviate[row, 4 * half + j] = centred(words[j])
    q = load(deviate, row, 0)
    r = spread(CENTRAL_SQUARE) - q * q
    top = spread(NUMERATOR[0])
    low = spread(DENOMINATOR[0])
    for k in range(1, 8):
        top = top * r + spread(NUMERATOR[k])
        low = low * r + spread(DENOMINATOR[k])
    central = not_above(magnitude(q), spread(CENTRAL))
    store(deviate, row, 0, choose(central, q * top / low, q))
    tails = central ^ 255
    while tails != 0:
        j = lowest_bit(tails)
        tails &= tails - 1
        deviate[row, j] = normal_tail(deviate[row, j])
