"""Find out whether a chain has returned: compare tensions at the ends of cycles.

Without disorder the tensions at the end of a cycle determine everything that follows, including the
tensions at the next end (a return map). Once they return, the chain stays on a limit cycle for
ever, unless a slider lost an initial coefficient on the way. With disorder no contact gets back its
threshold. Then only a cycle without any motion shows that nothing will ever move.

`ReturnMap` uses the records of any solver, `settling` follows `exact` up to a return, and
`studies.fates.proof` uses balls. This module reads the ends of cycles, and finds the periods,
since when they hold, and whether a limit is approached like 1/k.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.chain import Chain, frictions, rounding_of
from exactcreep.model.drive import Cycles
from exactcreep.model.enclosure import Enclosure, enclosure, enclosures, exact_value, floats
from exactcreep.model.numbers import nearest_float
from exactcreep.model.state import State
from exactcreep.solvers.interface import Simulation, Stretch

NEAR = 2.0**-40
"""Relative distance within which a value has nearly returned."""
LONGEST_PERIOD = 1000
"""Longest period that is looked for, in cycles."""
PATIENCE = 100
"""Successive cycles that must return nearly before `fate` accepts the return."""
_REMEMBERED = 1024  # cycles, at least, whose ends are stored
_MOST_KEPT = 2**21  # numbers in all of them
_X_G, _X_G_LOW, _SLIPS, _KEEP, _TENSIONS = range(5)  # columns of the ends of cycles
_APPROACH = 64  # equal cycles; fewer do not show how forces approach a limit


class LimitCycle(NamedTuple):
    """The limit cycle or the rest of a chain that has returned.

    `period`: cycles after which the tensions return, 0 if nothing moves; `since`: the cycle from
    which on they do; `apart`: the distance from their previous values, 0 if they agree in all
    digits, or to within enclosures of 2**-80 of the friction; `velocity`: mean displacement per
    half-cycle, None if the chain does not advance.
    """

    period: int
    since: int
    apart: float
    velocity: Enclosure | None


def nearness(chain: Chain) -> float:
    """Return the largest distance of forces that have nearly returned, unit m g."""
    pairs = ((low, high) for _, low, high in frictions(chain))
    held = max(chain.times_cosine(low) + chain.times_cosine(high - low) for low, high in pairs)
    return NEAR * (held + abs(chain.sin_alpha) + nearest_float(max(map(abs, chain.end_forces))))


class Approach(NamedTuple):
    """Change per cycle of forces that approach a limit like 1/k, and the rest of the way; m g."""

    change: float
    ahead: float

    @property
    def reason(self) -> str:
        return (
            f"locked in the limit: forces that change by {self.change:.1e} m g per cycle, falling"
            " as 1/cycles^2"
        )


def approach(ends: NDArray[Any], alike: int) -> Approach | None:
    """Return how the ends of cycles approach a limit like 1/k; None if they do not.

    The last `alike` cycles must have the same slips, and the changes from row to row of `ends` (the
    forces or tensions) must fall at least like 1/k**2 in cycle k; see `studies.fates.fate`.
    """
    if alike < _APPROACH:
        return None
    steps = np.abs(np.diff(ends[-(alike // 2) - 1 :], axis=0)).max(axis=1, initial=0.0)
    if not (steps > 0).all():
        return None
    early, middle, late = steps[[0, steps.size // 2, -1]] ** -0.5
    if not late - middle >= 0.9 * (middle - early) > 0:
        return None
    ahead = steps[-1] * steps.size / (1 - (steps[-1] / steps[0]) ** 0.5)
    return Approach(float(steps[-1]), float(ahead))


def returns(ends: NDArray[Any], longest: int, close: float) -> NDArray[np.int64]:
    """Return the periods up to `longest` after which the last row returns to within `close`."""
    before = ends[-2 : -longest - 2 : -1]
    return np.flatnonzero(np.abs(ends[-1] - before).max(axis=1, initial=0.0) <= close) + 1


def repeats_since(ends: NDArray[Any], period: int, close: float) -> int:
    """Return the first row from which on all rows return after a period, to within `close`."""
    return _last(np.abs(ends[period:] - ends[:-period]).max(axis=1, initial=0.0) > close) + 1


class CycleEnds(NamedTuple):
    """The ends of some cycles, a row for each; `slips` of each slider in the cycle before.

    `x_G_low`: what rounding takes from each x_G, 0 if unknown; `keep`: how many sliders have kept
    an initial coefficient that will not return.
    """

    x_G: NDArray[Any]
    x_G_low: NDArray[np.float64]
    slips: NDArray[np.int64]
    keep: NDArray[np.int64]
    tension: NDArray[Any]


class CycleReader:
    """Reads the ends of cycles from stretches, which may end within a cycle.

    Attributes
    ----------
    begun : ndarray, shape (1, n)
        Slips since the end of the last cycle.
    unlike : ndarray of bool, shape (n,)
        Which sliders keep an unusual coefficient until they slip. With disorder coefficients never
        return, and are ignored.
    """

    def __init__(self, chain: Chain, start: State) -> None:
        self.begun = np.zeros((1, chain.n), dtype=np.int64)
        self.unlike = (start.coefficients != chain.floats("mu_s")) & (chain.sigma_mu == 0)

    def read(self, stretch: Stretch, first: int) -> CycleEnds:
        """Return the ends of cycles in the targets of a stretch from `first` on."""
        recorded, begin = stretch.recorded, first % 2
        total = np.cumsum(np.concatenate([self.begun, recorded["slips"]]), axis=0)
        whole = total[begin + 1 :: 2]
        slips = np.diff(whole, axis=0, prepend=0)
        self.begun = total[-1:] - slips.sum(axis=0)
        keep = (np.cumsum(slips[:, self.unlike], axis=0) == 0).sum(axis=1)
        self.unlike = self.unlike & ~slips.any(axis=0)
        x_G, tension = (recorded[name][begin::2] for name in ("x_G", "tension"))
        low = np.zeros(len(x_G)) if stretch.x_G_low is None else stretch.x_G_low[begin::2]
        return CycleEnds(x_G, low, slips, keep, tension)


class ReturnMap(CycleReader):
    """Stores the ends of the last thousand cycles, and finds returns.

    When the store is full, its older half is dropped, with a note of the period that held.
    The contents depend only on the number of completed cycles.
    """

    def __init__(self, chain: Chain, start: State, drive: Cycles) -> None:
        super().__init__(chain, start)
        self.chain = chain
        # the start may have another temperature than the ends of cycles
        ramp = nearest_float(chain.l0 * (exact_value(start.theta) + drive.amplitude))
        tensions = floats(start.tensions) + ramp * chain.floats("expansion")
        x_G = math.fsum(floats(start.displacements).tolist()) / chain.n
        self.ends = np.array([[x_G, 0.0, 0.0, self.unlike.sum(), *tensions]])
        self.forgotten = 0
        self.noted = (0, 0)  # the period of dropped cycles, and since when it held
        self.known: list[Any] = []  # x_G and tensions of the last cycles, exactly
        self.most = max(min(_REMEMBERED, _MOST_KEPT // chain.n), 2)
        self._close = nearness(chain)

    @property
    def cycles(self) -> int:
        """Whole cycles so far."""
        return self.forgotten + len(self.ends) - 1

    def take(self, stretch: Stretch, first: int, simulation: Simulation) -> None:
        """Store the ends of cycles in the targets of a stretch from `first` on."""
        read = self.read(stretch, first)
        slips = self.ends[-1, _SLIPS] + np.cumsum(read.slips.sum(axis=1))
        x_G, tensions = read.x_G, read.tension
        ends = np.column_stack([floats(x_G), read.x_G_low, slips, read.keep, floats(tensions)])
        if tensions.dtype == object:
            new = enclosures(np.column_stack([x_G, tensions])).tolist()
            self.known = [*self.known, *new][-LONGEST_PERIOD - 1 :]
        while len(ends):
            room = 2 * self.most + 1 - len(self.ends)
            self.ends, ends = np.concatenate([self.ends, ends[:room]]), ends[room:]
            if len(self.ends) > 2 * self.most:
                settled = self.settled()
                self.noted = (max(settled.period, 1), settled.since) if settled else (0, 0)
                self.ends = self.ends[self.most :]
                self.forgotten += self.most

    def repeats_since(self, period: int) -> int:
        """Return the first cycle from which on the chain moves with a period, up to its advance.

        If that is before the stored cycles, it is the first stored cycle with the noted period.
        """
        places, tensions = self.ends[:, [_X_G]], self.ends[:, _TENSIONS:]
        compared = (
            (np.diff(places, axis=0), NEAR * max(1.0, float(np.abs(places).max()))),
            (np.diff(tensions, axis=1, prepend=0.0, append=0.0), self._close),
            (self.ends[:, [_KEEP]], 0.0),
        )
        if since := max(repeats_since(rows, period, close) for rows, close in compared):
            return self.forgotten + since
        noted, since = self.noted
        return since if noted and period % noted == 0 else self.forgotten

    def settled(self) -> LimitCycle | None:
        """Return how the chain goes on if it has returned; None if it has not."""
        if self.cycles and self.ends[-1, _SLIPS] == self.ends[-2, _SLIPS]:
            return LimitCycle(0, self.repeats_since(1), 0.0, None)
        if self.chain.sigma_mu != 0:
            return None
        compared = self.ends[:, _KEEP:]
        for period in returns(compared, LONGEST_PERIOD, self._close).tolist():
            off = float(np.abs(compared[-1] - compared[-1 - period]).max(initial=0.0))
            since = self.repeats_since(period)
            if len(self.known) > period:
                pairs = [*zip(self.known[-1][1:], self.known[-1 - period][1:], strict=True)]
                off = max((now.apart(earlier) for now, earlier in pairs), default=0.0)
                wide = max((now.radius + earlier.radius for now, earlier in pairs), default=0)
                off = max(off, float(wide)) if wide > NEAR * self._close else off
            # a near return counts if it lasts for another period
            if not off or self.cycles - since >= 2 * period:
                return LimitCycle(period, since, off, self._velocity(period))
        return None

    def approaching(self) -> tuple[int, Approach] | None:
        """Return since when tensions approach a cycle like 1/k, and how, or None.

        Slips must be equal in many cycles, a slider must rest, and changes must decrease.
        """
        slips, lost = np.diff(self.ends[:, [_SLIPS, _KEEP]], axis=0).T
        alike = slips.size - 1 - _last((slips != slips[-1:]) | (lost != 0))
        found = approach(self.ends[:, _TENSIONS:], alike)
        if found is None or self.chain.sigma_mu != 0 or self._moved(alike).all():
            return None
        return self.cycles - alike, found

    def _moved(self, period: int) -> NDArray[np.int64]:
        """Return the direction of each slider's motion, 0 if rounding may explain it."""
        gone = self.ends[-1] - self.ends[-1 - period]
        change = np.concatenate([[0.0], np.cumsum(gone[_TENSIONS:])])
        change += gone[_X_G] - change.mean()
        rounding = nearest_float(int(gone[_SLIPS]) * rounding_of(self.chain))
        return np.where(np.abs(change) > rounding, np.sign(change), 0).astype(np.int64)

    def _velocity(self, period: int) -> Enclosure | None:
        """Return the mean displacement per half-cycle; None unless every slider has advanced."""
        if abs(self._moved(period).sum()) < self.chain.n:
            return None
        ends = self.ends[[-1 - period, -1], : _X_G_LOW + 1].tolist()
        begin, end = (enclosure(sum(map(Fraction, parts))) for parts in ends)
        if len(self.known) > period:
            begin, end = self.known[-1 - period][0], self.known[-1][0]
        return end.rate(begin, 2 * period)


def _last(where: NDArray[np.bool_]) -> int:
    """Return the last index where something holds, -1 if there is none."""
    places = np.flatnonzero(where)
    return int(places[-1]) if places.size else -1
