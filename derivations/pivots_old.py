"""Pivots and critical angles: which slider rests while the chain dilates or contracts.

The centrepiece of the audit: Eq. (critical_angle), step by step for symbolic N and i, for dilation
and for contraction, with the window of slopes in which two neighbours can both be the pivot.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from random import Random

import sympy as sp

from derivations import slip_old as slip
from derivations.notation import Expression, Formula, N, alpha, c, i, j, mu_d, mu_s, s, symbol
from derivations.play import NotUnique, SlidingChain
from derivations.proof import (
    Derivation,
    Entry,
    Judge,
    Results,
    Step,
    Verification,
    follows,
    inequality,
    vanishes,
)

m, g = symbol("m"), symbol("g")
slope = symbol("t")
star = sp.Function("alpha_N_star")


def tension_above(slider: Expression, direction: int) -> Expression:
    """Return T_{slider-1} when all sliders above slide in one direction (+1: downhill).

    Sum of the force balances ``T_k - T_{k-1} + s - direction mu_d c = 0`` over k < slider; T_0 = 0.
    """
    k = sp.Symbol("k", integer=True, positive=True)
    return sp.expand(sp.summation(direction * mu_d * c - s, (k, 1, slider - 1)))


def tension_below(slider: Expression, direction: int) -> Expression:
    """Return T_slider when all sliders below slide in one direction; T_N = 0."""
    k = sp.Symbol("k", integer=True, positive=True)
    return sp.expand(-sp.summation(direction * mu_d * c - s, (k, slider + 1, N)))


def pivot_force(slider: Expression, dilates: bool) -> Expression:
    """Return the non-frictional force on the one slider that rests while all others slide."""
    below = 1 if dilates else -1
    return sp.expand(tension_below(slider, below) - tension_above(slider, -below) + s)


def edge(slider: Expression, dilates: bool, sign: int) -> Expression:
    """Return tan(alpha) at which the pivot starts downhill (sign +1) or uphill (-1)."""
    force = pivot_force(slider, dilates)
    balance = (force - sign * mu_s * c).subs(s, slope * c)
    return sp.expand(sp.solve(sp.expand(balance / c), slope)[0])


def critical(index: Expression) -> Expression:
    """Return tan(alpha*_{N,index}), above which slider `index` starts downhill in a dilation."""
    return edge(index, True, 1)


def derive() -> Derivation:
    """Return the critical angles of dilation and contraction and the window of bistable pivots."""
    dilation, contraction = pivot_force(i, True), pivot_force(j, False)
    partner = sp.solve(sp.expand(edge(j, False, 1) - critical(i)), j)[0]
    window = (edge(i - 1, True, -1), critical(i))
    results = {
        "critical": critical(i),
        "critical_contraction": edge(j, False, 1),
        "dilation": dilation,
        "contraction": contraction,
        "partner": partner,
        "window": window,
        "window_width": sp.expand(window[1] - window[0]),
        "avalanche": critical(sp.Integer(1)),
    }
    steps = (
        Step(
            "Dilation: sliders 1..i-1 move uphill, each T_k - T_{k-1} + s + mu_d c = 0; T_{i-1}",
            tension_above(i, -1),
        ),
        Step(
            "sliders i+1..N move downhill, each T_k - T_{k-1} + s - mu_d c = 0; T_i",
            tension_below(i, 1),
        ),
        Step("force on slider i: T_i - T_{i-1} + s", dilation),
        Step("it starts downhill when this exceeds mu_s c: tan(alpha) above", results["critical"]),
        Step("it starts uphill when this is below -mu_s c: tan(alpha) below", edge(i, True, -1)),
        Step(
            "Contraction: sliders 1..j-1 move downhill, j+1..N uphill; force on slider j",
            contraction,
        ),
        Step("it starts downhill for tan(alpha) above", results["critical_contraction"]),
        Step("the same slope as in the dilation if j is", partner),
        Step("slider i-1 rests for tan(alpha) above", edge(i - 1, True, -1)),
        Step("slider i rests up to", critical(i)),
        Step("so both can be the pivot in a window of width", results["window_width"]),
        Step("centred on", sp.expand((window[0] + window[1]) / 2)),
        Step("i = 1: not mu_d, but", results["avalanche"]),
    )
    return Derivation(
        "Pivots and critical angles",
        steps,
        results,
        (
            "large amplitude: all sliders but the pivot move",
            "no inertia",
            "moving sliders carry mu_d",
            "one value of mu_s",
        ),
    )


def check(v: Verification, r: Results) -> None:
    """Prove the critical angles and the window; verify which pivots are stable for N = 2..12."""
    printed = mu_d * (1 - 2 * (i - 1) / N) + (mu_s - mu_d) / N
    v.identity(
        "Eq. (critical_angle)",
        r["critical"] - printed,
        "force balance of slider i, N and i symbolic",
    )
    v.identity("slider N + 1 - i in a contraction has the same edge", r["partner"] - (N + 1 - i))
    v.identity(
        "a contraction of i is a dilation of N + 1 - i",
        r["contraction"].subs(j, i) - r["dilation"].subs(i, N + 1 - i),
        "force on the pivot",
    )
    v.identity(
        "edges of neighbours are 2 mu_d/N apart",
        r["critical"].subs(i, i - 1) - r["critical"] - 2 * mu_d / N,
    )
    v.identity("the window is 2 (mu_s - mu_d)/N wide", r["window_width"] - 2 * (mu_s - mu_d) / N)
    v.identity(
        "the window is centred on mu_d (1 - 2(i-1)/N)",
        sum(r["window"]) / 2 - mu_d * (1 - 2 * (i - 1) / N),
    )
    v.identity("alpha*_{N,1} is mu_d + (mu_s - mu_d)/N", r["avalanche"] - mu_d - (mu_s - mu_d) / N)
    stable, cases = True, 0
    random = Random(3)
    bottom, top = _edges(-1), _edges(1)
    for size in range(2, 13):
        for _ in range(40):
            low = Fraction(random.randint(1, 60), 30)
            high = low + low * Fraction(random.randint(1, 30), 30)
            tan = low * Fraction(random.randint(1, 239), 240)
            resting = {k for k in range(1, size + 1) if abs(_force(size, k, tan, low)) <= high}
            named = {
                k
                for k in range(1, size + 1)
                if bottom(size, k, low, high) <= tan <= top(size, k, low, high)
            }
            stable &= resting == named and len(resting) >= 1
            cases += 1
    v.verified(
        "the sliders that can be the pivot are those in whose window the slope lies",
        stable,
        f"{cases} rational cases, N = 2..12, forces summed slider by slider",
    )
    agree, cases, ties = True, 0, 0
    for size in range(2, 13):
        for _ in range(12):
            low = Fraction(random.randint(1, 60), 30)
            tan = low * Fraction(random.randint(1, 119), 120)
            chain = SlidingChain(size, tan, low)
            try:
                chain.ramp(4 * size * low)
                dilated = chain.pivot
                chain.ramp(-4 * size * low)
            except NotUnique:
                ties += 1
                agree &= (size * tan / low - size) % 2 == 0
                continue
            index = dilated + 1
            agree &= (
                low * (1 - Fraction(2 * (index - 1), size))
                < tan
                < low * (1 - Fraction(2 * (index - 2), size))
            )
            agree &= chain.pivot == size + 2 - index
            cases += 1
    v.verified(
        "the sliding chain takes the pivot i - 1 (dilation) and N + 2 - i (contraction)",
        agree,
        f"{cases} rational cases, N = 2..12, and {ties} ties, all at the edges",
    )


def _force(size: int, pivot: int, tan: Fraction, low: Fraction) -> Fraction:
    """Return the force on the pivot of a dilation over cos(alpha), by adding sliders up."""
    above = sum((-low - tan for _ in range(1, pivot)), Fraction(0))
    below = -sum((low - tan for _ in range(pivot + 1, size + 1)), Fraction(0))
    return below - above + tan


def _edges(sign: int) -> Callable[[int, int, Fraction, Fraction], Fraction]:
    """Return an edge as a function of rationals (N, slider, mu_d, mu_s), exactly."""
    evaluate = sp.lambdify((N, i, mu_d, mu_s), sp.together(edge(i, True, sign)), modules=[{}])
    return lambda size, slider, low, high: Fraction(evaluate(size, slider, low, high))


def _balance(slider: Expression, dilates: bool) -> dict[object, object]:
    """Return what the forces exerted by the pivot are, from the sums over the sliders."""
    below = 1 if dilates else -1

    def force(exerting: Expression, on: Expression) -> Expression:
        if exerting == slider and sp.expand(on - slider) == -1:
            return m * g * tension_above(slider, -below)
        if exerting == slider and sp.expand(on - slider) == 1:
            return -m * g * tension_below(slider, below)
        return sp.Symbol("elsewhere")

    return {"f": force}


def _stability() -> Judge:
    """Return a judge of the pivot's stability condition: |F_i| < mu_s m g c."""
    T_above, T_here = sp.symbols("T_above T_here", real=True)

    def force(exerting: Expression, on: Expression) -> Expression:
        if on == i and sp.expand(exerting - i) == -1:
            return -m * g * T_above
        if on == i and sp.expand(exerting - i) == 1:
            return m * g * T_here
        return sp.Symbol("elsewhere")

    total = abs(sp.expand(m * g * (T_here - T_above + s)))
    return inequality({"f": force}, mu_s * m * g * c - total)


