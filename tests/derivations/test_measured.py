"""What the ledger calls measured, measured again: numbers that go in and come out are its own."""

from __future__ import annotations

import re
from fractions import Fraction

import numpy as np
import pytest

from derivations.ledger import entries
from exactcreep import Chain, Cycles, creep, laws

NAMED = {entry.name: entry for entry in entries()}
THERE = "tests/derivations/test_measured.py"


def numbers(name: str) -> list[str]:
    """Return the numbers of a measured statement, in their order."""
    return re.findall(r"\d*\.?\d+", NAMED[name].measured or "")


def velocity(n: str, mu_d: str, mu_s: str, sigma: str, slope: str, size: str, cycles: int) -> float:
    chain = Chain(int(n), 1000, mu_d, mu_s, sigma, tan_alpha=slope)
    return float(creep(chain, Cycles(size, cycles), seed=1, record=()).velocity)


def step(chain: Chain, size: str) -> float:
    """Return ``l0 A - N m/2``, of which velocities of plateaus are multiples."""
    margin = float(chain.mu_d) * chain.cos_alpha - chain.sin_alpha
    return float(float(chain.l0) * float(size) - chain.n * margin / 2)


def test_each_measured_statement_is_measured_here() -> None:
    measured = {entry.name for entry in entries() if entry.measured}
    assert measured == {
        "divergence", "critical_angle", "seuil", "vitesse_seuil", "excellent_agreement",
        "insensitive_to_disorder", "level_chains",
    }  # fmt: skip
    assert {NAMED[name].by for name in measured} == {THERE}


def test_two_sliders_next_to_mu_d_creep_no_faster_without_disorder() -> None:
    size, *rest = numbers("divergence")
    slopes, (clean, *without), (sigma, *with_it) = rest[:3], _cut(rest[3:7]), _cut(rest[7:])
    for sigma_mu, cycles, stated in ((clean, 20, without), (sigma, 1500, with_it)):
        for slope, value in zip(slopes, stated, strict=True):
            found = velocity("2", ".5", ".6", sigma_mu, slope, size, cycles)
            assert found == pytest.approx(float(value), rel=0.001 if sigma_mu == "0" else 0.03)


def _cut(part: list[str]) -> list[str]:
    """Return the last of some numbers, sigma_mu, before the others."""
    return [part[-1], *part[:-1]]


def test_three_sliders_next_to_an_edge_lock_unless_there_is_disorder() -> None:
    n, low, high, sigma, slope, size, rest, law = numbers("vitesse_seuil")
    assert velocity(n, low, high, sigma, slope, size, 40) == float(rest)
    chain = Chain(int(n), 1000, low, high, sigma, tan_alpha=slope)
    (found,) = laws.law_values(
        laws.sliding_velocity, chain.parameters() | {"amplitude": Fraction(size)}
    )
    assert found == pytest.approx(float(law), abs=0.005)
    n, low, high, slope, size, rest, clean, creeps, sigma = numbers("insensitive_to_disorder")
    assert velocity(n, low, high, clean, slope, size, 40) == float(rest)
    found = velocity(n, low, high, sigma, slope, size, 400)
    assert found == pytest.approx(float(creeps), rel=0.02)


@pytest.mark.parametrize(
    ("name", "cycles", "within"), [("excellent_agreement", 150, 0.01), ("level_chains", 400, 0.02)]
)
def test_mean_velocities_are_a_share_of_the_plateau(name: str, cycles: int, within: float) -> None:
    """Of all its steps inside a plateau, and of one step in level chains, which have none."""
    n, low, high, sigma, size, *rest = numbers(name)
    for share, slope in zip(rest[::2], rest[1::2], strict=True):
        chain = Chain(int(n), 1000, low, high, sigma, tan_alpha=slope)
        plateau = step(chain, size)
        if name == "excellent_agreement":
            plateau *= chain.n + 3 - 2 * laws.pivot(chain.n, chain.tan_alpha, chain.mu_d)
        found = velocity(n, low, high, sigma, slope, size, cycles) / plateau
        assert found == pytest.approx(float(share), abs=within)


@pytest.mark.parametrize(
    "place",
    [0, 1, pytest.param(2, marks=pytest.mark.slow), pytest.param(3, marks=pytest.mark.slow)],
)
def test_the_step_and_the_phases_are_alike_in_chains_of_any_length(place: int) -> None:
    stated = numbers("critical_angle")
    (low, high, _, sigma, size), by_length = stated[:5], stated[15:]
    n, i, printed, share, slope, spread = (by_length[4 * k + place] for k in range(6))
    angle = laws.critical_angle(n=int(n), i=int(i), mu_d=float(low), mu_s=float(high))
    assert angle == pytest.approx(float(printed), abs=0.0005)
    slopes = f"{angle:.5f}", slope
    chain = Chain(int(n), 1000, low, high, sigma, tan_alpha=slopes[0])
    above = velocity(n, low, high, sigma, slopes[0], size, 60) / step(chain, size)
    below = int(n) + 3 - 2 * (int(i) + 1)
    assert (above - below) / 2 == pytest.approx(float(share), abs=0.03)
    chain = Chain(int(n), 1000, low, high, sigma, tan_alpha=slope)
    pivot = laws.pivot(int(n), Fraction(slope), Fraction(low)) - 1
    phases = np.delete(phases_after_dilations(chain, size, 900 // int(n)), pivot - 1, axis=1)
    assert phases.std() == pytest.approx(float(spread), abs=0.03)


def phases_after_dilations(chain: Chain, size: str, cycles: int) -> np.ndarray:
    """Return by how much sliders miss sliding friction, in units of D, after each dilation."""
    run = creep(chain, Cycles(size, cycles + 10), seed=1, record=("tension",))
    tensions = np.asarray(run.recorded["tension"])[20::2]
    forces = np.diff(tensions, prepend=0.0, append=0.0) + chain.sin_alpha
    return (np.abs(forces) - float(chain.mu_d) * chain.cos_alpha) / chain.excess
