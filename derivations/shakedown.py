"""Shakedown under cycles: rest, locked cycles of the two ends, and the end of all creep.

``y = l0 theta`` runs between -L and L, ``L = l0 A``. Structural mechanics calls a chain that comes
to rest under cycles *shaken down* (Melan's theorem), and slips that return *alternating*. Lengths
and forces have the same unit here (a spring's constant is 1).
"""

from __future__ import annotations

import sympy as sp

from derivations import runaway, slip, unlike
from derivations.model import Model, T, after, before, solved
from derivations.notation import (
    Expression,
    N,
    brief,
    c,
    excess,
    floor,
    l0,
    least,
    mu_d,
    mu_s,
    n,
    s,
    slope_margin,
    star,
)
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
    "cycles",
    "tan(alpha) not below zero",
    "no mu_s below mu_d",
    "two sliders or more",
)
def derive(p: Proof, model: Model) -> None:
    """Show the bounds of rest, of creep and of locked cycles of the ends."""
    part = T(n) - model.end(0) + n * s  # the sum of the forces on sliders 1..n
    p.show(
        f"the forces on the first n sliders sum up to {part}: slider n has the last of them,",
        part - part.subs(n, n - 1),
        model.force(n),
    )
    total = model.end(1) - model.end(0) + N * model.scaled(model.weight)
    _rest(p, model, total)
    _melan(p, model)
    _ends(p, model, total)


def at_rest(forces: list[Expression], room: list[Expression], total: Expression) -> bool:
    """Return whether forces sum up to what they must, and none exceeds the room for it.

    For an L that is not above any of the three bounds: what it leaves at the ends is not negative,
    and what it leaves in all is not less than the weight.
    """
    above, below, spare = sp.symbols("above below spare", nonnegative=True)
    weight = sp.Symbol("weight", positive=True)  # N s
    within = {first: L + above, last: L + below, s: weight / N}
    summed = {inner: weight + spare - above - below}
    inside = sp.symbols("inside", nonnegative=True)
    margins = []
    for force, most in zip(forces, room, strict=True):
        left, share_of = most - force, sp.cancel(force / most)
        given = left.subs(within) if most != inner else (1 - share_of).subs(within) * inside
        margins += [sp.factor(given.subs(summed)), sp.factor(share_of.subs(within).subs(summed))]
    adds_up = sp.cancel((sum(forces) - total).subs(within)) == 0
    return adds_up and all(margin.is_nonnegative for margin in margins)


def _rest(p: Proof, model: Model, total: Expression) -> None:
    """Show when a state at rest over all cycles exists: an end holds iff it has room for L."""
    room = [first - L, inner, last - L]
    held = sum(room) - (a + b + d)
    bound = (first + inner + last - N * s) / 2
    p.show(
        "a ramp by L either way leaves an end within its threshold w if the force on it is within "
        "w less L: on the first slider, slack a,",
        first - L * -model.push("first") - a - (room[0] - a),
        0,
    )
    limit = p.show(
        f"a state at rest over cycles has forces that sum up to {total}, with slacks a, b, d, not "
        "below zero, at the first, the inner and the last sliders: L =",
        solved(held - total, L),
        bound - (a + b + d) / 2,
    )
    p.named["rests"] = limit.subs(dict.fromkeys((a, b, d), 0))
    pulled = unlike.differing(model)
    pull = pulled.end(1) - pulled.end(0) + N * pulled.scaled(pulled.weight)
    p.show(
        f"... with a force {unlike.S_1} on the first slider and {unlike.S_N} on the last one, and "
        "without slacks,",
        solved(sum(room) - pull, L),
        (inner + first + last - N * s - unlike.S_1 - unlike.S_N) / 2,
    )
    even = solved(share * sum(room) - total, share)
    p.proved(
        f"and it exists if L exceeds none of {first}, {last} and {bound}",
        lambda: at_rest([even * part for part in room], room, total),
        f"each force is a share {even} of the room for it",
    )
    held = model.threshold()
    equal = {first: held, last: held, inner: (N - 2) * held}
    no_slack = dict.fromkeys((a, b, d), 0)
    most = p.show(
        "with one mu_s L is at most what one end holds, and",
        limit.subs(equal | no_slack),
        N * (mu_s * c - s) / 2,
    )
    p.entry("at_rest", {star: least(held, most) / l0}, lines=5)


