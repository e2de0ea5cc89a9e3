"""What float64 proves of the first event and of nearby states, held against balls of many bits."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import flint
import numpy as np
import pytest
from numpy.typing import NDArray

from exactcreep.motion.arithmetic import Balls, balls_of
from exactcreep.motion.first_event import Search, root_time
from exactcreep.motion.modes import Flow
from exactcreep.motion.set_event import enclosed_event, first_event_of_set
from exactcreep.motion.state_set import Crossing, saltation

FRICTION = 0.5
UNSURE = 1e-14
BALLS, FINE = balls_of(160), balls_of(500)


class Moving(NamedTuple):
    """Numbers of a chain with some sliders in motion."""

    forces: NDArray[np.float64]
    velocities: NDArray[np.float64]
    signs: NDArray[np.int64]
    thresholds: NDArray[np.float64]

    @property
    def springs(self) -> NDArray[np.int64]:
        return np.array([1, *[2] * (len(self.forces) - 2), 1])

    def flow(self, balls: Balls = BALLS) -> Flow:
        friction = balls.vector([FRICTION] * len(self.forces))
        flow = Flow(balls, balls.vector(self.forces.tolist()), friction)
        flow.velocities = balls.vector(self.velocities.tolist())
        flow.signs = self.signs
        flow.touched = set(np.flatnonzero(self.signs).tolist())
        return flow

    def proved(self, unsure: float = UNSURE) -> tuple[int, int, float, float]:
        """Return slider, side, time and radius of the first event; slider -1: not proved."""
        pulls = np.where(self.signs == 0, 0.0, self.forces - FRICTION * self.signs)
        numbers = np.array([self.velocities, pulls, self.forces])
        fresh = self.velocities == 0
        known = self.springs, self.signs, fresh, numbers, self.thresholds, unsure
        return first_event_of_set(*known, len(self.forces))

    def searched(self) -> tuple[tuple[int, int], Any, list[Any]]:
        """Return who acts first, when, and where that finds the runs, by a search in balls."""
        with FINE.active():
            flow = self.flow(FINE)
            runs = flow.runs()
            search = Search(flow, runs, FINE.vector(self.thresholds.tolist()))
            (watch,) = search.first()
            at = root_time(search, watch)
            return (watch.slider, watch.side), at, [run.moved(at) for run in runs]

    def near(self, off: NDArray[np.float64]) -> Moving:
        """Return the state that lies so far off in forces, velocities and thresholds."""
        off[1, self.velocities == 0] = 0.0
        forces, velocities = self.forces + off[0], self.velocities + off[1]
        return Moving(forces, velocities, self.signs, self.thresholds + off[2])

    def arrived(self, event: Any, shift: NDArray[np.float64], unit: float) -> tuple[Any, Flow]:
        """Return when the event comes to the state that lies `shift` off, and the flow there."""
        slider, side, time, radius = event
        flow = self.flow()
        for numbers, off in zip((flow.forces, flow.velocities), shift, strict=True):
            numbers[:] += BALLS.vector(off.tolist()) * BALLS.number(unit)
        runs = flow.runs()
        room = BALLS.number(self.thresholds[slider]) - side * flow.forces[slider]
        at, _ = enclosed_event(runs, (slider, side), room, time, max(radius, 1e-9))
        flow.move(runs, at)
        return at, flow


def in_motion(seed: int, least: int, count: int) -> Iterator[tuple[np.random.Generator, Moving]]:
    random = np.random.default_rng(seed)
    for _ in range(count):
        n = int(random.integers(least, 9))
        signs = random.choice([-1, 0, 1], n, p=[0.2, 0.3, 0.5])
        signs[random.integers(n)] = 1
        velocities = np.where(signs == 0, 0.0, signs * random.uniform(0.02, 0.6, n))
        fresh = (signs != 0) & (random.random(n) < 0.2)
        velocities[fresh] = 0.0
        forces = random.uniform(-0.6, 0.6, n)
        forces[fresh] = signs[fresh] * random.uniform(0.55, 0.7, fresh.sum())
        yield random, Moving(forces, velocities, signs, np.full(n, 0.65))


@pytest.mark.parametrize(("unsure", "least"), [(UNSURE, 90), (1e-7, 40), (1e-4, 40)])
def test_what_float64_proves_to_be_first_a_search_in_balls_finds_in_every_state_so_near(
    unsure: float, least: int
) -> None:
    decided = 0
    with BALLS.active():
        for random, state in in_motion(1, 2, 120):
            slider, side, time, radius = state.proved(unsure)
            if slider < 0:
                continue
            decided += 1
            for corner in random.choice([-unsure, unsure], (2, 3, len(state.forces))):
                acting, at, _ = state.near(corner).searched()
                assert acting == (slider, side)
                assert abs(at - time) <= radius
            _, at, where = state.searched()
            runs = state.flow().runs()
            room = BALLS.number(state.thresholds[slider]) - side * state.flow().forces[slider]
            enclosed = enclosed_event(runs, (slider, side), room, time, radius)
            if enclosed is None and unsure > 1e-5:  # too vague to begin with
                continue
            there, found = enclosed
            for run, (first, *mine), others in zip(runs, found, where, strict=True):
                assert first == run.first
                pairs = zip(
                    [there, *np.concatenate(mine)], [at, *np.concatenate(others)], strict=True
                )
                for ball, truth in pairs:
                    assert ball.contains(truth)
                    assert float(ball.rad()) < 1e-38
    assert decided > least


def crossing_of(state: Moving, event: Any, size: float, late: float) -> tuple[Any, Flow, Crossing]:
    """Return when the event comes, the flow there, and the crossing of states within `size`."""
    slider, side, _, radius = event
    at, middle = state.arrived(event, np.zeros((2, len(state.forces))), 0.0)
    fast, pulls = middle.velocities.astype(float), middle.forces.astype(float)
    pulls = np.where(state.signs == 0, 0.0, pulls - FRICTION * state.signs)
    unsure = UNSURE + size * (3 + float(at))
    haste = max(abs(pulls).max(), 4 * abs(fast).max()) + 5 * (UNSURE + unsure)
    moving = state.springs, state.signs, fast, pulls
    known = unsure, float(at), max(radius, late), haste, slider, side, -1
    return at, middle, Crossing(*moving, *known)


@pytest.mark.parametrize(
    ("unit", "late", "most"), [(2.0**-60, 0.0, 1e-6), (2.0**-16, 2.0**-9, 1e3)]
)
def test_nearby_states_are_where_rows_and_errors_say_and_their_events_when(
    unit: float, late: float, most: float
) -> None:
    done = 0
    with BALLS.active():
        for k, (random, state) in enumerate(in_motion(2, 3, 60)):
            event = state.proved()
            if event[0] < 0:
                continue
            done += 1
            n, moves = len(state.forces), state.velocities != 0
            rows, errors = random.normal(size=(3, n, n + 2)), np.zeros((3, n))
            rows[1, ~moves] = rows[2] = 0.0
            if k % 2:
                errors[:2] = np.array([np.ones(n), moves]) * random.choice([1.0, 1e-9])
            reach = unit * np.linalg.norm(abs(rows[:2]).sum(axis=2) + errors[:2])
            at, middle, crossing = crossing_of(state, event, reach if late else 0.0, late)
            after, widths = rows.copy(), errors.copy()
            spread, last = saltation(crossing, crossing.slope, (*after, widths), unit, True)
            assert last <= crossing.late
            slider, side, *_ = event
            assert not after[0 if side else 1, slider].any()
            for corner in random.choice([-1.0, 1.0], (3, n + 2)):
                shift = rows[:2] @ corner + errors[:2] * random.choice([-1.0, 1.0], (2, n))
                other, flow = state.arrived((*event[:3], crossing.late), shift, unit)
                assert abs(other - at) <= flint.arb(spread) * unit
                for name, row, allowed in zip(
                    ("forces", "velocities", "moved"), after @ corner, widths, strict=True
                ):
                    gaps = (getattr(flow, name) - getattr(middle, name)) / BALLS.number(unit)
                    assert (abs(gaps - BALLS.vector(row)) <= allowed + 1e-9 * (1 + allowed)).all()
            assert spread < 1e4
            if not errors.any():
                assert widths.max() < most * abs(after).max()
    assert done > 40
