"""That a half-cycle sets a whole chain in motion from the amplitude (N m + D)/(2 l0) on."""

from __future__ import annotations

import sympy as sp

from derivations.notation import (
    Expression,
    Formula,
    N,
    amplitude,
    c,
    excess,
    i,
    l0,
    mu_d,
    mu_s,
    s,
    slope_margin,
    symbol,
)
from derivations.pivots_old import tension_above, tension_below
from derivations.proof import (
    Derivation,
    Entry,
    Judge,
    Results,
    Step,
    Verification,
    equals,
    follows,
    inequality,
    vanishes,
)

change = symbol("Delta_theta_star")
"""Change of theta since the end of the dilation; negative in a contraction."""


def derive() -> Derivation:
    """Return the forces on the pivot of a dilation while the chain contracts, and the threshold."""
    end_of_dilation = tension_below(i - 1, 1)  # T_{i-1}: sliders i..N have moved downhill
    pulled = tension_above(i - 1, 1)  # T_{i-2}: sliders 1..i-2 move downhill by now
    here = sp.expand(end_of_dilation - l0 * change)
    margin = sp.expand(here - pulled + s - mu_s * c)
    needed = sp.solve(margin, change)[0]
    threshold = sp.factor(-needed / 2)
    reversal = sp.expand(here - pulled + s - mu_d * c)  # sliding limit: mu_s -> mu_d
    results = {
        "end_of_dilation": end_of_dilation,
        "pulled": pulled,
        "here": here,
        "margin": margin,
        "threshold": threshold,
        "sliding_threshold": sp.factor(-sp.solve(reversal, change)[0] / 2),
    }
    steps = (
        Step("End of a dilation: sliders i..N have slid downhill; T_{i-1}", end_of_dilation),
        Step(
            "the contraction's front from above arrives: sliders 1..i-2 slide downhill; T_{i-2}",
            pulled,
        ),
        Step("meanwhile slider i - 1 and i rest, and T_{i-1} has grown by -l0 dtheta", here),
        Step("slider i - 1 starts downhill when this is positive", margin),
        Step("|dtheta| = 2A at the threshold: A*", threshold),
        Step("for mu_s -> mu_d", results["sliding_threshold"]),
    )
    return Derivation(
        "Thresholds",
        steps,
        results,
        (
            "the fronts of sliding sliders carry mu_d",
            "no inertia",
            "slider i - 1 is the pivot",
            "one value of mu_s",
        ),
    )


def check(v: Verification, r: Results) -> None:
    """Prove the threshold with and without the term in mu_s - mu_d, and its relative size."""
    v.identity(
        "T_{i-1} at the end of a dilation is -(N + 1 - i) m",
        r["end_of_dilation"] + (N + 1 - i) * slope_margin,
    )
    v.identity("T_{i-2} behind the front is (i - 2) m", r["pulled"] - (i - 2) * slope_margin)
    v.identity(
        "margin: -l0 dtheta - (N m + D)", r["margin"] + l0 * change + N * slope_margin + excess
    )
    v.identity("A* = (N m + D)/(2 l0)", r["threshold"] - (N * slope_margin + excess) / (2 * l0))
    v.identity("A* does not depend on i", sp.diff(r["threshold"], i))
    v.identity("sliding limit: Eq. (seuil)", r["sliding_threshold"] - N * slope_margin / (2 * l0))
    ratio = sp.cancel(r["threshold"] / r["sliding_threshold"] - 1)
    v.identity("relative size of the dropped term: D/(N m)", ratio - excess / (N * slope_margin))
    numbers = {N: 30, mu_d: sp.Rational(1, 2), mu_s: sp.Rational(3, 5), s: c / 4}
    v.proved(
        "N = 30, tan(alpha) = 1/4, .5, .6: the dropped term is 4/300 = 1.33 %, more than a "
        "detuning of 1 %",
        sp.cancel(ratio.subs(numbers)) == sp.Rational(4, 300),
        "rational arithmetic; cos(alpha) cancels",
    )
    v.identity(
        "N = 2: (2m + D)/(2 l0), while slips start from the relaxed chain at a/l0, D/(2 l0) above "
        "it",
        (slope_margin + excess) / l0 - r["threshold"].subs(N, 2) - excess / (2 * l0),
    )


_R = derive().results


