"""How far a run can be trusted: a twin that starts a few roundings apart tells how they grow.

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
from exactcreep.model.outcome import Evidence
from exactcreep.motion.rounding_error import PROMISE
from exactcreep.quasistatic.decimals import floats
from exactcreep.solvers.solver import Simulation

TRUSTED = 1e-9
"""What `condition.PROMISE` is for a rearrangement, for `Creep.trusted_half_cycles`."""
MOST_EVENTS = 2**14
"""A twin that was not asked for goes along for so many events."""


class Watch:
    """Looks at a run at targets that lie further and further apart, and says since when it doubts.

    Attributes
    ----------
    checked : int
        The last target looked at.
    doubted_from : int
        The first target from which on the run is undecided, 0 if it is not.
    trusted : int
        The last target looked at up to which the twin has agreed to `TRUSTED`.
    parted : bool
        Whether it has ceased to.
    """

    def __init__(self, *, asked: bool) -> None:
        self.asked = asked
        self.checked = 0
        self.doubted_from = 0
        self.trusted = 0
        self.parted = False
        self.followed = True  # as long as there is a twin, or may be
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

    def look(self, simulation: Simulation, drive: Drive, done: int, *, last: bool) -> None:
        """Look at a run that has reached target `done`, if it is due or the last."""
        if done == self.checked or (done < self.next and not last):
            return
        since = self.checked + 1
        if self.followed and not self.parted:
            self._compare(simulation, drive, done)
        self.checked = done
        doubtful = simulation.evidence is Evidence.UNDECIDED or self._apart > PROMISE
        if doubtful and not self.doubted_from:
            self.doubted_from = since

    def _compare(self, simulation: Simulation, drive: Drive, done: int) -> None:
        """Take the twin to target `done`, and see whether it is where the run is."""
        events = simulation.tally.events
        allowed = self.asked or events <= MOST_EVENTS
        if self.checked == 0 and allowed:
            self._twin = simulation.twin()
        if self._twin is None or not allowed:
            self.followed, self._twin = False, None
            return
        twin, first = self._twin, self.checked + 1
        limits = Limits(events=2 * events + 1000)
        stretch = twin.follow(drive, first, done - first + 1, limits)
        one, other = simulation.state(), twin.state()
        together = (
            stretch.stop is Stop.DONE
            and twin.tally.events == events
            and np.array_equal(one.draws, other.draws)
        )
        tensions = floats(one.tensions)
        largest = max(1.0, float(np.abs(tensions).max()))
        apart = float(np.abs(tensions - floats(other.tensions)).max()) / largest
        self._apart = apart if together else np.inf
        if self._apart <= TRUSTED:
            self.trusted = done
        else:
            self.parted, self._twin = True, None

    def capture(self) -> dict[str, Any]:
        """Return everything needed to go on bit for bit."""
        return vars(self) | {"_twin": self._twin and self._twin.capture()}

    def restore(self, captured: Mapping[str, Any], simulation: Simulation) -> None:
        """Take over what `capture` returned; `simulation` is the one that is watched."""
        vars(self).update(captured)
        if captured["_twin"] is not None:
            self._twin = twin = simulation.twin()
            assert twin is not None
            twin.restore(captured["_twin"])
