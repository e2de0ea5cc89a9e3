"""What balls prove, how much they lose, and what they say when they cannot decide."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from fractions import Fraction
from typing import Any

import flint
import numpy as np
import pytest
from mpmath import mp, mpf

from exactcreep import Chain, Creep, Cycles, Evidence, Outcome, State, Targets, creep
from exactcreep.motion.arithmetic import DISTURBED
from exactcreep.motion.modes import Flow
from exactcreep.solvers.field.certified import Certified
from exactcreep.solvers.field.set_integrator import SetIntegrator
from exactcreep.solvers.field.simulation import CertifiedSimulation
from exactcreep.solvers.interface import Start
from exactcreep.solvers.tables import LOGS
from exactcreep.watch.limits import Limits
from tests.paper import captions, event_rows, paper_chain


def relaxed(chain):
    return Start(chain, State.relaxed(chain, 3), 3)


def followed(chain, drive, digits, seed=3, max_events=10**6, record=("x", "tension", "events")):
    solver = Certified(digits=digits)
    simulation = solver.simulation(chain, State.relaxed(chain, seed), seed, record)
    stretch = simulation.follow(drive, 1, drive.target_count, Limits(max_events))
    return simulation, stretch


def assert_overlap(one, other, *names):
    """Assert that two runs, or two states, may be the same numbers."""
    for name in names:
        a, b = one[name].ravel(), other[name].ravel()
        assert all(x.overlaps(y) for x, y in zip(a, b, strict=True))


def random_scene(random):
    n = int(random.integers(2, 9))
    tangent = str(random.choice(["0", "1/4", "1/5", "0.3", "0.45", "0.499"]))
    mu_s = str(random.choice(["3/5", "0.55", "0.7"]))
    sigma_mu = str(random.choice(["0", "0.05"]))
    amplitude = str(round(random.uniform(0.5, 4) * n * 0.0003, 6))
    return Chain(n, 1000, "1/2", mu_s, sigma_mu, tan_alpha=tangent), Cycles(amplitude, 1)


class Plain(SetIntegrator):
    """The solver in plain balls, without float64."""

    def _renew(self):
        """Make no set."""

    def _proved(self, flow):
        return None


class PlainSimulation(CertifiedSimulation):
    kind = Plain


def test_events_proved_in_float64_are_those_of_balls_with_a_search_of_their_own():
    random, together, events = np.random.default_rng(7), 0, 80
    for _ in range(12):
        chain, drive = random_scene(random)
        narrow, first = followed(chain, drive, 15, max_events=events)
        many = narrow.tally.events
        record, most = ("x", "tension", "events"), 30 + 2 * many
        solver = Certified(digits=most, most_digits=most)
        plain = PlainSimulation(relaxed(chain), record, solver)
        second = plain.follow(drive, 1, 2, Limits(events))
        assert narrow.evidence is plain.evidence
        assert event_rows(first) == event_rows(second)
        together += many
        assert_overlap(first.recorded, second.recorded, "x", "tension", "event_time", "event_theta")
        states = vars(narrow.state()), vars(plain.state())
        assert_overlap(*states, "tensions", "displacements")
    assert together > 400


def test_lone_slips_stay_exact_for_ever():
    chain = paper_chain(2, "0")
    simulation, stretch = followed(chain, Cycles("0.01", 5), 30)
    report = simulation.report()
    assert report["exact_in_q_c"]
    assert report["digits_left"] is None or report["digits_left"] > 65
    excess = simulation.mechanics.field.times_cosine(chain.mu_s - chain.mu_d)
    for x in simulation.mechanics.rest.displacements:  # a whole number of slips of 2D
        a, b = x.rationals()
        assert a == 0
        assert (b / excess.rationals()[1] / 2).denominator == 1
    assert len(event_rows(stretch)) > 100


def test_a_restart_with_more_digits_hands_out_no_row_twice():
    """Float64 finds the times of near-grazes too vaguely; no precision is asked for for ever."""
    chain = captions(2, tan_alpha="0.500000000001")
    known = {"solver": "certified", "record": tuple(LOGS), "max_events": 200}
    run, expected = (creep(chain, Targets(["0.0003"]), digits=d, **known) for d in (10, 60))
    assert 0 < run.report["restarts"] < 5
    assert (run.event_count, run.evidence) == (200, Evidence.PROVED)
    for name, truth in expected.recorded.items():
        if truth.dtype == np.float64:
            assert run.recorded[name] == pytest.approx(truth, rel=1e-9, abs=1e-9)
        elif not name.endswith("_decimal"):
            assert np.array_equal(run.recorded[name], truth)


@contextmanager
def beside_a_thread_with(bits: int) -> Iterator[None]:
    """Let another thread change the precision of python-flint again and again."""
    ended, before = threading.Event(), flint.ctx.prec

    def other() -> None:
        while not ended.is_set():
            with flint.ctx.workprec(bits):
                flint.arb(2).sqrt()

    thread = threading.Thread(target=other)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
        flint.ctx.prec = before


@pytest.mark.parametrize("bits", [20, 64, 300])
def test_the_precision_of_another_thread_changes_neither_this_run_nor_the_next(bits: int) -> None:
    def run() -> Creep:
        return creep(paper_chain(6), Cycles("0.002", 1), solver="certified", digits=30)

    with beside_a_thread_with(bits):
        beside = run()
    after = run()
    assert beside.event_count == after.event_count > 200
    assert beside.evidence is after.evidence is Evidence.PROVED
    assert float(beside.x_G) == float(after.x_G)
    assert after.report["restarts"] == 0  # beside the other thread, a cycle may be repeated


def test_a_run_disturbed_in_every_attempt_at_a_step_ends_in_a_limit_that_says_so(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found, attempts = SetIntegrator.first_event, []

    def disturbed(self: SetIntegrator, flow: Flow) -> Any:
        event = found(self, flow)
        flint.ctx.prec = 64
        attempts.append(event)
        return event

    monkeypatch.setattr(SetIntegrator, "first_event", disturbed)
    with beside_a_thread_with(64):
        run = creep(paper_chain(3), Cycles("0.002", 1), solver="certified")
    assert run.outcome is Outcome.LIMIT
    assert run.outcome_evidence is Evidence.UNDECIDED
    assert run.reason == DISTURBED
    assert len(attempts) == 40
    assert run.half_cycles == run.slip_count == 0


def test_tensions_in_mpmath_are_taken_with_all_their_digits():
    chain, relaxed = paper_chain(4), State.relaxed(paper_chain(4))
    with mp.workdps(40):
        tensions = np.array([mpf(1) / 7, mpf(-1) / 9, mpf(2) / 11], dtype=object)
    exactly = [Fraction(int(mp.ldexp(x, 200)), 2**200) for x in tensions]
    pair = [replace(relaxed, tensions=np.array(x, dtype=object)) for x in (tensions, exactly)]
    runs = [creep(chain, Cycles("0.002", 1), start=x, solver="certified") for x in pair]
    assert runs[0].evidence is runs[1].evidence is Evidence.PROVED
    assert runs[0].state == runs[1].state
    floats = replace(relaxed, tensions=tensions.astype(float))
    assert creep(chain, Cycles("0.002", 1), start=floats, solver="certified").state != runs[0].state
