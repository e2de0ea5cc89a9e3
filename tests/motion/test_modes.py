"""The exact motion of a run against independent formulas."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg

from derivations import modes as derived
from exactcreep.motion.arithmetic import FLOAT64, balls_of, digits_of
from exactcreep.motion.modes import Ends, Run, modes

ALL_ENDS = [Ends(left, right) for left in (False, True) for right in (False, True)]
ARITHMETICS = [FLOAT64, digits_of(150), balls_of(150)]


def stiffness(p: int, ends: Ends) -> np.ndarray:
    """Return K: 2 on the diagonal (1 at a free end), -1 beside it."""
    matrix = 2.0 * np.eye(p) - np.eye(p, k=1) - np.eye(p, k=-1)
    matrix[0, 0] -= ends.left_free
    matrix[-1, -1] -= ends.right_free
    return matrix


def exponential(p: int, ends: Ends, t: float, velocity: np.ndarray, acceleration: np.ndarray):
    """Displacement and velocity from u' = v, v' = a, a' = -K v."""
    generator = np.zeros((3 * p, 3 * p))
    generator[:p, p : 2 * p] = np.eye(p)
    generator[p : 2 * p, 2 * p :] = np.eye(p)
    generator[2 * p :, p : 2 * p] = -stiffness(p, ends)
    start = np.concatenate([np.zeros(p), velocity, acceleration])
    end = scipy.linalg.expm(generator * t) @ start
    return end[:p], end[p : 2 * p], end[2 * p :]


@pytest.mark.parametrize("arithmetic", ARITHMETICS, ids=lambda a: a.name)
@pytest.mark.parametrize("ends", ALL_ENDS)
def test_modal_motion_agrees_with_the_matrix_exponential(arithmetic, ends):
    rng = np.random.default_rng(20)
    for p in (1, 2, 3, 7, 12):
        velocity, acceleration = rng.normal(size=p), rng.normal(size=p)
        for t in (1e-6, 0.3, 3.0):
            expected = exponential(p, ends, t, velocity, acceleration)
            with arithmetic.active():
                motion = Run(
                    arithmetic, ends, arithmetic.vector(velocity), arithmetic.vector(acceleration)
                )
                time = arithmetic.number(t)
                found = *motion.moved(time), [motion.slider(n, time)[2] for n in range(p)]
                values = [np.array([float(x) for x in part]) for part in found]
            size = max(1.0, *(abs(part).max() for part in expected))
            for part, value in zip(expected, values, strict=True):
                assert abs(part - value).max() <= 1e-12 * size


@pytest.mark.parametrize("ends", ALL_ENDS)
def test_the_motion_at_many_times_is_that_at_each(ends):
    rng, times = np.random.default_rng(21), np.array([0.0, 1e-6, 0.3, 3.0])
    for p in (1, 2, 7):
        motion = Run(FLOAT64, ends, rng.normal(size=p), rng.normal(size=p))
        found = motion.at(times)
        each = [[motion.slider(n, t) for n in range(p)] for t in times.tolist()]
        assert found == pytest.approx(np.array(each).T, rel=1e-13, abs=1e-14)


@pytest.mark.parametrize("ends", ALL_ENDS)
def test_modal_energy_is_conserved_and_bounds_every_derivative(ends):
    rng = np.random.default_rng(21)
    p = 6
    k = stiffness(p, ends)
    motion = Run(FLOAT64, ends, rng.normal(size=p), rng.normal(size=p))
    inverse = np.linalg.pinv(k)
    mean = 1.0 / p if ends.left_free and ends.right_free else 0.0
    for t in np.linspace(0.0, 40.0, 33):
        v = motion.moved(t)[1]
        a = np.array([motion.slider(n, t)[2] for n in range(p)])
        bare = v - mean * v.sum()
        assert bare @ bare + a @ inverse @ a == pytest.approx(motion.energy, rel=1e-12)
        derivatives = [v, a, -k @ v, -k @ a, k @ k @ v]
        for order in (2, 3, 4) if mean else (0, 1, 2, 3, 4):
            for n in range(p):
                assert abs(derivatives[order][n]) <= motion.bound(n, order) * (1 + 1e-12)


@pytest.mark.parametrize("ends", ALL_ENDS)
def test_float_modes_keep_their_digits_in_a_run_of_300(ends):
    rng = np.random.default_rng(22)
    velocity, acceleration = rng.normal(size=300), rng.normal(size=300)
    fast = Run(FLOAT64, ends, velocity, acceleration)
    balls = balls_of(120)
    with balls.active():
        sure = Run(balls, ends, balls.vector(velocity), balls.vector(acceleration))
        for t in (1e-3, 0.7):
            for computed, proved in zip(fast.moved(t), sure.moved(balls.number(t)), strict=True):
                errors = [abs(float(b - float(a))) for a, b in zip(computed, proved, strict=True)]
                assert max(errors) <= 3e-15 * abs(computed).max()


@pytest.mark.parametrize("ends", ALL_ENDS)
def test_frequencies_and_vectors_are_those_that_are_derived(ends):
    [kind] = [
        kind for kind in derived.KINDS if (kind.left == "free", kind.right == "free") == tuple(ends)
    ]
    for p in range(1, 9):
        table = modes(FLOAT64, p, ends)
        for column in range(p):
            angle = kind.angle.subs({derived.p: p, derived.q: column + kind.first})
            at = {derived.phi: angle, derived.p: p}
            shape = [float(kind.shape.subs(derived.n, n).subs(at)) for n in range(1, p + 1)]
            square = p if angle == 0 else float(kind.square.subs(derived.p, p))
            found = np.array(table.vectors[:, column], dtype=float)
            assert abs(table.frequencies[column] - 2 * np.sin(float(angle) / 2)) < 1e-15
            assert abs(found - np.array(shape) / np.sqrt(square)).max() < 1e-14
