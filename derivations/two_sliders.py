"""Two sliders: every slip, the staircase of the velocity, its thresholds and its phase mean."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise
from math import ceil, floor
from random import Random

import sympy as sp

from derivations import scaling_old as scaling
from derivations import slip_old as slip
from derivations.notation import (
    Expression,
    Formula,
    amplitude,
    c,
    excess,
    l0,
    mu_d,
    mu_s,
    s,
    sigma_mu,
    slope_margin,
    static_margin,
    symbol,
    theta,
)
from derivations.play import TwoSliders, play_variation
from derivations.proof import (
    Derivation,
    Entry,
    Judge,
    Results,
    Step,
    Verification,
    follows,
    inequality,
    leading,
    vanishes,
)

m, g, tau_th = (symbol(name) for name in ["m", "g", "tau_th"])
tension = symbol("tension")
mu_1, mu_2 = sp.Function("mu_s")(1), sp.Function("mu_s")(2)
jump = sp.Symbol("jump", positive=True)
room = l0 * amplitude


def forces() -> tuple[Expression, Expression]:
    """Return the non-frictional forces on the two sliders, by the equations of motion.

    By the tension ``x_2 - x_1 - l0 (1 + theta)`` of the spring between them.
    """
    motion, natural = scaling.derive().results, l0 * (1 + theta)
    first = motion["force_first"].subs(scaling.after, scaling.here + natural + tension)
    last = motion["force_last"].subs(scaling.before, scaling.here - natural - tension)
    return sp.expand(first), sp.expand(last)


def derive() -> Derivation:
    """Return thresholds, the tension after a slip, the plateau's ends, and the mean velocity."""
    force_1, force_2 = forces()
    start_2 = sp.solve(force_2 - mu_s * c, tension)[0]
    start_1_up = sp.solve(force_1 + mu_s * c, tension)[0]
    start_1_down = sp.solve(force_1 - mu_s * c, tension)[0]
    after = start_2 + 2 * excess
    # different coefficients
    first_2 = sp.solve(force_2 - mu_2 * c, tension)[0]
    first_1 = sp.solve(force_1 + mu_1 * c, tension)[0]
    left = first_2 + 2 * (mu_2 - mu_d) * c
    lower = sp.solve((first_2 - first_1).subs(s, c * symbol("t")), symbol("t"))[0]
    upper = sp.solve((mu_1 * c - (left + s)).subs(s, c * symbol("t")), symbol("t"))[0]
    # mean displacement of a half-cycle: tension at its start and end uniform over one slip
    at_start, at_end = start_2 + excess, start_1_down - excess
    length = l0 * jump
    mean = sp.expand(length - (at_end - at_start))
    rho = sp.Symbol("rho", real=True)
    reach = room - slope_margin  # |rho| below it: relay rho switches twice per cycle
    velocity = sp.integrate(sp.Integer(1), (rho, -reach, reach)) / 2
    width = sp.sqrt(2 * (sigma_mu / 2) ** 2)
    results = {
        "start_2": start_2,
        "start_1_up": start_1_up,
        "start_1_down": start_1_down,
        "after": after,
        "ordering": lower,
        "stability": upper,
        "alpha_c_minus": width,
        "alpha_c_plus": upper.subs({mu_1: mu_s, mu_2: mu_s}) - width,
        "half_cycle": mean,
        "advance": slip.derive().results["end_displacement"] / 2,
        "velocity": sp.expand(velocity),
        "threshold": sp.solve(room - slope_margin - excess, amplitude)[0],
    }
    steps = (
        Step("Dilation: slider 2 starts downhill when -T + s = mu_s c, at the tension", start_2),
        Step("slider 1 would start uphill only when T + s = -mu_s c, at", start_1_up),
        Step("slider 2 is first, by 2s", sp.expand(start_2 - start_1_up)),
        Step("it moves by 2D (slip), which leaves the tension", after),
        Step("slider 1 then stays: mu_s c - (T + s) = 2m", sp.expand(mu_s * c - after - s)),
        Step("different coefficients: slider 2 is first if tan(alpha) exceeds", lower),
        Step("... and slider 1 stays after the slip if tan(alpha) is below", upper),
        Step("standard deviation of (mu_1 - mu_2)/2", width),
        Step("r = x_2 - x_1 - l0 changes by +-2D only: r0 = r mod 2D is conserved"),
        Step(
            "y = l0 theta: r -> r + 2D at y = r + a and back at y = r + 2D - a, so the relay at "
            "rho = r + D "
            "switches at rho + m and at rho - m; every switching moves x_G by D"
        ),
        Step("a cycle of amplitude A switches the relays with |rho| < l0 A - m, twice"),
        Step("relaxed chain: rho = +-D, +-3D, ...; it creeps if A exceeds", results["threshold"]),
        Step(
            "mean over r0: relays of density 1/(2D), each moving x_G by D per half-cycle",
            results["velocity"],
        ),
        Step("mean displacement of the moving slider in a half-cycle that reverses the last", mean),
    )
    return Derivation(
        "Two sliders",
        steps,
        results,
        (
            "0 < tan(alpha) < mu_d <= mu_s",
            "sigma_mu = 0 where slips are counted",
            "slips are those of slip.py",
        ),
    )


