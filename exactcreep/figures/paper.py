"""The paper's figures that show data: the scenes behind each, its tables and its drawing."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from exactcreep.figures.style import (
    DASHED,
    DASHES,
    DOTTED,
    INKS,
    LENGTH,
    VELOCITY,
    new_figure,
    save_picture,
    styled,
)
from exactcreep.figures.sweep import (
    CONTROL,
    EXACT,
    LIMIT,
    STICKING,
    Law,
    Point,
    draw_points,
    mean_law,
    points_of,
    predicted,
    sticking,
)
from exactcreep.laws import (
    creep_velocity,
    creep_velocity_random,
    critical_angle,
    law_values,
    plateau_ends,
    plateau_velocity_random,
    sliding_velocity,
    sliding_velocity_random,
    threshold_amplitude,
    threshold_width,
    two_sliders_velocity_random,
)
from exactcreep.quasistatic.netcdf import netcdf
from exactcreep.quasistatic.writing import write_file
from exactcreep.scene import load_scene
from exactcreep.studies.sweep import SEED, sweep
from exactcreep.watch.progress import Hearer

Data = Mapping[str, xr.Dataset]
"""The sweeps of a picture by the names of their scenes."""
UNIT = "g tau_dyn^2 per half-cycle or target"


_GAUSSIAN = "(N+3-2i) l0 sigma I(h), h = N m/(2 l0 sigma): exact in the sliding limit"
LAWS = {
    "Eq. 17": Law(
        two_sliders_velocity_random,
        sliding_velocity_random,
        "l0 sigma/sqrt(pi) - (2/3) a",
        "l0 sigma I(h), h = m/(l0 sigma): sliding limit, and the mean over phases",
    ),
    "Eq. 20, random": Law(
        plateau_velocity_random,
        sliding_velocity_random,
        "(N+3-2i) l0 sigma/sqrt(pi)",
        _GAUSSIAN,
    ),
    "Eq. 23": Law(
        creep_velocity,
        sliding_velocity,
        "(N+3-2i) (l0 A - N m/2)",
        "(N+3-2i) max(0, l0 A - N m/2): exact in the sliding limit mu_s -> mu_d",
    ),
    "Eq. 24": Law(
        creep_velocity_random,
        sliding_velocity_random,
        "(N+3-2i) (l0 sigma/sqrt(pi) - N m/3)",
        _GAUSSIAN,
    ),
}
"""The laws that tables compare with, by the paper's equations."""


# --- tables --------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Table:
    """The points of one series: a sweep beside a law of the paper.

    `printed`, `exact`: the formulas of the two laws, in words; `note`: one line about the table,
    which says where the printed law differs from the exact one.
    """

    name: str
    title: str
    rows: tuple[Point, ...]
    printed: str = ""
    exact: str = ""
    note: str = ""

    @classmethod
    def of(cls, data: Data, title: str, label: str, note: str = "", scene: str = "") -> Table:
        """Return the table of a scene (default: the first) beside the equation `label`."""
        name, law = scene or next(iter(data)), LAWS[label]
        rows = tuple(point.beside(law) for point in points_of(data[name]))
        return cls(name, title, rows, f"{label}: {law.words}", law.words_exact, note)

    @property
    def parameters(self) -> dict[str, Any]:
        """The chain and the drive of the first point."""
        return self.rows[0].parameters


