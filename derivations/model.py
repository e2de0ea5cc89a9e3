"""The model: springs, weight, Coulomb's friction, temperature and ends, stated in this one place.

Every derivation takes its forces, friction, tensions and thresholds from a `Model`, which is a
value: to ask what a premise is good for, change it (`PREMISES`) and derive again.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import sympy as sp

from derivations.notation import Expression, N, amplitude, c, f, l0, mu_d, mu_s, s, symbol, theta

k, m, g, tau_dyn = (symbol(name) for name in ["k", "m", "g", "tau_dyn"])
stretch, place, way = symbol("stretch"), symbol("place"), symbol("S")
"""Length of a spring beyond its natural one; position of a slider; its direction, +1 downhill."""
before, here, after = sp.symbols("x_before x_here x_after", real=True)
"""Positions of a slider and its two neighbours."""
T, mu = sp.Function("T"), sp.Function("mu_s")
"""Tension of spring n; static coefficient of slider n."""
FRESH = sp.Symbol("draw", integer=True, nonnegative=True)
"""How often a slider has come to rest: the number of its present static coefficient."""


@dataclass(frozen=True)
class Model:
    """What the paper's section II assumes; energies and forces in their own units.

    There are few models, and each lives as long as the program: it keeps what it has derived.

    Attributes
    ----------
    elastic : Expression
        Energy of one spring.
    gravity : Expression
        Potential energy of one slider at `place` (the x axis points downhill).
    held : Expression
        The largest force that static friction holds.
    sliding : Expression
        Friction on a slider that moves in the direction S.
    natural : tuple of two Expressions
        Natural length of a spring, as the slider above and the slider below it feel it.
    ends : tuple of two Expressions
        What pulls at slider 1 and at slider N from beyond the chain.
    redraw : Expression
        The number of the static coefficient that a slider has after its `draw`-th stop.
    cycle : tuple of two Expressions
        The values between which theta runs, slowly, in half-cycles of the duration tau_th.
    """

    elastic: Expression = k * stretch**2 / 2
    gravity: Expression = -m * g * s * place
    held: Expression = mu_s * m * g * c
    sliding: Expression = -mu_d * m * g * c * way
    natural: tuple[Expression, Expression] = (l0 * (1 + theta), l0 * (1 + theta))
    ends: tuple[Expression, Expression] = (sp.Integer(0), sp.Integer(0))
    redraw: Expression = FRESH
    cycle: tuple[Expression, Expression] = (-amplitude, amplitude)

    @property
    def swing(self) -> Expression:
        """Change of theta in a dilation of a cycle."""
        return self.cycle[1] - self.cycle[0]

    def pull(self, to: int, near: Expression, far: Expression) -> Expression:
        """Return the force of a spring on one of its sliders: minus the derivative of its energy.

        `to` is +1 if the spring leads to the lower neighbour, -1 if to the upper one.
        """
        length = self.natural[0] if to == 1 else self.natural[1]
        return -sp.diff(self.elastic.subs(stretch, to * (far - near) - length), near)

    @cache  # noqa: B019
    def scaled(self, force: Expression) -> Expression:
        """Return a force in m g, with lengths in g tau_dyn**2 and k = m/tau_dyn**2."""
        lengths = {length: g * tau_dyn**2 * length for length in (before, here, after, l0, place)}
        force = force.subs(lengths, simultaneous=True).subs(k, m / tau_dyn**2)
        return sp.expand(force / (m * g))

    @cache  # noqa: B019
    def at(self, slider: str) -> Expression:
        """Return the non-frictional force on the `first`, an `inner` or the `last` slider."""
        above = self.ends[0] if slider == "first" else self.pull(-1, here, before)
        below = self.ends[1] if slider == "last" else self.pull(1, here, after)
        return self.scaled(above + below + self.weight)

    def push(self, slider: str) -> Expression:
        """Return the rate at which a rise of l0 theta changes that force."""
        return sp.diff(self.at(slider), theta) / l0

    @cache  # noqa: B019
    def between(self, above: Expression, below: Expression) -> Expression:
        """Return the force on a slider between springs of the tensions `above` and `below` it."""
        spring = l0 * (1 + theta)
        around = {before: here - spring - above, after: here + spring + below}
        return sp.expand(self.at("inner").subs(around, simultaneous=True))

    @cache  # noqa: B019
    def force(self, slider: Expression) -> Expression:
        """Return the force on a slider in the tensions T_n = x_{n+1} - x_n - (1 + theta) l0."""
        ends = {T(sp.Integer(0)): self.end(0), T(N): self.end(1)}
        return self.between(T(slider - 1), T(slider)).subs(ends)

    def pair(self) -> tuple[Expression, Expression, Expression]:
        """Return the forces on two sliders, and the tension of their spring."""
        first, last = self.force(sp.Integer(1)), self.force(sp.Integer(2))
        return first, last.subs(T(2), self.end(1)), T(1)

    def end(self, side: int) -> Expression:
        """Return the tension beyond an end of the chain (side 0: T_0, side 1: T_N)."""
        return self.scaled(self.ends[1] if side else -self.ends[0])

    def net(self, slider: Expression) -> Expression:
        """Return the force on a slider in the words of the paper: both neighbours and weight."""
        return f(slider - 1, slider) + f(slider + 1, slider) + self.weight

    @property
    def weight(self) -> Expression:
        """The weight's component along the incline, in its own units."""
        return -sp.diff(self.gravity, place)

    def friction(self, direction: Expression) -> Expression:
        """Return the friction on a slider that moves in a direction (+1 downhill), in m g."""
        return self.scaled(self.sliding.subs(way, direction))

    def threshold(self, coefficient: Expression = mu_s) -> Expression:
        """Return the largest force that holds a slider of the given static coefficient, in m g."""
        return self.scaled(self.held).subs(mu_s, coefficient)

    @cache  # noqa: B019
    def tension(self, spring: Expression, side: int, direction: Expression) -> Expression:
        """Return the tension of a spring if all sliders on one side of it slide, without inertia.

        `side` 0: those above, which end in T_0; 1: those below, which end in T_N. Each of them
        balances force and friction, so tension changes from spring to spring by the same step.
        """
        slider = sp.Symbol("slider", integer=True)
        balance = sp.Eq(self.force(slider) + self.friction(direction), 0)
        step = solved(balance, T(slider)) - T(slider - 1)
        return sp.expand(self.end(side) + (spring - (N if side else 0)) * step)


