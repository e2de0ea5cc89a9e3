"""A state placed in the arrays of the compiled loop, and read back from them."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise

import pytest

from exactcreep import Chain, State
from exactcreep.solvers.exact import layout
from exactcreep.solvers.exact.pack import Origin, dilation, placed

THIRDS = [Fraction(k, 3) for k in (1, -2, 4, -5)]


@pytest.mark.parametrize("theta", [Fraction(0), Fraction(-2, 3)])
@pytest.mark.parametrize("n", [1, 2, 5])
def test_forces_are_placed_to_twice_the_digits_of_a_float_and_read_back(n: int, theta: Fraction):
    chain = Chain(n, Fraction(2, 7), "0.5", "0.6", tan_alpha="0.3")
    tensions = THIRDS[: n - 1]
    origin = Origin.of(chain, State.prepared(chain, tensions, theta=theta))
    work = placed(chain, origin, 0, True)
    cell = work.cell[:, layout.PAD : layout.PAD + n]
    load = chain.l0 * theta if n > 1 else Fraction(0)
    bare = [0, *(tension + load for tension in tensions), 0]  # theta is added apart
    for k, (before, after) in enumerate(pairwise(bare)):
        placed_force = Fraction(cell[layout.FORCE, k]) + Fraction(cell[layout.FORCE_LOW, k])
        true = after - before + Fraction(chain.sin_alpha)
        assert abs(placed_force - true) < Fraction(1, 2**100)
        assert cell[layout.REST, k] == cell[layout.FORCE, k]
    assert origin.read(work)[0].tolist() == [float(t) for t in tensions]
    assert dilation(chain, origin.load) == float(theta)
