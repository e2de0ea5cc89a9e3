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
from functools import partial
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

from exactcreep.figures import departures, drawing
from exactcreep.figures.departures import setting_amplitude
from exactcreep.figures.drawing import Picture, law_name
from exactcreep.figures.style import DASHED, DOTTED, INKS, Style
from exactcreep.figures.tables import Data, Point, Table, over_starts, points_of, table_beside
from exactcreep.laws import EDGES, critical_amplitude, law_values
from exactcreep.model.chain import Chain
from exactcreep.model.outcome import Outcome
from exactcreep.model.state import State
from exactcreep.studies.fates.fate import fate
from exactcreep.studies.fates.result import Fate
from exactcreep.studies.fates.survival import survival
from exactcreep.studies.thresholds.criteria import threshold
from exactcreep.studies.thresholds.horizon import Question
from exactcreep.studies.thresholds.intercept import Intercept

Say = Callable[..., None]
HORIZON = 20
"""Cycles after which the criterion ``horizon`` looks whether x_G still advances."""
_SEARCHED = 0.8, 1.6  # units of Eq. (seuil)
_BOUNDS = {
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


def unit_of(n: int) -> float:
    """Return Eq. (seuil) for the chain of n sliders: the unit of amplitudes."""
    return critical_amplitude(chain_of(n).parameters())


def bound(name: str, n: int) -> float:
    """Return the amplitude of a theorem in units of Eq. (seuil)."""
    return law_values(EDGES[name].form, chain_of(n).parameters())[0] / unit_of(n)


# --- thresholds by criterion ---------------------------------------------------------------------


def _thresholds(
    *, sizes: Sequence[int], step: float, starts: int, cycles: int, velocity_cycles: int,
    most_velocity: int, say: Say,
) -> xr.Dataset:  # fmt: skip
    """Return thresholds of chains of `sizes` by every criterion, in units of Eq. (seuil).

    `step`, in these units, is that of the amplitudes of the horizon, and the width at which
    bisection for half of the `starts` that creep for `cycles` ends. Every velocity of the
    intercept, of chains of up to `most_velocity` sliders, takes `velocity_cycles`.
    """
    shipped = lasting_edges()
    rows = []
    for n in sizes:
        unit = unit_of(n)
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
    return math.nan if low == _SEARCHED[0] else (low + high) / 2


_MEANT = {
    "horizon": f"The relaxed chain still advances in cycle {HORIZON}",
    "lasting": "The relaxed chain creeps for ever (proved)",
    "survival": "Half of the starts still creep",
    "intercept": r"$v(A)$ drawn on to zero, $\sigma_\mu=.01$",
}
_WORDS = _MEANT | {"intercept": "The straight part of v(A) drawn on to zero, sigma_mu = .01"}


def _threshold_tables(data: Data) -> list[Table]:
    """Return the thresholds of every criterion, that which has a law beside it."""
    dataset = data["thresholds-by-criterion"]
    tables = []
    for name, words in _WORDS.items():
        known = dataset.dropna("n", subset=[name])
        law = (1.0,) if name == "intercept" else ()
        rows = []
        for n in known["n"].to_numpy().tolist():
            here = known.sel(n=n)
            error = float(here["intercept_error"]) if law else math.nan
            row = Point({"n": n}, float(here[name]), error, law)
            remark = "the velocities of a short chain have steps" if row.departs else ""
            rows.append(replace(row, remark=remark))
        title = f"Threshold in units of Eq. (seuil): {name}"
        note = f"{words}. " + ("Eq. (seuil) is its law." if law else "It has no law.")
        printed = "1" if law else "-"
        tables.append(Table(name, title, tuple(rows), printed, note=note, unit="Eq. (seuil)"))
    return tables


@partial(
    Picture, "thresholds-by-criterion", (6.4, 4.4), _threshold_tables,
    {"thresholds-by-criterion": {
        "sizes": [*range(2, 9), 12, 30], "step": 0.02, "starts": 8, "cycles": 400,
        "velocity_cycles": 100, "most_velocity": 12,
    }},
    always={
        "sizes": [*range(2, 13), 16, 20, 30, 60], "step": 0.005, "starts": 16, "cycles": 4000,
        "velocity_cycles": 400, "most_velocity": 30,
    },
    compute=_thresholds,
)  # fmt: skip
def criteria(figure: Figure, data: Data, tables: list[Table]) -> None:
    """Draw thresholds over N in units of Eq. (seuil), by criterion, with the theorems' bounds."""
    longest = max(3, *data["thresholds-by-criterion"]["n"].to_numpy().tolist())
    axes = figure.subplots()
    every = np.unique(np.geomspace(2, longest, 60).astype(int)).tolist()
    for (name, label), ink in zip(_BOUNDS.items(), (INKS[7], INKS[4], INKS[5]), strict=True):
        values = np.array([bound(name, n) for n in every])
        shown = np.where(values > 0, values, math.nan)
        axes.plot(every, shown, color=ink, linewidth=1, label=label)
    axes.axhline(1, label=law_name("seuil"), **drawing.PRINTED)
    law = [setting_amplitude(chain_of(n).parameters()) / unit_of(n) for n in every]
    axes.plot(every, law, label=r"$(Nm+D)/(2\tilde{l}_0)$", **drawing.EXACT)
    inks = INKS[6], INKS[2], INKS[6], INKS[3]
    for table, mark, ink, label in zip(tables, "xDos", inks, _MEANT.values(), strict=True):
        style: Style = {"marker": mark, "color": ink, "label": label, "markerfacecolor": "white"}
        drawing.draw_points(axes, table.rows, "n", **style)
    axes.set_xscale("log")
    marks = (2, 3, 4, 6, 8, 12, 20, 30, 60)
    axes.set_xticks(marks, [str(n) for n in marks])
    axes.minorticks_off()
    axes.set(xlim=(1.9, 1.1 * max(every)), xlabel="N")
    axes.set(ylim=(0, 1.9), ylabel=r"threshold / $A_\theta^*$ of the paper")
    axes.legend(loc="upper right", fontsize=7, ncols=2)


# --- fates over the amplitude --------------------------------------------------------------------

_KINDS = {
    "at rest": "#E6E6E6",
    "locked": INKS[0],
    "period 1": INKS[2],
    "period 2 to 10": "#8FD3B8",
    "period 11 and more": INKS[5],
    "not settled": INKS[1],
}
_DASHES: tuple[Any, ...] = ((0, (1, 1)), "-", DASHED)  # of the theorems' bounds


def _fates(
    *, sizes: Sequence[int], low: float, high: float, count: int, cycles: int, say: Say
) -> xr.Dataset:
    """Return the fate of relaxed chains, as float64 finds it within so many cycles.

    At `count` equally spaced amplitudes from `low` to `high`, in units of Eq. (seuil).
    """
    ratios = np.linspace(low, high, count)
    found = []
    for n in sizes:
        amplitudes = (ratios * unit_of(n)).tolist()
        row = [fate(chain_of(n), a, cycles=cycles, solver="exact") for a in amplitudes]
        found.append([(_kind(one), one.period or 0) for one in row])
        say(len(found), len(sizes), "sizes")
    kinds, periods = np.moveaxis(np.array(found), -1, 0)
    return xr.Dataset(
        {"kind": (("n", "ratio"), kinds), "period": (("n", "ratio"), periods)},
        {"n": list(sizes), "ratio": ratios},
        {"kinds": list(_KINDS), "cycles": cycles},
    )


def _kind(found: Fate) -> int:
    """Return the number of a fate among `_KINDS`."""
    if found.outcome in (Outcome.AT_REST, Outcome.CYCLING):
        return int(found.outcome is Outcome.CYCLING)
    if found.outcome is not Outcome.CREEPING or found.period is None:
        return 5
    return 2 + (found.period > 1) + (found.period > 10)


def _fate_tables(data: Data) -> list[Table]:
    """Return the ranges of amplitudes of one kind of fate, and how wide they are."""
    dataset = data["fate-map"]
    rows = []
    for n in dataset["n"].to_numpy().tolist():
        for kind, first, last in _ranges(dataset, n):
            ends = {"n": n, "from": round(first, 6), "to": round(last, 6)}
            rows.append(Point(ends, last - first, remark=kind))
    title = (
        "Fates of relaxed chains over A / Eq. (seuil), float64; measured: how wide each range is"
    )
    note = f"Not settled: within {dataset.attrs['cycles']} cycles."
    return [Table("fate-map", title, tuple(rows), note=note, unit="Eq. (seuil)")]


def _ranges(dataset: xr.Dataset, n: int) -> Iterator[tuple[str, float, float]]:
    """Yield the ranges of one kind of fate: the kind, the first and the last amplitude."""
    kinds = dataset["kind"].sel(n=n).to_numpy().tolist()
    pairs = zip(kinds, dataset["ratio"].to_numpy().tolist(), strict=True)
    for kind, group in groupby(pairs, key=itemgetter(0)):
        within = [ratio for _, ratio in group]
        yield list(_KINDS)[kind], within[0], within[-1]


@partial(
    Picture, "fate-map", (6.8, 4.2), _fate_tables, {"fate-map": {"count": 81, "cycles": 500}},
    always={"sizes": list(range(3, 9)), "low": 0.8, "high": 2.0, "count": 481, "cycles": 4000},
    compute=_fates,
)  # fmt: skip
def fate_map(figure: Figure, data: Data, tables: list[Table]) -> None:
    """Draw the fates of chains over the amplitude as one map, a band for each N."""
    dataset = data["fate-map"]
    ratios = dataset["ratio"].to_numpy()
    half = (ratios[1] - ratios[0]) / 2
    axes = figure.subplots()
    sizes = dataset["n"].to_numpy().tolist()
    lines = [{"color": "black", "linestyle": dashes} for dashes in _DASHES]
    for n in sizes:
        for kind, first, last in _ranges(dataset, n):
            width = last - first + 2 * half
            axes.barh(n, width, 0.8, first - half, color=_KINDS[kind], linewidth=0)
        for name, line in zip(_BOUNDS, lines, strict=True):
            axes.plot([bound(name, n)] * 2, [n - 0.48, n + 0.48], **line)
    axes.set(xlim=(ratios[0], ratios[-1]), xlabel=drawing.RATIO, yticks=sizes, ylabel="N")
    axes.tick_params(axis="y", which="both", length=0)
    patches = [Patch(color=shade, label=kind) for kind, shade in _KINDS.items()]
    marks = [Line2D([], [], label=label, **line)
             for label, line in zip(_BOUNDS.values(), lines, strict=True)]  # fmt: skip
    figure.legend(handles=[*patches, *marks], loc="outside upper center", ncols=3, fontsize=7)


# --- lives of creep ------------------------------------------------------------------------------


def _lifetimes(
    *, sizes: Sequence[int], ratios: Sequence[float], starts: int, cycles: int, say: Say
) -> xr.Dataset:
    """Return at which rate creep from `starts` dies within `cycles`.

    The `ratios` are amplitudes in units of the largest with a locked cycle in which the ends alone
    slip.
    """
    rows = []
    for n in sizes:
        edge = law_values(EDGES["locked_ends"].form, chain_of(n).parameters())[0]
        every = [survival(chain_of(n), x * edge, starts=starts, cycles=cycles) for x in ratios]
        rows.append([(one.durations.sum(), one.lifetimes.size, *one.rate[:3]) for one in every])
        say(len(rows), len(sizes), "sizes")
    names = ("lived", "deaths", "rate", "rate_low", "rate_high")
    columns = zip(names, np.moveaxis(np.array(rows), -1, 0), strict=True)
    found = xr.Dataset(
        {name: (("n", "ratio"), values) for name, values in columns},
        {"n": list(sizes), "ratio": list(ratios)},
        {"starts": starts, "cycles": cycles},
    )
    return found.assign(deaths=found["deaths"].astype(np.int64))


def _lifetime_tables(data: Data) -> list[Table]:
    """Return the mean lifetime at every amplitude, in cycles, where any start died."""
    dataset = data["lifetimes"]
    rows = []
    for n in dataset["n"].to_numpy().tolist():
        for ratio in dataset["ratio"].to_numpy().tolist():
            here = dataset.sel(n=n, ratio=ratio)
            died, rate = int(here["deaths"]), float(here["rate"])
            varied = {"n": n, "ratio": round(ratio, 6)}
            if died and math.isfinite(rate):
                mean, remark = 1 / rate, f"{died} deaths"
                rows.append(Point(varied, mean, mean / math.sqrt(died), remark=remark))
            else:
                remark = "nobody died: at least that long, at 97.5 %"
                rows.append(Point(varied, 1 / float(here["rate_high"]), remark=remark))
    title = "Mean life of creep in cycles, over A / (largest with a locked cycle of the ends alone)"
    return [Table("lifetimes", title, tuple(rows), unit="cycles")]


@partial(
    Picture, "lifetimes", (5.8, 4.2), _lifetime_tables,
    {"lifetimes": {"sizes": [6], "ratios": [0.95, 0.96, 0.97], "starts": 20, "cycles": 5000}},
    always={
        "sizes": [6, 7, 8], "starts": 40, "cycles": 40_000,
        "ratios": [0.9, 0.92, 0.94, 0.95, 0.955, 0.96, 0.965, 0.97, 0.975, 0.98],
    },
    compute=_lifetimes,
)  # fmt: skip
def lives(figure: Figure, data: Data, tables: list[Table]) -> None:
    """Draw the mean life of creep over the amplitude, with its interval."""
    dataset = data["lifetimes"]
    axes = figure.subplots()
    for n, ink in zip(dataset["n"].to_numpy().tolist(), INKS, strict=False):
        _draw_lives(axes, dataset.sel(n=n), ink, f"N = {n}")
    axes.axvline(1, color="0.4", linestyle=DASHED, linewidth=0.9)
    if not dataset["deaths"].to_numpy().all():
        axes.plot([], [], "^", color="0.4", markerfacecolor="white", label="nobody died: at least")
    axes.set(
        xlim=(float(dataset["ratio"].min()) - 0.01, 1.005), yscale="log",
        xlabel=r"$A_\theta$ / largest with a locked cycle of sliders 1 and N alone",
        ylabel="mean life  (cycles lived / deaths)",
    )  # fmt: skip
    axes.legend(loc="lower right")


def _draw_lives(axes: Axes, here: xr.Dataset, ink: str, label: str) -> None:
    died = (here["rate"] > 0) & np.isfinite(here["rate"])
    dead, alive = here.isel(ratio=died.to_numpy()), here.isel(ratio=~died.to_numpy())
    mean = 1 / dead["rate"]
    bars = np.vstack([mean - 1 / dead["rate_high"], 1 / dead["rate_low"] - mean])
    axes.errorbar(
        dead["ratio"], mean, yerr=bars, marker="o", markersize=4, markerfacecolor="white",
        color=ink, linewidth=0.8, elinewidth=0.7, label=label,
    )  # fmt: skip
    least = 1 / alive["rate_high"]
    axes.plot(alive["ratio"], least, "^", color=ink, markersize=5, markerfacecolor="white",
              clip_on=False)  # fmt: skip


# --- the velocity near the threshold -------------------------------------------------------------

_NEAR_REMARK = (
    "near A* rare advances make up the velocity, which the law of the sliding limit neglects"
)


def _near_tables(data: Data) -> list[Table]:
    """Return the velocities of thirty sliders near A*, with and without disorder."""
    title = "Thirty sliders near Eq. (seuil), with and without disorder; mean over starts"
    law = "vitesse_seuil"
    rows = [point.beside(law) for point in over_starts(points_of(data["chain-near-threshold"]))]
    said = [replace(row, remark=_NEAR_REMARK) if row.departs else row for row in rows]
    return [table_beside("chain-near-threshold", title, law, said, departures.BELOW_THRESHOLD)]


@partial(
    Picture, "chain-near-threshold", (5.8, 4.2), _near_tables,
    {"chain-near-threshold": {
        "drive.cycles": 250, "vary.run.start": [{"size": "1e-3", "seed": k} for k in (1, 2)],
    }},
)  # fmt: skip
def near(figure: Figure, data: Data, tables: list[Table]) -> None:
    """Draw the velocity of thirty sliders over the amplitude near A*, logarithmically."""
    (table,) = tables
    unit = critical_amplitude(table.parameters)
    axes = figure.subplots()
    for sigma, style in ((0.0, drawing.CYCLES), (0.01, drawing.RANDOM)):
        kept = [row for row in table.rows if float(row.varied["sigma_mu"]) == sigma]
        label = rf"$\sigma_\mu = {sigma:g}$"
        drawing.draw_points(axes, kept, departures.reduced, **style, label=label)
    ratios = np.linspace(0.9, 1.16, 521)
    over = "amplitude", (ratios * unit).tolist(), table.parameters
    law = drawing.law_line("vitesse_seuil", *over, "exact")
    label = f"{law_name('vitesse_seuil')}, not below 0"
    axes.plot(ratios, law, label=label, **drawing.PRINTED)
    axes.axvline(1, color="0.5", linewidth=0.8, linestyle=DOTTED)
    corrected = setting_amplitude(table.parameters) / unit
    axes.axvline(corrected, color="0.5", linewidth=0.8, linestyle=DASHED)
    axes.set_yscale("symlog", linthresh=1e-3)
    axes.set(
        xlabel=drawing.RATIO + r"   (dashed: $(Nm+D)/(2\tilde{l}_0)$)",
        ylim=(-2e-3, 30), ylabel=drawing.VELOCITY,
    )  # fmt: skip
    axes.legend(loc="lower right")
