"""A session: run experiments under a progress bar, then save, draw and print what came of them."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from exactcreep.display import Display

if TYPE_CHECKING:
    from exactcreep.limits import Limits
    from exactcreep.quasistatic.creep import Keeper
    from exactcreep.quasistatic.experiment import Experiment
    from exactcreep.quasistatic.result import Creep
    from exactcreep.solid import Descent, Solid

LIMIT_STATUS = 3
STALE_STATUS = 4
INTERRUPTED_STATUS = 130


def run_session(
    experiments: Sequence[Experiment],
    settings: Sequence[Mapping[str, Any]],
    *,
    scene: str,
    title: str,
    limits: Limits,
    keeper: Keeper | None,
    captured: Sequence[Mapping[str, Any] | None] | None = None,
    out: Path | None,
    plot: Path | None,
    as_json: bool,
    force: bool,
    solids: Sequence[tuple[Solid | None, float | None]] = (),
) -> None:
    """Run the experiments, then save, draw and print; leave with the exit status they make.

    Of a single run, what its solid does in millimetres is drawn and printed, too: `solids` says
    which, and how many seconds one unit of its drive's clock lasts.

    Raises
    ------
    typer.Exit
        With 3 after a limit, 4 if the checkpoint is older than the result, 130 after Ctrl-C.
    """
    from exactcreep.commands import answer
    from exactcreep.model.numbers import InputError
    from exactcreep.model.outcome import Outcome
    from exactcreep.quasistatic.creep import (
        AccuracyWarning,
        CheckpointWarning,
        Interrupted,
        PhysicsWarning,
        run_members,
    )
    from exactcreep.quasistatic.files import Occupied, check_output, check_picture, free_name
    from exactcreep.quasistatic.result import save_members

    named = {} if keeper is None else {Path(keeper.path).resolve(): "checkpoint"}
    for path, option in ((out, "out"), (plot, "plot")):
        if path is not None:
            check_output(path, option, force=force)
            first = named.setdefault(path.resolve(), option)
            if first != option:
                raise InputError(option, str(path), f"must not be the file of --{first}")
    if plot is not None:
        check_picture(plot)
        if not any("x_G" in experiment.record for experiment in experiments):
            raise InputError("plot", str(plot), "needs x_G among what is recorded")
    status = 0
    results: list[Creep]
    with Display(quiet=as_json) as display, warnings.catch_warnings():
        # the summary and the JSON say what these say, the last line of checkpoints
        for kind in (PhysicsWarning, AccuracyWarning, CheckpointWarning):
            warnings.simplefilter("ignore", kind)
        try:
            results = run_members(
                experiments,
                progress=display.show,
                limits=limits,
                keeper=keeper,
                captured=captured,
            )
        except Interrupted as interrupted:
            results = interrupted.results
            status = INTERRUPTED_STATUS
    over = len(results) < len(experiments) or any(one.outcome is Outcome.LIMIT for one in results)
    if status == 0 and over:
        status = LIMIT_STATUS
    descent = None if status == INTERRUPTED_STATUS else _descent(results, solids)
    written: list[Path] = []
    failure: InputError | None = None
    try:
        if out is not None:
            try:
                save_members(results, out, force=force)
            except Occupied:  # another program has taken the name during the run
                other = free_name(out)
                save_members(results, other)
                sentence = f"was made by another program meanwhile; this result is in {other}"
                failure = Occupied("out", str(out), sentence)
            else:
                written.append(out)
        if plot is not None:
            from exactcreep.figures.style import draw_descent, draw_run

            if descent is not None:
                draw_descent(descent, plot, title=title)
            else:
                draw_run(results, plot, settings=settings, title=title)
            written.append(plot)
    except InputError as error:
        failure = error  # the disk may be full: what was computed is told all the same
    if as_json:
        shown = answer.json_of_run(results, settings, scene)
        if descent is not None:
            shown["descent"] = descent.summary()
        typer.echo(answer.as_json(shown))
    else:
        answer.print_summary(results, settings, scene, title, descent)
        for path in written:
            typer.echo(f"written: {path}")
    if failure is not None:
        raise failure
    if keeper is not None and keeper.stale:
        typer.echo(f"exactcreep: {keeper.stale}; it does not hold the last part", err=True)
        status = status if status == INTERRUPTED_STATUS else STALE_STATUS
    elif status == INTERRUPTED_STATUS and keeper is not None:
        typer.echo(f"exactcreep: interrupted; exactcreep resume {keeper.path} goes on", err=True)
    if status:
        raise typer.Exit(status)


def _descent(
    results: Sequence[Creep], solids: Sequence[tuple[Solid | None, float | None]]
) -> Descent | None:
    """Return what a single run comes to in millimetres, if its time is known."""
    from exactcreep.solid import Descent

    if len(solids) != 1 or not results or not results[0].half_cycles:
        return None
    ((solid, seconds),) = solids
    if solid is None or seconds is None:
        return None
    return Descent.of(solid, results[0], seconds)
