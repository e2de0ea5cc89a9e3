"""The solver "verlet": the contact rules, resumption, and what it costs."""

import dataclasses
import math

import numpy as np
import pytest

from exactcreep.limits import Limits, Stop
from exactcreep.model import disorder
from exactcreep.model.chain import Chain
from exactcreep.model.contacts import EventKind
from exactcreep.model.drive import Cycles, Path
from exactcreep.model.numbers import InputError
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.model.state import State
from exactcreep.solvers.verlet.solver import Verlet

PAPER = {"l0": 1000, "mu_d": "0.5", "mu_s": "0.6", "sigma_mu": "0.01", "tan_alpha": "0.25"}
RECORD = ("x_G", "x", "tension", "slips", "events")


def paper(n: int, **changes: object) -> Chain:
    return Chain(n, **{**PAPER, **changes})


def run(chain, drive, *, seed=3, record=RECORD, **options):
    """Follow the whole drive."""
    simulation = Verlet(**options).simulation(chain, State.relaxed(chain, seed), seed, record)
    stretch = simulation.follow(drive, 1, drive.half_cycles)
    return simulation, stretch.recorded, stretch


# Options


REFUSED = [
    *({"dt": dt} for dt in (0, -0.1, math.nan, math.inf, "fast", None, "1e-300", True)),
    *({"locate": locate} for locate in (1, "yes", None)),
]


@pytest.mark.parametrize("options", REFUSED, ids=str)
def test_an_option_out_of_range_is_refused_by_name(options):
    with pytest.raises(InputError, match=rf"^{next(iter(options))} = "):
        Verlet(**options)


def test_the_options_have_the_papers_defaults_and_cannot_be_changed():
    assert Verlet() == Verlet(dt="1/100", locate=False)
    with pytest.raises(dataclasses.FrozenInstanceError):
        Verlet().dt = 1.0


# Lone slips


@pytest.mark.parametrize("n", [2, 3])
def test_a_lone_slip_of_an_end_slider_moves_by_2_d_in_the_time_pi(n):
    chain = paper(n, sigma_mu=0)
    result = Verlet(locate=True, dt="0.001").rearrange(chain, State.relaxed(chain), 1, 0)
    assert result.itinerary == (("start", (n,), (1,)), ("stop", (n,), (1,)))
    assert result.events[1].time == pytest.approx(math.pi, rel=0, abs=1e-6)
    moved = result.state.displacements
    assert moved[-1] == pytest.approx(2 * chain.excess, rel=0, abs=1e-13)
    assert (moved[:-1] == 0).all()
    assert result.theta == pytest.approx(
        (0.6 * chain.cos_alpha - chain.sin_alpha) / 1000, rel=1e-14
    )


def test_without_locating_a_slip_ends_at_the_first_step_beyond_the_stop():
    chain = paper(2, sigma_mu=0)
    result = Verlet(dt="0.01").rearrange(chain, State.relaxed(chain), 1, 0)
    assert result.events[1].time == pytest.approx(3.15, rel=0, abs=1e-12)
    assert 0 < result.events[1].residual < 0.01 * 2 * chain.excess


# The contact rules


def test_a_slider_that_stops_draws_the_next_keyed_coefficient_and_nobody_else_does():
    chain = paper(6)
    result = Verlet().rearrange(chain, State.relaxed(chain, 11), 1, 11)
    stops = [n for event in result.events if event.kind is EventKind.STOP for n in event.sliders]
    for n in range(1, 7):
        k = stops.count(n)
        assert result.state.draws[n - 1] == 1 + k
        assert result.state.coefficients[n - 1] == disorder.static_coefficient(chain, 11, n, k)


def test_a_stuck_slider_keeps_its_coefficient_through_an_avalanche():
    chain = paper(30)
    simulation, recorded, _ = run(chain, Cycles("0.005", 10))
    state = simulation.state()
    assert (state.draws == 1 + recorded["slips"].sum(axis=0)).all()
    for n in range(1, 31):
        keyed = disorder.static_coefficient(chain, 3, n, int(state.draws[n - 1]) - 1)
        assert state.coefficients[n - 1] == keyed


