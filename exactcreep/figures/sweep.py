"""The velocities of a sweep beside the laws: the points of its grid, and its picture."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import PowerNorm
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from exactcreep.figures.style import (
    DASHED,
    DASHES,
    DISPLACEMENT,
    INKS,
    MOST_NAMED,
    STYLE,
    VELOCITY,
    new_figure,
    setting_label,
    styled,
    symbol_of,
)
from exactcreep.laws import Prediction, prediction_of
from exactcreep.model.drive import Cycles
from exactcreep.model.numbers import InputError, exact_number, nearest_float
from exactcreep.model.uniform import END_FORCES, EXPANSION
from exactcreep.quasistatic.statistics import mean_over_seeds
from exactcreep.solvers.sliding import Sliding
from exactcreep.studies.sweep import SEED, dimensions

MAPPED = 5
"""A sweep over two quantities with at least this many values each is drawn as a map."""
LIMIT = r"exact for $\mu_\mathrm{s}\to\mu_\mathrm{d}$"
"""Legend of the law of the sliding limit."""
STICKING = "law of sticking sliders"
"""Legend of `laws.sticking_velocity`."""
STAIRCASE = "staircase of relaxed starts, exact"
"""Legend of `laws.staircase_two_sliders`."""
_SHARED = ("n", "l0", "mu_d", "mu_s", "sigma_mu", "tan_alpha", "amplitude", "sigma_theta")
_UNLIKE = (END_FORCES, EXPANSION)
_ROUNDING = 1e-9  # relative; smaller differences are rounding errors
_FINE = 80  # points along a side of a map at which the law is computed


@dataclass(frozen=True)
class Point:
    """A measured velocity, and the point of the grid at which it was measured.

    `varied`: the dimensions of the grid, without the seed, and their values; `measured`, `error`:
    mean over the seeds and its standard error, unit ``g tau_dyn**2`` per half-cycle (or target);
    `parameters`: the exact chain and drive, by the names of the laws' parameters, and whatever else
    was varied.
    """

    varied: Mapping[str, Any]
    measured: float
    error: float = math.nan
    parameters: dict[str, Any] = field(default_factory=dict)

    def prediction(self, **changed: Any) -> Prediction | None:
        """Return what the laws predict here, or where some parameters differ, or None."""
        relaxed = self.varied.get("start", "relaxed") == "relaxed"
        return predicted(self.parameters | changed, relaxed=relaxed)


def deviation(measured: float, error: float, law: Sequence[float]) -> float:
    """Return how many standard errors `measured` lies above the law, or outside its two values.

    It is 0 between two values, nan without a law or an error, and +-inf without a scatter.
    """
    if not law or math.isnan(measured) or math.isnan(error):
        return math.nan
    low, high = min(law), max(law)
    outside = measured - high if measured > high else min(measured - low, 0.0)
    rounding = _ROUNDING * max(abs(low), abs(high), 1.0)
    if abs(outside) <= rounding:
        return 0.0
    return outside / error if error > rounding else math.copysign(math.inf, outside)


def points_of(dataset: xr.Dataset, most: int | None = None) -> list[Point]:
    """Return the points of a grid, or the first of them; each is the mean over the seeds."""
    vary: dict[str, list[Any]] = json.loads(dataset.attrs["vary"])
    names = dimensions(vary)
    known = (*_SHARED, *_UNLIKE, "solver")
    shared = {name: exact_or_same(dataset.attrs[name]) for name in known if name in dataset.attrs}
    for name in ("mu_d", "mu_s", *_UNLIKE):  # in files, a list is a text of numbers and spaces
        if isinstance(shared.get(name), str) or (name in _UNLIKE and name in shared):
            shared[name] = [exact_number(number, name) for number in str(shared[name]).split()]
    points = []
    keys = [key for key in vary if key != SEED]
    all_values = itertools.product(*(enumerate(vary[key]) for key in keys))
    for chosen in itertools.islice(all_values, most):
        pairs = dict(zip(keys, chosen, strict=True))
        own = {key.rpartition(".")[2]: exact_or_same(value) for key, (_, value) in pairs.items()}
        varied = {names[key]: _shown(value) for key, (_, value) in pairs.items()}
        here = dataset.isel({names[key]: place for key, (place, _) in pairs.items()})
        velocity, error = (np.atleast_1d(here[name]) for name in ("velocity", "velocity_error"))
        mean, off = map(float, mean_over_seeds(velocity, error))
        points.append(Point(varied, mean, off, shared | own))
    return points


def exact_or_same(value: Any) -> Any:
    """Return a number as an exact rational, and anything else unchanged."""
    try:
        return exact_number(value, "value")
    except InputError:
        return value


def _shown(value: Any) -> Any:
    exact = exact_or_same(value)
    if not isinstance(exact, Fraction):
        return value if isinstance(value, str) else json.dumps(value)
    return int(exact) if exact.denominator == 1 else nearest_float(exact)


# --- drawing -------------------------------------------------------------------------------------


def _draw_points(axes: Axes, points: Sequence[Point], x: str, **style: Any) -> None:
    """Draw measured velocities over a dimension, with their standard errors."""
    # a runaway chain has no velocity
    y = [point.measured if math.isfinite(point.measured) else math.nan for point in points]
    error = [0.0 if math.isnan(point.error) else point.error for point in points]
    about = {"marker": "o", "markersize": 4, "linestyle": "none", "elinewidth": 0.7, "capsize": 0}
    places = [point.varied[x] for point in points]
    axes.errorbar(places, y, yerr=error, zorder=3, **{**about, "markeredgewidth": 0.8, **style})


def as_lines(vary: Mapping[str, Sequence[Any]]) -> bool:
    """Return whether a grid is drawn as trajectories: no number in it has three values."""
    lengths = (_numbers(list(map(_shown, values))) for key, values in vary.items() if key != SEED)
    return max(lengths, default=0) < 3


@styled
def draw_sweep(dataset: xr.Dataset, title: str = "") -> Figure:
    """Draw the trajectories of a grid if it has them and `as_lines` holds, else velocities."""
    vary = json.loads(dataset.attrs["vary"])
    if "recorded_x_G" in dataset and as_lines(vary):
        figure = new_figure(6.4, 4.4, title)
        _draw_trajectories(figure.subplots(), dataset, vary)
        return figure
    points = points_of(dataset)
    figure = new_figure(*((6.0, 4.4) if _mapped(points) else (5.6, 4.0)), title)
    _draw(figure.subplots(), points)
    return figure


def _draw_trajectories(axes: Axes, dataset: xr.Dataset, vary: Mapping[str, Sequence[Any]]) -> None:
    """Draw x_G of every cell that recorded it, coloured by the first key that varies."""
    lines = dataset["recorded_x_G"].to_numpy().reshape(-1, dataset.sizes["half_cycle"])
    telling = {key for key, values in vary.items() if len(values) > 1}
    styles = itertools.cycle(itertools.product(DASHES, INKS))
    look: dict[str, tuple[Any, str]] = {}
    for values, line in zip(itertools.product(*vary.values()), lines, strict=True):
        labels = [setting_label(key, value) for key, value in zip(vary, values, strict=True)
                  if key in telling]  # fmt: skip
        family = next(iter(labels), "")
        label = "" if family in look else family
        dashes, ink = look.setdefault(family, look.get(family) or next(styles))
        reached = np.flatnonzero(np.isfinite(line))
        axes.plot([0, *(reached + 1)], [0.0, *line[reached]], color=ink, linestyle=dashes,
                  label=label, linewidth=1.4 if label else 0.8)  # fmt: skip
    target = "half-cycles" if dataset.attrs.get("drive") == Cycles.kind else "targets"
    axes.set(xlabel=rf"time $t/\tau_\mathrm{{th}}$ ({target})", ylabel=DISPLACEMENT)
    axes.margins(x=0.01)
    if telling and len(look) <= MOST_NAMED:
        axes.legend(loc="best")


def plot_sweep(dataset: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the velocities of a sweep with their errors beside the laws; return the axes.

    The quantity with most values is along the axis; each point is the mean over its seeds. Others
    make families in their own colour. A broken line is the law of the sliding limit, a full line in
    a band the law of sliders that stick and slip. If exactly two quantities vary, with at least
    five values each, a map shows the velocity in colour, and the laws as contours.

    Parameters
    ----------
    dataset : Dataset
        Returned by `sweep`, or read from its ``sweep.nc`` with `xarray.open_dataset`.
    ax : Axes, optional
        Default: new axes.

    Returns
    -------
    Axes
        Velocities in ``g tau_dyn**2`` per half-cycle (or target).

    Raises
    ------
    InputError
        If the dataset is not the whole grid of a sweep, or nothing varies but the seed.

    Examples
    --------
    >>> scene = load_scene("two-sliders-cycles").with_settings({"drive.cycles": 10})
    >>> grid = sweep(scene.with_settings({"vary.chain.n": [2, 3, 4]}))
    >>> plot_sweep(grid).get_xlabel()
    'N'
    """
    whole = isinstance(dataset, xr.Dataset) and "vary" in dataset.attrs
    vary = json.loads(dataset.attrs["vary"]) if whole else {}
    sizes = {name: len(vary[key]) for key, name in dimensions(vary).items()}
    if not whole or any(dataset.sizes.get(name) != size for name, size in sizes.items()):
        allowed = "must be a whole grid that sweep returned, nothing averaged or left out"
        raise InputError("dataset", type(dataset).__name__, allowed)
    if not {*vary} - {SEED}:
        raise InputError("dataset", [*vary], "must vary something other than the seed")
    points = points_of(dataset)
    with mpl.rc_context(STYLE):
        axes = ax or plt.subplots(layout="constrained")[1]
        _draw(axes, points)
    return axes