def staircase(
    slope: Fraction, low: Fraction, high: Fraction, reach: Fraction, r0: Fraction
) -> Fraction:
    """Return the velocity by counting relays; lengths in units of cos(alpha)."""
    step = high - low
    inside = reach - (low - slope)
    if inside <= 0:
        return Fraction(0)
    # rho = r0 + D + 2 D k strictly inside
    first = floor((-inside - r0 - step) / (2 * step)) + 1
    last = ceil((inside - r0 - step) / (2 * step)) - 1
    return step * max(0, last - first + 1)


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


def check(v: Verification, r: Results) -> None:
    """Prove the slips, the relay picture, the staircase, the phase average and the thresholds."""
    v.identity("slider 2 starts at T = -a", r["start_2"] + static_margin)
    v.identity("in a dilation slider 2 is first, by 2s", r["start_2"] - r["start_1_up"] - 2 * s)
    v.identity(
        "the slip of slider 2 leaves slider 1 a margin 2m",
        mu_s * c - r["after"] - s - 2 * slope_margin,
    )
    v.identity("... and 2s + 2D to the other side", r["after"] + s + mu_s * c - 2 * s - 2 * excess)
    position = symbol("r")
    y_up = sp.solve(position - symbol("y") - r["start_2"], symbol("y"))[0]
    y_down = sp.solve(position - symbol("y") - r["start_1_down"], symbol("y"))[0]
    rho = position + excess
    v.identity("r -> r + 2D switches at y = rho + m, rho = r + D", y_up - rho - slope_margin)
    v.identity(
        "r + 2D -> r switches at y = rho - m, the same rho",
        y_down.subs(position, position + 2 * excess) - rho + slope_margin,
        "so the chain is a row of relays at rho in r0 + D + 2D Z, for any path of theta",
    )
    v.identity(
        "every switching moves the centre of mass downhill by D",
        r["advance"] - excess,
        "slider 2 down by 2D in a dilation, slider 1 down by 2D in a contraction (slip)",
    )
    r0 = sp.Symbol("r_0", nonnegative=True)
    v.identity(
        "the relay at r0 - D, 0 <= r0 <= D, switches back at y = -(a - r0)",
        y_down.subs(position, r0) + (static_margin - r0),
        "the other way it switches at r0 - D + m, closer to zero; r0 < 0 is the mirror image",
    )
    v.argued(
        "theorem of the staircase: along any path of theta x_G moves by D whenever y passes rho + m"
        " upwards or rho - m downwards for a rho in r0 + D + 2D Z, in turns; cycles move it by D "
        "times the number of |rho| < l0 A - m, and creep is sustained iff l0 A > a - |r0|",
        "the claims above: starts are those of the equations of motion (scaling), slips solve them "
        "(slip), between them nothing moves; the relay closest to zero is at D - |r0|",
    )
    v.identity("the mean over r0 is l0 A - m", r["velocity"] - (room - slope_margin))
    v.identity(
        "towards alpha_c the velocity without disorder tends to l0 A, mean over r0",
        sp.limit(r["velocity"], s, mu_d * c) - room,
        "m vanishes; no divergence",
    )
    v.identity(
        "mean displacement after a reversal: l0 |d theta| - 2m",
        r["half_cycle"] - (l0 * jump - 2 * slope_margin),
    )
    v.identity(
        "the paper's minimum dilation 2a is that of the least favourable phase; the mean is 2m",
        (r["start_1_down"] - r["start_2"] - 2 * excess) - 2 * slope_margin,
        "a dilation ends with T anywhere in [-a, -a + 2D), a contraction in (a - 2D, a]: D on "
        "average at each end",
    )
    agree = conserved = ceiling = True
    above = below = 0
    for slope, low, high, reach, start in cases(500, 2011):
        pair = TwoSliders(slope, low, high, r=start)
        predicted = staircase(slope, low, high, reach, start)
        step = high - low
        for target in (reach, -reach):
            pair.ramp(target)
        before = sum(pair.x) / 2
        for target in (reach, -reach) * 3:
            pair.ramp(target)
        measured = (sum(pair.x) / 2 - before) / 6
        agree &= measured == predicted
        conserved &= (pair.r - start) % (2 * step) == 0
        creeps = measured > 0
        ceiling &= creeps == (reach > (high - slope) - abs(start))
        above, below = above + creeps, below + (not creeps)
        relaxed = staircase(slope, low, high, reach, Fraction(0))
        ceiling &= relaxed == 2 * step * max(0, ceil((reach - (high - slope)) / (2 * step)))
    v.verified(
        "staircase for any r0", agree, f"500 rational cases, {above} creep and {below} do not"
    )
    v.verified("r0 is conserved", conserved, "the same 500 cases")
    v.verified(
        "threshold a - |r0| and the ceiling formula of the relaxed chain",
        ceiling,
        "the same 500 cases",
    )
    v.verified(
        "phase average max(0, l0 A - m)", _phases(), "60 rational cases, integrated exactly over r0"
    )
    v.verified(
        "any path: x_G moves by half the truncated variation on average over r0",
        _paths(),
        "40 random paths",
    )


