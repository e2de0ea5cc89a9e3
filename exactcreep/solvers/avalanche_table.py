"""Compute the tables of rearrangements and slips from the slips and rests that solvers log.

A slip has one direction. Friction dissipates ``mu_d cos(alpha)`` times its length, gravity and the
end forces do work along its displacement, and the springs supply the difference. The elastic
energies are computed independently, from the tensions; their sum checks that each slip ended at
rest.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.chain import Chain
from exactcreep.motion.arithmetic import FLOAT64, Arithmetic
from exactcreep.motion.modes import frictions_of
from exactcreep.solvers.tables import (
    EVENT_KINDS,
    LENGTH,
    REARRANGEMENT_TABLE,
    SLIP_TABLE,
    Column,
    EventRow,
    SlipRow,
)

_STOP = EVENT_KINDS.index("stop")
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


class AvalancheLog:
    """The tables of slips and rearrangements of a simulation, derived from its log of events.

    `record`: the recorded quantities; `arithmetic`: the numbers of the solver.
    """

    def __init__(
        self, chain: Chain, record: Iterable[str], arithmetic: Arithmetic = FLOAT64
    ) -> None:
        self.chain, self.arithmetic = chain, arithmetic
        self.wanted = {"rearrangements", "slip_table"}.intersection(record)
        self._rows: list[EventRow] = []  # of the present rearrangement
        self._own: list[SlipRow] = []  # its slips
        self._starts: dict[int, tuple[Any, Any]] = {}  # time and place of moving sliders
        self.forget()

    def forget(self) -> None:
        """Begin new tables."""
        self._slips: list[SlipRow] = []
        self._ended: list[SlipRow] = []  # of rearrangements with a rest
        self._rests: list[dict[str, Any]] = []

    def take(
        self,
        row: EventRow,
        tensions: Callable[[], NDArray[Any]],
        moved: Any,
        coefficient: Any,
        way: int,
    ) -> None:
        """Process a slider's row of the log of events.

        `tensions`: returns those at theta_c; `moved`: its displacement in the rearrangement;
        `coefficient`: its last draw; `way`: the direction of the ramp, 0 if there was none.
        """
        if not self.wanted:
            return
        if not self._rows:
            self._way, self._tensions = way, tensions()
            self._moved = self.arithmetic.zeros(self.chain.n)
        self._rows.append(row)
        slider = int(row.slider)
        if row.kind != _STOP:
            self._starts[slider] = row.time, moved
            return
        start, place = self._starts.pop(slider)
        self._moved[slider - 1] = moved
        about = slider, row.rearrangement, start, row.time, moved - place, float(coefficient)
        self._own.append(SlipRow(*about))
        self._slips.append(self._own[-1])

    def rest(self, undecided: int) -> None:
        """Log a rest, if anything has moved, with its number of undecided comparisons."""
        if not self._rows:
            return
        arithmetic, tensions, moved = self.arithmetic, self._tensions, self._moved
        began = [row.slider for row in self._rows if row.number == 0]
        before, change = arithmetic.dot(tensions, tensions) / 2, np.diff(moved)
        gain = arithmetic.dot(change, tensions) + arithmetic.dot(change, change) / 2
        rest = {
            "half_cycle": self._rows[0].half_cycle,
            "theta": self._rows[0].theta,
            "direction": self._way,
            "began": len(began),
            "began_first": min(began),
            "began_last": max(began),
            "events": self._rows[-1].number + 1,
            "sliders": len({slip.slider for slip in self._own}),
            "moved": moved.sum(),
            "elastic_before": before,
            "elastic_after": before + gain,
            "undecided": undecided,
        }
        self._rests.append(rest)
        self._ended += self._own
        self._rows, self._own = [], []

    def tables(self) -> dict[str, list[Any]]:
        """Return the rows of the recorded tables since the last call of `forget`."""
        made: dict[str, list[Any]] = {"slip_table": self._slips}
        if "rearrangements" in self.wanted:
            made["rearrangements"] = self._rearrangements()
        return {name: made[name] for name in self.wanted}

    def _rearrangements(self) -> list[tuple[Any, ...]]:
        if not self._rests:
            return []
        rests = {name: of.array([at[name] for at in self._rests]) for name, of in REST_LOG.items()}
        fields = zip(SLIP_TABLE.fields.items(), zip(*self._ended, strict=True), strict=True)
        slips = {name: column.array(values) for (name, column), values in fields}
        table = ledger(rests, slips, self.chain, self.arithmetic)
        return list(zip(*(table[name] for name in REARRANGEMENT_TABLE.fields), strict=True))
