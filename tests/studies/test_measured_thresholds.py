"""Thresholds that are measured: the intercept of v(A), and where half of the starts live on."""

import json
import math

import numpy as np
import pytest

from exactcreep import Chain, Evidence, InputError
from exactcreep.limits import OutOfTime
from exactcreep.studies.measured_thresholds import _line, half_life, intercept


def captions(n: int, sigma_mu: str = "0", tan_alpha: str = "0.25") -> Chain:
    return Chain(n, 1000, "0.5", "0.6", sigma_mu, tan_alpha=tan_alpha)


def test_a_weighted_line_has_the_parameters_errors_and_chi2_of_the_normal_equations() -> None:
    rng = np.random.default_rng(5)
    x = np.linspace(0.004, 0.007, 9)
    errors = rng.uniform(0.01, 0.1, 9)
    y = 15000 * (x - 0.0036) + errors * rng.standard_normal(9)
    found, covariance, chi2 = _line(x, y, errors)
    expected, other = np.polyfit(x, y, 1, w=1 / errors, cov="unscaled")
    assert found == pytest.approx(expected, rel=1e-9)
    assert covariance == pytest.approx(other, rel=1e-9)
    assert chi2 == pytest.approx(float((((y - np.polyval(expected, x)) / errors) ** 2).sum()))


def test_thirty_sliders_with_disorder_have_the_intercept_and_the_slope_of_the_laws() -> None:
    found = intercept(captions(30, "0.01"), cycles=100)
    off = abs(found.intercept - found.law_seuil)
    assert off < 3 * math.hypot(found.error, found.systematic)
    assert off < 0.02 * found.law_seuil
    assert found.slope == pytest.approx(found.law_slope, rel=0.02)
    assert found.law_slope == 15000
    assert found.evidence is Evidence.COMPUTED
    assert found.amplitudes[[0, -1]] == pytest.approx(np.array([1.2, 2]) * found.law_seuil)
    assert json.loads(json.dumps(found.summary()))["intercept"] == found.intercept


def test_between_two_plateaus_no_law_has_a_slope() -> None:
    found = intercept(captions(4, "0.01"), cycles=100)
    assert math.isnan(found.law_slope)
    assert found.summary()["law_slope"] is None
    assert found.slope > 0


def test_stairs_are_no_straight_line() -> None:
    stairs = intercept(captions(2), cycles=60)
    assert stairs.evidence is Evidence.UNDECIDED
    assert stairs.reason


def test_half_of_the_starts_of_two_sliders_live_half_the_size_below_their_edge() -> None:
    """Of tensions uniform in (-size, size), 1 - (a - l0 A)/size creep; a is the limit's."""
    a, size = (0.6 - 0.25) * 4 / math.sqrt(17), 1e-3
    found = half_life(
        captions(2),
        (a - 0.99 * size) / 1000,
        (a - 0.01 * size) / 1000,
        size="1e-3",
        starts=200,
        cycles=50,
        accuracy="2e-5",
    )
    assert found.low < found.amplitude < found.high
    assert found.low < (a - size / 2) / 1000 < found.high
    assert found.amplitude == pytest.approx((a - size / 2) / 1000, abs=2e-7)
    assert found.high - found.low < 4e-7
    assert json.loads(json.dumps(found.summary()))["amplitude"] == found.amplitude


@pytest.mark.parametrize(
    ("field", "compute"),
    [
        ("tan_alpha", lambda: intercept(captions(6, tan_alpha="-0.1"))),
        ("n", lambda: intercept(captions(1))),
        ("fit", lambda: intercept(captions(6), fit=("2", "1.2"))),
        ("points", lambda: intercept(captions(6), points=7)),
        ("cycles", lambda: intercept(captions(6, "0.01"), cycles=3)),
        ("sigma_mu", lambda: half_life(captions(6, "0.01"), "0.001", "0.002")),
        ("from", lambda: half_life(captions(6), "0.002", "0.001")),
        ("accuracy", lambda: half_life(captions(6), "0.001", "0.002", accuracy=0)),
        ("to", lambda: half_life(captions(2), "0.0001", "0.0002", starts=10, cycles=10)),
    ],
)
def test_bad_arguments_are_named(field: str, compute: object) -> None:
    with pytest.raises(InputError) as told:
        compute()  # type: ignore[operator]
    assert told.value.field == field


def test_no_time_is_said() -> None:
    with pytest.raises(OutOfTime):
        intercept(captions(6, "0.01"), max_seconds=0)
