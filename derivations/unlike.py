"""Chains whose friction, end forces or dilations differ: how fast they creep in the sliding limit.

A chain with friction b(n) of each slider, and forces at its ends, advances in a half-cycle by

    v = (q - p) max(0, l0 A - h),    h = (beta(N) - |G|)/2,

beta(N) the sum of the friction, G the sum of weight and end forces, p the slider that rests in a
dilation and q the one that rests in a contraction. The bounds of each tension prove it, for every
path of theta: where a tension is at its bound, Coulomb's law fixes the force on every slider
outwards of it. Where springs dilate by different weights, only the slope of this law is left.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import accumulate
from random import Random

import sympy as sp

from derivations import pivots, plateaus
from derivations.chain import Q, SweptChain, play_variation
from derivations.model import Model, T, after, g, here, m, solved
from derivations.notation import (
    Expression,
    L,
    N,
    alpha,
    amplitude,
    c,
    creeps,
    i,
    l0,
    mu_d,
    n,
    positive_part,
    s,
    symbol,
    theta,
)
from derivations.proof import Line, Proof, chapter

beta, e, W, v, trial = map(sp.Function, ("beta", "e", "W", "v", "trial"))
"""Sum of the sliding friction of sliders 1..n, in m g; its excess of static friction;
sum of the weights of the springs above
slider n; speed of slider n; a tension."""
P, K = symbol("p"), symbol("q")
"""The sliders that rest in dilations and in contractions."""
S_1, S_N, u = sp.symbols("S_1 S_N u", real=True)
"""Forces at the ends; by how far a ramp has come."""
rise, fall, speed, gap = sp.symbols("rise fall speed gap", nonnegative=True)
E, A, w_p, phi, mu_p, heat, R = (symbol(x) for x in ["E", "A", "w", "phi", "mu", "Delta_f", "R"])
"""Of a pipeline: Young's modulus, cross-section, weight per length, fully constrained force; the
tension at its end."""
SIZES = range(2, 7)
"""Parameters of the chains with which the theorem is compared."""


def differing(model: Model) -> Model:
    """Return the model with friction of each slider, and with forces at both ends."""
    own = (beta(n) - beta(n - 1)) / c
    upper, lower = model.ends
    ends = upper + m * g * S_1, lower + m * g * S_N
    return replace(model, sliding=model.sliding.subs(mu_d, own), ends=ends)


def all_hold(lines: list[Line]) -> Callable[[], bool]:
    """Return what says whether lines hold."""
    return lambda: not any(line.fault for line in lines)


def within_steps(pick: Callable[..., Expression] = sp.Max) -> bool:
    """Return whether the larger of two sequences has steps within the bounds of their steps.

    The first one leads by `lead`. Its step is p1 above `least`. Then it still leads, by `later`, or
    the second one does, whose step is q1 below `most`.
    """
    least = sp.Symbol("least", real=True)
    lead, later, p1, q1 = sp.symbols("lead later p1 q1", nonnegative=True)
    first = least + p1
    for second, most in (first - later, first + q1), (first + later, first + later + lead + q1):
        step = sp.expand(pick(first, second) - pick(sp.Integer(0), -lead))
        if not ((step - least).is_nonnegative and sp.expand(most - step).is_nonnegative):
            return False
    return True


def resting(friction: Sequence[Q], pull: Q, way: int) -> int | None:
    """Return the slider that rests in dilations (`way` 1) or contractions (-1); None: an edge."""
    held = [Q(0), *accumulate(friction)]
    driven = [held[-1] - 2 * part - way * pull for part in held]
    if 0 in driven or driven[0] < 0 or driven[-1] > 0:
        return None
    return next(spring for spring, force in enumerate(driven) if force < 0)


def random_chain(random: Random, size: int) -> tuple[SweptChain, int, int]:
    """Return a chain of friction and end forces that differ, and its two pivots."""
    friction = [Q(random.randint(3, 40), 20) for _ in range(size)]
    pulls = [Q(random.randint(0, 20), 30)] * size
    pulls[0] += Q(random.randint(-30, 30), 17)
    pulls[-1] += Q(random.randint(-30, 30), 19)
    pivots = [resting(friction, sum(pulls, Q(0)), way) for way in (1, -1)]
    if None in pivots:
        return random_chain(random, size)
    upper, lower = (pivot or 0 for pivot in pivots)
    return SweptChain(friction, pulls, [Q(1)] * (size - 1)), upper, lower


def follows_the_plays(random: Random, size: int, targets: int, share: int = 1) -> bool:
    """Return whether a random chain on a random path moves as the play says, slide by slide.

    The play has a `share` of the width that is derived.
    """
    chain, upper, lower = random_chain(random, size)
    friction = sum(chain.friction, Q(0))
    width = friction - abs(sum(chain.pulls, Q(0)))
    chain.to(4 * friction)
    chain.to(Q(0))  # beyond the transient
    start = list(chain.x)
    path = [width * Q(random.randint(-90, 90), 60) for _ in range(targets)]
    for target in path:
        chain.to(target)
    _, up, down = play_variation(path, share * width, share * width / 2)
    between = range(min(upper, lower), max(upper, lower) + 1)
    return all(
        chain.x[k - 1] - start[k - 1] == (k - upper) * up + (lower - k) * down for k in between
    )


def follows_the_slope(random: Random, size: int, share: int = 1) -> bool:
    """Return whether a chain of dilations that differ advances with the slope that is derived.

    Between two amplitudes that bring every spring to its bounds; with a `share` of that slope.
    """
    chain, upper, lower = random_chain(random, size)
    weights = [Q(random.randint(2, 30), 10) for _ in range(size - 1)]
    slope = sum(weights[: lower - 1], Q(0)) - sum(weights[: upper - 1], Q(0))
    most = 40 * sum(chain.friction, Q(0)) / min(weights)
    advances = []
    for reach in (most, 2 * most):
        made = SweptChain(chain.friction, chain.pulls, weights)
        made.to(reach)
        made.to(-reach)
        before = list(made.x)
        made.to(reach)
        made.to(-reach)
        advances.append([b - a for a, b in zip(before, made.x, strict=True)])
    return all(b - a == share * 2 * most * slope for a, b in zip(*advances, strict=True))


@chapter(
    "Friction, end forces and dilations that differ",
    "sliding limit: mu_s tends to mu_d",
    "no inertia",
    "a dilation and a contraction beyond the transient",
    "the pull is at no edge of the pivots",
)
def derive(p: Proof, model: Model) -> None:
    """Show the bounds of tensions, the pivots, the rule of springs, and the law."""
    made = differing(model)
    _bounds(p, made)
    _pivots(p, made)
    _passages(p, made)
    _rule(p, made)
    _law(p, model)
    _pipeline(p)
    _dilations(p, made)


def _bounds(p: Proof, made: Model) -> None:
    """Show between which tensions friction holds the chain, from its equations of motion."""
    p.show(
        "springs and weight act on slider n with the force",
        made.force(n),
        T(n) - T(n - 1) + s,
    )
    first = p.show(f"a force {S_1} on the first slider is the tension T_0 =", made.end(0), -S_1)
    last = p.show(f"a force {S_N} on the last one is the tension beyond it,", made.end(1), S_N)
    own = p.show(
        "beta(n) is the sum of the friction of the first n sliders: a slider that moves downhill "
        "carries",
        made.following(1),
        beta(n) - beta(n - 1),
        "own",
    )
    p.show("... and uphill", made.following(-1), -own)
    weights = N * made.scaled(made.weight)
    p.show("weight and end forces sum up to G =", last - first + weights, N * s + S_1 + S_N, "pull")
    begin = len(p.lines)
    for way, least in ((-1, "low"), (1, "high")):
        above = first + way * beta(n) - n * s
        below = last + way * (beta(N) - beta(n)) + (N - n) * s
        for bound, carried, side in ((above, way, "above"), (below, -way, "below")):
            word = "downhill" if carried == 1 else "uphill"
            at_end, beyond = (0, first) if side == "above" else (N, last)
            p.named[f"{least}_{side}"] = bound
            p.show(
                f"if all sliders {side} spring n carry their friction {word}, T_n = {bound}: the "
                "force on slider n is",
                made.between(bound.subs(n, n - 1), bound),
                carried * own,
            )
            p.show(
                "... and T_n at that end of the chain",
                bound.subs(n, at_end).subs(beta(0), 0),
                beyond,
            )
    steps = p.lines[begin:]
    p.proved(
        f"no tension that friction holds is below {p.low_above} or {p.low_below}, nor above "
        f"{p.high_above} or {p.high_below}; at such a bound every slider outwards of the spring "
        "carries all of its friction, in the direction of that bound",
        all_hold(steps),
        "added up from the end of the chain, the forces on these sliders, each less its bound, are "
        "T_n less its bound: the sum of terms of one sign vanishes if each of them does",
    )


def _pivots(p: Proof, made: Model) -> None:
    """Show which slider rests in a dilation, and which in a contraction."""
    for way, least, index, word in (1, "low", P, "dilation"), (-1, "high", K, "contraction"):
        above, below = p.named[f"{least}_above"], p.named[f"{least}_below"]
        begin = len(p.lines)
        nearer = p.show(
            f"a {word} drives each tension to the nearer one of two bounds. Their difference, "
            "times the direction of the ramp, is",
            way * (above - below),
            beta(N) - 2 * beta(n) - way * p.pull,
            f"nearer_{least}",
        )
        p.show(
            "... at the first end of the chain",
            nearer.subs(n, 0).subs(beta(0), 0),
            beta(N) - way * p.pull,
        )
        p.show("... at the last one", nearer.subs(n, N), -beta(N) - way * p.pull)
        p.show(
            "... and its change from spring to spring is",
            nearer - nearer.subs(n, n - 1),
            -2 * p.own,
        )
        force = p.show(
            f"slider {index}, with the bound from above before it and that from below behind it, "
            "feels",
            made.between(above.subs(n, index - 1), below.subs(n, index)),
            p.pull - way * (beta(N) - beta(index) - beta(index - 1)),
        )
        held = p.own.subs(n, index)
        p.show(
            "... in the direction of the ramp it is from starting by",
            held - way * force,
            nearer.subs(n, index - 1),
        )
        p.show("... and against it by", held + way * force, -nearer.subs(n, index))
        steps = p.lines[begin:]
        p.proved(
            f"so while G, up or down, is less than {beta(N)} exactly one slider, {index}, has "
            "forces within its friction there, unless the difference is zero at a spring (an edge)",
            all_hold(steps),
            "the difference falls, from above zero to below zero: it changes sign at one slider",
        )
    p.show(
        f"with G above zero slider {K} is not above slider {P}: the first difference is positive "
        f"before {P}, the second one negative behind {K}, and the first exceeds the second by",
        p.nearer_low - p.nearer_high,
        -2 * p.pull,
    )


def _passages(p: Proof, made: Model) -> None:
    """Show where a pivot passes to its neighbour if static friction exceeds sliding friction."""

    def rests(slider: Expression) -> Expression:
        above, below = p.low_above.subs(n, slider - 1), p.low_below.subs(n, slider)
        return made.between(above, below)

    own, below = p.own, p.nearer_low + p.pull
    p.show(
        "B(n), the friction below spring n less the friction above it, is",
        below,
        beta(N) - 2 * beta(n),
    )
    downhill = p.show(
        "slips: e(n) is the excess of static friction of slider n. In a dilation the slider below "
        "spring n, at rest while the others move, starts downhill by",
        rests(n + 1) - own.subs(n, n + 1) - e(n + 1),
        p.pull - below - e(n + 1),
    )
    uphill = p.show(
        "... and the slider above it, if that one rests, starts uphill by",
        -rests(n) - own - e(n),
        below - p.pull - e(n),
    )
    p.show(
        "between these values of G either can rest; the middle is",
        p.pull - (downhill - uphill) / 2,
        below + (e(n + 1) - e(n)) / 2,
    )
    phases = symbol("Phi")
    p.show(
        "sliders that stick and slip miss sliding friction by their phases (pivots): the sum "
        "Phi of "
        "what those below carry beyond it, less those above, takes from G, and the middle moves by",
        sp.expand(downhill - uphill - (downhill - phases - (uphill + phases))) / 2,
        phases,
    )
    p.show("the window of both has the width", -downhill - uphill, e(n) + e(n + 1))


def _rule(p: Proof, made: Model) -> None:
    """Show that a ramp takes each spring by itself, and that sliders then obey Coulomb's law."""
    p.show(
        "tensions that all change by the same u leave the force on slider n as it is:",
        made.between(T(n - 1) - u, T(n) - u),
        made.force(n),
    )
    pulled = made.scaled(made.pull(1, here, after))
    p.show(
        "the length of a spring is its tension and its natural length",
        solved(pulled - trial(n), after) - here - trial(n),
        l0 * (1 + theta),
    )
    p.proved(
        "the larger one of two sequences of tensions that friction holds is held by friction; so "
        "is the lesser one",
        within_steps,
        "its steps are within the bounds of their steps; for the lesser one change all signs",
    )
    steps = p.lines[:]
    p.proved(
        f"theorem: where l0 theta rises by u, each tension by itself goes to the larger one of T_n "
        f"less u and its nearer lower bound, and slider {P} rests; where it falls, to the lesser "
        f"one of T_n and u more and its nearer upper bound, and slider {K} rests",
        all_hold(steps),
        "friction holds these tensions; only a spring at its bound changes its length, so that a "
        "slider moves, away from the pivot, only if a spring between the two is at its bound: then "
        "the slider, outwards of it, carries all of its friction against its motion",
    )
    p.show(
        "tensions are unique (the sweeping process of chapter beyond), and so are displacements: "
        "if no slider rested in a dilation, all above some spring n sliding uphill and all below "
        "it downhill, their friction would exceed G by what vanishes "
        "at an edge alone:",
        beta(N) - beta(n) - beta(n) - p.pull,
        p.nearer_low,
    )


