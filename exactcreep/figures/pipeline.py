"""Draw the effective axial force and the displacement along a pipeline that walks."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exactcreep.figures.style import DASHED, INKS, new_figure, styled
from exactcreep.model.numbers import nearest_float
from exactcreep.pipeline import Pipeline, Walk

_KILO = 1000
_LINES = 6  # most cycles whose displacement is drawn


@styled
def draw_walk(walk: Walk, title: str = "") -> Figure:
    """Draw the forces of the last cycle, their bounds, and the displacements of some cycles."""
    pipe = walk.pipeline
    figure = new_figure(6.6, 5.4, title)
    forces, moved = figure.subplots(2, 1, sharex=True)
    _draw_forces(forces, walk)
    cycles = walk.millimetres.size
    chosen = np.unique(np.linspace(1, cycles, min(cycles, _LINES)).round().astype(int))
    for cycle in chosen.tolist():
        shade = 0.25 + 0.75 * cycle / cycles
        cold = (walk.steps + 1) * cycle - 1
        for row, ink, style in ((cold - 1, INKS[1], "-"), (cold, INKS[0], "-")):
            moved.plot(pipe.positions, walk.displacement[row], style, color=ink, alpha=shade,
                       linewidth=1)  # fmt: skip
        end = pipe.positions[-1], walk.displacement[cold, -1]
        moved.annotate(f" cycle {cycle}", end, fontsize=7, va="center", color="0.3",
                       annotation_clip=False)  # fmt: skip
    moved.set_xlim(right=pipe.positions[-1] * 1.14)  # room for the labels of the cycles
    moved.set(xlabel="distance from the upper end (m)", ylabel="displacement (mm)")
    return figure


def _draw_forces(axes: Axes, walk: Walk) -> None:
    pipe = walk.pipeline
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
        axes.plot(places, bound / _KILO, color="0.5", linestyle=DASHED, linewidth=0.8,
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
