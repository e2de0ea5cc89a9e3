"""Each rule of starts, stops and ties in situations worked out by hand, by each solver.

On the level ``cos(alpha) = 1``; with the coefficients below all forces are sums of a few powers of
two, so that what stands exactly at an edge does so in float64, too. A slider that starts with the
force f slips by f - 1/2 if two springs hold it, and ends with the force 1 - f.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from exactcreep import Chain, State, Targets, creep, rearrange
from exactcreep.solvers.rearrangement import Rearrangement

SOLVERS = ("exact", "certified")
ALL = "3/4 3/4 3/4"
LAST_HELD = "3/4 3/4 4"
BOTH_HELD = "4 3/4 4"  # no force of these reaches a coefficient of 4
INNER = "4 3/4 3/4 3/4 4"
SITUATIONS = [
    # what holds; tensions; coefficients; the way of the ramp; events ("=": at the same time)
    ("a force beyond the threshold starts a slider its way", "1", "3/4 3/4", 0,
     "start +1 -2, stop +1 -2"),
    ("exactly at threshold a slider stays", "3/4", "3/4 3/4", 0, ""),
    ("one that has stopped goes back beyond its new threshold", "-1 1", BOTH_HELD, 0,
     "start +2, stop +2 = start -2, stop -2"),
    ("exactly at its new threshold it stays", "-7/8 7/8", BOTH_HELD, 0, "start +2, stop +2"),
    ("all that stop draw before any of them is tested", "9/5 9/5", "9/10 4 9/10", 0,
     "start +1 -3, stop +1 -3 = start -1 +3, stop -1 +3"),
    ("a neighbour that reaches its threshold at the stop stays", "7/16 5/4", LAST_HELD, 0,
     "start +2, stop +2"),
    ("a neighbour that reaches it before starts", "15/32 41/32", LAST_HELD, 0,
     "start +2, start +1, ..."),
    ("one that starts without drive is carried along", "1 7/8", "3/4 1/2 4", 0,
     "start +1, start +2, stop +1, ..."),
    ("two neighbours that reach it together start as one event", "-1 -1/2 1/2 1", INNER, 0,
     "start +3, start +2 +4, ..."),
    ("of two neighbours the nearer starts first", "-17/16 -1/2 1/2 1", INNER, 0,
     "start +3, start +2, start +4, ..."),
    ("both ends that reach their thresholds together start together", "0 0", ALL, 1,
     "start -1 +3, ..."),
    ("on a ramp the nearer end starts", "1/8 0", ALL, -1, "start +1, ..."),
    ("or the one whose coefficient is lower", "0 0", "3/4 3/4 13/16", 1, "start -1, ..."),
    ("an end without excess slips by nothing, and draws", "0 0", "3/4 3/4 1/2", 1,
     "start +3 = stop +3"),
    ("two that move together slip by nothing", "0", "1/2 1/2", 1, "start -1 +2 = stop -1 +2"),
    ("one at threshold starts at once where movers take it beyond", "0 3/4 13/8",
     "3/4 3/4 3/4 3/4", 0, "start +3 -4 = start +2, ..."),
    ("one at threshold stays where movers draw it back", "0 -3/4 1/8", "3/4 3/4 3/4 3/4", 0,
     "start +3, stop +3"),
    ("one at threshold stays where two movers cancel", "-3/8 7/16 19/16 3/8",
     "3/4 3/4 3/4 3/4 3/4", 0, "start +2 -4, stop +2 -4"),
    ("and where two movers cancel that start their other neighbours", "-3/8 0 1 7/4 3/4 3/8",
     "3/4 3/4 3/4 3/4 3/4 3/4 3/4", 0, "start +3 -5, start +2 -6, ..."),
]  # fmt: skip


def told(found: Rearrangement) -> str:
    text, last = "", -1.0
    for event in found.events:
        sliders = zip(event.sliders, event.signs, strict=True)
        text += " = " if float(event.time) == last else ", " * bool(text)
        text += " ".join([event.kind.value, *(f"{sign * n:+}" for n, sign in sliders)])
        last = float(event.time)
    return text


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize(
    ("tensions", "coefficients", "direction", "events"),
    [each[1:] for each in SITUATIONS],
    ids=[each[0] for each in SITUATIONS],
)
def test_a_rule_holds_in_the_situation_that_it_is_for(
    solver: str, tensions: str, coefficients: str, direction: int, events: str
) -> None:
    held = np.array([float(Fraction(word)) for word in coefficients.split()])
    chain = Chain(held.size, 1000, "1/2", "3/4", tan_alpha=0)
    rest = State.prepared(chain, [Fraction(word) for word in tensions.split()])
    start = State(rest.tensions, rest.displacements, held, rest.draws, rest.theta)
    found = rearrange(chain, start, direction=direction, solver=solver)
    begins = events.removesuffix("...")
    assert told(found).startswith(begins)
    assert begins != events or told(found) == events
    stopped = found.state.draws > 1
    assert found.state.draws.sum() - chain.n == sum(
        len(event.sliders) for event in found.events if event.kind.value == "stop"
    )
    assert found.state.coefficients.tolist() == np.where(stopped, 0.75, held).tolist()


@pytest.mark.parametrize("solver", [*SOLVERS, "verlet"])
def test_an_end_that_reaches_its_threshold_at_the_end_of_a_ramp_stays(solver: str) -> None:
    chain = Chain(2, 1000, "1/2", "3/4", tan_alpha=0)
    there = creep(chain, Targets(["3/4000"]), solver=solver)
    beyond = creep(chain, Targets(["3/4000", "3001/4000000"]), solver=solver)
    assert (there.event_count, beyond.event_count) == (0, 2)
