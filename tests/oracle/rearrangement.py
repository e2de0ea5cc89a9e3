"""An independent integration of one whole rearrangement, from the model's equations alone.

Between two events the moving sliders obey Eqs. 5-7 and are integrated with
SciPy's DOP853 at a relative tolerance of 1e-13. Events are looked for on the dense output, on
intervals that are halved until a bound of the second derivative excludes an event or a sample
shows one, and are then refined by integrating afresh to the event's time. Nothing of
`exactcreep.motion` or `exactcreep.solvers` is used.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

import numpy as np
from scipy.integrate import DOP853, DenseOutput
from scipy.optimize import brentq

from exactcreep.model.chain import Chain
from exactcreep.model.keyed_disorder import static_coefficient

TOGETHER = 1e-10
"""Events closer than this cannot be told apart: the trajectory is refused."""


class Undecided(Exception):
    """A graze, a tie or its length keeps the integration from telling what happens."""


@dataclass
class Trajectory:
    """What the integration came to."""

    ramp: float = 0.0  # l0 (theta_c - theta)
    times: list[float] = field(default_factory=list)
    itinerary: list[tuple[str, tuple[int, ...], tuple[int, ...]]] = field(default_factory=list)
    displacements: np.ndarray = field(default_factory=lambda: np.zeros(0))
    tensions: np.ndarray = field(default_factory=lambda: np.zeros(0))
    draws: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    longest_run: int = 0  # sliders that move at the same time, side by side
    closest: float = math.inf  # the shortest time between two events that are not reversals


def _thresholds(chain: Chain, coefficients: list[Any]) -> np.ndarray:
    holds = map(max, coefficients, chain.each("mu_d"))
    return np.array([chain.times_cosine(Fraction(mu)) for mu in holds])


def _forces(tensions: np.ndarray, weight: np.ndarray) -> np.ndarray:
    return np.diff(tensions, prepend=0.0, append=0.0) + weight


def _runs(sign: np.ndarray) -> list[tuple[int, int]]:
    """Return (first, one past the last) of every set of moving sliders side by side."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], sign != 0, [0]]).astype(int)))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _twice_energies(n: int, sign: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
    """Return sqrt(2J) of the run each slider belongs to (0 at rest).

    2J = |v|^2 + a.K^-1.a is constant until the next event; for a free run of the whole chain only
    the part orthogonal to the mean, whose acceleration is constant.
    """
    root = np.zeros(n)
    for first, end in _runs(sign):
        p = end - first
        stiffness = 2.0 * np.eye(p) - np.eye(p, k=1) - np.eye(p, k=-1)
        if first == 0:
            stiffness[0, 0] -= 1.0
        if end == n:
            stiffness[-1, -1] -= 1.0
        speed, push = v[first:end], a[first:end]
        if p == n:
            speed, push = speed - speed.mean(), push - push.mean()
            inverse = np.linalg.pinv(stiffness)
        else:
            inverse = np.linalg.inv(stiffness)
        root[first:end] = math.sqrt(max(speed @ speed + push @ inverse @ push, 0.0)) * (1 + 1e-9)
    return root


