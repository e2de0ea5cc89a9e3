"""What a run recorded as tables for other programs: data frames, a tree of datasets, files."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import xarray as xr

from exactcreep.model.enclosure import quantity
from exactcreep.model.numbers import InputError
from exactcreep.quasistatic.files import Content, write_file
from exactcreep.solvers.tables import EVENT_KINDS, HALF_CYCLE_TABLE, LOGS, NUMBER, Schema

if TYPE_CHECKING:
    from exactcreep.quasistatic.result import Creep

TABLES: dict[str, Schema] = {"half_cycles": HALF_CYCLE_TABLE, **LOGS}
"""The tables of a run by the names that a user calls them by."""
ENDINGS = (".csv", ".parquet")
ROWS_AT_ONCE = 2**18


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
    if name in LOGS and not found:
        raise InputError("table", name, f'was not recorded: the run needs record = ["{name}"]')
    if not found:  # the targets are known from the drive
        count = np.arange(1, result.half_cycles + 1)
        theta = result.drive.targets(1, result.half_cycles, result.seed)
        about = HALF_CYCLE_TABLE.columns["theta"].attributes
        found = xr.Dataset({"theta": ("half_cycle", theta, about)}, {"half_cycle": count})
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
    """Return one table of a run as a data frame; see `Creep.to_pandas`."""
    return next(_frames(table(result, name), sys.maxsize))


def _frames(dataset: xr.Dataset, at_once: int) -> Iterator[pd.DataFrame]:
    """Yield the rows of a table, so many at once, as frames of the same types."""
    dimension = str(next(iter(dataset[next(iter(dataset))].dims)))
    first = int(dimension == "half_cycle")
    rows = dataset.sizes[dimension]
    types = {str(name): _compact(values.to_numpy()) for name, values in dataset.items()}
    for begin in range(0, max(rows, 1), at_once):
        end = min(rows, begin + at_once)
        columns: dict[str, Any] = {}
        about: dict[str, dict[str, str]] = {"units": {}, "meanings": {}}
        for key, variable in dataset.items():
            name, unit = str(key), variable.attrs["units"]
            values = variable.to_numpy()[begin:end].astype(types[name])
            parts = {name: values}
            if name == "kind":
                parts, unit = {name: pd.Categorical.from_codes(values, EVENT_KINDS)}, NUMBER
            elif values.ndim > 1:
                parts = {f"{name}_{k}": column for k, column in enumerate(values.T, 1)}
            columns |= parts
            about["units"] |= dict.fromkeys(parts, unit)
            about["meanings"] |= dict.fromkeys(parts, variable.attrs.get("long_name", ""))
        index = pd.RangeIndex(first + begin, first + end, name=dimension)
        made = pd.DataFrame(columns, index=index)
        made.attrs.update(about)
        yield made


def _compact(values: Any) -> Any:
    """Return the type of a column: 32 bits for integers that fit.

    Fewer might fit, too, but the squares of such numbers would overflow unseen.
    """
    fits = values.dtype == np.int64 and (values == values.astype(np.int32)).all()
    return np.dtype(np.int32) if fits else values.dtype


def export(result: Creep, name: str, path: str | os.PathLike[str], *, force: bool = False) -> int:
    """Write one table of a run to a CSV or Parquet file and return how many rows it has.

    The rows are written in groups, so that a copy of the whole table is never in memory.
    """
    ending = check_ending(path)
    whole = table(result, name)
    frames = _frames(whole, ROWS_AT_ONCE)
    content: Content = _csv(frames)
    if ending == ".parquet":
        try:
            content = import_module("exactcreep.quasistatic.parquet").parquet(frames)
        except ImportError:
            needed = 'needs pyarrow: pip install "exactcreep[export]"'
            raise InputError("to", os.fspath(path), needed) from None
    write_file(path, content, "to", force=force)
    return whole[next(iter(whole))].shape[0]


def _csv(frames: Iterator[pd.DataFrame]) -> Iterator[bytes]:
    """Yield a CSV file: numbers in full, units in brackets behind the names of their columns."""
    for number, rows in enumerate(frames):
        units = rows.attrs["units"]
        header: Any = False
        if number == 0:
            header = [f"{k} [{units[k]}]" if units[k] != NUMBER else k for k in rows.columns]
        yield rows.to_csv(header=header, lineterminator="\n").encode()
