"""``exactcreep fate``: what a chain does for ever, once it has settled."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Annotated

import typer

import exactcreep
from exactcreep.commands.answer import LIMIT, OfOutput, Rows, drawing
from exactcreep.commands.options import (
    Amplitude,
    MaxSeconds,
    OfChain,
    StartTension,
    command,
    option,
)

if TYPE_CHECKING:
    from exactcreep import Fate

_MOST_SHOWN = 12  # rearrangements


@command(draws=True)
def fate(
    chain: OfChain,
    *,
    amplitude: Amplitude,
    start_tension: StartTension = None,
    cycles: Annotated[str, option("K", "Give up after so many cycles.")] = "10000",
    solver: Annotated[str, option("NAME", "certified (proved) or exact (float64).")] = "certified",
    max_seconds: MaxSeconds = None,
    output: OfOutput,
) -> None:
    """Follow a chain under temperature cycles until it rests, is locked, or creeps, for ever.

    Examples:

        exactcreep fate --n 5 --amplitude 0.000765

        exactcreep fate --n 6 --amplitude 0.000969 --solver exact --plot fate.png

    Exit status: 0 settled, 2 bad input, 3 not settled within the limits (what is known is shown).
    """
    start = None
    if start_tension is not None:
        start = exactcreep.State.prepared(chain, [start_tension] * (chain.n - 1))
    follow = partial(
        exactcreep.fate, chain, amplitude, start=start, cycles=cycles, solver=solver,
        max_seconds=max_seconds,
    )  # fmt: skip
    found = output.answer(follow, _rows, drawing("fates:draw_fate"))
    if found.outcome is exactcreep.Outcome.LIMIT:
        raise typer.Exit(LIMIT)


def _rows(found: Fate) -> Rows:
    from exactcreep.studies.fates.result import movers

    remark = f": {found.reason}" if found.reason else ""
    rows: Rows = [
        ("outcome", found.outcome.value + remark),
        ("evidence", found.evidence.value),
        ("cycles followed", found.cycles),
        ("last advance", f"cycle {found.last_advance}" if found.last_advance else "none"),
    ]
    if found.settled_after is not None:
        rows += [
            ("settled after", f"{found.settled_after} cycles"),
            ("period", f"{found.period} cycle{'s' * (found.period != 1)}"),
            ("advance per period", f"{found.advance:.12g}"),
            ("velocity per half-cycle", f"{found.velocity:.12g}"),
        ]
    starts = [
        f"half-cycle {half_cycle}: "
        + ", ".join(movers(*about) for kind, *about in events if kind == "start")
        for half_cycle, events in found.itinerary or ()
    ]
    if len(starts) > _MOST_SHOWN:
        starts[_MOST_SHOWN:] = [f"and {len(starts) - _MOST_SHOWN} more"]
    return rows + [("rearrangements", "\n".join(starts))] * bool(starts)