def _values(points: Sequence[Point]) -> dict[str, list[Any]]:
    return {key: list(dict.fromkeys(point.varied[key] for point in points))
            for key in points[0].varied}  # fmt: skip


def _numbers(values: Sequence[Any]) -> int:
    """Return how many values there are, or 0 if any of them is not a number."""
    return 0 if any(isinstance(value, str) for value in values) else len(values)


def _mapped(points: Sequence[Point]) -> bool:
    values = _values(points)
    return len(values) == 2 and min(map(_numbers, values.values())) >= MAPPED


def _draw(axes: Axes, points: Sequence[Point]) -> None:
    values = _values(points)
    if _mapped(points):
        _draw_map(axes, points, *values)
    else:
        over = max(values, key=lambda key: (_numbers(values[key]) > 0, len(values[key])))
        draw_families(axes, points, over)


def _draw_map(axes: Axes, points: Sequence[Point], across: str, up: str) -> None:
    """Draw the velocity in colour, by its square root to show slow creep, and laws as contours."""
    x, y = (sorted({point.varied[key] for point in points}) for key in (across, up))
    measured = {(point.varied[across], point.varied[up]): point.measured for point in points}
    values = np.ma.masked_invalid([[measured[a, b] for a in x] for b in y])  # of a runaway chain
    image = axes.pcolormesh(x, y, values, shading="nearest", cmap="cividis", rasterized=True,
                            norm=PowerNorm(0.5))  # fmt: skip
    axes.figure.colorbar(image, ax=axes, pad=0.02, label=VELOCITY)
    axes.set(xlabel=symbol_of(across), ylabel=symbol_of(up))
    fine_x, fine_y = _between(x), _between(y)
    found = [[points[0].prediction(**{across: a, up: b}) for a in fine_x] for b in fine_y]
    sticks = np.array([[sticking(one)[0] for one in row] for row in found])
    slides = np.array([[_sliding(one)[0] for one in row] for row in found])
    slides[np.isfinite(sticks)] = math.nan
    levels, words = MaxNLocator(8).tick_values(*image.get_clim()), []
    for form, dashes, name in ((sticks, "-", STICKING), (slides, "--", LIMIT)):
        low, high = np.nanmin(form, initial=math.inf), np.nanmax(form, initial=-math.inf)
        if inside := [level for level in np.asarray(levels).tolist() if low < level < high]:
            lines = axes.contour(fine_x, fine_y, form, levels=inside, colors="white",
                                 linewidths=0.9, linestyles=dashes)  # fmt: skip
            axes.clabel(lines, fontsize=7, fmt="%g")
            words.append(f"{'full' if dashes == '-' else 'broken'} lines: {name}")
    axes.set_title("; ".join(words), fontsize=8)


