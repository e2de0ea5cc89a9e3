"""``exactcreep reproduce``: the paper's figures, and pictures beyond them, with their tables."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

import exactcreep
from exactcreep.commands.answer import say, say_table, shown

if TYPE_CHECKING:
    import xarray as xr

    from exactcreep import Progress
    from exactcreep.figures.drawing import Picture
    from exactcreep.figures.tables import Table

ALL = "all"


def reproduce(
    name: str = "",
    *,
    quick: bool = False,
    out: Path = Path("figures"),
    force: bool = False,
    workers: str | None = None,
) -> None:
    """Compute and draw the paper's figures.

    Writes NAME.png, NAME.pdf, NAME.nc (the data) and NAME.csv (the table: measured, the paper's
    law, the exact one, deviations in standard errors), and prints the table.

    Examples:

        exactcreep reproduce all --quick

        exactcreep reproduce chain-plateaus --out pictures

    Parameters
    ----------
    name : all|NAME
        A picture; without a name they are listed.
    quick : bool
        Fewer points and shorter runs: minutes in all.
    out : DIR
        Directory of the files.
    """
    from exactcreep.figures.paper import PICTURES, picture_named
    from exactcreep.model.numbers import whole_number
    from exactcreep.quasistatic.files import check_output, output_directory

    if not name:
        for picture in PICTURES.values():
            typer.echo(f"{picture.name:24}Fig. {picture.figure}")
        return
    chosen = list(PICTURES.values()) if name == ALL else [picture_named(name)]
    count = None if workers is None else whole_number(workers, "workers", least=1)
    output_directory(out, "out")
    for picture, ending in itertools.product(chosen, ("png", "pdf", "nc", "csv")):
        check_output(out / f"{picture.name}.{ending}", "out", force=force)
    begin = time.perf_counter()
    for number, picture in enumerate(chosen):
        hint = f"; {number} of {len(chosen)} pictures are in {out}" * bool(number)
        with shown(picture.name, hint=hint) as display:
            data = data_of(picture, quick=quick, workers=count, progress=display.show)
        tables = picture.tables(data)
        write(picture, data, tables, out)
        for table in tables:
            print_table(table)
        typer.echo(f"written: {out / picture.name}.png, .pdf, .nc, .csv\n")
    if len(chosen) > 1:
        typer.echo(f"{len(chosen)} pictures in {time.perf_counter() - begin:.0f} s")


def data_of(
    picture: Picture,
    *,
    quick: bool,
    workers: int | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> dict[str, xr.Dataset]:
    """Return the sweeps of a picture by the names of their scenes."""
    from exactcreep.figures.tables import with_control

    data = {}
    for name, settings in picture.quick.items():
        scene = exactcreep.load_scene(name).with_settings(picture.always)
        if quick:
            scene = scene.with_settings(settings)
        dataset = exactcreep.sweep(scene, workers=workers, progress=progress)
        random = scene.tables["drive"].get("kind") == "gaussian"
        if random and "run.solver" not in scene.vary and "run.seed" in scene.vary:
            sliding = scene.with_settings({"run.solver": "sliding"})
            dataset = with_control(dataset, exactcreep.sweep(sliding, workers=workers))
        data[name] = dataset
    return data


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
    """Print a table: measured, laws, deviations in standard errors."""
    say(f"[bold]{table.name}[/bold]: {table.title}; deviations in standard errors")
    exact = f"exact: {table.exact}" if table.exact else ""
    for line in (f"paper: {table.printed}", exact, table.note):
        if line:
            say(f"  {line}", markup=False)
    rows = [
        (
            *(f"{v:.6g}" if isinstance(v, float) else str(v) for v in row.varied.values()),
            f"{row.measured:.6g}",
            f"{row.error:.2g}",
            _either(row.printed),
            _deviation(row.deviation_printed, row.printed),
            _either(row.exact),
            _deviation(row.deviation_exact, row.exact),
        )
        for row in table.rows
    ]
    names = ("measured", "std. error", "paper", "dev.", "exact", "dev.")
    names = (*(table.rows[0].varied if table.rows else ()), *names)
    say_table(names, rows, folded=names)


def _either(law: Sequence[float]) -> str:
    return " or ".join(dict.fromkeys(f"{value + 0.0:.6g}" for value in law))


def _deviation(value: float, law: Sequence[float]) -> str:
    if value == 0 and len(set(law)) > 1:
        return "between"
    return "" if math.isnan(value) else f"{value:+.1f}"
