"""Carry a set of states through events in float64: a middle, rows times a box, and error bounds.

The middle goes through the events as a point; the rows follow the derivative of the motion over all
states of the set (mean value theorem). From time to time the rows are made orthogonal again, the
widest direction first. (This is Lohner's method, with the derivative of every event time in it.)
Only the distances of states from the middle are floats. Their relative accuracy does not matter,
and all of them are rounded up.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from copy import copy
from typing import Any, NamedTuple

import flint
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr

from exactcreep.compiling import njit
from exactcreep.motion.arithmetic import Undecided
from exactcreep.motion.taylor_flow import OUTWARD, flow

LATEST = 0.125
"""Largest time between the events of a set; within it no rate more than doubles."""
UNDERFLOW = 2.0**-900
"""Bound of everything that is lost when products of floats underflow."""
NOT_BOUNDED = "the derivative of a rearrangement is not enclosed"


class Crossing(NamedTuple):
    """A motion of the middle of a set and the event at its end; arrays are of shape (n,)."""

    springs: NDArray[np.int64]  # number of springs of each slider
    signs: NDArray[np.int64]  # direction of motion; 0: at rest
    velocities: NDArray[np.float64]  # at the event, before it is resolved; zero at rest
    accelerations: NDArray[np.float64]
    unsure: float  # largest distance of any state of the set from these numbers, at one time
    time: float  # duration
    late: float  # largest distance of the event time of any state from `time`
    haste: float  # bound in all states, at one time, of accelerations and of four times velocities
    slider: int  # the slider whose speed, or distance to the threshold, reaches zero
    side: int  # 0: the speed; else the side of the threshold
    image: int  # its mirror image, which does the same; -1: there is none

    @property
    def slope(self) -> float:
        """The rate of the function that the event brings to zero, except for its sign."""
        n, after = self.slider, self.slider + 1
        if self.side == 0:
            return float(self.accelerations[n])
        beside: list[float] = self.velocities[max(n - 1, 0) : after + 1].tolist()
        return sum(beside)  # the slider itself rests

    @property
    def steep(self) -> bool:
        """Whether the slope is far enough from zero for `saltation` to enclose the event's time."""
        vague: float = self.unsure + self.late * _fastest(self.haste, self.late)
        return self.late <= LATEST and abs(self.slope) > 8 * vague