def to_csv(tables: Sequence[Table]) -> str:
    """Return tables as one CSV: a column for each quantity that varies, numbers in full.

    An unknown number is nan. The cell of a quantity that a series does not vary is empty. A law
    has two columns because its plateau may have two values. Deviations are in standard errors, from
    the law of sliders that stick and slip in units of its own deviation and the error combined.
    """
    varied = list(dict.fromkeys(key for one in tables for row in one.rows for key in row.varied))
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    laws = [f"{form}_law_{end}" for form in ("printed", "exact") for end in ("least", "largest")]
    writer.writerow(["series", *varied, "measured", "standard_error", *laws,
                     "deviation_printed", "deviation_exact", "sticking_law",
                     "sticking_law_deviation", "deviation_sticking", "unit"])  # fmt: skip
    for table in tables:
        for row in table.rows:
            ends = [end(law, default=math.nan) for law in (row.printed, row.exact)
                    for end in (min, max)]  # fmt: skip
            numbers = [row.measured, row.error, *ends, row.deviation_printed, row.deviation_exact,
                       row.sticking, row.sticking_deviation, row.deviation_sticking]  # fmt: skip
            where = [row.varied.get(key, "") for key in varied]
            writer.writerow([table.name, *where, *(repr(float(v)) for v in numbers), UNIT])
    return text.getvalue()


# --- the definition of a picture -----------------------------------------------------------------


@dataclass(frozen=True)
class Picture:
    """A figure of the paper that shows data: its scenes, its tables, its drawing.

    `name`: names the files and the first scene; `figure`: the number of the paper's figure;
    `size`: width and height in inches; `series`: arguments of `Table.of` for each table: title,
    law, and optionally note and scene; `quick`: for each scene the dotted keys that a quick look
    changes; `drawing`: draws into an empty figure, given the data and the tables; `always`: dotted
    keys that are set in every scene, quick or not.
    """

    name: str
    figure: str
    size: tuple[float, float]
    series: Sequence[tuple[str, ...]]
    quick: Mapping[str, Mapping[str, Any]]
    drawing: Callable[[Figure, Data, list[Table]], None]
    always: Mapping[str, Any] = field(default_factory=dict)

    def data(
        self, *, quick: bool, workers: int | None = None, progress: Hearer = None
    ) -> dict[str, xr.Dataset]:
        """Return the sweeps, with the sliding limit under the same random dilations."""
        data = {}
        for name, settings in self.quick.items():
            scene = load_scene(name).with_settings({**self.always, **(settings if quick else {})})
            data[name] = sweep(scene, workers=workers, progress=progress)
            random = scene.tables["drive"].get("kind") == "gaussian"
            if random and "run.solver" not in scene.vary and SEED in scene.vary:
                scene = scene.with_settings({"run.solver": "sliding"})
                data[name] = with_control(data[name], sweep(scene, workers=workers))
        return data

    def tables(self, data: Data) -> list[Table]:
        """Return the tables of the picture."""
        return [Table.of(data, *about) for about in self.series]

    @styled
    def draw(self, data: Data, tables: list[Table]) -> Figure:
        """Return the picture; points outside its axes are marked at the edge."""
        figure = new_figure(*self.size)
        self.drawing(figure, data, tables)
        for axes in figure.axes:
            _mark_outside(axes)
        return figure

    def write(self, data: Data, out: Path, *, force: bool = True) -> list[Table]:
        """Write NAME.png, .pdf, .nc and .csv to a directory, and return the tables."""
        tables = self.tables(data)
        figure = self.draw(data, tables)
        for ending in ("png", "pdf"):
            save_picture(figure, out / f"{self.name}.{ending}", force=force)
        groups = {name if len(data) > 1 else None: dataset for name, dataset in data.items()}
        write_file(out / f"{self.name}.nc", netcdf(groups), "out", force=force)
        write_file(out / f"{self.name}.csv", to_csv(tables).encode(), "out", force=force)
        return tables


def with_control(dataset: xr.Dataset, sliding: xr.Dataset) -> xr.Dataset:
    """Return a sweep with the velocities of the sliding limit under the same dilations."""
    about = {**sliding["velocity"].attrs, "long_name": "sliding limit, same random dilations"}
    return dataset.assign({CONTROL: (sliding["velocity"].dims, sliding["velocity"].data, about)})


# --- what the drawings share ---------------------------------------------------------------------