def _forces() -> dict[object, object]:
    """Return the forces exerted on each other by the sliders around the pivot."""

    def force(exerting: Expression, on: Expression) -> Expression:
        pair = (sp.expand(exerting - i), sp.expand(on - i))
        return {
            (-1, 0): -_R["end_of_dilation"],
            (-1, -2): _R["pulled"],
            (0, -1): _R["here"],
            (-2, -1): -_R["pulled"],
        }.get(pair, sp.Symbol("elsewhere"))

    return {"f": force}


def _starts() -> Judge:
    return inequality(_forces(), _R["margin"])


def _smallness(formula: Formula, exactly: bool) -> bool:
    """Judge what must be small for the term in mu_s - mu_d to be negligible."""
    if formula.relations != ("<<",) or formula.sides[1] != 1:
        return False
    ratio = sp.cancel(_R["threshold"] / _R["sliding_threshold"] - 1)
    stated = formula.bound({symbol("Delta_mu"): mu_s - mu_d}).left
    factor = sp.cancel(stated / ratio)
    return vanishes(factor - 1) if exactly else not factor.has(N) and not factor.has(mu_s)


def _seuil(value: Expression) -> dict[object, object]:
    return {symbol("A_theta_star"): value, symbol("Delta_mu"): mu_s - mu_d}


