"""From a solid on a slope, in SI units, to the dimensionless chain, and back."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from exactcreep.laws import LAWS
from exactcreep.model.chain import Chain
from exactcreep.model.numbers import InputError, exact_number, nearest_float, whole_number

STANDARD_GRAVITY = "9.80665"
SECONDS_PER_DAY = 86400
MILLIMETRES_PER_METRE = 1000


@dataclass(frozen=True, kw_only=True)
class Solid:
    """A solid that rests on an incline at equally spaced contacts, and its units as a chain.

    The solid of the given `length` is cut into as many equal pieces as it has contacts, each
    with its contact at the middle: a slider has the mass of one piece, ``m = M/N``, and the spring
    between two contacts is one piece of material, of natural length ``L/N`` and stiffness
    ``k = N Y S/L``. All parameters and the units made from them are exact rationals, except the
    square root in `tau_dyn`.

    Attributes
    ----------
    length, youngs_modulus, density, section : Fraction
        L (m), Y (Pa), rho (kg/m^3), S (m^2).
    kappa : Fraction
        Thermal expansion coefficient, 1/K; less that of the ground if that expands too.
    chain : Chain
        The dimensionless chain, with ``l0 = N Y/(g rho L)``.
    gravity : Fraction
        g (m/s^2).

    Notes
    -----
    Source: the estimate before Eq. (vitessecontinue), ``k = N Y S/L``. The paper also calls the
    distance between the outer contacts L, ``(N - 1) l0``; the two differ by one part in N, and only
    ``L = N l0`` makes Eq. (vitessecontinue) independent of N.
    """

    length: Fraction
    youngs_modulus: Fraction
    density: Fraction
    section: Fraction
    kappa: Fraction
    chain: Chain
    gravity: Fraction

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

    @property
    def force_unit(self) -> Fraction:
        """Unit of force m g, N."""
        return self.mass * self.gravity

    def dilation(self, temperature_change: Any) -> Fraction:
        """Return theta of a temperature change (K), exactly; a cycle's +-dT is +-A_theta."""
        return self.kappa * exact_number(temperature_change, "temperature_change")

    def temperature_change(self, theta: Any) -> Fraction:
        """Return the temperature change (K) of a dilation, exactly."""
        return exact_number(theta, "theta") / self.kappa

    def metres(self, displacement: Any) -> Any:
        """Return a dimensionless displacement (number or array of floats) in metres."""
        return displacement * _unit(self.length_unit, displacement)

    def newtons(self, force: Any) -> Any:
        """Return a dimensionless force (number or array of floats) in newtons."""
        return force * _unit(self.force_unit, force)

    def seconds(self, time: Any) -> Any:
        """Return a dimensionless time (number or array of floats) in seconds."""
        return time * self.tau_dyn

    def millimetres_per_day(self, velocity: Any, period: Any) -> Any:
        """Return a mean velocity in mm/day.

        Parameters
        ----------
        velocity : number or ndarray of float64
            Displacement per half-cycle, as in `Creep.velocity`; positive downhill.
        period : number
            Duration of a whole temperature cycle, s: two half-cycles (86400 for day and night). For
            paths and random temperatures, twice the time from one target to the next; for records,
            whose velocities are per unit of time, 2 if that is the second.
        """
        return velocity * _unit(self._daily(period), velocity)

    def per_half_cycle(self, millimetres_per_day: Any, period: Any) -> Any:
        """Return a velocity in mm/day as a dimensionless displacement per half-cycle."""
        return millimetres_per_day / _unit(self._daily(period), millimetres_per_day)

    def _daily(self, period: Any) -> Fraction:
        """Return what one dimensionless unit per half-cycle is in mm/day."""
        half_cycle = _positive(period, "period") / 2
        return self.length_unit * MILLIMETRES_PER_METRE * SECONDS_PER_DAY / half_cycle

    @property
    def critical_temperature_change(self) -> float:
        """Delta T* (K): the least amplitude of temperature cycles that makes the solid creep.

        The formula after Eq. (vitessecontinue), for a continuous solid; zero or negative means
        that friction does not hold it.
        """
        return float(LAWS["delta_T_star"].printed(kappa=self.kappa, **self._dimensionless()))

    def continuum_velocity(self, temperature_amplitude: Any, period: Any) -> float:
        """Return Eq. (vitessecontinue) in mm/day for temperature cycles; negative below Delta T*.

        Parameters
        ----------
        temperature_amplitude : number
            Half the difference between the highest and the lowest temperature, K.
        period : number
            Of a whole cycle, s.
        """
        amplitude = self.dilation(temperature_amplitude)
        law = LAWS["vitessecontinue"].printed(amplitude=amplitude, **self._dimensionless())
        downhill = -1 if self.chain.tan_alpha < 0 else 1
        return downhill * float(self.millimetres_per_day(float(law), period))

    def _dimensionless(self) -> dict[str, Any]:
        """Return the parameters of the laws; a negative slope is the mirror image."""
        chain = self.chain
        slope = abs(chain.tan_alpha)
        return {"n": chain.n, "l0": chain.l0, "mu_d": chain.mu_d, "tan_alpha": slope}


