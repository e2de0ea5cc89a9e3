"""``exactcreep run`` and ``resume``: run a scene, or continue from a checkpoint."""

from __future__ import annotations

import json
import math
import warnings
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from importlib import import_module
from itertools import chain, islice
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

import exactcreep
from exactcreep.commands.answer import (
    INTERRUPTED,
    LIMIT,
    STALE,
    Answer,
    Output,
    as_json,
    counted,
    grouped,
    of_members,
    say,
    say_heading,
    say_rows,
    say_table,
    shown,
)
from exactcreep.commands.values import (
    File,
    Flag,
    Name,
    Number,
    SceneName,
    Seconds,
    Seed,
    Settings,
    Whole,
    scene_of,
    taken,
)

if TYPE_CHECKING:
    from exactcreep import Creep, Descent, Walk
    from exactcreep.quasistatic.checkpoint import Checkpoint
    from exactcreep.scene import Member
    from exactcreep.watch.limits import Limits


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class Session(Output):
    """The output and the limits of a run.

    Parameters
    ----------
    plot : path
        Draw x_G and theta to this PNG, PDF or SVG file.
    every : SECONDS
        Time between two writings of the checkpoint.
    max_events : int
        Stop a member after K events.
    max_seconds : SECONDS
        Stop after this time.
    """

    every: Seconds = "60"
    max_events: Whole | None = None
    max_seconds: Seconds | None = None

    def limits(self) -> Limits:
        """Return the limits of the command; the time begins now, at its first line."""
        import_module("exactcreep.scene")  # the time to load it does not count
        import_module("exactcreep.studies.members")
        from exactcreep.watch.limits import Limits

        return Limits.of(self.max_events, self.max_seconds)

    def run(
        self,
        limits: Limits,
        settings: Sequence[Mapping[str, Any]],
        members: Iterator[Member],
        note: Mapping[str, Any],
        kept: Checkpoint | None,
    ) -> None:
        """Run members, then save, draw and print them, and exit with their status.

        The `note` of the checkpoint: the scene's name and title, and the settings of members.
        """
        from exactcreep.quasistatic.checkpoint import CheckpointWarning
        from exactcreep.quasistatic.creep_result import save_members
        from exactcreep.studies.members import run_members

        self.check(checkpoint=None if kept is None else Path(kept.path))
        ahead = [*islice(members, _AHEAD)]
        if self.plot and not any("x_G" in member.experiment.record for member in ahead):
            allowed = "needs x_G among the recorded quantities"
            raise exactcreep.InputError("plot", str(self.plot), allowed)
        status, remark = 0, ""
        with shown(quiet=self.json) as display, warnings.catch_warnings():
            warnings.simplefilter("ignore", CheckpointWarning)  # the last line reports it
            try:
                results = run_members(
                    (member.experiment for member in chain(ahead, members)), len(settings),
                    progress=display.show, limits=limits, checkpoint=kept,
                )  # fmt: skip
            except exactcreep.Interrupted as interrupted:
                results, status, remark = interrupted.results, INTERRUPTED, "interrupted"
                remark += f"; exactcreep resume {kept.path} goes on" if kept else ""
        limited = any(each.outcome is exactcreep.Outcome.LIMIT for each in results)
        if not status and (limited or len(results) < len(settings)):
            status = LIMIT
        if kept is not None and kept.stale:
            status, remark = max(status, STALE), f"{kept.stale}; it does not hold the last part"
        scene, title = str(note.get("scene", "")), str(note.get("title", ""))
        whole = len(settings) == 1 and status != INTERRUPTED
        moved = _in_millimetres(results[0], ahead[0]) if whole else None
        summary = of_members(scene, settings, [result.summary() for result in results])
        if moved is not None:
            summary |= {type(moved).__name__.lower(): moved.summary()}

        def draw() -> Any:
            from exactcreep.figures.pipeline import draw_walk
            from exactcreep.figures.run import draw_descent, draw_run

            if isinstance(moved, exactcreep.Walk):
                return draw_walk(moved, title)
            if moved is not None:
                return draw_descent(moved, title)
            return draw_run(results, settings, title)

        def tell() -> None:
            say_heading(scene, title)
            _print(results, settings, moved)

        save = partial(save_members, results)
        self.deliver(Answer(summary, tell, save, draw, status, remark))


DEFAULT = Session()
_AHEAD = 256
"""Members that are made and checked before the first one runs; later members are made in turn."""


def _in_millimetres(result: Creep, member: Member) -> Descent | Walk | None:
    """Return the descent or the walk of a single run, if its units are known."""
    solid, seconds, recorded = member.solid, member.time_unit, member.experiment.record
    if member.pipe is not None and result.half_cycles > 1 and {"x", "tension"} <= {*recorded}:
        return exactcreep.Walk(member.pipe, result)
    if solid is None or seconds is None or not result.half_cycles:
        return None
    return exactcreep.Descent.of(solid, result, seconds)


