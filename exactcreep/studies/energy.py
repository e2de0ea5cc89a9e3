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
from numpy.typing import NDArray

from exactcreep.limits import Stop
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Drive
from exactcreep.model.numbers import InputError, nearest_float
from exactcreep.model.state import State
from exactcreep.motion.replay import Energies
from exactcreep.quasistatic.decimals import enclosure, floats
from exactcreep.solvers.exact.layout import compiled
from exactcreep.solvers.exact.two_floats import plus, split
from exactcreep.solvers.registry import solver_named
from exactcreep.solvers.solver import Stretch, advance

# the replay's numbers, each kept as two floats
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
# its plain floats: velocities, directions (0 at rest), time, number of the rearrangement
_SPEED, _SIDE, _CLOCK, _NUMBER, _CELLS = 0, 2, 4, 5, 6


@dataclass(frozen=True)
class Ledger:
    """Where the energy of two sliders came from and went, over a whole run.

    Attributes
    ----------
    drive : Fraction
        Work of the drive, unit ``m g**2 tau_dyn**2``.
    energies : Energies
        Where it went, in rationals: gravity and the elastic energy are those of the run's own final
        state, the others those of the replay.
    apart : float
        Largest distance of the replay's final tension and displacements from the run's own.
    slips : int
    half_cycles : int
    """

    drive: Fraction
    energies: Energies
    apart: float
    slips: int
    half_cycles: int

    @property
    def left(self) -> float:
        """What the terms leave over: zero but for rounding."""
        return nearest_float(self.drive + self.energies.left)

    @property
    def balance(self) -> float:
        """What is left over, relative to the energy that friction took."""
        return abs(self.left) / nearest_float(self.energies.friction or Fraction(1))


@compiled
def _add(sums, which, term):
    """Add a float to a number that is kept as two."""
    sums[which, 0], sums[which, 1] = plus(sums[which, 0], sums[which, 1], term)


@compiled
def _ramp(sums, load, load_low):
    """Take l0 theta to a new value while both sliders rest."""
    step = (load - sums[_LOAD, 0]) + (load_low - sums[_LOAD, 1])
    before = sums[_TENSION, 0] + sums[_TENSION, 1]
    _add(sums, _TENSION, -step)
    after = sums[_TENSION, 0] + sums[_TENSION, 1]
    _add(sums, _WORK, -0.5 * step * (before + after))
    sums[_LOAD, 0] = load
    sums[_LOAD, 1] = load_low


@compiled
def _swung(omega, push, speed, span):
    """Return how far an oscillation moves, and how much speed it gains, under a first push."""
    half = math.sin(0.5 * omega * span)
    sine = math.sin(omega * span) / omega
    moved = 2.0 * push * half * half / (omega * omega) + speed * sine
    return moved, push * sine - 2.0 * speed * half * half


@compiled
def _move(sums, cells, weight, friction, span):
    """Let the sliders that move do so, in closed form."""
    tension = sums[_TENSION, 0] + sums[_TENSION, 1]
    first = weight + tension - friction * cells[_SIDE]
    second = weight - tension - friction * cells[_SIDE + 1]
    one, other, gain, gain_other = 0.0, 0.0, 0.0, 0.0
    if cells[_SIDE] != 0.0 and cells[_SIDE + 1] != 0.0:
        mean = 0.5 * (first + second)
        parting = cells[_SPEED + 1] - cells[_SPEED]
        opened, apart = _swung(math.sqrt(2.0), second - first, parting, span)
        shared = span * (0.5 * (cells[_SPEED] + cells[_SPEED + 1]) + 0.5 * mean * span)
        one, other = shared - 0.5 * opened, shared + 0.5 * opened
        gain, gain_other = mean * span - 0.5 * apart, mean * span + 0.5 * apart
    elif cells[_SIDE] != 0.0:
        one, gain = _swung(1.0, first, cells[_SPEED], span)
    elif cells[_SIDE + 1] != 0.0:
        other, gain_other = _swung(1.0, second, cells[_SPEED + 1], span)
    cells[_SPEED] += gain
    cells[_SPEED + 1] += gain_other
    _add(sums, _FIRST, one)
    _add(sums, _SECOND, other)
    _add(sums, _TENSION, -one)
    _add(sums, _TENSION, other)
    _add(sums, _PATH, cells[_SIDE] * one)
    _add(sums, _PATH, cells[_SIDE + 1] * other)


@compiled
def _replayed(sums, cells, weight, friction, number, load, time, kind, slider, sign):
    """Replay a block of the log; every row is a start (kind 0) or a stop of one slider."""
    for row in range(number.size):
        if number[row] != cells[_NUMBER]:
            cells[_NUMBER] = number[row]
            cells[_CLOCK] = 0.0
            _ramp(sums, load[row], 0.0)
        if time[row] != cells[_CLOCK]:
            _move(sums, cells, weight, friction, time[row] - cells[_CLOCK])
            cells[_CLOCK] = time[row]
        n = slider[row] - 1
        cells[_SIDE + n] = sign[row]
        if kind[row] == 1:
            _add(sums, _LOST, 0.5 * cells[_SPEED + n] * cells[_SPEED + n])
            cells[_SIDE + n] = 0.0
        cells[_SPEED + n] = 0.0


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
    known = [begin.theta, begin.tensions[0], *begin.displacements]
    exact = [enclosure(value).middle for value in known]
    sums, cells = np.zeros((_NUMBERS, 2)), np.zeros(_CELLS)
    sums[:4] = [split(chain.l0 * exact[0]), *map(split, exact[1:])]
    cells[_NUMBER] = -1.0
    l0 = nearest_float(chain.l0)

    def take(stretch: Stretch) -> None:
        log = stretch.recorded
        _replayed(
            sums, cells, chain.sin_alpha, chain.friction,
            log["event_rearrangement"], l0 * floats(log["event_theta"]),
            floats(log["event_time"]), log["event_kind"], log["event_slider"], log["event_sign"],
        )  # fmt: skip

    stretch = advance(simulation, drive, total, take=take)
    if stretch.stop is not Stop.DONE:
        raise InputError("drive", drive, f"must end at rest: {stretch.reason}")
    end = simulation.state()
    _ramp(sums, *split(chain.l0 * enclosure(end.theta).middle))
    return _closed(chain, begin, end, sums, simulation.tally.slips, total), end


def _closed(
    chain: Chain, begin: State, end: State, sums: NDArray[Any], slips: int, half_cycles: int
) -> Ledger:
    replayed = [Fraction(high) + Fraction(low) for high, low in sums.tolist()]
    tension = [enclosure(state.tensions[0]).middle for state in (begin, end)]
    places = [[enclosure(x).middle for x in state.displacements] for state in (begin, end)]
    energies = Energies(
        elastic=(tension[1] ** 2 - tension[0] ** 2) / 2,
        kinetic=Fraction(0),
        gravity=Fraction(chain.sin_alpha) * (sum(places[1]) - sum(places[0])),
        friction=Fraction(chain.friction) * replayed[_PATH],
        lost=replayed[_LOST],
    )
    apart = [
        replayed[_TENSION] - tension[1],
        replayed[_FIRST] - places[1][0],
        replayed[_SECOND] - places[1][1],
    ]
    return Ledger(
        drive=replayed[_WORK],
        energies=energies,
        apart=nearest_float(max(map(abs, apart))),
        slips=slips,
        half_cycles=half_cycles,
    )
