"""``exactcreep threshold``: the amplitude above which a chain creeps, by four criteria."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from exactcreep.commands.options import (
    DataFile,
    Force,
    Json,
    MaxSeconds,
    Plot,
    StartTension,
    Workers,
    of_chain,
)
from exactcreep.commands.session import LIMIT_STATUS
from exactcreep.display import Display

if TYPE_CHECKING:
    from exactcreep.model.chain import Chain
    from exactcreep.studies.thresholds.edges import Threshold

_EDGES, _STARTS = "Of horizon and lasting: ", "Of survival and intercept: "


@of_chain
def threshold(
    chain: Chain,
    criterion: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="horizon: it advances in cycle --cycles; lasting: it creeps for ever; survival:"
            " half of many starts still creep after --cycles; intercept: the straight part of v(A)"
            " meets zero. Default: horizon with --cycles; intercept with disorder; lasting up to"
            " five sliders, else survival.",
        ),
    ] = None,
    cycles: Annotated[
        str | None,
        typer.Option(
            metavar="K",
            help="Of horizon, default 20; of survival, default 4000; of intercept (for each"
            " amplitude), default 400.",
        ),
    ] = None,
    digits: Annotated[
        str | None,
        typer.Option(metavar="K", help=f"{_EDGES}significant digits, default 15; of survival: 3."),
    ] = None,
    low: Annotated[
        str | None,
        typer.Option(
            "--from",
            metavar="A",
            help="Of all but intercept: start of the scan; default half of Eq. (seuil).",
        ),
    ] = None,
    high: Annotated[
        str | None,
        typer.Option(
            "--to",
            metavar="A",
            help="Of all but intercept: end of the scan; default twice Eq. (seuil).",
        ),
    ] = None,
    points: Annotated[
        str | None,
        typer.Option(
            metavar="M",
            help=f"{_EDGES}equal steps of the scan, default 1000; of intercept: amplitudes,"
            " default 12.",
        ),
    ] = None,
    bracket: Annotated[
        tuple[str, str] | None,
        typer.Option(
            metavar="LO HI",
            help="Of all but intercept: amplitudes that straddle the edge, instead of a scan.",
        ),
    ] = None,
    windows: Annotated[
        bool, typer.Option("--windows", help=f"{_EDGES}list all edges of the scan.")
    ] = False,
    refine: Annotated[
        str | None,
        typer.Option(metavar="K", help=f"{_EDGES}give the first K windows to all digits."),
    ] = None,
    start_tension: StartTension = None,
    seeds: Annotated[
        str | None,
        typer.Option(
            metavar="K",
            help="Of horizon: also from K seeded starts, tensions up to --start-tension in size"
            " (or 1e-6).",
        ),
    ] = None,
    solver: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help=f"{_EDGES}which decides: certified (default), exact (float64); of horizon also"
            " mpmath.",
        ),
    ] = None,
    starts: Annotated[
        str | None, typer.Option(metavar="K", help="Of survival: number of starts, default 40.")
    ] = None,
    size: Annotated[
        str | None,
        typer.Option(
            metavar="R", help=f"{_STARTS}tensions of a start are within (-R, R), default 1e-3."
        ),
    ] = None,
    seed: Annotated[
        str | None, typer.Option(metavar="SEED", help=f"{_STARTS}of starts and disorder.")
    ] = None,
    fit: Annotated[
        tuple[str, str] | None,
        typer.Option(
            metavar="LO HI",
            help="Of intercept: range of the line in units of Eq. (seuil), default 1.2 and 2.",
        ),
    ] = None,
    workers: Workers = None,
    max_seconds: MaxSeconds = None,
    out: DataFile = None,
    json: Json = False,
    plot: Plot = None,
    force: Force = False,
) -> None:
    """Find the amplitude of temperature cycles above which a chain creeps.

    What that means, --criterion says; an option that a criterion does not use is refused.

    Examples:

        exactcreep threshold --n 3 --digits 40

        exactcreep threshold --n 5 --cycles 20 --windows --refine 3 --json

        exactcreep threshold --n 6 --plot survival.png

        exactcreep threshold --n 30 --sigma-mu 0.01 --fit 1.3 2

    Exit status: 0 found, 2 bad input or no edge, 3 a limit was reached, creep does not settle, or
    v(A) is no straight line (what is known is shown).
    """
    from exactcreep.commands.answer import deliver
    from exactcreep.model.numbers import whole_number
    from exactcreep.quasistatic.files import check_output, check_plot
    from exactcreep.studies.thresholds.criteria import threshold as study
    from exactcreep.studies.thresholds.horizon import GivenUp

    if plot is not None:
        check_plot(plot, force=force)
    if out is not None:
        check_output(out, "out", force=force)
    given: dict[str, Any] = {
        "low": low, "high": high, "bracket": bracket, "windows": windows or None,
        "start_tension": start_tension, "solver": solver, "size": size, "fit": fit,
    }  # fmt: skip
    whole = {
        "cycles": cycles, "digits": digits, "points": points, "refine": refine, "seeds": seeds,
        "starts": starts, "seed": seed, "workers": workers,
    }  # fmt: skip
    for name, text in whole.items():
        given[name] = None if text is None else whole_number(text, name, least=-(10**9))
    try:
        with Display(quiet=json) as display:
            found = study(
                chain,
                criterion=criterion,
                progress=display.show,
                max_seconds=max_seconds,
                **given,
            )
    except GivenUp as limit:
        typer.echo(f"exactcreep: {limit}", err=True)
        raise typer.Exit(LIMIT_STATUS) from None
    deliver(found, _print, out=out, plot=plot, draw=_draw, json=json)
    if found.reason:
        raise typer.Exit(LIMIT_STATUS)


def _draw(found: Any, plot: Path) -> None:
    from exactcreep.figures.thresholds import draw_threshold

    draw_threshold(found, plot)


def _print(found: Any) -> None:
    from rich.console import Console
    from rich.table import Table

    console = Console(highlight=False)
    table = Table.grid(padding=(0, 2))
    known = found.summary()
    table.add_row("paper, Eq. (seuil)", str(known["law_seuil"]))
    table.add_row("corrected, (N m + D)/(2 l0)", str(known["law_corrected"]))
    if known["law_two_sliders"] is not None:
        table.add_row("two sliders, (mu_s c - s)/l0", known["law_two_sliders"])
    rows = {"survival": _of_survival, "intercept": _of_intercept}.get(found.criterion, _of_edge)
    for name, text in rows(found):
        table.add_row(name, str(text))
    table.add_row("evidence", found.evidence.value)
    table.add_row("to be compared with", found.compare)
    if found.reason:
        table.add_row("because" if found.criterion == "intercept" else "incomplete", found.reason)
    console.print(table, soft_wrap=True)
    what = _what(found)
    for edge in getattr(found, "windows", None) or ():
        says = "begins" if edge.begins else "ends"
        console.print(f"{what} {says} between {edge.lower} and {edge.upper}", soft_wrap=True)
    for seed, start in (getattr(found, "preparations", None) or {}).items():
        says = "none found" if start is None else f"between {start.lower} and {start.upper}"
        console.print(f"start {seed}: {says}", soft_wrap=True)


def _what(found: Any) -> str:
    """Return what begins at an edge."""
    return f"advance in cycle {found.cycles}" if found.criterion == "horizon" else "creep"


Rows = list[tuple[str, Any]]


def _of_edge(found: Threshold) -> Rows:
    what = _what(found)
    if found.lower is None:
        none = "none: one slider has no spring, and stays at rest"
        return [("threshold", "not found yet" if found.reason else none)]
    outcome = found.outcome_at_lower
    rest = _passing(found) if outcome is None else outcome.value
    rows: Rows = [
        (f"no {what} at", found.lower),
        (f"{what} at", found.upper),
        ("below", f"{rest} ({found.outcome_evidence.value})"),
    ]
    if found.stable_digits is not None:
        rows.append(
            (f"with {2 * found.cycles} cycles", f"{found.stable_digits} digits are the same")
        )
    for side, fate in zip(("below", "above"), found.fates or (), strict=False):
        if fate is not None and fate.period is not None:
            says = f"{fate.outcome.value} since cycle {fate.settled_after}"
            rows.append(
                (f"for ever {side}", f"{says}, period {fate.period} ({fate.evidence.value})")
            )
    if found.deciding_event is not None:
        sides = found.deciding_event
        rows.append(("first event that differs below", _told(sides.at_lower)))
        rows.append(("first event that differs above", _told(sides.at_upper)))
    if found.sensitive:
        rows.append(("float64 alone knows", f"{len(found.sensitive)} amplitudes, where it may err"))
    return rows


def _of_survival(found: Any) -> Rows:
    rows: Rows = []
    if found.amplitude is not None:
        rows.append((f"half still creep after {found.cycles} cycles at", f"{found.amplitude:.9g}"))
    for name, end in (("fewer", found.low), ("more", found.high)):
        shown = "not known" if end is None else f"{end:.9g}"
        rows.append((f"clearly {name} than half (95 %) at", shown))
    return [*rows, ("starts", f"{found.starts} at each of {len(found.shares)} amplitudes")]


def _of_intercept(found: Any) -> Rows:
    rows: Rows = [("amplitudes measured", found.amplitudes.size)]
    if math.isnan(found.intercept):
        return rows
    law = f"  ({found.intercept / found.law_seuil:.4f} of Eq. (seuil))"
    return [
        ("v(A) meets zero at", f"{_with_error(found.intercept, found.error)}{law}"),
        ("  shift over other ranges", f"{found.systematic:.2g}"),
        ("slope", _with_error(found.slope, found.slope_error)),
        (
            "  paper, (N + 3 - 2i) l0",
            "no one i" if math.isnan(found.law_slope) else found.law_slope,
        ),
        ("chi2", f"{found.chi2:.3g} (probability {found.chi2_probability:.3g})"),
        *rows,
    ]


def _with_error(value: float, error: float) -> str:
    return f"{value:.6g}" + ("" if math.isnan(error) else f" ± {error:.2g}")


def _passing(found: Threshold) -> str:
    """Return what is known of a transient."""
    known = found.report.get("transient")
    if known is None:
        return "a transient"
    words = f"a transient: tensions change by {known['change']:.1e} in cycle {known['cycles']}"
    if "power" in known:
        words += f", less and less as cycles^{known['power']:.2f}"
    return words


def _told(place: Any) -> str:
    if place is None:
        return "none"
    event = place.event
    who = ", ".join(
        f"{n} {'down' if sign > 0 else 'up'}"
        for n, sign in zip(event.sliders, event.signs, strict=True)
    )
    return f"{event.kind.value} of {who} in half-cycle {place.half_cycle}"
