"""Pictures beyond the paper: staircase, windows, map, irregular creep, closed form, pivots."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import PowerNorm
from matplotlib.figure import Figure
from numpy.typing import NDArray

from exactcreep.figures.departures import (
    BELOW_THRESHOLD,
    margin,
    nearest_edge,
    pivot_remark,
    setting_amplitude,
)
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
    points,
)
from exactcreep.figures.style import INKS, picture
from exactcreep.figures.tables import Cell, Row, Series, Table, beside, cells, table_of, tables_of
from exactcreep.laws import (
    LAWS,
    critical_amplitude,
    gaussian_integral,
    law_values,
    pivots,
    staircase_two_sliders,
)
from exactcreep.model.numbers import exact_number

# --- the staircase of two sliders ----------------------------------------------------------------

_STAIRCASE = "two-sliders-staircase"
_LINE = "velocity_th_2_cycle_corrected"


def _start_tension(start: str) -> Fraction:
    """Return r0 = x_2 - x_1 - l0 of a start as a table names it."""
    if start == "relaxed":
        return Fraction(0)
    return exact_number(json.loads(start)["tensions"][0], "tensions")


def _staircase(cell: Cell) -> float:
    given = {name: cell.parameters[name] for name in
             ("l0", "mu_d", "mu_s", "tan_alpha", "amplitude")}  # fmt: skip
    return float(staircase_two_sliders(**given, r0=_start_tension(cell.varied["start"])))


def staircase_tables(data: Data) -> list[Table]:
    """Return the velocities of two sliders without disorder beside line and staircase."""
    law = LAWS[_LINE].printed
    rows = []
    for cell in cells(data[_STAIRCASE]):
        row = Row(cell.varied, cell.velocity, cell.error,
                  law_values(law, cell.parameters), (_staircase(cell),))  # fmt: skip
        rows.append(row)
    return [
        Table(
            _STAIRCASE,
            "Two sliders without disorder, cycles, over the amplitude, from two starts",
            f"Eq. ({_LINE}): {law.text}",
            "D times the number of rho in r0 + D + 2D Z with |rho| < l0 A - m",
            tuple(rows),
            "The printed line touches the staircase of the relaxed chain from below; its mean over"
            " all starts is max(0, l0 A - m).",
        )
    ]


def draw_staircase(data: Data, tables: list[Table]) -> Figure:
    """Draw the staircase of two sliders over the paper's line."""
    rows = tables[0].rows
    parameters = cells(data[_STAIRCASE])[0].parameters
    chain = {name: parameters[name] for name in ("l0", "mu_d", "mu_s", "tan_alpha")}
    figure = picture(5.4, 4.2)
    axes = figure.subplots()
    sizes = np.linspace(0, 0.0016, 1601)
    exact = [Fraction(k, 10**6) + Fraction(1, 10**9) for k in range(1601)]
    line = law_line(LAWS[_LINE].printed, "amplitude", exact, parameters)
    axes.plot(1e3 * sizes, np.maximum(line, 0), **PRINTED,
              label=law_name(_LINE))  # fmt: skip
    average = LAWS[_LINE].corrected
    axes.plot(1e3 * sizes, law_line(average, "amplitude", exact, parameters), color="0.55",
              linewidth=0.9, linestyle=(0, (1, 1.5)), label=r"mean over all starts,"
              r" $\max(0, \tilde{l}_0A_\theta - m)$")  # fmt: skip
    starts = list(dict.fromkeys(row.varied["start"] for row in rows))
    for start, ink, marker in zip(starts, (INKS[6], INKS[1]), ("o", "^"), strict=False):
        r0 = _start_tension(start)
        steps = [float(staircase_two_sliders(**chain, amplitude=a, r0=r0)) for a in exact]
        axes.plot(1e3 * sizes, steps, color=ink, linewidth=0.9,
                  label=rf"exact, $r_0 = {float(r0):g}$")  # fmt: skip
        kept = [row for row in rows if row.varied["start"] == start]
        axes.plot(
            [1e3 * row.varied["amplitude"] for row in kept], [row.measured for row in kept],
            linestyle="none", marker=marker, markersize=3.2, markerfacecolor="white", color=ink,
            markeredgewidth=0.7, label=rf"computed, $r_0 = {float(r0):g}$",
        )  # fmt: skip
    axes.set_xlim(0, 1.62)
    axes.set_ylim(-0.05, 1.5)
    axes.set_xlabel(r"amplitude $A_\theta$ ($10^{-3}$; $\tilde{l}_0 = 10^3$)")
    axes.set_ylabel(VELOCITY)
    axes.legend(loc="upper left")
    return figure


