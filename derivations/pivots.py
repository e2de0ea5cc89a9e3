"""Critical angles: at which slope the one slider that rests, while all others slide, lets go.

Read from top to bottom, `derive` proves Eq. (critical_angle) for every N and i. All forces are
those of the equations of motion (`model`): a slider that slides without inertia balances springs,
weight and friction; one that rests lets go where Eq. (static_eq) says.
"""

from __future__ import annotations

import sympy as sp

from derivations.judges import follows, inequality, positive, vanishes
from derivations.model import Model, g, m, solved
from derivations.notation import Expression, Formula, N, alpha, at, c, i, j, mu_d, mu_s, s, tan
from derivations.proof import Proof, chapter

critical_angle = sp.Function("alpha_N_star")


def slope(force: Expression, held: Expression) -> Expression:
    """Return the slope tan(alpha) at which a force reaches what friction holds."""
    return solved(sp.expand((force - held).subs(s, tan * c) / c), tan)


@chapter(
    "Pivots and critical angles",
    "large amplitude: all sliders but the pivot move",
    "no inertia",
    "one value of mu_s",
)
def derive(p: Proof, model: Model) -> None:
    """Show the critical angle of a dilation and of a contraction, and the window of two pivots."""
    uphill = p.show("in a dilation slider 1 is driven uphill, S =", model.push("first"), -1)
    downhill = p.show("and slider N downhill, S =", model.push("last"), 1)

    above = p.show(
        "sliders 1..i-1 slide uphill: F_n = -mu_d c for each, T_0 = 0, so T_{i-1} =",
        model.tension(i - 1, 0, uphill),
        -(i - 1) * (mu_d * c + s),
    )
    p.entry("balance_above", {"f": at({(i, i - 1): m * g * above})})
    below = p.show(
        "sliders i+1..N slide downhill: F_n = mu_d c for each, T_N = 0, so T_i =",
        model.tension(i, 1, downhill),
        -(N - i) * (mu_d * c - s),
    )
    p.entry("balance_below", {"f": at({(i, i + 1): -m * g * below})})
    force = p.show(
        "slider i rests, and feels F_i = T_i - T_{i-1} + s =",
        model.between(above, below),
        N * s - mu_d * c * (N + 1 - 2 * i),
    )
    p.alone("pivot_stability", inequality({}, model.held - abs(model.net(i))))
    p.alone("friction_difference", {})

    centre = mu_d * (1 - 2 * ((i - 1) / N))
    critical = p.show(
        "it starts downhill, F_i > mu_s c, where tan(alpha) exceeds tan(alpha*_{N,i}) =",
        slope(force, model.threshold()),
        centre + (mu_s - mu_d) / N,
        "critical",
    )
    tangents = {
        sp.tan(critical_angle(index)): critical.subs(i, index) for index in (i, sp.Integer(1))
    }
    angles = follows(tangents)
    p.entry("critical_angle", angles)
    lower = p.show(
        "slider i-1 in its place starts uphill, F_{i-1} < -mu_s c, where tan(alpha) is below",
        slope(force.subs(i, i - 1), -model.threshold()),
        centre - (mu_s - mu_d) / N,
        "lower",
    )
    p.show(
        "between the two either can rest: a window of the width",
        critical - lower,
        2 * (mu_s - mu_d) / N,
    )
    p.show(
        "where both edges lie if static friction holds no more than sliding friction",
        slope(force, -model.friction(1)),
        centre,
        "sliding_edge",
    )
    steeper = p.show(
        "slider i-1 lets go downhill at a slope that is steeper by",
        critical.subs(i, i - 1) - critical,
        2 * mu_d / N,
    )

    def slider_i_has_let_go(formula: Formula) -> bool:
        ordered = formula.sides == (critical_angle(i), alpha, critical_angle(i - 1)) and positive(
            steeper
        )
        return ordered and formula.relations == ("<", "<")

    p.alone("critical_range", slider_i_has_let_go)
    first = p.show("tan(alpha*_{N,1}) =", critical.subs(i, 1), mu_d + (mu_s - mu_d) / N)
    p.entry("first_critical_angle", corrected=angles, holds=not vanishes(first - mu_d))

    above = p.show(
        "contraction: sliders 1..j-1 slide downhill, so T_{j-1} =",
        model.tension(j - 1, 0, -uphill),
        (j - 1) * (mu_d * c - s),
    )
    p.entry("balance_above_contraction", {"f": at({(j, j - 1): m * g * above})})
    below = p.show(
        "sliders j+1..N slide uphill, so T_j =",
        model.tension(j, 1, -downhill),
        (N - j) * (mu_d * c + s),
    )
    p.entry("balance_below_contraction", {"f": at({(j, j + 1): -m * g * below})})
    mirrored = p.show(
        "slider j rests, and feels F_j = T_j - T_{j-1} + s =",
        model.between(above, below),
        N * s + mu_d * c * (N + 1 - 2 * j),
    )
    partner = p.show(
        "that is the force on slider i in a dilation for j =",
        solved(sp.expand(mirrored - force), j),
        N + 1 - i,
        "partner",
    )
    p.entry("contraction_partner", {j: partner})
