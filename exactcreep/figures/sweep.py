"""The picture of a sweep: velocity over what varies, beside the law of the sliding limit."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from exactcreep.figures.drawing import EXACT, LIMIT, VELOCITY, draw_points, mean_law
from exactcreep.figures.style import INKS, new_figure, setting_text, symbol_of
from exactcreep.figures.tables import Point, points_of
from exactcreep.laws import law_values, sliding_velocity, sliding_velocity_random
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
    points = points_of(dataset)
    values = {key: list(dict.fromkeys(one.varied[key] for one in points))
              for key in points[0].varied}  # fmt: skip
    if not values:
        raise InputError("plot", "sweep", "needs something that varies besides the seed")
    numeric = {key: not any(isinstance(one, str) for one in each) for key, each in values.items()}
    if len(values) == 2 and all(numeric[key] and len(values[key]) >= MAPPED for key in values):
        with new_figure(path, 6.0, 4.4, title) as figure:
            _draw_map(figure, points, *values)
    else:
        over = max(values, key=lambda key: (numeric[key], len(values[key])))
        with new_figure(path, 5.6, 4.0, title) as figure:
            _draw_families(figure, points, over)


def _draw_map(figure: Figure, points: Sequence[Point], across: str, up: str) -> None:
    """Draw the velocity in colour over two quantities, and contours of the law."""
    axes = figure.subplots()
    x, y = (sorted({one.varied[key] for one in points}) for key in (across, up))
    measured = {(one.varied[across], one.varied[up]): one.measured for one in points}
    values = np.array([[measured[a, b] for a in x] for b in y])
    # a runaway has no velocity
    values[~np.isfinite(values)] = math.nan
    image = axes.pcolormesh(x, y, values, shading="nearest", cmap="cividis", rasterized=True)
    bar = figure.colorbar(image, ax=axes, pad=0.02, label=VELOCITY)
    axes.set(xlabel=symbol_of(across), ylabel=symbol_of(up))
    fine_x, fine_y = _between(x), _between(y)
    parameters = points[0].parameters
    law = np.array([[_law({**parameters, across: a, up: b}) for a in fine_x] for b in fine_y])
    if np.isfinite(law).sum() < 2 or np.nanmin(law) == np.nanmax(law):
        return
    # where the law is 0 it is so everywhere around
    levels = [one for one in MaxNLocator(8).tick_values(np.nanmin(law), np.nanmax(law)) if one]
    lines = axes.contour(fine_x, fine_y, law, levels=levels, colors="white", linewidths=0.9)
    axes.clabel(lines, fontsize=7)
    bar.add_lines(lines)
    axes.set_title(f"lines: {LIMIT}", fontsize=8)


def _between(values: list[Any]) -> list[Any]:
    """Return places along an axis, of whole numbers none between."""
    if all(isinstance(value, int) for value in values):
        return values
    return list(np.linspace(values[0], values[-1], _FINE))


def _draw_families(figure: Figure, points: Sequence[Point], over: str) -> None:
    """Draw the velocity over one quantity, each of the others' values in a colour of its own."""
    axes = figure.subplots()
    families: dict[str, list[Point]] = {}
    for one in points:
        others = [setting_text(key, value) for key, value in one.varied.items() if key != over]
        families.setdefault(", ".join(others) or "computed", []).append(one)
    marks = itertools.product(_MARKS, INKS)
    for (label, family), (mark, ink) in zip(families.items(), itertools.cycle(marks), strict=False):
        draw_points(
            axes, family, over, marker=mark, color=ink, markerfacecolor="white", label=label
        )
        law = [_law(one.parameters) for one in family]
        axes.plot([one.varied[over] for one in family], law, **{**EXACT, "color": ink})
    axes.plot([], [], **{**EXACT, "color": "0.3"}, label=LIMIT)
    axes.set(xlabel=symbol_of(over), ylabel=VELOCITY)
    if len(families) <= _MOST_FAMILIES:
        axes.legend(loc="best")


def _law(given: Mapping[str, Any]) -> float:
    """Return the law of the sliding limit, nan where there is none."""
    if not {"n", "tan_alpha", "mu_d"} <= set(given):  # a solid's contacts vary
        return math.nan
    if given["n"] >= 2 and 0 <= given["tan_alpha"] < given["mu_d"]:
        laws = {"amplitude": sliding_velocity, "sigma_theta": sliding_velocity_random}
        for size, law in laws.items():
            if given.get(size):
                return mean_law(law_values(law, given))
    return math.nan