def test_a_chain_left_at_rest_satisfies_the_static_condition():
    for locate in (False, True):
        simulation, _, _ = run(paper(30), Cycles("0.01", 5), locate=locate)
        state = simulation.state()
        chain = paper(30)
        room = np.maximum(state.coefficients, 0.5) * chain.cos_alpha - abs(state.forces(chain))
        assert room.min() > -1e-12


def test_starts_and_stops_of_every_slider_alternate_in_a_rearrangement():
    chain = paper(10, tan_alpha="0.45")
    state = State.relaxed(chain, 2)
    seen = 0
    for direction in [1] * 20 + [-1] * 20:
        result = Verlet(locate=True).rearrange(chain, state, direction, 2)
        moving = set()
        for event in result.events:
            sliders = set(event.sliders)
            assert list(event.sliders) == sorted(sliders)
            if event.kind is EventKind.START:
                assert not sliders & moving
                moving |= sliders
            else:
                assert sliders <= moving
                moving -= sliders
            seen += 1
        assert moving == set()
        times = [event.time for event in result.events]
        assert times == sorted(times)
        state = result.state
    assert seen > 200


def test_a_drawn_coefficient_below_mu_d_acts_as_mu_d_is_kept_and_counted():
    chain = paper(6, mu_s="0.5")
    simulation, _, _ = run(chain, Cycles("0.002", 3))
    drawn = np.concatenate(
        [
            disorder.static_coefficients(chain, 3, n, 1, int(k) - 1)
            for n, k in enumerate(simulation.state().draws, start=1)
        ]
    )
    assert simulation.tally.draws_below_mu_d == (drawn < 0.5).sum() > 0
    assert (simulation.state().coefficients < 0.5).any()


def test_on_a_ramp_an_end_slider_whose_mu_s_acts_as_mu_d_makes_a_slip_of_length_zero():
    chain = paper(6, mu_s="0.5")
    seed = next(s for s in range(99) if disorder.static_coefficient(chain, s, 6, 0) < 0.5)
    relaxed = State.relaxed(chain, seed)
    result = Verlet().rearrange(chain, relaxed, 1, seed)
    assert result.itinerary == (("start", (6,), (1,)), ("stop", (6,), (1,)))
    assert [event.time for event in result.events] == [0.0, 0.0]
    assert (result.state.displacements == 0).all()
    assert result.state.draws.tolist() == [1, 1, 1, 1, 1, 2]
    assert result.state.forces(chain)[-1] == pytest.approx(chain.friction, rel=1e-14)
    again = Verlet().rearrange(chain, result.state, 1, seed)
    assert again.theta >= result.theta


def test_simultaneous_events_are_one_event_on_a_set_of_sliders():
    chain = paper(5, tan_alpha=0, sigma_mu=0)
    for locate in (False, True):
        result = Verlet(locate=locate).rearrange(chain, State.relaxed(chain), 1, 0)
        assert result.itinerary == (("start", (1, 5), (-1, 1)), ("stop", (1, 5), (-1, 1)))
        assert result.undecided > 0
        assert result.evidence is Evidence.UNDECIDED


@pytest.mark.parametrize("n", [7, 60])
def test_a_mirror_symmetric_chain_stays_mirror_symmetric_bit_for_bit(n):
    """Long chains move at both ends at the same time, in two windows."""
    for locate in (False, True):
        chain = paper(n, tan_alpha=0, sigma_mu=0)
        _, recorded, _ = run(chain, Cycles("0.01", 10), locate=locate)
        moved = recorded["x"]
        assert (moved == -moved[:, ::-1]).all()
        assert np.abs(moved).max() > 1
        assert (recorded["x_G"] == 0).all()


def test_the_mirror_image_of_the_incline_mirrors_every_displacement():
    """Without disorder, for the same dilations: x_n becomes -x_(N+1-n)."""
    chain = paper(6, sigma_mu=0)
    for locate in (False, True):
        _, here, _ = run(chain, Cycles("0.01", 4), locate=locate)
        _, there, _ = run(chain.mirrored(), Cycles("0.01", 4), locate=locate)
        assert (there["x"] == -here["x"][:, ::-1]).all()
        assert np.abs(here["x"]).max() > 1


