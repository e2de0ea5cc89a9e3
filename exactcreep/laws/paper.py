"""The formulas of the paper, each as a function, and the plateaus that the slope decides.

A velocity is tau_th <v_G>, the advance of the centre of mass per half-cycle (cycles) or per target
(random dilations), in units of g tau_dyn**2. `l0`, the natural length of a spring, has the same
unit. Amplitudes and thresholds are dilations; divide by kappa for a temperature. The docstrings use
``c = cos(alpha)``, ``s = sin(alpha)``, ``m = mu_d c - s``, ``a = mu_s c - s`` and
``D = (mu_s - mu_d) c``, and the equation numbers of the paper. ``derivations/ledger.toml`` says how
each equation is proved, and lists the misprints.

For two sliders the paper prints mu_s where these laws, at N = 2 and i = 2, have mu_d: Eqs. 16 and
18 are `threshold_amplitude` and `threshold_width` of ``mu_d=mu_s``.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping
from inspect import signature
from typing import NamedTuple

import numpy as np

from exactcreep.laws.number_types import (
    Number,
    coerced,
    cosine,
    is_mpf,
    rational,
    real,
    require,
    root_of_pi,
)
from exactcreep.model.numbers import refusing
from exactcreep.model.remarks import remark
from exactcreep.model.uniform import require_uniform


@refusing
def pivots(n: int, tan_alpha: Number, mu_d: Number) -> tuple[int, ...]:
    """Return the one index i of the sliding limit's plateau, or the two where it is not unique.

    The result is ``(i,)`` if ``mu_d (1 - 2(i-1)/n) < tan_alpha < mu_d (1 - 2(i-2)/n)``, and
    ``(i, i + 1)`` at the edge between two plateaus, decided at the exact values of the arguments.
    Slider i - 1 rests while the chain dilates, slider n + 2 - i while it contracts. Source: the
    window of Eq. 19 for mu_s -> mu_d, ``derivations/pivots.py``, ``derivations/sliding_limit.py``.

    Parameters
    ----------
    n : int
        Number of sliders N.
    tan_alpha, mu_d : number
        See `exactcreep.laws`.

    Returns
    -------
    tuple of int
        One index, or two neighbouring ones.

    Raises
    ------
    ValueError
        If ``|tan_alpha| >= mu_d`` or n is not a positive integer.

    Examples
    --------
    >>> pivots(8, Fraction(1, 4), Fraction(1, 2)), pivots(30, 0.25, 0.5)
    ((3, 4), (9,))
    """
    count, slope, friction = int(real(n, "n")), rational(tan_alpha), rational(mu_d)
    require(1 <= count == n, f"n must be a positive integer, not {n}")
    inside = "tan_alpha must lie between -mu_d and mu_d for a pivot, not at"
    require(abs(slope) < friction, f"{inside} {tan_alpha}")
    # tan_alpha n / mu_d lies between n - 2i + 2 and n - 2i + 4
    position = (count + 2 - count * slope / friction) / 2
    lowest = math.ceil(position)
    return (lowest, lowest + 1) if position == lowest else (lowest,)


@refusing
def pivot(n: int, tan_alpha: Number, mu_d: Number) -> int:
    """Return the one index of `pivots`.

    Parameters
    ----------
    n : int
        Number of sliders N.
    tan_alpha, mu_d : number
        See `exactcreep.laws`.

    Returns
    -------
    int
        Index i of the plateau.

    Raises
    ------
    ValueError
        As `pivots`, and where the plateau is not unique.

    Examples
    --------
    >>> pivot(30, 0.25, 0.5)
    9
    """
    indices = pivots(n, tan_alpha, mu_d)
    name = " or ".join(f"i = {i}" for i in indices)
    place = f"the sliding limit of n = {n} at tan_alpha = {tan_alpha}"
    require(len(indices) == 1, f"{place} is not unique: name {name}")
    return indices[0]


_POSITIVE = ("n", "l0")


def law(function: Callable[..., Number]) -> Callable[..., Number]:
    """Let a formula take numbers of any kind and return a number of their common type.

    Arrays broadcast. Default of an index `i`: the plateau of the sliding limit; n and l0 must be
    positive.
    """
    signed = signature(function)

    def of_numbers(**given: Number) -> Number:
        if given.get("i", 0) is None:  # decided on the values as given, before any is rounded
            given["i"] = pivot(*(real(given[name], name) for name in ("n", "tan_alpha", "mu_d")))
        values = coerced(given)
        for name in _POSITIVE:
            require(name not in values or values[name] > 0, f"{name} must be positive")
        return function(**values)

    @functools.wraps(function)
    def of_any(*ordered: Number, **named: Number) -> Number:
        try:
            taken = signed.bind(*ordered, **named)
        except TypeError as error:
            raise TypeError(f"{function.__name__}{signed} takes numbers by name: {error}") from None
        taken.apply_defaults()
        given, of = taken.arguments, of_numbers
        if any(isinstance(value, np.ndarray | list | tuple) for value in given.values()):
            alone = "arrays and mpmath numbers do not mix: call the law once per number"
            require(not any(map(is_mpf, given.values())), alone)
            of = np.vectorize(of_numbers, otypes=[np.float64])
        found = of(**given)
        for name in given.keys() - {"i"}:
            remark(name, np.asarray(given[name]))
        return found

    return refusing(of_any)


@refusing
def law_values(law: Callable[..., Number], parameters: Mapping[str, Number]) -> tuple[float, ...]:
    """Return the result of a law for rationals by name, as floats.

    Parameters
    ----------
    law : callable
        One of the laws of this module.
    parameters : mapping of str to number
        A chain and its drive, by the names that laws use; others are ignored.

    Returns
    -------
    tuple of float
        Two values where the plateau is not unique, none where the slope has no plateau.

    Examples
    --------
    >>> chain = {"n": 8, "l0": 1000, "mu_d": Fraction(1, 2), "tan_alpha": Fraction(1, 4)}
    >>> law_values(plateau_velocity, chain | {"amplitude": Fraction(1, 100)})
    (50.0, 30.0)
    """
    require_uniform(parameters, "the laws of equal sliders")
    names = signature(law).parameters
    taken = {name: value for name, value in parameters.items() if name in names}
    if "i" not in names or names["i"].default is names["i"].empty or "i" in taken:
        return (float(law(**taken)),)
    n, slope, friction = (parameters[name] for name in ("n", "tan_alpha", "mu_d"))
    if abs(slope) >= friction:
        return ()
    return tuple(float(law(**taken, i=i)) for i in pivots(int(n), slope, friction))


def margin(mu: Number, tan_alpha: Number) -> Number:
    return (mu - tan_alpha) * cosine(tan_alpha)


class PivotWindow(NamedTuple):
    """The slopes at which a plateau of index i is possible.

    Slider i - 1 can rest during a dilation for ``lower <= tan_alpha <= upper``. Between
    `lower_alone` and `upper_alone` no other slider can rest; outside, the pivot depends on the
    chain's history. Both are None if ``mu_s - mu_d > mu_d``: then another can rest at every slope.

    Parameters
    ----------
    lower, lower_alone, upper_alone, upper : number or None
        Slopes, from the least on.

    Examples
    --------
    >>> pivot_window(3, 2, Fraction(1, 2), Fraction(3, 5)).lower_alone
    Fraction(1, 5)
    """

    lower: Number
    lower_alone: Number | None
    upper_alone: Number | None
    upper: Number


@law
def critical_angle(*, n, i, mu_d, mu_s):
    """Return the slope ``mu_d (1 - 2(i-1)/N) + (mu_s - mu_d)/N`` of Eq. 19.

    At this slope slider i stops resting while all others slide continuously. Where sliders stick
    and slip, the pivot mostly changes below this slope: see `sticking_velocity`. Source: Eq. 19;
    ``derivations/pivots.py`` has its premises and measurements.

    Parameters
    ----------
    n, i : int
        Number of sliders N, and index of the plateau.
    mu_d, mu_s : number
        See `exactcreep.laws`.

    Returns
    -------
    number
        tan(alpha*).

    Examples
    --------
    >>> critical_angle(n=7, i=3, mu_d=Fraction(1, 2), mu_s=Fraction(3, 5))
    Fraction(8, 35)
    """
    return mu_d * (1 - 2 * (i - 1) / n) + (mu_s - mu_d) / n


@refusing
def pivot_window(n: int, i: int, mu_d: Number, mu_s: Number) -> PivotWindow:
    """Return the slopes between which slider i - 1 can rest while the chain dilates.

    Neighbouring windows overlap over a width 2 (mu_s - mu_d)/n. The edge `lower_alone` is Eq. 19,
    and `upper` is Eq. 19 with i - 1 for i. Source: ``derivations/pivots.py``.

    Parameters
    ----------
    n, i : int
        Number of sliders N, and index of the plateau.
    mu_d, mu_s : number
        See `exactcreep.laws`.

    Returns
    -------
    PivotWindow
        The edges of the window.

    Raises
    ------
    ValueError
        Unless ``2 <= i <= n + 1``.

    Examples
    --------
    >>> window = pivot_window(3, 2, Fraction(1, 2), Fraction(3, 5))
    >>> [str(edge) for edge in window]
    ['2/15', '1/5', '7/15', '8/15']
    """
    require(2 <= i <= n + 1, f"i must be between 2 and n + 1 = {n + 1}, not {i}")
    numbers = coerced({"mu_d": mu_d, "mu_s": mu_s, "n": n, "i": i})
    middle = numbers["mu_d"] * (1 - 2 * (numbers["i"] - 1) / numbers["n"])
    upper = numbers["mu_d"] * (1 - 2 * (numbers["i"] - 2) / numbers["n"])
    half = (numbers["mu_s"] - numbers["mu_d"]) / numbers["n"]
    if middle + half > upper - half:
        return PivotWindow(middle - half, None, None, upper + half)
    return PivotWindow(middle - half, middle + half, upper - half, upper + half)


@refusing
def plateau_ends(*, mu_d: Number, sigma_mu: Number) -> tuple[float, float]:
    """Return the ends of the plateau of two sliders, ``sigma_mu/sqrt(2)`` off 0 and off mu_d.

    Source: alpha_c-, alpha_c+ of the paper's Sec. III A 1.

    Parameters
    ----------
    mu_d, sigma_mu : number
        See `exactcreep.laws`.

    Returns
    -------
    tuple of float
        Slopes at both ends.

    Examples
    --------
    >>> [round(slope, 5) for slope in plateau_ends(mu_d=0.5, sigma_mu=0.01)]
    [0.00707, 0.49293]
    """
    width = float(sigma_mu) / math.sqrt(2)
    return width, float(mu_d) - width


@law
def plateau_velocity(*, n, l0, mu_d, tan_alpha, amplitude, i=None):
    """Return ``(N+3-2i) l0 A``, the plateau's velocity for large amplitudes.

    Source: Eq. 20; Eq. 13 for two sliders.

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
    >>> plateau_velocity(n=30, **slope, amplitude=0.005)
    75.0
    """
    return (n + 3 - 2 * i) * l0 * amplitude


@law
def plateau_velocity_random(*, n, l0, mu_d, tan_alpha, sigma_theta, i=None):
    """Return ``(N+3-2i) l0 sigma_theta/sqrt(pi)``, the plateau's velocity under random dilations.

    Source: the text after Eq. 20; Eq. 14 for two sliders.

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
        If i is not given and the slope has not one plateau.

    Examples
    --------
    >>> round(plateau_velocity_random(n=30, **slope, sigma_theta=0.01), 4)
    84.6284
    """
    return (n + 3 - 2 * i) * l0 * sigma_theta / root_of_pi(l0)


@law
def pivot_force(*, n, i, mu_d, tan_alpha):
    """Return ``(N+1-i) m``, the force on the pivot after a dilation. Source: Eq. 21.

    Parameters
    ----------
    n, i : int
        Number of sliders N, and index of the plateau.
    mu_d, tan_alpha : number
        See `exactcreep.laws`.

    Returns
    -------
    number
        Force in units of m g.

    Examples
    --------
    >>> round(pivot_force(n=30, i=9, mu_d=0.5, tan_alpha=0.25), 4)
    5.3358
    """
    return (n + 1 - i) * margin(mu_d, tan_alpha)


@law
def threshold_amplitude(*, n, l0, mu_d, tan_alpha):
    """Return ``A* = N m/(2 l0)``, the amplitude at which a chain begins to creep.

    ``m = mu_d cos(alpha) - sin(alpha)``. Source: Eq. 22 as printed; `onset_amplitude` corrects it.

    Parameters
    ----------
    n : int
        Number of sliders N.
    l0, mu_d, tan_alpha : number
        See `exactcreep.laws`.

    Returns
    -------
    number
        Amplitude of the dilation.

    Examples
    --------
    >>> threshold_amplitude(n=30, l0=1000, mu_d=Fraction(1, 2), tan_alpha=Fraction(7, 24))
    Fraction(3, 1000)
    """
    return n * margin(mu_d, tan_alpha) / (2 * l0)


@law
def onset_amplitude(*, n, l0, mu_d, mu_s, tan_alpha):
    """Return ``(N m + D)/(2 l0)``: beyond it a half-cycle moves all sliders of a long chain.

    ``m = mu_d cos(alpha) - sin(alpha)``, ``D = (mu_s - mu_d) cos(alpha)``. Relaxed chains of three
    to ten sliders begin to creep at 1.1 to 1.4 times this amplitude, two sliders at
    ``(mu_s cos(alpha) - sin(alpha))/l0``. Source: Eq. 22 corrected, ``derivations/thresholds.py``.

    Parameters
    ----------
    n : int
        Number of sliders N.
    l0, mu_d, mu_s, tan_alpha : number
        See `exactcreep.laws`.

    Returns
    -------
    number
        Amplitude of the dilation.

    Examples
    --------
    >>> chain = {"n": 30, "l0": 1000, "mu_d": Fraction(1, 2), "mu_s": Fraction(3, 5)}
    >>> onset_amplitude(**chain, tan_alpha=Fraction(7, 24))
    Fraction(381, 125000)
    """
    return (n * margin(mu_d, tan_alpha) + (mu_s - mu_d) * cosine(tan_alpha)) / (2 * l0)


@law
def threshold_width(*, n, l0, mu_d, tan_alpha):
    """Return ``sigma_theta* = (2/3) sqrt(pi) A*``, where the line of Eq. 24 is zero.

    It is no threshold: creep goes on below it. Source: the text before Eq. 24.

    Parameters
    ----------
    n : int
        Number of sliders N.
    l0, mu_d, tan_alpha : number
        See `exactcreep.laws`.

    Returns
    -------
    number
        Standard deviation of the random dilations.

    Examples
    --------
    >>> round(threshold_width(n=30, **slope), 6)
    0.004299
    """
    return root_of_pi(l0) * n * margin(mu_d, tan_alpha) / (3 * l0)


@law
def creep_velocity(*, n, l0, mu_d, tan_alpha, amplitude, i=None):
    """Return ``(N+3-2i) (l0 A - N m/2)``; the law holds where it is not negative.

    ``m = mu_d cos(alpha) - sin(alpha)``. `sliding_velocity` is the exact form; `sticking_velocity`
    the law that was measured where mu_s exceeds mu_d. Source: Eq. 23.

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
    >>> round(creep_velocity(n=30, **slope, amplitude=0.005), 4)
    20.4295
    """
    return (n + 3 - 2 * i) * (l0 * amplitude - n * margin(mu_d, tan_alpha) / 2)


@law
def creep_velocity_random(*, n, l0, mu_d, tan_alpha, sigma_theta, i=None):
    """Return ``(N+3-2i) (l0 sigma_theta/sqrt(pi) - N m/3)``, two terms of the exact law.

    ``m = mu_d cos(alpha) - sin(alpha)``; `sliding_velocity_random` is exact. Source: Eq. 24.

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
        If i is not given and the slope has not one plateau.

    Examples
    --------
    >>> round(creep_velocity_random(n=30, **slope, sigma_theta=0.01), 4)
    48.2481
    """
    linear = l0 * sigma_theta / root_of_pi(l0)
    return (n + 3 - 2 * i) * (linear - n * margin(mu_d, tan_alpha) / 3)


@law
def two_sliders_velocity(*, l0, mu_s, tan_alpha, amplitude):
    """Return ``l0 A - a`` as the paper prints it for two sliders.

    ``a = mu_s cos(alpha) - sin(alpha)``. `staircase_two_sliders` is the exact law. Source: Eq. 15,
    which has mu_s for mu_d.

    Parameters
    ----------
    l0, mu_s, tan_alpha, amplitude : number
        See `exactcreep.laws`.

    Returns
    -------
    number
        Advance of the centre of mass per half-cycle, unit ``g tau_dyn**2``.

    Examples
    --------
    >>> round(two_sliders_velocity(l0=1000, mu_s=0.6, tan_alpha=0.25, amplitude=0.005), 4)
    4.6605
    """
    return l0 * amplitude - margin(mu_s, tan_alpha)


@law
def two_sliders_velocity_random(*, l0, mu_s, tan_alpha, sigma_theta):
    """Return ``l0 sigma_theta/sqrt(pi) - (2/3) a`` as the paper prints it for two sliders.

    ``a = mu_s cos(alpha) - sin(alpha)``; `sliding_velocity_random` is exact. Source: Eq. 17, which
    has mu_s for mu_d.

    Parameters
    ----------
    l0, mu_s, tan_alpha, sigma_theta : number
        See `exactcreep.laws`.

    Returns
    -------
    number
        Advance of the centre of mass per target, unit ``g tau_dyn**2``.

    Examples
    --------
    >>> round(two_sliders_velocity_random(l0=1000, mu_s=0.6, tan_alpha=0.25, sigma_theta=0.01), 4)
    5.4155
    """
    return l0 * sigma_theta / root_of_pi(l0) - 2 * margin(mu_s, tan_alpha) / 3


@law
def solid_velocity(*, n, l0, mu_d, tan_alpha, amplitude):
    """Return ``N l0 (tan(alpha)/mu_d) (A - N m/(2 l0))``, the limit of many contacts.

    ``m = mu_d cos(alpha) - sin(alpha)``. Source: Eq. 25.

    Parameters
    ----------
    n : int
        Number of sliders N.
    l0, mu_d, tan_alpha, amplitude : number
        See `exactcreep.laws`.

    Returns
    -------
    number
        Advance of the centre of mass per half-cycle, unit ``g tau_dyn**2``.

    Raises
    ------
    ValueError
        Unless n, l0 and mu_d are positive.

    Examples
    --------
    >>> round(solid_velocity(n=30, **slope, amplitude=0.005), 4)
    20.4295
    """
    require(mu_d > 0, "mu_d must be positive")
    return n * (tan_alpha / mu_d) * (l0 * amplitude - n * margin(mu_d, tan_alpha) / 2)
