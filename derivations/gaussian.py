"""That under independent Gaussian targets the sliding chain creeps by the integral I(h)."""

from __future__ import annotations

from functools import cache
from itertools import permutations

import mpmath
import sympy as sp
from mpmath.ctx_mp import MPContext

from derivations import plateaus, sliding_limit
from derivations.entry import Backed, Backing, Lines, entries_of
from derivations.judges import Judge, equals, follows, leading, vanishes
from derivations.model import Model, solved
from derivations.notation import (
    Expression,
    Formula,
    N,
    amplitude,
    c,
    i,
    l0,
    mu_d,
    mu_s,
    s,
    sigma_theta,
    slope_margin,
    symbol,
)
from derivations.proof import Proof, chapter

z = sp.Symbol("z", real=True)
h, A, B, phi = sp.symbols("h A B phi", positive=True)
"""Half-width of the play; Phi(z - h), Phi(-z - h); the normal density at z."""
e, G, tau_th = sp.Symbol("e", real=True), symbol("G"), symbol("tau_th")
"""erf(z/sqrt(2)); probability that the play's output is below z."""
DENSITY = sp.exp(-(z**2) / 2) / sp.sqrt(2 * sp.pi)
NORMAL = (1 + sp.erf(z / sp.sqrt(2))) / 2


def coefficients() -> tuple[Expression, ...]:
    """Return the coefficients of 1, h and h**2 in the integrand A B/(A + B), in e, phi and z."""
    at = {A: NORMAL.subs(z, z - h), B: NORMAL.subs(z, -z - h)}
    expanded = {
        side: sum(sp.diff(value, h, k).subs(h, 0) * h**k / sp.factorial(k) for k in range(3))
        for side, value in at.items()
    }
    integrand = (A * B / (A + B)).subs(expanded, simultaneous=True)
    integrand = sp.expand(integrand).subs(sp.erf(sp.sqrt(2) * z / 2), e)
    integrand = integrand.subs(sp.exp(-(z**2) / 2), sp.sqrt(2 * sp.pi) * phi)
    return tuple(
        sp.expand(sp.cancel(sp.diff(integrand, h, k).subs(h, 0) / sp.factorial(k)))
        for k in range(3)
    )


def integral(half_width: object, digits: int = 30) -> mpmath.mpf:
    """Return I(h) by adaptive quadrature, to about the digits asked."""
    ctx = MPContext()
    ctx.dps = digits + 10
    half = ctx.convert(half_width)

    def integrand(at: mpmath.mpf) -> mpmath.mpf:
        thin, thick = ctx.ncdf(at - half), ctx.ncdf(-at - half)
        return thin * thick / (thin + thick)

    edge = ctx.sqrt(2 * (digits + 10) * ctx.log(10))
    return ctx.quad(integrand, [-edge, -2, -0.5, 0, 0.5, 2, edge])


