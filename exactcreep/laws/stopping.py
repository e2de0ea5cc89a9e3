"""How long creep lasts under disorder until the drawn coefficients stop a chain for ever.

If draws can hold both ends of a chain at rest through all cycles, creep is metastable: it lasts
through a run, but not for ever. An end is held if its threshold exceeds ``L = l0 A`` by more than
the absolute mean of its force over a cycle.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import scipy  # its parts are loaded where they are used
from numpy.typing import NDArray

from exactcreep.model.chain import Chain
from exactcreep.model.numbers import Number, exact_number, nearest_float
from exactcreep.model.uniform import require_uniform

_COPIES, _HALVES = 1000, 240  # copies of the two relays, and half-cycles; a quarter is transient
_MIXED = 12  # copies run so many times the half-cycles in which their phase is forgotten
_LONGEST = 1200  # half-cycles that they are followed
_HELD = 5  # half-cycles for which an end stays held while the other one slips
_APART = 8.0  # other slips must be this many standard deviations out of reach


class StoppingTime(NamedTuple):
    cycles: float
    computed: bool


def stopping_time(chain: Chain, amplitude: Number) -> StoppingTime:
    """Return the mean number of cycles +A, -A after which drawn coefficients stop creep for ever.

    The number is infinite where no draw can stop the chain, as without disorder, or where less than
    one cycle in 1e300 stops it.

    Two sliders are two relays. Heating moves slider 2 by ``2 (a_2 - m)`` when the tension falls to
    ``-a_2``, cooling moves slider 1 at ``a_1``; each slip draws a new ``a_i = mu_i c - s``. They
    stop when the tension turns between ``-a_2`` and ``a_1``. The rate of stopping is its mean
    probability per half-cycle over many copies, once the start is forgotten, after some
    ``((mu_s - mu_d)/(pi sigma_mu))^2 / 2`` half-cycles. Above 100 the time is an estimate.

    For more sliders, the mean forces of the ends are taken as uniform within +-D, and an end as
    held for five half-cycles. The result says that a draw can stop the chain, and no more: for four
    sliders it was off by factors up to 18 either way; on the level, and where sigma_mu exceeds mu_s
    - mu_d, others lived 50 to 1000 times longer. `exactcreep.survival` measures the lifetime.

    >>> chain = Chain(6, 1000, "0.5", "0.6", tan_alpha="0.25")
    >>> stopping_time(chain, "0.001").cycles
    inf
    """
    require_uniform(chain.parameters(), "the time after which drawn coefficients stop creep")
    load = nearest_float(chain.l0 * exact_number(amplitude, "amplitude"))
    sigma = nearest_float(chain.sigma_mu) * chain.cos_alpha
    if sigma == 0 or chain.n < 2:
        return StoppingTime(math.inf, computed=False)
    weight, excess, n = abs(chain.sin_alpha), chain.excess, chain.n
    held = chain.friction + excess
    if n == 2:
        spread = math.sqrt(2) * sigma
        margin = chain.friction - weight
        if _below((excess + margin - load) * 2 / spread) == 0:  # a_1 + a_2 never spans the cycle
            return StoppingTime(math.inf, computed=True)
        if excess and 2 * min(weight, margin) > _APART * spread:
            halves = max(math.ceil(_MIXED * (excess / (math.pi * sigma)) ** 2 / 2), _HALVES)
            followed = halves <= _LONGEST
            rate = _two_relays(excess, margin, sigma, load, halves if followed else _HALVES)
            return StoppingTime(_time(2 * rate), computed=followed)
        rate = _mean_excess(2 * (load - held + weight), spread) / (2 * max(excess, sigma))
        return StoppingTime(_time(2 * min(rate, 1.0)), computed=False)
    share = min(_mean_excess(load - held, sigma) / _mean_excess(-excess, sigma), 1.0)
    inner = (n - 2) * held - n * weight
    carried = _below(inner / sigma / math.sqrt(n - 2))
    return StoppingTime(_time(4 * _HELD * share * share * carried), computed=False)


def _below(z: float) -> float:
    return math.erfc(-z / math.sqrt(2)) / 2


def _time(rate: float) -> float:
    return 1 / rate if rate > 1e-300 else math.inf


def _mean_excess(least: float, sigma: float) -> float:
    z = least / sigma
    density = math.exp(-z * z / 2) / math.sqrt(2 * math.pi)
    return max(sigma * (density - z * _below(-z)), 0.0)


def _two_relays(excess: float, margin: float, sigma: float, load: float, halves: int) -> float:
    """Return the probability per half-cycle that two relays stop, followed for so many.

    The coordinate rho belongs to the present slider, whose slips lower it while ``rho + load``
    exceeds its threshold; the other one sees -rho.
    """
    random, mean = np.random.default_rng(0), excess + margin

    def above(least: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(scipy.special.ndtr((mean - least) / sigma))

    rho = random.uniform(load - mean, load - mean + 2 * excess, _COPIES)
    least = np.full(_COPIES, -np.inf)  # the threshold of the slider at hand was not below this
    rates = []
    for _ in range(halves):
        begin, low, rate = rho.copy(), least, np.zeros(_COPIES)
        going = np.arange(_COPIES)
        while going.size:
            # a threshold below rho + load, or it would have stopped
            high, tail = above(rho[going] + load), above(low[going])
            share = high + (tail - high) * random.random(going.size)
            threshold = mean - sigma * scipy.special.ndtri(share)
            rho[going] -= 2 * np.maximum(threshold - margin, 0.0)
            stays = above(rho[going] + load)
            across = above(load - begin[going])
            rate[going] += stays * above(load - rho[going]) / np.maximum(across, 1e-300)
            going = going[random.random(going.size) > stays]
            low = np.full(_COPIES, -np.inf)
        rates.append(rate.mean())
        least = load - begin
        lives = np.cumsum(1 - above(load - rho) / np.maximum(above(least), 1e-300))
        places = (np.arange(_COPIES) + random.random()) / _COPIES * lives[-1]
        chosen = np.minimum(np.searchsorted(lives, places), _COPIES - 1)
        rho, least = -rho[chosen], least[chosen]
    return float(np.mean(rates[halves // 4 :]))
