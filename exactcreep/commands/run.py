"""``exactcreep run`` and ``resume``: drive the chain of a scene, or go on from a checkpoint."""

from __future__ import annotations

import json
import warnings
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

import exactcreep
from exactcreep.commands.answer import INTERRUPTED, LIMIT, STALE, as_json, complain, shown
from exactcreep.commands.options import GROUPS, run_settings
from exactcreep.commands.summary import Summary

if TYPE_CHECKING:
    from exactcreep import Creep, Descent, InputError, Scene
    from exactcreep.quasistatic.checkpoint import Checkpoint
    from exactcreep.scene import Member


@dataclass(frozen=True, kw_only=True)
class Session:
    """Where a run goes, and how far.

    Parameters
    ----------
    out : path
        Write the data to this NetCDF file.
    plot : path
        Draw x_G and theta to this PNG, PDF or SVG file.
    every : SECONDS
        How often to write the checkpoint.
    max_events : int
        Give up a member after K events.
    max_seconds : SECONDS
        Give up after so much time.
    max_bytes : BYTES
        Give up a member that records more.
    """

    out: Path | None = None
    plot: Path | None = None
    json: bool = False
    force: bool = False
    every: str = "60"
    max_events: str | None = None
    max_seconds: str | None = None
    max_bytes: str | None = None

    def check(self, members: Sequence[Member], checkpoint: Path | None) -> None:
        """Raise `InputError` unless every file can be written, and no two are the same."""
        from exactcreep.quasistatic.files import check_output, check_picture

        named = {} if checkpoint is None else {checkpoint.resolve(): "checkpoint"}
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
        self, members: Sequence[Member], note: Mapping[str, Any], kept: Checkpoint | None
    ) -> None:
        """Run members, then save, draw and print them; leave with the exit status they make.

        The checkpoint holds the `note`: the scene's name and title, and the settings of members.
        """
        from exactcreep.limits import Limits
        from exactcreep.quasistatic.checkpoint import CheckpointWarning
        from exactcreep.quasistatic.creep import run_members

        limits = Limits.of(self.max_events, self.max_seconds, self.max_bytes)
        self.check(members, None if kept is None else Path(kept.path))
        status = 0
        with shown(quiet=self.json) as display, warnings.catch_warnings():
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
        limited = any(each.outcome is exactcreep.Outcome.LIMIT for each in results)
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
        elif status == INTERRUPTED:
            on = "" if kept is None else f"; exactcreep resume {kept.path} goes on"
            complain(f"interrupted{on}")
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
                    other = None
                    while other is None:  # a third one may take the next name at the same time
                        with suppress(Occupied):
                            save_members(summary.results, free := free_name(self.out))
                            other = free
                    allowed = f"was made by another program meanwhile; this result is in {other}"
                    failure = Occupied("out", str(self.out), allowed)
            if self.plot is not None:
                summary.draw(self.plot)
                written.append(self.plot)
        except exactcreep.InputError as error:
            failure = error
        return written, failure


GROUPS["Session"] = Session


def _descent(results: Sequence[Creep], members: Sequence[Member]) -> Descent | None:
    """Return what a single run comes to in millimetres, if its time is known."""
    solid, seconds = members[0].solid, members[0].time_unit
    if len(members) != 1 or solid is None or seconds is None or not results[0].half_cycles:
        return None
    return exactcreep.Descent.of(solid, results[0], seconds)


def run(
    scene: Scene,
    *,
    solver: str | None = None,
    dt: str | None = None,
    locate: bool | None = None,
    digits: str | None = None,
    seed: str | None = None,
    accuracy: str | None = None,
    record: list[str] | None = None,
    checkpoint: Path | None = None,
    session: Session,
    twin: bool = False,
) -> None:
    """Drive the chain of a scene, or of every member of it.

    Examples:

        exactcreep run two-sliders-cycles

        exactcreep run six-sliders-cycles --set chain.tan_alpha=1/5 --plot run.png

        exactcreep run chain-jumps --out jumps.nc --checkpoint jumps.ckpt

        exactcreep run bristol-roof --plot roof.png

    Exit status: 0 any physical outcome, 2 bad input, 3 a limit was reached, 4 the checkpoint is
    older than the result, 130 Ctrl-C, 143 SIGTERM.

    Parameters
    ----------
    solver : NAME
        exact, reference, mpmath, certified, verlet or sliding. Default: what the scene names, else
        exact.
    dt : DT
        Time step of verlet, unit tau_dyn.
    locate : bool
        Let verlet find events inside a step.
    digits : int
        Decimal digits of mpmath and certified.
    accuracy : X
        End as soon as the mean velocity is known to this relative error, at 95 %; the cycles of the
        scene are the most.
    record : NAMES
        x_G, x, tension, slips, events; repeatable or with commas; or none.
    checkpoint : path
        Keep a file from which `exactcreep resume` goes on.
    twin : bool
        Follow a twin a few roundings off until it parts, however late.
    """
    from exactcreep.quasistatic.checkpoint import Checkpoint

    given = run_settings(
        solver=solver, dt=dt, locate=locate, digits=digits, seed=seed, accuracy=accuracy
    )
    if record is not None:
        names = [name for entry in record for name in entry.split(",") if name]
        given["run.record"] = [] if names == ["none"] else names
    wanted = scene.with_settings(given)
    members = wanted.members()
    varied = as_json([member.settings for member in members])
    note = {"scene": wanted.name, "title": wanted.title, "settings": varied}
    followed = [replace(each, experiment=replace(each.experiment, twin=twin)) for each in members]
    kept = None
    if checkpoint is not None:
        kept = Checkpoint(checkpoint, session.every, force=session.force, note=note)
    session.run(followed, note, kept)


def resume(checkpoint: Path, *, session: Session) -> None:
    """Go on from a checkpoint, bit for bit as if the run had never stopped.

    The file is kept up to date. Limits count anew, except that of the events.

    Example:

        exactcreep resume jumps.ckpt --out jumps.nc

    Parameters
    ----------
    checkpoint : FILE
        What `exactcreep run --checkpoint` kept.
    """
    from exactcreep.quasistatic.checkpoint import Checkpoint
    from exactcreep.scene import Literal, Member

    kept = Checkpoint.read(checkpoint, session.every)
    settings: list[dict[str, Any]] = [{} for _ in kept.experiments]
    if "settings" in kept.note:  # the command line wrote the file
        settings = json.loads(kept.note["settings"], parse_float=Literal)
    members = [Member(*each) for each in zip(settings, kept.experiments, strict=True)]
    session.run(members, {"scene": checkpoint.stem} | dict(kept.note), kept)
