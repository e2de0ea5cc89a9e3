"""What is said of a rearrangement's error and order holds: by `certified`, and by stored truths.

Where a comparison is close the order may be another: then a result is undecided, or right.
"""

from __future__ import annotations

import math
import random
from collections import Counter
from collections.abc import Iterable
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np

from exactcreep import Chain, Evidence, Outcome, State, rearrange
from exactcreep.solvers.interface import TENSION_TOLERANCE, Rearrangement
from tests.data.hard_starts import Start, digest, stored
from tests.paper import unstable_chain

COMPUTED, UNDECIDED = Evidence.COMPUTED, Evidence.UNDECIDED


def require_true(result: Rearrangement, alike: bool, places: Iterable[Any]) -> float:
    """Require that what is said is true, the events being those of the truth or not.

    Return the largest error of a displacement or a tension.
    """
    pairs = zip(result.state.displacements.tolist(), places, strict=True)
    off = [Fraction(float(a)) - Fraction(b) for a, b in pairs]
    error = float(max(map(abs, [*off, *(b - a for a, b in pairwise(off))])))
    about = result.chain, result.initial
    assert (alike and error <= TENSION_TOLERANCE) or result.evidence is UNDECIDED, about
    assert error <= result.error, about
    return error


def decimals(truth: Rearrangement) -> list[str]:
    return [x.str(25, radius=False) for x in truth.state.displacements.tolist()]


def test_the_estimate_is_above_the_error_and_not_far_above() -> None:
    rng, ratios = random.Random(2011), []
    for least, most, count in ((1, 9, 12), (10, 99, 6), (100, 400, 1)):
        while count:
            chain, state = unstable_chain(rng)
            drawn = rearrange(chain, state, direction=0, seed=3)
            if least <= len(drawn.events) <= most and drawn.outcome is Outcome.AT_REST:
                truth = rearrange(chain, state, direction=0, seed=3, solver="certified", digits=25)
                error = require_true(drawn, drawn.itinerary == truth.itinerary, decimals(truth))
                ratios.append(error / drawn.error)
                count -= 1
    assert max(ratios) < 1
    assert np.median(ratios) > 1 / 50


def verdicts_on(starts: Iterable[Start]) -> Counter[tuple[bool, Evidence]]:
    """Return whether results are right, and their evidence; all that they say is true."""
    found: Counter[tuple[bool, Evidence]] = Counter()
    for start in starts:
        result = start.rearranged()
        alike = digest(result.itinerary) == start.events
        error = require_true(result, alike, start.places)
        right = alike and error <= TENSION_TOLERANCE
        found[right, result.evidence] += 1
    return found


def test_what_is_said_of_a_hard_start_is_true_and_not_all_is_in_doubt() -> None:
    grazes = stored("near-graze")
    said = verdicts_on(grazes)
    assert said[False, UNDECIDED] >= len(grazes) // 16
    assert said[True, UNDECIDED] <= said[False, UNDECIDED]  # what is right is seldom in doubt
    said = verdicts_on(stored("edge"))  # within a few floats of where the events change
    assert said.total() == 205
    assert said[True, COMPUTED] >= 40
    said = verdicts_on(stored("hard"))
    assert said.total() == 41
    assert said[True, COMPUTED] >= 39
    said = verdicts_on(stored("touch"))
    assert said[True, COMPUTED] == 0
    assert said.total() == 5


STEEP = Chain(3, 1, "1/2", "3/5", tan_alpha="7/10")
STILL = Chain(3, 1, "1/2", "3/5", tan_alpha="1/4")


def test_the_error_is_small_where_nothing_is_in_doubt_and_infinite_where_a_rule_settles_a_tie() -> (
    None
):
    away = rearrange(STEEP, State.relaxed(STEEP), direction=1)
    assert away.outcome is Outcome.RUNAWAY
    assert 0 < away.error <= TENSION_TOLERANCE
    still = rearrange(STILL, State.relaxed(STILL), direction=0)
    assert (still.events, still.error) == ((), 0)
    for k in (13, 17):  # slider 1 needs 2D for a start when slider 2 has slipped that far
        chain = Chain(2, 1, "1/2", "3/5", tan_alpha=Fraction(1, 2) - Fraction(1, 10**k))
        result = rearrange(chain, State.relaxed(chain), direction=1)
        assert (len(result.events), result.undecided) == (2, k == 17)
        assert result.error == math.inf if k == 17 else result.error < 1e-14
