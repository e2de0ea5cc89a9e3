"""What a run came to: `Creep`, its labelled dataset, and the NetCDF file that keeps it."""

from __future__ import annotations

import json
import math
import os
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from importlib import import_module
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exactcreep import __version__
from exactcreep.limits import Stop
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Drive
from exactcreep.model.numbers import (
    InputError,
    nearest_float,
    plain_data,
    ratio_of,
    ratio_text,
    whole_number,
)
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.model.representation import Shown, drawn
from exactcreep.model.state import State
from exactcreep.quasistatic.decimals import Enclosure, as_written, enclosure, floats, quantity
from exactcreep.quasistatic.experiment import Experiment, drive_of_kind
from exactcreep.quasistatic.files import write_file
from exactcreep.solvers.solver import advance
from exactcreep.solvers.statistics import FEWEST_STEPS
from exactcreep.solvers.tables import (
    FORCE,
    LENGTH,
    NUMBER,
    RECORDS,
    TABLES,
    Column,
    Schema,
    lists_columns,
    record_arrays,
)

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

FORMAT = "exactcreep result 3"


class _StateRow(NamedTuple):
    """What a state holds."""

    tension: Annotated[
        Any, Column("float64", FORCE, "tension of the spring below each slider", ("spring",))
    ]
    displacement: Annotated[
        Any, Column("float64", LENGTH, "displacement of each slider", ("slider",))
    ]
    coefficient: Annotated[
        Any, Column("float64", NUMBER, "static coefficient of each slider", ("slider",))
    ]
    draws: Annotated[
        Any, Column("int64", NUMBER, "coefficients drawn by each slider", ("slider",))
    ]
    theta: Annotated[Any, Column("float64", NUMBER, "dilation")]


_INITIAL, _FINAL = (Schema("", _StateRow, prefix) for prefix in ("initial_", "final_"))
_COUNTS = {
    "half_cycles": "half_cycles",
    "burn_in": "burn_in",
    "rearrangements": "rearrangements",
    "events": "event_count",
    "slips": "slip_count",
    "draws_below_mu_d": "draws_below_mu_d",
    "undecided": "undecided",
    "long_rearrangements": "long_rearrangements",
    "undecided_from": "undecided_from",
}
"""Attributes of `Creep` by their names in files."""
_RENAMED = "Creep.{} is a count, as its name shall say: use Creep.{}"


