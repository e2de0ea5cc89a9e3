"""Find out what a chain without disorder does in the end: it rests, locks, or creeps.

The fate depends so finely on the start that float64 may find another fate than the equations have;
the evidence of a result says whether it is proved or computed in float64.

*Locked in the limit* (`notebooks/explanation/fates.md`): the forces approach a locked cycle, and
change by 1.5 D/k^2 in cycle k. This is recognized, not proved: every cycle has the same slips, at
least one slider rests, and the changes fall at least like 1/k^2 and sum to less than any resting
slider needs to slip.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from exactcreep import solvers
from exactcreep.model.chain import Chain, rounding_of
from exactcreep.model.drive import Cycles
from exactcreep.model.numbers import InputError, Number, nearest_float
from exactcreep.model.outcome import Evidence, Outcome, cycles_text
from exactcreep.model.state import State
from exactcreep.quasistatic.creep import interruptible
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.solvers.return_map import LONGEST_PERIOD, LimitCycle
from exactcreep.studies import fates
from exactcreep.studies.event_log import rearrangements
from exactcreep.studies.fates.fate_result import Fate, Period
from exactcreep.studies.sense import CHAOTIC, FATE, require_sense
from exactcreep.watch.display import shows_progress
from exactcreep.watch.limits import NO_LIMITS, Limits, Stop
from exactcreep.watch.preparation import clock
from exactcreep.watch.progress import Hearer, reporter

_TRIED = 100  # cycles after which a chain that has not settled is chaotic
_SAYING = 0.1  # seconds between two reports of progress
_SILENT = reporter(None)


@shows_progress
@interruptible
def fate(
    chain: Chain,
    amplitude: Number,
    *,
    start: State | None = None,
    cycles: Number = 10_000,
    solver: str = "certified",
    max_seconds: Number | None = None,
    progress: Hearer = None,
) -> Fate:
    """Find out whether a chain without disorder rests, is locked (cycling) or creeps for ever.

    A locked chain slips back and forth without an advance (outcome `CYCLING`).

    Parameters
    ----------
    chain : Chain
        Without disorder: ``sigma_mu = 0``.
    amplitude : number
        Amplitude A of the cycles +A, -A.
    start : State, optional
        Initial state, as for `creep`. Default: the relaxed chain (theta = 0, no tensions).
    cycles : int
        Largest number of cycles to follow.
    solver : str
        ``exact`` follows the chain in float64, until the forces are those of an earlier cycle: bit
        for bit, or to within rounding in 100 successive cycles. It says so if two starts that
        differ by a few rounding errors settle otherwise. ``certified`` then proves the fate. If a
        proof cannot come, or a limit ends it, you get the answer of float64, with the reason.
    max_seconds : number, optional
        Wall time after which the result so far is returned; `reason` then says so.
    progress : bool or callable, optional
        A callable is called with a `Progress`, whose `answer` says what is known by then; else as
        for `creep`.

    Returns
    -------
    Fate
        Its `outcome` is `AT_REST`, `CYCLING`, `CREEPING` or `RUNAWAY`; `LIMIT` if the chain has not
        settled. Chaotic creep never settles.

    Raises
    ------
    InputError
        If an argument is out of range, the chain has disorder (then no tension ever returns; see
        `survival`), or no slips (mu_s = mu_d).

    Examples
    --------
    >>> [fate(pair, a, solver="exact").outcome.value for a in ("0.0001", "0.0003", "0.0004")]
    ['at_rest', 'at_rest', 'creeping']
    """
    drive = Cycles(amplitude, cycles)
    experiment = Experiment(chain, drive, solver=solver, start=start, record=())
    require_sense(chain, FATE, drive.amplitude)
    if solver not in ("certified", "exact"):
        raise InputError("solver", solver, "must be certified or exact")
    limits, say, begin = Limits.of(max_seconds=max_seconds), reporter(progress), experiment.initial
    search = solvers.SettlingSearch(chain, drive, begin, say=say)
    computed, stop = numerical_fate(search, begin, limits, say)
    if computed.settled_after is not None and not computed.marginal:
        copies = [numerical_fate(copy, begin, limits)[0] for copy in search.copies()]
        if not limits.passed():
            computed = _by_rounding(computed, *copies)
    if solver == "exact":
        return computed
    why = _obstacle(computed, stop, drive.cycles)
    if not why:
        proving = f"{computed.sentence}; a proof is tried"
        say("proof", 0, 0, "cycles", answer=proving)
        proof = fates.proved_fate(chain, drive, begin, limits, say).fate
        if proof.outcome is not Outcome.LIMIT:
            return proof
        if not limits.passed():
            return replace(proof, reason=f"{proof.reason}; float64 has it {computed.finding}")
        why = f"{proof.reason} before it was proved"
    return replace(computed, reason="; ".join(filter(None, (computed.reason, why))))


def _by_rounding(own: Fate, *copies: Fate) -> Fate:
    """Return a fate of float64 that says what copies, a few rounding errors away, do otherwise."""
    runs = (own, *copies)
    after = [one.cycles if one.settled_after is None else one.settled_after for one in runs]
    lasting = ["more than " * (one.settled_after is None) + cycles_text(count)
               for one, count in zip(runs, after, strict=True)]  # fmt: skip
    said, evidence = f"settle after {' and '.join(lasting[1:])}", own.evidence
    if len({(one.outcome, one.direction) for one in runs if one.outcome is not Outcome.LIMIT}) > 1:
        ends = (replace(copy, evidence=Evidence.UNDECIDED).finding for copy in copies)
        said, evidence = f"end otherwise ({'; '.join(ends)})", Evidence.UNDECIDED
    # rounding may also delay a sure return, by a period or two
    elif max(after) - min(after) <= 2 * max(one.period or 0 for one in runs):
        return own
    reason = f"settled after {lasting[0]} with this rounding; starts that differ by a few rounding"
    reason = "; ".join(filter(None, (own.reason, f"{reason} errors {said}")))
    return replace(own, evidence=evidence, by_rounding=True, reason=reason)


def _obstacle(computed: Fate, stop: Stop, cycles: int) -> str:
    """Return why a proof of what float64 has found cannot come; "" if it may."""
    if stop is Stop.DEADLINE or computed.marginal:  # no ball encloses an approach like 1/k
        return "no proof was begun"
    chain, unsettled = computed.chain, computed.outcome is Outcome.LIMIT and cycles >= _TRIED
    if unsettled and chain.n >= CHAOTIC:
        chaos = f"creep from {CHAOTIC} sliders on is chaotic, so no proof was begun;"
        return f"{chaos} survival tells how long it lasts"
    avalanches = not all(fates.lone(one) for _, one in computed.itinerary or ())
    return fates.obstacle(chain) if unsettled or avalanches else ""


def numerical_fate(
    search: solvers.SettlingSearch,
    start: State,
    limits: Limits = NO_LIMITS,
    say: Callable[..., None] = _SILENT,
) -> tuple[Fate, Stop]:
    """Follow a trajectory from `start` until it settles; return its fate, and why it ended."""
    while True:
        stop, reason = search.follow(replace(limits, pause=clock() + _SAYING))
        so_far = f"not settled in {cycles_text(search.cycles)} so far ({Evidence.COMPUTED.value})"
        say("cycles", search.cycles, search.drive.cycles, "cycles", so_far=so_far)
        if stop is not Stop.BUDGET:
            break
    simulation, drive = search.simulation, search.drive
    known: dict[str, Any] = {"outcome": Outcome.LIMIT, "evidence": simulation.evidence}
    known |= {"reason": reason, "advanced_until": search.advanced_until}
    if (settled := search.settled) is not None:
        moved, itinerary = _one_period(search, settled)
        count = sum(len(events) for _, events in itinerary)
        noise = nearest_float(rounding_of(simulation.chain)) * count
        advance = moved if abs(moved) > noise else 0.0
        known |= {"settled_after": settled.since, "period": settled.period}
        known |= {"advance": advance, "itinerary": itinerary, "outcome": Outcome.AT_REST}
        if itinerary:
            known["outcome"] = Outcome.CREEPING if advance else Outcome.CYCLING
        if settled.apart:
            reason = f"the forces return to within {settled.apart:.1e} m g, not bit for bit"
            known |= {"evidence": Evidence.UNDECIDED, "reason": reason}
    elif stop is Stop.RUNAWAY:
        known["outcome"] = Outcome.RUNAWAY
    elif not reason:
        why = f"not settled with a period up to {LONGEST_PERIOD} within {drive.cycles} cycles"
        known |= _approach(search) or {"reason": why}
    report = {"events": simulation.tally.events, "undecided": simulation.tally.undecided}
    fate = Fate(
        simulation.chain, drive.amplitude, start, "exact", cycles=search.cycles, report=report,
        **known,
    )  # fmt: skip
    return fate, stop


def _approach(search: solvers.SettlingSearch) -> dict[str, Any]:
    """Return what is known of a fate if the forces approach a locked cycle; else nothing."""
    chain, approach = search.simulation.chain, search.approaching()
    if approach is None:
        return {}
    simulation = search.recording()
    drive, log, forces = Cycles(search.drive.amplitude, 1), [], []
    for half in (1, 2):
        recorded = simulation.follow(drive, 2 * search.cycles + half, 1).recorded
        log += [(half, logged.itinerary) for logged in rearrangements(recorded)]
        forces.append(simulation.state().forces(chain))
    slipping = {n for _, itinerary in log for _, sliders, _ in itinerary for n in sliders}
    resting = [n for n in range(1, chain.n + 1) if n not in slipping]
    if not resting:
        return {}
    rooms = np.array(chain.each("mu_s", chain.times_cosine)) - np.abs(forces).max(axis=0)
    # the room that the driven sliders have left decides how often they slip
    room = float(rooms[[*chain.rates, *(n - 1 for n in resting)]].min())
    if approach.ahead >= room:
        return {}
    left = f"have {approach.ahead:.1e} to go, and sliders at rest {room:.1e} to a slip"
    return {
        "outcome": Outcome.CYCLING,
        "evidence": Evidence.UNDECIDED,
        "reason": f"{approach.reason}, {left}",
        "marginal": True,
        "period": 1,
        "advance": 0.0,
        "settled_after": search.alike_since,
        "advanced_until": search.advanced_before,
        "itinerary": tuple(log),
    }


def _one_period(search: solvers.SettlingSearch, cycle: LimitCycle) -> tuple[float, Period]:
    """Return the advance in a period, and its rearrangements in order from its first half-cycle."""
    simulation, period = search.recording(), 2 * cycle.period
    before = simulation.state().displacements
    events = simulation.follow(search.drive, 2 * search.cycles + 1, period).recorded
    moved = (simulation.state().displacements - before).mean()
    first = 2 * cycle.since + 1
    log = [((one.half_cycle - first) % period + 1, one.itinerary) for one in rearrangements(events)]
    return float(moved), tuple(sorted(log, key=lambda one: one[0]))
