"""The mean velocity where sliders stick and slip: one fitted law, its range and its deviation.

Friction, excess ``mu_s - mu_d`` and end forces may differ. Near the end of a plateau two pivots
share the time, and the velocity passes smoothly to the next plateau.
``derivations/pivots.py`` derives where these passages lie and that phases smear them.
``notebooks/14-where-a-plateau-ends.ipynb`` explains and tests the law.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exactcreep.laws.number_types import cosine, each, require
from exactcreep.laws.paper import law_values
from exactcreep.laws.theorems import locked_ends_amplitude, rest_edge
from exactcreep.laws.velocities import gaussian_integral
from exactcreep.model.numbers import refusing
from exactcreep.model.uniform import unlike

_FEWEST, _MOST = 4, 60  # sliders
_LARGEST = 10_000  # sliders; the law adds up n**2 pairs
_STEEPEST = 0.8  # weight and end forces over friction
_STICKIEST = 2 / 3  # mean of mu_s - mu_d over the mean of mu_d
_ROUGHEST, _UNEVENEST = 1.5, 0.15  # variance of mu_d and of mu_s - mu_d over their squared means
_ROUNDING = 1e-12
FEWEST_CLEAN = 8
"""The fewest sliders that do not lock without disorder beyond `locked_ends_amplitude`."""


class Forces(NamedTuple):
    """The forces on a chain, unit ``m g``, and the load of its drive, unit ``g tau_dyn**2``.

    `friction`, `excess`: ``mu_d c`` and ``(mu_s - mu_d) c`` of each slider; `pull`: the sum of
    weights and end forces; `sigma`: ``sigma_mu c``; `gain`: the mean advance G of a spring beyond
    its play.
    """

    friction: NDArray[np.float64]
    excess: NDArray[np.float64]
    pull: float
    sigma: float
    gain: float

    @property
    def half_play(self) -> float:
        """h, half of the play of a spring."""
        return (float(self.friction.sum()) - abs(self.pull)) / 2

    @property
    def unit(self) -> float:
        """D, the mean excess."""
        return float(self.excess.mean())

    @property
    def drawn(self) -> float:
        """q, the squared disorder in units of D; at most 1, beyond which no chain was measured."""
        return min((self.sigma / self.unit) ** 2, 1.0)

    @property
    def uneven(self) -> float:
        """Relative variance of the excess along the chain."""
        return float(self.excess.var()) / self.unit**2

    @property
    def smears(self) -> bool:
        """Whether there are enough sliders that stick and slip for phases to smear the pivots."""
        least = _FEWEST if self.sigma else FEWEST_CLEAN
        return least <= len(self.friction) <= _LARGEST and self.unit > 0 and self.excess.min() >= 0


def forces(parameters: Mapping[str, Any]) -> Forces:
    """Return the forces on a chain and the gain of its drive; ValueError if the chain runs away."""
    n, slope = int(parameters["n"]), float(parameters["tan_alpha"])
    require(n == parameters["n"] > 0, f"n must be a positive integer, not {parameters['n']}")
    c = float(cosine(slope))
    sliding, static = (np.array(each(parameters, name), float) for name in ("mu_d", "mu_s"))
    pull = n * slope * c + math.fsum(map(float, parameters.get("end_forces", ())))
    sigma = float(parameters["sigma_mu"])
    require(sigma >= 0, f"sigma_mu must not be negative, not {sigma}")
    found = Forces(sliding * c, (static - sliding) * c, pull, sigma * c, math.nan)
    half, length = found.half_play, float(parameters["l0"])
    require(half > 0, "friction must hold the chain: |weight + end forces| below the sum of mu_d c")
    if "sigma_theta" not in parameters:
        return found._replace(gain=max(length * float(parameters["amplitude"]) - half, 0.0))
    width = length * float(parameters["sigma_theta"])
    return found._replace(gain=width * float(gaussian_integral(half / width)) if width > 0 else 0.0)


@refusing
def sticking_velocity(parameters: Mapping[str, Any]) -> float:
    """Return the mean velocity of sliders that stick and slip; fitted, not proved.

    The velocity is ``(G + d D) (q - p)``, and 0 where G is not positive. D is the mean of
    ``(mu_s - mu_d) c``, and ``G = l0 A - h`` or, with random dilations,
    ``G = l0 sigma_theta I(h/(l0 sigma_theta))``, with h of `differing_intercept` and I of
    `gaussian_integral`. ``q - p`` is the mean distance of the sliders that rest in contractions and
    in dilations: half of the sum over springs p = 0..N, counted from either end, of
    ``erf(z/(sqrt(2) s))``.

    With ``b_n = mu_d[n] c``, ``e_n = (mu_s[n] - mu_d[n]) c`` and ``r = (sigma_mu c/D)**2``, at most
    1, ``z D`` is the sum of weights and end forces, less ``B_p``, less
    ``(e_(p+1) - e_p)/2``, plus ``(0.057 (1 - (4/N)**3) + r/N) E_p``. ``B_p`` and ``E_p`` are the
    sums of b and e below spring p less those above it. ``s**2`` is ``(1 + 2.23 r)/2`` times the
    sum of ``(e_n/D)**2/k`` over sliders, k = 1, 2, ... by distance from spring p, with the factor
    0.094 for k = 1. ``d = 0.047 sqrt(N) (1 + 0.85 r) ln((N + 1)/|q - p|) - 0.527/(h/D + 1)`` under
    cycles; with random dilations the first term is 0.034.

    Each term is a passage of a pivot to the next slider, of height 2 G. s D is the spread of the
    force that the phases of the sliding sliders add. d D is the extra distance, compared with the
    sliding limit, before the chain turns. The eight constants were fitted to 235 chains of equal
    sliders and 307 that were drawn, half of them at the ends of plateaus
    (``tests/laws/measured_chains.py``).

    Parameters
    ----------
    parameters : mapping of str to number
        A chain and its drive, by the names that laws use.

    Returns
    -------
    float
        Unit ``g tau_dyn**2`` per half-cycle or target.

    Raises
    ------
    ValueError
        Unless n is from 4 to 10000, friction holds the chain, no mu_s is below its mu_d, and some
        mu_s are above.

    Examples
    --------
    The solver gives 61.79 for this chain, and the paper's law 64.91:

    >>> chain = {"n": 10, "l0": 1000, "mu_d": 0.4, "mu_s": 0.55, "tan_alpha": 0.25}
    >>> round(sticking_velocity(chain | {"sigma_mu": 0.01, "amplitude": 0.01}), 1)
    61.5
    """
    return _fitted(parameters, forces(parameters))[0]


@refusing
def sticking_deviation(parameters: Mapping[str, Any]) -> float:
    """Return one standard deviation of chains from `sticking_velocity`.

    With the symbols of `sticking_velocity` and ``u = var(e)/D**2``, these parts add in quadrature:
    ``sqrt(0.06**2 (1 + 2 r + 4/N**2) + u)`` times ``G d(q - p)/dz``, large where a plateau ends;
    ``sqrt(0.009**2 (1 + 4/N**2) + 0.09**2 u) G``; and
    ``(0.033 + 0.0085 |load|/(2 h)) D |q - p|``, with the sum of weights and end forces as load.
    Under cycles, chains of more than 30 sliders have a fourth part, ``0.007 (N - 30) D |q - p|``:
    the mean velocity of most chains of 46 to 60 sliders is below the law. With random dilations
    0.03 replaces 0.009. The constants were fitted to 866 chains, those of the law among them; the
    0.03 was widened on all that were measured (``tests/data/drawn.csv``).

    Parameters
    ----------
    parameters : mapping of str to number
        A chain and its drive, by the names that laws use.

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
    return _fitted(parameters, forces(parameters))[1]


