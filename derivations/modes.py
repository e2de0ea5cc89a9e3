"""Modes of a run: p moving sliders between ends that are fixed or free.

A run obeys ``x'' = -K x + f`` with constant f; K has 2 on its diagonal (1 at a free end) and -1
beside it. Everything the event finder relies on is proved here for symbolic p.
"""

from __future__ import annotations

from fractions import Fraction
from math import comb, factorial
from typing import Any, NamedTuple

import sympy as sp

from derivations.notation import Expression, Formula, symbol
from derivations.proof import Derivation, Entry, Results, Step, Verification

p, n, q = symbol("p"), symbol("n"), symbol("q")
phi = sp.Symbol("phi", positive=True)
row, column = sp.symbols("r s", integer=True, positive=True)


class Ends(NamedTuple):
    """The closed forms of one kind of run.

    Attributes
    ----------
    left, right : str
        ``fixed`` or ``free``.
    angle : Expression
        phi_q; the frequency is 2 sin(phi_q/2).
    shape : Expression
        The eigenvector's n-th component at angle phi, before normalisation.
    square : Expression
        The sum of its squares.
    period, reflection : Expression
        Its images on the infinite lattice (see `image_sum`).
    first : int
        The first q.
    """

    left: str
    right: str
    angle: Expression
    shape: Expression
    square: Expression
    period: Expression
    reflection: Expression
    first: int


KINDS: tuple[Ends, ...] = (
    Ends(
        "fixed", "fixed", q * sp.pi / (p + 1), sp.sin(n * phi), (p + 1) / 2, 2 * (p + 1), 2 * n, 1
    ),
    Ends(
        "free",
        "fixed",
        (2 * q - 1) * sp.pi / (2 * p + 1),
        sp.cos((n - sp.Rational(1, 2)) * phi),
        (2 * p + 1) / sp.Integer(4),
        2 * p + 1,
        2 * n - 1,
        1,
    ),
    Ends(
        "fixed",
        "free",
        (2 * q - 1) * sp.pi / (2 * p + 1),
        sp.sin(n * phi),
        (2 * p + 1) / sp.Integer(4),
        2 * p + 1,
        2 * n,
        1,
    ),
    Ends(
        "free",
        "free",
        q * sp.pi / p,
        sp.cos((n - sp.Rational(1, 2)) * phi),
        p / 2,
        2 * p,
        2 * n - 1,
        0,
    ),
)


def trigonometric(expression: Expression) -> bool:
    """Return whether a combination of sines and cosines vanishes: by expansion in exponentials."""
    return bool(sp.simplify(sp.expand(expression.rewrite(sp.exp), power_exp=True)) == 0) or bool(
        sp.simplify(sp.expand_trig(expression)) == 0
    )


def green(left: str, right: str, r: Expression, s: Expression) -> Expression:
    """Return (K^-1)_rs for r <= s; free-free: the inverse on motions without a mean."""
    if (left, right) == ("fixed", "fixed"):
        return r * (p + 1 - s) / (p + 1)
    if (left, right) == ("free", "fixed"):
        return p + 1 - s
    if (left, right) == ("fixed", "free"):
        return r
    return (r * (r - 1) + s * (s - 1)) / (2 * p) - s + (p + 1) * (2 * p + 1) / (6 * p)


def stiffness(left: str, right: str, size: int) -> list[list[int]]:
    """Return the matrix K of a run of `size` sliders."""
    matrix = [[0] * size for _ in range(size)]
    for k in range(size):
        matrix[k][k] = 2 - (k == 0 and left == "free") - (k == size - 1 and right == "free")
        if k + 1 < size:
            matrix[k][k + 1] = matrix[k + 1][k] = -1
    return matrix


def image_sum(period: int, reflection: int, power: int) -> int:
    """Return (K^power)_nn as a sum over images.

    On the infinite lattice ``(K^k)_(n, n+d) = (-1)**d binomial(2k, k + d)``; an end reflects with
    the sign +1 (free) or -1 (fixed), and in all four cases the signs combine to ``sum over j of
    b(period j) - b(reflection + period j)``, ``b(d) = binomial(2k, k + d)``.
    """

    def b(distance: int) -> int:
        return comb(2 * power, power + distance) if abs(distance) <= power else 0

    reach = power // period + 2
    return sum(b(period * j) - b(reflection + period * j) for j in range(-reach, reach + 1))


