"""The edges of a chain's fate: theorems held against linear programmes and simulated chains."""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import product
from random import Random

import numpy as np
import pytest
from scipy.optimize import linprog

from exactcreep import creep, laws
from exactcreep.laws import locked_ends_amplitude
from exactcreep.model.drive import Cycles
from exactcreep.model.outcome import Outcome
from exactcreep.model.state import State
from tests.paper import captions

F = Fraction
SLOPE = F(7, 24)


def largest(objective: int, rows: list[tuple[np.ndarray, float]], unknowns: int) -> float | None:
    """Return the largest value of one unknown under ``row @ unknowns <= bound``; None: no point."""
    cost = np.zeros(unknowns)
    cost[objective] = -1.0
    matrix, bounds = (np.array(part) for part in zip(*rows, strict=True))
    found = linprog(cost, A_ub=matrix, b_ub=bounds, bounds=(None, None))
    assert found.status in (0, 2, 3), found.message
    if found.status == 2:
        return None
    return math.inf if found.status == 3 else float(found.x[objective])


def forces(size: int, tan: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the matrix and the constant of the forces as functions of the inner tensions."""
    inner = size - 1
    matrix = np.eye(size, inner) - np.eye(size, inner, -1)
    return matrix, np.full(size, tan)


def test_the_edge_of_rest_is_the_linear_programme_over_tensions_for_any_coefficients() -> None:
    random, differences = Random(12), []
    for _ in range(100):
        size = random.randint(2, 9)
        tan = F(random.randint(-60, 60), 100)
        above = [F(random.randint(1, 200), 100) for _ in range(size)]
        held = [abs(tan) + excess for excess in above]
        ends = [sum(above) * random.randint(-9, 9) / 80 for _ in range(2)]
        weights = random.choice([(), [F(random.randint(-5, 20), 10) for _ in range(size - 1)]])
        rates = -np.diff([0, *map(float, weights or [1] * (size - 1)), 0])
        if not rates.any():
            continue
        matrix, constant = forces(size, float(tan))
        constant[[0, -1]] += [float(force) / float(laws.cosine(tan)) for force in ends]
        rows = []
        for slider, sign, up in product(range(size), (1, -1), (1, -1)):
            row = np.append(sign * matrix[slider], sign * up * rates[slider])
            rows.append((row, float(held[slider]) - sign * constant[slider]))
        longest = largest(size - 1, rows, size)
        assert longest is not None
        law = laws.at_rest_amplitude(7, tan, held, ends, weights) * 7
        differences.append(abs(longest - float(law / laws.cosine(tan))))
    assert max(differences) < 1e-9


def locked_by_programme(size: int, tan: float, low: float, high: float, most: int) -> float:
    """Return the largest L of a locked cycle with 1..most slips of sliders 1 and N, 0: none."""
    best = 0.0
    matrix, constant = forces(size, tan)  # at the end of a contraction
    for first, last in product(range(most + 1), repeat=2):
        if first == last == 0:
            continue
        step, rows = 2 * (high - low), []
        # after the dilation: the ramp on the ends, then the slips' own and their neighbours' change
        ramp = np.zeros(size)
        ramp[0], ramp[-1] = -2.0, 2.0
        after = constant.copy()
        after[[0, 1]] += first * step, -first * step
        after[[-1, -2]] += -last * step, last * step
        for slider, sign in product(range(size), (1, -1)):
            own = sign * matrix[slider]
            rows.append((np.append(own, 0.0), high - sign * constant[slider]))
            driven = np.append(own, sign * ramp[slider])
            rows.append((driven, high - sign * after[slider]))
        # an end that slips stands within one slip of the threshold that it slipped from last
        for end, count, sign in ((0, first, 1), (size - 1, last, -1)):
            if count:
                own = sign * matrix[end]
                rows.append((np.append(-own, 0.0), sign * constant[end] - high + step))
                driven = np.append(own, sign * ramp[end])
                rows.append((driven, step - high - sign * after[end]))
        longest = largest(size - 1, rows, size)
        best = max(best, longest or 0.0)
    return best


@pytest.mark.parametrize("size", [4, 5, 9])
def test_the_edge_of_locked_ends_is_the_programme_over_numbers_of_slips(size: int) -> None:
    random = Random(size)
    for _ in range(12):
        low = F(random.randint(10, 40), 20)
        high = low * (1 + F(random.randint(10, 30), 25))
        tan = low * F(random.randint(0, 19), 20)
        if size * (high - tan) == 2 * high:
            continue  # an end would stand at the open end of its interval, which a programme closes
        most = int(high // (high - low)) + 1
        law = locked_ends_amplitude(n=size, l0=1, mu_d=low, mu_s=high, tan_alpha=tan)
        found = locked_by_programme(size, float(tan), float(low), float(high), most)
        assert found * float(laws.cosine(tan)) == pytest.approx(float(law), abs=1e-9)


@pytest.mark.parametrize("sigma_mu", ["0", "0.02"])
def test_below_the_edge_of_lasting_creep_every_start_comes_to_rest(sigma_mu: str) -> None:
    random = Random(sigma_mu)
    for seed in range(8):
        size = random.randint(2, 9)
        chain = captions(size, sigma_mu, tan_alpha=F(random.randint(0, 45), 100))
        amplitude = 0.97 * laws.edges(chain)["no_lasting_creep"]
        start = State.perturbed(chain, "0.3", start_seed=seed, seed=seed)
        run = creep(chain, Cycles(amplitude, 4000), start=start, seed=seed)
        assert run.outcome is Outcome.AT_REST, (seed, chain)


def test_edges_are_those_that_hold_for_the_chain() -> None:
    clean = captions(6)
    assert list(laws.edges(clean)) == ["at_rest", "no_lasting_creep", "locked_ends"]
    shares = np.array(list(laws.edges(clean).values())) / 0.00072760687510899
    assert shares == pytest.approx([0.8, 2 / 3, 1.4])
    assert set(laws.edges(captions(6, "0.01"))) == {"no_lasting_creep"}
    assert laws.edges(captions(1)) == {}
    assert laws.edges(clean.mirrored()) == laws.edges(clean)
