"""Modes of a run: p moving sliders between ends that are fixed or free.

A run obeys ``x'' = -K x + f`` with constant f; K has 2 on its diagonal (1 at a free end) and -1
beside it. Everything the event finder relies on is derived here for all p.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from math import comb, factorial
from typing import NamedTuple

import sympy as sp

from derivations.entry import Backed, Lines, entries_of
from derivations.judges import Judge, vanishes
from derivations.model import Model, after, before, here, solved
from derivations.notation import Expression, Formula, symbol
from derivations.proof import Proof, chapter

p, n, q = symbol("p"), symbol("n"), symbol("q")
phi = sp.Symbol("phi", positive=True)
row, column, k, d = sp.symbols("r s k d", integer=True, positive=True)
J, frequency, size, phase, t = sp.symbols("J omega size phase t", positive=True)
HALF = sp.Rational(1, 2)


class Ends(NamedTuple):
    """The closed forms of one kind of run.

    Attributes
    ----------
    left, right : str
        ``fixed`` or ``free``.
    turn : Expression
        p phi_q, by which the right end is where it must be.
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
    turn: Expression
    angle: Expression
    shape: Expression
    square: Expression
    period: Expression
    reflection: Expression
    first: int

    @property
    def name(self) -> str:
        return f"{self.left}-{self.right}"


_SINE, _COSINE = sp.sin(n * phi), sp.cos((n - HALF) * phi)
_ODD = ((2 * q - 1) * sp.pi - phi) / 2, (2 * q - 1) * sp.pi / (2 * p + 1)
KINDS: tuple[Ends, ...] = (
    Ends(
        "fixed",
        "fixed",
        q * sp.pi - phi,
        q * sp.pi / (p + 1),
        _SINE,
        (p + 1) / 2,
        2 * (p + 1),
        2 * n,
        1,
    ),
    Ends("free", "fixed", *_ODD, _COSINE, (2 * p + 1) / 4, 2 * p + 1, 2 * n - 1, 1),
    Ends("fixed", "free", *_ODD, _SINE, (2 * p + 1) / 4, 2 * p + 1, 2 * n, 1),
    Ends("free", "free", q * sp.pi, q * sp.pi / p, _COSINE, p / 2, 2 * p, 2 * n - 1, 0),
)


