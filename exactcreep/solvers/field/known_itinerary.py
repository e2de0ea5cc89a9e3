"""Follow a chain along a known itinerary, to any number of digits.

Once the order of events is known everything is explicit: theta_c is linear in the forces, and each
event time is a simple root whose float64 value starts Newton's method. This module does not prove
that no other event comes first.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import Any

from exactcreep.model.contacts import Event, EventKind
from exactcreep.model.enclosure import exact_value
from exactcreep.motion.arithmetic import balls_of
from exactcreep.motion.first_event import EventFunction, FirstEvent, Search
from exactcreep.motion.modes import Flow
from exactcreep.solvers.field.integrator import ChainIntegrator
from exactcreep.solvers.interface import Start

_BEND = 32
"""log2 of the largest ratio of half the second derivative and the slope of a condition."""


class StrayRoot(ArithmeticError):
    """No event was found near its known time."""


class KnownItinerary(ChainIntegrator):
    """`ChainIntegrator` in balls without radii, with given events, inside `arithmetic.active()`."""

    def __init__(self, start: Start, bits: int) -> None:
        super().__init__(start, balls_of(bits))
        self._instants: Iterator[list[Event]] = iter(())
        self._starts: dict[int, int] = {}  # of the present instant
        self._now = 0.0

    def follow(self, way: int, events: Sequence[Event]) -> None:
        """Go through the rearrangement with these events, after a ramp in direction `way`.

        Raises `StrayRoot` if there is no such motion.
        """
        together = groupby(events, key=lambda event: exact_value(event.time))
        self._instants = iter([list(group) for _, group in together])
        self._starts, self._now = _by_slider(next(self._instants)), 0.0
        if not self.ramp(way, None):
            raise StrayRoot("nothing starts")
        for _ in self.rearrangement():
            pass

    def load_of_start(self, slider: int, sign: int, way: int) -> Any:
        """Return ``l0 theta_c`` at which an end (from 0) starts with `sign` on a ramp."""
        return self.arithmetic.number(self.l0 * self.rest.theta + way * self.room(slider, sign))

    def _sign(self, x: Any, slack: Any) -> tuple[int, bool]:
        """Return signs such that exactly the given sliders start."""
        n, *first = self.asked
        if self.flow is None and not first:  # as the chain stands
            return super()._sign(x, slack)
        starts = n in self._starts
        if not first:
            return (1 if starts else -1), False
        return ((0 if first[0] in self._starts else -1) if starts else 1), False

    def first_event(self, flow: Flow) -> FirstEvent:
        """Return the next given event, at the time at which its condition holds."""
        events = next(self._instants, [])
        stops = [n - 1 for e in events if e.kind is EventKind.STOP for n in e.sliders]
        self._starts = _by_slider([e for e in events if e.kind is EventKind.START])
        starts = [(n, sign) for n, sign in self._starts.items() if n not in stops]
        acting = [*((n, 0) for n in stops), *starts]
        every = Search(flow, self.runs, self.thresholds).functions
        function = next((f for f in every if [(f.slider, f.side)] == acting[:1]), None)
        if function is None:
            raise StrayRoot("who is known to act next cannot")
        then = float(exact_value(events[0].time))
        guess, self._now = then - self._now, then
        return FirstEvent(self._root(function, guess), tuple(stops), tuple(starts))

    def move(self, flow: Flow, event: FirstEvent) -> None:
        """Let the sliders move to the event; the trajectory consists of points."""
        super().move(flow, event)
        for numbers in (flow.forces, flow.velocities, flow.moved):
            numbers[:] = [self.arithmetic.number(x).mid() for x in numbers.tolist()]

    def _root(self, function: EventFunction, guess: float) -> Any:
        """Return the root of an event function near `guess`, by Newton's method."""
        bits, number = self.arithmetic.bits, self.arithmetic.number
        t, half = number(guess), number(2) ** -bits
        last: Any = None
        for _ in range(12 + 2 * bits.bit_length()):
            value, slope = function(t)
            if slope == 0 or abs(t - guess) > 0.5:
                break
            step = (value / slope).mid()
            t, size = (t - step).mid(), step * step
            # the error after a step is the square of the step, times the bend of the condition
            if size < half and ((last is not None and size >= last) or size * 4**_BEND < half):
                return t
            last = size
        raise StrayRoot("no event near the time at which it is known to happen")


def _by_slider(events: Sequence[Event]) -> dict[int, int]:
    """Return the directions of these events by sliders, from 0."""
    pairs = (zip(event.sliders, event.signs, strict=True) for event in events)
    return {n - 1: sign for pair in pairs for n, sign in pair}
