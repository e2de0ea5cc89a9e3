"""The solver "verlet": its lone slip, its order of convergence, and steps that are too large."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from exactcreep import Cycles, Outcome, State, creep, laws, rearrange
from exactcreep.solvers.rearrangement import Rearrangement
from tests.data.whole_rearrangements import load
from tests.paper import captions, lone_slip, paper_chain

LADDER = [0.02 / 2**k for k in range(6)]


def first(chain: Any, **options: Any) -> Rearrangement:
    """Return the rearrangement that follows a dilation of the relaxed chain."""
    return rearrange(chain, State.relaxed(chain), direction=1, solver="verlet", **options)


@pytest.mark.parametrize("n", [2, 3])
def test_a_lone_slip_of_an_end_slider_moves_by_2_d_in_the_time_pi(n: int) -> None:
    chain = captions(n)
    result = first(chain, locate=True, dt="0.001")
    assert result.itinerary == lone_slip(n)
    assert result.events[1].time == pytest.approx(math.pi, rel=0, abs=1e-6)
    moved = result.state.displacements
    assert moved[-1] == pytest.approx(2 * chain.excess, rel=0, abs=1e-13)
    assert (moved[:-1] == 0).all()
    theta = (0.6 * chain.cos_alpha - chain.sin_alpha) / 1000
    assert result.theta == pytest.approx(theta, rel=1e-14)
    late = first(chain, dt="0.01")  # ends at the first step beyond the stop
    assert late.events[1].time == pytest.approx(3.15, rel=0, abs=1e-12)
    assert 0 < late.replay().residuals()[1] < 0.01 * 2 * chain.excess


@pytest.mark.parametrize("dt", [1.5, 3.0, 1e5])
def test_an_unstable_time_step_ends_in_a_limit_with_a_reason(dt: float) -> None:
    chain = paper_chain(6)
    run = creep(chain, Cycles("0.01", 3), solver="verlet", dt=dt, seed=3)
    assert run.outcome is Outcome.LIMIT
    assert "dt" in run.reason
    assert first(chain, dt=dt).outcome in (Outcome.LIMIT, Outcome.AT_REST)


def test_the_velocity_of_six_sliders_is_the_papers_within_three_per_cent() -> None:
    run = creep(paper_chain(6), Cycles("0.01", 60), solver="verlet", seed=3, record=("x_G",))
    measured = (run.recorded["x_G"][119] - run.recorded["x_G"][19]) / 100
    predicted = laws.creep_velocity(n=6, l0=1000, mu_d=0.5, tan_alpha=0.25, amplitude=0.01)
    assert measured == pytest.approx(predicted, rel=0.03)


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
