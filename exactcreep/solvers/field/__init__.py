"""One event loop over three arithmetics: float64, mpmath numbers and balls."""
