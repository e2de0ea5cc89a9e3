"""``exactcreep compare``: exact, Verlet and certified side by side."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import exactcreep
from exactcreep.commands.answer import Drawing, say, say_heading, say_table
from exactcreep.commands.options import parsed_seeds
from exactcreep.commands.summary import measured

if TYPE_CHECKING:
    from exactcreep import Comparison, Partings, Scene
    from exactcreep.studies.compare import Standing


def compare(
    scene: Scene,
    *,
    dt: str = "0.01",
    locate: bool = False,
    digits: str = "30",
    events: str = "1000",
    seeds: str | None = None,
    dts: str | None = None,
    output: Drawing,
) -> None:
    """Show where exact and Verlet part from the certified solver, with the same disorder.

    With --seeds or --dts: over many seeds and time steps, Verlet without and with located events:
    the first wrong event, the position error before it, orders and biases, with intervals of 95 %.

    Of a scene with several members the first is compared; --set chooses another.

    Examples:

        exactcreep compare six-sliders-cycles --dt 0.01 --plot parting.png

        exactcreep compare thirty-sliders-cycles --events 300 --json

        exactcreep compare six-sliders-cycles --seeds 16 --dts 0.1,0.03,0.01 --plot partings.png

    Parameters
    ----------
    dt : DT
        Time step of verlet, unit tau_dyn.
    locate : bool
        Let verlet find events inside a step.
    digits : int
        Decimal digits of the certified solver.
    events : int
        Certified events to compare.
    seeds : SEEDS
        Compare over K seeds, or over those listed: 1,2,3.
    dts : LIST
        Compare several time steps, e.g. 0.1,0.03,0.01.
    """
    from exactcreep.model.numbers import whole_number

    first = scene.settings()[0]
    study = partial(
        exactcreep.compare,
        scene.experiment(first),
        dt=dt,
        locate=locate,
        digits=whole_number(digits, "digits", least=1),
        events=whole_number(events, "events", least=1),
        seeds=parsed_seeds(seeds),
        dts=None if dts is None else [part.strip() for part in dts.split(",")],
    )

    def rows(found: Comparison | Partings) -> None:
        say_heading(scene.name, scene.title)
        if isinstance(found, exactcreep.Partings):
            _print_partings(found)
        else:
            _print_comparison(found)

    title = scene.title or scene.name
    about = {"scene": scene.name, "set": first}
    output.answer(study, "comparison:draw_compared", rows, about, title=title)


def _print_partings(found: Partings) -> None:
    certified = f"{len(found.seeds)} seeds: {found.events} certified events in all"
    if found.undecided:
        certified += f" ({found.undecided} seeds undecided)"
    velocities = f"velocities over {found.half_cycles} targets each at the least"
    say(f"{certified}; {velocities}")
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
    say_table(("", *names), rows, right=names, pad_edge=False)
    for label, locate in (("Verlet", False), ("with located events", True)):
        order = found.order(locate=locate)
        if order.value == order.value:  # it is known
            told = "{:.2f} ({:.2f} to {:.2f})".format(*order)
            say(f"order of the position error, {label}: {told}")
    say(
        "parted: seeds with a wrong event; after: so many events that agree, median (inf: not met);"
        " wrong: turns, per 1000 events; error: the largest of positions before the wrong"
        " event, median; bias: of the mean velocity, against exact with the same disorder;"
        " intervals are those of 95 %",
        style="dim",
    )


def _print_comparison(found: Comparison) -> None:
    say(
        f"certified: {found.events} events in {found.rearrangements} rearrangements, "
        f"{found.half_cycles} half-cycles ({found.evidence.value})"
    )
    columns = [_rows(standing) for standing in found.contestants]
    names = ["", *(standing.contestant.label for standing in found.contestants)]
    rows = [(key, *(column[key] for column in columns)) for key in columns[0]]
    say_table(names, rows, pad_edge=False)
    for standing in found.contestants:
        if standing.creep.course:
            say(f"{standing.contestant.solver}: {standing.creep.course}")
    errors = found.standard_errors
    if errors == errors:  # it is known
        say(
            f"mean velocities differ by {found.velocity_difference:.3g},"
            f" {abs(errors):.2g} combined standard errors"
        )


def _rows(standing: Standing) -> dict[str, str]:
    """Return what a solver's column says, by the name of the row."""
    run, tie, trusted = standing.creep, standing.tie, standing.creep.trusted_half_cycles
    return {
        "events that agree": str(standing.agreed),
        "first that differs": _told(standing.own) if standing.differs else "none",
        "  certified instead": _told(standing.known) if standing.differs else "",
        "how close the tie": "" if tie is None else f"{tie.condition} off by {tie.margin:.2g}",
        "position error before": f"{standing.error_before:.2g}",
        "position error, largest": f"{standing.error_after:.2g}",
        "velocity": measured(run),
        "slips per half-cycle": f"{run.slip_count / max(run.half_cycles, 1):.4g}",
        "half-cycles": str(run.half_cycles),
        "  of them trusted": "" if trusted is None else str(trusted),
    }


def _told(place: Any) -> str:
    if place is None:
        return "no further event"
    event = place.event
    who = ", ".join(map(str, event.sliders))
    return f"{event.kind.value} {who} in half-cycle {place.half_cycle}"
