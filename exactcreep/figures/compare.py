"""The picture of `compare`: each method's error at every rest, and its bias against its cost."""

from __future__ import annotations

import math
from itertools import product

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from exactcreep.figures.style import DASHES, DOTTED, INKS, LENGTH, new_figure, styled
from exactcreep.studies.comparison import spread, table

_INKS = (*INKS, "#6B3E00", "#762A83", "#B2A800", "#800026")
"""More colours than other pictures need: by default nine methods are compared."""
_STYLES = [(*dashed, ink) for dashed, ink in product(zip(DASHES, "osD^", strict=True), _INKS)]
"""Line, mark and colour of each method."""


@styled
def draw_compared(data: xr.Dataset, title: str = "") -> Figure:
    """Draw the position errors of the first seed at every rest, and the biases over the time."""
    biases, rows, first = spread(data).bias, table(data), data.isel(seed=0)
    figure = new_figure(9.0, 4.6, title)
    left, right = figure.subplots(1, 2)
    for k, name in enumerate(data.method.values):
        dash, mark, ink = _STYLES[k % len(_STYLES)]
        if name == data.truth:  # the reference solution has no error to draw
            how = "proved" if data.solver.values[k] == "certified" else "the others' reference"
            left.plot([], [], color=ink, linestyle=dash, label=f"{name}: {how}")
        else:
            errors, agreed = first.errors.values[k].copy(), int(first.rests[k])
            errors[errors == 0] = math.nan
            label = name if np.nanmax(errors, initial=0.0) > 0 else f"{name}: no error"
            left.plot(data.rest[:agreed], errors[:agreed], color=ink, linestyle=dash, label=label)
            left.plot(data.rest[agreed:], errors[agreed:], color=ink, linestyle=dash, linewidth=0.5)
        value, low, high = 100 * biases.values[k]
        bars = [[value - low], [high - value]] if np.isfinite(high - low) else None
        if np.isfinite(value):
            right.errorbar(rows.seconds.iloc[k], value, bars, color=ink, marker=mark, capsize=2)
    left.set(yscale="log", xlabel="rests, one after each rearrangement")
    left.set_ylabel(rf"largest error of $\tilde{{x}}_n$ {LENGTH}")
    left.set_title("thin: after the first wrong event; gaps: no error", fontsize=8)
    right.axhline(0.0, color="0", linestyle=DOTTED, linewidth=0.8, zorder=0)
    right.set(xscale="log", xlabel="time per half-cycle (ms)")
    right.xaxis.set_minor_locator(LogLocator(subs=(2, 5)))  # few enough that no labels overlap
    for each in (right.xaxis.set_major_formatter, right.xaxis.set_minor_formatter):
        each(lambda seconds, _: f"{1000 * seconds:g}")
    right.tick_params(axis="x", which="minor", labelsize=7)
    right.set_ylabel("bias of the mean velocity (%), 95 %")
    right.margins(x=0.12)
    figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure
