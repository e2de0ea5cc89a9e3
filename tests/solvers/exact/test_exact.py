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
    InputError,
    Outcome,
    Path,
    State,
    creep,
    disorder,
    iterate,
    laws,
    rearrange,
)
from exactcreep.limits import NO_LIMITS, Limits, Stop
from exactcreep.motion.replay import Replay
from exactcreep.solvers.exact import loop as kernel
from exactcreep.solvers.exact.solver import ExactSimulation
from exactcreep.solvers.solver import advance
from tests.paper import paper_chain
from tests.solvers.exact.simulations import followed


def random_pair(rng: random.Random) -> tuple[Chain, Fraction]:
    mu_d = Fraction(rng.randint(1, 400), rng.randint(200, 400))
    mu_s = mu_d + Fraction(rng.randint(1, 300), rng.randint(100, 1000))
    tangent = mu_d * Fraction(rng.randint(1, 99), 100)
    chain = Chain(2, rng.choice([1, 10, 1000]), mu_d, mu_s, tan_alpha=tangent)
    reach = Fraction(chain.times_cosine(mu_s - tangent)) * Fraction(rng.randint(5, 1200), 100)
    return chain, reach / chain.l0


def test_two_relaxed_sliders_climb_the_staircase_for_two_thousand_rational_chains():
    rng = random.Random(20110603)
    creeping = 0
    decided = 0
    while decided < 2000:
        chain, amplitude = random_pair(rng)
        expected = laws.staircase_two_sliders(
            l0=chain.l0,
            mu_d=chain.mu_d,
            mu_s=chain.mu_s,
            tan_alpha=chain.tan_alpha,
            amplitude=amplitude,
        )
        simulation, stretch = followed(chain, Cycles(amplitude, 6))
        if simulation.tally.undecided:
            # the amplitude is the float next to an edge of a step: the solver says so
            steps = (chain.l0 * amplitude) / Fraction(chain.excess)
            edge = (
                steps
                - Fraction(chain.times_cosine(chain.mu_s - chain.tan_alpha))
                / Fraction(chain.excess)
            ) / 2
            assert abs(edge - round(edge)) < Fraction(1, 10**13)
            continue
        x = stretch.recorded["x_G"]
        velocity = (x[-1] - x[3]) / 8
        assert velocity == pytest.approx(float(expected), rel=1e-12, abs=0)
        decided += 1
        creeping += expected > 0
    assert 1000 < creeping < 2000


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


def test_the_mean_over_starts_of_two_sliders_is_the_distance_to_the_threshold():
    chain = paper_chain(2, sigma_mu="0")
    period = 2 * chain.excess
    margin = chain.friction - chain.sin_alpha
    for amplitude in ("0.0002", "0.0005", "0.0013"):
        reach = 1000 * float(amplitude)
        samples = 400
        velocities = []
        for k in range(samples):
            r0 = period * ((k + 0.5) / samples - 0.5)
            _, stretch = followed(chain, Cycles(amplitude, 6), start=State.prepared(chain, [r0]))
            x = stretch.recorded["x_G"]
            velocities.append((x[-1] - x[3]) / 8)
        # a midpoint rule of a function with at most two jumps of height `period` / 2 each
        assert abs(np.mean(velocities) - max(0.0, reach - margin)) <= 2 * period / samples


def test_a_lone_slip_of_an_end_slider_takes_pi_and_moves_by_twice_the_excess():
    for n in (2, 3, 30):
        chain = paper_chain(n, sigma_mu="0")
        result = rearrange(chain, State.relaxed(chain), direction=1)
        assert result.itinerary == (("start", (n,), (1,)), ("stop", (n,), (1,)))
        assert result.duration == pytest.approx(math.pi, rel=4e-16)
        moved = result.state.displacements[-1]
        assert moved == pytest.approx(2 * chain.excess, rel=4e-16)
        assert result.evidence is Evidence.COMPUTED
        assert float(result.theta) * 1000 == pytest.approx(
            chain.times_cosine(chain.mu_s - chain.tan_alpha), rel=4e-16
        )


def test_a_lone_slip_of_an_inner_slider_takes_pi_over_root_two_and_moves_by_the_excess():
    chain = paper_chain(3, sigma_mu="0", tan_alpha="0")
    tension = chain.times_cosine(Fraction(3, 10)) + 1e-13
    result = rearrange(chain, State.prepared(chain, [-tension, tension]), direction=0)
    assert result.itinerary == (("start", (2,), (1,)), ("stop", (2,), (1,)))
    assert result.duration == pytest.approx(math.pi / math.sqrt(2), rel=4e-16)
    # it starts 2e-13 above its threshold
    assert result.state.displacements[1] == pytest.approx(chain.excess, abs=4e-13)


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


def test_below_mu_d_the_second_slider_stays():
    chain = Chain(2, 1, "0.5", "0.6", tan_alpha=Fraction(1, 2) - Fraction(1, 10**12))
    result = rearrange(chain, State.relaxed(chain), direction=1)
    assert result.itinerary == (("start", (2,), (1,)), ("stop", (2,), (1,)))


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