@dataclass(frozen=True, eq=False, repr=False)
class Creep(Shown):
    """What a chain did along a drive, and how well that is known.

    Attributes
    ----------
    experiment : Experiment
        Everything that determined the run.
    outcome : Outcome
        What the chain does, or why the computation stopped; see `exactcreep.creep`.
    evidence : Evidence
    reason : str
        For a limit, a runaway, a drift too small to be seen, or a displacement that was only a
        transient: one sentence.
    since : int or None
        The cycle from which on the chain does what `outcome` says, up to the end of the run: x_G
        repeats its motion from there, and the tensions repeat, to within 2**-40 of the friction, as
        far back as they are known (`exact`: followed again for up to 1e7 events; `certified`,
        `mpmath`, `reference`: the last 1000 cycles; others: 64). The burn-in, where it does not
        repeat and `outcome` speaks of the mean after it. None for other drives, a runaway or a
        limit.
    velocity : float
        Mean displacement of x_G after the burn-in, or in its cycle if the chain has settled; unit
        ``g tau_dyn**2`` per half-cycle of Cycles, per unit of time of a TemperatureRecord, per
        target of other drives (`velocity_units`); nan if none is left, +-inf for a runaway.
    velocity_error : float
        Its standard error, 1.96 of which make an interval of 95 %, 0 if the chain has settled; nan
        if there are too few half-cycles to tell, also beside the time over which the advance is
        correlated. `velocity_reason` says why one of them is nan.
    velocity_enclosure : Enclosure or None
        The velocity as the rational that the solver's digits make it; None if it has none.
    half_cycles : int
        Targets reached.
    burn_in : int
        Targets left out of the velocity.
    rearrangements, event_count, slip_count : int
    draws_below_mu_d : int
        Static coefficients drawn below `mu_d`, which act as `mu_d`.
    undecided : int
        Comparisons inside their rounding bound, settled by the model's rules.
    long_rearrangements : int
        Of the solver `exact`: rearrangements of more than 200 events, whose tensions rounding may
        have taken further than 1e-12 from the truth.
    undecided_from : int
        The first target from which on the run may be undecided: a comparison was, an avalanche was
        too long, or a twin whose start is a few roundings off has parted by more than 1e-12; 0 if
        there is none (only the outcome may be undecided then, and `reason` says why). It is looked
        for at every target at first, then at a sixteenth of those reached.
    trusted_half_cycles : int or None
        Up to which target the events are those of a twin that starts a few roundings off, and the
        tensions agree to 1e-9, at the least; None if that was not followed so far.
    warnings : mapping of str to int
        Where the run left the model's physical range, and how often.
    seconds : float
        Wall time of the run, without compilation.
    state : State
        At the end. Of a result from a file, the numbers of a solver with digits are rationals,
        or `Enclosure` where they have a radius.
    recorded : mapping of str to ndarray
        What was recorded, as in `dataset`.
    report : mapping
        What only this solver knows: precision, enclosure radii, work counts.
    saved : mapping of int to mapping
        How far the simulation was, by targets reached: from there `state_at` begins. A result
        from a file has none.

    Examples
    --------
    >>> from exactcreep import Chain, Cycles, creep
    >>> chain = Chain(2, 1000, "0.5", "0.6", tan_alpha="0.25")
    >>> result = creep(chain, Cycles("0.001", 50), record=["x_G", "rearrangements"])
    >>> int(result.to_pandas("rearrangements").slips.sum()) == result.slip_count
    True
    >>> result.state_at(10).theta, round(result.x_G - float(result.dataset.x_G[-1]), 12)
    (-0.001, 0.0)
    """

    experiment: Experiment
    outcome: Outcome
    evidence: Evidence
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
    undecided: int
    long_rearrangements: int
    undecided_from: int
    trusted_half_cycles: int | None
    warnings: Mapping[str, int]
    seconds: float
    state: State
    recorded: Mapping[str, NDArray[Any]]
    report: Mapping[str, Any] = field(default_factory=dict)
    since: int | None = None
    saved: Mapping[int, Mapping[str, Any]] = field(default_factory=dict)

    @property
    def chain(self) -> Chain:
        """The chain."""
        return self.experiment.chain

    @property
    def drive(self) -> Drive:
        """The drive."""
        return self.experiment.drive

    @property
    def solver(self) -> str:
        """The solver's name."""
        return self.experiment.solver

    @property
    def seed(self) -> int:
        """The seed of the disorder."""
        return self.experiment.seed

    @property
    def x_G(self) -> float:
        """Displacement of the centre of mass at the end, unit ``g tau_dyn**2``."""
        return math.fsum(floats(self.state.displacements).tolist()) / self.chain.n

    @property
    def velocity_text(self) -> str | None:
        """The velocity in the digits that were asked for and are known; None without digits."""
        digits = self.experiment.digits
        if self.velocity_enclosure is None or digits is None:
            return None
        return self.velocity_enclosure.text(digits)

    @property
    def velocity_units(self) -> str:
        """The unit of `velocity` and `velocity_error`."""
        return f"g tau_dyn^2 per {self.drive.per}"

    @property
    def velocity_reason(self) -> str:
        """Why the velocity, or only its standard error, is nan; "" where both are known."""
        named = "half-cycles" if self.drive.cyclic else "targets"
        if math.isnan(self.velocity):
            whole = "whole cycle" if self.drive.cyclic else "target"
            burn_in = self.experiment.burn_in_of(self.half_cycles)
            if self.half_cycles > burn_in and not self.drive.cyclic:
                return "one row of a record lasts no time"
            return (
                f"no {whole} was completed after the burn-in of {burn_in} {named};"
                f" {self.half_cycles} were reached"
            )
        if math.isinf(self.velocity):
            return "the chain runs away: a velocity without bound has no standard error"
        if math.isnan(self.velocity_error):
            after = self.half_cycles - self.burn_in
            if after < FEWEST_STEPS * (2 if self.drive.cyclic else 1):
                return f"{after} {named} after the burn-in are too few for a standard error"
            if not self.event_count:
                return f"nothing happened in {after} {named}: how rarely it does is not known"
            return (
                f"{after} {named} after the burn-in are too few for a standard error beside the"
                " time over which the advance is correlated"
            )
        return ""

    @property
    def followed(self) -> int | None:
        """Up to which target the course is followed, if it is undecided beyond; else None."""
        if not self.undecided_from:
            return None
        before = self.undecided_from - 1
        by_rules = self.undecided or self.long_rearrangements
        return before if by_rules else max(before, self.trusted_half_cycles or 0)

    @property
    def course(self) -> str:
        """One sentence: what outcome and velocity are worth, and how far the course is known.

        "" where there is nothing to say but the evidence.
        """
        return known_of([self])

    @property
    def counts(self) -> dict[str, int]:
        """The counts by the names that they have in files."""
        return {name: getattr(self, held) for name, held in _COUNTS.items()}

    @property
    def events(self) -> int:
        """`event_count`, by the name that it had."""
        warnings.warn(_RENAMED.format("events", "event_count"), DeprecationWarning, stacklevel=2)
        return self.event_count

    @property
    def slips(self) -> int:
        """`slip_count`, by the name that it had."""
        warnings.warn(_RENAMED.format("slips", "slip_count"), DeprecationWarning, stacklevel=2)
        return self.slip_count

    def state_at(self, half_cycle: int) -> State:
        """Return the state at rest in which the run was after a half-cycle.

        It is computed again from the nearest state before that was saved on the way.

        Parameters
        ----------
        half_cycle : int
            From 0, the start as it was given, to `half_cycles`.

        Raises
        ------
        InputError
            If the run did not reach it.

        Notes
        -----
        Guarantee: the state is that of the run, bit for bit.
        """
        most, experiment = self.half_cycles, self.experiment
        until = whole_number(half_cycle, "half_cycle", least=0, most=most)
        if until == 0:
            return experiment.initial
        # the run may have gone on from the last targets before it was given up
        if until == most and self.outcome not in (Outcome.LIMIT, Outcome.RUNAWAY):
            return self.state
        simulation = experiment.algorithm.simulation(
            experiment.chain, experiment.initial, experiment.seed, ()
        )
        done = max((target for target in self.saved if target < until), default=0)
        if done:
            simulation.restore(self.saved[done])
        stretch = advance(simulation, experiment.drive, until, done=done)
        if stretch.stop is not Stop.DONE:
            raise InputError("half_cycle", half_cycle, f"is not reached: {stretch.reason}")
        return simulation.state()

    def _facts(self) -> dict[str, Any]:
        return {
            "n": self.chain.n,
            "solver": self.solver,
            "outcome": self.outcome,
            "evidence": self.evidence,
            "velocity": float(f"{self.velocity:.6g}"),
            "velocity_error": float(f"{self.velocity_error:.2g}"),
            "velocity_units": self.velocity_units,
            "half_cycles": self.half_cycles,
            "event_count": self.event_count,
            "reason": self.reason,
        }

    def _picture(self) -> str:
        course = self.recorded.get("x_G")
        if course is None or not len(course):
            return drawn(floats(self.state.displacements))
        return drawn(course)

    def summary(self) -> dict[str, Any]:
        """Return the numbers by name, ready for JSON: a number that is not finite is None."""
        out: dict[str, Any] = {
            "velocity": self.velocity_text or self.velocity,
            "velocity_error": self.velocity_error,
            "velocity_units": self.velocity_units,
            "outcome": self.outcome.value,
            "evidence": self.evidence.value,
            "since": self.since,
            "solver": self.solver,
        }
        out |= self.counts
        if self.trusted_half_cycles is not None:
            out["trusted_half_cycles"] = self.trusted_half_cycles
        if self.course:
            out["course"] = self.course
        out |= {"x_G": self.x_G, "seconds": self.seconds, "seed": self.seed}
        if self.velocity_enclosure is not None and self.velocity_enclosure.radius:
            out["velocity_radius"] = self.velocity_enclosure.radius_text()
        if self.reason:
            out["reason"] = self.reason
        if self.velocity_reason:
            out["velocity_reason"] = self.velocity_reason
        if self.warnings:
            out["warnings"] = self.warnings
        if self.report:
            out["report"] = self.report
        return plain_data(out)

    @cached_property
    @lists_columns(*TABLES)
    def dataset(self) -> xr.Dataset:
        """What was recorded, labelled, with all that is needed to make it again.

        Dimensions: ``half_cycle`` (from 1), ``slider`` (1 .. n), ``spring`` (1 .. n - 1),
        ``event``, ``rearrangement`` and ``slip``; half-cycles of a record with dates have a
        ``date`` (UTC, if it names a time zone). Parameters stand in the attributes, rationals as
        strings.
        """
        return _dataset(self._variables(), self._coordinates(), self._attributes())

    @property
    def plot(self) -> Any:
        """Pictures of the run, as xarray and pandas have them.

        ``plot(ax=None)`` draws x_G over time and returns the axes; ``plot.avalanches("size")``
        draws how the size of its avalanches is distributed (or their ``"duration"``, ``"energy"``,
        ``"extent"``). Without axes they are drawn in a new figure of pyplot.
        """
        # by name, as pandas loads its backend: what draws stands on a floor below
        return import_module("exactcreep.figures.run_plots").Plots(self)

    @property
    def tree(self) -> xr.DataTree:
        """The `dataset` as an xarray DataTree with one group for each table.

        The groups are called as in `to_pandas`, and their columns by their own names
        (``tree["events"].to_dataset().to_dataframe()``); a group ``states`` holds the first and the
        last state, the root the parameters.
        """
        made: xr.DataTree = _frames().tree(self)
        return made

    def to_pandas(self, table: str) -> pd.DataFrame:
        """Return one table as a data frame; whole numbers have 32 bits if they fit.

        Parameters
        ----------
        table : {"half_cycles", "events", "rearrangements", "slip_table"}
            The index counts what a row is: half-cycles from 1, events, rearrangements and slips
            from 0, so that ``events.merge(rearrangements, left_on="rearrangement",
            right_index=True, suffixes=("", "_all"))`` sets each event beside its rearrangement.
            What has a number for each slider is one column for each, ``x_1``, ``x_2``, ...
            ``attrs["units"]`` and ``attrs["meanings"]`` tell of every column.

        Raises
        ------
        InputError
            If there is no such table, or the run did not record it.
        """
        made: pd.DataFrame = _frames().frame(self, table)
        return made

    def export(self, table: str, path: str | os.PathLike[str], *, force: bool = False) -> int:
        """Write one table to a file and return how many rows it has.

        Parameters
        ----------
        table : str
            See `to_pandas`.
        path : path
            Ends in ``.csv``, with units behind the names of the columns, or in ``.parquet``, for
            which pyarrow is needed (the extra ``export``).
        force : bool
            Whether a file that exists is replaced.

        Raises
        ------
        InputError
            If the table was not recorded, or the file cannot be written.
        """
        rows: int = _frames().export(self, table, path, force=force)
        return rows

    def _coordinates(self) -> dict[str, Any]:
        n = self.chain.n
        coordinates: dict[str, Any] = {"slider": np.arange(1, n + 1), "spring": np.arange(1, n)}
        if self.experiment.record:
            coordinates["half_cycle"] = np.arange(1, self.half_cycles + 1)
            dates = self.drive.dates
            if dates is not None:
                coordinates["date"] = ("half_cycle", dates[: self.half_cycles])
        return coordinates

    def _variables(self) -> dict[str, Any]:
        written = dict(self.recorded)
        if self.experiment.record:
            written["theta"] = self.drive.targets(1, self.half_cycles, self.seed)
        variables: dict[str, Any] = {}
        for table in TABLES:
            variables |= _labelled(table, written)
        variables |= _labelled(_INITIAL, self._written("initial", self.experiment.initial))
        variables |= _labelled(_FINAL, self._written("final", self.state))
        for name, value in self.drive.parameters().items():
            if isinstance(value, (list, tuple)):
                texts = np.array([_text(item) for item in value], dtype=str)
                variables[f"drive_{name}"] = (f"drive_{name}_index", texts)
        return variables

    def _written(self, moment: str, state: State) -> dict[str, Any]:
        """Return a state by the names it has in files."""
        written: dict[str, Any] = {
            f"{moment}_draws": state.draws,
            f"{moment}_theta": nearest_float(enclosure(state.theta).middle),
        }
        for name in ("tension", "displacement", "coefficient"):
            values = getattr(state, f"{name}s")
            parts = as_written(f"{moment}_{name}", values, self.experiment.digits)
            if values.dtype == object:
                middles = [ratio_text(enclosure(value).middle) for value in values.tolist()]
                parts[f"{moment}_{name}_exact"] = np.array(middles, dtype=str)
                if not parts[f"{moment}_{name}_radius"].any():
                    del parts[f"{moment}_{name}_radius"], parts[f"{moment}_{name}_decimal"]
            written |= parts
        return written

    def _attributes(self) -> dict[str, Any]:
        about: dict[str, Any] = {"format": FORMAT, "version": __version__}
        about |= _attribute_values(self.chain.parameters())
        drive = self.drive.parameters()
        about["drive"] = drive.pop("kind")
        about["drive_parameters"] = " ".join(drive)
        about |= _attribute_values(drive)
        about["seed"] = np.uint64(self.seed)
        about["solver"] = self.solver
        about["options"] = _json(self.experiment.options)
        about["record"] = " ".join(self.experiment.record)
        asked = self.experiment.burn_in
        about["burn_in_asked"] = "default" if asked is None else str(asked)
        about["twin"] = int(self.experiment.twin)
        about["start"] = "relaxed" if self.experiment.start is None else "given"
        theta = self.experiment.initial.theta
        about["start_theta"] = ratio_text(enclosure(theta).middle)
        about["outcome"] = self.outcome.value
        about["evidence"] = self.evidence.value
        about["reason"] = self.reason
        about["since"] = -1 if self.since is None else self.since
        about["velocity"] = self.velocity
        about["velocity_error"] = self.velocity_error
        if self.velocity_enclosure is not None:
            about["velocity_exact"] = ratio_text(self.velocity_enclosure.middle)
            about["velocity_exact_radius"] = ratio_text(self.velocity_enclosure.radius)
        about["velocity_units"] = self.velocity_units
        about |= self.counts
        if self.trusted_half_cycles is not None:
            about["trusted_half_cycles"] = self.trusted_half_cycles
        about["seconds"] = self.seconds
        about["warnings"] = _json(self.warnings)
        about["report"] = _json(self.report)
        return about

    def save(self, path: str | os.PathLike[str], *, force: bool = False) -> None:
        """Write `dataset` to a NetCDF file, in one piece or not at all.

        Raises
        ------
        InputError
            If the file exists and `force` is not given, or it cannot be written.

        Examples
        --------
        >>> from exactcreep import Chain, Cycles, creep
        >>> result = creep(Chain(2, 1000, "0.5", "0.6", tan_alpha="0.25"), Cycles("0.001", 5))
        >>> result.save("run.nc")
        >>> Creep.load("run.nc").state == result.state
        True
        """
        save_members([self], path, force=force)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Creep:
        """Return the result that `save` wrote.

        Raises
        ------
        InputError
            If the file is none, or holds several members (see `load_members`).
        """
        members = load_members(path)
        if len(members) != 1:
            name = os.fspath(path)
            raise InputError("result", name, f"holds {len(members)} members; use load_members")
        return members[0]

    @classmethod
    def from_dataset(cls, data: xr.Dataset) -> Creep:
        """Return the result that `dataset` shows."""
        about = data.attrs
        experiment = _experiment(data)
        kept = record_arrays(dict.fromkeys(RECORDS, ()), 1)
        names = [name for name in map(str, data.data_vars) if quantity(name) in kept]
        exact = None
        if "velocity_exact" in about:
            exact = Enclosure(
                ratio_of(about["velocity_exact"]), ratio_of(about["velocity_exact_radius"])
            )
        counts: dict[str, Any] = {held: int(about[name]) for name, held in _COUNTS.items()}
        return cls(
            experiment=experiment,
            outcome=Outcome(about["outcome"]),
            evidence=Evidence(about["evidence"]),
            reason=str(about["reason"]),
            velocity=float(about["velocity"]),
            velocity_error=float(about["velocity_error"]),
            velocity_enclosure=exact,
            **counts,
            trusted_half_cycles=_whole_or_none(about.get("trusted_half_cycles")),
            warnings=json.loads(about["warnings"]),
            seconds=float(about["seconds"]),
            state=_state(data, "final", float(data["final_theta"])),
            recorded={name: data[name].to_numpy() for name in names},
            report=json.loads(about["report"]),
            since=int(about["since"]) if about.get("since", -1) >= 0 else None,
        )


