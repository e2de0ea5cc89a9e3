"""``exactcreep tradeoff``: what time buys which accuracy, measured on this machine."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
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
    from exactcreep.studies.tradeoff import Score, Tradeoff


def tradeoff(
    scene: SceneName,
    budget: Annotated[
        str, typer.Option(metavar="SECONDS", help="About how long to measure.")
    ] = "60",
    settings: Settings = None,
    seeds: Seeds = None,
    json: Json = False,
    plot: Plot = None,
    force: Force = False,
) -> None:
    """Measure what time buys which accuracy, for a scene on this machine.

    Of a scene with several members the first is measured; --set chooses another.

    Examples:

        exactcreep tradeoff six-sliders-cycles --plot tradeoff.png

        exactcreep tradeoff thirty-sliders-cycles --budget 300 --seeds 16 --json
    """
    from exactcreep.commands.answer import answered
    from exactcreep.figures.comparison import draw_tradeoff
    from exactcreep.scene import load_scene
    from exactcreep.studies import tradeoff as study

    wanted = load_scene(scene).with_settings(parsed_settings(settings))
    chosen = wanted.settings()[0]
    measured = partial(
        study.tradeoff, wanted.experiment(chosen), budget=budget, seeds=parsed_seeds(seeds)
    )
    show = partial(_print, name=wanted.name, title=wanted.title, chosen=chosen)
    draw = partial(draw_tradeoff, title=wanted.title or wanted.name)
    about = {"scene": wanted.name, "set": chosen}
    answered(measured, show, draw, plot=plot, json=json, force=force, about=about)


def _print(measured: Tradeoff, name: str, title: str, chosen: Mapping[str, Any]) -> Rows:
    from rich.console import Console

    from exactcreep.commands.answer import print_heading, print_table

    console = Console(highlight=False)
    print_heading(console, name, title)
    if chosen:
        told = ", ".join(f"{key} = {value}" for key, value in chosen.items())
        console.print(f"first member: {told}", soft_wrap=True)
    names = ("time", "± %", "/exact", "error", "wrong %", "agreed", "bias %", "kB")
    rows = [_row(score, measured) for score in measured.scores]
    print_table(console, ("", *names), rows, right=names, collapse_padding=True, pad_edge=False)
    for one in measured.scores:
        for note in one.notes:
            console.print(f"{one.contestant.label}: {note}", style="dim", soft_wrap=True)
    console.print(
        "time: per half-cycle, median, and half the distance of the quartiles; error: of positions"
        " after one rearrangement, median over those with the right events; wrong: rearrangements"
        " with other events than the certified ones; agreed: the first of"
        f" {measured.events_compared} events that agree (*: all that were reached); bias: of the"
        " mean velocity, against exact with the same disorder, with its standard error"
        + (f", over {len(measured.seeds)} seeds" * (len(measured.seeds) > 1))
        + (f"; {measured.left_out} long rearrangements were left out" * bool(measured.left_out))
        + (f"; {measured.no_truth} rearrangements have no truth" * bool(measured.no_truth)),
        style="dim",
        soft_wrap=True,
    )
    console.print(f"[bold]{measured.advice}[/bold]", soft_wrap=True)
    return []


def _row(score: Score, measured: Tradeoff) -> tuple[str, ...]:
    from exactcreep.commands.plan import duration

    spread = (score.seconds_high - score.seconds_low) / (2 * score.seconds)
    bias = "-"
    if score.contestant.solver != "exact" and not math.isnan(score.bias) and measured.velocity:
        scale = 100 / abs(measured.velocity)
        bias = f"{score.bias * scale:.2g}±?"
    if bias != "-" and not math.isnan(score.bias_error):
        places = 1 - math.floor(math.log10(max(score.bias_error * scale, 1e-4)))
        bias = f"{score.bias * scale:.{places}f}±{score.bias_error * scale:.{places}f}"
    agreed = "-" if not score.compared else f"{score.agreed}" + "*" * score.agreed_all
    return (
        score.contestant.short,
        duration(score.seconds),
        "-" if math.isnan(spread) else f"{100 * spread:.0f}",
        "-" if math.isnan(score.ratio) else f"{score.ratio:.3g}",
        "-" if math.isnan(score.error) else f"{score.error:.1e}",
        "-" if not score.compared else f"{100 * score.wrong:.3g}",
        agreed,
        bias,
        f"{score.memory / 1000:.0f}",
    )
