"""That a slip between resting neighbours is half a period of a cosine, and how far it goes."""

from __future__ import annotations

from fractions import Fraction

import sympy as sp

from derivations.notation import Expression, c, excess, mu_d, mu_s, symbol
from derivations.proof import Derivation, Entry, Results, Step, Verification, follows, vanishes

t = sp.Symbol("t", nonnegative=True)
a0, w = sp.symbols("a_0 omega", positive=True)
v0 = sp.Symbol("v_0", nonnegative=True)
V = sp.Symbol("V", positive=True)
"""Velocity l0 theta' at which a ramp drives an end slider."""


def derive() -> Derivation:
    """Return displacement, duration and path of a lone slip with driving acceleration a_0.

    The slider feels ``x'' = a_0 - omega**2 x`` with omega**2 the number of its springs.
    """
    path = sp.Function("path")
    solution = sp.dsolve(
        path(t).diff(t, 2) - a0 + w**2 * path(t),
        path(t),
        ics={path(0): 0, path(t).diff(t).subs(t, 0): 0},
    ).rhs
    duration = sp.pi / w
    displacement = sp.simplify(solution.subs(t, duration))
    energy = v0**2 + 2 * a0 * symbol("X") - w**2 * symbol("X") ** 2
    reach = next(
        root for root in sp.solve(energy, symbol("X")) if root.subs({v0: 0, a0: 1, w: 1}) > 0
    )
    at_threshold = {a0: excess}
    # the spring's far end moves at the constant velocity V while the slider slips
    driven = sp.dsolve(
        path(t).diff(t, 2) - excess - V * t + path(t),
        path(t),
        ics={path(0): 0, path(t).diff(t).subs(t, 0): 0},
    ).rhs
    results = {
        "path": sp.simplify(solution),
        "duration": duration,
        "displacement": displacement,
        "reach": reach,
        "energy": energy,
        "end_displacement": displacement.subs(w, 1).subs(at_threshold),
        "end_duration": duration.subs(w, 1),
        "inner_displacement": displacement.subs(w, sp.sqrt(2)).subs(at_threshold),
        "inner_duration": duration.subs(w, sp.sqrt(2)),
        "driven_velocity": sp.expand(driven.diff(t)),
        "driven_stop": 2 * (sp.pi - sp.atan(excess / V)),
    }
    steps = (
        Step("x'' = a_0 - omega**2 x from rest, omega**2 = number of springs", results["path"]),
        Step("velocity, zero for the first time at pi/omega", sp.diff(results["path"], t)),
        Step("displacement at that time", displacement),
        Step("from velocity v_0, by energy", reach),
        Step(
            "end slider from its threshold: a_0 = mu_s c - mu_d c, omega = 1",
            results["end_displacement"],
        ),
        Step("inner slider: omega**2 = 2", results["inner_displacement"]),
        Step("end slider driven at the velocity V: its own velocity", results["driven_velocity"]),
        Step("which is zero again at", results["driven_stop"]),
    )
    return Derivation(
        "One slider's slip",
        steps,
        results,
        ("the neighbours stay at rest", "the slip starts at the static threshold"),
    )


