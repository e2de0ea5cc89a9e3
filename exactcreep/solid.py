"""Convert a solid on a slope, in SI units, to the dimensionless chain, and results back."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exactcreep.laws import pivots, solid_velocity, threshold_amplitude
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Drive
from exactcreep.model.numbers import (
    InputError,
    Number,
    Shown,
    exact_number,
    in_full,
    nearest_float,
    number_from_zero,
    plain_data,
    positive_number,
    refusing,
    shown,
    whole_number,
)
from exactcreep.model.outcome import Outcome
from exactcreep.model.remarks import remark
from exactcreep.model.uniform import require_uniform
from exactcreep.quasistatic.creep import creep
from exactcreep.quasistatic.creep_result import Creep
from exactcreep.records.temperature_record import TemperatureRecord

DAYS_PER_YEAR = Fraction(1461, 4)
FRICTION = (Fraction(9, 10), Fraction(1), Fraction(11, 10))
"""Default factors on all friction for which the rate of a descent is computed."""
_DAY, _MILLIMETRES = 86400, 1000  # seconds in a day, millimetres in a metre
_CONTACTS = 100  # times mu_d/tan_alpha: then the next pivot changes the rate by 2 %
_BLOCK = 10  # days: longer than weather lasts
_FEWEST_YEARS = 5


class Material(NamedTuple):
    """A material: thermal expansion (1/K), Young's modulus (Pa), density (kg/m^3)."""

    kappa: str
    youngs_modulus: str
    density: str
    source: str


_TABLES = "Kaye and Laby, Tables of Physical and Chemical Constants; rounded, quoted from memory"
MATERIALS = {
    "lead": Material("29e-6", "16e9", "11340", _TABLES),
    "copper": Material("16.7e-6", "130e9", "8930", _TABLES),
    "zinc": Material("30e-6", "108e9", "7130", f"{_TABLES}; alloys for roofs expand less, 22e-6"),
    "steel": Material("12e-6", "210e9", "7850", "EN 1993-1-1, 3.2.6; quoted from memory"),
}
"""Materials by name, near room temperature. Subtract kappa of the ground if it expands too."""


