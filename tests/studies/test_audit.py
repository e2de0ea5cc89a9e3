"""The audit: an honest log passes, a sabotaged one does not."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable
from dataclasses import replace
from decimal import Context, Decimal
from fractions import Fraction
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exactcreep.limits import Limits
from exactcreep.model.contacts import Event, EventKind
from exactcreep.model.drive import Cycles, GaussianSteps
from exactcreep.model.enclosure import Enclosure, enclosure
from exactcreep.model.numbers import InputError
from exactcreep.model.outcome import Outcome
from exactcreep.model.state import State
from exactcreep.quasistatic.creep import creep
from exactcreep.quasistatic.result import Creep
from exactcreep.solvers.registry import rearrange
from exactcreep.solvers.solver import Rearrangement
from exactcreep.studies.audit import Audit, audit
from tests.conftest import Command
from tests.paper import captions, paper_chain

SEED = 5
THREE = captions(3)
OWN = replace(State.relaxed(THREE), coefficients=np.array([0.8, 0.7, 0.9]))


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


@lru_cache
def run(n: int = 6, solver: str = "exact", digits: int | None = None) -> Creep:
    options = {} if digits is None else {"digits": digits}
    return creep(
        paper_chain(n), Cycles("0.002", 1), seed=SEED, solver=solver,
        record=("x_G", "x", "tension", "events"), **options,
    )  # fmt: skip


def events_of(chain: Any, drive: Any, **given: Any) -> Creep:
    return creep(chain, drive, record=("events",), **given)


def said(found: Audit) -> list[str]:
    return [finding.sentence for finding in found.findings]


def with_events(
    result: Rearrangement, change: Callable[[list[Event]], list[Event]]
) -> Rearrangement:
    return replace(result, events=tuple(change(list(result.events))))


def with_event(result: Rearrangement, i: int, **changed: Any) -> Rearrangement:
    return with_events(
        result, lambda events: [*events[:i], replace(events[i], **changed), *events[i + 1 :]]
    )


def recording(result: Creep, **columns: Any) -> Creep:
    """Return a run that says it has recorded other columns."""
    return replace(result, recorded={**result.recorded, **columns})


# --- honest logs -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "most"),
    [({}, 1e-12), ({"solver": "reference"}, 1e-12), ({"solver": "mpmath", "digits": 50}, 1e-45)],
)
def test_an_avalanche_passes(options: Any, most: float) -> None:
    found = audit(avalanche(**options), seed=SEED)
    assert found.passed, found.findings
    assert (found.events, found.digits) == (len(avalanche().events), options.get("digits", 15))
    assert max(np.nanmax(found.radii), np.nanmax(found.errors)) < most
    assert found.balance < most / 10


@pytest.mark.parametrize(
    ("make", "least"),
    [
        (lambda: run(2), 1),
        (run, 50),
        (lambda: events_of(captions(4), Cycles("0.002", 1),  # from a start that is not at rest
                           start=State.prepared(captions(4), ["0.9", "-0.8", "0.3"])), 10),
        (lambda: events_of(THREE, Cycles("0.002", 2), start=OWN), 20),
        (lambda: events_of(THREE, Cycles("0.002", 2), start=OWN, solver="certified"), 20),
        (lambda: events_of(paper_chain(3), GaussianSteps("0.002", 6), seed=2), 10),
        (lambda: events_of(captions(2, tan_alpha="0.55"), Cycles("0.001", 2)), 0),  # a runaway
    ],
)  # fmt: skip
def test_a_run_passes(make: Callable[[], Creep], least: int) -> None:
    found, slips = audit(make()), make().slip_count
    assert found.passed, found.findings
    assert slips >= least
    assert found.rearrangements == make().rearrangements or not least


def test_a_certified_run_that_gathers_its_set_again_in_mid_avalanche_passes() -> None:
    result = events_of(paper_chain(3), Cycles("0.004", 1), solver="certified")
    same = np.diff(result.recorded["event_rearrangement"]) == 0
    assert np.diff(result.recorded["event_theta_radius"])[same].any()
    assert audit(result).passed


# --- sabotaged logs --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "times", "most"),
    [
        ({}, 10, 1e-12),
        ({}, -10, 1e-12),
        ({"solver": "mpmath", "digits": 50}, 10, 1e-45),
        ({"solver": "certified", "digits": 50}, 10, 1e-65),
    ],
)
def test_an_event_moved_by_ten_times_its_radius_is_caught(
    options: Any, times: int, most: float
) -> None:
    result = avalanche(**options)
    honest = audit(result, seed=SEED)
    assert honest.passed
    later = np.flatnonzero(np.isfinite(honest.radii))
    assert later.size > 5
    assert honest.radii[later].max() < most
    for i in later:
        known = enclosure(result.events[i].time)
        moved = known.middle + times * Fraction(float(honest.radii[i]))
        time: Any = Enclosure(moved, known.radius) if options else float(moved)
        assert not audit(with_event(result, i, time=time), seed=SEED).passed, i


@pytest.mark.parametrize("solver", ["certified", "mpmath"])
def test_an_event_of_a_run_of_fifty_digits_that_is_moved_is_caught(solver: str) -> None:
    result = run(3, solver, 50)
    honest = audit(result)
    assert honest.passed, honest.findings
    texts = result.recorded["event_time_decimal"]
    later = [i for i in range(texts.size) if np.isfinite(honest.radii[i])]
    assert len(later) > 20
    assert honest.radii[later].max() < 1e-45
    for i in later[:: len(later) // 4]:
        time = Fraction(str(texts[i])) + 10 * Fraction(float(honest.radii[i]))
        moved = texts.astype("U90")
        ratio = Decimal(time.numerator), Decimal(time.denominator)
        moved[i] = str(Context(prec=80).divide(*ratio))
        assert not audit(recording(result, event_time_decimal=moved)).passed, i


def test_a_dropped_event_or_slip_is_caught() -> None:
    events = avalanche().events
    dropped: list[set[int]] = [{i} for i in range(len(events))]
    second = next(i for i, e in enumerate(events) if i and e.kind is EventKind.START)
    stops = (i for i in range(second, len(events)) if events[i].kind is EventKind.STOP)
    dropped.append({second, next(i for i in stops if events[i].sliders == events[second].sliders)})
    for left in dropped:
        kept = [event for i, event in enumerate(events) if i not in left]
        assert not audit(replace(avalanche(), events=tuple(kept)), seed=SEED).passed, left


def test_a_flipped_contact_is_caught() -> None:
    other = {EventKind.START: EventKind.STOP, EventKind.STOP: EventKind.START}
    for i, event in enumerate(avalanche().events):
        for changed in (
            {"signs": tuple(-sign for sign in event.signs)},
            {"sliders": tuple(n % 6 + 1 for n in event.sliders)},
            {"kind": other[event.kind]},
        ):
            found = audit(with_event(avalanche(), i, **changed), seed=SEED)
            assert {one.check for one in found.findings} & {"contact", "motion"}, (i, changed)


@pytest.mark.parametrize(
    ("forged", "seed", "checks"),
    [
        (lambda one: with_events(one, lambda es: [*es[:2], es[3], es[2], *es[4:]]), SEED, "order"),
        (lambda one: replace(one, state=replace(
            one.state, displacements=one.state.displacements + np.eye(6)[2] * 1e-9)),
         SEED, "state"),
        (lambda one: one, SEED + 1, "contact"),
    ],
    ids=["two events exchanged", "another final state", "another seed"],
)  # fmt: skip
def test_a_log_that_contradicts_itself_is_caught(forged: Any, seed: int, checks: str) -> None:
    found = {one.check for one in audit(forged(avalanche()), seed=seed).findings}
    assert checks in found
    assert checks != "state" or found == {"state"}


@pytest.mark.parametrize("most", [1, 3])
def test_an_audit_ends_after_as_many_findings_as_were_asked_for(most: int) -> None:
    assert len(audit(avalanche(), seed=SEED + 1, most_findings=most).findings) == most


def forged_theta(by: float) -> dict[str, Any]:
    theta = run().recorded["event_theta"].copy()
    theta[run().recorded["event_rearrangement"] == 7] += by
    return {"event_theta": theta}


def forged_time() -> dict[str, Any]:
    """Move one event of the seventh avalanche by a millionth."""
    time, which = run().recorded["event_time"].copy(), run().recorded["event_rearrangement"] == 7
    time[np.flatnonzero(which)[1]] += 1e-6
    return {"event_time": time}


def without_seventh() -> dict[str, Any]:
    keep = run().recorded["event_rearrangement"] != 7
    return {k: v[keep] for k, v in run().recorded.items() if k.startswith("event_")}


@pytest.mark.parametrize(
    ("forge", "places"),
    [
        (lambda: forged_theta(1e-9), {7}),
        (lambda: forged_theta(-1e-9), {7}),
        (forged_time, {7}),
        (without_seventh, {7, None}),
        (lambda: {"x": run().recorded["x"][1:]}, {None}),
    ],
)
def test_sabotage_of_a_run_s_log_is_caught_where_it_is(forge: Any, places: set[Any]) -> None:
    found = audit(recording(run(), **forge()), most_findings=1)
    assert found.findings[0].rearrangement in places
    if places == {7}:
        before = run().recorded["event_rearrangement"] < 7
        assert (found.rearrangements, found.events) == (7, before.sum())


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("slips", lambda run: {"slip_count": run.slip_count + 1}),
        ("outcome", lambda run: {"outcome": Outcome.AT_REST}),
        ("x", lambda run: {"recorded": {**run.recorded, "x": run.recorded["x"] + 1e-15}}),
        ("x_G", lambda run: {"recorded": {**run.recorded, "x_G": run.recorded["x_G"] + 1e-15}}),
    ],
)
def test_what_running_again_does_not_give_is_caught(name: str, change: Any) -> None:
    found = audit(replace(run(), **change(run())))
    assert {one.check for one in found.findings} <= {"again", "order", "state"}
    assert f"running again gives another {name}" in said(found)


def test_more_half_cycles_than_the_drive_has_are_caught() -> None:
    assert said(audit(replace(run(), half_cycles=3)))[0] == "the drive has no target 3"


def test_a_limit_that_calls_itself_a_runaway_is_caught() -> None:
    cut = events_of(run().chain, run().drive, seed=SEED, max_events=25)
    assert audit(cut).passed
    found = audit(replace(cut, outcome=Outcome.RUNAWAY))
    assert "running again gives another outcome" in said(found)


@pytest.mark.parametrize(("times", "passed"), [(Fraction(4, 5), False), (Fraction(1), True)])
def test_a_radius_of_one_hides_no_time_of_four_fifths(times: Fraction, passed: bool) -> None:
    result = avalanche("certified", digits=30)
    events = [replace(e, time=Enclosure(enclosure(e.time).middle * times, Fraction(1)))
              for e in result.events[1:]]  # fmt: skip
    wide = replace(result, events=(result.events[0], *events))
    assert audit(wide, seed=SEED).passed is passed


def test_radii_of_a_run_are_computed_again() -> None:
    result = run(3, "certified")
    wide = np.where(result.recorded["event_time_radius"] > 0, 1.0, 0.0)
    found = audit(recording(result, event_time_radius=wide))
    assert "running again gives another event_time_radius" in said(found)


def test_an_event_in_the_far_future_ends_an_audit_at_once() -> None:
    last = len(avalanche().events) - 1
    tracemalloc.start()
    found = audit(with_event(avalanche(), last, time=1e8), seed=SEED)
    assert tracemalloc.get_traced_memory()[1] < 5e7
    tracemalloc.stop()
    assert "no slider moves for 1e+08 tau_dyn" in said(found)


def test_verlet_is_measured_and_passes_if_it_is_run_again_and_a_forged_log_does_not() -> None:
    """Its events are late by up to its step: an avalanche alone does not pass."""
    assert not audit(avalanche("verlet", dt=0.01), seed=SEED).passed
    result = creep(paper_chain(3), Cycles("0.002", 1), seed=SEED, solver="verlet", dt="0.01",
                   record=("events", "x"))  # fmt: skip
    found = audit(result)
    assert found.passed, found.findings
    assert 1e-4 < found.largest_time_error < 0.02
    assert "as of fixed steps" in found.remark
    forged = audit(recording(result, event_time=result.recorded["event_time"] * (1 + 1e-15)))
    assert said(forged) == ["running again gives another event_time"]


# --- limits, files and refusals --------------------------------------------------------------


def test_an_audit_whose_time_is_over_says_how_far_it_came_and_is_not_passed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    far: list[Any] = []
    monkeypatch.setattr(Limits, "passed", lambda limits: len(far) > 4)
    found = audit(run(), max_seconds=7, progress=far.append)
    assert (found.findings, found.reason) == ((), "max_seconds = 7 was reached")
    assert (found.rearrangements, found.passed) == (4, False)
    assert [(one.done, one.total) for one in far] == [(k, run().rearrangements) for k in range(5)]


def test_the_command_audits_a_file_and_says_that_its_time_is_over(
    command: Command, tmp_path: Path
) -> None:
    run().save(tmp_path / "run.nc")
    assert command("audit", "run.nc").code == 0
    done = command("audit", "run.nc", "--max-seconds", "0")
    assert done.code == 3
    assert "max_seconds = 0 was reached" in done.out
    assert "rearrangements 0 " in " ".join(done.out.split())


def test_what_cannot_be_audited_is_refused() -> None:
    with pytest.raises(InputError, match="must include events"):
        audit(creep(paper_chain(2), Cycles("0.001", 1)))
    with pytest.raises(InputError, match="seed"):
        audit(avalanche())
