"""That a half-cycle sets a whole chain in motion from the amplitude (N m + D)/(2 l0) on."""

from __future__ import annotations

import sympy as sp

from derivations.judges import Within, inequality, small
from derivations.model import Model, T, g, m, solved
from derivations.notation import (
    CAPTIONS,
    Formula,
    N,
    amplitude,
    at,
    c,
    excess,
    i,
    l0,
    mu_s,
    slope_margin,
    star,
    static_margin,
    symbol,
)
from derivations.proof import Proof, chapter

change = symbol("Delta_theta_star")
"""Change of theta since the end of the dilation (negative in a contraction)."""


@chapter(
    "Thresholds",
    "continuous sliding",
    "no inertia",
    "slider i - 1 is the pivot",
    "one value of mu_s",
)
def derive(p: Proof, model: Model) -> None:
    """Show the forces on the pivot while the chain contracts, and the amplitude that moves it."""
    pivot, upper = T(i - 1), T(i - 2)
    end = p.show(
        f"at the end of a dilation sliders i..N have slid downhill, so {pivot} =",
        model.tension(i - 1, 1, model.driven("last")),
        -(N + 1 - i) * slope_margin,
    )
    p.entry("forcestatique", {"f": at({(i - 1, i): -end})})
    p.entry("units_of_force", corrected={"f": at({(i - 1, i): -m * g * end})})
    pulled = p.show(
        f"in the contraction the sliders above the pivot slide downhill by now, so {upper} =",
        model.tension(i - 2, 0, -model.driven("first")),
        (i - 2) * slope_margin,
    )
    p.entry("pull_above", {"f": at({(i - 1, i - 2): pulled})})
    grown = p.show(
        f"the pivot and slider i rest meanwhile, and theta changes by {change}: {pivot} =",
        end + model.push("first") * l0 * change,
        -(N + 1 - i) * slope_margin - l0 * change,
    )
    p.entry("pull_below", {"f": at({(i, i - 1): grown})})
    margin = p.show(
        "the pivot starts downhill when the force on it, less what static friction holds,",
        model.between(pulled, grown) - model.threshold(),
        -l0 * change - N * slope_margin - excess,
    )
    pulls = {"f": at({(i, i - 1): grown, (i - 2, i - 1): -pulled})}
    p.entry("chain_starts", inequality(pulls, margin))
    p.entry("contraction_needed", inequality({}, margin))
    p.alone("contraction_amplitude", {symbol("Delta_theta"): -model.swing})
    swing = -model.swing
    slides = margin + model.threshold() + model.friction(1)
    sliding = p.show(
        f"turns positive; a half-cycle changes theta by {swing}, so A* = (mu_s -> mu_d: static "
        "friction holds no more than sliding friction)",
        solved(slides.subs(change, swing), amplitude),
        N * slope_margin / (2 * l0),
        "sliding",
    )
    threshold = p.show(
        "... and with mu_s A* =",
        solved(margin.subs(change, swing), amplitude),
        (N * slope_margin + excess) / (2 * l0),
        "threshold",
    )
    dropped = p.show(
        "the dropped term beside the kept one",
        sp.cancel(threshold / sliding - 1),
        excess / (N * slope_margin),
    )
    of_two = static_margin / l0
    below_two = p.show(
        "at N = two it is below the exact threshold of two relaxed sliders (two_sliders): fronts "
        "of sliders that stick and slip are no fronts of sliding ones. By",
        of_two - threshold.subs(N, 2),
        excess / (2 * l0),
    )
    two = CAPTIONS | {N: 2}
    p.entry(
        "seuil",
        {star: sliding},
        {star: threshold},
        lines=4,
        dropped=dropped,
        at_captions=dropped.subs(CAPTIONS),
        less=below_two,
        two=threshold.subs(two),
        exact_two=of_two.subs(two),
    )
    p.show("neither depends on i", sp.diff(threshold, i), 0)
    p.show("... and the one of mu_d per slider not on N", sp.diff(sliding / N, N), 0)
    p.entry("threshold_of_size", lines=2, kept=excess / (2 * l0))

    def neglects(formula: Formula) -> bool:
        factor = sp.cancel(formula.bound({}).left / dropped)
        beside = formula.relations == ("<<",) and formula.right == 1
        return beside and not factor.has(N, mu_s)

    real = p.show(
        "... at the captions' values, above the detuning of a hundredth in the paper's last figure",
        dropped.subs(CAPTIONS),
        sp.Rational(4, 300),
    )
    p.entry(
        "small_difference",
        neglects,
        small({}, dropped, sp.Integer(1)),
        lacks=sp.cancel(dropped * c / (excess / N)),
        stated=(excess / c / N).subs(CAPTIONS),
        real=real,
    )
    value, corrected = sliding.subs(CAPTIONS), threshold.subs(CAPTIONS)
    above = value * (1 + sp.Rational(1, 100))  # the larger amplitude of that figure
    p.entry(
        "threshold_value",
        Within(value, 1.014, "A_theta_star"),
        holds=lambda: above < corrected,
        value=value,
        above=above,
        right=corrected,
    )
    largest = p.show(
        "the largest chain that cycles move, for mu_s -> mu_d: N =",
        solved(sliding - amplitude, N),
        2 * l0 * amplitude / slope_margin,
    )
    exact = p.show(
        "... with D",
        solved(threshold - amplitude, N),
        (2 * l0 * amplitude - excess) / slope_margin,
    )
    bounds = inequality({}, N - largest), inequality({}, N - exact)
    less = largest - exact
    p.entry("largest_chain", *bounds, lines=2, less=less, number=less.subs(CAPTIONS))
