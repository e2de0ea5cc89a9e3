"""That the laws have a limit of many contacts, a solid; and the numbers of the discussion."""

from __future__ import annotations

import sympy as sp

from derivations import pivots, plateaus, thresholds
from derivations.entry import Backed, Backing, Lines, entries_of, stands
from derivations.judges import Judge, follows, proportional, vanishes, within
from derivations.model import Model, g, k, solved
from derivations.notation import (
    Expression,
    Formula,
    N,
    amplitude,
    c,
    i,
    l0,
    mu_d,
    n,
    s,
    slope_margin,
    symbol,
)
from derivations.proof import Proof, chapter

L, Y, rho, kappa = (symbol(name) for name in ["L", "Y", "rho", "kappa"])
R, depth, P, D = (symbol(name) for name in ["R", "delta", "P", "D"])
section, tau_th = symbol("S"), symbol("tau_th")


@chapter(
    "Continuum and numerical estimates", "N >> 1", "k = N Y S/L", "L = N l_0", "g = 9.81 m/s^2"
)
def derive(p: Proof, model: Model) -> None:
    """Show the chain that stands for a solid, its velocity and threshold, and the bead column."""
    mass, stiffness = rho * section * L / N, N * Y * section / L
    unit = p.show(
        "solid of section S: k = N Y S/L, m = rho S L/N; the unit of length, g m/k, is",
        g * mass / stiffness,
        g * rho * L**2 / (N**2 * Y),
        "unit",
    )
    spring = p.show(
        "natural length of a spring, L/N, in that unit: l_0 =",
        L / N / unit,
        N * Y / (rho * g * L),
        "spring",
    )
    exact = g * mass / ((N - 1) * Y * section / L)
    p.show(
        "N - 1 springs of the length L/(N-1) have the same l_0, hence the same threshold",
        L / (N - 1) / exact,
        spring,
    )
    p.show("... and a velocity that is larger by the factor", exact / unit, N / (N - 1))
    edge, slope = pivots.derive(model).sliding_edge, symbol("t")
    middle = solved((edge + edge.subs(i, i - 1)) / 2 - slope, i)
    steps = p.show(
        "in the middle of plateau i's range of slopes N + 3 - 2i =",
        (N + 3 - 2 * middle).subs(slope, s / c),
        N * s / (c * mu_d),
        "steps",
    )
    plateau = plateaus.derive(model)
    law, bare = (
        sp.cancel(each / (N + 3 - 2 * i)) * steps * unit
        for each in (plateau.finite, plateau.velocity * tau_th)
    )
    solid = L * s / (c * mu_d)
    least = g * rho * L / (2 * Y) * slope_margin
    velocity = p.show(
        "so Eq. (vitesse_seuil) becomes, for a solid, tau_th v =",
        law.subs(l0, spring),
        solid * (amplitude - least),
        "velocity",
    )
    p.show("while Eq. (vitesse) becomes", bare.subs(l0, spring), solid * amplitude, "bare")
    p.show("which no longer knows N", sp.diff(velocity, N), 0)
    p.show("threshold: A* =", thresholds.derive(model).sliding.subs(l0, spring), least, "least")

    p.part()
    hertz = p.show(
        "beads: Hertz' force Y R**(1/2) delta**(3/2), up to a number; stiffness",
        sp.diff(Y * sp.sqrt(R) * depth ** sp.Rational(3, 2), depth),
        sp.Rational(3, 2) * Y * sp.sqrt(R * depth),
        "hertz",
    )
    pressed = p.show(
        "pressed by P on its section: delta =",
        solved(k * depth - P * R**2, depth),
        P * R**2 / k,
        "pressed",
    )
    cube = (2 * hertz.subs(depth, pressed) / 3) ** 2 * k  # k**3, up to a number
    bead = p.show(
        "with P = rho g D the stiffness is, up to a number,",
        sp.powsimp(cube ** sp.Rational(1, 3), force=True).subs(P, rho * g * D),
        (R**3 * rho * g * D * Y**2) ** sp.Rational(1, 3),
        "bead",
    )
    column = (D / (2 * R)) * (rho * R**3 * g / bead) / (2 * 2 * R)
    p.show(
        "N = D/2R, l_0 = 2R: N m g/(2 k l_0) is, up to a number and whatever R,",
        column,
        (rho * g * D / Y) ** sp.Rational(2, 3) / 8,
        "column",
    )
    p.show(
        "... times mu_d c - s, for a vertical column",
        (thresholds.derive(model).sliding * 2 * l0 / N).subs({c: 0, s: 1}),
        -1,
        "vertical",
    )
    p.checked(
        "the paper's solid (1 cm, 100 GPa, 1e4 kg/m**3) at the captions' angle needs 1.2e-9, "
        "no solid with mu_d = 1/2 more than 2.5e-9",
        lambda: 1.18e-9 < _solid(p) < 1.2e-9 and 2.4e-9 < _solid(p, "0") < 2.5e-9,
        "floating point",
        "solid_number",
    )


