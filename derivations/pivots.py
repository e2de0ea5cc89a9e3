"""Critical angles: at which slope the one slider that rests, while all others slide, lets go.

Read from top to bottom, `derive` proves Eq. (critical_angle) for every N and i. All forces are
those of the equations of motion (`model`): a slider that slides without inertia balances springs,
weight and friction; one that rests lets go where Eq. (static_eq) says.
"""

from __future__ import annotations

import sympy as sp

from derivations.entry import Backed, Backing, Lines, entries_of
from derivations.judges import Judge, follows, inequality, vanishes
from derivations.model import Model, T, g, m, solved
from derivations.notation import Expression, Formula, N, alpha, c, i, j, mu_d, mu_s, s, symbol
from derivations.proof import Proof, chapter
from derivations.scaling import net

tan = symbol("t")
star = sp.Function("alpha_N_star")


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
        "above",
    )
    below = p.show(
        "sliders i+1..N slide downhill: F_n = mu_d c for each, T_N = 0, so T_i =",
        model.tension(i, 1, downhill),
        -(N - i) * (mu_d * c - s),
        "below",
    )
    force = p.show(
        "slider i rests, and feels F_i = T_i - T_{i-1} + s =",
        model.force(i).subs({T(i - 1): above, T(i): below}),
        N * s - mu_d * c * (N + 1 - 2 * i),
    )

    def slope(force: Expression, held: Expression) -> Expression:
        """Return the slope at which a force reaches what friction holds."""
        return solved(sp.expand((force - held).subs(s, tan * c) / c), tan)

    centre = mu_d * (1 - 2 * ((i - 1) / N))
    critical = p.show(
        "it starts downhill, F_i > mu_s c, where tan(alpha) exceeds tan(alpha*_{N,i}) =",
        slope(force, model.threshold()),
        centre + (mu_s - mu_d) / N,
        "critical",
    )
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
    p.show("... with its middle at", (critical + lower) / 2, centre)
    p.show(
        "where both edges lie if static friction holds no more than sliding friction",
        slope(force, -model.friction(1)),
        centre,
        "sliding_edge",
    )
    p.show(
        "slider i-1 lets go downhill at a slope that is steeper by",
        critical.subs(i, i - 1) - critical,
        2 * mu_d / N,
    )
    p.show("i = 1: tan(alpha*_{N,1}) =", critical.subs(i, 1), mu_d + (mu_s - mu_d) / N, "first")

    above = p.show(
        "contraction: sliders 1..j-1 slide downhill, so T_{j-1} =",
        model.tension(j - 1, 0, -uphill),
        (j - 1) * (mu_d * c - s),
        "above_contraction",
    )
    below = p.show(
        "sliders j+1..N slide uphill, so T_j =",
        model.tension(j, 1, -downhill),
        (N - j) * (mu_d * c + s),
        "below_contraction",
    )
    mirrored = p.show(
        "slider j rests, and feels F_j = T_j - T_{j-1} + s =",
        model.force(j).subs({T(j - 1): above, T(j): below}),
        N * s + mu_d * c * (N + 1 - 2 * j),
    )
    p.show(
        "that is the force on slider i in a dilation for j =",
        solved(sp.expand(mirrored - force), j),
        N + 1 - i,
        "partner",
    )


def _pivot_pulls(pivot: Expression, above: Expression, below: Expression) -> Judge:
    """Judge a balance: the pivot pulls its upper neighbour with T_{i-1}, its lower with -T_i."""
    forces = {-1: m * g * above, 1: -m * g * below}

    def force(exerting: Expression, on: Expression) -> Expression:
        if exerting != pivot:
            return sp.Symbol("elsewhere")
        return forces.get(sp.expand(on - pivot), sp.Symbol("elsewhere"))

    return follows({"f": force})


def _angles(critical: Expression) -> dict[object, object]:
    """Return what the tangents of the critical angles are."""
    return {symbol("Delta_mu"): mu_s - mu_d} | {
        sp.tan(star(index)): critical.subs(i, index) for index in (i, sp.Integer(1))
    }


def _range(r: Lines) -> Judge:
    """Judge the range of slopes in which slider i - 1 rests and slider i does not."""
    critical = r.alone("critical")

    def judge(formula: Formula) -> bool:
        steeper = sp.cancel(critical.subs(i, i - 1) - critical).is_positive
        return formula.relations == ("<", "<") and bool(
            formula.sides == (star(i), alpha, star(i - 1)) and steeper
        )

    return judge


def _difference(formula: Formula) -> bool:
    stated = formula.bound({}).right
    return formula.left == symbol("Delta_mu") and vanishes(stated - (mu_s - mu_d))


LINES: dict[str, Backed | None] = {
    "friction_difference": lambda r: _difference,
    "balance_above": lambda r: _pivot_pulls(i, r.above, r.below),
    "balance_below": lambda r: _pivot_pulls(i, r.above, r.below),
    "pivot_stability": lambda r: inequality({}, r.model.held - abs(net(r.model, i))),
    "critical_angle": lambda r: follows(_angles(r.critical)),
    "critical_range": _range,
    "balance_above_contraction": lambda r: _pivot_pulls(
        j, r.above_contraction, r.below_contraction
    ),
    "balance_below_contraction": lambda r: _pivot_pulls(
        j, r.above_contraction, r.below_contraction
    ),
    "contraction_partner": lambda r: follows({j: r.partner}),
    "first_critical_angle": lambda r: Backing(
        exactly=follows(_angles(r.critical)), evidence=not vanishes(r.first - mu_d)
    ),
}
ENTRIES = entries_of("pivots", derive, LINES)
