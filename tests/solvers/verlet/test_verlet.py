"""The solver "verlet": the contact rules, its motion as a function of time, and its records."""

import math

import numpy as np
import pytest

from exactcreep import laws
from exactcreep.model import keyed_disorder
from exactcreep.model.chain import Chain
from exactcreep.model.contacts import EventKind
from exactcreep.model.drive import Cycles, Path
from exactcreep.model.numbers import InputError
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.model.state import State
from exactcreep.quasistatic.creep import creep
from exactcreep.solvers.verlet.solver import Verlet
from exactcreep.watch.limits import Stop
from tests.paper import captions, lone_slip, paper_chain

RECORD = ("x_G", "x", "tension", "slips", "events")
either = pytest.mark.parametrize("locate", [False, True])


def run(chain, drive, *, seed=3, record=RECORD, **options):
    """Follow the whole drive."""
    simulation = Verlet(**options).simulation(chain, State.relaxed(chain, seed), seed, record)
    stretch = simulation.follow(drive, 1, drive.half_cycles)
    return simulation, stretch.recorded, stretch


def first(chain, direction=1, *, seed=0, state=None, limits=None, **options):
    """Return the rearrangement that follows a ramp, from the relaxed chain unless told."""
    state = State.relaxed(chain, seed) if state is None else state
    more = () if limits is None else (limits,)
    return Verlet(**options).rearrange(chain, state, direction, seed, *more)


REFUSED = [
    *({"dt": dt} for dt in (0, math.nan, "fast", "1e-300", True)),
    {"locate": 1},
]


@pytest.mark.parametrize("options", REFUSED, ids=str)
def test_an_option_out_of_range_is_refused_by_name(options):
    assert Verlet() == Verlet(dt="1/100", locate=False)
    with pytest.raises(InputError, match=rf"^{next(iter(options))} = "):
        Verlet(**options)


# The contact rules


@pytest.mark.parametrize("n", [2, 3])
def test_a_lone_slip_of_an_end_slider_moves_by_2_d_in_the_time_pi(n):
    chain = captions(n)
    result = first(chain, locate=True, dt="0.001")
    assert result.itinerary == lone_slip(n)
    assert result.events[1].time == pytest.approx(math.pi, rel=0, abs=1e-6)
    moved = result.state.displacements
    assert moved[-1] == pytest.approx(2 * chain.excess, rel=0, abs=1e-13)
    assert (moved[:-1] == 0).all()
    theta = (0.6 * chain.cos_alpha - chain.sin_alpha) / 1000
    assert result.theta == pytest.approx(theta, rel=1e-14)
    late = first(chain, dt="0.01")  # ends at the first step beyond the stop
    assert late.events[1].time == pytest.approx(3.15, rel=0, abs=1e-12)
    assert 0 < late.replay().residuals()[1] < 0.01 * 2 * chain.excess


def test_a_slider_that_stops_draws_the_next_keyed_coefficient_and_nobody_else_does():
    chain = paper_chain(30)
    simulation, recorded, _ = run(chain, Cycles("0.005", 4))
    end = simulation.state()
    assert (end.draws == 1 + recorded["slips"].sum(axis=0)).all()
    for n, draws in enumerate(end.draws.tolist()):
        drawn = keyed_disorder.static_coefficient(chain, 3, n + 1, draws - 1)
        assert end.coefficients[n] == drawn


def test_a_slider_that_rests_between_distant_movers_feels_the_force_of_now():
    """It slipped before, under another force; now movers at both ends share a cluster with it."""
    chain = captions(6, tan_alpha=0)
    start = State.prepared(chain, ["0.3", "-0.2", "0.41", "-0.2", "0.3"])
    stepped, exact = (
        creep(chain, Cycles("0.002", 1), start=start, record=("events",), **options).recorded
        for options in ({"solver": "verlet", "dt": "0.001"}, {"solver": "exact"})
    )
    for name in ("event_slider", "event_kind", "event_sign"):
        assert stepped[name].tolist() == exact[name].tolist()


@either
def test_rearrangements_alternate_starts_and_stops_and_end_at_rest(locate):
    chain = paper_chain(10, tan_alpha="0.45")
    state, seen = State.relaxed(chain, 2), 0
    for direction in [1] * 20 + [-1] * 20:
        result = first(chain, direction, state=state, seed=2, locate=locate)
        moving = set()
        for event in result.events:
            sliders = set(event.sliders)
            assert list(event.sliders) == sorted(sliders)
            starts = event.kind is EventKind.START
            assert not sliders & moving if starts else sliders <= moving
            moving ^= sliders
            seen += 1
        assert moving == set()
        times = [event.time for event in result.events]
        assert times == sorted(times)
        state = result.state
        held = np.maximum(state.coefficients, 0.5) * chain.cos_alpha
        assert (held - abs(state.forces(chain))).min() > -1e-12
    assert seen > 200


@either
@pytest.mark.parametrize("n", [7, 60])
def test_a_mirror_symmetric_chain_stays_mirror_symmetric_bit_for_bit(n, locate):
    """Long chains move at both ends at the same time, in two windows."""
    chain = captions(n, tan_alpha=0)
    result = first(chain, locate=locate)
    both = (1, n), (-1, 1)
    assert result.itinerary == (("start", *both), ("stop", *both))
    assert result.undecided > 0
    assert result.evidence is Evidence.UNDECIDED
    recorded = run(chain, Cycles("0.01", 5), locate=locate)[1]
    moved = recorded["x"]
    assert (moved == -moved[:, ::-1]).all()
    assert np.abs(moved).max() > 1
    assert (recorded["x_G"] == 0).all()