def derive() -> Derivation:
    """Return frequency, eigenvectors and inverse of K for the four kinds of ends."""
    shape = sp.sin(n * phi)
    shifted = -shape.subs(n, n - 1) + 2 * shape - shape.subs(n, n + 1)
    results: dict[str, Any] = {"frequency": 2 * sp.sin(phi / 2)}
    steps = [
        Step("K applied to sin(n phi)", shifted),
        Step("... is the square of the frequency times it", results["frequency"] ** 2),
    ]
    for kind in KINDS:
        name = f"{kind.left}-{kind.right}"
        results[f"angle {name}"] = kind.angle
        results[f"shape {name}"] = kind.shape / sp.sqrt(kind.square)
        results[f"inverse {name}"] = green(kind.left, kind.right, row, column)
        steps += [
            Step(f"{name}: angles", kind.angle),
            Step(f"{name}: normalised eigenvector", results[f"shape {name}"]),
            Step(f"{name}: inverse, row r <= column s", results[f"inverse {name}"]),
        ]
    steps.append(
        Step(
            "any derivative: |v_n^(k)| <= sqrt((K^k)_nn 2J)",
            sp.sqrt(sp.binomial(2 * q, q) * 2 * symbol("J")),
        )
    )
    return Derivation(
        "Modes of a run",
        tuple(steps),
        results,
        ("theta frozen during a rearrangement", "no start, stop or reversal inside"),
    )


def _check_eigenpairs(v: Verification) -> None:
    for kind in KINDS:
        name, shape = f"{kind.left}-{kind.right}", kind.shape
        bulk = (
            -shape.subs(n, n - 1)
            + 2 * shape
            - shape.subs(n, n + 1)
            - 4 * sp.sin(phi / 2) ** 2 * shape
        )
        v.proved(
            f"{name}: eigenvalue 4 sin(phi/2)**2 inside",
            trigonometric(bulk),
            "trigonometric identity",
        )
        first = shape.subs(n, 0) if kind.left == "fixed" else shape.subs(n, 1) - shape.subs(n, 0)
        v.proved(f"{name}: the left end", trigonometric(first), "v_0 = 0 (fixed), v_0 = v_1 (free)")
        # The right end factorises; the angle makes the factor vanish.
        if kind.right == "fixed":
            residue = shape.subs(n, p + 1)
        else:
            residue = shape.subs(n, p + 1) - shape.subs(n, p)
            factor = 2 * sp.sin(phi / 2)
            product = (
                -factor * sp.sin(p * phi)
                if kind.left == "free"
                else factor * sp.cos((p + sp.Rational(1, 2)) * phi)
            )
            v.proved(
                f"{name}: the right end factorises",
                trigonometric(residue - product),
                "sum to product",
            )
            residue = product
        at_angle = sp.simplify(residue.subs(phi, kind.angle))
        v.identity(
            f"{name}: the right end at phi_q", at_angle, "sine at k pi, cosine at (2k - 1) pi/2"
        )
        last = p - 1 if kind.first == 0 else p
        spread = sp.pi - kind.angle.subs(q, last)
        v.proved(
            f"{name}: p different angles in [0, pi)",
            sp.simplify(sp.diff(kind.angle, q)).is_positive is True
            and (sp.simplify(spread).is_positive or sp.simplify(spread * (2 * p + 2)).is_positive)
            is True,
            "phi_q grows with q and phi_last < pi: the eigenvalues differ, so eigenvectors are "
            "orthogonal "
            "and complete",
        )


