"""Pictures of what lasts: thresholds by what one means by them, fates, and lives of creep.

What is computed here is float64's: fates are not one by one those of the equations, lifetimes and
mean velocities agree with them in the mean. The lasting thresholds are proved, and shipped.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from fractions import Fraction
from importlib.resources import files
from itertools import groupby
from operator import itemgetter
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from exactcreep.figures.departures import BELOW_THRESHOLD, setting_amplitude
from exactcreep.figures.drawing import (
    CYCLES,
    EXACT,
    PRINTED,
    RANDOM,
    VELOCITY,
    Data,
    law_line,
    law_name,
    points,
)
from exactcreep.figures.style import INKS, picture
from exactcreep.figures.tables import Row, Table, beside, cells, table_of
from exactcreep.laws import EDGES, LAWS, critical_amplitude, law_values
from exactcreep.model.chain import Chain
from exactcreep.model.outcome import Outcome
from exactcreep.model.state import State
from exactcreep.studies.fates.fate import fate
from exactcreep.studies.fates.survival import survival
from exactcreep.studies.thresholds.criteria import threshold
from exactcreep.studies.thresholds.horizon import Question
from exactcreep.studies.thresholds.intercept import Intercept

Say = Callable[..., None]
RATIO = r"$A_\theta/A_\theta^*$, $A_\theta^*$ of the paper"
HORIZON = 20
"""Cycles after which the criterion ``horizon`` looks whether x_G still advances."""
_SEARCHED = 0.8, 1.6  # units of Eq. (seuil)
_BOUNDS = ("no_lasting_creep", "at_rest", "locked_ends")
_NAMES = {
    "no_lasting_creep": "below: no state creeps for ever",
    "at_rest": "above: no state rests",
    "locked_ends": "above: the ends alone lock no longer",
}


def lasting_edges() -> dict[int, dict[str, Any]]:
    """Return the proved lasting thresholds of short chains that are shipped, by N."""
    table = files("exactcreep.figures.pictures").joinpath("lasting_thresholds.json")
    return {int(n): edge for n, edge in json.loads(table.read_text(encoding="utf-8")).items()}


def chain_of(n: int, sigma_mu: Any = 0) -> Chain:
    """Return the chain of the paper's captions with n sliders."""
    return Chain(n, 1000, "0.5", "0.6", sigma_mu=sigma_mu, tan_alpha="0.25")


def _in_units(n: int) -> float:
    return critical_amplitude(chain_of(n).parameters())


def _bounds(n: int) -> dict[str, float]:
    """Return the amplitudes of the theorems in units of Eq. (seuil)."""
    about = chain_of(n).parameters()
    return {name: law_values(EDGES[name].form, about)[0] / _in_units(n) for name in _BOUNDS}


# --- thresholds by criterion ---------------------------------------------------------------------

_CRITERIA = "thresholds-by-criterion"


def thresholds(
    *,
    sizes: Sequence[int],
    step: float,
    starts: int,
    cycles: int,
    velocity_cycles: int,
    most_velocity: int,
    say: Say,
) -> xr.Dataset:
    """Return thresholds of chains by every criterion, in units of Eq. (seuil).

    Parameters
    ----------
    sizes : sequence of int
    step : float
        Of the amplitudes of the horizon, and the width at which bisection for half of the starts
        ends, in units of Eq. (seuil).
    starts, cycles : int
        Of the criterion ``survival``: half of the starts still creep.
    velocity_cycles : int
        Of every velocity of the intercept, with ``sigma_mu = .01``.
    most_velocity : int
        The longest chain whose intercept is measured.
    say : callable
        Told how many sizes are done.
    """
    shipped = lasting_edges()
    rows = []
    for n in sizes:
        unit = _in_units(n)
        row = dict.fromkeys(("lasting", "survival", "intercept", "intercept_error"), math.nan)
        row["horizon"] = _horizon(n, unit, step)
        if n in shipped:
            row["lasting"] = float(Fraction(shipped[n]["upper"])) / unit
        if n > 5:
            row["survival"] = _half(n, unit, step, starts, cycles)
        if 5 < n <= most_velocity:
            line = threshold(
                chain_of(n, "0.01"), criterion="intercept", cycles=velocity_cycles, points=8,
                progress=False,
            )  # fmt: skip
            assert isinstance(line, Intercept)
            row["intercept"] = line.intercept / unit
            row["intercept_error"] = math.hypot(line.error, line.systematic) / unit
        rows.append(row)
        say(len(rows), len(sizes), "sizes")
    about = {"starts": starts, "cycles": cycles, "step": step, "velocity_cycles": velocity_cycles}
    columns = {name: ("n", [row[name] for row in rows]) for name in rows[0]}
    return xr.Dataset(columns, {"n": list(sizes)}, about)


