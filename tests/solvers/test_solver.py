"""What every solver refuses, and how it is followed, interrupted, and taken up again."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from exactcreep import rearrange
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles
from exactcreep.model.numbers import InputError
from exactcreep.model.state import State
from exactcreep.solvers.interface import Simulation, simulate
from exactcreep.solvers.registry import SOLVERS, solver_named
from exactcreep.solvers.tables import RECORDS
from exactcreep.watch.limits import NO_LIMITS, Limits, Stop
from tests.paper import paper_chain

EVENTS_HAPPEN = sorted(set(SOLVERS) - {"sliding"})
THREE = paper_chain(3)
RELAXED = State.relaxed(THREE, 2)
NO_SLIPS = replace(THREE, mu_s="0.5", sigma_mu=0)


# What is refused, by the name of the field


def recording(solver: str, *record: str, chain: Chain = THREE) -> Callable[[], Any]:
    return lambda: solver_named(solver, {}).simulation(chain, State.relaxed(chain), 0, record)


def moving(**changes: Any) -> Callable[[], Any]:
    known = {"chain": THREE, "state": RELAXED, "direction": 1} | changes
    return lambda: rearrange(known.pop("chain"), known.pop("state"), **known)


REFUSED: list[tuple[str, str, Callable[[], Any]]] = [
    *(("record", "must be one of x_G", recording(name, "x_G", "speed")) for name in SOLVERS),
    *(("record", "no events", recording("sliding", name)) for name in RECORDS[4:]),
    *(("mu_s", "sliding", recording(name, chain=NO_SLIPS)) for name in EVENTS_HAPPEN),
    *(("mu_s", "sliding", moving(chain=NO_SLIPS, solver=name)) for name in EVENTS_HAPPEN),
    ("solver", "use 'exact'", moving(solver="sliding")),
    ("expansion", "sliding", recording("sliding", chain=replace(THREE, expansion=["1", "2"]))),
    *(("dt", "dt = ", moving(solver="verlet", dt=dt)) for dt in (0, math.nan, "1e-300", True)),
    ("locate", "locate = 1", moving(solver="verlet", locate=1)),
    ("digits", "100001", moving(solver="certified", digits=100_001)),
    *(("solver", "use certified", moving(solver=name)) for name in ("reference", "mpmath")),
    ("option", "did you mean locate", moving(solver="verlet", locate_=True)),
    ("digits", "at least 1", moving(solver="certified", digits=0)),
    ("most_digits", "at least", moving(solver="certified", digits=50, most_digits=40)),
    ("chain", "must be a Chain", moving(chain="a chain")),
    ("state", "must have the chain's 4 sliders", moving(chain=replace(THREE, n=4))),
    ("max_events", "at least 1", moving(max_events=0)),
]


@pytest.mark.parametrize(("field", "allowed", "call"), REFUSED)
def test_what_cannot_be_asked_for_is_refused_by_name(
    field: str, allowed: str, call: Callable[[], Any]
) -> None:
    with pytest.raises(InputError, match=allowed) as caught:
        call()
    assert caught.value.name == field


# One loop for every solver: it stops for a reason, and loses nothing

DRIVE = Cycles("0.002", 2)
SLIPPING = ("exact", "certified", "verlet", "located")
NAMED: dict[str, tuple[str, dict[str, Any]]] = {
    "verlet": ("verlet", {"dt": 0.05}),
    "located": ("verlet", {"dt": 0.05, "locate": True}),
}


def started(name: str) -> Simulation:
    algorithm = solver_named(*NAMED.get(name, (name, {})))
    return algorithm.simulation(THREE, State.relaxed(THREE, 2), 2, algorithm.records)


def shown(parts: list[Mapping[str, NDArray[Any]]]) -> dict[str, str]:
    """Return all that was recorded, every bit of it."""
    rows: dict[str, list[Any]] = {}
    for part in parts:
        for name, values in part.items():
            rows.setdefault(name, []).extend(np.asarray(row).tolist() for row in values)
    return {name: str(values) for name, values in rows.items()}


@functools.cache
def in_one_go(name: str) -> tuple[dict[str, str], Any, Any]:
    simulation = started(name)
    (whole,) = simulate(simulation, DRIVE, [4])
    assert (whole.completed, whole.stop, whole.reason) == (4, Stop.DONE, "")
    assert len(whole.recorded["x"]) == 4
    return shown([whole.recorded]), simulation.tally, str(simulation.state())


@pytest.mark.parametrize("name", ["exact", "certified", "verlet", "sliding"])
def test_targets_one_by_one_give_the_same_bits_as_in_one_go(name: str) -> None:
    simulation = started(name)
    stretches = [*simulate(simulation, DRIVE, [1, 2, 4])]
    assert [stretch.completed for stretch in stretches] == [1, 1, 2]
    told = shown([stretch.recorded for stretch in stretches])
    assert (told, simulation.tally, str(simulation.state())) == in_one_go(name)


def test_limits_hold_for_all_targets_together_and_the_last_stretch_names_them() -> None:
    simulation, whole = started("exact"), in_one_go("exact")[1]
    *_, last = simulate(simulation, DRIVE, range(1, 5), Limits(events=whole.events - 1))
    assert (last.completed, last.stop) == (0, Stop.BUDGET)
    assert last.reason == f"max_events = {whole.events - 1} was reached"
    assert whole.events > simulation.tally.events >= whole.events - 1


def asked(times: int) -> Limits:
    """Return limits whose time is over once it has been asked so often."""
    left = iter([False] * times)
    return Limits(interrupted=lambda: next(left, True))


CALLED_BACK: dict[str, tuple[tuple[str, ...], Callable[[int], Limits]]] = {
    "after an event": ((*SLIPPING, "sliding"), lambda turn: Limits(events=1)),
    "at a pause": (("certified",), lambda turn: Limits(pause=0.0)),
    "within a search, then later": (("certified",), asked),
}


@pytest.mark.parametrize("anew", [False, True], ids=["going on", "from snapshots"])
@pytest.mark.parametrize(
    ("name", "when"),
    [(name, when) for when, (names, _) in CALLED_BACK.items() for name in names],
)
def test_what_is_called_back_at_any_moment_goes_on_with_the_same_bits(
    name: str, when: str, anew: bool
) -> None:
    simulation = started(name)
    parts: list[Mapping[str, NDArray[Any]]] = []
    done = turn = 0
    while done < 4:
        turn += 1
        stretch = simulation.follow(DRIVE, done + 1, 4 - done, CALLED_BACK[when][1](turn))
        done += stretch.completed
        parts.append(stretch.recorded)
        assert (stretch.stop is Stop.DONE) == (done == 4)
        if anew:
            parts.append(simulation.come_to_rest(NO_LIMITS))
        if anew and simulation.at_rest:
            snapshot, simulation = simulation.snapshot(), started(name)
            simulation.restore(snapshot)
    recorded, tally, state = in_one_go(name)
    assert len(parts) > 2
    assert shown(parts) == recorded
    assert (simulation.tally, str(simulation.state())) == (tally, state)