def test_a_slider_whose_ramp_ends_exactly_at_its_threshold_stays():
    # forces in units of c = 0.8: F_2 reaches 0.6 c = 0.48 when s + l0 theta = 0.48
    chain = Chain(2, 1, "0.5", "0.6", tan_alpha="0")
    at = Verlet().simulation(chain, State.relaxed(chain), 0, ("x",))
    at.follow(Path(["0.6"]), 1, 1)
    assert at.tally.events == 0
    beyond = Verlet().simulation(chain, State.relaxed(chain), 0, ("x",))
    beyond.follow(Path(["0.6000000001"]), 1, 1)
    assert beyond.tally.events == 2


def test_a_start_that_is_not_at_rest_is_first_rearranged_at_its_own_theta():
    chain = paper(4, sigma_mu=0)
    state = State.prepared(chain, ["0", "1.5", "0"], theta="0.125")
    result = Verlet().rearrange(chain, state, 0, 0)
    assert result.itinerary[0] == ("start", (2, 3), (1, -1))
    assert result.theta == result.state.theta == 0.125
    simulation = Verlet().simulation(chain, state, 0, ("x", "events"))
    stretch = simulation.follow(Path(["0.125"]), 1, 1)
    assert (stretch.recorded["x"][0] == result.state.displacements).all()
    assert (stretch.recorded["event_theta"] == 0.125).all()


def test_a_stable_state_left_as_it_stands_has_no_events():
    chain = paper(4)
    result = Verlet().rearrange(chain, State.relaxed(chain), 0, 0)
    assert result.events == ()
    assert result.outcome is Outcome.AT_REST
    assert result.sol.pieces == ()
    assert (result.sol(0.0).forces == chain.sin_alpha).all()


# One slider


def test_one_slider_has_no_spring_and_rests_or_runs_away():
    rest = Verlet().rearrange(paper(1), State.relaxed(paper(1)), 1, 0)
    assert (rest.events, rest.outcome) == ((), Outcome.AT_REST)
    steep = paper(1, tan_alpha="0.7", sigma_mu=0)
    away = Verlet().rearrange(steep, State.relaxed(steep), 0, 0)
    assert away.outcome is Outcome.RUNAWAY
    assert away.itinerary == (("start", (1,), (1,)),)
    push = steep.sin_alpha - steep.friction
    end = away.sol.t_max
    assert away.velocities[0] == pytest.approx(push * end, rel=1e-12)
    assert away.sol(end).positions[0] == pytest.approx(push * end**2 / 2, rel=1e-12)


# Runaway and limits


@pytest.mark.parametrize(("tan_alpha", "way"), [("0.55", 1), ("-0.55", -1)])
def test_a_runaway_is_proved_and_returned_with_the_state_and_the_time(tan_alpha, way):
    chain = paper(6, tan_alpha=tan_alpha)
    result = Verlet().rearrange(chain, State.relaxed(chain), 1, 0)
    assert result.outcome is Outcome.RUNAWAY
    v = result.velocities
    assert (way * v > 0).all()
    mean = v.mean()
    tensions = result.state.tensions
    twice = ((v - mean) ** 2).sum() + (tensions**2).sum()
    assert way * mean > math.sqrt((1 - 1 / 6) * twice)
    assert result.sol(result.sol.t_max).velocities == pytest.approx(v, rel=1e-9)


def test_a_drive_ends_early_with_the_outcome_if_the_chain_runs_away():
    simulation, recorded, stretch = run(paper(6, tan_alpha="0.55"), Cycles("0.01", 5))
    assert stretch.stop is Stop.RUNAWAY
    assert stretch.completed == 0
    assert recorded["x_G"].size == 0
    assert simulation.state().displacements.min() > 0


def test_a_chain_that_may_not_run_away_never_does():
    simulation, _, stretch = run(paper(6, tan_alpha="0.499"), Cycles("0.002", 2))
    assert stretch.stop is Stop.DONE
    assert simulation.tally.slips > 0


@pytest.mark.parametrize("dt", [1.5, 3.0, 1e5])
def test_an_unstable_time_step_ends_in_a_limit_with_a_reason(dt):
    chain = paper(6)
    _, _, stretch = run(chain, Cycles("0.01", 3), dt=dt)
    assert stretch.stop is Stop.LIMIT
    assert "dt" in stretch.reason
    result = Verlet(dt=dt).rearrange(chain, State.relaxed(chain, 3), 1, 3)
    assert result.outcome in (Outcome.LIMIT, Outcome.AT_REST)


