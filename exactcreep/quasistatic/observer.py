"""The interface of observers, which look at the targets of a run."""

from __future__ import annotations

from typing import Any

import numpy as np

from exactcreep.solvers.interface import Simulation, Stretch, require_like

NEVER = 1 << 62


class Observer:
    """Looks at targets of a run; the simulation records the quantities that it `needs`."""

    needs: tuple[str, ...] = ()

    state: tuple[str, ...]
    """The attributes that a checkpoint stores."""

    def next(self, done: int) -> int:
        """Return the next target that it wants to look at, besides the last."""
        return NEVER

    def take(self, stretch: Stretch, first: int, simulation: Simulation) -> None:
        """Take the data of the targets from `first` on."""
        raise NotImplementedError

    def kept(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in self.state}

    def restore(self, kept: Any) -> None:
        """Restore what `kept` returned, or raise `ValueError`."""
        mine = self.kept().items()
        like = {name: own[:0] if isinstance(own, np.ndarray) else own for name, own in mine}
        require_like(like, kept)
        for name, value in kept.items():
            setattr(self, name, value)