def _range(formula: Formula) -> bool:
    """Judge the range of slopes in which slider i - 1 is the pivot and slider i is not."""
    if formula.relations != ("<", "<") or formula.sides[1] != alpha:
        return False
    low, high = formula.sides[0], formula.sides[2]
    if low.func != star or high.func != star:
        return False
    lowest, highest = critical(low.args[0]), critical(high.args[0])
    return (
        vanishes(lowest - critical(i))
        and vanishes(highest - critical(i - 1))
        and vanishes(highest - lowest - 2 * mu_d / N)
    )


def _always_stops() -> bool:
    """Return whether a driven slider's velocity vanishes at a finite time at every rate."""
    driven = slip.derive().results
    rates = [sp.Rational(1, 9), sp.Integer(1), sp.Integer(10**6)]
    at_rate = {slip.V: slip.V, mu_s: mu_d + 1, c: 1}
    velocity, stop = (driven[name].subs(at_rate) for name in ("driven_velocity", "driven_stop"))
    return all(
        vanishes(sp.simplify(velocity.subs(slip.t, stop).subs(slip.V, rate)))
        and stop.subs(slip.V, rate) < 2 * sp.pi
        for rate in rates
    )


ENTRIES: tuple[Entry, ...] = (
    Entry(
        "friction_difference",
        "Sec. III B 2",
        r"$\Delta\mu \equiv \mu_\mathrm{s} - \mu_\mathrm{d}$",
        "convention",
        "definition",
        holds=lambda formula: (
            formula.relations == ("=",)
            and formula.left == symbol("Delta_mu")
            and vanishes(formula.bound({}).right - (mu_s - mu_d))
        ),
    ),
    Entry(
        "dilation_rate",
        "Sec. III B 2",
        r"$\dot \theta \gg \Delta\mu / \tilde{l}_0 \tau_\mathrm{dyn}$",
        "inconsistent",
        "slip: an end slider that is driven at the velocity V moves at V (1 - cos t) + D sin t, "
        "which vanishes after 2 (pi - atan(D/V)) tau_dyn, whatever V",
        corrected="at no rate does a slider slide continuously; the balance with mu_d holds on "
        "average over slips, exactly in the limit mu_s -> mu_d",
        error="no rate is large enough: the slider stops once per slip of about 2 pi tau_dyn, and "
        "is at rest for a share D/(pi V) of time. A large rate contradicts, too, the model's own "
        "separation of time scales (theta frozen in a rearrangement)",
        assumptions=("the neighbour rests or moves at a constant velocity",),
        evidence=_always_stops,
    ),
    Entry(
        "balance_above",
        "Sec. III B 2",
        r"&f_{i\to i-1} + (i-1) &(m g \sin \alpha + \mu_\mathrm{d} m g \cos \alpha) = 0",
        "exact",
        "pivots: sum of the balances of sliders 1..i-1, all sliding uphill",
        assumptions=("continuous sliding", "no inertia"),
        holds=follows(_balance(i, True)),
    ),
    Entry(
        "balance_below",
        "Sec. III B 2",
        r"&f_{i\to i+1} + (N-i) &(m g \sin \alpha - \mu_\mathrm{d} m g \cos \alpha) = 0",
        "exact",
        "pivots: sum of the balances of sliders i+1..N, all sliding downhill",
        assumptions=("continuous sliding", "no inertia"),
        holds=follows(_balance(i, True)),
    ),
    Entry(
        "pivot_stability",
        "Sec. III B 2",
        r"| f_{i-1\to i} + f_{i+1\to i} + m g \sin \alpha | < \mu_\mathrm{d} m g \cos \alpha",
        "misprint",
        "pivots: a slider at rest is held by static friction, Eq. (static_friction); Eq. "
        "(critical_angle) follows "
        "from mu_s, not from mu_d",
        corrected=r"| f_{i-1\to i} + f_{i+1\to i} + m g \sin \alpha | < \mu_\mathrm{s} m g \cos "
        r"\alpha",
        corrected_formula=r"| f_{i-1\to i} + f_{i+1\to i} + m g \sin \alpha | < \mu_\mathrm{s} m "
        r"g \cos \alpha",
        error="friction coefficient of the wrong kind",
        holds=_stability(),
        repair=(r"\mu_\mathrm{d}", r"\mu_\mathrm{s}"),
    ),
    Entry(
        "critical_angle",
        "Sec. III B 2",
        r"\tan \alpha_{N,i}^* = \mu_\mathrm{d} \Bigl[ 1 - 2\,\frac{i-1}{N} \Bigr] + "
        r"\frac{\Delta\mu}{N}.",
        "exact",
        "pivots: slider i, resting in a dilation, starts downhill above this slope; N and i "
        "symbolic",
        label="critical_angle",
        assumptions=(
            "slider i is the pivot: for 2 (mu_s - mu_d)/N below this slope slider i - 1 can be it "
            "as well, and the "
            "chain's history and the disorder decide",
            "all other sliders slide",
            "one value of mu_s",
        ),
        error="upper edge of a window of bistable pivots; under disorder transitions are centred "
        "on the window's "
        "middle, mu_d (1 - 2(i-1)/N)",
        formula=r"\tan \alpha_{N,i}^* = \mu_\mathrm{d} \Bigl[ 1 - 2\,\frac{i-1}{N} \Bigr] + "
        r"\frac{\Delta\mu}{N}",
        holds=follows({sp.tan(star(i)): critical(i), symbol("Delta_mu"): mu_s - mu_d}),
    ),
    Entry(
        "critical_range",
        "Sec. III B 2",
        r"remains stable for $\alpha_\mathrm{N,i}^* < \alpha < \alpha_\mathrm{N,i-1}^*$",
        "exact",
        "pivots: slider i - 1 rests up to its own critical angle, which lies 2 mu_d/N in "
        "tan(alpha) above that of "
        "slider i",
        formula=r"\alpha_\mathrm{N,i}^* < \alpha < \alpha_\mathrm{N,i-1}^*",
        holds=_range,
    ),
    Entry(
        "balance_above_contraction",
        "Sec. III B 2",
        r"&f_{j\to j-1} + (j-1) &(m g \sin \alpha - \mu_\mathrm{d} m g \cos \alpha) = 0",
        "exact",
        "pivots: sliders 1..j-1 slide downhill in a contraction",
        holds=follows(_balance(j, False)),
    ),
    Entry(
        "balance_below_contraction",
        "Sec. III B 2",
        r"&f_{j\to j+1} + (N-j) &(m g \sin \alpha + \mu_\mathrm{d} m g \cos \alpha) = 0",
        "exact",
        "pivots: sliders j+1..N slide uphill in a contraction",
        holds=follows(_balance(j, False)),
    ),
    Entry(
        "contraction_partner",
        "Sec. III B 2",
        r"for $\alpha > \alpha_{N,i}^*$ the slider $j = N + 1 -i$ starts moving downwards",
        "exact",
        "pivots: the edge of slider j in a contraction equals that of slider i in a dilation for "
        "j = N + 1 - i",
        formula=r"j = N + 1 -i",
        holds=follows({j: derive().results["partner"]}),
    ),
    Entry(
        "first_critical_angle",
        "Sec. III B 2",
        r"(note that, for $i=1$, $\alpha_\mathrm{N,1}^*$ corresponds to the critical angle of "
        r"avalanche $\alpha_c$)",
        "misprint",
        "pivots: Eq. (critical_angle) at i = 1 is mu_d + (mu_s - mu_d)/N, above tan(alpha_c) = "
        "mu_d by (mu_s - mu_d)/N",
        corrected=r"\tan\alpha_{N,1}^* = \mu_\mathrm{d} + \frac{\Delta\mu}{N}",
        corrected_formula=r"\tan\alpha_{N,1}^* = \mu_\mathrm{d} + \frac{\Delta\mu}{N}",
        error="(mu_s - mu_d)/N; it vanishes only for N -> infinity or mu_s = mu_d",
        holds_exactly=follows(
            {sp.tan(star(1)): critical(sp.Integer(1)), symbol("Delta_mu"): mu_s - mu_d}
        ),
        evidence=lambda: (
            not vanishes(critical(sp.Integer(1)) - mu_d)
            and vanishes(sp.limit(critical(sp.Integer(1)), N, sp.oo) - mu_d)
        ),
    ),
)
