"""What every solver refuses, whatever its algorithm."""

from __future__ import annotations

import pytest

from exactcreep.model.chain import Chain
from exactcreep.model.numbers import InputError
from exactcreep.model.state import State
from exactcreep.solvers.registry import SOLVERS, solver_named
from tests.paper import paper_chain

EVENTS_HAPPEN = sorted(set(SOLVERS) - {"sliding", "auto"})


@pytest.mark.parametrize("name", [*EVENTS_HAPPEN, "sliding"])
def test_a_quantity_that_nobody_records_is_refused_by_name(name: str) -> None:
    chain = paper_chain(3)
    with pytest.raises(InputError, match="must be one of x_G") as caught:
        solver_named(name, {}).simulation(chain, State.relaxed(chain), 0, ("x_G", "velocity"))
    assert (caught.value.field, caught.value.value) == ("record", "velocity")


@pytest.mark.parametrize("name", EVENTS_HAPPEN)
def test_a_chain_without_slips_is_sent_to_the_sliding_limit(name: str) -> None:
    chain = Chain(3, 1000, "0.5", "0.5", tan_alpha="0.25")
    state = State.relaxed(chain)
    solver = solver_named(name, {})
    for call in (
        lambda: solver.simulation(chain, state, 0, ("x_G",)),
        lambda: solver.rearrange(chain, state, 1, 0),
        lambda: next(solver.iterate(chain, state, 1, 0)),
    ):
        with pytest.raises(InputError, match="sliding") as caught:
            call()
        assert caught.value.field == "mu_s"
