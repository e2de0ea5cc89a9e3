"""That a cycle of large amplitude advances the chain by (N + 3 - 2i) l0 A in a half-cycle."""

from __future__ import annotations

import sympy as sp

from derivations import pivots, thresholds
from derivations.judges import follows, leading, vanishes
from derivations.model import Model, after, here, solved
from derivations.notation import (
    Expression,
    Formula,
    N,
    amplitude,
    at,
    creeps,
    i,
    j,
    l0,
    mu_d,
    n,
    slope_margin,
    symbol,
    theta,
)
from derivations.proof import Proof, chapter

rise, fall = symbol("Delta_theta_plus"), symbol("Delta_theta_minus")
spring = sp.Symbol("spring", integer=True)


@chapter(
    "Plateau velocities",
    "large amplitude: all sliders but the pivot move during the whole half-cycle",
    "slider i - 1 is the pivot of a dilation",
)
def derive(p: Proof, model: Model) -> None:
    """Show the displacements per dilation, contraction and cycle, and the plateau velocity."""
    pull = model.scaled(model.pull(1, here, after))
    gap = p.show(
        "a sliding slider's tensions are constant, so dx_{n+1} - dx_n = l0 dtheta for every "
        "spring, as its upper slider feels it: l0 times",
        -sp.diff(pull, theta) / sp.diff(pull, after) / l0,
        1,
    )
    pull = model.scaled(model.pull(-1, after, here))
    p.show(
        "... and as its lower one does",
        -sp.diff(pull, theta) / sp.diff(pull, after) / l0,
        1,
    )

    def moved(resting: Expression, change: Expression) -> Expression:
        """Return how far slider n moves while one rests: the sum over the springs between."""
        return sp.factor(sp.summation(gap * l0 * change, (spring, resting, n - 1)))

    up = p.show(
        "dilation, slider i-1 rests: slider n moves by",
        moved(i - 1, rise),
        (n - (i - 1)) * l0 * rise,
        "dilation",
    )
    p.entry("dilation_displacement", {"Delta_x": at({n: up})}, lines=2)
    down = p.show(
        "contraction, slider j+1 rests: by",
        moved(j + 1, fall),
        (n - (j + 1)) * l0 * fall,
        "contraction",
    )
    p.entry("contraction_displacement", {"Delta_x": at({n: down})}, lines=3)
    turns = {rise: model.swing, fall: -model.swing}
    p.alone("cycle_jumps", turns)
    both = (up + down).subs(turns).subs(j, pivots.derive(model).partner)
    cycle = p.show(
        "a cycle, with the pivots' j = N + 1 - i: by, whatever n,",
        sp.factor(sp.expand(both)),
        2 * (N + 3 - 2 * i) * l0 * amplitude,
        "cycle",
    )
    p.entry("cycle_displacement", {"Delta_x": at({n: cycle})}, lines=4)
    downhill = sp.expand(cycle.subs(i, (N + 2) / 2))
    p.alone("position_decreases", holds=downhill.is_positive)
    velocity = p.show(
        "in the time 2 tau_th: tau_th v =",
        cycle / 2,
        (N + 3 - 2 * i) * l0 * amplitude,
        "velocity",
    )
    last = p.show("zero at i =", solved(velocity, i), (N + 3) / 2)

    def range_of_pivots(formula: Formula) -> bool:
        return formula.relations == ("<", "<") and formula.sides == (1, i, last)

    p.entry("plateau_range", range_of_pivots)
    edge = pivots.derive(model).sliding_edge
    steps = cycle / (2 * l0 * amplitude)
    p.show(
        "N + 3 - 2i exceeds N tan(alpha)/mu_d at the pivot's lower edge by",
        sp.expand(steps - N * edge / mu_d),
        1,
    )
    p.show(
        "... and at its upper edge by",
        sp.expand(steps - N * edge.subs(i, i - 1) / mu_d),
        -1,
    )
    sliding = thresholds.derive(model).sliding
    finite = p.show(
        "of a half-cycle's 2A only what exceeds 2A* moves the whole chain: tau_th v =",
        velocity.subs(amplitude, amplitude - sliding),
        (N + 3 - 2 * i) * (l0 * amplitude - N * slope_margin / 2),
        "finite",
    )
    law, plain = creeps(finite), follows(creeps(velocity))
    limit = leading(law, amplitude)
    p.entry("vitesse", lambda formula: plain(formula) and limit(formula), law)
    p.alone("critical_velocity", holds=vanishes(finite.subs(amplitude, sliding)))