@chapter(
    "Random dilations",
    "independent Gaussian targets",
    "sliding limit, or N = 2 averaged over the phase r_0",
)
def derive(p: Proof, model: Model) -> None:
    """Show the plateau under random dilations, the linear law and the exact law."""
    apart = sp.exp(-(z**2) / 4) / sp.sqrt(4 * sp.pi)  # of theta_1 - theta_2, variance 2
    step = p.show(
        "half the mean of |theta_1 - theta_2|, in units of sigma",
        sp.simplify(2 * sp.integrate(z * apart, (z, 0, sp.oo)) / 2),
        1 / sp.sqrt(sp.pi),
        "mean_step",
    )
    orders = list(permutations(range(3)))
    turns = [o for o in orders if (o[1] - o[0]) * (o[2] - o[1]) < 0]
    turning = p.show(
        "three independent targets turn with the probability",
        sp.Rational(len(turns), len(orders)),
        sp.Rational(2, 3),
        "turning",
    )
    below = p.show(
        "play of half-width h, output -> clamp(output, y - h, y + h), y normal: it is "
        "below z if y + h is, A = Phi(z - h), or if it was and y - h is not above, "
        "B = Phi(-z - h): G = P(output < z) = A + (1 - A - B) G, so G =",
        solved(sp.Eq(G, A + (1 - B - A) * G), G),
        A / (A + B),
        "stationary",
    )
    rises = p.show(
        "I(h) is the mean rise per target, the integral over z of P(output < z < y - h) =",
        below * B,
        A * B / (A + B),
        "advance",
    )
    p.proved(
        "I(h) > 0 for every h: no threshold; and it falls with h",
        lambda: (
            rises.is_positive
            and sp.cancel(sp.diff(rises, A)).is_positive
            and sp.cancel(sp.diff(rises, B)).is_positive
        ),
        "the integrand is positive, and A and B fall with h",
        "positive",
    )
    zeroth, slope, curvature = coefficients()
    square = sp.integrate(DENSITY**2, (z, -sp.oo, sp.oo))
    p.show(
        "I = I_0 + I_1 h + I_2 h**2 + ...: the integrand at h = 0, e = erf(z/sqrt(2)), is",
        zeroth,
        (1 - e**2) / 4,
    )
    first = p.show(
        "by parts twice, e' = 2 phi: I_0 = 2 times the integral of phi**2 =",
        2 * square,
        1 / sp.sqrt(sp.pi),
    )
    p.show("... which is the mean step", first, step)
    second = p.show(
        "under phi e is uniform on (-1, 1): I_1 =",
        sp.integrate(sp.cancel(slope / phi) / 2, (e, -1, 1)),
        -turning,
        "slope",
    )
    moments = {
        phi**2 * e**2: square * 2 / sp.pi * sp.asin(sp.Rational(1, 3)),
        z * phi * e: 2 * square,
    }
    third = p.show(
        "phi**2 e**2 by the orthant probability of correlation 1/3, z phi e by parts: I_2 =",
        sum(
            curvature.coeff(phi, k).coeff(z, 2 - k).coeff(e, k if k == 2 else 1) * moment
            for k, moment in zip((2, 1), moments.values(), strict=True)
        ),
        (1 - 2 / sp.pi * sp.asin(sp.Rational(1, 3))) / (2 * sp.sqrt(sp.pi)),
        "curvature",
    )
    p.proved(
        "... there are no other terms",
        lambda: vanishes(
            curvature
            - sum(
                curvature.coeff(phi, k).coeff(z, 2 - k).coeff(e, k if k == 2 else 1) * term
                for k, term in zip((2, 1), moments, strict=True)
            )
        ),
        "polynomial in e, phi and z",
    )
    p.checked(
        "I(h) less the three terms is of third order, I_2 = 0.2210644592",
        lambda: _series(first, second, third),
        "quadrature at h = 1e-6, 30 digits",
    )
    steps = plateaus.derive(model).cycle / (2 * l0 * amplitude)
    half = sliding_limit.derive(model).width / (2 * l0 * sigma_theta)
    p.show("a chain of N: h =", half, N * slope_margin / (2 * l0 * sigma_theta), "half_width")
    linear = p.show(
        "velocity (N + 3 - 2i) l0 sigma I(h), to first order",
        steps * l0 * sigma_theta * (first + second * half),
        (N + 3 - 2 * i) * (l0 * sigma_theta / sp.sqrt(sp.pi) - N * slope_margin / 3),
        "linear",
    )
    two = linear.subs({N: 2, i: 2})
    p.show("N = 2, i = 2", two, l0 * sigma_theta / sp.sqrt(sp.pi) - 2 * slope_margin / 3, "two")
    p.show(
        "this line vanishes at sigma* =",
        solved(sp.cancel(linear / steps), sigma_theta),
        sp.sqrt(sp.pi) * N * slope_margin / (3 * l0),
        "threshold",
    )
    p.show(
        "N = 2",
        solved(two, sigma_theta),
        2 * sp.sqrt(sp.pi) * slope_margin / (3 * l0),
        "threshold_two",
    )
    p.checked(
        "captions: 1 % below the asymptote at l0 sigma = 28.6, 0.29 % at 100",
        lambda: 28.5 < _asymptote(half)[0] < 28.6 and 0.0028 < _asymptote(half)[1] < 0.003,
        "floating point",
        "one_percent",
    )


