"""``exactcreep run``: drive the chain of a scene."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

Out = Annotated[Path | None, typer.Option(help="Write the data to this NetCDF file.")]
Plot = Annotated[Path | None, typer.Option(help="Draw x_G and theta to this PNG or PDF file.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]
Force = Annotated[bool, typer.Option("--force", help="Overwrite files that exist.")]
Every = Annotated[str, typer.Option(metavar="SECONDS", help="How often to write the checkpoint.")]
MaxEvents = Annotated[
    str | None, typer.Option(metavar="K", help="Give up a member after K events.")
]
MaxSeconds = Annotated[
    str | None, typer.Option(metavar="SECONDS", help="Give up after so much time.")
]
MaxBytes = Annotated[
    str | None, typer.Option(metavar="BYTES", help="Give up a member that records more.")
]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="KEY=VALUE", help="Set a key of the scene, e.g. chain.n=6; repeatable."
    ),
]
Solver = Annotated[str | None, typer.Option(help="exact, verlet, sliding, ...")]


def run(
    scene: Annotated[str, typer.Argument(help="A built-in scene, or a TOML file.")],
    settings: Settings = None,
    solver: Solver = None,
    dt: Annotated[str | None, typer.Option(help="Time step of verlet, unit tau_dyn.")] = None,
    locate: Annotated[
        bool | None,
        typer.Option("--locate/--no-locate", help="Let verlet find events inside a step."),
    ] = None,
    digits: Annotated[
        str | None, typer.Option(metavar="K", help="Decimal digits of mpmath and certified.")
    ] = None,
    seed: Annotated[str | None, typer.Option(help="Of the disorder and random dilations.")] = None,
    record: Annotated[
        list[str] | None,
        typer.Option(help="x_G, x, tension, slips, events; repeatable or with commas; or none."),
    ] = None,
    out: Out = None,
    plot: Plot = None,
    json: Json = False,
    force: Force = False,
    checkpoint: Annotated[
        Path | None, typer.Option(help="Keep a file from which `exactcreep resume` goes on.")
    ] = None,
    every: Every = "60",
    max_events: MaxEvents = None,
    max_seconds: MaxSeconds = None,
    max_bytes: MaxBytes = None,
) -> None:
    """Drive the chain of a scene, or of every member of it.

    Examples:

        exactcreep run two-sliders-cycles

        exactcreep run six-sliders-cycles --set chain.tan_alpha=1/5 --plot run.png

        exactcreep run chain-jumps --out jumps.nc --checkpoint jumps.ckpt

    Exit status: 0 any physical outcome, 2 bad input, 3 a limit was reached, 130 Ctrl-C.
    """
    from exactcreep.commands.answer import as_json
    from exactcreep.commands.session import run_session
    from exactcreep.quasistatic.loop import Keeper, Limits
    from exactcreep.scene import load_scene

    given = parsed_settings(settings or [])
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
        [member.experiment for member in members],
        varied,
        scene=wanted.name,
        title=wanted.title,
        limits=limits,
        keeper=keeper,
        out=out,
        plot=plot,
        as_json=json,
        force=force,
    )


def parsed_settings(entries: list[str]) -> dict[str, Any]:
    """Return the dotted keys and values of ``--set KEY=VALUE`` entries."""
    from exactcreep.model.numbers import InputError
    from exactcreep.scene import parsed_value

    settings: dict[str, Any] = {}
    for entry in entries:
        key, equals, text = entry.partition("=")
        if not equals:
            raise InputError("set", entry, "must be KEY=VALUE, e.g. chain.n=6")
        settings[key.strip()] = parsed_value(text.strip())
    return settings
