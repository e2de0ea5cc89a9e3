"""The laws of a level pair against a direct integral, a plain loop over draws, and runs."""

from __future__ import annotations

import math
from typing import Any

import mpmath
import numpy as np
import pytest

from exactcreep import Chain, Cycles, Drive, GaussianSteps, Targets, creep
from exactcreep.laws import level, level_displacement, level_increment


def pair(mu_d: str = "0.5", mu_s: str = "0.6", sigma_mu: str = "0.01", **other: Any) -> Chain:
    return Chain(2, 1000, mu_d, mu_s, sigma_mu, **({"tan_alpha": 0} | other))


def integrated(begin: int, end: int) -> mpmath.mpf:
    """Return the mean square between two half-cycles by the double integral of (S/S')**2."""
    total = mpmath.mpf(0)
    for k in range(begin + 1, end + 1):
        low, high = max(2 * k - 3, 0), 2 * k - 1
        total += mpmath.quad(lambda s: mpmath.quad(lambda u: (u / s) ** 2, [low, s]), [low, high])  # noqa: B023
        later = mpmath.quad(lambda s: s**-2, [low, high]) if low else 0
        for j in range(begin + 1, k):
            ends = [max(2 * j - 3, 0), 2 * j - 1]
            total += (-1) ** (j + k) * later * mpmath.quad(lambda u: u**2, ends)
    return total / 2


def test_cycles_follow_the_double_integral_over_the_path_to_1e_9() -> None:
    drive = Cycles("0.005", 1)
    for t in (10, 11, 16):
        expected = 4.5**2 * float(integrated(0, t))
        assert level_displacement(pair(), drive, t) == pytest.approx(expected, rel=1e-12)
    for t, tau in ((10, 1), (10, 2), (13, 4)):
        expected = 4.5**2 * float(integrated(t, t + tau))
        assert level_increment(pair(), drive, t, tau) == pytest.approx(expected, rel=1e-11)


@pytest.mark.parametrize(("t", "tau"), [(495, 3), (510, 2), (10**7, 10**6), (10**7, 10**6 + 1)])
def test_increments_of_cycles_keep_their_digits_at_a_great_age(t: int, tau: int) -> None:
    p = mpmath.mpf(2 * t - 1)
    if short := tau < 10:  # the sum over half-cycles
        ends = [(p + 2 * i - 2, p + 2 * i) for i in range(1, tau + 1)]
        apart = mpmath.fsum((1 / low + 1 / high) / 3 for low, high in ends)
        back = mpmath.fsum(
            (-1) ** i * (1 / low - 1 / high) for i, (low, high) in enumerate(ends, 1)
        )
        expected = float(apart - (p**2 - mpmath.mpf(2) / 3) * back / 2)
    else:
        expected = math.log1p(tau / t) / 3 + (1 - (-1) ** tau * (t / (t + tau)) ** 2) / 2
    found = level_increment(pair(), Cycles("0.005", 1), t, tau) / 4.5**2
    assert found == pytest.approx(expected, rel=1e-9 if short else 1e-6)


@pytest.mark.parametrize(
    ("h", "rate", "constant"),
    [(0.0, 5 / 6, -0.70424), (0.1, 0.7828, -0.75422), (0.25, 0.7132, -0.82074),
     (0.5, 0.6120, -0.91195)],
)  # fmt: skip
def test_gaussian_steps_have_the_rate_and_the_constant_of_the_integral(
    h: float, rate: float, constant: float
) -> None:
    """The constants agree with 5e6 paths of 200 targets each to .0004, extrapolated in 1/t."""
    v, c = level.growth(h)
    assert v == pytest.approx(rate, abs=5e-5)
    assert c == pytest.approx(constant, abs=3e-5)


