"""The energy of two sliders over a whole run, however long: where the work of the drive went.

Between rearrangements theta alone moves and works against the spring; during one it is frozen, and
gravity and the spring work against friction. Every event of the run is replayed from its log in
closed form, at whatever speed it was logged, and the terms are added up with compensated sums. The
replay knows of the run only what happened when, and at which theta; that its end is the run's own
state closes the ledger.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from exactcreep.limits import Stop
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Drive
from exactcreep.model.numbers import InputError, nearest_float
from exactcreep.model.state import State
from exactcreep.quasistatic.decimals import enclosure, floats
from exactcreep.solvers.registry import solver_named
from exactcreep.solvers.solver import Stretch, advance

# the replay's numbers, each the sum of two floats
(
    _LOAD,  # l0 theta
    _TENSION,
    _FIRST,  # displacements
    _SECOND,
    _WORK,  # of the drive
    _PATH,  # of both sliders together
    _LOST,  # kinetic energy at logged stops
) = range(7)
_NUMBERS = 7
# its plain floats: velocities, directions, time, weight, friction, number of the rearrangement
_SPEED_1, _SPEED_2, _SIDE_1, _SIDE_2, _CLOCK, _WEIGHT, _FRICTION, _NUMBER = range(8)
_CELLS = 8


@dataclass(frozen=True)
class Ledger:
    """Where the energy of two sliders came from and went, over a whole run.

    Attributes
    ----------
    drive, gravity : float
        Work of the drive and of gravity, unit ``m g**2 tau_dyn**2``.
    friction : float
        Energy lost to friction.
    elastic : float
        Gain of elastic energy.
    lost : float
        Kinetic energy that the logged stops would take away: zero but for rounding.
    left : float
        ``drive + gravity - friction - elastic - lost``; gravity and the elastic energy are those
        of the run's own final state, the others those of the replay.
    apart : float
        Largest distance of the replay's final tension and displacements from the run's own.
    slips : int
    half_cycles : int
    """

    drive: float
    gravity: float
    friction: float
    elastic: float
    lost: float
    left: float
    apart: float
    slips: int
    half_cycles: int

    @property
    def balance(self) -> float:
        """What is left over, relative to the energy lost to friction."""
        return abs(self.left) / self.friction if self.friction else abs(self.left)


@njit(cache=True, nogil=True, error_model="numpy")
def _add(high, low, which, term):
    """Add a float to a number that is the sum of two."""
    total = high[which] + term
    part = total - high[which]
    error = (high[which] - (total - part)) + (term - part) + low[which]
    result = total + error
    low[which] = error - (result - total)
    high[which] = result


@njit(cache=True, nogil=True, error_model="numpy")
def _ramp(high, low, load, load_low):
    """Take l0 theta to a new value while both sliders rest."""
    step = (load - high[_LOAD]) + (load_low - low[_LOAD])
    before = high[_TENSION] + low[_TENSION]
    _add(high, low, _TENSION, -step)
    after = high[_TENSION] + low[_TENSION]
    _add(high, low, _WORK, -0.5 * step * (before + after))
    high[_LOAD] = load
    low[_LOAD] = load_low


@njit(cache=True, nogil=True, error_model="numpy")
def _move(high, low, cells, span):
    """Let the sliders that move do so, in closed form."""
    one, other = cells[_SIDE_1], cells[_SIDE_2]
    tension = high[_TENSION] + low[_TENSION]
    push_1 = cells[_WEIGHT] + tension - cells[_FRICTION] * one
    push_2 = cells[_WEIGHT] - tension - cells[_FRICTION] * other
    moved_1 = 0.0
    moved_2 = 0.0
    if one != 0.0 and other != 0.0:
        omega = math.sqrt(2.0)
        mean = 0.5 * (push_1 + push_2)
        apart = push_2 - push_1
        speed = 0.5 * (cells[_SPEED_1] + cells[_SPEED_2])
        parting = cells[_SPEED_2] - cells[_SPEED_1]
        half = math.sin(0.5 * omega * span)
        sine = math.sin(omega * span)
        shared = span * (speed + 0.5 * mean * span)
        opened = apart * half * half + parting * sine / omega
        moved_1 = shared - 0.5 * opened
        moved_2 = shared + 0.5 * opened
        speed += mean * span
        parting += apart * sine / omega - 2.0 * parting * half * half
        cells[_SPEED_1] = speed - 0.5 * parting
        cells[_SPEED_2] = speed + 0.5 * parting
    else:
        half = math.sin(0.5 * span)
        sine = math.sin(span)
        if one != 0.0:
            moved_1 = 2.0 * push_1 * half * half + cells[_SPEED_1] * sine
            cells[_SPEED_1] += push_1 * sine - 2.0 * cells[_SPEED_1] * half * half
        if other != 0.0:
            moved_2 = 2.0 * push_2 * half * half + cells[_SPEED_2] * sine
            cells[_SPEED_2] += push_2 * sine - 2.0 * cells[_SPEED_2] * half * half
    for which, moved, side in ((_FIRST, moved_1, one), (_SECOND, moved_2, other)):
        if side != 0.0:
            _add(high, low, which, moved)
            _add(high, low, _PATH, side * moved)
            _add(high, low, _TENSION, -moved if which == _FIRST else moved)


@njit(cache=True, nogil=True, error_model="numpy")
def _replayed(high, low, cells, number, load, time, kind, slider, sign):
    """Replay a block of the log; every row is a start (kind 0) or a stop of one slider."""
    for row in range(number.size):
        if number[row] != cells[_NUMBER]:
            cells[_NUMBER] = number[row]
            cells[_CLOCK] = 0.0
            _ramp(high, low, load[row], 0.0)
        if time[row] != cells[_CLOCK]:
            _move(high, low, cells, time[row] - cells[_CLOCK])
            cells[_CLOCK] = time[row]
        first = slider[row] == 1
        speed = _SPEED_1 if first else _SPEED_2
        side = _SIDE_1 if first else _SIDE_2
        if kind[row] == 0:
            cells[side] = sign[row]
        else:
            _add(high, low, _LOST, 0.5 * cells[speed] * cells[speed])
            cells[side] = 0.0
        cells[speed] = 0.0


def two_slider_ledger(
    chain: Chain,
    drive: Drive,
    *,
    start: State | None = None,
    seed: int = 0,
    solver: str = "exact",
    most_half_cycles: int | None = None,
) -> tuple[Ledger, State]:
    """Return the energy ledger of two sliders along a drive, and the state at its end.

    Parameters
    ----------
    chain : Chain
        Of two sliders.
    drive : Drive
    start : State, optional
        At rest; default the relaxed chain.
    seed : int
    solver : str
        Without options.
    most_half_cycles : int, optional
        Go no further; default to the end of the drive.

    Raises
    ------
    InputError
        If the chain has not two sliders, or the run ends before its drive does.

    Notes
    -----
    Guarantee: memory does not grow with the length of the run. Every term is a sum of products
    good to a few ulp, compensated: the error of a sum is that of its terms, not of their number.

    Derivation: derivations/slip.py, derivations/modes.py.
    """
    if chain.n != 2:
        raise InputError("n", chain.n, "must be 2: the replay is in closed form for two sliders")
    begin = State.relaxed(chain, seed) if start is None else start
    simulation = solver_named(solver, {}).simulation(chain, begin, seed, ("events",))
    total = drive.half_cycles if most_half_cycles is None else most_half_cycles
    high, low, cells = _opening(chain, begin)
    l0 = nearest_float(chain.l0)

    def take(stretch: Stretch) -> None:
        log = stretch.recorded
        _replayed(
            high, low, cells, log["event_rearrangement"], l0 * floats(log["event_theta"]),
            floats(log["event_time"]), log["event_kind"], log["event_slider"], log["event_sign"],
        )  # fmt: skip

    stretch = advance(simulation, drive, total, take=take)
    if stretch.stop is not Stop.DONE:
        raise InputError("drive", drive, f"must end at rest: {stretch.reason}")
    end = simulation.state()
    load = chain.l0 * enclosure(end.theta).middle
    _ramp(high, low, nearest_float(load), nearest_float(load - Fraction(nearest_float(load))))
    return _closed(chain, begin, end, high, low, simulation.tally.slips, total), end


def _opening(chain: Chain, start: State) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Return the replay's numbers, what they lack, and its plain floats at the start."""
    high, low, cells = np.zeros(_NUMBERS), np.zeros(_NUMBERS), np.zeros(_CELLS)
    exact = {
        _LOAD: chain.l0 * enclosure(start.theta).middle,
        _TENSION: enclosure(start.tensions[0]).middle,
        _FIRST: enclosure(start.displacements[0]).middle,
        _SECOND: enclosure(start.displacements[1]).middle,
    }
    for which, value in exact.items():
        high[which] = nearest_float(value)
        low[which] = nearest_float(value - Fraction(high[which]))
    cells[_WEIGHT], cells[_FRICTION], cells[_NUMBER] = chain.sin_alpha, chain.friction, -1.0
    return high, low, cells


