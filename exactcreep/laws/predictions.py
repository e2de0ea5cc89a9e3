"""The mean velocity that theory predicts for a chain under its drive, and the name of the law."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from exactcreep.laws import paper
from exactcreep.laws.differing import (
    differing_deviation,
    differing_velocity,
    differing_velocity_random,
    pivot_sliders,
)
from exactcreep.laws.number_types import Number, cosine
from exactcreep.laws.paper import law_values, onset_amplitude
from exactcreep.laws.staircase import staircase_two_sliders
from exactcreep.laws.sticking import (
    FEWEST_CLEAN,
    beyond_sticking,
    sticking_deviation,
    sticking_gain,
    sticking_velocity,
    sticking_velocity_random,
)
from exactcreep.laws.theorems import (
    at_rest_amplitude,
    locked_ends_amplitude,
    no_lasting_creep_amplitude,
)
from exactcreep.laws.velocities import sliding_velocity, sliding_velocity_random
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles, Drive, GaussianSteps
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
        Result of that equation: two values where the plateau is not unique, none where none exists.
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
    ('sliders that stick and slip, measured', '61.2 +- 0.3')
    """

    label: str
    printed: tuple[float, ...]
    sliding: tuple[float, ...]
    staircase: float | None = None
    sticking: float | None = None
    law: str = "sliding limit"
    values: tuple[float, ...] = ()
    deviation: float = math.nan


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
    if differs := unlike(parameters):
        return None if EXPANSION in differs else _differing(parameters)
    n, slope = int(parameters["n"]), parameters["tan_alpha"]
    mu_d, mu_s, sigma_mu = (parameters[name] for name in ("mu_d", "mu_s", "sigma_mu"))
    cycles = "amplitude" in parameters
    label, size = ("Eq. 23", "amplitude") if cycles else ("Eq. 24", "sigma_theta")
    printed, exact, measured = _LAWS[size]
    resting = n == 1 and abs(slope) <= mu_d
    if abs(slope) >= mu_d and not resting:
        return None
    if resting or not parameters[size]:
        return Prediction(label, (), (0.0,), law="rest", values=(0.0,), deviation=0.0)
    sign = -1 if slope < 0 else 1
    downhill = dict(parameters) | {"tan_alpha": abs(slope)}
    clean = sigma_mu == 0

    def values(law: Callable[..., Number]) -> tuple[float, ...]:  # without a negative zero
        return tuple(sign * value + 0.0 for value in law_values(law, downhill))

    as_printed, sliding = values(printed), tuple(sorted({*values(exact)}))
    sticking = staircase = None
    if not beyond_sticking(downhill):
        (sticking,) = values(measured)
    if cycles:
        if relaxed and clean and n == 2 and slope != 0:
            (staircase,) = values(staircase_two_sliders)
        if sticking is None and (why := _rest(downhill, relaxed=relaxed and clean)):
            proved = 0.0 if why.endswith("proved") else math.nan
            return Prediction(label, as_printed, sliding, staircase, None, why, (0.0,), proved)
    held: tuple[float, ...]
    if staircase is not None:
        law, held, deviation = "staircase, exact", (staircase,), 0.0
    elif sticking is not None:
        law, held = "sliders that stick and slip, measured", (sticking,)
        deviation = sticking_deviation(downhill)
    elif clean and mu_s == mu_d:
        law, held, deviation = "sliding limit, exact", sliding, 0.0
    else:
        law, held, deviation = "sliding limit", sliding, math.nan
        if clean and n > 2:
            law, held = _clean(downhill, sign * sticking_gain(downhill), held)
        law += _UNKNOWN
    return Prediction(label, as_printed, sliding, staircase, sticking, law, held, deviation)


