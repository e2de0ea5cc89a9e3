"""Coulomb's numbers: the static coefficients of every contact, and the forces at which it yields.

The k-th contact of a slider (k = 0: the one it begins with) has a static coefficient of its own,
which is drawn when the slider stops. One drawn below `mu_d` acts as `mu_d`: a contact never holds
less at rest than in motion.
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from exactcreep.model import disorder
from exactcreep.model.chain import Chain
from exactcreep.model.numbers import nearest_float


class Field(Protocol):
    """What thresholds ask of an arithmetic."""

    def number(self, value: Any) -> Any:
        """Return a number of this arithmetic."""
        ...

    def vector(self, values: Iterable[Any]) -> NDArray[Any]:
        """Return numbers of this arithmetic as a vector."""
        ...

    def times_cosine(self, chain: Chain, value: Fraction) -> Any:
        """Return ``value cos(alpha)``; in float64 rounded once."""
        ...


class Contacts:
    """The contacts of a chain: coefficients and thresholds, in any arithmetic.

    Parameters
    ----------
    chain : Chain
    seed : int
        Keys the coefficients that are drawn.

    Notes
    -----
    With ``sigma_mu = 0`` the float64 nearest to `mu_s` stands for the rational `mu_s`; another
    coefficient that a `State` begins with is what it is. Source: Eq. (dist_mud).
    """

    def __init__(self, chain: Chain, seed: int = 0) -> None:
        self.chain = chain
        self.seed = seed
        self._mean = nearest_float(chain.mu_s)
        self._scales: dict[Field, tuple[Any, Any]] = {}  # cos(alpha) and mu_s cos(alpha)

    def coefficient(self, slider: int, draw: int) -> float | Fraction:
        """Return the static coefficient, as drawn, of contact `draw` (from 0) of `slider` (from 1).

        A float64 is the value exactly; with ``sigma_mu = 0`` it is the rational `mu_s`.
        """
        return disorder.static_coefficient(self.chain, self.seed, slider, draw)

    def coefficients(self, slider: int, first: int, count: int) -> NDArray[np.float64]:
        """Return the coefficients of contacts ``first .. first + count - 1``, shape (count,)."""
        return disorder.static_coefficients(self.chain, self.seed, slider, first, count)

    def acting(self, coefficient: Any) -> Fraction:
        """Return the coefficient that acts in a contact with this one: never below `mu_d`."""
        if self._is_constant(coefficient):
            return self.chain.mu_s
        return max(_rational(coefficient), self.chain.mu_d)

    def is_low(self, coefficient: Any) -> bool:
        """Return whether a drawn coefficient lies below `mu_d`, and therefore acts as `mu_d`."""
        return _rational(coefficient) < self.chain.mu_d

    def threshold(self, slider: int, draw: int, arithmetic: Field) -> Any:
        """Return the force, unit ``m g``, that contact `draw` of `slider` holds: see `holds`."""
        return self.holds(self.coefficient(slider, draw), arithmetic)

    def holds(self, coefficient: Any, arithmetic: Field) -> Any:
        """Return the force, unit ``m g``, that a contact with this coefficient holds at rest.

        Guarantee: in balls it encloses ``acting(coefficient) cos(alpha)``; in float64 it is
        within 1.5 ulp of it.
        """
        if arithmetic not in self._scales:
            self._scales[arithmetic] = (
                arithmetic.times_cosine(self.chain, Fraction(1)),
                arithmetic.times_cosine(self.chain, self.chain.mu_s),
            )
        cosine, mean = self._scales[arithmetic]
        if self._is_constant(coefficient):
            return mean
        return arithmetic.number(self.acting(coefficient)) * cosine

    def thresholds(self, coefficients: NDArray[Any], arithmetic: Field) -> NDArray[Any]:
        """Return the forces that contacts with these coefficients hold at rest; see `holds`."""
        if type(arithmetic.number(0)) is not float:
            return arithmetic.vector([self.holds(c, arithmetic) for c in coefficients.tolist()])
        drawn = coefficients.astype(np.float64)
        held = np.maximum(drawn, nearest_float(self.chain.mu_d)) * self.chain.cos_alpha
        if self.chain.sigma_mu == 0:
            held[drawn == self._mean] = self.chain.times_cosine(self.chain.mu_s)
        return np.asarray(held)

    def _is_constant(self, coefficient: Any) -> bool:
        """Return whether `coefficient` stands for `mu_s`."""
        return self.chain.sigma_mu == 0 and float(coefficient) == self._mean

    def excesses(
        self, coefficients: NDArray[np.float64], low: NDArray[np.float64] | float = 0.0
    ) -> NDArray[np.float64]:
        """Return by how much static friction can exceed dynamical friction, unit ``m g``.

        Parameters
        ----------
        coefficients : ndarray of float64
            As drawn.
        low : ndarray of float64 or float
            What has to be added to them.

        Notes
        -----
        In float64, and with the roundings of the compiled solver, whose thresholds are
        ``chain.friction`` plus these.
        """
        mu_d, mu_d_low = self._floor
        excess = np.maximum(((coefficients - mu_d) - mu_d_low) + low, 0.0) * self.chain.cos_alpha
        if self.chain.sigma_mu == 0:
            excess[coefficients == self._mean] = self.chain.excess
        return np.asarray(excess)

    @cached_property
    def _floor(self) -> tuple[float, float]:
        """mu_d, as two floats."""
        high = nearest_float(self.chain.mu_d)
        return high, nearest_float(self.chain.mu_d - Fraction(high))


def _rational(coefficient: Any) -> Fraction:
    return coefficient if isinstance(coefficient, Fraction) else Fraction(float(coefficient))