def _horizon(n: int, unit: float, step: float) -> float:
    """Return the first amplitude of a scan at which x_G advances in cycle `HORIZON`."""
    question = Question(chain_of(n), HORIZON, State.relaxed(chain_of(n)))
    ratios = np.arange(0.9, 2.0, step).tolist()
    return next((x for x in ratios if question.creeps(Fraction(x * unit))), math.nan)


def _half(n: int, unit: float, step: float, starts: int, cycles: int) -> float:
    """Return the amplitude from which on half of the starts still creep at the horizon.

    nan if they do so everywhere: long chains neither lock nor stand still for long below Eq.
    (seuil), and come further down than ever now and then.
    """
    low, high = _SEARCHED
    while high - low > step:
        middle = (low + high) / 2
        lives = survival(chain_of(n), middle * unit, starts=starts, cycles=cycles)
        if lives.fractions["creeping"].share < 0.5:
            low = middle
        else:
            high = middle
    return float("nan") if low == _SEARCHED[0] else (low + high) / 2


_MEANT = {
    "horizon": f"The relaxed chain still advances in cycle {HORIZON}",
    "lasting": "The relaxed chain creeps for ever (proved)",
    "survival": "Half of the starts still creep",
    "intercept": r"$v(A)$ drawn on to zero, $\sigma_\mu=.01$",
}
_WORDS = _MEANT | {"intercept": "The straight part of v(A) drawn on to zero, sigma_mu = .01"}


def threshold_tables(data: Data) -> list[Table]:
    """Return the thresholds of every criterion, that which has a law beside it."""
    dataset = data[_CRITERIA]
    tables = []
    for name in _MEANT:
        known = dataset[name].dropna("n")
        law = (1.0,) if name == "intercept" else ()
        rows = []
        for n, measured in zip(known["n"].to_numpy().tolist(), known.to_numpy(), strict=True):
            error = float(dataset["intercept_error"].sel(n=n)) if law else np.nan
            row = Row({"n": n}, float(measured), error, law, ())
            remark = "the velocities of a short chain have steps" if row.departs else ""
            rows.append(replace(row, remark=remark))
        title = f"Threshold in units of Eq. (seuil): {name}"
        note = f"{_WORDS[name]}. " + ("Eq. (seuil) is its law." if law else "It has no law.")
        tables.append(Table(name, title, "1" if law else "-", "", tuple(rows), note, "Eq. (seuil)"))
    return tables


def draw_thresholds(data: Data, tables: list[Table]) -> Figure:
    """Draw thresholds over N in units of Eq. (seuil), by criterion, with the theorems' bounds."""
    sizes = np.unique([row.varied["n"] for one in tables for row in one.rows]).astype(int)
    figure = picture(6.4, 4.4)
    axes = figure.subplots()
    every = np.unique(np.geomspace(2, max(sizes.max(), 3), 60).astype(int))
    for name, ink in zip(_BOUNDS, (INKS[7], INKS[4], INKS[5]), strict=True):
        values = np.array([_bounds(int(n))[name] for n in every])
        shown = np.isfinite(values) & (values > 0)
        axes.plot(every[shown], values[shown], color=ink, linewidth=1, label=_NAMES[name])
    axes.axhline(1, label=law_name("seuil"), **PRINTED)
    law = [setting_amplitude(chain_of(int(n)).parameters()) / _in_units(int(n)) for n in every]
    axes.plot(every, law, label=r"$(Nm+D)/(2\tilde{l}_0)$", **EXACT)
    marks = {"horizon": "x", "lasting": "D", "survival": "o", "intercept": "s"}
    for one, ink in zip(tables, (INKS[6], INKS[2], INKS[6], INKS[3]), strict=True):
        style: dict[str, Any] = {"marker": marks[one.name], "color": ink}
        points(axes, one.rows, "n", **style, markerfacecolor="white", label=_MEANT[one.name])
    axes.set_xscale("log")
    axes.set_xticks(
        [2, 3, 4, 6, 8, 12, 20, 30, 60], ["2", "3", "4", "6", "8", "12", "20", "30", "60"]
    )
    axes.minorticks_off()
    axes.set_xlim(1.9, 1.1 * every.max())
    axes.set_ylim(0, 1.9)
    axes.set_xlabel("N")
    axes.set_ylabel(r"threshold / $A_\theta^*$ of the paper")
    axes.legend(loc="upper right", fontsize=7, ncols=2)
    return figure


