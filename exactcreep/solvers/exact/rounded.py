"""A chain that is rounded once more after every rearrangement, beside one that is followed.

Two such copies part as a run and the truth do: the run rounds at every event, and what was off only
at its start may be forgotten at the next stop.
"""

from __future__ import annotations

import math

import numpy as np

from exactcreep.solvers.exact import layout as cells
from exactcreep.solvers.exact.double_double import add, plus
from exactcreep.solvers.exact.layout import PAD, compiled
from exactcreep.solvers.exact.loop import follow
from exactcreep.solvers.exact.rows import AtTargets


@compiled
def follow_rounded(
    cell, count, deviate, clock, series, scalars, log, theta, theta_low, targets, max_events,
    max_work, copy, size, mirrored,
):  # fmt: skip
    """Do what `loop.follow` does, with roundings by `size` after each rearrangement.

    Their signs depend on the number of the copy and of the rearrangement alone, so that it does not
    matter where a call ends.
    """
    now = scalars[0]
    stop_at = now.counts.events + min(max_events, max_work)
    work_limit = now.counts.work + max_work
    reached = 0
    while reached < theta.size:
        left, work = stop_at - now.counts.events, work_limit - now.counts.work
        if left <= 0 or work <= 0:
            return cells.BUDGET, reached
        moves, before = now.stage != cells.AT_REST, now.counts.rearrangements
        part = AtTargets(
            targets.total[reached:], targets.doubts[reached:], targets.x[reached:],
            targets.tension[reached:], targets.slips[reached:],
            targets.begun, targets.load, targets.load_low,
        )  # fmt: skip
        reason, passed = follow(
            cell, count, deviate, clock, series, scalars, log, theta[reached:], theta_low[reached:],
            part, left, work, True,
        )  # fmt: skip
        reached += passed
        began = now.counts.rearrangements > before
        if now.stage == cells.AT_REST and (began or (moves and before > 0)):
            _round(cell, now, copy, size * math.sqrt(float(now.number)), mirrored)
        if reason != cells.ONE_DONE and reason != cells.DONE:
            return reason, reached
    return cells.DONE, reached


@compiled
def _round(cell, now, copy, size, mirrored):
    """Move every slider that the last rearrangement can have moved by `size`, up or down."""
    n = now.chain.n
    word = np.uint64(now.counts.rearrangements) * np.uint64(0x9E3779B97F4A7C15)
    word ^= np.uint64(copy + 1) * np.uint64(0xD1B54A32D192ED03)
    for _ in range(2):  # Marsaglia's xorshift
        word ^= word << np.uint64(13)
        word ^= word >> np.uint64(7)
        word ^= word << np.uint64(17)
    first, last = now.touched_first, now.touched_last
    for i in range(first, last + 1):
        k, way = i - PAD, 1.0
        if mirrored:
            if 2 * k == n - 1:
                continue
            if 2 * k > n - 1:
                k, way = n - 1 - k, -1.0
        moved = way * size
        if (word >> np.uint64(k % 64)) & np.uint64(1):
            moved = -moved
        add(cell, cells.TRAVEL, cells.TRAVEL_LOW, i, moved)
        now.total, now.total_low = plus(now.total, now.total_low, moved)
        add(cell, cells.FORCE, cells.FORCE_LOW, i, -cell[cells.STIFFNESS, i] * moved)
        cell[cells.REST, i] = cell[cells.FORCE, i]
        for j in (i - 1, i + 1):
            if PAD <= j < PAD + n:
                add(cell, cells.FORCE, cells.FORCE_LOW, j, moved)
                cell[cells.REST, j] = cell[cells.FORCE, j]
