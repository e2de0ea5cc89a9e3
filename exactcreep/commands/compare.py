"""``exactcreep compare``: solvers held against the certified one, and what time buys."""

from __future__ import annotations

import math
from functools import partial
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import exactcreep
from exactcreep.commands.answer import Output, say, say_heading, say_table
from exactcreep.commands.options import parsed_seeds
from exactcreep.progress import Hearer

if TYPE_CHECKING:
    import xarray as xr

    from exactcreep import Scene


def compare(
    scene: Scene,
    *,
    dts: str = "0.1,0.03,0.01",
    digits: str = "30",
    events: str | None = None,
    seeds: str | None = None,
    output: Output,
) -> None:
    """Show what each solver is worth beside the certified one, with the same disorder.

    For exact, Verlet without and with located events, and the sliding limit: events that agree,
    the position error before the first wrong one, its order in dt, the bias of the mean velocity
    with an interval of 95 % over the seeds, time per half-cycle and memory.

    Of a scene with several members the first is compared; --set chooses another.

    Examples:

        exactcreep compare six-sliders-cycles

        exactcreep compare thirty-sliders-cycles --events 300 --json

        exactcreep compare six-sliders-cycles --seeds 16 --dts 0.1,0.03,0.01 --plot compared.png

    Parameters
    ----------
    dts : LIST
        Time steps of verlet, unit tau_dyn.
    digits : int
        Decimal digits of the certified solver.
    events : int
        Certified events to compare, of each seed; default by the number of sliders.
    seeds : SEEDS
        Compare over K seeds, or over those listed: 1,2,3; default by the number of sliders.
    """
    from exactcreep.model.numbers import whole_number
    from exactcreep.studies import comparison
    from exactcreep.studies.compare import ladder

    first = scene.settings()[0]
    experiment = scene.experiment(first)
    best = exactcreep.Method("certified", digits=whole_number(digits, "digits", least=1))
    study = partial(
        exactcreep.compare,
        experiment,
        ladder(experiment.chain, [part.strip() for part in dts.split(",")], best),
        truth=None if experiment.chain.slides else best,
        events=None if events is None else whole_number(events, "events", least=1),
        seeds=parsed_seeds(seeds),
    )

    def answer(progress: Hearer) -> SimpleNamespace:
        data = study(progress=progress)
        summary = partial(comparison.summary, data)
        return SimpleNamespace(data=data, dataset=data, summary=summary)

    def rows(found: SimpleNamespace) -> None:
        say_heading(scene.name, scene.title)
        _print(found.data)

    about, title = {"scene": scene.name, "set": first}, scene.title or scene.name
    output.answer(answer, "comparison:draw_compared", rows, about, title=title)


def _print(data: xr.Dataset) -> None:
    from exactcreep.studies.comparison import advice, order, table

    seeds = data.sizes["seed"]
    say(f"{int(data.events.sum())} events of {data.truth}, {seeds} seed{'s' * (seeds > 1)}")
    rows = [_row(name, row) for name, row in table(data).iterrows()]
    names = ("parted", "after", "error", "bias %", "time", "/exact", "kB")
    say_table(("", *names), rows, right=names, collapse_padding=True, pad_edge=False)
    for label, locate in (("Verlet", False), ("with located events", True)):
        fitted = order(data, locate=locate)
        if not math.isnan(fitted.value):
            between = "" if math.isnan(fitted.lower) else " ({1:.2f} to {2:.2f})"
            say(("order of the position error, {3}: {0:.2f}" + between).format(*fitted, label))
    say(
        "parted: seeds with a wrong event; after: so many events that agree, median (inf: none"
        " differs); error: the largest of positions before the wrong event (g tau_dyn^2), median;"
        " bias: of the mean velocity against exact with the same disorder, 95 %; time: per"
        " half-cycle, median",
        style="dim",
    )
    say(f"[bold]{advice(data)}[/bold]")


def _row(name: Any, row: Any) -> tuple[str, ...]:
    bias = "-" if math.isnan(row.bias) else f"{100 * row.bias:+.2g}"
    if not math.isnan(row.bias_error):
        bias += f" ± {100 * row.bias_error:.1g}"
    return (
        name.replace("dt = ", "").replace(",", "").replace(" digits", "").replace("ated", "."),
        f"{row.parted:.0f}",
        "-" if math.isnan(row.agreed) else f"{row.agreed:.0f}",
        "-" if math.isnan(row.error) else f"{row.error:.1e}",
        bias,
        duration(row.seconds),
        "-" if math.isnan(row.ratio) else f"{row.ratio:.3g}",
        f"{row.memory / 1000:.0f}",
    )


def duration(seconds: float) -> str:
    """Return a time for the eye: ``35 us``, ``1.2 s``; ``-`` if it is not known."""
    if math.isnan(seconds):
        return "-"
    unit, size = ("s", 1.0) if seconds >= 1 else ("ms", 1e-3) if seconds >= 1e-3 else ("us", 1e-6)
    return f"{seconds / size:.3g} {unit}"
