"""Pictures beyond the paper: staircase, windows, map, irregular creep, closed form, pivots."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import PowerNorm
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from exactcreep.figures import departures, drawing
from exactcreep.figures.departures import setting_amplitude
from exactcreep.figures.drawing import EXACT, PRINTED, SLOPE, VELOCITY, Picture, draw_law, law_name
from exactcreep.figures.style import DASHED, DOTTED, INKS, Style
from exactcreep.figures.tables import (
    Data,
    Point,
    Table,
    over_starts,
    points_of,
    series,
    table_beside,
)
from exactcreep.laws import (
    LAWS,
    critical_amplitude,
    gaussian_integral,
    pivots,
    staircase_two_sliders,
)
from exactcreep.model.numbers import exact_number

_SIZE = r"$A_\theta$ ($10^{-3}$; $\tilde{l}_0 = 10^3$)"
_DOTS: Style = {"linestyle": "none", "marker": "o", "markersize": 2.2, "color": INKS[6]}
_CHAIN = ("l0", "mu_d", "mu_s", "tan_alpha")  # of two sliders, whose staircase is known


def _intervals(inside: ArrayLike) -> list[tuple[int, int]]:
    """Return where each stretch of True begins, and where it has ended."""
    edges = np.flatnonzero(np.diff(np.asarray(inside, dtype=int), prepend=0, append=0)).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))


# --- the staircase of two sliders ----------------------------------------------------------------

_LINE = "velocity_th_2_cycle_corrected"


def _start_tension(start: str) -> Fraction:
    """Return r0 = x_2 - x_1 - l0 of a start as a table names it."""
    if start == "relaxed":
        return Fraction(0)
    return exact_number(json.loads(start)["tensions"][0], "tensions")


def _staircase_tables(data: Data) -> list[Table]:
    """Return the velocities of two sliders without disorder beside line and staircase."""
    rows = []
    for point in points_of(data["two-sliders-staircase"]):
        given = {name: point.parameters[name] for name in (*_CHAIN, "amplitude")}
        step = staircase_two_sliders(**given, r0=_start_tension(point.varied["start"]))
        rows.append(replace(point.beside(_LINE), exact=(float(step),)))
    table = table_beside(
        "two-sliders-staircase",
        "Two sliders without disorder, cycles, over the amplitude, from two starts",
        _LINE,
        rows,
        "The printed line touches the staircase of the relaxed chain from below; its mean over"
        " all starts is max(0, l0 A - m).",
    )
    return [
        replace(table, exact="D times the number of rho in r0 + D + 2D Z with |rho| < l0 A - m")
    ]


@partial(
    Picture, "two-sliders-staircase", (5.4, 4.2), _staircase_tables,
    {"two-sliders-staircase": {"drive.cycles": 50}},
)  # fmt: skip
def staircase(figure: Figure, data: Data, tables: list[Table]) -> None:
    """Draw the staircase of two sliders over the paper's line."""
    rows, parameters = tables[0].rows, tables[0].parameters
    chain = {name: parameters[name] for name in _CHAIN}
    axes = figure.subplots()
    shown = np.linspace(0, 1.6, 1601)
    sizes = [Fraction(k, 10**6) + Fraction(1, 10**9) for k in range(1601)]
    over = "amplitude", sizes, parameters
    axes.plot(
        shown, np.maximum(drawing.law_line(_LINE, *over), 0), **PRINTED, label=law_name(_LINE)
    )
    axes.plot(shown, drawing.law_line(_LINE, *over, "corrected"), color="0.55", linewidth=0.9,
              linestyle=(0, (1, 1.5)), label=r"mean over all starts,"
              r" $\max(0, \tilde{l}_0A_\theta - m)$")  # fmt: skip
    starts = list(dict.fromkeys(row.varied["start"] for row in rows))
    for start, ink, marker in zip(starts, (INKS[6], INKS[1]), ("o", "^"), strict=False):
        r0 = _start_tension(start)
        steps = [float(staircase_two_sliders(**chain, amplitude=a, r0=r0)) for a in sizes]
        axes.plot(shown, steps, color=ink, linewidth=0.9, label=rf"exact, $r_0 = {float(r0):g}$")
        kept = [row for row in rows if row.varied["start"] == start]
        axes.plot(
            [1e3 * row.varied["amplitude"] for row in kept], [row.measured for row in kept],
            linestyle="none", marker=marker, markersize=3.2, markerfacecolor="white", color=ink,
            markeredgewidth=0.7, label=rf"computed, $r_0 = {float(r0):g}$",
        )  # fmt: skip
    axes.set(xlim=(0, 1.62), ylim=(-0.05, 1.5), xlabel=f"amplitude {_SIZE}", ylabel=VELOCITY)
    axes.legend(loc="upper left")


