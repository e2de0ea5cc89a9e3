"""Drives whose targets are listed: one dilation of all springs at each, or one of each spring."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.drive import Drive, Leg
from exactcreep.model.numbers import (
    InputError,
    Number,
    exact_number,
    listed,
    nearest_float,
    refusing,
    whole_number,
)


@dataclass(frozen=True, repr=False)
class Listed(Drive):
    """A drive whose targets are listed one by one, exactly: numbers, or one for each spring."""

    theta: tuple[Any, ...]

    @property
    def target_count(self) -> int:
        return len(self.theta)

    @property
    def springs(self) -> int:
        first = self.theta[0]
        return len(first) if isinstance(first, tuple) else 0

    @cached_property
    def _floats(self) -> NDArray[np.float64]:
        if self.springs:
            return np.array([[nearest_float(value) for value in row] for row in self.theta])
        return np.array([nearest_float(value) for value in self.theta])

    def targets(self, first: int, count: int, seed: int = 0) -> NDArray[np.float64]:
        return self._floats[first - 1 : first - 1 + count].copy()

    def exact_target(self, q: int, seed: int = 0) -> Any:
        return self.theta[q - 1]

    def parameters(self) -> dict[str, Any]:
        targets = [list(target) for target in self.theta] if self.springs else [*self.theta]
        return super().parameters() | {"theta": targets}

    def leg(self, q: int, start: Any) -> Leg | None:
        if not self.springs:
            return None
        if q > 1:
            return Leg(self.theta[q - 2], self.theta[q - 1])
        given = start.tolist() if isinstance(start, np.ndarray) else [start] * self.springs
        begin = tuple(exact_number(value, "start.theta") for value in given)
        return Leg(begin, self.theta[0])


@dataclass(frozen=True, repr=False)
class Targets(Listed):
    """A given sequence of dilations.

    Parameters
    ----------
    theta : sequence of numbers, or of sequences of n - 1 numbers
        At least one target; each number is kept exactly. A target is the dilation of all springs,
        or a list of one for each. From target to target all dilations change in proportion.

    Examples
    --------
    >>> Targets(["0.001", 0, "-1/300"]).theta
    (Fraction(1, 1000), Fraction(0, 1), Fraction(-1, 300))

    A warm front that passes along a level chain of three sliders moves it towards slider 1:

    >>> front = Targets([["0.001", 0], ["0.001", "0.001"], [0, "0.001"], [0, 0]])
    >>> round(creep(Chain(3, 1000, "0.5", "0.6", tan_alpha=0), front).x_G, 4)
    -0.1833
    """

    theta: tuple[Any, ...]
    kind: ClassVar[str] = "path"

    def __init__(self, theta: Iterable[Number] | Iterable[Sequence[Number]]) -> None:
        vars(self).update(theta=targets_of(theta))

    @classmethod
    @refusing
    def of(cls, drive: Drive, seed: int = 0) -> Targets:
        """Return the targets of a drive of somebody's own class, which files cannot make again.

        Parameters
        ----------
        drive : Drive
            Any drive.
        seed : int, optional
            Of random dilations.

        Returns
        -------
        Targets
            The same targets, exactly.

        Raises
        ------
        InputError
            If there are more than a million, or it has a clock of its own.
        """
        name = type(drive).__name__
        if type(drive).clock is not Drive.clock or drive.dates is not None:
            raise InputError("drive", name, "must count its time in targets, as a path does")
        count = whole_number(drive.target_count, "drive.target_count", least=1, most=10**6)
        return cls(drive.exact_target(q, seed) for q in range(1, count + 1))


def targets_of(theta: Any) -> tuple[Any, ...]:
    """Return listed targets as rationals, or as tuples where springs differ; see `Targets`."""
    given = listed(theta)
    if given is None:
        raise InputError("theta", theta, "must be a list of numbers")
    values = tuple(_target(value, f"theta[{i}]") for i, value in enumerate(given))
    if not values:
        raise InputError("theta", [], "must hold at least one number")
    widths = [len(value) if isinstance(value, tuple) else 0 for value in values]
    for i, width in enumerate(widths):
        if width != widths[0]:
            allowed = f"must hold as many numbers as theta[0], {widths[0] or 1}"
            raise InputError(f"theta[{i}]", width or 1, allowed)
    if widths[0] and all(len({*value}) == 1 for value in values):
        return tuple(value[0] for value in values)  # all springs alike
    return values


def _target(value: Any, name: str) -> Any:
    springs = listed(value)
    if springs is None:
        return exact_number(value, name)
    if not springs:
        raise InputError(name, [], "must be a number, or a list of one for each spring")
    return tuple(exact_number(one, f"{name}[{k}]") for k, one in enumerate(springs))
