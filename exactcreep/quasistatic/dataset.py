"""Turn a result into a labelled dataset with all its parameters, and back."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from enum import Enum
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from exactcreep import __version__
from exactcreep.model.enclosure import Enclosure, as_written, quantity
from exactcreep.model.numbers import InputError, plain_data, ratio_text
from exactcreep.model.state import State, near_theta
from exactcreep.quasistatic.experiment import Experiment, experiment_of
from exactcreep.quasistatic.netcdf import Group, netcdf, opened_dataset
from exactcreep.quasistatic.plain import text_of, value_of
from exactcreep.quasistatic.summary import Place, attribute_of, names, reader_of
from exactcreep.solvers.interface import require, require_like
from exactcreep.solvers.tables import FORCE, LENGTH, LOGS, NUMBER, TABLES, Column

if TYPE_CHECKING:
    from exactcreep.quasistatic.creep_result import Creep

FORMAT = "exactcreep result 4"
_STATE = {
    "tension": Column("float64", FORCE, "tension of the spring below each slider", ("spring",)),
    "displacement": Column("float64", LENGTH, "displacement of each slider", ("slider",)),
    "coefficient": Column("float64", NUMBER, "static coefficient of each slider", ("slider",)),
    "draws": Column("int64", NUMBER, "coefficients drawn by each slider", ("slider",)),
    "theta": Column("float64", NUMBER, "dilation"),
}
"""Parts of a state, after ``initial_`` and ``final_``."""


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
    return xr.Dataset(variables, coordinates, _attributes(result))


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
        written |= as_written(moment + name, getattr(state, f"{name}s"), digits)
    return written


def _attributes(result: Creep) -> dict[str, Any]:
    experiment, drive = result.experiment, result.drive.parameters()
    about = {
        "format": FORMAT,
        "version": __version__,
        **result.chain.parameters(),
        "drive": drive.pop("kind"),
        **{name: value for name, value in drive.items() if not isinstance(value, (list, tuple))},
        "seed": np.uint64(result.seed),
        "solver": result.solver,
        "options": experiment.options,
        "record": " ".join(experiment.record),
        "twin": int(experiment.twin),
        "accuracy": experiment.accuracy,
        "direction": result.direction,
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


def run_text(result: Creep, **changed: Any) -> str:
    """Return everything but the recorded columns as the text from which `fields_of` makes it."""
    named = {name: getattr(result, attribute_of(name)) for name in names(Place.FILE)}
    plain = {name: getattr(value, "value", value) for name, value in named.items()}
    known = {
        "experiment": result.experiment.description(),
        "state": vars(replace(result.state, theta=near_theta(result.state))),
        "velocity_enclosure": result.velocity_enclosure,
    }
    return text_of(known | plain | changed)


def content_of_file(result: Creep, **attributes: str) -> memoryview:
    """Return the file of a result: its dataset, and as `run` the text from which it is read."""
    about = {"units": "", "long_name": "the run in JSON, from which exactcreep reads it again"}
    held = result.dataset.assign(run=((), run_text(result), about))
    return netcdf({None: held.assign_attrs(attributes)})


def described_in(member: Group) -> dict[str, Any]:
    """Return the text of the run in a file as data; raise any exception if it has none."""
    written = str(member.attributes.get("format"))
    if written.startswith("exactcreep sweep"):
        told = "it is a whole sweep: read it with xarray.open_dataset; its variable file names"
        raise ValueError(f"{told} the file of each run, which can be read here")
    if not written.startswith(FORMAT.rpartition(" ")[0]):
        raise ValueError("it is not a result of exactcreep")
    if written != FORMAT:
        told = f"it is an {written[:40]!r}; this program reads {FORMAT!r}: read it with the"
        raise ValueError(f"{told} version that wrote it, or run its experiment again")
    return dict(value_of(str(member["run"])))


def is_run_of(path: str | os.PathLike[str], experiment: Experiment) -> bool:
    """Return whether a file holds a run of this experiment, or a part of it."""
    with suppress(InputError), opened_dataset(path, "result") as held:
        return text_of(described_in(held)["experiment"]) == text_of(experiment.description())
    return False


def fields_of(member: Group) -> dict[str, Any]:
    """Return the fields of the result in a file; raise any exception if it has none."""
    run = described_in(member)
    fields = {attribute_of(name): reader_of(name)(run[name]) for name in names(Place.FILE)}
    experiment, count = experiment_of(run["experiment"]), fields["half_cycles"]
    state, exact = State(**run["state"]), run["velocity_enclosure"]
    require(state.n == experiment.chain.n, "its state has another number of sliders")
    require(exact is None or isinstance(exact, Enclosure), "its velocity is no number")
    bounds = {"half_cycles": experiment.drive.target_count}
    for name, most in (bounds | dict.fromkeys(("known_until", "burn_in", "since"), count)).items():
        require((fields[name] or 0) <= most, f"{name} is larger than {most}")
    require_like(0, fields["report"]["undecided"], "undecided")
    return fields | {
        "experiment": experiment,
        "velocity_enclosure": exact,
        "state": state,
        "recorded": _recorded(member, count, experiment.chain.n),
    }


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
        missing = min(log.columns.keys() - own, default="") if own else ""
        require(not missing, f"it lacks {missing}")
        number = recorded.get(f"{log.prefix}half_cycle", np.empty(0))
        known = bool(np.all((number >= 1) & (number <= half_cycles + 1)))
        require(known, f"{log.prefix}half_cycle is no half-cycle of the run")
    return recorded