class _Phase:
    """The motion from one event to the next: tensions and velocities at its beginning."""

    def __init__(
        self,
        tensions: np.ndarray,
        v: np.ndarray,
        sign: np.ndarray,
        weight: np.ndarray,
        friction: np.ndarray,
        rtol: float,
    ) -> None:
        self.n = sign.size
        self.moving = np.flatnonzero(sign)
        self.sign = sign
        self.tensions = tensions
        self.weight = weight
        self.friction = friction
        self.rtol = rtol
        self.start = np.concatenate([np.zeros(self.moving.size), v[self.moving]])
        self.drag = (friction * sign)[self.moving]

    def _advance(self, y: np.ndarray) -> np.ndarray:
        x = np.zeros(self.n)
        x[self.moving] = y[: self.moving.size]
        return x

    def forces(self, y: np.ndarray) -> np.ndarray:
        return _forces(self.tensions + np.diff(self._advance(y)), self.weight)

    def slope(self, t: float, y: np.ndarray) -> np.ndarray:
        return np.concatenate([y[self.moving.size :], self.forces(y)[self.moving] - self.drag])

    def at(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return displacements since the beginning, velocities and forces of all sliders."""
        v = np.zeros(self.n)
        v[self.moving] = y[self.moving.size :]
        return self._advance(y), v, self.forces(y)

    def solver(self, t: float, y: np.ndarray, end: float) -> DOP853:
        return DOP853(self.slope, t, y, end, max_step=0.5, rtol=self.rtol, atol=1e-15)

    def carry(self, t: float, y: np.ndarray, end: float) -> np.ndarray:
        """Integrate from t to `end`."""
        if end <= t:
            return y
        solver = self.solver(t, y, end)
        while solver.status == "running":
            solver.step()
        return solver.y


def _derivative_bounds(
    phase: _Phase, v: np.ndarray, a: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return bounds that hold until the next event: of v'' or F'', and of the third derivative.

    |v^(k)| <= sqrt((K^k)_nn 2J) in a run, and K_nn <= 2, (K^2)_nn <= 6, (K^3)_nn <= 20.
    """
    root = _twice_energies(phase.n, phase.sign, v, a)
    beside = np.concatenate([[0.0], root, [0.0]])
    resting = math.sqrt(2.0) * (beside[:-2] + beside[2:])
    return np.where(phase.sign != 0, math.sqrt(6.0) * root, resting), math.sqrt(20.0) * root


def _first_root(
    room: Callable[[float], float], low: float, high: float, second: float
) -> float | None:
    """Return the first zero of `room` between low and high, None if there is none.

    `second` bounds the second derivative, so that every interval without a zero can be excluded.
    """
    intervals = [(low, room(low), high, room(high))]
    while intervals:
        low, left, high, right = intervals.pop()
        width = high - low
        monotone = abs(left - right) > second * width**2
        if left <= 0.0:
            raise Undecided("a slider is at its threshold, or at zero velocity, from the beginning")
        if right > 0.0 and (monotone or min(left, right) > second * width**2 / 8.0):
            continue
        if right <= 0.0 and monotone:
            return float(brentq(room, low, high, xtol=1e-15, rtol=8.9e-16))
        if width < 1e-12:
            raise Undecided("a graze")
        middle = 0.5 * (low + high)
        value = room(middle)
        if value > 0.0:
            intervals.append((middle, value, high, right))
        intervals.append((low, left, middle, value))
    return None


def _room(phase: _Phase, thresholds: np.ndarray, i: int, y: np.ndarray) -> float:
    """Return what is positive as long as nothing happens to slider i: its speed or its margin."""
    _, v, force = phase.at(y)
    if phase.sign[i] != 0:
        return float(phase.sign[i] * v[i])
    return float(thresholds[i] - abs(force[i]))


def _pace(phase: _Phase, i: int, y: np.ndarray) -> float:
    """Return the derivative of `_room`."""
    _, v, force = phase.at(y)
    if phase.sign[i] != 0:
        return float(phase.sign[i] * force[i] - phase.friction[i])
    return float(-np.sign(force[i]) * _second_difference(v)[i])


def _second_difference(v: np.ndarray) -> np.ndarray:
    ends = np.concatenate([[v[0]], v, [v[-1]]])
    return ends[:-2] + ends[2:] - 2.0 * v


def _first_event(
    phase: _Phase, thresholds: np.ndarray, longest: float
) -> tuple[float, np.ndarray, int]:
    """Return the time of the first event, the motion then, and the slider it happens to."""
    n, moving = phase.n, phase.moving
    _, v, force = phase.at(phase.start)
    a = np.zeros(n)
    a[moving] = force[moving] - phase.drag
    second, third = _derivative_bounds(phase, v, a)
    # A slider that has just started leaves v = 0 with its acceleration (with the next
    # derivative where its threshold acts as mu_d): nothing can stop it before `since`.
    since = np.zeros(n)
    jerk = _second_difference(v)
    for i in moving[v[moving] == 0.0]:
        push, pull = phase.sign[i] * a[i], phase.sign[i] * jerk[i]
        if push > 1e-12:
            since[i] = push / second[i]
        elif pull > 1e-9:
            since[i] = pull / third[i]
        else:
            raise Undecided("a slider starts with neither acceleration nor jerk")
    solver = phase.solver(0.0, phase.start, longest)
    while solver.status == "running":
        t_old, y_old = solver.t, solver.y.copy()
        if solver.step() is not None:
            raise Undecided("the integration failed")
        dense = solver.dense_output()
        roots = []
        for i in np.flatnonzero(second > 0.0).tolist():
            begin = max(t_old, since[i])
            if begin < solver.t:

                def room(t: float, i: int = i, dense: DenseOutput = dense) -> float:
                    return _room(phase, thresholds, i, dense(t))

                root = _first_root(room, begin, solver.t, second[i])
                if root is not None:
                    roots.append((root, i))
        if roots:
            roots.sort()
            time, slider = roots[0]
            if len(roots) > 1 and roots[1][0] - time < TOGETHER:
                raise Undecided("two events together")
            # the steps are more accurate than what lies between them: integrate to the root
            for _ in range(2):
                y = phase.carry(t_old, y_old, time)
                correction = _room(phase, thresholds, slider, y) / _pace(phase, slider, y)
                time = max(time - correction, t_old)
            return time, phase.carry(t_old, y_old, time), slider
    raise Undecided(f"no event within {longest}")


def integrate(
    chain: Chain,
    tensions: np.ndarray,
    draws: np.ndarray,
    direction: int,
    seed: int,
    *,
    rtol: float = 1e-13,
    most_events: int = 2000,
) -> Trajectory:
    """Return the rearrangement that follows when theta is ramped in `direction` to theta_c.

    `draws` says how many static coefficients each slider has had; the last of them holds.

    Raises
    ------
    Undecided
        If a graze, a tie or its length keeps this integration from telling what happens.
    """
    n = chain.n
    weight = np.full(n, chain.sin_alpha)
    weight[[0, -1]] += np.array(chain.end_forces, dtype=float)
    friction = np.array(chain.each("mu_d", chain.times_cosine))
    expansion = np.array(chain.expansion or [1] * (n - 1), dtype=float)
    draws = np.array(draws, dtype=np.int64)
    tensions = np.array(tensions, dtype=np.float64)
    held = [static_coefficient(chain, seed, i + 1, int(draws[i]) - 1) for i in range(n)]
    thresholds = _thresholds(chain, held)
    force = _forces(tensions, weight)
    if (np.abs(force) > thresholds).any():
        raise Undecided("the chain is not at rest")
    x = np.zeros(n)
    v = np.zeros(n)
    sign = np.zeros(n)
    done = Trajectory()

    # theta lowers the tensions: a force changes by what they differ in from spring to spring
    rates = -direction * np.diff(expansion, prepend=0.0, append=0.0)
    room = np.where(rates == 0.0, np.inf, thresholds - np.sign(rates) * force)
    ahead = room / np.where(rates == 0.0, 1.0, abs(rates))
    first, second = np.sort(ahead)[:2]
    if second - first < TOGETHER:
        raise Undecided("two sliders start together")
    done.ramp = float(direction * first)
    tensions -= done.ramp * expansion
    starter = int(ahead.argmin())
    sign[starter] = np.sign(rates[starter])
    time = 0.0
    done.itinerary.append(("start", (starter + 1,), (int(sign[starter]),)))
    done.times.append(0.0)
    if thresholds[starter] <= friction[starter]:  # a slip of length zero
        done.itinerary.append(("stop", (starter + 1,), (int(sign[starter]),)))
        done.times.append(0.0)
        draws[starter] += 1
        sign[starter] = 0.0

    while sign.any():
        if len(done.times) > most_events:
            raise Undecided(f"more than {most_events} events")
        lengths = [end - first for first, end in _runs(sign)]
        done.longest_run = max(done.longest_run, *lengths)
        phase = _Phase(tensions, v, sign.copy(), weight, friction, rtol)
        passed, y, i = _first_event(phase, thresholds, longest=1000.0)
        moved, v, force = phase.at(y)
        x += moved
        tensions = tensions + np.diff(moved)
        time += passed
        if len(done.times) > 1:
            done.closest = min(done.closest, passed)
        starts = True
        if sign[i] != 0:
            done.itinerary.append(("stop", (i + 1,), (int(sign[i]),)))
            done.times.append(time)
            v[i] = 0.0
            sign[i] = 0.0
            held[i] = static_coefficient(chain, seed, i + 1, int(draws[i]))
            draws[i] += 1
            thresholds = _thresholds(chain, held)
            if abs(abs(force[i]) - thresholds[i]) < TOGETHER:
                raise Undecided("a slider stops at its threshold")
            starts = bool(abs(force[i]) > thresholds[i])
        if starts:
            sign[i] = math.copysign(1.0, force[i])
            done.itinerary.append(("start", (i + 1,), (int(sign[i]),)))
            done.times.append(time)
    done.displacements, done.tensions, done.draws = x, tensions, draws
    return done