def check(v: Verification, r: Results) -> None:
    """Prove the closed forms of lone slips and where their neighbours are most loaded."""
    path = r["path"]
    v.identity("the path solves the equation of motion", path.diff(t, 2) - a0 + w**2 * path)
    v.identity("it starts at rest", path.diff(t).subs(t, 0))
    v.identity("its velocity is (a_0/omega) sin(omega t)", path.diff(t) - a0 / w * sp.sin(w * t))
    v.proved(
        "the first zero of the velocity after the start is at pi/omega",
        sp.sin(w * r["duration"]) == 0
        and all(sp.sin(w * r["duration"] * sp.Rational(k, 12)) > 0 for k in range(1, 12)),
        "sin has no zero between 0 and pi",
    )
    v.identity("an end slider moves by 2D", r["end_displacement"] - 2 * excess)
    v.identity("an inner slider moves by D", r["inner_displacement"] - excess)
    v.identity("an inner slider takes pi/sqrt(2)", r["inner_duration"] - sp.pi / sp.sqrt(2))
    X = symbol("X")
    v.identity(
        "the reach from velocity v_0 is (a_0 + sqrt(a_0**2 + omega**2 v_0**2))/omega**2",
        r["reach"] - (a0 + sp.sqrt(a0**2 + w**2 * v0**2)) / w**2,
    )
    v.identity(
        "energy: v**2 = v_0**2 + 2 a_0 X - omega**2 X**2 has the derivative of the motion",
        sp.diff(r["energy"], X) / 2 - (a0 - w**2 * X),
    )
    after: Expression = mu_s * c - w**2 * r["displacement"].subs(a0, excess)
    v.identity(
        "after a slip from the threshold the force is (2 mu_d - mu_s) c, whatever the number of "
        "springs",
        after - (2 * mu_d - mu_s) * c,
    )
    v.proved(
        "the slider then rests: |2 mu_d - mu_s| <= mu_s",
        vanishes((mu_s * c) ** 2 - after**2 - 4 * mu_d * (mu_s - mu_d) * c**2),
        "mu_s**2 - (2 mu_d - mu_s)**2 = 4 mu_d (mu_s - mu_d) >= 0",
    )
    v.proved(
        "the path is monotone, so a neighbour's force is most changed when the slip ends",
        (path.diff(t) / sp.sin(w * t)).simplify().is_positive,
        "the velocity is a positive multiple of sin(omega t)",
    )
    driven, stop = r["driven_velocity"], r["driven_stop"]
    tangent = excess / V  # of pi - stop/2
    half = {sp.sin(t): -2 * tangent / (1 + tangent**2), sp.cos(t): None}
    half[sp.cos(t)] = (1 - tangent**2) / (1 + tangent**2)
    v.identity(
        "a driven slider moves at V (1 - cos t) + D sin t",
        driven - V * (1 - sp.cos(t)) - excess * sp.sin(t),
    )
    v.identity(
        "it stops after 2 (pi - atan(D/V)) < 2 pi, at every rate V",
        driven.subs(half),
        "sine and cosine at that time by the tangent of half of it",
    )
    v.identity(
        "... and is left a force D below mu_d c, as after a slow slip",
        driven.diff(t).subs(half) + excess,
        "so it waits 2 D/V for its next slip: it is at rest for a share of about D/(pi V) of time",
    )
    v.identity("that time is 2 (pi - atan(D/V))", sp.tan(sp.pi - stop / 2) - tangent)
    v.verified(
        "equality at ordinary numbers: tan(alpha) = 1/5, .5, .6, N = 3, first dilation",
        _ordinary_equality(),
        "rationals: after two lone slips of slider 3 slider 2 stands exactly at its threshold, "
        "and sliders 1 "
        "and 3 reach theirs together",
    )


def _ordinary_equality() -> bool:
    """Return whether the three equalities of that chain hold, in units of cos(alpha)."""
    slope, low, high = Fraction(1, 5), Fraction(1, 2), Fraction(3, 5)
    first = second = Fraction(0)  # tensions of the two springs
    for _ in range(2):
        ramp = high - slope + second  # slider 3: -T_2 + slope = mu_s
        first, second = first - ramp, second - ramp
        second += 2 * (high - low)
        if abs(first + slope) >= high:
            return False
    if second - first + slope != high:
        return False
    return high - slope + second == high + slope + first  # ramps left to sliders 3 and 1


_mu = sp.Function("mu_s")

ENTRIES: tuple[Entry, ...] = (
    Entry(
        "force_drop",
        "Sec. III A 2",
        r"$\Delta f_{1\to2} = 2\,m g\,\cos\alpha\,(\mu_{\mathrm{s},2}-\mu_\mathrm{d})$",
        "exact",
        "slip: an end slider moves by 2 (mu_s - mu_d) cos(alpha), which is the change of the "
        "spring's force",
        assumptions=("slider 1 rests", "slider 2 starts at its threshold"),
        holds=follows(
            {
                "Delta_f": lambda a, b: (
                    symbol("m")
                    * symbol("g")
                    * derive().results["end_displacement"].subs(mu_s, _mu(b))
                    if (a, b) == (1, 2)
                    else sp.Symbol("elsewhere")
                ),
            }
        ),
    ),
)
