"""Simulations by the exact solver, for the tests of this room."""

from __future__ import annotations

from exactcreep import Chain, State
from exactcreep.solvers.exact.solver import ExactSimulation


def followed(chain: Chain, drive: object, seed: int = 0, start: State | None = None):
    simulation = ExactSimulation(chain, start or State.relaxed(chain, seed), seed)
    stretch = simulation.follow(drive, 1, drive.half_cycles)
    assert stretch.completed == drive.half_cycles
    return simulation, stretch
