"""How far the trajectory of a run is known, from slightly perturbed copies of the run.

With disorder, nearby chains separate, and after some half-cycles rounding decides what happens. Two
copies of a slightly different chain are followed beside the run until one of them differs. This is
mostly soon, so that copies cost little.

Copies that have not differed after `MOST_EVENTS` events stay close: their distance from the run
grows in proportion to time, not exponentially (measured for 2 to 8 sliders over up to 400,000
events, with and without disorder). The run then counts as known for as long as this growth allows.

The number of copies and the margin were measured against certified tensions of 300 runs of 3 to 12
sliders with disorder. With the distance of two copies as its estimate, an error exceeded 1e-9 once;
with four times the distance never (at most 0.28 of the tolerance).
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from exactcreep.model.outcome import Evidence
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.quasistatic.observer import NEVER, Observer
from exactcreep.solvers.exact.copies import Copies
from exactcreep.solvers.interface import Simulation, Stretch
from exactcreep.watch.limits import NO_LIMITS

KNOWN = 1e-9
"""Largest error of a tension of a known trajectory, relative to the largest force that occurred."""
MARGIN = 4.0
"""Assumed ratio of the error of a run and the distance of its copies; see above."""
MOST_EVENTS = 2**14
"""Events of each copy that is followed by default."""
_ENOUGH = 16
"""`MOST_EVENTS` show whether copies separate in so many targets, or of at most so many sliders."""
_LEAST = 2.0**-52  # distances are not known better
_FIRST, _LONGEST = 1024, 2**14  # targets at once; the first is divided by n


class Predictability(Observer):
    """Finds up to which target the trajectory of a run is known, from the solver and its copies.

    `doubtful` is the first target with an undecided comparison, or 0. Up to target `agreed` the
    copies stayed within `distance`, at most ``KNOWN / MARGIN``.
    """

    state = ("doubtful", "agreed", "distance", "checked", "parted", "following", "copied")

    def __init__(self, experiment: Experiment) -> None:
        self.drive, self.n = experiment.drive, experiment.chain.n
        self._most_events = None if experiment.twin else MOST_EVENTS
        run = experiment.algorithm, experiment.chain, experiment.initial, experiment.seed
        self._made = partial(Copies, *run)  # at the first target, since copies may be large
        self.copies: Copies | None = None
        self.limits = NO_LIMITS  # of the run
        self._first = max(_FIRST // self.n, 4)
        self.doubtful, self.agreed, self.distance, self.checked = 0, 0, _LEAST, 0
        self.parted = False
        self.perturbed = self.following = experiment.algorithm.perturbs and self.n > 1
        self._tells = False  # whether the simulation says at each target if it is decided
        self.copied: Any = []  # snapshot of the copies; []: at their start, None: they have ended

    def next(self, done: int) -> int:
        if self.following:
            return done + min(max(self._first, done), _LONGEST)
        if self._tells or self.doubtful:
            return NEVER
        return max(self.checked + max(1, self.checked // 4), done + 1)

    def take(self, stretch: Stretch, first: int, simulation: Simulation) -> None:
        done = first + stretch.completed - 1
        self._tells = stretch.doubts is not None
        if stretch.doubts is not None:
            self._doubt(first, stretch.doubts > 0)
        elif done >= min(self.next(self.checked), self.drive.target_count):
            self._doubt(self.checked + 1, np.array([simulation.evidence is Evidence.UNDECIDED]))
            self.checked = done
        if self.following:
            self._compare(stretch, first)

    def _doubt(self, first: int, doubtful: Any) -> None:
        if doubtful.any():
            begin = first + int(np.argmax(doubtful))
            self.doubtful = min(self.doubtful or begin, begin)

    def _compare(self, stretch: Stretch, first: int) -> None:
        self.copies = self.copies or self._made()
        apart, limits = KNOWN / MARGIN, replace(self.limits, events=self._most_events, used=0)
        distance, whole = self.copies.follow(self.drive, first, stretch, apart, limits)
        close = distance[distance <= apart]
        self.parted = close.size < distance.size
        self.agreed = first - 1 + close.size
        self.distance = float(close.max(initial=self.distance))
        if self.parted or not whole:
            self.copies, self.following = None, False

    def known_until(self, done: int) -> int:
        """Return the number of targets, of `done`, up to which the trajectory is known."""
        known = self.agreed if self.perturbed else done
        if not self.parted and (self.n <= _ENOUGH or known >= _ENOUGH):
            known = int(min(known * KNOWN / MARGIN / self.distance, done))
        return min(known, self.doubtful - 1) if self.doubtful else known

    def kept(self) -> dict[str, Any]:
        self.copied = [] if self.following else None
        if self.copies is not None:
            self.copied = [copy.snapshot() for copy in self.copies.pair]
        return super().kept()

    def restore(self, kept: Any) -> None:
        super().restore(kept)
        self.copies = self._made() if self.copied else None
        if self.copies is not None:
            for copy, snapshot in zip(self.copies.pair, self.copied, strict=True):
                copy.restore(snapshot)
