"""Measured velocities beside the laws: values, standard errors, and why they part."""

from __future__ import annotations

import csv
import io
import itertools
import json
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from exactcreep.laws import LAWS, law_values
from exactcreep.model.numbers import InputError, exact_number, nearest_float
from exactcreep.studies.sweep import dimensions

SEED = "run.seed"
CONTROL = "velocity_sliding"
"""Variable of a sweep: the velocity of the sliding limit under the same random dilations."""
NOTABLE = 3.0
"""Standard errors beyond which a deviation is explained."""
_FEWEST_SEEDS = 6  # whose scatter is trusted more than the block averages of each
_ROUNDING = 1e-9  # relative; closer than this a value agrees with a law, or does not scatter


class Cell(NamedTuple):
    """One point of a grid, all its seeds together.

    Attributes
    ----------
    parameters : dict
        The chain and its drive, exactly, by the names that laws use; and what else was varied.
    varied : dict of str to value
        The dimensions (without the seed) and their values.
    velocity, error : float
        Mean over the seeds and its standard error, unit ``g tau_dyn**2`` per half-cycle. If the
        sweep knows what the sliding limit does under the same random dilations (`CONTROL`), the
        scatter of the dilations is taken out: velocity minus sliding limit, plus its known mean.
    outcomes : tuple of str
        Of each seed.
    """

    parameters: dict[str, Any]
    varied: dict[str, Any]
    velocity: float
    error: float
    outcomes: tuple[str, ...]


@dataclass(frozen=True)
class Row:
    """A measured velocity beside the laws.

    Attributes
    ----------
    varied : mapping of str to value
        Which point it is.
    measured, error : float
        Velocity and standard error, unit ``g tau_dyn**2`` per half-cycle (or target).
    printed, exact : tuple of float
        What the paper's law gives as printed, and the corrected or exact law; two values where the
        plateau is not unique, none where there is no law.
    remark : str
        Why it departs, where it does.
    """

    varied: Mapping[str, Any]
    measured: float
    error: float
    printed: tuple[float, ...]
    exact: tuple[float, ...]
    remark: str = ""

    @property
    def deviation_printed(self) -> float:
        """Measured minus printed law, in standard errors; nan if there is nothing to compare."""
        return deviation(self.measured, self.error, self.printed)

    @property
    def deviation_exact(self) -> float:
        """Measured minus corrected or exact law, in standard errors."""
        return deviation(self.measured, self.error, self.exact)

    @property
    def departs(self) -> bool:
        """Whether the measured value needs an explanation."""
        best = self.deviation_exact if self.exact else self.deviation_printed
        return abs(best) > NOTABLE


@dataclass(frozen=True)
class Table:
    """The rows of one series of points.

    Attributes
    ----------
    name, title : str
    printed, exact : str
        The formulas of the two laws, in words.
    rows : tuple of Row
    note : str
        One line about the whole table: where the printed law is not the exact one.
    unit : str
        Of the measured values, their errors and the laws.
    """

    name: str
    title: str
    printed: str
    exact: str
    rows: tuple[Row, ...]
    note: str = ""
    unit: str = "g tau_dyn^2 per half-cycle or target"


def to_csv(tables: Sequence[Table]) -> str:
    """Return tables as one CSV: a column for each quantity that varies, numbers in full.

    A number that is not known is nan, and what a series does not vary is empty. Where a plateau is
    not unique, a law has its two values in two columns, else the same in both. The unit is that of
    the measured value, its standard error and the laws; deviations count standard errors.
    """
    rows = [row for table in tables for row in table.rows]
    varied = list(dict.fromkeys(key for row in rows for key in row.varied))
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(
        ["series", *varied, "measured", "standard_error", "printed_law_least",
         "printed_law_largest", "exact_law_least", "exact_law_largest", "deviation_printed",
         "deviation_exact", "unit", "remark"]
    )  # fmt: skip
    for table in tables:
        for row in table.rows:
            laws = [end for law in (row.printed, row.exact)
                    for end in ((min(law), max(law)) if law else (math.nan, math.nan))]  # fmt: skip
            numbers = [row.measured, row.error, *laws, row.deviation_printed, row.deviation_exact]
            writer.writerow(
                [table.name, *(row.varied.get(key, "") for key in varied),
                 *(repr(float(number)) for number in numbers),
                 table.unit, row.remark]
            )  # fmt: skip
    return text.getvalue()


def deviation(measured: float, error: float, law: Sequence[float]) -> float:
    """Return how many standard errors `measured` lies above the law, or outside of its values.

    Zero between the two values of a plateau that is not unique; nan without a law or an error;
    +-inf where a value that scatters by no more than rounding differs.
    """
    if not law or math.isnan(measured) or math.isnan(error):
        return math.nan
    low, high = min(law), max(law)
    gap = measured - high if measured > high else min(measured - low, 0.0)
    rounding = _ROUNDING * max(abs(low), abs(high), 1.0)
    if abs(gap) <= rounding:
        return 0.0
    return gap / error if error > rounding else math.copysign(math.inf, gap)


