"""Shakedown under cycles: rest, locked cycles of the two ends, and the end of all creep.

``y = l0 theta`` runs between -L and L, ``L = l0 A``. Structural mechanics calls a chain that comes
to rest under cycles *shaken down* (Melan's theorem), and slips that return *alternating*. Lengths
and forces have the same unit here (a spring's constant is 1).
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from math import ceil
from random import Random

import sympy as sp

from derivations import runaway, slip
from derivations.chain import Avalanche, RationalChain
from derivations.entry import Backed, entries_of
from derivations.model import Model, T, after, before, solved
from derivations.notation import Expression, N, c, excess, mu_d, mu_s, n, s, slope_margin
from derivations.proof import Proof, chapter

L, E_0 = sp.symbols("L E_0", positive=True)
inner, first, last = sp.symbols("W w_1 w_N", positive=True)
"""Thresholds: the sum over the inner sliders, slider 1's, slider N's."""
eps, gap, speed, a, b, d, k = sp.symbols("eps gap speed a b d k", nonnegative=True)
tau, v, rest_state = sp.Function("tau"), sp.Function("v"), sp.Function("T_0")


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
        part - (part.subs(n, n - 1)),
        model.force(n),
    )
    total = model.end(1) - model.end(0) + N * model.force(n).subs({T(n): 0, T(n - 1): 0})
    _rest(p, total)
    _melan(p, model)
    _ends(p, model, total)


def _rest(p: Proof, total: Expression) -> None:
    """Show when a state at rest over all cycles exists: an end holds iff |F| <= w - L."""
    held = (first - L - a) + (inner - b) + (last - L - d)
    bound = (first + inner + last - N * s) / 2
    needed = p.show(
        "a state at rest over a cycle has slacks a, b, d >= 0 to the thresholds less L at the ends:"
        " L =",
        solved(held - total, L),
        bound - (a + b + d) / 2,
    )
    share = solved(k * (first - L + inner + last - L) - total, k)
    below = {inner: 2 * L + N * s + gap - first - last, s: sp.Symbol("weight", positive=True)}
    p.proved(
        "so it exists iff L <= min(w_1, w_N, (w_1 + ... + w_N - N s)/2)",
        lambda: (
            sp.expand(bound - needed).is_nonnegative
            and sp.cancel(share.subs(below)).is_nonnegative
            and sp.cancel(1 - share.subs(below)).is_nonnegative
        ),
        "necessary: the slacks; sufficient: forces that are one share N s/(w_1 + ... + w_N - 2L) "
        "of what friction leaves room for, which lies in [0, 1] and makes them sum to N s",
    )
    equal = dict.fromkeys((first, last), mu_s * c) | {inner: (N - 2) * mu_s * c}
    p.show(
        "with one mu_s: L <=",
        solved(held.subs({a: 0, b: 0, d: 0}) - total, L).subs(equal),
        N * (mu_s * c - s) / 2,
        "at_rest",
    )


def _melan(p: Proof, model: Model) -> None:
    """Show that below Melan's bound with mu_d no state creeps for ever."""
    state = {T(q): rest_state(q) + tau(q) for q in (n, n - 1)}
    springs = model.force(n).subs(state, simultaneous=True) - model.force(n).subs(
        {T(q): rest_state(q) for q in (n, n - 1)}
    )
    p.show(
        "E = |v|**2/2 + |tau|**2/2, tau = T - T_rest of a state at rest with mu_d; springs "
        "exchange their power (runaway), for the forces of tau are",
        springs,
        tau(n) - tau(n - 1),
    )
    for way, word in ((1, "down"), (-1, "up")):
        held = way * (mu_d * c - eps - gap)  # the force of the state at rest, within mu_d c - eps
        p.show(
            f"a slider that moves {word}hill takes from E at least eps |v|: dE/dt =",
            way * speed * (held + model.friction(way)),
            -(eps + gap) * speed,
        )
    more, path = sp.symbols("more path", nonnegative=True)
    end = sp.Symbol("E_end", nonnegative=True)
    whole = p.show(
        "over any time all paths together are",
        solved(sp.Eq(end, E_0 - eps * path - more), path),
        (E_0 - end - more) / eps,
    )
    p.proved(
        "... at most E_0/eps",
        lambda: ((E_0 / eps - whole) * eps).expand().is_nonnegative,
        "E is never negative, and ramps do not change tau",
    )
    low = (N * (mu_d * c - eps) - N * s) / 2
    p.show(
        "that state at rest exists for L up to (thresholds mu_d c - eps, eps -> 0)",
        low.subs(eps, 0),
        N * slope_margin / 2,
        "melan",
    )
    p.show(
        "so the paths are at most E_0/eps with eps =",
        solved(low - L, eps),
        slope_margin - 2 * L / N,
        "eps",
    )
    p.show(
        "every slip from delta c beyond mu_d c has a least length (runaway): there are at most",
        E_0
        / eps
        / runaway.derive(model).slip.subs({runaway.energy: E_0, runaway.first: runaway.step * c}),
        18 * E_0**2 / (eps * (runaway.step * c) ** 3),
    )
    p.argued(
        "for l0 A < min(mu_d c, N (mu_d c - s)/2) no state creeps for ever, with any static "
        "coefficients >= mu_d, drawn or not; with mu_s - mu_d >= delta it comes to rest",
        "the lines above; eps = min(mu_d c - L, mu_d c - s - 2L/N)",
    )


