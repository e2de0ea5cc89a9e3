"""The picture of a sweep: velocity over what varies, beside the law of the sliding limit."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from exactcreep.figures.drawing import EXACT, VELOCITY, points
from exactcreep.figures.style import INKS, page, setting_text, symbol_of
from exactcreep.figures.tables import Cell, Row, cells
from exactcreep.laws import LAWS, law_values
from exactcreep.model.numbers import InputError

_MOST_FAMILIES = 16  # that a legend can name
MAPPED = 5
"""Values of each of two quantities from which on a sweep is drawn as a map."""
_FINE = 80  # points along a side at which the law is known
_MARKS = ("o", "s", "^", "D")


def draw_sweep(dataset: xr.Dataset, path: Path | str, *, title: str = "") -> None:
    """Draw the velocities of a sweep over the quantity with most values, all seeds together.

    What varies besides makes families, each in a colour of its own. The law of the sliding
    limit, where there is one, is a broken line. Two quantities of which each has at least
    `MAPPED` values, and nothing else, make a map with contours of the law.

    Parameters
    ----------
    dataset : Dataset
        From `exactcreep.studies.sweep.sweep`.
    path : path
        A PNG, PDF or SVG file.
    title : str

    Raises
    ------
    InputError
        If nothing varies but the seed, or the file cannot be written.
    """
    every = cells(dataset)
    over = _over(every)
    if _makes_map(every):
        with page(path, 6.0, 4.4, title) as figure:
            _draw_map(figure, every)
        return
    families: dict[tuple[Any, ...], list[Cell]] = {}
    for cell in every:
        own = tuple(value for key, value in cell.varied.items() if key != over)
        families.setdefault(own, []).append(cell)
    others = [key for key in every[0].varied if key != over]
    with page(path, 5.6, 4.0, title) as figure:
        axes = figure.subplots()
        for number, (own, family) in enumerate(families.items()):
            texts = [setting_text(key, value) for key, value in zip(others, own, strict=True)]
            _draw_family(axes, family, over, number, ", ".join(texts) or "computed")
        axes.plot([], [], **{**EXACT, "color": "0.3"},
                  label=r"exact for $\mu_\mathrm{s}\to\mu_\mathrm{d}$")  # fmt: skip
        axes.set(xlabel=symbol_of(over), ylabel=VELOCITY)
        if len(families) <= _MOST_FAMILIES:
            axes.legend(loc="best")


def _over(every: Sequence[Cell]) -> str:
    """Return the varied quantity with most values, a number if there is one."""
    if not every[0].varied:
        raise InputError("plot", "sweep", "needs something that varies besides the seed")

    def size(key: str) -> tuple[bool, int]:
        values = [cell.varied[key] for cell in every]
        return all(isinstance(value, (int, float)) for value in values), len(set(values))

    return max(every[0].varied, key=size)


def _makes_map(every: Sequence[Cell]) -> bool:
    columns = list(zip(*(cell.varied.values() for cell in every), strict=True))
    return len(columns) == 2 and all(
        all(isinstance(value, (int, float)) for value in column) and len(set(column)) >= MAPPED
        for column in columns
    )


def _draw_map(figure: Figure, every: Sequence[Cell]) -> None:
    """Draw the velocity in colour over two quantities, and contours of the law."""
    axes = figure.subplots()
    across, up = every[0].varied
    x, y = (sorted({cell.varied[key] for cell in every}) for key in (across, up))
    measured = {(cell.varied[across], cell.varied[up]): cell.velocity for cell in every}
    values = np.array([[measured.get((a, b), math.nan) for a in x] for b in y])
    # a runaway has no velocity
    values[~np.isfinite(values)] = math.nan
    image = axes.pcolormesh(x, y, values, shading="nearest", cmap="cividis", rasterized=True)
    bar = figure.colorbar(image, ax=axes, pad=0.02)
    bar.set_label(VELOCITY)
    axes.set(xlabel=symbol_of(across), ylabel=symbol_of(up))
    fine_x, fine_y = _between(x), _between(y)
    law = np.array([[_law_at(every[0], {across: a, up: b}) for a in fine_x] for b in fine_y])
    if np.isfinite(law).sum() < 2 or np.nanmin(law) == np.nanmax(law):
        return
    # where the law is 0 it is so everywhere around
    levels = [one for one in MaxNLocator(8).tick_values(np.nanmin(law), np.nanmax(law)) if one]
    lines = axes.contour(fine_x, fine_y, law, levels=levels, colors="white", linewidths=0.9)
    axes.clabel(lines, fontsize=7)
    bar.add_lines(lines)
    axes.set_title(r"lines: exact for $\mu_\mathrm{s}\to\mu_\mathrm{d}$", fontsize=8)


def _between(values: Sequence[float]) -> list[float]:
    """Return places along an axis, of whole numbers none between."""
    if all(isinstance(value, int) for value in values):
        return list(values)
    return [float(value) for value in np.linspace(values[0], values[-1], _FINE)]


def _law_at(cell: Cell, varied: Mapping[str, float]) -> float:
    law = _law(cell._replace(parameters={**cell.parameters, **varied}))
    return sum(law) / len(law) if law else math.nan


def _draw_family(axes: Axes, family: list[Cell], over: str, number: int, label: str) -> None:
    ink = INKS[number % len(INKS)]
    rows = [Row(cell.varied, cell.velocity, cell.error, (), _law(cell)) for cell in family]
    points(axes, rows, over, marker=_MARKS[number // len(INKS) % len(_MARKS)], color=ink,
           markerfacecolor="white", label=label)  # fmt: skip
    law = [sum(row.exact) / len(row.exact) if row.exact else math.nan for row in rows]
    axes.plot([row.varied[over] for row in rows], law, **{**EXACT, "color": ink})


def _law(cell: Cell) -> tuple[float, ...]:
    """Return the law of the sliding limit, nothing where there is none."""
    given = cell.parameters
    if not {"n", "tan_alpha", "mu_d"} <= set(given):  # a solid's contacts vary
        return ()
    if given["n"] < 2 or not 0 <= given["tan_alpha"] < given["mu_d"]:
        return ()
    label = {"amplitude": "vitesse_seuil", "sigma_theta": "vitesse_seuil_random"}
    for size, name in label.items():
        if given.get(size):
            return law_values(LAWS[name].exact, given)
    return ()
