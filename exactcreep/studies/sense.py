"""Refuse a question that makes no sense for a chain, and name the question that does."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from exactcreep.laws import pivot_sliders
from exactcreep.model.chain import Chain
from exactcreep.model.numbers import InputError, nearest_float
from exactcreep.model.uniform import END_FORCES, EVERYTHING, FRICTION, require_uniform
from exactcreep.solvers.interface import require_slips

CHAOTIC = 6
"""From this number of sliders on creep is chaotic and lasts for a limited time."""
_MOST_SLIPS = 10_000_000
MOST_SLIDERS = 10_000
"""Most sliders in a question about many cycles; more could not keep a limit of time."""


def require_sense(
    chain: Any, question: str, cycles: int | None = None, amplitude: Fraction = Fraction(0)
) -> None:
    """Raise `InputError` if a question makes no sense for a chain.

    The questions are ``fate`` and ``survival`` at an amplitude, ``intercept``, and ``threshold``
    (creep for ever, or with `cycles` an advance in the last of them).
    """
    if not isinstance(chain, Chain):
        raise InputError("chain", chain, "must be a Chain")
    edge, sliding = question == "threshold", (FRICTION, END_FORCES)  # what the sliding limit takes
    takes = sliding if question == "intercept" or (edge and chain.slides) else EVERYTHING
    require_uniform(chain.parameters(), question, takes)
    if chain.n > MOST_SLIDERS and not edge:
        allowed = f"must be at most {MOST_SLIDERS} here: many cycles of more would take days;"
        raise InputError("n", chain.n, f"{allowed} creep and run take more, for a few")
    if chain.sigma_mu != 0 and question == "fate":
        allowed = "must be 0: with disorder no tension ever returns; survival tells how long"
        raise InputError("sigma_mu", chain.sigma_mu, f"{allowed} creep lives")
    if chain.slides and question in ("fate", "survival"):
        if chain.mu_s != chain.mu_d:
            require_slips(chain, chain.rates)
        allowed = "must exceed mu_d: without slips the sliders follow theta, in every cycle alike;"
        raise InputError("mu_s", chain.mu_s, f'{allowed} creep(solver="sliding") tells how')
    if question in ("fate", "survival"):
        # one slip relaxes at most about twice the static excess
        step = 2 * (chain.largest_mu_s - chain.mean_mu_d + chain.sigma_mu)
        if amplitude * chain.l0 > _MOST_SLIPS * step:
            allowed = f"makes more than {_MOST_SLIPS:,} slips in every half-cycle, too many to"
            raise InputError("amplitude", amplitude, f"{allowed} follow thousands of cycles")
        return
    if chain.first_start <= 0 and chain.may_run_away:
        allowed = f"must be less than mu_s = {nearest_float(chain.largest_mu_s)}"
        allowed = "must leave the relaxed chain at rest" if chain.unlike else allowed
        raise InputError("tan_alpha", chain.tan_alpha, f"{allowed}, or the chain slides")
    if chain.slides and chain.mu_s != chain.mu_d:
        allowed = "must exceed mu_d for every slider, or for none of them"
        raise InputError("mu_s", chain.mu_s, allowed)
    if chain.unlike and chain.heading == 0:
        allowed = "must not balance weight and end forces: nothing drives the chain either way;"
        allowed += " `survival` counts the starts that creep one way or the other"
        raise InputError(*_driving(chain), allowed)
    if chain.heading == 0 and chain.n > 1:
        allowed = "must not be 0: on the level a relaxed chain stays where it is;"
        allowed += " `survival` counts the starts that creep one way or the other"
        raise InputError("tan_alpha", 0, allowed)
    if edge and chain.sigma_mu != 0:
        allowed = "must be 0: with disorder no edge is sharp; `intercept` says where v(A) begins"
        raise InputError("sigma_mu", chain.sigma_mu, allowed)
    if edge and chain.slides and chain.n > 1 and cycles != 1:
        resting = pivot_sliders(chain.each("mu_d"), chain.tan_alpha, chain.end_forces)
        if 0 in resting.apart:
            allowed = "must exceed mu_d/N: on a flatter slope the pivot of an odd chain"
            allowed += " without slips is its middle slider, and the chain never creeps"
            if chain.unlike:
                allowed = f"must not let slider {resting.dilation[-1]} rest when the chain expands"
                allowed += " and when it contracts: without slips the chain never creeps"
            raise InputError(*_driving(chain), allowed)
    if edge and cycles is None and chain.n >= CHAOTIC and not chain.slides:
        allowed = f"must be at most {CHAOTIC - 1}: longer chains creep chaotically, and for a while"
        allowed += " only; ask `survival`, or `threshold` with `after` for a cycle"
        raise InputError("n", chain.n, allowed)
    if edge:
        return
    if chain.n < 2:
        raise InputError("n", chain.n, "must be at least 2: one slider has no spring")
    if chain.slides:
        allowed = "equal to mu_d leaves no slips: `threshold` is exact, whatever the start"
        raise InputError("mu_s", chain.mu_s, allowed)
    if chain.may_run_away:
        allowed = "must be less than mu_d in size"
        if chain.unlike:
            allowed = "must be less: weight and end forces exceed the friction of the chain"
        raise InputError(*_driving(chain), allowed)


def _driving(chain: Chain) -> tuple[str, Any]:
    """Return the parameter that drives a chain, the end forces if it has any, and its value."""
    name = END_FORCES if END_FORCES in chain.unlike else "tan_alpha"
    return name, getattr(chain, name)
