"""Prove that an avalanche never ends: the whole chain slides too fast for any slider to stop.

If friction cannot hold the whole chain, ``G >= sum of mu_d c`` with G = N s plus the end forces,
the velocity vbar of the centre of mass does not fall. About it the sliders swing with a conserved
energy J. If ``vbar > sqrt((1 - 1/N) 2 J)``, no slider ever stops. A slower avalanche that does not
end is given up after a number of events.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from exactcreep.model.chain import Chain, mean_mu_d, surplus
from exactcreep.motion.modes import Flow, Run

NEVER_STOPS = "the whole chain slides, too fast for any slider to stop ever again"


def escape_time(flow: Flow, run: Run, chain: Chain, cosine: Any) -> Any:
    """Return the time from which on no slider of the moving chain can ever stop, or None.

    All sliders of `flow` move, in the single `run`; `cosine` is cos(alpha).
    """
    sign, n = int(flow.signs[0]), chain.n
    gain = surplus(chain, sign)
    if gain < 0 or any(int(s) != sign for s in flow.signs):
        return None
    arithmetic = flow.arithmetic
    mean = sign * sum(flow.velocities) / n
    needed = arithmetic.sqrt(run.energy * arithmetic.number(Fraction(n - 1, n)))
    if mean > needed or (gain > 0 and bool(mean == 0) and bool(needed == 0)):
        return arithmetic.number(0)
    if gain == 0:
        return None
    pull = arithmetic.number(sign * sum(chain.end_forces) / n)
    gained = arithmetic.number(sign * chain.tan_alpha - mean_mu_d(chain)) * cosine + pull
    return ((needed - mean) / gained).upper()
