"""Thresholds of chains without slips, held against the sliding solver cycle by cycle."""

import random
from fractions import Fraction

import numpy as np
import pytest

from exactcreep import Chain, Cycles, Evidence, InputError, Outcome, creep, laws, threshold


def drawn(number: int) -> Chain:
    """Return a chain of up to nine sliders without slips: steep, near the level, or on an edge."""
    draw = random.Random(number)
    n, friction = draw.randint(2, 9), Fraction(draw.randint(30, 70), 100)
    near = [Fraction(k, n) for k in range(1, n) if (n - k) % 2 == 0]  # two pivots are possible
    shares = draw.choice([[Fraction(draw.randint(1, 99), 100)], [Fraction(9, 10 * n)], near])
    slope = friction * draw.choice(shares or near or [Fraction(1, 2)]) * draw.choice([-1, 1])
    return Chain(n, draw.choice([1, 1000]), friction, friction, tan_alpha=slope)


def advances(chain: Chain, amplitude: Fraction | str, cycles: int) -> np.ndarray:
    """Return by how much x_G moves downhill in each cycle."""
    drive = Cycles(amplitude, cycles)
    x = creep(chain, drive, solver="sliding", record=("x_G",)).recorded["x_G"][1::2]
    return np.sign(float(chain.tan_alpha)) * np.diff(x, prepend=0)


@pytest.mark.filterwarnings("ignore::exactcreep.PhysicsWarning")
@pytest.mark.parametrize("number", range(40))
def test_the_sliding_limit_advances_above_a_threshold_and_not_below(number: int) -> None:
    chain = drawn(number)
    slope = abs(chain.tan_alpha)
    square = (chain.n * (chain.mu_d - slope) / (2 * chain.l0)) ** 2 / (1 + slope**2)
    two_pivots = len(laws.pivots(chain.n, slope, chain.mu_d)) > 1
    for after in (None, 1, 2, 5):
        if chain.n % 2 and chain.n * slope <= chain.mu_d and after != 1:
            with pytest.raises(InputError, match="must exceed mu_d/N"):
                threshold(chain, after=after)
            far = Cycles(Fraction(10 * chain.n) / chain.l0, 3)
            if not two_pivots:
                assert abs(advances(chain, far.amplitude, 3)[1:]).max() < 1e-12
                assert laws.prediction(chain, far).values == (0.0,)
            continue
        edge = threshold(chain, after=after, digits=6)
        assert (edge.evidence is Evidence.PROVED) or (two_pivots and after)
        least = 0 if after is None else 1e-6
        for side, beyond in ((edge.lower, False), (edge.upper, True)):
            assert bool(advances(chain, side, 5)[(after or 2) - 1] > least + 1e-14) is beyond
        if after is None:
            assert Fraction(edge.lower) ** 2 <= square < Fraction(edge.upper) ** 2
            ends_slip = (chain.l0 * Fraction(edge.lower)) ** 2 * (1 + slope**2) > chain.mu_d**2
            assert edge.outcome_at_lower is (Outcome.CYCLING if ends_slip else Outcome.AT_REST)


def test_an_edge_that_is_a_decimal_is_the_lower_end() -> None:
    edge = threshold(Chain(2, 1000, "0.775", "0.775", tan_alpha="3/4"), digits=12)
    assert Fraction(edge.lower) == Fraction(25, 1000) * Fraction(4, 5) / 1000
