"""Finished runs of every solver obey the model, and sabotaged ones do not."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from functools import lru_cache
from typing import Any

import numpy as np
import pytest

from exactcreep.model.chain import Chain
from exactcreep.model.contacts import EventKind
from exactcreep.model.drive import Cycles, Drive, GaussianSteps
from exactcreep.model.enclosure import Enclosure, enclosure
from exactcreep.model.state import State
from exactcreep.quasistatic.creep import creep
from exactcreep.solvers.rearrangement import Rearrangement
from exactcreep.solvers.registry import rearrange
from tests.oracle.obeys import judge
from tests.paper import captions, paper_chain

SEED = 5
OWN = replace(State.relaxed(captions(3)), coefficients=np.array([0.8, 0.7, 0.9]))
UNSTABLE = State.prepared(captions(4), ["0.9", "-0.8", "0.3"])
LEVEL = captions(6, tan_alpha=0)
SYMMETRIC = State.prepared(LEVEL, ["0.3", "-0.2", "0.4", "-0.2", "0.3"])
SHORT = Cycles("0.002", 2)
STEPPED = {"solver": "verlet", "dt": "0.001", "locate": True}


@lru_cache
def avalanche(solver: str = "exact", **options: Any) -> Rearrangement:
    """A rearrangement of six sliders with at least ten events."""
    chain = paper_chain(6)
    state = creep(chain, Cycles("0.01", 2), seed=SEED, record=()).state
    while True:
        found = rearrange(chain, state, direction=1, seed=SEED)
        if len(found.events) >= 10:
            return rearrange(chain, state, direction=1, seed=SEED, solver=solver, **options)
        state = found.state


def with_event(i: int, *, of: Rearrangement | None = None, **changed: Any) -> Rearrangement:
    result = of or avalanche()
    events = list(result.events)
    events[i] = replace(events[i], **changed)
    return replace(result, events=tuple(events))


# --- honest logs -----------------------------------------------------------------------------


TIED = {"start": SYMMETRIC}
"""Of a chain on the level that starts symmetric: events come in pairs, some at threshold."""


@pytest.mark.parametrize(
    ("chain", "drive", "settings", "least", "accuracy"),
    [
        (paper_chain(6), Cycles("0.002", 1), {"seed": SEED}, 50, None),
        (paper_chain(3), SHORT, {"seed": 2, **STEPPED}, 10, 1e-4),
        (paper_chain(3), SHORT, {"seed": 2, "solver": "verlet", "dt": "0.01"}, 10, 0.01),
        (paper_chain(3), SHORT, {"seed": 2, "solver": "mpmath", "digits": 30}, 10, None),
        (paper_chain(3), GaussianSteps("0.002", 6), {"seed": 2}, 10, None),
        (LEVEL, SHORT, TIED, 20, None),
        (LEVEL, SHORT, {**TIED, "solver": "certified", "max_events": 40}, 5, None),
        (LEVEL, SHORT, {**TIED, "solver": "reference"}, 20, None),
        (LEVEL, SHORT, {**TIED, **STEPPED}, 20, 1e-4),
        (captions(4), SHORT, {"start": UNSTABLE}, 10, None),
        (captions(3), SHORT, {"start": OWN, "solver": "certified"}, 20, None),
        (captions(2, tan_alpha="0.55"), SHORT, {}, 0, None),
    ],
    ids=["disorder", "disorder, verlet", "large steps", "disorder, mpmath", "random steps",
         "ties", "ties, certified", "ties, reference", "ties, verlet", "an unstable start",
         "own coefficients", "a runaway"],
)  # fmt: skip
def test_a_run_obeys_the_model(
    chain: Chain, drive: Drive, settings: dict[str, Any], least: int, accuracy: float | None
) -> None:
    result = creep(chain, drive, record=("x_G", "x", "tension", "events"), **settings)
    judged = judge(result, accuracy=accuracy)
    assert judged.fault is None
    assert result.slip_count >= least
    assert judged.events == result.event_count


# --- sabotaged logs --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "times", "most"),
    [
        ({}, 10, 1e-11),
        ({}, -10, 1e-11),
        ({"solver": "certified", "digits": 50}, 10, 1e-65),
    ],
    ids=["late", "early", "certified"],
)
def test_an_event_moved_by_ten_times_its_radius_is_caught(
    options: Any, times: int, most: float
) -> None:
    result = avalanche(**options)
    radii = np.array(judge(result).radii)
    later = np.flatnonzero(np.isfinite(radii))
    assert later.size > 5
    assert radii[later].max() < most
    for i in later:
        known = enclosure(result.events[i].time)
        moved = known.middle + times * Fraction(float(radii[i]))
        time = Enclosure(moved, known.radius) if options else float(moved)
        assert judge(with_event(i, of=result, time=time)).fault, i


def test_a_dropped_event_or_slip_is_caught() -> None:
    events = avalanche().events
    start = next(i for i, e in enumerate(events) if i and e.kind is EventKind.START)
    own = [i for i, e in enumerate(events) if i >= start and e.sliders == events[start].sliders]
    for dropped in [{*own[:2]}, *({i} for i in range(len(events)))]:
        kept = tuple(event for i, event in enumerate(events) if i not in dropped)
        assert judge(replace(avalanche(), events=kept)).fault, dropped


@pytest.mark.parametrize("options", [{}, STEPPED], ids=["exact", "verlet"])
def test_a_flipped_contact_is_caught(options: dict[str, Any]) -> None:
    other = {EventKind.START: EventKind.STOP, EventKind.STOP: EventKind.START}
    result, accuracy = avalanche(**options), 1e-4 if options else None
    for i, event in enumerate(result.events):
        for changed in (
            {"signs": tuple(-sign for sign in event.signs)},
            {"sliders": tuple(n % 6 + 1 for n in event.sliders)},
            {"kind": other[event.kind]},
        ):
            judged = judge(with_event(i, of=result, **changed), accuracy=accuracy)
            assert judged.fault.check in ("contact", "motion"), (i, changed)


def test_a_log_that_contradicts_itself_is_caught() -> None:
    events, state = avalanche().events, avalanche().state
    assert judge(with_event(4, time=events[2].time)).fault.check == "order"
    further = replace(state, displacements=state.displacements + np.eye(6)[2] * 1e-9)
    assert judge(replace(avalanche(), state=further)).fault.check == "state"
    assert judge(avalanche(), seed=SEED + 1).fault.check == "contact"
