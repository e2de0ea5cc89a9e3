"""The sliding limit against the paper's law, the truncated variation and a brute-force solution."""

from __future__ import annotations

import itertools
import math
import random
from fractions import Fraction

import numpy as np
import pytest
from flint import fmpq_mat
from scipy.integrate import quad
from scipy.stats import norm

from derivations.chain import play_variation
from exactcreep.laws import pivots, prediction
from exactcreep.limits import Limits, Stop
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles, GaussianSteps, Path
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.model.state import State
from exactcreep.motion.cosine_field import Quadratic
from exactcreep.solvers import sliding
from exactcreep.solvers.sliding import Sliding, exact_cosine

PYTHAGOREAN = [
    (Fraction(3, 4), Fraction(9, 10)),
    (Fraction(5, 12), Fraction(1, 2)),
    (Fraction(8, 15), Fraction(3, 5)),
    (Fraction(7, 24), Fraction(1, 2)),
]


def chain_of(n, tan_alpha, mu_d=Fraction(1, 2), l0=1000):
    return Chain(n, l0, mu_d, mu_d + Fraction(1, 10), tan_alpha=tan_alpha)


def simulate(chain, drive, *, exact=True, pivot="mean", start=None, record=("x_G",), seed=0):
    start = State.relaxed(chain) if start is None else start
    simulation = Sliding(exact=exact, pivot=pivot).simulation(chain, start, seed, record)
    stretch = simulation.follow(drive, 1, drive.half_cycles)
    assert stretch.completed == drive.half_cycles
    return simulation, stretch.recorded


def resting_sliders(chain):
    return tuple(i - 1 for i in pivots(chain.n, chain.tan_alpha, chain.mu_d))


def printed_laws(chain, amplitude):
    """Eq. (vitesse_seuil) with max(0, .), its index i from Eq. (critical_angle) at mu_s = mu_d.

    Two values, the larger first, where the slope is the edge between two indices.
    """
    n, t = chain.n, chain.tan_alpha
    fits = [
        i
        for i in range(2, n + 2)
        if chain.mu_d * (1 - Fraction(2 * (i - 1), n)) <= t
        and t <= chain.mu_d * (1 - Fraction(2 * (i - 2), n))
    ]
    c = exact_cosine(chain)
    reach = chain.l0 * amplitude - Fraction(n, 2) * (chain.mu_d * c - t * c)
    return [(n + 3 - 2 * i) * max(Fraction(0), reach) for i in fits]


@pytest.mark.parametrize(("tan_alpha", "mu_d"), PYTHAGOREAN)
@pytest.mark.parametrize("n", [2, 3, 4, 5, 8, 9, 12])
def test_cycles_creep_exactly_at_the_plateau_law_cut_off_at_zero(n, tan_alpha, mu_d):
    chain = chain_of(n, tan_alpha, mu_d)
    threshold = Fraction(n, 2) * (mu_d - tan_alpha) * exact_cosine(chain) / chain.l0
    for factor in (Fraction(1, 3), Fraction(99, 100), 1, Fraction(101, 100), 2, 17):
        amplitude = threshold * factor
        drive, laws = Cycles(amplitude, 5), printed_laws(chain, amplitude)
        simulation, recorded = simulate(chain, drive, record=("x_G", "x"))
        after_transient = [row[9] - row[5] for row in recorded["x"].T]
        assert len(resting_sliders(chain)) == len(laws)
        assert prediction(chain, drive).sliding == tuple(sorted({float(law) for law in laws}))
        law = sum(laws) / len(laws)
        if len(laws) == 1:
            assert simulation.evidence is Evidence.PROVED
        assert after_transient == [4 * law] * n
        assert recorded["x_G"][9] - recorded["x_G"][5] == 4 * law
        assert isinstance(recorded["x_G"][9], Fraction)


@pytest.mark.parametrize("n", [2, 3, 5, 8])
def test_an_irrational_cosine_is_kept_exactly(n):
    chain = chain_of(n, Fraction(1, 5))
    amplitude = Fraction(n, 500)
    _, recorded = simulate(chain, Cycles(amplitude, 4))
    advance = recorded["x_G"][7] - recorded["x_G"][3]
    assert isinstance(advance, Quadratic)
    (law,) = printed_laws(chain, amplitude)
    assert advance == 4 * law
    c = 1 / math.sqrt(1 + 0.04)
    (i,) = resting_sliders(chain)
    floats = (n + 1 - 2 * i) * (2.0 * n - n / 2 * (0.5 - 0.2) * c)
    assert float(advance) == pytest.approx(4 * floats, rel=1e-14, abs=0)


