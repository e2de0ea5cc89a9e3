"""Make the tables of rearrangements and slips of what solvers log: slips, and what ends at rest.

Every slip goes one way: friction takes ``mu_d cos(alpha)`` times its length, gravity gives
``sin(alpha)`` times its displacement, and the springs have the difference. The elastic energies
come from tensions, not from the other two: that the three add up shows that each slip ended at
rest.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.chain import Chain
from exactcreep.model.contacts import Event, EventKind
from exactcreep.motion.arithmetic import FLOAT64, Arithmetic
from exactcreep.motion.replay import elastic_gain
from exactcreep.solvers.tables import REARRANGEMENT_TABLE, SLIP_TABLE

SLIP_LOG = np.dtype([*SLIP_TABLE.dtype, ("first", np.int8), ("again", np.int8)], align=True)
"""A row for each slip: whether it began with the first event of its rearrangement, and whether its
slider had slipped in it before."""
_AT_REST = (
    "half_cycle", "theta", "direction", "events", "elastic_before", "elastic_after", "undecided",
)  # fmt: skip
REST_LOG = np.dtype(
    [("rearrangement", np.int64), ("moved", np.float64)]
    + [(name, REARRANGEMENT_TABLE.fields[name].dtype) for name in _AT_REST],
    align=True,
)
"""A row for each rearrangement, at its end; `moved`: sum of all displacements in it."""


def rearrangement_columns(
    slips: Any, rests: Any, chain: Chain, arithmetic: Arithmetic = FLOAT64
) -> dict[str, NDArray[Any]]:
    """Return the columns of the table of rearrangements.

    Parameters
    ----------
    slips : ndarray of SLIP_LOG or mapping of its columns
        All slips of these rearrangements, in the order of their stops, which is that of the sums.
    rests : ndarray of REST_LOG or mapping of its columns
        Every rearrangement has come to rest, hence has at least one slip.
    """
    if not len(rests["events"]):
        return REARRANGEMENT_TABLE.from_rows(())
    slider, first = np.array(slips["slider"]), np.array(slips["first"], dtype=np.int64)
    number = np.array(slips["rearrangement"])
    begin = np.flatnonzero(np.diff(number, prepend=number[0] - 1))
    count = np.diff(begin, append=len(number))
    group = np.repeat(np.arange(begin.size), count)
    length = np.abs(slips["displacement"])
    path = np.zeros(begin.size, dtype=length.dtype)
    np.add.at(path, group, length)  # one after the other, not in pairs
    if length.dtype == object:
        parts = np.split(length, begin[1:])
        largest = np.array([reduce(arithmetic.larger, part) for part in parts], dtype=object)
    else:
        largest = np.maximum.reduceat(length, begin)
    made = {
        "began": np.add.reduceat(first, begin),
        "began_first": np.minimum.reduceat(slider + (1 - first) * chain.n, begin),
        "began_last": np.maximum.reduceat(slider * first, begin),
        "duration": slips["stop"][begin + count - 1],
        "slips": count,
        "sliders": count - np.add.reduceat(slips["again"], begin, dtype=np.int64),
        "first": np.minimum.reduceat(slider, begin),
        "last": np.maximum.reduceat(slider, begin),
        "displacement": rests["moved"] / chain.n,
        "largest_slip": largest,
        "gravity": np.multiply(arithmetic.times_cosine(chain, chain.tan_alpha), rests["moved"]),
        "dissipation": np.multiply(arithmetic.times_cosine(chain, chain.mu_d), path),
    }
    return REARRANGEMENT_TABLE.arrays(made | {name: rests[name] for name in _AT_REST})


class Avalanche:
    """A rearrangement under way, in any arithmetic: makes slips, and its row, of its events.

    Parameters
    ----------
    known : mapping
        Its `half_cycle`, `theta`, and the `direction` of the ramp.
    tensions : ndarray, shape (n - 1,)
        At theta_c, before anything moves.
    """

    def __init__(
        self, chain: Chain, arithmetic: Arithmetic, known: Mapping[str, Any], tensions: NDArray[Any]
    ) -> None:
        self.known, self.tensions = known, tensions
        self.moved = arithmetic.zeros(chain.n)
        self._chain, self._arithmetic = chain, arithmetic
        self._under_way: dict[int, tuple[Any, ...]] = {}  # when, where and with which event
        self._slips: list[tuple[Any, ...]] = []
        self._slipped: set[int] = set()
        self._events = 0

    def take(
        self, event: Event, number: int, moved: NDArray[Any], coefficient: Callable[[int], Any]
    ) -> list[tuple[Any, ...]]:
        """Take in the next event of rearrangement `number`; return the rows of slips it ends.

        `moved` are the sliders' displacements since the start of the rearrangement; `coefficient`
        returns what a slider (from 0) has drawn at its stop.
        """
        first, before = self._events == 0, len(self._slips)
        self._events += 1
        for k in (slider - 1 for slider in event.sliders):
            if event.kind is EventKind.START:
                self._under_way[k] = event.time, moved[k], first
            else:
                start, place, began = self._under_way.pop(k)
                slip, drawn, again = moved[k] - place, float(coefficient(k)), k in self._slipped
                self.moved[k] = moved[k]
                self._slipped.add(k)
                self._slips.append((k + 1, number, start, event.time, slip, drawn, began, again))
        return [slip[:-2] for slip in self._slips[before:]]

    def row(self, undecided: int) -> tuple[Any, ...]:
        """Return the row of the rearrangement, which has come to rest."""
        arithmetic, tensions = self._arithmetic, self.tensions
        before = arithmetic.dot(tensions, tensions) / 2
        rest = dict(self.known) | {
            "events": self._events,
            "moved": self.moved.sum(),
            "elastic_before": before,
            "elastic_after": before + elastic_gain(arithmetic, tensions, self.moved),
            "undecided": undecided,
        }
        columns = map(np.array, zip(*self._slips, strict=True))
        slips = dict(zip(SLIP_LOG.names or (), columns, strict=True))
        rests = {name: np.array([value]) for name, value in rest.items()}
        found = rearrangement_columns(slips, rests, self._chain, arithmetic)
        return tuple(values[0] for values in found.values())
