"""``exactcreep plan``: what a scene needs, what each solver would cost, and which to take."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any

import typer

from exactcreep.commands.options import Json, SceneName, Settings, parsed_settings

if TYPE_CHECKING:
    from exactcreep.studies.planning import Plan


def plan(
    scene: SceneName,
    accuracy: Annotated[
        str | None,
        typer.Option(
            metavar="X", help="Largest relative error of the mean velocity; default 0.01."
        ),
    ] = None,
    settings: Settings = None,
    json: Json = False,
) -> None:
    """Say what a scene needs, what each solver would cost, and which is the cheapest that will do.

    A solver that the scene names itself is never overridden.

    Examples:

        exactcreep plan six-sliders-cycles

        exactcreep plan chain-jumps --accuracy 1e-3 --json
    """
    from rich.console import Console

    from exactcreep.commands.answer import as_json, print_heading
    from exactcreep.scene import load_scene
    from exactcreep.studies.planning import plan_scene

    wanted = load_scene(scene).with_settings(parsed_settings(settings))
    with Console(stderr=True).status("pilot runs"):
        plans = plan_scene(wanted, accuracy=accuracy)
    if json:
        if len(plans) == 1 and not plans[0][0]:
            typer.echo(as_json({"scene": wanted.name} | plans[0][1].summary()))
        else:
            members = [{"set": dict(setting)} | one.summary() for setting, one in plans]
            typer.echo(as_json({"scene": wanted.name, "members": members}))
        return
    console = Console(highlight=False)
    print_heading(console, wanted.name, wanted.title)
    for setting, one in plans:
        if setting:
            console.print(", ".join(f"{key} = {value}" for key, value in setting.items()))
        _print(console, one)


def _print(console: Any, plan: Plan) -> None:
    from rich.table import Table

    needs = Table(box=None, padding=(0, 2), show_header=False)
    for need in plan.needs:
        needs.add_row(need.name, "needed" if need.needed else "not needed", need.reason)
    console.print(needs)
    ladder = Table(box=None, padding=(0, 2), header_style="bold")
    for name in ("solver", "bias", "known by", "time", "why"):
        ladder.add_column(name, overflow="fold")
    for rung in plan.choice.candidates:
        ladder.add_row(
            ("> " if rung.name == plan.choice.name else "  ") + rung.name,
            _bias(rung.name, rung.error),
            rung.basis,
            duration(plan.costs[rung.name]),
            rung.reason,
        )
    console.print(ladder)
    pilot = plan.choice.pilot
    if pilot is not None:
        console.print(
            f"pilot run: {pilot.half_cycles} half-cycles ({pilot.burn_in} of burn-in),"
            f" {pilot.events} events; exact {pilot.velocity:.6g} ± {pilot.velocity_error:.2g},"
            f" sliding {pilot.sliding:.6g}",
            soft_wrap=True,
        )
    if plan.explicit is not None and plan.explicit != "auto":
        console.print(
            f"the scene names [bold]{plan.explicit}[/bold], and that is what runs; for an accuracy"
            f" of {plan.accuracy:g} {plan.choice.name} would do",
            soft_wrap=True,
        )
    else:
        console.print(
            f"[bold]{plan.choice.name}[/bold] for an accuracy of {plan.accuracy:g}:"
            f" {plan.choice.reason}",
            soft_wrap=True,
        )
    statistical = plan.statistical_error
    if math.isnan(statistical):
        console.print("statistical error of the mean: unknown", soft_wrap=True)
    elif statistical:
        missed = 1.96 * statistical > plan.accuracy
        console.print(
            f"statistical error of the mean over this run: {1.96 * statistical:.2g} at 95 %,"
            " estimated" + ("; the accuracy is not reached by a run this long" if missed else ""),
            soft_wrap=True,
        )
    if plan.course:
        console.print(f"by exact, {plan.course}", soft_wrap=True)
    if plan.choice.name == "law":
        values = " or ".join(f"{value:.10g}" for value in plan.choice.law)
        console.print(f"velocity per half-cycle: {values}")


def _bias(name: str, error: float) -> str:
    """Return the relative bias of a solver's mean velocity in words."""
    if math.isnan(error):
        return "-"
    return "none" if name in ("exact", "certified") else f"{error:.2g}"


def duration(seconds: float) -> str:
    """Return a time for the eye: ``35 us``, ``1.2 s``, ``3.5 h``; ``-`` if it is not known."""
    if math.isnan(seconds):
        return "-"
    for unit, size in (("us", 1e-6), ("ms", 1e-3), ("s", 1.0)):
        if seconds < 1000 * size and (unit != "s" or seconds < 100):
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds / 60:.3g} min" if seconds < 6000 else f"{seconds / 3600:.3g} h"
