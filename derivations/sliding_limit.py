"""The sliding limit mu_s -> mu_d: the chain as a play operator, for any path of theta.

In the limit a moving slider carries exactly the friction mu_d. For all N and i, after the first
large half-cycles, the sliders between the two pivots move by the rise and the fall of a single play
operator of width N m acting on l0 theta, which makes Eq. (vitesse_seuil) exact.
"""

from __future__ import annotations

from fractions import Fraction

import sympy as sp

from derivations import plateaus
from derivations.chain import RationalChain
from derivations.model import FRESH, Model, solved
from derivations.notation import (
    Expression,
    N,
    amplitude,
    c,
    creeps,
    i,
    j,
    l0,
    mu_d,
    mu_s,
    n,
    s,
    sigma_mu,
    slope_margin,
    tan,
)
from derivations.proof import Proof, chapter

rise, fall, rest, weight = sp.symbols("rise fall rest weight", positive=True)
below, width, above = sp.symbols("p w r", nonnegative=True)


@chapter(
    "Sliding limit",
    "mu_s -> mu_d: a slider holds no more than sliding friction",
    "no inertia",
    "one dilation and one contraction beyond the transient",
    "mu_d (1 - 2(i-1)/N) < tan(alpha) < mu_d (1 - 2(i-2)/N)",
)
def derive(p: Proof, model: Model) -> None:
    """Show the fronts of a contraction, the play's width, displacements and velocity."""
    _fronts(p, model)
    _play(p)
    _velocity(p, model)
    drawn = model.redraw == FRESH  # each stop has a coefficient of its own
    draws = sp.Symbol("K", integer=True, positive=True)
    p.show(
        "K slips of an end by 2 (mu_s - mu_d) c, each with a coefficient of its own of width "
        "sigma_mu: standard deviation of their mean",
        2 * c * sigma_mu / sp.sqrt(draws if drawn else 1),
        2 * c * sigma_mu / sp.sqrt(draws),
    )
    p.checked(
        "with slips a chain next to an edge may lock at every amplitude: N = 3, mu_d = .5, "
        "mu_s = .6, tan(alpha) = .19",
        _locks,
        "l0 A = 2, 20, 200 (cos alpha)",
    )
    p.entry("insensitive_to_disorder", lines=2)


def _fronts(p: Proof, model: Model) -> None:
    """Show between which bounds the tensions move, and that the pivots rest."""
    uphill, downhill = model.push("first"), model.push("last")
    outer = p.show(
        "end of a dilation: sliders 1..i-2 have slid uphill, so T_n =",
        model.tension(n, 0, uphill),
        -n * (mu_d * c + s),
    )
    inner = p.show(
        "sliders i..N downhill, so T_n =",
        model.tension(n, 1, downhill),
        -(N - n) * slope_margin,
    )
    behind = p.show(
        "the contraction's front from above passes: 1..n slide downhill, so T_n =",
        model.tension(n, 0, -uphill),
        n * slope_margin,
    )
    # signs for mu_d c = m + s, mu_s > mu_d, slopes above 0
    signs = {mu_d: (rest + weight) / c, mu_s: (rest + weight) / c + 1, s: weight}
    before, after = (sp.factor(tension.subs(signs)) for tension in (outer, behind))
    pulls = before.is_negative and after.is_positive
    p.alone("compression_wave", holds=pulls)
    front = p.show(
        "tensions grow by -l0 dtheta until slider n joins: above the pivot at -l0 dtheta =",
        behind - outer,
        2 * n * mu_d * c,
    )
    lower_front = p.show(
        "the front from below reaches slider n at",
        model.tension(n - 1, 1, -downhill) - inner.subs(n, n - 1),
        2 * (N + 1 - n) * mu_d * c,
    )
    width = p.show(
        "and all of i-1..j join at once, at the play's width",
        behind - inner,
        N * slope_margin,
        "width",
    )
    lower, upper = (mu_d * (1 - 2 * (place - 1) / N) for place in (i, i - 1))
    p.show(
        "slider i-2 has joined before, by N (upper edge - tan(alpha)) c",
        (width - front.subs(n, i - 2)).subs(s, tan * c) / c,
        N * (upper - tan),
    )
    p.show(
        "slider j+2, j = N + 1 - i, at the same moment",
        lower_front.subs(n, N + 3 - i),
        front.subs(n, i - 2),
    )
    pivot = model.between(outer.subs(n, i - 2), inner.subs(n, i - 1))
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
    p.show(
        "at its lower edge it could as well be slider i: the limit is not unique. tan(alpha) = "
        "mu_d/2 is an edge for i = N/4 + 1, which is whole for N = 4k",
        solved(lower - mu_d / 2, i),
        N / 4 + 1,
    )
    p.show(
        "neighbours' ranges of tension, from the least to the largest, differ by -2 mu_d c in an "
        "outer part: from T_{n-1} to T_n the largest grow by m",
        behind - behind.subs(n, n - 1),
        slope_margin,
    )
    p.show("... the least fall by mu_d c + s", outer - outer.subs(n, n - 1), -mu_d * c - s)
    p.show("... and between the pivots both grow by m", inner - inner.subs(n, n - 1), slope_margin)


