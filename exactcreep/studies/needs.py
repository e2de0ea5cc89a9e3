"""What a scene needs of a model, one line for each feature, and the law where a law answers."""

from __future__ import annotations

import numpy as np

from exactcreep.laws import pivots, prediction
from exactcreep.model.numbers import nearest_float
from exactcreep.quasistatic.experiment import Experiment

FLOAT_DIGITS = 15
"""Significant digits that float64 holds."""
_SWINGS = 10_000  # targets whose mean distance is the swing of theta
_MANY_SLIPS = 100  # least slips of an end in a swing; then slips shift the threshold by under 1 %
_NEXT_PIVOT = 0.025  # most change of the descent by one pivot, relative


def needs(experiment: Experiment) -> dict[str, str]:
    """Return by name what an experiment needs or does not need, and why.

    ``law`` has the mean velocity that theory predicts, and says whether it is the answer, so that
    no run is needed.
    """
    chain, drive = experiment.chain, experiment.drive
    recorded = ", ".join(name for name in experiment.record if name != "x_G")
    found = prediction(chain, drive, experiment.start)
    digits = experiment.digits or FLOAT_DIGITS
    answered = found is not None and found.deviation == 0 and not recorded
    inertia, why = True, "each slip feels the excess mu_s - mu_d and may set neighbours in motion"
    if answered:
        inertia, why = False, "a law tells the mean velocity without following any slip"
    elif chain.slides:
        inertia, why = False, "mu_s = mu_d without disorder: there are no slips, take sliding"
    elif _continuous(experiment):
        inertia, why = False, "so many slips in each swing that sliding gives the mean descent to"
        why += f" {100 * _NEXT_PIVOT:g} % (measured on 10 to 80 contacts, not proved)"
    sigma, many = nearest_float(chain.sigma_mu), digits > FLOAT_DIGITS
    drawn = f"sigma_mu = {sigma:.3g}, a coefficient is drawn at every stop"
    asked = f"{digits} are asked for, float64 holds {FLOAT_DIGITS}"
    lines = {
        name: f"{'needed' if needed else 'not needed'}: {reason}"
        for name, needed, reason in (
            ("disorder", inertia and sigma, drawn if sigma else "sigma_mu = 0"),
            ("inertia", inertia, why),
            ("random dilations", drive.random, f"theta is {'drawn' if drive.random else 'given'}"),
            ("digits", many, asked if many else "float64 holds all that are asked for"),
            ("trajectories", recorded, f"recorded: {recorded or 'at most x_G'}"),
        )
    }
    if found is not None and found.values:
        values = " or ".join(f"{value:.10g}" for value in found.values)
        off = f" ± {found.deviation:.2g}" if found.deviation > 0 else ""
        answer = "is the answer" if answered else "to compare with"
        lines["law"] = f"{answer}: {values}{off} per {drive.per} ({found.law})"
    return lines


def _continuous(experiment: Experiment) -> bool:
    """Return whether slips are many, and the next pivot changes the descent by little."""
    chain, drive = experiment.chain, experiment.drive
    if chain.unlike or drive.springs or not 0 < (slope := abs(chain.tan_alpha)) < chain.mu_d:
        return False
    targets = drive.targets(1, min(drive.target_count, _SWINGS), experiment.seed)
    swing = np.abs(np.diff(targets, prepend=experiment.theta)).mean() / 2
    taken = chain.n * float(chain.mu_d - slope) * chain.cos_alpha / 2
    many = float(chain.l0) * swing - taken >= _MANY_SLIPS * 2 * chain.excess
    gear = chain.n + 3 - 2 * max(pivots(chain.n, slope, chain.mu_d))
    return bool(many and _NEXT_PIVOT * gear >= 2)
