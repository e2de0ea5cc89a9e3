"""The solver "verlet": its lone slip, its order of convergence, and steps that are too large."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from exactcreep import Cycles, Outcome, State, creep, rearrange
from exactcreep.solvers.rearrangement import Rearrangement
from tests.data.whole_rearrangements import load
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
    orders = []
    enough = [pair for pair in zip(*load(), strict=True) if len(pair[1].times) >= 4]
    for case, found in enough[::5]:
        known = {"direction": case.direction, "seed": case.seed, "locate": locate}
        steps, errors = [], []
        for dt in LADDER:
            result = rearrange(case.chain, case.state, solver="verlet", dt=dt, **known)
            if list(result.itinerary) == found.itinerary:
                steps.append(dt)
                errors.append(np.abs(result.state.displacements - found.displacements).max())
        if len(steps) >= 4 and min(errors) > 1e-12:
            orders.append(np.polyfit(np.log(steps), np.log(errors), 1)[0])
    assert len(orders) >= 40
    assert np.median(orders) == pytest.approx(order, abs=0.1)