@cache
def solved(equation: Expression, unknown: Expression) -> Expression:
    """Return the one solution of an equation; a new symbol where there is not exactly one."""
    difference = equation.lhs - equation.rhs if isinstance(equation, sp.Eq) else equation
    expanded = sp.expand(difference)
    slope = sp.diff(expanded, unknown)
    if slope != 0 and not slope.has(unknown):
        return sp.cancel(-expanded.subs(unknown, 0) / slope)
    solutions = sp.solve(difference, unknown)
    return solutions[0] if len(solutions) == 1 else sp.Symbol("no_single_solution")


MODEL = Model()

PREMISES: dict[str, Model] = {
    "gravity x 7": replace(MODEL, gravity=7 * MODEL.gravity),
    "friction x 2": replace(MODEL, sliding=2 * MODEL.sliding),
    "springs that push": replace(MODEL, elastic=-MODEL.elastic),
    "ends that pull": replace(MODEL, ends=(m * g, 2 * m * g)),
    "theta at one end": replace(MODEL, natural=(l0 * (1 + theta), l0)),
    "coefficients kept": replace(MODEL, redraw=sp.Integer(0)),
    "mu_s in motion": replace(MODEL, sliding=MODEL.sliding.subs(mu_d, mu_s)),
}
"""The model with one premise changed, by what is changed."""
