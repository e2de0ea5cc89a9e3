"""``exactcreep plan``: what a scene needs, which solver answers it and why, and what it costs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import typer

from exactcreep.commands.answer import (
    LIMIT,
    as_json,
    complain,
    grouped,
    of_members,
    say,
    say_heading,
    say_table,
    settings_text,
    shown,
)
from exactcreep.commands.compare import duration

if TYPE_CHECKING:
    from exactcreep import Plan, Scene

_MOST_IN_FULL = 8  # members; of more one line each is printed


def plan(
    scene: Scene, *, digits: str = "15", max_seconds: str | None = None, json: bool = False
) -> None:
    """Say what a scene needs, which solver answers it and why, what it costs, how far to trust it.

    A solver that the scene names itself is never overridden. Of more than 8 members one line each
    is printed; --json has all of all.

    Examples:

        exactcreep plan six-sliders-cycles

        exactcreep plan two-sliders-cycles --digits 40 --json

    Exit status: 0 planned, 2 bad input, 3 the time was over before every member was planned.

    Parameters
    ----------
    digits : int
        Significant digits that are wanted of the trajectory.
    """
    from exactcreep.studies.plan import plan_scene

    with shown(quiet=json) as display:
        plans = plan_scene(scene, digits=digits, max_seconds=max_seconds, progress=display.show)
    settings = scene.settings()
    if json:
        typer.echo(as_json(of_members(scene.name, settings, [one.summary() for _, one in plans])))
    else:
        say_heading(scene.name, scene.title)
        if len(settings) > _MOST_IN_FULL:
            told = [f"{one.solver}: {one.reason}" for _, one in plans]
            keys = list(settings[0])
            for texts, members in grouped([setting for setting, _ in plans], told):
                many = f" ({len(members)} members)" if len(members) > 1 else ""
                which = settings_text(dict(zip(keys, texts, strict=True)))
                say(f"{which}{many}: {told[members[0]]}")
        else:
            for setting, one in plans:
                if setting:
                    say(settings_text(setting))
                _print(one)
    if len(plans) < len(settings):
        complain(f"max_seconds was reached: {len(plans)} of {len(settings)} members are planned")
        raise typer.Exit(LIMIT)


def _print(plan: Plan) -> None:
    needs = [(one.name, "needed" if one.needed else "not needed", one.reason) for one in plan.needs]
    say_table(("", "", ""), needs, folded=("",), padding=(0, 2), show_header=False)
    say(f"[bold]{plan.solver}[/bold]: {plan.reason}")
    if plan.law:
        values = " or ".join(f"{value:.10g}" for value in plan.law)
        what = "velocity" if plan.solver == "law" else "velocity by the paper's law"
        say(f"{what} per {plan.experiment.drive.per}: {values}")
    if plan.theorems:
        say("amplitudes: " + ", ".join(f"{k} {v:.6g}" for k, v in plan.theorems.items()))
    if not math.isnan(plan.events):
        cost = "not known" if math.isnan(plan.seconds) else f"about {duration(plan.seconds)}"
        say(f"cost: {cost}, from {plan.events:.3g} events (by the first ten half-cycles)")
    elif plan.solver != "law":
        say("cost: not known")
    if plan.course:
        say(f"trust: {plan.course}")
