"""The solver "verlet": its lone slip, its order of convergence, and steps that are too large."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from exactcreep import Cycles, Outcome, State, creep, rearrange
from exactcreep.model.outcome import Evidence
from exactcreep.solvers.rearrangement import Rearrangement
from tests.paper import paper_chain

LADDER = [0.02 / 2**k for k in range(6)]


def first(chain: Any, **options: Any) -> Rearrangement:
    """Return the rearrangement that follows a dilation of the relaxed chain."""
    return rearrange(chain, State.relaxed(chain), direction=1, solver="verlet", **options)


@pytest.mark.parametrize("dt", [1.5, 3.0, 1e5])
def test_an_unstable_time_step_ends_in_a_limit_with_a_reason(dt: float) -> None:
    chain = paper_chain(6)
    run = creep(chain, Cycles("0.01", 3), solver="verlet", dt=dt, seed=3)
    assert run.outcome is Outcome.LIMIT
    assert "dt" in run.reason
    assert first(chain, dt=dt).outcome in (Outcome.LIMIT, Outcome.AT_REST)


@pytest.mark.parametrize(("locate", "order"), [(False, 1.0), (True, 2.0)])
def test_verlet_is_of_first_order_across_events_and_of_second_if_it_locates_them(
    locate: bool, order: float
) -> None:
    rng, errors = np.random.default_rng(1), []
    for seed in range(100):
        chain = paper_chain(3 + seed % 8)
        start = State.prepared(chain, rng.uniform(-0.7, 0.7, chain.n - 1), seed=seed)
        truth, *stepped = (
            rearrange(chain, start, direction=0, seed=seed, **options)
            for options in (
                {"solver": "certified"},
                *({"solver": "verlet", "dt": dt, "locate": locate} for dt in LADDER),
            )
        )
        if len(truth.events) >= 4 and {found.itinerary for found in stepped} == {truth.itinerary}:
            places = truth.state.displacements.astype(float)
            errors.append([abs(found.state.displacements - places).max() for found in stepped])
    assert len(errors) >= 60
    mean = np.log(np.mean(errors, axis=0))
    assert np.polyfit(np.log(LADDER), mean, 1)[0] == pytest.approx(order, abs=0.05)


def test_verlet_judges_nothing_even_where_nothing_moves() -> None:
    for amplitude in ("0.002", "0.0001"):
        run = creep(paper_chain(6), Cycles(amplitude, 10), solver="verlet", seed=1)
        assert run.evidence is run.outcome_evidence is Evidence.UNDECIDED
        assert run.known_until == 0
    assert run.event_count == 0
    assert first(paper_chain(6)).evidence is Evidence.UNDECIDED
