"""What people ask: thresholds, fates, comparisons, sweeps, plans and audits."""
