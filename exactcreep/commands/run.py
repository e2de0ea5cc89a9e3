"""``exactcreep run``: drive the chain of a scene."""

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
    SceneName,
    Seed,
    Settings,
    SolverName,
    parsed_settings,
)


def run(
    scene: SceneName,
    settings: Settings = None,
    solver: SolverName = None,
    dt: Annotated[
        str | None, typer.Option(metavar="DT", help="Time step of verlet, unit tau_dyn.")
    ] = None,
    locate: Annotated[
        bool | None,
        typer.Option("--locate/--no-locate", help="Let verlet find events inside a step."),
    ] = None,
    digits: Annotated[
        str | None, typer.Option(metavar="K", help="Decimal digits of mpmath and certified.")
    ] = None,
    seed: Seed = None,
    record: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAMES",
            help="x_G, x, tension, slips, events; repeatable or with commas; or none.",
        ),
    ] = None,
    out: DataFile = None,
    plot: RunPlot = None,
    json: Json = False,
    force: Force = False,
    checkpoint: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Keep a file from which `exactcreep resume` goes on."),
    ] = None,
    every: Every = "60",
    max_events: MaxEvents = None,
    max_seconds: MaxSeconds = None,
    max_bytes: MaxBytes = None,
    twin: Annotated[
        bool,
        typer.Option(
            "--twin", help="Follow a twin a few roundings off until it parts, however late."
        ),
    ] = False,
) -> None:
    """Drive the chain of a scene, or of every member of it.

    Examples:

        exactcreep run two-sliders-cycles

        exactcreep run six-sliders-cycles --set chain.tan_alpha=1/5 --plot run.png

        exactcreep run chain-jumps --out jumps.nc --checkpoint jumps.ckpt

        exactcreep run lead-roof --plot roof.png

    Exit status: 0 any physical outcome, 2 bad input, 3 a limit was reached, 4 the checkpoint is
    older than the result, 130 Ctrl-C, 143 SIGTERM.
    """
    from dataclasses import replace

    from exactcreep.commands.answer import as_json
    from exactcreep.commands.session import run_session
    from exactcreep.limits import Limits
    from exactcreep.quasistatic.creep import Keeper
    from exactcreep.scene import load_scene

    given = parsed_settings(settings)
    for key, value in (("solver", solver), ("dt", dt), ("digits", digits), ("seed", seed)):
        if value is not None:
            given[f"run.{key}"] = value
    if locate is not None:
        given["run.locate"] = locate
    if record is not None:
        names = [name for entry in record for name in entry.split(",") if name]
        given["run.record"] = [] if names == ["none"] else names
    wanted = load_scene(scene).with_settings(given)
    limits = Limits.of(max_events, max_seconds, max_bytes)
    members = wanted.members()
    varied = [member.settings for member in members]
    note = {"scene": wanted.name, "title": wanted.title, "settings": as_json(varied)}
    keeper = None if checkpoint is None else Keeper.of(checkpoint, every, force=force, note=note)
    run_session(
        [replace(member.experiment, twin=twin) for member in members],
        varied,
        scene=wanted.name,
        title=wanted.title,
        limits=limits,
        keeper=keeper,
        out=out,
        plot=plot,
        as_json=json,
        force=force,
        solids=[(member.solid, member.time_unit) for member in members],
    )
