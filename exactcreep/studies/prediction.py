"""What the paper's law says of an experiment, to stand beside what was measured."""

from __future__ import annotations

from dataclasses import dataclass

from exactcreep.laws import LAWS, pivots
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles, GaussianSteps
from exactcreep.quasistatic.experiment import Experiment


@dataclass(frozen=True)
class Prediction:
    """The velocity that theory predicts, unit ``g tau_dyn**2`` per half-cycle or target.

    Attributes
    ----------
    label : str
        Of the paper's equation.
    printed : tuple of float
        What the equation gives as printed; two values where its plateau is not unique.
    sliding : tuple of float
        What the exact law of the sliding limit (mu_s -> mu_d) gives.
    """

    label: str
    printed: tuple[float, ...]
    sliding: tuple[float, ...]


def prediction(experiment: Experiment) -> Prediction | None:
    """Return what theory predicts for the mean velocity; None where it has no law.

    There is none for a path, for a single slider, and where the chain may run away. A chain on an
    incline of negative slope is the mirror image of one of positive slope.
    """
    chain, drive = experiment.chain, experiment.drive
    if chain.n == 1 or chain.may_run_away:
        return None
    if isinstance(drive, Cycles):
        label, size = "vitesse_seuil", {"amplitude": drive.amplitude}
    elif isinstance(drive, GaussianSteps):
        label, size = "vitesse_seuil_random", {"sigma_theta": drive.sigma_theta}
    else:
        return None
    if not all(size.values()):
        return None
    sign = -1 if chain.tan_alpha < 0 else 1
    upright: Chain = chain.mirrored() if sign < 0 else chain
    law = LAWS[label]
    described = {name: value for name, value in upright.parameters().items() if name != "n"}
    indices = pivots(upright.n, upright.tan_alpha, upright.mu_d)

    def values(form: object) -> tuple[float, ...]:
        assert callable(form)
        return tuple(sign * float(form(n=upright.n, i=i, **described, **size)) for i in indices)

    return Prediction(label, values(law.printed), values(law.exact or law.printed))