class StateSet:
    """The states ``middle + rows [-1, 1]**k``, in units of ``2**exponent``.

    `forces`, `speeds`, `moved` (ndarray of float64, shape (n, k)): rows of the sliders' forces,
    velocities, and displacements since the rows were last made orthogonal; `theta` (ndarray of
    float64, shape (k,)): row of l0 theta; `errors` (ndarray of float64, shape (3, n)): errors of
    the first three rows, summed over the box; `reach` (ndarray of float64, shape (n,)): distance of
    displacements from the middle's, in addition to `moved`.
    """

    def __init__(self, forces: Sequence[Any], speeds: Mapping[int, Any], theta: Any) -> None:
        radii = [*forces, *speeds.values(), theta]
        self.exponent = max(exponent_of(x) for x in radii)
        self.reach = np.zeros(len(forces))
        self._span(np.diag(scaled(radii, self.exponent)), list(speeds))

    @classmethod
    def spanned(
        cls, rows: NDArray[np.float64], fast: Sequence[int] = (), exponent: int = 0
    ) -> StateSet:
        """Return ``middle + rows [-1, 1]**k``: of forces, speeds of sliders `fast`, l0 theta."""
        out = cls.__new__(cls)
        out.exponent = exponent
        out.reach = np.zeros(len(rows) - 1 - len(fast))
        out._span(rows, list(fast))
        return out

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

    # -- distances of states from the middle ---------------------------------------------------

    def of_forces(self) -> NDArray[np.float64]:
        """Return the largest distances of forces from the middle's."""
        return _within(self.forces, self.errors[0])

    def of_speeds(self) -> NDArray[np.float64]:
        """Return the largest distances of velocities from the middle's."""
        return _within(self.speeds, self.errors[1])

    def of_tensions(self) -> NDArray[np.float64]:
        """Return the largest distances of tensions from the middle's, shape (n - 1,)."""
        rows = np.cumsum(self.forces, axis=0)[:-1]
        size = len(self.forces) * 2.0**-52
        rounding = size * np.cumsum(abs(self.forces).sum(axis=1))[:-1]
        return _within(rows, np.cumsum(self.errors[0])[:-1] + rounding)

    def of_displacements(self) -> NDArray[np.float64]:
        """Return the largest distances of displacements from the middle's."""
        return _within(self.moved, self.errors[2] + self.reach)

    def of_theta(self) -> float:
        """Return the largest distance of l0 theta from the middle's."""
        return float(rounded_up(abs(self.theta).sum() + self.theta_error))

    def balls(self, radii: Iterable[float]) -> list[Any]:
        """Return radii as numbers."""
        unit, ball = flint.arb((1, self.exponent)), flint.arb
        return [(ball(x) * unit).upper() for x in map(float, radii)]

    def widened(self, numbers: NDArray[Any], radii: NDArray[np.float64]) -> NDArray[Any]:
        """Return numbers of the middle as balls of these radii."""
        out = np.empty_like(numbers)
        pairs = zip(numbers.tolist(), self.balls(radii), strict=True)
        out[:] = [x + flint.arb(0, radius) for x, radius in pairs]
        return out

    def width(self) -> tuple[float, float]:
        """Return the largest distance of a force, velocity or l0 theta from the middle's.

        Also returns the share of the errors in it.
        """
        widest, share = _width(self.forces, self.speeds, self.errors, self.theta, self.theta_error)
        if not math.isfinite(widest):
            raise Undecided(NOT_BOUNDED)
        return widest, share

    # -- motion of the set ---------------------------------------------------------------------

    def follow(self, crossing: Crossing, *, own: bool = True) -> tuple[float, float]:
        """Let the middle pass through a motion, and its event; see `saltation`."""
        rows = self.forces, self.speeds, self.moved, self.errors
        unit = math.ldexp(1.0, max(self.exponent, -1000))
        spread, late = saltation(crossing, crossing.slope, rows, unit, own)
        if not math.isfinite(spread):
            raise Undecided("an event's slope is not separated from zero")
        return spread, late

    def at_target(self, rates: Mapping[int, float]) -> None:
        """Take theta to a given value; `rates`: of `Chain.rates`, the nearest floats."""
        self._ramp(rates, -self.theta, self.theta_error)
        self.theta[:] = self.theta_error = 0.0

    def at_start(self, starts: Sequence[int], rates: Mapping[int, float]) -> None:
        """Ramp theta to where the sliders `starts` (from 0) reach their threshold together."""
        first = starts[0]
        rate = rates[first]
        way = -self.forces[first] / rate  # change of l0 theta that takes this slider there
        error = float(self.errors[0, first]) / abs(rate)
        if abs(rate) != 1.0:  # the rounding of the rate and of both quotients
            error += 2.0**-50 * (error + _total(way))
        self._ramp(rates, way, error)
        self.theta += way
        self.theta_error += error + 2.0**-52 * _total(self.theta)
        for n in starts:
            self.forces[n] = self.errors[0, n] = 0.0

    def _ramp(self, rates: Mapping[int, float], way: NDArray[np.float64], error: float) -> None:
        """Change l0 theta by a row with an error bound `error`, and every force by its rate."""
        size = _total(way) + error
        for n, rate in rates.items():
            self.forces[n] += rate * way
            # the rounding of a rate that is not 1 or -1, and of its products
            rounded = 0.0 if abs(rate) == 1.0 else 2.0**-50 * size
            self.errors[0, n] += abs(rate) * (error + rounded)
            self.errors[0, n] += 2.0**-52 * _total(self.forces[n])

    def renew(self, forces: Sequence[Any], speeds: Mapping[int, Any], theta: Any) -> None:
        """Take a new middle, and make the rows orthogonal again.

        The arguments bound the distances of the old middle from it in forces, speeds of moving
        sliders, and l0 theta.
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

    def copy(self) -> StateSet:
        """Return a set with arrays of its own."""
        alike = StateSet.__new__(StateSet)
        vars(alike).update({name: copy(value) for name, value in vars(self).items()})
        return alike


def _total(row: NDArray[np.float64]) -> float:
    return float(np.add.reduce(abs(row)))


def _bounded(x: NDArray[np.float64]) -> NDArray[np.float64]:
    if not np.isfinite(x).all():
        raise Undecided(NOT_BOUNDED)
    return x


def _within(rows: NDArray[np.float64], errors: NDArray[np.float64]) -> NDArray[np.float64]:
    return _bounded(rounded_up(abs(rows).sum(axis=1) + errors))


def rounded_up(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return sums of products of non-negative floats, raised above their rounding error."""
    return x * (1 + 2.0**-30) + UNDERFLOW


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


