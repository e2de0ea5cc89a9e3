"""Compute the tables of rearrangements and slips from the log of events that solvers keep.

A slip has one direction. Friction dissipates ``mu_d cos(alpha)`` times its length, gravity and the
end forces do work along its displacement, and the springs supply the difference. The elastic
energies are computed independently, from the tensions; their sum checks that each slip ended at
rest.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.chain import Chain
from exactcreep.motion.arithmetic import FLOAT64, Arithmetic
from exactcreep.motion.modes import frictions_of
from exactcreep.solvers.tables import (
    EVENT_KINDS,
    EVENT_TABLE,
    REARRANGEMENT_TABLE,
    SLIP_TABLE,
    Columns,
    EventRow,
)

_STOP = EVENT_KINDS.index("stop")
LOGGED = ("moved", "coefficient", "way")
"""Columns of a log beside those of `EventRow`: the displacement of the slider in the rearrangement,
its last draw, and the direction of the ramp, 0 if there was none."""


def slips_of(rows: Columns) -> dict[str, NDArray[Any]]:
    """Return the slips of some whole rearrangements in order of stops, by fields of `SLIP_TABLE`.

    `rows`: mapping or structured array of a log of events.
    """
    order = np.argsort(rows["slider"], kind="stable")  # starts and stops of a slider take turns
    stops = np.flatnonzero(rows["kind"][order] == _STOP)
    ends = np.sort(order[stops])
    begins = order[stops - 1][np.argsort(order[stops])]
    return {
        "slider": rows["slider"][ends],
        "rearrangement": rows["rearrangement"][ends],
        "start": rows["time"][begins],
        "stop": rows["time"][ends],
        "displacement": rows["moved"][ends] - rows["moved"][begins],
        "coefficient": rows["coefficient"][ends],
    }


def rearrangements_of(
    rows: Columns,
    about: Mapping[str, NDArray[Any]],
    chain: Chain,
    arithmetic: Arithmetic = FLOAT64,
) -> dict[str, NDArray[Any]]:
    """Return the table of finished rearrangements, by its fields.

    `rows`: mapping or structured array of their log of events; `about`: the columns that do not
    follow from events; `arithmetic`: the numbers of the solver.
    """
    slips = slips_of(rows)
    slider, length = slips["slider"], np.abs(slips["displacement"])
    which = slips["rearrangement"] - slips["rearrangement"][:1]
    counts = np.bincount(which)
    ends = np.cumsum(counts)
    begins = ends - counts
    larger = np.maximum if length.dtype != object else np.frompyfunc(arithmetic.larger, 2, 1)

    def summed(lengths: NDArray[Any]) -> NDArray[Any]:
        total: NDArray[Any] = 0 * length[begins]
        np.add.at(total, which, lengths)  # in the order of the slips: `reduceat` would add in pairs
        return total

    moved = summed(slips["displacement"])
    if "friction" in chain.unlike:
        dissipation = summed(frictions_of(arithmetic, chain)[slider - 1] * length)
    else:
        dissipation = np.multiply(arithmetic.times_cosine(chain, chain.mu_d), summed(length))
    end_forces = 0 * length[begins]
    for end in {0, chain.n - 1} if "end_forces" in chain.unlike else ():
        own = summed(np.where(slider == end + 1, slips["displacement"], 0))
        end_forces = end_forces + arithmetic.number(chain.pull(end)) * own
    first = np.flatnonzero(np.diff(rows["rearrangement"], prepend=-1))
    leads = rows["number"] == 0
    return {
        **{name: rows[name][first] for name in ("half_cycle", "theta")},
        "direction": rows["way"][first],
        "began": np.add.reduceat(leads.astype(int), first),
        "began_first": np.minimum.reduceat(np.where(leads, rows["slider"], chain.n), first),
        "began_last": np.maximum.reduceat(np.where(leads, rows["slider"], 0), first),
        "duration": slips["stop"][ends - 1],
        "events": np.maximum.reduceat(rows["number"], first) + 1,
        "slips": counts,
        "sliders": np.bincount(np.unique(which * chain.n + slider - 1) // chain.n),
        "first": np.minimum.reduceat(slider, begins),
        "last": np.maximum.reduceat(slider, begins),
        "displacement": moved / chain.n,
        "largest_slip": larger.reduceat(length, begins),
        "gravity": np.multiply(arithmetic.times_cosine(chain, chain.tan_alpha), moved),
        "end_forces": end_forces,
        "dissipation": dissipation,
        **about,
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
        self._rows: list[tuple[Any, ...]] = []  # of the rearrangements since `forget`
        self._ended = self._told = 0  # rows of finished rearrangements; slips told before
        self._elastic: Any = 0  # energy at theta_c
        self._about: list[dict[str, Any]] = []  # of finished rearrangements

    def forget(self) -> None:
        """Begin new tables; rows of the present rearrangement are kept."""
        del self._rows[: self._ended]
        self._told = sum(row[EventRow._fields.index("kind")] == _STOP for row in self._rows)
        self._ended, self._about = 0, []

    def _energy(self, tensions: NDArray[Any]) -> Any:
        return self.arithmetic.dot(tensions, tensions) / 2

    def take(self, row: EventRow, tensions: Callable[[], NDArray[Any]], *logged: Any) -> None:
        """Process a slider's row of the log of events, with the columns `LOGGED`.

        `tensions`: returns the tensions at theta_c.
        """
        if self.wanted:
            if len(self._rows) == self._ended:
                self._elastic = self._energy(tensions())
            self._rows.append((*row, *logged))

    def rest(self, tensions: Callable[[], NDArray[Any]], undecided: int) -> None:
        """Log a rest, if anything has moved, with its tensions and undecided comparisons."""
        if len(self._rows) > self._ended:
            self._ended = len(self._rows)
            energies = {"elastic_before": self._elastic, "elastic_after": self._energy(tensions())}
            self._about.append(energies | {"undecided": undecided})

    def tables(self) -> dict[str, list[Any]]:
        """Return the rows of the recorded tables since the last call of `forget`."""
        made: dict[str, list[Any]] = {name: [] for name in self.wanted}
        if not self._rows:
            return made
        names = *EventRow._fields, *LOGGED
        values = dict(zip(names, zip(*self._rows, strict=True), strict=True))
        rows = {name: column.array(values[name]) for name, column in EVENT_TABLE.fields.items()}
        rows |= {name: np.array(values[name]) for name in LOGGED}
        if "slip_table" in self.wanted:
            slips = slips_of(rows)
            columns = [slips[name][self._told :] for name in SLIP_TABLE.fields]
            made["slip_table"] = [*zip(*columns, strict=True)]
        if "rearrangements" in self.wanted and self._ended:
            ended = {name: column[: self._ended] for name, column in rows.items()}
            about = {name: np.array([one[name] for one in self._about]) for name in self._about[0]}
            table = rearrangements_of(ended, about, self.chain, self.arithmetic)
            columns = [table[name] for name in REARRANGEMENT_TABLE.fields]
            made["rearrangements"] = [*zip(*columns, strict=True)]
        return made
