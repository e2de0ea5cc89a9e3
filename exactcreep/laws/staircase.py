"""The exact velocity of two sliders without disorder under cycles: a staircase of the amplitude."""

from __future__ import annotations

from fractions import Fraction

from exactcreep.laws.number_types import (
    cosine,
    floor_of_surd,
    positive_part,
    rational,
    require,
)
from exactcreep.laws.paper import law, margin


@law
def staircase_two_sliders(l0, mu_d, mu_s, tan_alpha, amplitude, r0=0):
    """Return the velocity of two sliders under dilation cycles, sigma_mu = 0, exactly.

    The velocity is ``D`` times the number of rho in ``r0 + D + 2D Z`` with
    ``|rho| < l0 amplitude - m``. For the relaxed chain this gives
    ``2D max(0, ceil((l0 amplitude - a)/(2D)))``, and ``max(0, l0 amplitude - m)`` if mu_s = mu_d.
    The number of slips is decided at the exact values of the arguments. Source:
    ``derivations/two_sliders.py``; the exact form of Eq. 15.

    Parameters
    ----------
    l0, mu_d, mu_s, tan_alpha, amplitude : number
        See `exactcreep.laws`.
    r0 : number, optional
        x_2 - x_1 - l0 at theta = 0.

    Returns
    -------
    number
        Advance of the centre of mass per half-cycle, unit ``g tau_dyn**2``.

    Raises
    ------
    ValueError
        Unless ``0 < tan_alpha < mu_d <= mu_s``.

    Examples
    --------
    >>> round(staircase_two_sliders(**slope, mu_s=0.6, amplitude=0.005), 4)
    4.8507
    """
    friction, static, slope = rational(mu_d), rational(mu_s), rational(tan_alpha)
    said = f"not at tan_alpha = {tan_alpha}, mu_d = {mu_d}, mu_s = {mu_s}"
    range_of_the_law = "two sliders creep by this law for 0 < tan_alpha < mu_d <= mu_s"
    require(0 < slope < friction <= static, f"{range_of_the_law}, {said}")
    excess = static - friction
    if excess == 0:
        return positive_part(l0 * amplitude - margin(mu_d, tan_alpha))
    # everything in units of 2D: 1/c = sqrt(1 + tan_alpha**2) is the only surd
    radicand = 1 + slope * slope
    reach, offset = rational(l0) * rational(amplitude) / (2 * excess), rational(r0) / (2 * excess)
    friction_margin = (friction - slope) / (2 * excess)
    first = floor_of_surd(-reach - offset, radicand, friction_margin - Fraction(1, 2)) + 1
    last = -floor_of_surd(offset - reach, radicand, friction_margin + Fraction(1, 2)) - 1
    return max(0, last - first + 1) * ((mu_s - mu_d) * cosine(tan_alpha))
