"""The box of states that is carried along: nothing leaves it, and far parts stay apart."""

from __future__ import annotations

import flint
import numpy as np
import pytest

from exactcreep.motion.arithmetic import balls_of
from exactcreep.motion.state_set import orthogonal


def column(numbers):
    return flint.arb_mat([[x] for x in numbers.tolist()])


@pytest.mark.parametrize(
    ("groups", "flat", "thin"),
    [
        ([[0, 1, 2], [4, 5]], 0, 160),
        ([list(range(8))], 3, 160),
        ([list(range(8))], 0, 1000),  # so thin that a square is zero
    ],
)
def test_no_state_leaves_the_box_whose_axes_are_made_orthogonal(groups, flat, thin):
    random = np.random.default_rng(5)
    size = 8
    rows = np.diag(2.0 ** -random.integers(0, thin, size))
    with balls_of(3000).active():
        for _ in range(4):
            turn = np.eye(size)
            for group in groups:
                turn[np.ix_(group, group)] = random.normal(size=(len(group), len(group)))
            rows = turn @ rows
            rows[:, rows.shape[1] - flat :] = 0.0  # fewer directions than coordinates
            noise = 2.0 ** -random.integers(20, 20 + thin, size)
            axes, widths = orthogonal(rows, noise)
            assert abs(axes.T @ axes - np.eye(size)).max() < 1e-14
            alone = [k for k in range(size) if not any(k in group for group in groups)]
            assert (axes[alone] == np.eye(size)[alone]).all()
            inverse, matrix = flint.arb_mat(axes.tolist()).inv(), flint.arb_mat(rows.tolist())
            for _ in range(10):
                corner = column(random.choice([-1.0, 1.0], rows.shape[1]))
                way = column(random.choice([-1.0, 1.0], size) * noise)
                inside = (inverse * (matrix * corner + way)).entries()
                for y, width in zip(inside, widths.tolist(), strict=True):
                    assert abs(y) <= flint.arb(width)
            assert widths.max() < 10 * (abs(rows).sum() + noise.sum())
            rows = axes * widths
