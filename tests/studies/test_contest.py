"""The core of every contest: what is not the same is found, and what was not reached is not."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np
import pytest

from exactcreep import Chain, Cycles, Evidence, Outcome, Path, State, creep, rearrange
from exactcreep.limits import Limits
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.solvers.solver import Rearrangement
from exactcreep.studies.contest import (
    Contestant,
    Walk,
    agree,
    apart,
    rests_along,
    rests_between,
    settled,
    walk,
)
from exactcreep.studies.eventlog import LoggedRearrangement

CHAIN = Chain(3, 1000, "0.5", "0.6", "0.01", tan_alpha="0.25")
DRIVE = Path(["0.001", "-0.001", "0.001"])
EXPERIMENT = Experiment.of(CHAIN, DRIVE, seed=5)


@cache
def own() -> Walk:
    """Return the whole walk of `exact`."""
    return walk(Contestant("exact"), EXPERIMENT, 3)


@cache
def known() -> Walk:
    """Return the whole walk of `certified`."""
    return walk(Contestant("certified"), EXPERIMENT, 3)


def middle() -> int:
    """Return the first rearrangement on the way to the second target."""
    return next(r for r, one in enumerate(own().log) if one.half_cycle == 2)


def with_events(changed: Any, place: int) -> Walk:
    """Return the walk of `exact` with the events of one rearrangement changed."""
    log = list(own().log)
    log[place] = log[place]._replace(events=tuple(changed(list(log[place].events))))
    return replace(own(), log=log)


def before(place: int) -> int:
    """Return the number of events before a rearrangement."""
    return sum(len(one.events) for one in own().log[:place])


def cut(whole: Walk, targets: int, events: int, *, ended: bool = False) -> Walk:
    """Return a walk that has so many targets and events and no more."""
    log: list[LoggedRearrangement] = []
    for one in whole.log:
        kept = one.events[: max(events, 0)]
        events -= len(one.events)
        if kept:
            log.append(one._replace(events=kept))
    return replace(whole, log=log, x=whole.x[:targets], ended=ended)


def test_two_good_walks_agree_in_all_events_and_to_rounding_at_every_rest() -> None:
    found = agree(own(), known())
    assert not found.differs
    assert found.agreed == len(known().events) == before(len(own().log)) > 50
    assert found.compared == found.errors.size == known().reached == 3
    assert 0 < found.error_before == found.error_after < 1e-13
    assert (known().evidence, own().evidence) == (Evidence.PROVED, Evidence.COMPUTED)


@pytest.mark.parametrize("rest", [0, 1, 2])
@pytest.mark.parametrize("slider", [0, 1, 2])
def test_a_wrong_position_is_found_at_its_rest(rest: int, slider: int) -> None:
    x = own().x.copy()
    x[rest, slider] += 1e-9
    errors = agree(replace(own(), x=x), known()).errors
    assert errors[rest] == pytest.approx(1e-9, rel=1e-4, abs=0)
    assert np.delete(errors, rest).max() < 1e-13


def swapped(events: list[Any]) -> list[Any]:
    first, *others = events
    (slider,) = first.sliders
    return [replace(first, sliders=(4 - slider,)), *others]


def turned(events: list[Any]) -> list[Any]:
    first, *others = events
    return [replace(first, signs=tuple(-sign for sign in first.signs)), *others]


def late(events: list[Any]) -> list[Any]:
    return [replace(event, time=event.time * 1.5 + 1) for event in events]


@pytest.mark.parametrize(
    ("sabotage", "agreed"),
    [
        (lambda events: events[1:], 0),
        (lambda events: [events[0], *events[2:]], 1),
        (lambda events: events[::-1], 0),
        (lambda events: [*events, events[0]], None),
        (swapped, 0),
        (turned, 0),
    ],
    ids=["first missing", "second missing", "reversed", "one too many", "swapped", "turned"],
)
def test_an_event_that_is_not_the_same_is_found_where_it_is(
    sabotage: Any, agreed: int | None
) -> None:
    found = agree(with_events(sabotage, middle()), known())
    shared = len(own().log[middle()].events) if agreed is None else agreed
    assert found.differs
    assert found.agreed == before(middle()) + shared
    assert found.known == known().events[found.agreed]
    assert found.own is not None
    assert found.own.signature != found.known.signature
    assert found.compared == 1
    assert found.errors.size == 3


def test_the_time_of_an_event_is_no_difference() -> None:
    assert not agree(with_events(late, middle()), known()).differs


def test_a_rearrangement_on_the_way_to_another_target_is_found() -> None:
    log = list(own().log)
    log[middle()] = log[middle()]._replace(half_cycle=1)
    found = agree(replace(own(), log=log), known())
    assert found.agreed == before(middle())
    assert found.compared == 0


@pytest.mark.parametrize("turn", [False, True], ids=["own", "known"])
def test_the_last_event_missing_is_found(turn: bool) -> None:
    last = len(own().log) - 1
    short, whole = with_events(lambda events: events[:-1], last), known()
    found = agree(whole, short) if turn else agree(short, whole)
    assert found.agreed == len(known().events) - 1
    silent, telling = (found.known, found.own) if turn else (found.own, found.known)
    assert silent is None
    assert telling == known().events[-1]


@pytest.mark.parametrize("turn", [False, True], ids=["own", "known"])
def test_what_a_walk_that_was_cut_short_has_not_come_to_is_no_difference(turn: bool) -> None:
    events = before(middle()) + 1
    short = cut(own(), 1, events)
    found = agree(known(), short) if turn else agree(short, known())
    assert not found.differs
    assert (found.agreed, found.compared, found.errors.size) == (events, 1, 1)


def test_a_walk_that_ended_by_itself_misses_the_events_of_the_target_that_the_other_reached() -> (
    None
):
    events = before(middle()) + 1
    gave_up = cut(own(), 1, events, ended=True)
    found = agree(gave_up, known())
    assert (found.agreed, found.own, found.known) == (events, None, known().events[events])
    # the other one does not reach it, either: a runaway of which each has seen enough
    assert not agree(gave_up, cut(known(), 1, events + 1, ended=True)).differs
    assert not agree(gave_up, cut(known(), 1, events + 1)).differs


def test_limits_cut_a_walk_short_and_change_nothing_before() -> None:
    for most in (1, 10, 33):
        short = walk(Contestant("exact"), EXPERIMENT, 3, limits=Limits(most))
        assert most <= len(short.events) < most + 3
        assert short.events == own().events[: len(short.events)]
        assert np.array_equal(short.x, own().x[: short.reached])
        assert not agree(short, known()).differs
    enough = walk(Contestant("exact"), EXPERIMENT, 3, enough=1)
    assert enough.reached == 1
    assert enough.events == [event for event in own().events if event.half_cycle == 1]


def test_a_walk_into_a_runaway_ends_at_the_last_target_before_it() -> None:
    steep = Chain(3, 1000, "0.5", "0.6", "0.05", tan_alpha="0.53")
    drive = Path(Fraction(k, 10**5) for k in range(1, 31))
    experiment = Experiment.of(steep, drive, seed=3)
    exact, certified = (
        walk(Contestant(solver), experiment, 30) for solver in ("exact", "certified")
    )
    assert 0 < exact.reached == certified.reached < 30
    for one in (exact, certified):
        assert one.ended
        assert one.events[0].half_cycle <= one.reached == one.events[-1].half_cycle - 1
    assert not agree(exact, certified).differs
    assert not agree(exact, replace(certified, ended=False)).differs


def test_single_rearrangements_are_walks_to_one_rest() -> None:
    state = State.relaxed(CHAIN, 1)
    exact, certified, verlet = (
        rearrange(CHAIN, state, direction=1, seed=1, solver=solver)
        for solver in ("exact", "certified", "verlet")
    )
    proved = Walk.of(certified)
    assert agree(Walk.of(exact), proved).error_before < 1e-15
    assert agree(Walk.of(verlet), proved).error_before == apart(
        verlet.state.displacements, certified.state.displacements
    )
    tensions = verlet.state.tensions + 0.125
    off = replace(verlet, state=replace(verlet.state, tensions=tensions))
    assert agree(Walk.of(off), proved).error_before < 0.01
    found = agree(Walk.of(off, tensions=True), Walk.of(certified, tensions=True))
    assert found.error_before == pytest.approx(0.125, rel=0.01, abs=0)
    given_up = replace(exact, outcome=Outcome.LIMIT)
    assert agree(Walk.of(given_up), proved).compared == 0
    short = replace(given_up, events=exact.events[:-1])
    found = agree(Walk.of(short), proved)
    assert (found.agreed, found.compared) == (len(exact.events) - 1, 0)


def test_distances_are_exact_and_rounded_once() -> None:
    third = Fraction(1, 3)
    assert apart([third, 1.0], [third + Fraction(1, 10**40), 1]) == 1e-40
    assert apart([1.0, -2.0], [1.0, 2.0]) == 4.0
    with pytest.raises(ValueError, match="zip"):
        apart([1.0], [1.0, 2.0])


def test_only_a_rearrangement_that_is_decided_and_over_is_the_truth() -> None:
    found: Rearrangement = rearrange(
        CHAIN, State.relaxed(CHAIN), direction=1, solver="certified", digits=20
    )
    assert settled(found)
    assert not settled(replace(found, undecided=1))
    assert not settled(replace(found, outcome=Outcome.LIMIT))
    assert not settled(replace(found, outcome=Outcome.RUNAWAY))


@pytest.mark.parametrize("tension", [0, Fraction(2)], ids=["relaxed", "unstable"])
def test_the_rests_along_a_drive_are_those_of_every_rearrangement(tension: int | Fraction) -> None:
    start = State.prepared(CHAIN, [tension, 0], seed=5)
    experiment = Experiment.of(CHAIN, DRIVE, seed=5, start=start)
    rests = list(rests_along(experiment, 100))
    whole = creep(CHAIN, DRIVE, seed=5, start=start, record=("events",))
    theta = whole.recorded["event_theta"]
    first = np.unique(whole.recorded["event_rearrangement"], return_index=True)[1]
    assert len(rests) == whole.rearrangements == first.size > 15
    assert rests[0].state is start
    assert (rests[0].way == 0) is bool(tension)
    for (_, way), rest, there in zip(rests[1:], rests[1:], theta[first][1:], strict=True):
        found = rearrange(CHAIN, rest.state, direction=way, seed=5)
        assert found.theta == pytest.approx(there, rel=1e-12, abs=1e-18)


def test_the_rests_along_a_drive_end_before_an_avalanche_that_is_too_long() -> None:
    lengths = [len(one.events) for one in own().log]
    longest = max(lengths)
    assert len(list(rests_along(EXPERIMENT, longest))) == len(lengths)
    assert len(list(rests_along(EXPERIMENT, longest - 1))) == lengths.index(longest)


def test_rests_between_targets_lie_on_the_way_to_the_next() -> None:
    drive = Cycles("0.002", 3)
    experiment = Experiment.of(CHAIN, drive, seed=2)
    rests = list(rests_between(experiment))
    assert len(rests) == 4 * (6 - 2)
    for number, (state, way) in enumerate(rests):
        assert way == (1 if (number // 4) % 2 == 0 else -1)
        assert abs(Fraction(state.theta)) < drive.amplitude
    again = rests_between(experiment)
    assert [state.theta for state, _ in again] == [state.theta for state, _ in rests]
