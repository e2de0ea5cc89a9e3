"""Contacts: their coefficients, their thresholds, their events.

The k-th contact of a slider (k = 0: the initial one) has its own static coefficient. A coefficient
below `mu_d` acts as `mu_d`: a contact never holds less at rest than in motion. `rules` says when
sliders start and stop.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from fractions import Fraction
from functools import partial
from typing import Any

from numpy.typing import NDArray

from exactcreep.model import keyed_disorder
from exactcreep.model.chain import Chain
from exactcreep.model.enclosure import same
from exactcreep.model.numbers import Scalar, Shown, nearest_float


class EventKind(Enum):
    """A start or a stop.

    Examples
    --------
    >>> EventKind("start").value
    'start'
    """

    START = "start"
    """The sliders begin to slip."""
    STOP = "stop"
    """The sliders come to rest, or reverse."""


@dataclass(frozen=True, eq=False, repr=False)
class Event(Shown):
    """One event of a rearrangement: a set of sliders starts, or stops, at one instant.

    A reversal is a stop and a start at the same time; stops come first. Two events are equal if all
    their numbers are the same; balls, if midpoints and radii are.

    Attributes
    ----------
    time : number
        Since the start of the rearrangement, unit tau_dyn.
    kind : EventKind
        A start or a stop.
    sliders, signs : tuple of int
        Ascending, from 1; direction of motion after a start, before a stop: +1 downhill, -1 uphill.

    Examples
    --------
    >>> start, stop = rearrange(pair, State.relaxed(pair), direction=+1).events
    >>> stop.kind.value, stop.sliders, stop.signs, round(stop.time, 6)
    ('stop', (2,), (1,), 3.141593)
    """

    _units_in_line = True
    time: Scalar
    kind: EventKind
    sliders: tuple[int, ...]
    signs: tuple[int, ...]

    def _units(self) -> dict[str, str]:
        return {"time": "tau_dyn"}

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Event):
            return NotImplemented
        return self.signature == other.signature and same(self.time, other.time)

    def __hash__(self) -> int:
        return hash((float(self.time), *self.signature))

    @property
    def signature(self) -> tuple[str, tuple[int, ...], tuple[int, ...]]:
        """The event without its time: the element of an itinerary."""
        return (self.kind.value, self.sliders, self.signs)


Itinerary = tuple[tuple[str, tuple[int, ...], tuple[int, ...]], ...]
"""The sequence of event signatures of a rearrangement: (kind, sliders, signs)."""


_BLOCK = 16  # contacts of a slider drawn together: as fast as a single draw


class Contacts:
    """The contacts of a chain: coefficients, keyed by `seed`, and thresholds in any arithmetic.

    With ``sigma_mu = 0`` the float64 nearest to a slider's `mu_s` represents this rational. Source:
    Eq. 11.
    """

    def __init__(self, chain: Chain, seed: int = 0) -> None:
        self.chain = chain
        self.seed = seed
        self._mu_d: list[Fraction] = chain.each("mu_d")
        self._mu_s: list[Fraction] = chain.each("mu_s")
        self._mean: list[float] = chain.each("mu_s", nearest_float)
        self._least: list[float] = chain.each("mu_d", _least_from)
        self._drawn: dict[int, tuple[int, list[float]]] = {}  # the last block of each slider
        # cos(alpha) and mu_s cos(alpha)
        self._scales: dict[Any, tuple[Any, Any]] = {}

    def coefficient(self, slider: int, draw: int) -> float | Fraction:
        """Return the static coefficient, as drawn, of contact `draw` (from 0) of `slider`."""
        if self.chain.sigma_mu == 0:
            return self._mu_s[slider - 1]
        block, place = divmod(draw, _BLOCK)
        if self._drawn.get(slider, (-1, []))[0] != block:
            made = keyed_disorder.static_coefficients
            drawn = made(self.chain, self.seed, slider, block * _BLOCK, _BLOCK)
            self._drawn[slider] = block, drawn.tolist()
        return self._drawn[slider][1][place]

    def acting(self, n: int, coefficient: Any) -> Fraction:
        """Return the coefficient that acts at slider `n` (from 0): at least `mu_d`."""
        if self._is_constant(n, coefficient):
            return self._mu_s[n]
        return self._mu_d[n] if self.is_low(n, coefficient) else _rational(coefficient)

    def is_low(self, n: int, coefficient: Any) -> bool:
        """Return whether a coefficient of slider `n` is below its `mu_d`, and acts as `mu_d`."""
        if isinstance(coefficient, float):  # comparing rationals takes ten times as long
            return coefficient < self._least[n]
        return _rational(coefficient) < self._mu_d[n]

    def holds(self, n: int, coefficient: Any, arithmetic: Any) -> Any:
        """Return the force, unit ``m g``, that such a contact of slider `n` holds at rest.

        A ball encloses ``acting(n, coefficient) cos(alpha)``; a float64 is within 1.5 ulp of it.
        """
        if arithmetic not in self._scales:
            self._scales[arithmetic] = (
                arithmetic.times_cosine(self.chain, Fraction(1)),
                self.chain.each("mu_s", partial(arithmetic.times_cosine, self.chain)),
            )
        cosine, means = self._scales[arithmetic]
        if self._is_constant(n, coefficient):
            return means[n]
        if self.is_low(n, coefficient):
            coefficient = self._mu_d[n]
        return arithmetic.number(coefficient) * cosine

    def thresholds(self, coefficients: NDArray[Any], arithmetic: Any) -> NDArray[Any]:
        """Return the forces that contacts with these coefficients hold at rest; see `holds`."""
        each = enumerate(coefficients.tolist())
        held: NDArray[Any] = arithmetic.vector([self.holds(n, c, arithmetic) for n, c in each])
        return held

    def _is_constant(self, n: int, coefficient: Any) -> bool:
        return self.chain.sigma_mu == 0 and float(coefficient) == self._mean[n]


def _least_from(mu_d: Fraction) -> float:
    """Return the smallest float64 that is not below `mu_d`."""
    near = nearest_float(mu_d)
    return near if Fraction(near) >= mu_d else math.nextafter(near, math.inf)


def _rational(coefficient: Any) -> Fraction:
    return coefficient if type(coefficient) is Fraction else Fraction(float(coefficient))