@pytest.mark.parametrize(("theta", "events"), [("0.6", 0), ("0.6000000001", 2)])
def test_a_slider_whose_ramp_ends_exactly_at_its_threshold_stays(theta, events):
    simulation, _, _ = run(Chain(2, 1, "0.5", "0.6", tan_alpha="0"), Path([theta]))
    assert simulation.tally.events == events


# Runaway and limits


@pytest.mark.parametrize(("tan_alpha", "way"), [("0.55", 1), ("-0.55", -1)])
def test_a_runaway_is_proved_and_returned_with_the_state_and_the_time(tan_alpha, way):
    chain = paper_chain(6, tan_alpha=tan_alpha)
    result = first(chain)
    assert result.outcome is Outcome.RUNAWAY
    v, mean = result.velocities, result.velocities.mean()
    assert (way * v > 0).all()
    tensions = result.state.tensions
    twice = (v - mean) @ (v - mean) + tensions @ tensions
    assert way * mean > math.sqrt((1 - 1 / 6) * twice)


@pytest.mark.parametrize("dt", [1.5, 3.0, 1e5])
def test_an_unstable_time_step_ends_in_a_limit_with_a_reason(dt):
    chain = paper_chain(6)
    _, _, stretch = run(chain, Cycles("0.01", 3), dt=dt)
    assert stretch.stop is Stop.LIMIT
    assert "dt" in stretch.reason
    assert first(chain, seed=3, dt=dt).outcome in (Outcome.LIMIT, Outcome.AT_REST)


# The motion as a function of time


@either
def test_the_solution_is_the_closed_form_between_its_events_and_ends_near_its_final_state(locate):
    chain = paper_chain(6, tan_alpha="0.45")
    results = [first(chain, way, seed=8, locate=locate) for way in (1, -1)]
    for _ in range(10):
        longest = max(results, key=lambda result: len(result.events))
        results.append(first(chain, state=longest.state, seed=8, locate=locate))
    sol = longest.sol
    assert len(sol.pieces) == len(longest.events) - 1 > 5
    assert sol.ts.tolist() == [event.time for event in longest.events]
    start, end = sol(0.0), sol(sol.t_max)
    assert (start.positions == longest.initial.displacements).all()
    assert (start.velocities == 0).all()
    close = 1e-4 if locate else 1e-2  # events are late by up to the step, 0.01
    assert end.positions == pytest.approx(longest.state.displacements, rel=0, abs=close)
    assert end.forces == pytest.approx(longest.state.forces(chain), rel=0, abs=2 * close)
    for before, after in zip(sol.pieces[:-1], sol.pieces[1:], strict=True):
        left, right = before(before.t_max), after(after.t_min)
        assert left.positions == pytest.approx(right.positions, rel=0, abs=1e-12)
        middle = (before.t_min + before.t_max) / 2
        halfway = [sol(t).positions for t in (before.t_min, middle, before.t_max)]
        assert (halfway[1] != halfway[0]).any()


# Runs


def test_a_simulation_makes_the_rearrangements_that_are_made_one_at_a_time():
    chain = paper_chain(6)
    _, recorded, _ = run(chain, Path(["0.003"]))
    state = State.relaxed(chain, 3)
    for number in range(int(recorded["event_rearrangement"].max()) + 1):
        result = first(chain, state=state, seed=3)
        time, slider, theta = (
            recorded[f"event_{name}"][recorded["event_rearrangement"] == number].tolist()
            for name in ("time", "slider", "theta")
        )
        pairs = [(event.time, n) for event in result.events for n in event.sliders]
        assert list(zip(time, slider, strict=True)) == pairs
        assert theta[0] == pytest.approx(result.theta, rel=1e-12)
        state = result.state


def test_a_restored_chain_at_rest_is_not_tested_for_unstable_sliders_again():
    """Slider 2 stands at its threshold, which is counted once."""
    chain, drive = Chain(3, 1, "1/2", "3/5", tan_alpha=0), Path(["0.01", "0.02"])
    begin = State.prepared(chain, ["-0.3", "0.3"])
    one, other = (Verlet().simulation(chain, begin, 0, ()) for _ in range(2))
    one.follow(drive, 1, 1)
    other.restore(one.snapshot())
    for simulation in (one, other):
        simulation.follow(drive, 2, 1)
        assert (simulation.tally.undecided, simulation.tally.events) == (1, 0)


def test_resting_sliders_cost_nothing():
    """The same slips at the lower end, in a short chain and in a long one: as many steps."""
    drive = Path(["0.002"])
    short, long = (run(paper_chain(n), drive, seed=0, record=())[0] for n in (40, 4000))
    assert long.tally.events > 10
    assert long.report()["steps"] < 2 * short.report()["steps"]


def test_the_velocity_of_six_sliders_is_the_papers_within_three_per_cent():
    chain = paper_chain(6)
    x = run(chain, Cycles("0.01", 60), record=("x_G",))[1]["x_G"]
    measured = (x[119] - x[19]) / 100
    predicted = laws.creep_velocity(n=6, l0=1000, mu_d=0.5, tan_alpha=0.25, amplitude=0.01)
    assert measured == pytest.approx(predicted, rel=0.03)