def test_at_an_equality_a_slider_stays_and_ties_are_one_counted_event():
    chain = Chain(3, 1, "1/2", "3/5", tan_alpha="1/5")
    state = State.relaxed(chain)
    lone = (("start", (3,), (1,)), ("stop", (3,), (1,)))
    for _ in range(2):
        result = rearrange(chain, state, direction=1)
        assert result.itinerary == lone
        state = result.state
    # slider 2 stands at its threshold, sliders 1 and 3 reach theirs together
    assert abs(state.forces(chain)[1] - chain.times_cosine(chain.mu_s)) < 1e-15
    result = rearrange(chain, state, direction=1)
    assert result.itinerary[0] == ("start", (1, 3), (-1, 1))
    assert result.undecided > 0
    assert result.evidence is Evidence.UNDECIDED
    _, stretch = followed(chain, Path(["1"]))
    assert stretch.completed == 1


def test_a_slider_is_counted_as_undecided_once_in_a_rearrangement_not_at_every_step():
    chain = Chain(3, 1, "1/2", "3/5", tan_alpha="1/5")
    state = State.relaxed(chain)
    counts = []
    for _ in range(8):
        result = rearrange(chain, state, direction=1)
        assert len(result.events) == 2
        counts.append(result.undecided)
        state = result.state
    # two lone slips, the second beside a slider that reaches its threshold exactly; then slider 2
    # stands at its threshold while 1 and 3 start together and stop together
    assert counts == [0, 1] + 6 * [3]
    assert result.report["cluster_steps"] > 3


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


def test_a_single_slider_rests_up_to_its_static_friction():
    for tan_alpha in ("0.2", "0.55", "0.6"):
        chain = paper_chain(1, sigma_mu="0", tan_alpha=tan_alpha)
        result = rearrange(chain, State.relaxed(chain), direction=0)
        assert result.events == ()
        assert result.outcome is Outcome.AT_REST


def test_a_chain_without_static_excess_is_refused_and_sent_to_the_sliding_limit():
    chain = paper_chain(3, sigma_mu="0", mu_s="0.5")
    with pytest.raises(InputError, match="sliding"):
        rearrange(chain, State.relaxed(chain), direction=1)


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


def test_a_stuck_slider_keeps_its_coefficient_through_an_avalanche():
    chain = paper_chain(10, tan_alpha="0.4")
    state = State.relaxed(chain, 7)
    checked = 0
    for _ in range(60):
        result = rearrange(chain, state, direction=1, seed=7)
        stopped = {n for e in result.events if e.kind is EventKind.STOP for n in e.sliders}
        for n in range(1, 11):
            kept = result.state.coefficients[n - 1] == state.coefficients[n - 1]
            assert kept == (n not in stopped)
            slips = sum(n in e.sliders for e in result.events if e.kind is EventKind.STOP)
            assert result.state.draws[n - 1] == state.draws[n - 1] + slips
        checked += len(result.events) > 2
        state = result.state
    assert checked > 10


def ledger(result) -> float:
    """Return the relative error of elastic + kinetic + gravity + friction work over a result."""
    chain = result.chain
    sol = result.sol
    friction, weight = chain.friction, chain.sin_alpha
    worst = 0.0
    tension = result.initial.tensions.astype(float)
    start = sol(0.0).positions
    path = np.zeros(chain.n)
    before = start
    for piece in sol.pieces:
        for share in (0.5, 1.0):
            t = piece.t_min + share * (piece.t_max - piece.t_min)
            motion = piece(t)
            path += np.abs(motion.positions - before)  # within a piece no slider turns
            before = motion.positions
            u = motion.positions - start
            stretched = tension + np.diff(u)
            elastic = 0.5 * np.sum(stretched**2), 0.5 * np.sum(tension**2)
            terms = np.array(
                [
                    elastic[0],
                    -elastic[1],
                    0.5 * np.sum(motion.velocities**2),
                    -weight * np.sum(u),
                    friction * np.sum(path),
                ]
            )
            worst = max(worst, abs(terms.sum()) / np.abs(terms).max())
    return worst


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


@pytest.mark.parametrize("n", [2, 3, 6, 10, 30])
def test_the_energy_ledger_of_every_rearrangement_closes(n):
    chain = paper_chain(n, tan_alpha="0.35")
    state = State.relaxed(chain, n)
    events = 0
    for k in range(60):
        result = rearrange(chain, state, direction=1 if k < 40 else -1, seed=n)
        assert ledger(result) < 1e-12
        events += len(result.events)
        state = result.state
    assert events >= 120


def test_every_rest_state_satisfies_the_static_condition_and_times_increase():
    chain = paper_chain(12, tan_alpha="0.3")
    state = State.relaxed(chain, 1)
    for k in range(120):
        result = rearrange(chain, state, direction=1 if k % 60 < 30 else -1, seed=1)
        state = result.state
        limit = np.maximum(state.coefficients, 0.5) * chain.cos_alpha
        inner = slice(1, -1) if k % 60 in (29, 59) else slice(None)
        assert np.all(np.abs(state.forces(chain)[inner]) <= limit[inner] * (1 + 1e-15))
        times = [event.time for event in result.events]
        assert times == sorted(times)
        assert max(event.residual for event in result.events) < 1e-13


