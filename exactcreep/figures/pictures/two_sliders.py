"""Pictures of two sliders: trace, velocity over the slope and over the size of dilations."""

from __future__ import annotations

from fractions import Fraction
from functools import partial

import numpy as np
from matplotlib.figure import Figure

from exactcreep.figures import drawing
from exactcreep.figures.departures import margin
from exactcreep.figures.drawing import EXACT, PRINTED, VELOCITY, Picture
from exactcreep.figures.style import DASHED, GUIDE, INKS, Style
from exactcreep.figures.tables import Data, Point, Table, series
from exactcreep.laws import LAWS, law_values

_LAW = "velocity_th_2_gaussienne_corrected"
_PLATEAU = "velocity_th_2_gaussian"
_ASYMPTOTE: Style = {
    "color": "0.6",
    "linewidth": 0.9,
    "label": r"$\tilde{l}_0\sigma_\theta/\sqrt{\pi}$",
}
_NOTE = (
    "The printed law has mu_s cos(alpha) - sin(alpha) where mu_d cos(alpha) - sin(alpha) belongs"
    " (it is low by (2/3)(mu_s - mu_d) cos(alpha)), and is the first two terms of the exact one."
)


def _remark(point: Point) -> str:
    slope, friction, width = (float(point.parameters[name])
                              for name in ("tan_alpha", "mu_d", "sigma_mu"))  # fmt: skip
    if slope == 0:
        return "alpha = 0: no direction is preferred, by symmetry there is no creep"
    if slope < 3 * width:
        return (
            "tan(alpha) is of the order of sigma_mu: the disorder decides which slider gives"
            " way, and uphill and downhill slips cancel in part"
        )
    if friction - slope < 3 * width:
        return "close to mu_d: the slip of one slider sets off the other, and both go down together"
    if float(point.parameters["l0"] * point.parameters["sigma_theta"]) < margin(point.parameters):
        return (
            "rare events: a slip must overcome the largest of many drawn coefficients, and D is"
            " not small beside l0 sigma_theta"
        )
    return "the scatter sigma_mu of the static coefficient, which the law neglects"


# --- the trace -----------------------------------------------------------------------------------

_SHOWN = 24  # dilations of the trace that can be told apart


@partial(
    Picture, "two-sliders-trace", (5.4, 5.6),
    series("Two sliders under random dilations, l0 sigma_theta = 100", _LAW,
           _remark, _NOTE),
    {"two-sliders-trace": {}}, figure="position2sliders", always={"run.record": ["x_G", "x"]},
)  # fmt: skip
def trace(figure: Figure, data: Data, tables: list[Table]) -> None:
    """Draw theta and the displacements of two sliders, and the long run in an inset."""
    dataset = data["two-sliders-trace"]
    theta = np.concatenate([[0.0], dataset["recorded_theta"].to_numpy()])
    x = np.vstack([[0.0, 0.0], dataset["recorded_x"].to_numpy()])
    mean = x.mean(axis=1)
    time = np.arange(theta.size)
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(1, 2.1))
    shown = slice(0, _SHOWN + 1)
    top.step(time[shown], theta[shown], where="post", color="0.2", linewidth=1)
    top.axhline(0, color="0.7", linewidth=0.6, zorder=0)
    top.set_ylabel(r"dilation $\theta$")
    for values, ink, dashes, width, name in (
        (x[:, 0], INKS[0], DASHED, 1.3, r"$\Delta\tilde{x}_1$ (upper)"),
        (x[:, 1], INKS[1], (0, (1, 1)), 1.3, r"$\Delta\tilde{x}_2$ (lower)"),
        (mean, INKS[6], "-", 1.6, r"$\Delta\tilde{x}_G$"),
    ):
        style = {"color": ink, "linestyle": dashes, "linewidth": width, "label": name}
        bottom.step(time[shown], values[shown], where="post", **style)
    room = float(mean[shown].max() - min(mean[shown].min(), 0))
    bottom.set(
        xlim=(0, _SHOWN), xlabel=r"time $t/\tau_\mathrm{th}$ (temperature changes)",
        ylim=(-0.06 * room, 1.12 * room), ylabel=r"displacement ($g\,\tau_\mathrm{dyn}^2$)",
    )  # fmt: skip
    bottom.legend(loc="upper left")
    inset = bottom.inset_axes((0.59, 0.11, 0.37, 0.36))
    inset.plot(time, mean / 1000, color=INKS[6], linewidth=1)
    (row,) = tables[0].rows
    (law,) = row.printed
    inset.plot(time, law * time / 1000, **PRINTED)
    inset.set(xlim=(0, time[-1]), ylim=(0, None))
    inset.set_title(rf"long run: {row.measured:.1f} per change; law {law:.1f}", fontsize=7, pad=3)
    inset.set_ylabel(r"$\Delta\tilde{x}_G/10^3$", fontsize=8, labelpad=1)
    inset.tick_params(labelsize=7)


