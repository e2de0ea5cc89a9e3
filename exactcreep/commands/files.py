"""Commands about scenes and saved runs: list, show, export, animate, explore, sweep."""

from __future__ import annotations

import webbrowser
from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

import exactcreep
from exactcreep.commands.answer import as_json, complain, counted, shown
from exactcreep.commands.options import chosen, run_settings

if TYPE_CHECKING:
    from exactcreep import Scene


_LARGE = 100e6  # bytes of a table that are worth a warning
_SOME = 1000  # rows that tell how long the others are


def scenes(*, show: str | None = None, json: bool = False) -> None:
    """List the built-in scenes, or print one as a start for your own.

    A scene is a TOML file: a chain, its drive, what is recorded, and what varies.

    Example:

        exactcreep scenes --show chain-jumps > my-scene.toml

    Parameters
    ----------
    show : NAME
        Print the TOML text of this scene.
    """
    from exactcreep.scene import builtin_scenes

    texts = builtin_scenes()
    if show is not None:
        if show not in texts:
            raise exactcreep.InputError("show", show, one_of(show, texts))
        typer.echo(as_json({"name": show, "toml": texts[show]}) if json else texts[show], nl=json)
        return
    found = [exactcreep.load_scene(name) for name in texts]
    if json:
        listed = [
            {"name": scene.name, "title": scene.title, "members": len(scene.settings())}
            for scene in found
        ]
        typer.echo(as_json({"scenes": listed}))
        return
    width = max(len(scene.name) for scene in found)
    for scene in found:
        typer.echo(f"{scene.name:<{width}}  {scene.title}")


def one_of(name: str, known: Sequence[str] | dict[str, Any]) -> str:
    """Return what is allowed, and the name that was meant."""
    import difflib

    near = difflib.get_close_matches(name, known, 1, 0.5)
    return "must be one of " + ", ".join(known) + (f" (did you mean {near[0]}?)" if near else "")


def show(
    run: Path,
    *,
    half_cycle: str | None = None,
    window: str = "200",
    member: str = "1",
    out: Path | None = None,
    force: bool = False,
) -> None:
    """Draw x_G(t), the slips in space and time, and the tensions and forces at one moment.

    What the run did not record is computed again from its parameters, bit for bit.

    Examples:

        exactcreep show run.nc

        exactcreep show run.nc --half-cycle 37 --window 40 --out moment.pdf

    Parameters
    ----------
    half_cycle : int
        Look at the end of half-cycle K; default the last.
    window : int
        Half-cycles in the space-time diagram, at most.
    out : path
        PNG, PDF or SVG file; default RUN.png.
    """
    import matplotlib as mpl

    from exactcreep.figures.run_view import draw_portrait, portrait
    from exactcreep.figures.style import STYLE, save_picture
    from exactcreep.model.numbers import whole_number
    from exactcreep.quasistatic.files import check_plot
    from exactcreep.quasistatic.result import load_members

    members = load_members(run)
    target = out or run.with_suffix(".png")
    check_plot(target, force=force)
    wide = whole_number(window, "window", least=1)
    seen = chosen(members, member)
    wanted = None
    if half_cycle is not None:
        wanted = whole_number(half_cycle, "half_cycle", least=0, most=seen.half_cycles)
    with mpl.rc_context(STYLE):
        save_picture(draw_portrait(portrait(seen, wanted, wide)), target)
    if seen.course:
        typer.echo(f"{seen.evidence.value}: {seen.course}")
    typer.echo(f"written: {target}")


def export(
    run: Path, *, to: Path, table: str = "half_cycles", member: str = "1", force: bool = False
) -> None:
    """Write one table of a saved run as CSV or Parquet.

    What was recorded (run.record of the scene) is there: one row for each half-cycle, event and
    slider, rearrangement, or slip. Parquet needs pyarrow: the extra "export".

    Examples:

        exactcreep export run.nc --table events --to events.parquet

        exactcreep export run.nc --table rearrangements --to avalanches.csv

    Parameters
    ----------
    to : path
        CSV or Parquet file.
    table : NAME
        half_cycles, events, rearrangements or slip_table.
    """
    from exactcreep.quasistatic.export import check_ending
    from exactcreep.quasistatic.export import table as recorded
    from exactcreep.quasistatic.files import check_output
    from exactcreep.quasistatic.result import load_members

    ending = check_ending(to)
    check_output(to, "to", force=force)
    saved = chosen(load_members(run), member)
    data = recorded(saved, table)
    size: float = data.nbytes
    if ending == ".csv" and size > _LARGE / 4:
        rows_of = max(data.sizes, key=lambda name: data.sizes[name])
        some = data.isel({rows_of: slice(-_SOME, None)})
        size = len(some.to_dataframe().to_csv()) * data.sizes[rows_of] / some.sizes[rows_of]
    if size > _LARGE:
        complain(f"{to} will have about {size / 1e6:.0f} MB")
    rows = saved.export(table, to, force=force)
    typer.echo(f"written: {to} ({rows} rows)")


