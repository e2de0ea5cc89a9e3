"""Mechanics in balls at the price of one point: a Lohner set carried through the events.

The middle of a set of states goes through the events as a point of full precision, its rounding in
balls. Float64, with proved bounds, holds how far other states of the set lie from the middle
(`motion.lohner_set`) and proves which event comes first in all of them (`motion.verified_event`);
balls only enclose that event in the middle. What float64 does not tell apart (ties, grazes, a whole
chain that may run away) is asked of the set as plain balls.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from itertools import accumulate
from typing import Any, ClassVar, NamedTuple

import flint
import numpy as np
from numpy.typing import NDArray

from exactcreep.model.contacts import Event
from exactcreep.model.state import State
from exactcreep.motion.arithmetic import Arithmetic, Undecided
from exactcreep.motion.first_event import FirstEvent, lone_event
from exactcreep.motion.lohner_set import HURRY, TINY, LohnerSet, Passage
from exactcreep.motion.modes import Flow, ModalPiece, forces_of
from exactcreep.motion.solution import Motion
from exactcreep.motion.verified_event import enclosed_event, verified_event
from exactcreep.solvers.field.event_loop import Mechanics, event_of
from exactcreep.solvers.solver import Start

STRETCH = 16
"""Events after which the set is put together again; the middle's rounding grows by about 3 bits
per event meanwhile, and so do the errors of the derivative."""
MOST_ERROR = 2.0**-10
"""Share of the errors of the derivative in the set at which it is put together earlier."""


class Verified(NamedTuple):
    """The next event of all states of the set: who acts, when at most how far from when."""

    slider: int = 0
    side: int = 0
    time: float = 0.0
    radius: float = 0.0
    pace: float = 0.0  # of the motion until then, see `Passage`


class LohnerMechanics(Mechanics):
    """`Mechanics` in balls of the middle of a set, with the set beside it; see the module.

    Attributes
    ----------
    set : LohnerSet or None
        None: the balls hold every state.
    tangent : list of LohnerSet
        Rows that are taken along with it: how states part, each a column of a derivative.
    """

    stretch: ClassVar[int] = STRETCH

    def __init__(
        self, start: Start, arithmetic: Arithmetic, *, assume: bool = False, keep: bool = False
    ) -> None:
        super().__init__(start, arithmetic, assume=assume)
        self.keep = keep
        self.start: Motion | None = None
        self.pieces: list[ModalPiece] = []
        self.set: LohnerSet | None = None
        self.tangent: list[LohnerSet] = []
        self.slack: Any = 0  # how far forces and l0 theta lie from the middle's
        self.far = 0.0  # so do velocities
        self.since = 0  # events since the set was put together
        self.verified = Verified()
        self.springs = np.full(self.chain.n, 2)
        self.springs[[0, -1]] = 1
        self.crossing_ends: list[int] = []

    # -- the set -------------------------------------------------------------------------------

    def _sign(self, x: Any, slack: Any = None) -> int:
        # what is compared moves by at most two forces, or a force and l0 theta
        return super()._sign(x, 2 * self.slack if self.set is not None else slack)

    def _widened(
        self, numbers: NDArray[Any], radii: Callable[[LohnerSet], NDArray[np.float64]]
    ) -> NDArray[Any]:
        """Return numbers of the middle in balls that hold every state."""
        return numbers.copy() if self.set is None else self.set.widened(numbers, radii(self.set))

    def _wide_velocities(self, velocities: NDArray[Any]) -> NDArray[Any]:
        """Return velocities in balls that hold every state; one that is zero is so in all."""
        wide = self._widened(velocities, LohnerSet.of_speeds)
        still = [bool(x == 0) for x in velocities.tolist()]
        wide[still] = velocities[still]
        return wide

    def _wide(self, flow: Flow) -> Flow:
        """Return the flow in balls that hold every state."""
        forces = self._widened(flow.forces, LohnerSet.of_forces)
        out = Flow(self.arithmetic, forces, self.friction)
        out.velocities, out.signs = self._wide_velocities(flow.velocities), flow.signs.copy()
        out.moved, out.touched = self._widened(flow.moved, LohnerSet.of_displacements), flow.touched
        return out

    def _give_up(self, flow: Flow) -> None:
        """Let the balls hold every state."""
        wide = self._wide(flow)
        flow.forces, flow.velocities, flow.moved = wide.forces, wide.velocities, wide.moved
        self.displacements = self._widened(self.displacements, LohnerSet.of_displacements)
        self.theta = self.known_theta()
        self.set, self.since, self._runs = None, self.stretch, None

    def _fast(self) -> list[int]:
        """Return the sliders whose velocity is not exactly zero."""
        flow = self.flow
        moving = [] if flow is None else np.flatnonzero(flow.signs).tolist()
        return [n for n in moving if flow is not None and not bool(flow.velocities[n] == 0)]

    def _renew(self) -> None:
        """Put the set together again around a middle without errors."""
        numbers = self.forces if self.flow is None else self.flow.forces
        noise = [x.rad() for x in numbers.tolist()]
        numbers[:] = [x.mid() for x in numbers.tolist()]
        speeds = {}
        for n in self._fast():
            assert self.flow is not None
            speeds[n] = self.flow.velocities[n].rad()
            self.flow.velocities[n] = self.flow.velocities[n].mid()
        theta = (self.l0 * self.theta).rad()
        self.theta = self.theta.mid()
        if self.set is None:
            self.set = LohnerSet(noise, speeds, theta)
        else:
            self.set.renew(noise, speeds, theta)
        if self.flow is None:
            self.tensions = self._tensions(self.forces)
        self.since = 0
        self._look_around()

    def _look_around(self) -> None:
        """Note how far states lie from the middle."""
        assert self.set is not None
        widest, share = self.set.width()
        (self.slack,) = self.set.balls([widest])
        self.far = math.ldexp(widest, max(self.set.exponent, -2000)) + TINY
        if share > MOST_ERROR:
            self.since = self.stretch

    def _tensions(self, forces: NDArray[Any]) -> NDArray[Any]:
        bare = [force - self.weight for force in forces.tolist()[:-1]]
        return self.arithmetic.vector(accumulate(bare))

    def _shape(self, flow: Flow) -> tuple[NDArray[Any], NDArray[Any]]:
        if self.exact is not None:
            return super()._shape(flow)
        # the middle is taken anew now and then, by its forces
        return self._tensions(flow.forces), self._displaced(flow)

    def state(self) -> State:
        middle = super().state()
        if self.set is None:
            return middle
        return replace(
            middle,
            tensions=self._widened(middle.tensions, LohnerSet.of_tensions),
            displacements=self._widened(middle.displacements, LohnerSet.of_displacements),
            theta=self.known_theta(),
        )

    def known_theta(self) -> Any:
        if self.set is None:
            return self.theta
        (radius,) = self.set.balls([self.set.of_theta()])
        return self.theta + flint.arb(0, (radius / self.l0).upper())

    def known_moves(self) -> NDArray[Any]:
        return self._widened(super().known_moves(), LohnerSet.of_displacements)

    def known_forces(self) -> NDArray[Any]:
        """Return the forces at rest, as well as they are known."""
        return self._widened(self.forces, LohnerSet.of_forces)

    def velocities(self) -> NDArray[Any]:
        return self._wide_velocities(super().velocities())

    # -- at rest -------------------------------------------------------------------------------

    def ramp(self, way: int, target: Any) -> bool:
        """Ramp theta, and the set along with its middle; see `Mechanics.ramp`."""
        self.crossing_ends = []
        moves = super().ramp(way, target)
        if self.set is not None and self.chain.n > 1:
            for rows in (self.set, *self.tangent):
                if self.crossing_ends:
                    rows.at_start(self.crossing_ends)
                elif not moves and target is not None:
                    rows.at_target()
            self._look_around()
        return moves

    def _set_off(self, starts: list[tuple[int, int]], *, crossing: bool) -> None:
        self.crossing_ends = [n for n, _ in starts] if crossing else []
        if self.keep:
            begin = self.state()
            forces = forces_of(self.arithmetic, begin.tensions, self.weight)
            still = self.arithmetic.zeros(self.chain.n)
            self.start, self.pieces = Motion(begin.displacements, still, forces), []
        super()._set_off(starts, crossing=crossing)

    # -- the rearrangement ---------------------------------------------------------------------

    def rearrangement(self) -> Iterator[Event | None]:
        for event in super().rearrangement():
            # whoever asks no more goes on, later, from what was put together
            if event is None and self.since >= self.stretch and not self.runaway:
                self._renew()
            yield event

    def first_event(self, flow: Flow) -> FirstEvent | None:
        """Return the first event, of the middle; see `Mechanics.first_event`."""
        slip = None if self.exact is not None else self._lone_slip(flow)
        if slip is not None:
            return slip
        # at the precision limit, where nothing is asked again, balls hold every state
        if self.exact is None and not self.assume and not self._may_run_away(flow):
            found = self._proved(flow)
            if found is not None and (self.set is None or self._is_steep(flow, found)):
                return found
        if self.set is not None:
            self._give_up(flow)
        return super().first_event(flow)

    def _lone_slip(self, flow: Flow) -> FirstEvent | None:
        """Return the slip of an end alone from its threshold: the same in all states.

        None if it is another motion, or the neighbour may start before it ends.
        """
        n, end = self.chain.n, 0 if flow.signs[0] else self.chain.n - 1
        alone = n > 1 and not self.mirrored and np.count_nonzero(flow.signs) == 1
        if not alone or [*self.crossed] != [end]:
            return None
        beside, way = abs(end - 1), int(flow.signs[end])
        length = 2 * self.arithmetic.number(self.crossed[end]) * self.cosine
        room = self.thresholds[beside] - way * flow.forces[beside]
        if not (length > 0 and room - length > self.slack):
            return None
        shifts = ((end, [way * length], [self.arithmetic.number(0)]),)
        return FirstEvent(self.arithmetic.pi(), (end,), (), shifts, alike=True)

    def _may_run_away(self, flow: Flow) -> bool:
        steep = int(flow.signs[0]) * self.chain.tan_alpha >= self.chain.mu_d
        return steep and bool(flow.signs.all())

    def _proved(self, flow: Flow) -> FirstEvent | None:
        """Return what float64 proves to come first, at its time in the middle; None: nothing."""
        n, moving = self.chain.n, np.flatnonzero(flow.signs).tolist()
        window = _window(moving, n)
        numbers, unsure = self._in_floats(flow, window)
        thresholds = np.array([float(x) for x in self.thresholds[window].tolist()])
        at, side, time, radius = verified_event(
            self.springs[window],
            flow.signs[window],
            np.array([bool(x == 0) for x in flow.velocities[window].tolist()]),
            numbers,
            thresholds,
            unsure + (self.far if self.set is not None else 0.0) + 2.0**-50 * thresholds.max(),
            min(n // 2 if self.mirrored else n, window.stop) - window.start,
        )
        if at < 0:
            return None
        velocities, accelerations, _ = numbers.tolist()
        pace = math.hypot(*velocities) + math.hypot(*accelerations)
        self.verified = Verified(window.start + at, side, time, radius, pace)
        try:
            if len(moving) == 1 and n > 1:
                return self._lone(flow, moving[0])
            return self._enclosed(flow)
        except Undecided:  # the middle is not known well enough
            return None

    def _in_floats(self, flow: Flow, window: slice) -> tuple[NDArray[np.float64], float]:
        """Return velocities, accelerations, forces, and by how much any of them may be off."""
        speeds, pulls = flow.velocities[window].tolist(), flow.forces[window].tolist()
        velocities, forces = [float(x) for x in speeds], [float(x) for x in pulls]
        friction = float(self.friction)
        pairs = zip(flow.signs[window].tolist(), forces, strict=True)
        accelerations = [f - s * friction if s else 0.0 for s, f in pairs]
        radius = max(float(x.rad()) for x in (*speeds, *pulls))
        size = max(map(abs, (*velocities, *forces))) + friction
        unsure = radius * (1 + 1e-9) + 2.0**-49 * size
        return np.array([velocities, accelerations, forces]), unsure

    def _lone(self, flow: Flow, n: int) -> FirstEvent:
        """Return the event of a slider that moves alone, by its energy."""
        crossed = self.crossed.get(n)
        excess = {} if crossed is None else {n: self.arithmetic.number(crossed) * self.cosine}
        found = lone_event(flow, n, self.thresholds, excess, sign=self.arithmetic.sign)
        slider, side, time, radius, _ = self.verified
        if [(m, 0) for m in found.stops] + list(found.starts) != [(slider, side)]:
            raise AssertionError("what is proved of all states is not true of one")
        if not abs(found.time - time) <= radius:
            raise AssertionError("the enclosure of an event does not hold a state of the set")
        return found

    def _enclosed(self, flow: Flow) -> FirstEvent | None:
        """Return the event, and where it finds the middle."""
        slider, side, time, radius, _ = self.verified
        self.evaluations += 1
        room = self.thresholds[slider] - side * flow.forces[slider]
        found = enclosed_event(self.runs, (slider, side), room, time, radius)
        if found is None:
            return None
        stops, starts = ([slider], []) if side == 0 else ([], [(slider, side)])
        event = event_of(found[0], stops, starts, self.chain.n if self.mirrored else None)
        return replace(event, shifts=tuple(found[1]))

    def _late(self, found: FirstEvent) -> tuple[float, float]:
        """Return the time of the middle's event, and how far from it is that of any state."""
        time = float(found.time)
        return time, self.verified.radius + abs(time - self.verified.time)

    def _is_steep(self, flow: Flow, found: FirstEvent) -> bool:
        """Return whether the event's slope is far from zero in all states, as `_set_follows` needs.

        It is not where an event nearly grazes: the float64 bracket of its time is too wide there.
        """
        slider, side, *_, pace = self.verified
        ways, speeds = [0.0] * (self.chain.n + 2), [0.0] * (self.chain.n + 2)
        for first, displacements, velocities in found.shifts or ():
            window = slice(first + 1, first + 1 + len(velocities))
            ways[window], speeds[window] = map(float, displacements), map(float, velocities)
        slope = speeds[slider] + speeds[slider + 2]
        if side == 0:
            bend = ways[slider] + ways[slider + 2] - self.springs[slider] * ways[slider + 1]
            friction = int(flow.signs[slider]) * float(self.friction)
            slope = float(flow.forces[slider]) + bend - friction
        time, late = self._late(found)
        late += 2.0**-50 * time
        vague = late * HURRY * pace * (1 + time) + len(speeds) * self.far * (3 + time)
        return bool(abs(slope) > 8 * vague)

    def advance(self, flow: Flow, found: FirstEvent) -> NDArray[Any]:
        """Let the middle move to its event, and the set along with it."""
        begin, moves = self.time, not bool(found.time == 0)
        wide = self._wide(flow) if self.keep and moves else None
        arrived = super().advance(flow, found)
        if moves and not found.alike:
            self.since = self.since + 1 if self.exact is None else 0
            if self.set is not None:
                self._set_follows(flow, found)
        if wide is not None and self.start is not None:
            self.pieces.append(wide.piece(begin, self.time, self.start, wide.runs()))
        return arrived

    def _set_follows(self, flow: Flow, found: FirstEvent) -> None:
        assert self.set is not None
        (slider, side, *_, pace), (time, late) = self.verified, self._late(found)
        n, moving = self.chain.n, np.flatnonzero(flow.signs).tolist()
        window = _window(moving, n)
        numbers = np.zeros((3, n))
        numbers[:, window], unsure = self._in_floats(flow, window)
        unsure += math.sqrt(len(moving)) * self.far * (3 + time)
        image = n - 1 - slider if self.mirrored else -1
        passage = Passage(
            self.springs, flow.signs, numbers[0], numbers[1], unsure,
            time, late * (1 + 1e-9) + 2.0**-50 * time, pace, slider, side, image,
        )  # fmt: skip
        spread, late = self.set.follow(passage)
        for rows in self.tangent:
            rows.follow(passage._replace(late=late), own=False)
        (further,) = self.set.balls([spread])
        self.time = self.time + flint.arb(0, further)
        self._look_around()

    # -- to go on later ------------------------------------------------------------------------

    def captured(self) -> dict[str, Any]:
        kept = None if self.set is None else self.set.captured()
        return super().captured() | {"set": kept, "since": self.since}

    def take_over(self, captured: Mapping[str, Any]) -> None:
        super().take_over(captured)
        self.set, self.since = None, int(captured["since"])
        if captured["set"] is not None:
            self.set = LohnerSet.restored(captured["set"])
            self._look_around()


def _window(moving: list[int], n: int) -> slice:
    """Return the part of the chain between the neighbours of the outermost moving sliders."""
    return slice(max(moving[0] - 1, 0), min(moving[-1] + 2, n))
