"""The recorded tables of a run as pandas data frames, from which other formats are made."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pandas as pd

from exactcreep.model.enclosure import quantity
from exactcreep.model.numbers import InputError
from exactcreep.solvers.tables import EVENT_KINDS, HALF_CYCLE_TABLE, LOGS, NUMBER, Schema

if TYPE_CHECKING:
    from exactcreep.quasistatic.creep_result import Creep

TABLES: dict[str, Schema] = {"half_cycles": HALF_CYCLE_TABLE, **LOGS}
"""The tables of a run by their public names."""


def frame(result: Creep, table: str) -> pd.DataFrame:
    """Return one table of a run, its columns by their own names, or raise `InputError`."""
    if not isinstance(table, str) or table not in TABLES:
        raise InputError("table", table, "must be one of " + ", ".join(TABLES))
    schema, dataset = TABLES[table], result.dataset
    held = list(map(str, dataset.data_vars))
    names = [name for column in schema.columns for name in held if quantity(name) == column]
    if not names:
        needed = table if table in LOGS else "x_G"
        raise InputError("table", table, f'was not recorded: the run needs record = ["{needed}"]')
    columns: dict[str, Any] = {}
    about: dict[str, dict[str, str]] = {"units": {}, "meanings": {}}
    for name in names:
        key, variable = name.removeprefix(schema.prefix), dataset[name]
        values, unit = variable.to_numpy(), variable.attrs["units"]
        parts = {key: values}
        if key == "kind":
            parts, unit = {key: pd.Categorical.from_codes(values, EVENT_KINDS)}, NUMBER
        elif values.ndim > 1:
            parts = {f"{key}_{k}": column for k, column in enumerate(values.T, 1)}
        columns |= parts
        about["units"] |= dict.fromkeys(parts, unit)
        about["meanings"] |= dict.fromkeys(parts, variable.attrs.get("long_name", ""))
    first = int(schema is HALF_CYCLE_TABLE)
    rows = dataset.sizes[schema.dimension]
    made = pd.DataFrame(columns, pd.RangeIndex(first, first + rows, name=schema.dimension))
    made.attrs.update(about)
    return made
