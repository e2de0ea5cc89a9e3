"""How long creep lasts under disorder until the drawn coefficients stop a chain for ever.

If draws can hold both ends of a chain at rest through all cycles, creep is metastable: it lasts
through a run, but not for ever. An end is held if its threshold exceeds ``L = l0 A`` by more than
the absolute mean of its force over a cycle.
"""

from __future__ import annotations

import math

from exactcreep.model.chain import Chain
from exactcreep.model.numbers import Number, exact_number, nearest_float
from exactcreep.model.uniform import require_uniform

_HELD = 5  # half-cycles for which an end stays held while the other one slips


def stopping_time(chain: Chain, amplitude: Number) -> float:
    """Estimate the mean number of cycles +A, -A after which drawn coefficients stop creep for ever.

    The number is infinite where no draw can stop the chain, as without disorder, or where less than
    one cycle in 1e300 stops it.

    Two sliders stop when their thresholds together span the cycle. For more, the mean forces of the
    ends are taken as uniform within +-D, and an end as held for five half-cycles. The result says
    that a draw can stop the chain, and no more: for four sliders it was off by factors up to 18
    either way; on the level, and where sigma_mu exceeds mu_s - mu_d, others lived 50 to 1000 times
    longer. `exactcreep.survival` measures the lifetime.

    >>> chain = Chain(6, 1000, "0.5", "0.6", tan_alpha="0.25")
    >>> stopping_time(chain, "0.001")
    inf
    """
    require_uniform(chain.parameters(), "the time after which drawn coefficients stop creep")
    load = nearest_float(chain.l0 * exact_number(amplitude, "amplitude"))
    sigma = nearest_float(chain.sigma_mu) * chain.cos_alpha
    if sigma == 0 or chain.n < 2:
        return math.inf
    weight, excess, n = abs(chain.sin_alpha), chain.excess, chain.n
    held = chain.friction + excess
    if n == 2:
        both = _mean_excess(2 * (load - held + weight), math.sqrt(2) * sigma)
        rate = 2 * min(both / (2 * max(excess, sigma)), 1.0)
    else:
        share = min(_mean_excess(load - held, sigma) / _mean_excess(-excess, sigma), 1.0)
        inner = (n - 2) * held - n * weight
        carried = _below(inner / sigma / math.sqrt(n - 2))
        rate = 4 * _HELD * share * share * carried
    return 1 / rate if rate > 1e-300 else math.inf


def _below(z: float) -> float:
    return math.erfc(-z / math.sqrt(2)) / 2


def _mean_excess(least: float, sigma: float) -> float:
    z = least / sigma
    density = math.exp(-z * z / 2) / math.sqrt(2 * math.pi)
    return max(sigma * (density - z * _below(-z)), 0.0)
