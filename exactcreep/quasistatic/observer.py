"""Observers of a run: what each needs next, what it takes, and what a checkpoint keeps of it."""

from __future__ import annotations

from typing import Any

from exactcreep.model.enclosure import enclosure
from exactcreep.solvers.solver import Simulation, Stretch, require_like

NUMBER = enclosure(0)
"""Stands for any enclosure in `Observer.state`."""
NEVER = 1 << 62


class Observer:
    """Looks at every target of a run, of which the simulation records what it `needs`."""

    needs: tuple[str, ...] = ()

    state: dict[str, Any]
    """The attributes that a checkpoint keeps, each with a value of its kind; `require_like`."""

    def next(self, done: int) -> int:
        """Return the next target at which it wants to look, if not at the last."""
        return NEVER

    def take(self, stretch: Stretch, first: int, simulation: Simulation) -> None:
        """Take over what happened on the way to the targets from `first` on."""
        raise NotImplementedError

    def check(self, done: int) -> None:
        """Raise `ValueError` unless what was taken over can be known after `done` targets."""

    def kept(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in self.state}

    def restore(self, kept: Any, done: int) -> None:
        """Take over what `kept` returned after `done` targets, or raise `ValueError`."""
        require_like(self.state, kept)
        for name, value in kept.items():
            setattr(self, name, value)
        self.check(done)
