"""That a cycle of large amplitude advances the chain by (N + 3 - 2i) l0 A in a half-cycle."""

from __future__ import annotations

import sympy as sp

from derivations import pivots, thresholds
from derivations.judges import both, follows, leading
from derivations.model import Model, after, here, solved
from derivations.notation import (
    CAPTIONS,
    Expression,
    Formula,
    N,
    amplitude,
    at,
    brief,
    creeps,
    i,
    j,
    l0,
    mu_d,
    n,
    positive_part,
    slope_margin,
    symbol,
    theta,
)
from derivations.proof import Proof, chapter

room = l0 * amplitude
rise, fall = symbol("Delta_theta_plus"), symbol("Delta_theta_minus")
spring = sp.Symbol("spring", integer=True)


@chapter(
    "Plateau velocities",
    "large amplitude: all sliders but the pivot move",
    "continuous sliding",
    "slider i - 1 is the pivot",
)
def derive(p: Proof, model: Model) -> None:
    """Show the displacements per dilation, contraction and cycle, and the plateau velocity."""
    pull = model.scaled(model.pull(1, here, after))
    gap = p.show(
        "a sliding slider's tensions are constant, so the places of neighbours part by l0 dtheta "
        "for every spring, as its upper slider feels it: l0 times",
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

    resting, resting_below = i - 1, j + 1
    up = p.show(
        f"dilation, slider {resting} rests: slider n moves by",
        moved(resting, rise),
        (n - (i - 1)) * l0 * rise,
        "dilation",
    )
    p.entry("dilation_displacement", {"Delta_x": at({n: up})}, lines=2)
    down = p.show(
        f"contraction, slider {resting_below} rests: by",
        moved(resting_below, fall),
        (n - (j + 1)) * l0 * fall,
        "contraction",
    )
    p.entry("contraction_displacement", {"Delta_x": at({n: down})}, lines=3)
    turns = {rise: model.swing, fall: -model.swing}
    p.alone("cycle_jumps", turns)
    partner = pivots.derive(model).partner
    gained = (up + down).subs(turns).subs(j, partner)
    cycle = p.show(
        f"a cycle, with the pivots' j = {partner}: by, whatever n,",
        sp.factor(sp.expand(gained)),
        2 * (N + 3 - 2 * i) * l0 * amplitude,
        "cycle",
    )
    p.entry("cycle_displacement", {"Delta_x": at({n: cycle})}, lines=4)
    downhill = p.show(
        "downhill even on the lowest plateau, i halfway between that and the next value,",
        sp.expand(cycle.subs(i, (N + 2) / 2)),
        2 * l0 * amplitude,
    )
    creeps_by = cycle.subs(amplitude, amplitude - thresholds.derive(model).sliding).subs(CAPTIONS)
    p.entry("position_decreases", holds=downhill.is_positive, cycle=creeps_by)
    velocity = p.show(
        "in the time of two half-cycles: tau_th v =",
        cycle / 2,
        (N + 3 - 2 * i) * l0 * amplitude,
        "velocity",
    )
    last = p.show("zero at i =", solved(velocity, i), (N + 3) / 2)

    def range_of_pivots(formula: Formula) -> bool:
        return formula.relations == ("<", "<") and formula.sides == (1, i, last)

    p.entry("plateau_range", range_of_pivots)
    half = sp.Symbol("half", integer=True, positive=True)
    even, odd = (sp.floor(last.subs(N, size)) for size in (2 * half, 2 * half + 1))
    p.show("so an even chain has as many plateaus as pairs of sliders,", even - 1, half)
    p.show("... an odd one no more", odd - sp.Integer(odd == last.subs(N, 2 * half + 1)) - 1, half)
    p.entry("number_of_plateaus", lines=2)
    p.show("towards alpha_c the last plateau has tau_th v =", velocity.subs(i, 2), (N - 1) * room)
    p.entry("divergence_of_chains", corrected=creeps(velocity.subs(i, 2)))
    edge = pivots.derive(model).sliding_edge
    steps = sp.cancel(cycle / (2 * l0 * amplitude))
    p.show(
        f"{steps} exceeds N tan(alpha) over mu_d at the pivot's lower edge by",
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
        f"only the excess of a half-cycle's swing over the swing of A* = {brief(sliding)} moves "
        "the whole chain: tau_th v =",
        velocity.subs(amplitude, amplitude - sliding),
        (N + 3 - 2 * i) * (l0 * amplitude - N * slope_margin / 2),
        "finite",
    )
    law, plain = creeps(finite), follows(creeps(velocity))
    limit = leading(law, amplitude)
    exact = creeps((N + 3 - 2 * i) * positive_part(finite / (N + 3 - 2 * i)))
    lacks = sp.cancel(finite / velocity) - 1
    p.entry("vitesse", both(plain, limit), exact, lacks=lacks)
    threshold = sliding.subs(CAPTIONS)
    p.show("at that amplitude the velocity is", finite.subs(amplitude, sliding), 0)
    p.entry("critical_velocity", threshold=threshold)
