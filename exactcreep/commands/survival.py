"""``exactcreep survival``: how long creep lives from many starts."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Annotated

import typer

import exactcreep
from exactcreep.commands.answer import LIMIT, Output, Rows, drawing
from exactcreep.commands.options import Amplitude, MaxSeconds, OfChain, Workers, command, option

if TYPE_CHECKING:
    from exactcreep import Survival


@command(draws=True)
def survival(
    chain: OfChain,
    *,
    amplitude: Amplitude,
    starts: Annotated[str, option("K", "Number of starts.")] = "100",
    size: Annotated[str, option("R", "Their tensions are uniform in (-R, R), unit m g.")] = "1e-3",
    cycles: Annotated[str, option("K", "The horizon.")] = "10000",
    seed: Annotated[str, option("SEED", "Of the starts.")] = "0",
    dormant: Annotated[
        str, option("K", "Cycles without a slip of an inner slider: dormant, with disorder.")
    ] = "500",
    workers: Workers = None,
    max_seconds: MaxSeconds = None,
    output: Output,
) -> None:
    """Follow many starts of a chain and tell how long creep lives, at which rate it dies.

    Examples:

        exactcreep survival --n 6 --amplitude 0.000969

        exactcreep survival --n 6 --amplitude 0.000984 --cycles 50000 --plot lives.png

    Exit status: 0 done, 2 bad input, 3 a limit cut starts short (what is known is shown).
    """
    follow = partial(
        exactcreep.survival, chain, amplitude, starts=starts, size=size, cycles=cycles, seed=seed,
        dormant=dormant, workers=workers, max_seconds=max_seconds,
    )  # fmt: skip
    if output.answer(follow, _rows, drawing("fates:draw_survival")).reason:
        raise typer.Exit(LIMIT)


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
