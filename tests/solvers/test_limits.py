"""Every limit is an outcome: heard in time, with what was reached, and with its reason."""

from __future__ import annotations

import math
import os
import signal
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from exactcreep import (
    Chain,
    Cycles,
    EventKind,
    Evidence,
    Interrupted,
    Outcome,
    Path,
    Progress,
    State,
    creep,
    fate,
    rearrange,
    survival,
    threshold,
)
from exactcreep.motion.runaway import NEVER_STOPS
from tests.paper import captions, paper_chain

pytestmark = pytest.mark.filterwarnings("ignore::exactcreep.PhysicsWarning")
EVENT_SOLVERS = ["exact", "reference", "mpmath", "certified"]
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
    if solver in ("exact", "reference"):
        run = creep(chain, Cycles("0.1", 1), solver=solver)
        assert (run.outcome, run.reason) == (Outcome.RUNAWAY, NEVER_STOPS)
        assert run.velocity == downhill * math.inf


TEN = {"l0": 10, "tan_alpha": "1/2"}
JUST_BELOW = TEN | {"tan_alpha": Fraction(1, 2) - Fraction(1, 10**12)}
NEAR_MU_D: list[tuple[Chain, list[str], Outcome]] = [
    *((captions(2, **near), [], Outcome.AT_REST) for near in (TEN, JUST_BELOW)),
    *((paper_chain(6, **near), [], Outcome.AT_REST) for near in (TEN, JUST_BELOW)),
    (captions(3, **TEN), ["0.45", "0.45"], Outcome.LIMIT),  # it goes round for ever
    (captions(3, **TEN), ["0.6", "0.9"], Outcome.LIMIT),
]


@each_solver
@pytest.mark.parametrize(("chain", "tensions", "outcome"), NEAR_MU_D)
def test_up_to_mu_d_the_first_avalanche_ends_and_others_may_go_round_for_ever(
    chain: Chain, tensions: list[str], outcome: Outcome, solver: str
) -> None:
    start = State.prepared(chain, tensions) if tensions else State.relaxed(chain)
    most = 40 if tensions else 10**6
    found = rearrange(chain, start, direction=0 if tensions else 1, solver=solver, max_events=most)
    assert found.outcome is outcome
    assert found.reason == ("max_events = 40 was reached" if tensions else "")
    assert any(float(v) != 0 for v in found.velocities) == (outcome is Outcome.LIMIT)


# Limits that were asked for


@pytest.mark.parametrize("solver", [*EVENT_SOLVERS, "verlet"])
def test_a_rearrangement_stops_at_the_events_asked_for(solver: str) -> None:
    chain = paper_chain(6, tan_alpha="0.49")
    state = State.perturbed(chain, "1/2", start_seed=2)
    whole = rearrange(chain, state, direction=0, solver=solver)
    assert (whole.outcome, whole.reason) == (Outcome.AT_REST, "")
    assert len(whole.events) > 20
    part = rearrange(chain, state, direction=0, solver=solver, max_events=10)
    assert (part.outcome, part.reason) == (Outcome.LIMIT, "max_events = 10 was reached")
    assert 10 <= len(part.events) < 20
    assert part.itinerary == whole.itinerary[: len(part.events)]
    assert any(float(v) != 0 for v in part.velocities)


FAR = Path(["0.9"])
RUNS: dict[str, tuple[int, Any, dict[str, Any], int]] = {
    "verlet": (2, Cycles("0.05", 9), {"dt": 1e-9}, 2),
    "sliding": (2000, Cycles("0.9", 10**9), {}, 10**5),
    "certified": (400, Cycles("0.05", 9), {}, 5),
    "mpmath": (100, FAR, {"digits": 50}, 5),
    "reference": (1000, FAR, {}, 5),
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
    assert partial.reason == "interrupted"
    if asked not in STUDIES:
        assert 0 <= partial.event_count - reports[0] <= RUNS[asked][-1]
