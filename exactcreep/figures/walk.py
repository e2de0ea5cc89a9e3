"""Draw a walk: the descent of a solid, or forces and displacements along a pipeline."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from exactcreep.figures.style import INKS, new_figure, styled
from exactcreep.model.numbers import nearest_float
from exactcreep.pipeline import Pipeline
from exactcreep.records.readings import SHORT_UNITS
from exactcreep.records.temperature_record import TemperatureRecord
from exactcreep.solid import Solid
from exactcreep.walk import DAYS_PER_YEAR, FRICTION, Walk

_KILO = 1000
_LINES = 6  # most cycles whose displacement is drawn


@styled
def draw_walk(walk: Walk, title: str = "") -> Figure:
    """Draw the descent of a solid; of a pipe the last forces, their bounds, and displacements."""
    pipe = walk.body
    if isinstance(pipe, Solid):
        return _draw_descent(walk, title)
    figure = new_figure(6.6, 5.4, title)
    forces, moved = figure.subplots(2, 1, sharex=True)
    _draw_forces(forces, walk)
    cycles = walk.per_cycle.size
    chosen = np.unique(np.linspace(1, cycles, min(cycles, _LINES)).round().astype(int))
    colds = (walk.steps + 1) * chosen - 1
    for cycle, cold in zip(chosen.tolist(), colds.tolist(), strict=True):
        look: dict[str, Any] = {"alpha": 0.25 + 0.75 * cycle / cycles, "linewidth": 1}
        moved.plot(pipe.positions, walk.displacement[cold - 1], color=INKS[1], **look)
        moved.plot(pipe.positions, walk.displacement[cold], color=INKS[0], **look,
                   label=f"cycle {cycle}")  # fmt: skip
    moved.set(xlabel="distance from the upper end (m)", ylabel="displacement (mm)")
    figure.legend(*moved.get_legend_handles_labels(), loc="outside right center", reverse=True)
    return figure


def _draw_forces(axes: Axes, walk: Walk) -> None:
    pipe = walk.body
    for row, ink, name, anchor in (
        (-2, INKS[1], "heated", pipe.anchors[0]), (-1, INKS[0], "cooled", pipe.anchors[1]),
    ):  # fmt: skip
        force = walk.axial_force[row] / _KILO
        axes.plot(pipe.springs, force, color=ink, linewidth=1.2, label=name)
        at = float(np.interp(anchor, pipe.springs, force))
        axes.plot([anchor], [at], "o", color=ink, markersize=4,
                  label="virtual anchors" if row == -2 else "")  # fmt: skip
    places, bounds = friction_bounds(pipe)
    for k, bound in enumerate(bounds):
        axes.plot(places, bound / _KILO, color="0.82", linewidth=6, solid_capstyle="round",
                  label="" if k else "limits of friction", zorder=0)  # fmt: skip
    axes.set(ylabel="effective axial force (kN)")
    axes.legend(loc="best")


def friction_bounds(pipe: Pipeline) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """Return positions in m, and the least and the largest axial force that friction allows, N."""
    places = np.linspace(0, nearest_float(pipe.length), 401)
    held, along = pipe.friction_up_to(places), pipe.weight_up_to(places)
    upper, lower = map(nearest_float, pipe.end_forces)
    left, rest = held[-1] - held, along[-1] - along
    least = np.maximum(-upper - held - along, lower - left + rest)
    most = np.minimum(-upper + held - along, lower + left + rest)
    return places, (least, most)


def _draw_descent(walk: Walk, title: str) -> Figure:
    """Draw temperatures and descent over time, beside many contacts and the measured walk."""
    drive, moved = walk.run.drive, walk.millimetres
    dates, yearly = drive.dates, walk.stretches(DAYS_PER_YEAR)
    time: NDArray[Any] = walk.elapsed if dates is None else dates[: moved.size]
    called = "above\n" + r"$\theta=0$ (K)"
    if isinstance(drive, TemperatureRecord):
        called = f"({SHORT_UNITS[drive.unit]})"
    several = yearly.size > 4
    years = 1.0 if several else walk.days / float(DAYS_PER_YEAR)
    figure = new_figure(7.2, 5.2, title)
    axes = figure.subplot_mosaic(
        [["top", "."], ["bottom", "side"]], height_ratios=(1, 1.7), width_ratios=(5.5, 1)
    )
    top, bottom, side = (axes[name] for name in ("top", "bottom", "side"))
    top.sharex(bottom)
    side.sharey(bottom)
    top.plot(time, walk.temperatures, color="0.25", linewidth=0.4)
    top.set_ylabel(f"temperature {called}")
    top.tick_params(labelbottom=False)
    if several:
        places = np.linspace(0, time.size - 1, yearly.size + 1)[:-1].astype(int)
        bottom.plot(time[places], yearly, color=INKS[6], linewidth=0.8, marker=".")
        bottom.set(ylim=(0, 1.25 * yearly.max()), ylabel="descent in each year (mm)")
    else:
        bottom.plot(time, moved, color=INKS[6], linewidth=1.6)
        bottom.set_ylabel("descent of the centre of mass (mm)")
    bottom.set_xlabel("days" if dates is None else "date")
    said = f"N = {walk.contacts[0]}, solver {walk.run.solver}"
    if walk.body.measured:
        said += f"; dashed: {float(walk.body.measured):.4g} mm a year, measured"
        for each in (bottom, side):
            level = float(walk.body.measured) * years
            each.axhline(level, color=INKS[1], linestyle="--", linewidth=1)
    bottom.set_title(said, fontsize=8)
    bottom.margins(x=0.01)
    for place, n in enumerate(walk.contacts):
        most, same, least = (walk.rates[n, factor] * years for factor in walk.body.friction)
        high = most if np.isfinite(most) else 1.4 * same
        side.plot([place] * 3, [high, same, least], color=INKS[place], linewidth=3, alpha=0.5)
        side.plot(place, same, marker="o", color=INKS[place])
        if high < most:  # with less friction the solid runs away
            side.annotate("no\nbound", (place, high), fontsize=7, ha="center", va="bottom")
        bottom.set_ylim(top=max(bottom.get_ylim()[1], (1.3 if high < most else 1.05) * high))
    side.set_xticks((0, 1), [str(n) for n in walk.contacts], fontsize=8)
    side.set_xlabel("N", fontsize=8)
    side.set_xlim(-0.6, 1.6)
    when = "mean" if several else "at the end"
    usual = walk.body.friction == FRICTION
    about = "\N{PLUS-MINUS SIGN}10 %" if usual else "low to high"
    side.set_title(f"{when},\nfriction\n{about}", fontsize=8)
    side.tick_params(labelleft=False)
    return figure
