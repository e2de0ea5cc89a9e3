"""A rearrangement in rounded numbers, with an estimate of its rounding error."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

from exactcreep.model.contacts import Contacts
from exactcreep.model.enclosure import floats
from exactcreep.model.outcome import Evidence
from exactcreep.motion.amplified import amplified_error
from exactcreep.solvers.interface import TENSION_TOLERANCE
from exactcreep.solvers.rearrangement import Rearrangement


@dataclass(frozen=True, eq=False, repr=False, init=False)
class Estimated(Rearrangement):
    """A rearrangement that is also undecided if its rounding error may be too large.

    The error is estimated on demand, from the events.
    """

    @cached_property
    def _amplified(self) -> tuple[float, int]:
        if self.undecided:
            return math.inf, -1
        contacts = Contacts(self.chain, self.seed)
        return amplified_error(self.chain, self.initial, self.events, contacts)

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
    def error(self) -> float:
        """The estimate of the largest error; see `Rearrangement`."""
        return self._amplified[0]

    @property
    def evidence(self) -> Evidence:
        """Undecided if a comparison is, or if the error may exceed the promise."""
        return self.decided if self.error <= self.promised else Evidence.UNDECIDED

    @property
    def doubt(self) -> str:
        """Why `error` breaks the promise, if it does."""
        error, number = self._amplified
        if error <= self.promised:
            return ""
        if math.isfinite(error):
            return f"rounding may have grown to {error:.2g}, beyond {self.promised:g}"
        if count := self.undecided:
            which = "1 comparison lies" if count == 1 else f"{count} comparisons lie"
            which += " within the rounding bound"
        else:
            event = self.events[number]
            sliders = ", ".join(map(str, event.sliders))
            which = f"at event {number + 1}, the {event.kind.value} of slider {sliders}"
        return f"rounding may have changed the order of events: {which}"
