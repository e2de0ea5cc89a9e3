"""That a cycle of large amplitude advances the chain by (N + 3 - 2i) l0 A in a half-cycle."""

from __future__ import annotations

import sympy as sp

from derivations.notation import (
    Expression,
    Formula,
    N,
    amplitude,
    i,
    j,
    l0,
    n,
    slope_margin,
    symbol,
)
from derivations.proof import (
    Derivation,
    Entry,
    Results,
    Step,
    Verification,
    follows,
    leading,
    vanishes,
)

rise, fall = symbol("Delta_theta_plus"), symbol("Delta_theta_minus")
tau_th = symbol("tau_th")


def displacement(resting: Expression, change: Expression) -> Expression:
    """Return the displacement of slider n while theta changes and one slider rests.

    Sliding sliders have constant tensions, so ``dx_{n+1} - dx_n = l0 dtheta`` for every spring.
    """
    y = sp.Function("y")
    k = sp.Symbol("k", integer=True)
    solution = sp.rsolve(y(k + 1) - y(k) - l0 * change, y(k))
    constant = next(free for free in solution.free_symbols if str(free).startswith("C"))
    value = sp.solve(solution.subs(k, resting), constant)[0]
    return sp.factor(solution.subs(constant, value).subs(k, n))


def derive() -> Derivation:
    """Return displacements per dilation, contraction and cycle, and the plateau velocity."""
    up, down = displacement(i - 1, rise), displacement(j + 1, fall)
    total = sp.factor(
        sp.expand((up + down).subs({rise: 2 * amplitude, fall: -2 * amplitude, j: N + 1 - i}))
    )
    velocity = sp.factor(total / (2 * tau_th))
    results = {
        "dilation": up,
        "contraction": down,
        "cycle": total,
        "velocity": velocity,
        "last": sp.solve(velocity, i)[0],
        "finite": (N + 3 - 2 * i) * (l0 * amplitude - N * slope_margin / 2),
    }
    steps = (
        Step(
            "sliding sliders carry constant tensions: dx_{n+1} - dx_n = l0 dtheta; slider i - 1 "
            "rests",
            up,
        ),
        Step("contraction: slider j + 1 rests", down),
        Step("a cycle +2A, -2A with j = N + 1 - i, the same for all n", total),
        Step("divided by 2 tau_th", velocity),
        Step("positive for i below", results["last"]),
    )
    return Derivation(
        "Plateau velocities",
        steps,
        results,
        ("large amplitude: all sliders but the pivot move during the whole half-cycle",),
    )


def check(v: Verification, r: Results) -> None:
    """Prove the displacements and the plateau velocity for symbolic N, i and n."""
    v.identity("dilation: [n - (i - 1)] l0 dtheta", r["dilation"] - (n - (i - 1)) * l0 * rise)
    v.identity("the pivot rests", r["dilation"].subs(n, i - 1))
    v.identity("springs follow theta", r["dilation"].subs(n, n + 1) - r["dilation"] - l0 * rise)
    v.identity("contraction: [n - (j + 1)] l0 dtheta", r["contraction"] - (n - (j + 1)) * l0 * fall)
    v.identity("the cycle's displacement does not depend on n", sp.diff(r["cycle"], n))
    v.identity("Eq. (vitesse)", r["velocity"] * tau_th - (N + 3 - 2 * i) * l0 * amplitude)
    v.identity("creep downhill for i < (N + 3)/2", r["last"] - (N + 3) / 2)
    v.identity(
        "N + 3 - 2i is within 1 of N tan(alpha)/mu_d",
        sp.Abs(sp.cancel(r["cycle"] / (2 * l0 * amplitude)) - (N - 2 * i + 2) - 1)
        + sp.Abs((N - 2 * i + 4) - sp.cancel(r["cycle"] / (2 * l0 * amplitude)) - 1),
        "the pivot's window in the sliding limit is N - 2i + 2 < N tan(alpha)/mu_d < N - 2i + 4",
    )


