"""That the laws have a limit of many contacts, a solid; and the numbers of the discussion."""

from __future__ import annotations

import sympy as sp

from derivations import pivots, plateaus, thresholds
from derivations.judges import Judge, Within, proportional, ratio, vanishes
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
from derivations.proof import Proof, chapter, worded
from derivations.scaling import ORDER, ROD, section

R, depth, P, D = (symbol(name) for name in ["R", "delta", "P", "D"])


GLASS = {rho: 2e3, g: 9.81, D: 0.01, Y: 2e10}
"""The paper's column of glass beads, in SI units."""
KAPPA, BOROSILICATE, SODA_LIME = 3e-6, 3.3e-6, 9e-6
"""Thermal expansion per kelvin: the paper's glass, and two glasses (handbooks)."""


def _to_order(quantity: Expression, exact: Expression) -> Judge:
    """Judge a law that is proportional to N and differs from the exact form by a relative 1/N."""

    def judge(formula: Formula) -> bool:
        right = formula.right
        close = sp.limit(right / exact, N, sp.oo) == 1
        return formula.left == quantity and close and not sp.diff(right / N, N)

    return judge


@chapter(
    "Continuum and numerical estimates",
    "sliding limit: mu_s tends to mu_d",
    "long chains",
    "a rod cut into equal springs",
    "grains of the length of a spring",
    "gravity of the Earth",
)
def derive(p: Proof, model: Model) -> None:
    """Show the chain that stands for a solid, its velocity and threshold, and the bead column."""
    _solid(p, model)
    _beads(p, model)


def _solid(p: Proof, model: Model) -> None:
    """Show the velocity and the threshold of a solid."""
    length = sp.summation(l0, (n, 1, N - 1))
    p.alone("chain_length", _to_order(L, length), {L: length}, lacks=sp.factor(1 - length / N / l0))
    exact = (N - 1) * Y * section / L
    lacks = sp.factor(1 - exact / ROD[k])
    p.alone("solid_stiffness", _to_order(k, exact), {k: exact}, lacks=lacks, springs=N - 1)
    unit = p.show(
        f"solid of section S: k = {ROD[k]}, m = {ROD[m]}; the unit of length, g m over k, is",
        (g * m / k).subs(ROD),
        g * rho * L**2 / (N**2 * Y),
    )
    spring = p.show(
        "natural length of a spring, an N-th of L, in that unit: l_0 =",
        L / N / unit,
        N * Y / (rho * g * L),
    )
    edge = pivots.derive(model).sliding_edge
    plateau = plateaus.derive(model)
    number = sp.cancel(plateau.cycle / (2 * l0 * amplitude))
    middle = solved((edge + edge.subs(i, i - 1)) / 2 - tan, i)
    steps = p.show(
        f"in the middle of plateau i's range of slopes {number} =",
        number.subs(i, middle).subs(tan, s / c),
        N * s / (c * mu_d),
    )
    per_step = sp.cancel(plateau.finite / number)
    growth = p.show(
        "so at a fixed amplitude the velocity grows with N at the rate",
        sp.diff(per_step * steps, N),
        (l0 * amplitude - N * slope_margin) * s / (c * mu_d),
    )
    small = sp.cancel(growth).subs(N, 0)
    downhill = small.subs(s, sp.Symbol("weight", positive=True))
    p.entry("growth_with_size", holds=downhill.is_positive, lacks=sp.factor(growth / small - 1))
    off = p.show(
        "... and at an edge it is off by a share of",
        (number.subs(i, solved(edge - tan, i)).subs(tan, s / c) - steps) / steps,
        c * mu_d / (N * s),
    )
    law = per_step * steps * unit
    bare = sp.cancel(plateau.velocity / (N + 3 - 2 * i)) * steps * unit
    solid = L * s / (c * mu_d)
    least = g * rho * L / (2 * Y) * slope_margin
    bare = p.show("for a solid Eq. 20 becomes", bare.subs(l0, spring), solid * amplitude)
    velocity = p.show(
        "and Eq. 23: tau_th v =",
        law.subs(l0, spring),
        solid * (amplitude - least),
        "velocity",
    )
    creeping = creeps(velocity)
    spacing = sp.factor(1 - length / N / l0)
    p.entry("vitessecontinue", creeping, lines=3, off=off, spacing=spacing)
    p.entry(
        "continuum_source",
        corrected=creeping,
        holds=not vanishes(velocity - bare),
        lines=2,
        plain=plateau.velocity.subs(CAPTIONS),
        finite=plateau.finite.subs(CAPTIONS),
    )
    p.show("which no longer knows N", sp.diff(velocity, N), 0)
    p.entry("independent_of_contacts", off=off)
    chain = thresholds.derive(model)
    least = p.show("threshold: A* =", chain.sliding.subs(l0, spring), least)
    beside = sp.factor(chain.threshold / chain.sliding - 1)
    p.entry("delta_T_star", {symbol("Delta_T_star"): least / kappa}, lacks=beside)
    p.show("which does not know N, either", sp.diff(least, N), 0)
    p.entry("stability_of_size", lacks=beside)

    paper = SOLID | {name: CAPTIONS[name] for name in (mu_d, c, s)}  # for any N
    amount, scale = least.subs(paper), (least / slope_margin).subs(paper)
    most = least.subs({s: 0, c: 1}).subs(paper)
    p.checked(
        f"the paper's solid at the captions' angle needs {worded(amount, '.2g')}, on no slope more "
        f"than {worded(most, '.2g')}",
        lambda: amount < most and sp.diff(least, s).is_negative and sp.diff(least, c).is_positive,
        f"{SOLID[L]} m, {worded(SOLID[Y], '.0e')} Pa, {SOLID[rho]} kg per cubic metre, mu_d = "
        f"{CAPTIONS[mu_d]}, in floating point",
    )
    stated, kelvin = sp.Rational(1, 10**8), 1e-3  # as the paper has them
    per_kelvin = stated / kelvin
    p.entry(
        "solid_dilation",
        Within(amount, ORDER),
        factor=stated / amount,
        least_factor=stated / most,
        scale=scale,
        margin=slope_margin.subs(CAPTIONS),
        amount=amount,
    )
    p.entry(
        "solid_temperature",
        Within(amount / per_kelvin * 1e3, ORDER, "Delta_T"),
        factor=stated / amount,
        amount=amount,
        per_kelvin=per_kelvin,
        milli=amount / per_kelvin * 1e3,
    )


