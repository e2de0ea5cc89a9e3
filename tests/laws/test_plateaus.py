"""The pivot against a rational chain in the sliding limit."""

from __future__ import annotations

import math
from random import Random

import pytest

from derivations.chain import NotUnique, RationalChain
from exactcreep import laws
from exactcreep.laws import LAWS
from tests.laws.parameters import (
    F,
)


def test_the_pivot_is_where_the_sliding_chain_pivots() -> None:
    random = Random(77)
    for n in range(2, 20):
        for _ in range(6):
            mu_d = F(random.randint(1, 40), 20)
            tan = mu_d * F(random.randint(-59, 59), 60)
            chain = RationalChain(n, tan, mu_d)
            try:
                chain.ramp(4 * n * mu_d)
            except NotUnique:
                low, high = laws.pivots(n, tan, mu_d)
                assert high == low + 1
                continue
            assert laws.pivots(n, tan, mu_d) == (chain.pivot + 1,)


def test_ties_of_the_pivot_are_decided_exactly() -> None:
    assert laws.pivots(4, F(1, 4), F(1, 2)) == (2, 3)
    assert laws.pivots(4, 0.25, 0.5) == (2, 3)
    assert laws.pivots(4, F(1, 4) + F(1, 10**50), F(1, 2)) == (2,)
    assert laws.pivots(4, F(1, 4) - F(1, 10**50), F(1, 2)) == (3,)
    assert laws.pivots(4, 0.3, 0.6) == (2, 3)
    # a tenth in floats is not a tenth: the binary values decide
    assert laws.pivots(3, F(1, 10), F(3, 10)) == (2, 3)
    assert laws.pivots(3, 0.1, 0.3) == (2,)
    with pytest.raises(ValueError, match="i = 2 or i = 3"):
        LAWS["vitesse_seuil"].printed(n=4, l0=1, mu_d=F(1, 2), tan_alpha=F(1, 4), amplitude=3)
    both = [LAWS["vitesse"].printed(n=4, l0=1, amplitude=1, i=i) for i in laws.pivots(4, 0.25, 0.5)]
    assert both == [3, 1]


def test_pivot_windows_overlap_by_the_derived_width() -> None:
    mu_d, mu_s = F(1, 2), F(3, 5)
    for n in range(2, 13):
        for i in range(2, n + 1):
            upper, lower = (
                laws.pivot_window(n, i, mu_d, mu_s),
                laws.pivot_window(n, i + 1, mu_d, mu_s),
            )
            assert lower.upper - upper.lower == 2 * (mu_s - mu_d) / n
            assert lower.upper == upper.lower_alone
            printed = LAWS["critical_angle"].printed(n=n, i=i, mu_d=mu_d, mu_s=mu_s)
            assert printed == lower.upper
    with pytest.raises(ValueError, match="i must be between"):
        laws.pivot_window(5, 1, mu_d, mu_s)


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_a_pivot_of_no_finite_number_is_refused(value: float) -> None:
    with pytest.raises(ValueError, match="finite"):
        laws.pivot(3, value, 0.5)


def test_a_pivot_needs_a_slope_below_mu_d_and_a_whole_number_of_sliders() -> None:
    for tan in (F(1, 2), F(3, 5), F(-1, 2)):
        with pytest.raises(ValueError, match="tan_alpha"):
            laws.pivots(5, tan, F(1, 2))
    with pytest.raises(ValueError, match="n must be"):
        laws.pivots(0, F(1, 4), F(1, 2))
