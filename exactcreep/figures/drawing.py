"""What the pictures of measured points beside laws have in common."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from exactcreep.figures.style import DASHED, INKS, Style, picture
from exactcreep.figures.tables import LAWS, Data, Point, Table
from exactcreep.laws import law_values

VELOCITY = r"$\tau_\mathrm{th}\langle\tilde{v}_G\rangle$  ($g\,\tau_\mathrm{dyn}^2$)"
SLOPE = r"$\tan\alpha$"
RATIO = r"$A_\theta/A_\theta^*$, $A_\theta^*$ of the paper"
LIMIT = r"exact for $\mu_\mathrm{s}\to\mu_\mathrm{d}$"
"""What a legend calls the law of the sliding limit."""
PRINTED: Style = {"color": INKS[0], "linestyle": "-", "linewidth": 1.1}
"""How the paper's law is drawn."""
EXACT: Style = {"color": INKS[1], "linestyle": DASHED, "linewidth": 1.3}
"""How the corrected or exact law is drawn."""
CYCLES: Style = {"marker": "o", "markerfacecolor": "white", "color": INKS[6]}
"""Points of temperature cycles: open circles, as in the paper."""
RANDOM: Style = {"marker": "o", "markerfacecolor": INKS[6], "color": INKS[6]}
"""Points of random dilations: full circles, as in the paper."""

_NAMES = {
    "seuil": r"threshold $A_\theta^*$",
    "sigma_theta_star": r"threshold $\sigma_\theta^*$",
    "vitesse": "plateaus of the velocity",
    "vitesse_seuil": "velocity above the threshold",
    "vitesse_seuil_random": "velocity, random dilations",
    "velocity_th_2_cycle_corrected": "velocity of two sliders",
    "velocity_th_2_gaussienne_corrected": "velocity of two sliders",
    "critical_angle": "critical angles",
}


@dataclass(frozen=True)
class Picture:
    """A picture of ``exactcreep reproduce``: the scenes behind it, its tables, how it is drawn.

    Attributes
    ----------
    name : str
        Of the files, and of the first scene.
    size : pair of float
        Width and height in inches.
    tables : callable
        Called with the data; returns the tables.
    quick : mapping
        For each scene the dotted keys that are set differently for a quick look.
    drawing : callable
        Called with an empty figure, the data and the tables; draws.
    figure : str
        The label of the paper's figure.
    always : mapping
        Dotted keys that are set in every scene, quick or not.
    """

    name: str
    size: tuple[float, float]
    tables: Callable[[Data], list[Table]]
    quick: Mapping[str, Mapping[str, Any]]
    drawing: Callable[[Figure, Data, list[Table]], None]
    figure: str
    always: Mapping[str, Any] = field(default_factory=dict)

    @property
    def scenes(self) -> tuple[str, ...]:
        """The scenes that are run."""
        return tuple(self.quick)

    def draw(self, data: Data, tables: list[Table]) -> Figure:
        """Return the picture."""
        figure = picture(*self.size)
        self.drawing(figure, data, tables)
        for axes in figure.axes:
            mark_outside(axes)
        return figure


def law_name(label: str) -> str:
    """Return what a legend calls a law of the paper, by its label, which data and tables have."""
    return f"paper: {_NAMES[label]}"


def draw_points(
    axes: Axes,
    rows: Iterable[Point],
    x: str | Callable[[Point], float],
    scale: Callable[[Point], float] = lambda row: 1.0,
    **style: Any,
) -> None:
    """Draw the measured velocities of `rows` over a dimension, with their standard errors."""
    kept = list(rows)
    places = [row.varied[x] if isinstance(x, str) else x(row) for row in kept]
    y = [row.measured * scale(row) for row in kept]
    error = [0.0 if math.isnan(row.error) else row.error * scale(row) for row in kept]
    about: Style = {"markersize": 4, "linestyle": "none", "elinewidth": 0.7, "capsize": 0}
    axes.errorbar(places, y, yerr=error, zorder=3, **{**about, "markeredgewidth": 0.8, **style})


def mark_outside(axes: Axes) -> None:
    """Mark computed points above or below the axes at their edge, with their values."""
    low, high = axes.get_ylim()
    beyond: dict[tuple[float, bool], list[float]] = {}
    for container in list(axes.containers):
        for x, y in container[0].get_xydata():
            if y > high or y < low:
                beyond.setdefault((x, y > high), []).append(y)
    for (x, above), values in beyond.items():
        edge, sign, side = (high, "^", "top") if above else (low, "v", "bottom")
        axes.plot(x, edge, sign, color="black", markersize=5, clip_on=False, zorder=4)
        words = ", ".join(f"{value:.4g}" for value in sorted(values))
        axes.annotate(words, (x, edge), xytext=(-6, -5 if above else 5), va=side, ha="right",
                      textcoords="offset points", fontsize=7)  # fmt: skip


def law_line(
    equation: str, over: str, values: Iterable[Any], parameters: Mapping[str, Any],
    form: str = "printed",
) -> NDArray[np.float64]:  # fmt: skip
    """Return a law over the values of one parameter; the mean where a plateau is not unique."""
    law = getattr(LAWS[equation], form)
    return np.array([mean_law(law_values(law, {**parameters, over: value})) for value in values])


def mean_law(values: Sequence[float]) -> float:
    """Return the mean of the values of a law, nan where there is none."""
    return sum(values) / len(values) if values else math.nan


def draw_law(
    axes: Axes, equation: str, over: str, values: Sequence[Any], parameters: Mapping[str, Any],
    form: str = "printed", label: str = "", **style: Any,
) -> None:  # fmt: skip
    """Draw the paper's or the exact law over the values of one parameter."""
    about = {**(PRINTED if form == "printed" else EXACT), **style}
    line = law_line(equation, over, values, parameters, form)
    axes.plot([float(value) for value in values], line, label=label or law_name(equation), **about)


def draw_plateaus(
    axes: Axes, equation: str, form: str, parameters: Mapping[str, Any], **style: Any
) -> None:
    """Draw a law over tan(alpha) plateau by plateau, with jumps where the pivot changes."""
    n, friction = int(parameters["n"]), Fraction(parameters["mu_d"])
    law = getattr(LAWS[equation], form)
    for i in range(2, n + 2):
        low = max(friction * (1 - Fraction(2 * (i - 1), n)), Fraction(0))
        high = friction * (1 - Fraction(2 * (i - 2), n))
        if high <= 0:
            break
        slopes = [low + (high - low) * Fraction(k, 24) for k in range(25)]
        given = [{**parameters, "tan_alpha": slope, "i": i} for slope in slopes]
        values = [law_values(law, at)[0] for at in given]
        axes.plot([float(slope) for slope in slopes], values, **style)
        style["label"] = None


def degrees(axes: Axes) -> None:
    """Put the angle in degrees on top of an axis of tan(alpha)."""
    top = axes.secondary_xaxis(
        "top",
        functions=(lambda t: np.degrees(np.arctan(t)), lambda a: np.tan(np.radians(a))),
    )
    top.set_xlabel(r"$\alpha$ (degrees)")
    axes.tick_params(axis="x", which="both", top=False)
