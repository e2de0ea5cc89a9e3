"""The edges of a chain's fate: theorems held against linear programmes and simulated chains."""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import accumulate, product
from random import Random

import numpy as np
import pytest
from scipy.optimize import linprog

from exactcreep import creep, laws
from exactcreep.laws import locked_ends_amplitude
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles
from exactcreep.model.outcome import Outcome
from exactcreep.model.state import State
from exactcreep.studies.fates.fate import fate
from tests.paper import captions

F = Fraction
SLOPE = F(7, 24)
COSINE = F(24, 25)


def largest(objective: int, rows: list[tuple[np.ndarray, float]], unknowns: int) -> float | None:
    """Return the largest value of one unknown under ``row @ unknowns <= bound``; None: no point."""
    cost = np.zeros(unknowns)
    cost[objective] = -1.0
    matrix, bounds = np.array([row for row, _ in rows]), np.array([bound for _, bound in rows])
    found = linprog(cost, A_ub=matrix, b_ub=bounds, bounds=(None, None))
    assert found.status in (0, 2, 3), found.message
    if found.status == 2:
        return None
    return math.inf if found.status == 3 else float(found.x[objective])


def forces(size: int, tan: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the matrix and the constant of the forces as functions of the inner tensions."""
    return np.eye(size, size - 1) - np.eye(size, size - 1, -1), np.full(size, tan)


def test_the_edge_of_rest_is_the_linear_programme_over_tensions_for_any_coefficients() -> None:
    random, differences = Random(12), []
    for _ in range(100):
        size = random.randint(2, 9)
        tan = F(random.randint(-60, 60), 100)
        held = [abs(tan) + F(random.randint(1, 200), 100) for _ in range(size)]
        matrix, constant = forces(size, float(tan))
        rows = []
        for slider, sign, up in product(range(size), (1, -1), (1, -1)):
            ramp = {0: -up, size - 1: up}.get(slider, 0)
            if size == 2 or slider in (0, size - 1) or up == 1:
                row = np.append(sign * matrix[slider], sign * ramp)
                rows.append((row, float(held[slider]) - sign * constant[slider]))
        found = largest(size - 1, rows, size)
        assert found is not None
        law = laws.at_rest_amplitude(7, tan, held) * 7 / laws.cosine(tan)
        differences.append(abs(found - float(law)))
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
        ramp, slips = np.zeros(size), np.zeros(size)
        ramp[0], ramp[-1] = -2.0, 2.0
        slips[[0, 1]] += first * step, -first * step
        slips[[-1, -2]] += -last * step, last * step
        for slider, sign in product(range(size), (1, -1)):
            own = sign * matrix[slider]
            rows.append((np.append(own, 0.0), high - sign * constant[slider]))
            after = high - sign * (constant[slider] + slips[slider])
            rows.append((np.append(own, sign * ramp[slider]), after))
        # an end that slips stands within one slip of the threshold that it slipped from last
        for end, count, sign in ((0, first, 1), (size - 1, last, -1)):
            if count:
                row = np.append(-sign * matrix[end], 0.0)
                rows.append((row, sign * constant[end] - high + step))
                turned = sign * np.append(matrix[end], ramp[end])
                rows.append((turned, step - high - sign * (constant[end] + slips[end])))
        found = largest(size - 1, rows, size)
        best = max(best, found or 0.0)
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


def ends_cycle(chain: Chain, reach: Fraction) -> list[Fraction]:
    """Return the forces at the end of a contraction of a locked cycle of the ends, if there is one.

    In m g cos(alpha), as the reach. Each is the same share from its least to its largest value.
    """
    size, high, weight = chain.n, chain.mu_s, chain.n * chain.tan_alpha
    step = 2 * (high - chain.mu_d)
    swing = step * max(0, math.ceil(2 * (reach - high) / step))
    if size == 3:  # no lag: sliders 1 and 3 slip together
        phase = 2 * reach - swing - high if swing else reach
        return [phase, weight, -phase]
    least = [2 * reach - swing - high, swing - high, *[-high] * (size - 4), -high, -high]
    room = -2 * sum(least)
    share = (weight - sum(least)) / room if room else F(1, 2)
    return [a - share * (a + b) for a, b in zip(least, reversed(least), strict=True)]


def test_three_sliders_have_locked_ends_at_every_amplitude_up_to_a_third_of_mu_s() -> None:
    three = {"n": 3, "l0": 1000, "mu_d": F(1, 2), "mu_s": F(3, 5)}
    assert locked_ends_amplitude(**three, tan_alpha=F(1, 5)) == math.inf
    assert locked_ends_amplitude(**three, tan_alpha=F(1, 5) + F(1, 10**9)) == 0


@pytest.mark.parametrize(("size", "mu_s", "slope"), [(3, "0.7", F(9, 40)), (6, "0.6", SLOPE)])
def test_simulated_chains_are_locked_where_rational_ones_are(
    size: int, mu_s: str, slope: F
) -> None:
    chain = captions(size, mu_s=mu_s, tan_alpha=slope)
    known = {name: v for name, v in chain.parameters().items() if name != "sigma_mu"}
    edge, cosine = locked_ends_amplitude(**known), laws.cosine(slope)
    reach = F(5) if edge == math.inf else edge * chain.l0 / cosine - F(1, 10**4)
    tensions = list(accumulate(f - slope for f in ends_cycle(chain, reach)[:-1]))
    amplitude = reach * cosine / chain.l0
    start = State.prepared(chain, [t * cosine for t in tensions], theta=-amplitude)
    end = fate(chain, amplitude, start=start, cycles=300, solver="exact")
    assert (end.outcome, end.period, end.advance) == (Outcome.CYCLING, 1, 0)
    slipped = {n for _, events in end.itinerary or () for _, sliders, _ in events for n in sliders}
    assert slipped == {1, size}


@pytest.mark.parametrize("sigma_mu", ["0", "0.02"])
def test_below_the_edge_of_lasting_creep_every_start_comes_to_rest(sigma_mu: str) -> None:
    random = Random(sigma_mu)
    for seed in range(8):
        size = random.randint(2, 9)
        chain = captions(size, sigma_mu, tan_alpha=F(random.randint(0, 45), 100))
        amplitude = 0.97 * laws.edges(chain)["no_lasting_creep"]
        start = State.perturbed(chain, "0.3", start_seed=seed, seed=seed)
        run = creep(chain, Cycles(amplitude, 4000), start=start, seed=seed, record=("x",))
        assert run.outcome is Outcome.AT_REST, (seed, chain)
        # the paths that E(0)/eps leaves: displacements are no longer than paths
        c, s = chain.cos_alpha, chain.sin_alpha
        reach = 1000 * amplitude
        eps = min(0.5 * c - reach, 0.5 * c - s - 2 * reach / size)
        held = np.full(size, 0.5 * c - eps)
        held[[0, -1]] -= reach
        reference = np.cumsum(held * (size * s / held.sum()) - s)[:-1]
        energy = ((start.tensions.astype(float) - reference) ** 2).sum() / 2
        path = np.abs(run.dataset["x"].to_numpy()[-1]).sum()
        assert path <= energy / eps


def test_edges_are_those_that_hold_for_the_chain() -> None:
    clean = captions(6)
    assert list(laws.edges(clean)) == ["at_rest", "no_lasting_creep", "locked_ends"]
    f = {label: value / 0.00072760687510899 for label, value in laws.edges(clean).items()}
    assert f == pytest.approx({"at_rest": 0.8, "no_lasting_creep": 2 / 3, "locked_ends": 1.4})
    assert set(laws.edges(captions(6, "0.01"))) == {"no_lasting_creep"}
    assert laws.edges(captions(1)) == {}
    assert laws.edges(clean.mirrored()) == laws.edges(clean)
