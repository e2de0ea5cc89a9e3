"""Each rule of starts, stops and ties in situations worked out by hand, by each solver.

On the level ``cos(alpha) = 1``; with the coefficients below all forces are sums of a few powers of
two, so that what stands exactly at an edge does so in float64, too. A slider that starts with the
force f slips by f - 1/2 if two springs hold it, and ends with the force 1 - f.
"""

from __future__ import annotations

from fractions import Fraction
from typing import NamedTuple

import numpy as np
import pytest

from exactcreep import Chain, Path, State, creep, rearrange

SOLVERS = ("exact", "reference", "certified")
HELD = "4"  # a static coefficient that no force of these reaches
MU_D, MU_S = "1/2", "3/4"


class Situation(NamedTuple):
    """Tensions and coefficients of a start, how theta goes, and the events that come first."""

    tensions: str
    events: str
    direction: int = 0
    coefficients: str = ""
    whole: bool = True
    at_once: int = 1  # so many events at time zero


SITUATIONS = {
    "a force beyond the threshold starts a slider its way": Situation(
        "1", "start +1 -2 stop +1 -2"
    ),
    "the other way": Situation("-1", "start -1 +2 stop -1 +2"),
    "exactly at threshold a slider stays": Situation("3/4", ""),
    "exactly at the opposite threshold": Situation("-3/4", ""),
    "one that has stopped goes back beyond its new threshold": Situation(
        "-1 1", "start +2 stop +2 start -2 stop -2", 0, f"{HELD} {MU_S} {HELD}"
    ),
    "and from the other side": Situation(
        "1 -1", "start -2 stop -2 start +2 stop +2", 0, f"{HELD} {MU_S} {HELD}"
    ),
    "exactly at its new threshold it stays": Situation(
        "-7/8 7/8", "start +2 stop +2", 0, f"{HELD} {MU_S} {HELD}"
    ),
    "a neighbour that reaches its threshold at the stop stays": Situation(
        "7/16 5/4", "start +2 stop +2", 0, f"{MU_S} {MU_S} {HELD}"
    ),
    "a neighbour that reaches it before starts": Situation(
        "15/32 41/32", "start +2 start +1", 0, f"{MU_S} {MU_S} {HELD}", whole=False
    ),
    "two neighbours that reach it together start as one event": Situation(
        "-1 -1/2 1/2 1",
        "start +3 start +2 +4",
        0,
        f"{HELD} {MU_S} {MU_S} {MU_S} {HELD}",
        whole=False,
    ),
    "of two neighbours the nearer starts first": Situation(
        "-17/16 -1/2 1/2 1",
        "start +3 start +2 start +4",
        0,
        f"{HELD} {MU_S} {MU_S} {MU_S} {HELD}",
        whole=False,
    ),
    "the nearer on the other side": Situation(
        "-1 -1/2 1/2 17/16",
        "start +3 start +4 start +2",
        0,
        f"{HELD} {MU_S} {MU_S} {MU_S} {HELD}",
        whole=False,
    ),
    "both ends that reach their thresholds together start together": Situation(
        "0 0", "start -1 +3", +1, whole=False
    ),
    "on a ramp the nearer end starts": Situation("1/8 0", "start +1", -1, whole=False),
    "or the other end": Situation("0 1/8", "start -3", -1, whole=False),
    "or the one whose coefficient is lower": Situation(
        "0 0", "start -1", +1, f"{MU_S} {MU_S} 13/16", whole=False
    ),
    "an end without excess slips by nothing, and draws": Situation(
        "0 0", "start +3 stop +3", +1, f"{MU_S} {MU_S} {MU_D}", at_once=2
    ),
    "two that move together slip by nothing": Situation(
        "0", "start -1 +2 stop -1 +2", +1, f"{MU_D} {MU_D}", at_once=2
    ),
    "one at threshold starts at once where movers take it beyond": Situation(
        "0 3/4 13/8",
        "start +3 -4 start +2",
        0,
        f"{MU_S} {MU_S} {MU_S} {MU_S}",
        whole=False,
        at_once=2,
    ),
    "one at threshold stays where movers draw it back": Situation(
        "0 -3/4 1/8", "start +3", 0, whole=False
    ),
    "one at threshold stays where two movers cancel": Situation(
        "-3/8 7/16 19/16 3/8", "start +2 -4 stop +2 -4"
    ),
}


def told(itinerary: object) -> str:
    words = []
    for kind, sliders, signs in itinerary:
        words += [
            kind,
            *(f"{'+' if s > 0 else '-'}{n}" for n, s in zip(sliders, signs, strict=True)),
        ]
    return " ".join(words)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("name", SITUATIONS)
def test_a_rule_holds_in_the_situation_that_it_is_for(solver: str, name: str) -> None:
    situation = SITUATIONS[name]
    tensions = [Fraction(word) for word in situation.tensions.split()]
    chain = Chain(len(tensions) + 1, 1000, MU_D, MU_S, tan_alpha=0)
    held = [float(Fraction(word)) for word in situation.coefficients.split()] or [0.75] * chain.n
    rest = State.prepared(chain, tensions)
    start = State(rest.tensions, rest.displacements, np.array(held), rest.draws, rest.theta)
    found = rearrange(chain, start, direction=situation.direction, solver=solver)
    assert sum(event.time == 0 for event in found.events[:2]) == min(
        situation.at_once, len(found.events)
    )
    events = told(found.itinerary)
    assert (events if situation.whole else events[: len(situation.events)]) == situation.events


@pytest.mark.parametrize("solver", [*SOLVERS, "verlet"])
def test_an_end_that_reaches_its_threshold_at_the_end_of_a_ramp_stays(solver: str) -> None:
    chain = Chain(2, 1000, MU_D, MU_S, tan_alpha=0)
    there = creep(chain, Path(["3/4000"]), solver=solver)
    beyond = creep(chain, Path(["3/4000", "3001/4000000"]), solver=solver)
    assert (there.event_count, beyond.event_count) == (0, 2)
