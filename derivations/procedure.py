"""That the next rearrangement starts between two targets, where an end of the chain yields."""

from __future__ import annotations

import sympy as sp

from derivations import slip
from derivations.judges import inequality, vanishes
from derivations.model import Model, solved
from derivations.notation import c, l0, mu_d, mu_s, static_margin, symbol
from derivations.proof import Proof, chapter

q, k = symbol("q"), symbol("k")
part, beyond, further = sp.symbols("u J further", positive=True)
"""Where theta_c lies; what a jump of l0 theta exceeds the threshold of slider N by."""


@chapter("The quasi-static procedure", "theta moves monotonically, slowly, between targets")
def derive(p: Proof, model: Model) -> None:
    """Show where a ramp starts its first slip, and what a jump of theta does instead."""
    p.proved(
        "rearrangements start at an end: a ramp changes no inner force, and that on slider 1 and N",
        lambda: [model.push(end) for end in ("first", "inner", "last")] == [-1, 0, 1],
        "scaling",
    )
    p.alone("end_of_targets")
    first, last, tension = model.pair()
    about_to_slip = solved(last - model.threshold(), tension)
    contracted = first.subs(tension, about_to_slip) - model.push("first") * beyond
    needed = p.show(
        "two sliders, theta_q such that slider 2 is about to slip: slider 1 slips in the "
        "contraction that follows once l0 theta has fallen by",
        solved(contracted - model.threshold(), beyond),
        2 * static_margin,
    )
    # from further than that a contraction to 0 starts its first slip at |theta_c| > 0
    start = (needed + further - needed) / l0
    way = sp.Symbol("way", real=True, nonzero=True)
    theta_q, theta_c = symbol("theta_q"), symbol("theta_c")
    ramp = {theta_c ** (k + 1): theta_q + way / (1 + part), symbol("theta_q+1"): theta_q + way}
    between = inequality(ramp, way**2)
    p.alone("critical_dilation", corrected=between, holds=start.is_positive)

    length, excess = slip.derive(model).length, slip.derive(model).excess
    at_once = p.show(
        "theta jumps, by J more than what brings slider N to its threshold: it slips once, by",
        length.subs({slip.w: 1, slip.a0: excess + beyond}),
        2 * (mu_s - mu_d) * c + 2 * beyond,
    )
    lone = length.subs({slip.w: 1, slip.a0: excess})
    short = p.show(
        "theta runs there: by 2D for every 2D of the ramp, 2D ceil(J/(2D)) < J + 2D; less by",
        at_once - (beyond + lone),
        beyond,
    )
    p.entry("dilation_jumps", holds=vanishes(short - beyond))
