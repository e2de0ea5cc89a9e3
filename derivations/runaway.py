"""That a chain can slide for ever only on slopes of mu_d or more, and what proves that it does."""

from __future__ import annotations

import sympy as sp

from derivations.model import Model, T, X, k, solved, stretch
from derivations.notation import (
    CAPTIONS,
    Formula,
    N,
    alpha,
    c,
    mu_d,
    mu_s,
    n,
    s,
    slope_margin,
    static_margin,
    symbol,
    tan,
)
from derivations.proof import Proof, chapter

v = sp.Function("v")
alpha_c = symbol("alpha_c")
speed, energy_left, more, path = sp.symbols("speed E_end more path", nonnegative=True)
up, rest = sp.symbols("up rest", nonnegative=True)
"""How many sliders move uphill; how many rest."""
first, rate, energy, step, time = sp.symbols("a B E delta time", positive=True)


@chapter("Runaway", "theta is frozen while sliders move", "mu_d is constant")
def derive(p: Proof, model: Model) -> None:
    """Show the mean acceleration of a sliding chain, and the energy that an avalanche loses."""
    weight = model.between(sp.Integer(0), sp.Integer(0))
    springs = model.force(n) - weight
    p.show(
        "springs enter a force by a difference, and cancel in the sum over the chain",
        springs,
        T(n) - T(n - 1),
    )
    mean = p.show(
        "sum of all forces and frictions per slider, all moving downhill: mean acceleration",
        weight + (model.end(1) - model.end(0)) / N + model.friction(1),
        s - mu_d * c,
    )
    critical = p.show(
        "it vanishes at tan(alpha) =",
        solved(sp.expand(mean.subs(s, c * tan)), tan),
        mu_d,
    )

    def accelerates(formula: Formula) -> bool:
        beyond = formula.sides == (alpha, alpha_c, sp.atan(critical))
        return beyond and formula.relations == (">", "=")

    p.entry("alpha_c", {sp.tan(alpha_c): critical})
    p.entry("accelerates_above", accelerates)
    turned = (model.friction(-1) - model.friction(1)) * up / N
    p.show(
        "of sliders that move uphill friction speeds up the mean velocity, too: with `up` of them "
        "its acceleration is",
        mean + turned,
        (s - mu_d * c) + 2 * mu_d * c * up / N,
    )
    p.proved(
        "so above that slope the mean velocity does not fall as long as no slider rests",
        lambda: sp.expand((mean + turned).subs(s, mu_d * c + speed)).is_nonnegative,
        "it grows by the excess of s over mu_d c, and by what friction gives to those that go up",
    )
    p.show(
        "one that rests is held back by up to its static threshold: with `rest` of them the mean "
        "acceleration may be as low as",
        mean - (model.threshold() + model.friction(1)) * rest / N,
        (s - mu_d * c) - (mu_s - mu_d) * c * rest / N,
        "least",
    )
    p.show(
        "negative, with enough of them at rest, for slopes below mu_s: the mean velocity may fall. "
        "It cannot if tan(alpha) exceeds",
        solved(sp.expand(p.least.subs({s: c * tan, rest: N})), tan),
        mu_s,
    )
    _fall(p, model)
    own, others = 1 - 1 / N, -1 / N
    p.show(
        f"a unit vector less its mean, one component {own} and all others {others}, has the square",
        own**2 + (N - 1) * others**2,
        1 - 1 / N,
    )
    p.argued(
        "at tan(alpha) >= mu_d a mean velocity above sqrt((1 - 1/N) 2J) proves that no slider "
        "ever stops",
        "v_n = mean + w_n with w orthogonal to (1, ..., 1), |w|**2 <= 2J conserved (modes): "
        "|w_n| <= sqrt((1 - 1/N) 2J) by Cauchy-Schwarz and the square above",
    )

    stored = sp.diff(model.elastic, stretch) / (k * stretch)
    flux = T(n) * v(n + 1)
    p.show(
        "energy: kinetic and elastic power of the springs telescope over the chain",
        v(n) * springs + stored * T(n) * (v(n + 1) - v(n)),
        flux - flux.subs(n, n - 1),
    )
    for way, word in ((1, "down"), (-1, "up")):
        p.show(
            f"weight and friction have on a slider that moves {word}hill, s not below zero, the "
            "power",
            way * speed * (weight + model.friction(way)),
            -slope_margin * speed + (way - 1) * s * speed,
        )
    lost = energy - slope_margin * path - more
    p.show(
        "so for tan(alpha) from zero to below mu_d the energy falls from E to E_end, by m per path "
        "and more uphill: all paths of an avalanche sum up to",
        solved(sp.Eq(energy_left, lost), path),
        energy / slope_margin - (energy_left + more) / slope_margin,
    )
    around = [springs.coeff(T(n + change)) for change in (-1, 0)]
    lean = around[0] ** 2 + (around[1] - around[0]) ** 2 + around[1] ** 2
    p.show(
        "the rate of an acceleration is at most B = |v| times the root of",
        lean,
        sp.Integer(6),
    )
    bound = sp.sqrt(lean) * sp.sqrt(2 * energy)
    slowing = first * time - rate * time**2 / 2
    stop = max(sp.solve(slowing, time), key=lambda at: at != 0)
    least = p.show(
        f"a slip with the first acceleration a is longer than the integral of {slowing} up to its "
        f"zero, with B = {bound}, E bounding the kinetic energy: longer than",
        sp.integrate(slowing, (time, 0, stop)).subs(rate, bound),
        first**3 / (18 * energy),
    )
    slips = energy / slope_margin / least.subs(first, step * c)
    p.show(
        "with mu_s above mu_d by delta or more everywhere the number of slips is below the longest "
        "path over that,",
        slips,
        18 * energy**2 / (slope_margin * (step * c) ** 3),
        "slips",
    )
    p.argued(
        "hence every avalanche ends if mu_s - mu_d >= delta > 0 and 0 <= tan(alpha) < mu_d",
        "finitely many slips; each is of finite duration, for the modes of a run are not damped "
        "(modes), so that a velocity that keeps its sign cannot have a finite path",
    )


def _fall(p: Proof, model: Model) -> None:
    """Show that above mu_d the mean velocity of two sliders does fall before both slide."""
    upper, lower, tension = model.pair()
    begun = solved(lower - model.threshold(), tension)
    moved = solved(upper.subs(tension, begun + X) - model.threshold(), X)
    excess = model.threshold() + model.friction(1)
    cosine = p.show(
        "it does: the lower of two sliders slips from its threshold (slip), and the upper one "
        "starts where the cosine of the time since is",
        solved(excess * (1 - symbol("cosine")) - moved, symbol("cosine")),
        1 - 2 * static_margin / ((mu_s - mu_d) * c),
    )
    steep = CAPTIONS | {s: c * sp.Rational(51, 100)}
    tangent = steep[s] / c
    p.show(
        f"... so for mu_d, mu_s = {CAPTIONS[mu_d]}, {CAPTIONS[mu_s]}, tan(alpha) = {tangent} "
        "when the mean velocity has fallen to a share of its peak of",
        sp.sqrt(1 - sp.cancel(cosine.subs({key: steep[key] for key in (s, mu_d, mu_s)})) ** 2),
        sp.Rational(3, 5),
    )
