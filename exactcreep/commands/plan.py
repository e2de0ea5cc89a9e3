"""``exactcreep plan``: what a scene needs, what each solver would cost, and which to take."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

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
    scene: Scene,
    *,
    accuracy: str | None = None,
    question: str | None = None,
    max_seconds: str | None = None,
    json: bool = False,
) -> None:
    """Say what a scene needs, what each solver would cost, and which is the cheapest that will do.

    A solver that the scene names itself is never overridden. Of more than 8 members one line each
    is printed; --json has all of all.

    Examples:

        exactcreep plan six-sliders-cycles

        exactcreep plan chain-jumps --accuracy 1e-3 --json

        exactcreep plan two-sliders-cycles --question course --accuracy 1e-6

    Exit status: 0 planned, 2 bad input, 3 the time was over before every member was planned.

    Parameters
    ----------
    accuracy : number
        Largest relative error, at 95 %; default 0.01.
    question : NAME
        Of what: velocity (its long-time mean; default) or course (x_G at every target).
    max_seconds : SECONDS
        Come back after so much time.
    json : bool
        Print one JSON object.
    """
    from exactcreep.studies.plan import plan_scene

    with shown(quiet=json) as display:
        plans = plan_scene(
            scene,
            accuracy=accuracy,
            question=question,
            max_seconds=max_seconds,
            progress=display.show,
        )
    settings = scene.settings()
    if json:
        typer.echo(as_json(of_members(scene.name, settings, [one.summary() for _, one in plans])))
    else:
        say_heading(scene.name, scene.title)
        if len(settings) > _MOST_IN_FULL:
            _print_lines(plans)
        else:
            for setting, one in plans:
                if setting:
                    say(settings_text(setting))
                _print(one)
    if len(plans) < len(settings):
        told = f"{len(plans)} of {len(settings)} members are planned"
        complain(f"max_seconds was reached: {told}")
        raise typer.Exit(LIMIT)


def _print_lines(plans: Sequence[tuple[Mapping[str, Any], Plan]]) -> None:
    """Print what plans come to, in one line where that is the same."""
    told = [_told(one) for _, one in plans]
    keys = list(plans[0][0]) if plans else []
    for texts, members in grouped([setting for setting, _ in plans], told):
        each = [plans[number][1] for number in members]
        many = f" ({len(members)} members)" if len(members) > 1 else ""
        line = settings_text(dict(zip(keys, texts, strict=True))) + f"{many}: {told[members[0]]}, "
        line += duration(sum(one.costs[one.choice.taken.name] for one in each))
        first = each[0]
        if not first.accuracy_reached and first.solver == first.choice.taken.name:
            seeds = _number(first.seeds(first.choice.taken))
            line += f"; {seeds} seeds {duration(sum(o.seconds(o.choice.taken) for o in each))}"
        say(line)


def _told(one: Plan) -> str:
    """Return what is the same for all members of a group."""
    reached = "accurate enough" if one.accuracy_reached else "not accurate enough"
    return f"{one.solver}, {reached}: error {_part(one.choice.taken.error)}"


def _print(plan: Plan) -> None:
    choice = plan.choice
    needs = [(one.name, "needed" if one.needed else "not needed", one.reason) for one in plan.needs]
    say_table(("", "", ""), needs, folded=("",), padding=(0, 2), show_header=False)
    names = ("solver", "bias", "known by", "statistical", "time", "seeds", "time for all")
    rungs = [
        (
            ("> " if rung.name == choice.name else "  ") + rung.name,
            _part(rung.bias) if rung.applies else "-",
            rung.known_by if rung.applies else "not applicable",
            _part(rung.statistical),
            duration(plan.costs[rung.name]),
            _number(plan.seeds(rung)) if rung.applies else "-",
            duration(plan.seconds(rung)),
        )
        for rung in choice.candidates
    ]
    say_table(names, rungs, folded=names, padding=(0, 2))
    for rung in choice.candidates:
        say(f"  {rung.name}: {rung.reason}")
    if (pilot := choice.pilot) is not None:
        looked = f" in {pilot.windows} windows" if pilot.windows else ""
        say(
            f"pilot: {pilot.half_cycles} half-cycles{looked} ({pilot.burn_in} of burn-in),"
            f" {pilot.events} events; exact {pilot.velocity:.6g} ± {pilot.velocity_error:.2g},"
            f" sliding {pilot.sliding:.6g}"
        )
    if plan.explicit is not None and plan.explicit != "auto":
        say(
            f"the scene names [bold]{plan.explicit}[/bold], and that is what runs; for an accuracy"
            f" of {plan.accuracy:g} {choice.name} would do"
        )
    else:
        say(f"[bold]{choice.name}[/bold] for an accuracy of {plan.accuracy:g}: {choice.reason}")
    say(_reached(plan))
    if plan.course:
        say(f"by exact, {plan.course}")
    if choice.name == "law":
        values = " or ".join(f"{value:.10g}" for value in choice.law)
        say(f"velocity per half-cycle: {values}")


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
