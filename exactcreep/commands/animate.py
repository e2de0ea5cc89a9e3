"""``exactcreep animate``: one rearrangement of a scene as a moving picture."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from exactcreep.commands.options import (
    Force,
    Member,
    SceneName,
    Seed,
    Settings,
    SolverName,
    parsed_settings,
)


def animate(
    scene: SceneName,
    rearrangement: Annotated[
        str | None,
        typer.Option(
            metavar="K",
            help="Its number, from 0; default the one with most events in 100 half-cycles.",
        ),
    ] = None,
    settings: Settings = None,
    solver: SolverName = None,
    seed: Seed = None,
    member: Member = "1",
    frames: Annotated[
        str | None, typer.Option(metavar="F", help="Pictures of the GIF file; default 120.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="GIF file, or .html: a page; default SCENE-K.gif."),
    ] = None,
    force: Force = False,
) -> None:
    """Draw one avalanche exactly as it moves, from its closed form.

    A page shows the run around it, too, and plays the avalanche at any speed; it needs no network.

    Rearrangements are numbered from 0 along the drive, as in a run that records its events.

    Examples:

        exactcreep animate six-sliders-cycles --rearrangement 5 --out avalanche.gif

        exactcreep animate thirty-sliders-cycles --out avalanche.html
    """
    from exactcreep.figures.animation import draw_avalanche, find_avalanche, largest_avalanche
    from exactcreep.model.numbers import InputError, whole_number
    from exactcreep.quasistatic.files import check_output, write_file
    from exactcreep.scene import load_scene

    given = parsed_settings(settings)
    for key, value in (("solver", solver), ("seed", seed)):
        if value is not None:
            given[f"run.{key}"] = value
    wanted = load_scene(scene).with_settings(given)
    members = wanted.members()
    chosen = members[whole_number(member, "member", least=1, most=len(members)) - 1].experiment
    as_page = out is not None and out.suffix.lower() == ".html"
    if out is not None and out.suffix.lower() != ".gif" and not as_page:
        raise InputError("out", str(out), "must end in .gif or .html")
    if as_page and frames is not None:
        raise InputError("frames", frames, "are those of a GIF file: a page moves without them")
    count = whole_number(frames or "120", "frames", least=2, most=10_000)
    if rearrangement is None:
        number = largest_avalanche(chosen)
    else:
        number = whole_number(rearrangement, "rearrangement", least=0)
    target = out if out is not None else Path(f"{wanted.name}-{number}.gif")
    check_output(target, "out", force=force)
    avalanche = find_avalanche(chosen, number)
    if as_page:
        from exactcreep.figures.explorer import saved

        write_file(target, saved(avalanche).encode(), "out", force=force)
    else:
        draw_avalanche(avalanche, target, frames=count)
    motion = avalanche.rearrangement
    typer.echo(
        f"rearrangement {number}, half-cycle {avalanche.half_cycle}:"
        f" {len(motion.events)} events in {float(motion.duration):.4g} tau_dyn"
    )
    typer.echo(f"written: {target}")
