"""``exactcreep animate``: one rearrangement of a scene as a moving picture."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import exactcreep
from exactcreep.commands.options import (
    Force,
    Member,
    OfScene,
    Seed,
    SolverName,
    chosen,
    command,
    option,
    run_settings,
)


@command(draws=True)
def animate(
    *,
    rearrangement: Annotated[
        str | None,
        option("K", "Its number, from 0; default the one with most events in 100 half-cycles."),
    ] = None,
    scene: OfScene,
    solver: SolverName = None,
    seed: Seed = None,
    member: Member = "1",
    frames: Annotated[str | None, option("F", "Pictures of the GIF file; default 120.")] = None,
    out: Annotated[
        Path | None, option("FILE", "GIF file, or .html: a page; default SCENE-K.gif.")
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
    from exactcreep.model.numbers import whole_number
    from exactcreep.quasistatic.files import check_output, write_file

    wanted = scene.with_settings(run_settings(solver=solver, seed=seed))
    experiment = chosen(wanted.members(), member).experiment
    ending = out.suffix.lower() if out is not None else ".gif"
    if ending not in (".gif", ".html"):
        raise exactcreep.InputError("out", str(out), "must end in .gif or .html")
    if ending == ".html" and frames is not None:
        allowed = "are those of a GIF file: a page moves without them"
        raise exactcreep.InputError("frames", frames, allowed)
    count = whole_number(frames or "120", "frames", least=2, most=10_000)
    if rearrangement is None:
        number = largest_avalanche(experiment)
    else:
        number = whole_number(rearrangement, "rearrangement", least=0)
    target = out or Path(f"{wanted.name}-{number}.gif")
    check_output(target, "out", force=force)
    avalanche = find_avalanche(experiment, number)
    if ending == ".html":
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
