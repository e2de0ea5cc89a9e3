"""Laws of chains whose friction differs from slider to slider, or whose ends are pulled.

In the sliding limit, slider p rests while the chain dilates, and slider q while it contracts. The
half-width of the play of the springs between them is h. G is the sum of weights and end forces.
Forces have the unit ``m g``, lengths ``g tau_dyn**2``. Derivation: ``derivations/unlike.py``.
"""

from __future__ import annotations

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
from exactcreep.laws.velocities import gaussian_integral
from exactcreep.model.numbers import refusing, sign_of_surd


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


@refusing
def pivot_sliders(
    mu_d: Sequence[Number], tan_alpha: Number, end_forces: Sequence[Number] = (0, 0)
) -> PivotSliders:
    """Return the slider that rests in dilations, and the slider that rests in contractions.

    With ``b_n = mu_d[n - 1] c``, slider p rests in a dilation if
    ``|G - (sum of b_n below p - sum of b_n above p)| < b_p``. For slider q, in a contraction, the
    two sums change places. The comparison uses the exact values of the arguments. Source:
    ``derivations/unlike.py``.

    Parameters
    ----------
    mu_d : sequence of number
        Sliding friction coefficients of sliders 1..N.
    tan_alpha : number
        See `exactcreep.laws`.
    end_forces : pair of numbers, optional
        Forces on slider 1 and on slider N.

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


@refusing
def differing_intercept(
    mu_d: Sequence[Number], tan_alpha: Number, end_forces: Sequence[Number] = (0, 0)
) -> Number:
    """Return ``h = (sum of mu_d c - |G|)/2``: a chain creeps in cycles if ``l0 A`` exceeds h.

    Source: ``derivations/unlike.py``.

    Parameters
    ----------
    mu_d : sequence of number
        Sliding friction coefficients of sliders 1..N.
    tan_alpha : number
        See `exactcreep.laws`.
    end_forces : pair of numbers, optional
        Forces on slider 1 and on slider N.

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


@refusing
def differing_velocity(
    *,
    l0: Number,
    mu_d: Sequence[Number],
    tan_alpha: Number,
    amplitude: Number | None = None,
    sigma_theta: Number | None = None,
    end_forces: Sequence[Number] = (0, 0),
) -> tuple[Number, ...]:
    """Return ``(q - p) G``, exact for mu_s -> mu_d under cycles or random dilations.

    `pivot_sliders` gives p and q, `differing_intercept` h. Under cycles ``G = max(0, l0 A - h)``,
    else ``G = l0 sigma_theta I(h/(l0 sigma_theta))`` with I of `gaussian_integral`. With equal
    friction and no end forces the laws are `sliding_velocity` and `sliding_velocity_random`.
    Source: ``derivations/unlike.py`` and ``derivations/gaussian.py``.

    Parameters
    ----------
    l0 : number
        Natural length of a spring, unit ``g tau_dyn**2``.
    mu_d : sequence of number
        Sliding friction coefficients of sliders 1..N.
    tan_alpha : number
        Slope.
    amplitude, sigma_theta : number, optional
        See `exactcreep.laws`.
    end_forces : pair of numbers, optional
        Forces on slider 1 and on slider N.

    Returns
    -------
    tuple of number
        Advance of each slider per half-cycle or target, unit ``g tau_dyn**2``: one number, or the
        least and the largest where the limit is not unique.

    Raises
    ------
    ValueError
        Unless friction holds the chain, and one of amplitude and sigma_theta > 0 is given.

    Examples
    --------
    >>> chain = {"l0": 1000, "tan_alpha": 0.25, "amplitude": 0.005}
    >>> [round(v, 4) for v in differing_velocity(mu_d=[0.5] * 30, **chain)]
    [20.4295]
    """
    one = (amplitude is None) != (sigma_theta is None)
    require(one, "give the drive as amplitude or as sigma_theta")
    random = amplitude is None
    length, size = coerced({"l0": l0, "size": sigma_theta if random else amplitude}).values()
    half = differing_intercept(mu_d, tan_alpha, end_forces)
    if random:
        require(size > 0, "sigma_theta must be positive")
        gain = length * size * gaussian_integral(half / (length * size))
    else:
        gain = positive_part(length * size - half)
    return tuple(apart * gain for apart in pivot_sliders(mu_d, tan_alpha, end_forces).apart)


@refusing
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

    Parameters
    ----------
    mu_d : sequence of number
        Sliding friction coefficients of sliders 1..N.
    tan_alpha : number
        Slope.
    expansion : sequence of number
        Weights of springs 1..N - 1, positive.
    end_forces : pair of numbers, optional
        Forces on slider 1 and on slider N.

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
