"""The laws of theory: the formulas of the paper, their corrections, and the exact laws behind them.

Every law is a function of the numbers that describe a chain and its drive, by name::

    >>> critical_angle(n=7, i=3, mu_d=Fraction(1, 2), mu_s=Fraction(3, 5))
    Fraction(8, 35)

The result has the type of the arguments: rationals (``int``, ``Fraction``) give rationals where the
result is rational, floats give floats, arrays broadcast to float64 arrays, mpmath numbers give
mpmath numbers of their context. On which side of a boundary an argument lies is always decided
exactly. `exactcreep.laws.paper` has the units and symbols, ``derivations/ledger.toml`` the proofs.
"""

from exactcreep.laws.differing import (
    PivotSliders,
    differing_intercept,
    differing_slope,
    differing_velocity,
    pivot_sliders,
)
from exactcreep.laws.level import level_displacement, level_increment
from exactcreep.laws.number_types import cosine
from exactcreep.laws.paper import (
    PivotWindow,
    creep_velocity,
    creep_velocity_random,
    critical_angle,
    law_values,
    onset_amplitude,
    pivot,
    pivot_force,
    pivot_window,
    pivots,
    plateau_ends,
    plateau_velocity,
    plateau_velocity_random,
    solid_velocity,
    threshold_amplitude,
    threshold_width,
    two_sliders_velocity,
    two_sliders_velocity_random,
)
from exactcreep.laws.predictions import Prediction, prediction, prediction_of
from exactcreep.laws.staircase import staircase_two_sliders
from exactcreep.laws.sticking import (
    beyond_sticking,
    sticking_deviation,
    sticking_velocity,
)
from exactcreep.laws.theorems import (
    at_rest_amplitude,
    edges,
    locked_ends_amplitude,
    no_lasting_creep_amplitude,
)
from exactcreep.laws.velocities import (
    gaussian_integral,
    sliding_velocity,
    sliding_velocity_random,
)
from exactcreep.model.numbers import let_refuse

__all__ = [
    "PivotSliders", "PivotWindow", "Prediction", "at_rest_amplitude", "beyond_sticking", "cosine",
    "creep_velocity", "creep_velocity_random", "critical_angle", "differing_intercept",
    "differing_slope", "differing_velocity", "edges", "gaussian_integral", "law_values",
    "level_displacement", "level_increment", "locked_ends_amplitude", "no_lasting_creep_amplitude",
    "onset_amplitude", "pivot", "pivot_force", "pivot_sliders", "pivot_window", "pivots",
    "plateau_ends", "plateau_velocity", "plateau_velocity_random", "prediction", "prediction_of",
    "sliding_velocity", "sliding_velocity_random", "solid_velocity", "staircase_two_sliders",
    "sticking_deviation", "sticking_velocity", "threshold_amplitude", "threshold_width",
    "two_sliders_velocity", "two_sliders_velocity_random",
]  # fmt: skip

let_refuse(globals())
