"""That a chain can slide for ever only on slopes of mu_d or more, and what proves that it does."""

from __future__ import annotations

import sympy as sp

from derivations.model import Model, T, k, solved, stretch
from derivations.notation import Formula, N, alpha, c, mu_d, n, s, slope_margin, symbol, tan
from derivations.proof import Proof, chapter

v = sp.Function("v")
alpha_c = symbol("alpha_c")
speed, energy_left, more, path = sp.symbols("speed E_end more path", nonnegative=True)
first, rate, energy, step, time = sp.symbols("a B E delta time", positive=True)


@chapter("Runaway", "theta is frozen", "mu_d is constant")
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
    p.proved(
        "above, the mean velocity never falls",
        lambda: sp.expand(mean.subs(s, mu_d * c + speed)).is_nonnegative,
        "it grows by the excess of s over mu_d c",
    )
    own, others = 1 - 1 / N, -1 / N
    p.show(
        "a unit vector less its mean has the square (one component 1 - 1/N, N - 1 of -1/N)",
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
            f"weight and friction have on a slider that moves {word}hill the power "
            "-(mu_d c - s) |v| or less (s >= 0)",
            way * speed * (weight + model.friction(way)),
            -slope_margin * speed + (way - 1) * s * speed,
        )
    lost = energy - slope_margin * path - more
    p.show(
        "so for 0 <= tan(alpha) < mu_d the energy falls from E to E_end >= 0, by m per path, and "
        "more uphill: all paths of an avalanche sum up to E/m at most, to",
        solved(sp.Eq(energy_left, lost), path),
        energy / slope_margin - (energy_left + more) / slope_margin,
    )
    bound = sp.sqrt(6) * sp.sqrt(2 * energy)
    around = [springs.coeff(T(n + change)) for change in (-1, 0)]
    lean = around[0] ** 2 + (around[1] - around[0]) ** 2 + around[1] ** 2
    p.show(
        "|a'| = |v_{n-1} - 2 v_n + v_{n+1}| is at most B = |v| times the root of",
        lean,
        sp.Integer(6),
    )
    least = p.show(
        "a slip with the first acceleration a is longer than the integral of a t - B t**2/2 up to "
        "its zero, with |v|**2 <= 2E: longer than",
        sp.integrate(first * time - rate * time**2 / 2, (time, 0, 2 * first / rate)).subs(
            rate, bound
        ),
        first**3 / (18 * energy),
    )
    slips = energy / slope_margin / least.subs(first, step * c)
    p.show(
        "with mu_s - mu_d >= delta everywhere the number of slips is below (E/m) over that",
        slips,
        18 * energy**2 / (slope_margin * (step * c) ** 3),
        "slips",
    )
    p.argued(
        "hence every avalanche ends if mu_s - mu_d >= delta > 0 and 0 <= tan(alpha) < mu_d",
        "finitely many slips; each is of finite duration, for the modes of a run are not damped "
        "(modes), so that a velocity that keeps its sign cannot have a finite path",
    )
