"""Turn a result into a labelled dataset with all its parameters, and back."""

from __future__ import annotations

import json
from collections.abc import Mapping
from enum import Enum
from fractions import Fraction
from inspect import signature
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from exactcreep import __version__
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles
from exactcreep.model.enclosure import (
    Enclosure,
    as_written,
    exact_value,
    quantity,
)
from exactcreep.model.numbers import nearest_float, plain_data, ratio_of, ratio_text
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.model.state import State, near_theta
from exactcreep.quasistatic.experiment import Experiment, drive_of_kind, drive_of_parameters
from exactcreep.quasistatic.netcdf import Group
from exactcreep.quasistatic.summary import Place, attribute_of, names, reader_of
from exactcreep.solvers.interface import require, require_like
from exactcreep.solvers.tables import FORCE, LENGTH, LOGS, NUMBER, TABLES, Column

if TYPE_CHECKING:
    from exactcreep.quasistatic.creep_result import Creep

FORMAT = "exactcreep result 3"
_STATE = {
    "tension": Column("float64", FORCE, "tension of the spring below each slider", ("spring",)),
    "displacement": Column("float64", LENGTH, "displacement of each slider", ("slider",)),
    "coefficient": Column("float64", NUMBER, "static coefficient of each slider", ("slider",)),
    "draws": Column("int64", NUMBER, "coefficients drawn by each slider", ("slider",)),
    "theta": Column("float64", NUMBER, "dilation"),
}
"""Parts of a state, after ``initial_`` and ``final_``."""
_RATIOS = ("amplitude", "sigma_theta", "theta", "kappa", "T0")
"""Rational parameters of drives; they may be longer than a number that a user may type."""


def dataset_of(result: Creep) -> xr.Dataset:
    """Return the dataset of a result; see `Creep.dataset`."""
    experiment, drive, count = result.experiment, result.drive, result.half_cycles
    n, digits, written = result.chain.n, experiment.digits, dict(result.recorded)
    coordinates: dict[str, Any] = {"slider": np.arange(1, n + 1), "spring": np.arange(1, n)}
    if experiment.record:
        coordinates["half_cycle"] = np.arange(1, count + 1)
        written["theta"] = drive.targets(1, count, result.seed)
        if drive.dates is not None:
            coordinates["date"] = ("half_cycle", drive.dates[:count])
    variables: dict[str, Any] = {}
    for table in TABLES:
        variables |= _labelled(table.columns, written, table.dimension)
    for moment, state in (("initial_", experiment.initial), ("final_", result.state)):
        columns = {moment + name: column for name, column in _STATE.items()}
        variables |= _labelled(columns, _written(moment, state, digits))
    for name, value in drive.parameters().items():
        if isinstance(value, (list, tuple)):
            texts = np.array([str(attribute(item)) for item in value], dtype=str)
            variables[f"drive_{name}"] = (f"drive_{name}_index", texts)
    return xr.Dataset(variables, coordinates, _attributes(result))


def _exact(theta: Any) -> Any:
    """Return a dilation as a rational; a list of them if each spring has its own."""
    each = isinstance(theta, np.ndarray)
    return [*map(exact_value, theta.tolist())] if each else exact_value(theta)


def _labelled(
    columns: Mapping[str, Column], written: Mapping[str, Any], *dimension: str
) -> dict[str, Any]:
    variables: dict[str, Any] = {}
    for name, values in written.items():
        column = columns.get(quantity(name))
        if column is not None:
            about = column.attributes if name in columns else {"units": column.unit}
            across = column.across
            if np.ndim(values) > len(dimension) + len(across):  # a dilation of each spring
                across = ("spring",)
            variables[name] = ((*dimension, *across), values, about)
    return variables


def _written(moment: str, state: State, digits: int | None) -> dict[str, Any]:
    written: dict[str, Any] = {f"{moment}draws": state.draws, f"{moment}theta": near_theta(state)}
    for name in ("tension", "displacement", "coefficient"):
        values, full = getattr(state, f"{name}s"), moment + name
        written |= as_written(full, values, digits)
        if values.dtype == object:
            middles = [ratio_text(exact_value(value)) for value in values.tolist()]
            written[f"{full}_exact"] = np.array(middles, dtype=str)
            if not written[f"{full}_radius"].any():
                del written[f"{full}_radius"], written[f"{full}_decimal"]
    return written


