"""One slider's slip between resting neighbours: half a period of a cosine, and how far it goes."""

from __future__ import annotations

import sympy as sp

from derivations.model import Model, X, a0, g, here, m, mu, t, w
from derivations.notation import Expression, at, c, mu_d, mu_s
from derivations.proof import Proof, chapter

V, D = sp.symbols("V D", positive=True)
springs = sp.Symbol("springs", positive=True)
HALF_TURN = sp.Interval.Lopen(0, sp.pi)


def positive_until_its_end(speed: Expression) -> bool:
    """Return whether a speed is a positive number of times sin(omega t), t up to pi/omega."""
    u = sp.Symbol("u", real=True)
    share = sp.simplify(speed / sp.sin(w * t))
    once = sp.solveset(sp.sin(u), u, HALF_TURN) == sp.FiniteSet(sp.pi)
    return bool(once and not share.has(t) and share.is_positive)


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
    driving = a0 - w**2 * X
    path = p.show(
        f"driven by {driving} from rest, omega the root of the number of springs: x =",
        model.moved(driving),
        a0 / w**2 * (1 - sp.cos(w * t)),
    )
    speed = p.show("its velocity is", sp.diff(path, t), a0 / w * sp.sin(w * t))
    stop = sp.pi / w
    p.proved(
        f"... positive until t = {stop}, where it stops: a neighbour is most loaded at the end",
        lambda: positive_until_its_end(speed) and speed.subs(t, stop) == 0,
        "the sine has no other zero on the way",
    )
    length = p.show("so it moves by", model.slip(a0, w), 2 * a0 / w**2, "length")
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
        "its absolute value over c,",
        model.threshold() - stiffness * move,
        (2 * mu_d - mu_s) * c,
    )
    _mean(p, model)
    _driven(p, model, excess, stiffness)


def _mean(p: Proof, model: Model) -> None:
    """Show that slips carry sliding friction on average because, and only because, of inertia."""
    drop = p.show(
        "whatever the number of its springs, a slip takes from the force on a slider",
        springs * model.slip(a0, sp.sqrt(springs)),
        2 * a0,
    )
    held = model.threshold()
    left = held - drop.subs(a0, model.threshold() + model.friction(1))
    p.show(
        "a ramp so slow that a slip takes no time raises the force evenly from the remainder to "
        "the threshold: the mean force, which a front of such sliders carries, is",
        (held + left) / 2,
        mu_d * c,
    )
    p.show("... the one that the balance of a chain takes (pivots)", model.carried(), mu_d * c)
    p.show(
        "it needs the overshoot of inertia: a slip that ended where forces balance would leave",
        held - drop.subs(a0, model.threshold() + model.friction(1)) / 2,
        mu_d * c,
        "balanced",
    )
    creeping = p.show(
        "... and the mean force would be", (held + p.balanced) / 2, (mu_s + mu_d) * c / 2
    )
    p.show(
        "but slip by slip it misses its mean by a phase, from minus to plus",
        held - model.carried(),
        (mu_s - mu_d) * c,
    )
    p.entry(
        "continuous_sliding",
        m * g * model.carried(),
        lines=6,
        creeping=creeping,
        phase=held - model.carried(),
    )


def _driven(p: Proof, model: Model, excess: Expression, stiffness: Expression) -> None:
    """Show that no rate of a ramp, however large, lets an end slider slide continuously."""
    driven = p.show(
        "while theta rises, V the rate of l0 theta, a slipping end slider has the velocity",
        sp.expand(sp.diff(model.moved(excess + model.push("last") * V * t - stiffness * X), t)),
        V * (1 - sp.cos(t)) + (mu_s - mu_d) * c * sp.sin(t),
    )
    tangent = -D / V
    half = {
        sp.sin(t): 2 * tangent / (1 + tangent**2),
        sp.cos(t): (1 - tangent**2) / (1 + tangent**2),
        mu_s: mu_d + D / c,
    }
    p.show(f"... zero where the tangent of half of t is {tangent}:", driven.subs(half), 0)
    stop = 2 * (sp.pi - sp.atan(D / V))
    p.proved(
        f"so it stops after {stop}, less than a whole turn, at every rate V",
        lambda: sp.tan(stop / 2).equals(tangent) and (2 * sp.pi - stop).is_positive,
        "D and V are positive",
    )
    left = p.show(
        "... and is left the force, as after a slow slip,", sp.diff(driven, t).subs(half), -D
    )
    waits = p.show("it waits for the next slip a time of", (D - left) / V, 2 * D / V)
    share = p.show(
        "... which is, beside the time that it takes at large V, up to",
        waits / (2 * sp.pi),
        D / (sp.pi * V),
    )
    p.entry("dilation_rate", lines=5, stop=stop, share=share, velocity=driven)
