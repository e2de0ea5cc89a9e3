"""The equations of motion and of starting, from the model's energies, and how they scale."""

from __future__ import annotations

import mpmath
import sympy as sp

from derivations.judges import Within, inequality, ratio, small, vanishes
from derivations.model import FRESH, Model, after, before, g, here, k, m, mu, solved, tau_dyn, way
from derivations.notation import (
    CAPTIONS,
    Expression,
    L,
    N,
    S,
    Y,
    at,
    c,
    kappa,
    l0,
    mu_d,
    mu_s,
    n,
    rho,
    s,
    sigma_mu,
    sigma_theta,
    symbol,
    tau_th,
    theta,
    x,
)
from derivations.proof import Proof, chapter, worded

M, c_s, T, T_0 = (symbol(name) for name in ["M", "c_s", "T", "T_0"])
velocity = sp.Function("dot_x")
section = symbol("S")
ROD = {m: rho * section * L / N, k: N * Y * section / L}
"""A rod as a chain: mass of a slider, stiffness of a spring."""
SHORT, LONG, SOUND = 0.003, 0.03, 3000.0
"""From a few millimetres to centimetres, in m; a few km/s, in m/s."""
ORDER = 1.6
"""The factor to within which an estimate is what the formula above it gives."""


def normal(value: Expression, centre: Expression, width: Expression) -> Expression:
    """Return the density of a normal law."""
    exponent = -((value - centre) ** 2) / (2 * width**2)
    return sp.exp(exponent) / sp.sqrt(2 * sp.pi * width**2)


@chapter(
    "Equations of motion and scaling",
    "springs obey Hooke's law",
    "the stiffness does not depend on T",
    "theta is frozen while sliders move",
)
def derive(p: Proof, model: Model) -> None:
    """Show the forces on a slider, friction, and the units in which they have no parameter."""
    p.alone("slider_mass", {m: M / N})
    p.alone("total_length", {L: sp.summation(l0, (n, 1, N - 1))})
    p.alone("dilation", {theta: solved(l0 * (theta - kappa * (T - T_0)), theta)})
    expansion = model.natural[1]
    p.alone("thermal_expansion", {"l": lambda t: expansion.subs(theta, kappa * (t - T_0))})
    pull = at({(n + 1, n): model.pull(1, x(n), x(n + 1))})
    p.alone("spring_force", {"f": pull, "l": lambda t: l0 * (1 + theta)})
    ends = {"f": at({(0, 1): model.ends[0], (N + 1, N): model.ends[1]})}
    p.alone("free_end_upper", ends)
    p.alone("free_end_lower", ends)
    margin = abs(model.net(n)) - model.held.subs(mu_s, mu(n))
    p.alone("static_friction", inequality({}, margin))
    opposed = model.sliding.subs(way, S(velocity(n)))
    p.alone("dynamical_friction", {"f_d": at({n: opposed})})
    p.alone("friction_order", inequality({}, mu(n) - mu_d))

    p.alone("dynamical_time", {tau_dyn: solved(k * tau_dyn**2 / m - 1, tau_dyn)})
    rod = {tau_dyn: sp.sqrt(m / k).subs(ROD), c_s: sp.sqrt(Y / rho)}
    p.alone(
        "transit_time",
        ratio(rod, lambda q: vanishes(q - 1 / N)),
        rod,
        stiffness=ROD[k],
        mass=ROD[m],
        tau=sp.simplify(rod[tau_dyn]),
    )
    for name, length in (("dynamical_time_value", SHORT), ("dynamical_time_upper", LONG)):
        value = length / SOUND
        p.alone(name, Within(value, ORDER), value=value, length=length, sound=SOUND, factor=ORDER)
    forces = sum(model.at(slider) for slider in ("first", "inner", "last"))
    no_units = not {m, k, g, tau_dyn} & forces.free_symbols
    p.alone("time_unit", holds=no_units)
    p.alone("natural_length_unit", holds=no_units)
    stretched = (m * g / k).subs(k, m / tau_dyn**2)
    p.alone("length_unit", holds=vanishes(g * tau_dyn**2 - stretched))
    p.alone("timesteps", {symbol("t_q"): symbol("q") * tau_th})
    p.alone("centre_of_mass")

    friction = p.show(
        "friction in motion, S the direction, positive downhill",
        model.friction(way),
        -mu_d * c * way,
    )
    threshold = p.show("static friction holds forces up to", model.threshold(), mu_s * c)
    spring = l0 * (1 + theta)
    inside = (
        "force on the first slider: minus the derivative of the energy, in m g, lengths in the "
        "stretch of a spring by m g"
    )
    for name, slider, index, text, form in (
        ("1", "first", sp.Integer(1), inside, after - here - spring + s),
        ("", "inner", n, "on an inner slider", before - 2 * here + after + s),
        ("N", "last", N, "on the last slider", before - here + spring + s),
    ):
        force = p.show(text, model.at(slider), form)
        places = at({index - 1: before, index: here, index + 1: after})
        whole = force + friction.subs(way, S(velocity(index)))
        p.entry(f"dynamic_eq{name}", {"x": places, "ddot_x": at({index: whole})})
        own = {"x": places, "mu_s": at({index: mu_s})}
        p.entry(f"static_eq{name}", inequality(own, abs(force) - threshold))

    p.show(
        "after stop number `draw` a slider holds with the coefficient number", model.redraw, FRESH
    )
    p.entry("redraw", holds=model.redraw.has(FRESH))
    centre = sp.Symbol("centre", real=True)
    drawn = {symbol("mean_mu_s"): centre, "p": lambda value: normal(value, centre, sigma_mu)}
    p.alone("dist_mud", drawn)
    p.alone("dist_theta", {"psi": lambda value: normal(value, 0, sigma_theta)})
    p.alone("random_dilation_width", {sigma_theta: kappa * symbol("Delta_T")})
    apart = float(((mu_s - mu_d) / sigma_mu).subs(CAPTIONS))
    tail, mills = mpmath.ncdf(-apart), mpmath.npdf(apart) / apart
    p.checked(
        f"a drawn mu_s below mu_d has the probability {worded(tail, '.2g')} for the captions' "
        "numbers",
        lambda: mills * (1 - apart**-2) < tail < mills,
        f"Phi at minus {apart}, between the bounds of Mills' ratio",
    )
    thousandth = mpmath.findroot(lambda z: mpmath.ncdf(-z) - mpmath.mpf(1) / 1000, 3)
    p.entry(
        "drawn_below_dynamic",
        small({}, sigma_mu, mu_s - mu_d),
        tail=tail,
        apart=apart,
        thousandth=thousandth,
    )
