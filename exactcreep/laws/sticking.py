"""The mean velocity where sliders stick and slip: a measured law, its range and its deviation.

Near the end of a plateau two pivots share the time, and the velocity passes smoothly to the next
plateau. ``notebooks/14-where-a-plateau-ends.ipynb`` explains and tests the law, on the chains of
``notebooks/pictures/sticking.csv``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from exactcreep.laws.number_types import cosine, elementwise, require
from exactcreep.laws.paper import described, law, margin
from exactcreep.laws.theorems import locked_ends_amplitude
from exactcreep.laws.velocities import gaussian_integral

_FEWEST, _MOST = 4, 60  # sliders
_STEEPEST = 0.8  # tan_alpha/mu_d
_STICKIEST = 2 / 3  # (mu_s - mu_d)/mu_d
FEWEST_CLEAN = 8
"""The fewest sliders that do not lock without disorder beyond `locked_ends_amplitude`."""


@law
@elementwise
def sticking_velocity(*, n, l0, mu_d, mu_s, tan_alpha, amplitude, sigma_mu=0):
    """Return the mean velocity of sliders that stick and slip under cycles; measured, not proved.

    The velocity is ``G + d D`` times the sum over ``k = -N, -N + 2, ..., N`` of
    ``erf(z_k/(sqrt(2) s_k))``, and 0 where ``G = l0 A - N m/2`` is not positive. With
    ``q = sigma_mu/(mu_s - mu_d)``,
    ``z_k = (N tan_alpha - k mu_d)/(mu_s - mu_d) + (0.053 (1 - (4/N)**3) + q**2/N) k``,
    ``s_k**2 = (ln((N + k)(N - k)/4)/2 - 0.07) (1 + 2 q**2)``, in which a factor ``(N - |k|)/2``
    that is 0 counts as 1, and
    ``d = 0.048 sqrt(N) (1 + 0.7 q**2) ln(mu_d/|tan_alpha|) - 0.45/(N m/(2 D) + 1)``.

    Each term is a step from one plateau to the next, of height 2 G. s_k is the spread of the
    sum of the sliders' phases, and -0.053 is their mean. d D is the extra distance, compared
    with the sliding limit, before the chain turns. The constants were fitted to 267 chains.
    `sticking_deviation` gives the error of the law, `beyond_sticking` its range. The law fails for
    three sliders, for fewer than eight without disorder (these may lock), near the threshold, and
    at slopes just below mu_d, where the whole chain nearly runs away.

    Raises
    ------
    ValueError
        Unless ``n >= 4``, ``|tan_alpha| < mu_d < mu_s`` and ``sigma_mu >= 0``.

    Examples
    --------
    The solver gives 61.79 for this chain, and the paper's law 64.91:

    >>> chain = {"n": 10, "l0": 1000, "mu_d": 0.4, "mu_s": 0.55, "tan_alpha": 0.25}
    >>> round(sticking_velocity(**chain, amplitude=0.01, sigma_mu=0.01), 1)
    61.2
    """
    drive = {"l0": l0, "amplitude": amplitude}
    chain = {"n": n, "mu_d": mu_d, "mu_s": mu_s, "tan_alpha": tan_alpha, "sigma_mu": sigma_mu}
    return _measured(chain | drive)[0]


@law
@elementwise
def sticking_velocity_random(*, n, l0, mu_d, mu_s, tan_alpha, sigma_theta, sigma_mu=0):
    """Return the mean velocity of sliders that stick and slip under random dilations; measured.

    The sum of `sticking_velocity` times ``G + d D``, with ``G = l0 sigma_theta I(h)`` as in
    `sliding_velocity_random`, ``h = N m/(2 l0 sigma_theta)`` and
    ``d = 0.055 - 0.45/(N m/(2 D) + 1)``.

    Raises
    ------
    ValueError
        As for `sticking_velocity`; and unless ``sigma_theta > 0``.

    Examples
    --------
    >>> chain = {"n": 10, "l0": 1000, "mu_d": 0.4, "mu_s": 0.55, "tan_alpha": 0.25}
    >>> round(sticking_velocity_random(**chain, sigma_theta=0.02, sigma_mu=0.01), 1)
    71.3
    """
    require(sigma_theta > 0, "sigma_theta must be positive")
    drive = {"l0": l0, "sigma_theta": sigma_theta}
    chain = {"n": n, "mu_d": mu_d, "mu_s": mu_s, "tan_alpha": tan_alpha, "sigma_mu": sigma_mu}
    return _measured(chain | drive)[0]


@described
def sticking_deviation(parameters: Mapping[str, Any]) -> float:
    """Return one standard deviation of chains from `sticking_velocity`, or from the random law.

    ``sqrt((0.032 (1 + 9/N**2 + 0.6 q**2) e**(1/3) G)**2 + ((0.03 + 0.001 N) D S)**2)`` was fitted
    to 461 chains. S is the sum of `sticking_velocity`, and e the sum of
    ``exp(-z_k**2/(2 s_k**2))``, about 1 at the ends of plateaus and small between them. 194 of the
    chains did not enter the fit of the law: 72 % differ by less, 94 % by less than twice as much.

    Returns
    -------
    float
        Unit ``g tau_dyn**2`` per half-cycle or target.

    Examples
    --------
    >>> chain = {"n": 10, "l0": 1000, "mu_d": 0.4, "mu_s": 0.55, "tan_alpha": 0.25}
    >>> round(sticking_deviation(chain | {"sigma_mu": 0.01, "amplitude": 0.01}), 2)
    0.29
    """
    return _measured(parameters)[1]


def _measured(parameters: Mapping[str, Any]) -> tuple[float, float]:
    n, slope, sigma = int(parameters["n"]), parameters["tan_alpha"], parameters["sigma_mu"]
    mu_d, mu_s = parameters["mu_d"], parameters["mu_s"]
    said = f"not n = {parameters['n']}, tan_alpha = {slope}, mu_d = {mu_d}, mu_s = {mu_s}"
    ordered = n == parameters["n"] >= _FEWEST and abs(slope) < mu_d < mu_s
    require(ordered, f"n >= 4 and |tan_alpha| < mu_d < mu_s, {said}")
    require(sigma >= 0, f"sigma_mu must not be negative, not {sigma}")
    excess = float(mu_s - mu_d)
    drawn = (float(sigma) / excess) ** 2
    phase = 0.053 * (1 - (4 / n) ** 3) + drawn / n
    steps = ends = 0.0
    for k in range(-n, n + 1, 2):
        z = float(n * slope - k * mu_d) / excess + phase * k
        sides = max((n - k) // 2, 1) * max((n + k) // 2, 1)
        variance = (math.log(sides) / 2 - 0.07) * (1 + 2 * drawn)
        steps += math.erf(z / math.sqrt(2 * variance))
        ends += math.exp(-z * z / (2 * variance))
    gain, unit = sticking_gain(parameters), excess * float(cosine(slope))
    reach = -0.45 / (n * float(mu_d - abs(slope)) / (2 * excess) + 1)
    if "sigma_theta" in parameters:
        reach += 0.055
    elif slope != 0:  # else all steps cancel
        reach += 0.048 * math.sqrt(n) * (1 + 0.7 * drawn) * math.log(mu_d / abs(slope))
    velocity = (gain + reach * unit) * steps if gain > 0 else 0.0
    off_ends = 0.032 * (1 + (3 / n) ** 2 + 0.6 * drawn) * ends ** (1 / 3) * gain
    return velocity, math.hypot(off_ends, (0.03 + 0.001 * n) * unit * steps)


@described
def sticking_gain(parameters: Mapping[str, Any]) -> float:
    """Return G of `sticking_velocity`, or of `sticking_velocity_random`, not below 0.

    Returns
    -------
    float
        Half the height of a step, unit ``g tau_dyn**2``.

    Examples
    --------
    >>> chain = {"n": 10, "l0": 1000, "mu_d": 0.5, "mu_s": 0.6, "tan_alpha": 0}
    >>> sticking_gain(chain | {"amplitude": 0.004})
    1.5
    """
    n, friction, slope = (parameters[name] for name in ("n", "mu_d", "tan_alpha"))
    half = float(n * margin(float(friction), abs(float(slope))) / 2)
    if "sigma_theta" in parameters:
        width = float(parameters["l0"] * parameters["sigma_theta"])
        return width * float(gaussian_integral(half / width)) if width > 0 else 0.0
    return max(float(parameters["l0"] * parameters["amplitude"]) - half, 0.0)


@described
def beyond_sticking(parameters: Mapping[str, Any]) -> str:
    """Return why a chain lies outside the range in which `sticking_velocity` was measured.

    Returns
    -------
    str
        The first bound that is passed; empty within the range, where `sticking_deviation` holds.

    Examples
    --------
    >>> chain = {"n": 10, "l0": 1000, "mu_d": 0.5, "mu_s": 0.6, "sigma_mu": 0.01, "tan_alpha": 0.2}
    >>> beyond_sticking(chain | {"amplitude": 0.0016})
    'G is below 2 D'
    """
    n, friction = parameters["n"], float(parameters["mu_d"])
    slope, sigma = abs(float(parameters["tan_alpha"])), float(parameters["sigma_mu"])
    excess = float(parameters["mu_s"]) - friction
    gain, unit = sticking_gain(parameters), excess * float(cosine(slope))
    least = max(2.0, 12 / float(n))
    bounds = {
        f"N is not between {_FEWEST} and {_MOST}": not _FEWEST <= n <= _MOST,
        f"|tan_alpha| exceeds {_STEEPEST} mu_d": slope > _STEEPEST * friction,
        "mu_s does not exceed mu_d": excess <= 0,
        "mu_s - mu_d exceeds 2/3 mu_d": excess > _STICKIEST * friction,
        "sigma_mu exceeds mu_s - mu_d": sigma > excess,
        f"fewer than {FEWEST_CLEAN} sliders without disorder may lock": (
            sigma == 0 and n < FEWEST_CLEAN
        ),
        "the drive is below 2 times Eq. 22 without disorder": (
            sigma == 0 and gain < n * margin(friction, slope) / 2 and "amplitude" in parameters
        ),
        f"G is below {least:.3g} D": gain < least * unit,
        "G is below D mu_d/(mu_d - |tan_alpha|)": gain * (friction - slope) < unit * friction,
    }
    locks = "a locked cycle exists without disorder"
    passed = (bound for bound, beyond in bounds.items() if beyond)
    return next(passed, locks if _locks(parameters) else "")


def _locks(parameters: Mapping[str, Any]) -> bool:
    """Return whether at some amplitude of cycles only the two ends may slip, for ever."""
    if "amplitude" not in parameters or not parameters["mu_s"] > parameters["mu_d"]:
        return False
    names = ("n", "l0", "mu_d", "mu_s", "tan_alpha")
    locked = locked_ends_amplitude(**{name: parameters[name] for name in names})
    return bool(parameters["amplitude"] <= locked)
