"""Prove that an avalanche never ends: by its energy, or since the whole chain slides too fast.

Let tan_alpha >= mu_d (its mirror image for a negative slope). A slider that moves downhill gains
``(s - mu_d c)`` of energy on its way, which is not negative; only motion uphill loses any. At rest
``|F_n| <= mu_s c``, hence each tension lies within ``n (mu_s c - s)`` summed from one end, and
``(N - n) (mu_s c + s)`` from the other, or the same with the ends exchanged: the energy of a chain
at rest is bounded. An avalanche with more energy that never again moves uphill never rests; and
since its sliders then travel without end, it runs away, although every one of them may go
on stopping and starting.

That nothing moves uphill is proved in two cases. (1) Two sliders, tan_alpha > mu_d. While one
moves downhill and the other rests, the resting one is drawn downhill; at its start the tension
is ``|T| <= mu_s c - s``. While both move, ``T^2 - 2 v_1 v_2`` (internal energy minus that of the
mean motion) does not grow, and a slider stops with ``v_1 v_2 = 0``: so with |T| no larger than it
was at the start, and ``F >= s - |T|`` is above the threshold of a start uphill. (2) On the slope
mu_d itself energy is conserved as long as nothing moves uphill; a start uphill needs
``|T_n - T_(n-1)| > mu_s c + s``, which an energy below ``(mu_s c + s)^2 / 4`` cannot hold.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from numpy.typing import NDArray

from exactcreep.model.chain import Chain
from exactcreep.motion.arithmetic import Arithmetic, Undecided
from exactcreep.motion.modes import Flow, Run

NEVER_RESTS = (
    "its energy exceeds that of every state at rest, and it cannot lose any: it never comes to rest"
)
NEVER_STOPS = "the whole chain slides, too fast for any slider to stop ever again"
LARGEST_DEVIATE = 9
"""In units of sigma_mu: no normal deviate made from 53 bits is larger."""
RUNAWAY_CHECK_EVERY = 2500
RUNAWAY_CHECKS = 8
LONG_ESCAPE = 100
"""If the energy proves only after so many tau_dyn that a chain in motion runs away, the amplitudes
of all its modes are asked, too."""


def asks_for_a_proof(event: int) -> bool:
    """Return whether to try and prove, after an event of an avalanche, that it never ends.

    After every `RUNAWAY_CHECK_EVERY` events each of `RUNAWAY_CHECKS` in turn does.
    """
    return event >= RUNAWAY_CHECK_EVERY and event % RUNAWAY_CHECK_EVERY < RUNAWAY_CHECKS


def never_rests(
    arithmetic: Arithmetic,
    chain: Chain,
    tensions: NDArray[Any],
    velocities: NDArray[Any],
    signs: NDArray[Any],
    largest: Fraction,
    slack: Any = 0,
) -> bool:
    """Return whether it is proved that the chain in motion never comes to rest.

    `tensions`, shape (n - 1,), and `velocities`, shape (n,), may be off by `slack` (0 in balls);
    `signs` are directions of motion, 0 at rest; `largest` is the largest static coefficient that
    acts at present. It is proved of every state within the slack.
    """
    n = chain.n
    tangent = abs(chain.tan_alpha)
    down = 1 if chain.tan_alpha >= 0 else -1
    gain = tangent - chain.mu_d
    if n < 2 or gain < 0 or not (signs == down).any() or (signs == -down).any():
        return False
    static = max(largest, chain.mu_s + LARGEST_DEVIATE * chain.sigma_mu)
    if static < tangent:  # the weight exceeds what all contacts can hold together
        return True
    number = arithmetic.number
    cosine = arithmetic.times_cosine(chain, Fraction(1))
    unit = cosine * cosine  # of squared forces
    twice = arithmetic.dot(velocities, velocities) + arithmetic.dot(tensions, tensions)
    rounding: Any = 0
    if arithmetic.roundoff:
        sizes = sum(abs(velocities)) + sum(abs(tensions))
        rounding = 2 * slack * sizes + 8 * n * arithmetic.roundoff * (twice + unit * n**3)
    try:
        at_rest = number(_twice_at_rest(n, static, tangent)) * unit
        if arithmetic.sign(twice - at_rest, rounding) <= 0:
            return False
        if gain == 0:
            steepest = ((chain.mu_s if chain.sigma_mu == 0 else chain.mu_d) + tangent) ** 2
            most = steepest if n == 2 else steepest / 2
            return arithmetic.sign(number(most) * unit - twice, rounding) > 0
        if n > 2 or static - chain.mu_d > 2 * tangent:
            return False
        if not (signs == down).all():
            return True
        tension, (upper, lower) = tensions[0], velocities
        stopped = tension * tension - 2 * upper * lower
        return arithmetic.sign(number((tangent + chain.mu_d) ** 2) * unit - stopped, rounding) > 0
    except Undecided:
        return False


def _twice_at_rest(n: int, static: Fraction, tangent: Fraction) -> Fraction:
    """Return a bound of twice the energy of a chain at rest, in units of cos(alpha)^2."""
    room, width = static - tangent, static + tangent
    bounds = (
        max(min(k * room, (n - k) * width), min(k * width, (n - k) * room)) for k in range(1, n)
    )
    return sum((bound * bound for bound in bounds), Fraction(0))


def escape_time(flow: Flow, run: Run, chain: Chain, cosine: Any) -> Any:
    """Return the time from which no slider of the whole moving chain can ever stop, or None.

    With mean velocity vbar and internal energy J, ``vbar > sqrt((1 - 1/N) 2 J)`` proves it;
    so does a vbar beyond what the amplitudes of all modes add up to at any slider, which proves
    it earlier and takes longer.

    All sliders of `flow` move, in its only `run`; `cosine` is cos(alpha).
    """
    sign, n = int(flow.signs[0]), chain.n
    gain = sign * chain.tan_alpha - chain.mu_d
    if gain < 0 or any(int(s) != sign for s in flow.signs):
        return None
    arithmetic = flow.arithmetic
    mean = sign * sum(flow.velocities) / n
    needed = arithmetic.sqrt(run.energy * arithmetic.number(Fraction(n - 1, n)))
    slack = flow.velocity_slack
    zero = arithmetic.number(0)
    if mean - needed > slack or (gain > 0 and bool(mean == 0) and bool(needed == 0)):
        return zero
    rate = arithmetic.number(gain) * cosine
    lacking = needed - mean + 2 * slack
    if gain > 0 and arithmetic.upper(lacking) < LONG_ESCAPE * rate:
        return arithmetic.upper(lacking / rate)
    swing = run.largest_swing()
    slack = slack + arithmetic.roundoff * (n + 16) * (swing + abs(mean))
    lacking = swing - mean + 2 * slack
    if lacking < 0:
        return zero
    return None if gain == 0 else arithmetic.upper(lacking / rate)
