"""Evaluate the dataset of `compare`: orders in the time step, intervals, a table, and advice."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray
from scipy import stats

from exactcreep.model.numbers import plain_data, with_error

_LEVEL = 0.95


class Interval(NamedTuple):
    """A number and its interval; nan where unknown."""

    value: float
    lower: float = math.nan
    upper: float = math.nan


UNKNOWN = Interval(math.nan)


def interval_of_mean(values: Sequence[float] | NDArray[np.float64]) -> Interval:
    """Return the mean of independent numbers, with Student's interval of 95 %."""
    known = np.asarray(values, dtype=float)
    if known.size < 2 or not np.isfinite(known).all():
        return UNKNOWN
    mean = float(known.mean())
    half = float(stats.t.ppf((1 + _LEVEL) / 2, known.size - 1) * stats.sem(known))
    return Interval(mean, mean - half, mean + half)


def rate_of(count: int, among: float) -> Interval:
    """Return a rate with the interval of 95 % of a Poisson count."""
    if not among > 0:
        return UNKNOWN
    low = stats.chi2.ppf((1 - _LEVEL) / 2, 2 * count) / 2 if count else 0.0
    high = stats.chi2.ppf((1 + _LEVEL) / 2, 2 * count + 2) / 2
    return Interval(count / among, float(low) / among, float(high) / among)


def order(data: xr.Dataset, *, locate: bool = False) -> Interval:
    """Return the order in dt of Verlet's position errors, with or without located events.

    ``log(error ratio) / log(dt ratio)`` of neighbouring steps, at rests before a wrong event,
    averaged over pairs with the weight ``log(dt ratio)**2``, then over seeds, with an interval.
    """
    family = data.isel(method=np.flatnonzero((data.dt > 0) & (data.locate == locate)))
    family = family.isel(method=np.argsort(-family.dt.values))
    steps, found = np.log(family.dt.values), []
    for s in range(data.sizes["seed"]):
        above = below = 0.0
        for i, j in pairwise(range(steps.size)):
            shared = family.rests.values[[i, j], s].min()
            if not shared:
                continue
            medians = np.median(family.errors.values[[i, j], s, :shared], axis=1)
            if medians.min() > 0:
                step = steps[i] - steps[j]
                above += math.log(medians[0] / medians[1]) * step
                below += step * step
        if below:
            found.append(above / below)
    return Interval(float(found[0])) if len(found) == 1 else interval_of_mean(found)


def spread(data: xr.Dataset) -> xr.Dataset:
    """Return statistics over the seeds for each method, over ``method`` and ``interval``.

    ``agreed``: events before the first wrong event (median and quartiles; inf where that many seeds
    had none); ``rate``: wrong events per event (Poisson's 95 %); ``error``: the largest position
    error (median and quartiles); ``bias``: of the velocity, relative to `exact` (Student's 95 %).
    """
    # velocity - bias is the velocity of exact
    scale = abs(float((data.velocity - data.bias).mean()))
    methods = [_spread(data.isel(method=k), scale) for k in range(data.sizes["method"])]
    dims = ("method", "interval")
    variables = {name: (dims, [own[name] for own in methods]) for name in methods[0]}
    coords = data.drop_vars("rest").coords
    return xr.Dataset(variables, coords).assign_coords(interval=list(Interval._fields))


def _spread(own: xr.Dataset, scale: float) -> dict[str, Interval]:
    agreed, differs, error = own.agreed.values, own.differs.values, own.error.values
    lives = np.sort(np.where(differs, agreed, math.inf))
    places = [max(math.ceil(share * lives.size) - 1, 0) for share in (0.5, 0.25, 0.75)]
    known = error[~np.isnan(error)]
    biases = own.bias.values / (scale or math.nan)
    events = not np.isnan(agreed).any()
    several = biases.size > 1 and np.isfinite(biases).all()
    return {
        "agreed": Interval(*lives[places]) if events else UNKNOWN,
        "rate": rate_of(int(differs.sum()), agreed.sum()) if events else UNKNOWN,
        "error": Interval(*np.quantile(known, (0.5, 0.25, 0.75))) if known.size else UNKNOWN,
        "bias": interval_of_mean(biases) if several else Interval(biases[0]),
    }


