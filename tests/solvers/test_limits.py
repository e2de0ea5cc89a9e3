"""Every limit is an outcome: heard in time, with what was reached, and with its reason."""

from __future__ import annotations

import math
import os
import signal
import time
from typing import Any

import numpy as np
import pytest

from exactcreep import (
    Cycles,
    Evidence,
    Outcome,
    State,
    Targets,
    creep,
    fate,
    rearrange,
    survival,
    threshold,
)
from exactcreep.motion.runaway import NEVER_STOPS
from exactcreep.results import EventKind, Interrupted, Progress
from exactcreep.watch import preparation
from exactcreep.watch.limits import NO_LIMITS, Limits
from tests.paper import captions, paper_chain

pytestmark = pytest.mark.filterwarnings("ignore::exactcreep.results.PhysicsWarning")
EVENT_SOLVERS = ["exact", "certified"]
each_solver = pytest.mark.parametrize("solver", EVENT_SOLVERS)


# A proof that an avalanche never ends


@each_solver
@pytest.mark.parametrize(("n", "tan_alpha"), [(1, "0.7"), (2, "0.51"), (3, "0.55"), (6, "-0.52")])
def test_a_runaway_is_proved_and_returned_with_what_came_before(
    n: int, tan_alpha: str, solver: str
) -> None:
    """Its mean velocity is beyond what the energy of the sliders' relative motion can stop."""
    chain = captions(n, tan_alpha=tan_alpha)
    start = State.relaxed(chain)
    result = rearrange(chain, start, direction=min(n - 1, 1), solver=solver, max_events=500)
    assert (result.outcome, result.reason) == (Outcome.RUNAWAY, NEVER_STOPS)
    assert (result.evidence is Evidence.PROVED) == (solver == "certified")
    downhill = 1 if chain.tan_alpha > 0 else -1
    velocities = downhill * result.velocities.astype(float)
    assert (velocities >= 0).all()
    assert result.events[-1].kind is EventKind.START
    pulls = result.state.forces(chain) - downhill * chain.friction
    beside = np.eye(n, k=1) + np.eye(n, k=-1)
    stiffness = np.diag(beside.sum(axis=0)) - beside
    inner, pull = velocities - velocities.mean(), pulls - pulls.mean()
    energy = inner @ inner + pull @ np.linalg.pinv(stiffness) @ pull
    assert velocities.mean() >= math.sqrt((1 - 1 / n) * energy) * (1 - 1e-12)
    run = creep(chain, Cycles("0.1", 1), solver=solver)
    assert (run.outcome, run.reason) == (Outcome.RUNAWAY, NEVER_STOPS)
    assert run.velocity == downhill * math.inf


# Limits that were asked for


@pytest.mark.parametrize("solver", [*EVENT_SOLVERS, "verlet"])
@pytest.mark.parametrize("tensions", [[], ["0.45", "0.45"], ["0.6", "0.9"]])
def test_at_mu_d_no_avalanche_is_a_runaway_and_it_stops_at_the_events_asked_for(
    tensions: list[str], solver: str
) -> None:
    """The first avalanche of six sliders ends; others of three go round for ever."""
    chain = paper_chain(*((3, "0") if tensions else (6,)), l0=10, tan_alpha="1/2")
    start = State.prepared(chain, tensions) if tensions else State.relaxed(chain)
    part, whole = (
        rearrange(chain, start, direction=int(not tensions), solver=solver, max_events=most)
        for most in (10, 40 if tensions else 10**6)
    )
    assert (part.outcome, part.reason) == (Outcome.LIMIT, "max_events = 10 was reached")
    assert 10 <= len(part.events) < 20
    assert part.itinerary == whole.itinerary[: len(part.events)]
    assert whole.outcome is (Outcome.LIMIT if tensions else Outcome.AT_REST)
    for found in (part, whole):
        assert (found.outcome is Outcome.LIMIT) == any(float(v) != 0 for v in found.velocities)


FAR = Targets(["0.9"])
RUNS: dict[str, tuple[int, Any, dict[str, Any], int]] = {
    "verlet": (2, Cycles("0.05", 9), {"dt": 1e-9}, 2),
    "sliding": (2000, Cycles("0.9", 10**9), {}, 10**5),
    "certified": (400, Cycles("0.05", 9), {}, 5),
    "exact": (10_000, FAR, {}, 10**5),
}
"""Long runs of each solver, and how many events may follow a limit."""


def long_run(solver: str, **given: Any) -> Any:
    n, drive, options, _ = RUNS[solver]
    chain = paper_chain(n, 0 if solver == "sliding" else "1/100")
    return creep(chain, drive, solver=solver, **options, **given)


@pytest.mark.parametrize("solver", RUNS)
def test_the_seconds_asked_for_are_heard_soon(out_of_time: Any, solver: str) -> None:
    """Soon: after so many events at most, once a clock says so that is looked at three times."""
    out_of_time(3)
    result = long_run(solver, max_seconds=0.3)
    assert (result.outcome, result.reason) == (Outcome.LIMIT, "max_seconds = 0.3 was reached")
    assert result.state.n == RUNS[solver][0]
    assert result.event_count <= RUNS[solver][-1]


SIX = paper_chain(6, "0")
STUDIES: dict[str, Any] = {
    "fate": lambda **given: fate(SIX, "0.002", cycles=10**8, solver="exact", **given),
    "survival": lambda **given: survival(SIX, "0.002", cycles=10**8, starts=2, **given),
    "threshold": lambda **given: threshold(paper_chain(3, "0"), digits=30, points=10**6, **given),
}


@pytest.mark.usefixtures("hears_ctrl_c")
@pytest.mark.skipif(os.name != "posix", reason="sends itself a signal")
@pytest.mark.parametrize("asked", ["verlet", "certified", "exact", *STUDIES])
def test_the_interrupt_key_is_heard_soon_and_keeps_what_there_is(asked: str) -> None:
    reports: list[int] = []

    def press(progress: Progress) -> None:
        if progress.events > 0 or asked in STUDIES:
            reports.append(progress.events)
        if len(reports) == 1 + (asked in STUDIES):  # before that nothing has begun
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(Interrupted) as caught:
        STUDIES[asked](progress=press) if asked in STUDIES else long_run(asked, progress=press)
    partial = caught.value.partial
    assert partial.reason.endswith("interrupted")  # after what a threshold knows so far
    if asked not in STUDIES:
        assert 0 <= partial.event_count - reports[0] <= RUNS[asked][-1]


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="there is no timer")
def test_a_preparation_that_looks_at_no_limit_is_ended_and_a_computation_is_not() -> None:
    def waits(seconds: float) -> None:
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            time.sleep(0.01)

    with preparation.command():
        Limits.of(max_seconds=0.01)
        with pytest.raises(preparation.Late, match=r"max_seconds = 0\.01 was reached before"):
            waits(20)
    with preparation.command():
        limits = Limits.of(max_seconds=0.01)
        assert not NO_LIMITS.passed()
        limits.passed()
        waits(1.2)
    Limits.of(max_seconds=0.01)  # in a program of the user nothing is ended
    waits(0.8)
