"""An experiment: everything that determines a run, checked and frozen before it begins."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass, field, fields, replace
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np

from exactcreep.model.chain import Chain, require_dilation
from exactcreep.model.drive import Cycles, Drive, GaussianSteps, require_one_dilation
from exactcreep.model.enclosure import Enclosure
from exactcreep.model.keyed_disorder import LARGEST_DEVIATE, valid_seed
from exactcreep.model.numbers import (
    InputError,
    exact_number,
    listed,
    nearest_float,
    whole_number,
)
from exactcreep.model.remarks import THETA_BEYOND_ONE, remark, warn
from exactcreep.model.state import State, near_theta, require_finite
from exactcreep.model.targets import Listed, Targets
from exactcreep.model.uniform import EXPANSION
from exactcreep.records.temperature_record import TemperatureRecord
from exactcreep.solvers.interface import Simulation, Solver, require_slips
from exactcreep.solvers.registry import solver_named
from exactcreep.solvers.tables import RECORDS

DRIVES: dict[str, type[Drive]] = {
    kind.kind: kind for kind in (Cycles, GaussianSteps, Targets, TemperatureRecord)
}
"""Every drive class by its kind; ``DRIVES[kind](**parameters)`` makes the drive again."""
_CLASSES = tuple(kind.__name__ for kind in DRIVES.values())


def drive_of_parameters(kind: Any, parameters: Mapping[str, Any]) -> Drive:
    """Return the drive with these `parameters` from a file; no other file is read."""
    make = drive_of_kind(kind)
    if make is TemperatureRecord and not {"theta", "times", "sha256"} <= parameters.keys():
        raise InputError("drive", kind, "must hold theta, times and sha256")
    return make(**parameters)


def drive_of_kind(kind: Any) -> type[Drive]:
    """Return the class in `DRIVES`, or raise `InputError`."""
    if not isinstance(kind, str) or kind not in DRIVES:
        raise InputError("drive.kind", kind, "must be one of " + ", ".join(DRIVES))
    return DRIVES[kind]


@dataclass(frozen=True, eq=False)
class Experiment:
    """A chain, a drive, the disorder, a solver, and the quantities to record.

    Parameters
    ----------
    chain : Chain
        The chain to drive.
    drive : Drive
        Its dilations; a drive of your own class is stored as its `Targets`.
    seed, solver
        As for `exactcreep.creep`.
    options : mapping
        Options of the solver.
    start, record, burn_in, twin, accuracy
        As for `exactcreep.creep`.

    Raises
    ------
    InputError
        If a parameter is out of range, or the solver lacks an option.

    Examples
    --------
    >>> experiment = load_scene("two-sliders-cycles").experiment({"drive.cycles": 10})
    >>> experiment.chain.n, experiment.drive.target_count, experiment.solver
    (2, 20, 'exact')
    """

    chain: Chain
    drive: Drive
    _: KW_ONLY
    seed: int = 0
    solver: str = "exact"
    options: Mapping[str, Any] = field(default_factory=dict)
    start: State | None = None
    record: tuple[str, ...] = ("x_G",)
    burn_in: int | None = None
    twin: bool = False
    accuracy: float | None = None

    def __post_init__(self) -> None:
        for name, kind, allowed in (
            ("chain", Chain, "must be a Chain"),
            ("drive", Drive, f"must be a drive: one of {', '.join(_CLASSES)}"),
            ("options", Mapping, "must be a dict"),
            ("twin", (bool, np.bool_), "must be true or false"),
        ):
            if not isinstance(value := getattr(self, name), kind):
                raise InputError(name, value, allowed)
        seed, drive, options = valid_seed(self.seed), self.drive, dict(self.options)
        if type(drive) not in DRIVES.values():
            drive = Targets.of(drive, seed)
        algorithm = solver_named(self.solver, options)
        vars(self).update(
            drive=drive,
            seed=seed,
            options=options,
            start=_valid_start(self.start, self.chain, algorithm),
            record=_valid_record(self.record),
            burn_in=_valid_burn_in(self.burn_in, drive),
            twin=bool(self.twin),
            accuracy=_valid_accuracy(self.accuracy, drive),
        )
        _check_springs(self.chain, drive, self.start, algorithm)
        require_dilation(self.chain, self.widest, "drive", drive)
        if self.widest >= 1:
            warn(THETA_BEYOND_ONE)
        remark("sliders", self.chain.n)
        widest = float(np.abs(self.theta).max(initial=0.0))
        require_dilation(self.chain, widest, "start.theta", self.theta)

    @property
    def theta(self) -> Any:
        """The dilation at which the chain starts: a float, or an array of one for each spring."""
        return 0.0 if self.start is None else near_theta(self.start)

    @cached_property
    def widest(self) -> float:
        """A bound of the absolute dilation of every spring over the whole drive."""
        drive, weights = self.drive, self.chain.expansion
        most = nearest_float(max(map(abs, weights), default=Fraction(1)))
        if isinstance(drive, Cycles):
            return most * nearest_float(drive.amplitude)
        if isinstance(drive, GaussianSteps):
            return most * LARGEST_DEVIATE * nearest_float(drive.sigma_theta)
        return most * float(np.abs(drive.targets(1, drive.target_count, self.seed)).max())

    @cached_property
    def algorithm(self) -> Solver:
        """The solver, made from its name and options."""
        return solver_named(self.solver, dict(self.options))

    @cached_property
    def initial(self) -> State:
        """The state at which the run begins."""
        return State.relaxed(self.chain, self.seed) if self.start is None else self.start

    @property
    def mirrored(self) -> bool:
        """Whether the mirror image of the experiment differs from it in its draws only.

        The mean displacement over the disorder is then zero at every target.
        """
        chain, drive = self.chain, self.drive
        uniform = not chain.unlike and not drive.springs
        return self.start is None and uniform and chain.tan_alpha == 0

    @property
    def digits(self) -> int | None:
        """Significant decimal digits asked of the solver; None for float64."""
        digits = getattr(self.algorithm, "digits", None)
        return digits if isinstance(digits, int) else None

    def simulation(self, record: tuple[str, ...] = (), start: State | None = None) -> Simulation:
        """Return a simulation of the chain before the first target.

        Parameters
        ----------
        record : tuple of str
            Quantities to record: names among the `records` of the solver.
        start : State, optional
            A later state, from which the simulation goes on. Default: `initial`.

        Returns
        -------
        Simulation
            Its `follow` follows a drive.

        Raises
        ------
        InputError
            If the solver does not take the chain, or cannot record a quantity.
        """
        begin = self.initial if start is None else start
        return self.algorithm.simulation(self.chain, begin, self.seed, record)

    def burn_in_of(self, reached: int) -> int:
        """Return the burn-in of a run that reached so many targets; even for cycles.

        Parameters
        ----------
        reached : int
            Targets.

        Returns
        -------
        int
            Targets left out of the mean velocity.
        """
        if self.burn_in is not None:
            targets = self.burn_in
        elif isinstance(self.drive, Listed):  # the whole path matters, transients included
            targets = 0
        else:
            targets = min(max(2, reached // 10), reached)
        return targets + targets % 2 if self.drive.cyclic else targets

    def description(self) -> dict[str, Any]:
        """Return the experiment as plain data, by which two experiments are compared.

        Returns
        -------
        dict
            Numbers, texts, rationals and arrays.
        """
        start = self.start
        if start is not None and not self.algorithm.on_file:
            start = replace(start)  # its unrounded numbers are Python objects
        return {field.name: getattr(self, field.name) for field in fields(self)} | {
            "chain": self.chain.parameters(),
            "drive": self.drive.parameters(),
            "options": dict(self.options),
            "start": start and vars(start),
            "record": list(self.record),
        }


def experiment_of(described: Mapping[str, Any]) -> Experiment:
    """Return the experiment of a `description` in a file, or raise any exception."""
    drive, start = dict(described["drive"]), described["start"]
    if start is not None:
        parts = {name: value for name, value in start.items() if name != "unrounded"}
        if isinstance(theta := parts["theta"], Enclosure):
            parts["theta"] = theta.middle
        start = State(**parts)
    chain = Chain(**described["chain"])
    made = {"chain": chain, "drive": drive_of_parameters(drive.pop("kind"), drive), "start": start}
    return Experiment(**{**described, **made})


def _valid_start(start: Any, chain: Chain, solver: Solver) -> State | None:
    if start is None:
        return None
    if not isinstance(start, State):
        raise InputError("start", start, "must be a State, or None for the relaxed chain")
    if start.n != chain.n:
        raise InputError("start", start.n, f"must have the chain's {chain.n} sliders")
    require_finite(start)
    if start.unrounded is not None and solver.unrounded(start, chain) is None:
        return replace(start)  # without the numbers of another solver or chain
    return start


def _check_springs(chain: Chain, drive: Drive, start: State | None, solver: Solver) -> None:
    """Raise `InputError` if dilations of springs do not fit to chain, start or solver."""
    theta = 0 if start is None else start.theta
    if not drive.springs:
        if start is not None and start.springs:
            allowed = "must be one number for a drive whose targets are numbers"
            raise InputError("start.theta", start.theta.tolist(), allowed)
        return
    if drive.springs != chain.n - 1:
        allowed = f"must have a dilation for each of the chain's {chain.n - 1} springs"
        raise InputError("drive.theta", drive.springs, allowed)
    if EXPANSION not in solver.takes:
        require_one_dilation(drive, f"the solver {solver.name}")
    if solver.needs_slips:
        require_slips(chain, range(chain.n))
    if start is None or start.unrounded is None:
        drive.leg(1, theta)  # a start that is not known exactly is refused


def _valid_burn_in(burn_in: Any, drive: Drive) -> int | None:
    if burn_in is None:
        return None
    return whole_number(burn_in, "burn_in", least=0, most=drive.target_count)


def _valid_accuracy(accuracy: Any, drive: Drive) -> float | None:
    if accuracy is None:
        return None
    value = exact_number(accuracy, "accuracy")
    if not 0 < value < 1:
        raise InputError("accuracy", accuracy, "must lie between 0 and 1, e.g. 0.01")
    if isinstance(drive, Listed):
        allowed = "is of a drive that goes on as long as it takes: Cycles or GaussianSteps"
        raise InputError("accuracy", accuracy, allowed)
    return nearest_float(value)


def _valid_record(record: Any) -> tuple[str, ...]:
    several = list(record) if isinstance(record, (set, frozenset)) else listed(record)
    names = [record] if isinstance(record, str) else several
    if names is None:
        raise InputError("record", record, "must be a list of names")
    for name in names:
        if not isinstance(name, str) or name not in RECORDS:
            raise InputError("record", name, "must be among " + ", ".join(RECORDS))
    return tuple(name for name in RECORDS if name in names)
