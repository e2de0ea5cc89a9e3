"""``exactcreep fate``: what a chain does for ever, once it has settled."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from exactcreep.commands.options import (
    Amplitude,
    Force,
    Json,
    MaxSeconds,
    Plot,
    StartTension,
    of_chain,
)
from exactcreep.commands.session import LIMIT_STATUS

if TYPE_CHECKING:
    from exactcreep.commands.answer import Rows
    from exactcreep.model.chain import Chain
    from exactcreep.studies.fates.result import Fate

_MOST_SHOWN = 12  # rearrangements


@of_chain
def fate(
    chain: Chain,
    amplitude: Amplitude,
    start_tension: StartTension = None,
    cycles: Annotated[
        str, typer.Option(metavar="K", help="Give up after so many cycles.")
    ] = "10000",
    solver: Annotated[
        str, typer.Option(metavar="NAME", help="certified (proved) or exact (float64).")
    ] = "certified",
    max_seconds: MaxSeconds = None,
    json: Json = False,
    plot: Plot = None,
    force: Force = False,
) -> None:
    """Follow a chain under temperature cycles until it rests, is locked, or creeps, for ever.

    Examples:

        exactcreep fate --n 5 --amplitude 0.000765

        exactcreep fate --n 6 --amplitude 0.000969 --solver exact --plot fate.png

    Exit status: 0 settled, 2 bad input, 3 not settled within the limits (what is known is shown).
    """
    from exactcreep.commands.answer import answered
    from exactcreep.model.outcome import Outcome
    from exactcreep.model.state import State
    from exactcreep.studies.fates import fate as study

    start = None
    if start_tension is not None:
        start = State.prepared(chain, [start_tension] * (chain.n - 1))
    follow = partial(
        study.fate, chain, amplitude, start=start, cycles=cycles, solver=solver,
        max_seconds=max_seconds,
    )  # fmt: skip
    found = answered(follow, _rows, _draw, plot=plot, json=json, force=force)
    if found.outcome is Outcome.LIMIT:
        raise typer.Exit(LIMIT_STATUS)


def _draw(found: Fate, plot: Path) -> None:
    from exactcreep.figures.fates import draw_fate

    draw_fate(found, plot)


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
    if found.itinerary:
        starts = [
            f"half-cycle {half_cycle}: "
            + ", ".join(movers(*about) for kind, *about in events if kind == "start")
            for half_cycle, events in found.itinerary
        ]
        more = [f"and {len(starts) - _MOST_SHOWN} more"] if len(starts) > _MOST_SHOWN else []
        rows.append(("rearrangements", "\n".join(starts[:_MOST_SHOWN] + more)))
    return rows
