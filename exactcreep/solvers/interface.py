"""What a solver is: it makes rearrangements and simulations, which follow a drive."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from importlib import import_module
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles, Drive
from exactcreep.model.numbers import InputError
from exactcreep.model.outcome import Evidence
from exactcreep.model.state import State
from exactcreep.model.uniform import require_uniform
from exactcreep.solvers.rearrangement import Ending as Ending
from exactcreep.solvers.rearrangement import Rearrangement as Rearrangement
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
    takes: ClassVar[frozenset[str]] = frozenset()
    """In which respects sliders and springs may differ; see `Chain.unlike`."""
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
        if isinstance(state.theta, np.ndarray):
            allowed = "must be one number: theta ramps alike for all springs"
            raise InputError("state.theta", state.theta.tolist(), allowed)
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
        if not chain.unlike <= self.takes:
            require_uniform(chain.parameters(), f"the solver {self.name}", self.takes)
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
