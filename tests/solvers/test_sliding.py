"""The sliding limit against the paper's law, the truncated variation and a brute-force solution."""

from __future__ import annotations

import math
import random
from fractions import Fraction

import numpy as np
import pytest

from exactcreep.laws import pivots, prediction, sliding_velocity_random
from exactcreep.limits import Limits
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles, GaussianSteps, Path
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.model.state import State
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
    """Eq. 23 with max(0, .), its index i from Eq. 19 at mu_s = mu_d.

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


@pytest.mark.parametrize(("tan_alpha", "mu_d"), PYTHAGOREAN[:2])
@pytest.mark.parametrize("n", [2, 3, 4, 5, 8, 12])
def test_cycles_creep_exactly_at_the_plateau_law_cut_off_at_zero(n, tan_alpha, mu_d):
    chain = chain_of(n, tan_alpha, mu_d)
    threshold = Fraction(n, 2) * (mu_d - tan_alpha) * exact_cosine(chain) / chain.l0
    for factor in (Fraction(99, 100), 1, Fraction(101, 100), 17):
        amplitude = threshold * factor
        drive, laws = Cycles(amplitude, 5), printed_laws(chain, amplitude)
        simulation, recorded = simulate(chain, drive, record=("x_G", "x"))
        after_transient = [row[9] - row[5] for row in recorded["x"].T]
        assert len(resting_sliders(chain)) == len(laws)
        assert set(prediction(chain, drive).sliding) == {float(law) for law in laws}
        law = sum(laws) / len(laws)
        if len(laws) == 1:
            assert simulation.evidence is Evidence.PROVED
        assert after_transient == [4 * law] * n


def assert_least(chain, moved, tensions):
    """Assert that sliders that moved are at their friction, the right way, and no force beyond it.

    That is a state of least energy and friction: no other is, beside one slider below its friction.
    """
    cosine = exact_cosine(chain)
    most = chain.mu_d * cosine
    forces = np.diff([0, *tensions, 0]) + chain.tan_alpha * cosine
    for way, force in zip(moved, forces, strict=True):
        assert abs(force) <= most
        assert way == 0 or force == (most if way > 0 else -most)


@pytest.mark.parametrize("n", [2, 3, 4, 9])
def test_every_ramp_from_any_start_ends_in_the_state_of_least_energy_and_friction(n):
    rng, moves, relaxed = random.Random(n), 0, 0
    for _ in range(40):
        tan_alpha, mu_d = rng.choice(PYTHAGOREAN)
        chain = chain_of(n, tan_alpha * rng.choice([1, -1]), mu_d, l0=10)
        reach = rng.choice([20, 300])
        given = [Fraction(rng.randint(-reach, reach), 100) for _ in range(n - 1)]
        path = [Fraction(rng.randint(-1000, 1000), 2000) * n for _ in range(8)]
        start = State.prepared(chain, given)
        begun = Sliding(exact=True).simulation(chain, start, 0, ()).state()
        simulation, recorded = simulate(chain, Path(path), start=start, record=("x", "tension"))
        before, tensions = np.array([Fraction(0)] * n), np.array(given)
        theta = Fraction(0)
        rows = zip(recorded["x"], recorded["tension"], path, strict=True)
        relaxation = begun.displacements, begun.tensions, theta
        for x, after, target in [relaxation, *rows]:
            moved = x - before
            assert_least(chain, moved, after)
            stretched = np.diff(moved) - 10 * (target - theta)
            assert (after - tensions).tolist() == stretched.tolist()
            before, tensions, theta = x, after, target
            moves += any(moved)
        assert simulation.report()["start_relaxed"] == any(begun.displacements)
        relaxed += any(begun.displacements)
    assert moves > 100
    assert 5 < relaxed < 40


@pytest.mark.parametrize("n", [4, 12])
def test_at_half_the_friction_every_fourth_length_has_two_velocities(n):
    chain = chain_of(n, Fraction(1, 4))
    i = n // 4
    assert resting_sliders(chain) == (i, i + 1)
    amplitude = Fraction(n, 1000)
    high, low = printed_laws(chain, amplitude)
    reach = chain.l0 * amplitude - Fraction(n, 8) * exact_cosine(chain)
    assert low == (n // 2 - 1) * reach
    assert high == (n // 2 + 1) * reach
    velocities = {"uphill": low, "mean": (low + high) / 2, "downhill": high}
    for pivot, expected in velocities.items():
        simulation, recorded = simulate(chain, Cycles(amplitude, 6), pivot=pivot)
        assert recorded["x_G"][11] - recorded["x_G"][3] == 8 * expected
        assert simulation.evidence is Evidence.UNDECIDED
        assert simulation.tally.undecided == 12
        report = simulation.report()
        assert report["pivots"] == [i, i + 1]
        assert (report["velocity_low"], report["velocity_high"]) == (float(low), float(high))
        for end, name in (("uphill", "x_G_low"), ("downhill", "x_G_high")):
            _, there = simulate(chain, Cycles(amplitude, 6), pivot=end)
            assert report[name] == pytest.approx(float(there["x_G"][11]), rel=1e-14, abs=0)


def test_floats_agree_with_exact_numbers_and_do_not_drift():
    for n, tan_alpha in ((2, "0.25"), (5, "0.15"), (30, "-0.23")):
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
        assert floats.evidence is Evidence.COMPUTED


@pytest.mark.parametrize(("n", "sigma"), [(2, "0.002"), (6, "0.0008")])
def test_gaussian_driving_agrees_with_the_closed_form_within_three_standard_errors(n, sigma):
    chain = chain_of(n, Fraction(23, 100))
    blocks, length = 200, 1000
    _, recorded = simulate(chain, GaussianSteps(sigma, blocks * length), exact=False, seed=n)
    marks = recorded["x_G"][length - 1 :: length]
    steps = np.diff(marks) / length
    closed = sliding_velocity_random(
        n=n, l0=1000, mu_d=0.5, tan_alpha=0.23, sigma_theta=float(sigma)
    )
    error = steps.std(ddof=1) / math.sqrt(steps.size)
    assert error < 0.01 * closed
    assert abs(steps.mean() - closed) < 3 * error


@pytest.mark.parametrize(
    ("tan_alpha", "mu_d", "outcome", "evidence", "reason"),
    [
        ("-0.6", "0.5", Outcome.RUNAWAY, Evidence.PROVED, "|tan_alpha| > mu_d"),
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


def nine(exact, record=("x_G",)):
    chain = chain_of(9, Fraction(1, 5))
    return Sliding(exact=exact).simulation(chain, State.relaxed(chain), 0, record)


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
