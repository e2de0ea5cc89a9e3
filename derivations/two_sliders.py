"""Two sliders: every slip, the staircase of the velocity, its thresholds and its phase mean."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise
from math import ceil, floor
from random import Random

import sympy as sp

from derivations import slip
from derivations.chain import RationalChain, play_variation
from derivations.entry import Backed, Backing, Lines, entries_of, stands
from derivations.judges import Judge, follows, inequality, leading
from derivations.model import Model, T, after, before, here, mu, place, solved
from derivations.notation import (
    Expression,
    Formula,
    amplitude,
    c,
    excess,
    f,
    l0,
    mu_d,
    mu_s,
    s,
    sigma_mu,
    slope_margin,
    static_margin,
    symbol,
)
from derivations.proof import Proof, chapter

tau_th, y, r, tan = (symbol(name) for name in ["tau_th", "y", "r", "t"])
jump = sp.Symbol("jump", positive=True)
room = l0 * amplitude


def forces(model: Model) -> tuple[Expression, Expression]:
    """Return the non-frictional forces on the two sliders in the tension of their spring."""
    return model.force(1).subs(T(0), model.end(0)), model.force(2).subs(T(2), model.end(1))


@chapter(
    "Two sliders",
    "0 < tan(alpha) < mu_d <= mu_s",
    "one mu_s where slips are counted",
    "slips are those of chapter slip",
)
def derive(p: Proof, model: Model) -> None:
    """Show the order of slips, the plateau's ends, the staircase and its mean."""
    first, last = forces(model)
    mirror = {before: -after, after: -before, here: -here}
    p.show(
        "the mirror image of a level chain: the force on slider 1 becomes minus that on 2",
        model.at("first").subs(s, 0).subs(mirror, simultaneous=True),
        -model.at("last").subs(s, 0),
        "mirror",
    )
    p.show(
        "... and friction turns round with the velocity",
        model.friction(-1),
        -model.friction(1),
        "odd",
    )
    p.argued(
        "so the mean velocity of a level chain is its own negative",
        "the mirror image of the chain is a chain with the same law of disorder",
        "level",
    )

    start = p.show(
        "dilation: slider 2 starts downhill, F_2 = mu_s c, at the tension",
        solved(last - model.threshold(), T(1)),
        -static_margin,
        "start",
    )
    p.show(
        "slider 1 would start uphill, F_1 = -mu_s c, only 2 s below",
        start - solved(first + model.threshold(), T(1)),
        2 * s,
    )
    move = slip.derive(model).end_move
    left = start + move
    p.show(
        "the slip of slider 2 by 2D leaves slider 1 the margin mu_s c - F_1 =",
        model.threshold() - first.subs(T(1), left),
        2 * slope_margin,
        "stays",
    )
    p.show("... and mu_s c + F_1 =", model.threshold() + first.subs(T(1), left), 2 * s + 2 * excess)
    here_2 = solved(last - model.threshold(mu(2)), T(1))
    here_1 = solved(first + model.threshold(mu(1)), T(1))
    ordering = p.show(
        "different coefficients: slider 2 is first if tan(alpha) exceeds",
        solved((here_2 - here_1).subs(s, c * tan), tan),
        (mu(2) - mu(1)) / 2,
        "ordering",
    )
    margin = model.threshold(mu(1)) - first.subs(T(1), here_2 + move.subs(mu_s, mu(2)))
    stability = p.show(
        "... and slider 1 stays after the slip if tan(alpha) is below",
        solved(margin.subs(s, c * tan), tan),
        mu_d + (mu(1) - mu(2)) / 2,
        "stability",
    )

    def width(edge: Expression) -> Expression:
        return sigma_mu * sp.sqrt(sp.diff(edge, mu(1)) ** 2 + sp.diff(edge, mu(2)) ** 2)

    p.show(
        "independent draws of width sigma_mu: standard deviation of the first",
        width(ordering),
        sigma_mu / sp.sqrt(2),
        "alpha_c_minus",
    )
    p.show(
        "one standard deviation below the second's mean",
        stability.subs({mu(1): mu_s, mu(2): mu_s}) - width(stability),
        mu_d - sigma_mu / sp.sqrt(2),
        "alpha_c_plus",
    )

    down_1 = solved(first - model.threshold(), T(1))
    rho = r + move / 2
    p.show(
        "r = x_2 - x_1 - l0, y = l0 theta, T = r - y: slider 2 slips, r -> r + 2D, at y =",
        r - start,
        rho + slope_margin,
        "up",
    )
    p.show(
        "... and slider 1 slips back, r + 2D -> r, at y =",
        r + move - down_1,
        rho - slope_margin,
        "down",
    )
    p.show("either slip moves the centre of mass downhill by D", move / 2, excess, "advance")
    p.proved(
        "staircase: r stays in r_0 + 2D Z, and x_G moves by D whenever y passes rho + m upwards or "
        "rho - m downwards, in turns, for a rho = r + D of these",
        lambda: (
            not any(line.fault for line in (p.named[x] for x in ("up", "down", "advance", "stays")))
        ),
        "induction over the slips: each leads from one r to the next by the lines above, and "
        "between slips nothing moves",
        "staircase",
    )
    reach = p.show(
        "cycles pass it twice iff -L < rho - m and rho + m < L = l0 A: |rho| below",
        room - (r - start - rho),
        room - slope_margin,
        "reach",
    )
    p.show(
        "relaxed chain, r_0 = 0, rho = +-D, +-3D, ...: it creeps above A* =",
        solved(reach - move / 2, amplitude),
        static_margin / l0,
        "threshold",
    )
    at = sp.Symbol("rho", real=True)
    velocity = p.show(
        "mean over r_0, one rho in 2D, each moves x_G by D a half-cycle: tau_th v =",
        sp.integrate(move / 2 / move, (at, -reach, reach)),
        room - slope_margin,
        "velocity",
    )
    p.show("towards alpha_c it tends to", sp.limit(velocity, s, mu_d * c), room, "steep")
    p.show(
        "so a half-cycle that reverses the last moves one slider, on average, by",
        2 * velocity.subs(amplitude, jump / 2),
        l0 * jump - 2 * slope_margin,
    )
    p.show(
        "the paper's least dilation 2a is that between tensions at which both start; the last "
        "slip goes beyond by up to 2D, D on average, at either end: the mean is",
        l0 * jump - ((down_1 - move / 2) - (start + move / 2)),
        l0 * jump - 2 * slope_margin,
        "half",
    )
    p.checked(
        "the velocity is that count, for any r_0, and the ceiling formula for r_0 = 0",
        _staircases,
        "100 rational chains, every slip followed; r_0 is conserved in all",
    )
    p.checked(
        "along any path x_G moves by half the truncated variation on average over r_0",
        _paths,
        "20 random paths: every slip of one r_0, and the exact integral over rho",
    )


