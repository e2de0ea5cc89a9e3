"""The picture of each kind of result, which `Result.plot` returns."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

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
from exactcreep.studies.thresholds.threshold_result import Threshold

_DRAWN: dict[type[Result], Callable[[Any], Any]] = {
    Rearrangement: plot_rearrangement,
    Fate: draw_fate,
    Survival: draw_survival,
    Threshold: draw_threshold,
    Walk: draw_walk,
}


def plots_of(result: Result) -> Callable[..., Any]:
    """Return the function that draws a result; raise `AttributeError` if there is none."""
    if isinstance(result, Creep):
        return Plots(result)
    for kind, draw in _DRAWN.items():
        if isinstance(result, kind):
            return partial(draw, result)
    raise AttributeError(f"{type(result).__name__} has no picture")
