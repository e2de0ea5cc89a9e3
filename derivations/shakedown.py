"""Shakedown under cycles: rest, locked cycles of the two ends, and the end of all creep.

``y = l0 theta`` runs between -L and L, ``L = l0 A``. Structural mechanics calls a chain that comes
to rest under cycles *shaken down* (Melan's theorem), and slips that return *alternating*. Lengths
and forces have the same unit here (a spring's constant is 1).
"""

from __future__ import annotations

import sympy as sp

from derivations import runaway, slip
from derivations.model import Model, T, after, before, solved
from derivations.notation import Expression, N, c, excess, mu_d, mu_s, n, s, slope_margin
from derivations.proof import Proof, chapter

L, E_0 = sp.symbols("L E_0", positive=True)
inner, first, last, slope = sp.symbols("W w_1 w_N weight", positive=True)
"""Thresholds: the sum over the inner sliders, slider 1's, slider N's."""
eps, gap, speed, a, b, d, k = sp.symbols("eps gap speed a b d k", nonnegative=True)
more, path, E_end = sp.symbols("more path E_end", nonnegative=True)
share = sp.Symbol("share")
tau, rest_state = sp.Function("tau"), sp.Function("T_0")


@chapter(
    "Shakedown",
    "cycles of amplitude A > 0, L = l0 A",
    "0 <= tan(alpha)",
    "effective mu_s >= mu_d",
    "N >= 2 (cycles of the ends: N >= 3)",
)
def derive(p: Proof, model: Model) -> None:
    """Show the bounds of rest, of creep and of locked cycles of the ends."""
    part = T(n) - model.end(0) + n * s  # the sum of the forces on sliders 1..n
    p.show(
        "the forces on sliders 1..n sum up to T_n + n s, all to N s: F_n =",
        part - part.subs(n, n - 1),
        model.force(n),
    )
    total = model.end(1) - model.end(0) + N * model.scaled(model.weight)
    _rest(p, total)
    _melan(p, model)
    _ends(p, model, total)


def _rest(p: Proof, total: Expression) -> None:
    """Show when a state at rest over all cycles exists: an end holds iff |F| <= w - L."""
    held = (first - L - a) + (inner - b) + (last - L - d)
    bound = (first + inner + last - N * s) / 2
    limit = p.show(
        "a state at rest over a cycle has slacks a, b, d >= 0 to the thresholds less L at the ends:"
        " L <= (w_1 + ... + w_N - N s)/2, for L =",
        solved(held - total, L),
        bound - (a + b + d) / 2,
    )
    even = solved(share * (first - L + inner + last - L) - total, share)
    below = {inner: 2 * L + N * s + gap - first - last, s: slope}
    p.proved(
        "and it exists if L <= min(w_1, w_N, (w_1 + ... + w_N - N s)/2)",
        lambda: (
            sp.cancel(even.subs(below)).is_nonnegative
            and sp.cancel(1 - even.subs(below)).is_nonnegative
        ),
        "forces that are one share N s/(w_1 + ... + w_N - 2L) of what friction leaves room for: "
        "it lies in [0, 1] and makes them sum to N s",
    )
    equal = {first: mu_s * c, last: mu_s * c, inner: (N - 2) * mu_s * c}
    no_slack = dict.fromkeys((a, b, d), 0)
    p.show(
        "with one mu_s: L <=",
        limit.subs(equal | no_slack),
        N * (mu_s * c - s) / 2,
    )


def _melan(p: Proof, model: Model) -> None:
    """Show that below Melan's bound with mu_d no state creeps for ever."""
    above, below = rest_state(n - 1), rest_state(n)
    p.show(
        "E = |v|**2/2 + |tau|**2/2, tau = T - T_rest of a state at rest with mu_d, which ramps "
        "leave alone; springs exchange their power (runaway), for the forces of tau are",
        model.between(above + tau(n - 1), below + tau(n)) - model.between(above, below),
        tau(n) - tau(n - 1),
    )
    for way, word in ((1, "down"), (-1, "up")):
        held = way * (mu_d * c - eps - gap)  # the force of the state at rest, within mu_d c - eps
        p.show(
            f"a slider that moves {word}hill takes from E at least eps |v|: dE/dt =",
            way * speed * (held + model.friction(way)),
            -(eps + gap) * speed,
        )
    p.show(
        "so over any time all paths together are at most E_0/eps:",
        solved(sp.Eq(E_end, E_0 - eps * path - more), path),
        E_0 / eps - (E_end + more) / eps,
    )
    low = (N * (mu_d * c - eps) - N * s) / 2
    p.show(
        "the state at rest exists for thresholds mu_d c - eps, if L <= mu_d c - eps and eps <=",
        solved(low - L, eps),
        slope_margin - 2 * L / N,
    )
    p.show(
        "so no state creeps for ever, with any static coefficients >= mu_d, drawn or not, for "
        "l0 A < min(mu_d c, N (mu_d c - s)/2): such an eps > 0 exists up to L =",
        solved(solved(low - L, eps), L),
        N * slope_margin / 2,
    )
    p.show(
        "with mu_s - mu_d >= delta everywhere it comes to rest: every slip has a least length "
        "(runaway), and there are at most",
        runaway.derive(model).slips.subs(runaway.energy, E_0) * slope_margin / eps,
        18 * E_0**2 / (eps * (runaway.step * c) ** 3),
    )


def _ends(p: Proof, model: Model, total: Expression) -> None:
    """Show the largest amplitude of a locked cycle in which only sliders 1 and N slip."""
    held, move = model.threshold(), slip.derive(model).last
    above, below = (sp.diff(model.at("inner"), place) for place in (before, after))
    p.show(
        "k slips of slider 1 by 2D change the force on slider 2 by",
        k * above * move,
        2 * k * excess,
    )
    p.show("... and those of slider N that on its neighbour by", k * below * move, 2 * k * excess)
    drop = -model.push("first") * 2 * L - k * move
    p.show("while the force on the end itself changes by", drop, 2 * L - 2 * k * excess)
    p.show(
        "so an end turns within its threshold up to L =",
        solved(drop - 2 * held, L),
        mu_s * c + k * excess,
    )
    high = 2 * held + (N - 4) * held + (held - k * below * move) + (held - drop)
    p.show(
        "highest forces at the end of a contraction, on 1, 2, 3..N-2, N-1, N (the lowest are minus "
        "these, in reverse): their sum",
        high,
        N * mu_s * c - 2 * L,
    )
    p.show("they can sum to N s up to L =", solved(high - total, L), N * (mu_s * c - s) / 2)
    p.argued(
        "N >= 4: the largest amplitude of a locked cycle of the ends is l0 A = "
        "min(N (mu_s c - s)/2, mu_s c + D floor(mu_s/(mu_s - mu_d))), and there is none if "
        "N (mu_s c - s)/2 <= mu_s c",
        "a neighbour swings by 2kD within 2 mu_s c, so k <= mu_s c/D; sliders 2 and 3 rest; "
        "an end has one phase in (mu_s c - 2D, mu_s c], so the period is 1",
    )
    p.argued(
        "N = 3: such cycles exist at every amplitude above mu_s c if 3 s <= mu_s c, else none",
        "sliders 1 and 3 slip in turns; slider 2 feels at most 3 s + q, q in [0, 2D) the lag "
        "between them, and q = 0 is possible",
    )
