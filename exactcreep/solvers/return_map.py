"""Find out whether a chain has returned: compare tensions at the ends of cycles.

Without disorder the tensions at the end of a cycle determine everything that follows, including the
tensions at the next end (a return map). Once they return, the chain stays on a limit cycle for
ever, unless a slider lost an initial coefficient on the way. With disorder no contact gets back its
threshold. Then only a cycle without any motion shows that nothing will ever move.

`ReturnMap` uses the records of any solver, `settling` follows `exact` up to a return, and
`studies.fates.proof` uses balls. This module finds the periods, since when they hold, and whether a
limit is approached like 1/k.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.chain import Chain, frictions, rounding_of
from exactcreep.model.enclosure import Enclosure, enclosure, enclosures, floats
from exactcreep.model.numbers import nearest_float

NEAR = 2.0**-40
"""Relative distance within which a value has nearly returned."""
LONGEST_PERIOD = 1000
"""Longest period that is looked for, in cycles."""
PATIENCE = 100
"""Successive cycles that must return nearly before `fate` accepts the return."""
_REMEMBERED = 1024  # cycles, at least, whose ends are stored
_MOST_KEPT = 2**21  # numbers in all of them
_APPROACH = 64  # equal cycles; fewer do not show how forces approach a limit
_NOTED = 64  # the longest period that is noted for forgotten cycles
_X_G, _X_G_LOW, _SLIPS, _TENSIONS = range(4)  # columns of the ends of cycles


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


class ReturnMap:
    """Stores the ends of the last thousand cycles, and finds returns.

    When the store is full, its older half is dropped, with a note of the shortest period that held.
    The contents depend only on the number of completed cycles.

    Parameters
    ----------
    chain : Chain
    x_G : float
    tensions : ndarray of float64, shape (n - 1,)
        Of the start, at the temperature of the ends of cycles.

    Attributes
    ----------
    alike_since : int
        The cycle since whose end the static coefficients have not changed.
    """

    def __init__(self, chain: Chain, x_G: float, tensions: NDArray[np.float64]) -> None:
        self.chain = chain
        self.ends = np.array([[x_G, 0.0, 0.0, *tensions]])
        self.forgotten = 0
        self.noted = (0, 0)  # a period, and since which cycle it held
        self.alike_since = 0
        self.known: list[Any] = []  # x_G and tensions of the last cycles, exactly
        self.most = max(min(_REMEMBERED, _MOST_KEPT // chain.n), 2)
        self._close = nearness(chain)

    @property
    def cycles(self) -> int:
        """Whole cycles so far."""
        return self.forgotten + len(self.ends) - 1

    def feed(
        self, x_G: NDArray[Any], x_G_low: Any, tensions: NDArray[Any], slips: NDArray[Any]
    ) -> None:
        """Store the ends of some further cycles: a row for each, and its number of slips.

        `x_G_low`: what rounding takes from each x_G, 0 if unknown.
        """
        ends = np.empty((len(x_G), self.chain.n + 2))
        ends[:, _X_G], ends[:, _TENSIONS:] = floats(x_G), floats(tensions)
        ends[:, _X_G_LOW] = x_G_low
        ends[:, _SLIPS] = self.ends[-1, _SLIPS] + np.cumsum(slips)
        if tensions.dtype == object:
            pairs = zip(x_G.tolist(), enclosures(tensions).tolist(), strict=True)
            new = [(enclosure(x), row) for x, row in pairs]
            self.known = [*self.known, *new][-LONGEST_PERIOD - 1 :]
        while len(ends):
            room = 2 * self.most + 1 - len(self.ends)
            self.ends, ends = np.concatenate([self.ends, ends[:room]]), ends[room:]
            if len(self.ends) > 2 * self.most:
                self.noted = self._best_period()
                self.ends = self.ends[self.most :]
                self.forgotten += self.most

    def _best_period(self) -> tuple[int, int]:
        """Return the shortest of the periods that have held longest, and since when it has."""
        noted, earliest = self.noted
        if not noted:
            earliest = self.forgotten
        best = (self.cycles, 1)
        longest = 1 if self.chain.sigma_mu != 0 else min(_NOTED, self.most)
        for period in range(1, longest + 1):
            best = min(best, (self.repeats_since(period), period))
            if best[0] <= earliest:  # no period can have held longer
                break
        since, period = best
        return period, since

    def repeats_since(self, period: int) -> int:
        """Return the first cycle from which on the chain moves with a period, up to its advance.

        If that is before the stored cycles, it is the first stored cycle with the noted period.
        """
        return max(self._moves_since(period), self.alike_since)

    def _moves_since(self, period: int) -> int:
        steps = np.diff(self.ends[:, _X_G])
        if steps.size < period:
            return self.cycles
        last = -1
        if steps.size > period:
            close = NEAR * max(1.0, float(np.abs(self.ends[:, _X_G]).max()))
            if abs(steps[-1] - steps[-1 - period]) > close:  # the usual case
                return self.forgotten + steps.size - period
            last = _last(np.abs(steps[period:] - steps[:-period]) > close)
        forces = np.diff(self.ends[:, _TENSIONS:], axis=1, prepend=0.0, append=0.0)
        last = max(last, repeats_since(forces, period, self._close) - 1)
        if last >= 0:
            return self.forgotten + last + 1
        noted, since = self.noted
        return since if noted and period % noted == 0 else self.forgotten

    def settled(self) -> LimitCycle | None:
        """Return how the chain goes on if it has returned; None if it has not."""
        if self.cycles and self.ends[-1, _SLIPS] == self.ends[-2, _SLIPS]:
            return LimitCycle(0, self.repeats_since(1), 0.0, None)
        if self.chain.sigma_mu != 0:
            return None
        tensions = self.ends[:, _TENSIONS:]
        longest = min(LONGEST_PERIOD, self.cycles - self.alike_since)
        for period in returns(tensions, longest, self._close).tolist():
            off = float(np.abs(tensions[-1] - tensions[-1 - period]).max(initial=0.0))
            since = self.repeats_since(period)
            if len(self.known) > period:
                pairs = [*zip(self.known[-1][1], self.known[-1 - period][1], strict=True)]
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
        slips = np.diff(self.ends[:, _SLIPS])
        alike = slips.size - 1 - _last(slips != slips[-1:])
        alike = min(alike, self.cycles - self.alike_since)
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