SLOPE = r"$\tan\alpha$"
Style = dict[str, Any]
LawFunction = Callable[..., Any]
PRINTED: Style = {"color": INKS[0], "linestyle": "-", "linewidth": 1.1}
RANDOM_LAW: Style = {**PRINTED, "color": INKS[3]}  # beside the law of cycles
CYCLES: Style = {"markerfacecolor": "white", "color": INKS[6]}  # open circles, as in the paper
RANDOM: Style = {"color": INKS[6]}  # full circles
GUIDE: Style = {"color": "0.55", "linewidth": 0.7, "linestyle": DOTTED}
ASYMPTOTE: Style = {
    "color": "0.6",
    "linewidth": 0.9,
    "linestyle": "-",
    "label": r"$\tilde{l}_0\sigma_\theta/\sqrt{\pi}$",
}
_NAMES = {
    "Eq. 20": "plateaus of the velocity",
    "Eq. 23": "velocity above the threshold",
    "Eq. 24": "velocity, random dilations",
    "Eq. 17": "velocity of two sliders",
}


def _law_name(label: str) -> str:
    return f"paper, {label}: {_NAMES[label]}"


def _law_line(law: LawFunction, over: str, values: Sequence[Any], given: Style) -> Any:
    """Return a law (or the mean of its two values) at values of one parameter; nan if negative."""
    known = np.array([mean_law(law, given | {over: value}) for value in values])
    return np.where(known < 0, np.nan, known)


def _draw_law(
    axes: Axes, law: LawFunction, over: str, values: Sequence[Any], given: Style, **style: Any
) -> None:
    axes.plot([float(value) for value in values], _law_line(law, over, values, given), **style)


def _mark_outside(axes: Axes) -> None:
    """Mark computed points above or below the axes at their edge, with their values."""
    low, high = axes.get_ylim()
    beyond: dict[tuple[float, bool], list[float]] = {}
    for container in list(axes.containers):
        for x, y in container[0].get_xydata():
            if not low <= y <= high:
                beyond.setdefault((x, y > high), []).append(y)
    for (x, above), values in beyond.items():
        edge, sign, side = (high, "^", "top") if above else (low, "v", "bottom")
        axes.plot(x, edge, sign, color="black", markersize=5, clip_on=False, zorder=4)
        words = ", ".join(f"{value:.4g}" for value in sorted(values))
        where, inwards = axes.transData.transform((x, edge)), axes.bbox.x0 + axes.bbox.x1
        apart = 6 if 2 * where[0] < inwards else -6  # towards the middle, away from axis labels
        _note(axes, words, (x, edge), (apart, -5 if above else 5), va=side, fontsize=7)


def _note(
    axes: Axes, text: str, place: tuple[float, float], apart: tuple[float, float], **style: Any
) -> None:
    about = {"textcoords": "offset points", "ha": "left" if apart[0] > 0 else "right", **style}
    axes.annotate(text, place, xytext=apart, **about)


def _degrees(axes: Axes) -> None:
    """Put the angle in degrees on top of an axis of tan(alpha)."""
    both = (lambda t: np.degrees(np.arctan(t)), lambda a: np.tan(np.radians(a)))
    axes.secondary_xaxis("top", functions=both).set_xlabel(r"$\alpha$ (degrees)")
    axes.tick_params(axis="x", which="both", top=False)


# --- two sliders ---------------------------------------------------------------------------------

_LAW = "Eq. 17"
_STATIC = (
    "The printed law has mu_s cos(alpha) - sin(alpha) where mu_d cos(alpha) - sin(alpha) belongs"
    " (it is low by (2/3)(mu_s - mu_d) cos(alpha)), and is the first two terms of the exact one."
)
_SHOWN = 24  # most dilations of the trace that the eye can separate


