"""Avalanches: how their size, duration, energy and extent are distributed, and where that ends.

An avalanche is a rearrangement. Everything is counted from the table `rearrangements` of a run,
after its burn-in. The run is cut into blocks of whole cycles (of targets, for other drives), which
tell the errors: avalanches of one half-cycle are not independent.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from exactcreep.figures.departures import critical_amplitude
from exactcreep.figures.drawing import Data
from exactcreep.figures.style import INKS, picture
from exactcreep.figures.tables import Row, Table
from exactcreep.model.numbers import InputError
from exactcreep.quasistatic.creep import run_members
from exactcreep.quasistatic.result import Creep
from exactcreep.scene import load_scene

Floats = NDArray[np.float64]
BLOCKS = 16
PER_DECADE = 8
_SCENE = "chain-avalanches"


class Measure(NamedTuple):
    """A quantity of an avalanche.

    Attributes
    ----------
    label : str
        Of an axis.
    whole : bool
        Whether it is a whole number.
    """

    label: str
    whole: bool


MEASURES = {
    "size": Measure("size $S$ (slips)", True),
    "duration": Measure(r"duration $T$ ($\tau_\mathrm{dyn}$)", False),
    "energy": Measure(r"energy dissipated $E$ ($m g^2 \tau_\mathrm{dyn}^2$)", False),
    "extent": Measure("extent $L$ (sliders from first to last)", True),
}


class Avalanches(NamedTuple):
    """The avalanches of a run after its burn-in.

    Attributes
    ----------
    block : ndarray of int
        In which of the `blocks` each lies.
    blocks : int
    values : dict of str to ndarray
        The numbers of each of `MEASURES`.
    """

    block: NDArray[np.int64]
    blocks: int
    values: dict[str, Floats]


class Distribution(NamedTuple):
    """A log-binned density.

    Attributes
    ----------
    middle : ndarray
        Geometric middles of the bins, or of the first and the last whole number in them.
    width : ndarray
        Of the bins; of whole numbers, how many they hold.
    density, error : ndarray
        Share of the avalanches in a bin, divided by its width, and the standard error.
    """

    middle: Floats
    width: Floats
    density: Floats
    error: Floats


def avalanches_of(result: Creep) -> Avalanches:
    """Return the avalanches of a run after its burn-in.

    Raises
    ------
    InputError
        If the run did not record them.
    """
    recorded = result.recorded
    if "rearrangement_slips" not in recorded:
        needed = 'needs a run with record = ["rearrangements"]'
        raise InputError("avalanches", "not recorded", needed)
    period = 2 if result.drive.cyclic else 1
    periods = (result.half_cycles - result.burn_in) // period
    blocks = max(1, min(BLOCKS, periods))
    passed = (recorded["rearrangement_half_cycle"] - result.burn_in - 1) // period
    kept = (passed >= 0) & (passed < periods)
    columns = {
        "size": recorded["rearrangement_slips"],
        "duration": recorded["rearrangement_duration"],
        "energy": recorded["rearrangement_dissipation"],
        "extent": recorded["rearrangement_last"] - recorded["rearrangement_first"] + 1,
    }
    values = {name: column[kept].astype(float) for name, column in columns.items()}
    return Avalanches(passed[kept] * blocks // max(1, periods), blocks, values)


def ratio_of_sums(above: Floats, below: Floats) -> tuple[Floats, Floats]:
    """Return sum(above)/sum(below) over blocks, the first axis, and its standard error.

    The error is that of the ratio to first order in the scatter of the blocks; nan for one block.
    """
    count = len(below)
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = above.sum(axis=0) / below.sum(axis=0)
        apart = ((above - ratio * below) ** 2).sum(axis=0)
        error = np.sqrt(count / (count - 1) * apart) if count > 1 else np.full_like(ratio, np.nan)
        return ratio, error / np.abs(below.sum(axis=0))


def edges_of(measure: str, low: float, high: float) -> Floats:
    """Return the edges of bins, equal on a logarithmic scale, that hold what lies from low to high.

    Those of whole numbers lie halfway between two of them.
    """
    first, last = (math.log10(value) * PER_DECADE for value in (low, high))
    steps = np.arange(math.floor(first), math.ceil(last) + 2)
    edges = 10.0 ** (steps / PER_DECADE)
    return np.unique(np.ceil(edges)) - 0.5 if MEASURES[measure].whole else edges


def distribution(found: Avalanches, measure: str, edges: Floats | None = None) -> Distribution:
    """Return how one of `MEASURES` is distributed; zero values (of no slip at all) are left out."""
    values = found.values[measure]
    positive = values > 0
    held = values[positive]
    if edges is None:
        edges = edges_of(measure, held.min(), held.max()) if held.size else np.array([0.5, 1.5])
    blocks = np.arange(found.blocks + 1)
    counts, _, _ = np.histogram2d(found.block[positive], held, [blocks - 0.5, edges])
    share, error = ratio_of_sums(counts, counts.sum(axis=1, keepdims=True))
    width = np.diff(edges)
    inside = 0.5 if MEASURES[measure].whole else 0.0
    middle = np.sqrt((edges[:-1] + inside) * (edges[1:] - inside))
    return Distribution(middle, width, share / width, error / width)


def cut_off(found: Avalanches, measure: str) -> tuple[float, float]:
    """Return <s^2>/<s> of one of `MEASURES` and its standard error.

    Where s has a power law of exponent between 1 and 2 up to a cut-off, this is proportional to it.
    """
    values = found.values[measure]
    sums = [
        np.bincount(found.block, values**power, minlength=found.blocks).astype(float)
        for power in (2, 1)
    ]
    value, error = ratio_of_sums(*sums)
    return float(value), float(error)


def mean_duration(found: Avalanches, edges: Floats) -> tuple[Floats, Floats]:
    """Return the mean duration of the avalanches whose size lies in a bin, and its error."""
    where = found.block, found.values["size"]
    bins = [np.arange(found.blocks + 1) - 0.5, edges]
    counts, _, _ = np.histogram2d(*where, bins)
    lasted, _, _ = np.histogram2d(*where, bins, weights=found.values["duration"])
    return ratio_of_sums(lasted, counts)


def draw_distribution(axes: Axes, found: Distribution, measure: str, **style: Any) -> None:
    """Draw a density with its errors on logarithmic axes."""
    kept = found.density > 0
    error = np.nan_to_num(found.error[kept])
    axes.errorbar(found.middle[kept], found.density[kept], error, **{**_POINTS, **style})
    axes.set(xscale="log", yscale="log", xlabel=MEASURES[measure].label)
    axes.set_ylabel(f"density of {measure}")
    # errors as large as the density itself would reach down to zero
    drawn = [np.asarray(line.get_ydata()) for line in axes.lines]
    lowest = min((float(y.min()) for y in drawn if y.size), default=1.0)
    axes.set_ylim(bottom=lowest / 3)


_POINTS: dict[str, Any] = {
    "marker": "o", "markersize": 3, "linewidth": 0.8, "elinewidth": 0.7, "markeredgewidth": 0.8,
}  # fmt: skip

# --- the study -----------------------------------------------------------------------------------


def study(
    *,
    sizes: Sequence[int],
    ratios: Sequence[float],
    cycles: Sequence[int],
    say: Callable[..., None],
) -> xr.Dataset:
    """Return the distributions of avalanches in chains of several lengths near and above A*.

    Parameters
    ----------
    sizes : sequence of int
        Of the chain of the scene chain-avalanches.
    ratios : sequence of float
        Amplitudes in units of A* of Eq. (seuil).
    cycles : sequence of int
        Of the chain of each size.
    say : callable
        Told how many runs are done.

    Returns
    -------
    Dataset
        Dimensions ``ratio``, ``n``, and the bins of each of `MEASURES`: densities, mean duration
        over size, and the cut-offs <s^2>/<s>, each with its standard error.
    """
    found: dict[tuple[int, int], Avalanches] = {}
    for j, n in enumerate(sizes):
        for k, ratio in enumerate(ratios):
            scene = load_scene(_SCENE).with_settings({"chain.n": n, "drive.cycles": cycles[j]})
            star = critical_amplitude(scene.experiment().chain.parameters())
            (run,) = run_members([scene.experiment({"drive.amplitude": ratio * star})])
            found[k, j] = avalanches_of(run)
            say(len(found), len(sizes) * len(ratios), "runs")
    shape = (len(ratios), len(sizes))
    values: dict[str, Any] = {}
    coordinates: dict[str, Any] = {"ratio": list(ratios), "n": list(sizes)}
    counts = np.array([[found[k, j].block.size for j in range(shape[1])] for k in range(shape[0])])
    values["avalanches"] = (("ratio", "n"), counts)
    for measure in MEASURES:
        every = np.concatenate([one.values[measure] for one in found.values()])
        every = every[every > 0]
        edges = edges_of(measure, every.min(), every.max())
        parts = {place: distribution(one, measure, edges) for place, one in found.items()}
        middle, width = parts[0, 0].middle, parts[0, 0].width
        coordinates[measure] = middle
        values[f"{measure}_width"] = (measure, width)
        stacks = {name: np.empty((*shape, middle.size)) for name in ("density", "error")}
        ends = np.empty((2, *shape))
        for place, part in parts.items():
            stacks["density"][place], stacks["error"][place] = part.density, part.error
            ends[:, *place] = cut_off(found[place], measure)
        for name, stack in stacks.items():
            values[f"{measure}_{name}"] = (("ratio", "n", measure), stack)
        values[f"{measure}_cut_off"] = (("ratio", "n"), ends[0])
        values[f"{measure}_cut_off_error"] = (("ratio", "n"), ends[1])
        if measure == "size":
            means = np.empty((2, *shape, middle.size))
            for place, one in found.items():
                means[:, *place] = mean_duration(one, edges)
            values["mean_duration"] = (("ratio", "n", "size"), means[0])
            values["mean_duration_error"] = (("ratio", "n", "size"), means[1])
    return xr.Dataset(values, coordinates, {"cycles": list(cycles), "blocks": BLOCKS})


def growth(sizes: Sequence[float], values: Floats, errors: Floats) -> tuple[float, float, float]:
    """Return the exponent b of values ~ sizes^b, its standard error, and chi^2 per degree.

    The error is that of the fit, wider by the square root of chi^2 per degree of freedom where the
    points lie further from the line than their errors; chi^2 is nan for two points.
    """
    x, y = np.log(sizes), np.log(values)
    weights = (values / errors) ** 2
    middle = np.average(x, weights=weights)
    spread = float((weights * (x - middle) ** 2).sum())
    slope = float((weights * (x - middle) * y).sum()) / spread
    left = y - np.average(y, weights=weights) - slope * (x - middle)
    degrees = len(x) - 2
    beyond = float((weights * left**2).sum()) / degrees if degrees else math.nan
    return slope, math.sqrt((beyond if beyond > 1 else 1.0) / spread), beyond


def tables(data: Data) -> list[Table]:
    """Return the cut-off of every measure, and the exponent with which it grows with N."""
    dataset = data[_SCENE]
    sizes, ratios = (dataset[name].to_numpy().tolist() for name in ("n", "ratio"))
    ends, exponents = [], []
    for measure in MEASURES:
        for ratio in ratios:
            here = dataset.sel(ratio=ratio)
            value, error = (
                here[f"{measure}_cut_off{suffix}"].to_numpy() for suffix in ("", "_error")
            )
            varied = {"measure": measure, "A/A*": ratio}
            ends += [
                Row(
                    {**varied, "n": n},
                    float(value[k]),
                    float(error[k]),
                    (),
                    (),
                    f"{count} avalanches",
                )
                for k, (n, count) in enumerate(
                    zip(sizes, here["avalanches"].to_numpy().tolist(), strict=True)
                )
            ]
            slope, spread, beyond = growth(sizes, value, error)
            bent = "bends away from a power of N by more than the errors, which are wider for it"
            exponents.append(Row(varied, slope, spread, (), (), bent if beyond > 4 else ""))
    return [
        Table(_SCENE, "Cut-off <s^2>/<s> of avalanches", "-", "", tuple(ends)),
        Table(f"{_SCENE}-growth", "Exponent b of cut-off ~ N^b", "-", "", tuple(exponents)),
    ]


def draw(data: Data, tables: list[Table]) -> Figure:
    """Draw the distributions, mean duration over size, and the cut-offs over N."""
    dataset = data[_SCENE]
    sizes, ratios = (dataset[name].to_numpy().tolist() for name in ("n", "ratio"))
    figure = picture(8.4, 9.6)
    panels = figure.subplots(3, 2).ravel()
    for axes, measure in zip(panels, MEASURES, strict=False):
        for j, n in enumerate(sizes):
            for k, ratio in enumerate(ratios):
                here = dataset.sel(n=n, ratio=ratio)
                found = Distribution(
                    here[measure].to_numpy(),
                    here[f"{measure}_width"].to_numpy(),
                    here[f"{measure}_density"].to_numpy(),
                    here[f"{measure}_error"].to_numpy(),
                )
                label = f"N = {n}, {ratio:g} $A^*$"
                draw_distribution(axes, found, measure, **_style(j, k), label=label)
    panels[0].legend(loc="lower left")
    for j, n in enumerate(sizes):
        for k, ratio in enumerate(ratios):
            here = dataset.sel(n=n, ratio=ratio)
            mean, error = here["mean_duration"].to_numpy(), here["mean_duration_error"].to_numpy()
            panels[4].errorbar(here["size"], mean, np.nan_to_num(error), **_style(j, k))
    panels[4].set(xscale="log", yscale="log", xlabel=MEASURES["size"].label)
    panels[4].set_ylabel(r"mean duration ($\tau_\mathrm{dyn}$)")
    exponents = iter(tables[1].rows)
    for number, measure in enumerate(MEASURES):
        for k, ratio in enumerate(ratios):
            here = dataset.sel(ratio=ratio)
            label = f"{measure}, {ratio:g} $A^*$: $N^{{{next(exponents).measured:.2f}}}$"
            ends = [here[f"{measure}_cut_off{end}"].to_numpy() for end in ("", "_error")]
            style = _style(number + 3, k)
            panels[5].errorbar(sizes, ends[0], np.nan_to_num(ends[1]), **style, label=label)
    panels[5].set(xscale="log", yscale="log", xlabel="number of sliders $N$")
    panels[5].set_ylabel(r"cut-off $\langle s^2\rangle/\langle s\rangle$ (each in its unit)")
    panels[5].legend(loc="upper left", fontsize=6.5)
    panels[5].set_xticks(sizes, [str(n) for n in sizes], minor=False)
    panels[5].set_xticks([], minor=True)
    panels[5].set_ylim(top=100 * float(max(dataset[f"{name}_cut_off"].max() for name in MEASURES)))
    return figure


def _style(ink: int, ratio: int) -> dict[str, Any]:
    """Return the style of a line: inks tell the first quantity apart, full points the ratio."""
    color = INKS[ink % len(INKS)]
    filled = {"markerfacecolor": "white", "linestyle": "-"} if ratio == 0 else {"linestyle": ":"}
    return {**_POINTS, "color": color, **filled}