def test_a_rearrangement_that_does_not_end_is_given_up():
    """At tan_alpha = mu_d sliders that move down neither gain nor lose energy: it may never end."""
    chain = paper(6, tan_alpha="0.5")
    state = State.relaxed(chain, 3)
    results = []
    for _ in range(12):
        results.append(Verlet().rearrange(chain, state, 1, 3, Limits(500)))
        state = results[-1].state
        if results[-1].outcome is not Outcome.AT_REST:
            break
    assert results[-1].outcome is Outcome.LIMIT
    assert results[-1].reason == "max_events = 500 was reached"
    assert len(results[-1].events) >= 500
    assert np.abs(results[-1].velocities).max() > 0


# The motion as a function of time


@pytest.mark.parametrize("locate", [False, True])
def test_the_solution_passes_through_every_event_and_ends_in_the_final_state(locate):
    chain = paper(6, tan_alpha="0.45")
    state = State.relaxed(chain, 8)
    longest = max(
        (Verlet(locate=locate).rearrange(chain, state, way, 8) for way in (1, -1)),
        key=lambda result: len(result.events),
    )
    for _ in range(10):
        nxt = Verlet(locate=locate).rearrange(chain, longest.state, 1, 8)
        longest = nxt if len(nxt.events) >= len(longest.events) else longest
        state = nxt.state
    sol = longest.sol
    assert len(sol.pieces) == len(longest.events) - 1
    assert sol.ts.tolist() == [event.time for event in longest.events]
    start, end = sol(0.0), sol(sol.t_max)
    assert (start.positions == longest.initial.displacements).all()
    assert (start.velocities == 0).all()
    assert start.forces == pytest.approx(longest.initial.forces(chain), rel=0, abs=1e-13)
    assert end.positions == pytest.approx(longest.state.displacements, rel=0, abs=1e-12)
    assert end.forces == pytest.approx(longest.state.forces(chain), rel=0, abs=1e-12)
    for before, after in zip(sol.pieces[:-1], sol.pieces[1:], strict=True):
        left, right = before(before.t_max), after(after.t_min)
        assert left.positions == pytest.approx(right.positions, rel=0, abs=1e-12)


def test_between_events_the_solution_obeys_the_equation_of_motion():
    chain = paper(5, tan_alpha="0.45")
    state = State.prepared(chain, ["1", "-1", "0.9", "-0.3"], seed=1)
    result = Verlet(dt="0.001").rearrange(chain, state, 0, 1)
    assert len(result.events) > 2
    piece = max(result.sol.pieces, key=lambda piece: piece.t_max - piece.t_min)
    for t in np.linspace(piece.t_min + 0.01, piece.t_max - 0.01, 7):
        h = 1e-4
        now = piece(t)
        moving = now.velocities != 0
        a = (piece(t + h).velocities - piece(t - h).velocities) / (2 * h)
        push = now.forces - chain.friction * np.sign(now.velocities)
        assert a[moving] == pytest.approx(push[moving], rel=0, abs=1e-5)
        assert (a[~moving] == 0).all()
        assert moving.any()


def test_the_solution_takes_one_time_or_many():
    chain = paper(3)
    result = Verlet().rearrange(chain, State.relaxed(chain), 1, 0)
    times = np.linspace(0, result.sol.t_max, 5)
    many = result.sol(times)
    assert many.positions.shape == many.velocities.shape == many.forces.shape == (3, 5)
    for k, t in enumerate(times):
        assert (many.positions[:, k] == result.sol(t).positions).all()
    with pytest.raises(ValueError, match="must lie between"):
        result.sol(result.sol.t_max + 1)


# Going on


def test_what_is_recorded_changes_no_bit():
    drive = Cycles("0.005", 4)
    _, everything, _ = run(paper(10), drive)
    _, little, _ = run(paper(10), drive, record=("x_G",))
    assert list(little) == ["x_G"]
    assert (little["x_G"] == everything["x_G"]).all()


def test_a_dummy_breakpoint_changes_no_displacement():
    """An intermediate target at which nothing happens, in the middle of a ramp."""
    chain = Chain(4, 1024, "0.5", "0.6", "0.01", tan_alpha="0.25")
    one, _, _ = run(chain, Path(["0.03125", "-0.03125"]))
    two, _, _ = run(chain, Path(["0.015625", "0.03125", "0", "-0.03125"]))
    assert one.tally == two.tally
    assert (one.state().displacements == two.state().displacements).all()
    assert (one.state().tensions == two.state().tensions).all()


