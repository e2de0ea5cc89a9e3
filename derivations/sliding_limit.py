"""The sliding limit mu_s -> mu_d: the chain as a play operator, for any path of theta.

In the limit a moving slider carries exactly the friction mu_d. For all N and i, after the first
large half-cycles, the sliders between the two pivots move by the rise and the fall of a single play
operator of width N m acting on l0 theta, which makes Eq. (vitesse_seuil) exact.
"""

from __future__ import annotations

from fractions import Fraction
from random import Random

import sympy as sp

from derivations import plateaus
from derivations.chain import NotUnique, RationalChain, play_variation
from derivations.entry import Backed, Backing, Lines, entries_of, stands
from derivations.judges import Judge, follows
from derivations.model import FRESH, Model, T
from derivations.notation import (
    N,
    amplitude,
    c,
    i,
    j,
    l0,
    mu_d,
    mu_s,
    n,
    s,
    sigma_mu,
    slope_margin,
    symbol,
)
from derivations.proof import Proof, chapter
from derivations.shakedown import ends_cycle, follow_ends

tau_th, tan = symbol("tau_th"), symbol("t")


@chapter(
    "Sliding limit",
    "mu_s -> mu_d: a slider holds no more than sliding friction",
    "no inertia",
    "one dilation and one contraction beyond the transient",
    "mu_d (1 - 2(i-1)/N) < tan(alpha) < mu_d (1 - 2(i-2)/N)",
)
def derive(p: Proof, model: Model) -> None:
    """Show the fronts of a contraction, the play's width, displacements and velocity."""
    uphill, downhill = model.push("first"), model.push("last")
    outer = p.show(
        "end of a dilation: sliders 1..i-2 have slid uphill, so T_n =",
        model.tension(n, 0, uphill),
        -n * (mu_d * c + s),
        "outer",
    )
    inner = p.show(
        "sliders i..N downhill, so T_n =",
        model.tension(n, 1, downhill),
        -(N - n) * slope_margin,
        "inner",
    )
    behind = p.show(
        "the contraction's front from above passes: 1..n slide downhill, so T_n =",
        model.tension(n, 0, -uphill),
        n * slope_margin,
        "behind",
    )
    front = p.show(
        "tensions grow by -l0 dtheta until slider n joins: above the pivot at -l0 dtheta =",
        behind - outer,
        2 * n * mu_d * c,
        "front",
    )
    width = p.show(
        "... and all of i-1..j at once, at the play's width",
        behind - inner,
        N * slope_margin,
        "width",
    )
    below = p.show(
        "the front from below reaches slider n at",
        model.tension(n - 1, 1, -downhill) - inner.subs(n, n - 1),
        2 * (N + 1 - n) * mu_d * c,
        "below",
    )
    lower, upper = mu_d * (1 - 2 * ((i - 1) / N)), mu_d * (1 - 2 * ((i - 2) / N))
    p.show(
        "slider i-2 has joined before, by N (upper edge - tan(alpha)) c",
        (width - front.subs(n, i - 2)).subs(s, tan * c) / c,
        N * (upper - tan),
    )
    p.show(
        "slider j+2, j = N + 1 - i, at the same moment",
        below.subs(n, N + 3 - i),
        front.subs(n, i - 2),
    )
    rests = {T(i - 1): inner.subs(n, i - 1), T(i - 2): outer.subs(n, i - 2)}
    pivot = model.force(i - 1).subs(rests)
    p.show(
        "the pivot i-1 is from starting uphill by N (tan(alpha) - lower edge) c",
        (pivot - model.friction(1)).subs(s, tan * c) / c,
        N * (tan - lower),
    )
    p.show(
        "... and from starting downhill by N (upper edge - tan(alpha)) c",
        (-model.friction(1) - pivot).subs(s, tan * c) / c,
        N * (upper - tan),
    )
    pulled = sp.Symbol("pulled", real=True)
    p.show(
        "the outer front only relieves it: while T_{i-2} lags behind (i-2) m its force is below "
        "that of the front by what is missing",
        model.force(i - 1).subs(T(i - 2), (i - 2) * slope_margin - pulled)
        - model.force(i - 1).subs(T(i - 2), behind.subs(n, i - 2)),
        pulled,
    )

    rise, fall = sp.symbols("rise fall", nonnegative=True)
    variation, change = sp.symbols("variation change")
    plateau = plateaus.derive(model)
    moved = p.show(
        "so between the pivots l0 theta acts through one play of width N m; slider n "
        "moves by its rise and fall as in a dilation and a contraction",
        (plateau.dilation / plateaus.rise / l0) * rise
        - (plateau.contraction / plateaus.fall / l0) * fall,
        (n - (i - 1)) * rise + (j + 1 - n) * fall,
        "moved",
    )
    split = {rise: (variation + change) / 2, fall: (variation - change) / 2, j: N + 1 - i}
    p.show(
        "with rise + fall = variation, rise - fall = change",
        moved.subs(split),
        (N + 3 - 2 * i) / 2 * variation + (n - (N + 1) / 2) * change,
        "split",
    )
    p.argued(
        "theorem: for any path of theta, after the transient, the sliders between the pivots "
        "move by the rise and the fall of one play of width N m",
        "fronts, pivots and width above hold at the end of every half-cycle that is larger "
        "than N m, whatever came before; in smaller ones the pivots' neighbours rest",
        "play",
    )
    once = model.swing * l0 - width
    velocity = p.show(
        "cycles: rise = fall = 2 l0 A - N m; v =",
        moved.subs({rise: once, fall: once, j: N + 1 - i}) / (2 * tau_th),
        (N + 3 - 2 * i) * (l0 * amplitude - N * slope_margin / 2) / tau_th,
        "velocity",
    )
    p.show("the same as the paper's argument gives (plateaus)", velocity * tau_th, plateau.finite)
    draws, length = sp.Symbol("K", integer=True, positive=True), 2 * c
    drawn = model.redraw != FRESH  # one coefficient for all stops
    p.show(
        "K slips of an end by 2 (mu_s - mu_d) c, each with a coefficient of its own of width "
        "sigma_mu: standard deviation of their mean",
        length * sigma_mu / (1 if drawn else sp.sqrt(draws)),
        2 * c * sigma_mu / sp.sqrt(draws),
        "averaged",
    )
    p.checked(
        "any path: rise and fall of the play",
        _paths,
        "66 random paths of 16 targets, N = 2..12, every slider",
        "paths",
    )
    p.checked(
        "at tan(alpha) = mu_d/2 every N = 4k has two limits, N + 3 - 2i and N + 1 - 2i, and "
        "what lies between; every other N has one",
        _ties,
        "N = 2..20: ties broken downhill, uphill, and once each",
        "ties",
    )
    p.checked(
        "with slips a chain next to an edge may lock at every amplitude: N = 3, mu_d = .5, "
        "mu_s = .6, tan(alpha) = .19",
        _locks,
        "l0 A = 2, 20, 200 (cos alpha)",
        "locks",
    )


