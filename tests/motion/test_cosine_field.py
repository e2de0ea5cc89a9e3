"""Numbers a + b cos(alpha) against integer square roots of hundreds of digits."""

from __future__ import annotations

import math
from fractions import Fraction

import flint
from hypothesis import given
from hypothesis import strategies as st

from exactcreep.model.numbers import nearest_float
from exactcreep.motion.arithmetic import balls_of
from exactcreep.motion.cosine_field import CosineField

SLOPES = [Fraction(slope) for slope in ("1/4", "-3/10", "0", "3/4", "7/24")]
RATIONALS = st.fractions(min_value=-(10**6), max_value=10**6, max_denominator=10**6)


def root_of(square: Fraction, bits: int = 500) -> Fraction:
    shifted = (square.numerator << (2 * bits)) // square.denominator
    return Fraction(math.isqrt(shifted), 1 << bits)


@given(
    st.sampled_from(SLOPES), RATIONALS, RATIONALS, RATIONALS, RATIONALS, st.sampled_from([0, 5, 40])
)
def test_operations_order_floats_and_balls_agree_with_integer_roots(slope, a, b, c, factor, digits):
    """Of a + b cos(alpha) all but so many digits cancel; 0: as drawn."""
    field, cosine = CosineField(slope), root_of(1 / (1 + slope * slope))
    if digits:
        a = -Fraction(math.floor(b * cosine * 10**digits), 10**digits)
    x, y = field.number(a, b), field.number(c, factor)
    rough_x, rough_y = a + b * cosine, c + factor * cosine
    # beyond 2^-400 no two of these numbers differ without being different
    least, apart = Fraction(1, 2**400), rough_x - rough_y
    assert (x - y).sign() == (apart > least) - (apart < -least)
    assert (x < y) == ((x - y).sign() < 0)
    assert (x == y) == ((x - y).sign() == 0)
    assert float(x) == nearest_float(rough_x) or x == 0
    for exact, rough in (
        (x, rough_x),
        (x + y, rough_x + rough_y),
        (factor - x, factor - rough_x),
        (x * factor, rough_x * factor),
        (x / (abs(factor) + 1), rough_x / (abs(factor) + 1)),
        (abs(x), abs(rough_x)),
    ):
        middle, error = exact.bracket(200)
        assert abs(middle - rough) <= error + least
        assert error * 2**200 <= abs(middle) + error
        for bits in (30, 150):
            with balls_of(bits).active():
                ball = exact.ball()
                assert ball.overlaps(flint.arb(flint.fmpq(middle.numerator, middle.denominator)))
