"""Two sliders: every slip, the staircase of the velocity, its thresholds and its phase mean."""

from __future__ import annotations

import sympy as sp

from derivations import slip
from derivations.judges import inequality, leading
from derivations.model import Model, after, before, here, mu, solved
from derivations.notation import (
    Expression,
    Formula,
    amplitude,
    at,
    c,
    creeps,
    excess,
    f,
    l0,
    mu_d,
    mu_s,
    s,
    sigma_mu,
    slope_margin,
    star,
    static_margin,
    symbol,
    tan,
)
from derivations.proof import Proof, chapter

r, v_G, step = symbol("r"), symbol("v_G"), symbol("Delta_x_G")
jump = sp.Symbol("jump", positive=True)
room = l0 * amplitude


@chapter(
    "Two sliders",
    "0 < tan(alpha) < mu_d <= mu_s",
    "one mu_s where slips are counted",
    "slips are those of chapter slip",
)
def derive(p: Proof, model: Model) -> None:
    """Show the order of slips, the plateau's ends, the staircase and its mean."""
    _level(p, model)
    start, move = _order(p, model)
    _staircase(p, model, start, move)


def _level(p: Proof, model: Model) -> None:
    """Show that a level chain does not creep on average."""
    mirror = {before: -after, after: -before, here: -here}
    p.show(
        "the mirror image of a level chain: the force on slider 1 becomes minus that on 2",
        model.at("first").subs(s, 0).subs(mirror, simultaneous=True),
        -model.at("last").subs(s, 0),
    )
    p.show("... and friction turns round with the velocity", model.friction(-1), -model.friction(1))
    p.argued(
        "so the mean velocity of a level chain is its own negative",
        "the mirror image of the chain is a chain with the same law of disorder",
    )
    p.entry("horizontal", {v_G: 0}, lines=3)


def _order(p: Proof, model: Model) -> tuple[Expression, Expression]:
    """Show which slider slips, and return at which tension slider 2 starts, and how far it goes."""
    pull = f(1, 2)
    forces = {"f": at({(1, 2): pull, (2, 1): -pull})}
    on_1 = model.ends[0] + model.weight - pull
    on_2 = model.ends[1] + model.weight + pull
    held_1, held_2 = model.held.subs(mu_s, mu(1)), model.held.subs(mu_s, mu(2))
    p.alone("lower_slider_starts", inequality(forces, on_2 - held_2))
    p.alone("slip_starts", inequality(forces, on_2 - held_2))
    p.alone("upper_slider_stays", inequality(forces, held_1 + on_1))
    p.alone("upper_slider_after_slip", inequality(forces, held_1 - on_1))

    first, last, tension = model.pair()
    start = p.show(
        "dilation: slider 2 starts downhill, F_2 = mu_s c, at the tension",
        solved(last - model.threshold(), tension),
        -static_margin,
    )
    move = slip.derive(model).last
    p.show(
        "the slip of slider 2 by 2D leaves slider 1 the margin mu_s c + F_1 =",
        first.subs(tension, start + move) + model.threshold(),
        2 * s + 2 * excess,
    )

    start_2 = solved(last - model.threshold(mu(2)), tension)
    start_1 = solved(first + model.threshold(mu(1)), tension)
    ordering = p.show(
        "different coefficients: slider 2 is first if tan(alpha) exceeds",
        solved((start_2 - start_1).subs(s, c * tan), tan),
        (mu(2) - mu(1)) / 2,
    )
    p.entry("ordering", inequality({}, s / c - ordering))
    left = first.subs(tension, start_2 + move.subs(mu_s, mu(2)))
    stability = p.show(
        "... and slider 1 stays after the slip if tan(alpha) is below",
        solved((model.threshold(mu(1)) - left).subs(s, c * tan), tan),
        mu_d + (mu(1) - mu(2)) / 2,
    )
    p.entry("stability_after_slip", inequality({}, stability - s / c))

    def width(edge: Expression) -> Expression:
        """Return the standard deviation of an edge, for independent draws of width sigma_mu."""
        return sigma_mu * sp.sqrt(sp.diff(edge, mu(1)) ** 2 + sp.diff(edge, mu(2)) ** 2)

    lower = p.show(
        "independent draws of width sigma_mu: standard deviation of the first",
        width(ordering),
        sigma_mu / sp.sqrt(2),
    )
    p.entry("alpha_c_minus", {sp.tan(symbol("alpha_c_minus")): lower})
    upper = p.show(
        "one standard deviation below the second's mean",
        stability.subs({mu(1): mu_s, mu(2): mu_s}) - width(stability),
        mu_d - sigma_mu / sp.sqrt(2),
    )
    p.entry("alpha_c_plus", {sp.tan(symbol("alpha_c_plus")): upper})
    return start, move


