"""The velocities of a sweep beside the laws: the points of its grid, and its picture."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from statistics import fmean
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
from exactcreep.solvers.sliding import Sliding
from exactcreep.studies.sweep import SEED, dimensions

MAPPED = 5
"""A sweep over two quantities with at least this many values each is drawn as a map."""
LAW = "law that holds"
"""Legend of `Prediction.values`."""
_SHARED = ("n", "l0", "mu_d", "mu_s", "sigma_mu", "tan_alpha", "amplitude", "sigma_theta")
_UNLIKE = (END_FORCES, EXPANSION)
_FINE = 80  # points along a side of a map at which the law is computed


@dataclass(frozen=True)
class Point:
    """A measured velocity, and the point of the grid at which it was measured.

    `varied`: the dimensions of the grid, without the seed, and their values; `measured`, `error`:
    mean over the seeds and its standard error, unit ``g tau_dyn**2`` per half-cycle (or target);
    `parameters`: the exact chain and drive, by the names of the laws' parameters, and whatever else
    was varied; `cells`: the part of the grid.
    """

    varied: Mapping[str, Any]
    measured: float
    error: float = math.nan
    parameters: dict[str, Any] = field(default_factory=dict)
    cells: Any = None

    def prediction(self, **changed: Any) -> Prediction | None:
        """Return what the laws predict here, or where some parameters differ, or None."""
        given = self.parameters | changed
        about = {key: given[key] for key in (*_SHARED, *_UNLIKE) if key in given}
        if len({*about} & {*_SHARED}) < len(_SHARED) - 1:  # the contacts of a solid vary
            return None
        relaxed = self.varied.get("start", "relaxed") == "relaxed"
        if given.get("solver") == Sliding.name:  # such sliders do not stick
            relaxed, about = False, about | {"mu_s": about["mu_d"], "sigma_mu": 0}
        return prediction_of(about, relaxed=relaxed)


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
        name = "velocity_mean" if SEED in vary else "velocity"
        mean, off = float(here[name]), float(here[f"{name}_error"])
        points.append(Point(varied, mean, off, shared | own, here))
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


def as_lines(vary: Mapping[str, Sequence[Any]]) -> bool:
    """Return whether a grid is drawn as trajectories: no number in it has three values."""
    lengths = (_numbers(list(map(_shown, values))) for key, values in vary.items() if key != SEED)
    return max(lengths, default=0) < 3


@styled
def draw_sweep(dataset: xr.Dataset, title: str = "") -> Figure:
    """Draw the trajectories of a grid if it has them and `as_lines` holds, else velocities."""
    figure = new_figure(6.2, 4.4, title)
    lines = "recorded_x_G" in dataset and as_lines(json.loads(dataset.attrs["vary"]))
    (_draw_trajectories if lines else plot_sweep)(dataset, figure.subplots())
    return figure


def _draw_trajectories(dataset: xr.Dataset, axes: Axes) -> None:
    """Draw x_G of every cell that recorded it, coloured by the first key that varies."""
    vary: Mapping[str, Sequence[Any]] = json.loads(dataset.attrs["vary"])
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
    make families in their own colour. A dotted line is the equation of the paper, a full line the
    law that holds (see `laws.prediction`), in a band as wide as its deviation; the chain's history
    decides between two lines. If exactly two quantities vary, with at least five values each, a map
    shows the velocity in colour, and the law as contours.

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
    values = {key: list(dict.fromkeys(point.varied[key] for point in points))
              for key in points[0].varied}  # fmt: skip
    with mpl.rc_context(STYLE):
        axes = ax or plt.subplots(layout="constrained")[1]
        if len(values) == 2 and min(map(_numbers, values.values())) >= MAPPED:
            _draw_map(axes, points, *values)
        else:
            over = max(values, key=lambda key: (_numbers(values[key]) > 0, len(values[key])))
            draw_families(axes, points, over)
    return axes


def _numbers(values: Sequence[Any]) -> int:
    """Return how many values there are, or 0 if any of them is not a number."""
    return 0 if any(isinstance(value, str) for value in values) else len(values)


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
    law = np.array([[max(one.values, key=abs) if one and one.values else math.nan for one in row]
                    for row in found])  # fmt: skip
    levels = np.asarray(MaxNLocator(8).tick_values(*image.get_clim()))
    inside = levels[(np.nanmin(law, initial=math.inf) < levels)
                    & (levels < np.nanmax(law, initial=-math.inf))]  # fmt: skip
    if inside.size:
        lines = axes.contour(fine_x, fine_y, law, levels=inside, colors="white", linewidths=0.9)
        axes.clabel(lines, fontsize=7, fmt="%g")
        axes.set_title(f"lines: {LAW}", fontsize=8)


def draw_families(axes: Axes, points: Sequence[Point], over: str) -> None:
    """Draw the velocity over one quantity, each value of the others in its own colour."""
    families: dict[str, list[Point]] = {}
    for point in points:
        others = [setting_label(key, value) for key, value in point.varied.items() if key != over]
        families.setdefault(", ".join(others) or "computed", []).append(point)
    marks = itertools.cycle(itertools.product("os^D", INKS))
    fine, drawn = _between([point.varied[over] for point in points]), dict[str, Any]()
    for (label, family), (mark, ink) in zip(families.items(), marks, strict=False):
        places, velocities, errors = zip(
            *((one.varied[over], one.measured, one.error) for one in family), strict=True
        )
        axes.errorbar(
            places, np.ma.masked_invalid(velocities), np.nan_to_num(errors), fmt=mark, color=ink,
            markersize=4, elinewidth=0.7, markerfacecolor="white", label=label, zorder=3,
        )  # fmt: skip
        found = [family[0].prediction(**{over: value}) for value in fine]
        printed = next((f"paper, {law.label}" for law in found if law), "")
        for name, dashes, values in (
            (printed, ":", [law.printed and (fmean(law.printed),) if law else () for law in found]),
            (LAW, "-", [law.values if law else () for law in found]),
        ):
            ends = np.array([(min(v), max(v)) if v else (math.nan,) * 2 for v in values])
            if np.isfinite(ends).any():
                axes.plot(fine, ends, color=ink, linestyle=dashes, linewidth=1.2)
                drawn[name] = dashes
        off = np.nan_to_num([law.deviation if law else 0.0 for law in found])
        axes.fill_between(fine, ends[:, 0] - off, ends[:, 1] + off, color=ink, alpha=0.2)
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
