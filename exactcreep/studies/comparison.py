"""What the dataset of `compare` says: orders in the time step, intervals, a table, an advice."""

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

from exactcreep.model.numbers import plain_data

_LEVEL = 0.95
_PARTS = ("value", "lower", "upper")


class Interval(NamedTuple):
    """A number and its interval, nan where it is not known."""

    value: float
    lower: float
    upper: float


UNKNOWN = Interval(math.nan, math.nan, math.nan)


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
    """Return the order in dt of Verlet's position errors, fitted seed by seed.

    Parameters
    ----------
    data : Dataset
        Of `compare`, with two time steps at least.
    locate : bool
        Of Verlet with located events, or without.

    Returns
    -------
    Interval
        Neighbouring steps are compared at the rests that both came to before their first wrong
        event: the mean of ``log(error ratio) / log(dt ratio)`` over pairs of steps, weighted by
        the latter squared (a straight line through the medians); then the mean over seeds, with
        Student's interval of 95 % (nan of a single seed).
    """
    family = data.isel(method=np.flatnonzero((data.dt > 0) & (data.locate == locate)))
    family = family.isel(method=np.argsort(-family.dt.values))
    found = []
    for s in range(data.sizes["seed"]):
        above = below = 0.0
        for i, j in pairwise(range(family.sizes["method"])):
            pair = [family.errors.values[k, s] for k in (i, j)]
            shared = int(family.rests.values[[i, j], s].min())
            if not shared:
                continue
            medians = [float(np.median(errors[:shared])) for errors in pair]
            step = math.log(family.dt.values[i] / family.dt.values[j])
            if min(medians) > 0:
                above += math.log(medians[0] / medians[1]) * step
                below += step * step
        if below:
            found.append(above / below)
    return Interval(found[0], math.nan, math.nan) if len(found) == 1 else interval_of_mean(found)


def spread(data: xr.Dataset) -> xr.Dataset:
    """Return what the seeds say together of each method, as a value and its interval.

    Returns
    -------
    Dataset
        Over ``method`` and ``interval`` (value, lower, upper): ``agreed``, events before the first
        that differs (median and quartiles; inf where so many seeds met none), ``rate`` of wrong
        turns per event (Poisson's 95 %), ``error`` (median and quartiles of the largest position
        error), ``bias`` of the velocity relative to that of `exact` (Student's 95 %).
    """
    made: dict[str, list[Interval]] = {name: [] for name in ("agreed", "rate", "error", "bias")}
    # where the bias is known, velocity - bias is that of exact
    scale = abs(float((data.velocity - data.bias).mean()))
    for name in data.method.values:
        own = data.sel({"method": name})
        agreed, differs = own.agreed.values, own.differs.values
        events = not np.isnan(agreed).any()
        lives = np.sort(np.where(differs, agreed, math.inf))
        places = [max(math.ceil(share * lives.size) - 1, 0) for share in (0.5, 0.25, 0.75)]
        made["agreed"].append(Interval(*lives[places].tolist()) if events else UNKNOWN)
        made["rate"].append(rate_of(int(differs.sum()), agreed.sum()) if events else UNKNOWN)
        known = own.error.values[~np.isnan(own.error.values)]
        quartiles = np.quantile(known, (0.5, 0.25, 0.75)).tolist() if known.size else UNKNOWN
        made["error"].append(Interval(*quartiles))
        shares = own.bias.values / scale if scale > 0 else np.full(data.sizes["seed"], math.nan)
        several = shares.size > 1 and np.isfinite(shares).all()
        one = Interval(float(shares[0]), math.nan, math.nan)
        made["bias"].append(interval_of_mean(shares) if several else one)
    variables = {name: (("method", "interval"), values) for name, values in made.items()}
    return xr.Dataset(variables, data.coords).assign_coords(interval=list(_PARTS)).drop_vars("rest")


