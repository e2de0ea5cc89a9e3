"""The exact solver against closed forms, invariants and the rules of the model."""

from __future__ import annotations

import math
import random
import threading
import time
from fractions import Fraction
from itertools import islice

import numpy as np
import pytest

from exactcreep import (
    Chain,
    Cycles,
    EventKind,
    Evidence,
    Outcome,
    Path,
    State,
    creep,
    disorder,
    iterate,
    laws,
    rearrange,
)
from exactcreep.limits import Limits, Stop
from exactcreep.motion.replay import Replay
from exactcreep.solvers.exact import loop as kernel
from exactcreep.solvers.exact.solver import ExactSimulation
from exactcreep.solvers.solver import Rearrangement, advance
from tests.paper import paper_chain
from tests.solvers.exact.simulations import followed


def test_two_relaxed_sliders_climb_the_staircase_whatever_the_rational_chain():
    rng, creeping, decided = random.Random(20110603), 0, 0
    while decided < 500:
        mu_d = Fraction(rng.randint(1, 400), rng.randint(200, 400))
        mu_s = mu_d + Fraction(rng.randint(1, 300), rng.randint(100, 1000))
        tangent = mu_d * Fraction(rng.randint(1, 99), 100)
        chain = Chain(2, rng.choice([1, 10, 1000]), mu_d, mu_s, tan_alpha=tangent)
        onset = Fraction(chain.times_cosine(mu_s - tangent))
        amplitude = onset * Fraction(rng.randint(5, 1200), 100) / chain.l0
        known = {"mu_d": mu_d, "mu_s": mu_s, "tan_alpha": tangent, "amplitude": amplitude}
        expected = laws.staircase_two_sliders(l0=chain.l0, **known)
        simulation, stretch = followed(chain, Cycles(amplitude, 6))
        if simulation.tally.undecided:
            # the amplitude is the float next to an edge of a step: the solver says so
            edge = (chain.l0 * amplitude - onset) / Fraction(chain.excess) / 2
            assert abs(edge - round(edge)) < Fraction(1, 10**13)
            continue
        x = stretch.recorded["x_G"]
        assert (x[-1] - x[3]) / 8 == pytest.approx(float(expected), rel=1e-12, abs=0)
        decided += 1
        creeping += expected > 0
    assert 250 < creeping < 500


@pytest.mark.parametrize("n", [2, 3, 30])
def test_a_lone_slip_takes_half_a_period_and_moves_by_what_the_excess_says(n: int) -> None:
    end = paper_chain(n, sigma_mu="0")
    inner = paper_chain(n, sigma_mu="0", tan_alpha="0")
    pulled = inner.times_cosine(Fraction(3, 10)) + 1e-13  # 2e-13 above its threshold
    pair = [0] * (n - 3) + [-pulled, pulled]
    cases = [(end, State.relaxed(end), 1, n, 2.0, 1.0)]
    if n > 2:
        cases.append((inner, State.prepared(inner, pair), 0, n - 1, 1.0, math.sqrt(2)))
    for chain, state, direction, slider, far, omega in cases:
        result = rearrange(chain, state, direction=direction)
        assert result.itinerary == (("start", (slider,), (1,)), ("stop", (slider,), (1,)))
        assert result.duration == pytest.approx(math.pi / omega, rel=4e-16)
        moved = result.state.displacements[slider - 1]
        assert moved == pytest.approx(far * chain.excess, rel=4e-16, abs=0 if direction else 4e-13)
        assert result.evidence is Evidence.COMPUTED
        onset = chain.times_cosine(chain.mu_s - chain.tan_alpha) if direction else 0.0
        assert float(result.theta) * 1000 == pytest.approx(onset, rel=4e-16)


def test_at_an_equality_a_slider_stays_and_ties_are_one_event_counted_once_in_a_rearrangement():
    chain = Chain(3, 1, "1/2", "3/5", tan_alpha="1/5")
    state, counts = State.relaxed(chain), []
    for k in range(8):
        result = rearrange(chain, state, direction=1)
        assert len(result.events) == 2
        started = ("start", (3,), (1,)) if k < 2 else ("start", (1, 3), (-1, 1))
        assert result.itinerary[0] == started
        counts.append(result.undecided)
        assert (result.evidence is Evidence.UNDECIDED) == (k > 0)
        state = result.state
        if k == 1:  # slider 2 stands at its threshold, sliders 1 and 3 reach theirs together
            assert abs(state.forces(chain)[1] - chain.times_cosine(chain.mu_s)) < 1e-15
    assert counts == [0, 1] + 6 * [3]
    assert result.report["cluster_steps"] > 3
    assert followed(chain, Path(["1"]))[1].completed == 1