@partial(
    Picture, "two-sliders-trace", "2", (5.4, 5.6),
    [("Two sliders under random dilations, l0 sigma_theta = 100", _LAW, _STATIC)],
    {"two-sliders-trace": {}}, always={"run.record": ["x_G", "x"]},
)  # fmt: skip
def trace(figure: Figure, data: Data, tables: list[Table]) -> None:
    """Draw theta and the displacements of two sliders, with the long run in an inset."""
    dataset = data["two-sliders-trace"]
    theta = np.append(0.0, dataset["recorded_theta"])
    x = np.vstack([[0.0, 0.0], dataset["recorded_x"].to_numpy()])
    mean, time, shown = x.mean(axis=1), np.arange(theta.size), slice(0, _SHOWN + 1)
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(1, 2.1))
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
    highest = float(mean[shown].max() - min(mean[shown].min(), 0))
    bottom.set(
        xlim=(0, _SHOWN), xlabel=r"time $t/\tau_\mathrm{th}$ (temperature changes)",
        ylim=(-0.06 * highest, 1.12 * highest), ylabel=f"displacement {LENGTH}",
    )  # fmt: skip
    bottom.legend(loc="upper left")
    (row,) = tables[0].rows
    (law,) = row.printed
    inset = bottom.inset_axes((0.59, 0.11, 0.37, 0.36))
    inset.plot(time, mean / 1000, color=INKS[6], linewidth=1)
    inset.plot(time, law * time / 1000, **PRINTED)
    inset.set(xlim=(0, time[-1]), ylim=(0, None))
    about = f"long run: {row.measured:.1f} per change; {_LAW}: {law:.1f}"
    inset.set_title(about, fontsize=7, pad=3)
    inset.set_ylabel(r"$\Delta\tilde{x}_G/10^3$", fontsize=8, labelpad=1)
    inset.tick_params(labelsize=7)


@partial(
    Picture, "two-sliders-angle", "3", (5.2, 3.9),
    [("Two sliders, random dilations, over tan(alpha)", _LAW, _STATIC)],
    {"two-sliders-angle": {"drive.steps": 1000}},
)  # fmt: skip
def angle(figure: Figure, data: Data, tables: list[Table]) -> None:
    """Draw the velocity of two sliders over the slope."""
    (table,) = tables
    axes = figure.subplots()
    friction, disorder = (table.parameters[name] for name in ("mu_d", "sigma_mu"))
    low, high = plateau_ends(mu_d=friction, sigma_mu=disorder)
    over = "tan_alpha", [Fraction(k, 200) for k in range(1, 100)], table.parameters
    _draw_law(axes, plateau_velocity_random, *over, **ASYMPTOTE)
    plateau = "tan_alpha", np.linspace(low, high, 99).tolist(), table.parameters
    _draw_law(axes, LAWS[_LAW].printed, *plateau, **PRINTED, label=_law_name(_LAW))
    label = f"{LIMIT}: " + r"$\tilde{l}_0\sigma_\theta\,I(h)$"
    _draw_law(axes, LAWS[_LAW].exact, *over, **EXACT, label=label)
    draw_points(axes, table.rows, "tan_alpha", **RANDOM, label="computed")
    for place, name, apart in (
        (low, r"$\alpha_\mathrm{c}^-$", 2),
        (high, r"$\alpha_\mathrm{c}^+$", -2),
        (float(friction), r"$\alpha_\mathrm{c}$", 2),
    ):
        axes.axvline(place, **GUIDE, zorder=0)
        _note(axes, name, (place, 0.35), (apart, 0), fontsize=9)
    axes.set(xlim=(-0.01, 0.53), ylim=(-0.6, 7), xlabel=SLOPE, ylabel=VELOCITY)
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 0.12))
    _degrees(axes)