def orthogonal(
    rows: NDArray[np.float64], unsure: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return nearly orthogonal axes, and half widths of a box that holds a set.

    The set is `rows`, shape (n, k), each rounded once, times ``[-1, 1]**k``, widened by `unsure`,
    shape (n,). The widths include rounding and the deviation of the axes from orthogonality. Raises
    `Undecided` if the set is not bounded.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        size = np.abs(_bounded(rows)).sum(axis=1) + _bounded(unsure)
        axes, sizes, blocks = np.eye(len(rows)), size * (1 + 2.0**-48), _blocks(rows)
        for block in np.flatnonzero(np.bincount(blocks) > 1).tolist():
            members = np.flatnonzero(blocks == block)
            part, count = rows[members], len(members)
            basis = qr(part, pivoting=True, check_finite=False)[0]  # the widest direction first
            turn = np.abs(basis.T)
            # products of non-negative numbers bound the rounding of those above, entry by entry
            rounding = (count + 2) * 2.0**-52 * (turn @ np.abs(part))
            reach = (np.abs(basis.T @ part) + rounding).sum(axis=1) + turn @ unsure[members]
            defect = np.abs(basis.T @ basis - np.eye(count)).sum(axis=1).max() + count**2 * 2.0**-50
            if not defect < 0.5:  # the bound below sums a geometric series
                raise Undecided(NOT_BOUNDED)
            sizes[members] = reach + 2 * defect * reach.max()
            axes[np.ix_(members, members)] = basis
    return axes, rounded_up(_bounded(sizes))


@njit(cache=True)
def _blocks(rows: Any) -> Any:
    """Return the block of each row: rows of two blocks have no column in common.

    Blocks are treated independently, so that a slip at one end of a long chain changes one block.
    """
    block = np.arange(len(rows))
    for c in range(rows.shape[1]):
        touched = np.flatnonzero(rows[:, c])
        for i in touched[1:]:
            block[block == block[i]] = block[touched[0]]
    return block


@njit(cache=True)
def _fastest(haste: float, late: float) -> float:
    """Return a bound of the rates of change of velocities and accelerations near their event.

    `haste` bounds accelerations and four times velocities at one time. Each changes at most as fast
    as the larger of the two, so they grow at most like exp(4 t), and by 1 + 8 t up to `LATEST`.
    """
    return haste * (1 + 8 * late) * (1 + OUTWARD)


@njit(cache=True, error_model="numpy")
def saltation(crossing: Any, rate: float, rows: Any, unit: float, own: bool) -> tuple[float, float]:
    """Take the rows of a set through a motion and to its event; return the spread of its time.

    State by state the event is later by ``-row / rate``, where `row` is the event's function, and
    each number changes by its own rate times this delay.

    `rate`: slope of the event's function; `rows`: of a `StateSet`, in units of `unit`, changed in
    place; `own`: whether the rows are the set itself, and determine the event times of its states
    (else they are differences of states). Returns the distance of event times from the middle's, in
    units of the rows (nan: the slope is not separated from zero, and nothing was done), and `late`
    by the rows.
    """
    time, late, slider, side = crossing.time, crossing.late, crossing.slider, crossing.side
    forces, speeds, moved, errors = rows
    if late > LATEST:
        return math.nan, late
    unsure, fastest = crossing.unsure, _fastest(crossing.haste, late)
    vague = 2 * (unsure + late * fastest) + 2.0**-50 * abs(rate)
    if not abs(rate) > 2 * vague:
        return math.nan, late
    n, k = forces.shape
    signs, moving = crossing.signs, np.flatnonzero(crossing.signs)
    begin, end = moving[0], moving[-1] + 1
    of_force = math.sqrt((errors[0][moving] ** 2).sum())
    of_speed = math.sqrt((errors[1][moving] ** 2).sum())
    u, f = speeds[begin:end].copy(), forces[begin:end].copy()
    u[signs[begin:end] == 0] = f[signs[begin:end] == 0] = 0.0
    way, first, rounding = flow(crossing.springs[begin:end], signs[begin:end], u, f, time)
    # the event times of all states are much closer than the search needed: by the slope, with
    # the rows at one (rounded) time
    scale = 8 * (first + of_force + of_speed) * (1 + time)
    lag = 2.0**-52 * (1 + time) * scale
    e_force = of_force + 2 * of_speed + 3 * rounding + lag
    e_speed = of_speed + time * of_force + (1 + time) * rounding + lag
    e_way = (time + time * time / 2) * (of_speed + of_force) + (1 + time) ** 2 * rounding + lag
    for i in moving:
        for c in range(k):
            forces[i, c], speeds[i, c] = f[i - begin, c], u[i - begin, c]
            moved[i, c] += way[i - begin, c]
            for m in (i - 1, i + 1):
                if 0 <= m < n and signs[m] == 0:
                    forces[m, c] += way[i - begin, c]
    row = speeds[slider].copy() if side == 0 else forces[slider].copy()
    if own:
        apart = e_speed if side == 0 else errors[0, slider] + 2 * e_way
        for c in range(k):
            apart += abs(row[c])
        by = unit * apart / (abs(rate) - vague) * (1 + OUTWARD)
        late = min(late, by + 2.0**-50 * (1 + time))
    vague = 2 * (unsure + late * fastest) + 2.0**-50 * abs(rate)
    of_force, of_speed = e_force, e_speed
    for c in range(k):
        of_force += math.sqrt((f[:, c] ** 2).sum())
        of_speed += math.sqrt((u[:, c] ** 2).sum())
    lag = late * _fastest(max(of_force, 4 * of_speed), late)
    e_force, e_speed, e_way = e_force + lag, e_speed + lag, e_way + lag
    for i in moving:
        errors[0, i], errors[1, i] = e_force, e_speed
        errors[2, i] += e_way
        for m in (i - 1, i + 1):
            if 0 <= m < n and signs[m] == 0:
                errors[0, m] += e_way
    # the event is later or earlier, state by state
    e_row = errors[1 if side == 0 else 0, slider]
    spread = 0.0
    for c in range(k):
        row[c] = -row[c] / rate
        spread += abs(row[c])
    e_spread = (e_row + spread * vague) / (abs(rate) - vague) * (1 + OUTWARD) + 2.0**-50 * spread
    _shift(crossing, moving, rows, row, vague / 2, spread, e_spread)
    # constant at the event in every state
    for m in (slider, crossing.image):
        if m >= 0:
            constant = speeds if side == 0 else forces
            constant[m] = 0.0
            errors[1 if side == 0 else 0, m] = 0.0
    return (spread + e_spread) * (1 + OUTWARD), late


@njit(cache=True)
def _shift(
    crossing: Any, moving: Any, rows: Any, row: Any, unsure: float, spread: float, e_spread: float
) -> None:
    """Let the event be later by `row`, state by state, by at most `spread`."""
    forces, speeds, moved, errors = rows
    n, k = forces.shape
    velocities, accelerations = crossing.velocities, crossing.accelerations
    off = np.zeros(n)
    for i in moving:
        off[i] = _off(velocities[i], unsure, spread, e_spread)
    for i in range(max(moving[0] - 1, 0), min(moving[-1] + 2, n)):
        pull = _with_neighbours(-crossing.springs[i] * velocities[i], velocities, i)
        for c in range(k):
            speeds[i, c] += accelerations[i] * row[c]
            moved[i, c] += velocities[i] * row[c]
            forces[i, c] += pull * row[c]
        if crossing.signs[i] != 0:
            errors[1, i] += _off(accelerations[i], unsure, spread, e_spread)
            errors[2, i] += off[i]
        errors[0, i] += _with_neighbours(2 * off[i], off, i)
        for c in range(k):  # sums of a few terms
            errors[0, i] += 2.0**-49 * abs(forces[i, c])
            errors[1, i] += 2.0**-49 * abs(speeds[i, c])
            errors[2, i] += 2.0**-49 * abs(moved[i, c])


@njit(cache=True)
def _off(x: float, unsure: float, spread: float, e_spread: float) -> Any:
    return (abs(x) + unsure) * e_spread + (unsure + 2.0**-49 * abs(x)) * spread


@njit(cache=True)
def _with_neighbours(total: float, x: Any, i: int) -> float:
    if i > 0:
        total += x[i - 1]
    if i < len(x) - 1:
        total += x[i + 1]
    return total


@njit(cache=True)
def _width(
    forces: Any, speeds: Any, errors: Any, theta: Any, theta_error: float
) -> tuple[float, float]:
    widest, share = 0.0, 0.0
    for c in range(len(theta)):
        widest += abs(theta[c])
    widest = (widest + theta_error) * (1 + OUTWARD)
    for way, rows in enumerate((forces, speeds)):
        total, error = 0.0, 0.0
        for i in range(len(rows)):
            size = 0.0
            for c in range(rows.shape[1]):
                size += abs(rows[i, c])
            total, error = max(total, size), max(error, errors[way, i])
            widest = max(widest, (size + errors[way, i]) * (1 + OUTWARD))
        if error > share * total:
            share = error / total if total > 0 else 1.0
    return widest, share