@dataclass(frozen=True, kw_only=True, repr=False)
class Solid(Shown):
    """A solid that rests on an incline at equally spaced contacts, and its units as a chain.

    The solid is cut into N equal pieces, each with a contact at its middle.

    Attributes
    ----------
    length, youngs_modulus, density, section, kappa, gravity, measured : Fraction
        As in `physical`.
    friction : tuple of Fraction
        Least, middle and largest factor on all friction; an interval of `mu_d` has its middle as
        unit.
    chain : Chain
        The dimensionless chain, with ``l0 = N Y/(g rho L)``. Times are in units of `tau_dyn`,
        forces in units of ``mass * gravity``.

    Examples
    --------
    >>> f"{roof.tau_dyn:.2g} s, {roof.critical_temperature_change:.2g} K"
    '0.00025 s, 0.052 K'
    """

    length: Fraction
    youngs_modulus: Fraction
    density: Fraction
    section: Fraction
    kappa: Fraction
    chain: Chain
    gravity: Fraction
    measured: Fraction = Fraction(0)
    friction: tuple[Fraction, Fraction, Fraction] = FRICTION
    units_in_line = True

    @refusing
    def __post_init__(self) -> None:
        require_uniform(self.chain.parameters(), "a solid in SI units")

    def _units(self) -> dict[str, str]:
        return {
            "length": "m", "youngs_modulus": "Pa", "density": "kg/m^3", "section": "m^2",
            "kappa": "1/K", "gravity": "m/s^2", "measured": "mm per year",
        }  # fmt: skip

    @property
    def mass(self) -> Fraction:
        """m = rho S L/N of one slider, kg."""
        return self.density * self.section * self.length / self.chain.n

    @property
    def stiffness(self) -> Fraction:
        """k = N Y S/L of one spring, N/m."""
        return self.chain.n * self.youngs_modulus * self.section / self.length

    @property
    def tau_dyn(self) -> float:
        """Unit of time sqrt(m/k), s."""
        return math.sqrt(self.mass / self.stiffness)

    @property
    def length_unit(self) -> Fraction:
        """Unit of length g tau_dyn^2, m."""
        return self.gravity * self.mass / self.stiffness

    def dilation(self, temperature_change: Number) -> Fraction:
        """Return theta of a temperature change (K), exactly; a cycle's +-dT is +-A_theta.

        Parameters
        ----------
        temperature_change : number
            In K.

        Returns
        -------
        Fraction
            Dimensionless.

        Raises
        ------
        InputError
            If it is not a number.
        """
        return self.kappa * exact_number(temperature_change, "temperature_change")

    def metres(self, displacement: Any) -> Any:
        """Return a dimensionless displacement (number or array of floats) in metres.

        Parameters
        ----------
        displacement : number or ndarray
            Unit ``g tau_dyn**2``.

        Returns
        -------
        number or ndarray
            In m.
        """
        return _times(displacement, self.length_unit)

    def millimetres_per_day(self, velocity: Any, period: Number) -> Any:
        """Return a velocity per half-cycle in mm/day; a `period` (s) is two half-cycles.

        Parameters
        ----------
        velocity : number or ndarray
            Unit ``g tau_dyn**2`` per half-cycle.
        period : number
            Of a whole cycle, in s.

        Returns
        -------
        number or ndarray
            In mm/day.
        """
        daily = self.length_unit * _MILLIMETRES * _DAY * 2 / positive_number(period, "period")
        return _times(velocity, daily)

    def per_year(self, velocity: float, time_unit: Number) -> float:
        """Return a velocity per unit of a drive's clock in mm per year.

        Parameters
        ----------
        velocity : float
            Unit ``g tau_dyn**2`` per unit of the clock.
        time_unit : number
            Of the clock, in s.

        Returns
        -------
        float
            In mm per year.
        """
        daily = self.millimetres_per_day(Fraction(1), 2 * positive_number(time_unit, "time_unit"))
        return float(velocity) * nearest_float(daily * DAYS_PER_YEAR)

    @property
    def critical_temperature_change(self) -> float:
        """Delta T* (K) of Eq. 26: larger cycles creep; <= 0: the solid slides by itself."""
        known = self._dimensionless() | {"l0": self.chain.l0 * self.kappa}
        return float(threshold_amplitude(**known))

    def continuum_velocity(self, temperature_amplitude: Number, period: Number) -> float:
        """Return the velocity by Eq. 25 in mm/day, for cycles of +-amplitude.

        Parameters
        ----------
        temperature_amplitude : number
            In K.
        period : number
            Of a whole cycle, in s.

        Returns
        -------
        float
            In mm/day, positive downhill.
        """
        amplitude = self.dilation(temperature_amplitude)
        law = float(solid_velocity(amplitude=amplitude, **self._dimensionless()))
        downhill = -1 if self.chain.tan_alpha < 0 else 1
        return downhill * float(self.millimetres_per_day(law, period))

    def _dimensionless(self) -> dict[str, Any]:
        chain, slope = self.chain, abs(self.chain.tan_alpha)
        return {"n": chain.n, "l0": chain.l0, "mu_d": chain.mu_d, "tan_alpha": slope}

    def altered(self, *, contacts: int | None = None, friction: Number = 1) -> Solid:
        """Return the same solid with another number of contacts, and a factor on all friction.

        Parameters
        ----------
        contacts : int, optional
            Default: unchanged.
        friction : number, optional
            Factor on all coefficients, positive.

        Returns
        -------
        Solid
            A new solid.

        Raises
        ------
        InputError
            If a number is out of range.
        """
        chain, factor = self.chain, positive_number(friction, "friction")
        n = chain.n if contacts is None else whole_number(contacts, "contacts", least=1)
        coefficients = (factor * mu for mu in (chain.mu_d, chain.mu_s, chain.sigma_mu))
        other = Chain(n, n * chain.l0 / chain.n, *coefficients, tan_alpha=chain.tan_alpha)
        return replace(self, chain=other)

    @property
    def converged_contacts(self) -> int:
        """Number of contacts above which more contacts change the rate by 1 or 2 % at most."""
        slope = abs(self.chain.tan_alpha)
        if not 0 < slope < self.chain.mu_d:
            return _CONTACTS
        wanted: int = math.ceil(_CONTACTS * self.chain.mu_d / slope)
        return min(max(wanted, _CONTACTS), 2000)

    def time_unit_of(self, temperatures: Drive, time_unit: Number | None = None) -> float:
        """Return the seconds in one unit of a drive's clock; refuse what `creep` refuses.

        Parameters
        ----------
        temperatures : Drive
            The drive of the solid.
        time_unit : number, optional
            As in `creep`.

        Returns
        -------
        float
            In s.

        Raises
        ------
        InputError
            If the unit is missing or not wanted, or the record has another kappa.
        """
        if not isinstance(temperatures, Drive):
            raise InputError("temperatures", temperatures, "must be a TemperatureRecord or a drive")
        temperatures.require_one_dilation("a solid in SI units")
        kappa = getattr(temperatures, "kappa", self.kappa)
        if kappa != self.kappa:
            raise InputError("kappa", kappa, f"must be the solid's, {self.kappa}")
        dated = temperatures.dates is not None
        if not dated and time_unit is None:
            allowed = f"must be given: seconds per {temperatures.per}, where there are no dates"
            raise InputError("time_unit", time_unit, allowed)
        seconds = positive_number(1 if time_unit is None else time_unit, "time_unit")
        if dated and seconds != 1:
            raise InputError("time_unit", time_unit, "must be left out: the record has dates")
        return nearest_float(seconds)

    def creep(
        self,
        temperatures: Drive,
        *,
        time_unit: Number | None = None,
        solver: str = "sliding",
        seeds: int = 0,
        **options: Any,
    ) -> Descent:
        """Return how far the solid creeps under these temperatures, and its uncertainty.

        Parameters
        ----------
        temperatures : TemperatureRecord or other drive
            A record with the solid's own kappa, or dilations, as of ``dilation(10)``.
        time_unit : number, optional
            Seconds in one unit of a record's times, or from one target of another drive to the next
            (43200 for day and night); not for dates.
        solver : str
            As for `exactcreep.creep`. In the sliding limit `mu_s`, `sigma_mu` and the seed have no
            effect.
        seeds : int
            Number of further runs with other seeds, to see the effect of disorder.
        **options
            As for `exactcreep.creep`.

        Returns
        -------
        Descent
            In millimetres.

        Raises
        ------
        InputError
            If an argument is out of range, or a seed would have no effect.
        """  # fmt: skip
        self.time_unit_of(temperatures, time_unit)  # raises before the run
        for name, given in {"seeds": seeds, "seed": options.get("seed")}.items():
            if given and solver == "sliding" and not temperatures.random:
                allowed = "has no effect in the sliding limit, which has no static friction"
                raise InputError(name, given, allowed)
        result = creep(self.chain, temperatures, solver=solver, **options)
        return Descent.of(self, result, time_unit, seeds=seeds)


