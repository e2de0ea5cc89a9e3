"""The formulas of the paper, each as a function, and the plateaus that the slope decides.

`l0` is the natural length of a spring in units of g tau_dyn**2, `amplitude` and `sigma_theta` are
those of the dilations, `i` is the index of a plateau: slider i - 1 rests during a dilation. A
velocity is tau_th <v_G>, the advance of the centre of mass per half-cycle (cycles) or per target
(random dilations), in units of g tau_dyn**2; amplitudes and thresholds are dimensionless.

For two sliders the paper prints mu_s where these laws, at N = 2 and i = 2, have mu_d: Eqs.
(threshold_th_2_cycle_corrected) and (threshold_th_2_gaussienne_corrected) are `threshold_amplitude`
and `threshold_width` of ``mu_d=mu_s``. The threshold's temperature is its amplitude over kappa.

``c = cos(alpha)``, ``s = sin(alpha)``, ``m = mu_d c - s``, ``a = mu_s c - s``,
``D = (mu_s - mu_d) c``. Labels are those of the paper's equations; what is proved of each, and
what is printed wrong, stands in ``derivations/ledger.toml``.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping
from inspect import signature
from typing import NamedTuple

from mpmath.ctx_mp import MPContext

from exactcreep.laws.arithmetic import (
    Number,
    coerced,
    cosine,
    elementwise,
    rational,
    real,
    require,
    root_of_pi,
)


def pivots(n: int, tan_alpha: Number, mu_d: Number) -> tuple[int, ...]:
    """Return the one index i of the sliding limit's plateau, or the two where it is not unique.

    It is ``(i,)`` with ``mu_d (1 - 2(i-1)/n) < tan_alpha < mu_d (1 - 2(i-2)/n)``, or ``(i, i + 1)``
    at the edge between the two, decided at the exact values of the arguments. Slider i - 1 rests
    while the chain dilates, slider n + 2 - i while it contracts. ValueError if |tan_alpha| >= mu_d
    or n < 1.

    Derivation: ``derivations/pivots.py`` and ``derivations/sliding_limit.py``; window of
    Eq. (critical_angle) for mu_s -> mu_d.
    """
    count, slope, friction = int(n), rational(tan_alpha), rational(mu_d)
    require(1 <= count == n, f"n must be a positive integer, not {n}")
    inside = "tan_alpha must lie between -mu_d and mu_d for a pivot, not at"
    require(abs(slope) < friction, f"{inside} {tan_alpha}")
    # tan_alpha n / mu_d lies between n - 2i + 2 and n - 2i + 4
    position = (count + 2 - count * slope / friction) / 2
    lowest = math.ceil(position)
    return (lowest, lowest + 1) if position == lowest else (lowest,)


def pivot(n: int, tan_alpha: Number, mu_d: Number) -> int:
    """Return the one index of `pivots`; raise ValueError where it is not unique, as `pivots`."""
    found = pivots(n, tan_alpha, mu_d)
    name = " or ".join(f"i = {i}" for i in found)
    place = f"the sliding limit of n = {n} at tan_alpha = {tan_alpha}"
    require(len(found) == 1, f"{place} is not unique: name {name}")
    return found[0]


_pivot = elementwise(pivot)
_POSITIVE = ("n", "l0")


def law(function: Callable[..., Number]) -> Callable[..., Number]:
    """Return a formula that takes numbers of any kind, and gives one of their common arithmetic.

    An index `i` that is not given is that of the sliding limit; n and l0 must be positive.
    """
    signed = signature(function)

    @functools.wraps(function)
    def of_any(*ordered: Number, **named: Number) -> Number:
        taken = signed.bind(*ordered, **named)
        taken.apply_defaults()
        given = taken.arguments
        if given.get("i", 0) is None:  # decided on the values as given, before any is rounded
            plateau = {name: real(given[name], name) for name in ("n", "tan_alpha", "mu_d")}
            given["i"] = _pivot(**plateau)
        values = coerced(given)
        for name in _POSITIVE:
            require(name not in values or values[name] > 0, f"{name} must be positive")
        return function(**values)

    return of_any


def law_values(
    law: Callable[..., Number], parameters: Mapping[str, Number], bits: int | None = None
) -> tuple[float, ...]:
    """Return what a law gives for rationals by name, rounded to floats from `bits` if given.

    Two values where the plateau is not unique, none where the slope has no plateau.
    """
    names = signature(law).parameters
    given = {name: value for name, value in parameters.items() if name in names}
    if bits is not None:
        context = MPContext()
        context.prec = bits
        given = {name: context.mpf(v.numerator) / v.denominator for name, v in given.items()}
    if "i" not in names or names["i"].default is names["i"].empty or "i" in given:
        return (float(law(**given)),)
    n, slope, friction = (parameters[name] for name in ("n", "tan_alpha", "mu_d"))
    if abs(slope) >= friction:
        return ()
    return tuple(float(law(**given, i=i)) for i in pivots(int(n), slope, friction))


def margin(mu: Number, tan_alpha: Number) -> Number:
    return (mu - tan_alpha) * cosine(tan_alpha)


def _excess(mu_d: Number, mu_s: Number, tan_alpha: Number) -> Number:
    return (mu_s - mu_d) * cosine(tan_alpha)


class PivotWindow(NamedTuple):
    """The slopes between which the index i of a plateau is possible.

    Slider i - 1 can rest during a dilation for ``lower <= tan_alpha <= upper``; between
    `lower_alone` and `upper_alone` no other can: outside, the pivot depends on the chain's history.
    Where ``mu_s - mu_d > mu_d`` the windows of i - 1 and i + 1 overlap each other, so that there is
    no slope at which no other slider can rest: `lower_alone` and `upper_alone` are None.
    """

    lower: Number
    lower_alone: Number | None
    upper_alone: Number | None
    upper: Number


@law
def critical_angle(*, n, i, mu_d, mu_s):
    """Return the slope ``mu_d (1 - 2(i-1)/N) + (mu_s - mu_d)/N``, Eq. (critical_angle)."""
    return mu_d * (1 - 2 * (i - 1) / n) + (mu_s - mu_d) / n


def pivot_window(n: int, i: int, mu_d: Number, mu_s: Number) -> PivotWindow:
    """Return the slopes between which slider i - 1 can rest while the chain dilates.

    Neighbouring windows overlap over a width 2 (mu_s - mu_d)/n: the upper edge is Eq.
    (critical_angle) with i - 1 for i, and `lower_alone` is that equation itself. ValueError if not
    2 <= i <= n + 1. Derivation: ``derivations/pivots.py``.
    """
    require(2 <= i <= n + 1, f"i must be between 2 and n + 1 = {n + 1}, not {i}")
    known = coerced({"mu_d": mu_d, "mu_s": mu_s, "n": n, "i": i})
    middle = known["mu_d"] * (1 - 2 * (known["i"] - 1) / known["n"])
    upper = known["mu_d"] * (1 - 2 * (known["i"] - 2) / known["n"])
    half = (known["mu_s"] - known["mu_d"]) / known["n"]
    if middle + half > upper - half:
        return PivotWindow(middle - half, None, None, upper + half)
    return PivotWindow(middle - half, middle + half, upper - half, upper + half)


def plateau_ends(*, mu_d: Number, sigma_mu: Number) -> tuple[float, float]:
    """Return the ends of the plateau of two sliders, ``sigma_mu/sqrt(2)`` off 0 and off mu_d."""
    width = float(sigma_mu) / math.sqrt(2)
    return width, float(mu_d) - width


@law
def plateau_velocity(*, n, l0, mu_d, tan_alpha, amplitude, i=None):
    """Return ``(N+3-2i) l0 A``, Eq. (vitesse); Eq. (velocity_th_2_cycle) for two sliders."""
    return (n + 3 - 2 * i) * l0 * amplitude


@law
def plateau_velocity_random(*, n, l0, mu_d, tan_alpha, sigma_theta, i=None):
    """Return ``(N+3-2i) l0 sigma_theta/sqrt(pi)``; Eq. (velocity_th_2_gaussian) for N = 2."""
    return (n + 3 - 2 * i) * l0 * sigma_theta / root_of_pi(l0)


@law
def pivot_force(*, n, i, mu_d, tan_alpha):
    """Return ``(N+1-i) m``, the force on the pivot after a dilation: Eq. (forcestatique)."""
    return (n + 1 - i) * margin(mu_d, tan_alpha)


@law
def threshold_amplitude(*, n, l0, mu_d, tan_alpha):
    """Return ``A* = N m/(2 l0)``, Eq. (seuil).

    >>> from fractions import Fraction
    >>> threshold_amplitude(n=30, l0=1000, mu_d=Fraction(1, 2), tan_alpha=Fraction(7, 24))
    Fraction(3, 1000)
    """
    return n * margin(mu_d, tan_alpha) / (2 * l0)


@law
def onset_amplitude(*, n, l0, mu_d, mu_s, tan_alpha):
    """Return ``(N m + D)/(2 l0)``, Eq. (seuil) corrected: the whole chain is set in motion."""
    return (n * margin(mu_d, tan_alpha) + _excess(mu_d, mu_s, tan_alpha)) / (2 * l0)


@law
def threshold_width(*, n, l0, mu_d, tan_alpha):
    """Return ``sigma_theta* = (2/3) sqrt(pi) A*``, before Eq. (vitesse_seuil_random)."""
    return root_of_pi(l0) * n * margin(mu_d, tan_alpha) / (3 * l0)


@law
def creep_velocity(*, n, l0, mu_d, tan_alpha, amplitude, i=None):
    """Return ``(N+3-2i) (l0 A - N m/2)``, Eq. (vitesse_seuil); it holds where not negative."""
    return (n + 3 - 2 * i) * (l0 * amplitude - n * margin(mu_d, tan_alpha) / 2)


@law
def creep_velocity_random(*, n, l0, mu_d, tan_alpha, sigma_theta, i=None):
    """Return ``(N+3-2i) (l0 sigma_theta/sqrt(pi) - N m/3)``, Eq. (vitesse_seuil_random)."""
    linear = l0 * sigma_theta / root_of_pi(l0)
    return (n + 3 - 2 * i) * (linear - n * margin(mu_d, tan_alpha) / 3)


@law
def two_sliders_velocity(*, l0, mu_s, tan_alpha, amplitude):
    """Return ``l0 A - a``, Eq. (velocity_th_2_cycle_corrected), as printed."""
    return l0 * amplitude - margin(mu_s, tan_alpha)


@law
def two_sliders_velocity_random(*, l0, mu_s, tan_alpha, sigma_theta):
    """Return ``l0 sigma_theta/sqrt(pi) - (2/3) a``, Eq. (velocity_th_2_gaussienne_corrected)."""
    return l0 * sigma_theta / root_of_pi(l0) - 2 * margin(mu_s, tan_alpha) / 3


@law
def solid_velocity(*, n, l0, mu_d, tan_alpha, amplitude):
    """Return ``N l0 (tan(alpha)/mu_d) (A - N m/(2 l0))``, Eq. (vitessecontinue); mu_d > 0."""
    require(mu_d > 0, "mu_d must be positive")
    return n * (tan_alpha / mu_d) * (l0 * amplitude - n * margin(mu_d, tan_alpha) / 2)
