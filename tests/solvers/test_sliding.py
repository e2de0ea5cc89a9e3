"""The sliding limit against the paper's law, the truncated variation and a brute-force solution."""

from __future__ import annotations

import math
import random
from fractions import Fraction

import numpy as np
import pytest

from exactcreep import InputError, creep
from exactcreep.laws import pivots, prediction, sliding_velocity_random
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles, GaussianSteps, Path
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.model.state import State
from exactcreep.solvers.nearest_rest import brought_to_rest
from exactcreep.solvers.sliding import Sliding, relaxed_cycle
from tests.laws.test_differing import chains, forces
from tests.oracle.incremental import follow

PYTHAGOREAN = [
    (Fraction(3, 4), Fraction(9, 10)),
    (Fraction(5, 12), Fraction(1, 2)),
    (Fraction(8, 15), Fraction(3, 5)),
    (Fraction(7, 24), Fraction(1, 2)),
]


def chain_of(n, tan_alpha, mu_d=Fraction(1, 2), l0=1000):
    return Chain(n, l0, mu_d, mu_d + Fraction(1, 10), tan_alpha=tan_alpha)


def exact_cosine(chain):
    """Return cos(alpha), of a Pythagorean slope: a rational."""
    square = 1 / (1 + chain.tan_alpha**2)
    cosine = Fraction(math.isqrt(square.numerator), math.isqrt(square.denominator))
    assert cosine**2 == square
    return cosine


def frictions(chain):
    """Return how far a tension may fall and rise from spring to spring."""
    cosine = exact_cosine(chain)
    return (chain.mu_d + chain.tan_alpha) * cosine, (chain.mu_d - chain.tan_alpha) * cosine


def brute_force(chain, targets, tensions, share=Fraction(1, 2)):
    """Yield the displacements and tensions at every target, in rationals.

    Every spring is taken to its bound by itself. What moves the sliders is the extension: about
    slider i by Eq. (critical_angle), and where two may be the pivot, as much about each as `share`
    says of the upper one.
    """
    uphill, downhill = frictions(chain)
    n, theta, x = chain.n, Fraction(0), np.array([Fraction(0)] * chain.n)
    tensions = np.array(tensions, dtype=object)
    for target in targets:
        stretch = chain.l0 * (target - theta)
        after = []
        for k, tension in enumerate(tensions, 1):
            least = -min(k * uphill, (n - k) * downhill)
            most = min(k * downhill, (n - k) * uphill)
            after.append(
                max(tension - stretch, least) if stretch > 0 else min(tension - stretch, most)
            )
        apart = np.array([Fraction(0), *np.cumsum(np.array(after) - tensions + stretch)])
        pivots_here = [i - 1 for i in resting_sliders(chain)]
        if stretch < 0:
            pivots_here = [n - 1 - i for i in pivots_here][::-1]
        x = x + apart - (share * apart[pivots_here[0]] + (1 - share) * apart[pivots_here[-1]])
        tensions, theta = np.array(after, dtype=object), target
        yield x, tensions


def exact_targets(drive):
    return [drive.exact_target(q, 0) for q in range(1, drive.half_cycles + 1)]