def _phases() -> bool:
    """Return whether the integral of the staircase over r0 is 2D max(0, l0 A - m), exactly.

    The staircase is piecewise constant in r0 with at most two jumps, where a relay reaches the
    edge.
    """
    for slope, low, high, reach, _ in cases(60, 7):
        step, inside = high - low, reach - (low - slope)
        breaks = {-step, step}
        for edge in (inside, -inside):
            breaks.add((edge - step + step) % (2 * step) - step)
        ends = sorted(breaks)
        total = Fraction(0)
        for a, b in pairwise(ends):
            total += (b - a) * staircase(slope, low, high, reach, (a + b) / 2)
        if total != 2 * step * max(Fraction(0), inside):
            return False
    return True


def _switchings(path: list[Fraction], rho: Fraction, half: Fraction, up: bool) -> int:
    """Return how often a relay at rho with thresholds rho - half and rho + half switches."""
    count = 0
    for target in path:
        if (not up and target > rho + half) or (up and target < rho - half):
            up, count = not up, count + 1
    return count


def _paths() -> bool:
    """Return whether slips along random paths are switchings of relays, and their mean the play's.

    The number of switchings is constant between the values where a relay's threshold meets the
    path, so its integral over rho, which is the mean over r0, is exact.
    """
    random = Random(5)
    for slope, low, high, _, _ in cases(40, 9):
        path = [Fraction(random.randint(-300, 300), 40) for _ in range(12)]
        step, half = high - low, low - slope
        start = step * Fraction(random.randint(-19, 19), 20)
        pair = TwoSliders(slope, low, high, r=start)
        for target in path:
            pair.ramp(target)
        reach = int(Fraction(10) / step) + 4
        moved = sum(
            step * _switchings(path, start + step + 2 * step * index, half, index < 0)
            for index in range(-reach, reach)
        )
        if sum(pair.x) / 2 != moved:
            return False
        ends = sorted({Fraction(0), *(y + half for y in path), *(y - half for y in path)})
        integral = sum(
            (b - a) * _switchings(path, (a + b) / 2, half, (a + b) / 2 < 0)
            for a, b in pairwise(ends)
        )
        _, rise, fall = play_variation(path, 2 * half, Fraction(0))
        if integral != rise + fall:
            return False
    return True


