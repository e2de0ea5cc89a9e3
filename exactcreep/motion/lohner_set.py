"""A set of states around a middle, in float64: rows times a box, and bounds of what they miss.

The middle is taken through the events as a point; the rows by the derivative of the motion over
all states of the set (mean value theorem). Now and then the rows are made orthogonal again, the
widest direction first. (Lohner's method, with the derivative of every event time in it.)
Only how far states lie from the middle is in floats: relative accuracy does not matter there, and
everything below is rounded up.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import flint
import numpy as np
from numpy.typing import NDArray

from exactcreep.compiling import njit
from exactcreep.motion.arithmetic import Undecided
from exactcreep.motion.verified_event import pass_through

_TINY = 2.0**-900


class Passage(NamedTuple):
    """A motion of the middle of a set and the event at its end; see `pass_through`."""

    signs: NDArray[np.int64]
    velocities: NDArray[np.float64]
    accelerations: NDArray[np.float64]
    time: float
    late: float
    unsure: float
    pace: float
    slider: int
    side: int
    image: int


class LohnerSet:
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

    @classmethod
    def spanned(
        cls, rows: NDArray[np.float64], fast: Sequence[int] = (), exponent: int = 0
    ) -> LohnerSet:
        """Return ``middle + rows [-1, 1]**k``: of forces, speeds of sliders `fast`, l0 theta."""
        out = cls.__new__(cls)
        out.exponent = exponent
        out.reach = np.zeros(len(rows) - 1 - len(fast))
        out._span(rows, list(fast))
        return out

    def follow(
        self, springs: NDArray[np.int64], passage: Passage, *, own: bool = True
    ) -> tuple[float, float]:
        """Let the middle pass through a motion, and its event; see `pass_through`."""
        rows = self.forces, self.speeds, self.moved, self.errors
        unit = math.ldexp(1.0, max(self.exponent, -1000))
        spread, late = pass_through(springs, *passage, *rows, unit, own)
        if not math.isfinite(spread):
            raise Undecided("an event's slope is not separated from zero")
        return spread, late

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
    def restored(cls, captured: Mapping[str, Any]) -> LohnerSet:
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


def orthogonal(
    rows: NDArray[np.float64], unsure: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return axes, nearly orthogonal, and half widths of a box that holds a set.

    Parameters
    ----------
    rows : ndarray, shape (n, k)
        The set is these rows times ``[-1, 1]**k`` (each rounded once) ...
    unsure : ndarray, shape (n,)
        ... widened by so much.

    Guarantee: rounding, and what the axes lack to be orthogonal, is added to the widths.

    Raises
    ------
    Undecided
        If the set is not bounded.
    """
    if not np.isfinite(rows).all() or not np.isfinite(unsure).all():
        raise Undecided("the derivative of a rearrangement is not enclosed")
    axes, sizes = _turned(rows, unsure)
    if not np.isfinite(sizes).all():
        raise Undecided("the derivative of a rearrangement is not enclosed")
    return axes, rounded_up(sizes)


@njit(cache=True)
def _turned(rows: Any, unsure: Any) -> tuple[Any, Any]:
    n, k = rows.shape
    axes, sizes = np.zeros((n, n)), np.empty(n)
    # rows that have no column in common with any others keep their axes: a slip at one end of a
    # long chain leaves those of the rest as they are
    block = np.arange(n)
    for c in range(k):
        first = -1
        for i in range(n):
            if rows[i, c] != 0:
                if first < 0:
                    first = block[i]
                elif block[i] != first:
                    other = block[i]
                    for j in range(n):
                        if block[j] == other:
                            block[j] = first
    for chosen in range(n):
        members = np.flatnonzero(block == chosen)
        size = len(members)
        if size == 0:
            continue
        part = rows[members]
        lengths = np.sqrt((part * part).sum(axis=0))
        order = np.argsort(-lengths, kind="mergesort")
        columns = order[np.abs(part).sum(axis=0)[order] > 0]  # where squares underflow, too
        part = np.ascontiguousarray(part[:, columns])
        basis = _basis(part)
        turn = np.ascontiguousarray(basis.T)
        # products of non-negative numbers bound the rounding of those above, entry by entry
        rounding = (size + 2) * 2.0**-52 * (np.abs(turn) @ np.abs(part))
        reach = (np.abs(turn @ part) + rounding).sum(axis=1) + np.abs(turn) @ unsure[members]
        off = np.abs(turn @ basis - np.eye(size)).sum(axis=1)
        most, defect = reach.max(), off.max()
        defect += size**2 * 2.0**-50
        if not defect < 0.5:  # the bound below sums a geometric series
            most = np.inf
        for j in range(size):
            sizes[members[j]] = reach[j] + 2 * defect * most
            for i in range(size):
                axes[members[i], members[j]] = basis[i, j]
    return axes, sizes


@njit(cache=True)
def _basis(part: Any) -> Any:
    """Return orthonormal columns, the first along the first columns of `part` (Gram, Schmidt)."""
    size, k = part.shape
    basis, count = np.zeros((size, size)), 0
    for c in range(k + size):
        if count == size:
            break
        one = np.zeros(size)
        if c < k:
            one[:] = part[:, c]
            least = 1e-10
        else:  # unit vectors, as far as these are missing
            one[c - k] = 1.0
            least = math.sqrt(0.5 / size)
        for again in range(2):  # what the first round leaves is not orthogonal enough
            before = math.sqrt((one * one).sum())
            for j in range(count):
                share = 0.0
                for i in range(size):
                    share += one[i] * basis[i, j]
                for i in range(size):
                    one[i] -= share * basis[i, j]
            after = math.sqrt((one * one).sum())
            if not after > (0.5 if again else least) * before:
                break
            one /= after
        else:
            basis[:, count] = one
            count += 1
    return basis



def rounded_up(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return sums of products of non-negative floats, raised above their rounding error."""
    return x * (1 + 2.0**-30) + _TINY


def exponent_of(x: Any) -> int:
    """Return the binary exponent of a number that is not negative (a very small one for 0)."""
    if x == 0:
        return -(10**6)
    mantissa, exponent = x.upper().man_exp()
    return int(exponent) + int(mantissa).bit_length()


def scaled(numbers: Sequence[Any], exponent: int) -> NDArray[np.float64]:
    """Return numbers that are not negative in units of ``2**exponent``, rounded up."""
    unit = flint.arb(2) ** -exponent
    return rounded_up(np.array([float((x * unit).upper()) for x in numbers]))
