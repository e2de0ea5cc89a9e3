"""What the pictures of measured points beside laws have in common."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from fractions import Fraction
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from numpy.typing import NDArray

from exactcreep.figures.style import INKS
from exactcreep.figures.tables import Row
from exactcreep.laws import LAWS, Form, law_values

Data = Mapping[str, xr.Dataset]
"""The sweeps of a picture by the names of their scenes."""
VELOCITY = r"$\tau_\mathrm{th}\langle\tilde{v}_G\rangle$  ($g\,\tau_\mathrm{dyn}^2$)"
SLOPE = r"$\tan\alpha$"
PRINTED: dict[str, Any] = {"color": INKS[0], "linestyle": "-", "linewidth": 1.1}
"""How the paper's law is drawn."""
EXACT: dict[str, Any] = {"color": INKS[1], "linestyle": (0, (4, 1.5)), "linewidth": 1.3}
"""How the corrected or exact law is drawn."""
CYCLES: dict[str, Any] = {"marker": "o", "markerfacecolor": "white", "color": INKS[6]}
"""Points of temperature cycles: open circles, as in the paper."""
RANDOM: dict[str, Any] = {"marker": "o", "markerfacecolor": INKS[6], "color": INKS[6]}
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


def law_name(label: str) -> str:
    """Return what a legend calls a law of the paper, by its label, which data and tables have."""
    return f"paper: {_NAMES[label]}"


def points(
    axes: Axes,
    rows: Iterable[Row],
    key: str,
    *,
    scale: Callable[[Row], float] = lambda row: 1.0,
    **style: Any,
) -> None:
    """Draw the measured velocities of `rows` over the dimension `key`, with standard errors."""
    kept = list(rows)
    x = [row.varied[key] for row in kept]
    y = [row.measured * scale(row) for row in kept]
    error = [0.0 if math.isnan(row.error) else row.error * scale(row) for row in kept]
    about: dict[str, Any] = {"markersize": 4, "linestyle": "none", "elinewidth": 0.7, "capsize": 0}
    axes.errorbar(x, y, yerr=error, zorder=3, **{**about, "markeredgewidth": 0.8, **style})


def law_line(
    form: Form | None, over: str, values: Sequence[Any], parameters: Mapping[str, Any]
) -> NDArray[np.float64]:
    """Return a law over the values of one parameter; the mean where a plateau is not unique."""
    out = []
    for value in values:
        found = law_values(form, {**parameters, over: value})
        out.append(sum(found) / len(found) if found else math.nan)
    return np.array(out)


def plateau_lines(
    axes: Axes, equation: str, form: str, parameters: Mapping[str, Any], **style: Any
) -> None:
    """Draw a law over tan(alpha) plateau by plateau, with jumps where the pivot changes."""
    n, friction = int(parameters["n"]), Fraction(parameters["mu_d"])
    law = getattr(LAWS[equation], form)
    first = True
    for i in range(2, n + 2):
        low = max(friction * (1 - Fraction(2 * (i - 1), n)), Fraction(0))
        high = friction * (1 - Fraction(2 * (i - 2), n))
        if high <= 0:
            continue
        slopes = [low + (high - low) * Fraction(k, 24) for k in range(25)]
        given = {name: parameters[name] for name in law.required if name in parameters}
        values = [float(law(**{**given, "tan_alpha": slope, "i": i})) for slope in slopes]
        about = style if first else {**style, "label": None}
        axes.plot([float(slope) for slope in slopes], values, **about)
        first = False


def degrees(axes: Axes) -> None:
    """Put the angle in degrees on top of an axis of tan(alpha)."""
    top = axes.secondary_xaxis(
        "top",
        functions=(lambda t: np.degrees(np.arctan(t)), lambda a: np.tan(np.radians(a))),
    )
    top.set_xlabel(r"$\alpha$ (degrees)")
    axes.tick_params(axis="x", which="both", top=False)
