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
    beside = np.eye(p, k=1) + np.eye(p, k=-1)
    matrix = 2.0 * np.eye(p) - beside
    matrix[0, 0] -= ends.left_free
    matrix[-1, -1] -= ends.right_free
    return matrix


def exponential(p: int, ends: Ends, t: float, *begin: np.ndarray) -> list[np.ndarray]:
    """Displacement and velocity from u' = v, v' = a, a' = -K v."""
    one, none = np.eye(p), np.zeros((p, p))
    rows = [
        [none, one, none],
        [none, none, one],
        [none, -stiffness(p, ends), none],
    ]
    start = np.concatenate([np.zeros(p), *begin])
    return np.split(scipy.linalg.expm(np.block(rows) * t) @ start, 3)


@pytest.mark.parametrize("arithmetic", ARITHMETICS, ids=lambda a: a.name)
@pytest.mark.parametrize("ends", ALL_ENDS)
def test_modal_motion_agrees_with_the_matrix_exponential(arithmetic, ends):
    rng = np.random.default_rng(20)
    for p in (1, 2, 3, 7, 12):
        velocity, acceleration = rng.normal(size=p), rng.normal(size=p)
        for t in (1e-6, 0.3, 3.0):
            expected = exponential(p, ends, t, velocity, acceleration)
            with arithmetic.active():
                begin = arithmetic.vector(velocity), arithmetic.vector(acceleration)
                motion = Run(arithmetic, ends, *begin)
                time = arithmetic.number(t)
                pulled = [motion.slider(n, time)[2] for n in range(p)]
                values = []
                for part in (*motion.moved(time), pulled):
                    values.append(np.array([float(x) for x in part]))
            size = max(1.0, *(abs(part).max() for part in expected))
            for part, value in zip(expected, values, strict=True):
                assert abs(part - value).max() <= 1e-12 * size


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
        energy = bare @ bare + a @ inverse @ a
        assert energy == pytest.approx(motion.energy, rel=1e-12)
        derivatives = [v, a, -k @ v, -k @ a, k @ k @ v]
        orders = (2, 3, 4) if mean else (0, 1, 2, 3, 4)
        for order in orders:
            for n in range(p):
                most = motion.bound(n, order) * (1 + 1e-12)
                assert abs(derivatives[order][n]) <= most


@pytest.mark.parametrize("ends", ALL_ENDS)
def test_frequencies_and_vectors_are_those_that_are_derived(ends):
    kinds = {(kind.left == "free", kind.right == "free"): kind for kind in derived.KINDS}
    kind = kinds[tuple(ends)]
    for p in range(1, 9):
        table = modes(FLOAT64, p, ends)
        for column in range(p):
            angle = kind.angle.subs({derived.p: p, derived.q: column + kind.first})
            at = {derived.phi: angle, derived.p: p}
            shape = kind.shape.subs(at)
            values = [float(shape.subs(derived.n, n)) for n in range(1, p + 1)]
            square = p if angle == 0 else float(kind.square.subs(derived.p, p))
            vector = np.array(values) / np.sqrt(square)
            found = np.array(table.vectors[:, column], dtype=float)
            frequency = 2 * np.sin(float(angle) / 2)
            assert abs(table.frequencies[column] - frequency) < 1e-15
            assert abs(found - vector).max() < 1e-14