def physical(
    *,
    length: Any,
    youngs_modulus: Any,
    density: Any,
    section: Any,
    kappa: Any,
    contacts: int,
    mu_d: Any,
    mu_s: Any,
    tan_alpha: Any,
    sigma_mu: Any = 0,
    gravity: Any = STANDARD_GRAVITY,
) -> Solid:
    """Return a solid on a slope with its dimensionless chain (``physical(...).chain``).

    Parameters
    ----------
    length : number
        L along the slope, m.
    youngs_modulus : number
        Y, Pa.
    density : number
        rho, kg/m^3.
    section : number
        Cross section S, m^2. It sets masses and forces; the chain does not depend on it.
    kappa : number
        Thermal expansion coefficient, 1/K.
    contacts : int
        Number N of contacts, at least 1.
    mu_d, mu_s, sigma_mu : number
        Friction coefficients, as in `Chain`.
    tan_alpha : number
        Slope.
    gravity : number
        g, m/s^2.

    Raises
    ------
    InputError
        If a quantity is not a positive number, or the chain's are out of their range.

    Notes
    -----
    Source: Eq. (vitessecontinue) and the text before it: ``k = N Y S/L``, ``tau_dyn = sqrt(m/k)``,
    ``l0 = (L/N)/(g tau_dyn^2) = N Y/(g rho L)``.

    Examples
    --------
    A lead roof of 3 m on 20 contacts, between 5 and 25 degrees every day:

    >>> roof = physical(length=3, youngs_modulus="16e9", density=11340, section="0.003",
    ...                 kappa="29e-6", contacts=20, mu_d="0.5", mu_s="0.6", tan_alpha="0.25")
    >>> round(roof.continuum_velocity(10, 86400), 3)
    0.862
    """
    quantities = {
        "length": _positive(length, "length"),
        "youngs_modulus": _positive(youngs_modulus, "youngs_modulus"),
        "density": _positive(density, "density"),
        "section": _positive(section, "section"),
        "kappa": _positive(kappa, "kappa"),
        "gravity": _positive(gravity, "gravity"),
    }
    per_contact = quantities["youngs_modulus"] / (
        quantities["gravity"] * quantities["density"] * quantities["length"]
    )
    n = whole_number(contacts, "contacts", least=1)
    chain = Chain(n, n * per_contact, mu_d, mu_s, sigma_mu, tan_alpha=tan_alpha)
    return Solid(chain=chain, **quantities)


def solid_of(
    chain: Chain,
    *,
    youngs_modulus: Any,
    density: Any,
    section: Any,
    kappa: Any,
    gravity: Any = STANDARD_GRAVITY,
) -> Solid:
    """Return the solid of the given material that a dimensionless chain stands for.

    Its length is ``L = N Y/(g rho l0)``; parameters are those of `physical`.

    Raises
    ------
    InputError
        If a quantity is not a positive number.
    """
    if not isinstance(chain, Chain):
        raise InputError("chain", chain, "must be a Chain")
    modulus = _positive(youngs_modulus, "youngs_modulus")
    mass_density = _positive(density, "density")
    g = _positive(gravity, "gravity")
    return Solid(
        length=chain.n * modulus / (g * mass_density * chain.l0),
        youngs_modulus=modulus,
        density=mass_density,
        section=_positive(section, "section"),
        kappa=_positive(kappa, "kappa"),
        chain=chain,
        gravity=g,
    )


def _positive(value: Any, field: str) -> Fraction:
    number = exact_number(value, field)
    if number <= 0:
        raise InputError(field, value, "must be positive")
    return number


def _unit(unit: Fraction, like: Any) -> Any:
    """Return the unit as a rational for rationals, as a float for everything else."""
    return unit if isinstance(like, (int, Fraction)) else nearest_float(unit)
