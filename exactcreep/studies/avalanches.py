"""Distributions of avalanches (rearrangements): of size, duration, energy, or any column.

Avalanches in the same half-cycle are not independent, so standard errors come from blocks of whole
cycles or targets.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.numbers import InputError
from exactcreep.quasistatic.creep_result import Creep
from exactcreep.quasistatic.statistics import ratio_of_sums
from exactcreep.solvers.tables import ENERGY, NUMBER, REARRANGEMENT_TABLE, TIME

Floats = NDArray[np.float64]
BLOCKS = 16
PER_DECADE, EQUAL = 8, 24
"""Number of bins per decade of a logarithmic scale, and in all on a linear scale."""


class Measure(NamedTuple):
    """A quantity of an avalanche: its label and unit, whether it is a whole number, its scale."""

    label: str
    unit: str
    whole: bool
    scale: str = "log"


_OWN = {
    "size": Measure("size $S$ (slips)", NUMBER, True),
    "duration": Measure("duration $T$", TIME, False),
    "energy": Measure("energy dissipated $E$", ENERGY, False),
    "extent": Measure("extent $L$ (sliders from first to last)", NUMBER, True),
}
_COLUMNS = {"size": "slips", "energy": "dissipation"}
"""Columns of the table whose names differ from the measure's."""
_PLACED = {
    "half_cycle", "theta", "direction", "began_first", "began_last", "first", "last",
    "displacement", "gravity", "end_forces",
}  # fmt: skip
"""Columns with a linear scale: positions, and values that may be negative."""
MEASURES = _OWN | {
    name: Measure(
        name.replace("_", " "),
        column.unit,
        column.dtype.startswith("int"),
        "linear" if name in _PLACED else "log",
    )
    for name, column in REARRANGEMENT_TABLE.fields.items()
    if name not in (*_OWN, *_COLUMNS.values())
}
MEASURES |= {column: MEASURES[name] for name, column in _COLUMNS.items()}
"""All measures of an avalanche by name: four quantities, and every column of the table."""


class Avalanches(NamedTuple):
    """The avalanches of a run: the block of each (of `blocks`), and `MEASURES` by name."""

    block: NDArray[np.int64]
    blocks: int
    values: dict[str, Floats]


class Distribution(NamedTuple):
    """A density with its standard error, by bins.

    Bins are equally wide on the measure's scale. `middle` is the middle of a bin on this scale, or
    of the whole numbers in it, which `width` then counts; `zeros` are left out of a log scale.
    """

    middle: Floats
    width: Floats
    density: Floats
    error: Floats
    zeros: int


def avalanches_of(result: Creep, measures: Iterable[str] = _OWN) -> Avalanches:
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
        return recorded[f"rearrangement_{_COLUMNS.get(name, name)}"][kept]

    values = {
        name: (column("last") - column("first") + 1 if name == "extent" else column(name))
        for name in measures
    }
    floats = {name: each.astype(float) for name, each in values.items()}
    return Avalanches(passed[kept] * blocks // max(1, periods), blocks, floats)


def edges_of(measure: str, low: float, high: float) -> Floats:
    """Return edges of bins, equally spaced on the measure's scale; for whole numbers at k + 1/2."""
    _, _, whole, scale = MEASURES[measure]
    if scale == "linear":
        apart = 1.0 if whole or low == high else 0.0
        edges = np.linspace(low, high + apart, EQUAL + 1)
    else:
        first, last = (math.log10(value) * PER_DECADE for value in (low, high))
        edges = 10.0 ** (np.arange(math.floor(first), math.ceil(last) + 2) / PER_DECADE)
    return np.unique(np.ceil(edges)) - 0.5 if whole else edges


def distribution(found: Avalanches, measure: str, edges: Floats | None = None) -> Distribution:
    """Return the distribution of one of `MEASURES`, with errors from ratios of sums over blocks."""
    values, logarithmic = found.values[measure], MEASURES[measure].scale == "log"
    counted = (values > 0) | (not logarithmic)
    held = values[counted]
    if edges is None:
        edges = edges_of(measure, held.min(), held.max()) if held.size else np.array([0.5, 1.5])
    bins = [np.arange(found.blocks + 1) - 0.5, edges]
    counts, _, _ = np.histogram2d(found.block[counted], held, bins)
    share, error = ratio_of_sums(counts, counts.sum(axis=1, keepdims=True))
    width = np.diff(edges)
    inside = 0.5 if MEASURES[measure].whole else 0.0
    first, last = edges[:-1] + inside, edges[1:] - inside
    middle = np.sqrt(first * last) if logarithmic else (first + last) / 2
    zeros = int(values.size - held.size)
    return Distribution(middle, width, share / width, error / width, zeros)
