"""What every solver offers: a rearrangement in full, and a simulation that follows a drive."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from importlib import import_module
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from exactcreep.model.chain import Chain
from exactcreep.model.contacts import Contacts, Event, Itinerary
from exactcreep.model.drive import Cycles, Drive
from exactcreep.model.enclosure import same_numbers
from exactcreep.model.numbers import InputError, Scalar
from exactcreep.model.outcome import Evidence, Outcome, found_text
from exactcreep.model.result import Result
from exactcreep.model.state import State
from exactcreep.motion.arithmetic import FLOAT64, Arithmetic
from exactcreep.motion.replay import Replay
from exactcreep.motion.solution import Solution
from exactcreep.solvers.tables import RECORDS, joined
from exactcreep.watch.limits import NO_LIMITS, Limits, Stop
from exactcreep.watch.preparation import preparing

MOST_EVENTS = 20_000
"""`rearrange` gives up after so many events, unless it is told another number."""
LONGEST_AVALANCHE = 10**6
"""Events of one avalanche that may never end after which it is given up, and 1000 a slider."""
ONE_REARRANGEMENT = Limits(events=MOST_EVENTS)
TENSION_TOLERANCE = 1e-12
"""What float64 promises for one rearrangement: the largest error of a tension, in units ``m g``."""
_NO_SLIPS = (
    "equal to mu_d with sigma_mu = 0 leaves no slips, the sliders slide with theta:"
    ' use solver="sliding"'
)
_LONGEST_STRETCH = 1 << 21  # numbers at targets; bounds the memory of a stretch
_TWO_SLIDERS = Chain(2, 10, "1/2", "3/5", "1/100", tan_alpha="1/4")
_COMPILED: set[tuple[str, int, tuple[str, ...]]] = set()


def longest_avalanche(chain: Chain) -> int:
    """Return after how many events an avalanche of a chain is given up.

    Only on slopes from mu_d on: below, every avalanche ends. On the slope mu_d itself friction
    takes exactly what gravity gives, and one may go round for ever without all sliders ever moving.
    """
    return LONGEST_AVALANCHE + 1000 * chain.n if chain.may_run_away else 2**62


class Energy(NamedTuple):
    """Where the energy of a rearrangement is; unit ``m g**2 tau_dyn**2``, numbers or arrays.

    `gravity`, the potential energy in its field, and `dissipated` count from the start.
    """

    kinetic: Any
    elastic: Any
    gravity: Any
    dissipated: Any


@dataclass(frozen=True, eq=False, repr=False, init=False)
class Rearrangement(Result):
    """One mechanical rearrangement, from unstable rest to rest.

    What a solver did not need is made when it is asked for, and kept. `==` compares all but
    `report` and what follows from the rest.

    Parameters
    ----------
    **attributes
        What follows, by name.

    Attributes
    ----------
    chain : Chain
        What was rearranged.
    initial, state : State
        At rest at theta_c, and at the end.
    events : tuple of Event
        In order of time; empty if no slider exceeds its threshold.
    outcome : Outcome
        `AT_REST`, `RUNAWAY` (proved) or `LIMIT` (given up).
    velocities : ndarray, shape (n,)
        At the end; zero at rest.
    undecided, draws_below_mu_d : int
        Comparisons inside their rounding bound, settled by the model's rules; static coefficients
        drawn below `mu_d`, which act as `mu_d`.
    solver, seed : str, int
        The seed keys the coefficients that were drawn at stops.
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

    def __init__(self, **attributes: Any) -> None:
        vars(self).update(_USUAL, **attributes)

    @classmethod
    def of(cls, moved: Any, solver: str, ended: Ending, **attributes: Any) -> Self:
        """Return the rearrangement that a solver has come to.

        Parameters
        ----------
        moved : Simulation or ChainIntegrator
            The chain as it is now, and its counts.
        solver : str
            Its name.
        ended : Ending
            Why it came back.
        **attributes
            What the solver adds, by name.

        Returns
        -------
        Rearrangement
            Of the class that is asked.

        Examples
        --------
        >>> from exactcreep import Chain, Rearrangement, State
        >>> from exactcreep.watch.limits import Stop
        >>> from exactcreep.solvers.exact.solver import ExactSimulation
        >>> from exactcreep.solvers.interface import Ending
        >>> chain = Chain(2, 1000, "0.5", "0.6", tan_alpha="0.25")
        >>> moved = ExactSimulation(chain, State.relaxed(chain), 0)
        >>> Rearrangement.of(moved, "exact", Ending(Stop.DONE), events=()).outcome.value
        'at_rest'
        """
        tally = moved.tally
        return cls(
            chain=moved.chain,
            outcome=_OUTCOMES.get(ended.stop, Outcome.LIMIT),
            decided=Evidence.of(tally.undecided, Evidence.COMPUTED),
            state=moved.state(),
            velocities=moved.velocities(),
            undecided=tally.undecided,
            draws_below_mu_d=tally.draws_below_mu_d,
            solver=solver,
            seed=moved.seed,
            reason=ended.reason,
            **attributes,
        )

    @property
    def finding(self) -> str:
        """What the chain came to, and how sure that is."""
        return found_text(self.outcome, "none", "", self.evidence)

    @property
    def evidence(self) -> Evidence:
        """What the result is worth: proved, computed, or undecided where rounding may decide."""
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
        """Estimate of the largest error that rounding leaves in a tension or a displacement.

        Of `exact`, `reference` and `mpmath`; nan of others, inf where the order of events is in
        doubt. The rounding of the state's numbers to float64 comes on top.
        """
        return math.nan

    @property
    def doubt(self) -> str:
        """Why `error` breaks the promise of 1e-12, so that the evidence is `UNDECIDED`; else ""."""
        return ""

    def replay(self, arithmetic: Arithmetic | None = None) -> Replay:
        """Return a replay of the events: the closed form of the motion between them.

        Parameters
        ----------
        arithmetic : Arithmetic, optional
            The numbers to compute with; by default the solver's own.

        Returns
        -------
        Replay
            It yields the phases between events, and tells how far events are from holding.
        """
        contacts = Contacts(self.chain, self.seed)
        arithmetic = self.arithmetic if arithmetic is None else arithmetic
        return Replay(self.chain, self.initial, self.events, arithmetic, contacts)

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
        """Return where the energy is at some time(s).

        Parameters
        ----------
        t : number or array_like, shape (m,)
            Since the first event, unit tau_dyn.

        Returns
        -------
        Energy
            Kinetic, elastic, in the field of gravity and dissipated; numbers, or arrays of
            shape (m,).

        Raises
        ------
        ValueError
            If a time lies before the first event or after the last.
        """
        motion, begin = self.sol(t), self.initial.tensions.astype(float)
        moved = motion.positions.astype(float).T - self.initial.displacements.astype(float)
        kinetic = (motion.velocities.astype(float).T ** 2).sum(axis=-1) / 2
        elastic = ((begin + np.diff(moved, axis=-1)) ** 2).sum(axis=-1) / 2
        gravity = -self.chain.sin_alpha * moved.sum(axis=-1)
        return Energy(kinetic, elastic, gravity, (begin**2).sum() / 2 - kinetic - elastic - gravity)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Rearrangement):
            return NotImplemented
        alike = (getattr(self, name) == getattr(other, name) for name in _COMPARED)
        return all(alike) and same_numbers(self.velocities, other.velocities)

    def __hash__(self) -> int:
        return hash((self.solver, self.seed, self.outcome, self.state))

    def _numbers(self) -> dict[str, Any]:
        return {
            "n": self.chain.n,
            "theta": float(self.theta),
            "events": len(self.events),
            "outcome": self.outcome,
            "evidence": self.evidence,
            "duration": float(self.duration),
            "solver": self.solver,
            "reason": self.reason,
        }

    def _facts(self) -> dict[str, Any]:
        numbers = self._numbers()
        short = {"theta": f"{numbers['theta']:.9g}", "duration": f"{numbers['duration']:.6g}"}
        return numbers | {name: float(text) for name, text in short.items()}