@partial(
    Picture, "two-sliders-amplitude", "4", (5.2, 5.2),
    [("Two sliders, random dilations, over sigma_theta", _LAW, _STATIC)],
    {"two-sliders-amplitude": {"drive.steps": 800}},
)  # fmt: skip
def amplitude(figure: Figure, data: Data, tables: list[Table]) -> None:
    """Draw the velocity of two sliders over sigma_theta, and its ratio to the asymptote."""
    rows, parameters = tables[0].rows, tables[0].parameters
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(1.6, 1))
    sizes = np.geomspace(1e-4, 0.12, 240).tolist()
    base, printed, exact = (
        _law_line(law, "sigma_theta", sizes, parameters)
        for law in (plateau_velocity_random, LAWS[_LAW].printed, LAWS[_LAW].exact)
    )
    top.plot(sizes, base, **ASYMPTOTE)
    top.plot(sizes, printed, **PRINTED, label=_law_name(_LAW))
    label = r"$\tilde{l}_0\sigma_\theta\,I(h)$, $h = m/(\tilde{l}_0\sigma_\theta)$"
    top.plot(sizes, exact, **EXACT, label=label)
    draw_points(top, rows, "sigma_theta", **RANDOM, label="computed")
    top.set(yscale="log", ylim=(1e-4, 150), ylabel=VELOCITY)
    top.legend(loc="lower right")
    bottom.plot(sizes, np.ones(len(sizes)), **ASYMPTOTE)
    bottom.plot(sizes, printed / base, **PRINTED)
    bottom.plot(sizes, exact / base, **EXACT)

    def ratio(row: Point) -> float:
        return 1 / mean_law(plateau_velocity_random, row.parameters)

    draw_points(bottom, rows, "sigma_theta", ratio, **RANDOM)
    star = mean_law(threshold_width, parameters | {"mu_d": parameters["mu_s"]})
    for axes in (top, bottom):
        axes.axvline(star, **GUIDE, zorder=0)
    _note(top, r"$\sigma_\theta^*$", (star, 20.0), (3, 0))
    bottom.set(
        xscale="log", ylim=(-0.1, 1.15), xlim=(8e-5, 0.13), ylabel="velocity / asymptote",
        xlabel=r"$\sigma_\theta$   ($\tilde{l}_0 = 10^3$)",
    )  # fmt: skip


# --- chains --------------------------------------------------------------------------------------

_BELOW = "Below its threshold the printed law does not hold; the exact law gives zero."
_TWO_TERMS = "The printed law is the first two terms of the exact one in N m/(2 l0 sigma_theta)."
_FOURS = (
    "N = 4k at tan(alpha) = mu_d/2 stands on the edge between two plateaus: the sliding limit is"
    " not unique, and both values are given."
)


@partial(
    Picture, "chain-plateaus", "5", (5.6, 4.4),
    [("Five and six sliders, random dilations, over tan(alpha)", "Eq. 20, random",
      "The printed plateau is the limit of large dilations; the exact law knows the play"
      " N (mu_d cos(alpha) - sin(alpha)) that each reversal costs.")],
    {"chain-plateaus": {"drive.steps": 50}},
)  # fmt: skip
def plateaus(figure: Figure, data: Data, tables: list[Table]) -> None:
    """Draw the velocity of five and of six sliders over the slope, with the plateaus."""
    axes = figure.subplots()
    for n, marks, dashes, width in ((5, CYCLES, DASHES[2], 1.2), (6, RANDOM, "-", 1.1)):
        rows = [row for row in tables[0].rows if row.varied["n"] == n]
        parameters = rows[0].parameters
        printed: Style = {**PRINTED, "linestyle": dashes, "linewidth": width}
        exact = EXACT | ({"linestyle": dashes} if n == 5 else {})
        # a slope at which a plateau ends lies between two of these
        slopes = np.linspace(0, float(parameters["mu_d"]), 480, endpoint=False).tolist()
        over = "tan_alpha", slopes, parameters
        _draw_law(axes, plateau_velocity_random, *over, **printed,
                  label=f"{_law_name('Eq. 20')}, $N={n}$")  # fmt: skip
        _draw_law(axes, sliding_velocity_random, *over, **exact, label=f"{LIMIT}, $N={n}$")
        law_and_deviation = [sticking(predicted(parameters | {"tan_alpha": slope}))
                             for slope in slopes]  # fmt: skip
        values, deviations = np.transpose(law_and_deviation)
        axes.fill_between(slopes, values - deviations, values + deviations, color=INKS[1],
                          alpha=0.45, linewidth=0, label=STICKING if n == 6 else "")  # fmt: skip
        draw_points(axes, rows, "tan_alpha", **marks, label=rf"computed, $N={n}$")
        _mark_angles(axes, n, parameters)
    axes.axvline(float(parameters["mu_d"]), **GUIDE)
    _note(axes, r"$\alpha_\mathrm{c}$", (0.5, 1), (3, 0))
    axes.set(xlim=(-0.01, 0.53), ylim=(-4.2, 42), xlabel=SLOPE, ylabel=VELOCITY)
    axes.legend(loc="upper left", ncols=1)
    _degrees(axes)