def simulate(chain, drive, *, start=None, record=("x_G",), seed=0):
    start = State.relaxed(chain) if start is None else start
    simulation = Sliding().simulation(chain, start, seed, record)
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
        rows = [x for x, _ in brute_force(chain, exact_targets(drive), [0] * (n - 1))]
        assert len(resting_sliders(chain)) == len(laws)
        assert set(prediction(chain, drive).sliding) == {float(law) for law in laws}
        law = sum(laws) / len(laws)
        assert (rows[9] - rows[5]).tolist() == [4 * law] * n
        simulation, recorded = simulate(chain, drive, record=("x_G", "x"))
        undecided = len(laws) > 1 and factor > 1
        # floats cannot tell the threshold itself from what is just above it
        assert factor == 1 or (simulation.evidence is Evidence.UNDECIDED) == undecided
        assert recorded["x"][9] == pytest.approx(rows[9].astype(float), rel=1e-13, abs=1e-13)


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
    rng, moves, moved_at_first = random.Random(n), 0, 0
    for _ in range(40):
        tan_alpha, mu_d = rng.choice(PYTHAGOREAN)
        chain = chain_of(n, tan_alpha * rng.choice([1, -1]), mu_d, l0=10)
        reach = rng.choice([20, 300])
        given = [Fraction(rng.randint(-reach, reach), 100) for _ in range(n - 1)]
        path = [Fraction(rng.randint(-1000, 1000), 2000) * n for _ in range(8)]
        reaches = [[reach] * n for reach in frictions(chain)]
        tensions, shift, _ = brought_to_rest(given, *reaches, Fraction(1, 2))
        assert_least(chain, shift, tensions)
        assert np.diff(shift).tolist() == [b - a for a, b in zip(given, tensions, strict=True)]
        before, rows = np.array([Fraction(0)] * n), [*brute_force(chain, path, tensions)]
        for x, after in rows:
            assert_least(chain, x - before, after)
            moves += any(x - before)
            before = x
        start = State.prepared(chain, given)
        simulation, recorded = simulate(chain, Path(path), start=start, record=("x", "tension"))
        for name, exact in (("x", [x + shift for x, _ in rows]), ("tension", [t for _, t in rows])):
            assert recorded[name] == pytest.approx(np.array(exact, dtype=float), abs=1e-12)
        assert simulation.report()["start_relaxed"] == any(shift)
        moved_at_first += any(shift)
    assert moves > 100
    assert 5 < moved_at_first < 40


@pytest.mark.parametrize("n", [4, 12])
def test_at_half_the_friction_every_fourth_length_has_two_velocities(n):
    chain = chain_of(n, Fraction(5, 12), Fraction(5, 6))
    i = n // 4
    assert resting_sliders(chain) == (i, i + 1)
    amplitude = Fraction(n, 1000)
    high, low = map(float, printed_laws(chain, amplitude))
    middle, _ = divmod(n, 2)
    simulation, recorded = simulate(chain, Cycles(amplitude, 6))
    assert recorded["x_G"][11] - recorded["x_G"][3] == pytest.approx(4 * (low + high), rel=1e-13)
    assert high / low == pytest.approx((middle + 1) / (middle - 1))
    assert simulation.evidence is Evidence.UNDECIDED
    assert simulation.tally.undecided == 12
    report = simulation.report()
    assert report["pivots"] == [i, i + 1]
    assert (report["velocity_low"], report["velocity_high"]) == pytest.approx(
        (low, high), rel=1e-14
    )
    x_g = (report["x_G_low"] + report["x_G_high"]) / 2
    assert x_g == pytest.approx(recorded["x_G"][11], rel=1e-14)
    assert report["x_G_high"] - report["x_G_low"] > 5 * (high - low)


@pytest.mark.parametrize("slope", [Fraction(1, 4), Fraction(23, 100)])
def test_a_tie_of_pivots_is_decided_on_the_rationals_of_the_chain(slope):
    """No float64 is 1/4 - 1e-30: near it one slider is the pivot, and nothing is left open."""
    for near in (slope, slope - Fraction(1, 10**30), slope + Fraction(1, 10**30)):
        simulation, _ = simulate(chain_of(12, near), Cycles(Fraction(12, 1000), 6))
        tie = near == Fraction(1, 4)
        assert (simulation.tally.undecided > 0) == tie
        assert len(simulation.report()["pivots"]) == 1 + tie


def test_floats_agree_with_rationals_and_do_not_drift():
    for n, tan_alpha in ((2, Fraction(3, 4)), (5, Fraction(5, 12)), (30, Fraction(-7, 24))):
        chain = chain_of(n, tan_alpha, Fraction(9, 10))
        drive = GaussianSteps("0.01", 400 if n < 30 else 100)
        exact = [*brute_force(chain, exact_targets(drive), [0] * (n - 1))]
        simulation, recorded = simulate(chain, drive, record=("x", "tension", "slips"))
        largest = np.abs(recorded["x"][-1]).max() + 30.0
        for name, k in (("x", 0), ("tension", 1)):
            gap = np.array([row[k] for row in exact], dtype=float) - recorded[name]
            assert np.abs(gap).max() < 400 * 2**-52 * largest
        assert simulation.tally.slips == int(recorded["slips"].sum())
        assert simulation.evidence is Evidence.COMPUTED


