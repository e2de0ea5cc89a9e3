"""The exact velocities of the sliding limit, under cycles and under random dilations."""

from __future__ import annotations

import math
from collections.abc import Callable

from mpmath.ctx_mp import MPContext

from exactcreep.laws.number_types import Number, is_mpf, positive_part, require
from exactcreep.laws.paper import law, margin


@law
def sliding_velocity(*, n, l0, mu_d, tan_alpha, amplitude, i=None):
    """Return ``(N+3-2i) max(0, l0 A - N m/2)``, exact for mu_s -> mu_d.

    ``m = mu_d cos(alpha) - sin(alpha)``. For two sliders the law is also the mean of the staircase
    over the phase of the start. Source: the exact form of Eq. 23, ``derivations/sliding_limit.py``.

    Parameters
    ----------
    n : int
        Number of sliders N.
    l0, mu_d, tan_alpha, amplitude : number
        See `exactcreep.laws`.
    i : int, optional
        Index of the plateau. Default: by the slope.

    Returns
    -------
    number
        Advance of the centre of mass per half-cycle, unit ``g tau_dyn**2``.

    Raises
    ------
    ValueError
        If i is not given and the slope has not one plateau.

    Examples
    --------
    >>> round(sliding_velocity(n=30, **slope, amplitude=0.005), 4)
    20.4295
    """
    return (n + 3 - 2 * i) * positive_part(l0 * amplitude - n * margin(mu_d, tan_alpha) / 2)


@law
def sliding_velocity_random(*, n, l0, mu_d, tan_alpha, sigma_theta, i=None):
    """Return ``(N+3-2i) l0 sigma_theta I(h)`` with ``h = N m/(2 l0 sigma_theta)``.

    I(h) is `gaussian_integral`, ``m = mu_d cos(alpha) - sin(alpha)``. The law is exact for
    mu_s -> mu_d, and for two sliders in the mean over the phase of the start. Source: the law
    behind Eqs. 17 and 24, ``derivations/gaussian.py``.

    Parameters
    ----------
    n : int
        Number of sliders N.
    l0, mu_d, tan_alpha, sigma_theta : number
        See `exactcreep.laws`.
    i : int, optional
        Index of the plateau. Default: by the slope.

    Returns
    -------
    number
        Advance of the centre of mass per target, unit ``g tau_dyn**2``.

    Raises
    ------
    ValueError
        If i is not given and the slope has not one plateau. Unless n, l0 and sigma_theta are
        positive.

    Examples
    --------
    >>> round(sliding_velocity_random(n=30, **slope, sigma_theta=0.01), 4)
    52.7969
    """
    require(sigma_theta > 0, "sigma_theta must be positive")
    width = l0 * sigma_theta
    return (n + 3 - 2 * i) * width * gaussian_integral(n * margin(mu_d, tan_alpha) / (2 * width))


@law
def gaussian_integral(h):
    """Return I(h), the mean advance of a play operator driven by independent normal numbers.

    ``I(h) = integral over z of Phi(z-h) Phi(-z-h) / (Phi(z-h) + Phi(-z-h))``, Phi the normal
    distribution function. For small h,
    ``I(h) = 1/sqrt(pi) - 2h/3 + (1 - (2/pi) asin(1/3)) h**2/(2 sqrt(pi)) + ...``. The relative
    error is a unit of the last place of mpmath numbers, and 1e-15 (1 + h**2/10) of other numbers.
    Source: beyond the paper, ``derivations/gaussian.py``.

    Parameters
    ----------
    h : number
        Half-width of the play in units of the drive's standard deviation.

    Returns
    -------
    number
        I(h).

    Raises
    ------
    ValueError
        Unless h is finite and not negative.

    Examples
    --------
    >>> round(gaussian_integral(0), 10), round(gaussian_integral(1), 10)
    (0.5641895835, 0.1241080768)
    """
    require(0 <= h < math.inf, f"h must be finite and not negative, not {h}")
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
    large, count, value = float(h), 16, unit * math.inf
    reach = unit * (math.sqrt(large * large + 2 * bits * math.log(2)) - large + 1)

    def term(z: Number) -> Number:
        # tails of a normal distribution: falling and rising side
        thin, thick = complement((h + z) / root_two) / 2, complement((h - z) / root_two) / 2
        return thin / (1 + thin / thick) if thick else thin * 0

    while True:
        step = reach / count
        total = term(unit * 0) / 2 + sum(term(step * k) for k in range(1, count + 1))
        previous, value = value, 2 * step * total
        # halving the step at least squares the error; `value - previous` is the error before it
        if abs(value - previous) <= abs(value) * unit * 2.0 ** (-0.6 * bits) or count > 1 << 16:
            return value
        count *= 2