def animate(
    scene: Scene,
    *,
    rearrangement: str | None = None,
    solver: str | None = None,
    seed: str | None = None,
    member: str = "1",
    frames: str | None = None,
    max_seconds: str | None = None,
    out: Path | None = None,
    force: bool = False,
) -> None:
    """Draw one avalanche exactly as it moves, from its closed form.

    A page shows the run around it, too, and plays the avalanche at any speed; it needs no network.

    Rearrangements are numbered from 0 along the drive, as in a run that records its events.

    Examples:

        exactcreep animate six-sliders-cycles --rearrangement 5 --out avalanche.gif

        exactcreep animate thirty-sliders-cycles --out avalanche.html

    Parameters
    ----------
    rearrangement : int
        Its number, from 0; default the one with most events in 100 half-cycles.
    frames : int
        Pictures of the GIF file; default 120.
    max_seconds : number
        Give up looking for the rearrangement after so much time.
    out : path
        GIF file, or .html: a page; default SCENE-K.gif.
    """
    from exactcreep.figures.animation import draw_avalanche, find_avalanche, largest_avalanche
    from exactcreep.limits import Limits
    from exactcreep.model.numbers import whole_number
    from exactcreep.quasistatic.files import check_output, write_file

    wanted = scene.with_settings(run_settings(solver=solver, seed=seed))
    experiment = chosen(wanted.members(), member).experiment
    ending = out.suffix.lower() if out is not None else ".gif"
    if ending not in (".gif", ".html"):
        raise exactcreep.InputError("out", str(out), "must end in .gif or .html")
    if ending == ".html" and frames is not None:
        allowed = "are those of a GIF file: a page moves without them"
        raise exactcreep.InputError("frames", frames, allowed)
    count = whole_number(frames or "120", "frames", least=2, most=10_000)
    limits = Limits.of(max_seconds=max_seconds)
    if rearrangement is None:
        number = largest_avalanche(experiment, limits=limits)
    else:
        number = whole_number(rearrangement, "rearrangement", least=0)
    target = out or Path(f"{wanted.name}-{number}.gif")
    check_output(target, "out", force=force)
    avalanche = find_avalanche(experiment, number, limits)
    if ending == ".html":
        from exactcreep.figures.explorer import saved

        write_file(target, saved(avalanche).encode(), "out", force=force)
    else:
        draw_avalanche(avalanche, target, frames=count)
    motion = avalanche.rearrangement
    typer.echo(
        f"rearrangement {number}, half-cycle {avalanche.half_cycle}:"
        f" {len(motion.events)} events in {float(motion.duration):.4g} tau_dyn"
    )
    typer.echo(f"written: {target}")


def explore(*, port: str = "0", browser: bool = True) -> None:
    """Play with a chain in the browser: sliders for its parameters, avalanches that move.

    The page is served to this machine alone, until Ctrl-C.

    Example:

        exactcreep explore --port 8000 --no-browser

    Parameters
    ----------
    port : PORT
        Where the page is; 0: any port that is free.
    browser : bool
        Whether to open the page.
    """
    from exactcreep.figures.explorer import page_server
    from exactcreep.model.numbers import whole_number

    with page_server(whole_number(port, "port", least=0, most=65_535)) as server:
        url = f"http://127.0.0.1:{server.server_address[1]}/"
        typer.echo(f"{url} (Ctrl-C ends it)")
        if browser:
            webbrowser.open(url)
        server.serve_forever()


def sweep(
    scene: Scene,
    *,
    solver: str | None = None,
    seeds: str | None = None,
    workers: str | None = None,
    scheduler: str | None = None,
    out: Path | None = None,
    resume: bool = False,
    plot: Path | None = None,
    force: bool = False,
) -> None:
    """Run every member of a scene as a labelled grid, on all cores or on a cluster.

    Every cell is saved when it has finished; a sweep that was stopped goes on with --resume and
    gives the same bits. The grid is written to DIRECTORY/sweep.nc.

    Examples:

        exactcreep sweep chain-plateaus --workers 8 --plot plateaus.png

        exactcreep sweep two-sliders-cycles --set vary.drive.amplitude=[0.005,0.01] --seeds 100

        exactcreep sweep my-scene.toml --scheduler tcp://10.0.0.1:8786 --out plateaus --resume

    Parameters
    ----------
    seeds : int
        Run every point with the seeds 0 .. K-1.
    scheduler : ADDRESS
        A dask scheduler, e.g. tcp://10.0.0.1:8786.
    out : DIR
        Directory of the results; default SCENE-sweep.
    resume : bool
        Go on with the cells that the directory holds.
    plot : path
        Draw the velocities to this PNG, PDF or SVG file.
    """
    from exactcreep.model.numbers import whole_number
    from exactcreep.model.outcome import behaviour
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
        shown(wanted.name, hint=f"; --out {folder} --resume goes on") as display,
    ):
        grid = exactcreep.sweep(
            wanted, executor=executor, workers=count, out=folder, resume=resume,
            progress=display.show,
        )  # fmt: skip
    sizes = ", ".join(f"{name} {size}" for name, size in grid["velocity"].sizes.items())
    words = (grid[name].to_numpy().ravel().tolist() for name in ("outcome", "direction"))
    outcomes = counted(
        behaviour(exactcreep.Outcome(outcome), way) for outcome, way in zip(*words, strict=True)
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
