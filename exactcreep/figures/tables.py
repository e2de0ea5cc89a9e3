"""Measured velocities beside the laws: values, standard errors, and deviations."""

from __future__ import annotations

import csv
import io
import itertools
import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from exactcreep import laws
from exactcreep.laws import law_values
from exactcreep.model.numbers import InputError, exact_number, nearest_float
from exactcreep.studies.sweep import dimensions

Data = Mapping[str, xr.Dataset]
"""The sweeps of a picture by the names of their scenes."""
SEED = "run.seed"
CONTROL = "velocity_sliding"
"""Variable of a sweep: the velocity of the sliding limit under the same random dilations."""
_SHARED = ("n", "l0", "mu_d", "mu_s", "sigma_mu", "tan_alpha", "amplitude", "sigma_theta")
_FEWEST_SEEDS = 6  # whose scatter is trusted more than the block averages of each
_ROUNDING = 1e-9  # relative; closer than this a value agrees with a law, or does not scatter


class Law(NamedTuple):
    """A law of the paper as printed, the exact law behind it, and both in words."""

    printed: Callable[..., Any]
    exact: Callable[..., Any]
    words: str
    words_exact: str


def _two_sliders(*, l0: Any, mu_d: Any, tan_alpha: Any, sigma_theta: Any) -> Any:
    return laws.sliding_velocity_random(
        n=2, i=2, l0=l0, mu_d=mu_d, tan_alpha=tan_alpha, sigma_theta=sigma_theta
    )


_GAUSSIAN = "(N+3-2i) l0 sigma I(h), h = N m/(2 l0 sigma): exact in the sliding limit"
LAWS = {
    "velocity_th_2_gaussienne_corrected": Law(
        laws.two_sliders_velocity_random,
        _two_sliders,
        "l0 sigma/sqrt(pi) - (2/3) a",
        "l0 sigma I(h), h = m/(l0 sigma): sliding limit, and the mean over phases",
    ),
    "velocity_th_2_gaussian": Law(
        laws.plateau_velocity_random, _two_sliders, "l0 sigma/sqrt(pi)", ""
    ),
    "vitesse_random": Law(
        laws.plateau_velocity_random,
        laws.sliding_velocity_random,
        "(N+3-2i) l0 sigma/sqrt(pi)",
        _GAUSSIAN,
    ),
    "vitesse_seuil": Law(
        laws.creep_velocity,
        laws.sliding_velocity,
        "(N+3-2i) (l0 A - N m/2)",
        "(N+3-2i) max(0, l0 A - N m/2): exact in the sliding limit mu_s -> mu_d",
    ),
    "vitesse_seuil_random": Law(
        laws.creep_velocity_random,
        laws.sliding_velocity_random,
        "(N+3-2i) (l0 sigma/sqrt(pi) - N m/3)",
        _GAUSSIAN,
    ),
}
"""The laws that tables compare with, by the labels of the paper's equations."""


@dataclass(frozen=True)
class Point:
    """A measured velocity beside the laws.

    Attributes
    ----------
    varied : mapping of str to value
        Which point of a grid it is: the dimensions, without the seed, and their values.
    measured, error : float
        Mean over the seeds and its standard error, unit ``g tau_dyn**2`` per half-cycle (or
        target).
    printed, exact : tuple of float
        What the paper's law gives as printed, and the corrected or exact law; two values where the
        plateau is not unique, none where there is no law.
    parameters : dict
        The chain and its drive, exactly, by the names that laws use; and what else was varied.
    """

    varied: Mapping[str, Any]
    measured: float
    error: float = math.nan
    printed: tuple[float, ...] = ()
    exact: tuple[float, ...] = ()
    parameters: dict[str, Any] = field(default_factory=dict)

    @property
    def deviation_printed(self) -> float:
        """Measured minus printed law, in standard errors; nan if there is nothing to compare."""
        return deviation(self.measured, self.error, self.printed)

    @property
    def deviation_exact(self) -> float:
        """Measured minus corrected or exact law, in standard errors."""
        return deviation(self.measured, self.error, self.exact)

    def beside(self, label: str) -> Point:
        """Return the point with the law of the paper's equation `label`.

        Where a printed law is negative it is below its threshold, and does not hold.
        """
        law = LAWS[label]
        better = law_values(law.exact, self.parameters)
        printed = law_values(law.printed, self.parameters)
        if printed and max(printed) < 0 <= self.parameters["tan_alpha"]:
            printed = ()
        return replace(self, printed=printed, exact=better)