def test_increments_of_gaussian_steps_forget_the_place_of_the_spring_within_a_few_targets() -> None:
    random, h = np.random.default_rng(5), 0.5
    before = y = np.zeros(100_000)
    for _ in range(40):
        z = random.standard_normal(y.size)
        before, y = y, np.clip(y, z - h, z + h)
    variance, later = level.covariance(h, 0), level.covariance(h, 1)
    assert variance == pytest.approx(y.var(), abs=0.01)
    assert later == pytest.approx((before * y).mean(), abs=0.01)
    chain, drive = pair("1", "1.05"), GaussianSteps("0.002", 1)  # l0 sigma_theta = 2, h = 1/2
    near, far = level_increment(chain, drive, 10**7, np.array([1, 200])) / 4
    assert near == pytest.approx((variance - later) / 2, rel=1e-5)
    assert far == pytest.approx(variance / 2, rel=1e-4)


@pytest.mark.parametrize(
    ("chain", "drive", "t", "said"),
    [
        (Chain(3, 1000, "0.5", "0.6", "0.01", tan_alpha=0), Cycles("0.005", 1), 10, "n = 3"),
        (pair(tan_alpha="0.1"), Cycles("0.005", 1), 10, "no slope"),
        (pair(end_forces=("0.1", "-0.1")), Cycles("0.005", 1), 10, "no end forces"),
        (pair(sigma_mu="0"), Cycles("0.005", 1), 10, "sigma_mu > 0"),
        (pair(), Targets(["0.1"]), 10, "Cycles or GaussianSteps"),
        (pair(), Cycles("0.0019", 1), 10, "amplitude = '0.0019': must be at least 0.002"),
        (pair("2", "3"), GaussianSteps("0.0025", 1), 10, "must be at least 0.003"),
        (pair(), Cycles("0.005", 1), 9, "t = 9: must hold whole numbers from 10 on"),
        (pair(), Cycles("0.005", 1), np.array([10.0, math.nan]), "whole numbers from 10 on"),
    ],
)  # fmt: skip
def test_the_law_is_refused_outside_its_range(
    chain: Chain, drive: Drive, t: Any, said: str
) -> None:
    for law, more in ((level_displacement, ()), (level_increment, (5,))):
        with pytest.raises(ValueError, match=said) as refused:
            law(chain, drive, t, *more)
        assert "\n" not in str(refused.value)


def seeds_at(chain: Chain, drive: Drive, targets: list[int], seeds: int) -> np.ndarray:
    """Return x_G of runs at these targets, shape (seeds, targets)."""
    runs = (creep(chain, drive, seed=seed).recorded["x_G"] for seed in range(seeds))
    return np.array([[run[t - 1] for t in targets] for run in runs])


def sigmas(squares: np.ndarray, law: Any) -> Any:
    return (squares.mean(axis=0) - law) / (squares.std(axis=0, ddof=1) / math.sqrt(len(squares)))


@pytest.mark.parametrize(
    ("chain", "make"),
    [(pair(), lambda steps: Cycles("0.005", steps // 2)),
     (pair(), lambda steps: GaussianSteps("0.005", steps)),
     (pair("0.3", "0.5", "0.03"), lambda steps: Cycles("0.003", steps // 2))],
)  # fmt: skip
@pytest.mark.parametrize(
    ("seeds", "targets"),
    [
        (200, [50, 190, 200]),
        pytest.param(1000, [200, 10_000, 11_000, 20_000], marks=pytest.mark.slow),
    ],
)
def test_runs_follow_the_law_within_three_standard_errors(
    chain: Chain, make: Any, seeds: int, targets: list[int]
) -> None:
    drive = make(targets[-1])
    places = seeds_at(chain, drive, targets, seeds)
    law = level_displacement(chain, drive, targets)
    assert (abs(sigmas(places**2, law)) < 3).all()
    *_, begin, end = targets[:3]
    law = level_increment(chain, drive, begin, end - begin)
    assert abs(sigmas((places[:, 2] - places[:, 1]) ** 2, law)) < 3