def _law(p: Proof, model: Model) -> None:
    """Show the plays of springs, displacements, the velocity, and Eq. 23 as its case."""
    width = p.show(
        "G above zero: a spring between the pivots has room for T_n of the width",
        p.high_above - p.low_below,
        beta(N) - p.pull,
        "width",
    )
    p.show(
        "... for both of its bounds change from spring to spring by the same,",
        p.low_below - p.low_below.subs(n, n - 1),
        p.own - s,
    )
    p.show("... and", p.high_above - p.high_above.subs(n, n - 1), p.own - s)
    p.show("G below zero: the width is", p.high_below - p.low_above, beta(N) + p.pull)
    p.show("... the bounds change by", p.low_above - p.low_above.subs(n, n - 1), -p.own - s)
    p.show("... and", p.high_below - p.high_below.subs(n, n - 1), -p.own - s)
    p.show(
        "a spring above both pivots has less room, for G above zero by",
        width - (p.high_above - p.low_above),
        p.nearer_low,
    )
    p.show(
        "... and one below both pivots by",
        width - (p.high_below - p.low_below),
        -p.nearer_high,
    )
    steps = p.lines[:]
    p.proved(
        "theorem: on any path of theta every spring is a play of l0 theta, and all springs between "
        f"the pivots are one play, of width {width} (G above zero): it passes the truncated "
        "variation of l0 theta at that level",
        all_hold(steps),
        "by the rule each length is pushed by l0 theta and a bound; after a dilation that brings "
        "all tensions to their lower bounds, the lengths between the pivots differ by constants",
    )
    spring = sp.Symbol("spring", integer=True)
    moved = p.show(
        f"slider n moves by all that the springs between it and {P} rise, and by all that those "
        f"between it and {K} fall:",
        sp.summation(rise, (spring, P, n - 1)) - sp.summation(fall, (spring, K, n - 1)),
        (n - P) * rise + (K - n) * fall,
    )
    variation, change = sp.symbols("variation change")
    p.show(
        "with the sum of rise and fall, the variation, and their difference, the change,",
        moved.subs({rise: (variation + change) / 2, fall: (variation - change) / 2}),
        (K - P) / 2 * variation + (n - (P + K) / 2) * change,
    )
    once = model.swing * l0 - width
    velocity = p.show(
        f"in cycles rise and fall are {once} or, if that is negative, nothing: tau_th v =",
        moved.subs({rise: once, fall: once}) / 2,
        (K - P) * (l0 * amplitude - (beta(N) - p.pull) / 2),
        "velocity",
    )
    beyond = positive_part(sp.cancel(velocity / (K - P)))
    p.entry("differing_velocity", creeps((K - P) * beyond) | {symbol("h"): width / 2}, lines=10)
    equal = {S_1: 0, S_N: 0, P: i - 1, K: N + 1 - (i - 1)}

    def of_equal(expression: Expression) -> Expression:
        known = expression.replace(beta, lambda index: index * mu_d * c)
        return known.subs(equal, simultaneous=True)

    p.show(
        f"Eq. 23: with equal friction and no end forces, {P} = {equal[P]} and {K} = {equal[K]}, "
        "tau_th v =",
        of_equal(velocity),
        plateaus.derive(model).finite,
    )
    p.show(
        "... and the pivot leaves its place at the slopes of the pivots' chapter:",
        pivots.slope(of_equal(p.nearer_low).subs(n, i - 1), sp.Integer(0)),
        pivots.derive(model).sliding_edge,
    )
    p.checked(
        "chains of rational numbers whose friction and end forces differ move as the theorem says "
        "on random paths, slide by slide",
        lambda: all(follows_the_plays(Random(size), size, 12) for size in SIZES),
        f"by Coulomb's law alone, N of {', '.join(map(str, SIZES))}",
    )


