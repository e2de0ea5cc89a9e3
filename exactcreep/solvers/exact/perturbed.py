"""Estimate the rounding error of a rearrangement from perturbed copies, a few roundings off.

A copy goes through the same compiled loop from tensions and thresholds that are a rounding off, and
every event moves it by another. How far copies end from the rearrangement itself says how far
rounding may have taken that; a copy with another itinerary puts the order of events in doubt.

That is no proof, but a sample of what rounding does. Where a comparison was counted as undecided
no copy is asked: the error is infinite. Elsewhere a sample may miss a margin that rounding has
crossed, since its copies may happen to move it little. So the last two copies are far off, to
either side: the margin that comes to its end first along their way is the smallest that was met. If
it does in one of them, further copies ask whether rounding may have crossed it.

With margins that rounding moves by N(0, 1) and copies by N(0, 2), three pairs miss one in 24 of
those that it has crossed; two pairs, the far one and eight more miss one in 350.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.chain import Chain
from exactcreep.model.state import mirrored
from exactcreep.solvers.exact import layout as cells
from exactcreep.solvers.exact.layout import PAD, compiled, inlined
from exactcreep.solvers.exact.loop import follow, prepare
from exactcreep.solvers.exact.pack import Origin, Workspace, place, readied, roomier
from exactcreep.solvers.exact.rows import NOTHING, PLACE, PLACE_LOW, TENSION_LOW
from exactcreep.solvers.interface import TENSION_TOLERANCE

COPIES = 6
"""In pairs, whose two are as far off to either side."""
FAR = 64.0
"""How many times as far off as the others the last pair is."""
FURTHER_COPIES = 16
"""Where a copy of that pair has another itinerary."""
OFF = 2.0**-51
"""How far tensions and thresholds of a copy are off at first, over the largest force."""
ROUNDING = 2.0**-53
"""And how much further displacements and velocities of all that moves are off after every event.

