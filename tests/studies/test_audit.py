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
from exactcreep.model.chain import Chain
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
from tests.paper import paper_chain

SEED = 5


@lru_cache
def avalanche(solver: str = "exact", **options: Any) -> Rearrangement:
    """A rearrangement of six sliders with at least ten events."""
    chain = paper_chain(6)
    state = creep(chain, Cycles("0.01", 2), seed=SEED, record=()).state
    direction = 1
    while True:
        found = rearrange(chain, state, direction=direction, seed=SEED)
        if len(found.events) >= 10:
            return rearrange(chain, state, direction=direction, seed=SEED, solver=solver, **options)
        state = found.state


@lru_cache
def run(n: int = 6, solver: str = "exact", digits: int | None = None) -> Creep:
    options = {} if digits is None else {"digits": digits}
    return creep(
        paper_chain(n), Cycles("0.002", 1), seed=SEED, solver=solver,
        record=("x_G", "x", "tension", "events"), **options,
    )  # fmt: skip


def _ratio(value: Fraction) -> tuple[Decimal, Decimal]:
    return Decimal(value.numerator), Decimal(value.denominator)


def checks(found: Audit) -> set[str]:
    return {finding.check for finding in found.findings}


def with_events(
    result: Rearrangement, change: Callable[[list[Event]], list[Event]]
) -> Rearrangement:
    return replace(result, events=tuple(change(list(result.events))))


def recording(result: Creep, **columns: Any) -> Creep:
    """Return a run that says it has recorded other columns."""
    return replace(result, recorded={**result.recorded, **columns})


def shifted(result: Rearrangement, i: int, by: Any) -> Rearrangement:
    def change(events: list[Event]) -> list[Event]:
        events[i] = replace(events[i], time=events[i].time + by)
        return events

    return with_events(result, change)


class TestHonest:
    @pytest.mark.parametrize("solver", ["exact", "reference"])
    def test_an_avalanche_passes(self, solver: str) -> None:
        found = audit(avalanche(solver), seed=SEED)
        assert found.passed, found.findings
        assert found.events == len(avalanche(solver).events)
        assert np.nanmax(found.radii) < 1e-12
        assert found.balance < 1e-13

    @pytest.mark.parametrize("n", [2, 3, 6])
    def test_a_run_passes(self, n: int) -> None:
        found = audit(run(n))
        assert found.passed, found.findings
        assert found.rearrangements == run(n).rearrangements

    def test_a_run_from_an_unstable_start_passes(self) -> None:
        chain = paper_chain(4, "0")
        start = State.prepared(chain, ["0.9", "-0.8", "0.3"])
        result = creep(chain, Cycles("0.002", 1), start=start, record=("events",))
        found = audit(result)
        assert found.passed, found.findings
        assert result.recorded["event_number"][0] == 0

    @pytest.mark.parametrize("solver", ["exact", "certified"])
    def test_a_run_from_coefficients_of_its_own_passes(self, solver: str) -> None:
        chain = paper_chain(3, "0")
        own = replace(State.relaxed(chain), coefficients=np.array([0.8, 0.7, 0.9]))
        result = creep(chain, Cycles("0.002", 2), start=own, solver=solver, record=("events",))
        found = audit(result)
        assert found.passed, found.findings
        assert result.slip_count > 20

    def test_a_certified_run_that_gathers_its_set_again_in_mid_avalanche_passes(self) -> None:
        chain, drive = paper_chain(3), Cycles("0.004", 1)
        result = creep(chain, drive, solver="certified", record=("events",))
        same = np.diff(result.recorded["event_rearrangement"]) == 0
        assert np.diff(result.recorded["event_theta_radius"])[same].any()
        assert audit(result).passed

    def test_random_dilations_pass(self) -> None:
        result = creep(paper_chain(3), GaussianSteps("0.002", 6), seed=2, record=("events",))
        assert audit(result).passed

    def test_a_runaway_passes_up_to_where_it_was_proved(self) -> None:
        chain = Chain(2, 1000, "0.5", "0.6", tan_alpha="0.55")
        result = creep(chain, Cycles("0.001", 2), record=("events",))
        assert result.outcome.value == "runaway"
        assert audit(result).passed

    def test_a_saved_run_passes(self, tmp_path: Any) -> None:
        run(3).save(tmp_path / "run.nc")
        assert audit(Creep.load(tmp_path / "run.nc")).passed

    def test_fifty_digits_pass(self) -> None:
        found = audit(avalanche("mpmath", digits=50), seed=SEED)
        assert found.passed, found.findings
        assert found.digits == 50
        assert np.nanmax(found.errors) < 1e-45


