"""What people ask: thresholds, comparisons, sweeps, figures."""
