"""The energy of a run, however long: what the drive and gravity give, springs and friction take.

Between rearrangements theta alone moves and works against the springs; during one it is frozen, and
gravity and the springs work against friction. The table of rearrangements tells both, and every
line of it is on its own: a slider that was stopped in motion, or too far, leaves a rest that the
sum over all of them keeps.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from exactcreep.limits import Stop
from exactcreep.model.enclosure import floats
from exactcreep.model.numbers import InputError
from exactcreep.model.state import State
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.solvers.solver import Stretch, advance


@dataclass(frozen=True)
class Ledger:
    """Where the energy of a run came from and went, unit ``m g**2 tau_dyn**2``.

    Attributes
    ----------
    drive, gravity, friction : float
        Work of the first two, and energy that the last took.
    elastic : float
        Gain of elastic energy.
    left : float
        What is left over: zero but for rounding.
    apart : float
        Distance of x_G at the end from the sum over all rearrangements, unit ``g tau_dyn**2``.
    """

    drive: float
    gravity: float
    elastic: float
    friction: float
    left: float
    apart: float
    slips: int

    @property
    def balance(self) -> float:
        """What is left over, relative to the energy that friction took."""
        return abs(self.left) / (self.friction or 1.0)


def energy_ledger(experiment: Experiment) -> tuple[Ledger, State]:
    """Return the energy ledger of a run along a drive, and the state at its end.

    Raises
    ------
    InputError
        If the run ends before its drive does.

    Notes
    -----
    Guarantee: memory does not grow with the length of the run. Every term is good to a few ulp of
    the largest elastic energy of its rearrangement, and sums are rounded once for each stretch.
    """
    drive, begin = experiment.drive, experiment.initial
    simulation = experiment.algorithm.simulation(
        experiment.chain, begin, experiment.seed, ("rearrangements",)
    )
    sums: list[tuple[float, ...]] = []  # of gravity, friction, what is left, the displacement

    def take(stretch: Stretch) -> None:
        names = ("elastic_before", "elastic_after", "gravity", "dissipation", "displacement")
        before, after, gravity, friction, moved = (
            floats(stretch.recorded[f"rearrangement_{name}"]) for name in names
        )
        terms = gravity, friction, gravity - friction - (after - before), moved
        sums.append(tuple(float(term.sum()) for term in terms))

    stretch = advance(simulation, drive, drive.half_cycles, take=take)
    if stretch.stop is not Stop.DONE:
        raise InputError("drive", drive, f"must end at rest: {stretch.reason}")
    end = simulation.state()
    gravity, friction, left, moved = map(math.fsum, zip(*sums, strict=True))
    gained = (floats(end.tensions) ** 2).sum() - (floats(begin.tensions) ** 2).sum()
    elastic = float(gained) / 2
    travelled = float(np.mean(floats(end.displacements) - floats(begin.displacements)))
    ledger = Ledger(
        drive=elastic + left + friction - gravity,
        gravity=gravity,
        elastic=elastic,
        friction=friction,
        left=left,
        apart=abs(moved - travelled),
        slips=simulation.tally.slips,
    )
    return ledger, end