def staircase(
    slope: Fraction, low: Fraction, high: Fraction, reach: Fraction, r0: Fraction
) -> Fraction:
    """Return the velocity by counting the rho; lengths in units of cos(alpha)."""
    step = high - low
    inside = reach - (low - slope)
    if inside <= 0:
        return Fraction(0)
    # rho = r0 + D + 2 D k strictly inside
    first = floor((-inside - r0 - step) / (2 * step)) + 1
    last = ceil((inside - r0 - step) / (2 * step)) - 1
    return step * max(0, last - first + 1)


def pair(slope: Fraction, low: Fraction, high: Fraction, r0: Fraction) -> RationalChain:
    """Return two sliders whose distance is r0 longer than the relaxed spring."""
    return RationalChain(2, slope, low, high, [slope + r0, slope - r0])


def cases(number: int, seed: int) -> list[tuple[Fraction, Fraction, Fraction, Fraction, Fraction]]:
    """Return rational (slope, mu_d, mu_s, l0 A, r0) with 0 < slope < mu_d < mu_s."""
    random = Random(seed)
    cases = []
    for _ in range(number):
        low = Fraction(random.randint(2, 40), 20)
        slope = low * Fraction(random.randint(1, 19), 20)
        high = low + Fraction(random.randint(1, 30), random.choice((10, 20, 37)))
        reach = Fraction(random.randint(1, 400), random.choice((20, 33, 40)))
        r0 = (high - low) * Fraction(random.randint(-20, 20), 20)
        cases.append((slope, low, high, reach, r0))
    return cases


def velocity_agrees(
    slope: Fraction, low: Fraction, high: Fraction, reach: Fraction, r0: Fraction
) -> bool:
    """Return whether two sliders that slip creep as the staircase says, and conserve r0."""
    chain, step = pair(slope, low, high, r0), high - low
    for target in (reach, -reach):
        chain.to(target)
    start = sum(chain.x)
    for target in (reach, -reach) * 2:
        chain.to(target)
    relaxed = 2 * step * max(0, ceil((reach - (high - slope)) / (2 * step)))
    return (
        (sum(chain.x) - start) / 8 == staircase(slope, low, high, reach, r0)
        and (chain.x[1] - chain.x[0]) % (2 * step) == 0
        and staircase(slope, low, high, reach, Fraction(0)) == relaxed
    )


def _staircases() -> bool:
    return all(velocity_agrees(*case) for case in cases(100, 2011))


