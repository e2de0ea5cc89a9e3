"""The sliding limit mu_s -> mu_d: the chain as a play operator, for any path of theta.

In the limit a moving slider carries exactly the friction mu_d. For all N and i, after the first
large half-cycles, the sliders between the two pivots move by the rise and the fall of a single play
operator of width N m acting on l0 theta, which makes Eq. 23 exact. The proof is an
induction over the steps of the path; the audit holds it against chains in rational arithmetic, too.
"""

from __future__ import annotations

from fractions import Fraction
from random import Random

import sympy as sp

from derivations import plateaus
from derivations.chain import RationalChain, play_variation
from derivations.model import FRESH, Model, T, solved
from derivations.notation import (
    Expression,
    N,
    amplitude,
    brief,
    c,
    creeps,
    i,
    j,
    l0,
    mu_d,
    mu_s,
    n,
    positive_part,
    s,
    sigma_mu,
    slope_margin,
    tan,
)
from derivations.proof import Proof, chapter

rise, fall, rest, weight = sp.symbols("rise fall rest weight", positive=True)
LOCKED = 3, Fraction(19, 100), Fraction(1, 2), Fraction(3, 5)
"""N, tan(alpha), mu_d and mu_s of a chain next to an edge, which locks where the law says creep."""
REACHES = 2, 20, 200
"""Its amplitudes l0 A, in units of cos(alpha)."""
SIZES = range(2, 7)
"""Parameters of the chains with which the theorem is compared."""


def clamped(value: Expression, least: Expression, most: Expression) -> Expression:
    """Return a value, or the bound that it exceeds."""
    return sp.Min(sp.Max(value, least), most)


def nested() -> bool:
    """Return whether the difference of two driven tensions stays between what it is at the ends.

    T' moves within zero..w and T, T' + lag before the step, within lag - p..lag + w + r. The drive
    leads T to a place below its range, p2 below lag (p = p1 + p2), w1 above it, r1 above lag + w,
    or beyond its range.
    """
    lag, beyond = sp.Symbol("lag", real=True), sp.Symbol("u", nonnegative=True)
    p1, p2, w1, w2, r1, r2 = sp.symbols("p1 p2 w1 w2 r1 r2", nonnegative=True)
    below, width, above = p1 + p2, w1 + w2, r1 + r2
    least, most = lag - below, lag + width + above
    places = {
        least - beyond: least,
        lag - p2: lag - p2,
        lag + w1: lag,
        lag + width + r1: lag + r1,
        most + beyond: most - width,
    }
    for place, expected in places.items():
        apart = clamped(place, least, most) - clamped(place - lag, sp.Integer(0), width)
        inside = (expected - least).is_nonnegative and (most - width - expected).is_nonnegative
        if sp.expand(apart - expected) != 0 or not inside:
            return False
    return True


def pulls(before: Expression, behind: Expression) -> bool:
    """Return whether a front turns compression into tension, m, s and D being positive."""
    margins = {mu_d: (rest + weight) / c, mu_s: (rest + weight) / c + 1, s: weight}
    pushed, pulled = (sp.factor(tension.subs(margins)) for tension in (before, behind))
    return bool(pushed.is_negative and pulled.is_positive)