def course_of(results: Sequence[Creep]) -> str:
    """Return one sentence: how far courses are known; "" where nothing was looked at.

    The course of a run is what happens when: x_G at every target, and all events.
    """
    lost = [one for one in results if one.followed is not None]
    many = len(results) > 1
    targets = "half-cycle" if all(one.drive.cyclic for one in results) else "target"
    if not lost:
        twins = [one for one in results if one.trusted_half_cycles == one.half_cycles > 0]
        if not results or len(twins) < len(results):
            return ""
        least = min(one.half_cycles for one in twins)
        whole = all(one.half_cycles == one.drive.half_cycles for one in twins)
        far = "to the end" if whole else f"for the first {least} {targets}s"
        return f"a twin that starts a few roundings off takes the same course {far}"
    ends = sorted({one.followed or 0 for one in lost})
    to = f"{targets} {ends[0]}" + (f" to {ends[-1]}" if len(ends) > 1 else "")
    of = f" of {len(lost)} runs" if many and len(lost) < len(results) else ""
    rules = any(one.undecided or one.long_rearrangements for one in lost)
    decides = "rounding or a rule" if rules else "rounding"
    return (
        f"the course{'s' * many} (x_G(t), events){of} {'are' if many else 'is'} followed"
        f" to {to} and undecided beyond, where {decides} picks one of many"
    )


