"""Drives: the sequence of dilations theta that the chain follows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from fractions import Fraction
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from exactcreep.model import keyed_disorder
from exactcreep.model.chain import Chain, rates_of
from exactcreep.model.numbers import (
    InputError,
    Number,
    Shown,
    nearest_float,
    number_from_zero,
    refusing,
    whole_number,
)

MOST_TARGETS = 10**12
"""Larger numbers are a mistake; up to here float64 holds the number of a target exactly."""


@dataclass(frozen=True)
class Leg:
    """A ramp on which each spring has its own dilation, from `begin` to `end`.

    A solver follows it as a chain with this `expansion`, and theta from 0 to 1.
    """

    begin: tuple[Fraction, ...]
    end: tuple[Fraction, ...]

    def at(self, part: Any, number: Callable[[Fraction], Any]) -> list[Any]:
        """Return the dilation of each spring after this part of the way, as a `number`."""
        if part == 1:
            return [number(b) for b in self.end]
        ends = zip(self.begin, self.end, strict=True)
        return [number(a) + part * number(b - a) for a, b in ends]

    def expansion(self, chain: Chain) -> tuple[Fraction, ...]:
        """Return the expansion of each spring of a chain over the whole way."""
        ends = zip(chain.each("expansion"), self.begin, self.end, strict=True)
        return tuple(weight * (b - a) for weight, a, b in ends)

    @staticmethod
    def kept(leg: Leg | None) -> list[list[Fraction]]:
        """Return a leg for a snapshot: an empty list if there is none."""
        return [] if leg is None else [list(leg.begin), list(leg.end)]

    @classmethod
    def restored(cls, kept: Any, chain: Chain) -> Leg | None:
        """Return a leg of a chain from a snapshot, or raise `ValueError`."""
        if kept == []:
            return None
        springs = [Fraction] * (chain.n - 1)
        if not isinstance(kept, list) or any([*map(type, end)] != springs for end in kept):
            raise ValueError("it holds no leg")
        begin, end = map(tuple, kept)
        return cls(begin, end)

    def mirrors(self, chain: Chain) -> bool:
        """Return whether a chain that is the mirror image of itself stays so."""
        expansion = self.expansion(chain)
        return expansion == expansion[::-1]

    def rates(self, chain: Chain) -> dict[int, Fraction]:
        """Return the change of forces over the whole way, divided by l0; see `Chain.rates`."""
        return rates_of(self.expansion(chain))


@dataclass(frozen=True, repr=False)
class Drive(Shown):
    """A sequence of targets theta_1, theta_2, ...; between them theta ramps monotonically.

    Targets are numbered from 1; before the first theta is 0 (or the theta of the given start). Your
    own subclass needs `target_count` and `targets`; a run stores its `Targets`.

    Attributes
    ----------
    kind : str
        Its name in a scene.
    cyclic, random : bool
        Whether it repeats two targets, and whether its targets depend on the seed.
    per : str
        Unit of `clock`, and of time in a velocity.

    Examples
    --------
    >>> Targets(["0.001", "-0.002"]).exact_target(2)
    Fraction(-1, 500)
    """

    kind: ClassVar[str]
    cyclic: ClassVar[bool] = False
    random: ClassVar[bool] = False
    per: ClassVar[str] = "target"

    @property
    def target_count(self) -> int:
        """Number of targets."""
        raise NotImplementedError

    @property
    def springs(self) -> int:
        """Number of springs with their own dilation at each target; 0: all have the same."""
        return 0

    def leg(self, q: int, start: Any) -> Leg | None:
        """Return the way to target q if each spring has its own dilation.

        Parameters
        ----------
        q : int
            Number of the target, from 1.
        start : number or ndarray
            The dilation at which the chain starts.

        Returns
        -------
        Leg or None
            From the previous target, or from the start.
        """
        return None

    def targets(self, first: int, count: int, seed: int = 0) -> NDArray[np.float64]:
        """Return theta_first .. theta_(first + count - 1) as float64, shape (count,).

        Parameters
        ----------
        first : int
            Number of the first target, from 1.
        count : int
            Number of targets.
        seed : int, optional
            Seed of random dilations.

        Returns
        -------
        ndarray, shape (count,)
            Dimensionless.
        """
        raise NotImplementedError

    def exact_target(self, q: int, seed: int = 0) -> Fraction:
        """Return theta_q exactly.

        Parameters
        ----------
        q : int
            Number of the target, from 1.
        seed : int, optional
            Seed of random dilations.

        Returns
        -------
        Fraction
            Dimensionless.
        """
        return Fraction(float(self.targets(q, 1, seed)[0]))

    def clock(self, targets: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the times of targets, in units of `per`, same shape; target 0 is the start.

        Parameters
        ----------
        targets : ndarray of int
            Numbers of targets.

        Returns
        -------
        ndarray
            Of the same shape.
        """
        return targets.astype(np.float64)

    @property
    def dates(self) -> NDArray[np.datetime64] | None:
        """Dates of the targets, shape (target_count,); None unless a record has dates."""
        return None

    def parameters(self) -> dict[str, Any]:
        """Return the parameters of the drive by their names in a scene, `kind` first.

        Returns
        -------
        dict
            Enough to make the drive again.
        """
        made_from = {field.name: getattr(self, field.name) for field in fields(self)}
        lists = {name: list(value) for name, value in made_from.items() if type(value) is tuple}
        return {"kind": self.kind, **made_from, **lists}

    def _facts(self) -> dict[str, Any]:
        facts = self.parameters()
        del facts["kind"]
        return facts