def run(
    scene: SceneName,
    /,
    *,
    settings: Settings = None,
    solver: Name | None = None,
    dt: Annotated[str | None, taken("DT")] = None,
    locate: bool | None = None,
    digits: Whole | None = None,
    seed: Seed = None,
    accuracy: Number | None = None,
    record: Annotated[list[str] | None, taken("NAMES")] = None,
    checkpoint: File | None = None,
    session: Session = DEFAULT,
    twin: Flag = False,
) -> None:
    """Run a scene: drive its chain, or the chain of every member.

    Exit status: 0 any physical outcome, 2 bad input, 3 a limit was reached, 4 the checkpoint is
    older than the result, 130 Ctrl-C, 143 SIGTERM.

    Parameters
    ----------
    solver : NAME
        exact, certified, verlet or sliding. Default: the solver that the scene names, else exact.
    dt : DT
        Time step of verlet, unit tau_dyn.
    locate : bool
        Let verlet find events inside a step.
    digits : int
        Decimal digits of certified.
    accuracy : X
        Stop when the mean velocity has this relative error, at 95 %, or at the end of the scene's
        drive.
    record : NAMES
        x_G, x, tension, slips, events, rearrangements, slip_table; repeatable or with commas; or
        none.
    checkpoint : path
        Write a file from which exactcreep resume continues.
    twin : bool
        Follow slightly perturbed copies until one differs, however late.

    Examples
    --------
    exactcreep run two-sliders-cycles
    exactcreep run six-sliders-cycles --set chain.tan_alpha=1/5 --plot run.png
    exactcreep run chain-jumps --out jumps.nc --checkpoint jumps.ckpt
    exactcreep run bristol-roof --plot roof.png
    """
    from exactcreep.quasistatic.checkpoint import Checkpoint

    limits = session.limits()
    names = None
    if record is not None:
        names = [name for entry in record for name in entry.split(",") if name]
    wanted = scene_of(
        scene, settings, solver=solver, dt=dt, locate=locate, digits=digits, seed=seed,
        accuracy=accuracy, record=[] if names == ["none"] else names,
    )  # fmt: skip
    varied, note, kept = wanted.settings(), {"scene": wanted.name, "title": wanted.title}, None
    members = (replace(each, experiment=replace(each.experiment, twin=twin))
               for each in wanted.members())  # fmt: skip
    if checkpoint is not None:
        note["settings"] = as_json(varied)
        kept = Checkpoint(checkpoint, session.every, force=session.force, note=note)
    session.run(limits, varied, members, note, kept)


def resume(checkpoint: Path, /, *, session: Session = DEFAULT) -> None:
    """Continue from a checkpoint, bit for bit as if the run had never stopped.

    The file is kept up to date. Limits start again, except the limit of events.

    Parameters
    ----------
    checkpoint : FILE
        File from `exactcreep run --checkpoint`.

    Examples
    --------
    exactcreep resume jumps.ckpt --out jumps.nc
    """
    from exactcreep.quasistatic.checkpoint import Checkpoint
    from exactcreep.scene import Literal, Member

    limits = session.limits()
    kept = Checkpoint.read(checkpoint, session.every)
    settings: list[dict[str, Any]] = [{} for _ in kept.experiments]
    with kept.refused():
        if "settings" in kept.note:  # the command line wrote the file
            settings = json.loads(kept.note["settings"], parse_float=Literal)
        pairs = zip(settings, kept.experiments, strict=True)
        members = [Member(dict(setting), experiment) for setting, experiment in pairs]
    session.run(limits, settings, iter(members), {"scene": checkpoint.stem} | kept.note, kept)


# --- printing a run -------------------------------------------------------------------------------


def _number_or_range(name: str, value: Any) -> str:
    """Return a parameter of a chain; a list as its least and largest value, end forces as both."""
    if name == "end_forces":
        return " and ".join(f"{float(force):.6g}" for force in value)
    ends = dict.fromkeys([min(value), max(value)] if isinstance(value, list) else [value])
    return " to ".join(f"{float(end):.6g}" for end in ends)


def _print(
    results: Sequence[Creep], settings: Sequence[Mapping[str, Any]], moved: Descent | Walk | None
) -> None:
    first = results[0]
    known = [pair for pair in first.chain.parameters().items() if pair[0] != "n"]
    numbers = "".join(f", {name} = {_number_or_range(name, value)}" for name, value in known)
    options = "".join(f", {name} = {v}" for name, v in first.experiment.options.items())
    say(
        f"{'first member: ' * bool(settings[0])}N = {first.chain.n}{numbers};"
        f" solver {first.solver}{options}, seed {first.seed}"
    )
    if len(settings) > 1 or settings[0]:
        _print_members(results, settings)
    else:
        _print_one(first, moved)


def _measured(result: Creep, digits: int = 6) -> str:
    from exactcreep.model.numbers import with_error

    value, error, known = result.velocity, result.velocity_error, result.velocity_enclosure
    if result.velocity_text is not None and known is not None:
        radius = f", known to {known.radius_text()}" if known.radius else ""
        return f"{result.velocity_text} (standard error {error:.2g}{radius})"
    if not math.isfinite(value):
        return "not known" if math.isnan(value) else "unbounded"
    if math.isnan(error):
        return f"{value:.{digits}g}"
    return with_error(value, error)


