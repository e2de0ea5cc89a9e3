"""The plateaus of the velocity over the slope: which slider is the pivot of the sliding limit."""

from __future__ import annotations

import math
from typing import NamedTuple

from exactcreep.laws.operands import Number, coerced, rational


class PivotWindow(NamedTuple):
    """The slopes between which the index i of a plateau is possible.

    Attributes
    ----------
    lower, upper : number
        Slider i - 1 can rest during a dilation for ``lower <= tan_alpha <= upper``.
    lower_alone, upper_alone : number
        Between these no other slider can: outside, the pivot depends on the chain's history.
    """

    lower: Number
    lower_alone: Number
    upper_alone: Number
    upper: Number


def pivot_window(n: int, i: int, mu_d: Number, mu_s: Number) -> PivotWindow:
    """Return the slopes between which slider i - 1 can rest while the chain dilates.

    Parameters
    ----------
    n, i : int
        Number of sliders, index of the plateau (2 <= i <= n + 1).
    mu_d, mu_s : number
        Friction coefficients.

    Returns
    -------
    PivotWindow
        Four values of tan(alpha). Neighbouring windows overlap over a width 2 (mu_s - mu_d)/n.

    Raises
    ------
    ValueError
        If i is not an index of a plateau.

    Notes
    -----
    Derivation: ``derivations/pivots.py``; the upper edge is the paper's Eq. (critical_angle) with
    i - 1 for i, and `lower_alone` is that equation itself.
    """
    if not 2 <= i <= n + 1:
        raise ValueError(f"i must be between 2 and n + 1 = {n + 1}, not {i}")
    p = coerced({"n": n, "i": i, "mu_d": mu_d, "mu_s": mu_s})
    below = p["mu_d"] * (1 - 2 * (p["i"] - 1) / p["n"])
    above = p["mu_d"] * (1 - 2 * (p["i"] - 2) / p["n"])
    half_width = (p["mu_s"] - p["mu_d"]) / p["n"]
    return PivotWindow(
        below - half_width, below + half_width, above - half_width, above + half_width
    )


def pivots(n: int, tan_alpha: Number, mu_d: Number) -> tuple[int, ...]:
    """Return the one index i of the sliding limit's plateau, or the two where it is not unique.

    Parameters
    ----------
    n : int
        Number of sliders.
    tan_alpha, mu_d : number
        Slope and dynamical friction coefficient, |tan_alpha| < mu_d.

    Returns
    -------
    tuple of int
        ``(i,)`` with ``mu_d (1 - 2(i-1)/n) < tan_alpha < mu_d (1 - 2(i-2)/n)``, or ``(i, i + 1)``
        where the slope equals the edge between the two. Slider i - 1 rests while the chain
        dilates, slider n + 2 - i while it contracts.

    Raises
    ------
    ValueError
        If |tan_alpha| >= mu_d (the chain can run away and has no pivot) or n < 1.

    Notes
    -----
    Guarantee: the arguments are taken at their exact values; the equality is decided exactly.
    Derivation: ``derivations/pivots.py`` and ``derivations/sliding_limit.py``; window of
    Eq. (critical_angle) for mu_s -> mu_d.
    """
    count, slope, friction = int(n), rational(tan_alpha), rational(mu_d)
    if count < 1 or count != n:
        raise ValueError(f"n must be a positive integer, not {n}")
    if not abs(slope) < friction:
        raise ValueError(
            f"tan_alpha must lie between -mu_d and mu_d for a pivot, not at {tan_alpha}"
        )
    # tan_alpha n / mu_d lies between n - 2i + 2 and n - 2i + 4
    position = (count + 2 - count * slope / friction) / 2
    lowest = math.ceil(position)
    return (lowest, lowest + 1) if position == lowest else (lowest,)


def pivot(n: int, tan_alpha: Number, mu_d: Number) -> int:
    """Return the one index i of the sliding limit's plateau; see `pivots`.

    Raises
    ------
    ValueError
        As `pivots`, and where the index is not unique.
    """
    found = pivots(n, tan_alpha, mu_d)
    if len(found) == 2:
        raise ValueError(
            f"the sliding limit of n = {n} at tan_alpha = {tan_alpha} is not unique: "
            f"name i = {found[0]} or i = {found[1]}"
        )
    return found[0]
