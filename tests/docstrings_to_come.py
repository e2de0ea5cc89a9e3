"""Public names whose docstrings do not have all sections of numpydoc yet; a list that shrinks."""

TO_COME: set[str] = {
    "GivenUp",
    "HalfLife.dataset",
    "HalfLife.evidence",
    "Intercept.dataset",
    "Intercept.evidence",
    "Threshold.dataset",
    "Threshold.law_corrected",
    "Threshold.law_seuil",
    "Threshold.law_two_sliders",
    "Threshold.what",
    "half_life",
    "intercept",
    "plan",
    "threshold",
}
