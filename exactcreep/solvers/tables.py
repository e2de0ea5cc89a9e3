"""The tables that a simulation records: columns with types, units and meanings.

A table is declared once, by the fields of one of its rows. Solvers, datasets and studies all use
this schema.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import groupby
from typing import Annotated, Any, NamedTuple, get_type_hints

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.contacts import Event, EventKind

LENGTH = "g tau_dyn^2"
FORCE = "m g"
TIME = "tau_dyn"
ENERGY = "m g^2 tau_dyn^2"
NUMBER = "1"
Columns = Mapping[str, NDArray[Any]] | NDArray[Any]
"""The columns of a table by their names, in a mapping or a structured array."""
_KINDS = (EventKind.START, EventKind.STOP)  # as the column of kinds numbers them
EVENT_KINDS = tuple(kind.value for kind in _KINDS)
"""Meanings of the numbers in the column of kinds."""


class Column(NamedTuple):
    """One quantity of a table: `dtype` in files, unit, meaning, and the dimension `across`.

    In memory, a solver with its own numbers keeps them where the type is float64. `across` is
    ``slider`` or ``spring`` if a row has a number for each, or empty for a single number.
    """

    dtype: str
    unit: str
    meaning: str
    across: tuple[str, ...] = ()

    def array(self, values: Sequence[Any] | NDArray[Any], n: int = 1) -> NDArray[Any]:
        """Return `values`, one for each row, as a new array; `n` is the number of sliders."""
        array = np.array(values, dtype=None if self.dtype == "float64" else self.dtype)
        if array.dtype != object:
            array = array.astype(self.dtype, copy=False)
        if not self.across:
            return array
        sizes = {"slider": n, "spring": n - 1}
        return array.reshape(len(values), *(sizes[name] for name in self.across))

    @property
    def missing(self) -> Any:
        """The value that means "none"."""
        return {"f": math.nan, "i": -1}.get(np.dtype(self.dtype).kind, "")

    @property
    def attributes(self) -> dict[str, str]:
        return {"units": self.unit, "long_name": self.meaning}


@dataclass(frozen=True)
class Schema:
    """The columns of a table, by the fields of a `row`, a named tuple annotated by `Column`.

    `dimension` names a row; `prefix` begins the names of columns in a file with several tables.
    """

    dimension: str
    row: type
    prefix: str = ""

    @cached_property
    def fields(self) -> dict[str, Column]:
        hints = get_type_hints(self.row, include_extras=True)
        return {name: hint.__metadata__[0] for name, hint in hints.items()}

    @cached_property
    def columns(self) -> dict[str, Column]:
        return {self.prefix + name: column for name, column in self.fields.items()}

    @property
    def dtype(self) -> list[tuple[str, str]]:
        return [(name, column.dtype) for name, column in self.fields.items()]

    def arrays(self, values: Any, n: int = 1) -> dict[str, NDArray[Any]]:
        fields = self.fields.items()
        return {self.prefix + name: column.array(values[name], n) for name, column in fields}

    def from_rows(self, rows: Sequence[tuple[Any, ...]]) -> dict[str, NDArray[Any]]:
        """Return the columns of `rows`, with the right types even if there are no rows."""
        values = zip(*rows, strict=True) if rows else ((),) * len(self.fields)
        return self.arrays(dict(zip(self.fields, values, strict=True)))


_real = partial(Column, "float64")
_whole = partial(Column, "int64", NUMBER)
_tiny = partial(Column, "int8", NUMBER)


class HalfCycle(NamedTuple):
    """A row for each half-cycle, or target of another drive, with the state at its end."""

    theta: Annotated[Any, _real(NUMBER, "dilation at the end of the half-cycle")]
    x_G: Annotated[Any, _real(LENGTH, "displacement of the centre of mass")]
    x: Annotated[Any, _real(LENGTH, "displacement of each slider", ("slider",))]
    tension: Annotated[Any, _real(FORCE, "tension of the spring below each slider", ("spring",))]
    slips: Annotated[Any, _whole("slips of each slider within the half-cycle", ("slider",))]


class EventRow(NamedTuple):
    """A row for each slider of an event; rows of one event differ only in slider and sign."""

    half_cycle: Annotated[int, _whole("number of the half-cycle, from 1")]
    rearrangement: Annotated[int, _whole("number of the rearrangement, from 0")]
    number: Annotated[int, _whole("number of the event within its rearrangement, from 0")]
    theta: Annotated[Any, _real(NUMBER, "dilation at which the chain rearranges")]
    time: Annotated[Any, _real(TIME, "time since the start of the rearrangement")]
    kind: Annotated[int, _tiny("0 start, 1 stop")]
    slider: Annotated[int, _whole("number of the slider, from 1")]
    sign: Annotated[int, _tiny("+1 downhill, -1 uphill")]


class RearrangementRow(NamedTuple):
    """A row for each rearrangement that has come to rest."""

    half_cycle: Annotated[int, _whole("number of the half-cycle, from 1")]
    theta: Annotated[Any, _real(NUMBER, "dilation theta_c at which the chain rearranges")]
    direction: Annotated[int, _tiny("of the ramp: +1 dilation, -1 contraction, 0 no ramp")]
    began: Annotated[int, _whole("sliders that start first, together")]
    began_first: Annotated[int, _whole("the uppermost of them, from 1")]
    began_last: Annotated[int, _whole("the lowermost of them")]
    duration: Annotated[Any, _real(TIME, "time from the first event to the last")]
    events: Annotated[int, _whole("start and stop events")]
    slips: Annotated[int, _whole("motions of one slider from start to stop")]
    sliders: Annotated[int, _whole("different sliders that slip")]
    first: Annotated[int, _whole("the uppermost slider that slips, from 1")]
    last: Annotated[int, _whole("the lowermost slider that slips")]
    displacement: Annotated[Any, _real(LENGTH, "of the centre of mass")]
    largest_slip: Annotated[Any, _real(LENGTH, "length of the longest slip")]
    elastic_before: Annotated[Any, _real(ENERGY, "elastic energy at theta_c")]
    elastic_after: Annotated[Any, _real(ENERGY, "elastic energy at rest again")]
    gravity: Annotated[Any, _real(ENERGY, "work of gravity on the sliders")]
    end_forces: Annotated[Any, _real(ENERGY, "work of the end forces")]
    dissipation: Annotated[Any, _real(ENERGY, "energy that friction takes")]
    undecided: Annotated[
        int, _whole("comparisons inside their bound, since the rearrangement before")
    ]


class SlipRow(NamedTuple):
    """A row for each slip, in order of their stops."""

    slider: Annotated[int, _whole("number of the slider, from 1")]
    rearrangement: Annotated[int, _whole("number of the rearrangement, from 0")]
    start: Annotated[Any, _real(TIME, "since the start of the rearrangement")]
    stop: Annotated[Any, _real(TIME, "since the start of the rearrangement")]
    displacement: Annotated[Any, _real(LENGTH, "of the slider, positive downhill")]
    coefficient: Annotated[float, _real(NUMBER, "static coefficient drawn at the stop")]


HALF_CYCLE_TABLE = Schema("half_cycle", HalfCycle)
EVENT_TABLE = Schema("event", EventRow, "event_")
REARRANGEMENT_TABLE = Schema("rearrangement", RearrangementRow, "rearrangement_")
SLIP_TABLE = Schema("slip", SlipRow, "slip_")
LOGS = {
    "events": EVENT_TABLE,
    "rearrangements": REARRANGEMENT_TABLE,
    "slip_table": SLIP_TABLE,
}
"""The tables with rows other than targets, by the name that records them."""
TABLES = (HALF_CYCLE_TABLE, *LOGS.values())
COLUMNS = {name: column for table in TABLES for name, column in table.columns.items()}
"""The columns of all tables, by their full names."""
RECORDS = (*(name for name in HALF_CYCLE_TABLE.columns if name != "theta"), *LOGS)
"""The quantities that a simulation can record; theta is known from the drive."""


class TargetRows(NamedTuple):
    """Arrays that a simulation fills target by target; empty for quantities not recorded."""

    x_G: NDArray[Any]
    x: NDArray[Any]
    tension: NDArray[Any]
    slips: NDArray[np.int64]

    @classmethod
    def empty(cls, record: tuple[str, ...], count: int, n: int) -> TargetRows:
        """Return room for `record` at `count` targets of `n` sliders."""
        x, tension, slips = (count * (name in record) for name in ("x", "tension", "slips"))
        return cls(
            np.empty(count),
            np.empty((x, n)),
            np.empty((tension, n - 1)),
            np.empty((slips, n), np.int64),
        )

    def part(self, first: int, last: int | None = None) -> TargetRows:
        return TargetRows(*(values[first:last] for values in self))

    def recorded(self, record: tuple[str, ...], done: int) -> dict[str, NDArray[Any]]:
        rows = self._asdict().items()
        return {name: row[:done] for name, row in rows if name == "x_G" or name in record}


def record_arrays(rows: Mapping[str, Sequence[Any]], n: int) -> dict[str, NDArray[Any]]:
    """Return recorded data as arrays, by the names of their columns; `n` is the chain's.

    `rows` has for each record its value at every target, or the rows of one of `LOGS`.
    """
    arrays: dict[str, NDArray[Any]] = {}
    for name, values in rows.items():
        if name in LOGS:
            arrays |= LOGS[name].from_rows(values)
        else:
            arrays[name] = HALF_CYCLE_TABLE.columns[name].array(values, n)
    return arrays


def joined(parts: Sequence[Mapping[str, NDArray[Any]]]) -> dict[str, NDArray[Any]]:
    names = dict.fromkeys(name for part in parts for name in part)
    return {name: np.concatenate([part[name] for part in parts if name in part]) for name in names}


def rows_of(
    event: Event, half_cycle: int, rearrangement: int, number: int, theta: Any
) -> list[EventRow]:
    kind = _KINDS.index(event.kind)
    return [
        EventRow(half_cycle, rearrangement, number, theta, event.time, kind, slider, sign)
        for slider, sign in zip(event.sliders, event.signs, strict=True)
    ]


def logged_events(recorded: Mapping[str, NDArray[Any]]) -> Iterator[tuple[EventRow, Event]]:
    """Yield every event of recorded columns after the row of its first slider; see `events_of`."""
    columns = [recorded[name].tolist() for name in EVENT_TABLE.columns]
    return events_of(map(EventRow._make, zip(*columns, strict=True)))


def events_of(rows: Iterable[EventRow]) -> Iterator[tuple[EventRow, Event]]:
    """Yield every event of some rows after the row of its first slider."""
    for _, group in groupby(rows, lambda row: (row.rearrangement, row.number, row.kind, row.time)):
        together = sorted(group, key=lambda row: row.slider)
        first = together[0]
        sliders = tuple(row.slider for row in together)
        signs = tuple(row.sign for row in together)
        yield first, Event(first.time, _KINDS[first.kind], sliders, signs)