def _solid(r: Proof | Lines, slope: str = "1/4") -> float:
    """Return the threshold of the paper's solid at mu_d = 1/2 and a slope."""
    tan = sp.Rational(slope)
    cosine = 1 / sp.sqrt(1 + tan**2)
    numbers = {g: 9.81, rho: 1e4, L: 0.01, Y: 1e11, mu_d: sp.Rational(1, 2)}
    return float(r.least.subs(numbers).subs({s: tan * cosine, c: cosine}))


def _glass(r: Lines) -> float:
    """Return the scale of the paper's column: 2e3 kg/m**3, 1 cm, 20 GPa."""
    return float((8 * r.column).subs({rho: 2e3, g: 9.81, D: 0.01, Y: 2e10}))


def _named(name: str, judge: Judge) -> Judge:
    return lambda formula: formula.left == symbol(name) and judge(formula)


def _to_order(quantity: Expression, exact: Expression) -> Backing:
    """Return judges of what differs from an exact form by a relative 1/N."""

    def close(formula: Formula) -> bool:
        right = formula.right
        return (
            formula.left == quantity
            and vanishes(sp.limit(right / exact, N, sp.oo) - 1)
            and vanishes(sp.diff(right, N, 2))
            and vanishes(right.subs(N, 0))
        )

    return Backing(close, follows({quantity: exact}))


def _grains(formula: Formula) -> bool:
    bound = formula.bound({N: D / (2 * R)})
    return formula.relations == ("~",) and vanishes(bound.left - bound.right)


def _linear_then_quadratic(r: Lines) -> bool:
    """Return whether the law is linear in N, with a quadratic term that lowers it."""
    steps = r.alone("steps") + symbol("rest")
    finite = plateaus.derive(r.model).finite
    law = sp.expand(steps * sp.cancel(finite / (N + 3 - 2 * i)))
    margin = slope_margin.subs(mu_d, (s + sp.Symbol("rest", positive=True)) / c)
    curve = sp.diff(law, N, 2).subs(mu_d, (s + sp.Symbol("more", positive=True)) / c)
    return vanishes(sp.diff(law, N, 3)) and not vanishes(curve) and margin.is_positive


LINES: dict[str, Backed | None] = {
    "continuum_source": lambda r: not vanishes(r.velocity - r.bare),
    "solid_stiffness": lambda r: _to_order(k, Y * section / (L / (N - 1))),
    "vitessecontinue": lambda r: follows({symbol("v_G"): r.velocity / tau_th}),
    "independent_of_contacts": lambda r: vanishes(sp.diff(r.alone("velocity"), N)),
    "delta_T_star": lambda r: follows({symbol("Delta_T_star"): r.least / kappa}),
    "solid_dilation": lambda r: within(_solid(r), 1.5),
    "solid_temperature": lambda r: _named("Delta_T", within(_solid(r) / 1e-5 * 1e3, 1.5)),
    "chain_length": lambda r: _to_order(L, sp.summation(l0, (n, 1, N - 1))),
    "growth_with_size": _linear_then_quadratic,
    "position_decreases": lambda r: bool(
        sp.expand(plateaus.derive(r.model).cycle.subs(i, (N + 2) / 2)).is_positive
    ),
    "hertz_stiffness": lambda r: proportional({k: r.hertz}),
    "janssen_pressure": lambda r: proportional({P: rho * g * D}),
    "grain_force": lambda r: proportional({depth: r.pressed}),
    "grain_stiffness": lambda r: proportional({k: r.bead}),
    "grain_number": lambda r: _grains,
    "column_threshold": lambda r: Backing(
        proportional({symbol("A_theta_star"): r.column}), evidence=stands(r.vertical)
    ),
    "column_dilation": lambda r: _named("A_theta_star", within(_glass(r), 1.2)),
    "column_temperature": lambda r: within(_glass(r) / 3e-6, 2),
    "critical_velocity": lambda r: vanishes(
        plateaus.derive(r.model).finite.subs(amplitude, thresholds.derive(r.model).sliding)
    ),
}
ENTRIES = entries_of("continuum", derive, LINES)