RESTLESS = [(2, "0.35"), (3, "0.35"), (6, "0.35"), (12, "0.3"), (30, "0.35"), (90, "0.4")]


def ledger(result: Rearrangement) -> float:
    """Return the relative error of elastic + kinetic + gravity + friction work over a result."""
    chain, sol, worst, path = result.chain, result.sol, 0.0, 0.0
    tension = result.initial.tensions.astype(float)
    before = start = result.initial.displacements
    for piece in sol.pieces:
        for t in (0.5 * (piece.t_min + piece.t_max), piece.t_max):
            motion = piece(t)
            path += np.abs(motion.positions - before).sum()  # within a piece no slider turns
            before, moved = motion.positions, motion.positions - start
            elastic = 0.5 * np.sum((tension + np.diff(moved)) ** 2), -0.5 * np.sum(tension**2)
            kinetic, fallen = 0.5 * np.sum(motion.velocities**2), -chain.sin_alpha * moved.sum()
            terms = np.array([*elastic, kinetic, fallen, chain.friction * path])
            worst = max(worst, abs(terms.sum()) / np.abs(terms).max())
    return worst


@pytest.mark.parametrize(("n", "tan_alpha"), RESTLESS)
def test_every_rearrangement_obeys_the_contact_law_and_balances_its_energy(
    n: int, tan_alpha: str
) -> None:
    chain = paper_chain(n, tan_alpha=tan_alpha)
    state, events = State.relaxed(chain, n), 0
    for k in range(60):
        result = rearrange(chain, state, direction=1 if k < 40 else -1, seed=n)
        times = [event.time for event in result.events]
        assert times == sorted(times)
        assert max(event.residual for event in result.events) < 1e-13
        stops = [e.sliders for e in result.events if e.kind is EventKind.STOP]
        slips = np.array([sum(i in sliders for sliders in stops) for i in range(1, n + 1)])
        assert np.array_equal(result.state.draws, state.draws + slips)
        kept = result.state.coefficients == state.coefficients
        assert np.array_equal(kept, slips == 0)  # who is stuck keeps its contact
        state = result.state
        held = np.maximum(state.coefficients, 0.5) * chain.cos_alpha * (1 + 1e-15)
        assert np.all(np.abs(state.forces(chain)) <= held)
        assert ledger(result) < 1e-12
        events += len(result.events)
    assert events >= 120
    for slider in range(1, n + 1):
        if (last := int(state.draws[slider - 1]) - 1) > 0:
            drawn = disorder.static_coefficient(chain, n, slider, last)
            assert state.coefficients[slider - 1] == drawn


def test_batches_of_draws_have_the_bits_of_the_keyed_coefficients():
    chain = paper_chain(3)
    state = followed(chain, Cycles("0.01", 40), seed=2**64 - 1)[0].state()
    assert state.draws.min() > 100
    for slider, (draws, held) in enumerate(zip(state.draws, state.coefficients, strict=True), 1):
        assert held == disorder.static_coefficient(chain, 2**64 - 1, slider, int(draws) - 1)


def test_the_remainder_of_two_sliders_is_conserved_over_a_million_slips():
    chain = paper_chain(2, sigma_mu="0")
    r0 = 0.03125
    simulation, _ = followed(chain, Cycles("0.01", 5100), start=State.prepared(chain, [r0]))
    assert simulation.tally.slips > 10**6
    u = simulation.state().displacements
    period = 2 * chain.excess
    left = (u[1] - u[0]) / period
    assert abs(left - round(left)) * period < 1e-12 * max(abs(u))
    conserved = simulation.state().tensions[0] + float(chain.l0) * simulation.state().theta
    left = (conserved - r0) / period
    assert abs(left - round(left)) * period < 1e-12


