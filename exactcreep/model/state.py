"""The state of a chain at rest: tensions and displacements, never absolute positions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exactcreep.model import keyed_disorder
from exactcreep.model.chain import Chain
from exactcreep.model.enclosure import as_float, floats, is_finite, same_numbers
from exactcreep.model.numbers import (
    InputError,
    Number,
    Scalar,
    Shown,
    listed,
    nearest_float,
    number_from_zero,
    number_of_floats,
    refusing,
)

_ARRAYS = "tensions", "displacements", "coefficients", "draws"
_MOST_DRAWS = 2**62


@dataclass(frozen=True, eq=False, repr=False)
class State(Shown):
    """A chain at rest at the dilation `theta`; states with the same numbers are equal.

    Attributes
    ----------
    tensions : ndarray, shape (n - 1,)
        ``T_n = x_(n+1) - x_n - (1 + theta) l0`` of the spring below slider n, unit ``m g``;
        float64, or Python numbers (`Fraction`, mpmath, balls) in an object array.
    displacements : ndarray, shape (n,)
        Displacement of each slider since the start, unit ``g tau_dyn**2``.
    coefficients : ndarray, shape (n,)
        Static friction coefficient of each contact as drawn; it may be below `mu_d`. With
        ``sigma_mu = 0`` the float64 nearest to `mu_s` represents the rational `mu_s`.
    draws : ndarray of int64, shape (n,)
        Number of coefficients that each slider has drawn, at least 1.
    theta : number, or ndarray of shape (n - 1,)
        The dilation, or the dilations of the springs if they differ.
    unrounded : mapping or None
        Set in the final state of a run: the numbers of its solver, which keeps sums of two floats
        where the attributes above are rounded. A run of the same solver and chain that starts here
        goes on from them with the same bits. None for other states: `replace` drops them, files of
        results do not hold them, and ``==`` and printing ignore them.

    Examples
    --------
    >>> chain = Chain(3, 1000, "0.5", "0.6", tan_alpha="0.75")
    >>> State.prepared(chain, ["0.1", "-0.1"], theta="0.01").forces(chain).round(3)
    array([0.7, 0.4, 0.7])
    >>> State.perturbed(chain, "0.001", start_seed=1).tensions.round(6)
    array([0.000273, 0.000239])
    """

    tensions: NDArray[Any]
    displacements: NDArray[Any]
    coefficients: NDArray[Any]
    draws: NDArray[np.int64]
    theta: Any  # a number, or an array with one for each spring
    unrounded: Mapping[str, Any] | None = field(default=None, init=False)

    def __post_init__(self) -> None:
        for name in _ARRAYS:
            checked = _counts if name == "draws" else _numbers
            array = checked(getattr(self, name), f"state.{name}")
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        n = self.displacements.size
        if n == 0:
            raise InputError("state.displacements", (0,), "must hold at least one slider")
        sizes = [("tensions", n - 1), ("coefficients", n), ("draws", n)]
        if isinstance(self.theta, list | tuple | np.ndarray):
            array = _numbers(self.theta, "state.theta")
            array.flags.writeable = False
            object.__setattr__(self, "theta", array)
            sizes.append(("theta", n - 1))
        elif not _is_number(self.theta):
            raise InputError("state.theta", self.theta, "must be a number")
        for name, size in sizes:
            shape = getattr(self, name).shape
            if shape != (size,):
                raise InputError(f"state.{name}", shape, f"must have the shape ({size},)")

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, State):
            return NotImplemented
        return all(
            same_numbers(np.array(getattr(self, name)), np.array(getattr(other, name)))
            for name in (*_ARRAYS, "theta")
        )

    def __hash__(self) -> int:
        return hash(self.draws.tobytes())  # integers of the same type in every equal state

    def __setstate__(self, parts: Mapping[str, Any]) -> None:
        vars(self).update(parts)
        self.__post_init__()  # it owns its arrays, read-only

    @property
    def n(self) -> int:
        """Number of sliders."""
        return self.displacements.size

    @property
    def springs(self) -> int:
        """Number of springs of which `theta` holds the dilation; 0: all have the same."""
        return self.theta.size if isinstance(self.theta, np.ndarray) else 0

    @classmethod
    def relaxed(cls, chain: Chain, seed: int = 0) -> State:
        """Return the relaxed chain: theta = 0, no tension, first draw of every slider.

        Parameters
        ----------
        chain : Chain
            The chain.
        seed : int, optional
            Seed of the disorder.

        Returns
        -------
        State
            At rest, unless a draw is so low that a slider exceeds its threshold.
        """
        return cls.prepared(chain, seed=seed)

    @classmethod
    @refusing
    def prepared(
        cls,
        chain: Chain,
        tensions: Sequence[Number] | NDArray[Any] | None = None,
        *,
        theta: Number = 0,
        seed: int = 0,
    ) -> State:
        """Return a chain prepared with n - 1 given tensions (default: zero) at `theta`.

        If a slider exceeds its threshold, the chain is first rearranged at its own theta.

        Parameters
        ----------
        chain : Chain
            The chain.
        tensions : sequence of numbers, shape (n - 1,), optional
            Unit ``m g``; stored exactly if a float would round them.
        theta : number, optional
            The dilation.
        seed : int, optional
            Seed of the disorder.

        Returns
        -------
        State
            With zero displacements and first draws.

        Raises
        ------
        InputError
            If there are not n - 1 tensions, or one of them is not a number.
        """
        seed = keyed_disorder.valid_seed(seed)
        kept = _kept_tensions(tensions, chain.n - 1)
        dilation = number_of_floats(theta, "theta")
        nearest = nearest_float(dilation)
        return cls(
            tensions=kept,
            displacements=np.zeros(chain.n),
            coefficients=keyed_disorder.first_coefficients(chain, seed),
            draws=np.ones(chain.n, dtype=np.int64),
            theta=nearest if Fraction(nearest) == dilation else dilation,
        )

    @classmethod
    @refusing
    def perturbed(cls, chain: Chain, size: Number, *, start_seed: int, seed: int = 0) -> State:
        """Return the relaxed chain with random tensions, uniform in (-size, size).

        Parameters
        ----------
        chain : Chain
            The chain.
        size : number
            Bound of the tensions, unit ``m g``, not negative.
        start_seed : int
            Seed of the tensions.
        seed : int, optional
            Seed of the disorder.

        Returns
        -------
        State
            At theta = 0.

        Raises
        ------
        InputError
            If a number is out of range.
        """
        largest = nearest_float(number_from_zero(size, "size"))
        start_seed = keyed_disorder.valid_seed(start_seed)
        uniform = keyed_disorder.uniform_tensions(start_seed, chain.n - 1)
        return cls.prepared(chain, largest * uniform, seed=seed)

    def forces(self, chain: Chain) -> NDArray[np.float64]:
        """Return the non-frictional forces ``F_n = T_n - T_(n-1) + s``, unit m g, with end forces.

        Parameters
        ----------
        chain : Chain
            The chain in this state.

        Returns
        -------
        ndarray, shape (n,)
            In float64.
        """
        around = np.zeros(self.n + 1)
        around[1:-1] = self.tensions
        forces = around[1:] - around[:-1] + chain.sin_alpha
        for end, force in zip((0, -1), chain.end_forces, strict=True):
            forces[end] += nearest_float(force)
        return np.asarray(forces)

    def _facts(self) -> dict[str, Any]:
        return {"n": self.n} | {name: getattr(self, name) for name in ("theta", *_ARRAYS)}

    def _units(self) -> dict[str, str]:
        return {"tensions": "m g", "displacements": "g tau_dyn^2"}


def owning(theta: Scalar, *arrays: NDArray[Any]) -> State:
    """Return the state of a solver's own arrays, which it owns from now on, read-only."""
    made = State.__new__(State)
    for name, array in zip(_ARRAYS, arrays, strict=True):
        array.flags.writeable = False
        vars(made)[name] = array
    vars(made)["theta"] = theta
    return made


