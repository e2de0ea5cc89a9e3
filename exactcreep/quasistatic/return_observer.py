"""Detect whether a run has returned: a `ReturnMap` fed at the ends of its cycles."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.drive import Cycles
from exactcreep.model.enclosure import exact_value, floats
from exactcreep.model.numbers import nearest_float
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.quasistatic.observer import Observer
from exactcreep.solvers.interface import Simulation, Stretch
from exactcreep.solvers.return_map import ReturnMap


class ReturnObserver(ReturnMap, Observer):
    """Feeds the return map of a run with its recorded data."""

    needs = ("tension", "slips")
    state = ("ends", "forgotten", "noted", "slipped", "alike_since", "not_slipped")

    def __init__(self, experiment: Experiment) -> None:
        chain, state, drive = experiment.chain, experiment.initial, experiment.drive
        assert isinstance(drive, Cycles)
        # the start may have another temperature than the ends of cycles
        ramp = nearest_float(chain.l0 * (exact_value(state.theta) + drive.amplitude))
        x_G = math.fsum(floats(state.displacements).tolist()) / chain.n
        super().__init__(chain, x_G, floats(state.tensions) + ramp * chain.floats("expansion"))
        self.slipped = 0  # since the end of the last cycle
        # which sliders keep an initial coefficient until they slip; with disorder
        # coefficients never return, and are ignored
        unlike = state.coefficients != chain.floats("mu_s")
        self.not_slipped = unlike & (chain.sigma_mu == 0)

    def take(self, stretch: Stretch, first: int, simulation: Simulation) -> None:
        recorded, begin = stretch.recorded, first % 2
        slips = recorded["slips"].sum(axis=1)
        slips[:1] += self.slipped
        total = np.cumsum(slips)
        whole = np.diff(total[begin::2], prepend=0)
        self.slipped = int(total[-1] - whole.sum())
        self._lose_coefficients(recorded["slips"][:, self.not_slipped] != 0, first)
        low = 0.0 if stretch.x_G_low is None else stretch.x_G_low[begin::2]
        self.feed(recorded["x_G"][begin::2], low, recorded["tension"][begin::2], whole)

    def _lose_coefficients(self, slipped: NDArray[np.bool_], first: int) -> None:
        """Note the cycle in which sliders last lost an initial coefficient.

        `slipped`: rows for the half-cycles from `first` on, columns for `not_slipped`.
        """
        lose = slipped.any(axis=0)
        if lose.any():
            half_cycle = first + int(slipped[:, lose].argmax(axis=0).max())
            self.alike_since = max(self.alike_since, (half_cycle + 1) // 2)
            self.not_slipped[np.flatnonzero(self.not_slipped)[lose]] = False
