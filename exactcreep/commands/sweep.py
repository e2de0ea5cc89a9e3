"""``exactcreep sweep``: every member of a scene, on many cores or many machines."""

from __future__ import annotations

from collections import Counter
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from exactcreep.commands.options import (
    Force,
    SceneName,
    Settings,
    SolverName,
    Workers,
    parsed_settings,
)
from exactcreep.commands.session import INTERRUPTED_STATUS
from exactcreep.display import Display

if TYPE_CHECKING:
    import xarray as xr


def sweep(
    scene: SceneName,
    settings: Settings = None,
    solver: SolverName = None,
    seeds: Annotated[
        str | None, typer.Option(metavar="K", help="Run every point with the seeds 0 .. K-1.")
    ] = None,
    workers: Workers = None,
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="A dask scheduler, e.g. tcp://10.0.0.1:8786."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Directory of the results; default SCENE-sweep."),
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on with the cells that the directory holds.")
    ] = False,
    plot: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Draw the velocities to this PNG or PDF file."),
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
    from exactcreep.model.numbers import InputError, whole_number
    from exactcreep.quasistatic.files import check_plot
    from exactcreep.scene import load_scene
    from exactcreep.studies.sweep import sweep as run_sweep

    given = parsed_settings(settings)
    if solver is not None:
        given["run.solver"] = solver
    if seeds is not None:
        given["vary.run.seed"] = list(range(whole_number(seeds, "seeds", least=1, most=10**6)))
    wanted = load_scene(scene).with_settings(given)
    folder = out if out is not None else Path(f"{wanted.name}-sweep")
    if plot is not None:
        check_plot(plot, force=force)
        if not set(wanted.vary) - {"run.seed"}:
            raise InputError("plot", str(plot), "needs something that varies besides the seed")
    if workers is not None and scheduler is not None:
        raise InputError("workers", workers, "cannot be given together with a scheduler")
    with ExitStack() as stack:
        executor = None
        if scheduler is not None:
            executor = stack.enter_context(_cluster(scheduler))
        display = stack.enter_context(Display(wanted.name))
        count = None if workers is None else whole_number(workers, "workers", least=1)
        try:
            dataset = run_sweep(
                wanted,
                executor=executor,
                workers=count,
                out=folder,
                resume=resume,
                progress=display.show,
            )
        except KeyboardInterrupt:
            display.stop()
            typer.echo(f"exactcreep: interrupted; --out {folder} --resume goes on", err=True)
            raise typer.Exit(INTERRUPTED_STATUS) from None
    _summarise(dataset, folder)
    if plot is not None:
        from exactcreep.figures.sweep import draw_sweep

        draw_sweep(dataset, plot, title=wanted.title or wanted.name)
        typer.echo(f"written: {plot}")


def _cluster(scheduler: str) -> Any:
    from exactcreep.model.numbers import InputError

    try:
        from exactcreep.studies.dask_cluster import cluster
    except ImportError:
        raise InputError(
            "scheduler", scheduler, "needs dask: pip install 'exactcreep[cluster]'"
        ) from None
    return cluster(scheduler)


def _summarise(dataset: xr.Dataset, folder: Path) -> None:
    sizes = ", ".join(f"{name} {size}" for name, size in dataset["velocity"].sizes.items())
    words = Counter(dataset["outcome"].to_numpy().ravel().tolist())
    told = ", ".join(f"{count} {word}" for word, count in words.most_common())
    typer.echo(f"{dataset['velocity'].size} cells ({sizes or 'one'}): {told}")
    typer.echo(f"written: {folder / 'sweep.nc'}")
