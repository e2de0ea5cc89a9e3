"""How far rounding may have taken an avalanche from the true one: errors carried along with it.

Small errors move as the chain itself does, without friction and weight. An event shifts them: a
slider at rest whose force is off by e starts ``e / F'`` too early, where F' is the rate of that
force, and the acceleration A with which it starts makes of this ``A e / F'`` of velocity. Next to a
graze F' all but vanishes, and digits are lost that no comparison misses. A stop forgets the error
of its velocity, and makes what the slider has left to go one of its place. (The tangent map with
its saltation at events, of a few directions at random.)
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from exactcreep.motion.arithmetic import FLOAT64
from exactcreep.motion.modes import Ends, modes

DIRECTIONS = 4
"""Of errors that are followed; their signs are random, and the same every time."""
MARGIN = 2.0
"""The estimate over the largest error followed, whose roundings are one of the largest number."""
_SEED = 20110603


class AmplifiedErrors:
    """Errors of forces and velocities of a chain in motion, to first order.

    Parameters
    ----------
    n : int
        Sliders.
    roundoff : float
        Largest relative error of one rounding.
    size : float
        The largest force.
    """

    def __init__(self, n: int, roundoff: float, size: float) -> None:
        self._random = np.random.default_rng(_SEED)
        self._roundoff, self._size = roundoff, size
        self.velocities = np.zeros((n, DIRECTIONS))
        self.moved = np.zeros((n, DIRECTIONS))
        self.forces = self._rounded(n)

    def _rounded(self, count: int) -> NDArray[np.float64]:
        """Return roundings of so many numbers."""
        signs = self._random.choice((-1.0, 1.0), (count, DIRECTIONS))
        return signs * (2 * self._roundoff * self._size)

    def advance(self, signs: NDArray[np.int64], time: float, size: float) -> None:
        """Let time pass while the sliders with a sign move; the largest number is then `size`."""
        self._size = max(self._size, size)
        moving = np.flatnonzero(signs)
        change = np.zeros_like(self.moved)
        for run in np.split(moving, np.flatnonzero(np.diff(moving) > 1) + 1):
            free = modes(FLOAT64, len(run), Ends(run[0] == 0, run[-1] == len(signs) - 1))
            w, shapes = free.frequencies[:, None], free.vectors
            speed, pull = shapes.T @ self.velocities[run], shapes.T @ self.forces[run]
            sin, cos = np.sin(w * (time / 2)), np.cos(w * (time / 2))
            swung = np.divide(sin, w, out=np.full_like(sin, time / 2), where=w > 0)
            change[run] = shapes @ (2 * swung * (pull * swung + speed * cos))
            self.velocities[run] += shapes @ (2 * (swung * cos * pull - sin * sin * speed))
        change[moving] += self._rounded(len(moving))
        self.velocities[moving] += self._rounded(len(moving))
        self._move(change)

    def _move(self, change: NDArray[np.float64]) -> None:
        self.moved += change
        stretched = np.diff(change, axis=0)
        self.forces[:-1] += stretched
        self.forces[1:] -= stretched

    def late(self, slider: int, sign: int, rate: float) -> NDArray[np.float64]:
        """Return by how much the event of a slider is too late.

        `sign` is that of a mover, 0 at rest; `rate` is that of its velocity, or of the force on it.
        """
        off = (self.velocities if sign else self.forces)[slider]
        with np.errstate(divide="ignore", invalid="ignore"):
            late: NDArray[np.float64] = np.nan_to_num(-off / rate, nan=np.inf)
        return late

    def cut_short(self, slider: int, way: float) -> None:
        """Take for an error what a slider had left to go when it was stopped.

        A slow one, whose speed is within the bounds of its time, may be stopped where it is.
        """
        change = np.zeros_like(self.moved)
        change[slider] = np.nan_to_num(way, nan=np.inf)
        self._move(change)

    def stop(self, sliders: Iterable[int]) -> None:
        """Bring sliders to rest."""
        for n in sliders:
            self.velocities[n] = 0.0

    def start(self, slider: int, acceleration: float, late: NDArray[np.float64]) -> None:
        """Let a slider start, with an acceleration, too late."""
        self.velocities[slider] = -acceleration * late

    @property
    def largest(self) -> float:
        """Estimate of the largest error of a displacement or a tension; inf if it is lost."""
        off = np.abs(self.moved).max(initial=0.0)
        stretched = np.abs(np.diff(self.moved, axis=0)).max(initial=0.0)
        # those of one direction may happen to cancel
        largest = MARGIN * float(max(off, stretched, 2 * self._roundoff * self._size))
        return largest if np.isfinite(largest) else np.inf
