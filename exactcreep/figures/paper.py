"""The paper's figures with data: the scenes behind each, its table beside the laws, its drawing."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from exactcreep.figures import drawing
from exactcreep.figures.drawing import (
    CYCLES,
    EXACT,
    LIMIT,
    PRINTED,
    RANDOM,
    VELOCITY,
    Picture,
)
from exactcreep.figures.style import DASHED, DASHES, GUIDE, INKS, Style
from exactcreep.figures.tables import LAWS, Data, Point, Table, series
from exactcreep.laws import (
    critical_angle,
    law_values,
    plateau_ends,
    threshold_amplitude,
    threshold_width,
)
from exactcreep.model.numbers import InputError

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


# --- the trace ------------------------------------------------------------------------------------

_SHOWN = 24  # dilations of the trace that can be told apart


@partial(
    Picture, "two-sliders-trace", (5.4, 5.6),
    series("Two sliders under random dilations, l0 sigma_theta = 100", _LAW, _NOTE),
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


# --- over the slope -------------------------------------------------------------------------------


@partial(
    Picture, "two-sliders-angle", (5.2, 3.9),
    series("Two sliders, random dilations, over tan(alpha)", _LAW, _NOTE),
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
    low, high = plateau_ends(**{name: table.parameters[name] for name in ("mu_d", "sigma_mu")})
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


# --- over the size of the dilations ---------------------------------------------------------------


@partial(
    Picture, "two-sliders-amplitude", (5.2, 5.2),
    series("Two sliders, random dilations, over sigma_theta", _LAW, _NOTE),
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
    drawing.draw_points(top, rows, "sigma_theta", **drawing.RANDOM, label="computed")
    top.set(yscale="log", ylim=(1e-4, 150), ylabel=VELOCITY)
    top.legend(loc="lower right")
    bottom.plot(sizes, np.ones(len(sizes)), **_ASYMPTOTE)
    bottom.plot(sizes, printed / base, **PRINTED)
    bottom.plot(sizes, exact / base, **EXACT)

    def ratio(row: Point) -> float:
        return 1 / law_values(LAWS[_PLATEAU].printed, row.parameters)[0]

    drawing.draw_points(bottom, rows, "sigma_theta", ratio, **drawing.RANDOM)
    (star,) = law_values(threshold_width, parameters | {"mu_d": parameters["mu_s"]})
    for axes in (top, bottom):
        axes.axvline(star, **GUIDE, zorder=0)
    top.annotate(r"$\sigma_\theta^*$", (star, 20.0), xytext=(3, 0), textcoords="offset points")
    bottom.set(
        xscale="log", ylim=(-0.1, 1.15), xlim=(8e-5, 0.13), ylabel="velocity / asymptote",
        xlabel=r"$\sigma_\theta$   ($\tilde{l}_0 = 10^3$)",
    )  # fmt: skip


# --- chains ---------------------------------------------------------------------------------------

_BELOW = "Below its threshold the printed law does not hold; the exact one is zero."
_TWO_TERMS = "The printed law is the first two terms of the exact one in N m/(2 l0 sigma_theta)."
_FOURS = (
    "N = 4k at tan(alpha) = mu_d/2 stands on the edge between two plateaus: the sliding limit is"
    " not unique, and both values are given."
)
_RANDOM_LAW: Style = {**PRINTED, "color": INKS[3]}  # where that of cycles is drawn too


# --- plateaus over the slope ----------------------------------------------------------------------


@partial(
    Picture, "chain-plateaus", (5.6, 4.4),
    series("Five and six sliders, random dilations, over tan(alpha)", "vitesse_random",
           "The printed plateau is the limit of large dilations; the exact law knows the play"
           " N (mu_d cos(alpha) - sin(alpha)) that each reversal costs."),
    {"chain-plateaus": {"drive.steps": 50}}, figure="velocityNsliders",
)  # fmt: skip
def plateaus(figure: Figure, data: Data, tables: list[Table]) -> None:
    """Draw the velocity of five and of six sliders over the slope, with the plateaus."""
    axes = figure.subplots()
    for n, marks, dashes, width in ((5, CYCLES, DASHES[2], 1.2), (6, RANDOM, "-", 1.1)):
        rows = [row for row in tables[0].rows if row.varied["n"] == n]
        parameters = rows[0].parameters
        line = {"color": INKS[0], "linestyle": dashes, "linewidth": width}
        label = f"{drawing.law_name('vitesse')}, $N={n}$"
        drawing.draw_plateaus(axes, "vitesse_random", "printed", parameters, **line, label=label)
        exact = {**EXACT, "label": f"{LIMIT}, $N={n}$"}
        if n == 5:
            exact["linestyle"] = dashes
        drawing.draw_plateaus(axes, "vitesse_random", "exact", parameters, **exact)
        drawing.draw_points(axes, rows, "tan_alpha", **marks, label=rf"computed, $N={n}$")
        _mark_angles(axes, n, parameters)
    axes.axvline(float(parameters["mu_d"]), **GUIDE)
    axes.annotate(r"$\alpha_\mathrm{c}$", (0.5, 1), xytext=(3, 0), textcoords="offset points")
    axes.set(xlim=(-0.01, 0.53), ylim=(-4.2, 42), xlabel=drawing.SLOPE, ylabel=VELOCITY)
    axes.legend(loc="upper left", ncols=1)
    drawing.degrees(axes)


def _mark_angles(axes: Axes, n: int, parameters: Mapping[str, Any]) -> None:
    """Mark the printed critical angles and the windows of two pivots below each."""
    friction, static = (parameters[name] for name in ("mu_d", "mu_s"))
    width = float(2 * (static - friction) / n)
    height = -1.4 if n == 6 else -2.8
    for i in range(2, n + 1):
        upper = float(critical_angle(n=n, i=i, mu_d=friction, mu_s=static))
        if upper <= 0:
            continue
        name = r"two stable pivots, up to $\alpha^*_{N,i}$" if n == 6 and i == 2 else None
        axes.plot([max(upper - width, 0), upper], [height, height], color=INKS[2], linewidth=3,
                  solid_capstyle="butt", zorder=1, label=name)  # fmt: skip
        axes.plot([upper], [height], marker="|", color=INKS[2], markersize=6)
        if i == 2:
            axes.annotate(f"$N={n}$", (upper, height), xytext=(5, -3), textcoords="offset points",
                          fontsize=7, color=INKS[2])  # fmt: skip


# --- over the amplitude ---------------------------------------------------------------------------


_CYCLES = series("Thirty sliders, cycles, over the amplitude", "vitesse_seuil",
                 _BELOW)  # fmt: skip
_RANDOM = series("Thirty sliders, random dilations, over sigma_theta", "vitesse_seuil_random",
                 _TWO_TERMS, "chain-amplitude-random")  # fmt: skip


@partial(
    Picture, "chain-amplitude", (5.4, 4.2), lambda data: _CYCLES(data) + _RANDOM(data),
    {"chain-amplitude": {"drive.cycles": 30}, "chain-amplitude-random": {"drive.steps": 40}},
    figure="velocityNslidersbis",
)  # fmt: skip
def chain_amplitude(figure: Figure, data: Data, tables: list[Table]) -> None:
    """Draw the velocity of thirty sliders over A_theta and over sigma_theta."""
    cycles, random = tables
    chain = cycles.parameters
    axes = figure.subplots()
    sizes = np.linspace(1e-4, 0.0125, 160).tolist()
    drawing.draw_law(axes, "vitesse_seuil", "amplitude", sizes, chain)
    over = "vitesse_seuil_random", "sigma_theta", sizes, chain
    drawing.draw_law(axes, *over, **_RANDOM_LAW)
    drawing.draw_law(axes, *over, "exact", label=f"{LIMIT}: $I(h)$")
    drawing.draw_points(axes, cycles.rows, "amplitude", **CYCLES, label="cycles, computed")
    label = "random dilations, computed"
    drawing.draw_points(axes, random.rows, "sigma_theta", **RANDOM, label=label)
    for threshold, text, side, apart in (
        (threshold_amplitude, r"$A_\theta^*$", "right", -3),
        (threshold_width, r"$\sigma_\theta^*$", "left", 3),
    ):
        (place,) = law_values(threshold, chain)
        axes.plot([place, place], [-3, 34], **GUIDE)
        axes.annotate(text, (place, 29), xytext=(apart, 0), textcoords="offset points", ha=side)
    axes.axhline(0, color="0.7", linewidth=0.6, zorder=0)
    axes.set(
        xlim=(0, 0.0125), xlabel=r"$A_\theta$ or $\sigma_\theta$   ($\tilde{l}_0 = 10^3$)",
        ylim=(-3, 100), ylabel=VELOCITY,
    )  # fmt: skip
    axes.legend(loc="upper left")


# --- over the number of sliders -------------------------------------------------------------------

_SIZE = series("Cycles, over the number of sliders", "vitesse_seuil",
               f"{_BELOW} {_FOURS}")  # fmt: skip
_SIZE_RANDOM = series("Random dilations, over the number of sliders", "vitesse_seuil_random",
                      f"{_TWO_TERMS} {_FOURS}", "chain-size-random")  # fmt: skip


@partial(
    Picture, "chain-size", (5.6, 4.4), lambda data: _SIZE(data) + _SIZE_RANDOM(data),
    {
        "chain-size": {"drive.cycles": 25},
        "chain-size-random": {
            "drive.steps": 30,
            "vary.chain.n": [*range(2, 9), 10, 12, 14, 18, 22, 26, 30, 38, 46, 56, 64],
        },
    },
    figure="cloche",
)  # fmt: skip
def size(figure: Figure, data: Data, tables: list[Table]) -> None:
    """Draw the velocity over the number of sliders, with the discrete plateaus behind it."""
    axes = figure.subplots()
    sizes = range(2, 67)
    for table, label, style, longest in zip(
        tables, ("vitesse_seuil", "vitesse_seuil_random"), (PRINTED, _RANDOM_LAW), (46, 66),
        strict=True,
    ):  # fmt: skip
        parameters = table.parameters
        # the continuous i of Eq. (critical_angle): N + 3 - 2i = N tan(alpha)/mu_d
        slope = parameters["tan_alpha"] / parameters["mu_d"]
        form, between = LAWS[label].printed, [{"n": n, "i": (n + 3 - n * slope) / 2} for n in sizes]
        smooth = [law_values(form, parameters | place)[0] for place in between]
        axes.plot(sizes, smooth, **style, label=f"{drawing.law_name(label)}, continuous $i$")
        tight = [(n, value) for n in sizes if n <= longest
                 for value in law_values(LAWS[label].exact, parameters | {"n": n})]  # fmt: skip
        axes.plot(
            *zip(*tight, strict=True), linestyle="none", marker="_", markersize=7,
            markeredgewidth=1.1, color=style["color"], alpha=0.8, zorder=2,
            label=f"{LIMIT}, integer $i$",
        )  # fmt: skip
    for table, style, name in zip(
        tables, (CYCLES, RANDOM), ("cycles", "random dilations"), strict=True
    ):
        drawing.draw_points(axes, table.rows, "n", **style, label=f"{name}, computed")
    axes.axhline(0, color="0.7", linewidth=0.6, zorder=0)
    axes.set(xlim=(0, 66), ylim=(-2, 62), xlabel=r"number of sliders $N$", ylabel=VELOCITY)
    axes.legend(loc="upper left")


# --- irregular creep ------------------------------------------------------------------------------


@partial(
    Picture, "chain-jumps", (5.8, 4.3),
    series("Thirty sliders without disorder near the critical amplitude, from several starts",
           "vitesse_seuil"),
    {"chain-jumps": {
        "drive.cycles": 600,
        "vary.run.start": ["relaxed", *({"size": "1e-6", "seed": k} for k in (1, 2, 3))],
    }},
    figure="jumps", always={"run.record": ["x_G"]},
)  # fmt: skip
def jumps(figure: Figure, data: Data, tables: list[Table]) -> None:
    """Draw x_G(t) just above and just below the critical amplitude, from several starts."""
    recorded = data["chain-jumps"]["recorded_x_G"]
    x = recorded.transpose("amplitude", "start", "half_cycle").to_numpy()
    time = np.arange(x.shape[-1] + 1)
    axes = figure.subplots()
    others: Style = {"linewidth": 0.7, "linestyle": (0, (4, 1))}
    for k, ink, name in ((1, INKS[6], "1.01"), (0, "0.6", "0.99")):
        relaxed: Style = {"linewidth": 1.5, "label": rf"$A_\theta = {name}\,A_\theta^*$"}
        for number, course in enumerate(x[k]):
            style = others if number else relaxed
            axes.plot(time, np.append(0.0, course), color=ink, zorder=2 + k, **style)
    label = rf"{x.shape[1] - 1} starts each with tensions of $10^{{-6}}$"
    axes.plot([], [], color=INKS[6], **others, label=label)
    axes.set(
        xlim=(0, time[-1]), xlabel=r"time $t/\tau_\mathrm{th}$ (half-cycles)",
        ylim=(min(-1.0, 1.1 * float(x.min())), None),
        ylabel=r"displacement $\Delta\tilde{x}_G$ ($g\,\tau_\mathrm{dyn}^2$)",
    )  # fmt: skip
    axes.xaxis.set_major_locator(MaxNLocator(6))
    axes.legend(loc="upper left")


PICTURES: Mapping[str, Picture] = {
    picture.name: picture for picture in list(vars().values()) if isinstance(picture, Picture)
}
"""The paper's figures by name, in the paper's order."""


def picture_named(name: str) -> Picture:
    """Return the picture of that name, or raise `InputError`."""
    if name not in PICTURES:
        near = difflib.get_close_matches(name, PICTURES, 1, 0.5)
        hint = f" (did you mean {near[0]}?)" if near else ""
        raise InputError("picture", name, "must be all or one of " + ", ".join(PICTURES) + hint)
    return PICTURES[name]
