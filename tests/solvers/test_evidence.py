"""How well a result is known: one definition for rearrangements and runs, in every solver."""

from __future__ import annotations

import pytest

from exactcreep import Chain, Cycles, Evidence, Outcome, State, creep, rearrange
from exactcreep.solvers import exact, verlet

STEEP = Chain(2, 1000, "1/2", "3/5", "1/100", tan_alpha="0.5001")
"""Its first rearrangement is an avalanche of so many events that float64 promises nothing."""


def test_an_avalanche_beyond_the_promise_is_undecided_alone_and_in_a_run() -> None:
    alone = rearrange(STEEP, State.relaxed(STEEP), direction=1)
    run = creep(STEEP, Cycles("0.01", 1))
    assert alone.outcome is run.outcome is Outcome.RUNAWAY
    assert run.events > 200
    assert alone.evidence is run.evidence is Evidence.UNDECIDED


@pytest.mark.parametrize(("solver", "module"), [("exact", exact), ("verlet", verlet)])
def test_a_time_limit_does_not_count_what_the_compiler_took(
    solver: str, module: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    chain = Chain(3, 1000, "0.5", "0.6", tan_alpha="0.25")
    arguments = {"direction": 1, "solver": solver, "max_seconds": 0}
    assert rearrange(chain, State.relaxed(chain), **arguments).outcome is Outcome.LIMIT
    monkeypatch.setattr(module, "compiled", lambda _: 1000.0)
    assert rearrange(chain, State.relaxed(chain), **arguments).outcome is Outcome.AT_REST


def test_a_run_says_from_where_on_rounding_has_grown_beyond_its_promise() -> None:
    chain = Chain(4, 1000, "1/2", "3/5", "1/100", tan_alpha="0")
    arguments = {"seed": 3, "record": ("tension",)}
    run = creep(chain, Cycles("0.006", 2), **arguments)
    truth = creep(chain, Cycles("0.006", 2), solver="certified", **arguments)
    off = abs(run.recorded["tension"] - truth.recorded["tension"]).max(axis=1)
    assert run.evidence is Evidence.UNDECIDED
    assert run.undecided == run.long_rearrangements == 0
    first = 1 + int((off > 1e-12).argmax())
    assert 1 < run.undecided_from <= first
    assert truth.evidence is Evidence.PROVED
    assert truth.undecided_from == 0
    trusted = run.trusted_half_cycles
    assert trusted is not None
    assert off[:trusted].max() <= 1e-9


def test_a_twin_is_followed_to_the_end_where_it_never_parts() -> None:
    chain = Chain(2, 1000, "1/2", "3/5", tan_alpha="1/4")
    run = creep(chain, Cycles("0.001", 2000), twin=True)
    assert run.evidence is Evidence.COMPUTED
    assert run.trusted_half_cycles == run.half_cycles == 4000
    assert creep(chain, Cycles("0.001", 20_000)).trusted_half_cycles is None
