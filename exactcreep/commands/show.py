"""``exactcreep show``: portraits of a saved run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from exactcreep.commands.options import Force, Member


def show(
    run: Annotated[Path, typer.Argument(metavar="RUN.nc", help="What exactcreep run --out wrote.")],
    half_cycle: Annotated[
        str | None,
        typer.Option(metavar="K", help="Look at the end of half-cycle K; default the last."),
    ] = None,
    window: Annotated[
        str, typer.Option(metavar="W", help="Half-cycles in the space-time diagram, at most.")
    ] = "200",
    member: Member = "1",
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="PNG, PDF or SVG file; default RUN.png.")
    ] = None,
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
    target = out if out is not None else run.with_suffix(".png")
    check_picture(target)
    check_output(target, "out", force=force)
    wide = whole_number(window, "window", least=1)
    chosen = members[whole_number(member, "member", least=1, most=len(members)) - 1]
    wanted = None
    if half_cycle is not None:
        wanted = whole_number(half_cycle, "half_cycle", least=0, most=chosen.half_cycles)
    seen = portrait(chosen, wanted, wide)
    with mpl.rc_context(STYLE):
        save_picture(draw_portrait(seen), target)
    if chosen.course:
        typer.echo(f"{chosen.evidence.value}: {chosen.course}")
    typer.echo(f"written: {target}")
