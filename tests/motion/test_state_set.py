"""The set of states that is carried along: nothing leaves it, and far parts stay apart."""

from __future__ import annotations

import flint
import numpy as np
import pytest

from exactcreep.motion.arithmetic import balls_of
from exactcreep.motion.state_set import Crossing, StateSet, orthogonal


def column(numbers):
    return flint.arb_mat([[x] for x in numbers.tolist()])


def turned(random, groups, size):
    """Return a matrix that mixes the coordinates within each group, and leaves the others."""
    matrix = np.eye(size)
    for group in groups:
        size = len(group)
        matrix[np.ix_(group, group)] = random.normal(size=(size, size))
    return matrix


@pytest.mark.parametrize(
    ("groups", "flat"),
    [
        ([[0, 1, 2], [4, 5]], 0),
        ([list(range(8))], 3),
    ],
)
def test_no_state_leaves_the_set(groups, flat):
    random = np.random.default_rng(5)
    size = 8
    rows = np.diag(2.0 ** -random.integers(0, 160, size))
    with balls_of(600).active():
        for _ in range(4):
            rows = turned(random, groups, size) @ rows
            rows[:, rows.shape[1] - flat :] = 0.0  # fewer directions than coordinates
            noise = 2.0 ** -random.integers(20, 180, size)
            axes, widths = orthogonal(rows, noise)
            assert abs(axes.T @ axes - np.eye(size)).max() < 1e-14
            inverse = flint.arb_mat(axes.tolist()).inv()
            matrix = flint.arb_mat(rows.tolist())
            for _ in range(20):
                corner = column(random.choice([-1.0, 1.0], rows.shape[1]))
                way = column(random.choice([-1.0, 1.0], size) * noise)
                inside = inverse * (matrix * corner + way)
                for y, width in zip(inside.entries(), widths.tolist(), strict=True):
                    assert abs(y) <= width
            rows = axes * widths


@pytest.mark.parametrize("thin", [1e-150, 1e-300])
def test_a_box_holds_what_is_so_thin_that_its_square_is_zero(thin):
    rows = np.array([[1.0, 0.0], [0.0, thin]])
    axes, sizes = orthogonal(rows, np.zeros(2))
    with balls_of(3000).active():
        for corner in ([1.0, 1.0], [1.0, -1.0]):
            state = column(rows @ np.array(corner))
            inside = flint.arb_mat(axes.tolist()).solve(state).entries()
            for y, size in zip(inside, sizes.tolist(), strict=True):
                assert abs(y) <= flint.arb(size)


@pytest.mark.parametrize("size", [1.0, 2.0**-900])
def test_balls_are_as_wide_as_the_set_and_hardly_wider(size):
    with balls_of(1200).active():
        radii = [flint.arb(size) * k / 7 for k in (1, 5, 3)]
        states = StateSet(radii[:2], {1: radii[2]}, radii[0])
        for width, given in (
            (states.of_forces(), radii[:2]),
            (states.of_speeds()[1:], radii[2:]),
        ):
            middles = balls_of(1200).zeros(len(given))
            for ball, radius in zip(states.widened(middles, width), given, strict=True):
                assert radius <= ball.rad() <= radius * (1 + flint.arb(1e-6))


def test_the_force_on_a_resting_slider_changes_as_fast_as_its_two_neighbours_alone_move():
    speeds = np.array([2.0**-k for k in range(6)])
    for slider, expected in [(0, 0.5), (2, 0.5 + 0.125), (5, 0.0625)]:
        velocities = speeds.copy()
        velocities[slider] = 0.0
        start = Crossing(
            np.full(6, 2), np.ones(6, int), velocities, np.zeros(6),
            0.0, 1.0, 0.0, 1.0, slider, 1, -1,
        )  # fmt: skip
        assert start.slope == expected
