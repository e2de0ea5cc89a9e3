"""That the equations of motion are those of the chain's energy, and how they scale."""

from __future__ import annotations

import mpmath
import sympy as sp

from derivations.notation import (
    Expression,
    Formula,
    N,
    S,
    c,
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
    within,
)

k, m, g, M, L = (symbol(name) for name in ["k", "m", "g", "M", "L"])
tau_dyn, c_s = symbol("tau_dyn"), symbol("c_s")
length = sp.Symbol("l", positive=True)
kappa, T, T_0 = symbol("kappa"), symbol("T"), symbol("T_0")
before, here, after = sp.symbols("x_before x_here x_after", real=True)


def spring(exerting: Expression, on: Expression) -> Expression:
    """Return the force that the spring between two sliders exerts on one of them.

    Minus the derivative of the spring's energy ``k (x_{b+1} - x_b - l)**2 / 2``; zero at a free
    end.
    """
    a, b = sp.sympify(exerting), sp.sympify(on)
    if (a, b) in ((sp.Integer(0), sp.Integer(1)), (N + 1, N)):
        return sp.Integer(0)  # nothing hangs on the ends
    near, far = sp.symbols("near far", real=True)
    if sp.expand(a - b) == 1:  # the lower neighbour
        energy = k * (far - near - length) ** 2 / 2
    elif sp.expand(a - b) == -1:  # the upper one
        energy = k * (near - far - length) ** 2 / 2
    else:
        return sp.Symbol(f"no_spring_between_{a}_and_{b}")
    return (-sp.diff(energy, near)).subs({near: x(b), far: x(a)})


def _total(energy: Expression) -> Expression:
    """Return the dimensionless force on the slider `here`: minus a derivative, scaled."""
    force = -sp.diff(energy, here)
    unit = g * tau_dyn**2
    scaled = {
        before: unit * before,
        here: unit * here,
        after: unit * after,
        length: unit * l0 * (1 + theta),
        sp.sin(symbol("alpha")): s,
    }
    force = force.subs(scaled, simultaneous=True).subs(k, m / tau_dyn**2)
    return sp.expand(force / (m * g))


def derive() -> Derivation:
    """Return the dimensionless forces on the first, an inner and the last slider."""
    weight = -m * g * s * here
    upper, lower = k * (here - before - length) ** 2 / 2, k * (after - here - length) ** 2 / 2
    results = {
        "force_first": _total(lower + weight),
        "force_inner": _total(upper + lower + weight),
        "force_last": _total(upper + weight),
        "friction": -mu_d * c,
        "from_above": spring(n, n + 1),
        "from_below": spring(n + 1, n),
    }
    steps = (
        Step("Elastic energy and weight that contain slider n", upper + lower + weight),
        Step("Force on slider n: minus the derivative", -sp.diff(upper + lower + weight, here)),
        Step("Time in sqrt(m/k), length in g m/k, force in m g: slider 1", results["force_first"]),
        Step("... slider n", results["force_inner"]),
        Step("... slider N", results["force_last"]),
        Step("Friction in motion with direction S, in m g", results["friction"] * S(n)),
    )
    return Derivation(
        "Equations of motion and scaling",
        steps,
        results,
        ("springs obey Hooke's law", "the stiffness does not depend on T"),
    )


def _at(place: Expression, name: str) -> Judge:
    """Return a judge for the equation of motion of the slider at `place`."""
    force = derive().results[name]
    around = {place - 1: before, place: here, place + 1: after}

    def position(index: Expression) -> Expression:
        return around.get(sp.expand(index), sp.Symbol(f"x_elsewhere_{index}"))

    def acceleration(index: Expression) -> Expression:
        if sp.expand(index - place) != 0:
            return sp.Symbol(f"a_elsewhere_{index}")
        return force - mu_d * c * S(sp.Function("dot_x")(place))

    return follows({"x": position, "ddot_x": acceleration})


def _starts(place: Expression, name: str) -> Judge:
    """Return a judge for the start condition of the slider at `place`."""
    force = derive().results[name]
    around = {place - 1: before, place: here, place + 1: after}
    own = sp.Symbol("mu_s_own", positive=True)

    def position(index: Expression) -> Expression:
        return around.get(sp.expand(index), sp.Symbol(f"x_elsewhere_{index}"))

    def coefficient(index: Expression) -> Expression:
        if sp.expand(index - place) == 0:
            return own
        return sp.Symbol(f"mu_s_elsewhere_{index}", positive=True)

    return inequality({"x": position, "mu_s": coefficient}, abs(force) - own * c)


