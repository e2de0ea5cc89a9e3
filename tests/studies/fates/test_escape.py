"""The escape rate of mixtures of an early and a late phase whose rates are known."""

import math
import re
from typing import NamedTuple

import numpy as np
import pytest

from exactcreep.studies.fates.escape import Rate, escape_rate


class Mixture(NamedTuple):
    """Starts, late mean life and horizon in cycles, share and mean life of early arrests."""

    starts: int
    life: int
    horizon: int
    share: float
    scale: float

    def drawn(self, random: np.random.Generator, horizon: int | None = None) -> Rate:
        scales = np.where(random.random(self.starts) < self.share, self.scale, self.life)
        lives = random.geometric(-np.expm1(-1 / scales))
        seen = lives <= (end := horizon or self.horizon)
        return escape_rate(lives[seen], np.full((~seen).sum(), end))


REFUSED = Mixture(60, 1000, 100, 0.3, 20)
"""Its horizon is five early scales."""


MIXTURES = [
    Mixture(100, 1000, 100, 0.5, 5), Mixture(200, 1000, 2000, 0.4, 200),
    Mixture(60, 1000, 2000, 0.3, 10), Mixture(200, 40, 120, 0.2, 16.2),
]  # fmt: skip


def held(mixture: Mixture, samples: int) -> tuple[int, int]:
    """Return of how many samples an interval is told, and how many of these hold the late rate."""
    random = np.random.default_rng([int(1000 * number) for number in mixture])
    rates = [mixture.drawn(random) for _ in range(samples)]
    told = [rate for rate in rates if not math.isnan(rate.low)]
    assert all(rate.reason for rate in rates if math.isnan(rate.low))
    true = -math.expm1(-1 / mixture.life)
    return len(told), sum(rate.low <= true <= rate.high for rate in told)


@pytest.mark.parametrize("mixture", MIXTURES)
def test_intervals_hold_the_late_rate(mixture: Mixture) -> None:
    told, holds = held(mixture, 40)
    assert told >= 25
    assert holds >= 0.85 * told


def test_a_horizon_of_five_early_scales_is_refused_with_one_that_would_do() -> None:
    random = np.random.default_rng(1)
    rates = [REFUSED.drawn(random) for _ in range(40)]
    refused = [rate for rate in rates if rate.reason]
    assert len(refused) > 30
    helps = 0
    for rate in refused:
        assert np.isnan(rate[:3]).all()
        said = r"no rate yet: \d+ of 60 starts stopped; try --cycles (\d+)"
        named = int(re.fullmatch(said, rate.reason)[1])
        helps += REFUSED.drawn(random, named).reason == ""
    assert helps >= 0.8 * len(refused)


"""Lives of a constant rate, equally spaced in probability."""


@pytest.mark.parametrize(
    ("lives", "said"),
    [
        ([0, 0], "no rate: all 2 starts stopped by cycle 0; try a larger --amplitude"),
        ([0, 1, 1], "no rate: all 3 starts stopped by cycle 1; try a larger --amplitude"),
        ([40, 120, 200, 310, 440, 620, 900, 1500], "8 of 8 starts stopped; try --starts 32"),
        (np.random.default_rng(3).integers(9000, 11_000, 200), "do not stop at a constant rate"),
    ],
)
def test_lives_without_a_rate_have_no_interval_but_a_reason(lives: list[int], said: str) -> None:
    found = escape_rate(lives)
    assert np.isnan(found[:3]).all()
    assert said in found.reason
