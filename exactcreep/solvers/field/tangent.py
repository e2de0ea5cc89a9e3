"""Follow a whole set of states at rest along one itinerary, with the derivative of the map.

A state at the end of a cycle consists of its *shape*, the forces of the sliders 2 .. N - 1, and its
*load* u = (F_1 - F_N)/2; the forces add up to N s. A rearrangement begins at an end of the chain
for every u. So along one itinerary the shape evolves independently, and u changes by an amount that
depends only on the shape.

The derivative is a product over short stretches. Multiplied in balls it would grow by some bits per
event even if the motion contracts. So it is stored as an orthogonal basis without errors times a
matrix of balls, and each stretch multiplies by a nearly triangular matrix (Lohner).
"""

from __future__ import annotations

import math
from typing import Any, ClassVar

import flint
import numpy as np
from numpy.typing import NDArray

from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles
from exactcreep.model.state import State
from exactcreep.motion.arithmetic import Arithmetic, Undecided, balls_of
from exactcreep.motion.modes import Flow
from exactcreep.motion.state_set import StateSet, exponent_of, scaled
from exactcreep.solvers.field.set_integrator import SetIntegrator
from exactcreep.solvers.field.simulation import FieldSimulation
from exactcreep.solvers.interface import Start

BITS = 128
"""Precision of the product of the derivatives of short stretches."""


class TangentMechanics(SetIntegrator):
    """`SetIntegrator` with the derivative of the present state by the initial shape and load.

    It is ``tangent product`` over all states of the set: the tangent's columns are a basis in
    floats with error bounds, and the product is a matrix of balls.
    """

    renew_every: ClassVar[int] = 2  # the set is much wider than in a run
    product: Any = None
    rests = 0  # since the beginning
    half = 0  # the rest at which the shape is noted, and the derivative begins anew
    at_half: tuple[list[Any], Any] | None = None

    def begin(self, spread: NDArray[np.float64], load: float) -> None:
        """Begin with all states near the present one.

        The shapes are the middle plus `spread` (ndarray, shape (n - 2, n - 2)) times
        ``[-1, 1]**(n - 2)``; the loads are within `load` of the present one.
        """
        n, inner = self.chain.n, len(spread)
        rest = self.rest
        noise = [x.rad() for x in (*rest.forces.tolist(), self.l0 * rest.theta)]
        for numbers in (rest.forces, rest.displacements):
            numbers[:] = [x.mid() for x in numbers.tolist()]
        rest.theta, rest.tensions = rest.theta.mid(), self._tensions(rest.forces)
        widest = flint.arb(float(abs(spread).sum()) + load)
        exponent = max(exponent_of(x) for x in (*noise, widest))
        spread, load = np.ldexp(spread, -exponent), math.ldexp(load, -exponent)
        rows = np.zeros((n + 1, inner + 1 + n + 1))
        rows[1 : n - 1, :inner] = spread
        rows[[0, n - 1], :inner] = -spread.sum(axis=0) / 2
        rows[0, inner], rows[n - 1, inner] = load, -load
        rows[:, inner + 1 :] = np.diag(scaled(noise, exponent))
        rest.set = StateSet.spanned(rows, exponent=exponent)
        rest.set.errors[0, [0, -1]] += n * 2.0**-52 * abs(spread).sum()
        rest.fresh = False  # the present state is at rest
        self._look_around()
        self.differentiate()

    def differentiate(self) -> None:
        """Begin the derivative anew at the present state."""
        n = self.chain.n
        rows = np.zeros((n + 1, n - 1))
        rows[1 : n - 1, : n - 2] = np.eye(n - 2)
        rows[[0, n - 1], : n - 2] = -0.5
        rows[0, n - 2], rows[n - 1, n - 2] = 1.0, -1.0
        self.tangent = StateSet.spanned(rows)
        self.product = flint.arb_mat(np.eye(n - 1).tolist())

    def derivative(self) -> list[list[Any]]:
        """Return the derivative of shape and load over all states of the set: its rows."""
        with balls_of(BITS).active():
            first, *shape, last, ramp = self._rows([])
            # the load at the same theta
            load = [(a - b) / 2 + c for a, b, c in zip(first, last, ramp, strict=True)]
            rows: list[list[Any]] = (flint.arb_mat([*shape, load]) * self.product).tolist()
            return rows

    def _rows(self, fast: list[int]) -> list[list[Any]]:
        """Return the tangent: rows of forces, speeds of the sliders `fast`, l0 theta."""
        rows = self.tangent
        assert rows is not None
        numbers = np.vstack([rows.forces, rows.speeds[fast], rows.theta])
        errors = [*rows.errors[0], *rows.errors[1, fast], rows.theta_error]
        pairs = zip(numbers.tolist(), map(float, errors), strict=True)
        return [[flint.arb(x, error) for x in row] for row, error in pairs]

    def _give_up(self, flow: Flow) -> None:
        raise Undecided("what comes first is not proved of all states")

    def _renew(self) -> None:
        super()._renew()
        fast = list(self._fast())
        with balls_of(BITS).active():
            basis, self.product = _orthogonal(flint.arb_mat(self._rows(fast)), self.product)
        self.tangent = StateSet.spanned(basis, fast)

    def come_to_rest(self, flow: Flow) -> None:
        super().come_to_rest(flow)
        self.rests += 1
        if self.rests == self.half:
            self.at_half = list(self.known_forces()[1:-1]), self.derivative()
            self.differentiate()


def _orthogonal(rows: Any, product: Any) -> tuple[NDArray[np.float64], Any]:
    """Return ``rows product`` as an orthogonal basis times balls, the least certain part first."""
    middles = np.array([[float(x) for x in row] for row in rows.table()])
    if not np.isfinite(middles).all():
        raise Undecided("the derivative of a period is not enclosed")
    doubts = [sum(float(x.rad()) for x in row) for row in product.table()]
    weights = np.array(doubts) + 2.0**-BITS
    order = np.argsort(-np.linalg.norm(middles, axis=0) * weights, kind="stable")
    basis = np.linalg.qr(middles[:, order], mode="complete")[0]
    return basis, flint.arb_mat(basis.tolist()).solve(rows) * product


class TangentSimulation(FieldSimulation):
    """A simulation of a set of states; `follow` raises `Undecided` if they part.

    `state`: at rest at the end of a cycle, in balls.
    """

    kind = TangentMechanics
    mechanics: TangentMechanics

    def __init__(self, chain: Chain, state: State, drive: Cycles, arithmetic: Arithmetic) -> None:
        super().__init__(Start(chain, state, 0), ("events",), arithmetic)
        self.theta_target = -drive.amplitude
