"""What every solver offers: a rearrangement in full, and a simulation that follows a drive."""

from __future__ import annotations

import math
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from importlib import import_module
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from exactcreep.limits import NO_LIMITS, Limits, Stop
from exactcreep.model.chain import Chain
from exactcreep.model.contacts import Contacts, Event, Itinerary
from exactcreep.model.drive import Drive
from exactcreep.model.enclosure import same_numbers
from exactcreep.model.numbers import InputError, Scalar, Shown
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.model.state import State
from exactcreep.motion.arithmetic import FLOAT64, Arithmetic
from exactcreep.motion.replay import Replay
from exactcreep.motion.solution import Solution
from exactcreep.solvers.tables import RECORDS, TABLES, joined, lists_columns

MOST_EVENTS = 20_000
"""`rearrange` gives up after so many events, unless it is told another number."""
ONE_REARRANGEMENT = Limits(events=MOST_EVENTS)
_STRETCH_SECONDS = 0.1  # of an advance that somebody watches
_LONGEST_STRETCH = 1 << 21  # numbers at targets; bounds the memory of a stretch


class Energy(NamedTuple):
    """Where the energy of a rearrangement is; unit ``m g**2 tau_dyn**2``.

    Attributes
    ----------
    kinetic, elastic : number or ndarray
    gravity : number or ndarray
        Potential energy in the field of gravity, zero at the start.
    dissipated : number or ndarray
        What friction has taken since the start.
    """

    kinetic: Any
    elastic: Any
    gravity: Any
    dissipated: Any


