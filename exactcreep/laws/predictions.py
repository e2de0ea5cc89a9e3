"""The mean velocity that theory predicts for a chain under its drive, and the name of the law."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from exactcreep.laws import paper
from exactcreep.laws.differing import differing_velocity, pivot_sliders
from exactcreep.laws.number_types import Number, cosine, each
from exactcreep.laws.paper import law_values
from exactcreep.laws.staircase import staircase_two_sliders
from exactcreep.laws.sticking import (
    Forces,
    beyond_sticking,
    forces,
    locks,
    rests,
    sticking_deviation,
    sticking_velocity,
)
from exactcreep.laws.velocities import sliding_velocity, sliding_velocity_random
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles, Drive, GaussianSteps
from exactcreep.model.numbers import refusing
from exactcreep.model.state import State
from exactcreep.model.uniform import EXPANSION, unlike

_UNKNOWN = "; how far it is off is not known here"


@dataclass(frozen=True)
class Prediction:
    """The velocity that theory predicts, unit ``g tau_dyn**2`` per half-cycle or target.

    Parameters
    ----------
    label : str
        Label of the paper's equation in the ledger; "" if friction or ends differ.
    printed : tuple of float
        Result of that equation: two values where the plateau is not unique, none below the
        threshold.
    sliding : tuple of float
        The exact law of the sliding limit, again with up to two values.
    staircase : float, optional
        The exact velocity of two sliders that start relaxed, sigma_mu = 0, under cycles.
    sticking : float, optional
        The measured law `sticking_velocity` (or its random form), if the chain is in its range.
    law : str
        The law of `values`, in words.
    values : tuple of float
        Velocities of that law: two where the chain's history decides.
    deviation : float
        Measured root mean square difference of chains from the law: 0 where the law is exact, nan
        where the difference is not known.

    Examples
    --------
    >>> chain = Chain(10, 1000, "0.4", "0.55", "0.01", tan_alpha="0.25")
    >>> found = prediction(chain, Cycles("0.01", 100))
    >>> found.law, f"{found.values[0]:.1f} +- {found.deviation:.1f}"
    ('sliders that stick and slip, measured', '61.5 +- 0.3')
    """

    label: str
    printed: tuple[float, ...]
    sliding: tuple[float, ...]
    staircase: float | None = None
    sticking: float | None = None
    law: str = "sliding limit"
    values: tuple[float, ...] = ()
    deviation: float = math.nan

    def __str__(self) -> str:
        """Return the velocity, its deviation and the name of the law, in one line."""
        values = " or ".join(f"{value:.6g}" for value in self.values)
        return values + f" ± {self.deviation:.2g}" * (self.deviation > 0) + f" ({self.law})"


@refusing
def prediction(chain: Chain, drive: Drive, start: State | None = None) -> Prediction | None:
    """Return the mean velocity that theory predicts in the long run, and which law holds.

    The first of these that holds is taken: rest, where it is proved or was the fate of every chain
    that was tried; the staircase of two relaxed sliders; the measured law of sliders that stick and
    slip, within its range; the sliding limit, exact where mu_s = mu_d. Where the error of the
    sliding limit was not measured, `Prediction.law` says so. The start then decides without
    disorder: the values are the velocities of all pivots whose windows contain the slope, and 0 if
    a state at rest or a locked cycle exists. With eight or more sliders the pivot hops, and the
    velocity lies between these values.

    Parameters
    ----------
    chain : Chain
        The chain.
    drive : Drive
        Cycles or random dilations.
    start : State, optional
        Default: the relaxed chain, for which the staircase holds.

    Returns
    -------
    Prediction or None
        None for a path, for springs that expand by different weights, and for slopes of at least
        mu_d, where friction does not hold the chain.

    Examples
    --------
    >>> prediction(pair, Cycles("0.005", 100)).law
    'staircase, exact'
    """
    if not isinstance(drive, Cycles | GaussianSteps):
        return None
    return prediction_of(chain.parameters() | drive.parameters(), relaxed=start is None)


@refusing
def prediction_of(parameters: Mapping[str, Number], *, relaxed: bool = False) -> Prediction | None:
    """Return `prediction` of a chain and its drive that are given by their numbers.

    Parameters
    ----------
    parameters : mapping of str to number
        `n`, `l0`, `mu_d`, `mu_s`, `sigma_mu`, `tan_alpha`, and `amplitude` or `sigma_theta`;
        `end_forces` and `expansion` as of `Chain`; others are ignored.
    relaxed : bool
        Whether the chain starts relaxed.

    Returns
    -------
    Prediction or None
        None as in `prediction`.

    Examples
    --------
    >>> chain = {"n": 10, "l0": 1000, "mu_d": 0.5, "mu_s": 0.5, "sigma_mu": 0, "tan_alpha": 0.25}
    >>> found = prediction_of(chain | {"amplitude": 0.002})
    >>> found.law, round(found.values[0], 3)
    ('sliding limit, exact', 3.937)
    """
    n, slope, differs = int(parameters["n"]), parameters["tan_alpha"], unlike(parameters)
    friction, static = (each(parameters, name) for name in ("mu_d", "mu_s"))
    about = {"tan_alpha": slope, "end_forces": parameters.get("end_forces", (0, 0))}
    resting = n == 1 and not differs and abs(slope) <= friction[0]
    if EXPANSION in differs or not (resting or _holds(friction, **about)):
        return None
    cycles = "amplitude" in parameters
    label, size = ("Eq. 23", "amplitude") if cycles else ("Eq. 24", "sigma_theta")
    label = "" if differs else label
    if resting or not parameters[size]:
        return Prediction(label, (), (0.0,), law="rest", values=(0.0,), deviation=0.0)
    printed: tuple[float, ...] = ()
    if differs:
        drive = {"l0": parameters["l0"], size: parameters[size]}
        sliding = _values(differing_velocity(mu_d=friction, **about, **drive))
    else:
        downhill, sign = dict(parameters) | {"tan_alpha": abs(slope)}, -1 if slope < 0 else 1
        printed, sliding = (
            tuple(sign * value + 0.0 for value in law_values(law, downhill)) for law in _LAWS[size]
        )
        sliding = _values(sliding)
        if any(value * slope < 0 for value in printed):
            printed = ()  # below its threshold the paper's line would lead uphill
    on, clean = forces(parameters), parameters["sigma_mu"] == 0
    held: tuple[float, ...]
    staircase = None
    if cycles and relaxed and clean and n == 2 and slope != 0 and not differs:
        (staircase,) = (sign * value for value in law_values(staircase_two_sliders, downhill))
    beyond = beyond_sticking(parameters)
    if cycles and beyond and (why := _rest(parameters, on, relaxed=relaxed and clean)):
        proved = 0.0 if why.endswith("proved") else math.nan
        return Prediction(label, printed, sliding, staircase, None, why, (0.0,), proved)
    if staircase is not None:
        law, held, deviation = "staircase, exact", (staircase,), 0.0
    elif clean and static == friction:
        law, held, deviation = "sliding limit, exact", sliding, 0.0
    elif on.smears:
        law, held = "sliders that stick and slip", (sticking_velocity(parameters),)
        deviation = math.nan if beyond else sticking_deviation(parameters)
        law += ", measured" * (not beyond)
    else:
        law, held, deviation = "sliding limit", sliding, math.nan
        if clean and n > 2 and not differs:
            law, held = _clean(parameters, on)
    if math.isnan(deviation) and cycles and any(held):
        if rests(parameters, "mu_s"):
            law += ", or at rest"
        elif clean and locks(parameters, on):
            law += ", or locked"
        if law.endswith(("rest", "locked")) and not on.smears:
            held = _values((0.0, *held))
    sticking = held[0] if on.smears and not beyond else None
    law += _UNKNOWN * math.isnan(deviation)
    if relaxed and slope == 0 and not differs and sum(held) == 0:
        law, held, deviation = "no mean drift, by symmetry", (0.0,), 0.0 if clean else math.nan
        law += "; one run wanders" * (not clean)
    return Prediction(label, printed, sliding, staircase, sticking, law, held, deviation)


def _values(found: Iterable[Number]) -> tuple[float, ...]:
    return tuple(sorted({float(value) + 0.0 for value in found}))  # without a negative zero


def _holds(friction: Sequence[Number], **about: Any) -> bool:
    """Return whether friction holds a chain, exactly."""
    try:
        pivot_sliders(friction, **about)
    except ValueError:  # the chain may run away
        return False
    return True


def _clean(parameters: Mapping[str, Number], on: Forces) -> tuple[str, tuple[float, ...]]:
    """Return law and velocities of equal sliders without disorder, too few to smear the pivots."""
    n, sign = int(parameters["n"]), -1 if on.pull < 0 else 1
    possible = {sign * (n + 3 - 2 * i) * on.gain + 0.0 for i in _pivots_by_window(parameters)}
    if len(possible) > 1:
        return "sliding limit of each possible pivot", tuple(sorted(possible))
    return "sliding limit", tuple(possible)


def _rest(parameters: Mapping[str, Number], on: Forces, *, relaxed: bool) -> str:
    """Return why a chain comes to rest for ever under cycles, or an empty string.

    Up to `at_rest_amplitude` some state is at rest, but some chains creep there. Below the onset of
    Eq. 22, corrected, none crept: of 752 runs of 188 chains without disorder (N from 3 to 12, four
    starts each), none moved in the last 200 of 3000 cycles. Between the two, 44 of 252 did.
    """
    if rests(parameters, "mu_d", 1 - 1e-12):  # Melan's bound is that of rest, with mu_d
        return "rest: no creep lasts, proved"
    if on.sigma or on.unit == 0:
        return ""
    reach, static = float(parameters["l0"] * parameters["amplitude"]), on.friction + on.excess
    slope = float(parameters["tan_alpha"])
    pulls = np.full(len(static), slope * float(cosine(slope)))
    pulls[[0, -1]] += [float(force) for force in parameters.get("end_forces", (0, 0))]
    held = static - abs(pulls)
    if relaxed and held.min() > 0 and reach < min(held[0], held[-1]) * (1 - 2**-40):
        return "rest: no end of the relaxed chain starts, proved"
    onset = on.half_play + on.unit / 2
    if len(static) > 2 and reach < onset and rests(parameters, "mu_s"):
        return "rest: a state at rest exists, and all chains tried lost their creep"
    return ""


def _pivots_by_window(parameters: Mapping[str, Number]) -> range:
    n, slope, mu_d, mu_s = (parameters[name] for name in ("n", "tan_alpha", "mu_d", "mu_s"))
    first, last = (n + 2 - (n * abs(slope) + off) / mu_d for off in (mu_s - mu_d, mu_d - mu_s))
    return range(max(2, math.ceil(first / 2)), min(n + 1, math.floor(last / 2 + 1)) + 1)


_LAWS = {
    "amplitude": (paper.creep_velocity, sliding_velocity),
    "sigma_theta": (paper.creep_velocity_random, sliding_velocity_random),
}
