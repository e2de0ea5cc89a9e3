"""The motion of a whole rearrangement as a function of time, similar to SciPy's ``OdeSolution``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from exactcreep.model.numbers import InputError, Scalar, refusing


class Motion(NamedTuple):
    """The positions, velocities and forces of the chain at one or several times.

    Parameters
    ----------
    positions, velocities, forces : ndarray, shape (n,) or (n, m)
        Displacement since the start of the simulation (unit ``g tau_dyn**2``), velocity (unit
        ``g tau_dyn``) and non-frictional force F_n (unit ``m g``) of every slider.

    Examples
    --------
    >>> chain = Chain(2, 1000, "0.5", "0.6", tan_alpha="0.25")
    >>> slip = rearrange(chain, State.relaxed(chain), direction=+1)
    >>> slip.sol(slip.duration / 2).velocities.round(4)
    array([0.   , 0.097])
    """

    positions: NDArray[Any]
    velocities: NDArray[Any]
    forces: NDArray[Any]


class Solution:
    """The motion of a rearrangement: a sequence of pieces, each exact.

    Parameters
    ----------
    make : callable
        Returns the pieces; called on demand.
    at_rest : Motion
        The chain if nothing moves.
    times : sequence of numbers
        Times of the events, ascending; unit tau_dyn.

    Attributes
    ----------
    pieces : tuple of callable
        ``pieces[i](t)`` is the `Motion` from event i to event i + 1, at the times `t_min` and
        `t_max` of the piece; made on demand.
    ts : ndarray, shape (len(pieces) + 1,)
        The times that separate them.
    t_min, t_max : number
        Times of the first event, 0, and of the last event.

    Examples
    --------
    >>> chain = Chain(2, 1000, "0.5", "0.6", tan_alpha="0.25")
    >>> sol = rearrange(chain, State.relaxed(chain), direction=+1).sol
    >>> sol([sol.t_min, sol.t_max]).positions.round(4)
    array([[0.   , 0.   ],
           [0.   , 0.194]])
    """

    @refusing
    def __init__(
        self, make: Callable[[], Sequence[Any]], at_rest: Motion, times: Sequence[Scalar]
    ) -> None:
        self._make, self._at_rest = make, at_rest
        self.ts = np.array(times)
        self.t_min: Scalar = self.ts[0]
        self.t_max: Scalar = self.ts[-1]

    def __repr__(self) -> str:
        return (
            f"Solution(the motion from t = {float(self.t_min):g} to {float(self.t_max):g} tau_dyn,"
            f" {self.ts.size} events; sol(t) has positions, velocities and forces)"
        )

    @cached_property
    def pieces(self) -> tuple[Any, ...]:
        """The motion from each event to the next, made on demand."""
        return tuple(self._make())

    def piece_at(self, t: Scalar) -> Any:
        """Return the piece that holds at a time; at an event, the piece that begins there.

        Parameters
        ----------
        t : number
            Between `t_min` and `t_max`, unit tau_dyn.

        Returns
        -------
        callable
            Returns the `Motion` at a time; its own `t_min` and `t_max` are the events around it.

        Raises
        ------
        InputError
            If nothing moves, or `t` lies before the first event or after the last.
        """
        if not self.pieces:
            raise InputError("t", t, "nothing moves in this rearrangement: it has no pieces")
        # a ball that overlaps an end is not outside
        if t < self.t_min or t > self.t_max or t != t:
            allowed = (
                f"must lie between {self.t_min} and {self.t_max}, the first and the last event"
            )
            raise InputError("t", t, allowed)
        # a ball may begin before all pieces
        return next((p for p in reversed(self.pieces) if not p.t_min > t), self.pieces[0])

    def __call__(self, t: ArrayLike | Scalar) -> Motion:
        """Return positions, velocities and forces at `t`.

        Parameters
        ----------
        t : number or array_like, shape (m,)
            Time(s) between `t_min` and `t_max`, unit tau_dyn.

        Returns
        -------
        Motion
            Of arrays of shape (n,), or (n, m): slider 3 is ``velocities[2]``.

        Raises
        ------
        InputError
            If a time lies before the first event or after the last.
        """
        moments: Any = t
        if np.ndim(moments) == 0:
            return self._at(moments)
        columns = [self._at(moment) for moment in np.asarray(moments).tolist()]
        return Motion(*(np.stack(parts, axis=-1) for parts in zip(*columns, strict=True)))

    def _at(self, t: Scalar) -> Motion:
        if not self.pieces:
            return self._at_rest
        motion: Motion = self.piece_at(t)(t)
        return motion
