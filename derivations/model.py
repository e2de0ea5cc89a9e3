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
NONE, WHOLE = sp.Integer(0), sp.Integer(1)
t, X = sp.Symbol("t", nonnegative=True), symbol("X")
"""Time since a slip began; how far the slider has moved."""
a0, w = sp.symbols("a_0 omega", positive=True)
"""What drives a slip at its start; the root of the number of springs that resist it."""


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
    inertia : Expression
        Share of a slipping slider's resistance to its driving force that is inertia; the rest is
        resistance to its velocity.
    phase : Expression
        What a slider that follows a ramp feels beyond sliding friction, in units of static less
        sliding friction. Zero if it slides continuously; one that sticks and slips passes through
        many values.
    acceleration : Expression
        The acceleration of sliders that follow a ramp.
    cycle : tuple of two Expressions
        The values between which theta runs, slowly, in half-cycles of the duration tau_th.
    """

    elastic: Expression = k * stretch**2 / 2
    gravity: Expression = -m * g * s * place
    held: Expression = mu_s * m * g * c
    sliding: Expression = -mu_d * m * g * c * way
    natural: tuple[Expression, Expression] = (l0 * (1 + theta), l0 * (1 + theta))
    ends: tuple[Expression, Expression] = (NONE, NONE)
    redraw: Expression = FRESH
    inertia: Expression = WHOLE
    phase: Expression = NONE
    acceleration: Expression = NONE
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

    def driven(self, slider: str) -> Expression:
        """Return the direction in which a dilation drives that slider: +1 downhill, -1 uphill."""
        return sp.sign(self.push(slider))

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
    def moved(self, acceleration: Expression) -> Expression:
        """Return the path from rest of a slider with a driving force in its path X and in t."""
        path = sp.Function("path")
        resisted = self.inertia * path(t).diff(t, 2) + (1 - self.inertia) * path(t).diff(t)
        start = {path(0): 0}
        if self.inertia:
            start[path(t).diff(t).subs(t, 0)] = 0
        return sp.dsolve(resisted - acceleration.subs(X, path(t)), path(t), ics=start).rhs

    def slip(self, first: Expression, rate: Expression) -> Expression:
        """Return the length of a slip that begins with a driving force and loses rate**2 X of it.

        With inertia it stops after half a period; without, it approaches the balance of forces.
        """
        path = self.moved(a0 - w**2 * X)
        length = path.subs(t, sp.pi / w) if self.inertia else sp.limit(path, t, sp.oo)
        return sp.expand(length).subs({a0: first, w: rate})

    @cache  # noqa: B019
    def carried(self) -> Expression:
        """Return the mean load of a slider that a slow ramp drives through slip after slip.

        The force on it rises evenly from the remainder after a slip to the static threshold.
        """
        springs = sp.Symbol("springs", positive=True)
        held = self.threshold()
        drop = springs * self.slip(held + self.friction(1), sp.sqrt(springs))
        return sp.expand(held - drop / 2)

    def following(self, direction: Expression) -> Expression:
        """Return the force on a slider that follows a ramp in a direction."""
        beyond = self.phase * (self.threshold() + self.friction(1)) + self.acceleration
        return direction * (self.carried() + beyond)

    @cache  # noqa: B019
    def tension(self, spring: Expression, side: int, direction: Expression) -> Expression:
        """Return the tension of a spring if all sliders on one side of it follow a ramp.

        `side` 0: those above, which end in T_0; 1: those below, which end in T_N. Each of them
        has the same force, so tension changes from spring to spring by the same step.
        """
        slider = sp.Symbol("slider", integer=True)
        balance = sp.Eq(self.force(slider), self.following(direction))
        step = sp.expand(solved(balance, T(slider)) - T(slider - 1))
        if step.has(slider) or step.has(T):
            raise ValueError(f"from spring to spring tension changes by different steps: {step}")
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
    "slips without overshoot": replace(MODEL, inertia=NONE),
    "sliders that stick and slip": replace(MODEL, phase=symbol("phase")),
    "fronts that accelerate": replace(MODEL, acceleration=symbol("acceleration")),
}
"""The model with one premise changed, by the name of the change."""

ASSUMED: dict[str, str] = {
    "springs obey Hooke's law": "",
    "the stiffness does not depend on T": "",
    "theta far below one": "",
    "theta is frozen while sliders move": "",
    "theta moves monotonically, slowly, between targets": "",
    "no start, stop or reversal inside": "",
    "the normal force is the weight's": "",
    "mu_d is constant": "",
    "no mu_s below mu_d": "",
    "one value of mu_s": "",
    "no disorder": "",
    "disorder": "",
    "independent Gaussian coefficients": "",
    "mean over the disorder, or over mirror-symmetric starts": "",
    "mean over the phase r0": "",
    "relaxed chain": "",
    "the neighbours stay at rest": "",
    "the slip starts at the static threshold": "",
    "slips are as in chapter slip": "",
    "the neighbour rests or moves at a constant velocity": "",
    "the first slider stays at rest": "",
    "the chain moves as a whole": "",
    "tan(alpha) between zero and mu_d": "",
    "tan(alpha) not below zero": "",
    "tan(alpha) inside plateau i": "",
    "tan(alpha) far from the edges of a plateau": "",
    "continuous sliding": "sliders that stick and slip",
    "sliding limit: mu_s tends to mu_d": "sliders that stick and slip",
    "a mean over many slips": "",
    "no inertia": "fronts that accelerate",
    "large amplitude: all sliders but the pivot move": "",
    "amplitude above the threshold": "",
    "slider i - 1 is the pivot": "",
    "a dilation and a contraction beyond the transient": "",
    "the front has reached slider i - 2": "",
    "sliders i - 1 and i rest meanwhile": "",
    "the pull is at no edge of the pivots": "",
    "the whole chain is set in motion": "",
    "long chains": "",
    "cycles": "",
    "two sliders or more": "",
    "three sliders or more": "",
    "four sliders or more": "",
    "only the ends slip": "",
    "independent Gaussian targets": "",
    "independent targets of a continuous law": "",
    "sliding limit, or two sliders averaged over the phase": "sliders that stick and slip",
    "the continuum of Eq. 25": "",
    "no elasticity": "",
    "a rod cut into equal springs": "",
    "sound in a rod": "",
    "one grain per diameter": "",
    "grains of the length of a spring": "",
    "gravity of the Earth": "",
    "mu_d c - s of order one": "",
    "free of stress at the start of each phase": "",
    "each line says what it assumes": "",
}
"""All assumptions of chapters and entries, and the changed premise that removes each of them."""