def known_of(results: Sequence[Creep]) -> str:
    """Return one sentence: what outcome and velocity are worth, and how far courses are known.

    "" where there is nothing to say but the evidence.
    """
    course = course_of(results)
    lost = [one for one in results if one.followed is not None]
    if not lost:
        return course
    unknown = sum(math.isnan(one.velocity_error) for one in lost)
    if all(one.velocity_error == 0 for one in lost):
        worth = "outcome and velocity are what the course ended in"
    elif len(results) > 1:
        worth = "outcomes and velocities are statistics, the latter "
        worth += "of unknown errors" if unknown == len(lost) else "with their standard errors"
        worth += f" (of {unknown} not known)" * (0 < unknown < len(lost))
    else:
        worth = "outcome and velocity are statistics, the latter " + (
            "of unknown error" if unknown else "to within its standard error"
        )
    return f"{worth}; {course}"


def _whole_or_none(value: Any) -> int | None:
    return None if value is None else int(value)


def _labelled(table: Schema[Any], written: Mapping[str, Any]) -> dict[str, Any]:
    """Return the variables of a dataset: what of `written` is a quantity of `table`."""
    variables: dict[str, Any] = {}
    for name, values in written.items():
        column = table.columns.get(quantity(name))
        if column is not None:
            about = column.attributes if name in table.columns else {"units": column.unit}
            dimensions = (table.dimension, *column.across) if table.dimension else column.across
            variables[name] = (dimensions, values, about)
    return variables


