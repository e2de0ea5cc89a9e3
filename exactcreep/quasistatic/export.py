"""What a run recorded as tables for other programs: data frames, a tree of datasets, files."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from exactcreep.model.enclosure import quantity
from exactcreep.model.numbers import InputError
from exactcreep.quasistatic.files import write_file
from exactcreep.solvers.tables import EVENT_KINDS, HALF_CYCLE_TABLE, LOGS, NUMBER, Schema

if TYPE_CHECKING:
    from exactcreep.quasistatic.result import Creep

TABLES: dict[str, Schema] = {"half_cycles": HALF_CYCLE_TABLE, **LOGS}
"""The tables of a run by the names that a user calls them by."""
ENDINGS = (".csv", ".parquet")


def check_ending(path: str | os.PathLike[str]) -> str:
    """Return how the name of a table's file ends; raise `InputError` if as no such file does."""
    ending = os.path.splitext(path)[1].lower()
    if ending not in ENDINGS:
        raise InputError("to", os.fspath(path), "must end in " + " or ".join(ENDINGS))
    return ending


def table(result: Creep, name: str) -> xr.Dataset:
    """Return one table of a run, its columns by their own names, or raise `InputError`."""
    if name not in TABLES:
        raise InputError("table", name, "must be one of " + ", ".join(TABLES))
    found = _part(result.dataset, TABLES[name])
    if not found:
        needed = name if name in LOGS else "x_G"
        raise InputError("table", name, f'was not recorded: the run needs record = ["{needed}"]')
    return found


def _part(dataset: xr.Dataset, schema: Schema) -> xr.Dataset:
    held = list(map(str, dataset.data_vars))
    names = [name for column in schema.columns for name in held if quantity(name) == column]
    part = dataset[names].rename({name: name.removeprefix(schema.prefix) for name in names})
    part.attrs = {}
    return part


def tree(result: Creep) -> xr.DataTree:
    """Return a run as a tree: parameters in the root, one group for each table, and the states."""
    dataset = result.dataset
    groups = {name: _part(dataset, schema) for name, schema in TABLES.items()}
    states = [name for name in dataset.data_vars if str(name).startswith(("initial_", "final_"))]
    lists = [name for name in dataset.data_vars if str(name).startswith("drive_")]
    nodes = {"/": dataset[lists], "states": xr.Dataset(dataset[states].variables)}
    nodes |= {name: group for name, group in groups.items() if group}
    return xr.DataTree.from_dict(nodes)


def frame(result: Creep, name: str) -> pd.DataFrame:
    dataset = table(result, name)
    dimension = str(next(iter(dataset[next(iter(dataset))].dims)))
    first = int(dimension == "half_cycle")
    columns: dict[str, Any] = {}
    about: dict[str, dict[str, str]] = {"units": {}, "meanings": {}}
    for key, variable in dataset.items():
        values, unit = _compact(variable.to_numpy()), variable.attrs["units"]
        parts = {str(key): values}
        if key == "kind":
            parts, unit = {"kind": pd.Categorical.from_codes(values, EVENT_KINDS)}, NUMBER
        elif values.ndim > 1:
            parts = {f"{key}_{k}": column for k, column in enumerate(values.T, 1)}
        columns |= parts
        about["units"] |= dict.fromkeys(parts, unit)
        about["meanings"] |= dict.fromkeys(parts, variable.attrs.get("long_name", ""))
    index = pd.RangeIndex(first, first + dataset.sizes[dimension], name=dimension)
    made = pd.DataFrame(columns, index=index)
    made.attrs.update(about)
    return made


def _compact(values: NDArray[Any]) -> NDArray[Any]:
    """Return a column with 32 bits for integers that fit; squares of shorter ones overflow."""
    fits = values.dtype == np.int64 and (values == values.astype(np.int32)).all()
    return values.astype(np.int32) if fits else values


def export(result: Creep, name: str, path: str | os.PathLike[str], *, force: bool = False) -> int:
    """Write one table of a run to a CSV or Parquet file and return how many rows it has.

    In Parquet pandas finds units and meanings as ``attrs``; CSV has units in brackets behind the
    names of the columns.
    """
    ending, rows = check_ending(path), frame(result, name)
    units = rows.attrs["units"]

    def write(file: Any) -> None:
        if ending == ".parquet":
            rows.to_parquet(file, engine="pyarrow", compression="zstd", index=True)
        else:
            header = [f"{k} [{units[k]}]" if units[k] != NUMBER else k for k in rows.columns]
            rows.to_csv(file, header=header, lineterminator="\n", mode="wb")

    try:
        write_file(path, write, "to", force=force)
    except ImportError:
        needed = 'needs pyarrow: pip install "exactcreep[export]"'
        raise InputError("to", os.fspath(path), needed) from None
    return len(rows)
