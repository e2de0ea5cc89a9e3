"""A picture of solvers beside each other: where they part, how far off, and what that costs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from exactcreep.figures.style import INKS, new_figure
from exactcreep.studies.comparison import spread, table

_FLOOR = 1e-18
"""Smaller errors, and none at all, are drawn there: at the lower edge."""


def draw_compared(compared: Any, path: Path | str, *, title: str = "") -> None:
    """Draw the position errors of the first seed rest by rest, and the biases against the time.

    Parameters
    ----------
    compared : Dataset
        Of `compare`, or what has it as its ``dataset``.
    path : path
    title : str

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    data: xr.Dataset = compared if isinstance(compared, xr.Dataset) else compared.dataset
    known, rows = spread(data).bias, table(data)
    with new_figure(path, 9.0, 4.6, title) as figure:
        left, right = figure.subplots(1, 2)
        first = data.isel(seed=0)
        for k, name in enumerate(data.method.values):
            ink, errors = INKS[k % len(INKS)], np.maximum(first.errors.values[k], _FLOOR)
            compared = int(first.rests[k])
            left.plot(data.rest[:compared], errors[:compared], color=ink, label=name)
            left.plot(data.rest[compared:], errors[compared:], color=ink, linewidth=0.5)
            value, low, high = 100 * known.values[k]
            time, bars = rows.seconds.iloc[k], [[value - low], [high - value]]
            if np.isfinite(bars).all():
                right.errorbar(time, value, bars, color=ink, marker="o", capsize=2)
            elif np.isfinite(value):
                right.plot(time, value, color=ink, marker="o")
        left.set(yscale="log", xlabel="rests, one after each rearrangement")
        left.set_ylabel(r"largest error of $\tilde{x}_n$ ($g\,\tau_\mathrm{dyn}^2$)")
        left.set_title("thin: after the first wrong event", fontsize=8)
        right.axhline(0.0, color=INKS[7], linewidth=0.8, zorder=0)
        right.set(xscale="log", xlabel="time per half-cycle (s)")
        right.set_ylabel("bias of the mean velocity (%), 95 %")
        right.margins(x=0.12)
        figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=3)
