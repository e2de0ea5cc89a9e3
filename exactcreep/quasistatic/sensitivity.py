"""How sensitive a run is to rounding: a twin that starts a few roundings off shows how they grow.

Where disorder makes nearby chains part, rounding decides after some half-cycles what happens: the
statistics are right then, and the course is one of many. A twin with the same disorder goes along
until it has parted; as that is mostly soon, it costs little.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from exactcreep.limits import Limits, Stop
from exactcreep.model.drive import Drive
from exactcreep.model.enclosure import floats
from exactcreep.model.outcome import Evidence
from exactcreep.solvers.exact.layout import TENSION_TOLERANCE
from exactcreep.solvers.solver import Simulation

TRUSTED = 1e-9
"""What `TENSION_TOLERANCE` is for a rearrangement, for `Creep.trusted_half_cycles`."""
MOST_EVENTS = 2**14
"""A twin that was not asked for goes along for so many events."""


class RoundingSensitivity:
    """Compares a run with its twin, at targets that lie further and further apart.

    Attributes
    ----------
    asked : bool
        Whether the twin is followed until it parts, however long that takes.
    checked : int
        The last target looked at.
    doubted_from : int
        The first target from which on the run is undecided, 0 if it is not.
    trusted : int
        The last target looked at up to which the twin has agreed to `TRUSTED`.
    parted : bool
        Whether it has ceased to.
    followed : bool
        Whether there is a twin, or may be.
    """

    def __init__(self, *, asked: bool) -> None:
        self.asked = asked
        self.checked = 0
        self.doubted_from = 0
        self.trusted = 0
        self.parted = False
        self.followed = True
        self._twin: Simulation | None = None
        self._apart = 0.0  # tensions of the twin, when last looked at

    @property
    def next(self) -> int:
        """The next target to look at."""
        return self.checked + max(1, self.checked // 16)

    @property
    def trusted_up_to(self) -> int | None:
        """Up to which target the run can be trusted at the least, None if that is not known."""
        return self.trusted if self.parted or self.followed else None

    def look(self, simulation: Simulation, drive: Drive, done: int) -> None:
        """Look at a run that has reached target `done`, if it is due or the last."""
        if done == self.checked or self.next > done < drive.half_cycles:
            return
        since = self.checked + 1
        if self.followed and not self.parted:
            self._compare(simulation, drive, done)
        self.checked = done
        doubtful = simulation.evidence is Evidence.UNDECIDED or self._apart > TENSION_TOLERANCE
        if doubtful and not self.doubted_from:
            self.doubted_from = since

    def _compare(self, simulation: Simulation, drive: Drive, done: int) -> None:
        """Take the twin to target `done`, and see whether it is where the run is."""
        events, first = simulation.tally.events, self.checked + 1
        allowed = self.asked or events <= MOST_EVENTS
        if first == 1 and allowed:
            self._twin = simulation.twin()
        if self._twin is None or not allowed:
            self.followed, self._twin = False, None
            return
        limits = Limits(events=2 * events + 1000)
        stretch = self._twin.follow(drive, first, done - first + 1, limits)
        one, other = simulation.state(), self._twin.state()
        self._apart = np.inf
        if (
            stretch.stop is Stop.DONE
            and self._twin.tally.events == events
            and np.array_equal(one.draws, other.draws)
        ):
            tensions = floats(one.tensions)
            largest = max(1.0, float(np.abs(tensions).max()))
            self._apart = float(np.abs(tensions - floats(other.tensions)).max()) / largest
        if self._apart <= TRUSTED:
            self.trusted = done
        else:
            self.parted, self._twin = True, None

    def capture(self) -> dict[str, Any]:
        """Return everything needed to go on bit for bit."""
        return vars(self) | {"_twin": self._twin and self._twin.capture()}

    def restore(self, captured: Mapping[str, Any], simulation: Simulation) -> None:
        """Take over what `capture` returned; `simulation` is the one that the twin goes beside."""
        vars(self).update(captured)
        if captured["_twin"] is not None:
            self._twin = twin = simulation.twin()
            assert twin is not None
            twin.restore(captured["_twin"])
