"""Follow a set of states through the events in balls, at the cost of a single state.

The middle of the set goes through the events as a point of full precision, with its rounding errors
in balls. Float64, with proved bounds, holds the distances of other states from the middle
(`motion.state_set`) and proves which event comes first in all of them (`motion.set_event`). Balls
only enclose that event in the middle. If float64 cannot decide (ties, grazes, a whole chain that
may run away), the set is treated as plain balls.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from itertools import accumulate
from typing import Any, ClassVar

import flint
import numpy as np
from numpy.typing import NDArray

from exactcreep.model.chain import surplus
from exactcreep.model.contacts import Event
from exactcreep.model.state import State
from exactcreep.motion.arithmetic import FLOAT64, Balls
from exactcreep.motion.cosine_field import Quadratic
from exactcreep.motion.first_event import FirstEvent
from exactcreep.motion.modes import Flow
from exactcreep.motion.set_event import enclosed_event, first_event_of_set, lone_event
from exactcreep.motion.state_set import UNDERFLOW, Crossing, StateSet
from exactcreep.solvers.field.at_rest import Rest
from exactcreep.solvers.field.integrator import ChainIntegrator, event_of
from exactcreep.solvers.interface import Start

RENEW_EVERY = 16
"""Events after which the set is made anew. Meanwhile the rounding errors of the middle and of the
derivative grow by about 3 bits per event."""
MOST_ERROR = 2.0**-10
"""Share of the derivative's errors in the set above which it is made anew earlier."""


