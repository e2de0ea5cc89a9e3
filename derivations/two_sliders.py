"""Two sliders: every slip, the staircase of the velocity, its thresholds and its phase mean."""

from __future__ import annotations

import math
from fractions import Fraction

import mpmath
import sympy as sp

from derivations import slip
from derivations.chain import RationalChain
from derivations.judges import inequality, leading
from derivations.model import Model, after, before, here, mu, solved
from derivations.notation import (
    CAPTIONS,
    Expression,
    Formula,
    amplitude,
    at,
    brief,
    c,
    ceil,
    creeps,
    excess,
    f,
    l0,
    mu_d,
    mu_s,
    positive_part,
    s,
    sigma_mu,
    slope_margin,
    star,
    static_margin,
    symbol,
    tan,
)
from derivations.proof import Proof, chapter

r, v_G, advance = symbol("r"), symbol("v_G"), symbol("Delta_x_G")
jump = sp.Symbol("jump", positive=True)
room = l0 * amplitude
SIZES = dict(zip(sp.symbols("m_ s_ D_", positive=True), (slope_margin, s, excess), strict=True))
"""The positive quantities of this chapter."""


def _positive(expression: Expression) -> bool:
    """Return whether an expression is positive as far as m, s and D are."""
    margin, weight, step = SIZES
    known = expression.subs({mu_s: mu_d + step / c}).subs(mu_d, (margin + s) / c).subs(s, weight)
    return bool(sp.expand(known).is_positive)


def staircase(passed: Expression, back: Expression, move: Expression) -> bool:
    """Return whether a chain of spring r that has just slipped rests where it is.

    It slips on where y exceeds `passed`, and then back where y falls below `back`; from r less
    `move` it came by the same two places of one slip earlier.
    """

    def rests(value: Expression, place: Expression) -> bool:
        low, high = (bound.subs(r, value) for bound in (back.subs(r, r - move), passed))
        return _positive(high - place) and _positive(place - low)

    return rests(r + move, passed) and rests(r, back)


def _share(slope: Expression) -> str:
    return f"{float(1 - slope / CAPTIONS[mu_d]):.0e}"


def _slips_alone(slope: Expression) -> bool:
    """Return whether two sliders at a slope next to mu_d creep as the staircase says."""
    given = {name: Fraction(str(CAPTIONS[name])) for name in (mu_d, mu_s)}
    tangent, low, high = Fraction(str(slope)), given[mu_d], given[mu_s]
    reach, step = Fraction(7, 3), high - low
    pair = RationalChain(2, tangent, low, high)
    for target in (reach, -reach, reach):
        pair.to(target)
    start = sum(pair.x)
    pair.to(-reach)
    pair.to(reach)
    steps = math.ceil((reach - high + tangent) / (2 * step))
    return sum(pair.x) - start == 2 * 2 * 2 * step * steps


