"""A set of states around a middle, in float64: rows times a box, and bounds of what they miss.

The middle is taken through the events as a point; the rows by the derivative of the motion over
all states of the set (mean value theorem). Now and then the rows are made orthogonal again, the
widest direction first. (Lohner's method, with the derivative of every event time in it.)
Only how far states lie from the middle is in floats: relative accuracy does not matter there, and
everything below is rounded up.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import flint
import numpy as np
from numpy.typing import NDArray

from exactcreep.motion.arithmetic import Undecided
from exactcreep.motion.enclosure import exponent_of, orthogonal, rounded_up, scaled


class Surroundings:
    """The states ``middle + rows [-1, 1]**k``, in units of ``2**exponent``.

    Parameters
    ----------
    forces, theta : numbers
        How far any state may lie from the middle; theta times l0.
    speeds : mapping of int to number
        The same for the sliders in motion.

    Attributes
    ----------
    forces, speeds, moved : ndarray of float64, shape (n, k)
        Rows of the sliders; `moved` since the rows were last made orthogonal.
    theta : ndarray of float64, shape (k,)
        The row of l0 theta.
    errors : ndarray of float64, shape (3, n)
        How far the rows of forces, speeds and moved may be off, summed over the box.
    theta_error : float
    reach : ndarray of float64, shape (n,)
        How far displacements may lie from the middle's, but for `moved`.
    """

    def __init__(self, forces: Sequence[Any], speeds: Mapping[int, Any], theta: Any) -> None:
        radii = [*forces, *speeds.values(), theta]
        self.exponent = max(exponent_of(x) for x in radii)
        self.reach = np.zeros(len(forces))
        self._span(np.diag(scaled(radii, self.exponent)), list(speeds))

    def _span(self, rows: NDArray[np.float64], fast: list[int]) -> None:
        """Begin with these rows: of forces, of the speeds of sliders `fast`, of l0 theta."""
        n = len(self.reach)
        self.forces, self.theta = rows[:n].copy(), rows[-1].copy()
        self.speeds, self.moved = np.zeros((2, n, rows.shape[1]))
        self.errors = np.zeros((3, n))
        self.speeds[fast] = rows[n:-1]
        # each number of the rows has been rounded once
        self.errors[0] = 2.0**-52 * abs(self.forces).sum(axis=1)
        self.errors[1] = 2.0**-52 * abs(self.speeds).sum(axis=1)
        self.theta_error = 2.0**-52 * float(abs(self.theta).sum())

    def of_forces(self) -> NDArray[np.float64]:
        """Return how far forces may lie from the middle's."""
        return _within(self.forces, self.errors[0])

    def of_speeds(self) -> NDArray[np.float64]:
        """Return how far velocities may lie from the middle's."""
        return _within(self.speeds, self.errors[1])

    def of_tensions(self) -> NDArray[np.float64]:
        """Return how far tensions may lie from the middle's, shape (n - 1,)."""
        rows = np.cumsum(self.forces, axis=0)[:-1]
        size = len(self.forces) * 2.0**-52
        rounding = size * np.cumsum(abs(self.forces).sum(axis=1))[:-1]
        return _within(rows, np.cumsum(self.errors[0])[:-1] + rounding)

    def of_displacements(self) -> NDArray[np.float64]:
        """Return how far displacements may lie from the middle's."""
        return _within(self.moved, self.errors[2] + self.reach)

    def of_theta(self) -> float:
        """Return how far l0 theta may lie from the middle's."""
        return float(rounded_up(abs(self.theta).sum() + self.theta_error))

    def balls(self, radii: Any) -> list[Any]:
        """Return radii as numbers."""
        unit, ball = flint.arb((1, self.exponent)), flint.arb
        radii = radii if isinstance(radii, list) else radii.tolist()
        return [(ball(x) * unit).upper() for x in radii]

    def at_target(self) -> None:
        """Take theta to a given value."""
        self.forces[0] += self.theta
        self.forces[-1] -= self.theta
        self.errors[0, 0] += self.theta_error
        self.errors[0, -1] += self.theta_error
        self._ramped()
        self.theta[:] = self.theta_error = 0.0

    def at_start(self, ends: Sequence[int]) -> None:
        """Take theta to where the sliders `ends`, the first or the last or both, start."""
        both = self.forces[0] + self.forces[-1]
        error = self.errors[0, 0] + self.errors[0, -1]
        first = 0 in ends  # l0 theta has moved by what this slider lacked
        if first:
            self.theta += self.forces[0]
        else:
            self.theta -= self.forces[-1]
        self.theta_error += self.errors[0, 0 if first else -1]
        for end in (0, -1):
            self.forces[end] = self.errors[0, end] = 0.0
        if len(ends) == 1:
            other = -1 if first else 0
            self.forces[other], self.errors[0, other] = both, error
        self._ramped()

    def _ramped(self) -> None:
        """Add the rounding of a sum of two."""
        for end in (0, -1):
            self.errors[0, end] += 2.0**-52 * float(abs(self.forces[end]).sum())
        self.theta_error += 2.0**-52 * float(abs(self.theta).sum())

    def renew(self, forces: Sequence[Any], speeds: Mapping[int, Any], theta: Any) -> None:
        """Take a middle without errors, and make the rows orthogonal again.

        Parameters
        ----------
        forces, theta : numbers
            How far the old middle was from the new one; theta times l0.
        speeds : mapping of int to number
            The same for the sliders in motion.
        """
        fast = list(speeds)
        noise = [*forces, *speeds.values(), theta]
        exponent = max(self.exponent, *(exponent_of(x) for x in noise))
        rows = np.vstack([self.forces, self.speeds[fast], self.theta])
        errors = np.concatenate([self.errors[0], self.errors[1, fast], [self.theta_error]])
        less = max(self.exponent - exponent, -1000)
        unsure = np.ldexp(rounded_up(errors), less) + scaled(noise, exponent)
        axes, sizes = orthogonal(np.ldexp(rows, less), rounded_up(unsure))
        power = int(np.frexp(sizes.max())[1])
        less -= power
        self.reach = rounded_up(np.ldexp(self.of_displacements(), less))
        self.exponent = exponent + power
        self._span(axes * np.ldexp(sizes, -power), fast)

    def captured(self) -> dict[str, Any]:
        """Return everything as plain data."""
        return {name: _copied(value) for name, value in vars(self).items()}

    @classmethod
    def restored(cls, captured: Mapping[str, Any]) -> Surroundings:
        """Return what `captured` described."""
        out = cls.__new__(cls)
        for name, value in captured.items():
            setattr(out, name, _copied(value))
        return out


def _copied(value: Any) -> Any:
    return value.copy() if isinstance(value, np.ndarray) else value


def _within(rows: NDArray[np.float64], errors: NDArray[np.float64]) -> NDArray[np.float64]:
    out = rounded_up(abs(rows).sum(axis=1) + errors)
    if not np.isfinite(out).all():
        raise Undecided("the derivative of a rearrangement is not enclosed")
    return out
