"""Follow an experiment with a method, and find how far two trajectories agree."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.enclosure import exact_value
from exactcreep.model.numbers import InputError, nearest_float
from exactcreep.model.outcome import Evidence
from exactcreep.model.path import Path
from exactcreep.model.uniform import EXPANSION
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.solvers.interface import Simulation, Solver, Stretch, simulate
from exactcreep.solvers.registry import solver_named
from exactcreep.solvers.tables import joined
from exactcreep.studies.event_log import (
    LoggedEvent,
    LoggedRearrangement,
    first_difference,
    numbered,
    rearrangements,
)
from exactcreep.watch.limits import NO_LIMITS, Limits, Stop

MOST_EVENTS = 100_000
"""Most certified events that are compared: some minutes of the certified solver."""
_WORDS = {"dt": "dt = {}", "locate": "located", "digits": "{} digits"}


@dataclass(frozen=True, init=False)
class Method:
    """A solver with its options.

    Parameters
    ----------
    solver : str
        Name of the solver: ``exact``, ``certified``, ``verlet``, ... (see `exactcreep.solvers`).
    **options
        Options of this solver.

    Examples
    --------
    >>> Method("verlet", dt="0.01", locate=True).label
    'verlet, dt = 0.01, located'
    """

    solver: str
    options: Mapping[str, Any]

    def __init__(self, solver: str, **options: Any) -> None:
        vars(self).update(solver=solver, options=options)

    @property
    def label(self) -> str:
        """Name in tables and pictures: the solver, and the options that distinguish methods."""
        words = [form.format(self.options[k]) for k, form in _WORDS.items() if self.options.get(k)]
        return ", ".join([self.solver, *words])

    def algorithm(self) -> Solver:
        """Return the solver with these options.

        Returns
        -------
        Solver
            It makes simulations of any chain.

        Raises
        ------
        InputError
            If there is no such solver or option, or an option is out of range.
        """
        return solver_named(self.solver, dict(self.options))

    def simulation(self, experiment: Experiment, record: tuple[str, ...] = ()) -> Simulation:
        """Return a simulation by this method at the start of an experiment.

        Parameters
        ----------
        experiment : Experiment
            Provides the chain, the start and the seed.
        record : tuple of str
            Quantities to record: names among the `records` of the solver.

        Returns
        -------
        Simulation
            The chain before the first target; its `follow` follows a drive.

        Raises
        ------
        InputError
            As for `algorithm`, and if the solver does not take this chain.
        """
        algorithm, chain, start = self.algorithm(), experiment.chain, experiment.initial
        if EXPANSION not in algorithm.takes:
            experiment.drive.require_one_dilation(f"the solver {self.solver}")
        return algorithm.simulation(chain, start, experiment.seed, record)


@dataclass(frozen=True, eq=False)
class Trajectory:
    """The events of a method, and the displacements `x` at every target reached, (targets, n).

    `ended` is true if the solver proved a runaway or gave up by itself.
    """

    log: list[LoggedRearrangement]
    x: NDArray[Any]
    ended: bool
    evidence: Evidence

    @property
    def reached(self) -> int:
        """Number of targets reached."""
        return len(self.x)

    @cached_property
    def events(self) -> list[LoggedEvent]:
        """All events in order, with their places."""
        return numbered(self.log)


@dataclass(frozen=True, eq=False)
class Agreement:
    """How far a trajectory agrees with the known trajectory.

    `agreed`: events before the first different pair, `own` and `known` (None: no event; both None:
    all agree). `compared`: rests before it. `errors`: the largest difference of a displacement at
    each rest that both trajectories reached.
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


def agree(own: Trajectory, known: Trajectory) -> Agreement:
    """Return which events of two trajectories agree, and the distances of their rests.

    Events agree if their places, kinds, sliders and directions agree. An event after the point
    where a trajectory was cut short is not lacking.
    """
    agreed, mine, other = first_difference(own.events, known.events)
    for event, silent, telling in ((mine, known, own), (other, own, known)):
        if event is not None and None in (mine, other):
            last = max(telling.reached * silent.ended, silent.reached)
            if event.half_cycle > last:
                mine = other = None
    size = min(own.reached, known.reached)
    compared = min([size, *(event.half_cycle - 1 for event in (mine, other) if event is not None)])
    pairs = zip(own.x[:size], known.x[:size], strict=True)
    return Agreement(agreed, mine, other, compared, np.array([apart(*pair) for pair in pairs]))


def apart(own: Sequence[Any] | NDArray[Any], other: Sequence[Any] | NDArray[Any]) -> float:
    """Return the largest difference between two lists of numbers or balls; nan if empty."""
    pairs = zip(own, other, strict=True)
    gaps = [abs(exact_value(a) - exact_value(b)) for a, b in pairs]
    return nearest_float(max(gaps)) if gaps else math.nan


def trajectory(
    method: Method,
    experiment: Experiment,
    until: int,
    *,
    enough: float = math.inf,
    limits: Limits = NO_LIMITS,
) -> Trajectory:
    """Return the trajectory of a method along an experiment's drive up to target `until`, from 1.

    No target begins after `enough` events. The trajectory is cut short when `limits` are reached.
    """
    record = tuple(name for name in ("x", "events") if name in method.algorithm().records)
    simulation = method.simulation(experiment, record)
    parts: list[Stretch] = []
    for stretch in simulate(simulation, experiment.drive, range(1, until + 1), limits):
        parts.append(stretch)
        if simulation.tally.events >= enough:
            break
    columns = joined([part.recorded for part in parts])
    log = rearrangements(columns) if parts and "events" in record else []
    x = columns.get("x", np.empty((sum(part.completed for part in parts), 0)))
    return Trajectory(log, x, bool(parts) and parts[-1].stop.final, simulation.evidence)


def beyond(events: int) -> int:
    """Return the limit of events at which a run of about `events` events is cut short."""
    return 2 * events + 100


def drive_with_rests(experiment: Experiment, events: int) -> tuple[Path, list[int]]:
    """Return the drive with a target between any two rearrangements, as far as is needed.

    Also returns the half-cycle of each target. Raises `InputError` if no slider ever slips.
    """
    drive, seed = experiment.drive, experiment.seed
    simulation = Method("exact").simulation(experiment, ("events",))
    theta: list[Any] = []  # a number, or one for each spring
    ends: list[int] = []
    for q in range(1, drive.half_cycles + 1):
        loads: list[float] = []  # theta_c of the rearrangements of this half-cycle
        for most in (beyond(events), beyond(MOST_EVENTS)):  # the second only for the first event
            left = Limits(most).after(simulation.tally.events)
            (stretch,) = simulate(simulation, drive, [q], left, done=q - 1)
            loads += [float(each.theta) for each in rearrangements(stretch.recorded)]
            if stretch.stop is not Stop.BUDGET or theta or len(set(loads)) > 1:
                break
        between: list[Any] = [(Fraction(a) + Fraction(b)) / 2 for a, b in pairwise(loads) if a != b]
        if (leg := drive.leg(q, experiment.initial.theta)) is not None:
            between = [leg.at(part, Fraction) for part in between]
        theta += between
        ends += [q] * len(between)
        if stretch.stop is Stop.BUDGET and theta:
            break  # more events in this half-cycle might not fit in memory
        theta.append(drive.exact_target(q, seed))
        ends.append(q)
        if stretch.stop is not Stop.DONE or simulation.tally.events >= events:
            break
    if simulation.tally.events == 0:
        raise InputError("scene", "no events", "must drive the chain so far that a slider slips")
    return Path(theta), ends