def cells(dataset: xr.Dataset) -> list[Cell]:
    """Return the points of a sweep's grid, the seeds of each taken together."""
    vary: dict[str, list[Any]] = json.loads(dataset.attrs["vary"])
    names = dimensions(vary)
    keys = [key for key in vary if key != SEED]
    found = []
    for indices in itertools.product(*(range(len(vary[key])) for key in keys)):
        here = dataset.isel({names[key]: index for key, index in zip(keys, indices, strict=True)})
        parameters = dict(_shared(dataset))
        varied = {}
        for key, index in zip(keys, indices, strict=True):
            value = vary[key][index]
            parameters[key.rpartition(".")[2]] = _exact(value)
            varied[names[key]] = _shown(value)
        velocity, error = _over_seeds(here, parameters)
        outcomes = tuple(str(word) for word in np.atleast_1d(here["outcome"].to_numpy()))
        found.append(Cell(parameters, varied, velocity, error, outcomes))
    return found


def _shared(dataset: xr.Dataset) -> Iterator[tuple[str, Any]]:
    for name in ("n", "l0", "mu_d", "mu_s", "sigma_mu", "tan_alpha", "amplitude", "sigma_theta"):
        if name in dataset.attrs:
            yield name, exact_number(_plain(dataset.attrs[name]), name)


def _plain(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value


def _exact(value: Any) -> Any:
    try:
        return exact_number(value, "value")
    except InputError:
        return value


def _shown(value: Any) -> Any:
    """Return a varied value as it goes into a table."""
    exact = _exact(value)
    if not isinstance(exact, Fraction):
        return value if isinstance(value, str) else json.dumps(value)
    return int(exact) if exact.denominator == 1 else nearest_float(exact)


def _over_seeds(here: xr.Dataset, parameters: Mapping[str, Any]) -> tuple[float, float]:
    """Return the mean velocity and its standard error.

    From the scatter of the seeds if there are enough of them, else from their block averages.
    """
    velocity = np.atleast_1d(here["velocity"].to_numpy())
    error = np.atleast_1d(here["velocity_error"].to_numpy())
    if CONTROL in here and velocity.size > 1:
        known = law_values(LAWS["vitesse_seuil_random"].exact, parameters)
        control = np.atleast_1d(here[CONTROL].to_numpy())
        velocity = velocity - control + sum(known) / len(known)
        return float(velocity.mean()), float(velocity.std(ddof=1)) / math.sqrt(velocity.size)
    mean = float(velocity.mean())
    if velocity.size >= _FEWEST_SEEDS:
        return mean, float(velocity.std(ddof=1)) / math.sqrt(velocity.size)
    return mean, math.sqrt(float((error**2).sum())) / velocity.size


def with_control(dataset: xr.Dataset, sliding: xr.Dataset) -> xr.Dataset:
    """Return a sweep with the velocities of the sliding limit under the same dilations."""
    about = {**sliding["velocity"].attrs, "long_name": "sliding limit, same random dilations"}
    values = (sliding["velocity"].dims, sliding["velocity"].to_numpy(), about)
    return dataset.assign({CONTROL: values})


class Series(NamedTuple):
    """A table to be: every point of a sweep beside the law of the paper's equation `law`.

    Attributes
    ----------
    scene : str
        The sweep, and the name of the table.
    title, law : str
        `law` is a label of `LAWS`.
    remark : callable
        Called for each point that departs from its law; returns one line that says why.
    note : str
        For the table.
    """

    scene: str
    title: str
    law: str
    remark: Callable[[Cell], str]
    note: str = ""


def tables_of(*series: Series) -> Callable[[Mapping[str, xr.Dataset]], list[Table]]:
    """Return what makes the tables of these series out of the sweeps of a picture, by scene."""
    return lambda data: [_table(one, data[one.scene]) for one in series]


def _table(series: Series, dataset: xr.Dataset) -> Table:
    rows = []
    for cell in cells(dataset):
        row = beside(cell, series.law)
        rows.append(replace(row, remark=series.remark(cell)) if row.departs else row)
    return table_of(series.scene, series.title, rows, series.law, note=series.note)


def beside(cell: Cell, law: str, remark: str = "") -> Row:
    """Return the row of a point beside the law of the paper's equation `law`."""
    known = LAWS[law]
    printed = law_values(known.printed, cell.parameters)
    better = law_values(known.exact or known.corrected, cell.parameters)
    return Row(cell.varied, cell.velocity, cell.error, printed, better, remark)


def table_of(name: str, title: str, rows: Iterable[Row], law: str, note: str = "") -> Table:
    """Return rows as a table headed by the law of the paper's equation `law`."""
    known = LAWS[law]
    better = known.exact or known.corrected
    words = "" if better is None else better.text
    return Table(name, title, f"Eq. ({law}): {known.printed.text}", words, tuple(rows), note)
