"""The derivative of a period over a set of states is that of states that differ a little."""

from __future__ import annotations

from fractions import Fraction

import flint
import numpy as np
import pytest

from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles
from exactcreep.model.state import State
from exactcreep.motion.arithmetic import balls_of
from exactcreep.solvers.field.tangent import TangentMechanics
from exactcreep.solvers.interface import Start
from exactcreep.solvers.registry import solver_named
from tests.paper import captions

BALLS = balls_of(400)
STEP = Fraction(1, 2**60)
"""How far a state beside the first is off in one coordinate."""


def settled(chain: Chain, drive: Cycles) -> State:
    """Return the state on the limit cycle, after thirty cycles."""
    solver = solver_named("certified", {"digits": 100})
    simulation = solver.simulation(chain, State.relaxed(chain), 0, ())
    simulation.follow(drive, 1, 60)
    return simulation.state()


def directions(n: int) -> list[list[Fraction]]:
    """Return the changes of forces: of each inner slider against both ends, and of the ends."""
    changes = []
    for k in range(1, n - 1):
        change = [Fraction(0)] * n
        change[0], change[k], change[-1] = -STEP / 2, STEP, -STEP / 2
        changes.append(change)
    return [*changes, [STEP, *[Fraction(0)] * (n - 2), -STEP]]


def coordinates(forces: list[flint.arb]) -> list[flint.arb]:
    """Return how far forces moved: of each inner slider, and of one end against the other."""
    return [*forces[1:-1], (forces[0] - forces[-1]) / 2]


@pytest.mark.parametrize(("n", "amplitude"), [(3, "0.00085"), (4, "0.0009")])
def test_the_derivative_of_two_cycles_is_the_difference_of_neighbouring_states(
    n: int, amplitude: str
) -> None:
    chain, drive = captions(n), Cycles(Fraction(amplitude), 100)
    state = settled(chain, drive)

    def after(change: list[Fraction]) -> TangentMechanics:
        """Return the set two cycles after the state whose forces are changed."""
        with BALLS.active():
            tensions = state.tensions + np.cumsum([BALLS.number(x) for x in change])[:-1]
            middle = State(BALLS.vector([x.mid() for x in tensions]), state.displacements,
                           state.coefficients, state.draws, state.theta)  # fmt: skip
            mechanics = TangentMechanics(Start(chain, middle, 0), BALLS)
            mechanics.begin(np.zeros((n - 2, n - 2)), 0.0)
            mechanics.follow(drive.amplitude, 4)
        return mechanics

    first = after([Fraction(0)] * n)
    with BALLS.active():
        derivative = first.derivative()
        assert max(float(x.rad()) for row in derivative for x in row) < 1e-4
    for k, change in enumerate(directions(n)):
        other = after(change)
        with BALLS.active():
            moved = coordinates((other.known_forces() - first.known_forces()).tolist())
            for row, gap in zip(derivative, moved, strict=True):
                assert (gap / BALLS.number(STEP)).overlaps(row[k] + flint.arb(0, 1e-9))
