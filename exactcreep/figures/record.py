"""Draw a record of temperatures over its time, and mark its faults."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from exactcreep.figures.style import INKS, new_figure, styled
from exactcreep.records.readings import SHORT_UNITS, Readings


@styled
def draw_record(readings: Readings, title: str = "") -> Figure:
    """Draw every reading, and mark the faults."""
    faults, unit = readings.faults(), SHORT_UNITS[readings.unit]
    wrong = {kind: faults.get(kind, np.array([], int)) for kind in ("missing", "far", "gap")}
    found = readings.values
    kept = np.setdiff1d(np.flatnonzero(np.isfinite(found)), wrong["far"])
    kept = kept[np.argsort(readings.times[kept], kind="stable")]
    times, values = readings.times[kept], found[kept]
    figure = new_figure(6.6, 3.2, title)
    axes = figure.add_subplot()
    ends = np.searchsorted(times, readings.times[wrong["gap"]])
    parts = np.split(np.arange(kept.size), ends)  # no line crosses a gap
    for part in filter(len, parts):
        axes.plot(times[part], values[part], color=INKS[0], linewidth=0.6)
    low, high = axes.get_ylim()
    high += 0.12 * (high - low)  # room for the marks
    for k, place in enumerate(wrong["gap"].tolist()):
        axes.axvspan(*readings.times[place - 1 : place + 1], color=INKS[1], alpha=0.25, linewidth=0,
                     label=None if k else "gap")  # fmt: skip
    for kind, mark, label in (("missing", "|", "missing"), ("far", "x", "far from its neighbours")):
        places = wrong[kind]
        heights = np.clip(np.nan_to_num(found[places], nan=high), low, high)
        if places.size:
            axes.plot(readings.times[places], heights, mark, color=INKS[1], label=label,
                      clip_on=False, markersize=7, markeredgewidth=1.5)  # fmt: skip
    axes.set_ylim(low, high)
    if any(places.size for places in wrong.values()):
        axes.legend(loc="lower right", bbox_to_anchor=(1, 1), fontsize=8, ncols=3)
    axes.set_xlabel("date" if readings.dated else "time")
    axes.set_ylabel(f"temperature ({unit})")
    return figure