@dataclass(frozen=True, eq=False, repr=False)
class Descent:
    """How far a solid crept under temperatures in time, in millimetres.

    Attributes
    ----------
    solid : Solid
    result : Creep
    time_unit : float
        Seconds in one unit of the clock of its temperatures.
    of_seeds : tuple of float
        Millimetres per year of runs like `result` with further seeds.

    Examples
    --------
    >>> descent = roof.creep(Cycles(roof.dilation(10), cycles=5), time_unit=43200)
    >>> f"{descent.total:.2f} mm in {descent.days:g} days"
    '5.76 mm in 5 days'
    """

    solid: Solid
    result: Creep
    time_unit: float
    of_seeds: tuple[float, ...] = ()

    @classmethod
    @refusing
    def of(
        cls, solid: Solid, result: Creep, time_unit: Number | None = None, *, seeds: int = 0
    ) -> Descent:
        """Return the descent for a run of this solid's chain.

        Parameters
        ----------
        solid : Solid
            The solid that crept.
        result : Creep
            A run of its chain.
        time_unit, seeds : number, int, optional
            As in `Solid.creep`.

        Returns
        -------
        Descent
            With its further runs.

        Raises
        ------
        InputError
            If the run is of another chain.
        """
        seconds, own = solid.time_unit_of(result.drive, time_unit), result.experiment
        if result.chain != solid.chain:
            raise InputError("result", result.chain, "must be a run of the solid's chain")
        if result.outcome is Outcome.RUNAWAY:
            slope = f"tan_alpha = {nearest_float(solid.chain.tan_alpha):.3g}"
            allowed = f"must exceed {slope}, or the solid slides down at once"
            raise InputError("mu_d", solid.chain.mu_d, allowed)
        count = whole_number(seeds, "seeds", least=0)

        made = cls(solid, result, seconds)
        further = [(own.seed + k) % 2**64 for k in range(1, 1 + count)]
        about = {"start": own.start, **own.options}
        of_seeds = tuple(made._rate(solid, seed, own.solver, **about) for seed in further)
        return replace(made, of_seeds=of_seeds)

    def _rate(self, solid: Solid, seed: int, solver: str, **about: Any) -> float:
        drive = self.result.drive
        run = creep(solid.chain, drive, seed=seed, solver=solver, record=(), **about)
        return solid.per_year(run.velocity, self.time_unit)

    @cached_property
    def rates(self) -> Mapping[tuple[int, Fraction], float]:
        """Millimetres per year in the sliding limit, by `contacts` and `Solid.friction`."""
        return {
            (contacts, factor): self._rate(
                self.solid.altered(contacts=contacts, friction=factor), self.result.seed, "sliding"
            )
            for contacts, factor in product(self.contacts, self.solid.friction)
        }

    @property
    def interval(self) -> tuple[float, float]:
        """Millimetres per year on many contacts, at both ends of the friction: least and most."""
        _, many = self.contacts
        ends = [self.rates[many, factor] for factor in self.solid.friction[::2]]
        return min(ends), max(ends)

    @property
    def temperatures(self) -> NDArray[np.float64]:
        """Temperature at each target: of a record in its unit, else above theta = 0."""
        drive, reached = self.result.drive, self.result.half_cycles
        if isinstance(drive, TemperatureRecord):
            return drive.temperatures[:reached]
        return drive.targets(1, reached, self.result.seed) / nearest_float(self.solid.kappa)

    @property
    def elapsed(self) -> NDArray[np.float64]:
        """Days from the start to each target that was reached, shape (targets,)."""
        ticks = self.result.drive.clock(np.arange(self.result.half_cycles + 1))
        days: NDArray[np.float64] = (ticks[1:] - ticks[0]) * self.time_unit
        return days / _DAY

    @property
    def days(self) -> float:
        """Days to the last target that was reached."""
        return float(self.elapsed[-1]) if self.result.half_cycles else 0.0

    @property
    def millimetres(self) -> NDArray[np.float64]:
        """Displacement of the centre of mass at each target, mm; needs a recorded x_G."""
        if "x_G" not in self.result.recorded:
            raise InputError("record", self.result.experiment.record, "must hold x_G")
        moved = self.solid.metres(self.result.recorded["x_G"].astype(float))
        return np.asarray(_MILLIMETRES * moved)

    @property
    def total(self) -> float:
        """Displacement of the centre of mass at the end, mm."""
        return float(_MILLIMETRES * self.solid.metres(self.result.x_G))

    @property
    def millimetres_per_year(self) -> float:
        """Mean velocity of the run, mm per year of 365.25 days."""
        return self.solid.per_year(self.result.velocity, self.time_unit)

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
        if "x_G" not in self.result.recorded:
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
    def disorder(self) -> float:
        """The standard deviation between seeds, mm per year; nan for a single seed."""
        rates = (self.millimetres_per_year, *self.of_seeds)
        return float(np.std(rates, ddof=1)) if self.of_seeds else math.nan

    @property
    def contacts(self) -> tuple[int, int]:
        """The numbers of contacts of `rates`: the solid's own, and enough or twice as many."""
        n, many = self.solid.chain.n, self.solid.converged_contacts
        return n, many if n < many else 2 * n

    @property
    def _pivot_step(self) -> float:
        """Relative jump of the descent when the pivot moves by one contact."""
        chain = self.solid.chain
        if not 0 < abs(chain.tan_alpha) < chain.mu_d:
            return math.nan
        found = pivots(chain.n, abs(chain.tan_alpha), chain.mu_d)
        highest = max(chain.n + 3 - 2 * i for i in found)
        return 2 / highest if highest > 0 else math.inf

    @property
    def _artefact(self) -> float:
        """Relative difference of the rate to the rate on many contacts."""
        few, many = self.contacts
        return self.rates[few, Fraction(1)] / self.rates[many, Fraction(1)] - 1

    def summary(self) -> dict[str, Any]:
        """Return the numbers by name, ready for JSON; None for numbers that are not finite.

        Returns
        -------
        dict
            For `json.dumps`.
        """
        names = ("days", "millimetres_per_year", "disorder")
        rates = [
            {"contacts": n, "friction": float(factor), "millimetres_per_year": rate}
            for (n, factor), rate in self.rates.items()
        ]
        return plain_data(
            {name: getattr(self, name) for name in names}
            | {"weather": self._weather, "pivot_step": self._pivot_step, "rates": rates}
            | {"millimetres": self.total, "artefact_of_contacts": self._artefact}
            | {"measured_millimetres_per_year": float(self.solid.measured) or math.nan}
        )

    def lines(self) -> list[tuple[str, str]]:
        """Return the descent and its uncertainty, as pairs of a name and a sentence.

        Returns
        -------
        list of (str, str)
            As the command line prints them.
        """
        few, many = self.contacts
        chain, sliding = self.solid.chain, self.result.solver == "sliding"
        step = 100 * self._pivot_step
        less, same, more = (self.rates[many, factor] for factor in self.solid.friction)
        rate = f"{in_full(self.millimetres_per_year, 4)} mm/year"
        if self.solid.measured:
            rate += f"; measured: {in_full(float(self.solid.measured), 4)} mm/year"
        if self.days < 360:
            rate += ", for these days, not for a year"
        coefficient = f"with mu_d = {in_full(float(chain.mu_d), 3)}"
        total = f"{in_full(self.total, 4)} mm in {in_full(self.days, 4)} days {coefficient}: {rate}"
        said = {
            "descent": total,
            "friction": f"{_percent(more / same)} where friction is 10 % more,"
            f" {_percent(less / same)} where it is 10 % less (sliding limit, N = {many})",
            "contacts": f"{_percent(1 / (1 + self._artefact))} with N = {many} instead of {few};"
            f" the pivot is a whole slider, and the next one is worth {in_full(step, 2)} %;"
            f" N = {self.solid.converged_contacts} is enough",
        }
        if self.solid.friction != FRICTION:
            low, high = (nearest_float(self.solid.friction[k] * chain.mu_d) for k in (0, 2))
            least, most = self.interval
            between = f"{in_full(least, 4)} to {in_full(most, 4)} mm/year"
            between += f" for mu_d from {high:.4g} to {low:.4g}"
            if most == math.inf:
                between = f"{in_full(least, 4)} mm/year for mu_d = {high:.4g}, without bound for"
                between += f" {low:.4g}, which does not hold the solid"
            del said["friction"]
            said = {"descent": f"{between} (sliding limit, N = {many})", "middle": total} | {
                name: text for name, text in said.items() if name != "descent"
            }
        said["solid"] = (
            f"E = {_engineering(self.solid.youngs_modulus)} Pa, density"
            f" {_engineering(self.solid.density)} kg/m^3, kappa ="
            f" {_engineering(self.solid.kappa)} /K"
        )
        if math.isfinite(self._weather):
            of = "years of this record" if self.days > _FEWEST_YEARS * 366 else "10-day blocks"
            differs = f"one year differs from another by {in_full(self._weather, 2)} mm"
            said["weather"] = f"{differs} (standard deviation, from the {of})"
        if self.of_seeds:
            seeds = f"{in_full(self.disorder, 2)} mm/year between {1 + len(self.of_seeds)} seeds"
            said["disorder"] = f"{seeds} (standard deviation)"
        elif sliding and not chain.slides:
            unused = f"mu_s = {shown(chain.mu_s)}, sigma_mu = {shown(chain.sigma_mu)} and the seed"
            said["left out"] = f"{unused} have no effect in the sliding limit"
        elif not sliding and chain.sigma_mu:
            said["disorder"] = "one seed alone; Solid.creep(seeds=4) runs four more"
        return list(said.items())

    def __repr__(self) -> str:
        return "\n".join(f"{name}: {said}" for name, said in self.lines())