def brute_force(chain, tensions, theta, path):
    """Displacements along `path` for N <= 4, by trying every set of sliding sliders (rationals).

    Knows only: |F_n| <= b; a slider moves downhill only at F = b, uphill only at -b, and while it
    moves its force stays there. The rates follow from linear equations for each trial set.
    """
    n, c = chain.n, exact_cosine(chain)
    b, s = chain.mu_d * c, chain.tan_alpha * c
    tension = [Fraction(0), *tensions, Fraction(0)]
    x = [Fraction(0)] * n
    for target in path:
        way = 1 if target > theta else -1
        left = chain.l0 * abs(target - theta)
        theta = target
        while left > 0:
            force = [tension[k + 1] - tension[k] + s for k in range(n)]
            rates = rate_of(force, b, way)
            pulls = [(rates[k + 1] - rates[k] - way) for k in range(n - 1)]
            grow = [0, *pulls, 0]
            step = left
            for k in range(n):
                slope = grow[k + 1] - grow[k]
                if slope > 0 and force[k] < b:
                    step = min(step, (b - force[k]) / slope)
                elif slope < 0 and force[k] > -b:
                    step = min(step, (-b - force[k]) / slope)
            x = [value + step * rate for value, rate in zip(x, rates, strict=True)]
            tension = [value + step * slope for value, slope in zip(tension, grow, strict=True)]
            left -= step
    return x, tension[1:-1]


def rate_of(force, b, way):
    n = len(force)
    ready = [k for k in range(n) if abs(force[k]) == b]
    solutions = []
    for size in range(len(ready) + 1):
        for moving in itertools.combinations(ready, size):
            rates = solve_rates(n, moving, way)
            if rates is None:
                continue
            stretch = [0, *(rates[k + 1] - rates[k] - way for k in range(n - 1)), 0]
            slopes = [stretch[k + 1] - stretch[k] for k in range(n)]
            if all(
                (rates[k] * force[k] > 0 if k in moving else slopes[k] * force[k] <= 0)
                for k in ready
            ):
                solutions.append(rates)
    assert len({tuple(rates) for rates in solutions}) == 1
    return solutions[0]


def solve_rates(n, moving, way):
    """Rates of the moving sliders that keep their forces constant; None if they do not fix them."""
    rates = [Fraction(0)] * n
    if not moving:
        return rates
    stretched = np.diff(np.eye(n, dtype=int), axis=0)  # springs, by the rates of sliders
    pulls = -stretched.T[list(moving)]  # forces, by the tensions of springs
    balance = (pulls @ stretched[:, list(moving)]).tolist()
    driven = [[int(way * pull)] for pull in pulls.sum(axis=1)]
    try:
        solution = fmpq_mat(balance).solve(fmpq_mat(driven))
    except ZeroDivisionError:
        return None
    for k, rate in zip(moving, solution.tolist(), strict=True):
        rates[k] = Fraction(int(rate[0].p), int(rate[0].q))
    return rates


@pytest.mark.parametrize("n", [2, 3, 4])
def test_random_paths_and_starts_agree_with_a_brute_force_search_over_sliding_sets(n):
    rng = random.Random(n)
    compared = 0
    while compared < 25:
        tan_alpha, mu_d = rng.choice(PYTHAGOREAN)
        chain = chain_of(n, tan_alpha, mu_d, l0=10)
        if len(resting_sliders(chain)) == 2:
            continue
        c = exact_cosine(chain)
        tensions = [Fraction(0)]
        for _ in range(n - 1):  # a random rest state, then closed to T_N = 0 if it can be
            push = Fraction(rng.randint(-97, 97), 100) * mu_d * c
            tensions.append(tensions[-1] + push - tan_alpha * c)
        if abs(-tensions[-1] + tan_alpha * c) > mu_d * c:
            continue
        path = [Fraction(rng.randint(-1000, 1000), 2000) * n for _ in range(8)]
        start = State.prepared(chain, tensions[1:])
        simulation, _ = simulate(chain, Path(path), start=start)
        end = simulation.state()
        x, reached = brute_force(chain, tensions[1:], Fraction(0), path)
        assert end.displacements.tolist() == x
        assert end.tensions.tolist() == reached
        compared += 1


