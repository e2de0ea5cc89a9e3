"""The chain: N sliders and N - 1 springs on an incline, with parameters stored as rationals."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from fractions import Fraction
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any, ParamSpec

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.numbers import (
    InputError,
    Number,
    Shown,
    listed,
    nearest_float,
    number_from_zero,
    number_of_floats,
    positive_number,
    sign_of_surd,
    whole_number,
)
from exactcreep.model.remarks import in_degrees, remark
from exactcreep.model.uniform import END_FORCES, EXPANSION, require_uniform, unlike

P = ParamSpec("P")
_ALONG = "mu_d", "mu_s", "end_forces", "expansion"
ANGLES = {"angle", "alpha", "pitch", "slope", "degrees"}
"""Wrong names for the slope, for which the error message suggests `tan_alpha`."""
_SCOPE = "the page explanation/scope of the book has the limits of the model, and where to begin"
MOST_SLIDERS = 10**6
"""A run takes about a kilobyte of memory for each slider."""


def _without_angles(make: Callable[P, None]) -> Callable[P, None]:
    """Return a constructor whose error says by which name the slope is given."""

    @functools.wraps(make)
    def checked(*args: P.args, **given: P.kwargs) -> None:
        for name in ANGLES & {*given}:
            raise InputError(name, given[name], f"is no parameter: {in_degrees(given[name])}")
        make(*args, **given)

    return checked


@dataclass(frozen=True, kw_only=True, repr=False)
class Chain(Shown):
    """A chain of `n` sliders with Coulomb friction on an incline of slope `tan_alpha`.

    Every parameter is dimensionless and stored as a rational: an int, a `Fraction` or a decimal
    string exactly as written (``"0.6"`` is 3/5), a float as its exact binary value. A list of equal
    numbers becomes one number. A function that needs equal sliders raises `InputError` for a chain
    whose sliders differ; `unlike` says in which respects they do. theta is the thermal dilation of
    the springs, and ``tau_dyn = sqrt(m/k)``. Source: Eqs. 5-10 and 11 of the paper.

    Parameters
    ----------
    n : int
        Number of sliders, from 1 to a million; slider 1 is the upper one if `tan_alpha` > 0.
    l0 : number
        Natural length of a spring at theta = 0 in units of ``g tau_dyn**2``; positive.
    mu_d : number, or sequence of number, shape (n,)
        Dynamical friction coefficient, of all sliders or of each; not negative.
    mu_s : number, or sequence of number, shape (n,)
        Mean static friction coefficient, of all sliders or of each; at least `mu_d`.
    sigma_mu : number
        Standard deviation of the static friction coefficients; not negative.
    tan_alpha : number
        Tangent of the angle of the incline; if negative, slider 1 is the lower one.
    end_forces : two numbers
        Constant forces on the first and on the last slider, unit ``m g``; positive towards the last
        slider, which is downhill if `tan_alpha` > 0.
    expansion : sequence of number, shape (n - 1,), optional
        Expansion of each spring relative to theta: spring k has the natural length
        ``l0 (1 + expansion[k] theta)``. Default: 1 for every spring.

    Raises
    ------
    InputError
        If a parameter is not a number or out of range.

    Examples
    --------
    >>> chain = Chain(n=6, l0=1000, mu_d="0.5", mu_s="0.6", sigma_mu="0.01", tan_alpha="0.25")
    >>> chain.mu_s, chain.sigma_mu, chain.may_run_away
    (Fraction(3, 5), Fraction(1, 100), False)
    """

    n: int
    l0: Fraction
    mu_d: Any  # a Fraction; a tuple of n of them if sliders differ
    mu_s: Any
    sigma_mu: Fraction = Fraction(0)
    tan_alpha: Fraction
    end_forces: tuple[Fraction, Fraction] = (Fraction(0), Fraction(0))
    expansion: tuple[Fraction, ...] = ()  # empty if all springs expand by theta

    @_without_angles
    def __init__(
        self,
        n: Number,
        l0: Number,
        mu_d: Number | Sequence[Number],
        mu_s: Number | Sequence[Number],
        sigma_mu: Number = 0,
        *,
        tan_alpha: Number,
        end_forces: Sequence[Number] = (0, 0),
        expansion: Sequence[Number] = (),
    ) -> None:
        count = whole_number(n, "n", least=1, most=MOST_SLIDERS)
        weights = _each(expansion, "expansion", count - 1, "of each spring (n - 1)")
        vars(self).update(
            n=count,
            l0=number_of_floats(l0, "l0"),
            mu_d=_one_or_each(mu_d, "mu_d", count),
            mu_s=_one_or_each(mu_s, "mu_s", count),
            sigma_mu=number_of_floats(sigma_mu, "sigma_mu"),
            tan_alpha=number_of_floats(tan_alpha, "tan_alpha"),
            end_forces=_each(end_forces, "end_forces", 2, "of each end"),
            expansion=() if all(weight == 1 for weight in weights) else weights,
        )
        positive_number(l0, "l0")
        number_from_zero(sigma_mu, "sigma_mu")
        for k, low, high in frictions(self):
            number_from_zero(low, f"mu_d{k}")
            if high < low:
                allowed = f"must be at least mu_d{k} = {nearest_float(low)}"
                raise InputError(f"mu_s{k}", high, allowed)
            # no draw is 16 standard deviations from the mean
            if not math.isfinite(nearest_float(high + 16 * self.sigma_mu)):
                allowed = "draws coefficients beyond the largest float"
                raise InputError("sigma_mu", sigma_mu, allowed)
        remark("tan_alpha", self.tan_alpha)
        remark("mu_s", largest_mu_s(self))
        remark("sigma_mu", self.sigma_mu)

    @cached_property
    def unlike(self) -> frozenset[str]:
        """The respects in which the chain is not uniform: "friction", "end_forces", "expansion"."""
        return unlike(vars(self))

    def each(self, name: str, function: Callable[[Fraction], Any] = Fraction) -> list[Any]:
        """Return a function of the coefficient of each slider, or of the expansion of each spring.

        Parameters
        ----------
        name : {"mu_d", "mu_s", "expansion"}
            Quantity.
        function : callable, optional
            Called once if all are alike. Default: the rationals themselves.

        Returns
        -------
        list
            n values; n - 1 for `expansion`.
        """
        value, count = getattr(self, name), self.n
        if name == "expansion":
            value, count = value or Fraction(1), self.n - 1
        if isinstance(value, tuple):
            return [function(one) for one in value]
        return [function(value)] * count

    def floats(self, name: str) -> NDArray[np.float64]:
        """Return the coefficient of each slider, or the expansion of each spring, in float64.

        Parameters
        ----------
        name : {"mu_d", "mu_s", "expansion"}
            Quantity.

        Returns
        -------
        ndarray, shape (n,) or (n - 1,)
            Each the nearest float64.
        """
        return np.array(self.each(name, nearest_float))

    @cached_property
    def rates(self) -> dict[int, Fraction]:
        """Change of the force on a slider (from 0) per ``l0 theta``, where it is not zero."""
        if self.n > 1 and not self.expansion:
            return {0: Fraction(-1), self.n - 1: Fraction(1)}
        return rates_of(self.expansion)

    if not TYPE_CHECKING:  # a type checker knows the attributes

        def __getattr__(self, name):
            said = f"{type(self).__name__!r} object has no attribute {name!r}"
            raise AttributeError(said if name.startswith("_") else f"{said}; {_SCOPE}")

    def __hash__(self) -> int:
        return self._hash

    @cached_property
    def _hash(self) -> int:
        return hash(tuple(getattr(self, each.name) for each in fields(self)))

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
        # q / sqrt(p^2 + q^2): 2^-k times an integer square root, with k ample for correct rounding
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
        """mu_d cos(alpha), nearest float64: the dynamical friction force if sliders are alike."""
        require_uniform(self.parameters(), "one friction force of all", {END_FORCES, EXPANSION})
        return self.times_cosine(self.mu_d)

    @cached_property
    def excess(self) -> float:
        """D = (mu_s - mu_d) cos(alpha), nearest float64, if sliders are alike."""
        require_uniform(self.parameters(), "one static excess of all", {END_FORCES, EXPANSION})
        return self.times_cosine(self.mu_s - self.mu_d)

    def pull(self, slider: int) -> Fraction:
        """Return the end force on a slider, unit ``m g``.

        Parameters
        ----------
        slider : int
            From 0.

        Returns
        -------
        Fraction
            Zero except at the ends.
        """
        first, last = self.end_forces
        return (first if slider == 0 else Fraction(0)) + (last if slider == self.n - 1 else 0)

    @cached_property
    def heading(self) -> int:
        """Direction in which weight and end forces drive the chain: +1, -1, or 0 if balanced."""
        pulls, square = sum(self.end_forces), 1 + self.tan_alpha**2
        return sign_of_surd(self.n * self.tan_alpha, pulls, square)

    @cached_property
    def may_run_away(self) -> bool:
        """Whether driving forces exceed all friction, so that the chain may accelerate for ever."""
        return surplus(self, 1) >= 0 or surplus(self, -1) >= 0

    @property
    def slides(self) -> bool:
        """Whether a slider that feels theta follows it without slips: it has no static excess."""
        return any(slider in (self.rates or {0}) for slider in without_excess(self))

    def mirrored(self) -> Chain:
        """Return the mirror image: the incline tilted the other way.

        Returns
        -------
        Chain
            With the opposite `tan_alpha` and end forces, and its lists reversed.
        """
        turned: dict[str, Any] = {name: value[::-1] for name, value in vars(self).items()
                  if name in _ALONG and isinstance(value, tuple)}  # fmt: skip
        turned["end_forces"] = tuple(-force for force in turned["end_forces"])
        return replace(self, tan_alpha=-self.tan_alpha, **turned)

    def parameters(self) -> dict[str, Any]:
        """Return the exact parameters by name; ``Chain(**parameters)`` is the same chain.

        Returns
        -------
        dict of str to int, Fraction or list of Fraction
            `n`, `l0`, `mu_d`, `mu_s`, `sigma_mu` and `tan_alpha`; `end_forces` and `expansion` if
            the chain has them.
        """
        known = {field.name: getattr(self, field.name) for field in fields(self)}
        return {
            name: list(value) if isinstance(value, tuple) else value
            for name, value in known.items()
            if name not in {"end_forces", "expansion"} - self.unlike
        }

    def _facts(self) -> dict[str, Any]:
        return self.parameters()

    def _units(self) -> dict[str, str]:
        return {"l0": "g tau_dyn^2"}


def frictions(chain: Chain) -> Iterator[tuple[str, Fraction, Fraction]]:
    """Yield index, mu_d and mu_s of each slider, or once if all sliders are alike."""
    if "friction" not in chain.unlike:
        yield "", chain.mu_d, chain.mu_s
        return
    for k, (low, high) in enumerate(zip(chain.each("mu_d"), chain.each("mu_s"), strict=True)):
        yield f"[{k}]", low, high


def mean_mu_d(chain: Chain) -> Fraction:
    """Return the mean of the dynamical friction coefficients of all sliders."""
    listed = isinstance(chain.mu_d, tuple)
    return sum(chain.mu_d, Fraction(0)) / chain.n if listed else Fraction(chain.mu_d)


def largest_mu_s(chain: Chain) -> Fraction:
    """Return the largest of the mean static friction coefficients."""
    return max(high for _, _, high in frictions(chain))


def no_advance(chain: Chain) -> Fraction:
    """Return the motion of x_G in a cycle that counts as no advance: 2**-40 of the forces."""
    forces = (largest_mu_s(chain) + abs(chain.tan_alpha)) * Fraction(chain.cos_alpha)
    return (forces + max(map(abs, chain.end_forces))) / 2**40


def rounding_of(chain: Chain) -> Fraction:
    """Return the largest rounding error of a displacement in one slip, in float64."""
    return chain.n * no_advance(chain) / 2**10


def surplus(chain: Chain, way: int) -> int:
    """Return the sign of driving force minus friction of the whole chain, compared exactly.

    It is positive if the sliding chain accelerates along `way` (+1: downhill).
    """
    beyond = chain.n * (way * chain.tan_alpha - mean_mu_d(chain))
    return sign_of_surd(beyond, way * sum(chain.end_forces), 1 + chain.tan_alpha**2)


def first_start(chain: Chain) -> Fraction:
    """Return the least ``l0 abs(theta)`` at which the relaxed chain starts; negative: at once."""
    cosine, held = Fraction(chain.cos_alpha), chain.each("mu_s")
    weight = chain.tan_alpha * cosine
    sliders = range(chain.n) if chain.unlike else chain.rates or (0,)
    rooms: dict[int, Fraction]
    rooms = {k: held[k] * cosine - abs(weight + chain.pull(k)) for k in sliders}
    least = min(rooms.values())
    reached = (rooms[k] / abs(rate) for k, rate in chain.rates.items())
    return least if least < 0 else min(reached, default=least)


def without_excess(chain: Chain) -> list[int]:
    """Return the sliders (from 0) that have neither static excess nor disorder."""
    if chain.sigma_mu != 0 or ("friction" not in chain.unlike and chain.mu_d < chain.mu_s):
        return []
    pairs = zip(chain.each("mu_d"), chain.each("mu_s"), strict=True)
    return [slider for slider, (low, high) in enumerate(pairs) if low == high]


def require_dilation(chain: Chain, theta: Fraction | float, field: str, given: Any) -> None:
    """Raise `InputError`, about what was `given`, unless ``l0 theta`` is far below overflow."""
    finite = isinstance(theta, Fraction) or math.isfinite(theta)
    if not finite or math.isinf(nearest_float(2 * chain.l0 * Fraction(theta))):
        allowed = "must keep l0 theta below half the largest float, 1.8e308"
        raise InputError(field, given, allowed)


def rates_of(expansion: Sequence[Fraction]) -> dict[int, Fraction]:
    """Return `Chain.rates` for springs with these expansions."""
    around = (Fraction(0), *expansion, Fraction(0))
    changes = (left - right for left, right in pairwise(around))
    return {slider: change for slider, change in enumerate(changes) if change}


def _each(values: Any, name: str, count: int, of: str) -> tuple[Fraction, ...]:
    """Return a list of numbers as rationals, none for an empty list, or raise `InputError`."""
    allowed = f"must be a list of {count} numbers, {of}"
    each = listed(values)
    if each is None or len(each) not in (0, count) or (name == "end_forces" and not each):
        raise InputError(name, values, allowed)
    return tuple(number_of_floats(value, f"{name}[{k}]") for k, value in enumerate(each))


def _one_or_each(value: Any, name: str, n: int) -> Any:
    """Return a number as a rational; a list as one rational if all agree, else as a tuple."""
    if listed(value) is None:
        return number_of_floats(value, name)
    each = _each(value, name, n, "of each slider")
    if not each:
        raise InputError(name, value, f"must be one number, or a list of {n}")
    return each if len({*each}) > 1 else each[0]


def refuse_own(given: Mapping[str, Any], further: Collection[str], computation: str) -> None:
    """Raise `InputError` if `further` arguments of a computation name a parameter of a chain."""
    for name in (field.name for field in fields(Chain)):
        if name in further:
            call = f"{computation}(Chain({name}={given[name]!r}, ...), ...)"
            raise InputError(name, given[name], f"belongs to a chain: {call}")