class SetIntegrator(ChainIntegrator):
    """`ChainIntegrator` in balls for the middle of a set, with the set beside it; see the module.

    `tangent`: rows that move along: differences of states, with a derivative in each column;
    """

    renew_every: ClassVar[int] = RENEW_EVERY

    def __init__(self, start: Start, arithmetic: Balls, *, assume: bool = False) -> None:
        super().__init__(start, arithmetic, assume=assume)
        self.tangent: StateSet | None = None
        self._slack: Any = None
        self.widest = 0.0  # largest distance of forces, velocities, l0 theta from the middle's
        self.crossing: Crossing | None = None
        self.shown: State | None = None  # the present rest, until a slider moves
        self.shown_theta: Any = None
        self.drags = [float(x) for x in self.frictions.tolist()]  # frictions in float64
        self.holds = self._floats_held()
        self.springs = np.full(self.chain.n, 2)
        self.springs[[0, -1]] = 1
        self.ends: list[int] = []  # ends that have just reached their threshold

    def _floats_held(self) -> NDArray[np.float64]:
        """Return the thresholds in float64, whatever python-flint's precision is."""
        return self.contacts.thresholds(self.rest.coefficients, FLOAT64)

    # -- the set -------------------------------------------------------------------------------

    @property
    def slack(self) -> Any:
        """Largest distance of forces and l0 theta from the middle's, as a ball."""
        if self.rest.set is None:
            return 0
        if self._slack is None:
            (self._slack,) = self.rest.set.balls([self.widest])
        return self._slack

    @property
    def far(self) -> float:
        """The same as a float."""
        if self.rest.set is None:
            return 0.0
        return math.ldexp(self.widest, max(self.rest.set.exponent, -2000)) + UNDERFLOW

    def _sign(self, x: Any, slack: Any) -> tuple[int, bool]:
        # both sides move by at most two rooms, or a room and l0 theta
        if self.rest.set is not None:
            slack = 2 * self.slack * max(self.stretch, 1)
        return super()._sign(x, slack)

    def _widened(self, numbers: NDArray[Any], of: Callable[[StateSet], Any]) -> NDArray[Any]:
        """Return numbers of the middle as balls that hold every state, with radii from `of`."""
        states = self.rest.set
        if states is None:
            return numbers.copy()
        wide = states.widened(numbers, of(states))
        exact = [type(x) is not flint.arb for x in numbers.tolist()]  # the same in all states
        wide[exact] = numbers[exact]
        return wide

    def _wide_velocities(self, velocities: NDArray[Any]) -> NDArray[Any]:
        """Return velocities as balls that hold every state; a zero is zero in all states."""
        wide = self._widened(velocities, StateSet.of_speeds)
        still = [bool(x == 0) for x in velocities.tolist()]
        wide[still] = velocities[still]
        return wide

    def _give_up(self, flow: Flow) -> None:
        """Switch to balls that hold every state."""
        rest, displacements = self.rest, StateSet.of_displacements
        flow.forces = self._widened(flow.forces, StateSet.of_forces)
        flow.velocities = self._wide_velocities(flow.velocities)
        flow.moved = self._widened(flow.moved, displacements)
        rest.displacements = self._widened(rest.displacements, displacements)
        rest.theta = self.known_theta()
        rest.set, rest.since, self._runs = None, self.renew_every, None

    def _fast(self) -> dict[int, Any]:
        """Return the velocities of the sliders that are not exactly at rest."""
        if self.flow is None:
            return {}
        speeds = {n: self.flow.velocities[n] for n in self.flow.moving}
        return {n: speed for n, speed in speeds.items() if not bool(speed == 0)}

    def _renew(self) -> None:
        """Make the set anew around a middle without errors."""
        rest = self.rest
        numbers = (self.flow or rest).forces
        noise = [radius(x) for x in numbers.tolist()]
        numbers[:] = [middle(x) for x in numbers.tolist()]
        speeds = {}
        for n, speed in self._fast().items():
            speeds[n] = speed.rad()
            self.flow.velocities[n] = speed.mid()  # type: ignore[union-attr]
        theta = radius(self.l0 * rest.theta)
        rest.theta = middle(rest.theta)
        if rest.set is None:
            rest.set = StateSet(noise, speeds, theta)
        else:
            rest.set.renew(noise, speeds, theta)
        if self.flow is None:
            rest.tensions = self._tensions(rest.forces)
        rest.since = 0
        self._look_around()

    def _look_around(self) -> None:
        """Note the distances of states from the middle."""
        assert self.rest.set is not None
        self.widest, share = self.rest.set.width()
        self._slack = None
        if share > MOST_ERROR:
            self.rest.since = self.renew_every
        self.shown = self.shown_theta = None

    def _tensions(self, forces: NDArray[Any]) -> NDArray[Any]:
        return self.arithmetic.vector(accumulate((forces - self.loads).tolist()[:-1]))

    def _strained(self, flow: Flow) -> NDArray[Any]:
        # the middle of a set is renewed from time to time, by its forces
        return super()._strained(flow) if self.rest.set is None else self._tensions(flow.forces)

    # -- the present state ---------------------------------------------------------------------

    def state(self) -> State:
        if self.shown is not None and self.flow is None:
            return self.shown
        middle = super().state()
        if self.rest.set is None:
            return middle
        tensions = self._widened(middle.tensions, StateSet.of_tensions)
        displacements = self._widened(middle.displacements, StateSet.of_displacements)
        theta = self.dilation(self.known_theta())
        wide = State(tensions, displacements, middle.coefficients, middle.draws, theta)
        if self.flow is None:
            self.shown = wide
        return wide

    def known_theta(self) -> Any:
        rest = self.rest
        if rest.set is None:
            return self.arithmetic.number(rest.theta)
        if self.shown_theta is None:
            (radius,) = rest.set.balls([rest.set.of_theta()])
            self.shown_theta = rest.theta + flint.arb(0, (radius / self.l0).upper())
        return self.shown_theta

    def known_moves(self) -> NDArray[Any]:
        return self._widened(super().known_moves(), StateSet.of_displacements)

    def known_forces(self) -> NDArray[Any]:
        """Return the forces at rest, as precisely as they are known."""
        return self._widened(self.rest.forces, StateSet.of_forces)

    def velocities(self) -> NDArray[Any]:
        return self._wide_velocities(super().velocities())

    # -- at rest -------------------------------------------------------------------------------

    def ramp(self, way: int, target: Any) -> bool:
        """Ramp theta, and the set along with its middle; see `ChainIntegrator.ramp`."""
        self.ends, self.shown, self.shown_theta = [], None, None
        moves = super().ramp(way, target)
        if self.rest.set is not None and self.chain.n > 1:
            for rows in filter(None, (self.rest.set, self.tangent)):
                if self.ends:
                    rows.at_start(self.ends, self.near_rates)
                elif not moves and target is not None:
                    rows.at_target(self.near_rates)
            self._look_around()
        return moves

    def _set_off(self, starts: list[tuple[int, int]], *, ramped: bool) -> None:
        self.ends = [n for n, _ in starts] if ramped else []
        super()._set_off(starts, ramped=ramped)

    # -- the rearrangement ---------------------------------------------------------------------

    def rearrangement(self) -> Iterator[Event | None]:
        for event in super().rearrangement():
            # if the caller stops here, it continues later from the renewed set
            if event is None and self.rest.since >= self.renew_every and not self.runaway:
                self._renew()
            yield event

    def first_event(self, flow: Flow) -> FirstEvent | None:
        """Return the first event of the middle; see `ChainIntegrator.first_event`."""
        of_all = None
        if not self.exact:
            of_all = self._lone_slip(flow)
            # at the precision limit nothing is repeated, and balls hold every state
            if of_all is None and not (self.assume or self._may_run_away(flow)):
                of_all = self._proved(flow)
        if of_all is not None:
            return of_all
        if self.rest.set is not None:
            self._give_up(flow)
        return super().first_event(flow)

    def _lone_slip(self, flow: Flow) -> FirstEvent | None:
        """Return the slip of an end alone from its threshold, which is the same in all states.

        None for another motion, or if the neighbour may start before it ends.
        """
        n, moving = self.chain.n, flow.moving
        end, force = moving[0], flow.forces[moving[0]]
        if len(moving) > 1 or type(force) is not Quadratic or end not in (0, n - 1):
            return None
        if self.rest.symmetric or n == 1 or not bool(flow.velocities[end] == 0):
            return None
        beside, way = abs(end - 1), int(flow.signs[end])
        length = 2 * (way * force - self.frictions[end])
        room = self.thresholds[beside] - way * flow.forces[beside]
        if not (length > 0 and room - length > self.slack):
            return None
        shifts = ((end, [way * length], [self.arithmetic.number(0)]),)
        return FirstEvent(flint.arb.pi(), (end,), (), shifts, alike=True)

    @property
    def exact(self) -> bool:
        """Whether the chain is known exactly, except for what its slips have not reached yet."""
        flow = self.flow
        if flow is None:
            return self.rest.exact
        known = (type(x) is Quadratic for x in (self.rest.theta, *flow.forces.tolist()))
        return all(known) and all(bool(v == 0) for v in flow.velocities.tolist())

    def _may_run_away(self, flow: Flow) -> bool:
        whole = len(flow.moving) == self.chain.n
        return whole and surplus(self.chain, int(flow.signs[0])) >= 0

    def _proved(self, flow: Flow) -> FirstEvent | None:
        """Return the event that float64 proves to be first, at the middle's time; or None."""
        n, moving = self.chain.n, flow.moving
        window = slice(max(moving[0] - 1, 0), min(moving[-1] + 2, n))
        speeds = flow.velocities[window].tolist()
        pulls = list(map(self.arithmetic.number, flow.forces[window].tolist()))
        signs, frictions, held = flow.signs[window], self.drags[window], self.holds[window]
        fast, forces = [float(x) for x in speeds], [float(x) for x in pulls]
        loads = zip(forces, signs.tolist(), frictions, strict=True)
        bare = [force - sign * friction if sign else 0.0 for force, sign, friction in loads]
        radius = max([float(x.rad()) for x in (*speeds, *pulls)])
        largest = max(map(abs, (*fast, *bare, *forces))) + max(frictions)
        unsure = radius * (1 + 1e-9) + 2.0**-49 * largest
        at, side, time, radius = first_event_of_set(
            self.springs[window],
            signs,
            np.array([bool(x == 0) for x in speeds]),
            np.array([fast, bare, forces]),
            held,
            unsure + self.far + 2.0**-50 * max(held.tolist()),
            min(n // 2 if self.rest.symmetric else n, window.stop) - window.start,
        )
        if at < 0:
            return None
        slider = window.start + at
        acting = (slider, side)
        self.rest.evaluations += 1
        room = self.thresholds[slider] - side * flow.forces[slider]
        enclosed = None
        if len(moving) == 1 and n > 1:  # alone in its chain it has no spring
            enclosed = lone_event(flow, moving[0], acting, room)
        if enclosed is None or not abs(enclosed[0] - time) <= radius:
            enclosed = enclosed_event(self.runs, acting, room, time, radius)
        if enclosed is None:
            return None
        instant, shifts = enclosed
        stops, starts = ([slider], []) if side == 0 else ([], [acting])
        image_of = n if self.rest.symmetric else None
        event = event_of(instant, stops, starts, image_of, tuple(shifts))
        if self.rest.set is None:
            return event
        late = radius + abs(float(event.time) - time)
        unsure += math.sqrt(len(moving)) * self.far * (3 + float(event.time))
        self.crossing = self._crossing(flow, event, acting, late, bare, unsure, window)
        # not if an event nearly grazes, because the float64 bracket of its time is too wide
        return event if self.crossing.steep else None

    def _crossing(
        self,
        flow: Flow,
        event: FirstEvent,
        acting: tuple[int, int],
        late: float,
        bare: list[float],
        unsure: float,
        window: slice,
    ) -> Crossing:
        """Return the motion of the middle to its event, in floats; `bare`: initial pulls."""
        n, time, radii = self.chain.n, float(event.time), [0.0]
        ways, fast = [0.0] * (len(bare) + 2), [0.0] * len(bare)  # one more at either end
        number = self.arithmetic.number
        for first, shifts, speeds in event.shifts or ():
            k, shifts = first - window.start, list(map(number, shifts))
            ways[k + 1 : k + 1 + len(shifts)] = [float(x) for x in shifts]
            fast[k : k + len(speeds)] = [float(v) for v in speeds]
            radii += [float(x.rad()) for x in (*shifts, *speeds)]
        numbers = zip(bare, self.springs[window].tolist(), flow.signs[window].tolist(), strict=True)
        pulls = [
            pull - springs * ways[k] + ways[k - 1] + ways[k + 1] if sign else 0.0
            for k, (pull, springs, sign) in enumerate(numbers, 1)
        ]
        unsure += 4 * max(radii) + 2.0**-47 * max(map(abs, (*ways, *fast)))
        haste = max(*map(abs, pulls), 4 * max(map(abs, fast))) + 5 * unsure
        velocities, accelerations = np.zeros((2, n))
        velocities[window], accelerations[window] = fast, pulls
        late = late * (1 + 1e-9) + 2.0**-50 * time
        image = n - 1 - acting[0] if self.rest.symmetric else -1
        return Crossing(
            self.springs, flow.signs, velocities, accelerations, unsure, time, late, haste,
            *acting, image,
        )  # fmt: skip

    def move(self, flow: Flow, event: FirstEvent) -> None:
        """Let the middle move to its event, and the set along with it."""
        rest, moves = self.rest, not bool(event.time == 0)
        super().move(flow, event)
        if moves and not event.alike:
            rest.since = 0 if self.exact else rest.since + 1
            if rest.set is not None:
                assert self.crossing is not None
                spread, late = rest.set.follow(self.crossing)
                if self.tangent is not None:
                    self.tangent.follow(self.crossing._replace(late=late), own=False)
                (further,) = rest.set.balls([spread])
                self.time = self.time + flint.arb(0, further)
                self._look_around()

    def _draw(self, n: int) -> None:
        super()._draw(n)
        self.holds[n] = self.contacts.holds(n, float(self.rest.coefficients[n]), FLOAT64)

    def go_on_from(self, rest: Rest) -> None:
        super().go_on_from(rest)
        self.holds = self._floats_held()
        self.shown = self.shown_theta = None
        if self.rest.set is not None:
            self._look_around()


def radius(x: Any) -> Any:
    return x.rad() if type(x) is flint.arb else flint.arb(0)


def middle(x: Any) -> Any:
    return x.mid() if type(x) is flint.arb else x