def _left_out(value: object) -> bool:
    """Return whether a quantity has its default 0, so that the material's value holds."""
    return isinstance(value, (int, float)) and value == 0


def physical(
    *,
    length: Number,
    section: Number,
    mu_d: Number | Sequence[Number],
    mu_s: Number | Sequence[Number],
    tan_alpha: Number,
    material: str = "",
    youngs_modulus: Number = 0,
    density: Number = 0,
    kappa: Number = 0,
    contacts: int = 0,
    sigma_mu: Number = 0,
    gravity: Number = "9.80665",
    measured: Number = 0,
) -> Solid:
    """Return a solid on a slope with its dimensionless chain (``physical(...).chain``).

    Source: Eq. 25 of the paper and the text before it: ``k = N Y S/L``, ``tau_dyn = sqrt(m/k)``,
    ``l0 = (L/N)/(g tau_dyn^2) = N Y/(g rho L)``.

    Parameters
    ----------
    length : number
        L along the slope, m.
    section : number
        Cross section S, m^2. It does not affect the descent.
    mu_d, mu_s : number or pair of numbers
        Friction coefficients. A pair is the lower and upper end of an interval; the chain has its
        middle. `Descent.interval` has the descents per year at both ends of `mu_d`, with all
        friction scaled by the same factor.
    tan_alpha : number
        Slope, the tangent of the angle: 0.268 for 15 degrees.
    material : str
        ``lead``, ``copper``, ``zinc`` or ``steel``: gives the modulus, the density and kappa that
        are left out; see `MATERIALS`.
    youngs_modulus : number
        Y, Pa.
    density : number
        rho, kg/m^3.
    kappa : number
        Thermal expansion of the solid minus thermal expansion of the ground, 1/K.
    contacts : int
        Number N of contacts. Default 0: `Solid.converged_contacts`; more contacts change the
        descent by at most 2 %.
    sigma_mu : number
        Standard deviation of the static coefficients, as in `Chain`.
    gravity : number
        g, m/s^2.
    measured : number
        A measured descent to compare with, mm/year.

    Returns
    -------
    Solid
        With its `chain`.

    Raises
    ------
    InputError
        If a quantity is not a positive number, or a parameter of the chain is out of range.

    Examples
    --------
    A lead roof of 3 m, between 5 and 25 degrees every day; its velocity in mm/day:

    >>> roof = physical(length=3, youngs_modulus="16e9", density=11340, section="0.003",
    ...                 kappa="29e-6", contacts=20, mu_d="0.5", mu_s="0.6", tan_alpha="0.25")
    >>> round(roof.continuum_velocity(10, 86400), 3)
    0.862
    """
    quantities = {"length": length, "youngs_modulus": youngs_modulus, "density": density,
             "section": section, "kappa": kappa, "gravity": gravity}  # fmt: skip
    if material:
        if material not in MATERIALS:
            allowed = f"must be one of {', '.join(MATERIALS)}, or be left out"
            raise InputError("material", material, allowed)
        properties = MATERIALS[material]._asdict()
        left_out = {name for name, value in quantities.items() if _left_out(value)}
        quantities |= {name: properties[name] for name in left_out & properties.keys()}
    for name in ("youngs_modulus", "density", "kappa"):
        if _left_out(quantities[name]):
            allowed = f"must be positive, or the value of a material: {', '.join(MATERIALS)}"
            raise InputError(name, quantities[name], allowed)
    mu_d, friction = _middle(mu_d, "mu_d")
    mu_s, _ = _middle(mu_s, "mu_s")
    exact = {name: positive_number(value, name) for name, value in quantities.items()}
    remark("kappa", exact["kappa"])
    n = whole_number(contacts, "contacts", least=0)
    beside = number_from_zero(measured, "measured")
    l0 = exact["youngs_modulus"] / (exact["gravity"] * exact["density"] * exact["length"])
    chain = Chain(n or 1, (n or 1) * l0, mu_d, mu_s, sigma_mu, tan_alpha=tan_alpha)
    solid = Solid(**exact, chain=chain, measured=beside, friction=friction)
    return solid if n else solid.altered(contacts=solid.converged_contacts)


