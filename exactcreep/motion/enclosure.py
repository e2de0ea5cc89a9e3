"""A set of states that grows as nearby motions part, not as balls do.

In balls every operation forgets how errors depend on each other: an event costs bits although two
nearby trajectories stay close. Here the states at rest are ``middle + axes box``: the middle is
taken through a rearrangement as a point, the axes by the derivative of the motion over all
states of the set (mean value theorem), and at rest they are made orthogonal again, the widest
direction first. (Lohner's method, with the derivative of every event time in it.)
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import flint
import numpy as np
from numpy.typing import NDArray

from exactcreep.compiling import njit
from exactcreep.motion.arithmetic import Balls, Undecided
from exactcreep.motion.modes import Ends, modes

Row = list[Any]
ZERO = flint.arb(0)
"""One zero for all: what a long chain's axes mostly consist of is then known at a glance."""


@dataclass(frozen=True, eq=False)
class Passage:
    """One event and the motion before it, over all states of the set.

    Attributes
    ----------
    runs : tuple of (first, p, Ends)
    time : ball
        Duration of the motion.
    slider, side : int
        Whose speed (side 0), or whose distance to the threshold on that side, reaches zero.
    image : int or None
        The mirror image of `slider` in a chain that mirrors itself; it does the same.
    velocities, accelerations : ndarray of balls, shape (n,)
        At the event, before it is resolved.
    """

    runs: tuple[tuple[int, int, Ends], ...]
    time: Any
    slider: int
    image: int | None
    side: int
    velocities: NDArray[Any]
    accelerations: NDArray[Any]


class Spread:
    """How forces, velocities and displacements depend on the axes of the set.

    Parameters
    ----------
    forces : list of rows
        One row of k numbers per slider.
    balls : Balls
        Arithmetic of the derivative; calls are made inside its `active`.
    """

    def __init__(self, forces: list[Row], balls: Balls) -> None:
        self.balls = balls
        self.k = len(forces[0])
        zero = [ZERO] * self.k
        self.forces = [list(row) for row in forces]
        self.velocities = [zero for _ in forces]
        self.moved = [zero for _ in forces]

    def pass_through(self, passage: Passage) -> None:
        """Take the rows through a motion and to its event, whose time depends on the state."""
        travelled: dict[int, Row] = {}
        for first, p, ends in passage.runs:
            position, speed = self._propagated(first, p, ends, passage.time)
            for i in range(p):
                travelled[first + i] = position[i]
                self.velocities[first + i] = speed[i]
        self._add_displacements(travelled)
        delay = self._delay(passage)
        late: dict[int, Row] = {}
        for n in travelled:
            velocity, acceleration = passage.velocities[n], passage.accelerations[n]
            late[n] = [velocity * d for d in delay]
            self.velocities[n] = [
                x + acceleration * d for x, d in zip(self.velocities[n], delay, strict=True)
            ]
        self._add_displacements(late)
        zero = [ZERO] * self.k
        # what is constant at the event, whatever the state was; for an image this holds for the
        # states that mirror themselves, and only they need to be enclosed
        constant = self.velocities if passage.side == 0 else self.forces
        for m in (passage.slider, passage.image):
            if m is not None:
                constant[m] = zero

    def stop(self, n: int) -> None:
        """Bring slider `n` to rest."""
        self.velocities[n] = [ZERO] * self.k

    def _propagated(self, first: int, p: int, ends: Ends, t: Any) -> tuple[list[Row], list[Row]]:
        table = modes(self.balls, p, ends)
        w = table.frequencies
        sin, cos = self.balls.sin_cos(w * t)
        half, _ = self.balls.sin_cos(w * (t / 2))
        free = 1 if ends.left_free and ends.right_free else 0
        by_pull, by_speed = [t * t / 2] * free, [t] * free
        by_pull += [2 * x * x for x in half[free:] / w[free:]]
        by_speed += list(sin[free:] / w[free:])
        pulls = flint.arb_mat(self.forces[first : first + p])
        speeds = flint.arb_mat(self.velocities[first : first + p])
        modal_pulls, modal_speeds = table.forward * pulls, table.forward * speeds
        lag = _diagonal(by_speed)
        position = table.backward * (_diagonal(by_pull) * modal_pulls + lag * modal_speeds)
        speed = table.backward * (lag * modal_pulls + _diagonal(list(cos)) * modal_speeds)
        return position.tolist(), speed.tolist()

    def _add_displacements(self, travelled: dict[int, Row]) -> None:
        n = len(self.forces)
        for m, row in travelled.items():
            self.moved[m] = _sum(self.moved[m], row)
            beside = [j for j in (m - 1, m + 1) if 0 <= j < n]
            own = row if len(beside) == 1 else [2 * x for x in row]
            self.forces[m] = [f - x for f, x in zip(self.forces[m], own, strict=True)]
            for j in beside:
                self.forces[j] = _sum(self.forces[j], row)

    def _delay(self, passage: Passage) -> Row:
        """Return how the event time depends on the axes."""
        n = passage.slider
        if passage.side == 0:
            rate, row = passage.accelerations[n], self.velocities[n]
        else:
            beside = [j for j in (n - 1, n + 1) if 0 <= j < len(self.forces)]
            rate, row = sum(passage.velocities[j] for j in beside), self.forces[n]
        if rate.contains(0):
            raise Undecided("an event's slope is not separated from zero")
        factor = -1 / rate
        return [factor * x for x in row]


