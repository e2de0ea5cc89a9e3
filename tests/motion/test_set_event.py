"""What float64 proves of the first event and of nearby states, held against balls of many bits."""

from __future__ import annotations

import flint
import numpy as np
import pytest

from exactcreep.motion.arithmetic import balls_of
from exactcreep.motion.first_event import Search, root_time
from exactcreep.motion.modes import Flow
from exactcreep.motion.set_event import enclosed_event, first_event_of_set
from exactcreep.motion.state_set import Crossing, saltation

FRICTION = 0.5
UNSURE = 1e-14
BALLS, UNIT = balls_of(300), 2.0**-60


def springs_of(n):
    return np.array([1, *[2] * (n - 2), 1])


def in_motion(random, n):
    """Return forces, velocities, signs and thresholds of a chain with some sliders in motion."""
    shares = [0.2, 0.3, 0.5]
    signs = random.choice([-1, 0, 1], n, p=shares)
    signs[random.integers(n)] = 1
    velocities = np.where(signs == 0, 0.0, signs * random.uniform(0.02, 0.6, n))
    fresh = (signs != 0) & (random.random(n) < 0.2)
    velocities[fresh] = 0.0
    forces = random.uniform(-0.6, 0.6, n)
    forces[fresh] = signs[fresh] * random.uniform(0.55, 0.7, fresh.sum())
    return forces, velocities, signs, np.full(n, 0.65)


def flow_of(balls, forces, velocities, signs):
    flow = Flow(balls, balls.vector(forces.tolist()), balls.number(FRICTION))
    flow.velocities = balls.vector(velocities.tolist())
    flow.signs = signs
    flow.touched = set(np.flatnonzero(signs).tolist())
    return flow


def proved(forces, velocities, signs, thresholds, unsure=UNSURE):
    n = len(forces)
    accelerations = np.where(signs == 0, 0.0, forces - FRICTION * signs)
    fresh = velocities == 0
    numbers = np.array([velocities, accelerations, forces])
    return first_event_of_set(springs_of(n), signs, fresh, numbers, thresholds, unsure, n)


def searched(forces, velocities, signs, thresholds):
    """Return who acts first, when, and where that finds the runs, by a search in balls."""
    balls = balls_of(400)
    with balls.active():
        flow = flow_of(balls, forces, velocities, signs)
        runs = flow.runs()
        search = Search(flow, runs, balls.vector(thresholds.tolist()), {})
        (watch,) = search.first()
        at = root_time(search, watch)
        return (watch.slider, watch.side), at, [run.moved(at) for run in runs]


def test_what_float64_proves_to_be_first_is_what_a_search_in_balls_finds():
    random, balls = np.random.default_rng(1), balls_of(160)
    decided = 0
    for _ in range(120):
        state = in_motion(random, int(random.integers(2, 9)))
        forces, velocities, signs, thresholds = state
        slider, side, time, radius = proved(*state)
        if slider < 0:
            continue
        decided += 1
        acting, at, where = searched(*state)
        assert acting == (slider, side)
        with balls.active():
            assert abs(at - time) <= radius
            flow = flow_of(balls, forces, velocities, signs)
            runs = flow.runs()
            room = balls.number(thresholds[slider]) - side * flow.forces[slider]
            there, found = enclosed_event(runs, acting, room, time, radius)
            assert there.contains(at)
            assert float(there.rad()) < 1e-40
            for run, (first, *mine), others in zip(runs, found, where, strict=True):
                assert first == run.first
                for numbers, truth in zip(mine, others, strict=True):
                    for x, y in zip(numbers, truth.tolist(), strict=True):
                        assert x.contains(y)
                        assert float(x.rad()) < 1e-38
    assert decided > 90


@pytest.mark.parametrize("unsure", [1e-7, 1e-4])
def test_what_is_first_is_so_in_every_state_as_near_as_was_said(unsure):
    random, decided = np.random.default_rng(4), 0
    for _ in range(60):
        state = in_motion(random, int(random.integers(2, 7)))
        forces, velocities, signs, thresholds = state
        slider, side, time, radius = proved(*state, unsure)
        if slider < 0:
            continue
        decided += 1
        for _ in range(3):
            off = random.choice([-unsure, unsure], (3, len(forces)))
            off[1, velocities == 0] = 0.0
            near = forces + off[0], velocities + off[1], signs, thresholds + off[2]
            acting, at, _ = searched(*near)
            assert acting == (slider, side)
            assert abs(float(at) - time) <= radius
    assert decided > 20