def _fitted(parameters: Mapping[str, Any], on: Forces) -> tuple[float, float]:
    """Return velocity and deviation."""
    n, unit, gain, drawn = len(on.friction), on.unit, on.gain, on.drawn
    held = _FEWEST <= n <= _LARGEST and unit > 0 and on.excess.min() >= 0
    needed = f"n between {_FEWEST} and {_LARGEST}, no mu_s below mu_d and some above are needed"
    require(held, f"{needed}, not n = {n}")
    share = 0.057 * (1 - (4 / n) ** 3) + drawn / n
    nearness = 1 / np.arange(1, n + 1)
    nearness[0] = 0.094
    apart = passing = 0.0  # q - p, and its change with z
    for friction, excess in ((on.friction, on.excess), (on.friction[::-1], on.excess[::-1])):
        middle = np.diff(excess, prepend=excess[0], append=excess[-1]) / 2
        smeared = abs(on.pull) - _below(friction) - middle + share * _below(excess)
        squares = (excess / unit) ** 2
        above = np.append(0, np.convolve(squares, nearness)[:n])
        below = np.append(0, np.convolve(squares[::-1], nearness)[:n])[::-1]
        spread = np.sqrt((above + below) * (1 + 2.23 * drawn))  # sqrt(2) s
        steps = smeared / unit / spread
        apart += math.fsum(map(math.erf, steps)) / 2
        passing += float(np.sum(np.exp(-steps * steps) / spread)) / math.sqrt(math.pi)
    reach = -0.527 / (on.half_play / unit + 1)
    if "sigma_theta" in parameters:
        reach += 0.034
    elif apart:  # else the chain does not advance
        reach += 0.047 * math.sqrt(n) * (1 + 0.85 * drawn) * math.log((n + 1) / abs(apart))
    few, steep = 4 / n**2, abs(on.pull) / (2 * on.half_play)
    off = math.sqrt(0.06**2 * (1 + 2 * drawn + few) + on.uneven) * passing * gain
    least = 0.03 if "sigma_theta" in parameters else 0.009
    between = math.sqrt(least**2 * (1 + few) + 0.09**2 * on.uneven) * gain
    parts = [off, between, (0.033 + 0.0085 * steep) * unit * abs(apart)]
    if "amplitude" in parameters:
        parts.append(0.007 * max(n - 30, 0) * unit * abs(apart))
    advance = max(gain + reach * unit, 0.0) if gain > 0 else 0.0
    return (-advance if on.pull < 0 else advance) * apart + 0.0, math.hypot(*parts)


