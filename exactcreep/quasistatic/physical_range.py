"""Count where a run leaves the model's physical range: springs without length, crossing sliders."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.chain import largest_mu_s
from exactcreep.model.enclosure import floats
from exactcreep.model.keyed_disorder import LARGEST_DEVIATE
from exactcreep.model.numbers import nearest_float
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.quasistatic.observer import Observer
from exactcreep.solvers.interface import Simulation, Stretch


class PhysicalRange(Observer):
    """Counts the targets at which the run is outside its physical range."""

    state = ("theta_beyond_one", "crossings")

    def __init__(self, experiment: Experiment) -> None:
        self.experiment = experiment
        self.theta_beyond_one = self.crossings = 0
        self._gaps = _narrow_gaps(experiment)
        self.needs = () if self._gaps is None else ("x",)

    def take(self, stretch: Stretch, first: int, simulation: Simulation) -> None:
        experiment = self.experiment
        if experiment.widest >= 1:
            theta = experiment.drive.targets(first, stretch.completed, experiment.seed)
            largest = np.abs(theta).reshape(len(theta), -1).max(axis=1)
            self.theta_beyond_one += int(np.count_nonzero(largest >= 1))
        if self._gaps is not None:
            gaps = self._gaps + np.diff(floats(stretch.recorded["x"]), axis=1)
            self.crossings += int(np.count_nonzero((gaps <= 0).any(axis=1)))


def _narrow_gaps(experiment: Experiment) -> NDArray[np.float64] | None:
    """Return the initial distances of neighbours, or None if sliders cannot cross.

    No resting chain holds a tension above the sum of its limits, n (mu_s + |tan_alpha|) cos(alpha).
    Sliders cannot cross if springs are longer than twice this sum.
    """
    chain, initial = experiment.chain, experiment.initial
    limit = largest_mu_s(chain) + LARGEST_DEVIATE * chain.sigma_mu + abs(chain.tan_alpha)
    limit += max(map(abs, chain.end_forces))
    tensions, l0 = floats(initial.tensions), nearest_float(chain.l0)
    most = 2 * chain.n * nearest_float(limit) + float(np.abs(tensions).max(initial=0.0))
    if chain.n == 1 or (1 - experiment.widest) * l0 > most:
        return None
    lengths = (1 + experiment.theta * chain.floats("expansion")) * l0
    return np.asarray(lengths) + tensions - np.diff(floats(initial.displacements))
