"""A solver held against the truth: which events they share, and how far apart sliders rest.

Both sides are taken over the same rests, each leaves a `Walk`, and `agree` says how far the two
walks are the same. What one side has not come to is no difference: a walk that was cut short is
silent about all that comes after it. What time that takes is measured by `timed`.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exactcreep.limits import NO_LIMITS, Limits, Stop
from exactcreep.model.drive import Drive, Path
from exactcreep.model.enclosure import enclosure, floats
from exactcreep.model.numbers import InputError, exact_number, nearest_float
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.model.state import State
from exactcreep.progress import Hearer
from exactcreep.quasistatic.creep import run_members
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.quasistatic.result import Creep
from exactcreep.solvers.registry import rearrange, solver_named
from exactcreep.solvers.solver import Rearrangement, Simulation, Solver, advance
from exactcreep.solvers.tables import joined
from exactcreep.studies.eventlog import (
    LoggedEvent,
    LoggedRearrangement,
    first_difference,
    numbered,
    rearrangements,
)

MOST_EVENTS = 100_000
"""Certified events that may be compared: some minutes of the certified solver."""
STATISTICS_EVENTS = 200_000
"""Events of a run for its mean velocity: seconds of `exact`."""
_WORDS = {"dt": "dt = {}", "locate": "located", "digits": "{} digits"}


@dataclass(frozen=True)
class Contestant:
    """A solver with its options."""

    solver: str
    options: Mapping[str, Any] = field(default_factory=dict)

    @property
    def label(self) -> str:
        """How it is called in tables and pictures."""
        given = {name: self.options.get(name) for name in _WORDS}
        told = [_WORDS[name].format(value) for name, value in given.items() if value]
        return ", ".join([self.solver, *told])

    @property
    def short(self) -> str:
        """The same for a narrow column."""
        words = self.label.replace("dt = ", "").replace(",", "").replace(" digits", "")
        return words.replace("located", "loc.")

    def algorithm(self) -> Solver:
        """Return the solver; options out of range raise `InputError`."""
        return solver_named(self.solver, dict(self.options))

    def simulation(self, experiment: Experiment, record: tuple[str, ...] = ()) -> Simulation:
        """Return the solver at the start of an experiment, whose own solver plays no part."""
        chain, start = experiment.chain, experiment.initial
        return self.algorithm().simulation(chain, start, experiment.seed, record)

    def run(
        self, experiment: Experiment, limits: Limits = NO_LIMITS, progress: Hearer = None,
        **changed: Any,
    ) -> Creep:  # fmt: skip
        """Return the solver's run along the drive of an experiment, with other fields `changed`."""
        own = {"solver": self.solver, "options": self.options, "burn_in": None} | changed
        return run_members([replace(experiment, **own)], limits=limits, progress=progress)[0]


class Rest(NamedTuple):
    """A state at rest, and the way on: +1 dilates, -1 contracts, 0 leaves theta as it stands."""

    state: State
    way: int


@dataclass(frozen=True, eq=False)
class Walk:
    """What a solver did: its events, and where the sliders rested at the end of every target.

    Attributes
    ----------
    log : list of LoggedRearrangement
    x : ndarray, shape (targets, numbers)
        Displacements at each target that was reached (of a single rearrangement: at its end).
    ended : bool
        Whether it proved a runaway or gave up by itself, so that it has nothing more to say; a
        walk that was cut short might have gone on.
    evidence : Evidence
    """

    log: list[LoggedRearrangement]
    x: NDArray[Any]
    ended: bool
    evidence: Evidence

    @classmethod
    def of(cls, found: Rearrangement, *, tensions: bool = False) -> Walk:
        """Return a single rearrangement as a walk to one rest, whose `tensions` may count too."""
        state = found.state
        numbers = [*state.tensions.tolist()] if tensions else []
        x = np.array([[*numbers, *state.displacements.tolist()]], dtype=object)
        at_rest = found.outcome is Outcome.AT_REST
        log = [LoggedRearrangement(1, found.theta, found.events)]
        return cls(log, x if at_rest else x[:0], not at_rest, found.evidence)

    @property
    def reached(self) -> int:
        """How many targets were reached."""
        return len(self.x)

    @cached_property
    def events(self) -> list[LoggedEvent]:
        """All events in order, with their places."""
        return numbered(self.log)


@dataclass(frozen=True, eq=False)
class Agreement:
    """How far a walk agrees with the one that is known.

    Attributes
    ----------
    agreed : int
        Events before the first that differs, or all that both walks have.
    own, known : LoggedEvent or None
        The first events that differ; one of them None: it has no further event there; both: no
        event differs.
    compared : int
        Rests before the first event that differs.
    errors : ndarray, shape (rests,)
        Largest difference of a number, at every rest that both walks reached.
    """

    agreed: int
    own: LoggedEvent | None
    known: LoggedEvent | None
    compared: int
    errors: NDArray[np.float64]

    @property
    def differs(self) -> bool:
        """Whether an event differs."""
        return self.own is not None or self.known is not None

    @property
    def error_before(self) -> float:
        """The largest error before the first event that differs; nan if there is no rest."""
        return float(self.errors[: self.compared].max()) if self.compared else math.nan

    @property
    def error_after(self) -> float:
        """The largest error anywhere; nan if there is no rest."""
        return float(self.errors.max()) if self.errors.size else math.nan


