"""Whole rearrangements, held against an independent high-accuracy integration.

The reference (`tests/data/whole_rearrangements.npz`) was made from the equations of motion
alone, by SciPy's DOP853. The power series of `tests/oracle/rearrangement.py` reproduce it.
"""

import numpy as np
import pytest

from exactcreep.solvers.registry import rearrange
from tests.data.whole_rearrangements import Case, load
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


def assert_reproduced(case: Case, found: Trajectory) -> None:
    again = integrate(case.chain, case.tensions, case.draws, case.direction, case.seed)
    assert again.itinerary == found.itinerary, case.label
    assert np.abs(again.displacements - found.displacements).max() < 1e-11, case.label
    assert np.abs(np.subtract(again.times, found.times)).max() < 1e-10, case.label
    assert (again.draws == found.draws).all()


def test_a_random_subset_of_the_reference_is_what_the_integration_gives_now():
    rng = np.random.default_rng(2026)
    short = [pair for pair in PAIRS if len(pair[1].times) <= 12]
    long = [pair for pair in PAIRS if 12 < len(pair[1].times) <= 40 and pair[0].n <= 10]
    for pairs, count in ((short, 6), (long, 1)):
        for k in rng.choice(len(pairs), count, replace=False):
            assert_reproduced(*pairs[k])


@pytest.mark.slow
def test_the_whole_reference_is_what_the_integration_gives_now():
    for case, found in PAIRS:
        assert_reproduced(case, found)