def _mark_angles(axes: Axes, n: int, parameters: Style) -> None:
    """Mark the printed critical angles, and below each the window in which two pivots occur."""
    width = float(2 * (parameters["mu_s"] - parameters["mu_d"]) / n)
    height = -1.4 if n == 6 else -2.8
    for i in range(2, n + 1):
        upper = mean_law(critical_angle, parameters | {"i": i})
        if upper <= 0:
            continue
        name = r"two stable pivots, up to $\alpha^*_{N,i}$" if n == 6 and i == 2 else None
        axes.plot([max(upper - width, 0), upper], [height, height], color=INKS[2], linewidth=3,
                  solid_capstyle="butt", zorder=1, label=name)  # fmt: skip
        axes.plot([upper], [height], marker="|", color=INKS[2], markersize=6)
        if i == 2:
            _note(axes, f"$N={n}$", (upper, height), (5, -3), fontsize=7, color=INKS[2])


@partial(
    Picture, "chain-amplitude", "6", (5.4, 4.2),
    [("Thirty sliders, cycles, over the amplitude", "Eq. 23", _BELOW),
     ("Thirty sliders, random dilations, over sigma_theta", "Eq. 24", _TWO_TERMS,
      "chain-amplitude-random")],
    {"chain-amplitude": {"drive.cycles": 30}, "chain-amplitude-random": {"drive.steps": 40}},
)  # fmt: skip
def chain_amplitude(figure: Figure, data: Data, tables: list[Table]) -> None:
    """Draw the velocity of thirty sliders over A_theta and over sigma_theta."""
    cycles, random = tables
    axes, chain = figure.subplots(), cycles.parameters
    sizes = np.linspace(1e-4, 0.0125, 160).tolist()
    _draw_law(axes, creep_velocity, "amplitude", sizes, chain, **PRINTED,
              label=_law_name("Eq. 23"))  # fmt: skip
    over = "sigma_theta", sizes, chain
    label = _law_name("Eq. 24")
    _draw_law(axes, creep_velocity_random, *over, **RANDOM_LAW, label=label)
    _draw_law(axes, sliding_velocity_random, *over, **EXACT, label=f"{LIMIT}: $I(h)$")
    draw_points(axes, cycles.rows, "amplitude", **CYCLES, label="cycles, computed")
    label = "random dilations, computed"
    draw_points(axes, random.rows, "sigma_theta", **RANDOM, label=label)
    for law, text, apart in (
        (threshold_amplitude, r"$A_\theta^*$", -3), (threshold_width, r"$\sigma_\theta^*$", 3),
    ):  # fmt: skip
        place = mean_law(law, chain)
        axes.plot([place, place], [-3, 34], **GUIDE)
        _note(axes, text, (place, 29), (apart, 0))
    axes.axhline(0, color="0.7", linewidth=0.6, zorder=0)
    axes.set(
        xlim=(0, 0.0125), xlabel=r"$A_\theta$ or $\sigma_\theta$   ($\tilde{l}_0 = 10^3$)",
        ylim=(-3, 100), ylabel=VELOCITY,
    )  # fmt: skip
    axes.legend(loc="upper left")


