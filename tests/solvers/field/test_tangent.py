"""The derivative of a period over a set of states, held against states that differ a little."""

from __future__ import annotations

from fractions import Fraction

import flint
import numpy as np
import pytest

from exactcreep.model.drive import Cycles
from exactcreep.model.state import State
from exactcreep.motion.arithmetic import balls_of
from exactcreep.solvers.field.tangent import TangentSimulation
from exactcreep.solvers.registry import solver_named
from tests.paper import captions

BALLS = balls_of(400)


@pytest.mark.parametrize(("n", "amplitude"), [(3, "0.00085"), (4, "0.0009")])
def test_the_derivative_of_a_cycle_is_that_of_its_states(n: int, amplitude: str) -> None:
    chain, drive = captions(n), Cycles(Fraction(amplitude), 100)
    course = solver_named("certified", {"digits": 100}).simulation(
        chain, State.relaxed(chain), 0, ()
    )
    course.follow(drive, 1, 60)
    state = course.state()

    def after(change: list[Fraction]) -> TangentSimulation:
        """Return the set after two cycles, its shape and load begun so far from `state`."""
        with BALLS.active():
            forces = [BALLS.number(x) for x in change]
            middle = State(
                BALLS.vector([x.mid() for x in state.tensions + np.cumsum(forces)[:-1]]),
                state.displacements,
                state.coefficients,
                state.draws,
                state.theta,
            )
            simulation = TangentSimulation(chain, middle, drive, BALLS)
            simulation.mechanics.begin(np.zeros((n - 2, n - 2)), 0.0)
        simulation.follow(drive, 1, 4)
        return simulation

    near = Fraction(1, 2**60)
    first = after([Fraction(0)] * n).mechanics
    with BALLS.active():
        derivative = first.derivative()
    assert max(float(x.rad()) for row in derivative for x in row) < 1e-4
    for k in range(n - 1):
        change = [Fraction(0)] * n
        if k < n - 2:
            change[k + 1], change[0], change[-1] = near, -near / 2, -near / 2
        else:
            change[0], change[-1] = near, -near
        other = after(change).mechanics
        with BALLS.active():
            gaps = (other.known_forces() - first.known_forces()).tolist()
            moved = [*gaps[1:-1], (gaps[0] - gaps[-1]) / 2]
            for i, gap in enumerate(moved):
                assert (gap / BALLS.number(near)).overlaps(derivative[i][k] + flint.arb(0, 1e-9))