# --- over the slope ------------------------------------------------------------------------------


@partial(
    Picture, "two-sliders-angle", (5.2, 3.9),
    series("Two sliders, random dilations, over tan(alpha)", _LAW, _remark, _NOTE),
    {"two-sliders-angle": {"drive.steps": 1000}}, figure="velocity2sliders",
)  # fmt: skip
def angle(figure: Figure, data: Data, tables: list[Table]) -> None:
    """Draw the velocity of two sliders over the slope."""
    (table,) = tables
    axes = figure.subplots()
    over = "tan_alpha", [Fraction(k, 200) for k in range(1, 100)], table.parameters
    drawing.draw_law(axes, _PLATEAU, *over, **_ASYMPTOTE, linestyle="-")
    drawing.draw_law(axes, _LAW, *over)
    label = f"{drawing.LIMIT}: " + r"$\tilde{l}_0\sigma_\theta\,I(h)$"
    drawing.draw_law(axes, _LAW, *over, "exact", label=label)
    drawing.draw_points(axes, table.rows, "tan_alpha", **drawing.RANDOM, label="computed")
    low, high = (law_values(LAWS[f"alpha_c_{end}"].printed, table.parameters)[0]
                 for end in ("minus", "plus"))  # fmt: skip
    for place, name, side, apart in (
        (low, r"$\alpha_\mathrm{c}^-$", "left", 2),
        (high, r"$\alpha_\mathrm{c}^+$", "right", -2),
        (float(table.parameters["mu_d"]), r"$\alpha_\mathrm{c}$", "left", 2),
    ):
        axes.axvline(place, **GUIDE, zorder=0)
        axes.annotate(name, (place, 0.35), xytext=(apart, 0), textcoords="offset points", ha=side,
                      fontsize=9)  # fmt: skip
    axes.set(xlim=(-0.01, 0.53), ylim=(0, 7), xlabel=drawing.SLOPE, ylabel=VELOCITY)
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 0.12))
    drawing.degrees(axes)


# --- over the size of the dilations --------------------------------------------------------------


@partial(
    Picture, "two-sliders-amplitude", (5.2, 5.2),
    series("Two sliders, random dilations, over sigma_theta", _LAW, _remark, _NOTE),
    {"two-sliders-amplitude": {"drive.steps": 800}}, figure="velocity2sliders_theta",
)  # fmt: skip
def amplitude(figure: Figure, data: Data, tables: list[Table]) -> None:
    """Draw the velocity of two sliders over sigma_theta, and its ratio to the asymptote."""
    rows, parameters = tables[0].rows, tables[0].parameters
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(1.6, 1))
    sizes = np.geomspace(1e-4, 0.12, 240).tolist()
    over = "sigma_theta", sizes, parameters
    base, printed = (drawing.law_line(label, *over) for label in (_PLATEAU, _LAW))
    exact = drawing.law_line(_LAW, *over, "exact")
    top.plot(sizes, base, **_ASYMPTOTE)
    positive = np.where(printed > 0, printed, np.nan)
    top.plot(sizes, positive, **PRINTED, label=drawing.law_name(_LAW))
    label = r"$\tilde{l}_0\sigma_\theta\,I(h)$, $h = m/(\tilde{l}_0\sigma_\theta)$"
    top.plot(sizes, exact, **EXACT, label=label)
    positive_rows = [row for row in rows if row.measured > 0]
    drawing.draw_points(top, positive_rows, "sigma_theta", **drawing.RANDOM, label="computed")
    top.set(yscale="log", ylim=(1e-4, 150), ylabel=VELOCITY)
    top.legend(loc="lower right")
    bottom.plot(sizes, np.ones(len(sizes)), **_ASYMPTOTE)
    bottom.plot(sizes, printed / base, **PRINTED)
    bottom.plot(sizes, exact / base, **EXACT)

    def ratio(row: Point) -> float:
        return 1 / law_values(LAWS[_PLATEAU].printed, row.parameters)[0]

    drawing.draw_points(bottom, rows, "sigma_theta", ratio, **drawing.RANDOM)
    (star,) = law_values(LAWS["threshold_th_2_gaussienne_corrected"].printed, parameters)
    for axes in (top, bottom):
        axes.axvline(star, **GUIDE, zorder=0)
    top.annotate(r"$\sigma_\theta^*$", (star, 20.0), xytext=(3, 0), textcoords="offset points")
    bottom.set(
        xscale="log", ylim=(-0.1, 1.15), xlim=(8e-5, 0.13), ylabel="velocity / asymptote",
        xlabel=r"$\sigma_\theta$   ($\tilde{l}_0 = 10^3$)",
    )  # fmt: skip
