"""Every limit is an outcome: heard in time, with what was reached, and with its reason."""

from __future__ import annotations

import math
import os
import signal
from fractions import Fraction
from typing import Any

import pytest

from exactcreep import (
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

EVENT_SOLVERS = ["exact", "reference", "mpmath", "certified"]


def slope_above(excess, n=2, sigma_mu=0):
    return paper_chain(n, sigma_mu, l0=10, tan_alpha=Fraction(1, 2) + excess)


# A proof that an avalanche never ends


@pytest.mark.parametrize("solver", EVENT_SOLVERS)
@pytest.mark.parametrize(("n", "tan_alpha"), [(1, "0.7"), (2, "0.51"), (6, "-0.52")])
def test_a_runaway_is_proved_and_returned_with_what_came_before(n, tan_alpha, solver):
    chain = captions(n, tan_alpha=tan_alpha)
    start = State.relaxed(chain)
    result = rearrange(chain, start, direction=min(n - 1, 1), solver=solver, max_events=500)
    assert (result.outcome, result.reason) == (Outcome.RUNAWAY, NEVER_STOPS)
    assert (result.evidence is Evidence.PROVED) == (solver == "certified")
    downhill = 1 if chain.tan_alpha > 0 else -1
    assert all(downhill * float(v) >= 0 for v in result.velocities)
    assert result.events[-1].kind is EventKind.START
    if solver in ("exact", "reference"):
        run = creep(chain, Cycles("0.1", 1), solver=solver)
        assert (run.outcome, run.reason) == (Outcome.RUNAWAY, NEVER_STOPS)
        assert run.velocity == downhill * math.inf


@pytest.mark.parametrize("solver", EVENT_SOLVERS)
@pytest.mark.parametrize(("n", "sigma_mu"), [(2, 0), (6, "1/100")])
@pytest.mark.parametrize("excess", [Fraction(0), -Fraction(1, 10**12)], ids=["at", "below"])
def test_up_to_mu_d_the_first_avalanche_ends(excess, n, sigma_mu, solver):
    chain = slope_above(excess, n, sigma_mu)
    result = rearrange(chain, State.relaxed(chain), direction=1, solver=solver)
    assert result.outcome is Outcome.AT_REST
    assert all(bool(v == 0) for v in result.velocities)


def test_an_avalanche_that_is_not_proved_to_run_away_is_given_up_after_a_million_events():
    chain = captions(2, tan_alpha="0.50000001")
    run = creep(chain, Cycles("0.1", 1))
    assert run.outcome is Outcome.LIMIT
    assert "nor been proved to run away after 1000000 events" in run.reason
    assert 10**6 < run.event_count < 10**6 + 10_000


@pytest.mark.parametrize("solver", EVENT_SOLVERS)
def test_an_avalanche_that_goes_round_for_ever_at_mu_d_is_a_limit(solver):
    chain = captions(3, l0=10, tan_alpha="1/2")
    for tensions in (["0.45", "0.45"], ["0.6", "0.9"]):
        start = State.prepared(chain, tensions)
        result = rearrange(chain, start, direction=0, solver=solver, max_events=40)
        assert result.outcome is Outcome.LIMIT
        assert result.reason == "max_events = 40 was reached"


# Limits of a rearrangement


@pytest.mark.parametrize("solver", [*EVENT_SOLVERS, "verlet"])
def test_a_rearrangement_stops_at_the_events_asked_for(solver):
    chain = paper_chain(6, tan_alpha="0.49")
    state = State.perturbed(chain, "1/2", start_seed=2)
    whole = rearrange(chain, state, direction=0, solver=solver)
    assert whole.outcome is Outcome.AT_REST
    assert whole.reason == ""
    assert len(whole.events) > 20
    part = rearrange(chain, state, direction=0, solver=solver, max_events=10)
    assert part.outcome is Outcome.LIMIT
    assert part.reason == "max_events = 10 was reached"
    assert 10 <= len(part.events) < 20
    assert part.itinerary == whole.itinerary[: len(part.events)]
    assert any(float(v) != 0 for v in part.velocities)


# Limits of a run


@pytest.mark.parametrize(
    ("n", "drive", "solver", "options", "most"),
    [
        (2, Cycles("0.05", 9), "verlet", {"dt": 1e-9}, 2),
        (2000, Cycles("0.9", 10**9), "sliding", {}, 10**5),
        (400, Cycles("0.05", 9), "certified", {}, 5),
        (100, Path(["0.05"]), "mpmath", {"digits": 50}, 5),
        (1000, Path(["0.9"]), "reference", {}, 5),
        (10_000, Path(["0.9"]), "exact", {}, 10**5),
    ],
)
def test_the_seconds_asked_for_are_heard_soon(out_of_time, n, drive, solver, options, most):
    """Soon: after so many events at most, once a clock says so that is looked at three times."""
    out_of_time(3)
    chain = paper_chain(n, 0 if solver == "sliding" else "1/100")
    result = creep(chain, drive, solver=solver, max_seconds=0.3, **options)
    assert result.outcome is Outcome.LIMIT
    assert result.reason == "max_seconds = 0.3 was reached"
    assert result.state.n == n
    assert result.event_count <= most


@pytest.mark.usefixtures("hears_ctrl_c")
@pytest.mark.skipif(os.name != "posix", reason="sends itself a signal")
@pytest.mark.parametrize(
    ("solver", "n", "most"), [("verlet", 2, 2), ("certified", 400, 5), ("exact", 10_000, 10**5)]
)
def test_the_interrupt_key_is_heard_soon_and_keeps_what_there_is(solver, n, most):
    options = {"dt": 1e-9} if solver == "verlet" else {}
    pressed: list[int] = []

    def press(progress):
        if progress.events > 0 and not pressed:
            pressed.append(progress.events)
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(Interrupted) as caught:
        creep(paper_chain(n), Path(["0.9"]), solver=solver, progress=press, **options)
    assert caught.value.partial.reason == "interrupted"
    assert 0 <= caught.value.partial.event_count - pressed[0] <= most


@pytest.mark.usefixtures("hears_ctrl_c")
@pytest.mark.skipif(os.name != "posix", reason="sends itself a signal")
@pytest.mark.parametrize(
    "ask",
    [
        lambda **given: fate(paper_chain(6, "0"), "0.002", cycles=10**8, solver="exact", **given),
        lambda **given: survival(paper_chain(6, "0"), "0.002", cycles=10**8, starts=2, **given),
        lambda **given: threshold(paper_chain(3, "0"), digits=30, points=10**6, **given),
    ],
    ids=["fate", "survival", "threshold"],
)
def test_a_question_that_is_interrupted_keeps_what_it_had(ask: Any) -> None:
    pressed: list[Progress] = []

    def press(progress: Progress) -> None:
        pressed.append(progress)
        if len(pressed) == 2:  # before the first report nothing has begun
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(Interrupted) as caught:
        ask(progress=press)
    assert caught.value.partial.reason == "interrupted"
