"""That the laws have a limit of many contacts, a solid; and the numbers of the discussion."""

from __future__ import annotations

import sympy as sp

from derivations import pivots, plateaus, thresholds
from derivations.judges import Judge, proportional, ratio, vanishes, within
from derivations.model import Model, g, k, m, solved
from derivations.notation import (
    CAPTIONS,
    SOLID,
    Expression,
    Formula,
    L,
    N,
    Y,
    amplitude,
    c,
    creeps,
    i,
    kappa,
    l0,
    mu_d,
    n,
    rho,
    s,
    slope_margin,
    star,
    symbol,
    tan,
)
from derivations.proof import Proof, chapter
from derivations.scaling import ROD, section

R, depth, P, D = (symbol(name) for name in ["R", "delta", "P", "D"])


def _to_order(quantity: Expression, exact: Expression) -> Judge:
    """Judge what is proportional to N, and differs from an exact form by a relative 1/N."""

    def judge(formula: Formula) -> bool:
        right = formula.right
        close = sp.limit(right / exact, N, sp.oo) == 1
        return formula.left == quantity and close and not sp.diff(right / N, N)

    return judge


@chapter(
    "Continuum and numerical estimates", "N >> 1", "k = N Y S/L", "L = N l_0", "g = 9.81 m/s^2"
)
def derive(p: Proof, model: Model) -> None:
    """Show the chain that stands for a solid, its velocity and threshold, and the bead column."""
    _solid(p, model)
    _beads(p, model)


def _solid(p: Proof, model: Model) -> None:
    """Show the velocity and the threshold of a solid."""
    length = sp.summation(l0, (n, 1, N - 1))
    p.alone("chain_length", _to_order(L, length), {L: length})
    exact = (N - 1) * Y * section / L
    p.alone("solid_stiffness", _to_order(k, exact), {k: exact})
    unit = p.show(
        "solid of section S: k = N Y S/L, m = rho S L/N; the unit of length, g m/k, is",
        (g * m / k).subs(ROD),
        g * rho * L**2 / (N**2 * Y),
    )
    spring = p.show(
        "natural length of a spring, L/N, in that unit: l_0 =",
        L / N / unit,
        N * Y / (rho * g * L),
    )
    edge = pivots.derive(model).sliding_edge
    middle = solved((edge + edge.subs(i, i - 1)) / 2 - tan, i)
    steps = p.show(
        "in the middle of plateau i's range of slopes N + 3 - 2i =",
        (N + 3 - 2 * middle).subs(tan, s / c),
        N * s / (c * mu_d),
    )
    plateau = plateaus.derive(model)
    per_step = sp.cancel(plateau.finite / (N + 3 - 2 * i))
    growth = sp.expand(per_step * (steps + symbol("rest")))
    p.alone("growth_with_size", holds=lambda: sp.degree(growth, N) == 2)
    law = per_step * steps * unit
    bare = sp.cancel(plateau.velocity / (N + 3 - 2 * i)) * steps * unit
    solid = L * s / (c * mu_d)
    least = g * rho * L / (2 * Y) * slope_margin
    bare = p.show("for a solid Eq. (vitesse) becomes", bare.subs(l0, spring), solid * amplitude)
    velocity = p.show(
        "and Eq. (vitesse_seuil): tau_th v =",
        law.subs(l0, spring),
        solid * (amplitude - least),
        "velocity",
    )
    p.entry("vitessecontinue", creeps(velocity))
    p.entry("continuum_source", holds=not vanishes(velocity - bare), lines=2)
    p.show("which no longer knows N", sp.diff(velocity, N), 0)
    p.alone("independent_of_contacts", holds=vanishes(sp.diff(velocity, N)))
    least = p.show("threshold: A* =", thresholds.derive(model).sliding.subs(l0, spring), least)
    p.entry("delta_T_star", {symbol("Delta_T_star"): least / kappa})

    paper = SOLID | {name: CAPTIONS[name] for name in (mu_d, c, s)}  # whatever N
    amount, most = least.subs(paper), least.subs({s: 0, c: 1}).subs(paper)
    p.checked(
        "the paper's solid (1 cm, 100 GPa, 1e4 kg/m**3) at the captions' angle needs 1.2e-9, "
        "no solid with mu_d = 1/2 more than 2.5e-9",
        lambda: 1.18e-9 < amount < 1.2e-9 and 2.4e-9 < most < 2.5e-9,
        "floating point",
    )
    p.alone("solid_dilation", within(amount, 1.5))
    p.alone("solid_temperature", within(amount / 1e-5 * 1e3, 1.5, "Delta_T"))


def _beads(p: Proof, model: Model) -> None:
    """Show the scale of the threshold of a column of beads."""
    p.alone("janssen_pressure", proportional({P: rho * g * D}))
    p.alone("grain_number", ratio({N: D / (2 * R)}, lambda quotient: quotient == 1))
    hertz = p.show(
        "beads: Hertz' force Y R**(1/2) delta**(3/2), up to a number; stiffness",
        sp.diff(Y * sp.sqrt(R) * depth ** sp.Rational(3, 2), depth),
        sp.Rational(3, 2) * Y * sp.sqrt(R * depth),
    )
    p.entry("hertz_stiffness", proportional({k: hertz}))
    pressed = p.show(
        "pressed by P on its section: delta =",
        solved(k * depth - P * R**2, depth),
        P * R**2 / k,
    )
    p.entry("grain_force", proportional({depth: pressed}))
    cube = (2 * hertz.subs(depth, pressed) / 3) ** 2 * k  # k**3, up to a number
    bead = p.show(
        "with P = rho g D the stiffness is, up to a number,",
        sp.powsimp(cube ** sp.Rational(1, 3), force=True).subs(P, rho * g * D),
        (R**3 * rho * g * D * Y**2) ** sp.Rational(1, 3),
    )
    p.entry("grain_stiffness", proportional({k: bead}))
    column = p.show(
        "N = D/2R, l_0 = 2R: N m g/(2 k l_0) is, up to a number and whatever R,",
        (D / (2 * R)) * (rho * R**3 * g / bead) / (2 * 2 * R),
        (rho * g * D / Y) ** sp.Rational(2, 3) / 8,
    )
    glass = (8 * column).subs({rho: 2e3, g: 9.81, D: 0.01, Y: 2e10})
    p.entry("column_dilation", within(glass, 1.2, "A_theta_star"))
    p.entry("column_temperature", within(glass / 3e-6, 2))
    p.show(
        "... times mu_d c - s, for a vertical column",
        (thresholds.derive(model).sliding * 2 * l0 / N).subs({c: 0, s: 1}),
        -1,
    )
    p.entry("column_threshold", proportional({star: column}), lines=2)