def _pipeline(p: Proof) -> None:
    """Show the walk of a pipeline in a cycle of heating and cooling, as N grows."""
    force, per_length, place = symbol("G"), symbol("friction"), sp.Symbol("place")
    known = {S_1: force - N * s - S_N, beta(N): N * per_length, beta(n): place * per_length}
    upper, lower = (solved(nearer.subs(known), place) for nearer in (p.nearer_low, p.nearer_high))
    apart = p.show(
        "a long chain of equal friction: its pivots, where the nearer bounds change, are apart by "
        "G over the friction of a slider",
        sp.expand(lower - upper),
        force / per_length,
    )
    whole, stiffness = symbol("f"), E * A * N / L
    walk = 2 * p.velocity.subs(known | {beta(N): whole * L}).subs(l0, heat / (2 * amplitude))
    walk = walk.subs(K, P + apart).subs(per_length, whole * L / N) / stiffness
    axial, free = E * A, heat * L / (E * A)
    general = p.show(
        f"a pipeline of length L and axial stiffness {axial}, friction f per length, expands "
        f"freely by {free} when it is heated: it walks in a cycle by",
        sp.expand(walk),
        force / (E * A * whole) * (heat - whole * L + force),
    )
    walks = {symbol("delta"): general, phi: alpha, sp.Abs(heat): heat, mu_p: mu_d}
    slope = {force: w_p * L * s, whole: mu_d * w_p * c}
    p.show(
        "on a slope, w its weight per length,",
        sp.expand(general.subs(slope)),
        L * s / (c * E * A * mu_d) * (heat - w_p * L * (mu_d * c - s)),
    )
    p.entry(
        "pipeline_walking",
        walks | {symbol("delta"): general.subs(slope)},
        holds=all_hold(p.lines[:]),
    )
    level = {force: R, whole: mu_d * w_p}
    p.show(
        "on a level bed, pulled at one end with the tension R,",
        sp.expand(general.subs(level)),
        R / (E * A * mu_d * w_p) * (heat - mu_d * w_p * L + R),
    )
    p.entry(
        "pipeline_pulled",
        walks | {symbol("delta"): general.subs(level)},
        holds=all_hold(p.lines[:]),
    )


