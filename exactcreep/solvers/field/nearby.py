"""A whole set of states at rest, taken along one itinerary, with the derivative of where they go.

States at the end of a cycle are told by their *shape*, the forces of the sliders 2 .. N - 1, and
their *load* u = (F_1 - F_N)/2; the forces add up to N s. A rearrangement begins with an end at its
threshold, whatever u was, so that along one itinerary the shape goes on by itself, and u moves by
an amount that depends on the shape alone.

The derivative is a product of those of short stretches. Multiplied out in balls it would grow by
some bits per event, however the motion contracts: it is kept as a basis, orthogonal numbers without
errors, times a matrix of balls, and what every stretch multiplies is nearly triangular (Lohner).
"""

from __future__ import annotations

from typing import Any, ClassVar

import flint
import numpy as np
from numpy.typing import NDArray

from exactcreep.limits import NO_LIMITS, Limits
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles
from exactcreep.model.state import State
from exactcreep.motion.arithmetic import Arithmetic, Undecided, balls_of
from exactcreep.motion.enclosure import ZERO, Box, Row, Spread
from exactcreep.motion.modes import Flow
from exactcreep.solvers.field.enclosed import DERIVATIVE_BITS, Enclosed, Middle
from exactcreep.solvers.field.reference import FieldSimulation


class Nearby(Enclosed):
    """`Enclosed` with the derivative of the present state in shape and load at the beginning.

    It is ``tangent product``, over all states of the set.
    """

    stretch: ClassVar[int] = 2  # the set is much wider than that of a course
    tangent: list[Row] | None = None
    """Rows of forces, velocities of the sliders `fast`, l0 theta; the columns are a basis."""
    product: Any = None
    """What the basis has to be multiplied by; columns of shape and load."""
    turned: Spread | None = None
    rests = 0  # since the beginning
    half = 0  # the rest at which the shape is noted, and the derivative begins anew
    at_half: tuple[list[Any], Any] | None = None

    def begin(self, spread: NDArray[np.float64], load: float) -> None:
        """Take all states at most so far from the present one.

        Parameters
        ----------
        spread : ndarray, shape (n - 2, n - 2)
            The shapes are the middle plus this matrix times ``[-1, 1]**(n - 2)``.
        load : float
            The loads lie within that distance of the present one.
        """
        n = self.chain.n
        rounding = [x.rad() for x in self.forces] + [(self.l0 * self.theta).rad()]
        self._enclose(self.snapshot())
        centre = self.centre
        assert centre is not None
        inner = spread.shape[0]
        axes = [[ZERO] * (inner + 1 + n + 1) for _ in range(n + 1)]
        for k in range(inner + 1):
            column = spread[:, k] if k < inner else np.zeros(inner)
            half = -sum((flint.arb(x) for x in column.tolist()), flint.arb(0)) / 2
            shift = flint.arb(load if k == inner else 0)
            values = [half + shift, *(flint.arb(x) for x in column.tolist()), half - shift]
            for i, value in enumerate(values):
                axes[i][k] = value
        for i in range(n + 1):
            axes[i][inner + 1 + i] = rounding[i].upper()
        self.box = Box(axes, np.ones(inner + 1 + n + 1), 0)
        self.reach = [ZERO] * n
        self.fresh = False  # the present state is at rest
        self._recentre(centre)
        self.differentiate()

    def differentiate(self) -> None:
        """Let the derivative begin anew at the present state."""
        n = self.chain.n
        unit, half = flint.arb(1), flint.arb(-1) / 2
        rows = [[ZERO] * (n - 1) for _ in range(n + 1)]
        for k in range(n - 2):
            rows[0][k] = rows[n - 1][k] = half
            rows[k + 1][k] = unit
        rows[0][n - 2], rows[n - 1][n - 2] = unit, -unit
        self.tangent = rows
        self.product = _matrix(np.eye(n - 1))

    def derivative(self) -> Any:
        """Return the derivative of shape and load, over all states of the set, as an arb_mat."""
        n = self.chain.n
        assert self.tangent is not None
        first, last = self.tangent[0], self.tangent[n - 1]
        ramp = self.tangent[-1]  # the load is that at the same theta
        load = [(a - b) / 2 + c for a, b, c in zip(first, last, ramp, strict=True)]
        with balls_of(DERIVATIVE_BITS).active():
            return flint.arb_mat([*self.tangent[1 : n - 1], load]) * self.product

    def _ramp_set(self, centre: Middle, moves: bool) -> None:
        super()._ramp_set(centre, moves)
        if self.tangent is not None:
            self.tangent = self._ramped(self.tangent, moves)

    def _spread(self, limits: Limits = NO_LIMITS) -> Spread:
        if self.tangent is not None:
            n = self.chain.n
            assert self.passages is not None
            self.turned = Spread(self.tangent[:n], balls_of(DERIVATIVE_BITS))
            for slider, row in zip(self.fast, self.tangent[n:-1], strict=True):
                self.turned.velocities[slider] = row
            for passage in self.passages:
                self.turned.pass_through(passage)
        return super()._spread(limits)

    def rest(self, flow: Flow) -> None:
        """End the rearrangement; see `Enclosed.rest`."""
        super().rest(flow)
        self.rests += 1
        if self.rests == self.half:
            self.at_half = list(self.forces[1:-1]), self.derivative()
            self.differentiate()

    def _renew_at_rest(self) -> None:
        super()._renew_at_rest()
        self._turn()

    def _renew_in_motion(self) -> None:
        super()._renew_in_motion()
        self._turn()

    def _turn(self) -> None:
        if self.tangent is not None and self.turned is not None:
            speeds = [self.turned.velocities[n] for n in self.fast]
            rows = [*self.turned.forces, *speeds, self.tangent[-1]]
            with balls_of(DERIVATIVE_BITS).active():
                self.tangent, self.product = _orthogonal(rows, self.product)
            self.turned = None


def _orthogonal(rows: list[Row], product: Any) -> tuple[list[Row], Any]:
    """Return ``rows product`` as an orthogonal basis times balls, the least certain part first."""
    factor = flint.arb_mat(rows)
    middles = np.array([[float(x) for x in row] for row in rows])
    if not np.isfinite(middles).all():
        raise Undecided("the derivative of a period is not enclosed")
    doubts = [sum(float(x.rad()) for x in row) for row in product.table()]
    weights = np.array(doubts) + 2.0**-DERIVATIVE_BITS
    order = np.argsort(-np.linalg.norm(middles, axis=0) * weights, kind="stable")
    basis = _matrix(np.linalg.qr(middles[:, order], mode="complete")[0])
    return basis.table(), basis.solve(factor) * product


def _matrix(numbers: NDArray[np.float64]) -> Any:
    return flint.arb_mat(numbers.tolist())


class NearbySimulation(FieldSimulation):
    """A simulation of a set of states; `follow` raises `Undecided` if they part.

    Parameters
    ----------
    chain : Chain
    state : State
        At rest at the end of a cycle, in balls.
    drive : Cycles
    arithmetic : Arithmetic
    """

    kind = Nearby
    mechanics: Nearby

    def __init__(self, chain: Chain, state: State, drive: Cycles, arithmetic: Arithmetic) -> None:
        super().__init__(chain, state, 0, ("events",), arithmetic)
        self.theta_target = -drive.amplitude
