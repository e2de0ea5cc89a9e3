"""The solver "verlet": the contact rules, its motion as a function of time, and its records."""

import math

import pytest

from exactcreep import laws
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles, Path
from exactcreep.model.numbers import InputError
from exactcreep.model.outcome import Outcome
from exactcreep.model.state import State
from exactcreep.solvers.verlet.solver import Verlet
from exactcreep.watch.limits import Stop
from tests.paper import captions, lone_slip, paper_chain

RECORD = ("x_G", "x", "tension", "slips", "events")


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


@pytest.mark.parametrize(("theta", "events"), [("0.6", 0), ("0.6000000001", 2)])
def test_a_slider_whose_ramp_ends_exactly_at_its_threshold_stays(theta, events):
    simulation, _, _ = run(Chain(2, 1, "0.5", "0.6", tan_alpha="0"), Path([theta]))
    assert simulation.tally.events == events


# Runaway and limits


@pytest.mark.parametrize("dt", [1.5, 3.0, 1e5])
def test_an_unstable_time_step_ends_in_a_limit_with_a_reason(dt):
    chain = paper_chain(6)
    _, _, stretch = run(chain, Cycles("0.01", 3), dt=dt)
    assert stretch.stop is Stop.LIMIT
    assert "dt" in stretch.reason
    assert first(chain, seed=3, dt=dt).outcome in (Outcome.LIMIT, Outcome.AT_REST)


# Runs


def test_the_velocity_of_six_sliders_is_the_papers_within_three_per_cent():
    chain = paper_chain(6)
    x = run(chain, Cycles("0.01", 60), record=("x_G",))[1]["x_G"]
    measured = (x[119] - x[19]) / 100
    predicted = laws.creep_velocity(n=6, l0=1000, mu_d=0.5, tan_alpha=0.25, amplitude=0.01)
    assert measured == pytest.approx(predicted, rel=0.03)
