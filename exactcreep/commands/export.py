"""``exactcreep export``: one table of a saved run, for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from exactcreep.commands.options import Force, Member, SavedRun, chosen, command, option


@command()
def export(
    run: SavedRun,
    to: Annotated[Path, option("FILE", "CSV or Parquet file.")],
    table: Annotated[
        str, option("NAME", "half_cycles, events, rearrangements or slip_table.")
    ] = "half_cycles",
    member: Member = "1",
    force: Force = False,
) -> None:
    """Write one table of a saved run as CSV or Parquet.

    What was recorded (run.record of the scene) is there: one row for each half-cycle, event and
    slider, rearrangement, or slip. Parquet needs pyarrow: the extra "export".

    Examples:

        exactcreep export run.nc --table events --to events.parquet

        exactcreep export run.nc --table rearrangements --to avalanches.csv
    """
    from exactcreep.quasistatic.export import check_ending
    from exactcreep.quasistatic.files import check_output
    from exactcreep.quasistatic.result import load_members

    check_ending(to)
    check_output(to, "to", force=force)
    rows = chosen(load_members(run), member).export(table, to, force=force)
    typer.echo(f"written: {to} ({rows} rows)")
