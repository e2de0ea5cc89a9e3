"""Laws beside the paper's: Moseley, Croll, pipelines that walk, Moreau, and level chains."""

from __future__ import annotations

import sympy as sp

from derivations import continuum, pivots, thresholds
from derivations.judges import vanishes
from derivations.model import Model, T, g, solved
from derivations.notation import (
    L,
    N,
    Y,
    alpha,
    amplitude,
    c,
    creeps,
    excess,
    i,
    l0,
    mu_d,
    mu_s,
    n,
    rho,
    s,
    slope_margin,
    star,
    symbol,
)
from derivations.proof import Proof, chapter

E, A, w_p, phi, mu_p, heat = (symbol(x) for x in ["E", "A", "w", "phi", "mu", "Delta_f"])
v, trial, low = sp.Function("v"), sp.Function("trial"), sp.Symbol("low", positive=True)
speed, gap = sp.symbols("speed gap", nonnegative=True)


@chapter("Beside the paper", "each line says what it assumes")
def derive(p: Proof, model: Model) -> None:
    """Show how the laws of others, and of other fields, follow from the same model."""
    solid = continuum.derive(model)
    moseley = p.show(
        "Moseley: a solid that does not give, Y -> infinity: tau_th v =",
        sp.limit(solid.velocity, Y, sp.oo),
        L * s / (c * mu_d) * amplitude,
    )
    p.entry("moseley", creeps(moseley))
    linear = vanishes(sp.diff(moseley / amplitude, amplitude))
    p.alone("macroscopic_models", holds=linear)
    _croll(p, model)
    pipe = {amplitude: heat / (E * A) / 2, Y: E, rho: w_p / (A * g)}
    walking = p.show(
        "a pipeline on a seabed of slope phi, w its weight per length, walks in a cycle of "
        "heating and cooling, 2 A_theta = Delta_f/(E A), by 2 tau_th v =",
        sp.expand(2 * solid.velocity.subs(pipe)),
        (heat - w_p * L * slope_margin) * L * s / (c * E * A * mu_d),
    )
    walks = {symbol("delta"): walking, phi: alpha, sp.Abs(heat): heat, mu_p: mu_d}
    p.entry("pipeline_walking", walks)
    _sweeping(p, model)
    _level(p, model)


def _croll(p: Proof, model: Model) -> None:
    """Show the threshold of a chain that is free of stress at the start of each phase."""
    high = -model.friction(1)
    from_above = model.between(model.tension(n - 1, 0, 1), low)
    down = p.show(
        "Croll: a phase that begins without stress. Cooling by l0 |dtheta| = y stretches "
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
        "the whole chain slides once the fronts meet, N >> 1: n/N =",
        sp.limit(solved(down - up, n) / N, N, sp.oo),
        (mu_d * c + s) / (2 * mu_d * c),
    )
    croll = p.show(
        "a phase is 2A: A* =",
        (down / (2 * l0)).subs(n, meet * N),
        N * slope_margin / (2 * l0) * (mu_d * c + s) / (2 * mu_d * c),
    )
    p.entry("croll", {star: croll})
    p.show(
        "beside Eq. (seuil), whose phases begin with the stress of the last one",
        croll / thresholds.derive(model).sliding,
        (1 + s / (c * mu_d)) / 2,
    )
    p.entry("croll_differs")


def _sweeping(p: Proof, model: Model) -> None:
    """Show that the lengths of the springs are swept by the moving set of admissible tensions."""
    other, off = model.between(trial(n - 1), trial(n)), T(n) - trial(n)
    flux = off * v(n + 1)
    p.show(
        "sweeping process: slips do work on the difference to any other admissible state; "
        "v_n (F_n - F_n') sums up to minus the lengthening of the springs times T_n - T_n'",
        v(n) * (model.force(n) - other) + off * (v(n + 1) - v(n)),
        flux - flux.subs(n, n - 1),
    )
    for way, word in ((1, "down"), (-1, "up")):
        p.show(
            f"a slider that slides {word}hill has |F_n| = mu_d c, the other state by a gap less: "
            "v_n (F_n - F_n') =",
            way * speed * (-model.friction(way) - way * (mu_d * c - gap)),
            speed * gap,
        )
    before = p.lines[-3:]
    p.proved(
        "so minus the rate of lengths lies in the normal cone at T of the tensions with all "
        "|F_n| <= mu_d c, and this set, shifted by l0 theta, sweeps the lengths (Moreau)",
        lambda: not any(line.fault for line in before) and (speed * gap).is_nonnegative,
        "v_n (F_n - F_n') >= 0 for each slider; the right-hand side above telescopes to zero",
    )
    first, last, tension = model.pair()
    high = -model.friction(1)
    p.show(
        "N = 2: F_1 and F_2 are within mu_d c for T_1 from -m to m, so l0 theta passes a "
        "play of the width",
        solved(first - high, tension) - solved(last - high, tension),
        2 * slope_margin,
    )
    p.entry("sweeping_process", lines=5)


def _level(p: Proof, model: Model) -> None:
    """Show the two plateaus of a level chain that slides, and what slips do to them."""
    pivot, middle = pivots.derive(model), N / 2 + 1
    p.show(
        "level chains, N even: slider N/2 can be the pivot for slopes from",
        pivot.lower.subs(i, middle),
        -(mu_s - mu_d) / N,
    )
    p.show(
        "... and slider N/2 + 1 for slopes up to",
        pivot.critical.subs(i, middle),
        (mu_s - mu_d) / N,
    )
    p.show(
        "so with continuous sliding both plateaus exist for |tan(alpha)| < (mu_s - mu_d)/N; "
        "slider N/2 + 1 lets the chain creep uphill: N + 3 - 2i =",
        (N + 3 - 2 * i).subs(i, middle + 1),
        -1,
    )
    first, last, tension = model.pair()
    starts = solved(first + model.threshold(), tension)
    p.show(
        "with slips not so at N = 2: slider 1 starts uphill when slider 2 is beyond its "
        "threshold by",
        last.subs(tension, starts) - model.threshold(),
        2 * s,
    )
    ends = model.end(1) - model.end(0)
    halves = N / 2 * model.friction(-1) + N / 2 * model.friction(1)
    p.show(
        "in a dilation with N even let half of the sliders go up and measure F_n from -mu_d c, "
        "half down and from mu_d c, in units of D (a slip swings one by 2): the sum is",
        (N * model.scaled(model.weight) + ends + halves) / excess,
        N * s / ((mu_s - mu_d) * c),
    )
    p.argued(
        "so at large amplitude the velocity is the plateau's times one odd function of "
        "N tan(alpha)/(mu_s - mu_d): the two plateaus are one curve, and neither lasts",
        "nothing else enters as long as no slider reverses in a ramp; the curve itself has no "
        "closed form: measured 0.48 at 1/2, 0.80 at 1 for N = 6",
    )
    p.entry("level_chains", lines=6)
