"""The entries of a run's summary: type, unit, meaning, and where each of them appears.

Summaries, files and grids of runs take their names and missing values from here.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from enum import Flag, auto
from functools import partial
from typing import Annotated, Any, NamedTuple, get_type_hints

from exactcreep.model.numbers import whole_number
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.solvers.tables import LENGTH, NUMBER, Column, Schema

_real = partial(Column, "float64")
_count = partial(Column, "int64", NUMBER)
_word = partial(Column, "str", "")
_MOST = 2**62  # of a count
_PER = f"{LENGTH} per {{per}}"


class Place(Flag):
    """Where an entry appears besides the summary of its run."""

    LINE = auto()
    """In the one line that shows the run."""
    FILE = auto()
    """In a file: a field of `Creep` that is read back."""
    CELL = auto()
    """In a cell of a sweep."""
    SAID = auto()
    """In the summary only if it is not empty."""


_LINE, _FILE, _CELL, _SAID = Place
_ALL = _LINE | _FILE | _CELL


class RunRow(NamedTuple):
    """One run; `per` is replaced by the unit of time of its drive, `Drive.per`."""

    outcome: Annotated[Outcome, _word("what the chain does, or why the computation stopped"), _ALL]
    evidence: Annotated[Evidence, _word("how well its trajectory is known"), _ALL]
    known_until: Annotated[int, _count("targets up to which the trajectory is known"), _ALL]
    outcome_evidence: Annotated[Evidence, _word("how well the outcome is known"), _ALL]
    direction: Annotated[str, _word("which way it creeps or runs away"), _LINE | _CELL]
    velocity: Annotated[float, _real(_PER, "mean displacement of x_G per {per}"), _ALL]
    velocity_error: Annotated[float, _real(_PER, "standard error of velocity"), _ALL]
    velocity_reason: Annotated[
        str, _word("why velocity or velocity_error is nan"), _LINE | _CELL | _SAID
    ]
    velocity_units: Annotated[str, _word("unit of both")]
    velocity_radius: Annotated[str, _word("of the ball that holds the velocity"), _SAID]
    metastable: Annotated[
        str, _word("that drawn coefficients will stop the chain for ever"), _LINE | _SAID
    ]
    since: Annotated[int | None, _count("the cycle from which on it does so"), _FILE]
    half_cycles: Annotated[int, _count("targets reached"), _ALL]
    burn_in: Annotated[int, _count("targets left out of the velocity"), _FILE]
    rearrangements: Annotated[int, _count("rearrangements"), _FILE | _CELL]
    events: Annotated[int, _count("start and stop events"), _ALL]
    slips: Annotated[int, _count("slips"), _FILE | _CELL]
    draws_below_mu_d: Annotated[
        int, _count("static coefficients drawn below mu_d, which act as mu_d"), _FILE | _CELL
    ]
    x_G: Annotated[float, _real(LENGTH, "displacement of the centre of mass at the end"), _CELL]
    solver: Annotated[str, _word("by which it was computed")]
    seed: Annotated[Any, Column("uint64", NUMBER, "of the disorder")]
    seconds: Annotated[float, _real("s", "wall time, without compilation"), _FILE]
    reason: Annotated[str, _word("for a limit or a runaway: one sentence"), _ALL | _SAID]
    warnings: Annotated[
        Mapping[str, int], _word("how often it left the model's physical range"), _FILE | _SAID
    ]
    report: Annotated[Mapping[str, Any], _word("what only this solver knows"), _FILE | _SAID]


RUN = Schema("run", RunRow)
TYPES: dict[str, Any] = get_type_hints(RunRow)
"""The Python type of each entry."""
_PLACES = {
    name: next(iter(hint.__metadata__[1:]), Place(0))
    for name, hint in get_type_hints(RunRow, include_extras=True).items()
}
_ATTRIBUTES = {"events": "event_count", "slips": "slip_count"}


def names(place: Place) -> tuple[str, ...]:
    """Return the entries that appear in a place."""
    return tuple(name for name, places in _PLACES.items() if place in places)


def attribute_of(name: str) -> str:
    """Return the name of an entry in a `Creep`, whose tables are called `events` and `slips`."""
    return _ATTRIBUTES.get(name, name)


def reader_of(name: str) -> Callable[[Any], Any]:
    """Return the function that converts the value in a file to an entry."""
    kind = TYPES[name]
    count = partial(whole_number, name=name, least=0, most=_MOST)
    if kind == int | None:
        return lambda number: None if number is None else count(number)
    return count if kind is int else dict if hasattr(kind, "__args__") else kind
