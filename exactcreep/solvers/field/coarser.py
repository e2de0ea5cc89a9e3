"""The same run with fewer bits, whose difference from the run shows how rounding errors grow."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.drive import Drive
from exactcreep.model.enclosure import floats
from exactcreep.solvers.interface import PerturbedCopies, Simulation, Stretch
from exactcreep.watch.limits import Limits, Stop

FEWER_BITS = 4
"""Each rounding of the coarser run is about 16 times as large as in the run itself."""


class CoarserRun(PerturbedCopies):
    """A copy of a run that is perturbed by larger roundings of every operation."""

    def __init__(self, simulation: Simulation) -> None:
        self.simulation = simulation

    def follow(
        self, drive: Drive, first: int, stretch: Stretch, apart: float, limits: Limits
    ) -> tuple[NDArray[np.float64], bool]:
        """Compare the copy with a run; see `PerturbedCopies.follow`."""
        distances: list[float] = []
        while len(distances) < stretch.completed and max(distances, default=0.0) <= apart:
            k, own = len(distances), self.simulation
            passed = own.follow(drive, first + k, 1, limits.after(own.tally.events))
            if passed.completed:
                distances.append(_distance(stretch.recorded, k, passed.recorded))
            elif passed.stop is Stop.RUNAWAY:
                distances.append(np.inf)
            else:
                break
        return np.array(distances), len(distances) == stretch.completed

    def snapshot(self) -> dict[str, Any]:
        return self.simulation.snapshot()

    def restore(self, snapshot: Mapping[str, Any]) -> None:
        self.simulation.restore(snapshot)


def _distance(run: Mapping[str, NDArray[Any]], k: int, copy: Mapping[str, NDArray[Any]]) -> float:
    """Return the distance of the tensions at target k of a run; inf if other sliders slipped."""
    if (run["slips"][k] != copy["slips"][0]).any():
        return np.inf
    away = np.abs(floats(run["tension"][k] - copy["tension"][0])).max()
    return float(away / max(1.0, np.abs(floats(run["tension"][k])).max()))