def draw_families(axes: Axes, points: Sequence[Point], over: str) -> None:
    """Draw the velocity over one quantity, each value of the others in its own colour."""
    families: dict[str, list[Point]] = {}
    for point in points:
        others = [setting_label(key, value) for key, value in point.varied.items() if key != over]
        families.setdefault(", ".join(others) or "computed", []).append(point)
    marks = itertools.cycle(itertools.product("os^D", INKS))
    fine, drawn = _between([point.varied[over] for point in points]), dict[str, Any]()
    for (label, family), (mark, ink) in zip(families.items(), marks, strict=False):
        _draw_points(axes, family, over, marker=mark, color=ink, markerfacecolor="white",
                    label=label)  # fmt: skip
        found = [family[0].prediction(**{over: value}) for value in fine]
        named = next((f"paper, {law.label}" for law in found if law), "")
        for name, law, dashes, width in (
            (LIMIT, _sliding, DASHED, 1.3), (named, _printed, ":", 1.6),
            (STICKING, sticking, "-", 1.0), (STAIRCASE, _staircase, "-", 1.0),
        ):  # fmt: skip
            values, off = np.transpose([law(one) for one in found])
            if np.isfinite(values).any():
                axes.plot(fine, values, color=ink, linestyle=dashes, linewidth=width)
                axes.fill_between(fine, values - off, values + off, color=ink, alpha=0.2)
                drawn[name] = dashes
    for name, dashes in drawn.items():
        axes.plot([], [], color="0.3", linewidth=1.0, linestyle=dashes, label=name)
    finite = [point for point in points if math.isfinite(point.measured)]
    if unsure := sum(math.isnan(point.error) for point in finite):
        axes.plot([], [], " ", label=f"errors of {unsure} of {len(finite)} are not known")
    if isinstance(fine[0], str):
        axes.margins(x=0.15)
    elif _spans_decades(fine):
        measured = [point.measured for point in finite]
        axes.set(xscale="log", yscale="log" if min(measured, default=0) > 0 else "linear")
    axes.set(xlabel=symbol_of(over), ylabel=VELOCITY)
    if len(families) <= MOST_NAMED:
        axes.legend(loc="best")


