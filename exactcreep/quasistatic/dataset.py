"""A result as a labelled dataset with all that is needed to make it again, and back."""

from __future__ import annotations

import json
from collections.abc import Mapping
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from exactcreep import __version__
from exactcreep.model.chain import Chain
from exactcreep.model.enclosure import Enclosure, as_written, enclosure, quantity
from exactcreep.model.numbers import nearest_float, plain_data, ratio_of, ratio_text
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.model.state import State
from exactcreep.quasistatic.experiment import Experiment, drive_of_kind
from exactcreep.solvers.tables import (
    FORCE,
    LENGTH,
    NUMBER,
    RECORDS,
    TABLES,
    Column,
    record_arrays,
)

if TYPE_CHECKING:
    from exactcreep.quasistatic.result import Creep

FORMAT = "exactcreep result 3"
_STATE = {
    "tension": Column("float64", FORCE, "tension of the spring below each slider", ("spring",)),
    "displacement": Column("float64", LENGTH, "displacement of each slider", ("slider",)),
    "coefficient": Column("float64", NUMBER, "static coefficient of each slider", ("slider",)),
    "draws": Column("int64", NUMBER, "coefficients drawn by each slider", ("slider",)),
    "theta": Column("float64", NUMBER, "dilation"),
}
"""What a state holds, behind ``initial_`` and ``final_``."""
_RATIOS = ("amplitude", "sigma_theta", "theta", "kappa", "T0")
"""Parameters of drives that are rationals; they may be longer than a number that a user gives."""
_DIGITS = 1000
"""So many a file may claim without showing them."""


def dataset_of(result: Creep) -> xr.Dataset:
    """Return the dataset of a result; see `Creep.dataset`."""
    return xr.Dataset(_variables(result), _coordinates(result), _attributes(result))


def heading(members: int) -> xr.Dataset:
    """Return what stands at the root of a file of several results."""
    return xr.Dataset(attrs={"format": FORMAT, "version": __version__, "members": members})


def _coordinates(result: Creep) -> dict[str, Any]:
    n = result.chain.n
    coordinates: dict[str, Any] = {"slider": np.arange(1, n + 1), "spring": np.arange(1, n)}
    if result.experiment.record:
        coordinates["half_cycle"] = np.arange(1, result.half_cycles + 1)
        dates = result.drive.dates
        if dates is not None:
            coordinates["date"] = ("half_cycle", dates[: result.half_cycles])
    return coordinates


def _variables(result: Creep) -> dict[str, Any]:
    written = dict(result.recorded)
    if result.experiment.record:
        written["theta"] = result.drive.targets(1, result.half_cycles, result.seed)
    digits = result.experiment.digits
    variables: dict[str, Any] = {}
    for table in TABLES:
        variables |= _labelled(table.columns, written, table.dimension)
    for moment, state in (("initial_", result.experiment.initial), ("final_", result.state)):
        columns = {moment + name: column for name, column in _STATE.items()}
        variables |= _labelled(columns, _written(moment, state, digits))
    for name, value in result.drive.parameters().items():
        if isinstance(value, (list, tuple)):
            texts = np.array([_text(item) for item in value], dtype=str)
            variables[f"drive_{name}"] = (f"drive_{name}_index", texts)
    return variables


def _labelled(
    columns: Mapping[str, Column], written: Mapping[str, Any], *dimension: str
) -> dict[str, Any]:
    """Return what of `written` is a quantity of `columns`, as variables of a dataset."""
    variables: dict[str, Any] = {}
    for name, values in written.items():
        column = columns.get(quantity(name))
        if column is not None:
            about = column.attributes if name in columns else {"units": column.unit}
            variables[name] = ((*dimension, *column.across), values, about)
    return variables


def _written(moment: str, state: State, digits: int | None) -> dict[str, Any]:
    """Return a state by the names it has in files."""
    written: dict[str, Any] = {
        f"{moment}draws": state.draws,
        f"{moment}theta": nearest_float(enclosure(state.theta).middle),
    }
    for name in ("tension", "displacement", "coefficient"):
        values, full = getattr(state, f"{name}s"), moment + name
        written |= as_written(full, values, digits)
        if values.dtype == object:
            middles = [ratio_text(enclosure(value).middle) for value in values.tolist()]
            written[f"{full}_exact"] = np.array(middles, dtype=str)
            if not written[f"{full}_radius"].any():
                del written[f"{full}_radius"], written[f"{full}_decimal"]
    return written


def _attributes(result: Creep) -> dict[str, Any]:
    experiment, drive = result.experiment, result.drive.parameters()
    kind, velocity = drive.pop("kind"), result.velocity_enclosure
    about = {
        "format": FORMAT,
        "version": __version__,
        **_single(result.chain.parameters()),
        "drive": kind,
        "drive_parameters": " ".join(drive),
        **_single(drive),
        "seed": np.uint64(result.seed),
        "solver": result.solver,
        "options": _json(experiment.options),
        "record": " ".join(experiment.record),
        "burn_in_asked": "default" if experiment.burn_in is None else str(experiment.burn_in),
        "twin": int(experiment.twin),
        "accuracy": experiment.accuracy,
        "start": "relaxed" if experiment.start is None else "given",
        "start_theta": ratio_text(enclosure(experiment.initial.theta).middle),
        "outcome": result.outcome.value,
        "direction": result.direction,
        "evidence": result.evidence.value,
        "reason": result.reason,
        "since": -1 if result.since is None else result.since,
        "velocity": result.velocity,
        "velocity_error": result.velocity_error,
        "velocity_exact": velocity and ratio_text(velocity.middle),
        "velocity_exact_radius": velocity and ratio_text(velocity.radius),
        "velocity_units": result.velocity_units,
        **result.counts,
        "trusted_half_cycles": result.trusted_half_cycles,
        "seconds": result.seconds,
        "warnings": _json(result.warnings),
        "report": _json(result.report),
    }
    return {name: value for name, value in about.items() if value is not None}


