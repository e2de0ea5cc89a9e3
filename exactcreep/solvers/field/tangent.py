"""Follow a whole set of states at rest along one itinerary, with the derivative of the map.

A ramp changes every force in proportion to its rate (`Chain.rates`). A state at the end of a cycle
consists of its *load*, how far a ramp has taken it, and its *shape*, which no ramp changes. Where
all springs expand alike, the shape is the forces of the sliders 2 .. N - 1, and the load is
u = (F_1 - F_N)/2. The forces have a constant sum. A rearrangement begins at a slider with a rate
for every u. So along one itinerary the shape evolves independently, and u changes by an amount that
depends only on the shape.

The derivative is a product over short stretches. Multiplied in balls it would grow by some bits per
event even if the motion contracts. So it is stored as an orthogonal basis without errors times a
matrix of balls, and each stretch multiplies by a nearly triangular matrix (Lohner).
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from fractions import Fraction
from functools import partial
from typing import Any, ClassVar, NamedTuple

import flint
import numpy as np
from numpy.typing import NDArray

from exactcreep.model.chain import Chain
from exactcreep.model.contacts import Itinerary
from exactcreep.motion.arithmetic import Balls, Disturbance, Undecided, balls_of
from exactcreep.motion.first_event import SearchLimit
from exactcreep.motion.modes import Flow
from exactcreep.motion.runaway import NEVER_STOPS
from exactcreep.motion.state_set import StateSet, exponent_of, scaled
from exactcreep.solvers.field.set_integrator import SetIntegrator, middle, radius
from exactcreep.solvers.interface import Start
from exactcreep.watch.limits import OutOfTime

BITS = 128
"""Precision of the product of the derivatives of short stretches."""


class Frame(NamedTuple):
    """Shape and load of the forces of a chain at rest.

    `shape` and `load` (fmpq_mat of n columns) are multiplied by the forces. Each of the sliders
    `inner` has a row of the shape. `outer` are the two others, whose forces fall and rise fastest
    with theta; the forces of a shape alone are equal on both.
    """

    rates: list[Fraction]
    inner: list[int]
    outer: list[int]
    shape: Any
    load: Any

    @classmethod
    def of(cls, chain: Chain) -> Frame:
        n, rates = chain.n, [chain.rates.get(k, Fraction(0)) for k in range(chain.n)]
        falls, rises = rates.index(min(rates)), n - 1 - rates[::-1].index(max(rates))
        apart = rates[rises] - rates[falls]
        load = [Fraction(0)] * n
        if apart:
            load[falls], load[rises] = 1 / apart, -1 / apart
        inner = [k for k in range(n) if k not in (falls, rises)]
        rows = [[(m == k) + rates[k] * part for m, part in enumerate(load)] for k in inner]
        return cls(rates, inner, [falls, rises], _rationals(rows, n), _rationals([load], n))

    def shape_of(self, forces: Iterable[Any]) -> list[Any]:
        """Return the shape of forces, which are balls."""
        shape: list[Any] = (self.shape * _column(forces)).entries()
        return shape

    def load_of(self, forces: Iterable[Any]) -> Any:
        """Return the load of forces, which are balls."""
        return (self.load * _column(forces))[0, 0]


def _column(forces: Iterable[Any]) -> Any:
    return flint.arb_mat([[force.ball() if hasattr(force, "ball") else force] for force in forces])


def _rationals(rows: list[list[Fraction]], columns: int) -> Any:
    numbers = [flint.fmpq(*Fraction(x).as_integer_ratio()) for row in rows for x in row]
    return flint.fmpq_mat(len(rows), columns, numbers)


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

    def __init__(self, start: Start, arithmetic: Balls) -> None:
        super().__init__(start, arithmetic)
        self.frame = Frame.of(start.chain)

    def follow(self, amplitude: Fraction, count: int) -> list[tuple[Itinerary, ...]]:
        """Follow half-cycles from the end of a cycle; return the itineraries in each.

        Raises `Undecided` if the states of the set part.
        """
        halves = []
        try:
            for q in range(count):
                way, half = (-1 if q % 2 else 1), []
                while self.steadily(partial(self.ramp, way, way * amplitude)):
                    events = [event for event in self.rearrangement() if event is not None]
                    half.append(tuple(event.signature for event in events))
                    self.limits.require()
                    if self.runaway:
                        raise Undecided(NEVER_STOPS)
                halves.append(tuple(half))
        except (SearchLimit, OutOfTime, Disturbance) as limit:
            raise Undecided(str(limit)) from None
        return halves

    def begin(self, spread: NDArray[np.float64], load: float) -> None:
        """Begin with all states near the present one.

        The shapes are the middle plus `spread` (ndarray, shape (n - 2, n - 2)) times
        ``[-1, 1]**(n - 2)``; the loads are within `load` of the present one.
        """
        n, inner, frame = self.chain.n, len(spread), self.frame
        rest = self.rest
        noise = [radius(x) for x in (*rest.forces.tolist(), self.l0 * rest.theta)]
        number = self.arithmetic.number
        for numbers in (rest.forces, rest.displacements):
            numbers[:] = [number(middle(x)) for x in numbers.tolist()]
        rest.theta = number(middle(rest.theta))
        rest.tensions = self._tensions(rest.forces)
        widest = flint.arb(float(abs(spread).sum()) + load)
        exponent = max(exponent_of(x) for x in (*noise, widest))
        spread, load = np.ldexp(spread, -exponent), math.ldexp(load, -exponent)
        rows = np.zeros((n + 1, inner + 1 + n + 1))
        rows[frame.inner, :inner] = spread
        rows[frame.outer, :inner] = -spread.sum(axis=0) / 2
        rows[:n, inner] = [-float(rate) * load for rate in frame.rates]
        rows[:, inner + 1 :] = np.diag(scaled(noise, exponent))
        rest.set = StateSet.spanned(rows, exponent=exponent)
        rest.set.errors[0, frame.outer] += n * 2.0**-52 * abs(spread).sum()
        unsure = [rate != float(rate) for rate in frame.rates]
        rest.set.errors[0, unsure] += 2.0**-52 * abs(rows[:n, inner][unsure])
        rest.fresh = False  # the present state is at rest
        self._look_around()
        self.differentiate()

    def differentiate(self) -> None:
        """Begin the derivative anew at the present state."""
        n, frame = self.chain.n, self.frame
        rows = np.zeros((n + 1, n - 1))
        rows[frame.inner, : n - 2] = np.eye(n - 2)
        rows[frame.outer, : n - 2] = -0.5
        rows[:n, n - 2] = [-float(rate) for rate in frame.rates]
        self.tangent = StateSet.spanned(rows)
        self.product = flint.arb_mat(np.eye(n - 1).tolist())

    def derivative(self) -> list[list[Any]]:
        """Return the derivative of shape and load over all states of the set: its rows."""
        with balls_of(BITS).active():
            *forces, ramp = self._rows([])
            shape = (self.frame.shape * flint.arb_mat(forces)).tolist()
            # the load at the same theta
            load = self.frame.load * flint.arb_mat(forces) + flint.arb_mat([ramp])
            rows = flint.arb_mat([*shape, load.entries()]) * self.product
            return rows.tolist()  # type: ignore[no-any-return]

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
            self.at_half = self.frame.shape_of(self.known_forces()), self.derivative()
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