_USUAL: dict[str, Any] = {
    "seed": 0,
    "arithmetic": FLOAT64,
    "decided": Evidence.COMPUTED,
    "reason": "",
    "motion": None,
}
_OUTCOMES = {Stop.DONE: Outcome.AT_REST, Stop.RUNAWAY: Outcome.RUNAWAY}
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


@dataclass(frozen=True, eq=False)
class Stretch:
    """What `Simulation.follow` and `advance` came to.

    Attributes
    ----------
    completed : int
        Targets reached in this call.
    recorded : mapping of str to ndarray
        ``x_G`` (completed,), and what else was asked for, at targets and in tables.
    stop, reason : Stop, str
        Why it ended; a sentence unless every target was reached.
    begun : mapping of str to ndarray
        Rows of tables since the last target that the next stretch brings again.
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


class PerturbedCopies(ABC):
    """Copies of a simulation, a few roundings off all the way."""

    @abstractmethod
    def follow(
        self, drive: Drive, first: int, stretch: Stretch, most_events: int, apart: float
    ) -> tuple[NDArray[np.float64], bool]:
        """Follow the copies beside a simulation, from target `first` of the drive on.

        `stretch` is what that came to, with its tensions and slips. The copies go no further than
        `most_events`, since their start, and the target at which one of them is more than `apart`
        off. Returns at each target that one has reached the largest distance of a tension, over the
        largest tension if that exceeds 1, inf where other sliders have slipped; and whether all
        have come to the end.
        """

    @abstractmethod
    def snapshot(self) -> dict[str, Any]:
        """Return how far the copies are, at a target, in arrays."""

    @abstractmethod
    def restore(self, snapshot: Mapping[str, Any]) -> None:
        """Go on from a snapshot, or raise `ValueError` if it is of another kind."""


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
        """Return how far the chain is, at rest, in numbers and arrays; nothing that is recorded."""

    @abstractmethod
    def restore(self, snapshot: Mapping[str, Any]) -> None:
        """Go on from a snapshot of a simulation with the same start, seed and records.

        Raises `ValueError` if it has other names, or arrays of other types and shapes.
        """

    def come_to_rest(self, limits: Limits) -> Mapping[str, NDArray[Any]]:
        """Let the rearrangement under way end, if the limits allow it; return what is logged."""
        return {}

    def copies(self) -> PerturbedCopies | None:
        """Return copies that are a few roundings off all the way; None if rounding is no matter."""
        return None

    @property
    def evidence(self) -> Evidence:
        return Evidence.of(self.tally.undecided, Evidence.COMPUTED)

    def report(self) -> dict[str, Any]:
        return {}


def require(holds: bool, otherwise: str) -> None:
    if not holds:
        raise ValueError(otherwise)


def require_like(like: Any, held: Any, name: str = "it") -> None:
    """Raise `ValueError` unless what a file holds has the names, types and shapes of `like`.

    Of `like`, an array without rows stands for any number of them, None and a list for anything.
    """
    if isinstance(like, Mapping):
        require(isinstance(held, Mapping) and like.keys() == held.keys(), f"{name} lacks a name")
        for key, value in like.items():
            require_like(value, held[key], key)
    elif isinstance(like, np.ndarray):
        fits = isinstance(held, np.ndarray) and held.dtype == like.dtype
        begin = int(len(like) == 0)
        require(fits and held.shape[begin:] == like.shape[begin:], f"{name} has another shape")
    elif like is not None and not isinstance(like, list):
        require(type(held) is type(like), f"{name} is of another kind")


@dataclass(frozen=True, eq=False)
class Start:
    """A chain, the state from which it departs, and the seed of what is drawn on the way."""

    chain: Chain
    state: State
    seed: int


class Solver(ABC):
    """An algorithm: a frozen dataclass, whose fields are its options, that it validates.

    A subclass says by `rearrange_from` and `simulation_from` what it does.
    """

    name: ClassVar[str]
    summary: ClassVar[str]
    """One line for humans."""
    needs_slips: ClassVar[bool] = True
    """Whether it refuses a chain that slides with theta, which only `sliding` follows."""
    perturbs: ClassVar[bool] = False
    """Whether its simulations know what a few roundings make of them; `Simulation.copies`."""
    on_file: ClassVar[bool] = True
    """Whether a file can hold snapshots of its simulations."""
    records: ClassVar[tuple[str, ...]] = RECORDS
    no_more: ClassVar[str] = ""
    """What its simulations can record, and why no more."""

    def rearrange(
        self, chain: Chain, state: State, direction: int, seed: int,
        limits: Limits = ONE_REARRANGEMENT,
    ) -> Rearrangement:  # fmt: skip
        """Ramp theta in `direction` (+1, -1; 0: as it stands) to theta_c, and rearrange.

        The outcome is `LIMIT` after the events of `limits`, or soon after its time is over.
        """
        return self.rearrange_from(self._start(chain, state, seed), direction, limits)

    def simulation(
        self, chain: Chain, state: State, seed: int, record: tuple[str, ...]
    ) -> Simulation:
        """Return a simulation that starts from `state`.

        A start that is not at rest is first rearranged at its own theta, by `Simulation.follow`.
        """
        for name in record:
            if name not in self.records:
                allowed = "must be one of " + ", ".join(self.records) + self.no_more
                raise InputError("record", name, allowed)
        return self.simulation_from(self._start(chain, state, seed), record)

    def _start(self, chain: Chain, state: State, seed: int) -> Start:
        if self.needs_slips and chain.slides:
            raise InputError("mu_s", chain.mu_s, _NO_SLIPS)
        return Start(chain, state, seed)

    @abstractmethod
    def rearrange_from(self, start: Start, direction: int, limits: Limits) -> Rearrangement:
        """Do what `rearrange` says."""

    @abstractmethod
    def simulation_from(self, start: Start, record: tuple[str, ...]) -> Simulation:
        """Do what `simulation` says."""

    def compiles(self, n: int) -> int:
        """Return a length of chains that need the same compiled code as one of `n` sliders."""
        return 2


def compiled(
    solver: Solver,
    chain: Chain,
    record: tuple[str, ...] = (),
    say: Callable[[], None] | None = None,
) -> None:
    """Have the code compiled, or loaded, with which a solver follows and records such a chain.

    `say` is called if the compiler works. What else a chain may need is compiled on its way.
    """
    kind = (solver.name, solver.compiles(chain.n), record)
    if kind in _COMPILED:
        return
    with preparing(), import_module("exactcreep.compiling").told(say):
        chain = replace(_TWO_SLIDERS, n=solver.compiles(chain.n))
        compared = ("tension", "slips") if solver.perturbs else ()
        names = tuple(dict.fromkeys((*record, *compared)))
        simulation = type(solver)().simulation(chain, State.relaxed(chain), 0, names)
        drive = Cycles("1/10", 1)
        stretch = simulation.follow(drive, 1, 2)
        if (copies := simulation.copies()) is not None:
            copies.follow(drive, 1, stretch, 2**62, math.inf)
        _COMPILED.add(kind)


def advance(
    simulation: Simulation,
    drive: Drive,
    until: int,
    limits: Limits = NO_LIMITS,
    *,
    done: int = 0,
    take: Callable[[Stretch], None] | None = None,
) -> Stretch:
    """Take a chain from target `done` of a drive to target `until`, and say why it ended.

    What was recorded on the way goes to `take` stretch by stretch, or else is returned whole.
    """
    reached, before = done, simulation.tally.events
    parts: list[Mapping[str, NDArray[Any]]] = [{"x_G": np.empty(0)}]
    most = max(_LONGEST_STRETCH // simulation.state().n, 1)
    last = Stretch(0, {})
    while reached < until and last.stop is Stop.DONE:
        left = limits.after(simulation.tally.events - before)
        stop = left.stop(0)
        if stop is not None:
            last = replace(last, stop=stop, reason=left.reason(stop))
            break
        last = simulation.follow(drive, reached + 1, min(most, until - reached), left)
        reached += last.completed
        if take is None:
            parts.append(last.recorded)
        else:
            take(last)
    return replace(last, completed=reached - done, recorded=joined(parts), doubts=None)
