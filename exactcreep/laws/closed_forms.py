"""The exact laws behind the paper's formulas: a staircase of two sliders, a Gaussian integral."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction

from mpmath.ctx_mp import MPContext

from exactcreep.laws.operands import (
    Number,
    coerced,
    cosine,
    elementwise,
    floor_of_surd,
    is_mpf,
    positive_part,
    rational,
)


def staircase_two_sliders(
    l0: Number,
    mu_d: Number,
    mu_s: Number,
    tan_alpha: Number,
    amplitude: Number,
    r0: Number = 0,
) -> Number:
    """Return tau_th <v_G> of two sliders under dilation cycles, sigma_mu = 0, exactly.

    Parameters
    ----------
    l0, mu_d, mu_s, tan_alpha, amplitude : number
        The chain and the drive, 0 < tan_alpha < mu_d <= mu_s.
    r0 : number, optional
        x_2 - x_1 - l0 at theta = 0, in units of g tau_dyn**2 (conserved modulo 2D); 0 is the
        relaxed chain.

    Returns
    -------
    number
        ``D`` times the number of rho in ``r0 + D + 2D Z`` with ``|rho| < l0 amplitude - m``; for
        the relaxed chain ``2D max(0, ceil((l0 amplitude - a)/(2D)))``; ``max(0, l0 amplitude - m)``
        where mu_s = mu_d. In units of g tau_dyn**2 per half-cycle.

    Raises
    ------
    ValueError
        If not 0 < tan_alpha < mu_d <= mu_s.

    Notes
    -----
    Guarantee: the number of slips is decided exactly at the arguments' exact values.
    Derivation: ``derivations/two_sliders.py``; exact form of Eq. (velocity_th_2_cycle_corrected).
    """
    given = {"l0": l0, "mu_d": mu_d, "mu_s": mu_s, "tan_alpha": tan_alpha}
    return _staircase(**coerced(given | {"amplitude": amplitude, "r0": r0}))


@elementwise
def _staircase(
    l0: Number, mu_d: Number, mu_s: Number, tan_alpha: Number, amplitude: Number, r0: Number
) -> Number:
    friction, static, slope = rational(mu_d), rational(mu_s), rational(tan_alpha)
    if not 0 < slope < friction <= static:
        raise ValueError(
            "two sliders creep by this law for 0 < tan_alpha < mu_d <= mu_s, not at "
            f"tan_alpha = {tan_alpha}, mu_d = {mu_d}, mu_s = {mu_s}"
        )
    excess = static - friction
    if excess == 0:
        return positive_part(l0 * amplitude - (mu_d - tan_alpha) * cosine(tan_alpha))
    # everything in units of 2D: 1/c = sqrt(1 + tan_alpha**2) is the only surd
    radicand = 1 + slope * slope
    room, offset = rational(l0) * rational(amplitude) / (2 * excess), rational(r0) / (2 * excess)
    margin = (friction - slope) / (2 * excess)
    first = floor_of_surd(-room - offset, radicand, margin - Fraction(1, 2)) + 1
    last = -floor_of_surd(offset - room, radicand, margin + Fraction(1, 2)) - 1
    return max(0, last - first + 1) * ((mu_s - mu_d) * cosine(tan_alpha))


def gaussian_integral(h: Number) -> Number:
    """Return I(h), the mean advance of a play operator driven by independent normal numbers.

    ``I(h) = integral over z of Phi(z-h) Phi(-z-h) / (Phi(z-h) + Phi(-z-h))``, Phi the normal
    distribution function. For small h,
    ``I(h) = 1/sqrt(pi) - 2h/3 + (1 - (2/pi) asin(1/3)) h**2/(2 sqrt(pi)) + ...``.

    Parameters
    ----------
    h : number or array
        Half-width of the play in units of the drive's standard deviation, h >= 0.

    Returns
    -------
    float, array or mpf
        I(h), positive.

    Raises
    ------
    ValueError
        If an h is negative or not finite.

    Notes
    -----
    Guarantee: computed; the trapezoidal sum has converged, and what remains is the rounding of the
    operand's arithmetic (mpmath: a unit of the last place; float64: 1e-15 (1 + h**2/10), relative).
    Derivation: ``derivations/gaussian.py``; the law behind Eqs. (vitesse_seuil_random) and
    (velocity_th_2_gaussienne_corrected).
    """
    return _integral(coerced({"h": h})["h"])


@elementwise
def _integral(h: Number) -> Number:
    if not h >= 0 or h == math.inf:
        raise ValueError(f"h must be finite and not negative, not {h}")
    if not is_mpf(h):
        return _trapezoid(float(h), math.erfc, 1.0, 51)
    working = MPContext()
    working.prec = h.context.prec + 32
    inner = working.make_mpf(h._mpf_)
    value = _trapezoid(inner, working.erfc, working.mpf(1), h.context.prec + 12)
    return +h.context.make_mpf(value._mpf_)


def _trapezoid(
    h: Number, complement: Callable[[Number], Number], unit: Number, bits: int
) -> Number:
    """Return I(h) by the trapezoidal rule, halving the step until two values agree to `bits`."""
    # The integrand is even, analytic, and decays faster than exp(-z**2/2 - h z): the rule converges
    # geometrically in 1/step. The nearest pole is at a distance of order pi/(2h).
    root_two = (2 * unit) ** (unit / 2)
    decay = bits * 0.6931471805599453
    large = float(h)
    reach = unit * (math.sqrt(large * large + 2 * decay) - large + 1)
    count = 16

    def term(z: Number) -> Number:
        # tails of a normal distribution: falling and rising side
        thin, thick = complement((h + z) / root_two) / 2, complement((h - z) / root_two) / 2
        return thin / (1 + thin / thick) if thick else thin * 0

    step = reach / count
    total = term(unit * 0) / 2 + sum(term(step * k) for k in range(1, count + 1))
    value = 2 * step * total
    while True:
        total += sum(term(step * (2 * k + 1) / 2) for k in range(count))
        count, step = 2 * count, step / 2
        previous, value = value, 2 * step * total
        # halving the step at least squares the error; `value - previous` is the error before it
        if abs(value - previous) <= abs(value) * unit * 2.0 ** (-0.6 * bits) or count > 1 << 16:
            return value