# --- windows of creep ----------------------------------------------------------------------------


def _window_tables(data: Data) -> list[Table]:
    """Return the velocities on both sides of every edge between creep and rest."""
    dataset = data["chain-windows"]
    every = points_of(dataset)
    creeps = dataset["outcome"].to_numpy() == "creeping"
    rows = []
    for edge in np.flatnonzero(creeps[1:] != creeps[:-1]).tolist():
        for k in (edge, edge + 1):
            word = "creeps" if creeps[k] else "does not creep"
            ratio = departures.reduced(every[k])
            remark = f"A = {ratio:.4f} A* of Eq. (seuil): the chain {word}"
            rows.append(replace(every[k].beside("vitesse_seuil"), remark=remark))
    parameters = every[0].parameters
    ratio = setting_amplitude(parameters) / critical_amplitude(parameters)
    title = "Three sliders without disorder: the edges of creep"
    note = (
        "The amplitude (N m + D)/(2 l0) that sets the whole chain in motion is"
        f" {ratio:.4f} A*; the laws hold for mu_s -> mu_d, and know of no windows."
    )
    return [table_beside("chain-windows", title, "vitesse_seuil", rows, note)]


@partial(Picture, "chain-windows", (5.6, 4.0), _window_tables, {"chain-windows": {}})
def windows(figure: Figure, data: Data, tables: list[Table]) -> None:
    """Draw the velocity of three sliders above the first threshold."""
    dataset = data["chain-windows"]
    parameters = points_of(dataset)[0].parameters
    star = critical_amplitude(parameters)
    axes = figure.subplots()
    inset = axes.inset_axes((0.55, 0.1, 0.42, 0.36))
    x = dataset["amplitude"].to_numpy() / star
    half = (x[1] - x[0]) / 2
    sizes = np.linspace(x[0], x[-1], 50)
    over = "amplitude", (sizes * star).tolist(), parameters
    law = drawing.law_line("vitesse_seuil", *over, "exact")
    for shown in (axes, inset):
        for first, last in _intervals(dataset["outcome"].to_numpy() == "creeping"):
            ends = x[first] - half, x[last - 1] + half
            shown.axvspan(*ends, color=INKS[4], alpha=0.28, linewidth=0)
        shown.plot(sizes, law, **PRINTED, label=law_name("vitesse_seuil"))
        shown.plot(x, dataset["velocity"], **_DOTS, label="computed, from the relaxed chain")
    place = setting_amplitude(parameters) / star
    axes.axvline(place, ymax=0.8, **{**EXACT, "linewidth": 1.0})  # below the legend
    axes.annotate(
        r"$\frac{Nm+D}{2\,\tilde{l}_0}$", (place, 0.5), xytext=(-4, 0),
        textcoords="offset points", ha="right", fontsize=11, color=EXACT["color"],
    )  # fmt: skip
    axes.set(xlim=(x[0], x[-1]), xlabel=drawing.RATIO, ylabel=VELOCITY)
    axes.legend(loc="upper left")
    inset.set(xlim=(1.22, 1.36), ylim=(-0.03, 0.35))
    inset.tick_params(labelsize=7)
    inset.set_title("shaded: the chain creeps", fontsize=7, pad=2)


# --- the map -------------------------------------------------------------------------------------

_EVERY = 8  # rows of the table: every eighth slope and amplitude


def _map_remark(point: Point) -> str:
    if 0.5 < departures.reduced(point) < 1.5:
        return "near the threshold the excess mu_s - mu_d decides whether the whole chain moves"
    return departures.pivot_remark(point)


_WHOLE_MAP = series(
    "Six sliders, cycles, over slope and amplitude (every eighth point)", "vitesse_seuil",
    _map_remark, departures.BELOW_THRESHOLD,
)  # fmt: skip


def _map_tables(data: Data) -> list[Table]:
    """Return every eighth velocity of the map, in both directions, beside the law."""
    (whole,) = _WHOLE_MAP(data)
    columns = data["chain-map"].sizes["amplitude"]
    first = range(0, len(whole.rows), _EVERY * columns)
    rows = [row for k in first for row in whole.rows[k : k + columns : _EVERY]]
    return [replace(whole, rows=tuple(rows))]


