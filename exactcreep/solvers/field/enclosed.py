"""Mechanics in balls whose enclosures grow no faster than nearby motions part.

Beside the balls, which prove the order of events for every state of the set, the middle of the
set is taken through the same events as a point; at rest the set is put together again from that
point and the derivative of the rearrangement (see `exactcreep.motion.enclosure`).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, ClassVar

import flint
import numpy as np
from numpy.typing import NDArray

from exactcreep.limits import NO_LIMITS, Limits
from exactcreep.model.chain import Chain
from exactcreep.model.contacts import Event, EventKind
from exactcreep.model.state import State
from exactcreep.motion.arithmetic import Arithmetic, Undecided, balls_of
from exactcreep.motion.enclosure import ZERO, Box, Passage, Row, Spread
from exactcreep.motion.first_event import FirstEvent, Search, root_time
from exactcreep.motion.modes import Flow, ModalPiece
from exactcreep.motion.solution import Motion
from exactcreep.solvers.field.event_loop import Mechanics

DERIVATIVE_BITS = 128
STRETCH = 10
"""Events after which the set is put together again, within a rearrangement; plain balls lose about
3 bits per event meanwhile, the derivative's as well as the states'."""


class Middle(Mechanics):
    """The middle of a set, which does what is proved of every state of the set.

    Attributes
    ----------
    foreseen : deque of FirstEvent
        The events that come next, each in an enclosure of its time that holds for all states.
    """

    foreseen: deque[FirstEvent]

    def __init__(self, chain: Chain, seed: int, arithmetic: Arithmetic, state: State) -> None:
        super().__init__(chain, seed, arithmetic, state)
        self.foreseen = deque()

    def first_event(self, flow: Flow) -> FirstEvent | None:
        """Return the first event; one that is foreseen needs no search, only its time."""
        known = self.foreseen.popleft() if self.foreseen else None
        if known is not None and known.shifts is None and not bool(known.time == 0):
            found = self._timed(flow, known)
            if found is not None:
                return found
        return super().first_event(flow)

    def _timed(self, flow: Flow, known: FirstEvent) -> FirstEvent | None:
        """Return the known event at its time for this state, None if no root can be isolated."""
        acting = (known.stops[0], 0) if known.stops else known.starts[0]
        search = Search(flow, self.runs, self.thresholds, {}, half=self.mirrored, only=[acting])
        (watch,) = search.watches
        watch.safe, watch.last = known.time.lower(), known.time.upper()
        watch.steepness = watch.slope
        if not search.refine(watch):
            return None
        time = root_time(search, watch)
        self.evaluations += search.evaluations
        if watch.safe > watch.last:
            raise AssertionError("the enclosure of an event does not hold a state of the set")
        return replace(known, time=time)


class Enclosed(Mechanics):
    """`Mechanics` in balls with a set kept beside them; see the module."""

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
        self.origin = state
        self.keep = keep
        self.start: Motion | None = None
        self.pieces: list[ModalPiece] = []
        # rows of the box: forces, velocities of the sliders `fast`, l0 theta
        self.box: Box | None = None
        self.fast: list[int] = []
        self.centre: Middle | None = None
        self.reach: list[Any] = []  # how uncertain the displacements are
        # of the rearrangement under way
        self.aim: tuple[int, Any] = (0, None)
        self.departure: dict[str, Any] | None = None
        self.passages: list[Passage] | None = []
        self.found: list[FirstEvent] = []  # of which the middle has not been told
        self.signatures: list[Any] = []
        self.crossing_ends: list[int] = []
        self.young = False  # whether the set was begun in this rearrangement
        self.followed: list[Any] = []
        self.following: Iterator[Event | None] = iter(())

    # -- at rest -------------------------------------------------------------------------------

    def ramp(self, way: int, target: Any) -> bool:
        """Ramp theta, the set and its middle along with the balls; see `Mechanics.ramp`."""
        self.aim = (way, target)
        self.departure = self._at_rest()
        self.passages, self.signatures, self.young = [], [], False
        self.found = []
        moves = super().ramp(way, target)
        if self.centre is not None:
            try:
                self._ramp_set(self.centre, moves)
            except Undecided:
                if not self.assume:
                    raise
                self.box = self.centre = None  # the balls go on alone, and a set begins anew
        return moves

    def _ramp_set(self, centre: Middle, moves: bool) -> None:
        """Let the set and its middle follow a ramp of the balls."""
        box, (way, target) = self.box, self.aim
        assert box is not None
        centre.foreseen.clear()
        if centre.ramp(way, target) != moves:
            raise Undecided("the middle of the set does something else")
        self.followed, self.following = [], centre.rearrangement()
        self.box = Box(self._ramped(box.axes, moves), box.widths, box.exponent)

    def _ramped(self, axes: list[Row], moves: bool) -> list[Row]:
        """Return rows as a ramp turns them that ended with a start, or at its target."""
        rows = list(axes)
        first, last, theta = rows[0], rows[-2], rows[-1]
        zero = [ZERO] * len(first)
        if not moves and self.aim[1] is not None and self.chain.n > 1:
            rows[0] = [a + b for a, b in zip(first, theta, strict=True)]
            rows[-2] = [a - b for a, b in zip(last, theta, strict=True)]
            rows[-1] = zero
        elif self.crossing_ends and moves:
            both = [a + b for a, b in zip(first, last, strict=True)]
            if 0 in self.crossing_ends:  # l0 theta moved by what slider 1 lacked
                rows[0], rows[-2] = zero, both
                rows[-1] = [a + b for a, b in zip(theta, first, strict=True)]
            else:
                rows[0], rows[-2] = both, zero
                rows[-1] = [a - b for a, b in zip(theta, last, strict=True)]
            if len(self.crossing_ends) > 1:
                rows[0] = rows[-2] = zero
                if not self.mirrored:
                    self.passages = None  # a tie that was assumed
        return rows

    def _set_off(self, starts: list[tuple[int, int]], *, crossing: bool) -> None:
        self.crossing_ends = [n for n, _ in starts] if crossing else []
        still = self.arithmetic.zeros(self.chain.n)
        self.start, self.pieces = Motion(self.displacements, still, self.forces.copy()), []
        super()._set_off(starts, crossing=crossing)

    def _event(self, kind: EventKind, sliders: list[int], signs: list[int], residual: Any) -> Event:
        event = super()._event(kind, sliders, signs, residual)
        self.signatures.append(event.signature)
        return event

    def advance(self, flow: Flow, found: FirstEvent) -> NDArray[Any]:
        """Let the sliders move to the event, and note what the derivative needs."""
        signs = flow.signs.copy()
        self.found.append(found)
        if self.keep and self.start is not None and not bool(found.time == 0):
            later = self.time + found.time
            self.pieces.append(flow.piece(self.time, later, self.start, self.runs))
        arrived = super().advance(flow, found)
        if self.passages is None or bool(found.time == 0):
            return arrived
        acting = [*found.stops, *(n for n, _ in found.starts)]
        image = self.chain.n - 1 - acting[0] if self.mirrored else None
        if acting[1:] != [n for n in (image,) if n is not None]:
            self.passages = None  # a tie that was assumed
            return arrived
        slider, side = (found.stops[0], 0) if found.stops else found.starts[0]
        shapes = tuple((run.first, run.motion.p, run.motion.ends) for run in self.runs)
        accelerations = flow.forces - self.friction * signs
        velocities = flow.velocities.copy()
        self.passages.append(
            Passage(shapes, found.time, slider, image, side, velocities, accelerations)
        )
        return arrived

    def rearrangement(self) -> Iterator[Event | None]:
        """Yield the events; see `Mechanics.rearrangement`."""
        if self._is_due():  # whoever asked for the events before had no time for it
            self._renew_in_motion()
        for event in super().rearrangement():
            yield event
            if event is None and self._is_due():
                self._renew_in_motion()

    def _is_due(self) -> bool:
        """Return whether the set has to be put together again before the next event."""
        if self.flow is None or self.runaway:
            return False
        return len(self.passages or ()) >= self.stretch

    def rest(self, flow: Flow) -> None:
        """End the rearrangement, and put the set together again."""
        super().rest(flow)
        if self.exact is not None:
            return
        if self.passages is not None:
            try:
                if self.centre is None:
                    self._enclose_departure()
                self._renew_at_rest()
                return
            except Undecided:
                if not (self.young or self.assume):
                    raise
        # a tie was assumed, or decided in Q(c), which the middle of the set does not know
        self._enclose(self.snapshot())

    def _renew_at_rest(self) -> None:
        assert self.box is not None
        centre = self._caught_up()
        noise = [x.rad() for x in (*centre.forces, self.l0 * centre.theta)]
        with balls_of(DERIVATIVE_BITS).active():
            spread = self._spread()
            self.box = self.box.carried([*spread.forces, self.box.axes[-1]], noise)
            self.reach = [
                (a + x.rad()).upper() for a, x in zip(self.reach, centre.displacements, strict=True)
            ]
        self.fast = []
        self._recentre(centre)

    def _renew_in_motion(self) -> None:
        """Put the set together again between two events.

        Raises
        ------
        OutOfTime
            If the time is over; called again, it goes on.
        """
        flow = self.flow
        assert flow is not None
        if self.exact is not None:
            return
        try:
            if self.centre is None:
                self._enclose_departure()
            centre = self._caught_up(self.limits)
        except Undecided:
            if not (self.young or self.assume):
                raise
            self.passages = None
            return
        assert self.box is not None
        assert centre.flow is not None
        middle = centre.flow
        fast = [n for n in np.flatnonzero(flow.signs).tolist() if flow.velocities[n] != 0]
        noise = [x.rad() for x in (*middle.forces, *middle.velocities[fast])]
        with balls_of(DERIVATIVE_BITS).active():
            spread = self._spread(self.limits)
            rows = [*spread.forces, *(spread.velocities[n] for n in fast), self.box.axes[-1]]
            self.box = self.box.carried(rows, [*noise, ZERO])
            radii = self.box.radii(self.box.axes)
        self.fast = fast
        n = self.chain.n
        middle.forces[:] = [x.mid() for x in middle.forces]
        middle.velocities[fast] = [x.mid() for x in middle.velocities[fast]]
        pairs = zip(middle.forces, radii[:n], strict=True)
        flow.forces[:] = [flint.arb(m, r) for m, r in pairs]
        pairs = zip(middle.velocities[fast], radii[n:-1], strict=True)
        flow.velocities[fast] = [flint.arb(m, r) for m, r in pairs]
        self.passages = []

    def _caught_up(self, limits: Limits = NO_LIMITS) -> Middle:
        """Let the middle of the set do what the balls have done, and return it."""
        assert self.centre is not None
        assert self.departure is not None
        # what was assumed, or decided in Q(c), is not proved of the middle
        if not self.assume and self.departure["mechanics"]["exact"] is None:
            self.centre.foreseen.extend(self.found)
        self.found = []
        behind = len(self.followed) < len(self.signatures)
        for event in self.following if behind else ():
            if event is not None:
                self.followed.append(event.signature)
            elif len(self.followed) >= len(self.signatures):
                break
            else:
                limits.require()
        if self.followed != self.signatures:
            raise Undecided("the middle of the set does something else")
        return self.centre

    def _spread(self, limits: Limits = NO_LIMITS) -> Spread:
        """Return the axes as the events since the last time have turned them."""
        assert self.box is not None
        assert self.passages is not None
        n = self.chain.n
        spread = Spread(self.box.axes[:n], balls_of(DERIVATIVE_BITS))
        for slider, row in zip(self.fast, self.box.axes[n:-1], strict=True):
            spread.velocities[slider] = row
        for passage in self.passages:
            limits.require()
            spread.pass_through(passage)
        moved = self.box.radii(spread.moved)
        self.reach = [(a + b).upper() for a, b in zip(self.reach, moved, strict=True)]
        return spread

    def _enclose_departure(self) -> None:
        """Begin a set at the state from which the rearrangement under way departed."""
        assert self.departure is not None
        self.young = True
        now = self.forces.copy(), self.displacements.copy(), self.tensions, self.theta
        self._enclose(self.departure["mechanics"])
        self.forces, self.displacements, self.tensions, self.theta = now
        assert self.centre is not None
        self._ramp_set(self.centre, True)

    def _enclose(self, snapshot: Mapping[str, Any]) -> None:
        """Begin a set at the balls of a state at rest."""
        centre = Middle(self.chain, self.seed, self.arithmetic, self.origin)
        centre.resume(snapshot)
        centre.exact = None
        self.centre = centre
        self.fast = []
        self.box = Box.of([x.rad() for x in (*centre.forces, self.l0 * centre.theta)])
        self.reach = [x.rad() for x in centre.displacements]
        self._recentre(centre)

    def _recentre(self, centre: Middle) -> None:
        """Take the middle as a point, and the balls around it as wide as the set."""
        assert self.box is not None
        for name in ("forces", "displacements"):
            numbers = getattr(centre, name)
            getattr(centre, name)[:] = [x.mid() for x in numbers]
        centre.theta = centre.theta.mid()
        radii = self.box.radii(self.box.axes)
        ball = flint.arb
        self.forces[:] = [ball(m, r) for m, r in zip(centre.forces, radii[:-1], strict=True)]
        self.theta = ball(centre.theta, (radii[-1] / self.l0).upper())
        pairs = zip(centre.displacements, self.reach, strict=True)
        self.displacements[:] = [ball(m, r) for m, r in pairs]
        self.tensions = self.arithmetic.vector(np.cumsum(self.forces - self.weight)[:-1])

    # -- to go on later ------------------------------------------------------------------------

    def _at_rest(self) -> dict[str, Any]:
        """Return copies of everything that determines the future, at rest."""
        centre = self.centre.snapshot() if self.centre is not None else None
        return {
            "mechanics": self.snapshot(),
            "box": self.box,
            "reach": self.reach,
            "centre": centre,
        }

    def captured(self) -> dict[str, Any]:
        """Return the last state at rest, and how many events were done since then."""
        moving = self.flow is not None and self.departure is not None
        kept = self.departure if moving and self.departure is not None else self._at_rest()
        out: dict[str, Any] = {"mechanics": self.as_plain(kept["mechanics"]), "set": None}
        if kept["box"] is not None:
            plain, box = self.arithmetic.plain, kept["box"]
            out["set"] = {
                "axes": [plain(self.arithmetic.vector(row)) for row in box.axes],
                "widths": box.widths,
                "exponent": box.exponent,
                "reach": plain(self.arithmetic.vector(kept["reach"])),
                "centre": self.as_plain(kept["centre"]),
            }
        out["events"] = self.event_number if moving else -1
        out["ended"] = self.runaway
        out["way"], out["target"] = self.aim if moving else (0, None)
        return out

    def take_over(self, captured: Mapping[str, Any]) -> None:
        """Take over what `captured` returned, and go through the events again that were done."""
        super().take_over(captured["mechanics"])
        self.box, self.centre, self.reach, self.fast = None, None, [], []
        kept = captured["set"]
        if kept is not None:
            number = self.arithmetic.from_plain
            axes = [[ZERO if x == 0 else x for x in number(row)] for row in kept["axes"]]
            self.box = Box(axes, kept["widths"].copy(), int(kept["exponent"]))
            self.reach = list(number(kept["reach"]))
            self.centre = Middle(self.chain, self.seed, self.arithmetic, self.origin)
            self.centre.take_over(kept["centre"])
        if captured["events"] >= 0:
            self.ramp(captured["way"], captured["target"])
            for event in self.rearrangement():
                done = event is None and self.event_number >= captured["events"]
                if done and not captured["ended"]:  # a runaway goes on to where it was proved
                    break
