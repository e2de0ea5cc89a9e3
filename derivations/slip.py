"""One slider's slip between resting neighbours: half a period of a cosine, and how far it goes."""

from __future__ import annotations

from functools import cache

import sympy as sp

from derivations.model import Model, g, here, m, mu
from derivations.notation import Expression, at, c, mu_d, mu_s, symbol
from derivations.proof import Proof, chapter

t = sp.Symbol("t", nonnegative=True)
a0, w, V, D = sp.symbols("a_0 omega V D", positive=True)
X = symbol("X")


@cache
def _moved(acceleration: Expression) -> Expression:
    """Return the path from rest of a slider with an acceleration that is linear in its path."""
    path = sp.Function("path")
    start = {path(0): 0, path(t).diff(t).subs(t, 0): 0}
    return sp.dsolve(path(t).diff(t, 2) - acceleration.subs(X, path(t)), path(t), ics=start).rhs


@chapter(
    "One slider's slip",
    "the neighbours stay at rest",
    "the slip starts at the static threshold",
)
def derive(p: Proof, model: Model) -> None:
    """Show the path, length and duration of a slip, and that no ramp makes a slider slide."""
    excess = p.show(
        "from its threshold it starts with the acceleration D, static less sliding friction",
        model.threshold() + model.friction(1),
        (mu_s - mu_d) * c,
        "excess",
    )
    path = p.show(
        "x'' = a_0 - omega**2 x from rest, omega**2 the number of springs: x =",
        _moved(a0 - w**2 * X),
        a0 / w**2 * (1 - sp.cos(w * t)),
    )
    speed = p.show("its velocity is", sp.diff(path, t), a0 / w * sp.sin(w * t))
    u, once = sp.Symbol("u", real=True), sp.Interval.Lopen(0, sp.pi)
    p.proved(
        "... positive until t = pi/omega, where it stops: a neighbour is most loaded at the end",
        lambda: (
            sp.solveset(sp.sin(u), u, once) == sp.FiniteSet(sp.pi)
            and sp.simplify(speed / sp.sin(w * t)).is_positive
        ),
        "the sine has no other zero in (0, pi]",
    )
    length = p.show("so it moves by", path.subs(t, sp.pi / w), 2 * a0 / w**2, "length")
    stiffness = p.show(
        "an end slider that moves by X loses X of the force on it: springs",
        -sp.diff(model.at("last"), here),
        1,
    )
    move = p.show(
        "it moves by",
        length.subs({a0: excess, w: sp.sqrt(stiffness)}),
        2 * (mu_s - mu_d) * c,
        "last",
    )
    p.entry("force_drop", {"Delta_f": at({(1, 2): m * g * move.subs(mu_s, mu(2))})})
    p.show(
        "... and keeps the force, which an old coefficient holds, and a new one that is not below "
        "|2 mu_d - mu_s|,",
        model.threshold() - stiffness * move,
        (2 * mu_d - mu_s) * c,
    )
    driven = p.show(
        "while theta rises, l0 theta' = V, a slipping end slider has the velocity",
        sp.expand(sp.diff(_moved(excess + model.push("last") * V * t - stiffness * X), t)),
        V * (1 - sp.cos(t)) + (mu_s - mu_d) * c * sp.sin(t),
    )
    tangent = -D / V
    half = {
        sp.sin(t): 2 * tangent / (1 + tangent**2),
        sp.cos(t): (1 - tangent**2) / (1 + tangent**2),
        mu_s: mu_d + D / c,
    }
    p.show("... zero where tan(t/2) = -D/V:", driven.subs(half), 0)
    stop = 2 * (sp.pi - sp.atan(D / V))
    p.proved(
        "so it stops after 2 (pi - atan(D/V)) < 2 pi, at every rate V",
        lambda: sp.tan(stop / 2).equals(-D / V) and (2 * sp.pi - stop).is_positive,
        "D/V is positive",
    )
    p.show(
        "... and is left the force -D, as after a slow slip: it waits 2 D/V for the next",
        sp.diff(driven, t).subs(half),
        -D,
    )
    p.entry("dilation_rate", lines=4)
