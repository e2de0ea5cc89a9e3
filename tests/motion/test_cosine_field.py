"""Numbers a + b cos(alpha) against integer square roots of hundreds of digits."""

from __future__ import annotations

import math
from fractions import Fraction

import flint
import pytest
from hypothesis import given
from hypothesis import strategies as st

from exactcreep.motion.cosine_field import CosineField

SLOPES = [Fraction(slope) for slope in ("1/4", "-3/10", "0", "3/4", "7/24")]
RATIONALS = st.fractions(min_value=-(10**6), max_value=10**6, max_denominator=10**6)


def root_of(square: Fraction, bits: int = 400) -> Fraction:
    shifted = (square.numerator << (2 * bits)) // square.denominator
    return Fraction(math.isqrt(shifted), 1 << bits)


@given(st.sampled_from(SLOPES), RATIONALS, RATIONALS, RATIONALS, RATIONALS)
def test_sums_multiples_and_order_agree_with_two_hundred_digits(slope, a, b, other, factor):
    field = CosineField(slope)
    cosine = root_of(1 / (1 + slope * slope))
    x, y = field.number(a, b), field.number(other, factor)
    rough_x, rough_y = a + b * cosine, other + factor * cosine
    # beyond 2^-300 no two of these numbers differ without being different
    least, apart = Fraction(1, 2**300), rough_x - rough_y
    assert (x - y).sign() == (apart > least) - (apart < -least)
    assert (x < y) == ((x - y).sign() < 0)
    assert (x == y) == ((x - y).sign() == 0)
    for exact, rough in (
        (x + y, rough_x + rough_y),
        (factor - x, factor - rough_x),
        (x * factor, rough_x * factor),
        (x / (abs(factor) + 1), rough_x / (abs(factor) + 1)),
        (abs(x), abs(rough_x)),
    ):
        middle, error = exact.bracket(200)
        assert abs(middle - rough) <= error + least
        assert error * 2**200 <= abs(middle) + error


def test_a_difference_of_forty_digits_keeps_its_sign_and_its_float():
    cosine = CosineField(Fraction(1, 4)).times_cosine(Fraction(1))
    assert 0 < cosine < 1
    assert float(cosine) == math.sqrt(16 / 17)
    close = Fraction(math.isqrt(16 * 10**80 // 17), 10**40)
    tiny = cosine - close
    assert 0 < tiny < Fraction(1, 10**40)
    difference = root_of(Fraction(16, 17)) - close
    assert float(tiny) == difference.numerator / difference.denominator
    assert (cosine - cosine).sign() == 0
    assert cosine - cosine == 0
    assert -cosine < -1 + cosine


def test_a_ball_contains_the_number_at_every_precision():
    number = CosineField(Fraction(1, 5)).number(Fraction(1, 3), Fraction(-2, 7))
    middle, error = number.bracket(2000)
    before = flint.ctx.prec
    try:
        for bits in (30, 100, 1000):
            flint.ctx.prec = bits
            ball = number.ball()
            for end in (middle - error, middle + error):
                assert ball.contains(flint.fmpq(end.numerator, end.denominator))
    finally:
        flint.ctx.prec = before


def test_numbers_of_two_fields_do_not_mix():
    one = CosineField(Fraction(1, 4)).times_cosine(Fraction(1))
    other = CosineField(Fraction(1, 5)).times_cosine(Fraction(1))
    assert one != other
    rational = CosineField(Fraction(3, 4)).number(Fraction(1), Fraction(5))  # a Pythagorean slope
    assert (rational.rationals(), rational == 5) == ((5, 0), True)
    assert hash(rational) == hash(Fraction(5))
    assert repr(other - 1) == "-1 + 1 sqrt(25/26)"
    with pytest.raises(TypeError):
        one + other
    with pytest.raises(TypeError):
        one < other  # noqa: B015 - the comparison itself is refused
    with pytest.raises(TypeError):
        one + 0.5  # a float would have to be rounded, or to round
