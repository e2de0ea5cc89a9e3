"""``exactcreep tradeoff``: what time buys which accuracy, measured on this machine."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

from exactcreep.commands.answer import Drawing, say, say_heading, say_table, settings_text
from exactcreep.commands.options import parsed_seeds

if TYPE_CHECKING:
    from exactcreep import Scene
    from exactcreep.studies.tradeoff import Score, Tradeoff


def tradeoff(
    scene: Scene, *, budget: str = "60", seeds: str | None = None, output: Drawing
) -> None:
    """Measure what time buys which accuracy, for a scene on this machine.

    Of a scene with several members the first is measured; --set chooses another.

    Examples:

        exactcreep tradeoff six-sliders-cycles --plot tradeoff.png

        exactcreep tradeoff thirty-sliders-cycles --budget 300 --seeds 16 --json

    Parameters
    ----------
    budget : SECONDS
        About how long to measure.
    seeds : SEEDS
        Compare over K seeds, or over those listed: 1,2,3.
    """
    from exactcreep.studies import tradeoff as study

    first = scene.settings()[0]

    def rows(measured: Tradeoff) -> None:
        say_heading(scene.name, scene.title)
        if first:
            say(f"first member: {settings_text(first)}")
        _print(measured)

    measured = partial(
        study.tradeoff, scene.experiment(first), budget=budget, seeds=parsed_seeds(seeds)
    )
    draw, title = "comparison:draw_tradeoff", scene.title or scene.name
    output.answer(measured, draw, rows, {"scene": scene.name, "set": first}, title=title)


def _print(measured: Tradeoff) -> None:
    names = ("time", "± %", "/exact", "error", "wrong %", "agreed", "bias %", "kB")
    rows = [_row(score, measured) for score in measured.scores]
    say_table(("", *names), rows, right=names, collapse_padding=True, pad_edge=False)
    for one in measured.scores:
        for note in one.notes:
            say(f"{one.contestant.label}: {note}", style="dim")
    say(
        "time: per half-cycle, median, and half the distance of the quartiles; error: of positions"
        " after one rearrangement, median over those with the right events; wrong: rearrangements"
        " with other events than the certified ones; agreed: the first of"
        f" {measured.events_compared} events that agree (*: all that were reached); bias: of the"
        " mean velocity, against exact with the same disorder, with its standard error"
        + (f", over {len(measured.seeds)} seeds" * (len(measured.seeds) > 1))
        + (f"; {measured.left_out} long rearrangements were left out" * bool(measured.left_out))
        + (f"; {measured.no_truth} rearrangements have no truth" * bool(measured.no_truth)),
        style="dim",
    )
    say(f"[bold]{measured.advice}[/bold]")


def _row(score: Score, measured: Tradeoff) -> tuple[str, ...]:
    spread = (score.seconds_high - score.seconds_low) / (2 * score.seconds)
    bias = "-"
    if score.contestant.solver != "exact" and not math.isnan(score.bias) and measured.velocity:
        scale = 100 / abs(measured.velocity)
        bias = f"{score.bias * scale:.2g}±?"
        if not math.isnan(score.bias_error):
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


def duration(seconds: float) -> str:
    """Return a time for the eye: ``35 us``, ``1.2 s``, ``3.5 h``; ``-`` if it is not known."""
    if math.isnan(seconds):
        return "-"
    for unit, size in (("us", 1e-6), ("ms", 1e-3), ("s", 1.0)):
        if seconds < 1000 * size and (unit != "s" or seconds < 100):
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds / 60:.3g} min" if seconds < 6000 else f"{seconds / 3600:.3g} h"