def arrived(state, event, shift, unit=UNIT):
    """Return when an event comes to the state that lies `shift` (forces, velocities) off, and the
    flow there."""
    forces, velocities, signs, thresholds = state
    slider, side, time, radius = event
    flow = flow_of(BALLS, forces, velocities, signs)
    for numbers, off in zip((flow.forces, flow.velocities), shift, strict=True):
        numbers[:] += BALLS.vector(off.tolist()) * BALLS.number(unit)
    runs = flow.runs()
    room = BALLS.number(thresholds[slider]) - side * flow.forces[slider]
    at, _ = enclosed_event(runs, (slider, side), room, time, max(radius, 1e-9))
    flow.advance(runs, at)
    return at, flow


def passing(state, event):
    """Return when the event comes, the flow there, and the crossing of this state alone."""
    (forces, *_, signs, _), (slider, side, _, radius) = state, event
    n = len(forces)
    at, middle = arrived(state, event, np.zeros((2, n)))
    fast = middle.velocities.astype(float)
    pulls = middle.forces.astype(float)
    pulls = np.where(signs == 0, 0.0, pulls - FRICTION * signs)
    haste = max(abs(pulls).max(), 4 * abs(fast).max()) + 5 * UNSURE
    when = float(at), radius, haste
    moving = springs_of(n), signs, fast, pulls
    crossing = Crossing(*moving, UNSURE, *when, slider, side, -1)
    return at, middle, crossing


def widened(crossing, rows, unit, late):
    """Return the crossing of the set of these rows, whose states are `late` at most."""
    reach = np.linalg.norm(abs(rows[:2]).sum(axis=2))
    wide = unit * reach * (3 + crossing.time)
    haste = crossing.haste + 5 * wide
    return crossing._replace(unsure=UNSURE + wide, late=late, haste=haste)


def crossings(seed, least):
    """Yield random states in motion, their first event, the middle's flow there, the crossing."""
    random = np.random.default_rng(seed)
    for _ in range(60):
        state = in_motion(random, int(random.integers(least, 8)))
        event = proved(*state)
        if event[0] >= 0:
            yield random, state, event, *passing(state, event)


NUMBERS = ("forces", "velocities", "moved")


def assert_lies(flow, middle, unit, rows, errors):
    """Hold how far a state lies from the middle, in units, against numbers and their errors."""
    for name, row, most in zip(NUMBERS, rows, errors, strict=True):
        gaps = (getattr(flow, name) - getattr(middle, name)) / BALLS.number(unit)
        for n, gap in enumerate(gaps):
            assert abs(gap - float(row[n])) <= float(most[n]) + 1e-13


@pytest.mark.parametrize("unit", [UNIT, 2.0**-16])
def test_nearby_states_are_where_the_rows_say_and_their_events_when(unit):
    done = 0
    with BALLS.active():
        for random, state, event, at, middle, crossing in crossings(2, 2):
            done += 1
            n, velocities = len(state[0]), state[1]
            rows = random.normal(size=(3, n, n + 2))
            rows[1, velocities == 0] = rows[2] = 0.0
            if unit > UNIT:
                event = (*event[:3], 2.0**-9)
                crossing = widened(crossing, rows, unit, 2.0**-9)
            after, errors = rows.copy(), np.zeros((3, n))
            shown = (*after, errors)
            spread, late = saltation(crossing, crossing.slope, shown, unit, True)
            assert late <= event[3]
            slider, side, *_ = event
            ended = after[1] if side == 0 else after[0]
            assert not ended[slider].any()
            for corner in random.choice([-1.0, 1.0], (3, n + 2)):
                other, flow = arrived(state, event, rows[:2] @ corner, unit)
                assert abs(other - at) <= flint.arb(spread) * unit
                assert_lies(flow, middle, unit, after @ corner, errors)
            assert spread < 1e4
            allowed = 1e-6 if unit == UNIT else 1e3
            assert errors.max() < allowed * abs(after).max()
    assert done > 40


def test_states_as_far_from_the_rows_as_their_errors_are_so_after_the_event():
    done = 0
    with BALLS.active():
        for random, state, event, _, middle, crossing in crossings(6, 3):
            done += 1
            n = len(state[0])
            errors = np.zeros((3, n))
            errors[0] = 1.0
            errors[1] = state[1] != 0
            before, none = errors.copy(), np.zeros((3, n, 1))
            saltation(crossing, crossing.slope, (*none, errors), UNIT, True)
            for _ in range(4):
                corner = random.choice([-1.0, 1.0], (2, n))
                _, flow = arrived(state, event, before[:2] * corner)
                for name, most in zip(NUMBERS, errors, strict=True):
                    gaps = (getattr(flow, name) - getattr(middle, name)) / UNIT
                    for gap, allowed in zip(gaps.tolist(), most.tolist(), strict=True):
                        assert abs(gap) <= allowed + 1e-9
    assert done > 40
