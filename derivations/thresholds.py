"""That a half-cycle sets a whole chain in motion from the amplitude (N m + D)/(2 l0) on."""

from __future__ import annotations

import sympy as sp

from derivations.judges import inequality, small, vanishes, within
from derivations.model import Model, solved
from derivations.notation import (
    CAPTIONS,
    Formula,
    N,
    amplitude,
    at,
    excess,
    i,
    l0,
    mu_s,
    slope_margin,
    star,
    symbol,
)
from derivations.proof import Proof, chapter

change = symbol("Delta_theta_star")
"""Change of theta since the end of the dilation (negative in a contraction)."""


@chapter(
    "Thresholds",
    "the fronts of sliding sliders carry mu_d",
    "no inertia",
    "slider i - 1 is the pivot of the dilation before",
    "one value of mu_s",
)
def derive(p: Proof, model: Model) -> None:
    """Show the forces on the pivot while the chain contracts, and the amplitude that moves it."""
    end = p.show(
        "at the end of a dilation sliders i..N have slid downhill, so T_{i-1} =",
        model.tension(i - 1, 1, model.push("last")),
        -(N + 1 - i) * slope_margin,
    )
    p.entry("forcestatique", {"f": at({(i - 1, i): -end})})
    pulled = p.show(
        "in the contraction sliders 1..i-2 slide downhill by now, so T_{i-2} =",
        model.tension(i - 2, 0, -model.push("first")),
        (i - 2) * slope_margin,
    )
    p.entry("pull_above", {"f": at({(i - 1, i - 2): pulled})})
    grown = p.show(
        "sliders i-1 and i rest meanwhile, and theta changes by Delta_theta*: T_{i-1} =",
        end + model.push("first") * l0 * change,
        -(N + 1 - i) * slope_margin - l0 * change,
    )
    p.entry("pull_below", {"f": at({(i, i - 1): grown})})
    margin = p.show(
        "slider i-1 starts downhill when F_{i-1} - mu_s c =",
        model.between(pulled, grown) - model.threshold(),
        -l0 * change - N * slope_margin - excess,
    )
    pulls = {"f": at({(i, i - 1): grown, (i - 2, i - 1): -pulled})}
    p.entry("chain_starts", inequality(pulls, margin))
    p.entry("contraction_needed", inequality({}, margin))
    p.alone("contraction_amplitude", {symbol("Delta_theta"): -model.swing})
    slides = margin + model.threshold() + model.friction(1)
    sliding = p.show(
        "turns positive; a half-cycle of the amplitude A* changes theta by -2 A*, so A* = "
        "(mu_s -> mu_d: static friction holds no more than sliding friction)",
        solved(slides.subs(change, -model.swing), amplitude),
        N * slope_margin / (2 * l0),
        "sliding",
    )
    threshold = p.show(
        "... and with mu_s A* =",
        solved(margin.subs(change, -model.swing), amplitude),
        (N * slope_margin + excess) / (2 * l0),
    )
    p.entry("seuil", {star: sliding}, {star: threshold}, lines=2)
    p.show("which does not depend on i", sp.diff(threshold, i), 0)
    p.entry("threshold_of_size", holds=vanishes(sp.diff(sliding / N, N)))
    dropped = p.show(
        "the dropped term beside the kept one",
        sp.cancel(threshold / sliding - 1),
        excess / (N * slope_margin),
    )

    def neglects(formula: Formula) -> bool:
        factor = sp.cancel(formula.bound({}).left / dropped)
        beside = formula.relations == ("<<",) and formula.right == 1
        return beside and not factor.has(N, mu_s)

    p.entry("small_difference", neglects, small({}, dropped, sp.Integer(1)))
    p.show(
        "... at N = 30, tan(alpha) = 1/4, .5, .6: 1.33 %, above a detuning of 1 %",
        dropped.subs(CAPTIONS),
        sp.Rational(4, 300),
    )
    p.alone("threshold_value", within(sliding.subs(CAPTIONS), 1.014, "A_theta_star"))
    largest = p.show(
        "the largest chain that cycles of the amplitude A move, for mu_s -> mu_d: N =",
        solved(sliding - amplitude, N),
        2 * l0 * amplitude / slope_margin,
    )
    exact = p.show(
        "... with D",
        solved(threshold - amplitude, N),
        (2 * l0 * amplitude - excess) / slope_margin,
    )
    bounds = inequality({}, N - largest), inequality({}, N - exact)
    p.entry("largest_chain", *bounds, lines=2)
