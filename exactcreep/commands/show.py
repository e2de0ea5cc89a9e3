"""``exactcreep show``: portraits of a saved run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from exactcreep.commands.options import Force, Member, SavedRun, chosen, command, option


@command(draws=True)
def show(
    run: SavedRun,
    half_cycle: Annotated[
        str | None, option("K", "Look at the end of half-cycle K; default the last.")
    ] = None,
    window: Annotated[str, option("W", "Half-cycles in the space-time diagram, at most.")] = "200",
    member: Member = "1",
    out: Annotated[Path | None, option("FILE", "PNG, PDF or SVG file; default RUN.png.")] = None,
    force: Force = False,
) -> None:
    """Draw x_G(t), the slips in space and time, and the tensions and forces at one moment.

    What the run did not record is computed again from its parameters, bit for bit.

    Examples:

        exactcreep show run.nc

        exactcreep show run.nc --half-cycle 37 --window 40 --out moment.pdf
    """
    import matplotlib as mpl

    from exactcreep.figures.run_view import draw_portrait, portrait
    from exactcreep.figures.style import STYLE, save_picture
    from exactcreep.model.numbers import whole_number
    from exactcreep.quasistatic.files import check_output, check_picture
    from exactcreep.quasistatic.result import load_members

    members = load_members(run)
    target = out or run.with_suffix(".png")
    check_picture(target)
    check_output(target, "out", force=force)
    wide = whole_number(window, "window", least=1)
    seen = chosen(members, member)
    wanted = None
    if half_cycle is not None:
        wanted = whole_number(half_cycle, "half_cycle", least=0, most=seen.half_cycles)
    with mpl.rc_context(STYLE):
        save_picture(draw_portrait(portrait(seen, wanted, wide)), target)
    if seen.course:
        typer.echo(f"{seen.evidence.value}: {seen.course}")
    typer.echo(f"written: {target}")
