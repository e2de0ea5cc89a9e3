"""``exactcreep sweep``: every member of a scene, on many cores or many machines."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import Annotated, Any

import typer

import exactcreep
from exactcreep.commands.answer import INTERRUPTED, complain, counted
from exactcreep.commands.options import (
    Force,
    OfScene,
    SolverName,
    Workers,
    command,
    flag,
    option,
    run_settings,
)
from exactcreep.display import Display
from exactcreep.model.outcome import behaviour


@command(draws=True)
def sweep(
    scene: OfScene,
    solver: SolverName = None,
    seeds: Annotated[str | None, option("K", "Run every point with the seeds 0 .. K-1.")] = None,
    workers: Workers = None,
    scheduler: Annotated[
        str | None, option("ADDRESS", "A dask scheduler, e.g. tcp://10.0.0.1:8786.")
    ] = None,
    out: Annotated[
        Path | None, option("DIR", "Directory of the results; default SCENE-sweep.")
    ] = None,
    resume: Annotated[bool, flag("--resume", "Go on with the cells that the directory holds.")] = (
        False
    ),
    plot: Annotated[
        Path | None, option("FILE", "Draw the velocities to this PNG or PDF file.")
    ] = None,
    force: Force = False,
) -> None:
    """Run every member of a scene as a labelled grid, on all cores or on a cluster.

    Every cell is saved when it has finished; a sweep that was stopped goes on with --resume and
    gives the same bits. The grid is written to DIRECTORY/sweep.nc.

    Examples:

        exactcreep sweep chain-plateaus --workers 8 --plot plateaus.png

        exactcreep sweep two-sliders-cycles --set vary.drive.amplitude=[0.005,0.01] --seeds 100

        exactcreep sweep my-scene.toml --scheduler tcp://10.0.0.1:8786 --out plateaus --resume
    """
    from exactcreep.model.numbers import whole_number
    from exactcreep.quasistatic.files import check_plot

    given = run_settings(solver=solver)
    if seeds is not None:
        given["vary.run.seed"] = list(range(whole_number(seeds, "seeds", least=1, most=10**6)))
    wanted = scene.with_settings(given)
    folder = out or Path(f"{wanted.name}-sweep")
    if plot is not None:
        check_plot(plot, force=force)
        if not set(wanted.vary) - {"run.seed"}:
            allowed = "needs something that varies besides the seed"
            raise exactcreep.InputError("plot", str(plot), allowed)
    if workers is not None and scheduler is not None:
        allowed = "cannot be given together with a scheduler"
        raise exactcreep.InputError("workers", workers, allowed)
    count = None if workers is None else whole_number(workers, "workers", least=1)
    with (
        nullcontext() if scheduler is None else _cluster(scheduler) as executor,
        Display(wanted.name) as display,
    ):
        try:
            grid = exactcreep.sweep(
                wanted,
                executor=executor,
                workers=count,
                out=folder,
                resume=resume,
                progress=display.show,
            )
        except KeyboardInterrupt:
            display.stop()
            complain(f"interrupted; --out {folder} --resume goes on")
            raise typer.Exit(INTERRUPTED) from None
    sizes = ", ".join(f"{name} {size}" for name, size in grid["velocity"].sizes.items())
    words = (grid[name].to_numpy().ravel().tolist() for name in ("outcome", "direction"))
    outcomes = counted(
        behaviour(exactcreep.Outcome(one), way) for one, way in zip(*words, strict=True)
    )
    typer.echo(f"{grid['velocity'].size} cells ({sizes or 'one'}): {outcomes}")
    typer.echo(f"written: {folder / 'sweep.nc'}")
    if plot is not None:
        from exactcreep.figures.sweep import draw_sweep

        draw_sweep(grid, plot, title=wanted.title or wanted.name)
        typer.echo(f"written: {plot}")


def _cluster(scheduler: str) -> Any:
    try:
        from exactcreep.studies.dask_cluster import cluster
    except ImportError:
        allowed = "needs dask: pip install 'exactcreep[cluster]'"
        raise exactcreep.InputError("scheduler", scheduler, allowed) from None
    return cluster(scheduler)
