"""Two sliders against relays in rationals, the Gaussian integral against quadrature."""

from __future__ import annotations

import math
from fractions import Fraction
from random import Random
from typing import Any

import pytest
import sympy as sp

from derivations import gaussian, two_sliders
from exactcreep import laws
from exactcreep.laws import LAWS
from tests.laws.parameters import (
    CONTEXT,
    SLOPES,
    F,
    agree,
    context,
)


def _staircase_case(random: Random) -> dict[str, Fraction]:
    slope = random.choice(SLOPES)
    mu_d = slope * F(random.randint(21, 60), 20)
    mu_s = mu_d + F(random.randint(1, 40), 50)
    return {
        "l0": F(random.randint(1, 400)),
        "mu_d": mu_d,
        "mu_s": mu_s,
        "tan_alpha": slope,
        "amplitude": F(random.randint(1, 300), 10_000),
        "r0": F(random.randint(-40, 40), 41),
    }


def test_the_staircase_is_the_count_of_relays_in_rational_arithmetic() -> None:
    random, creeping = Random(8), 0
    for _ in range(500):
        p = _staircase_case(random)
        cosine = laws.cosine(p["tan_alpha"])
        expected = cosine * two_sliders.staircase(
            p["tan_alpha"],
            p["mu_d"],
            p["mu_s"],
            p["l0"] * p["amplitude"] / cosine,
            p["r0"] / cosine,
        )
        found = laws.staircase_two_sliders(**p)
        assert found == expected
        assert isinstance(found, Fraction | int)
        creeping += found > 0
    assert 100 < creeping < 480


def test_the_staircase_rests_exactly_at_its_threshold_and_creeps_above() -> None:
    tan, mu_d, mu_s = F(3, 4), F(1), F(6, 5)
    threshold = LAWS["threshold_th_2_cycle_corrected"].exact
    assert threshold is not None
    edge = threshold(l0=7, mu_s=mu_s, tan_alpha=tan)
    assert isinstance(edge, Fraction)
    exact = LAWS["velocity_th_2_cycle_corrected"].exact
    assert exact is not None
    chain: dict[str, Any] = {"l0": 7, "mu_d": mu_d, "mu_s": mu_s, "tan_alpha": tan}
    assert exact(**chain, amplitude=edge) == 0
    assert exact(**chain, amplitude=edge + F(1, 10**60)) == 2 * (mu_s - mu_d) * F(4, 5)


def test_the_staircase_decides_next_to_an_irrational_threshold() -> None:
    ctx = context(80)
    edge = (ctx.mpf(6) / 10 - ctx.mpf(1) / 4) / ctx.sqrt(ctx.mpf(17) / 16)
    chain: dict[str, Any] = {"l0": 1, "mu_d": F(1, 2), "mu_s": F(3, 5), "tan_alpha": F(1, 4)}
    scale = 10**75
    below, above = int(ctx.floor(edge * scale)), int(ctx.floor(edge * scale)) + 1
    assert laws.staircase_two_sliders(**chain, amplitude=F(below, scale)) == 0
    assert laws.staircase_two_sliders(**chain, amplitude=F(above, scale)) > 0


def test_the_mean_of_the_staircase_over_its_phase_is_the_corrected_law() -> None:
    mean = LAWS["velocity_th_2_cycle_corrected"].corrected
    assert mean is not None
    random = Random(12)
    for _ in range(20):
        p = _staircase_case(random)
        excess = (p["mu_s"] - p["mu_d"]) * laws.cosine(p["tan_alpha"])
        count = 400
        total = F(0)
        for k in range(count):
            p["r0"] = excess * (F(2 * k + 1, count) - 1)
            total += laws.staircase_two_sliders(**p)
        del p["r0"]
        expected = mean(**{name: value for name, value in p.items() if name != "mu_s"})
        assert abs(total / count - expected) <= 2 * excess / count * 2


def test_without_a_static_excess_two_sliders_slide() -> None:
    chain: dict[str, Any] = {"l0": 10, "mu_d": F(1), "mu_s": F(1), "tan_alpha": F(3, 4)}
    assert laws.staircase_two_sliders(**chain, amplitude=F(1, 10)) == 1 - F(1, 5)
    assert laws.staircase_two_sliders(**chain, amplitude=F(1, 50)) == 0


@pytest.mark.parametrize("h", ["0", "0.001", "0.3", "1.7", "6"])
def test_the_gaussian_integral_agrees_with_quadrature(h: str) -> None:
    half = CONTEXT.mpf(h)
    expected = CONTEXT.mpf(gaussian.integral(h, 48)._mpf_)
    assert agree(laws.gaussian_integral(half), expected, 44)
    assert laws.gaussian_integral(float(h)) == pytest.approx(float(expected), rel=4e-15)


def _series() -> tuple[sp.Expr, ...]:
    proof = gaussian.derive()
    return proof.mean_step, proof.slope, proof.curvature


def test_the_gaussian_integral_has_the_derived_series() -> None:
    zeroth, first, second = (CONTEXT.mpf(str(sp.N(term, 60))) for term in _series())
    h = CONTEXT.mpf(10) ** -8
    rest = laws.gaussian_integral(h) - zeroth - first * h - second * h**2
    assert abs(rest) < h**3
    assert agree(laws.gaussian_integral(CONTEXT.mpf(0)), 1 / CONTEXT.sqrt(CONTEXT.pi), 58)


@pytest.mark.parametrize("h", [-0.1, math.nan, math.inf])
def test_the_gaussian_integral_refuses_what_it_cannot_integrate(h: float) -> None:
    with pytest.raises(ValueError, match="h must be finite"):
        laws.gaussian_integral(h)