# --- windows of creep ----------------------------------------------------------------------------

_WINDOWS = "chain-windows"


def _creeps(dataset: xr.Dataset) -> NDArray[np.bool_]:
    return np.asarray(dataset["outcome"].to_numpy() == "creeping")


def window_tables(data: Data) -> list[Table]:
    """Return the velocities on both sides of every edge between creep and rest."""
    dataset = data[_WINDOWS]
    every = cells(dataset)
    creeps = _creeps(dataset)
    rows = []
    for k in np.flatnonzero(creeps[1:] != creeps[:-1]).tolist():
        for cell, here in ((every[k], creeps[k]), (every[k + 1], creeps[k + 1])):
            relative = float(cell.parameters["amplitude"]) / critical_amplitude(cell.parameters)
            word = "creeps" if here else "does not creep"
            remark = f"A = {relative:.4f} A* of Eq. (seuil): the chain {word}"
            rows.append(beside(cell, "vitesse_seuil", remark=remark))
    parameters = every[0].parameters
    ratio = setting_amplitude(parameters) / critical_amplitude(parameters)
    return [
        table_of(
            _WINDOWS,
            "Three sliders without disorder: the edges of creep",
            rows,
            "vitesse_seuil",
            note="The amplitude (N m + D)/(2 l0) that sets the whole chain in motion is"
            f" {ratio:.4f} A*; the laws hold for mu_s -> mu_d, and know of no windows.",
        )
    ]


def draw_windows(data: Data, tables: list[Table]) -> Figure:
    """Draw the velocity of three sliders above the first threshold."""
    dataset = data[_WINDOWS]
    every = cells(dataset)
    parameters = every[0].parameters
    star = critical_amplitude(parameters)
    figure = picture(5.6, 4.0)
    axes = figure.subplots()
    x = dataset["amplitude"].to_numpy() / star
    creeps = _creeps(dataset)
    _shade(axes, x, creeps)
    sizes = np.linspace(x[0], x[-1], 50)
    exact = law_line(LAWS["vitesse_seuil"].exact, "amplitude", (sizes * star).tolist(), parameters)
    axes.plot(sizes, exact, **PRINTED, label=law_name("vitesse_seuil"))
    axes.plot(x, dataset["velocity"], linestyle="none", marker="o", markersize=2.2,
              color=INKS[6], label="computed, from the relaxed chain")  # fmt: skip
    place = setting_amplitude(parameters) / star
    axes.axvline(place, ymax=0.8, **{**EXACT, "linewidth": 1.0})  # below the legend
    axes.annotate(
        r"$\frac{Nm+D}{2\,\tilde{l}_0}$", (place, 0.5), xytext=(-4, 0),
        textcoords="offset points", ha="right", fontsize=11, color=EXACT["color"],
    )  # fmt: skip
    axes.set_xlim(x[0], x[-1])
    axes.set_xlabel(r"$A_\theta/A_\theta^*$, $A_\theta^*$ of the paper")
    axes.set_ylabel(VELOCITY)
    axes.legend(loc="upper left")
    inset = axes.inset_axes((0.55, 0.1, 0.42, 0.36))
    near = (x > 1.22) & (x < 1.36)
    _shade(inset, x[near], creeps[near])
    inset.plot(x[near], dataset["velocity"].to_numpy()[near], linestyle="none", marker="o",
               markersize=2.2, color=INKS[6])  # fmt: skip
    inset.plot(sizes, exact, **PRINTED)
    inset.set(xlim=(1.22, 1.36), ylim=(-0.03, 0.35))
    inset.tick_params(labelsize=7)
    inset.set_title("shaded: the chain creeps", fontsize=7, pad=2)
    return figure


def _shade(axes: Axes, x: NDArray[Any], creeps: NDArray[np.bool_]) -> None:
    """Shade where the chain creeps."""
    if x.size < 2:
        return
    half = (x[1] - x[0]) / 2
    edges = np.flatnonzero(np.diff(np.concatenate([[False], creeps, [False]]).astype(int)))
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        axes.axvspan(x[first] - half, x[last - 1] + half, color=INKS[4], alpha=0.28, linewidth=0)


# --- the map -------------------------------------------------------------------------------------

_MAP = "chain-map"
_EVERY = 8  # rows of the table: every eighth slope and amplitude