def random_chain(random: Random, size: int) -> tuple[Fraction, Fraction, int]:
    """Return slope, mu_d and i of a chain that is not at an edge."""
    while True:
        low = Fraction(random.randint(1, 60), 30)
        slope = low * Fraction(random.randint(1, 119), 120)
        steps = size - size * slope / low
        if steps % 2 != 0:
            return slope, low, int(steps // 2) + 2


def _advance(chain: RationalChain, *targets: Fraction) -> list[Fraction]:
    before = list(chain.x)
    for target in targets:
        chain.to(target)
    return [after - start for start, after in zip(before, chain.x, strict=True)]


def path_agrees(random: Random, size: int, targets: int) -> bool:
    """Return whether a random chain on a random path moves as the play operator says."""
    slope, low, index = random_chain(random, size)
    margin, partner = size * (low - slope), size + 1 - index
    chain = RationalChain(size, slope, low)
    _advance(chain, 4 * size * low, Fraction(0))  # beyond the transient: the play is at +width/2
    path = [margin * Fraction(random.randint(-90, 90), 60) for _ in range(targets)]
    moved = _advance(chain, *path)
    _, rise, fall = play_variation(path, margin, margin / 2)
    return all(
        moved[slider - 1] == (slider - index + 1) * rise + (partner + 1 - slider) * fall
        for slider in range(max(1, index - 1), min(size, partner + 1) + 1)
    )


def _paths() -> bool:
    random = Random(22)
    return all(path_agrees(random, size, 16) for size in range(2, 13) for _ in range(6))


def _ties() -> bool:
    low, slope = Fraction(1, 2), Fraction(1, 4)
    for size in range(2, 21):
        try:
            RationalChain(size, slope, low).to(Fraction(4 * size))
            tie = False
        except NotUnique:
            tie = True
        if tie != (size % 4 == 0):
            return False
        reach, index = size * low, size // 4 + 1
        once = 2 * reach - size * (low - slope)
        ways = {"downhill": 3, "uphill": 1, "upper": 2, "lower": 2} if tie else {}
        for name, steps in ways.items():
            chain = RationalChain(size, slope, low, tie=name)
            _advance(chain, reach, -reach, reach)
            if set(_advance(chain, -reach, reach)) != {(size + steps - 2 * index) * once}:
                return False
    return True


def _locks() -> bool:
    """Return whether N = 3 at tan(alpha) = .19 has a locked cycle where the law says creep."""
    slope, low, high = Fraction(19, 100), Fraction(1, 2), Fraction(3, 5)
    reaches = [Fraction(2), Fraction(20), Fraction(200)]
    return all(
        2 * (reach - 3 * (low - slope) / 2) > 0
        and follow_ends(ends_cycle(3, slope, low, high, reach))
        for reach in reaches
    )


def _pulls(r: Lines) -> bool:
    """Return whether T_n is negative before a contraction's front and positive behind it."""
    rest, weight = sp.symbols("rest weight", positive=True)  # m and s; mu_d c = m + s
    signs = {mu_d: (rest + weight) / c, mu_s: (rest + weight) / c + 1}
    before, behind = (
        sp.factor(tension.subs(signs).subs(s, weight))
        for tension in (r.alone("outer"), r.alone("behind"))
    )
    return bool(before.is_negative and behind.is_positive)


def _velocity(r: Lines) -> Judge:
    value = r.velocity
    return follows({"v_N_star": lambda index: value.subs(i, index)})


LINES: dict[str, Backed | None] = {
    "compression_wave": _pulls,
    "insensitive_to_disorder": lambda r: stands(r.averaged, r.locks),
    "vitesse_seuil": lambda r: Backing(_velocity(r), evidence=stands(r.width, r.front, r.below)),
}
ENTRIES = entries_of("sliding_limit", derive, LINES)