@partial(
    Picture, "chain-size", "7", (5.6, 4.4),
    [("Cycles, over the number of sliders", "Eq. 23", f"{_BELOW} {_FOURS}"),
     ("Random dilations, over the number of sliders", "Eq. 24",
      f"{_TWO_TERMS} {_FOURS}", "chain-size-random")],
    {
        "chain-size": {"drive.cycles": 25},
        "chain-size-random": {
            "drive.steps": 30,
            "vary.chain.n": [*range(2, 9), 10, 12, 14, 18, 22, 26, 30, 38, 46, 56, 64],
        },
    },
)  # fmt: skip
def size(figure: Figure, data: Data, tables: list[Table]) -> None:
    """Draw the velocity over the number of sliders, with the discrete plateaus behind it."""
    axes = figure.subplots()
    sizes = range(2, 67)
    for table, label, style, longest in zip(
        tables, ("Eq. 23", "Eq. 24"), (PRINTED, RANDOM_LAW), (46, 66),
        strict=True,
    ):  # fmt: skip
        given = table.parameters
        # the continuous i of Eq. 19: N + 3 - 2i = N tan(alpha)/mu_d
        slope = given["tan_alpha"] / given["mu_d"]
        smooth = [(n, mean_law(LAWS[label].printed, given | {"n": n, "i": (n + 3 - n * slope) / 2}))
                  for n in sizes]  # fmt: skip
        holds = [(n, value) for n, value in smooth if value >= 0]
        axes.plot(*zip(*holds, strict=True), **style, label=f"{_law_name(label)}, continuous $i$")
        tight = [(n, value) for n in sizes if n <= longest
                 for value in law_values(LAWS[label].exact, given | {"n": n})]  # fmt: skip
        axes.plot(
            *zip(*tight, strict=True), linestyle="none", marker="_", markersize=7,
            markeredgewidth=1.1, color=style["color"], alpha=0.8, zorder=2,
            label=f"{LIMIT}, integer $i$",
        )  # fmt: skip
    for table, style, name in zip(
        tables, (CYCLES, RANDOM), ("cycles", "random dilations"), strict=True
    ):
        draw_points(axes, table.rows, "n", **style, label=f"{name}, computed")
    axes.axhline(0, color="0.7", linewidth=0.6, zorder=0)
    axes.set(xlim=(0, 66), ylim=(-2, 66), xlabel=r"number of sliders $N$", ylabel=VELOCITY)
    axes.legend(loc="upper left")


@partial(
    Picture, "chain-jumps", "8", (5.8, 4.3),
    [("Thirty sliders without disorder near the critical amplitude, from several starts",
      "Eq. 23")],
    {"chain-jumps": {
        "drive.cycles": 600,
        "vary.run.start": ["relaxed", *({"size": "1e-6", "seed": k} for k in (1, 2, 3))],
    }},
    always={"run.record": ["x_G"]},
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
        for number, trajectory in enumerate(x[k]):
            style = others if number else relaxed
            axes.plot(time, np.append(0.0, trajectory), color=ink, zorder=2 + k, **style)
    label = rf"{x.shape[1] - 1} starts each with tensions of $10^{{-6}}$"
    axes.plot([], [], color=INKS[6], **others, label=label)
    axes.set(
        xlim=(0, time[-1]), xlabel=r"time $t/\tau_\mathrm{th}$ (half-cycles)",
        ylim=(min(-1.0, 1.1 * float(x.min())), None),
        ylabel=rf"displacement $\Delta\tilde{{x}}_G$ {LENGTH}",
    )  # fmt: skip
    axes.xaxis.set_major_locator(MaxNLocator(6))
    axes.legend(loc="upper left")


PICTURES: Mapping[str, Picture] = {
    picture.name: picture for picture in list(vars().values()) if isinstance(picture, Picture)
}
"""The paper's figures by name, in the paper's order."""
