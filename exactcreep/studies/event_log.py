"""The recorded events of a run, by rearrangements."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import groupby
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


def rearrangements(recorded: Mapping[str, NDArray[Any]]) -> list[LoggedRearrangement]:
    """Return the rearrangements in the recorded ``event_...`` columns, or raise `InputError`."""
    if "event_time" not in recorded:
        raise InputError("record", list(recorded), "must include events")
    out: list[LoggedRearrangement] = []
    for _, group in groupby(logged_events(recorded), key=lambda pair: pair[0].rearrangement):
        rows, events = zip(*group, strict=True)
        out.append(LoggedRearrangement(rows[0].half_cycle, rows[0].theta, events))
    return out