def _sum(a: Row, b: Row) -> Row:
    return [y if x is ZERO else x if y is ZERO else x + y for x, y in zip(a, b, strict=True)]


def _diagonal(entries: Sequence[Any]) -> Any:
    size = len(entries)
    out = flint.arb_mat(size, size)
    for i, value in enumerate(entries):
        out[i, i] = value
    return out


@dataclass(frozen=True, eq=False)
class Box:
    """The set ``axes box`` around a middle.

    Attributes
    ----------
    axes : list of rows of balls
        One row per number of the state, one column per axis.
    widths : ndarray of float64
        Half width along each axis, in units of ``2**exponent`` (far below the floats' range).
    exponent : int
    """

    axes: list[Row]
    widths: NDArray[np.float64]
    exponent: int

    @classmethod
    def of(cls, radii: Sequence[Any]) -> Box:
        """Return the box of the given half widths."""
        size = len(radii)
        axes = [[ZERO] * size for _ in range(size)]
        for i in range(size):
            axes[i][i] = flint.arb(1)
        exponent = max(exponent_of(r) for r in radii)
        return cls(axes, scaled(radii, exponent), exponent)

    def radii(self, rows: list[Row]) -> Row:
        """Return how far each row of numbers per axis reaches, rounded up."""
        middles, errors = _split(rows)
        unit = flint.arb(2) ** self.exponent
        reach = rounded_up((abs(middles) + errors) @ self.widths)
        return [flint.arb(x) * unit for x in reach.tolist()]

    def carried(self, rows: list[Row], noise: Sequence[Any]) -> Box:
        """Return a box that holds ``rows box`` widened by `noise`, its axes orthogonal.

        Guarantee: rounding, and what the axes lack to be orthogonal, is added to the widths.
        """
        exponent = max(self.exponent, *(exponent_of(x) for x in noise))
        widths = np.ldexp(self.widths, max(self.exponent - exponent, -1000)) + _TINY
        widened = scaled(noise, exponent)
        middles, errors = _split(rows)
        turned, sizes = orthogonal(middles * widths, rounded_up(errors @ widths + widened))
        axes = [[ZERO if x == 0 else flint.arb(x) for x in row] for row in turned.tolist()]
        power = int(np.frexp(sizes.max())[1])
        return Box(axes, np.ldexp(sizes, -power), exponent + power)


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


_TINY = 2.0**-900


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


def _split(rows: list[Row]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return balls as floats and bounds of their distances from them."""
    middles, radii = np.zeros((2, len(rows), len(rows[0])))
    for i, row in enumerate(rows):
        for j, x in enumerate(row):
            if x is not ZERO:
                middles[i, j], radii[i, j] = float(x), float(x.rad())
    return middles, rounded_up(radii) + 2.0**-51 * abs(middles)