def _switchings(path: list[Fraction], rho: Fraction, half: Fraction, up: bool) -> int:
    """Return how often a path passes rho + half upwards and rho - half downwards, in turns."""
    count = 0
    for target in path:
        if (not up and target > rho + half) or (up and target < rho - half):
            up, count = not up, count + 1
    return count


def _paths() -> bool:
    random = Random(5)
    for slope, low, high, _, r0 in cases(20, 9):
        path = [Fraction(random.randint(-300, 300), 40) for _ in range(12)]
        step, half = high - low, low - slope
        r0 *= Fraction(19, 20)
        chain, reach = pair(slope, low, high, r0), int(Fraction(10) / step) + 4
        for target in path:
            chain.to(target)
        moved = sum(
            step * _switchings(path, r0 + step + 2 * step * index, half, index < 0)
            for index in range(-reach, reach)
        )
        ends = sorted({Fraction(0), *(at + half for at in path), *(at - half for at in path)})
        integral = sum(
            (b - a) * _switchings(path, (a + b) / 2, half, (a + b) / 2 < 0)
            for a, b in pairwise(ends)
        )
        _, rise, fall = play_variation(path, 2 * half, Fraction(0))
        if sum(chain.x) / 2 != moved or integral != rise + fall:
            return False
    return True


def _starts(r: Lines, way: int, slider: int) -> Judge:
    """Judge a start condition in the force of the spring, f(1, 2) = -f(2, 1)."""
    pulls = {(1, 2): f(1, 2), (2, 1): -f(1, 2)}
    weight = r.model.ends[slider - 1] - sp.diff(r.model.gravity, place)
    force = way * (pulls[3 - slider, slider] + weight)
    held = r.model.held.subs(mu_s, mu(slider))
    margin = force - held if slider == 2 else held - force
    return inequality({"f": lambda a, b: pulls.get((a, b), f(a, b + 9))}, margin)


def _steps(r: Lines, *ways: int) -> Judge:
    """Judge the step of the centre of mass when slider 2 (dilation) or 1 (contraction) moves."""
    exact, moving = r.half, symbol("moving")

    def judge(formula: Formula) -> bool:
        for way in ways:
            bound = formula.bound(
                {
                    symbol("Delta_x_G"): moving / 2,
                    "Delta_x": lambda index, way=way: moving if index == (3 + way) // 2 else 0,
                    symbol("Delta_theta"): way * jump,
                }
            )
            sides = tuple(sp.sympify(side).subs(moving, exact) for side in bound.sides)
            if not leading({}, jump)(Formula(sides, bound.relations)):
                return False
        return True

    return judge


def _half(r: Lines) -> Judge:
    return follows({symbol("Delta_x_G"): r.half / 2, symbol("Delta_theta"): jump})


def _velocity(r: Lines) -> dict[object, object]:
    return {symbol("v_G"): r.velocity / tau_th}


LINES: dict[str, Backed | None] = {
    "divergence": lambda r: stands(r.steep),
    "horizontal": lambda r: Backing(
        follows({symbol("v_G"): 0}), evidence=stands(r.mirror, r.odd, r.level)
    ),
    "dilation_step": lambda r: Backing(_steps(r, 1), _half(r)),
    "contraction_step": lambda r: _steps(r, -1),
    "step": lambda r: _steps(r, 1, -1),
    "half_cycle_step": lambda r: leading(
        {symbol("Delta_x_G"): r.half.subs(jump, r.model.swing) / 2}, amplitude
    ),
    "velocity_th_2_cycle": lambda r: Backing(
        leading(_velocity(r), amplitude), follows(_velocity(r))
    ),
    "lower_slider_starts": lambda r: _starts(r, 1, 2),
    "upper_slider_stays": lambda r: _starts(r, -1, 1),
    "ordering": lambda r: inequality({}, s / c - r.ordering),
    "alpha_c_minus": lambda r: follows({sp.tan(symbol("alpha_c_minus")): r.alpha_c_minus}),
    "slip_starts": lambda r: _starts(r, 1, 2),
    "upper_slider_after_slip": lambda r: _starts(r, 1, 1),
    "stability_after_slip": lambda r: inequality({}, r.stability - s / c),
    "alpha_c_plus": lambda r: follows({sp.tan(symbol("alpha_c_plus")): r.alpha_c_plus}),
    "reversal_step": _half,
    "velocity_th_2_cycle_corrected": lambda r: follows(_velocity(r)),
    "threshold_th_2_cycle_corrected": lambda r: follows({symbol("A_theta_star"): r.threshold}),
    "rest_below_threshold": lambda r: stands(r.start, r.threshold),
}
ENTRIES = entries_of("two_sliders", derive, LINES)
