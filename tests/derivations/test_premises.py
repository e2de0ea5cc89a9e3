"""Every claim that is called proved has a premise without which its check fails.

A premise is a line of a subject's derivation: an equation of motion, a balance, a closed form. One
of them is changed, and all claims of the subject are decided anew. Three identities of
trigonometry have no premise; they are changed themselves.
"""
# ruff: noqa: E501 - lines of the derivations stand here as they are

from __future__ import annotations

import inspect

import pytest

from derivations.ledger import CHAPTERS, ported
from tests.derivations import premises

CHANGED: dict[str, tuple[tuple[str, str], ...]] = {
    "modes": (
        (
            "return (r * (r - 1) + s * (s - 1)) / (2 * p) - s + (p + 1) * (2 * p + 1) / (6 * p)",
            "return (r * (r - 1) + s * (s - 1)) / (3 * p) - s + (p + 1) * (2 * p + 1) / (6 * p)",
        ),
        (
            '"fixed",\n        (2 * q - 1) * sp.pi / (2 * p + 1),',
            '"fixed",\n        (3 * q - 1) * sp.pi / (2 * p + 1),',
        ),
        (
            '"fixed", "fixed", q * sp.pi / (p + 1), sp.sin(n * phi), (p + 1) / 2, 2 * (p + 1), 2 * n, 1',
            '"fixed", "fixed", q + sp.pi / (p + 1), sp.sin(n * phi), (p + 1) / 2, 2 * (p + 1), 2 * n, 1',
        ),
        (
            "q * sp.pi / p,",
            "q + sp.pi / p,",
        ),
        (
            '"free",\n        (2 * q - 1) * sp.pi / (2 * p + 1),',
            '"free",\n        (3 * q - 1) * sp.pi / (2 * p + 1),',
        ),
        (
            "return bool(sp.expand(kind.period / 2).is_integer)",
            "return bool(sp.expand(kind.period / 3).is_integer)",
        ),
        (
            "return p + 1 - s",
            "return p + 1 + s",
        ),
        (
            "return r * (p + 1 - s) / (p + 1)",
            "return r * (p + 2 - s) / (p + 1)",
        ),
        (
            "q * sp.pi / p,\n        sp.cos((n - sp.Rational(1, 2)) * phi),",
            "q * sp.pi / p,\n        sp.sin((n - sp.Rational(1, 2)) * phi),",
        ),
        (
            "(2 * q - 1) * sp.pi / (2 * p + 1),\n        sp.sin(n * phi),",
            "(2 * q - 1) * sp.pi / (2 * p + 1),\n        sp.cos(n * phi),",
        ),
        (
            'matrix[k][k] = 2 - (k == 0 and left == "free") - (k == size - 1 and right == "free")',
            'matrix[k][k] = 3 - (k == 0 and left == "free") - (k == size - 1 and right == "free")',
        ),
        (
            "sp.sin(n * phi),\n        (2 * p + 1) / sp.Integer(4),",
            "sp.sin(n * phi),\n        (2 * p + 1) / sp.Integer(5),",
        ),
        (
            "if (kind.reflection).subs(n, 1) <= 0:",
            "if (kind.reflection).subs(n, 1) <= 1:",
        ),
        (
            '"fixed", "fixed", q * sp.pi / (p + 1), sp.sin(n * phi), (p + 1) / 2, 2 * (p + 1), 2 * n, 1',
            '"fixed", "fixed", q * sp.pi / (p + 1), sp.sin(n * phi), (p + 2) / 2, 2 * (p + 1), 2 * n, 1',
        ),
        (
            "sp.cos((n - sp.Rational(1, 2)) * phi),\n        (2 * p + 1) / sp.Integer(4),",
            "sp.cos((n - sp.Rational(1, 2)) * phi),\n        (2 * p + 2) / sp.Integer(4),",
        ),
        (
            "p / 2,",
            "p / 3,",
        ),
        (
            '"fixed", "fixed", q * sp.pi / (p + 1), sp.sin(n * phi), (p + 1) / 2, 2 * (p + 1), 2 * n, 1',
            '"fixed", "fixed", q * sp.pi / (p + 1), sp.cos(n * phi), (p + 1) / 2, 2 * (p + 1), 2 * n, 1',
        ),
        (
            "(2 * q - 1) * sp.pi / (2 * p + 1),\n        sp.cos((n - sp.Rational(1, 2)) * phi),",
            "(2 * q - 1) * sp.pi / (2 * p + 1),\n        sp.sin((n - sp.Rational(1, 2)) * phi),",
        ),
        (
            'mean = 1 / p if name == "free-free" else sp.Integer(0)',
            'mean = 1 / p if name == "free-free" else sp.Integer(1)',
        ),
        (
            "-shape.subs(n, n - 1)\n            + 2 * shape",
            "-shape.subs(n, n - 1)\n            + 3 * shape",
        ),
        (
            "velocity = size * sp.sin(frequency * t + phase)",
            "velocity = size + sp.sin(frequency * t + phase)",
        ),
        (
            'above(sp.Integer(0)) if left == "fixed" else above(sp.Integer(1)) - above(sp.Integer(0))',
            'above(sp.Integer(1)) if left == "fixed" else above(sp.Integer(1)) - above(sp.Integer(0))',
        ),
        (
            "return sp.binomial(2 * power, power + distance)",
            "return sp.binomial(2 + power, power + distance)",
        ),
        (
            'left_at = 0 if kind.left == "fixed" else sp.Rational(1, 2)',
            'left_at = 0 if kind.left == "fixed" else sp.Rational(1, 3)',
        ),
        (
            "right_at = p + 1 if kind.right",
            "right_at = p + 2 if kind.right",
        ),
        (
            '"fixed" else p + sp.Rational(1, 2)\n',
            '"fixed" else p + sp.Rational(1, 3)\n',
        ),
        (
            'signs = {"fixed": -1, "free": 1}',
            'signs = {"fixed": -1, "free": -1}',
        ),
        (
            "moving = (A + sp.sqrt(A**2 + 2 * u * B)) / B",
            "moving = (A + sp.sqrt(A**2 + 3 * u * B)) / B",
        ),
        (
            "resting = (-d + sp.sqrt(d**2 + 2 * g * B)) / B",
            "resting = (-d + sp.sqrt(d**2 + 3 * g * B)) / B",
        ),
        (
            "phase + power * sp.pi / 2)",
            "phase + power * sp.pi / 3)",
        ),
        (
            "2 * sp.sin(phi) * sp.cos(2 * n * phi)\n",
            "3 * sp.sin(phi) * sp.cos(2 * n * phi)\n",
        ),
        (
            "2 * sp.sin(phi) * sp.cos((2 * n - 1) * phi)\n",
            "3 * sp.sin(phi) * sp.cos((2 * n - 1) * phi)\n",
        ),
        (
            "p * (1 / sp.sqrt(p)) ** 2 - 1",
            "p * (1 / sp.sqrt(p)) ** 3 - 1",
        ),
    ),
    "gaussian": (
        (
            "stationary = sp.solve(sp.Eq(G, A + (1 - B - A) * G), G)[0]",
            "stationary = sp.solve(sp.Eq(G, A + (1 + B - A) * G), G)[0]",
        ),
        (
            "turns = [o for o in orders if (o[1] - o[0]) * (o[2] - o[1]) < 0]",
            "turns = [o for o in orders if (o[2] - o[0]) * (o[2] - o[1]) < 0]",
        ),
        (
            "return sp.simplify(2 * sp.integrate(z * difference, (z, 0, sp.oo)) / 2)",
            "return sp.simplify(3 * sp.integrate(z * difference, (z, 0, sp.oo)) / 2)",
        ),
        (
            "return sp.simplify(first), second, sp.simplify(third / 2)",
            "return sp.simplify(first), second, sp.simplify(third / 3)",
        ),
    ),
}
"""What stands in a subject's source, and what it is changed to."""


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.slow if name == "modes" else ())
        for name in CHAPTERS
        if not ported(name)
    ],
)
def test_every_proved_claim_falls_with_one_of_its_premises(name: str) -> None:
    module = CHAPTERS[name]
    source = inspect.getsource(module)
    whole = premises.checked(module, source)
    assert whole.refuted == set()
    fallen: set[str] = set()
    for line, changed in CHANGED[name]:
        assert source.count(line) == 1, line
        refuted = premises.checked(module, source.replace(line, changed)).refuted
        assert refuted - fallen, line  # none stands here for nothing
        fallen |= refuted
    assert whole.all_proved - fallen == set()
