"""Coulomb's law at a contact, and the events it makes: start, stop, reverse, tie.

A slider at rest stays while ``|F| <= mu_s c`` (equality included); it starts in the direction of
F otherwise. A slider in motion with sign S feels ``-mu_d c S``. When its velocity reaches zero
it stops, draws a new static coefficient, and is then tested like any slider at rest: what
follows a stop at the same instant can only be a start the other way (a reversal). Simultaneous
events are one event on a set of sliders: all that stop are frozen, they draw in ascending order,
then all are tested with the same forces.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any

from exactcreep.model.numbers import same


class EventKind(Enum):
    """What happens to the sliders of an event.

    >>> EventKind("start") is EventKind.START
    True
    """

    START = "start"
    STOP = "stop"


@dataclass(frozen=True, eq=False)
class Event:
    """One event of a rearrangement: a set of sliders starts, or stops, at one instant.

    A reversal is a stop and a start at the same time; stops come first. Two events are equal if
    all their numbers are the same; balls, if midpoints and radii are.

    Attributes
    ----------
    time : number
        Since the start of the rearrangement, unit tau_dyn.
    kind : EventKind
    sliders : tuple of int
        Ascending, numbered from 1.
    signs : tuple of int
        Direction of motion after a start, before a stop: +1 downhill, -1 uphill.
    residual : number
        How far the event's condition is from holding at `time`, in the motion of the solver that
        found it: for a stop the largest ``|velocity|``, for a start the largest distance of
        ``|F|`` from ``mu_s c``. Zero for what exceeds its threshold rightly (a reversal, or a
        chain that was unstable as it stood) and, of compiled solvers, where a formula gives the
        time. A ball encloses it. What the event times leave of each condition if the motion is
        followed afresh is told by `exactcreep.motion.replay.Replay.residuals`.

    Examples
    --------
    >>> from exactcreep import Chain, State, rearrange
    >>> chain = Chain(2, 1000, "0.5", "0.6", tan_alpha="0.25")
    >>> start, stop = rearrange(chain, State.relaxed(chain), direction=+1).events
    >>> stop.kind.value, stop.sliders, stop.signs, round(stop.time, 6)
    ('stop', (2,), (1,), 3.141593)
    """

    time: Any
    kind: EventKind
    sliders: tuple[int, ...]
    signs: tuple[int, ...]
    residual: Any

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Event):
            return NotImplemented
        return (
            self.signature == other.signature
            and same(self.time, other.time)
            and same(self.residual, other.residual)
        )

    def __hash__(self) -> int:
        return hash((float(self.time), *self.signature))

    @property
    def signature(self) -> tuple[str, tuple[int, ...], tuple[int, ...]]:
        """What happened, without when: the element of an itinerary."""
        return (self.kind.value, self.sliders, self.signs)


Itinerary = tuple[tuple[str, tuple[int, ...], tuple[int, ...]], ...]
"""The sequence of event signatures of a rearrangement: (kind, sliders, signs)."""


def start_direction(force: Any, threshold: Any, sign: Callable[[Any], int]) -> int:
    """Return the direction in which a slider at rest starts, 0 while ``|force| <= threshold``.

    `sign` is the sign of a number in the arithmetic at hand; where it is zero, the slider stays.
    """
    if sign(force - threshold) > 0:
        return 1
    return -1 if sign(-force - threshold) > 0 else 0
