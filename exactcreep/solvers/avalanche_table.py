"""Compute the tables of rearrangements and slips from the slips and rests that solvers log.

A slip has one direction. Friction dissipates ``mu_d cos(alpha)`` times its length, gravity and the
end forces do work along its displacement, and the springs supply the difference. The elastic
energies are computed independently, from the tensions; their sum checks that each slip ended at
rest.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.chain import Chain
from exactcreep.model.contacts import Event, EventKind
from exactcreep.motion.arithmetic import FLOAT64, Arithmetic
from exactcreep.motion.modes import frictions_of
from exactcreep.motion.replay import elastic_gain
from exactcreep.solvers.tables import LENGTH, REARRANGEMENT_TABLE, SLIP_TABLE, Column

_OF_SLIPS = (
    "duration", "slips", "first", "last", "largest_slip",
    "displacement", "gravity", "end_forces", "dissipation",
)  # fmt: skip
REST_LOG = {
    name: column for name, column in REARRANGEMENT_TABLE.fields.items() if name not in _OF_SLIPS
} | {"moved": Column("float64", LENGTH, "sum of the displacements of all sliders")}
"""What solvers log when a rearrangement ends; everything else follows from its slips."""


def ledger(
    rests: Any, slips: Any, chain: Chain, arithmetic: Arithmetic = FLOAT64
) -> dict[str, NDArray[Any]]:
    """Return the table of finished rearrangements, by its fields.

    `rests`: mapping or structured array of `REST_LOG`, a row for each rearrangement; `slips`: of
    the fields of `SLIP_TABLE`, a row for each slip in order of stops, at least one for each
    rearrangement; `arithmetic`: the numbers of the solver.
    """
    slider, length = slips["slider"].copy(), np.abs(slips["displacement"])
    which = slips["rearrangement"] - slips["rearrangement"][:1]
    counts = np.bincount(which)
    ends = np.cumsum(counts)
    begins = ends - counts
    larger = np.maximum if length.dtype != object else np.frompyfunc(arithmetic.larger, 2, 1)

    def summed(lengths: NDArray[Any]) -> NDArray[Any]:
        total: NDArray[Any] = 0 * length[begins]
        np.add.at(total, which, lengths)  # in the order of the slips: `reduceat` would add in pairs
        return total

    weight = arithmetic.times_cosine(chain, chain.tan_alpha)
    if "friction" in chain.unlike:
        dissipation = summed(frictions_of(arithmetic, chain)[slider - 1] * length)
    else:
        dissipation = np.multiply(arithmetic.times_cosine(chain, chain.mu_d), summed(length))
    end_forces = 0 * length[begins]
    for end in {0, chain.n - 1} if "end_forces" in chain.unlike else ():
        moved = summed(np.where(slider == end + 1, slips["displacement"], 0))
        end_forces = end_forces + arithmetic.number(chain.pull(end)) * moved
    return {name: rests[name] for name in REST_LOG} | {
        "duration": slips["stop"][ends - 1],
        "slips": counts,
        "first": np.minimum.reduceat(slider, begins),
        "last": np.maximum.reduceat(slider, begins),
        "largest_slip": larger.reduceat(length, begins),
        "displacement": rests["moved"] / chain.n,
        "gravity": np.multiply(weight, rests["moved"]),
        "end_forces": end_forces,
        "dissipation": dissipation,
    }


class Avalanche:
    """A running rearrangement, in any arithmetic: logs slips, and its rest, from its events.

    `ramp` holds its `half_cycle`, `theta` and `direction`; `tensions`: at theta_c, shape (n - 1,).
    """

    def __init__(
        self, chain: Chain, arithmetic: Arithmetic, ramp: Mapping[str, Any], tensions: NDArray[Any]
    ) -> None:
        self.ramp, self.tensions = ramp, tensions
        self.moved = arithmetic.zeros(chain.n)
        self.chain, self.arithmetic = chain, arithmetic
        self._under_way: dict[int, tuple[Any, ...]] = {}  # start time and place of moving sliders
        self.slips: list[tuple[Any, ...]] = []
        self._began: tuple[int, ...] = ()
        self._events = 0

    def take(
        self, event: Event, number: int, moved: NDArray[Any], coefficient: Callable[[int], Any]
    ) -> list[tuple[Any, ...]]:
        """Process an event of rearrangement `number`; return the rows of slips that it ends.

        `moved`: displacements since the start; `coefficient(k)`: the draw of slider k (from 0).
        """
        before = len(self.slips)
        self._began = self._began or event.sliders
        self._events += 1
        for k in (slider - 1 for slider in event.sliders):
            if event.kind is EventKind.START:
                self._under_way[k] = event.time, moved[k]
            else:
                start, place = self._under_way.pop(k)
                slip, drawn = moved[k] - place, float(coefficient(k))
                self.moved[k] = moved[k]
                self.slips.append((k + 1, number, start, event.time, slip, drawn))
        return self.slips[before:]

    def rest(self, undecided: int) -> dict[str, Any]:
        """Return the log entry at rest, see `REST_LOG`."""
        arithmetic, tensions = self.arithmetic, self.tensions
        before = arithmetic.dot(tensions, tensions) / 2
        return dict(self.ramp) | {
            "began": len(self._began),
            "began_first": min(self._began),
            "began_last": max(self._began),
            "events": self._events,
            "sliders": len({slip[0] for slip in self.slips}),
            "moved": self.moved.sum(),
            "elastic_before": before,
            "elastic_after": before + elastic_gain(arithmetic, tensions, self.moved),
            "undecided": undecided,
        }


def rearrangement_rows(ended: Sequence[tuple[Avalanche, int]]) -> list[tuple[Any, ...]]:
    """Return the table of rearrangements of one chain; each comes with its number of undecided."""
    if not ended:
        return []
    first, slips = ended[0][0], [slip for avalanche, _ in ended for slip in avalanche.slips]
    rests = [avalanche.rest(undecided) for avalanche, undecided in ended]
    logged = {name: of.array([rest[name] for rest in rests]) for name, of in REST_LOG.items()}
    fields = zip(SLIP_TABLE.fields.items(), zip(*slips, strict=True), strict=True)
    slipped = {name: column.array(values) for (name, column), values in fields}
    table = ledger(logged, slipped, first.chain, first.arithmetic)
    return list(zip(*(table[name] for name in REARRANGEMENT_TABLE.fields), strict=True))
