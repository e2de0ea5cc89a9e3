"""Another integrator, which knows nothing of ours, makes the same events."""

from __future__ import annotations

from exactcreep.studies.comparison import table
from tests.benchmarks.run import contest


def test_an_integrator_that_knows_nothing_of_us_makes_the_certified_events() -> None:
    """Driven by code written independently, SciPy takes the same turns to the same places."""
    rows = table(contest(6, seeds=1, events=30))
    for name, row in rows.iterrows():
        if not str(name).startswith("verlet"):
            assert row.parted == 0, name
            assert row.error < 1e-6, name
    assert rows.error["exact"] < 1e-12 < rows.error["scipy, rtol = 1e-09"]