@chapter(
    "Two sliders",
    "tan(alpha) between zero and mu_d",
    "no mu_s below mu_d",
    "one value of mu_s",
    "slips are as in chapter slip",
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
        "the mirror image of a level chain: the force on the upper slider becomes minus that on "
        "the lower one",
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
        "dilation: the lower slider starts downhill, at its static threshold, at the tension",
        solved(last - model.threshold(), tension),
        -static_margin,
    )
    move = slip.derive(model).last
    p.show(
        "its slip leaves the upper slider a margin before it starts uphill,",
        first.subs(tension, start + move) + model.threshold(),
        2 * s + 2 * excess,
    )

    start_2 = solved(last - model.threshold(mu(2)), tension)
    start_1 = solved(first + model.threshold(mu(1)), tension)
    ordering = p.show(
        "different coefficients: the lower slider is first if tan(alpha) exceeds",
        solved((start_2 - start_1).subs(s, c * tan), tan),
        (mu(2) - mu(1)) / 2,
    )
    p.entry("ordering", inequality({}, s / c - ordering))
    left = first.subs(tension, start_2 + move.subs(mu_s, mu(2)))
    stability = p.show(
        "... and the upper one stays after the slip if tan(alpha) is below",
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
    share = mpmath.ncdf(float(lower / width(ordering)))
    p.entry("alpha_c_minus", {sp.tan(symbol("alpha_c_minus")): lower}, edge=ordering, share=share)
    upper = p.show(
        "one standard deviation below the second's mean",
        stability.subs({mu(1): mu_s, mu(2): mu_s}) - width(stability),
        mu_d - sigma_mu / sp.sqrt(2),
    )
    mean = stability.subs({mu(1): mu_s, mu(2): mu_s})
    share = mpmath.ncdf(float((mean - upper) / width(stability)))
    p.entry("alpha_c_plus", {sp.tan(symbol("alpha_c_plus")): upper}, edge=stability, share=share)
    return start, move


def _staircase(p: Proof, model: Model, start: Expression, move: Expression) -> None:
    """Show the staircase of the velocity, its threshold, and its mean over the phase r_0."""
    first, _, tension = model.pair()
    rho = r + move / 2
    passed = p.show(
        "r: the stretch of the spring at theta = zero, y = l0 theta, which lowers the tension from "
        "r: the lower slider slips, r grows by the length of a slip, at y =",
        r - start,
        rho + slope_margin,
        "passed",
    )
    back = p.show(
        "... and the upper one slips back, as much, from there at y =",
        r + move - solved(first - model.threshold(), tension),
        rho - slope_margin,
        "back",
    )
    step = p.show("either slip moves the centre of mass downhill by", move / 2, excess)
    lattice = p.show(
        "both at places that belong to rho, halfway between two values of r: it exceeds the lower "
        "one by",
        rho - r,
        excess,
    )
    p.proved(
        f"staircase: r_0 and r differ by {brief(move)} times a whole number, and x_G moves by "
        f"{brief(step)} whenever y passes {brief(passed)} upwards or {brief(back)} downwards, in "
        "turns, for each such r",
        lambda: staircase(passed, back, move),
        "a chain that has just slipped rests, for y lies between the next place where it slips on "
        "and the next one where it slips back; so each slip leads from one r to the next",
    )
    highest, lowest = passed - rho, back - rho
    reach = p.show(
        f"cycles pass both, rho with {brief(highest)} and {brief(lowest)}, iff |rho| is below, L = "
        "l0 A,",
        room - highest,
        room - slope_margin,
    )
    p.show("... on either side", room + lowest, room - slope_margin)
    nearest = lattice.subs(r, 0)
    threshold = p.show(
        f"relaxed chain, r_0 = zero, rho an odd multiple of {brief(nearest)}: it creeps above A* =",
        solved(reach - nearest, amplitude),
        static_margin / l0,
    )
    stops = solved(reach, amplitude)
    p.entry(
        "threshold_th_2_cycle_corrected", {star: threshold}, lines=5, stops=stops, phase=nearest
    )
    p.entry("rest_below_threshold", lines=5, stops=stops)
    at_rho = sp.Symbol("rho", real=True)
    velocity = p.show(
        f"mean over r_0: there is one rho in {brief(move)}, and it moves x_G by {brief(step)} a "
        "half-cycle: tau_th v =",
        sp.integrate(step / move, (at_rho, -reach, reach)),
        room - slope_margin,
    )
    pairs = p.show(
        f"relaxed chain: on either side there is a rho, which moves x_G by {brief(step)}, at "
        f"{brief(nearest)} and after every {brief(move)}: the number of pairs within reach is the "
        "least whole number from zero on that is not below",
        (reach - nearest) / move,
        (room - static_margin) / (2 * excess),
    )
    mean = creeps(positive_part(velocity))
    relaxed = creeps(2 * step * positive_part(ceil(pairs)))
    lacks = velocity - room
    p.entry(
        "velocity_th_2_cycle",
        leading(creeps(velocity), amplitude),
        (mean, relaxed),
        lines=8,
        lacks=lacks / room,
        steps=move,
    )
    p.entry(
        "velocity_th_2_cycle_corrected",
        creeps(velocity),
        (mean, relaxed),
        lines=8,
        lacks=velocity - (room - static_margin),
    )
    rate = -s * sp.diff(velocity, c) + c * sp.diff(velocity, s)
    rate = p.show(
        "it grows with alpha, per velocity at large amplitude, at the rate",
        rate / room,
        (mu_d * s + c) / room,
    )
    p.entry("mild_increase", holds=not sp.cancel(rate * room).has(amplitude), rate=rate)
    p.show("towards alpha_c the velocity tends to", velocity.subs(s, mu_d * c), room)
    slopes = [CAPTIONS[mu_d] * (1 - sp.Rational(1, 10**k)) for k in (2, 5, 9)]
    p.checked(
        "... and next to it two sliders without disorder slip one at a time, as the staircase says",
        lambda: all(map(_slips_alone, slopes)),
        f"slopes that are below mu_d by a share of {', '.join(map(_share, slopes))}, "
        "in rational arithmetic",
    )
    p.entry("divergence", corrected=creeps(room), lines=2)
    half = p.show(
        "so a half-cycle that reverses the last moves one slider, on average, by",
        2 * velocity.subs(amplitude, jump / 2),
        l0 * jump - 2 * slope_margin,
    )
    less = (half - l0 * jump) / 2
    dilation = {advance: half / 2, symbol("Delta_theta"): jump, "Delta_x": at({2: half})}
    contraction = dilation | {symbol("Delta_theta"): -jump, "Delta_x": at({1: half})}
    up, down = leading(dilation, jump), leading(contraction, jump)

    def either(formula: Formula) -> bool:
        return bool(up(formula) and down(formula))

    p.entry("dilation_step", up, dilation, lacks=less)
    p.entry("contraction_step", down, lacks=less)
    p.entry("step", either, lacks=less)
    p.entry("angle_independent", holds=sp.diff(half - 2 * less, s) == 0, lacks=less)
    half_cycle = leading({advance: half.subs(jump, model.swing) / 2}, amplitude)
    p.entry("half_cycle_step", half_cycle, lacks=less)
    printed = sp.cancel(half).subs(mu_d, mu_s)  # not 0/0, of the integral over a slip
    p.entry("reversal_step", dilation, lacks=(half - printed) / 2, overshoot=move)
    p.argued(
        "along any path x_G moves by half the truncated variation of l0 theta at level 2m, on "
        "average over r_0",
        "a play of half-width m passes rho just when y passes rho + m upwards or rho - m "
        "downwards, and its variation is the integral over rho of how often it passes",
    )
