"""A chain taken from rest to rest, written once over an arithmetic: float64, mpmath or balls.

*Decompose* the moving sliders into runs. Find the *first event* among their stops and the starts of
their neighbours. *Advance* to it by the closed form. *Resolve* it by the contact law. *Repeat*
until every slider is at rest.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exactcreep.limits import NO_LIMITS
from exactcreep.model.chain import Chain
from exactcreep.model.contacts import Contacts, Event, EventKind, start_direction
from exactcreep.model.numbers import InputError, exact_number
from exactcreep.model.state import State
from exactcreep.motion.arithmetic import (
    Arithmetic,
    Undecided,
)
from exactcreep.motion.cosine_field import MOST_BITS, CosineField, Quadratic
from exactcreep.motion.first_event import (
    FirstEvent,
    Search,
    SearchLimit,
    lone_event,
    root_time,
)
from exactcreep.motion.modes import Flow, Run, forces_of, incline, tensions_at
from exactcreep.motion.runaway import NEVER_RESTS, NEVER_STOPS, never_rests
from exactcreep.solvers.solver import (
    Tally,
)

LOOK = 2500
"""Events of an avalanche after which, and after each further so many, it is asked whether it can
end at all; in each of the next `LOOKS` events until it can be told."""
LOOKS = 8
LONG = 100
"""A sharper look is worth it if a whole chain in motion will be known to run away only so late."""


@dataclass
class ExactState:
    """The state at rest in Q(c), as long as it lies there."""

    forces: list[Quadratic]
    displacements: list[Quadratic]
    theta: Quadratic

    @property
    def bits(self) -> int:
        """Size of the largest number, by its last displacements and theta."""
        return max(self.theta.bits, *(x.bits for x in self.displacements))

    def captured(self) -> dict[str, Any]:
        """Return the numbers as pairs of rationals."""
        return {
            "forces": [x.rationals() for x in self.forces],
            "displacements": [x.rationals() for x in self.displacements],
            "theta": self.theta.rationals(),
        }

    @classmethod
    def restored(cls, field: CosineField, captured: Mapping[str, Any]) -> ExactState:
        """Return what `captured` described."""
        return cls(
            [field.number(*x) for x in captured["forces"]],
            [field.number(*x) for x in captured["displacements"]],
            field.number(*captured["theta"]),
        )


class Mechanics:
    """A chain that is taken from rest to rest in one arithmetic.

    Parameters
    ----------
    chain : Chain
    seed : int
    arithmetic : Arithmetic
    state : State
    assume : bool
        Whether balls settle what they cannot decide by the model's rules, and count it.
    residuals : bool
        Whether the residual of every event is evaluated, also where a formula gives its time.

    Notes
    -----
    All calls are made inside ``arithmetic.active()``.
    """

    def __init__(
        self,
        chain: Chain,
        seed: int,
        arithmetic: Arithmetic,
        state: State,
        *,
        assume: bool = False,
        residuals: bool = False,
    ) -> None:
        self.chain = chain
        self.seed = seed
        self.arithmetic = arithmetic
        self.assume = assume or not arithmetic.encloses
        self.residuals = residuals and not arithmetic.encloses  # a ball of zero proves it
        self.tally = Tally()
        self.evaluations = 0
        self.slips = np.zeros(chain.n, dtype=np.int64)
        self.contacts = Contacts(chain, seed)
        self.cosine, self.weight = incline(arithmetic, chain)
        self.friction = arithmetic.times_cosine(chain, chain.mu_d)
        self.l0 = arithmetic.number(chain.l0)
        self.field = CosineField(chain.tan_alpha)
        self.tensions = tensions_at(arithmetic, state)
        self.displacements = arithmetic.vector(state.displacements.tolist())
        self.coefficients = state.coefficients.astype(np.float64)
        self.draws = state.draws.astype(np.int64)
        self.theta = arithmetic.number(state.theta)
        self.forces = forces_of(arithmetic, self.tensions, self.weight)
        self.thresholds = self.contacts.thresholds(self.coefficients, arithmetic)
        largest = max(abs(self.forces)) + max(self.thresholds)
        self.force_slack = 4 * arithmetic.roundoff * largest
        self.theta_slack: Any = 0  # of l0 theta
        # exact knowledge, as long as there is any
        self.exact = self._exactly(state) if arithmetic.encloses else None
        self.pinned: dict[int, Fraction] = {}  # F_n / c where a threshold was just reached
        self.mirrored = self._is_mirrored(state)
        # the rearrangement under way
        self.fresh = True
        self.way = 0
        self.flow: Flow | None = None
        self._runs: list[Run] | None = None
        self.time: Any = arithmetic.number(0)
        self.crossed: dict[int, Fraction] = {}  # sliders that have just crossed their threshold
        self.announced = True
        self.event_number = 0
        self.runaway = False
        self.proof = ""  # of the runaway
        self.limits = NO_LIMITS

    # -- what is known exactly -----------------------------------------------------------------

    def acting(self, n: int) -> Fraction:
        """Return the static coefficient that acts at slider `n` (from 0), exactly."""
        return self.contacts.acting(self.coefficients[n])

    def threshold(self, n: int) -> Any:
        """Return ``mu_s cos(alpha)`` as it acts at slider `n` (from 0)."""
        return self.contacts.holds(self.coefficients[n], self.arithmetic)

    def _exactly(self, state: State) -> ExactState | None:
        try:
            tensions = [exact_number(x, "tension") for x in state.tensions.tolist()]
            displacements = [exact_number(x, "x") for x in state.displacements.tolist()]
            theta = exact_number(state.theta, "theta")
        except InputError:  # balls or mpmath numbers that came out of another calculation
            return None
        field, weight = self.field, self.field.times_cosine(self.chain.tan_alpha)
        bare = [Fraction(0), *tensions, Fraction(0)]
        forces = [field.rational(after - before) + weight for before, after in pairwise(bare)]
        return ExactState(forces, [field.rational(x) for x in displacements], field.rational(theta))

    def _is_mirrored(self, state: State) -> bool:
        """Whether the chain is, and therefore stays, the mirror image of itself."""
        if self.chain.tan_alpha != 0 or self.chain.sigma_mu != 0 or self.chain.n < 2:
            return False
        tensions = state.tensions.tolist()
        return all(bool(a == b) for a, b in zip(tensions, reversed(tensions), strict=True))

    def _sign(self, x: Any, slack: Any = None) -> int:
        """Return a sign; what cannot be decided is zero and counted, if that is allowed."""
        allowance = self.force_slack if slack is None else slack
        try:
            sign = self.arithmetic.sign(x, allowance)
        except Undecided:
            if not self.assume:
                raise
            sign = 0
        # a zero that was rounded may be none
        self.tally.undecided += sign == 0 and (bool(allowance > 0) or not bool(x == 0))
        return sign

    # -- from rest to the first start ----------------------------------------------------------

    def ramp(self, way: int, target: Fraction | None) -> bool:
        """Ramp theta in direction `way` until a slider starts, or to `target`; say if one does.

        A start that is not at rest is set in motion at its own theta.
        """
        if self.fresh:
            self.fresh = False
            starts = self._unstable()
            if starts:
                self._set_off(starts, crossing=False)
                return True
        if way == 0:
            return False
        room, ends = self._room(way)
        if room is None or (target is not None and not self._comes_first(way, room, target)):
            if target is not None:
                self._move_theta(way, self._reach(way, target), target)
            return False
        self._move_theta(way, room, None)
        for end, sign in ends:
            self.forces[end] = sign * self.thresholds[end]
            self.pinned[end] = sign * self.acting(end)
            if self.exact is not None:
                self.exact.forces[end] = self.field.times_cosine(self.pinned[end])
        self._set_off(ends, crossing=True)
        return True

    def _unstable(self) -> list[tuple[int, int]]:
        starts = []
        for n in range(self.chain.n):
            sign = self._start_direction(n)
            if sign:
                starts.append((n, sign))
        return starts

    def _start_direction(self, n: int) -> int:
        """Return the direction in which a resting slider (from 0) starts, 0 if it stays."""
        if self.exact is not None:
            threshold = self.field.times_cosine(self.acting(n))
            return start_direction(self.exact.forces[n], threshold, Quadratic.sign)
        if n in self.pinned:
            return start_direction(self.pinned[n], self.acting(n), _sign_of_rational)
        if self.flow is None:
            return start_direction(self.forces[n], self.thresholds[n], self._sign)
        slack = self.flow.force_slack
        return start_direction(
            self.flow.forces[n], self.thresholds[n], lambda x: self._sign(x, slack)
        )

    def _room(self, way: int) -> tuple[Any, list[tuple[int, int]]]:
        """Return how far ``l0 theta`` can go before an end starts, and which end starts then."""
        n = self.chain.n
        if n == 1:
            return None, []
        ends = [(0, -way), (n - 1, way)]
        rooms: list[Any] = []
        for end, sign in ends:
            if self.exact is not None:
                threshold = self.field.times_cosine(self.acting(end))
                rooms.append(threshold - sign * self.exact.forces[end])
            elif end in self.pinned:
                left = self.acting(end) - sign * self.pinned[end]
                rooms.append(self.arithmetic.number(left) * self.cosine)
            else:
                rooms.append(self.thresholds[end] - sign * self.forces[end])
        if self.mirrored:
            return rooms[0], ends
        difference = rooms[0] - rooms[1]
        order = (
            difference.sign()
            if isinstance(difference, Quadratic)
            else self._sign(difference, 2 * self.force_slack)
        )
        return rooms[0 if order <= 0 else 1], ends if order == 0 else ends[:1] if order < 0 else (
            ends[1:]
        )

    def _reach(self, way: int, target: Fraction) -> Any:
        """Return how far ``l0 theta`` goes to `target`."""
        if self.exact is not None:
            span = self.field.rational(target) - self.exact.theta
            return way * self.chain.l0 * span
        return way * self.l0 * (self.arithmetic.number(target) - self.theta)

    def _comes_first(self, way: int, room: Any, target: Fraction) -> bool:
        """Whether a slider starts before `target`; exactly at threshold there, it stays."""
        left = self._reach(way, target) - room
        if isinstance(left, Quadratic):
            return left.sign() > 0
        slack = self.force_slack + self.theta_slack + self._theta_rounding(room)
        return self._sign(left, slack) > 0

    def _theta_rounding(self, room: Any) -> Any:
        if not self.arithmetic.roundoff:
            return 0
        return 8 * self.arithmetic.roundoff * (abs(self.l0 * self.theta) + abs(room))

    def _move_theta(self, way: int, room: Any, target: Fraction | None) -> None:
        """Let ``l0 theta`` go by `room` in direction `way`, to `target` if that is given."""
        if self.exact is not None and isinstance(room, Quadratic):
            exact, by = self.exact, way * room
            exact.theta = exact.theta + by / self.chain.l0
            if self.chain.n > 1:
                exact.forces[0] = exact.forces[0] - by
                exact.forces[-1] = exact.forces[-1] + by
            room = room.ball()
        by = way * room
        self.theta_slack = (
            0 if target is not None else self.theta_slack + self._theta_rounding(room)
        )
        self.theta = (
            self.arithmetic.number(target) if target is not None else self.theta + by / self.l0
        )
        if self.chain.n > 1 and not bool(room == 0):
            self.tensions = self.tensions - by
            self.forces[0] = self.forces[0] - by
            self.forces[-1] = self.forces[-1] + by
            self.pinned.clear()
        if self.exact is not None and self.chain.n > 1:
            for end in (0, -1):
                self.forces[end] = self.exact.forces[end].ball()

    def _set_off(self, starts: list[tuple[int, int]], *, crossing: bool) -> None:
        """Begin a rearrangement."""
        self.time = self.arithmetic.number(0)
        self.flow = Flow(self.arithmetic, self.forces, self.friction, self.force_slack)
        self.announced = False
        self.event_number = 0
        self.tally.rearrangements += 1
        self._start(starts, crossing=crossing)

    # -- the rearrangement ---------------------------------------------------------------------

    def rearrangement(self) -> Iterator[Event | None]:
        """Yield the events of the rearrangement under way, one by one, until rest or runaway.

        After the events of each instant comes None: only there may a caller stop asking and later
        begin anew, for in between an event is only half resolved.

        Decompose the moving sliders into runs. Find the first event among their stops and the
        starts of their neighbours. Advance to it by the closed form. Resolve it by the contact
        law. Repeat until every slider is at rest.
        """
        if self.flow is not None and not self.announced:
            self.announced = True
            yield self._event(EventKind.START, *self._departing())
            yield None
        while self.flow is not None and not self.runaway:
            self._runs = None
            found = self.first_event(self.flow)
            if found is None:
                self.runaway, self.proof = True, NEVER_STOPS
                return
            speeds = self.advance(self.flow, found)
            yield from self.resolve(self.flow, found, speeds)
            if not self.flow.signs.any():
                self.rest(self.flow)
            elif self.event_number >= LOOK and self.event_number % LOOK < LOOKS:
                self.look_for_an_end()
            yield None

    def look_for_an_end(self) -> None:
        """Tell an avalanche that is proved never to end to have run away."""
        flow = self.flow
        if flow is None or not flow.signs.any():
            return
        largest = max(self.acting(n) for n in range(self.chain.n))
        slack = flow.velocity_slack + self.chain.n * flow.force_slack
        tensions, velocities = self.state().tensions, self.velocities()
        if never_rests(
            self.arithmetic, self.chain, tensions, velocities, flow.signs, largest, slack
        ):
            self.runaway, self.proof = True, NEVER_RESTS

    def _departing(self) -> tuple[list[int], list[int], Any]:
        flow = self.flow
        assert flow is not None
        sliders = np.flatnonzero(flow.signs).tolist()
        return sliders, [int(flow.signs[n]) for n in sliders], self.arithmetic.number(0)

    def _event(self, kind: EventKind, sliders: list[int], signs: list[int], residual: Any) -> Event:
        self.tally.events += 1
        self.event_number += 1
        numbers = tuple(n + 1 for n in sliders)
        return Event(self.time, kind, numbers, tuple(signs), residual)

    @property
    def runs(self) -> list[Run]:
        """The runs of the chain in motion, from the last event on; a lone slip asks for none."""
        if self._runs is None:
            assert self.flow is not None
            self._runs = self.flow.runs()
        return self._runs

    def first_event(self, flow: Flow) -> FirstEvent | None:
        """Return the first event from here on; None if the chain has run away."""
        moving = np.flatnonzero(flow.signs).tolist()
        found = self._exact_slips(moving) if self.exact is not None else None
        if found is not None:
            return found
        excess = {
            n: self.arithmetic.number(value) * self.cosine for n, value in self.crossed.items()
        }
        touching = self._touching(flow)
        horizon = None
        if flow.signs.all():
            horizon = self._escape(flow, self.runs[0])
            if horizon is not None and bool(horizon == 0):
                return None
        elif len(moving) == 1:
            found, undecided = lone_event(
                flow, moving[0], self.thresholds, excess, touching, assume=self.assume
            )
            self.tally.undecided += undecided
            return found
        return self._search(flow, excess, touching, horizon)

    def _touching(self, flow: Flow) -> set[tuple[int, int]]:
        """Return the resting sliders that are known to be exactly at threshold, and the side."""
        if self.exact is None:
            return set()
        out = set()
        moving = np.flatnonzero(flow.signs).tolist()
        for n in {m for k in moving for m in (k - 1, k + 1) if 0 <= m < self.chain.n}:
            if flow.signs[n] == 0:
                threshold = self.field.times_cosine(self.acting(n))
                for side in (1, -1):
                    if (threshold - side * self.exact.forces[n]).sign() == 0:
                        out.add((n, side))
        return out

    def _exact_slips(self, moving: list[int]) -> FirstEvent | None:
        """Return the common stop of sliders that each move alone, if Q(c) decides it.

        They start from rest together, have equally many neighbours, all at rest, and none of these
        reaches beyond its threshold: forces change monotonically, so the stop is the worst case.
        The two in the middle of a mirrored chain move alone together: their spring's middle rests.
        """
        exact, n_sliders = self.exact, self.chain.n
        assert exact is not None
        assert self.flow is not None
        signs = self.flow.signs
        friction = self.field.times_cosine(self.chain.mu_d)
        pulls = {n: int(signs[n]) * exact.forces[n] - friction for n in moving}
        beside = {n: [m for m in (n - 1, n + 1) if 0 <= m < n_sliders] for n in moving}
        stiffnesses = {n: len(neighbours) for n, neighbours in beside.items()}
        middle = (n_sliders // 2 - 1, n_sliders // 2)
        if self.mirrored and n_sliders % 2 == 0 and middle[0] in beside:
            for n, other in (middle, middle[::-1]):
                beside[n].remove(other)
                stiffnesses[n] += 1
        if any(signs[m] for n in moving for m in beside[n]) or n_sliders == 1:
            return None
        zero = self.arithmetic.number(0)
        idle = [n for n in moving if pulls[n].sign() <= 0]
        if idle:  # nothing drives them: a slip of length zero
            return FirstEvent(zero, tuple(idle), (), ())
        w2 = stiffnesses[moving[0]]
        if any(stiffnesses[n] != w2 for n in moving):
            return None
        ways = {n: Fraction(2 * int(signs[n]), w2) * pulls[n] for n in moving}
        changes: dict[int, Quadratic] = {}
        for n in moving:
            for m in beside[n]:
                changes[m] = changes[m] + ways[n] if m in changes else ways[n]
        for m, change in changes.items():
            threshold = self.field.times_cosine(self.acting(m))
            if start_direction(exact.forces[m] + change, threshold, Quadratic.sign):
                return None
        for n in moving:
            exact.displacements[n] = exact.displacements[n] + ways[n]
            exact.forces[n] = exact.forces[n] - w2 * ways[n]
        for m, change in changes.items():
            exact.forces[m] = exact.forces[m] + change
        time = self.arithmetic.pi() / self.arithmetic.sqrt(self.arithmetic.number(w2))
        shifts = tuple((n, [ways[n].ball()], [zero]) for n in moving)
        return FirstEvent(time, tuple(moving), (), shifts, exact=True)

    def _escape(self, flow: Flow, run: Run) -> Any:
        """Return the time from which no slider of the whole moving chain can ever stop, or None.

        With mean velocity vbar and internal energy J, ``vbar > sqrt((1 - 1/N) 2 J)`` proves it;
        so does a vbar beyond what the amplitudes of all modes add up to at any slider, which is
        sharper, and dearer.
        """
        sign = int(flow.signs[0])
        gain = sign * self.chain.tan_alpha - self.chain.mu_d
        n = self.chain.n
        if gain < 0 or any(int(s) != sign for s in flow.signs):
            return None
        arithmetic = self.arithmetic
        mean = sign * sum(flow.velocities) / n
        needed = arithmetic.sqrt(run.motion.energy * arithmetic.number(Fraction(n - 1, n)))
        slack = flow.velocity_slack
        zero = arithmetic.number(0)
        if mean - needed > slack or (gain > 0 and bool(mean == 0) and bool(needed == 0)):
            return zero
        rate = arithmetic.number(gain) * self.cosine
        lacking = needed - mean + 2 * slack
        if gain > 0 and arithmetic.upper(lacking) < LONG * rate:
            return arithmetic.upper(lacking / rate)
        swing = run.motion.largest_swing()
        slack = slack + arithmetic.roundoff * (n + 16) * (swing + abs(mean))
        lacking = swing - mean + 2 * slack
        if lacking < 0:
            return zero
        return None if gain == 0 else arithmetic.upper(lacking / rate)

    def _search(
        self,
        flow: Flow,
        excess: dict[int, Any],
        touching: set[tuple[int, int]],
        horizon: Any,
    ) -> FirstEvent | None:
        half = self.mirrored
        search = Search(
            flow,
            self.runs,
            self.thresholds,
            excess,
            touching,
            assume=self.assume,
            half=half,
            limits=self.limits,
        )
        watches = search.first(horizon)
        if not watches:
            if horizon is None:
                raise SearchLimit("nothing ever happens, and no bound proves it")
            flow.advance(self.runs, horizon)
            self.time = self.time + horizon
            return None
        time = root_time(search, watches[0])
        self.evaluations += search.evaluations
        self.tally.undecided += search.undecided
        stops = [w.slider for w in watches if w.side == 0]
        starts = [(w.slider, w.side) for w in watches if w.side != 0]
        return event_of(time, stops, starts, self.chain.n if half else None)

    def advance(self, flow: Flow, found: FirstEvent) -> NDArray[Any]:
        """Let the sliders move to the event, and return their velocities there."""
        if bool(found.time == 0):
            return flow.velocities.copy()
        later = self.time + found.time
        self.crossed.clear()
        for n in np.flatnonzero(flow.signs).tolist():
            for m in (n - 1, n, n + 1):
                self.pinned.pop(m, None)
        if not found.exact:
            self.exact = None
        if found.shifts is None or self.residuals:
            speeds = np.concatenate([run.motion.moved(found.time)[1] for run in self.runs])
        else:
            speeds = None
        if found.shifts is None:
            flow.advance(self.runs, found.time)
        else:
            for first, displacements, velocities in found.shifts:
                flow.shift(first, self.arithmetic.vector(displacements))
                flow.velocities[first : first + len(velocities)] = velocities
        arrived = flow.velocities.copy()
        if speeds is not None:
            arrived[np.flatnonzero(flow.signs)] = speeds
        if self.mirrored:
            flow.mirror()
        if self.exact is not None:
            flow.forces = self.arithmetic.vector([f.ball() for f in self.exact.forces])
        self.time = later
        return arrived

    def resolve(self, flow: Flow, found: FirstEvent, speeds: NDArray[Any]) -> Iterator[Event]:
        """Yield the stops and the starts of an event: freeze, draw in ascending order, test."""
        stops = sorted(found.stops)
        if stops:
            signs = [int(flow.signs[n]) for n in stops]
            flow.stop(stops)
            for n in stops:
                self.crossed.pop(n, None)
                self._draw(n)
            self.tally.slips += len(stops)
            self.slips[stops] += 1
            residual = max(abs(speeds[n]) for n in stops)
            yield self._event(EventKind.STOP, stops, signs, residual)
        starts = dict(found.starts)
        distance = self.arithmetic.number(0)
        for n, sign in found.starts:
            distance = max(distance, abs(self.thresholds[n] - sign * flow.forces[n]))
        crossing = set(starts)
        for n in stops:
            sign = self._start_direction(n)
            if sign:
                starts[n] = sign
        if starts:
            ordered = sorted(starts.items())
            self._start(ordered, crossing=False)
            for n in crossing:
                self.crossed[n] = self.acting(n) - self.chain.mu_d
            sliders, signs = [n for n, _ in ordered], [sign for _, sign in ordered]
            yield self._event(EventKind.START, sliders, signs, distance)

    def _draw(self, n: int) -> None:
        """Draw the next static coefficient of slider `n` (from 0)."""
        k = int(self.draws[n])
        self.draws[n] += 1
        drawn = self.contacts.coefficient(n + 1, k)
        self.coefficients[n] = float(drawn)
        self.tally.draws_below_mu_d += self.contacts.is_low(drawn)
        self.thresholds[n] = self.threshold(n)

    def _start(self, starts: list[tuple[int, int]], *, crossing: bool) -> None:
        assert self.flow is not None
        self.flow.start([n for n, _ in starts], [sign for _, sign in starts])
        if crossing:
            for n, _ in starts:
                self.crossed[n] = self.acting(n) - self.chain.mu_d

    def rest(self, flow: Flow) -> None:
        """End the rearrangement: every slider is at rest."""
        self.tensions, self.displacements = self._shape(flow)
        self.forces, self.force_slack = flow.forces, flow.force_slack
        if self.exact is not None:
            self.renew()
            if self.exact.bits > MOST_BITS:
                self.exact = None
        self.flow = None
        self.crossed.clear()

    def _shape(self, flow: Flow) -> tuple[NDArray[Any], NDArray[Any]]:
        if not flow.touched:
            return self.tensions, self.displacements
        low, high = min(flow.touched), max(flow.touched) + 1
        tensions = self.tensions.copy()
        first, last = max(low - 1, 0), min(high, self.chain.n - 1)
        change = np.diff(flow.moved[first : last + 1])
        tensions[first:last] = tensions[first:last] + change
        return tensions, self._displaced(flow)

    def _displaced(self, flow: Flow) -> NDArray[Any]:
        displacements = self.displacements.copy()
        for n in flow.touched:
            displacements[n] = displacements[n] + flow.moved[n]
        return displacements

    def state(self) -> State:
        """Return the present state."""
        tensions, displacements = (
            self._shape(self.flow) if self.flow is not None else (self.tensions, self.displacements)
        )
        return State(tensions, displacements, self.coefficients, self.draws, self.theta)

    def known_theta(self) -> Any:
        """Return theta, as well as it is known."""
        return self.theta

    def known_moves(self) -> NDArray[Any]:
        """Return how far sliders have come in the rearrangement, as well as it is known."""
        assert self.flow is not None
        return self.flow.moved

    def known_forces(self) -> NDArray[Any]:
        """Return the forces at rest, as well as they are known."""
        return self.forces

    def captured(self) -> dict[str, Any]:
        """Return everything needed to go on bit for bit: numbers, strings and arrays by name."""
        plain, flow = self.arithmetic.plain, self.flow
        out = {name: plain(_copied(getattr(self, name))) for name in _NUMBERS}
        out |= {name: _copied(getattr(self, name)) for name in _PLAIN}
        out |= {name: [list(item) for item in getattr(self, name).items()] for name in _BY_SLIDER}
        out["tally"] = vars(self.tally).copy()
        out["exact"] = self.exact and self.exact.captured()
        out["flow"] = flow and {
            "signs": flow.signs.copy(),
            "touched": sorted(flow.touched),
            **{name: plain(_copied(getattr(flow, name))) for name in _FLOW},
        }
        return out

    def renew(self) -> None:
        """Take every number at rest from its exact value, as this precision encloses it."""
        exact = self.exact
        assert exact is not None
        vector = self.arithmetic.vector
        self.forces = vector([x.ball() for x in exact.forces])
        self.displacements = vector([x.ball() for x in exact.displacements])
        self.theta = exact.theta.ball()
        weight = self.field.times_cosine(self.chain.tan_alpha)
        tension, tensions = self.field.rational(Fraction(0)), []
        for force in exact.forces[:-1]:
            tension = tension + force - weight
            tensions.append(tension.ball())
        self.tensions = vector(tensions)

    def take_over(self, captured: Mapping[str, Any]) -> None:
        """Take over what `captured` returned, for the same chain and seed."""
        number = self.arithmetic.from_plain
        for name in _NUMBERS:
            setattr(self, name, number(captured[name]))
        for name in _PLAIN:
            setattr(self, name, _copied(captured[name]))
        for name in _BY_SLIDER:
            setattr(self, name, {int(n): value for n, value in captured[name]})
        self.tally = Tally(**captured["tally"])
        exact, flow = captured["exact"], captured["flow"]
        self.exact = exact and ExactState.restored(self.field, exact)
        self.thresholds = self.contacts.thresholds(self.coefficients, self.arithmetic)
        self.flow = None
        if flow is not None:
            self.flow = Flow(self.arithmetic, self.forces, self.friction)
            for name in _FLOW:
                setattr(self.flow, name, number(flow[name]))
            self.flow.signs, self.flow.touched = flow["signs"].copy(), set(flow["touched"])

    def velocities(self) -> NDArray[Any]:
        """Return the present velocities."""
        if self.flow is None:
            return self.arithmetic.zeros(self.chain.n)
        return self.flow.velocities.copy()


_NUMBERS = ("tensions", "displacements", "forces", "theta", "force_slack", "theta_slack", "time")
_PLAIN = (
    "coefficients",
    "draws",
    "slips",
    "fresh",
    "way",
    "announced",
    "event_number",
    "runaway",
    "proof",
    "mirrored",
    "evaluations",
)
_BY_SLIDER = ("pinned", "crossed")
_FLOW = ("forces", "velocities", "moved", "velocity_slack", "force_slack")


def event_of(
    time: Any, stops: list[int], starts: list[tuple[int, int]], mirrored: int | None
) -> FirstEvent:
    """Return the event of these sliders, and of their images in a chain of `mirrored` sliders."""
    if mirrored is not None:
        stops += [mirrored - 1 - n for n in stops]
        starts += [(mirrored - 1 - n, -sign) for n, sign in starts]
    return FirstEvent(time, tuple(sorted(stops)), tuple(sorted(starts)))


def _copied(value: Any) -> Any:
    return value.copy() if isinstance(value, np.ndarray) else value


def _sign_of_rational(x: Any) -> int:
    return int(x > 0) - int(x < 0)