def follows_the_play(random: Random, size: int, targets: int) -> bool:
    """Return whether a random chain on a random path moves like the play operator."""
    low = Fraction(random.randint(1, 60), 30)
    slope = low * Fraction(random.randint(1, 119), 120)
    steps = size - size * slope / low
    if steps % 2 == 0:  # at an edge
        return follows_the_play(random, size, targets)
    index = int(steps // 2) + 2
    partner, margin = size + 1 - index, size * (low - slope)
    chain = RationalChain(size, slope, low)
    chain.to(4 * size * low)
    chain.to(Fraction(0))  # beyond the transient: the play is at +width/2
    start = list(chain.x)
    path = [margin * Fraction(random.randint(-90, 90), 60) for _ in range(targets)]
    for target in path:
        chain.to(target)
    _, up, down = play_variation(path, margin, margin / 2)
    return all(
        chain.x[slider - 1] - start[slider - 1]
        == (slider - index + 1) * up + (partner + 1 - slider) * down
        for slider in range(max(1, index - 1), min(size, partner + 1) + 1)
    )


def locks(size: int, slope: Fraction, low: Fraction, high: Fraction, reach: Fraction) -> bool:
    """Return whether three sliders have a locked cycle in which their ends slip."""
    phase = high - 2 * (high - reach) % (2 * (high - low))  # of an end that slips in cycles
    chain = RationalChain(size, slope, low, high, [phase, size * slope, -phase])
    begin = list(chain.forces)
    chain.to(2 * reach)
    chain.to(Fraction(0))
    return chain.forces == begin and chain.slips > 0 and not any(chain.x)


@chapter(
    "Sliding limit",
    "sliding limit: mu_s tends to mu_d",
    "no inertia",
    "a dilation and a contraction beyond the transient",
    "tan(alpha) inside plateau i",
)
def derive(p: Proof, model: Model) -> None:
    """Show the fronts of a contraction, the play's width, displacements and velocity."""
    _fronts(p, model)
    _play(p, model)
    _velocity(p, model)
    drawn = model.redraw == FRESH  # each stop has a coefficient of its own
    draws = sp.Symbol("K", integer=True, positive=True)
    p.show(
        "K slips of an end, each with a coefficient of its own of width sigma_mu, which is half as "
        "long per c: standard deviation of their mean",
        2 * c * sigma_mu / sp.sqrt(draws if drawn else 1),
        2 * c * sigma_mu / sp.sqrt(draws),
    )
    size, *numbers = LOCKED
    slope, low, high = map(float, numbers)
    edge = float((low * (size - 2) + high - low) / size)
    p.checked(
        f"with slips a chain next to an edge may lock at every amplitude: {size} sliders, mu_d = "
        f"{low}, mu_s = {high}, tan(alpha) = {slope}; the equation has the edge {edge:.4g}",
        lambda: all(locks(*LOCKED, Fraction(reach)) for reach in REACHES) and slope < edge,
        f"l0 A of {REACHES} c, in rational arithmetic",
    )
    p.entry("insensitive_to_disorder", lines=2, size=str(size), slope=slope)


def _fronts(p: Proof, model: Model) -> None:
    """Show between which bounds the tensions move, and that the pivots rest."""
    uphill, downhill = model.driven("first"), model.driven("last")
    outer = p.show(
        f"end of a dilation: the sliders above the pivot have slid uphill, so {T(n)} =",
        model.tension(n, 0, uphill),
        -n * (mu_d * c + s),
    )
    inner = p.show(
        f"those below it downhill, so {T(n)} =",
        model.tension(n, 1, downhill),
        -(N - n) * slope_margin,
    )
    behind = p.show(
        f"the contraction's front from above passes: all above slide downhill, so {T(n)} =",
        model.tension(n, 0, -uphill),
        n * slope_margin,
    )
    front = p.show(
        "tensions grow with the fall of l0 theta until slider n joins: above the pivot at",
        behind - outer,
        2 * n * mu_d * c,
    )
    turned = pulls(outer, behind)
    p.entry("compression_wave", holds=turned, lines=4, before=outer, behind=behind, front=front)
    lower_front = p.show(
        "the front from below reaches slider n at",
        model.tension(n - 1, 1, -downhill) - inner.subs(n, n - 1),
        2 * (N + 1 - n) * mu_d * c,
    )
    width = p.show(
        "and all from one pivot to the other join at once, at the play's width",
        behind - inner,
        N * slope_margin,
        "width",
    )
    lower, upper = (mu_d * (1 - 2 * (place - 1) / N) for place in (i, i - 1))
    p.show(
        "the slider above the pivot has joined before, as tan(alpha) is below its upper edge, by, "
        "per c,",
        (width - front.subs(n, i - 2)).subs(s, tan * c) / c,
        N * (upper - tan),
    )
    mirrored = N + 3 - i
    p.show(
        f"the one below the pivot of the contraction, slider {mirrored}, at the same moment",
        lower_front.subs(n, mirrored),
        front.subs(n, i - 2),
    )
    pivot = model.between(outer.subs(n, i - 2), inner.subs(n, i - 1))
    p.show(
        "the pivot is from starting uphill, as tan(alpha) is above its lower edge, by, per c,",
        (pivot - model.friction(1)).subs(s, tan * c) / c,
        N * (tan - lower),
    )
    p.show(
        "... and from starting downhill by",
        (-model.friction(1) - pivot).subs(s, tan * c) / c,
        N * (upper - tan),
    )
    half = mu_d / 2
    p.show(
        f"at its lower edge it could as well be slider i: the limit is not unique. tan(alpha) = "
        f"{half} is an edge where this i is whole, for every fourth N:",
        solved(lower - half, i),
        N / 4 + 1,
    )
    above = n - 1
    p.show(
        f"the largest tensions, {behind} at spring n, differ from those of spring {above} by",
        behind - behind.subs(n, above),
        slope_margin,
        "largest",
    )
    p.show(
        f"... the least above the pivot, {outer}, by",
        outer - outer.subs(n, above),
        -mu_d * c - s,
        "least",
    )
    p.show("... and between the pivots by", inner - inner.subs(n, above), slope_margin, "between")
    p.named |= {"outer": outer, "behind": behind}


def _play(p: Proof, model: Model) -> None:
    """Show that ranges one inside the other keep every force within friction, on any path."""
    first, weight = len(p.lines), model.between(sp.Integer(0), sp.Integer(0))
    p.proved(
        "two tensions that one ramp drives, each within its own range, T's around that of T' and "
        "the lag between them: after any step their difference lies between what it is at the "
        "least and at the largest tensions",
        nested,
        "wherever the ramp would lead: T at its least, T' alone at its least, neither at an end, "
        "T' alone at its largest, T at its largest",
    )
    p.show(
        "a large dilation ends with all tensions least; from there on, step by step, the force on "
        "a slider above the pivot is at least",
        p.least + weight,
        -mu_d * c,
    )
    p.show("... and at most, there and between the pivots,", p.largest + weight, mu_d * c)
    p.show("... where it is this at all times,", p.between + weight, mu_d * c)
    p.show(
        "in a contraction a spring is at its largest tension only if the one above is, which is, "
        "above its largest, by less than",
        p.behind - p.largest - p.behind.subs(n, n - 1),
        0,
    )
    p.show(
        "... and in a dilation at its least, above the pivot, alike",
        p.outer - p.least - p.outer.subs(n, n - 1),
        0,
    )
    p.show(
        "so a slider moves, by what the springs between it and the pivot give way, only while the "
        "force on it is, downhill,",
        p.largest + weight,
        -model.friction(1),
    )
    p.show("... and uphill", p.least + weight, -model.friction(-1))
    steps = p.lines[first:]
    p.proved(
        "theorem: on any path, however small its reversals, every tension moves with the fall of "
        "l0 theta within its range, and sliders obey the law of friction; between the pivots all "
        f"tensions move by one play of width {brief(p.width)}, whose rise and fall move sliders",
        lambda: not any(line.fault for line in steps) and not p.width.has(n),
        "induction over the steps of the path: the lines above are its first step and every next "
        "one; below the pivots the chain is its mirror image",
    )


def _velocity(p: Proof, model: Model) -> None:
    """Show displacements, and the velocity in cycles."""
    plateau, reach = plateaus.derive(model), p.width
    up, down = plateau.dilation / plateaus.rise / l0, plateau.contraction / plateaus.fall / l0
    moved = p.show(
        "slider n moves by rise and fall as in a dilation and a contraction",
        up * rise - down * fall,
        (n - (i - 1)) * rise + (j + 1 - n) * fall,
    )
    variation, change = sp.symbols("variation change")
    halves = {rise: (variation + change) / 2, fall: (variation - change) / 2}
    p.show(
        "with the sum of rise and fall, the variation, and their difference, the change,",
        moved.subs(halves).subs(j, N + 1 - i),
        (N + 3 - 2 * i) / 2 * variation + (n - (N + 1) / 2) * change,
    )
    once = model.swing * l0 - reach
    velocity = p.show(
        f"cycles: rise and fall are {brief(once)}; tau_th v =",
        moved.subs({rise: once, fall: once, j: N + 1 - i}) / 2,
        (N + 3 - 2 * i) * (l0 * amplitude - N * slope_margin / 2),
    )
    p.entry(
        "vitesse_seuil",
        creeps(velocity),
        creeps((N + 3 - 2 * i) * positive_part(velocity / (N + 3 - 2 * i))),
        lines=4,
    )
    p.show("the same as the paper's argument gives (plateaus)", velocity, plateau.finite)
    p.argued(
        "with mu_s above mu_d the law is that of the mean forces, and holds where no slider comes "
        "near to changing sides",
        "the mean force on a slider that sticks and slips is that of sliding (slip); far from the "
        "edges of a plateau the sum of phases does not reach them (pivots)",
    )
    p.entry("excellent_agreement", lines=2)
    p.checked(
        "chains of rational numbers move as the theorem says on random paths, slide by slide",
        lambda: all(follows_the_play(Random(size), size, 16) for size in SIZES),
        f"N of {', '.join(map(str, SIZES))}",
    )