def _play(p: Proof) -> None:
    """Show that ranges one inside the other keep every force within friction, on any path."""

    def clamped(value: Expression, least: Expression, most: Expression) -> Expression:
        return sp.Min(sp.Max(value, least), most)

    lag = sp.Symbol("lag", real=True)
    least, most = lag - below, lag + width + above

    def difference(place: Expression) -> Expression:
        """Return T - T' after a step: T within least..most, T' = T - lag within 0..w before."""
        return clamped(place, least, most) - clamped(place - lag, sp.Integer(0), width)

    p.proved(
        "two tensions that one ramp drives, each within its own range, T's range around T' + lag: "
        "after any step T - T' lies between what it is at the least and at the largest tensions",
        lambda: (
            difference(least) == least
            and difference(lag) == difference(lag + width) == lag
            and difference(most) == most - width
        ),
        "as a function of where the ramp would lead, T - T' grows from its first to its last "
        "value: constant, then by T alone, constant, then by T alone, constant",
    )
    before = list(p.lines)
    p.proved(
        "theorem: on any path, however small its reversals, every T_n moves with -l0 theta within "
        "its range; between the pivots all T_n by one play of width N m, whose rise and fall "
        "move the sliders",
        lambda: not any(line.fault for line in before),
        "induction over the steps of the path: a large dilation ends with all T_n least; by the "
        "lines above F_n stays within mu_d c, and below it at the pivots; where slider n slides "
        "T_n is at a bound, and then T_{n-1} is at its own, so that |F_n| is mu_d c",
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
        "with rise + fall = variation, rise - fall = change",
        moved.subs(halves).subs(j, N + 1 - i),
        (N + 3 - 2 * i) / 2 * variation + (n - (N + 1) / 2) * change,
    )
    once = model.swing * l0 - reach
    velocity = p.show(
        "cycles: rise = fall = 2 l0 A - N m; tau_th v =",
        moved.subs({rise: once, fall: once, j: N + 1 - i}) / 2,
        (N + 3 - 2 * i) * (l0 * amplitude - N * slope_margin / 2),
    )
    p.entry("vitesse_seuil", creeps(velocity), lines=4)
    p.show("the same as the paper's argument gives (plateaus)", velocity, plateau.finite)


def _locks() -> bool:
    """Return whether N = 3 at tan(alpha) = .19 has a locked cycle where the law says creep."""
    slope, low, high = Fraction(19, 100), Fraction(1, 2), Fraction(3, 5)
    for reach in map(Fraction, (2, 20, 200)):
        phase = high - 2 * (high - reach) % (2 * (high - low))  # of an end that slips in cycles
        chain = RationalChain(3, slope, low, high, [phase, 3 * slope, -phase])
        begin = list(chain.forces)
        chain.to(2 * reach)
        chain.to(Fraction(0))
        if chain.forces != begin or chain.slips == 0 or any(chain.x):
            return False
    return True
