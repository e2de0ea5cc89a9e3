"""The law of chains that differ: mutants of its statements, and the witness that it is held to."""

from __future__ import annotations

from collections.abc import Iterator
from copy import deepcopy
from dataclasses import replace
from fractions import Fraction as F
from random import Random

import pytest
import sympy as sp

from derivations import unlike
from derivations.chain import RationalChain, SweptChain
from derivations.judges import vanishes
from derivations.model import MODEL, PREMISES
from derivations.notation import n
from derivations.proof import Line

SHOWN = [line for line in unlike.derive().lines if line.form is not None]


def mutants(form: sp.Expr) -> Iterator[sp.Expr]:
    """Yield a form with the sign of a term changed, doubled, one more, or at the next spring."""
    terms = sp.Add.make_args(sp.expand(form))
    yield from (form - 2 * term for term in terms)
    yield from (2 * form, form + 1, form.subs(n, n + 1))


@pytest.mark.parametrize("line", SHOWN, ids=lambda line: line.text[:40])
def test_no_mutant_of_a_line_that_is_proved_holds(line: Line) -> None:
    assert vanishes(line.value - line.form)
    changed = [other for other in mutants(line.form) if sp.expand(other - line.form) != 0]
    assert changed
    assert not any(vanishes(line.value - other) for other in changed)


@pytest.mark.parametrize("premise", ["gravity x 7", "friction x 2", "springs that push"])
def test_without_a_premise_the_theorems_fall_with_their_lines(premise: str) -> None:
    fallen = [line.text for line in unlike.derive(PREMISES[premise]).lines if line.fault]
    assert sum(text.startswith("theorem") for text in fallen) == 2


def test_inertia_or_other_end_forces_refute_the_law() -> None:
    for name in ("fronts that accelerate", "ends that pull", "sliders that stick and slip"):
        assert any(line.fault for line in unlike.derive(PREMISES[name]).lines), name
    uneven = replace(MODEL, natural=(2 * MODEL.natural[0], MODEL.natural[1]))
    assert any(line.fault for line in unlike.derive(uneven).lines)


@pytest.mark.parametrize("size", unlike.SIZES)
def test_another_width_or_slope_is_refused_by_chains_in_rational_arithmetic(size: int) -> None:
    """Of ten chains, as one whose pivots are the same does not move whatever the width."""
    seeds = [Random(seed) for seed in range(10)]
    for share in (1, 2):
        moved = [unlike.follows_the_plays(deepcopy(random), size, 8, share) for random in seeds]
        sloped = [unlike.follows_the_slope(deepcopy(random), size, share) for random in seeds]
        assert (all(moved), all(sloped)) == (share == 1, share == 1)


def test_the_witness_of_chains_that_differ_agrees_with_that_of_equal_ones() -> None:
    """Slide by slide; and it knows nothing but the law of friction."""
    for seed in range(12):
        random = Random(seed)
        size, slope = random.randint(2, 6), F(random.randint(1, 59), 120)
        if (size - size * slope / F(1, 2)) % 2 == 0:
            continue  # an edge
        equal = RationalChain(size, slope, F(1, 2))
        forces = [slope] * size
        swept = SweptChain([F(1, 2)] * size, forces, [F(1)] * (size - 1), list(forces))
        for _ in range(8):
            target = F(random.randint(-90, 90), 17)
            equal.to(target)
            swept.to(target)
            assert (swept.x, swept.forces) == (equal.x, equal.forces)
