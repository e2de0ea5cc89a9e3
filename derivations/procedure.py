"""That the next rearrangement starts between two targets, where an end of the chain yields."""

from __future__ import annotations

import sympy as sp

from derivations import slip
from derivations.judges import inequality
from derivations.model import Model, a0, solved, w
from derivations.notation import CAPTIONS, amplitude, c, l0, mu_d, mu_s, static_margin, symbol
from derivations.proof import Proof, chapter

q, k = symbol("q"), symbol("k")
part, beyond, further = sp.symbols("u J further", positive=True)
"""Where theta_c lies; what a jump of l0 theta exceeds the threshold of slider N by."""


@chapter("The quasi-static procedure", "theta moves monotonically, slowly, between targets")
def derive(p: Proof, model: Model) -> None:
    """Show where a ramp starts its first slip, and what a jump of theta does instead."""
    p.show(
        "while l0 theta rises by one, the force on the first slider changes by",
        model.push("first"),
        -1,
    )
    p.show(
        "... on an inner one not at all, so every rearrangement starts at an end",
        model.push("inner"),
        0,
    )
    p.show("... and on the last one by", model.push("last"), 1)
    p.alone("end_of_targets")
    first, last, tension = model.pair()
    about_to_slip = solved(last - model.threshold(), tension)
    contracted = first.subs(tension, about_to_slip) - model.push("first") * beyond
    needed = p.show(
        "two sliders, theta_q such that the lower slider is about to slip: the upper slider "
        "slips in the contraction that follows once l0 theta has fallen by",
        solved(contracted - model.threshold(), beyond),
        2 * static_margin,
    )
    start = p.show(
        "from further than that by some more, a contraction to theta = zero starts its first slip "
        "at a theta_c beyond it, in absolute value",
        (needed + further - needed) / l0,
        further / l0,
    )
    way = sp.Symbol("way", real=True, nonzero=True)
    theta_q, theta_c = symbol("theta_q"), symbol("theta_c")
    ramp = {theta_c ** (k + 1): theta_q + way / (1 + part), symbol("theta_q+1"): theta_q + way}
    between = inequality(ramp, way**2)
    warm = 2 * CAPTIONS[amplitude]
    beyond_zero = (warm - needed / l0).subs(CAPTIONS)
    p.entry(
        "critical_dilation",
        corrected=between,
        holds=start.is_positive and beyond_zero.is_positive,
        start=beyond_zero,
        warm=warm,
    )

    length, excess = slip.derive(model).length, slip.derive(model).excess
    at_once = p.show(
        "theta jumps, by J more than what brings the last slider to its threshold: it slips "
        "once, by",
        length.subs({w: 1, a0: excess + beyond}),
        2 * (mu_s - mu_d) * c + 2 * beyond,
    )
    lone = length.subs({w: 1, a0: excess})
    p.show(
        "theta runs there: each slip takes as much from the force as a ramp of its own length "
        "gives: there are as many slips as it takes to make up for J, each of",
        lone,
        2 * (mu_s - mu_d) * c,
    )
    short = p.show(
        "less than one slip beyond J, so that the jump leads further by more than",
        at_once - (beyond + lone),
        beyond,
    )
    p.entry(
        "dilation_jumps", holds=short.is_positive, lines=3, jump=at_once, ramp=lone, excess=beyond
    )
