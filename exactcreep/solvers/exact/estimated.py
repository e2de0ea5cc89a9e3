"""A rearrangement by `exact`, with an estimate of its rounding error."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from numpy.typing import NDArray

from exactcreep.model.contacts import Contacts, Event
from exactcreep.model.enclosure import floats
from exactcreep.model.outcome import Evidence
from exactcreep.model.state import State
from exactcreep.motion.amplified import amplified_error
from exactcreep.solvers.exact.pack import Origin, dilation, placed
from exactcreep.solvers.interface import TENSION_TOLERANCE
from exactcreep.solvers.rearrangement import Rearrangement
from exactcreep.solvers.tables import EventRow, events_of


@dataclass(frozen=True, eq=False, repr=False, init=False)
class Estimated(Rearrangement):
    """A rearrangement that is also undecided if its rounding error may be too large.

    Events, initial state and error are made on demand. `_origin`: the state from which theta was
    ramped; `_load`: ``l0 theta_c``, as two floats; `_log` (ndarray of layout.LOGGED_EVENT): a row
    for each slider of each event.
    """

    _origin: Origin
    _load: tuple[float, float]
    _log: NDArray[Any]

    @cached_property  # type: ignore[misc] # a field that is made on demand
    def events(self) -> tuple[Event, ...]:
        """The events, in order of time."""
        rows = (EventRow._make(row[:8]) for row in self._log.tolist())
        return tuple(event for _, event in events_of(rows))

    @cached_property  # type: ignore[misc] # a field that is made on demand
    def initial(self) -> State:
        """The state at theta_c."""
        before, work = self._origin.state, placed(self.chain, self._origin, self.seed, False)
        work.now["theta"], work.now["theta_low"] = self._load
        theta = dilation(self.chain, self._load) if len(self._log) else before.theta
        return replace(before, tensions=self._origin.read(work)[0], theta=theta)

    @cached_property
    def error(self) -> float:
        """The estimate of the largest error; see `Rearrangement`."""
        if self.undecided:
            return math.inf
        contacts = Contacts(self.chain, self.seed)
        return amplified_error(self.chain, self.initial, self.events, contacts)[0]

    @cached_property
    def promised(self) -> float:
        """The largest error for which the evidence is `COMPUTED`, unit ``m g``.

        It is relative to the largest force: a weight, an end force, a tension, or the friction on a
        slider that slid.
        """
        forces = [1.0, *(abs(float(force)) for force in self.chain.end_forces)]
        for state in (self.initial, self.state):
            forces += abs(floats(state.tensions)).tolist()
        held = self.chain.each("mu_d", self.chain.times_cosine)
        forces += [held[slider - 1] for event in self.events for slider in event.sliders]
        return TENSION_TOLERANCE * max(forces)

    @property
    def evidence(self) -> Evidence:
        """Undecided if a comparison is, or if the error may exceed the promise."""
        return self.decided if self.error <= self.promised else Evidence.UNDECIDED