# --- fates over the amplitude --------------------------------------------------------------------

_MAP = "fate-map"
_KINDS = ("at rest", "locked", "period 1", "period 2 to 10", "period 11 and more", "not settled")
_SHADES = ("#E6E6E6", INKS[0], INKS[2], "#8FD3B8", INKS[5], INKS[1])


def fates(
    *, sizes: Sequence[int], low: float, high: float, count: int, cycles: int, say: Say
) -> xr.Dataset:
    """Return the fate of relaxed chains at equally spaced amplitudes, as float64 finds it.

    Parameters
    ----------
    sizes : sequence of int
    low, high : float
        Ends of the amplitudes, in units of Eq. (seuil).
    count : int
        Of the amplitudes.
    cycles : int
        After which a chain has not settled.
    say : callable
        Told how many sizes are done.
    """
    ratios = np.linspace(low, high, count)
    kinds = np.empty((len(sizes), count), dtype=np.int64)
    periods = np.zeros((len(sizes), count), dtype=np.int64)
    for k, n in enumerate(sizes):
        unit = _in_units(n)
        for j, ratio in enumerate(ratios.tolist()):
            found = fate(chain_of(n), ratio * unit, cycles=cycles, solver="exact")
            periods[k, j] = found.period or 0
            kinds[k, j] = _kind(found.outcome, found.period)
        say(k + 1, len(sizes), "sizes")
    return xr.Dataset(
        {"kind": (("n", "ratio"), kinds), "period": (("n", "ratio"), periods)},
        {"n": list(sizes), "ratio": ratios},
        {"kinds": list(_KINDS), "cycles": cycles},
    )


def _kind(outcome: Outcome, period: int | None) -> int:
    if outcome is Outcome.AT_REST:
        return 0
    if outcome is Outcome.CYCLING:
        return 1
    if outcome is not Outcome.CREEPING or period is None:
        return 5
    return 2 + (period > 1) + (period > 10)


def fate_tables(data: Data) -> list[Table]:
    """Return the ranges of amplitudes of one kind of fate, and how wide they are."""
    dataset = data[_MAP]
    rows = []
    for n in dataset["n"].to_numpy().tolist():
        for kind, first, last in _ranges(dataset, n):
            ends = {"n": n, "from": round(first, 6), "to": round(last, 6)}
            rows.append(Row(ends, last - first, np.nan, (), (), _KINDS[kind]))
    title = (
        "Fates of relaxed chains over A / Eq. (seuil), float64; measured: how wide each range is"
    )
    note = f"Not settled: within {dataset.attrs['cycles']} cycles."
    return [Table(_MAP, title, "-", "", tuple(rows), note, "Eq. (seuil)")]


def _ranges(dataset: xr.Dataset, n: int) -> Iterator[tuple[int, float, float]]:
    """Yield the ranges of one kind of fate: the kind, the first and the last amplitude."""
    kinds = dataset["kind"].sel(n=n).to_numpy().tolist()
    pairs = zip(kinds, dataset["ratio"].to_numpy().tolist(), strict=True)
    for kind, group in groupby(pairs, key=itemgetter(0)):
        within = [ratio for _, ratio in group]
        yield kind, within[0], within[-1]


