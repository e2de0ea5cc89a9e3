"""Pictures of runs, sweeps, comparisons and thresholds, and the tables behind them."""
