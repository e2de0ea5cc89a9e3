"""Slips of one of two sliders after another, against the general loop."""

from __future__ import annotations

import numpy as np
import pytest

from exactcreep import Cycles, State
from exactcreep.solvers.exact.solver import ExactSimulation
from exactcreep.watch.limits import Limits
from tests.paper import paper_chain

ENDS = [
    ({}, "0.01"),
    ({"sigma_mu": "0", "tan_alpha": "0"}, "0.001"),
    ({"mu_s": "0.55", "sigma_mu": "0.1", "tan_alpha": "0.01"}, "0.01"),
    ({"mu_s": "1.45", "sigma_mu": "0.5", "tan_alpha": "-0.48"}, "0.01"),
]


@pytest.mark.parametrize(("changed", "amplitude"), ENDS)
def test_two_sliders_that_slip_alone_slip_as_in_the_general_loop_bit_for_bit(changed, amplitude):
    n, chain, drive = 2, paper_chain(2, **changed), Cycles(amplitude, 20)
    plain = ExactSimulation(chain, State.relaxed(chain, n), n)
    stretch = plain.follow(drive, 1, drive.target_count)
    # where events are recorded every slip goes through the general loop
    for record, most in (
        (("x_G", "events"), 10**9),
        (("x_G",), 23),
        (("rearrangements",), 10**9),
    ):
        other = ExactSimulation(chain, State.relaxed(chain, n), n, record)
        done = 0
        while done < drive.target_count:
            part = other.follow(drive, 1 + done, drive.target_count - done, Limits(most))
            done += part.completed
        known, own = (its.snapshot() for its in (plain, other))
        assert np.array_equal(known["counts"], own["counts"])
        known, own = (taken["unrounded"]["rest"] for taken in (known, own))
        assert all(np.array_equal(known[name], own[name]) for name in known)
        assert most < 10**9 or np.array_equal(stretch.recorded["x_G"], part.recorded["x_G"])
    assert plain.tally.slips > 100