def draw_fates(data: Data, tables: list[Table]) -> Figure:
    """Draw the fates of chains over the amplitude as one map, a band for each N."""
    dataset = data[_MAP]
    ratios = dataset["ratio"].to_numpy()
    half = (ratios[1] - ratios[0]) / 2
    figure = picture(6.8, 4.2)
    axes = figure.subplots()
    sizes = dataset["n"].to_numpy().tolist()
    for n in sizes:
        for kind, first, last in _ranges(dataset, n):
            width = last - first + 2 * half
            axes.barh(n, width, 0.8, first - half, color=_SHADES[kind], linewidth=0)
        bounds = _bounds(n)
        for name, dash in zip(_BOUNDS, _DASHES, strict=True):
            axes.plot([bounds[name]] * 2, [n - 0.48, n + 0.48], color="black", linestyle=dash)
    axes.set_xlim(ratios[0], ratios[-1])
    axes.set_yticks(sizes)
    axes.tick_params(axis="y", which="both", length=0)
    axes.set_xlabel(RATIO)
    axes.set_ylabel("N")
    patches: list[Any] = [
        Patch(color=shade, label=kind) for kind, shade in zip(_KINDS, _SHADES, strict=True)
    ]
    patches += [
        Line2D([], [], color="black", linestyle=dash, label=_NAMES[name])
        for name, dash in zip(_BOUNDS, _DASHES, strict=True)
    ]
    figure.legend(handles=patches, loc="outside upper center", ncols=3, fontsize=7)
    return figure


_DASHES: tuple[Any, ...] = ((0, (1, 1)), "-", (0, (4, 1.5)))

# --- lives of creep ------------------------------------------------------------------------------

_LIVES = "lifetimes"


def lifetimes(
    *, sizes: Sequence[int], ratios: Sequence[float], starts: int, cycles: int, say: Say
) -> xr.Dataset:
    """Return at which rate creep dies, over the amplitude in units of `locked_ends`.

    Parameters
    ----------
    sizes : sequence of int
    ratios : sequence of float
        Amplitudes, in units of the largest with a locked cycle in which the ends alone slip.
    starts, cycles : int
        See `survival`.
    say : callable
        Told how many sizes are done.
    """
    rows = []
    for n in sizes:
        edge = law_values(EDGES["locked_ends"].form, chain_of(n).parameters())[0]
        every = [survival(chain_of(n), x * edge, starts=starts, cycles=cycles) for x in ratios]
        rows.append([(one.cycles_lived, one.lifetimes.size, *one.rate) for one in every])
        say(len(rows), len(sizes), "sizes")
    names = ("lived", "deaths", "rate", "rate_low", "rate_high")
    columns = zip(names, np.moveaxis(np.array(rows), -1, 0), strict=True)
    found = xr.Dataset(
        {name: (("n", "ratio"), values) for name, values in columns},
        {"n": list(sizes), "ratio": list(ratios)},
        {"starts": starts, "cycles": cycles},
    )
    return found.assign(deaths=found["deaths"].astype(np.int64))


def lifetime_tables(data: Data) -> list[Table]:
    """Return the mean lifetime at every amplitude, in cycles, where any start died."""
    dataset = data[_LIVES]
    rows = []
    for n in dataset["n"].to_numpy().tolist():
        for ratio in dataset["ratio"].to_numpy().tolist():
            here = dataset.sel(n=n, ratio=ratio)
            died, rate = int(here["deaths"]), float(here["rate"])
            varied = {"n": n, "ratio": round(ratio, 6)}
            if died and np.isfinite(rate):
                mean = 1 / rate
                rows.append(Row(varied, mean, mean / np.sqrt(died), (), (), f"{died} deaths"))
            else:
                remark = "nobody died: at least that long, at 97.5 %"
                rows.append(Row(varied, 1 / float(here["rate_high"]), np.nan, (), (), remark))
    title = "Mean life of creep in cycles, over A / (largest with a locked cycle of the ends alone)"
    return [Table(_LIVES, title, "-", "", tuple(rows), unit="cycles")]


def draw_lifetimes(data: Data, tables: list[Table]) -> Figure:
    """Draw the mean life of creep over the amplitude, with its interval."""
    dataset = data[_LIVES]
    figure = picture(5.8, 4.2)
    axes = figure.subplots()
    for n, ink in zip(dataset["n"].to_numpy().tolist(), INKS, strict=False):
        here = dataset.sel(n=n)
        _draw_lives(axes, here["ratio"].to_numpy(), here, ink, f"N = {n}")
    axes.axvline(1, color="0.4", linestyle=(0, (4, 1.5)), linewidth=0.9)
    axes.set_yscale("log")
    axes.set_xlim(float(dataset["ratio"].min()) - 0.01, 1.005)
    if not dataset["deaths"].to_numpy().all():
        axes.plot([], [], "^", color="0.4", markerfacecolor="white", label="nobody died: at least")
    axes.set_xlabel(r"$A_\theta$ / largest with a locked cycle of sliders 1 and N alone")
    axes.set_ylabel("mean life  (cycles lived / deaths)")
    axes.legend(loc="lower right")
    return figure


