"""Convert a solid on a slope, in SI units, to the dimensionless chain, and results back."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any, NamedTuple

from exactcreep.laws import solid_velocity, threshold_amplitude
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Drive, require_one_dilation
from exactcreep.model.numbers import (
    InputError,
    Number,
    Shown,
    exact_number,
    nearest_float,
    number_from_zero,
    positive_number,
    whole_number,
)
from exactcreep.model.remarks import remark
from exactcreep.model.uniform import require_uniform
from exactcreep.quasistatic.creep import creep
from exactcreep.walk import DAY, DAYS_PER_YEAR, FRICTION, MILLIMETRES, Walk, scaled

_CONTACTS = 100  # times mu_d/tan_alpha: then the next pivot changes the rate by 2 %


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
    _units_in_line = True

    def __post_init__(self) -> None:
        if not isinstance(self.chain, Chain):
            raise InputError("chain", self.chain, "must be a Chain")
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
    def force_unit(self) -> Fraction:
        """Unit of force m g, N."""
        return self.mass * self.gravity

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
        return scaled(displacement, self.length_unit)

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
        daily = self.length_unit * MILLIMETRES * DAY * 2 / positive_number(period, "period")
        return scaled(velocity, daily)

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
        require_one_dilation(temperatures, "a solid in SI units")
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
        **options: Any,
    ) -> Walk:
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
        **options
            As for `exactcreep.creep`.

        Returns
        -------
        Walk
            In millimetres.

        Raises
        ------
        InputError
            If an argument is out of range, or a seed would have no effect.
        """  # fmt: skip
        seconds = self.time_unit_of(temperatures, time_unit)  # raises before the run
        if (seed := options.get("seed")) and solver == "sliding" and not temperatures.random:
            allowed = "has no effect in the sliding limit, which has no static friction"
            raise InputError("seed", seed, allowed)
        result = creep(self.chain, temperatures, solver=solver, **options)
        return Walk(self, result, seconds)


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
        middle. `Walk.interval` has the descents per year at both ends of `mu_d`, with all
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
    if not isinstance(material, str) or material not in ("", *MATERIALS):
        allowed = f"must be one of {', '.join(MATERIALS)}, or be left out"
        raise InputError("material", material, allowed)
    if material:
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
