"""The picture of each kind of result, which `Result.plot` returns."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial, singledispatch
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from exactcreep.figures.fate import draw_fate, draw_survival
from exactcreep.figures.pipeline import draw_walk
from exactcreep.figures.run import Plots, plot_rearrangement
from exactcreep.figures.threshold import draw_threshold
from exactcreep.model.result import Result
from exactcreep.pipeline import Walk
from exactcreep.quasistatic.creep_result import Creep
from exactcreep.solvers.rearrangement import Rearrangement
from exactcreep.studies.fates.fate_result import Fate
from exactcreep.studies.fates.survival import Survival
from exactcreep.studies.thresholds.intercept import Intercept
from exactcreep.studies.thresholds.threshold import Threshold


@singledispatch
def plots_of(result: Result) -> Callable[..., Any]:
    """Return the function that draws a result; raise `AttributeError` if there is none."""
    raise AttributeError(f"{type(result).__name__} has no picture")


@plots_of.register
def _(run: Creep) -> Plots:
    return Plots(run)


@plots_of.register
def _(motion: Rearrangement) -> Callable[[], tuple[Axes, Axes]]:
    return partial(plot_rearrangement, motion)


@plots_of.register
def _(fate: Fate) -> Callable[[], Figure]:
    return partial(draw_fate, fate)


@plots_of.register
def _(survival: Survival) -> Callable[[], Figure]:
    return partial(draw_survival, survival)


@plots_of.register
def _(answer: Threshold | Intercept) -> Callable[[], Figure]:
    return partial(draw_threshold, answer)


@plots_of.register
def _(walk: Walk) -> Callable[[], Figure]:
    return partial(draw_walk, walk)