def _middle(
    given: Number | Sequence[Number], name: str
) -> tuple[Number, tuple[Fraction, Fraction, Fraction]]:
    """Return the middle of an interval of a coefficient, and its ends relative to the middle."""
    if not isinstance(given, (list, tuple)):
        return given, FRICTION  # type: ignore[return-value]
    ends = [positive_number(end, name) for end in given]
    if len(ends) != 2 or ends[0] > ends[1]:
        raise InputError(name, given, "must be a number, or the lower and the upper end")
    middle = (ends[0] + ends[1]) / 2
    return middle, (ends[0] / middle, Fraction(1), ends[1] / middle)


_ROUNDING = 1e-9  # relative: smaller differences count as none


def _engineering(value: Fraction) -> str:
    """Return a number with a power of a thousand: 16e9, 29e-6, 11340."""
    power = 3 * math.floor(math.log10(value) / 3)
    return (
        f"{float(value):g}"
        if power in (0, 3)
        else f"{float(value / Fraction(10) ** power):g}e{power}"
    )


def _percent(ratio: float) -> str:
    if abs(ratio - 1) < _ROUNDING:
        return "0 %"
    return f"{in_full(100 * (ratio - 1), 2, '+')} %" if math.isfinite(ratio) else "without bound"


def _times(number: Any, unit: Fraction) -> Any:
    return number * (unit if isinstance(number, (int, Fraction)) else nearest_float(unit))