ENTRIES: tuple[Entry, ...] = (
    Entry(
        "forcestatique",
        "Sec. III B 2",
        r"f_{i-1 \to i} + [N - (i-1)] (\sin \alpha - \mu_\mathrm{d} \cos \alpha) = 0",
        "exact",
        "thresholds: sum of the balances of sliders i..N, sliding downhill",
        label="forcestatique",
        assumptions=("continuous sliding", "no inertia"),
        holds=follows(_forces()),
    ),
    Entry(
        "pull_above",
        "Sec. III B 2",
        r"f_{i-1 \to i-2} + (i-2) (\sin \alpha - \mu_\mathrm{d} \cos \alpha) = 0",
        "exact",
        "thresholds: sliders 1..i-2 slide downhill in the contraction",
        assumptions=("the front has reached slider i - 2",),
        holds=follows(_forces()),
    ),
    Entry(
        "pull_below",
        "Sec. III B 2",
        r"f_{i \to i-1} = [N - (i-1)] (\sin \alpha - \mu_\mathrm{d} \cos \alpha) - \tilde{l}_0 "
        r"\Delta\theta^*",
        "exact",
        "thresholds: minus Eq. (forcestatique), changed by the natural length",
        assumptions=("sliders i - 1 and i rest during the change",),
        holds=follows(_forces()),
    ),
    Entry(
        "chain_starts",
        "Sec. III B 2",
        r"f_{i \to i-1} + f_{i-2 \to i-1} + \sin \alpha - \mu_\mathrm{s} \cos \alpha > 0",
        "exact",
        "thresholds: Eq. (static_eq) of slider i - 1, downhill",
        holds=_starts(),
    ),
    Entry(
        "contraction_needed",
        "Sec. III B 2",
        r"$- \tilde{l}_0 \Delta\theta^* > N (\sin \alpha - \mu_\mathrm{d} \cos \alpha) - "
        r"\Delta\mu \cos \alpha$",
        "misprint",
        "thresholds: the four lines before it give the opposite sign of the right-hand side; as "
        "printed any "
        "contraction would do",
        corrected=r"- \tilde{l}_0 \Delta\theta^* > N (\mu_\mathrm{d} \cos \alpha - \sin \alpha) + "
        r"\Delta\mu "
        r"\cos \alpha",
        corrected_formula=r"- \tilde{l}_0 \Delta\theta^* > N (\mu_\mathrm{d} \cos \alpha - \sin "
        r"\alpha) + \Delta\mu "
        r"\cos \alpha",
        error="wrong sign of one side of an inequality",
        holds=inequality({symbol("Delta_mu"): mu_s - mu_d}, _R["margin"]),
        repair=(">", "> - [", "]"),
    ),
    Entry(
        "contraction_amplitude",
        "Sec. III B 2",
        r"$\Delta\theta = -2 A_\theta$",
        "exact",
        "a contraction runs from +A to -A",
        holds=follows({symbol("Delta_theta"): -amplitude - amplitude}),
    ),
    Entry(
        "seuil",
        "Sec. III B 2",
        r"A_\theta^* = \frac{N}{2\tilde{l}_0} (\mu_\mathrm{d} \cos \alpha - \sin \alpha)",
        "approximation",
        "thresholds; exact in the sliding limit mu_s -> mu_d",
        label="seuil",
        assumptions=(
            "the whole chain must be set in motion",
            "quasi-static fronts",
            "one value of mu_s",
        ),
        corrected=r"A_\theta^* = \frac{1}{2\tilde{l}_0} \Bigl[ N (\mu_\mathrm{d} \cos \alpha - "
        r"\sin \alpha) + "
        r"\Delta\mu \cos \alpha \Bigr]",
        corrected_formula=r"A_\theta^* = \frac{1}{2\tilde{l}_0} \Bigl[ N (\mu_\mathrm{d} \cos "
        r"\alpha - \sin \alpha) + "
        r"\Delta\mu \cos \alpha \Bigr]",
        error="relative D/(N m), 1.33 % at N = 30, tan(alpha) = 1/4; small if N (mu_d - "
        "tan(alpha)) >> mu_s - mu_d. "
        "The mean velocity of Eq. (vitesse_seuil) nevertheless vanishes at the printed amplitude",
        holds=follows(_seuil(_R["threshold"].subs(mu_s, mu_d))),
        holds_exactly=follows(_seuil(_R["threshold"])),
    ),
    Entry(
        "small_difference",
        "Sec. III B 2",
        r"where we assumed $\Delta\mu / N \ll 1$",
        "approximation",
        "thresholds: the ratio of the dropped term to the kept one",
        corrected=r"\frac{\Delta\mu}{N (\mu_\mathrm{d} - \tan\alpha)} \ll 1",
        corrected_formula=r"\frac{\Delta\mu}{N (\mu_\mathrm{d} - \tan\alpha)} \ll 1",
        error="the paper's condition lacks the factor 1/(mu_d - tan(alpha)), which grows without "
        "bound towards "
        "alpha_c; 0.1/30 = 0.33 % against a real 1.33 %",
        formula=r"\Delta\mu / N \ll 1",
        holds=lambda formula: _smallness(formula, False),
        holds_exactly=lambda formula: _smallness(formula, True),
    ),
    Entry(
        "threshold_of_size",
        "Sec. III B 2",
        r"Note that $A_\theta^*$ is independent of the position of the steady slider ($i$ or $j$)"
        "\n"
        r"and proportional to the number $N$ of sliders in the chain.",
        "exact",
        "thresholds: the derivative with respect to i vanishes; proportional to N without the "
        "term D",
        assumptions=("mu_s - mu_d neglected",),
        evidence=lambda: (
            vanishes(sp.diff(_R["threshold"], i))
            and vanishes(sp.diff(_R["sliding_threshold"] / N, N))
        ),
    ),
    Entry(
        "largest_chain",
        "Sec. IV",
        r"$N > {2\tilde{l}_0} A_\theta / (\mu_\mathrm{d} \cos \alpha - \sin \alpha)$",
        "approximation",
        "thresholds: Eq. (seuil) solved for N",
        corrected=r"N > [2\tilde{l}_0 A_\theta - \Delta\mu \cos\alpha] / (\mu_\mathrm{d} \cos "
        r"\alpha - \sin \alpha)",
        corrected_formula=r"N > [2\tilde{l}_0 A_\theta - \Delta\mu \cos\alpha] / (\mu_\mathrm{d} "
        r"\cos \alpha - \sin "
        r"\alpha)",
        error="D/m sliders, 0.4 at the captions' values",
        holds=inequality({}, N - sp.solve(_R["sliding_threshold"] - amplitude, N)[0]),
        holds_exactly=inequality(
            {symbol("Delta_mu"): mu_s - mu_d}, N - sp.solve(_R["threshold"] - amplitude, N)[0]
        ),
    ),
    Entry(
        "threshold_value",
        "Fig. jumps, caption",
        r"$A_\theta^* \simeq 3.6~10^{-3}$",
        "exact",
        "thresholds: Eq. (seuil) at N = 30, l0 = 1000, mu_d = .5, tan(alpha) = .25 is 3.638e-3; "
        "with D 3.687e-3",
        error="two digits are given; 1 % below and above it lie on the same side of 3.687e-3",
        holds=lambda formula: (
            formula.left == symbol("A_theta_star")
            and equals(_rounded())(Formula((formula.right,), ()))
        ),
    ),
)


def _rounded() -> Expression:
    """Return Eq. (seuil) at the caption's parameters, to the two digits that the caption gives."""
    tan = sp.Rational(1, 4)
    cosine = 1 / sp.sqrt(1 + tan**2)
    value = (
        _R["sliding_threshold"]
        .subs({N: 30, l0: 1000, mu_d: sp.Rational(1, 2), s: tan * c})
        .subs(c, cosine)
    )
    return sp.floor(value * 10000 + sp.Rational(1, 2)) / 10000
