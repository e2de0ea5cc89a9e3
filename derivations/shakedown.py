"""Shakedown under cycles: rest, locked cycles of the two ends, and the end of all creep.

``y = l0 theta`` runs between -L and L, ``L = l0 A``. Structural mechanics calls a chain that comes
to rest under cycles *shaken down* (Melan's theorem), and slips that return *alternating*. Lengths
and forces have the same unit here (a spring's constant is 1).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from math import ceil
from random import Random

import sympy as sp

from derivations import runaway_old as runaway
from derivations import slip_old as slip
from derivations.notation import Expression, N, c, excess, mu_d, mu_s, n, s, slope_margin
from derivations.proof import Derivation, Entry, Results, Step, Verification

tension, velocity, offset = sp.Function("T"), sp.Function("v"), sp.Function("tau")
y = sp.Symbol("y", real=True)
"""Rise of l0 theta."""
L = sp.Symbol("L", positive=True)
inner, first, last = sp.symbols("W w_1 w_N", positive=True)
"""Thresholds: the sum over the inner sliders, slider 1's, slider N's."""
j = sp.Symbol("j", integer=True, positive=True)
k = sp.Symbol("k", integer=True, nonnegative=True)


def _force(slider: Expression) -> Expression:
    return tension(slider) - tension(slider - 1) + s


def _ramped(slider: int, size: int) -> Expression:
    """Return what a rise y of l0 theta does to the force on a slider of a chain of `size`."""
    moved = {tension(spring): tension(spring) - y for spring in range(1, size)}
    return sp.expand(_force(slider).subs(moved, simultaneous=True) - _force(slider))


def derive() -> Derivation:
    """Return the three amplitudes, the forces that attain them, and the rate of the energy."""
    part = tension(n) + n * s  # sliders 1..n, T_0 = 0
    thresholds = first + inner + last
    sum_bound = (thresholds - N * s) / 2
    share = N * s / (thresholds - 2 * L)
    work = velocity(n) * (_force(n) - mu_d * c * sp.sign(velocity(n)))
    kinetic = velocity(n) * (offset(n) - offset(n - 1))
    stretching = offset(n) * (velocity(n + 1) - velocity(n))
    w = mu_s * c
    # a locked cycle of the ends: forces at the end of a contraction, between these two bounds
    lowest = {
        "slider 1": 2 * L - 2 * k * excess - w,
        "slider 2": 2 * k * excess - w,
        "others": -w,
        "slider N - 1": -w,
        "slider N": -w,
    }
    highest = {
        "slider 1": w,
        "slider 2": w,
        "others": w,
        "slider N - 1": w - 2 * k * excess,
        "slider N": w - 2 * L + 2 * k * excess,
    }
    counted = {"others": N - 4}
    low, high = (
        sp.expand(sum(counted.get(name, 1) * value for name, value in side.items()))
        for side in (lowest, highest)
    )
    results = {
        "on_first": _ramped(1, 5),
        "on_inner": _ramped(3, 5),
        "on_last": _ramped(5, 5),
        "part": part,
        "at_rest": sum_bound,
        "at_rest_equal": sum_bound.subs({first: w, last: w, inner: (N - 2) * w}),
        "share": share,
        "power": sp.expand(work),
        "telescope": offset(n - 1) * velocity(n),
        "energy_terms": kinetic + stretching,
        "melan": (sum_bound.subs({first: mu_d * c, last: mu_d * c, inner: (N - 2) * mu_d * c})),
        "stretch": 2 * L - (thresholds - N * s),
        "low": low,
        "high": high,
        "swing": 2 * k * excess,
        "end_reach": w + k * excess,
    }
    steps = (
        Step("a rise y of l0 theta adds to F_1", results["on_first"]),
        Step("... to every inner force", results["on_inner"]),
        Step("... and to F_N", results["on_last"]),
        Step("F_1 + ... + F_n, T_0 = 0", part),
        Step("so all forces sum to N s; a state at rest over a cycle needs L up to w_1, w_N and"),
        Step("", sum_bound),
        Step("attained by forces that are one share of what friction leaves room for", share),
        Step("E = |v|**2/2 + |tau|**2/2, tau = T - T_reference: dE/dt = sum of", results["power"]),
        Step("with F_reference within mu_d c - eps: dE/dt <= -eps sum |v_n|, for L below mu_d c, "),
        Step("", results["melan"]),
        Step("in a half-cycle every spring changes its length by at least", results["stretch"]),
        Step(
            "k slips of 2D per end and half-cycle: an inner neighbour swings by", results["swing"]
        ),
        Step("and an end turns within its threshold up to L =", results["end_reach"]),
    )
    return Derivation(
        "Shakedown",
        steps,
        results,
        (
            "cycles of amplitude A > 0",
            "L = l0 A",
            "0 <= tan(alpha)",
            "effective mu_s >= mu_d",
            "N >= 2 (ends' cycles: N >= 3)",
        ),
    )


def check(v: Verification, r: Results) -> None:
    """Prove the lemmas of the three bounds, and verify the bounds along rational cycles."""
    _rest(v, r)
    _no_lasting_creep(v, r)
    _ends(v, r)


def _rest(v: Verification, r: Mapping[str, Expression]) -> None:
    v.identity("a ramp moves F_1 by -y", r["on_first"] + y, "tensions 1..N-1 fall by y")
    v.identity("a ramp moves F_N by +y", r["on_last"] - y, "the same")
    v.identity("no inner force feels a ramp", r["on_inner"], "the same")
    v.identity(
        "F_1 + ... + F_n = T_n + n s: the forces of the chain sum to N s",
        r["part"] - r["part"].subs(n, n - 1) - _force(n),
        "the sum grows by F_n; T_0 = T_N = 0",
    )
    a, b, d = sp.symbols("slack_1 slack_inner slack_N", nonnegative=True)
    total = (first - L - a) + (inner - b) + (last - L - d)
    v.identity(
        "at rest over a cycle: L is (w_1 + ... + w_N - N s)/2 less half of what friction has left",
        sp.solve(sp.Eq(total, N * s), L)[0] - (r["at_rest"] - (a + b + d) / 2),
        "an end holds F over the cycle iff |F| <= w - L; every slack is >= 0",
    )
    left = sp.Symbol("left", nonnegative=True)
    weight = sp.Symbol("weight", positive=True)
    share = r["share"].subs(inner, 2 * L + N * s + left - first - last).subs(s, weight)
    v.proved(
        "below it a share 0 <= N s/(w_1 + ... + w_N - 2L) <= 1 of each room is a state at rest",
        sp.cancel(share).is_nonnegative and sp.cancel(1 - share).is_nonnegative,
        "L = bound - left/2, left >= 0; the rooms w_1 - L, w_n, w_N - L are not negative for "
        "L <= min(w_1, w_N)",
    )
    v.identity(
        "these forces sum to N s",
        r["share"] * ((first - L) + inner + (last - L)) - N * s,
        "so tensions exist that exert them",
    )
    v.identity("equal coefficients: N (mu_s c - s)/2", r["at_rest_equal"] - N * (mu_s * c - s) / 2)
    v.argued(
        "a state at rest over all cycles exists iff L <= min(w_1, w_N, (w_1 + ... + w_N - N s)/2); "
        "with one mu_s: l0 A <= min(mu_s c, N (mu_s c - s)/2), for every N",
        "the claims above: necessary by the slacks, sufficient by the share",
    )


def _no_lasting_creep(v: Verification, r: Mapping[str, Expression]) -> None:
    v.identity(
        "kinetic and elastic exchange telescope",
        r["energy_terms"] - (r["telescope"].subs(n, n + 1) - r["telescope"]),
        "v_n (tau_n - tau_(n-1)) + tau_n (v_(n+1) - v_n) = tau_n v_(n+1) - tau_(n-1) v_n; "
        "tau_0 = tau_N = 0, so the sum over the chain is zero",
    )
    reference = sp.Function("T_0")
    forced = reference(n) - reference(n - 1) + s
    shifted = r["power"].subs(
        {tension(q): reference(q) + offset(q) for q in (n, n - 1)}, simultaneous=True
    )
    v.identity(
        "what remains of dE/dt is sum v_n (F_n,reference - mu_d c sign(v_n))",
        shifted
        - velocity(n) * (offset(n) - offset(n - 1))
        - velocity(n) * (forced - mu_d * c * sp.sign(velocity(n))),
        "equation of motion v_n' = F_n - mu_d c sign(v_n), T = T_reference + tau",
    )
    eps, gap, speed = sp.symbols("eps gap speed", nonnegative=True)
    for sign, way in ((1, "down"), (-1, "up")):
        # sign * F_reference = mu_d c - eps - gap
        held = sign * (mu_d * c - eps - gap)
        rate = shifted.subs({velocity(n): sign * speed, offset(n): 0, offset(n - 1): 0})
        rate = rate.doit().subs(reference(n), held + reference(n - 1) - s)
        rate = sp.expand(rate).subs(sp.sign(speed), 1)
        v.proved(
            f"a slider that moves {way}hill takes at least eps |v| from E",
            sp.expand(-rate - eps * speed).is_nonnegative,
            "its reference force lies within mu_d c - eps",
        )
    v.identity(
        "the reference state exists for L < N (mu_d c - s)/2, L < mu_d c",
        r["melan"] - N * slope_margin / 2,
        "the state at rest of the theorem above, with mu_d c - eps for every threshold",
    )
    v.argued(
        "for l0 A < min(mu_d c, N (mu_d c - s)/2) the paths of all sliders together are at most "
        "E/eps, eps = min(mu_d c - l0 A, mu_d c - s - 2 l0 A/N): no state creeps for ever, with "
        "any static coefficients >= mu_d, drawn or not",
        "the claims above: tau is constant on ramps, velocities are continuous and zero at rest, "
        "so E >= 0 never grows and loses eps per unit of path",
    )
    accel, energy = sp.symbols("accel E", positive=True)
    rate_of_force = sp.sqrt(sp.Matrix([1, -2, 1]).dot(sp.Matrix([1, -2, 1])))
    bound = rate_of_force * sp.sqrt(2 * energy)
    path = runaway.derive().results["shortest"].subs({runaway.first: accel, runaway.rate: bound})
    v.identity(
        "a slip that starts with the acceleration a is longer than a**3/(18 E)",
        path - accel**3 / (18 * energy),
        "|a'| = |v_(n-1) - 2 v_n + v_(n+1)| <= sqrt(6) |v| and |v|**2 <= 2E",
    )
    v.argued(
        "with mu_s - mu_d >= delta everywhere there are at most 18 E**2/(eps (delta c)**3) slips: "
        "the chain comes to rest",
        "every slip starts with an acceleration of at least delta c; path E/eps in all",
    )


def _ends(v: Verification, r: Mapping[str, Expression]) -> None:
    v.identity(
        "in a half-cycle every spring changes its length by at least 2L - (w_1 + ... + w_N - N s)",
        # T_j at its end is T_j - 2L + u; sliders 1..j pull at most their thresholds before it,
        # the others after it
        sp.solve(
            (first + inner / 2 - 2 * L + sp.Symbol("u")) + (inner / 2 + last) - N * s,
            sp.Symbol("u"),
        )[0]
        - r["stretch"],
        "dilation: the sum over 1..j after it is the sum before it - 2L + u, u the spring's "
        "growth; contraction: the same with the ends of the half-cycle exchanged",
    )
    v.argued(
        "above l0 A = N (mu_s c - s)/2 no two neighbours rest together through a half-cycle, in "
        "any state, locked or creeping",
        "the claim above with u = 0",
    )
    moved = slip.derive().results["end_displacement"]
    v.identity(
        "k slips of an end change its neighbour's force by 2 k D",
        k * moved - r["swing"],
        "a lone slip from the threshold is 2D (slip)",
    )
    f, g = mu_s * c, -mu_s * c
    v.identity(
        "an end with k slips per half-cycle turns within its threshold up to L = mu_s c + k D",
        (f - g + k * moved) / 2 - r["end_reach"],
        "F_1 after the dilation is F_1 - 2L + 2kD, between -mu_s c and mu_s c",
    )
    v.identity(
        "the highest forces at the end of a contraction sum to N mu_s c - 2L",
        r["high"] - (N * mu_s * c - 2 * L),
        "sliders 1, 2, 3..N-2, N-1, N; the number of slips cancels",
    )
    v.identity("the lowest sum to minus that", r["low"] + r["high"])
    v.identity(
        "they can sum to N s up to L = N (mu_s c - s)/2",
        sp.solve(r["high"] - N * s, L)[0] - N * (mu_s * c - s) / 2,
    )
    counts = {size: _locked(size) for size in (3, 4, 5, 6, 9)}
    v.verified(
        "just at that amplitude the cycle exists and returns, a little above it no cycle of the "
        "ends does",
        all(count > 0 for count in counts.values()),
        f"{sum(counts.values())} rational chains, N = 3, 4, 5, 6, 9: every slip followed",
    )
    v.argued(
        "N >= 4: the largest amplitude of a locked cycle in which only sliders 1 and N slip is "
        "l0 A = min(N (mu_s c - s)/2, mu_s c + D floor(mu_s/(mu_s - mu_d))), and there is none if "
        "N (mu_s c - s)/2 <= mu_s c",
        "the claims above: an inner neighbour swings by 2kD within 2 mu_s c, so k <= mu_s c/D; two "
        "neighbours (2 and 3) rest; an end has one phase in (mu_s c - 2D, mu_s c], so every such "
        "cycle has the period 1",
    )
    v.argued(
        "N = 3: such cycles exist at every amplitude above mu_s c if 3 s <= mu_s c, none otherwise",
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
    forces, slips = list(cycle.forces), 0
    if sum(forces) != len(forces) * cycle.slope or max(map(abs, forces)) > cycle.mu_s:
        return None
    for up in (1, -1):
        left = 2 * cycle.reach
        while True:
            rooms = (cycle.mu_s + up * forces[0], cycle.mu_s - up * forces[-1])
            room = min(*rooms, left)
            forces[0] -= up * room
            forces[-1] += up * room
            left -= room
            if left == 0:
                break
            step = 2 * (cycle.mu_s - cycle.mu_d)
            starting = [end for end, own in zip((0, -1), rooms, strict=True) if own == room]
            for end in starting:
                sign = up if end == 0 else -up
                forces[end] += sign * step
                forces[1 if end == 0 else -2] -= sign * step
            slips += len(starting)
            if max(map(abs, forces)) > cycle.mu_s:
                return None
    return slips if tuple(forces) == cycle.forces else None


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


ENTRIES: tuple[Entry, ...] = ()