Twice what the loop itself makes there: of 2**-52 the median over movers was 0.1, and at most 0.4 in
nine of ten steps (from event to event, against 50 digits)."""
MARGIN = 2.0
"""The estimate over the largest distance of a copy: four times what one rounding makes."""
_KINDS = ("start", "stop")
_WORD = np.uint64(0x9E3779B97F4A7C15)
"""Of whose bits the signs are made; its complement makes others."""
_SPARE: dict[int, list[Workspace]] = {}
"""By lengths of short chains: arrays of copies that are over, as many as ran at once."""


class RoundingError(NamedTuple):
    """How well float64 holds a rearrangement.

    Attributes
    ----------
    error : float
        Estimate of the largest error of a tension (unit ``m g``) or of a displacement since the
        start of the rearrangement (unit ``g tau_dyn**2``) at the last event; inf if the order of
        events itself is in doubt.
    doubt : str
        For inf: the first event that differs in a copy, or how many comparisons were undecided;
        else empty.
    """

    error: float
    doubt: str

    @property
    def holds(self) -> bool:
        """Whether the estimate is within `TENSION_TOLERANCE`."""
        return self.error <= TENSION_TOLERANCE

    def sentence(self) -> str:
        """Return why the promise may not be kept; empty if it is."""
        if self.holds:
            return ""
        if self.doubt:
            return f"rounding may have changed the order of events: {self.doubt}"
        return f"rounding may have grown to {self.error:.2g}, beyond {TENSION_TOLERANCE:g}"


def undecided_by(comparisons: int) -> RoundingError:
    """Return the error where so many comparisons were settled by the rules: any may be wrong."""
    count = "1 comparison lies" if comparisons == 1 else f"{comparisons} comparisons lie"
    return RoundingError(np.inf, f"{count} within the rounding bound")


def rounding_error(
    chain: Chain, origin: Origin, seed: int, direction: int, log: NDArray[Any]
) -> RoundingError:
    """Return an estimate of what rounding in float64 has done to a rearrangement.

    Parameters
    ----------
    chain : Chain
    origin : Origin
        The state from which theta was ramped.
    seed : int
        Keys the coefficients that were drawn at stops.
    direction : int
        Of the ramp; 0: as the chain stood.
    log : ndarray of layout.LOGGED_EVENT
        What happened.

    Guarantee: none but the same bits for the same arguments.
    """
    if not len(log):
        return RoundingError(0.0, "")
    n = chain.n
    spare = _SPARE.setdefault(n, [])
    work = readied(chain, origin, seed, cells.LOGS_EVENTS, spare.pop() if spare else None)
    if work.series is None:
        work = roomier(work)
    target, target_low = (np.array([part]) for part in origin.load)
    if direction != 0 and n > 1:
        target, target_low = np.array([np.inf * direction]), np.zeros(1)
    numbers, end = origin.numbers.copy(), np.empty(n)
    low, begun = numbers[TENSION_LOW].copy(), work.now.copy()
    error = 0.0
    for word, copies, far in ((_WORD, COPIES, FAR), (~_WORD, FURTHER_COPIES, 1.0)):
        differs, copy, distance = run_copies(
            *work, begun, numbers, origin.state.draws, target, target_low, NOTHING, 1, True,
            log, low, end, mirrored(chain, origin.state), word, copies, far,
        )  # fmt: skip
        error = max(error, MARGIN * distance)
        if copy <= copies - 2:
            break
    if n <= cells.LONGEST_SHORT:
        spare.append(work)
    if differs < 0:
        return RoundingError(error, "")
    event = log[min(differs, len(log) - 1)]
    which = f"event {event['number'] + 1}, the {_KINDS[event['kind']]} of slider {event['slider']},"
    how = "another" if differs < len(log) else "not the last"
    return RoundingError(np.inf, f"{which} is {how} in a copy a few roundings off")


@compiled
def run_copies(
    cell, count, deviate, clock, series, scalars, log, begun, numbers, draws, theta, theta_low,
    targets, at_once, single, rows, low, end, mirrored, word, copies, far,
):  # fmt: skip
    """Follow a rearrangement again, and its copies; see `rounding_error`.

    Returns
    -------
    differs : int
        The first row of the log that is another in a copy, as many as it has if the copy goes on
        from the last; -1: none is.
    copy : int
        The first copy in which that is so, from 1; 0: none.
    distance : float
        The largest between tensions or displacements of a copy and of the rearrangement, up to
        then; a copy of the last pair is `far` times as far off as others, and counts for as much.
    """
    now = scalars[0]
    n = now.chain.n
    distance, size = 0.0, 0.0
    load, load_low = 0.0, 0.0
    run_rests = False  # the run, after its last event
    for copy in range(copies + 1):
        scalars[0] = begun[0]
        if copy % 2 == 1:
            word = _turned(word)
        signs, way = word, 1.0 if copy % 2 == 1 else -1.0
        if copy > copies - 2:
            way *= far
        for k in range(n - 1):
            i = min(k, n - 2 - k) if mirrored else k
            off = way * _sign(signs, i) * size * (OFF / ROUNDING)
            numbers[TENSION_LOW, k] = low[k] + off
        place(cell, count, scalars, numbers, draws)
        prepare(cell, count, deviate, scalars)
        signs = _nudged(cell, now, signs, way * size * (OFF / ROUNDING), mirrored)
        row, differs = 0, -1
        while row < rows.size and differs < 0:
            reason, _ = follow(
                cell, count, deviate, clock, series, scalars, log, theta, theta_low, targets,
                at_once, at_once, single,
            )  # fmt: skip
            differs, row = _compared(log.events, now.logged, rows, row)
            now.logged = 0
            if reason != cells.BUDGET:
                break
            if copy == 0:
                for i in range(PAD, PAD + n):
                    force = abs(cell[cells.REST, i]) + now.chain.friction
                    size = max(size, force, abs(cell[cells.X, i]), cell[cells.SPEED, i])
            elif now.epoch.on == 0:
                signs = _nudged(cell, now, signs, way * size, mirrored)
        rests = now.stage == cells.AT_REST
        if differs >= 0 or row < rows.size or (copy > 0 and rests != run_rests):
            return max(differs, row), copy, distance
        if copy == 0:
            run_rests = rests
            load, load_low = now.theta, now.theta_low
            size *= ROUNDING
        away_before = apart = 0.0
        ramped = (now.theta - load) + (now.theta_low - load_low)
        for k in range(n):
            i = k + PAD
            moved = (cell[cells.TRAVEL, i] - numbers[PLACE, k]) + cell[cells.X, i]
            moved += cell[cells.TRAVEL_LOW, i] - numbers[PLACE_LOW, k]
            if copy == 0:
                end[k] = moved
            away = moved - end[k]
            apart = max(apart, abs(away))
            if k > 0:
                off = numbers[TENSION_LOW, k - 1] - low[k - 1]
                apart = max(apart, abs(away - away_before + off - ramped))
            away_before = away
        distance = max(distance, apart / abs(way))
    return -1, 0, distance


@compiled
def _nudged(cell, now, word, size, mirrored):
    """Move thresholds and all that is in motion a little; return the next word of signs."""
    n = now.chain.n
    word = _turned(word)
    for k in range(n):
        i, image, way = k + PAD, k, 1.0
        if mirrored and 2 * k > n - 1:
            image, way = n - 1 - k, -1.0
        sign = _sign(word, image)
        if cell[cells.SIDE, i] == 0.0:
            if cell[cells.EXCESS, i] > abs(size):
                cell[cells.EXCESS, i] += size * sign
        elif cell[cells.FRESH, i] == 0.0:
            cell[cells.X, i] += way * size * sign
            speed = cell[cells.SPEED, i] + size * _sign(word, image + 32)
            if speed > 0.0:
                cell[cells.SPEED, i] = speed
    return word


@inlined
def _turned(word):
    """Return the next word of a generator of signs (Marsaglia's xorshift)."""
    word ^= word << np.uint64(13)
    word ^= word >> np.uint64(7)
    return word ^ (word << np.uint64(17))


@inlined
def _sign(word, k):
    """Return the sign that bit k of a word stands for."""
    return 1.0 if (word >> np.uint64(k % 64)) & np.uint64(1) else -1.0


@compiled
def _compared(events, logged, rows, row):
    """Return the first of the rows that differs from the log, -1 if none, and the next one."""
    for k in range(logged):
        if row >= rows.size:
            return -1, row
        new, old = events[k], rows[row]
        alike = new.number == old.number and new.kind == old.kind
        if not (alike and new.slider == old.slider and new.sign == old.sign):
            return row, row
        row += 1
    return -1, row