def agree(own: Walk, known: Walk) -> Agreement:
    """Return which events of two walks are the same, and how far apart their rests are.

    Events are the same if their places, kinds, sliders and directions are. An event is missing
    from a walk that has reached the target on whose way it happened, or that ended by itself while
    the other one reached that target; what a walk that was cut short has not come to, is not.
    """
    shared = min(len(own.events), len(known.events))
    agreed, mine, other = first_difference(own.events, known.events) or (shared, None, None)
    for event, silent, telling in ((mine, known, own), (other, own, known)):
        if event is not None and None in (mine, other):
            last = max(telling.reached * silent.ended, silent.reached)
            if event.half_cycle > last:
                mine = other = None
    size = min(own.reached, known.reached)
    compared = min([size, *(one.half_cycle - 1 for one in (mine, other) if one is not None)])
    pairs = zip(own.x[:size], known.x[:size], strict=True)
    errors = np.array([apart(ours, theirs) for ours, theirs in pairs])
    return Agreement(agreed, mine, other, compared, errors)


def apart(one: Sequence[Any] | NDArray[Any], other: Sequence[Any] | NDArray[Any]) -> float:
    """Return the largest difference of two lists of numbers, exactly and then rounded; nan of none.

    Of numbers with a radius, it is that of their middles.
    """
    pairs = zip(one, other, strict=True)
    gaps = [abs(enclosure(a).middle - enclosure(b).middle) for a, b in pairs]
    return nearest_float(max(gaps)) if gaps else math.nan


def settled(found: Rearrangement) -> bool:
    """Return whether a rearrangement can serve as the truth: it came to rest, no tie assumed."""
    return found.outcome is Outcome.AT_REST and not found.undecided


def walk(
    contestant: Contestant,
    experiment: Experiment,
    until: int,
    *,
    enough: float = math.inf,
    limits: Limits = NO_LIMITS,
    record: tuple[str, ...] = ("x", "events"),
    say: Callable[[int], None] | None = None,
) -> Walk:
    """Return what a solver makes of an experiment's drive up to target `until`, from 1.

    Parameters
    ----------
    enough : int, optional
        Events after which no further target is begun.
    limits : Limits
        The walk is cut short where they are used up, between two events.
    record : tuple of str
        ``events``, and ``x`` if the rests are to be compared, too.
    say : callable, optional
        Called with the number of events, target by target.
    """
    simulation = contestant.simulation(experiment, record)
    parts: list[Mapping[str, NDArray[Any]]] = []
    reached, stop = 0, Stop.DONE
    while reached < until and stop is Stop.DONE and simulation.tally.events < enough:
        left = limits.after(simulation.tally.events)
        stretch = advance(simulation, experiment.drive, reached + 1, left, done=reached)
        parts.append(stretch.recorded)
        reached, stop = reached + stretch.completed, stretch.stop
        if say is not None:
            say(simulation.tally.events)
    columns = joined(parts)
    x = columns.get("x", np.empty((reached, 0)))
    log = rearrangements(columns) if parts else []
    return Walk(log, x, stop.final, simulation.evidence)


def beyond(events: int) -> int:
    """Return after how many events a walk that need not be longer than `events` is cut short."""
    return 2 * events + 100


def broken_drive(experiment: Experiment, events: int) -> tuple[Path, list[int]]:
    """Return the drive with a breakpoint between any two rearrangements, as far as is needed.

    With it the half-cycle that each breakpoint belongs to.
    """
    drive, seed = experiment.drive, experiment.seed
    simulation = Contestant("exact").simulation(experiment, ("events",))
    theta: list[Fraction] = []
    ends: list[int] = []
    for q in range(1, drive.half_cycles + 1):
        loads: list[float] = []  # theta_c of the rearrangements of this half-cycle
        for most in (beyond(events), beyond(MOST_EVENTS)):  # the latter of the very first alone
            left = Limits(most).after(simulation.tally.events)
            stretch = advance(simulation, drive, q, left, done=q - 1)
            loads += [float(one.theta) for one in rearrangements(stretch.recorded)]
            if stretch.stop is not Stop.BUDGET or theta or len(set(loads)) > 1:
                break
        between = [(Fraction(a) + Fraction(b)) / 2 for a, b in pairwise(loads) if a != b]
        theta += between
        ends += [q] * len(between)
        if stretch.stop is Stop.BUDGET and theta:
            break  # a half-cycle may have more events than memory holds
        theta.append(drive.exact_target(q, seed))
        ends.append(q)
        if stretch.stop is not Stop.DONE or simulation.tally.events >= events:
            break
    if simulation.tally.events == 0:
        raise InputError("scene", "no events", "must drive the chain so far that a slider slips")
    return Path(theta), ends


