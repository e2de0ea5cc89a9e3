"""``exactcreep resume``: go on from a checkpoint."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from exactcreep.commands.options import (
    DataFile,
    Every,
    Force,
    Json,
    MaxBytes,
    MaxEvents,
    MaxSeconds,
    RunPlot,
)


def resume(
    checkpoint: Annotated[
        Path, typer.Argument(metavar="FILE", help="What `exactcreep run --checkpoint` kept.")
    ],
    out: DataFile = None,
    plot: RunPlot = None,
    json: Json = False,
    force: Force = False,
    every: Every = "60",
    max_events: MaxEvents = None,
    max_seconds: MaxSeconds = None,
    max_bytes: MaxBytes = None,
) -> None:
    """Go on from a checkpoint, bit for bit as if the run had never stopped.

    The file is kept up to date. Limits count anew, except that of the events.

    Example:

        exactcreep resume jumps.ckpt --out jumps.nc
    """
    from exactcreep.commands.session import run_session
    from exactcreep.limits import Limits
    from exactcreep.quasistatic.creep import Keeper, Saved
    from exactcreep.scene import parsed_settings_text

    saved = Saved.read(checkpoint)
    note = saved.note
    settings = parsed_settings_text(note.get("settings"), len(saved.experiments))
    run_session(
        saved.experiments,
        settings,
        scene=str(note.get("scene", checkpoint.stem)),
        title=str(note.get("title", "")),
        limits=Limits.of(max_events, max_seconds, max_bytes),
        keeper=Keeper.of(checkpoint, every, force=True, note=note),
        captured=saved.captured,
        out=out,
        plot=plot,
        as_json=json,
        force=force,
    )
