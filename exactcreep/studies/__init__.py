"""What people ask: thresholds, fates, comparisons, sweeps and plans."""
