"""The equations of motion and of starting, from the model's energies, and how they scale."""

from __future__ import annotations

import mpmath
import sympy as sp

from derivations.entry import Backed, Backing, Lines, entries_of
from derivations.judges import Judge, follows, inequality, vanishes, within
from derivations.model import FRESH, Model, after, before, g, here, k, m, mu, place, tau_dyn, way
from derivations.notation import (
    Expression,
    Formula,
    N,
    S,
    c,
    f,
    l0,
    mu_d,
    mu_s,
    n,
    s,
    sigma_mu,
    sigma_theta,
    symbol,
    theta,
    x,
)
from derivations.proof import Proof, chapter

M, L, Y, rho, c_s, kappa, T, T_0 = (
    symbol(name) for name in ["M", "L", "Y", "rho", "c_s", "kappa", "T", "T_0"]
)


@chapter(
    "Equations of motion and scaling",
    "springs obey Hooke's law",
    "the stiffness does not depend on T",
    "theta is frozen while sliders move",
)
def derive(p: Proof, model: Model) -> None:
    """Show the forces on a slider, friction, and their symmetries."""
    first, inner, last = (model.at(name) for name in ("first", "inner", "last"))
    p.show(
        "force on slider 1: minus the derivative of the energy, in m g, lengths in g m/k",
        first,
        after - here - l0 * (1 + theta) + s,
        "first",
    )
    p.show("on an inner slider", inner, before - 2 * here + after + s, "inner")
    p.show("on slider N", last, before - here + l0 * (1 + theta) + s, "last")
    p.show("friction in motion, S = 1 downhill", model.friction(way), -mu_d * c * way, "friction")
    p.show("static friction holds forces up to", model.threshold(), mu_s * c, "threshold")
    p.show("a rise of l0 theta drives slider 1 with", model.push("first"), -1, "push_first")
    p.show("... an inner slider with", model.push("inner"), 0, "push_inner")
    p.show("... and slider N with", model.push("last"), 1, "push_last")
    p.show(
        "after stop number `draw` a slider holds with the coefficient number",
        model.redraw,
        FRESH,
        "redraw",
    )
    mirror = {before: -after, after: -before, here: -here, s: -s}
    p.show(
        "mirror image (x and the slope reversed): the force on an inner slider changes sign",
        inner.subs(mirror, simultaneous=True),
        -inner,
    )
    p.show(
        "... and that on slider 1 becomes minus that on slider N",
        first.subs(mirror, simultaneous=True),
        -last,
        "mirror",
    )
    near, far = sp.symbols("near far", real=True)
    p.show(
        "action and reaction: the two ends of a spring are pulled by forces of the sum",
        model.pull(1, near, far) + model.pull(-1, far, near),
        0,
    )
    p.checked(
        "a drawn mu_s below mu_d is rarer than 1e-23 for the captions' numbers",
        lambda: 7e-24 < mpmath.ncdf(-10) < 8e-24,
        "Phi((.5 - .6)/.01) = 7.6e-24",
        "rare",
    )


def _elsewhere(index: Expression) -> Expression:
    return sp.Symbol(f"elsewhere_{index}")


def _spring(model: Model) -> dict[object, object]:
    """Return what f(a, b) means: the force of slider a on slider b, in the sliders' positions."""

    def force(exerting: Expression, on: Expression) -> Expression:
        if (exerting, on) == (0, 1):
            return model.ends[0]
        if (exerting, on) == (N + 1, N):
            return model.ends[1]
        to = sp.expand(exerting - on)
        if to not in (1, -1):
            return _elsewhere(to)
        near, far = sp.symbols("near far", real=True)
        return sp.expand(model.pull(int(to), near, far).subs({near: x(on), far: x(exerting)}))

    return {"f": force}


def _around(index: Expression) -> dict[object, object]:
    """Return what the positions around the slider `index` are called in a force on it."""
    places = {sp.expand(index + step): at for step, at in ((-1, before), (0, here), (1, after))}
    own = sp.Symbol("mu_s_own", positive=True)
    return {
        "x": lambda at: places.get(sp.expand(at), _elsewhere(at)),
        "mu_s": lambda at: own if sp.expand(at - index) == 0 else _elsewhere(at),
    }


def _moves(r: Lines, index: Expression, force: Expression) -> Judge:
    """Judge the equation of motion of the slider `index`."""
    friction = r.friction.subs(way, S(sp.Function("dot_x")(index)))
    own = {"ddot_x": lambda at: force + friction if sp.expand(at - index) == 0 else _elsewhere(at)}
    return follows(_around(index) | own)


def _starts(r: Lines, index: Expression, force: Expression) -> Judge:
    """Judge the start condition of the slider `index`."""
    held = r.threshold.subs(mu_s, sp.Symbol("mu_s_own", positive=True))
    return inequality(_around(index), abs(force) - held)