class TestSabotage:
    def test_an_event_moved_by_ten_times_its_radius_is_caught(self) -> None:
        honest = audit(avalanche(), seed=SEED)
        for i in range(1, len(avalanche().events)):
            if np.isfinite(honest.radii[i]):
                for sign in (-1, 1):
                    moved = shifted(avalanche(), i, sign * 10 * float(honest.radii[i]))
                    assert not audit(moved, seed=SEED).passed, i

    def test_an_event_moved_by_1e_20_in_a_log_of_fifty_digits_is_caught(self) -> None:
        result = avalanche("mpmath", digits=50)
        context = result.events[-1].time.context
        for i in range(1, len(result.events)):
            moved = shifted(result, i, context.mpf(10) ** -20)
            assert not audit(moved, seed=SEED).passed, i

    def test_a_certified_event_moved_by_ten_times_its_radius_is_caught(self) -> None:
        result = avalanche("certified", digits=50)
        assert audit(result, seed=SEED).passed
        for i in range(1, len(result.events)):
            moved = shifted(result, i, 10 * result.events[i].time.rad())
            assert not audit(moved, seed=SEED).passed, i

    def test_a_certified_run_moved_by_ten_times_its_radius_is_caught(self) -> None:
        result = run(3, "certified", 50)
        honest = audit(result)
        assert honest.passed, honest.findings
        texts = result.recorded["event_time_decimal"]
        later = [i for i in range(texts.size) if np.isfinite(honest.radii[i])]
        assert len(later) > 20
        assert honest.radii[later].max() < 1e-45
        for i in later[:: len(later) // 6]:
            by = 10 * Fraction(float(honest.radii[i]))
            moved = texts.astype("U90")
            moved[i] = str(Context(prec=80).divide(*_ratio(Fraction(str(texts[i])) + by)))
            assert not audit(recording(result, event_time_decimal=moved)).passed, i

    def test_a_dropped_event_is_caught(self) -> None:
        for i in range(len(avalanche().events)):
            dropped = with_events(avalanche(), lambda events, i=i: events[:i] + events[i + 1 :])
            assert not audit(dropped, seed=SEED).passed, i

    def test_a_dropped_slip_is_caught(self) -> None:
        """Start and stop of a slider left out together."""
        events = avalanche().events
        second = next(i for i, e in enumerate(events) if i and e.kind is EventKind.START)
        slider = events[second].sliders
        end = next(i for i in range(second, len(events)) if events[i].sliders == slider
                   and events[i].kind is EventKind.STOP)  # fmt: skip
        left = with_events(
            avalanche(), lambda es: [e for i, e in enumerate(es) if i not in (second, end)]
        )
        assert not audit(left, seed=SEED).passed

    @pytest.mark.parametrize("what", ["sign", "slider", "kind"])
    def test_a_flipped_contact_is_caught(self, what: str) -> None:
        other = {EventKind.START: EventKind.STOP, EventKind.STOP: EventKind.START}
        for i, event in enumerate(avalanche().events):
            changed = {
                "sign": lambda e: replace(e, signs=tuple(-s for s in e.signs)),
                "slider": lambda e: replace(e, sliders=tuple(n % 6 + 1 for n in e.sliders)),
                "kind": lambda e: replace(e, kind=other[e.kind]),
            }[what](event)

            def change(events: list[Event], i: int = i, changed: Event = changed) -> list[Event]:
                events[i] = changed
                return events

            found = audit(with_events(avalanche(), change), seed=SEED)
            assert "contact" in checks(found) or "motion" in checks(found), i

    def test_two_events_exchanged_are_caught(self) -> None:
        def exchanged(events: list[Event]) -> list[Event]:
            events[2], events[3] = events[3], events[2]
            return events

        assert "order" in checks(audit(with_events(avalanche(), exchanged), seed=SEED))

    def test_a_final_state_that_the_events_do_not_make_is_caught(self) -> None:
        state = avalanche().state
        moved = replace(state, displacements=state.displacements + np.eye(6)[2] * 1e-9)
        found = audit(replace(avalanche(), state=moved), seed=SEED)
        assert checks(found) == {"state"}

    def test_another_seed_s_coefficients_are_caught(self) -> None:
        assert "contact" in checks(audit(avalanche(), seed=SEED + 1))

    def test_an_audit_ends_after_as_many_findings_as_were_asked_for(self) -> None:
        for most in (1, 3):
            assert len(audit(avalanche(), seed=SEED + 1, most_findings=most).findings) == most

    def test_an_audit_that_has_found_enough_counts_what_it_has_followed(self) -> None:
        theta = run().recorded["event_theta"].copy()
        theta[run().recorded["event_rearrangement"] == 7] += 1e-9
        forged = recording(run(), event_theta=theta)
        found = audit(forged, most_findings=1)
        assert found.rearrangements == found.findings[0].rearrangement == 7
        assert found.events == (run().recorded["event_rearrangement"] < 7).sum()

    def test_sabotage_of_a_run_s_log_is_caught_where_it_is(self) -> None:
        result = run(6)
        assert result.recorded["event_time"].size > 100
        radii = audit(result).radii
        middle = result.recorded["event_time"].size // 2
        i = next(k for k in range(middle, radii.size) if np.isfinite(radii[k]))
        time = result.recorded["event_time"].copy()
        same = np.ones(time.size, dtype=bool)
        for name in ("event_rearrangement", "event_number"):
            same &= result.recorded[name] == result.recorded[name][i]
        time[same] += 10 * radii[i] if same.sum() == 1 else 1e-6
        found = audit(recording(result, event_time=time))
        assert not found.passed
        assert found.findings[0].rearrangement == result.recorded["event_rearrangement"][i]

    @pytest.mark.parametrize("by", [1e-9, -1e-9])
    def test_a_rearrangement_at_another_theta_is_caught(self, by: float) -> None:
        result = run(6)
        theta = result.recorded["event_theta"].copy()
        theta[result.recorded["event_rearrangement"] == 7] += by
        found = audit(recording(result, event_theta=theta))
        assert found.findings[0].rearrangement == 7

    def test_a_rearrangement_left_out_of_a_run_is_caught(self) -> None:
        result = run(6)
        keep = result.recorded["event_rearrangement"] != 9
        events = {k: v[keep] for k, v in result.recorded.items() if k.startswith("event_")}
        found = audit(recording(result, **events))
        assert not found.passed
        assert found.findings[0].rearrangement in (9, None)

    def test_a_run_of_fifty_digits_moved_by_1e_20_is_caught(self) -> None:
        result = run(3, "mpmath", 50)
        honest = audit(result)
        assert honest.passed, honest.findings
        texts = result.recorded["event_time_decimal"].copy()
        i = next(k for k in range(texts.size // 2, texts.size) if float(texts[k]) > 1)
        head, _, tail = str(texts[i]).partition(".")
        digit = str((int(tail[19]) + 1) % 10)
        texts[i] = f"{head}.{tail[:19]}{digit}{tail[20:]}"
        found = audit(recording(result, event_time_decimal=texts))
        assert not found.passed

    @pytest.mark.parametrize(
        ("name", "change"),
        [
            ("slips", lambda run: {"slip_count": run.slip_count + 1}),
            ("outcome", lambda run: {"outcome": Outcome.AT_REST}),
            ("x", lambda run: {"recorded": {**run.recorded, "x": run.recorded["x"] + 1e-15}}),
            ("x_G", lambda run: {"recorded": {**run.recorded, "x_G": run.recorded["x_G"] + 1e-15}}),
        ],
    )  # fmt: skip
    def test_what_running_again_does_not_give_is_caught(self, name: str, change: Any) -> None:
        found = audit(replace(run(), **change(run())))
        assert {one.check for one in found.findings} <= {"again", "order", "state"}
        assert f"running again gives another {name}" in [one.sentence for one in found.findings]

    def test_a_column_that_is_too_short_is_caught(self) -> None:
        assert not audit(recording(run(), x=run().recorded["x"][1:])).passed

    def test_more_half_cycles_than_the_drive_has_are_caught(self) -> None:
        found = audit(replace(run(), half_cycles=3))
        assert found.findings[0].sentence == "the drive has no target 3"

    def test_a_limit_that_calls_itself_a_runaway_is_caught(self) -> None:
        cut = creep(run().chain, run().drive, seed=SEED, record=("events",), max_events=25)
        assert audit(cut).passed
        forged = replace(cut, outcome=Outcome.RUNAWAY)
        sentences = [finding.sentence for finding in audit(forged).findings]
        assert "running again gives another outcome" in sentences

    def test_radii_of_one_and_times_of_four_fifths_are_caught(self) -> None:
        result = avalanche("certified", digits=30)

        def other(event: Event, times: Fraction, radius: Fraction) -> Event:
            known = enclosure(event.time)
            return replace(event, time=Enclosure(known.middle * times, radius))

        for times, passed in ((Fraction(4, 5), False), (Fraction(1), True)):
            events = [replace(e, **{"time": other(e, times, Fraction(1)).time}) if i else e
                      for i, e in enumerate(result.events)]  # fmt: skip
            assert audit(replace(result, events=tuple(events)), seed=SEED).passed is passed

    def test_radii_of_a_run_are_computed_again(self) -> None:
        result = run(3, "certified")
        wide = np.where(result.recorded["event_time_radius"] > 0, 1.0, 0.0)
        found = audit(recording(result, event_time_radius=wide))
        assert "running again gives another event_time_radius" in [
            one.sentence for one in found.findings
        ]

    def test_an_event_in_the_far_future_ends_an_audit_at_once(self) -> None:
        tracemalloc.start()
        found = audit(shifted(avalanche(), len(avalanche().events) - 1, 1e8), seed=SEED)
        assert tracemalloc.get_traced_memory()[1] < 5e7
        tracemalloc.stop()
        assert "no slider moves for 1e+08 tau_dyn" in [one.sentence for one in found.findings]


class TestLimits:
    def test_an_audit_whose_time_is_over_says_how_far_it_came_and_is_not_passed(
        self, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        whole, far = audit(run(6)).rearrangements, []
        monkeypatch.setattr(Limits, "passed", lambda limits: len(far) > 4)
        found = audit(run(6), max_seconds=7, progress=far.append)
        assert (found.findings, found.reason) == ((), "max_seconds = 7 was reached")
        assert found.rearrangements == 4
        assert not found.passed
        assert [(told.done, told.total) for told in far] == [(k, whole) for k in range(5)]

    def test_the_command_says_that_its_time_is_over(self, command: Command, tmp_path: Path) -> None:
        run(6).save(tmp_path / "run.nc")
        assert command("audit", "run.nc").code == 0
        done = command("audit", "run.nc", "--max-seconds", "0")
        assert done.code == 3
        assert "max_seconds = 0 was reached" in done.out
        assert "rearrangements 0 " in " ".join(done.out.split())


class TestRefusals:
    def test_a_run_without_events_cannot_be_audited(self) -> None:
        with pytest.raises(InputError, match="must include events"):
            audit(creep(paper_chain(2), Cycles("0.001", 1)))

    def test_the_seed_of_drawn_coefficients_must_be_given(self) -> None:
        with pytest.raises(InputError, match="seed"):
            audit(avalanche())


def test_a_time_step_is_seen_by_the_audit() -> None:
    """Verlet's events are late by up to its step, and its log does not pass."""
    found = audit(avalanche("verlet", dt=0.01), seed=SEED)
    assert not found.passed


def test_an_honest_run_of_verlet_is_measured_and_passes_and_a_forged_one_does_not() -> None:
    result = creep(paper_chain(3), Cycles("0.002", 1), seed=SEED, solver="verlet", dt="0.01",
                   record=("events", "x"))  # fmt: skip
    found = audit(result)
    assert found.passed, found.findings
    assert 1e-4 < found.largest_time_error < 0.02
    assert "as of fixed steps" in found.remark
    time = result.recorded["event_time"] * (1 + 1e-15)
    forged = audit(recording(result, event_time=time))
    assert [one.sentence for one in forged.findings] == ["running again gives another event_time"]
