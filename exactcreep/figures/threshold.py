"""The picture of a threshold: the computed windows or velocities over the amplitude, with laws."""

from __future__ import annotations

import itertools
import re
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from exactcreep.figures.style import DASHES, DISPLACEMENT, INKS, LENGTH, new_figure, styled
from exactcreep.laws import edges
from exactcreep.model.drive import Cycles
from exactcreep.model.enclosure import floats
from exactcreep.quasistatic.creep import creep
from exactcreep.studies.sense import INTERCEPT
from exactcreep.studies.thresholds.threshold_result import Threshold, laws_beside

_LAWS = {
    "law_seuil": r"paper, Eq. 22: $A_\theta^*$",
    "law_corrected": "with the term it drops",
    "law_two_sliders": "two sliders, exact",
    "none": "below this none creeps for ever",
}
_FURTHER, _MOST_CYCLES = 8, 200  # cycles drawn after both sides have settled, and most in all
_SPARE = 10
"""Decimal digits of the runs on both sides, in addition to the digits of the threshold."""
_OPEN = 1.05
"""If the last window is open, the axis ends at this multiple of the window's lower edge."""


@styled
def draw_threshold(found: Threshold) -> Figure:
    """Draw windows (and displacements on both sides), or velocities, over the amplitude."""
    chain = found.chain
    title = f"N = {chain.n}, sigma_mu = {float(chain.sigma_mu):.6g}: {_cut(found.finding)}"
    sides = found.kind != INTERCEPT and found.lower is not None and found.upper is not None
    figure = new_figure(6.0, 6.0 if sides else 4.4, title)
    axes, *under = figure.subplots(1 + sides, 1, height_ratios=(1, 2.4)[: 1 + sides],
                                   squeeze=False)[:, 0]  # fmt: skip
    if found.kind == INTERCEPT:
        _velocities(axes, found)
    else:
        _windows(axes, found)
        for beneath in under:
            _advance(beneath, found)
    laws = {**laws_beside(chain), "none": edges(chain).get("no_lasting_creep")}
    known = {name: float(str(value)) for name, value in laws.items() if value is not None}
    for (name, value), dashes in zip(known.items(), itertools.cycle(DASHES[1:]), strict=False):
        axes.axvline(value, color=INKS[7 if name == "none" else 1], linestyle=dashes,
                     label=f"{_LAWS[name]}: {value:.6g}")  # fmt: skip
    axes.margins(x=0.08)
    axes.set_xlabel(r"amplitude $A_\theta$")
    axes.locator_params(axis="x", nbins=6)
    figure.legend(loc="outside lower center", fontsize=7)
    return figure


def _advance(axes: Axes, found: Threshold) -> None:
    """Draw x_G at the ends of cycles on both sides of a threshold, computed by its solver."""
    cycles = found.cycles
    if found.fates is not None:
        settled = [fate.settled_after for fate in found.fates if fate is not None]
        cycles = max((after or 0 for after in settled), default=0) + _FURTHER
    cycles = min(cycles, found.cycles, _MOST_CYCLES)
    certified = found.solver == "certified"
    options: dict[str, Any] = {"digits": found.digits + _SPARE} if certified else {}
    for side, ink, words in ((found.lower, INKS[6], "below"), (found.upper, INKS[1], "above")):
        run = creep(found.chain, Cycles(str(side), cycles), solver=found.solver, **options)
        x_g = floats(run.recorded["x_G"][1::2])
        axes.plot(np.arange(x_g.size + 1), np.append(0.0, x_g), color=ink, marker=".",
                  linewidth=1.0, label=f"{words}: A = {_cut(str(side))}")  # fmt: skip
    axes.set(xlabel="cycle", ylabel=DISPLACEMENT)
    axes.xaxis.set_major_locator(MaxNLocator(8, integer=True))


def _cut(text: str) -> str:
    """Return a text whose decimals are cut to 45 digits."""
    return re.sub(r"(\.\d{45})\d+", r"\1...", text)


def _velocities(axes: Axes, found: Threshold) -> None:
    axes.errorbar(found.amplitudes, found.velocities, 1.96 * found.errors, fmt="o",
                  color=INKS[0], markersize=3, label="measured, 95 %")  # fmt: skip
    if np.isfinite(found.intercept):
        ends = np.array([found.intercept, found.amplitudes.max()])
        label = f"line, zero at {found.intercept:.6g}"
        axes.plot(ends, found.slope * (ends - found.intercept), color=INKS[2], label=label)
    axes.axhline(0.0, color=INKS[6], linewidth=0.6)
    axes.set_ylabel(f"velocity per half-cycle  {LENGTH}")


def _windows(axes: Axes, found: Threshold) -> None:
    ends = [(float(edge.middle), edge.begins) for edge in found.edges or ()]
    label = found.what
    if len(ends) > 1:  # the first edge is exact; the others come from the float64 scan
        label += " (float64 scan)"
    for begin in [end for end, begins in ends if begins]:
        later = (end for end, begins in ends if not begins and end > begin)
        stop = min(later, default=_OPEN * begin)
        axes.axvspan(begin, stop, color=INKS[4], alpha=0.4, linewidth=0, label=label)
        label = ""
    if found.lower is not None and found.upper is not None:
        middle = (float(found.lower) + float(found.upper)) / 2
        axes.axvline(middle, color=INKS[0], label=f"{found.what} begins: {middle:.9g}")
    axes.set_yticks([])
