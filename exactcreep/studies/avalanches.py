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
from numpy.typing import NDArray

from exactcreep.laws import law_values, threshold_amplitude
from exactcreep.model.numbers import InputError
from exactcreep.quasistatic.creep import run_members
from exactcreep.quasistatic.result import Creep
from exactcreep.scene import load_scene

Floats = NDArray[np.float64]
BLOCKS = 16
PER_DECADE = 8
SCENE = "chain-avalanches"
"""The scene whose chain is made longer, and driven by more."""


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
            scene = load_scene(SCENE).with_settings({"chain.n": n, "drive.cycles": cycles[j]})
            (star,) = law_values(threshold_amplitude, scene.experiment().chain.parameters())
            (run,) = run_members([scene.experiment({"drive.amplitude": ratio * star})])
            found[k, j] = avalanches_of(run)
            say(len(found), len(sizes) * len(ratios), "runs")
    edges = {}
    for measure in MEASURES:
        every = np.concatenate([one.values[measure] for one in found.values()])
        edges[measure] = edges_of(measure, every[every > 0].min(), every.max())
    rows = [
        xr.concat([_densities(found[k, j], edges) for j in range(len(sizes))], "n")
        for k in range(len(ratios))
    ]
    whole = xr.concat(rows, "ratio").assign_coords(ratio=list(ratios), n=list(sizes))
    whole = whole.reset_coords([f"{measure}_width" for measure in MEASURES])
    return whole.assign_attrs(cycles=list(cycles), blocks=BLOCKS)


def _densities(found: Avalanches, edges: dict[str, Floats]) -> xr.Dataset:
    """Return the part of `study` that is known of one chain."""
    coordinates: dict[str, Any] = {}
    values: dict[str, Any] = {"avalanches": found.block.size}
    for measure, bins in edges.items():
        part = distribution(found, measure, bins)
        coordinates |= {measure: part.middle, f"{measure}_width": (measure, part.width)}
        values |= {f"{measure}_density": (measure, part.density),
                   f"{measure}_error": (measure, part.error)}  # fmt: skip
        values[f"{measure}_cut_off"], values[f"{measure}_cut_off_error"] = cut_off(found, measure)
    mean, error = mean_duration(found, edges["size"])
    values |= {"mean_duration": ("size", mean), "mean_duration_error": ("size", error)}
    return xr.Dataset(values, coordinates)


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
