"""What one run comes to: every number and word of it, with its type, unit and meaning.

Summaries, files and grids of runs take their names from here, and what is missing in them.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Annotated, Any, NamedTuple, get_type_hints

from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.solvers.tables import LENGTH, NUMBER, Column, Schema

_real = partial(Column, "float64")
_count = partial(Column, "int64", NUMBER)
_word = partial(Column, "str", "")
_PER = f"{LENGTH} per {{per}}"


class RunRow(NamedTuple):
    """One run; `per` stands for what the velocity of its drive counts: `Drive.per`."""

    velocity: Annotated[float, _real(_PER, "mean displacement of x_G per {per}")]
    velocity_error: Annotated[float, _real(_PER, "standard error of velocity")]
    velocity_units: Annotated[str, _word("unit of both")]
    velocity_of: Annotated[str, _word("which velocity it is")]
    outcome: Annotated[Outcome, _word("what the chain does, or why the computation stopped")]
    evidence: Annotated[Evidence, _word("how well that is known")]
    direction: Annotated[str, _word("which way it creeps or runs away")]
    since: Annotated[int | None, _count("the cycle from which on it does so")]
    solver: Annotated[str, _word("by which it was computed")]
    half_cycles: Annotated[int, _count("targets reached")]
    burn_in: Annotated[int, _count("targets left out of the velocity")]
    rearrangements: Annotated[int, _count("rearrangements")]
    events: Annotated[int, _count("start and stop events")]
    slips: Annotated[int, _count("slips")]
    draws_below_mu_d: Annotated[
        int, _count("static coefficients drawn below mu_d, which act as mu_d")
    ]
    undecided: Annotated[int, _count("comparisons inside their rounding bound")]
    long_rearrangements: Annotated[int, _count("rearrangements of more than 200 events")]
    undecided_from: Annotated[int, _count("the first target that may be undecided, or 0")]
    x_G: Annotated[float, _real(LENGTH, "displacement of the centre of mass at the end")]
    seconds: Annotated[float, _real("s", "wall time, without compilation")]
    seed: Annotated[Any, Column("uint64", NUMBER, "of the disorder")]
    metastable: Annotated[str, _word("that drawn coefficients will stop the chain for ever")]
    course: Annotated[str, _word("how far the trajectory is known, and what the rest is worth")]
    velocity_radius: Annotated[str, _word("of the ball that holds the velocity")]
    reason: Annotated[str, _word("for a limit or a runaway: one sentence")]
    velocity_reason: Annotated[str, _word("why velocity or velocity_error is nan")]
    warnings: Annotated[Mapping[str, int], _word("how often it left the model's physical range")]
    report: Annotated[Mapping[str, Any], _word("what only this solver knows")]
    trusted_half_cycles: Annotated[int | None, _count("up to which target copies agree to 1e-9")]


RUN = Schema("run", RunRow)
TYPES: dict[str, Any] = get_type_hints(RunRow)
"""Of each entry in Python."""
COUNTS = tuple(name for name, kind in TYPES.items() if kind is int)
PERHAPS = ("metastable", "course", "velocity_radius", "reason", "velocity_reason", "warnings",
           "report", "trusted_half_cycles")  # fmt: skip
"""Entries that a summary leaves out where there is nothing to say."""
ATTRIBUTES = {"events": "event_count", "slips": "slip_count"}
"""Entries that have another name in a `Creep`, whose tables have theirs."""