@dataclass(frozen=True, eq=False, repr=False, init=False)
class Rearrangement(Shown):
    """One mechanical rearrangement, from unstable rest to rest.

    What a solver did not need is made when it is asked for, and kept.

    Attributes
    ----------
    chain : Chain
    initial : State
        At rest, at theta_c.
    events : tuple of Event
        In order of time; empty if no slider exceeds its threshold.
    outcome : Outcome
        `AT_REST`, `RUNAWAY` (proved never to come to rest) or `LIMIT` (given up).
    evidence : Evidence
    state : State
        At rest at the end; for a runaway or a limit the sliders are where they were when it was
        proved or given up.
    velocities : ndarray, shape (n,)
        At the end; zero unless the outcome is a runaway or a limit.
    sol : Solution
        Positions, velocities and forces at any time between the first event and the last.
    undecided : int
        Comparisons inside their rounding bound, settled by the model's rules.
    draws_below_mu_d : int
        Static coefficients drawn below `mu_d`, which act as `mu_d`.
    solver : str
    seed : int
        Keys the coefficients that were drawn at stops.
    arithmetic : Arithmetic
        The numbers that the solver computes with.
    decided : Evidence
        What the solver's comparisons alone are worth.
    report : mapping
        What only this solver knows: precision, enclosure radii, work counts.
    reason : str
        For a runaway what proves it, for a limit which it is: one sentence.
    motion : Solution or None
        The closed form, if the solver has kept it.
    error : float
        Of `exact`: estimate, not a bound, of the largest error that rounding leaves in a tension
        (unit ``m g``) or in the displacement of a slider within the rearrangement; inf where the
        order of events itself is in doubt. nan of solvers that do not estimate it. The rounding
        of the state's numbers to float64 comes on top.
    doubt : str
        Why `error` breaks the promise of 1e-12, so that the evidence is `UNDECIDED`; else empty.

    Notes
    -----
    Two are equal if they are of one solver, chain and seed, begin and end in equal states with
    equal velocities, and have equal events, outcome, reason and counts: what follows from these
    (`sol`, `evidence`, `error`, `doubt`) and the work that it took (`report`) are not compared.
    Pickles keep what has been made, and the rest is made when it is asked for.

    Examples
    --------
    >>> from exactcreep import Chain, State, rearrange
    >>> chain = Chain(2, 1000, "0.5", "0.6", tan_alpha="0.25")
    >>> slip = rearrange(chain, State.relaxed(chain), direction=+1)
    >>> slip.itinerary, slip.outcome.value, slip.evidence.value
    ((('start', (2,), (1,)), ('stop', (2,), (1,))), 'at_rest', 'computed')
    """

    shown_as: ClassVar[str] = "Rearrangement"
    chain: Chain
    initial: State
    events: tuple[Event, ...]
    outcome: Outcome
    state: State
    velocities: NDArray[Any]
    undecided: int
    draws_below_mu_d: int
    solver: str
    seed: int
    arithmetic: Arithmetic
    decided: Evidence
    report: Mapping[str, Any]
    reason: str
    motion: Solution | None

    def __init__(self, **known: Any) -> None:
        """Take over what the solver knows: the fields by name, `initial` and `events` perhaps not.

        Evidence is that of a float64 solver, and the arithmetic its own, unless they are given.
        """
        vars(self).update(_USUAL, **known)

    @property
    def evidence(self) -> Evidence:
        """How well the result is known."""
        return self.decided

    @cached_property
    def sol(self) -> Solution:
        """Positions, velocities and forces at any time between the first event and the last."""
        if self.motion is not None:
            return self.motion
        with self.arithmetic.active():
            return self.replay().solution()

    @property
    def error(self) -> float:
        """An estimate of what rounding does to the result, nan if there is none."""
        return math.nan

    @property
    def doubt(self) -> str:
        """Why `error` breaks the promise of 1e-12, if it does."""
        return ""

    def replay(self, arithmetic: Arithmetic | None = None) -> Replay:
        """Return a replay of the events, by default in the solver's own arithmetic."""
        return Replay(
            self.chain,
            self.initial,
            self.events,
            self.arithmetic if arithmetic is None else arithmetic,
            Contacts(self.chain, self.seed),
        )

    @property
    def itinerary(self) -> Itinerary:
        """The sequence of events without their times."""
        return tuple(event.signature for event in self.events)

    @property
    def duration(self) -> Scalar:
        """Time of the last event, 0 if there is none; unit tau_dyn."""
        return self.events[-1].time if self.events else 0

    @property
    def theta(self) -> Scalar:
        """The dilation theta_c at which the chain rearranges."""
        return self.initial.theta

    def energy(self, t: ArrayLike) -> Energy:
        """Return where the energy is at `t`, as float64, unit ``m g**2 tau_dyn**2``.

        Parameters
        ----------
        t : number or array_like, shape (m,)
            Time(s) since the first event, unit tau_dyn.

        Raises
        ------
        ValueError
            If a time lies before the first event or after the last.
        """
        known = self.sol(t)
        start = self.initial.displacements.astype(float)
        moved = known.positions.astype(float).T - start
        tensions = self.initial.tensions.astype(float) + np.diff(moved, axis=-1)
        kinetic = (known.velocities.astype(float).T ** 2).sum(axis=-1) / 2
        elastic = (tensions**2).sum(axis=-1) / 2
        gravity = -self.chain.sin_alpha * moved.sum(axis=-1)
        before = (self.initial.tensions.astype(float) ** 2).sum() / 2
        return Energy(kinetic, elastic, gravity, before - kinetic - elastic - gravity)

    def plot(self) -> Any:
        """Draw velocities in space and time, and the energies, in a new figure of pyplot.

        Returns
        -------
        tuple of Axes
            Of the space-time diagram, and of the energies.
        """
        return import_module("exactcreep.figures.run_plots").plot_rearrangement(self)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Rearrangement):
            return NotImplemented
        return all(
            getattr(self, name) == getattr(other, name) for name in _COMPARED
        ) and same_numbers(self.velocities, other.velocities)

    def __hash__(self) -> int:
        return hash((self.solver, self.seed, self.outcome, self.state))

    def _facts(self) -> dict[str, Any]:
        return {
            "n": self.chain.n,
            "theta": float(f"{float(self.theta):.9g}"),
            "events": len(self.events),
            "outcome": self.outcome,
            "evidence": self.evidence,
            "duration": float(f"{float(self.duration):.6g}"),
            "solver": self.solver,
            "reason": self.reason,
        }


_USUAL: dict[str, Any] = {
    "seed": 0,
    "arithmetic": FLOAT64,
    "decided": Evidence.COMPUTED,
    "reason": "",
    "motion": None,
}
_COMPARED = (
    "solver", "seed", "outcome", "reason", "undecided", "draws_below_mu_d", "chain", "state",
    "events", "initial",
)  # fmt: skip


@dataclass
class Tally:
    """Counts since the start of a simulation."""

    rearrangements: int = 0
    events: int = 0
    """Start and stop events; a simultaneous set of sliders is one event."""
    slips: int = 0
    """Motions of one slider from a start to a stop."""
    draws_below_mu_d: int = 0
    undecided: int = 0
    long_rearrangements: int = 0
    """Rearrangements of so many events that float64 does not promise 1e-12 (of `exact`)."""


class Ending(NamedTuple):
    """Why a simulation came back; `reason` is a sentence, unless every target was reached."""

    stop: Stop
    reason: str = ""