@partial(
    Picture, "chain-map", (5.8, 4.4), _map_tables, {"chain-map": {"drive.cycles": 10}}
)  # fmt: skip
def velocity_map(figure: Figure, data: Data, tables: list[Table]) -> None:
    """Draw the velocity of six sliders over slope and amplitude, thresholds and pivots on it."""
    dataset = data["chain-map"]
    parameters = tables[0].parameters
    velocity = dataset["velocity"].transpose("amplitude", "tan_alpha").to_numpy()
    slopes = dataset["tan_alpha"].to_numpy()
    sizes = 1e3 * dataset["amplitude"].to_numpy()
    axes = figure.subplots()
    image = axes.pcolormesh(slopes, sizes, np.maximum(velocity, 0), cmap="cividis",
                            norm=PowerNorm(0.5), shading="nearest", rasterized=True)  # fmt: skip
    figure.colorbar(image, ax=axes, pad=0.015, label=VELOCITY)
    fine = [Fraction(k, 500) for k in range(250)]
    for form, ink, dashes, label in (
        ("printed", "white", "-", law_name("seuil")),
        ("corrected", INKS[5], DASHED, r"$(Nm + D)/(2\tilde{l}_0)$"),
    ):
        law = 1e3 * drawing.law_line("seuil", "tan_alpha", fine, parameters, form)
        style: Style = {"color": ink, "linestyle": dashes, "linewidth": 1.3, "label": label}
        axes.plot([float(slope) for slope in fine], law, **style)
    for edge in departures.plateau_edges(int(parameters["n"]), parameters["mu_d"])[1:]:
        if edge > 0:
            axes.axvline(float(edge), color="white", linewidth=0.7, linestyle=DOTTED)
    axes.set(
        xlim=(slopes[0], slopes[-1]), xlabel=SLOPE + r"   (dotted: $\mu_\mathrm{d}(1-2(i-1)/N)$)",
        ylim=(sizes[0], sizes[-1]), ylabel=_SIZE,
    )  # fmt: skip
    axes.legend(loc="upper left", labelcolor="white")


# --- waiting times and jumps ---------------------------------------------------------------------


def _active_sliders(dataset: xr.Dataset) -> xr.Dataset:
    """Return the sweep with the number of sliders that slip in each half-cycle, not which."""
    slips = dataset["recorded_slips"]
    active = (slips > 0).sum("slider").astype(np.int16)
    active.attrs = {"units": "1", "long_name": "sliders that slip within the half-cycle"}
    return dataset.drop_vars("recorded_slips").assign(recorded_active=active)


def bursts(active: NDArray[Any], x_G: NDArray[Any], n: int) -> tuple[list[int], list[float]]:
    """Return how long one chain waits between bursts, and how far each burst takes it.

    A cycle belongs to a burst if in one of its halves all sliders slip but for the pivot.

    Parameters
    ----------
    active : ndarray, shape (2 cycles,)
        Sliders that slip in each half-cycle.
    x_G : ndarray, shape (2 cycles,)
    n : int

    Returns
    -------
    waits : list of int
        Cycles between two bursts; what precedes the first and follows the last is left out.
    jumps : list of float
        Displacement of x_G over each burst, unit ``g tau_dyn**2``.
    """
    cycles = (active.reshape(-1, 2) >= n - 1).any(axis=1)
    ends = x_G.reshape(-1, 2)[:, 1]
    spans = _intervals(cycles)
    jumps = [float(ends[last - 1] - (ends[first - 1] if first else 0.0)) for first, last in spans]
    waits = [after[0] - before[1] for before, after in itertools.pairwise(spans)]
    return waits, jumps


def _statistics(dataset: xr.Dataset) -> tuple[list[int], list[float]]:
    """Return the waits and jumps of all starts at one amplitude."""
    n = int(dataset.attrs["n"])
    waits: list[int] = []
    jumps: list[float] = []
    for k in range(dataset.sizes["start"]):
        one = dataset.isel(start=k)
        found = bursts(one["recorded_active"].to_numpy(), one["recorded_x_G"].to_numpy(), n)
        waits += found[0]
        jumps += found[1]
    return waits, jumps