def _predicted(result: Creep, digits: int) -> tuple[str, str]:
    """Return the label of the paper's equation for a run, and its velocities where it holds."""
    from exactcreep.laws import prediction

    found = prediction(result.chain, result.drive)
    if found is None:
        return "", ""
    slope = result.chain.tan_alpha  # below its threshold the equation gives uphill velocities
    holds = slope == 0 or any(value * slope > 0 for value in found.printed)
    values = found.printed if holds else ()
    return found.label, " or ".join(f"{value:.{digits}g}" for value in values)


def _held(result: Creep) -> str:
    """Return the velocity of the law that holds for a run, its deviation, and its name."""
    from exactcreep.laws import prediction

    experiment = result.experiment
    found = prediction(result.chain, result.drive, experiment.start)
    if found is None or result.solver == "sliding":
        return ""
    values = " or ".join(f"{value:.6g}" for value in found.values)
    off = f" ± {found.deviation:.2g}" if found.deviation > 0 else ""
    return f"{values}{off} ({found.law})"


def _print_one(result: Creep, moved: Descent | Walk | None) -> None:
    rows: list[tuple[str, Any]] = [
        ("outcome", result.sentence),
        ("trajectory", known_text(result)),
        (f"velocity per {result.drive.per}", _measured(result)),
        ("  of", result.velocity_of),
    ]
    rows += [("  but", result.metastable)] if result.metastable else []
    if result.velocity_reason and math.isfinite(result.velocity):
        rows.append(("  standard error", f"not known: {result.velocity_reason}"))
    elif math.isnan(result.velocity):
        rows.append(("  because", result.velocity_reason))
    label, law = _predicted(result, 6)
    rows += [(f"  paper, {label}", law or "none: below its threshold")] if label else []
    rows += [("  law that holds", held)] if (held := _held(result)) else []
    rows += [] if moved is None else moved.lines()
    if "accuracy" in result.report:
        from exactcreep.quasistatic.creep import accuracy_reached

        rows.append(("accuracy", accuracy_reached(result.report)))
    target = "half-cycles" if result.drive.cyclic else "targets"
    reached = f"{result.half_cycles} {target}, {result.rearrangements} rearrangements"
    rows.append(("counts", f"{reached}, {result.event_count} events, {result.slip_count} slips"))
    rows += [("outside the model", text) for text in _outside(result.warnings)]
    say_rows([*rows, ("time", f"{result.seconds:.3g} s")])


def known_text(result: Creep) -> str:
    """Return up to where a trajectory is known, and what holds beyond, in words."""
    from exactcreep.model.outcome import Evidence, Outcome

    until, ties = result.known_until, result.report["undecided"]
    settled = f"; the model's rules settled {ties} ties" if ties else ""
    if result.evidence is Evidence.PROVED:
        return "proved"
    if result.evidence is Evidence.COMPUTED:
        return "known to 1e-9 to the end" + settled
    reach = f"up to {'half-cycle' if result.drive.cyclic else 'target'} {until}"
    known = f"known to 1e-9 {reach if until else 'at its start only'}"
    if result.velocity_error == 0:
        return f"{known}; the outcome is where float64 ended{settled}"
    if result.outcome in (Outcome.RUNAWAY, Outcome.LIMIT):
        return known + settled
    return f"{known}; the mean velocity holds for the whole run{settled}"


def _behaviour(result: Creep) -> str:
    from exactcreep.model.outcome import with_direction

    return with_direction(result.outcome, result.direction)


def _outside(warnings: Mapping[str, int]) -> list[str]:
    from exactcreep.quasistatic.creep import PHYSICS

    return [f"{PHYSICS[name]} ({count} times)" for name, count in warnings.items()]


def _print_members(results: Sequence[Creep], settings: Sequence[Mapping[str, Any]]) -> None:
    cells = [
        (_measured(result, 4), _predicted(result, 4)[1], _behaviour(result), str(result.slip_count))
        for result in results
    ]
    rows = [
        (*setting, *cells[members[0]], f"({len(members)} members)" * (len(members) > 1))
        for setting, members in grouped(settings, cells)
    ]
    keys = [key.rpartition(".")[2] for key in settings[0]]
    names = (*keys, "velocity", "paper", "outcome", "slips", "")
    say_table(names, rows, right=("paper", "slips"), folded=keys)
    missing = len(settings) - len(results)
    say(
        f"{len(results)} member{'s' * (len(results) > 1)}: {counted(row[2] for row in cells)}"
        + (f"; {missing} not run" if missing else "")
        + f"; {sum(result.seconds for result in results):.3g} s"
    )
    say(f"trajectories: {counted(run.evidence.value for run in results)}")
    if sentences := [result.metastable for result in results if result.metastable]:
        say(f"of {len(results)} members {len(sentences)} creep, but {sentences[0]}")
    for text in _outside(sum((Counter(result.warnings) for result in results), Counter())):
        say(f"outside the model: {text}")
