"""The audit: an honest log passes, a sabotaged one does not."""

from __future__ import annotations

from dataclasses import replace
from decimal import Decimal, localcontext
from fractions import Fraction
from functools import lru_cache
from typing import Any

import numpy as np
import pytest

from exactcreep.limits import Limits
from exactcreep.model.contacts import EventKind
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
from tests.paper import captions, paper_chain

SEED = 5
THREE = captions(3)
OWN = replace(State.relaxed(THREE), coefficients=np.array([0.8, 0.7, 0.9]))
SHORT = Cycles("0.002", 2)


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
def run(n: int = 6, solver: str = "exact", **options: Any) -> Creep:
    return creep(
        paper_chain(n),
        Cycles("0.002", 1),
        seed=SEED,
        solver=solver,
        record=("x_G", "x", "tension", "events"),
        **options,
    )


def events_of(chain: Any, drive: Any, **given: Any) -> Creep:
    return creep(chain, drive, record=("events",), **given)


def said(found: Audit) -> list[str]:
    return [finding.sentence for finding in found.findings]


def checks(found: Audit) -> set[str]:
    return {finding.check for finding in found.findings}


def with_event(i: int, *, of: Rearrangement | None = None, **changed: Any) -> Rearrangement:
    result = of or avalanche()
    events = list(result.events)
    events[i] = replace(events[i], **changed)
    return replace(result, events=tuple(events))


def recording(result: Creep, **columns: Any) -> Creep:
    """Return a run that says it has recorded other columns."""
    return replace(result, recorded=result.recorded | columns)


# --- honest logs -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "most"), [({}, 1e-12), ({"solver": "mpmath", "digits": 50}, 1e-45)]
)
def test_an_avalanche_passes(options: Any, most: float) -> None:
    found = audit(avalanche(**options), seed=SEED)
    assert found.passed, found.findings
    assert found.events == len(avalanche().events)
    assert found.digits == options.get("digits", 15)
    assert max(np.nanmax(found.radii), np.nanmax(found.errors)) < most
    assert found.balance < most / 10


STEEP = captions(2, tan_alpha="0.55")
UNSTABLE = State.prepared(captions(4), ["0.9", "-0.8", "0.3"])


@pytest.mark.parametrize(
    ("make", "least"),
    [
        (run, 50),
        (lambda: events_of(captions(4), SHORT, start=UNSTABLE), 10),
        (lambda: events_of(THREE, SHORT, start=OWN, solver="certified"), 20),
        (lambda: events_of(paper_chain(3), GaussianSteps("0.002", 6), seed=2), 10),
        (lambda: events_of(paper_chain(6), SHORT, max_events=25), 5),
        (lambda: events_of(STEEP, SHORT), 0),  # a runaway
    ],
)
def test_a_run_passes(make: Any, least: int) -> None:
    result = make()
    found = audit(result)
    assert found.passed, found.findings
    assert result.slip_count >= least
    assert found.rearrangements == result.rearrangements or not least


# --- sabotaged logs --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "times", "most"),
    [
        ({}, 10, 1e-12),
        ({}, -10, 1e-12),
        ({"solver": "certified", "digits": 50}, 10, 1e-65),
    ],
)
def test_an_event_moved_by_ten_times_its_radius_is_caught(
    options: Any, times: int, most: float
) -> None:
    result = avalanche(**options)
    radii = audit(result, seed=SEED).radii
    later = np.flatnonzero(np.isfinite(radii))
    assert later.size > 5
    assert radii[later].max() < most
    for i in later:
        known = enclosure(result.events[i].time)
        moved = known.middle + times * Fraction(float(radii[i]))
        time = Enclosure(moved, known.radius) if options else float(moved)
        assert not audit(with_event(i, of=result, time=time), seed=SEED).passed, i