_RATIOS = ("amplitude", "sigma_theta", "theta", "kappa", "T0")
"""Parameters of drives that are rationals."""


def _text(value: Any) -> str:
    return ratio_text(value) if isinstance(value, Fraction) else str(value)


def _json(about: Mapping[str, Any]) -> str:
    return json.dumps(plain_data(about))


def _attribute_values(parameters: Mapping[str, Any]) -> dict[str, Any]:
    return {
        name: _text(value) if isinstance(value, Fraction) else value
        for name, value in parameters.items()
        if not isinstance(value, (list, tuple))
    }


def _experiment(data: xr.Dataset) -> Experiment:
    about = data.attrs
    for name, dimension in (("n", "slider"), ("half_cycles", "half_cycle")):
        held = data.sizes.get(dimension)
        if held is not None and held != about[name]:
            raise ValueError(f"it holds {held} of {name} = {about[name]}")
    chain = Chain(
        int(about["n"]),
        *(ratio_of(str(about[name])) for name in ("l0", "mu_d", "mu_s", "sigma_mu")),
        tan_alpha=ratio_of(str(about["tan_alpha"])),
    )
    options = json.loads(about["options"])
    _check_digits(data, int(options.get("digits") or 0))
    parameters: dict[str, Any] = {}
    for name in about["drive_parameters"].split():
        listed = f"drive_{name}"
        given = data[listed].to_numpy().tolist() if listed in data else about[name]
        if name in _RATIOS:  # they may be longer than a number that a user gives
            given = [*map(ratio_of, given)] if isinstance(given, list) else ratio_of(str(given))
        parameters[name] = given
    start = None
    if about["start"] == "given":
        theta = ratio_of(about["start_theta"])
        near = nearest_float(theta)
        start = _state(data, "initial", near if Fraction(near) == theta else theta)
    return Experiment.of(
        chain,
        drive_of_kind(about["drive"])(**parameters),
        seed=int(about["seed"]),
        solver=str(about["solver"]),
        start=start,
        record=about["record"].split(),
        burn_in=None if about["burn_in_asked"] == "default" else about["burn_in_asked"],
        options=options,
        twin=bool(about["twin"]),
    )


