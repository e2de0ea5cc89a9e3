"""The mean velocity of a run and its standard error, from x_G at a few thousand targets."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.enclosure import Enclosure, enclosure, enclosures, floats
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.quasistatic.observer import NEVER, Observer
from exactcreep.quasistatic.statistics import (
    alternates,
    jump_of,
    rests_are_short,
    rests_for_long,
    standard_error,
)
from exactcreep.solvers.interface import Simulation, Stretch

_MOST_SAMPLES = 4096  # samples of x_G for the standard error, in a run of any length
_MARKED = 1.25  # factor between successive marks of a run of unknown length
FIRST_LOOK = 128
"""Target at which the accuracy of a velocity is first tested."""
_LOOKS = 1.5  # factor between successive targets with a test


class Mark(NamedTuple):
    """The position of the run at a target at which a burn-in may end."""

    done: int
    x_G: Enclosure
    displacements: NDArray[np.float64]
    slips: int


class MeanVelocity(Observer):
    """Samples x_G at equally spaced targets; if there are too many, drops every second sample."""

    state = ("values", "spacing", "tail", "slips", "marks")

    def __init__(self, experiment: Experiment) -> None:
        self.experiment, self.drive = experiment, experiment.drive
        places = experiment.initial.displacements
        begin = _mean(places)
        self.values = np.array([float(begin)])
        self.spacing = 2 if self.drive.cyclic else 1
        self.marks: list[tuple[Any, ...]] = [(0, begin, floats(places), 0)]  # parts of a `Mark`
        self.tail = [begin, begin]  # x_G at the last two targets
        self.slips = 0
        self._burn_in = experiment.burn_in_of(self.drive.target_count)
        self._marks_all_along = experiment.accuracy is not None and experiment.burn_in is None
        if self._burn_in:
            self.needs = ("x", "slips")

    def next(self, done: int) -> int:
        return NEVER if self.experiment.accuracy is None else next_look(done)

    def _next_mark(self) -> int:
        last = self.marks[-1][0]
        if self._marks_all_along:
            return _even(math.ceil(_MARKED * max(last, 1)) + 1)
        return self._burn_in if self._burn_in > last else NEVER

    def take(self, stretch: Stretch, first: int, simulation: Simulation) -> None:
        x_G, done = stretch.recorded["x_G"], first + stretch.completed - 1
        self.tail = [*self.tail, *map(enclosure, x_G[-2:].tolist())][-2:]
        wanted = self.spacing * len(self.values)
        self.values = np.concatenate([self.values, floats(x_G[wanted - first :: self.spacing])])
        while len(self.values) > _MOST_SAMPLES:
            self.values = self.values[::2]
            self.spacing *= 2
        if self.needs:
            slips = self.slips + np.cumsum(stretch.recorded["slips"].sum(axis=1))
            while (mark := self._next_mark()) <= done:
                k = mark - first
                reached = enclosure(x_G[k : k + 1].tolist()[0])
                places = floats(stretch.recorded["x"][k]).copy()
                self.marks = [*self.marks, (mark, reached, places, int(slips[k]))]
            self.slips = int(slips[-1])

    def burnt(self, done: int) -> Mark | None:
        """Return the mark at which the burn-in of a run of `done` targets ends, if it has one."""
        marks = [Mark(*mark) for mark in self.marks]
        if self.experiment.accuracy is None:
            return next((mark for mark in marks if mark.done == self._burn_in), None)
        wanted = self.experiment.burn_in_of(done)
        return [mark for mark in marks if mark.done <= wanted][-1]

    def mean(self, done: int) -> tuple[int, Enclosure | None]:
        """Return the burn-in, and the mean velocity after it if there is any; see `Drive.per`."""
        burnt = self.burnt(done)
        if burnt is not None:
            burn_in, begin = burnt.done, burnt.x_G
        else:  # it ended before the planned burn-in: take an earlier mark as burn-in
            wanted = self.experiment.burn_in_of(done)
            k = min(-(-wanted // self.spacing), len(self.values) - 1)
            burn_in, begin = k * self.spacing, enclosure(float(self.values[k]))
        # whole cycles only, because the chain goes up as well as down within a cycle
        partial = done % 2 if self.drive.cyclic else 0
        last = done - partial
        if last <= burn_in:
            return min(burn_in, done), None
        left, reached = self.drive.clock(np.array([burn_in, last])).tolist()
        span = Fraction(reached) - Fraction(left)
        return burn_in, self.tail[-1 - partial].rate(begin, span) if span else None

    def error(self, burn_in: int, *, least: bool = False) -> float:
        """Return the standard error of the mean velocity, or `least` a lower bound; or nan."""
        begin = -(-burn_in // self.spacing)
        if not least and self._may_rest_for_longer(begin):
            return math.nan
        clock = self.drive.clock(np.arange(begin, len(self.values)) * self.spacing)
        silent = math.nan if self.drive.random or self.drive.cyclic else 0.0
        return standard_error(self.values[begin:], clock, silent=silent, least=least)

    def _may_rest_for_longer(self, begin: int) -> bool:
        """Return whether rests may be longer than this run, so that its mean is unknown."""
        chain, advances = self.experiment.chain, np.diff(self.values[begin:])
        if alternates(chain, self.drive):
            return bool(advances.any()) and not rests_are_short(advances, jump_of(chain))
        moved = self.values[-1] != self.values[0]
        return bool(moved) and rests_for_long(chain, (len(self.values) - begin) * self.spacing)


def next_look(done: int) -> int:
    """Return the next target at which an accuracy is tested."""
    look = FIRST_LOOK
    while look <= done:
        look = _even(math.ceil(_LOOKS * look))
    return look


def _even(target: int) -> int:
    return target + target % 2


def _mean(values: NDArray[Any]) -> Enclosure:
    if values.dtype != object:
        return enclosure(Fraction(math.fsum(values.tolist())) / len(values))
    middles, radii = zip(*enclosures(values), strict=True)
    return Enclosure(sum(middles) / Fraction(len(values)), sum(radii) / Fraction(len(values)))
