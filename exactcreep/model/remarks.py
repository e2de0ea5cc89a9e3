"""Remarks: warnings about input that the model allows and that is most likely a mistake.

A warning names the line outside the package that called it.
"""

from __future__ import annotations

import math
import sys
import warnings
from typing import Any

import numpy as np

_PLAUSIBLE = {"tan_alpha": 3, "mu": 10, "mu_d": 10, "mu_s": 10}
"""Slopes and coefficients of friction up to which nothing is said."""
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
    """Return what the slope of an angle is called, and what it is where the angle is a number."""
    degrees = angle if isinstance(angle, (int, float)) and abs(angle) < 90 else 15
    slope = math.tan(math.radians(degrees))
    return f"tan_alpha is the slope, the tangent of the angle: {slope:.3g} for {degrees:g} degrees"


def remark(name: str, value: Any) -> None:
    """Warn if a slope or a coefficient of friction, or one of several, is implausibly large."""
    largest = float(np.abs(value).max(initial=0.0) if isinstance(value, np.ndarray) else abs(value))
    if largest <= _PLAUSIBLE.get(name, math.inf):
        return
    if name == "tan_alpha":
        angle = f"{math.degrees(math.atan(largest)):.0f} degrees"
        warn(f"tan_alpha = {largest:g}: a slope of {angle}? {in_degrees(largest)}")
    else:
        warn(f"{name} = {largest:g}: a coefficient of friction is mostly between 0.1 and 1")
