"""Observers of a run: what each needs next, what it takes, and what a checkpoint keeps of it."""

from __future__ import annotations

from typing import Any

from exactcreep.solvers.interface import Simulation, Stretch, require_like

NEVER = 1 << 62


class Observer:
    """Looks at every target of a run; the simulation records the quantities that it `needs`."""

    needs: tuple[str, ...] = ()

    state: tuple[str, ...]
    """The attributes that a checkpoint keeps."""

    def next(self, done: int) -> int:
        """Return the next target at which it wants to look, if not at the last."""
        return NEVER

    def take(self, stretch: Stretch, first: int, simulation: Simulation) -> None:
        """Take over what happened on the way to the targets from `first` on."""
        raise NotImplementedError

    def kept(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in self.state}

    def restore(self, kept: Any) -> None:
        """Take over what `kept` returned, or raise `ValueError` if it has other names."""
        require_like(dict.fromkeys(self.state), kept)
        for name, value in kept.items():
            setattr(self, name, value)