def require_one_dilation(drive: Drive, what: str) -> None:
    """Raise `InputError`, about `what`, if each spring has its own dilation."""
    if drive.springs:
        allowed = f"must hold numbers, the dilation of all springs, for {what}"
        raise InputError("drive.theta", f"lists of {drive.springs}", allowed)


@dataclass(frozen=True, repr=False)
class Cycles(Drive):
    """Temperature cycles: theta goes to +A, then to -A; this is repeated `cycles` times.

    Parameters
    ----------
    amplitude : number
        Largest dilation A: the thermal expansion coefficient times half the difference between the
        highest and the lowest temperature; not negative, exact.
    cycles : int
        At least 1.

    Examples
    --------
    >>> Cycles(amplitude="0.01", cycles=2).targets(first=1, count=4)
    array([ 0.01, -0.01,  0.01, -0.01])
    """

    amplitude: Fraction
    cycles: int
    kind: ClassVar[str] = "cycles"
    cyclic: ClassVar[bool] = True
    per: ClassVar[str] = "half-cycle"

    def __init__(self, amplitude: Number, cycles: Number) -> None:
        vars(self).update(
            amplitude=number_from_zero(amplitude, "amplitude"),
            cycles=whole_number(cycles, "cycles", least=1, most=MOST_TARGETS),
        )

    @property
    def target_count(self) -> int:
        return 2 * self.cycles

    def targets(self, first: int, count: int, seed: int = 0) -> NDArray[np.float64]:
        q = np.arange(first, first + count)
        return np.where(q % 2 == 1, 1.0, -1.0) * nearest_float(self.amplitude)

    def exact_target(self, q: int, seed: int = 0) -> Fraction:
        return self.amplitude if q % 2 == 1 else -self.amplitude


@dataclass(frozen=True, repr=False)
class GaussianSteps(Drive):
    """Random temperatures: theta_q drawn independently from a normal distribution, `steps` times.

    Source: Eq. 12. theta_q is keyed by (seed, q); see `exactcreep.disorder.dilations`.

    Parameters
    ----------
    sigma_theta : number
        Standard deviation, dimensionless, not negative.
    steps : int
        At least 1.

    Examples
    --------
    >>> GaussianSteps(sigma_theta="0.01", steps=3).targets(1, 3, seed=5).round(4)
    array([ 0.0057, -0.002 , -0.0074])
    """

    sigma_theta: Fraction
    steps: int
    kind: ClassVar[str] = "gaussian"
    random: ClassVar[bool] = True

    def __init__(self, sigma_theta: Number, steps: Number) -> None:
        vars(self).update(
            sigma_theta=number_from_zero(sigma_theta, "sigma_theta"),
            steps=whole_number(steps, "steps", least=1, most=MOST_TARGETS),
        )

    @property
    def target_count(self) -> int:
        return self.steps

    def targets(self, first: int, count: int, seed: int = 0) -> NDArray[np.float64]:
        return dilations(self, seed, first, count)


@refusing
def dilations(drive: GaussianSteps, seed: int, first: int, count: int) -> NDArray[np.float64]:
    """Return the random dilations theta_q, q = first .. first + count - 1, exactly; Eq. 12.

    Parameters
    ----------
    drive : GaussianSteps
        Provides the standard deviation.
    seed : int
        Seed of the drive.
    first, count : int
        The first target, from 1, and the number of targets.

    Returns
    -------
    ndarray, shape (count,)
        The dilations.

    Raises
    ------
    InputError
        If a number is out of range.

    Examples
    --------
    >>> dilations(GaussianSteps("0.01", 3), seed=5, first=1, count=2).round(4)
    array([ 0.0057, -0.002 ])
    """
    first = whole_number(first, "first", least=1, most=2**62)
    seed, width = keyed_disorder.valid_seed(seed), nearest_float(drive.sigma_theta)
    stream = keyed_disorder.STREAM_DILATION
    return np.asarray(width * keyed_disorder.deviates(seed, stream, 0, first, count)[0])
