"""That two sliders on the level age: their mean square displacement grows as ln t."""

from __future__ import annotations

from functools import cache

import sympy as sp

from derivations import slip
from derivations.gaussian import A, B, h, z
from derivations.model import FRESH, Model, mu, solved
from derivations.notation import Expression, amplitude, c, l0, mu_d, n, s, symbol
from derivations.proof import Proof, chapter
from derivations.scaling import normal

u, S, later = sp.symbols("u S S_later", positive=True)
"""A level between draws; the path length of y = x_2 - x_1 - l0, and a later one."""
m, k = sp.symbols("m k", integer=True, positive=True)


def _moment(place: Expression) -> Expression:
    """Return the integral of S**2 dy up to a turn at the path length `place`, times the sign."""
    return place**2 - sp.Rational(2, 3)


@chapter(
    "Level pairs",
    "disorder",
    "no mu_s below mu_d",
    "relaxed chain",
    "slips are as in chapter slip",
    "a mean over many slips",
)
def derive(p: Proof, model: Model) -> None:
    """Show the play, the new maxima, the mean square under cycles, and its rate under others."""
    half_width = _play(p, model)
    correlation = _new_maxima(p, model)
    _cycles(p, model, half_width, correlation)
    _targets(p)


def _play(p: Proof, model: Model) -> Expression:
    """Return the half-width of the play through which the spring follows l0 theta."""
    first, last, tension = (part.subs(s, 0) for part in model.pair())
    p.show("on the level the two forces are opposite: their sum is", first + last, 0)
    starts = [solved(force - sign * model.threshold(mu(place)), tension)
              for force, sign, place in ((first, -1, 1), (last, 1, 2))]  # fmt: skip
    apart = c * (mu(1) - mu(2))
    p.show("falling, it meets the threshold of slider 2 first, by", starts[1] - starts[0], apart)
    begin = solved(last - model.threshold(), tension)
    centre = p.show(
        "so the smaller coefficient slips; the tension at the middle of its slip is",
        begin + slip.derive(model).last / 2,
        -mu_d * c,
    )
    push = (model.push("last") - model.push("first")) / 2
    p.show("so y follows l0 theta as a play of this half-width; l0 theta loads them by", push, 1)
    return -centre


def _new_maxima(p: Proof, model: Model) -> Expression:
    """Return the correlation of the sign of dx_G/dy at two path lengths."""
    p.proved(
        "who slips draws anew, the other one keeps the largest of all draws so far: they change "
        "roles when a draw is a new maximum",
        lambda: model.redraw.has(FRESH),
        "the model numbers coefficients by stops",
    )
    chance = p.show(
        "draw n, at the level u of its law, is a new maximum if the others are below: probability",
        sp.integrate(u ** (n - 1), (u, 0, 1)),
        1 / n,
    )
    lower = sp.integrate(u ** (n - 1), (u, 0, z)).subs(z, u)
    p.show(
        "draw n and draw n + m are both new maxima with the product of both probabilities,",
        sp.integrate(lower * u ** (m - 1), (u, 0, 1)),
        chance * chance.subs(n, n + m),
    )
    kept = n * (n - 1) / (m * (m - 1))
    p.show(
        "each draw turns the sign with this probability: from draw n to m its mean is "
        f"{kept}, which one more draw multiplies by",
        kept.subs(m, m + 1) / kept,
        1 - 2 * chance.subs(n, m + 1),
    )
    long = sp.limit(kept.subs(m, k * n), n, sp.oo).subs(k, later / S)
    return p.show(
        "after many draws, in number as the path length S of y: E[s s'] =", long, (S / later) ** 2
    )


def _cycles(p: Proof, model: Model, half_width: Expression, correlation: Expression) -> None:
    """Show the mean square of x_G = (1/2) int s dy under cycles, by induction."""
    reach = (model.swing * l0 / 2 - half_width).subs(c, 1)
    p.show("cycles: y turns at plus and minus", reach, l0 * amplitude - mu_d)
    low, high = 2 * n - 3, 2 * n - 1
    weight = sp.expand(correlation * later**2)  # the part of the earlier place
    step = sp.integrate(weight, (S, low, high))
    p.show(
        f"in units of it half-cycle n begins at S = {low} and ends at {high}; the integral of S S "
        "dy up to a turn changes its sign each time: before and after add up to",
        _moment(low) + _moment(high),
        step,
    )
    p.show("... up to the first turn it is", sp.integrate(weight, (S, 0, 1)), _moment(1))
    inside = sp.integrate(weight, (S, low, later)) - _moment(low)
    grown = sp.integrate(sp.expand(inside * correlation / S**2), (later, low, high)) / 2
    gain = p.show("half-cycle n adds to the mean square", grown, (1 / low + 1 / high) / 3)
    first = sp.integrate(sp.integrate(correlation, (S, 0, later)), (later, 0, 1)) / 2
    odd = sp.Function("H")  # of n: the sum of 1/(2j - 1) up to n
    known = 2 * odd(n) / 3 - sp.Rational(1, 4) - 1 / (3 * high)
    before = known.subs(n, n - 1).subs(odd(n - 1), odd(n) - 1 / high)
    p.show("so does the formula with H, a sum of inverse odd numbers,", known - before, gain)
    p.show("... and the same beginning", first, known.subs(n, 1).subs(odd(1), 1))
    total = known.subs(odd(n), symbol("H_q")).subs(n, symbol("q")) * reach**2
    p.entry("level_displacement", {symbol("w"): total}, lines=15)
    p.show("ever less: n times the gain tends to", sp.limit(n * gain, n, sp.oo), 1 / sp.S(3))
    p.entry("ages", holds=lambda: sp.limit(gain, n, sp.oo) == 0, lines=16)


def _targets(p: Proof) -> None:
    """Show the rate of the growth under independent targets."""
    ahead = normal(z, -h, 1) / B * A / (A + B)
    law = A * B / (A + B)
    p.show(
        "targets: y, rising, turns round at z if the target is not above z + h and the next move "
        "is a fall; so does y, falling, in the mirror image. The difference of both rates is the "
        f"slope along z of the logarithm of y's density along S, {law}:",
        normal(z, h, 1) / A * B / (A + B) - ahead,
        (sp.diff(law, A) * normal(z, h, 1) - sp.diff(law, B) * normal(z, -h, 1)) / law,
    )
    p.argued(
        "the mean square grows by the mean of y y over S per S, hence as its product with ln t",
        "by parts, x_G x_G is the integral of y y / S over S beside terms that stay finite",
    )
    p.show(
        "that mean, for h = zero: the integral of z z in this density over the one without z z, by "
        "parts",
        _third_moment() / 3 / sp.integrate(normal(z, 0, 1) ** 2, (z, -sp.oo, sp.oo)) / 2,
        sp.Rational(5, 6),
    )


@cache
def _third_moment() -> Expression:
    """Return the mean of z**3 erf(z/sqrt(2)) for a standard normal z, by Stein's identity."""
    density = normal(z, 0, 1)
    slope = sp.diff(sp.erf(z / sp.sqrt(2)), z)
    parts = 2 * slope + z**2 * slope  # E[z f] = E[f'], with z**2 erf and again with 2 z erf
    return sp.integrate(sp.expand(parts * density), (z, -sp.oo, sp.oo))
