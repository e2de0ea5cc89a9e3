"""That under independent Gaussian targets the sliding chain creeps by the integral I(h)."""

from __future__ import annotations

from functools import cache
from itertools import permutations
from typing import Any

import sympy as sp

from derivations import plateaus, sliding_limit
from derivations.judges import Within, leading, positive, vanishes
from derivations.model import Model, solved
from derivations.notation import (
    CAPTIONS,
    Expression,
    Formula,
    N,
    amplitude,
    creeps,
    i,
    l0,
    mu_d,
    mu_s,
    sigma_theta,
    slope_margin,
    star,
    static_margin,
    symbol,
    tau_th,
)
from derivations.proof import Proof, chapter, worded
from derivations.scaling import normal

z, e = sp.symbols("z e", real=True)
h, A, B, phi = sp.symbols("h A B phi", positive=True)
"""Half-width of the play; Phi(z - h), Phi(-z - h); the normal density at z, e = erf(z/sqrt(2))."""
G, width_star = symbol("G"), symbol("sigma_theta_star")
ROOT_PI = sp.sqrt(sp.pi)


@cache
def _coefficient(order: int) -> Expression:
    """Return a coefficient of the integrand A B/(A + B) in powers of h, in e, phi and z."""
    cumulative = (1 + sp.erf(z / sp.sqrt(2))) / 2
    below, above = cumulative.subs(z, z - h), cumulative.subs(z, -z - h)
    derivative = sp.diff(below * above / (below + above), h, order).subs(h, 0)
    density = {sp.exp(-(z**2) / 2): sp.sqrt(2 * sp.pi) * phi}
    named = derivative.subs(sp.erf(sp.sqrt(2) * z / 2), e).subs(density)
    return sp.expand(sp.cancel(named / sp.factorial(order)))


@cache
def _square() -> Expression:
    """Return the integral of the squared normal density."""
    return sp.integrate(normal(z, 0, 1) ** 2, (z, -sp.oo, sp.oo))


def rising(integrand: Expression) -> bool:
    """Return whether an integrand is positive and grows with A and with B."""
    return all(positive(part) for part in (integrand, *(sp.diff(integrand, x) for x in (A, B))))


def velocity_of_cycles(model: Model, size: Expression) -> dict[Any, Any]:
    """Return the plateau velocities of cycles of an amplitude."""
    return creeps(plateaus.derive(model).velocity.subs(amplitude, size))


@chapter(
    "Random dilations",
    "independent Gaussian targets",
    "sliding limit, or two sliders averaged over the phase",
)
def derive(p: Proof, model: Model) -> None:
    """Show the plateau under random dilations, the linear law and the exact law."""
    variance = sp.Integer(2)
    mean_step = p.show(
        f"half the mean of the difference of two targets, |{z}|, whose variance is {variance}, in "
        "units of sigma",
        sp.integrate(z * normal(z, 0, sp.sqrt(variance)), (z, 0, sp.oo)),
        1 / ROOT_PI,
        "mean_step",
    )
    p.entry("two_slider_asymptote", l0 * sigma_theta * mean_step / tau_th)
    p.entry("gaussian_amplitude", sigma_theta * mean_step)
    of_cycles = CAPTIONS[amplitude] / mean_step

    def width_of_plateau(formula: Formula) -> bool:
        return formula.left == sigma_theta and vanishes(formula.right - of_cycles)

    p.entry("equivalent_width", width_of_plateau, amplitude=CAPTIONS[amplitude])
    turns = [middle != 1 for _, middle, _ in permutations(range(3))]  # neither rise nor fall
    turning = p.show(
        "three independent targets turn with the probability",
        sp.Rational(sum(turns), len(turns)),
        sp.Rational(2, 3),
    )
    p.entry("turning_points", turning)
    _series(p, turning)
    _chain(p, model)


def _series(p: Proof, turning: Expression) -> None:
    """Show the integral I(h), and its first three terms."""
    lower, upper = z - h, -z - h
    again = A + (1 - B - A) * G
    below = p.show(
        "play of half-width h, y normal, the output no further than h from y: it is below z if y "
        f"is by h, A = Phi({lower}), or if it was and y is not above by h, B = Phi({upper}): the "
        f"probability G that it is below z is {again}, so G =",
        solved(sp.Eq(G, again), G),
        A / (A + B),
    )
    rises = p.show(
        "I(h) is the mean rise per target: the integral over z of the probability, G B, that the "
        "output was below z and y is above by h,",
        below * B,
        A * B / (A + B),
    )
    p.proved(
        "I(h) is positive for every h: no threshold; and it falls with h",
        lambda: rising(rises),
        "the integrand is positive and grows with A and with B, which fall with h",
    )
    p.entry("no_random_threshold")
    p.entry("always_random_creep")
    error_function = sp.erf(z / sp.sqrt(2))
    p.show(
        f"I as a series in h: the integrand at h = zero, e = {error_function}, is",
        _coefficient(0),
        (1 - e**2) / 4,
    )
    rate = sp.diff(error_function, z) / normal(z, 0, 1)
    p.show(
        f"by parts twice, e' = {sp.simplify(rate)} phi: the first term is the mean step, "
        f"{sp.simplify(rate)} times the integral of the square of phi,",
        sp.simplify(rate) * _square(),
        p.mean_step,
    )
    least, most = sp.limit(error_function, z, -sp.oo), sp.limit(error_function, z, sp.oo)
    p.show(
        f"under phi e is uniform between {least} and {most}: the second, per h, is",
        sp.integrate(sp.cancel(_coefficient(1) / phi) / (most - least), (e, least, most)),
        -turning,
        "slope",
    )
    squares, products = sp.symbols("squares products")
    terms = phi**2 * e**2, z * phi * e
    curvature = _coefficient(2).subs(dict(zip(terms, (squares, products), strict=True)))
    p.show(
        f"the integrand of the third, per h h, has two terms, {' and '.join(map(str, terms))}:",
        sp.diff(curvature, squares) * squares + sp.diff(curvature, products) * products,
        curvature,
    )
    correlation = sp.Rational(1, 3)
    orthant = 2 / sp.pi * sp.asin(correlation)
    p.show(
        f"the one with squares by the orthant probability of correlation {correlation}, the other "
        "by parts: it is",
        curvature.subs({squares: _square() * orthant, products: 2 * _square()}),
        (1 - orthant) / (2 * ROOT_PI),
        "curvature",
    )