def _forces(exerting: Expression, on: Expression) -> Expression:
    if (exerting, on) == (1, 2):
        return -m * g * tension
    if (exerting, on) == (2, 1):
        return m * g * tension
    return sp.Symbol("no_spring")


_R = derive().results
_MARGIN_2 = -tension + s - mu_2 * c
_HALF = sp.Rational(1, 2)
_exact_velocity = {symbol("v_G"): _R["velocity"] / tau_th}


def _dilation(sign: int) -> dict[object, Expression]:
    moving = symbol("moving")
    return {
        symbol("Delta_x_G"): _HALF * moving,
        "Delta_x": lambda index: moving if index == (2 if sign > 0 else 1) else sp.Integer(0),
        symbol("Delta_theta"): sign * jump,
    }


def _moved(sign: int) -> Judge:
    exact = _R["half_cycle"]

    def judge(formula: Formula) -> bool:
        bound = formula.bound(_dilation(sign))
        inner = Formula(
            tuple(side.subs(symbol("moving"), exact) for side in bound.sides), bound.relations
        )
        return leading({}, jump)(inner)

    return judge


def _by_symmetry(formula: Formula) -> bool:
    # the mirror image of a chain on a horizontal plane is the same chain: v = -v
    v = symbol("v_G")
    return follows({v: sp.solve(v - (-v), v)[0]})(formula)


_CHAIN = ("0 < tan(alpha) < mu_d", "sigma_mu = 0", "mean over the phase r0")

