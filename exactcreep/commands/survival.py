"""``exactcreep survival``: how long creep lives from many starts."""

from __future__ import annotations

from functools import partial
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

if TYPE_CHECKING:
    from exactcreep.commands.answer import Rows
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
    from exactcreep.commands.answer import answered
    from exactcreep.studies.fates import survival as study

    follow = partial(
        study.survival, chain, amplitude, starts=starts, size=size, cycles=cycles, seed=seed,
        dormant=dormant, workers=workers, max_seconds=max_seconds,
    )  # fmt: skip
    found = answered(follow, _rows, _draw, out=out, plot=plot, json=json, force=force)
    if found.reason:
        raise typer.Exit(LIMIT_STATUS)


def _draw(found: Survival, plot: Path) -> None:
    from exactcreep.figures.fates import draw_survival

    draw_survival(found, plot)


def _rows(found: Survival) -> Rows:
    from exactcreep.studies.fates.survival import CONFIDENCE

    rate = found.rate
    rows: Rows = [
        ("starts", f"{found.starts}, {found.lifetimes.size} of them dead"),
        ("cycles lived", found.cycles_lived),
        ("deaths per cycle", f"{rate.rate:.4g}  ({rate.low:.4g} to {rate.high:.4g})"),
    ]
    if found.lifetimes.size and rate.rate > 0:
        longest = f"{1 / rate.low:.4g}" if rate.low > 0 else "any"
        mean = f"{1 / rate.rate:.4g}  ({1 / rate.high:.4g} to {longest})"
        exponential = f"{found.exponential:.3g}"
        rows += [("mean lifetime", mean), ("probability if exponential", exponential)]
    for name, share in found.fractions.items():
        if share.starts:
            interval = f"({share.low:.3f} to {share.high:.3f})"
            rows.append((name.replace("_", " "), f"{share.share:.3f}  {interval}"))
    rows += [("intervals", f"{100 * CONFIDENCE:.0f} %"), ("evidence", found.evidence.value)]
    return rows + [("incomplete", found.reason)] * bool(found.reason)