def _chain(p: Proof, model: Model) -> None:
    """Show the law of a chain, to first order, and where it vanishes."""
    steps = plateaus.derive(model).cycle / (2 * l0 * amplitude)
    half = p.show(
        "a chain: h =",
        sliding_limit.derive(model).width / (2 * l0 * sigma_theta),
        N * slope_margin / (2 * l0 * sigma_theta),
    )
    integral = sp.Function("I")
    exact = creeps(steps * l0 * sigma_theta * integral(sp.Symbol("h", real=True)))
    linear = p.show(
        f"velocity {sp.cancel(steps)} times l0 sigma I(h), to first order",
        steps * l0 * sigma_theta * (p.mean_step + p.slope * half),
        (N + 3 - 2 * i) * (l0 * sigma_theta / ROOT_PI - N * slope_margin / 3),
    )
    law = creeps(linear)
    exactly = exact, {symbol("h"): half}
    lacks = linear - steps * l0 * sigma_theta * p.mean_step
    p.entry("vitesse_random", leading(law, sigma_theta), exactly, lacks=lacks)
    at_cycles = velocity_of_cycles(model, sigma_theta * p.mean_step)
    p.entry("caption_of_plateaus", corrected=at_cycles, factor=1 / p.mean_step)
    following = steps * l0 * sigma_theta * p.curvature * half**2
    p.entry(
        "vitesse_seuil_random",
        law,
        exactly,
        following=p.curvature,
        relative=following / (p.curvature * steps),
    )
    threshold = p.show(
        "this line vanishes at sigma* =",
        solved(sp.cancel(linear / steps), sigma_theta),
        ROOT_PI * N * slope_margin / (3 * l0),
    )
    largest = half * sigma_theta
    p.entry("sigma_theta_star", {width_star: threshold, star: largest}, lines=3)
    two = p.show(
        "for two sliders, on their one plateau,",
        linear.subs({N: 2, i: 2}),
        l0 * sigma_theta / ROOT_PI - 2 * slope_margin / 3,
    )
    pair = creeps(two)
    of_two = {symbol("v_G"): l0 * sigma_theta * integral(symbol("h")) / tau_th}
    thin = {symbol("h"): half.subs(N, 2)}
    p.entry(
        "velocity_th_2_gaussian",
        leading(pair, sigma_theta),
        (pair, of_two, thin),
        lacks=two - l0 * sigma_theta * p.mean_step,
    )
    p.entry(
        "velocity_th_2_gaussienne_corrected",
        pair,
        (pair, of_two, thin),
        lacks=two - two.subs(mu_d, mu_s),
        following=p.curvature,
        relative=(following / (p.curvature * steps)).subs({N: 2, i: 2}),
    )
    zero = p.show("it vanishes at", solved(two, sigma_theta), threshold.subs(N, 2))
    factor = sp.cancel(zero.subs(mu_d, mu_s) / zero)
    p.entry(
        "threshold_th_2_gaussienne_corrected",
        {width_star: zero},
        factor=factor,
        number=factor.subs(CAPTIONS),
    )

    captions = CAPTIONS | {N: 2}
    as_printed = (zero * l0).subs(mu_d, mu_s).subs(captions)
    right = (zero * l0).subs(captions)
    p.alone(
        "two_slider_threshold_value",
        Within(as_printed, 1.05),
        Within(right, 1.002),
        stated=as_printed,
    )
    width = sp.Symbol("width", positive=True)
    margin = half.subs(l0, width / sigma_theta).subs(captions)
    law = p.mean_step + p.slope * margin + p.curvature * margin**2
    lacking = 1 - law / p.mean_step

    def below_at(value: Expression) -> Expression:
        return lacking.subs(width, value).evalf()

    first_order = (1 - (p.mean_step + p.slope * margin) / p.mean_step).subs(width, 1).evalf()
    percent, stated = sp.Rational(1, 100), 100
    exactly_at = max(sp.Poly(sp.together(lacking - percent).as_numer_denom()[0], width).nroots())
    rest, linear_rest = below_at(stated), first_order / stated
    p.checked(
        f"captions: below the asymptote by {percent} at l0 sigma = {worded(exactly_at, '.1f')}, by "
        f"{worded(rest, '.4f')} at {stated}",
        lambda: abs(below_at(exactly_at) - percent) < 1e-9 and rest < linear_rest < percent,
        "floating point, to second order in h",
    )

    def upper_bound(formula: Formula) -> bool:
        return not formula.relations and bool(
            below_at(formula.left) < 0.01 < below_at(formula.left / 4)
        )

    static = first_order * (static_margin / slope_margin).subs(captions)
    p.entry(
        "one_percent",
        upper_bound,
        (Within(exactly_at, 1.01), Within(static / percent, 1.01)),
        rest=rest,
        linear=static / stated,
        factor=stated * percent / static,
        exact_factor=stated / exactly_at,
    )
