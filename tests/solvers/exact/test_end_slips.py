"""Slips of an end slider one after the other, against the general loop."""

from __future__ import annotations

import numpy as np
import pytest

from exactcreep import Cycles, State
from exactcreep.limits import Limits
from exactcreep.solvers.exact import layout
from exactcreep.solvers.exact.solver import ExactSimulation
from tests.paper import paper_chain
from tests.solvers.exact.simulations import followed

ENDS = [
    (2, {}, "0.01"),
    (2, {"sigma_mu": "0"}, "0.01"),
    (2, {"sigma_mu": "0", "tan_alpha": "0"}, "0.001"),
    (2, {"tan_alpha": "0"}, "0.01"),
    (2, {"mu_s": "0.5", "sigma_mu": "0.2"}, "0.01"),
    (2, {"mu_s": "0.55", "sigma_mu": "0.1", "tan_alpha": "0.01"}, "0.01"),
    (2, {"mu_s": "1.45", "sigma_mu": "0.5", "tan_alpha": "-0.48"}, "0.01"),
    (3, {"tan_alpha": "0.4"}, "0.003"),
    (3, {"sigma_mu": "0"}, "0.003"),
    (5, {"sigma_mu": "0.1", "tan_alpha": "0.1"}, "0.003"),
    (12, {"tan_alpha": "-0.3"}, "0.004"),
]


@pytest.mark.parametrize(("n", "changed", "amplitude"), ENDS)
def test_ends_that_slip_alone_slip_as_in_the_general_loop_bit_for_bit(n, changed, amplitude):
    # where events are recorded every slip goes through the general loop
    chain = paper_chain(n, **changed)
    drive = Cycles(amplitude, 20 if n == 2 else 8)
    plain, stretch = followed(chain, drive, seed=n)
    general = ExactSimulation(chain, State.relaxed(chain, n), n, ("x_G", "events"))
    logged = general.follow(drive, 1, drive.half_cycles)
    interrupted = ExactSimulation(chain, State.relaxed(chain, n), n)
    done = 0
    while done < drive.half_cycles:
        done += interrupted.follow(drive, 1 + done, drive.half_cycles - done, Limits(23)).completed
    assert np.array_equal(stretch.recorded["x_G"], logged.recorded["x_G"])
    rows = [layout.FORCE, layout.FORCE_LOW, layout.TRAVEL, layout.TRAVEL_LOW, layout.EXCESS]
    for other in (general, interrupted):
        for row in (*rows, layout.COEFFICIENT):
            assert np.array_equal(plain.work.cell[row], other.work.cell[row])
        for name in ("theta", "theta_low", "total", "total_low"):
            assert plain.work.now[name] == other.work.now[name]
        assert plain.tally == other.tally
        assert plain.state().draws.tolist() == other.state().draws.tolist()
    assert plain.tally.slips > 100
