"""Laws beside the paper's: Moseley, Croll, pipelines that walk, Moreau, and level chains."""

from __future__ import annotations

import sympy as sp

from derivations import continuum, pivots, thresholds
from derivations.continuum import L, Y, rho
from derivations.entry import Backed, entries_of, stands
from derivations.judges import follows, vanishes
from derivations.model import Model, T, g, solved
from derivations.notation import (
    N,
    amplitude,
    c,
    excess,
    i,
    l0,
    mu_d,
    mu_s,
    n,
    s,
    slope_margin,
    symbol,
)
from derivations.proof import Proof, chapter

E, A, w_p, phi, mu_p, heat = (symbol(x) for x in ["E", "A", "w", "phi", "mu", "Delta_f"])
v, trial = sp.Function("v"), sp.Function("trial")


@chapter("Beside the paper", "each line says what it assumes")
def derive(p: Proof, model: Model) -> None:
    """Show how the laws of others, and of other fields, follow from the same model."""
    solid = continuum.derive(model)
    p.show(
        "Moseley: a solid that does not give, Y -> infinity: tau_th v =",
        sp.limit(solid.velocity, Y, sp.oo),
        L * s / (c * mu_d) * amplitude,
        "moseley",
    )

    low, high = sp.Symbol("low", positive=True), -model.friction(1)
    behind = model.tension(n - 1, 0, 1), model.tension(n, 1, -1)
    down = solved(model.force(n).subs({T(n): low, T(n - 1): behind[0]}) - high, low)
    up = solved(-model.force(n).subs({T(n): behind[1], T(n - 1): low}) - high, low)
    down = p.show(
        "Croll: a phase that begins without stress. Cooling by l0 |dtheta| = y stretches "
        "all springs alike; slider n joins those that slide from above at y =",
        down,
        n * slope_margin,
    )
    up = p.show("... and those that slide from below at y =", up, (N + 1 - n) * (mu_d * c + s))
    meet = p.show(
        "the whole chain slides once the fronts meet, N >> 1: n/N =",
        sp.limit(solved(down - up, n) / N, N, sp.oo),
        (mu_d * c + s) / (2 * mu_d * c),
    )
    croll = p.show(
        "a phase is 2A: A* =",
        (down / (2 * l0)).subs(n, meet * N),
        N * slope_margin / (2 * l0) * (mu_d * c + s) / (2 * mu_d * c),
        "croll",
    )
    p.show(
        "beside Eq. (seuil), whose phases begin with the stress of the last one",
        croll / thresholds.derive(model).sliding,
        (1 + s / (c * mu_d)) / 2,
        "croll_ratio",
    )

    pipe = {amplitude: heat / (E * A) / 2, Y: E, rho: w_p / (A * g)}
    p.show(
        "a pipeline on a seabed of slope phi, w its weight per length, walks in a cycle of "
        "heating and cooling, 2 A_theta = Delta_f/(E A), by 2 tau_th v =",
        sp.expand(2 * solid.velocity.subs(pipe)),
        (heat + w_p * L * s - w_p * L * mu_d * c) * L * s / (c * E * A * mu_d),
        "walking",
    )

    p.show(
        "sweeping process: slips do work on the difference to any other admissible state; "
        "v_n (F_n - F_n') sums up to minus the lengthening of the springs times T_n - T_n'",
        v(n) * (model.force(n) - model.force(n).subs({T(n): trial(n), T(n - 1): trial(n - 1)}))
        + (T(n) - trial(n)) * (v(n + 1) - v(n)),
        (T(n) - trial(n)) * v(n + 1) - (T(n - 1) - trial(n - 1)) * v(n),
        "work",
    )
    p.argued(
        "so the lengths of the springs are swept by the moving set of the tensions with all "
        "|F_n| <= mu_d c, shifted by l0 theta (Moreau)",
        "Coulomb's law says v_n (F_n - F_n') >= 0 for every admissible F_n'; the right-hand "
        "side telescopes to zero; so minus the rate of lengths lies in the normal cone",
        "swept",
    )
    pair = [model.force(1).subs({T(0): model.end(0)}), model.force(2).subs({T(2): model.end(1)})]
    bounds = [solved(way * force - high, T(1)) for force in pair for way in (1, -1)]
    width = p.show(
        "N = 2: the tighter of these bounds of T_1 are m and -m, so l0 theta passes a "
        "play of the width",
        bounds[0] - bounds[2],
        2 * slope_margin,
        "play",
    )
    p.show(
        "which is N m, as for every chain (sliding_limit), and 2 l0 A*: the play of one spring",
        2 * l0 * thresholds.derive(model).sliding.subs(N, 2),
        width,
    )

    lower, critical = pivots.derive(model).lower, pivots.derive(model).critical
    middle = N / 2 + 1
    p.show(
        "level chains, N even: slider N/2 can be the pivot for slopes from",
        lower.subs(i, middle),
        -(mu_s - mu_d) / N,
        "level_low",
    )
    p.show(
        "... and slider N/2 + 1 for slopes up to",
        critical.subs(i, middle),
        (mu_s - mu_d) / N,
        "level_high",
    )
    p.show(
        "so with continuous sliding both plateaus exist for |tan(alpha)| < (mu_s - mu_d)/N; "
        "slider N/2 + 1 lets the chain creep uphill: N + 3 - 2i =",
        (N + 3 - 2 * i).subs(i, middle + 1),
        -1,
        "uphill_steps",
    )
    starts = solved(pair[0] + model.threshold(), T(1))
    p.show(
        "with slips not so at N = 2: slider 1 starts uphill when slider 2 is beyond its "
        "threshold by",
        pair[1].subs(T(1), starts) - model.threshold(),
        2 * s,
        "never_uphill",
    )
    weight = model.force(n).subs({T(n): 0, T(n - 1): 0})
    total = N * weight + model.end(1) - model.end(0)
    p.show(
        "in a dilation with N even let half of the sliders go up and measure F_n from -mu_d c, "
        "half down and from mu_d c, in units of D (a slip swings one by 2): the sum is",
        (total + N / 2 * model.friction(-1) + N / 2 * model.friction(1)) / excess,
        N * s / ((mu_s - mu_d) * c),
        "loads",
    )
    p.argued(
        "so at large amplitude the velocity is the plateau's times one odd function of "
        "N tan(alpha)/(mu_s - mu_d): the two plateaus are one curve, and neither lasts",
        "nothing else enters as long as no slider reverses in a ramp; measured: 0.48 at 1/2, "
        "0.80 at 1 for N = 6",
        "odd",
    )


LINES: dict[str, Backed | None] = {
    "macroscopic_models": lambda r: vanishes(sp.diff(r.alone("moseley") / amplitude, amplitude)),
    "croll_differs": lambda r: not vanishes(r.alone("croll_ratio") - 1),
    "moseley": lambda r: follows({symbol("v_G"): r.moseley / symbol("tau_th")}),
    "croll": lambda r: follows({symbol("A_theta_star"): r.croll}),
    "pipeline_walking": lambda r: follows(
        {symbol("delta"): r.walking, sp.Abs(heat): heat, mu_p: mu_d}
        | {sp.sin(phi): s, sp.cos(phi): c, sp.tan(phi): s / c}
    ),
    "sweeping_process": lambda r: stands(r.work, r.swept, r.play),
    "level_chains": lambda r: stands(
        r.level_low, r.level_high, r.uphill_steps, r.never_uphill, r.loads, r.odd
    ),
}
ENTRIES = entries_of("beyond", derive, LINES)
