"""That under independent Gaussian targets the sliding chain creeps by the integral I(h)."""

from __future__ import annotations

from functools import cache
from itertools import permutations

import sympy as sp

from derivations import plateaus, sliding_limit
from derivations.judges import leading, positive, vanishes, within
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
    sigma_theta,
    slope_margin,
    star,
    static_margin,
    symbol,
    tau_th,
)
from derivations.proof import Proof, chapter
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


@chapter(
    "Random dilations",
    "independent Gaussian targets",
    "sliding limit, or N = 2 averaged over the phase r_0",
)
def derive(p: Proof, model: Model) -> None:
    """Show the plateau under random dilations, the linear law and the exact law."""
    mean_step = p.show(
        "half the mean of |theta_1 - theta_2|, whose variance is 2, in units of sigma",
        sp.integrate(z * normal(z, 0, sp.sqrt(2)), (z, 0, sp.oo)),
        1 / ROOT_PI,
        "mean_step",
    )
    p.entry("two_slider_asymptote", l0 * sigma_theta * mean_step / tau_th)
    p.entry("gaussian_amplitude", sigma_theta * mean_step)

    def width_of_plateau(formula: Formula) -> bool:
        half_cycle = formula.right * mean_step
        return formula.left == sigma_theta and vanishes(half_cycle - sp.Rational(5, 1000))

    p.entry("equivalent_width", width_of_plateau)
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
    below = p.show(
        "play of half-width h, output -> clamp(output, y - h, y + h), y normal: it is "
        "below z if y + h is, A = Phi(z - h), or if it was and y - h is not above, "
        "B = Phi(-z - h): G = P(output < z) = A + (1 - A - B) G, so G =",
        solved(sp.Eq(G, A + (1 - B - A) * G), G),
        A / (A + B),
    )
    rises = p.show(
        "I(h) is the mean rise per target, the integral over z of P(output < z < y - h) =",
        below * B,
        A * B / (A + B),
    )
    p.proved(
        "I(h) > 0 for every h: no threshold; and it falls with h",
        lambda: positive(rises) and positive(sp.diff(rises, A)) and positive(sp.diff(rises, B)),
        "the integrand is positive, and A and B fall with h",
    )
    p.entry("no_random_threshold")
    p.entry("always_random_creep")
    p.show(
        "I = I_0 + I_1 h + I_2 h**2 + ...: the integrand at h = 0, e = erf(z/sqrt(2)), is",
        _coefficient(0),
        (1 - e**2) / 4,
    )
    p.show(
        "by parts twice, e' = 2 phi: I_0 = 2 times the integral of phi**2, the mean step",
        2 * _square(),
        p.mean_step,
    )
    p.show(
        "under phi e is uniform on (-1, 1): I_1 =",
        sp.integrate(sp.cancel(_coefficient(1) / phi) / 2, (e, -1, 1)),
        -turning,
        "slope",
    )
    squares, products = sp.symbols("squares products")
    curvature = _coefficient(2).subs({phi**2 * e**2: squares, z * phi * e: products})
    p.show(
        "the integrand of I_2 has two terms, phi**2 e**2 and z phi e:",
        sp.diff(curvature, squares) * squares + sp.diff(curvature, products) * products,
        curvature,
    )
    orthant = 2 / sp.pi * sp.asin(sp.Rational(1, 3))
    p.show(
        "phi**2 e**2 by the orthant probability of correlation 1/3, z phi e by parts: I_2 =",
        curvature.subs({squares: _square() * orthant, products: 2 * _square()}),
        (1 - orthant) / (2 * ROOT_PI),
        "curvature",
    )


def _chain(p: Proof, model: Model) -> None:
    """Show the law of a chain, to first order, and where it vanishes."""
    steps = plateaus.derive(model).cycle / (2 * l0 * amplitude)
    half = p.show(
        "a chain of N: h =",
        sliding_limit.derive(model).width / (2 * l0 * sigma_theta),
        N * slope_margin / (2 * l0 * sigma_theta),
    )
    linear = p.show(
        "velocity (N + 3 - 2i) l0 sigma I(h), to first order",
        steps * l0 * sigma_theta * (p.mean_step + p.slope * half),
        (N + 3 - 2 * i) * (l0 * sigma_theta / ROOT_PI - N * slope_margin / 3),
    )
    law = creeps(linear)
    p.entry("vitesse_random", leading(law, sigma_theta))
    p.entry("vitesse_seuil_random", law)
    threshold = p.show(
        "this line vanishes at sigma* =",
        solved(sp.cancel(linear / steps), sigma_theta),
        ROOT_PI * N * slope_margin / (3 * l0),
    )
    largest = half * sigma_theta
    p.entry("sigma_theta_star", {width_star: threshold, star: largest}, lines=3)
    two = p.show(
        "N = 2, i = 2",
        linear.subs({N: 2, i: 2}),
        l0 * sigma_theta / ROOT_PI - 2 * slope_margin / 3,
    )
    pair = creeps(two)
    p.entry("velocity_th_2_gaussian", leading(pair, sigma_theta), pair)
    p.entry("velocity_th_2_gaussienne_corrected", pair)
    zero = p.show("it vanishes at", solved(two, sigma_theta), threshold.subs(N, 2))
    p.entry("threshold_th_2_gaussienne_corrected", {width_star: zero})

    captions = CAPTIONS | {N: 2}
    printed = (2 * ROOT_PI / 3 * static_margin).subs(captions)
    p.alone("two_slider_threshold_value", within(printed, 1.05))
    width = sp.Symbol("width", positive=True)
    margin = half.subs(l0, width / sigma_theta).subs(captions)
    law = p.mean_step + p.slope * margin + p.curvature * margin**2
    lacking = 1 - law / p.mean_step

    def below_at(value: Expression) -> Expression:
        return lacking.subs(width, value).evalf()

    p.checked(
        "captions: 1 % below the asymptote at l0 sigma = 28.6, 0.29 % at 100",
        lambda: below_at(28.6) < 0.01 < below_at(28.5) and 0.0028 < below_at(100) < 0.003,
        "floating point, to second order in h",
    )

    def upper_bound(formula: Formula) -> bool:
        return not formula.relations and bool(
            below_at(formula.left) < 0.01 < below_at(formula.left / 4)
        )

    p.entry("one_percent", upper_bound)