def _check_norms(v: Verification) -> None:
    v.proved(
        "telescoping: 2 sin(phi) cos(2n phi) = sin((2n+1) phi) - sin((2n-1) phi)",
        trigonometric(
            2 * sp.sin(phi) * sp.cos(2 * n * phi)
            - sp.sin((2 * n + 1) * phi)
            + sp.sin((2 * n - 1) * phi)
        ),
        "product to sum",
    )
    v.proved(
        "telescoping: 2 sin(phi) cos((2n-1) phi) = sin(2n phi) - sin((2n-2) phi)",
        trigonometric(
            2 * sp.sin(phi) * sp.cos((2 * n - 1) * phi)
            - sp.sin(2 * n * phi)
            + sp.sin((2 * n - 2) * phi)
        ),
        "product to sum",
    )
    for kind in KINDS:
        name = f"{kind.left}-{kind.right}"
        # sum of squares = p/2 -+ (telescoped sum of cosines)/2
        if kind.left == "fixed":
            total = p / 2 - (sp.sin((2 * p + 1) * phi) - sp.sin(phi)) / (4 * sp.sin(phi))
        else:
            total = p / 2 + sp.sin(2 * p * phi) / (4 * sp.sin(phi))
        # (2p + 1) phi = (2q - 1) pi, (p + 1) phi = q pi or p phi = q pi: reduce the multiple
        if name == "fixed-fixed":
            reduced = total.subs(sp.sin((2 * p + 1) * phi), sp.sin(2 * q * sp.pi - phi))
            consistent = sp.expand((2 * p + 1) * kind.angle - 2 * q * sp.pi + kind.angle)
        elif name == "free-fixed":
            reduced = total.subs(sp.sin(2 * p * phi), sp.sin((2 * q - 1) * sp.pi - phi))
            consistent = sp.expand(2 * p * kind.angle - (2 * q - 1) * sp.pi + kind.angle)
        elif name == "fixed-free":
            reduced = total.subs(sp.sin((2 * p + 1) * phi), sp.sin((2 * q - 1) * sp.pi))
            consistent = sp.expand((2 * p + 1) * kind.angle - (2 * q - 1) * sp.pi)
        else:
            reduced = total.subs(sp.sin(2 * p * phi), sp.sin(2 * q * sp.pi))
            consistent = sp.expand(2 * p * kind.angle - 2 * q * sp.pi)
        v.identity(f"{name}: the multiple angle", sp.simplify(consistent), "definition of phi_q")
        v.identity(f"{name}: sum of squares", sp.simplify(reduced - kind.square), "telescoped sum")
    v.identity("free-free, q = 0: the sum of squares of 1/sqrt(p)", p * (1 / sp.sqrt(p)) ** 2 - 1)


def _check_inverse(v: Verification) -> None:
    for kind in KINDS:
        left, right = kind.left, kind.right
        name = f"{left}-{right}"
        mean = 1 / p if name == "free-free" else sp.Integer(0)

        def above(r: Expression, left: str = left, right: str = right) -> Expression:
            return green(left, right, r, column)

        def below(r: Expression, left: str = left, right: str = right) -> Expression:
            return green(left, right, column, r)

        v.identity(
            f"{name}: K G = 0 above the diagonal",
            -above(row - 1) + 2 * above(row) - above(row + 1) + mean,
        )
        v.identity(
            f"{name}: K G = 0 below the diagonal",
            -below(row - 1) + 2 * below(row) - below(row + 1) + mean,
        )
        v.identity(
            f"{name}: K G = 1 on the diagonal",
            -above(column - 1) + 2 * above(column) - below(column + 1) - 1 + mean,
        )
        first = (
            above(sp.Integer(0)) if left == "fixed" else above(sp.Integer(1)) - above(sp.Integer(0))
        )
        last = below(p + 1) if right == "fixed" else below(p + 1) - below(p)
        v.identity(f"{name}: the ends of G", sp.Abs(sp.expand(first)) + sp.Abs(sp.cancel(last)))
        if name == "free-free":
            total = sp.summation(above(row), (row, 1, column)) + sp.summation(
                below(row), (row, column + 1, p)
            )
            v.identity("free-free: G annihilates the mean", sp.simplify(total))