def _below(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return, for springs 0..N, the sum below a spring less the sum above it."""
    below, above = np.cumsum(values[::-1])[::-1], np.cumsum(values)
    return np.asarray(np.append(below, 0) - np.append(0, above))


@refusing
def beyond_sticking(parameters: Mapping[str, Any]) -> str:
    """Return why a chain lies outside the range in which `sticking_velocity` was measured.

    Parameters
    ----------
    parameters : mapping of str to number
        A chain and its drive, by the names that laws use.

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
    on = forces(parameters)
    n, friction, unit = len(on.friction), float(on.friction.mean()), on.unit
    clean, cycles = on.sigma == 0, "amplitude" in parameters
    slope, least = abs(on.pull) / (n * friction), max(2.0, 12 / n)
    bounds = {
        f"N is not between {_FEWEST} and {_MOST}": not _FEWEST <= n <= _MOST,
        f"weight and end forces exceed {_STEEPEST} of the friction": slope > _STEEPEST + _ROUNDING,
        "mu_s does not exceed mu_d": unit <= 0 or on.excess.min() < 0,
        "mu_s - mu_d exceeds 2/3 mu_d": unit > _STICKIEST * friction,
        "sigma_mu exceeds mu_s - mu_d": on.sigma > unit,
        "friction differs too much": on.friction.var() > _ROUGHEST * friction**2,
        "mu_s - mu_d differs too much": on.excess.var() > _UNEVENEST * unit**2,
        f"fewer than {FEWEST_CLEAN} sliders without disorder may lock": clean and n < FEWEST_CLEAN,
        "the drive is below 2 times Eq. 22 without disorder": (
            clean and cycles and on.gain < on.half_play
        ),
        f"G is below {least:.3g} D": on.gain < least * unit,
        "G is below D mu_d/(mu_d - |tan_alpha|)": on.gain * (1 - slope) < unit,
        "a state at rest exists": cycles and rests(parameters, "mu_s"),
        "a locked cycle exists without disorder": cycles and clean and locks(parameters, on),
    }
    return next((bound for bound, beyond in bounds.items() if beyond), "")


def rests(parameters: Mapping[str, Any], name: str, share: float = 1) -> bool:
    """Return whether some state stays at rest through cycles, with the coefficients `name`.

    The bound is `at_rest_amplitude` times `share`.
    """
    return bool(parameters["amplitude"] <= share * rest_edge(parameters, name))


def locks(parameters: Mapping[str, Any], on: Forces) -> bool:
    """Return whether without disorder only the two ends may slip, for ever.

    The edge of such cycles is a theorem if all sliders are equal. If they differ, static friction
    of the whole chain bounds it.
    """
    if unlike(parameters):
        edge = on.half_play + len(on.excess) * on.unit / 2
        return bool(parameters["l0"] * parameters["amplitude"] <= edge)
    names = ("n", "l0", "mu_d", "mu_s", "tan_alpha")
    (edge,) = law_values(locked_ends_amplitude, {name: parameters[name] for name in names})
    return bool(parameters["amplitude"] <= edge)
