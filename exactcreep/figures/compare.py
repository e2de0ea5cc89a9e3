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

    The legend says after how many events the first wrong one comes. The proved errors are far below
    the others, and stand at the lower edge with an arrow, as marks without an error do.
    """
    figure, rows = new_figure(7.0, 5.4, title), table(data)
    rows = rows[rows.error.notna() & rows.seconds.notna()]
    known = rows.error_low[(rows.error_low > 0) & (rows.solver != "certified")]
    floor, axes = known.min() / 10 if known.size else 1e-18, figure.subplots()
    for (name, row), ink in zip(rows.iterrows(), cycle(INKS), strict=False):
        value, high, below = max(row.error, floor), max(row.error_high, floor), row.error < floor
        low = max(row.error_low, floor / 10 if below else floor)
        proved = f", error {row.error:.0e} proved" * (row.solver == "certified")
        axes.errorbar(
            row.seconds, value, [[value - low], [high - value]],
            [[row.seconds - row.fastest], [row.slowest - row.seconds]],
            fmt=_MARKS.get(row.solver, "D"), color=ink, capsize=2,
            uplims=below, label=f"{name}: {_wrong(row)}{proved}",
        )  # fmt: skip
    axes.set(xscale="log", yscale="log", xlabel="processor time per half-cycle (s)")
    axes.set_ylabel(f"largest error of a position {LENGTH}\nbefore any method is wrong")
    axes.margins(0.1, 0.2)
    axes.set_title(f"{data.sizes['seed']} seeds of {int(np.median(data.events))} events",
                   fontsize=8)  # fmt: skip
    figure.legend(loc="outside lower center", ncols=2)
    return figure


def _wrong(row: pd.Series) -> str:
    """Return when the first wrong event of a method comes."""
    if math.isnan(row.agreed):
        return "no events"
    if row.agreed < math.inf:
        return f"wrong after {row.agreed:.0f} events"
    return f"wrong in {row.parted} seeds" if row.parted else "no wrong event"
