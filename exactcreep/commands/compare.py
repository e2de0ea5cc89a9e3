"""``exactcreep compare``: exact, Verlet and certified side by side."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from exactcreep.commands.options import (
    Force,
    Json,
    Plot,
    SceneName,
    Seeds,
    Settings,
    parsed_seeds,
    parsed_settings,
)

if TYPE_CHECKING:
    from exactcreep.commands.answer import Rows
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
    plot: Plot = None,
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
    from exactcreep.commands.answer import answered
    from exactcreep.model.numbers import whole_number
    from exactcreep.scene import load_scene
    from exactcreep.studies import compare as study

    wanted = load_scene(scene).with_settings(parsed_settings(settings))
    chosen = wanted.settings()[0]
    measured = partial(
        study.compare,
        wanted.experiment(chosen),
        dt=dt,
        locate=locate,
        digits=whole_number(digits, "digits", least=1),
        events=whole_number(events, "events", least=1),
        seeds=parsed_seeds(seeds),
        dts=None if dts is None else [part.strip() for part in dts.split(",")],
    )
    show = partial(_print, name=wanted.name, title=wanted.title)
    draw = partial(_draw, title=wanted.title or wanted.name)
    about = {"scene": wanted.name, "set": chosen}
    answered(measured, show, draw, plot=plot, json=json, force=force, about=about)


def _draw(found: Comparison | Partings, plot: Path, title: str) -> None:
    from exactcreep.figures.comparison import draw_comparison, draw_partings
    from exactcreep.studies.partings import Partings

    if isinstance(found, Partings):
        draw_partings([found], plot, title=title)
    else:
        draw_comparison(found, plot, title=title)


def _print(found: Comparison | Partings, name: str, title: str) -> Rows:
    from rich.console import Console

    from exactcreep.commands.answer import print_heading
    from exactcreep.studies.partings import Partings

    console = Console(highlight=False)
    print_heading(console, name, title)
    if isinstance(found, Partings):
        _print_partings(console, found)
    else:
        _print_comparison(console, found)
    return []


def _print_partings(console: Any, found: Partings) -> None:
    from exactcreep.commands.answer import print_table

    certified = f"{len(found.seeds)} seeds: {found.events} certified events in all"
    if found.undecided:
        certified += f" ({found.undecided} seeds undecided)"
    velocities = f"velocities over {found.half_cycles} targets each at the least"
    console.print(f"{certified}; {velocities}", soft_wrap=True)
    rows = [
        (
            one.contestant.short,
            str(one.parted),
            f"{one.agreed.value:.0f}",
            "{:.1f} ({:.1f} to {:.1f})".format(*(1000 * x for x in one.rate)),
            f"{one.error.value:.1e}",
            f"{100 * one.bias.value:+.2f} ± {50 * (one.bias.upper - one.bias.lower):.2f}",
        )
        for one in found.contestants
    ]
    names = ("parted", "after", "wrong per 1000", "error", "bias %")
    print_table(console, ("", *names), rows, right=names, pad_edge=False)
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


def _print_comparison(console: Any, found: Comparison) -> None:
    from exactcreep.commands.answer import print_table

    console.print(
        f"certified: {found.events} events in {found.rearrangements} rearrangements, "
        f"{found.half_cycles} half-cycles ({found.evidence.value})",
        soft_wrap=True,
    )
    columns = [_rows(standing) for standing in found.contestants]
    names = ["", *(standing.contestant.label for standing in found.contestants)]
    rows = [(key, *(column[key] for column in columns)) for key in columns[0]]
    print_table(console, names, rows, pad_edge=False)
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
