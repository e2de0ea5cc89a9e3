"""Where an event finds the moving sliders, by one evaluation nearby and a Taylor series from there.

Derivatives v^(k) have a norm of at most ``2^k (|v| + |a| / 2)`` with the v and a of the same time;
within d of a time these are at most ``|v| + d |a|`` and ``|a| + 2 |v|`` of then. What is left out
of a series is therefore bounded.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise
from typing import Any

import flint

from exactcreep.motion.arithmetic import balls_of
from exactcreep.motion.modes import Run

NEAREST = 2.0**-8
"""No series from farther away: it would be as long as it is dear."""


def placed(
    runs: Sequence[Run], acting: tuple[int, int], room: Any, time: float, radius: float
) -> tuple[Any, list[tuple[int, list[Any], list[Any]]]] | None:
    """Return the time of an event, and first slider, displacements, velocities of every run then.

    Parameters
    ----------
    runs : sequence of Run
        In balls; the call is made inside their arithmetic's `active`.
    acting : tuple of (int, int)
        Who acts: the slider (from 0), and 0 for a stop or the direction in which it starts.
    room : ball
        What a slider that starts lacks to its threshold at the beginning.
    time, radius : float
        The event's function has exactly one root between ``time - radius`` and ``time + radius``.

    Returns
    -------
    tuple or None
        In balls; None if the slope is not separated from zero.

    Raises
    ------
    AssertionError
        If there is no root between these times.
    """
    if not radius < NEAREST:
        return None
    slider, side = acting
    bits = runs[0].motion.arithmetic.bits
    order = math.ceil(bits / -math.log2(2 * radius)) + 1
    at = flint.arb(time)
    series = [(run, _derivatives(run, at, order)) for run in runs]
    # what v and a / 2 may come to meanwhile is at most twice their sum now
    size = sum(float(abs(x)) for _, rows in series for row in rows[1:3] for x in row)
    # beyond v^(order): in displacements and velocities, and in accelerations
    bound = flint.arb(4 * (1 + size)) * (2 * flint.arb(radius)) ** order
    rest = flint.arb(0, bound / math.factorial(order))
    function = [flint.arb(0)] * (order + 1)
    if side:
        function[0] = room
    for run, rows in series:
        if side == 0 and slider in run.sliders:
            function = [row[slider - run.first] for row in rows[1:]]
        for n in (slider - 1, slider + 1):
            if side and n in run.sliders:
                i = n - run.first
                function = [f - side * row[i] for f, row in zip(function, rows, strict=False)]
    poly = flint.arb_poly([x / k for x, k in zip(function, _factorials(order), strict=True)])
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
    found = []
    for run, rows in series:
        p = run.motion.p
        both = flint.arb_mat([now + after for now, after in pairwise(rows)])
        moved = [x + rest for x in (across * both).entries()]
        found.append((run.first, moved[:p], moved[p:]))
    return at + root, found


def _newton(poly: Any, rate: Any, bits: int, radius: float) -> Any:
    """Return the root of a polynomial that is `radius` at most, as well as its slope wants it.

    One more step with the slope in all of the radius gains what the slope is known to.
    """
    near, known = flint.arb(0), -math.log2(radius)
    most = bits - known + 16
    while known < most:
        known *= 2
        with balls_of(min(bits, math.ceil(known) + 64)).active():
            near = (near - poly(near) / rate(near)).mid()
    return near


@lru_cache(maxsize=256)
def _factorials(order: int) -> list[int]:
    """Return ``0!`` .. ``order!``."""
    return [math.factorial(k) for k in range(order + 1)]


def _derivatives(run: Run, at: Any, order: int) -> list[list[Any]]:
    """Return displacements at a time, velocities, and their derivatives up to that order."""
    motion = run.motion
    ends, last = motion.ends, motion.p - 1
    own = [-2] * motion.p
    own[0] += ends.left_free
    own[last] += ends.right_free
    moved, speeds = (x.tolist() for x in motion.moved(at))
    pulls = motion.accelerations.tolist()
    rows = [moved, speeds, [f + b for f, b in zip(pulls, _bent(own, moved), strict=True)]]
    while len(rows) < order + 2:
        rows.append(_bent(own, rows[-2]))
    return rows


def _bent(own: list[int], x: list[Any]) -> list[Any]:
    """Return -K x."""
    out = [k * y for k, y in zip(own, x, strict=True)]
    for i in range(len(x) - 1):
        out[i] += x[i + 1]
        out[i + 1] += x[i]
    return out
