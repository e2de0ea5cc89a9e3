"""The escape rate of mixtures of an early and a late phase whose rates are known."""

import math

import numpy as np
import pytest

from exactcreep import InputError
from exactcreep.studies.fates.escape import Rate, escape_rate

LIFE = 1000
"""Late mean life of most mixtures, in cycles."""
MIXTURES = {  # starts, late mean life, horizon, early share, early scale
    "short horizon": (100, LIFE, 100, 0.5, 5),
    "horizon of six early scales": (200, LIFE, 300, 0.5, 50),
    "horizon of five early scales": (60, LIFE, 100, 0.3, 20),
    "early scale a fifth": (200, LIFE, 2000, 0.4, 200),
    "two cycles": (200, 2, 20, 0.0, 1),
    "no early phase": (200, 500, 2000, 0.0, 3),
    "few early": (200, 500, 2000, 0.375, 3),
}
APART = {
    f"{starts} starts, {share} early, {scale}": (starts, LIFE, 2 * LIFE, share, scale)
    for starts in (60, 100, 200)
    for share, scale in ((0.3, 10), (0.6, 10), (0.3, 50), (0.6, 50))
} | {
    "mean life of ten": (100, 10, 20, 0.4, 1.5 / 3),
    "most are early": (200, LIFE, 2 * LIFE, 0.8, 20),
}
"""A horizon of two late mean lives, and an early scale of a twentieth of one or less."""
OWN = APART | {
    "four lives": (150, LIFE, 4 * LIFE, 0.4, 100),
    "four lives, early scale a fifth": (150, LIFE, 4 * LIFE, 0.3, 200),
    "half a life": (60, LIFE, LIFE // 2, 0.5, 10),
    "one life": (100, LIFE, LIFE, 0.5, 50),
    "twenty starts": (20, LIFE, 2 * LIFE, 0.3, 20),
    "lives of twenty cycles": (100, 20, 100, 0.4, 2),
}


FRESH = {  # drawn once, before any of them was looked at
    f"{life} cycles, {starts} starts, {share} early, {scale}": (starts, life, horizon, share, scale)
    for starts, life, horizon, share, scale in (
        (300, 100, 200, 0.09, 1.0),
        (40, 1290, 2580, 0.39, 17.7),
        (40, 2300, 4600, 0.06, 101.9),
        (40, 430, 860, 0.46, 17.9),
        (50, 340, 680, 0.69, 1.3),
        (200, 3330, 6660, 0.14, 13.3),
        (60, 930, 1860, 0.68, 37.1),
        (80, 50, 100, 0.7, 0.5),
        (100, 90, 180, 0.4, 0.4),
        (60, 30, 60, 0.68, 0.7),
        (200, 40, 120, 0.2, 16.2),
        (100, 2950, 14_750, 0.4, 878.0),
        (50, 4220, 8440, 0.16, 555.5),
        (150, 1060, 530, 0.23, 99.9),
        (60, 40, 40, 0.19, 4.6),
        (80, 2360, 2360, 0.59, 138.2),
        (300, 120, 60, 0.39, 16.6),
        (60, 1780, 3560, 0.43, 205.1),
        (200, 90, 270, 0.7, 8.3),
        (200, 2980, 2980, 0.69, 1343.7),
    )
}
"""The first ten have a horizon of two late mean lives, and early scales of at most a twentieth."""


def drawn(name: str, count: int) -> list[Rate]:
    """Return the rates told of so many samples of a mixture; the same in every call."""
    starts, life, horizon, share, scale = (MIXTURES | OWN | FRESH)[name]
    random = np.random.default_rng(list(name.encode()))
    told = []
    for _ in range(count):
        scales = np.where(random.random(starts) < share, scale, life)
        lives = random.geometric(-np.expm1(-1 / scales))
        seen = lives <= horizon
        told.append(escape_rate(lives[seen], np.full((~seen).sum(), horizon)))
    return told


def held(name: str, rates: list[Rate]) -> tuple[int, int]:
    """Return of how many samples an interval is told, and how many of these hold the late rate."""
    true = -math.expm1(-1 / (MIXTURES | OWN | FRESH)[name][1])
    told = [rate for rate in rates if not math.isnan(rate.low)]
    assert all(rate.reason for rate in rates if math.isnan(rate.low))
    return len(told), sum(rate.low <= true <= rate.high for rate in told)


@pytest.mark.slow
@pytest.mark.parametrize("name", MIXTURES | OWN)
def test_intervals_hold_the_late_rate_of_90_to_99_percent_wherever_they_are_told(name: str) -> None:
    told, holds = held(name, drawn(name, 400))
    if told >= 20:
        assert 0.9 <= holds / told <= 0.99
    if name in APART:
        assert told >= 360


MISSED = {
    "2300 cycles, 40 starts, 0.06 early, 101.9": "told of 55 % of the samples only",
    "120 cycles, 300 starts, 0.39 early, 16.6": "told of 6 %, and 74 % of these hold it",
    "2980 cycles, 200 starts, 0.69 early, 1343.7": "told of 40 %, and 85 % of these hold it",
}


@pytest.mark.slow
@pytest.mark.parametrize("name", FRESH)
def test_intervals_hold_the_late_rate_of_mixtures_that_were_fixed_beforehand(name: str) -> None:
    told, holds = held(name, drawn(name, 400))
    enough = told >= 360 or name not in [*FRESH][:10]
    kept = told < 20 or holds >= 0.9 * told
    assert (enough and kept) == (name not in MISSED), (told, holds)


@pytest.mark.parametrize(
    "name", ["short horizon", "early scale a fifth", "60 starts, 0.3 early, 10"]
)
def test_intervals_hold_the_late_rate(name: str) -> None:
    told, holds = held(name, drawn(name, 40))
    assert told >= 25
    assert holds >= 0.85 * told


def test_a_horizon_of_five_early_scales_is_refused_with_one_that_would_do() -> None:
    rates = drawn("horizon of five early scales", 40)
    refused = [rate for rate in rates if rate.reason]
    assert len(refused) > 30
    random, helps = np.random.default_rng(1), 0
    for rate in refused:
        assert np.isnan(rate[:3]).all()
        assert "lives up to a horizon of 100 cycles do not tell late arrests" in rate.reason
        horizon = int(rate.reason.removesuffix(" would do").split()[-1])
        scales = np.where(random.random(60) < 0.3, 20, LIFE)
        lives = random.geometric(-np.expm1(-1 / scales))
        seen = lives <= horizon
        helps += escape_rate(lives[seen], np.full((~seen).sum(), horizon)).reason == ""
    assert helps >= 0.8 * len(refused)


def test_lifetimes_without_a_constant_rate_have_no_interval_but_a_sentence() -> None:
    random = np.random.default_rng(3)
    found = escape_rate(random.integers(9000, 11_000, 200))
    assert found.exponential < 0.01
    assert np.isnan(found[:3]).all()
    assert "do not come at a constant rate" in found.reason


def test_the_cut_leaves_no_early_start() -> None:
    late = [math.ceil(-LIFE * math.log(1 - (k + 0.5) / 70)) for k in range(70)]
    found = escape_rate([1, 2, 3] * 10 + late)
    assert 5 < found.cut < 100
    assert 30 <= found.before < 40
    assert found.low < 1 / LIFE < found.high < 1.5 / LIFE


def test_a_longer_horizon_is_not_named_where_all_are_arrested() -> None:
    found = escape_rate([40, 120, 200, 310, 440, 620, 900, 1500])
    assert "the lives of 8 starts, all arrested" in found.reason
    assert found.reason.endswith("32 starts would do")


def test_starts_that_never_advanced_tell_nothing_of_the_rate_but_are_counted() -> None:
    late = [math.ceil(-LIFE * math.log(1 - (k + 0.5) / 70)) for k in range(70)]
    alone, more = escape_rate(late), escape_rate([0] * 9 + late)
    assert more[:4] == alone[:4]
    assert more.before == alone.before + 9


@pytest.mark.parametrize("lives", [[0, 0], [1], [0, 1, 1]])
def test_lives_of_one_cycle_at_most_are_refused(lives: list[int]) -> None:
    reason = escape_rate(lives).reason
    assert reason == f"no rate: every start was arrested up to cycle {max(lives)}"


def test_without_an_arrest_the_interval_begins_at_zero() -> None:
    found = escape_rate([], [1000, 2000])
    assert found[:2] == (0, 0)
    assert (1 - found.high) ** 3000 == pytest.approx(0.025)


@pytest.mark.parametrize("cycles", [-1, 1.5, math.nan])
def test_lives_that_are_no_whole_cycles_are_refused(cycles: float) -> None:
    with pytest.raises(InputError, match=r"lifetimes = .*: must be whole numbers of cycles"):
        escape_rate([3, cycles])
