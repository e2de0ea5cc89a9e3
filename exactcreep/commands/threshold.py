"""``exactcreep threshold``: the amplitude above which a chain creeps, to any number of digits."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from exactcreep.commands.options import Json, MaxSeconds
from exactcreep.commands.progress import Display
from exactcreep.commands.session import LIMIT_STATUS

if TYPE_CHECKING:
    from exactcreep.studies.thresholds import Threshold


def threshold(
    n: Annotated[str, typer.Option(metavar="N", help="Number of sliders.")],
    l0: Annotated[
        str, typer.Option(metavar="L0", help="Natural length of a spring, unit g tau_dyn^2.")
    ] = "1000",
    mu_d: Annotated[
        str, typer.Option(metavar="MU", help="Dynamical friction coefficient.")
    ] = "0.5",
    mu_s: Annotated[
        str, typer.Option(metavar="MU", help="Static friction coefficient.")
    ] = "0.6",
    tan_alpha: Annotated[
        str, typer.Option(metavar="T", help="Slope of the incline.")
    ] = "0.25",
    criterion: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            help="horizon: it advances in cycle --cycles; lasting: it creeps for ever.",
        ),
    ] = "horizon",
    cycles: Annotated[
        str | None,
        typer.Option(metavar="K", help="Full cycles before the verdict of horizon; default 20."),
    ] = None,
    digits: Annotated[str, typer.Option(metavar="K", help="Significant digits.")] = "15",
    low: Annotated[
        str | None,
        typer.Option("--from", metavar="A", help="Start of the scan; default half of Eq. (seuil)."),
    ] = None,
    high: Annotated[
        str | None,
        typer.Option("--to", metavar="A", help="End of the scan; default twice Eq. (seuil)."),
    ] = None,
    points: Annotated[str, typer.Option(metavar="M", help="Equal steps of the scan.")] = "1000",
    bracket: Annotated[
        tuple[str, str] | None,
        typer.Option(metavar="LO HI", help="Amplitudes that straddle the edge, instead of a scan."),
    ] = None,
    windows: Annotated[bool, typer.Option("--windows", help="List all edges of the scan.")] = False,
    refine: Annotated[
        str, typer.Option(metavar="K", help="Give the first K edges to all digits.")
    ] = "0",
    start_tension: Annotated[
        str | None, typer.Option(metavar="R0", help="Tension of every spring at the start.")
    ] = None,
    seeds: Annotated[
        str,
        typer.Option(
            metavar="K", help="Also from K seeded starts, tensions up to R0 in size (or 1e-6)."
        ),
    ] = "0",
    solver: Annotated[
        str,
        typer.Option(metavar="NAME", help="Which decides: certified, mpmath or exact (float64)."),
    ] = "certified",
    max_seconds: MaxSeconds = None,
    json: Json = False,
) -> None:
    """Find the amplitude of temperature cycles above which a chain creeps.

    From its start the chain is driven by full cycles +A, -A; it creeps at A if x_G advances by
    more than 1e-6 during the last of them or, with --criterion lasting, if it creeps for ever.

    Examples:

        exactcreep threshold --n 3 --digits 40

        exactcreep threshold --n 5 --criterion lasting --digits 30

        exactcreep threshold --n 5 --windows --refine 3 --json

        exactcreep threshold --n 2 --start-tension 0.01 --digits 1000

    Exit status: 0 found, 2 bad input or no edge, 3 a limit was reached (what was found by then is
    shown).
    """
    from exactcreep.model.chain import Chain
    from exactcreep.studies import thresholds

    chain = Chain(n, l0, mu_d, mu_s, tan_alpha=tan_alpha)
    try:
        with Display(quiet=json) as display:
            found = thresholds.threshold(
                chain,
                criterion=criterion,
                cycles=None if cycles is None else _whole(cycles, "cycles"),
                digits=_whole(digits, "digits"),
                low=low,
                high=high,
                points=_whole(points, "points"),
                bracket=bracket,
                windows=windows,
                refine=_whole(refine, "refine"),
                start_tension=start_tension,
                seeds=_whole(seeds, "seeds"),
                solver=solver,
                progress=display.show,
                max_seconds=max_seconds,
            )
    except thresholds.GivenUp as limit:
        typer.echo(f"exactcreep: {limit}", err=True)
        raise typer.Exit(LIMIT_STATUS) from None
    if json:
        from exactcreep.commands.answer import as_json

        typer.echo(as_json(found.summary()))
    else:
        _print(found)
    if found.reason:
        raise typer.Exit(LIMIT_STATUS)


def _whole(text: str, field: str) -> int:
    from exactcreep.model.numbers import whole_number

    return whole_number(text, field, least=-(10**9))


def _print(found: Threshold) -> None:
    from rich.console import Console
    from rich.table import Table

    console = Console(highlight=False)
    table = Table.grid(padding=(0, 2))

    def row(name: str, text: Any) -> None:
        table.add_row(name, str(text))

    row("paper, Eq. (seuil)", found.law_seuil)
    row("corrected, (N m + D)/(2 l0)", found.law_corrected)
    if found.law_two_sliders is not None:
        row("two sliders, (mu_s c - s)/l0", found.law_two_sliders)
    if found.lower is None and found.reason:
        row("dynamical threshold", "not found yet")
    elif found.lower is None:
        row("dynamical threshold", "none: one slider has no spring, and stays at rest")
    else:
        row("no creep at", found.lower)
        row("creep at", found.upper)
        outcome = found.outcome_at_lower
        rest = _passing(found) if outcome is None else outcome.value
        row("below", f"{rest} ({found.outcome_evidence.value})")
        row("evidence", found.evidence.value)
        stable = f"; with {2 * found.cycles}, {found.stable_digits} digits are the same"
        if found.criterion == "horizon":
            row("cycles", f"{found.cycles}{'' if found.stable_digits is None else stable}")
        for side, fate in zip(("below", "above"), found.fates or (), strict=False):
            if fate is not None and fate.period is not None:
                says = f"{fate.outcome.value} since cycle {fate.settled_after}"
                row(f"for ever {side}", f"{says}, period {fate.period} ({fate.evidence.value})")
    if found.deciding_event is not None:
        sides = found.deciding_event
        row("first event that differs below", _told(sides.at_lower))
        row("first event that differs above", _told(sides.at_upper))
    if found.reason:
        row("incomplete", found.reason)
    console.print(table, soft_wrap=True)
    for edge in found.windows or ():
        says = "begins" if edge.begins else "ends"
        console.print(f"creep {says} between {edge.lower} and {edge.upper}", soft_wrap=True)
    for seed, start in (found.preparations or {}).items():
        says = "none found" if start is None else f"between {start.lower} and {start.upper}"
        console.print(f"start {seed}: {says}", soft_wrap=True)


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
