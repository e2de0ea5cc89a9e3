"""The picture of a sweep: velocity over what varies, beside the law of the sliding limit."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import xarray as xr
from matplotlib.axes import Axes

from exactcreep.laws import LAWS, law_values
from exactcreep.model.numbers import InputError
from exactcreep.studies.drawing import EXACT, VELOCITY, points
from exactcreep.studies.figures import INKS, page, setting_text, symbol_of
from exactcreep.studies.tables import Cell, Row, cells

_MOST_FAMILIES = 16  # that a legend can name
_MARKS = ("o", "s", "^", "D")


def draw_sweep(dataset: xr.Dataset, path: Path | str, *, title: str = "") -> None:
    """Draw the velocities of a sweep over the quantity with most values, all seeds together.

    What varies besides makes families, each in a colour of its own. The law of the sliding
    limit, where there is one, is a broken line.

    Parameters
    ----------
    dataset : Dataset
        From `exactcreep.studies.sweeps.sweep`.
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
        axes.set_xlabel(symbol_of(over))
        axes.set_ylabel(VELOCITY)
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