def _staircase(p: Proof, model: Model, start: Expression, move: Expression) -> None:
    """Show the staircase of the velocity, its threshold, and its mean over the phase r_0."""
    first, _, tension = model.pair()
    rho = r + move / 2
    passed = p.show(
        "r = x_2 - x_1 - l0, y = l0 theta, T = r - y: slider 2 slips, r -> r + 2D, at y =",
        r - start,
        rho + slope_margin,
    )
    p.show(
        "... and slider 1 slips back, r + 2D -> r, at y =",
        r + move - solved(first - model.threshold(), tension),
        rho - slope_margin,
    )
    p.show("either slip moves the centre of mass downhill by D", move / 2, excess)
    slips = p.lines[-3:]
    p.proved(
        "staircase: r stays in r_0 + 2D Z, and x_G moves by D whenever y passes rho + m upwards or "
        "rho - m downwards, in turns, for a rho = r + D of these",
        lambda: not any(line.fault for line in slips),
        "induction over the slips: each leads from one r to the next by the lines above, and "
        "between slips nothing moves",
    )
    reach = p.show(
        "cycles pass it twice iff -L < rho - m and rho + m < L = l0 A: |rho| below",
        room - (passed - rho),
        room - slope_margin,
    )
    threshold = p.show(
        "relaxed chain, r_0 = 0, rho = +-D, +-3D, ...: it creeps above A* =",
        solved(reach - move / 2, amplitude),
        static_margin / l0,
    )
    p.entry("threshold_th_2_cycle_corrected", {star: threshold})
    p.entry("rest_below_threshold")
    at_rho = sp.Symbol("rho", real=True)
    velocity = p.show(
        "mean over r_0, one rho in 2D, each moves x_G by D a half-cycle: tau_th v =",
        sp.integrate(move / 2 / move, (at_rho, -reach, reach)),
        room - slope_margin,
    )
    mean = creeps(velocity)
    p.entry("velocity_th_2_cycle", leading(mean, amplitude), mean)
    p.entry("velocity_th_2_cycle_corrected", mean)
    p.show("towards alpha_c it tends to", sp.limit(velocity, s, mu_d * c), room)
    p.entry("divergence")
    half = p.show(
        "so a half-cycle that reverses the last moves one slider, on average, by",
        2 * velocity.subs(amplitude, jump / 2),
        l0 * jump - 2 * slope_margin,
    )
    dilation = {step: half / 2, symbol("Delta_theta"): jump, "Delta_x": at({2: half})}
    contraction = dilation | {symbol("Delta_theta"): -jump, "Delta_x": at({1: half})}
    up, down = leading(dilation, jump), leading(contraction, jump)

    def either(formula: Formula) -> bool:
        return bool(up(formula) and down(formula))

    p.entry("dilation_step", up, dilation)
    p.entry("contraction_step", down)
    p.entry("step", either)
    p.entry("half_cycle_step", leading({step: half.subs(jump, model.swing) / 2}, amplitude))
    p.entry("reversal_step", dilation)
    p.argued(
        "along any path x_G moves by half the truncated variation of l0 theta at level 2m, on "
        "average over r_0",
        "a play of half-width m passes rho just when y passes rho + m upwards or rho - m "
        "downwards, and its variation is the integral over rho of how often it passes",
    )
