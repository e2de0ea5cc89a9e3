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
