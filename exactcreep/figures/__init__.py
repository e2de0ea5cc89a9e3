"""Pictures of runs, sweeps, comparisons and thresholds, and the tables behind them."""

from exactcreep.model.drawn import DRAWN

DRAWN.update(
    Creep=f"{__name__}.run:Plots",
    Rearrangement=f"{__name__}.run:plot_rearrangement",
    Fate=f"{__name__}.fate:draw_fate",
    Survival=f"{__name__}.fate:draw_survival",
    Threshold=f"{__name__}.threshold:draw_threshold",
    Walk=f"{__name__}.walk:draw_walk",
)
