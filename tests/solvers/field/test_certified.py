"""What balls prove, how much they lose, and what they say when they cannot decide."""

from __future__ import annotations

import math
from dataclasses import replace
from fractions import Fraction

import flint
import numpy as np
import pytest

from exactcreep import Chain, Cycles, Evidence, InputError, State, creep, rearrange
from exactcreep import Path as ThetaPath
from exactcreep.model.enclosure import enclosure, enclosures
from exactcreep.motion.arithmetic import Undecided, balls_of, digits_of
from exactcreep.solvers.field import set_integrator
from exactcreep.solvers.field.certified import Certified, CertifiedSimulation
from exactcreep.solvers.field.computed import FieldSimulation, Mpmath
from exactcreep.solvers.interface import Start
from exactcreep.solvers.tables import LOGS, joined
from exactcreep.watch.limits import Limits
from tests.paper import captions, event_rows, lone_slip, paper_chain


def relaxed(chain):
    return Start(chain, State.relaxed(chain, 3), 3)


def followed(chain, drive, digits, seed=3, max_events=10**6, record=("x", "tension", "events")):
    solver = Certified(digits=digits)
    simulation = solver.simulation(chain, State.relaxed(chain, seed), seed, record)
    stretch = simulation.follow(drive, 1, drive.half_cycles, Limits(max_events))
    return simulation, stretch


def assert_overlap(one, other, *names):
    """Assert that two runs, or two states, may be the same numbers."""
    for name in names:
        a, b = one[name].ravel(), other[name].ravel()
        assert all(x.overlaps(y) for x, y in zip(a, b, strict=True))


def test_enclosures_hold_the_trajectory_that_mpmath_computes_with_more_digits():
    chain = paper_chain(6)
    simulation, proved = followed(chain, Cycles("0.003", 1), 15)
    other = FieldSimulation(relaxed(chain), ("x", "events"), digits_of(500))
    computed = other.follow(Cycles("0.003", 1), 1, 2)
    assert event_rows(proved) == event_rows(computed)
    with balls_of(600).active():
        exact = {name: balls_of(600).vector(computed.recorded[name].ravel())
                 for name in ("x", "event_time")}  # fmt: skip
        assert_overlap(proved.recorded, exact, *exact)
    # balls are evaluated about twice per event, and search for none
    events = simulation.tally.events
    assert events > 100
    assert 0 < simulation.mechanics.rest.evaluations < 2.5 * events


def late(signs, slider, side, time, radius):
    return slider, side, time + 1e-9, radius


def early(signs, slider, side, time, radius):
    return slider, side, time - 1e-9, radius


def another(signs, slider, side, time, radius):
    for n in np.flatnonzero(signs).tolist():
        if slider >= 0 and (n, 0) != (slider, side):
            return n, 0, time, radius
    return -1, 0, 0.0, 0.0


@pytest.mark.parametrize("wrong", [late, early, another])
def test_an_event_said_to_hold_for_all_states_is_refused_if_the_middle_has_another(
    monkeypatch, wrong
):
    found = set_integrator.first_event_of_set

    def sabotaged(springs, signs, *numbers):
        return wrong(signs, *found(springs, signs, *numbers))

    monkeypatch.setattr(set_integrator, "first_event_of_set", sabotaged)
    with pytest.raises(AssertionError, match="does not hold a state of the set"):
        followed(paper_chain(6), Cycles("0.003", 1), 15)


def random_scene(random):
    n = int(random.integers(2, 9))
    tangent = str(random.choice(["0", "1/4", "1/5", "0.3", "0.45", "0.499"]))
    mu_s = str(random.choice(["3/5", "0.55", "0.7"]))
    sigma_mu = str(random.choice(["0", "0.05"]))
    amplitude = str(round(random.uniform(0.5, 4) * n * 0.0003, 6))
    return Chain(n, 1000, "1/2", mu_s, sigma_mu, tan_alpha=tangent), Cycles(amplitude, 1)