def _beads(p: Proof, model: Model) -> None:
    """Show the scale of the threshold of a column of beads."""
    p.alone("janssen_pressure", proportional({P: rho * g * D}))
    p.alone("grain_number", ratio({N: D / (2 * R)}, lambda quotient: quotient == 1))
    force = Y * sp.sqrt(R) * depth ** sp.Rational(3, 2)
    hertz = p.show(
        f"beads: Hertz' force {force}, up to a number; stiffness",
        sp.diff(force, depth),
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
    weight = rho * g * D
    bead = p.show(
        f"with P = {weight} the stiffness is, up to a number,",
        sp.powsimp(cube ** sp.Rational(1, 3), force=True).subs(P, weight),
        (R**3 * rho * g * D * Y**2) ** sp.Rational(1, 3),
    )
    p.entry("grain_stiffness", proportional({k: bead}))
    grains, grain, mass = D / (2 * R), 2 * R, rho * R**3
    column = p.show(
        f"N = {grains}, l_0 = {grain}, m = {mass}: the scale of A* is, up to a number and whatever "
        "R,",
        grains * (mass * g / bead) / (2 * grain),
        (rho * g * D / Y) ** sp.Rational(2, 3) / 8,
    )
    p.show("it does not depend on the size of the grains", sp.diff(column, R), 0)
    p.entry("independent_of_grains", lines=2)
    upright = p.show(
        "... times what the weight leaves of friction, for a vertical column",
        (thresholds.derive(model).sliding * 2 * l0 / N).subs({c: 0, s: 1}),
        -1,
    )
    p.entry("column_threshold", proportional({star: column}), lines=3, upright=upright)
    scale = (rho * g * D / Y) ** sp.Rational(2, 3)  # the formula as it is printed
    glass = scale.subs(GLASS)
    kelvin = glass / KAPPA
    p.checked(
        f"for glass beads that formula gives {worded(glass, '.2g')}",
        lambda: vanishes(sp.powsimp(column / scale, force=True) - sp.Rational(1, 8)),
        "in floating point",
    )
    p.entry(
        "column_dilation",
        Within(glass, ORDER, "A_theta_star"),
        glass=glass,
        factor=1 / (column / scale * slope_margin.subs(CAPTIONS)).subs({R: 1, **GLASS}),
        margin=slope_margin,
    )
    p.alone("glass_expansion", Within(BOROSILICATE, 1.2, "kappa"), soda=SODA_LIME)
    p.entry("column_temperature", Within(kelvin, ORDER), glass=glass, kelvin=kelvin)
    p.alone("experimental_temperature", Within(kelvin, 2), kelvin=kelvin, factor=3 / kelvin)