def _waiting_tables(data: Data) -> list[Table]:
    """Return the mean velocity at both amplitudes, with the statistics of bursts as remarks."""
    dataset = data["chain-waiting"]
    rows = []
    for k, point in enumerate(over_starts(points_of(dataset))):
        waits, jumps = _statistics(dataset.isel(amplitude=k))
        remark = "no bursts"
        if jumps:
            mean = float(np.mean(waits)) if waits else math.nan
            remark = (
                f"{len(jumps)} bursts from {dataset.sizes['start']} starts, mean jump"
                f" {np.mean(jumps):.3g}, mean wait {mean:.3g} cycles, longest"
                f" {max(waits, default=0)}"
            )
        rows.append(replace(point.beside("vitesse_seuil"), remark=remark))
    title = "Thirty sliders without disorder near the critical amplitude, mean over starts"
    note = (
        "Both amplitudes lie below (N m + D)/(2 l0), which sets the whole chain in motion:"
        " it creeps in bursts, which the laws of the sliding limit do not know."
    )
    return [table_beside("chain-waiting", title, "vitesse_seuil", rows, note)]


@partial(
    Picture, "chain-waiting", (7.0, 3.5), _waiting_tables,
    {"chain-waiting": {
        "drive.cycles": 500,
        "vary.run.start": [{"size": "1e-6", "seed": k} for k in range(1, 9)],
    }},
    always={"run.record": ["x_G", "slips"]}, reduce=_active_sliders,
)  # fmt: skip
def waiting(figure: Figure, data: Data, tables: list[Table]) -> None:
    """Draw how waiting times and jump sizes are distributed."""
    dataset = data["chain-waiting"]
    left, right = figure.subplots(1, 2)
    for k, ink, marker in ((1, INKS[6], "o"), (0, INKS[1], "^")):
        name = rf"$A_\theta = {departures.reduced(tables[0].rows[k]):.2f}\,A_\theta^*$"
        waits, jumps = _statistics(dataset.isel(amplitude=k))
        _draw_tail(left, waits, ink, marker, f"{name} ({len(waits)})")
        _draw_tail(right, jumps, ink, marker, f"{name} ({len(jumps)})")
    left.plot([], [], color="0.4", linewidth=0.8, linestyle=(0, (3, 2)),
              label="no memory, same mean")  # fmt: skip
    left.set(xscale="log", xlabel="waiting time (cycles)", yscale="log",
             ylabel="fraction of longer waits, larger jumps")  # fmt: skip
    left.legend(loc="lower left")
    right.set(xlabel=r"jump of $\tilde{x}_G$ in one burst ($g\,\tau_\mathrm{dyn}^2$)", yscale="log")
    right.legend(loc="upper right")


def _draw_tail(axes: Axes, values: Sequence[float], ink: str, marker: str, name: str) -> None:
    """Draw the fraction of values that are at least x, and what one mean without memory gives."""
    if not values:
        return
    mean = float(np.mean(values))
    x, counts = np.unique(np.asarray(values, dtype=float), return_counts=True)
    fraction = np.cumsum(counts[::-1])[::-1] / counts.sum()
    axes.plot(x, fraction, linestyle="none", marker=marker, markersize=3, color=ink,
              markerfacecolor="white", markeredgewidth=0.7, label=name)  # fmt: skip
    positive = np.linspace(max(x[0], 0.0), x[-1], 400)
    curve = np.exp(-(positive - positive[0]) / max(mean - positive[0], 1e-12))
    shown = curve >= fraction[-1] / 2
    axes.plot(positive[shown], curve[shown], color=ink, linewidth=0.8, linestyle=(0, (3, 2)))


# --- the Gaussian closed form --------------------------------------------------------------------


def _closed_remark(point: Point) -> str:
    if _reduced(point) > 1:
        return (
            "h > 1: rare large dilations; the excess mu_s - mu_d is not small beside l0 sigma_theta"
        )
    return departures.pivot_remark(point)


def _reduced(point: Point) -> float:
    """Return h = N m/(2 l0 sigma_theta)."""
    p = point.parameters
    return float(p["n"]) * departures.margin(p) / (2 * float(p["l0"] * p["sigma_theta"]))


def _scale(point: Point) -> float:
    """Return 1/[(N + 3 - 2i) l0 sigma_theta]."""
    p = point.parameters
    i = pivots(int(p["n"]), p["tan_alpha"], p["mu_d"])[0]
    return 1 / ((int(p["n"]) + 3 - 2 * i) * float(p["l0"] * p["sigma_theta"]))


