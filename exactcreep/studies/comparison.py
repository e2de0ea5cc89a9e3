"""Evaluate the dataset of `compare`: a table of the methods, and the sentence that sums it up."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from exactcreep.model.numbers import plain_data, with_error

_WITHIN = 0.01
"""Relative bias within which a mean velocity counts as right."""
_RESOLVED = 0.1
"""Width of an interval of 95 % from which on a relative bias is not known."""


def table(data: xr.Dataset) -> pd.DataFrame:
    """Return one row for each method: medians and ranges over seeds and repetitions.

    Columns: ``parted`` (seeds with a wrong event), ``agreed`` (median number of events before the
    first wrong one; inf if most seeds have none), ``error`` (at the rests before a wrong event of
    any method) with ``error_low`` and ``error_high``, ``seconds`` with ``fastest`` and ``slowest``,
    ``bias`` and ``bias_error`` (nan unless resolved).
    """
    lives = data.agreed.where(data.differs | data.agreed.isnull(), math.inf).values
    middle = math.ceil(data.sizes["seed"] / 2) - 1
    error, seconds = data.shared_error.values, data.seconds.values
    resolved = (2 * data.bias_error <= _RESOLVED).values
    columns = {
        "solver": data.solver.values,
        "parted": data.differs.sum("seed").values,
        "agreed": np.sort(lives, axis=1)[:, middle],
        "error": np.median(error, axis=1),
        "error_low": error.min(axis=1),
        "error_high": error.max(axis=1),
        "seconds": np.median(seconds, axis=1),
        "fastest": seconds.min(axis=1),
        "slowest": seconds.max(axis=1),
        "bias": np.where(resolved, data.bias, math.nan),
        "bias_error": np.where(resolved, data.bias_error, math.nan),
    }
    return pd.DataFrame(columns, index=pd.Index(data.method.values, name="method"))


def sentence(data: xr.Dataset) -> str:
    """Return which method to take for trajectories, and which for mean velocities within 1 %."""
    rows = table(data)
    if (rows.solver == "sliding").all():
        return "Take sliding: this chain has no slips, and the sliding limit is exact."
    safe = rows[(rows.parted == 0) & rows.agreed.notna()]
    fair = rows[abs(rows.bias) + rows.bias_error <= _WITHIN]
    trajectories = "no method of these is right"
    if len(safe):
        best = safe.loc[safe.seconds.idxmin()]
        trajectories = (
            f"take {best.name}: all {int(data.events.sum())} events of {data.truth} agree,"
            f" positions to {float(data.error.sel({'method': best.name}).max()):.2g} g tau_dyn^2"
        )
    velocities = "the bias of none is known to be so small"
    if len(fair):
        best = fair.loc[fair.seconds.idxmin()]
        off = "the bias is measured against it"
        if best.solver != "exact":
            off = f"its bias is {bias_text(best)} %"
        velocities = f"take {best.name}: {off}"
    return f"For trajectories {trajectories}; for mean velocities within 1 % {velocities}."


def bias_text(row: Any) -> str:
    """Return the bias of a row of the table in percent, or "" unless it is resolved."""
    if math.isnan(row.bias):
        return ""
    return with_error(100 * row.bias, 100 * row.bias_error, "+")


def unresolved(data: xr.Dataset) -> str:
    """Return why a bias is not printed."""
    return f"not resolved by {int(data.half_cycles.sum())} half-cycles"


def summary(data: xr.Dataset) -> dict[str, Any]:
    """Return the dataset, its table and its sentence by name, ready for JSON."""
    rows = data.drop_dims("repetition").drop_vars(["bias", "bias_error"]).to_dataframe()
    needs = dict(line.split(": ", 1) for line in data.needs.splitlines())
    methods = table(data).assign(repetitions=data.seconds.values.tolist()).reset_index()
    about = {"needs": needs, "sentence": sentence(data), "methods": methods.to_dict("records")}
    return plain_data(dict(data.attrs) | about | {"rows": rows.reset_index().to_dict("records")})