def test_events_proved_in_float64_are_those_of_balls_with_a_search_of_their_own():
    random, together, events = np.random.default_rng(7), 0, 80
    for _ in range(12):
        chain, drive = random_scene(random)
        narrow, first = followed(chain, drive, 15, max_events=events)
        many = narrow.tally.events
        record = ("x", "tension", "events")
        plain = FieldSimulation(relaxed(chain), record, balls_of(200 + 6 * many))
        try:
            second = plain.follow(drive, 1, 2, Limits(events))
        except Undecided:  # a tie that no precision decides
            assert narrow.evidence is Evidence.UNDECIDED
            continue
        assert narrow.evidence is Evidence.PROVED
        assert event_rows(first) == event_rows(second)
        together += many
        assert_overlap(first.recorded, second.recorded, "x", "tension", "event_time", "event_theta")
        states = vars(narrow.state()), vars(plain.state())
        assert_overlap(*states, "tensions", "displacements")
    assert together > 400


def test_enclosures_keep_almost_all_bits_where_plain_balls_lose_some_at_every_event():
    chain, drive = paper_chain(4), Cycles("0.004", 1)
    narrow, _ = followed(chain, drive, 30)
    events = narrow.tally.events
    assert events > 150
    assert narrow.report()["bits_lost_per_event"] < 0.2
    plain = FieldSimulation(relaxed(chain), (), balls_of(4 * events))
    plain.follow(drive, 1, drive.half_cycles)
    assert plain.tally.events == events
    widest = max(x.rad() for x in plain.mechanics.rest.displacements)
    mantissa, exponent = widest.man_exp()
    lost = 4 * events + int(exponent) + math.log2(int(mantissa))
    assert lost / events > 1.0


def test_lone_slips_stay_exact_for_ever():
    chain = paper_chain(2, "0")
    simulation, stretch = followed(chain, Cycles("0.01", 5), 30)
    report = simulation.report()
    assert report["exact_in_q_c"]
    assert report["root_evaluations"] == 0
    assert report["bits_lost"] < 16
    excess = simulation.mechanics.field.times_cosine(chain.mu_s - chain.mu_d)
    for x in simulation.mechanics.rest.exact.displacements:  # a whole number of slips of 2D
        a, b = x.rationals()
        assert a == 0
        assert (b / excess.rationals()[1] / 2).denominator == 1
    assert len(event_rows(stretch)) > 100


def test_a_restart_hands_out_no_row_twice():
    chain, drive = paper_chain(6), Cycles("0.003", 1)
    _, expected = followed(chain, drive, 60, record=tuple(LOGS))
    solver = Certified(digits=30, most_digits=2000)
    simulation = CertifiedSimulation(relaxed(chain), tuple(LOGS), solver)
    simulation.mechanics = simulation.kind(relaxed(chain), balls_of(110))
    simulation.tally = simulation.mechanics.tally
    rows, parts, done = [], [], 0
    while done < 2:
        stretch = simulation.follow(drive, done + 1, 2 - done, Limits(5))
        rows += event_rows(stretch)
        parts.append(stretch.recorded)
        done += stretch.completed
    assert simulation.restarts > 0
    assert simulation.tally.events == len(rows)
    assert rows == event_rows(expected)
    for name, values in joined(parts).items():
        for value, truth in zip(values.flat, expected.recorded[name].flat, strict=True):
            one, other = enclosure(value), enclosure(truth)
            assert abs(one.middle - other.middle) <= one.radius + other.radius
    places = simulation.state().displacements.tolist()
    assert all(x.rad() <= 1e-30 * (1 + abs(x)) for x in places)  # as many digits as were asked for


def crossings(chain, state, **options):
    result = rearrange(chain, state, solver="certified", **options)
    return {kind for kind, count in result.report["crossings"].items() if count}, result


