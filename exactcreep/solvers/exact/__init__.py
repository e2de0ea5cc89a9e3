"""The solver called "exact": float64, compiled, from event to event."""
