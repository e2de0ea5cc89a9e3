"""Modes of a run: p moving sliders between ends that are fixed or free.

A run obeys ``x'' = -K x + f`` with constant f; K has 2 on its diagonal (1 at a free end) and -1
beside it. Everything the event finder relies on is derived here for all p.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import sympy as sp

from derivations.judges import small, vanishes
from derivations.model import Model, after, before, here, solved
from derivations.notation import Expression, symbol
from derivations.proof import Proof, chapter

p, n, q = symbol("p"), symbol("n"), symbol("q")
phi = sp.Symbol("phi", positive=True)
row, column, k, d = sp.symbols("r s k d", integer=True, positive=True)
frequency, size, phase, t = sp.symbols("omega size phase t", positive=True)
order = sp.Symbol("order", integer=True, nonnegative=True)
HALF = sp.Rational(1, 2)
OMEGA = 2 * sp.sin(phi / 2)


class Ends(NamedTuple):
    """The closed forms of one kind of run.

    Attributes
    ----------
    left, right : str
        ``fixed`` or ``free``.
    turn, angle : Expression
        p phi_q, by which the right end is where it must be; phi_q; the frequency is 2 sin(phi_q/2).
    shape, square : Expression
        The eigenvector's n-th component at angle phi, not normalised; the sum of its squares.
    inverse : Expression
        (K^-1)_rs for r <= s; free-free: the inverse on motions without a mean.
    first : int
        The first q.
    """

    left: str
    right: str
    turn: Expression
    angle: Expression
    shape: Expression
    square: Expression
    inverse: Expression
    first: int = 1


SINE, _COSINE = sp.sin(n * phi), sp.cos((n - HALF) * phi)
_ODD = ((2 * q - 1) * sp.pi - phi) / 2, (2 * q - 1) * sp.pi / (2 * p + 1)
_WHOLE = q * sp.pi - phi, q * sp.pi / (p + 1)
_PARABOLA = (row * (row - 1) + column * (column - 1)) / (2 * p) - column
KINDS: tuple[Ends, ...] = (
    Ends("fixed", "fixed", *_WHOLE, SINE, (p + 1) / 2, row * (p + 1 - column) / (p + 1)),
    Ends("free", "fixed", *_ODD, _COSINE, (2 * p + 1) / 4, p + 1 - column),
    Ends("fixed", "free", *_ODD, SINE, (2 * p + 1) / 4, row),
    Ends(
        "free",
        "free",
        q * sp.pi,
        q * sp.pi / p,
        _COSINE,
        p / 2,
        _PARABOLA + (p + 1) * (2 * p + 1) / (6 * p),
        0,
    ),
)


@cache
def trigonometric(expression: Expression) -> bool:
    """Return whether a combination of sines and cosines vanishes: by expansion in exponentials."""
    expanded = sp.expand(expression)
    if sp.expand(expanded.rewrite(sp.exp)) == 0:
        return True
    return vanishes(sp.expand_trig(expanded))


@chapter(
    "Modes of a run", "theta is frozen while sliders move", "no start, stop or reversal inside"
)
def derive(proof: Proof, model: Model) -> None:
    """Show eigenpairs, norms, inverses, the conserved energy and what bounds derivatives."""
    own, first, last = (-sp.diff(model.at(x), here) for x in ("inner", "first", "last"))
    upper, lower = (-sp.diff(model.at("inner"), neighbour) for neighbour in (before, after))
    proof.show("K: a slider's own displacement, minus its force", own, 2)
    proof.show("... of a slider at a free end above", first, 1)
    proof.show("... and below", last, 1)
    proof.show("a neighbour's displacement, from above", upper, -1)
    proof.show("... and from below", lower, -1)
    for kind in KINDS:
        shape = kind.shape
        applied = upper * shape.subs(n, n - 1) + own * shape + lower * shape.subs(n, n + 1)
        _eigenvectors(proof, kind, applied, own - first)
        _inverse(proof, kind)
        _images(proof, kind)
    _bounds(proof, own)


def _eigenvectors(proof: Proof, kind: Ends, applied: Expression, mirrored: Expression) -> None:
    """Show angles and eigenvectors: inside, at both ends, how many there are, and their norm."""
    name, shape = f"{kind.left}-{kind.right}", kind.shape
    proof.proved(
        f"{name}: K v = omega omega v inside a run, omega = {OMEGA}",
        lambda: trigonometric(applied - OMEGA**2 * shape),
        "addition theorem",
    )
    left = shape.subs(n, 0)
    if kind.left == "free":
        left -= mirrored * shape.subs(n, 1)
    right = shape.subs(n, p + 1)
    if kind.right == "free":
        right -= mirrored * shape.subs(n, p)
    proof.proved(
        f"{name}: beyond its ends v vanishes (fixed) or is the same (free), p phi = {kind.turn}",
        lambda: ends_match(left, right, kind.turn),
        "just beyond either end",
    )
    proof.show(f"{name}: so phi_q =", solved(p * phi - kind.turn, phi), kind.angle)
    lowest = kind.angle.subs(q, kind.first)
    proof.proved(
        f"{name}: p different angles from {lowest} to below pi: eigenvectors are orthogonal and "
        "complete",
        lambda: different(kind.angle, kind.first),
        "phi_q grows with q, and the last is below pi",
    )
    if shape.func == sp.sin:
        total = p / 2 - (sp.sin((2 * p + 1) * phi) - sp.sin(phi)) / (4 * sp.sin(phi))
    else:
        total = p / 2 + sp.sin(2 * p * phi) / (4 * sp.sin(phi))
    proof.proved(
        f"{name}: the squares of an eigenvector sum up to {kind.square} (p where it is constant)",
        lambda: sums_up(total, shape, kind.turn, kind.square),
        "induction over p, then p phi as above",
    )


def ends_match(left: Expression, right: Expression, turn: Expression) -> bool:
    """Return whether a shape fits both ends of a run, p phi being `turn`."""
    return trigonometric(left) and trigonometric(right.subs(p, turn / phi))


def different(angle: Expression, first: int) -> bool:
    """Return whether the p angles from q = first on grow from zero or more to below pi."""
    lowest, highest = angle.subs(q, first), angle.subs(q, p + first - 1)
    below = sp.factor((sp.pi - highest) * (2 * p + 2)).is_positive
    return bool(sp.diff(angle, q).is_positive and lowest.is_nonnegative and below)


def sums_up(total: Expression, shape: Expression, turn: Expression, square: Expression) -> bool:
    """Return whether `total` is the sum of squares of a shape, and `square` at the angles."""
    added = total - total.subs(p, p - 1) - shape.subs(n, p) ** 2
    whole = sp.expand(turn / phi)
    at_angles = sp.expand_trig(sp.expand(total.subs(p, whole))) - square.subs(p, whole)
    begun = total.subs(p, 0) == 0
    return bool(begun and trigonometric(added * sp.sin(phi)) and vanishes(at_angles))


def images(sign: int, period: Expression, nearest: Expression, farthest: Expression) -> bool:
    """Return whether reflected images lower a diagonal of K^k: by their sign, and being nearer.

    Reflections at both ends have the `sign`, powers of the lattice the sign (-1)**distance.
    """
    alternating = 1 if sp.expand(period / 2).is_integer else -1
    nearer = nearest.is_positive and sp.expand(period - farthest).is_positive
    return bool(sign * alternating == 1 and nearer)


def _inverse(proof: Proof, kind: Ends) -> None:
    """Show that the closed form is the inverse of K, row by row."""
    name = f"{kind.left}-{kind.right}"
    mean = " less the mean" * (name == "free-free")
    proof.show(f"{name}: inverse of K, row r not beyond column s", kind.inverse)
    proof.proved(
        f"{name}: K times it is one{mean}",
        lambda: all(vanishes(entry) for entry in _rows(kind)),
        "above, below and on the diagonal, and at both ends",
    )


@cache
def _rows(kind: Ends) -> list[Expression]:
    """Return what must vanish if K times the inverse is one (two free ends: less the mean)."""
    upper = kind.inverse
    lower = upper.subs({row: column, column: row}, simultaneous=True)
    left = upper.subs(row, 0)
    if kind.left == "free":
        left -= upper.subs(row, 1)
    right = lower.subs(row, p + 1)
    if kind.right == "free":
        right -= lower.subs(row, p)
    mean = 1 / p if kind.left == kind.right == "free" else sp.Integer(0)
    above, below = (
        2 * part - part.subs(row, row - 1) - part.subs(row, row + 1) + mean
        for part in (upper, lower)
    )
    beside = upper.subs(row, column - 1) + lower.subs(row, column + 1)
    diagonal = 2 * upper.subs(row, column) - beside - 1 + mean
    total = sp.summation(upper, (row, 1, column)) + sp.summation(lower, (row, column + 1, p))
    return [above, below, diagonal, left, right, mean * total]


def _images(proof: Proof, kind: Ends) -> None:
    """Show that (K^k)_nn <= binomial(2k, k), by the images of a slider behind the ends."""
    # a fixed end reflects oddly, at 0 or p + 1; a free one evenly, at 1/2 or p + 1/2
    left, right = sp.Integer(0), p + 1
    sign = 1
    if kind.left == "free":
        left, sign = HALF, -sign
    if kind.right == "free":
        right, sign = p + HALF, -sign
    period, reflected = sp.expand(2 * (right - left)), 2 * (n - left)
    nearest, farthest = reflected.subs(n, 1), reflected.subs(n, p)
    name = f"{kind.left}-{kind.right}"
    proof.proved(
        f"{name}: images repeat with {period} and add, reflected ones, first at "
        f"{reflected}, subtract, and are nearer: a diagonal of the k-th power of K is no larger "
        "than on the infinite lattice",
        lambda: images(sign, period, nearest, farthest),
        "the sign of the reflections times the sign of the lattice's power, which alternates; each "
        "translated image has its own reflected one before it",
    )


def _bounds(proof: Proof, own: Expression) -> None:
    """Show what a run conserves, how it bounds derivatives, and the times free of events."""
    velocity = size * sp.sin(frequency * t + phase)
    proof.show(
        "each mode conserves v squared plus (v' over omega) squared, its amplitude squared: the "
        "sum is twice J",
        velocity**2 + (sp.diff(velocity, t) / frequency) ** 2,
        size**2,
    )
    rate = frequency**order * size * sp.sin(frequency * t + phase + order * sp.pi / 2)
    proof.proved(
        f"a mode's k-th derivative is {rate}",
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
        "on the infinite lattice the k-th power of K has, at a distance d from its diagonal, the "
        f"entry b = {b(k, d)}, with alternating signs",
        lambda: sp.combsimp(pascal.rewrite(sp.gamma)) == 0 and b(sp.Integer(0), 0) == 1,
        "Pascal's rule twice leads from each power to the next",
    )
    proof.show(
        "b falls with the distance, by each step to a share of",
        sp.combsimp((b(k, d + 1) / b(k, d)).rewrite(sp.gamma)),
        (k - d) / (k + d + 1),
    )
    proof.argued(
        "an event changes a slider at distance d by at most 2 h**(2d+2)/(2d+2)! (1 + small) per "
        "unit of changed acceleration, within the time h",
        "cos(sqrt(K) u) = J_0(2u) + 2 sum of J_2k(2u) T_k(1 - K/2), T_k reaches no further than k "
        "and has the norm 1, and |J_2k(2u)| <= u**(2k)/(2k)!",
    )
    speed, A, B, margin = sp.symbols("u A B g", positive=True)
    proof.show(
        "a slider with the speed u and the acceleration A along it cannot stop before, B a "
        "bound of |v''|,",
        _later(speed + A * t - B * t**2 / 2),
        (A + sp.sqrt(A**2 + 2 * speed * B)) / B,
    )
    proof.show(
        "one that rests cannot start before, g its margin, d its rate of loss,",
        _later(margin - d * t - B * t**2 / 2),
        (-d + sp.sqrt(d**2 + 2 * margin * B)) / B,
    )
    # the bound of its neighbours' accelerations, sqrt(K_nn) (sqrt(2J_left) + sqrt(2J_right))
    # one step of velocity Verlet maps (x, v) with trace 2 - (omega step)**2 and determinant 1
    step, fastest = sp.Symbol("step", positive=True), sp.sqrt(2 * own)
    trace, least = 2 - (frequency * step) ** 2, sp.Integer(-2)
    limit = proof.show(
        f"velocity Verlet is stable while its trace, {trace}, exceeds {least}: below the step, at "
        f"the largest omega, {fastest},",
        solved(trace.subs(frequency, fastest) - least, step),
        1,
    )
    proof.entry(
        "integration_step",
        small({}, symbol("Delta_t"), limit * symbol("tau_dyn")),
        fastest=fastest,
        limit=limit,
    )


@cache
def _later(margin: Expression) -> Expression:
    """Return the later of the times at which a parabola in t vanishes."""
    unit = dict.fromkeys(margin.free_symbols - {t}, 1)
    return max(sp.solve(margin, t), key=lambda root: root.subs(unit))
