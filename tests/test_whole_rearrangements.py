"""Whole rearrangements, held against an independent high-accuracy integration.

The reference (`tests/data/whole_rearrangements.npz`) was made by DOP853 at a relative tolerance of
1e-13 from the equations of motion alone; see `tests/data/make_whole_rearrangements.py`.
"""

from functools import partial

import numpy as np
import pytest
from scipy.optimize import brentq

from exactcreep.model.chain import Chain
from exactcreep.solvers.registry import rearrange
from tests.data.make_whole_rearrangements import Case, coefficients, load, summary, trusted
from tests.oracle.rearrangement import Trajectory, integrate

CASES, REFERENCE = load()


def near_mu_d(case: Case) -> bool:
    """Whether the slope is within 5 % of the one at which the chain runs away."""
    return 0.95 * float(case.friction[0]) <= float(case.tan_alpha) < float(case.friction[0])


def test_the_reference_holds_enough_of_every_kind():
    print(summary(CASES, REFERENCE))
    assert len(CASES) >= 300
    for n in (2, 3, 6, 10, 30):
        assert sum(case.n == n for case in CASES) >= 30
    assert sum(case.label.startswith("burned in") for case in CASES) >= 100
    assert sum(case.label.startswith("random static") for case in CASES) >= 100
    assert sum(len(found.times) > 30 for found in REFERENCE) >= 50
    assert max(found.longest_run for found in REFERENCE) >= 10
    free = [
        case.n
        for case, found in zip(CASES, REFERENCE, strict=True)
        if found.whole_chain and near_mu_d(case)
    ]
    print(f"{len(free)} free-free runs of the whole chain near mu_d, N = {sorted(set(free))}")
    assert len(free) >= 10


def test_the_reference_states_are_at_rest():
    for case in CASES:
        thresholds = np.maximum(case.state.coefficients, float(case.friction[0]))
        force = np.abs(case.state.forces(case.chain))
        assert (force <= thresholds * case.chain.cos_alpha).all(), case.label


def differences(solver: str, **options: object) -> tuple[list[str], np.ndarray]:
    """Return which itineraries differ, and the largest differences of the others.

    Of displacements, tensions, times and l0 theta_c.
    """
    differing = []
    largest = np.zeros(4)
    for case, found in zip(CASES, REFERENCE, strict=True):
        result = rearrange(
            case.chain,
            case.state,
            direction=case.direction,
            seed=case.seed,
            solver=solver,
            **options,
        )
        if list(result.itinerary) != found.itinerary:
            differing.append(case.label)
            continue
        assert (result.state.draws == found.draws).all(), case.label
        off = (
            result.state.displacements.astype(float) - found.displacements,
            result.state.tensions.astype(float) - found.tensions,
            np.array([float(event.time) for event in result.events]) - found.times,
            [1000.0 * float(result.theta) - found.ramp],
        )
        largest = np.maximum(largest, [np.abs(part).max(initial=0.0) for part in off])
    return differing, largest


def test_the_exact_solver_agrees_with_the_independent_integration_to_1e_9():
    differing, largest = differences("exact")
    print("largest differences of displacements, tensions, times, l0 theta_c:", largest)
    assert differing == []
    assert largest[0] < 1e-9
    assert largest[1] < 1e-9
    assert largest[2] < 1e-9
    assert largest[3] < 1e-12


def test_verlet_with_located_events_and_a_small_step_agrees_as_far_as_its_step_allows():
    differing, largest = differences("verlet", dt=1e-3, locate=True)
    print(f"{len(differing)} itineraries differ; largest differences of the others: {largest}")
    assert len(differing) <= 0.03 * len(CASES)
    assert largest[0] < 1e-3
    assert largest[3] < 1e-12


def test_verlet_as_in_the_paper_finds_most_itineraries_with_few_events():
    differing, _ = differences("verlet", dt=1e-2)
    few = [
        case.label for case, found in zip(CASES, REFERENCE, strict=True) if len(found.times) <= 30
    ]
    wrong = sum(label in few for label in differing)
    print(
        f"dt = 0.01: {wrong} of {len(few)} itineraries of at most 30 events are wrong,"
        f" {len(differing) - wrong} of {len(CASES) - len(few)} longer ones"
    )
    assert wrong <= 0.1 * len(few)
    assert len(differing) > 0


