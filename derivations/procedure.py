"""That the next rearrangement starts between two targets, where a slider first yields."""

from __future__ import annotations

from fractions import Fraction
from functools import cache
from random import Random

import sympy as sp

from derivations import slip_old as slip
from derivations.notation import Formula, excess, symbol
from derivations.play import TwoSliders
from derivations.proof import Derivation, Entry, Results, Step, Verification

q, k = symbol("q"), symbol("k")
beyond = sp.Symbol("J", positive=True)
"""What a jump of l0 theta exceeds the threshold of slider N by."""


def derive() -> Derivation:
    """Return the critical dilation of an end slider and the force that makes it monotone."""
    theta, l0, tension, s = sp.symbols("theta l_0 r s", real=True)
    coefficient, cosine = sp.symbols("mu_s c", positive=True)
    force_last = -(tension - l0 * theta) + s
    up = sp.solve(force_last - coefficient * cosine, theta)[0]
    steps: tuple[Step, ...] = (
        Step("force on the last slider as theta moves (r = x_N - x_{N-1} - l0)", force_last),
        Step("it grows with theta; slider N starts downhill at", up),
        Step("theta runs from theta_q to theta_{q+1}, so every theta_c lies between the two"),
    )
    # theta changes at once, by J more than what brings slider N to its threshold
    at_once = slip.derive().results["displacement"].subs({slip.w: 1, slip.a0: excess + beyond})
    on_ramp = 2 * excess * sp.ceiling(beyond / (2 * excess))
    steps += (
        Step("theta jumps: slider N slips once, by", sp.expand(at_once)),
        Step("theta runs there: it slips by 2D each time, by", on_ramp),
    )
    return Derivation(
        "The quasi-static procedure",
        steps,
        {
            "theta_c": up,
            "force": force_last,
            "jump": sp.expand(at_once),
            "ramp": on_ramp,
        },
        ("theta moves monotonically between targets",),
    )


@cache
def first_starts(number: int = 200) -> tuple[tuple[Fraction, Fraction, Fraction], ...]:
    """Return (theta_q, theta_c, theta_{q+1}) of first starts on random ramps of two sliders."""
    random = Random(17)
    found: list[tuple[Fraction, Fraction, Fraction]] = []
    pair = TwoSliders(Fraction(1, 4), Fraction(1, 2), Fraction(3, 5))
    at = Fraction(0)
    while len(found) < number:
        target = Fraction(random.randint(-400, 400), 97)
        up = 1 if target > at else -1
        f1, f2 = pair.forces()
        room = min(pair.mu_s + up * f1, pair.mu_s - up * f2)
        if room < abs(target - at) and at != 0 and target != 0:
            found.append((at, at + up * room, target))
        pair.ramp(target)
        at = target
    return tuple(found)


def _always(formula: Formula) -> bool:
    """Return whether a statement about theta_q, theta_c, theta_{q+1} holds on all ramps."""
    names = symbol("theta_q"), symbol("theta_c") ** (k + 1), symbol("theta_q+1")
    for case in first_starts():
        values = dict(
            zip(names, (sp.Rational(v.numerator, v.denominator) for v in case), strict=True)
        )
        left, right = (sp.sympify(side).subs(values) for side in formula.sides)
        if not (left.is_number and right.is_number):
            return False
        if not (left < right if formula.relations == ("<",) else left > right):
            return False
    return True


def check(v: Verification, r: Results) -> None:
    """Prove that an end slider's force is monotone in theta; verify theta_c on random ramps."""
    theta, l0 = sp.symbols("theta l_0", real=True)
    v.identity(
        "the force on slider N grows by l0 per unit of theta", sp.diff(r["force"], theta) - l0
    )
    v.identity(
        "a jump of theta moves slider N by 2 (D + J), J beyond its threshold",
        r["jump"] - 2 * (excess + beyond),
        "one slip whose first acceleration is D + J, slider 1 at rest",
    )
    short = r["jump"] - (beyond + 2 * excess)
    v.proved(
        "a ramp to the same theta moves it by less: by J + 2D at most",
        sp.expand(short).is_positive,
        "2D ceil(J/(2D)) < J + 2D < 2 (D + J)",
    )
    cases = first_starts()
    v.verified(
        "theta_c lies strictly between theta_q and theta_{q+1} or at theta_q",
        all(min(a, b) <= start <= max(a, b) for a, start, b in cases),
        "200 rational ramps of two sliders",
    )
    broken = sum(abs(start) >= abs(b) for _, start, b in cases)
    v.verified(
        "|theta_c| < |theta_{q+1}| fails", broken > 0, f"counterexamples: {broken} of the 200 ramps"
    )


ENTRIES: tuple[Entry, ...] = (
    Entry(
        "critical_dilation",
        "Sec. II C",
        r"(in general, $|\theta_c^{k+1}|<|\theta_{q+1}|$)",
        "misprint",
        "procedure: theta_c lies between theta_q and theta_{q+1}; the absolute values may be in "
        "any order",
        corrected=r"(\theta_c^{k+1} - \theta_q) (\theta_{q+1} - \theta_c^{k+1}) > 0",
        corrected_formula=r"(\theta_c^{k+1} - \theta_q) (\theta_{q+1} - \theta_c^{k+1}) > 0",
        error="a ramp from a large to a small |theta| starts its first slip at a larger |theta_c| "
        "than its target's",
        holds_exactly=_always,
        evidence=lambda: any(abs(start) >= abs(b) for _, start, b in first_starts()),
    ),
    Entry(
        "dilation_jumps",
        "Sec. II B",
        r"We then assume that $\theta = \theta_q$ for $t \in [t_q,t_{q+1}[$.",
        "inconsistent",
        "procedure: the method of Sec. II C takes theta through every theta_c between two targets; "
        "theta that jumps gives other displacements",
        corrected="theta runs from theta_q to theta_{q+1}, slowly against tau_dyn",
        error="after a jump slider N slips once, by 2 (D + J), J what the jump exceeds its "
        "threshold by; on the ramp by 2D ceil(J/(2D)), at most J + 2D",
        assumptions=("slider 1 stays at rest",),
        evidence=lambda: bool(
            sp.expand(derive().results["jump"] - beyond - 2 * excess).is_positive
        ),
    ),
    Entry(
        "end_of_targets",
        "Sec. II C",
        r"are then the positions of the sliders at $t = t_{q+2}$",
        "convention",
        "theta_{q+1} acts from t_{q+1} to t_{q+2}, so its last state is that at t_{q+2}",
        proved=False,
    ),
)
