"""Distributions of avalanches (rearrangements): their size, duration, energy and extent.

They are counted from the table `rearrangements` of a run, after its burn-in, in blocks of whole
cycles (of targets, for other drives), whose scatter tells the errors: avalanches of one half-cycle
are not independent.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.numbers import InputError
from exactcreep.quasistatic.creep_result import Creep

Floats = NDArray[np.float64]
BLOCKS = 16
PER_DECADE = 8


class Measure(NamedTuple):
    """A quantity of an avalanche: its label on an axis, and whether it is a whole number."""

    label: str
    whole: bool


MEASURES = {
    "size": Measure("size $S$ (slips)", True),
    "duration": Measure(r"duration $T$ ($\tau_\mathrm{dyn}$)", False),
    "energy": Measure(r"energy dissipated $E$ ($m g^2 \tau_\mathrm{dyn}^2$)", False),
    "extent": Measure("extent $L$ (sliders from first to last)", True),
}


class Avalanches(NamedTuple):
    """The avalanches of a run: in which of the `blocks` each lies, and its `MEASURES` by name."""

    block: NDArray[np.int64]
    blocks: int
    values: dict[str, Floats]


class Distribution(NamedTuple):
    """A log-binned density with its standard error, by bins.

    `middle` are geometric middles, of whole numbers between the first and the last in a bin;
    `width` of whole numbers is how many a bin holds.
    """

    middle: Floats
    width: Floats
    density: Floats
    error: Floats


def avalanches_of(result: Creep) -> Avalanches:
    """Return the avalanches of a run after its burn-in; `InputError` if it recorded none."""
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


def edges_of(measure: str, low: float, high: float) -> Floats:
    """Return the edges of bins, equal on a logarithmic scale; of whole numbers halfway between."""
    first, last = (math.log10(value) * PER_DECADE for value in (low, high))
    edges = 10.0 ** (np.arange(math.floor(first), math.ceil(last) + 2) / PER_DECADE)
    return np.unique(np.ceil(edges)) - 0.5 if MEASURES[measure].whole else edges


def distribution(found: Avalanches, measure: str, edges: Floats | None = None) -> Distribution:
    """Return how one of `MEASURES` is distributed; zero values (of no slip at all) are left out.

    The error is that of a ratio of sums over blocks, to first order in their scatter; nan for one.
    """
    positive = found.values[measure] > 0
    held = found.values[measure][positive]
    if edges is None:
        edges = edges_of(measure, held.min(), held.max()) if held.size else np.array([0.5, 1.5])
    bins = [np.arange(found.blocks + 1) - 0.5, edges]
    counts, _, _ = np.histogram2d(found.block[positive], held, bins)
    whole = counts.sum(axis=1, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        share = counts.sum(axis=0) / whole.sum()
        apart = ((counts - share * whole) ** 2).sum(axis=0)
        several = np.float64(found.blocks) / (found.blocks - 1) if found.blocks > 1 else math.nan
        error = np.sqrt(several * apart) / whole.sum()
    width = np.diff(edges)
    inside = 0.5 if MEASURES[measure].whole else 0.0
    middle = np.sqrt((edges[:-1] + inside) * (edges[1:] - inside))
    return Distribution(middle, width, share / width, error / width)
