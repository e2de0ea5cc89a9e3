"""Inputs are kept as the rationals they denote."""

from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import exactcreep
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles, GaussianSteps
from exactcreep.model.enclosure import Enclosure
from exactcreep.model.numbers import (
    exact_number,
    nearest_float,
    whole_number,
)
from exactcreep.model.targets import Targets

CHAIN = Chain(6, 1000, "0.5", 0.6, "1/100", tan_alpha="1/3")


@pytest.mark.parametrize(
    ("value", "rational"),
    [
        (np.int32(7), Fraction(7)),
        ("-2.5e-3", Fraction(-1, 400)),
        (" 1e3 ", Fraction(1000)),
        ("1_000.5", Fraction(2001, 2)),
        (Decimal("0.1"), Fraction(1, 10)),
    ],
)
def test_a_number_is_kept_exactly(value, rational):
    assert exact_number(value, "it") == rational


@given(st.fractions(), st.floats(allow_nan=False, allow_infinity=False))
def test_a_fraction_and_its_text_are_the_same_number_and_a_float_is_its_binary_value(exact, near):
    assert exact_number(exact, "it") == exact_number(str(exact), "it") == exact
    assert nearest_float(exact_number(near, "it")) == near
    assert exact_number(repr(near), "it") == Fraction(repr(near))


@pytest.mark.parametrize("value", [1, 1.0, Fraction(1), np.int64(1), "1e0"])
def test_a_whole_number_may_be_written_in_any_way(value):
    result = whole_number(value, "n", least=1)
    assert result == 1
    assert type(result) is int


@pytest.mark.parametrize(
    "made",
    [CHAIN, Cycles("0.02", 7), GaussianSteps(0.1, 3), Targets([0.1, "0.1", Fraction(1, 3)])],
    ids=repr,
)
def test_the_line_of_a_chain_or_a_drive_makes_it_again_exactly(made):
    assert eval(repr(made), vars(exactcreep) | {type(made).__name__: type(made)}) == made
    given = made.parameters()
    assert given.pop("kind", None) == getattr(made, "kind", None)
    assert type(made)(**given) == made


RATIONAL = st.fractions(min_value=-9, max_value=9, max_denominator=50)
RADIUS = st.fractions(min_value=0, max_value=1, max_denominator=50)
BALL = st.builds(Enclosure, RATIONAL, RADIUS)


@given(first=BALL, last=BALL, span=st.integers(1, 9))
def test_an_enclosure_holds_every_rate_and_is_written_as_far_as_it_is_known(
    first: Enclosure, last: Enclosure, span: int
) -> None:
    ends = [[ball.middle - ball.radius, ball.middle + ball.radius] for ball in (first, last)]
    rate = last.rate(first, span)
    assert (rate.middle - rate.radius) * span == ends[1][0] - ends[0][1]
    assert (rate.middle + rate.radius) * span == ends[1][1] - ends[0][0]
    meet = ends[0][0] <= ends[1][1] and ends[1][0] <= ends[0][1]
    assert last.apart(first) == (0 if meet else float(abs(last.middle - first.middle)))
    if last.radius < abs(last.middle):
        assert abs(Fraction(last.text(20)) - last.middle) <= 10 * last.radius + Fraction(1, 10**18)
    assert last.radius <= Fraction(last.radius_text()) <= last.radius * Fraction(101, 100)
