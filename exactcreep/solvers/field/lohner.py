"""Mechanics in balls at the price of one point: a Lohner set carried through the events.

The middle of a set of states goes through the events as a point of full precision, its rounding in
balls. Float64, with proved bounds, holds how far other states of the set lie from the middle
(`motion.lohner_set`) and proves which event comes first in all of them (`motion.verified_event`);
balls only enclose that event in the middle. What float64 does not tell apart (ties, grazes, a whole
chain that may run away) is asked of the set as plain balls.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import accumulate
from typing import Any, ClassVar

import flint
import numpy as np
from numpy.typing import NDArray

from exactcreep.model.chain import Chain
from exactcreep.model.contacts import Event
from exactcreep.model.state import State
from exactcreep.motion.arithmetic import Arithmetic, Undecided
from exactcreep.motion.event_enclosure import placed
from exactcreep.motion.first_event import FirstEvent, lone_event
from exactcreep.motion.lohner_set import LohnerSet, Passage
from exactcreep.motion.modes import Flow, ModalPiece, forces_of
from exactcreep.motion.solution import Motion
from exactcreep.motion.verified_event import HURRY, first_event, spans
from exactcreep.solvers.field.event_loop import Mechanics, event_of

STRETCH = 16
"""Events after which the set is put together again; the middle's rounding grows by about 3 bits
per event meanwhile, and so do the errors of the derivative."""

MOST_ERROR = 2.0**-10
"""Share of the errors of the derivative in the set at which it is put together earlier."""
TINY = 2.0**-900


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
        self,
        chain: Chain,
        seed: int,
        arithmetic: Arithmetic,
        state: State,
        *,
        assume: bool = False,
        keep: bool = False,
    ) -> None:
        super().__init__(chain, seed, arithmetic, state, assume=assume)
        self.keep = keep
        self.start: Motion | None = None
        self.pieces: list[ModalPiece] = []
        self.set: LohnerSet | None = None
        self.tangent: list[LohnerSet] = []
        self.slack: Any = 0  # how far forces and l0 theta lie from the middle's
        self.far = 0.0  # so do velocities
        self.since = 0  # events since the set was put together
        self.bracket = (0.0, 0.0)  # time of the next event in all states, and its largest error
        self.foreseen: tuple[tuple[int, int], float] = ((0, 0), 0.0)  # who acts, and how fast
        self.springs = np.full(chain.n, 2)
        self.springs[[0, -1]] = 1
        self.crossing_ends: list[int] = []

    # -- the set -------------------------------------------------------------------------------

    def _sign(self, x: Any, slack: Any = None) -> int:
        # what is compared moves by at most two forces, or a force and l0 theta
        return super()._sign(x, 2 * self.slack if self.set is not None else slack)

    def _widen(self, numbers: NDArray[Any], radii: Any) -> NDArray[Any]:
        assert self.set is not None
        pairs = zip(numbers.tolist(), self.set.balls(radii), strict=True)
        return self.arithmetic.vector([x + flint.arb(0, r) for x, r in pairs])

    def _wide_velocities(self, velocities: NDArray[Any]) -> NDArray[Any]:
        """Return velocities in balls that hold every state; one that is zero is so in all."""
        assert self.set is not None
        wide = self._widen(velocities, self.set.of_speeds())
        still = [bool(x == 0) for x in velocities.tolist()]
        wide[still] = velocities[still]
        return wide

    def _wide(self, flow: Flow) -> Flow:
        """Return the flow in balls that hold every state."""
        out = Flow(self.arithmetic, flow.forces, self.friction)
        out.velocities, out.signs = flow.velocities.copy(), flow.signs.copy()
        out.moved, out.touched = flow.moved.copy(), flow.touched
        if self.set is not None:
            out.forces = self._widen(flow.forces, self.set.of_forces())
            out.velocities = self._wide_velocities(flow.velocities)
            out.moved = self._widen(flow.moved, self.set.of_displacements())
        return out

    def _give_up(self, flow: Flow) -> None:
        """Let the balls hold every state."""
        assert self.set is not None
        wide = self._wide(flow)
        flow.forces, flow.velocities, flow.moved = wide.forces, wide.velocities, wide.moved
        self.displacements = self._widen(self.displacements, self.set.of_displacements())
        self.theta = self.known_theta()
        self.set, self.since, self._runs = None, self.stretch, None

    def _renew(self) -> None:
        """Put the set together again around a middle without errors."""
        flow = self.flow
        numbers = self.forces if flow is None else flow.forces
        fast = [] if flow is None else np.flatnonzero(flow.signs).tolist()
        fast = [n for n in fast if flow is not None and not bool(flow.velocities[n] == 0)]
        noise = [x.rad() for x in numbers.tolist()]
        numbers[:] = [x.mid() for x in numbers.tolist()]
        speeds = {}
        for n in fast:
            assert flow is not None
            speeds[n] = flow.velocities[n].rad()
            flow.velocities[n] = flow.velocities[n].mid()
        theta = (self.l0 * self.theta).rad()
        self.theta = self.theta.mid()
        if self.set is None:
            self.set = LohnerSet(noise, speeds, theta)
        else:
            self.set.renew(noise, speeds, theta)
        if flow is None:
            self.tensions = self._tensions(self.forces)
        self.since = 0
        self._look_around()

    def _look_around(self) -> None:
        """Note how far states lie from the middle."""
        beside = self.set
        assert beside is not None
        theta = beside.theta, beside.theta_error
        widest, share = spans(beside.forces, beside.speeds, beside.errors, *theta)
        if not math.isfinite(widest):
            raise Undecided("the derivative of a rearrangement is not enclosed")
        (self.slack,) = beside.balls([widest])
        self.far = math.ldexp(widest, max(beside.exponent, -2000)) + TINY
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
        """Return the present states."""
        middle = super().state()
        if self.set is None:
            return middle
        return State(
            self._widen(middle.tensions, self.set.of_tensions()),
            self._widen(middle.displacements, self.set.of_displacements()),
            middle.coefficients,
            middle.draws,
            self.known_theta(),
        )

    def known_theta(self) -> Any:
        """Return theta, as well as it is known."""
        if self.set is None:
            return self.theta
        (radius,) = self.set.balls([self.set.of_theta()])
        return self.theta + flint.arb(0, (radius / self.l0).upper())

    def known_moves(self) -> NDArray[Any]:
        """Return how far sliders have come in the rearrangement, as well as it is known."""
        moves = super().known_moves()
        return moves if self.set is None else self._widen(moves, self.set.of_displacements())

    def known_forces(self) -> NDArray[Any]:
        """Return the forces at rest, as well as they are known."""
        return self.forces if self.set is None else self._widen(self.forces, self.set.of_forces())

    def velocities(self) -> NDArray[Any]:
        """Return the present velocities."""
        middle = super().velocities()
        return middle if self.set is None else self._wide_velocities(middle)

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
        """Yield the events; see `Mechanics.rearrangement`."""
        for event in super().rearrangement():
            # whoever asks no more goes on, later, from what was put together
            if event is None and self.since >= self.stretch and not self.runaway:
                self._renew()
            yield event

    def first_event(self, flow: Flow) -> FirstEvent | None:
        """Return the first event, of the middle; see `Mechanics.first_event`."""
        # at the precision limit, where nothing is asked again, balls hold every state
        if self.exact is None and not self.assume and not self._may_run_away(flow):
            found = self._proved(flow)
            if found is not None and (self.set is None or self._is_steep(flow, found)):
                return found
        if self.set is not None:
            self._give_up(flow)
        return super().first_event(flow)

    def _may_run_away(self, flow: Flow) -> bool:
        steep = int(flow.signs[0]) * self.chain.tan_alpha >= self.chain.mu_d
        return steep and bool(flow.signs.all())

    def _proved(self, flow: Flow) -> FirstEvent | None:
        """Return what float64 proves to come first, at its time in the middle; None: nothing."""
        n = self.chain.n
        moving = np.flatnonzero(flow.signs).tolist()
        low, high = max(moving[0] - 1, 0), min(moving[-1] + 2, n)
        window = slice(low, high)
        velocities, accelerations, forces, unsure = self._in_floats(flow, low, high)
        thresholds = np.array([float(x) for x in self.thresholds[window].tolist()])
        far = self.far if self.set is not None else 0.0
        at, side, time, radius = first_event(
            self.springs[window],
            flow.signs[window],
            np.array([bool(x == 0) for x in flow.velocities[window].tolist()]),
            velocities,
            accelerations,
            forces,
            thresholds,
            unsure + far + 2.0**-50 * thresholds.max(),
            min(n // 2 if self.mirrored else n, high) - low,
        )
        if at < 0:
            return None
        acting = (low + at, side)
        self.bracket = time, radius
        pace = math.hypot(*velocities.tolist()) + math.hypot(*accelerations.tolist())
        self.foreseen = acting, pace
        try:
            if len(moving) == 1 and n > 1:
                return self._placed_alone(flow, moving[0], acting)
            return self._placed(flow, acting)
        except Undecided:  # the middle is not known well enough
            return None

    def _is_steep(self, flow: Flow, found: FirstEvent) -> bool:
        """Return whether the event's slope is far from zero in all states, as `_set_follows` needs.

        It is not where an event nearly grazes: the float64 bracket of its time is too wide there.
        """
        (slider, side), pace = self.foreseen
        ways, speeds = [0.0] * (self.chain.n + 2), [0.0] * (self.chain.n + 2)
        shifts = found.shifts or [(run.first, *run.motion.moved(found.time)) for run in self.runs]
        for first, displacements, velocities in shifts:
            for k, (x, v) in enumerate(zip(displacements, velocities, strict=True), first + 1):
                ways[k], speeds[k] = float(x), float(v)
        slope = speeds[slider] + speeds[slider + 2]
        if side == 0:
            bend = ways[slider] + ways[slider + 2] - self.springs[slider] * ways[slider + 1]
            friction = int(flow.signs[slider]) * float(self.friction)
            slope = float(flow.forces[slider]) + bend - friction
        middle, radius = self.bracket
        time = float(found.time)
        late = radius + abs(time - middle) + 2.0**-50 * time
        vague = late * HURRY * pace * (1 + time) + len(speeds) * self.far * (3 + time)
        return bool(abs(slope) > 8 * vague)

    def _in_floats(self, flow: Flow, low: int, high: int) -> tuple[Any, Any, Any, float]:
        """Return velocities, accelerations, forces, and by how much any of them may be off."""
        window = slice(low, high)
        speeds, pulls = flow.velocities[window].tolist(), flow.forces[window].tolist()
        velocities, forces = [float(x) for x in speeds], [float(x) for x in pulls]
        friction = float(self.friction)
        signs = flow.signs[window].tolist()
        accelerations = [f - s * friction if s else 0.0 for s, f in zip(signs, forces, strict=True)]
        radius = max(float(x.rad()) for x in (*speeds, *pulls))
        size = max(map(abs, (*velocities, *forces))) + friction
        unsure = radius * (1 + 1e-9) + 2.0**-49 * size
        return np.array(velocities), np.array(accelerations), np.array(forces), unsure

    def _placed_alone(self, flow: Flow, n: int, acting: tuple[int, int]) -> FirstEvent | None:
        """Return the event of a slider that moves alone, by its energy."""
        crossed = self.crossed.get(n)
        excess = {} if crossed is None else {n: self.arithmetic.number(crossed) * self.cosine}
        found, _ = lone_event(flow, n, self.thresholds, excess)
        if [(m, 0) for m in found.stops] + list(found.starts) != [acting]:
            raise AssertionError("what is proved of all states is not true of one")
        time, radius = self.bracket
        if not abs(found.time - time) <= radius:
            raise AssertionError("the enclosure of an event does not hold a state of the set")
        return found

    def _placed(self, flow: Flow, acting: tuple[int, int]) -> FirstEvent | None:
        """Return the event, and where it finds the middle."""
        slider, side = acting
        self.evaluations += 1
        room = self.thresholds[slider] - side * flow.forces[slider]
        found = placed(self.runs, acting, room, *self.bracket)
        if found is None:
            return None
        time, shifts = found
        stops, starts = ((slider,), ()) if side == 0 else ((), ((slider, side),))
        event = event_of(time, list(stops), list(starts), self.chain.n if self.mirrored else None)
        return replace(event, shifts=tuple(shifts))

    def advance(self, flow: Flow, found: FirstEvent) -> NDArray[Any]:
        """Let the middle move to its event, and the set along with it."""
        begin, signs = self.time, flow.signs.copy()
        wide = self._wide(flow) if self.keep and not bool(found.time == 0) else None
        arrived = super().advance(flow, found)
        if not bool(found.time == 0):
            self.since = self.since + 1 if self.exact is None else 0
            if self.set is not None:
                self._set_follows(flow, signs, found)
        if wide is not None and self.start is not None:
            self.pieces.append(wide.piece(begin, self.time, self.start, wide.runs()))
        return arrived

    def _set_follows(self, flow: Flow, signs: NDArray[Any], found: FirstEvent) -> None:
        n, (middle, radius), ((slider, side), pace) = self.chain.n, self.bracket, self.foreseen
        assert self.set is not None
        moving = np.flatnonzero(signs)
        low, high = max(int(moving[0]) - 1, 0), min(int(moving[-1]) + 2, n)
        velocities, accelerations = np.zeros((2, n))
        numbers = self._in_floats(flow, low, high)
        velocities[low:high], accelerations[low:high], _, unsure = numbers
        time = float(found.time)
        late = (radius + abs(time - middle)) * (1 + 1e-9) + 2.0**-50 * time
        unsure += math.sqrt(len(moving)) * self.far * (3 + time)
        image = n - 1 - slider if self.mirrored else -1
        passage = Passage(
            signs, velocities, accelerations, time, late, unsure, pace, slider, side, image
        )
        spread, late = self.set.follow(self.springs, passage)
        for rows in self.tangent:
            rows.follow(self.springs, passage._replace(late=late), own=False)
        (further,) = self.set.balls([spread])
        self.time = self.time + flint.arb(0, further)
        self._look_around()

    # -- to go on later ------------------------------------------------------------------------

    def captured(self) -> dict[str, Any]:
        """Return everything needed to go on bit for bit, as plain data."""
        kept = None if self.set is None else self.set.captured()
        return super().captured() | {"set": kept, "since": self.since}

    def take_over(self, captured: Mapping[str, Any]) -> None:
        """Take over what `captured` returned, for the same chain and seed."""
        super().take_over(captured)
        self.set, self.since = None, int(captured["since"])
        if captured["set"] is not None:
            self.set = LohnerSet.restored(captured["set"])
            self._look_around()