def test_all_crossings_of_grazing_avalanches_are_found_with_bounded_work():
    for k in range(3, 13):
        chain = Chain(2, 1, "0.5", "0.6", tan_alpha=Fraction(1, 2) + Fraction(1, 10**k))
        state = State.relaxed(chain)
        events = list(islice(iterate(chain, state, direction=1), 200))
        assert events[0].signature == ("start", (2,), (1,))
        assert events[1].signature == ("start", (1,), (1,))
        # 1 - cos t falls short of 2 by 2 (tan_alpha - mu_d) / (mu_s - mu_d)
        early = math.acos(1 - 2 * (0.1 - 10.0**-k) / 0.1) - math.pi
        assert events[1].time - math.pi == pytest.approx(early, rel=1e-3)
        # one slider after the other stops and is started again by its neighbour, ever faster
        assert all(e.kind is EventKind.STOP for e in events[2::2])
        assert all(e.kind is EventKind.START for e in events[3::2])
        simulation = ExactSimulation(chain, state, 0)
        simulation.follow(Path([100]), 1, 1, Limits(200))
        assert simulation.report()["root_evaluations"] <= 4 * 200
        lowered = chain.times_cosine(chain.mu_s - chain.tan_alpha)
        initial = State.prepared(chain, [-lowered], theta=lowered)
        assert max(Replay(chain, initial, events).residuals()) < 1e-13