def _differing(parameters: Mapping[str, Number]) -> Prediction | None:
    """Return the prediction of the sliding limit for a chain whose friction or ends differ."""
    cycles = "amplitude" in parameters
    law, size = (
        (differing_velocity, "amplitude") if cycles else (differing_velocity_random, "sigma_theta")
    )
    ends = parameters.get("end_forces", (0, 0))
    friction, static = (
        value if isinstance(value, list | tuple) else [value] * int(parameters["n"])
        for value in (parameters["mu_d"], parameters["mu_s"])
    )
    try:
        pivot_sliders(friction, parameters["tan_alpha"], ends)
    except ValueError:  # the chain may run away
        return None
    about = {"l0": parameters["l0"], "tan_alpha": parameters["tan_alpha"], "end_forces": ends}
    found = law(mu_d=friction, **about, **{size: parameters[size]}) if parameters[size] else (0,)
    values = tuple(sorted({float(value) + 0.0 for value in found}))
    off = math.nan
    if cycles:
        sticks = {"mu_s": static, "sigma_mu": parameters["sigma_mu"]}
        off = differing_deviation(mu_d=friction, **about, **sticks, amplitude=parameters[size])
    elif parameters["sigma_mu"] == 0 and list(friction) == list(static):
        off = 0.0
    name = "sliding limit" + (
        _UNKNOWN if math.isnan(off) else ", its deviation measured" if off else ", exact"
    )
    return Prediction("", (), values, law=name, values=values, deviation=off)


def _clean(
    parameters: Mapping[str, Number], gain: float, sliding: tuple[float, ...]
) -> tuple[str, tuple[float, ...]]:
    """Return law and velocities of a chain without disorder, outside the measured range."""
    law, held, n = "sliding limit", sliding, int(parameters["n"])
    possible = {(n + 3 - 2 * i) * gain + 0.0 for i in _pivots_by_window(parameters)}
    if len(possible) > 1:
        law, held = "sliding limit of each possible pivot", tuple(sorted(possible))
        if n >= FEWEST_CLEAN:  # the pivot hops
            law = "between the sliding limits of possible pivots"
    if "amplitude" in parameters and any(held):
        (locked,) = law_values(locked_ends_amplitude, parameters)
        if parameters["amplitude"] <= max(float(_at_rest(parameters)), locked):
            law, held = f"{law}, or locked", tuple(sorted({0.0, *held}))
    return law, held


def _at_rest(parameters: Mapping[str, Number]) -> Number:
    coefficients = [parameters["mu_s"]] * int(parameters["n"])
    return at_rest_amplitude(parameters["l0"], parameters["tan_alpha"], coefficients)


def _rest(parameters: Mapping[str, Number], *, relaxed: bool) -> str:
    """Return why a chain comes to rest for ever under cycles, or an empty string.

    Up to at_rest_amplitude some state is at rest, but some chains creep there. Below the corrected
    onset of Eq. 22 none crept: of 752 runs of 188 chains without disorder (N from 3 to 12, four
    starts each), none moved in the last 200 of 3000 cycles. Between the two, 44 of 252 did.
    """
    amplitude, mu_s = parameters["amplitude"], parameters["mu_s"]
    (least,) = law_values(no_lasting_creep_amplitude, parameters)
    if amplitude < least * (1 - 1e-12):
        return "rest: no creep lasts, proved"
    if parameters["sigma_mu"] > 0 or mu_s == parameters["mu_d"]:
        return ""
    held = float(mu_s - parameters["tan_alpha"]) * float(cosine(parameters["tan_alpha"]))
    if relaxed and float(parameters["l0"] * amplitude) < held * (1 - 2**-40):
        return "rest: no end of the relaxed chain starts, proved"
    (onset,) = law_values(onset_amplitude, parameters)
    if parameters["n"] > 2 and amplitude < min(float(_at_rest(parameters)), onset):
        return "rest: a state at rest exists, and all chains tried lost their creep"
    return ""


def _pivots_by_window(parameters: Mapping[str, Number]) -> range:
    n, slope, mu_d, mu_s = (parameters[name] for name in ("n", "tan_alpha", "mu_d", "mu_s"))
    first, last = (n + 2 - (n * slope + off) / mu_d for off in (mu_s - mu_d, mu_d - mu_s))
    return range(max(2, math.ceil(first / 2)), min(n + 1, math.floor(last / 2 + 1)) + 1)


_LAWS = {
    "amplitude": (paper.creep_velocity, sliding_velocity, sticking_velocity),
    "sigma_theta": (
        paper.creep_velocity_random, sliding_velocity_random, sticking_velocity_random,
    ),
}  # fmt: skip
