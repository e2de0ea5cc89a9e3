"""``exactcreep plan``: what a scene needs, what each solver would cost, and which to take."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer

from exactcreep.commands.options import (
    Json,
    MaxSeconds,
    SceneName,
    Settings,
    parsed_settings,
)
from exactcreep.commands.session import LIMIT_STATUS
from exactcreep.display import Display

_MOST_IN_FULL = 8  # members; of more one line each is printed

if TYPE_CHECKING:
    from exactcreep.studies.plan import Plan


def plan(
    scene: SceneName,
    accuracy: Annotated[
        str | None,
        typer.Option(
            metavar="X", help="Largest relative error, at 95 %; default 0.01."
        ),
    ] = None,
    question: Annotated[
        str | None,
        typer.Option(
            metavar="Q",
            help="Of what: velocity (its long-time mean; default) or course (x_G at every target).",
        ),
    ] = None,
    settings: Settings = None,
    max_seconds: MaxSeconds = None,
    json: Json = False,
) -> None:
    """Say what a scene needs, what each solver would cost, and which is the cheapest that will do.

    A solver that the scene names itself is never overridden. Of more than 8 members one line each
    is printed; --json has all of all.

    Examples:

        exactcreep plan six-sliders-cycles

        exactcreep plan chain-jumps --accuracy 1e-3 --json

        exactcreep plan two-sliders-cycles --question course --accuracy 1e-6

    Exit status: 0 planned, 2 bad input, 3 the time was over before every member was planned.
    """
    from rich.console import Console

    from exactcreep.commands.answer import as_json, print_heading
    from exactcreep.scene import load_scene
    from exactcreep.studies.plan import plan_scene

    wanted = load_scene(scene).with_settings(parsed_settings(settings))
    with Display(quiet=json) as display:
        plans = plan_scene(
            wanted,
            accuracy=accuracy,
            question=question,
            max_seconds=max_seconds,
            progress=display.show,
        )
    members = len(wanted.settings())
    if json:
        if members == 1 and plans and not plans[0][0]:
            typer.echo(as_json({"scene": wanted.name} | plans[0][1].summary()))
        else:
            summaries = [{"set": dict(setting)} | one.summary() for setting, one in plans]
            typer.echo(as_json({"scene": wanted.name, "members": summaries}))
    else:
        console = Console(highlight=False)
        print_heading(console, wanted.name, wanted.title)
        plans_in_full = plans
        if members > _MOST_IN_FULL:
            _print_lines(console, plans)
            plans_in_full = []
        for setting, one in plans_in_full:
            if setting:
                console.print(_named(setting))
            _print(console, one)
    if len(plans) < members:
        told = f"max_seconds was reached: {len(plans)} of {members} members are planned"
        typer.echo(f"exactcreep: {told}", err=True)
        raise typer.Exit(LIMIT_STATUS)


def _named(setting: Mapping[str, Any]) -> str:
    return ", ".join(f"{key} = {value}" for key, value in setting.items())


def _print_lines(console: Any, plans: Sequence[tuple[Mapping[str, Any], Plan]]) -> None:
    """Print what plans come to, in one line where that is the same."""
    from exactcreep.commands.answer import grouped

    told = [_told(one) for _, one in plans]
    keys = list(plans[0][0]) if plans else []
    for texts, members in grouped([setting for setting, _ in plans], told):
        named = ", ".join(f"{key} = {text}" for key, text in zip(keys, texts, strict=True))
        each = [plans[number][1] for number in members]
        many = f" ({len(members)} members)" if len(members) > 1 else ""
        line = f"{named}{many}: {told[members[0]]}, "
        line += duration(sum(one.costs[one.choice.taken.name] for one in each))
        first = each[0]
        if not first.accuracy_reached and first.solver == first.choice.taken.name:
            seeds = _number(first.seeds(first.choice.taken))
            line += f"; {seeds} seeds {duration(sum(o.seconds(o.choice.taken) for o in each))}"
        console.print(line, soft_wrap=True)


def _told(one: Plan) -> str:
    """Return what is the same for all members of a group."""
    reached = "accurate enough" if one.accuracy_reached else "not accurate enough"
    return f"{one.solver}, {reached}: error {_part(one.choice.taken.error)}"


def _print(console: Any, plan: Plan) -> None:
    from rich.table import Table

    needs = Table(box=None, padding=(0, 2), show_header=False)
    for need in plan.needs:
        needs.add_row(need.name, "needed" if need.needed else "not needed", need.reason)
    console.print(needs)
    ladder = Table(box=None, padding=(0, 2), header_style="bold")
    columns = ("solver", "bias", "known by", "statistical", "time", "seeds", "time for all")
    for name in columns:
        ladder.add_column(name, overflow="fold")
    for rung in plan.choice.candidates:
        ladder.add_row(
            ("> " if rung.name == plan.choice.name else "  ") + rung.name,
            _part(rung.bias) if rung.applies else "-",
            rung.known_by if rung.applies else "not applicable",
            _part(rung.statistical),
            duration(plan.costs[rung.name]),
            _number(plan.seeds(rung)) if rung.applies else "-",
            duration(plan.seconds(rung)),
        )
    console.print(ladder)
    for rung in plan.choice.candidates:
        console.print(f"  {rung.name}: {rung.reason}", soft_wrap=True)
    pilot = plan.choice.pilot
    if pilot is not None:
        looked = f" in {pilot.windows} windows" if pilot.windows else ""
        console.print(
            f"pilot: {pilot.half_cycles} half-cycles{looked} ({pilot.burn_in} of burn-in),"
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
    console.print(_reached(plan), soft_wrap=True)
    if plan.course:
        console.print(f"by exact, {plan.course}", soft_wrap=True)
    if plan.choice.name == "law":
        values = " or ".join(f"{value:.10g}" for value in plan.choice.law)
        console.print(f"velocity per half-cycle: {values}")


def _reached(plan: Plan) -> str:
    """Return whether the scene's own run is accurate enough, and what would be."""
    from exactcreep.model.drive import Listed

    drive, taken = plan.experiment.drive, plan.choice.taken
    length = f"{drive.half_cycles} " + ("half-cycles" if drive.cyclic else "targets")
    if plan.accuracy_reached:
        return f"{length} reach the accuracy"
    needed = plan.seeds(taken)
    if math.isnan(needed):
        return f"{length} are not known to reach the accuracy: the error is unknown"
    if math.isinf(needed) or plan.solver != taken.name:
        return f"{length} are not known to reach the accuracy"
    longer = "" if isinstance(drive, Listed) else f", or {_number(needed)} times as many"
    return f"{length} do not reach the accuracy; {_number(needed)} seeds{longer} do"


def _part(error: float) -> str:
    return "?" if math.isnan(error) else "none" if error == 0 else f"{error:.2g}"


def _number(count: float) -> str:
    """Return a number of seeds: ``?`` if it is not known, ``-`` if none is enough."""
    if math.isnan(count):
        return "?"
    return "-" if math.isinf(count) else f"{count:.0f}" if count < 10**6 else f"{count:.1e}"


def duration(seconds: float) -> str:
    """Return a time for the eye: ``35 us``, ``1.2 s``, ``3.5 h``; ``-`` if it is not known."""
    if math.isnan(seconds):
        return "-"
    for unit, size in (("us", 1e-6), ("ms", 1e-3), ("s", 1.0)):
        if seconds < 1000 * size and (unit != "s" or seconds < 100):
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds / 60:.3g} min" if seconds < 6000 else f"{seconds / 3600:.3g} h"
