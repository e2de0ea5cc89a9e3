"""What a scene needs of a model, one line for each feature, and the law where a law answers."""

from __future__ import annotations

from exactcreep.laws import prediction
from exactcreep.model.numbers import nearest_float
from exactcreep.quasistatic.experiment import Experiment

FLOAT_DIGITS = 15
"""Significant digits that float64 holds."""


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