def trigonometric(expression: Expression) -> bool:
    """Return whether a combination of sines and cosines vanishes: by expansion in exponentials."""
    return bool(sp.expand(sp.expand(expression).rewrite(sp.exp)) == 0) or vanishes(
        sp.expand_trig(sp.expand(expression))
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
    for a in range(size):
        matrix[a][a] = 2 - (a == 0 and left == "free") - (a == size - 1 and right == "free")
        if a + 1 < size:
            matrix[a][a + 1] = matrix[a + 1][a] = -1
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


@chapter(
    "Modes of a run", "theta frozen during a rearrangement", "no start, stop or reversal inside"
)
def derive(proof: Proof, model: Model) -> None:
    """Show eigenpairs, norms, inverses, the conserved energy and what bounds derivatives."""
    diagonal = {name: -sp.diff(model.at(name), here) for name in ("first", "inner", "last")}
    proof.show("K: a slider's own displacement, minus its force", diagonal["inner"], 2, "inner")
    proof.show("... of a slider at a free end above", diagonal["first"], 1, "first")
    proof.show("... and below", diagonal["last"], 1)
    beside = [-sp.diff(model.at("inner"), at) for at in (before, after)]
    proof.show("a neighbour's displacement, from above", beside[0], -1, "above")
    proof.show("... and from below", beside[1], -1, "below")

    def applied(shape: Expression) -> Expression:
        """Return K, inside a run, applied to a shape."""
        return (
            beside[0] * shape.subs(n, n - 1)
            + diagonal["inner"] * shape
            + beside[1] * shape.subs(n, n + 1)
        )

    for kind in KINDS:
        _eigenvectors(proof, kind, applied(kind.shape), diagonal)
        _inverse(proof, kind)
    _energy(proof, diagonal["inner"])
    for kind in KINDS:
        _images(proof, kind)
    proof.checked(
        "image sums are (K^k)_nn, at most binomial(2k, k)",
        _image_sums,
        "integers: p = 1..6, k = 0..6, four kinds of ends",
    )
    proof.checked(
        "an event changes a slider at distance d by at most 2 h**(2d+2)/(2d+2)! (1 + "
        "small) per unit of changed acceleration, within the time h",
        _influence,
        "rationals: p = 1..5, h = 1; in general cos(sqrt(K) u) = J_0(2u) + 2 sum of "
        "J_2k(2u) T_k(1 - K/2), T_k reaches no further than k",
    )


def _eigenvectors(
    proof: Proof, kind: Ends, applied: Expression, diagonal: dict[str, Expression]
) -> None:
    """Show angles and eigenvectors: inside, at both ends, how many there are, and their norm."""
    name, shape = kind.name, kind.shape
    proof.proved(
        f"{name}: K v = omega**2 v inside a run, omega = 2 sin(phi/2)",
        lambda: trigonometric(applied - 4 * sp.sin(phi / 2) ** 2 * shape),
        "addition theorem",
    )

    def beyond(end: str, place: Expression, inner: Expression) -> Expression:
        """Return what must vanish beyond an end: v (fixed), or its difference (free)."""
        free = diagonal["inner"] - diagonal["first" if end == "left" else "last"]
        kept = free if getattr(kind, end) == "free" else 0
        return shape.subs(n, place) - kept * shape.subs(n, inner)

    proof.proved(
        f"{name}: the left end",
        lambda: trigonometric(beyond("left", sp.Integer(0), sp.Integer(1))),
        "v_0 = 0 (fixed), v_0 = v_1 (free)",
    )
    last = sp.expand(beyond("right", p + 1, p).subs(p, kind.turn / phi))
    proof.proved(f"{name}: the right end, p phi = {kind.turn}", lambda: trigonometric(last), "same")
    proof.show(f"{name}: so phi_q =", solved(p * phi - kind.turn, phi), kind.angle)
    ends = kind.angle.subs(q, p - 1 if kind.first == 0 else p), kind.angle.subs(q, kind.first)
    proof.proved(
        f"{name}: p different angles in [0, pi): eigenvectors are orthogonal and complete",
        lambda: (
            sp.diff(kind.angle, q).is_positive
            and ends[1].is_nonnegative
            and sp.factor((sp.pi - ends[0]) * (2 * p + 2)).is_positive
        ),
        "phi_q grows with q, and the last is below pi",
    )
    sign = -1 if shape.func == sp.sin else 1
    ratio = sp.sin((2 * p + (1 - sign) // 2) * phi) - (sp.sin(phi) if sign < 0 else 0)
    total = p / 2 + sign * ratio / (4 * sp.sin(phi))
    reduced = sp.expand_trig(sp.expand(total.subs(p, sp.expand(kind.turn / phi))))
    proof.proved(
        f"{name}: the squares of an eigenvector sum up to {kind.square}",
        lambda: (
            trigonometric((total - total.subs(p, p - 1) - shape.subs(n, p) ** 2) * sp.sin(phi))
            and total.subs(p, 0) == 0
            and vanishes(sp.simplify(reduced - kind.square.subs(p, kind.turn / phi)))
        ),
        "induction over p, then p phi as above" + "; q = 0: 1/sqrt(p)" * (kind.first == 0),
    )


def _inverse(proof: Proof, kind: Ends) -> None:
    """Show that the closed form is the inverse of K, row by row."""
    mean = 1 / p if kind.name == "free-free" else sp.Integer(0)

    def upper(r: Expression) -> Expression:
        return green(kind.left, kind.right, r, column)

    def lower(r: Expression) -> Expression:
        return green(kind.left, kind.right, column, r)

    def rows() -> Iterator[Expression]:
        yield -upper(row - 1) + 2 * upper(row) - upper(row + 1) + mean
        yield -lower(row - 1) + 2 * lower(row) - lower(row + 1) + mean
        yield -upper(column - 1) + 2 * upper(column) - lower(column + 1) - 1 + mean
        yield upper(sp.Integer(0)) - (upper(sp.Integer(1)) if kind.left == "free" else 0)
        yield lower(p + 1) - (lower(p) if kind.right == "free" else 0)
        if mean:
            yield sp.summation(upper(row), (row, 1, column)) + sp.summation(
                lower(row), (row, column + 1, p)
            )

    shown = green(kind.left, kind.right, row, column)
    proof.show(f"{kind.name}: inverse of K, row r <= column s", shown)
    proof.proved(
        f"{kind.name}: K times it is one" + " less the mean" * bool(mean),
        lambda: all(vanishes(each) for each in rows()),
        "above, below and on the diagonal, and at both ends",
    )


def _energy(proof: Proof, own: Expression) -> None:
    """Show what a run conserves, how it bounds derivatives, and the times free of events."""
    velocity = size * sp.sin(frequency * t + phase)
    proof.show(
        "each mode conserves v**2 + (v'/omega)**2, the square of its amplitude: 2J in all",
        velocity**2 + (sp.diff(velocity, t) / frequency) ** 2,
        size**2,
        "conserved",
    )
    order = sp.Symbol("order", integer=True, nonnegative=True)
    rate = frequency**order * size * sp.sin(frequency * t + phase + order * sp.pi / 2)
    proof.proved(
        "a mode's k-th derivative is omega**k times it, turned by k pi/2",
        lambda: (
            vanishes(rate.subs(order, 0) - velocity)
            and vanishes(sp.expand_trig(sp.diff(rate, t) - rate.subs(order, order + 1)))
        ),
        "induction over k",
    )
    proof.argued(
        "|v_n^(k)(t)| <= sqrt((K^k)_nn 2J)",
        "Cauchy-Schwarz over the modes, the sum of omega**(2k) e_qn**2 being (K^k)_nn; a "
        "zero mode drops out for k >= 2, and adds the mean's motion for k = 0, 1",
    )

    def b(power: Expression, distance: Expression) -> Expression:
        return sp.binomial(2 * power, power + distance)

    pascal = 2 * b(k, d) + b(k, d - 1) + b(k, d + 1) - b(k + 1, d)
    proof.proved(
        "on the infinite lattice (K^k)_(n, n+d) = (-1)**d b(d), b(d) = binomial(2k, k+d)",
        lambda: sp.combsimp(pascal.rewrite(sp.gamma)) == 0,
        "Pascal's rule twice: K^(k+1)",
    )
    proof.show(
        "b falls with the distance: b(d + 1)/b(d) =",
        sp.combsimp((b(k, d + 1) / b(k, d)).rewrite(sp.gamma)),
        (k - d) / (k + d + 1),
    )
    u, A, B, g, slope = sp.symbols("u A B g d", positive=True)
    moving = next(
        root for root in sp.solve(u + A * t - B * t**2 / 2, t) if root.subs({u: 1, A: 1, B: 1}) > 0
    )
    proof.show(
        "a slider with the speed u and the acceleration A along it cannot stop before, B a "
        "bound of |v''|,",
        moving,
        (A + sp.sqrt(A**2 + 2 * u * B)) / B,
        "moving",
    )
    resting = next(
        root
        for root in sp.solve(g - slope * t - B * t**2 / 2, t)
        if root.subs({g: 1, slope: 1, B: 1}) > 0
    )
    proof.show(
        "one that rests cannot start before, g its margin, d the rate at which it falls,",
        resting,
        (-slope + sp.sqrt(slope**2 + 2 * g * B)) / B,
        "resting",
    )
    left, right = sp.symbols("J_left J_right", positive=True)
    proof.show(
        "... with the bound of its neighbours' accelerations, K_nn <= 2: B =",
        sp.sqrt(own) * (sp.sqrt(2 * left) + sp.sqrt(2 * right)),
        sp.sqrt(2) * (sp.sqrt(2 * left) + sp.sqrt(2 * right)),
    )
    # one step of velocity Verlet maps (x, v) with trace 2 - (omega step)**2 and determinant 1
    step = symbol("step")
    turns = sp.solve(2 - (frequency * step) ** 2 + 2, step)
    proof.show(
        "velocity Verlet is stable below the step 2/omega, at the largest omega < 2:",
        max(turns, key=lambda root: root.subs(frequency, 1)).subs(frequency, sp.sqrt(2 * own)),
        1,
        "stable",
    )


def _images(proof: Proof, kind: Ends) -> None:
    """Show that (K^k)_nn <= binomial(2k, k), by the images of a slider behind the ends."""
    # an end reflects at 0 or p + 1 (fixed, odd), at 1/2 or p + 1/2 (free, even)
    left = 0 if kind.left == "fixed" else HALF
    right = p + 1 if kind.right == "fixed" else p + HALF
    sign = {"fixed": -1, "free": 1}
    even = bool(sp.expand(kind.period / 2).is_integer)
    far = sp.expand(kind.period - kind.reflection.subs(n, p))
    proof.proved(
        f"{kind.name}: images repeat with {kind.period} and the sign +, reflected ones, "
        f"first at {kind.reflection}, have the sign -, and are nearer: (K^k)_nn <= b(0)",
        lambda: (
            vanishes(2 * (right - left) - kind.period)
            and vanishes(2 * (n - left) - kind.reflection)
            and sign[kind.left] * sign[kind.right] * (1 if even else -1) == 1
            and kind.reflection.subs(n, 1) > 0
            and far.is_positive
        ),
        "the sign of the reflections times (-1)**distance; each translated image has its "
        "own reflected one before it",
    )


def _diagonal(matrix: list[list[int]], power: int) -> list[int]:
    result = sp.Matrix(matrix) ** power
    return [int(result[a, a]) for a in range(len(matrix))]


def _image_sums() -> bool:
    return all(
        entry == image_sum(int(kind.period.subs(p, size)), int(kind.reflection.subs(n, a)), power)
        and entry <= comb(2 * power, power)
        for kind in KINDS
        for size in range(1, 7)
        for power in range(7)
        for a, entry in enumerate(_diagonal(stiffness(kind.left, kind.right, size), power), 1)
    )


def _influence() -> bool:
    """Return whether the response to a jump of an acceleration obeys its bound within h = 1."""
    for kind in KINDS:
        for size in range(1, 6):
            matrix = sp.Matrix(stiffness(kind.left, kind.right, size))
            response, power = sp.zeros(size), sp.eye(size)
            for order in range(14):
                response += (-1) ** order * power / factorial(2 * order + 2)
                power *= matrix
            for a in range(size):
                for b in range(size):
                    far = abs(a - b)
                    tail = 1 - Fraction(1, (2 * far + 3) * (2 * far + 4))
                    if abs(response[a, b]) > 2 / (Fraction(factorial(2 * far + 2)) * tail):
                        return False
    return True


def _stable_step(r: Lines) -> Judge:
    """Judge `Delta t << tau_dyn`: velocity Verlet is stable below 2/omega_max = tau_dyn."""
    limit = r.stable

    def judge(formula: Formula) -> bool:
        sides = formula.bound({}).sides
        return formula.relations == ("<<",) and sides == (
            symbol("Delta_t"),
            limit * symbol("tau_dyn"),
        )

    return judge


LINES: dict[str, Backed | None] = {"integration_step": _stable_step}
ENTRIES = entries_of("modes", derive, LINES)
