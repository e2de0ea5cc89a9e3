"""Closed forms of a run's motion, and the search for the first event, proved or undecided."""