def net(model: Model, slider: Expression) -> Expression:
    """Return the force on an inner slider in the words of the paper: both neighbours and weight."""
    return f(slider - 1, slider) + f(slider + 1, slider) - sp.diff(model.gravity, place)


def _density(name: str, width: Expression, centre: Expression, variable: Expression) -> Judge:
    """Judge a density: that of a normal law of the named centre and width, normalised."""

    def judge(formula: Formula) -> bool:
        z = sp.Symbol("z", real=True)
        density = formula.right.subs({variable: z}).subs(symbol("mean_mu_s"), centre)
        if formula.relations != ("=",) or formula.left != sp.Function(name)(variable):
            return False
        if not vanishes(sp.simplify(sp.diff(sp.log(density), z)) + (z - centre) / width**2):
            return False
        value = density.subs(z, centre + width * z) * width
        return bool(sp.simplify(sp.integrate(value, (z, -sp.oo, sp.oo)) - 1) == 0)

    return judge


def _transit(r: Lines) -> Backing:
    """A rod of N sliders: k = N Y S/L, m = rho S L/N, c_s**2 = Y/rho, so sqrt(m/k) is L/(N c_s)."""
    section = sp.Symbol("section", positive=True)
    tau = sp.sqrt((rho * section * L / N) / (N * Y * section / L))
    rod = {tau_dyn: tau, c_s: sp.sqrt(Y / rho)}

    def to_a_factor(formula: Formula) -> bool:
        left, right = formula.bound(rod).sides
        return formula.relations == ("~",) and vanishes(left / right - 1 / N)

    return Backing(to_a_factor, follows(rod))


def _no_units_left(r: Lines) -> bool:
    forces = [r.model.at(slider) for slider in ("first", "inner", "last")]
    return not {m, k, g, tau_dyn} & sum(forces).free_symbols


def _sliding(model: Model) -> Judge:
    def friction(index: Expression) -> Expression:
        if index != n:
            return _elsewhere(index)
        return model.sliding.subs(way, S(sp.Function("dot_x")(index)))

    return follows({"f_d": friction})


LINES: dict[str, Backed | None] = {
    "slider_mass": lambda r: follows({m: M / N}),
    "thermal_expansion": lambda r: follows(
        {"l": lambda at: r.model.natural[1].subs(theta, kappa * (at - T_0))}
    ),
    "total_length": lambda r: follows({L: sp.summation(l0, (n, 1, N - 1))}),
    "spring_force": lambda r: follows(_spring(r.model) | {"l": lambda at: l0 * (1 + theta)}),
    "static_friction": lambda r: inequality(
        {}, abs(net(r.model, n)) - r.model.held.subs(mu_s, mu(n))
    ),
    "free_end_upper": lambda r: follows(_spring(r.model)),
    "free_end_lower": lambda r: follows(_spring(r.model)),
    "dynamical_friction": lambda r: _sliding(r.model),
    "friction_order": lambda r: inequality({}, mu(n) - mu_d),
    "dynamical_time": lambda r: follows({tau_dyn: sp.solve(k - m / tau_dyn**2, tau_dyn)[0]}),
    "transit_time": _transit,
    "dynamical_time_value": lambda r: within(0.003 / 3000, 1.5),
    "dilation": lambda r: follows(
        {theta: sp.solve(l0 * (1 + theta) - l0 * (1 + kappa * (T - T_0)), theta)[0]}
    ),
    "time_unit": _no_units_left,
    "length_unit": lambda r: vanishes(g * tau_dyn**2 - (m * g / k).subs(k, m / tau_dyn**2)),
    "natural_length_unit": _no_units_left,
    "dynamic_eq1": lambda r: _moves(r, sp.Integer(1), r.first),
    "dynamic_eq": lambda r: _moves(r, n, r.inner),
    "dynamic_eqN": lambda r: _moves(r, N, r.last),
    "static_eq1": lambda r: _starts(r, sp.Integer(1), r.first),
    "static_eq": lambda r: _starts(r, n, r.inner),
    "static_eqN": lambda r: _starts(r, N, r.last),
    "redraw": lambda r: r.redraw.has(FRESH),
    "dist_mud": lambda r: _density("p", sigma_mu, sp.Symbol("centre", real=True), mu_s),
    "drawn_below_dynamic": lambda r: Backing(
        lambda formula: (
            formula.relations == ("<<",) and formula.bound({}).sides == (sigma_mu, mu_s - mu_d)
        ),
        evidence=r.rare is None,
    ),
    "dist_theta": lambda r: _density("psi", sigma_theta, sp.Integer(0), theta),
    "random_dilation_width": lambda r: follows({sigma_theta: kappa * symbol("Delta_T")}),
    "timesteps": lambda r: follows({symbol("t_q"): symbol("q") * symbol("tau_th")}),
    "centre_of_mass": None,
}
ENTRIES = entries_of("scaling", derive, LINES)
