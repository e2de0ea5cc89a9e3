"""Pictures of chains: plateaus, velocity over amplitude and size, irregular creep."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from exactcreep.figures.departures import BELOW_THRESHOLD, pivot_remark, setting_amplitude
from exactcreep.figures.drawing import (
    CYCLES,
    EXACT,
    PRINTED,
    RANDOM,
    SLOPE,
    VELOCITY,
    Data,
    degrees,
    law_line,
    law_name,
    plateau_lines,
    points,
)
from exactcreep.figures.style import INKS, picture
from exactcreep.figures.tables import Cell, Series, Table, cells, tables_of
from exactcreep.laws import LAWS, critical_amplitude, law_values

_TWO_TERMS = "The printed law is the first two terms of the exact one in N m/(2 l0 sigma_theta)."
_FOURS = (
    "N = 4k at tan(alpha) = mu_d/2 stands on the edge between two plateaus: the sliding limit is"
    " not unique, and both values are given."
)


# --- plateaus over the slope ---------------------------------------------------------------------


plateau_tables = tables_of(
    Series("chain-plateaus", "Five and six sliders, random dilations, over tan(alpha)",
           "vitesse_random", pivot_remark,
           "The printed plateau is the limit of large dilations; the exact law knows the play"
           " N (mu_d cos(alpha) - sin(alpha)) that each reversal costs.")
)  # fmt: skip


def draw_plateaus(data: Data, tables: list[Table]) -> Figure:
    """Draw the velocity of five and of six sliders over the slope, with the plateaus."""
    rows = tables[0].rows
    every = cells(data["chain-plateaus"])
    figure = picture(5.6, 4.4)
    axes = figure.subplots()
    styles = (
        (5, CYCLES, {"color": INKS[0], "linestyle": (0, (1, 1)), "linewidth": 1.2}),
        (6, RANDOM, {"color": INKS[0], "linestyle": "-", "linewidth": 1.1}),
    )
    for n, marks, line in styles:
        parameters = next(cell.parameters for cell in every if cell.parameters["n"] == n)
        plateau_lines(
            axes, "vitesse_random", "printed", parameters, **line,
            label=rf"{law_name('vitesse')}, $N={n}$",
        )  # fmt: skip
        exact = {**EXACT, "linestyle": line["linestyle"] if n == 5 else EXACT["linestyle"]}
        plateau_lines(
            axes, "vitesse_random", "exact", parameters, **exact,
            label=rf"exact for $\mu_\mathrm{{s}}\to\mu_\mathrm{{d}}$, $N={n}$",
        )  # fmt: skip
        kept = [row for row in rows if row.varied["n"] == n]
        points(axes, kept, "tan_alpha", **marks, label=rf"computed, $N={n}$")
        _mark_angles(axes, n, parameters)
    axes.axvline(float(every[0].parameters["mu_d"]), color="0.55", linewidth=0.7,
                 linestyle=(0, (1, 2)))  # fmt: skip
    axes.annotate(r"$\alpha_\mathrm{c}$", (0.5, 1), xytext=(3, 0), textcoords="offset points")
    axes.set(xlim=(-0.01, 0.53), ylim=(-4.2, 42), xlabel=SLOPE, ylabel=VELOCITY)
    axes.legend(loc="upper left", ncols=1)
    degrees(axes)
    return figure


def _mark_angles(axes: Axes, n: int, parameters: Mapping[str, Any]) -> None:
    """Mark the printed critical angles and the windows of two pivots below each."""
    law = LAWS["critical_angle"].printed
    friction, static = (parameters[name] for name in ("mu_d", "mu_s"))
    height = -1.4 if n == 6 else -2.8
    for i in range(2, n + 1):
        upper = float(law(n=n, i=i, mu_d=friction, mu_s=static))
        width = float(2 * (static - friction) / n)
        if upper <= 0:
            continue
        name = r"two stable pivots, up to $\alpha^*_{N,i}$" if n == 6 and i == 2 else None
        axes.plot([max(upper - width, 0), upper], [height, height], color=INKS[2], linewidth=3,
                  solid_capstyle="butt", zorder=1, label=name)  # fmt: skip
        axes.plot([upper], [height], marker="|", color=INKS[2], markersize=6)
        if i == 2:
            axes.annotate(
                f"$N={n}$", (upper, height), xytext=(5, -3),
                textcoords="offset points", fontsize=7, color=INKS[2],
            )  # fmt: skip


# --- over the amplitude --------------------------------------------------------------------------


def _threshold_remark(cell: Cell) -> str:
    size = "amplitude" if "amplitude" in cell.parameters else "sigma_theta"
    relative = float(cell.parameters[size]) / critical_amplitude(cell.parameters)
    if size == "amplitude" and 0.97 < relative < 1.15:
        return (
            "within 15 % of the threshold the excess mu_s - mu_d decides whether the whole chain"
            " moves"
        )
    if size == "sigma_theta" and relative < 0.6:
        return "far below the threshold: rare large dilations, and slips of size D at both ends"
    return pivot_remark(cell)


amplitude_tables = tables_of(
    Series("chain-amplitude", "Thirty sliders, cycles, over the amplitude", "vitesse_seuil",
           _threshold_remark, BELOW_THRESHOLD),
    Series("chain-amplitude-random", "Thirty sliders, random dilations, over sigma_theta",
           "vitesse_seuil_random", _threshold_remark, _TWO_TERMS),
)  # fmt: skip


def draw_amplitude(data: Data, tables: list[Table]) -> Figure:
    """Draw the velocity of thirty sliders over A_theta and over sigma_theta."""
    cycles, random = tables
    parameters = cells(data["chain-amplitude"])[0].parameters
    chain = {name: value for name, value in parameters.items() if name != "amplitude"}
    figure = picture(5.4, 4.2)
    axes = figure.subplots()
    sizes = np.linspace(1e-4, 0.0125, 160).tolist()
    for label, over, printed in (
        ("vitesse_seuil", "amplitude", PRINTED),
        ("vitesse_seuil_random", "sigma_theta", {**PRINTED, "color": INKS[3]}),
    ):
        line = law_line(LAWS[label].printed, over, sizes, chain)
        axes.plot(sizes, line, **printed, label=law_name(label))
    exact = law_line(LAWS["vitesse_seuil_random"].exact, "sigma_theta", sizes, chain)
    axes.plot(sizes, exact, **EXACT, label=r"exact for $\mu_\mathrm{s}\to\mu_\mathrm{d}$: $I(h)$")
    points(axes, cycles.rows, "amplitude", **CYCLES, label="cycles, computed")
    points(axes, random.rows, "sigma_theta", **RANDOM, label="random dilations, computed")
    for label, text in (("seuil", r"$A_\theta^*$"), ("sigma_theta_star", r"$\sigma_\theta^*$")):
        place = law_values(LAWS[label].printed, chain)[0]
        axes.plot([place, place], [-3, 34], color="0.55", linewidth=0.7, linestyle=(0, (1, 2)))
        side = ("right", -3) if label == "seuil" else ("left", 3)
        axes.annotate(text, (place, 29), xytext=(side[1], 0), textcoords="offset points",
                      ha=side[0])  # fmt: skip
    axes.set(xlim=(0, 0.0125), ylim=(-3, 100))
    axes.axhline(0, color="0.7", linewidth=0.6, zorder=0)
    axes.set(xlabel=r"$A_\theta$ or $\sigma_\theta$   ($\tilde{l}_0 = 10^3$)", ylabel=VELOCITY)
    axes.legend(loc="upper left")
    return figure


# --- over the number of sliders ------------------------------------------------------------------


size_tables = tables_of(
    Series("chain-size", "Cycles, over the number of sliders", "vitesse_seuil",
           _threshold_remark, f"{BELOW_THRESHOLD} {_FOURS}"),
    Series("chain-size-random", "Random dilations, over the number of sliders",
           "vitesse_seuil_random", _threshold_remark, f"{_TWO_TERMS} {_FOURS}"),
)  # fmt: skip


def draw_size(data: Data, tables: list[Table]) -> Figure:
    """Draw the velocity over the number of sliders, with the discrete plateaus behind it."""
    cycles, random = tables
    figure = picture(5.6, 4.4)
    axes = figure.subplots()
    for name, label, style in (
        ("chain-size", "vitesse_seuil", PRINTED),
        ("chain-size-random", "vitesse_seuil_random", {**PRINTED, "color": INKS[3]}),
    ):
        parameters = cells(data[name])[0].parameters
        form = LAWS[label].printed
        smooth, tight = [], []
        sizes = list(range(2, 67))
        for n in sizes:
            given = {**parameters, "n": Fraction(n)}
            # the continuous i of Eq. (critical_angle): N + 3 - 2i = N tan(alpha)/mu_d
            i = (n + 3 - n * given["tan_alpha"] / given["mu_d"]) / 2
            used = {key: given[key] for key in form.required}
            smooth.append(float(form(**used, i=i)))
            found = law_values(LAWS[label].exact, given)
            tight += [(n, value) for value in found] if n <= 46 or "random" in name else []
        axes.plot(sizes, smooth, **style, label=f"{law_name(label)}, continuous $i$")
        axes.plot(
            [n for n, _ in tight], [value for _, value in tight], linestyle="none", marker="_",
            markersize=7, markeredgewidth=1.1, color=style["color"], alpha=0.8, zorder=2,
            label=r"exact for $\mu_\mathrm{s}\to\mu_\mathrm{d}$, integer $i$",
        )  # fmt: skip
    points(axes, cycles.rows, "n", **CYCLES, label="cycles, computed")
    points(axes, random.rows, "n", **RANDOM, label="random dilations, computed")
    axes.set(xlim=(0, 66), ylim=(-2, 62))
    axes.axhline(0, color="0.7", linewidth=0.6, zorder=0)
    axes.set(xlabel=r"number of sliders $N$", ylabel=VELOCITY)
    axes.legend(loc="upper left")
    return figure


# --- irregular creep -----------------------------------------------------------------------------


def _jump_remark(cell: Cell) -> str:
    relative = float(cell.parameters["amplitude"]) / setting_amplitude(cell.parameters)
    return (
        f"irregular: A = {relative:.4f} of the amplitude [N m + D]/(2 l0) that sets the whole"
        " chain in motion; it moves on in bursts"
    )


jump_tables = tables_of(
    Series("chain-jumps",
           "Thirty sliders without disorder near the critical amplitude, from several starts",
           "vitesse_seuil", _jump_remark)
)  # fmt: skip


def draw_jumps(data: Data, tables: list[Table]) -> Figure:
    """Draw x_G(t) just above and just below the critical amplitude, from several starts."""
    dataset = data["chain-jumps"]
    x = dataset["recorded_x_G"].transpose("amplitude", "start", "half_cycle").to_numpy()
    time = np.arange(x.shape[-1] + 1)
    figure = picture(5.8, 4.3)
    axes = figure.subplots()
    for k, ink, name in ((1, INKS[6], "1.01"), (0, "0.6", "0.99")):
        for number, course in enumerate(x[k]):
            axes.plot(
                time, np.concatenate([[0.0], course]), color=ink,
                linewidth=1.5 if number == 0 else 0.7,
                linestyle="-" if number == 0 else (0, (4, 1)),
                label=rf"$A_\theta = {name}\,A_\theta^*$" if number == 0 else None, zorder=2 + k,
            )  # fmt: skip
    axes.plot([], [], color=INKS[6], linewidth=0.7, linestyle=(0, (4, 1)),
              label=rf"{x.shape[1] - 1} starts each with tensions of $10^{{-6}}$")  # fmt: skip
    axes.set_xlim(0, time[-1])
    axes.set_ylim(min(-1.0, 1.1 * float(x.min())), None)
    axes.set_xlabel(r"time $t/\tau_\mathrm{th}$ (half-cycles)")
    axes.set_ylabel(r"displacement $\Delta\tilde{x}_G$ ($g\,\tau_\mathrm{dyn}^2$)")
    axes.xaxis.set_major_locator(MaxNLocator(6))
    axes.legend(loc="upper left")
    return figure
