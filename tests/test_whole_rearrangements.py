"""Whole rearrangements, held against an independent high-accuracy integration.

The reference (`tests/data/whole_rearrangements.npz`) was made by DOP853 at a relative tolerance of
1e-13 from the equations of motion alone; see `tests/data/make_whole_rearrangements.py`.
"""

import numpy as np
import pytest

from exactcreep.solvers.registry import rearrange
from tests.data.make_whole_rearrangements import Case, load, trusted
from tests.oracle.rearrangement import Trajectory, integrate

CASES, REFERENCE = load()
PAIRS = list(zip(CASES, REFERENCE, strict=True))


def test_the_exact_solver_agrees_with_the_independent_integration_to_1e_9():
    assert len(CASES) >= 300
    largest = np.zeros(4)
    for case, found in PAIRS:
        result = rearrange(case.chain, case.state, direction=case.direction, seed=case.seed)
        assert list(result.itinerary) == found.itinerary, case.label
        assert (result.state.draws == found.draws).all(), case.label
        off = (
            result.state.displacements - found.displacements,
            result.state.tensions - found.tensions,
            np.array([event.time for event in result.events]) - found.times,
            [1000.0 * result.theta - found.ramp],
        )
        largest = np.maximum(largest, [np.abs(part).max(initial=0.0) for part in off])
    assert (largest < [1e-9, 1e-9, 1e-9, 1e-12]).all()


def test_the_reference_of_two_sliders_is_the_closed_form():
    """A lone slip from the threshold lasts pi and moves by 2 (mu_s - mu_d) cos(alpha)."""
    lone = [(case, found) for case, found in PAIRS if case.n == 2 and len(found.times) == 2]
    assert len(lone) >= 10
    for case, found in lone:
        slider = found.itinerary[0][1][0] - 1
        jump = 2 * (case.state.coefficients[slider] - float(case.chain.mu_d)) * case.chain.cos_alpha
        assert found.times[1] == pytest.approx(np.pi, rel=0, abs=1e-11)
        assert abs(found.displacements[slider]) == pytest.approx(jump, rel=0, abs=1e-12)
        assert found.displacements[1 - slider] == 0.0


def assert_reproduced(case: Case, found: Trajectory) -> None:
    again = integrate(case.chain, case.tensions, case.draws, case.direction, case.seed)
    assert again.itinerary == found.itinerary, case.label
    assert np.abs(again.displacements - found.displacements).max() < 1e-11, case.label
    assert np.abs(np.subtract(again.times, found.times)).max() < 1e-10, case.label
    assert (again.draws == found.draws).all()


def test_a_random_subset_of_the_reference_is_what_the_integration_gives_now():
    rng = np.random.default_rng(2026)
    short = [pair for pair in PAIRS if len(pair[1].times) <= 12]
    long = [pair for pair in PAIRS if 12 < len(pair[1].times) <= 40]
    for pairs, count in ((short, 9), (long, 3)):
        for k in rng.choice(len(pairs), count, replace=False):
            assert_reproduced(*pairs[k])


@pytest.mark.slow
def test_the_whole_reference_is_what_the_integration_gives_now():
    for case, found in PAIRS:
        assert_reproduced(case, found)
        trusted(case)