def _series(*terms: Expression) -> bool:
    """Return whether the remainder of the series is of third order, and its last coefficient."""
    ctx = MPContext()
    ctx.dps = 40
    small = ctx.mpf("1e-6")
    near = sum(ctx.mpf(str(sp.N(term, 40))) * small**k for k, term in enumerate(terms))
    return bool(
        abs(ctx.convert(integral(small, 30)) - near) < small**3
        and abs(sp.N(terms[-1], 20) - sp.Rational("0.2210644592")) < 1e-10
    )


@cache
def _asymptote(half: Expression) -> tuple[float, float]:
    """Return, at the captions' values, l0 sigma where the law is 1 % below its asymptote, and how
    much it is below at l0 sigma = 100."""
    cosine = 1 / sp.sqrt(1 + sp.Rational(1, 16))
    captions = {N: 2, mu_d: sp.Rational(1, 2), s: cosine / 4, c: cosine}
    margin = mpmath.mpf(str(sp.N((half * l0 * sigma_theta).subs(captions), 20)))

    def lacking(width: mpmath.mpf) -> mpmath.mpf:
        return 1 - mpmath.sqrt(mpmath.pi) * integral(margin / width, 15)

    exact = mpmath.findroot(lambda width: lacking(width) - mpmath.mpf("0.01"), 28)
    return float(exact), float(lacking(mpmath.mpf(100)))


def _about_four_tenths(formula: Formula) -> bool:
    """Judge `0.4` as the printed threshold times l0, to one digit."""
    cosine = 1 / sp.sqrt(1 + sp.Rational(1, 16))
    printed = 2 * sp.sqrt(sp.pi) / 3 * (mu_s * c - s)
    numbers = {mu_s: sp.Rational(3, 5), mu_d: sp.Rational(1, 2), s: cosine / 4, c: cosine}
    return not formula.relations and abs(float(printed.subs(numbers) - formula.left)) < 0.05


def _asymptote_reached(r: Lines) -> Judge:
    """Judge the width from which on the law is within 1 % of its asymptote: an upper bound."""
    exact = _asymptote(r.half_width)[0]
    return lambda formula: not formula.relations and exact <= float(formula.left) <= 4 * exact


def _chain(r: Lines) -> dict[object, object]:
    law = r.linear / tau_th
    return {"v_N_star": lambda index: law.subs(i, index)}


def _two(r: Lines) -> dict[object, object]:
    return {symbol("v_G"): r.two / tau_th}


def _equivalent(r: Lines) -> Judge:
    step = r.mean_step
    return lambda formula: (
        formula.left == sigma_theta and vanishes(formula.right * step - sp.Rational(5, 1000))
    )


LINES: dict[str, Backed | None] = {
    "velocity_th_2_gaussian": lambda r: Backing(leading(_two(r), sigma_theta), follows(_two(r))),
    "turning_points": lambda r: equals(r.turning),
    "velocity_th_2_gaussienne_corrected": lambda r: follows(_two(r)),
    "threshold_th_2_gaussienne_corrected": lambda r: follows(
        {symbol("sigma_theta_star"): r.threshold_two}
    ),
    "two_slider_asymptote": lambda r: equals(l0 * sigma_theta * r.mean_step / tau_th),
    "two_slider_threshold_value": lambda r: _about_four_tenths,
    "one_percent": lambda r: Backing(_asymptote_reached(r), evidence=r.one_percent is None),
    "no_random_threshold": lambda r: r.positive is None,
    "gaussian_amplitude": lambda r: equals(sigma_theta * r.mean_step),
    "vitesse_random": lambda r: leading(_chain(r), sigma_theta),
    "sigma_theta_star": lambda r: follows(
        {
            symbol("sigma_theta_star"): r.threshold,
            symbol("A_theta_star"): r.half_width * sigma_theta,
        }
    ),
    "vitesse_seuil_random": lambda r: follows(_chain(r)),
    "always_random_creep": lambda r: r.positive is None,
    "equivalent_width": _equivalent,
}
ENTRIES = entries_of("gaussian", derive, LINES)
