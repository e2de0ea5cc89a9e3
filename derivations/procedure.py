"""That the next rearrangement starts between two targets, where an end of the chain yields."""

from __future__ import annotations

from fractions import Fraction

import sympy as sp

from derivations import slip
from derivations.chain import RationalChain
from derivations.entry import Backed, Backing, Lines, entries_of
from derivations.judges import Judge, inequality, vanishes
from derivations.model import Model, T, solved
from derivations.notation import c, l0, mu_d, mu_s, static_margin, symbol
from derivations.proof import Proof, chapter

q, k = symbol("q"), symbol("k")
beyond = sp.Symbol("J", positive=True)
"""What a jump of l0 theta exceeds the threshold of slider N by."""


@chapter("The quasi-static procedure", "theta moves monotonically, slowly, between targets")
def derive(p: Proof, model: Model) -> None:
    """Show where a ramp starts its first slip, and what a jump of theta does instead."""
    p.proved(
        "rearrangements start at an end: a ramp changes no inner force, and that on slider 1 and N",
        lambda: [model.push(at) for at in ("first", "inner", "last")] == [-1, 0, 1],
        "scaling",
    )
    first, last = model.force(1).subs(T(0), model.end(0)), model.force(2).subs(T(2), model.end(1))
    tension = solved(last - model.threshold(), T(1))
    needed = solved(
        first.subs(T(1), tension) - model.push("first") * beyond - model.threshold(), beyond
    )
    p.show(
        "two sliders, theta_q such that slider 2 is about to slip: slider 1 slips in the "
        "contraction that follows once l0 theta has fallen by",
        needed,
        2 * static_margin,
        "needed",
    )
    length, excess = slip.derive(model).length, slip.derive(model).excess
    at_once = p.show(
        "theta jumps, by J more than what brings slider N to its threshold: it slips once, by",
        length.subs({slip.w: 1, slip.a0: excess + beyond}),
        2 * (mu_s - mu_d) * c + 2 * beyond,
        "jump",
    )
    one = length.subs({slip.w: 1, slip.a0: excess})
    p.show(
        "theta runs there: by 2D for every 2D of the ramp, 2D ceil(J/(2D)) < J + 2D; less by",
        at_once - (beyond + one),
        beyond,
        "short",
    )
    p.checked(
        "ties occur at ordinary numbers: tan(alpha) = 1/5, mu_d = 1/2, mu_s = 3/5, N = 3",
        _tie,
        "after two lone slips of slider 3 slider 2 is at its threshold, and sliders "
        "1 and 3 reach theirs together",
    )


def _tie() -> bool:
    low, high = Fraction(1, 2), Fraction(3, 5)
    chain = RationalChain(3, Fraction(1, 5), low, high)
    chain.ramp(2 * (high - low) + high)
    return chain.slips == 2 and chain.forces == [-high, high, high]


def _between(r: Lines) -> Judge:
    """Judge that theta_c lies between theta_q and theta_{q+1}: a part 1/(1 + u) of the way."""
    part, way = sp.Symbol("u", positive=True), sp.Symbol("way", real=True, nonzero=True)
    start = symbol("theta_q")
    ramp = {
        symbol("theta_c") ** (k + 1): start + way / (1 + part),
        symbol("theta_q+1"): start + way,
    }
    return inequality(ramp, way**2)


def _closer(r: Lines) -> Backing:
    """From beyond needed/l0 a contraction to 0 starts its first slip at |theta_c| > 0."""
    further = sp.Symbol("further", positive=True)
    start = (r.alone("needed") + further - r.alone("needed")) / l0
    return Backing(exactly=_between(r), evidence=bool(start.is_positive))


LINES: dict[str, Backed | None] = {
    "critical_dilation": _closer,
    "dilation_jumps": lambda r: Backing(evidence=vanishes(r.short - beyond)),
    "end_of_targets": None,
}
ENTRIES = entries_of("procedure", derive, LINES)
