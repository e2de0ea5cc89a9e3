"""``exactcreep reproduce``: the paper's figures, and pictures beyond them, with their tables."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from exactcreep.commands.options import Force, Workers
from exactcreep.display import Display

if TYPE_CHECKING:
    import xarray as xr

    from exactcreep.figures.catalogue import Picture
    from exactcreep.figures.tables import Table
    from exactcreep.progress import Progress
    from exactcreep.scene import Scene

ALL = "all"


def reproduce(
    name: Annotated[
        str, typer.Argument(metavar="all|NAME", help="A picture; without a name they are listed.")
    ] = "",
    quick: Annotated[
        bool, typer.Option("--quick", help="Fewer points and shorter runs: minutes in all.")
    ] = False,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Directory of the files.")] = Path(
        "figures"
    ),
    force: Force = False,
    workers: Workers = None,
) -> None:
    """Compute and draw the paper's figures, and pictures beyond the paper.

    Writes NAME.png, NAME.pdf, NAME.nc (the data) and NAME.csv (the table: measured, the paper's
    law, the exact one, deviations in standard errors), and prints the table.

    Examples:

        exactcreep reproduce all --quick

        exactcreep reproduce chain-plateaus --out pictures
    """
    from exactcreep.figures.catalogue import PICTURES, picture_named
    from exactcreep.model.numbers import whole_number

    if not name:
        for picture in PICTURES.values():
            place = f"Fig. {picture.figure}" if picture.figure else "beyond the paper"
            typer.echo(f"{picture.name:24}{place}")
        return
    chosen = list(PICTURES.values()) if name == ALL else [picture_named(name)]
    count = None if workers is None else whole_number(workers, "workers", least=1)
    check_files(chosen, out, force=force)
    begin = time.perf_counter()
    for picture in chosen:
        with Display(picture.name) as display:
            data = data_of(picture, quick=quick, workers=count, progress=display.show)
        tables = picture.tables(data)
        write(picture, data, tables, out)
        for table in tables:
            print_table(table)
        typer.echo(f"written: {out / picture.name}.png, .pdf, .nc, .csv\n")
    if len(chosen) > 1:
        typer.echo(f"{len(chosen)} pictures in {time.perf_counter() - begin:.0f} s")


def check_files(pictures: list[Picture], out: Path, *, force: bool) -> None:
    """Make the directory, and raise `InputError` if a file may not be written."""
    from exactcreep.quasistatic.files import check_output, output_directory

    output_directory(out, "out")
    for picture in pictures:
        for ending in ("png", "pdf", "nc", "csv"):
            check_output(out / f"{picture.name}.{ending}", "out", force=force)


def data_of(
    picture: Picture,
    *,
    quick: bool,
    workers: int | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> dict[str, xr.Dataset]:
    """Return the sweeps of a picture by the names of their scenes."""
    from exactcreep.figures.tables import with_control
    from exactcreep.progress import reporter
    from exactcreep.scene import load_scene
    from exactcreep.studies.sweep import sweep

    data = {}
    for name, settings in picture.quick.items():
        if picture.compute is not None:
            asked = {**picture.always, **(settings if quick else {})}
            data[name] = picture.compute(**asked, say=partial(reporter(progress), name))
            continue
        scene = load_scene(name).with_settings(picture.always)
        if quick:
            scene = scene.with_settings(settings)
        dataset = sweep(scene, workers=workers, progress=progress)
        if _random(scene) and "run.seed" in scene.vary:
            sliding = scene.with_settings({"run.solver": "sliding"})
            dataset = with_control(dataset, sweep(sliding, workers=workers))
        data[name] = dataset if picture.reduce is None else picture.reduce(dataset)
    return data


def _random(scene: Scene) -> bool:
    return scene.tables["drive"].get("kind") == "gaussian" and "run.solver" not in scene.vary


def write(picture: Picture, data: Mapping[str, xr.Dataset], tables: list[Table], out: Path) -> None:
    """Write the picture twice, its data and its table."""
    import matplotlib as mpl

    from exactcreep.figures.style import STYLE, save_picture
    from exactcreep.figures.tables import to_csv
    from exactcreep.quasistatic.files import write_file
    from exactcreep.quasistatic.netcdf import netcdf

    stem = out / picture.name
    with mpl.rc_context(STYLE):
        figure = picture.draw(data, tables)
        for ending in ("png", "pdf"):
            save_picture(figure, stem.with_name(f"{picture.name}.{ending}"))
    groups = {name if len(data) > 1 else None: dataset for name, dataset in data.items()}
    write_file(stem.with_name(f"{picture.name}.nc"), netcdf(groups), "out")
    write_file(stem.with_name(f"{picture.name}.csv"), to_csv(tables).encode(), "out")


def print_table(table: Table) -> None:
    """Print a table: measured, laws, deviations in standard errors, and footnotes to them."""
    from rich.console import Console
    from rich.table import Table as Shown

    console = Console(highlight=False)
    if not console.is_terminal:
        console = Console(highlight=False, width=160)
    console.print(f"[bold]{table.name}[/bold]: {table.title}; deviations in standard errors",
                  soft_wrap=True)  # fmt: skip
    console.print(f"  paper: {table.printed}", soft_wrap=True, markup=False)
    if table.exact:
        console.print(f"  exact: {table.exact}", soft_wrap=True, markup=False)
    if table.note:
        console.print(f"  {table.note}", soft_wrap=True, markup=False)
    shown = Shown(box=None, padding=(0, 1), header_style="bold")
    for key in table.rows[0].varied if table.rows else ():
        shown.add_column(key)
    for heading in ("measured", "std. error", "paper", "dev.", "exact", "dev.", ""):
        shown.add_column(heading, overflow="fold")
    notes: dict[str, int] = {}
    for row in table.rows:
        shown.add_row(
            *(_short(value) for value in row.varied.values()),
            f"{row.measured:.6g}",
            f"{row.error:.2g}",
            _values(row.printed),
            _deviation(row.deviation_printed),
            _values(row.exact),
            _deviation(row.deviation_exact),
            f"({notes.setdefault(row.remark, len(notes) + 1)})" if row.remark else "",
        )
    console.print(shown)
    for text, number in notes.items():
        console.print(f"  ({number}) {text}", soft_wrap=True, markup=False)


def _short(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _values(law: Sequence[float]) -> str:
    return " or ".join(dict.fromkeys(f"{value + 0.0:.6g}" for value in law))


def _deviation(value: float) -> str:
    return "" if value != value else f"{value:+.1f}"