def _sign_range(formula: Formula) -> bool:
    """Judge `1 < i < (N+3)/2`: slider i - 1 exists, and the velocity is positive."""
    return (
        formula.relations == ("<", "<")
        and formula.sides[1] == i
        and formula.sides[0] == 1
        and vanishes(formula.sides[2] - derive().results["last"])
    )


_R = derive().results


def _moving(expression: Expression) -> dict[object, object]:
    return {"Delta_x": lambda index: expression if index == n else sp.Symbol("elsewhere")}


ENTRIES: tuple[Entry, ...] = (
    Entry(
        "dilation_displacement",
        "Sec. III B 2",
        r"$\Delta\tilde{x}_\mathrm{n} = [ n - ( i - 1 ) ]\,\tilde{l}_0  \Delta\theta^+$",
        "exact",
        "plateaus: constant tensions of sliding sliders",
        assumptions=("all sliders but the pivot move all the time",),
        holds=follows(_moving(_R["dilation"])),
    ),
    Entry(
        "contraction_displacement",
        "Sec. III B 2",
        r"$\Delta\tilde{x}_\mathrm{n} = [ n - ( j + 1 ) ]\,\tilde{l}_0  \Delta\theta^-$",
        "exact",
        "plateaus: constant tensions of sliding sliders",
        assumptions=("all sliders but the pivot move all the time",),
        holds=follows(_moving(_R["contraction"])),
    ),
    Entry(
        "cycle_jumps",
        "Sec. III B 2",
        r"$\Delta \theta^+ = - \Delta \theta^- = 2 A_\theta$",
        "exact",
        "a cycle runs from -A to +A and back",
        holds=follows({rise: amplitude - (-amplitude), fall: -amplitude - amplitude}),
    ),
    Entry(
        "cycle_displacement",
        "Sec. III B 2",
        r"$\Delta\tilde{x}_\mathrm{n} = 2 (N + 3 - 2 i) \tilde{l}_0 A_\theta$",
        "exact",
        "plateaus: sum of a dilation and a contraction with j = N + 1 - i",
        assumptions=("large amplitude",),
        holds=follows(_moving(_R["cycle"])),
    ),
    Entry(
        "vitesse",
        "Sec. III B 2",
        r"\tau_\mathrm{th} v_\mathrm{N,i}^* =  ( N + 3 - 2 i )\,\tilde{l}_0  A_\theta.",
        "approximation",
        "plateaus; its limit of large amplitude is that of the exact law of the sliding limit",
        label="vitesse",
        assumptions=("l0 A >> N m/2", "slider i - 1 is the pivot"),
        corrected=r"\tau_\mathrm{th} v_\mathrm{N,i}^* = ( N + 3 - 2 i )\,\tilde{l}_0 \Bigl[ "
        r"A_\theta - "
        r"\frac{N}{2\tilde{l}_0} (\mu_\mathrm{d} \cos \alpha - \sin \alpha) \Bigr], not below 0",
        corrected_formula=r"\tau_\mathrm{th} v_\mathrm{N,i}^* = ( N + 3 - 2 i )\,\tilde{l}_0 "
        r"\Bigl[ A_\theta - "
        r"\frac{N}{2\tilde{l}_0} (\mu_\mathrm{d} \cos \alpha - \sin \alpha) \Bigr]",
        error="relative -N m/(2 l0 A)",
        formula=r"\tau_\mathrm{th} v_\mathrm{N,i}^* =  ( N + 3 - 2 i )\,\tilde{l}_0  A_\theta",
        holds=leading(
            {"v_N_star": lambda index: (_R["finite"] / tau_th).subs(i, index)}, amplitude
        ),
        holds_exactly=follows({"v_N_star": lambda index: (_R["finite"] / tau_th).subs(i, index)}),
    ),
    Entry(
        "plateau_range",
        "Sec. III B 2",
        r"$1 < i < (N+3)/2$",
        "exact",
        "plateaus: the pivot i - 1 of the dilation is a slider, and the velocity is positive",
        holds=_sign_range,
    ),
)