def test_an_event_of_a_run_of_fifty_digits_that_is_moved_is_caught() -> None:
    result = run(3, "mpmath", digits=50)
    honest = audit(result)
    assert honest.passed, honest.findings
    texts = result.recorded["event_time_decimal"]
    later = np.flatnonzero(np.isfinite(honest.radii))
    assert len(later) > 20
    assert honest.radii[later].max() < 1e-45
    for i in later[:: len(later) // 2]:
        time = Fraction(str(texts[i])) + 10 * Fraction(float(honest.radii[i]))
        moved = texts.astype("U90")
        with localcontext(prec=80):
            moved[i] = str(Decimal(time.numerator) / time.denominator)
        assert not audit(recording(result, event_time_decimal=moved)).passed, i


def test_a_dropped_event_or_slip_is_caught() -> None:
    events = avalanche().events
    second = next(i for i, e in enumerate(events) if i and e.kind is EventKind.START)
    stop = next(
        i for i, e in enumerate(events)
        if i > second and e.kind is EventKind.STOP and e.sliders == events[second].sliders
    )  # fmt: skip
    for left in [{second, stop}, *({i} for i in range(len(events)))]:
        kept = tuple(event for i, event in enumerate(events) if i not in left)
        assert not audit(replace(avalanche(), events=kept), seed=SEED).passed, left


def test_a_flipped_contact_is_caught() -> None:
    other = {EventKind.START: EventKind.STOP, EventKind.STOP: EventKind.START}
    for i, event in enumerate(avalanche().events):
        for changed in (
            {"signs": tuple(-sign for sign in event.signs)},
            {"sliders": tuple(n % 6 + 1 for n in event.sliders)},
            {"kind": other[event.kind]},
        ):
            found = audit(with_event(i, **changed), seed=SEED)
            assert checks(found) & {"contact", "motion"}, (i, changed)


def test_a_log_that_contradicts_itself_is_caught() -> None:
    events, state = avalanche().events, avalanche().state
    exchanged = replace(avalanche(), events=(*events[:2], events[3], events[2], *events[4:]))
    assert "order" in checks(audit(exchanged, seed=SEED))
    further = replace(state, displacements=state.displacements + np.eye(6)[2] * 1e-9)
    assert checks(audit(replace(avalanche(), state=further), seed=SEED)) == {"state"}
    other_draws = audit(avalanche(), seed=SEED + 1, most_findings=3)
    assert "contact" in checks(other_draws)
    assert len(other_draws.findings) == 3


@pytest.mark.parametrize("by", [1e-9, -1e-9, None])
def test_sabotage_of_a_run_s_log_is_caught_where_it_is(by: float | None) -> None:
    """The seventh avalanche is moved, or left out."""
    recorded = run().recorded
    seventh = recorded["event_rearrangement"] == 7
    if by is None:
        forged = {k: v[~seventh] for k, v in recorded.items() if k.startswith("event_")}
    else:
        forged = {"event_theta": recorded["event_theta"] + by * seventh}
    found = audit(recording(run(), **forged), most_findings=1)
    assert found.findings[0].rearrangement in ({7} if by else {7, None})
    if by:
        assert found.rearrangements == 7
        assert found.events == (recorded["event_rearrangement"] < 7).sum()


@pytest.mark.parametrize(
    ("forge", "sentence"),
    [
        (lambda run: {"slip_count": run.slip_count + 1}, "running again gives another slips"),
        (lambda run: {"outcome": Outcome.RUNAWAY}, "running again gives another outcome"),
        (lambda run: {"recorded": run.recorded | {"x": run.recorded["x"] + 1e-15}},
         "running again gives another x"),
        (lambda run: {"half_cycles": 3}, "the drive has no target 3"),
    ],
)  # fmt: skip
def test_what_running_again_does_not_give_is_caught(forge: Any, sentence: str) -> None:
    assert sentence in said(audit(replace(run(), **forge(run()))))


@pytest.mark.parametrize(("share", "passed"), [(Fraction(4, 5), False), (Fraction(1), True)])
def test_a_radius_of_one_hides_no_time_of_four_fifths(share: Fraction, passed: bool) -> None:
    result = avalanche("certified", digits=30)
    first, *later = result.events
    times = [Enclosure(enclosure(e.time).middle * share, Fraction(1)) for e in later]
    events = [replace(e, time=time) for e, time in zip(later, times, strict=True)]
    wide = replace(result, events=(first, *events))
    assert audit(wide, seed=SEED).passed is passed


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


def test_what_cannot_be_audited_is_refused() -> None:
    with pytest.raises(InputError, match="must include events"):
        audit(creep(paper_chain(2), Cycles("0.001", 1)))
    with pytest.raises(InputError, match="seed"):
        audit(avalanche())
