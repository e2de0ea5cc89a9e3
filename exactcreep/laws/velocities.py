"""The mean velocity that theory predicts for a chain and its drive."""

from __future__ import annotations

from dataclasses import dataclass

from exactcreep.laws.forms import Form, law_values
from exactcreep.laws.paper import LAWS
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles, Drive, GaussianSteps
from exactcreep.model.state import State


@dataclass(frozen=True)
class Prediction:
    """The velocity that theory predicts, unit ``g tau_dyn**2`` per half-cycle or target.

    Attributes
    ----------
    label : str
        Of the paper's equation.
    printed : tuple of float
        What the equation gives as printed; two values where its plateau is not unique, none for a
        single slider or without dilations.
    sliding : tuple of float
        What the exact law of the sliding limit (mu_s -> mu_d) gives, in rising order.
    staircase : float or None
        The exact velocity of the chain itself where it is known: two sliders that start relaxed,
        sigma_mu = 0, under cycles.
    """

    label: str
    printed: tuple[float, ...]
    sliding: tuple[float, ...]
    staircase: float | None = None

    @property
    def values(self) -> tuple[float, ...]:
        """The best that theory has: the staircase, else the law of the sliding limit."""
        return self.sliding if self.staircase is None else (self.staircase,)


def prediction(
    chain: Chain, drive: Drive, start: State | None = None, bits: int | None = None
) -> Prediction | None:
    """Return what theory predicts for the mean velocity; None where it has no law.

    There is none for a path, and where the chain may run away. A chain on an incline of negative
    slope is the mirror image of one of positive slope.

    Parameters
    ----------
    chain : Chain
    drive : Drive
    start : State, optional
        Default: the relaxed chain, the only start whose staircase is known here.
    bits : int, optional
        As in `law_values`.
    """
    if isinstance(drive, Cycles):
        label, size = "vitesse_seuil", {"amplitude": drive.amplitude}
    elif isinstance(drive, GaussianSteps):
        label, size = "vitesse_seuil_random", {"sigma_theta": drive.sigma_theta}
    else:
        return None
    if chain.n == 1 and abs(chain.tan_alpha) <= chain.mu_d:
        return Prediction(label, (), (0.0,))
    if chain.may_run_away:
        return None
    if not all(size.values()):
        return Prediction(label, (), (0.0,))
    sign = -1 if chain.tan_alpha < 0 else 1
    described = (chain.mirrored() if sign < 0 else chain).parameters() | size

    def values(form: Form | None) -> tuple[float, ...]:  # without a negative zero
        return tuple(sign * value + 0.0 for value in law_values(form, described, bits))

    law, staircase = LAWS[label], None
    relaxed = start is None and isinstance(drive, Cycles)
    if relaxed and chain.n == 2 and chain.sigma_mu == 0 and chain.tan_alpha != 0:
        (staircase,) = values(LAWS["velocity_th_2_cycle_corrected"].exact)
    sliding = tuple(sorted(set(values(law.exact))))
    return Prediction(label, values(law.printed), sliding, staircase)
