from .differing import (
    PivotSliders as PivotSliders,
    differing_intercept as differing_intercept,
    differing_slope as differing_slope,
    differing_velocity as differing_velocity,
    pivot_sliders as pivot_sliders,
)
from .level import (
    level_displacement as level_displacement,
    level_increment as level_increment,
)
from .number_types import cosine as cosine
from .paper import (
    PivotWindow as PivotWindow,
    creep_velocity as creep_velocity,
    creep_velocity_random as creep_velocity_random,
    critical_angle as critical_angle,
    law_values as law_values,
    onset_amplitude as onset_amplitude,
    pivot as pivot,
    pivot_force as pivot_force,
    pivot_window as pivot_window,
    pivots as pivots,
    plateau_ends as plateau_ends,
    plateau_velocity as plateau_velocity,
    plateau_velocity_random as plateau_velocity_random,
    solid_velocity as solid_velocity,
    threshold_amplitude as threshold_amplitude,
    threshold_width as threshold_width,
    two_sliders_velocity as two_sliders_velocity,
    two_sliders_velocity_random as two_sliders_velocity_random,
)
from .predictions import (
    Prediction as Prediction,
    prediction as prediction,
    prediction_of as prediction_of,
)
from .staircase import staircase_two_sliders as staircase_two_sliders
from .sticking import (
    beyond_sticking as beyond_sticking,
    sticking_deviation as sticking_deviation,
    sticking_velocity as sticking_velocity,
)
from .theorems import (
    at_rest_amplitude as at_rest_amplitude,
    edges as edges,
    locked_ends_amplitude as locked_ends_amplitude,
    no_lasting_creep_amplitude as no_lasting_creep_amplitude,
)
from .velocities import (
    gaussian_integral as gaussian_integral,
    sliding_velocity as sliding_velocity,
    sliding_velocity_random as sliding_velocity_random,
)