@pytest.mark.parametrize("n", [2, 3, 4, 6, 7, 11])
def test_displacement_along_any_path_is_the_truncated_variation(n):
    rng = random.Random(100 + n)
    tan_alpha, mu_d = PYTHAGOREAN[n % 4]
    chain = chain_of(n, tan_alpha, mu_d, l0=100)
    extreme = Fraction(n, 10)
    for _ in range(10):
        wander = [Fraction(rng.randint(-1000, 1000), 10**4) * n for _ in range(30)]
        closed = [-extreme, *wander, extreme, -extreme]
        _, recorded = simulate(chain, Path([extreme, *closed]), record=("x_G", "x"))
        moved = recorded["x"][-1] - recorded["x"][1]
        (i,) = resting_sliders(chain)
        level = n * (mu_d - tan_alpha) * exact_cosine(chain)
        places = [chain.l0 * theta for theta in closed]
        _, rise, fall = play_variation(places, level, places[0] + level / 2)
        assert moved.tolist() == [(n + 1 - 2 * i) * (rise + fall) / 2] * n


@pytest.mark.parametrize("n", [4, 8, 12])
def test_at_half_the_friction_every_fourth_length_has_two_velocities(n):
    chain = chain_of(n, Fraction(1, 4))
    i = n // 4
    assert resting_sliders(chain) == (i, i + 1)
    amplitude = Fraction(n, 1000)
    high, low = printed_laws(chain, amplitude)
    reach = chain.l0 * amplitude - Fraction(n, 8) * exact_cosine(chain)
    assert (low, high) == ((n // 2 - 1) * reach, (n // 2 + 1) * reach)
    for pivot, expected in (("uphill", low), ("mean", (low + high) / 2), ("downhill", high)):
        simulation, recorded = simulate(chain, Cycles(amplitude, 6), pivot=pivot)
        assert recorded["x_G"][11] - recorded["x_G"][3] == 8 * expected
        assert simulation.evidence is Evidence.UNDECIDED
        assert simulation.tally.undecided == 12
        report = simulation.report()
        assert report["pivots"] == [i, i + 1]
        assert (report["velocity_low"], report["velocity_high"]) == (float(low), float(high))
        ends = [
            float(simulate(chain, Cycles(amplitude, 6), pivot=end)[1]["x_G"][11])
            for end in ("uphill", "downhill")
        ]
        assert [report["x_G_low"], report["x_G_high"]] == pytest.approx(ends, rel=1e-14, abs=0)


def test_an_open_pivot_that_never_matters_leaves_the_result_proved_and_a_lone_slider_rests():
    for chain in (chain_of(4, Fraction(1, 4)), chain_of(1, Fraction(1, 2))):
        simulation, recorded = simulate(chain, Cycles("1e-5", 6))
        assert recorded["x_G"].tolist() == [0] * 12
        assert (simulation.evidence, simulation.tally.slips) == (Evidence.PROVED, 0)
    assert prediction(chain_of(4, Fraction(1, 4)), Cycles("1e-5", 6)).sliding == (0.0,)


@pytest.mark.parametrize("n", range(2, 13))
def test_the_tie_is_decided_by_rationals_a_hair_on_either_side(n):
    hair = Fraction(1, 10**40)
    for z in range(1, n):
        edge = Fraction(1, 2) * (1 - Fraction(2 * z, n))
        assert resting_sliders(chain_of(n, edge)) == (z, z + 1)
        assert resting_sliders(chain_of(n, edge + hair)) == (z,)
        assert resting_sliders(chain_of(n, edge - hair)) == (z + 1,)


@pytest.mark.parametrize("n", [2, 3, 6, 7])
def test_the_mirror_image_creeps_exactly_the_other_way(n):
    down = chain_of(n, *PYTHAGOREAN[1])
    path = Path([Fraction(k * (-1) ** k, 700) for k in range(1, 20)])
    _, one = simulate(down, path, record=("x",))
    _, other = simulate(down.mirrored(), path, record=("x",))
    assert np.array_equal(one["x"], -other["x"][:, ::-1])


def test_floats_agree_with_exact_numbers_and_do_not_drift():
    for n, tan_alpha in ((2, "0.25"), (5, "0.15"), (30, "0.23"), (30, "-0.23")):
        chain = chain_of(n, tan_alpha)
        drive = GaussianSteps("0.01", 400 if n < 30 else 100)
        exact, one = simulate(chain, drive, record=("x", "tension", "slips"))
        floats, other = simulate(chain, drive, exact=False, record=("x", "tension", "slips"))
        largest = max(abs(float(v)) for v in one["x"][-1]) + 30.0
        for name in ("x", "tension"):
            gap = one[name].astype(float) - other[name]
            assert np.abs(gap).max() < 400 * 2**-52 * largest
        assert np.array_equal(one["slips"], other["slips"])
        assert exact.tally.slips == floats.tally.slips == int(one["slips"].sum())
        assert exact.tally.events == floats.tally.events
        assert exact.tally.slips < exact.tally.events <= 2 * exact.tally.slips
        assert floats.evidence is Evidence.COMPUTED


def gaussian_integral(h):
    def density(z):
        up, down = norm.cdf(z - h), norm.cdf(-z - h)
        return up * down / (up + down)

    return 2 * quad(density, 0, 30, epsabs=1e-13, epsrel=1e-12)[0]


@pytest.mark.parametrize(("n", "sigma"), [(2, "0.002"), (6, "0.0008"), (6, "0.002"), (15, "0.002")])
def test_gaussian_driving_agrees_with_the_closed_form_within_three_standard_errors(n, sigma):
    chain = chain_of(n, Fraction(23, 100))
    blocks, length = 200, 1000
    _, recorded = simulate(chain, GaussianSteps(sigma, blocks * length), exact=False, seed=n)
    marks = recorded["x_G"][length - 1 :: length]
    steps = np.diff(marks) / length
    (i,) = resting_sliders(chain)
    spread = 1000 * float(sigma)
    h = n * (0.5 - 0.23) * chain.cos_alpha / (2 * spread)
    closed = (n + 1 - 2 * i) * spread * gaussian_integral(h)
    error = steps.std(ddof=1) / math.sqrt(steps.size)
    assert error < 0.01 * closed
    assert abs(steps.mean() - closed) < 3 * error


def test_equal_coefficients_need_no_other_treatment():
    equal = Chain(7, 1000, "0.5", "0.5", tan_alpha="0.2")
    apart = Chain(7, 1000, "0.5", "0.9", "0.05", tan_alpha="0.2")
    drive = GaussianSteps("0.003", 100)
    assert simulate(equal, drive)[1]["x_G"].tolist() == simulate(apart, drive)[1]["x_G"].tolist()
    assert simulate(equal, drive)[0].report()["static_excess_left_out"] is False
    assert simulate(apart, drive)[0].report()["static_excess_left_out"] is True


@pytest.mark.parametrize("exact", [False, True])
def test_a_dummy_breakpoint_changes_nothing(exact):
    chain = chain_of(5, Fraction(1, 5))
    path = [Fraction(k) for k in ("0.01", "-0.02", "0.015", "0.03", "-0.001")]
    path = [value.limit_denominator(1024) for value in path]
    refined = [Fraction(0)]
    for value in path:
        refined += [(refined[-1] + value) / 2, value]
    plain, one = simulate(chain, Path(path), exact=exact, record=("x",))
    fine, other = simulate(chain, Path(refined[1:]), exact=exact, record=("x",))
    if exact:
        assert one["x"].tolist() == other["x"][1::2].tolist()
    else:
        assert np.abs(one["x"] - other["x"][1::2]).max() < 20 * np.spacing(30.0)
    assert plain.tally.slips == fine.tally.slips


@pytest.mark.parametrize(
    ("tan_alpha", "mu_d", "outcome", "evidence", "reason"),
    [
        ("0.6", "0.5", Outcome.RUNAWAY, Evidence.PROVED, "|tan_alpha| > mu_d"),
        ("-0.6", "0.5", Outcome.RUNAWAY, Evidence.PROVED, "|tan_alpha| > mu_d"),
        ("0.5", "0.5", Outcome.LIMIT, Evidence.UNDECIDED, "|tan_alpha| = mu_d"),
        ("-0.5", "0.5", Outcome.LIMIT, Evidence.UNDECIDED, "|tan_alpha| = mu_d"),
        ("0", "0", Outcome.LIMIT, Evidence.UNDECIDED, "|tan_alpha| = mu_d"),
    ],
)
def test_from_mu_d_on_no_static_solution_holds_the_chain_in_one_place(
    tan_alpha, mu_d, outcome, evidence, reason
):
    chain = chain_of(3, Fraction(tan_alpha), Fraction(mu_d))
    simulation = Sliding().simulation(chain, State.relaxed(chain), 0, ("x_G",))
    stretch = simulation.follow(Cycles("0.01", 3), 1, 6)
    assert (stretch.completed, stretch.stop.value) == (0, outcome.value)
    assert reason in stretch.reason
    assert simulation.evidence is evidence
    assert prediction(chain, Cycles("0.01", 3)) is None


@pytest.mark.parametrize("n", [2, 3, 5, 8])
def test_a_start_that_friction_cannot_hold_goes_to_the_nearest_rest_state(n):
    rng = random.Random(n)
    tan_alpha, mu_d = PYTHAGOREAN[3]
    chain = chain_of(n, tan_alpha, mu_d)
    c = exact_cosine(chain)
    for _ in range(20):
        given = [Fraction(rng.randint(-300, 300), 100) for _ in range(n - 1)]
        start = State.prepared(chain, given)
        simulation = Sliding(exact=True).simulation(chain, start, 0, ("x_G",))
        end = simulation.state()
        tensions, x = end.tensions.tolist(), end.displacements.tolist()
        force = np.diff([0, *tensions, 0]) + tan_alpha * c
        assert all(abs(f) <= mu_d * c for f in force)
        # the conditions for the least elastic energy: sliders that moved are at their friction, the
        # right way, and tensions changed by what the sliders moved
        assert all(
            v == 0 or (v > 0 and f == mu_d * c) or (v < 0 and f == -mu_d * c)
            for v, f in zip(x, force, strict=True)
        )
        assert np.diff(x).tolist() == [t - g for t, g in zip(tensions, given, strict=True)]
        held = all(abs(f) <= mu_d * c for f in np.diff([0, *given, 0]) + tan_alpha * c)
        assert simulation.report()["start_relaxed"] is not held


@pytest.mark.parametrize("exact", [False, True])
@pytest.mark.parametrize("given", [["0.9"], ["-0.9"], ["0.9", "2", "0.9"]])
def test_a_level_chain_that_pulls_itself_together_stays_its_own_mirror_image(given, exact):
    chain, shift = chain_of(len(given) + 1, 0), {}
    start = State.prepared(chain, given)
    for pivot in ("mean", "downhill", "uphill"):
        simulation = Sliding(exact=exact, pivot=pivot).simulation(chain, start, 0, ())
        x = simulation.state().displacements
        shift[pivot] = x.sum() / chain.n
        assert simulation.evidence is Evidence.UNDECIDED
        ends = [simulation.report()[f"x_G_{end}"] for end in ("low", "high")]
        if pivot == "mean":
            assert x.astype(float) == pytest.approx(-x[::-1].astype(float), abs=1e-15)
            middle = ends
        assert ends == pytest.approx(middle, abs=1e-15)
    assert [float(shift[pivot]) for pivot in ("uphill", "downhill")] == pytest.approx(middle)


def nine(exact, record=("x_G",)):
    chain = chain_of(9, Fraction(1, 5))
    return Sliding(exact=exact).simulation(chain, State.relaxed(chain), 0, record)


@pytest.mark.parametrize("exact", [False, True])
def test_a_budget_ends_with_the_half_cycle_that_uses_it_up(exact):
    drive, single, events = Cycles("0.007", 20), nine(exact), []
    for q in range(1, 41):
        single.follow(drive, q, 1)
        events.append(single.tally.events)
    for budget in (1, 30, 100, events[20], events[20] + 1):
        stretch = nine(exact).follow(drive, 1, 40, Limits(budget))
        assert stretch.stop is Stop.BUDGET
        assert events[stretch.completed - 1] >= budget
        assert all(used < budget for used in events[: stretch.completed - 1])


@pytest.mark.parametrize("exact", [False, True])
def test_a_deadline_is_heard_between_half_cycles_and_changes_no_bit(exact, monkeypatch):
    monkeypatch.setattr(sliding, "_PAUSE", 50)  # sliders times half-cycles
    drive, simulation, pieces = GaussianSteps("0.007", 40), nine(exact, ("x_G", "x")), []
    while len(pieces) < 40:
        left = 40 - len(pieces)
        stretch = simulation.follow(drive, len(pieces) + 1, left, Limits(at=0.0))
        assert stretch.completed == min(1 if exact else 5, left)
        assert len(stretch.recorded["x"]) == stretch.completed
        pieces += stretch.recorded["x_G"].tolist()
    _, recorded = simulate(chain_of(9, Fraction(1, 5)), drive, exact=exact)
    assert pieces == recorded["x_G"].tolist()
