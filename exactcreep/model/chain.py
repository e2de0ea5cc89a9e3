"""The chain: N sliders and N - 1 springs on an incline, its parameters kept as rationals."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, fields, replace
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, Any, ParamSpec

import numpy as np

from exactcreep.model.numbers import (
    InputError,
    Number,
    Shown,
    nearest_float,
    number_from_zero,
    number_of_floats,
    positive_number,
    whole_number,
)

P = ParamSpec("P")
ANGLES = {"angle", "alpha", "pitch", "slope", "degrees"}
"""Names under which the slope is looked for."""
_SCOPE = "the page explanation/scope of the book says what is not in the model, and where to begin"


def in_degrees(angle: Any) -> str:
    """Return what the slope of an angle is called, and what it is where the angle is a number."""
    degrees = angle if isinstance(angle, (int, float)) and abs(angle) < 90 else 15
    slope = math.tan(math.radians(degrees))
    return f"tan_alpha is the slope, the tangent of the angle: {slope:.3g} for {degrees:g} degrees"


def _without_angles(make: Callable[P, None]) -> Callable[P, None]:
    """Return a constructor that says by which name the slope is given."""

    @functools.wraps(make)
    def checked(*args: P.args, **given: P.kwargs) -> None:
        for name in ANGLES & {*given}:
            raise InputError(name, given[name], f"is no parameter: {in_degrees(given[name])}")
        make(*args, **given)

    return checked


@dataclass(frozen=True, kw_only=True, repr=False)
class Chain(Shown):
    """A chain of `n` sliders with Coulomb friction on an incline of slope `tan_alpha`.

    Every parameter is dimensionless and kept as a rational: an int, a `Fraction` and a decimal
    string are what they say (``"0.6"`` is 3/5), a float is its exact binary value.

    Source: Eqs. 5-10 and 11.

    Parameters
    ----------
    n : int
        Number of sliders, at least 1; slider 1 is the upper one.
    l0 : number
        Natural length of a spring at theta = 0 in units of ``g tau_dyn**2``; positive.
    mu_d : number
        Dynamical friction coefficient; not negative.
    mu_s : number
        Mean static friction coefficient, at least `mu_d`.
    sigma_mu : number
        Standard deviation of the static friction coefficients; not negative.
    tan_alpha : number
        Tangent of the angle of the incline; negative is the mirror image.

    Raises
    ------
    InputError
        If a parameter is not a number or out of its range.

    Examples
    --------
    >>> chain = Chain(n=6, l0=1000, mu_d="0.5", mu_s="0.6", sigma_mu="0.01", tan_alpha="0.25")
    >>> chain.mu_s, chain.sigma_mu, chain.may_run_away
    (Fraction(3, 5), Fraction(1, 100), False)
    """

    n: int
    l0: Fraction
    mu_d: Fraction
    mu_s: Fraction
    sigma_mu: Fraction = Fraction(0)
    tan_alpha: Fraction

    @_without_angles
    def __init__(
        self,
        n: Number,
        l0: Number,
        mu_d: Number,
        mu_s: Number,
        sigma_mu: Number = 0,
        *,
        tan_alpha: Number,
    ) -> None:
        numbers: dict[str, Any] = {
            "l0": l0, "mu_d": mu_d, "mu_s": mu_s, "sigma_mu": sigma_mu, "tan_alpha": tan_alpha
        }  # fmt: skip
        for name, value in numbers.items():
            if isinstance(value, (list, tuple, np.ndarray)):
                raise InputError(name, value, f"must be one number for all sliders; {_SCOPE}")
        vars(self).update(
            n=whole_number(n, "n", least=1, most=10**8),
            **{name: number_of_floats(value, name) for name, value in numbers.items()},
        )
        positive_number(l0, "l0")
        number_from_zero(mu_d, "mu_d")
        if self.mu_s < self.mu_d:
            raise InputError("mu_s", mu_s, f"must be at least mu_d = {nearest_float(self.mu_d)}")
        number_from_zero(sigma_mu, "sigma_mu")
        # no draw lies 16 standard deviations off
        if not math.isfinite(nearest_float(self.mu_s + 16 * self.sigma_mu)):
            raise InputError("sigma_mu", sigma_mu, "draws coefficients beyond the largest float")

    if not TYPE_CHECKING:  # a type checker knows the attributes

        def __getattr__(self, name):
            said = f"{type(self).__name__!r} object has no attribute {name!r}"
            raise AttributeError(said if name.startswith("_") else f"{said}; {_SCOPE}")

    def __hash__(self) -> int:
        return self._hash

    @cached_property
    def _hash(self) -> int:
        # the hash of a Fraction would take a modular inverse
        return hash(tuple(value.as_integer_ratio() for value in self.parameters().values()))

    def times_cosine(self, value: Fraction) -> float:
        """Return ``value * cos(alpha)`` as the nearest float64 (error below 0.5000001 ulp).

        Parameters
        ----------
        value : Fraction
            Any rational.

        Returns
        -------
        float
            The product, rounded once.
        """
        top, bottom = self._cosine
        return value.numerator * top / (value.denominator * bottom)

    @cached_property
    def _cosine(self) -> tuple[int, int]:
        p, q = self.tan_alpha.numerator, self.tan_alpha.denominator
        # q / sqrt(p^2 + q^2): 2^-k of an integer square root, k ample for a correct rounding
        bits = 256 + max((p * p + q * q).bit_length(), 1)
        return q << bits, math.isqrt((p * p + q * q) << (2 * bits))

    @cached_property
    def cos_alpha(self) -> float:
        """cos(alpha), nearest float64."""
        return self.times_cosine(Fraction(1))

    @cached_property
    def sin_alpha(self) -> float:
        """sin(alpha), nearest float64: the weight of a slider along the incline."""
        return self.times_cosine(self.tan_alpha)

    @cached_property
    def friction(self) -> float:
        """mu_d cos(alpha), nearest float64: the dynamical friction force."""
        return self.times_cosine(self.mu_d)

    @cached_property
    def excess(self) -> float:
        """D = (mu_s - mu_d) cos(alpha), nearest float64."""
        return self.times_cosine(self.mu_s - self.mu_d)

    @property
    def no_advance(self) -> Fraction:
        """By how much x_G may move in a cycle that has not advanced it: 2**-40 of the forces."""
        return (self.mu_s + abs(self.tan_alpha)) * Fraction(self.cos_alpha) / 2**40

    @property
    def rounding(self) -> Fraction:
        """The most that rounding adds to a displacement in one slip, in float64."""
        return self.n * self.no_advance / 2**10

    @property
    def may_run_away(self) -> bool:
        """Whether the whole chain may accelerate for ever: |tan_alpha| >= mu_d, as rationals."""
        return abs(self.tan_alpha) >= self.mu_d

    @property
    def slides(self) -> bool:
        """Whether sliders follow theta without slips: no static excess, and no disorder."""
        return self.mu_s == self.mu_d and self.sigma_mu == 0

    def mirrored(self) -> Chain:
        """Return the mirror image: the incline tilted the other way.

        Returns
        -------
        Chain
            With the opposite `tan_alpha`, and otherwise the same.

        Examples
        --------
        >>> chain = Chain(3, 1000, "0.5", "0.6", "0.01", tan_alpha="0.25")
        >>> chain.mirrored().tan_alpha
        Fraction(-1, 4)
        """
        return replace(self, tan_alpha=-self.tan_alpha)

    def require_dilation(self, theta: Fraction | float, field: str, given: Any) -> None:
        """Raise `InputError` unless ``l0 theta`` is below half the largest float.

        Parameters
        ----------
        theta : Fraction or float
            A dilation.
        field : str
            How the user calls it.
        given : object
            What the user gave.

        Raises
        ------
        InputError
            Unless it is.
        """
        finite = isinstance(theta, Fraction) or math.isfinite(theta)
        if not finite or math.isinf(nearest_float(2 * self.l0 * Fraction(theta))):
            allowed = "must keep l0 theta below half the largest float, 1.8e308"
            raise InputError(field, given, allowed)

    def parameters(self) -> dict[str, int | Fraction]:
        """Return the parameters by name, exactly; ``Chain(**parameters)`` is the chain again.

        Returns
        -------
        dict of str to int or Fraction
            `n`, `l0`, `mu_d`, `mu_s`, `sigma_mu` and `tan_alpha`.
        """
        return {field.name: getattr(self, field.name) for field in fields(self)}

    def _facts(self) -> dict[str, Any]:
        return self.parameters()

    def _units(self) -> dict[str, str]:
        return {"l0": "g tau_dyn^2"}


def refuse_own(given: Mapping[str, Any], further: Collection[str], computation: str) -> None:
    """Raise `InputError` for a parameter of a chain among `further` arguments of a computation."""
    for name in (field.name for field in fields(Chain)):
        if name in further:
            call = f"{computation}(Chain({name}={given[name]!r}, ...), ...)"
            raise InputError(name, given[name], f"belongs to a chain: {call}")