def _check_energy(v: Verification) -> None:
    frequency, size, phase, t = sp.symbols("omega size phase t", positive=True)
    velocity = size * sp.sin(frequency * t + phase)
    acceleration = sp.diff(velocity, t)
    energy = velocity**2 + acceleration**2 / frequency**2
    v.identity("each mode conserves v**2 + a**2/omega**2", sp.simplify(sp.diff(energy, t)))
    v.identity("... which is the square of its amplitude", sp.simplify(energy - size**2))
    order = sp.Symbol("order", integer=True, nonnegative=True)

    def derivative(power: Expression) -> Expression:
        return frequency**power * size * sp.sin(frequency * t + phase + power * sp.pi / 2)

    v.identity("the velocity is its own derivative of order 0", derivative(0) - velocity)
    v.identity(
        "|v_n^(k)(t)| <= sqrt((K^k)_nn 2J)",
        sp.simplify(sp.expand_trig(sp.diff(derivative(order), t) - derivative(order + 1))),
        "by induction a derivative multiplies a mode by omega and turns its phase; Cauchy-Schwarz "
        "over the "
        "modes with sum of omega**(2k) e_qn**2 = (K^k)_nn; a zero mode drops out for k >= 2, and "
        "adds the "
        "mean's motion for k = 0, 1",
    )
    k, d = sp.symbols("k d", integer=True, positive=True)

    def b(power: Expression, distance: Expression) -> Expression:
        return sp.binomial(2 * power, power + distance)

    pascal = 2 * b(k, d) + b(k, d - 1) + b(k, d + 1) - b(k + 1, d)
    v.identity(
        "(K^k) on the infinite lattice is (-1)**d binomial(2k, k+d)",
        sp.combsimp(pascal.rewrite(sp.gamma)) if pascal != 0 else pascal,
        "Pascal's rule, twice: K^(k+1) = K K^k",
    )
    for kind in KINDS:
        # reflections at the two ends compose to a translation by the period
        left_at = 0 if kind.left == "fixed" else sp.Rational(1, 2)
        right_at = p + 1 if kind.right == "fixed" else p + sp.Rational(1, 2)
        v.identity(
            f"{kind.left}-{kind.right}: images repeat with {kind.period}, "
            f"the first at distance {kind.reflection}",
            abs(2 * (right_at - left_at) - kind.period)
            + abs(sp.expand(2 * (n - left_at) - kind.reflection)),
            "reflection at 0 or p+1 (fixed, odd), at 1/2 or p+1/2 (free, even)",
        )
        signs = {"fixed": -1, "free": 1}
        turn = signs[kind.left] * signs[kind.right]
        parity = 1 if name_parity(kind) else -1
        bounce = signs[kind.left] * (1 if kind.left == "fixed" else -1)
        v.proved(
            f"{kind.left}-{kind.right}: translated images enter with +, reflected ones with -",
            turn * parity == 1 and bounce == -1,
            "sign of the reflections times (-1)**distance",
        )
    v.proved(
        "(K^k)_nn <= binomial(2k, k)",
        _paired(),
        "b falls with |d|: each translated image b(period j), j >= 1, is outweighed by the "
        "reflected one "
        "before it, and likewise to the other side, so no more than b(0) remains",
    )
    worst = all(
        _diagonal(stiffness(kind.left, kind.right, size), power)
        == [
            image_sum(int(kind.period.subs(p, size)), int(kind.reflection.subs(n, place)), power)
            for place in range(1, size + 1)
        ]
        and max(_diagonal(stiffness(kind.left, kind.right, size), power)) <= comb(2 * power, power)
        for kind in KINDS
        for size in range(1, 8)
        for power in range(9)
    )
    v.verified("image sums and bound", worst, "integers: p = 1..7, k = 0..8, four kinds of ends")


def name_parity(kind: Ends) -> bool:
    """Return whether the period of a kind is even for every p."""
    return bool(sp.expand(kind.period / 2).is_integer)


def _paired() -> bool:
    """Return whether every translated image has its own nearer reflected image, for all ends."""
    step = sp.Symbol("step", integer=True, positive=True)
    for kind in KINDS:
        # 0 < reflection < period for every n in 1..p
        if (kind.reflection).subs(n, 1) <= 0:
            return False
        room = sp.expand(kind.period - kind.reflection.subs(n, p))
        if not room.is_positive:
            return False
        # to the right: period step - (reflection + period (step - 1)) = period - reflection > 0
        nearer = sp.expand(kind.period * step - (kind.reflection + kind.period * (step - 1)))
        if sp.expand(nearer - (kind.period - kind.reflection)) != 0:
            return False
        # to the left: |reflection - period step| = period step - reflection < period step
    return True


def _diagonal(matrix: list[list[int]], power: int) -> list[int]:
    size = len(matrix)
    result = [[int(r == c) for c in range(size)] for r in range(size)]
    for _ in range(power):
        result = [
            [sum(result[r][k] * matrix[k][c] for k in range(size)) for c in range(size)]
            for r in range(size)
        ]
    return [result[r][r] for r in range(size)]


def _check_event_free_times(v: Verification) -> None:
    u, A, B, g, d = sp.symbols("u A B g d", positive=True)
    moving = (A + sp.sqrt(A**2 + 2 * u * B)) / B
    v.identity(
        "a moving slider cannot stop before (A + sqrt(A**2 + 2uB))/B",
        u + A * moving - B * moving**2 / 2,
        "zero of the lower bound u + A t - B t**2/2 of its speed, B a bound of |v''|: k = 2",
    )
    resting = (-d + sp.sqrt(d**2 + 2 * g * B)) / B
    v.identity(
        "a resting slider cannot start before (-d + sqrt(d**2 + 2gB))/B",
        g - d * resting - B * resting**2 / 2,
        "zero of the lower bound g - d t - B t**2/2 of its margin",
    )
    v.proved(
        "... with B = sqrt(2) (sqrt(2 J_left) + sqrt(2 J_right))",
        max(max(_diagonal(stiffness(kind.left, kind.right, 6), 1)) for kind in KINDS)
        == 2
        == comb(2, 1),
        "its force's second derivative is the sum of its neighbours' accelerations, k = 1",
    )