def near_theta(state: State) -> Any:
    """Return `theta` in float64."""
    return floats(state.theta) if state.springs else as_float(state.theta)


def require_finite(state: State) -> None:
    """Raise `InputError` unless every number is finite; too large a dt in Verlet breaks this."""
    for name in ("tensions", "displacements", "coefficients", "theta"):
        array = np.array(getattr(state, name))
        if array.dtype != object and np.isfinite(array).all():
            continue
        for value in array.ravel().tolist():
            if not is_finite(value):
                raise InputError(f"state.{name}", value, "must hold finite numbers")


def completed(state: State, unrounded: Mapping[str, Any] | None) -> State:
    """Give a new state the unrounded numbers of its solver, and return it."""
    object.__setattr__(state, "unrounded", unrounded)
    return state


def symmetric(chain: Chain, state: State) -> bool:
    """Return whether the chain is, and therefore stays, the mirror image of itself."""
    if chain.sigma_mu or chain.n < 2 or chain != chain.mirrored():
        return False
    return all(bool((row == row[::-1]).all()) for row in (state.tensions, state.coefficients))


def _kept_tensions(tensions: Any, count: int) -> NDArray[Any]:
    """Return `count` tensions as float64, or exactly in an object array if a float rounds one."""
    if tensions is None:
        return np.zeros(count)
    given = listed(tensions)
    if given is None or len(given) != count:
        allowed = f"must be {count} numbers (n - 1)"
        raise InputError("tensions", tensions if given is None else len(given), allowed)
    floats = isinstance(tensions, np.ndarray) and tensions.dtype == np.float64
    if floats and tensions.ndim == 1 and np.isfinite(tensions).all():
        return np.asarray(np.add(tensions, 0.0))  # a zero has no sign
    values = [number_of_floats(value, f"tensions[{i}]") for i, value in enumerate(given)]
    near = np.array([nearest_float(value) for value in values])
    whole = [Fraction(one) for one in near.tolist()] == values
    return near if whole else np.array(values, dtype=object)


def _numbers(given: Any, name: str) -> NDArray[Any]:
    """Return numbers as a new array, float64 or of Python numbers."""
    try:
        array = np.array(given)
    except (ValueError, TypeError):  # rows of unequal length
        raise InputError(name, given, "must be an array of numbers") from None
    if array.ndim != 1:
        raise InputError(name, array.shape, "must have one dimension")
    if array.dtype.kind in "fiu":
        return array.astype(np.float64, copy=False)
    for value in array.tolist():
        if array.dtype != object or not _is_number(value):
            raise InputError(name, value, "must hold numbers")
    return array


def _counts(given: Any, name: str) -> NDArray[np.int64]:
    array = _numbers(given, name)
    allowed = f"must hold whole numbers, at least 1 and at most {_MOST_DRAWS}"
    # numbers beyond the precision of float64 are also excessive
    if array.dtype == object or not ((array >= 1) & (array <= _MOST_DRAWS)).all():
        raise InputError(name, given, allowed)
    counts = np.array(given).astype(np.int64)
    if (counts != array).any():
        raise InputError(name, given, allowed)
    return counts


def _is_number(value: Any) -> bool:
    """Return whether `value` is real: a Python number, one of mpmath, a ball, or an enclosure."""
    return hasattr(value, "__float__") and not isinstance(value, (bool, np.bool_, np.ndarray))