def test_a_crossing_is_called_by_the_condition_on_which_it_was_decided():
    steep = captions(2, tan_alpha="1/2")  # slider 1 comes to its threshold
    told, exactly = crossings(steep, State.relaxed(steep), direction=1)
    assert (told, exactly.evidence) == ({"grazing"}, Evidence.PROVED)
    assert exactly.itinerary == lone_slip(2)
    # known only as a ball, it is settled by the rules
    vague = np.array([flint.arb(0, 1e-80)], dtype=object)
    vague = replace(State.relaxed(steep), tensions=vague)
    limits = {"digits": 20, "most_digits": 60}
    told, result = crossings(steep, vague, direction=1, **limits)
    assert (told, result.evidence) == ({"unresolved"}, Evidence.UNDECIDED)
    assert result.itinerary == exactly.itinerary
    assert result.report["ties_assumed"] == result.undecided > 0
    level = captions(4, tan_alpha=0)
    assert crossings(level, State.relaxed(level), direction=1)[0] == {"tie"}


def test_calls_one_after_the_other_lose_digits_until_they_are_undecided_and_a_run_does_not():
    chain, calls = paper_chain(3), []
    state = State.relaxed(chain)
    while not calls or calls[-1].evidence is Evidence.PROVED:
        options = {"solver": "certified", "digits": 20, "most_digits": 40}
        calls.append(rearrange(chain, state, direction=1, **options))
        state = calls[-1].state
    assert len(calls) > 10
    assert calls[-1].report["ties_assumed"] > 0
    left = [call.report["digits_left"] for call in calls]
    assert left[0] >= 20 > left[-2]
    proved = calls[:-1]
    later = Fraction(float(proved[-1].theta)) + Fraction(1, 10**9)
    run = creep(chain, ThetaPath([later]), solver="certified", digits=20)
    assert run.evidence is Evidence.PROVED
    assert run.rearrangements == len(proved)
    assert run.event_count == sum(len(call.events) for call in proved)
    known, claimed = (enclosures(s.displacements) for s in (run.state, proved[-1].state))
    for narrow, wide in zip(known.tolist(), claimed.tolist(), strict=True):
        assert abs(narrow.middle - wide.middle) <= narrow.radius + wide.radius
        assert narrow.radius < 1e-20
    assert max(wide.radius for wide in claimed) > 1e-20


@pytest.mark.parametrize("solver", [Certified, Mpmath])
def test_a_hundred_thousand_digits_may_be_asked_for_and_no_more(solver):
    assert solver(digits=100_000).digits == 100_000
    with pytest.raises(InputError, match=r"digits.*100001"):
        solver(digits=100_001)


def test_nothing_is_left_of_the_precision_outside():
    before = flint.ctx.prec
    chain = paper_chain(4)
    followed(chain, Cycles("0.002", 1), 40)
    rearrange(chain, State.relaxed(chain), direction=1, solver="certified", digits=40)
    assert flint.ctx.prec == before


def test_events_that_nearly_graze_are_left_to_balls_and_no_precision_is_asked_for_ever():
    """Float64 finds their times too vaguely to say how fast they are approached."""
    chain = captions(2, tan_alpha="0.500000000001")
    drive = ThetaPath(["0.0003"])
    run = creep(chain, drive, solver="certified", record=("events",), max_events=200)
    assert run.event_count == 200
    assert run.report["restarts"] < 5
    assert run.evidence is Evidence.PROVED


@pytest.mark.slow
@pytest.mark.parametrize("n", [3, 6, 10, 30])
def test_ten_thousand_consecutive_events_are_certified(n):
    simulation, _ = followed(paper_chain(n), Cycles("0.005", 1000), 30, max_events=10_000)
    assert simulation.tally.events >= 10_000
    assert simulation.evidence is Evidence.PROVED
    # .02 to .12 bits an event; plain balls lose two
    assert simulation.report()["bits_lost_per_event"] < 0.12