def test_the_reference_of_two_sliders_is_the_closed_form():
    """A lone slip from the threshold lasts pi and moves by 2 (mu_s - mu_d) cos(alpha)."""
    lone = 0
    for case, found in zip(CASES, REFERENCE, strict=True):
        if case.n == 2 and len(found.times) == 2:
            lone += 1
            slider = found.itinerary[0][1][0] - 1
            mu_d = float(case.friction[0])
            jump = 2 * (case.state.coefficients[slider] - mu_d) * case.chain.cos_alpha
            assert found.times[1] == pytest.approx(np.pi, rel=0, abs=1e-11)
            assert abs(found.displacements[slider]) == pytest.approx(jump, rel=0, abs=1e-12)
            assert found.displacements[1 - slider] == 0.0
    assert lone >= 10


def test_the_integration_of_two_sliders_together_is_the_closed_form():
    """Slider 2 starts slider 1; from then on tension and mean velocity are elementary."""
    chain = Chain(2, 1000, "0.5", "0.6", "0.03", tan_alpha="0.49")
    weight, friction, draws = chain.sin_alpha, chain.friction, np.array([1, 1])
    together = 0
    for seed in range(60):
        first, second = coefficients(chain, seed, draws) * chain.cos_alpha
        # the tension is s - second at the start and grows by x_2 = D (1 - cos t) until slider 1
        # starts, where it is first - s
        excess, way = second - friction, first + second - 2 * weight
        if not 0 < way < 1.99 * excess:
            continue
        together += 1
        start = np.arccos(1 - way / excess)
        speed = excess * np.sin(start)

        def velocities(t, first=first, speed=speed):
            mean = speed / 2 + (weight - friction) * t
            tension_rate = speed * np.cos(np.sqrt(2) * t) - np.sqrt(2) * (first - weight) * np.sin(
                np.sqrt(2) * t
            )
            return mean - tension_rate / 2, mean + tension_rate / 2

        stops = []
        for slider in (0, 1):
            times = np.linspace(1e-6, 8, 200_000)
            below = np.flatnonzero(velocities(times)[slider] < 0)
            if below.size:
                k = below[0]
                speed_of = partial(lambda of, at, t: of(t)[at], velocities, slider)
                root = brentq(speed_of, times[k - 1], times[k], xtol=1e-14)
                stops.append((root, slider + 1))
        stop, who = min(stops)
        found = integrate(chain, np.zeros(1), draws, 1, seed)
        assert found.itinerary[:3] == [
            ("start", (2,), (1,)),
            ("start", (1,), (1,)),
            ("stop", (who,), (1,)),
        ]
        assert found.times[1] == pytest.approx(start, rel=0, abs=1e-10)
        assert found.times[2] == pytest.approx(start + stop, rel=0, abs=1e-10)
    assert together >= 5


@pytest.mark.parametrize("turn", range(3))
def test_a_random_subset_of_the_reference_is_what_the_integration_gives_now(turn: int):
    rng = np.random.default_rng([2026, turn])
    short = [k for k, found in enumerate(REFERENCE) if len(found.times) <= 12]
    long = [k for k, found in enumerate(REFERENCE) if 12 < len(found.times) <= 40]
    for k in [*rng.choice(short, 6, replace=False), *rng.choice(long, 2, replace=False)]:
        assert_reproduced(CASES[k], REFERENCE[k])


def assert_reproduced(case: Case, found: Trajectory) -> None:
    again = integrate(case.chain, case.tensions, case.draws, case.direction, case.seed)
    assert again.itinerary == found.itinerary, case.label
    assert np.abs(again.displacements - found.displacements).max() < 1e-11, case.label
    assert np.abs(np.subtract(again.times, found.times)).max() < 1e-10, case.label
    assert (again.draws == found.draws).all()
    assert again.whole_chain == found.whole_chain
    assert again.longest_run == found.longest_run


@pytest.mark.slow
def test_the_whole_reference_is_what_the_integration_gives_now():
    for case, found in zip(CASES, REFERENCE, strict=True):
        assert_reproduced(case, found)
        trusted(case)
