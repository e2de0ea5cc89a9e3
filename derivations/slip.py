"""One slider's slip between resting neighbours: half a period of a cosine, and how far it goes."""

from __future__ import annotations

import sympy as sp

from derivations.entry import Backed, entries_of, stands
from derivations.judges import Judge, follows
from derivations.model import Model, g, here, m, mu
from derivations.notation import Expression, c, mu_d, mu_s, symbol
from derivations.proof import Proof, chapter

t = sp.Symbol("t", nonnegative=True)
a0, w, V, D = sp.symbols("a_0 omega V D", positive=True)
v0, X = sp.Symbol("v_0", nonnegative=True), symbol("X")


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
    springs = {name: -sp.diff(model.at(name), here) for name in ("last", "inner")}
    p.show("an end slider that moves by X loses X of the force on it", springs["last"], 1)
    p.show("... an inner one 2 X, one for each spring", springs["inner"], 2)
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
        "path",
    )
    p.show("its velocity is", sp.diff(path, t), a0 / w * sp.sin(w * t), "velocity")
    u, once = sp.Symbol("u", real=True), sp.Interval.Lopen(0, sp.pi)
    p.proved(
        "... positive until t = pi/omega, where it stops: a neighbour is most loaded at the end",
        lambda: (
            sp.solveset(sp.sin(u), u, once) == sp.FiniteSet(sp.pi)
            and (sp.diff(path, t) / sp.sin(w * t)).simplify().is_positive
        ),
        "the sine has no other zero in (0, pi]",
    )
    length = p.show("so it moves by", path.subs(t, sp.pi / w), 2 * a0 / w**2, "length")
    move = {name: length.subs({a0: excess, w: sp.sqrt(count)}) for name, count in springs.items()}
    p.show("an end slider by", move["last"], 2 * (mu_s - mu_d) * c, "end_move")
    p.show("... in the time", (sp.pi / w).subs(w, sp.sqrt(springs["last"])), sp.pi)
    p.show("an inner slider by", move["inner"], (mu_s - mu_d) * c, "inner_move")
    p.show(
        "... in the time",
        (sp.pi / w).subs(w, sp.sqrt(springs["inner"])),
        sp.pi / sp.sqrt(2),
    )
    left = {name: model.threshold() - count * move[name] for name, count in springs.items()}
    p.show("the force that is left on an end slider", left["last"], (2 * mu_d - mu_s) * c, "left")
    p.show("... and on an inner one", left["inner"], (2 * mu_d - mu_s) * c)
    p.show(
        "it holds with the old coefficient, mu_s**2 - (2 mu_d - mu_s)**2 >= 0, and with a new "
        "one that is not below |2 mu_d - mu_s|",
        (model.threshold() ** 2 - left["last"] ** 2) / c**2,
        4 * mu_d * (mu_s - mu_d),
    )
    energy = sp.integrate(2 * (a0 - w**2 * X), (X, 0, X)) + v0**2
    reach = next(root for root in sp.solve(energy, X) if root.subs({v0: 0, a0: 1, w: 1}) > 0)
    p.show(
        "from the velocity v_0 it goes as far as",
        reach,
        (a0 + sp.sqrt(a0**2 + w**2 * v0**2)) / w**2,
    )

    force = excess + model.push("last") * V * t - springs["last"] * X
    driven = p.show(
        "while theta rises, l0 theta' = V, a slipping end slider has the velocity",
        sp.expand(sp.diff(_moved(force), t)),
        V * (1 - sp.cos(t)) + (mu_s - mu_d) * c * sp.sin(t),
    )
    p.show(
        "which is 2 sin(t/2) (V sin(t/2) + D cos(t/2)), zero where tan(t/2) = -D/V",
        sp.expand_trig(driven.subs(t, 2 * u))
        - 2 * sp.sin(u) * (V * sp.sin(u) + (mu_s - mu_d) * c * sp.cos(u)),
        0,
        "driven",
    )
    stop = 2 * (sp.pi - sp.atan(D / V))
    p.proved(
        "so it stops after 2 (pi - atan(D/V)) < 2 pi, at every rate V",
        lambda: sp.tan(stop / 2).equals(-D / V) and (2 * sp.pi - stop).is_positive,
        "D/V is positive",
        "stops",
    )
    half = {sp.sin(t): -2 * D * V / (V**2 + D**2), sp.cos(t): (V**2 - D**2) / (V**2 + D**2)}
    at_stop = {mu_s: mu_d + D / c}
    p.show("... with the velocity", driven.subs(half).subs(at_stop), 0)
    p.show(
        "... and is left the force -D, as after a slow slip: it waits 2 D/V for the next",
        sp.diff(driven, t).subs(half).subs(at_stop),
        -D,
        "driven_end",
    )


def _drop(move: Expression) -> Judge:
    """Judge the fall of a spring's force in the slip of the slider it acts on."""
    falls = {(1, 2): lambda: m * g * move.subs(mu_s, mu(2))}
    elsewhere = sp.Symbol("elsewhere")
    return follows({"Delta_f": lambda a, b: falls.get((a, b), lambda: elsewhere)()})


LINES: dict[str, Backed | None] = {
    "force_drop": lambda r: _drop(r.end_move),
    "dilation_rate": lambda r: stands(r.driven, r.stops, r.driven_end),
}
ENTRIES = entries_of("slip", derive, LINES)