class Standard:
    """The certified walk along the drive of an experiment, which others are held against.

    With so many digits, over about so many events; the drive may end before.

    Attributes
    ----------
    experiment : Experiment
        With the broken drive, whose breakpoints let positions be compared after each rearrangement.
    ends : list of int
        The half-cycle of the drive that each of its targets belongs to.
    walk : Walk
    """

    def __init__(
        self, experiment: Experiment, digits: int, events: int,
        say: Callable[[int], None] | None = None,
    ) -> None:  # fmt: skip
        path, self.ends = broken_drive(experiment, events)
        self.experiment = replace(experiment, drive=path)
        certified, limits = Contestant("certified", {"digits": digits}), Limits(beyond(MOST_EVENTS))
        self.walk = walk(
            certified, self.experiment, path.half_cycles, enough=events, limits=limits, say=say
        )

    @property
    def events(self) -> int:
        """How many events are compared: those on the way to a target that was reached."""
        return sum(event.half_cycle <= self.walk.reached for event in self.walk.events)

    def agreement(self, contestant: Contestant) -> Agreement:
        """Return how far a contestant agrees with the certified walk."""
        limits = Limits(beyond(len(self.walk.events)))
        own = walk(contestant, self.experiment, self.walk.reached, limits=limits)
        return agree(own, self.walk)


def positions(
    contestant: Contestant, experiment: Experiment, until: int, limits: Limits = NO_LIMITS
) -> NDArray[np.float64]:
    """Return x_G at the first targets of an experiment's drive, as far as the limits allow.

    Raises `InputError` if the chain never comes to rest.
    """
    stretch = advance(contestant.simulation(experiment), experiment.drive, until, limits)
    if stretch.stop is Stop.RUNAWAY:
        raise InputError("tan_alpha", experiment.chain.tan_alpha, "must be such that it rests")
    return floats(stretch.recorded["x_G"])


def steady(x_G: NDArray[np.float64], experiment: Experiment) -> int:
    """Return the first target that counts for a mean: the first fifth is left out, whole cycles."""
    first = max(x_G.size // 5, 1)
    return first + (x_G.size - first) % 2 * experiment.drive.cyclic


def mean_velocity(x_G: NDArray[np.float64], experiment: Experiment) -> float:
    """Return the mean advance per target but for the first fifth; nan if nothing is left."""
    first = steady(x_G, experiment)
    if x_G.size <= first:
        return math.nan
    return float(x_G[-1] - x_G[first - 1]) / (x_G.size - first)


class Lap(NamedTuple):
    """How long a simulation took, and how far it came."""

    seconds: float
    half_cycles: int
    events: int

    @property
    def pace(self) -> float:
        """Seconds per half-cycle; nan if none was completed."""
        return self.seconds / self.half_cycles if self.half_cycles else math.nan


def timed(simulation: Simulation, drive: Drive, until: int, limits: Limits, done: int = 0) -> Lap:
    """Take a simulation from target `done` of a drive to `until`, or as far as it may."""
    events, begin = simulation.tally.events, time.perf_counter()
    completed = advance(simulation, drive, until, limits, done=done).completed
    return Lap(time.perf_counter() - begin, completed, simulation.tally.events - events)


def rests_along(experiment: Experiment, longest: int) -> Iterator[Rest]:
    """Yield every rest along the way of the exact solver from which a rearrangement starts.

    What a rearrangement hands on is rounded to float64, so that every solver can start from it.
    The way ends before a rearrangement of more than `longest` events, or one without end.
    """
    chain, drive, seed = experiment.chain, experiment.drive, experiment.seed
    state = experiment.initial
    for q in range(drive.half_cycles + 1):
        # before the first target: the start may have to be rearranged at its own theta
        target = drive.exact_target(q, seed) if q else enclosure(state.theta).middle
        while True:
            now = enclosure(state.theta).middle
            way = int(target > now) - int(target < now)
            if q and way == 0:
                break
            found = rearrange(chain, state, direction=way, seed=seed, max_events=longest)
            if not found.events or way * (enclosure(found.theta).middle - target) > 0:
                break
            if found.outcome is not Outcome.AT_REST:
                return
            yield Rest(state, way)
            state = found.state
            if way == 0:
                break


def rests_between(experiment: Experiment) -> Iterator[Rest]:
    """Yield rests along the way of the exact solver at random dilations, four to a half-cycle.

    The first two half-cycles, which the start still shapes, are left out.
    """
    drive, seed = experiment.drive, experiment.seed
    simulation = Contestant("exact").simulation(experiment)
    rng = np.random.default_rng(seed)
    before = exact_number(experiment.initial.theta, "theta")
    for q in range(1, drive.half_cycles + 1):
        target = drive.exact_target(q, seed)
        way = int(target > before) - int(target < before)
        places = sorted(rng.random(4).tolist()) if q > 2 and way else []
        for place in (*map(Fraction, places), Fraction(1)):
            between = before + (target - before) * place
            if advance(simulation, Path([between]), 1).stop is not Stop.DONE:
                return
            if place < 1:
                yield Rest(simulation.state(), way)
        before = target