def _ends(p: Proof, model: Model, total: Expression) -> None:
    """Show the largest amplitude of a locked cycle in which only sliders 1 and N slip."""
    grown = sp.Symbol("u")
    p.show(
        "in a half-cycle every spring changes its length by at least",
        # before it sliders on one side hold what they can, after it those on the other side
        solved((first + inner / 2 - 2 * L + grown) + (inner / 2 + last) - total, grown),
        2 * L - (first + inner + last - N * s),
    )
    p.argued(
        "above l0 A = N (mu_s c - s)/2 no two neighbours rest together through a half-cycle",
        "the line above, with the lengths unchanged",
    )
    w, move = model.threshold(), slip.derive(model).end_move
    passed = sp.diff(model.at("inner"), before)
    p.show(
        "k slips of an end by 2D change the force on its neighbour by",
        k * passed * move,
        2 * k * excess,
        "swing",
    )
    back = sp.diff(model.at("inner"), after)
    p.show("... at the other end by", k * back * move, 2 * k * excess)
    drop = -model.push("first") * 2 * L - k * move
    p.show("while the force on the end itself changes by", drop, 2 * L - 2 * k * excess)
    p.show(
        "so an end turns within its threshold up to L =",
        solved(drop - 2 * w, L),
        mu_s * c + k * excess,
        "reach",
    )
    high = w + w + (N - 4) * w + (w - k * back * move) + (w - drop)
    low = (drop - w) + (k * passed * move - w) - (N - 4) * w - w - w
    p.show(
        "highest forces at the end of a contraction, on 1, 2, 3..N-2, N-1, N: their sum",
        high,
        N * mu_s * c - 2 * L,
    )
    p.show("the lowest sum up to minus that", low, 2 * L - N * mu_s * c)
    p.show("they can sum to N s up to L =", solved(high - total, L), N * (mu_s * c - s) / 2, "edge")
    p.checked(
        "just at that amplitude the cycle exists and returns, a little above none does",
        lambda: all(_locked(size) for size in (3, 4, 6, 9)),
        "40 rational chains, N = 3, 4, 6, 9: every slip followed",
    )
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


