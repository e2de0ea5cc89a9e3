"""The recorded events of a run, and the first event in which two runs differ."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby, zip_longest
from typing import Any, NamedTuple

from numpy.typing import NDArray

from exactcreep.model.contacts import Event, Itinerary
from exactcreep.model.numbers import InputError
from exactcreep.solvers.tables import logged_events


class LoggedRearrangement(NamedTuple):
    """One rearrangement of a run: the target whose ramp caused it, counted from 1, and theta_c."""

    half_cycle: int
    theta: Any
    events: tuple[Event, ...]

    @property
    def itinerary(self) -> Itinerary:
        """The events without their times."""
        return tuple(event.signature for event in self.events)


class LoggedEvent(NamedTuple):
    """An event: its target, from 1; its rearrangement, from 0; its place therein, from 0."""

    half_cycle: int
    rearrangement: int
    number: int
    event: Event

    @property
    def signature(self) -> tuple[Any, ...]:
        """The place and the kind of the event, without its time."""
        return (*self[:3], *self.event.signature)


def rearrangements(recorded: Mapping[str, NDArray[Any]]) -> list[LoggedRearrangement]:
    """Return the rearrangements in the recorded ``event_...`` columns, or raise `InputError`."""
    if "event_time" not in recorded:
        raise InputError("record", list(recorded), "must include events")
    out: list[LoggedRearrangement] = []
    for _, group in groupby(logged_events(recorded), key=lambda pair: pair[0].rearrangement):
        rows, events = zip(*group, strict=True)
        out.append(LoggedRearrangement(rows[0].half_cycle, rows[0].theta, events))
    return out


def numbered(log: Sequence[LoggedRearrangement]) -> list[LoggedEvent]:
    """Return all events of a run in order, with their places."""
    return [
        LoggedEvent(rearrangement.half_cycle, r, j, event)
        for r, rearrangement in enumerate(log)
        for j, event in enumerate(rearrangement.events)
    ]


def first_difference(
    own: Sequence[LoggedEvent], other: Sequence[LoggedEvent]
) -> tuple[int, LoggedEvent | None, LoggedEvent | None]:
    """Return how many events two runs share, and the next event of each (None: no more events)."""
    for i, (a, b) in enumerate(zip_longest(own, other)):
        if a is None or b is None or a.signature != b.signature:
            return i, a, b
    return len(own), None, None
