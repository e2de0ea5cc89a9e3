"""The picture of a threshold: what a search computed over the amplitude, beside the laws."""

from __future__ import annotations

import itertools

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exactcreep.figures.style import DASHES, INKS, LENGTH, new_figure, styled
from exactcreep.laws import edges
from exactcreep.model.numbers import nearest_float
from exactcreep.studies.thresholds.answer import laws_beside
from exactcreep.studies.thresholds.half_life import HalfLife
from exactcreep.studies.thresholds.intercept import Intercept
from exactcreep.studies.thresholds.threshold import Threshold

_LAWS = {
    "law_seuil": r"paper: threshold $A_\theta^*$",
    "law_corrected": "(N m + D)/(2 l0)",
    "law_two_sliders": "(mu_s c - s)/l0",
    "none": "below this none creeps for ever",
}
_OPEN = 1.05
"""The axis ends in a window that the scan has not seen the end of, so much above its beginning."""


@styled
def draw_threshold(found: Threshold | HalfLife | Intercept) -> Figure:
    """Draw windows, shares of starts, or velocities over the amplitude, with the laws."""
    chain = found.chain
    asked = "half-life" if isinstance(found, HalfLife) else getattr(found, "what", found.criterion)
    title = f"N = {chain.n}, sigma_mu = {nearest_float(chain.sigma_mu):g}: {asked}"
    figure = new_figure(6.0, 4.0, f"{title} ({found.evidence.value})")
    axes = figure.subplots()
    if isinstance(found, Intercept):
        _velocities(axes, found)
    elif isinstance(found, HalfLife):
        _shares(axes, found)
    else:
        _windows(axes, found)
    places = {**laws_beside(chain), "none": edges(chain).get("no_lasting_creep")}
    known = {name: float(str(value)) for name, value in places.items() if value is not None}
    for (name, value), dashes in zip(known.items(), itertools.cycle(DASHES[1:]), strict=False):
        label, ink = f"{_LAWS[name]}: {value:.6g}", INKS[7 if name == "none" else 1]
        axes.axvline(value, color=ink, linestyle=dashes, label=label)
    axes.set_xlabel(r"amplitude $A_\theta$")
    axes.margins(x=0.05)
    axes.locator_params(axis="x", nbins=6)
    if isinstance(found, Threshold) and found.windows and found.windows[-1].begins:
        axes.set_xlim(axes.get_xlim()[0], _OPEN * float(found.windows[-1].middle))
    figure.legend(loc="outside lower center", ncols=2, fontsize=7)
    return figure


def _velocities(axes: Axes, found: Intercept) -> None:
    axes.errorbar(found.amplitudes, found.velocities, 1.96 * found.errors, fmt="o",
                  color=INKS[0], markersize=3, label="measured, 95 %")  # fmt: skip
    if np.isfinite(found.intercept):
        ends = np.array([found.intercept, found.amplitudes.max()])
        label = f"line, zero at {found.intercept:.6g}"
        axes.plot(ends, found.slope * (ends - found.intercept), color=INKS[2], label=label)
    axes.axhline(0.0, color=INKS[6], linewidth=0.6)
    axes.set_ylabel(f"velocity per half-cycle  {LENGTH}")


def _shares(axes: Axes, found: HalfLife) -> None:
    tried = sorted(found.shares)
    _, middle, low, high = np.array([found.shares[amplitude] for amplitude in tried]).T
    axes.errorbar(tried, middle, [middle - low, high - middle], fmt="o", color=INKS[0],
                  markersize=3, label=f"of {found.starts} starts, 95 %")  # fmt: skip
    axes.axhline(0.5, color=INKS[6], linewidth=0.6)
    if found.low is not None and found.high is not None:
        axes.axvspan(found.low, found.high, color=INKS[4], alpha=0.4, linewidth=0, label="half")
    axes.set(ylim=(-0.05, 1.05), ylabel=f"still creep after {found.cycles} cycles")


def _windows(axes: Axes, found: Threshold) -> None:
    ends = [(float(edge.middle), edge.begins) for edge in found.windows or ()]
    label = found.what
    for begin in [end for end, begins in ends if begins]:
        later = (end for end, begins in ends if not begins and end > begin)
        stop = min(later, default=_OPEN * begin)
        axes.axvspan(begin, stop, color=INKS[4], alpha=0.4, linewidth=0, label=label)
        label = ""
    if found.lower is not None and found.upper is not None:
        middle = (float(found.lower) + float(found.upper)) / 2
        axes.axvline(middle, color=INKS[0], label=f"{found.what} begins: {middle:.9g}")
    axes.set_yticks([])