def _between(values: Iterable[Any]) -> list[Any]:
    """Return where to draw a law: at many numbers, or only at the values if they are whole."""
    known = list(dict.fromkeys(values))
    if any(isinstance(one, str) for one in known) or all(isinstance(one, int) for one in known):
        return known
    space = np.geomspace if _spans_decades(known) else np.linspace
    return sorted({*known, *space(min(known), max(known), _FINE).tolist()})


def _spans_decades(values: Sequence[Any]) -> bool:
    """Return whether an axis of these numbers is logarithmic."""
    return bool(0 < 100 * min(values) <= max(values))


def predicted(given: Mapping[str, Any], *, relaxed: bool = False) -> Prediction | None:
    """Return the laws' prediction for a point, or None; `sliding` sliders do not stick."""
    about = {key: given[key] for key in (*_SHARED, *_UNLIKE) if key in given}
    if len({*about} & {*_SHARED}) < len(_SHARED) - 1:  # the contacts of a solid vary
        return None
    if given.get("solver") == Sliding.name:
        about |= {"mu_s": about["mu_d"], "sigma_mu": 0}
        relaxed = False
    return prediction_of(about, relaxed=relaxed)


def _sliding(found: Prediction | None) -> tuple[float, float]:
    return _mean(found.sliding if found else ())


def _printed(found: Prediction | None) -> tuple[float, float]:
    return _mean(found.printed if found else ())


def _staircase(found: Prediction | None) -> tuple[float, float]:
    return _mean(() if found is None or found.staircase is None else [found.staircase])


def _mean(values: Sequence[float]) -> tuple[float, float]:
    """Return the value of a law, the mean of its two values, or nan where it does not hold."""
    return (sum(values) / len(values) if values else math.nan), 0.0


def sticking(found: Prediction | None) -> tuple[float, float]:
    """Return the law of sliders that stick and slip, and its deviation; nan outside its range."""
    if found is None or found.sticking is None:
        return math.nan, math.nan
    return found.sticking, found.deviation
