"""That a cycle of large amplitude advances the chain by (N + 3 - 2i) l0 A in a half-cycle."""

from __future__ import annotations

import sympy as sp

from derivations import pivots, thresholds
from derivations.entry import Backed, Backing, Lines, entries_of
from derivations.judges import Judge, follows, leading, vanishes
from derivations.model import Model, after, here, solved
from derivations.notation import (
    Expression,
    Formula,
    N,
    amplitude,
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

rise, fall, tau_th = (symbol(x) for x in ["Delta_theta_plus", "Delta_theta_minus", "tau_th"])


@chapter(
    "Plateau velocities",
    "large amplitude: all sliders but the pivot move during the whole half-cycle",
    "slider i - 1 is the pivot of a dilation",
)
def derive(p: Proof, model: Model) -> None:
    """Show the displacements per dilation, contraction and cycle, and the plateau velocity."""
    pulls = model.scaled(model.pull(1, here, after)), model.scaled(model.pull(-1, after, here))
    gaps = [-sp.diff(pull, theta) / sp.diff(pull, after) for pull in pulls]
    gap = p.show(
        "a sliding slider's tensions are constant, so dx_{n+1} - dx_n = l0 dtheta for every "
        "spring, as its upper slider feels it: l0 times",
        gaps[0] / l0,
        1,
        "upper",
    )
    p.show("... and as its lower one does", gaps[1] / l0, 1, "lower")

    def moved(resting: Expression, change: Expression) -> Expression:
        spring = sp.Symbol("spring", integer=True)
        return sp.factor(sp.summation(gap * l0 * change, (spring, resting, n - 1)))

    up = p.show(
        "dilation, slider i-1 rests: slider n moves by",
        moved(i - 1, rise),
        (n - (i - 1)) * l0 * rise,
        "dilation",
    )
    down = p.show(
        "contraction, slider j+1 rests: by",
        moved(j + 1, fall),
        (n - (j + 1)) * l0 * fall,
        "contraction",
    )
    cycle = (up + down).subs({rise: model.swing, fall: -model.swing})
    cycle = p.show(
        "a cycle, with the pivots' j = N + 1 - i: by, whatever n,",
        sp.factor(sp.expand(cycle.subs(j, pivots.derive(model).partner))),
        2 * (N + 3 - 2 * i) * l0 * amplitude,
        "cycle",
    )
    velocity = p.show(
        "in the time 2 tau_th: v =",
        sp.factor(cycle / (2 * tau_th)),
        (N + 3 - 2 * i) * l0 * amplitude / tau_th,
        "velocity",
    )
    p.show("zero at i =", solved(velocity, i), (N + 3) / 2, "last")
    edge = pivots.derive(model).sliding_edge
    steps = cycle / (2 * l0 * amplitude)
    p.show(
        "N + 3 - 2i exceeds N tan(alpha)/mu_d at the pivot's lower edge by",
        sp.expand(steps - N * edge / mu_d),
        1,
        "at_lower_edge",
    )
    p.show(
        "... and at its upper edge by",
        sp.expand(steps - N * edge.subs(i, i - 1) / mu_d),
        -1,
        "at_upper_edge",
    )
    sliding = thresholds.derive(model).sliding
    p.show(
        "of a half-cycle's 2A only what exceeds 2A* moves the whole chain: v tau_th =",
        velocity.subs(amplitude, amplitude - sliding) * tau_th,
        (N + 3 - 2 * i) * (l0 * amplitude - N * slope_margin / 2),
        "finite",
    )


def _moves(expression: Expression) -> Judge:
    elsewhere = sp.Symbol("elsewhere")
    return follows({"Delta_x": lambda index: expression if index == n else elsewhere})


def _positive(r: Lines) -> Judge:
    """Judge `1 < i < (N+3)/2`: slider i - 1 exists, and the velocity is positive."""
    last = r.last
    return lambda formula: (
        formula.relations == ("<", "<")
        and formula.sides[:2] == (1, i)
        and vanishes(formula.sides[2] - last)
    )


def _velocity(r: Lines) -> Backing:
    law, plateau = r.finite / tau_th, r.velocity
    finite = {"v_N_star": lambda index: law.subs(i, index)}

    def printed(formula: Formula) -> bool:
        plain = follows({"v_N_star": lambda index: plateau.subs(i, index)})
        return plain(formula) and leading(finite, amplitude)(formula)

    return Backing(printed, follows(finite))


LINES: dict[str, Backed | None] = {
    "dilation_displacement": lambda r: Backing(_moves(r.dilation), evidence=r.lower == 1),
    "contraction_displacement": lambda r: Backing(_moves(r.contraction), evidence=r.lower == 1),
    "cycle_jumps": lambda r: follows({rise: r.model.swing, fall: -r.model.swing}),
    "cycle_displacement": lambda r: Backing(_moves(r.cycle), evidence=r.lower == 1),
    "vitesse": _velocity,
    "plateau_range": _positive,
}
ENTRIES = entries_of("plateaus", derive, LINES)
