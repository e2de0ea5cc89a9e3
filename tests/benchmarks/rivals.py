"""One rearrangement by general-purpose integrators, written as their users would write it.

Between two events the sliders that move obey Eqs. (dynamic_eq1)-(dynamic_eqN); the contact rules
switch from one set of movers to the next. Both rivals integrate the movers with their own event
detection (a velocity reaches zero, a neighbour reaches its threshold), stop at the event, and go on
with the new set. Nothing of `exactcreep.motion` or `exactcreep.solvers` is used; the static
coefficients are the keyed ones, drawn before the clock starts.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import heyoka
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from exactcreep.model.chain import Chain
from exactcreep.model.contacts import Itinerary
from exactcreep.model.disorder import static_coefficient
from exactcreep.model.state import State

LONGEST = 1000.0
MOST_EVENTS = 5000


class Failed(Exception):
    """The integrator saw no event, or too many."""


@dataclass
class Task:
    """A chain at theta_c, with the slider that starts, and the thresholds it will draw.

    Attributes
    ----------
    forces : ndarray, shape (n,)
        Non-frictional forces at theta_c.
    first : tuple of (slider, sign)
        Slider from 0.
    thresholds : list of list of float
        For each slider the threshold that holds, then those of the next draws.
    """

    n: int
    friction: float
    forces: NDArray[np.float64]
    first: tuple[tuple[int, int], ...]
    thresholds: list[list[float]]

    @classmethod
    def of(cls, chain: Chain, initial: State, itinerary: Itinerary, seed: int, ahead: int) -> Task:
        """Return the task that begins at `initial` with the first event of `itinerary`."""
        thresholds = []
        for n in range(1, chain.n + 1):
            held = int(initial.draws[n - 1]) - 1
            stops = sum(kind == "stop" and n in sliders for kind, sliders, _ in itinerary)
            coefficients = [
                float(static_coefficient(chain, seed, n, held + k))
                for k in range(stops + 1 + (ahead if stops else 0))
            ]
            mu_d = float(chain.mu_d)
            thresholds.append([max(mu, mu_d) * chain.cos_alpha for mu in coefficients])
        _, sliders, signs = itinerary[0]
        first = tuple((n - 1, sign) for n, sign in zip(sliders, signs, strict=True))
        return cls(chain.n, chain.friction, initial.forces(chain), first, thresholds)


@dataclass
class Course:
    """What an integration came to: the sequence of events, and how far each slider has moved."""

    itinerary: list[tuple[str, tuple[int, ...], tuple[int, ...]]] = field(default_factory=list)
    moved: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))


Flight = Callable[
    [NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]],
    tuple[NDArray[np.float64], NDArray[np.float64], int],
]
"""From (displacements, velocities, signs, thresholds) to displacements and velocities at the next
event, and the slider that has it."""


def rearranged(task: Task, fly: Flight) -> Course:
    """Return the rearrangement of `task` when `fly` integrates from event to event.

    Raises
    ------
    Failed
        If the integrator finds no event where there must be one.
    """
    n = task.n
    x, v, sign = np.zeros(n), np.zeros(n), np.zeros(n)
    drawn = [0] * n
    threshold = np.array([row[0] for row in task.thresholds])
    course = Course()

    def start(i: int, direction: float) -> None:
        sign[i] = direction
        course.itinerary.append(("start", (i + 1,), (int(direction),)))

    for i, direction in task.first:
        start(i, direction)
    while sign.any():
        if len(course.itinerary) > MOST_EVENTS:
            raise Failed("too many events")
        x, v, i = fly(x, v, sign, threshold)
        left = x[i - 1] - x[i] if i > 0 else 0.0
        right = x[i + 1] - x[i] if i < n - 1 else 0.0
        force = task.forces[i] + left + right
        if sign[i] == 0.0:
            start(i, math.copysign(1.0, force))
            continue
        course.itinerary.append(("stop", (i + 1,), (int(sign[i]),)))
        sign[i] = v[i] = 0.0
        drawn[i] += 1
        if drawn[i] >= len(task.thresholds[i]):
            raise Failed("other sliders move than in truth")
        threshold[i] = task.thresholds[i][drawn[i]]
        if abs(force) > threshold[i]:
            start(i, math.copysign(1.0, force))
    course.moved = x
    return course


def with_scipy(task: Task, rtol: float) -> Course:
    """Return the rearrangement by SciPy's `solve_ivp` (DOP853) with terminal events."""
    n, friction, rest = task.n, task.friction, task.forces

    def fly(
        x: NDArray[np.float64],
        v: NDArray[np.float64],
        sign: NDArray[np.float64],
        threshold: NDArray[np.float64],
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], int]:
        moving = np.flatnonzero(sign)
        p = moving.size
        low, high = max(moving[0] - 1, 0), min(moving[-1] + 2, n)  # with a neighbour at either end
        size = high - low
        place = moving - low
        frozen = x[low:high].copy()
        pull, drag = rest[low:high], friction * sign[moving]
        fixed_left = x[low - 1] if low > 0 else None
        fixed_right = x[high] if high < n else None
        ends = np.empty(size + 2)

        def forces(y: NDArray[np.float64]) -> NDArray[np.float64]:
            inner = ends[1:-1]
            inner[:] = frozen
            inner[place] = y[:p]
            ends[0] = inner[0] if fixed_left is None else fixed_left
            ends[-1] = inner[-1] if fixed_right is None else fixed_right
            return pull + (ends[:-2] + ends[2:] - 2.0 * inner)

        def slope(t: float, y: NDArray[np.float64]) -> NDArray[np.float64]:
            return np.concatenate([y[p:], forces(y)[place] - drag])

        events: list[Callable[[float, NDArray[np.float64]], float]] = []
        owners: list[int] = []

        def watch(event: Any, owner: int) -> None:
            event.terminal, event.direction = True, -1.0
            events.append(event)
            owners.append(owner)

        for k, i in enumerate(moving.tolist()):
            watch(lambda t, y, k=k, s=sign[i]: s * y[p + k], i)
        beside = {i + step for i in moving.tolist() for step in (-1, 1)} - set(moving.tolist())
        for i in sorted(beside):
            if 0 <= i < n:
                watch(lambda t, y, j=i - low, g=threshold[i]: g - abs(forces(y)[j]), i)
        begin = np.concatenate([x[moving], v[moving]])
        done = solve_ivp(
            slope, (0.0, LONGEST), begin, method="DOP853", rtol=rtol, atol=rtol * 1e-3,
            events=events,
        )  # fmt: skip
        if done.status != 1:
            raise Failed("no event")
        which = next(k for k, times in enumerate(done.t_events) if times.size)
        end = done.y_events[which][0]
        x, v = x.copy(), v.copy()
        x[moving], v[moving] = end[:p], end[p:]
        return x, v, owners[which]

    return rearranged(task, fly)


