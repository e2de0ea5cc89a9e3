"""The motion of a whole rearrangement as a function of time, similar to SciPy's ``OdeSolution``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from exactcreep.model.chain import Chain
from exactcreep.model.contacts import Event, EventKind
from exactcreep.model.enclosure import same
from exactcreep.model.numbers import InputError, Scalar, refusing
from exactcreep.model.state import State
from exactcreep.motion.arithmetic import FLOAT64, Arithmetic
from exactcreep.motion.modes import Flow, Run, forces_of, frictions_of, loads_of


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


@dataclass(eq=False)
class Piece:
    """The motion between two events, in closed form.

    It stores displacements since `initial`, from slider `first` on.
    """

    arithmetic: Arithmetic
    t_min: Any
    t_max: Any
    initial: Motion
    first: int
    moved: NDArray[Any]
    runs: Sequence[Run]

    def __call__(self, t: Any) -> Motion:
        """Return positions, velocities and forces at `t`, each of shape (n,)."""
        with self.arithmetic.active():
            velocities = self.initial.velocities.copy()
            moved = self.arithmetic.zeros(len(velocities))
            moved[self.first : self.first + len(self.moved)] = self.moved
            for run in self.runs:
                part = slice(run.first, run.first + run.p)
                displacements, velocities[part] = run.moved(t - self.t_min)
                moved[part] = moved[part] + displacements
            change = self.arithmetic.zeros(len(moved))
            change[1:] = moved[:-1] - moved[1:]
            change[:-1] = change[:-1] + (moved[1:] - moved[:-1])
            return Motion(self.initial.positions + moved, velocities, self.initial.forces + change)


class Solution:
    """The motion of a rearrangement: a sequence of pieces, each exact.

    Between events the motion is the closed form for the given event times, in float64 to a few ulp
    of the largest displacement since; in balls an enclosure.

    Parameters
    ----------
    chain : Chain
        The chain that was rearranged.
    initial : State
        At rest at theta_c.
    events : sequence of Event
        In order of time.
    arithmetic : Arithmetic
        The numbers of the solver.

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
        self, chain: Chain, initial: State, events: Sequence[Event],
        arithmetic: Arithmetic = FLOAT64,
    ) -> None:  # fmt: skip
        self._chain, self._events, self._arithmetic = chain, events, arithmetic
        with arithmetic.active():
            tensions, places = map(arithmetic.vector, (initial.tensions, initial.displacements))
            forces = forces_of(arithmetic, tensions, loads_of(arithmetic, chain))
            self._at_rest = Motion(places, arithmetic.zeros(chain.n), forces)
            times = [arithmetic.number(0)]
            for event in events:
                if not same(time := arithmetic.number(event.time), times[-1]):
                    times.append(time)
        self.ts = np.array(times)
        self.t_min: Scalar = self.ts[0]
        self.t_max: Scalar = self.ts[-1]

    def __repr__(self) -> str:
        return (
            f"Solution(the motion from t = {float(self.t_min):g} to {float(self.t_max):g} tau_dyn,"
            f" {self.ts.size} events; sol(t) has positions, velocities and forces)"
        )

    @cached_property
    def pieces(self) -> tuple[Piece, ...]:
        """The motion from each event to the next, made on demand."""
        out: list[Piece] = []
        start, arithmetic = self._at_rest, self._arithmetic
        with arithmetic.active():
            flow = Flow(arithmetic, start.forces, frictions_of(arithmetic, self._chain))
            for event in self._events:
                now = self.ts[len(out)]
                if not same(time := arithmetic.number(event.time), now):
                    runs, first, last = flow.runs(), min(flow.touched), max(flow.touched)
                    moved = flow.moved[first : last + 1].copy()
                    out.append(Piece(arithmetic, now, time, start, first, moved, runs))
                    flow.move(runs, time - now)
                sliders = [slider - 1 for slider in event.sliders]
                if event.kind is EventKind.START:
                    flow.start(sliders, event.signs)
                else:
                    flow.stop(sliders)
        return tuple(out)

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
        """Return the motion at a time; at an event, of the piece that begins there."""
        if not self.pieces:
            return self._at_rest
        # a ball that overlaps an end is not outside
        if t < self.t_min or t > self.t_max or t != t:
            allowed = (
                f"must lie between {self.t_min} and {self.t_max}, the first and the last event"
            )
            raise InputError("t", t, allowed)
        # a ball may begin before all pieces
        return next((p for p in reversed(self.pieces) if not p.t_min > t), self.pieces[0])(t)