def _single(parameters: Mapping[str, Any]) -> dict[str, Any]:
    """Return parameters that are no lists, rationals as texts."""
    return {
        name: _text(value) if isinstance(value, Fraction) else value
        for name, value in parameters.items()
        if not isinstance(value, (list, tuple))
    }


def _text(value: Any) -> str:
    return ratio_text(value) if isinstance(value, Fraction) else str(value)


def _json(about: Mapping[str, Any]) -> str:
    return json.dumps(plain_data(about))


def fields_of(data: xr.Dataset) -> dict[str, Any]:
    """Return all of the result that `dataset_of` wrote but its counts, by the names of `Creep`.

    If the dataset shows none, it raises whatever it comes upon.
    """
    about = data.attrs
    exact = trusted = None
    if "velocity_exact" in about:
        parts = about["velocity_exact"], about["velocity_exact_radius"]
        exact = Enclosure(*map(ratio_of, parts))
    if "trusted_half_cycles" in about:
        trusted = int(about["trusted_half_cycles"])
    since = int(about.get("since", -1))
    recorded = record_arrays(dict.fromkeys(RECORDS, ()), 1)
    names = [name for name in map(str, data.data_vars) if quantity(name) in recorded]
    return {
        "experiment": _experiment(data),
        "outcome": Outcome(about["outcome"]),
        "evidence": Evidence(about["evidence"]),
        "reason": str(about["reason"]),
        "velocity": float(about["velocity"]),
        "velocity_error": float(about["velocity_error"]),
        "velocity_enclosure": exact,
        "trusted_half_cycles": trusted,
        "warnings": json.loads(about["warnings"]),
        "seconds": float(about["seconds"]),
        "state": _state(data, "final", float(data["final_theta"])),
        "recorded": {name: data[name].to_numpy() for name in names},
        "report": json.loads(about["report"]),
        "since": None if since < 0 else since,
    }


def _experiment(data: xr.Dataset) -> Experiment:
    about = data.attrs
    for name, dimension in (("n", "slider"), ("half_cycles", "half_cycle")):
        held = data.sizes.get(dimension)
        if held is not None and held != about[name]:
            raise ValueError(f"it holds {held} of {name} = {about[name]}")
    options = json.loads(about["options"])
    _check_digits(data, int(options.get("digits") or 0))
    numbers = ("l0", "mu_d", "mu_s", "sigma_mu", "tan_alpha")
    parameters: dict[str, Any] = {}
    for name in about["drive_parameters"].split():
        listed = f"drive_{name}"
        given = data[listed].to_numpy().tolist() if listed in data else about[name]
        if name in _RATIOS:
            given = [*map(ratio_of, given)] if isinstance(given, list) else ratio_of(str(given))
        parameters[name] = given
    start = None
    if about["start"] == "given":
        theta = ratio_of(about["start_theta"])
        near = nearest_float(theta)
        start = _state(data, "initial", near if Fraction(near) == theta else theta)
    return Experiment.of(
        Chain(int(about["n"]), **{name: ratio_of(str(about[name])) for name in numbers}),
        drive_of_kind(about["drive"])(**parameters),
        seed=int(about["seed"]),
        solver=str(about["solver"]),
        start=start,
        record=about["record"].split(),
        burn_in=None if about["burn_in_asked"] == "default" else about["burn_in_asked"],
        options=options,
        twin=bool(about["twin"]),
        accuracy=float(about["accuracy"]) if "accuracy" in about else None,
    )


def _check_digits(data: xr.Dataset, digits: int) -> None:
    """Raise `ValueError` if a file claims far more digits than its numbers have.

    To calculate with them would take a time that has nothing to do with the file's size.
    """
    lengths = [v.to_numpy().itemsize // 4 for v in data.values() if v.dtype.kind in "UO" and v.size]
    shown = max(lengths, default=0)
    if digits > max(_DIGITS, 10 * shown) and data.sizes.get("event", 1):
        raise ValueError(f"its numbers have at most {shown} of digits = {digits}")


def _state(data: xr.Dataset, moment: str, theta: Any) -> State:
    held: dict[str, Any] = {}
    for name in ("tension", "displacement", "coefficient"):
        full = f"{moment}_{name}"
        held[f"{name}s"] = data[full].to_numpy()
        if f"{full}_exact" in data:
            exact = np.frompyfunc(ratio_of, 1, 1)(data[f"{full}_exact"].to_numpy())
            if f"{full}_radius" in data:
                radii = data[f"{full}_radius"].to_numpy()
                exact = np.frompyfunc(lambda a, r: Enclosure(a, Fraction(r)), 2, 1)(exact, radii)
            held[f"{name}s"] = exact
    return State(**held, draws=data[f"{moment}_draws"].to_numpy(), theta=theta)
