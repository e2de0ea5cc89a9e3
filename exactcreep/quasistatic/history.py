"""What of a run's past is remembered, however long it is: marks, x_G at ends of cycles, samples."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.enclosure import Enclosure, enclosures
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.solvers.solver import Tally
from exactcreep.solvers.statistics import rests_for_long, standard_error

NEAR = 2.0**-40
"""How nearly what returns does so, in units of what is largest."""
_MOST_SAMPLES = 4096  # of x_G that are kept for the standard error, however long the run
_REMEMBERED = 1024  # cycles, at least, whose x_G is kept


@dataclass(frozen=True)
class Mark:
    """Where the run was at a target that is looked back to."""

    done: int
    x_G: Enclosure
    tally: Tally
    displacements: NDArray[np.float64]
    tensions: NDArray[Any]

    def apart(self, tensions: NDArray[Any]) -> float:
        """Return how far apart these and other tensions are, 0 if they may be the same."""
        if tensions.dtype != object:
            return float(np.abs(tensions - self.tensions).max(initial=0))
        pairs = zip(enclosures(tensions), enclosures(self.tensions), strict=True)  # or floats
        return max((one.apart(other) for one, other in pairs), default=0.0)


@dataclass
class CycleEnds:
    """x_G at the ends of the last cycles, and since when it has gone on in the same way.

    Every so many cycles the older half is dropped, with a note of the period with which x_G went
    on; what remains depends only on how many cycles were completed.
    """

    values: NDArray[np.float64]
    dropped: int = 0  # values before these
    noted: tuple[int, int] = (0, 0)  # a period, and since which cycle it holds

    @property
    def cycles(self) -> int:
        """Whole cycles so far."""
        return self.dropped + self.values.size - 1

    def add(self, block: NDArray[np.float64]) -> None:
        """Take over x_G at the ends of the next cycles."""
        while block.size:
            room = 2 * _REMEMBERED + 1 - self.values.size
            self.values = np.concatenate([self.values, block[:room]])
            block = block[room:]
            if self.values.size > 2 * _REMEMBERED:
                known = self._steps()
                since, best = min((self._repeats_since(k, *known), k) for k in range(1, 65))
                self.noted = best, since
                self.values = self.values[_REMEMBERED:]
                self.dropped += _REMEMBERED

    def repeats_since(self, period: int) -> int:
        """Return the first cycle from which on x_G moves with `period`, up to its advance.

        If that was before the cycles that are remembered and another period was noted then, the
        first of these.
        """
        return self._repeats_since(period, *self._steps())

    def _steps(self) -> tuple[NDArray[np.float64], float]:
        """Return the advances of the cycles that are remembered, and how nearly they repeat."""
        return np.diff(self.values), NEAR * max(1.0, float(np.abs(self.values).max()))

    def _repeats_since(self, period: int, steps: NDArray[np.float64], close: float) -> int:
        if steps.size < period:
            return self.cycles
        if steps.size > period and abs(steps[-1] - steps[-1 - period]) > close:  # most often
            return self.dropped + steps.size - period
        different = np.flatnonzero(np.abs(steps[period:] - steps[:-period]) > close)
        if different.size:
            return self.dropped + int(different[-1]) + 1
        noted, since = self.noted
        return since if noted and period % noted == 0 else self.dropped

    def periods(self, least: int, most: int) -> Iterator[int]:
        """Yield the periods from `least` to `most` that x_G has kept twice at the end."""
        steps, close = self._steps()
        for period in range(least, min(most, steps.size // 2) + 1):
            if abs(steps[-1] - steps[-1 - period]) > close:
                continue  # as almost always
            if (np.abs(steps[-period:] - steps[-2 * period : -period]) <= close).all():
                yield period


@dataclass
class Samples:
    """x_G at equally spaced targets from the start on: never more than a few thousand.

    When there are too many, every other one is dropped; which ones remain depends only on how many
    targets were reached.
    """

    values: NDArray[np.float64]
    spacing: int

    def add(self, first: int, block: NDArray[np.float64]) -> None:
        """Take over x_G at the targets `first`, `first` + 1, ..."""
        wanted = self.spacing * self.values.size
        self.values = np.concatenate([self.values, block[wanted - first :: self.spacing]])
        while self.values.size > _MOST_SAMPLES:
            self.values = self.values[::2]
            self.spacing *= 2

    def first_after(self, target: int) -> tuple[int, float]:
        """Return the first sampled target that is not before `target`, and x_G there."""
        k = min(-(-target // self.spacing), self.values.size - 1)
        return k * self.spacing, float(self.values[k])

    def error(self, burn_in: int, experiment: Experiment, *, least: bool = False) -> float:
        """Return the standard error of the velocity of a run, or `least` what it may be.

        nan if it is unknown.
        """
        drive = experiment.drive
        begin = -(-burn_in // self.spacing)
        targets = (self.values.size - begin) * self.spacing
        moved = self.values[-1] != self.values[0]
        if moved and not least and rests_for_long(experiment.chain, targets):
            return math.nan
        clock = drive.clock(np.arange(begin, self.values.size) * self.spacing)
        silent = math.nan if drive.random else 0.0
        return standard_error(self.values[begin:], clock, silent=silent, least=least)
