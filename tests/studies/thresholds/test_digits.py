"""Thresholds to many digits: proved by balls, and agreed upon by other arithmetics."""

from __future__ import annotations

import math
from fractions import Fraction

import pytest

from exactcreep.model.chain import Chain
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.studies.thresholds import beside_laws
from exactcreep.studies.thresholds.threshold import Threshold, threshold
from tests.paper import captions


def bounds(found: Threshold) -> tuple[Fraction, Fraction]:
    return Fraction(found.lower), Fraction(found.upper)


def test_two_sliders_to_a_thousand_digits_by_the_search_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(beside_laws, "laws_beside", None)
    found = threshold(captions(2), after=20, digits=1000)
    lower, upper = bounds(found)
    # (mu_s - tan) cos / l0 = 0.35 * 4 / sqrt(17) / 1000, enclosed by integer square roots
    square = Fraction(35 * 4, 100 * 1000) ** 2 / 17
    assert lower**2 < square < upper**2
    assert upper - lower <= lower / 10**1000
    assert found.evidence is Evidence.PROVED
    assert found.outcome_at_lower is Outcome.AT_REST
    assert found.outcome_evidence is Evidence.PROVED
    assert found.report["deciding_runs"] <= 4  # the root is found, not bisected for


def test_a_threshold_that_is_a_decimal_is_decided_exactly() -> None:
    """At the threshold itself the slider stays, and that is known in Q(c)."""
    chain = Chain(2, 1000, "0.775", "0.8", tan_alpha="3/4")  # mu_s c - s = 0.64 - 0.6
    found = threshold(chain, after=20, digits=30)
    lower, upper = bounds(found)
    assert lower <= Fraction("0.00004") < upper
    assert upper - lower <= lower / 10**30
    assert found.evidence is Evidence.PROVED


def test_what_three_and_four_sliders_do_below_is_proved() -> None:
    found = threshold(captions(3), after=20, digits=40)
    lower, upper = bounds(found)
    assert (found.evidence, found.outcome_at_lower) == (Evidence.PROVED, Outcome.AT_REST)
    assert found.outcome_evidence is Evidence.PROVED
    assert upper - lower <= lower / 10**40
    assert found.report["deciding_runs"] <= 4
    found = threshold(captions(4), after=20, digits=20)
    assert found.outcome_at_lower is Outcome.CYCLING
    assert found.outcome_evidence is Evidence.PROVED


@pytest.mark.parametrize(
    ("n", "digits"), [(3, 30), *(pytest.param(n, 40, marks=pytest.mark.slow) for n in (4, 6, 8))]
)
def test_two_arithmetics_agree(n: int, digits: int) -> None:
    certified = threshold(captions(n), after=20, digits=digits)
    floats = threshold(captions(n), after=20, digits=12, solver="exact")
    assert certified.evidence is Evidence.PROVED
    low, high = bounds(floats)
    lower, upper = bounds(certified)
    assert low <= lower < upper <= high
    assert math.log10(low / (high - low)) > 8
