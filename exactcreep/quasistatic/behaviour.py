"""What a chain does at the end of a run: it rests, creeps, or slips without an advance."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from exactcreep.model.chain import rounding_of
from exactcreep.model.enclosure import Enclosure, as_float, enclosure, floats
from exactcreep.model.numbers import nearest_float
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.model.state import State
from exactcreep.quasistatic.velocity import Mark, MeanVelocity
from exactcreep.solvers.interface import Tally
from exactcreep.solvers.return_map import ReturnMap

NEARLY = "the tensions return to within "
"""The reason of a chain that has settled nearly begins with these words."""
_STILL = enclosure(0)


@dataclass(frozen=True)
class Behaviour:
    """What a chain does at the end of a run, and since which cycle.

    `evidence` assumes that the trajectory is known: `PROVED` if the outcome lasts for ever,
    `COMPUTED` if it was seen only in this run. `velocity` is the velocity of a settled cycle.
    """

    outcome: Outcome
    since: int | None = None
    reason: str = ""
    evidence: Evidence = Evidence.COMPUTED
    velocity: Enclosure | None = None


def behaviour(
    velocity: MeanVelocity, return_map: ReturnMap | None, state: State, tally: Tally, done: int
) -> Behaviour:
    """Return the outcome of a run that has reached every target; see `creep`."""
    begin = velocity.burnt(done)
    all_burn_in = begin is None or begin.done == done
    if begin is None or all_burn_in:
        begin = Mark(*velocity.marks[0])
    advanced = _advanced(velocity, begin, state, tally)
    if return_map is None:
        still = floats(state.displacements) == begin.displacements
        if tally.slips == begin.slips and still.all():
            return Behaviour(Outcome.AT_REST)
        return _drifting(velocity, advanced, None, done)
    settled = return_map.settled()
    if settled is None and (approach := return_map.approaching()):
        cycle, how = approach
        return Behaviour(Outcome.CYCLING, cycle, how.reason, Evidence.UNDECIDED, _STILL)
    if settled is None:
        drift = _drifting(velocity, advanced, begin.done // 2, done)
        if all_burn_in and return_map.chain.sigma_mu == 0 and drift.outcome is Outcome.CREEPING:
            reason = "the run lies within its burn-in: the advance may be a transient"
            drift = replace(drift, reason=reason, evidence=Evidence.UNDECIDED)
        return drift
    outcome = Outcome.CYCLING if settled.velocity is None else Outcome.CREEPING
    reason = f"{NEARLY}{settled.apart:.1e} m g, not exactly" if settled.apart else ""
    if settled.period == 0:
        outcome = Outcome.AT_REST
    if outcome is not Outcome.CREEPING and advanced and not reason:
        reason = f"the chain advanced in a transient only, up to cycle {settled.since}"
    evidence = Evidence.UNDECIDED if settled.apart else Evidence.PROVED
    return Behaviour(outcome, settled.since, reason, evidence, settled.velocity or _STILL)


def _drifting(velocity: MeanVelocity, advanced: bool, since: int | None, done: int) -> Behaviour:
    chain = velocity.experiment.chain
    if velocity.experiment.mirrored:
        ages = "the chain ages: " if chain.n == 2 and chain.sigma_mu else ""
        return Behaviour(Outcome.CYCLING, since, f"{ages}no mean drift, by symmetry")
    burn_in, mean = velocity.mean(done)
    least = velocity.error(burn_in, least=True)
    value = abs(as_float(mean)) if mean is not None else 0.0
    if mean is not None and value < 2 * least:
        known = velocity.error(velocity.experiment.burn_in_of(done))
        bound = "which may be larger than their estimate"
        if not math.isnan(known):
            bound = f"|velocity| is at most {value + 2 * least:.2g}"
        reason = f"no drift is seen beyond two standard errors: {bound}"
        return Behaviour(Outcome.CYCLING, since, reason, Evidence.UNDECIDED)
    if advanced:
        return Behaviour(Outcome.CREEPING, since)
    if since is None or chain.sigma_mu != 0:
        return Behaviour(Outcome.CYCLING, since)
    reason = "not every slider has advanced, and the tensions have not returned"
    return Behaviour(Outcome.CYCLING, since, reason, Evidence.UNDECIDED)


def _advanced(velocity: MeanVelocity, begin: Mark, state: State, tally: Tally) -> bool:
    """Return whether every slider has moved the same way, by more than rounding can cause."""
    change = floats(state.displacements) - begin.displacements
    chain = velocity.experiment.chain
    rounding = nearest_float((tally.slips - begin.slips) * rounding_of(chain))
    return bool((change > rounding).all() or (change < -rounding).all())
