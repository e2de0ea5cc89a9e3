"""General-purpose integrators as solvers, written as their users would write them.

Between two events the sliders that move obey Eqs. (dynamic_eq1)-(dynamic_eqN); the contact rules
switch from one set of movers to the next. Both rivals integrate the movers with their own event
detection (a velocity reaches zero, a neighbour reaches its threshold), stop at the event, and go on
with the new set. Nothing of `exactcreep.motion` is used. `registered` makes them methods of
`compare`: ``Method("scipy", rtol=1e-9)``, ``Method("heyoka", tol=1e-9)``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from exactcreep.limits import NO_LIMITS, Limits, Stop
from exactcreep.model.contacts import Contacts, Event, EventKind
from exactcreep.model.drive import Drive
from exactcreep.model.state import State
from exactcreep.solvers.registry import SOLVERS
from exactcreep.solvers.solver import Rearrangement, Simulation, Solver, Start, Stretch, Tally
from exactcreep.solvers.tables import record_arrays, rows_of

try:
    import heyoka
except ImportError:  # the extra `bench`
    heyoka = None

LONGEST = 1000.0
MOST_EVENTS = 5000


class Failed(Exception):
    """The integrator saw no event, or too many."""


@dataclass
class Task:
    """A chain at theta_c: forces, friction, thresholds, and the sliders that start.

    `draw` returns the next threshold of a slider, from 0.
    """

    n: int
    friction: float
    forces: NDArray[np.float64]
    first: list[int]
    thresholds: NDArray[np.float64]
    draw: Callable[[int], float]


@dataclass
class Course:
    """What an integration gives: its events with their times, and how far each slider moved."""

    events: list[tuple[str, int, int, float]] = field(default_factory=list)
    moved: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))


Flight = Callable[
    [NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]],
    tuple[NDArray[np.float64], NDArray[np.float64], int, float],
]
"""From (displacements, velocities, signs, thresholds) to displacements and velocities at the next
event, the slider that has it, and the time until then."""


def rearranged(task: Task, fly: Flight) -> Course:
    """Return the rearrangement of `task` when `fly` integrates from event to event.

    Raises
    ------
    Failed
        If the integrator finds no event where there must be one.
    """
    n, time = task.n, 0.0
    x, v, sign = np.zeros(n), np.zeros(n), np.zeros(n)
    threshold, course = task.thresholds, Course()

    def start(i: int, force: float) -> None:
        sign[i] = math.copysign(1.0, force)
        course.events.append(("start", i, int(sign[i]), time))

    for i in task.first:
        start(i, task.forces[i])
    while sign.any():
        if len(course.events) > MOST_EVENTS:
            raise Failed("too many events")
        x, v, i, span = fly(x, v, sign, threshold)
        time += span
        left = x[i - 1] - x[i] if i > 0 else 0.0
        right = x[i + 1] - x[i] if i < n - 1 else 0.0
        force = task.forces[i] + left + right
        if sign[i] == 0.0:
            start(i, force)
            continue
        course.events.append(("stop", i, int(sign[i]), time))
        sign[i] = v[i] = 0.0
        threshold[i] = task.draw(i)
        if abs(force) > threshold[i]:
            start(i, force)
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
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], int, float]:
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
        return x, v, owners[which], float(done.t_events[which][0])

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


class Windows:
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
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], int, float]:
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
        return x, v, low + (-outcome - 1) // 3, float(integrator.time)


class RivalSimulation(Simulation):
    """A chain on its way along a drive, in float64: ramp to theta_c, rearrange, repeat."""

    def __init__(self, start: Start, record: tuple[str, ...], rearrange: Any) -> None:
        self.chain, self.record, self.rearranged = start.chain, record, rearrange
        self.contacts = Contacts(start.chain, start.seed)
        self.seed, self.tally = start.seed, Tally()
        self.theta = float(start.state.theta)
        self.tensions = start.state.tensions.astype(float)
        self.x = start.state.displacements.astype(float)
        self.draws = np.array(start.state.draws)
        self.thresholds = np.array([self._threshold(i, -1) for i in range(start.chain.n)])

    def _threshold(self, i: int, ahead: int = 0) -> float:
        mu = float(self.contacts.coefficient(i + 1, int(self.draws[i]) + ahead))
        return max(mu, float(self.chain.mu_d)) * self.chain.cos_alpha

    def _drawn(self, i: int) -> float:
        self.draws[i] += 1
        return self._threshold(i, -1)

    def _forces(self) -> NDArray[np.float64]:
        around = np.concatenate([[0.0], self.tensions, [0.0]])
        return np.diff(around) + self.chain.sin_alpha

    def follow(self, drive: Drive, first: int, count: int, limits: Limits = NO_LIMITS) -> Stretch:
        """Take the chain to some targets."""
        rows: dict[str, list[Any]] = {name: [] for name in ("x_G", *self.record)}
        l0, begin, q = float(self.chain.l0), self.tally.events, first
        stop = None
        while q < first + count and stop is None:
            target = float(drive.targets(q, 1, self.seed)[0])
            way = 1.0 if target >= self.theta else -1.0
            forces = self._forces()
            # a dilation takes l0 dtheta from every tension: only the ends of the chain feel it
            rooms = {0: self.thresholds[0] + way * forces[0],
                     self.chain.n - 1: self.thresholds[-1] - way * forces[-1]}  # fmt: skip
            least = min(rooms.values())
            if self.theta * way + least / l0 > target * way:
                self.tensions -= l0 * (target - self.theta)
                self.theta = target
                values = {"x_G": self.x.mean(), "x": self.x.copy(), "tension": self.tensions.copy()}
                for name in rows.keys() & values.keys():
                    rows[name].append(values[name])
                q += 1
                continue
            self.theta += way * least / l0
            self.tensions -= way * least
            starting = [i for i, room in rooms.items() if room == least]
            task = Task(self.chain.n, self.chain.friction, self._forces(), starting,
                        self.thresholds, self._drawn)  # fmt: skip
            try:
                self._log(self.rearranged(task), q, rows)
            except Failed as failure:
                arrays = record_arrays(rows, self.chain.n)
                return Stretch(q - first, arrays, Stop.LIMIT, str(failure))
            stop = limits.stop(self.tally.events - begin)
        reason = limits.reason(stop or Stop.DONE)
        arrays = record_arrays(rows, self.chain.n)
        return Stretch(q - first, arrays, stop or Stop.DONE, reason)

    def _log(self, course: Course, q: int, rows: dict[str, list[Any]]) -> None:
        for number, (kind, i, sign, time) in enumerate(course.events):
            if "events" in rows:
                event = Event(time, EventKind(kind), (i + 1,), (sign,), 0.0)
                place = (q, self.tally.rearrangements, number, self.theta)
                rows["events"] += rows_of(event, *place)
            self.tally.slips += kind == "stop"
        self.tally.events += len(course.events)
        self.tally.rearrangements += 1
        self.x += course.moved
        self.tensions += np.diff(course.moved)

    def state(self) -> State:
        """Return the present state, at rest."""
        held = [
            self.contacts.coefficient(i + 1, int(k) - 1) for i, k in enumerate(self.draws.tolist())
        ]
        return State(
            tensions=self.tensions.copy(), displacements=self.x.copy(), theta=self.theta,
            coefficients=np.array(held, dtype=float), draws=self.draws.copy(),
        )  # fmt: skip

    @property
    def at_rest(self) -> bool:
        """Whether it rests: a call ends between two rearrangements."""
        return True

    def snapshot(self) -> dict[str, Any]:
        """Refuse: a rival is not resumed."""
        raise NotImplementedError

    def restore(self, snapshot: Mapping[str, Any]) -> None:
        """Refuse: a rival is not resumed."""
        raise NotImplementedError


@dataclass(frozen=True)
class SciPy(Solver):
    """SciPy's `solve_ivp` with terminal events."""

    rtol: float = 1e-9
    name: ClassVar[str] = "scipy"
    summary: ClassVar[str] = "SciPy's DOP853"
    records: ClassVar[tuple[str, ...]] = ("x_G", "x", "tension", "events")

    def rearrange_from(self, start: Start, direction: int, limits: Limits) -> Rearrangement:
        """Refuse: only runs are compared."""
        raise NotImplementedError

    def simulation_from(self, start: Start, record: tuple[str, ...]) -> Simulation:
        """Return a simulation from a start."""
        return RivalSimulation(start, record, lambda task: with_scipy(task, float(self.rtol)))


@dataclass(frozen=True)
class Heyoka(SciPy):
    """heyoka's adaptive Taylor integrator with terminal events."""

    tol: float = 1e-9
    name: ClassVar[str] = "heyoka"
    summary: ClassVar[str] = "heyoka's Taylor integrator"

    def simulation_from(self, start: Start, record: tuple[str, ...]) -> Simulation:
        """Return a simulation from a start."""
        return RivalSimulation(start, record, Windows(start.chain.n, float(self.tol)).rearrange)


RIVALS: dict[str, type[Solver]] = {"scipy": SciPy} | ({} if heyoka is None else {"heyoka": Heyoka})


@contextmanager
def registered() -> Iterator[None]:
    """Let the rivals be solvers by name."""
    SOLVERS.update(RIVALS)
    try:
        yield
    finally:
        for name in RIVALS:
            del SOLVERS[name]
