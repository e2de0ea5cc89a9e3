"""``exactcreep fate``: what a chain does for ever, once it has settled."""

from __future__ import annotations

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
from exactcreep.display import Display

if TYPE_CHECKING:
    from exactcreep.model.chain import Chain
    from exactcreep.studies.fates.fate import Fate


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
    from exactcreep.commands.answer import deliver
    from exactcreep.model.numbers import whole_number
    from exactcreep.model.outcome import Outcome
    from exactcreep.model.state import State
    from exactcreep.quasistatic.files import check_plot
    from exactcreep.studies.fates import fate as study

    start = None
    if start_tension is not None:
        start = State.prepared(chain, [start_tension] * (chain.n - 1))
    if plot is not None:
        check_plot(plot, force=force)
    with Display(quiet=json) as display:
        found = study.fate(
            chain,
            amplitude,
            start=start,
            cycles=whole_number(cycles, "cycles", least=1),
            solver=solver,
            max_seconds=max_seconds,
            progress=display.show,
        )
    deliver(found, _print, out=None, plot=plot, draw=_draw, json=json)
    if found.outcome is Outcome.LIMIT:
        raise typer.Exit(LIMIT_STATUS)


def _draw(found: Fate, plot: Path) -> None:
    from exactcreep.figures.fates import draw_fate

    draw_fate(found, plot)


def _print(found: Fate) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table.grid(padding=(0, 2))
    remark = f": {found.reason}" if found.reason else ""
    table.add_row("outcome", found.outcome.value + remark)
    table.add_row("evidence", found.evidence.value)
    table.add_row("cycles followed", str(found.cycles))
    table.add_row("last advance", f"cycle {found.last_advance}" if found.last_advance else "none")
    if found.settled_after is not None:
        table.add_row("settled after", f"{found.settled_after} cycles")
        table.add_row("period", f"{found.period} cycle{'s' * (found.period != 1)}")
        table.add_row("advance per period", f"{found.advance:.12g}")
        table.add_row("velocity per half-cycle", f"{found.velocity:.12g}")
    if found.itinerary:
        told = [f"half-cycle {half}: {_movers(events)}" for half, events in found.itinerary]
        more = [f"and {len(told) - 12} more"] if len(told) > 12 else []
        table.add_row("rearrangements", "\n".join(told[:12] + more))
    Console(highlight=False).print(table, soft_wrap=True)


def _movers(events: tuple[tuple[str, tuple[int, ...], tuple[int, ...]], ...]) -> str:
    """Return which sliders move, in the order of their starts."""
    movers = [
        f"{slider} {'down' if sign > 0 else 'up'}"
        for kind, sliders, signs in events
        if kind == "start"
        for slider, sign in zip(sliders, signs, strict=True)
    ]
    return ", ".join(movers)
