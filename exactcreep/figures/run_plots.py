"""Pictures of a run for those who sit at a notebook: what `Creep.plot` is."""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

from exactcreep.figures.runs import draw_one
from exactcreep.model.numbers import InputError
from exactcreep.quasistatic.result import Creep
from exactcreep.studies.avalanches import MEASURES, avalanches_of, distribution

_POINTS: dict[str, Any] = {"marker": "o", "markersize": 3, "linewidth": 0.8, "elinewidth": 0.7}


class Plots:
    """The pictures of one run; call it for x_G over time.

    Parameters
    ----------
    result : Creep
    """

    def __init__(self, result: Creep) -> None:
        self._result = result

    def __call__(self, ax: Axes | None = None) -> Axes:
        """Draw x_G, and every slider of a short chain, over time in half-cycles; return the axes.

        Raises
        ------
        InputError
            If the run did not record x_G.
        """
        result = self._result
        if "x_G" not in result.recorded:
            raise InputError("plot", "x_G", 'was not recorded: the run needs record = ["x_G"]')
        axes = ax if ax is not None else _new_axes()
        draw_one(axes, result)
        return axes

    def avalanches(self, measure: str = "size", ax: Axes | None = None, **style: Any) -> Axes:
        """Draw how the avalanches after the burn-in are distributed; return the axes.

        Parameters
        ----------
        measure : {"size", "duration", "energy", "extent"}
            Number of slips; from the first event to the last; dissipated; sliders from the first
            to the last that slips.
        ax : Axes, optional
        **style
            Of the line, as matplotlib's `errorbar` takes it.

        Raises
        ------
        InputError
            If the measure is another, or the run did not record its rearrangements, or has none
            after its burn-in.
        """
        if measure not in MEASURES:
            raise InputError("measure", measure, "must be one of " + ", ".join(MEASURES))
        counted = avalanches_of(self._result)
        if not counted.block.size:
            needed = (
                f"none in a whole cycle after the burn-in of {self._result.burn_in} half-cycles"
            )
            raise InputError("avalanches", 0, needed)
        found = distribution(counted, measure)
        axes = ax if ax is not None else _new_axes()
        kept = found.density > 0
        y, error = found.density[kept], np.nan_to_num(found.error[kept])
        axes.errorbar(found.middle[kept], y, error, **{**_POINTS, **style})
        axes.set(xscale="log", yscale="log", xlabel=MEASURES[measure].label)
        axes.set_ylabel(f"density of {measure}")
        # errors as large as the density itself would reach down to zero
        axes.set_ylim(bottom=min(float(y.min()) / 3, axes.get_ylim()[1]))
        return axes


def _new_axes() -> Axes:
    """Return the axes of a new figure of pyplot, which a notebook shows."""
    _, axes = plt.subplots(layout="constrained")
    return axes