def table(data: xr.Dataset) -> pd.DataFrame:
    """Return one row for each method, with statistics over the seeds.

    Columns: ``parted`` (seeds with a wrong event), ``agreed``, ``error`` and ``bias`` as in
    `spread`, ``bias_error`` (half the width of its interval), ``velocity``, and the medians of
    ``seconds`` per half-cycle and its ``ratio`` to `exact`.
    """
    known, middle = spread(data), data[["seconds", "velocity"]].median("seed")
    value, low, high = (known.sel(interval=part) for part in Interval._fields)
    exact = data.seconds.where(data.solver == "exact", drop=True)
    columns = {
        "parted": data.differs.sum("seed"),
        "agreed": value.agreed,
        "error": value.error,
        "velocity": middle.velocity,
        "bias": value.bias,
        "bias_error": (high.bias - low.bias) / 2,
        "seconds": middle.seconds,
        "ratio": middle.seconds / (float(exact.median()) if exact.size else math.nan),
    }
    return pd.DataFrame({name: column.values for name, column in columns.items()},
                        index=pd.Index(data.method.values, name="method"))  # fmt: skip


def advice(data: xr.Dataset) -> str:
    """Recommend a method and step for trajectories, and one for the mean velocity.

    A bias counts as zero if its interval over the seeds contains zero; the sentence then states the
    largest bias in the interval. The recommendation does not depend on times.
    """
    if list(data.solver.values) == ["sliding"]:
        return "Take sliding: this chain has no slips, and the sliding limit is exact."
    rows, seeds = table(data).assign(dt=data.dt, solver=data.solver), data.sizes["seed"]
    verlet, said = rows[rows.dt > 0], []
    safe = rows[(rows.parted == 0) & rows.agreed.notna() & (rows.index != data.truth)]
    # steps fall from method to method
    safe = pd.concat([safe[safe.dt.isna()], safe[safe.dt > 0][:1]])
    if safe.size:
        said.append(
            f"for trajectories take {' or '.join(safe.index)}: all {int(data.events.sum())} events"
            f" of {data.truth} agree, positions to {safe.error.max():.2g} g tau_dyn^2"
        )
    if len(wrong := verlet[verlet.parted > 0]):
        finest = wrong.dt.idxmin()
        said.append(f"{finest} turns wrong in {wrong.parted[finest]} of {seeds} seeds")
    fair = verlet[abs(verlet.bias) <= verlet.bias_error]
    if len(fair):
        widest = fair.loc[fair.dt.idxmax()]
        off = with_error(100 * widest.bias, 100 * widest.bias_error, "+")
        hidden = 100 * (abs(widest.bias) + widest.bias_error)
        said.append(f"the mean velocity of {widest.name} is off by {off} % (95 %), none that is"
                    f" seen: {seeds} seeds could hide {hidden:.2g} %")  # fmt: skip
    doubted = rows[((rows.dt > 0) & (len(fair) == 0)) | (rows.solver == "sliding")]
    for name, row in doubted[doubted.bias.notna()].iterrows():
        has_interval = not math.isnan(row.bias_error)
        off = with_error(100 * row.bias, 100 * row.bias_error, "+") + " %"
        where = "" if has_interval else " in this run"
        said.append(f"the mean velocity of {name} is off by {off}{where}")
    text = "; ".join(said or ["no method is known to be right here"])
    return text[0].upper() + text[1:] + "."


def summary(data: xr.Dataset) -> dict[str, Any]:
    """Return the dataset and the statistics above by name, ready for JSON."""
    known = spread(data)
    methods = {
        name: {part: known[part].sel({"method": name}).values.tolist() for part in known.data_vars}
        for name in data.method.values.tolist()
    }
    rows = data.drop_dims("rest").to_dataframe(dim_order=["method", "seed"]).reset_index()
    orders = {"verlet": order(data), "verlet, located": order(data, locate=True)}
    whole = {"advice": advice(data), "orders": orders, "intervals": methods}
    return plain_data(dict(data.attrs) | whole | {"rows": rows.to_dict("records")})