def _draw_lives(axes: Axes, x: NDArray[np.float64], here: xr.Dataset, ink: str, label: str) -> None:
    rate, low, high = (here[name].to_numpy() for name in ("rate", "rate_low", "rate_high"))
    dead = (rate > 0) & np.isfinite(rate)
    mean = 1 / rate[dead]
    bars = np.vstack([mean - 1 / high[dead], 1 / low[dead] - mean])
    axes.errorbar(
        x[dead], mean, yerr=bars, marker="o", markersize=4, markerfacecolor="white",
        color=ink, linewidth=0.8, elinewidth=0.7, label=label,
    )  # fmt: skip
    above = x[~dead], 1 / high[~dead]
    axes.plot(*above, "^", color=ink, markersize=5, markerfacecolor="white", clip_on=False)


# --- the velocity near the threshold -------------------------------------------------------------

_NEAR = "chain-near-threshold"
_NEAR_REMARK = (
    "near A* rare advances make up the velocity, which the law of the sliding limit neglects"
)


def near_tables(data: Data) -> list[Table]:
    """Return the velocities of thirty sliders near A*, with and without disorder."""
    title = "Thirty sliders near Eq. (seuil), with and without disorder; mean over starts"
    law = "vitesse_seuil"
    rows = []
    for (sigma, amplitude), group in groupby(
        cells(data[_NEAR]), key=lambda cell: (cell.varied["sigma_mu"], cell.varied["amplitude"])
    ):
        same = list(group)
        v = np.array([cell.velocity for cell in same])
        error = float(v.std(ddof=1)) / np.sqrt(v.size) if v.size > 1 else np.nan
        varied = {"sigma_mu": sigma, "amplitude": amplitude}
        cell = same[0]._replace(varied=varied, velocity=float(v.mean()), error=error)
        row = beside(cell, law)
        rows.append(replace(row, remark=_NEAR_REMARK) if row.departs else row)
    return [table_of(_NEAR, title, rows, law, note=BELOW_THRESHOLD)]


def draw_near(data: Data, tables: list[Table]) -> Figure:
    """Draw the velocity of thirty sliders over the amplitude near A*, logarithmically."""
    unit = critical_amplitude(cells(data[_NEAR])[0].parameters)
    figure = picture(5.8, 4.2)
    axes = figure.subplots()
    (one,) = tables
    for sigma, style in ((0.0, CYCLES), (0.01, RANDOM)):
        rows = [row for row in one.rows if float(row.varied["sigma_mu"]) == sigma]
        x = [{"ratio": float(row.varied["amplitude"]) / unit} for row in rows]
        shown = [replace(row, varied=ratio) for row, ratio in zip(rows, x, strict=True)]
        points(axes, shown, "ratio", **style, label=rf"$\sigma_\mu = {sigma:g}$")
    parameters = cells(data[_NEAR])[0].parameters
    ratios = np.linspace(0.9, 1.16, 521)
    law = law_line(LAWS["vitesse_seuil"].exact, "amplitude", (ratios * unit).tolist(), parameters)
    axes.plot(ratios, law, label=f"{law_name('vitesse_seuil')}, not below 0", **PRINTED)
    corrected = setting_amplitude(parameters) / unit
    axes.axvline(1, color="0.5", linewidth=0.8, linestyle=(0, (1, 2)))
    axes.axvline(corrected, color="0.5", linewidth=0.8, linestyle=(0, (4, 1.5)))
    axes.set_yscale("symlog", linthresh=1e-3)
    axes.set_ylim(-2e-3, 30)
    axes.set_xlabel(RATIO + r"   (dashed: $(Nm+D)/(2\tilde{l}_0)$)")
    axes.set_ylabel(VELOCITY)
    axes.legend(loc="lower right")
    return figure
