"""Slightly perturbed copies of a run, followed beside it until one of them differs.

A copy is a run of a slightly different chain. Its static coefficients scatter a little more, so
that every contact adds an error of about a rounding, and its initial tensions differ as much. Two
close chains separate at the same rate as the run separates from the truth.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.chain import Chain
from exactcreep.model.drive import Drive
from exactcreep.model.enclosure import floats
from exactcreep.model.numbers import nearest_float
from exactcreep.model.state import State, symmetric
from exactcreep.solvers.interface import Simulation, Solver, Stretch
from exactcreep.watch.limits import Limits

_ERROR = 2.0**-49
"""Initial error of the tensions of a copy, relative to the forces; coefficients: a quarter."""
_FAR = 16.0
"""Factor of the initial error of the copies that go to the first target only."""
_FAR_COPIES = [(share, block) for block in (1, 2, 3) for share in (_FAR, -_FAR)]
NEAR_COPIES = (1.0, 1), (-1.0, 2)
"""Shares of the initial error, and blocks, of the two copies; see `perturbed`."""
_FEWEST = 2
"""Targets after which the copies are first compared; then twice as many each time."""


def perturbed(chain: Chain, state: State, share: float, block: int) -> tuple[Chain, State]:
    """Return a chain and a start that differ by `share` times the initial error.

    The sign of the error of the tensions changes after each `block` springs. If the chain is the
    mirror image of itself, so is the copy: all its coefficients are larger by the same share.
    """
    mu_s, springs = chain.each("mu_s"), np.arange(chain.n - 1)
    error = Fraction(share * _ERROR * nearest_float(min(mu_s) + abs(chain.tan_alpha)))
    if mirrored := symmetric(chain, state):
        springs = np.minimum(springs, springs[::-1])
    wave = 1.0 - 2.0 * (springs // block % 2)
    start = replace(state, tensions=floats(state.tensions) + float(error) * wave)
    scatter = chain.sigma_mu if mirrored else abs(chain.sigma_mu + error / 4)
    if mirrored or "friction" in chain.unlike:  # a rough slider errs by more than the others
        mu_s = [mean * (1 + Fraction(abs(share) * _ERROR / 4)) for mean in mu_s]
    alike = len(set(mu_s)) == 1
    return replace(chain, mu_s=mu_s[0] if alike else mu_s, sigma_mu=scatter), start


class Copies:
    """Two copies of a run by `solver`; six that differ more are followed to the first target."""

    def __init__(self, solver: Solver, chain: Chain, state: State, seed: int) -> None:
        self._run = solver, chain, state, seed
        self._held = np.array(chain.each("mu_d", chain.times_cosine))
        self._pull = max(1.0, *(abs(float(force)) for force in chain.end_forces))
        self.pair = [self._copy(*of) for of in NEAR_COPIES]

    def _copy(self, share: float, block: int) -> Simulation:
        solver, chain, state, seed = self._run
        return solver.simulation(*perturbed(chain, state, share, block), seed, ("tension", "slips"))

    def follow(
        self, drive: Drive, first: int, stretch: Stretch, apart: float, limits: Limits
    ) -> tuple[NDArray[np.float64], bool]:
        """Compare the copies with a run, from target `first` of the drive on.

        `stretch` is the result of the run, with its tensions and slips. The copies stop soon after
        the target at which one of them is more than `apart` off, or after the events of `limits`.
        Returns for each target reached the largest distance of a tension (relative to the largest
        force: a weight, an end force, a tension, or the friction on a slider that has slipped; inf
        if other sliders have slipped), and whether they came to the end.
        """
        distance, count, whole = np.zeros(0), _FEWEST, True
        while whole and distance.size < stretch.completed and not (distance > apart).any():
            count = min(count, stretch.completed - distance.size)
            ahead = drive, first, stretch, distance.size, count, limits
            ways = [self._away(copy, *ahead) for copy in self.pair]
            reached = min(map(len, ways))
            distance = np.append(distance, np.max([way[:reached] for way in ways], axis=0))
            whole, count = reached == count, 2 * count
        if first == 1 and distance.size:
            distance[0] = max(distance[0], self._far_off(drive, stretch, limits))
        over = np.flatnonzero(distance > apart)
        return distance[: over[0] + 1 if over.size else None], whole

    def _far_off(self, drive: Drive, stretch: Stretch, limits: Limits) -> float:
        """Return the distance at the first target of copies that differ more, over `_FAR`."""
        tense = self._run[2].tensions.any()  # a relaxed start has no error
        if not tense or (stretch.doubts is not None and stretch.doubts[0] > 0):
            return 0.0
        copies = (self._copy(*of) for of in _FAR_COPIES)
        ways = [self._away(copy, drive, 1, stretch, 0, 1, limits) for copy in copies]
        return max(float(way.max(initial=0.0)) for way in ways) / _FAR

    def _away(
        self, copy: Simulation, drive: Drive, first: int, run: Stretch, done: int, count: int,
        limits: Limits,
    ) -> NDArray[np.float64]:  # fmt: skip
        """Return the distance of a copy from a run at the `count` targets after `done`."""
        passed = copy.follow(drive, first + done, count, limits.after(copy.tally.events))
        rows = slice(done, done + passed.completed)
        tension, slips = run.recorded["tension"][rows], run.recorded["slips"][rows]
        held = (self._held * (slips > 0)).max(axis=1, initial=self._pull)
        away = np.abs(tension - passed.recorded["tension"]).max(axis=1, initial=0.0)
        away /= np.maximum(np.abs(tension).max(axis=1, initial=0.0), held)
        away[(slips != passed.recorded["slips"]).any(axis=1)] = np.inf
        return np.append(away, np.inf) if passed.stop.final else away
