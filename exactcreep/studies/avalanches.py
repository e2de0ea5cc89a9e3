"""Distributions of avalanches (rearrangements): of their size, duration, energy or extent.

Avalanches in the same half-cycle are not independent, so standard errors come from blocks of whole
cycles or targets.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.numbers import InputError
from exactcreep.quasistatic.creep_result import Creep
from exactcreep.quasistatic.statistics import ratio_of_sums

Floats = NDArray[np.float64]
BLOCKS = 16
_PER_DECADE = 8  # bins
MEASURES = {
    "size": "size $S$ (slips)",
    "duration": r"duration $T$ ($\tau_\mathrm{dyn}$)",
    "energy": r"energy dissipated $E$ ($m\,g^2\tau_\mathrm{dyn}^2$)",
    "extent": "extent $L$ (sliders from first to last)",
}
"""The quantities of an avalanche, with their labels; sizes and extents are whole numbers."""
_COLUMNS = {"size": "slips", "energy": "dissipation", "duration": "duration"}
"""Columns of the table of rearrangements."""


class Avalanches(NamedTuple):
    """One of `MEASURES` of each avalanche of a run, and its block (of `blocks`)."""

    block: NDArray[np.int64]
    blocks: int
    values: Floats


class Distribution(NamedTuple):
    """A density with its standard error, by bins that are equally wide on a logarithmic scale.

    `middle` is the middle of a bin on this scale, or of the whole numbers in it, which `width` then
    counts; `zeros` are left out.
    """

    middle: Floats
    width: Floats
    density: Floats
    error: Floats
    zeros: int


def avalanches_of(result: Creep, measure: str) -> Avalanches:
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

    def column(name: str) -> NDArray[Any]:
        return recorded[f"rearrangement_{name}"][kept]

    if measure == "extent":
        values = column("last") - column("first") + 1
    else:
        values = column(_COLUMNS[measure])
    return Avalanches(passed[kept] * blocks // max(1, periods), blocks, values.astype(float))


def edges_of(low: float, high: float, *, whole: bool) -> Floats:
    """Return edges of bins, equally spaced on a logarithmic scale; for whole numbers at k + 1/2."""
    first, last = (math.log10(value) * _PER_DECADE for value in (low, high))
    edges = 10.0 ** (np.arange(math.floor(first), math.ceil(last) + 2) / _PER_DECADE)
    return np.unique(np.ceil(edges)) - 0.5 if whole else edges


def distribution(found: Avalanches, measure: str, edges: Floats | None = None) -> Distribution:
    """Return the distribution of a measure, with errors from ratios of sums over blocks."""
    counted, whole = found.values > 0, measure in ("size", "extent")
    held = found.values[counted]
    if edges is None:
        ends = (held.min(), held.max()) if held.size else (1.0, 1.0)
        edges = edges_of(*ends, whole=whole)
    bins = [np.arange(found.blocks + 1) - 0.5, edges]
    counts, _, _ = np.histogram2d(found.block[counted], held, bins)
    share, error = ratio_of_sums(counts, counts.sum(axis=1, keepdims=True))
    width, inside = np.diff(edges), 0.5 * whole
    middle = np.sqrt((edges[:-1] + inside) * (edges[1:] - inside))
    return Distribution(middle, width, share / width, error / width, int((~counted).sum()))
