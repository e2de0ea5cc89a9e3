"""Draw a walk: the descent of a solid, or forces and displacements along a pipeline."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exactcreep.figures.run import draw_descent
from exactcreep.figures.style import INKS, new_figure, styled
from exactcreep.model.numbers import nearest_float
from exactcreep.pipeline import Pipeline
from exactcreep.solid import Solid
from exactcreep.walk import Walk

_KILO = 1000
_APART = 0.055  # least distance of two labels, as a part of the height
_LINES = 6  # most cycles whose displacement is drawn


@styled
def draw_walk(walk: Walk, title: str = "") -> Figure:
    """Draw the descent of a solid; of a pipe the last forces, their bounds, and displacements."""
    pipe = walk.body
    if isinstance(pipe, Solid):
        return draw_descent(walk, title)
    figure = new_figure(6.6, 5.4, title)
    forces, moved = figure.subplots(2, 1, sharex=True)
    _draw_forces(forces, walk)
    cycles = walk.per_cycle.size
    chosen = np.unique(np.linspace(1, cycles, min(cycles, _LINES)).round().astype(int))
    colds = (walk.steps + 1) * chosen - 1
    for cycle, cold in zip(chosen.tolist(), colds.tolist(), strict=True):
        shade = 0.25 + 0.75 * cycle / cycles
        for row, ink in ((cold - 1, INKS[1]), (cold, INKS[0])):
            moved.plot(pipe.positions, walk.displacement[row], color=ink, alpha=shade, linewidth=1)
    ends = walk.displacement[colds, -1]
    order = np.argsort(ends, kind="stable")
    low, high = moved.get_ylim()
    steps = _APART * (high - low) * np.arange(ends.size)
    places = np.maximum.accumulate(ends[order] - steps) + steps
    for cycle, end, place in zip(chosen[order].tolist(), ends[order], places, strict=True):
        last = pipe.positions[-1]
        moved.annotate(
            f"cycle {cycle}", (last, end), (last * 1.04, place), fontsize=7, va="center",
            color="0.3", arrowprops={"arrowstyle": "-", "color": "0.6", "linewidth": 0.5},
        )  # fmt: skip
    moved.set_xlim(right=pipe.positions[-1] * 1.16)  # room for the labels of the cycles
    moved.set(xlabel="distance from the upper end (m)", ylabel="displacement (mm)")
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