def _attributes(result: Creep) -> dict[str, Any]:
    experiment, drive = result.experiment, result.drive.parameters()
    kind, velocity, burn_in = drive.pop("kind"), result.velocity_enclosure, experiment.burn_in
    about = {
        "format": FORMAT,
        "version": __version__,
        **result.chain.parameters(),
        "drive": kind,
        "drive_parameters": " ".join(drive),
        **{name: value for name, value in drive.items() if not isinstance(value, (list, tuple))},
        "seed": np.uint64(result.seed),
        "solver": result.solver,
        "options": experiment.options,
        "record": " ".join(experiment.record),
        "burn_in_asked": "default" if burn_in is None else str(burn_in),
        "twin": int(experiment.twin),
        "accuracy": experiment.accuracy,
        "start": "relaxed" if experiment.start is None else "given",
        "start_theta": _exact(experiment.initial.theta),
        "direction": result.direction,
        "velocity_exact": velocity and velocity.middle,
        "velocity_exact_radius": velocity and velocity.radius,
        "velocity_units": result.velocity_units,
        **{name: getattr(result, attribute_of(name)) for name in names(Place.FILE)},
    }
    return {name: attribute(value) for name, value in about.items() if value is not None}


def attribute(value: Any) -> Any:
    """Return a value as an attribute in a file; rationals become ratios of integers."""
    if isinstance(value, Fraction):
        return ratio_text(value)
    if isinstance(value, Mapping):
        return json.dumps(plain_data(value))
    if isinstance(value, list):  # one number for each slider or spring
        return " ".join(map(ratio_text, value))
    return value.value if isinstance(value, Enum) else value


def fields_of(member: Group) -> dict[str, Any]:
    """Return the fields of the result in a file; raise any exception if it has none."""
    about, exact = member.attributes, None
    written = str(about.get("format"))
    if written.startswith("exactcreep sweep"):
        told = "it is a whole sweep: read it with xarray.open_dataset; its variable file names"
        raise ValueError(f"{told} the file of each run, which can be read here")
    if not written.startswith(FORMAT.rpartition(" ")[0]):
        raise ValueError("it is not a result of exactcreep")
    if written != FORMAT:
        told = f"it is an {written[:40]!r}; this program reads {FORMAT!r}: read it with the"
        raise ValueError(f"{told} version that wrote it, or run its experiment again")
    if "members" in about:
        raise ValueError("it holds several members: read it with the version that wrote it")
    if "velocity_exact" in about:
        parts = about["velocity_exact"], about["velocity_exact_radius"]
        exact = Enclosure(*map(ratio_of, parts))
    fields: dict[str, Any] = {"since": None, "report": {}}
    for name in names(Place.FILE):
        if name in about:
            fields[attribute_of(name)] = reader_of(name)(about[name])
    if "known_until" not in about:  # a file of 0.4.0
        undecided, reached = int(about["undecided_from"]), fields["half_cycles"]
        fields["known_until"] = min(undecided - 1, reached) if undecided else reached
        fields["report"] = {"undecided": int(about["undecided"])} | fields["report"]
    if "outcome_evidence" not in about:  # a file of 0.4.0
        never, settled = fields["outcome"] is Outcome.RUNAWAY, fields["velocity_error"] == 0
        lasts = never or (settled and about["drive"] == Cycles.kind)
        known = Evidence.PROVED if lasts else Evidence.COMPUTED
        known = Evidence.UNDECIDED if fields["outcome"] is Outcome.LIMIT else known
        fields["outcome_evidence"] = fields["evidence"].and_then(known)
    experiment, count = _experiment(member), fields["half_cycles"]
    bounds = {"half_cycles": experiment.drive.target_count}
    for name, most in (bounds | dict.fromkeys(("known_until", "burn_in", "since"), count)).items():
        require((fields[name] or 0) <= most, f"{name} is larger than {most}")
    require_like(0, fields["report"]["undecided"], "undecided")
    return fields | {
        "experiment": experiment,
        "velocity_enclosure": exact,
        "state": _state(member, "final", _dilation(member["final_theta"])),
        "recorded": _recorded(member, count, experiment.chain.n),
    }


_LATER = {"rearrangement_end_forces"}
"""Columns that tables of 0.3.0 do not have."""


