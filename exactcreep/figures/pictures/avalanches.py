"""The picture of avalanches: their distributions near and above the threshold, and the cut-offs."""

from __future__ import annotations

import itertools
from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from exactcreep.figures.drawing import Picture
from exactcreep.figures.style import INKS, Style
from exactcreep.figures.tables import Data, Point, Table
from exactcreep.studies.avalanches import MEASURES, SCENE, Distribution, growth, study


def draw_distribution(axes: Axes, found: Distribution, measure: str, **style: Any) -> None:
    """Draw a density with its errors on logarithmic axes."""
    kept = found.density > 0
    error = np.nan_to_num(found.error[kept])
    axes.errorbar(found.middle[kept], found.density[kept], error, **{**_POINTS, **style})
    axes.set(xscale="log", yscale="log", xlabel=MEASURES[measure].label)
    axes.set_ylabel(f"density of {measure}")
    # errors as large as the density itself would reach down to zero
    drawn = [np.asarray(line.get_ydata()) for line in axes.lines]
    lowest = min((float(y.min()) for y in drawn if y.size), default=1.0)
    axes.set_ylim(bottom=lowest / 3)


_POINTS: Style = {
    "marker": "o", "markersize": 3, "linewidth": 0.8, "elinewidth": 0.7, "markeredgewidth": 0.8,
}  # fmt: skip


def _tables(data: Data) -> list[Table]:
    """Return the cut-off of every measure, and the exponent with which it grows with N."""
    dataset = data[SCENE]
    sizes = dataset["n"].to_numpy().tolist()
    ends, exponents = [], []
    for measure in MEASURES:
        for ratio in dataset["ratio"].to_numpy().tolist():
            here = dataset.sel(ratio=ratio)
            value, error = _cut_offs(here, measure)
            counts = here["avalanches"].to_numpy().tolist()
            varied = {"measure": measure, "A/A*": ratio}
            for k, (n, count) in enumerate(zip(sizes, counts, strict=True)):
                end = float(value[k]), float(error[k])
                ends.append(Point({**varied, "n": n}, *end, remark=f"{count} avalanches"))
            slope, spread, beyond = growth(sizes, value, error)
            bent = "bends away from a power of N by more than the errors, which are wider for it"
            remark = bent if beyond > 4 else ""
            exponents.append(Point(varied, slope, spread, remark=remark))
    return [
        Table(SCENE, "Cut-off <s^2>/<s> of avalanches", tuple(ends)),
        Table(f"{SCENE}-growth", "Exponent b of cut-off ~ N^b", tuple(exponents)),
    ]


def _cut_offs(here: xr.Dataset, measure: str) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return the cut-off for each N, and its standard error."""
    return here[f"{measure}_cut_off"].to_numpy(), here[f"{measure}_cut_off_error"].to_numpy()


@partial(
    Picture, SCENE, (8.4, 9.6), _tables, {SCENE: {"cycles": [300, 40, 10]}},
    always={"sizes": [30, 100, 300], "ratios": [1.02, 2.0], "cycles": [2000, 320, 50]},
    compute=study,
)  # fmt: skip
def avalanches(figure: Figure, data: Data, tables: list[Table]) -> None:
    """Draw the distributions, mean duration over size, and the cut-offs over N."""
    dataset = data[SCENE]
    sizes, ratios = (dataset[name].to_numpy().tolist() for name in ("n", "ratio"))
    panels = figure.subplots(3, 2).ravel()
    for (j, n), (k, ratio) in itertools.product(enumerate(sizes), enumerate(ratios)):
        here = dataset.sel(n=n, ratio=ratio)
        for axes, measure in zip(panels, MEASURES, strict=False):
            columns = (measure, *(f"{measure}_{name}" for name in ("width", "density", "error")))
            found = Distribution(*(here[name].to_numpy() for name in columns))
            label = f"N = {n}, {ratio:g} $A^*$"
            draw_distribution(axes, found, measure, **_style(j, k), label=label)
        error = np.nan_to_num(here["mean_duration_error"].to_numpy())
        panels[4].errorbar(here["size"], here["mean_duration"], error, **_style(j, k))
    panels[0].legend(loc="lower left")
    panels[4].set(xscale="log", yscale="log", xlabel=MEASURES["size"].label)
    panels[4].set_ylabel(r"mean duration ($\tau_\mathrm{dyn}$)")
    exponents = iter(tables[1].rows)
    for number, measure in enumerate(MEASURES):
        for k, ratio in enumerate(ratios):
            label = f"{measure}, {ratio:g} $A^*$: $N^{{{next(exponents).measured:.2f}}}$"
            value, error = _cut_offs(dataset.sel(ratio=ratio), measure)
            style = _style(number + 3, k)
            panels[5].errorbar(sizes, value, np.nan_to_num(error), **style, label=label)
    top = 100 * float(max(dataset[f"{name}_cut_off"].max() for name in MEASURES))
    panels[5].set(xscale="log", yscale="log", xlabel="number of sliders $N$")
    panels[5].set_ylabel(r"cut-off $\langle s^2\rangle/\langle s\rangle$ (each in its unit)")
    panels[5].legend(loc="upper left", fontsize=6.5)
    panels[5].set_xticks(sizes, [str(n) for n in sizes], minor=False)
    panels[5].set_xticks([], minor=True)
    panels[5].set_ylim(top=top)


def _style(ink: int, ratio: int) -> Style:
    """Return the style of a line: inks tell the first quantity apart, full points the ratio."""
    color = INKS[ink % len(INKS)]
    filled = {"markerfacecolor": "white", "linestyle": "-"} if ratio == 0 else {"linestyle": ":"}
    return {**_POINTS, "color": color, **filled}
