"""How far a solid or a pipeline moved in a run of its chain, in millimetres."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.numbers import InputError, Number, in_full, nearest_float, shown
from exactcreep.model.outcome import Outcome
from exactcreep.model.result import Result
from exactcreep.quasistatic.creep import creep
from exactcreep.quasistatic.creep_result import Creep
from exactcreep.records.temperature_record import TemperatureRecord

if TYPE_CHECKING:
    import xarray as xr

DAYS_PER_YEAR = Fraction(1461, 4)
FRICTION = (Fraction(9, 10), Fraction(1), Fraction(11, 10))
"""Default factors on all friction for which the rate of a descent is computed."""
DAY, MILLIMETRES = 86400, 1000  # seconds in a day, millimetres in a metre
_BLOCK = 10  # days: longer than weather lasts
_FEWEST_YEARS = 5
_SHOWN = 6  # cycles whose walk is printed, the first of many


@dataclass(frozen=True, eq=False, repr=False)
class Walk(Result):
    """How far a solid on a slope, or a pipeline, moved: in millimetres.

    Attributes
    ----------
    body : Solid or Pipeline
    run : Creep
        A run of its chain.
    time_unit : float
        Seconds in one unit of the clock of its drive; nan if unknown, as of a pipeline.
    steps : int
        Targets of a cycle before the last one: the steps of a heating.

    Examples
    --------
    >>> walk = roof.creep(Cycles(roof.dilation(10), cycles=5), time_unit=43200)
    >>> f"{walk.total:.2f} mm in {walk.days:g} days"
    '5.76 mm in 5 days'
    >>> pipe = pipeline(length=1000, axial_stiffness="2e9", submerged_weight=400, friction="0.5",
    ...                 end_tension="5e4", kappa="1.17e-5")
    >>> pipe.walk([70, 50], cycles=2).finding
    '127.5 mm in the last of 4 cycles, 634.9 mm in all'
    """

    body: Any
    run: Creep
    time_unit: float = math.nan
    steps: int = 1

    def __post_init__(self) -> None:
        chain = self.body.chain
        if self.run.chain != chain:
            raise InputError("run", self.run.chain, "must be a run of the chain of the body")
        if self.run.outcome is Outcome.RUNAWAY:
            slope = f"tan_alpha = {nearest_float(chain.tan_alpha):.3g}"
            allowed = f"must exceed {slope}, or the solid slides down at once"
            raise InputError("mu_d", chain.mu_d, allowed)

    @property
    def _has_clock(self) -> bool:
        return not math.isnan(self.time_unit)

    @property
    def _solid(self) -> Any:
        if self._has_clock:
            return self.body
        raise InputError("body", self.body, "must be a solid, for a rate per year")

    def _in_millimetres(self, moved: Any) -> Any:
        return MILLIMETRES * scaled(moved, Fraction(self.body.length_unit))

    def _recorded(self, name: str) -> NDArray[np.float64]:
        if name not in self.run.recorded:
            raise InputError("record", self.run.experiment.record, f"must hold {name}")
        return np.asarray(self.run.recorded[name].astype(float))

    @property
    def millimetres(self) -> NDArray[np.float64]:
        """Displacement of the middle at each target, mm, shape (targets,); needs x_G or x."""
        if "x" in self.run.recorded and "x_G" not in self.run.recorded:
            return np.asarray(self.displacement.mean(axis=1))
        return np.asarray(self._in_millimetres(self._recorded("x_G")))

    @property
    def displacement(self) -> NDArray[np.float64]:
        """Displacement of each slider at each target, mm downhill, shape (targets, n)."""
        return np.asarray(self._in_millimetres(self._recorded("x")))

    @property
    def axial_force(self) -> NDArray[np.float64]:
        """Axial force at the upper end, in the springs, at the lower end, N: (targets, n + 1)."""
        tension = self._recorded("tension") * float(self.body.force_unit)
        ends = np.ones((len(tension), 1))
        upper, lower = map(nearest_float, getattr(self.body, "end_forces", (0, 0)))
        return np.hstack([-upper * ends, tension, lower * ends])

    @property
    def per_cycle(self) -> NDArray[np.float64]:
        """Advance of the middle in each whole cycle, mm; the first starts when the body is laid."""
        return np.diff(self.millimetres[self.steps :: self.steps + 1], prepend=0.0)

    @property
    def total(self) -> float:
        """Displacement of the middle at the end, mm."""
        return float(self._in_millimetres(self.run.x_G))

    @property
    def temperatures(self) -> NDArray[np.float64]:
        """Temperature at each target: of a record in its unit, else above theta = 0."""
        drive, reached = self.run.drive, self.run.half_cycles
        if isinstance(drive, TemperatureRecord):
            return drive.temperatures[:reached]
        return drive.targets(1, reached, self.run.seed) / nearest_float(self.body.kappa)

    @property
    def elapsed(self) -> NDArray[np.float64]:
        """Days from the start to each target that was reached, shape (targets,)."""
        ticks = self.run.drive.clock(np.arange(self.run.half_cycles + 1))
        days: NDArray[np.float64] = (ticks[1:] - ticks[0]) * self.time_unit
        return days / DAY

    @property
    def days(self) -> float:
        """Days to the last target that was reached."""
        return float(self.elapsed[-1]) if self.run.half_cycles else 0.0

    @property
    def finding(self) -> str:
        """The last cycle of a pipeline and all of them, or how far a solid came in so many days."""
        if not self._has_clock:
            last, cycles = in_full(self.per_cycle[-1], 4), len(self.per_cycle)
            return f"{last} mm in the last of {cycles} cycles, {in_full(self.total, 4)} mm in all"
        return f"{in_full(self.total, 4)} mm in {in_full(self.days, 4)} days"

    @cached_property
    def dataset(self) -> xr.Dataset:
        """The walk along ``target``, as far as the run recorded it; the summary is in ``attrs``."""
        columns, known = dict[str, Any](), {*self.run.recorded, *["clock"] * self._has_clock, ""}
        for name, needed, across, unit in (
            ("temperatures", "", "spring", "K or as recorded"),
            ("elapsed", "clock", "", "days"),
            ("millimetres", "x_G x", "", "mm"),
            ("displacement", "x", "slider", "mm"),
            ("axial_force", "tension", "place", "N"),
        ):
            if known & {*needed.split(" ")}:
                values = getattr(self, name)
                columns[name] = (("target", across)[: values.ndim], values, {"units": unit})
        return super().dataset.assign(columns)

    @cached_property
    def rates(self) -> Mapping[tuple[int, Fraction], float]:
        """Millimetres per year in the sliding limit, by `contacts` and `Solid.friction`."""
        rates, drive, seed = {}, self.run.drive, self.run.seed
        for contacts, factor in product(self.contacts, self.body.friction):
            body = self.body.altered(contacts=contacts, friction=factor)
            run = creep(body.chain, drive, seed=seed, solver="sliding", record=())
            rates[contacts, factor] = float(body.per_year(run.velocity, self.time_unit))
        return rates

    @property
    def interval(self) -> tuple[float, float]:
        """Millimetres per year on many contacts, at both ends of the friction: least and most."""
        _, many = self.contacts
        least, most = sorted(self.rates[many, factor] for factor in self.body.friction[::2])
        return least, most

    @property
    def millimetres_per_year(self) -> float:
        """Mean velocity of the run, mm per year of 365.25 days."""
        return float(self._solid.per_year(self.run.velocity, self.time_unit))

    def stretches(self, days: Number) -> NDArray[np.float64]:
        """Return the descents in whole stretches of so many days, mm; none without x_G.

        Parameters
        ----------
        days : number
            Length of a stretch.

        Returns
        -------
        ndarray
            One number for each whole stretch.
        """
        ends = np.arange(int(self.days / float(days)) + 1) * float(days)
        if "x_G" not in self.run.recorded:
            return np.empty(0)
        return np.asarray(np.diff(np.interp(ends, self.elapsed, self.millimetres)))

    @property
    def _weather(self) -> float:
        """Standard deviation of the descent between years, mm; of few years from blocks of days."""
        years, blocks = self.stretches(DAYS_PER_YEAR), self.stretches(_BLOCK)
        if years.size >= _FEWEST_YEARS:
            return float(years.std(ddof=1))
        if blocks.size < _FEWEST_YEARS:
            return math.nan
        spread = float(np.square(np.diff(blocks)).mean())
        return math.sqrt(float(DAYS_PER_YEAR) / _BLOCK * spread / 2)

    @property
    def contacts(self) -> tuple[int, int]:
        """The numbers of contacts of `rates`: the solid's own, and enough or twice as many."""
        n, many = self._solid.chain.n, self._solid.converged_contacts
        return n, many if n < many else 2 * n

    @property
    def _artefact(self) -> float:
        """Relative difference of the rate to the rate on many contacts; nan if nothing moves."""
        few, many = (self.rates[contacts, Fraction(1)] for contacts in self.contacts)
        return few / many - 1 if few and many else math.nan

    def _numbers(self) -> dict[str, Any]:
        if not self._has_clock:
            return {
                "cycles": len(self.per_cycle), "millimetres": self.per_cycle,
                "total": self.total, "solver": self.run.solver,
            }  # fmt: skip
        rates = [
            {
                "contacts": n,
                "friction_factor": float(factor),
                "mu_d": nearest_float(factor * self.body.chain.mu_d),
                "millimetres_per_year": rate,
            }
            for (n, factor), rate in self.rates.items()
        ]
        return (
            {"days": self.days, "millimetres_per_year": self.millimetres_per_year}
            | {"contacts": self.body.chain.n}
            | {"weather": self._weather, "rates": rates}
            | {"millimetres": self.total, "artefact_of_contacts": self._artefact}
            | {"measured_millimetres_per_year": float(self.body.measured) or math.nan}
        )

    def lines(self) -> list[tuple[str, str]]:
        """Return the walk as pairs of a name and a sentence; of a solid, with its uncertainty.

        Returns
        -------
        list of (str, str)
            As the command line prints them.
        """
        if not self._has_clock:
            each = [f"{mm:.4g}" for mm in self.per_cycle[:_SHOWN]]
            each += ["..."] * (len(self.per_cycle) > _SHOWN)
            return [("walk", self.finding), ("  cycle by cycle", f"{', '.join(each)} mm")]
        few, many = self.contacts
        chain, sliding = self.body.chain, self.run.solver == "sliding"
        low, _, high = self.body.friction
        between = " to ".join(in_full(self.rates[many, each], 4) for each in (high, low))
        ends = " to ".join(f"{nearest_float(each * chain.mu_d):.4g}" for each in (high, low))
        between += f" mm/year for mu_d from {ends}"
        if math.isinf(self.rates[many, low]):
            between += ", which does not hold the solid"
        rate = f"{in_full(self.millimetres_per_year, 4)} mm/year"
        if self.body.measured:
            rate += f"; measured: {in_full(float(self.body.measured), 4)} mm/year"
        if self.days < 360:
            rate += ", for these days, not for a year"
        said = {
            "descent": f"{between} (sliding limit, N = {many})",
            "middle": f"{self.finding} with mu_d = {in_full(float(chain.mu_d), 3)}: {rate}",
        }
        if math.isfinite(self._artefact):
            more = in_full(round(100 / (1 + self._artefact) - 100, 7), 2, "+")
            said["contacts"] = (
                f"{more} % with N = {many} instead of {few}; the pivot is a whole slider;"
                f" N = {self.body.converged_contacts} is enough"
            )
        said["solid"] = (
            f"E = {float(self.body.youngs_modulus) / 1e9:g}e9 Pa, density"
            f" {float(self.body.density):g} kg/m^3, kappa = {float(self.body.kappa) * 1e6:g}e-6 /K"
        )
        if math.isfinite(self._weather):
            of = "years of this record" if self.days > _FEWEST_YEARS * 366 else "10-day blocks"
            differs = f"one year differs from another by {in_full(self._weather, 2)} mm"
            said["weather"] = f"{differs} (standard deviation, from the {of})"
        if sliding and not chain.slides:
            unused = f"mu_s = {shown(chain.mu_s)}, sigma_mu = {shown(chain.sigma_mu)} and the seed"
            said["left out"] = f"{unused} have no effect in the sliding limit"
        elif not sliding and chain.sigma_mu:
            said["disorder"] = "one seed alone; other seeds tell how much it matters"
        return list(said.items())

    def _facts(self) -> dict[str, str]:
        return dict(self.lines())

    def __repr__(self) -> str:
        return "\n".join(f"{name.strip()}: {said}" for name, said in self.lines())


def scaled(number: Any, unit: Fraction) -> Any:
    return number * (unit if isinstance(number, (int, Fraction)) else nearest_float(unit))
