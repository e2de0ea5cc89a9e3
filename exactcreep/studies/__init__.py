"""What people ask: thresholds, fates, comparisons and sweeps."""
