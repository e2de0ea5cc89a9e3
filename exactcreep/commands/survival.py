"""``exactcreep survival``: how long creep lives from many starts."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from exactcreep.commands.options import (
    Amplitude,
    DataFile,
    Force,
    Json,
    MaxSeconds,
    Plot,
    Workers,
    of_chain,
)
from exactcreep.commands.session import LIMIT_STATUS
from exactcreep.display import Display

if TYPE_CHECKING:
    from exactcreep.model.chain import Chain
    from exactcreep.studies.fates.survival import Survival


@of_chain
def survival(
    chain: Chain,
    amplitude: Amplitude,
    starts: Annotated[str, typer.Option(metavar="K", help="Number of starts.")] = "100",
    size: Annotated[
        str, typer.Option(metavar="R", help="Their tensions are uniform in (-R, R), unit m g.")
    ] = "1e-3",
    cycles: Annotated[str, typer.Option(metavar="K", help="The horizon.")] = "10000",
    seed: Annotated[str, typer.Option(metavar="SEED", help="Of the starts.")] = "0",
    dormant: Annotated[
        str,
        typer.Option(
            metavar="K", help="Cycles without a slip of an inner slider: dormant, with disorder."
        ),
    ] = "500",
    workers: Workers = None,
    max_seconds: MaxSeconds = None,
    out: DataFile = None,
    json: Json = False,
    plot: Plot = None,
    force: Force = False,
) -> None:
    """Follow many starts of a chain and tell how long creep lives, at which rate it dies.

    Examples:

        exactcreep survival --n 6 --amplitude 0.000969

        exactcreep survival --n 6 --amplitude 0.000984 --cycles 50000 --plot lives.png

    Exit status: 0 done, 2 bad input, 3 a limit cut starts short (what is known is shown).
    """
    from exactcreep.commands.answer import deliver
    from exactcreep.model.numbers import whole_number
    from exactcreep.quasistatic.files import check_output, check_plot
    from exactcreep.studies.fates import survival as study

    if plot is not None:
        check_plot(plot, force=force)
    if out is not None:
        check_output(out, "out", force=force)
    with Display(quiet=json) as display:
        found = study.survival(
            chain,
            amplitude,
            starts=whole_number(starts, "starts", least=1),
            size=size,
            cycles=whole_number(cycles, "cycles", least=1),
            seed=whole_number(seed, "seed", least=0),
            dormant=whole_number(dormant, "dormant", least=1),
            workers=None if workers is None else whole_number(workers, "workers", least=1),
            max_seconds=max_seconds,
            progress=display.show,
        )
    deliver(found, _print, out=out, plot=plot, draw=_draw, json=json)
    if found.reason:
        raise typer.Exit(LIMIT_STATUS)


def _draw(found: Survival, plot: Path) -> None:
    from exactcreep.figures.fates import draw_survival

    draw_survival(found, plot)


def _print(found: Survival) -> None:
    from rich.console import Console
    from rich.table import Table

    from exactcreep.studies.fates.survival import CONFIDENCE

    table = Table.grid(padding=(0, 2))
    rate = found.rate
    table.add_row("starts", f"{found.starts}, {found.lifetimes.size} of them dead")
    table.add_row("cycles lived", str(found.cycles_lived))
    table.add_row("deaths per cycle", f"{rate.rate:.4g}  ({rate.low:.4g} to {rate.high:.4g})")
    if found.lifetimes.size and rate.rate > 0:
        longest = f"{1 / rate.low:.4g}" if rate.low > 0 else "any"
        table.add_row("mean lifetime", f"{1 / rate.rate:.4g}  ({1 / rate.high:.4g} to {longest})")
        table.add_row("probability if exponential", f"{found.exponential:.3g}")
    for name, share in found.fractions.items():
        if share.starts:
            interval = f"({share.low:.3f} to {share.high:.3f})"
            table.add_row(name.replace("_", " "), f"{share.share:.3f}  {interval}")
    table.add_row("intervals", f"{100 * CONFIDENCE:.0f} %")
    table.add_row("evidence", found.evidence.value)
    if found.reason:
        table.add_row("incomplete", found.reason)
    Console(highlight=False).print(table, soft_wrap=True)
