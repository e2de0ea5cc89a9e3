"""Critical angles: at which slope the one slider that rests, while all others slide, lets go.

Read from top to bottom, `derive` proves Eq. 19 for every N and i from its premises:
all sliders but one slide continuously and without inertia, so that each balances springs, weight
and sliding friction; the resting slider lets go where Eq. 9 says. All forces come from
the equations of motion (`model`). Then it shows what becomes of the equation where mu_s exceeds
mu_d, and sliders stick and slip: a second term of the size of the one that it keeps.
"""

from __future__ import annotations

from dataclasses import replace

import sympy as sp

from derivations.judges import follows, inequality, positive, vanishes
from derivations.model import Model, T, g, m, solved, way
from derivations.notation import (
    CAPTIONS,
    Expression,
    Formula,
    N,
    alpha,
    at,
    c,
    excess,
    i,
    j,
    mu_d,
    mu_s,
    n,
    s,
    symbol,
    tan,
)
from derivations.proof import Proof, chapter

critical_angle = sp.Function("alpha_N_star")
Phi = symbol("Phi")
"""Sum of the phases of those that slide downhill, less those that slide uphill."""


def slope(force: Expression, held: Expression) -> Expression:
    """Return the slope tan(alpha) at which a force reaches what friction holds."""
    return solved(sp.expand((force - held).subs(s, tan * c) / c), tan)


@chapter(
    "Pivots and critical angles",
    "large amplitude: all sliders but the pivot move",
    "continuous sliding",
    "no inertia",
    "one value of mu_s",
)
def derive(p: Proof, model: Model) -> None:
    """Show the critical angle of a dilation and of a contraction, and the window of two pivots."""
    p.show(
        f"equation of motion of slider {n}: mass times acceleration is the force of springs and "
        "weight,",
        model.force(n),
        T(n) - T(n - 1) + s,
    )
    p.show(
        f"... and friction, if it moves in the direction {way}, downhill or uphill:",
        model.friction(way),
        -mu_d * c * way,
    )
    p.show(
        f"one that slides continuously and without inertia balances the two: {model.force(n)} =",
        model.following(way),
        mu_d * c * way,
    )
    uphill = p.show(
        "in a dilation the first slider is driven uphill, S =", model.driven("first"), -1
    )
    downhill = p.show("and the last one downhill, S =", model.driven("last"), 1)
    up, down = model.following(uphill), model.following(downhill)
    before, spring = i - 1, T(i - 1)
    above = p.show(
        f"the {before} sliders above slider i slide uphill: F_n = {up} for each, and the tension "
        f"beyond the first is {model.end(0)}, so {spring} =",
        model.tension(before, 0, uphill),
        -(i - 1) * (mu_d * c + s),
    )
    p.entry("balance_above", {"f": at({(i, i - 1): m * g * above})})
    below = p.show(
        f"those below slide downhill: F_n = {down} for each, and the tension beyond the last is "
        f"{model.end(1)}, so {T(i)} =",
        model.tension(i, 1, downhill),
        -(N - i) * (mu_d * c - s),
    )
    p.entry("balance_below", {"f": at({(i, i + 1): -m * g * below})})
    force = p.show(
        f"slider i rests, and feels {model.force(i)} =",
        model.between(above, below),
        N * s - mu_d * c * (N + 1 - 2 * i),
        "force",
    )
    p.alone("pivot_stability", inequality({}, model.held - abs(model.net(i))))
    p.alone("friction_difference", {})

    centre = mu_d * (1 - 2 * ((i - 1) / N))
    held = model.threshold()
    critical = p.show(
        f"it starts downhill, its force above {held}, where tan(alpha) exceeds tan(alpha*_{{N,i}}) "
        "=",
        slope(force, held),
        centre + (mu_s - mu_d) / N,
        "critical",
    )
    tangents = {
        sp.tan(critical_angle(index)): critical.subs(i, index) for index in (i, sp.Integer(1))
    }
    angles = follows(tangents)
    edge = follows({sp.tan(critical_angle(i)): centre})
    kept = critical - centre
    p.entry("critical_angle", angles, edge, lines=4, kept=kept, phases=kept * Phi)
    uphill_held = -held
    lower = p.show(
        f"slider {before}, above, rests in its place unless its force is below {uphill_held}; it "
        "starts uphill, where tan(alpha) is below",
        slope(force.subs(i, before), uphill_held),
        centre - (mu_s - mu_d) / N,
        "lower",
    )
    p.show(
        "between the two either can rest: a window of the width",
        critical - lower,
        2 * (mu_s - mu_d) / N,
    )
    p.show(
        f"slider {before} alone can rest from there up to the slope where the one above it can as "
        "well: the length is",
        lower.subs(i, before) - critical,
        2 * (2 * mu_d - mu_s) / N,
    )
    most = solved(lower.subs(i, before) - critical, mu_s)
    p.show("negative, so that three sliders can rest, for mu_s above", most, 2 * mu_d)
    p.show(
        "where both edges lie if static friction holds no more than sliding friction: no slope has "
        "two pivots but these",
        slope(force, -model.friction(1)),
        centre,
        "sliding_edge",
    )
    p.show("... as the lower edge says, too", (lower - centre).subs(mu_s, mu_d), 0)
    _phases(p, model, force, critical)
    steeper = p.show(
        f"slider {before} lets go downhill at a slope that is steeper by",
        critical.subs(i, before) - critical,
        2 * mu_d / N,
    )
    p.entry("decreasing_angle", holds=positive(steeper), steeper=steeper)

    def slider_i_has_let_go(formula: Formula) -> bool:
        ordered = formula.sides == (critical_angle(i), alpha, critical_angle(i - 1)) and positive(
            steeper
        )
        return ordered and formula.relations == ("<", "<")

    p.alone("critical_range", slider_i_has_let_go)
    limit = solved(model.friction(1).subs(c, 1) + tan, tan)
    first = p.show(
        "the first slider lets go where tan(alpha) exceeds",
        critical.subs(i, 1),
        mu_d + (mu_s - mu_d) / N,
    )
    p.entry(
        "first_critical_angle",
        corrected=angles,
        holds=not vanishes(first - limit),
        excess=first - limit,
        stated=limit.subs(CAPTIONS),
        instead=first.subs(CAPTIONS),
    )
    _contraction(p, model, force, uphill, downhill)


