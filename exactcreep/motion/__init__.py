"""Closed forms of a run's motion, and the first event, proved or undecided."""
