"""Random numbers: each is a function of its seed and its purpose.

>>> chain = Chain(3, 1000, "0.5", "0.6", sigma_mu="0.01", tan_alpha="0.25")
>>> disorder.static_coefficients(chain, seed=1, n=2, first=0, count=3).round(4)
array([0.6039, 0.5999, 0.6094])
"""

from exactcreep.model.drive import dilations
from exactcreep.model.keyed_disorder import (
    static_coefficient,
    static_coefficients,
    uniform_tensions,
)

__all__ = [
    "dilations",
    "static_coefficient",
    "static_coefficients",
    "uniform_tensions",
]