def _phases(p: Proof, model: Model, force: Expression, critical: Expression) -> None:
    """Show what the critical angle is where sliders stick and slip, with inertia or without."""
    p.show(
        "with mu_s above mu_d sliders stick and slip, and what follows is no proof of the equation "
        "but of what it lacks. Whatever they do, the forces of a chain sum up to",
        model.end(1) - model.end(0) + N * model.scaled(model.weight),
        N * s,
    )
    stuck = p.show(
        "one that slides misses sliding friction by D times a phase, from minus to plus one; the "
        "phases, downhill less uphill, sum up to Phi: slider i feels",
        force - (model.threshold() + model.friction(1)) * Phi,
        N * s - mu_d * c * (N + 1 - 2 * i) - excess * Phi,
    )
    each = symbol("phase")
    one_phase = replace(model, phase=each)
    p.show(
        "... as the balance from spring to spring says, for one phase of all those below",
        one_phase.between(model.tension(i - 1, 0, -1), one_phase.tension(i, 1, 1)),
        stuck.subs(Phi, (N - i) * each),
    )
    p.show(
        "it starts downhill where tan(alpha) exceeds tan(alpha*_{N,i}) by",
        slope(stuck, model.threshold()) - critical,
        (mu_s - mu_d) / N * Phi,
        "phases",
    )
    p.show(
        "which is, beside the term with mu_s that the equation keeps, Phi: of N or so phases that "
        "are as large as one",
        p.phases / (critical - p.sliding_edge),
        Phi,
    )
    creeping = replace(model, inertia=sp.Integer(0))
    balance = creeping.between(creeping.tension(i - 1, 0, -1), creeping.tension(i, 1, 1))
    mean = (mu_s + mu_d) / 2
    p.show(
        "and that the phases have no mean is due to inertia: slips that stopped where forces "
        "balance (slip) would make tan(alpha*_{N,i})",
        slope(balance, model.threshold()),
        mean * (1 - 2 * ((i - 1) / N)) + (mu_s - mean) / N,
    )


def _contraction(
    p: Proof, model: Model, force: Expression, uphill: Expression, downhill: Expression
) -> None:
    """Show which slider rests in a contraction."""
    spring = T(j - 1)
    above = p.show(
        f"contraction: the sliders above slider j slide downhill, so {spring} =",
        model.tension(j - 1, 0, -uphill),
        (j - 1) * (mu_d * c - s),
    )
    p.entry("balance_above_contraction", {"f": at({(j, j - 1): m * g * above})})
    below = p.show(
        f"those below uphill, so {T(j)} =",
        model.tension(j, 1, -downhill),
        (N - j) * (mu_d * c + s),
    )
    p.entry("balance_below_contraction", {"f": at({(j, j + 1): -m * g * below})})
    mirrored = p.show(
        f"slider j rests, and feels {model.force(j)} =",
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
