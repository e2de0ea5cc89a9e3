"""Slightly perturbed copies of a run, followed beside it until one of them differs.

A copy is the same run of a slightly different chain: its coefficients scatter a little more, so
that every contact adds an error of about a rounding. Its initial tensions differ, too. Two close
chains separate at the same rate as the run separates from the truth.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.chain import Chain
from exactcreep.model.drive import Drive
from exactcreep.model.numbers import nearest_float
from exactcreep.model.state import State
from exactcreep.solvers.interface import Simulation, Solver, Stretch
from exactcreep.watch.limits import Limits

_NUDGE = 2.0**-50
"""Initial error of the tensions of a copy, and of each coefficient, relative to the forces."""
_FAR = 16.0
"""Factor of the initial error of the pairs that go to the first target, to either side."""
_FIRST = 1
"""Half of the targets until the copies are first compared; then twice as many each time."""


def perturbed(chain: Chain, state: State, share: float, block: int) -> tuple[Chain, State]:
    """Return a chain and a start that differ by roundings; the sign changes after each `block`."""
    held = nearest_float(chain.largest_mu_s + abs(chain.tan_alpha))
    wave = 1.0 - 2.0 * (np.arange(chain.n - 1) // block % 2)
    tensions = state.tensions.astype(float) + share * _NUDGE * held * wave
    more = Fraction(abs(share) * _NUDGE * held / 4)
    further = replace(state, tensions=tensions)
    return replace(
        chain, sigma_mu=chain.sigma_mu + more if share > 0 else abs(chain.sigma_mu - more)
    ), further


class Copies:
    """Two copies of a run by `solver`, and until the first target six that differ more."""

    def __init__(self, solver: Solver, chain: Chain, state: State, seed: int) -> None:
        def copy(share: float, block: int) -> Simulation:
            other, start = perturbed(chain, state, share, block)
            return solver.simulation(other, start, seed, ("tension", "slips"))

        self.copies = [copy(1.0, 1), copy(-1.0, 2)]
        self.far = [copy(share, block) for block in (1, 2, 3) for share in (_FAR, -_FAR)]

    def follow(
        self, drive: Drive, first: int, stretch: Stretch, apart: float, limits: Limits
    ) -> tuple[NDArray[np.float64], bool]:
        """Compare the copies with a run, from target `first` of the drive on.

        `stretch` is the result of the run, with its tensions and slips. The copies stop soon after
        the target at which one of them is more than `apart` off, or after the events of `limits`.
        Returns for each target reached the largest distance of a tension (relative to the largest
        tension if this exceeds 1; inf if other sliders have slipped), and whether they came to the
        end.
        """
        done, count, distance = 0, _FIRST, np.zeros(0)
        while done < stretch.completed and not (distance > apart).any():
            count = min(2 * count, stretch.completed - done)
            away = [
                _away(copy, drive, first + done, stretch, done, count, limits)
                for copy in self.copies
            ]
            if first == 1 and done == 0:
                doubtful = stretch.doubts is not None and stretch.doubts[0] > 0
                for copy in () if doubtful else self.far:
                    far = _away(copy, drive, 1, stretch, 0, 1, limits) / _FAR
                    for row in away:
                        row[: far.size] = np.maximum(row[: far.size], far[: row.size])
            reached = min(map(len, away))
            distance = np.concatenate([distance, np.max([row[:reached] for row in away], axis=0)])
            done += reached
            if reached < count:
                break
        over = np.flatnonzero(distance > apart)
        return distance[: over[0] + 1 if over.size else None], done == stretch.completed

    def snapshot(self) -> Sequence[dict[str, Any]]:
        """Return how far the copies are, at a target."""
        return [copy.snapshot() for copy in self.copies]

    def restore(self, snapshot: Sequence[Mapping[str, Any]]) -> None:
        """Go on from a snapshot."""
        for copy, kept in zip(self.copies, snapshot, strict=True):
            copy.restore(kept)


def _away(
    copy: Simulation, drive: Drive, first: int, run: Stretch, done: int, count: int, limits: Limits
) -> NDArray[np.float64]:
    """Return the distance of a copy from a run at the targets that it reaches."""
    passed = copy.follow(drive, first, count, limits.after(copy.tally.events))
    rows = slice(done, done + passed.completed)
    tension, slips = run.recorded["tension"][rows], run.recorded["slips"][rows]
    size = np.abs(tension).max(axis=1, initial=1.0)
    away = np.abs(tension - passed.recorded["tension"]).max(axis=1, initial=0.0) / size
    away[(slips != passed.recorded["slips"]).any(axis=1)] = np.inf
    return away if not passed.stop.final else np.append(away, np.inf)
