"""Replay a rearrangement from its events, phase by phase.

Between two instants with events the runs move in closed form::

    replay = Replay(chain, initial, events)
    for phase in replay:
        ...  # replay.flow is the chain as the phase begins: phase.runs move for phase.span
        phase.arrive()
        ...  # replay.flow is the chain at its end, phase.time, before anything happens
        for event in phase.events:
            phase.happen(event)
    end = replay.state()

If a caller leaves out `arrive` or `happen`, the next phase does it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.chain import Chain
from exactcreep.model.contacts import Contacts, Event, EventKind
from exactcreep.model.enclosure import same
from exactcreep.model.state import State
from exactcreep.motion.arithmetic import FLOAT64, Arithmetic
from exactcreep.motion.modes import Flow, ModalPiece, forces_of, frictions_of, loads_of
from exactcreep.motion.solution import Motion, Solution


class Energies(NamedTuple):
    """The energy balance since the start of a rearrangement, unit ``m g**2 tau_dyn**2``.

    `elastic`: gain of elastic energy; `kinetic`: present kinetic energy; `gravity`, `end_forces`:
    their work on the sliders; `friction`: dissipated energy; `lost`: kinetic energy removed by
    stops, zero except for errors of their times.
    """

    elastic: Any
    kinetic: Any
    gravity: Any
    end_forces: Any
    friction: Any
    lost: Any

    @property
    def left(self) -> Any:
        """The sum of all terms, which is zero except for rounding."""
        work = self.gravity + self.end_forces
        return work - self.friction - self.elastic - self.kinetic - self.lost


class Replay:
    """The motion that a list of events describes.

    Parameters
    ----------
    chain : Chain
    initial : State
        At rest, at theta_c.
    events : iterable of Event
        In order; they may be produced during the replay.
    arithmetic : Arithmetic
        All methods must be called inside its `active`.
    contacts : Contacts, optional
        The coefficients drawn at stops. Default: of seed 0.

    Attributes
    ----------
    flow : Flow
        The present chain: forces, velocities, directions, displacements since the start.
    now : number
        The present time since the start, unit tau_dyn.
    start : Motion
        At the beginning.
    moves : bool
        Whether any slider has moved yet.
    just_stopped : set of int
        Sliders (from 0) that have stopped at the present instant.

    Guarantee: between events the motion is the closed form for the given event times, in float64 to
    a few ulp of the largest displacement since; in balls an enclosure.
    """

    def __init__(
        self,
        chain: Chain,
        initial: State,
        events: Iterable[Event],
        arithmetic: Arithmetic = FLOAT64,
        contacts: Contacts | None = None,
    ) -> None:
        self.chain, self.initial, self.events = chain, initial, events
        self.arithmetic = arithmetic
        self.contacts = Contacts(chain) if contacts is None else contacts
        self.tensions = arithmetic.vector(initial.tensions)
        forces = forces_of(arithmetic, self.tensions, loads_of(arithmetic, chain))
        self.flow = Flow(arithmetic, forces, frictions_of(arithmetic, chain))
        places = arithmetic.vector(initial.displacements)
        self.start = Motion(places, arithmetic.zeros(chain.n), forces)
        self.now: Any = arithmetic.number(0)
        self.moves = False
        self.just_stopped: set[int] = set()
        self._draws: dict[int, int] = {}  # number of coefficients of each slider that has stopped
        self._paths = arithmetic.zeros(chain.n)  # path length of each slider
        self._lost: Any = arithmetic.number(0)

    def __iter__(self) -> Iterator[Phase]:
        """Yield the phases in order; the first ends at once, with the first events."""
        for events in _instants(self.events):
            phase = Phase(self, events)
            yield phase
            phase.finish()

    def coefficient(self, n: int) -> Any:
        """Return the present static coefficient of slider `n` (from 0), as drawn."""
        if n not in self._draws:
            return self.initial.coefficients[n]
        return self.contacts.coefficient(n + 1, self._draws[n] - 1)

    def threshold(self, n: int) -> Any:
        """Return the present threshold of slider `n` (from 0)."""
        return self.contacts.holds(n, self.coefficient(n), self.arithmetic)

    def residual(self, event: Event) -> Any:
        """Return by how much the condition of the next event is violated.

        For a stop it is the largest ``|velocity|``; for a start the largest distance of ``|F|``
        from the threshold. A slider that has just stopped, or whose chain was unstable at the
        start, may be beyond its threshold.
        """
        numbers = [slider - 1 for slider in event.sliders]
        if event.kind is EventKind.STOP:
            return max(abs(self.flow.velocities[n]) for n in numbers)
        zero = self.arithmetic.number(0)
        lacking = {n: self.threshold(n) - abs(self.flow.forces[n]) for n in numbers}
        return max(
            max(short, zero) if n in self.just_stopped or not self.moves else abs(short)
            for n, short in lacking.items()
        )

    def energies(self) -> Energies:
        """Return the energy balance since the start."""
        flow, chain, arithmetic, dot = self.flow, self.chain, self.arithmetic, self.arithmetic.dot
        pulled = zip(chain.end_forces, flow.moved[[0, -1]].tolist(), strict=True)
        return Energies(
            elastic=elastic_gain(self.arithmetic, self.tensions, flow.moved),
            kinetic=dot(flow.velocities, flow.velocities) / 2,
            gravity=arithmetic.times_cosine(chain, chain.tan_alpha) * flow.moved.sum(),
            end_forces=sum(arithmetic.number(force) * moved for force, moved in pulled),
            friction=dot(flow.friction, self._paths),
            lost=self._lost,
        )

    def state(self) -> State:
        """Return the present chain; velocities are left out."""
        initial, moved = self.initial, self.flow.moved
        coefficients, draws = initial.coefficients.copy(), initial.draws.copy()
        for n, count in self._draws.items():
            draws[n], coefficients[n] = count, float(self.coefficient(n))
        tensions, places = self.tensions + np.diff(moved), self.start.positions + moved
        return State(tensions, places, coefficients, draws, initial.theta)

    def solution(self) -> Solution:
        """Return the closed form of the whole motion, from the start to the last event.

        It uses up the replay when it is first evaluated.
        """
        self.events = tuple(self.events)
        times = [self.now]
        for together in _instants(self.events):
            time = self.arithmetic.number(together[0].time)
            if not same(time, times[-1]):
                times.append(time)
        return Solution(self._pieces, self.start, times)

    def _pieces(self) -> list[ModalPiece]:
        with self.arithmetic.active():
            return [phase.piece() for phase in self if phase.lasts]

    def residuals(self) -> tuple[Any, ...]:
        """Return the residual of every event, see `residual`."""
        found = []
        for phase in self:
            phase.arrive()
            for event in phase.events:
                found.append(self.residual(event))
                phase.happen(event)
        return tuple(found)


class Phase:
    """The time between two instants of a `Replay`, and the events at its end.

    `events`: at its end, stops before starts; `runs`: the moving runs; `time`, `span`: its end and
    duration; `lasts`: whether its duration is positive.
    """

    def __init__(self, replay: Replay, events: Sequence[Event]) -> None:
        self.replay, self.events, self.runs = replay, tuple(events), replay.flow.runs()
        self.time = replay.arithmetic.number(events[0].time)
        self.lasts = not same(self.time, replay.now)
        self.span = self.time - replay.now if self.lasts else replay.arithmetic.number(0)
        self._arrived, self._happened = False, 0

    def piece(self) -> ModalPiece:
        """Return the motion as a function of time, before the phase has passed."""
        replay = self.replay
        return replay.flow.piece(replay.now, self.time, replay.start, self.runs)

    def arrive(self) -> None:
        """Let the phase pass, once."""
        if self._arrived:
            return
        self._arrived = True
        replay, flow = self.replay, self.replay.flow
        replay.now = self.time
        if self.lasts:
            before = flow.moved.copy()
            flow.move(self.runs, self.span)
            if self.runs:
                replay._paths = replay._paths + (flow.moved - before) * flow.signs
                replay.moves = True
            replay.just_stopped = set()

    def happen(self, event: Event, only: Iterable[int] | None = None) -> None:
        """Apply the next event to all its sliders, or to those (from 0) in `only`."""
        self._happened += 1
        replay, flow = self.replay, self.replay.flow
        signs = {n - 1: sign for n, sign in zip(event.sliders, event.signs, strict=True)}
        numbers = list(signs if only is None else only)
        if event.kind is EventKind.START:
            flow.start(numbers, [signs[n] for n in numbers])
            return
        for n in numbers:
            replay._lost = replay._lost + flow.velocities[n] * flow.velocities[n] / 2
            replay._draws[n] = replay._draws.get(n, int(replay.initial.draws[n])) + 1
        flow.stop(numbers)
        replay.just_stopped.update(numbers)

    def finish(self) -> None:
        """Complete the phase."""
        self.arrive()
        for event in self.events[self._happened :]:
            self.happen(event)


def elastic_gain(arithmetic: Arithmetic, tensions: NDArray[Any], moved: NDArray[Any]) -> Any:
    """Return the gain of elastic energy by displacements, unit ``m g**2 tau_dyn**2``."""
    change = np.diff(moved)
    return arithmetic.dot(change, tensions) + arithmetic.dot(change, change) / 2


def _instants(events: Iterable[Event]) -> Iterator[list[Event]]:
    together: list[Event] = []
    for event in events:
        if together and not same(event.time, together[0].time):
            yield together
            together = []
        together.append(event)
    if together:
        yield together