@partial(
    Picture, "gaussian-closed-form", (7.0, 3.6),
    series("Two, three and six sliders, random dilations, over sigma_theta", "vitesse_seuil_random",
           _closed_remark,
           "The printed law is the first two terms of the exact one, and negative for h > 0.846."),
    {"gaussian-closed-form": {"drive.steps": 1000}},
)  # fmt: skip
def closed_form(figure: Figure, data: Data, tables: list[Table]) -> None:
    """Draw all velocities under random dilations on the one curve I(h)."""
    left, right = figure.subplots(1, 2)
    h = np.linspace(0, 3.2, 200)
    exact = [float(gaussian_integral(float(value))) for value in h]
    line = 1 / math.sqrt(math.pi) - 2 * h / 3
    for axes in (left, right):
        axes.plot(h, line, **PRINTED, label=law_name("vitesse_seuil_random"))
        axes.plot(h, exact, **EXACT, label="$I(h)$")
        for n, marker, ink in ((2, "o", INKS[6]), (3, "s", INKS[2]), (6, "^", INKS[3])):
            rows = [row for row in tables[0].rows if row.varied["n"] == n]
            style = {"marker": marker, "color": ink, "label": rf"computed, $N = {n}$"}
            drawing.draw_points(axes, rows, _reduced, _scale, **style, markerfacecolor="white")
    left.axhline(0, color="0.7", linewidth=0.6, zorder=0)
    left.set(
        xlim=(0, 1.6), xticks=(0, 0.5, 1, 1.5), ylim=(-0.2, 0.6),
        ylabel=r"$\tau_\mathrm{th}\langle\tilde{v}_G\rangle\,/\,"
        r"[(N+3-2i)\,\tilde{l}_0\sigma_\theta]$",
    )  # fmt: skip
    left.legend(loc="upper right")
    right.set(xlim=(0, 3.2), yscale="log", ylim=(1e-4, 1))
    for axes in (left, right):
        axes.set_xlabel(r"$h = N m/(2\,\tilde{l}_0\sigma_\theta)$")


# --- pivots under disorder -----------------------------------------------------------------------


def _onset_remark(point: Point) -> str:
    edge, distance = departures.nearest_edge(point)
    if point.parameters["sigma_mu"] == 0 and distance <= 1:
        return (
            f"in the window of two stable pivots around tan(alpha) = {float(edge):.4g}: the chain"
            " keeps the one that its history gave it"
        )
    return departures.pivot_remark(point)


@partial(
    Picture, "chain-pivots", (5.6, 4.1),
    series("Three sliders, cycles, over tan(alpha)", "vitesse_seuil", _onset_remark,
           "Without disorder the relaxed chain keeps the lower pivot up to the upper edge, which is"
           " Eq. (critical_angle) as printed."),
    {"chain-pivots": {"drive.cycles": 50, "vary.run.seed": [1, 2]}},
)  # fmt: skip
def onset(figure: Figure, data: Data, tables: list[Table]) -> None:
    """Draw the onset of creep of three sliders without and with disorder, and the window."""
    rows, parameters = tables[0].rows, tables[0].parameters
    n, friction, static = int(parameters["n"]), parameters["mu_d"], parameters["mu_s"]
    axes = figure.subplots()
    upper = float(LAWS["critical_angle"].printed(n=n, i=2, mu_d=friction, mu_s=static))
    middle = float(departures.plateau_edges(n, friction)[1])
    axes.axvspan(2 * middle - upper, upper, color=INKS[4], alpha=0.25, linewidth=0,
                 label="two stable pivots")  # fmt: skip
    axes.axvline(middle, color="0.45", linewidth=0.8, linestyle=DOTTED)
    axes.axvline(upper, color=INKS[0], linewidth=0.9)
    slopes = [Fraction(k, 2000) for k in range(200, 501)]
    over = "tan_alpha", slopes, parameters
    draw_law(axes, "vitesse_seuil", *over, "exact", label=drawing.LIMIT)
    widths = list(dict.fromkeys(row.varied["sigma_mu"] for row in rows))
    for width, style in zip(widths, (drawing.CYCLES, drawing.RANDOM), strict=False):
        kept = [row for row in rows if row.varied["sigma_mu"] == width]
        label = rf"computed, $\sigma_\mu = {width:g}$"
        drawing.draw_points(axes, kept, "tan_alpha", **style, label=label)
    high = 10.6
    axes.annotate(r"$\mu_\mathrm{d}(1-\frac{2}{N})$", (middle, high), xytext=(-3, 0),
                  textcoords="offset points", ha="right", fontsize=9)  # fmt: skip
    axes.annotate(law_name("critical_angle"), (upper, high), xytext=(3, 0),
                  textcoords="offset points", fontsize=8, color=INKS[0])  # fmt: skip
    axes.set(xlim=(0.1, 0.25), ylim=(-0.4, 11.6), xlabel=SLOPE, ylabel=VELOCITY)
    axes.legend(loc="center left")
    drawing.degrees(axes)
