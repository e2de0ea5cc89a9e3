"""What a chain without disorder does in the end: it rests, is locked, or creeps.

After a transient a chain under temperature cycles is at rest (no event in a cycle), locked (slips
in every cycle return the same tensions, with no advance), or it creeps: periodically, or without
ever settling. Which of these depends on the start so finely that float64 may find another fate than
the equations have; evidence says which of the two a result speaks of.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any

from exactcreep.display import shows_progress
from exactcreep.limits import NO_LIMITS, Limits, Stop
from exactcreep.model.chain import Chain
from exactcreep.model.contacts import Itinerary
from exactcreep.model.drive import Cycles
from exactcreep.model.numbers import InputError, Number, nearest_float
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.model.state import State
from exactcreep.progress import Hearer, reporter
from exactcreep.quasistatic.decimals import Enclosure
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.solvers.exact.recurrence import MOST_PERIOD, Course
from exactcreep.studies.eventlog import rearrangements
from exactcreep.studies.fates.proof import recurrence

Period = tuple[tuple[int, Itinerary], ...]
"""The rearrangements of one period: each with its half-cycle, from 1, and its itinerary."""


@dataclass(frozen=True)
class Fate:
    """What a chain does in the end.

    Attributes
    ----------
    chain : Chain
    amplitude : Fraction
        Of the cycles.
    start : State
    solver : str
    outcome : Outcome
        `AT_REST`, `CYCLING` (locked: slips return the same tensions without an advance),
        `CREEPING` (the same tensions after a period, with an advance), `RUNAWAY`, or `LIMIT` (it
        has not settled, and `reason` says what ended the search).
    evidence : Evidence
        `PROVED`: for ever. `COMPUTED`: the float64 chain came back to the same state bit for bit.
        `UNDECIDED`: it came back to within rounding, or a comparison lay within its bound.
    cycles : int
        Whole cycles that were followed.
    settled_after : int or None
        The number m of cycles from which on the tensions at the ends of cycles repeat:
        ``T(k + period) = T(k)`` for every k >= m, and for no smaller m. Where a proved cycle has
        avalanches the tensions only tend to it: the itinerary repeats after m cycles. None: not
        settled.
    period : int or None
        Cycles.
    advance : float or None
        Of x_G over a period, unit ``g tau_dyn**2``; 0 at rest or locked.
    last_advance : int
        The last cycle, up to `settled_after` if that is known, in which x_G advanced down the
        incline (on the level, either way); 0: none.
    itinerary : tuple or None
        The rearrangements of one period: each with its half-cycle, from 1, and its itinerary.
    advance_enclosure : Enclosure or None
        The advance, of a solver that encloses it.
    reason : str
        For a runaway what proves it, for a limit which it is; else how the chain returns, if not
        exactly.
    report : mapping
        What only this solver knows.

    Examples
    --------
    >>> from exactcreep import Chain, fate
    >>> found = fate(Chain(2, 1000, "0.5", "0.6", tan_alpha="0.25"), "0.001")
    >>> found.outcome.value, found.evidence.value, found.period
    ('creeping', 'proved', 1)
    """

    chain: Chain
    amplitude: Fraction
    start: State
    solver: str
    outcome: Outcome
    evidence: Evidence
    cycles: int
    settled_after: int | None = None
    period: int | None = None
    advance: float | None = None
    last_advance: int = 0
    itinerary: Period | None = None
    advance_enclosure: Enclosure | None = None
    reason: str = ""
    report: dict[str, Any] = field(default_factory=dict)

    @property
    def velocity(self) -> float | None:
        """The advance per half-cycle once it has settled."""
        return None if self.advance is None or not self.period else self.advance / self.period / 2

    def summary(self) -> dict[str, Any]:
        """Return everything by names, ready for JSON."""
        out: dict[str, Any] = {
            "n": self.chain.n,
            "amplitude": nearest_float(self.amplitude),
            "solver": self.solver,
            "outcome": self.outcome.value,
            "evidence": self.evidence.value,
            "cycles": self.cycles,
            "settled_after": self.settled_after,
            "period": self.period,
            "advance": self.advance,
            "velocity": self.velocity,
            "last_advance": self.last_advance,
        }
        if self.advance_enclosure is not None:
            middle, radius = self.advance_enclosure
            out["advance_enclosure"] = [str(middle - radius), str(middle + radius)]
        if self.itinerary is not None:
            out["itinerary"] = [
                {
                    "half_cycle": half_cycle,
                    "events": [_words(*event) for event in events],
                }
                for half_cycle, events in self.itinerary
            ]
        return out | {"reason": self.reason, "report": dict(self.report)}


def _words(kind: str, sliders: tuple[int, ...], signs: tuple[int, ...]) -> str:
    """Return an event in words: start 5 down."""
    movers = zip(sliders, signs, strict=True)
    return f"{kind} " + ", ".join(f"{n} {'down' if sign > 0 else 'up'}" for n, sign in movers)


@shows_progress
def fate(
    chain: Chain,
    amplitude: Number,
    *,
    start: State | None = None,
    cycles: int = 10_000,
    solver: str = "certified",
    max_seconds: Number | None = None,
    progress: Hearer = None,
) -> Fate:
    """Follow a chain without disorder under temperature cycles until it has settled for ever.

    Parameters
    ----------
    chain : Chain
        Without disorder: ``sigma_mu = 0``.
    amplitude : number
        Of the cycles +A, -A.
    start : State, optional
        Default: the relaxed chain. A start that is not at rest is first rearranged.
    cycles : int
        Give up after so many.
    solver : str
        ``certified``: what it finds is proved, for ever, or undecided. ``exact``: float64,
        compiled; it finds that the forces return bit for bit with a period up to 1000, or to within
        rounding for at least 100 cycles in a row.
    max_seconds : number, optional
        Come back after so much wall time with what is known; `reason` then says so.
    progress : bool or callable, optional
        A callable is called with a `Progress`; else as for `creep`.

    Returns
    -------
    Fate
        Its `outcome`, `evidence`, `period`, `advance`, `settled_after` and `itinerary`. What has
        not settled, as chaotic creep never does, comes back as a `LIMIT`.

    Raises
    ------
    InputError
        If an argument is out of range, the chain has disorder (no tension ever returns then; see
        `survival`), or no slips (mu_s = mu_d).

    Examples
    --------
    Two sliders creep or not as the relaxed chain tells:

    >>> chain = Chain(2, 1000, "0.5", "0.6", tan_alpha="0.25")
    >>> [fate(chain, a, solver="exact").outcome.value for a in ("0.0001", "0.0003", "0.0004")]
    ['at_rest', 'at_rest', 'creeping']
    """
    experiment = Experiment.of(
        chain, Cycles(amplitude, cycles), solver=solver, start=start, record=()
    )
    if chain.sigma_mu != 0:
        allowed = "must be 0: with disorder no tension ever returns; survival tells how long"
        raise InputError("sigma_mu", chain.sigma_mu, allowed + " creep lives")
    refuse_sliding(chain)
    if solver not in WAYS:
        raise InputError("solver", solver, "must be " + " or ".join(WAYS))
    limits = Limits.of(max_seconds=max_seconds)
    return WAYS[solver](experiment, limits, reporter(progress))


def refuse_sliding(chain: Chain) -> None:
    """Raise `InputError` for a chain that slides with theta without slips."""
    if chain.sigma_mu == 0 and chain.mu_s == chain.mu_d:
        allowed = (
            "must exceed mu_d: without slips the sliders follow theta, in every cycle alike;"
            ' creep(solver="sliding") tells how'
        )
        raise InputError("mu_s", chain.mu_s, allowed)


def _computed(experiment: Experiment, limits: Limits, say: Callable[..., None]) -> Fate:
    """Return the fate that float64 finds."""
    drive = experiment.drive
    assert isinstance(drive, Cycles)
    course = Course(experiment.chain, drive, experiment.initial)
    return ended(experiment, course, *followed(course, limits, say))


def followed(
    course: Course, limits: Limits = NO_LIMITS, say: Callable[..., None] | None = None
) -> tuple[Stop, str]:
    """Follow a course to its end, and say about ten times a second how far it has come."""
    while True:
        pause = limits if say is None else replace(limits, pause=time.perf_counter() + 0.1)
        stop, reason = course.follow(pause)
        if say is not None:
            say("cycles", course.cycles, course.drive.cycles, "cycles")
        if stop is not Stop.BUDGET:
            return stop, reason


def ended(experiment: Experiment, course: Course, stop: Stop, reason: str) -> Fate:
    """Return what a course that has ended came to."""
    simulation, chain = course.simulation, experiment.chain
    drive = course.drive
    evidence = simulation.evidence
    known: dict[str, Any] = {}
    if course.settled_after is not None and course.period is not None:
        moved, itinerary = _one_period(course, course.period)
        noise = nearest_float(chain.rounding) * sum(len(events) for _, events in itinerary)
        advance = moved if abs(moved) > noise else 0.0
        outcome = Outcome.CREEPING if advance else Outcome.CYCLING
        if not itinerary:
            outcome = Outcome.AT_REST
        if course.distance:
            evidence = Evidence.UNDECIDED
            reason = f"the forces return to within {course.distance:.1e} m g, not bit for bit"
        known = {"period": course.period, "advance": advance, "itinerary": itinerary}
    elif stop is Stop.RUNAWAY:
        outcome = Outcome.RUNAWAY
    else:
        outcome = Outcome.LIMIT
        period = f"with a period up to {MOST_PERIOD}"
        reason = reason or f"not settled {period} within {drive.cycles} cycles"
    return Fate(
        chain=chain,
        amplitude=drive.amplitude,
        start=experiment.initial,
        solver=experiment.solver,
        outcome=outcome,
        evidence=evidence,
        cycles=course.cycles,
        settled_after=course.settled_after,
        last_advance=course.last_advance,
        reason=reason,
        report={"events": simulation.tally.events, "undecided": simulation.tally.undecided},
        **known,
    )


def _one_period(course: Course, period: int) -> tuple[float, Period]:
    """Return by how much x_G moves in the period that follows, and its rearrangements."""
    simulation = course.simulation.logged()
    before = simulation.state().displacements
    first = 2 * course.cycles + 1
    events = simulation.follow(Cycles(course.drive.amplitude, period), first, 2 * period).recorded
    moved = (simulation.state().displacements - before).mean()
    return float(moved), tuple(
        (one.half_cycle - first + 1, tuple(event.signature for event in one.events))
        for one in rearrangements(events)
    )


def _proved(experiment: Experiment, limits: Limits, say: Callable[..., None]) -> Fate:
    """Return the fate that the certified solver proves."""
    drive = experiment.drive
    assert isinstance(drive, Cycles)
    found = recurrence(experiment.chain, drive, experiment.initial, limits, say)
    return Fate(
        chain=experiment.chain,
        amplitude=drive.amplitude,
        start=experiment.initial,
        solver=experiment.solver,
        outcome=found.outcome,
        evidence=found.evidence,
        cycles=found.cycles,
        settled_after=found.settled_after,
        period=found.period,
        advance=None if found.advance is None else nearest_float(found.advance.middle),
        last_advance=found.last_advance,
        itinerary=found.itinerary,
        advance_enclosure=found.advance,
        reason=found.reason,
        report=found.report,
    )


WAYS: dict[str, Callable[[Experiment, Limits, Callable[..., None]], Fate]] = {
    "certified": _proved,
    "exact": _computed,
}
"""How each solver finds a fate."""
