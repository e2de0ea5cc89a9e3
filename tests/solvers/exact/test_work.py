"""How much the exact solver computes for an event: counted, not timed."""

from __future__ import annotations

import numpy as np
import pytest

from exactcreep import Chain, Cycles, State
from exactcreep.solvers.exact import layout
from exactcreep.solvers.exact import loop as kernel
from exactcreep.solvers.exact.solver import ExactSimulation
from exactcreep.solvers.solver import Tally


def work(n: int, amplitude: str, half_cycles: int, sigma_mu: str) -> tuple[Tally, dict[str, int]]:
    chain = Chain(n, 1000, "0.5", "0.6", sigma_mu, tan_alpha="0.25")
    simulation = ExactSimulation(chain, State.relaxed(chain), 0)
    drive = Cycles(amplitude, half_cycles)
    stretch = simulation.follow(drive, 1, half_cycles)
    assert stretch.completed == half_cycles
    return simulation.tally, simulation.report()


def test_two_sliders_slip_one_by_one_without_a_single_root():
    tally, report = work(2, "0.01", 40, "0.01")
    assert tally.events > 7000
    assert set(report.values()) == {0}


# steps of a cluster, windows of eight sliders certified, evaluations of one slider's margin
BOUNDS = {
    (6, "0.01"): (1.0, 1.0, 1.6),
    (30, "0.005"): (1.25, 2.2, 2.7),
    (60, "0.01"): (1.25, 3.5, 2.9),
}


@pytest.mark.parametrize(("n", "amplitude"), BOUNDS)
def test_an_event_takes_about_one_step_and_a_few_evaluations(n, amplitude):
    tally, report = work(n, amplitude, 8, "0.01")
    assert tally.events > 7000
    counted = ("cluster_steps", "windows_certified", "root_evaluations")
    for name, most in zip(counted, BOUNDS[n, amplitude], strict=True):
        assert report[name] <= most * tally.events, name


def test_a_window_is_certified_at_least_once_for_every_step_of_a_cluster():
    for n, amplitude in BOUNDS:
        tally, report = work(n, amplitude, 2, "0.01")
        assert report["windows_certified"] >= report["cluster_steps"] > 0
        assert tally.events >= 2 * tally.rearrangements


def test_a_chain_a_thousand_times_longer_does_the_same_work():
    # the same events at the two ends: only they feel so small an amplitude
    short, long = (work(n, "0.003", 4, "0") for n in (100, 100_000))
    assert short == long
    assert short[0].events > 1000


def test_a_call_of_the_compiled_loop_ends_with_its_work_even_if_nothing_happens():
    # on the slope mu_d the whole chain slides on and on, and is asked whether it ever stops
    n = 40
    chain = Chain(n, 1000, "0.0217", "0.665", tan_alpha="0.0217")
    simulation = ExactSimulation(chain, State.relaxed(chain), 0)
    work = simulation.work
    targets = np.array([-1000.0 * 30]), np.zeros(1), simulation.at_targets(1, ())
    allowed, calls, calm = 40_000, 0, 0
    while work.now["counts"]["events"][0] < 100_000:
        spent, events = work.now["counts"]["work"][0], work.now["counts"]["events"][0]
        reason, _ = kernel.follow(*work, *targets, 10**9, allowed, False)
        assert reason == layout.BUDGET
        strips = n // 8 + 2
        dearest = kernel.MODES_WORK * n**2 + kernel.STEP_WORK + kernel.STRIP_WORK * strips
        assert work.now["counts"]["work"][0] - spent < allowed + dearest
        assert work.now["counts"]["events"][0] - events <= allowed
        calls += 1
        calm += work.now["counts"]["events"][0] == events
    assert calls > 20
    assert calm > 0