def _total_force_starts() -> Judge:
    own = sp.Symbol("mu_s_own", positive=True)
    force = sp.expand(spring(n + 1, n) + spring(n - 1, n) + m * g * s)

    def on_slider(exerting: Expression, on: Expression) -> Expression:
        return sp.expand(spring(exerting, on))

    def coefficient(index: Expression) -> Expression:
        return own if sp.expand(index - n) == 0 else sp.Symbol("mu_s_elsewhere", positive=True)

    return inequality({"f": on_slider, "mu_s": coefficient}, abs(force) - own * m * g * c)


def _gaussian(name: str, width: Expression, centre: Expression, variable: Expression) -> Judge:
    """Return a judge for a density: normalised, with the named mean and width."""

    def judge(formula: Formula) -> bool:
        z = sp.Symbol("z", real=True)
        density = formula.right.subs({variable: z}).subs(symbol("mean_mu_s"), centre)
        if formula.relations != ("=",) or formula.left != sp.Function(name)(variable):
            return False
        # the exponent must be that of a normal law, otherwise its moments need not exist
        logarithmic = sp.simplify(sp.diff(sp.log(density), z))
        if not vanishes(logarithmic + (z - centre) / width**2):
            return False
        value = density.subs(z, centre + width * z)
        return bool(sp.simplify(sp.integrate(value * width, (z, -sp.oo, sp.oo)) - 1) == 0)

    return judge


def _transit(formula: Formula) -> bool:
    """Judge tau_dyn ~ L/c_s: right to a factor that contains neither L nor c_s."""
    # N springs of a rod of section A: k = N Y A/L, m = rho A L/N, c_s**2 = Y/rho
    Y, rho, section = symbol("Y"), symbol("rho"), sp.Symbol("section", positive=True)
    tau = sp.sqrt((rho * section * L / N) / (N * Y * section / L))
    sides = formula.bound({symbol("tau_dyn"): tau, c_s: sp.sqrt(Y / rho)}).sides
    return formula.relations == ("~",) and vanishes(sides[0] / sides[1] - 1 / N)


def check(v: Verification, results: Results) -> None:
    """Prove the equations of motion: momentum, energy, uniqueness of the scaling."""
    shift = sp.Symbol("shift")
    moved = {before: before + shift, here: here + shift, after: after + shift}
    for name in ("force_first", "force_inner", "force_last"):
        force = results[name]
        v.identity(
            f"{name} does not change in a translation", force.subs(moved, simultaneous=True) - force
        )
    v.identity("the inner force does not feel theta", sp.diff(results["force_inner"], theta))
    v.identity(
        "raising theta by d lowers the tension by l0 d", sp.diff(results["force_first"], theta) + l0
    )
    v.identity(
        "action and reaction",
        results["from_below"] + results["from_above"],
        "derivatives of one spring's energy",
    )
    mirrored = {before: -after, after: -before, here: -here, s: -s}
    v.identity(
        "mirror symmetry: x -> -x with reversed order and slope maps the inner force to its "
        "negative",
        results["force_inner"].subs(mirrored, simultaneous=True) + results["force_inner"],
    )
    v.identity(
        "... and the first slider's force to minus the last one's",
        results["force_first"].subs(mirrored, simultaneous=True) + results["force_last"],
    )
    v.verified(
        "a drawn mu_s below mu_d is rarer than 1e-23 for the captions' numbers",
        mpmath.mpf("7e-24") < below_dynamic("0.6", "0.5", "0.01") < mpmath.mpf("8e-24"),
        "floating point: Phi(-10) = 7.6e-24",
    )


def _no_units_left() -> bool:
    """Return whether the dimensionless equations contain no mass, stiffness, gravity or time."""
    return all(
        not ({m, k, g, tau_dyn, length} & derive().results[name].free_symbols)
        for name in ("force_first", "force_inner", "force_last")
    )


def below_dynamic(mu_static: object, mu_dynamic: object, width: object) -> mpmath.mpf:
    """Return the probability that a drawn static coefficient lies below the dynamical one."""
    return mpmath.ncdf(
        (mpmath.mpf(str(mu_dynamic)) - mpmath.mpf(str(mu_static))) / mpmath.mpf(str(width))
    )


