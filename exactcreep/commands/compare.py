"""``exactcreep compare``: exact, Verlet and certified side by side."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from exactcreep.commands.options import (
    Force,
    Json,
    SceneName,
    Seeds,
    Settings,
    parsed_seeds,
    parsed_settings,
)
from exactcreep.display import Display

if TYPE_CHECKING:
    from exactcreep.studies.compare import Comparison, Standing
    from exactcreep.studies.partings import Partings


def compare(
    scene: SceneName,
    settings: Settings = None,
    dt: Annotated[
        str, typer.Option(metavar="DT", help="Time step of verlet, unit tau_dyn.")
    ] = "0.01",
    locate: Annotated[
        bool, typer.Option("--locate", help="Let verlet find events inside a step.")
    ] = False,
    digits: Annotated[
        str, typer.Option(metavar="K", help="Decimal digits of the certified solver.")
    ] = "30",
    events: Annotated[str, typer.Option(metavar="K", help="Certified events to compare.")] = "1000",
    seeds: Seeds = None,
    dts: Annotated[
        str | None,
        typer.Option(metavar="LIST", help="Compare several time steps, e.g. 0.1,0.03,0.01."),
    ] = None,
    json: Json = False,
    plot: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw the errors to this PNG or PDF file.")
    ] = None,
    force: Force = False,
) -> None:
    """Show where exact and Verlet part from the certified solver, with the same disorder.

    With --seeds or --dts: over many seeds and time steps, Verlet without and with located events:
    the first wrong event, the position error before it, orders and biases, with intervals of 95 %.

    Of a scene with several members the first is compared; --set chooses another.

    Examples:

        exactcreep compare six-sliders-cycles --dt 0.01 --plot parting.png

        exactcreep compare thirty-sliders-cycles --events 300 --json

        exactcreep compare six-sliders-cycles --seeds 16 --dts 0.1,0.03,0.01 --plot partings.png
    """
    from exactcreep.commands.answer import as_json
    from exactcreep.figures.comparison import draw_comparison, draw_partings
    from exactcreep.model.numbers import whole_number
    from exactcreep.quasistatic.files import check_plot
    from exactcreep.scene import load_scene
    from exactcreep.studies.compare import compare as measured
    from exactcreep.studies.partings import Partings

    wanted = load_scene(scene).with_settings(parsed_settings(settings))
    if plot is not None:
        check_plot(plot, force=force)
    chosen = wanted.settings()[0]
    with Display(quiet=json) as display:
        found = measured(
            wanted.experiment(chosen),
            dt=dt,
            locate=locate,
            digits=whole_number(digits, "digits", least=1),
            events=whole_number(events, "events", least=1),
            seeds=parsed_seeds(seeds),
            dts=None if dts is None else [part.strip() for part in dts.split(",")],
            progress=display.show,
        )
    if plot is not None:
        title = wanted.title or wanted.name
        if isinstance(found, Partings):
            draw_partings([found], plot, title=title)
        else:
            draw_comparison(found, plot, title=title)
    if json:
        typer.echo(as_json({"scene": wanted.name, "set": chosen} | found.summary()))
        return
    if isinstance(found, Partings):
        _print_partings(found, wanted.name, wanted.title)
    else:
        _print(found, wanted.name, wanted.title)
    if plot is not None:
        typer.echo(f"written: {plot}")


def _print_partings(found: Partings, name: str, title: str) -> None:
    from rich.console import Console
    from rich.table import Table

    from exactcreep.commands.answer import print_heading

    console = Console(highlight=False)
    print_heading(console, name, title)
    certified = f"{len(found.seeds)} seeds: {found.events} certified events in all"
    if found.undecided:
        certified += f" ({found.undecided} seeds undecided)"
    velocities = f"velocities over {found.half_cycles} targets each at the least"
    console.print(f"{certified}; {velocities}", soft_wrap=True)
    table = Table(box=None, padding=(0, 1), header_style="bold", pad_edge=False)
    for head in ("", "parted", "after", "wrong per 1000", "error", "bias %"):
        table.add_column(head, justify="right" if head else "left", no_wrap=True)
    for one in found.contestants:
        rate, bias = (1000 * x for x in one.rate), one.bias
        table.add_row(
            one.contestant.short,
            str(one.parted),
            f"{one.agreed.value:.0f}",
            "{:.1f} ({:.1f} to {:.1f})".format(*rate),
            f"{one.error.value:.1e}",
            f"{100 * bias.value:+.2f} ± {50 * (bias.upper - bias.lower):.2f}",
        )
    console.print(table)
    for label, locate in (("Verlet", False), ("with located events", True)):
        order = found.order(locate=locate)
        if order.value == order.value:  # it is known
            told = "{:.2f} ({:.2f} to {:.2f})".format(*order)
            console.print(f"order of the position error, {label}: {told}")
    console.print(
        "parted: seeds with a wrong event; after: so many events that agree, median (inf: not met);"
        " wrong: turns, per 1000 events; error: the largest of positions before the wrong"
        " event, median; bias: of the mean velocity, against exact with the same disorder;"
        " intervals are those of 95 %",
        style="dim",
        soft_wrap=True,
    )


def _print(found: Comparison, name: str, title: str) -> None:
    from rich.console import Console
    from rich.table import Table

    from exactcreep.commands.answer import print_heading

    console = Console(highlight=False)
    print_heading(console, name, title)
    console.print(
        f"certified: {found.events} events in {found.rearrangements} rearrangements, "
        f"{found.half_cycles} half-cycles ({found.evidence.value})",
        soft_wrap=True,
    )
    table = Table(box=None, padding=(0, 1), header_style="bold", pad_edge=False)
    table.add_column("", no_wrap=True)
    rows: dict[str, list[str]] = {}
    for standing in found.contestants:
        table.add_column(standing.contestant.label, no_wrap=True)
        for key, text in _rows(standing).items():
            rows.setdefault(key, []).append(text)
    for key, texts in rows.items():
        table.add_row(key, *texts)
    console.print(table)
    for standing in found.contestants:
        if standing.creep.course:
            console.print(f"{standing.contestant.solver}: {standing.creep.course}", soft_wrap=True)
    errors = found.standard_errors
    if errors == errors:  # it is known
        console.print(
            f"mean velocities differ by {found.velocity_difference:.3g},"
            f" {abs(errors):.2g} combined standard errors",
            soft_wrap=True,
        )


def _rows(standing: Standing) -> dict[str, str]:
    """Return what a solver's column says, by the name of the row."""
    from exactcreep.commands.answer import measured

    out = {"events that agree": str(standing.agreed)}
    out["first that differs"] = _told(standing.own) if standing.differs else "none"
    out["  certified instead"] = _told(standing.known) if standing.differs else ""
    tie = standing.tie
    out["how close the tie"] = "" if tie is None else f"{tie.condition} off by {tie.margin:.2g}"
    out["position error before"] = f"{standing.error_before:.2g}"
    out["position error, largest"] = f"{standing.error_after:.2g}"
    run = standing.creep
    out["velocity"] = measured(run)
    out["slips per half-cycle"] = f"{run.slip_count / max(run.half_cycles, 1):.4g}"
    out["half-cycles"] = str(run.half_cycles)
    trusted = run.trusted_half_cycles
    out["  of them trusted"] = "" if trusted is None else str(trusted)
    return out


def _told(place: Any) -> str:
    if place is None:
        return "no further event"
    event = place.event
    who = ", ".join(map(str, event.sliders))
    return f"{event.kind.value} {who} in half-cycle {place.half_cycle}"