@dataclass
class _Window:
    """A compiled Taylor integrator for so many sliders side by side, any of which may move."""

    integrator: Any
    size: int

    @classmethod
    def of(cls, size: int, tol: float) -> _Window:
        names = [heyoka.make_vars(f"x{i}", f"v{i}") for i in range(size)]
        down = heyoka.event_direction.negative

        def given(kind: int, i: int) -> Any:
            return heyoka.par[kind * size + i]

        system, events = [], []
        for i, (x, v) in enumerate(names):
            moves, pull, drag, sign, limit = (given(kind, i) for kind in range(5))
            springs = given(5, i)
            force = pull - springs * x
            if i > 0:
                force = force + names[i - 1][0]
            if i < size - 1:
                force = force + names[i + 1][0]
            system += [(x, v), (v, moves * (force - drag))]
            rests = 1.0 - moves
            for margin in (sign * v + rests, moves + rests * (limit - force),
                           moves + rests * (limit + force)):  # fmt: skip
                events.append(heyoka.t_event(margin, direction=down))
        integrator = heyoka.taylor_adaptive(
            system, [0.0] * (2 * size), t_events=events, tol=tol, compact_mode=size > 4,
            pars=[0.0] * (6 * size),
        )  # fmt: skip
        return cls(integrator, size)


class Heyoka:
    """heyoka's adaptive Taylor integrator with terminal events, compiled once for each length.

    A window holds the movers and a neighbour at either end; windows come in a few lengths, so that
    a long chain does not pay for sliders that rest.
    """

    LENGTHS = (2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64)

    def __init__(self, n: int, tol: float) -> None:
        self.n = n
        self.tol = tol
        self.windows = {}
        for size in sorted({min(length, n) for length in self.LENGTHS}):
            self.windows[size] = _Window.of(size, tol)

    def rearrange(self, task: Task) -> Course:
        """Return the rearrangement."""
        return rearranged(task, lambda *state: self._fly(task, *state))

    def _fly(
        self,
        task: Task,
        x: NDArray[np.float64],
        v: NDArray[np.float64],
        sign: NDArray[np.float64],
        threshold: NDArray[np.float64],
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], int]:
        n = self.n
        moving = np.flatnonzero(sign)
        low, high = max(int(moving[0]) - 1, 0), min(int(moving[-1]) + 2, n)
        size = next(size for size in self.windows if size >= high - low)
        low = min(low, n - size)
        high = low + size
        window = self.windows[size]
        integrator = window.integrator
        inner = slice(low, high)
        springs = np.full(size, 2.0)
        pull = task.forces[inner].copy()
        if low == 0:
            springs[0] -= 1.0
        else:
            pull[0] += x[low - 1]
        if high == n:
            springs[-1] -= 1.0
        else:
            pull[-1] += x[high]
        given = integrator.pars.reshape(6, size)
        given[0] = sign[inner] != 0.0
        given[1] = pull
        given[2] = task.friction * sign[inner]
        given[3] = sign[inner]
        given[4] = threshold[inner]
        given[5] = springs
        integrator.state[0::2] = x[inner]
        integrator.state[1::2] = v[inner]
        integrator.time = 0.0
        integrator.reset_cooldowns()
        outcome = int(integrator.propagate_until(LONGEST)[0])
        events = 3 * size
        if not -events <= outcome <= -1:
            raise Failed(f"no event: {outcome}")
        x, v = x.copy(), v.copy()
        x[inner], v[inner] = integrator.state[0::2], integrator.state[1::2]
        return x, v, low + (-outcome - 1) // 3
