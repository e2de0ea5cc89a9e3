"""The edges of a chain's fate: theorems held against linear programmes and simulated chains."""

from __future__ import annotations

import math
from fractions import Fraction as F
from itertools import product
from random import Random
from typing import Any

import numpy as np
import pytest
from scipy.optimize import linprog

from exactcreep import Cycles, Outcome, State, creep, laws
from tests.paper import captions


def longest_rest(
    tan: float, held: list[float], ends: list[float], weights: list[float]
) -> float | None:
    """Return the largest l0 A/cos(alpha) that some tensions bear at rest; None: none bear any."""
    size = len(held)
    rates = -np.diff([0, *weights, 0])
    forces = np.hstack([np.eye(size, size - 1) - np.eye(size, size - 1, -1), rates[:, None]])
    constant = np.full(size, tan)
    constant[[0, -1]] += ends
    rows = [(sign * np.append(forces[k, :-1], up * forces[k, -1]), held[k] - sign * constant[k])
            for k, sign, up in product(range(size), (1, -1), (1, -1))]  # fmt: skip
    matrix, bounds = (np.array(part) for part in zip(*rows, strict=True))
    found = linprog(-np.eye(size)[-1], A_ub=matrix, b_ub=bounds, bounds=(None, None))
    return float(found.x[-1]) if found.status == 0 else None


def test_the_edge_of_rest_is_the_linear_programme_over_tensions_for_any_coefficients() -> None:
    random, differences = Random(12), []
    for _ in range(100):
        size = random.randint(2, 9)
        tan = F(random.randint(-60, 60), 100)
        above = [F(random.randint(1, 200), 100) for _ in range(size)]
        held = [abs(tan) + excess for excess in above]
        ends = [sum(above) * random.randint(-9, 9) / 80 for _ in range(2)]
        weights = random.choice([[], [F(random.randint(-5, 20), 10) for _ in range(size - 1)]])
        if weights and not any(weights):
            continue
        law = laws.at_rest_amplitude(7, tan, held, ends, weights) * 7 / laws.cosine(tan)
        pulls = [float(force / laws.cosine(tan)) for force in ends]
        each = [float(weight) for weight in weights or [1] * (size - 1)]
        longest = longest_rest(float(tan), [float(mu) for mu in held], pulls, each)
        assert longest is not None
        differences.append(abs(longest - float(law)))
    assert max(differences) < 1e-9


@pytest.mark.parametrize(
    ("n", "mu_d", "mu_s", "slope", "most"),
    [
        (3, F(1, 2), F(4, 5), F(5, 12), 0),  # 3 tan_alpha is above mu_s
        (3, F(1, 2), F(5, 4), F(5, 12), math.inf),
        (4, F(1, 2), F(3, 2), F(3, 4), 0),  # what an end holds is not below the sum
        (4, F(1, 2), F(8, 5), F(3, 4), F(4, 5) * 2 * F(17, 20)),
        (5, F(1, 2), F(1, 2), 0, 1),
    ],
)
def test_only_from_four_sliders_on_the_locked_cycles_of_the_ends_have_a_finite_edge(
    n: int, mu_d: F, mu_s: F, slope: Any, most: Any
) -> None:
    """The formula is the ledger's; here are its ends."""
    found = laws.locked_ends_amplitude(n=n, l0=1, mu_d=mu_d, mu_s=mu_s, tan_alpha=slope)
    mirrored = laws.locked_ends_amplitude(n=n, l0=1, mu_d=mu_d, mu_s=mu_s, tan_alpha=-slope)
    assert found == mirrored == most


@pytest.mark.parametrize("sigma_mu", ["0", "0.02"])
def test_below_the_edge_of_lasting_creep_every_start_comes_to_rest(sigma_mu: str) -> None:
    random = Random(sigma_mu)
    for seed in range(6):
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
    slippery = captions(3, mu_d=["0.5", "0.1", "0.1"], mu_s=["0.6", "0.4", "0.4"])
    assert laws.edges(slippery)["no_lasting_creep"] == 0  # mu_d does not hold it, mu_s does
    assert laws.edges(slippery)["at_rest"] > 0
