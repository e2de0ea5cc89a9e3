"""``exactcreep run`` and ``resume``: drive the chain of a scene, or go on from a checkpoint."""

from __future__ import annotations

import json
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import exactcreep
from exactcreep.commands.answer import INTERRUPTED, LIMIT, STALE, as_json, complain
from exactcreep.commands.options import (
    DataFile,
    Force,
    Json,
    MaxSeconds,
    OfScene,
    Seed,
    SolverName,
    argument,
    command,
    flag,
    option,
    run_settings,
)
from exactcreep.commands.summary import Summary
from exactcreep.display import Display

if TYPE_CHECKING:
    from exactcreep import Creep, Descent, InputError
    from exactcreep.quasistatic.checkpoint import Checkpoint
    from exactcreep.scene import Member


@dataclass(frozen=True, kw_only=True)
class Session:
    """Where a run goes, how far, and how often it is saved."""

    out: DataFile = None
    plot: Annotated[Path | None, option("FILE", "Draw x_G and theta to this PNG or PDF file.")] = (
        None
    )
    json: Json = False
    force: Force = False
    checkpoint: Annotated[
        Path | None, option("FILE", "Keep a file from which `exactcreep resume` goes on.")
    ] = None
    every: Annotated[str, option("SECONDS", "How often to write the checkpoint.")] = "60"
    max_events: Annotated[str | None, option("K", "Give up a member after K events.")] = None
    max_seconds: MaxSeconds = None
    max_bytes: Annotated[str | None, option("BYTES", "Give up a member that records more.")] = None

    def check(self, members: Sequence[Member]) -> None:
        """Raise `InputError` unless every file can be written, and no two are the same."""
        from exactcreep.quasistatic.files import check_output, check_picture

        named = {} if self.checkpoint is None else {self.checkpoint.resolve(): "checkpoint"}
        for path, name in ((self.out, "out"), (self.plot, "plot")):
            if path is not None:
                check_output(path, name, force=self.force)
                first = named.setdefault(path.resolve(), name)
                if first != name:
                    allowed = f"must not be the file of --{first}"
                    raise exactcreep.InputError(name, str(path), allowed)
        if self.plot is not None:
            check_picture(self.plot)
            if not any("x_G" in member.experiment.record for member in members):
                allowed = "needs x_G among what is recorded"
                raise exactcreep.InputError("plot", str(self.plot), allowed)

    def run(
        self,
        members: Sequence[Member],
        note: Mapping[str, Any],
        kept: Checkpoint | None = None,
    ) -> None:
        """Run members, then save, draw and print them; leave with the exit status they make.

        The checkpoint holds the `note`: the scene's name and title, and the settings of members.
        """
        from exactcreep.limits import Limits
        from exactcreep.quasistatic.checkpoint import Checkpoint, CheckpointWarning
        from exactcreep.quasistatic.creep import run_members

        limits = Limits.of(self.max_events, self.max_seconds, self.max_bytes)
        if kept is None and self.checkpoint is not None:
            kept = Checkpoint(self.checkpoint, self.every, force=self.force, note=note)
        self.check(members)
        status = 0
        with Display(quiet=self.json) as display, warnings.catch_warnings():
            # the summary and the JSON say what these say, the last line of checkpoints
            for kind in (exactcreep.PhysicsWarning, exactcreep.AccuracyWarning, CheckpointWarning):
                warnings.simplefilter("ignore", kind)
            try:
                results = run_members(
                    [member.experiment for member in members],
                    progress=display.show,
                    limits=limits,
                    checkpoint=kept,
                )
            except exactcreep.Interrupted as interrupted:
                results, status = interrupted.results, INTERRUPTED
        limited = any(one.outcome is exactcreep.Outcome.LIMIT for one in results)
        if not status and (limited or len(results) < len(members)):
            status = LIMIT
        settings = [member.settings for member in members]
        descent = None if status == INTERRUPTED else _descent(results, members)
        scene, title = str(note.get("scene", "")), str(note.get("title", ""))
        summary = Summary(results, settings, scene, title, descent)
        written, failure = self.keep(summary)
        if self.json:
            typer.echo(as_json(summary.as_dict()))
        else:
            summary.print()
            for path in written:
                typer.echo(f"written: {path}")
        if failure is not None:
            raise failure
        if kept is not None and kept.stale:
            complain(f"{kept.stale}; it does not hold the last part")
            status = max(status, STALE)
        elif kept is not None and status == INTERRUPTED:
            complain(f"interrupted; exactcreep resume {kept.path} goes on")
        if status:
            raise typer.Exit(status)

    def keep(self, summary: Summary) -> tuple[list[Path], InputError | None]:
        """Save and draw results; return the files that were written, and what failed.

        The disk may be full: what was computed is told all the same.
        """
        from exactcreep.quasistatic.files import Occupied, free_name
        from exactcreep.quasistatic.result import save_members

        written: list[Path] = []
        failure: InputError | None = None
        try:
            if self.out is not None:
                try:
                    save_members(summary.results, self.out, force=self.force)
                    written.append(self.out)
                except Occupied:  # another program has taken the name during the run
                    other = free_name(self.out)
                    save_members(summary.results, other)
                    told = f"was made by another program meanwhile; this result is in {other}"
                    failure = Occupied("out", str(self.out), told)
            if self.plot is not None:
                summary.draw(self.plot)
                written.append(self.plot)
        except exactcreep.InputError as error:
            failure = error
        return written, failure