@lists_columns(*TABLES)
@dataclass(frozen=True, eq=False)
class Stretch:
    """What `Simulation.follow` and `advance` came to.

    Attributes
    ----------
    completed : int
        Targets reached in this call.
    recorded : mapping of str to ndarray
        ``x_G`` (completed,), and if asked for ``x`` (completed, n), ``tension`` (completed,
        n - 1), ``slips`` (completed, n), each at the end of a half-cycle; if ``events``,
        ``rearrangements`` or ``slip_table`` was asked for, the columns of that table.
    stop : Stop
        Why it ended.
    reason : str
        Unless every target was reached: one sentence.
    begun : mapping of str to ndarray
        Rows of tables since the last target, of a solver that may have to write them anew: the
        next stretch brings them again.
    doubts : ndarray of int64 or None
        At each target: how much of the way so far is undecided; None if that is not known.
    """

    completed: int
    recorded: Mapping[str, NDArray[Any]]
    stop: Stop = Stop.DONE
    reason: str = ""
    begun: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    doubts: NDArray[np.int64] | None = None

    @property
    def whole(self) -> Mapping[str, NDArray[Any]]:
        """What was recorded, with what has begun since the last target."""
        return joined([self.recorded, self.begun])


class Simulation(ABC):
    """A chain on its way along a drive: the only mutable thing in the package."""

    tally: Tally

    @abstractmethod
    def follow(self, drive: Drive, first: int, count: int, limits: Limits = NO_LIMITS) -> Stretch:
        """Take the chain to targets `first` .. `first + count - 1` of the drive.

        Returns early, with fewer targets completed, soon after the events of `limits` are used up,
        which count from this call, or the time is over; calling again with ``first`` = the first
        target not completed goes on, with the same bits as if it had never returned.
        """

    @abstractmethod
    def state(self) -> State:
        """Return the present state (between two events if `follow` returned early)."""

    @property
    @abstractmethod
    def at_rest(self) -> bool:
        """Whether a snapshot can be taken now: between rearrangements, or at a target."""

    @abstractmethod
    def snapshot(self) -> dict[str, Any]:
        """Return how far the chain is, at rest: plain numbers and arrays by name.

        The state as the solver knows it, theta, and counts; nothing of what is recorded.
        """

    @abstractmethod
    def restore(self, snapshot: Mapping[str, Any]) -> None:
        """Go on from a snapshot of a simulation with the same start, seed and records.

        Raises
        ------
        ValueError
            If its shapes, ranges or counts cannot be those of such a simulation.
        """

    def come_to_rest(self, limits: Limits) -> Mapping[str, NDArray[Any]]:
        """Let the rearrangement under way end, if the limits allow it; return what is logged."""
        return {}

    def perturbed(self) -> Simulation | None:
        """Return a simulation whose start is a few roundings off, to be taken the same way.

        None if rounding does not matter to this one, or nobody knows how it does.
        """
        return None

    @property
    def evidence(self) -> Evidence:
        """How well everything up to now is known."""
        return Evidence.of(self.tally.undecided, Evidence.COMPUTED)

    def report(self) -> dict[str, Any]:
        """Return what only this solver knows: precision, enclosure radii, work counts."""
        return {}


def require(holds: bool, otherwise: str) -> None:
    """Raise `ValueError` with a sentence unless something holds of a snapshot."""
    if not holds:
        raise ValueError(otherwise)


def same_kind(like: Any, given: Any, name: str = "it") -> Any:
    """Return `given` if its names, types and shapes are those of `like`, else raise `ValueError`.

    An array of `like` without rows stands for any number of them.
    """
    if isinstance(like, Mapping):
        require(isinstance(given, Mapping) and like.keys() == given.keys(), f"{name} lacks a name")
        for key, value in like.items():
            same_kind(value, given[key], key)
    elif isinstance(like, np.ndarray):
        fits = isinstance(given, np.ndarray) and given.dtype == like.dtype
        free = like.shape[:1] == (0,) and fits and given.ndim == like.ndim
        alike = free and given.shape[1:] == like.shape[1:]
        require(fits and (given.shape == like.shape or alike), f"{name} has another shape")
    else:
        require(type(given) is type(like), f"{name} is of another kind")
    return given


@dataclass(frozen=True, eq=False)
class Start:
    """A chain, the state from which it departs, and the seed of what is drawn on the way."""

    chain: Chain
    state: State
    seed: int


