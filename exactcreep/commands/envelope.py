"""``exactcreep envelope``: every extreme of the model, and how well each solver stands it."""

from __future__ import annotations

import math
from pathlib import Path

import typer

import exactcreep
from exactcreep.commands.answer import FAILED, as_json, counted, say, say_table, shown


def envelope(
    *, quick: bool = False, out: Path | None = None, json: bool = False, force: bool = False
) -> None:
    """Take the model to its extremes, one at a time, and hold every solver against the truth.

    Example:

        exactcreep envelope --quick --out study

    Exit status: 0 every promise was kept or flagged, 1 one was not, 2 bad input.

    Parameters
    ----------
    quick : bool
        About a minute; the whole takes about seven.
    out : DIR
        Write envelope.csv to this directory.
    json : bool
        Print one JSON object.
    force : bool
        Overwrite files that exist.
    """
    from exactcreep.quasistatic.files import check_output, output_directory, write_file
    from exactcreep.studies.envelope import defects, to_csv
    from exactcreep.studies.envelope import envelope as measured

    target = None if out is None else output_directory(out, "out") / "envelope.csv"
    if target is not None:
        check_output(target, "out", force=force)
    with shown("envelope", quiet=json) as display:
        cells = measured(quick=quick, progress=display.show)
    failure = None
    if target is not None:
        try:
            write_file(target, to_csv(cells).encode(), "out")
        except exactcreep.InputError as error:
            failure = error  # the disk may be full: what was measured is told all the same
    broken = defects(cells)
    if json:
        summaries = [cell.summary() for cell in cells]
        typer.echo(as_json({"cells": summaries, "broken": len(broken)}))
    else:
        names = ("extreme", "solver", "error", "of one", "astray", "events", "seconds", "outcome",
                 "verdict")  # fmt: skip
        rows = [
            (
                f"{cell.quantity} = {cell.value}", cell.solver, f"{cell.error:.1e}",
                "-" if math.isnan(cell.worst) else f"{cell.worst:.1e}",
                f"{cell.astray}/{cell.compared}" if cell.compared else "-",
                str(cell.events), f"{cell.seconds:.2g}", cell.outcome, cell.verdict,
            )
            for cell in cells
        ]  # fmt: skip
        say_table(names, rows, folded=["extreme"])
        say(
            "error: of displacements at the end of the run; of one: the largest error of a single"
            " rearrangement from the same rest, over the largest force; astray: rearrangements with"
            " other events than the proved ones, of those compared; no truth: nothing is proved"
            " that the run could be held against",
            style="dim",
        )
        say(f"{len(cells)} cells: {counted(cell.verdict for cell in cells)}")
        if target is not None and failure is None:
            typer.echo(f"written: {target}")
    if failure is not None:
        raise failure
    if broken:
        raise typer.Exit(FAILED)
