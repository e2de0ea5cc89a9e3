"""Random scenes over many orders of magnitude: no surprise, and every promise kept."""

import warnings
from fractions import Fraction

import numpy as np
import pytest

from exactcreep import Chain, Cycles, GaussianSteps, Outcome, Path, creep
from exactcreep.model.drive import Drive
from exactcreep.quasistatic.creep import PhysicsWarning


def scene(number: int) -> tuple[Chain, Drive]:
    """Return the random scene of that number; it may not run away."""
    generator = np.random.default_rng([11, number])

    def decimal(value: float) -> Fraction:
        return Fraction(f"{value:.{generator.integers(1, 17)}g}")

    n = int(generator.choice([1, 2, 3, 4, 5, 6, 7, 10, 17, 30]))
    mu_d = decimal(generator.choice([1e-3, 0.3, 0.5, 2.0]))
    gap = decimal(generator.choice([1e-3, 0.1, 0.1, 0.1, 1.0]))
    slope = mu_d * decimal(generator.choice([0, 1e-12, 0.5, *generator.uniform(-0.9, 0.9, 3)]))
    l0 = 10 ** generator.uniform(-6, 6)
    size = generator.choice([0, *10 ** generator.uniform(-3, 1, 5)]) * n * float(mu_d + gap) / l0
    chain = Chain(
        n,
        decimal(l0),
        mu_d,
        mu_d + gap,
        decimal(generator.choice([0, 0, 1e-9, 0.01, 0.1])),
        tan_alpha=slope,
    )
    drives = (
        Cycles(decimal(size), 5),
        GaussianSteps(decimal(size), 10),
        Path([decimal(size * u) for u in generator.uniform(-1, 1, 6)]),
    )
    return chain, drives[generator.integers(3)]


def check(numbers: range) -> None:
    for number in numbers:
        chain, drive = scene(number)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PhysicsWarning)
            result = creep(chain, drive, seed=number, max_events=20_000)
        told = f"scene {number}: {chain}, {drive}: {result.outcome}"
        assert result.outcome is not Outcome.RUNAWAY, told
        finished = result.outcome is not Outcome.LIMIT
        assert finished == (result.half_cycles == drive.half_cycles), told
        assert not finished or result.slip_count >= result.rearrangements, told
        if finished:
            acting = np.maximum(result.state.coefficients.astype(float), float(chain.mu_d))
            forces = abs(result.state.forces(chain))
            assert (forces <= acting * chain.cos_alpha * (1 + 1e-9)).all(), told
            assert result.state.theta == pytest.approx(
                float(drive.exact_target(drive.half_cycles, number)), rel=1e-15, abs=0
            ), told
        if finished and not result.slip_count:
            assert result.outcome is Outcome.AT_REST, told
            assert result.x_G == 0, told


def test_random_scenes_end_at_rest_within_their_friction() -> None:
    check(range(150))


@pytest.mark.slow
def test_ten_thousand_random_scenes_end_at_rest_within_their_friction() -> None:
    check(range(150, 10_000))
