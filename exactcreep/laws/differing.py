"""Laws of chains whose friction differs from slider to slider, or whose ends are pulled.

In the sliding limit, slider p rests while the chain dilates, and slider q while it contracts. The
half-width of the play of the springs between them is h. G is the sum of weights and end forces.
Forces have the unit ``m g``, lengths ``g tau_dyn**2``. Derivation: ``derivations/unlike.py``.
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from itertools import accumulate
from typing import NamedTuple

from exactcreep.laws.number_types import (
    Number,
    coerced,
    cosine,
    positive_part,
    rational,
    require,
)
from exactcreep.laws.paper import described
from exactcreep.laws.velocities import gaussian_integral
from exactcreep.model.numbers import sign_of_surd


class PivotSliders(NamedTuple):
    """The sliders that rest in the sliding limit, counted from 1 at the upper end.

    Parameters
    ----------
    dilation, contraction : tuple of int
        One slider, or two neighbours where the balance of forces does not decide between them.

    Examples
    --------
    >>> pivot_sliders([0.5] * 4, 0.25).apart
    (1, 3)
    """

    dilation: tuple[int, ...]
    contraction: tuple[int, ...]

    @property
    def apart(self) -> tuple[int, ...]:
        """q - p: one number, or the least and the largest where the limit is not unique."""
        least = self.contraction[0] - self.dilation[-1]
        most = self.contraction[-1] - self.dilation[0]
        return (least,) if least == most else (least, most)


@described
def pivot_sliders(
    mu_d: Sequence[Number], tan_alpha: Number, end_forces: Sequence[Number] = (0, 0)
) -> PivotSliders:
    """Return the slider that rests in dilations, and the slider that rests in contractions.

    With ``b_n = mu_d[n - 1] c``, slider p rests in a dilation if
    ``|G - (sum of b_n below p - sum of b_n above p)| < b_p``. For slider q, in a contraction, the
    two sums change places. The comparison uses the exact values of the arguments. Source:
    ``derivations/unlike.py``.

    Returns
    -------
    PivotSliders
        Both sliders; two neighbours where the forces are equal.

    Raises
    ------
    ValueError
        Unless friction holds the chain: ``|G|`` below the sum of ``b_n``.

    Examples
    --------
    A slate that is rough enough rests in dilations and contractions, and stops a roof:

    >>> smooth, rough = Fraction(1, 2), Fraction(4)
    >>> pivot_sliders([smooth] * 6, Fraction(1, 5))
    PivotSliders(dilation=(2,), contraction=(5,))
    >>> pivot_sliders([rough] + [smooth] * 5, Fraction(1, 5))
    PivotSliders(dilation=(1,), contraction=(1,))
    """
    friction, slope = [rational(mu) for mu in mu_d], rational(tan_alpha)
    weight, pull = len(friction) * slope, sum(map(rational, end_forces), rational(0))
    radicand = 1 + slope * slope
    require(bool(friction) and min(friction) >= 0, "mu_d must hold coefficients, none negative")
    above = [*accumulate(friction, initial=rational(0))]
    below = [above[-1] - 2 * part for part in above]

    def crossing(way: int) -> tuple[int, ...]:
        def passed(spring: int) -> int:
            """Return -1 if the lower bound of a spring is nearer, 1 if the upper, 0 if both."""
            return -sign_of_surd(below[spring] - way * weight, -way * pull, radicand)

        springs = range(len(below))
        held = "friction must hold the chain: |weight + end forces| below the sum of mu_d c"
        require(passed(0) < 0 < passed(-1), held)
        first, last = (find(springs, 0, key=passed) for find in (bisect_left, bisect_right))
        return tuple(range(first, last + 1))

    return PivotSliders(crossing(1), crossing(-1))


@described
def differing_intercept(
    mu_d: Sequence[Number], tan_alpha: Number, end_forces: Sequence[Number] = (0, 0)
) -> Number:
    """Return ``h = (sum of mu_d c - |G|)/2``: a chain creeps in cycles if ``l0 A`` exceeds h.

    Source: ``derivations/unlike.py``.

    Returns
    -------
    number
        Load ``l0 A``, unit ``g tau_dyn**2``.

    Examples
    --------
    >>> differing_intercept([Fraction(1, 2)] * 3 + [4], Fraction(3, 4))
    Fraction(1, 1)
    """
    names = [f"mu_d[{k}]" for k in range(len(mu_d))]
    given = {"tan_alpha": tan_alpha} | dict(zip(names, mu_d, strict=True))
    given |= {f"end_forces[{k}]": force for k, force in enumerate(end_forces)}
    values = coerced(given)
    slope, c = values["tan_alpha"], cosine(values["tan_alpha"])
    pull = values["end_forces[0]"] + values["end_forces[1]"]
    return (sum(values[name] for name in names) * c - abs(len(names) * slope * c + pull)) / 2


@described
def differing_velocity(
    *,
    l0: Number,
    mu_d: Sequence[Number],
    tan_alpha: Number,
    amplitude: Number,
    end_forces: Sequence[Number] = (0, 0),
) -> tuple[Number, ...]:
    """Return ``(q - p) max(0, l0 A - h)``, exact for mu_s -> mu_d under cycles.

    `pivot_sliders` gives p and q, `differing_intercept` h. With equal friction and no end forces
    the law is Eq. 23, `sliding_velocity`. Source: ``derivations/unlike.py``.

    Returns
    -------
    tuple of number
        Advance of each slider per half-cycle, unit ``g tau_dyn**2``: one number, or the least and
        the largest where the limit is not unique.

    Raises
    ------
    ValueError
        Unless friction holds the chain.

    Examples
    --------
    >>> chain = {"l0": 1000, "tan_alpha": 0.25, "amplitude": 0.005}
    >>> [round(v, 4) for v in differing_velocity(mu_d=[0.5] * 30, **chain)]
    [20.4295]
    """
    length, size = coerced({"l0": l0, "amplitude": amplitude}).values()
    beyond = positive_part(length * size - differing_intercept(mu_d, tan_alpha, end_forces))
    return tuple(apart * beyond for apart in pivot_sliders(mu_d, tan_alpha, end_forces).apart)


@described
def differing_velocity_random(
    *,
    l0: Number,
    mu_d: Sequence[Number],
    tan_alpha: Number,
    sigma_theta: Number,
    end_forces: Sequence[Number] = (0, 0),
) -> tuple[Number, ...]:
    """Return ``(q - p) l0 sigma_theta I(h/(l0 sigma_theta))``, exact for mu_s -> mu_d.

    I is `gaussian_integral`. Source: ``derivations/unlike.py`` and ``derivations/gaussian.py``.

    Returns
    -------
    tuple of number
        Advance of each slider per target, unit ``g tau_dyn**2``: one number, or the least and the
        largest where the limit is not unique.

    Raises
    ------
    ValueError
        Unless friction holds the chain, and sigma_theta > 0.

    Examples
    --------
    >>> chain = {"l0": 1000, "tan_alpha": 0.25, "sigma_theta": 0.01}
    >>> [round(v, 4) for v in differing_velocity_random(mu_d=[0.5] * 30, **chain)]
    [52.7969]
    """
    length, size = coerced({"l0": l0, "sigma_theta": sigma_theta}).values()
    require(size > 0, "sigma_theta must be positive")
    width = length * size
    mean = width * gaussian_integral(differing_intercept(mu_d, tan_alpha, end_forces) / width)
    return tuple(apart * mean for apart in pivot_sliders(mu_d, tan_alpha, end_forces).apart)


@described
def differing_slope(
    mu_d: Sequence[Number],
    tan_alpha: Number,
    expansion: Sequence[Number],
    end_forces: Sequence[Number] = (0, 0),
) -> tuple[Number, ...]:
    """Return dv/d(l0 A) at large amplitude of a chain whose springs expand by different weights.

    The slope is the sum of the weights of the springs between p and q, negative if q lies above p.
    It is exact for mu_s -> mu_d. The velocity also has a constant term, which no law gives. Source:
    ``derivations/unlike.py``.

    Returns
    -------
    tuple of number
        One slope, or the least and the largest where the limit is not unique.

    Raises
    ------
    ValueError
        Unless friction holds the chain and there are N - 1 positive weights.

    Examples
    --------
    >>> differing_slope([0.5] * 4, 0.2, [1, 2, 3])
    (2,)
    """
    springs = len(mu_d) - 1
    right = len(expansion) == springs and all(weight > 0 for weight in expansion)
    require(right, f"expansion must hold {springs} positive weights")
    above = [0, *accumulate(expansion)]  # sum of the weights above each slider
    found = pivot_sliders(mu_d, tan_alpha, end_forces)
    least = above[found.contraction[0] - 1] - above[found.dilation[-1] - 1]
    most = above[found.contraction[-1] - 1] - above[found.dilation[0] - 1]
    return (least,) if least == most else (least, most)


_MEASURED = 0.023
_FEWEST, _MOST = 8, 30  # sliders of the chains that were measured
_LEAST, _DRAWN, _STICKIEST = 2.5, 0.5, 0.6


@described
def differing_deviation(
    *,
    l0: Number,
    mu_d: Sequence[Number],
    mu_s: Sequence[Number],
    tan_alpha: Number,
    amplitude: Number,
    sigma_mu: Number = 0,
    end_forces: Sequence[Number] = (0, 0),
) -> float:
    """Return how far the velocity of chains that stick and slip is from `differing_velocity`.

    The deviation ``0.023 N (l0 A - h)`` is the root mean square over eighty random chains, which
    were fixed before any was run (``tests/laws/differing_chains.py``). 72 % of them differ by less,
    96 % by less than twice as much. They have 8 to 30 sliders whose friction differs by up to half
    of the mean (shorter chains differ by up to ten times as much), end forces of either sign, and
    cycles with ``l0 A - h`` of at least 2.5 times the mean of ``(mu_s - mu_d) cos(alpha)``. `mu_s`
    is the mean static coefficient of each slider.

    Returns
    -------
    float
        Unit ``g tau_dyn**2`` per half-cycle; 0 where the law is exact, nan outside the measured
        range.

    Examples
    --------
    >>> chain = {"l0": 1000, "tan_alpha": 0.1, "amplitude": 0.003}
    >>> round(differing_deviation(mu_d=[0.4, 0.6] * 4, mu_s=[0.5, 0.7] * 4, **chain), 3)
    0.259
    """
    n, c = len(mu_d), float(cosine(tan_alpha))
    gain = float(l0 * amplitude) - float(differing_intercept(mu_d, tan_alpha, end_forces))
    mean = float(sum(mu_d)) / n
    excess = float(sum(mu_s)) / n - mean
    if list(mu_s) == list(mu_d) and not sigma_mu:
        return 0.0
    measured = (
        _FEWEST <= n <= _MOST
        and gain >= _LEAST * excess * c
        and excess <= _STICKIEST * mean
        and float(sigma_mu) <= _DRAWN * excess
    )
    return _MEASURED * n * gain if measured else math.nan