ENTRIES: tuple[Entry, ...] = (
    Entry(
        "slider_mass",
        "Sec. II A",
        r"mass $m = M/N$",
        "convention",
        "definition: N equal sliders share the mass M",
        formula=r"m = M/N",
        holds=follows({m: M / N}),
    ),
    Entry(
        "thermal_expansion",
        "Sec. II A, first display",
        r"l(T) = l_0 \bigl[ 1 + \kappa (T - T_0) \bigr]",
        "convention",
        "linear expansion; it equals l_0 (1 + theta) with theta = kappa (T - T_0), which is all "
        "the "
        "model uses",
        assumptions=("|theta| << 1", "the stiffness does not depend on T"),
        holds=follows({"l": lambda at: l0 * (1 + theta).subs(theta, kappa * (at - T_0))}),
    ),
    Entry(
        "total_length",
        "Sec. II A",
        r"$L = (N-1)\,l_0$",
        "exact",
        "scaling: N sliders of zero length are joined by N - 1 springs of length l_0",
        holds=follows({L: sp.summation(l0, (n, 1, N - 1))}),
    ),
    Entry(
        "spring_force",
        "Sec. II A",
        r"f_{n+1 \to n} = - k\,\left[ x_{n} - x_{n+1} + l(T) \right]",
        "exact",
        "scaling: minus the derivative of k (x_{n+1} - x_n - l)**2/2",
        label="spring_force",
        holds=follows({"f": spring, "l": lambda at: length if at == T else sp.Symbol("no_length")}),
    ),
    Entry(
        "static_friction",
        "Sec. II A",
        r"\left| f_{n+1 \to n} + f_{n-1 \to n} + m g\,\sin\alpha \right| > "
        r"\mu_{\mathrm{s},n}\,m g\,\cos\alpha",
        "convention",
        "Coulomb's law of static friction; the force on the left is the whole non-frictional "
        "force on "
        "slider n (scaling)",
        label="static_friction",
        assumptions=("normal force m g cos(alpha)",),
        holds=_total_force_starts(),
    ),
    Entry(
        "free_end_upper",
        "Sec. II A",
        r"$f_{0 \to 1} =0$ ($n=1$)",
        "exact",
        "scaling: no spring at the ends",
        formula=r"f_{0 \to 1} =0",
        holds=follows({"f": spring}),
    ),
    Entry(
        "free_end_lower",
        "Sec. II A",
        r"$f_{N+1 \to N} =0$ ($n=N$)",
        "exact",
        "scaling: no spring at the ends",
        formula=r"f_{N+1 \to N} =0",
        holds=follows({"f": spring}),
    ),
    Entry(
        "dynamical_friction",
        "Sec. II A",
        r"f_{\mathrm{d},n} \equiv - \mu_{\mathrm{d}}\,m g\,\cos\alpha\,S(\dot x_n)",
        "convention",
        "Coulomb's law of sliding friction: constant, opposed to the velocity",
        label="dynamical_friction",
        holds=follows(
            {
                "f_d": lambda index: (
                    -mu_d * m * g * c * S(sp.Function("dot_x")(index))
                    if sp.expand(index - n) == 0
                    else sp.Symbol("elsewhere")
                ),
            }
        ),
    ),
    Entry(
        "friction_order",
        "Sec. II A",
        r"$\mu_\mathrm{d} < \mu_{\mathrm{s},n}$~$(\forall n)$",
        "convention",
        "an assumption; the Gaussian distribution of mu_s contradicts it with a small probability "
        "(entry "
        "drawn_below_dynamic)",
        formula=r"\mu_\mathrm{d} < \mu_{\mathrm{s},n}",
        holds=inequality({}, sp.Function("mu_s")(n) - mu_d),
    ),
    Entry(
        "dynamical_time",
        "Sec. II A",
        r"$\tau_\mathrm{dyn} = \sqrt{m/k}$",
        "exact",
        "scaling: with this unit of time the stiffness drops out of every equation of motion",
        holds=follows({tau_dyn: sp.solve(k - m / tau_dyn**2, tau_dyn)[0]}),
    ),
    Entry(
        "transit_time",
        "Sec. II A",
        r"$\tau_\mathrm{dyn} \sim L/c_\mathrm{s}$",
        "approximation",
        "scaling: a rod of N sliders, k = N Y S/L and m = rho S L/N, has sqrt(m/k) = L/(N c_s)",
        assumptions=("k = N Y S/L", "c_s = sqrt(Y/rho)"),
        corrected=r"\tau_\mathrm{dyn} = L/(N c_\mathrm{s})",
        corrected_formula=r"\tau_\mathrm{dyn} = L/(N c_\mathrm{s})",
        error="L/c_s is the transit time of the whole chain, N times tau_dyn; the conclusion "
        "(tau_dyn << tau_th) only gains by it",
        holds=_transit,
        holds_exactly=follows(
            {
                tau_dyn: sp.sqrt(symbol("rho") * L**2 / (N**2 * symbol("Y"))),
                c_s: sp.sqrt(symbol("Y") / symbol("rho")),
            }
        ),
    ),
    Entry(
        "dynamical_time_value",
        "Sec. II A",
        r"$\tau_\mathrm{dyn} \sim 10^{-6} - 10^{-5}$~s",
        "approximation",
        "L/c_s with L from 3 mm to 3 cm and c_s = 3 km/s: 1e-6 s to 1e-5 s",
        assumptions=("L from a few millimetres to centimetres", "c_s of a few km/s"),
        error="the estimate follows from L/c_s to a factor 1.5; sqrt(m/k) itself is N times "
        "shorter",
        formula=r"\tau_\mathrm{dyn} \sim 10^{-6}",
        holds=within(0.003 / 3000, 1.5),
    ),
    Entry(
        "dilation",
        "Sec. II B",
        r"$\theta \equiv \kappa\,(T - T_0)$",
        "convention",
        "definition: l = l_0 (1 + theta)",
        holds=follows({theta: sp.solve(l0 * (1 + theta) - l0 * (1 + kappa * (T - T_0)), theta)[0]}),
    ),
    Entry(
        "time_unit",
        "Sec. II B",
        r"$\tilde{t} \equiv t/\tau_\mathrm{dyn}$",
        "convention",
        "definition; the equations of motion in these units contain no stiffness and no mass",
        evidence=_no_units_left,
    ),
    Entry(
        "length_unit",
        "Sec. II B",
        r"$\tilde{x}\equiv x/(g\,\tau_\mathrm{dyn}^2)$",
        "convention",
        "definition; g tau_dyn**2 is the stretch of one spring by the weight of one slider",
        evidence=lambda: vanishes(g * tau_dyn**2 - (m * g / k).subs(k, m / tau_dyn**2)),
    ),
    Entry(
        "natural_length_unit",
        "Sec. II B",
        r"$\tilde{l}_0 \equiv l_0/(g\,\tau_\mathrm{dyn}^2)$",
        "convention",
        "definition, as for positions",
        evidence=_no_units_left,
    ),
    Entry(
        "dynamic_eq1",
        "Sec. II B",
        r"\ddot{\tilde{x}}_1 &=& - [\tilde{x}_1 - \tilde{x}_2 + (1 + "
        r"\theta)\,\tilde{l}_0]\nonumber\\"
        r"&&- \mu_\mathrm{d}\,S(\dot{\tilde{x}}_1)\,\cos{\alpha}  + \sin\alpha",
        "exact",
        "scaling: force on slider 1",
        label="dynamic_eq1",
        holds=_at(sp.Integer(1), "force_first"),
    ),
    Entry(
        "dynamic_eq",
        "Sec. II B",
        r"\ddot{\tilde{x}}_n &=& - [2\,\tilde{x}_n - ( \tilde{x}_{n+1} + "
        r"\tilde{x}_{n-1})]\nonumber\\"
        r"&&- \mu_\mathrm{d}\,S(\dot{\tilde{x}}_n)\,\cos{\alpha}+ \sin\alpha",
        "exact",
        "scaling: force on an inner slider",
        label="dynamic_eq",
        holds=_at(n, "force_inner"),
    ),
    Entry(
        "dynamic_eqN",
        "Sec. II B",
        r"\ddot{\tilde{x}}_N &=& - [\tilde{x}_N - \tilde{x}_{N-1} - (1 + "
        r"\theta)\,\tilde{l}_0]\nonumber\\"
        r"&&- \mu_\mathrm{d}\,S(\dot{\tilde{x}}_N)\,\cos{\alpha} + \sin\alpha",
        "exact",
        "scaling: force on slider N",
        label="dynamic_eqN",
        holds=_at(N, "force_last"),
    ),
    Entry(
        "static_eq1",
        "Sec. II B",
        r"| \tilde{x}_{2} -\tilde{x}_1 - (1 + \theta)\,\tilde{l}_0 + \sin\alpha | &>& "
        r"\mu_{\mathrm{s},1}\,\cos\alpha",
        "exact",
        "scaling: Eq. (static_friction) in dimensionless variables, slider 1",
        label="static_eq1",
        holds=_starts(sp.Integer(1), "force_first"),
    ),
    Entry(
        "static_eq",
        "Sec. II B",
        r"| \tilde{x}_{n+1} + \tilde{x}_{n-1} -2\,\tilde{x}_n + \sin\alpha | &>& "
        r"\mu_{\mathrm{s},n}\,\cos\alpha",
        "exact",
        "scaling: Eq. (static_friction) in dimensionless variables, inner slider",
        label="static_eq",
        holds=_starts(n, "force_inner"),
    ),
    Entry(
        "static_eqN",
        "Sec. II B",
        r"| \tilde{x}_{N-1} -\tilde{x}_N + (1 + \theta)\,\tilde{l}_0 + \sin\alpha | &>& "
        r"\mu_{\mathrm{s},N}\,\cos\alpha",
        "exact",
        "scaling: Eq. (static_friction) in dimensionless variables, slider N",
        label="static_eqN",
        holds=_starts(N, "force_last"),
    ),
    Entry(
        "dist_mud",
        "Sec. II B",
        r"p(\mu_\mathrm{s}) = \frac{1}{\sqrt{2\pi\sigma_\mu^2}} \exp\left[-\frac{( \mu_\mathrm{s} "
        r"- "
        r"\overline{\mu}_\mathrm{s})^2}{2 \sigma_\mu^2}\right]",
        "convention",
        "a choice; it is a normalised density of mean mu_s and width sigma_mu",
        label="dist_mud",
        holds=_gaussian("p", sigma_mu, sp.Symbol("centre", real=True), mu_s),
    ),
    Entry(
        "drawn_below_dynamic",
        "Sec. II B",
        r"$\sigma_\mu \ll (\overline{\mu}_\mathrm{s}-\mu_\mathrm{d})$",
        "approximation",
        "the probability of mu_s < mu_d is Phi(-(mean mu_s - mu_d)/sigma_mu), 7.6e-24 for the "
        "captions' "
        "numbers",
        error="Phi(-(mu_s - mu_d)/sigma_mu): below 1e-3 if sigma_mu < (mu_s - mu_d)/3.1",
        holds=lambda formula: (
            formula.relations == ("<<",) and formula.bound({}).sides == (sigma_mu, mu_s - mu_d)
        ),
    ),
    Entry(
        "dist_theta",
        "Sec. II B",
        r"\psi(\theta) = \frac{1}{\sqrt{2\pi\sigma_\theta^2}} \exp\left[-\frac{\theta^2}"
        r"{2 \sigma_\theta^2}\right]",
        "convention",
        "a choice; it is a normalised density of mean 0 and width sigma_theta",
        label="dist_theta",
        holds=_gaussian("psi", sigma_theta, sp.Integer(0), theta),
    ),
    Entry(
        "random_dilation_width",
        "Sec. II B",
        r"$\sigma_{\theta} \sim \kappa\,\Delta T$",
        "convention",
        "theta = kappa (T - T_0) is linear, so widths are proportional",
        holds=follows({sigma_theta: kappa * symbol("Delta_T")}),
    ),
    Entry(
        "timesteps",
        "Sec. II B",
        r"$t_q \equiv q\,\tau_\mathrm{th}$",
        "convention",
        "definition of the targets' times; a cycle takes two of them",
        holds=follows({symbol("t_q"): symbol("q") * symbol("tau_th")}),
    ),
    Entry(
        "centre_of_mass",
        "Sec. III A",
        r"$\tilde{x}_G \equiv \frac{1}{N}\,\sum_{n=1}^N \tilde{x}_n$ (here $N=2$)",
        "convention",
        "definition: the centre of mass of equal sliders",
        proved=False,
    ),
)