def _closed(
    chain: Chain, begin: State, end: State, high: NDArray[Any], low: NDArray[Any], slips: int,
    half_cycles: int,
) -> Ledger:  # fmt: skip
    def replayed(which: int) -> Fraction:
        return Fraction(float(high[which])) + Fraction(float(low[which]))

    tension = [enclosure(state.tensions[0]).middle for state in (begin, end)]
    places = [[enclosure(x).middle for x in state.displacements] for state in (begin, end)]
    gravity = Fraction(chain.sin_alpha) * (sum(places[1]) - sum(places[0]))
    elastic = (tension[1] ** 2 - tension[0] ** 2) / 2
    friction = Fraction(chain.friction) * replayed(_PATH)
    drive, lost = replayed(_WORK), replayed(_LOST)
    apart = [
        replayed(_TENSION) - tension[1],
        replayed(_FIRST) - places[1][0],
        replayed(_SECOND) - places[1][1],
    ]
    return Ledger(
        drive=nearest_float(drive),
        gravity=nearest_float(gravity),
        friction=nearest_float(friction),
        elastic=nearest_float(elastic),
        lost=nearest_float(lost),
        left=nearest_float(drive + gravity - friction - elastic - lost),
        apart=nearest_float(max(map(abs, apart))),
        slips=slips,
        half_cycles=half_cycles,
    )
