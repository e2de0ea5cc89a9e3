"""The picture of `compare`: the error of each method against its time."""

from __future__ import annotations

import math
from itertools import cycle

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.figure import Figure

from exactcreep.figures.style import INKS, LENGTH, new_figure, styled
from exactcreep.studies.comparison import table

_MARKS = {"exact": "*", "certified": "s", "verlet": "o", "sliding": "^"}


@styled
def draw_compared(data: xr.Dataset, title: str = "") -> Figure:
    """Draw one mark for each method: its error over its time, with the ranges of both.

    The legend says after how many events the first wrong one comes. Proved errors have a scale of
    their own below the others. Without an error a mark stands at the lower edge.
    """
    figure, rows = new_figure(7.0, 5.4, title), table(data)
    rows = rows[rows.error.notna() & rows.seconds.notna()]
    proved = rows.solver == "certified"
    parts = [part for part in (rows[~proved], rows[proved]) if len(part)]
    ratios = [3, 1] if len(parts) == 2 else [1]
    every = figure.subplots(len(parts), 1, sharex=True, squeeze=False, height_ratios=ratios)[:, 0]
    inks = dict(zip(rows.index, cycle(INKS), strict=False))
    for axes, part in zip(every, parts, strict=True):
        known = part.error_low[part.error_low > 0]
        floor = known.min() / 10 if known.size else 1e-18
        for name, row in part.iterrows():
            errors = row.error_low, row.error, row.error_high
            low, value, high = (max(error, floor) for error in errors)
            axes.errorbar(
                row.seconds, value, [[value - low], [high - value]],
                [[row.seconds - row.fastest], [row.slowest - row.seconds]],
                fmt=_MARKS.get(row.solver, "D"), color=inks[name], capsize=2,
                label=f"{name}: {_wrong(row)}",
            )  # fmt: skip
        axes.set(xscale="log", yscale="log")
        axes.margins(0.1, 0.2)
    every[0].set_title(f"{data.sizes['seed']} seeds of {int(np.median(data.events))} events",
                       fontsize=8)  # fmt: skip
    every[0].set_ylabel(f"largest error of a position {LENGTH}\nbefore any method is wrong")
    if proved.any():
        every[-1].set_ylabel("proved")
    every[-1].set_xlabel("processor time per half-cycle (s)")
    figure.legend(loc="outside lower center", ncols=2)
    return figure


def _wrong(row: pd.Series) -> str:
    """Return when the first wrong event of a method comes."""
    if math.isnan(row.agreed):
        return "no events"
    if row.agreed < math.inf:
        return f"wrong after {row.agreed:.0f} events"
    return f"wrong in {row.parted} seeds" if row.parted else "no wrong event"
