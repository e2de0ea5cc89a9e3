"""Remarks: warnings about input that the model allows and that is most likely a mistake.

A warning names the line outside the package that called it.
"""

from __future__ import annotations

import math
import sys
import warnings
from typing import Any

import numpy as np

_FRICTION = "a coefficient of friction is mostly between 0.1 and 1"
_PLAUSIBLE = {
    "tan_alpha": (3, ""),
    "mu": (10, _FRICTION),
    "mu_d": (10, _FRICTION),
    "mu_s": (10, _FRICTION),
    "sigma_mu": (0.5, "static coefficients mostly scatter by less than 0.1"),
    "kappa": (0.001, "solids expand by some 1e-5 of their length per kelvin"),
    "steps": (1e6, "so many time steps in one tau_dyn; Verlet mostly takes 10 to 1000"),
    "sliders": (500_000, "a run takes about a kilobyte of memory for each"),
}
"""Largest plausible value of each quantity, and the remark about larger values."""
THETA_BEYOND_ONE = (
    "|theta| reaches 1, where a spring of the model has no length left: theta is a thermal strain,"
    " the expansion coefficient times the change of temperature, e.g. 0.0009 for lead and 30 K"
)


class PhysicsWarning(UserWarning):
    """A parameter is implausible, or a run has left the model's physical range.

    Examples
    --------
    >>> import warnings
    >>> with warnings.catch_warnings(record=True, action="always") as caught:
    ...     steep = Chain(2, 10, "0.5", "0.6", tan_alpha=15)
    >>> print(caught[0].message)
    tan_alpha = 15: a slope of 86 degrees? tan_alpha is the slope, the tangent of the angle: \
0.268 for 15 degrees
    """


def warn(said: str, category: type[Warning] = PhysicsWarning) -> None:
    """Warn at the line that called the package."""
    frame, level, outside = sys._getframe(), 1, 2
    while frame.f_back is not None:
        if frame.f_globals.get("__name__", "").partition(".")[0] == __name__.partition(".")[0]:
            outside = level + 1
        frame, level = frame.f_back, level + 1
    warnings.warn(said, category, stacklevel=outside)


def in_degrees(angle: Any) -> str:
    """Return the name for a slope's angle, with its value if the angle is a number."""
    degrees = angle if isinstance(angle, (int, float)) and abs(angle) < 90 else 15
    slope = math.tan(math.radians(degrees))
    return f"tan_alpha is the slope, the tangent of the angle: {slope:.3g} for {degrees:g} degrees"


def remark(name: str, value: Any) -> None:
    """Warn if a quantity, or one of several, is implausibly large."""
    most, said = _PLAUSIBLE.get(name, (math.inf, ""))
    values = np.ravel(value) if isinstance(value, np.ndarray) else [value]
    largest = float(max(values, key=abs, default=0.0))
    if not abs(largest) > most:
        return
    if name == "tan_alpha":
        angle = f"{math.degrees(math.atan(abs(largest))):.0f} degrees"
        said = f"a slope of {angle}? {in_degrees(largest)}"
    warn(f"{name} = {largest:g}: {said}")
