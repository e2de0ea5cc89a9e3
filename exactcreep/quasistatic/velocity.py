"""The mean velocity of a run and its standard error, from x_G at a few thousand targets."""

from __future__ import annotations

import math
from collections.abc import Mapping
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.enclosure import Enclosure, enclosure, enclosures, floats
from exactcreep.model.numbers import nearest_float
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.solvers.solver import Simulation, Stretch, require, same_kind
from exactcreep.solvers.statistics import rests_for_long, standard_error

_MOST_SAMPLES = 4096  # of x_G that are kept for the standard error, however long the run
_MARKED = 1.25  # marks of a run whose length is not known lie so many times further apart
FIRST_LOOK = 128
"""Targets after which a run that goes on until its velocity is known is looked at first."""
_LOOKS = 1.5  # and then after so many times as many


class Mark(NamedTuple):
    """Where the run was at a target at which a burn-in may end."""

    done: int
    x_G: Enclosure
    displacements: NDArray[np.float64]
    events: int
    slips: int


class MeanVelocity:
    """Samples x_G at equally spaced targets: never more than a few thousand.

    When there are too many, every other one is dropped; which ones remain depends only on how many
    targets were reached.
    """

    needs = ()

    def __init__(self, experiment: Experiment) -> None:
        self.experiment = experiment
        drive, places = experiment.drive, experiment.initial.displacements
        begin = _mean(places)
        self.values = np.array([nearest_float(begin.middle)])
        self.spacing = 2 if drive.cyclic else 1
        self.marks = [Mark(0, begin, floats(places), 0, 0)]
        self.tail: list[Any] = [begin, begin]  # x_G at the last two targets
        self._cyclic = drive.cyclic
        self._burn_in = experiment.burn_in_of(drive.half_cycles)

    def next(self, done: int) -> int:
        """Return the next target at which a burn-in may end, or which is looked at."""
        if self.experiment.accuracy is None or self.experiment.burn_in is not None:
            ends = [self._burn_in]
        else:
            last = self.marks[-1].done
            ends = [_even(math.ceil(_MARKED * max(last, 1)) + 1)]
        if self.experiment.accuracy is not None:
            ends.append(next_look(done))
        return min((end for end in ends if end > done), default=done + (1 << 62))

    def take(self, stretch: Stretch, first: int, simulation: Simulation) -> None:
        """Take over x_G at the targets from `first` on."""
        x_G, done = stretch.recorded["x_G"], first + stretch.completed - 1
        self.tail = [*self.tail, *x_G[-2:].tolist()][-2:]
        wanted = self.spacing * len(self.values)
        self.values = np.concatenate([self.values, floats(x_G[wanted - first :: self.spacing])])
        while len(self.values) > _MOST_SAMPLES:
            self.values = self.values[::2]
            self.spacing *= 2
        longer = self.experiment.accuracy is not None and self.experiment.burn_in is None
        if done == self._burn_in or (longer and done == self.next(self.marks[-1].done)):
            tally, places = simulation.tally, floats(simulation.state().displacements)
            mark = Mark(done, enclosure(self.tail[-1]), places, tally.events, tally.slips)
            self.marks.append(mark)

    def burnt(self, done: int) -> Mark | None:
        """Return the mark at which the burn-in of a run of `done` targets ends, if it has one."""
        if self.experiment.accuracy is None:
            own = [mark for mark in self.marks if mark.done == self._burn_in]
        else:
            wanted = self.experiment.burn_in_of(done)
            own = [mark for mark in self.marks if mark.done <= wanted]
        return own[-1] if own else None

    def mean(self, done: int) -> tuple[int, Enclosure | None]:
        """Return the burn-in, and the mean velocity after it if there is any; see `Drive.per`."""
        burnt = self.burnt(done)
        if burnt is not None:
            burn_in, begin = burnt.done, burnt.x_G
        else:  # it ended before the planned burn-in did: take a shorter one, where x_G is known
            wanted = self.experiment.burn_in_of(done)
            k = min(-(-wanted // self.spacing), len(self.values) - 1)
            burn_in, begin = k * self.spacing, enclosure(float(self.values[k]))
        # whole cycles only: within one, the chain goes up as well as down
        partial = done % 2 if self._cyclic else 0
        last = done - partial
        if last <= burn_in:
            return min(burn_in, done), None
        left, reached = self.experiment.drive.clock(np.array([burn_in, last])).tolist()
        span = Fraction(reached) - Fraction(left)
        return burn_in, enclosure(self.tail[-1 - partial]).rate(begin, span) if span else None

    def error(self, burn_in: int, *, least: bool = False) -> float:
        """Return the standard error of the mean velocity, or `least` what it may be.

        nan if it is unknown.
        """
        drive = self.experiment.drive
        begin = -(-burn_in // self.spacing)
        targets = (len(self.values) - begin) * self.spacing
        moved = self.values[-1] != self.values[0]
        if moved and not least and rests_for_long(self.experiment.chain, targets):
            return math.nan
        clock = drive.clock(np.arange(begin, len(self.values)) * self.spacing)
        silent = math.nan if drive.random else 0.0
        return standard_error(self.values[begin:], clock, silent=silent, least=least)

    def kept(self) -> dict[str, Any]:
        """Return what a snapshot keeps of it."""
        tail = [enclosure(value) for value in self.tail]
        marks = [list(mark) for mark in self.marks[1:]]
        return {"values": self.values, "spacing": self.spacing, "tail": tail, "marks": marks}

    def restore(self, kept: Mapping[str, Any], done: int) -> None:
        """Take over what `kept` returned after `done` targets, or raise `ValueError`."""
        same_kind(self.kept() | {"values": self.values[:0]}, kept)
        values, spacing = kept["values"], kept["spacing"]
        least = self.spacing
        require(spacing >= least and spacing % least == 0, "samples are not spaced so")
        right = len(values) == done // spacing + 1 <= _MOST_SAMPLES and np.isfinite(values).all()
        require(bool(right) and values[0] == self.values[0], "samples of x_G are missing")
        tail = kept["tail"]
        require(len(tail) == 2 and all(isinstance(one, Enclosure) for one in tail), "so is x_G")
        require(done % spacing != 0 or nearest_float(tail[-1].middle) == values[-1], "x_G differs")
        for mark in kept["marks"]:
            same_kind(self.marks[0].displacements, mark[2], "a mark")
            counts = mark[0], mark[3], mark[4]
            whole = all(type(count) is int and 0 <= count < 2**60 for count in counts)
            require(whole and mark[0] <= done and isinstance(mark[1], Enclosure), "a mark is not")
            self.marks.append(Mark(*mark))
        self.values, self.spacing, self.tail = values, spacing, tail


def next_look(done: int) -> int:
    """Return the next target after which a run that is to reach an accuracy is looked at."""
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