def _recorded(member: Group, half_cycles: int, n: int) -> dict[str, NDArray[Any]]:
    """Return the recorded columns; raise `ValueError` if types or shapes are wrong."""
    recorded, sizes = dict[str, NDArray[Any]](), {"half_cycle": half_cycles}
    for table in TABLES:
        for name in member:
            column = table.columns.get(quantity(name))
            if column is None or name == "theta":  # the drive knows theta
                continue
            recorded[name], like = member[name], column.array([], n)
            require_like(like if name == quantity(name) else None, recorded[name], name)
            rows = sizes.setdefault(table.dimension, len(recorded[name]))
            fits = recorded[name].shape == (rows, *like.shape[1:])
            require(fits, f"{name} has another shape")
    for log in LOGS.values():
        own = {name for name in map(quantity, recorded) if name in log.columns}
        missing = min(log.columns.keys() - own - _LATER, default="") if own else ""
        require(not missing, f"it lacks {missing}")
        number = recorded.get(f"{log.prefix}half_cycle", np.empty(0))
        known = bool(np.all((number >= 1) & (number <= half_cycles + 1)))
        require(known, f"{log.prefix}half_cycle is no half-cycle of the run")
    return recorded


def _experiment(member: Group) -> Experiment:
    about = member.attributes
    for name, dimension in (("n", "slider"), ("half_cycles", "half_cycle")):
        count = member[dimension].size if dimension in member else about[name]
        if count != about[name]:
            raise ValueError(f"it holds {count} of {name} = {about[name]}")
    # options of 0.3.0 that did not affect results, or equal today's rule
    gone = {"exact": (True, False), "escalate": (True, False), "pivot": ("mean",)}
    options = {
        name: value
        for name, value in json.loads(about["options"]).items()
        if value not in gone.get(name, ())
    }
    parameters: dict[str, Any] = {}
    # 0.3.0 had more options for reading a record
    taken = signature(drive_of_kind(about["drive"])).parameters
    for name in filter(taken.__contains__, about["drive_parameters"].split()):
        listed = f"drive_{name}"
        value = member[listed].tolist() if listed in member else about[name]
        if name in _RATIOS:
            value = [*map(_ratios, value)] if isinstance(value, list) else ratio_of(str(value))
        parameters[name] = value
    start = None
    if about["start"] == "given":
        theta = _ratios(about["start_theta"])
        each = np.array(theta, dtype=object)
        near = np.frompyfunc(nearest_float, 1, 1)(each)
        exact = bool(np.all(np.frompyfunc(Fraction, 1, 1)(near) == each))
        start = _state(member, "initial", _dilation(near if exact else each))
    return Experiment(
        _chain(about),
        drive_of_parameters(about["drive"], parameters),
        seed=int(about["seed"]),
        solver=str(about["solver"]),
        start=start,
        record=about["record"].split(),
        burn_in=None if about["burn_in_asked"] == "default" else about["burn_in_asked"],
        options=options,
        twin=bool(about["twin"]),
        accuracy=float(about["accuracy"]) if "accuracy" in about else None,
    )


def _ratios(text: str) -> Any:
    """Return the rational in a text, or a list of several."""
    found = [*map(ratio_of, str(text).split(" "))]
    return found if len(found) > 1 else found[0]


def _dilation(theta: Any) -> Any:
    """Return a dilation as a `State` holds it: a number, or an array of one for each spring."""
    array = np.asarray(theta)
    return array if array.ndim else array.item()


def _chain(about: Mapping[str, Any]) -> Chain:
    given: dict[str, Any] = {"n": int(about["n"])}
    for name in ("l0", "mu_d", "mu_s", "sigma_mu", "tan_alpha", "end_forces", "expansion"):
        if name in about:
            each = [*map(ratio_of, str(about[name]).split())]
            alone = len(each) == 1 and name != "expansion"
            given[name] = each[0] if alone else each
    return Chain(**given)


def _state(member: Group, moment: str, theta: Any) -> State:
    held: dict[str, Any] = {}
    for name in ("tension", "displacement", "coefficient"):
        full = f"{moment}_{name}"
        held[f"{name}s"] = member[full]
        if f"{full}_exact" in member:
            exact = np.frompyfunc(ratio_of, 1, 1)(member[f"{full}_exact"])
            if f"{full}_radius" in member:
                radii = member[f"{full}_radius"]
                exact = np.frompyfunc(lambda a, r: Enclosure(a, Fraction(r)), 2, 1)(exact, radii)
            held[f"{name}s"] = exact
    return State(**held, draws=member[f"{moment}_draws"], theta=theta)