@pytest.mark.parametrize(("n", "sigma"), [(2, "0.002"), (6, "0.0008")])
def test_gaussian_driving_agrees_with_the_closed_form_within_three_standard_errors(n, sigma):
    chain = chain_of(n, Fraction(23, 100))
    blocks, length = 200, 1000
    _, recorded = simulate(chain, GaussianSteps(sigma, blocks * length), seed=n)
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


def differing_chain(friction, slope, ends, l0=10):
    return Chain(len(friction), l0, friction, friction, tan_alpha=slope, end_forces=ends)


def test_chains_of_differing_friction_and_pulled_ends_minimise_energy_and_dissipation():
    """From relaxed and other starts, on any path; and their cycles are those of the law."""
    rng = random.Random(3)
    for k, (friction, slope, ends) in enumerate(chains(30, seed=9)):
        chain = differing_chain(friction, slope, ends)
        start = [Fraction(rng.randint(-100, 100), 100) * (k % 2) for _ in friction[1:]]
        path = [Fraction(rng.randint(-60, 60), 40) for _ in range(8)]
        simulation, recorded = simulate(
            chain, Path(path), start=State.prepared(chain, start), record=("x", "tension")
        )
        places = [0.0, *(float(chain.l0 * target) for target in path)]
        x, tension = follow(*forces(friction, slope, ends), places, tensions=start)
        assert recorded["x"] == pytest.approx(x[1:], abs=1e-10)
        assert recorded["tension"] == pytest.approx(tension[1:], abs=1e-10)
        assert simulation.report()["unique"]
        amplitude = Fraction(rng.randint(1, 80), 40)
        law = prediction(chain, Cycles(amplitude, 9))
        assert law.deviation == 0
        ((advance, _),) = relaxed_cycle(chain, amplitude, 5)
        assert float(advance) / 2 == pytest.approx(law.values[0], abs=1e-12)


def test_between_two_possible_pivots_of_a_differing_chain_both_velocities_are_given():
    """Friction 3, 1, 2 and no pull: sliders 1 and 2 share a spring, as do those mirrored."""
    chain = differing_chain([Fraction(3), Fraction(1), Fraction(2)], Fraction(0), (0, 0))
    simulation, recorded = simulate(chain, Cycles(2, 6), record=("x",))
    low, high = prediction(chain, Cycles(2, 6)).values
    report = simulation.report()
    assert (report["velocity_low"], report["velocity_high"], report["unique"]) == (low, high, False)
    advance = (recorded["x"][-1] - recorded["x"][-3]).mean() / 2
    assert low < advance < high
    assert [float(found) / 2 for found, _ in relaxed_cycle(chain, Fraction(2), 4)] == [high, low]


@pytest.mark.parametrize(
    ("ends", "outcome"),
    [((0, "1.6"), Outcome.RUNAWAY), ((0, "1.5"), Outcome.LIMIT), (("-1.6", 0), Outcome.RUNAWAY)],
)
def test_end_forces_that_exceed_all_friction_carry_the_chain_away(ends, outcome):
    chain = Chain(3, 10, "0.5", "0.6", tan_alpha=0, end_forces=ends)
    assert creep(chain, Cycles("0.9", 4), solver="sliding").outcome is outcome
    assert prediction(chain, Cycles("0.9", 4)) is None


def test_springs_that_expand_by_different_weights_are_refused_by_name():
    chain = Chain(3, 10, "0.5", "0.5", tan_alpha="0.1", expansion=[1, 2])
    with pytest.raises(InputError, match="expansion"):
        simulate(chain, Cycles(1, 4))
    assert prediction(chain, Cycles(1, 4)) is None
