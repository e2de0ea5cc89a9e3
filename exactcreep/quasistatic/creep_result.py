"""The result of a run, `Creep`, and its files."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from importlib import import_module
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles, Drive
from exactcreep.model.enclosure import Enclosure, floats
from exactcreep.model.numbers import InputError, whole_number
from exactcreep.model.outcome import (
    Evidence,
    Outcome,
    cycles_text,
    direction_of,
    found_text,
)
from exactcreep.model.result import Result
from exactcreep.model.state import State
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.quasistatic.statistics import FEWEST_STEPS, alternates
from exactcreep.quasistatic.summary import RUN, Place, attribute_of, names
from exactcreep.quasistatic.writing import write_file
from exactcreep.solvers.interface import simulate
from exactcreep.watch.limits import Limits, Stop

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

_FORESEEN = 10**6  # cycles


@dataclass(frozen=True, eq=False, repr=False)
class Creep(Result):
    """What a chain did along a drive, and how well that is known.

    Like every result it has `plot()` and `summary()`; it equals a result with the same dataset.

    Attributes
    ----------
    experiment : Experiment
        Everything that determined the run; `chain`, `drive`, `solver` and `seed` come from it.
    outcome : Outcome
        What the chain does, or why the computation stopped; see `exactcreep.creep`.
    evidence : Evidence
        How well the trajectory is known. `PROVED`: the events in these half-cycles are proved.
        `COMPUTED`: it is known up to the last target. `UNDECIDED`: only up to `known_until`.
    known_until : int
        Number of targets up to which the trajectory is known: the events are the events of the
        true trajectory, and the tensions agree to 1e-9 of the largest force that occurred (a
        weight, an end force, a tension, or the friction on a slider that slid). Averages hold
        beyond it.
    outcome_evidence : Evidence
        How well the outcome is known, never better than `evidence`. An outcome that lasts for ever
        (the tensions have returned after whole cycles, nothing moves in a cycle, or the chain runs
        away) is `PROVED`, or in float64 `COMPUTED`. An outcome seen only in this run is at most
        `COMPUTED`. `UNDECIDED` for a limit, and if `reason` names a doubt.
    reason : str
        A sentence that explains the outcome; may be "".
    since : int or None
        Number of cycles after which `outcome` holds. From then on x_G repeats its motion, and the
        tensions return to within 2**-40 of the friction; some thousand past cycles are compared. If
        nothing repeats, `since` is the number of cycles of the burn-in. None for other drives, a
        runaway or a limit.
    velocity : float
        Mean displacement of x_G after the burn-in, or over one period if the chain has settled;
        unit ``g tau_dyn**2`` per half-cycle of Cycles, per unit of time of a TemperatureRecord, per
        target of other drives (`velocity_units`); nan if no target is left, +-inf for a runaway.
    velocity_error : float
        Standard error of `velocity` (times 1.96: an interval of 95 %), 0 if the chain has settled;
        nan if there are too few half-cycles. `velocity_reason` says why `velocity` or its error is
        nan.
    velocity_enclosure : Enclosure or None
        The velocity as an exact rational of a solver with digits; else None.
    half_cycles, burn_in, rearrangements, event_count, slip_count : int
        Targets reached, targets left out of the velocity, and numbers of rearrangements, events and
        slips.
    draws_below_mu_d : int
        Static coefficients drawn below mu_d, which act as mu_d.
    warnings : mapping of str to int
        Where the run left the model's physical range, and how often.
    seconds : float
        Wall time of the run, without compilation.
    state : State
        After the last target. If read from a file, the numbers of a solver with digits are
        rationals, or `Enclosure` where they have a radius.
    recorded : mapping of str to ndarray
        The recorded columns, as in `dataset`.
    report : mapping
        Counts of comparisons within their rounding bound (`undecided`), and facts that only this
        solver reports: precision, enclosure radii, work counts.

    Examples
    --------
    >>> result = creep(pair, Cycles("0.001", 50), record=["x_G", "rearrangements"])
    >>> result.slip_count, int(result.to_pandas("rearrangements").slips.sum())
    (796, 796)
    """

    experiment: Experiment
    outcome: Outcome
    evidence: Evidence
    known_until: int
    outcome_evidence: Evidence
    reason: str
    velocity: float
    velocity_error: float
    velocity_enclosure: Enclosure | None
    half_cycles: int
    burn_in: int
    rearrangements: int
    event_count: int
    slip_count: int
    draws_below_mu_d: int
    warnings: Mapping[str, int]
    seconds: float
    state: State
    recorded: Mapping[str, NDArray[Any]]
    report: Mapping[str, Any] = field(default_factory=dict)
    since: int | None = None

    @property
    def chain(self) -> Chain:
        """The chain of the experiment."""
        return self.experiment.chain

    @property
    def drive(self) -> Drive:
        """The drive of the experiment."""
        return self.experiment.drive

    @property
    def solver(self) -> str:
        """The name of the solver."""
        return self.experiment.solver

    @property
    def seed(self) -> int:
        """The seed of the disorder."""
        return self.experiment.seed

    @property
    def settled(self) -> bool:
        """Whether tensions have returned after whole cycles, or the chain rests for ever."""
        return self.since is not None and self.velocity_error == 0

    @property
    def finding(self) -> str:
        """The outcome, and when it holds, in words; and its evidence, unless it is undecided."""
        when = ""
        if self.settled:
            when = f"settled after {cycles_text(self.since or 0)}"
        elif self.outcome not in (Outcome.RUNAWAY, Outcome.LIMIT):
            after = self.burn_in if self.since is None else 2 * self.since
            after = after if after < self.half_cycles else 0
            named = "half-cycle" if self.drive.cyclic else "target"
            when = f"{named}s {after + 1} to {self.half_cycles}"
        return found_text(self.outcome, self.direction, when, self.outcome_evidence)

    @property
    def x_G(self) -> float:
        """Displacement of the centre of mass at the end, unit ``g tau_dyn**2``."""
        return math.fsum(floats(self.state.displacements).tolist()) / self.chain.n

    @property
    def direction(self) -> str:
        """``downhill``, ``uphill``, on the level ``+x`` or ``-x``, or ``none``; see `outcome`."""
        if self.outcome not in (Outcome.CREEPING, Outcome.RUNAWAY):
            return "none"
        moved = self.velocity
        if math.isnan(moved):  # the run was too short, but every slider has moved this way
            begin = floats(self.experiment.initial.displacements)
            moved = math.fsum((floats(self.state.displacements) - begin).tolist())
        return direction_of(moved, self.chain.tan_alpha)

    @property
    def velocity_text(self) -> str | None:
        """The velocity in the digits requested and known; None without digits."""
        known, digits = self.velocity_enclosure, self.experiment.digits
        return None if known is None or digits is None else known.text(digits)

    @property
    def velocity_radius(self) -> str:
        """The radius of `velocity_enclosure`; "" if it is zero, or there is none."""
        known = self.velocity_enclosure
        return known.radius_text() if known and known.radius else ""

    @property
    def velocity_units(self) -> str:
        """The unit of `velocity` and `velocity_error`."""
        return f"g tau_dyn^2 per {self.drive.per}"

    @property
    def velocity_reason(self) -> str:
        """Why the velocity, or only its standard error, is nan; "" if both are known."""
        cyclic, after = self.drive.cyclic, self.half_cycles - self.burn_in
        named = "half-cycles" if cyclic else "targets"
        if math.isnan(self.velocity):
            burn_in = self.experiment.burn_in_of(self.half_cycles)
            if self.half_cycles > burn_in and not cyclic:
                return "one row of a record lasts no time"
            whole = "whole cycle" if cyclic else "target"
            told = f"no {whole} was completed after the burn-in of {burn_in} {named}"
            return f"{told}; {self.half_cycles} were reached"
        if math.isinf(self.velocity):
            return "the chain runs away: a velocity without bound has no standard error"
        if not math.isnan(self.velocity_error):
            return ""
        few = f"{after} {named} after the burn-in are too few for a standard error"
        if after < (fewest := FEWEST_STEPS * (2 if cyclic else 1)):
            return f"{few}; it needs at least {fewest}"
        if not self.event_count:
            return f"nothing happened in {after} {named}: how rarely it does is not known"
        if alternates(self.chain, self.drive):
            return f"{few}: near its threshold a chain rests for as long as it creeps, or longer"
        return f"{few} beside the time over which the advance is correlated"

    @cached_property
    def metastable(self) -> str:
        """A sentence if drawn coefficients may stop this creep within 1e6 cycles, or 100 runs."""
        chain, drive = self.chain, self.drive
        creeps = self.outcome is Outcome.CREEPING and chain.sigma_mu != 0 and not chain.unlike
        if not (creeps and isinstance(drive, Cycles)):
            return ""
        cycles = import_module("exactcreep.laws.stopping").stopping_time(chain, drive.amplitude)
        if cycles >= max(_FORESEEN, 50 * self.half_cycles):
            return ""
        told = "metastable: a draw exists that stops the chain for ever; then v = 0"
        return f"{told}; survival tells for how long it creeps"

    def state_at(self, half_cycle: int) -> State:
        """Return the state at rest after a half-cycle, with the same bits as in the run.

        It is computed again from the start.

        Parameters
        ----------
        half_cycle : int
            From 0, the start, to `half_cycles`.

        Returns
        -------
        State
            At rest.

        Raises
        ------
        InputError
            If the run did not reach it.
        """
        most, experiment = self.half_cycles, self.experiment
        until = whole_number(half_cycle, "half_cycle", least=0, most=most)
        if until == 0:
            return experiment.initial
        # a run that was given up may have gone beyond its last target
        if until == most and self.outcome not in (Outcome.LIMIT, Outcome.RUNAWAY):
            return self.state
        simulation = experiment.simulation()
        limits = Limits(self.event_count + 1)  # a forged file may ask for more
        (stretch,) = simulate(simulation, experiment.drive, [until], limits)
        if stretch.stop is not Stop.DONE:
            raise InputError("half_cycle", half_cycle, f"is not reached: {stretch.reason}")
        return experiment.algorithm.state_of(simulation, experiment.chain)

    def _facts(self) -> dict[str, Any]:
        shown = map(attribute_of, names(Place.LINE))
        short = {name: getattr(self, name) for name in shown}
        for name, digits in (("velocity", 6), ("velocity_error", 2)):
            short[name] = float(f"{short[name]:.{digits}g}")
        return {"n": self.chain.n, "solver": self.solver} | short

    def _units(self) -> dict[str, str]:
        return dict.fromkeys(("velocity", "velocity_error"), self.velocity_units)

    def _numbers(self) -> dict[str, Any]:
        entries = {name: getattr(self, attribute_of(name)) for name in RUN.fields}
        entries["velocity"] = self.velocity_text or self.velocity
        unsaid = {name for name in names(Place.SAID) if not entries[name] and entries[name] != 0}
        return {name: value for name, value in entries.items() if name not in unsaid}

    def _compared(self) -> dict[str, Any]:
        run = _datasets().run_text(self, seconds=0.0)
        return {"run": run, "dataset": self.dataset.assign_attrs(seconds=0.0)}

    @cached_property
    def dataset(self) -> xr.Dataset:
        """The recorded data with labels, units and meanings, and the parameters as attributes.

        Dimensions: ``half_cycle``, ``slider`` and ``spring`` (all from 1), ``event``,
        ``rearrangement``, ``slip``. Half-cycles of a record with dates have a ``date``, in UTC if
        it has a time zone. Rationals are strings.
        """
        return _datasets().dataset_of(self)  # type: ignore[no-any-return]

    def to_pandas(self, table: str = "half_cycles") -> pd.DataFrame:
        """Return one table as a data frame.

        Parameters
        ----------
        table : {"half_cycles", "events", "rearrangements", "slip_table"}, optional
            A table that the run has recorded. Default: half_cycles. The index counts its rows,
            half-cycles from 1, others from 0:
            ``events.merge(rearrangements, left_on="rearrangement", right_index=True)``.
            Quantities of each slider have one column per slider: ``x_1``, ``x_2``, ... Units and
            meanings of columns are in ``attrs["units"]`` and ``attrs["meanings"]``.

        Returns
        -------
        DataFrame
            A row for each half-cycle, event, rearrangement or slip.

        Raises
        ------
        InputError
            If the table was not recorded.
        """
        return import_module("exactcreep.quasistatic.frames").frame(self, table)

    def save(self, path: str | os.PathLike[str], *, force: bool = False) -> None:
        """Write `dataset` and the run itself to a NetCDF file, completely or not at all.

        Parameters
        ----------
        path : path
            The file to write.
        force : bool, optional
            Whether an existing file may be replaced.

        Raises
        ------
        InputError
            If the file exists and `force` is false, or it cannot be written.
        """
        write_file(path, _datasets().content_of_file(self), "out", force=force)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Creep:
        """Return a result that `save` wrote.

        Parameters
        ----------
        path : path
            A file with one result: written by `save`, or a cell of a sweep.

        Returns
        -------
        Creep
            Equal to the saved result.

        Raises
        ------
        InputError
            If the file holds no result.
        """
        with import_module("exactcreep.quasistatic.netcdf").opened_dataset(path, "result") as held:
            return cls(**_datasets().fields_of(held))


def _datasets() -> Any:
    """Return the module that labels results; it is imported late because of xarray."""
    return import_module("exactcreep.quasistatic.dataset")