def check(v: Verification, _: Results) -> None:
    """Prove eigenpairs, norms, inverses, the conserved energy and the derivative bounds."""
    _check_eigenpairs(v)
    _check_norms(v)
    _check_inverse(v)
    _check_energy(v)
    _check_event_free_times(v)
    v.verified(
        "an event changes a slider at distance d by at most 2 h**(2d+2)/(2d+2)! (1 + small) per "
        "unit of "
        "changed acceleration, within the time h",
        _influence(),
        "rationals: p = 1..7, h = 1/2 and 1; in general cos(sqrt(K) u) = J_0(2u) + 2 sum of "
        "J_2k(2u) T_k(1 - K/2), T_k reaches no further than k, and |J_2k(2u)| <= u**(2k)/(2k)!",
    )
    exact = all(
        [
            sum(
                stiffness(kind.left, kind.right, size)[a][e] * _green_number(kind, size, e, b)
                for e in range(size)
            )
            for a in range(size)
            for b in range(size)
        ]
        == [
            Fraction(int(a == b)) - (Fraction(1, size) if kind.left == kind.right == "free" else 0)
            for a in range(size)
            for b in range(size)
        ]
        for kind in KINDS
        for size in range(1, 9)
    )
    v.verified("K times its inverse", exact, "rationals: p = 1..8, four kinds of ends")


def _influence() -> bool:
    """Return whether the response to a jump of an acceleration obeys its bound."""
    for kind in KINDS:
        for size in range(1, 8):
            matrix = stiffness(kind.left, kind.right, size)
            for h in (Fraction(1, 2), Fraction(1)):
                power = [[Fraction(int(a == b)) for b in range(size)] for a in range(size)]
                response = [[Fraction(0)] * size for _ in range(size)]
                weight = h * h / 2
                for order in range(14):
                    for a in range(size):
                        for b in range(size):
                            response[a][b] += weight * power[a][b]
                    power = [
                        [
                            sum((power[a][e] * matrix[e][b] for e in range(size)), Fraction(0))
                            for b in range(size)
                        ]
                        for a in range(size)
                    ]
                    weight *= -h * h / ((2 * order + 3) * (2 * order + 4))
                for a in range(size):
                    for b in range(size):
                        d = abs(a - b)
                        leading = h ** (2 * d + 2) / factorial(2 * d + 2)
                        tail = 1 / (1 - h * h / ((2 * d + 3) * (2 * d + 4)))
                        if abs(response[a][b]) > 2 * leading * tail:
                            return False
    return True


def _green_number(kind: Ends, size: int, a: int, b: int) -> Fraction:
    low, high = min(a, b) + 1, max(a, b) + 1
    value = sp.Rational(
        green(kind.left, kind.right, sp.Integer(low), sp.Integer(high)).subs(p, size)
    )
    return Fraction(int(value.p), int(value.q))


def _stable_step(formula: Formula) -> bool:
    """Judge `Delta t << tau_dyn`: velocity Verlet is stable below 2/omega_max = tau_dyn."""
    step, frequency = sp.symbols("step omega", positive=True)
    # one Verlet step maps (x, v) with trace 2 - (omega step)**2 and determinant 1
    trace = 2 - (frequency * step) ** 2
    limit = next(root for root in sp.solve(trace + 2, step) if root.is_positive).subs(frequency, 2)
    sides = formula.bound({}).sides
    return formula.relations == ("<<",) and bool(
        sides == (symbol("Delta_t"), limit * symbol("tau_dyn"))
    )


ENTRIES: tuple[Entry, ...] = (
    Entry(
        "integration_step",
        "Sec. II C",
        r"$\Delta t\ll\tau_\mathrm{dyn}$",
        "approximation",
        "modes: all frequencies are below 2/tau_dyn, so velocity Verlet is stable for Delta t < "
        "tau_dyn",
        error="second order in Delta t inside a phase, first order where starts and stops are "
        "found only at "
        "the end of a step",
        holds=_stable_step,
    ),
)
