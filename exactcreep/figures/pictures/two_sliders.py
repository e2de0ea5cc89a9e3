"""Pictures of two sliders: trace, velocity over the slope and over the size of dilations."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from matplotlib.figure import Figure

from exactcreep.figures.departures import margin
from exactcreep.figures.drawing import (
    EXACT,
    PRINTED,
    RANDOM,
    SLOPE,
    VELOCITY,
    Data,
    degrees,
    law_line,
    law_name,
    points,
)
from exactcreep.figures.style import INKS, picture
from exactcreep.figures.tables import Cell, Row, Series, Table, cells, tables_of
from exactcreep.laws import LAWS, law_values

_CORRECTED = "velocity_th_2_gaussienne_corrected"
_ASYMPTOTE = r"$\tilde{l}_0\sigma_\theta/\sqrt{\pi}$"
_NOTE = (
    "The printed law has mu_s cos(alpha) - sin(alpha) where mu_d cos(alpha) - sin(alpha) belongs"
    " (it is low by (2/3)(mu_s - mu_d) cos(alpha)), and is the first two terms of the exact one."
)


# --- the trace -----------------------------------------------------------------------------------


trace_tables = tables_of(
    Series("two-sliders-trace", "Two sliders under random dilations, l0 sigma_theta = 100",
           _CORRECTED, lambda cell: "no explanation", _NOTE)
)  # fmt: skip
_SHOWN = 24  # dilations of the trace that can be told apart


def draw_trace(data: Data, tables: list[Table]) -> Figure:
    """Draw theta and the displacements of two sliders, and the long run in an inset."""
    dataset = data["two-sliders-trace"]
    theta = np.concatenate([[0.0], dataset["recorded_theta"].to_numpy()])
    x = np.vstack([[0.0, 0.0], dataset["recorded_x"].to_numpy()])
    mean = x.mean(axis=1)
    time = np.arange(theta.size)
    figure = picture(5.4, 5.6)
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(1, 2.1))
    shown = slice(0, _SHOWN + 1)
    top.step(time[shown], theta[shown], where="post", color="0.2", linewidth=1)
    top.axhline(0, color="0.7", linewidth=0.6, zorder=0)
    top.set_ylabel(r"dilation $\theta$")
    for values, ink, dashes, name in (
        (x[:, 0], INKS[0], (0, (4, 1.5)), r"$\Delta\tilde{x}_1$ (upper)"),
        (x[:, 1], INKS[1], (0, (1, 1)), r"$\Delta\tilde{x}_2$ (lower)"),
        (mean, INKS[6], "-", r"$\Delta\tilde{x}_G$"),
    ):
        bottom.step(
            time[shown], values[shown], where="post", color=ink, linestyle=dashes,
            linewidth=1.6 if dashes == "-" else 1.3, label=name,
        )  # fmt: skip
    bottom.set_xlabel(r"time $t/\tau_\mathrm{th}$ (temperature changes)")
    bottom.set_ylabel(r"displacement ($g\,\tau_\mathrm{dyn}^2$)")
    bottom.legend(loc="upper left")
    bottom.set_xlim(0, _SHOWN)
    room = float(mean[shown].max() - min(mean[shown].min(), 0))
    bottom.set_ylim(-0.06 * room, 1.12 * room)
    inset = bottom.inset_axes((0.59, 0.11, 0.37, 0.36))
    inset.plot(time, mean / 1000, color=INKS[6], linewidth=1)
    cell = cells(dataset)[0]
    law = float(tables[0].rows[0].printed[0])
    inset.plot(time, law * time / 1000, **PRINTED)
    inset.set(xlim=(0, time[-1]), ylim=(0, None))
    inset.set_title(rf"long run: {cell.velocity:.1f} per change; law {law:.1f}", fontsize=7, pad=3)
    inset.set_ylabel(r"$\Delta\tilde{x}_G/10^3$", fontsize=8, labelpad=1)
    inset.tick_params(labelsize=7)
    return figure


# --- over the slope ------------------------------------------------------------------------------


def _angle_remark(cell: Cell) -> str:
    slope, friction = float(cell.parameters["tan_alpha"]), float(cell.parameters["mu_d"])
    width = float(cell.parameters["sigma_mu"])
    if slope == 0:
        return "alpha = 0: no direction is preferred, by symmetry there is no creep"
    if slope < 3 * width:
        return (
            "tan(alpha) is of the order of sigma_mu: the disorder decides which slider gives"
            " way, and uphill and downhill slips cancel in part"
        )
    if friction - slope < 3 * width:
        return "close to mu_d: the slip of one slider sets off the other, and both go down together"
    return _NEGLECTED


_NEGLECTED = "the scatter sigma_mu of the static coefficient, which the law neglects"
angle_tables = tables_of(
    Series("two-sliders-angle", "Two sliders, random dilations, over tan(alpha)", _CORRECTED,
           _angle_remark, _NOTE)
)  # fmt: skip


def draw_angle(data: Data, tables: list[Table]) -> Figure:
    """Draw the velocity of two sliders over the slope."""
    rows = tables[0].rows
    parameters = cells(data["two-sliders-angle"])[0].parameters
    figure = picture(5.2, 3.9)
    axes = figure.subplots()
    slopes = [Fraction(k, 200) for k in range(1, 100)]
    x = [float(slope) for slope in slopes]
    law = LAWS[_CORRECTED]
    plateau = law_line(LAWS["velocity_th_2_gaussian"].printed, "tan_alpha", slopes, parameters)
    axes.plot(x, plateau, color="0.6", linewidth=0.9, label=_ASYMPTOTE)
    printed = law_line(law.printed, "tan_alpha", slopes, parameters)
    axes.plot(x, printed, **PRINTED, label=law_name(_CORRECTED))
    exact = law_line(law.exact, "tan_alpha", slopes, parameters)
    axes.plot(x, exact, **EXACT, label=r"exact for $\mu_\mathrm{s}\to\mu_\mathrm{d}$:"
              r" $\tilde{l}_0\sigma_\theta\,I(h)$")  # fmt: skip
    points(axes, rows, "tan_alpha", **RANDOM, label="computed")
    low = law_values(LAWS["alpha_c_minus"].printed, parameters)[0]
    high = law_values(LAWS["alpha_c_plus"].printed, parameters)[0]
    for place, name in (
        (low, r"$\alpha_\mathrm{c}^-$"),
        (high, r"$\alpha_\mathrm{c}^+$"),
        (float(parameters["mu_d"]), r"$\alpha_\mathrm{c}$"),
    ):
        axes.axvline(place, color="0.55", linewidth=0.7, linestyle=(0, (1, 2)), zorder=0)
        side = "left" if place == low else "right" if place == high else "left"
        axes.annotate(
            name, (place, 0.35), xytext=(2 if side == "left" else -2, 0),
            textcoords="offset points", ha=side, fontsize=9,
        )  # fmt: skip
    axes.set(xlim=(-0.01, 0.53), ylim=(0, 7), xlabel=SLOPE, ylabel=VELOCITY)
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 0.12))
    degrees(axes)
    return figure


# --- over the size of the dilations --------------------------------------------------------------


def _amplitude_remark(cell: Cell) -> str:
    width = float(cell.parameters["l0"] * cell.parameters["sigma_theta"])
    if width < margin(cell.parameters):
        return (
            "rare events: a slip must overcome the largest of many drawn coefficients, and D is"
            " not small beside l0 sigma_theta"
        )
    return _NEGLECTED


amplitude_tables = tables_of(
    Series("two-sliders-amplitude", "Two sliders, random dilations, over sigma_theta", _CORRECTED,
           _amplitude_remark, _NOTE)
)  # fmt: skip


def draw_amplitude(data: Data, tables: list[Table]) -> Figure:
    """Draw the velocity of two sliders over sigma_theta, and its ratio to the asymptote."""
    rows = tables[0].rows
    parameters = cells(data["two-sliders-amplitude"])[0].parameters
    l0 = float(parameters["l0"])
    figure = picture(5.2, 5.2)
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(1.6, 1))
    sizes = np.geomspace(1e-4, 0.12, 240).tolist()
    asymptote = LAWS["velocity_th_2_gaussian"].printed
    law = LAWS[_CORRECTED]
    base = law_line(asymptote, "sigma_theta", sizes, parameters)
    printed = law_line(law.printed, "sigma_theta", sizes, parameters)
    exact = law_line(law.exact, "sigma_theta", sizes, parameters)
    positive = np.where(printed > 0, printed, np.nan)
    top.plot(sizes, base, color="0.6", linewidth=0.9, label=_ASYMPTOTE)
    top.plot(sizes, positive, **PRINTED, label=law_name(_CORRECTED))
    top.plot(sizes, exact, **EXACT, label=r"$\tilde{l}_0\sigma_\theta\,I(h)$,"
             r" $h = m/(\tilde{l}_0\sigma_\theta)$")  # fmt: skip
    points(top, [row for row in rows if row.measured > 0], "sigma_theta", **RANDOM,
           label="computed")  # fmt: skip
    top.set(yscale="log", ylim=(1e-4, 150), ylabel=VELOCITY)
    top.legend(loc="lower right")
    bottom.plot(sizes, np.ones(len(sizes)), color="0.6", linewidth=0.9)
    bottom.plot(sizes, printed / base, **PRINTED)
    bottom.plot(sizes, exact / base, **EXACT)

    def ratio(row: Row) -> float:
        return 1 / float(asymptote(l0=l0, sigma_theta=row.varied["sigma_theta"]))

    points(bottom, rows, "sigma_theta", scale=ratio, **RANDOM)
    star = law_values(LAWS["threshold_th_2_gaussienne_corrected"].printed, parameters)[0]
    for axes in (top, bottom):
        axes.axvline(star, color="0.55", linewidth=0.7, linestyle=(0, (1, 2)), zorder=0)
    top.annotate(r"$\sigma_\theta^*$", (star, 20.0), xytext=(3, 0), textcoords="offset points")
    bottom.set(
        xscale="log", ylim=(-0.1, 1.15), xlim=(8e-5, 0.13), ylabel="velocity / asymptote",
        xlabel=r"$\sigma_\theta$   ($\tilde{l}_0 = 10^3$)",
    )  # fmt: skip
    return figure