def table(data: xr.Dataset) -> pd.DataFrame:
    """Return one row for each method: what the seeds say together, times and memory.

    Columns: ``parted`` (seeds with a wrong event), ``agreed``, ``error`` and ``bias`` as in
    `spread` with half the width of the latter's interval (``bias_error``), ``velocity``,
    ``seconds`` per half-cycle and ``ratio`` (over those of `exact`), medians over the seeds, and
    ``memory`` in bytes.
    """
    known, middle = spread(data), data[["seconds", "velocity"]].median("seed")
    exact = data.seconds.where(data.solver == "exact", drop=True)
    base = float(exact.median()) if exact.size else math.nan
    low, high = (known.bias.sel(interval=part) for part in ("lower", "upper"))
    value = known.sel(interval="value")
    columns = {
        "parted": data.differs.sum("seed"),
        "agreed": value.agreed,
        "error": value.error,
        "velocity": middle.velocity,
        "bias": value.bias,
        "bias_error": (high - low) / 2,
        "seconds": middle.seconds,
        "ratio": middle.seconds / base,
    }
    if "memory" in data:
        columns["memory"] = data.memory
    return pd.DataFrame({name: column.values for name, column in columns.items()},
                        index=pd.Index(data.method.values, name="method"))  # fmt: skip


def advice(data: xr.Dataset) -> str:
    """Return what to take for trajectories, and for the mean velocity: methods with their steps.

    A bias is not seen if its interval over the seeds holds zero; the sentence says how large it may
    be all the same. Times play no part.
    """
    if list(data.solver.values) == ["sliding"]:
        return "Take sliding: this chain has no slips, and the sliding limit is exact."
    rows, seeds, steps = table(data), data.sizes["seed"], data.dt.to_series()
    verlet, said = steps > 0, []
    safe = rows[(rows.parted == 0) & rows.agreed.notna() & (rows.index != data.truth)]
    coarsest = safe[verlet[safe.index]].index[:1].tolist()  # steps fall from method to method
    chosen = safe.index[~verlet[safe.index]].tolist() + coarsest
    if chosen:
        said.append(
            f"for trajectories take {' or '.join(chosen)}: all {int(data.events.sum())} events of"
            f" {data.truth} agree, positions to {safe.error[chosen].max():.1g} g tau_dyn^2"
        )
    if wrong := rows.index[verlet & (rows.parted > 0)].tolist():
        finest = min(wrong, key=lambda name: steps[name])
        said.append(f"{finest} turns wrong in {rows.parted[finest]} of {seeds} seeds")
    fair = rows[verlet & (abs(rows.bias) <= rows.bias_error)].index.tolist()
    if fair:
        widest = max(fair, key=lambda name: steps[name])
        within = 100 * (abs(rows.bias[widest]) + rows.bias_error[widest])
        said.append(f"for the mean velocity {widest} shows no bias beyond {within:.2g} % (95 %)")
    for name in rows.index[(verlet if not fair else False) | (data.solver == "sliding").values]:
        if rows.bias[name] == rows.bias[name]:
            error = rows.bias_error[name]
            around = f" ± {100 * error:.1g} %" if error == error else " % in this run"
            off = f"{100 * rows.bias[name]:+.2g}{around}"
            said.append(f"the mean velocity of {name} is off by {off}")
    text = "; ".join(said or ["no method is known to be right here"])
    return text[0].upper() + text[1:] + "."


def summary(data: xr.Dataset) -> dict[str, Any]:
    """Return the dataset's numbers and its reductions by names, ready for JSON."""
    known = spread(data)
    methods = {
        name: {part: known[part].sel({"method": name}).values.tolist() for part in known.data_vars}
        for name in data.method.values.tolist()
    }
    rows = data.drop_dims("rest").to_dataframe(dim_order=["method", "seed"]).reset_index()
    orders = {"verlet": order(data), "verlet, located": order(data, locate=True)}
    whole = {"advice": advice(data), "orders": orders, "intervals": methods}
    return plain_data(dict(data.attrs) | whole | {"rows": rows.to_dict("records")})
