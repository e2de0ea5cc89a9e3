"""How well a run is known: from where on rounding has grown beyond its promise, by `certified`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from exactcreep import Creep, Cycles, Evidence, Outcome, State, creep, rearrange
from tests.paper import captions, paper_chain


def test_an_avalanche_beyond_the_promise_is_undecided_alone_and_in_a_run() -> None:
    """Of so many events that float64 promises nothing."""
    steep = paper_chain(2, tan_alpha="0.5001")
    alone = rearrange(steep, State.relaxed(steep), direction=1, max_events=100_000)
    run = creep(steep, Cycles("0.01", 1))
    assert alone.outcome is run.outcome is Outcome.RUNAWAY
    assert run.event_count > 200
    assert alone.evidence is run.evidence is Evidence.UNDECIDED


def test_a_run_tells_how_far_its_course_is_followed_from_what_its_velocity_is_worth() -> None:
    run = creep(paper_chain(6), Cycles("0.01", 150), seed=1)
    assert run.evidence is Evidence.UNDECIDED
    assert run.undecided_from - 1 <= run.known_half_cycles == run.trusted_half_cycles < 150
    assert str(run.known_half_cycles) in run.course
    locked = creep(captions(5), Cycles("0.000759", 150))
    assert locked.undecided_from
    assert locked.course.endswith("the outcome is where float64 ended")


def test_a_comparison_settled_by_a_rule_ends_what_is_followed_though_a_twin_agrees() -> None:
    level = captions(2, tan_alpha="0")  # both ends reach their thresholds at once
    run = creep(level, Cycles("0.003", 10), twin=True)
    assert run.undecided > 0
    assert run.known_half_cycles == run.undecided_from - 1 < (run.trusted_half_cycles or 0)


def test_a_start_within_some_roundings_of_where_a_slider_starts_is_undecided() -> None:
    """At one rounding a rule settles it; at six a copy that is further off slips differently."""
    chain = captions(2)
    room = chain.times_cosine(chain.mu_s) - chain.sin_alpha
    for roundings, told in ((1, (1, 1)), (6, (0, 1)), (40, (0, 0))):
        start = State.prepared(chain, [room - roundings * 2.0**-50])
        run = creep(chain, Cycles("1e-5", 1), start=start, burn_in=0)
        assert (run.undecided, run.undecided_from) == told


def held(run: Creep) -> tuple[float, float]:
    """Return the largest errors of tensions before `undecided_from`, and of trusted targets."""
    trusted, before = run.trusted_half_cycles, (run.undecided_from or run.half_cycles + 1) - 1
    cycles = Cycles(run.drive.amplitude, (max(trusted, before, 1) + 1) // 2)
    start = run.experiment.initial
    told = {"seed": run.seed, "start": start, "record": ("tension",), "burn_in": 0}
    truth = creep(run.chain, cycles, solver="certified", **told)
    assert (truth.evidence, truth.undecided_from) == (Evidence.PROVED, 0)
    known = truth.recorded["tension"]
    off = abs(run.recorded["tension"][: len(known)] - known).max(axis=1)
    return off[:before].max(initial=0.0), off[:trusted].max(initial=0.0)


def disordered(n: int, amplitude: str, cycles: int, seed: int) -> Creep:
    chain = paper_chain(n)
    start = State.perturbed(chain, "1e-3", start_seed=seed, seed=seed)
    told = {"seed": seed, "start": start, "record": ("tension",), "burn_in": 0}
    return creep(chain, Cycles(amplitude, cycles), twin=True, **told)


def test_before_a_run_is_undecided_its_tensions_are_right() -> None:
    """The copy of the first was off at its start alone once: it agreed to the end."""
    level = creep(paper_chain(4, tan_alpha="0"), Cycles("0.006", 2), seed=3, record=("tension",))
    assert level.undecided == level.long_rearrangements == 0
    for run in (disordered(4, "0.000970143", 30, 7739), level):
        assert run.undecided_from > 1
        assert run.evidence is Evidence.UNDECIDED
        early, trusted = held(run)
        assert early <= 1e-12
        assert trusted <= 1e-9


@pytest.mark.parametrize("expansion", [(), (1, "1.3", "1.6")])
def test_before_a_run_of_springs_that_differ_is_undecided_its_tensions_are_right(expansion):
    chain = replace(paper_chain(4), expansion=expansion)
    run = creep(chain, Cycles("0.004", 4), seed=1, record=("tension",))
    assert run.undecided == 0
    assert 1 < run.undecided_from < run.half_cycles
    assert held(run)[0] <= 1e-12


@pytest.mark.parametrize("n", [3, 6])
def test_copies_of_a_chain_that_mirrors_itself_mirror_themselves(n: int) -> None:
    """Else a rounding decides which end slips first, and they part at once."""
    level = captions(n, tan_alpha="0")
    assert creep(level, Cycles("0.003", 8)).trusted_half_cycles == 16


@pytest.mark.slow
def test_what_is_decided_and_trusted_under_disorder_holds_in_ninety_nine_of_a_hundred() -> None:
    random, errors = np.random.default_rng(37), []
    for k in range(300):
        n = 3 + k % 10
        amplitude = random.uniform(0.9, 1.6) * n * 0.25 / (1 + 1 / 16) ** 0.5 / 2000
        errors.append(held(disordered(n, f"{amplitude:.9f}", 60, int(random.integers(10**6)))))
    for worst, tolerance in zip(np.array(errors).T, (1e-12, 1e-9), strict=True):
        assert (worst > tolerance).sum() <= 3
        assert worst.max() <= 3 * tolerance
