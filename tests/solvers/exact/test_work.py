"""How much the exact solver computes for an event: counted, not timed."""

from __future__ import annotations

import numpy as np
import pytest

from exactcreep import Chain, Cycles, State
from exactcreep.solvers.exact import layout
from exactcreep.solvers.exact import loop as kernel
from exactcreep.solvers.exact.solver import ExactSimulation
from tests.paper import captions, paper_chain
from tests.solvers.exact.simulations import followed

# steps of a cluster, windows of eight sliders certified, evaluations of one slider's margin
BOUNDS = {
    (2, "0.01", 20): (0.0, 0.0, 0.0),  # they slip one by one
    (6, "0.01", 4): (1.0, 1.0, 1.6),
    (60, "0.01", 4): (1.25, 3.5, 2.9),
}


@pytest.mark.parametrize(("n", "amplitude", "cycles"), BOUNDS)
def test_an_event_takes_about_one_step_and_a_few_evaluations(n, amplitude, cycles):
    simulation, _ = followed(paper_chain(n), Cycles(amplitude, cycles))
    tally, report = simulation.tally, simulation.report()
    assert tally.events > 4000
    assert tally.events >= 2 * tally.rearrangements
    for counted, most in zip(report.values(), BOUNDS[n, amplitude, cycles], strict=True):
        assert counted <= most * tally.events
    # certified at least once for every step
    assert report["windows_certified"] >= report["cluster_steps"] >= (n > 2)


def test_a_chain_a_thousand_times_longer_does_the_same_work():
    # the same events at the two ends: only they feel so small an amplitude
    short, long = (followed(captions(n), Cycles("0.003", 2))[0] for n in (100, 100_000))
    assert (short.tally, short.report()) == (long.tally, long.report())
    assert short.tally.events > 500
    moved = np.nonzero(long.state().displacements)[0]
    assert np.all((moved < 100) | (moved >= 99_900))


def test_a_call_of_the_compiled_loop_ends_with_its_work_even_if_nothing_happens():
    # on the slope mu_d the whole chain slides on and on
    n, allowed, calls, calm = 40, 40_000, 0, 0
    chain = Chain(n, 1000, "0.0217", "0.665", tan_alpha="0.0217")
    simulation = ExactSimulation(chain, State.relaxed(chain), 0)
    counts = simulation.work.now["counts"]
    targets = np.array([-1000.0 * 30]), np.zeros(1), simulation.at_targets(1, ())
    dearest = kernel.STEP_WORK + kernel.STRIP_WORK * (n // 8 + 2)
    while counts["events"][0] < 100_000:
        spent, events = counts["work"][0], counts["events"][0]
        reason, _ = kernel.follow(*simulation.work, *targets, 10**9, allowed, False)
        assert reason == layout.BUDGET
        assert counts["work"][0] - spent < allowed + dearest
        assert counts["events"][0] - events <= allowed
        calls += 1
        calm += counts["events"][0] == events
    assert calls > 20
    assert calm > 0