def _melan(p: Proof, model: Model) -> None:
    """Show that below Melan's bound with mu_d no state creeps for ever."""
    above, below = rest_state(n - 1), rest_state(n)
    p.show(
        "E: the kinetic energy and the energy of tau, the excess of the tensions over a state at "
        "rest with mu_d, and which ramps leave alone; springs exchange their power (runaway): the "
        "force of tau is",
        model.between(above + tau(n - 1), below + tau(n)) - model.between(above, below),
        tau(n) - tau(n - 1),
    )
    for way, word in ((1, "down"), (-1, "up")):
        held = way * (mu_d * c - eps - gap)  # the force of the state at rest, within mu_d c - eps
        p.show(
            f"a slider that moves {word}hill takes from E at least eps times |v|: the rate of E is",
            way * speed * (held + model.friction(way)),
            -(eps + gap) * speed,
        )
    p.show(
        "so over any time all paths together are, at most,",
        solved(sp.Eq(E_end, E_0 - eps * path - more), path),
        E_0 / eps - (E_end + more) / eps,
    )
    held = -model.friction(1) - eps
    low = p.rests.subs({first: held, last: held, inner: (N - 2) * held})
    eps_most = p.show(
        f"the state at rest exists for thresholds {held}, if L is within one of them and eps not "
        "above",
        solved(low - L, eps),
        slope_margin - 2 * L / N,
    )
    by_threshold = p.show("which leaves some eps up to L =", held.subs(eps, 0), mu_d * c)
    by_sum = p.show("... and up to L =", solved(eps_most, L), N * slope_margin / 2)
    bounded = p.lines[:]
    p.proved(
        "so no state creeps for ever, with any static coefficients from mu_d on, drawn or not, for "
        f"L below {by_threshold} and {by_sum}",
        lambda: not any(line.fault for line in bounded),
        "paths that sum up to a finite length are no creep",
    )
    p.entry("no_lasting_creep", {star: least(by_threshold, by_sum) / l0}, lines=7)
    p.show(
        "with mu_s above mu_d by delta or more everywhere it comes to rest: every slip has a least "
        "length (runaway), and there are at most",
        runaway.derive(model).slips.subs(runaway.energy, E_0) * slope_margin / eps,
        18 * E_0**2 / (eps * (runaway.step * c) ** 3),
    )


def _ends(p: Proof, model: Model, total: Expression) -> None:
    """Show the largest amplitude of a locked cycle in which only sliders 1 and N slip."""
    held, move = model.threshold(), slip.derive(model).last
    above, below = (sp.diff(model.at("inner"), place) for place in (before, after))
    p.show(
        f"k slips of the first slider, each by {brief(move)}, change the force on its neighbour by",
        k * above * move,
        2 * k * excess,
    )
    p.show("... and slips of the last slider by", k * below * move, 2 * k * excess)
    drop = -model.push("first") * 2 * L - k * move
    p.show("while the force on the end itself changes by", drop, 2 * L - 2 * k * excess)
    turning = p.show(
        "so an end turns within its threshold up to L =",
        solved(drop - 2 * held, L),
        mu_s * c + k * excess,
    )
    high = 2 * held + (N - 4) * held + (held - k * below * move) + (held - drop)
    p.show(
        "highest forces at the end of a contraction, on the ends, their neighbours and all others "
        "(the lowest are minus these, in reverse): their sum",
        high,
        N * mu_s * c - 2 * L,
    )
    most = p.show(
        f"they can sum to {total} up to L =", solved(high - total, L), N * (mu_s * c - s) / 2
    )
    p.argued(
        "N >= 4: the largest amplitude of a locked cycle of the ends is l0 A = "
        "min(N (mu_s c - s)/2, mu_s c + D floor(mu_s/(mu_s - mu_d))), and there is none if "
        "N (mu_s c - s)/2 <= mu_s c",
        "a neighbour swings by 2kD within 2 mu_s c, so k <= mu_s c/D; sliders 2 and 3 rest; "
        "an end has one phase in (mu_s c - 2D, mu_s c], so the period is 1",
    )
    swings = floor(mu_s / (mu_s - mu_d))
    p.entry("locked_ends", {star: least(most, turning.subs(k, swings)) / l0}, lines=3)
    p.argued(
        "N = 3: such cycles exist at every amplitude above mu_s c if 3 s <= mu_s c, else none",
        "sliders 1 and 3 slip in turns; slider 2 feels at most 3 s + q, q in [0, 2D) the lag "
        "between them, and q = 0 is possible",
    )