@dataclass(frozen=True)
class EndsCycle:
    """Forces at the end of a contraction, in units of m g cos(alpha).

    Attributes
    ----------
    slope, mu_d, mu_s, reach : Fraction
        tan(alpha), the coefficients, and L.
    forces : tuple of Fraction
        On sliders 1..N.
    """

    slope: Fraction
    mu_d: Fraction
    mu_s: Fraction
    reach: Fraction
    forces: tuple[Fraction, ...]


def largest_ends_cycle(size: int, slope: Fraction, low: Fraction, high: Fraction) -> Fraction:
    """Return the largest L of a locked cycle of the ends for N >= 4, in units of cos(alpha)."""
    return min(size * (high - slope) / 2, high + (high - low) * (high // (high - low)))


def ends_cycle(
    size: int, slope: Fraction, low: Fraction, high: Fraction, reach: Fraction
) -> EndsCycle:
    """Return the forces that lead to a locked cycle of the ends at an amplitude where there is one.

    Every force takes the same share of what lies between its lowest and its highest value.
    """
    slips = max(0, ceil((reach - high) / (high - low)))
    swing = 2 * slips * (high - low)
    if size == 3:
        # no lag: sliders 1 and 3 slip together
        phase = 2 * reach - swing - high if slips else reach
        return EndsCycle(slope, low, high, reach, (phase, 3 * slope, -phase))
    lows = [2 * reach - swing - high, swing - high, *[-high] * (size - 4), -high, -high]
    highs = [high, high, *[high] * (size - 4), high - swing, high - 2 * reach + swing]
    room = sum(highs) - sum(lows)
    share = (size * slope - sum(lows)) / room if room else Fraction(1, 2)
    forces = tuple(a + share * (b - a) for a, b in zip(lows, highs, strict=True))
    return EndsCycle(slope, low, high, reach, forces)


def follow_ends(cycle: EndsCycle) -> int | None:
    """Return how often the ends slip in one cycle; None if another slider starts or it is not
    closed.
    """
    forces = list(cycle.forces)
    if sum(forces) != len(forces) * cycle.slope or max(map(abs, forces)) > cycle.mu_s:
        return None
    chain = RationalChain(len(forces), cycle.slope, cycle.mu_d, cycle.mu_s, list(forces))
    try:
        for target in (2 * cycle.reach, Fraction(0)):
            chain.to(target)
    except Avalanche:
        return None
    return chain.slips if chain.forces == forces else None


def chains(size: int, number: int) -> list[tuple[Fraction, Fraction, Fraction]]:
    """Return random rational (slope, mu_d, mu_s) that have locked cycles of the ends."""
    random = Random(size)
    found: list[tuple[Fraction, Fraction, Fraction]] = []
    while len(found) < number:
        low = Fraction(random.randint(2, 40), 20)
        high = low * (1 + Fraction(random.randint(1, 30), random.choice((20, 37, 60))))
        slope = low * Fraction(random.randint(0, 19), 20)
        if (3 * slope <= high) if size == 3 else (size * (high - slope) / 2 > high):
            found.append((slope, low, high))
    return found


def _locked(size: int, number: int = 40) -> int:
    """Return how many random chains have the cycle at their largest amplitude and not above it.

    Above it the same recipe for the forces leads out of the thresholds. N = 3 has no largest
    amplitude: three large ones are followed.
    """
    for slope, low, high in chains(size, number):
        if size == 3:
            reaches = [high * factor for factor in (Fraction(3, 2), Fraction(4), Fraction(30))]
            if not all(follow_ends(ends_cycle(3, slope, low, high, at)) for at in reaches):
                return 0
            continue
        edge = largest_ends_cycle(size, slope, low, high)
        for reach in (edge, high + (edge - high) * Fraction(2, 3)):
            if not follow_ends(ends_cycle(size, slope, low, high, reach)):
                return 0
        if follow_ends(ends_cycle(size, slope, low, high, edge + Fraction(1, 10**6))):
            return 0
    return number


LINES: dict[str, Backed | None] = {}
ENTRIES = entries_of("shakedown", derive, LINES)
