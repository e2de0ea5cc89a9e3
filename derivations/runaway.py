"""That a chain can slide for ever only on slopes of mu_d or more, and what proves that it does."""

from __future__ import annotations

import sympy as sp

from derivations.entry import Backed, Lines, entries_of
from derivations.judges import Judge, vanishes
from derivations.model import Model, T, k, solved, stretch
from derivations.notation import Expression, Formula, N, alpha, c, mu_d, n, s, slope_margin, symbol
from derivations.proof import Proof, chapter

v = sp.Function("v")
speed = sp.Symbol("speed", nonnegative=True)
first, rate, energy, step = sp.symbols("a B E delta", positive=True)
time = sp.Symbol("time", positive=True)


@chapter("Runaway", "theta is frozen", "mu_d is constant")
def derive(p: Proof, model: Model) -> None:
    """Show the mean acceleration of a sliding chain, and the energy that an avalanche loses."""
    weight = model.force(n).subs({T(n): 0, T(n - 1): 0})
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
        "mean",
    )
    p.show(
        "it vanishes at tan(alpha) =",
        solved(sp.expand(mean.subs(s, c * symbol("t"))), symbol("t")),
        mu_d,
        "critical",
    )
    beyond = sp.Symbol("beyond", nonnegative=True)
    p.proved(
        "above, the mean velocity never falls",
        lambda: sp.expand(mean.subs(s, mu_d * c + beyond)).is_nonnegative,
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
    p.show(
        "energy: kinetic and elastic power of the springs telescope over the chain",
        v(n) * springs + stored * T(n) * (v(n + 1) - v(n)),
        T(n) * v(n + 1) - T(n - 1) * v(n),
    )
    for way, word in ((1, "down"), (-1, "up")):
        p.show(
            f"weight and friction have on a slider that moves {word}hill the power "
            "-(mu_d c - s) |v| or less (s >= 0)",
            way * speed * (weight + model.friction(way)),
            -slope_margin * speed + (way - 1) * s * speed,
        )
    p.argued(
        "for 0 <= tan(alpha) < mu_d the paths of all sliders in an avalanche sum up to E/m at most",
        "the three lines above, integrated from rest: the energy E >= 0 loses m per unit of path",
    )
    p.show(
        "a slip with the first acceleration a is longer than the integral of a t - B t**2/2 up to "
        "its zero, B a bound of |a'|:",
        sp.integrate(first * time - rate * time**2 / 2, (time, 0, 2 * first / rate)),
        sp.Rational(2, 3) * first**3 / rate**2,
        "shortest",
    )
    lean = sp.Matrix(
        [
            springs.coeff(T(n - 1)),
            -springs.coeff(T(n - 1)) + springs.coeff(T(n)),
            -springs.coeff(T(n)),
        ]
    )
    bound = p.show(
        "|a'| = |v_{n-1} - 2 v_n + v_{n+1}| <= sqrt(6) |v|, |v|**2 <= 2E: B =",
        sp.sqrt(lean.dot(lean)) * sp.sqrt(2 * energy),
        sp.sqrt(12 * energy),
    )
    shortest = p.show(
        "so it is longer than", p.shortest.subs(rate, bound), first**3 / (18 * energy), "slip"
    )
    p.show(
        "with mu_s - mu_d >= delta everywhere the number of slips is below (E/m) over that",
        energy / slope_margin / shortest.subs(first, step * c),
        18 * energy**2 / (slope_margin * (step * c) ** 3),
        "slips",
    )
    p.argued(
        "hence every avalanche ends if mu_s - mu_d >= delta > 0 and 0 <= tan(alpha) < mu_d",
        "a finite path, and a least path of every slip",
    )


def _slope(r: Lines) -> Judge:
    critical = r.critical

    def judge(formula: Formula) -> bool:
        """Judge a statement of the critical slope, as a tangent or as an angle."""
        left, right = formula.sides
        return formula.relations == ("=",) and (
            (left == sp.tan(symbol("alpha_c")) and vanishes(right - critical))
            or (left == symbol("alpha_c") and vanishes(sp.tan(right) - critical))
        )

    return judge


def _accelerates(r: Lines) -> Judge:
    critical = r.critical

    def judge(formula: Formula) -> bool:
        """Judge `alpha > alpha_c = arctan(mu_d)`."""
        sides: tuple[Expression, ...] = formula.sides
        return (
            formula.relations == (">", "=")
            and sides[:2] == (alpha, symbol("alpha_c"))
            and vanishes(sp.tan(sides[2]) - critical)
        )

    return judge


LINES: dict[str, Backed | None] = {"alpha_c": _slope, "accelerates_above": _accelerates}
ENTRIES = entries_of("runaway", derive, LINES)