ENTRIES: tuple[Entry, ...] = (
    Entry(
        "divergence",
        "Fig. velocity2sliders, caption",
        r"$<\tilde{v}_G>$ drastically increases when $\alpha$ is increased and diverges for "
        r"$\alpha = \alpha_\mathrm{c}$",
        "approximation",
        "two_sliders: without disorder the velocity tends to l0 A (cycles), l0 sigma_theta/sqrt(pi)"
        " (random dilations) as tan(alpha) tends to mu_d: see velocity",
        proved=False,
        assumptions=("sigma_mu > 0: both sliders must slide together",),
        error="false for sigma_mu = 0, where no slip of one slider sets the other in motion; with "
        "disorder nothing is proved but that an avalanche's path is at most E/m (runaway). "
        "Simulated, A = .01, tan(alpha) = .49, .499, .4999: 10.06, 10.02, 10.02 without disorder, "
        "10.3, 16.2, 28.0 with sigma_mu = .01",
        evidence=lambda: vanishes(sp.limit(_R["velocity"], s, mu_d * c) - room),
    ),
    Entry(
        "horizontal",
        "Sec. III A 2",
        r"for $\alpha=0$, by symmetry, we expect $<\tilde{v}_G> = 0$",
        "exact",
        "two_sliders: the mirror image of the chain is a chain with the same law of disorder",
        assumptions=("mean over the disorder or over mirror-symmetric starts",),
        formula=r"<\tilde{v}_G> = 0",
        holds=_by_symmetry,
    ),
    Entry(
        "dilation_step",
        "Sec. III A 2",
        r"$\Delta\tilde{x}_G = \frac{1}{2} \Delta\tilde{x}_2 \simeq "
        r"\frac{1}{2}\tilde{l}_0\Delta\theta$",
        "approximation",
        "two_sliders: half_cycle",
        assumptions=_CHAIN,
        corrected=r"\Delta\tilde{x}_G = \frac{1}{2}\Bigl[\tilde{l}_0 \Delta\theta - "
        r"2(\mu_\mathrm{d} \cos\alpha - "
        r"\sin\alpha)\Bigr] after a contraction",
        corrected_formula=r"\Delta\tilde{x}_G = \frac{1}{2}\Bigl[\tilde{l}_0 \Delta\theta - "
        r"2(\mu_\mathrm{d} "
        r"\cos\alpha - \sin\alpha)\Bigr]",
        error="-m after a reversal, 0 (to a slip) otherwise; small if l0 |d theta| >> 2m",
        holds=_moved(1),
        holds_exactly=follows(
            {symbol("Delta_x_G"): _R["half_cycle"] / 2, symbol("Delta_theta"): jump}
        ),
    ),
    Entry(
        "contraction_step",
        "Sec. III A 2",
        r"$\Delta\tilde{x}_G = \frac{1}{2} \Delta\tilde{x}_1 \simeq "
        r"-\frac{1}{2}\tilde{l}_0\Delta\theta$",
        "approximation",
        "two_sliders: half_cycle, mirrored",
        assumptions=_CHAIN,
        error="-m after a reversal; small if l0 |d theta| >> 2m",
        holds=_moved(-1),
    ),
    Entry(
        "step",
        "Sec. III A 2",
        r"$\Delta\tilde{x}_G \simeq \frac{1}{2}\tilde{l}_0 |\Delta\theta|$",
        "approximation",
        "two_sliders: half_cycle, both directions",
        assumptions=_CHAIN,
        error="-m after a reversal; small if l0 |d theta| >> 2m",
        holds=lambda formula: _moved(1)(formula) and _moved(-1)(formula),
    ),
    Entry(
        "half_cycle_step",
        "Sec. III A 2",
        r"$\Delta\tilde{x}_G \simeq \frac{1}{2} \tilde{l}_0 (2 A_\theta)$",
        "approximation",
        "two_sliders: half_cycle with |d theta| = 2A",
        assumptions=_CHAIN,
        error="-m; small if l0 A >> m",
        holds=leading(
            {symbol("Delta_x_G"): _R["half_cycle"].subs(jump, 2 * amplitude) / 2}, amplitude
        ),
    ),
    Entry(
        "velocity_th_2_cycle",
        "Sec. III A 2",
        r"\tau_\mathrm{th} <\tilde{v}_G>\,\simeq \tilde{l}_0 A_\theta.",
        "approximation",
        "two_sliders: phase average of the staircase",
        label="velocity_th_2_cycle",
        assumptions=_CHAIN,
        corrected=r"\tau_\mathrm{th} <\tilde{v}_G>\,= \tilde{l}_0 A_\theta - (\mu_\mathrm{d} "
        r"\cos{\alpha} - "
        r"\sin{\alpha}), not below 0",
        corrected_formula=r"\tau_\mathrm{th} <\tilde{v}_G>\,= \tilde{l}_0 A_\theta - "
        r"(\mu_\mathrm{d} \cos{\alpha} - "
        r"\sin{\alpha})",
        error="-m/(l0 A), small if l0 A >> m; for sigma_mu = 0 and one r0 the steps of the "
        "staircase, 2D, besides",
        formula=r"\tau_\mathrm{th} <\tilde{v}_G>\,\simeq \tilde{l}_0 A_\theta",
        holds=leading(_exact_velocity, amplitude),
        holds_exactly=follows(_exact_velocity),
    ),
    Entry(
        "lower_slider_starts",
        "Sec. III A 2",
        r"$f_{1\to2} + m g\,\sin\alpha > \mu_{\mathrm{s},2}\,m g\,\cos\alpha$ "
        r"[Eq.~(\ref{static_eqN})]"
        "\n"
        r"and",
        "exact",
        "two_sliders: Eq. (static_eqN) downhill",
        formula=r"f_{1\to2} + m g\,\sin\alpha > \mu_{\mathrm{s},2}\,m g\,\cos\alpha",
        holds=inequality({"f": _forces}, _MARGIN_2),
    ),
    Entry(
        "upper_slider_stays",
        "Sec. III A 2",
        r"$ f_{2\to1} + m g\,\sin\alpha > - \mu_{\mathrm{s},1}\,m g\,\cos\alpha$",
        "exact",
        "two_sliders: slider 1 does not start uphill",
        formula=r"f_{2\to1} + m g\,\sin\alpha > - \mu_{\mathrm{s},1}\,m g\,\cos\alpha",
        holds=inequality({"f": _forces}, tension + s + mu_1 * c),
    ),
    Entry(
        "ordering",
        "Sec. III A 2",
        r"$\tan\alpha > \frac{1}{2} (\mu_{\mathrm{s},2}-\mu_{\mathrm{s},1})$",
        "exact",
        "two_sliders: the tension at which slider 2 starts lies above the one at which slider 1 "
        "does",
        holds=inequality({}, s / c - _R["ordering"]),
    ),
    Entry(
        "alpha_c_minus",
        "Sec. III A 2",
        r"$\tan\alpha > \tan\alpha_\mathrm{c}^- \equiv \sigma_\mu/\sqrt{2}$",
        "approximation",
        "two_sliders: one standard deviation of (mu_s2 - mu_s1)/2",
        assumptions=("independent Gaussian coefficients",),
        error="at this angle the condition is fulfilled in 84 % of the draws, Phi(1); a "
        "convention for the edge "
        "of a smooth crossover",
        formula=r"\tan\alpha_\mathrm{c}^- \equiv \sigma_\mu/\sqrt{2}",
        holds=follows({sp.tan(symbol("alpha_c_minus")): _R["alpha_c_minus"]}),
    ),
    Entry(
        "slip_starts",
        "Sec. III A 2",
        r"for $f_{1\to2} + m g\,\sin\alpha > \mu_{\mathrm{s},2}\,m g\,\cos\alpha$",
        "exact",
        "two_sliders: Eq. (static_eqN) downhill",
        formula=r"f_{1\to2} + m g\,\sin\alpha > \mu_{\mathrm{s},2}\,m g\,\cos\alpha",
        holds=inequality({"f": _forces}, _MARGIN_2),
    ),
    Entry(
        "upper_slider_after_slip",
        "Sec. III A 2",
        r"$-f_{1\to2}+m g\,\sin\alpha < \mu_{\mathrm{s},1}\,m g\,\cos\alpha$",
        "exact",
        "two_sliders: slider 1 does not start downhill",
        holds=inequality({"f": _forces}, mu_1 * c - tension - s),
    ),
    Entry(
        "stability_after_slip",
        "Sec. III A 2",
        r"$\tan\alpha < \mu_\mathrm{d} + {(\mu_{\mathrm{s},1}-\mu_{\mathrm{s},2})}/{2}$",
        "exact",
        "two_sliders: margin of slider 1 at the end of the slip, which is its worst moment (slip)",
        holds=inequality({}, _R["stability"] - s / c),
    ),
    Entry(
        "alpha_c_plus",
        "Sec. III A 2",
        r"$\tan\alpha < \tan\alpha_\mathrm{c}^+ \equiv \mu_\mathrm{d} - \sigma_\mu/{\sqrt{2}}$",
        "approximation",
        "two_sliders: one standard deviation below the mean of the stability limit",
        assumptions=("independent Gaussian coefficients",),
        error="at this angle the slider stays in 84 % of the draws, Phi(1)",
        formula=r"\tan\alpha_\mathrm{c}^+ \equiv \mu_\mathrm{d} - \sigma_\mu/{\sqrt{2}}",
        holds=follows({sp.tan(symbol("alpha_c_plus")): _R["alpha_c_plus"]}),
    ),
    Entry(
        "reversal_step",
        "Sec. III A 2",
        r"$\Delta\tilde{x}_G \simeq \frac{1}{2} \Bigl[ \tilde{l}_0 |\Delta\theta|"
        "\n"
        r"- 2 (\overline{\mu}_\mathrm{s} \cos{\alpha} - \sin{\alpha}) \Bigr]$",
        "inconsistent",
        "two_sliders: half_cycle; contradicts Eq. (vitesse_seuil) at N = 2",
        assumptions=_CHAIN,
        corrected=r"\Delta\tilde{x}_G = \frac{1}{2} \Bigl[ \tilde{l}_0 |\Delta\theta| - 2 "
        r"(\mu_\mathrm{d} \cos{\alpha} "
        r"- \sin{\alpha}) \Bigr]",
        corrected_formula=r"\Delta\tilde{x}_G = \frac{1}{2} \Bigl[ \tilde{l}_0 |\Delta\theta| - 2 "
        r"(\mu_\mathrm{d} "
        r"\cos{\alpha} - \sin{\alpha}) \Bigr]",
        error="too small by D: the last slip overshoots its threshold by 2D, D on average, at "
        "both ends of a "
        "half-cycle",
        holds=follows({symbol("Delta_x_G"): _R["half_cycle"] / 2, symbol("Delta_theta"): jump}),
        repair=(r"\overline{\mu}_\mathrm{s}", r"\mu_\mathrm{d}"),
    ),
    Entry(
        "velocity_th_2_cycle_corrected",
        "Sec. III A 2",
        r"\tau_\mathrm{th} <\tilde{v}_G>\,\simeq \tilde{l}_0 A_\theta - "
        r"(\overline{\mu}_\mathrm{s} \cos{\alpha} - "
        r"\sin{\alpha}),",
        "inconsistent",
        "two_sliders: the mean over phases has mu_d, as Eq. (vitesse_seuil) at N = 2, i = 2 says; "
        "for one phase "
        "the exact law is the staircase",
        label="velocity_th_2_cycle_corrected",
        assumptions=_CHAIN,
        corrected=r"\tau_\mathrm{th} <\tilde{v}_G>\,= \tilde{l}_0 A_\theta - (\mu_\mathrm{d} "
        r"\cos{\alpha} - "
        r"\sin{\alpha}), not below 0; relaxed chain: 2D max(0, ceil((l0 A - a)/(2D)))",
        corrected_formula=r"\tau_\mathrm{th} <\tilde{v}_G>\,= \tilde{l}_0 A_\theta - "
        r"(\mu_\mathrm{d} \cos{\alpha} - "
        r"\sin{\alpha})",
        error="too small by D = (mu_s - mu_d) cos(alpha), at every amplitude",
        formula=r"\tau_\mathrm{th} <\tilde{v}_G>\,\simeq \tilde{l}_0 A_\theta - "
        r"(\overline{\mu}_\mathrm{s} "
        r"\cos{\alpha} - \sin{\alpha})",
        holds=follows(_exact_velocity),
        repair=(r"\overline{\mu}_\mathrm{s}", r"\mu_\mathrm{d}"),
    ),
    Entry(
        "threshold_th_2_cycle_corrected",
        "Sec. III A 2",
        r"A_\theta^* \equiv \frac{1}{\tilde{l}_0} (\overline{\mu}_\mathrm{s} \cos{\alpha} - "
        r"\sin{\alpha}).",
        "exact",
        "two_sliders: threshold of the relaxed chain",
        label="threshold_th_2_cycle_corrected",
        assumptions=(
            "sigma_mu = 0",
            "relaxed chain, r0 = 0; otherwise (a - |r0|)/l0, down to m/l0",
        ),
        error="not the amplitude at which the mean velocity of the corrected law vanishes, which "
        "is m/l0",
        formula=r"A_\theta^* \equiv \frac{1}{\tilde{l}_0} (\overline{\mu}_\mathrm{s} \cos{\alpha} "
        r"- \sin{\alpha})",
        holds=follows({symbol("A_theta_star"): _R["threshold"]}),
    ),
    Entry(
        "rest_below_threshold",
        "Sec. III A 2",
        r"If the amplitude is smaller than $A_\theta^*$, the dilations are not sufficient to "
        r"rearrange the system"
        "\n"
        r"and $<\tilde{v}_G> = 0$.",
        "exact",
        "two_sliders: no relay switches if l0 A <= a - |r0|",
        assumptions=("relaxed chain; one with r0 != 0 creeps down to a - |r0|", "sigma_mu = 0"),
        evidence=lambda: vanishes(
            # below the threshold the nearest relays, at +-D, lie outside of |rho| < l0 A - m
            (room - slope_margin).subs(amplitude, _R["threshold"]) - excess
        ),
    ),
)