@dataclass(frozen=True)
class Table:
    """The points of one series.

    Attributes
    ----------
    name, title : str
    rows : tuple of Point
    printed, exact : str
        The formulas of the two laws, in words.
    note : str
        One line about the whole table: where the printed law is not the exact one.
    unit : str
        Of the measured values, their errors and the laws.
    """

    name: str
    title: str
    rows: tuple[Point, ...]
    printed: str
    exact: str
    note: str
    unit: str = "g tau_dyn^2 per half-cycle or target"

    @property
    def parameters(self) -> dict[str, Any]:
        """The chain and the drive of the first point."""
        return self.rows[0].parameters


def series(
    title: str, label: str, note: str = "", scene: str = ""
) -> Callable[[Data], list[Table]]:
    """Return what makes a table of a sweep: its points beside the paper's equation `label`.

    The sweep is that of `scene`, default the first.
    """

    def tables(data: Data) -> list[Table]:
        name, law = scene or next(iter(data)), LAWS[label]
        rows = tuple(point.beside(label) for point in points_of(data[name]))
        return [Table(name, title, rows, f"Eq. ({label}): {law.words}", law.words_exact, note)]

    return tables


def to_csv(tables: Sequence[Table]) -> str:
    """Return tables as one CSV: a column for each quantity that varies, numbers in full.

    A number that is not known is nan, and what a series does not vary is empty. Where a plateau is
    not unique, a law has its two values in two columns, else the same in both. The unit is that of
    the measured value, its standard error and the laws; deviations count standard errors.
    """
    varied = list(dict.fromkeys(key for one in tables for row in one.rows for key in row.varied))
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(
        ["series", *varied, "measured", "standard_error", "printed_law_least",
         "printed_law_largest", "exact_law_least", "exact_law_largest", "deviation_printed",
         "deviation_exact", "unit"]
    )  # fmt: skip
    for table in tables:
        for row in table.rows:
            laws = [end(law, default=math.nan) for law in (row.printed, row.exact)
                    for end in (min, max)]  # fmt: skip
            numbers = [row.measured, row.error, *laws, row.deviation_printed, row.deviation_exact]
            known = [repr(float(number)) for number in numbers]
            where = [row.varied.get(key, "") for key in varied]
            writer.writerow([table.name, *where, *known, table.unit])
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


def points_of(dataset: xr.Dataset) -> list[Point]:
    """Return the points of a sweep's grid without laws, the seeds of each taken together.

    If the sweep knows what the sliding limit does under the same random dilations (`CONTROL`), the
    scatter of the dilations is taken out: velocity minus sliding limit, plus its known mean.
    """
    vary: dict[str, list[Any]] = json.loads(dataset.attrs["vary"])
    names = dimensions(vary)
    keys = [key for key in vary if key != SEED]
    shared = {name: _exact(dataset.attrs[name]) for name in _SHARED if name in dataset.attrs}
    found = []
    for places in itertools.product(*(range(len(vary[key])) for key in keys)):
        place = dict(zip(keys, places, strict=True))
        here = dataset.isel({names[key]: index for key, index in place.items()})
        values = {key: vary[key][index] for key, index in place.items()}
        varied = {names[key]: _shown(value) for key, value in values.items()}
        own = {key.rpartition(".")[2]: _exact(value) for key, value in values.items()}
        measured = _over_seeds(here, shared | own)
        found.append(Point(varied, *measured, parameters=shared | own))
    return found


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
    controlled = CONTROL in here and velocity.size > 1
    if controlled:
        known = law_values(laws.sliding_velocity_random, parameters)
        control = np.atleast_1d(here[CONTROL].to_numpy())
        velocity = velocity - control + sum(known) / len(known)
    if controlled or velocity.size >= _FEWEST_SEEDS:
        scatter = float(velocity.std(ddof=1)) if velocity.size > 1 else math.nan
        return float(velocity.mean()), scatter / math.sqrt(velocity.size)
    error = np.atleast_1d(here["velocity_error"].to_numpy())
    return float(velocity.mean()), math.sqrt(float((error**2).sum())) / velocity.size


def with_control(dataset: xr.Dataset, sliding: xr.Dataset) -> xr.Dataset:
    """Return a sweep with the velocities of the sliding limit under the same dilations."""
    about = {**sliding["velocity"].attrs, "long_name": "sliding limit, same random dilations"}
    return dataset.assign({CONTROL: (sliding["velocity"].dims, sliding["velocity"].data, about)})
