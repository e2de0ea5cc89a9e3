"""Which question makes sense for which chain: one table of cases, read from the top."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any, NamedTuple

from exactcreep.laws import pivot_sliders
from exactcreep.model.chain import Chain, first_start, largest_mu_s, mean_mu_d
from exactcreep.model.numbers import InputError, nearest_float
from exactcreep.model.uniform import END_FORCES, EVERYTHING, FRICTION, require_uniform
from exactcreep.solvers.interface import require_slips

CHAOTIC = 6
"""From this number of sliders on creep is chaotic and lasts for a limited time."""
FATE, SURVIVAL, EDGE, IN_CYCLE, INTERCEPT = "fate", "survival", "edge", "edge in cycle", "intercept"
_MOST_SLIPS = 10_000_000
MOST_SLIDERS = 10_000
"""Most sliders in a question about many cycles; more could not keep a limit of time."""
_LIVES, _EDGES, _THRESHOLDS = (FATE, SURVIVAL), (EDGE, IN_CYCLE), (EDGE, IN_CYCLE, INTERCEPT)
_BALANCED = "`survival` counts the starts that creep one way or the other"


class Asked(NamedTuple):
    """A question about a chain, of a fate at an amplitude."""

    chain: Chain
    question: str
    amplitude: Fraction = Fraction(0)

    @property
    def slips_in_half_cycle(self) -> float:
        """About how many slips a half-cycle has: one relaxes up to twice the static excess."""
        chain = self.chain
        step = 2 * (largest_mu_s(chain) - mean_mu_d(chain) + chain.sigma_mu)
        return float(self.amplitude * chain.l0 / step) if step else 0.0

    @property
    def never_starts(self) -> int:
        """The number of a slider that never slides without slips; 0: every slider does."""
        chain = self.chain
        if self.question not in _EDGES or not chain.slides or chain.n == 1:
            return 0
        resting = pivot_sliders(chain.each("mu_d"), chain.tan_alpha, chain.end_forces)
        return resting.dilation[-1] if 0 in resting.apart else 0

    @property
    def driving(self) -> str:
        """The parameter that drives the chain: the end forces, if it has any."""
        return END_FORCES if END_FORCES in self.chain.unlike else "tan_alpha"


class Case(NamedTuple):
    """A chain for which some `questions` make no sense.

    The field is a parameter of the chain, "driving" (see `Asked.driving`), or "amplitude"; the
    sentence says what is allowed and which question to ask instead.
    """

    questions: tuple[str, ...]
    applies: Callable[[Asked], object]
    field: str
    sentence: str


CASES = (
    Case((*_LIVES, INTERCEPT), lambda on: on.chain.n > MOST_SLIDERS, "n",
         f"must be at most {MOST_SLIDERS} here: many cycles of more would take days;"
         " creep and run take more, for a few"),
    Case((FATE,), lambda on: on.chain.sigma_mu, "sigma_mu",
         "must be 0: with disorder no tension ever returns; survival tells how long creep lives"),
    Case(_LIVES, lambda on: on.chain.slides, "mu_s",
         "must exceed mu_d: without slips the sliders follow theta, in every cycle alike;"
         ' creep(solver="sliding") tells how'),
    Case(_LIVES, lambda on: on.slips_in_half_cycle > _MOST_SLIPS, "amplitude",
         f"makes more than {_MOST_SLIPS:,} slips in every half-cycle, too many to follow thousands"
         " of cycles"),
    Case(_THRESHOLDS, lambda on: on.chain.n < 2, "n",
         "must be at least 2: one slider has no spring, and never creeps"),
    Case(_THRESHOLDS, lambda on: _starts_sliding(on.chain) and on.chain.unlike, "tan_alpha",
         "must leave the relaxed chain at rest, or the chain slides"),
    Case(_THRESHOLDS, lambda on: _starts_sliding(on.chain), "tan_alpha",
         "must be less than mu_s = {mu_s}, or the chain slides"),
    Case(_THRESHOLDS, lambda on: on.chain.slides and on.chain.mu_s != on.chain.mu_d, "mu_s",
         "must exceed mu_d for every slider, or for none of them"),
    Case(_THRESHOLDS, lambda on: on.chain.unlike and on.chain.heading == 0, "driving",
         "must not balance weight and end forces: nothing drives the chain either way;"
         f" {_BALANCED}"),
    Case(_THRESHOLDS, lambda on: on.chain.heading == 0, "tan_alpha",
         f"must not be 0: on the level a relaxed chain stays where it is; {_BALANCED}"),
    Case(_EDGES, lambda on: on.chain.sigma_mu, "sigma_mu",
         'must be 0: with disorder no edge is sharp; kind="intercept" (--kind intercept) says where'
         " v(A) begins"),
    Case(_EDGES, lambda on: on.never_starts and on.chain.unlike, "driving",
         "must not let slider {never_starts} rest when the chain expands and when it contracts:"
         " without slips the chain never creeps"),
    Case(_EDGES, lambda on: on.never_starts, "driving",
         "must exceed mu_d/N: on a flatter slope the pivot of an odd chain without slips is its"
         " middle slider, and the chain never creeps"),
    Case((IN_CYCLE,), lambda on: on.chain.slides, "mu_s",
         "equal to mu_d leaves no slips, and all cycles from the second on are alike: leave out"
         " `after`"),
    Case((EDGE,), lambda on: on.chain.n >= CHAOTIC and not on.chain.slides, "n",
         f"must be at most {CHAOTIC - 1} for an edge: longer chains creep chaotically, and for a"
         " while only; ask `survival` how long, `threshold` with `after` for an advance in one"
         ' cycle, or with kind="intercept" (--kind intercept) where the straight part of v(A)'
         " begins"),
    Case((INTERCEPT,), lambda on: on.chain.slides, "mu_s",
         "equal to mu_d leaves no slips: the edge of `threshold` is exact, whatever the start"),
    Case((INTERCEPT,), lambda on: on.chain.may_run_away and on.chain.unlike, "driving",
         "must be less: weight and end forces exceed the friction of the chain"),
    Case((INTERCEPT,), lambda on: on.chain.may_run_away, "driving",
         "must be less than mu_d in size"),
)  # fmt: skip


def require_sense(chain: Any, question: str, amplitude: Fraction = Fraction(0)) -> None:
    """Raise `InputError` for the first of `CASES` that applies to a question."""
    if not isinstance(chain, Chain):
        raise InputError("chain", chain, "must be a Chain")
    sliding = question == INTERCEPT or (question in _EDGES and chain.slides)
    takes = (FRICTION, END_FORCES) if sliding else EVERYTHING
    require_uniform(chain.parameters(), f"the {question} of a chain", takes)
    if question in _LIVES and chain.slides and chain.mu_s != chain.mu_d:
        require_slips(chain, chain.rates)
    on = Asked(chain, question, amplitude)
    for case in CASES:
        if question in case.questions and case.applies(on):
            field = on.driving if case.field == "driving" else case.field
            value = amplitude if field == "amplitude" else getattr(chain, field)
            known = {"mu_s": nearest_float(largest_mu_s(chain)), "never_starts": on.never_starts}
            raise InputError(field, value, case.sentence.format(**known))


def _starts_sliding(chain: Chain) -> bool:
    return first_start(chain) <= 0 and chain.may_run_away