@pytest.mark.parametrize("n", [2, 3, 4, 5, 6, 7, 30])
@pytest.mark.parametrize("half_cycles", [40, pytest.param(10_000, marks=pytest.mark.slow)])
def test_a_horizontal_chain_stays_mirror_symmetric_bit_for_bit(n, half_cycles):
    chain = Chain(n, 1, "0.5", "0.6", tan_alpha=0)
    drive = Cycles(2 * n, half_cycles // 2)
    simulation = ExactSimulation(chain, State.relaxed(chain), 0)
    for first in range(1, half_cycles, half_cycles // 10):
        simulation.follow(drive, first, half_cycles // 10)
        u = simulation.state().displacements
        assert np.array_equal(u, -u[::-1])
    assert np.any(u != 0)
    assert simulation.tally.undecided > 0
    assert simulation.evidence is Evidence.UNDECIDED


@pytest.mark.parametrize(
    ("n", "tan_alpha"), [(1, "0.7"), (2, "0.55"), (3, "0.52"), (6, "0.52"), (2, "-0.55")]
)
def test_a_runaway_is_proved_and_returned_with_what_came_before(n, tan_alpha):
    chain = paper_chain(n, sigma_mu="0", tan_alpha=tan_alpha)
    result = rearrange(chain, State.relaxed(chain), direction=min(n - 1, 1))
    assert result.outcome is Outcome.RUNAWAY
    downhill = 1 if chain.tan_alpha > 0 else -1
    assert np.all(downhill * result.velocities >= 0)
    assert result.events[-1].kind is EventKind.START
    if n > 1:
        run = creep(chain, Cycles("0.01", 10))
        assert run.outcome is Outcome.RUNAWAY
        assert run.velocity == downhill * math.inf


def test_an_avalanche_that_goes_round_for_ever_is_a_limit_and_not_a_hang():
    # on the slope mu_d friction takes what gravity gives: the energy neither grows nor falls
    chain = paper_chain(3, sigma_mu="0", tan_alpha="0.5")
    run = creep(chain, Cycles("0.01", 10))
    assert run.outcome is Outcome.LIMIT
    assert run.event_count > 10**6


def test_draws_below_mu_d_slip_by_nothing_and_are_counted():
    chain = paper_chain(3, sigma_mu="0.2", mu_s="0.5")
    simulation, _ = followed(chain, Cycles("0.005", 20), seed=4)
    assert simulation.tally.draws_below_mu_d > 100
    # half of all draws act as mu_d: such an end slider starts and stops where it stands
    state = State.relaxed(chain, 4)
    lengths = []
    for _ in range(40):
        result = rearrange(chain, state, direction=1, seed=4)
        lengths.append(np.abs(result.state.displacements - state.displacements).max())
        state = result.state
    assert 0.0 in lengths
    assert max(lengths) > 0


@pytest.mark.parametrize("most", [37, 2_000])
def test_where_a_run_is_cut_changes_no_bit_of_its_tables(most: int) -> None:
    # one slip of an end slider after the other, of which the log takes some four thousand
    chain, record = paper_chain(2), ("rearrangements", "slip_table")
    whole, parts = (ExactSimulation(chain, State.relaxed(chain, 5), 5, record) for _ in range(2))
    known = whole.follow(Cycles("0.01", 30), 1, 60).recorded
    done, pieces = 0, []
    while done < 60:
        stretch = parts.follow(Cycles("0.01", 30), 1 + done, 60 - done, Limits(most))
        done += stretch.completed
        pieces.append(stretch.recorded)
    assert len(known["slip_slider"]) > 5000
    for name in known:
        assert np.array_equal(np.concatenate([piece[name] for piece in pieces]), known[name]), name


def test_other_threads_go_on_while_the_compiled_loop_runs():
    simulation = ExactSimulation(paper_chain(2), State.relaxed(paper_chain(2)), 0)
    drive = Cycles("0.01", 10**6)
    simulation.follow(drive, 1, 2)  # compiled now, if it was not
    high = np.where(np.arange(150_000) % 2 == 0, 10.0, -10.0)  # l0 theta of more cycles
    ticks: list[float] = []
    over = threading.Event()

    def tick() -> None:
        while not over.wait(0.001):
            ticks.append(time.perf_counter())

    beside = threading.Thread(target=tick)
    beside.start()
    begin = time.perf_counter()
    # one call: what lies between two calls lets other threads in anyway
    targets = high, np.zeros(high.size), simulation.at_targets(high.size, ())
    kernel.follow(*simulation.work, *targets, 10**9, 10**9, False)
    end = time.perf_counter()
    over.set()
    beside.join()
    assert simulation.tally.slips > 10**7
    margin = (end - begin) / 8
    assert any(begin + margin < at < end - margin for at in ticks)


def test_slips_of_length_zero_end_at_once_even_when_two_begin_together():
    # most draws lie below mu_d; at alpha = 0 both ends start together
    chain = Chain(4, 1000, "0.3", "0.300001", "0.01", tan_alpha=0)
    simulation = ExactSimulation(chain, State.relaxed(chain, 213), 213)
    stretch = simulation.follow(Cycles("0.005", 5), 1, 10, Limits(20_000))
    assert simulation.tally.events >= 20_000 or stretch.completed == 10
    assert simulation.report()["cluster_steps"] < 2 * simulation.tally.events


def test_a_whole_chain_that_slides_on_unproved_is_given_up():
    gap = Fraction(1, 10**12)
    chain = Chain(10, 1000, "1/1000", Fraction(1, 1000) + gap, "1e-9", tan_alpha="1/1000")
    simulation = ExactSimulation(chain, State.relaxed(chain, 1), 1)
    stretch = simulation.follow(Cycles("0.005", 5), 1, 10)
    assert stretch.stop is Stop.LIMIT
    assert "neither ended" in stretch.reason


@pytest.mark.parametrize(("tan_alpha", "together"), [("0.25", False), ("0.499", True)])
def test_two_sliders_ask_for_the_code_of_clusters_once_both_move(
    tan_alpha: str, together: bool
) -> None:
    chain = Chain(2, 1000, "0.5", "0.6", "0.01", tan_alpha=tan_alpha)
    lone, prepared = (ExactSimulation(chain, State.relaxed(chain, 1), 1) for _ in range(2))
    prepared.make_room()
    for simulation in (lone, prepared):
        advance(simulation, Cycles("0.01", 20), 40)
    assert (lone.work.series is not None) == together
    assert (lone.tally.events > 2 * lone.tally.rearrangements) == together
    known = prepared.snapshot()
    assert all(np.array_equal(values, known[name]) for name, values in lone.snapshot().items())


@pytest.mark.parametrize(
    ("n", "l0", "amplitude"), [(2, "1000", "0.01"), (4, "1000.1", "0.0037"), (6, 333, "0.0123")]
)
def test_a_path_to_the_targets_of_cycles_gives_their_bits(n: int, l0: str, amplitude: str) -> None:
    chain = Chain(n, l0, "0.5", "0.6", tan_alpha="0.25")
    listed = Path([amplitude, -Fraction(amplitude)] * 50)
    one, other = (
        creep(chain, drive, record=("x_G", "tension")) for drive in (Cycles(amplitude, 50), listed)
    )
    assert np.array_equal(one.recorded["x_G"], other.recorded["x_G"])
    assert np.array_equal(one.recorded["tension"], other.recorded["tension"])
    assert one.state == other.state
