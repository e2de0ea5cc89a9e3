"""The result of a rearrangement: its events, its outcome, and how well it is known."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from exactcreep.model.chain import Chain
from exactcreep.model.contacts import Event, Itinerary
from exactcreep.model.enclosure import same_numbers
from exactcreep.model.numbers import Scalar, refusing
from exactcreep.model.outcome import Evidence, Outcome, found_text
from exactcreep.model.result import Result
from exactcreep.model.state import State
from exactcreep.motion.arithmetic import FLOAT64, Arithmetic
from exactcreep.motion.solution import Solution
from exactcreep.watch.limits import Stop


class Ending(NamedTuple):
    """Why a simulation returned; `reason` is a sentence, unless every target was reached."""

    stop: Stop
    reason: str = ""


class Energy(NamedTuple):
    """The energies of a rearrangement; unit ``m g**2 tau_dyn**2``, numbers or arrays.

    `gravity` (the potential energy of weight and end forces) and `dissipated` count from the start.
    """

    kinetic: Any
    elastic: Any
    gravity: Any
    dissipated: Any


@dataclass(frozen=True, eq=False, repr=False, init=False)
class Rearrangement(Result):
    """One mechanical rearrangement, from unstable rest to rest.

    Some attributes are computed on demand. `==` compares everything except `report` and derived
    attributes.

    Parameters
    ----------
    **attributes
        The attributes below, by name.

    Attributes
    ----------
    chain : Chain
        The chain that was rearranged.
    initial, state : State
        At rest at theta_c, and at the end.
    events : tuple of Event
        In order of time; empty if no slider exceeds its threshold.
    outcome : Outcome
        `AT_REST`, `RUNAWAY` (proved) or `LIMIT` (given up).
    velocities : ndarray, shape (n,)
        At the end; zero at rest.
    undecided, draws_below_mu_d : int
        Comparisons within their rounding bound, settled by the model's rules; static coefficients
        drawn below `mu_d`, which act as `mu_d`.
    solver, seed : str, int
        The solver, and the seed of the coefficients drawn at stops.
    arithmetic : Arithmetic
        The numbers of the solver.
    decided : Evidence
        The evidence of the comparisons alone.
    report : mapping
        Facts that only this solver reports: precision, enclosure radii, work counts.
    reason : str
        What proves a runaway, or which limit was reached, in one sentence.

    Examples
    --------
    >>> chain = Chain(2, 1000, "0.5", "0.6", tan_alpha="0.25")
    >>> slip = rearrange(chain, State.relaxed(chain), direction=+1)
    >>> slip.itinerary, slip.outcome.value, slip.evidence.value
    ((('start', (2,), (1,)), ('stop', (2,), (1,))), 'at_rest', 'computed')
    """

    _shown_as: ClassVar[str] = "Rearrangement"
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

    def __init__(self, **attributes: Any) -> None:
        vars(self).update(_USUAL, **attributes)

    @classmethod
    @refusing
    def of(cls, moved: Any, solver: str, ended: Ending, **attributes: Any) -> Self:
        """Return the rearrangement from a solver's final state.

        Parameters
        ----------
        moved : Simulation or ChainIntegrator
            The chain as it is now, and its counts.
        solver : str
            Its name.
        ended : Ending
            Why it returned.
        **attributes
            Further attributes, by name.

        Returns
        -------
        Rearrangement
            Of this class.
        """
        tally = moved.tally
        return cls(
            chain=moved.chain,
            outcome=_OUTCOMES.get(ended.stop, Outcome.LIMIT),
            state=moved.state(),
            velocities=moved.velocities(),
            undecided=tally.undecided,
            draws_below_mu_d=tally.draws_below_mu_d,
            solver=solver,
            seed=moved.seed,
            reason=ended.reason,
            **{"decided": Evidence.of(tally.undecided, Evidence.COMPUTED)} | attributes,
        )

    @property
    def finding(self) -> str:
        """The outcome, and how sure it is, in words."""
        return found_text(self.outcome, "none", "", self.evidence)

    @property
    def evidence(self) -> Evidence:
        """Proved, computed, or undecided if rounding may have decided an event."""
        return self.decided

    @cached_property
    def sol(self) -> Solution:
        """Positions, velocities and forces at any time between the first event and the last."""
        return Solution(self.chain, self.initial, self.events, self.arithmetic)

    @property
    def error(self) -> float:
        """Estimated largest rounding error of a tension or displacement; inf: events in doubt.

        Known for `exact`, else nan. Rounding the state to float64 adds to it.
        """
        return math.nan

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
        theta: Scalar = self.initial.theta
        return theta

    def energy(self, t: ArrayLike) -> Energy:
        """Return the energies at given times.

        Parameters
        ----------
        t : number or array_like, shape (m,)
            Since the first event, unit tau_dyn.

        Returns
        -------
        Energy
            Kinetic, elastic, potential (gravity and end forces), and dissipated; numbers, or arrays
            of shape (m,).

        Raises
        ------
        ValueError
            If a time is before the first event or after the last.
        """
        motion, begin = self.sol(t), self.initial.tensions.astype(float)
        moved = motion.positions.astype(float).T - self.initial.displacements.astype(float)
        kinetic = (motion.velocities.astype(float).T ** 2).sum(axis=-1) / 2
        elastic = ((begin + np.diff(moved, axis=-1)) ** 2).sum(axis=-1) / 2
        gravity = -moved @ State.relaxed(self.chain).forces(self.chain)
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

    def _units(self) -> dict[str, str]:
        return {"duration": "tau_dyn"}

    def _facts(self) -> dict[str, Any]:
        numbers = self._numbers()
        short = {"theta": f"{numbers['theta']:.9g}", "duration": f"{numbers['duration']:.6g}"}
        return numbers | {name: float(text) for name, text in short.items()}


_USUAL: dict[str, Any] = {
    "seed": 0,
    "arithmetic": FLOAT64,
    "decided": Evidence.COMPUTED,
    "report": {},
    "reason": "",
}
_OUTCOMES = {Stop.DONE: Outcome.AT_REST, Stop.RUNAWAY: Outcome.RUNAWAY}
_COMPARED = (
    "solver", "seed", "outcome", "reason", "undecided", "draws_below_mu_d", "chain", "state",
    "events", "initial",
)  # fmt: skip
