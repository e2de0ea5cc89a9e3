"""How far the trajectory of a run can be predicted, from slightly perturbed copies of the run.

With disorder, nearby chains separate, and after some half-cycles rounding decides what happens. Two
perturbed copies with the same disorder are rounded once more at every target, and followed until
one differs. This is mostly soon, so that copies cost little.

The number of copies and the margin were measured against certified tensions of 300 runs of 3 to 12
sliders with disorder. With the distance of two copies as its estimate, an error exceeded 1e-12 once
and 1e-9 once; with four times the distance never (at most 0.22 and 0.28 of the tolerances). The
median run that becomes undecided is decided for 6 half-cycles, and trusted for 16.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from exactcreep.model.outcome import Evidence
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.quasistatic.observer import NEVER, Observer
from exactcreep.solvers.interface import TENSION_TOLERANCE, Simulation, Stretch
from exactcreep.watch.limits import NO_LIMITS

TRUSTED = 1e-9
"""Tolerance of tensions for `Creep.trusted_half_cycles`; see `TENSION_TOLERANCE`."""
MARGIN = 4.0
"""Assumed ratio of the error of a run and the distance of its copies; see above."""
MOST_EVENTS = 2**14
"""Events of each copy that is followed by default."""
_FIRST, _LONGEST = 1024, 2**14  # targets at once; the first is divided by n


class Predictability(Observer):
    """Compares a run with its perturbed copies, and finds where the run becomes undecided.

    `undecided_from` is the first undecided target, or 0. Up to target `agreed` the tensions of the
    copies differ by at most ``TRUSTED / MARGIN``.
    """

    state = ("undecided_from", "agreed", "checked", "parted", "following", "copied")

    def __init__(self, experiment: Experiment, simulation: Simulation) -> None:
        self.drive = experiment.drive
        self._most_events = None if experiment.twin else MOST_EVENTS
        self._made = simulation.copies  # called at the first target, since copies may be large
        self.copies: Any = None
        self.limits = NO_LIMITS  # of the run
        self._first = max(_FIRST // experiment.chain.n, 4)
        self.undecided_from, self.agreed, self.checked = 0, 0, 0
        self.parted = False
        self.following = experiment.algorithm.perturbs and experiment.chain.n > 1
        self._known = False  # whether the simulation says at each target if it is decided
        self.copied: Any = {}  # snapshot of the copies; {}: at their start, None: they have ended

    def next(self, done: int) -> int:
        if self.following:
            return done + min(max(self._first, done), _LONGEST)
        if self._known or self.undecided_from:  # each target says whether it is decided
            return NEVER
        return max(self.checked + max(1, self.checked // 4), done + 1)

    def take(self, stretch: Stretch, first: int, simulation: Simulation) -> None:
        done = first + stretch.completed - 1
        self._known = stretch.doubts is not None
        if stretch.doubts is not None:
            self._doubt(first, stretch.doubts > 0)
        elif done >= min(self.next(self.checked), self.drive.half_cycles):
            self._doubt(self.checked + 1, np.array([simulation.evidence is Evidence.UNDECIDED]))
            self.checked = done
        if self.following:
            self._compare(stretch, first)

    def _doubt(self, first: int, doubtful: Any) -> None:
        if doubtful.any():
            begin = first + int(np.argmax(doubtful))
            self.undecided_from = min(self.undecided_from or begin, begin)

    def _compare(self, stretch: Stretch, first: int) -> None:
        if self.copies is None:
            self.copies = self._made()
        if self.copies is None:
            self.agreed = first - 1 + stretch.completed
            return
        apart, limits = TRUSTED / MARGIN, replace(self.limits, events=self._most_events, used=0)
        distance, whole = self.copies.follow(self.drive, first, stretch, apart, limits)
        self._doubt(first, MARGIN * distance > TENSION_TOLERANCE)
        parts = distance > apart
        self.parted = bool(parts.any())
        self.agreed = first - 1 + (int(parts.argmax()) if self.parted else distance.size)
        if self.parted or not whole:
            self.copies, self.following = None, False

    @property
    def trusted_half_cycles(self) -> int | None:
        """The last target up to which the run can be trusted, None if that is unknown."""
        return self.agreed if self.parted or self.following else None

    def kept(self) -> dict[str, Any]:
        self.copied = {} if self.following else None
        if self.copies is not None:
            self.copied = self.copies.snapshot()
        return super().kept()

    def restore(self, kept: Any) -> None:
        super().restore(kept)
        self.copies = self._made() if self.copied else None
        if self.copies is not None:
            self.copies.restore(self.copied)