def test_the_mirror_image_of_a_chain_moves_as_its_mirror_image():
    chain = paper_chain(6, sigma_mu="0")
    rng = np.random.default_rng(5)
    tensions = rng.uniform(-0.1, 0.1, 5)
    here, there = (
        followed(c, Path(["0.004", "-0.004", "0.004"]), start=State.prepared(c, t))[0].state()
        for c, t in ((chain, tensions), (chain.mirrored(), tensions[::-1]))
    )
    assert np.array_equal(here.displacements, -there.displacements[::-1])


def test_a_dummy_breakpoint_and_what_is_recorded_change_no_bit():
    chain = paper_chain(6)
    plain = Path(["0.004", "-0.004"])
    broken = Path(["0.001", "0.00123", "0.004", "0.0039", "0.003", "-0.002", "-0.004"])
    one, _ = followed(chain, plain, seed=3)
    other, _ = followed(chain, broken, seed=3)
    logged = ExactSimulation(chain, State.relaxed(chain, 3), 3, ("x", "slips", "events"))
    logged.follow(plain, 1, 2)
    piecewise = ExactSimulation(chain, State.relaxed(chain, 3), 3)
    done = 0
    while done < 2:
        done += piecewise.follow(plain, 1 + done, 2 - done, Limits(7)).completed
    for simulation in (other, logged, piecewise):
        assert np.array_equal(one.state().displacements, simulation.state().displacements)
        assert np.array_equal(one.state().tensions, simulation.state().tensions)
        assert one.tally == simulation.tally


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


def test_scaling_the_length_unit_scales_the_amplitude():
    short, long = (
        followed(paper_chain(5, l0=l0), Path([a, -Fraction(a)]), seed=9)[0].state()
        for l0, a in ((1, "4"), (1024, Fraction(4, 1024)))
    )
    assert np.array_equal(short.displacements, long.displacements)


def test_simulations_go_on_bit_for_bit_from_a_snapshot():
    chain = paper_chain(8)
    drive = Cycles("0.006", 6)
    whole, _ = followed(chain, drive, seed=2)
    first = ExactSimulation(chain, State.relaxed(chain, 2), 2)
    done = first.follow(drive, 1, 12, Limits(3333)).completed
    assert 0 < done < 12
    second = ExactSimulation(chain, State.relaxed(chain, 2), 2)
    first.come_to_rest(NO_LIMITS)
    second.restore(first.snapshot())
    while done < 12:
        done += second.follow(drive, 1 + done, 12 - done, Limits(500)).completed
    assert np.array_equal(whole.state().displacements, second.state().displacements)
    assert whole.tally == second.tally


def test_exact_and_reference_agree_on_itineraries_and_tensions():
    compared = 0
    for n, tan_alpha in ((2, "0.25"), (6, "0.25"), (10, "0.45"), (20, "0.4")):
        chain = paper_chain(n, tan_alpha=tan_alpha)
        state = State.relaxed(chain, n)
        for k in range(16):
            way = 1 if k < 8 else -1
            ours = rearrange(chain, state, direction=way, seed=n)
            other = rearrange(chain, state, direction=way, seed=n, solver="reference")
            assert ours.itinerary == other.itinerary
            tensions = other.state.tensions.astype(float)
            assert np.allclose(ours.state.tensions, tensions, rtol=0, atol=1e-12)
            compared += len(ours.events)
            state = ours.state
    assert compared > 300


def test_work_per_event_is_bounded():
    for n, steps, roots in ((6, 1.1, 3.0), (30, 1.4, 5.0), (60, 1.4, 5.0)):
        simulation, _ = followed(paper_chain(n), Cycles("0.005", 6))
        report = simulation.report()
        events = simulation.tally.events
        assert report["cluster_steps"] < steps * events
        assert report["root_evaluations"] < roots * events


def test_a_long_chain_slips_only_where_the_temperature_reaches():
    chain = paper_chain(100_000)
    simulation, stretch = followed(chain, Cycles("0.001", 2))
    assert stretch.completed == 4
    moved = np.nonzero(simulation.state().displacements)[0]
    assert simulation.tally.slips > 10
    assert np.all((moved < 100) | (moved > 99_900))


def test_batches_of_draws_have_the_bits_of_the_keyed_coefficients():
    for seed, n in ((0, 3), (2**64 - 1, 2), (20110603, 5)):
        chain = paper_chain(n)
        simulation, _ = followed(chain, Cycles("0.01", 40), seed=seed)
        state = simulation.state()
        for slider in range(1, n + 1):
            k = int(state.draws[slider - 1]) - 1
            assert k > 100
            drawn = disorder.static_coefficient(chain, seed, slider, k)
            assert state.coefficients[slider - 1] == drawn


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
