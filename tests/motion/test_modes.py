"""The exact motion of a run against the matrix exponential of its equations."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg

from exactcreep.motion.arithmetic import FLOAT64, balls_of
from exactcreep.motion.modes import Ends, Run

ALL_ENDS = [Ends(left, right) for left in (False, True) for right in (False, True)]
ARITHMETICS = [FLOAT64, balls_of(150)]


def stiffness(p: int, ends: Ends) -> np.ndarray:
    """Return K: 2 on the diagonal (1 at a free end), -1 beside it."""
    matrix = 2.0 * np.eye(p) - np.eye(p, k=1) - np.eye(p, k=-1)
    matrix[0, 0] -= ends.left_free
    matrix[-1, -1] -= ends.right_free
    return matrix


def exponential(k: np.ndarray, t: float, *begin: np.ndarray) -> list[np.ndarray]:
    """Displacement, velocity and acceleration from u' = v, v' = a, a' = -K v."""
    one, none = np.eye(len(k)), np.zeros(k.shape)
    rows = [[none, one, none], [none, none, one], [none, -k, none]]
    start = np.concatenate([np.zeros(len(k)), *begin])
    return np.split(scipy.linalg.expm(np.block(rows) * t) @ start, 3)


@pytest.mark.parametrize("arithmetic", ARITHMETICS, ids=lambda a: a.name)
@pytest.mark.parametrize("ends", ALL_ENDS)
def test_motion_is_that_of_the_equations_and_its_energy_bounds_every_derivative(arithmetic, ends):
    rng = np.random.default_rng(20)
    for p in (1, 2, 3, 7, 12):
        k = stiffness(p, ends)
        begin = rng.normal(size=(2, p))
        for t in (1e-6, 0.3, 3.0):
            expected = exponential(k, t, *begin)
            with arithmetic.active():
                motion = Run(arithmetic, ends, *map(arithmetic.vector, begin))
                time = arithmetic.number(t)
                parts = zip(*(motion.slider(n, time) for n in range(p)), strict=True)
                found = [np.array([float(x) for x in part]) for part in parts]
                together = [[float(x) for x in part] for part in motion.moved(time)]
                bounds = np.array(
                    [[float(motion.bound(n, order)) for n in range(p)] for order in range(5)]
                )
                energy = float(motion.energy)
            size = max(1.0, *(abs(part).max() for part in expected))
            assert np.abs(np.subtract(found, expected)).max() <= 1e-12 * size
            assert np.abs(np.subtract(together, expected[:2])).max() <= 1e-12 * size
            v, a = expected[1:]
            free = ends == (True, True)
            bare = v - v.mean() if free else v
            assert energy == pytest.approx(bare @ bare + a @ np.linalg.pinv(k) @ a, rel=1e-10)
            derivatives = [v, a, -k @ v, -k @ a, k @ k @ v]
            for order in range(2 if free else 0, 5):
                assert (abs(derivatives[order]) <= bounds[order] * (1 + 1e-10) + 1e-12).all()
