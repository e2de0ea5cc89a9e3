"""Why measured velocities depart from the laws: where they do, and the words that say it."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Any

from exactcreep.figures.tables import Point
from exactcreep.laws import LAWS, cosine, critical_amplitude, law_values

NEGLECTED = "the excess mu_s - mu_d and its scatter, which the sliding limit neglects"
"""What remains where nothing else explains a departure."""
BELOW_THRESHOLD = "Below the threshold the printed law is negative, where the exact one is zero."
"""The note of a table of the paper's Eq. (vitesse_seuil)."""
_BROAD = Fraction(3)
"""Half-width of a transition between plateaus under disorder, in units of (mu_s - mu_d)/N."""


def margin(parameters: Mapping[str, Any]) -> float:
    """Return m = mu_d cos(alpha) - sin(alpha)."""
    slope = parameters["tan_alpha"]
    return float(parameters["mu_d"] - slope) * float(cosine(slope))


def setting_amplitude(parameters: Mapping[str, Any]) -> float:
    """Return the amplitude (N m + D)/(2 l0) that sets the whole chain in motion."""
    return law_values(LAWS["seuil"].corrected, parameters)[0]


def reduced(point: Point, size: str = "amplitude") -> float:
    """Return the amplitude (or the width of random dilations) in units of A*."""
    return float(point.parameters[size]) / critical_amplitude(point.parameters)


def plateau_edges(n: int, friction: Fraction) -> list[Fraction]:
    """Return the slopes mu_d (1 - 2 (i - 1)/N), i = 1 ... N + 1, between two plateaus."""
    return [friction * (1 - Fraction(2 * k, n)) for k in range(n + 1)]


def nearest_edge(point: Point) -> tuple[Fraction, Fraction]:
    """Return the edge between two plateaus nearest to the slope, and how far it is.

    The distance is in units of (mu_s - mu_d)/N: within one, two pivots are stable.
    """
    n, slope, friction = (point.parameters[name] for name in ("n", "tan_alpha", "mu_d"))
    edge = min(plateau_edges(int(n), friction), key=lambda value: abs(value - slope))
    return edge, abs(edge - slope) * n / (point.parameters["mu_s"] - friction)


def pivot_remark(point: Point) -> str:
    """Return what makes a velocity lie between two plateaus, `NEGLECTED` far from their edges."""
    friction = point.parameters["mu_d"]
    edge, distance = nearest_edge(point)
    if abs(edge) == friction and friction - abs(point.parameters["tan_alpha"]) < Fraction(1, 20):
        return "close to mu_d: the chain slips as a whole, and inertia carries it on"
    if distance == 0:
        return f"at the edge tan(alpha) = {float(edge):.4g} both pivots are equally possible"
    if point.parameters["sigma_mu"] == 0:
        return "the excess mu_s - mu_d, which the sliding limit neglects"
    if distance <= _BROAD and abs(edge) != friction:
        return (
            f"within {int(_BROAD)} (mu_s - mu_d)/N of the edge tan(alpha) = {float(edge):.4g}:"
            " under disorder both pivots occur"
        )
    return NEGLECTED
