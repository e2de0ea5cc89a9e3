"""The set of states that is carried along: nothing leaves it, and far parts stay apart."""

from __future__ import annotations

import flint
import numpy as np
import pytest

from exactcreep.motion.arithmetic import Undecided, balls_of
from exactcreep.motion.enclosure import Box, orthogonal


def turned(random, groups, size):
    """Return a matrix that mixes the coordinates within each group, and leaves the others."""
    matrix = np.eye(size)
    for group in groups:
        matrix[np.ix_(group, group)] = random.normal(size=(len(group), len(group)))
    return matrix


def as_rows(matrix):
    return [[flint.arb(x) for x in row] for row in matrix.tolist()]


@pytest.mark.parametrize(
    "groups", [[[0, 1, 2], [4, 5]], [[0, 3, 7]], [list(range(8))], []], ids=str
)
def test_no_state_leaves_the_set(groups):
    random = np.random.default_rng(5)
    size = 8
    with balls_of(300).active():
        radii = [flint.arb(2) ** -int(k) for k in random.integers(40, 200, size)]
        box = Box.of(radii)
        for _ in range(3):
            matrix = turned(random, groups, size)
            noise = [flint.arb(2) ** -int(k) for k in random.integers(60, 220, size)]
            rows = (flint.arb_mat(as_rows(matrix)) * flint.arb_mat(box.axes)).tolist()
            carried = box.carried(rows, noise)
            unit, after = flint.arb(2) ** box.exponent, flint.arb(2) ** carried.exponent
            widths = [flint.arb(x) * after for x in carried.widths.tolist()]
            for corner in np.where(random.random((20, size)) < 0.5, -1.0, 1.0):
                place = [flint.arb(s * w) * unit for s, w in zip(corner, box.widths, strict=True)]
                state = flint.arb_mat(rows) * flint.arb_mat(size, 1, place)
                pushed = [x + s * r for x, s, r in zip(state.entries(), corner, noise, strict=True)]
                inside = flint.arb_mat(carried.axes).solve(flint.arb_mat(size, 1, pushed))
                for y, width in zip(inside.entries(), widths, strict=True):
                    assert abs(y) <= width
            box = carried


def test_what_a_motion_does_not_touch_keeps_its_axes_and_its_width():
    random = np.random.default_rng(6)
    with balls_of(300).active():
        box = Box.of([flint.arb(2) ** -(50 + k) for k in range(30)])
        rows = as_rows(turned(random, [[0, 1, 2]], 30))
        carried = box.carried(rows, [flint.arb(0)] * 30)
        axes = np.array([[float(x) for x in row] for row in carried.axes])
        assert not axes[:3, 3:].any()
        assert not axes[3:, :3].any()
        assert np.array_equal(axes[3:, 3:], np.eye(27))
        unit = 2.0 ** (carried.exponent - box.exponent)
        assert (carried.widths[3:] * unit <= box.widths[3:] * (1 + 1e-6)).all()


@pytest.mark.parametrize("thin", [1e-150, 1e-180, 1e-250, 1e-300])
def test_a_box_holds_what_is_so_thin_that_its_square_is_zero(thin):
    rows = np.array([[1.0, 0.0], [0.0, thin]])
    axes, sizes = orthogonal(rows, np.zeros(2))
    with balls_of(3000).active():
        for corner in ([1.0, 1.0], [1.0, -1.0]):
            state = flint.arb_mat(as_rows(rows)) * flint.arb_mat([[flint.arb(x)] for x in corner])
            inside = flint.arb_mat(as_rows(axes)).solve(state).entries()
            for y, size in zip(inside, sizes.tolist(), strict=True):
                assert abs(y) <= flint.arb(size)


def test_a_set_too_wide_for_floats_is_not_enclosed():
    with pytest.raises(Undecided, match="not enclosed"):
        orthogonal(np.full((2, 3), 1e308), np.zeros(2))