def _dilations(p: Proof, made: Model) -> None:
    """Show what is left of the law where springs dilate by different weights."""
    off, flux = T(n) - trial(n), (T(n) - trial(n)) * v(n + 1)
    p.show(
        "springs dilate by weights w, all above zero. Beside a state in which sliders move at "
        "speeds v, other tensions differ: v_n times the difference of the forces, and the rate of "
        "the spring's length times the difference of tensions, sum up to nothing over the chain, "
        "for together they are, per slider,",
        v(n) * (made.force(n) - made.between(trial(n - 1), trial(n))) + off * (v(n + 1) - v(n)),
        flux - flux.subs(n, n - 1),
    )
    for way, word in ((1, "down"), (-1, "up")):
        p.show(
            f"a slider that moves {word}hill carries all of its friction, and a gap less in the "
            "other state: v_n times the difference of the forces is",
            way * speed * ((way * p.own - way * gap) - way * p.own),
            -speed * gap,
        )
    p.argued(
        "so a large dilation brings all tensions to their lower bounds, whatever the start",
        "at these bounds every slider but the pivot moves, at least at the speed of the least "
        "weight; beside them half the sum of squares of what tensions exceed them by falls at "
        "least by the sum of speeds times gaps, as its own slides add a term of the same sign; the "
        "gaps bound that excess, which is therefore used up by a finite ramp",
    )
    dilated, contracted = W(n) - W(P), W(K) - W(n)
    slope = p.show(
        "W(n) is the sum of the weights of the springs above slider n. More amplitude adds to a "
        "half-cycle, all tensions at their bounds, a slope of the velocity with l0 A of",
        sp.diff((dilated + contracted) * made.swing / 2, amplitude),
        W(K) - W(P),
        "slope",
    )
    p.show(
        "which is, for equal weights of one, that of the law",
        slope.replace(W, lambda index: index - 1),
        sp.diff(p.velocity, amplitude) / l0,
    )
    p.checked(
        "chains of rational numbers whose friction, end forces and weights differ have this slope",
        lambda: all(follows_the_slope(Random(size), size) for size in SIZES),
        f"by Coulomb's law alone, N of {', '.join(map(str, SIZES))}",
    )
    p.argued(
        "a level chain without end forces advances by nothing in cycles of any weights",
        "reversed, it is itself half a cycle later: its advance is its own negative",
    )
