"""The state of a chain at rest: tensions and displacements, never absolute positions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exactcreep.model import disorder
from exactcreep.model.chain import Chain
from exactcreep.model.numbers import InputError, exact_number, nearest_float


@dataclass(frozen=True, eq=False)
class State:
    """A chain at rest at the dilation `theta`.

    Attributes
    ----------
    tensions : ndarray, shape (n - 1,)
        ``T_n = x_(n+1) - x_n - (1 + theta) l0`` of the spring below slider n, unit ``m g``;
        float64, or Python numbers (`Fraction`, mpmath, balls) in an object array.
    displacements : ndarray, shape (n,)
        How far each slider has moved since the start, unit ``g tau_dyn**2``.
    coefficients : ndarray, shape (n,)
        Static friction coefficient of each contact as drawn; it may lie below `mu_d`.
        With ``sigma_mu = 0`` the float64 nearest to `mu_s` stands for the rational `mu_s`.
    draws : ndarray of int64, shape (n,)
        How many coefficients each slider has had, at least 1.
    theta : number
        The dilation.
    """

    tensions: NDArray[Any]
    displacements: NDArray[Any]
    coefficients: NDArray[Any]
    draws: NDArray[np.int64]
    theta: Any

    def __post_init__(self) -> None:
        for name in ("tensions", "displacements", "coefficients", "draws"):
            array = np.array(getattr(self, name))
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        n = self.displacements.size
        for name, size in (("tensions", n - 1), ("coefficients", n), ("draws", n)):
            if getattr(self, name).shape != (size,):
                shape = getattr(self, name).shape
                raise InputError(f"state.{name}", shape, f"must have the shape ({size},)")

    @property
    def n(self) -> int:
        """Number of sliders."""
        return self.displacements.size

    @classmethod
    def relaxed(cls, chain: Chain, seed: int = 0) -> State:
        """Return the relaxed chain: theta = 0, no tension, first draw of every slider."""
        return cls.prepared(chain, seed=seed)

    @classmethod
    def prepared(
        cls,
        chain: Chain,
        tensions: Sequence[Any] | NDArray[Any] | None = None,
        *,
        theta: Any = 0,
        seed: int = 0,
    ) -> State:
        """Return a chain prepared with the given tensions (default none) at `theta`.

        It need not be at rest: `creep` and ``rearrange(direction=0)`` first rearrange it at its
        own theta if a slider exceeds its threshold.

        Raises
        ------
        InputError
            If a tension is not a finite number, or their count is not n - 1.
        """
        seed = disorder.valid_seed(seed)
        kept = _kept_tensions(tensions, chain.n - 1)
        dilation = exact_number(theta, "theta")
        nearest = nearest_float(dilation)
        return cls(
            tensions=kept,
            displacements=np.zeros(chain.n),
            coefficients=initial_coefficients(chain, seed),
            draws=np.ones(chain.n, dtype=np.int64),
            theta=nearest if Fraction(nearest) == dilation else dilation,
        )

    @classmethod
    def perturbed(cls, chain: Chain, size: Any, *, start_seed: int, seed: int = 0) -> State:
        """Return the relaxed chain with tensions uniform in (-size, size), keyed by `start_seed`.

        `seed` keys the static coefficients, as everywhere.
        """
        magnitude = exact_number(size, "size")
        if magnitude < 0:
            raise InputError("size", size, "must not be negative")
        uniform = disorder.uniform_tensions(disorder.valid_seed(start_seed), chain.n - 1)
        return cls.prepared(chain, nearest_float(magnitude) * uniform, seed=seed)

    def forces(self, chain: Chain) -> NDArray[np.float64]:
        """Return the non-frictional forces ``F_n = T_n - T_(n-1) + s``, unit m g, shape (n,)."""
        tensions = self.tensions.astype(np.float64)
        return np.diff(tensions, prepend=0.0, append=0.0) + chain.sin_alpha


def _kept_tensions(tensions: Any, count: int) -> NDArray[Any]:
    """Return `count` tensions as float64, or exactly in an object array if a float rounds one."""
    if tensions is None:
        return np.zeros(count)
    allowed = f"must be {count} numbers (n - 1)"
    if isinstance(tensions, (str, bytes, set, dict)):
        raise InputError("tensions", tensions, allowed)
    try:
        given = tensions if isinstance(tensions, np.ndarray) else list(tensions)
        size = len(given)
    except TypeError:
        raise InputError("tensions", tensions, allowed) from None
    if size != count:
        raise InputError("tensions", size, allowed)
    if (isinstance(given, np.ndarray) and given.dtype == np.float64 and given.ndim == 1) or (
        isinstance(given, list) and all(type(value) is float for value in given)
    ):
        floats = np.array(given, dtype=np.float64) + 0.0  # what they denote; a zero has no sign
        stray = np.flatnonzero(~np.isfinite(floats))
        if stray.size:
            exact_number(floats[stray[0]], f"tensions[{stray[0]}]")
        return floats
    values = [exact_number(value, f"tensions[{i}]") for i, value in enumerate(given)]
    floats = np.array([nearest_float(value) for value in values], dtype=np.float64)
    if all(Fraction(f) == value for f, value in zip(floats.tolist(), values, strict=True)):
        return floats
    kept = np.empty(count, dtype=object)
    kept[:] = values
    return kept


def initial_coefficients(chain: Chain, seed: int) -> NDArray[np.float64]:
    """Return the initial static coefficient (draw k = 0) of every slider, shape (n,)."""
    out = np.full(chain.n, nearest_float(chain.mu_s))
    if chain.sigma_mu != 0:
        disorder.first_deviates(np.uint64(seed), out)
        out *= nearest_float(chain.sigma_mu)
        out += nearest_float(chain.mu_s)
    return out
