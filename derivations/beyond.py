"""Laws beside the paper's: Moseley, Croll, Moreau, and level chains."""

from __future__ import annotations

import sympy as sp

from derivations import continuum, pivots, plateaus, thresholds
from derivations.model import Model, T, after, here, solved
from derivations.notation import (
    CAPTIONS,
    Expression,
    L,
    N,
    Y,
    amplitude,
    brief,
    c,
    creeps,
    excess,
    i,
    l0,
    mu_d,
    mu_s,
    n,
    s,
    slope_margin,
    star,
    symbol,
    theta,
)
from derivations.proof import Line, Proof, chapter

v, trial, low = sp.Function("v"), sp.Function("trial"), sp.Symbol("low", positive=True)
tension_of = symbol("tension")
speed, gap = sp.symbols("speed gap", nonnegative=True)


def in_the_normal_cone(steps: list[Line], work: Expression) -> bool:
    """Return whether slips do no negative work, and the lines hold that sum it up."""
    return not any(line.fault for line in steps) and bool(work.is_nonnegative)


@chapter("Beside the paper", "each line says what it assumes")
def derive(p: Proof, model: Model) -> None:
    """Show how the laws of others, and of other fields, follow from the same model."""
    solid = continuum.derive(model)
    moseley = p.show(
        "Moseley: a solid that does not give, Y infinite: tau_th v =",
        sp.limit(solid.velocity, Y, sp.oo),
        L * s / (c * mu_d) * amplitude,
    )
    p.entry("moseley", creeps(moseley), lacks=sp.factor(solid.velocity / moseley - 1))
    rate = sp.diff(moseley / amplitude, amplitude)
    p.show("its ratio to the amplitude does not know it", rate, 0)
    p.entry("macroscopic_models", lines=2)
    _croll(p, model)
    _sweeping(p, model)
    _level(p, model)


def _croll(p: Proof, model: Model) -> None:
    """Show the threshold of a chain that is free of stress at the start of each phase."""
    high = -model.friction(1)
    from_above = model.between(model.tension(n - 1, 0, 1), low)
    down = p.show(
        "Croll: a phase that begins without stress. Cooling by theta, y in units of l0, stretches "
        "all springs alike; slider n joins those that slide from above at y =",
        solved(from_above - high, low),
        n * slope_margin,
    )
    from_below = model.between(low, model.tension(n, 1, -1))
    up = p.show(
        "... and those that slide from below at y =",
        solved(-from_below - high, low),
        (N + 1 - n) * (mu_d * c + s),
    )
    meet = p.show(
        "the whole chain slides once the fronts meet, for many sliders at a share of N of",
        sp.limit(solved(down - up, n) / N, N, sp.oo),
        (mu_d * c + s) / (2 * mu_d * c),
    )
    croll = p.show(
        f"a phase is {model.swing}: A* =",
        (down * amplitude / (model.swing * l0)).subs(n, meet * N),
        N * slope_margin / (2 * l0) * (mu_d * c + s) / (2 * mu_d * c),
    )
    lacks = sp.cancel(solved(down - up, n) / N / meet - 1)
    p.entry("croll", {star: croll}, lines=4, lacks=lacks)
    share = p.show(
        "beside Eq. 22, whose phases begin with the stress of the last one",
        croll / thresholds.derive(model).sliding,
        (1 + s / (c * mu_d)) / 2,
    )
    p.entry("croll_differs", share=share, at_captions=share.subs(CAPTIONS))


def _sweeping(p: Proof, model: Model) -> None:
    """Show that the lengths of the springs are swept by the moving set of admissible tensions."""
    admissible, off = model.between(trial(n - 1), trial(n)), T(n) - trial(n)
    flux = off * v(n + 1)
    gain = model.force(n) - admissible
    p.show(
        "sweeping process: slips do work on the difference to any other admissible state; v_n, "
        f"times {gain}, and the lengthening of springs, times {off}, sum up to "
        "nothing over the chain, for together they are, per slider,",
        v(n) * gain + off * (v(n + 1) - v(n)),
        flux - flux.subs(n, n - 1),
    )
    for way, word in ((1, "down"), (-1, "up")):
        p.show(
            f"a slider that slides {word}hill has the largest force, the other state by a gap "
            "less: v_n times their difference is",
            way * speed * (-model.friction(way) - way * (mu_d * c - gap)),
            speed * gap,
        )
    before = p.lines[-3:]
    pulled = model.scaled(model.pull(1, here, after))
    shift = p.show(
        "a spring's length is its tension and the natural length l0, shifted by",
        solved(pulled - tension_of, after) - here - tension_of - l0,
        l0 * theta,
    )
    p.proved(
        "so minus the rate of lengths lies in the normal cone of the tensions within sliding "
        f"friction, and the set of the lengths that these allow, shifted by {shift}, sweeps the "
        "lengths (Moreau)",
        lambda: in_the_normal_cone(before, speed * gap),
        "the work on the difference is not negative for any slider, and sums up to what the "
        "springs lose",
    )
    first, last, tension = model.pair()
    high = -model.friction(1)
    least, most = solved(last - high, tension), solved(first - high, tension)
    p.show(
        f"for two sliders both forces are within {high} for a tension from {brief(least)} to "
        f"{brief(most)}, so l0 theta passes a play of the width",
        most - least,
        2 * slope_margin,
    )
    p.entry("sweeping_process", lines=6)


def _level(p: Proof, model: Model) -> None:
    """Show the two plateaus of a level chain that slides, and what slips do to them."""
    pivot, middle = pivots.derive(model), N / 2 + 1
    upper = middle - 1
    p.show(
        f"level chains, N even: slider {upper} can be the pivot for slopes from",
        pivot.lower.subs(i, middle),
        -(mu_s - mu_d) / N,
    )
    p.show(
        f"... and slider {middle} for slopes up to",
        pivot.critical.subs(i, middle),
        (mu_s - mu_d) / N,
    )
    edge = pivot.critical.subs(i, middle)
    number = sp.cancel(plateaus.derive(model).cycle / (2 * l0 * amplitude))
    p.show(
        f"so with continuous sliding both plateaus exist for |tan(alpha)| below {edge}; slider "
        f"{middle} lets the chain creep uphill, in units of l0 A, by",
        number.subs(i, middle + 1),
        -1,
    )
    first, last, tension = model.pair()
    starts = solved(first + model.threshold(), tension)
    p.show(
        "with slips not so for two sliders: the upper one starts uphill when the lower one exceeds "
        "its threshold by",
        last.subs(tension, starts) - model.threshold(),
        2 * s,
    )
    ends = model.end(1) - model.end(0)
    halves = N / 2 * model.friction(-1) + N / 2 * model.friction(1)
    up, down = model.friction(1), model.friction(-1)
    p.show(
        "in a dilation with N even let half of the sliders go up and measure their forces from "
        f"{up}, half down and from {down}, in units of D: the sum is",
        (N * model.scaled(model.weight) + ends + halves) / excess,
        N * s / ((mu_s - mu_d) * c),
    )
    p.argued(
        "so at large amplitude the velocity is the plateau's times one odd function of "
        "N tan(alpha)/(mu_s - mu_d): the two plateaus are one curve, and neither lasts",
        "nothing else enters as long as no slider reverses in a ramp; the curve itself has no "
        "closed form",
    )
    p.entry("level_chains", lines=6, edge=edge)