def _descent(results: Sequence[Creep], members: Sequence[Member]) -> Descent | None:
    """Return what a single run comes to in millimetres, if its time is known."""
    solid, seconds = members[0].solid, members[0].time_unit
    if len(members) != 1 or solid is None or seconds is None or not results[0].half_cycles:
        return None
    return exactcreep.Descent.of(solid, results[0], seconds)


@dataclass(frozen=True, kw_only=True)
class Resumed(Session):
    """A session that goes on from the checkpoint that it keeps."""

    checkpoint: Annotated[Path, argument("FILE", "What `exactcreep run --checkpoint` kept.")] = (
        field()
    )


@command(draws=True)
def run(
    scene: OfScene,
    *,
    solver: SolverName = None,
    dt: Annotated[str | None, option("DT", "Time step of verlet, unit tau_dyn.")] = None,
    locate: Annotated[
        bool | None, flag("--locate/--no-locate", "Let verlet find events inside a step.")
    ] = None,
    digits: Annotated[str | None, option("K", "Decimal digits of mpmath and certified.")] = None,
    seed: Seed = None,
    record: Annotated[
        list[str] | None,
        option("NAMES", "x_G, x, tension, slips, events; repeatable or with commas; or none."),
    ] = None,
    session: Session,
    twin: Annotated[
        bool, flag("--twin", "Follow a twin a few roundings off until it parts, however late.")
    ] = False,
) -> None:
    """Drive the chain of a scene, or of every member of it.

    Examples:

        exactcreep run two-sliders-cycles

        exactcreep run six-sliders-cycles --set chain.tan_alpha=1/5 --plot run.png

        exactcreep run chain-jumps --out jumps.nc --checkpoint jumps.ckpt

        exactcreep run lead-roof --plot roof.png

    Exit status: 0 any physical outcome, 2 bad input, 3 a limit was reached, 4 the checkpoint is
    older than the result, 130 Ctrl-C, 143 SIGTERM.
    """
    given = run_settings(solver=solver, dt=dt, locate=locate, digits=digits, seed=seed)
    if record is not None:
        names = [name for entry in record for name in entry.split(",") if name]
        given["run.record"] = [] if names == ["none"] else names
    wanted = scene.with_settings(given)
    members = wanted.members()
    varied = as_json([member.settings for member in members])
    note = {"scene": wanted.name, "title": wanted.title, "settings": varied}
    followed = [replace(one, experiment=replace(one.experiment, twin=twin)) for one in members]
    session.run(followed, note)


@command(draws=True)
def resume(session: Resumed) -> None:
    """Go on from a checkpoint, bit for bit as if the run had never stopped.

    The file is kept up to date. Limits count anew, except that of the events.

    Example:

        exactcreep resume jumps.ckpt --out jumps.nc
    """
    from exactcreep.quasistatic.checkpoint import Checkpoint
    from exactcreep.scene import Literal, Member

    kept = Checkpoint.read(session.checkpoint, session.every)
    settings: list[dict[str, Any]] = [{} for _ in kept.experiments]
    if "settings" in kept.note:  # the command line wrote the file
        settings = json.loads(kept.note["settings"], parse_float=Literal)
    members = [Member(*each) for each in zip(settings, kept.experiments, strict=True)]
    session.run(members, {"scene": session.checkpoint.stem} | dict(kept.note), kept)
