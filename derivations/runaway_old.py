"""That a chain can slide for ever only on slopes of mu_d or more, and what proves that it does."""

from __future__ import annotations

from fractions import Fraction
from random import Random

import sympy as sp

from derivations.notation import Formula, alpha, c, mu_d, s, slope_margin, symbol
from derivations.proof import Derivation, Entry, Judge, Results, Step, Verification, follows

p = symbol("p")
speed = sp.Symbol("speed", nonnegative=True)
first, rate = sp.symbols("start rate", positive=True)


def derive() -> Derivation:
    """Return the mean acceleration of a chain that moves as a whole, and the critical slope."""
    direction = sp.Symbol("S")
    mean = s - mu_d * c * direction  # springs cancel in the sum over the chain
    critical = sp.solve((mean.subs(direction, 1) / c).subs(s, c * symbol("t")), symbol("t"))[0]
    time = sp.Symbol("time", positive=True)
    own, other = sp.Integer(1) - 1 / p, -1 / p  # of a unit vector less its mean
    results = {
        "mean_acceleration": mean.subs(direction, 1),
        "critical_slope": critical,
        "own": own,
        "other": other,
        "certificate": sp.sqrt((1 - 1 / p) * 2 * sp.Symbol("J", positive=True)),
        "power": sp.expand(direction * speed * s - mu_d * c * speed),
        "shortest": sp.integrate(first * time - rate * time**2 / 2, (time, 0, 2 * first / rate)),
    }
    steps = (
        Step("sum of the equations of motion over a chain that moves as a whole, per slider", mean),
        Step("downhill", results["mean_acceleration"]),
        Step("it vanishes at tan(alpha)", critical),
        Step("no slider stops while the mean velocity exceeds", results["certificate"]),
        Step("power of weight and friction on a slider that moves as S says", results["power"]),
        Step("least path of a slip by its first acceleration and B", results["shortest"]),
    )
    return Derivation(
        "Runaway", steps, results, ("all sliders move downhill", "constant mu_d", "theta frozen")
    )


def check(v: Verification, r: Results) -> None:
    """Prove the critical slope, the dissipation bound and the certificate of a runaway."""
    v.identity(
        "the chain's mean acceleration downhill is -m", r["mean_acceleration"] + slope_margin
    )
    v.identity("it vanishes at tan(alpha) = mu_d", r["critical_slope"] - mu_d)
    own, other, J = r["own"], r["other"], sp.Symbol("J", positive=True)
    v.identity(
        "the projection of a unit vector on the internal motions has the square 1 - 1/p",
        own**2 + (p - 1) * other**2 - (1 - 1 / p),
        "own component once, the others p - 1 times; Cauchy-Schwarz then gives "
        "|w_n| <= sqrt((1 - 1/p) 2J)",
    )
    v.identity(
        "the certificate's mean velocity is the largest that an internal motion can take from v_n",
        r["certificate"] ** 2 - (own**2 + (p - 1) * other**2) * 2 * J,
        "v_n = mean + w_n, w orthogonal to (1, ..., 1), |w|**2 <= 2 J",
    )
    beyond = sp.Symbol("beyond", nonnegative=True)
    v.proved(
        "the mean velocity never falls for tan(alpha) >= mu_d",
        sp.expand(r["mean_acceleration"].subs(s, mu_d * c + beyond)).is_nonnegative,
        "its rate is s - mu_d c",
    )
    v.argued(
        "a mean velocity above sqrt((1 - 1/N) 2J) at tan(alpha) >= mu_d: no slider ever stops",
        "every v_n >= mean - sqrt((1 - 1/N) 2J) > 0 by the three claims above; J is conserved "
        "while all move (modes)",
    )
    v.verified(
        "|w_n|**2 <= (1 - 1/p)|w|**2 for motions without a mean", _spread(), "300 rational vectors"
    )
    for direction, way in ((1, "down"), (-1, "up")):
        power = r["power"].subs(sp.Symbol("S"), direction)
        v.identity(
            f"power of weight and friction on a slider moving {way}hill "
            "is at most -(mu_d c - s)|v| for s >= 0",
            power + slope_margin * speed - (direction - 1) * s * speed,
            "the difference (direction - 1) s |v| is never positive",
        )
    v.argued(
        "for 0 <= tan(alpha) < mu_d the path lengths of an avalanche sum up to at most E_elastic/m",
        "the power above, integrated over an avalanche that begins at rest: the energy is not "
        "below zero and loses at least m per unit of path",
    )
    v.identity(
        "a slip whose first acceleration is a is longer than (2/3) a**3/B**2, B a bound of |a'|",
        r["shortest"] - sp.Rational(2, 3) * first**3 / rate**2,
        "v >= a t - B t**2/2 up to its zero",
    )
    v.argued(
        "an avalanche ends if every mu_s exceeds mu_d by a minimum and 0 <= tan(alpha) < mu_d",
        "finite path, and a least path of every slip, by the claims above",
    )


def _spread() -> bool:
    """Return whether no component of random vectors without a mean exceeds its bound."""
    random = Random(11)
    for _ in range(300):
        size = random.randint(2, 9)
        raw = [Fraction(random.randint(-99, 99), random.randint(1, 9)) for _ in range(size)]
        mean = sum(raw) / size
        vector = [value - mean for value in raw]
        square = sum(value * value for value in vector)
        if max(value * value for value in vector) > (1 - Fraction(1, size)) * square:
            return False
    return True


def _critical(formula: Formula) -> bool:
    """Judge a statement of the critical slope, as a tangent or as an angle."""
    if len(formula.sides) == 1:
        return bool(sp.simplify(sp.tan(formula.left) - derive().results["critical_slope"]) == 0)
    return follows({symbol("alpha_c"): sp.atan(derive().results["critical_slope"])})(
        Formula(tuple(side.subs(symbol("mu_d"), mu_d) for side in formula.sides), formula.relations)
    )


def _accelerates() -> Judge:
    """Return a judge for `alpha > alpha_c = arctan(mu_d)`."""

    def judge(formula: Formula) -> bool:
        if formula.relations != (">", "="):
            return False
        if formula.sides[:2] != (alpha, symbol("alpha_c")):
            return False
        return bool(sp.simplify(sp.tan(formula.right) - derive().results["critical_slope"]) == 0)

    return judge


ENTRIES: tuple[Entry, ...] = (
    Entry(
        "alpha_c",
        "Sec. III A 1",
        r"$\tan(\alpha_\mathrm{c}) \equiv \mu_\mathrm{d}$",
        "exact",
        "runaway: the mean acceleration of a chain sliding downhill is s - mu_d c",
        assumptions=("the chain moves as a whole; at rest it holds on up to the mean of mu_s",),
        holds=_critical,
    ),
    Entry(
        "accelerates_above",
        "Sec. III A 2",
        r"$\alpha>\alpha_\mathrm{c}=\arctan(\mu_d)$",
        "exact",
        "runaway: s - mu_d c > 0 exactly for tan(alpha) > mu_d; at equality the mean velocity is "
        "constant",
        assumptions=("the system slides as a whole",),
        holds=_accelerates(),
    ),
)
