"""What every solver refuses, how it is advanced, and why it stops, whatever its algorithm."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from exactcreep.limits import NO_LIMITS, Limits, Stop
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles
from exactcreep.model.numbers import InputError
from exactcreep.model.state import State
from exactcreep.solvers.field.reference import Reference
from exactcreep.solvers.registry import SOLVERS, solver_named
from exactcreep.solvers.solver import Simulation, Stretch, advance
from tests.paper import paper_chain

EVENTS_HAPPEN = sorted(set(SOLVERS) - {"sliding"})


@pytest.mark.parametrize("name", [*EVENTS_HAPPEN, "sliding"])
def test_a_quantity_that_nobody_records_is_refused_by_name(name: str) -> None:
    chain = paper_chain(3)
    with pytest.raises(InputError, match="must be one of x_G") as caught:
        solver_named(name, {}).simulation(chain, State.relaxed(chain), 0, ("x_G", "velocity"))
    assert (caught.value.field, caught.value.value) == ("record", "velocity")


@pytest.mark.parametrize("name", EVENTS_HAPPEN)
def test_a_chain_without_slips_is_sent_to_the_sliding_limit(name: str) -> None:
    chain = Chain(3, 1000, "0.5", "0.5", tan_alpha="0.25")
    state = State.relaxed(chain)
    solver = solver_named(name, {})
    for call in (
        lambda: solver.simulation(chain, state, 0, ("x_G",)),
        lambda: solver.rearrange(chain, state, 1, 0),
        lambda: next(solver.iterate(chain, state, 1, 0)),
    ):
        with pytest.raises(InputError, match="sliding") as caught:
            call()
        assert caught.value.field == "mu_s"


# One loop for every solver: it stops for a reason, and loses nothing

DRIVE = Cycles("0.002", 2)
SLIPPING = ("exact", "reference", "certified", "verlet")
OFTEN = Limits(bytes=10**9)  # what may be full at any time is looked at often


def started(name: str, chain: Chain | None = None) -> Simulation:
    chain = chain or Chain(3, 1000, "0.5", "0.6", "0.01", tan_alpha="0.25")
    record = ("x_G", "x", "tension", "slips", "events")
    options = {"dt": 0.05} if name == "verlet" else {}
    algorithm = solver_named(name, options)
    return algorithm.simulation(chain, State.relaxed(chain, 2), 2, record)


def shown(parts: list[Mapping[str, NDArray[Any]]]) -> dict[str, str]:
    """Return all that was recorded, every bit of it."""
    names = parts[0].keys() | parts[-1].keys()
    rows = {name: [row for part in parts for row in part.get(name, [])] for name in names}
    return {name: str([np.asarray(row).tolist() for row in rows[name]]) for name in sorted(names)}


@functools.cache
def in_one_go(name: str) -> dict[str, str]:
    whole = advance(started(name), DRIVE, 4)
    assert (whole.completed, whole.stop, whole.reason) == (4, Stop.DONE, "")
    assert len(whole.recorded["x"]) == 4
    return shown([whole.recorded])


def pressed() -> bool:
    return True


@pytest.mark.parametrize("name", SLIPPING)
@pytest.mark.parametrize(
    ("limits", "stop", "reason"),
    [
        (Limits(events=9), Stop.BUDGET, "max_events = 9 was reached"),
        (Limits(events=0), Stop.BUDGET, "max_events = 0 was reached"),
        (Limits(events=20, used=11), Stop.BUDGET, "max_events = 20 was reached"),
        (Limits(bytes=0), Stop.BUDGET, "max_bytes = 0 was reached by what is recorded"),
        (Limits(at=0.0, seconds=2.0), Stop.DEADLINE, "max_seconds = 2 was reached"),
        (Limits(interrupted=pressed), Stop.DEADLINE, "interrupted"),
        (NO_LIMITS, Stop.DONE, ""),
    ],
    ids=["events", "none", "used", "bytes", "late", "pressed", "done"],
)
def test_an_advance_says_why_it_stopped_and_goes_on_without_loss(
    name: str, limits: Limits, stop: Stop, reason: str
) -> None:
    simulation = started(name)
    part = advance(simulation, DRIVE, 4, limits)
    assert (part.stop, part.reason) == (stop, reason)
    assert len(part.recorded["x_G"]) == part.completed
    assert (part.completed == 4) == (stop is Stop.DONE)
    if limits.events:
        assert 9 <= simulation.tally.events <= 12
    rest = advance(simulation, DRIVE, 4, done=part.completed)
    assert (rest.completed, rest.stop) == (4 - part.completed, Stop.DONE)
    assert shown([part.recorded, rest.recorded]) == in_one_go(name)


@pytest.mark.parametrize("name", SLIPPING)
def test_who_takes_the_stretches_gets_all_of_them_and_may_end_the_advance(name: str) -> None:
    simulation = started(name)
    taken: list[Stretch] = []

    def enough(stretch: Stretch) -> str:
        taken.append(stretch)
        return "enough" if sum(one.completed for one in taken) >= 1 else ""

    part = advance(simulation, DRIVE, 4, OFTEN, take=enough)
    assert (part.stop, part.reason) == (Stop.LIMIT, "enough")
    assert 1 <= part.completed == sum(one.completed for one in taken) < 4
    assert len(part.recorded["x_G"]) == 0
    last = advance(simulation, DRIVE, 4, done=part.completed, take=taken.append)
    assert (last.stop, part.completed + last.completed) == (Stop.DONE, 4)
    assert shown([one.recorded for one in taken]) == in_one_go(name)


def test_a_word_against_the_last_target_comes_too_late() -> None:
    calm = Cycles("1e-6", 3)
    ended = advance(started("exact"), calm, 6, OFTEN, take=lambda stretch: "enough")
    assert (ended.stop, ended.reason) == (Stop.LIMIT, "enough")
    first = ended.completed
    assert 0 < first < 6
    done = advance(started("exact"), calm, first, take=lambda stretch: "enough")
    assert (done.stop, done.reason, done.completed) == (Stop.DONE, "", first)


@pytest.mark.parametrize("name", SLIPPING)
@pytest.mark.parametrize("budget", [1, 3, 40])
def test_what_one_call_may_use_changes_no_bit(name: str, budget: int) -> None:
    simulation = started(name)
    parts: list[Mapping[str, NDArray[Any]]] = []
    done = calls = 0
    while done < 4:
        stretch = simulation.follow(DRIVE, done + 1, 4 - done, Limits(events=budget))
        assert stretch.stop is (Stop.DONE if done + stretch.completed == 4 else Stop.BUDGET)
        done += stretch.completed
        parts.append(stretch.recorded)
        calls += 1
    assert calls > simulation.tally.events // (budget + 4)
    assert shown(parts) == in_one_go(name)


@pytest.mark.parametrize("name", SLIPPING)
def test_a_pause_waits_for_something_to_hand_over_and_changes_no_bit(name: str) -> None:
    simulation = started(name)
    parts: list[Mapping[str, NDArray[Any]]] = []
    done = 0
    while done < 4:
        before = simulation.tally.events
        stretch = simulation.follow(DRIVE, done + 1, 4 - done, Limits(pause=0.0))
        assert stretch.completed > 0 or simulation.tally.events > before
        done += stretch.completed
        assert stretch.stop is (Stop.DONE if done == 4 else Stop.BUDGET)
        parts.append(stretch.recorded)
    assert len(parts) > 1 or name in ("exact", "verlet")  # which need no second look at the clock
    assert shown(parts) == in_one_go(name)


@pytest.mark.parametrize("name", SLIPPING)
def test_an_advance_ends_where_the_chain_runs_away(name: str) -> None:
    simulation = started(name, Chain(4, 1000, "0.5", "0.6", "0.01", tan_alpha="0.55"))
    away = advance(simulation, DRIVE, 4)
    assert (away.stop, away.completed) == (Stop.RUNAWAY, 0)
    assert "ever" in away.reason
    assert len(away.whole["event_time"]) >= simulation.tally.events > 0


def test_an_advance_ends_where_a_solver_gives_up() -> None:
    chain = Chain(4, 1000, "0.5", "0.6", "0.01", tan_alpha="0.25")
    simulation = solver_named("verlet", {"dt": 1e5}).simulation(
        chain, State.relaxed(chain, 2), 2, ("x_G",)
    )
    given_up = advance(simulation, DRIVE, 4)
    assert given_up.stop is Stop.LIMIT
    assert "dt is too large" in given_up.reason
    assert given_up.completed < 4


@pytest.mark.parametrize("n", [2, 3])
@pytest.mark.parametrize("name", EVENTS_HAPPEN)
def test_a_coefficient_brought_by_the_start_ends_with_the_slider_s_first_stop(
    name: str, n: int
) -> None:
    chain = Chain(n, 1000, "1/2", "3/5", tan_alpha="1/4")
    relaxed = State.relaxed(chain)
    start = replace(relaxed, coefficients=np.array([0.8, 0.7, 0.9])[:n])
    drive = Cycles("0.002", 2)
    simulation = solver_named(name, {}).simulation(chain, start, 0, ("x_G",))
    begin = solver_named(name, {}).rearrange(chain, start, 1, 0)
    assert float(begin.theta) > float(Reference().rearrange(chain, relaxed, 1, 0).theta)
    simulation.follow(drive, 1, 4)
    state = simulation.state()
    assert (state.draws > 1).all()
    assert state.coefficients.astype(float).tolist() == [0.6] * n
    assert (abs(state.forces(chain)) <= chain.friction + chain.excess + 1e-12).all()
    assert begin.state.coefficients.astype(float).tolist() == [
        0.6 if draws > 1 else mine
        for draws, mine in zip(begin.state.draws.tolist(), [0.8, 0.7, 0.9], strict=False)
    ]
