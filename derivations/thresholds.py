"""That a half-cycle sets a whole chain in motion from the amplitude (N m + D)/(2 l0) on."""

from __future__ import annotations

import sympy as sp

from derivations.entry import Backed, Backing, Lines, entries_of
from derivations.judges import Judge, follows, inequality, vanishes
from derivations.model import Model, T, solved
from derivations.notation import (
    Expression,
    Formula,
    N,
    amplitude,
    c,
    excess,
    f,
    i,
    l0,
    mu_d,
    mu_s,
    s,
    slope_margin,
    symbol,
)
from derivations.proof import Proof, chapter

change, difference = symbol("Delta_theta_star"), {symbol("Delta_mu"): mu_s - mu_d}
"""Change of theta since the end of the dilation; negative in a contraction."""


@chapter(
    "Thresholds",
    "the fronts of sliding sliders carry mu_d",
    "no inertia",
    "slider i - 1 is the pivot of the dilation before",
    "one value of mu_s",
)
def derive(p: Proof, model: Model) -> None:
    """Show the forces on the pivot while the chain contracts, and the amplitude that moves it."""
    uphill, downhill = model.push("first"), model.push("last")
    end = p.show(
        "at the end of a dilation sliders i..N have slid downhill, so T_{i-1} =",
        model.tension(i - 1, 1, downhill),
        -(N + 1 - i) * slope_margin,
        "end",
    )
    pulled = p.show(
        "in the contraction sliders 1..i-2 slide downhill by now, so T_{i-2} =",
        model.tension(i - 2, 0, -uphill),
        (i - 2) * slope_margin,
        "pulled",
    )
    grown = p.show(
        "sliders i-1 and i rest meanwhile, and theta changes by Delta_theta*: T_{i-1} =",
        end + model.push("first") * l0 * change,
        -(N + 1 - i) * slope_margin - l0 * change,
        "grown",
    )
    margin = p.show(
        "slider i-1 starts downhill when F_{i-1} - mu_s c =",
        model.force(i - 1).subs({T(i - 1): grown, T(i - 2): pulled}) - model.threshold(),
        -l0 * change - N * slope_margin - excess,
        "margin",
    )
    threshold = p.show(
        "turns positive; a half-cycle of the amplitude A* changes theta by -2 A*: A* =",
        solved(margin.subs(change, -model.swing), amplitude),
        (N * slope_margin + excess) / (2 * l0),
        "threshold",
    )
    p.show("which does not depend on i", sp.diff(threshold, i), 0)
    slides = margin + model.threshold() + model.friction(1)
    sliding = p.show(
        "for mu_s -> mu_d static friction holds no more than sliding friction: A* =",
        solved(slides.subs(change, -model.swing), amplitude),
        N * slope_margin / (2 * l0),
        "sliding",
    )
    ratio = p.show(
        "the dropped term beside the kept one",
        sp.cancel(threshold / sliding - 1),
        excess / (N * slope_margin),
        "ratio",
    )
    captions = {N: 30, mu_d: sp.Rational(1, 2), mu_s: sp.Rational(3, 5), s: c / 4}
    p.show(
        "... at N = 30, tan(alpha) = 1/4, .5, .6: 1.33 %, above a detuning of 1 %",
        ratio.subs(captions),
        sp.Rational(4, 300),
    )
    p.show(
        "the largest chain that cycles of the amplitude A move, for mu_s -> mu_d: N =",
        solved(sliding - amplitude, N),
        2 * l0 * amplitude / slope_margin,
        "largest",
    )
    p.show(
        "... with D",
        solved(threshold - amplitude, N),
        (2 * l0 * amplitude - excess) / slope_margin,
        "largest_exact",
    )


def _pulls(r: Lines) -> dict[object, object]:
    """Return the forces that the sliders around the pivot exert on each other."""
    values = {(-1, 0): -r.end, (-1, -2): r.pulled, (0, -1): r.grown, (-2, -1): -r.pulled}

    def force(exerting: Expression, on: Expression) -> Expression:
        pair = (sp.expand(exerting - i), sp.expand(on - i))
        return values.get(pair, f(exerting, on))

    return {"f": force}


def _small(r: Lines, exactly: bool) -> Judge:
    """Judge what must be small for the term in mu_s - mu_d to be negligible."""
    ratio = r.ratio

    def judge(formula: Formula) -> bool:
        if formula.relations != ("<<",) or formula.sides[1] != 1:
            return False
        factor = sp.cancel(formula.bound(difference).left / ratio)
        return vanishes(factor - 1) if exactly else not factor.has(N, mu_s)

    return judge


def _two_digits(r: Lines) -> Judge:
    """Judge the number of a caption: Eq. (seuil) at its parameters, rounded to two digits."""
    tan = sp.Rational(1, 4)
    numbers = {N: 30, l0: 1000, mu_d: sp.Rational(1, 2), s: tan * c}
    value = r.sliding.subs(numbers).subs(c, 1 / sp.sqrt(1 + tan**2))
    rounded = sp.floor(value * 10000 + sp.Rational(1, 2)) / 10000
    return follows({symbol("A_theta_star"): rounded})


def _threshold(value: Expression) -> Judge:
    return follows(difference | {symbol("A_theta_star"): value})


LINES: dict[str, Backed | None] = {
    "forcestatique": lambda r: follows(_pulls(r)),
    "pull_above": lambda r: follows(_pulls(r)),
    "pull_below": lambda r: follows(_pulls(r)),
    "chain_starts": lambda r: inequality(_pulls(r), r.margin),
    "contraction_needed": lambda r: inequality(difference, r.margin),
    "contraction_amplitude": lambda r: follows({symbol("Delta_theta"): -r.model.swing}),
    "seuil": lambda r: Backing(_threshold(r.sliding), _threshold(r.threshold)),
    "small_difference": lambda r: Backing(_small(r, False), _small(r, True)),
    "threshold_of_size": lambda r: (
        vanishes(sp.diff(r.alone("threshold"), i)) and vanishes(sp.diff(r.alone("sliding") / N, N))
    ),
    "largest_chain": lambda r: Backing(
        inequality({}, N - r.largest), inequality(difference, N - r.largest_exact)
    ),
    "threshold_value": _two_digits,
}
ENTRIES = entries_of("thresholds", derive, LINES)
