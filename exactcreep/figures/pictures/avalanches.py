"""The picture of avalanches: their distributions near and above the threshold, and the cut-offs."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exactcreep.figures.drawing import Data
from exactcreep.figures.style import INKS, picture
from exactcreep.figures.tables import Row, Table
from exactcreep.studies.avalanches import MEASURES, SCENE, Distribution, growth


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


_POINTS: dict[str, Any] = {
    "marker": "o", "markersize": 3, "linewidth": 0.8, "elinewidth": 0.7, "markeredgewidth": 0.8,
}  # fmt: skip


def tables(data: Data) -> list[Table]:
    """Return the cut-off of every measure, and the exponent with which it grows with N."""
    dataset = data[SCENE]
    sizes, ratios = (dataset[name].to_numpy().tolist() for name in ("n", "ratio"))
    ends, exponents = [], []
    for measure in MEASURES:
        for ratio in ratios:
            here = dataset.sel(ratio=ratio)
            value, error = (
                here[f"{measure}_cut_off{suffix}"].to_numpy() for suffix in ("", "_error")
            )
            varied = {"measure": measure, "A/A*": ratio}
            ends += [
                Row(
                    {**varied, "n": n},
                    float(value[k]),
                    float(error[k]),
                    (),
                    (),
                    f"{count} avalanches",
                )
                for k, (n, count) in enumerate(
                    zip(sizes, here["avalanches"].to_numpy().tolist(), strict=True)
                )
            ]
            slope, spread, beyond = growth(sizes, value, error)
            bent = "bends away from a power of N by more than the errors, which are wider for it"
            exponents.append(Row(varied, slope, spread, (), (), bent if beyond > 4 else ""))
    return [
        Table(SCENE, "Cut-off <s^2>/<s> of avalanches", "-", "", tuple(ends)),
        Table(f"{SCENE}-growth", "Exponent b of cut-off ~ N^b", "-", "", tuple(exponents)),
    ]


def draw(data: Data, tables: list[Table]) -> Figure:
    """Draw the distributions, mean duration over size, and the cut-offs over N."""
    dataset = data[SCENE]
    sizes, ratios = (dataset[name].to_numpy().tolist() for name in ("n", "ratio"))
    figure = picture(8.4, 9.6)
    panels = figure.subplots(3, 2).ravel()
    for axes, measure in zip(panels, MEASURES, strict=False):
        for j, n in enumerate(sizes):
            for k, ratio in enumerate(ratios):
                here = dataset.sel(n=n, ratio=ratio)
                found = Distribution(
                    here[measure].to_numpy(),
                    here[f"{measure}_width"].to_numpy(),
                    here[f"{measure}_density"].to_numpy(),
                    here[f"{measure}_error"].to_numpy(),
                )
                label = f"N = {n}, {ratio:g} $A^*$"
                draw_distribution(axes, found, measure, **_style(j, k), label=label)
    panels[0].legend(loc="lower left")
    for j, n in enumerate(sizes):
        for k, ratio in enumerate(ratios):
            here = dataset.sel(n=n, ratio=ratio)
            mean, error = here["mean_duration"].to_numpy(), here["mean_duration_error"].to_numpy()
            panels[4].errorbar(here["size"], mean, np.nan_to_num(error), **_style(j, k))
    panels[4].set(xscale="log", yscale="log", xlabel=MEASURES["size"].label)
    panels[4].set_ylabel(r"mean duration ($\tau_\mathrm{dyn}$)")
    exponents = iter(tables[1].rows)
    for number, measure in enumerate(MEASURES):
        for k, ratio in enumerate(ratios):
            here = dataset.sel(ratio=ratio)
            label = f"{measure}, {ratio:g} $A^*$: $N^{{{next(exponents).measured:.2f}}}$"
            ends = [here[f"{measure}_cut_off{end}"].to_numpy() for end in ("", "_error")]
            style = _style(number + 3, k)
            panels[5].errorbar(sizes, ends[0], np.nan_to_num(ends[1]), **style, label=label)
    panels[5].set(xscale="log", yscale="log", xlabel="number of sliders $N$")
    panels[5].set_ylabel(r"cut-off $\langle s^2\rangle/\langle s\rangle$ (each in its unit)")
    panels[5].legend(loc="upper left", fontsize=6.5)
    panels[5].set_xticks(sizes, [str(n) for n in sizes], minor=False)
    panels[5].set_xticks([], minor=True)
    panels[5].set_ylim(top=100 * float(max(dataset[f"{name}_cut_off"].max() for name in MEASURES)))
    return figure


def _style(ink: int, ratio: int) -> dict[str, Any]:
    """Return the style of a line: inks tell the first quantity apart, full points the ratio."""
    color = INKS[ink % len(INKS)]
    filled = {"markerfacecolor": "white", "linestyle": "-"} if ratio == 0 else {"linestyle": ":"}
    return {**_POINTS, "color": color, **filled}
