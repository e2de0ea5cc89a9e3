"""Has the chain come back? Tensions at the ends of cycles, compared with those of earlier cycles.

Without disorder the tensions at the end of a cycle decide all that follows: once they return, the
chain goes round on a limit cycle for ever. With disorder no contact gets back its threshold; what
can be known is that nothing has moved during a cycle, so that nothing ever will again.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.drive import Cycles
from exactcreep.model.enclosure import Enclosure, enclosure, enclosures, floats
from exactcreep.model.numbers import exact_number, nearest_float
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.solvers.solver import Simulation, Stretch, require, same_kind
from exactcreep.solvers.statistics import falls_like_inverse_square

NEAR = 2.0**-40
"""How nearly what returns does so, in units of what is largest."""
LONGEST_PERIOD = 1000
"""Cycles: how far back the tensions at the end are looked for."""
_REMEMBERED = 1024  # cycles, at least, whose ends are kept
_MOST_KEPT = 2**21  # numbers of all of them
_APPROACH = 64  # equal cycles: fewer do not show how tensions approach theirs
_NOTED = 64  # the longest period that is noted of cycles that are forgotten
_X_G, _SLIPS, _TENSIONS = 0, 1, 2  # columns of the ends of cycles


class Settled(NamedTuple):
    """How a chain goes on that has come back.

    Attributes
    ----------
    period : int
        Cycles after which the tensions return; 0 if nothing moves any more.
    since : int
        The cycle from which on they do.
    apart : float
        How far from their values; 0: to all digits, or to within their enclosures.
    velocity : Enclosure or None
        Mean displacement per half-cycle; None if the chain does not advance.
    """

    period: int
    since: int
    apart: float
    velocity: Enclosure | None


class RecurrenceObserver:
    """Remembers how a chain stood at the ends of the last thousand cycles, and since when.

    Every so many cycles the older half is forgotten, with a note of the shortest period that held;
    what remains depends only on how many cycles were completed.
    """

    needs = ("tension", "slips")

    def __init__(self, experiment: Experiment) -> None:
        chain, state, drive = experiment.chain, experiment.initial, experiment.drive
        assert isinstance(drive, Cycles)
        self.chain = chain
        begin = np.zeros((1, chain.n + 1))
        begin[0, _X_G] = math.fsum(floats(state.displacements).tolist()) / chain.n
        # a start may stand at another temperature than the ends of cycles do
        ramp = chain.l0 * (exact_number(enclosure(state.theta).middle, "theta") + drive.amplitude)
        begin[0, _TENSIONS:] = floats(state.tensions) + nearest_float(ramp)
        self.ends = begin
        self.forgotten = 0
        self.noted = (0, 0)  # a period, and since which cycle it held
        self.known: list[
            tuple[Enclosure, NDArray[Any]]
        ] = []  # the ends of the last cycles, exactly
        self._most = max(min(_REMEMBERED, _MOST_KEPT // chain.n), 2)
        self._slipped = 0  # since the end of the last cycle
        self._close = NEAR * (chain.friction + chain.excess + abs(chain.sin_alpha))

    @property
    def cycles(self) -> int:
        """Whole cycles so far."""
        return self.forgotten + len(self.ends) - 1

    def take(self, stretch: Stretch, first: int, simulation: Simulation) -> None:
        """Take over how the chain stood at the targets from `first` on."""
        recorded, begin = stretch.recorded, first % 2
        slips = recorded["slips"].sum(axis=1)
        slips[:1] += self._slipped
        total, places = np.cumsum(slips), slice(begin, None, 2)
        x_G, tensions = recorded["x_G"][places], recorded["tension"][places]
        ends = np.empty((len(x_G), self.chain.n + 1))
        ends[:, _X_G], ends[:, _TENSIONS:] = floats(x_G), floats(tensions)
        ends[:, _SLIPS] = self.ends[-1, _SLIPS] + total[places]
        if len(total):
            before = total[places][-1] if len(ends) else 0
            self._slipped = int(total[-1] - before)
        if tensions.dtype == object:
            pairs = zip(map(enclosure, x_G.tolist()), enclosures(tensions), strict=True)
            self.known = [*self.known, *pairs][-LONGEST_PERIOD - 1 :]
        while len(ends):
            room = 2 * self._most + 1 - len(self.ends)
            self.ends = np.concatenate([self.ends, ends[:room]])
            ends = ends[room:]
            if len(self.ends) > 2 * self._most:
                longest = min(_NOTED, self._most)
                since, best = min((self.repeats_since(k), k) for k in range(1, longest + 1))
                self.noted = best, since
                self.ends = self.ends[self._most :]
                self.forgotten += self._most

    def repeats_since(self, period: int) -> int:
        """Return the first cycle from which on the chain moves with a period, up to its advance.

        If that was before the cycles that are remembered and another period was noted then, the
        first of these.
        """
        steps, close = np.diff(self.ends[:, _X_G]), self._close_places
        if steps.size < period:
            return self.cycles
        last = -1
        if steps.size > period:
            if abs(steps[-1] - steps[-1 - period]) > close:  # most often
                return self.forgotten + steps.size - period
            last = _last(np.abs(steps[period:] - steps[:-period]) > close)
        tensions = self.ends[:, _TENSIONS:]
        changes = tensions[period:] - tensions[:-period]
        forces = np.diff(changes, axis=1, prepend=0.0, append=0.0)
        apart = np.abs(forces).max(axis=1)
        last = max(last, _last(apart > self._close))
        if last >= 0:
            return self.forgotten + last + 1
        noted, since = self.noted
        return since if noted and period % noted == 0 else self.forgotten

    @property
    def _close_places(self) -> float:
        return NEAR * max(1.0, float(np.abs(self.ends[:, _X_G]).max()))

    def settled(self) -> Settled | None:
        """Return how the chain goes on if it has come back; None if it has not."""
        if self.cycles and self.ends[-1, _SLIPS] == self.ends[-2, _SLIPS]:
            return Settled(0, self.repeats_since(1), 0.0, None)
        if self.chain.sigma_mu != 0:
            return None
        tensions = self.ends[:, _TENSIONS:]
        earlier = tensions[-2 : -LONGEST_PERIOD - 2 : -1]
        apart = np.abs(tensions[-1] - earlier).max(axis=1, initial=0.0)
        for period in (np.flatnonzero(apart <= self._close) + 1).tolist():
            if period > self.cycles:
                break
            off = self._apart(period, float(apart[period - 1]))
            since = self.repeats_since(period)
            # what returns but nearly is believed if it does so for another period
            if off and self.cycles - since < 2 * period:
                continue
            return Settled(period, since, off, self._velocity(period))
        return None

    def approaching(self) -> tuple[int, float] | None:
        """Return since when tensions approach a cycle like 1/k, and their last change; else None.

        Equal numbers of slips in many cycles, a slider that stays, and ever smaller changes.
        """
        slips = np.diff(self.ends[:, _SLIPS])
        alike = slips.size - 1 - _last(slips != slips[-1:])
        if self.chain.sigma_mu != 0 or alike < _APPROACH or self._moved(alike).all():
            return None
        changes = np.diff(self.ends[-(alike // 2) :, _TENSIONS:], axis=0)
        steps = np.abs(changes).max(axis=1, initial=0.0)
        if not falls_like_inverse_square(steps):
            return None
        return self.cycles - alike, float(steps[-1])

    def _moved(self, period: int) -> NDArray[np.int64]:
        """Return which way each slider has moved, 0 if no further than rounding can take it."""
        end, begin = self.ends[-1], self.ends[-1 - period]
        change = np.cumsum(end[_TENSIONS:] - begin[_TENSIONS:])
        change = np.concatenate([[0.0], change])
        change += (end[_X_G] - begin[_X_G]) - change.mean()
        rounding = nearest_float(int(end[_SLIPS] - begin[_SLIPS]) * self.chain.rounding)
        return np.where(np.abs(change) > rounding, np.sign(change), 0).astype(np.int64)

    def _apart(self, period: int, near: float) -> float:
        """Return how far apart the tensions are after a period, 0 if they may be the same."""
        if not self.known:
            return near
        if len(self.known) <= period:  # the start
            return near
        pairs = zip(self.known[-1][1], self.known[-1 - period][1], strict=True)
        return max((one.apart(other) for one, other in pairs), default=0.0)

    def _velocity(self, period: int) -> Enclosure | None:
        """Return the mean displacement per half-cycle; None unless every slider has advanced."""
        if abs(self._moved(period).sum()) < self.chain.n:
            return None
        if len(self.known) > period:
            return self.known[-1][0].rate(self.known[-1 - period][0], 2 * period)
        moved = Fraction(float(self.ends[-1, _X_G])) - Fraction(float(self.ends[-1 - period, _X_G]))
        return Enclosure(moved / (2 * period), Fraction(0))

    def kept(self) -> dict[str, Any]:
        """Return what a snapshot keeps of it."""
        return {
            "ends": self.ends, "forgotten": self.forgotten, "noted": list(self.noted),
            "slipped": self._slipped, "x_G": [x_G for x_G, _ in self.known],
            "tensions": [list(tensions) for _, tensions in self.known],
        }  # fmt: skip

    def restore(self, kept: Mapping[str, Any], done: int) -> None:
        """Take over what `kept` returned after `done` targets, or raise `ValueError`."""
        same_kind(self.kept() | {"ends": self.ends[:0]}, kept)
        ends, width = kept["ends"], len(kept["tensions"])
        require(len(ends) > 0 and bool(np.isfinite(ends).all()), "ends of cycles are missing")
        require(kept["forgotten"] + len(ends) - 1 == done // 2, "cycles are missing")
        require(kept["forgotten"] % self._most == 0 <= kept["slipped"] < 2**60, "so is a count")
        known = list(zip(kept["x_G"], kept["tensions"], strict=True))
        fits = all(len(row) == self.chain.n - 1 for row in kept["tensions"])
        require(width <= LONGEST_PERIOD + 1 and fits, "so are tensions")
        numbers = [number for x_G, row in known for number in (x_G, *row)]
        require(all(isinstance(number, Enclosure) for number in numbers), "so are enclosures")
        noted, since = kept["noted"]
        require(0 <= noted <= _NOTED and 0 <= since <= done, "so is a period")
        self.ends, self.forgotten, self.noted = ends, kept["forgotten"], (noted, since)
        self._slipped = kept["slipped"]
        self.known = []
        for x_G, row in known:
            tensions = np.empty(self.chain.n - 1, dtype=object)
            tensions[:] = [Enclosure(*one) for one in row]
            self.known.append((x_G, tensions))


def _last(where: NDArray[np.bool_]) -> int:
    """Return the last place where something holds, -1 if there is none."""
    places = np.flatnonzero(where)
    return int(places[-1]) if places.size else -1