class Solver(ABC):
    """An algorithm and its options (a frozen dataclass whose fields are the options).

    `__post_init__` validates the options and raises `InputError`. A subclass says what it does
    from a `Start`; everybody calls `rearrange`, `iterate` and `simulation`.
    """

    name: ClassVar[str]
    summary: ClassVar[str]
    """One line for humans."""
    needs_slips: ClassVar[bool] = True
    """Whether it refuses a chain that slides with theta, which only `sliding` follows."""
    perturbs: ClassVar[bool] = False
    """Whether its simulations know what a few roundings make of them; `Simulation.perturbed`."""
    records: ClassVar[tuple[str, ...]] = RECORDS
    no_more: ClassVar[str] = ""
    """What its simulations can record, and why no more."""

    def rearrange(
        self,
        chain: Chain,
        state: State,
        direction: int,
        seed: int,
        limits: Limits = ONE_REARRANGEMENT,
    ) -> Rearrangement:
        """Ramp theta in `direction` (+1, -1; 0: as it stands) to theta_c, and rearrange.

        Comes back with what there is, and the outcome `LIMIT`, after the events of `limits` (a few
        more, if they are simultaneous) or soon after its time is over.
        """
        return self.rearrange_from(self._start(chain, state, seed), direction, limits)

    def iterate(self, chain: Chain, state: State, direction: int, seed: int) -> Iterator[Event]:
        """Return an iterator over the events of `rearrange`, each as soon as it is known."""
        return self.events_from(self._start(chain, state, seed), direction)

    def simulation(
        self, chain: Chain, state: State, seed: int, record: tuple[str, ...]
    ) -> Simulation:
        """Return a simulation that starts from `state`.

        A start that is not at rest is first rearranged at its own theta, within the first call of
        `Simulation.follow`.
        """
        for name in record:
            if name not in self.records:
                allowed = "must be one of " + ", ".join(self.records) + self.no_more
                raise InputError("record", name, allowed)
        return self.simulation_from(self._start(chain, state, seed), record)

    def _start(self, chain: Chain, state: State, seed: int) -> Start:
        if self.needs_slips and chain.slides:
            raise InputError(
                "mu_s",
                chain.mu_s,
                "equal to mu_d with sigma_mu = 0 leaves no slips, the sliders slide with theta:"
                ' use solver="sliding"',
            )
        return Start(chain, state, seed)

    @abstractmethod
    def rearrange_from(self, start: Start, direction: int, limits: Limits) -> Rearrangement:
        """Do what `rearrange` says."""

    def events_from(self, start: Start, direction: int) -> Iterator[Event]:
        """Do what `iterate` says; by default, when the rearrangement is over."""
        yield from self.rearrange_from(start, direction, ONE_REARRANGEMENT).events

    @abstractmethod
    def simulation_from(self, start: Start, record: tuple[str, ...]) -> Simulation:
        """Do what `simulation` says."""

    def compiles(self, n: int) -> tuple[int, ...]:
        """Return lengths of chains with which all is compiled that one of `n` sliders may need.

        What the first of them leaves out is compiled when a chain needs it.
        """
        return (2,)


def advance(
    simulation: Simulation,
    drive: Drive,
    until: int,
    limits: Limits = NO_LIMITS,
    *,
    done: int = 0,
    take: Callable[[Stretch], str | None] | None = None,
) -> Stretch:
    """Take a chain from target `done` of a drive to target `until`, and say why it ended.

    Parameters
    ----------
    simulation : Simulation
    drive : Drive
    until : int
        The last target, from 1.
    limits : Limits
        `events` count from this call, `bytes` what is recorded in it.
    done : int
        Targets reached before.
    take : callable, optional
        Is given what was recorded, stretch by stretch, about ten times a second. It ends the
        advance as a `LIMIT` by returning a sentence that says why.

    Returns
    -------
    Stretch
        `completed` targets after `done`, why it stopped, and all that was recorded on the way, but
        not what `take` was given.

    Notes
    -----
    Guarantee: how far one stretch goes depends on the clock, and changes no bit.
    """
    start, before = done, simulation.tally.events
    parts: list[Mapping[str, NDArray[Any]]] = []
    begun: Mapping[str, NDArray[Any]] = {}
    held = 0  # bytes
    watched = take is not None or limits.bytes is not None
    longest = max(_LONGEST_STRETCH // simulation.state().n, 1)
    ended = Ending(Stop.DONE)
    while done < until:
        left = limits.after(simulation.tally.events - before)
        if limits.bytes is not None and held > limits.bytes:
            ended = Ending(Stop.BUDGET, limits.full)
            break
        if (early := left.stop(0)) is not None:
            ended = Ending(early, left.reason(early))
            break
        if watched:
            left = replace(left, pause=time.perf_counter() + _STRETCH_SECONDS)
        # what may be full at any time is looked at often
        most = longest if limits.bytes is None else min(2 + done - start, longest)
        stretch = simulation.follow(drive, done + 1, min(most, until - done), left)
        done, begun = done + stretch.completed, stretch.begun
        told = None
        if take is not None:
            told = take(stretch)
        else:
            parts.append(stretch.recorded)
            held += sum(values.nbytes for values in stretch.recorded.values())
        if stretch.stop.final or stretch.stop is Stop.DEADLINE:
            ended = Ending(stretch.stop, stretch.reason)
            break
        if told and done < until:
            ended = Ending(Stop.LIMIT, told)
            break
    recorded = {"x_G": np.empty(0)} | joined(parts)
    return Stretch(done - start, recorded, *ended, begun)