_DIGITS = 1000
"""So many a file may claim without showing them."""


def _check_digits(data: xr.Dataset, digits: int) -> None:
    """Raise `ValueError` if a file claims far more digits than its numbers have.

    To calculate with them would take a time that has nothing to do with the file's size.
    """
    lengths = [v.to_numpy().itemsize // 4 for v in data.values() if v.dtype.kind in "UO" and v.size]
    shown = max(lengths, default=0)
    if digits > max(_DIGITS, 10 * shown) and data.sizes.get("event", 1):
        raise ValueError(f"its numbers have at most {shown} of digits = {digits}")


def _state(data: xr.Dataset, moment: str, theta: Any) -> State:
    def values(name: str) -> NDArray[Any]:
        exact = f"{moment}_{name}_exact"
        if exact not in data:
            return data[f"{moment}_{name}"].to_numpy()
        rationals = np.empty(data[exact].size, dtype=object)
        rationals[:] = [ratio_of(text) for text in data[exact].to_numpy().tolist()]
        if f"{moment}_{name}_radius" in data:
            radii = data[f"{moment}_{name}_radius"].to_numpy().tolist()
            for k, radius in enumerate(radii):
                rationals[k] = Enclosure(rationals[k], Fraction(radius))
        return rationals

    return State(
        tensions=values("tension"),
        displacements=values("displacement"),
        coefficients=values("coefficient"),
        draws=values("draws"),
        theta=theta,
    )


def _files() -> Any:
    """Return the module that writes and reads NetCDF; a run without a file waits for none."""
    return import_module("exactcreep.quasistatic.netcdf")


def _frames() -> Any:
    """Return the module that makes tables for other programs; it waits for pandas."""
    return import_module("exactcreep.quasistatic.export")


def _dataset(*given: Any, **named: Any) -> xr.Dataset:
    """Return ``xarray.Dataset(...)``; a run that makes none does not wait for xarray."""
    xarray: Any = import_module("xarray")
    made: xr.Dataset = xarray.Dataset(*given, **named)
    return made


def save_members(
    results: Sequence[Creep], path: str | os.PathLike[str], *, force: bool = False
) -> None:
    """Write results to one NetCDF file: a single one at its root, several as groups 1, 2, ...

    Raises
    ------
    InputError
        If the file exists and `force` is not given, or it cannot be written.
    """
    groups: dict[str | None, xr.Dataset] = {None: results[0].dataset}
    if len(results) != 1:
        about = {"format": FORMAT, "version": __version__, "members": len(results)}
        groups = {None: _dataset(attrs=about)}
        groups |= {f"member_{k}": result.dataset for k, result in enumerate(results, 1)}
    write_file(path, _files().netcdf(groups), "out", force=force)


def load_members(path: str | os.PathLike[str]) -> list[Creep]:
    """Return the results that `save_members` or `Creep.save` wrote.

    Raises
    ------
    InputError
        If the file is none of theirs.
    """
    return [result for _, result in read_members(path)]


def read_members(path: str | os.PathLike[str]) -> list[tuple[xr.Dataset, Creep]]:
    """Return the datasets in a file, and the results that they show; see `load_members`."""
    groups = _files().read_groups(path, "result")
    about = groups[None].attrs
    try:
        written = str(about.get("format"))
        if written != FORMAT:
            told = "is not a result of exactcreep"
            if written.startswith(FORMAT.rpartition(" ")[0]):
                told = f"is an {written[:40]!r}; this program reads {FORMAT!r}"
                told += ": read it with the version that wrote it, or run its experiment again"
            raise InputError("result", os.fspath(path), told)
        if "members" in about:
            members = [groups[f"member_{k}"] for k in range(1, len(groups))]
            if len(members) != about["members"]:
                raise ValueError(f"it holds {len(members)} of {about['members']} members")
        else:
            members = [groups[None]]
        return [(data, Creep.from_dataset(data)) for data in members]
    except InputError:
        raise
    except Exception as error:  # nor what can be wrong with numbers that were changed
        reason = " ".join(str(error).split())[:200]
        raise InputError("result", os.fspath(path), f"cannot be read: {reason}") from None