def test_the_state_between_two_events_is_the_one_of_the_moment():
    chain = paper(6, tan_alpha="0.45")
    simulation = Verlet().simulation(chain, State.relaxed(chain, 1), 1, ())
    drive = Cycles("0.01", 1)
    tensions = []
    for _ in range(30):
        simulation.follow(drive, 1, 1, Limits(1))
        state = simulation.state()
        tensions.append(state.tensions)
        bare = np.diff(state.displacements) - 1000 * state.theta
        assert state.tensions == pytest.approx(bare, rel=0, abs=1e-12)
    assert len({part.tobytes() for part in tensions}) > 20


# Records and counts


def test_the_records_agree_with_each_other_and_with_the_counts():
    simulation, recorded, _ = run(paper(6), Cycles("0.01", 6))
    tally = simulation.tally
    assert recorded["x"].shape == (12, 6)
    assert recorded["tension"].shape == (12, 5)
    assert recorded["x_G"] == pytest.approx(recorded["x"].mean(axis=1), rel=1e-14)
    targets = Cycles("0.01", 6).targets(1, 12)
    bare = np.diff(recorded["x"], axis=1) - 1000 * targets[:, None]
    assert recorded["tension"] == pytest.approx(bare, rel=0, abs=1e-11)
    stops = recorded["event_kind"] == 1
    assert recorded["slips"].sum() == stops.sum() == (~stops).sum() == tally.slips
    for q in (1, 7, 12):
        here = stops & (recorded["event_half_cycle"] == q)
        counted = np.bincount(recorded["event_slider"][here], minlength=7)[1:]
        assert (counted == recorded["slips"][q - 1]).all()
    keys = set(zip(recorded["event_rearrangement"], recorded["event_number"], strict=True))
    assert len(keys) == tally.events
    assert recorded["event_rearrangement"].max() == tally.rearrangements - 1
    assert set(recorded["event_sign"].tolist()) == {-1, 1}


def test_a_simulation_makes_the_rearrangements_that_are_made_one_at_a_time():
    chain = paper(6)
    _, recorded, _ = run(chain, Path(["0.003"]))
    state = State.relaxed(chain, 3)
    for number in range(int(recorded["event_rearrangement"].max()) + 1):
        result = Verlet().rearrange(chain, state, 1, 3)
        mine = recorded["event_rearrangement"] == number
        assert recorded["event_time"][mine].tolist() == [
            event.time for event in result.events for _ in event.sliders
        ]
        assert recorded["event_slider"][mine].tolist() == [
            n for event in result.events for n in event.sliders
        ]
        assert recorded["event_theta"][mine][0] == pytest.approx(result.theta, rel=1e-12)
        state = result.state


def test_resting_sliders_cost_nothing():
    """The same slips at the lower end, in a short chain and in a long one: as many steps."""
    steps = []
    for n in (40, 4000):
        simulation = Verlet().simulation(paper(n), State.relaxed(paper(n), 0), 0, ())
        simulation.follow(Path(["0.002"]), 1, 1)
        steps.append((simulation.report()["steps"], simulation.tally.events > 10))
    assert steps[1][1]
    assert steps[1][0] < 2 * steps[0][0]


def test_the_velocity_of_six_sliders_is_the_papers_within_three_per_cent():
    chain = paper(6)
    _, recorded, _ = run(chain, Cycles("0.01", 100), record=("x_G",))
    measured = (recorded["x_G"][199] - recorded["x_G"][19]) / 180
    # Eq. (vitesse_seuil): mu_d (1 - 2 (i - 1)/N) < tan_alpha < mu_d (1 - 2 (i - 2)/N) at i = 3
    i, m = 3, chain.friction - chain.sin_alpha
    assert 0.5 * (1 - 2 * (i - 1) / 6) < 0.25 < 0.5 * (1 - 2 * (i - 2) / 6)
    predicted = (6 + 3 - 2 * i) / 2 * (2 * 1000 * 0.01 - 6 * m)
    assert measured == pytest.approx(predicted, rel=0.03)