def _map_remark(cell: Cell) -> str:
    relative = float(cell.parameters["amplitude"]) / critical_amplitude(cell.parameters)
    if 0.5 < relative < 1.5:
        return "near the threshold the excess mu_s - mu_d decides whether the whole chain moves"
    return pivot_remark(cell)


_WHOLE_MAP = Series(
    _MAP, "Six sliders, cycles, over slope and amplitude (every eighth point)", "vitesse_seuil",
    _map_remark, BELOW_THRESHOLD,
)  # fmt: skip


def map_tables(data: Data) -> list[Table]:
    """Return every eighth velocity of the map, in both directions, beside the law."""
    (whole,) = tables_of(_WHOLE_MAP)(data)
    columns = data[_MAP].sizes["amplitude"]
    rows = tuple(
        row for k, row in enumerate(whole.rows)
        if (k // columns) % _EVERY == 0 and (k % columns) % _EVERY == 0
    )  # fmt: skip
    return [replace(whole, rows=rows)]


def draw_map(data: Data, tables: list[Table]) -> Figure:
    """Draw the velocity of six sliders over slope and amplitude, thresholds and pivots on it."""
    dataset = data[_MAP]
    parameters = dict(cells(dataset)[0].parameters)
    velocity = dataset["velocity"].transpose("amplitude", "tan_alpha").to_numpy()
    slopes = dataset["tan_alpha"].to_numpy()
    sizes = 1e3 * dataset["amplitude"].to_numpy()
    figure = picture(5.8, 4.4)
    axes = figure.subplots()
    image = axes.pcolormesh(slopes, sizes, np.maximum(velocity, 0), cmap="cividis",
                            norm=PowerNorm(0.5), shading="nearest", rasterized=True)  # fmt: skip
    bar = figure.colorbar(image, ax=axes, pad=0.015)
    bar.set_label(VELOCITY)
    fine = [Fraction(k, 500) for k in range(250)]
    x = [float(slope) for slope in fine]
    lines = [{**parameters, "tan_alpha": slope} for slope in fine]
    axes.plot(x, [1e3 * critical_amplitude(each) for each in lines], color="white", linewidth=1.3,
              label=law_name("seuil"))  # fmt: skip
    corrected = [1e3 * setting_amplitude(each) for each in lines]
    axes.plot(x, corrected, color=INKS[5], linewidth=1.3, linestyle=(0, (4, 1.5)),
              label=r"$(Nm + D)/(2\tilde{l}_0)$")  # fmt: skip
    n, friction = int(parameters["n"]), parameters["mu_d"]
    for i in range(2, n + 1):
        edge = float(friction * (1 - Fraction(2 * (i - 1), n)))
        if edge > 0:
            axes.axvline(edge, color="white", linewidth=0.7, linestyle=(0, (1, 2)))
    axes.set_xlim(slopes[0], slopes[-1])
    axes.set_ylim(sizes[0], sizes[-1])
    axes.set_xlabel(SLOPE + r"   (dotted: $\mu_\mathrm{d}(1-2(i-1)/N)$)")
    axes.set_ylabel(r"$A_\theta$ ($10^{-3}$; $\tilde{l}_0 = 10^3$)")
    legend = axes.legend(loc="upper left")
    for text in legend.get_texts():
        text.set_color("white")
    return figure


# --- waiting times and jumps ---------------------------------------------------------------------

_WAITING = "chain-waiting"


def active_sliders(dataset: xr.Dataset) -> xr.Dataset:
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
    edges = np.flatnonzero(np.diff(np.concatenate([[False], cycles, [False]]).astype(int)))
    spans = list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
    jumps = [float(ends[last - 1] - (ends[first - 1] if first else 0.0)) for first, last in spans]
    waits = [after[0] - before[1] for before, after in itertools.pairwise(spans)]
    return waits, jumps


def _statistics(dataset: xr.Dataset, amplitude: int) -> tuple[list[int], list[float]]:
    here = dataset.isel(amplitude=amplitude)
    n = int(dataset.attrs["n"])
    waits: list[int] = []
    jumps: list[float] = []
    for start in range(here.sizes["start"]):
        one = here.isel(start=start)
        found = bursts(one["recorded_active"].to_numpy(), one["recorded_x_G"].to_numpy(), n)
        waits += found[0]
        jumps += found[1]
    return waits, jumps


def waiting_tables(data: Data) -> list[Table]:
    """Return the mean velocity at both amplitudes, with the statistics of bursts as remarks."""
    dataset = data[_WAITING]
    every = cells(dataset)
    count = dataset.sizes["start"]
    rows = []
    for k in range(dataset.sizes["amplitude"]):
        here = every[k * count : (k + 1) * count]
        velocity = np.array([cell.velocity for cell in here])
        waits, jumps = _statistics(dataset, k)
        remark = "no bursts"
        if jumps:
            mean = float(np.mean(waits)) if waits else math.nan
            remark = (
                f"{len(jumps)} bursts from {count} starts, mean jump {np.mean(jumps):.3g},"
                f" mean wait {mean:.3g} cycles, longest {max(waits, default=0)}"
            )
        together = here[0]._replace(
            varied={"amplitude": here[0].varied["amplitude"]},
            velocity=float(velocity.mean()),
            error=float(velocity.std(ddof=1)) / math.sqrt(count) if count > 1 else math.nan,
        )
        rows.append(beside(together, "vitesse_seuil", remark=remark))
    return [
        table_of(
            _WAITING,
            "Thirty sliders without disorder near the critical amplitude, mean over starts",
            rows,
            "vitesse_seuil",
            note="Both amplitudes lie below (N m + D)/(2 l0), which sets the whole chain in motion:"
            " it creeps in bursts, which the laws of the sliding limit do not know.",
        )
    ]


def draw_waiting(data: Data, tables: list[Table]) -> Figure:
    """Draw how waiting times and jump sizes are distributed."""
    dataset = data[_WAITING]
    figure = picture(7.0, 3.5)
    left, right = figure.subplots(1, 2)
    star = critical_amplitude(cells(dataset)[0].parameters)
    for k, ink, marker in ((1, INKS[6], "o"), (0, INKS[1], "^")):
        name = rf"$A_\theta = {float(dataset['amplitude'][k]) / star:.2f}\,A_\theta^*$"
        waits, jumps = _statistics(dataset, k)
        for axes, values in ((left, waits), (right, jumps)):
            _draw_tail(axes, values, ink, marker, f"{name} ({len(values)})")
    left.plot([], [], color="0.4", linewidth=0.8, linestyle=(0, (3, 2)),
              label="no memory, same mean")  # fmt: skip
    left.set_xscale("log")
    left.set_xlabel("waiting time (cycles)")
    left.set_ylabel("fraction of longer waits, larger jumps")
    right.set_xlabel(r"jump of $\tilde{x}_G$ in one burst ($g\,\tau_\mathrm{dyn}^2$)")
    for axes in (left, right):
        axes.set_yscale("log")
        axes.legend(loc="upper right" if axes is right else "lower left")
    return figure


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

_CLOSED = "gaussian-closed-form"


def _closed_remark(cell: Cell) -> str:
    if _reduced(cell) > 1:
        return (
            "h > 1: rare large dilations; the excess mu_s - mu_d is not small beside l0 sigma_theta"
        )
    return pivot_remark(cell)


def _reduced(cell: Cell) -> float:
    """Return h = N m/(2 l0 sigma_theta)."""
    p = cell.parameters
    return float(p["n"]) * margin(p) / (2 * float(p["l0"] * p["sigma_theta"]))


def _unit(cell: Cell) -> float:
    """Return (N + 3 - 2i) l0 sigma_theta."""
    p = cell.parameters
    i = pivots(int(p["n"]), p["tan_alpha"], p["mu_d"])[0]
    return (int(p["n"]) + 3 - 2 * i) * float(p["l0"] * p["sigma_theta"])


closed_form_tables = tables_of(
    Series(_CLOSED, "Two, three and six sliders, random dilations, over sigma_theta",
           "vitesse_seuil_random", _closed_remark,
           "The printed law is the first two terms of the exact one, and negative for h > 0.846.")
)  # fmt: skip


def draw_closed_form(data: Data, tables: list[Table]) -> Figure:
    """Draw all velocities under random dilations on the one curve I(h)."""
    every = cells(data[_CLOSED])
    figure = picture(7.0, 3.6)
    left, right = figure.subplots(1, 2)
    h = np.linspace(0, 3.2, 200)
    exact = np.array([float(gaussian_integral(float(value))) for value in h])
    for axes in (left, right):
        line = 1 / math.sqrt(math.pi) - 2 * h / 3
        axes.plot(h, line, **PRINTED, label=law_name("vitesse_seuil_random"))
        axes.plot(h, exact, **EXACT, label="$I(h)$")
        for n, marker, ink in ((2, "o", INKS[6]), (3, "s", INKS[2]), (6, "^", INKS[3])):
            kept = [cell for cell in every if cell.parameters["n"] == n]
            axes.errorbar(
                [_reduced(cell) for cell in kept],
                [cell.velocity / _unit(cell) for cell in kept],
                yerr=[cell.error / _unit(cell) for cell in kept],
                linestyle="none", marker=marker, markersize=4, color=ink, markerfacecolor="white",
                markeredgewidth=0.8, elinewidth=0.7, label=rf"computed, $N = {n}$", zorder=3,
            )  # fmt: skip
        axes.set_xlabel(r"$h = N m/(2\,\tilde{l}_0\sigma_\theta)$")
    left.set_xlim(0, 1.6)
    left.set_xticks([0, 0.5, 1, 1.5])
    left.set_ylim(-0.2, 0.6)
    left.axhline(0, color="0.7", linewidth=0.6, zorder=0)
    left.set_ylabel(
        r"$\tau_\mathrm{th}\langle\tilde{v}_G\rangle\,/\,[(N+3-2i)\,\tilde{l}_0\sigma_\theta]$"
    )
    left.legend(loc="upper right")
    right.set(xlim=(0, 3.2), yscale="log", ylim=(1e-4, 1))
    return figure


# --- pivots under disorder -----------------------------------------------------------------------

_PIVOTS = "chain-pivots"


def _onset_remark(cell: Cell) -> str:
    edge, distance = nearest_edge(cell)
    if cell.parameters["sigma_mu"] == 0 and distance <= 1:
        return (
            f"in the window of two stable pivots around tan(alpha) = {float(edge):.4g}: the chain"
            " keeps the one that its history gave it"
        )
    return pivot_remark(cell)


pivot_tables = tables_of(
    Series(_PIVOTS, "Three sliders, cycles, over tan(alpha)", "vitesse_seuil", _onset_remark,
           "Without disorder the relaxed chain keeps the lower pivot up to the upper edge, which is"
           " Eq. (critical_angle) as printed.")
)  # fmt: skip


def draw_pivots(data: Data, tables: list[Table]) -> Figure:
    """Draw the onset of creep of three sliders without and with disorder, and the window."""
    rows = tables[0].rows
    parameters = dict(cells(data[_PIVOTS])[0].parameters)
    n, friction, static = int(parameters["n"]), parameters["mu_d"], parameters["mu_s"]
    figure = picture(5.6, 4.1)
    axes = figure.subplots()
    upper = float(LAWS["critical_angle"].printed(n=n, i=2, mu_d=friction, mu_s=static))
    middle = float(friction * (1 - Fraction(2, n)))
    axes.axvspan(2 * middle - upper, upper, color=INKS[4], alpha=0.25, linewidth=0,
                 label="two stable pivots")  # fmt: skip
    axes.axvline(middle, color="0.45", linewidth=0.8, linestyle=(0, (1, 2)))
    axes.axvline(upper, color=INKS[0], linewidth=0.9)
    slopes = [Fraction(k, 2000) for k in range(200, 501)]
    law = law_line(LAWS["vitesse_seuil"].exact, "tan_alpha", slopes, parameters)
    axes.plot([float(s) for s in slopes], law, **EXACT,
              label=r"exact for $\mu_\mathrm{s}\to\mu_\mathrm{d}$")  # fmt: skip
    widths = list(dict.fromkeys(row.varied["sigma_mu"] for row in rows))
    for width, style in zip(widths, (CYCLES, RANDOM), strict=False):
        kept = [row for row in rows if row.varied["sigma_mu"] == width]
        points(axes, kept, "tan_alpha", **style, label=rf"computed, $\sigma_\mu = {width:g}$")
    high = 10.6
    axes.annotate(r"$\mu_\mathrm{d}(1-\frac{2}{N})$", (middle, high), xytext=(-3, 0),
                  textcoords="offset points", ha="right", fontsize=9)  # fmt: skip
    axes.annotate(law_name("critical_angle"), (upper, high), xytext=(3, 0),
                  textcoords="offset points", fontsize=8, color=INKS[0])  # fmt: skip
    axes.set(xlim=(0.1, 0.25), ylim=(-0.4, 11.6), xlabel=SLOPE, ylabel=VELOCITY)
    axes.legend(loc="center left")
    degrees(axes)
    return figure
